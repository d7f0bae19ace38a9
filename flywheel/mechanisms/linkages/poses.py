"""Poses of a linkage: where every body stands, and its influence coefficients; a cam's lift; what a linkage is refused for.

`check` finds whether a linkage is one at all: names that are known and unique, numbers that are finite, joints and
couplings that fit. Whether it can be assembled and moves is found later, when it is solved.

A cam's lift at any angle, and proven bounds of how fast its slope and curvature change, stretch by stretch.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics.arguments import ANY, NOT_NEGATIVE, fits, known, name_faults, number_faults, refuse, require, shown
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.intervals import NAMESPACE as INTERVALS
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.scene.linkage import (
    CAM,
    FIXED,
    FREEDOMS,
    GEAR,
    PIN,
    ROLLING,
    SLIDE,
    Coupling,
    Joint,
    Lift,
    Link,
    Linkage,
    Point,
    Side,
)

_PARTS: dict[str, type] = {"links": Link, "joints": Joint, "couplings": Coupling, "sides": Side}
_POINT = {"x": ANY, "y": ANY}
_LINK = {"mass": NOT_NEGATIVE, "inertia": NOT_NEGATIVE}
_JOINT = {"direction": ANY, "angle": ANY, "friction": NOT_NEGATIVE, "radius": NOT_NEGATIVE, "length": NOT_NEGATIVE}
_COUPLING = {"ratio": ANY, "phase": ANY, "pressure_angle": ANY, "friction": NOT_NEGATIVE}
_COUPLINGS = dict.fromkeys((GEAR, ROLLING, CAM))


def check(linkage: Linkage) -> None:
    """Refuse a linkage whose description is wrong, with every fault in a line.

    Args:
        linkage: bodies, joints, couplings and driver.

    Raises:
        SceneError: for names that are unknown or not unique, kinds that do not exist, numbers that are not finite or have
            the wrong sign, parts of another type.

    >>> o = Point("o")
    >>> pivot = Joint("pivot", "pin", "frame", "crnk", o, o, friction=-0.1)
    >>> check(Linkage(Link("frame", (o,)), (Link("crank", (o,)),), (pivot,), "pivot"))
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: mechanism.joints[0].second: found "crnk", expected one of frame, crank; did you mean "crank"?
    mechanism.joints[0].friction: found -0.1, expected a finite number, 0 or above

    """  # noqa: E501
    require("linkage", linkage, Linkage, "a Linkage")
    refuse([fault for key, kind in _PARTS.items() for fault in _parts(linkage, key, kind)])
    refuse(list(_named(linkage)))
    refuse(list(_contents(linkage)))


def _parts(linkage: Linkage, key: str, kind: type) -> Iterator[Fault]:
    """Faults of what is no tuple of the right type."""
    items, path = getattr(linkage, key), f"{linkage.path}.{key}"
    if type(items) is not tuple:
        yield Fault(path, shown(items), f"a tuple of {kind.__name__}")
    else:
        for k, item in enumerate(items):
            if not isinstance(item, kind):
                yield Fault(f"{path}[{k}]", shown(item), f"a {kind.__name__}")
    if key == "links" and not isinstance(linkage.ground, Link):
        yield Fault(f"{linkage.path}.ground", shown(linkage.ground), "a Link")


def _named(linkage: Linkage) -> Iterator[Fault]:
    """Faults of names that are none, or not unique."""
    path = linkage.path
    yield from _unique((f"{path}.links[{k - 1}]", name) for k, name in enumerate(linkage.names))
    couplings = ((f"{path}.couplings[{k}]", coupling.name) for k, coupling in enumerate(linkage.couplings))
    yield from _unique([*((f"{path}.joints[{k}]", joint.name) for k, joint in enumerate(linkage.joints)), *couplings])
    for k, link in enumerate((linkage.ground, *linkage.links)):
        yield from _points(f"{path}.links[{k - 1}]" if k else f"{path}.ground", link.points)


def _unique(named: Iterable[tuple[str, Any]]) -> Iterator[Fault]:
    seen = set()
    for path, name in named:
        if not isinstance(name, str) or not name:
            yield Fault(f"{path}.name", shown(name), "a name")
        elif name in seen:
            yield Fault(f"{path}.name", shown(name), "a name of its own", "another has it already")
        else:
            seen.add(name)


def _points(path: str, points: Any) -> Iterator[Fault]:
    if type(points) is not tuple:
        yield Fault(f"{path}.points", shown(points), "a tuple of Point")
        return
    faults = [fault for k, point in enumerate(points) for fault in _point(f"{path}.points[{k}]", point)]
    yield from faults or _unique((f"{path}.points[{k}]", point.name) for k, point in enumerate(points))


def _contents(linkage: Linkage) -> Iterator[Fault]:
    """Faults within the parts, and of what they refer to; all names are sound."""
    path = linkage.path
    bodies = {link.name: {point.name: None for point in link.points} for link in linkage.links}
    bodies = {linkage.names[0]: {point.name: None for point in linkage.ground.points}, **bodies}
    joints = {joint.name: joint for joint in linkage.joints}
    for k, link in enumerate(linkage.links):
        yield from _link(f"{path}.links[{k}]", link)
    for k, joint in enumerate(linkage.joints):
        yield from _joint(f"{path}.joints[{k}]", joint, bodies)
    for k, coupling in enumerate(linkage.couplings):
        yield from _coupling(f"{path}.couplings[{k}]", coupling, joints, bodies)
    for k, side in enumerate(linkage.sides):
        yield from _side(f"{path}.sides[{k}]", side, bodies)
    yield from name_faults(f"{path}.driver", linkage.driver, {n: j for n, j in joints.items() if j.kind in (PIN, SLIDE)})
    yield from number_faults(f"{path}.start", linkage.start)


def _numbers(path: str, item: object, expected: Mapping[str, str]) -> Iterator[Fault]:
    for name, what in expected.items():
        if not fits(value := getattr(item, name), what):
            yield from number_faults(f"{path}.{name}", value, what)


def _point(path: str, point: Any) -> Iterator[Fault]:
    if isinstance(point, Point):
        yield from _numbers(path, point, _POINT)
    else:
        yield Fault(path, shown(point), "a Point")


def _guess(path: str, guess: Any) -> list[Fault]:
    return [] if guess is None else number_faults(f"{path}.guess", guess)


def _link(path: str, link: Link) -> Iterator[Fault]:
    yield from _numbers(path, link, _LINK)
    com: Any = link.com
    if not (isinstance(com, tuple) and len(com) == 2 and fits(com[0]) and fits(com[1])):
        yield Fault(f"{path}.com", shown(com) if not isinstance(com, tuple) else str(com), "two finite numbers, (x, y)")
    yield from _guess(path, link.guess)


def _joint(path: str, joint: Joint, bodies: Mapping[str, Any]) -> Iterator[Fault]:
    yield from name_faults(f"{path}.kind", joint.kind, FREEDOMS)
    yield from name_faults(f"{path}.first", joint.first, bodies)
    yield from name_faults(f"{path}.second", joint.second, bodies)
    if joint.first == joint.second:
        yield Fault(f"{path}.second", shown(joint.second), "another body than first")
    yield from _point(f"{path}.first_at", joint.first_at)
    yield from _point(f"{path}.second_at", joint.second_at)
    yield from _numbers(path, joint, _JOINT)
    yield from _guess(path, joint.guess)


def _coupling(path: str, coupling: Coupling, joints: Mapping[str, Joint], bodies: Mapping[str, Any]) -> Iterator[Fault]:
    movable = {name: joint for name, joint in joints.items() if joint.kind != FIXED}
    yield from name_faults(f"{path}.kind", coupling.kind, _COUPLINGS)
    yield from name_faults(f"{path}.first", coupling.first, movable)
    yield from name_faults(f"{path}.second", coupling.second, movable)
    if coupling.first == coupling.second:
        yield Fault(f"{path}.second", shown(coupling.second), "another joint than first")
    yield from _numbers(path, coupling, _COUPLING)
    if coupling.kind == CAM and not isinstance(coupling.lift, Lift):
        yield Fault(f"{path}.lift", shown(coupling.lift), "a Lift")
    if coupling.contact is not None:
        yield from _place(f"{path}.contact", coupling.contact, bodies)


def _side(path: str, side: Side, bodies: Mapping[str, Any]) -> Iterator[Fault]:
    for name in ("point", "start", "end"):
        yield from _place(f"{path}.{name}", getattr(side, name), bodies)
    if side.sense not in (1, -1):
        yield Fault(f"{path}.sense", shown(side.sense), "+1 (left) or -1 (right)")


def _place(path: str, pair: Any, bodies: Mapping[str, Mapping[str, None]]) -> list[Fault]:
    """Faults of a point's two names: body, point."""
    if not isinstance(pair, tuple) or len(pair) != 2:
        return [Fault(path, shown(pair), "two names, of a body and of its point")]
    body, point = pair
    return name_faults(f"{path}[0]", body, bodies) or name_faults(f"{path}[1]", point, bodies[body])


