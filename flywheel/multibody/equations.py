"""The equations of motion of a linkage: Newton's law with reactions, Lagrange's multipliers, one reduced coordinate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault
from flywheel.linkage.description import FIXED, PIN, SLIDE, Coupling
from flywheel.multibody.closure import UnreachableError, bending, solved, where
from flywheel.multibody.model import Model, State
from flywheel.multibody.relations import COMPONENTS, Pair, Place, coordinate, drive, turned

Array = NDArray[np.float64]


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
