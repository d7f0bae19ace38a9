"""A slider-crank from two planar rigid bodies, two pins and a slide, simplified to the graph that one would draw by hand.

Prints how many bonds each rule leaves, and that the expanded graph and the condensed one reduce to the same inertia and
moment at every crank angle.

    python examples/bond_graphs/rosenberg.py rosenberg.png
"""

import sys
from pathlib import Path

import numpy as np

import bondgraph
from bondgraph import Builder, I, Se, reduce
from bondgraph.planar import Bar, Linkage, counts, slider_crank

RADIUS, ROD, CRANK, MASS, SWING, SLIDER, FORCE = 0.2, 0.6, 1.0, 2.0, 0.06, 3.0, -50.0


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


def main(path: str | Path | None = None) -> None:
    """Print the counts and the agreement; draw the simplified graph into a file if one is given."""
    expanded = machine()
    for count in counts(expanded.graph, keep=(expanded.coordinate,)):
        print(f"{count.bonds:4d} bonds  {count.rule}")
    phi = np.linspace(0.0, 2 * np.pi, 721)
    whole, short = expanded.reduction()(phi), reduce(condensed(), phi)
    for name, unit in (("inertia", "kg m²"), ("slope", "kg m²"), ("moment", "N m")):
        one, other = getattr(whole, name), getattr(short, name)
        gap = np.abs(one - other).max() / np.abs(other).max()
        print(f"{name:8s} greatest {np.abs(other).max():9.6f} {unit}, expanded and condensed differ by {gap:.1e} of it")
    if path is not None:
        graph = bondgraph.simplify(expanded.graph, keep=(expanded.coordinate,)).graph
        bondgraph.draw(graph, path, title="Slider-crank from planar rigid bodies, simplified")


if __name__ == "__main__":
    main(*sys.argv[1:2])
