"""Direct dynamics of plane linkages by routes that share nothing with the reduced equation but the description.

All bodies keep their absolute coordinates, the pose x, y (m), theta (rad) of their centres of mass; joints are equations
between them. Every relation phi of two poses gives its value, its gradient by both, and its bend (phi_x v)_x v, the part of
its second time derivative that needs no accelerations: d²phi/dt² = phi_x a + bend. Relations are arithmetic alone, so that
any kind of number may stand in the poses.

>>> from flywheel.multibody import ROUTES
>>> ROUTES
('reduced', 'newton', 'multipliers', 'energy')
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
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

Array = NDArray[np.float64]
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


def turn(one: Place, two: Place) -> Row:
    """Angle of the second body less that of the first."""
    return Row(two.theta - one.theta, (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), 0.0)


def closures(joint: Pair, one: Place, two: Place) -> list[Row]:
    """The relations that a joint keeps at zero, in the order of its components in `COMPONENTS`."""
    seen = gap(joint, one, two)
    if joint.kind in (PIN, FIXED):
        rows = [fixed_component(seen, (1.0, 0.0)), fixed_component(seen, (0.0, 1.0))]
    else:
        ux, uy = turned(one, joint.direction)
        rows = [turning_component(seen, (-uy, ux), one.omega)]
    if joint.kind in (SLIDE, FIXED):
        turned_by = turn(one, two)
        left = turned_by.value - joint.angle  # whole turns are left out
        rows.append(turned_by._replace(value=left - 2 * math.pi * round(left / (2 * math.pi))))
    return rows


COMPONENTS = {PIN: ("x", "y"), SLIDE: ("normal", "moment"), SLOT: ("normal",), FIXED: ("x", "y", "moment")}
"""What the first body does to the second through each kind of joint, at the second's point.

x, y: forces along the frame's axes (N); normal: force across the guide, positive to the left of its direction (N);
moment: positive counter-clockwise (N m). The first body feels the opposite at the same place.
"""


def coordinate(joint: Pair, one: Place, two: Place) -> Row:
    """The joint's coordinate: the turn of a pin (rad), the way along the guide of a slide or pin in slot (m)."""
    if joint.kind == PIN:
        return turn(one, two)
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
    angle = q - math.floor(q / coupling.lift.period) * coupling.lift.period
    jet = coupling.lift.curve.jet(angle, angle, np)
    return Drive(float(jet.value) + coupling.phase, float(jet.first), float(jet.second))


def _dot(a: Vector, b: Vector) -> Any:
    return a[0] * b[0] + a[1] * b[1]


# -- the linkage in absolute coordinates -------------------------------------------------------------------------------


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
        poses = zip(x.reshape(-1, 3).tolist(), v.reshape(-1, 3).tolist(), strict=True)
        places = (placed((*self.linkage.ground.com, 0.0)), *(placed(pose, velocity) for pose, velocity in poses))
        spread = [
            _spread(self.masses.size, row, joint)
            for joint in self.pairs
            for row in closures(joint, places[joint.first], places[joint.second])
        ]
        for coupling in self.linkage.couplings:  # q2 - f(q1): bend of q2 less f' times that of q1 and f'' (dq1/dt)²
            one, two = self._coordinate(coupling.first, places), self._coordinate(coupling.second, places)
            driven = drive(coupling, one.value)
            bend = two.bend - driven.first * one.bend - driven.second * float(np.dot(one.gradient, v)) ** 2
            gradient = [b - driven.first * a for a, b in zip(one.gradient, two.gradient, strict=True)]
            spread.append(Spread(two.value - driven.value, gradient, bend))
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

        def at(law: Law) -> float:
            return law(t, state.q, state.qdot) if callable(law) else law

        total = self.weights + at(self.actions.drive) * state.along
        for wrench in self.actions.wrenches:
            k, link = self.linkage.names.index(wrench.body), self.linkage.link(wrench.body)
            fx, fy = (at(part) for part in wrench.force)
            at_point = link.com if wrench.at is None else wrench.at
            x, y = link.point(at_point)[-2:] if isinstance(at_point, str) else at_point
            rx, ry = turned(state.places[k], (x - link.com[0], y - link.com[1]))
            total[3 * k - 3 : 3 * k] += fx, fy, rx * fy - ry * fx + at(wrench.torque)
        return np.asarray(total)

    def _coordinate(self, joint: str, places: Sequence[Place]) -> Spread:
        found = self.pair(joint)
        return _spread(self.masses.size, coordinate(found, places[found.first], places[found.second]), found)


