"""Bodies of a plane linkage in absolute coordinates: closure, equations of motion as a linear system, steps in time.

All bodies keep their absolute coordinates, the pose x, y (m), theta (rad) of their centres of mass; joints are equations
between them. Every relation phi of two poses gives its value, its gradient, and its bend (phi_x v)_x v, the part of its
second time derivative that needs no accelerations: d²phi/dt² = phi_x a + bend.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import acos, floor, isfinite
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv

from bondgraph.motion.runge_kutta import DormandPrince, MethodStep
from bondgraph.motion.stepping import TIGHTEST
from flywheel.mechanisms.linkages.equations import Poses, lift_at
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, fit
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import FIXED, PIN, SLIDE, SLOT, Coupling, Linkage

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

COMPONENTS = {PIN: ("x", "y"), SLIDE: ("normal", "moment"), SLOT: ("normal",), FIXED: ("x", "y", "moment")}
"""Action of the first body on the second through each kind of joint, at the second's point.

x, y: forces along the frame's axes (N); normal: force across the guide, positive to the left of its direction (N);
moment: positive counter-clockwise (N m). The first body feels the opposite at the same place.
"""

Law = float | Callable[[float, float, float], float]
"""A constant, or a function of time (s), the driver's coordinate (rad or m) and its rate."""

RANK = 1e-9  # of the largest: a singular value below it is zero


class Wrench(NamedTuple):
    """Action on a body from outside: a force along the frame's x and y (N) at one of its points, a torque (N m).

    `at` names a point of the body, or is a place in its own frame (m); the centre of mass if None.
    """

    body: str
    force: tuple[Law, Law] = (0.0, 0.0)
    torque: Law = 0.0
    at: str | tuple[float, float] | None = None


class LinkageActions(NamedTuple):
    """Loads of a linkage: gravity (m/s²), the driver's torque (N m) or force (N), wrenches on bodies."""

    gravity: tuple[float, float] = (0.0, 0.0)
    drive: Law = 0.0
    wrenches: tuple[Wrench, ...] = ()


class LinkageState(NamedTuple):
    """A linkage at coordinates x and velocities v, shape (3 moving bodies,), or at many at once, shape (n, 3 bodies).

    Of many states everything has an additional first axis. value: residual of the closure equations Phi(x) (m or rad), shape
    (equations,); jacobian Phi_x; gamma = -(Phi_x v)_x v, so that Phi_x a = gamma. `q`, `qdot`, `along` and `bend` are the
    driver's coordinate, rate, gradient and bend. `slips`: gradients of the coordinates of joints with friction, then, where
    any joint has friction, of the couplings' first ones. `turns`: exp(i theta) of all moving bodies. `slopes`: of every
    coupling's second coordinate by its first.
    """

    x: Array
    v: Array
    value: Array
    jacobian: Array
    gamma: Array
    q: Any
    qdot: Any
    along: Array
    bend: Any
    slips: Array
    turns: Complex
    slopes: list[Any]


class UnreachableError(ValueError):
    """A state that no motion of the linkage reaches; `fault` has the reason."""

    def __init__(self, fault: Fault) -> None:
        self.fault = fault
        super().__init__(str(fault))


