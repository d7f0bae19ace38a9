"""What a confirmation finds, and how far it agrees with what it confirms: that is the error reported."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.dynamics import Dynamics
from flywheel.machine.machine import Machine
from flywheel.numerics.budget import BudgetError, counted, limited
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import SceneError
from flywheel.regime import periodic_motion, steady_motion
from flywheel.regime.one_cycle import SlidingError, one_cycle
from flywheel.regime.periodic_motion import Asked, NoRegimeError, OwnMotion
from flywheel.regime.results import Confirmation, Sizing
from flywheel.regime.steady_motion import NoMotionError, Run
from flywheel.regime.stepping import TIGHTEST, Step
from flywheel.regime.turning_moment import Cycle


class Found(NamedTuple):
    """One steady cycle as a route of its own finds it: rad/s and s; `closure` is omega(T)/omega(0) - 1."""

    irregularity: float
    speed_max: float
    speed_min: float
    period: float
    closure: float


def disagreement(found: Found, cycle: Cycle, speed: float, run: Run, rtol: float) -> tuple[float, float]:
    """Largest relative difference between the figures found and those of a run over a cycle, and the run's own doubt.

    First that of all figures, then that of the period alone.

    Args:
        found: by the confirming route.
        cycle: that the run belongs to.
        speed: mean of extremes of the run, rad/s.
        run: the motion that is confirmed.
        rtol: relative error allowed in the run's period.

    """
    period, period_doubt = steady_motion.period(cycle, speed, run, rtol)
    speed_doubt = run.error * run.irregularity * speed / run.speed_min
    pairs = [
        (found.irregularity, run.irregularity, run.error),
        (found.speed_max, run.speed_max, speed_doubt),
        (found.speed_min, run.speed_min, speed_doubt),
        (found.period, period, period_doubt),
    ]
    apart = [8 * ROUNDING + abs(a / b - 1) + doubt for a, b, doubt in pairs if b > 0.0]
    return max(apart), apart[-1]


def confirmation(sizing: Sizing, found: Found, approximate: float | None, route: str) -> Confirmation:
    """What a sizing reports of its confirmation; `approximate` is the irregularity with the approximate flywheel."""
    return Confirmation(
        irregularity=found.irregularity,
        irregularity_approximate=approximate,
        speed_max=found.speed_max,
        speed_min=found.speed_min,
        speed_time_mean=sizing.scene.cycle / found.period,
        period=found.period,
        closure=found.closure,
        route=route,
    )


# -- confirmation ------------------------------------------------------------------------------------------------------

# The independent route: one steady cycle stepped in time confirms what a sizing promises.
#
# Integrates (J + I*) alpha + ½ dI*/dphi omega² = M* on I* and M* straight from the bond graph, M* at the speed of the
# moment. It shares no cell, quadrature or closed form with the sizing; the two are compared at the end, and that is the
# error reported.


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
        return steady_motion.resolved_run(machine, cycle, sizing.speed, inertia, 0.5 * sizing.rtol)
    from flywheel.sizing.speed_dependent import with_flywheel

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


# -- collocated --------------------------------------------------------------------------------------------------------

# A confirmation without time stepping: the motion by periodic collocation, on cells that nothing else uses.
#
# The energy along the cycle is solved for by Newton's method (`flywheel.periodic`), its level and the balance with it. With
# loads that depend on position alone it shares I* and M* with the closed form, but no cell, no node and no formula for the
# flywheel; with torques that depend on speed it repeats the collocation that the figures come from at other places.


_MOST_WORK = 300_000  # nodes in Newton steps of one motion, some seconds; a textbook machine takes 3 000


def collocated(sizing: Sizing) -> Sizing:
    """The sizing with one steady cycle found again by collocation: with the exact (or given) and the approximate flywheel.

    Raises:
        NoRegimeError: where the iteration finds no motion on these cells.
        BudgetError: where it takes too long.

    """
    if sizing.machine is None or sizing.cycle is None:
        return sizing
    if sizing.run is None:
        return replace(sizing, messages=(*sizing.messages, "nothing to solve for: the machine has no inertia"))
    machine = on_thirds(sizing.machine)
    motion = _motion(sizing, machine, sizing.run.inertia)
    found = _found(motion, sizing)
    error, of_period = disagreement(found, sizing.cycle, sizing.speed, sizing.run, sizing.rtol)
    if not error <= _HOPELESS:
        raise NoRegimeError("what collocation finds is lost in its own error")
    approximate, doubt, messages = _collocated_approximate(sizing, machine)
    errors = sizing.error._replace(simulation=max(error, doubt), period=of_period)
    told = confirmation(sizing, found, approximate, "collocation")
    return replace(sizing, simulation=told, error=errors, messages=(*sizing.messages, *messages))


def on_thirds(machine: Machine) -> Machine:
    """The machine with other first cells: a wide stretch cut into one more than before, a single cell into three.

    A stretch has n cells there and n + 1 (or three) here: however often either are halved, no cell is one of the sizing's.
    """
    found = copy(machine)
    marks, first = machine.landmarks, machine.mesh
    place = np.searchsorted(first, marks)
    counts = np.diff(place)
    pieces = [
        np.linspace(a, b, 3 if n == 1 else n + 1, endpoint=False)
        for a, b, n in zip(marks[:-1], marks[1:], counts, strict=True)
    ]
    found.mesh = np.concatenate([*pieces, marks[-1:]])
    return found


def _motion(sizing: Sizing, machine: Machine, inertia: float) -> OwnMotion:
    """The steady motion with a flywheel (kg m² on the crank); the sizing's own speed is held where nothing else sets one."""
    scene, constant = sizing.scene, sizing.constant or sizing.cycle
    free = scene.unknown is None and machine.sets_its_speed
    held = None if free else (scene.speed or sizing.speed)
    unknown = 0.0 if constant is None else constant.balance or 0.0
    asked = Asked(inertia, None, held)
    with limited(_MOST_WORK):
        return periodic_motion.found(machine, held or sizing.speed, asked, 0.0, unknown, 0.5 * sizing.rtol)


