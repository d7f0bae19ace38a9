"""Proven values of smooth functions: balls (a midpoint and a radius) in place of floats, and Taylor models of them.

A function that is written for numbers of any kind is evaluated over balls of python-flint, in which every rounding widens
the radius: the true value is inside. Over power series of balls the same function gives Taylor coefficients at the middle
of a cell, and over the whole cell, taken as one ball, a bound of the truncated coefficient. Both together are a
polynomial whose last coefficient is a ball, and which encloses the function in the whole cell.

Source: F. Johansson, Arb: efficient arbitrary-precision midpoint-radius interval arithmetic, IEEE Transactions on Computers
66 (2017); W. Tucker, Validated Numerics, Princeton 2011, chapters 4 to 6.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import partial, reduce
from itertools import count, pairwise
from types import SimpleNamespace
from typing import Any, NamedTuple

import flint
import numpy as np
from flint import arb, arb_poly, arb_series, fmpq

from flywheel.numerics.jets import jet_namespace

_TURNS = 720  # multiples of pi are known as such down to pi over this, and up to pi times this
_LAST_DIGIT = 2.0**-51  # of a multiple of 1/pi: what a float of it may be off by
_DIGITS = 9  # decimals of a constant: one that needs more may have been calculated, with roundings
_NARROWEST = 2.0**-40  # of the span: cells are not cut narrower
_STEEP = 1.6  # what a cell leaves open grows with its width to the power of the order times this
_SAFE, _SHRINKS, _LEAST_SHARE = 0.95, 0.2, 1e-60  # of the next width over that wanted, and over the last; of what is open
_MOST_SPLITS, _RECENTRED = 4_000, 100  # of intervals, for one extreme; after so many, polynomials are taken about each
_MOST_CYCLES, _MOST_PICARD = 12, 60  # Newton's steps to a periodic solution, and Picard's along a cell
_MOST_WIDER = 4  # tries to enclose a periodic solution
_CLOSED = 1e-2  # of the error allowed: what these steps may leave
_SHRUNK = 0.1  # of the change of the last step of Newton's method: less, or rounding decides
_TUBE = 1e4  # radius of the tubes about a solution over that error


class UnprovenError(ValueError):
    """Reason why a value cannot be proven."""


class WorkLimitError(UnprovenError):
    """A proof that would take too long, with more digits as well."""


def rational(numerator: int, denominator: int) -> Any:
    """The ball of a ratio of two integers."""
    return arb(fmpq(numerator, denominator))


def constant(value: Any) -> Any:
    """The ball of a number in a formula: a multiple of pi or of 1/pi, its decimal as written, or the ball that it is.

    Raises:
        UnprovenError: for a number that no decimal of 9 digits gives: it may have been calculated with roundings.

    >>> constant(0.1) * 10 == 1, constant(math.pi / 2).contains(arb.pi() / 2), constant(1 / math.pi).contains(1 / arb.pi())
    (False, True, True)

    """
    if isinstance(value, arb):
        return value
    if not math.isfinite(value):
        raise UnprovenError(f"a number that is not finite, {value!r}")
    if value == int(value):
        return arb(int(value))
    if share := share_of_pi(value):
        return arb.pi() * fmpq(share.numerator, share.denominator)
    if share := share_of_pi(1 / value):  # the slope of phi/pi
        inverse = fmpq(share.denominator, share.numerator) / arb.pi()
        if abs(inverse - arb(value)) < abs(arb(value)) * _LAST_DIGIT:
            return inverse
    if float(f"{value:.{_DIGITS}g}") != value:
        raise UnprovenError(f"a number, {value!r}, that may have been calculated with roundings")
    decimal = Fraction(f"{value:.{_DIGITS}g}")
    return rational(decimal.numerator, decimal.denominator)


def share_of_pi(value: float) -> Fraction:
    """The multiple of pi that a number is the float of; 0 for others.

    >>> share_of_pi(math.pi / 2), share_of_pi(1.5), share_of_pi(1e12 / 7)
    (Fraction(1, 2), Fraction(0, 1), Fraction(0, 1))
    """
    share = Fraction(value / math.pi).limit_denominator(_TURNS)
    known = abs(share) <= _TURNS and value == float(share.numerator * math.pi / share.denominator)
    return share if known else Fraction()


def exact(value: float) -> Any:
    """The ball of a float without error."""
    return arb(value)


def variable(centre: Any) -> Any:
    """A variable about a centre as a power series, to the order of the context."""
    return arb_series([centre, 1], flint.ctx.cap)


def around(middle: Any, radius: Any) -> Any:
    """The ball of all numbers no farther from a middle than a radius."""
    return middle + arb(0, radius)


def first(u: Any) -> Any:
    """The first coefficient of a series, or a ball itself."""
    return u[0] if isinstance(u, arb_series) else lifted(u)


def ball(value: Any) -> Any:
    """A ball of a ball or of a plain number."""
    return value if isinstance(value, arb) else arb(value)


def key(value: Any) -> tuple[Any, Any]:
    """Middle and radius of a ball, by which it is known in a table."""
    own = ball(value)
    return own.mid().man_exp(), own.rad().man_exp()


def hull(values: Iterable[Any]) -> Any:
    """The smallest ball that contains some."""
    return reduce(lambda one, other: one.union(other), values)


def polynomial_hull(polynomials: Sequence[Any]) -> Any:
    """A polynomial whose coefficients contain those of some."""
    most = max(each.degree() for each in polynomials)
    return arb_poly([hull(each[k] for each in polynomials) for k in range(most + 1)])


def over(u: Any, span: Any) -> Any:
    """The ball of a series at all distances from its middle in a ball, or a ball itself."""
    return arb_poly(u.coeffs())(span) if isinstance(u, arb_series) else u


def line(at_middle: Any, slope: Any) -> Any:
    """A polynomial of degree 1."""
    return arb_poly([at_middle, slope])


def series(polynomial: Any, order: int) -> Any:
    """The power series of a polynomial, to an order."""
    return arb_series(polynomial, order + 1)


def pair(polynomial: Any, span: Any, order: int) -> list[Any]:
    """The power series of a polynomial about 0 and about every place of a ball at once."""
    return [series(polynomial, order), series(polynomial(line(span, 1)), order)]


def enclosing(about: Any, all_over: Any, order: int) -> Any:
    """The polynomial that encloses a function in a cell, from its series about the middle and about all of the cell."""
    return _polynomial(about, order - 1) + arb_poly([0] * order + [coefficient(all_over, order)])


def positive(value: Any) -> Any:
    """The greater of a ball and 0."""
    return value if value > 0 else value.max(arb(0))


# -- functions of balls and of series ----------------------------------------------------------------------------------


def lifted(u: Any) -> Any:
    """A ball or a series, of a plain number as well."""
    return u if isinstance(u, arb | arb_series) else arb(u)


def _one(name: str) -> Callable[[Any], Any]:
    return lambda u: getattr(lifted(u), name)()


def sign(u: Any) -> int:
    """The sign of a ball, or of the first coefficient of a series; an error if it is undetermined."""
    value = first(u)
    if value > 0 or value < 0:
        return 1 if value > 0 else -1
    if value.is_zero():
        return 0
    raise UnprovenError("a branch that is open")


def _power(u: Any, exponent: Any) -> Any:
    number = float(exponent)
    if number == int(number) and abs(number) < 64:
        base, size = lifted(u), abs(int(number))
        product = arb(1) + 0 * base
        for _ in range(size):
            product = product * base
        return 1 / product if number < 0 else product
    return lifted(u).sqrt() if number == 0.5 else (lifted(u).log() * exponent).exp()


def _angle(y: Any, x: Any) -> Any:
    """The angle of a point (x, y): of series where x is positive or y keeps its sign, by the smaller over the larger."""
    if not (isinstance(y, arb_series) or isinstance(x, arb_series)):
        return arb.atan2(lifted(y), lifted(x))
    right, up = first(x), first(y)
    if right > 0 and not abs(up) > right:
        return (lifted(y) / x).atan()
    if right < 0 and abs(up) < -right:
        return arb.pi() * sign(y) + (lifted(y) / x).atan()
    return arb.pi() * sign(y) / 2 - (lifted(x) / y).atan()


SIGNS: dict[str, tuple[int, ...]] = {
    "less": (-1,),
    "less_equal": (-1, 0),
    "greater": (1,),
    "greater_equal": (0, 1),
    "equal": (0,),
    "not_equal": (-1, 1),
}
"""Of comparisons: the signs of the difference with which they are true."""


def _decided(name: str, a: Any, b: Any) -> bool:
    return sign(a - b) in SIGNS[name]


NAMESPACE = SimpleNamespace(
    **{name: _one(name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log")},
    **{name: _one(name) for name in ("acosh", "sinh", "cosh", "tanh")},
    divide=lambda a, b: lifted(a) / b,
    atan2=_angle,
    power=_power,
    abs=lambda u: u * sign(u),
    sign=sign,
    minimum=lambda a, b: a if sign(a - b) <= 0 else b,
    maximum=lambda a, b: a if sign(a - b) >= 0 else b,
    **{name: partial(_decided, name) for name in SIGNS},
    **{name: getattr(np, name) for name in ("logical_and", "logical_or", "logical_not")},
    where=lambda test, yes, no: yes if test else no,
)
"""Functions by numpy's names, of balls and of power series of them."""
JETS = jet_namespace(SimpleNamespace(**vars(NAMESPACE), pi=None))
"""The same of jets of them."""


