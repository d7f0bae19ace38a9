"""From bodies and joints to closed loops: a tree of joints that places every body, and the loops that the others close.

The unknowns are the angles of the bodies and the displacements of the slides; a body's place is a sum of arms, each turned
by the angle of the body that it belongs to, along the tree from the frame. So every position is a combination of few
basis functions exp(i theta) and s exp(i theta), whose derivatives are exact. A joint outside the tree closes a loop: two
equations. Slides and rigid joints make angles equal, which is settled here and costs no equation. Lengths are in units of
the linkage's largest one, so that everything is of order 1.

The loop equations in numbers: residual, Jacobian, second derivatives along a motion, and bounds on how they vary.

Everything is evaluated for n positions at once: z has shape (n, variables), residuals (n, equations).

Newton-Raphson on the loop equations, all positions at once.

Degrees of freedom: Gruebler's count, checked against the rank of the Jacobian where the linkage stands.

Source: K. J. Waldron, G. L. Kinzel, S. K. Agrawal, Kinematics, Dynamics and Design of Machinery, Wiley 2016, chapter 1.
"""

from __future__ import annotations

from cmath import phase
from collections import deque
from collections.abc import Iterator, Mapping
from functools import cached_property
from itertools import combinations
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages import poses as lifts
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import CAM, FIXED, FRAME, FREEDOMS, PIN, SLIDE, SLOT, Coupling, Joint, Lift, Linkage

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
            raise SceneError(
                [
                    Fault(
                        f"{self.linkage.path}.bodies.{body}",
                        "a body that no joints connect with the frame",
                        "joints that do",
                    )
                    for body in loose
                ]
            )
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


# -- equations ---------------------------------------------------------------------------------------------------------


Complex = NDArray[np.complex128]

Lifted = tuple[Array, Array, Array] | None

_SMALL = 400  # numbers: a smaller matrix is multiplied faster without BLAS


class Bases(NamedTuple):
    """The basis functions at n positions: `whole` with the displacement in front, `bare` without, shape (n, bases).

    `lifts` holds for every coupling what its law gives there: lift, slope, second derivative, (n,) each; None for a ratio.
    """

    whole: Complex
    bare: Complex
    lifts: tuple[tuple[Array, Array, Array] | None, ...] = ()


