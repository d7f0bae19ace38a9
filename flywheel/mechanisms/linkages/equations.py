"""From the description of a linkage to its loop equations in numbers: checked, closed, scaled, solved by Newton-Raphson.

A tree of joints places every body; every other joint closes a loop, which is two equations. The unknowns are the angles of
the bodies and the displacements of the slides. A body's place is a sum of arms, each turned by the angle of the body that
it belongs to, along the tree from the frame. So every position is a combination of few basis functions exp(i theta) and
s exp(i theta), whose derivatives are exact. Slides and rigid joints make angles equal, which costs no equation. Lengths are
in units of the linkage's largest one, so that everything is of order 1.

Everything is evaluated for n positions at once: z has shape (n, variables), residuals (n, equations).
"""

from __future__ import annotations

from cmath import phase
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, lru_cache
from itertools import combinations, pairwise, takewhile
from math import pi, prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph import recording
from flywheel.numerics.faults import (
    ANY,
    NOT_NEGATIVE,
    Fault,
    SceneError,
    brief,
    entry,
    fits,
    name_faults,
    number_faults,
    refuse,
    require,
)
from flywheel.numerics.intervals import NAMESPACE as INTERVALS
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, is_recorded, jet_namespace, mapped, present
from flywheel.scene.linkage import (
    CAM,
    FIXED,
    FRAME,
    FREEDOMS,
    GEAR,
    PIN,
    ROLLING,
    SLIDE,
    SLOT,
    Coupling,
    Driver,
    Joint,
    Lift,
    Link,
    Linkage,
    Point,
    Side,
)

__all__ = [
    "SETTLED", "WINDOW", "Bases", "Chain", "CouplingRelation", "Equations", "Form", "Loops", "Poses", "Track", "check",
    "correction", "driver_scales", "inverse", "lift_at", "lift_bound", "loops", "on_way", "settle", "solved", "split",
    "turned",
]  # fmt: skip

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Chain = dict[tuple[str, int], complex]
"""A sum of arms: coefficient by the body whose angle turns it and the variable that stretches it (-1: none)."""


# -- description -------------------------------------------------------------------------------------------------------

_PARTS: dict[str, type] = {"links": Link, "joints": Joint, "couplings": Coupling, "sides": Side, "further": Driver}
_NUMBERS: dict[type, dict[str, str]] = {
    Point: {"x": ANY, "y": ANY},
    Link: {"mass": NOT_NEGATIVE, "inertia": NOT_NEGATIVE},
    Joint: {"direction": ANY, "angle": ANY, "friction": NOT_NEGATIVE, "radius": NOT_NEGATIVE, "length": NOT_NEGATIVE},
    Coupling: {"ratio": ANY, "phase": ANY, "pressure_angle": ANY, "friction": NOT_NEGATIVE},
}


