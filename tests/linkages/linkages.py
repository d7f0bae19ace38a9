"""Linkages to test with, and their positions by hand at 30 digits: circles that intersect, nothing of the toolkit's own."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import tau
from typing import Any

import mpmath as mp

from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.scene.linkage import (
    CAM,
    FRAME,
    GEAR,
    PIN,
    ROLLING,
    SLIDE,
    SLOT,
    Coupling,
    Joint,
    Lift,
    Link,
    Linkage,
    Point,
    Side,
)

O = Point("O")  # noqa: E741
Reference = Callable[[Any], dict[str, Any]]
"""Angles of bodies (rad) and displacements of slides (m) by name, at a position of the driver, with mpmath's numbers."""


def pin(name: str, first: str, second: str, at: Point = O, to: Point = O) -> Joint:
    """A pin, at the bodies' own origins unless told."""
    return Joint(name, PIN, first, second, at, to)


def ground(**points: tuple[float, float]) -> Link:
    """The frame with its points."""
    return Link(FRAME, (O, *(Point(name, *place) for name, place in points.items())))


def bar(name: str, length: float, guess: float | None = None, **points: tuple[float, float]) -> Link:
    """A bar from O to its end E, with further points."""
    return Link(name, (O, Point("E", length), *(Point(n, *at) for n, at in points.items())), guess=guess)


def dyad(a: Any, b: Any, first: Any, second: Any, side: int) -> Any:
    """The point at the distance `first` from a and `second` from b, left (+1) or right (-1) of the line a -> b."""
    gap = b - a
    along = (first**2 - second**2 + abs(gap) ** 2) / (2 * abs(gap))
    return a + gap / abs(gap) * (along + mp.mpc(0, side) * mp.sqrt(first**2 - along**2))


def four_bar(d: float = 0.4, r: float = 0.1, c: float = 0.35, length: float = 0.3, side: int = 1) -> Linkage:
    """Crank on O, coupler, rocker on D."""
    links = (bar("crank", r), bar("coupler", c), bar("rocker", length))
    frame = ground(D=(d, 0.0))
    joints = (
        pin("O", FRAME, "crank"),
        pin("A", "crank", "coupler", links[0].point("E")),
        pin("B", "coupler", "rocker", links[1].point("E"), links[2].point("E")),
        pin("D", FRAME, "rocker", frame.point("D")),
    )
    sides = (Side(("rocker", "E"), ("crank", "E"), (FRAME, "D"), side),)
    return Linkage(frame, links, joints, "O", sides=sides)


def four_bar_reference(phi: Any, d: Any = 0.4, r: Any = 0.1, c: Any = 0.35, length: Any = 0.3, side: int = 1) -> Any:
    """The same by intersecting circles."""
    d, r, c, length = (mp.mpf(str(value)) for value in (d, r, c, length))
    a = r * mp.expj(phi)
    b = dyad(a, d, c, length, side)
    return {"coupler": mp.arg(b - a), "rocker": mp.arg(b - d)}


def slider_crank(r: float = 0.1, length: float = 0.3, e: float = 0.02) -> Linkage:
    """Crank on O, rod, slider on the line y = e."""
    links = (bar("crank", r), bar("rod", length, guess=0.0), Link("slider", (O,)))
    frame = ground(G=(0.0, e))
    joints = (
        pin("O", FRAME, "crank"),
        pin("A", "crank", "rod", links[0].point("E")),
        pin("B", "rod", "slider", links[1].point("E")),
        Joint("guide", SLIDE, FRAME, "slider", frame.point("G"), O),
    )
    return Linkage(frame, links, joints, "O")


def slider_crank_reference(phi: Any, r: Any = 0.1, length: Any = 0.3, e: Any = 0.02) -> dict[str, Any]:
    """The same by Pythagoras."""
    r, length, e = (mp.mpf(str(value)) for value in (r, length, e))
    rise = e - r * mp.sin(phi)
    run = mp.sqrt(length**2 - rise**2)
    return {"rod": mp.atan2(rise, run), "guide": r * mp.cos(phi) + run}


