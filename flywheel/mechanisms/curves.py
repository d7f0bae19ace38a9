"""Curves that a law follows: a position with its two derivatives, by an expression or by a periodic spline."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flywheel.formulas.expressions import Expression
from flywheel.formulas.jets import Jet, jet_namespace
from flywheel.scene import Table

Array = NDArray[np.float64]


class Curve(Protocol):
    """A position against an angle in [0, period), smooth between its breakpoints."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Angles (rad) in [0, period) where another formula begins or a cell must end."""
        ...

    def jet(self, phi: Any, anchor: Any, ns: Any) -> Jet:
        """Position with its two derivatives at phi, by the formula that holds at the anchor (floats)."""
        ...


class FormulaCurve(NamedTuple):
    """A position by an expression of phi and the scene's parameters (SI)."""

    expression: Expression
    parameters: Mapping[str, float]
    breakpoints: tuple[float, ...] = ()

    def jet(self, phi: Any, anchor: Any, ns: Any) -> Jet:
        """Position with its two derivatives at phi; every switch is decided at the anchor.

        >>> import numpy as np
        >>> from flywheel.formulas.expressions import parse
        >>> FormulaCurve(parse("abs(phi**2 - 1)"), {}).jet(2.0, 2.0, np)
        Jet(3.0, 4.0, 2.0)
        """
        values = {**self.parameters, "phi": Jet(phi, 1.0, 0.0)}
        found = self.expression.evaluate(values, _jets_over(ns), {**self.parameters, "phi": anchor})
        return found if isinstance(found, Jet) else Jet(found, 0.0, 0.0)


_JETS: dict[int, tuple[Any, Any]] = {}


def _jets_over(ns: Any) -> Any:
    """The jets over a namespace, made once: the namespace is kept beside them, so that its id stays its own."""
    if id(ns) not in _JETS:
        _JETS[id(ns)] = ns, jet_namespace(ns)
    return _JETS[id(ns)][1]


class SplineCurve(NamedTuple):
    """A position by cubics: from knots[i] to the next one, the sum of coefficients[k, i] (phi - knots[i])^(3 - k)."""

    knots: Array
    coefficients: Array

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """The knots but the last, where the third derivative jumps."""
        return tuple(self.knots[:-1].tolist())

    def jet(self, phi: Any, anchor: Any, ns: Any) -> Jet:
        """Position with its two derivatives at phi, by the cubic on which the anchor lies."""
        span = np.searchsorted(self.knots[1:-1], anchor, side="right")
        c3, c2, c1, c0 = self.coefficients[:, span]
        step = phi - self.knots[span]
        value = ((c3 * step + c2) * step + c1) * step + c0
        return Jet(value, (3 * c3 * step + 2 * c2) * step + c1, 6 * c3 * step + 2 * c2)


def spline_curve(table: Table, period: float) -> SplineCurve:
    """The periodic cubic spline (C²) through a table that spans the period, from whatever angle it starts.

    Where its last value differs from the first, the steady part of the motion is taken off before the spline is laid,
    and put back after.
    """
    from scipy.interpolate import CubicSpline  # only scenes with such a table pay for it

    start = table.angle[0]
    drift = (table.value[-1] - table.value[0]) / period
    swaying = table.value - drift * (table.angle - start)
    swaying[-1] = swaying[0]
    spline = CubicSpline(table.angle, swaying, bc_type="periodic")
    knots, coefficients = _from_zero(np.asarray(spline.x), np.asarray(spline.c), period)
    coefficients[3] += drift * (knots[:-1] - start)
    coefficients[2] += drift
    return SplineCurve(knots, coefficients)


def _from_zero(knots: Array, coefficients: Array, period: float) -> tuple[Array, Array]:
    """The same periodic cubics with knots from 0 to the period, the piece across 0 cut in two."""
    inner = np.unique(knots[:-1] % period)
    inner = inner[(inner > _SAME * period) & (inner < (1 - _SAME) * period)]
    edges = np.concatenate(([0.0], inner, [period]))
    middles = 0.5 * (edges[1:] + edges[:-1])
    turns = np.floor((middles - knots[0]) / period) * period
    piece = np.searchsorted(knots, middles - turns, side="right") - 1
    step = edges[:-1] - turns - knots[piece]
    c3, c2, c1, c0 = coefficients[:, piece]
    moved = (c3, c2 + 3 * c3 * step, c1 + (2 * c2 + 3 * c3 * step) * step, c0 + (c1 + (c2 + c3 * step) * step) * step)
    return edges, np.stack(moved)


_SAME = 1e-12  # of the period: knots closer than this are one