class Equations:
    """The equations of `Loops`: two for every closure (real and imaginary part), then one for every coupling."""

    def __init__(self, loops: Loops) -> None:
        self.loops = loops
        self.sliding = loops.slides >= 0
        self.slide = np.where(self.sliding, loops.slides, 0)
        self._plan()

    def _plan(self) -> None:
        """Matrices that give the Jacobian of the closures straight from the basis functions."""
        loops = self.loops
        closures, bases = loops.closures.shape
        variables = len(loops.names)
        held = np.zeros((bases, variables))
        held[self.sliding, loops.slides[self.sliding]] = 1.0
        shape = bases, closures * variables
        self._turned = (1j * loops.closures[:, :, None] * loops.turns[None]).transpose(1, 0, 2).reshape(shape)
        self._moved = (loops.closures[:, :, None] * held[None]).transpose(1, 0, 2).reshape(shape)
        self._any_moved = bool(np.any(self._moved))
        self._shape = (closures, variables)

    def bases(self, z: Array) -> Bases:
        """Basis functions at positions z."""
        bare = np.exp(1j * (z @ self.loops.turns.T))
        lifts = tuple(_law(r, _at(r.first, z)) if r.lift else None for r in self.loops.relations)
        whole = bare * np.where(self.sliding, z[:, self.slide], 1.0) if self.sliding.any() else bare
        return Bases(whole, bare, lifts)

    def residual(self, z: Array, bases: Bases) -> Array:
        """Left sides of all equations."""
        gaps = bases.whole @ self.loops.closures.T
        columns = [gaps.real, gaps.imag] if gaps.shape[1] else []
        columns += [_relation(*pair, z)[:, None] for pair in self._couplings(bases)]
        return self._ordered(np.concatenate(columns, axis=1)) if columns else np.zeros((len(z), 0))

    def _couplings(self, bases: Bases) -> Iterator[tuple[Relation, Lifted]]:
        return zip(self.loops.relations, bases.lifts, strict=True)

    def _ordered(self, table: Array) -> Array:
        """Real and imaginary parts of each closure side by side."""
        return table[:, self._order]

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        closures = self._shape[0]
        pairs = np.stack((np.arange(closures), closures + np.arange(closures)), axis=1).ravel()
        return np.concatenate((pairs, np.arange(2 * closures, self.loops.equations)))

    def jacobian(self, z: Array, bases: Bases) -> Array:
        """Derivatives of all equations by all variables, shape (n, equations, variables)."""
        flat = _product(bases.whole, self._turned)
        if self._any_moved:
            flat = flat + _product(bases.bare, self._moved)
        closures, variables = self._shape
        found = flat.reshape(len(z), closures, variables)
        parts = np.stack((found.real, found.imag), axis=2).reshape(len(z), 2 * closures, variables)
        if not self.loops.relations:
            return parts
        lines = [_relation_rates(*pair, z)[:, None, :] for pair in self._couplings(bases)]
        return np.concatenate([parts, *lines], axis=1)

    def bending(self, z: Array, bases: Bases, rate: Array) -> Array:
        """Second derivative of all equations along a motion with constant rates, d² F/dt² with z'' = 0."""
        second = _second(bases, rate @ self.loops.turns.T, self._pace(rate))
        gaps = second @ self.loops.closures.T
        columns = [gaps.real, gaps.imag] if gaps.shape[1] else []
        columns += [_relation_bending(*pair, rate)[:, None] for pair in self._couplings(bases)]
        return self._ordered(np.concatenate(columns, axis=1)) if columns else np.zeros((len(z), 0))

    def _pace(self, rate: Array) -> Array | float:
        return np.where(self.sliding, rate[:, self.slide], 0.0) if self.sliding.any() else 0.0

    def origins(self, bases: Bases, rate: Array, slope: Array) -> tuple[Complex, Complex, Complex]:
        """Bodies' origins (units) as complex numbers with first and second derivative, each of shape (n, bodies)."""
        turning, pace = rate @ self.loops.turns.T, self._pace(rate)
        first = 1j * turning * bases.whole + pace * bases.bare
        second = _second(bases, turning, pace) + 1j * (slope @ self.loops.turns.T) * bases.whole
        second = second + self._pace(slope) * bases.bare
        places = self.loops.origins.T
        return _product(bases.whole, places), _product(first, places), _product(second, places)

    # -- bounds ------------------------------------------------------------------------------------------------------

    @cached_property
    def _moduli(self) -> Array:
        """Absolute coefficients of every equation's basis functions: a closure's two parts share one."""
        return np.repeat(np.abs(self.loops.closures), 2, axis=0)

    def turned(self, step: Array) -> Array:
        """How far (rad) the cams turn in a step of z (absolute values), the farthest of them, shape (n,)."""
        turns = [step @ np.abs(r.first.weights) for r in self.loops.relations if r.lift is not None]
        return np.max(turns, axis=0) if turns else np.zeros(len(step))

    def bound(self, z: Array, reach: Array, *steps: Array) -> Array:
        """Bound of the second (third) derivative of every equation near z, contracted with two (three) steps of z.

        reach: largest |displacement| of each basis function there, (n, bases); steps: absolute values, (n, variables).
        It holds as far from z as cams do not turn farther than `lifts.WINDOW`.
        """
        turned = [step @ np.abs(self.loops.turns).T for step in steps]
        held = [np.where(self.sliding, step[:, self.slide], 0.0) for step in steps]
        total = reach * np.prod(turned, axis=0)
        for k in range(len(steps)):
            total = total + held[k] * np.prod([t for j, t in enumerate(turned) if j != k], axis=0)
        found = total @ self._moduli.T
        if not self.loops.relations:
            return np.asarray(found)
        extra = []
        for relation in self.loops.relations:
            along = [step @ np.abs(relation.first.weights) for step in steps]
            extra.append(_law_bound(relation, z, len(steps)) * np.prod(along, axis=0))
        return np.concatenate((found, np.stack(extra, axis=1)), axis=1)


