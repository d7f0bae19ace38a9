"""Functions of phi on panels between breakpoints, by values at Gauss's nodes."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from tests.oracle.numbers import DIGITS, KIND, Real, bracketed, reals

ORDER = 40 if DIGITS else 20


def legendre(x: Any, count: int) -> Any:
    """P_0(x) .. P_(count-1)(x), along a new last axis."""
    p = [np.ones_like(x), x]
    for k in range(1, count - 1):
        p.append(((2 * k + 1) * x * p[k] - k * p[k - 1]) / (k + 1))
    return np.stack(p[:count], axis=-1)


def _rule() -> tuple[Any, Any, Any]:
    """Nodes, weights, and the matrix from values at the nodes to Legendre coefficients."""
    x = reals(np.polynomial.legendre.leggauss(ORDER)[0])
    for _ in range(4):
        p = legendre(x, ORDER + 1)
        slope = ORDER * (p[:, ORDER - 1] - x * p[:, ORDER]) / (1 - x * x)
        x = x - p[:, ORDER] / slope
    p = legendre(x, ORDER + 1)
    slope = ORDER * (p[:, ORDER - 1] - x * p[:, ORDER]) / (1 - x * x)
    w = 2 / ((1 - x * x) * slope**2)
    k = reals(np.arange(ORDER))
    return x, w, (2 * k + 1) / 2 * w[:, None] * p[:, :ORDER]


NODES, WEIGHTS, FIT = _rule()


def _integrating() -> Any:
    """Coefficients -> those of the integral from -1, one more."""
    matrix = np.zeros((ORDER, ORDER + 1), dtype=KIND)
    for k in range(ORDER):
        matrix[k, k + 1] += Real(1) / (2 * k + 1)
        matrix[k, max(k - 1, 0)] += (-1 if k else 1) * Real(1) / (2 * k + 1)
    return matrix


INTEGRATE = _integrating()
LOOK = reals(np.concatenate(([-1], NODES, [1])))  # where signs are looked at
_AT_LOOK, _AT_NODES = legendre(LOOK, ORDER + 1), legendre(NODES, ORDER + 1)


class Panels(NamedTuple):
    """Panels between ascending edges; half widths and middles as columns, angles at the nodes (panels, ORDER)."""

    edges: Any
    half: Any
    middle: Any
    phi: Any


def panels(edges: Any) -> Panels:
    """Panels between edges."""
    half, middle = (edges[1:, None] - edges[:-1, None]) / 2, (edges[1:, None] + edges[:-1, None]) / 2
    return Panels(edges, half, middle, middle + half * NODES)


def spread(breaks: Any, widest: Any) -> Any:
    """Edges: the breakpoints, and even ones between them that are no further apart than `widest`."""
    result = [breaks[:1]]
    for a, b in itertools.pairwise(breaks):
        count = max(int(np.ceil(float((b - a) / widest))), 1)
        result += [a + (b - a) * reals(np.arange(1, count)) / count, [b]]
    return reals(np.concatenate(result))


def bisected(edges: Any, which: Any) -> Any:
    """The edges with the chosen panels cut in two."""
    return np.sort(np.concatenate((edges, ((edges[1:] + edges[:-1]) / 2)[which])))


def fit(values: Any) -> Any:
    """Legendre coefficients of values at the nodes."""
    return values @ FIT


def tails(values: Any) -> Any:
    """The size of the last three coefficients of every panel."""
    return np.abs(fit(values)[..., -3:]).max(axis=-1)


def integrals(values: Any, half: Any) -> Any:
    """The integral over every panel."""
    return (values @ WEIGHTS) * half[:, 0]


def valued(series: Any, t: Any) -> Any:
    """Every row of coefficients at its own place in [-1, 1]."""
    return (series * legendre(t, series.shape[-1])).sum(axis=-1)


def looked(series: Any) -> Any:
    """Values of series (panels, ORDER) at both ends and the nodes of every panel."""
    return series @ _AT_LOOK[:, : series.shape[-1]].T


class Grown(NamedTuple):
    """The integral of a function from phi = 0: its series on every panel, and its values at the edges."""

    series: Any
    edges: Any

    def looked(self) -> Any:
        """Values at both ends and the nodes of every panel."""
        return looked(self.series)

    def nodes(self) -> Any:
        """Values at the nodes."""
        return self.series @ _AT_NODES.T

    def at(self, panel: Any, t: Any) -> Any:
        """Values at places of panels."""
        return valued(self.series[panel], t)


def grown(values: Any, half: Any) -> Grown:
    """The running integral of values at the nodes."""
    series = fit(values) @ INTEGRATE * half
    edges = np.concatenate(([Real(0)], np.cumsum(integrals(values, half))))
    series[:, 0] += edges[:-1]
    return Grown(series, edges)


class Places(NamedTuple):
    """Places of panels: which one, and where in [-1, 1]."""

    panel: Any
    t: Any

    def angles(self, mesh: Panels) -> Any:
        """Their angles; ends of panels exactly."""
        inside = mesh.middle[self.panel, 0] + mesh.half[self.panel, 0] * self.t
        at_end = np.where(self.t > 0, mesh.edges[self.panel + 1], mesh.edges[self.panel])
        return np.where(np.abs(self.t) == 1, at_end, inside)


def roots(values: Any, exactly: Callable[[Any, Any], Any] | None = None) -> Places:
    """Sign changes of functions, smooth on each panel, between two neighbours of nodes and ends.

    `exactly` has their values at places of panels, where their own series on the panels are not resolved.
    """
    series = fit(values)
    values = looked(series)
    panel, gap = np.nonzero(values[:, 1:] * values[:, :-1] < 0)
    rows = series[panel]
    if panel.size == 0:
        return Places(panel, np.zeros(0, dtype=KIND))
    ends = LOOK[gap], LOOK[gap + 1], values[panel, gap], values[panel, gap + 1]
    return Places(panel, bracketed(lambda t: valued(rows, t) if exactly is None else exactly(panel, t), *ends))


def candidates(values: Any, exactly: Callable[[Any, Any], Any] | None = None) -> Places:
    """Those places, and all ends of panels."""
    result, count = roots(values, exactly), np.arange(len(values))
    ones = np.ones(count.size, dtype=KIND)
    return Places(np.concatenate((result.panel, count, count)), np.concatenate((result.t, -ones, ones)))
