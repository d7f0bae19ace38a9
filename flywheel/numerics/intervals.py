"""Intervals: bounds that hold everywhere between the ends of a cell; and numbers whose exponents are kept separate.

Every result is widened outward by at least its rounding error, so an enclosure without zero proves that there is no zero.
Two conventions: constants stand for their floats (pi is `np.pi`), and a result that underflows to zero counts as zero.
The caller silences overflow warnings (`np.errstate`).

A scaled number is m exp(sum of c a). With a = 300*(phi - 3), exp(a)/(1 + exp(a)) is inf/inf in plain numbers soon after
phi = 3, and bounds of it over a cell are useless wherever exp(a) changes by much. Kept separate, exp(a) is 1 exp(a),
1 + exp(a) is (1 + exp(-a)) exp(a), and the quotient 1/(1 + exp(-a)).

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapters 2 to 5.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np

from flywheel.numerics.jets import Jet, jet_namespace

_EPS = float(np.finfo(float).eps)
_GREATEST = float(np.finfo(float).max)
_LOOSE = 8 * _EPS  # numpy's elementary functions stay within 4 units in the last place


class Interval:
    """All numbers from `lo` to `hi`, each a float or an array (shapes broadcast).

    >>> 1.0 - Interval(0.25, 0.5)
    Interval(0.5, 0.75)
    """

    __slots__ = ("hi", "lo")
    __array_ufunc__ = None  # so that array * Interval comes here, and not element by element

    def __init__(self, lo: Any, hi: Any) -> None:
        self.lo = lo
        self.hi = hi

    def __repr__(self) -> str:
        lo, hi = (np.array2string(np.asarray(end), precision=12) for end in (self.lo, self.hi))
        return f"Interval({lo}, {hi})"

    @property
    def width(self) -> Any:
        """Distance between the ends."""
        return self.hi - self.lo

    @property
    def magnitude(self) -> Any:
        """Greatest absolute value in the interval."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))

    @property
    def mignitude(self) -> Any:
        """Least absolute value in the interval."""
        return np.maximum(np.maximum(self.lo, -self.hi), 0.0)

    def contains(self, number: Any) -> Any:
        """Tests whether a number, or each of an array, lies in the interval, ends included."""
        return (self.lo <= number) & (number <= self.hi)

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    def __add__(self, other: Any) -> Interval:
        if _foreign(other):
            return NotImplemented
        lo, hi = _ends(other)
        return _outward(self.lo + lo, self.hi + hi)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Interval:
        if _foreign(other):
            return NotImplemented
        lo, hi = _ends(other)
        return _outward(self.lo - hi, self.hi - lo)

    def __rsub__(self, other: Any) -> Interval:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Interval:
        if _foreign(other):
            return NotImplemented
        if not isinstance(other, Interval):
            return _hull(self.lo * other, self.hi * other)
        return _hull(self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Interval:
        if _foreign(other):
            return NotImplemented
        return _divide(self, other)

    def __rtruediv__(self, other: Any) -> Interval:
        return _divide(other, self)

    def __pow__(self, exponent: Any) -> Interval:
        return _power(self, exponent)


def _foreign(other: Any) -> bool:
    """Tests whether the other operand is of a higher kind (a jet of intervals), which then performs the operation."""
    return not isinstance(other, Interval) and getattr(type(other), "__array_ufunc__", True) is None


def _ends(u: Any) -> tuple[Any, Any]:
    return (u.lo, u.hi) if isinstance(u, Interval) else (u, u)


def interval(u: Any) -> Interval:
    """The number as an interval without width; an interval as it is."""
    return u if isinstance(u, Interval) else Interval(u, u)


def _outward(lo: Any, hi: Any, share: float = _EPS) -> Interval:
    """Ends moved outward by a share of their size: a unit in the last place or two, or the error of a function.

    Zero stays zero, since sums and products reach it exactly or by underflow, and what overflows is only known to be large.
    """
    lo, hi = lo * (1 - np.copysign(share, lo)), hi * (1 + np.copysign(share, hi))
    return Interval(np.minimum(lo, _GREATEST), np.maximum(hi, -_GREATEST))


def _hull(*ends: Any) -> Interval:
    """Hull of products of ends; 0 times infinity is 0, since the other factor only tends to infinity."""
    lo, hi = ends[0], ends[0]
    for end in ends[1:]:
        lo, hi = np.fmin(lo, end), np.fmax(hi, end)
    return _outward(np.where(np.isnan(lo), 0.0, lo), np.where(np.isnan(hi), 0.0, hi))


def _divide(a: Any, b: Any) -> Interval:
    """Quotient; it is unbounded if the divisor has 0 inside, and has one sign if the divisor begins or ends there."""
    (alo, ahi), (blo, bhi) = _ends(a), map(np.asarray, _ends(b))
    blo, bhi = blo + 0.0, np.where((bhi == 0) & (blo < 0), -0.0, bhi)  # zeros of the side that the interval lies on
    with np.errstate(all="ignore"):
        quotient = _hull(alo / blo, alo / bhi, ahi / blo, ahi / bhi)
    free = ((blo >= 0) & (bhi > 0)) | ((bhi <= 0) & (blo < 0))
    return Interval(np.where(free, quotient.lo, -np.inf), np.where(free, quotient.hi, np.inf))


def _increasing(function: Callable[[Any], Any], least: float = -np.inf, most: float = np.inf) -> Callable[[Any], Interval]:
    """A function that increases on [least, most]: arguments outside are clipped to where it is defined."""

    def enclose(u: Any) -> Interval:
        lo, hi = _ends(u)
        with np.errstate(all="ignore"):
            return _outward(function(np.clip(lo, least, most)), function(np.clip(hi, least, most)), _LOOSE)

    return enclose


def _holds(u: Interval, place: float, period: float) -> Any:
    """Tests whether the interval may contain place + n period for an integer n."""
    first, last = (u.lo - place) / period, (u.hi - place) / period
    slack = 4 * _EPS * (1 + np.maximum(np.abs(first), np.abs(last)))
    return np.floor(last + slack) >= np.ceil(first - slack)


def _wave(function: Callable[[Any], Any], peak: float) -> Callable[[Any], Interval]:
    """A sine or cosine, with its greatest value 1 at `peak` and its least half a turn later."""

    def enclose(u: Any) -> Interval:
        u = interval(u)
        with np.errstate(invalid="ignore"):  # an infinite end
            low, high = function(u.lo), function(u.hi)
        ends = _outward(np.minimum(low, high), np.maximum(low, high), _LOOSE)
        lo = np.where(_holds(u, peak + np.pi, 2 * np.pi), -1.0, np.maximum(ends.lo, -1.0))
        return Interval(lo, np.where(_holds(u, peak, 2 * np.pi), 1.0, np.minimum(ends.hi, 1.0)))

    return enclose


def _tan(u: Any) -> Interval:
    u = interval(u)
    pole = _holds(u, np.pi / 2, np.pi)
    with np.errstate(invalid="ignore"):  # an infinite end
        ends = _outward(np.tan(u.lo), np.tan(u.hi), _LOOSE)
    return Interval(np.where(pole, -np.inf, ends.lo), np.where(pole, np.inf, ends.hi))


def _acos(u: Any) -> Interval:
    lo, hi = _ends(u)
    return _outward(np.arccos(np.clip(hi, -1.0, 1.0)), np.arccos(np.clip(lo, -1.0, 1.0)), _LOOSE)


def _log(u: Any) -> Interval:
    lo, hi = _ends(u)
    with np.errstate(divide="ignore"):
        return _outward(np.log(np.maximum(lo, 0.0)), np.log(np.maximum(hi, 5e-324)), _LOOSE)


def _atan2(y: Any, x: Any) -> Interval:
    """Angle of a box: from its corners, unless it contains the origin or part of the cut along the negative x axis."""
    (ylo, yhi), (xlo, xhi) = _ends(y), _ends(x)
    ylo, yhi = ylo + 0.0, yhi + 0.0  # no negative zeros, which lie below the cut
    corners = [np.arctan2(end, side) for end in (ylo, yhi) for side in (xlo, xhi)]
    angle = _outward(np.minimum.reduce(corners), np.maximum.reduce(corners), _LOOSE)
    turning = (ylo <= 0) & (yhi >= 0) & (xlo <= 0) & ((ylo < 0) | (xhi >= 0))
    turn = np.pi * (1 + _EPS)
    return Interval(np.where(turning, -turn, angle.lo), np.where(turning, turn, angle.hi))


def _power(u: Any, exponent: Any) -> Interval:
    """Interval to a power: exact in shape for integers, over u >= 0 for real exponents, exp(n log u) for intervals."""
    if isinstance(exponent, Interval) or np.ndim(exponent):
        return _exponential(interval(exponent) * _log(u))
    number = float(exponent)
    if number < 0:
        return _divide(1.0, _power(u, -number))
    lo, hi = _ends(u)
    if number % 2 == 0:
        lo, hi = interval(u).mignitude, interval(u).magnitude
    elif number % 1:
        lo, hi = np.maximum(lo, 0.0), np.maximum(hi, 0.0)
    with np.errstate(all="ignore"):
        return _outward(np.power(lo, number), np.power(hi, number), _LOOSE)


def _abs(u: Any) -> Interval:
    u = interval(u)
    return Interval(u.mignitude, u.magnitude)


_exponential: Callable[[Any], Interval] = _increasing(np.exp)


def _less(a: Any, b: Any) -> Interval:
    """Truth values from 0, surely not, to 1, surely."""
    (alo, ahi), (blo, bhi) = _ends(a), _ends(b)
    return Interval(np.where(np.less(ahi, blo), 1.0, 0.0), np.where(np.less(alo, bhi), 1.0, 0.0))


def _less_equal(a: Any, b: Any) -> Interval:
    (alo, ahi), (blo, bhi) = _ends(a), _ends(b)
    return Interval(np.where(np.less_equal(ahi, blo), 1.0, 0.0), np.where(np.less_equal(alo, bhi), 1.0, 0.0))


def _not(test: Interval) -> Interval:
    return Interval(1.0 - test.hi, 1.0 - test.lo)


def _equal(a: Any, b: Any) -> Interval:
    return _minimum(_less_equal(a, b), _less_equal(b, a))


def _minimum(a: Any, b: Any) -> Interval:
    (alo, ahi), (blo, bhi) = _ends(a), _ends(b)
    return Interval(np.minimum(alo, blo), np.minimum(ahi, bhi))


def _maximum(a: Any, b: Any) -> Interval:
    (alo, ahi), (blo, bhi) = _ends(a), _ends(b)
    return Interval(np.maximum(alo, blo), np.maximum(ahi, bhi))


def _where(test: Any, yes: Any, no: Any) -> Interval:
    """The chosen branch, or the hull of both where the test is undecided."""
    (surely, possibly), (ylo, yhi), (nlo, nhi) = _ends(test), _ends(yes), _ends(no)
    never, always = np.equal(possibly, 0), np.not_equal(surely, 0)
    lo = np.where(always, ylo, np.where(never, nlo, np.minimum(ylo, nlo)))
    return Interval(lo, np.where(always, yhi, np.where(never, nhi, np.maximum(yhi, nhi))))


NAMESPACE = SimpleNamespace(
    pi=np.pi,
    sin=_wave(np.sin, np.pi / 2),
    cos=_wave(np.cos, 0.0),
    tan=_tan,
    asin=_increasing(np.arcsin, -1.0, 1.0),
    acos=_acos,
    atan=_increasing(np.arctan),
    atan2=_atan2,
    sqrt=_increasing(np.sqrt, 0.0),
    exp=_exponential,
    log=_log,
    abs=_abs,
    sign=lambda u: Interval(np.sign(interval(u).lo), np.sign(interval(u).hi)),
    minimum=_minimum,
    maximum=_maximum,
    where=_where,
    divide=_divide,
    power=_power,
    less=_less,
    less_equal=_less_equal,
    greater=lambda a, b: _less(b, a),
    greater_equal=lambda a, b: _less_equal(b, a),
    equal=_equal,
    not_equal=lambda a, b: _not(_equal(a, b)),
    logical_and=_minimum,
    logical_or=_maximum,
    logical_not=_not,
)


_GREATEST_EXPONENT = 1e300  # exponents beyond are taken for this: their products with 0 stay 0
_FOLDED = Interval(1 - 2e-15, 1 + 2e-15)  # rounding of a product of numeric factors
Powers = dict[Hashable, tuple[Any, Any]]  # under the key of each exponent: its value a, and its coefficient c


class Scaled:
    """factor exp(sum of c a) over the numbers of a namespace (floats or intervals, arrays of them)."""

    __slots__ = ("factor", "ns", "powers")
    __array_ufunc__ = None  # so that array * Scaled comes here, and not element by element

    def __init__(self, factor: Any, powers: Powers, ns: Any) -> None:
        self.factor, self.powers, self.ns = factor, powers, ns

    @property
    def exponent(self) -> Any:
        """Sum of c a; 0.0 if nothing is kept separate."""
        return sum((c * a for a, c in self.powers.values()), 0.0)

    @property
    def plain(self) -> Any:
        """The number itself; it may overflow."""
        if not self.powers:
            return self.factor
        half = self.ns.exp(0.5 * self.exponent)  # twice the half reaches further, where the factor is small
        return _times(_times(self.factor, half), half)

    def __neg__(self) -> Scaled:
        return Scaled(-self.factor, self.powers, self.ns)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Jet):
            return NotImplemented
        factor, powers = _parts(other)
        return Scaled(self.factor * factor, _merged(self.powers, powers, 1.0), self.ns)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, Jet):
            return NotImplemented
        factor, powers = _parts(other)
        return Scaled(self.ns.divide(self.factor, factor), _merged(self.powers, powers, -1.0), self.ns)

    def __rtruediv__(self, other: Any) -> Any:
        return Scaled(other, {}, self.ns) / self

    def __add__(self, other: Any) -> Any:
        """Adds two terms: the greater exponent of the two is factored out, never that of a term that is zero."""
        if isinstance(other, Jet):
            return NotImplemented
        factor, powers = _parts(other)
        apart = Scaled(1.0, _merged(self.powers, powers, -1.0), self.ns)
        if not apart.powers:
            return Scaled(self.factor + factor, self.powers, self.ns)
        ahead = apart.exponent
        lo, hi = _ends(ahead)
        first = ((np.asarray(0.5 * lo + 0.5 * hi) >= 0.0) & ~_is_zero(self.factor)) | _is_zero(factor)
        great, small = self.ns.where(first, self.factor, factor), self.ns.where(first, factor, self.factor)
        scale = self.ns.exp(np.where(first, -1.0, 1.0) * ahead)
        return Scaled(great + _times(small, scale), _chosen(first, self.powers, powers), self.ns)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Any:
        return (-self).__add__(other)

    def to_power(self, exponent: float) -> Scaled:
        """The number to a constant power."""
        powers = {tree: (a, exponent * c) for tree, (a, c) in self.powers.items()}
        return Scaled(self.ns.power(self.factor, exponent), powers, self.ns)