def model(linkage: Linkage, actions: Actions) -> Model:
    """A linkage with its actions, prepared.

    Raises:
        SceneError: for friction, which these routes leave out, and for wrenches on bodies that do not move.

    """
    rubbing = [joint.name for joint in linkage.joints if joint.friction > 0.0]
    rubbing += [coupling.name for coupling in linkage.couplings if coupling.friction > 0.0]
    ideal = "friction", "none: these routes are those of ideal joints", "set it to 0"
    faults = [Fault(f"{linkage.path}.{name}.friction", *ideal) for name in rubbing]
    moving = [link.name for link in linkage.links]
    for k, wrench in enumerate(actions.wrenches):
        path = f"wrenches[{k}]"
        if wrench.body not in moving:
            faults.append(Fault(f"{path}.body", repr(wrench.body), f"a moving body: {', '.join(moving)}"))
            continue
        points = [point.name for point in linkage.link(wrench.body).points]
        if isinstance(wrench.at, str) and wrench.at not in points:
            faults.append(Fault(f"{path}.at", repr(wrench.at), f"a point of {wrench.body}: {', '.join(points)}"))
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


def _spread(size: int, row: Row, joint: Pair) -> Spread:
    """A row over all coordinates, the frame's left out."""
    gradient = [0.0] * (size + 3)
    gradient[3 * joint.first : 3 * joint.first + 3] = row.first
    gradient[3 * joint.second : 3 * joint.second + 3] = row.second
    return Spread(row.value, gradient[3:], row.bend)


# -- closure: poses at a driver's coordinate and their influence coefficients, from the closure equations alone -----------


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
        model = self.model
        state = model.state(x, np.zeros_like(x))
        found = margin(model, state.jacobian, state.along)
        if found.sense != self.sense:
            raise UnreachableError(branched(model, self.q))
        g = influence(model, state)
        if found.least < LEAST_MARGIN:
            stuck = float(np.abs(g / model.scale).max()) * self.unit * found.least > _STUCK
            raise UnreachableError(locked(model, q) if stuck else branched(model, q))
        self.q, self.x, self.g = q, x, g

    def _corrected(self, q: float) -> Array | None:
        """The pose at q from the tangent at the last one; None if corrections do not shrink fast enough."""
        model, rest = self.model, np.zeros_like(self.x)
        ahead = self.g * (q - self.q)
        x, last = self.x + ahead, float(np.abs(ahead / model.scale).max())
        for _ in range(_MOST_CORRECTIONS):
            state = model.state(x, rest)
            try:
                correction = solved(model, np.vstack((state.jacobian, state.along)), np.append(-state.value, q - state.q))
            except UnreachableError:
                return None
            size = float(np.abs(correction / model.scale).max())
            if size > max(_CONTRACTION * last, _CLOSED):
                return None
            x, last = x + correction, size
            if size <= _CLOSED:
                return np.asarray(x)
        return None


def influence(model: Model, state: State) -> Array:
    """G = dx/dq of every coordinate: Phi_x g = 0, q_x g = 1."""
    return solved(model, np.vstack((state.jacobian, state.along)), np.append(np.zeros_like(state.value), 1.0))


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


# -- equations of motion: Newton's law with reactions, Lagrange's multipliers, one reduced coordinate --------------------


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
    found = solved(model, *system(model, t, state, reaction_wrenches(model, state)))
    return Accelerations(found[: model.masses.size], found[model.masses.size :])


