"""Linkages with masses, to find forces in: one of every kind of joint and coupling."""

from __future__ import annotations

from functools import cache
from math import pi

from flywheel.mechanisms.law import FormulaCurve
from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.numerics.expressions import parse
from flywheel.scene.linkage import Coupling, Joint, Lift, Link, Linkage, Point

ORIGIN = Point("o")


def lift(text: str) -> Lift:
    return Lift(FormulaCurve(parse(text), {}), 2 * pi)


def ground(**points: tuple[float, float]) -> Link:
    return Link("frame", (ORIGIN, *(Point(name, *at) for name, at in points.items())))


def bar(name: str, length: float, mass: float, guess: float | None = None, **points: tuple[float, float]) -> Link:
    """A bar from its origin to its point `end`, its centre of mass off its line."""
    ends = (ORIGIN, Point("end", length), *(Point(p, *at) for p, at in points.items()))
    return Link(name, ends, mass, mass * length**2 / 11, (0.45 * length, 0.07 * length), guess)


def pin(name: str, first: Link, first_at: str, second: Link, second_at: str = "o", **more: float) -> Joint:
    return Joint(name, "pin", first.name, second.name, first.point(first_at), second.point(second_at), **more)


def slide(name: str, first: Link, first_at: str, second: Link, second_at: str = "o", kind="slide", **more: float) -> Joint:
    return Joint(name, kind, first.name, second.name, first.point(first_at), second.point(second_at), **more)


def slider_crank(
    mu: float = 0.0, radius: float = 0.0, length: float = 0.0, guides: int = 1, driver: str = "pivot", **start: float
) -> Linkage:
    frame = ground(rail=(0.0, 0.05))
    crank, rod = bar("crank", 0.1, 1.2), bar("rod", 0.35, 0.8, guess=-0.1)
    slider = Link("slider", (ORIGIN, Point("shoe", 0.0, 0.05)), 2.0, 0.005, (0.02, 0.03))
    rub = {"friction": mu, "radius": radius}
    joints = [
        pin("pivot", frame, "o", crank, **rub),
        pin("crank_pin", crank, "end", rod, **rub),
        pin("slider_pin", rod, "end", slider, **rub),
        slide("guide", frame, "o", slider, friction=mu, length=length, guess=0.4),
        slide("other_guide", frame, "rail", slider, "shoe"),
    ]
    return Linkage(frame, (crank, rod, slider), tuple(joints[: 3 + guides]), driver, **start)


def four_bar(mu: float = 0.0, radius: float = 0.0) -> Linkage:
    frame = ground(far=(0.4, 0.05))
    crank, coupler, rocker = bar("crank", 0.1, 1.0), bar("coupler", 0.35, 0.7, guess=0.8), bar("rocker", 0.3, 1.5, guess=1.4)
    rub = {"friction": mu, "radius": radius}
    joints = (
        pin("pivot", frame, "o", crank, **rub),
        pin("crank_pin", crank, "end", coupler, **rub),
        pin("coupler_pin", coupler, "end", rocker, "end", **rub),
        pin("rocker_pivot", frame, "far", rocker, **rub),
    )
    return Linkage(frame, (crank, coupler, rocker), joints, "pivot")


def parallelogram() -> Linkage:
    """Three equal cranks under one bar: one too many."""
    frame = ground(middle=(0.2, 0.0), far=(0.4, 0.0))
    cranks = [bar(name, 0.1, 1.0, guess=1.0) for name in ("crank", "second", "third")]
    coupler = bar("coupler", 0.4, 2.0, guess=0.0, middle=(0.2, 0.0))
    joints = [pin(f"{c.name}_pivot", frame, at, c) for c, at in zip(cranks, ("o", "middle", "far"), strict=True)]
    joints += [pin(f"{c.name}_pin", c, "end", coupler, at) for c, at in zip(cranks, ("o", "middle", "end"), strict=True)]
    return Linkage(frame, (*cranks, coupler), tuple(joints), "crank_pivot", start=1.0)


