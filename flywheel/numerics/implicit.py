"""Functions that equations define, over balls: unknowns z of F(z, x, numbers) = 0, proven to exist and to be of one branch.

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapter 8.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import flint
import numpy as np
from flint import arb, arb_mat, arb_series

from flywheel.numerics.balls import UnprovenError, around, ball, coefficient, first, key, variable
from flywheel.numerics.jets import Jet, value_of

_BOX = 1e-10  # least half width of a box in which a solution is searched for
_MOST_BOXES = 8  # boxes tried, and steps that narrow the enclosure in the one that holds
_ROUNDED = 2.0**-50  # of a coordinate: balls about two that differ by less are one
_MOST_PLACES = 8192  # approximations that are kept
_SECANTS = 30  # steps towards a zero: ten are usual
_MOST_STEPS = 6  # towards the ball of a zero: each has about twice the digits
_ZERO_REACH = -80  # power of two, rad: about an angle, where its zero is searched for at least
_DERIVATIVES = 2  # of the unknowns by x that are returned


class ImplicitSolution(NamedTuple):
    """Taylor coefficients of the unknowns at a ball of x, and a ball of the inverse of F_z there."""

    at: Any
    rows: list[list[Any]]
    inverse: Any


class ImplicitEquations:
    """The unknowns z of n equations F(z, x, numbers) = 0 and two derivatives by x: of balls, of series, of jets of these.

    K = m - C F(m, x) + (1 - C F_z(Z, x)) (Z - m), with C about 1/F_z, m the middle of Z. Where K lies inside Z, there is
    exactly one solution in Z for each x, and it lies in K (Krawczyk). Over a wide x the solutions at both its ends and at
    its middle, each proven near its approximation, have to lie in Z: so all are of one branch. Each of Newton's steps,
    z - F(z)/F_z, doubles the number of Taylor coefficients of z at x; slopes by a number p follow from
    F_z z_p = -F_p.

    Args:
        of_jets: F, of n unknowns, x and numbers: jets.
        both: F, then its n² derivatives by the unknowns, row by row.
        near: approximate z, then dz/dx, at a float x.

    Raises UnprovenError where no box has such a solution.

    >>> from flywheel.numerics.balls import precision, variable
    >>> def square(z, x):
    ...     return (z * z - x,)
    >>> root = ImplicitEquations(square, lambda z, x: (z * z - x, 2 * z), lambda x: (x**0.5, 0.5 / x**0.5))
    >>> with precision(96, 4):
    ...     value, rate, slope = root(arb(2))
    ...     series = root(variable(arb(2)))[0]
    ...     value.contains(arb(2).sqrt()), rate.contains(1 / arb(8).sqrt()), float(value.rad()) < 1e-27
    ...     (series * series)[1].contains(1), (series * series)[4].contains(0), float(series[4].rad()) < 1e-25
    (True, True, True)
    (True, True, True)

    """

    def __init__(
        self,
        of_jets: Callable[..., Sequence[Any]],
        both: Callable[..., Sequence[Any]],
        near: Callable[[float], Sequence[float]],
    ) -> None:
        self._of_jets, self._both, self._near = of_jets, both, lru_cache(maxsize=_MOST_PLACES)(near)
        self._anchors: dict[Any, list[Any]] = {}
        self._last: tuple[Any, ImplicitSolution] | None = None

    def __call__(self, x: Any, *numbers: Any) -> list[Any]:
        """All unknowns, then their first and then their second derivatives."""
        place, plain = value_of(x), [value_of(number) for number in numbers]
        series = isinstance(place, arb_series)
        order = (place.prec - 1 if series else 0) + _DERIVATIVES
        moving = isinstance(x, Jet)
        solution = self._solution(first(place), plain, order + moving)
        rows = [_at(own, place) for own in _derivatives(solution.rows, _DERIVATIVES + moving)]
        if not (moving or any(isinstance(number, Jet) for number in numbers)):
            return rows
        slopes = [_at(own, place) for own in _derivatives(self._slopes(solution, numbers, plain, order), _DERIVATIVES)]
        if moving:
            count = len(solution.rows)
            slopes = [slope + x.first * rate for slope, rate in zip(slopes, rows[count:], strict=True)]
        return [Jet(row, slope) for row, slope in zip(rows, slopes, strict=False)]

    def _solution(self, at: Any, numbers: Sequence[Any], order: int) -> ImplicitSolution:
        """The unknowns about x to an order; those of the last call are kept."""
        place = (order, flint.ctx.prec, *map(key, (at, *numbers)))
        if self._last is not None and self._last[0] == place:
            return self._last[1]
        box, rows = self._enclosed(at, at.mid(), numbers)
        if not at.rad() < _ROUNDED:
            anchors = (self._anchor(float(place), numbers) for place in (at.lower(), at.mid(), at.upper()))
            if not all(wide.contains(own) for anchor in anchors for wide, own in zip(box, anchor, strict=True)):
                raise UnprovenError("that a linkage follows one branch")
        count, coefficients = len(rows), [[each] for each in rows]
        steep = arb_mat(self._split(self._both(*rows, at, *numbers), count)[1:])
        about = steep.mid().inv().mid()
        inverse = (about * steep).inv() * about
        with _Order(order):
            while (known := len(coefficients[0])) <= order:
                most = min(2 * known, order + 1)
                unknowns = [arb_series(row + [0] * (most - known), most) for row in coefficients]
                values = [*self._both(*unknowns, arb_series([at, 1], most), *numbers)]
                slopes = [
                    arb_mat(count, count, [coefficient(slope, k) for slope in values[count:]])
                    for k in range(1, most - known)
                ]
                moved = list[Any]()
                for k in range(known, most):
                    sides = _column([coefficient(side, k) for side in values[:count]])
                    moved.append(-inverse * sum(map(operator.mul, slopes, reversed(moved)), sides))
                for row, entries in zip(coefficients, zip(*(each.entries() for each in moved), strict=True), strict=True):
                    row += entries
        self._last = place, ImplicitSolution(at, coefficients, inverse)
        return self._last[1]

    def _slopes(
        self, solution: ImplicitSolution, numbers: Sequence[Any], plain: Sequence[Any], order: int
    ) -> list[list[Any]]:
        """Taylor coefficients of the slopes of the unknowns by a number at a given x."""
        count = len(solution.rows)
        with _Order(order):
            unknowns = [arb_series(row[: order + 1], order + 1) for row in solution.rows]
            place = arb_series([solution.at, 1], order + 1)
            steep = [*self._both(*unknowns, place, *plain)][count:]
            moved = [each.first if isinstance(each, Jet) else 0 for each in self._of_jets(*unknowns, place, *numbers)]
        slopes: list[list[Any]] = [[] for _ in range(count)]
        for k in range(order + 1):
            right = [
                coefficient(moved[i], k)
                + sum(coefficient(steep[i * count + j], k - n) * slopes[j][n] for j in range(count) for n in range(k))
                for i in range(count)
            ]
            for row, entry in zip(slopes, (solution.inverse * _column(right)).entries(), strict=True):
                row.append(-entry)
        return slopes

    def _anchor(self, place: float, numbers: Sequence[Any]) -> list[Any]:
        """Balls of the solution near its approximation at a float, and at all that is rounded to it."""
        known = (place, flint.ctx.prec, *map(key, numbers))
        if known not in self._anchors:
            wide = arb(place, _ROUNDED * max(abs(place), 1.0))
            self._anchors[known] = self._enclosed(wide, arb(place), numbers)[1]
        return self._anchors[known]

    def _enclosed(self, at: Any, middle: Any, numbers: Sequence[Any]) -> tuple[list[Any], list[Any]]:
        """A box with one solution for each x of a ball, and balls of these."""
        approximate = self._near(float(middle))
        count = len(approximate) // 2
        centre = [arb(z) for z in approximate[:count]]
        steep = self._split(self._both(*centre, middle, *numbers), count)[1:]
        about = arb_mat(np.linalg.inv([[float(entry.mid()) for entry in row] for row in steep]).tolist())
        reach = [2.0 * float(at.rad()) * abs(rate) + _BOX for rate in approximate[count:]]
        for _ in range(_MOST_BOXES):
            box = [arb(z.mid(), r) for z, r in zip(centre, reach, strict=True)]
            inner = self._narrowed(centre, box, at, about, numbers)
            if all(wide.contains_interior(own) for wide, own in zip(box, inner, strict=True)):
                break
            reach = [2.0 * float((own - z).abs_upper()) + _BOX for z, own in zip(centre, inner, strict=True)]
            if not max(reach) < 1.0:
                raise UnprovenError("the position of a linkage")
        else:
            raise UnprovenError("the position of a linkage")
        for _ in range(_MOST_BOXES):
            before, again = inner, self._narrowed([own.mid() for own in inner], inner, at, about, numbers)
            inner = [one.intersection(other) for one, other in zip(before, again, strict=True)]
            if all(2 * own.rad() > last.rad() for own, last in zip(inner, before, strict=True)):
                break
        return box, inner

    def _narrowed(self, centre: Sequence[Any], box: Sequence[Any], at: Any, about: Any, numbers: Sequence[Any]) -> list[Any]:
        """Krawczyk's K in a box about a centre."""
        count = len(centre)
        sides = self._split(self._both(*centre, at, *numbers), count)[0]
        steep = self._split(self._both(*box, at, *numbers), count)[1:]
        rest = arb_mat([[int(i == k) for k in range(count)] for i in range(count)]) - about * arb_mat(steep)
        spread = rest * _column([own - z for own, z in zip(box, centre, strict=True)])
        return [z - a + b for z, a, b in zip(centre, (about * _column(sides)).entries(), spread.entries(), strict=True)]

    @staticmethod
    def _split(values: Sequence[Any], count: int) -> list[list[Any]]:
        """F, then the rows of its derivatives by the unknowns, as balls."""
        entries = [ball(first(value)) for value in values]
        return [entries[k : k + count] for k in range(0, len(entries), count)]


