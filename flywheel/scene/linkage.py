"""A plane linkage as plain data: bodies with named points, joints between them, couplings between joints, a driver.

Every body has a frame of its own, in which its points and its centre of mass are given; its angle is that of its own x
axis from the frame's +x, counter-clockwise. The fixed body is called `frame`. Everything here is hashable, so that results
for a linkage can be cached. Lengths in m, angles in rad, masses in kg.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

__all__ = [
    "CAM", "CRANK", "FIXED", "FRAME", "FREEDOMS", "GEAR", "PIN", "ROLLING", "SLIDE", "SLOT", "STROKE", "Coupling",
    "Driver", "Joint", "Lift", "Link", "Linkage", "Point", "Side", "common_body", "offered", "shadowing", "straight",
]  # fmt: skip

FRAME = "frame"

PIN, SLIDE, SLOT, FIXED = "pin", "slide", "pin-in-slot", "fixed"
GEAR, ROLLING, CAM = "gear", "rolling", "cam"

FREEDOMS = {PIN: 1, SLIDE: 1, SLOT: 2, FIXED: 0}
"""Relative motions that a joint leaves between its two bodies; a coupling takes one away."""


class Point(NamedTuple):
    """A named point of a body, in the body's own frame (m)."""

    name: str
    x: float = 0.0
    y: float = 0.0


class Link(NamedTuple):
    """A body: its points, mass, inertia about its centre of mass, the place of that centre in the body's frame.

    `guess` is the approximate angle (rad) of the body at the driver's start; None if it is unknown.
    """

    name: str
    points: tuple[Point, ...] = ()
    mass: float = 0.0
    inertia: float = 0.0
    com: tuple[float, float] = (0.0, 0.0)
    guess: float | None = None

    def point(self, name: str) -> Point:
        """The point of that name; KeyError if there is none."""
        match = next((point for point in self.points if point.name == name), None)
        if match is None:
            raise KeyError(name)
        return match


class Joint(NamedTuple):
    """A joint between `first` and `second`, at a point of each.

    pin: the two points coincide; coordinate: angle of second less that of first.
    slide: `second_at` lies on a guide of `first`, the line through `first_at` in `direction` (rad, in the frame of
        first), and the angle of second against first is `angle`; coordinate: distance of second_at along the
        guide from first_at, positive along direction.
    pin-in-slot: as slide, but second may turn: the pin `second_at` slides in a slot of first.
    fixed: the points coincide, and the angle of second against first is `angle`; no coordinate.

    `guess` is the approximate coordinate (m) of a slide or pin-in-slot at the driver's start. `friction` is Coulomb's
    coefficient mu; a pin with friction has a `radius` (m), a slide a `length` (m) of its shoe (0: negligible).
    """

    name: str
    kind: str
    first: str
    second: str
    first_at: Point
    second_at: Point
    direction: float = 0.0
    angle: float = 0.0
    guess: float | None = None
    friction: float = 0.0
    radius: float = 0.0
    length: float = 0.0


@dataclass(frozen=True)
class Lift:
    """A cam's lift law: `curve.jet(angle, anchor, ns)` gives lift and its two derivatives by the cam's angle.

    It repeats after `period` (rad).
    """

    curve: Any = field(hash=False)
    period: float


class Coupling(NamedTuple):
    """A relation between the coordinates q1, q2 of two joints: gear and rolling q2 = ratio q1 + phase, cam q2 = lift(q1).

    `first`, `second` are names of joints. gear: both are pins of one carrier, ratio dimensionless (negative: they mesh
    from outside); rolling: a wheel's pin drives a slide, ratio in m/rad; cam: the cam's pin drives a slide or a pin.
    `phase` is q2 at q1 = 0. `pressure_angle` (rad) inclines a tooth's force to the common tangent. `contact` names the
    body and the point (of it) through which a cam's force passes (a roller's centre); without one a sliding follower is
    flat.
    """

    name: str
    kind: str
    first: str
    second: str
    ratio: float = 1.0
    phase: float = 0.0
    lift: Lift | None = None
    pressure_angle: float = 0.0
    contact: tuple[str, str] | None = None
    friction: float = 0.0


class Side(NamedTuple):
    """A choice of assembly: where the driver starts, a point lies left (+1) or right (-1) of the line from one to another.

    Each point is a pair of names: body, point.
    """

    point: tuple[str, str]
    start: tuple[str, str]
    end: tuple[str, str]
    sense: int