# -- poses -------------------------------------------------------------------------------------------------------------


Array = NDArray[np.float64]


class Track(NamedTuple):
    """Positions of a point or a joint's coordinate, with first and second derivative by the driver's coordinate."""

    value: Array
    rate: Array
    slope: Array


class Poses(NamedTuple):
    """Poses of every body of `linkage.names` (the frame first) at coordinates `q` of the driver, shape (n,).

    value, rate, slope: shape (bodies, 3, n): x, y (m) of the origin of the body's own frame and its angle (rad), then
    their first and second derivatives by q (the influence coefficients g and g').
    """

    linkage: Linkage
    q: Array
    value: Array
    rate: Array
    slope: Array

    def angle(self, body: str) -> Track:
        """A body's angle, g, g'; SceneError for a body that there is not."""
        k = self._index(body)
        return Track(self.value[k, 2], self.rate[k, 2], self.slope[k, 2])

    def point(self, body: str, at: Point | tuple[float, float]) -> Track:
        """A point of a body (in the body's frame, m), as arrays of shape (2, n).

        p = o + R(theta) a;  p' = o' + theta' R a_perp;  p'' = o'' + theta'' R a_perp - theta'² R a.
        """
        if isinstance(at, str) or np.size(at) < 2:
            raise SceneError([Fault("at", shown(at), "a Point, or a place (x, y) in m")])
        a, b = at[-2:]
        k = self._index(body)
        x, y, theta = self.value[k]
        c, s = np.cos(theta), np.sin(theta)
        arm = np.stack((a * c - b * s, a * s + b * c))
        across = np.stack((-arm[1], arm[0]))
        turn, turning = self.rate[k, 2], self.slope[k, 2]
        return Track(
            np.stack((x, y)) + arm,
            self.rate[k, :2] + turn * across,
            self.slope[k, :2] + turning * across - turn**2 * arm,
        )

    def centre(self, body: str) -> Track:
        """A body's centre of mass."""
        k = self._index(body)
        return self.point(body, self.linkage.links[k - 1].com if k else self.linkage.ground.com)

    def _index(self, body: str) -> int:
        return known("body", body, {name: k for k, name in enumerate(self.linkage.names)})