class ZeroNear:
    """The zero of a function of an angle and numbers, near an angle (rad): of balls, and of jets of these.

    Slopes by a number p are -f_p/f'.

    Args:
        function: f and its slope f', of an angle and numbers.
        of_jets: the same of jets.
        near: the angle.
        most: the greatest distance of two zeros, where the function only touches zero: they count as one.

    Raises UnprovenError where it is not proven.

    """

    def __init__(
        self, function: Callable[..., Sequence[Any]], of_jets: Callable[..., Sequence[Any]], near: float, most: float
    ) -> None:
        self._function, self._of_jets, self._near, self._most = function, of_jets, arb(near), most
        self._known: dict[Any, tuple[Any, bool]] = {}

    def __call__(self, *numbers: Any) -> list[Any]:
        """The zero alone."""
        plain = [value_of(number) for number in numbers]
        zero, _ = self.at(plain)
        if not any(isinstance(number, Jet) for number in numbers):
            return [zero]
        moved = self._of_jets(zero, *numbers)[0]
        return [Jet(zero, -moved.first / self._function(zero, *plain)[1])] if isinstance(moved, Jet) else [zero]

    def at(self, numbers: Sequence[Any]) -> tuple[Any, bool]:
        """The ball of the zero, and whether there may be two so near to each other that they count as one."""
        known = (flint.ctx.prec, *map(key, numbers))
        if known not in self._known:

            def function(place: Any) -> Sequence[Any]:
                return self._function(place, *numbers)

            try:
                self._known[known] = zero_near(function, self._near), False
            except UnprovenError as simple:
                try:
                    self._known[known] = double_zero_near(function, self._near, self._most), True
                except (ArithmeticError, ValueError):  # a series may divide by 0 there
                    raise simple from None
        return self._known[known]


