"""Linkages that several tests share: descriptions, references in closed form, a gallery drawn at random."""

from __future__ import annotations

from cmath import exp, phase, sqrt
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cache
from math import pi, tau
from typing import Any, NamedTuple

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

# Linkages to test with, and their positions by hand at 30 digits: circles that intersect, nothing of the toolkit's own.


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
    result = four_bar_reference(phi)
    f = mp.mpf("0.4") + mp.expj(result["rocker"]) * mp.mpc("0.2", "-0.1")
    g = mp.mpc("0.75", "0.05")
    h = dyad(f, g, mp.mpf("0.32"), mp.mpf("0.25"), 1)
    return result | {"link": mp.arg(h - f), "output": mp.arg(h - g)}


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
    result = slider_crank_reference(phi)
    return result | {"pinion": (result["guide"] - mp.mpf("0.4")) / mp.mpf("-0.08")}


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


# Straight-line, collapsible and walking linkages, each drawn at one position of its driver.
#
# A drawing is the places of pins and which of them every body holds. Lengths follow from the places, and so do the
# guesses of
# all angles and displacements, which `roughly` makes worse.


class Rail(NamedTuple):
    """A straight guide on the frame for a pin of a body, along `direction` (rad); the body keeps its angle, or turns."""

    body: str
    pin: str
    direction: float = 0.0
    turns: bool = False


def meeting(a: complex, b: complex, first: float, second: float, side: int) -> complex:
    """The place at the distance `first` from a and `second` from b, left (+1) or right (-1) of the line a -> b."""
    gap = b - a
    along = (first**2 - second**2 + abs(gap) ** 2) / (2 * abs(gap))
    return a + gap / abs(gap) * (along + side * 1j * sqrt(first**2 - along**2))


def drawn(
    places: Mapping[str, complex],
    bodies: Mapping[str, str],
    driver: str,
    start: float = 0.0,
    rails: Mapping[str, Rail] | None = None,
    couplings: tuple[Coupling, ...] = (),
) -> Linkage:
    """A linkage where its driver stands at `start`: places (m), and pins of all bodies, "O A", the frame first.

    A body's own x axis goes from its first pin to its second. Where a pin joins three bodies, its joints are A and A'.
    """
    links = {body: _link(places, body, pins.split()) for body, pins in bodies.items()}
    joints, holders = [], dict[str, str]()
    for body, link in links.items():
        for point in link.points:
            first = holders.setdefault(point.name, body)
            if first != body:
                name = point.name + "'" * sum(joint.first_at.name == point.name for joint in joints)
                joints.append(Joint(name, PIN, first, body, links[first].point(point.name), point))
    for name, (body, pin, direction, turns) in (rails or {}).items():
        along, across = (places[pin] * exp(-1j * direction)).real, (places[pin] * exp(-1j * direction)).imag
        base = 1j * across * exp(1j * direction)
        at, angle = Point(name, base.real, base.imag), 0.0 if turns else links[body].guess or 0.0
        guess = None if name == driver else along
        joints.append(
            Joint(name, SLOT if turns else SLIDE, FRAME, body, at, links[body].point(pin), direction, angle, guess)
        )
    ground, *moving = links.values()
    return Linkage(ground._replace(guess=None), tuple(moving), tuple(joints), driver, couplings, start=start)


def _link(places: Mapping[str, complex], body: str, pins: list[str]) -> Link:
    """A body with its pins in its own frame; the frame's own axes are those of the places."""
    origin, angle = 0j, 0.0
    if body != FRAME:
        origin = places[pins[0]]
        angle = phase(places[pins[1]] - origin) if len(pins) > 1 else 0.0
    at = [(places[pin] - origin) * exp(-1j * angle) for pin in pins]
    return Link(body, tuple(Point(pin, z.real, z.imag) for pin, z in zip(pins, at, strict=True)), guess=angle)


def roughly(linkage: Linkage, off: float, text: Iterable[str] | None = None) -> Linkage:
    """The linkage with guesses `off` (rad) too far, to either side in turn, of some bodies only if told."""
    names = sorted(link.name for link in linkage.links) if text is None else sorted(text)
    away = {name: off * (-1) ** k for k, name in enumerate(names)}
    links = (
        link._replace(guess=(link.guess or 0.0) + away[link.name] if link.name in away else None) for link in linkage.links
    )
    joints = linkage.joints if text is None else tuple(joint._replace(guess=None) for joint in linkage.joints)
    return replace(linkage, links=tuple(links), joints=joints)


