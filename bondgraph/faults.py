"""What can be wrong with a graph, as one kind of error."""

from __future__ import annotations

import math
from collections.abc import Iterable


class GraphError(ValueError):
    """A graph that is not well formed, or that cannot be treated as asked; says which elements and bonds are concerned."""


def refuse(faults: Iterable[str]) -> None:
    """Raise a GraphError that lists all faults, a line each; nothing happens where there are none."""
    lines = list(faults)
    if lines:
        raise GraphError("\n".join(lines))


def size_faults(numbers: Iterable[tuple[str, float]]) -> list[str]:
    """A line for every number, given with its name, that is not finite or not above 0.

    >>> size_faults([("length", 2.0), ("mass", -1.0)])
    ['mass: found -1.0, expected a number above 0']
    """
    return [
        f"{name}: found {value}, expected a number above 0"
        for name, value in numbers
        if not (math.isfinite(value) and value > 0)
    ]
