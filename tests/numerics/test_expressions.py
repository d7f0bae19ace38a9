"""Expressions: what is let through and what is not, values, decisions at an anchor, linearity, switches."""

import math
import random
import warnings

import numpy as np
import pytest

from flywheel.numerics.expressions import FUNCTIONS, ExpressionError, parse
from tests.limits import at_most

PARAMETERS = frozenset({"F", "k", "η"})

HOSTILE = [
    "__import__('os').system('true')",
    "().__class__.__bases__",
    "phi.__class__",
    "phi.real",
    "lambda: 1",
    "lambda",
    "(x := 1)",
    "[phi for phi in x]",
    "{phi}",
    "x[0]",
    "'text'",
    'f"{phi}"',
    "print(phi)",
    "eval(phi)",
    "sin",
    "sin()",
    "sin(phi, 1)",
    "atan2(phi)",
    "max(phi)",
    "max(*phi, 1)",
    "sin(x=1)",
    "phi % 2",
    "phi // 2",
    "phi ^ 2",
    "phi @ 2",
    "~phi",
    "phi << 2",
    "phi | 1",
    "1 in 2",
    "phi is 1",
    "1j",
    "True",
    "None",
    "...",
    "1,5",
    "phi, x",
    "phi = 3",
    "phi; x",
    "phi +",
    "* 3",
    "5 knn",
    "await phi",
    "yield",
    "",
    " \t",
    "1e400",
    "9" * 1999,
    "9**9**9**9",
    "phi**65",
    "phi**-64.5",
    "phi**(1/0)",
    "(" * 10_000 + "1" + ")" * 10_000,
    "(" * 900 + "1" + ")" * 900,
    "(" * 1999,
    "sin(" * 400,
    "f(" * 59 + "1",
    "-" * 1999 + "1",
    "not " * 490 + "1",
    "1 if 1 else " * 160 + "1",
    "2**" * 600 + "2",
    "1+" * 600 + "1",
    "phi" + " " * 3000,
    "рhi",  # Cyrillic er
    "ｐｈｉ",  # full width: Python would read it as phi
    "ｓｉｎ(phi)",
    "ph\u200bi",
    "phi\u00a0+ 1",
    "2·phi",
    "phi²",
    "\u2212phi",
    "phi\x00",
    "a" * 1999,
    "a" * 1990 + "(phi)",
    "phi\n+ 1",
    "phi # comment",
    "\\",
    "\ud800",
]


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: ascii(text[:24]))
def test_hostile_texts_are_refused_at_once_in_one_line(text):
    with pytest.raises(ExpressionError) as caught, at_most(50):
        parse(text)
    message = str(caught.value)
    assert message.isprintable()
    assert len(message) < 400