# -- Taylor models -----------------------------------------------------------------------------------------------------


class Model(NamedTuple):
    """A cell between two balls, its middle (exact), and for each function a polynomial in the distance from the middle.

    The last coefficient is a ball that holds the function's own at every place of the cell. `stretch` is the number of the
    stretch that it is part of.
    """

    low: Any
    high: Any
    middle: Any
    polynomials: tuple[Any, ...]
    stretch: int = 0

    @property
    def span(self) -> Any:
        """The cell as one ball of distances from its middle."""
        return self.low.union(self.high) - self.middle

    def integral(self, k: int) -> Any:
        """The polynomial of the integral of function k from the cell's low end."""
        return self.rising(self.polynomials[k])

    def rising(self, polynomial: Any) -> Any:
        """The polynomial of the integral of another from the cell's low end."""
        integral = polynomial.integral()
        return integral - integral(self.low - self.middle)

    def at_end(self, polynomial: Any) -> Any:
        """The value of a polynomial at the cell's high end."""
        return polynomial(self.high - self.middle)


def models(
    functions: Sequence[Callable[[Any], Sequence[Any]]],
    edges: Sequence[Any],
    order: int,
    scales: Sequence[float],
    left: float,
) -> list[Model]:
    """Models of functions of stretches, on cells so narrow that little of each is left open.

    The width of a cell follows from what the one before has left open, as steps of an integration in time do.

    Args:
        functions: of each stretch, from a power series to power series, or to balls where they are constant.
        edges: where stretches begin and end, balls.
        order: degree of the polynomials.
        scales: for each function its size, unless it is larger in a cell.
        left: the allowed radius at a cell's end, over this size.

    Raises:
        UnprovenError: if no cells, however narrow, leave so little open.

    """
    cells: list[Model] = []
    width = math.inf
    for k, (function, (start, high)) in enumerate(zip(functions, pairwise(edges), strict=True)):
        narrowest = _NARROWEST * float((high - start).mid())
        while start is not high:
            rest = float((high - start).mid())
            parts = max(1, math.ceil(rest / width))
            right = high if parts == 1 else arb(float(start.mid()) + rest / parts)
            model, share = _model(function, start, right, order, scales, left)
            change = _SAFE * max(share, _LEAST_SHARE) ** (-1 / (_STEEP * order))
            before, width = width, rest / parts * min(max(change, _SHRINKS), 1 / _SHRINKS)
            if model is not None:
                cells.append(model._replace(stretch=k))
                start, width = right, max(width, before) if parts == 1 and before < math.inf else width
            elif width < narrowest:
                raise UnprovenError(f"a function that is not smooth at {float(start.mid()):.6g} rad")
    return cells