class LinkageModel:
    """A linkage with its actions, prepared for the routes at a closed pose `start` of coordinates x, shape (3 bodies,).

    masses: m, m, J of every moving body, shape (3 bodies,); scale: size of each coordinate, the linkage's largest length (m)
    and 1 rad; redundant: some closure equations follow from others, so that not all reactions are determined.

    Its relations are the components that joints keep at zero, then the second coordinates of all couplings, which they tie
    to the first, then those first ones, then the driver's, then those of all joints with friction.
    Each is the component e · d of the gap d from the joint's point on the first body to that on the second, or the second
    body's angle less the first's. The direction e is fixed, or turns with the first body.
    """

    def __init__(self, linkage: Linkage, actions: LinkageActions, start: Array) -> None:
        self.linkage, self.actions, self.start = linkage, actions, start
        self.masses = np.array(
            [part for link in linkage.links for part in (link.mass, link.mass, link.inertia)], dtype=float
        )
        self.inertia = np.diag(self.masses)
        kept = [(joint, part) for joint in linkage.joints for part in COMPONENTS[joint.kind]]
        couplings = linkage.couplings
        self.rough = [joint for joint in linkage.joints if joint.friction > 0.0]
        names = *(coupling.second for coupling in couplings), *(coupling.first for coupling in couplings), linkage.driver
        moving = [*(linkage.joint(name) for name in names), *self.rough]
        rows = [*kept, *((joint, "moment" if joint.kind == PIN else "along") for joint in moving)]
        sides = [((joint.first, joint.first_at), (joint.second, joint.second_at)) for joint, _ in rows]
        self.ends = np.array([[linkage.names.index(body) for body, _ in pair] for pair in sides]).T
        self.arms = np.array(
            [[complex(*at[1:]) - complex(*linkage.link(body).com) for body, at in pair] for pair in sides]
        ).T
        turning = np.array([part in ("normal", "along") for _, part in rows])
        self.angular = np.array([float(part == "moment") for _, part in rows])
        axes = {"x": 1.0, "y": 1j, "normal": 1j, "along": 1.0, "moment": 0.0}
        angles = turning * np.array([joint.direction for joint, _ in rows])
        ways = np.array([axes[part] for _, part in rows]) * np.exp(1j * angles)
        self.kept, self.closures = len(kept), len(kept) + len(couplings)
        self.angles = np.array(
            [joint.angle if part == "moment" and k < self.kept else 0.0 for k, (joint, part) in enumerate(rows)]
        )
        self.whole = 2 * np.pi * self.angular * (np.arange(len(rows)) < self.kept)
        self.length = float(np.abs([self.arms.real, self.arms.imag]).max()) or 1.0
        self.unit = self.length if linkage.sliding else 1.0
        bodies = len(linkage.links)
        every = np.arange(len(rows))
        joined, turned = np.zeros((len(rows), 2, bodies + 1), dtype=complex), np.zeros((len(rows), bodies + 1), complex)
        for sign, end, arm in zip((-1.0, 1.0), self.ends, self.arms, strict=True):
            joined[every, 0, end], joined[every, 1, end] = sign, sign * arm
        turned[every, self.ends[0]] = turning * ways
        fixed = np.array((complex(*linkage.ground.com), 1.0))  # the frame's centre and turn
        self.gap, self.still = joined[:, :, 0] @ fixed, turned[:, 0] + ~turning * ways
        steady, self.swung, self.turned = joined[:, 0, 1:].real, joined[:, 1, 1:], turned[:, 1:]  # by centres and turns
        self.apart = self.angular[:, None] * steady  # of the angle of second less first
        self.linear = np.zeros((len(rows), 3 * bodies))  # gradients where directions stand still and arms do not turn
        self.linear[:, 0::3], self.linear[:, 1::3] = self.still.real[:, None] * steady, self.still.imag[:, None] * steady
        self.linear[:, 2::3] = self.apart
        self.across = self.linear.T.copy()
        self.begin = (self.still.conj() * self.gap).real - self.angles
        self.swing = self.still.conj()[:, None] * self.swung
        self.guides = np.flatnonzero(self.turned.any(axis=1))  # relations whose direction turns with a moving body
        ahead = self.closures + len(couplings)
        self.slipping = [*range(ahead + 1, len(rows)), *(range(self.closures, ahead) if linkage.rubs else ())]
        self.steady, self.rigid = steady[self.guides], np.flatnonzero(self.whole)
        self.scale = np.tile((self.length, self.length, 1.0), bodies)
        self.weights = self.masses * np.tile((*actions.gravity, 0.0), bodies)
        self.loads: list[tuple[int, complex]] = []
        self.laws: list[Law] = [actions.drive]
        for wrench in actions.wrenches:
            link = linkage.link(wrench.body)
            at = link.com if wrench.at is None else wrench.at
            place = link.point(at)[-2:] if isinstance(at, str) else at
            self.loads.append((linkage.names.index(wrench.body), complex(*place) - complex(*link.com)))
            self.laws += [*wrench.force, wrench.torque]
        self.constant = np.array([0.0 if callable(law) else float(law) for law in self.laws])
        self.varying = [(k, law) for k, law in enumerate(self.laws) if callable(law)]
        jacobian = self.state(start, np.zeros_like(start)).jacobian
        self.redundant = bool(np.linalg.matrix_rank(jacobian, rtol=RANK) < len(jacobian))

    def state(self, x: Array, v: Array | None = None) -> LinkageState:
        """The closure equations and the driver's coordinate at x with velocities v (none if None), of one pose or of many.

        With arms a1, a2, directions e and gap d = x2 + a2 - x1 - a1 as complex numbers, e · d = Re(e* d) has the gradient
        (-e, e × (a1 + d)) by the first pose where e turns, (-e, e × a1) where it stands still, and (e, -e × a2) by the
        second. Its bend is e · (omega1² a1 - omega2² a2), and where e turns 2 omega1 e_perp · d' - omega1² e · d besides.
        """
        turns = np.exp(1j * x[..., 2::3])
        arms = self.swing * turns[..., None, :]
        lengths = arms.real.copy()
        value = x @ self.across + lengths.sum(axis=-1) + self.begin
        gradient = np.empty((*value.shape, x.shape[-1]))
        gradient[...] = self.linear
        gradient[..., 2::3] -= arms.imag
        if v is None:
            v, bend = np.zeros_like(x), np.zeros_like(value)
        else:
            squares = v[..., 2::3] ** 2  # one state, or many with a matrix each
            bend = -np.asarray(lengths @ squares if squares.ndim == 1 else (lengths @ squares[..., None])[..., 0])
        if self.guides.size:
            self._turning(x, v, turns, value, gradient, bend)
        if self.rigid.size:
            kept = value[..., self.rigid]
            if abs(kept).max() > np.pi:
                value[..., self.rigid] = kept - 2 * np.pi * (kept / (2 * np.pi)).round()  # less whole turns
        slopes = []
        for k, coupling in enumerate(self.linkage.couplings, self.kept):  # q2 - f(q1)
            first_one = k + len(self.linkage.couplings)
            driven, slope, curvature = _coupled(coupling, value[..., first_one])
            slopes.append(slope)
            value[..., k] -= driven
            bend[..., k] -= slope * bend[..., first_one] + curvature * _dot(gradient[..., first_one, :], v) ** 2
            gradient[..., k, :] -= slope[..., None] * gradient[..., first_one, :]
        count, driver = self.closures, self.closures + len(self.linkage.couplings)
        along = gradient[..., driver, :]
        return LinkageState(
            x=x,
            v=v,
            value=value[..., :count],
            jacobian=gradient[..., :count, :],
            gamma=-bend[..., :count],
            q=value[..., driver],
            qdot=_dot(along, v),
            along=along,
            bend=bend[..., driver],
            slips=gradient[..., self.slipping, :],
            turns=turns,
            slopes=slopes,
        )

    def _turning(self, x: Array, v: Array, turns: Complex, value: Array, gradient: Array, bend: Array) -> None:
        """Puts in the relations whose direction turns with a moving body: slides and slots on it."""
        which, steady = self.guides, self.steady
        swung, turned = self.swung[which], self.turned[which]
        directions = turns @ turned.T
        gap = (x[..., 0::3] + 1j * x[..., 1::3]) @ steady.T + turns @ swung.T + self.gap[which]
        value[..., which] = (directions.conj() * gap).real - self.angles[which]
        entries = np.empty((*directions.shape, x.shape[-1]))
        entries[..., 0::3], entries[..., 1::3] = directions.real[..., None] * steady, directions.imag[..., None] * steady
        sweep = directions.conj()[..., None] * swung + gap.conj()[..., None] * turned
        entries[..., 2::3] = self.apart[which] - (sweep * turns[..., None, :]).imag
        gradient[..., which, :] = entries
        once = 1j * v[..., 2::3] * turns  # first and second derivative of the turns
        twice = 1j * v[..., 2::3] * once
        speed = (v[..., 0::3] + 1j * v[..., 1::3]) @ steady.T + once @ swung.T
        bend[..., which] = (
            directions.conj() * (twice @ swung.T) + 2 * (once @ turned.T).conj() * speed + (twice @ turned.T).conj() * gap
        ).real

    def amounts(self, t: float, q: float, qdot: float) -> Array:
        """Values of all laws: of the drive, and of every wrench's force along x and y and torque."""
        if not self.varying:
            return self.constant
        amounts = self.constant.copy()
        for k, law in self.varying:
            amounts[k] = law(t, q, qdot)
        return amounts

    def forces(self, t: Any, state: LinkageState) -> Array:
        """Generalised forces of gravity, drive and wrenches on every coordinate, shape (3 moving bodies,)."""
        if state.x.ndim == 1:
            return self.forces_by(state, self.amounts(t, float(state.q), float(state.qdot)))
        instants = zip(t.tolist(), state.q.tolist(), state.qdot.tolist(), strict=True)
        return self.forces_by(state, np.array([self.amounts(*one) for one in instants]))

    def forces_by(self, state: LinkageState, amounts: Array) -> Array:
        """The same by the values of all laws; with a further axis for many states, also of the values."""
        total = self.weights + amounts[..., :1] * state.along
        for j, (k, arm) in enumerate(self.loads):
            parts = amounts[..., 3 * j + 1 : 3 * j + 4]
            force = parts[..., 0] + 1j * parts[..., 1]
            total[..., 3 * k - 3] += parts[..., 0]
            total[..., 3 * k - 2] += parts[..., 1]
            total[..., 3 * k - 1] += ((state.turns[..., k - 1] * arm).conjugate() * force).imag + parts[..., 2]
        return np.asarray(total)

    def load_columns(self, state: LinkageState) -> Array:
        """Forces of all that is constant, then of a unit of every law that varies: (n, 3 bodies, columns)."""
        constant = self.forces_by(state, np.tile(self.constant, (len(state.x), 1)))
        units = [np.tile(np.arange(self.constant.size) == k, (len(state.x), 1)) for k, _ in self.varying]
        return np.stack([constant, *(self.forces_by(state, unit) - self.weights for unit in units)], axis=-1)

    def load_amounts(self, t: float, q: float, qdot: float) -> list[float]:
        """Factors of the columns: 1, then the value of every law that varies."""
        return [1.0, *[law(t, q, qdot) for _, law in self.varying]]

    def reaction_wrenches(self, state: LinkageState) -> Array:
        """Effect of a unit of every reaction on every coordinate, from free bodies, shape (3 bodies, equations).

        A force f at the joint's point p acts on the second body as f and (p - c) × f about its centre c, on the first as
        the opposite. A coupling's effort acts on its second coordinate, and reversed, times its ratio, on its first: a
        couple at a pin, a force along the guide at a slide.
        """
        frame = np.ones((*state.x.shape[:-1], 1))
        moving = state.x[..., 0::3] + 1j * state.x[..., 1::3]
        centres = np.concatenate((complex(*self.linkage.ground.com) * frame, moving), axis=-1)
        turns = np.concatenate((frame, state.turns), axis=-1)
        forces, rows = state.turns @ self.turned.T + self.still, len(self.gap)
        places = (centres[..., self.ends] + turns[..., self.ends] * self.arms)[..., 1, :]
        wrenches = np.zeros((*forces.shape, centres.shape[-1], 3))
        for sign, end in zip((-1.0, 1.0), self.ends, strict=True):
            moments = ((places - centres[..., end]).conj() * forces).imag + self.angular
            wrenches[..., np.arange(rows), end, :] = sign * np.stack((forces.real, forces.imag, moments), axis=-1)
        wrenches = wrenches.reshape(*forces.shape, -1)
        for k, slope in enumerate(state.slopes, self.kept):
            wrenches[..., k, :] -= slope[..., None] * wrenches[..., k + len(state.slopes), :]
        return np.swapaxes(wrenches[..., : self.closures, 3:], -1, -2)

    def solved(self, matrix: Array, right: Array) -> Array:
        """Solution of a linear system, right sides as columns if there are many systems.

        It is one by least squares where redundant closures make systems consistent but singular.
        """
        try:
            if self.redundant:
                return np.asarray(np.linalg.pinv(matrix, rcond=1e-12) @ right)
            if matrix.ndim > 2:
                return np.asarray(np.linalg.solve(matrix, right))
            *_, solution, singular = dgesv(matrix, right)
            if not singular:
                return np.asarray(solution)
        except np.linalg.LinAlgError:
            pass
        solution = "a position where joints or masses leave the motion open"
        raise UnreachableError(Fault(self.linkage.path, solution, "a motion that is determined", "end before it"))

    def driven(self, state: LinkageState, row: Array, right: Array, last: Array | float) -> Array:
        """The change of all coordinates with Phi_x d = right, row · d = last."""
        matrix = np.concatenate((state.jacobian, row[..., None, :]), axis=-2)
        rates = np.empty(matrix.shape[:-1])
        rates[..., :-1], rates[..., -1] = right, last
        if rates.ndim == 1:
            return self.solved(matrix, rates)
        return self.solved(matrix, rates[..., None])[..., 0]

    def influence(self, state: LinkageState, row: Array) -> Array:
        """The change of all coordinates that keeps the closures and makes `row` 1: Phi_x g = 0, row · g = 1."""
        return self.driven(state, row, np.zeros(state.value.shape), 1.0)

    def margin(self, state: LinkageState, row: Array) -> Any:
        """Distance of the closures from a lock or branch, with one more row along the motion.

        The smallest singular value of both, of rows of length 1.
        """
        rows = np.concatenate((state.jacobian, row[..., None, :]), axis=-2) * self.scale
        rows /= np.sqrt((rows * rows).sum(axis=-1, keepdims=True))
        return np.linalg.svd(rows, compute_uv=False)[..., -1]

    def sense(self, state: LinkageState, row: Array) -> Any:
        """Sign of the determinant of the same rows, which changes where assemblies meet.

        It is 0 if redundant closures leave no square matrix.
        """
        if self.redundant:
            return np.zeros(state.q.shape)
        return np.linalg.slogdet(np.concatenate((state.jacobian, row[..., None, :]), axis=-2) * self.scale)[0]

    def heavy(self, inertia: float, q: float) -> None:
        """Refuses a reduced inertia that is not above 0."""
        if not inertia > 0.0:
            defect = f"I* = {inertia:g} at {self.where(q)}"
            raise UnreachableError(Fault(self.linkage.path, defect, "an inertia above 0", "give a body mass"))

    def where(self, q: float) -> str:
        """A driver's coordinate with its unit, for messages."""
        return f"{q:.9g} m" if self.linkage.sliding else f"{np.degrees(q):.9g} deg"

    def locked(self, q: float) -> UnreachableError:
        """A linkage that cannot follow its driver; in a dead centre of the driver its other bodies may continue."""
        advice = "the route multipliers follows a motion through a dead centre of the driver"
        defect, expected = f"a lock at {self.where(q)}", "a motion that the joints allow"
        return UnreachableError(Fault(f"{self.linkage.path}.driver", defect, expected, advice))

    def branched(self, q: float) -> UnreachableError:
        """Assemblies that meet, so that the motion may continue in either."""
        defect = f"assemblies that meet at or just past {self.where(q)}"
        advice = "change a length, or end before"
        return UnreachableError(Fault(self.linkage.path, defect, "a motion within one assembly", advice))