def _parts(u: Any) -> tuple[Any, Powers]:
    return (u.factor, u.powers) if isinstance(u, Scaled) else (u, {})


def _merged(one: Powers, two: Powers, sign: float) -> Powers:
    """The exponents of a product (sign 1) or quotient (-1), without those that cancel everywhere."""
    entries = {}
    for key in {**one, **two}:
        (a, c), (b, d) = one.get(key, (None, 0.0)), two.get(key, (None, 0.0))
        total = c + sign * d
        if np.any(total != 0.0):
            entries[key] = (b if a is None else a, total)
    return entries


def _chosen(first: Any, one: Powers, two: Powers) -> Powers:
    """Chooses between two sets of exponents, element by element: the first where the mask is true."""
    entries = {}
    for key in {**one, **two}:
        a = (one.get(key) or two[key])[0]
        entries[key] = a, np.where(first, one.get(key, (0, 0.0))[1], two.get(key, (0, 0.0))[1])
    return entries


def _is_zero(u: Any) -> Any:
    lo, hi = _ends(u)
    return (np.asarray(lo) == 0.0) & (np.asarray(hi) == 0.0)


def _times(u: Any, v: Any) -> Any:
    """Product in which 0 times infinity is 0, because the infinity is an overflow."""
    return u * v if isinstance(u, Interval) or isinstance(v, Interval) else np.where(np.asarray(u) == 0.0, 0.0, u * v)[()]


