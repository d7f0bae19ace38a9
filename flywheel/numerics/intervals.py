"""Interval arithmetic on arrays: bounds that hold whatever lies between the ends of a cell.

Every result is widened outward by at least what floating point can have lost, so an enclosure that leaves out zero
proves that there is no zero. Two conventions: constants stand for their floats (pi is `np.pi`), and a result that
underflows to zero counts as zero. Overflow warnings are the caller's to silence (`np.errstate`).

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapters 2 to 5.

Numbers whose exponential factor is kept apart, m exp(sum of c a): what overflows by itself may still cancel.

With a = 300*(phi - 3), exp(a)/(1 + exp(a)) is inf/inf in plain numbers soon after phi = 3, and bounds of it over a cell
are useless wherever exp(a) changes by much. Kept apart, exp(a) is 1 exp(a), 1 + exp(a) is (1 + exp(-a)) exp(a), and the
quotient 1/(1 + exp(-a)). The exponents `a` are told apart by their trees, without numeric factors: exp(a), exp(-a) and
exp(2*a) share one.

Where expressions switch: every root of a function in a range, proven by interval subdivision.

A cell whose enclosure leaves out zero holds no root; a cell whose derivative keeps its sign holds at most one. What is
neither is halved, so no root can hide between sample points.

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapters 6 and 8.

Cells narrow enough for an expression: none so wide that a polynomial could pass a feature without seeing it.

Samples cannot show this. sin(phi) + 100 exp(-((phi - 2)/0.01)²) on one cell of 24 nodes looks like a sine to its last
coefficient. Enclosures can: whatever a function of the tree may do in a cell is known from the bounds of its argument,
and from the distance to its nearest singularity. Rates of convergence after L. N. Trefethen, Approximation Theory and
Approximation Practice, SIAM 2013, chapter 8.

What hardly moves the whole need not be followed: down the tree goes, for every node, how far it may be off without moving
the expression by more than a trifle of its greatest value. An exponential factor that a quotient or a logarithm takes out
again is left out with it, so that exp(a)/(1 + exp(a)) asks for cells where it rises, and not where it is 1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics import expressions
from flywheel.numerics.expressions import At, Expression, Node
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
        return f"Interval({_short(self.lo)}, {_short(self.hi)})"

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
        """Whether a number, or each of an array, lies in the interval, ends included."""
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
    """Whether the other operand is a number of a higher kind (a jet of intervals), which then does the operation."""
    return not isinstance(other, Interval) and getattr(type(other), "__array_ufunc__", True) is None


def _short(end: Any) -> str:
    return np.array2string(np.asarray(end), precision=12)


def _ends(u: Any) -> tuple[Any, Any]:
    return (u.lo, u.hi) if isinstance(u, Interval) else (u, u)


def interval(u: Any) -> Interval:
    """The number as an interval without width; an interval as it is."""
    return u if isinstance(u, Interval) else Interval(u, u)


def _outward(lo: Any, hi: Any) -> Interval:
    """One unit in the last place outward; zero stays zero, since sums and products reach it exactly or by underflow."""
    return Interval(np.nextafter(lo, np.where(lo == 0, 0.0, -np.inf)), np.nextafter(hi, np.where(hi == 0, 0.0, np.inf)))


def _loosely(lo: Any, hi: Any) -> Interval:
    """Outward by the error of an elementary function."""
    lo, hi = lo * (1 - np.copysign(_LOOSE, lo)), hi * (1 + np.copysign(_LOOSE, hi))
    return Interval(np.minimum(lo, _GREATEST), np.maximum(hi, -_GREATEST))  # what overflows is only known to be large


def _hull(*ends: Any) -> Interval:
    """Hull of products of ends; 0 times infinity is 0, since the other factor only tends to infinity."""
    lo, hi = ends[0], ends[0]
    for end in ends[1:]:
        lo, hi = np.fmin(lo, end), np.fmax(hi, end)
    return _outward(np.where(np.isnan(lo), 0.0, lo), np.where(np.isnan(hi), 0.0, hi))


def _divide(a: Any, b: Any) -> Interval:
    """Quotient; by an interval that holds 0 inside it may be anything, by one that begins or ends there it has one sign."""
    (alo, ahi), (blo, bhi) = _ends(a), map(np.asarray, _ends(b))
    blo, bhi = blo + 0.0, np.where((bhi == 0) & (blo < 0), -0.0, bhi)  # zeros of the side that the interval lies on
    with np.errstate(all="ignore"):
        quotient = _hull(alo / blo, alo / bhi, ahi / blo, ahi / bhi)
    free = ((blo >= 0) & (bhi > 0)) | ((bhi <= 0) & (blo < 0))
    return Interval(np.where(free, quotient.lo, -np.inf), np.where(free, quotient.hi, np.inf))


# --- elementary functions --------------------------------------------------------------------------------------------


def _increasing(function: Callable[[Any], Any], least: float = -np.inf, most: float = np.inf) -> Callable[[Any], Interval]:
    """A function that increases on [least, most]: arguments outside are clipped to where it is defined."""

    def enclose(u: Any) -> Interval:
        lo, hi = _ends(u)
        with np.errstate(all="ignore"):
            return _loosely(function(np.clip(lo, least, most)), function(np.clip(hi, least, most)))

    return enclose


def _holds(u: Interval, place: float, period: float) -> Any:
    """Whether the interval may hold place + n period for an integer n."""
    first, last = (u.lo - place) / period, (u.hi - place) / period
    slack = 4 * _EPS * (1 + np.maximum(np.abs(first), np.abs(last)))
    return np.floor(last + slack) >= np.ceil(first - slack)


def _wave(function: Callable[[Any], Any], peak: float) -> Callable[[Any], Interval]:
    """A sine or cosine, with its greatest value 1 at `peak` and its least half a turn later."""

    def enclose(u: Any) -> Interval:
        u = interval(u)
        with np.errstate(invalid="ignore"):  # an infinite end
            low, high = function(u.lo), function(u.hi)
        ends = _loosely(np.minimum(low, high), np.maximum(low, high))
        lo = np.where(_holds(u, peak + np.pi, 2 * np.pi), -1.0, np.maximum(ends.lo, -1.0))
        return Interval(lo, np.where(_holds(u, peak, 2 * np.pi), 1.0, np.minimum(ends.hi, 1.0)))

    return enclose


def _tan(u: Any) -> Interval:
    u = interval(u)
    pole = _holds(u, np.pi / 2, np.pi)
    with np.errstate(invalid="ignore"):  # an infinite end
        ends = _loosely(np.tan(u.lo), np.tan(u.hi))
    return Interval(np.where(pole, -np.inf, ends.lo), np.where(pole, np.inf, ends.hi))


def _acos(u: Any) -> Interval:
    lo, hi = _ends(u)
    return _loosely(np.arccos(np.clip(hi, -1.0, 1.0)), np.arccos(np.clip(lo, -1.0, 1.0)))


def _log(u: Any) -> Interval:
    lo, hi = _ends(u)
    with np.errstate(divide="ignore"):
        return _loosely(np.log(np.maximum(lo, 0.0)), np.log(np.maximum(hi, 5e-324)))


def _atan2(y: Any, x: Any) -> Interval:
    """Angle of a box: from its corners, unless it holds the origin or part of the cut along the negative x axis."""
    (ylo, yhi), (xlo, xhi) = _ends(y), _ends(x)
    ylo, yhi = ylo + 0.0, yhi + 0.0  # no negative zeros, which lie below the cut
    corners = [np.arctan2(end, side) for end in (ylo, yhi) for side in (xlo, xhi)]
    angle = _loosely(np.minimum.reduce(corners), np.maximum.reduce(corners))
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
        return _loosely(np.power(lo, number), np.power(hi, number))


def _abs(u: Any) -> Interval:
    u = interval(u)
    return Interval(u.mignitude, u.magnitude)


_exponential: Callable[[Any], Interval] = _increasing(np.exp)

# --- decisions: truth values from 0 to 1 -----------------------------------------------------------------------------


def _truth(surely: Any, possibly: Any) -> Interval:
    return Interval(np.where(surely, 1.0, 0.0), np.where(possibly, 1.0, 0.0))


def _less(a: Any, b: Any) -> Interval:
    (alo, ahi), (blo, bhi) = _ends(a), _ends(b)
    return _truth(np.less(ahi, blo), np.less(alo, bhi))


def _less_equal(a: Any, b: Any) -> Interval:
    (alo, ahi), (blo, bhi) = _ends(a), _ends(b)
    return _truth(np.less_equal(ahi, blo), np.less_equal(alo, bhi))


def _not(test: Any) -> Interval:
    return Interval(1.0 - test.hi, 1.0 - test.lo)


def _equal(a: Any, b: Any) -> Interval:
    ordered, reverse = _less_equal(a, b), _less_equal(b, a)
    return _minimum(ordered, reverse)


def _minimum(a: Any, b: Any) -> Interval:
    (alo, ahi), (blo, bhi) = _ends(a), _ends(b)
    return Interval(np.minimum(alo, blo), np.minimum(ahi, bhi))


def _maximum(a: Any, b: Any) -> Interval:
    (alo, ahi), (blo, bhi) = _ends(a), _ends(b)
    return Interval(np.maximum(alo, blo), np.maximum(ahi, bhi))


def _where(test: Any, yes: Any, no: Any) -> Interval:
    """The chosen branch, or the hull of both where the test is open."""
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


# -- scaled ------------------------------------------------------------------------------------------------------------


_MOST = 1e300  # exponents beyond are taken for this: their products with 0 stay 0
_FOLDED = Interval(1 - 2e-15, 1 + 2e-15)  # what rounding can make of a product of numeric factors
_ONE = Node("number", number=1.0)
Powers = dict[Node, tuple[Any, Any]]  # of each exponent's tree: its value a, and its coefficient c


class Scaled:
    """factor exp(sum of c a) over the numbers of a namespace (floats or intervals, arrays of them)."""

    __slots__ = ("factor", "ns", "powers")
    __array_ufunc__ = None  # so that array * Scaled comes here, and not element by element

    def __init__(self, factor: Any, powers: Powers, ns: Any) -> None:
        self.factor, self.powers, self.ns = factor, powers, ns

    @property
    def exponent(self) -> Any:
        """Sum of c a; 0.0 where nothing is kept apart."""
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
        """Of either term, the one with the greater exponent is factored out; one that is zero never."""
        if isinstance(other, Jet):
            return NotImplemented
        factor, powers = _parts(other)
        apart = Scaled(1.0, _merged(self.powers, powers, -1.0), self.ns)
        if not apart.powers:
            return Scaled(self.factor + factor, self.powers, self.ns)
        ahead = apart.exponent
        first = ((_middle(ahead) >= 0.0) & ~_is_zero(self.factor)) | _is_zero(factor)
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
    found = {}
    for tree in {**one, **two}:
        (a, c), (b, d) = one.get(tree, (None, 0.0)), two.get(tree, (None, 0.0))
        total = c + sign * d
        if np.any(total != 0.0):
            found[tree] = (b if a is None else a, total)
    return found


def _chosen(first: Any, one: Powers, two: Powers) -> Powers:
    return {
        tree: ((one.get(tree) or two[tree])[0], np.where(first, one.get(tree, (0, 0.0))[1], two.get(tree, (0, 0.0))[1]))
        for tree in {**one, **two}
    }


def _middle(u: Any) -> Any:
    return 0.5 * u.lo + 0.5 * u.hi if isinstance(u, Interval) else np.asarray(u)


def _is_zero(u: Any) -> Any:
    return (np.asarray(u.lo) == 0.0) & (np.asarray(u.hi) == 0.0) if isinstance(u, Interval) else np.asarray(u) == 0.0


def _times(u: Any, v: Any) -> Any:
    """Product in which 0 times infinity is 0: the infinity is an overflow."""
    return u * v if isinstance(u, Interval) or isinstance(v, Interval) else np.where(np.asarray(u) == 0.0, 0.0, u * v)[()]


def _held(a: Any) -> Any:
    if isinstance(a, Interval):
        return Interval(np.clip(a.lo, -_MOST, _MOST), np.clip(a.hi, -_MOST, _MOST))
    return np.clip(a, -_MOST, _MOST)


def plain(u: Any) -> Any:
    """A scaled number, or a jet of such, in the numbers below; any other as it is."""
    if isinstance(u, Jet):
        return Jet(plain(u.value), plain(u.first), None if u.second is None else plain(u.second))
    return u.plain if isinstance(u, Scaled) else u


def terms(node: Node) -> list[tuple[float, Node]]:
    """A tree as a sum of trees with numeric factors; what is numeric altogether stands beside the tree 1."""
    if not any(inner.op == "name" for inner in expressions.walk(node)):
        with np.errstate(all="ignore"):
            return [(float(expressions.value(node, At({}, np))), _ONE)]
    if node.op == "neg":
        return [(-c, part) for c, part in terms(node.args[0])]
    if node.op == "sum":
        parts = zip(node.signs, node.args, strict=True)
        return [(-c if sign == "-" else c, part) for sign, arg in parts for c, part in terms(arg)]
    if node.op != "product":
        return [(1.0, node)]
    factor, left = 1.0, []
    for sign, arg in zip(node.signs, node.args, strict=True):
        ((c, part), *more) = terms(arg) if arg.op != "sum" else [(1.0, arg)]
        if more or (part != _ONE and sign == "/"):
            c, part = 1.0, arg
        factor = factor * c if sign == "*" else factor / c
        left += [] if part == _ONE else [(sign, part)]
    if len(left) == 1 and left[0][0] == "*":
        return [(factor, left[0][1])]
    return [(factor, Node("product", (_ONE, *(part for _, part in left)), signs=("*", *(sign for sign, _ in left))))]


def _scaled_namespace(ns: Any) -> SimpleNamespace:
    def exponential(node: Node, at: At) -> Scaled:
        found: Powers = {}
        for c, part in terms(node):
            a = 1.0 if part == _ONE else _held(plain(expressions.value(part, at)))
            a = _FOLDED * a if ns is NAMESPACE else a
            found = _merged(found, {part: (a, c)}, 1.0)
        return Scaled(1.0, found, ns)

    def of_plain(name: str) -> Any:
        function = getattr(ns, name)
        return lambda *args: function(*map(plain, args))

    def logarithm(u: Any) -> Any:
        return ns.log(u.factor) + u.exponent if isinstance(u, Scaled) else ns.log(u)

    def of_factor(name: str) -> Any:
        function = getattr(ns, name)
        return lambda u: function(u.factor) if isinstance(u, Scaled) else function(u)

    def power(u: Any, exponent: Any) -> Any:
        steady = isinstance(u, Scaled) and isinstance(exponent, float | int)
        return u.to_power(exponent) if steady else ns.power(plain(u), plain(exponent))

    def compared(name: str) -> Any:
        function = getattr(ns, name)

        def compare(a: Any, b: Any) -> Any:
            apart = isinstance(a, Scaled) or isinstance(b, Scaled)
            return function((a - b).factor, 0.0) if apart else function(a, b)

        return compare

    def where(test: Any, yes: Any, no: Any) -> Any:
        if not (isinstance(yes, Scaled) or isinstance(no, Scaled)):
            return ns.where(test, yes, no)
        (one, powers), (two, others) = _parts(yes), _parts(no)
        lo, hi = (test.lo, test.hi) if isinstance(test, Interval) else (test, test)
        if np.any(np.asarray(lo) != np.asarray(hi)):
            return ns.where(test, plain(yes), plain(no))
        return Scaled(ns.where(test, one, two), _chosen(np.asarray(lo) != 0, powers, others), ns)

    def extreme(order: str) -> Any:
        before = compared(order)
        return lambda a, b: where(before(a, b), a, b)

    def absolute(u: Any) -> Any:
        return Scaled(ns.abs(u.factor), u.powers, ns) if isinstance(u, Scaled) else ns.abs(u)

    orders = ("less", "less_equal", "greater", "greater_equal", "equal", "not_equal")
    circular = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp")
    return SimpleNamespace(
        **{name: of_plain(name) for name in circular},
        **{name: compared(name) for name in orders},
        **{name: getattr(ns, name) for name in ("logical_and", "logical_or", "logical_not", "pi")},
        exponential=exponential,
        log=logarithm,
        sqrt=lambda u: u.to_power(0.5) if isinstance(u, Scaled) else ns.sqrt(u),
        abs=absolute,
        sign=of_factor("sign"),
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
        found = _scaled_namespace(ns) if base is None else jet_namespace(scaled_namespace(base))
        _NAMESPACES[id(ns)] = ns, found
    return _NAMESPACES[id(ns)][1]


# -- switching ---------------------------------------------------------------------------------------------------------


Array = NDArray[np.float64]
Enclosures = Callable[[Array, Array, Array], Mapping[str, Any]]
Values = Callable[[Array, Array], Mapping[str, Any]]

CELL_CAP = 200_000
FINEST = 1e-9  # of the range: cells that are still open then are taken for one touching point
_START = 32
_JETS = jet_namespace(NAMESPACE)


class SwitchingError(ValueError):
    """A function that cannot be followed over a range of angles; `{near}` in its text stands for the angle near which."""

    def __init__(self, text: str, near: float = 0.0) -> None:
        super().__init__(text.replace("{near}", f"{near:.6g}"))
        self.text, self.near = text, near


class _Search(NamedTuple):
    """A function that is smooth between edges: bounds of it and of its slope over cells, and its values.

    Both are also told the anchor of each cell: the middle of the piece between edges in which it lies.
    """

    enclose: Callable[[Array, Array, Array], tuple[Any, Any]]
    value: Callable[[Array, Array], Any]


class _Cells(NamedTuple):
    lo: Array
    hi: Array
    anchor: Array

    def where(self, chosen: NDArray[np.bool_]) -> _Cells:
        return _Cells(self.lo[chosen], self.hi[chosen], self.anchor[chosen])


def roots(
    enclose: Callable[[Array, Array], tuple[Any, Any]],
    value: Callable[[Array], Any],
    a: float,
    b: float,
    most: int = CELL_CAP,
) -> list[float]:
    """Every angle in (a, b) where a function changes sign or touches zero, ascending.

    `enclose(lo, hi)` gives enclosures of the function and of its derivative over arrays of cells, `value(phi)` its
    values. A stretch where the enclosure is exactly 0 has no roots; one where the function cannot be told from zero
    has a single, harmless one. Raises SwitchingError where there are too many to be found, in `most` cells.

    >>> from flywheel.numerics.intervals import NAMESPACE as ns
    >>> found = roots(lambda lo, hi: (ns.sin(Interval(lo, hi)), ns.cos(Interval(lo, hi))), np.sin, 1.0, 7.0)
    >>> [round(angle, 14) for angle in found]
    [3.14159265358979, 6.28318530717959]
    """
    edges = np.array([a, b], dtype=float)
    found = roots_in_pieces(lambda lo, hi, _: enclose(lo, hi), lambda phi, _: value(phi), edges, most)
    return [float(root) for root in found[1:-1]]


def roots_in_pieces(
    enclose: Callable[[Array, Array, Array], tuple[Any, Any]],
    value: Callable[[Array, Array], Any],
    edges: Array,
    most: int = CELL_CAP,
) -> Array:
    """The ascending edges, and between them every root of a function that is smooth in each piece, all at once.

    As `roots`, but for a third argument of `enclose` and a second of `value`: the middle of the piece that a cell lies in.
    """
    return _apart(edges, _roots_between(_Search(enclose, value), edges, most))


def breakpoints(
    expression: Expression, a: float, b: float, env: Enclosures, env_value: Values, known: Iterable[float] = ()
) -> list[float]:
    """Every angle in (a, b) where a switch of the expression changes, or a root, asin or acos has a branch point.

    What depends on speed or time is left out: position does not tell where that switches.

    `env(lo, hi, anchor)` gives, for arrays of cells, the names as jets of intervals (constants as floats),
    `env_value(phi, anchor)` their values; the anchor is the middle of the piece, which tells an angle at its end from the
    next piece's beginning. Between `known` angles the names must be smooth and `v`, given by its sign, constant.

    >>> phi_cells = lambda lo, hi, anchor: {"phi": Jet(Interval(lo, hi), 1.0)}
    >>> from flywheel.numerics.expressions import parse
    >>> found = breakpoints(parse("max(sin(phi), 0.5)*(phi < 2)"), 0, 6, phi_cells, lambda phi, _: {"phi": phi})
    >>> [round(angle, 14) for angle in found]
    [0.5235987755983, 2.0, 2.61799387799149]
    """
    start = np.array(sorted({float(a), *map(float, known), float(b)}))
    edges = start
    for part in (*expression.switches(), *expression.branch_points()):
        if part.uses_speed or part.uses_time:
            continue
        try:
            found = _roots_between(_search_of(part, env, env_value), edges)
        except SwitchingError as error:
            raise SwitchingError(f"{part.shown}: {error.text}", error.near) from None
        edges = _apart(edges, found)
    return [float(angle) for angle in edges[_distance(edges, start) > 0]]


def _search_of(part: Expression, env: Enclosures, env_value: Values) -> _Search:
    def enclose(lo: Array, hi: Array, anchor: Array) -> tuple[Any, Any]:
        jet = part.evaluate(env(lo, hi, anchor), _JETS, env_value(anchor, anchor))
        return (jet.value, jet.first) if isinstance(jet, Jet) else (jet, 0.0)

    def value(phi: Array, anchor: Array) -> Any:
        return part.evaluate(env_value(phi, anchor), np, env_value(anchor, anchor))

    return _Search(enclose, value)


def _apart(edges: Array, found: Array) -> Array:
    """The edges with the found angles put in, but for those that only rounding tells from an edge or each other."""
    near = 16 * _EPS * max(abs(edges[0]), abs(edges[-1]))
    angles = np.sort(found)
    angles = angles[_distance(angles, edges) > near]
    return np.sort(np.concatenate((edges, angles[np.diff(angles, prepend=-np.inf) > near])))


def _distance(angles: Array, edges: Array) -> Array:
    """Distance of each angle from the nearest of ascending edges."""
    above = np.searchsorted(edges, angles)
    after, before = edges[np.minimum(above, edges.size - 1)], edges[np.maximum(above - 1, 0)]
    return np.minimum(np.abs(after - angles), np.abs(angles - before))


def _roots_between(search: _Search, edges: Array, most: int = CELL_CAP) -> Array:
    """Roots of all pieces between edges at once, unordered; some may repeat an edge or each other."""
    with np.errstate(all="ignore"):
        monotone, flat = _isolated(search, edges, most)
        crossings, doubtful = _crossings(search, monotone)
        return np.concatenate((crossings, _touching_points(search, _joined([flat, doubtful]), edges)))


def _isolated(search: _Search, edges: Array, most: int) -> tuple[_Cells, _Cells]:
    """Cells that hold at most one root, and cells that cannot be split with profit."""
    cells, seen = _first_cells(edges), 0
    finest = FINEST * (edges[-1] - edges[0])
    monotone, touching = [], []
    while cells.lo.size:
        seen += cells.lo.size
        if seen > most:
            text = f"changes sign too often: its zeros are not told apart in {most} cells (first near phi = {{near}})"
            raise SwitchingError(text, float(cells.lo[0]))
        bounds, slope, noise = _bounds(search, cells)
        is_open = ~((bounds.lo > 0) | (bounds.hi < 0) | ((bounds.lo == 0) & (bounds.hi == 0)))
        is_monotone = is_open & ((slope.lo > 0) | (slope.hi < 0))
        too_fine = (cells.hi - cells.lo <= finest) | (bounds.width <= 4 * noise)
        monotone.append(cells.where(is_monotone))
        touching.append(cells.where(is_open & ~is_monotone & too_fine))
        cells = _halved(cells.where(is_open & ~is_monotone & ~too_fine))
    return _joined(monotone), _joined(touching)


def _first_cells(edges: Array) -> _Cells:
    share = -(-_START // (edges.size - 1))
    steps = np.linspace(0.0, 1.0, share + 1)
    left, right = edges[:-1, None], edges[1:, None]
    grid = left * (1 - steps) + right * steps
    grid[:, -1] = edges[1:]
    anchor = np.repeat(0.5 * (edges[:-1] + edges[1:]), share)
    return _Cells(grid[:, :-1].ravel(), grid[:, 1:].ravel(), anchor)


def _bounds(search: _Search, cells: _Cells) -> tuple[Interval, Interval, Array]:
    """Bounds of value and slope over each cell, and the width that rounding alone gives the value at its middle.

    The value is the intersection of its plain enclosure with f(middle) + f'(cell) (cell - middle).
    """
    count, middle = cells.lo.size, 0.5 * (cells.lo + cells.hi)
    lo, hi = np.concatenate((cells.lo, middle)), np.concatenate((cells.hi, middle))
    value, slope = search.enclose(lo, hi, np.tile(cells.anchor, 2))
    plain, centre = _halves(value, count)
    slope = _halves(slope, count)[0]
    mean = centre + slope * Interval(cells.lo - middle, cells.hi - middle)
    return Interval(np.fmax(plain.lo, mean.lo), np.fmin(plain.hi, mean.hi)), slope, centre.width


def _halves(u: Any, count: int) -> tuple[Interval, Interval]:
    lo, hi = (np.broadcast_to(end, 2 * count) for end in (interval(u).lo, interval(u).hi))
    return Interval(lo[:count], hi[:count]), Interval(lo[count:], hi[count:])


def _halved(cells: _Cells) -> _Cells:
    middle = 0.5 * (cells.lo + cells.hi)
    return _joined([_Cells(cells.lo, middle, cells.anchor), _Cells(middle, cells.hi, cells.anchor)])


def _joined(parts: list[_Cells]) -> _Cells:
    return _Cells(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _crossings(search: _Search, cells: _Cells) -> tuple[Array, _Cells]:
    """Sign changes of cells where the function is monotone.

    Also, as cells without width, the ends of other such cells where rounding cannot tell the value from zero.
    """
    inside, others = _split_by_sign(search, cells)
    ends = _joined([_Cells(end, end, others.anchor) for end in (others.lo, others.hi)])
    if not ends.lo.size:
        return inside, ends
    at_ends = interval(search.enclose(*ends)[0])
    return inside, ends.where(np.broadcast_to(at_ends.contains(0.0), ends.lo.shape))


def _touching_points(search: _Search, cells: _Cells, edges: Array) -> Array:
    """One angle for every run of neighbouring cells: the sign change in it, else the extreme, else its middle.

    A run without sign change that ends at an edge touches zero there, and needs nothing.
    """
    if not cells.lo.size:
        return cells.lo
    runs = _runs(cells)
    crossing, rest = _split_by_sign(search, runs)
    rest = rest.where((_distance(rest.lo, edges) > 0) & (_distance(rest.hi, edges) > 0))
    extreme, rest = _split_by_sign(_Search(search.enclose, _slopes(search)), rest)
    return np.concatenate((crossing, extreme, 0.5 * (rest.lo + rest.hi)))


def _slopes(search: _Search) -> Callable[[Array, Array], Array]:
    def slope(phi: Array, anchor: Array) -> Array:
        bounds = interval(search.enclose(phi, phi, anchor)[1])
        return np.asarray(0.5 * (bounds.lo + bounds.hi))

    return slope


def _split_by_sign(search: _Search, cells: _Cells) -> tuple[Array, _Cells]:
    """The roots of cells at whose ends the signs differ, and the other cells."""
    if not cells.lo.size:
        return cells.lo, cells
    low, high = _values(search, cells.lo, cells.anchor), _values(search, cells.hi, cells.anchor)
    change = np.sign(low) * np.sign(high) < 0
    if not change.any():
        return low[change], cells
    return _polished(search, cells.where(change), low[change], high[change]), cells.where(~change)


def _runs(cells: _Cells) -> _Cells:
    order = np.lexsort((cells.hi, cells.lo))
    lo, hi, anchor = cells.lo[order], cells.hi[order], cells.anchor[order]
    starts = np.concatenate(([True], (lo[1:] != hi[:-1]) | (anchor[1:] != anchor[:-1])))
    last = np.concatenate((starts[1:], [True]))
    return _Cells(lo[starts], hi[last], anchor[starts])


def _values(search: _Search, phi: Array, anchor: Array) -> Array:
    return np.broadcast_to(np.asarray(search.value(phi, anchor), dtype=float), phi.shape)


def _polished(search: _Search, cells: _Cells, low: Array, high: Array) -> Array:
    """Roots in cells with a sign change, to the last unit or two, by Chandrupatla's method on all cells at once.

    Inverse quadratic interpolation where it is safe, bisection elsewhere. Source: T. R. Chandrupatla, Advances in
    Engineering Software 28 (1997) 145-149.
    """
    a, b, fa, fb = cells.hi, cells.lo, high, low
    share = np.full_like(a, 0.5)
    best = a
    for _ in range(200):
        x = a + share * (b - a)
        fx = _values(search, x, cells.anchor)
        same = np.sign(fx) == np.sign(fa)
        c, fc = np.where(same, a, b), np.where(same, fa, fb)
        b, fb = np.where(same, b, a), np.where(same, fb, fa)
        a, fa = x, fx
        best = np.where(np.abs(fa) < np.abs(fb), a, b)
        least = _EPS * np.abs(best) / np.abs(b - a)
        if np.all((least > 0.5) | (fa == 0) | (fb == 0)):
            break
        share = np.clip(_inverse_quadratic(a, b, c, fa, fb, fc), least, 1 - least)
        share = np.where(np.isfinite(share), share, 0.5)
    return best


def _inverse_quadratic(a: Array, b: Array, c: Array, fa: Array, fb: Array, fc: Array) -> Array:
    place, height = (a - b) / (c - b), (fa - fb) / (fc - fb)
    safe = (height**2 < place) & ((1 - height) ** 2 < 1 - place)
    share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    return np.where(safe, share, 0.5)


# -- resolution --------------------------------------------------------------------------------------------------------


Mask = NDArray[np.bool_]

RESOLUTION_CAP = 10_000  # that are added by halving: more would take seconds
FINEST_CELL = 1e-14  # of the range: narrower cells are no longer split

_ROOTED = 1e-12  # of the range: in narrower cells rounding of the angle would take nodes across a root's branch point

_EXPONENT = 8.0  # widest range of an exponential's argument
_NEGLIGIBLE = 1e-20  # of the greatest value of the whole expression
_PHASE = 3.0  # widest range of a sine's argument
_POLE = 3.0  # greatest ratio of the distances from a pole
_BRANCH = 6.0  # greatest ratio of the distances from a branch point
_TAME_POWER = 8  # up to here a power of what 17 nodes resolve is resolved by them
_SCALED = scaled_namespace(NAMESPACE)


class _Pending(NamedTuple):
    """Cells under examination: their bounds in interval arithmetic, values in their middles, share of the range.

    `blame` collects which nodes found which cells too wide.
    """

    bounds: At
    middle: At
    share: Array
    blame: list[tuple[Node, Mask]]

    def scaled(self, node: Node) -> Scaled:
        """Bounds of a node, with its exponential factor kept apart."""
        u = expressions.value(node, self.bounds)
        return u if isinstance(u, Scaled) else Scaled(u, {}, NAMESPACE)

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
        u = expressions.value(node, self.bounds.anchor)
        return np.asarray(interval(u.factor if isinstance(u, Scaled) else u).width)


class _Wanted(NamedTuple):
    """How far a node, divided by an exponential factor, may be off in every cell; infinite where it does not count."""

    tolerance: Array
    powers: Powers


def resolved(expression: Expression, lo: Array, hi: Array, env: Enclosures, env_value: Values) -> Array:
    """Angles at which the cells from `lo` to `hi` (rad) must be split further for 17 nodes to follow an expression.

    The cells must lie between the expression's breakpoints; `env` and `env_value` are those of `breakpoints`.
    Raises SwitchingError where a denominator comes to zero, a tangent is infinite, or 10 000 cells more do not do.

    >>> from flywheel.numerics.expressions import parse
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


