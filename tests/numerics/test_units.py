"""Quantities: exact factors, every unit that the format promises, and a clear word for every slip."""

import contextlib
import math
import random
from fractions import Fraction

import numpy as np
import pytest

from flywheel.numerics.units import DIMENSIONS, UNITS, QuantityError, convert, parse_quantity, parse_unit, split_quantity

INCH, POUND, WEIGHT = Fraction(254, 10000), Fraction(45359237, 10**8), Fraction(980665, 10**5)
LBF = POUND * WEIGHT


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("3 m", "length", 3),
        ("3 in", "length", 3 * INCH),
        ("3 ft", "length", 36 * INCH),
        ("3 µm", "length", Fraction(3, 10**6)),
        ("2 kg", "mass", 2),
        ("2 g", "mass", Fraction(2, 1000)),
        ("2 t", "mass", 2000),
        ("2 lb", "mass", 2 * POUND),
        ("1.5 kN", "force", 1500),
        ("1 lbf", "force", LBF),
        ("1 kgf", "force", WEIGHT),
        ("4 N m", "torque", 4),
        ("4 Nm", "torque", 4),
        ("4 N·m", "torque", 4),
        ("4 N*m", "torque", 4),
        ("4 lbf in", "torque", 4 * LBF * INCH),
        ("4 lbf ft", "torque", 48 * LBF * INCH),
        ("5 s", "time", 5),
        ("5 min", "time", 300),
        ("5 h", "time", 18000),
        ("6 kg m^2", "inertia", 6),
        ("6 kg m²", "inertia", 6),
        ("6 lb ft^2", "inertia", 6 * POUND * 144 * INCH**2),
        ("6 lbf in s^2", "inertia", 6 * LBF * INCH),
        ("50 mm^2", "area", Fraction(50, 10**6)),
        ("7 Pa", "pressure", 7),
        ("7 MPa", "pressure", 7000000),
        ("7 N/mm^2", "pressure", 7000000),
        ("7 bar", "pressure", 700000),
        ("7 psi", "pressure", 7 * LBF / INCH**2),
        ("8 J", "energy", 8),
        ("8 kcal", "energy", 8 * 4184),
        ("8 N m", "energy", 8),
        ("9 W", "power", 9),
        ("1 hp", "power", Fraction("745.69987158227022")),
        ("1 CV", "power", Fraction("735.49875")),
        ("2 m s⁻¹", "velocity", 2),
        ("2 m/s^2", "acceleration", 2),
        ("2 m/s/s", "acceleration", 2),
        ("3 N/m", "stiffness", 3),
        ("3 N s/m", "damping", 3),
        ("3 N m/rad", "angular stiffness", 3),
        ("3 N m", "angular stiffness", 3),
        ("3 N m s/rad", "angular damping", 3),
        ("7200 kg/m^3", "density", 7200),
        ("400 V", "voltage", 400),
        ("250 mA", "current", Fraction(1, 4)),
        ("0.4 ohm", "resistance", Fraction(4, 10)),
        ("25 mΩ", "resistance", Fraction(25, 1000)),
        ("25 m\u2126", "resistance", Fraction(25, 1000)),
        ("2 mH", "inductance", Fraction(2, 1000)),
        ("0.25 V s/rad", "motor constant", Fraction(1, 4)),
        ("0.25 N m/A", "motor constant", Fraction(1, 4)),
        ("50 Hz", "frequency", 50),
        ("50 1/s", "frequency", 50),
        ("3 %", "number", Fraction(3, 100)),
        ("0.6", "number", Fraction(6, 10)),
        ("-3e-2 m", "length", Fraction(-3, 100)),
        ("−.5 m", "length", Fraction(-1, 2)),
        ("+5. m", "length", 5),
        (" 5  m ", "length", 5),
        ("12 m", None, 12),
    ],
)
def test_value_is_the_nearest_float(text, dimension, value):
    assert parse_quantity(text, dimension) == float(value)