def halves(functions: Callable[[Any], Sequence[Any]], cell: Model, order: int) -> list[Model]:
    """Models of functions on both halves of a cell; an UnprovenError where one has none."""
    models = [_model(functions, *ends, order)[0] for ends in ((cell.low, cell.middle), (cell.middle, cell.high))]
    if None in models:  # a cell left out would be a gap in the motion
        raise UnprovenError(f"a function that is not smooth at {float(cell.middle):.6g} rad")
    return [each._replace(stretch=cell.stretch) for each in models if each is not None]


def _model(
    functions: Callable[[Any], Sequence[Any]],
    low: Any,
    high: Any,
    order: int,
    scales: Sequence[float] = (),
    left: float = 1.0,
) -> tuple[Model | None, float]:
    """The model of one cell, None if it is too wide for any; and what it leaves open over what it may, at most 1."""
    middle = arb(float(((low + high) / 2).mid()))
    reach = (low.union(high) - middle).abs_upper() ** order
    try:
        whole = functions(variable(low.union(high)))
        radii = [float(coefficient(outer, order).rad() * reach) for outer in whole]
        sizes = [max(abs(float(first(outer).mid())), scale) for outer, scale in zip(whole, scales, strict=False)]
        shares = [radius / (left * size) for radius, size in zip(radii, sizes, strict=False)]
        missed = max(shares, default=0.0) if all(map(math.isfinite, shares)) else math.inf
        if missed > 1.0:
            return None, missed
        centre = functions(variable(middle))
    except (ArithmeticError, ValueError):  # UnprovenError is one
        return None, math.inf
    polynomials = [enclosing(inner, outer, order) for inner, outer in zip(centre, whole, strict=True)]
    if not all(term.is_finite() for polynomial in polynomials for term in polynomial.coeffs()):
        return None, math.inf
    return Model(low, high, middle, tuple(polynomials)), missed


