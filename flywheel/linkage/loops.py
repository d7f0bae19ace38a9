"""From bodies and joints to closed loops: a tree of joints that places every body, and the loops that the others close.

The unknowns are the angles of the bodies and the displacements of the slides; a body's place is a sum of arms, each turned
by the angle of the body that it belongs to, along the tree from the frame. So every position is a combination of few
basis functions exp(i theta) and s exp(i theta), whose derivatives are exact. A joint outside the tree closes a loop: two
equations. Slides and rigid joints make angles equal, which is settled here and costs no equation. Lengths are in units of
the linkage's largest one, so that everything is of order 1.
"""

from __future__ import annotations

from cmath import phase
from collections import deque
from collections.abc import Iterator
from itertools import combinations
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault, SceneError
from flywheel.linkage import lifts
from flywheel.linkage.description import CAM, FIXED, FRAME, PIN, SLIDE, SLOT, Coupling, Joint, Lift, Linkage

Array = NDArray[np.float64]

_PARALLEL = 1e-9  # rad: angles that differ by less are one
_ALIKE = 1e-12  # of a length: cranks that differ by less are alike
_LOOKS = 64  # angles of a period at which a lift is looked at, for its size


class Form(NamedTuple):
    """A linear form of the variables z: weights · z + constant."""

    weights: Array
    constant: float


class Relation(NamedTuple):
    """A coupling as second - ratio first - phase = 0, or second - lift(first) = 0 in scaled variables."""

    first: Form
    second: Form
    ratio: float
    phase: float
    lift: Lift | None
    scale: float  # of the lift: 1/unit for a sliding follower


class Loops(NamedTuple):
    """A linkage as equations in z = (driver, unknowns): angles in rad, displacements in units of `unit` m.

    Basis function k is exp(i turns[k] · z), times z[slides[k]] where slides[k] >= 0. `closures` (equations/2, bases) are
    the loops' complex coefficients, `origins` (bodies, bases) those of the bodies' origins; `angles` holds every body's
    angle as a form. `paths` names for every closure the joints of its loop.
    `names` says what each variable is; `doubled` the joints whose angle is held by others already.
    """

    linkage: Linkage
    unit: float
    names: tuple[str, ...]
    turns: Array
    slides: NDArray[np.intp]
    closures: NDArray[np.complex128]
    origins: NDArray[np.complex128]
    angles: tuple[Form, ...]
    relations: tuple[Relation, ...]
    paths: tuple[tuple[str, ...], ...]
    doubled: tuple[str, ...]

    @property
    def unknowns(self) -> int:
        """How many unknowns there are at a given position of the driver."""
        return len(self.names) - 1

    @property
    def equations(self) -> int:
        """How many real equations tie them."""
        return 2 * len(self.closures) + len(self.relations)


def loops(linkage: Linkage) -> Loops:
    """The loops of a linkage.

    Raises:
        SceneError: where a body hangs on nothing, or slides and rigid joints hold it at two angles at once.

    """
    return _Walk(linkage).loops()