def _dot(a: Array, b: Array) -> Any:
    """Sum of products along the last axis."""
    return a @ b if a.ndim == 1 else (a * b).sum(axis=-1)


def _coupled(coupling: Coupling, q: Array) -> tuple[Array, Array, Array]:
    """A coupling's second coordinate by its first, with two derivatives: ratio q + phase, or a cam's lift(q) + phase."""
    if coupling.lift is None:
        return coupling.ratio * q + coupling.phase, np.full(np.shape(q), coupling.ratio), np.zeros(np.shape(q))
    lift, slope, curvature = lift_at(coupling.lift, np.asarray(q))
    return lift + coupling.phase, slope, curvature


def coordinates(poses: Poses) -> Array:
    """Absolute coordinates x_G, y_G, theta of every moving body at the first of the poses, shape (3 bodies,)."""
    names = [link.name for link in poses.linkage.links]
    rows = [(*poses.centre(name).value[:, 0], poses.angle(name).value[0]) for name in names]
    return np.array(rows, dtype=float).ravel()


def components(linkage: Linkage) -> list[tuple[str, str]]:
    """Joint and component of every reaction, in the order of the closure equations; couplings have one `effort` each.

    A coupling's effort is that on its second coordinate: a moment (N m) at a pin, a force (N) along a slide. It replaces the
    contact force in its work only: the pins' reactions are right only with the contact force itself.
    """
    names = [(joint.name, part) for joint in linkage.joints for part in COMPONENTS[joint.kind]]
    return names + [(coupling.name, "effort") for coupling in linkage.couplings]