def coefficient(u: Any, k: int) -> Any:
    """A coefficient of a series; of a constant, of which all others are zero."""
    if not isinstance(u, arb_series):
        return lifted(u) if k == 0 else arb(0)
    return u[k] if u.prec > k else arb("nan")


# -- extremes ----------------------------------------------------------------------------------------------------------


class BallCurve(NamedTuple):
    """A function on a cell, as polynomials of it and of its slope in the distance from the cell's middle."""

    low: Any
    high: Any
    value: Any
    slope: Any


def greatest(curves: Iterable[BallCurve], error: float) -> Any:
    """The ball of the greatest value of a continuous function that curves give cell by cell.

    Best-first bisection: of the function the bound f(m) + f'(X) (X - m), and where the slope keeps its sign its ends. An
    interval in which the slope adds no more than the radius of f(m) is not cut further, either.

    Args:
        curves: the cells.
        error: the width below which an interval is not cut further.

    Raises:
        UnprovenError: if too many intervals remain.

    """
    order = count()
    heap: list[tuple[Any, ...]] = []
    known: Any = arb("-inf")
    best: Any = known

    def noted(curve: BallCurve, low: Any, high: Any) -> None:
        nonlocal known, best
        span = low.union(high)
        slope = curve.slope(span)
        if final := bool(slope > 0 or slope < 0):
            inside = most = curve.value(high if slope > 0 else low)
        else:
            middle = arb(((low + high) / 2).mid())
            inside, rise = curve.value(middle), slope * (span - middle)
            most, final = inside + rise, bool(rise.abs_upper() <= inside.rad())
        known = max((known, inside), key=lambda ball: ball.lower())
        best, top = known.lower(), most.upper() if most.is_finite() else arb("inf")
        heapq.heappush(heap, (-top, next(order), curve, low, high, final))

    for curve in curves:
        noted(curve, curve.low, curve.high)
    for split in range(_MOST_SPLITS):
        below, _, curve, low, high, final = heapq.heappop(heap)
        if final or -below - best <= error:
            return best.union(-below)
        middle = arb(((low + high) / 2).mid())
        if split > _RECENTRED:  # about a minimum of higher order, terms about the cell's middle cancel
            curve = BallCurve(low - middle, high - middle, curve.value(line(middle, 1)), curve.slope(line(middle, 1)))
            low, middle, high = curve.low, arb(0), curve.high
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


# -- periodic solutions ------------------------------------------------------------------------------------------------


