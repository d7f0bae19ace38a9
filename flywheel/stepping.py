"""Time stepping through the smooth pieces of a machine, restarted at the end of each.

Within a piece the loads are continued smoothly past its end, so that the step which finds the end keeps its order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.piecewise import ROUNDING

Array = NDArray[np.float64]
Rates = Callable[[float, Array], Array]

TIGHTEST = 3e-14  # tolerance of a step: below it the integrator's own rounding wins
_INSET = 1e-10  # of a piece: how far from its ends a law is read that is not defined there


class Step(NamedTuple):
    """One accepted step: its dense output and the time it covers."""

    dense: Callable[[Any], Array]
    start: float
    end: float


def reduced_at(
    machine: Machine, phi: float, middle: float, balance: float, ends: tuple[float, float] | None
) -> tuple[float, float, float]:
    """I*, dI*/dphi, M*; where a law stops being defined at a piece's end or past it, its value just inside.

    Past the end of a stroke, where a step that finds the end may try, there is no mechanism: I* goes on along its tangent.
    """
    cycle = machine.scene.cycle
    if machine.scene.stroke is not None and not 0.0 <= phi <= cycle:
        end = 0.0 if phi < 0.0 else cycle
        inertia, slope, moment = reduced_at(machine, end, middle, balance, ends)
        return inertia + slope * (phi - end), slope, moment
    reduced = machine.reduction(phi, middle)
    moment = float(reduced.moment + balance * reduced.per_unknown)
    if ends is not None and not math.isfinite(moment):
        inset = max(_INSET * (ends[1] - ends[0]), 64 * ROUNDING * ends[1])
        return reduced_at(machine, min(max(phi, ends[0] + inset), ends[1] - inset), middle, balance, None)
    return float(reduced.inertia), float(reduced.slope), moment


class Tolerance(NamedTuple):
    """Error allowed in a step: relative, and absolute for each variable."""

    relative: float
    absolute: Array


def through(
    rates: Rates,
    t: float,
    state: Array,
    ends: tuple[float, float],
    until: float,
    tolerance: Tolerance,
    hint: float | None,
) -> Iterator[Step]:
    """Steps from a state until phi leaves (low, high) or t reaches `until`; the last one ends exactly there."""
    low, high = ends
    first = min(1.1 * hint, until - t) if hint else None  # a little more, so that an equal piece takes one step too
    absolute: Any = tolerance.absolute  # one for each variable, which the stubs do not know
    solver: Any = DOP853(rates, t, state, until, rtol=tolerance.relative, atol=absolute, first_step=first)
    while solver.status == "running":
        pace = float(solver.f[0])
        _hold_back(solver, high if pace >= 0.0 else low)
        message = solver.step()
        if solver.status == "failed":
            raise SceneError([Fault("simulation", str(message), "a motion that can be followed")])
        step = Step(solver.dense_output(), float(solver.t_old), float(solver.t))
        left = _left(rates, step, pace, float(solver.f[0]), ends)
        yield step if left is None else step._replace(end=left)
        if left is not None:
            return


def _left(rates: Rates, step: Step, before: float, after: float, ends: tuple[float, float]) -> float | None:
    """When phi leaves the piece within a step; also where it would turn back, past the end, before the step is over."""
    start = step.start
    for stop in _turning(rates, step, before, after), step.end:
        phi = float(step.dense(stop)[0])
        if phi >= ends[1] or phi < ends[0]:
            return _passage(step.dense, start, stop, ends[1] if phi >= ends[1] else ends[0])
        start = stop
    return None


def _turning(rates: Rates, step: Step, before: float, after: float) -> float:
    """When phi turns back within a step; the step's end if it does not."""
    if before * after >= 0.0:
        return step.end
    return float(brentq(lambda t: rates(t, step.dense(t))[0], step.start, step.end))


def _hold_back(solver: Any, end: float) -> None:
    """Keep the next step from running far past the piece's end, where the laws are only continued."""
    pace = abs(solver.f[0])
    if pace > 0.0:
        solver.h_abs = min(solver.h_abs, max(1.05 * abs(end - solver.y[0]) / pace, 1e-9 * abs(solver.t - solver.t_bound)))


def _passage(dense: Callable[[Any], Array], start: float, stop: float, end: float) -> float:
    """When phi passes `end` within a step."""

    def beyond(t: float) -> float:
        return float(dense(t)[0]) - end

    if beyond(start) * beyond(stop) >= 0.0:
        return stop
    return float(brentq(beyond, start, stop, xtol=4 * ROUNDING * max(abs(stop), 1e-300), rtol=4 * ROUNDING))