def _examined(lo: Array, hi: Array, span: float, env: Enclosures, env_value: Values) -> _Pending:
    middle = 0.5 * (lo + hi)
    inside = {name: u.value if isinstance(u, Jet) else u for name, u in env(lo, hi, middle).items()}
    centre = env_value(middle, middle)
    return _Pending(At(inside, _SCALED, At(centre, _SCALED)), At(centre, scaled_namespace(np)), (hi - lo) / span, [])


def _check(
    expression: Expression, cells: _Pending, wide: Mask, lo: Array, span: float, count: int, env_value: Values
) -> None:
    """Refuse what no cells of bearable width and number follow, naming the part of the expression that asks for them."""
    finest = wide & (cells.share <= FINEST_CELL)
    if not (finest.any() or count > RESOLUTION_CAP):
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
    text = f"{expression.shown}:{which} varies too fast for {RESOLUTION_CAP} cells to follow it (first near phi = {{near}})"
    raise SwitchingError(text, near)


def _infinite(expression: Expression, node: Node, cells: _Pending, at: int) -> str:
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


def _strained(node: Node, cells: _Pending, wanted: _Wanted) -> Mask:
    """Cells that are too wide for a node or anything inside it; only branches that are taken count."""
    tolerance = wanted.tolerance
    if node.op in expressions.BOOLEAN or node.op == "sign" or not (tolerance < np.inf).any():
        return np.zeros(tolerance.shape, dtype=bool)
    if node.op in ("if", "min", "max"):
        first, second, chosen = _branches(node, cells)
        yes, no = (wanted._replace(tolerance=np.where(side, tolerance, np.inf)) for side in (chosen, ~chosen))
        return _strained(first, cells, yes) | _strained(second, cells, no)
    if node.op in ("neg", "abs"):
        return _strained(node.args[0], cells, wanted)
    u = cells.scaled(node)
    rest = u / Scaled(1.0, wanted.powers, NAMESPACE)
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
    growth = cells.wide(NAMESPACE.exp(interval(rest.exponent))).magnitude if rest.powers else 1.0
    for arg, inner in _inner(node, cells, u, _share(tolerance, growth)):
        strained = strained | _strained(arg, cells, inner)
    return strained


