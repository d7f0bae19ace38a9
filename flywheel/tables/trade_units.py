"""Quantities in the units of the trade, metric ones or those of the United States, with their numbers as people write them.

Inertias are in kg m², in the United States as WR² in lb ft², the same quantity: mass times the square of the radius of
gyration. GD², its metric fourfold, is no figure of theirs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from bondgraph.records import NamedTuple
from flywheel.language import number
from flywheel.numerics.units import figure

_FIVE = 5
_FEW = 3  # digits: where an error leaves no more, it is told
_LONGEST = 1e7  # numbers from here on have an exponent
_RPM = 60.0 / (2.0 * math.pi)
_POUND, _INCH, _GRAVITY = 0.45359237, 0.0254, 9.80665
_FOOT = 12 * _INCH
_POUND_FORCE = _POUND * _GRAVITY


class Scale(NamedTuple):
    """A unit: its SI value, its name, and the SI value from which on it is used."""

    size: float
    name: str
    least: float = 0.0


class Shown(NamedTuple):
    """A quantity for people: the number and its unit, each as text in the language in use."""

    value: str
    unit: str

    def __str__(self) -> str:
        return f"{self.value} {self.unit}"


class TradeUnits(NamedTuple):
    """A system of units: of every kind of quantity the units that are used for it, the ones for larger values last."""

    name: str
    digits: int  # of a quantity of a scene, which is mostly typed in metric units
    scales: Mapping[str, tuple[Scale, ...]]

    def shown(self, value: float, kind: str, error: float = 0.0) -> Shown:
        """A result (SI) to five digits, or to those that its error (SI) leaves.

        >>> str(US.shown(344.844812, "inertia")), str(SI.shown(2413.61, "power")), str(SI.shown(1234.5678, "energy", 20.0))
        ('8183.3 lb ft²', '2.4136 kW', '1230 ± 20 J')
        """
        scale = self._scale(value, kind)
        return Shown(five_digits(value / scale.size, error / scale.size), scale.name)

    def read(self, value: float, kind: str, most: int = 6) -> Shown:
        """A quantity (SI) of a scene, without the zeros that nobody typed.

        >>> str(SI.read(0.08, "length")), str(US.read(0.08, "length"))
        ('80 mm', '3.15 in')
        """
        scale = self._scale(value, kind)
        found = value / scale.size
        most = min(most, self.digits)
        return Shown(number(f"{found:.0f}" if 10.0**most <= abs(found) < _LONGEST else figure(found, most=most)), scale.name)

    def unit(self, kind: str) -> str:
        """The unit that stands above a column of figures of one kind: the one for small values."""
        return self.scales[kind][0].name

    def of(self, value: float, kind: str, error: float = 0.0) -> str:
        """The number alone, in the unit that stands above its column."""
        size = self.scales[kind][0].size
        return five_digits(value / size, error / size)

    def _scale(self, value: float, kind: str) -> Scale:
        return [scale for scale in self.scales[kind] if abs(value) >= scale.least][-1]


def five_digits(value: float, error: float = 0.0, most: int = _FIVE) -> str:
    """A figure to five digits, zeros included; to fewer with its error beside it where that leaves fewer than three.

    >>> five_digits(0.15), five_digits(114367.2), five_digits(12.5, 1e-9), five_digits(0.1234, 0.002), five_digits(3e-9)
    ('0.15000', '114370', '12.500', '0.123 ± 0.002', '3.0000e-09')
    >>> five_digits(2e-13, 1e-12), five_digits(0.0)
    ('0', '0')
    """
    if not math.isfinite(value):
        return "?"
    if value == 0.0 or abs(value) <= error:
        return "0"
    digits = most
    if error > 0.0:
        digits = min(most, math.floor(math.log10(abs(value))) + 1 - math.ceil(math.log10(error)))
    if digits > _FEW or digits == most:
        return number(_plain(value, digits))
    place = math.floor(math.log10(error))
    rounded = round(value, -place)
    decimals = max(-place, 0)
    wide = abs(value) >= _LONGEST or abs(error) < 1e-6
    return number(f"{value:.{max(digits, 1)}g} ± {error:.1g}" if wide else f"{rounded:.{decimals}f} ± {error:.{decimals}f}")


def few_digits(value: float, most: int, error: float = 0.0) -> str:
    """A share or a factor to a few digits, without zeros that only pad and, below 1e7, without a power of ten.

    >>> few_digits(3.04, 2), few_digits(108.2, 2), few_digits(1312.0, 3)
    ('3', '110', '1310')
    """
    written = figure(value, error, most)
    return number(f"{float(written):.0f}" if "e+" in written and abs(value) < _LONGEST else written)


def _plain(value: float, digits: int) -> str:
    """A number to so many digits, without an exponent where one can read it without."""
    if 10.0**digits <= abs(value) < _LONGEST:
        return f"{float(f'{value:.{digits}g}'):.0f}"
    return f"{value:#.{digits}g}".rstrip(".")


def _system(name: str, digits: int, **scales: tuple[Scale, ...] | Scale) -> TradeUnits:
    return TradeUnits(name, digits, MappingProxyType({k: (v,) if isinstance(v, Scale) else v for k, v in scales.items()}))


_COMMON = {"speed": Scale(1 / _RPM, "rpm"), "angle": Scale(math.pi / 180, "deg"), "angular_speed": Scale(1.0, "rad/s")}

SI = _system(
    "si",
    6,
    **_COMMON,
    length=(Scale(1e-3, "mm"), Scale(1.0, "m", 1.0)),
    mass=Scale(1.0, "kg"),
    inertia=Scale(1.0, "kg m²"),
    force=(Scale(1.0, "N"), Scale(1e3, "kN", 1e4)),
    torque=(Scale(1.0, "N m"), Scale(1e3, "kN m", 1e4)),
    power=(Scale(1.0, "W"), Scale(1e3, "kW", 1e3)),
    energy=(Scale(1.0, "J"), Scale(1e3, "kJ", 1e5)),
    velocity=Scale(1.0, "m/s"),
    stress=Scale(1e6, "MPa"),
    stiffness=Scale(1.0, "N/m"),
    angular_stiffness=Scale(1.0, "N m/rad"),
    damping=Scale(1.0, "N s/m"),
    angular_damping=Scale(1.0, "N m s/rad"),
)
US = _system(
    "us",
    4,
    **_COMMON,
    length=Scale(_INCH, "in"),
    mass=Scale(_POUND, "lb"),
    inertia=Scale(_POUND * _FOOT**2, "lb ft²"),
    force=Scale(_POUND_FORCE, "lbf"),
    torque=Scale(_POUND_FORCE * _FOOT, "lbf ft"),
    power=Scale(550 * _POUND_FORCE * _FOOT, "hp"),
    energy=Scale(_POUND_FORCE * _FOOT, "ft lbf"),
    velocity=Scale(_FOOT, "ft/s"),
    stress=Scale(_POUND_FORCE / _INCH**2, "psi"),
    stiffness=Scale(_POUND_FORCE / _INCH, "lbf/in"),
    angular_stiffness=Scale(_POUND_FORCE * _FOOT, "lbf ft/rad"),
    damping=Scale(_POUND_FORCE / _INCH, "lbf s/in"),
    angular_damping=Scale(_POUND_FORCE * _FOOT, "lbf ft s/rad"),
)
SYSTEMS: Mapping[str, TradeUnits] = MappingProxyType({system.name: system for system in (SI, US)})
"""The systems of units by the names under which users ask for them."""
