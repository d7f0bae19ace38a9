"""A slider-crank from two rigid bodies, simplified to the graph that one would draw by hand, and what a step too many costs.

Prints how many bonds each rule leaves, and that the expanded graph and the condensed one reduce to the same inertia and
moment at every crank angle. Then what it costs to simplify too far. A thesis on the slider-crank ends with 17 bonds; the
rules leave 22 of the machine above, and 23 of the thesis's own (a moment and an inertia on the crank, a force and friction
on the slider, which has no mass but the rod's). Its last step is none of the rules: as the slider has no velocity across
its line, it takes the rod's centre of mass to have none, and drops that inertia and the transformer of the slider's pin.
That is another machine, in which the rod's centre runs along the line and the slider's pin leaves it.

    python examples/bond_graphs/rosenberg.py rosenberg.png    # the graph; rosenberg_held.png: the inertias of both machines
"""

import sys
from pathlib import Path

import numpy as np
from planar import Bar, Linkage, counts, fix, pin, slider_crank

import bondgraph
from bondgraph import Builder, I, R, Reduction, Se, Sf, drop_zero_velocity, reduce, simplify

RADIUS, ROD, CRANK, MASS, SWING, SLIDER, FORCE = 0.2, 0.6, 1.0, 2.0, 0.06, 3.0, -50.0
ROD_ALONE = Bar(ROD, 1.5, 0.05, com=0.2)  # as long to its centre as the crank, so that the rod held there turns by -theta
LOADS = {"crank.turn": [Se("M", 40.0)], "rod.2.x": [Se("F", -300.0), R("B", 5.0)]}


def machine() -> Linkage:
    """Crank balanced on its pivot, rod with its mass in the middle, slider with a force."""
    crank = Bar(RADIUS, 4.0, CRANK, com=0.0)
    rod = Bar(ROD, MASS, SWING, com=ROD / 2)
    return slider_crank(crank, rod, SLIDER, on={"rod.2.x": (Se("F", FORCE),)})


def condensed() -> bondgraph.BondGraph:
    """The same machine by influence coefficients: one transformer for each velocity."""

    def root(theta):
        return np.sqrt(ROD**2 - (RADIUS * np.sin(theta)) ** 2)

    def travel(theta, share=1.0):
        return -RADIUS * np.sin(theta) - share * RADIUS**2 * np.sin(theta) * np.cos(theta) / root(theta)

    b = Builder().one("crank", "rotation", displacement="theta").on("crank", I("J", CRANK))
    for name, ratio in (("slider", travel), ("rod_x", lambda theta: travel(theta, 0.5))):
        b.one(name, "translation").transform("crank", name, ratio)
    b.one("rod_y", "translation").transform("crank", "rod_y", lambda theta: 0.5 * RADIUS * np.cos(theta))
    b.one("rod", "rotation").transform("crank", "rod", lambda theta: -RADIUS * np.cos(theta) / root(theta))
    b.on("rod_x", I("m_x", MASS)).on("rod_y", I("m_y", MASS)).on("rod", I("J_rod", SWING))
    return b.on("slider", I("m", SLIDER), Se("F", FORCE)).build()


def whole() -> Linkage:
    """The machine of the thesis, with the crank's centre on its pivot."""
    return slider_crank(Bar(RADIUS, 2.0, 0.1, com=0.0), ROD_ALONE, on=LOADS)


def centre_held() -> bondgraph.BondGraph:
    """The last step of the thesis: the rod's centre of mass is held on the line, and the slider's pin is not."""
    b = Builder().include("crank", Bar(RADIUS, 2.0, 0.1).body()).include("rod", ROD_ALONE.body(inlets=("1", "2")))
    pin(fix(b, "crank.1"), "crank.2", "rod.1").on("rod.y", Sf("hold", 0.0))
    for junction, elements in LOADS.items():
        b.on(junction, *elements)
    return simplify(drop_zero_velocity(b.build(loose=True)).graph).graph


def inertias(theta):
    """I* of the machine and of the one whose rod is held by its centre, kg m²; the latter's rod stands at -theta."""
    held = Reduction(centre_held(), "crank.turn", {"rod.theta": lambda phi: -phi})
    return whole().reduction()(theta).inertia, held(theta).inertia


def too_far(path: Path | None) -> None:
    """Error of the thesis's last step, in bonds and in inertia; I* over a turn is drawn into a file if one is given."""
    true, held = inertias(np.array([0.5]))
    off = 1e3 * (ROD - RADIUS) * np.sin(0.5)
    print("\nthe thesis's machine, which it draws with 17 bonds")
    print(f"{len(simplified(whole()).bonds):4d} bonds  by the rules; I*(0.5 rad) = {true[0]:.4f} kg m²")
    print(f"{len(centre_held().bonds):4d} bonds  rod's centre held on the line, as there; I*(0.5 rad) = {held[0]:.4f} kg m²")
    print("            (the thesis also leaves out the slider's own bond and joins two transformers in a row)")
    print(f"that last step makes I* {100 * (held[0] / true[0] - 1):.0f} % too large there, and takes the slider's pin")
    print(f"{off:.0f} mm off its line")
    if path is not None:
        plot(path)


def plot(path: Path) -> None:
    """I* over a turn of the crank, true and with the rod's centre held."""
    from matplotlib.figure import Figure

    theta = np.linspace(0.0, 2 * np.pi, 361)
    true, held = inertias(theta)
    figure = Figure(figsize=(8, 4.2), layout="constrained")
    panel = figure.subplots()
    panel.plot(np.degrees(theta), true, color="#0072B2", label="slider on its line")
    panel.plot(np.degrees(theta), held, color="#D55E00", linestyle="--", label="rod's centre on the line: one step too far")
    panel.set(title="Reduced inertia at the crank", xlabel="crank angle, deg", ylabel="I*, kg m²", xlim=(0.0, 360.0))
    panel.set_xticks(range(0, 361, 45))
    panel.set_ylim(bottom=0.0)
    panel.grid(color="#DDDDDD", linewidth=0.6)
    panel.legend(loc="lower right")
    figure.savefig(path, dpi=120)


def simplified(linkage: Linkage) -> bondgraph.BondGraph:
    """A linkage's graph after all rules."""
    return simplify(linkage.graph, keep=(linkage.coordinate,)).graph


def main(path: str | Path | None = None) -> None:
    """Print the counts and the agreement; draw the simplified graph into a file if one is given."""
    expanded = machine()
    for rule, bonds in counts(expanded.graph, keep=(expanded.coordinate,)).items():
        print(f"{bonds:4d} bonds  {rule}")
    phi = np.linspace(0.0, 2 * np.pi, 721)
    large, small = expanded.reduction()(phi), reduce(condensed(), phi)
    for name, unit in (("inertia", "kg m²"), ("slope", "kg m²"), ("moment", "N m")):
        one, other = getattr(large, name), getattr(small, name)
        gap = np.abs(one - other).max() / np.abs(other).max()
        print(f"{name:8s} greatest {np.abs(other).max():9.6f} {unit}, expanded and condensed differ by {gap:.1e} of it")
    too_far(None if path is None else Path(path).with_stem(Path(path).stem + "_held"))
    if path is not None:
        bondgraph.draw(simplified(expanded), path, title="Slider-crank from planar rigid bodies, simplified")


if __name__ == "__main__":
    main(*sys.argv[1:2])