def check(linkage: Linkage) -> None:
    """Refuses a linkage whose description is wrong, with every fault in a line.

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
    refuse(list(_type_faults(linkage)))
    refuse(list(_naming_faults(linkage)))
    refuse(list(_content_faults(linkage)))


def _type_faults(linkage: Linkage) -> Iterator[Fault]:
    """Faults of an argument that is no tuple of the right type."""
    for key, kind in _PARTS.items():
        items, path = getattr(linkage, key), f"{linkage.path}.{key}"
        if type(items) is not tuple:
            yield Fault(path, brief(items), f"a tuple of {kind.__name__}")
            continue
        for k, item in enumerate(items):
            if not isinstance(item, kind):
                yield Fault(f"{path}[{k}]", brief(item), f"a {kind.__name__}")
    if not isinstance(linkage.ground, Link):
        yield Fault(f"{linkage.path}.ground", brief(linkage.ground), "a Link")


def _naming_faults(linkage: Linkage) -> Iterator[Fault]:
    """Faults of names that are invalid or not unique, and of the points that have them."""
    path = linkage.path
    yield from _unique((f"{path}.links[{k - 1}]", name) for k, name in enumerate(linkage.names))
    parts: dict[str, tuple[Joint | Coupling, ...]] = {"joints": linkage.joints, "couplings": linkage.couplings}
    yield from _unique((f"{path}.{key}[{k}]", part.name) for key, items in parts.items() for k, part in enumerate(items))
    for k, link in enumerate((linkage.ground, *linkage.links)):
        at = f"{path}.links[{k - 1}].points" if k else f"{path}.ground.points"
        if type(link.points) is not tuple:
            yield Fault(at, brief(link.points), "a tuple of Point")
            continue
        faults = [fault for j, point in enumerate(link.points) for fault in _point_faults(f"{at}[{j}]", point)]
        yield from faults or _unique((f"{at}[{j}]", point.name) for j, point in enumerate(link.points))


def _unique(named: Iterable[tuple[str, Any]]) -> Iterator[Fault]:
    seen = set()
    for path, name in named:
        if not isinstance(name, str) or not name:
            yield Fault(f"{path}.name", brief(name), "a name")
        elif name in seen:
            yield Fault(f"{path}.name", brief(name), "a unique name", "another one has this name")
        else:
            seen.add(name)


def _content_faults(linkage: Linkage) -> Iterator[Fault]:
    """Faults within the parts and of their references; all names are valid."""
    bodies = {name: {at.name: None for at in linkage.link(name).points} for name in linkage.names}
    joints = {joint.name: joint for joint in linkage.joints}
    for k, link in enumerate(linkage.links):
        path = f"{linkage.path}.links[{k}]"
        yield from _numbers(path, link)
        com: Any = link.com
        if not (isinstance(com, tuple) and len(com) == 2 and fits(com[0]) and fits(com[1])):
            text = str(com) if isinstance(com, tuple) else brief(com)
            yield Fault(f"{path}.com", text, "two finite numbers, (x, y)")
        yield from [] if link.guess is None else number_faults(f"{path}.guess", link.guess)
    for k, joint in enumerate(linkage.joints):
        path = f"{linkage.path}.joints[{k}]"
        yield from name_faults(f"{path}.kind", joint.kind, FREEDOMS)
        yield from name_faults(f"{path}.first", joint.first, bodies)
        yield from name_faults(f"{path}.second", joint.second, bodies)
        if joint.first == joint.second:
            yield Fault(f"{path}.second", brief(joint.second), "another body than first")
        yield from _point_faults(f"{path}.first_at", joint.first_at)
        yield from _point_faults(f"{path}.second_at", joint.second_at)
        yield from _numbers(path, joint)
        yield from [] if joint.guess is None else number_faults(f"{path}.guess", joint.guess)
    movable = {name: None for name, joint in joints.items() if joint.kind != FIXED}
    for k, coupling in enumerate(linkage.couplings):
        path = f"{linkage.path}.couplings[{k}]"
        yield from name_faults(f"{path}.kind", coupling.kind, dict.fromkeys((GEAR, ROLLING, CAM)))
        yield from name_faults(f"{path}.first", coupling.first, movable)
        yield from name_faults(f"{path}.second", coupling.second, movable)
        if coupling.first == coupling.second:
            yield Fault(f"{path}.second", brief(coupling.second), "another joint than first")
        yield from _numbers(path, coupling)
        if coupling.kind == CAM and not isinstance(coupling.lift, Lift):
            yield Fault(f"{path}.lift", brief(coupling.lift), "a Lift")
        if coupling.contact is not None:
            yield from _place_faults(f"{path}.contact", coupling.contact, bodies)
    for k, side in enumerate(linkage.sides):
        path = f"{linkage.path}.sides[{k}]"
        for name in ("point", "start", "end"):
            yield from _place_faults(f"{path}.{name}", getattr(side, name), bodies)
        if side.sense not in (1, -1):
            yield Fault(f"{path}.sense", brief(side.sense), "+1 (left) or -1 (right)")
    drivers = {name: None for name, joint in joints.items() if joint.kind in (PIN, SLIDE)}
    yield from name_faults(f"{linkage.path}.driver", linkage.driver, drivers)
    yield from number_faults(f"{linkage.path}.start", linkage.start)
    driven = {linkage.driver}
    for k, driver in enumerate(linkage.further):
        path = f"{linkage.path}.further[{k}]"
        yield from name_faults(f"{path}.joint", driver.joint, drivers)
        yield from number_faults(f"{path}.start", driver.start)
        if driver.joint in driven:
            yield Fault(f"{path}.joint", brief(driver.joint), "another joint", "it drives already")
        driven.add(driver.joint)


def _numbers(path: str, item: object) -> Iterator[Fault]:
    for name, what in _NUMBERS[type(item)].items():
        yield from number_faults(f"{path}.{name}", getattr(item, name), what)


def _point_faults(path: str, point: Any) -> Iterator[Fault]:
    if isinstance(point, Point):
        yield from _numbers(path, point)
    else:
        yield Fault(path, brief(point), "a Point")


def _place_faults(path: str, pair: Any, bodies: Mapping[str, Mapping[str, None]]) -> list[Fault]:
    """Faults of a point's two names: body, point."""
    if not isinstance(pair, tuple) or len(pair) != 2:
        return [Fault(path, brief(pair), "two names, of a body and of its point")]
    body, point = pair
    return name_faults(f"{path}[0]", body, bodies) or name_faults(f"{path}[1]", point, bodies[body])


# -- loops -------------------------------------------------------------------------------------------------------------

_PARALLEL = 1e-9  # rad: angles that differ by less are one
_ALIKE = 1e-12  # of a length: cranks that differ by less are alike
_LOOKS = 64  # angles of a period at which a lift is looked at, for its size


class Form(NamedTuple):
    """A linear form of the variables z: weights · z + constant."""

    weights: Array
    constant: float

    def at(self, z: Array) -> Array:
        """The form's values at z, shape (n,)."""
        return np.asarray(z @ self.weights + self.constant)


