"""What a script does: a plain grid of angles, or one cycle stepped in time and run again until it closes.

On a grid: the trapezoidal rule, the greatest and the least sample. In time: Euler, RK4, and SciPy's RK45, DOP853 and LSODA,
each with and without a restart where the machine's loads and ratios break; without one, steps run over jumps and windows as
a script's do. What is unknown at the start of the cycle (its speed, a motor's current, the balance, the flywheel) is found
by Powell's hybrid method on what the cycle lacks at its end; whatever runs the cycle can be plugged in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import integrate
from scipy.optimize import root

from bondgraph.motion.stepping import FIXED, hermite, instant, runge_kutta_step
from flywheel.machine.dynamics import Anchor, Dynamics, circuit_of
from flywheel.machine.machine import Machine
from flywheel.regime import constant_speed
from flywheel.regime.stepping import Step
from flywheel.sizing.confirmation import extreme
from flywheel.study.question import Question

Array = NDArray[np.float64]


class Samples(NamedTuple):
    """A cycle on evenly spaced angles: W (J) and I* (kg m²) there, the crank's speed w (rad/s), and the unknown's value.

    `unit` is the unknown's change (SI) that changes the cycle's net work by one joule; 0 without an unknown.
    """

    phi: Array
    work: Array
    inertia: Array
    speed: float
    balance: float
    unit: float


def sampled(machine: Machine, count: int) -> Samples:
    """The cycle at `count` angles and its end; torques that depend on speed are taken at a constant one."""
    scene = machine.scene
    phi = np.linspace(0.0, scene.cycle, count + 1)
    reduced = machine.reduce(phi)
    moment, share, inertia = (part + 0.0 * phi for part in (reduced.moment, reduced.per_unknown, reduced.inertia))
    speed = scene.speed or 0.0
    if machine.sets_its_speed:
        pace, held = constant_speed.operating_point(machine)
        speed = pace or 0.0
        dynamics = Dynamics(machine, 0.0, held)
        dynamics.circuit = None  # at a constant speed a motor's current is steady
        anchor = Anchor(machine.anchors(phi), speed + 0.0 * phi, 0.0 * phi)
        moment, share = dynamics.along(phi, anchor, anchor.omega, anchor.time).moment, 0.0 * phi
        balance, unit = held, 0.0
    else:
        net = float(np.trapezoid(share, phi))
        balance = -float(np.trapezoid(moment, phi)) / net if net else 0.0
        unit = 1.0 / net if net else 0.0
    moment = moment + balance * share
    steps = 0.5 * (moment[1:] + moment[:-1]) * np.diff(phi)
    return Samples(phi, np.concatenate(([0.0], np.cumsum(steps))), inertia, speed, balance, unit)


def by_grid(asked: Question, count: int) -> float:
    """The answer from a plain grid."""
    samples = sampled(asked.machine, count)
    if asked.sized:
        return max(total(samples, asked.machine.scene.irregularity or 0.0), 0.0) / asked.crank
    omega = speeds(samples, (asked.machine.scene.inertia or 0.0) * asked.crank)
    return irregularity(omega)


def total(samples: Samples, eps: float) -> float:
    """Wittenbauer's flywheel (kg m² on the crank) of samples: [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²)."""
    square = samples.speed**2
    energy = 0.5 * square * samples.inertia
    high = (samples.work - (1 + eps / 2) ** 2 * energy).max()
    low = (samples.work - (1 - eps / 2) ** 2 * energy).min()
    return float((high - low) / (eps * square))


def speeds(samples: Samples, inertia: float) -> Array:
    """Speeds (rad/s) at the samples with a flywheel (kg m² on the crank), at the level where their mean of extremes is w."""
    own = inertia + samples.inertia

    def pace(level: float) -> Array:
        return np.asarray(np.sqrt(np.maximum(2 * (level + samples.work) / own, 0.0)))

    def miss(level: float) -> float:
        omega = pace(level)
        return float(0.5 * (omega.max() + omega.min()) / samples.speed - 1)

    top = float(0.5 * own.max() * samples.speed**2 + np.abs(samples.work).max())
    return pace(instant(miss, -float(samples.work.min()), 4 * top))


def irregularity(omega: Array) -> float:
    """2 (w_max - w_min)/(w_max + w_min)."""
    return float(2 * (omega.max() - omega.min()) / (omega.max() + omega.min()))


# -- cycles that are run until they close -----------------------------------------------------------------------------

