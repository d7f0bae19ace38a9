"""Where a rising function becomes 0, to the last bit: for the few unknowns of a wheel, each cheap to try."""

from __future__ import annotations

from collections.abc import Callable

_DOUBLINGS = 400


def first_true(holds: Callable[[float], bool], low: float, high: float) -> float:
    """The least float from low to high at which something holds that holds from somewhere on; high if not before.

    >>> first_true(lambda x: x * x >= 2.0, 0.0, 2.0)
    1.4142135623730951
    """
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def doubled_until(holds: Callable[[float], bool], start: float) -> float | None:
    """The first of start, 2 start, 4 start... at which something holds; None if that is beyond all bounds.

    >>> doubled_until(lambda x: x > 5, 1.0), doubled_until(lambda x: False, 1.0)
    (8.0, None)
    """
    for k in range(_DOUBLINGS):
        if holds(start * 2.0**k):
            return start * 2.0**k
    return None