class CouplingRelation(NamedTuple):
    """A coupling as second - ratio first - phase = 0, or second - lift(first) = 0 in scaled variables."""

    first: Form
    second: Form
    ratio: float
    phase: float
    lift: Lift | None
    scale: float  # of the lift: 1/unit for a sliding follower

    def law(self, z: Array, at: Array | None = None) -> tuple[Array, Array, Array]:
        """Value of `second` required without the phase, two derivatives by `first`, (n,) each; a lift's as in `bases`."""
        angle = self.first.at(z)
        if self.lift is None:
            return self.ratio * angle, np.full_like(angle, self.ratio), np.zeros_like(angle)
        value, first, second = lift_at(self.lift, angle, None if at is None else self.first.at(at))
        return self.scale * value, self.scale * first, self.scale * second


class Loops(NamedTuple):
    """A linkage as equations in z = (driver, unknowns): angles in rad, displacements in units of `unit` m.

    Basis function k is exp(i turns[k] · z), times z[slides[k]] where slides[k] >= 0. `closures` (equations/2, bases) are
    the loops' complex coefficients, `origins` (bodies, bases) those of the bodies' origins; `angles` holds every body's
    angle as a form. `paths` names for every closure the joints of its loop.
    `names` describes each variable; `doubled` are the joints whose angle other joints determine already. `way`: the scaled
    coordinates of all drivers at both ends of a straight way, (2, drivers), where several drive: the first variable is then
    the share of that way, and the last relations say where each driver stands on it.
    """

    linkage: Linkage
    unit: float
    names: tuple[str, ...]
    turns: Array
    slides: NDArray[np.intp]
    closures: Complex
    origins: Complex
    angles: tuple[Form, ...]
    relations: tuple[CouplingRelation, ...]
    paths: tuple[tuple[str, ...], ...]
    doubled: tuple[str, ...]
    way: Array | None = None

    @property
    def unknowns(self) -> int:
        """Number of unknowns at a given position of the driver."""
        return len(self.names) - 1

    @property
    def equations(self) -> int:
        """Number of real equations between them."""
        return 2 * len(self.closures) + len(self.relations)

    @property
    def start(self) -> float:
        """The driver's coordinate at which the linkage is assembled, scaled; the beginning of the way of several."""
        if self.way is not None:
            return 0.0
        return self.linkage.start / self.unit if self.linkage.sliding else self.linkage.start


def loops(linkage: Linkage, *, several: bool = False, unit: float | None = None) -> Loops:
    """The loops of a linkage: every body placed along the tree of joints, every other joint a closure.

    several: True allows any number of drivers, each fixed at its start by a relation (`on_way` moves them).
    unit: of length, m; by default the largest length.

    Raises:
        SceneError: if a body has no connection to the frame, or slides and rigid joints fix it at two angles at once; for
            further drivers, unless `several`.

    """
    if linkage.further and not several:
        several_names = ", ".join(driver.joint for driver in linkage.drivers)
        defect, expected = f"{len(linkage.drivers)} drivers ({several_names})", "one driver, of one degree of freedom"
        advice = "for several use flywheel.freedoms (see flywheel reference freedoms)"
        raise SceneError([Fault(f"{linkage.path}.driver", defect, expected, advice)])
    unit = unit or _unit(linkage)
    offset, leader, doubled = _rigid_angles(linkage)
    driving = None if several else linkage.driver
    names, angles = _variables(linkage, offset, leader, driving)

    def variable(joint: Joint) -> int:
        return 0 if joint.name == driving else names.index(f"slide of {joint.name}")

    def step(joint: Joint) -> Chain:
        """The vector from the origin of the joint's first body to that of its second."""
        out, back = joint.first_at, joint.second_at
        arms = [(joint.first, -1, vector(out.x / unit, out.y / unit))]
        if joint.kind in (SLIDE, SLOT):
            arms.append((joint.first, variable(joint), cis(joint.direction)))
        arms.append((joint.second, -1, vector(-back.x / unit, -back.y / unit)))
        return _sum(*({(leader[body], slide): arm * cis(offset[body])} for body, slide, arm in arms if arm))

    places: dict[str, Chain] = {FRAME: {}}
    routes: dict[str, tuple[str, ...]] = {FRAME: ()}  # names of the joints from the frame to each body
    todo = deque([FRAME])
    while todo:
        body = todo.popleft()
        for joint in linkage.joints:
            if body not in (joint.first, joint.second):
                continue
            other = joint.second if joint.first == body else joint.first
            if other not in places:
                places[other] = _sum(places[body], step(joint) if joint.first == body else _negative(step(joint)))
                routes[other] = (*routes[body], joint.name)
                todo.append(other)
    defect, expected = "a body that no joints connect with the frame", "joints that do"
    refuse([Fault(f"{linkage.path}.bodies.{b}", defect, expected) for b in linkage.names if b not in places])
    in_tree = {name for route in routes.values() for name in route}
    closing = [joint for joint in linkage.joints if joint.name not in in_tree]
    closures = [_sum(places[joint.first], step(joint), _negative(places[joint.second])) for joint in closing]
    bases = list(dict.fromkeys(basis for chain in (*places.values(), *closures) for basis in chain))

    def matrix(chains: list[Chain]) -> Complex:
        """Coefficients of chains over the basis functions, with the constant of each leader's angle put in."""
        turned = [cis(angles[body].constant) for body, _ in bases]
        rows = [[chain.get(basis, 0.0) * turn for basis, turn in zip(bases, turned, strict=True)] for chain in chains]
        kind = object if any(isinstance(entry, recording.Complex) for row in rows for entry in row) else complex
        return np.array(rows, dtype=kind).reshape(len(chains), len(bases))

    def around(joint: Joint) -> tuple[str, ...]:
        """Names of the joints around the loop that a joint closes."""
        up, down = routes[joint.first], routes[joint.second]
        shared = len(list(takewhile(lambda pair: pair[0] == pair[1], zip(up, down, strict=False))))
        return (*up[shared:], joint.name, *reversed(down[shared:]))

    def coordinate(joint: Joint) -> Form:
        if joint.kind == PIN:
            first, second = angles[joint.first], angles[joint.second]
            return Form(second.weights - first.weights, second.constant - first.constant)
        return Form(np.eye(len(names))[variable(joint)], 0.0)

    def relation(coupling: Coupling) -> CouplingRelation:
        first, second = linkage.joint(coupling.first), linkage.joint(coupling.second)
        units = [1.0 if joint.kind == PIN else unit for joint in (first, second)]
        lift = coupling.lift if coupling.kind == CAM else None
        ratio = 0.0 if lift else coupling.ratio * units[0] / units[1]
        return CouplingRelation(
            coordinate(first), coordinate(second), ratio, coupling.phase / units[1], lift, 1.0 / units[1]
        )

    described = Loops(
        linkage=linkage,
        unit=unit,
        names=names,
        turns=np.array([angles[body].weights for body, _ in bases]).reshape(-1, len(names)),
        slides=np.array([slide for _, slide in bases], dtype=np.intp),
        closures=matrix(closures),
        origins=matrix([places[body] for body in linkage.names]),
        angles=tuple(angles[body] for body in linkage.names),
        relations=tuple(relation(coupling) for coupling in linkage.couplings),
        paths=tuple(around(joint) for joint in closing),
        doubled=doubled,
    )
    if not several:
        return described
    still = Form(np.zeros(len(names)), 0.0)
    relations = tuple(
        CouplingRelation(still, coordinate(linkage.joint(name)), 0.0, 0.0, None, 1.0) for name, _ in linkage.drivers
    )
    described = described._replace(relations=(*described.relations, *relations))
    starts = np.array([driver.start for driver in linkage.drivers]) / driver_scales(described)
    return on_way(described, starts, starts)


