"""One steady cycle found again on a route of its own; how far it agrees with what it confirms is the error reported.

In time: (J + I*) alpha + ½ dI*/dphi omega² = M* is integrated on I* and M* straight from the bond graph, M* at the speed of
the moment. It shares no cell, quadrature or closed form with the sizing.

By collocation: the energy along the cycle is solved for by Newton's method, its level and the balance with it, on cells
that nothing else uses. With loads that depend on position alone it shares I* and M* with the closed form, but no cell, no
node and no formula for the flywheel; with torques that depend on speed it repeats the collocation of the figures elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from functools import partial

import numpy as np

from bondgraph.records import NamedTuple
from flywheel.machine.dynamics import Dynamics
from flywheel.machine.machine import Machine
from flywheel.numerics.budget import BudgetError, counted, limited
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.numerics.faults import SceneError
from flywheel.regime import periodic_motion, turning_moment
from flywheel.regime.periodic_motion import Demand
from flywheel.regime.stepping import TIGHTEST, SlidingError, Step, one_cycle
from flywheel.regime.turning_moment import Cycle, NoMotionError, Run
from flywheel.scene.scene import Scene
from flywheel.sizing.limits import IRREGULARITY, of_motor, shares
from flywheel.sizing.results import Confirmation, Confirmed, MotorShaft, Regime, motor_heat

_HOPELESS = 0.5  # relative error past which a figure says nothing
_MOST = 60_000  # evaluations of a cycle in time, a few seconds: a textbook machine takes 2 000
_LEAST = 40  # of a piece
_MOST_WORK = periodic_motion.MOST_WORK
_NONE_FOUND = "not confirmed by collocation: on cells of its own the iteration finds no motion"
_NO_MOTION = "no steady motion with the approximate flywheel has the mean of extremes asked for"
_LOST = "rounding leaves nothing to tell of the irregularity that the approximate flywheel gives"


class UnconfirmedError(ValueError):
    """A motion that cannot be confirmed in bounds, or is lost in its own error; the message says why."""


class SteadyCycle(NamedTuple):
    """One steady cycle as a route of its own finds it: rad/s and s; `closure` is omega(T)/omega(0) - 1.

    `limited` are the figures of the motor that are limited, by their names.
    """

    irregularity: float
    speed_max: float
    speed_min: float
    period: float
    closure: float
    limited: Mapping[str, float] = {}


def in_time(regime: Regime, approximate: float | None) -> Confirmed:
    """One steady cycle stepped in time: with the exact (or given) flywheel, and with the approximate one.

    Args:
        regime: what is confirmed.
        approximate: the approximate flywheel, kg m² at its own shaft; None in an analysis.

    Raises:
        UnconfirmedError: where stepping takes too long, loses the motion, or slides along a law that jumps at a speed.

    """
    machine, run = regime.machine, regime.run
    if run is None:
        return Confirmed(messages=("nothing to simulate: the machine has no inertia",))
    try:
        found = _cycle_in_time(machine, regime.cycle, regime.speed, run, regime.rtol)
    except SceneError as refused:  # the figures stand without it
        raise UnconfirmedError(f"not confirmed in time: stepping finds {refused.faults[0].found}") from None
    except SlidingError:
        slides = "the motion slides along a law that jumps at a speed; make it steep instead"
        why = slides if machine.sets_its_speed else "the motion takes too many steps"
        raise UnconfirmedError(f"not confirmed in time: {why}") from None
    error, of_period = _disagreement(found, regime, run)
    if not (error <= _HOPELESS and found.speed_min > 0.0):
        raise UnconfirmedError("not confirmed in time: what stepping finds is lost in its own error")
    return _with_approximate(regime, found, error, of_period, partial(_approximate_in_time, regime), approximate, "time")


def by_collocation(regime: Regime, approximate: float | None) -> Confirmed:
    """One steady cycle found again by collocation: with the exact (or given) and the approximate flywheel.

    Raises:
        UnconfirmedError: where the iteration finds no motion on these cells, or takes too long.

    """
    run = regime.run
    if run is None:
        return Confirmed(messages=("nothing to solve for: the machine has no inertia",))
    thirds = on_thirds(regime.machine)
    try:
        found = _cycle_by_collocation(regime, thirds, run.inertia)
    except BudgetError:
        long = "not confirmed by collocation: the motion takes too long to find on cells of its own"
        raise UnconfirmedError(long) from None
    except NoMotionError:
        raise UnconfirmedError(_NONE_FOUND) from None
    error, of_period = _disagreement(found, regime, run)
    if not error <= _HOPELESS:
        raise UnconfirmedError(_NONE_FOUND)
    route = partial(_approximate_by_collocation, regime, thirds)
    return _with_approximate(regime, found, error, of_period, route, approximate, "collocation")


def _with_approximate(
    regime: Regime,
    found: SteadyCycle,
    error: float,
    period_error: float,
    again: Callable[[float], tuple[float, float]],
    approximate: float | None,
    route: str,
) -> Confirmed:
    """What is confirmed, with the irregularity that the approximate flywheel gives.

    `again` gives that irregularity and its relative error for an inertia on the crank (kg m²); it raises UnconfirmedError,
    saying why, where there is none.
    """
    irregularity: float | None = None
    messages: tuple[str, ...] = ()
    if approximate is not None:
        try:
            irregularity, doubt = again(approximate * regime.machine.scene.flywheel_ratio**2)
            if not doubt <= _HOPELESS:
                raise UnconfirmedError(_LOST)
            error = max(error, 8 * ROUNDING + doubt)
        except UnconfirmedError as reason:
            irregularity, messages = None, (str(reason),)
    motion = Confirmation(
        irregularity=found.irregularity,
        irregularity_approximate=irregularity,
        speed_max=found.speed_max,
        speed_min=found.speed_min,
        speed_time_mean=regime.machine.scene.cycle / found.period,
        period=found.period,
        closure=found.closure,
        route=route,
    )
    return Confirmed(motion, error, period_error, messages, {**found.limited, IRREGULARITY: found.irregularity})


def _disagreement(found: SteadyCycle, regime: Regime, run: Run) -> tuple[float, float]:
    """Largest relative difference between the figures found and those of the regime's run, with the run's own error.

    First that of all figures, then that of the period alone.
    """
    period, period_error = turning_moment.period(regime.cycle, regime.speed, run, regime.rtol)
    speed_error = run.error * run.irregularity * regime.speed / run.speed_min
    pairs = [
        (found.irregularity, run.irregularity, run.error),
        (found.speed_max, run.speed_max, speed_error),
        (found.speed_min, run.speed_min, speed_error),
        (found.period, period, period_error),
    ]
    apart = [8 * ROUNDING + abs(a / b - 1) + error for a, b, error in pairs if b > 0.0]
    limited = ((found.limited[name], regime.limits[name]) for name in found.limited)
    beside = [8 * ROUNDING + abs(a / b.reached - 1) + b.reached_error for a, b in limited if b.reached > 0.0]
    return max(apart + beside), apart[-1]


def _cycle_in_time(machine: Machine, cycle: Cycle, speed: float, run: Run, rtol: float) -> SteadyCycle:
    """One cycle in scaled time tau = w t and scaled speed u, omega = w (1 + scale u).

    The scale is of the size of the irregularity, so that u keeps its digits however small that is.
    """
    pieces = machine.restarts.size - 1
    if _LEAST * pieces > _MOST:
        raise UnconfirmedError(f"not confirmed in time: its {pieces} smooth pieces would take too many steps")
    scale = run.irregularity if run.irregularity > 0.0 else 1.0
    start = run.offset * 2 / (speed**2 * (run.inertia + cycle.inertia_at_start))
    u = start / (scale * (1 + np.sqrt(1 + start)))
    # relative to the least speed; dense output, which finds the ends of pieces, is one order below the steps themselves
    tight = max(3e-5 * rtol * min(run.speed_min / speed, 1.0), TIGHTEST)
    dynamics = Dynamics(machine, run.inertia, cycle.balance or 0.0)
    first = np.array([0.0, u, *run.states])

    def stop() -> None:
        if tally.evaluations > _MOST:
            raise UnconfirmedError("not confirmed in time: the motion takes too many steps")

    with counted(stop) as tally:
        steps = one_cycle(dynamics, speed, scale, first, tight)
    (_, high), (_, low) = extreme(steps, +1.0), extreme(steps, -1.0)
    last = steps[-1]
    closing = scale * (last.last[1] - u)
    return SteadyCycle(
        irregularity=scale * (high - low) / (1 + 0.5 * scale * (high + low)),
        speed_max=speed * (1 + scale * high),
        speed_min=speed * (1 + scale * low),
        period=last.end / speed,
        closure=float(closing / (1 + scale * u)),
        limited=_limited(machine.scene, steps, speed, scale),
    )


def _limited(scene: Scene, steps: list[Step], speed: float, scale: float) -> dict[str, float]:
    """The figures of the motor that are limited (see `limits.shares`), integrated over the steps of a motion in time."""
    names, motor = of_motor(scene), scene.motor
    if not names or motor is None or motor.rated is None or scene.drive is None:
        return {}
    ratio, circuit, rated = scene.shafts[scene.drive.on], motor.circuit, motor.rated

    def torque(turned: Array, states: Array) -> Array:
        return np.asarray(motor.torque(turned) if circuit is None else circuit.torque(turned, tuple(states)))

    def current(turned: Array, states: Array) -> Array:
        if circuit is None:
            return np.asarray(motor.current_share(turned))
        return np.asarray(circuit.current(turned, tuple(states))) / (motor.rated_current or 1.0)

    def heat(turned: Array, states: Array) -> Array:
        return motor_heat(motor, turned, () if circuit is None else tuple(states))

    def along(step: Step, law: Callable[[Array, Array], Array], shares: Array) -> Array:
        states = step.dense(step.start + (step.end - step.start) * shares)
        return law(ratio * speed * (1.0 + scale * states[1]), states[2:])

    def mean(law: Callable[[Array, Array], Array]) -> float:
        works = [(step.end - step.start) * float(_GAUSS_WEIGHTS @ along(step, law, _GAUSS)) for step in steps]
        return sum(works) / (steps[-1].end - steps[0].start)

    def extremes(law: Callable[[Array, Array], Array]) -> tuple[float, float]:
        found: list[float] = []
        for step in steps:
            values = along(step, law, _SAMPLES)
            roots = np.polynomial.Polynomial(_TO_POWERS @ (values - values[0])).deriv().roots()
            inside = roots.real[(np.abs(roots.imag) < 1e-6) & (roots.real > 0.0) & (roots.real < 1.0)]
            found += [*values.tolist(), *along(step, law, inside).tolist()]
        return min(found), max(found)

    figures: dict[str, Callable[[], float]] = {
        "motor_torque": lambda: max(map(abs, extremes(torque))) / rated.torque,
        "motor_rms": lambda: float(np.sqrt(mean(lambda turned, states: torque(turned, states) ** 2))) / rated.torque,
        "motor_heat": lambda: mean(heat),
        "current_pulsation": lambda: float(np.diff(extremes(current))[0]),
    }
    return {name: figures[name]() for name in names}


def _approximate_in_time(regime: Regime, inertia: float) -> tuple[float, float]:
    machine, speed = regime.machine, regime.speed
    try:
        if regime.cyclic is None:
            cycle, run = turning_moment.resolved_run(machine, regime.cycle, speed, inertia, 0.5 * regime.rtol)
        else:
            motion = _collocated(regime, machine, inertia)
            cycle, run = motion.cycle, motion.run
    except (NoMotionError, BudgetError):
        raise UnconfirmedError(_NO_MOTION) from None
    try:
        found = _cycle_in_time(machine, cycle, run.speed or speed, run, regime.rtol)
    except (UnconfirmedError, SlidingError, SceneError):
        raise UnconfirmedError("the motion with the approximate flywheel cannot be followed in time") from None
    return found.irregularity, run.error + (abs(found.irregularity / run.irregularity - 1) if run.irregularity else 0.0)


_GAUSS, _GAUSS_WEIGHTS = (0.5 * np.array(each) for each in np.polynomial.legendre.leggauss(10))
_GAUSS = 0.5 + _GAUSS
_SAMPLES = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)
_TO_POWERS = np.linalg.inv(np.vander(_SAMPLES, increasing=True))


def extreme(steps: list[Step], sign: float) -> tuple[float, float]:
    """Time and value of the greatest (sign +1) or least u: roots of its derivative within every step that can hold it."""
    ends = [(sign * float(step.first[1]), sign * float(step.last[1])) for step in steps]
    time, best = max(((step.end, after) for step, (_, after) in zip(steps, ends, strict=True)), key=lambda item: item[1])
    if ends[0][0] > best:
        time, best = steps[0].start, ends[0][0]
    for step, pair in zip(steps, ends, strict=True):
        width = step.end - step.start
        if max(pair) + 0.5 * width * step.steepest(1) < best:
            continue
        values = sign * step.dense(step.start + width * _SAMPLES)[1]
        if values.max() + 0.25 * np.ptp(values) < best:
            continue
        roots = np.polynomial.Polynomial(_TO_POWERS @ (values - values[0])).deriv().roots()
        inside = (np.abs(roots.imag) < 1e-6) & (roots.real > 0.0) & (roots.real < 1.0)
        for share in roots.real[inside].tolist():
            at = step.start + width * share
            value = sign * float(step.at(at)[1])
            if value > best:
                time, best = at, value
    return time, sign * best


def on_thirds(machine: Machine) -> Machine:
    """The machine with other first cells: a wide stretch cut into one more than before, a single cell into three.

    A stretch has n cells there and n + 1 (or three) here: however often either are halved, no cell is one of the sizing's.
    """
    found = copy(machine)
    marks = machine.landmarks
    counts = np.diff(np.searchsorted(machine.mesh, marks))
    pieces = [
        np.linspace(a, b, 3 if n == 1 else n + 1, endpoint=False)
        for a, b, n in zip(marks[:-1], marks[1:], counts, strict=True)
    ]
    found.mesh = np.concatenate([*pieces, marks[-1:]])
    return found


def _collocated(regime: Regime, machine: Machine, inertia: float) -> periodic_motion.OwnMotion:
    """The steady motion with a flywheel (kg m² on the crank); the sizing's own speed is held where nothing else sets one."""
    scene = machine.scene
    free = scene.unknown is None and machine.sets_its_speed
    held = None if free else (scene.speed or regime.speed)
    unknown = (regime.constant or regime.cycle).balance or 0.0
    with limited(_MOST_WORK):
        asked = Demand(inertia, None, held)
        return periodic_motion.own_motion(machine, held or regime.speed, asked, 0.0, unknown, 0.5 * regime.rtol)