@pytest.mark.parametrize("letters", ["phixv0123.+-*/()<>=!, sinmaxifelsend", "".join(map(chr, range(1, 0x250)))])
def test_any_text_is_an_expression_or_a_fault(letters):
    rng = random.Random(1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(150):
            try:
                expression = parse("".join(rng.choices(letters, k=rng.randrange(1, 40))))
            except ExpressionError:
                continue
            float(expression.evaluate(dict.fromkeys(expression.names, 0.5), np))


@pytest.mark.parametrize(
    ("text", "fragments"),
    [
        ("300*sin(phj)", ["'phj'", "column 9", "did you mean 'phi'"]),
        ("  phi + K", ["'K'", "column 9", "F, k, η"]),
        ("arcsin(phi)", ["'arcsin'", "did you mean 'asin'"]),
        ("phi^2", ["'^'", "column 4", "**"]),
        ("phi % 2", ["'%'", "column 5"]),
        ("x**(60 + 5)", ["exponent", "'60 + 5'", "64"]),
        ("1 + True", ["'True'", "1 or 0"]),
        ("min(x)", ["1 argument of min", "two or more"]),
        ("atan2(x)", ["atan2", "(y, x)"]),
        ("sin + 1", ["without brackets", "sin(...)"]),
        ("η + η2", ["'η2'", "column 5"]),
        ("(phi +", ["never closed", "column 1"]),
    ],
)
def test_messages_say_what_where_and_what_instead(text, fragments):
    with pytest.raises(ExpressionError) as caught:
        parse(text, PARAMETERS)
    assert all(fragment in str(caught.value) for fragment in fragments), str(caught.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1_000.5 + 2", 1002.5),
        ("7/2", 3.5),
        ("-2**2", -4.0),
        ("2**-1", 0.5),
        ("2**3**2", 512.0),
        ("10 - 4 - 3 + 1", 4.0),
        ("24/4/3*2", 4.0),
        ("-(-phi)", 0.75),
        ("+phi", 0.75),
        ("2*pi", 2 * math.pi),
        ("max(1, phi, 3, 2) - min(4, 1, phi)", 2.25),
        ("5*(phi < pi) + 2*(phi > pi)", 5.0),
        ("-(phi < 1)", -1.0),
        ("(phi < 1) + (phi < 2)", 2.0),
        ("0 < phi <= 0.75 < 1", 1.0),
        ("0 < phi < 0.5", 0.0),
        ("phi == 0.75 and phi != 1", 1.0),
        ("not phi", 0.0),
        ("phi and 0", 0.0),
        ("phi or 0", 1.0),
        ("3 if phi >= 0.75 else 4 if phi else 5", 3.0),
        ("sign(-phi) + abs(-phi)", -0.25),
        ("atan2(1, -1)", 0.75 * math.pi),
        ("log(exp(phi)) + sqrt(phi**2) + tan(atan(phi)) + sin(asin(phi)) + cos(acos(phi))", 3.75),
    ],
)
def test_values_are_those_of_arithmetic(text, expected):
    assert float(parse(text).evaluate({"phi": 0.75}, np)) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "phi", "reason"),
    [
        ("2*log(phi-3)", 1.0, "log(phi-3): the logarithm of -2, which is negative"),
        ("log( sin(phi) )", 0.0, "log( sin(phi) ): the logarithm of 0"),
        ("1 + asin(phi)", 1.5, "asin(phi): the arcsine of 1.5, which is outside -1 to 1"),
        ("acos(-phi)", 1 + 2**-50, f"acos(-phi): the arccosine of {-1 - 2**-50}, which is outside -1 to 1"),
        ("3/(phi-1) + sqrt(phi)", 1.0, "3/(phi-1): a division by phi-1, which is 0"),
        ("sqrt(phi-2)/0.5", 0.0, "sqrt(phi-2): the square root of -2, which is negative"),
        ("exp(300*phi)", 3.0, "exp(300*phi): beyond the floating-point range of 1.8e308, as 300*phi = 900"),
        ("exp(300*phi)*0 + 1/(phi - 3)", 3.0, "1/(phi - 3): a division by phi - 3, which is 0"),
        ("(phi - 2)**0.5", 1.0, "(phi - 2)**0.5: -1, which is negative, to the power of 0.5"),
        ("(phi - 1)**-2", 1.0, "(phi - 1)**-2: phi - 1, which is 0, to the power of -2"),
        ("1e300*phi*1e9", 1.0, "1e300*phi*1e9: beyond the floating-point range of 1.8e308"),
        ("log(-1) if phi > 2 else sqrt(-phi)", 1.0, "sqrt(-phi): the square root of -1, which is negative"),
        ("exp(900*phi)*exp(-900*phi)", 1.0, ""),
    ],
)
def test_what_is_undefined_is_told_with_its_reason(text, phi, reason):
    assert parse(text).undefined({"phi": phi}) == reason


@pytest.mark.parametrize("text", ["1/phi", "phi**-1", "log(phi)", "exp(1e3 + phi)", "sqrt(phi - 1)", "asin(2)", "0**-1"])
@pytest.mark.parametrize("phi", [0.0, np.zeros(3)], ids=["number", "array"])
def test_undefined_values_are_not_finite_and_warn_of_nothing(text, phi):
    assert not np.any(np.isfinite(parse(text).evaluate({"phi": phi}, np)))


