"""Cells narrow enough for an expression: none so wide that a polynomial could pass a feature without seeing it.

Samples cannot show this. sin(phi) + 100 exp(-((phi - 2)/0.01)²) on one cell of 24 nodes looks like a sine to its last
coefficient. Enclosures can: whatever a function of the tree may do in a cell is known from the bounds of its argument,
and from the distance to its nearest singularity. Rates of convergence after L. N. Trefethen, Approximation Theory and
Approximation Practice, SIAM 2013, chapter 8.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.formulas import intervals, trees
from flywheel.formulas.expressions import Expression
from flywheel.formulas.intervals import Interval, interval
from flywheel.formulas.jets import Jet
from flywheel.formulas.switching import Array, Enclosures, SwitchingError, Values
from flywheel.formulas.trees import At, Node

Mask = NDArray[np.bool_]

CELL_CAP = 10_000  # more would take seconds
FINEST = 1e-14  # of the range: narrower cells are no longer split

_EXPONENT = 8.0  # widest range of an exponential's argument
_NEGLIGIBLE = 1e-20  # of the greatest value that an exponential or power takes
_PHASE = 3.0  # widest range of a sine's argument
_POLE = 3.0  # greatest ratio of the distances from a pole
_BRANCH = 6.0  # greatest ratio of the distances from a branch point
_TAME_POWER = 8  # up to here a power of what 17 nodes resolve is resolved by them


class _Cells(NamedTuple):
    """Cells under examination: their bounds in interval arithmetic, values in their middles, share of the range."""

    bounds: At
    middle: At
    share: Array
    peaks: dict[int, float]

    def enclosure(self, node: Node) -> Interval:
        u = interval(trees.value(node, self.bounds))
        return Interval(*(np.broadcast_to(np.asarray(end, dtype=float), self.share.shape) for end in (u.lo, u.hi)))

    def rounding(self, node: Node) -> Array:
        """Width of a node's bounds in the middles: what rounding alone gives it."""
        assert self.bounds.anchor is not None
        return np.asarray(interval(trees.value(node, self.bounds.anchor)).width)

    def peak(self, key: Node, values: Any, active: Mask) -> float:
        """Greatest value found so far for a node, at places where it counts."""
        here = np.broadcast_to(np.asarray(values, dtype=float), active.shape)[active]
        greatest = float(np.max(here[np.isfinite(here)], initial=-np.inf))
        self.peaks[id(key)] = max(self.peaks.get(id(key), -np.inf), greatest)
        return self.peaks[id(key)]


def resolved(expression: Expression, lo: Array, hi: Array, env: Enclosures, env_value: Values) -> Array:
    """Angles at which the cells from `lo` to `hi` (rad) must be split further for 17 nodes to follow an expression.

    The cells must lie between the expression's breakpoints; `env` and `env_value` are those of `breakpoints`.
    Raises SwitchingError where a denominator comes to zero, a tangent is infinite, or 10 000 cells do not do.

    >>> from flywheel.formulas.expressions import parse
    >>> peak = parse("sin(phi) + exp(-((phi - 2)/1e-3)**2)")
    >>> cells = lambda lo, hi, anchor: {"phi": Jet(Interval(lo, hi), 1.0)}
    >>> splits = resolved(peak, np.array([0.0]), np.array([6.0]), cells, lambda phi, _: {"phi": phi})
    >>> bool(np.min(np.diff(splits)) < 4e-3)
    True
    """
    lo, hi = np.asarray(lo, dtype=float), np.asarray(hi, dtype=float)
    span = float(hi.max() - lo.min())
    splits: list[Array] = [np.array([])]
    peaks: dict[int, float] = {}
    count = lo.size
    while lo.size:
        middle = 0.5 * (lo + hi)
        wide = _too_wide(expression, _examined(lo, hi, span, env, env_value, peaks))
        lo, hi, middle = lo[wide], hi[wide], middle[wide]
        count += lo.size
        _check(expression, lo, hi, span, count)
        splits.append(middle)
        lo, hi = np.concatenate((lo, middle)), np.concatenate((middle, hi))
    return np.sort(np.concatenate(splits))


def _examined(lo: Array, hi: Array, span: float, env: Enclosures, env_value: Values, peaks: dict[int, float]) -> _Cells:
    middle = 0.5 * (lo + hi)
    inside = {name: u.value if isinstance(u, Jet) else u for name, u in env(lo, hi, middle).items()}
    centre = env_value(middle, middle)
    anchor = At(centre, intervals.NAMESPACE)
    return _Cells(At(inside, intervals.NAMESPACE, anchor), At(centre, np), (hi - lo) / span, peaks)


def _check(expression: Expression, lo: Array, hi: Array, span: float, count: int) -> None:
    if count > CELL_CAP:
        raise SwitchingError(f"{expression.shown}: varies too fast to be followed (near phi = {{near}})", float(lo[0]))
    if np.any(hi - lo <= FINEST * span):
        text = f"{expression.shown}: not finite near phi = {{near}} (a denominator or tangent)"
        raise SwitchingError(text, float(lo[np.argmin(hi - lo)]))


def _too_wide(expression: Expression, cells: _Cells) -> Mask:
    with np.errstate(all="ignore"):
        return _strained(expression.tree, cells, np.full(cells.share.shape, True))


def _strained(node: Node, cells: _Cells, active: Mask) -> Mask:
    """Cells that are too wide for a node or anything inside it; only branches that are taken count."""
    if not active.any() or not node.args or node.op in trees.BOOLEAN or node.op == "sign":
        return np.zeros_like(active)
    if node.op in ("if", "min", "max"):
        first, second, chosen = _branches(node, cells)
        return _strained(first, cells, active & chosen) | _strained(second, cells, active & ~chosen)
    strained = np.zeros_like(active)
    for arg in node.args:
        strained |= _strained(arg, cells, active)
    rule = _RULES.get(node.op)
    return strained if rule is None else strained | (active & rule(node, cells, active))


