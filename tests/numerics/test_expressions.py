"""Expressions: what is read, derivatives, intervals."""

import math
import operator
import random
import warnings
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from mpmath import mp

from flywheel.numerics import intervals
from flywheel.numerics.expressions import FUNCTIONS, ExpressionError, parse
from flywheel.numerics.intervals import NAMESPACE as ns
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, jet_namespace
from tests.limits import at_most

# Functions of expressions over mpmath's numbers.


SHARED = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "exp", "log", "sign")


def mpmath_namespace() -> SimpleNamespace:
    """Functions over mpmath's numbers, at the precision that is set when they are called."""
    return SimpleNamespace(
        **{name: getattr(mp, name) for name in SHARED},
        pi=mp.pi,
        abs=abs,
        minimum=min,
        maximum=max,
        where=lambda test, yes, no: yes if test else no,
        divide=lambda a, b: mp.mpf(a) / b,
        power=lambda base, exponent: mp.mpf(base) ** exponent,
        less=operator.lt,
        less_equal=operator.le,
        greater=operator.gt,
        greater_equal=operator.ge,
        equal=operator.eq,
        not_equal=operator.ne,
        logical_and=lambda a, b: a and b,
        logical_or=lambda a, b: a or b,
        logical_not=operator.not_,
    )


# Expressions: what is let through and what is not, values, decisions at an anchor, linearity, switches.


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
        ("arcsin(phi)", ["'arcsin'", "write asin(...)"]),
        ("asinn(phi)", ["'asinn'", "did you mean 'asin'"]),
        ("(phi < 1) + (phi and x > 2)", ["the number 'phi' at column 14", "a comparison on either side of and"]),
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
        ("phi > 0 and 0 > 1", 0.0),
        ("phi > 0 or (1 > 2 if phi > 3 else 2 > 3)", 1.0),
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
    result = parse("sqrt(sin(phi)) + x**0.5 + x**3 + asin(phi)").branch_points()
    assert [part.text for part in result] == ["sin(phi)", "x", "1 - phi", "1 + phi"]


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


# Jets: derivatives against mpmath's differences, and their bounds over intervals.


JETS = jet_namespace(np)
BOUNDS = jet_namespace(intervals.NAMESPACE)
EXACT = mpmath_namespace()

LAWS = [
    "sin(phi)*cos(2*phi) - tan(phi/4)",
    "asin(phi/9) + acos(phi/8) - atan(phi**2)",
    "sqrt(1 + phi**3) / (2 + sin(phi))",
    "exp(-phi/2)*log(1 + phi)",
    "atan2(sin(phi) + 2, cos(phi) - 3)",
    "atan2(phi, 2) + atan2(3, phi)",
    "phi**0.5 + phi**-2 + phi**1 + phi**5 + 2**phi + phi**phi",
    "abs(cos(phi)) + max(sin(phi), 0.3) + min(sin(phi), 0.2, phi)",
    "phi if phi < 2 else 3 - phi**2",
    "(phi < 2)*phi**2 + sign(phi - 1)*sin(phi)",
    "1/phi - (3 - phi)/phi**2",
    "0.02*(1 - cos(phi)) + pi",
]


def derivatives(law, phi):
    """Value and the first two derivatives by mpmath, at 40 digits."""
    expression = parse(law)
    with mpmath.workdps(40):

        def at(u):
            return expression.evaluate({"phi": u}, EXACT)

        return [float(mpmath.diff(at, mpmath.mpf(phi), n)) for n in range(3)]


PLACES = np.array([0.37, 0.81, 1.3, 1.95, 2.6, 3.4, 4.4, 5.7])  # away from where the laws have kinks


