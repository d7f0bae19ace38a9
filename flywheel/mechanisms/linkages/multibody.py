"""How one body stands to another at a joint: scalar relations of two bodies' poses, with their derivatives.

A body's pose is that of its centre of mass and its angle: x, y (m), theta (rad). Every relation phi gives its value, its
gradient by both poses, and its bend (phi_x v)_x v, the part of its second time derivative that needs no accelerations:
d²phi/dt² = phi_x a + bend. Only arithmetic is done here, so that any kind of number may stand in the poses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import DOP853

from bondgraph.motion.stepping import instant
from flywheel.mechanisms.linkages.poses import Poses, check
from flywheel.numerics.arguments import POSITIVE, array, name_faults, number_faults, refuse, require, shown, vector
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import FIXED, PIN, SLIDE, SLOT, Coupling, Joint, Linkage

Vector = tuple[Any, Any]
Gradient = tuple[Any, Any, Any]


class Place(NamedTuple):
    """A body's pose with the cosine and sine of its angle, and its velocities (m/s, rad/s)."""

    x: Any
    y: Any
    theta: Any
    cos: Any
    sin: Any
    vx: Any = 0.0
    vy: Any = 0.0
    omega: Any = 0.0


def placed(pose: Any, velocity: Any = (0.0, 0.0, 0.0), ns: Any = math) -> Place:
    """A body at a pose x, y, theta with velocities; cosine and sine come from the namespace `ns`."""
    x, y, theta = pose
    return Place(x, y, theta, ns.cos(theta), ns.sin(theta), *velocity)


class Row(NamedTuple):
    """A relation: its value, gradients by the poses of the first and the second body, and its bend."""

    value: Any
    first: Gradient
    second: Gradient
    bend: Any


class Pair(NamedTuple):
    """A joint as its two bodies (numbers in `linkage.names`), its points from their centres of mass, its direction."""

    name: str
    kind: str
    first: int
    second: int
    first_arm: Vector
    second_arm: Vector
    direction: Vector
    angle: float


def pair(linkage: Linkage, joint: Joint) -> Pair:
    """A joint prepared for the relations."""
    numbers = (linkage.names.index(joint.first), linkage.names.index(joint.second))
    ends = (joint.first, joint.first_at), (joint.second, joint.second_at)
    arms = [(at.x - linkage.link(body).com[0], at.y - linkage.link(body).com[1]) for body, at in ends]
    direction = math.cos(joint.direction), math.sin(joint.direction)
    return Pair(joint.name, joint.kind, *numbers, arms[0], arms[1], direction, joint.angle)


class Gap(NamedTuple):
    """From the joint's point on the first body to that on the second: arms and gap (m), the gap's rate and bend."""

    first_arm: Vector
    second_arm: Vector
    gap: Vector
    rate: Vector
    bend: Vector


def turned(place: Place, arm: Vector) -> Vector:
    """An arm of the body's frame as it stands in the fixed frame: R(theta) a."""
    return place.cos * arm[0] - place.sin * arm[1], place.sin * arm[0] + place.cos * arm[1]


def gap(joint: Pair, one: Place, two: Place) -> Gap:
    """D = x2 + r2 - x1 - r1; its rate v2 + omega2 × r2 - v1 - omega1 × r1; its bend omega1² r1 - omega2² r2."""
    ax, ay = turned(one, joint.first_arm)
    bx, by = turned(two, joint.second_arm)
    across = two.x + bx - one.x - ax, two.y + by - one.y - ay
    rate = two.vx - two.omega * by - one.vx + one.omega * ay, two.vy + two.omega * bx - one.vy - one.omega * ax
    w1, w2 = one.omega * one.omega, two.omega * two.omega
    return Gap((ax, ay), (bx, by), across, rate, (w1 * ax - w2 * bx, w1 * ay - w2 * by))


def fixed_component(seen: Gap, e: Vector) -> Row:
    """Component e · d of the gap along a direction of the fixed frame."""
    ex, ey = e
    (ax, ay), (bx, by) = seen.first_arm, seen.second_arm
    first = -ex, -ey, ex * ay - ey * ax
    second = ex, ey, ey * bx - ex * by
    return Row(_dot(e, seen.gap), first, second, _dot(e, seen.bend))


def turning_component(seen: Gap, e: Vector, omega: Any) -> Row:
    """Component e · d of the gap along a direction that turns with the first body at omega.

    Its rate has the further part omega e_perp · d; its bend 2 omega e_perp · d' - omega² e · d.
    """
    row = fixed_component(seen, e)
    perp = -e[1], e[0]
    first = row.first[0], row.first[1], row.first[2] + _dot(perp, seen.gap)
    return row._replace(first=first, bend=row.bend + 2 * omega * _dot(perp, seen.rate) - omega * omega * row.value)


def turn(joint: Pair, one: Place, two: Place) -> Row:
    """Angle of the second body less that of the first."""
    return Row(two.theta - one.theta, (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), 0.0)


def held_turn(joint: Pair, one: Place, two: Place) -> Row:
    """What the turn lacks to the joint's own angle, whole turns left out."""
    row = turn(joint, one, two)
    left = row.value - joint.angle
    return row._replace(value=left - 2 * math.pi * round(left / (2 * math.pi)))


def closures(joint: Pair, one: Place, two: Place) -> list[Row]:
    """The relations that a joint keeps at zero, in the order of its components in `COMPONENTS`."""
    seen = gap(joint, one, two)
    if joint.kind in (PIN, FIXED):
        rows = [fixed_component(seen, (1.0, 0.0)), fixed_component(seen, (0.0, 1.0))]
    else:
        ux, uy = turned(one, joint.direction)
        rows = [turning_component(seen, (-uy, ux), one.omega)]
    if joint.kind in (SLIDE, FIXED):
        rows.append(held_turn(joint, one, two))
    return rows


COMPONENTS = {PIN: ("x", "y"), SLIDE: ("normal", "moment"), SLOT: ("normal",), FIXED: ("x", "y", "moment")}
"""What the first body does to the second through each kind of joint, at the second's point.

x, y: forces along the frame's axes (N); normal: force across the guide, positive to the left of its direction (N);
moment: positive counter-clockwise (N m). The first body feels the opposite at the same place.
"""


def coordinate(joint: Pair, one: Place, two: Place) -> Row:
    """The joint's coordinate: the turn of a pin (rad), the way along the guide of a slide or pin in slot (m)."""
    if joint.kind == PIN:
        return turn(joint, one, two)
    return turning_component(gap(joint, one, two), turned(one, joint.direction), one.omega)