def _branches(node: Node, cells: _Cells) -> tuple[Node, Node, Mask]:
    if node.op == "if":
        test, first, second = node.args
        chosen = trees.truth(test, cells.middle)
    else:
        first, second = node.args
        left, right = (trees.value(arg, cells.middle) for arg in node.args)
        chosen = left <= right if node.op == "min" else left >= right
    return first, second, np.broadcast_to(np.asarray(chosen, dtype=bool), cells.share.shape)


# --- how wide a cell may be for each function ------------------------------------------------------------------------


def _ratio(u: Interval) -> Array:
    """Greatest over least distance from zero; infinite where zero is inside."""
    return np.asarray(np.where(u.mignitude > 0, u.magnitude / u.mignitude, np.inf))


def _steep(node: Node, exponent: Interval, middle: Any, cells: _Cells, active: Mask) -> Mask:
    """An exponential's argument is too wide, unless all of it is negligible beside the peak."""
    peak = cells.peak(node, middle, active)
    return np.asarray((exponent.width > _EXPONENT) & (exponent.hi > peak + np.log(_NEGLIGIBLE)))


def _exponential(node: Node, cells: _Cells, active: Mask) -> Mask:
    arg = node.args[0]
    return _steep(node, cells.enclosure(arg), trees.value(arg, cells.middle), cells, active)


def _oscillating(node: Node, cells: _Cells, active: Mask) -> Mask:
    return np.asarray(cells.enclosure(node.args[0]).width > _PHASE)


def _tangent(node: Node, cells: _Cells, active: Mask) -> Mask:
    """Its poles are the zeros of the cosine."""
    u = cells.enclosure(node.args[0])
    return np.asarray((u.width > 1.0) | (_ratio(intervals.NAMESPACE.cos(u)) > _POLE))


def _denominators(node: Node, cells: _Cells, active: Mask) -> Mask:
    factors = [arg for sign, arg in zip(node.signs, node.args, strict=True) if sign == "/"]
    ratios = [_ratio(cells.enclosure(factor)) for factor in factors]
    return np.asarray(np.any([ratio > _POLE for ratio in ratios], axis=0)) if ratios else np.zeros_like(active)


def _graded(arg: Node, u: Interval, order: float, cells: _Cells) -> Mask:
    """Near a branch point u^order the cells shrink with their distance, until what is left adds nothing.

    Nor do they shrink where the bounds of u are as wide as rounding alone makes them.
    """
    near = (_ratio(u) > _BRANCH) & (cells.share > max(1e-16 ** (1 / (1 + order)), 2 * FINEST))
    return np.asarray(near & (u.width > 4 * cells.rounding(arg))) if near.any() else np.asarray(near)


def _root(node: Node, cells: _Cells, active: Mask) -> Mask:
    return _graded(node.args[0], cells.enclosure(node.args[0]), 0.5, cells)


def _logarithm(node: Node, cells: _Cells, active: Mask) -> Mask:
    return _graded(node.args[0], cells.enclosure(node.args[0]), 0.0, cells)


def _arcsine(node: Node, cells: _Cells, active: Mask) -> Mask:
    arg = node.args[0]
    u = cells.enclosure(arg)
    return _graded(arg, 1.0 - u, 0.5, cells) | _graded(arg, 1.0 + u, 0.5, cells)


def _arctangent(node: Node, cells: _Cells, active: Mask) -> Mask:
    u = cells.enclosure(node.args[0])
    return np.asarray(u.width > 1.5 * np.hypot(1.0, u.mignitude))


def _direction(node: Node, cells: _Cells, active: Mask) -> Mask:
    y, x = (cells.enclosure(arg) for arg in node.args)
    near = np.maximum(y.width, x.width) > 1.5 * np.hypot(y.mignitude, x.mignitude)
    return np.asarray(near & (cells.share > 2 * FINEST))


def _power(node: Node, cells: _Cells, active: Mask) -> Mask:
    base, exponent = node.args
    number = trees.value(exponent, cells.middle)
    u = cells.enclosure(base)
    if np.ndim(number):
        log = intervals.NAMESPACE.log(u)
        middle = number * np.log(trees.value(base, cells.middle))
        steep = _steep(node, cells.enclosure(exponent) * log, middle, cells, active)
        return steep | _graded(base, u, 0.0, cells)
    if number < 0:
        return np.asarray(_ratio(u) > min(_POLE, np.exp(12.0 / -number)))
    if number % 1:
        return _graded(base, u, float(number), cells)
    return _high_power(node, u, float(number), cells, active)


def _high_power(node: Node, u: Interval, number: float, cells: _Cells, active: Mask) -> Mask:
    """A high integer power is as steep as an exponential of n log u."""
    if number <= _TAME_POWER:
        return np.zeros_like(active)
    peak = cells.peak(node, np.abs(trees.value(node.args[0], cells.middle)), active)
    return np.asarray((_ratio(u) > np.exp(12.0 / number)) & (u.magnitude > peak * _NEGLIGIBLE ** (1 / number)))


_RULES: dict[str, Callable[[Node, _Cells, Mask], Mask]] = {
    "exp": _exponential,
    "sin": _oscillating,
    "cos": _oscillating,
    "tan": _tangent,
    "product": _denominators,
    "**": _power,
    "sqrt": _root,
    "log": _logarithm,
    "asin": _arcsine,
    "acos": _arcsine,
    "atan": _arctangent,
    "atan2": _direction,
}