# -- closure: poses at a driver's coordinate, from the closure equations alone ------------------------------------------

_CLOSED = 1e-9  # of the scale: after a correction this small the next one, its square, is below rounding
_CONTRACTION = 0.25  # of each correction to the one before, and of the first to the step itself
_MOST_CORRECTIONS = 8
_SMALLEST = 1e-7  # of the scale: a step of the driver below it that still fails has met a lock

LEAST_MARGIN = 5e-5  # below it rounding, divided by its square, spoils accelerations: a lock or a branch is met
_STUCK = 1e-2  # g times the margin: at a lock g grows as the margin shrinks, at a branch it does not


class Closure:
    """Poses that follow the driver's coordinate from the model's start, by tangent and Newton's method.

    It starts each time from the last pose; the result is exact to rounding and does not depend on that, as long
    as the path stays in one assembly. Steps are halved until every correction is at most a quarter of the one before, and
    doubled after.
    """

    def __init__(self, model: LinkageModel) -> None:
        self.model, self.x = model, model.start
        state = model.state(self.x)
        self.q, self.g = float(state.q), model.influence(state, state.along)
        self.sense = model.sense(state, state.along)

    def put(self, q: float, x: Array) -> None:
        """Continues from a known pose x at the driver's coordinate q."""
        state = self.model.state(x)
        self.q, self.x, self.g = q, x, self.model.influence(state, state.along)

    def at(self, q: float) -> tuple[Array, Array]:
        """Coordinates x at the driver's coordinate q, and their influence coefficients g = dx/dq.

        Raises:
            UnreachableError: if the linkage locks or branches before q.

        """
        model = self.model
        step = q - self.q
        while self.q != q:
            ahead = q if abs(step) >= abs(q - self.q) else self.q + step
            state = self.corrected(ahead, self.g * (ahead - self.q))  # along the tangent
            if state is None or model.sense(state, state.along) != self.sense:
                if abs(step) < _SMALLEST * model.unit:
                    raise model.locked(self.q) if state is None else model.branched(self.q)
                step *= 0.5
                continue
            g, least = model.influence(state, state.along), float(model.margin(state, state.along))
            if least < LEAST_MARGIN:
                stuck = float(np.abs(g / model.scale).max()) * model.unit * least > _STUCK
                raise model.locked(ahead) if stuck else model.branched(ahead)
            self.q, self.x, self.g = ahead, state.x, g
            step *= 2.0
        return self.x, self.g

    def corrected(self, q: Any, ahead: Array) -> LinkageState | None:
        """The poses at q by Newton's method from the last one and `ahead`; None if corrections shrink too slowly.

        One at a number q, or poses (n, coordinates) at q (n,).
        """
        model = self.model
        x, last = self.x + ahead, float(np.abs(ahead / model.scale).max())
        with suppress(UnreachableError):
            for _ in range(_MOST_CORRECTIONS):
                state = model.state(x)
                correction = model.driven(state, state.along, -state.value, q - state.q)
                size = float(np.abs(correction / model.scale).max())
                if not size <= max(_CONTRACTION * last, _CLOSED):
                    return None
                x, last = x + correction, size
                if size <= _CLOSED:
                    return model.state(x)
        return None