def zero_near(function: Callable[[Any], Sequence[Any]], angle: Any) -> Any:
    """The ball of the one zero of a function near an angle (rad), proven by interval Newton steps.

    N = m - f(m)/f'(X), X = m ± r: where N lies inside X, f has one zero in X, and that lies in N, with which the next
    step begins.

    Args:
        function: f and its slope at a ball.
        angle: near the zero, with the radius of its calculation.

    Raises UnprovenError where the slope may be 0 in X, or N reaches beyond it: the zero is not proven.
    Source: R. E. Moore, Interval Analysis (1966).

    >>> from flywheel.numerics.balls import precision
    >>> with precision(96, 2):
    ...     root = zero_near(lambda x: (x * x - 2, 2 * x), arb(1.4142135623730951))
    ...     root.contains(arb(2).sqrt()), float(root.rad()) < 1e-25
    (True, True)

    """
    zero, reach = None, arb(2) ** _ZERO_REACH
    for _ in range(_MOST_STEPS):
        own = angle if zero is None else zero
        middle = own.mid()
        value, slope = (ball(each) for each in function(middle))
        reach = (8 * abs(value / slope) + 4 * own.rad() + reach).upper()
        step = value / ball(function(arb(middle, reach))[1])
        if not (reach.is_finite() and abs(step) < reach) or (zero is not None and 2 * step.rad() > zero.rad()):
            break
        zero, reach = middle - step, arb(0)
    if zero is None:
        raise UnprovenError("an angle at which a load breaks is not proven")
    return zero


