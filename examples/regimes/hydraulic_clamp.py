"""The injection clamp closed by a hydraulic cylinder: its stroke in time, and what the size of the orifice does to it.

    python hydraulic_clamp.py [figure.png]

The cylinder pushes with p A - k v|v|: the oil behind its piston leaves through an orifice. Prints the stroke for three
orifices (time, greatest speed, speed at the lock, where the pump's energy goes), then the motion with the scene's own one,
with what the tie bars pull and what it takes to hold them. At the lock they pull with stiffness times stretch whatever
the cylinder does, and it holds them with next to nothing. With a file name, draws block and platen and the forces in the
pins over the time of the stroke (figure_stroke.png).
"""

from __future__ import annotations

import sys
import tomllib
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

import flywheel
from flywheel.motions.motion import Motion
from flywheel.numerics.units import columns
from flywheel.regime.state import along
from flywheel.scene.scene import Scene

SCENE = Path(__file__).with_suffix(".toml")
PRESSURE, AREA, THROTTLE = 30e5, 1256.64e-6, 18.6e3  # Pa, m², N s²/m²: as in the scene
STIFFNESS, STRETCH = 800e6, 0.25e-3  # N/m, m
START, END = -0.060, 0.190  # m
LONGEST = 10.0  # s
SHARES = (1.0, 1.5, 2.0)  # of the scene's orifice
PLATEN = "toggle-clamp.platen"


def clamp(throttle: float = THROTTLE) -> Scene:
    """The scene with a throttle of its own, N s²/m²."""
    raw: dict[str, Any] = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    raw["parameters"]["throttle"] = throttle
    return flywheel.load(raw)


def closed(scene: Scene) -> Motion:
    """The motion from rest to the end of the stroke."""
    return flywheel.simulate(scene, phi=START, omega=0.0, until=LONGEST, rtol=1e-7)


def stroke_row(share: float, motion: Motion, throttle: float) -> list[str]:
    """A stroke with an orifice of some share of the scene's area: times, speeds, energies."""
    time = float(motion.t[-1])
    x, v = motion.at(np.linspace(0.0, time, 20001))
    pump = PRESSURE * AREA * (END - START)
    heat = float(np.trapezoid(throttle * v**2, x))
    figures = [time, sqrt(PRESSURE * AREA / throttle), v.max(), v[-1]]
    return [f"{share:g}", *(f"{value:.5f}" for value in figures), f"{pump:.2f}", f"{heat:.2f}"]


def course(scene: Scene, motion: Motion) -> list[list[str]]:
    """Rows along the stroke: block, time, its speed, cylinder, platen's speed, tie bars, force that would hold the block."""
    rows = []
    for x in (*np.linspace(START, END, 11)[1:-1], 0.185, END):
        time = _time_at(motion, float(x))
        v = float(motion.at(time)[1][0])
        moving, held = along(scene, [x], speed=v), along(scene, [x], speed=0.0, acceleration=0.0)
        gain = float(held.state.gains[PLATEN][0])
        bars = -float(held.state.moment_parts[f"load[0] on {PLATEN}"][0]) / gain
        cylinder, platen = PRESSURE * AREA - THROTTLE * v**2, float(moving.velocities[PLATEN][0])
        figures = [1e3 * x, 1e3 * time, 1e3 * v, cylinder / 1e3, 1e3 * platen, bars / 1e3, float(held.driving[0]) / 1e3]
        rows.append([f"{value + 0.0:.3f}" for value in figures])
    return rows


def _time_at(motion: Motion, x: float) -> float:
    """Time at which the block is at x (m), by Newton's method from between two steps."""
    last = float(motion.t[-1])
    time = float(np.interp(x, motion.phi, motion.t))
    for _ in range(20):
        at, v = motion.at(time)
        time = min(time + (x - float(at[0])) / float(v[0]), last)
    return time


PINS = {"block_pin": "#56B4E9", "coupler_pin": "#D55E00", "pivot": "#009E73", "rod_pin": "#CC79A7", "platen_pin": "#000000"}


def plot(scene: Scene, path: Path) -> None:
    """Position, velocity and acceleration of block and platen over time, and the resultants in the pins."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    run = flywheel.transient(scene, end=LONGEST, rtol=1e-7)
    moved, forces = flywheel.motion(scene, transient=run, points=501), flywheel.joint_forces(scene, transient=run)
    figure = Figure(figsize=(9.0, 11.0), layout="constrained")
    FigureCanvasAgg(figure)
    *panels, last = figure.subplots(4, 1, sharex=True)
    for name, colour in (("block", "#0072B2"), ("platen", "#D55E00")):
        curve = moved[f"{name}_guide"]
        for panel, values, unit in zip(panels, curve[3:6], ("m", "m/s", "m/s²"), strict=True):
            panel.plot(moved.t, values, color=colour, label=name)
            panel.set(ylabel=unit)
    for panel, title in zip(panels, ("Position", "Velocity", "Acceleration"), strict=True):
        panel.set(title=title)
    found = forces.mechanisms["toggle-clamp"]
    for pin, colour in PINS.items():
        wide = 5.0 if pin == "block_pin" else 1.6  # under the coupler's other pin: the coupler is light
        last.semilogy(
            forces.motion.time, found.resultant(pin) / 1e3, color=colour, label=pin.replace("_", " "), linewidth=wide
        )
    last.set(title="Forces in the pins", ylabel="kN", xlabel="t, s", xlim=(0.0, run.time))
    for panel in (*panels, last):
        panel.grid(color="#DDDDDD", linewidth=0.6)
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    figure.savefig(path, dpi=100)


def main(path: str | None = None) -> None:
    """Print the tables; draw the figure if a name is given."""
    throttles = {share: THROTTLE / share**2 for share in SHARES}
    motions = {share: closed(clamp(throttle)) for share, throttle in throttles.items()}
    rows = [stroke_row(share, motions[share], throttles[share]) for share in SHARES]
    head = ["orifice", "time, s", "p A = k v², m/s", "greatest, m/s", "at lock", "pump, J", "heat of the oil, J"]
    print("\n".join(columns(rows, head)))
    own = clamp()
    head = ["block, mm", "time, ms", "block, mm/s", "cylinder, kN", "platen, mm/s", "tie bars, kN", "holds it, kN"]
    print("\nwith the scene's own orifice")
    print("\n".join(columns(course(own, motions[1.0]), head)))
    needed = along(own, np.linspace(START, END, 2001), speed=0.0, acceleration=0.0).driving
    print(f"\n  tie bars at the lock    {STIFFNESS * STRETCH / 1e3:.1f} kN")
    print(f"  cylinder at rest        {PRESSURE * AREA / 1e3:.3f} kN")
    print(f"  most to hold the block  {needed.max() / 1e3:.3f} kN on the way, {needed[-1] / 1e3:.3f} kN at the lock")
    if path is not None:
        plot(own, Path(path).with_stem(f"{Path(path).stem}_stroke"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
