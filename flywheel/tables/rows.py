"""Layout of results: quantities in customary units, rows and sentences, columns as CSV, data as JSON.

Units are metric ones or those of the United States, with their numbers as people write them. Inertias are in kg m², in the
United States as WR² in lb ft², the same quantity: mass times the square of the radius of gyration. GD², four times as much,
is used only with metric units.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from textwrap import wrap
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.language import number, use
from flywheel.language import text as _
from flywheel.numerics.cells import Array
from flywheel.numerics.units import MOST, certain_digits, columns, figure
from flywheel.sizing.findings import FULL, rows_of
from flywheel.sizing.results import Sizing

_FIVE = 5
_FEW = 3  # digits: where an error leaves no more, it is printed
_LONGEST = 1e7  # numbers from here on have an exponent
_RPM = 60.0 / (2.0 * math.pi)
_POUND, _INCH, _GRAVITY = 0.45359237, 0.0254, 9.80665
_FOOT = 12 * _INCH
_POUND_FORCE = _POUND * _GRAVITY


class Scale(NamedTuple):
    """A unit: its SI value, its name, and the SI value from which it is used."""

    size: float
    name: str
    least: float = 0.0


class Written(NamedTuple):
    """A quantity as text: the number and its unit, each in the language in use."""

    value: str
    unit: str

    def __str__(self) -> str:
        return f"{self.value} {self.unit}"


class TradeUnits(NamedTuple):
    """A system of units: for every kind of quantity its units, those for larger values last."""

    name: str
    digits: int  # of a quantity of a scene, which is mostly typed in metric units
    scales: Mapping[str, tuple[Scale, ...]]

    def written(self, value: float, kind: str, error: float = 0.0) -> Written:
        """A result (SI) to five digits, or to those that its error (SI) leaves.

        >>> str(US.written(344.844812, "inertia")), str(SI.written(1234.5678, "energy", 20.0))
        ('8183.3 lb ft²', '1230 ± 20 J')
        """
        scale = self._scale(value, kind)
        return Written(five_digits(value / scale.size, error / scale.size), scale.name)

    def read(self, value: float, kind: str, most: int = 6) -> Written:
        """A quantity (SI) of a scene, without padding zeros.

        >>> str(SI.read(0.08, "length")), str(US.read(0.08, "length"))
        ('80 mm', '3.15 in')
        """
        scale = self._scale(value, kind)
        converted = value / scale.size
        most = min(most, self.digits)
        return Written(
            number(f"{converted:.0f}" if 10.0**most <= abs(converted) < _LONGEST else figure(converted, most=most)),
            scale.name,
        )

    def unit(self, kind: str) -> str:
        """The unit at the head of a column of figures of one kind: the one for small values."""
        return self.scales[kind][0].name

    def of(self, value: float, kind: str, error: float = 0.0) -> str:
        """The number alone, in the unit of its column's head."""
        size = self.scales[kind][0].size
        return five_digits(value / size, error / size)

    def _scale(self, value: float, kind: str) -> Scale:
        return [scale for scale in self.scales[kind] if abs(value) >= scale.least][-1]


def five_digits(value: float, error: float = 0.0, most: int = _FIVE) -> str:
    """A figure to five digits, zeros included; if its error leaves fewer than three, to fewer digits with the error.

    >>> five_digits(0.15), five_digits(114367.2), five_digits(12.5, 1e-9), five_digits(0.1234, 0.002), five_digits(3e-9)
    ('0.15000', '114370', '12.500', '0.123 ± 0.002', '3.0000e-09')
    >>> five_digits(2e-13, 1e-12), five_digits(0.0), five_digits(0.75, math.inf)
    ('0', '0', '?')
    """
    if not math.isfinite(value) or error == math.inf:
        return "?"
    if value == 0.0 or abs(value) <= error:
        return "0"
    digits = certain_digits(value, error, most)
    if digits > _FEW or digits == most:
        return number(_digits(value, digits))
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


