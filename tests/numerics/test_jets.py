"""Jets: derivatives against mpmath's differences, and their bounds over intervals."""

import mpmath
import numpy as np
import pytest

from flywheel.numerics import intervals
from flywheel.numerics.expressions import parse
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, jet_namespace
from tests.numerics.exact import mpmath_namespace

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
    for found, row in zip((jet.value, jet.first, jet.second), expected, strict=True):
        assert np.broadcast_to(found, PLACES.shape) == pytest.approx(row, rel=1e-11, abs=1e-11)


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