def by_multipliers(model: Model, t: float, state: State) -> Accelerations:
    """Accelerations and Lagrange's multipliers of the closure equations: M a - Phi_x^T lambda = Q, Phi_x a = gamma.

    A multiplier is the reaction itself: the force (N) or moment (N m) that does work on what its equation keeps at zero.

    Raises:
        UnreachableError: where they are not determined.

    Source: Haug as above; E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section VII.1.

    """
    found = solved(model, *system(model, t, state, state.jacobian.T))
    return Accelerations(found[: model.masses.size], found[model.masses.size :])


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
    slope = solved(model, np.vstack((unit.jacobian, unit.along)), np.append(unit.gamma, -unit.bend))  # g' = d²x/dq²
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
    places, free = state.places, []
    for joint in model.pairs:
        ux, uy = turned(places[joint.first], joint.direction)
        parts = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)] if joint.kind in (PIN, FIXED) else [(-uy, ux, 0.0)]
        if joint.kind in (SLIDE, FIXED):
            parts.append((0.0, 0.0, 1.0))
        free += [_between(joint, places, *part) for part in parts]
    for coupling in model.linkage.couplings:
        joint = model.pair(coupling.first)
        ratio = drive(coupling, coordinate(joint, places[joint.first], places[joint.second]).value).first
        efforts = []
        for one in (joint, model.pair(coupling.second)):  # a couple at a pin, a force along the guide at a slide
            effort = (0.0, 0.0, 1.0) if one.kind == PIN else (*turned(places[one.first], one.direction), 0.0)
            efforts.append(_between(one, places, *effort))
        free.append(efforts[1] - ratio * efforts[0])
    return np.asarray(np.array(free).reshape(-1, model.masses.size + 3)[:, 3:].T)


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


# -- projection: coordinates and velocities put back onto the closures, by the shift of least kinetic measure --------------


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

    def gap(state: State) -> float:
        return float(np.abs(state.value).max(initial=0.0))

    def least(state: State, wanted: Array) -> Array:
        """The change d of least d^T M d with Phi_x d = wanted."""
        n, m = state.along.size, wanted.size
        matrix = np.zeros((n + m, n + m))
        matrix[range(n), range(n)] = model.masses
        matrix[:n, n:], matrix[n:, :n] = state.jacobian.T, state.jacobian
        return solved(model, matrix, np.concatenate((np.zeros(n), wanted)))[:n]

    state = model.state(x, v)
    drift = left = gap(state)
    for _ in range(_CORRECTIONS):
        if left <= _PROJECTED * model.length:
            break
        x = x + least(state, -state.value)
        state = model.state(x, v)
        left = gap(state)
    if not left <= _LOST * model.length:
        raise UnreachableError(Fault(model.linkage.path, f"closures open by {left:g} m or rad", "bodies that stay joined"))
    return Projected(x, v + least(state, -state.jacobian @ v), drift, state)


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


# -- stepping: the eighth order, with a correction after each step where a route asks for one --------------------------


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


def stepped(
    rates: Rates,
    state: Array,
    until: float,
    rtol: float,
    atol: Array,
    correct: Callable[[Array], Array] | None = None,
    reached: Callable[[Array], bool] | None = None,
) -> Steps:
    """Follow dy/ds = rates(s, y) from s = 0 by DOP853 to `until`, or to the step after which `reached` says so.

    rtol, atol: error allowed in a step, relative, and absolute for each variable (infinite: not watched). `correct` puts a
    state back onto what the exact one fulfils, after every step. Rates are not numbers where no motion gets to, so that the
    integrator tries a shorter step; the reason is kept.

    Raises:
        SceneError: where the motion ends before, with the reason that the rates give.

    Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., section II.5.

    """
    if not np.isfinite(rates(0.0, state)).all():  # the start itself must be sound
        raise SceneError([Fault("simulate", "loads that are not finite at the start", "finite ones")])
    met: list[Fault] = []
    reason = Fault("rtol", "a motion that cannot be followed at this tolerance", "another one", "loosen it")

    def guarded(s: float, state: Array) -> Array:
        nonlocal reason
        if not np.isfinite(state).all():
            return np.full_like(state, np.nan)
        try:
            return rates(s, state)
        except UnreachableError as error:
            reason = error.fault
            met.append(reason)
            return np.full_like(state, np.nan)

    absolute: Any = atol  # one for each variable, which the stubs do not know
    solver: Any = DOP853(guarded, 0.0, state, until, rtol=max(rtol, TIGHTEST), atol=absolute)
    s, states, dense = [0.0], [np.array(state)], []
    while solver.status == "running" and not (reached and reached(solver.y)):
        solver.step()
        creeping = solver.t - s[-1] < _CREEPING * solver.t
        if solver.status == "failed" or (creeping and met):
            raise SceneError([reason])
        if not creeping:
            met.clear()
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


# -- the energy route: kinetic energy as an integral of work over the driver's way, then the time that it took -----------


_NUDGE = 1e-6  # of the way: where the slope of E/u² at the start is taken from