_GUESS = 360  # angles of the grid that the search starts from
_MOST_RUNS = 60
_DIFFERENCE = 1e-3  # of an unknown's scale, by which it is first varied: above the noise of rough steps
_OFF = 0.01  # of an irregularity, by which the end of a search may lack what was asked
_STOPS = 1e3  # what a machine that does not get through its cycle lacks


class Trial(NamedTuple):
    """A cycle to be run: flywheel (kg m² on the crank), the unknown's value (SI), speed (rad/s) and current (A) at phi = 0.

    `period` is about how long it takes (s).
    """

    inertia: float
    balance: float
    speed: float
    current: float
    period: float


class Revolution(NamedTuple):
    """What a run of one cycle ends with: speed and current at its end, greatest and least speed on the way."""

    speed: float
    current: float
    greatest: float
    least: float


class Stretch(NamedTuple):
    """Angles (rad) that are stepped in one go; `middle` is inside their smooth piece, None without restart."""

    low: float
    high: float
    middle: float | None


def stretches_of(machine: Machine, restart: bool) -> list[Stretch]:
    """The cycle in one go, or from one place where the machine's loads and ratios break to the next."""
    if not restart:
        return [Stretch(0.0, machine.scene.cycle, None)]
    return [Stretch(a, b, 0.5 * (a + b)) for a, b in pairwise(machine.restarts.tolist())]


class NoAnswerError(ValueError):
    """A method that does not come to an answer; the message says why."""


Revolve = Callable[[Trial], Revolution]


class _Scales(NamedTuple):
    """The guess that unknowns are measured from, and the change of each that matters: about the irregularity's share."""

    guess: Trial
    inertia: float
    balance: float
    speed: float
    current: float
    irregularity: float


def by_shooting(asked: Question, revolve: Revolve, tolerance: float) -> float:
    """The answer from cycles run by `revolve`, to a tolerance of its search (relative).

    Raises:
        NoAnswerError: where the search comes to no motion.

    """
    scales = _scales(asked)
    names = _unknowns(asked)

    def trial(x: Array) -> Trial:
        shares = zip(names, (x - 1.0).tolist(), strict=True)
        return scales.guess._replace(**{name: getattr(scales.guess, name) + d * getattr(scales, name) for name, d in shares})

    def lacking(x: Array) -> list[float]:
        tried = trial(x)
        found = revolve(tried) if tried.speed > 0.0 else None
        if found is None or not np.isfinite(found).all() or found.least <= 0.0:
            return [_STOPS] * len(names)
        return _lacking(asked, scales, tried, found)

    options: Any = {"xtol": max(tolerance, 1e-14), "eps": _DIFFERENCE**2, "maxfev": _MOST_RUNS}
    found: Any = root(lacking, np.ones(len(names)), method="hybr", options=options)
    if not np.isfinite(found.fun).all() or np.abs(found.fun).max() > _OFF:
        raise NoAnswerError("its cycles come to no steady motion")
    last = trial(found.x)
    if asked.sized:
        return max(last.inertia, 0.0) / asked.crank
    end = revolve(last)
    return 2 * (end.greatest - end.least) / (end.greatest + end.least)


def _unknowns(asked: Question) -> list[str]:
    """The names of what is unknown at the start of the cycle."""
    machine = asked.machine
    names = ["speed"] + (["inertia"] if asked.sized else [])
    names += ["balance"] if machine.scene.unknown is not None else []
    return names + (["current"] if circuit_of(machine.scene) is not None else [])


def _lacking(asked: Question, scales: _Scales, tried: Trial, found: Revolution) -> list[float]:
    """As many as there are unknowns: irregularity, mean of extremes, closure of speed and of current, each in its scale."""
    machine, eps = asked.machine, scales.irregularity
    mean = 0.5 * (found.greatest + found.least)
    lacks = []
    if asked.sized:
        lacks.append((found.greatest - found.least) / (mean * eps) - 1.0)
    held = machine.scene.unknown is not None or not machine.sets_its_speed
    if held:
        lacks.append((mean / (machine.scene.speed or 1.0) - 1.0) / eps)
    if machine.scene.unknown is not None or machine.sets_its_speed:
        lacks.append((found.speed - tried.speed) / (mean * eps))
    if circuit_of(machine.scene) is not None:
        lacks.append((found.current - tried.current) / scales.current)
    return lacks