def driver_scales(loops: Loops) -> Array:
    """Scale of each driver's coordinate, (drivers,): `unit` m where it slides, 1 rad where it turns."""
    kinds = [loops.linkage.joint(name).kind for name, _ in loops.linkage.drivers]
    return np.array([loops.unit if kind == SLIDE else 1.0 for kind in kinds])


def on_way(loops: Loops, low: Array, high: Array) -> Loops:
    """The same loops, with all drivers on the straight way between two sets of scaled coordinates, (drivers,) each."""
    first = Form(np.eye(len(loops.names))[0], 0.0)
    others, drivers = loops.relations[: -len(low)], loops.relations[-len(low) :]
    ways = zip(drivers, (high - low).tolist(), low.tolist(), strict=True)
    moved = tuple(relation._replace(first=first, ratio=step, phase=start) for relation, step, start in ways)
    return loops._replace(relations=(*others, *moved), way=np.stack((low, high)))


def _sum(*chains: Chain) -> Chain:
    total: Chain = {}
    for chain in chains:
        for basis, coefficient in chain.items():
            total[basis] = total.get(basis, 0.0) + coefficient
    return total


def _negative(chain: Chain) -> Chain:
    return {basis: -coefficient for basis, coefficient in chain.items()}


def _unit(linkage: Linkage) -> float:
    """The largest length that the joints stand on, or that couplings move a slide by, m."""
    lengths = [abs(x) for joint in linkage.joints for point in (joint.first_at, joint.second_at) for x in (point.x, point.y)]
    lengths += [abs(joint.guess) for joint in linkage.joints if joint.guess and joint.kind in (SLIDE, SLOT)]
    for pair in linkage.couplings:
        if linkage.joint(pair.second).kind != SLIDE:
            continue
        if pair.lift is None:
            lengths += [abs(pair.ratio), abs(pair.phase)]  # what a radian rolls off
        else:
            lift = lift_at(pair.lift, np.linspace(0.0, pair.lift.period, _LOOKS))[0]
            lengths.append(float(np.abs(lift).max()) if np.isfinite(lift).all() else 0.0)
    return max([*lengths, abs(linkage.start) if linkage.sliding else 0.0]) or 1.0