# -- what depends on the driver's position alone, as Chebyshev series --------------------------------------------------

_CELLS = 12  # in a turn of the driver, or where it slides in 2 pi lengths
_HALVINGS = 5  # of a cell, until positions in it are found one by one
_RESOLVED = 3e-14  # of its size: last coefficients of a series that counts as exact
_AGAIN = 1e-11  # of the scale: poses that are the same
_TERMS = np.arange(float(ORDER))


ScaledValues = tuple[Array, Array]
"""Values at many poses, shape (n, k), and the scales of their rounding errors, shape (k,)."""


class Interpolant:
    """Poses and a quantity derived from them, over the driver's coordinate, exact to rounding.

    They are computed at the Chebyshev nodes of cells, all at once, when the motion enters them; a cell is accepted if its
    ends are reached by the closure's own steps, all its poses are of the same assembly, and the series have decayed. It is
    halved otherwise; in the smallest cells (towards a lock, at a cam's break) every position is computed separately.
    """

    def __init__(self, model: LinkageModel, quantity: Callable[[LinkageModel, LinkageState], ScaledValues]) -> None:
        self.model, self.closure, self.quantity = model, Closure(model), quantity
        self.width = 2 * np.pi / _CELLS * model.unit
        self.origin = self.closure.q - 0.5 * self.width
        self.cells: dict[tuple[int, int], Array | None] = {}  # series by how often the cell is halved, and its number
        self.low = self.high = np.nan  # the cell that was come to last
        self.series: Array | None = None

    def at(self, q: float) -> Array:
        """The quantity at the driver's coordinate, shape (k,).

        Raises:
            UnreachableError: if the linkage locks or branches before.

        """
        if not self.low <= q <= self.high:
            self._enter(q)
        if self.series is None:
            x, g = self.closure.at(q)
            values, _ = self.quantity(self.model, self.model.state(x[None], g[None]))
            return np.asarray(values[0])
        return np.asarray(self._basis(q) @ self.series[:, self.model.masses.size :])

    def states(self, q: Array, qdot: Array) -> LinkageState:
        """All bodies at many coordinates and rates of the driver, poses closed to rounding."""
        model, x = self.model, np.empty((q.size, self.model.masses.size))
        for k, place in enumerate(q.tolist()):
            if not self.low <= place <= self.high:
                self._enter(place)
            x[k] = self.closure.at(place)[0] if self.series is None else self._pose(place)
        state = model.state(x)
        state = model.state(x + model.driven(state, state.along, -state.value, q - state.q))
        return model.state(state.x, model.influence(state, state.along) * qdot[:, None])

    def _pose(self, q: float) -> Array:
        """The coordinates at a place in the cell."""
        assert self.series is not None
        return np.asarray(self._basis(q) @ self.series[:, : self.model.masses.size])

    def _basis(self, q: float) -> Array:
        share = (2.0 * q - self.low - self.high) / (self.high - self.low)
        return np.cos(_TERMS * acos(min(max(share, -1.0), 1.0)))

    def _enter(self, q: float) -> None:
        """Enters the cell that contains q; it is computed when the motion first enters it."""
        left = None if self.series is None else (edge := self.low if q < self.low else self.high, self._pose(edge))
        for depth in range(_HALVINGS + 1):
            width = self.width / 2**depth
            k = floor((q - self.origin) / width)
            self.low, self.high = self.origin + k * width, self.origin + (k + 1) * width
            if (depth, k) not in self.cells:
                self.cells[depth, k] = None if depth else self._repeated(k)
                if self.cells[depth, k] is None:
                    if left:
                        self.closure.put(*left)
                        left = None
                    self.cells[depth, k] = self._fitted(self.low, self.high)
            self.series = self.cells[depth, k]
            if self.series is not None:
                return
        if left:
            self.closure.put(*left)

    def _repeated(self, k: int) -> Array | None:
        """The series of the cell a turn before, or after: the linkage repeats itself if its pose there returns."""
        if self.model.linkage.sliding or any(coupling.lift for coupling in self.model.linkage.couplings):
            return None
        for way in (1, -1):  # from which the motion comes: the cell's end there, in the cell beside and a turn off
            beside, before = self.cells.get((0, k - way)), self.cells.get((0, k - way * _CELLS))
            if beside is None or before is None:
                continue
            n, end = self.model.masses.size, float(way) ** _TERMS
            gone = end @ beside[:, :n] - (-1.0) ** _TERMS * end @ before[:, :n]
            whole = 2 * np.pi * np.round(gone / (2 * np.pi))
            whole[0::3] = whole[1::3] = 0.0
            if np.all(np.abs(gone - whole) < _AGAIN * self.model.scale):
                series = before.copy()
                series[0, :n] += whole
                return series
        return None

    def _fitted(self, low: float, high: float) -> Array | None:
        """Series over a cell, shape (ORDER, columns), x first; None if it has to be halved.

        From the pose known next to it by Newton's method at all nodes; the series, which have to decay and to come back to
        that pose, and the determinant's sign at the nodes keep it in its assembly.
        """
        model, closure = self.model, self.closure
        try:
            closure.at(min(max(closure.q, low), high))
            way = low + 0.5 * (high - low) * (1.0 + NODES) - closure.q
            begun = model.state(closure.x, closure.g)
            bend = model.driven(begun, begun.along, begun.gamma, -begun.bend)
            ahead = way[:, None] * closure.g + 0.5 * way[:, None] ** 2 * bend
            state = closure.corrected(closure.q + way, ahead)
            if state is None or np.any(model.sense(state, state.along) != closure.sense):
                return None
            some = state._replace(jacobian=state.jacobian[::4])
            worst = float(model.margin(some, state.along[::4]).min())
            if worst < LEAST_MARGIN:
                return None
            x = state.x
            values, sizes = self.quantity(model, model.state(x, model.influence(state, state.along)))
        except UnreachableError:
            return None
        scales = np.concatenate((np.maximum(model.scale, np.abs(x).max(axis=0)), sizes))
        series = fit(np.concatenate((x, values), axis=1).T)
        allowed = max(_RESOLVED, 4 * ROUNDING / worst**2)
        if np.any(np.abs(series[:, -3:]).max(axis=1) > allowed * scales):
            return None
        share = min(max((2.0 * closure.q - low - high) / (high - low), -1.0), 1.0)
        back = series[: closure.x.size] @ np.cos(_TERMS * acos(share)) - closure.x
        return series.T.copy() if np.all(np.abs(back) < _AGAIN * scales[: closure.x.size]) else None


