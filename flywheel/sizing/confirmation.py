"""Confirmation of one steady cycle by an independent method; the difference is the reported error.

In time: (J + I*) alpha + ½ dI*/dphi omega² = M* is integrated on I* and M* straight from the bond graph, M* at the
instantaneous speed. It shares no cell, quadrature or closed form with the sizing.

By collocation: Newton's method gives the energy along the cycle, its level and the balance, on separate
cells. With loads that depend on position alone it shares I* and M* with the closed form, but no cell, no
node and no formula for the flywheel; with torques that depend on speed it repeats the collocation of the figures on other
cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import islice, pairwise
from typing import NamedTuple

import numpy as np

from bondgraph.motion.runge_kutta import RateField, Rates
from bondgraph.motion.stepping import TIGHTEST, Events, Piece, Step, StepError, over, residuals, through
from flywheel.machine.dynamics import MachineDynamics, PlainInstant, dynamics_of
from flywheel.machine.equation import NoMotionError
from flywheel.machine.machine import Anchor, Machine
from flywheel.numerics.budget import BudgetError, count, counted, limited
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.numerics.faults import SceneError
from flywheel.regime import periodic_motion, turning_moment
from flywheel.regime.branch import stable_motion
from flywheel.regime.cycle_equations import Demand
from flywheel.regime.free_motion import stiffness, too_short
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.scene.scene import Scene
from flywheel.sizing.motor import IRREGULARITY, MotorShaft, of_motor, shares
from flywheel.sizing.results import Confirmation, Confirmed, Regime

_HOPELESS = 0.5  # relative error above which a figure is meaningless
_MOST_EVALUATIONS = 60_000  # evaluations of a cycle in time, a few seconds: a textbook machine takes 2 000
_LEAST = 40  # of a piece
_MOST_WORK = periodic_motion.MOST_WORK
_NO_SOLUTION = "not confirmed by collocation: on separate cells the iteration does not converge"
_NO_MOTION = "no steady motion with the approximate flywheel has the required mean of extremes"
_LOST = "the irregularity with the approximate flywheel is lost in rounding"


class UnconfirmedError(ValueError):
    """A motion that cannot be confirmed within the allowed work, or is lost in its own error; the message has the reason."""


def in_time(regime: Regime, approximate: float | None) -> Confirmed:
    """One steady cycle stepped in time: with the exact (or given) flywheel, and with the approximate one.

    Args:
        regime: the regime to confirm.
        approximate: the approximate flywheel, kg m² at its own shaft; None in an analysis.

    Raises:
        UnconfirmedError: if stepping takes too long, loses the motion, or slides along a law that jumps at a speed.

    """
    machine, run = regime.machine, regime.run
    if run is None:
        return Confirmed(messages=("nothing to simulate: the machine has no inertia",))
    try:
        motion, limited = _cycle_in_time(machine, regime.cycle, regime.speed, run, regime.rtol)
    except SceneError as refused:  # the figures stand without it
        raise UnconfirmedError(f"not confirmed in time: stepping finds {refused.faults[0].defect}") from None
    except SlidingError:
        slides = "the motion slides along a law that jumps at a speed; make the law steep instead"
        why = slides if machine.sets_its_speed else "the motion takes too many steps"
        raise UnconfirmedError(f"not confirmed in time: {why}") from None
    error, of_period, of_speeds = _disagreement(motion, limited, regime, run)
    if not (error <= _HOPELESS and motion.speed_min > 0.0):
        raise UnconfirmedError("not confirmed in time: the result of stepping is lost in its own error")
    confirmed = Confirmed(motion, error, of_period, of_speeds, limited=limited)
    return _with_approximate(regime, confirmed, partial(_approximate_in_time, regime), approximate)


def by_collocation(regime: Regime, approximate: float | None) -> Confirmed:
    """One steady cycle computed again by collocation: with the exact (or given) and the approximate flywheel.

    Raises:
        UnconfirmedError: if the iteration does not converge on these cells, or takes too long.

    """
    run = regime.run
    if run is None:
        return Confirmed(messages=("nothing to solve for: the machine has no inertia",))
    thirds = on_thirds(regime.machine)
    try:
        motion, limited = _cycle_by_collocation(regime, thirds, run.inertia)
    except BudgetError:
        long = "not confirmed by collocation: on separate cells the iteration takes too long"
        raise UnconfirmedError(long) from None
    except NoMotionError:
        raise UnconfirmedError(_NO_SOLUTION) from None
    error, of_period, of_speeds = _disagreement(motion, limited, regime, run)
    if not error <= _HOPELESS:
        raise UnconfirmedError(_NO_SOLUTION)
    confirmed = Confirmed(motion, error, of_period, of_speeds, limited=limited)
    return _with_approximate(regime, confirmed, partial(_approximate_by_collocation, regime, thirds), approximate)


def _with_approximate(
    regime: Regime, confirmed: Confirmed, again: Callable[[float], tuple[float, float]], approximate: float | None
) -> Confirmed:
    """The confirmed motion, with the irregularity that the approximate flywheel gives.

    `again` gives that irregularity and its relative error for an inertia on the crank (kg m²); it raises UnconfirmedError,
    with the reason, if there is none.
    """
    motion, error = confirmed.motion, confirmed.error
    assert motion is not None
    assert error is not None
    confirmed = confirmed._replace(limited={**confirmed.limited, IRREGULARITY: motion.irregularity})
    if approximate is None:
        return confirmed
    try:
        irregularity, doubt = again(approximate * regime.machine.scene.flywheel_ratio**2)
        if not doubt <= _HOPELESS:
            raise UnconfirmedError(_LOST)
    except UnconfirmedError as reason:
        return confirmed._replace(messages=(str(reason),))
    motion = motion._replace(irregularity_approximate=irregularity)
    return confirmed._replace(motion=motion, error=max(error, 8 * ROUNDING + doubt))


def _disagreement(cycle: Confirmation, limited: Mapping[str, float], regime: Regime, run: Run) -> tuple[float, float, float]:
    """Largest relative difference between these figures and those of the regime's run, with the run's own error.

    First that of all figures, then that of the period, and of the extreme speeds beside the error of their mean.
    """
    period, period_error = turning_moment.period(regime.cycle, regime.speed, run, regime.rtol)
    speeds = (cycle.speed_max, run.speed_max), (cycle.speed_min, run.speed_min)
    of_speeds = max((abs(a / b - 1) for a, b in speeds if b > 0.0), default=0.0) + run.error_about_mean
    pairs = [(cycle.irregularity, run.irregularity, run.error), (cycle.period, period, period_error)]
    pairs += [(value, regime.limits[name].reached, regime.limits[name].reached_error) for name, value in limited.items()]
    apart = [8 * ROUNDING + abs(a / b - 1) + error if a is not None and b > 0.0 else 0.0 for a, b, error in pairs]
    uneven = 0.0 if run.irregularity > 0.0 else 8 * ROUNDING + cycle.irregularity  # of an even motion the scale is 1
    return max(*apart, uneven, 8 * ROUNDING + of_speeds), apart[1], of_speeds


def _cycle_in_time(
    machine: Machine, cycle: Cycle, speed: float, run: Run, rtol: float, *, limited: bool = True
) -> tuple[Confirmation, dict[str, float]]:
    """One cycle in scaled time tau = w t and scaled speed u, omega = w (1 + scale u); and the motor's figures if `limited`.

    The scale is of the size of the irregularity, so that u keeps its digits even if that is small.
    """
    pieces = machine.restarts.size - 1
    if _LEAST * pieces > _MOST_EVALUATIONS:
        raise UnconfirmedError(f"not confirmed in time: its {pieces} smooth pieces would take too many steps")
    scale = run.irregularity if run.irregularity > 0.0 else 1.0
    start = run.offset * 2 / (speed**2 * (run.inertia + cycle.inertia_at_start))
    u = start / (scale * (1 + np.sqrt(1 + start)))
    # relative to the least speed; dense output, which finds the ends of pieces, is one order below the steps themselves
    tight = max(3e-5 * rtol * min(run.speed_min / speed, 1.0), TIGHTEST)
    dynamics = dynamics_of(machine, run.inertia, cycle.balance or 0.0)
    first = np.array([0.0, u, *run.states])

    def stop() -> None:
        if tally.evaluations > _MOST_EVALUATIONS:
            raise UnconfirmedError("not confirmed in time: the motion takes too many steps")

    with counted(stop) as tally:
        steps = one_cycle(dynamics, speed, scale, first, tight)
    reaches = [step.reach(1) for step in steps]
    (_, high), (_, low) = (extreme(steps, sign, reaches) for sign in (1.0, -1.0))
    last = steps[-1]
    closing = scale * (last.last[1] - u)
    period = last.end / speed
    motion = Confirmation(
        irregularity=scale * (high - low) / (1 + 0.5 * scale * (high + low)),
        speed_max=speed * (1 + scale * high),
        speed_min=speed * (1 + scale * low),
        period=period,
        speed_time_mean=machine.scene.cycle / period,
        closure=float(closing / (1 + scale * u)),
    )
    return motion, _limited(machine.scene, steps, speed, scale) if limited else {}


def _limited(scene: Scene, steps: list[Step], speed: float, scale: float) -> dict[str, float]:
    """The limited figures of the motor (see `shares`), integrated over the steps of a motion in time."""
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
        return motor.heat_share(turned, () if circuit is None else tuple(states))

    widths, samples = np.array([step.end - step.start for step in steps]), over(steps, _SAMPLES)[1]
    inside = over(steps, _GAUSS)[1]

    def along(law: Callable[[Array, Array], Array], states: Array) -> Array:
        return law(ratio * speed * (1.0 + scale * states[1]), states[2:])

    def mean(law: Callable[[Array, Array], Array]) -> float:
        return float((widths * (along(law, inside) @ _GAUSS_WEIGHTS)).sum()) / (steps[-1].end - steps[0].start)

    def greatest(law: Callable[[Array, Array], Array], sign: float) -> float:
        values = sign * along(law, samples)
        best = float(values.max())
        for k in np.flatnonzero(values.max(axis=1) + 0.25 * np.ptp(values, axis=1) > best).tolist():
            turns = over(steps[k : k + 1], _turns(values[k]))[1]
            best = max([best, *(sign * along(law, turns)[0]).tolist()])
        return sign * best

    def extremes(law: Callable[[Array, Array], Array]) -> tuple[float, float]:
        return greatest(law, -1.0), greatest(law, 1.0)

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
        own, _ = _cycle_in_time(machine, cycle, run.speed or speed, run, regime.rtol, limited=False)
    except (UnconfirmedError, SlidingError, SceneError):
        raise UnconfirmedError("the motion with the approximate flywheel cannot be followed in time") from None
    return own.irregularity, run.error + (abs(own.irregularity / run.irregularity - 1) if run.irregularity else 0.0)


_GAUSS, _GAUSS_WEIGHTS = (0.5 * np.array(each) for each in np.polynomial.legendre.leggauss(10))
_GAUSS = 0.5 + _GAUSS
_SAMPLES = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)
_TO_POWERS = np.linalg.inv(np.vander(_SAMPLES, increasing=True))


def _turns(values: Array) -> Array:
    """The shares of a step at which the polynomial through values at the samples has an extreme."""
    roots = np.polynomial.Polynomial(_TO_POWERS @ (values - values[0])).deriv().roots()
    return np.asarray(roots.real[(np.abs(roots.imag) < 1e-6) & (roots.real > 0.0) & (roots.real < 1.0)])


def extreme(steps: list[Step], sign: float, reaches: Sequence[float] | None = None) -> tuple[float, float]:
    """Time and value of the greatest (sign +1) or least u: roots of its derivative within every step that may contain it.

    `reaches` of u in the steps, where they are known.
    """
    after = [sign * float(step.last[1]) for step in steps]
    time, best = max(zip((step.end for step in steps), after, strict=True), key=lambda item: item[1])
    before = [sign * float(steps[0].first[1]), *after[:-1]]
    if before[0] > best:
        time, best = steps[0].start, before[0]
    reaches = [step.reach(1) for step in steps] if reaches is None else reaches
    rows = zip(steps, before, after, reaches, strict=True)
    near = [step for step, *pair, reach in rows if not max(pair) + reach < best]
    values = sign * over(near, _SAMPLES)[1][1]
    highest = values.max(axis=1)
    for k in np.flatnonzero(highest + 0.25 * np.ptp(values, axis=1) >= max(best, highest.max())).tolist():
        for share in _turns(values[k]).tolist():
            at = near[k].start + (near[k].end - near[k].start) * share
            value = sign * float(near[k].at(at)[1])
            if value > best:
                time, best = at, value
    return time, sign * best


def on_thirds(machine: Machine) -> Machine:
    """The machine with other first cells: a wide stretch has one more cell than before, a single cell becomes three.

    A stretch has n cells there and n + 1 (or three) here: after any halvings, no cell is one of the sizing's.
    """
    other = Machine(machine.scene, machine.friction)
    marks = machine.landmarks
    counts = np.diff(np.searchsorted(machine.mesh, marks))
    pieces = [
        np.linspace(a, b, 3 if n == 1 else n + 1, endpoint=False)
        for a, b, n in zip(marks[:-1], marks[1:], counts, strict=True)
    ]
    other.mesh = np.concatenate([*pieces, marks[-1:]])
    return other


def _collocated(regime: Regime, machine: Machine, inertia: float) -> periodic_motion.OwnMotion:
    """The steady motion with a flywheel (kg m² on the crank); at the speed of the sizing if no torque sets one."""
    scene = machine.scene
    free = scene.unknown is None and machine.sets_its_speed
    mean = None if free else (scene.speed or regime.speed)
    unknown = (regime.constant or regime.cycle).balance or 0.0
    with limited(_MOST_WORK):
        demand = Demand(inertia, None, mean)
        other = regime.solved if machine is regime.machine else None  # on its own cells
        return stable_motion(machine, other, mean or regime.speed, demand, unknown, 0.5 * regime.rtol)


def _cycle_by_collocation(regime: Regime, machine: Machine, inertia: float) -> tuple[Confirmation, dict[str, float]]:
    motion = _collocated(regime, machine, inertia)
    run, cycle, edges = motion.run, motion.cycle, motion.solved.state.edges
    shaft = MotorShaft(machine.scene, cycle, run, motion.speed, regime.rtol)
    limited = {name: share.value for name, share in shares(of_motor(machine.scene), shaft).items()}
    period, _ = turning_moment.period(cycle, motion.speed, run, regime.rtol)
    gained = float(edges[-1, 0] - edges[0, 0])
    start = float(turning_moment.speed_over_cycle(cycle, motion.speed, run, np.zeros(1))[0])
    share = 2.0 * gained / ((run.inertia + cycle.inertia_at_start) * start**2)
    closure = share / (1.0 + float(np.sqrt(1.0 + share)))
    mean = machine.scene.cycle / period
    return Confirmation(run.irregularity, run.speed_max, run.speed_min, period, mean, closure, "collocation"), limited


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


# -- one cycle by steps, in scaled variables that keep their digits however little the speed varies ----------------------

_COUNTED = 12  # evaluations of a step, counted together
_MOST_STEPS = 4_000  # steps
_FEW_STEPS = 1000  # in a stretch where switches are no longer searched for
_AHEAD = 1e-7  # of a piece: distance beyond a switch at which its side is evaluated
_MOST_CROSSINGS = 500  # of switches in a cycle
_TRIES = 8  # changes of side at one place, before they are no longer searched for
_SLIGHT = 1e-3  # of the size of a motor's states: smaller ones have this absolute error


class SlidingError(ValueError):
    """A motion that cannot continue: it slides along a law that drives it back from both sides."""


def one_cycle(dynamics: MachineDynamics, speed: float, scale: float, first: Array, tight: float) -> list[Step]:
    """The steps of a cycle from a state at phi = 0: phi (rad), u, and a motor's own states, such as its current.

    tau = w t and omega = w (1 + scale u). Stepping restarts where a law switches, at a position or at a speed, where a mesh
    changes its driving side, and around narrow features; not where cells end for resolution alone.

    Args:
        dynamics: the machine with its flywheel and balance.
        speed: w, rad/s.
        scale: of the speed's variation, about the irregularity.
        first: the state at phi = 0.
        tight: tolerance of a step.

    Raises:
        SlidingError: if the motion keeps changing sides, as it does along a torque that jumps at a speed.

    If it changes sides repeatedly at one place, the rest of that piece is stepped without a search for switches.

    """
    machine = dynamics.machine
    equations = _ScaledEquation(dynamics, speed, scale)
    edges = np.union1d(machine.switches, np.setdiff1d(machine.restarts, machine.breakpoints))
    own = () if dynamics.circuit is None else np.maximum(np.abs(first[2:]), _SLIGHT * np.array(dynamics.circuit.scales))
    tolerance = tight, tight * np.array([1.0, 1.0, *own])
    state, tau, steps = first, 0.0, list[Step]()
    hint: float | None = None
    crossings = 0
    for low, high in pairwise(edges.tolist()):
        tries = 0
        while True:
            anchor, own = equations.anchor(state, (low, high)) if tries <= _TRIES else (None, state[2:])
            law = dynamics.plainly(anchor or Anchor(0.5 * (low + high), None, None))
            rates = equations.rates((low, high), anchor, law)
            along = equations.along((low, high), anchor, state, plain=law is not None)
            events = None if anchor is None else equations.events(anchor, own, tau, state)
            stepping = through(Piece(rates, (low, high), np.inf, tolerance, along), tau, state, hint, events)
            most = _MOST_STEPS if events is not None or tries == 0 else _FEW_STEPS
            try:
                passed = [*islice(stepping, most)]
            except StepError as error:
                raise SceneError([too_short(error)]) from None
            last, crossings = passed[-1], crossings + (passed[-1].crossed is not None)
            steps += [step for step in passed if step.end > step.start]
            if len(passed) == most or crossings > _MOST_CROSSINGS:
                raise SlidingError
            tries = tries + 1 if last.end == tau else 0
            state, tau = np.array(last.last), last.end
            if last.crossed is None or high - state[0] <= 2 * _AHEAD * (high - low):
                break
        hint = max((step.end - step.start for step in passed if step.end > step.start), default=hint)
        state[0] = high
    return steps


class _ScaledEquation(NamedTuple):
    """The equation of motion in tau and u; branches are decided at an anchor, or without one at every instant."""

    dynamics: MachineDynamics
    speed: float
    scale: float

    def rates(self, ends: tuple[float, float], anchor: Anchor | None, law: PlainInstant | None) -> Rates:
        """d(phi, u, a motor's states)/dtau within a stretch, by its law in plain numbers where that is defined."""
        walked = partial(self._walked, ends, anchor)
        if law is None:
            return walked
        _, speed, scale = self
        unit, calls = 1.0 / (speed * speed * scale), 0

        def rates(tau: float, state: Sequence[float]) -> Sequence[float]:
            nonlocal calls
            calls += 1
            if calls == _COUNTED:
                count(calls)
                calls = 0
            phi, u, *own = state
            ratio = 1.0 + scale * u
            try:
                acceleration, _, _, changes = law(phi, speed * ratio, 0.0, own)
            except (ValueError, ArithmeticError):
                acceleration = math.nan
            if acceleration - acceleration != 0.0:
                return walked(tau, state)
            return (ratio, acceleration * unit, *(rate / speed for rate in changes)) if own else (ratio, acceleration * unit)

        return rates

    def _walked(
        self, ends: tuple[float, float], anchor: Anchor | None, tau: float, state: Sequence[float]
    ) -> Sequence[float]:
        """The rates at an instant, by the walk."""
        dynamics, speed, scale = self
        phi, u, *own = state
        ratio, middle = 1.0 + scale * u, 0.5 * (ends[0] + ends[1]) if anchor is None else anchor.phi
        at = dynamics.at(phi, middle, speed * ratio, states=own, ends=ends, anchor=anchor)
        return (ratio, float(at.acceleration) / (speed * speed * scale), *(float(rate) / speed for rate in at.rates))

    def along(self, ends: tuple[float, float], anchor: Anchor | None, state: Array, *, plain: bool) -> RateField | None:
        """The same rates at many instants at once; None if branches are decided at every instant."""
        dynamics, circuit = self.dynamics, self.dynamics.circuit
        if anchor is None and dynamics.branching:
            return None
        sizes = [1.0, 1.0 / self.scale]
        if circuit is not None:
            sizes += [max(abs(float(value)), size) for value, size in zip(state[2:], circuit.scales, strict=True)]
        rates = partial(self._together, ends, anchor or Anchor(0.5 * (ends[0] + ends[1]), None, None))
        return RateField(rates, np.array(sizes), stiffness(dynamics.machine, plain=plain))

    def _together(self, ends: tuple[float, float], place: Anchor, tau: Array, states: Array) -> Array:
        """The rates (k, n) at times (n,) and states (k, n)."""
        dynamics, speed, scale = self
        ratio = 1.0 + scale * states[1]
        at = dynamics.at_many(states[0], place, speed * ratio, np.zeros_like(tau), states[2:], ends)
        return np.array([ratio, at.acceleration / (speed * speed * scale), *(rate / speed for rate in at.rates)])

    def anchor(self, state: Array, ends: tuple[float, float]) -> tuple[Anchor | None, Array]:
        """Point that decides the branches of the next stretch, a little ahead; None if position alone decides them.

        It includes a motor's own states.
        """
        if not self.dynamics.branching:
            return None, state[2:]
        phi, width = float(state[0]), ends[1] - ends[0]
        middle = 0.5 * (ends[0] + ends[1])
        here = Anchor(middle, self.speed * (1.0 + self.scale * float(state[1])), 0.0)
        rate = self.rates(ends, here, None)(0.0, state)
        ahead = _AHEAD * width / float(rate[0])
        place = min(max(phi + ahead * float(rate[0]), ends[0] + _AHEAD * width), ends[1] - 0.01 * _AHEAD * width)
        omega = self.speed * (1.0 + self.scale * float(state[1] + ahead * rate[1]))
        anchor = Anchor(place, omega, 0.0)
        own = [float(value + ahead * change) for value, change in zip(state[2:], rate[2:], strict=True)]
        now = self.dynamics.at(place, place, omega, states=own, ends=ends, anchor=anchor)
        return anchor._replace(factors=now.factors or None), np.array(own)

    def events(self, anchor: Anchor, own: Array, start: float, state: Array) -> Events:
        """Events that end the next stretch, with their sides at the anchor, if a motor has its own states.

        start: tau where the stretch begins, from the state.
        """
        dynamics, speed, scale = self

        def values(tau: Array, states: Array) -> Array:
            omega = np.asarray(speed * (1.0 + scale * states[1]))
            signs = dynamics.sides(states[0], anchor, omega, np.zeros_like(tau), states[2:])
            return np.array(signs, dtype=float).reshape(len(signs), tau.size)  # none if no load switches in this piece

        here = np.array([anchor.phi]), anchor, np.array([anchor.omega]), np.zeros(1), own[:, None]
        sides = np.array([1.0 if side[0] >= 0.0 else -1.0 for side in dynamics.sides(*here, there=True)])
        return Events(values, sides, residuals=residuals(sides, values(np.array([start]), state[:, None])[:, 0]))