def shuffled(linkage: Linkage, places: Iterable[int]) -> Linkage:
    """The linkage with its bodies and joints in another order."""
    keys = list(places)
    links = tuple(link for _, link in sorted(zip(keys, linkage.links, strict=False), key=lambda pair: pair[0]))
    joints = tuple(joint for _, joint in sorted(zip(keys, linkage.joints, strict=False), key=lambda pair: pair[0]))
    return replace(linkage, links=links, joints=joints)


def peaucellier(phi: float, radius: float = 0.03, pivot: float = 0.03, arm: float = 0.1, side: float = 0.06) -> Linkage:
    """Two arms from O carry a rhombus C A P B, whose corner C goes on a circle about Q: OC · OP = arm² - side²."""
    c = pivot + radius * exp(1j * phi)
    a, b = (meeting(0j, c, arm, side, sense) for sense in (1, -1))
    places = {"O": 0j, "Q": complex(pivot), "C": c, "A": a, "B": b, "P": a + b - c}
    bodies = {
        FRAME: "O Q",
        "crank": "Q C",
        "upper arm": "O A",
        "lower arm": "O B",
        "near upper": "C A",
        "near lower": "C B",
        "far upper": "P A",
        "far lower": "P B",
    }
    return drawn(places, bodies, "Q", phi)


def hart(phi: float, long: float = 0.2, short: float = 0.1, share: float = 0.4, radius: float = 0.03) -> Linkage:
    """Hart's inversor: O, P and R divide AB, AD and CB of an antiparallelogram alike, so that they lie on a line.

    With AB = CD = long, BC = DA = short, AO = share AB: OP · OR = -share (1 - share) (long² - short²).
    """
    p = 0.08 + radius * exp(1j * phi)
    bd = abs(p) / share
    ac = (long**2 - short**2) / bd
    b, d = (sense * bd / 2 + 1j * sqrt(long**2 - ((bd + ac) / 2) ** 2) for sense in (1, -1))
    a, c = -ac / 2 + 0j, ac / 2 + 0j
    points = {"A": a, "B": b, "C": c, "D": d, "O": a + share * (b - a), "P": a + share * (d - a), "R": c + share * (b - c)}
    turn = p / (points["P"] - points["O"])
    places = {name: (at - points["O"]) * turn for name, at in points.items()} | {"Q": 0.08 + 0j}
    bodies = {FRAME: "O Q", "crank": "Q P", "first": "A B O", "second": "C B R", "third": "C D", "fourth": "A D P"}
    return drawn(places, bodies, "Q", phi)


def scissor_lift(stages: int, x: float, length: float = 0.5) -> Linkage:
    """Crossed bars of one length on a foot that slides: the platform stands at stages sqrt(length² - x²)."""
    height = sqrt(length**2 - x**2)
    places, bodies = dict[str, complex](), {FRAME: "L0", "foot": "R0"}
    for k in range(stages + 1):
        places |= {f"L{k}": 1j * k * height, f"R{k}": x + 1j * k * height}
        if k:
            places[f"M{k}"] = x / 2 + 1j * (k - 0.5) * height
            bodies |= {f"rise{k}": f"L{k - 1} R{k} M{k}", f"fall{k}": f"R{k - 1} L{k} M{k}"}
    base = drawn(places, bodies | {"platform": f"L{stages}"}, "foot rail", x, {"foot rail": Rail("foot", "R0")})
    platform, bar = base.links[-1], base.link(f"rise{stages}")
    top = Joint("roller", SLOT, "platform", bar.name, platform.points[0], bar.points[1], guess=x)
    return replace(base, joints=(*base.joints, top))


def scissor_jack(screw: float, arm: float = 0.2) -> Linkage:
    """Four arms of one length, a screw between the nuts A and B, the head C on a guide: OC² = 4 arm² - screw²."""
    height = sqrt(arm**2 - screw**2 / 4)
    places = {"O": 0j, "A": 1j * height - screw / 2, "B": 1j * height + screw / 2, "C": 2j * height}
    bodies = {
        FRAME: "O",
        "lower left": "O A",
        "lower right": "O B",
        "upper left": "C A",
        "upper right": "C B",
        "head": "C",
        "left nut": "A",
        "right nut": "B",
    }
    base = drawn(places, bodies, "screw", screw, {"lift": Rail("head", "C", pi / 2)})
    nuts = base.link("left nut").points[0], base.link("right nut").points[0]
    return replace(base, joints=(*base.joints, Joint("screw", SLIDE, "left nut", "right nut", *nuts)))


