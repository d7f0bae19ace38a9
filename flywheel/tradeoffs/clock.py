"""A time limit that methods meet while they work: it is looked at with every evaluation of the machine."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from flywheel.cost import Tally, counted


class OutOfTimeError(Exception):
    """A method that was not done when the time was over."""


@contextmanager
def limited(end: float) -> Iterator[Tally]:
    """Count what is evaluated inside; once `time.perf_counter()` is past `end` (s), OutOfTimeError ends it."""

    def look() -> None:
        if time.perf_counter() > end:
            raise OutOfTimeError

    with counted(look) as tally:
        yield tally
