"""Whether a linkage is one at all: names that are known and unique, numbers that are finite, joints and couplings that fit.

Whether it can be assembled and moves is found later, when it is solved.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from flywheel.arguments import ANY, NOT_NEGATIVE, fits, name_faults, number_faults, refuse, require, shown
from flywheel.faults import Fault
from flywheel.linkage.description import (
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
    flywheel.faults.SceneError: mechanism.joints[0].second: found "crnk", expected one of frame, crank; did you mean "crank"?
    mechanism.joints[0].friction: found -0.1, expected a finite number, 0 or above

    """
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
