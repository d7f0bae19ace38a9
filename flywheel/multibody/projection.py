"""Coordinates and velocities put back onto the closure equations, by the shift of least kinetic measure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault
from flywheel.multibody.closure import LEAST_MARGIN, UnreachableError, branched, margin, solved
from flywheel.multibody.model import Model, State

Array = NDArray[np.float64]

_CLOSED = 4e-16  # of the scale: what rounding leaves open
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
        if left <= _CLOSED * model.length:
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
