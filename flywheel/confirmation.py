"""The independent route: one steady cycle stepped in time confirms what a sizing promises.

Integrates (J + I*) alpha + ½ dI*/dphi omega² = M* on I* and M* straight from the bond graph, M* at the speed of the moment.
It shares no cell, quadrature or closed form with the sizing; the two are compared at the end, and that is the error
reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import steady
from flywheel.agreement import Found, confirmation, disagreement
from flywheel.cost import counted
from flywheel.faults import SceneError
from flywheel.instant import Dynamics
from flywheel.machine import Machine
from flywheel.one_cycle import SlidingError, one_cycle
from flywheel.piecewise import ROUNDING
from flywheel.regime import Cycle
from flywheel.results import Sizing
from flywheel.steady import NoMotionError, Run
from flywheel.stepping import TIGHTEST, Step

Array = NDArray[np.float64]

_HOPELESS = 0.5  # relative error past which a figure says nothing
_MOST = 60_000  # evaluations of a cycle, a few seconds: a textbook machine takes 2 000
_LEAST = 40  # of a piece


class UnconfirmedError(ValueError):
    """A cycle that stepping does not come through in bounds, or brings nothing home from; the message says why."""


class _Confirmed(NamedTuple):
    found: Found
    error: float
    period_error: float


def confirmed(sizing: Sizing) -> Sizing:
    """The sizing with one steady cycle stepped in time: with the exact (or given) flywheel, and with the approximate one.

    Raises:
        UnconfirmedError: where stepping takes too long, or loses the motion.
        SlidingError: where the motion slides along a law that jumps at a speed.
        SceneError: where no step is short enough.

    """
    machine, cycle, run = sizing.machine, sizing.cycle, sizing.run
    if machine is None or cycle is None:
        return sizing
    if run is None:
        return replace(sizing, messages=(*sizing.messages, "nothing to simulate: the machine has no inertia"))
    found, error, of_period = _cycle_in_time(machine, cycle, sizing.speed, run, sizing.rtol)
    if not (error <= _HOPELESS and found.speed_min > 0.0):
        raise UnconfirmedError("what stepping finds is lost in its own error")
    approximate, message = _with_approximate(sizing)
    error = error if approximate is None else max(error, approximate.error)
    motion = confirmation(sizing, found, approximate and approximate.found.irregularity, "time")
    errors = sizing.error._replace(simulation=error, period=of_period)
    messages = (*sizing.messages, message) if message else sizing.messages
    return replace(sizing, simulation=motion, error=errors, messages=messages)


def _with_approximate(sizing: Sizing) -> tuple[_Confirmed | None, str]:
    machine, cycle, figure = sizing.machine, sizing.cycle, sizing.flywheel.approximate
    if machine is None or cycle is None or figure is None:
        return None, ""
    try:
        inertia = figure * sizing.scene.flywheel_ratio**2
        cycle, run = _resolved_run(machine, cycle, sizing, inertia)
    except NoMotionError:
        return None, "no steady motion with the approximate flywheel has the mean of extremes asked for"
    try:
        again = _cycle_in_time(machine, cycle, run.speed or sizing.speed, run, sizing.rtol)
    except (UnconfirmedError, SlidingError, SceneError):
        return None, "the motion with the approximate flywheel cannot be followed in time"
    found = again.found
    doubt = run.error + (abs(found.irregularity / run.irregularity - 1) if run.irregularity else 0.0)
    if not doubt <= _HOPELESS:
        return None, "rounding leaves nothing to tell of the irregularity that the approximate flywheel gives"
    return again._replace(error=8 * ROUNDING + doubt), ""  # of its figures only the irregularity is reported


def _resolved_run(machine: Machine, cycle: Cycle, sizing: Sizing, inertia: float) -> tuple[Cycle, Run]:
    """The steady motion with another flywheel (kg m², on the crank)."""
    if sizing.cyclic is None:
        return steady.resolved_run(machine, cycle, sizing.speed, inertia, 0.5 * sizing.rtol)
    from flywheel.by_motion import with_flywheel

    found = with_flywheel(sizing, inertia)
    return found.cycle, found.run


def _cycle_in_time(machine: Machine, cycle: Cycle, speed: float, run: Run, rtol: float) -> _Confirmed:
    """One cycle in scaled time tau = w t and scaled speed u, omega = w (1 + scale u).

    The scale is of the size of the irregularity, so that u keeps its digits however small that is. The error is judged
    against the energy route: the difference of the two irregularities plus the bound of the latter.
    """
    scale = run.irregularity if run.irregularity > 0.0 else 1.0
    start = run.offset * 2 / (speed**2 * (run.inertia + cycle.inertia_at_start))
    u = start / (scale * (1 + np.sqrt(1 + start)))
    # relative to the least speed; dense output, which finds the ends of pieces, is one order below the steps themselves
    tight = max(3e-5 * rtol * min(run.speed_min / speed, 1.0), TIGHTEST)
    dynamics = Dynamics(machine, run.inertia, cycle.balance or 0.0)
    first = np.array([0.0, u] if run.current is None else [0.0, u, run.current])
    with _bounded(machine.restarts.size - 1):
        steps = one_cycle(dynamics, speed, scale, first, tight)
    (_, high), (_, low) = extreme(steps, +1.0), extreme(steps, -1.0)
    last = steps[-1]
    closing = scale * float(last.dense(last.end)[1] - u)
    irregularity = scale * (high - low) / (1 + 0.5 * scale * (high + low))
    found = Found(
        irregularity=irregularity,
        speed_max=speed * (1 + scale * high),
        speed_min=speed * (1 + scale * low),
        period=last.end / speed,
        closure=float(closing / (1 + scale * u)),
    )
    return _Confirmed(found, *disagreement(found, cycle, speed, run, rtol))


@contextmanager
def _bounded(pieces: int) -> Iterator[None]:
    """Stop what takes more evaluations than a confirmation is worth; where there are too many pieces, before it begins."""
    if _LEAST * pieces > _MOST:
        raise UnconfirmedError(f"its {pieces} smooth pieces would take too many steps")

    def stop() -> None:
        if tally.evaluations > _MOST:
            raise UnconfirmedError("the motion takes too many steps")

    with counted(stop) as tally:
        yield


_SAMPLES = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)


def extreme(steps: list[Step], sign: float) -> tuple[float, float]:
    """Time and value of the greatest (sign +1) or least u: roots of its derivative within every step that can hold it."""
    times = np.array([step.start + (step.end - step.start) * _SAMPLES for step in steps])
    values = sign * np.array([step.dense(row)[1] for step, row in zip(steps, times, strict=True)])
    best = values.max()
    reach = np.ptp(values, axis=1) + 1e-12 * abs(best)
    found = [(float(times.ravel()[values.argmax()]), float(best))]
    for k in np.flatnonzero(values.max(axis=1) + 0.25 * reach >= best):
        series = np.polynomial.Polynomial.fit(_SAMPLES, values[k], 8, domain=[0.0, 1.0])
        roots = series.deriv().roots()
        inside = (np.abs(roots.imag) < 1e-6) & (roots.real > 0.0) & (roots.real < 1.0)
        found += [_summit(steps[k], float(share), sign) for share in roots.real[inside]]
    time, value = max(found, key=lambda item: item[1])
    return time, sign * value


def _summit(step: Step, share: float, sign: float) -> tuple[float, float]:
    t = step.start + (step.end - step.start) * share
    return t, sign * float(step.dense(t)[1])