@pytest.mark.parametrize(
    ("text", "dimension", "turns"),
    [
        ("360 deg", "angle", Fraction(1)),
        ("720 deg", "angle", Fraction(2)),
        ("90°", "angle", Fraction(1, 4)),
        ("0.01 deg", "angle", Fraction(1, 36000)),
        ("-120 deg", "angle", Fraction(-1, 3)),
        ("0.5 rev", "angle", Fraction(1, 2)),
        ("60 rpm", "speed", Fraction(1)),
        ("210 rpm", "speed", Fraction(7, 2)),
        ("210 1/min", "speed", Fraction(7, 2)),
        ("210 min^-1", "speed", Fraction(7, 2)),
        ("210 rev/min", "speed", Fraction(7, 2)),
        ("3 rev/s", "speed", Fraction(3)),
        ("90 deg/s", "speed", Fraction(1, 4)),
    ],
)
def test_angles_and_speeds_are_right_to_the_last_bit(text, dimension, turns):
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(50):
        exact = 2 * mpmath.pi * turns.numerator / turns.denominator
        assert parse_quantity(text, dimension) == float(exact)


def test_whole_turns_agree_with_the_float_pi():
    assert parse_quantity("720 deg", "angle") == 4 * math.pi
    assert parse_quantity("60 rpm", "speed") == 2 * math.pi
    assert parse_quantity("-90 deg", "angle") == -math.pi / 2


@pytest.mark.parametrize(
    ("value", "dimension", "hint"),
    [
        ("1,5 m", "length", "write 1.5, not 1,5"),
        ("1.000,5 m", "length", "write 1000.5, not 1000,5"),
        ("5 Hz", "speed", "rev/s or rad/s"),
        ("5 kHz", "speed", "rev/s or rad/s"),
        ("5 1/s", "speed", "name the angle"),
        ("50 Hz", "number", "rev/s or rad/s"),
        ("50 Hz", None, "rev/s or rad/s"),
        ("50 rpm", "frequency", "unit of speed"),
        ("50 MHz", "frequency", "rev/s or rad/s"),
        ("5 V", "power", "unit of voltage"),
        ("5 W", "voltage", "unit of power"),
        ("5 N m", "motor constant", "unit of torque"),
        ("5 A", "number", "unit of current"),
        ("5 kg A", "force", "does not fit"),
        ("5 s^-1", "speed", "name the angle"),
        ("5", "length", "add a unit"),
        ("5 kg", "force", "write N, kgf or lbf"),
        ("5 lb ft", "torque", "write N, kgf or lbf"),
        ("5 lbf", "mass", "write kg or lb"),
        ("5 J", "torque", "N m"),
        ("5 kcal", "torque", "N m"),
        ("5 KN", "force", '"kN"'),
        ("5 RPM", "speed", '"rpm"'),
        ("5 m2", "area", "write m^2"),
        ("5 N/(m s)", "damping", "everything after / divides"),
        ("5 m", "angle", "unit of length"),
        ("5 %", "angle", "name the angle"),
        ("5 m^0", "length", "power"),
        ("5 m^123456", "length", "power"),
        ("5 1000", "length", ""),
        ("1_000 m", "length", ""),
        ("0x10 m", "length", ""),
        ("m", "length", ""),
        ("", "length", ""),
        ("5 N·", "force", ""),
        ("5 /", "force", ""),
        ("5 kN if phi", "force", ""),
        ("1e400 m", "length", ""),
        ("1e-400 m", "length", ""),
        ("1e999999999 m", "length", ""),
        ("nan m", "length", ""),
        ("inf", "number", ""),
        ("9" * 5000 + " m", "length", ""),
        ("5 " + "m " * 90, "length", ""),
        (True, "number", ""),
        (np.True_, "number", ""),
        (math.nan, "number", "finite"),
        (math.inf, "number", "finite"),
        (10**400, "number", "finite"),
        (None, "length", ""),
        ([1], "length", ""),
        ({}, "length", ""),
        (1j, "length", ""),
        ("5 cmm", "length", 'did you mean "mm"?'),  # of the near names, one that fits
        ("5 cmm", "torque", 'did you mean "mNm"?'),
    ],
)
def test_slips_are_refused_with_advice(value, dimension, hint):
    with pytest.raises(QuantityError) as caught:
        parse_quantity(value, dimension)
    assert caught.value.found
    assert caught.value.expected
    assert hint in f"{caught.value.expected} {caught.value.advice}"
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("number", [3, 2.5, np.float32(0.5), np.int64(7), np.float64(1e40)])
def test_a_bare_number_is_si(number):
    assert parse_quantity(number, "length") == float(number)


