"""The numbers of the oracle, and jets of them: a value with its first and second derivative along the crank angle.

Long doubles (a mantissa of 64 bits), or mpmath's with as many digits as the variable ORACLE_DIGITS says when this module is
imported. Arrays hold many angles at once, (panels, nodes).
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp  # type: ignore[import-untyped]

DIGITS = int(os.environ.get("ORACLE_DIGITS", "0"))
ELEMENTARY = {"sin": "sin", "cos": "cos", "sqrt": "sqrt", "exp": "exp", "log": "log", "arctan": "atan", "arcsin": "asin"}
Real: Any = np.longdouble
KIND: Any = np.longdouble  # of arrays
plain: Any = np  # functions of numbers and of arrays of them
EPS = float(np.finfo(np.longdouble).eps)  # what errors are held against
if DIGITS:
    mp.dps, Real, KIND, EPS = DIGITS, mp.mpf, object, 10.0 ** (-0.8 * DIGITS)
    plain = SimpleNamespace(**{name: np.frompyfunc(getattr(mp, own), 1, 1) for name, own in ELEMENTARY.items()})
    plain.floor, plain.ceil = np.frompyfunc(mp.floor, 1, 1), np.frompyfunc(mp.ceil, 1, 1)
    plain.arctan2 = np.frompyfunc(mp.atan2, 2, 1)
PI = Real("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798215")
ZERO = Real(0)
POUND_FORCE = "4.4482216152605"
UNITS = {
    "m": "1", "mm": "0.001", "cm": "0.01", "in": "0.0254", "ft": "0.3048", "kg": "1", "g": "0.001", "t": "1000",
    "lb": "0.45359237", "N": "1", "kN": "1000", "MN": "1000000", "lbf": POUND_FORCE, "kgf": "9.80665", "Nm": "1",
    "kNm": "1000", "rad": "1", "s": "1", "ms": "0.001", "min": "60", "h": "3600", "Pa": "1", "kPa": "1000",
    "MPa": "1000000", "bar": "100000", "J": "1", "kJ": "1000", "W": "1", "kW": "1000", "%": "0.01",
}  # fmt: skip
ANGLES = {"deg": PI / 180, "°": PI / 180, "rev": 2 * PI, "rpm": PI / 30}
NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


def finer(digits: int) -> float:
    """1e-`digits` in long doubles; with more digits, as much below the finest."""
    return EPS ** (digits / 19)


def reals(values: Any) -> Any:
    """An array of numbers of the oracle."""
    return np.frompyfunc(Real, 1, 1)(values) if DIGITS else np.asarray(values).astype(Real)


def finite(values: Any) -> bool:
    """Tests whether all values are finite."""
    return bool(np.isfinite(np.asarray(values).astype(float)).all())


def real(raw: Any) -> Any:
    """A number of a scene, exactly, or a text of a number and its unit, in SI; ValueError of any other text."""
    if not isinstance(raw, str):
        return Real(raw)
    match = NUMBER.fullmatch(raw)
    if match is None:
        raise ValueError(raw)
    return Real(match[1]) * unit(match[2])


def unit(text: str) -> Any:
    """The SI factor of a unit: a space or · multiplies, what stands after / divides, ^2 and ² are powers."""
    above, _, below = text.partition("/")
    product = Real(1)
    for words, sense in ((above, 1), (below, -1)):
        for word in words.replace("·", " ").replace("²", "^2").split():
            name, _, power = word.partition("^")
            if name != "1" and name not in ANGLES and name not in UNITS:
                raise ValueError(text)
            factor = Real(1) if name == "1" else ANGLES.get(name) or Real(UNITS[name])
            product = product * factor ** (sense * int(power or 1))
    return product


class Jet(NamedTuple):
    """Values with their first and second derivatives."""

    value: Any
    first: Any = ZERO
    second: Any = ZERO

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.first, -self.second)

    def __add__(self, other: Any) -> Jet:
        b = jet(other)
        return Jet(self.value + b.value, self.first + b.first, self.second + b.second)

    def __sub__(self, other: Any) -> Jet:
        return self + (-jet(other))

    def __mul__(self, other: Any) -> Jet:
        b = jet(other)
        second = self.second * b.value + 2 * self.first * b.first + self.value * b.second
        return Jet(self.value * b.value, self.first * b.value + self.value * b.first, second)

    def __truediv__(self, other: Any) -> Jet:
        b = jet(other)
        value = self.value / b.value
        first = (self.first - value * b.first) / b.value
        return Jet(value, first, (self.second - 2 * first * b.first - value * b.second) / b.value)

    def __pow__(self, power: Any) -> Jet:
        if isinstance(power, Jet) and (np.any(power.first) or np.any(power.second)):
            return exp(power * log(self))
        n, a = jet(power).value, self.value
        return chain(self, a**n, n * a ** (n - 1), n * (n - 1) * a ** (n - 2) if np.any(n != 1) else 0 * a)

    def __radd__(self, other: Any) -> Jet:
        return self.__add__(other)

    def __rsub__(self, other: Any) -> Jet:
        return jet(other).__sub__(self)

    def __rmul__(self, other: Any) -> Jet:
        return self.__mul__(other)

    def __rtruediv__(self, other: Any) -> Jet:
        return jet(other).__truediv__(self)

    def __rpow__(self, other: Any) -> Jet:
        return jet(other).__pow__(self)


Jet.__array_ufunc__ = None  # type: ignore[attr-defined]  # a number on the left leaves the operation to the jet


def jet(number: Any) -> Jet:
    """A constant as a jet; a jet as it is."""
    return number if isinstance(number, Jet) else Jet(number)


def chain(u: Jet, value: Any, slope: Any, curvature: Any) -> Jet:
    """The jet of f(u), given f, f' and f'' at u."""
    return Jet(value, slope * u.first, curvature * u.first**2 + slope * u.second)


