"""Cost of a result, in positions of the crank and seconds, and limits of the cost of a search."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, NamedTuple

from bondgraph.numerics import Tally, count, counted
from flywheel.numerics.faults import Fault, SceneError

__all__ = ["FREE", "BudgetError", "Cost", "Meter", "Tally", "count", "counted", "limited", "portion", "spend"]


class Cost(NamedTuple):
    """Positions of the crank at which the machine was evaluated, and seconds of wall clock.

    An evaluation is one position at which the machine's bond graph is walked, or at which torques are computed for
    another speed; with losses in meshes, one for each of them. `stages` has the cost of each stage of the work.

    >>> Cost(34, 0.001, {"figures": Cost(34, 0.001)}).as_dict()
    {'evaluations': 34, 'seconds': 0.001, 'figures': {'evaluations': 34, 'seconds': 0.001}}
    """

    evaluations: int
    seconds: float
    stages: dict[str, Cost] = {}  # noqa: RUF012

    def as_dict(self) -> dict[str, Any]:
        """Times for JSON: the whole, and each stage under its own name."""
        parts = {name: stage.as_dict() for name, stage in self.stages.items()}
        return {"evaluations": self.evaluations, "seconds": self.seconds, **parts}


FREE = Cost(0, 0.0)
_LEFT: ContextVar[list[float] | None] = ContextVar("left", default=None)  # work that a search may still take


@dataclass
class Meter:
    """A running measurement, from the counter of evaluations: `cost` is the cost so far.

    >>> with counted() as tally:
    ...     meter = Meter(tally)
    ...     count(5)
    >>> meter.lap().evaluations, meter.lap().evaluations
    (5, 0)
    """

    tally: Tally
    start: float = field(default_factory=perf_counter)
    before: Cost = FREE

    @property
    def cost(self) -> Cost:
        """Evaluations and seconds since the beginning."""
        return Cost(self.tally.evaluations, perf_counter() - self.start)

    def lap(self) -> Cost:
        """Evaluations and seconds since the last lap."""
        before, self.before = self.before, self.cost
        return Cost(self.before.evaluations - before.evaluations, self.before.seconds - before.seconds)


class BudgetError(SceneError):
    """A search that exceeded its allowed work."""


@contextmanager
def limited(work: float) -> Iterator[None]:
    """Limits the work of searches in the block, equally on every machine; without it there is no limit.

    >>> with limited(10):
    ...     spend(8)
    """
    token = _LEFT.set([work])
    try:
        yield
    finally:
        _LEFT.reset(token)


@contextmanager
def portion(share: float) -> Iterator[None]:
    """Limits the block to a share of the remaining work, so that some remains for later attempts.

    >>> with limited(10):
    ...     with portion(0.5):
    ...         spend(4)
    ...     spend(5)
    """
    left = _LEFT.get()
    if left is None:
        yield
        return
    allowed = share * left[0]
    inner = [allowed]
    token = _LEFT.set(inner)
    try:
        yield
    finally:
        _LEFT.reset(token)
        left[0] -= allowed - inner[0]


def spend(work: float) -> None:
    """Counts work; raises BudgetError beyond the limit."""
    left = _LEFT.get()
    if left is None:
        return
    left[0] -= work
    if left[0] < 0.0:
        defect = "no steady motion within the search limit"
        expected = "a steady motion"
        advice = "follow the machine in time: flywheel simulate"
        raise BudgetError([Fault("regime", defect, expected, advice)])