class _Walk:
    """The walk over bodies and joints that finds angles, tree and loops."""

    def __init__(self, linkage: Linkage) -> None:
        self.linkage = linkage
        self.unit = _unit(linkage)
        self.offset, self.leader, self.doubled = _rigid_angles(linkage)
        self.names = self._variables()
        self.angles = {body: self._angle(body) for body in linkage.names}
        self.bases: dict[tuple[str, int], int] = {}

    def _variables(self) -> tuple[str, ...]:
        linkage, driver = self.linkage, self.linkage.joint(self.linkage.driver)
        turning = {self.leader[body] for body in linkage.names} - {self.leader[FRAME]}
        self.driven: tuple[str, str] | None = None
        if driver.kind == PIN:
            first, second = self.leader[driver.first], self.leader[driver.second]
            if first == second:
                raise _locked_driver(linkage)
            self.driven = (first, second) if second in turning else (second, first)
            turning -= {self.driven[1]}
        leaders = [body for body in linkage.names if body in turning]
        sliding = [joint.name for joint in linkage.joints if joint.kind in (SLIDE, SLOT) and joint is not driver]
        return (
            f"coordinate of {driver.name}",
            *(f"angle of {body}" for body in leaders),
            *(f"slide of {s}" for s in sliding),
        )

    def _angle(self, body: str) -> Form:
        """A body's angle: its leader's, and what it is turned against that for good."""
        weights = np.zeros(len(self.names))
        leader, constant = self.leader[body], self.offset[body]
        if self.driven is not None and leader == self.driven[1]:
            constant += self._drive(weights)
            leader = self.driven[0]
        if leader != self.leader[FRAME]:
            weights[self.names.index(f"angle of {leader}")] += 1.0
        else:
            constant -= self.offset[FRAME]
        return Form(weights, constant)

    def _drive(self, weights: Array) -> float:
        """What the driver adds to the angle of the leader that it turns: z[0], and the offsets of its bodies."""
        assert self.driven is not None
        driver = self.linkage.joint(self.linkage.driver)
        sign = 1.0 if self.leader[driver.second] == self.driven[1] else -1.0
        weights[0] += sign
        return sign * (self.offset[driver.first] - self.offset[driver.second])

    def _variable(self, joint: Joint) -> int:
        return 0 if joint.name == self.linkage.driver else self.names.index(f"slide of {joint.name}")

    def _basis(self, body: str, slide: int = -1) -> int:
        """Number of the basis function exp(i angle of the body), or that times a displacement."""
        return self.bases.setdefault((self.leader[body], slide), len(self.bases))

    def _arm(self, body: str, x: float, y: float, slide: int = -1) -> dict[int, complex]:
        """An arm in a body's frame, turned with it: the constant part of its angle goes into the coefficient."""
        arm = complex(x, y) * np.exp(1j * (self.offset[body]))
        return {self._basis(body, slide): arm} if arm else {}

    def _step(self, joint: Joint) -> dict[int, complex]:
        """From the origin of the joint's first body to that of its second."""
        unit, out = self.unit, joint.first_at
        chain = self._arm(joint.first, out.x / unit, out.y / unit)
        if joint.kind in (SLIDE, SLOT):
            along = np.exp(1j * joint.direction)
            chain = _sum(chain, self._arm(joint.first, along.real, along.imag, self._variable(joint)))
        back = joint.second_at
        return _sum(chain, self._arm(joint.second, -back.x / unit, -back.y / unit))

    def loops(self) -> Loops:
        """Every body placed along the tree, every other joint a closure."""
        tree, places = self._tree()
        closing = [joint for joint in self.linkage.joints if joint.name not in {j.name for j in tree.values() if j}]
        closures = [_sum(places[joint.first], self._step(joint), _negative(places[joint.second])) for joint in closing]
        origins = [places[body] for body in self.linkage.names]
        turns, slides = self._functions()
        return Loops(
            linkage=self.linkage,
            unit=self.unit,
            names=self.names,
            turns=turns,
            slides=slides,
            closures=self._matrix(closures),
            origins=self._matrix(origins),
            angles=tuple(self.angles[body] for body in self.linkage.names),
            relations=tuple(self._relation(coupling) for coupling in self.linkage.couplings),
            paths=tuple(_loop(tree, joint) for joint in closing),
            doubled=self.doubled,
        )

    def _tree(self) -> tuple[dict[str, Joint | None], dict[str, dict[int, complex]]]:
        """The joint by which each body is reached first from the frame, and each body's place."""
        tree: dict[str, Joint | None] = {FRAME: None}
        places: dict[str, dict[int, complex]] = {FRAME: {}}
        todo = deque([FRAME])
        while todo:
            body = todo.popleft()
            for joint in self.linkage.joints:
                if body not in (joint.first, joint.second):
                    continue
                other = joint.second if joint.first == body else joint.first
                if other in tree:
                    continue
                step = self._step(joint)
                tree[other] = joint
                places[other] = _sum(places[body], step if joint.first == body else _negative(step))
                todo.append(other)
        loose = [body for body in self.linkage.names if body not in tree]
        if loose:
            raise SceneError([_loose(self.linkage, body) for body in loose])
        return tree, places

    def _functions(self) -> tuple[Array, NDArray[np.intp]]:
        """Turning rate and sliding variable of every basis function; leaders stand at their bare angle."""
        turns = np.array([self.angles[leader].weights for leader, _ in self.bases]).reshape(-1, len(self.names))
        return turns, np.array([slide for _, slide in self.bases], dtype=np.intp)

    def _matrix(self, chains: list[dict[int, complex]]) -> NDArray[np.complex128]:
        """Coefficients of chains over the basis functions, with the constant of each leader's angle put in."""
        matrix = np.zeros((len(chains), len(self.bases)), dtype=complex)
        constants = [self.angles[leader].constant - self.offset[leader] for leader, _ in self.bases]
        for row, chain in zip(matrix, chains, strict=True):
            for basis, coefficient in chain.items():
                row[basis] = coefficient * np.exp(1j * constants[basis])
        return matrix

    def _relation(self, coupling: Coupling) -> Relation:
        first, second = (self.linkage.joint(name) for name in (coupling.first, coupling.second))
        units = [1.0 if joint.kind == PIN else self.unit for joint in (first, second)]
        forms = [_coordinate(joint, self.names, self.angles) for joint in (first, second)]
        lift = coupling.lift if coupling.kind == CAM else None
        ratio = 0.0 if lift else coupling.ratio * units[0] / units[1]
        return Relation(forms[0], forms[1], ratio, coupling.phase / units[1], lift, 1.0 / units[1])


def _coordinate(joint: Joint, names: tuple[str, ...], angles: dict[str, Form]) -> Form:
    if joint.kind == PIN:
        first, second = angles[joint.first], angles[joint.second]
        return Form(second.weights - first.weights, second.constant - first.constant)
    weights = np.zeros(len(names))
    name = f"slide of {joint.name}"
    weights[names.index(name) if name in names else 0] = 1.0
    return Form(weights, 0.0)