class Drive(NamedTuple):
    """How a coupling drives its second coordinate at a value of its first: q2 = value, with two derivatives by q1."""

    value: Any
    first: Any
    second: Any


def drive(coupling: Coupling, q: Any) -> Drive:
    """A coupling's second coordinate by its first: ratio q + phase, or a cam's lift(q) + phase."""
    if coupling.lift is None:
        return Drive(coupling.ratio * q + coupling.phase, coupling.ratio, 0.0)
    import numpy as np  # a lift law's own namespace; couplings without one need none

    angle = q - math.floor(q / coupling.lift.period) * coupling.lift.period
    jet = coupling.lift.curve.jet(angle, angle, np)
    return Drive(float(jet.value) + coupling.phase, float(jet.first), float(jet.second))


def _dot(a: Vector, b: Vector) -> Any:
    return a[0] * b[0] + a[1] * b[1]


# -- model -------------------------------------------------------------------------------------------------------------

# A linkage in absolute coordinates: x_G, y_G, theta of every moving body, what ties them and what acts on them.


Array = NDArray[np.float64]
Law = float | Callable[[float, float, float], float]
"""A constant, or a function of time (s), the driver's coordinate (rad or m) and its rate."""

_RANK = 1e-9  # of the largest: a singular value below it is nought


class Wrench(NamedTuple):
    """What acts on a body from outside: a force along the frame's x and y (N) at a point of it, a torque (N m).

    `at` names a point of the body, or is a place in its own frame (m); the centre of mass if None.
    """

    body: str
    force: tuple[Law, Law] = (0.0, 0.0)
    torque: Law = 0.0
    at: str | tuple[float, float] | None = None


class Actions(NamedTuple):
    """All that drives and loads a linkage: gravity (m/s²), the driver's torque (N m) or force (N), wrenches on bodies."""

    gravity: tuple[float, float] = (0.0, 0.0)
    drive: Law = 0.0
    wrenches: tuple[Wrench, ...] = ()


class State(NamedTuple):
    """A linkage at coordinates x and velocities v, shape (3 moving bodies,).

    value: what the closure equations Phi(x) lack (m or rad), shape (equations,); jacobian Phi_x; gamma = -(Phi_x v)_x v, so
    that Phi_x a = gamma. `q`, `qdot`, `along` and `bend` are the driver's coordinate, rate, gradient and bend.
    `places` holds every body, the frame first.
    """

    value: Array
    jacobian: Array
    gamma: Array
    q: float
    qdot: float
    along: Array
    bend: float
    places: tuple[Place, ...]


class Spread(NamedTuple):
    """A relation over all bodies' coordinates; plain lists, which are quicker than small arrays."""

    value: float
    gradient: list[float]
    bend: float


