"""How many positions a graph is walked at: a tally that whoever wants to know starts, and that costs nothing else.

>>> with counted() as tally:
...     count(17)
>>> tally.evaluations
17
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any


class Tally:
    """Evaluations counted so far. A tally inside another one counts for both.

    `watch` is called each time that something is counted; what it raises ends the work.
    """

    def __init__(self, outer: Tally | None = None, watch: Callable[[], None] | None = None) -> None:
        self.evaluations = 0
        self._outer, self._watch = outer, watch

    def add(self, evaluations: int) -> None:
        """Count more of them."""
        self.evaluations += evaluations
        if self._watch is not None:
            self._watch()
        if self._outer is not None:
            self._outer.add(evaluations)


_TALLY: ContextVar[Tally | None] = ContextVar("tally", default=None)


@contextmanager
def counted(watch: Callable[[], None] | None = None) -> Iterator[Tally]:
    """Count what is evaluated inside, in this thread: `tally.evaluations`, also while it goes on.

    `watch` is called with every evaluation, and may raise to put an end to it.
    """
    tally = Tally(_TALLY.get(), watch)
    token = _TALLY.set(tally)
    try:
        yield tally
    finally:
        _TALLY.reset(token)


def count(positions: Any) -> None:
    """Count positions, given as their number or as themselves: an array, a number, an interval of arrays."""
    tally = _TALLY.get()
    if tally is not None:
        tally.add(positions if isinstance(positions, int) else _number(positions))


def _number(positions: Any) -> int:
    size = getattr(getattr(positions, "lo", positions), "size", 1)
    return size if isinstance(size, int) else 1