# -- lifts -------------------------------------------------------------------------------------------------------------


WINDOW = 0.1
"""How far to each side (rad) a bound looks: within a step that is to be proven the cam turns no farther."""

_LIFT_PARTS = 16  # of the stretch between two breakpoints of a lift, at first
_BINS = 720
_ROUNDS = 12
_TIGHT = 4.0  # times what is found by sampling: bounds that are looser are made of narrower stretches
_MOST = 4000


def at(lift: Lift, angle: Array) -> tuple[Array, Array, Array]:
    """Lift, slope and second derivative at angles (rad) of any turn, shape (n,)."""
    local = angle - lift.period * np.floor(angle / lift.period)
    jet = lift.curve.jet(local, local, np)
    value, first, second = (
        np.broadcast_to(np.asarray(part, dtype=float), angle.shape) for part in (jet.value, jet.first, jet.second)
    )
    return value, first, second


class Bounds:
    """Bounds of a lift's second and third derivative near any angle."""

    def __init__(self, lift: Lift) -> None:
        self.period = lift.period
        edges, second, third = _bounded(lift)
        start = np.arange(_BINS) / _BINS * self.period
        width = self.period / _BINS
        self._table = np.stack([_near(edges, values, start, width, self.period) for values in (second, third)])

    def near(self, angle: Array, order: int) -> Array:
        """Largest |second| (order 2) or |third| (order 3) derivative within `WINDOW` of angles (n,)."""
        share = angle / self.period - np.floor(angle / self.period)
        return np.asarray(self._table[order - 2, np.minimum((share * _BINS).astype(int), _BINS - 1)])


@lru_cache(maxsize=64)
def bounds(lift: Lift) -> Bounds:
    """The bounds of a lift, found once."""
    return Bounds(lift)


def _bounded(lift: Lift) -> tuple[Array, Array, Array]:
    """Edges of stretches over a period, and bounds of both derivatives on each, cut where the first ones are loose."""
    ends = np.unique([0.0, *lift.curve.breakpoints, lift.period])
    edges = np.unique(np.concatenate([np.linspace(a, b, _LIFT_PARTS + 1) for a, b in pairwise(ends)]))
    for _ in range(_ROUNDS):
        middle = 0.5 * (edges[1:] + edges[:-1])
        second, third = _derivatives(lift, edges[:-1], edges[1:], middle)
        sampled = np.abs(at(lift, middle)[2])
        loose = ~(second <= _TIGHT * np.maximum(sampled, 0.05 * sampled.max()))
        if not loose.any() or edges.size + loose.sum() > _MOST:
            break
        edges = np.sort(np.concatenate((edges, middle[loose])))
    return edges, second, third


def _derivatives(lift: Lift, low: Array, high: Array, middle: Array) -> tuple[Array, Array]:
    """Bounds of |second| and |third| derivative on stretches: jets of jets of intervals."""
    inner = Jet(Interval(low, high), 1.0, 0.0)
    with np.errstate(all="ignore"):
        found = lift.curve.jet(inner, middle, jet_namespace(INTERVALS)).second
        parts = (found.value, found.first) if isinstance(found, Jet) else (found, 0.0)
        second, third = (
            np.broadcast_to((part.magnitude if isinstance(part, Interval) else np.abs(part)), middle.shape) for part in parts
        )
    return np.where(np.isnan(second), np.inf, second), np.where(np.isnan(third), np.inf, third)


def _near(edges: Array, values: Array, start: Array, width: float, period: float) -> Array:
    """The largest value of all stretches that come within the window of a bin, whatever the turn."""
    copies = [(edges + turn * period, values) for turn in (-1.0, 0.0, 1.0)]
    low = np.concatenate([copy[:-1] for copy, _ in copies])
    high = np.concatenate([copy[1:] for copy, _ in copies])
    size = np.concatenate([copy for _, copy in copies])
    return np.array([size[(high >= a - WINDOW) & (low <= a + width + WINDOW)].max() for a in start])
