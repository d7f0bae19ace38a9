import math

import numpy as np
import pytest

from flywheel.numerics.expressions import Expression, between, compiled, expression_of, numeral, parse, variable


@pytest.mark.parametrize("value", [0.1, -0.1, 1e-300, -2.5e17, -0.0, math.pi])
def test_a_number_is_read_back_to_the_last_bit(value):
    found = float(parse(f"1*{expression_of(value)}").evaluate({}, np))
    assert (found, math.copysign(1, found)) == (value, math.copysign(1, value))
    assert float(compiled("3 - {k}", k=value).evaluate({}, np)) == 3.0 - value


@pytest.mark.parametrize("count", [1, 2, 3, 8, 33])
def test_every_stretch_between_knots_has_its_own_leaf(count):
    knots = [float(k) for k in range(1, count)]
    law = Expression("steps", between(variable("x"), knots, [numeral(10 * k) for k in range(count)]))
    for x in [-1.0, *np.arange(0.0, count, 0.5).tolist(), count + 5.0]:
        assert law.evaluate({"x": x}, np) == 10 * min(max(math.floor(x), 0), count - 1)