def _found(motion: OwnMotion, sizing: Sizing) -> Found:
    run, cycle, edges = motion.run, motion.cycle, motion.solved.state.edges
    period, _ = steady_motion.period(cycle, motion.speed, run, sizing.rtol)
    gained = float(edges[-1, 0] - edges[0, 0])
    start = float(steady_motion.speed_over_cycle(cycle, motion.speed, run, np.zeros(1))[0])
    share = 2.0 * gained / ((run.inertia + cycle.inertia_at_start) * start**2)
    closure = share / (1.0 + float(np.sqrt(1.0 + share)))
    return Found(run.irregularity, run.speed_max, run.speed_min, period, closure)


def _collocated_approximate(sizing: Sizing, machine: Machine) -> tuple[float | None, float, tuple[str, ...]]:
    """The irregularity with the approximate flywheel, its relative error, and what is to be said of it."""
    figure = sizing.flywheel.approximate
    if figure is None:
        return None, 0.0, ()
    try:
        run = _motion(sizing, machine, figure * sizing.scene.flywheel_ratio**2).run
    except BudgetError:
        return None, 0.0, ("the motion with the approximate flywheel takes too long to find",)
    except NoRegimeError:
        return None, 0.0, ("no steady motion with the approximate flywheel has the mean of extremes asked for",)
    doubt = 8 * ROUNDING + run.error + _difference(run, sizing)
    if doubt > _HOPELESS:
        return None, 0.0, ("rounding leaves nothing to tell of the irregularity that the approximate flywheel gives",)
    return run.irregularity, doubt, ()


def _difference(run: Run, sizing: Sizing) -> float:
    """How far the irregularity is off that of the sizing's own route with the same flywheel, as a share."""
    if sizing.cycle is None or sizing.cyclic is not None or run.irregularity <= 0.0:
        return 0.0
    try:
        return abs(steady_motion.run(sizing.cycle, sizing.speed, run.inertia).irregularity / run.irregularity - 1.0)
    except steady_motion.NoMotionError:
        return _HOPELESS
