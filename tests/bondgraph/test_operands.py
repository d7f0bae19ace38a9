"""Dual numbers carry exact slopes; numpy's functions write formulas down."""

import math

import hypothesis
import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import strategies as st

from bondgraph import GraphError, function
from bondgraph.laws import _PARTIALS, Dual, Traced, untraced

POINTS = {"arcsin": (0.3,), "arccos": (-0.4,), "power": (1.7, 2.3), "divide": (1.7, -2.3)}
MPMATH = {"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2", "log": "log", "absolute": "fabs"}
PLAIN = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "power": lambda a, b: a**b,
    "negative": lambda a: -a,
    "square": lambda a: a * a,
    "maximum": max,
    "minimum": min,
}


def points(name):
    count = len(_PARTIALS[name])
    return POINTS.get(name, (0.7, -1.3)[:count])


def peer(name):
    """The same function over mpmath's numbers."""
    return PLAIN.get(name) or getattr(mpmath, MPMATH.get(name, name))


def slope_by_mpmath(name, at, k):
    with mpmath.workdps(40):
        order = tuple(int(j == k) for j in range(len(at)))
        return float(mpmath.diff(peer(name), tuple(map(mpmath.mpf, at)), order))


@pytest.mark.parametrize("name", _PARTIALS)
def test_partials_of_numpys_functions_agree_with_mpmath(name):
    at = points(name)
    for k in range(len(at)):
        found = getattr(np, name)(*(Dual(v, float(j == k)) for j, v in enumerate(at)))
        assert found.value == pytest.approx(float(peer(name)(*at)), rel=1e-15)
        assert found.slope == pytest.approx(slope_by_mpmath(name, at, k), rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("name", _PARTIALS)
def test_partials_over_arrays_are_those_at_each_point(name):
    at = points(name)
    shaped = [np.full((2, 3), v) * np.linspace(0.9, 1.0, 3) for v in at]
    whole = getattr(np, name)(*(Dual(v, np.ones((2, 3))) for v in shaped))
    assert np.shape(whole.slope) == (2, 3)
    for index in np.ndindex(2, 3):
        one = getattr(np, name)(*(Dual(float(v[index]), 1.0) for v in shaped))
        assert whole.value[index] == pytest.approx(one.value, rel=1e-15)
        assert whole.slope[index] == pytest.approx(one.slope, rel=1e-14)


@pytest.mark.parametrize("name", ["sin", "cos", "exp", "sqrt", "square", "tanh", "log", "multiply", "divide"])
def test_a_complex_step_finds_the_same_slope(name):
    at = tuple(abs(v) for v in points(name))
    found = getattr(np, name)(*(Dual(v, float(k == 0)) for k, v in enumerate(at)))
    assert found.slope == pytest.approx(getattr(np, name)(at[0] + 1e-30j, *at[1:]).imag / 1e-30, rel=1e-14)


@hypothesis.given(st.floats(-3, 3), st.floats(-3, 3))
def test_products_and_quotients_obey_leibniz(a, b):
    u, v = Dual(a, 2.0), Dual(b, -1.0)
    assert (u * v).slope == pytest.approx(2.0 * b - a)
    assert (u / (v * v + 1.0) * (v * v + 1.0)).slope == pytest.approx(2.0, abs=1e-12)


def test_plain_operands_on_either_side():
    u = Dual(2.0, 1.0)
    slopes = [(3 + u).slope, (3 - u).slope, (3 * u).slope, (3 / u).slope, (3**u).slope, (u**3).slope, (-u).slope, (+u).slope]
    assert slopes == pytest.approx([1, -1, 3, -0.75, 9 * math.log(3), 12, -1, 1])
    assert (np.array([1.0, 2.0]) * u).slope.tolist() == [1.0, 2.0]
    assert (np.float64(3.0) - u).slope == -1.0


def test_the_zeroth_power_of_zero_has_slope_zero():
    assert (Dual(0.0, 1.0) ** 0).slope == 0.0
    assert (Dual(0.0, 1.0) ** 1).slope == 1.0


def test_where_picks_value_and_slope_together():
    law = function(lambda x: np.where(x < 1.0, x**2, 3.0 * x))
    assert law.partials(0.5) == (0.25, (1.0,))
    assert law.partials(2.0) == (6.0, (3.0,))
    value, (slope,) = law.partials(np.array([0.5, 2.0]))
    assert value.tolist() == [0.25, 6.0]
    assert slope.tolist() == [1.0, 3.0]
    assert type(law(0.5)) is type(law.partials(0.5)[0]) is type(law.partials(0.5)[1][0]) is float


def test_comparisons_look_at_values():
    u = Dual(2.0, 1.0)
    assert u < 3 and u <= 2 and u > 1 and u >= 2 and u == 2.0 and u != 3.0  # noqa: PT018
    assert not (u == 1.0) and not (u != 2.0)  # noqa: PT018, SIM201, SIM202
    assert (Dual(np.array([1.0, 2.0]), 1.0) > 1.5).tolist() == [False, True]


def test_a_branch_on_equality_is_taken_as_with_plain_numbers():
    law = function(lambda x: np.sin(x) / x if x != 0 else 1.0 + 0.0 * x)
    assert law.partials(0.0) == (1.0, (0.0,))
    assert law.partials(0.0)[0] == law(0.0)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (math.sin, "math's functions take plain floats only: write the law with numpy's, or as a SymPy expression"),
        (np.floor, "numpy.floor has no derivative here"),
        (lambda x: np.interp(x, [0, 1], [0, 1]), "numpy.interp has no derivative here"),
        (lambda x: np.add.reduce(x), "numpy.add.reduce is not known here"),
    ],
)
def test_what_has_no_slope_says_so(law, message):
    with pytest.raises(GraphError, match=f"the slope of a law of x is needed, but cannot be had: {message}"):
        function(lambda x: law(x)).partials(0.5)


def test_numpys_functions_write_themselves_down():
    x, y = sympy.symbols("x y")
    written = np.hypot(Traced(x), 2.0 * Traced(y)) + np.where(Traced(x) < 1.0, np.square(x), -Traced(x))
    expected = sympy.sqrt(x**2 + 4 * y**2) + sympy.Piecewise((x**2, x < 1), (-x, True))
    for at in ({x: 0.3, y: 2.0}, {x: 1.7, y: -0.4}):
        assert float(untraced(written).subs(at)) == pytest.approx(float(expected.subs(at)), rel=1e-15)


def test_whole_floats_are_written_as_integers():
    assert (untraced(2.0), untraced(0.5)) == (2, 0.5)
    assert type(untraced(np.float64(2.0))) is int


def test_a_formula_to_be_cannot_branch():
    with pytest.raises(TypeError, match=r"it branches on its argument; numpy\.where can be followed"):
        bool(Traced(sympy.Symbol("x")) > 0)