def _unit(linkage: Linkage) -> float:
    """The largest length that the joints stand on, or that couplings move a slide by, m."""
    ends = [point for joint in linkage.joints for point in (joint.first_at, joint.second_at)]
    found = max((max(abs(point.x), abs(point.y)) for point in ends), default=0.0)
    guesses = [abs(joint.guess) for joint in linkage.joints if joint.guess and joint.kind in (SLIDE, SLOT)]
    driven = [_travel(pair) for pair in linkage.couplings if linkage.joint(pair.second).kind == SLIDE]
    return max([found, *guesses, *driven, abs(linkage.start) if linkage.sliding else 0.0]) or 1.0


def _travel(coupling: Coupling) -> float:
    """About how far a coupling moves its slide, m: a cam's greatest lift, or what a radian rolls off."""
    if coupling.lift is None:
        return max(abs(coupling.ratio), abs(coupling.phase))
    lift = lifts.at(coupling.lift, np.linspace(0.0, coupling.lift.period, _LOOKS))[0]
    return float(np.abs(lift).max()) if np.isfinite(lift).all() else 0.0


def _rigid_angles(linkage: Linkage) -> tuple[dict[str, float], dict[str, str], tuple[str, ...]]:
    """Which bodies keep their angle to each other: a leader for each body, its constant angle against that, spare holds."""
    offset = dict.fromkeys(linkage.names, 0.0)
    leader = {body: body for body in linkage.names}
    doubled = []
    held = [(joint, joint.first, joint.second, joint.angle) for joint in linkage.joints if joint.kind in (SLIDE, FIXED)]
    for joint, one, other, angle in [*held, *((None, *pair) for pair in _translating(linkage))]:
        first, second = leader[one], leader[other]
        turn = offset[one] + angle - offset[other]
        if first == second:
            if joint is not None:
                _check_angle(linkage, joint, turn)
                doubled.append(joint.name)
            continue
        for body in linkage.names:
            if leader[body] == second:
                leader[body] = first
                offset[body] += turn
    return offset, leader, tuple(doubled)


def _translating(linkage: Linkage) -> Iterator[tuple[str, str, float]]:
    """Pairs of bodies that three cranks of one length keep from turning against each other, and by how much they are turned.

    The cranks' pins must form the same figure on both bodies. If the second could turn by R against that, all of its pins
    p + (R - 1) c, c those of the first, would lie on a circle about 0 of the cranks' length: there is none through three
    places in line, and one of a fixed R otherwise, with which nothing moves. Where the cranks are in line with their pivots,
    only this tells them apart from two cranks, which branch there.
    """
    pins = [joint for joint in linkage.joints if joint.kind == PIN]
    ends: dict[str, list[tuple[str, complex, complex]]] = {body: [] for body in linkage.names}
    for joint in pins:
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
            if min(abs(a - b), abs(a - c), abs(b - c), r) > size and max(abs(r - s), abs(r - t)) < size:
                turn = (a - b) / (p - q) if p != q else 0j
                if (
                    max(abs(turn * (p - q) - (a - b)), abs(turn * (p - o) - (a - c)), abs(abs(turn) - 1.0) * abs(a - b))
                    < size
                ):
                    yield one, other, phase(turn)
                    break


def _check_angle(linkage: Linkage, joint: Joint, gap: float) -> None:
    gap = (gap + pi) % (2 * pi) - pi
    if abs(gap) > _PARALLEL:
        found = f"{joint.name}, which turns {joint.second} by {np.degrees(gap):.6g} deg against what other joints hold it at"
        raise SceneError([Fault(f"{linkage.path}.joints", found, "slides and rigid joints that agree", "change an angle")])


def _locked_driver(linkage: Linkage) -> SceneError:
    driver = linkage.joint(linkage.driver)
    found = f"{driver.name} between {driver.first} and {driver.second}, which cannot turn against each other"
    return SceneError([Fault(f"{linkage.path}.driver", found, "a joint that can move")])


def _loose(linkage: Linkage, body: str) -> Fault:
    return Fault(f"{linkage.path}.bodies.{body}", "a body that no joints connect with the frame", "joints that do")


def _loop(tree: dict[str, Joint | None], joint: Joint) -> tuple[str, ...]:
    """Names of the joints around the loop that a joint closes."""
    up, down = _ancestry(tree, joint.first), _ancestry(tree, joint.second)
    while up and down and up[-1] == down[-1]:
        up.pop()
        down.pop()
    return (*reversed(up), joint.name, *down)


def _ancestry(tree: dict[str, Joint | None], body: str) -> list[str]:
    """Joints from a body down to the frame."""
    found = []
    while (joint := tree[body]) is not None:
        found.append(joint.name)
        body = joint.first if joint.second == body else joint.second
    return found


def _sum(*chains: dict[int, complex]) -> dict[int, complex]:
    total: dict[int, complex] = {}
    for chain in chains:
        for basis, coefficient in chain.items():
            total[basis] = total.get(basis, 0.0) + coefficient
    return total


def _negative(chain: dict[int, complex]) -> dict[int, complex]:
    return {basis: -coefficient for basis, coefficient in chain.items()}