def _scales(asked: Question) -> _Scales:
    """A guess from a plain grid at constant speed, and what changes of it matter."""
    machine, scene = asked.machine, asked.machine.scene
    samples = sampled(machine, _GUESS)
    own = float(samples.inertia.mean())
    if asked.sized:
        eps = scene.irregularity or 0.0
        inertia = max(total(samples, eps), 1e-3 * own)
        omega = speeds(samples, inertia)
    else:
        inertia = (scene.inertia or 0.0) * asked.crank
        omega = speeds(samples, inertia)
        eps = max(irregularity(omega), 1e-12)
    unit = samples.unit * eps * (inertia + own) * samples.speed**2
    if not unit:
        unit = eps * (abs(samples.balance) or 1.0)
    current = _current(asked, samples)
    period = float(np.trapezoid(1.0 / np.maximum(omega, 1e-3 * samples.speed), samples.phi))
    guess = Trial(inertia, samples.balance, float(omega[0]), current, period)
    return _Scales(guess, inertia + own, unit, eps * samples.speed, max(abs(current), 1.0) * eps, eps)


def _current(asked: Question, samples: Samples) -> float:
    """The steady current (A) of a motor with inductance at constant speed; 0 without one."""
    scene = asked.machine.scene
    circuit = circuit_of(scene)
    if circuit is None or scene.drive is None:
        return 0.0
    omega = scene.shafts[scene.drive.on] * samples.speed
    torque_of_one = circuit.torque_of_current(omega, 1.0) - circuit.torque_of_current(omega, 0.0)
    zero, one = circuit.current_rate(omega, 0.0), circuit.current_rate(omega, 1.0)
    return float(-zero / (one - zero)) if torque_of_one else 0.0


_BETWEEN, _CLOSER = 8, 7


def summit(speed: Callable[[Array], Array], times: Array, sign: float) -> float:
    """The greatest (sign 1) or least (-1) of a speed over time.

    Looked for between given times, and then closer and closer about every sample that stands out and may come to be best.
    """
    wanted = np.append((times[:-1, None] + np.diff(times)[:, None] * np.arange(_BETWEEN) / _BETWEEN).ravel(), times[-1])
    return sign * max(_closer(speed, wanted, k, sign) for k in standing_out(sign * speed(wanted)))


def standing_out(values: Array) -> list[int]:
    """The samples that stand out among their neighbours, as far as a peak beside one may come to be the greatest of all.

    >>> standing_out(np.array([0.0, 1.0, 0.5, 0.98, 0.5, 0.2, 0.3, 0.1]))
    [1, 3]
    """
    steps = np.abs(np.diff(values))
    reach = np.maximum(np.append(steps, 0.0), np.append(0.0, steps))  # what a peak between samples may add, at most
    beside = np.pad(values, 1, constant_values=-np.inf)
    out = (values >= beside[:-2]) & (values >= beside[2:]) & (values + reach >= values.max())
    return [int(k) for k in np.flatnonzero(out)]


def _closer(speed: Callable[[Array], Array], times: Array, k: int, sign: float) -> float:
    best = -np.inf
    for _ in range(_CLOSER):
        times = np.linspace(times[max(k - 1, 0)], times[min(k + 1, times.size - 1)], 2 * _BETWEEN + 1)
        values = sign * speed(times)
        k = int(values.argmax())
        best = max(best, float(values[k]))
    return best


# -- one cycle by steps -----------------------------------------------------------------------------------------------

Rates = Callable[[float, Array], Array]

_MOST_STEPS = 200_000  # in a stretch: a machine that stops within it never gets to its end
_MANY = 100  # steps, past which extremes are looked for beside the best ones only


ADAPTIVE = ("RK45", "DOP853", "LSODA")


def fixed(machine: Machine, name: str, count: int, restart: bool) -> Revolve:
    """Runs cycles by a rule of fixed step, about `count` steps a cycle."""
    tableau = FIXED[name.lower()]

    def stretch_steps(rates: Rates, t: float, state: Array, stretch: Stretch, period: float) -> Iterator[Step]:
        share = (stretch.high - stretch.low) / machine.scene.cycle
        wanted = max(round(count * share), 1)
        h = period * share / wanted if not restart else (stretch.high - state[0]) / state[1] / wanted
        for _ in range(_MOST_STEPS):
            step = partial(runge_kutta_step, tableau, rates, t, state, rate=rates(t, state))
            after = step(h)
            if after[0] >= stretch.high:
                h = instant(lambda length: float(step(length)[0]) - stretch.high, 0.0, h)  # noqa: B023 - called at once
                after = step(h)
                after[0] = stretch.high
            yield Step(_between(rates, t, state, h, after), t, t + h)
            t, state = t + h, after
            if state[0] >= stretch.high:
                return
            if not state[1] > 0.0:
                break
        raise NoAnswerError("the machine stops within its cycle")

    return _revolving(machine, restart, stretch_steps)


