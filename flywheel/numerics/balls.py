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
_MOST_CYCLES, _MOST_PICARD = 12, 60  # Newton's steps to a periodic solution, and Picard's along a cell
_MOST_WIDER = 4  # tries to enclose a periodic solution
_CLOSED = 1e-3  # of the error allowed: what these steps may leave
_ZERO_REACH = -80  # power of two, rad: about an angle, where its zero is searched for at least


class UnprovenError(ValueError):
    """Reason why a value cannot be proven."""


def rational(numerator: int, denominator: int) -> Any:
    """The ball of a ratio of two integers."""
    return arb(fmpq(numerator, denominator))


def constant(value: float) -> Any:
    """The ball of a number in a formula: a multiple of pi, or its decimal as written.

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
    return u[0] if isinstance(u, arb_series) else _lifted(u)


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


def _sign(u: Any) -> int:
    """The sign of a ball, or of the first coefficient of a series; an error if it is open."""
    value = first(u)
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
    right = first(x)
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
    """Models of functions on cells between two balls, cut until the width of each is within its error.

    Args:
        functions: of a power series to power series, or to balls where they are constant.
        low: where the cells begin, a ball.
        high: where they end.
        order: degree of the polynomials.
        errors: for each function the allowed radius at a cell's end, a number.

    Raises:
        UnprovenError: if a function stays open however narrow the cells are.

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
    """The model of one cell; None if it is too wide for any."""
    middle = arb(float(((low + high) / 2).mid()))
    try:
        centre, whole = functions(variable(middle)), functions(variable(low.union(high)))
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
        UnprovenError: if too many intervals stay open.

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
        heapq.heappush(heap, (-float(top - base), next(order), top, curve, low, high, bool(slope > 0 or slope < 0)))

    curves = list(curves)
    base = max((curve.value(arb(0)).mid() for curve in curves), default=arb(0))  # floats tell small differences from there
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


# -- periodic solutions ------------------------------------------------------------------------------------------------


class Place(NamedTuple):
    """A cell between two balls, its middle, and the rate of E there: F and dF/dE as series, from E as a series.

    `inner` gives them about the middle, `whole` about every place of the cell at once: its argument is a ball.
    """

    low: Any
    high: Any
    middle: Any
    inner: Callable[[Any], tuple[Any, Any]]
    whole: Callable[[Any], tuple[Any, Any]]

    @property
    def span(self) -> Any:
        """The cell as one ball of distances from its middle."""
        return self.low.union(self.high) - self.middle


class Orbit(NamedTuple):
    """A periodic solution: in each cell a polynomial, and `reach`, a ball, the greatest distance from it.

    `start` is the ball of values at the beginning of the cycle from which every solution stays so near: it contains one
    periodic solution and no more.
    """

    polynomials: tuple[Any, ...]
    reach: Any
    start: Any


def periodic(cells: Sequence[Place], start: Any, order: int, error: float) -> Orbit:
    """The stable periodic solution of dE/dphi = F(phi, E) near a start, proven by an upper and a lower solution.

    With polynomials p, d = |dp/dphi - F(phi, p)|, and L no less than dF/dE near p, p + s is an upper solution where
    ds/dphi = L s + d, and p - s a lower one. If s with the gap by which p does not close is no larger at the end of the
    cycle than at its beginning, a periodic solution lies between the two.

    Args:
        cells: of the cycle, one after another.
        start: E where the cycle begins, nearly.
        order: degree of the polynomials.
        error: distance from its polynomials in which the solution is first searched for; increased if necessary.

    Raises UnprovenError where no stable periodic solution is proven near.
    Source: J. Mawhin, First order ordinary differential equations with several periodic solutions, ZAMP 38 (1987).

    >>> with precision(96, 14):
    ...     def law(phi, e):
    ...         return phi.sin() - e, -1 + 0 * e
    ...     edges = [arb(k) * arb.pi() / 8 for k in range(17)]
    ...     cells = []
    ...     for low, high in zip(edges, edges[1:]):
    ...         middle = ((low + high) / 2).mid()
    ...         at, all_over = arb_series([middle, 1], 15), arb_series([low.union(high), 1], 15)
    ...         cells.append(Place(low, high, middle, lambda e, at=at: law(at, e), lambda e, at=all_over: law(at, e)))
    ...     orbit = periodic(cells, arb(-0.4), 14, 1e-15)
    ...     apart = orbit.polynomials[0](cells[0].low - cells[0].middle) + 0.5  # (sin - cos)/2
    ...     bool(abs(apart) < orbit.reach), float(orbit.reach) < 1e-15
    (True, True)

    """
    start = start.mid()
    for _ in range(_MOST_CYCLES):
        polynomials, growth = _followed(cells, start, order, _CLOSED * error)
        if not growth < 0:
            raise UnprovenError("a steady motion that is stable")
        gap = polynomials[-1](cells[-1].high - cells[-1].middle) - start
        step = (gap / (1 - growth.exp())).mid()
        if abs(float(step)) < _CLOSED * error:
            break
        start = (start + step).mid()
    for _ in range(_MOST_WIDER):
        most, at_start = _reach(cells, polynomials, order, error)
        if most < error:
            return Orbit(polynomials, most, around(polynomials[0](cells[0].low - cells[0].middle), at_start))
        error = 4.0 * float(most)
    raise UnprovenError(f"a motion whose cycle stays open by {float(most):.1e} J")