def six_bar(mu: float = 0.0, radius: float = 0.0) -> Linkage:
    """A four-bar whose coupler point drives a slider on an inclined guide, with a bracket fixed to the slider."""
    four = four_bar(mu, radius)
    crank, coupler, rocker = four.links
    coupler = coupler._replace(points=(*coupler.points, Point("tracer", 0.2, 0.1)))
    rod, slider = bar("rod", 0.5, 0.6, guess=0.2), Link("slider", (ORIGIN, Point("top", 0.0, 0.1)), 1.1, 0.01, (0.0, 0.01))
    bracket = bar("bracket", 0.1, 0.4)
    joints = (
        *four.joints,
        pin("tracer_pin", coupler, "tracer", rod),
        pin("slider_pin", rod, "end", slider),
        slide("guide", four.ground, "o", slider, direction=0.2, angle=0.3, friction=mu, length=0.06, guess=0.6),
        Joint("weld", "fixed", "slider", "bracket", Point("top", 0.0, 0.1), ORIGIN, angle=0.4),
    )
    return Linkage(four.ground, (crank, coupler, rocker, rod, slider, bracket), joints, "pivot")


def whitworth(mu: float = 0.0) -> Linkage:
    """Whitworth's quick return: the crank's pin slides in a slot of a lever, which moves a ram by a rod."""
    frame = ground(low=(0.02, -0.05), rail=(0.0, 0.2))
    crank, lever, rod = bar("crank", 0.12, 1.0), bar("lever", 0.15, 1.3, guess=0.5), bar("rod", 0.55, 0.5, guess=0.2)
    ram = Link("ram", (ORIGIN,), 3.0, 0.02, (0.01, 0.02))
    joints = (
        pin("pivot", frame, "o", crank),
        pin("lever_pivot", frame, "low", lever),
        slide("slot", lever, "o", crank, "end", kind="pin-in-slot", guess=0.11, friction=mu),
        pin("lever_pin", lever, "end", rod),
        pin("ram_pin", rod, "end", ram),
        slide("guide", frame, "rail", ram, friction=mu, guess=0.7),
    )
    return Linkage(frame, (crank, lever, rod, ram), joints, "pivot")


def geared_five_bar(pressure_angle: float = 0.0, ratio: float = -2.0) -> Linkage:
    frame = ground(far=(0.3, 0.0))
    wheel, pinion = bar("wheel", 0.06, 1.0), bar("pinion", 0.05, 0.6, guess=1.0)
    left, right = bar("left", 0.3, 0.5, guess=1.0), bar("right", 0.32, 0.4, guess=2.0)
    joints = (
        pin("pivot", frame, "o", wheel),
        pin("pinion_pivot", frame, "far", pinion),
        pin("left_pin", wheel, "end", left),
        pin("right_pin", pinion, "end", right),
        pin("top", left, "end", right, "end"),
    )
    gear = Coupling("mesh", "gear", "pivot", "pinion_pivot", ratio, 0.4, pressure_angle=pressure_angle)
    return Linkage(frame, (wheel, pinion, left, right), joints, "pivot", (gear,))


def planetary(pressure_angle: float = 0.3) -> Linkage:
    """An arm drives a planet round a fixed sun (the frame); a crank on the planet moves a rod to a slider."""
    frame = ground()
    arm, planet = bar("arm", 0.1, 1.0), bar("planet", 0.04, 0.5)
    rod, slider = bar("rod", 0.5, 0.7, guess=0.0), Link("slider", (ORIGIN,), 2.0)
    joints = (
        pin("pivot", frame, "o", arm),
        pin("planet_pin", arm, "end", planet),
        pin("crank_pin", planet, "end", rod),
        pin("slider_pin", rod, "end", slider),
        slide("guide", frame, "o", slider, guess=0.6),
    )
    mesh = Coupling("mesh", "gear", "pivot", "planet_pin", 1.5, pressure_angle=pressure_angle)
    return Linkage(frame, (arm, planet, rod, slider), joints, "pivot", (mesh,))


