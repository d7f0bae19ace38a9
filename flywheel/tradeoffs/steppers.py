"""One cycle stepped in time by the methods that everybody has: Euler, RK4, and SciPy's RK45, DOP853 and LSODA.

Each with and without a restart where the machine's loads and ratios break. Without one, steps run over jumps and windows
as a script's do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import integrate
from scipy.optimize import brentq

from flywheel.confirmation import extreme
from flywheel.instant import Dynamics
from flywheel.machine import Machine
from flywheel.stepping import Step
from flywheel.tradeoffs.shooting import NoAnswerError, Revolution, Revolve, Stretch, Trial, standing_out, stretches_of

Array = NDArray[np.float64]
Rates = Callable[[float, Array], Array]
Rule = Callable[[Rates, float, Array, float], Array]

_MOST_STEPS = 200_000  # in a stretch: a machine that stops within it never gets to its end
_LANDINGS = 8
_MANY = 100  # steps, past which extremes are looked for beside the best ones only


def euler(rates: Rates, t: float, state: Array, step: float) -> Array:
    """Euler's step."""
    return np.asarray(state + step * rates(t, state))


def runge_kutta(rates: Rates, t: float, state: Array, step: float) -> Array:
    """The classical Runge-Kutta step of order 4."""
    k1 = rates(t, state)
    k2 = rates(t + 0.5 * step, state + 0.5 * step * k1)
    k3 = rates(t + 0.5 * step, state + 0.5 * step * k2)
    k4 = rates(t + step, state + step * k3)
    return np.asarray(state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


FIXED: dict[str, Rule] = {"Euler": euler, "RK4": runge_kutta}
ADAPTIVE = ("RK45", "DOP853", "LSODA")


def fixed(machine: Machine, name: str, count: int, restart: bool) -> Revolve:
    """Runs cycles by a rule of fixed step, about `count` steps a cycle."""
    rule = FIXED[name]

    def stretch_steps(rates: Rates, t: float, state: Array, stretch: Stretch, period: float) -> Iterator[Step]:
        share = (stretch.high - stretch.low) / machine.scene.cycle
        wanted = max(round(count * share), 1)
        h = period * share / wanted if not restart else (stretch.high - state[0]) / state[1] / wanted
        for _ in range(_MOST_STEPS):
            after = rule(rates, t, state, h)
            if after[0] >= stretch.high:
                h, after = _landed(rule, rates, t, state, h, stretch.high)
            yield Step(_between(rates, t, state, h, after), t, t + h)
            t, state = t + h, after
            if state[0] >= stretch.high:
                return
            if not state[1] > 0.0:
                break
        raise NoAnswerError("the machine stops within its cycle")

    return _revolving(machine, restart, stretch_steps)


def _landed(rule: Rule, rates: Rates, t: float, state: Array, h: float, high: float) -> tuple[float, Array]:
    """The step that ends exactly at an angle, by secants on its length."""
    length = h
    for _ in range(_LANDINGS):
        after = rule(rates, t, state, length)
        miss = after[0] - high
        if abs(miss) <= 4e-16 * high:
            break
        length -= miss / after[1]
    after[0] = high
    return length, after


def _between(rates: Rates, t: float, state: Array, h: float, after: Array) -> Callable[[Any], Array]:
    """Hermite's cubic over a step."""
    slopes: list[Array] = []

    def dense(times: Any) -> Array:
        if np.ndim(times) == 0 and times == t + h:
            return after
        if not slopes:  # few steps are ever looked into
            slopes.extend((rates(t, state), rates(t + h, after)))
        s = np.asarray((np.asarray(times) - t) / h)
        parts = (2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, 3 * s**2 - 2 * s**3, s**3 - s**2)
        rows = (state, h * slopes[0], after, h * slopes[1])
        return np.asarray(sum(np.multiply.outer(row, part) for row, part in zip(rows, parts, strict=True)))

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
                yield Step(dense, before, _passage(dense, stretch.high, before, float(solver.t)))
                return
            yield Step(dense, before, float(solver.t))
            if not solver.y[1] > 0.0:
                break
        raise NoAnswerError("the machine stops within its cycle")

    return _revolving(machine, restart, stretch_steps)


def _passage(dense: Callable[[Any], Array], high: float, before: float, after: float) -> float:
    """When an angle is passed within a step."""
    return float(brentq(lambda t: float(dense(t)[0]) - high, before, after, xtol=1e-15 * after, rtol=1e-15))


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