def _product(table: Complex, matrix: Complex) -> Complex:
    """The product of a long table and a small matrix: BLAS would spend its time on starting threads."""
    if matrix.size > _SMALL:
        return np.asarray(table @ matrix)
    return np.asarray(np.einsum("nk,km->nm", table, matrix))


def _second(bases: Bases, turning: Array, pace: Array | float) -> Complex:
    """Second derivative of the basis functions at constant rates."""
    return -(turning**2) * bases.whole + 2j * turning * pace * bases.bare


def _at(form: Form, z: Array) -> Array:
    return np.asarray(z @ form.weights + form.constant)


def _law(relation: Relation, angle: Array) -> tuple[Array, Array, Array]:
    """A cam's lift with two derivatives, in scaled units."""
    assert relation.lift is not None
    value, first, second = lifts.at(relation.lift, angle)
    return relation.scale * value, relation.scale * first, relation.scale * second


def _law_bound(relation: Relation, z: Array, order: int) -> Array | float:
    if relation.lift is None:
        return 0.0
    return abs(relation.scale) * lifts.bounds(relation.lift).near(_at(relation.first, z), order)


def _relation(relation: Relation, lifted: Lifted, z: Array) -> Array:
    target = relation.ratio * _at(relation.first, z) if lifted is None else lifted[0]
    return np.asarray(_at(relation.second, z) - target - relation.phase)


def _relation_rates(relation: Relation, lifted: Lifted, z: Array) -> Array:
    if lifted is None:
        line = relation.second.weights - relation.ratio * relation.first.weights
        return np.broadcast_to(line, (len(z), line.size))
    return np.asarray(relation.second.weights - lifted[1][:, None] * relation.first.weights)


def _relation_bending(relation: Relation, lifted: Lifted, rate: Array) -> Array:
    if lifted is None:
        return np.zeros(len(rate))
    return np.asarray(-lifted[2] * (rate @ relation.first.weights) ** 2)


# -- newton ------------------------------------------------------------------------------------------------------------


_MOST = 12
SETTLED = 1e-9  # a step below this leaves an error of its square: nothing


class Settled(NamedTuple):
    """What Newton's iteration came to: positions, their last step, and the largest step of each iteration."""

    z: Array
    last: Array
    steps: tuple[float, ...]


def settle(equations: Equations, z: Array) -> Settled:
    """Positions z (n, variables) corrected at the driver's given coordinate until a step is lost in its own square.

    A step below 1e-9 (rad, or units of length) is the last one: convergence is quadratic. Positions that do not converge
    have a `last` step that is larger; it is NaN where the Jacobian is singular.
    """
    z = z.copy()
    steps: list[float] = []
    last = np.full(len(z), np.inf)
    for _ in range(_MOST):
        move = correction(equations, z)
        z[:, 1:] += move
        last = np.abs(move).max(axis=1, initial=0.0)
        steps.append(float(np.nanmax(last, initial=0.0)))
        if not (last > SETTLED).any():
            break
    return Settled(z, last, tuple(steps))


def correction(equations: Equations, z: Array) -> Array:
    """One Newton step of the unknowns, shape (n, unknowns)."""
    bases = equations.bases(z)
    gap, jacobian = equations.residual(z, bases), equations.jacobian(z, bases)[:, :, 1:]
    if jacobian.shape[1] == jacobian.shape[2]:
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
    """Solutions of n systems, (n, m, m) and (n, m) or (n, m, k); NaN for those that are singular."""
    vector = right.ndim == 2
    columns = right[..., None] if vector else right
    try:
        found = np.linalg.solve(matrix, columns)
    except np.linalg.LinAlgError:
        regular = np.linalg.slogdet(matrix)[0] != 0.0
        found = np.full(columns.shape, np.nan)
        found[regular] = np.linalg.solve(matrix[regular], columns[regular])
    return np.asarray(found[..., 0] if vector else found)


