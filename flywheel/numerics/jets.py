"""Derivatives to second order carried along with the value (forward differentiation), over any kind of number.

With floats or arrays inside they give x, dx/dphi and d²x/dphi² of a law; with intervals inside, proven bounds of them.
A jet whose `second` is None is of first order: everything computed from it skips the second derivative.

Functions of one number at a time are Python's own for floats, which are fast, and numpy's for recorded numbers:
`is_recorded` tests for these, `present` gives their present value.

>>> sqrt(2.0) == math.sqrt(2.0), type(atan2(1.0, 2.0))
(True, <class 'float'>)

Source: A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, chapter 13 (Taylor arithmetic).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from types import SimpleNamespace
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

Derivatives = tuple[Any, Callable[[], Any]]  # the slope, and the second derivative on demand


class Jet:
    """A value u with its derivatives u' and u'' by one variable.

    >>> phi = Jet(3.0, 1.0, 0.0)
    >>> phi * phi / 2
    Jet(4.5, 3.0, 1.0)
    """

    __slots__ = ("first", "second", "value")
    __array_ufunc__ = None  # so that array * Jet comes here, and not element by element

    def __init__(self, value: Any, first: Any, second: Any = None) -> None:
        self.value = value
        self.first = first
        self.second = second

    def __repr__(self) -> str:
        return f"Jet({self.value}, {self.first}, {self.second})"

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.first, None if self.second is None else -self.second)

    def __add__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.first, self.second)
        second = None if self.second is None or other.second is None else self.second + other.second
        return Jet(self.value + other.value, self.first + other.first, second)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Jet:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Jet:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            second = None if self.second is None else self.second * other
            return Jet(self.value * other, self.first * other, second)
        u, v = self, other
        value, first = u.value * v.value, u.first * v.value + u.value * v.first
        if u.second is None or v.second is None:
            return Jet(value, first)
        return Jet(value, first, u.second * v.value + 2.0 * (u.first * v.first) + u.value * v.second)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Jet:
        quotient: Jet = _divide(self, other, operator.truediv)
        return quotient

    def __rtruediv__(self, other: Any) -> Jet:
        quotient: Jet = _divide(other, self, operator.truediv)
        return quotient

    def __pow__(self, exponent: float) -> Jet:
        return _constant_power(self, exponent, operator.pow)


def value_of(u: Any) -> Any:
    """The value of a jet, or a plain number."""
    return u.value if isinstance(u, Jet) else u


def _parts(u: Any) -> tuple[Any, Any, Any]:
    return (u.value, u.first, u.second) if isinstance(u, Jet) else (u, 0.0, 0.0)


def _divide(u: Any, v: Any, divide: Callable[[Any, Any], Any]) -> Any:
    """Quotient q = u/v: q' = (u' - q v')/v, q'' = (u'' - 2 q' v' - q v'')/v."""
    if not isinstance(v, Jet):
        parts = [None if part is None else divide(part, v) for part in _parts(u)]
        return Jet(*parts) if isinstance(u, Jet) else parts[0]
    top, first, second = _parts(u)
    quotient = divide(top, v.value)
    slope = divide(first - quotient * v.first, v.value)
    if second is None or v.second is None:
        return Jet(quotient, slope)
    return Jet(quotient, slope, divide(second - 2.0 * (slope * v.first) - quotient * v.second, v.value))


def _chain(u: Jet, value: Any, slope: Any, bend: Callable[[], Any], square: Callable[[Any], Any]) -> Jet:
    """Chain rule f(u): f' u', and f'' u'² + f' u''; `bend` gives f'' and is called only when it is needed."""
    first = slope * u.first
    return Jet(value, first, None if u.second is None else bend() * square(u.first) + slope * u.second)


def _constant_power(u: Jet, n: Any, power: Callable[[Any, Any], Any]) -> Jet:
    """Power with a constant exponent n: n u^(n-1), n (n-1) u^(n-2), without the powers that a factor 0 removes."""
    steady = isinstance(n, (int, float))  # else it is an array: an exponent that jumps

    def term(factor: Any, exponent: Any) -> Any:
        if steady and (factor == 0 or exponent == 0):
            return factor
        return factor * (u.value if steady and exponent == 1 else power(u.value, exponent))

    return _chain(u, power(u.value, n), term(n, n - 1), lambda: term(n * (n - 1), n - 2), lambda first: power(first, 2.0))