def plain(u: Any) -> Any:
    """A scaled number, or a jet of such, in the numbers below; any other as it is."""
    if isinstance(u, Jet):
        return Jet(plain(u.value), plain(u.first), None if u.second is None else plain(u.second))
    return u.plain if isinstance(u, Scaled) else u


def _scaled_namespace(ns: Any) -> SimpleNamespace:
    def exponential(parts: Iterable[tuple[Hashable, float, Any]], exponent: Callable[[], Any]) -> Scaled:
        """The exponential of a sum of c a, given as key, c and a; a key means one a within a calculation."""
        powers: Powers = {}
        for key, c, number in parts:
            a = plain(number)
            if ns is NAMESPACE:
                a = _FOLDED * Interval(*(np.clip(end, -_GREATEST_EXPONENT, _GREATEST_EXPONENT) for end in _ends(a)))
            else:
                a = np.clip(a, -_GREATEST_EXPONENT, _GREATEST_EXPONENT)
            powers = _merged(powers, {key: (a, c)}, 1.0)
        return Scaled(1.0, powers, ns)

    def of_plain(name: str) -> Any:
        function = getattr(ns, name)
        return lambda *args: function(*map(plain, args))

    def compared(name: str) -> Any:
        function = getattr(ns, name)

        def compare(a: Any, b: Any) -> Any:
            apart = isinstance(a, Scaled) or isinstance(b, Scaled)
            return function((a - b).factor, 0.0) if apart else function(a, b)

        return compare

    def power(u: Any, exponent: Any) -> Any:
        steady = isinstance(u, Scaled) and isinstance(exponent, float | int)
        return u.to_power(exponent) if steady else ns.power(plain(u), plain(exponent))

    def where(test: Any, yes: Any, no: Any) -> Any:
        if not (isinstance(yes, Scaled) or isinstance(no, Scaled)):
            return ns.where(test, yes, no)
        (one, powers), (two, others), (lo, hi) = _parts(yes), _parts(no), _ends(test)
        if np.any(np.asarray(lo) != np.asarray(hi)):
            return ns.where(test, plain(yes), plain(no))
        return Scaled(ns.where(test, one, two), _chosen(np.asarray(lo) != 0, powers, others), ns)

    def extreme(order: str) -> Any:
        before = compared(order)
        return lambda a, b: where(before(a, b), a, b)

    orders = ("less", "less_equal", "greater", "greater_equal", "equal", "not_equal")
    circular = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp")
    return SimpleNamespace(
        **{name: of_plain(name) for name in circular},
        **{name: compared(name) for name in orders},
        **{name: getattr(ns, name) for name in ("logical_and", "logical_or", "logical_not", "pi")},
        exponential=exponential,
        log=lambda u: ns.log(u.factor) + u.exponent if isinstance(u, Scaled) else ns.log(u),
        sqrt=lambda u: u.to_power(0.5) if isinstance(u, Scaled) else ns.sqrt(u),
        abs=lambda u: Scaled(ns.abs(u.factor), u.powers, ns) if isinstance(u, Scaled) else ns.abs(u),
        sign=lambda u: ns.sign(_parts(u)[0]),
        minimum=extreme("less_equal"),
        maximum=extreme("greater_equal"),
        divide=lambda u, v: u / v if isinstance(u, Scaled) or isinstance(v, Scaled) else ns.divide(u, v),
        power=power,
        where=where,
    )


_NAMESPACES: dict[int, tuple[Any, Any]] = {}


def scaled_namespace(ns: Any) -> Any:
    """The namespace of scaled numbers over those of `ns`, or of jets over them where `ns` is one of jets."""
    if id(ns) not in _NAMESPACES:
        base = getattr(ns, "over", None)
        namespace = _scaled_namespace(ns) if base is None else jet_namespace(scaled_namespace(base))
        _NAMESPACES[id(ns)] = ns, namespace
    return _NAMESPACES[id(ns)][1]