def six_bar() -> Linkage:
    """Watt's: a four-bar whose rocker carries a second dyad to a pivot G."""
    frame = ground(D=(0.4, 0.0), G=(0.75, 0.05))
    links = (
        bar("crank", 0.1),
        bar("coupler", 0.35, guess=0.6),
        bar("rocker", 0.3, guess=1.9, F=(0.2, -0.1)),
        bar("link", 0.32, guess=-0.3),
        bar("output", 0.25, guess=1.5),
    )
    _, _, rocker, link, output = links
    joints = (
        pin("O", FRAME, "crank"),
        pin("A", "crank", "coupler", links[0].point("E")),
        pin("B", "coupler", "rocker", links[1].point("E"), rocker.point("E")),
        pin("D", FRAME, "rocker", frame.point("D")),
        pin("F", "rocker", "link", rocker.point("F")),
        pin("H", "link", "output", link.point("E"), output.point("E")),
        pin("G", FRAME, "output", frame.point("G")),
    )
    return Linkage(frame, links, joints, "O")


def six_bar_reference(phi: Any) -> dict[str, Any]:
    """The same, dyad after dyad."""
    found = four_bar_reference(phi)
    f = mp.mpf("0.4") + mp.expj(found["rocker"]) * mp.mpc("0.2", "-0.1")
    g = mp.mpc("0.75", "0.05")
    h = dyad(f, g, mp.mpf("0.32"), mp.mpf("0.25"), 1)
    return found | {"link": mp.arg(h - f), "output": mp.arg(h - g)}


def whitworth(r: float = 0.1, d: float = 0.25) -> Linkage:
    """Quick return: the crank's pin slides in a slot of the rocker on Q below, whose end pulls a ram through a link."""
    frame = ground(Q=(0.0, -d), R=(0.0, 0.3))
    links = (bar("crank", r), bar("rocker", 0.6, guess=1.2), bar("link", 0.2, guess=2.9), Link("ram", (O,)))
    joints = (
        pin("O", FRAME, "crank"),
        pin("Q", FRAME, "rocker", frame.point("Q")),
        Joint("slot", SLOT, "rocker", "crank", O, links[0].point("E")),
        pin("E", "rocker", "link", links[1].point("E")),
        pin("P", "link", "ram", links[2].point("E")),
        Joint("guide", SLIDE, FRAME, "ram", frame.point("R"), O),
    )
    return Linkage(frame, links, joints, "O")


def whitworth_reference(phi: Any) -> dict[str, Any]:
    """The same by a line and a circle."""
    q = mp.mpc(0, "-0.25")
    reach = mp.mpf("0.1") * mp.expj(phi) - q
    end = q + mp.mpf("0.6") * mp.expj(mp.arg(reach))
    rise = mp.mpf("0.3") - end.imag
    run = -mp.sqrt(mp.mpf("0.2") ** 2 - rise**2)
    return {"rocker": mp.arg(reach), "slot": abs(reach), "link": mp.atan2(rise, run), "guide": end.real + run}


def geared_five_bar(ratio: float = -2.0, phase: float = 0.7) -> Linkage:
    """Two cranks on O and D, geared to each other, joined by two bars."""
    frame = ground(D=(0.3, 0.0))
    links = (bar("crank", 0.08), bar("second", 0.06), bar("left", 0.3, guess=0.8), bar("right", 0.28, guess=2.2))
    joints = (
        pin("O", FRAME, "crank"),
        pin("D", FRAME, "second", frame.point("D")),
        pin("A", "crank", "left", links[0].point("E")),
        pin("B", "second", "right", links[1].point("E")),
        pin("C", "left", "right", links[2].point("E"), links[3].point("E")),
    )
    return Linkage(frame, links, joints, "O", (Coupling("gears", GEAR, "O", "D", ratio, phase),))