def _cycle_by_collocation(regime: Regime, machine: Machine, inertia: float) -> SteadyCycle:
    motion = _collocated(regime, machine, inertia)
    run, cycle, edges = motion.run, motion.cycle, motion.solved.state.edges
    shaft = MotorShaft(machine.scene, cycle, run, motion.speed, regime.rtol)
    limited = {name: share.value for name, share in shares(of_motor(machine.scene), shaft).items()}
    period, _ = turning_moment.period(cycle, motion.speed, run, regime.rtol)
    gained = float(edges[-1, 0] - edges[0, 0])
    start = float(turning_moment.speed_over_cycle(cycle, motion.speed, run, np.zeros(1))[0])
    share = 2.0 * gained / ((run.inertia + cycle.inertia_at_start) * start**2)
    closure = share / (1.0 + float(np.sqrt(1.0 + share)))
    return SteadyCycle(run.irregularity, run.speed_max, run.speed_min, period, closure, limited)


def _approximate_by_collocation(regime: Regime, machine: Machine, inertia: float) -> tuple[float, float]:
    try:
        run = _collocated(regime, machine, inertia).run
    except BudgetError:
        raise UnconfirmedError("the motion with the approximate flywheel takes too long to find") from None
    except NoMotionError:
        raise UnconfirmedError(_NO_MOTION) from None
    apart = 0.0
    if regime.cyclic is None and run.irregularity > 0.0:  # from that of the closed form with the same flywheel
        try:
            apart = abs(turning_moment.run(regime.cycle, regime.speed, run.inertia).irregularity / run.irregularity - 1.0)
        except NoMotionError:
            apart = _HOPELESS
    return run.irregularity, run.error + apart