# -- mobility ----------------------------------------------------------------------------------------------------------


_RANK = 1e-9  # of the greatest singular value
_FLAT = 1e-7  # of the longest bar: how nearly bars must be in line, or alike
PARALLELOGRAM, KITE = "a parallelogram", "a kite"
CHANGE_POINT = "a four-bar whose shortest and longest bars are together as long as the others"


class FourBar(NamedTuple):
    """Four bars in a ring: what they are called, and their bodies in order."""

    kind: str
    bodies: tuple[str, ...]


class Mobility(NamedTuple):
    """Freedom of a linkage at a position.

    gruebler: 3 (bodies) - sum of what joints and couplings take away; freedom: variables less the rank of their Jacobian;
    redundant: what holds the linkage more often than needed, as texts.
    """

    gruebler: int
    freedom: int
    redundant: tuple[str, ...]


def gruebler(linkage: Linkage) -> int:
    """Gruebler's degrees of freedom of a plane linkage: 3 n - sum(3 - f) - couplings, n moving bodies, f freedoms a joint.

    A pin or slide takes 2, a pin in a slot 1, a rigid joint 3, a gear pair, rolling pair or cam 1.

    >>> from flywheel.scene.linkage import Joint, Link, Linkage, Point
    >>> o = Point("o")
    >>> links = tuple(Link(name) for name in ("crank", "rod", "slider"))
    >>> pairs = (("frame", "crank"), ("crank", "rod"), ("rod", "slider"))
    >>> joints = tuple(Joint(f"{a}-{b}", "pin", a, b, o, o) for a, b in pairs)
    >>> slide = Joint("guide", "slide", "frame", "slider", o, o)
    >>> gruebler(Linkage(Link("frame"), links, (*joints, slide), "frame-crank"))
    1
    """
    taken = sum(3 - FREEDOMS[joint.kind] for joint in linkage.joints)
    return 3 * len(linkage.links) - taken - len(linkage.couplings)


def change_point_four_bar(linkage: Linkage, pins: Mapping[str, complex]) -> FourBar | None:
    """Four bars pinned in a ring that lie in line, where Grashof's lengths s + l = p + q let them; None if there are none.

    Args:
        linkage: whose pins are looked at.
        pins: where each pin stands, by its name, m.

    """
    at = {joint.name: pins[joint.name] for joint in linkage.joints if joint.kind == PIN}
    ends: dict[str, list[tuple[str, str]]] = {}
    for joint in linkage.joints:
        if joint.name in at:
            ends.setdefault(joint.first, []).append((joint.second, joint.name))
            ends.setdefault(joint.second, []).append((joint.first, joint.name))
    for start in ends:
        for bodies, names in _rings(ends, start):
            corners = np.array([at[name] for name in names])
            bars = np.roll(corners, 1) - corners  # of the bodies in their order
            sides, line = np.abs(bars), bars[np.argmax(np.abs(bars))]
            longest, ordered = float(sides.max()), np.sort(sides)
            flat = np.abs((bars * np.conj(line)).imag).max() <= _FLAT * longest**2
            if flat and ordered[0] > _FLAT * longest and abs(ordered @ [1.0, -1.0, -1.0, 1.0]) <= _FLAT * longest:
                return FourBar(_kind(sides), bodies)
    return None