def formula(rng, depth=3):
    """A text that Python itself can evaluate with math's functions."""
    if depth == 0:
        return rng.choice(["phi", "x", "0.5", "2", "pi"])
    inner = [formula(rng, depth - 1) for _ in range(3)]
    shapes = ["({0} + {1})", "({0} - {1})", "({0} * {1})", "{0} - {1} + {2}", "sin({0})", "exp(-abs({0}))", "-{0}"]
    shapes += ["({0} / (1 + {1}**2))", "max({0}, {1}, {2})", "({0} if {1} < {2} else {1})", "({0} < {1} < {2})"]
    return rng.choice(shapes).format(*inner)


@pytest.mark.parametrize("seed", range(40))
def test_values_agree_with_python_and_do_not_depend_on_the_anchor_being_given(seed):
    """A switch written as text reads back as itself, too."""
    rng = random.Random(seed)
    text, phi, x = formula(rng), rng.uniform(0.1, 6), rng.uniform(-2, 2)
    expected = eval(text, {name: getattr(math, name) for name in ("sin", "exp")}, {"phi": phi, "x": x, "pi": math.pi})
    values = {"phi": phi, "x": x}
    expression = parse(text)
    assert float(expression.evaluate(values, np)) == pytest.approx(float(expected), rel=1e-12, abs=1e-12)
    assert float(expression.evaluate(values, np, values)) == pytest.approx(float(expected), rel=1e-12, abs=1e-12)
    for switch in expression.switches():
        again = parse(switch.text).evaluate(values, np)
        assert float(again) == pytest.approx(float(switch.evaluate(values, np)), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    "text",
    ["abs(phi - 1)", "max(phi - 1, 0)", "min(1, phi)", "sign(phi - 1)", "5*(phi < 1)", "3 if phi >= 1 else phi"],
)
def test_a_piece_never_sees_the_branch_of_its_neighbour(text):
    expression = parse(text)
    middles = np.array([[0.5], [1.5]])
    phi = middles + np.linspace(-0.5 - 1e-12, 0.5 + 1e-12, 9)
    inside = middles + np.linspace(-0.4, 0.4, 9)
    values = expression.evaluate({"phi": phi}, np, {"phi": middles})
    line = expression.evaluate({"phi": inside}, np)
    for row, near, place, there in zip(
        np.broadcast_to(values, phi.shape), phi, np.broadcast_to(line, phi.shape), inside, strict=True
    ):
        slope = (place[-1] - place[0]) / (there[-1] - there[0])
        assert row == pytest.approx(place[0] + slope * (near - there[0]), abs=1e-14)


def test_the_cut_of_atan2_follows_the_anchor():
    angle = parse("atan2(x, -1)")
    x = np.array([-1e-9, 0.0, 1e-9, 2.0])
    assert angle.evaluate({"x": x}, np, {"x": 1.0}) == pytest.approx(math.pi - np.arctan(x), abs=1e-15)
    assert angle.evaluate({"x": -x}, np, {"x": -1.0}) == pytest.approx(-math.pi + np.arctan(x), abs=1e-15)


@pytest.mark.parametrize(
    ("text", "speed", "on_velocity", "when"),
    [
        ("sign(v)*F", False, True, False),
        ("5*(v > 0) - 3*(-v > 0)", False, True, False),
        ("0 <= v", False, True, False),
        ("sign(-v) + (v != 0.0)", False, True, False),
        ("v", True, False, False),
        ("abs(v)", True, False, False),
        ("v > 1", True, False, False),
        ("0 < v < 2", True, False, False),
        ("max(v, 0)", True, False, False),
        ("sign(v)*v**2", True, True, False),
        ("sign(v - 1)", True, False, False),
        ("1 if v else 2", True, False, False),
        ("k*omega", True, False, False),
        ("sin(t) + phi", False, False, True),
        ("phi + x", False, False, False),
    ],
)
def test_what_makes_a_load_depend_on_speed_or_time(text, speed, on_velocity, when):
    expression = parse(text, PARAMETERS)
    assert (expression.uses_speed, expression.switches_on_velocity, expression.uses_time) == (speed, on_velocity, when)


def test_names_are_variables_and_parameters_but_not_pi():
    assert parse("F*sin(phi)/pi + η", PARAMETERS | {"phi", "sin"}).names == {"F", "phi", "η"}