def pantograph(phi: float, inner: float = 0.1, outer: float = 0.15, ratio: float = 3.0) -> Linkage:
    """The parallelogram B D P E draws with C what the crank's pin P goes round, `ratio` times as large about O."""
    p = 0.12 + 0.04 * exp(1j * phi)
    d = meeting(0j, p, inner, outer, 1)
    c, b = ratio * p, ratio * d
    places = {"O": 0j, "Q": 0.12 + 0j, "P": p, "D": d, "B": b, "C": c, "E": b + p - d}
    bodies = {FRAME: "O Q", "crank": "Q P", "arm": "O B D", "pen": "B C E", "short": "P D", "long": "P E"}
    return drawn(places, bodies, "Q", phi)


def jansen(phi: float) -> Linkage:
    """Jansen's leg by his thirteen numbers, in cm."""
    a, b, c, d, e, f, g, h, i, j, k, down, m = (
        0.01 * n for n in (38, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49, 50, 61.9, 7.8, 15)
    )
    pivot, crank = complex(-a, -down), m * exp(1j * phi)
    top, bottom = meeting(crank, pivot, j, b, -1), meeting(crank, pivot, k, c, 1)
    outer = meeting(top, pivot, e, d, -1)
    corner = meeting(outer, bottom, f, g, -1)
    foot = meeting(corner, bottom, h, i, -1)
    places = {"O": 0j, "A": crank, "B": pivot, "T": top, "U": bottom, "V": outer, "W": corner, "F": foot}
    bodies = {
        FRAME: "O B",
        "crank": "O A",
        "upper rod": "A T",
        "lower rod": "A U",
        "upper": "B T V",
        "lower": "B U",
        "strut": "V W",
        "leg": "U W F",
    }
    return drawn(places, bodies, "O", phi)


KLANN = {"O": 1.599 + 0.75j, "G": 1.366 + 1.366j, "H": 1.009 + 0.574j, "A": 1.331 + 0.75j, "E": 0.741 + 0.75j}
KLANN |= {"K": 0.232 + 0.866j, "S": 0.866 + 1.323j, "F": 0j}
"""Places in the drawing of Klann's patent US 6260862, rounded, in decimetres."""


def klann() -> Linkage:
    """Klann's leg with its crank at 180 degrees."""
    bodies = {FRAME: "O G H", "crank": "O A", "rod": "A E K", "lower": "H E", "leg": "K S F", "upper": "G S"}
    return drawn({name: 0.1 * at for name, at in KLANN.items()}, bodies, "O", -pi)


def peaucellier_by_crank() -> Linkage:
    """Peaucellier's cell whose radius rocks by a crank and a rod: it draws a line while the crank turns."""
    base = peaucellier(0.3)
    c = base.link("crank").points[1].x * exp(0.3j) + 0.03
    shaft = 0.06 - 0.11j
    pin = shaft + 0.015
    places = {"S": shaft, "K": pin, "C": c}
    cell = {link.name.replace("crank", "radius"): link.name for link in base.links}
    a, b = (meeting(0j, c, 0.1, 0.06, sense) for sense in (1, -1))
    places |= {"O": 0j, "Q": 0.03 + 0j, "A": a, "B": b, "P": a + b - c}
    bodies = {FRAME: "S O Q", "crank": "S K", "rod": "K C"}
    pins = {link.name: " ".join(point.name for point in link.points) for link in base.links}
    return drawn(places, bodies | {new: pins[old] for new, old in cell.items()}, "S")


def sarrus(height: float, bar: float = 0.2) -> Linkage:
    """One side of Sarrus' box in the plane: two bars of one length between the floor and a lid that a guide keeps level."""
    places = {"O": 0j, "A": meeting(0j, 1j * height, bar, bar, -1), "C": 1j * height}
    bodies = {FRAME: "O", "lower": "O A", "upper": "A C", "lid": "C"}
    return drawn(places, bodies, "guide", height, {"guide": Rail("lid", "C", pi / 2)})