def _rings(ends: Mapping[str, list[tuple[str, str]]], first: str) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Rings of four bodies that begin with one, and their pins: pin k joins body k to the next."""
    for second, a in ends[first]:
        for third, b in ends[second]:
            for fourth, c in ends[third]:
                closing = [d for body, d in ends[fourth] if body == first]
                if len({first, second, third, fourth}) == 4 and closing:
                    yield (first, second, third, fourth), (a, b, c, closing[0])


def _kind(sides: Array) -> str:
    """What a four-bar whose bars are that long, in order, is called."""
    gaps = np.abs(sides[:, None] - sides) <= _FLAT * sides.max()
    if gaps[0, 2] and gaps[1, 3]:
        return PARALLELOGRAM
    if (gaps[0, 1] and gaps[2, 3]) or (gaps[0, 3] and gaps[1, 2]):
        return KITE
    return CHANGE_POINT


def mobility(loops: Loops, jacobian: Array) -> Mobility:
    """Mobility where the equations have this Jacobian, (equations, variables)."""
    equations, variables = jacobian.shape
    rank, rows = _independent(jacobian)
    redundant = [f"the turning of {joint}, which other joints hold already" for joint in loops.doubled]
    if rank < equations:
        redundant += _repeated(loops, jacobian, rows)
    return Mobility(gruebler(loops.linkage), variables - rank, tuple(redundant))


def _independent(jacobian: Array) -> tuple[int, tuple[int, ...]]:
    """Rank, and rows that span it: those with the greatest rest, one after another."""
    rest, rows = jacobian.copy(), []
    scale = float(np.sqrt((rest**2).sum(axis=1)).max(initial=0.0))
    for _ in range(min(jacobian.shape)):
        size = np.sqrt((rest**2).sum(axis=1))
        row = int(np.argmax(size))
        if size[row] <= _RANK * scale:
            break
        rows.append(row)
        along = rest[row] / size[row]
        rest = rest - np.outer(rest @ along, along)
    return len(rows), tuple(sorted(rows))


def _repeated(loops: Loops, jacobian: Array, rows: tuple[int, ...]) -> list[str]:
    """For every equation that follows from the others, the loops that say the same."""
    found: list[str] = []
    basis = jacobian[list(rows)]
    for row in sorted(set(range(len(jacobian))) - set(rows)):
        shares = np.linalg.lstsq(basis.T, jacobian[row], rcond=None)[0]
        others = [rows[k] for k in np.flatnonzero(np.abs(shares) > 1e-6)]
        names = dict.fromkeys([_of(loops, row), *(_of(loops, k) for k in others)])
        found.append(
            " repeats ".join([next(iter(names)), " and ".join(list(names)[1:]) or "what keeps its bodies parallel"])
        )
    return list(dict.fromkeys(found))


def _of(loops: Loops, row: int) -> str:
    """What an equation stands for: the loop or the coupling."""
    closures = 2 * len(loops.closures)
    if row >= closures:
        return f"coupling {loops.linkage.couplings[row - closures].name}"
    return f"loop {' - '.join(loops.paths[row // 2])}"


def faults(loops: Loops, jacobian: Array) -> list[Fault]:
    """A fault where the driver's coordinate does not settle the position, or cannot change at all."""
    found = mobility(loops, jacobian)
    path = f"{loops.linkage.path}.joints"
    held = len(_independent(jacobian[:, 1:])[1])
    if held < loops.unknowns:
        return [_loose_bodies(loops, jacobian, found, path)]
    if found.freedom == 0:
        what = f"0 degrees of freedom (Gruebler {found.gruebler}): the driver {loops.linkage.driver} cannot move"
        advice = "take a joint away" + (f": {'; '.join(found.redundant)}" if found.redundant else "")
        return [Fault(path, what, "1 degree of freedom", advice)]
    return []


def _loose_bodies(loops: Loops, jacobian: Array, found: Mobility, path: str) -> Fault:
    """What can still move while the driver stands."""
    held = len(_independent(jacobian[:, 1:])[1])
    free = np.abs(np.linalg.svd(jacobian[:, 1:])[2][held:]).max(axis=0)
    moving = [loops.names[k + 1] for k in np.argsort(-free) if free[k] > 0.1 * free.max()]
    what = f"{found.freedom} degrees of freedom (Gruebler {found.gruebler}): with the driver held, {_few(moving)} may move"
    return Fault(path, what, "1 degree of freedom", "add a joint or a coupling, or take a body away")


def _few(names: list[str]) -> str:
    return ", ".join(names[:4]) + (" and more" if len(names) > 4 else "")