@pytest.mark.parametrize(
    ("text", "degree"),
    [
        ("phi", 0),
        ("F", 1),
        ("-(2*F - phi)/3 + F*sin(phi)", 1),
        ("F*(phi < 1)", 1),
        ("F if phi < 1 else -F*k", 1),
        ("F*F", None),
        ("F**1", None),
        ("1/F", None),
        ("sin(F)", None),
        ("abs(F)", None),
        ("max(F, 0)", None),
        ("1 if F > 0 else 0", None),
        ("F*(F > 0)", None),
        ("2**F", None),
        ("phi*(F + 1/F)", None),
    ],
)
def test_degree_in_a_parameter(text, degree):
    assert parse(text, PARAMETERS).degree("F") == degree


@pytest.mark.parametrize(("force", "k", "phi"), [(-50.0, 2.5, 0.3), (17.0, -3.0, 2.9), (3.0, 0.0, 3.1), (-0.7, 1.1, 6.0)])
def test_coefficients_agree_with_the_value(force, k, phi):
    text = "3 - (F*sin(phi) - phi*(k - 2*F)/4)*(1 + phi**2) + (F/(2 + k**2) if phi < 3 else -F + 5)"
    expression = parse(text, PARAMETERS)
    c0, c1 = expression.coefficients({"phi": phi, "k": k}, "F", np)
    value = expression.evaluate({"phi": phi, "k": k, "F": force}, np)
    assert c0 + c1 * force == pytest.approx(value, rel=1e-12, abs=1e-10)


def test_coefficients_where_the_parameter_is_absent_or_not_linear():
    assert parse("phi**2").coefficients({"phi": 3.0}, "F", np) == (9.0, 0.0)
    with pytest.raises(ValueError, match="not linear in F"):
        parse("F**2", PARAMETERS).coefficients({}, "F", np)


@pytest.mark.parametrize(
    ("text", "switches"),
    [
        ("sin(phi)", []),
        ("abs(sin(phi))", ["sin(phi)"]),
        ("phi < 2", ["phi - 2"]),
        ("0 < sin(phi) <= 0.5", ["sin(phi)", "sin(phi) - 0.5"]),
        ("max(phi, x, 1)", ["x - 1", "phi - max(x, 1)"]),
        ("abs(abs(phi - 1) - 2)", ["phi - 1", "abs(phi - 1) - 2"]),
        ("1 if phi > 1 and not sign(x) > 0 else 2", ["phi - 1", "x", "sign(x)"]),
        ("atan2(sin(phi), x)", ["sin(phi)"]),
        ("sign(v)*(0 > -v)*(v > 3)", ["v - 3"]),
        ("abs(-3) + (2 < pi)", []),
    ],
)
def test_switches_come_inner_ones_first(text, switches):
    assert [switch.text for switch in parse(text).switches()] == switches


def test_branch_points():
    found = parse("sqrt(sin(phi)) + x**0.5 + x**3 + asin(phi)").branch_points()
    assert [part.text for part in found] == ["sin(phi)", "x", "1 - phi", "1 + phi"]


def test_a_long_series_is_not_a_deep_tree():
    series = "+".join(f"{k}*cos({k}*phi)" for k in range(1, 80))
    expected = sum(k * math.cos(0.3 * k) for k in range(1, 80))
    assert float(parse(series).evaluate({"phi": 0.3}, np)) == pytest.approx(expected, rel=1e-12)


def test_a_chain_nested_in_chains_is_evaluated_once_per_member():
    class Counted(dict):
        looks = 0

        def __getitem__(self, name):
            self.looks += 1
            return super().__getitem__(name)

    text, values, anchor = "1 < (" * 50 + "phi" + ") < 1" * 50, Counted(phi=3.0), Counted(phi=3.0)
    assert float(parse(text).evaluate(values, np, anchor)) == 0.0
    assert values.looks + anchor.looks <= 50  # evaluated anew for every member: 2**50


def test_every_function_has_a_value():
    arguments = {"atan2": "x, 2", "min": "x, 2", "max": "x, 2"}
    for name in FUNCTIONS:
        text = f"{name}({arguments.get(name, 'x')})"
        assert math.isfinite(float(parse(text).evaluate({"x": 0.25}, np))), text
