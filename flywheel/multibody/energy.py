"""The energy route: the kinetic energy as an integral of work over the driver's way, then the time that it took.

E = ½ I* omega² obeys dE/dq = M*(t, q, omega): where torques depend on position alone, E is the work done and nothing
else; then t = integral of dq/omega. Only first influence coefficients are needed. It works as long as omega keeps its
sign.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flywheel.faults import Fault, SceneError
from flywheel.multibody.closure import Closure, UnreachableError, where
from flywheel.multibody.model import Model, State
from flywheel.multibody.stepping import Steps, Tolerance, stepped

Array = NDArray[np.float64]

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
    if steps.dense[k - 1](high)[1] <= t:
        return high
    return float(brentq(lambda u: steps.dense[k - 1](u)[1] - t, low, high, xtol=1e-15, rtol=1e-14))


def _stopped(model: Model, q: float) -> Fault:
    advice = "take another route, or end before"
    return Fault(
        "route", f"a motion that stops at {where(model, q)}", "a speed that keeps its sign on the energy route", advice
    )
