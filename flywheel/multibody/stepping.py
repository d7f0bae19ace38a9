"""Time steps of the eighth order, with a correction after each where a route asks for one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from flywheel.faults import Fault, SceneError
from flywheel.multibody.closure import UnreachableError

Array = NDArray[np.float64]
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