def _variables(
    linkage: Linkage, offset: dict[str, float], leader: dict[str, str], driving: str | None
) -> tuple[tuple[str, ...], dict[str, Form]]:
    """Names of the variables, the driver's coordinate first, and every body's angle as a form of them.

    driving: the driver whose coordinate is the first variable; None if that is the share of a way.

    A body's angle is its leader's, and its constant angle against that; the leader that a pin drives has the
    angle of that pin's other body, and the driver's coordinate.
    """
    driver = None if driving is None else linkage.joint(driving)
    turning = {leader[body] for body in linkage.names} - {leader[FRAME]}
    driven, carrier, sign = "", "", 1.0
    if driver is not None and driver.kind == PIN:
        first, second = leader[driver.first], leader[driver.second]
        if first == second:
            defect = f"{driver.name} between {driver.first} and {driver.second}, which cannot turn against each other"
            raise SceneError([Fault(f"{linkage.path}.driver", defect, "a joint that can move")])
        driven, carrier, sign = (second, first, 1.0) if second in turning else (first, second, -1.0)
    sliding = [joint.name for joint in linkage.joints if joint.kind in (SLIDE, SLOT) and joint is not driver]
    names = (
        "share of the way" if driver is None else f"coordinate of {driver.name}",
        *(f"angle of {body}" for body in linkage.names if body in turning and body != driven),
        *(f"slide of {name}" for name in sliding),
    )
    angles = {}
    for body in linkage.names:
        weights, constant, follows = np.zeros(len(names)), offset[body], leader[body]
        if driver is not None and follows == driven:
            weights[0] += sign
            constant += sign * (offset[driver.first] - offset[driver.second])
            follows = carrier
        if follows == leader[FRAME]:
            constant -= offset[FRAME]
        else:
            weights[names.index(f"angle of {follows}")] += 1.0
        angles[body] = Form(weights, constant)
    return names, angles


def _rigid_angles(linkage: Linkage) -> tuple[dict[str, float], dict[str, str], tuple[str, ...]]:
    """Bodies that keep their angle to each other: the constant angle of each to its leader, the leader, spare holds."""
    offset = dict.fromkeys(linkage.names, 0.0)
    leader = {body: body for body in linkage.names}
    doubled = []
    angles = [(joint, joint.first, joint.second, joint.angle) for joint in linkage.joints if joint.kind in (SLIDE, FIXED)]
    for joint, one, other, angle in [*angles, *((None, *pair) for pair in _translating(linkage))]:
        first, second = leader[one], leader[other]
        turn = offset[one] + angle - offset[other]
        if first != second:
            for body in linkage.names:
                if leader[body] == second:
                    leader[body] = first
                    offset[body] += turn
        elif joint is not None:
            gap = (turn + pi) % (2 * pi) - pi
            if abs(gap) > _PARALLEL:
                defect = (
                    f"{joint.name}, which turns {other} by {np.degrees(gap):.6g} deg against what other joints hold it at"
                )
                expected, advice = "slides and rigid joints that agree", "change an angle"
                raise SceneError([Fault(f"{linkage.path}.joints", defect, expected, advice)])
            doubled.append(joint.name)
    return offset, leader, tuple(doubled)


def _translating(linkage: Linkage) -> Iterator[tuple[str, str, float]]:
    """Pairs of bodies that three cranks of one length keep from turning against each other, and the angle between them.

    The cranks' pins must form the same figure on both bodies. If the second could turn by R against that, all of its pins
    p + (R - 1) c, c those of the first, would lie on a circle about 0 of the cranks' length: there is none through three
    places in line, and one of a fixed R otherwise, with which nothing moves. Where the cranks are in line with their pivots,
    only this tells them apart from two cranks, which branch there.
    """
    ends: dict[str, list[tuple[str, complex, complex]]] = {body: [] for body in linkage.names}
    for joint in mapped(linkage.joints, present):
        if joint.kind == PIN:
            own, its = complex(*joint.first_at[1:]), complex(*joint.second_at[1:])
            ends[joint.first].append((joint.second, own, its))
            ends[joint.second].append((joint.first, its, own))
    for one, other in combinations(linkage.names, 2):
        cranks = [
            (here, there, abs(to - at))
            for body, here, at in ends[one]
            for far, to, there in ends[body]
            if far == other and body != other
        ]
        for (a, p, r), (b, q, s), (c, o, t) in combinations(cranks, 3):
            size = _ALIKE * max(abs(a - b), abs(a - c), r)
            if min(abs(a - b), abs(a - c), abs(b - c), r) <= size or max(abs(r - s), abs(r - t)) >= size:
                continue
            turn = (a - b) / (p - q) if p != q else 0j
            gaps = turn * (p - q) - (a - b), turn * (p - o) - (a - c), (abs(turn) - 1.0) * abs(a - b)
            if max(map(abs, gaps)) < size:
                yield one, other, phase(turn)
                break


# -- lifts of cams -----------------------------------------------------------------------------------------------------

WINDOW = 0.1
"""Reach of a bound to each side (rad): within a step that is to be proven the cam turns no farther."""

_STRETCHES = 16  # between two breakpoints of a lift, at first
_BINS = 720
_ROUNDS = 12
_TIGHT = 4.0  # times what is found by sampling: bounds that are looser are made of narrower stretches
_MOST_STRETCHES = 4000


