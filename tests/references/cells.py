"""Functions of the crank angle as Legendre series on cells, refined until the series' tails vanish at 34 digits."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import cache
from typing import Any

from mpmath import mp  # type: ignore[import-untyped]

ORDER = 36
TAIL = mp.mpf("1e-36")
WIDEST = 6  # cells per turn at least, as a divisor of a turn


@cache
def rule() -> tuple[list[Any], list[Any], list[list[Any]]]:
    """Gauss's nodes and weights on [-1, 1], and the matrix that takes values at the nodes to Legendre coefficients."""
    guesses = [mp.cos(mp.pi * (ORDER - i - mp.mpf(1) / 4) / (ORDER + mp.mpf(1) / 2)) for i in range(ORDER)]
    nodes = [polished(x) for x in guesses]
    values = [legendre(x, ORDER + 1) for x in nodes]
    slopes = [ORDER * (v[ORDER - 1] - x * v[ORDER]) / (1 - x * x) for x, v in zip(nodes, values, strict=True)]
    weights = [2 / ((1 - x * x) * d * d) for x, d in zip(nodes, slopes, strict=True)]
    series = [[(2 * k + 1) * w * v[k] / 2 for w, v in zip(weights, values, strict=True)] for k in range(ORDER)]
    return nodes, weights, series


def legendre(x: Any, count: int) -> list[Any]:
    """P_0(x) .. P_count(x)."""
    p = [mp.one, x]
    for k in range(1, count):
        p.append(((2 * k + 1) * x * p[k] - k * p[k - 1]) / (k + 1))
    return p


def polished(x: Any) -> Any:
    """A root of P_ORDER near x, by Newton's method."""
    for _ in range(8):
        p = legendre(x, ORDER)
        x -= p[ORDER] * (1 - x * x) / (ORDER * (p[ORDER - 1] - x * p[ORDER]))
    return x


def fitted(values: list[Any]) -> list[Any]:
    """The Legendre coefficients of values at the nodes."""
    return [mp.fdot(row, values) for row in rule()[2]]


def tail(values: list[Any]) -> Any:
    """The size of the last three coefficients."""
    return max(abs(mp.fdot(row, values)) for row in rule()[2][-3:])


def antiderivative(series: list[Any]) -> list[Any]:
    """The integral from -1, as one more Legendre coefficient."""
    up = [mp.zero, *(c / (2 * k + 1) for k, c in enumerate(series))]
    down = [c / (2 * k + 1) for k, c in enumerate(series)][1:]
    total = [u - (down[k] if k < len(down) else mp.zero) for k, u in enumerate(up)]
    total[0] += series[0]
    return total


def valued(series: list[Any], x: Any) -> Any:
    """The sum of a Legendre series at x in [-1, 1]."""
    return mp.fdot(series, legendre(x, len(series)))


def split(breaks: list[Any], widest: Any) -> list[tuple[Any, Any, Any]]:
    """(piece's middle, cell's start, cell's end) of the first cells between breakpoints."""
    cells = []
    for a, b in itertools.pairwise(breaks):
        n = int(mp.ceil((b - a) / widest))
        cells += [((a + b) / 2, a + (b - a) * i / n, a + (b - a) * (i + 1) / n) for i in range(n)]
    return cells


def nodes_of(start: Any, end: Any) -> list[Any]:
    """The angles of a cell's nodes."""
    return [start + (end - start) * (x + 1) / 2 for x in rule()[0]]


def integral(start: Any, end: Any, values: list[Any]) -> Any:
    """The integral over a cell of values at its nodes."""
    return (end - start) / 2 * mp.fdot(rule()[1], values)


def refined(function: Callable[[Any], Any], start: Any, end: Any) -> Any:
    """The integral of a function over an interval, halved until every half's tail vanishes."""
    values = [function(phi) for phi in nodes_of(start, end)]
    if tail(values) <= mp.mpf("1e-26") * max(map(abs, values)):
        return integral(start, end, values)
    middle = (start + end) / 2
    return refined(function, start, middle) + refined(function, middle, end)
