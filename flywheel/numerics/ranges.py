"""Functions over ranges of numbers: values at the middles and slopes all over the ranges, of extremes and of motions too.

What varies smoothly with numbers p lies in f(m) + sum of f_k(P) (P_k - m_k), where m are the middles of the ranges P: the
mean value form, which is narrow where the ranges are.

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapter 6.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import count
from typing import Any, NamedTuple

from flint import arb, arb_mat, arb_poly

from flywheel.numerics.balls import BallCurve, Growth, UnprovenError, lifted, middles, series
from flywheel.numerics.jets import Jet

_MOST_SPLITS = 4_000  # of intervals, for one extreme
_SAMPLES, _FINE = 32, 1e-3  # places on a cell; of what ranges change: what wider intervals may add


class Centred:
    """A value f at the middle m of ranges of some numbers, and balls of its slopes f_k by each of them all over the ranges.

    f lies in f(m) + sum of f_k(P) (P_k - m_k): the mean value form. `halves` has half the width of each range. `value`, a
    ball of f all over the ranges, is this form unless another is given, for instance if slopes are those at a position that
    moves.

    Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapter 6.

    >>> halves = {"x": arb("0.25")}
    >>> x = Centred(arb(2), {"x": arb(1)}, halves)
    >>> (x - x).value.is_zero(), (x * x).value.contains(arb(5)), x * x > 2.8
    (True, True, True)

    """

    __slots__ = ("_other", "halves", "middle", "slopes")

    def __init__(self, middle: Any, slopes: dict[Any, Any], halves: dict[Any, Any], other: Any = None) -> None:
        self.middle, self.slopes, self.halves, self._other = middle, slopes, halves, other

    @property
    def value(self) -> Any:
        """The ball of the value all over the ranges."""
        if self._other is not None:
            return self._other
        return sum((slope * arb(0, self.halves[k]) for k, slope in self.slopes.items()), self.middle)

    def each(self, function: Callable[[Any], Any]) -> Centred:
        """A linear function of the value."""
        slopes = {k: function(slope) for k, slope in self.slopes.items()}
        return Centred(function(self.middle), slopes, self.halves, None if self._other is None else function(self._other))

    def __neg__(self) -> Centred:
        return self.each(operator.neg)

    def __add__(self, other: Any) -> Centred:
        if not isinstance(other, Centred):
            return Centred(
                self.middle + other, self.slopes, self.halves, None if self._other is None else self._other + other
            )
        slopes = {k: self.slopes.get(k, 0) + other.slopes.get(k, 0) for k in self.slopes | other.slopes}
        given = None if self._other is None and other._other is None else self.value + other.value
        return Centred(self.middle + other.middle, slopes, self.halves, given)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Centred:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Centred:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Centred:
        if not isinstance(other, Centred):
            return self.each(lambda part: part * other)
        here, there = self.value, other.value
        slopes = {k: self.slopes.get(k, 0) * there + here * other.slopes.get(k, 0) for k in self.slopes | other.slopes}
        given = None if self._other is None and other._other is None else here * there
        return Centred(self.middle * other.middle, slopes, self.halves, given)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Centred:
        if not isinstance(other, Centred):
            return self.each(lambda part: part / other)
        below = other.value
        quotient = self.value / below
        slopes = {k: (self.slopes.get(k, 0) - quotient * other.slopes.get(k, 0)) / below for k in self.slopes | other.slopes}
        return Centred(self.middle / other.middle, slopes, self.halves)

    def __rtruediv__(self, other: Any) -> Centred:
        return Centred(arb(other), {}, self.halves) / self

    def __pow__(self, exponent: int) -> Centred:
        return math.prod([self] * (exponent - 1), start=self)

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > other)

    def __ge__(self, other: Any) -> bool:
        return bool(self.value >= other)

    def sqrt(self) -> Centred:
        """The square root."""
        root = self.value.sqrt()
        return Centred(self.middle.sqrt(), {k: slope / (2 * root) for k, slope in self.slopes.items()}, self.halves)

    def followed(self, follow: Mapping[Any, Mapping[Any, Any]], halves: dict[Any, Any]) -> Centred:
        """The value with slopes by the numbers of some ranges alone, which others follow with given slopes."""
        slopes = {
            k: self.slopes.get(k, 0) + sum((self.slopes.get(own, 0) * rates[k] for own, rates in follow.items()), arb(0))
            for k in halves
        }
        return Centred(self.middle, slopes, halves)

    def jet(self, k: Any) -> Any:
        """The value all over the ranges as a jet by a number, or a plain ball where that has no effect."""
        return Jet(self.value, self.slopes[k]) if k in self.slopes else self.value

    def max(self, other: Any) -> Centred:
        """The greater of the value and a plain ball."""
        if self.value < other:
            return Centred(lifted(other), {}, self.halves)
        return Centred(self.middle.max(other), {k: arb(0).union(slope) for k, slope in self.slopes.items()}, self.halves)


def over_ranges(
    plain: Callable[..., Sequence[Any]], of_jets: Callable[..., Sequence[Any]], at: Centred, columns: Sequence[Any]
) -> list[Centred]:
    """Values of a function all over the ranges of its arguments, with their slopes at a position.

    Args:
        plain: the function of balls and series, with the position as its first argument.
        of_jets: the same of jets.
        at: the position.
        columns: further arguments, Centred or without a range.

    """
    middles = plain(at.middle, *(each.middle if isinstance(each, Centred) else each for each in columns))
    place, wide = at.value, [each.value if isinstance(each, Centred) else each for each in columns]
    slopes: list[dict[Any, Any]] = [{} for _ in middles]
    for k in at.halves:
        own = [each.slopes.get(k) if isinstance(each, Centred) else None for each in columns]
        arguments = [value if slope is None else Jet(value, slope) for value, slope in zip(wide, own, strict=True)]
        for output, value in zip(slopes, of_jets(place, *arguments), strict=True):
            if isinstance(value, Jet):
                output[k] = value.first
    rows = zip(middles, slopes, plain(place, *wide), strict=True)
    return [Centred(lifted(middle), each, at.halves, lifted(whole)) for middle, each, whole in rows]


def implicit_slopes(zeros: Sequence[Centred], unknowns: Sequence[Any], numbers: Iterable[Any]) -> dict[Any, dict[Any, Any]]:
    """Slopes of unknowns q by other numbers p where as many functions g(p, q) are 0: the solutions of g_q q_k = -g_k.

    Raises UnprovenError if the functions may leave the unknowns open.

    """
    if not unknowns:
        return {}
    steep = arb_mat([[lifted(zero.slopes.get(own, 0)) for own in unknowns] for zero in zeros])
    right = arb_mat([[-lifted(zero.slopes.get(k, 0)) for k in numbers] for zero in zeros])
    try:
        about = steep.mid().inv().mid()
        rows = (about * steep).solve(about * right).tolist()
    except ZeroDivisionError:
        raise UnprovenError("the motions over ranges so wide") from None
    return {own: dict(zip(numbers, row, strict=True)) for own, row in zip(unknowns, rows, strict=True)}


class CurveOverRanges(NamedTuple):
    """A function f(x, p) on a cell of s, with x of s and p: at the middles of ranges of numbers p, and all over them.

    Polynomials of s: `slopes` f_k by the numbers at a given x, `steep` df/dx, `moved` x_k. At a given s the slopes are
    f_k + x_k df/dx. `breaks` are the ends of the cell at which df/dx may jump.
    """

    curve: BallCurve
    slopes: dict[Any, Any]
    steep: Any
    moved: dict[Any, Any]
    breaks: Sequence[Any]

    def at(self, place: Any) -> dict[Any, Any]:
        """The slopes at a given s."""
        steep, moved = self.steep(place), self.moved
        return {k: slope(place) + (steep * moved[k](place) if k in moved else 0) for k, slope in self.slopes.items()}


def slopes_at_greatest(curves: Sequence[CurveOverRanges], halves: Mapping[Any, Any]) -> dict[Any, Any]:
    """Balls of the slopes of the greatest value of a function over s, by numbers in ranges on which it depends.

    The greatest value changes with p by slopes g_k at given places s where f is greatest for some p. There
    f(s, m) - f(s', m) + sum of |g_k(s, P) - g_k(s', P)| half the width of range k is not below 0, for any s'; and between
    breaks df/dx = 0, so that g_k = f_k.

    Args:
        curves: the function on cells.
        halves: half the width of each range.

    Source: F. H. Clarke, Optimization and Nonsmooth Analysis, SIAM 1990, section 2.8.

    """
    samples = ((each.curve.value(at), at, each) for each in curves for at in _across(each.curve))
    best, place, highest = max(samples, key=lambda sample: sample[0].mid())
    here = highest.at(place)
    size = sum((abs(slope) * halves[k] for k, slope in here.items()), arb(0))

    def possible(value: Any, slopes: dict[Any, Any]) -> bool:
        apart = sum((abs(slope - here[k]) * halves[k] for k, slope in slopes.items()), arb(0))
        return not value - best + apart < 0

    found: dict[Any, Any] = {}
    todo = [(each, each.curve.low, each.curve.high) for each in curves]
    for split in count():
        if not todo:
            return found
        each, low, high = todo.pop()
        curve, middle, span = each.curve, arb(((low + high) / 2).mid()), low.union(high)
        rise = curve.slope(span)
        top = curve.value(middle) + rise * (span - middle)
        if rise > 0 or rise < 0:
            top = curve.value(high if rise > 0 else low)
        if not possible(top, each.at(span)):
            continue
        inside = {k: slope(span) for k, slope in each.slopes.items()} if each.steep(span).contains(0) else {}
        width = sum((ball.rad() * halves[k] for k, ball in inside.items()), arb(0))
        least = sum((slope(middle).rad() * halves[k] for k, slope in each.slopes.items()), arb(0))
        if width > 1.1 * least + _FINE * size and split < _MOST_SPLITS:
            todo += [(each, low, middle), (each, middle, high)]
            continue
        ends = [each.at(end) for end in each.breaks if span.overlaps(end) and possible(curve.value(end), each.at(end))]
        for part in filter(None, (inside, *ends)):
            found = {k: found.get(k, ball).union(ball) for k, ball in part.items()}
    raise AssertionError("unreachable")


def _across(curve: BallCurve) -> list[Any]:
    """Places all over a cell, ends included."""
    return [(curve.low + (curve.high - curve.low) * k / _SAMPLES).mid() for k in range(_SAMPLES + 1)]


def transported(
    cells: Sequence[Growth], steeps: Sequence[Any], forces: Sequence[Any], start: Any, order: int
) -> tuple[list[Any], Any]:
    """Enclosures of solutions of dy/dx = a y + b in cells, for all a and b in polynomials of balls, and y at the end.

    The difference e of y from an approximate solution y' follows de/dx = a e + d with d = b + a y' - dy'/dx.

    Args:
        cells: approximate growths with a, and the ends of cells as distances from their middles.
        steeps: a in the cells.
        forces: b in the cells.
        start: y at the low end of the first cell.
        order: degree of approximate solutions.

    >>> from flywheel.numerics.balls import growth, line, precision
    >>> with precision(80, 8):  # dy/dx = 1 + a y from y = 0 on
    ...     cell, a = growth(arb("-0.5"), arb("0.5"), line(-1, 0), 8), line(arb(-1, 0.1), 0)
    ...     (own,), end = transported([cell], [a], [line(1, 0)], arb(0), 8)
    ...     true = [(1 - (-rate).exp()) / rate for rate in (arb("0.9"), arb("1.1"))]
    ...     [ball.contains(one) for ball in (own(arb("0.5")), end) for one in true], end.rad() < 0.1
    ([True, True, True, True], True)

    """
    solutions = list[Any]()
    for cell, steep, force in zip(cells, steeps, forces, strict=True):
        length, span, primitive = cell.high - cell.low, cell.low.union(cell.high), steep.integral()
        forced = cell.alone * middles(arb_poly((cell.inverse * series(middles(force), order - 1)).integral().coeffs()))
        near = middles(forced + (start.mid() - forced(cell.low)) * cell.alone)
        grown, peak = (primitive(cell.high) - primitive(cell.low)).exp(), (steep(span) * length.union(0)).exp()
        apart, added = start - near(cell.low), length * peak * (force + steep * near - near.derivative())(span)
        solutions.append(near + (apart * peak + added.union(0)))
        start = near(cell.high) + apart * grown + added
    return solutions, start