def lift_at(lift: Lift, angle: Array, anchor: Array | None = None) -> tuple[Array, Array, Array]:
    """Lift, slope and second derivative at angles (rad) of any turn, shape (n,), in their own pieces or those of anchors."""
    middle = angle if anchor is None else anchor
    turns = lift.period * np.floor(middle / lift.period)
    if angle.dtype == object:
        jet = lift.curve.jet(angle[0] - turns[0], middle[0] - turns[0], recording.NAMESPACE)
        value, first, second = (np.array([part], dtype=object) for part in (jet.value, jet.first, jet.second))
        return value, first, second
    jet = lift.curve.jet(angle - turns, middle - turns, np)
    value, first, second = (
        np.broadcast_to(np.asarray(part, dtype=float), angle.shape) for part in (jet.value, jet.first, jet.second)
    )
    return value, first, second


def lift_bound(lift: Lift, angle: Array, order: int) -> Array:
    """Largest |second| (order 2) or |third| (order 3) derivative of a lift within `WINDOW` of angles (n,)."""
    share = angle / lift.period - np.floor(angle / lift.period)
    return np.asarray(_bounds(lift)[order - 2, np.minimum((share * _BINS).astype(int), _BINS - 1)])


@lru_cache(maxsize=64)
def _bounds(lift: Lift) -> Array:
    """Bounds of both derivatives near the angles of each bin, (2, bins): of stretches that are cut where they are loose."""
    ends = np.unique([0.0, *lift.curve.breakpoints, lift.period])
    edges = np.unique(np.concatenate([np.linspace(a, b, _STRETCHES + 1) for a, b in pairwise(ends)]))
    for _ in range(_ROUNDS):
        middle = 0.5 * (edges[1:] + edges[:-1])
        # bounds of |second| and |third| derivative on stretches, (2, stretches): jets of jets of intervals
        inner = Jet(Interval(edges[:-1], edges[1:]), 1.0, 0.0)
        with np.errstate(all="ignore"):
            second = lift.curve.jet(inner, middle, jet_namespace(INTERVALS)).second
            parts = (second.value, second.first) if isinstance(second, Jet) else (second, 0.0)
            magnitudes = [part.magnitude if isinstance(part, Interval) else np.abs(part) for part in parts]
        table = np.stack([np.broadcast_to(size, middle.shape) for size in magnitudes])
        sizes = np.where(np.isnan(table), np.inf, table)
        sampled = np.abs(lift_at(lift, middle)[2])
        loose = ~(sizes[0] <= _TIGHT * np.maximum(sampled, 0.05 * sampled.max()))
        if not loose.any() or edges.size + loose.sum() > _MOST_STRETCHES:
            break
        edges = np.sort(np.concatenate((edges, middle[loose])))
    low, high = (np.concatenate([end + turn * lift.period for turn in (-1.0, 0.0, 1.0)]) for end in (edges[:-1], edges[1:]))
    sizes, width = np.tile(sizes, 3), lift.period / _BINS
    start = np.arange(_BINS) / _BINS * lift.period
    return np.stack([sizes[:, (high >= a - WINDOW) & (low <= a + width + WINDOW)].max(axis=1) for a in start], axis=1)


# -- equations ---------------------------------------------------------------------------------------------------------


class _ColumnSums:
    """The sums of a table's columns that the columns of a matrix weigh, most of whose weights are 0.

    A product with the whole matrix would add up zeros, over as many threads as there are processors.
    """

    def __init__(self, matrix: Any) -> None:
        columns, self._rows = np.nonzero(matrix.T)
        self._weights = matrix.T[columns, self._rows]
        self._columns, self._first = np.unique(columns, return_index=True)
        self._width = matrix.shape[1]

    def __call__(self, table: Any) -> Any:
        terms = table[:, self._rows] * self._weights
        sums = np.zeros((len(table), self._width), terms.dtype)
        if self._columns.size:
            sums[:, self._columns] = np.add.reduceat(terms, self._first, axis=1)
        return sums


class Bases(NamedTuple):
    """The basis functions at n positions: `whole` with the displacement in front, `bare` without, shape (n, bases).

    `laws` holds the value that every coupling requires there, with two derivatives, (n,) each.
    """

    whole: Complex
    bare: Complex
    laws: tuple[tuple[Array, Array, Array], ...]