# -- equations of motion as one linear system ------------------------------------------------------------------------------


def system(model: LinkageModel, forces: Array, state: LinkageState, wrenches: Array) -> tuple[Array, Array]:
    """Matrix and right side of [[M, -B], [Phi_x, 0]] (a, R) = (Q, gamma), of one state or of many.

    For the four-bar 9 accelerations and 8 reactions: 17 equations for 17 unknowns.
    """
    n, m = wrenches.shape[-2:]
    matrix = np.zeros((*state.x.shape[:-1], n + m, n + m))
    matrix[..., :n, :n] = model.inertia
    matrix[..., :n, n:] = -wrenches
    matrix[..., n:, :n] = state.jacobian
    return matrix, np.concatenate((forces, state.gamma), axis=-1)


def column_accelerations(
    model: LinkageModel, columns: Array, state: LinkageState, wrenches: Array, pushes: Array
) -> tuple[Array, Array, Array]:
    """Right sides by each column of loads, the speeds' squares and each push; their solutions; the driver's accelerations.

    columns: (states, 3 bodies, loads); wrenches: of unit reactions; pushes: likewise (states, 3 bodies, pushes).
    """
    n, loads = model.masses.size, columns.shape[2]
    matrix, _ = system(model, columns[..., 0], state, wrenches)
    right = np.zeros((*matrix.shape[:2], loads + 1 + pushes.shape[2]))
    right[:, :n, :loads], right[:, n:, loads], right[:, :n, loads + 1 :] = columns, state.gamma, pushes
    solution = model.solved(matrix, right)
    alpha = np.einsum("ni,nic->nc", state.along, solution[:, :n])
    alpha[:, loads] += state.bend
    return right, solution, alpha


