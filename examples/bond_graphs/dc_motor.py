"""A DC motor drives a slider-crank through a gear and a compliant shaft: two domains, four independent states.

Electrical side (voltage, resistance, inductance), gyrator, rotor with friction, shaft with stiffness and damping, gear,
crank, slider with a force and friction. Prints the graph, its causality and state equations, follows it from rest, and
audits the power.

    python examples/bond_graphs/dc_motor.py dc_motor.png
"""

import sys
from pathlib import Path

import numpy as np

from bondgraph import GY, Builder, C, I, Part, R, Run, Se, causality, draw, simulate

RADIUS, ROD = 0.1, 0.35  # m


def travel(phi):
    """Slider's velocity over the crank's speed, m."""
    return -RADIUS * np.sin(phi) * (1 + RADIUS * np.cos(phi) / np.sqrt(ROD**2 - (RADIUS * np.sin(phi)) ** 2))


def motor() -> Part:
    """Armature and rotor, open at the rotor's shaft."""
    b = Builder().one("armature", "electric").one("rotor", "rotation")
    b.on("armature", Se("voltage", 48.0), R("resistance", 0.4), I("inductance", 0.002))
    b.add(GY("constant", 0.25))  # V s/rad = N m/A
    b.bond("armature", "constant").bond("constant", "rotor")
    return b.on("rotor", I("inertia", 0.004), R("friction", 0.002)).part("rotor")


def slider_crank() -> Part:
    """Crank and slider, open at the crank."""
    b = Builder().one("crank", "rotation", displacement="phi").one("slider", "translation")
    b.on("crank", I("inertia", 0.15)).on("slider", I("mass", 8.0), R("friction", 20.0), Se("force", -60.0))
    return b.transform("crank", "slider", travel, name="travel").part("crank")


def build():
    """The machine, put together from its parts."""
    b = Builder().include("motor", motor()).include("press", slider_crank()).one("pinion", "rotation")
    b.between("motor.rotor", "pinion", C("shaft", stiffness=60.0), R("hysteresis", 0.02), name="coupling")
    return b.transform("pinion", "press.crank", 1 / 8, name="gear").build()


def main(path: str | Path | None = None) -> Run:
    """Print everything; draw the graph and the motion into `path`'s folder if one is given."""
    graph = build()
    print(graph, causality(graph).describe(), sep="\n\n")
    run = simulate(graph, 1.0, rtol=1e-8)
    motor, crank, current = (run.flow(name) for name in ("motor.rotor", "press.crank", "motor.armature"))
    print(f"\nafter 1 s: motor {motor[-1]:.4f} rad/s, crank {crank[-1]:.4f} rad/s")
    print(f"current at most {current.max():.2f} A, twist at most {1e3 * run.displacement('shaft').max():.2f} mrad")
    print(f"estimated error {run.error:.1e} of {run.rtol:g} asked, in {run.evaluations} evaluations")
    audit = run.audit
    print(f"power audit: {audit.power:.1e} (worst at {audit.power_at}), energy {audit.energy:.1e}")
    supplied, dissipated, stored = (float(e[-1]) for e in (audit.supplied, audit.dissipated, audit.stored))
    print(f"energy: supplied {supplied:.3f} J, dissipated {dissipated:.3f} J, stored {stored:.3f} J")
    if path is not None:
        draw(graph, Path(path).with_stem(Path(path).stem + "_graph"))
        plot(run, path)
    return run


def plot(run: Run, path: str | Path) -> None:
    """Current, speeds and twist over time."""
    from matplotlib.figure import Figure

    t = np.linspace(0.0, 1.0, 1000)
    figure = Figure(figsize=(8, 7), layout="constrained")
    current, speed, twist = figure.subplots(3, 1, sharex=True)
    current.plot(t, run.flow("motor.armature", t), color="#0072B2")
    current.set_ylabel("current, A")
    speed.plot(t, run.flow("motor.rotor", t) / 8, color="#D55E00", label="motor / 8")
    speed.plot(t, run.flow("press.crank", t), color="#009E73", label="crank")
    speed.set_ylabel("speed, rad/s")
    speed.legend(loc="lower right")
    twist.plot(t, 1e3 * run.displacement("shaft", t), color="#CC79A7")
    twist.set_ylabel("twist, mrad")
    twist.set_xlabel("time, s")
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(*sys.argv[1:2])