class Equations:
    """The equations of `Loops`: two for every closure (real and imaginary part), then one for every coupling."""

    def __init__(self, loops: Loops) -> None:
        self.loops = loops
        self.sliding = loops.slides >= 0
        self.slide = np.where(self.sliding, loops.slides, 0)
        closures, bases = loops.closures.shape
        variables = len(loops.names)
        factors = np.zeros((bases, variables))
        factors[self.sliding, loops.slides[self.sliding]] = 1.0
        shape = bases, closures * variables  # sums that give the closures' Jacobian straight from the basis functions
        turning = (1j * loops.closures[:, :, None] * loops.turns[None]).transpose(1, 0, 2).reshape(shape)
        sliding = (loops.closures[:, :, None] * factors[None]).transpose(1, 0, 2).reshape(shape)
        self._turned, self._moved = _ColumnSums(turning), _ColumnSums(sliding) if sliding.any() else None
        self._angles, self._closures, self._origins = map(_ColumnSums, (loops.turns.T, loops.closures.T, loops.origins.T))
        self._any_sliding = bool(self.sliding.any())
        self._sizes = np.abs(loops.turns).T

    @cached_property
    def _moduli(self) -> Array:
        """Moduli of the closures' coefficients, (bases, equations): a closure's two parts share one bound."""
        return np.asarray(np.repeat(np.abs(self.loops.closures), 2, axis=0).T)

    def bases(self, z: Array, at: Array | None = None) -> Bases:
        """Basis functions at positions z; `at` lies in the same pieces of cams, where those of z are not known."""
        bare = turned(self._angles(z))
        whole = bare * np.where(self.sliding, z[:, self.slide], 1.0) if self._any_sliding else bare
        return Bases(whole, bare, tuple(relation.law(z, at) for relation in self.loops.relations))

    def residual(self, z: Array, bases: Bases) -> Array:
        """Left sides of all equations."""
        pairs = zip(self.loops.relations, bases.laws, strict=True)
        return self._columns(bases.whole, [relation.second.at(z) - law[0] - relation.phase for relation, law in pairs])

    def jacobian(self, z: Array, bases: Bases) -> Array:
        """Derivatives of all equations by all variables, shape (n, equations, variables)."""
        flat = self._turned(bases.whole)
        if self._moved is not None:
            flat = flat + self._moved(bases.bare)
        closures, variables = len(self.loops.closures), z.shape[1]
        jacobian = flat.reshape(len(z), closures, variables)
        parts = np.stack(split(jacobian), axis=2).reshape(len(z), 2 * closures, variables)
        if not self.loops.relations:
            return parts
        pairs = zip(self.loops.relations, bases.laws, strict=True)
        lines = [(pair.second.weights - law[1][:, None] * pair.first.weights)[:, None, :] for pair, law in pairs]
        return np.concatenate([parts, *lines], axis=1)

    def bending(self, bases: Bases, rate: Array) -> Array:
        """Second derivative of all equations along a motion with constant rates, d² F/dt² with z'' = 0."""
        pairs = zip(self.loops.relations, bases.laws, strict=True)
        bent = [-law[2] * (rate @ relation.first.weights) ** 2 for relation, law in pairs]
        return self._columns(self._second(bases, rate), bent)

    def _columns(self, functions: Complex, couplings: list[Array]) -> Array:
        """A column for each part of a sum of basis functions over the closures, then those of the couplings."""
        gaps = self._closures(functions)
        parts = np.stack(split(gaps), axis=2).reshape(len(gaps), -1)  # real and imaginary part beside one another
        return np.concatenate((parts, *(column[:, None] for column in couplings)), axis=1) if couplings else parts

    def _second(self, bases: Bases, rate: Array) -> Complex:
        """Second derivative of the basis functions at constant rates."""
        turning, sliding = self._angles(rate), self._sliding_rate(rate)
        second: Complex = -(turning**2) * bases.whole + 2j * turning * sliding * bases.bare
        return second

    def _sliding_rate(self, rate: Array) -> Array | float:
        return np.where(self.sliding, rate[:, self.slide], 0.0) if self._any_sliding else 0.0

    def origins(self, bases: Bases, rate: Array, slope: Array) -> tuple[Complex, Complex, Complex]:
        """Bodies' origins (units) as complex numbers with first and second derivative, each of shape (n, bodies)."""
        first, second = (
            1j * self._angles(along) * bases.whole + self._sliding_rate(along) * bases.bare for along in (rate, slope)
        )
        return self._origins(bases.whole), self._origins(first), self._origins(self._second(bases, rate) + second)

    def turned(self, step: Array) -> Array:
        """Greatest turn (rad) of the cams in a step of z (absolute values), shape (n,)."""
        turns = [step @ np.abs(r.first.weights) for r in self.loops.relations if r.lift is not None]
        return np.max(turns, axis=0) if turns else np.zeros(len(step))

    def bound(self, z: Array, reach: Array, *steps: Array) -> Array:
        """Bound of the second (third) derivative of every equation near z, contracted with two (three) steps of z.

        reach: largest |displacement| of each basis function there, (n, bases); steps: absolute values, (n, variables).
        It holds as far from z as cams do not turn farther than `WINDOW`.
        """
        turned = [step @ self._sizes for step in steps]
        total = reach * prod(turned)
        for k, step in enumerate(steps if self._any_sliding else ()):
            sliding = np.where(self.sliding, step[:, self.slide], 0.0)
            total = total + sliding * prod([t for j, t in enumerate(turned) if j != k])
        bounds = [total @ self._moduli]
        if not self.loops.relations:
            return np.asarray(bounds[0])
        for relation in self.loops.relations:
            along = np.prod([step @ np.abs(relation.first.weights) for step in steps], axis=0)
            if relation.lift is None:
                bounds.append(np.zeros((len(z), 1)))
            else:
                size = abs(relation.scale) * lift_bound(relation.lift, relation.first.at(z), len(steps))
                bounds.append((size * along)[:, None])
        return np.concatenate(bounds, axis=1)