class BallPlace(NamedTuple):
    """A cell between two balls, its middle, and the rate of E there: F, dF/dE, ... as series, from E as a series.

    `inner` gives them about the middle; `about` and `whole` for all parameters in some ranges, about the middle and about
    every place of the cell at once: then the argument is a ball. What follows F may be left until it is taken.
    """

    low: Any
    high: Any
    middle: Any
    inner: Callable[[Any], Iterable[Any]]
    about: Callable[[Any], Iterable[Any]]
    whole: Callable[[Any], Iterable[Any]]

    @property
    def span(self) -> Any:
        """The cell as one ball of distances from its middle."""
        return self.low.union(self.high) - self.middle


class Tube(NamedTuple):
    """All E within a radius of a polynomial in a cell, for all parameters in the ranges.

    `steep` is the polynomial of dF/dE there, `rates` are F, dF/dE, ... all over the cell.
    """

    polynomial: Any
    radius: Any
    steep: Any
    rates: Sequence[Any]


class Orbit(NamedTuple):
    """A periodic solution: in each cell a polynomial, and `reach`, a ball, the greatest distance from it.

    `start` is the ball of values at the beginning of the cycle from which every solution stays within it: it contains
    exactly one periodic solution. All solutions so near lie in the `tubes`.
    """

    polynomials: tuple[Any, ...]
    reach: Any
    start: Any
    tubes: tuple[Tube, ...]


def periodic(
    cells: Sequence[BallPlace],
    order: int,
    error: float,
    near: Sequence[Any],
    tubes: Sequence[Tube] = (),
    growing: Sequence[Growth] = (),
) -> Orbit:
    """The stable periodic solution of dE/dphi = F(phi, E) near polynomials, proven by an upper and a lower solution.

    With polynomials p, d = |dp/dphi - F(phi, p)|, and L no less than dF/dE near p, p + s is an upper solution where
    ds/dphi = L s + d, and p - s a lower one. If s plus the gap by which p does not close is no larger at the end of the
    cycle than at its beginning, a periodic solution lies between the two.

    Args:
        cells: of the cycle, one after another.
        order: degree of the polynomials.
        error: distance from its polynomials in which the solution is first searched for; increased if necessary.
        near: polynomials of a solution near this one, in the same cells.
        tubes: about a solution near this one; made anew where they are too narrow.
        growing: growths along a solution near this one; along `near` without them.

    Raises UnprovenError where no stable periodic solution is proven near.
    Source: J. Mawhin, First order ordinary differential equations with several periodic solutions, ZAMP 38 (1987).

    >>> with precision(96, 14):
    ...     def law(phi):
    ...         return lambda e: (phi.sin() - e, -1 + 0 * e)
    ...     edges = [arb(k) * arb.pi() / 8 for k in range(17)]
    ...     cells = []
    ...     for low, high in zip(edges, edges[1:]):
    ...         middle = ((low + high) / 2).mid()
    ...         at, all_over = law(variable(middle)), law(variable(low.union(high)))
    ...         cells.append(BallPlace(low, high, middle, at, at, all_over))
    ...     orbit = periodic(cells, 14, 1e-15, [line(-0.4, 0)] * 16)
    ...     apart = orbit.polynomials[0](cells[0].low - cells[0].middle) + 0.5  # (sin - cos)/2
    ...     bool(abs(apart) < orbit.reach), float(orbit.reach) < 1e-15
    (True, True)

    """
    growing = growing or growths(cells, order, near)
    polynomials, rates = approached(cells, order, _CLOSED * error, near, growing)
    radius = arb(error) * _TUBE
    for _ in range(_MOST_WIDER):
        tubes = tubes or tuple(_tube(cell, own, radius, order) for cell, own in zip(cells, polynomials, strict=True))
        most, at_start = _reach(cells, polynomials, rates, tubes, order)
        pairs = zip(cells, polynomials, tubes, strict=True)
        farthest = reduce(arb.max, ((own - tube.polynomial)(cell.span).abs_upper() for cell, own, tube in pairs)) + most
        if farthest < tubes[0].radius:
            start = around(polynomials[0](cells[0].low - cells[0].middle), at_start)
            return Orbit(polynomials, most, start, tuple(tubes))
        tubes, radius = (), 4 * farthest.upper()
    raise UnprovenError(f"a motion whose cycle stays open by {float(most):.1e}")