def _followed(cells: Sequence[Place], start: Any, order: int, error: float) -> tuple[tuple[Any, ...], Any]:
    """Polynomials of E from a start, one cell after another, by Picard's iteration; and the integral of dF/dE along them."""
    polynomials, growth, value = [], arb(0), start
    for cell in cells:
        low, high = (end.mid() - cell.middle for end in (cell.low, cell.high))
        own, change = arb_poly([value]), arb("inf")
        for _ in range(_MOST_PICARD):
            rate, steep = cell.inner(arb_series(own.coeffs(), order + 1))
            rising = _polynomial(rate, order - 1).integral()
            found = arb_poly([each.mid() for each in (rising + (value - rising(low))).coeffs()])
            last, change, own = change, (found - own)(arb(0, high.abs_upper())).abs_upper(), found
            if change < error or not change < last:
                break
        grown = _polynomial(steep, order).integral()
        polynomials.append(own)
        value, growth = own(high).mid(), growth + grown(high) - grown(low)
    return tuple(polynomials), growth


def _polynomial(series: Any, degree: int) -> Any:
    return arb_poly([_term(series, k) for k in range(degree + 1)])


def _reach(cells: Sequence[Place], polynomials: Sequence[Any], order: int, error: float) -> tuple[Any, Any]:
    """Greatest distance of a periodic solution from polynomials that nearly are one, and the distance at the start."""
    steps = []
    following = [*zip(cells[1:], polynomials[1:], strict=True), (cells[0], polynomials[0])]
    for cell, own, (after, next_own) in zip(cells, polynomials, following, strict=True):
        span, length = cell.span, (cell.high - cell.low).max(arb(0))
        rate = cell.inner(arb_series(own.coeffs(), order + 1))[0]
        cut = _term(cell.whole(arb_series(own(arb_poly([span, 1])).coeffs(), order + 1))[0], order)
        missed = abs((own.derivative() - _polynomial(rate, order - 1))(span)) + abs(cut) * span.abs_upper() ** order
        steep = first(cell.whole(arb_series([own(span) + arb(0, error)], order + 1))[1])
        jump = own(cell.high - cell.middle) - next_own(after.low - after.middle)
        grown = (steep * length).exp().abs_upper()
        added = missed.abs_upper() * length * grown.max(arb(1)) + jump.abs_upper()
        if not (grown.is_finite() and added.is_finite()):
            raise UnprovenError("a torque that is undecided near the motion")
        steps.append((grown, added))
    growth, total = arb(1), arb(0)
    for grown, added in steps:
        growth, total = (growth * grown).upper(), (total * grown + added).upper()
    if not growth < 1:
        raise UnprovenError("a steady motion that is stable")
    distance = most = at_start = (total / (1 - growth)).upper()
    for grown, added in steps:
        distance = (distance * grown + added).upper()
        most = most.max(distance)
    return most, at_start


def one_way(cells: Iterable[tuple[Any, Any, Any]]) -> int:
    """1 if a parameter u raises a stable periodic solution everywhere, -1 if it lowers it everywhere, 0 if that is open.

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
    for sign, bounds in ((1, [low for low, _ in ends]), (-1, [-high for _, high in ends])):
        least = sum((bound for bound in bounds if bound > 0), arb(0))
        if least > factor * sum((-bound for bound in bounds if not bound > 0), arb(0)):
            return sign
    return 0