def vector(x: Any, y: Any) -> Any:
    """The number x + iy, also of recorded parts."""
    return recording.Complex(x, y) if is_recorded(x) or is_recorded(y) else complex(x, y)


def cis(angle: Any) -> Any:
    """exp(i angle), also of a recorded angle (rad)."""
    if not is_recorded(angle):
        return complex(np.exp(1j * angle))
    return recording.Complex(recording.NAMESPACE.cos(angle), recording.NAMESPACE.sin(angle))


def turned(angle: Array) -> Complex:
    """exp(i angle) of angles (rad), also of recorded ones."""
    if angle.dtype != object:
        return np.asarray(np.exp(1j * angle))
    return np.array([cis(a) for a in angle.flat], dtype=object).reshape(angle.shape)


def split(table: Complex) -> tuple[Any, Any]:
    """Real and imaginary parts, also of recorded numbers."""
    if table.dtype != object:
        return table.real, table.imag
    parts = ([getattr(value, part) for value in table.flat] for part in ("real", "imag"))
    real, imag = (np.array(part, dtype=object).reshape(table.shape) for part in parts)
    return real, imag


# -- Newton-Raphson ----------------------------------------------------------------------------------------------------

_MOST = 12
SETTLED = 1e-9  # a step below this leaves an error of its square: nothing


def settle(equations: Equations, z: Array) -> tuple[Array, Array]:
    """Positions z (n, variables) corrected at the driver's given coordinate until the next step would be rounding.

    Returns the positions and the size of their last step, (n,). A step below 1e-9 (rad, or units of length) is the last
    one: convergence is quadratic. Positions that do not converge have a last step that is larger; it is NaN if the
    Jacobian is singular.
    """
    z = z.copy()
    last = np.full(len(z), np.inf)
    for _ in range(_MOST):
        move = correction(equations, z)
        z[:, 1:] += move
        last = np.abs(move).max(axis=1, initial=0.0)
        if not (last > SETTLED).any():
            break
    return z, last


def correction(equations: Equations, z: Array, at: Array | None = None) -> Array:
    """One Newton step of the unknowns, shape (n, unknowns); `at`: see `Equations.bases`."""
    bases = equations.bases(z, at)
    gap, jacobian = equations.residual(z, bases), equations.jacobian(z, bases)[:, :, 1:]
    if jacobian.shape[1] == jacobian.shape[2] or gap.dtype == object:
        return solved(jacobian, -gap)
    return np.asarray(-(inverse(jacobian) @ gap[..., None])[..., 0])


def inverse(matrix: Array) -> Array:
    """Inverses of n matrices (n, rows, columns): where redundant constraints add rows, those of least squares.

    Raises LinAlgError for a square matrix that is singular.
    """
    if matrix.shape[-2] == matrix.shape[-1]:
        return np.asarray(np.linalg.inv(matrix))
    return np.asarray(np.linalg.pinv(matrix))


def solved(matrix: Array, right: Array) -> Array:
    """Solutions of n systems, (n, m, m) and (n, m) or (n, m, k); NaN for those that are singular.

    One system of recorded numbers and a vector may have redundant rows.
    """
    if matrix.dtype == object or right.dtype == object:
        return np.array([recording.solved(matrix[0].tolist(), right[0].tolist())], dtype=object)
    vector = right.ndim == 2
    columns = right[..., None] if vector else right
    try:
        solution = np.linalg.solve(matrix, columns)
    except np.linalg.LinAlgError:
        regular = np.linalg.slogdet(matrix)[0] != 0.0
        solution = np.full(columns.shape, np.nan)
        solution[regular] = np.linalg.solve(matrix[regular], columns[regular])
    return np.asarray(solution[..., 0] if vector else solution)


class Track(NamedTuple):
    """Positions with two derivatives by the driver's coordinate: of a point, a joint's coordinate, or all variables.

    All variables are scaled, shape (n, variables), the driver's coordinate first. Those of a mechanism in a graph (rad or m)
    may be intervals or recorded numbers.
    """

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
        """A body's angle, g, g'; SceneError for a body that does not exist."""
        k = self._index(body)
        return Track(self.value[k, 2], self.rate[k, 2], self.slope[k, 2])

    def point(self, body: str, at: Point | tuple[float, float]) -> Track:
        """A point of a body (in the body's frame, m), as arrays of shape (2, n).

        p = o + R(theta) a;  p' = o' + theta' R a_perp;  p'' = o'' + theta'' R a_perp - theta'² R a.
        """
        if isinstance(at, str) or np.size(at) < 2:
            raise SceneError([Fault("at", brief(at), "a Point, or a place (x, y) in m")])
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
        return entry("body", body, {name: k for k, name in enumerate(self.linkage.names)})