def geared_five_bar_reference(phi: Any, ratio: Any = -2, phase: Any = "0.7") -> dict[str, Any]:
    """The same by intersecting circles."""
    second = ratio * phi + mp.mpf(phase)
    a = mp.mpf("0.08") * mp.expj(phi)
    b = mp.mpf("0.3") + mp.mpf("0.06") * mp.expj(second)
    c = dyad(a, b, mp.mpf("0.3"), mp.mpf("0.28"), 1)
    return {"second": second, "left": mp.arg(c - a), "right": mp.arg(c - b)}


def rolling() -> Linkage:
    """A slider-crank whose slider is a rack that turns a pinion on the frame."""
    base = slider_crank()
    frame = ground(G=(0.0, 0.02), W=(0.5, 0.1))
    links = (*base.links, Link("pinion", (O,)))
    joints = (*base.joints, pin("W", FRAME, "pinion", frame.point("W")))
    return Linkage(frame, links, joints, "O", (Coupling("rack", ROLLING, "W", "guide", -0.08, 0.4),))


def rolling_reference(phi: Any) -> dict[str, Any]:
    """The pinion turns by the rack's displacement over its radius."""
    found = slider_crank_reference(phi)
    return found | {"pinion": (found["guide"] - mp.mpf("0.4")) / mp.mpf("-0.08")}


class Sine:
    """A lift of 20 mm, two strokes a turn, as the cam's curve."""

    breakpoints: tuple[float, ...] = ()

    def jet(self, angle: Any, anchor: Any, ns: Any) -> Any:
        """Lift with two derivatives."""
        from flywheel.numerics.jets import Jet

        value, slope = 0.02 * (1 - ns.cos(2 * angle)), 0.04 * ns.sin(2 * angle)
        return Jet(value, slope, 0.08 * ns.cos(2 * angle))


SINE = Lift(Sine(), 2 * 3.141592653589793)


def cam_rocker() -> Linkage:
    """A cam on O lifts a slide, which pushes a bar that turns a lever."""
    frame = ground(L=(0.4, -0.1))
    links = (
        Link("cam", (O,)),
        Link("follower", (O, Point("T", 0.0, 0.1))),
        bar("bar", 0.3, guess=0.2),
        bar("lever", 0.25, guess=2.0),
    )
    joints = (
        pin("O", FRAME, "cam"),
        Joint("lift", SLIDE, FRAME, "follower", O, O, direction=1.5707963267948966),
        pin("T", "follower", "bar", links[1].point("T")),
        pin("B", "bar", "lever", links[2].point("E"), links[3].point("E")),
        pin("L", FRAME, "lever", frame.point("L")),
    )
    return Linkage(frame, links, joints, "O", (Coupling("cam", CAM, "O", "lift", lift=SINE),))


def cam_rocker_reference(phi: Any) -> dict[str, Any]:
    """The follower's place is the lift's, the rest a dyad."""
    lift = mp.mpf("0.02") * (1 - mp.cos(2 * phi))
    top, pivot = mp.mpc(0, lift + mp.mpf("0.1")), mp.mpc("0.4", "-0.1")
    b = dyad(top, pivot, mp.mpf("0.3"), mp.mpf("0.25"), 1)
    return {"lift": lift, "bar": mp.arg(b - top), "lever": mp.arg(b - pivot)}


CASES: dict[str, tuple[Linkage, Reference]] = {
    "four-bar": (four_bar(), four_bar_reference),
    "crossed four-bar": (four_bar(side=-1), lambda phi: four_bar_reference(phi, side=-1)),
    "slider-crank": (slider_crank(), slider_crank_reference),
    "six-bar": (six_bar(), six_bar_reference),
    "whitworth": (whitworth(), whitworth_reference),
    "geared five-bar": (geared_five_bar(), geared_five_bar_reference),
    "rack and pinion": (rolling(), rolling_reference),
    "cam and lever": (cam_rocker(), cam_rocker_reference),
}
"""A linkage of each kind with its reference; the driver turns once."""


@cache
def whole(case: str) -> Solution:
    """The solution of a case over its whole turn, found once for all tests of a run."""
    return solve(CASES[case][0], 0.0, tau)