@pytest.mark.parametrize("unit", ["deg", "rev", "rad"])
def test_a_table_and_a_text_agree_on_angles(unit):
    for number in np.random.default_rng(1).uniform(-1e9, 1e9, 20).tolist():
        assert convert(number, parse_unit(unit, "angle")) == parse_quantity(f"{number!r} {unit}", "angle")


@pytest.mark.parametrize("letters", ["0123456789.,eE+- mkNsradg/^²·*()%", "".join(map(chr, range(1, 0x250)))])
def test_any_text_is_a_quantity_or_a_clear_refusal(letters):
    rng = random.Random(1)
    for _ in range(200):
        text = "".join(rng.choices(letters, k=rng.randrange(30)))
        for dimension in (None, "length", "speed"):
            with contextlib.suppress(QuantityError):
                assert math.isfinite(parse_quantity(text, dimension))


@pytest.mark.parametrize("dimension", list(DIMENSIONS))
def test_every_dimension_accepts_its_own_example_and_si_unit(dimension):
    assert math.isfinite(parse_quantity(DIMENSIONS[dimension].example, dimension))
    if DIMENSIONS[dimension].si:
        assert parse_quantity(f"1 {DIMENSIONS[dimension].si}", dimension) == 1.0


def test_unit_of_a_wrong_dimension_is_refused():
    with pytest.raises(QuantityError, match="unit of length"):
        parse_unit("mm", "force")


def test_a_quantity_is_split_where_its_number_ends():
    assert split_quantity("2.5e3kN") == ("2.5e3", "kN")
    assert split_quantity("-phi") is None
    assert split_quantity(".") is None


def test_no_unit_hides_another():
    assert UNITS["min"].time == 1
    assert UNITS["ft"].length == 1
    assert UNITS["h"].time == 1
    assert UNITS["Pa"].mass == 1


def test_a_motor_constant_per_rpm_is_right_to_the_last_bit():
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(50):
        assert parse_quantity("0.12 V/rpm", "motor constant") == float(mpmath.mpf("0.12") * 30 / mpmath.pi)


@pytest.mark.parametrize(
    ("text", "dimension", "advice"),
    [
        ("300 U/min", "speed", 'did you mean "rev"?'),
        ("300 vueltas/min", "speed", 'did you mean "rev"?'),
        ("180 grados", "angle", 'did you mean "deg"?'),
        ("180 Grad", "angle", 'did you mean "deg"?'),
        ("180 radianes", "angle", 'did you mean "rad"?'),
        ("3 kp", "force", 'did you mean "kgf"?'),
        ("10 pulg", "length", 'did you mean "in"?'),
        ("10 inches", "length", 'did you mean "in"?'),
        ("2 seg", "time", 'did you mean "s"?'),
        ("3 N-m", "torque", "write N m"),
        ("3 kg.m^2", "inertia", "write kg m^2"),
    ],
)
def test_a_unit_of_another_tongue_is_told_in_ours(text, dimension, advice):
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, dimension)
    assert advice in caught.value.advice


def test_every_unit_of_another_tongue_leads_to_one_that_there_is():
    from flywheel.numerics.units import _ABROAD

    for unit in set(_ABROAD.values()):
        assert parse_quantity(f"1 {unit}", None) > 0
