"""The four routes: which state each integrates, and how all bodies follow from it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.multibody.closure import Closure
from flywheel.multibody.energy import Way, reached, traversed
from flywheel.multibody.equations import Accelerations, by_multipliers, by_newton, reduced
from flywheel.multibody.model import Model, State
from flywheel.multibody.projection import Branch, projected
from flywheel.multibody.stepping import Rates, Tolerance, stepped

Array = NDArray[np.float64]

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
