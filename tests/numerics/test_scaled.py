"""Exponentials that overflow by themselves and cancel in the whole: values, slopes and bounds against mpmath."""

import mpmath
import numpy as np
import pytest

from flywheel.numerics import intervals
from flywheel.numerics.expressions import parse, terms
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, jet_namespace
from tests.numerics.exact import mpmath_namespace

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
    found = np.broadcast_to(expression.evaluate({"phi": PLACES}, np), PLACES.shape)
    rounding = 1e-15 * float(steepness) * 3  # of the exponent
    assert np.all(np.abs(found - true) <= (1e-13 + min(rounding, 1e-3)) * (np.abs(true) + 1e-3))
    jet = expression.evaluate({"phi": Jet(PLACES, 1.0)}, jet_namespace(np))
    assert np.allclose(jet.value, found, rtol=1e-12 + rounding, atol=1e-12)
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
