"""Numbers with a mantissa of 64 bits, and jets of them: a value with its first and second derivative along the crank angle.

Arrays hold many angles at once, (panels, nodes).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

Real = np.longdouble
EPS = float(np.finfo(Real).eps)
PI = Real("3.14159265358979323846264338327950288")
ZERO = Real(0)


def real(raw: Any) -> Any:
    """A number of a scene as it is written, or a text `X deg`, X being taken to the last digit."""
    if isinstance(raw, str):
        number, _, unit = raw.partition(" ")
        return Real(number) * (PI / 180 if unit == "deg" else 1)
    return Real(repr(raw)) if isinstance(raw, float) else Real(raw)


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
    s, c = np.sin(u.value), np.cos(u.value)
    return chain(u, s, c, -s)


def cos(a: Any) -> Jet:
    """Cosine."""
    u = jet(a)
    s, c = np.sin(u.value), np.cos(u.value)
    return chain(u, c, -s, -c)


def sqrt(a: Any) -> Jet:
    """Square root."""
    u = jet(a)
    root = np.sqrt(u.value)
    return chain(u, root, 1 / (2 * root), -1 / (4 * root**3))


def exp(a: Any) -> Jet:
    """Exponential."""
    u = jet(a)
    e = np.exp(u.value)
    return chain(u, e, e, e)


def atan2(y: Any, x: Any) -> Jet:
    """The angle of the vector (x, y), principal value."""
    b, a = jet(y), jet(x)
    square = a.value**2 + b.value**2
    first = (a.value * b.first - b.value * a.first) / square
    spin = a.value * b.second - b.value * a.second
    stretch = 2 * (a.value * a.first + b.value * b.first)
    return Jet(np.arctan2(b.value, a.value), first, (spin - first * stretch) / square)


SMOOTH: dict[str, Callable[..., Jet]] = {"sin": sin, "cos": cos, "sqrt": sqrt, "exp": exp}


def bracketed(function: Callable[[Any], Any], a: Any, b: Any, fa: Any, fb: Any) -> Any:
    """Roots between a and b, arrays of which each pair has values of opposite sign: Illinois, bisecting as a guard."""
    a, b, fa, fb = (np.array(x, dtype=Real) for x in (a, b, fa, fb))
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