def internal(pressure_angle: float = 0.3) -> Linkage:
    """A pinion inside a ring, whose crank moves a slider."""
    frame = ground(pinion=(0.03, 0.04))
    pinion, ring = bar("pinion", 0.05, 0.4), bar("ring", 0.1, 2.0, guess=0.0)
    rod, slider = bar("rod", 0.4, 0.7, guess=0.0), Link("slider", (ORIGIN,), 2.0)
    joints = (
        pin("pivot", frame, "pinion", pinion),
        pin("ring_pivot", frame, "o", ring),
        pin("crank_pin", ring, "end", rod),
        pin("slider_pin", rod, "end", slider),
        slide("guide", frame, "o", slider, guess=0.5),
    )
    mesh = Coupling("mesh", "gear", "pivot", "ring_pivot", 0.5, pressure_angle=pressure_angle)
    return Linkage(frame, (pinion, ring, rod, slider), joints, "pivot", (mesh,))


def rolling_wheel() -> Linkage:
    """A slider-crank whose slider carries a wheel that rolls on the rail."""
    plain = slider_crank()
    wheel = bar("wheel", 0.03, 0.9)
    axle = pin("axle", plain.link("slider"), "shoe", wheel)
    rolls = Coupling("contact", "rolling", "axle", "guide", -0.05)
    return Linkage(plain.ground, (*plain.links, wheel), (*plain.joints, axle), "pivot", (rolls,))


def rack(pressure_angle: float = 0.35, sign: float = 1.0) -> Linkage:
    """A driven pinion moves a rack along an inclined guide."""
    frame = ground(rail=(0.0, 0.08))
    pinion, plate = bar("pinion", 0.08, 1.0), Link("plate", (ORIGIN,), 3.0, 0.1, (0.05, 0.02))
    joints = (
        pin("pivot", frame, "o", pinion),
        slide("guide", frame, "rail", plate, direction=0.3, angle=0.3, guess=0.0, friction=0.1, length=0.2),
    )
    mesh = Coupling("mesh", "rolling", "pivot", "guide", sign * 0.08, pressure_angle=pressure_angle)
    return Linkage(frame, (pinion, plate), joints, "pivot", (mesh,))


def cam(kind: str = "roller", mu: float = 0.0) -> Linkage:
    """A cam with a roller (offset guide), a flat face or a rocker with a roller."""
    frame = ground(side=(0.01, 0.0), far=(0.12, 0.02))
    disc = Link("cam", (ORIGIN,), 1.5, 0.004, (0.006, 0.003))
    pivot = pin("pivot", frame, "o", disc)
    law = "0.05 + 0.01*cos(phi) + 0.003*sin(2*phi)"
    if kind == "rocker":
        follower = bar("follower", 0.11, 0.5)
        second = pin("follower_joint", frame, "far", follower)
        law = "2.6 + 0.1*cos(phi) + 0.03*sin(2*phi)"
    else:
        follower = Link("follower", (ORIGIN, Point("end", 0.0, 0.0)), 0.5, 0.001, (0.0, 0.05))
        second = slide("follower_joint", frame, "side", follower, direction=pi / 2, guess=0.06, friction=mu)
    contact = None if kind == "flat" else ("follower", "end")
    touch = Coupling("contact", "cam", "pivot", "follower_joint", lift=lift(law), contact=contact, friction=mu)
    return Linkage(frame, (disc, follower), (pivot, second), "pivot", (touch,))


EVERY = {
    "slider-crank with a shoe": slider_crank(0.15, 0.01, 0.08),
    "rubbing four-bar": four_bar(0.2, 0.01),
    "six-bar": six_bar(0.1, 0.01),
    "rubbing whitworth": whitworth(0.1),
    "geared five-bar with inclined teeth": geared_five_bar(0.35),
    "five-bar with a belt": geared_five_bar(ratio=1.0),
    "planetary": planetary(),
    "internal gear": internal(),
    "rolling wheel": rolling_wheel(),
    "rack": rack(),
    "rack above": rack(sign=-1.0),
    "rubbing roller cam": cam("roller", 0.1),
    "rubbing flat cam": cam("flat", 0.1),
    "rubbing rocker cam": cam("rocker", 0.1),
    "redundant slider-crank": slider_crank(guides=2),
    "parallelogram": parallelogram(),
}

RANGES = {"rack": 2.0, "rack above": 2.0, "parallelogram": 1.5}


@cache
def solution(name: str) -> Solution:
    """One of `EVERY` over a turn, or as far as it goes."""
    linkage = EVERY[name]
    return solve(linkage, linkage.start, linkage.start + RANGES.get(name, 6.3))
