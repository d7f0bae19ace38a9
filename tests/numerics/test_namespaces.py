"""mpmath sees the same formulas as numpy."""

import math

import mpmath
import numpy as np
import pytest

from flywheel.numerics.expressions import parse
from tests.numerics.exact import mpmath_namespace

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
