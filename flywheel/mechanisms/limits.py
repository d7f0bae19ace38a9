"""Where a crank locks, and where it comes so near to it that cells must be short."""

from __future__ import annotations

from collections.abc import Iterable
from math import acos, acosh, asin, degrees, inf, pi, tau

from flywheel.faults import Fault

TOUCH = 1e-12  # lengths that differ by less than this share are equal: "0.1 m" and "100 mm" must be
GROWTH = 2.5  # each cell then reaches 1.5 times its distance from the singularity


def exceeds(a: float, b: float) -> bool:
    """Whether length a is truly above length b, by more than rounding."""
    return bool(a - b > TOUCH * max(abs(a), abs(b)))


def graded(centre: float, distance: float, reach: float = 1.0) -> list[float]:
    """Breakpoints about a complex singularity that hovers `distance` (rad) above the real angle `centre` (rad).

    They stand at the centre and at distance, 2.5 distance, 6.25 distance... to both sides within `reach` (rad), so that
    a polynomial of order 16 follows 1/z on every cell to about 1e-10. None where the singularity is beyond reach/2.

    >>> graded(3.0, 0.25)
    [2.375, 2.75, 3.0, 3.25, 3.625]
    >>> graded(3.0, 0.6)
    []
    """
    if distance > reach / 2:
        return []
    steps = []
    while 0 < distance < reach:
        steps.append(distance)
        distance *= GROWTH
    return [*(centre - s for s in reversed(steps)), centre, *(centre + s for s in steps)]


def within_turn(angles: Iterable[float]) -> tuple[float, ...]:
    """The angles (rad) brought into [0, 2 pi), ascending, each once."""
    return tuple(sorted({angle % tau % tau for angle in angles}))


def above_one(value: float) -> float:
    """Distance (rad) from the real axis to where the sine or cosine of an angle takes `value` >= 1."""
    return acosh(max(float(value), 1.0)) if value < inf else inf


def where_sine(value: float) -> list[float]:
    """Angles (rad) in a turn whose sine is `value`: two, one or none; an extreme missed by rounding counts."""
    if abs(value) > 1 + 4 * TOUCH:
        return []
    half = asin(min(1.0, max(-1.0, value)))
    return [half] if abs(value) >= 1 - TOUCH else [half, pi - half]


def where_cosine(value: float) -> list[float]:
    """Angles (rad) in a turn whose cosine is `value`: two, one or none; an extreme missed by rounding counts."""
    if abs(value) > 1 + 4 * TOUCH:
        return []
    half = acos(min(1.0, max(-1.0, value)))
    return [half] if abs(value) >= 1 - TOUCH else [half, tau - half]


def lock_fault(path: str, length: float, expected: str, angles: Iterable[float]) -> Fault:
    """The fault of a length (m) for which the crank cannot turn, naming the angles (rad) where it locks."""
    listed = [f"{degrees(angle):.6g}" for angle in within_turn(angles)]
    where = f"the crank locks at {_enumerated(listed)} deg" if listed else "it closes at no crank angle"
    return Fault(path, f"{float(length):.9g} m", expected, where)


def _enumerated(items: list[str]) -> str:
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)
