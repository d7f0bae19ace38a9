"""Numbers whose exponential factor is kept apart, m exp(sum of c a): what overflows by itself may still cancel.

With a = 300*(phi - 3), exp(a)/(1 + exp(a)) is inf/inf in plain numbers soon after phi = 3, and bounds of it over a cell
are useless wherever exp(a) changes by much. Kept apart, exp(a) is 1 exp(a), 1 + exp(a) is (1 + exp(-a)) exp(a), and the
quotient 1/(1 + exp(-a)). The exponents `a` are told apart by their trees, without numeric factors: exp(a), exp(-a) and
exp(2*a) share one.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from flywheel.formulas import trees
from flywheel.formulas.intervals import NAMESPACE, Interval
from flywheel.formulas.jets import Jet, jet_namespace
from flywheel.formulas.trees import At, Node

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
    if not any(inner.op == "name" for inner in trees.walk(node)):
        with np.errstate(all="ignore"):
            return [(float(trees.value(node, At({}, np))), _ONE)]
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
            a = 1.0 if part == _ONE else _held(plain(trees.value(part, at)))
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