def acceleration_sizes(model: LinkageModel, right: Array, solution: Array) -> Array:
    """Scales of the rounding errors of the driver's acceleration, for every column of right sides (n, equations, c).

    Those of all bodies, with joints and without; the driver's own may be zero.
    """
    n, masses = model.masses.size, np.where(model.masses > 0.0, model.masses, np.inf)
    every = np.maximum(np.abs(solution[:, :n]), np.abs(right[:, :n]) / masses[:, None]) / model.scale[:, None]
    bends = np.abs(right[:, n:]).max(axis=1, initial=0.0) / model.length
    return np.asarray(model.unit * np.maximum(every.max(axis=1), bends).max(axis=0))


def accelerations(model: LinkageModel, t: Any, state: LinkageState, wrenches: Array) -> tuple[Array, Array]:
    """Accelerations of every coordinate, shape (3 bodies,), and reactions, (equations,), by wrenches of unit reactions."""
    matrix, right = system(model, model.forces(t, state), state, wrenches)
    solution = model.solved(matrix, right) if right.ndim == 1 else model.solved(matrix, right[..., None])[..., 0]
    return solution[..., : model.masses.size], solution[..., model.masses.size :]


_PROJECTED = 4e-16  # of the length: rounding of a closure
_LOST = 1e-9  # of the length: greatest gap of a closure after all corrections
_CORRECTIONS = 4


def projection(model: LinkageModel, x: Array, v: Array) -> tuple[LinkageState, float]:
    """The state nearest in the kinetic measure d^T M d that fulfils Phi = 0 and Phi_x v = 0, and |Phi| before (m or rad).

    Raises:
        UnreachableError: if there is none nearby.

    Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section VII.2.

    """
    n = x.size

    def least(state: LinkageState, rates: Array) -> Array:
        """The change d of least d^T M d with Phi_x d = wanted."""
        change = state._replace(gamma=rates)
        return model.solved(*system(model, np.zeros(n), change, -state.jacobian.T))[:n]

    def gap(state: LinkageState) -> float:
        return float(np.abs(state.value).max(initial=0.0))

    state = model.state(x, v)
    drift = gap(state)
    for _ in range(_CORRECTIONS):
        if gap(state) <= _PROJECTED * model.length:
            break
        state = model.state(state.x + least(state, -state.value), v)
    left = gap(state)
    if not left <= _LOST * model.length:
        raise UnreachableError(
            Fault(model.linkage.path, f"loops that are open by {left:g} m or rad", "bodies that stay joined")
        )
    return model.state(state.x, v + least(state, -state.jacobian @ v)), drift


# -- stepping: the eighth order, with a correction after each step where a route asks for one --------------------------

_MOST_STEPS = 100_000
Rates = Callable[[float, Any], Array]
CREEPING = 1e-9  # of the way so far: steps below it, before what cannot be reached, have come to its edge
_PARTIAL_CREEPING = 1e-6  # the same where the steps until there are wanted


