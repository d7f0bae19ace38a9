"""Jets: derivatives against mpmath's differences, and their bounds over intervals."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flywheel.numerics import intervals
from flywheel.numerics.expressions import mpmath_namespace, parse
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, jet_namespace

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


@pytest.mark.parametrize("law", LAWS)
@settings(derandomize=True, deadline=None, max_examples=12)
@given(phi=st.floats(0.35, 5.8))
def test_derivatives_agree_with_mpmath(law, phi):
    if min(abs(phi - kink) for kink in [np.pi / 2, 3 * np.pi / 2, 2.0, 1.0, *np.arcsin([0.2, 0.3]), 2.8369, 2.9402]) < 1e-3:
        return
    jet = parse(law).evaluate({"phi": Jet(np.array([phi]), 1.0, 0.0)}, JETS)
    for found, expected in zip((jet.value, jet.first, jet.second), derivatives(law, phi), strict=True):
        assert float(np.broadcast_to(found, 1)[0]) == pytest.approx(expected, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("law", LAWS)
@settings(derandomize=True, deadline=None, max_examples=12)
@given(centre=st.floats(0.5, 5.5), half=st.floats(1e-6, 0.1))
def test_bounds_enclose_value_and_slope(law, centre, half):
    expression = parse(law)
    cell = Jet(Interval(np.array([centre - half]), np.array([centre + half])), 1.0)
    bounds = expression.evaluate({"phi": cell}, BOUNDS)
    assert bounds.second is None
    phi = centre + half * np.linspace(-1, 1, 7)
    samples = expression.evaluate({"phi": Jet(phi, np.ones(7), 0.0)}, JETS)
    noise = 1e-13
    assert np.all(bounds.value.lo <= samples.value + noise)
    assert np.all(samples.value - noise <= bounds.value.hi)
    assert np.all(intervals.interval(bounds.first).lo <= samples.first + noise * (1 + abs(samples.first)))
    assert np.all(samples.first - noise * (1 + abs(samples.first)) <= intervals.interval(bounds.first).hi)


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