@pytest.mark.parametrize("law", LAWS)
def test_derivatives_agree_with_mpmath(law):
    jet = parse(law).evaluate({"phi": Jet(PLACES, 1.0, 0.0)}, JETS)
    expected = np.transpose([derivatives(law, phi) for phi in PLACES])
    for result, row in zip((jet.value, jet.first, jet.second), expected, strict=True):
        assert np.broadcast_to(result, PLACES.shape) == pytest.approx(row, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("law", LAWS)
def test_bounds_enclose_value_and_slope(law):
    expression = parse(law)
    rng = np.random.default_rng(1)
    centre, half = rng.uniform(0.5, 5.5, (40, 1)), 10.0 ** rng.uniform(-6, -1, (40, 1))
    bounds = expression.evaluate({"phi": Jet(Interval(centre - half, centre + half), 1.0)}, BOUNDS)
    assert bounds.second is None
    phi = centre + half * np.linspace(-1, 1, 7)
    samples = expression.evaluate({"phi": Jet(phi, np.ones(phi.shape), 0.0)}, JETS)
    value, slope, noise = bounds.value, intervals.interval(bounds.first), 1e-13
    assert np.all(value.lo <= samples.value + noise)
    assert np.all(samples.value - noise <= value.hi)
    assert np.all(slope.lo <= samples.first + noise * (1 + abs(samples.first)))
    assert np.all(samples.first - noise * (1 + abs(samples.first)) <= slope.hi)


def test_a_jet_over_mpmath_keeps_its_digits():
    with mpmath.workdps(30):
        jet = jet_namespace(EXACT).sin(Jet(mpmath.mpf(1), mpmath.mpf(2), mpmath.mpf(0)))
        assert abs(jet.second + 4 * mpmath.sin(1)) < mpmath.mpf(10) ** -28


def test_powers_at_zero_have_no_false_infinities():
    phi = Jet(np.array([0.0]), 1.0, 0.0)
    for text, expected in [("phi**1", (0, 1, 0)), ("phi**2", (0, 0, 2)), ("phi**3", (0, 0, 0)), ("phi**0", (1, 0, 0))]:
        jet = parse(text).evaluate({"phi": phi}, JETS)
        assert [float(np.squeeze(part)) for part in (jet.value, jet.first, jet.second)] == list(expected)


def test_decisions_follow_the_anchor():
    jet = parse("abs(phi - 1)").evaluate({"phi": Jet(np.array([0.9, 1.1]), 1.0, 0.0)}, JETS, {"phi": 2.0})
    assert jet.value == pytest.approx([-0.1, 0.1])
    assert np.all(jet.first == 1.0)


def test_a_law_that_leaves_the_jet_out_is_a_constant():
    assert parse("max(2, abs(-3))*exp(0)").evaluate({"phi": Jet(1.0, 1.0, 0.0)}, JETS) == 3.0


def test_operators_take_numbers_and_arrays_on_either_side():
    phi = Jet(np.array([1.0, 2.0]), 1.0, 0.0)
    jet = (np.array([1.0, 2.0]) * phi - 1.0) / 2.0 + 3.0 / phi + (1.0 - phi) ** 2
    u = phi.value
    assert jet.value == pytest.approx((u * u - 1) / 2 + 3 / u + (1 - u) ** 2)
    assert jet.first == pytest.approx(u / 2 - 3 / u**2 - 2 * (1 - u))
    assert jet.second == pytest.approx(6 / u**3 + 2)


def test_first_order_is_kept_through_every_operation():
    u, v = Jet(0.3, 1.0), Jet(0.4, 1.0, 0.0)
    texts = [
        "u + v",
        "u - 2",
        "u*v",
        "u/v",
        "1/u",
        "-u",
        "sin(u)",
        "asin(u)*u**2",
        "abs(u)",
        "max(u, v)",
        "atan2(u, v)",
    ]
    for text in texts:
        jet = parse(text, frozenset("uv")).evaluate({"u": u, "v": v}, JETS)
        assert jet.second is None, text


# mpmath sees the same formulas as numpy.


TEXTS = [
    "sin(phi) + cos(phi)*tan(phi/3) - pi",
    "asin(phi/4) - acos(phi/5) + atan(phi) + atan2(phi - 2, -1)",
    "sqrt(phi)*exp(-phi) + log(phi) + phi**2/7 + phi**-0.5",
    "abs(phi - 2) + sign(phi - 2) + min(phi, 2, 3) - max(phi, 2)",
    "5*(1 < phi <= 2) + (3 if not phi > 2 or phi == 3 else 4) + (phi != 1 and phi >= 1)",
]


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("phi", [0.5, 1.5, 2.5])
def test_every_function_agrees_with_numpy(text, phi):
    expression = parse(text)
    expected = float(expression.evaluate({"phi": phi}, np))
    precise = expression.evaluate({"phi": mpmath.mpf(phi)}, mpmath_namespace())
    assert float(precise) == pytest.approx(expected, rel=1e-13)


def test_mpmath_keeps_the_precision_that_is_set():
    with mpmath.workdps(40):
        value = parse("sin(pi/6) + phi/3").evaluate({"phi": mpmath.mpf(1)}, mpmath_namespace())
        assert abs(value - mpmath.mpf(5) / 6) < mpmath.mpf(10) ** -38
    assert math.isclose(value, 5 / 6)


# Interval arithmetic: whatever lies between the ends is enclosed, and tightly where the function allows it.


EXACT_INTERVALS = mpmath_namespace()
SHARES = np.array([0.0, 0.1, 0.35, 0.5, 0.77, 1.0])
DOMAINS = {"asin": (-1, 1), "acos": (-1, 1), "sqrt": (0, np.inf), "log": (1e-300, np.inf)}
UNARY = ["sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "abs", "sign"]
BINARY = ["add", "subtract", "multiply", "divide", "minimum", "maximum", "atan2"]
BY_OPERATOR = {"add": lambda a, b: a + b, "subtract": lambda a, b: a - b, "multiply": lambda a, b: a * b}


def boxes(seed, count=60):
    """Lower and upper ends, many of them zeros, ones, right angles, or equal."""
    rng = np.random.default_rng(seed)
    special = [0.0, -0.0, 1.0, -1.0, np.pi / 2, np.pi, 1e-12, -1e-12]
    ends = np.where(rng.random((2, count)) < 0.4, rng.choice(special, (2, count)), rng.uniform(-30, 30, (2, count)))
    ends *= np.where(rng.random(count) < 0.3, 1e-2, 1.0)
    ends[1, :4] = ends[0, :4]
    return np.sort(ends, axis=0)


def samples(lo, hi):
    """Numbers in boxes, shape (boxes, shares)."""
    return np.clip(lo[:, None] + SHARES * (hi - lo)[:, None], lo[:, None], hi[:, None])


def assert_encloses(bounds, k, number, what):
    assert mpmath.mpf(float(bounds.lo[k])) <= number <= mpmath.mpf(float(bounds.hi[k])), what


@pytest.mark.parametrize("name", UNARY)
def test_functions_enclose_their_samples(name):
    lo, hi = boxes(1)
    bounds = getattr(ns, name)(Interval(lo, hi))
    assert not np.isnan([bounds.lo, bounds.hi]).any()
    least, most = DOMAINS.get(name, (-np.inf, np.inf))
    with mpmath.workdps(40):
        for (k, _), u in np.ndenumerate(samples(lo, hi)):
            if least <= u <= most:
                assert_encloses(bounds, k, getattr(EXACT_INTERVALS, name)(mpmath.mpf(u)), u)


@pytest.mark.parametrize("name", BINARY)
def test_operations_enclose_their_samples(name):
    one, two = boxes(2), boxes(3)
    operation = BY_OPERATOR.get(name) or getattr(ns, name)
    exact = BY_OPERATOR.get(name) or getattr(EXACT_INTERVALS, name)
    bounds = operation(Interval(*one), Interval(*two))
    assert not np.isnan([bounds.lo, bounds.hi]).any()
    with mpmath.workdps(60):
        for k, (first, second) in enumerate(zip(samples(*one), samples(*two), strict=True)):
            for a, b in np.stack(np.meshgrid(first, second), axis=-1).reshape(-1, 2):
                if not (name == "divide" and b == 0):
                    assert_encloses(bounds, k, exact(mpmath.mpf(a), mpmath.mpf(b)), (a, b))


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0, 3.0, 8.0, -1.0, -2.0, 0.5, 2.5, -0.5])
def test_powers_enclose_their_samples(exponent):
    lo, hi = boxes(4)
    bounds = ns.power(Interval(lo, hi), exponent)
    assert not np.isnan(bounds.lo).any()
    with mpmath.workdps(60):
        for (k, _), u in np.ndenumerate(samples(lo, hi)):
            if (u > 0 or exponent.is_integer()) and not (u == 0 and exponent < 0):
                assert_encloses(bounds, k, mpmath.mpf(u) ** mpmath.mpf(exponent), u)