class AcceptedSteps:
    """Accepted steps: ends `s` and `states` there, from the start on; evaluations of the rates.

    fault: the reason if the motion ends early; else None.
    """

    def __init__(
        self,
        rates: Rates,
        s: Array,
        states: Array,
        evaluations: int,
        dense: Sequence[MethodStep] = (),
        fault: Fault | None = None,
    ) -> None:
        self.rates, self.s, self.states, self.evaluations, self.fault = rates, s, states, evaluations, fault
        self.dense = dict(enumerate(dense))

    def until(self, end: float) -> AcceptedSteps:
        """The steps up to `end`, or fewer."""
        count = max(int(np.searchsorted(self.s, end, side="right")), 2)
        dense = [self.dense[k] for k in range(count - 1)] if len(self.dense) >= count - 1 else ()
        return AcceptedSteps(self.rates, self.s[:count], self.states[:count], self.evaluations, dense, self.fault)

    def at(self, s: float) -> Array:
        """State at any s within, by the dense output of the step there; a step that was not kept is repeated."""
        k = min(int(np.searchsorted(self.s[1:], s)), len(self.s) - 2)
        if k not in self.dense:
            self.dense[k] = one_step(self.rates, float(self.s[k]), self.states[k], float(self.s[k + 1]))
        return self.dense[k](s)


def one_step(rates: Rates, low: float, state: Array, high: float) -> MethodStep:
    """A single step from low to high, whatever its error."""
    everything = [np.inf] * state.size
    step = DormandPrince(rates, low, state.tolist(), high, 1.0, everything, high - low).step()
    assert step is not None
    return step


def integrate(
    rates: Rates,
    state: Array,
    until: float,
    rtol: float,
    atol: Array,
    correct: Callable[[Array], Array] | None = None,
    reached: Callable[[Array], bool] | None = None,
    event: Callable[[float, float, Callable[[float], Array]], float | None] | None = None,
    begin: float = 0.0,
    dense: bool = False,
    longest: float = np.inf,
    partial: bool = False,
) -> AcceptedSteps:
    """Follows dy/ds = rates(s, y) from `begin` by the eighth order to `until`, or to the step after which `reached` is true.

    rtol, atol: error allowed in a step, relative, and absolute for each variable (infinite: ignored). `correct` returns a
    state to the closures after every step. Rates are NaN if no motion is possible, so that the
    integrator tries a shorter step; the reason is kept. `event` receives a step's ends and its dense output; if it returns a
    point within, the last step is repeated up to there. `dense`: keep all steps, if most will be evaluated. `longest`: of
    all steps. `partial`: if the motion ends early, return the steps so far, with the reason.

    Raises:
        SceneError: if the motion ends early, with the reason from the rates.

    Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., section II.5.

    """
    if not np.isfinite(rates(begin, state)).all():  # the start itself must be sound
        raise SceneError([Fault("simulate", "loads that are not finite at the start", "finite ones")])
    reason = Fault("rtol", "a motion that cannot be followed at this tolerance", "another one", "loosen it")
    barred, evaluations = False, 0  # whether a barred place was met since the last step that did not creep

    def guarded(s: float, state: Sequence[float]) -> Array:
        nonlocal reason, barred, evaluations
        evaluations += 1
        y = np.array(state)
        try:
            return rates(s, y) if isfinite(y.dot(y)) else np.full_like(y, np.nan)
        except UnreachableError as error:
            reason, barred = error.fault, True
            return np.full_like(y, np.nan)

    solver = DormandPrince(guarded, begin, state.tolist(), until, max(rtol, TIGHTEST), atol.tolist())
    s, states, kept = [begin], [np.array(state)], list[MethodStep]()
    while s[-1] < until and not (reached and reached(states[-1])):
        solver.h = min(solver.h, longest)
        step = solver.step()
        if step is not None and event is not None:
            end = event(s[-1], solver.t, step)
            if end is not None:
                until = max(end, float(np.nextafter(s[-1], np.inf)))  # where it happened at the step's own start
                step = one_step(guarded, s[-1], states[-1], until)
                solver.t, solver.y = until, step.after
        creeping = solver.t - s[-1] < (_PARTIAL_CREEPING if partial else CREEPING) * solver.t
        if step is None or (creeping and barred):
            if partial and len(s) > 1:
                return AcceptedSteps(guarded, np.array(s), np.array(states), evaluations, kept, reason)
            raise SceneError([reason])
        barred = barred and creeping
        if dense:
            kept.append(step)
        s.append(solver.t)
        states.append(np.array(solver.y) if correct is None else correct(np.array(solver.y)))
        if correct is not None and s[-1] < until:
            solver.y, solver.f = tuple(states[-1].tolist()), tuple(guarded(s[-1], states[-1].tolist()).tolist())
        if len(s) > _MOST_STEPS:
            raise SceneError([Fault("until", f"{_MOST_STEPS} steps that lead only to {s[-1]:.6g}", "a shorter way")])
    return AcceptedSteps(guarded, np.array(s), np.array(states), evaluations, kept)


class LinkageMotion(NamedTuple):
    """A motion: times, all bodies there, work done since the start (J; None on the energy route), evaluations.

    drift: greatest one of a step. `at(t)` gives the driver's coordinate and rate at any time; reactions: in the order of the
    closure equations, shape (times, equations), if the route computes them. friction, friction_work: by joint; rests: start
    and end (s) of each standstill; messages: a final one.
    """

    t: Array
    states: LinkageState
    work: Array | None
    evaluations: int
    drift: float
    at: Callable[[float], tuple[float, float]]
    reactions: Array | None = None
    friction: Mapping[str, Array] = MappingProxyType({})
    friction_work: Mapping[str, Array] = MappingProxyType({})
    rests: tuple[tuple[float, float], ...] = ()
    messages: tuple[str, ...] = ()
