"""Cells narrow enough for an expression: none so wide that a polynomial could pass a feature without seeing it.

Samples cannot show this. sin(phi) + 100 exp(-((phi - 2)/0.01)²) on one cell of 24 nodes looks like a sine to its last
coefficient. Enclosures can: whatever a function of the tree may do in a cell is known from the bounds of its argument,
and from the distance to its nearest singularity. Rates of convergence after L. N. Trefethen, Approximation Theory and
Approximation Practice, SIAM 2013, chapter 8.

What hardly moves the whole need not be followed: down the tree goes, for every node, how far it may be off without moving
the expression by more than a trifle of its greatest value. An exponential factor that a quotient or a logarithm takes out
again is left out with it, so that exp(a)/(1 + exp(a)) asks for cells where it rises, and not where it is 1.
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
from flywheel.formulas.scaled import Powers, Scaled, plain, scaled_namespace
from flywheel.formulas.switching import Array, Enclosures, SwitchingError, Values
from flywheel.formulas.trees import At, Node

Mask = NDArray[np.bool_]

CELL_CAP = 10_000  # that are added by halving: more would take seconds
FINEST = 1e-14  # of the range: narrower cells are no longer split

_ROOTED = 1e-12  # of the range: in narrower cells rounding of the angle would take nodes across a root's branch point

_EXPONENT = 8.0  # widest range of an exponential's argument
_NEGLIGIBLE = 1e-20  # of the greatest value of the whole expression
_PHASE = 3.0  # widest range of a sine's argument
_POLE = 3.0  # greatest ratio of the distances from a pole
_BRANCH = 6.0  # greatest ratio of the distances from a branch point
_TAME_POWER = 8  # up to here a power of what 17 nodes resolve is resolved by them
_SCALED = scaled_namespace(intervals.NAMESPACE)


class _Cells(NamedTuple):
    """Cells under examination: their bounds in interval arithmetic, values in their middles, share of the range.

    `blame` collects which nodes found which cells too wide.
    """

    bounds: At
    middle: At
    share: Array
    blame: list[tuple[Node, Mask]]

    def scaled(self, node: Node) -> Scaled:
        """Bounds of a node, with its exponential factor kept apart."""
        u = trees.value(node, self.bounds)
        return u if isinstance(u, Scaled) else Scaled(u, {}, intervals.NAMESPACE)

    def wide(self, u: Any) -> Interval:
        u = interval(u)
        return Interval(*(np.broadcast_to(np.asarray(end, dtype=float), self.share.shape) for end in (u.lo, u.hi)))

    def factor(self, node: Node) -> Interval:
        """Bounds of a node but for its exponential factor."""
        return self.wide(self.scaled(node).factor)

    def enclosure(self, node: Node) -> Interval:
        """Bounds of a node."""
        return self.wide(self.scaled(node).plain)

    def rounding(self, node: Node) -> Array:
        """Width of a node's bounds in the middles: what rounding alone gives it."""
        assert self.bounds.anchor is not None
        u = trees.value(node, self.bounds.anchor)
        return np.asarray(interval(u.factor if isinstance(u, Scaled) else u).width)


class _Wanted(NamedTuple):
    """How far a node, divided by an exponential factor, may be off in every cell; infinite where it does not count."""

    tolerance: Array
    powers: Powers


