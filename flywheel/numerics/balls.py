"""Proven values of smooth functions: balls (a midpoint and a radius) in place of floats, and Taylor models of them.

A function that is written for numbers of any kind is evaluated over balls of python-flint, in which every rounding widens
the radius: the true value is inside. Over power series of balls the same function gives Taylor coefficients at the middle
of a cell, and over the whole cell, taken as one ball, a bound of the coefficient that is cut off. Both together are a
polynomial whose last coefficient is a ball, and which holds the function all over the cell.

Source: F. Johansson, Arb: efficient arbitrary-precision midpoint-radius interval arithmetic, IEEE Transactions on Computers
66 (2017); W. Tucker, Validated Numerics, Princeton 2011, chapters 4 to 6.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from itertools import count
from types import SimpleNamespace
from typing import Any, NamedTuple

import flint
from flint import arb, arb_poly, arb_series, fmpq

_TURNS = 720  # multiples of pi are known as such down to pi over this
_DIGITS = 9  # decimals of a constant: one that needs more may have been calculated, with roundings
_NARROWEST = 2.0**-40  # of the span: cells are not cut narrower
_MOST_SPLITS = 4_000  # of intervals, for one extreme
_SECANTS = 30  # steps towards a zero: ten are usual
_ZERO_REACH = -80  # power of two, rad: about an angle, where its zero is looked for at least


class UnprovenError(ValueError):
    """Why a value cannot be proven, in words."""


def rational(numerator: int, denominator: int) -> Any:
    """The ball of a ratio of two integers."""
    return arb(fmpq(numerator, denominator))


def constant(value: float) -> Any:
    """The ball of a number in a formula: a multiple of pi, or the decimal that it was written as.

    Raises:
        UnprovenError: for a number that no decimal of 9 digits gives: it may have been calculated with roundings.

    >>> constant(0.1) * 10 == 1, constant(math.pi / 2).contains(arb.pi() / 2)
    (False, True)

    """
    if not math.isfinite(value):
        raise UnprovenError(f"a number that is not finite, {value!r}")
    if value == int(value):
        return arb(int(value))
    share = Fraction(value / math.pi).limit_denominator(_TURNS)
    if share and value == float(share.numerator * math.pi / share.denominator):
        return arb.pi() * fmpq(share.numerator, share.denominator)
    if float(f"{value:.{_DIGITS}g}") != value:
        raise UnprovenError(f"a number, {value!r}, that may have been calculated with roundings")
    decimal = Fraction(f"{value:.{_DIGITS}g}")
    return rational(decimal.numerator, decimal.denominator)


def exact(value: float) -> Any:
    """The ball of a float as it is."""
    return arb(value)


def ball(value: Any) -> Any:
    """A ball of a ball or of a plain number."""
    return value if isinstance(value, arb) else arb(value)


def zero_near(function: Callable[[Any], tuple[Any, Any]], angle: Any) -> Any:
    """The ball of the one zero of a function near an angle (rad), proven by an interval Newton step.

    N = m - f(m)/f'(X), X = m ± r: where N lies inside X, f has one zero in X, and that lies in N.

    Args:
        function: f and its slope at a ball.
        angle: near the zero, with the radius that its calculation has.

    Raises UnprovenError where the slope may be 0 in X, or N reaches beyond it: the zero is not proven.
    Source: R. E. Moore, Interval Analysis (1966).

    >>> with precision(96, 2):
    ...     root = zero_near(lambda x: (x * x - 2, 2 * x), arb(1.4142135623730951))
    ...     root.contains(arb(2).sqrt()), float(root.rad()) < 1e-25
    (True, True)

    """
    middle = angle.mid()
    value, slope = (_lifted(each) for each in function(middle))
    reach = (8 * abs(value / slope) + 4 * angle.rad() + arb(2) ** _ZERO_REACH).upper()
    step = value / _lifted(function(arb(middle, reach))[1])
    if not (reach.is_finite() and abs(step) < reach):
        raise UnprovenError("an angle at which a load breaks is not proven")
    return middle - step


def falling_zero(function: Callable[[Any], Any], slope: Any, start: Any) -> Any:
    """The ball of the zero of a function that falls, by the mean value theorem at the last of some secant steps.

    x = m + f(m)/S, where S holds -f' at all places.

    Args:
        function: f of a ball without a radius.
        slope: S, a ball above 0.
        start: where the search begins.

    Source: R. E. Moore, Interval Analysis (1966).

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