def _share(tolerance: Array, steepness: Any) -> Array:
    """What an argument may be off where its function rises by so much at most; nothing where that is not known."""
    shared = tolerance / steepness
    return np.asarray(np.where(np.isnan(shared), np.where(tolerance == np.inf, np.inf, 0.0), shared))


def _inner(node: Node, cells: _Pending, u: Scaled, tolerance: Array) -> list[tuple[Node, _Wanted]]:
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


def _of_factors(node: Node, cells: _Pending, tolerance: Array) -> list[tuple[Node, _Wanted]]:
    scaled = [cells.scaled(arg) for arg in node.args]
    sizes = [cells.wide(u.factor) for u in scaled]
    sizes = [v if sign == "*" else NAMESPACE.divide(1.0, v) for sign, v in zip(node.signs, sizes, strict=True)]
    found = []
    for k, (sign, arg) in enumerate(zip(node.signs, node.args, strict=True)):
        others: Any = np.ones(tolerance.shape)
        for j, size in enumerate(sizes):
            others = others * (size.magnitude if j != k else 1.0)
        steepness = others if sign == "*" else others * sizes[k].magnitude ** 2
        found.append((arg, _Wanted(_share(tolerance, steepness), scaled[k].powers)))
    return found


def _branches(node: Node, cells: _Pending) -> tuple[Node, Node, Mask]:
    if node.op == "if":
        test, first, second = node.args
        chosen = expressions.truth(test, cells.middle)
    else:
        first, second = node.args
        left, right = (plain(expressions.value(arg, cells.middle)) for arg in node.args)
        chosen = left <= right if node.op == "min" else left >= right
    return first, second, np.broadcast_to(np.asarray(chosen, dtype=bool), cells.share.shape)