def chosen(which: Any, yes: Jet, no: Jet) -> Jet:
    """One jet where a condition holds, another one elsewhere."""
    return Jet(*(np.where(which, a, b) for a, b in zip(yes, no, strict=True)))


def sin(a: Any) -> Jet:
    """Sine."""
    u = jet(a)
    s, c = plain.sin(u.value), plain.cos(u.value)
    return chain(u, s, c, -s)


def cos(a: Any) -> Jet:
    """Cosine."""
    u = jet(a)
    s, c = plain.sin(u.value), plain.cos(u.value)
    return chain(u, c, -s, -c)


def sqrt(a: Any) -> Jet:
    """Square root."""
    u = jet(a)
    root = plain.sqrt(u.value)
    return chain(u, root, 1 / (2 * root), -1 / (4 * root**3))


def exp(a: Any) -> Jet:
    """Exponential."""
    u = jet(a)
    e = plain.exp(u.value)
    return chain(u, e, e, e)


def atan2(y: Any, x: Any) -> Jet:
    """The angle of the vector (x, y), principal value."""
    b, a = jet(y), jet(x)
    square = a.value**2 + b.value**2
    first = (a.value * b.first - b.value * a.first) / square
    spin = a.value * b.second - b.value * a.second
    stretch = 2 * (a.value * a.first + b.value * b.first)
    return Jet(plain.arctan2(b.value, a.value), first, (spin - first * stretch) / square)


def log(a: Any) -> Jet:
    """Natural logarithm."""
    u = jet(a)
    return chain(u, plain.log(u.value), 1 / u.value, -1 / u.value**2)


def asin(a: Any) -> Jet:
    """Arcsine."""
    u = jet(a)
    root = plain.sqrt(1 - u.value**2)
    return chain(u, plain.arcsin(u.value), 1 / root, u.value / root**3)


SMOOTH: dict[str, Callable[..., Jet]] = {
    "sin": sin, "cos": cos, "tan": lambda a: sin(a) / cos(a), "sqrt": sqrt, "exp": exp, "log": log, "asin": asin,
    "acos": lambda a: PI / 2 - asin(a), "atan": lambda a: atan2(a, Real(1)), "atan2": atan2,
}  # fmt: skip


def bracketed(function: Callable[[Any], Any], a: Any, b: Any, fa: Any, fb: Any) -> Any:
    """Roots between a and b, arrays of which each pair has values of opposite sign: Illinois, bisecting as a guard."""
    a, b, fa, fb = (np.array(x, dtype=KIND) for x in (a, b, fa, fb))
    best = b.copy()
    for turn in range(160):
        span = fb - fa
        c = np.where(span != 0, b - fb * (b - a) / np.where(span != 0, span, 1), (a + b) / 2)
        low, high = np.minimum(a, b), np.maximum(a, b)
        c = np.where((turn % 6 == 5) | ~((c >= low) & (c <= high)), (a + b) / 2, c)
        fc = function(c)
        flips = fc * fb < 0
        a, fa = np.where(flips, b, a), np.where(flips, fb, fa / 2)
        hit = fc == 0
        a, fa = np.where(hit, c, a), np.where(hit, fc, fa)
        moved, b, fb, best = np.abs(c - best), c, fc, c
        close = (np.abs(b - a) <= 2 * EPS * np.abs(b)) | (moved <= EPS * np.abs(b)) & (np.abs(fb) <= np.abs(fa)) | hit
        if close.all():
            break
    return best
