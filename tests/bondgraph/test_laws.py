import math

import numpy as np
import pytest
import sympy

from bondgraph import Function, GraphError, function
from bondgraph.laws import law_of

theta, x, y = sympy.Symbol("theta"), sympy.Symbol("x"), sympy.Symbol("y")


PAIRS = [
    (lambda theta: np.sin(theta) ** 2, sympy.sin(theta) ** 2),
    (lambda x, y: np.arctan2(x, y) + np.hypot(x, y), sympy.atan2(x, y) + sympy.sqrt(x**2 + y**2)),
    (lambda x: np.where(x < 0.5, np.exp(x), x / 3), sympy.Piecewise((sympy.exp(x), x < 0.5), (x / 3, True))),
    (lambda x, y: np.maximum(x, y) - np.minimum(x, 2 * y), sympy.Max(x, y) - sympy.Min(x, 2 * y)),
    (lambda x: np.abs(x) * np.sign(x) * np.sqrt(np.abs(x)), sympy.Abs(x) * sympy.sign(x) * sympy.sqrt(sympy.Abs(x))),
    (lambda x: 0.1 * x + (0.1 + 0.2), 0.1 * x + sympy.Float(0.1 + 0.2)),
]


@pytest.mark.parametrize(("written", "expression"), PAIRS)
def test_an_expression_and_a_python_function_agree(written, expression):
    given, formula = function(written), function(expression)
    assert given.of == formula.of
    for at in (0.3, -1.2), (2.0, 0.7):
        at = at[: len(given.of)]
        assert given(*at) == pytest.approx(formula(*at), rel=1e-15)
        assert given.partials(*at)[1] == pytest.approx(formula.partials(*at)[1], rel=1e-14)
        shaped = [np.full((2, 2), v) for v in at]
        assert np.shape(given(*shaped)) == np.shape(formula(*shaped)) == (2, 2)
        assert np.allclose(given.partials(*shaped)[1], formula.partials(*shaped)[1], rtol=1e-14)


@pytest.mark.parametrize(("written", "expression"), PAIRS)
def test_a_python_function_writes_itself_down(written, expression):
    symbolic = function(written).symbolic()
    for at in (0.3, -1.2), (2.0, 0.7):
        values = dict(zip(("theta", "x", "y"), (at[0], *at), strict=True))
        gap = (symbolic - expression).subs({s: values[s.name] for s in expression.free_symbols})
        assert abs(float(gap)) < 1e-14


@pytest.mark.parametrize("number", [0.1 + 0.2, 1 / 3, 1e-300, 12345.678901234567])
def test_floats_in_expressions_keep_every_bit(number):
    law = function(x * sympy.Float(number))
    assert law(1.0) == number
    assert law.partials(1.0)[1] == (number,)
    assert law(np.array([1.0]))[0] == number


def test_the_slopes_of_absolute_value_and_sign_are_real():
    assert function(sympy.Abs(x)).partials(-2.0) == (2.0, (-1.0,))
    assert function(sympy.sign(x)).partials(-2.0) == (-1.0, (0,))
    assert function(x * sympy.Heaviside(x - 1)).partials(3.0) == (3.0, (1,))


def test_symbols_named_like_functions_do_not_hide_them():
    assert function(sympy.sin(sympy.Symbol("sin")))(0.5) == math.sin(0.5)
    assert function(sympy.Symbol("rod.theta") ** 2).partials(3.0) == (9.0, (6.0,))


def test_an_argument_that_the_expression_has_lost_has_slope_zero():
    law = Function(sympy.Integer(3) * x, ("t", "x"), ("t", "x"))
    assert law(5.0, 2.0) == 6.0
    assert law.partials(5.0, 2.0) == (6.0, (0, 3))
    assert Function(sympy.Float(0.5), ("x",), ("x",)).partials(1.0) == (0.5, (0,))
    assert function(lambda x: 0.5).partials(1.0) == (0.5, (0.0,))


def test_a_function_of_nothing_is_a_constant():
    law = function(lambda: 2.5)
    assert law.of == ()
    assert law() == 2.5
    assert law.partials() == (2.5, ())
    assert law.symbolic() == 2.5


def test_renaming_changes_what_it_is_of_and_nothing_else():
    for given in (lambda x, y: x - 2 * y, x - 2 * y):
        law = function(given).renamed({"x": "rod.x", "z": "no matter"})
        assert law.of == ("rod.x", "y")
        assert law(1.0, 3.0) == -5.0
        assert law.symbolic() == sympy.Symbol("rod.x") - 2 * y
        assert law.symbolic({"rod.x": theta}) == theta - 2 * y


def test_parameters_with_a_default_value_stay_out():
    law = function(lambda x, k=3.0, *, c=2.0: k * x + c)
    assert law.of == ("x",)
    assert law.partials(1.0) == (5.0, (3.0,))


def test_arrays_of_several_shapes_broadcast():
    for given in (lambda x, y: x * y**2, x * y**2):
        value, slopes = function(given).partials(np.array([[1.0], [2.0]]), np.array([1.0, 2.0, 3.0]))
        assert value.tolist() == [[1, 4, 9], [2, 8, 18]]
        assert np.broadcast_shapes(*(np.shape(slope) for slope in slopes)) == (2, 3)


def test_spread_parameters_are_refused():
    with pytest.raises(GraphError, match=r"found \*args, expected names such as theta or t"):
        function(lambda *args: 0.0)
    with pytest.raises(GraphError, match=r"found \*values"):
        function(lambda x, **values: 0.0)


def test_what_is_no_law_is_refused():
    with pytest.raises(GraphError, match="found 'sin', expected a number, a function of named quantities or a SymPy"):
        function("sin")


def test_two_symbols_of_one_name_are_refused():
    with pytest.raises(GraphError, match="two symbols of the expression are named 'x', with different assumptions"):
        function(x + sympy.Symbol("x", positive=True))


@pytest.mark.parametrize(
    "given",
    [
        lambda x: x if x > 0 else 0.0,
        lambda x: math.sin(x),
        lambda x: np.floor(x),
        lambda x: np.interp(x, [0, 1], [2, 3]),
        lambda x: "1 + 1",
        lambda x: [x, x],
        lambda x: x.real,
    ],
)
def test_what_cannot_be_followed_as_a_formula_says_what_to_do(given):
    with pytest.raises(GraphError, match=r"cannot be written as a formula \(.*\): give it as a SymPy expression"):
        function(given).symbolic()


def test_numbers_become_floats_and_functions_functions():
    for number in (2, 2.0, np.float32(2), np.int64(2), sympy.Integer(2), sympy.sqrt(4)):
        assert law_of(number) == 2.0
        assert type(law_of(number)) is float
    assert law_of(sympy.pi / 2) == math.pi / 2
    assert isinstance(law_of(x), Function)
    assert law_of(None) is None
    law = function(x)
    assert law_of(law) is law


@pytest.mark.parametrize("given", [sympy.I, sympy.true, sympy.zoo])
def test_an_expression_that_is_no_real_number_is_refused(given):
    with pytest.raises(GraphError, match=r"found .*, expected a real number"):
        law_of(given)


def test_a_window_of_two_comparisons_has_a_formula_and_values():
    window = function(lambda theta: np.where((theta > 0.5) & np.logical_not(theta > 1.0), 3.0, 0.0))
    assert [window(v) for v in (0.0, 0.7, 1.2)] == [0.0, 3.0, 0.0]
    formula = window.symbolic()
    assert [float(formula.subs("theta", v)) for v in (0.0, 0.7, 1.2)] == [0.0, 3.0, 0.0]
