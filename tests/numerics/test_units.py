"""Numbers with units: read, checked, scaled, shown."""

from __future__ import annotations

import contextlib
import math
import random
from fractions import Fraction

import mpmath
import mpmath as mp
import numpy as np
import pytest

from flywheel import SceneError
from flywheel.numerics import intervals
from flywheel.numerics.expressions import parse, terms
from flywheel.numerics.faults import ANY, NOT_NEGATIVE, POSITIVE, array, entry, fits, number_faults, vector
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.numerics.units import (
    DIMENSIONS,
    UNITS,
    QuantityError,
    aligned,
    columns,
    convert,
    figure,
    parse_quantity,
    parse_unit,
    short,
    split_quantity,
)
from tests.numerics.test_expressions import mpmath_namespace

# Quantities: exact factors, every unit that the format promises, and a clear word for every slip.


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
    assert caught.value.defect
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


# Arguments of a library's user: what counts as numbers, and how the rest is told.


@pytest.mark.parametrize("value", [0, 1, 0.0, 2.5, np.float64(1.0), np.float32(1.0), np.int64(3)])
def test_finite_numbers_fit(value):
    assert fits(value)
    assert fits(value, NOT_NEGATIVE)
    assert fits(value, POSITIVE) == (value > 0)
    assert fits(-value - 1)
    assert not fits(-value - 1, NOT_NEGATIVE)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 10**400, True, "1", None, [1.0], 1j, np.array(1.0)])
def test_all_else_does_not(value):
    assert [len(number_faults("x", value, expected)) for expected in (ANY, NOT_NEGATIVE, POSITIVE)] == [1, 1, 1]


def test_a_unit_belongs_to_numbers_alone():
    assert [fault.defect for fault in number_faults("mass", -2.0, POSITIVE, "kg")] == ["-2.0 kg"]
    assert [fault.defect for fault in number_faults("mass", "two", POSITIVE, "kg")] == ['"two"']


@pytest.mark.parametrize("value", [[1, 2], (1.0, 2.0), np.array([1, 2]), [mp.mpf(1), Fraction(2)]])
def test_arrays_of_numbers(value):
    result = array("q", value)
    assert result.dtype == float
    assert result.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("20", 'found "20"'),
        (["1", "2"], "found a value of type list"),
        ([[1.0], [1.0, 2.0]], "found a value of type list"),
        ({1: 2}, "found a table"),
        (True, "found true"),
        (1j, "found a value of type complex"),
        (np.inf, "found inf"),
        (None, "found nothing"),
        ([None, 1.0], "found a value that is not finite"),
    ],
)
def test_what_is_no_array_of_numbers(value, text):
    with pytest.raises(SceneError, match=f"^q: {text}, expected finite numbers$"):
        array("q", value)


@pytest.mark.parametrize("value", [9.81, [1.0, 2.0, 3.0], "down", (0.0, np.nan)])
def test_a_vector_has_two_components(value):
    with pytest.raises(SceneError, match=r"^gravity: found "):
        vector("gravity", value, "m/s²")
    assert vector("gravity", (0, -9.81), "m/s²") == (0.0, -9.81)


@pytest.mark.parametrize("name", ["b", ["a"], None, 1])
def test_names_that_are_not_known(name):
    with pytest.raises(SceneError, match=r"^joint: found .*, expected one of a$"):
        entry("joint", name, {"a": 1})
    assert entry("joint", "a", {"a": 1}) == 1


# Figures never show a digit beyond their error, and columns keep their points in line.


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_digit_stands_beyond_the_error(sign: float) -> None:
    rng = np.random.default_rng(3)
    for value, relative in zip(sign * 10.0 ** rng.uniform(-12, 12, 100), 10.0 ** rng.uniform(-14, -1, 100), strict=True):
        check_digits(float(value), float(relative))


def check_digits(value: float, relative: float) -> None:
    error = relative * abs(value)
    output = figure(value, error)
    digits = output.lstrip("-").partition("e")[0].replace(".", "").lstrip("0")
    assert len(digits) <= 10
    assert abs(float(output) - value) <= 5.5 * max(error, 1e-10 * abs(value))
    exponent = float(output.partition("e")[2] or 0)
    decimals = len(output.partition("e")[0].partition(".")[2])
    if decimals:
        assert 10.0 ** (exponent - decimals) >= 0.9 * error


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.0, 0.0, "0"),
        (1e-17, 1e-16, "0"),
        (float("nan"), 0.0, "none"),
        (float("inf"), 0.0, "none"),
        (2.0, 1e-3, "2"),
        (12345.678, 0.5, "12346"),
        (12345.678, 2000.0, "1e+04"),
    ],
)
def test_figure(value: float, error: float, text: str) -> None:
    assert figure(value, error) == text


def test_short_keeps_two_digits() -> None:
    assert short(1.2345e-13) == "1.2e-13"


