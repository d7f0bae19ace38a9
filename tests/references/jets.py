"""Numbers that carry their first and second derivative along the crank angle, at the working precision of mpmath."""

from __future__ import annotations

from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]


class Jet(NamedTuple):
    """A value with its first and second derivative."""

    value: Any
    first: Any = mp.mpf(0)
    second: Any = mp.mpf(0)

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.first, -self.second)

    def __pos__(self) -> Jet:
        return self

    def __add__(self, other: Any) -> Jet:
        b = jet(other)
        return Jet(self.value + b.value, self.first + b.first, self.second + b.second)

    def __sub__(self, other: Any) -> Jet:
        return self + (-jet(other))

    def __mul__(self, other: Any) -> Jet:
        b = jet(other)
        cross = 2 * self.first * b.first
        second = self.second * b.value + cross + self.value * b.second
        return Jet(self.value * b.value, self.first * b.value + self.value * b.first, second)

    def __truediv__(self, other: Any) -> Jet:
        b = jet(other)
        value = self.value / b.value
        first = (self.first - value * b.first) / b.value
        return Jet(value, first, (self.second - 2 * first * b.first - value * b.second) / b.value)

    def __pow__(self, power: Any) -> Jet:
        n = jet(power)
        if n.first or n.second:
            return exp(n * log(self))
        a, p = self.value, n.value
        return chain(
            self, a**p, p * a ** (p - 1) if p else mp.zero, p * (p - 1) * a ** (p - 2) if p not in (0, 1) else mp.zero
        )

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


def jet(number: Any) -> Jet:
    """A constant as a jet; a jet as it is."""
    return number if isinstance(number, Jet) else Jet(mp.mpf(number), mp.zero, mp.zero)


def chain(u: Jet, value: Any, slope: Any, curvature: Any) -> Jet:
    """The jet of f(u), given f, f' and f'' at u."""
    return Jet(value, slope * u.first, curvature * u.first**2 + slope * u.second)


def sin(a: Any) -> Jet:
    u = jet(a)
    s, c = mp.sin(u.value), mp.cos(u.value)
    return chain(u, s, c, -s)


def cos(a: Any) -> Jet:
    u = jet(a)
    s, c = mp.sin(u.value), mp.cos(u.value)
    return chain(u, c, -s, -c)


def tan(a: Any) -> Jet:
    return sin(a).__truediv__(cos(a))


def sqrt(a: Any) -> Jet:
    u = jet(a)
    root = mp.sqrt(u.value)
    return chain(u, root, 1 / (2 * root), -1 / (4 * root**3))


def exp(a: Any) -> Jet:
    u = jet(a)
    e = mp.exp(u.value)
    return chain(u, e, e, e)


def log(a: Any) -> Jet:
    u = jet(a)
    return chain(u, mp.log(u.value), 1 / u.value, -1 / u.value**2)


def asin(a: Any) -> Jet:
    u = jet(a)
    root = mp.sqrt(1 - u.value**2)
    return chain(u, mp.asin(u.value), 1 / root, u.value / root**3)


def acos(a: Any) -> Jet:
    return Jet(mp.pi / 2) - asin(a)


def atan(a: Any) -> Jet:
    return atan2(a, 1)


def atan2(y: Any, x: Any) -> Jet:
    """The angle of the vector (x, y), principal value."""
    b, a = jet(y), jet(x)
    square = a.value**2 + b.value**2
    first = (a.value * b.first - b.value * a.first) / square
    spin = a.value * b.second - b.value * a.second
    stretch = 2 * (a.value * a.first + b.value * b.first)
    return Jet(mp.atan2(b.value, a.value), first, (spin - first * stretch) / square)