@dataclass(frozen=True, eq=False)
class Model:
    """A linkage prepared for the routes.

    masses: m, m, J of every moving body, shape (3 bodies,); length: its largest one (m), the scale of displacements;
    redundant: some closure equations follow from others, so that not all reactions are determined.
    """

    linkage: Linkage
    actions: Actions
    pairs: tuple[Pair, ...]
    masses: Array
    length: float
    redundant: bool = False

    @cached_property
    def scale(self) -> Array:
        """Size of each coordinate: the length of a displacement, 1 rad of an angle."""
        return np.tile((self.length, self.length, 1.0), self.masses.size // 3)

    @cached_property
    def weights(self) -> Array:
        """Weight of every moving body on its coordinates (N)."""
        return np.asarray(self.masses * np.tile((*self.actions.gravity, 0.0), self.masses.size // 3))

    def pair(self, joint: str) -> Pair:
        """The joint of that name."""
        return next(pair for pair in self.pairs if pair.name == joint)

    def state(self, x: Array, v: Array) -> State:
        """The closure equations and the driver's coordinate at x with velocities v."""
        places = self._places(x, v)
        rows = [(joint, row) for joint in self.pairs for row in closures(joint, *_both(joint, places))]
        spread = [_spread(self.masses.size, row, joint) for joint, row in rows]
        spread += [self._coupled(coupling, places, v) for coupling in self.linkage.couplings]
        driver = self._coordinate(self.linkage.driver, places)
        along = np.array(driver.gradient)
        return State(
            value=np.array([row.value for row in spread]),
            jacobian=np.array([row.gradient for row in spread]).reshape(-1, self.masses.size),
            gamma=np.array([-row.bend for row in spread]),
            q=driver.value,
            qdot=float(along @ v),
            along=along,
            bend=driver.bend,
            places=places,
        )

    def forces(self, t: float, state: State) -> Array:
        """Generalised forces of gravity, drive and wrenches on every coordinate, shape (3 moving bodies,)."""
        motion = t, state.q, state.qdot
        total = self.weights + _law(self.actions.drive, *motion) * state.along
        for wrench in self.actions.wrenches:
            k = self.linkage.names.index(wrench.body)
            fx, fy = (_law(part, *motion) for part in wrench.force)
            rx, ry = self._arm(wrench, state.places[k])
            total[3 * k - 3 : 3 * k] += fx, fy, rx * fy - ry * fx + _law(wrench.torque, *motion)
        return np.asarray(total)

    def _places(self, x: Array, v: Array) -> tuple[Place, ...]:
        rows = zip(x.reshape(-1, 3).tolist(), v.reshape(-1, 3).tolist(), strict=True)
        return (_frame(self.linkage), *(placed(pose, velocity) for pose, velocity in rows))

    def _coordinate(self, joint: str, places: Sequence[Place]) -> Spread:
        found = self.pair(joint)
        return _spread(self.masses.size, coordinate(found, *_both(found, places)), found)

    def _coupled(self, coupling: Coupling, places: Sequence[Place], v: Array) -> Spread:
        """q2 - f(q1): gradient q2_x - f' q1_x, bend that of q2 less f' times that of q1 and f'' (dq1/dt)²."""
        one, two = self._coordinate(coupling.first, places), self._coordinate(coupling.second, places)
        driven = drive(coupling, one.value)
        bend = two.bend - driven.first * one.bend - driven.second * float(np.dot(one.gradient, v)) ** 2
        gradient = [b - driven.first * a for a, b in zip(one.gradient, two.gradient, strict=True)]
        return Spread(two.value - driven.value, gradient, bend)

    def _arm(self, wrench: Wrench, place: Place) -> tuple[float, float]:
        if wrench.at is None:
            return 0.0, 0.0
        link = self.linkage.link(wrench.body)
        x, y = link.point(wrench.at)[-2:] if isinstance(wrench.at, str) else wrench.at
        return turned(place, (x - link.com[0], y - link.com[1]))


def model(linkage: Linkage, actions: Actions) -> Model:
    """A linkage with its actions, prepared.

    Raises:
        SceneError: for friction, which these routes leave out, and for wrenches on bodies that do not move.

    """
    rubbing = [joint.name for joint in linkage.joints if joint.friction > 0.0]
    rubbing += [coupling.name for coupling in linkage.couplings if coupling.friction > 0.0]
    faults = [_friction(linkage, name) for name in rubbing]
    for k, wrench in enumerate(actions.wrenches):
        faults += _misplaced(linkage, f"wrenches[{k}]", wrench)
    if faults:
        raise SceneError(faults)
    masses = np.array([value for link in linkage.links for value in (link.mass, link.mass, link.inertia)], dtype=float)
    pairs = tuple(pair(linkage, joint) for joint in linkage.joints)
    arms = [abs(part) for joint in pairs for part in (*joint.first_arm, *joint.second_arm)]
    return Model(linkage, actions, pairs, masses, max(arms) or 1.0)


def coordinates(poses: Poses) -> Array:
    """Absolute coordinates x_G, y_G, theta of every moving body at the first of the poses, shape (3 bodies,)."""
    names = [link.name for link in poses.linkage.links]
    rows = [(*poses.centre(name).value[:, 0], poses.angle(name).value[0]) for name in names]
    return np.array(rows, dtype=float).ravel()


def components(linkage: Linkage) -> list[tuple[str, str]]:
    """Joint and component of every reaction, in the order of the closure equations; couplings have one `effort` each.

    A coupling's effort is that on its second coordinate: a moment (N m) at a pin, a force (N) along a slide. It stands for
    the contact force by its work alone: the pins' reactions are those of the contact force only with it.
    """
    found = [(joint.name, part) for joint in linkage.joints for part in COMPONENTS[joint.kind]]
    return found + [(coupling.name, "effort") for coupling in linkage.couplings]


def undetermined(jacobian: Array) -> NDArray[np.bool_]:
    """Which reactions a redundant linkage leaves open: those with a part in the null space of Phi_x^T."""
    left, sizes, _ = np.linalg.svd(jacobian)
    rank = int((sizes > _RANK * sizes.max()).sum())
    return np.asarray(np.abs(left[:, rank:]).max(axis=1, initial=0.0) > _RANK)


def _frame(linkage: Linkage) -> Place:
    return placed((*linkage.ground.com, 0.0))


def _both(joint: Pair, places: Sequence[Place]) -> tuple[Place, Place]:
    return places[joint.first], places[joint.second]


def _spread(size: int, row: Row, joint: Pair) -> Spread:
    """A row over all coordinates, the frame's left out."""
    gradient = [0.0] * (size + 3)
    gradient[3 * joint.first : 3 * joint.first + 3] = row.first
    gradient[3 * joint.second : 3 * joint.second + 3] = row.second
    return Spread(row.value, gradient[3:], row.bend)


def _law(law: Law, t: float, q: float, qdot: float) -> float:
    return law(t, q, qdot) if callable(law) else law


def _friction(linkage: Linkage, name: str) -> Fault:
    return Fault(
        f"{linkage.path}.{name}.friction", "friction", "none: these routes are those of ideal joints", "set it to 0"
    )


def _misplaced(linkage: Linkage, path: str, wrench: Wrench) -> list[Fault]:
    """A wrench on a body that does not move, or at a point that it does not have."""
    moving = [link.name for link in linkage.links]
    if wrench.body not in moving:
        return [Fault(f"{path}.body", repr(wrench.body), f"a moving body: {', '.join(moving)}")]
    points = [point.name for point in linkage.link(wrench.body).points]
    if isinstance(wrench.at, str) and wrench.at not in points:
        return [Fault(f"{path}.at", repr(wrench.at), f"a point of {wrench.body}: {', '.join(points)}")]
    return []


# -- closure -----------------------------------------------------------------------------------------------------------

# Poses of a linkage at a given driver's coordinate, and their influence coefficients, from the closure equations alone.


_CLOSED = 1e-9  # of the scale: after a correction this small the next one, its square, is below rounding
_CONTRACTION = 0.25  # of each correction to the one before, and of the first to the step itself
_MOST_CORRECTIONS = 8
_SMALLEST = 1e-7  # of the scale: a step of the driver below it that still fails has met a lock

LEAST_MARGIN = 5e-5  # below it rounding, divided by its square, spoils accelerations: a lock or a branch is met
_STUCK = 1e-2  # g times the margin: at a lock g grows as the margin shrinks, at a branch it does not


class UnreachableError(ValueError):
    """A state that no motion of the linkage reaches; `fault` says why."""

    def __init__(self, fault: Fault) -> None:
        self.fault = fault
        super().__init__(str(fault))


def solved(model: Model, matrix: Array, right: Array) -> Array:
    """Solution of a linear system; by least squares where redundant closures make it consistent but singular."""
    try:
        if model.redundant:
            return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-12)[0])
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        found = "a position where joints or masses leave the motion open"
        raise UnreachableError(Fault(model.linkage.path, found, "a motion that is determined", "end before it")) from None


class Closure:
    """Poses that follow the driver's coordinate from a known pose, by tangent and Newton's method.

    It starts each time from the pose found last; what it finds is exact to rounding and does not depend on that, as long
    as the way there is one assembly's. Steps are halved until every correction is at most a quarter of the one before, and
    doubled after.
    """

    def __init__(self, model: Model, x: Array) -> None:
        self.model, self.x = model, x
        self.unit = model.length if model.linkage.sliding else 1.0
        state = model.state(x, np.zeros_like(x))
        self.q, self.g = state.q, influence(model, state)
        self.sense = margin(model, state.jacobian, state.along).sense

    def at(self, q: float) -> tuple[Array, Array]:
        """Coordinates x at the driver's coordinate q, and their influence coefficients g = dx/dq.

        Raises:
            UnreachableError: where the linkage locks or branches before q.

        """
        least = _SMALLEST * self.unit
        step = q - self.q
        while self.q != q:
            ahead = q if abs(step) >= abs(q - self.q) else self.q + step
            x = self._corrected(ahead)
            if x is not None:
                self._accept(ahead, x)
                step *= 2.0
            elif abs(step) < least:
                raise UnreachableError(locked(self.model, self.q))
            else:
                step *= 0.5
        return self.x, self.g

    def _accept(self, q: float, x: Array) -> None:
        """Take over a pose, unless a lock or a branch is met there or lies on the way."""
        state = self.model.state(x, np.zeros_like(x))
        found = margin(self.model, state.jacobian, state.along)
        if found.sense != self.sense:
            raise UnreachableError(branched(self.model, self.q))
        g = influence(self.model, state)
        if found.least < LEAST_MARGIN:
            stuck = _size(self.model, g) * self.unit * found.least > _STUCK
            raise UnreachableError(locked(self.model, q) if stuck else branched(self.model, q))
        self.q, self.x, self.g = q, x, g

    def _corrected(self, q: float) -> Array | None:
        """The pose at q from the tangent at the last one; None if corrections do not shrink fast enough."""
        model, rest = self.model, np.zeros_like(self.x)
        ahead = self.g * (q - self.q)
        x, last = self.x + ahead, _size(model, ahead)
        for _ in range(_MOST_CORRECTIONS):
            state = model.state(x, rest)
            try:
                correction = solved(model, _rows(state), np.append(-state.value, q - state.q))
            except UnreachableError:
                return None
            size = _size(model, correction)
            if size > max(_CONTRACTION * last, _CLOSED):
                return None
            x, last = x + correction, size
            if size <= _CLOSED:
                return np.asarray(x)
        return None


def influence(model: Model, state: State) -> Array:
    """G = dx/dq of every coordinate: Phi_x g = 0, q_x g = 1."""
    return solved(model, _rows(state), np.append(np.zeros_like(state.value), 1.0))


class Margin(NamedTuple):
    """How far the closures are from a lock or branch: smallest singular value of their Jacobian over one more row.

    Rows are scaled to length 1. `sense`: sign of the determinant, which turns where assemblies meet; 0 where redundant
    closures leave no square matrix.
    """

    sense: float
    least: float


def margin(model: Model, jacobian: Array, row: Array) -> Margin:
    """The margin of the closures' Jacobian over a row that goes along the motion."""
    rows = np.vstack((jacobian, row)) * model.scale
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    sense = 0.0 if model.redundant else float(np.linalg.slogdet(rows)[0])
    return Margin(sense, float(np.linalg.svd(rows, compute_uv=False)[-1]))


def bending(model: Model, state: State) -> Array:
    """d²x/dt² at zero acceleration of the driver, for the state's velocities; with v = g it is g' = d²x/dq²."""
    return solved(model, _rows(state), np.append(state.gamma, -state.bend))


def where(model: Model, q: float) -> str:
    """A driver's coordinate with its unit, for messages."""
    return f"{q:.9g} m" if model.linkage.sliding else f"{np.degrees(q):.9g} deg"


def locked(model: Model, q: float) -> Fault:
    """What is said where a linkage cannot follow its driver."""
    return Fault(f"{model.linkage.path}.driver", f"a lock at {where(model, q)}", "a motion that the joints allow")


def branched(model: Model, q: float) -> Fault:
    """What is said where assemblies meet, so that it is open in which one the motion goes on."""
    found = f"assemblies that meet at or just past {where(model, q)}"
    return Fault(model.linkage.path, found, "a motion within one assembly", "change a length, or end before")


def _rows(state: State) -> Array:
    return np.vstack((state.jacobian, state.along))


def _size(model: Model, change: Array) -> float:
    return float(np.abs(change / model.scale).max())


# -- equations ---------------------------------------------------------------------------------------------------------

# The equations of motion of a linkage: Newton's law with reactions, Lagrange's multipliers, one reduced coordinate.


class Accelerations(NamedTuple):
    """Accelerations of every coordinate, shape (3 bodies,), and the reactions, shape (equations,)."""

    accelerations: Array
    reactions: Array


class Reduced(NamedTuple):
    """The reduced equation at one position and speed: inertia I*, slope dI*/dq, moment M*, acceleration of the driver."""

    inertia: float
    slope: float
    moment: float
    acceleration: float


def system(model: Model, t: float, state: State, wrenches: Array) -> tuple[Array, Array]:
    """Matrix and right side of [[M, -B], [Phi_x, 0]] (a, R) = (Q, gamma).

    For the four-bar 9 accelerations and 8 reactions: 17 equations for 17 unknowns.
    """
    n, m = wrenches.shape
    matrix = np.zeros((n + m, n + m))
    matrix[range(n), range(n)] = model.masses
    matrix[:n, n:] = -wrenches
    matrix[n:, :n] = state.jacobian
    return matrix, np.concatenate((model.forces(t, state), state.gamma))


def by_newton(model: Model, t: float, state: State) -> Accelerations:
    """Accelerations and reactions together, from Newton's law of every body cut free.

    m a_G = sum F, J alpha = sum M_G for every body, reactions entering as the forces they are (`reaction_wrenches`), and
    the closure equations differentiated twice.

    Args:
        model: the linkage.
        t: time (s).
        state: where it stands and how fast.

    Raises:
        UnreachableError: where they are not determined.

    Source: the worked four-bar in dependent coordinates of a course on mechanisms; E. J. Haug, Computer Aided Kinematics
    and Dynamics of Mechanical Systems, Allyn and Bacon 1989, chapter 6.

    """
    return _solved(model, *system(model, t, state, reaction_wrenches(model, state)))


def by_multipliers(model: Model, t: float, state: State) -> Accelerations:
    """Accelerations and Lagrange's multipliers of the closure equations: M a - Phi_x^T lambda = Q, Phi_x a = gamma.

    A multiplier is the reaction itself: the force (N) or moment (N m) that does work on what its equation keeps at zero.

    Raises:
        UnreachableError: where they are not determined.

    Source: Haug as above; E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section VII.1.

    """
    return _solved(model, *system(model, t, state, state.jacobian.T))


def reduced(model: Model, t: float, x: Array, g: Array, qdot: float) -> Reduced:
    """The reduced equation I* alpha + ½ dI*/dq omega² = M* from the closures' own influence coefficients.

    I* = g^T M g, ½ dI*/dq = g^T M g', M* = g^T Q.

    Args:
        model: the linkage.
        t: time (s).
        x: a closed pose, shape (3 bodies,).
        g: its influence coefficients dx/dq, shape (3 bodies,).
        qdot: rate of the driver's coordinate (rad/s or m/s).

    """
    unit = model.state(x, g)
    slope = bending(model, unit)
    inertia, half = float(g @ (model.masses * g)), float(g @ (model.masses * slope))
    moment = float(g @ model.forces(t, unit._replace(qdot=qdot)))  # no force sees other velocities
    if not inertia > 0.0:
        found = f"I* = {inertia:g} at {where(model, unit.q)}"
        raise UnreachableError(Fault(model.linkage.path, found, "an inertia above 0", "give a body mass"))
    return Reduced(inertia, 2 * half, moment, (moment - half * qdot**2) / inertia)


def reaction_wrenches(model: Model, state: State) -> Array:
    """What a unit of every reaction does to every coordinate, from free bodies, shape (3 bodies, equations).

    A force f at the joint's point p acts on the second body as f and (p - c) × f about its centre c, on the first as the
    opposite. A coupling's effort acts on its second coordinate, and reversed, times its ratio, on its first.
    """
    free = [wrench for joint in model.pairs for wrench in _cut(joint, state.places)]
    free += [_effort(model, coupling, state.places) for coupling in model.linkage.couplings]
    return np.asarray(np.array(free).reshape(-1, model.masses.size + 3)[:, 3:].T)


def _cut(joint: Pair, places: tuple[Place, ...]) -> list[Array]:
    """Wrenches of the joint's reactions on all bodies."""
    ux, uy = turned(places[joint.first], joint.direction)
    both_ways = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    parts = both_ways if joint.kind in (PIN, FIXED) else [(-uy, ux, 0.0)]
    if joint.kind in (SLIDE, FIXED):
        parts = [*parts, (0.0, 0.0, 1.0)]
    assert len(parts) == len(COMPONENTS[joint.kind])
    return [_between(joint, places, *part) for part in parts]


def _between(joint: Pair, places: tuple[Place, ...], fx: float, fy: float, couple: float) -> Array:
    """A force through the joint's point on the second body and a couple, with their opposites on the first."""
    wrench = np.zeros((len(places), 3))
    two = places[joint.second]
    arm = turned(two, joint.second_arm)
    px, py = two.x + arm[0], two.y + arm[1]
    for k, sign in ((joint.second, 1.0), (joint.first, -1.0)):
        moment = (px - places[k].x) * fy - (py - places[k].y) * fx + couple
        wrench[k] += sign * fx, sign * fy, sign * moment
    return wrench.ravel()


def _effort(model: Model, coupling: Coupling, places: tuple[Place, ...]) -> Array:
    one, two = (_pushed(model.pair(name), places) for name in (coupling.first, coupling.second))
    joint = model.pair(coupling.first)
    q = coordinate(joint, places[joint.first], places[joint.second]).value
    return np.asarray(two - drive(coupling, q).first * one)


def _pushed(joint: Pair, places: tuple[Place, ...]) -> Array:
    """A unit effort along a joint's coordinate: a couple at a pin, a force along the guide at a slide."""
    if joint.kind == PIN:
        return _between(joint, places, 0.0, 0.0, 1.0)
    return _between(joint, places, *turned(places[joint.first], joint.direction), 0.0)


def _solved(model: Model, matrix: Array, right: Array) -> Accelerations:
    found = solved(model, matrix, right)
    return Accelerations(found[: model.masses.size], found[model.masses.size :])


# -- projection --------------------------------------------------------------------------------------------------------

# Coordinates and velocities put back onto the closure equations, by the shift of least kinetic measure.


_PROJECTED = 4e-16  # of the scale: what rounding leaves open
_LOST = 1e-9  # of the scale: what is still open after all corrections is no closure
_CORRECTIONS = 4


class Projected(NamedTuple):
    """Coordinates and velocities on the closures; `drift` is the largest |Phi| before (m or rad)."""

    x: Array
    v: Array
    drift: float
    state: State


def projected(model: Model, x: Array, v: Array) -> Projected:
    """The state nearest in the kinetic measure d^T M d that fulfils Phi = 0 and Phi_x v = 0.

    Raises:
        UnreachableError: if there is none near.

    Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section VII.2.

    """
    state = model.state(x, v)
    drift = left = _open(state)
    for _ in range(_CORRECTIONS):
        if left <= _PROJECTED * model.length:
            break
        x = x + _least(model, state, -state.value)
        state = model.state(x, v)
        left = _open(state)
    if not left <= _LOST * model.length:
        raise UnreachableError(Fault(model.linkage.path, f"closures open by {left:g} m or rad", "bodies that stay joined"))
    return Projected(x, v + _least(model, state, -state.jacobian @ v), drift, state)


class Branch:
    """The assembly that a motion keeps to, whichever way it goes: watched by its tangent, not by the driver."""

    def __init__(self, model: Model, state: State, tangent: Array) -> None:
        self.model, self.state, self.tangent = model, state, tangent / model.scale**2

    def follow(self, state: State) -> None:
        """Go on to the next state.

        Raises:
            UnreachableError: if assemblies met on the way there.

        Source: E. L. Allgower, K. Georg, Numerical Continuation Methods, Springer 1990, chapter 8.

        """
        model, last = self.model, self.tangent
        before, after = (margin(model, each.jacobian, last) for each in (self.state, state))
        if after.sense != before.sense or after.least < LEAST_MARGIN:
            raise UnreachableError(branched(model, self.state.q))
        ahead = solved(model, np.vstack((state.jacobian, last)), np.append(np.zeros_like(state.value), 1.0))
        self.state, self.tangent = state, ahead / model.scale**2


def _open(state: State) -> float:
    return float(np.abs(state.value).max(initial=0.0))


def _least(model: Model, state: State, wanted: Array) -> Array:
    """The change d of least d^T M d with Phi_x d = wanted."""
    n, m = state.along.size, wanted.size
    matrix = np.zeros((n + m, n + m))
    matrix[range(n), range(n)] = model.masses
    matrix[:n, n:], matrix[n:, :n] = state.jacobian.T, state.jacobian
    return solved(model, matrix, np.concatenate((np.zeros(n), wanted)))[:n]


# -- stepping ----------------------------------------------------------------------------------------------------------

# Time steps of the eighth order, with a correction after each where a route asks for one.


Rates = Callable[[float, Array], Array]

TIGHTEST = 3e-14  # tolerance of a step: below it the integrator's own rounding wins
_MOST_STEPS = 100_000
_CREEPING = 1e-9  # of the way so far: steps below it, before what cannot be reached, have come to its edge


class Steps(NamedTuple):
    """Accepted steps: ends `s` and states there, from the start on; dense output of each; evaluations of the rates."""

    s: Array
    states: Array
    dense: tuple[Callable[[float], Array], ...]
    evaluations: int

    def at(self, s: float) -> Array:
        """State at any s on the way."""
        return self.dense[min(int(np.searchsorted(self.s[1:], s)), len(self.dense) - 1)](s)


class Tolerance(NamedTuple):
    """Error allowed in a step: relative, and absolute for each variable (infinite: not watched)."""

    relative: float
    absolute: Array


class _Guarded:
    """Rates that are not numbers where no motion gets to, so that the integrator tries a shorter step; why, is kept."""

    def __init__(self, rates: Rates) -> None:
        self.rates = rates
        self.met = False
        self.fault = Fault("rtol", "a motion that cannot be followed at this tolerance", "another one", "loosen it")

    def __call__(self, s: float, state: Array) -> Array:
        if not np.isfinite(state).all():
            return np.full_like(state, np.nan)
        try:
            return self.rates(s, state)
        except UnreachableError as error:
            self.fault, self.met = error.fault, True
            return np.full_like(state, np.nan)


def stepped(
    rates: Rates,
    state: Array,
    until: float,
    tolerance: Tolerance,
    correct: Callable[[Array], Array] | None = None,
    reached: Callable[[Array], bool] | None = None,
) -> Steps:
    """Follow dy/ds = rates(s, y) from s = 0 by DOP853 to `until`, or to the step after which `reached` says so.

    `correct` puts a state back onto what the exact one fulfils, after every step.

    Raises:
        SceneError: where the motion ends before, with the reason that the rates give.

    Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., section II.5.

    """
    if not np.isfinite(rates(0.0, state)).all():  # the start itself must be sound
        raise SceneError([Fault("simulate", "loads that are not finite at the start", "finite ones")])
    guarded = _Guarded(rates)
    absolute: Any = tolerance.absolute  # one for each variable, which the stubs do not know
    solver: Any = DOP853(guarded, 0.0, state, until, rtol=max(tolerance.relative, TIGHTEST), atol=absolute)
    s, states, dense = [0.0], [np.array(state)], []
    while solver.status == "running" and not (reached and reached(solver.y)):
        solver.step()
        creeping = solver.t - s[-1] < _CREEPING * solver.t
        if solver.status == "failed" or (creeping and guarded.met):
            raise SceneError([guarded.fault])
        guarded.met = guarded.met and creeping
        if correct is not None:
            solver.y = correct(solver.y)
            solver.f = guarded(solver.t, solver.y)
            solver.nfev += 1
        s.append(float(solver.t))
        states.append(np.array(solver.y))
        dense.append(solver.dense_output())
        if len(dense) >= _MOST_STEPS:
            raise SceneError([Fault("until", f"{_MOST_STEPS} steps that lead only to {s[-1]:.6g}", "a shorter way")])
    return Steps(np.array(s), np.array(states), tuple(dense), int(solver.nfev))


# -- energy ------------------------------------------------------------------------------------------------------------

# The energy route: the kinetic energy as an integral of work over the driver's way, then the time that it took.
#
# E = ½ I* omega² obeys dE/dq = M*(t, q, omega): where torques depend on position alone, E is the work done and nothing
# else; then t = integral of dq/omega. Only first influence coefficients are needed. It works as long as omega keeps its
# sign.


_NUDGE = 1e-6  # of the way: where the slope of E/u² at the start is taken from


class Way:
    """The driver's way, q = start + sense u; from rest q = start + sense u², in which E/u² and omega/u are smooth.

    `y` stands for the energy: E, or E/u² from rest.
    """

    def __init__(self, model: Model, x: Array, q: float, qdot: float) -> None:
        self.model, self.closure, self.start, self.rest = model, Closure(model, x), q, qdot == 0.0
        self.sense = 1.0
        inertia, moment = self._reduced(0.0, q, qdot)
        if self.rest and moment == 0.0:
            raise SceneError([Fault("qdot", "a machine at rest that nothing moves", "a speed, or a load that moves it")])
        self.sense = float(np.sign(qdot or moment))
        self.y = abs(moment) if self.rest else 0.5 * inertia * qdot**2
        self.growth = self._growth() if self.rest else 0.0

    def q(self, u: float) -> float:
        """The driver's coordinate."""
        return self.start + self.sense * (u * u if self.rest else u)

    def state(self, u: float, y: float) -> State:
        """All bodies at a point of the way, at the driver's speed sense sqrt(2E/I*).

        Raises:
            UnreachableError: if no energy is left.

        """
        x, g = self.closure.at(self.q(u))
        return self.model.state(x, g * (self.sense * self._pace(u, y) * (u if self.rest else 1.0)))

    def rates(self, u: float, both: Array) -> Array:
        """d(y, t)/du: dE/du = sense M*, dt/du = 1/|omega|.

        From rest d(E/u²)/du = (2/u)(sense M* - E/u²), dt/du = 2u/|omega|.
        """
        y, t = float(both[0]), float(both[1])
        state, pace = self.state(u, y), self._pace(u, y)
        push = self.sense * float(self.closure.g @ self.model.forces(t, state))
        if not self.rest:
            return np.array([push, 1 / pace])
        return np.array([2 / u * (push - y) if u > 0.0 else self.growth, 2 / pace])

    def _pace(self, u: float, y: float) -> float:
        """|omega|, or |omega|/u from rest: sqrt(2 y/I*)."""
        if not y > 0.0:
            raise UnreachableError(_stopped(self.model, self.q(u)))
        _, g = self.closure.at(self.q(u))
        return sqrt(2 * y / float(g @ (self.model.masses * g)))

    def _reduced(self, t: float, q: float, qdot: float) -> tuple[float, float]:
        """I* = g^T M g and M* = g^T Q at a position and speed of the driver."""
        x, g = self.closure.at(q)
        return float(g @ (self.model.masses * g)), float(g @ self.model.forces(t, self.model.state(x, g * qdot)))

    def _growth(self) -> float:
        """Slope of E/u² at rest, two thirds of that of M* along the motion: a difference that only the first step sees."""
        inertia, _ = self._reduced(0.0, self.start, 0.0)
        pace = sqrt(2 * self.y / inertia)
        _, moment = self._reduced(2 * _NUDGE / pace, self.q(_NUDGE), self.sense * _NUDGE * pace)
        return 2 / 3 * (self.sense * moment - self.y) / _NUDGE


def traversed(way: Way, until: float, rtol: float) -> Steps:
    """Steps in u of (y, t) until the time `until` is reached or passed.

    Raises:
        SceneError: where the motion comes to rest before: the route cannot follow it there.

    """
    tolerance = Tolerance(rtol, np.array([0.0, rtol * until]))
    return stepped(way.rates, np.array([way.y, 0.0]), np.inf, tolerance, None, lambda both: both[1] >= until)


def reached(steps: Steps, t: float) -> float:
    """The parameter u of the way at a time."""
    if t <= 0.0:
        return 0.0
    k = min(max(int(np.searchsorted(steps.states[:, 1], t)), 1), len(steps.s) - 1)
    low, high = float(steps.s[k - 1]), float(steps.s[k])

    def late(u: float) -> float:
        return float(steps.dense[k - 1](u)[1]) - t

    return low if late(low) >= 0.0 else instant(late, low, high)


def _stopped(model: Model, q: float) -> Fault:
    advice = "take another route, or end before"
    return Fault(
        "route", f"a motion that stops at {where(model, q)}", "a speed that keeps its sign on the energy route", advice
    )


# -- routes ------------------------------------------------------------------------------------------------------------

# The four routes: which state each integrates, and how all bodies follow from it.


REDUCED, NEWTON, MULTIPLIERS, ENERGY = "reduced", "newton", "multipliers", "energy"


class Start(NamedTuple):
    """A closed pose x near the driver's coordinate q, where its rate is qdot (rad, rad/s or m, m/s)."""

    x: Array
    q: float
    qdot: float


class Followed(NamedTuple):
    """A motion: times, work done since the start (J; None on the energy route), evaluations, greatest drift of a step.

    `state(t)` gives all bodies at any time; `law` the accelerations and reactions there, if the route finds them.
    """

    t: Array
    work: Array | None
    evaluations: int
    drift: float
    state: Callable[[float], State]
    law: Callable[[Model, float, State], Accelerations] | None


def by_reduced_equation(model: Model, start: Start, until: float, rtol: float) -> Followed:
    """One equation for the driver, I* and M* by the closures' influence coefficients."""
    closure = Closure(model, start.x)

    def rates(t: float, y: Array) -> Array:
        found = reduced(model, t, *closure.at(float(y[0])), float(y[1]))
        return np.array([y[1], found.acceleration, found.moment * y[1]])

    return _driver_alone(model, closure, rates, start, until, rtol)


def by_newtons_law(model: Model, start: Start, until: float, rtol: float) -> Followed:
    """Poses closed at every driver's coordinate; accelerations and reactions together by Newton's law."""
    closure = Closure(model, start.x)

    def rates(t: float, y: Array) -> Array:
        state = _carried(model, closure, float(y[0]), float(y[1]))
        acceleration = float(state.along @ by_newton(model, t, state).accelerations) + state.bend
        return np.array([y[1], acceleration, float(closure.g @ model.forces(t, state)) * y[1]])

    return _driver_alone(model, closure, rates, start, until, rtol)._replace(law=by_newton)


def _carried(model: Model, closure: Closure, q: float, qdot: float) -> State:
    x, g = closure.at(q)
    return model.state(x, g * qdot)


def _driver_alone(model: Model, closure: Closure, rates: Rates, start: Start, until: float, rtol: float) -> Followed:
    """The driver's coordinate, speed and the work done as state; all else from the closures."""
    unit = model.length if model.linkage.sliding else 1.0
    tolerance = Tolerance(rtol, np.array([rtol * unit, rtol * unit, np.inf]))
    steps = stepped(rates, np.array([start.q, start.qdot, 0.0]), until, tolerance)

    def state(t: float) -> State:
        return _carried(model, closure, *steps.at(t)[:2].tolist())

    return Followed(steps.s, steps.states[:, 2], steps.evaluations, 0.0, state, None)


def by_lagranges_multipliers(model: Model, start: Start, until: float, rtol: float) -> Followed:
    """All coordinates and velocities as a differential-algebraic system of index 1, projected after every step."""
    x, g = Closure(model, start.x).at(start.q)
    n = x.size
    drifts = [0.0]
    branch = Branch(model, model.state(x, g), g)

    def split(y: Array) -> tuple[Array, Array]:
        return y[:n], y[n : 2 * n]

    def rates(t: float, y: Array) -> Array:
        _, v = split(y)
        state = model.state(*split(y))
        return np.concatenate((v, by_multipliers(model, t, state).accelerations, [v @ model.forces(t, state)]))

    def correct(y: Array) -> Array:
        found = projected(model, *split(y))
        drifts.append(found.drift)
        branch.follow(found.state)
        return np.concatenate((found.x, found.v, y[2 * n :]))

    tolerance = Tolerance(rtol, rtol * np.concatenate((model.scale, model.scale, [np.inf])))
    steps = stepped(rates, np.concatenate((x, g * start.qdot, [0.0])), until, tolerance, correct)

    def state(t: float) -> State:
        return model.state(*projected(model, *split(steps.at(t)))[:2])

    return Followed(steps.s, steps.states[:, 2 * n], steps.evaluations, max(drifts), state, by_multipliers)


def by_energy(model: Model, start: Start, until: float, rtol: float) -> Followed:
    """Energy and time as state over the driver's way."""
    way = Way(model, start.x, start.q, start.qdot)
    steps = traversed(way, until, rtol)

    def state(t: float) -> State:
        u = reached(steps, t)
        return way.state(u, float(steps.at(u)[0]))

    return Followed(np.append(steps.states[:-1, 1], until), None, steps.evaluations, 0.0, state, None)


FOLLOW: dict[str, Callable[[Model, Start, float, float], Followed]] = {
    REDUCED: by_reduced_equation,
    NEWTON: by_newtons_law,
    MULTIPLIERS: by_lagranges_multipliers,
    ENERGY: by_energy,
}


# -- running -----------------------------------------------------------------------------------------------------------

# A linkage's motion under its loads, by any of four routes, with what tells how good it is.


ROUTES = tuple(FOLLOW)


class Run(NamedTuple):
    """A simulated motion at the integrator's own times.

    t (s), q (rad or m, not reduced), qdot; `coordinates`, `velocities`: x_G, y_G, theta of every moving body and their
    rates, shape (times, bodies, 3). `reactions`: by joint, a column for each of `multibody.COMPONENTS` (N, N m), NaN where
    redundant constraints leave them open; None on routes that do not find them. `closure`: largest closure residual (m or
    rad) of the poses given; `drift`: largest one that a step left before it was put back (0 where poses are closed at
    every step). `energy_residual`: largest |kinetic energy gained - work| over the largest kinetic energy; None on the
    energy route, which has no other energy. `evaluations`: of the rates. `at(t)`: (q, qdot) at any times within.
    """

    route: str
    t: Array
    q: Array
    qdot: Array
    coordinates: Array
    velocities: Array
    reactions: Mapping[str, Array] | None
    drift: float
    closure: float
    energy_residual: float | None
    evaluations: int
    at: Callable[[ArrayLike], tuple[Array, Array]]


def simulate(
    linkage: Linkage,
    route: str,
    q: float,
    qdot: float,
    until: float,
    *,
    gravity: tuple[float, float] | None = None,
    drive: Law = 0.0,
    wrenches: Iterable[Wrench] = (),
    rtol: float = 1e-10,
    start: Poses | None = None,
) -> Run:
    """Motion of a linkage from a position and a speed of its driver, in absolute coordinates of all bodies.

    Args:
        linkage: bodies, joints, couplings; joints with friction are refused.
        route: `reduced` (one equation for the driver), `newton` (poses closed at every driver's coordinate, accelerations
            and reactions together from Newton's law), `multipliers` (all coordinates as a differential-algebraic system of
            index 1, put back onto the closures after every step), `energy` (work over the way, then time; the driver's
            speed keeps its sign).
        q: the driver's coordinate at t = 0, rad, or m where it slides.
        qdot: its rate, rad/s or m/s; it may be zero.
        until: time to simulate, s.
        gravity: components along x and y, m/s²; none if None.
        drive: torque (N m) or force (N) at the driver's joint, on its second body and back on its first; a number or a
            function of (t, q, qdot). It should be smooth: steps are not restarted at jumps.
        wrenches: what acts on bodies from outside.
        rtol: tolerance of the integrator, per step.
        start: poses whose first one is taken instead of the assembly that the linkage's guesses and sides choose.

    Raises:
        SceneError: where an argument is no finite number or of another type, where the linkage is ill described, locks or
            branches, has friction, or stops on the energy route.

    >>> from flywheel.scene.linkage import Joint, Link, Linkage, Point
    >>> o = Point("o")
    >>> rotor = Linkage(Link("frame", (o,)), (Link("rotor", (o,), inertia=2.0),),
    ...                 (Joint("pivot", "pin", "frame", "rotor", o, o),), "pivot")
    >>> run = simulate(rotor, "newton", 0.0, 0.0, 3.0, drive=6.0)
    >>> round(float(run.q[-1]), 9), round(float(run.qdot[-1]), 9)
    (13.5, 9.0)

    """
    check(linkage)
    faults = [*name_faults("route", route, FOLLOW), *number_faults("q", q), *number_faults("qdot", qdot)]
    refuse([*faults, *number_faults("until", until, POSITIVE), *number_faults("rtol", rtol, POSITIVE)])
    if start is not None:
        require("start", start, Poses, "Poses")
    prepared = model(linkage, _actions(gravity, drive, wrenches))
    x = coordinates(start if start is not None else _assembled(linkage, q))
    jacobian = prepared.state(x, np.zeros_like(x)).jacobian
    prepared = replace(prepared, redundant=bool(np.linalg.matrix_rank(jacobian, rtol=_RANK) < len(jacobian)))
    try:
        return _run(prepared, route, FOLLOW[route](prepared, Start(x, q, qdot), until, rtol))
    except UnreachableError as error:
        raise SceneError([error.fault]) from None


def _actions(gravity: tuple[float, float] | None, drive: Law, wrenches: Iterable[Wrench]) -> Actions:
    """All actions, laws that are no finite numbers or functions refused."""
    if isinstance(wrenches, Wrench) or not isinstance(wrenches, Iterable):
        raise SceneError([Fault("wrenches", shown(wrenches), "a list of Wrench")])
    given = tuple(wrenches)
    laws = {"drive": drive}
    for k, wrench in enumerate(given):
        require(f"wrenches[{k}]", wrench, Wrench, "a Wrench")
        laws |= _laws(f"wrenches[{k}]", wrench)
    refuse([fault for path, law in laws.items() if not callable(law) for fault in number_faults(path, law)])
    return Actions((0.0, 0.0) if gravity is None else vector("gravity", gravity, "m/s²"), drive, given)


def _laws(path: str, wrench: Wrench) -> dict[str, Law]:
    """The three laws of a wrench, its place checked."""
    if wrench.at is not None and not isinstance(wrench.at, str):
        vector(f"{path}.at", wrench.at, "m")
    if not isinstance(wrench.force, (tuple, list)) or len(wrench.force) != 2:
        raise SceneError([Fault(f"{path}.force", shown(wrench.force), "two laws, along x and y")])
    return {f"{path}.force[0]": wrench.force[0], f"{path}.force[1]": wrench.force[1], f"{path}.torque": wrench.torque}


def _assembled(linkage: Linkage, q: float) -> Poses:
    from flywheel.mechanisms.linkages.positions import solve_over  # only motions without given poses need it

    return solve_over(linkage, (linkage.start, q)).poses(q)


def _run(prepared: Model, route: str, found: Followed) -> Run:
    """What a motion says at its own times."""
    states = [found.state(float(t)) for t in found.t]
    poses, paces = _over(states, 0), _over(states, 5)

    def at(times: ArrayLike) -> tuple[Array, Array]:
        wanted = [found.state(float(t)) for t in np.atleast_1d(array("times", times))]
        return _driver(wanted)

    return Run(
        route,
        found.t,
        *_driver(states),
        poses,
        paces,
        reactions=_reactions(prepared, found, states),
        drift=found.drift,
        closure=max(float(np.abs(state.value).max(initial=0.0)) for state in states),
        energy_residual=_energy_residual(prepared, paces, found.work),
        evaluations=found.evaluations,
        at=at,
    )


def _over(states: list[State], first: int) -> Array:
    """Three fields of every moving body's place, from `first` on."""
    return np.array([[place[first : first + 3] for place in state.places[1:]] for state in states])


def _driver(states: list[State]) -> tuple[Array, Array]:
    return np.array([state.q for state in states]), np.array([state.qdot for state in states])


def _energy_residual(prepared: Model, paces: Array, work: Array | None) -> float | None:
    if work is None:
        return None
    kinetic = 0.5 * (paces.reshape(len(paces), -1) ** 2 @ prepared.masses)
    return float(np.abs(kinetic - kinetic[0] - work).max() / max(float(kinetic.max()), 1e-300))


def _reactions(prepared: Model, found: Followed, states: list[State]) -> dict[str, Array] | None:
    """Reactions by joint, those left open as NaN."""
    if found.law is None:
        return None
    rows = [found.law(prepared, float(t), state).reactions for t, state in zip(found.t, states, strict=True)]
    if prepared.redundant:
        rows = [np.where(undetermined(state.jacobian), np.nan, row) for row, state in zip(rows, states, strict=True)]
    table, names = np.array(rows), [joint for joint, _ in components(prepared.linkage)]
    return {name: table[:, [k for k, joint in enumerate(names) if joint == name]] for name in dict.fromkeys(names)}


# -- multibody ---------------------------------------------------------------------------------------------------------

# Direct dynamics of plane linkages by routes that share nothing with the reduced equation but the description.
#
# All bodies keep their absolute coordinates x_G, y_G, theta; joints are equations between them.
#
# >>> from flywheel.multibody import ROUTES
# >>> ROUTES
# ('reduced', 'newton', 'multipliers', 'energy')


__all__ = [
    "COMPONENTS",
    "ENERGY",
    "MULTIPLIERS",
    "NEWTON",
    "REDUCED",
    "ROUTES",
    "Law",
    "Run",
    "Wrench",
    "components",
    "simulate",
]