class Growth(NamedTuple):
    """Growth of a deviation along a solution in a cell, from 1 at its low end on: a polynomial, and the series of 1 over it.

    `low` and `high` are the ends, as distances from the middle.
    """

    low: Any
    high: Any
    alone: Any
    inverse: Any


def growths(cells: Sequence[BallPlace], order: int, near: Sequence[Any]) -> list[Growth]:
    """The growths of deviations along polynomials: it suffices that these are near a solution."""
    steeps = ([*cell.inner(series(own, order))][1] for cell, own in zip(cells, near, strict=True))
    return [
        growth(cell.low.mid() - cell.middle, cell.high.mid() - cell.middle, _polynomial(steep, order - 1), order)
        for cell, steep in zip(cells, steeps, strict=True)
    ]


def growth(low: Any, high: Any, steep: Any, order: int) -> Growth:
    """The growth of a deviation between two distances from a cell's middle, from the polynomial of dF/dE."""
    rising = series(middles(steep), order - 1).integral()
    alone = rising - arb_poly(rising.coeffs())(low)
    return Growth(low, high, middles(arb_poly(alone.exp().coeffs())), (-alone).exp())


def approached(
    cells: Sequence[BallPlace], order: int, error: float, near: Sequence[Any], growing: Sequence[Growth]
) -> tuple[tuple[Any, ...], list[Any]]:
    """Polynomials of a periodic solution by Newton's method from near ones, and F along them.

    The correction e of polynomials p follows de/dphi = dF/dE e + F(phi, p) - dp/dphi, all over the cycle, with dF/dE along
    a solution near.
    """
    polynomials, change = tuple(near), arb("inf")
    for _ in range(_MOST_CYCLES):
        rates = [next(iter(cell.inner(series(own, order)))) for cell, own in zip(cells, polynomials, strict=True)]
        # corrections by a step of Newton's method
        parts, grown, gap = list[tuple[Any, ...]](), arb(1), arb(0)
        following = [*zip(cells[1:], polynomials[1:], strict=True), (cells[0], polynomials[0])]
        for polynomial, rate, growth, (after, next_own) in zip(polynomials, rates, growing, following, strict=True):
            missed = series(middles(_polynomial(rate, order - 1) - polynomial.derivative()), order - 1)
            forced = growth.alone * middles(arb_poly((growth.inverse * missed).integral().coeffs()))
            forced -= growth.alone * forced(growth.low)
            jump = polynomial(growth.high) - next_own(after.low.mid() - after.middle)
            ahead = growth.alone(growth.high)
            grown, gap = (grown * ahead).mid(), (gap * ahead + forced(growth.high) + jump).mid()
            parts.append((growth, forced, jump))
        if not grown < 1:
            raise UnprovenError("a steady motion that is stable")
        corrections, value = list[Any](), (gap / (1 - grown)).mid()
        for growth, forced, jump in parts:
            corrections.append(forced + value * growth.alone)
            value = (corrections[-1](growth.high) + jump).mid()
        last = change
        change = reduce(arb.max, (own(cell.span).abs_upper() for cell, own in zip(cells, corrections, strict=True)))
        if change < error or not change < _SHRUNK * last:
            return polynomials, rates
        polynomials = tuple(middles(own + more) for own, more in zip(polynomials, corrections, strict=True))
    raise UnprovenError("that a steady motion is near")


def solution(cell: BallPlace, value: Any, near: Any, order: int, error: float) -> Any:
    """The polynomial of E in a cell from a value at its low end, by Picard's iteration.

    Args:
        cell: where.
        value: E at its low end.
        near: polynomial with which the iteration begins.
        order: degree of the polynomial.
        error: change of it at which the iteration ends.

    """
    low, reach = cell.low.mid() - cell.middle, arb(0, cell.span.abs_upper())
    own, change = near + (value - near(low)), arb("inf")
    for _ in range(_MOST_PICARD):
        rising = _polynomial(next(iter(cell.inner(series(own, order)))), order - 1).integral()
        polynomial = middles(rising + (value - rising(low)))
        last, change, own = change, (polynomial - own)(reach).abs_upper(), polynomial
        if change < error or not change < last:
            break
    return own