def test_powers_with_a_varying_exponent_enclose_their_samples():
    base, exponents = np.sort(np.random.default_rng(5).uniform(0.01, 20, (2, 40)), axis=0), boxes(6, 40)
    bounds = ns.power(Interval(*base), Interval(*exponents))
    with mpmath.workdps(60):
        for k, (bases, powers) in enumerate(zip(samples(*base), samples(*exponents), strict=True)):
            for u, n in zip(bases, powers[[5, 0, 3, 1, 2, 4]], strict=True):
                assert_encloses(bounds, k, mpmath.mpf(u) ** mpmath.mpf(n), (u, n))


def test_plain_numbers_count_as_intervals_without_width():
    u, number = Interval(*boxes(7)), np.random.default_rng(8).uniform(-30, 30, 60)
    point = Interval(number, number)
    for mixed, pure in (
        (u + number, u + point),
        (number - u, point - u),
        (u * number, u * point),
        (number / u, point / u),
    ):
        np.testing.assert_array_equal([mixed.lo, mixed.hi], [pure.lo, pure.hi])


@pytest.mark.parametrize("name", ["less", "less_equal", "greater", "greater_equal", "equal", "not_equal"])
def test_comparisons_are_sure_only_when_every_pair_agrees(name):
    one, two = boxes(9), boxes(10)
    verdict = getattr(ns, name)(Interval(*one), Interval(*two))
    outcomes = getattr(np, name)(samples(*one)[:, :, None], samples(*two)[:, None, :])
    assert (verdict.lo <= outcomes.min(axis=(1, 2))).all()
    assert (outcomes.max(axis=(1, 2)) <= verdict.hi).all()


