"""Answers from motions alone: one cycle is run again and again until it closes and has what was asked.

What is unknown at the start of the cycle (its speed, a motor's current, the balance, the flywheel) is found by Powell's
hybrid method on what the cycle lacks at its end. Whatever runs the cycle can be plugged in.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from flywheel.machine import Machine
from flywheel.moments import circuit_of
from flywheel.tradeoffs import grids
from flywheel.tradeoffs.question import Question

Array = NDArray[np.float64]

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
    samples = grids.sampled(machine, _GUESS)
    own = float(samples.inertia.mean())
    if asked.sized:
        eps = scene.irregularity or 0.0
        inertia = max(grids.total(samples, eps), 1e-3 * own)
        omega = grids.speeds(samples, inertia)
    else:
        inertia = (scene.inertia or 0.0) * asked.crank
        omega = grids.speeds(samples, inertia)
        eps = max(grids.irregularity(omega), 1e-12)
    unit = samples.unit * eps * (inertia + own) * samples.speed**2
    if not unit:
        unit = eps * (abs(samples.balance) or 1.0)
    current = _current(asked, samples)
    period = float(np.trapezoid(1.0 / np.maximum(omega, 1e-3 * samples.speed), samples.phi))
    guess = Trial(inertia, samples.balance, float(omega[0]), current, period)
    return _Scales(guess, inertia + own, unit, eps * samples.speed, max(abs(current), 1.0) * eps, eps)


def _current(asked: Question, samples: grids.Samples) -> float:
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