def _rules(ns: Any) -> dict[str, Callable[[Any, Any], Derivatives]]:
    """Slope and second derivative of each function of one variable, at u where its value is f."""

    def tangent(u: Any, f: Any) -> Derivatives:
        slope = 1.0 + ns.power(f, 2.0)
        return slope, lambda: 2.0 * f * slope

    def arcsine(u: Any, f: Any) -> Derivatives:
        slope = ns.divide(1.0, ns.sqrt((1.0 - u) * (1.0 + u)))
        return slope, lambda: u * ns.power(slope, 3.0)

    def arccosine(u: Any, f: Any) -> Derivatives:
        slope, bend = arcsine(u, f)
        return -slope, lambda: -bend()

    def hyperbolic_arccosine(u: Any, f: Any) -> Derivatives:
        slope = ns.divide(1.0, ns.sqrt((u - 1.0) * (u + 1.0)))
        return slope, lambda: -u * ns.power(slope, 3.0)

    def arctangent(u: Any, f: Any) -> Derivatives:
        slope = ns.divide(1.0, 1.0 + ns.power(u, 2.0))
        return slope, lambda: -2.0 * u * ns.power(slope, 2.0)

    def root(u: Any, f: Any) -> Derivatives:
        slope = ns.divide(0.5, f)
        return slope, lambda: ns.divide(-0.5 * slope, u)

    def logarithm(u: Any, f: Any) -> Derivatives:
        slope = ns.divide(1.0, u)
        return slope, lambda: -ns.power(slope, 2.0)

    return {
        "sin": lambda u, f: (ns.cos(u), lambda: -f),
        "cos": lambda u, f: (-ns.sin(u), lambda: -f),
        "tan": tangent,
        "asin": arcsine,
        "acos": arccosine,
        "atan": arctangent,
        "sqrt": root,
        "exp": lambda u, f: (f, lambda: f),
        "log": logarithm,
        "acosh": hyperbolic_arccosine,
    }


def jet_namespace(ns: Any) -> SimpleNamespace:
    """The namespace of jets over the numbers of `ns`; plain numbers of `ns` pass through it as constants.

    Comparisons look at values alone; abs, sign, minimum and maximum take the derivatives of the side they are on.

    >>> import numpy as np
    >>> jet_namespace(np).exp(Jet(0.0, 2.0, 0.0))
    Jet(1.0, 2.0, 4.0)
    """

    def square(u: Any) -> Any:
        return ns.power(u, 2.0)

    def lifted(name: str, rule: Callable[[Any, Any], Derivatives]) -> Callable[[Any], Any]:
        plain = getattr(ns, name)

        def function(u: Any) -> Any:
            if not isinstance(u, Jet):
                return plain(u)
            value = plain(u.value)
            return _chain(u, value, *rule(u.value, value), square)

        return function

    def compared(name: str) -> Callable[[Any, Any], Any]:
        plain = getattr(ns, name)
        return lambda a, b: plain(value_of(a), value_of(b))

    def where(test: Any, yes: Any, no: Any) -> Any:
        if not (isinstance(yes, Jet) or isinstance(no, Jet)):
            return ns.where(test, yes, no)
        pairs = zip(_parts(yes), _parts(no), strict=True)
        return Jet(*(None if a is None or b is None else ns.where(test, a, b) for a, b in pairs))

    def absolute(u: Any) -> Any:
        if not isinstance(u, Jet):
            return ns.abs(u)
        side = ns.sign(u.value)
        return Jet(ns.abs(u.value), side * u.first, None if u.second is None else side * u.second)

    def extreme(name: str, order: str) -> Callable[[Any, Any], Any]:
        plain, before = getattr(ns, name), getattr(ns, order)

        def choose(a: Any, b: Any) -> Any:
            value = plain(value_of(a), value_of(b))
            if not (isinstance(a, Jet) or isinstance(b, Jet)):
                return value
            jet = where(before(value_of(a), value_of(b)), a, b)
            return Jet(value, jet.first, jet.second)

        return choose

    def power(u: Any, exponent: Any) -> Any:
        if isinstance(exponent, Jet):
            return functions["exp"](exponent * functions["log"](u))
        return _constant_power(u, exponent, ns.power) if isinstance(u, Jet) else ns.power(u, exponent)

    def atan2(y: Any, x: Any) -> Any:
        value = ns.atan2(value_of(y), value_of(x))
        if not (isinstance(y, Jet) or isinstance(x, Jet)):
            return value
        (y0, y1, y2), (x0, x1, x2) = _parts(y), _parts(x)
        square_radius = square(y0) + square(x0)
        slope = ns.divide(x0 * y1 - y0 * x1, square_radius)
        if y2 is None or x2 is None:
            return Jet(value, slope)
        growth = 2.0 * (x0 * x1 + y0 * y1)
        return Jet(value, slope, ns.divide(x0 * y2 - y0 * x2 - slope * growth, square_radius))

    def exponential(parts: Any, exponent: Callable[[], Any]) -> Any:
        """The exponential over numbers that keep exponents apart (`flywheel.numerics.intervals.Scaled`)."""
        value = ns.exponential([(key, c, value_of(a)) for key, c, a in parts], exponent)
        u = exponent()
        return _chain(u, value, value, lambda: value, square) if isinstance(u, Jet) else value

    functions = {name: lifted(name, rule) for name, rule in _rules(ns).items() if hasattr(ns, name)}
    comparisons = ("less", "less_equal", "greater", "greater_equal", "equal", "not_equal")
    return SimpleNamespace(
        **functions,
        **({"exponential": exponential} if hasattr(ns, "exponential") else {}),
        over=ns,
        **{name: compared(name) for name in comparisons},
        **{name: getattr(ns, name) for name in ("logical_and", "logical_or", "logical_not", "pi")},
        abs=absolute,
        sign=lambda u: ns.sign(value_of(u)),
        minimum=extreme("minimum", "less_equal"),
        maximum=extreme("maximum", "greater_equal"),
        where=where,
        divide=lambda u, v: _divide(u, v, ns.divide),
        power=power,
        atan2=atan2,
    )