def test_comparisons_that_are_sure():
    low, high = Interval(0.0, 1.0), Interval(2.0, 3.0)
    assert (ns.less(low, high).lo, ns.less(high, low).hi) == (1.0, 0.0)
    assert (ns.equal(Interval(2.0, 2.0), 2.0).lo, ns.not_equal(low, high).lo) == (1.0, 1.0)


def test_an_open_choice_is_the_hull_of_both_branches():
    test = ns.less(Interval(np.array([0.0, 0.0, 2.0]), np.array([0.5, 2.0, 3.0])), 1.0)
    chosen = ns.where(test, 5.0, Interval(-1.0, 0.0))
    assert (chosen.lo.tolist(), chosen.hi.tolist()) == ([5.0, -1.0, -1.0], [5.0, 5.0, 0.0])
    both = ns.logical_and(test, ns.logical_not(test))
    assert (both.lo.tolist(), both.hi.tolist()) == ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    either = ns.logical_or(test, ns.logical_not(test))
    assert (either.lo.tolist(), either.hi.tolist()) == ([1.0, 0.0, 1.0], [1.0, 1.0, 1.0])


def test_extremes_inside_a_cell_are_exact_and_others_tight():
    crest = ns.sin(Interval(1.0, 2.0))
    assert crest.hi == 1.0
    assert crest.lo == pytest.approx(np.sin(1.0), rel=1e-14)
    assert ns.sin(Interval(-1.0, 1e9)).width == 2.0
    assert ns.cos(Interval(3.0, 3.5)).lo == -1.0
    assert ns.cos(Interval(0.1, 0.2)).hi < 1.0
    square = ns.power(Interval(-1.0, 2.0), 2.0)
    assert (square.lo, float(square.hi)) == (0.0, pytest.approx(4.0, rel=1e-14))


def test_what_may_be_anything():
    for bounds in (
        1.0 / Interval(-1.0, 2.0),
        ns.tan(Interval(1.5, 1.6)),
        ns.power(Interval(-1.0, 1.0), -1.0),
        ns.sin(Interval(-np.inf, np.inf)) * Interval(-np.inf, np.inf),
    ):
        assert (bounds.lo, bounds.hi) == (-np.inf, np.inf)
    half = [1.0 / Interval(0.0, 2.0), -1.0 / Interval(-2.0, 0.0), 1.0 / Interval(-0.0, 2.0), 1.0 / -Interval(0.0, 2.0)]
    assert [(bounds.lo <= 0.5 <= bounds.hi, bounds.hi == np.inf) for bounds in half[:3]] == [(True, True)] * 3
    assert all(bounds.lo > 0.49 for bounds in half[:3])
    assert half[3].lo == -np.inf
    assert half[3].hi > -0.51
    cut = ns.atan2(Interval(-1.0, 1.0), Interval(-2.0, -1.0))
    assert cut.lo < -np.pi < np.pi < cut.hi


def test_zero_stays_zero():
    nothing = Interval(0.0, 0.0) * Interval(-np.inf, np.inf) + 0.0 * Interval(1.0, 2.0)
    assert (nothing.lo, nothing.hi) == (0.0, 0.0)


def test_overflow_is_enclosed():
    with np.errstate(over="ignore"):
        huge = ns.exp(Interval(800.0, 900.0))
        assert np.isfinite(huge.lo)
        assert huge.hi == np.inf
        assert (huge - huge).contains(0.0)


def test_arrays_of_cells_mix_with_arrays_and_numpy_scalars():
    cells = Interval(np.array([0.0, 1.0]), np.array([1.0, 2.0]))
    shifted = np.array([10.0, 20.0]) + np.float64(2.0) * cells - np.float64(1.0)
    assert shifted.contains(np.array([9.0, 21.0])).all()
    assert shifted.width == pytest.approx(np.array([2.0, 2.0]), rel=1e-14)
    assert (-cells).magnitude.tolist() == [1.0, 2.0]
    assert (cells**2).mignitude == pytest.approx(np.array([0.0, 1.0]), rel=1e-14)
    assert repr(Interval(0.0, 0.5)) == "Interval(0., 0.5)"
