"""Methods run one after the other within a budget of time, each with its time and its evaluations."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from flywheel.faults import SceneError
from flywheel.tradeoffs.clock import OutOfTimeError, limited
from flywheel.tradeoffs.methods import Method
from flywheel.tradeoffs.shooting import NoAnswerError

_REPEATS = 7
_ENOUGH = 0.25  # seconds of repeating after which no more is repeated
_LONGEST = 0.1  # of the budget, for one method
_LEAST = 0.05  # seconds that any method gets
_ROUNDS, _CLOSE = 25, 1.6  # of the deciding round, for all whose time is within this factor of the least
_AT_MOST = 2.0  # seconds that the deciding round takes

DONE, FAILED, OUT_OF_TIME, LEFT = "done", "no answer", "out of time", "not run"

Progress = Callable[[int, int, str], None]


class Run(NamedTuple):
    """What became of a method: its answer, times of its repeats (s), evaluations, or the reason why there is none."""

    method: Method
    outcome: str
    value: float | None = None
    times: tuple[float, ...] = ()
    evaluations: int | None = None
    reason: str = ""

    @property
    def seconds(self) -> float | None:
        """Median of its times."""
        return statistics.median(self.times) if self.times else None

    @property
    def least(self) -> float:
        """The least of its times (s): what it takes where nothing disturbs it."""
        return min(self.times, default=float("inf"))


class Measured(NamedTuple):
    """Every method's run, whether the user stopped it, and how long all took (s)."""

    runs: list[Run]
    interrupted: bool
    seconds: float


def measured(methods: Sequence[Method], budget: float, progress: Progress | None = None, spent: float = 0.0) -> Measured:
    """Run methods until all are done, the budget (s) is spent, or the user interrupts.

    What is `spent` already counts, but half of the budget is left for methods whatever it was.
    """
    begun = time.perf_counter() - spent
    over = begun + max(budget, spent + 0.5 * budget)
    runs: list[Run] = []
    interrupted = False
    try:
        for k, method in enumerate(methods):
            if progress is not None:
                progress(k, len(methods), method.name)
            runs.append(_next(method, runs, over - time.perf_counter(), budget))
    except KeyboardInterrupt:
        interrupted = True
    runs += [Run(method, LEFT, reason="interrupted") for method in methods[len(runs) :]]
    return Measured(runs, interrupted, time.perf_counter() - begun)


def _next(method: Method, before: Sequence[Run], left: float, budget: float) -> Run:
    """A method's run, unless the budget is spent, or a rougher setting of the same has already taken too long."""
    if left <= 0.0:
        return Run(method, LEFT, reason="the budget was spent")
    slow = any(run.method.group == method.group and run.outcome in (OUT_OF_TIME, LEFT) for run in before)
    if slow:
        return Run(method, LEFT, reason="a rougher setting took too long already")
    return _run(method, min(left, max(_LONGEST * budget, _LEAST)))


def _run(method: Method, limit: float) -> Run:
    """One method, repeated while that costs little; the first of several repeats only warms up."""
    end = time.perf_counter() + limit
    try:
        with np.errstate(all="ignore"):
            with limited(end) as tally:
                seconds, value = _timed(method)
            times = [seconds]
            while len(times) <= _REPEATS and sum(times) < min(_ENOUGH, limit):
                times.append(_timed(method)[0])
    except OutOfTimeError:
        return Run(method, OUT_OF_TIME, reason=f"stopped after {limit:.2g} s")
    except (SceneError, NoAnswerError, ArithmeticError, ValueError, RuntimeError) as error:
        return Run(method, FAILED, reason=_line(error))
    if not np.isfinite(value):
        return Run(method, FAILED, reason="no finite answer")
    return Run(method, DONE, float(value), tuple(times[1:] or times), tally.evaluations)


def _timed(method: Method) -> tuple[float, float]:
    start = time.perf_counter()
    value = method.answer()
    return time.perf_counter() - start, value


def _line(error: Exception) -> str:
    text = str(error).splitlines()
    return text[0] if text else type(error).__name__


def decided(runs: Iterable[Run]) -> tuple[list[Run], bool]:
    """The runs that are close to the fastest of them, timed again in turns so that what disturbs one disturbs all.

    Also whether the user stopped that.
    """
    given = [run for run in runs if run.times]
    fastest = min((run.least for run in given), default=0.0)
    close = [run for run in given if run.least <= _CLOSE * fastest]
    if len(close) < 2:
        return close, False
    rounds = int(min(_ROUNDS, max(_AT_MOST / sum(run.least for run in close), 1.0)))
    times: list[list[float]] = [[] for _ in close]
    try:
        with np.errstate(all="ignore"):
            for _ in range(rounds):
                for own, run in zip(times, close, strict=True):
                    own.append(_timed(run.method)[0])
    except KeyboardInterrupt:
        return close, True
    return [run._replace(times=tuple(own)) for run, own in zip(close, times, strict=True)], False