def positive(value: Any) -> Any:
    """The greater of a ball and 0."""
    return value if value > 0 else value.max(arb(0))


# -- functions of balls and of series ----------------------------------------------------------------------------------


def _lifted(u: Any) -> Any:
    return u if isinstance(u, arb | arb_series) else arb(u)


def _one(name: str) -> Callable[[Any], Any]:
    return lambda u: getattr(_lifted(u), name)()


def _first(u: Any) -> Any:
    return u[0] if isinstance(u, arb_series) else _lifted(u)


def _sign(u: Any) -> int:
    """The sign of a ball, or of the first coefficient of a series; an error where it is open."""
    value = _first(u)
    if value > 0 or value < 0:
        return 1 if value > 0 else -1
    if value.is_zero():
        return 0
    raise UnprovenError("a branch that is open")


def _power(u: Any, exponent: Any) -> Any:
    number = float(exponent)
    if number == int(number) and abs(number) < 64:
        base, size = _lifted(u), abs(int(number))
        found = arb(1) + 0 * base
        for _ in range(size):
            found = found * base
        return 1 / found if number < 0 else found
    return _lifted(u).sqrt() if number == 0.5 else (_lifted(u).log() * exponent).exp()


def _angle(y: Any, x: Any) -> Any:
    """The angle of a point (x, y): of series where x or y keeps its sign."""
    if not (isinstance(y, arb_series) or isinstance(x, arb_series)):
        return arb.atan2(_lifted(y), _lifted(x))
    right = _first(x)
    if right > 0:
        return (_lifted(y) / x).atan()
    side = _sign(y)
    return arb.pi() * side / 2 - (_lifted(x) / y).atan()