def double_zero_near(function: Callable[[Any], Sequence[Any]], angle: Any, most: float) -> Any:
    """The ball of both zeros of a function that only touches zero near an angle (rad), if they are as good as one.

    The slope f' has one zero m there, and f(m + t) = f(m) + f''(X) t²/2: zeros lie within sqrt(2 |f(m)/f''(X)|) of m.

    Args:
        function: f and its slope at a ball or a series.
        angle: near the zeros, with the radius of its calculation.
        most: the greatest distance of the zeros from m, rad.

    Raises UnprovenError where the zero of the slope is not proven, or zeros may be farther away.

    >>> from flywheel.numerics.balls import precision
    >>> with precision(128, 4):
    ...     root = double_zero_near(lambda x: (1 - x.cos(), x.sin()), arb(1e-17), 1e-15)
    ...     root.contains(0), float(root.rad()) < 1e-18
    (True, True)

    """

    def slope(place: Any) -> tuple[Any, Any]:
        series = function(variable(place))[1]
        return series[0], series[1]

    middle = zero_near(slope, angle)
    bend = slope(around(middle, arb(most)))[1]
    apart = (2 * ball(function(middle)[0] / bend).abs_upper()).sqrt().upper()
    if not apart < most:
        raise UnprovenError("an angle at which a load breaks is not proven")
    return around(middle, apart)


def falling_zero(function: Callable[[Any], Any], slope: Any, start: Any) -> Any:
    """The ball of the zero of a function that falls, by the mean value theorem at the last of some secant steps.

    x = m + f(m)/S, where S holds -f' at all places.

    Args:
        function: f of a ball without a radius.
        slope: S, a ball above 0.
        start: initial value of the search.

    Source: R. E. Moore, Interval Analysis (1966).

    >>> from flywheel.numerics.balls import precision
    >>> with precision(96, 2):
    ...     root = falling_zero(lambda x: 2 - x * x, arb(2).union(arb(4)), arb(1))
    ...     root.contains(arb(2).sqrt()), float(root.rad()) < 1e-25
    (True, True)

    """
    before = start.mid()
    value = function(before)
    here = (before + value / slope.mid()).mid()
    for _ in range(_SECANTS):
        last, value = value, function(here)
        change = (value - last).mid()
        step = value.mid() * (here - before) / change if not change.is_zero() else arb(0)
        if not abs(step) > value.rad() / slope.mid():
            break
        before, here = here, (here - step).mid()
    return here + value / slope


class _Order:
    """A context in which series keep terms up to an order."""

    def __init__(self, order: int) -> None:
        self._own = order + 1

    def __enter__(self) -> None:
        self._before, flint.ctx.cap = flint.ctx.cap, self._own

    def __exit__(self, *_: object) -> None:
        flint.ctx.cap = self._before


def _column(entries: Sequence[Any]) -> Any:
    return arb_mat(len(entries), 1, list(entries))


def _derivatives(rows: list[list[Any]], most: int) -> Iterator[list[Any]]:
    """Coefficients of all functions, then of their first derivatives, and so on."""
    for _ in range(most + 1):
        yield from rows
        rows = [[k * own for k, own in enumerate(row)][1:] for row in rows]


def _at(coefficients: Sequence[Any], x: Any) -> Any:
    """A function by its Taylor coefficients about the first term of a series x; their first one at a ball."""
    if not isinstance(x, arb_series):
        return coefficients[0]
    away = arb_series([0, *(x[k] for k in range(1, x.prec))], x.prec)
    return arb_series(coefficients[: x.prec], x.prec)(away)