def resolved(expression: Expression, lo: Array, hi: Array, env: Enclosures, env_value: Values) -> Array:
    """Angles at which the cells from `lo` to `hi` (rad) must be split further for 17 nodes to follow an expression.

    The cells must lie between the expression's breakpoints; `env` and `env_value` are those of `breakpoints`.
    Raises SwitchingError where a denominator comes to zero, a tangent is infinite, or 10 000 cells more do not do.

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
    peak, count = 0.0, 0
    with np.errstate(all="ignore"):
        while lo.size:
            middle = 0.5 * (lo + hi)
            found = np.abs(
                np.broadcast_to(expression.evaluate(env_value(middle, middle), np, env_value(middle, middle)), lo.shape)
            )
            peak = float(np.max(found[np.isfinite(found)], initial=peak))
            cells = _examined(lo, hi, span, env, env_value)
            wide = _strained(expression.tree, cells, _Wanted(np.full(lo.shape, _NEGLIGIBLE * peak), {}))
            count += int(np.count_nonzero(wide))
            _check(expression, cells, wide, lo, span, count, env_value)
            lo, hi, middle = lo[wide], hi[wide], middle[wide]
            splits.append(middle)
            lo, hi = np.concatenate((lo, middle)), np.concatenate((middle, hi))
    return np.sort(np.concatenate(splits))


def _examined(lo: Array, hi: Array, span: float, env: Enclosures, env_value: Values) -> _Cells:
    middle = 0.5 * (lo + hi)
    inside = {name: u.value if isinstance(u, Jet) else u for name, u in env(lo, hi, middle).items()}
    centre = env_value(middle, middle)
    return _Cells(At(inside, _SCALED, At(centre, _SCALED)), At(centre, scaled_namespace(np)), (hi - lo) / span, [])


def _check(expression: Expression, cells: _Cells, wide: Mask, lo: Array, span: float, count: int, env_value: Values) -> None:
    """Refuse what no cells of bearable width and number follow, naming the part of the expression that asks for them."""
    finest = wide & (cells.share <= FINEST)
    if not (finest.any() or count > CELL_CAP):
        return
    at = int(np.flatnonzero(finest if finest.any() else wide)[0])
    node = next(node for node, mask in cells.blame if mask[at])
    near = float(lo[at])
    part = expression.part(node)
    middle = lo[at] + 0.5 * span * cells.share[at]
    if infinite := expression.undefined(env_value(middle, middle), env_value(middle, middle)):
        raise SwitchingError(f"a value that is not finite near phi = {{near}} ({infinite})", near)
    if finest.any() and (infinite := _infinite(expression, node, cells, at)):
        raise SwitchingError(f"a value that is not finite near phi = {{near}} ({infinite})", near)
    if finest.any():
        text = f"{expression.shown}: steeper near phi = {{near}} than rounding of the angle lets follow ({part})"
        raise SwitchingError(text, near)
    which = "" if node == expression.tree else f" {part}"
    text = f"{expression.shown}:{which} varies too fast for {CELL_CAP} cells to follow it (first near phi = {{near}})"
    raise SwitchingError(text, near)


def _infinite(expression: Expression, node: Node, cells: _Cells, at: int) -> str:
    """What is infinite at a node in a cell, in words; nothing where the node is only steep there."""
    part = expression.part(node)
    if node.op == "tan":
        return f"{part}: infinite, the tangent of a right angle"
    below = [arg for sign, arg in zip(node.signs, node.args, strict=True) if sign == "/"] if node.op == "product" else []
    if node.op == "**":
        below = [node.args[0]]
    for arg in below:
        if cells.factor(arg).mignitude[at] <= cells.factor(arg).width[at]:
            return f"{part}: a division by {expression.part(arg)}, which comes to 0"
    return ""


def _strained(node: Node, cells: _Cells, wanted: _Wanted) -> Mask:
    """Cells that are too wide for a node or anything inside it; only branches that are taken count."""
    tolerance = wanted.tolerance
    if node.op in trees.BOOLEAN or node.op == "sign" or not (tolerance < np.inf).any():
        return np.zeros(tolerance.shape, dtype=bool)
    if node.op in ("if", "min", "max"):
        first, second, chosen = _branches(node, cells)
        yes, no = (wanted._replace(tolerance=np.where(side, tolerance, np.inf)) for side in (chosen, ~chosen))
        return _strained(first, cells, yes) | _strained(second, cells, no)
    if node.op in ("neg", "abs"):
        return _strained(node.args[0], cells, wanted)
    u = cells.scaled(node)
    rest = u / Scaled(1.0, wanted.powers, intervals.NAMESPACE)
    exponent, whole = cells.wide(rest.exponent), cells.wide(rest.plain)
    live = np.asarray((tolerance < np.inf) & ~(whole.width <= tolerance))
    if not live.any():
        return live
    strained = np.asarray(live & (exponent.width > _EXPONENT))
    tolerance = np.where(live, tolerance, np.inf)
    rule = _RULES.get(node.op)
    if rule is not None:
        strained |= live & rule(node, cells)
    if strained.any():
        cells.blame.append((node, strained))
    if node.op == "exp":
        return strained | _strained(node.args[0], cells, _Wanted(_share(tolerance, whole.magnitude), {}))
    growth = cells.wide(intervals.NAMESPACE.exp(interval(rest.exponent))).magnitude if rest.powers else 1.0
    for arg, inner in _inner(node, cells, u, _share(tolerance, growth)):
        strained = strained | _strained(arg, cells, inner)
    return strained


def _share(tolerance: Array, steepness: Any) -> Array:
    """What an argument may be off where its function rises by so much at most; nothing where that is not known."""
    shared = tolerance / steepness
    return np.asarray(np.where(np.isnan(shared), np.where(tolerance == np.inf, np.inf, 0.0), shared))


def _inner(node: Node, cells: _Cells, u: Scaled, tolerance: Array) -> list[tuple[Node, _Wanted]]:
    """What a node wants of each of its arguments."""
    if node.op == "sum":
        return [(arg, _Wanted(tolerance, u.powers)) for arg in node.args]
    if node.op == "product":
        return _of_factors(node, cells, tolerance)
    if not node.args:
        return []
    arg, scaled = node.args[0], cells.scaled(node.args[0])
    v = cells.wide(scaled.factor)
    if node.op == "log":
        exponents = [(tree, _Wanted(_share(tolerance, np.abs(c)), {})) for tree, (_, c) in scaled.powers.items()]
        return [(arg, _Wanted(_share(tolerance, 1.0 / v.mignitude), scaled.powers)), *exponents]
    order = 0.5 if node.op == "sqrt" else node.args[1].number if node.op == "**" and node.args[1].op == "number" else None
    if order is not None:
        steepness = abs(order) * np.maximum(v.magnitude ** (order - 1), v.mignitude ** (order - 1))
        return [(arg, _Wanted(_share(tolerance, steepness), scaled.powers))]
    if node.op in ("sin", "cos", "atan"):
        return [(arg, _Wanted(tolerance, {}))]
    unknown = np.where(tolerance == np.inf, np.inf, 0.0)
    return [(arg, _Wanted(unknown, {})) for arg in node.args]


def _of_factors(node: Node, cells: _Cells, tolerance: Array) -> list[tuple[Node, _Wanted]]:
    scaled = [cells.scaled(arg) for arg in node.args]
    sizes = [cells.wide(u.factor) for u in scaled]
    sizes = [v if sign == "*" else intervals.NAMESPACE.divide(1.0, v) for sign, v in zip(node.signs, sizes, strict=True)]
    found = []
    for k, (sign, arg) in enumerate(zip(node.signs, node.args, strict=True)):
        others: Any = np.ones(tolerance.shape)
        for j, size in enumerate(sizes):
            others = others * (size.magnitude if j != k else 1.0)
        steepness = others if sign == "*" else others * sizes[k].magnitude ** 2
        found.append((arg, _Wanted(_share(tolerance, steepness), scaled[k].powers)))
    return found


def _branches(node: Node, cells: _Cells) -> tuple[Node, Node, Mask]:
    if node.op == "if":
        test, first, second = node.args
        chosen = trees.truth(test, cells.middle)
    else:
        first, second = node.args
        left, right = (plain(trees.value(arg, cells.middle)) for arg in node.args)
        chosen = left <= right if node.op == "min" else left >= right
    return first, second, np.broadcast_to(np.asarray(chosen, dtype=bool), cells.share.shape)


# --- how wide a cell may be for each function ------------------------------------------------------------------------


def _ratio(u: Interval) -> Array:
    """Greatest over least distance from zero; infinite where zero is inside."""
    return np.asarray(np.where(u.mignitude > 0, u.magnitude / u.mignitude, np.inf))


def _oscillating(node: Node, cells: _Cells) -> Mask:
    return np.asarray(cells.enclosure(node.args[0]).width > _PHASE)


def _tangent(node: Node, cells: _Cells) -> Mask:
    """Its poles are the zeros of the cosine."""
    u = cells.enclosure(node.args[0])
    return np.asarray((u.width > 1.0) | (_ratio(intervals.NAMESPACE.cos(u)) > _POLE))


def _denominators(node: Node, cells: _Cells) -> Mask:
    factors = [arg for sign, arg in zip(node.signs, node.args, strict=True) if sign == "/"]
    ratios = [_ratio(cells.factor(factor)) for factor in factors]
    return np.asarray(np.any([ratio > _POLE for ratio in ratios], axis=0)) if ratios else np.zeros(cells.share.shape, bool)


def _graded(arg: Node, u: Interval, order: float, cells: _Cells) -> Mask:
    """Near a branch point u^order the cells shrink with their distance, until what is left adds nothing.

    Nor do they shrink where the bounds of u are as wide as rounding alone makes them.
    """
    least = 2 * FINEST if order <= 0.0 else _ROOTED
    near = (_ratio(u) > _BRANCH) & (cells.share > max(1e-16 ** (1 / (1 + order)), least))
    return np.asarray(near & (u.width > 4 * cells.rounding(arg))) if near.any() else np.asarray(near)


def _root(node: Node, cells: _Cells) -> Mask:
    return _graded(node.args[0], cells.factor(node.args[0]), 0.5, cells)


def _logarithm(node: Node, cells: _Cells) -> Mask:
    return _graded(node.args[0], cells.factor(node.args[0]), 0.0, cells)


def _arcsine(node: Node, cells: _Cells) -> Mask:
    arg = node.args[0]
    u = cells.enclosure(arg)
    return _graded(arg, 1.0 - u, 0.5, cells) | _graded(arg, 1.0 + u, 0.5, cells)


def _arctangent(node: Node, cells: _Cells) -> Mask:
    u = cells.enclosure(node.args[0])
    return np.asarray(u.width > 1.5 * np.hypot(1.0, u.mignitude))


def _direction(node: Node, cells: _Cells) -> Mask:
    y, x = (cells.enclosure(arg) for arg in node.args)
    near = np.maximum(y.width, x.width) > 1.5 * np.hypot(y.mignitude, x.mignitude)
    return np.asarray(near & (cells.share > 2 * FINEST))


def _power(node: Node, cells: _Cells) -> Mask:
    base, exponent = node.args
    if trees.grows(node):
        return np.zeros(cells.share.shape, bool)
    u = cells.factor(base)
    if exponent.op != "number":
        steep = (cells.enclosure(exponent) * intervals.NAMESPACE.log(u)).width > _EXPONENT
        return np.asarray(steep | _graded(base, u, 0.0, cells))
    number = exponent.number
    if number < 0:
        return np.asarray(_ratio(u) > min(_POLE, np.exp(12.0 / -number)))
    if number % 1:
        return _graded(base, u, number, cells)
    high = number > _TAME_POWER  # as steep as an exponential of n log u
    return np.asarray(_ratio(u) > np.exp(12.0 / number)) if high else np.zeros(cells.share.shape, bool)


_RULES: dict[str, Callable[[Node, _Cells], Mask]] = {
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