def is_recorded(value: object) -> TypeGuard[float]:
    """Tests whether a value is a number on a tape (`bondgraph.recording`), which stands for those of many designs."""
    return getattr(value, "is_recorded", False) is True


def present(value: Any) -> Any:
    """The present value of a recorded number; anything else unchanged.

    Results of it are not recorded: use it only for a choice that guards ensure elsewhere, such as that of a piece by its
    anchor.
    """
    return value.value if is_recorded(value) else value  # type: ignore[attr-defined]


def presents(values: Any) -> NDArray[np.float64]:
    """The present values of a number or of an array of them, as floats of the same shape.

    Raises TypeError for a recorded number that stands for any value: it chooses nothing.
    """
    table = np.asarray(values)
    if table.dtype != object:
        return np.asarray(table, dtype=float)
    plain = [present(each) for each in table.flat]
    if None in plain:
        raise TypeError("a recorded number without a present value")
    return np.array(plain, dtype=float).reshape(table.shape)


def mapped(record: Any, change: Callable[[Any], Any]) -> Any:
    """A tree of records, tuples and mappings with every recorded number in it changed.

    >>> mapped((1.0, "a", {"b": (2.0,)}), lambda number: -number)
    (1.0, 'a', {'b': (2.0,)})
    """
    if is_recorded(record):
        return change(record)
    if isinstance(record, tuple):
        entries = [mapped(entry, change) for entry in record]
        return type(record)(*entries) if hasattr(record, "_fields") else tuple(entries)
    if is_dataclass(record) and not isinstance(record, type):
        return replace(record, **{each.name: mapped(getattr(record, each.name), change) for each in fields(record)})
    return {name: mapped(entry, change) for name, entry in record.items()} if isinstance(record, Mapping) else record


def recorded_in(record: Any) -> list[Any]:
    """The recorded numbers in such a tree, each once."""
    numbers: dict[int, Any] = {}
    mapped(record, lambda number: numbers.setdefault(number.number, number))
    return list(numbers.values())


def _of_any_number(plain: Callable[..., float], ufunc: Callable[..., Any]) -> Callable[..., float]:
    """The function of `math`; for other numbers that of numpy, which calls their own method."""

    def function(*numbers: Any) -> float:
        try:
            return plain(*numbers)
        except TypeError:
            recorded: float = ufunc(*numbers)
            return recorded

    return function


sqrt = _of_any_number(math.sqrt, np.sqrt)
sin = _of_any_number(math.sin, np.sin)
cos = _of_any_number(math.cos, np.cos)
acos = _of_any_number(math.acos, np.arccos)
acosh = _of_any_number(math.acosh, np.arccosh)
asin = _of_any_number(math.asin, np.arcsin)
atan2 = _of_any_number(math.atan2, np.arctan2)
exp = _of_any_number(math.exp, np.exp)
expm1 = _of_any_number(math.expm1, np.expm1)
hypot = _of_any_number(math.hypot, np.hypot)
log = _of_any_number(math.log, np.log)
degrees = _of_any_number(math.degrees, np.degrees)
