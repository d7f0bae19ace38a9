"""Plane linkages: rigid bodies as parts with open pins, the joints between them, slider-crank and four-bar.

A body has the two velocities of its centre of mass, its rotation, and the two velocities of each pin, which follow from
these through modulated transformers (Rosenberg's body: Karnopp, Margolis & Rosenberg, *System Dynamics*). A joint is a bond
between equal velocities, or a source that keeps one at zero. A linkage is written joint by joint, and the solution closes
its loops. Lengths in m, angles in rad counter-clockwise from +x.

The source for comparison is a thesis on the slider-crank by bond graph (2023), its figures 31 to 39 and table 8.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from itertools import pairwise
from math import cos, isfinite, pi, sin
from typing import Any, NamedTuple

import numpy as np

import bondgraph
from bondgraph import BondGraph, Builder, Element, GraphError, I, Part, Reduction, Se, Sf

__all__ = [
    "Bar", "Formula", "Linkage", "Loads", "Point", "counts", "fix", "four_bar", "pin", "rigid_body", "slide",
    "slider_crank",
]  # fmt: skip

Point = tuple[float, float]
Formula = Callable[[Any], Any]
Loads = Mapping[str, Iterable[Element]]


def rigid_body(mass: Any, inertia: Any, pins: Mapping[str, Point], angle: float = 0.0, inlets: Collection[str] = ()) -> Part:
    """A plane rigid body with open ports: `turn`, `x` and `y` of the centre of mass, `NAME.x` and `NAME.y` of each pin.

    With (x, y) the pin's place in the body's own frame, whose origin is the centre of mass G and which has turned by theta:

        v_x = v_Gx - omega (x sin theta + y cos theta),  v_y = v_Gy + omega (x cos theta - y sin theta).

    Two pins in line with G lie at (-R1, 0) and (R2, 0). The source (its eq. 41 to 44) has v_x - omega R sin theta and
    v_y - omega R cos theta at both of them, and calls both v_1: the signs of v_1x and of v_2y are wrong. The moduli that
    it lists as T3 and T4, with R2, are those of the rod's pin 1, whose arm is the rod's R1.

    Args:
        mass: kg; 0 leaves the two inertias I out.
        inertia: about G, kg m²; 0 leaves it out.
        pins: name -> place in the body's frame, m. A pin at G needs no transformer; if all are there, nothing ties the
            rotation to the rest, and the two are separate graphs.
        angle: theta at the start, rad.
        inlets: the pins where power counts positive into the body; at the others out of it. A junction that
            only passes power on from an outlet to an inlet is one that simplification can drop.

    Raises:
        GraphError: if a place is no pair of finite numbers, or an inlet no pin.

    >>> bar = Builder().include("bar", rigid_body(2.0, 0.5, {"end": (0.3, 0.0)}))
    >>> pendulum = fix(bar, "bar.end").build()
    >>> len(pendulum.bonds), tuple(pendulum.displacements)
    (13, ('bar.theta',))
    >>> pendulum.elements["bar.end.y.arm"].law.symbolic()
    0.3*cos(bar.theta)

    """
    faults = [
        f"pin {name!r}: found {place!r}, expected two finite lengths (x, y) in the body's frame"
        for name, place in pins.items()
        if len(place) != 2 or not all(isinstance(value, float | int) and isfinite(value) for value in place)
    ]
    there = ", ".join(pins) or "none"
    faults += [f"inlet {name!r}: no such pin; the body has {there}" for name in inlets if name not in pins]
    if faults:
        raise GraphError("\n".join(faults))
    b = Builder().one("turn", "rotation", displacement="theta", initial=angle)
    b.one("x", "translation").one("y", "translation")
    for junction, name, value in (("turn", "J", inertia), ("x", "m.x", mass), ("y", "m.y", mass)):
        b = b.on(junction, I(name, value)) if value != 0 else b
    for name, place in pins.items():
        inward = name in inlets
        x, y = (-value if inward else value for value in place)  # an inlet's 0-junction takes the rotation's part with -1
        arms = {
            "x": lambda theta, x=x, y=y: -(x * np.sin(theta) + y * np.cos(theta)),
            "y": lambda theta, x=x, y=y: x * np.cos(theta) - y * np.sin(theta),
        }
        for axis, arm in arms.items():  # the pin's velocity: the centre's, and what the rotation adds
            target = f"{name}.{axis}"
            b.one(target, "translation")
            through = [axis, target]
            if any(place):
                b.zero(f"{target}.sum", "translation").transform("turn", f"{target}.sum", arm, name=f"{target}.arm")
                through.insert(1, f"{target}.sum")
            for tail, head in pairwise(reversed(through) if inward else through):
                b.bond(tail, head)
    return b.part("turn", "x", "y", *(f"{name}.{axis}" for name in pins for axis in "xy"))


def pin(builder: Builder, first: str, second: str) -> Builder:
    """Joins two pins (`crank.2`, `rod.1`): they have the same velocities; power counts positive from first to second."""
    for axis in "xy":
        builder.bond(f"{first}.{axis}", f"{second}.{axis}")
    return builder


def fix(builder: Builder, at: str) -> Builder:
    """Fix a pin (`crank.1`) in its place by sources of flow 0; their efforts are the forces of the bearing."""
    for axis in "xy":
        builder.port(f"{at}.{axis}", Sf(f"{at}.{axis}.hold", 0.0))
    return builder


def slide(builder: Builder, at: str, direction: float = 0.0) -> str:
    """Lets a pin (`rod.2`) slide along a straight guide: no velocity across it.

    The source of flow 0 gives the guide's force, positive to the left of `direction` (rad from +x).
    Returns the name of the 1-junction of the velocity along the guide; the slider's mass, friction and loads hang there.

    >>> b = Builder().include("block", rigid_body(1.0, 0.0, {"foot": (0.0, 0.0)}))
    >>> slide(b, "block.foot"), slide(b, "block.foot", 0.5)
    ('block.foot.x', 'block.foot.along')
    """
    along, across = f"{at}.x", f"{at}.y"
    if direction != 0.0:
        s, c = sin(direction), cos(direction)
        along, across = f"{at}.along", f"{at}.across"
        builder.sum(along, [(f"{at}.x", c), (f"{at}.y", s)], "translation")
        builder.sum(across, [(f"{at}.x", -s), (f"{at}.y", c)], "translation")
    builder.port(across, Sf(f"{across}.hold", 0.0))
    return along


class Bar(NamedTuple):
    """A body with two pins, 1 and 2, `length` apart; its angle is that of the line from pin 1 to pin 2.

    The centre of mass lies at the distance `com` from pin 1, in a direction `com_angle` from that line.
    """

    length: float
    mass: float = 0.0
    inertia: float = 0.0
    com: float = 0.0
    com_angle: float = 0.0

    def body(self, angle: float = 0.0, inlets: Collection[str] = ("1",)) -> Part:
        """The rigid body of this bar, at an initial angle (rad); by default power enters by pin 1."""
        x, y = self.com * cos(self.com_angle), self.com * sin(self.com_angle)
        return rigid_body(self.mass, self.inertia, {"1": (-x, -y), "2": (self.length - x, -y)}, angle, inlets)


class Linkage(NamedTuple):
    """An expanded graph, its coordinate, and the other angles as functions of the coordinate's.

    A graph of velocities does not give positions, so a `Reduction` needs `positions`; a simulation integrates the angles
    from their initial values.
    """

    graph: BondGraph
    coordinate: str
    positions: Mapping[str, Formula]

    def reduction(self) -> Reduction:
        """The reduction to the coordinate, without velocities kept at zero: a `Reduction` accepts no source Sf."""
        return Reduction(bondgraph.drop_zero_velocity(self.graph).graph, self.coordinate, self.positions)


def slider_crank(
    crank: Bar,
    rod: Bar,
    slider: float = 0.0,
    offset: float = 0.0,
    *,
    on: Loads | None = None,
    gravity: float = 0.0,
    start: float = 0.0,
) -> Linkage:
    """A slider-crank of two rigid bodies: crank pin 1 fixed at the origin, rod pin 2 on the line y = offset.

    Args:
        crank: its angle is phi.
        rod: from the crank's pin to the slider; theta = -arcsin((r sin phi - offset)/l).
        slider: mass of the slider, kg.
        offset: m.
        on: elements by 1-junction: `crank.turn`, `rod.turn`, `rod.2.x` (the slider), `rod.x` (centre of mass)...
        gravity: m/s² towards -y.
        start: crank angle at the start of a simulation, rad.

    Raises:
        GraphError: if the rod does not reach the line, at the start or at a required crank angle.

    >>> linkage = slider_crank(Bar(0.2, inertia=0.1), Bar(0.6), slider=3.0)
    >>> round(float(linkage.reduction()(np.pi / 2).inertia), 12)  # 0.1 + 3 * 0.2²
    0.22

    """
    _positive(crank=crank.length, rod=rod.length)

    def theta(phi: Any) -> Any:
        height = crank.length * np.sin(phi) - offset
        fault = f"rod: {rod.length:g} m do not reach the line of travel"
        return np.arctan2(-height, _root((rod.length - height) * (rod.length + height), phi, fault))

    bodies = {"crank": (crank, start), "rod": (rod, float(theta(start)))}
    b = fix(_bodies(bodies, gravity, last="rod"), "crank.1")
    pin(b, "crank.2", "rod.1")
    guided = slide(b, "rod.2")
    b = b.on(guided, I("slider", slider)) if slider else b
    return Linkage(_loaded(b, on), "crank.turn", {"rod.theta": theta})


def four_bar(
    ground: float,
    crank: Bar,
    coupler: Bar,
    rocker: Bar,
    *,
    crossed: bool = False,
    on: Loads | None = None,
    gravity: float = 0.0,
    start: float = 0.0,
) -> Linkage:
    """A four-bar of three rigid bodies: crank pin 1 fixed at the origin, rocker pin 1 at (ground, 0).

    The pin between coupler and rocker lies to the left of the line from the crank's pin to the rocker's pivot, `crossed`
    to the right. With D the length of that line and delta its angle, the coupler lies at delta + alpha and the rocker at
    delta + pi - beta, alpha and beta the triangle's angles by the half-angle formula; crossed, both change sign.

    Args:
        ground: distance of the pivots, m.
        crank: its angle is phi.
        coupler: from the crank's pin to the rocker's.
        rocker: from its pivot to the coupler.
        crossed: the other way to assemble it.
        on: elements by 1-junction: `crank.turn`, `coupler.turn`, `rocker.turn`, `coupler.x`...
        gravity: m/s² towards -y.
        start: crank angle at the start of a simulation, rad.

    Raises:
        GraphError: if coupler and rocker do not meet, at the start or at a required crank angle.

    >>> bars = Bar(1.0, inertia=0.5), Bar(3.0), Bar(3.0, inertia=2.0)
    >>> round(float(four_bar(4.0, *bars).reduction()(0.0).inertia), 12)  # the rocker turns at -1/3 of the crank's speed
    0.722222222222

    """
    _positive(ground=ground, crank=crank.length, coupler=coupler.length, rocker=rocker.length)
    angles = _four_bar_angles(ground, crank.length, coupler.length, rocker.length, -1.0 if crossed else 1.0)
    bars = {"coupler": coupler, "rocker": rocker}
    bodies = {"crank": (crank, start)} | {name: (bar, float(angles[name](start))) for name, bar in bars.items()}
    b = fix(fix(_bodies(bodies, gravity, last="rocker"), "crank.1"), "rocker.1")
    pin(pin(b, "crank.2", "coupler.1"), "coupler.2", "rocker.2")
    return Linkage(_loaded(b, on), "crank.turn", {f"{name}.theta": angle for name, angle in angles.items()})


def _bodies(bodies: Mapping[str, tuple[Bar, float]], gravity: float, last: str) -> Builder:
    """The bodies side by side, with their weights; power runs from pin 1 to pin 2 of each, and enters the last by both."""
    b = Builder()
    for name, (bar, angle) in bodies.items():
        b.include(name, bar.body(angle, ("1", "2") if name == last else ("1",)))
        if gravity and bar.mass:
            b.on(f"{name}.y", Se(f"{name}.weight", -bar.mass * gravity))
    return b


def _positive(**lengths: float) -> None:
    faults = [f"{name}: found {length}, expected a positive length" for name, length in lengths.items() if not length > 0]
    if faults:
        raise GraphError("\n".join(faults))


def _loaded(b: Builder, on: Loads | None) -> BondGraph:
    for junction, elements in (on or {}).items():
        b.on(junction, *((elements,) if isinstance(elements, Element) else elements))
    return b.build(loose=True)


def _four_bar_angles(ground: float, crank: float, bar: float, rocker: float, side: float) -> dict[str, Formula]:
    fault = f"coupler and rocker: {bar:g} m and {rocker:g} m do not meet"

    def triangle(phi: Any) -> tuple[Any, Any]:
        """The diagonal from the crank's pin to the rocker's pivot: its length and angle."""
        across, up = ground - crank * np.cos(phi), -crank * np.sin(phi)
        return np.hypot(across, up), np.arctan2(up, across)

    def half(d: Any, near: float, far: float, phi: Any) -> Any:
        """Half the angle between the diagonal and the side `near`, `far` being opposite."""
        opposite = _root((far - d + near) * (far + d - near), phi, fault)
        return np.arctan2(opposite, _root((d + near - far) * (d + near + far), phi, fault))

    def coupler(phi: Any) -> Any:
        d, delta = triangle(phi)
        return delta + side * 2 * half(d, bar, rocker, phi)

    def swing(phi: Any) -> Any:
        d, delta = triangle(phi)
        return delta + pi - side * 2 * half(d, rocker, bar, phi)

    return {"coupler": coupler, "rocker": swing}


def _root(square: Any, phi: Any, fault: str) -> Any:
    if np.any(square < 0):
        at = np.broadcast_to(phi, np.shape(square))[square < 0]
        raise GraphError(f"{fault} at a crank angle of {np.ravel(at)[0]:.6g} rad: change a length, or avoid that angle")
    return np.sqrt(square)


_RULES: tuple[tuple[str, Callable[..., Any]], ...] = (
    ("zero velocity", lambda graph, keep: bondgraph.drop_zero_velocity(graph, keep=keep)),
    ("dangling junctions", bondgraph.drop_dangling),
    ("two-bond junctions", bondgraph.drop_two_bond_junctions),
    ("equal junctions", bondgraph.merge_equal_junctions),
    ("zero sources", bondgraph.drop_zero_sources),
    ("sources at junctions", bondgraph.absorb_junctions),
    ("double differences", bondgraph.merge_double_differences),
    ("all rules", bondgraph.simplify),
)


def counts(graph: BondGraph, keep: Iterable[str] = ()) -> dict[str, int]:
    """The number of bonds of a graph as it is, and after each rule of simplification, one rule after another.

    Args:
        graph: any graph.
        keep: names of elements that must stay.

    The source's machine (crank, rod, M on the crank, F and R on the slider) has 46 bonds here and ends with 31:

    >>> from bondgraph import R
    >>> loads = {"crank.turn": [Se("M", 40.0)], "rod.2.x": [Se("F", -300.0), R("B", 5.0)]}
    >>> rod = Bar(0.6, mass=1.5, inertia=0.05, com=0.2)
    >>> for rule, bonds in counts(slider_crank(Bar(0.2, mass=2.0, inertia=0.1, com=0.1), rod, on=loads).graph).items():
    ...     print(f"{bonds} {rule}")
    46 as built
    40 zero velocity
    40 dangling junctions
    33 two-bond junctions
    31 equal junctions
    31 zero sources
    31 sources at junctions
    31 double differences
    31 all rules

    With the crank's centre of mass on its pivot, as the source has it, 23 are left:

    >>> counts(slider_crank(Bar(0.2, mass=2.0, inertia=0.1), rod, on=loads).graph)["all rules"]
    23

    The source has 35 (figure 37) and ends with 17 (figure 39). Of our 46, 2 join the crank's pin to the rod's, 3 hang the
    sources of flow 0 on junctions of the pins and 1 hangs F and R on one of the slider, where the source has none of these.
    That leaves 40, and this is also what its table 8 gives if its three steps are undone (17 + 7 + 4 + 12). Its numbers end
    at 35 all the same, and its own list of dropped bonds (10, 4, and 5 or 6) leads from 35 to 16 or 15, not to 17. Its last
    step is none of the six rules and is wrong: as the slider has no velocity along y, it takes the rod's centre of mass to
    have none, and drops its inertia and the transformer of the slider's pin. Done here (the centre is held instead of the
    slider), 19 are left: 17, 1 for the junction between two transformers that the source bonds directly, and 1 for the
    slider's own. It is another machine: at a crank angle of 0.5 rad its I* is 0.2052 kg m², that of the slider-crank
    0.1416 (`examples/bond_graphs/rosenberg.py`).

    """
    kept, bonds = tuple(keep), {"as built": len(graph.bonds)}
    for rule, apply in _RULES:
        graph = apply(graph, kept).graph
        bonds[rule] = len(graph.bonds)
    return bonds