class Driver(NamedTuple):
    """A joint that drives beside the first one: its name, and its coordinate (rad or m) at which guesses and sides hold."""

    joint: str
    start: float = 0.0


@dataclass(frozen=True)
class Linkage:
    """A linkage with its drivers.

    links: the moving bodies, in any order; ground: the fixed body's points.
    driver: name of the pin or slide whose coordinate drives; guesses and sides hold at its `start` (rad or m).
    path: its path in a scene, for messages.
    further: the other drivers of a linkage of several degrees of freedom (see `flywheel.freedoms`).
    neighbour: a linkage whose lengths differ from its own by roundings alone: it has the same assembly.
    """

    ground: Link
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    driver: str
    couplings: tuple[Coupling, ...] = ()
    sides: tuple[Side, ...] = ()
    start: float = 0.0
    path: str = "mechanism"
    further: tuple[Driver, ...] = ()
    neighbour: Linkage | None = None

    @property
    def drivers(self) -> tuple[Driver, ...]:
        """All drivers, the first one first."""
        return (Driver(self.driver, self.start), *self.further)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all bodies, `frame` first: the order of every array of poses."""
        return (FRAME, *(link.name for link in self.links))

    def unweighed(self) -> Linkage:
        """The same without masses, on which no position depends."""
        links = tuple(link._replace(mass=0.0, inertia=0.0, com=(0.0, 0.0)) for link in self.links)
        return replace(self, links=links, neighbour=None if self.neighbour is None else self.neighbour.unweighed())

    def carrier(self, coupling: Coupling) -> str:
        """The body that carries both joints of a coupling: the frame, if they have it in common."""
        first, second = self.joint(coupling.first), self.joint(coupling.second)
        return common_body(first, second)

    def link(self, name: str) -> Link:
        """The body of that name."""
        return self.ground if name == FRAME else next(link for link in self.links if link.name == name)

    def joint(self, name: str) -> Joint:
        """The joint of that name."""
        return next(joint for joint in self.joints if joint.name == name)

    @property
    def rubs(self) -> bool:
        """True if any joint or coupling has friction."""
        return any(joint.friction for joint in self.joints) or any(pair.friction for pair in self.couplings)

    @property
    def sliding(self) -> bool:
        """True if the driver slides: its coordinate is then in m, the reduced inertia a mass, the reduced moment a force."""
        return self.joint(self.driver).kind == SLIDE


def common_body(first: Joint, second: Joint) -> str:
    """The body that two joints have in common, the frame before any other; empty if there is none."""
    common = [body for body in (first.first, first.second) if body in (second.first, second.second)]
    return FRAME if FRAME in common else common[0] if common else ""


# -- ports -------------------------------------------------------------------------------------------------------------

# The ports that a linkage offers: places where loads, springs and added inertia may act.


CRANK, STROKE = "crank", "slide"
"""Names, for loads that act on it, of the coordinate of a driver that turns, and of one that slides."""


def offered(linkage: Linkage, points: Iterable[str] = ()) -> dict[str, bool]:
    """Ports by name, True if one rotates: bodies that can turn, slides and slots, then `points`.

    The body that a turning driver turns against the frame is no port: a load on it acts on its shaft. Nor is a driver called
    `slide`, which is the name of its coordinate.
    """
    fixed = {FRAME, *straight(linkage.joints)}
    for joint in linkage.joints:  # and the body that the driver turns, where it is a pin of the frame
        if joint.name == linkage.driver and joint.kind == PIN and FRAME in joint[2:4]:
            fixed |= {joint.first, joint.second}
    ports = {link.name: True for link in linkage.links if link.name not in fixed}
    ports |= {joint.name: False for joint in linkage.joints if joint.kind in (SLIDE, SLOT)}
    ports |= dict.fromkeys(points, False)
    return {name: turns for name, turns in ports.items() if name != STROKE or linkage.driver != STROKE}


def straight(joints: Iterable[Joint]) -> set[str]:
    """Bodies that slides and fixed joints hold to the frame, one after the other: they cannot turn."""
    joints = [joint for joint in joints if joint.kind in (SLIDE, FIXED)]
    fixed = {FRAME}
    for _ in joints:
        fixed |= {body for joint in joints for body in joint[2:4] if fixed & set(joint[2:4])}
    return fixed - {FRAME}


def shadowing(ports: Iterable[str], sliding: bool) -> list[str]:
    """Ports that bear a name by which loads reach the driver."""
    return [name for name in ports if name == (STROKE if sliding else CRANK)]