def _between(rates: Rates, t: float, state: Array, h: float, after: Array) -> Callable[[Any], Array]:
    """Hermite's cubic over a step; its rates are found when it is first looked into, as few steps ever are."""
    cubic: list[Callable[[Any], Array]] = []

    def dense(times: Any) -> Array:
        if np.ndim(times) == 0 and times == t + h:
            return after
        if not cubic:
            cubic.append(hermite(t, t + h, state, after, rates(t, state), rates(t + h, after)))
        return cubic[0](times)

    return dense


def adaptive(machine: Machine, name: str, rtol: float, restart: bool) -> Revolve:
    """Runs cycles by one of SciPy's integrators at a tolerance of its steps."""
    kind: Any = getattr(integrate, name)

    def stretch_steps(rates: Rates, t: float, state: Array, stretch: Stretch, period: float) -> Iterator[Step]:
        scale: Any = rtol * np.maximum(np.abs(state), [1.0, 0.0, 1.0][: state.size])
        solver = kind(rates, t, state, t + 100 * period, rtol=rtol, atol=scale)
        for _ in range(_MOST_STEPS):
            if solver.status != "running":
                break
            solver.step()
            dense, before = solver.dense_output(), float(solver.t_old)
            if solver.y[0] >= stretch.high:
                end = instant(lambda t: float(dense(t)[0]) - stretch.high, before, float(solver.t))  # noqa: B023
                yield Step(dense, before, end)
                return
            yield Step(dense, before, float(solver.t))
            if not solver.y[1] > 0.0:
                break
        raise NoAnswerError("the machine stops within its cycle")

    return _revolving(machine, restart, stretch_steps)


StretchSteps = Callable[[Rates, float, Array, Stretch, float], Iterator[Step]]


def _revolving(machine: Machine, restart: bool, stretch_steps: StretchSteps) -> Revolve:
    stretches = stretches_of(machine, restart)

    def revolve(trial: Trial) -> Revolution:
        dynamics = Dynamics(machine, trial.inertia, trial.balance)
        state = np.array([0.0, trial.speed] + ([trial.current] if dynamics.circuit is not None else []))
        t, steps = 0.0, list[Step]()
        for stretch in stretches:
            rates = _rates(dynamics, stretch)
            steps += stretch_steps(rates, t, state, stretch, trial.period)
            t = steps[-1].end
            state = np.array(steps[-1].dense(t))
            state[0] = stretch.high
        current = float(state[2]) if state.size > 2 else 0.0
        greatest, least = (extreme(_near(steps, sign), sign)[1] for sign in (1.0, -1.0))
        return Revolution(float(state[1]), current, greatest, least)

    return revolve


def _near(steps: list[Step], sign: float) -> list[Step]:
    """Of many steps those beside ends that stand out as fastest (sign 1) or slowest (-1)."""
    if len(steps) < _MANY:
        return steps
    ends = np.array([steps[0].dense(steps[0].start)[1], *(step.dense(step.end)[1] for step in steps)])
    chosen = {j for k in standing_out(sign * ends) for j in (k - 1, k) if 0 <= j < len(steps)}
    return [steps[j] for j in sorted(chosen)]


def _rates(dynamics: Dynamics, stretch: Stretch) -> Rates:
    machine, middle = dynamics.machine, stretch.middle
    cycle, ends = machine.scene.cycle, (stretch.low, stretch.high)

    def rates(t: float, state: Array) -> Array:
        phi, current = float(state[0]), float(state[2]) if state.size > 2 else 0.0
        if middle is None:
            phi = phi % cycle
            at = dynamics.at(phi, float(machine.anchors(phi)), float(state[1]), current=current)
        else:
            at = dynamics.at(phi, middle, float(state[1]), current=current, ends=ends)
        found = [float(state[1]), float(at.acceleration)]
        return np.array(found if state.size == 2 else [*found, float(at.current_rate)])

    return rates