def _digits(value: float, digits: int) -> str:
    """A number to a number of digits, without an exponent if it is readable without one."""
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
    acceleration=Scale(1.0, "m/s²"),
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
    acceleration=Scale(_FOOT, "ft/s²"),
    stress=Scale(_POUND_FORCE / _INCH**2, "psi"),
    stiffness=Scale(_POUND_FORCE / _INCH, "lbf/in"),
    angular_stiffness=Scale(_POUND_FORCE * _FOOT, "lbf ft/rad"),
    damping=Scale(_POUND_FORCE / _INCH, "lbf s/in"),
    angular_damping=Scale(_POUND_FORCE * _FOOT, "lbf ft s/rad"),
)
SYSTEMS: Mapping[str, TradeUnits] = MappingProxyType({system.name: system for system in (SI, US)})
"""The systems of units by the names under which users ask for them."""


# -- rows and paragraphs ---------------------------------------------------------------------------------------------


WIDTH = 100
PICTURE_TITLE = 90  # letters
RPM = 9.549296585513721  # rad/s -> rev/min
NOTHING = 1e-12  # an irregularity that rounding makes
DEGREES = 57.29577951308232


class Row(NamedTuple):
    """A line of a block: its label, the figure (several if they belong together), its unit, and a note."""

    label: str
    value: str
    unit: str = ""
    note: str = ""


def block(title: str, rows: Iterable[Row]) -> list[str]:
    """Rows under a title; empty if there are none."""
    lines = columns(rows)
    return [title, *lines] if lines else []


def figures(sizing: Sizing) -> Iterator[Row]:
    """The figures of a sizing that the full listing shows as rows like any other, in English."""
    with use("en"):
        for one, value in rows_of(FULL, sizing):
            yield Row(one.name, figure(value, one.error(sizing)), one.beside or one.unit)


def paragraphs(blocks: Iterable[Iterable[str]]) -> str:
    """Blocks of lines as a text, an empty line between two of them; those without a line are left out."""
    return "\n\n".join("\n".join(lines) for lines in map(list, blocks) if lines) + "\n"


def under_title(title: str | None, what: str, width: int = PICTURE_TITLE) -> str:
    """A headline of what was solved, below the scene's title where it has one, cut to a width."""
    line = " ".join(printable(title or "").split())
    line = line if len(line) <= width else line[: width - 1] + "…"
    return f"{line}\n{what}" if line else what


def printable(text: str) -> str:
    """The text with a space for every character that would move the cursor."""
    return "".join(c if c.isprintable() else " " for c in text)


def wrapped(sentence: str, indent: str = "  ", first: str | None = None) -> list[str]:
    """A sentence as lines of a text; `first` is the beginning of its first line, the indent if None."""
    head = indent if first is None else first
    return wrap(printable(sentence), WIDTH, initial_indent=head, subsequent_indent=indent)


def sentences(texts: Iterable[str], indent: str = "  ") -> list[str]:
    """Sentences as lines of a text, each from a new line on."""
    return [line for sentence in texts for line in wrapped(sentence, indent)]


def rpm(speed: float) -> str:
    """A speed (rad/s) in turns a minute.

    >>> rpm(6.283185307179586)
    '60 rpm'
    """
    return f"{figure(speed * RPM)} rpm"


def percent_and_steadiness(eps: float, error: float, most: int) -> tuple[str, str]:
    """An irregularity as a deviation to either side in percent, and as its reciprocal."""
    if eps <= max(error, NOTHING):
        return ("±0", "without limit") if max(eps, error) <= NOTHING else ("?", "?")
    return f"±{figure(50 * eps, 50 * error, most)}", figure(1 / eps, error / eps**2, most)


def irregularity(eps: float, error: float) -> str:
    """An irregularity as a figure: 0 if it is only rounding."""
    return figure(eps, max(error, NOTHING if eps <= NOTHING else 0.0))