NAMESPACE = SimpleNamespace(
    **{name: _one(name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log")},
    **{name: _one(name) for name in ("acosh", "sinh", "cosh", "tanh")},
    divide=lambda a, b: _lifted(a) / b,
    atan2=_angle,
    power=_power,
    abs=lambda u: u * _sign(u),
    sign=_sign,
    minimum=lambda a, b: a if _sign(a - b) <= 0 else b,
    maximum=lambda a, b: a if _sign(a - b) >= 0 else b,
)
"""Functions by numpy's names, of balls and of power series of them."""


# -- Taylor models -----------------------------------------------------------------------------------------------------


class Model(NamedTuple):
    """A cell between two balls, its middle (exact), and for each function a polynomial in the distance from the middle.

    The last coefficient is a ball that holds the function's own at every place of the cell.
    """

    low: Any
    high: Any
    middle: Any
    polynomials: tuple[Any, ...]

    @property
    def span(self) -> Any:
        """The cell as one ball of distances from its middle."""
        return self.low.union(self.high) - self.middle

    def integral(self, k: int) -> Any:
        """The polynomial of the integral of function k from the cell's low end."""
        rising = self.polynomials[k].integral()
        return rising - rising(self.low - self.middle)


def models(functions: Callable[[Any], Sequence[Any]], low: Any, high: Any, order: int, errors: Sequence[Any]) -> list[Model]:
    """Models of functions on cells between two balls, cut until what is open of each is within its error.

    Args:
        functions: of a power series to power series, or to balls where they are constant.
        low: where the cells begin, a ball.
        high: where they end.
        order: degree of the polynomials.
        errors: for each function the radius that is allowed at a cell's end, a number.

    Raises:
        UnprovenError: where a function stays open however narrow the cells are.

    """
    found: list[Model] = []
    span = float((high - low).mid())
    todo = [(low, high)]
    while todo:
        left, right = todo.pop()
        model = _model(functions, left, right, order)
        if model is not None and all(size <= error for size, error in zip(_left_open(model, order), errors, strict=True)):
            found.append(model)
            continue
        if float((right - left).mid()) < _NARROWEST * abs(span):
            raise UnprovenError(f"a function that is not smooth at {float(left.mid()):.6g} rad")
        middle = arb(float(((left + right) / 2).mid()))
        todo += [(middle, right), (left, middle)]
    return found


def _model(functions: Callable[[Any], Sequence[Any]], low: Any, high: Any, order: int) -> Model | None:
    """The model of one cell; None where it is too wide for any."""
    middle = arb(float(((low + high) / 2).mid()))
    try:
        centre = functions(arb_series([middle, 1], order + 1))
        whole = functions(arb_series([low.union(high), 1], order + 1))
    except UnprovenError:
        return None
    except (ArithmeticError, ValueError):
        return None
    polynomials = []
    for inner, outer in zip(centre, whole, strict=True):
        given = [_term(inner, k) for k in range(order)] + [_term(outer, order)]
        if not all(term.is_finite() for term in given):
            return None
        polynomials.append(arb_poly(given))
    return Model(low, high, middle, tuple(polynomials))


def _term(u: Any, k: int) -> Any:
    """A coefficient of a series; of a constant, of which all others are zero."""
    if not isinstance(u, arb_series):
        return _lifted(u) if k == 0 else arb(0)
    return u[k] if u.prec > k else arb("nan")


def _left_open(model: Model, order: int) -> list[float]:
    """The width that the last coefficient of each polynomial adds at the ends of a cell."""
    reach = float(model.span.abs_upper())
    return [float(polynomial[order].rad()) * reach**order for polynomial in model.polynomials]


# -- extremes ----------------------------------------------------------------------------------------------------------


class Curve(NamedTuple):
    """A function on a cell, as polynomials of it and of its slope in the distance from the cell's middle."""

    low: Any
    high: Any
    value: Any
    slope: Any


def greatest(curves: Iterable[Curve], error: float) -> Any:
    """The ball of the greatest value of a continuous function that curves give cell by cell.

    Best-first bisection: of the function the bound f(m) + f'(X) (X - m), and where the slope keeps its sign its ends.

    Args:
        curves: the cells.
        error: the width at which an interval is cut no further.

    Raises:
        UnprovenError: where too many intervals stay open.

    """
    order = count()
    heap: list[tuple[Any, ...]] = []
    known: Any = arb("-inf")
    best: Any = known

    def noted(curve: Curve, low: Any, high: Any) -> None:
        nonlocal known, best
        middle = (low + high) / 2
        middle = arb(middle.mid())
        inside = curve.value(middle)
        slope = curve.slope(low.union(high))
        if slope > 0 or slope < 0:
            most = curve.value(high if slope > 0 else low)
            known = max((known, most), key=lambda ball: ball.lower())
            top = most.upper()
        else:
            known = max((known, inside), key=lambda ball: ball.lower())
            top = (inside + slope * (low.union(high) - middle)).upper()
        best = known.lower()
        heapq.heappush(heap, (-float(top), next(order), top, curve, low, high, bool(slope > 0 or slope < 0)))

    for curve in curves:
        noted(curve, curve.low, curve.high)
    for _ in range(_MOST_SPLITS):
        _, _, top, curve, low, high, final = heap[0]
        if final or top - best <= error:
            # the floats by which the heap is sorted are rounded: the highest of all exact bounds counts
            most = max((entry[2] for entry in heap), key=lambda ball: ball.upper())
            if most - best <= error or final:
                return best.union(most)
        heapq.heappop(heap)
        middle = arb(((low + high) / 2).mid())
        noted(curve, low, middle)
        noted(curve, middle, high)
    raise UnprovenError("an extreme that stays open")


def ends(ball: Any) -> tuple[float, float]:
    """Two floats, the nearest below and above a ball.

    >>> low, high = ends(arb(1) / 3)
    >>> low < 1 / 3 <= high and high - low < 1e-15
    True
    """
    low, high = float(ball.lower()), float(ball.upper())
    return math.nextafter(low, -math.inf), math.nextafter(high, math.inf)


def precision(bits: int, order: int) -> Any:
    """A context in which balls are rounded to some bits, and series keep terms up to an order."""
    return _Precision(bits, order)


class _Precision:
    def __init__(self, bits: int, order: int) -> None:
        self._given = bits, order + 1

    def __enter__(self) -> None:
        self._before = flint.ctx.prec, flint.ctx.cap
        flint.ctx.prec, flint.ctx.cap = self._given

    def __exit__(self, *_: object) -> None:
        flint.ctx.prec, flint.ctx.cap = self._before