class Way:
    """The driver's way, q = start + sense u; from rest q = start + sense u², in which E/u² and omega/u are smooth.

    E = ½ I* omega² obeys dE/dq = M*(t, q, omega): where torques depend on position alone, E is the work done and nothing
    else; then t = integral of dq/omega. Only first influence coefficients are needed. omega has to keep its sign.
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
        self.growth = 0.0
        if self.rest:  # slope of E/u², two thirds of that of M* along the motion: a difference that only the first step sees
            rate = sqrt(2 * self.y / inertia)
            _, ahead = self._reduced(2 * _NUDGE / rate, self.q(_NUDGE), self.sense * _NUDGE * rate)
            self.growth = 2 / 3 * (self.sense * ahead - self.y) / _NUDGE

    def q(self, u: float) -> float:
        """The driver's coordinate."""
        return self.start + self.sense * (u * u if self.rest else u)

    def state(self, u: float, y: float) -> State:
        """All bodies at a point of the way, at the driver's speed sense sqrt(2E/I*).

        Raises:
            UnreachableError: if no energy is left.

        """
        x, g = self.closure.at(self.q(u))
        return self.model.state(x, g * (self.sense * self._speed(u, y) * (u if self.rest else 1.0)))

    def rates(self, u: float, both: Array) -> Array:
        """d(y, t)/du: dE/du = sense M*, dt/du = 1/|omega|.

        From rest d(E/u²)/du = (2/u)(sense M* - E/u²), dt/du = 2u/|omega|.
        """
        y, t = float(both[0]), float(both[1])
        state, speed = self.state(u, y), self._speed(u, y)
        push = self.sense * float(self.closure.g @ self.model.forces(t, state))
        if not self.rest:
            return np.array([push, 1 / speed])
        return np.array([2 / u * (push - y) if u > 0.0 else self.growth, 2 / speed])

    def _speed(self, u: float, y: float) -> float:
        """|omega|, or |omega|/u from rest: sqrt(2 y/I*)."""
        if not y > 0.0:
            found = f"a motion that stops at {where(self.model, self.q(u))}"
            advice = "take another route, or end before"
            raise UnreachableError(Fault("route", found, "a speed that keeps its sign on the energy route", advice))
        _, g = self.closure.at(self.q(u))
        return sqrt(2 * y / float(g @ (self.model.masses * g)))

    def _reduced(self, t: float, q: float, qdot: float) -> tuple[float, float]:
        """I* = g^T M g and M* = g^T Q at a position and speed of the driver."""
        x, g = self.closure.at(q)
        return float(g @ (self.model.masses * g)), float(g @ self.model.forces(t, self.model.state(x, g * qdot)))


# -- the four routes: which state each integrates, and how all bodies follow from it -----------------------------------


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


def by_driver(model: Model, start: Start, until: float, rtol: float, newton: bool) -> Followed:
    """The driver's coordinate, speed and the work done as state; poses closed at every driver's coordinate.

    Its acceleration is that of one reduced equation, I* and M* by the closures' influence coefficients; or by Newton's law,
    together with all reactions.
    """
    closure = Closure(model, start.x)

    def carried(q: float, qdot: float) -> State:
        x, g = closure.at(q)
        return model.state(x, g * qdot)

    def rates(t: float, y: Array) -> Array:
        q, qdot = float(y[0]), float(y[1])
        if newton:
            state = carried(q, qdot)
            acceleration = float(state.along @ by_newton(model, t, state).accelerations) + state.bend
            return np.array([qdot, acceleration, float(closure.g @ model.forces(t, state)) * qdot])
        found = reduced(model, t, *closure.at(q), qdot)
        return np.array([qdot, found.acceleration, found.moment * qdot])

    unit = model.length if model.linkage.sliding else 1.0
    atol = np.array([rtol * unit, rtol * unit, np.inf])
    steps = stepped(rates, np.array([start.q, start.qdot, 0.0]), until, rtol, atol)

    def state(t: float) -> State:
        return carried(*steps.at(t)[:2].tolist())

    return Followed(steps.s, steps.states[:, 2], steps.evaluations, 0.0, state, by_newton if newton else None)


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

    atol = rtol * np.concatenate((model.scale, model.scale, [np.inf]))
    steps = stepped(rates, np.concatenate((x, g * start.qdot, [0.0])), until, rtol, atol, correct)

    def state(t: float) -> State:
        return model.state(*projected(model, *split(steps.at(t)))[:2])

    return Followed(steps.s, steps.states[:, 2 * n], steps.evaluations, max(drifts), state, by_multipliers)


