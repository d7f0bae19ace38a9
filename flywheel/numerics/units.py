"""Quantities: one number and a unit, read into an SI float of the dimension that its key expects.

A unit is kept as a ratio of integers (with 60 digits of pi where angles come in), and a number as the decimal that
was written, so that one division of integers gives the float nearest to the true value: "720 deg" is 4 pi to the last
bit, and "0.1 deg" is the same float in a table and in a window.

In a unit a space, `·` or `*` multiplies, everything after `/` divides, `^2`, `²` and `^-1` are powers. `rad` may be left out
where the dimension is clear (`N m s` for `N m s/rad`), but an angle and a speed must name theirs: `1/s` and `Hz` could be
turns or radians and are refused, except for a frequency. `1/min` alone is the rev/min of name plates. A torque is written `N
m`, `lbf ft`...; `J` and its kin are refused for it, although their dimension is the same. An energy may be either.

Numbers for reading: no digit beyond the estimated error, decimal points aligned. Other notations of
expressions (spreadsheets, calculators, C, textbooks), and how they are written here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from flywheel.numerics.faults import quote, show, suggestion
from flywheel.numerics.jets import is_recorded

__all__ = [
    "CONDITION", "DIMENSIONS", "LARGEST", "MOST", "PRODUCT", "UNITS", "Dimension", "QuantityError", "Unit", "aligned",
    "columns", "convert", "exact_ratio", "figure", "half_width", "middle_of", "parse_quantity",
    "parse_range", "parse_unit", "plain_number", "product", "quantity_text", "round_speed", "short", "split_quantity",
    "split_range", "written_here",
]  # fmt: skip

_PI = (3141592653589793238462643383279502884197169399375105820974944592307816, 10**69)
_TEXT_LENGTH = 100
_LARGEST_POWER = 9
_MOST_DIGITS = 1000
LARGEST = 1e50  # a quantity beyond it would leave the floating-point range with its first few products
_NUMBER = re.compile(r"\s*([+-]?)([0-9]*)(?:\.([0-9]*))?(?:[eE]([+-]?[0-9]{1,9}))?(?![0-9.])")
_FACTOR = re.compile(r"([^\W\d_]+|%|°)(?:\^([+-]?[0-9]+))?")
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")
_LOOKALIKES = str.maketrans({"−": "-", "º": "°", "\u2126": "Ω", "μ": "µ", "⋅": "·", "•": "·", "\u00a0": " ", "\u202f": " "})


class QuantityError(ValueError):
    """Error of a quantity, in the three parts of a fault."""

    def __init__(self, defect: str, expected: str, advice: str = "") -> None:
        self.defect, self.expected, self.advice = defect, expected, advice
        super().__init__(f"found {defect}, expected {expected}" + (f"; {advice}" if advice else ""))


class Unit(NamedTuple):
    """A unit: SI value as a ratio of integers, and the powers of length, mass, time, angle, current and temperature."""

    numerator: int = 1
    denominator: int = 1
    length: int = 0
    mass: int = 0
    time: int = 0
    angle: int = 0
    current: int = 0
    temperature: int = 0

    @property
    def powers(self) -> tuple[int, int, int, int, int]:
        """Powers of metre, kilogram, second, ampere and kelvin."""
        return self.length, self.mass, self.time, self.current, self.temperature

    def __mul__(self, other: object) -> Unit:
        """The product of two units: factors multiply, powers add."""
        if not isinstance(other, Unit):
            return NotImplemented
        powers = (a + b for a, b in zip(self[2:], other[2:], strict=True))
        return Unit(self.numerator * other.numerator, self.denominator * other.denominator, *powers)

    def __pow__(self, exponent: int) -> Unit:
        """The unit to a whole power."""
        top, bottom = self[:2] if exponent >= 0 else (self.denominator, self.numerator)
        size = abs(exponent)
        return Unit(top**size, bottom**size, *(exponent * power for power in self[2:]))


class Dimension(NamedTuple):
    """Dimension of a key: powers of metre, kilogram, second; allowed ones of angle; SI unit; example; of ampere, kelvin."""

    name: str
    mechanical: tuple[int, int, int]
    angles: tuple[int, ...]
    si: str
    example: str
    current: int = 0
    temperature: int = 0

    @property
    def powers(self) -> tuple[int, int, int, int, int]:
        """Powers of metre, kilogram, second, ampere and kelvin."""
        return *self.mechanical, self.current, self.temperature

    def fits(self, unit: Unit) -> bool:
        """Tests whether a unit is one of this dimension."""
        return unit.powers == self.powers and unit.angle in self.angles

    @property
    def expected(self) -> str:
        """The expectation that a fault states."""
        article = "an" if self.name[0] in "aeiou" else "a"
        bare = f" or a bare number in {self.si}" if self.si else ""
        return f'{article} {self.name} such as "{self.example}"{bare}'


DIMENSIONS = {
    dimension.name: dimension
    for dimension in (
        Dimension("number", (0, 0, 0), (0,), "", "0.04"),
        Dimension("length", (1, 0, 0), (0,), "m", "250 mm"),
        Dimension("angle", (0, 0, 0), (1,), "rad", "90 deg"),
        Dimension("mass", (0, 1, 0), (0,), "kg", "12 kg"),
        Dimension("time", (0, 0, 1), (0,), "s", "2 s"),
        Dimension("inertia", (2, 1, 0), (0,), "kg m^2", "0.3 kg m^2"),
        Dimension("moment of weight", (3, 1, -2), (0,), "N m^2", "48 kgf m^2"),
        Dimension("force", (1, 1, -2), (0,), "N", "1.5 kN"),
        Dimension("torque", (2, 1, -2), (0,), "N m", "40 N m"),
        Dimension("speed", (0, 0, -1), (1,), "rad/s", "210 rpm"),
        Dimension("velocity", (1, 0, -1), (0,), "m/s", "2 m/s"),
        Dimension("acceleration", (1, 0, -2), (0,), "m/s^2", "9.81 m/s^2"),
        Dimension("angular acceleration", (0, 0, -2), (1,), "rad/s^2", "3 rad/s^2"),
        Dimension("energy", (2, 1, -2), (0,), "J", "4 kJ"),
        Dimension("power", (2, 1, -3), (0,), "W", "1.5 kW"),
        Dimension("pressure", (-1, 1, -2), (0,), "Pa", "6 bar"),
        Dimension("density", (-3, 1, 0), (0,), "kg/m^3", "7200 kg/m^3"),
        Dimension("area", (2, 0, 0), (0,), "m^2", "50 mm^2"),
        Dimension("volume", (3, 0, 0), (0,), "m^3", "160 cm^3"),
        Dimension("volume flow", (3, 0, -1), (0,), "m^3/s", "60 l/min"),
        Dimension("stiffness", (0, 1, -2), (0,), "N/m", "2 kN/m"),
        Dimension("angular stiffness", (2, 1, -2), (0, -1), "N m/rad", "30 N m/rad"),
        Dimension("damping", (0, 1, -1), (0,), "N s/m", "5 N s/m"),
        Dimension("angular damping", (2, 1, -1), (0, -1), "N m s/rad", "0.2 N m s/rad"),
        Dimension("frequency", (0, 0, -1), (0,), "Hz", "50 Hz"),
        Dimension("rate", (0, 0, -1), (0,), "1/s", "30 1/min"),
        Dimension("voltage", (2, 1, -3), (0,), "V", "400 V", -1),
        Dimension("current", (0, 0, 0), (0,), "A", "12 A", 1),
        Dimension("resistance", (2, 1, -3), (0,), "ohm", "0.4 ohm", -2),
        Dimension("inductance", (2, 1, -2), (0,), "H", "2 mH", -2),
        Dimension("motor constant", (2, 1, -2), (0, -1), "V s/rad", "0.25 V s/rad", -1),
        Dimension("drag", (-1, 1, 0), (0,), "N s^2/m^2", "8 N s^2/m^2"),
        Dimension("angular drag", (2, 1, 0), (0, -2), "N m s^2/rad^2", "0.1 N m s^2/rad^2"),
        Dimension("energy per area", (0, 1, -2), (0,), "J/m^2", "6 J/mm^2"),
        Dimension("temperature difference", (0, 0, 0), (0,), "K", "80 K", 0, 1),
    )
}


_PREFIXES = {
    prefix: Unit(10 ** max(power, 0), 10 ** max(-power, 0))
    for prefix, power in {"": 0, "n": -9, "µ": -6, "u": -6, "m": -3, "c": -2, "d": -1, "da": 1, "h": 2}.items()
} | {"k": Unit(10**3), "M": Unit(10**6), "G": Unit(10**9)}


def _named_units() -> dict[str, Unit]:
    """Every unit that has a unique name, multiples included."""
    newton, metre, second = Unit(1, 1, 1, 1, -2), Unit(1, 1, 1), Unit(time=1)
    joule, radian, pound = newton * metre, Unit(angle=1), Unit(45359237, 10**8, mass=1)
    weight = Unit(980665, 10**5, 1, 0, -2)
    inch = Unit(254, 10**4, 1)
    turn, minute = Unit(2 * _PI[0], _PI[1], angle=1), Unit(60, time=1)
    multiples = {"m": metre, "g": Unit(1, 1000, mass=1), "s": second, "N": newton, "Nm": joule, "J": joule}
    multiples |= {"W": joule * second**-1, "Pa": newton * metre**-2, "bar": Unit(10**5, 1, -1, 1, -2)}
    multiples |= {"rad": radian, "cal": Unit(4184, 1000) * joule, "Wh": Unit(3600) * joule}
    ampere, watt = Unit(current=1), joule * second**-1
    multiples |= {"A": ampere, "V": watt * ampere**-1, "H": joule * ampere**-2}
    multiples |= dict.fromkeys(("ohm", "Ω"), watt * ampere**-2)
    units = {prefix + name: scale * unit for name, unit in multiples.items() for prefix, scale in _PREFIXES.items()}
    units |= {"Nmm": Unit(1, 1000) * joule, "Ncm": Unit(1, 100) * joule}
    units |= {"%": Unit(1, 100), "t": Unit(1000, mass=1), "min": minute, "h": Unit(3600, time=1)}
    units |= dict.fromkeys(("l", "L"), Unit(1, 1000) * metre**3) | {"ml": Unit(1, 10**6) * metre**3}
    units |= {"in": inch, "ft": Unit(12) * inch, "lb": pound, "lbm": pound, "lbf": pound * weight}
    units |= {"kgf": Unit(mass=1) * weight, "slug": pound * weight * second**2 * (Unit(12) * inch) ** -1}
    units |= {"psi": pound * weight * inch**-2, "hp": Unit(6600) * inch * pound * weight * second**-1}
    units |= {name: Unit(75) * metre * Unit(mass=1) * weight * second**-1 for name in ("CV", "PS")}
    del units["Grad"]  # a degree in German, and no thousand million radians
    units |= {
        "K": Unit(temperature=1),
        "rev": turn,
        "rpm": turn * minute**-1,
        "deg": Unit(1, 360) * turn,
        "°": Unit(1, 360) * turn,
    }
    return units


UNITS = _named_units()
_ABROAD = {
    name: unit
    for unit, names in {
        "rev": "U Umdr Umdrehung vuelta turn tr tour r giri revolution",
        "rpm": "upm vpm",
        "rev/s": "rps",
        "deg": "grado degree Grad",
        "rad": "radian radiane",
        "m": "metre meter metro mètre mt",
        "mm": "millimetre millimeter milímetro milimetro",
        "in": "pulg pulgada inch Zoll pouce",
        "ft": "foot feet pie",
        "s": "sec seg second segundo Sekunde seconde",
        "min": "minute minuto",
        "h": "hr hour hora Stunde heure",
        "kg": "kilo kilogram kilogramme kilogramo",
        "g": "gr gram gramo Gramm",
        "t": "tonne tonelada",
        "kgf": "kp kilopond",
        "N": "newton",
        "W": "watt vatio",
        "J": "joule julio",
        "%": "percent pct Prozent",
    }.items()
    for name in names.casefold().split()
}
"""Units by their names in full, or in other tongues; plurals end in s, es, n or en."""
_FREQUENCIES = {prefix + "Hz": Unit(10**power, time=-1) for prefix, power in {"": 0, "k": 3}.items()}
_ENERGIES = frozenset(prefix + name for name in ("J", "cal", "Wh") for prefix in _PREFIXES)


def parse_quantity(value: object, dimension: str | None) -> float:
    """The SI value of a quantity: a number with a unit in a text, or a bare number, which is SI already.

    dimension: a key of `DIMENSIONS`, or None if any will do (a parameter).
    Raises QuantityError for anything else; a truth value is no number, and a decimal comma is no decimal point.

    >>> import math
    >>> parse_quantity("60 rpm", "speed") == 2 * math.pi, parse_quantity("720 deg", "angle") == 4 * math.pi
    (True, True)
    >>> parse_quantity("12 lb ft^2", "inertia")
    0.5056813211256576
    >>> parse_quantity("1,5 m", "length")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    flywheel.numerics.units.QuantityError: found "1,5 m", expected a length such as ... write 1.5, not 1,5
    """
    number = plain_number(value)
    if isinstance(value, str):
        # the number, then its unit, then whether the unit fits; a number alone only if none is needed
        parts = split_quantity(value) if len(value) <= _TEXT_LENGTH else None
        if parts is None:
            raise QuantityError(quote(value), _expected(dimension))
        written, rest = parts
        if comma := re.match(r",\s*([0-9]+)", rest):
            whole = written.replace(".", "")
            advice = f"write {whole}.{comma[1]}, not {whole},{comma[1]}"
            if len(comma[1]) == 3 and re.fullmatch(r"[+-]?[1-9][0-9]{0,2}", written):
                advice = f"write {whole}{comma[1]}, or {whole}.{comma[1].rstrip('0') or '0'} if the comma is a decimal one"
            raise QuantityError(quote(value), _expected(dimension), advice)
        if not rest and dimension not in (None, "number"):
            si = DIMENSIONS[dimension].si
            missing = f'write "{written} deg"' if dimension == "angle" else f"add a unit, or write {written} bare for {si}"
            raise QuantityError(quote(value), _expected(dimension), missing)
        try:
            unit = _unit(rest, dimension) if rest else Unit()
        except QuantityError as error:
            raise QuantityError(quote(value), _expected(dimension), error.advice) from None
        number = convert(written, unit)
    if number is None:
        raise QuantityError(show(value), _expected(dimension))
    if not abs(number) < math.inf:
        raise QuantityError(show(value), f"{_expected(dimension)}, finite")
    if abs(number) > LARGEST:
        raise QuantityError(show(value), f"at most {LARGEST:g} in SI")
    return number


_BASES = {
    name: unit
    for unit, names in {
        "m": "meter metre m",
        "kg": "kilogram kg",
        "g": "gram g",
        "s": "second s",
        "rad": "radian rad",
        "A": "ampere A",
        "ft": "foot ft",
        "in": "inch in",
        "lb": "pound lb",
        "": "dimensionless",
    }.items()
    for name in names.split()
}
"""Base units as libraries of quantities spell them."""


def quantity_text(value: Any) -> Any:
    """A quantity of another library as a text that a scene may hold; a list where it is an array; a number without a unit.

    >>> class Length:  # as pint has them
    ...     magnitude, units = 0.25, "meter"
    ...     def to_base_units(self):
    ...         return self
    >>> quantity_text(Length())
    '0.25 m'
    """
    base = value.to_base_units()
    above, *below = re.split(r"\s*/\s*", str(base.units))

    def spelt(factor: str) -> str:
        name, _, power = (part.strip() for part in factor.replace("^", "**").partition("**"))
        return _BASES.get(name, name) + (f"^{power.strip('()')}" if power else "")

    unit = " ".join(filter(None, (spelt(factor) for factor in re.split(r"\s*(?<!\*)\*(?!\*)\s*", above) if factor != "1")))
    unit = "/".join([unit or ("1" if below else ""), *(spelt(factor) for factor in below)])
    numbers = np.asarray(base.magnitude, dtype=float)
    texts = [f"{float(number)!r} {unit}" if unit else float(number) for number in numbers.ravel()]
    return texts[0] if numbers.ndim == 0 else texts


def plain_number(value: object) -> float | None:
    """The float of a Python or NumPy number, a recorded one as it is; None for anything else, truth values included.

    >>> plain_number(3), plain_number(np.float32(0.5)), plain_number(True), plain_number("3")
    (3.0, 0.5, None, None)
    """
    if isinstance(value, (bool, np.bool_)):
        return None
    if not isinstance(value, (int, float, np.integer, np.floating)):
        return value if is_recorded(value) else None
    try:
        return float(value)
    except OverflowError:
        return math.inf


def parse_unit(text: str, dimension: str | None) -> Unit:
    """The unit that a text names, of the expected dimension.

    >>> parse_unit("kN", "force").numerator
    1000
    """
    expected = "a unit"
    if dimension is not None and DIMENSIONS[dimension].si:
        expected = f"a unit of {dimension} such as {DIMENSIONS[dimension].si}"
    try:
        return _unit(text.translate(_LOOKALIKES), dimension)
    except QuantityError as error:
        raise QuantityError(quote(text), expected, error.advice) from None


def convert(number: float | str, unit: Unit) -> float:
    """The SI value nearest to a number (its shortest decimal) of a unit, rounded once.

    >>> convert(180.0, parse_unit("deg", "angle")) == np.pi
    True
    """
    text = number if isinstance(number, str) else repr(float(number))
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise QuantityError(quote(text), "a number")
    top, bottom = _ratio(match, unit)
    try:
        size: float = top / bottom
    except OverflowError:
        size = math.inf
    if math.isinf(size) or (size == 0.0 and top):
        raise QuantityError(quote(match.group()), "a number within the floating-point range")
    return -0.0 if size == 0.0 and match[1] == "-" else size


def split_quantity(text: str) -> tuple[str, str] | None:
    """Number and unit of a text that begins with a number, as texts; None if it begins otherwise.

    >>> split_quantity("1.5 kN"), split_quantity("-3"), split_quantity("sin(phi)")
    (('1.5', 'kN'), ('-3', ''), None)
    """
    plain = text.translate(_LOOKALIKES)
    match = _NUMBER.match(plain)
    if match is None or not (match[2] or match[3]):
        return None
    return match.group().strip(), plain[match.end() :].strip()


def exact_ratio(value: object, dimension: str | None) -> tuple[int, int]:
    """The SI value of a quantity as it is written, a ratio of two integers; 60 digits of pi where angles come in.

    >>> exact_ratio("80 mm", "length"), exact_ratio(0.1, "length")
    ((80, 1000), (1, 10))
    """
    parse_quantity(value, dimension)  # it raises where the quantity is none
    number, rest = (split_quantity(value) or ("", "")) if isinstance(value, str) else (repr(plain_number(value)), "")
    match = _NUMBER.fullmatch(number)
    assert match is not None  # it was read
    return _ratio(match, _unit(rest, dimension) if rest else Unit())


_RANGE = re.compile(r"(?P<open>\()?(?P<middle>.+?)\s*(?:±|\+/-)\s*(?P<half>[^()]+?)(?(open)\)\s*(?P<unit>.*))")


def split_range(value: object) -> tuple[str, str] | None:
    """The middle of a range and half its width, as texts of quantities; None for anything else.

    A unit of only one of them applies to both; a half width in % is a share of a middle in another unit.

    >>> split_range("80 mm ± 0.1 mm"), split_range("(80 ± 0.1) mm"), split_range("80 ± 0.1 mm")
    (('80 mm', '0.1 mm'), ('80 mm', '0.1 mm'), ('80 mm', '0.1 mm'))
    >>> split_range("2 kN ± 5 %"), split_range("-2 kN")
    (('2 kN', '5 %'), None)
    """
    match = _RANGE.fullmatch(value.translate(_LOOKALIKES).strip()) if isinstance(value, str) else None
    parts = [split_quantity(match[name]) for name in ("middle", "half")] if match else []
    if match is None or None in parts:
        return None
    (middle, own), (half, other) = (part for part in parts if part is not None)
    unit = match["unit"] or ""
    texts = (middle, unit or own or (other if other != "%" else "")), (half, unit or other or own)
    return tuple(" ".join(filter(None, text)) for text in texts)  # type: ignore[return-value]


def parse_range(value: object, dimension: str | None) -> float:
    """The SI value of a quantity, or of the middle of a range such as "80 mm ± 0.1 mm".

    Raises QuantityError for anything else.
    """
    if (parts := split_range(value)) is None:
        return parse_quantity(value, dimension)
    half_width(value, dimension)
    return parse_quantity(parts[0], dimension)


def middle_of(value: object) -> object:
    """The middle of a range, or a value itself."""
    parts = split_range(value)
    return parts[0] if parts else value


def half_width(value: object, dimension: str | None) -> tuple[int, int]:
    """Half the width of a range in SI as it is written, a ratio of two integers; 0 for a value without a range.

    Raises QuantityError for half of a width that is no quantity of the dimension, or not above 0.

    >>> half_width("80 mm ± 0.1 mm", "length"), half_width("80 mm ± 0.5 %", "length"), half_width("80 mm", "length")
    ((1, 10000), (400, 1000000), (0, 1))
    """
    parts = split_range(value)
    if parts is None:
        return 0, 1
    middle, half = parts
    share = half.endswith("%") and not middle.endswith("%")
    top, bottom = exact_ratio(half, "number" if share else dimension)
    if not top > 0:
        raise QuantityError(quote(half), "half the width of a range, above 0", 'such as "80 mm ± 0.1 mm"')
    whole = exact_ratio(middle, dimension)
    own, other = (_unit((split_quantity(each) or ("", ""))[1] or "%", None).powers for each in parts)
    if own != other and dimension is None and not share:
        raise QuantityError(quote(half), "half the width of a range, in a unit of its middle", 'such as "80 mm ± 0.1 mm"')
    of = [abs(each) for each in whole] if share else [1, 1]
    return top * of[0], bottom * of[1]


def _ratio(match: re.Match[str], unit: Unit) -> tuple[int, int]:
    """Decimal times unit. Raises where digits or powers of ten are too many."""
    if not (match[2] or match[3]) or abs(int(match[4] or 0)) > 400:
        raise QuantityError(quote(match.group()), "a number within the floating-point range")
    fraction = match[3] or ""
    if len(match[2]) + len(fraction) > _MOST_DIGITS:
        raise QuantityError(quote(match.group()), f"a number of at most {_MOST_DIGITS} digits")
    digits = int((match[2] + fraction) or "0") * (-1 if match[1] == "-" else 1)
    power = int(match[4] or 0) - len(fraction)
    return digits * unit.numerator * 10 ** max(power, 0), unit.denominator * 10 ** max(-power, 0)


@lru_cache(1_000)  # scenes have a few units, each of them many times
def _unit(text: str, dimension: str | None) -> Unit:
    """The unit that a text spells; one of the dimension, if that is known."""
    spelt = re.sub(r"[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+", lambda m: "^" + m.group().translate(_SUPERSCRIPTS), text.strip())
    if len(spelt) > _TEXT_LENGTH or "(" in spelt or ")" in spelt:
        raise QuantityError(quote(text), "a unit", "write no brackets: everything after / divides")
    above, *below = spelt.split("/")
    unit = Unit()
    if re.fullmatch(r"1?\s*/\s*min|min\^-1", spelt):
        unit, below = UNITS["min"] ** -1 if dimension == "rate" else UNITS["rpm"], []
    else:
        for k, part in enumerate((above, *below)):
            if k or not (below and part.strip() in ("", "1")):
                for name in re.split(r"\s*[·*]\s*|\s+", part.strip()):
                    factor = _factor(name, dimension)
                    unit *= factor**-1 if k else factor
    if dimension is None:
        return unit
    own = DIMENSIONS[dimension]
    if dimension == "torque" and unit.powers == own.powers and _ENERGIES & set(re.findall(r"[^\W\d_]+", text)):
        raise QuantityError(quote(text), "a unit", "that is an energy: write a torque in N m")
    if not own.fits(unit):
        raise QuantityError(quote(text), "a unit", _mismatch(unit, own))
    return unit


def _factor(text: str, dimension: str | None) -> Unit:
    """One named unit, to a power or not."""
    match = _FACTOR.fullmatch(text)
    if match is None:
        squared = re.fullmatch(r"([^\W\d_]+)([0-9])", text)
        factors = re.split(r"[.-](?=[^\W\d])", text)
        advice = f"write {squared[1]}^{squared[2]}" if squared else f"{quote(text)} is no unit"
        if dimension == "temperature difference":
            advice = "a difference of two temperatures is written in K"
        if len(factors) > 1 and all(factor.rstrip("^0123456789") in UNITS for factor in factors):
            advice = f"a blank multiplies: write {' '.join(factors)}"
        raise QuantityError(quote(text), "a unit", advice)
    name, power = match[1], int(match[2] or 1) if len(match[2] or "") < 4 else _LARGEST_POWER + 1
    if dimension == "frequency" and name in _FREQUENCIES:
        return _FREQUENCIES[name] ** power
    if name.endswith("Hz"):
        raise QuantityError(quote(text), "a unit", "Hz could be turns or radians: write rev/s or rad/s")
    if name not in UNITS or not 0 < abs(power) <= _LARGEST_POWER:
        raise QuantityError(quote(text), "a unit", _unknown(name, power, dimension))
    return UNITS[name] ** power


def _unknown(name: str, power: int, dimension: str | None) -> str:
    """The advice for a name that is no unit, or for a meaningless power of a unit."""
    if name in UNITS:
        return f"a power of {name} lies between -{_LARGEST_POWER} and {_LARGEST_POWER}, and is not 0"
    folded = name.casefold()
    for ending in ("", "s", "es", "n", "en"):
        if folded.endswith(ending) and (meant := _ABROAD.get(folded.removesuffix(ending))):
            return f"{quote(name)} is no unit, did you mean {quote(meant)}?"
    fitting = [key for key in UNITS if dimension is None or UNITS[key].powers == DIMENSIONS[dimension].powers]
    near = suggestion(name, fitting) if fitting else ""
    near = near if near.startswith("did") else suggestion(name, UNITS)
    return f"{quote(name)} is no unit" + (f", {near}" if near else "")


def _mismatch(unit: Unit, dimension: Dimension) -> str:
    """Reason why a unit does not fit a dimension, as advice."""
    if unit.powers == dimension.powers and dimension.name in ("angle", "speed"):
        return "name the angle: write rad, deg or rev" if unit.angle == 0 else "the angle's power does not fit"
    length, mass, time, *others = dimension.powers
    if unit.powers == (length - 1, mass, time + 2, *others) and mass:
        return "kg and lb are masses: write N, kgf or lbf"
    if unit.powers == (length + 1, mass, time - 2, *others) and mass:
        return "N, kgf and lbf are forces: write kg or lb"
    for other in DIMENSIONS.values():
        if other.fits(unit):
            return f"that is a unit of {other.name}" if other.si else "that is a plain number"
    return "the unit does not fit"


def _expected(dimension: str | None) -> str:
    return 'a quantity such as "1.5 kN" or a bare number' if dimension is None else DIMENSIONS[dimension].expected


MOST = 10


def figure(value: float, error: float = 0.0, most: int = MOST) -> str:
    """A number with the significant digits that its absolute error allows, at most `most`.

    A value smaller than its error is 0, one of which nothing is known a question mark; zeros that only pad the fraction are
    dropped.

    >>> figure(353.52142732, 1e-4), figure(353.52142732), figure(1234.5678, 20.0), figure(3e-17, 1e-15), figure(-4e-7)
    ('353.5214', '353.5214273', '1.2e+03', '0', '-4e-07')
    >>> figure(0.75, math.inf)
    '?'
    """
    if not math.isfinite(value):
        return "none"
    if error == math.inf:
        return "?"
    if value == 0.0 or abs(value) <= error:
        return "0"
    # value > error leaves at least half a digit: the one that is then shown is good to its own size
    return f"{value:.{max(certain_digits(value, error, most), 1)}g}"


def certain_digits(value: float, error: float, most: int) -> int:
    """The significant digits that an absolute error below the value leaves, at most `most`."""
    if not error > 0.0:
        return most
    return min(most, math.floor(math.log10(abs(value))) + 1 - math.ceil(math.log10(error)))


def round_speed(speed: float) -> str:
    """An angular speed (rad/s) with its unit, rpm or rad/s: that in which its number is the shorter one.

    >>> round_speed(-4 * math.pi), round_speed(5.0)
    ('-120 rpm', '5 rad/s')
    """
    return min((f"{figure(speed * 30 / math.pi)} rpm", f"{figure(speed)} rad/s"), key=len)


def short(value: float) -> str:
    """A small error or tolerance: two digits."""
    return f"{value:.2g}"


def aligned(cells: Sequence[str]) -> list[str]:
    """Texts of one width with their decimal points under one another; a text that is no number stands to the left.

    >>> aligned(["12.5", "-3", "0.25", ""])
    ['12.5 ', '-3   ', ' 0.25', '     ']
    """
    split = []
    for cell in cells:  # what stands before the decimal point, sign included, and the rest
        number = bool(cell) and (cell[0].isdigit() or cell[0] in "+-±")
        point = next((k for k, c in enumerate(cell) if not (c.isdigit() or c in "+-±")), len(cell)) if number else 0
        split.append((cell[:point], cell[point:]))
    left = max((len(head) for head, _ in split), default=0)
    lines = [head.rjust(left) + tail if head else tail for head, tail in split]
    width = max(map(len, lines), default=0)
    return [line.ljust(width) for line in lines]


def columns(rows: Iterable[Sequence[str]], header: Sequence[str] = (), gap: str = "  ", indent: str = "  ") -> list[str]:
    """Rows as lines, each column aligned; the first holds names and stands to the left, the rest under their header.

    >>> columns([("mass", "2.5", "kg"), ("length", "10", "m")])
    ['  mass     2.5  kg', '  length  10    m']
    """
    table = list(rows)
    if not table:
        return []
    names, *rest = zip(*table, strict=True)
    head, *heads = header or [""] * len(table[0])
    width = max(map(len, (head, *names)))
    stacked = [[head.ljust(width), *(name.ljust(width) for name in names)]]
    for title, cells in zip(heads, rest, strict=True):
        body = aligned(cells)
        width = max(len(title), len(body[0]))
        stacked.append([title.rjust(width), *(cell.rjust(width) for cell in body)])
    lines = [(indent + gap.join(cells)).rstrip() for cells in zip(*stacked, strict=True)]
    return lines if header else lines[1:]


CONDITION = "a condition is written a if c else b"
PRODUCT = "a product is written *"
_LETTERS = str.maketrans({"π": "pi", "φ": "phi", "ϕ": "phi", "ω": "omega"})
_LONGEST = 60  # of a text that is written anew as a whole
_CHOICES = tuple(
    re.compile(rf"\s*{form}\s*", re.IGNORECASE)
    for form in (
        r"(?:i?if|si|ifelse|where|cond)\s*\((?P<c>[^,;?|&]+)[,;](?P<a>[^,;]+)[,;](?P<b>[^,;]+)\)",
        r"(?P<c>[^?:|&]+)\?(?P<a>[^?:]+):(?P<b>[^?:]+)",
        r"if\b(?P<c>.+?)\bthen\b(?P<a>.+?)\belse\b(?P<b>.+)",
        r"(?P<c>[^<>=]+[<>=]+[^<>=]+?)\band\b(?P<a>[^<>=]+?)\bor\b(?P<b>[^<>=]+)",
    )
)
_HABITS = tuple(
    (re.compile(pattern), advice)
    for pattern, advice in (
        (r"\b[iI]+[fF]\s*\(.*[,;]|\?|\b(then|THEN)\b", CONDITION),
        (r"\b(where|ifelse|piecewise|cond|switch|heaviside|step|H)\s*\(", CONDITION),
        (r"\bif\b(?!.*\belse\b)", CONDITION),
        (r"&|\bAND\b", "write and"),
        (r"\|\||\bOR\b", "write or"),
        (r"\|([^|]+)\|", r"write abs(\1)"),
        (r"!(?!=)|\bNOT\b", "write not"),
        (r"<>|≠", "write !="),
        (r"≤|=<", "write <="),
        (r"≥|=>", "write >="),
        (r"(?<![<>=!])=(?!=)", "a comparison for equality is written =="),
        (r"\b(sin|cos|tan)\s*(?:⁻¹|(?:\^|\*\*)\s*\(?-1\)?)", r"write a\1(...)"),
        (r"\b(sin|cos|tan)\s*(?:²|(?:\^|\*\*)\s*2)\s*\(([^()]*)\)", r"write \1(\2)**2"),
        (r"\be\s*(?:\^|\*\*)", "write exp(...)"),
        (r"[\^²³⁴⁵]", "a power is written **"),
        (r"[·×⋅∙•]", PRODUCT),
        (r"[÷∕:]", "a quotient is written /"),
        (r"[−–—]", "a minus is written -"),
        (r"√", "write sqrt(...)"),
        (r"°|\b(?:deg|rad|radians)\s*\(|\d\s*(?:deg|grad)\b", "angles in an expression are in rad: write 30*pi/180"),
        (r"^e$", "write exp(...)"),
        (r"π|\bPI\b|\bPi\b", "write pi"),
        (r"[φϕθϑ]|\btheta\b", "write phi"),
        (r"ω", "write omega"),
        (r"\btime\b", "write t"),
        (r"(?i)\b(?:np|numpy|c?math|sympy)\.", "functions have no prefix here: write sin(...)"),
        (r"\bln\s*\(", "log is the natural logarithm"),
        (r"\b(?:log10|lg)\s*\(", "write log(...)/log(10)"),
        (r"\b(?:sgn|signum)\s*\(", "write sign(...)"),
        (r"\bfabs\s*\(", "write abs(...)"),
        (r"\b(max|min)imum\s*\(", r"write \1(...)"),
        (r"\barc(sin|cos|tan)(2?)\s*\(", r"write a\1\2(...)"),
        (r"\b(sin|cos|tan)d\s*\(", r"angles in an expression are in rad: write \1(...*pi/180)"),
        (r"\bpow(?:er)?\s*\(", "a power is written **"),
        (r"\b(sin|cos)h\s*\(", "write it with exp(x) and exp(-x)"),
        (r"\btanh\s*\(", "write it with exp(x) and exp(-x)"),
        (r"\b(?:cot|ctg)\s*\(", "write 1/tan(...)"),
        (r"\btg\s*\(", "write tan(...)"),
        (r"\bsen\s*\(", "write sin(...)"),
        (r"\b(?:arc|a)tg\s*\(", "write atan(...)"),
        (r"\b(sin|cos|tan|asin|acos|atan|sqrt|exp|log|abs|sign)\s+(\w+)", r"write \1(\2)"),
        (r";", "arguments are separated by commas"),
    )
)


def written_here(text: str, names: Collection[str]) -> str:
    """Advice on the first habit of another notation in a text, if there is one; `names` are those of the expression.

    >>> written_here("if(v > 0, 1, -2)", ["v"]), written_here("3 sin(phi)", ["sin", "phi"])
    ('write 1 if v > 0 else -2', 'a product is written *: 3*sin')
    >>> written_here("|v|", ["v"]), written_here("v*abs(v)", ["v", "abs"])
    ('write abs(v)', '')
    """
    if whole := next((match for form in _CHOICES if (match := form.fullmatch(text))), None):
        c, a, b = (whole[name].strip() for name in "cab")
        advice = f"write {a} if {c} else {b}"
        return advice if len(advice) <= _LONGEST and advice.isascii() else CONDITION
    hint = next((match.expand(advice) for pattern, advice in _HABITS if (match := pattern.search(text))), "")
    return hint or product(text, names)


def product(text: str, names: Collection[str]) -> str:
    """Advice on a product without its sign: a number before a name or a bracket, or a bracket before another.

    >>> product("2*(3phi + 1)", ["phi"]), product("2.5e3*phi", ["phi"])
    ('a product is written *: 3*phi', '')
    >>> product("2π", ["pi"])
    'a product is written *: 2*pi'
    """
    text = text.translate(_LETTERS)
    for match in re.finditer(r"(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+|\))\s*([^\W\d]\w*|\()", text):
        left, right = match.groups()
        if right in names or (right == "(" and left != ")"):
            return f"{PRODUCT}: {left}*{right}"
        if right == "(":
            return PRODUCT
    return ""