def test_points_stand_under_one_another() -> None:
    cells = aligned(["1.5", "-200", "3e-07", "no steady motion", "0.25 %"])
    assert len(set(map(len, cells))) == 1
    assert [cell.index(mark) for cell, mark in zip(cells, (".", "00 ", "e", "n", "."), strict=True)] == [4, 2, 4, 0, 4]


def test_columns_put_headers_over_the_right_column() -> None:
    lines = columns([("a", "1.5", "J"), ("long", "22", "")], ("", "work", "unit"))
    assert lines == ["        work  unit", "  a      1.5     J", "  long  22"]


def test_no_rows_no_lines() -> None:
    assert columns([]) == []


# Exponentials that overflow by themselves and cancel in the whole: values, slopes and bounds against mpmath.


PLACES = np.array([0.0, 1.0, 2.99, 2.999, 3.0000001, 3.01, 4.0, 6.0])
TEXTS = [
    "1/(1 + exp(-{k}*(phi - 3)))",
    "exp({k}*(phi - 3))/(1 + exp({k}*(phi - 3)))",
    "(exp({k}*(phi - 3)) - exp(-{k}*(phi - 3)))/(exp({k}*(phi - 3)) + exp(-{k}*(phi - 3)))",
    "exp(2*{k}*(phi - 3))/(1 + exp({k}*(phi - 3)))**2",
    "log(1 + exp({k}*(phi - 3)))",
    "sqrt(1 + exp(2*{k}*(phi - 3)))/(1 + exp({k}*(phi - 3)))",
    "2**({k}*(phi - 3))/(1 + 2**({k}*(phi - 3)))",
    "(sin(phi)*exp({k}*(phi - 3)) + cos(phi)*exp(phi))/(exp({k}*(phi - 3)) + exp(phi))",
    "max(exp({k}*(phi - 3)), 1)/(exp({k}*(phi - 3)) + 1) + abs(1 - exp({k}*(phi - 3)))/(1 + exp({k}*(phi - 3)))",
    "(2 if exp({k}*(phi - 3))/(1 + exp({k}*(phi - 3))) > 0.5 else 1) + atan(exp({k}*(phi - 3)))",
    "0*exp({k}*phi) + exp(-{k}*phi)*(phi < 1)",
]


def true_values(expression):
    with mpmath.workdps(50):
        places = [{"phi": mpmath.mpf(float(phi))} for phi in PLACES]
        return np.array([float(expression.evaluate(place, mpmath_namespace())) for place in places])


@pytest.mark.parametrize("steepness", ["30", "3e3", "1e8"])
@pytest.mark.parametrize("text", TEXTS)
def test_what_overflows_inside_is_right_outside(text, steepness):
    expression = parse(text.format(k=steepness))
    true = true_values(expression)
    result = np.broadcast_to(expression.evaluate({"phi": PLACES}, np), PLACES.shape)
    rounding = 1e-15 * float(steepness) * 3  # of the exponent
    assert np.all(np.abs(result - true) <= (1e-13 + min(rounding, 1e-3)) * (np.abs(true) + 1e-3))
    jet = expression.evaluate({"phi": Jet(PLACES, 1.0)}, jet_namespace(np))
    assert np.allclose(jet.value, result, rtol=1e-12 + rounding, atol=1e-12)
    assert np.isfinite(jet.first).all()
    bounds = expression.evaluate({"phi": Interval(PLACES - 1e-9, PLACES + 1e-9)}, intervals.NAMESPACE)
    assert np.all((bounds.lo <= true) & (true <= bounds.hi))


@pytest.mark.parametrize("sign", ["", "-"])
def test_bounds_of_a_step_are_tight_beside_it(sign):
    step = parse(f"exp({sign}3e5*(phi - 3))/(1 + exp({sign}3e5*(phi - 3)))")
    bounds = step.evaluate({"phi": Interval(np.array([0.0, 3.001]), np.array([2.999, 6.3]))}, intervals.NAMESPACE)
    assert np.all(bounds.width < 1e-13)


def test_linear_coefficients_cancel_too():
    law = parse("T*exp(900*phi)/(1 + exp(900*phi)) + 1/(1 + exp(900*phi))", frozenset({"T"}))
    assert law.coefficients({"phi": 3.0}, "T", np) == (0.0, 1.0)


def test_what_is_beyond_all_floats_stays_infinite():
    assert parse("exp(300*phi)").evaluate({"phi": 3.0}, np) == np.inf
    assert np.isnan(parse("log(-exp(300*phi))").evaluate({"phi": 3.0}, np))


def test_exponents_are_told_apart_without_their_numeric_factors():
    one, two, three = (parse(text).tree for text in ("-2*(phi - 3)/4", "(phi - 3)*0.5", "-(3*(phi - 3))"))
    (trees,) = {tuple(tree for _, tree in terms(node)) for node in (one, two, three)}
    assert [c for node in (one, two, three) for c, _ in terms(node)] == [-0.5, 0.5, -3.0]
    assert len(trees) == 1
    assert [c for c, _ in terms(parse("300*phi - 2/omega - 900").tree)] == [300.0, -2.0, -900.0]