def middles(polynomial: Any) -> Any:
    """A polynomial without the radii of its coefficients."""
    return arb_poly([each.mid() for each in polynomial.coeffs()])


def _polynomial(u: Any, degree: int) -> Any:
    known = not isinstance(u, arb_series) or u.prec > degree
    return arb_poly((u.coeffs() if isinstance(u, arb_series) else [u])[: degree + 1]) if known else arb_poly([arb("nan")])


def missed(cell: BallPlace, own: Any, order: int, rate: Any = None) -> Any:
    """The greatest |dp/dphi - F(phi, p)| in a cell, by F about the middle where it is given.

    It is that of p itself, since the last coefficient of F depends on all of those of p.
    """
    inner = next(iter(cell.inner(series(own, order)))) if rate is None else rate
    cut = coefficient(next(iter(cell.whole(series(own(line(cell.span, 1)), order)))), order)
    apart = (own.derivative() - _polynomial(inner, order - 1))(cell.span)
    return (abs(apart) + abs(cut) * cell.span.abs_upper() ** order).abs_upper()


def _tube(cell: BallPlace, own: Any, radius: Any, order: int) -> Tube:
    """The tube about a polynomial: at each place, E differs from it by a number within the radius."""
    wide = own + arb(0, radius)
    (_, steep, *_), outer = cell.about(series(wide, order)), [*cell.whole(series(wide(line(cell.span, 1)), order))]
    return Tube(own, radius, enclosing(steep, outer[1], order), [*map(first, outer)])


def _reach(
    cells: Sequence[BallPlace], polynomials: Sequence[Any], rates: Sequence[Any], tubes: Sequence[Tube], order: int
) -> tuple[Any, Any]:
    """Greatest distance of a periodic solution from polynomials close to it, and the distance at the start."""
    steps = []
    following = [*zip(cells[1:], polynomials[1:], strict=True), (cells[0], polynomials[0])]
    for cell, own, rate, tube, (after, next_own) in zip(cells, polynomials, rates, tubes, following, strict=True):
        length, primitive = (cell.high - cell.low).max(arb(0)), tube.steep.integral()
        grown = (primitive(cell.high - cell.middle) - primitive(cell.low - cell.middle)).exp().abs_upper()
        peak = (tube.steep(cell.span) * length).exp().abs_upper().max(arb(1))
        jump = own(cell.high - cell.middle) - next_own(after.low - after.middle)
        added = missed(cell, own, order, rate) * length * peak
        if not (grown.is_finite() and added.is_finite()):
            raise UnprovenError("a torque that is undecided near the motion")
        steps.append((grown, peak, added, jump.abs_upper()))
    growth, total = arb(1), arb(0)
    for grown, _, added, jump in steps:
        growth, total = (growth * grown).upper(), (total * grown + added + jump).upper()
    if not growth < 1:
        raise UnprovenError("a steady motion that is stable")
    distance = most = at_start = (total / (1 - growth)).upper()
    for grown, peak, added, jump in steps:
        most = most.max((distance * peak + added).upper())
        distance = (distance * grown + added + jump).upper()
    return most, at_start


def one_way(cells: Iterable[tuple[Any, Any, Any]]) -> int:
    """1 if a parameter u raises a stable periodic solution everywhere, -1 if it lowers it everywhere, else 0.

    dE/du is an integral over the cycle before of dF/du, with weights between exp(-L) and exp(L), L the integral of |dF/dE|.

    Args:
        cells: of the cycle, each with its length, and balls of dF/du and of dF/dE all over it.

    >>> one_way([(arb(1), arb(2), arb(-1)), (arb(1), arb(0, 1e-9), arb(-1))])
    1

    """
    spread, ends = arb(0), []
    for length, by_parameter, steep in cells:
        works = length * by_parameter
        ends.append((works.lower(), works.upper()))
        spread += (length * steep).abs_upper()
    factor = (2 * spread).exp()
    for way, bounds in ((1, [low for low, _ in ends]), (-1, [-high for _, high in ends])):
        least = sum((bound for bound in bounds if bound > 0), arb(0))
        if least > factor * sum((-bound for bound in bounds if not bound > 0), arb(0)):
            return way
    return 0