# --- how wide a cell may be for each function ------------------------------------------------------------------------


def _ratio(u: Interval) -> Array:
    """Greatest over least distance from zero; infinite where zero is inside."""
    return np.asarray(np.where(u.mignitude > 0, u.magnitude / u.mignitude, np.inf))


def _oscillating(node: Node, cells: _Pending) -> Mask:
    return np.asarray(cells.enclosure(node.args[0]).width > _PHASE)


def _tangent(node: Node, cells: _Pending) -> Mask:
    """Its poles are the zeros of the cosine."""
    u = cells.enclosure(node.args[0])
    return np.asarray((u.width > 1.0) | (_ratio(NAMESPACE.cos(u)) > _POLE))


def _denominators(node: Node, cells: _Pending) -> Mask:
    factors = [arg for sign, arg in zip(node.signs, node.args, strict=True) if sign == "/"]
    ratios = [_ratio(cells.factor(factor)) for factor in factors]
    return np.asarray(np.any([ratio > _POLE for ratio in ratios], axis=0)) if ratios else np.zeros(cells.share.shape, bool)


def _graded(arg: Node, u: Interval, order: float, cells: _Pending) -> Mask:
    """Near a branch point u^order the cells shrink with their distance, until what is left adds nothing.

    Nor do they shrink where the bounds of u are as wide as rounding alone makes them.
    """
    least = 2 * FINEST_CELL if order <= 0.0 else _ROOTED
    near = (_ratio(u) > _BRANCH) & (cells.share > max(1e-16 ** (1 / (1 + order)), least))
    return np.asarray(near & (u.width > 4 * cells.rounding(arg))) if near.any() else np.asarray(near)