def irregularity_in_words(eps: float, error: float = 0.0) -> str:
    """An irregularity in words: the number, its deviation in percent, and its reciprocal.

    >>> irregularity_in_words(0.04)
    '0.04 (±2 %, steadiness 25)'
    """
    deviation, steadiness = percent_and_steadiness(eps, error, 6)
    return f"{irregularity(eps, error)} ({deviation} %, steadiness {steadiness})"


MOST_PARTS = 8
"""Parts of a sum that a picture shows by name, with the sum of the others."""


def largest_parts(parts: Mapping[str, Array], others: str, most: int = MOST_PARTS) -> dict[str, Array]:
    """Parts of a sum by name, in their order: all, or the largest ones and, under the name `others`, the sum of the rest.

    >>> largest_parts({"rod": np.array([1.0]), "slider": np.array([-3.0]), "crank": np.array([0.5])}, "others", 2)
    {'slider': array([-3.]), 'others': array([1.5])}
    """
    if len(parts) <= most:
        return dict(parts)
    largest = sorted(parts, key=lambda name: -float(np.abs(parts[name]).max()))[: most - 1]
    rest = [part for name, part in parts.items() if name not in largest]
    return {name: part for name, part in parts.items() if name in largest} | {others: np.sum(rest, axis=0)}


def or_unknown(value: float, error: float, most: int = MOST) -> str:
    """A figure, or a question mark if it has no certain digit."""
    return "?" if 0.0 < value <= error else figure(value, error, most)


def plain(value: float, decimals: int) -> str:
    """A positive number to three digits without an exponent, to two if it needs more decimals.

    >>> plain(0.08581, 3), plain(7104.2, 3), plain(0.63, 2)
    ('0.086', '7100', '0.63')
    """
    from decimal import Decimal

    three = Decimal(f"{value:.3g}")
    exponent = three.as_tuple().exponent
    fine = isinstance(exponent, int) and exponent < -decimals
    return f"{Decimal(f'{value:.2g}') if fine else three:f}"


def csv(columns: Iterable[tuple[str, NDArray[np.float64]]]) -> str:
    """Columns under the names that head them, floats at full precision; empty if a value is not known (NaN)."""
    names, arrays = zip(*columns, strict=True)
    rows = zip(*((array + 0.0).tolist() for array in arrays), strict=True)  # + 0.0: no "-0.0"
    lines = [",".join(names), *(",".join("" if math.isnan(v) else repr(v) for v in row) for row in rows)]
    return "\n".join(lines) + "\n"


def encoded(data: Mapping[str, Any], indent: int | None = None) -> str:
    """JSON in plain ASCII with floats at full precision; a number that is not finite becomes null.

    >>> encoded({"a": np.float64(0.1), "b": float("inf"), "c": np.array([1.0, 2.0])})
    '{"a": 0.1, "b": null, "c": [1.0, 2.0]}'
    """
    import json  # texts and CSV do without

    return json.dumps(_plain(data), indent=indent, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def short_names(paths: Iterable[str]) -> dict[str, str]:
    """Paths by their last parts, as many as distinguish them.

    >>> short_names(["mechanism.crank.length", "mechanism.rod.length"])
    {'mechanism.crank.length': 'crank.length', 'mechanism.rod.length': 'rod.length'}
    """
    names = {}
    every = list(paths)
    for path in every:
        parts = path.split(".")
        for count in range(min(2, len(parts)), len(parts) + 1):
            name = ".".join(parts[-count:])
            same = [other for other in every if other == name or other.endswith(f".{name}")]
            if len(same) == 1 and not name[0].isdigit():
                break
        names[path] = name
    return names


def place(name: str, *, article: bool = False) -> str:
    """Returns the name of a shaft or port in a text: the crank's in the language in use, any other as the scene has it."""
    if name != "crank":
        return name
    return _("the crank") if article else _("crank")