def by_energy(model: Model, start: Start, until: float, rtol: float) -> Followed:
    """Energy and time as state over the driver's way, until the time is reached or passed."""
    way = Way(model, start.x, start.q, start.qdot)
    atol = np.array([0.0, rtol * until])
    steps = stepped(way.rates, np.array([way.y, 0.0]), np.inf, rtol, atol, None, lambda both: both[1] >= until)

    def reached(t: float) -> float:
        """The parameter u of the way at a time."""
        if t <= 0.0:
            return 0.0
        k = min(max(int(np.searchsorted(steps.states[:, 1], t)), 1), len(steps.s) - 1)
        low, high = float(steps.s[k - 1]), float(steps.s[k])

        def late(u: float) -> float:
            return float(steps.dense[k - 1](u)[1]) - t

        return low if late(low) >= 0.0 else instant(late, low, high)

    def state(t: float) -> State:
        u = reached(t)
        return way.state(u, float(steps.at(u)[0]))

    return Followed(np.append(steps.states[:-1, 1], until), None, steps.evaluations, 0.0, state, None)


FOLLOW: dict[str, Callable[[Model, Start, float, float], Followed]] = {
    REDUCED: partial(by_driver, newton=False),
    NEWTON: partial(by_driver, newton=True),
    MULTIPLIERS: by_lagranges_multipliers,
    ENERGY: by_energy,
}
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
    if start is None:
        from flywheel.mechanisms.linkages.positions import solve_over  # only motions without given poses need it

        start = solve_over(linkage, (linkage.start, q)).poses(q)
    x = coordinates(start)
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
    laws: dict[str, Law] = {"drive": drive}
    for k, wrench in enumerate(given):
        path = f"wrenches[{k}]"
        require(path, wrench, Wrench, "a Wrench")
        if wrench.at is not None and not isinstance(wrench.at, str):
            vector(f"{path}.at", wrench.at, "m")
        if not isinstance(wrench.force, (tuple, list)) or len(wrench.force) != 2:
            raise SceneError([Fault(f"{path}.force", shown(wrench.force), "two laws, along x and y")])
        laws |= {f"{path}.force[{k}]": law for k, law in enumerate(wrench.force)} | {f"{path}.torque": wrench.torque}
    refuse([fault for path, law in laws.items() if not callable(law) for fault in number_faults(path, law)])
    return Actions((0.0, 0.0) if gravity is None else vector("gravity", gravity, "m/s²"), drive, given)


def _run(prepared: Model, route: str, found: Followed) -> Run:
    """What a motion says at its own times."""
    states = [found.state(float(t)) for t in found.t]
    poses, speeds = (np.array([[place[k : k + 3] for place in state.places[1:]] for state in states]) for k in (0, 5))

    def driver(states: list[State]) -> tuple[Array, Array]:
        return np.array([state.q for state in states]), np.array([state.qdot for state in states])

    def at(times: ArrayLike) -> tuple[Array, Array]:
        return driver([found.state(float(t)) for t in np.atleast_1d(array("times", times))])

    residual = None
    if found.work is not None:
        kinetic = 0.5 * (speeds.reshape(len(speeds), -1) ** 2 @ prepared.masses)
        residual = float(np.abs(kinetic - kinetic[0] - found.work).max() / max(float(kinetic.max()), 1e-300))
    return Run(
        route,
        found.t,
        *driver(states),
        poses,
        speeds,
        reactions=_reactions(prepared, found, states),
        drift=found.drift,
        closure=max(float(np.abs(state.value).max(initial=0.0)) for state in states),
        energy_residual=residual,
        evaluations=found.evaluations,
        at=at,
    )


def _reactions(prepared: Model, found: Followed, states: list[State]) -> dict[str, Array] | None:
    """Reactions by joint; NaN where a redundant linkage leaves them open: those with a part in the null space of Phi_x^T."""
    if found.law is None:
        return None
    rows = []
    for t, state in zip(found.t, states, strict=True):
        row = found.law(prepared, float(t), state).reactions
        if prepared.redundant:
            left, sizes, _ = np.linalg.svd(state.jacobian)
            rank = int((sizes > _RANK * sizes.max()).sum())
            row = np.where(np.abs(left[:, rank:]).max(axis=1, initial=0.0) > _RANK, np.nan, row)
        rows.append(row)
    table, names = np.array(rows), [joint for joint, _ in components(prepared.linkage)]
    return {name: table[:, [k for k, joint in enumerate(names) if joint == name]] for name in dict.fromkeys(names)}