def _root(node: Node, cells: _Pending) -> Mask:
    return _graded(node.args[0], cells.factor(node.args[0]), 0.5, cells)


def _logarithm(node: Node, cells: _Pending) -> Mask:
    return _graded(node.args[0], cells.factor(node.args[0]), 0.0, cells)


def _arcsine(node: Node, cells: _Pending) -> Mask:
    arg = node.args[0]
    u = cells.enclosure(arg)
    return _graded(arg, 1.0 - u, 0.5, cells) | _graded(arg, 1.0 + u, 0.5, cells)


def _arctangent(node: Node, cells: _Pending) -> Mask:
    u = cells.enclosure(node.args[0])
    return np.asarray(u.width > 1.5 * np.hypot(1.0, u.mignitude))


def _direction(node: Node, cells: _Pending) -> Mask:
    y, x = (cells.enclosure(arg) for arg in node.args)
    near = np.maximum(y.width, x.width) > 1.5 * np.hypot(y.mignitude, x.mignitude)
    return np.asarray(near & (cells.share > 2 * FINEST_CELL))


def _power_width(node: Node, cells: _Pending) -> Mask:
    base, exponent = node.args
    if expressions.grows(node):
        return np.zeros(cells.share.shape, bool)
    u = cells.factor(base)
    if exponent.op != "number":
        steep = (cells.enclosure(exponent) * NAMESPACE.log(u)).width > _EXPONENT
        return np.asarray(steep | _graded(base, u, 0.0, cells))
    number = exponent.number
    if number < 0:
        return np.asarray(_ratio(u) > min(_POLE, np.exp(12.0 / -number)))
    if number % 1:
        return _graded(base, u, number, cells)
    high = number > _TAME_POWER  # as steep as an exponential of n log u
    return np.asarray(_ratio(u) > np.exp(12.0 / number)) if high else np.zeros(cells.share.shape, bool)


_RULES: dict[str, Callable[[Node, _Pending], Mask]] = {
    "sin": _oscillating,
    "cos": _oscillating,
    "tan": _tangent,
    "product": _denominators,
    "**": _power_width,
    "sqrt": _root,
    "log": _logarithm,
    "asin": _arcsine,
    "acos": _arcsine,
    "atan": _arctangent,
    "atan2": _direction,
}
