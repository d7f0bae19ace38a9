"""How long a search may go on before it is given up, counted in work and not in seconds: the same on every machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from flywheel.faults import Fault, SceneError

_LEFT: ContextVar[list[float] | None] = ContextVar("left", default=None)


class ImpatientError(SceneError):
    """A search that was given up."""


@contextmanager
def patience(work: float) -> Iterator[None]:
    """Let what is searched for inside take so much work at most; unbounded outside.

    >>> with patience(10):
    ...     spend(8)
    """
    token = _LEFT.set([work])
    try:
        yield
    finally:
        _LEFT.reset(token)


def spend(work: float) -> None:
    """Count work done. Raises ImpatientError once there was too much of it."""
    left = _LEFT.get()
    if left is None:
        return
    left[0] -= work
    if left[0] < 0.0:
        found = "a steady motion that is not found in bearable time"
        expected = "one that the search comes to"
        advice = "follow the machine in time: flywheel simulate"
        raise ImpatientError([Fault("regime", found, expected, advice)])
