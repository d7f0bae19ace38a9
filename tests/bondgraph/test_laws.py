"""Laws of elements, the operands they take, and laws that are recorded."""

import math
import pickle
import re
from types import SimpleNamespace

import hypothesis
import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import strategies as st

from bondgraph import Function, GraphError, function
from bondgraph.elements import _PARTIALS, Dual, Traced, law_of, untraced
from bondgraph.recording import NAMESPACE, Recorder, solved, source
from tests.extras import extra

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
    inputs, formula = function(written), function(expression)
    assert inputs.of == formula.of
    for at in (0.3, -1.2), (2.0, 0.7):
        at = at[: len(inputs.of)]
        assert inputs(*at) == pytest.approx(formula(*at), rel=1e-15)
        assert inputs.partials(*at)[1] == pytest.approx(formula.partials(*at)[1], rel=1e-14)
        shaped = [np.full((2, 2), v) for v in at]
        assert np.shape(inputs(*shaped)) == np.shape(formula(*shaped)) == (2, 2)
        assert np.allclose(inputs.partials(*shaped)[1], formula.partials(*shaped)[1], rtol=1e-14)


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
    for inputs in (lambda x, y: x - 2 * y, x - 2 * y):
        law = function(inputs).renamed({"x": "rod.x", "z": "no matter"})
        assert law.of == ("rod.x", "y")
        assert law(1.0, 3.0) == -5.0
        assert law.symbolic() == sympy.Symbol("rod.x") - 2 * y
        assert law.symbolic({"rod.x": theta}) == theta - 2 * y


def test_parameters_with_a_default_value_stay_out():
    law = function(lambda x, k=3.0, *, c=2.0: k * x + c)
    assert law.of == ("x",)
    assert law.partials(1.0) == (5.0, (3.0,))


def test_arrays_of_several_shapes_broadcast():
    for inputs in (lambda x, y: x * y**2, x * y**2):
        value, slopes = function(inputs).partials(np.array([[1.0], [2.0]]), np.array([1.0, 2.0, 3.0]))
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


# Dual numbers carry exact slopes; numpy's functions write formulas down.


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
        result = getattr(np, name)(*(Dual(v, float(j == k)) for j, v in enumerate(at)))
        assert result.value == pytest.approx(float(peer(name)(*at)), rel=1e-15)
        assert result.slope == pytest.approx(slope_by_mpmath(name, at, k), rel=1e-14, abs=1e-14)


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
    result = getattr(np, name)(*(Dual(v, float(k == 0)) for k, v in enumerate(at)))
    assert result.slope == pytest.approx(getattr(np, name)(at[0] + 1e-30j, *at[1:]).imag / 1e-30, rel=1e-14)


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
    with pytest.raises(GraphError, match=f"the slope of a law of x is needed, but cannot be determined: {message}"):
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


# Recorded numbers: programs give what the arithmetic gives, guards tell where they hold, and nothing is lost in silence.


X = np.linspace(-2.0, 2.0, 9)


def formula(x, p, ns):
    """Something of everything, defined for p > 0."""
    y = ns.sin(x) * p + ns.cos(x) / (1.0 + x**2) - abs(x - 0.5)
    y = y + ns.where(ns.less(x, 0.25), ns.exp(x), ns.sqrt(x * x + p)) - ns.minimum(x, p) * ns.maximum(0.3, x)
    y = y + ns.atan2(x, p) + ns.sign(x) + ns.hypot(x, p) + ns.log(p) + ns.power(p, 1.5) + ns.floor(x)
    return y + ns.where(ns.logical_and(ns.greater(x, -1.0), ns.logical_not(ns.equal(x, 1.0))), 1.0, 0.0) + ns.asin(x / 4.0)


def recorded(value=None):
    recorder = Recorder()
    x, p = recorder.input("x"), recorder.input("p", value)
    return recorder, recorder.program([formula(x, p, NAMESPACE), p * 1.0])


@pytest.mark.parametrize("value", [None, 0.7])
def test_programs_give_what_the_arithmetic_gives(value):
    program = recorded(value)[1]
    expected = formula(X, 0.7, np)
    assert np.abs(program.function()(X, 0.7)[0] - expected).max() < 1e-14
    by_math = program.function("math")
    assert max(abs(by_math(float(x), 0.7)[0] - y) for x, y in zip(X, expected, strict=True)) < 1e-14
    designs = np.array([[0.2], [0.7], [1.9]])
    if value is None:
        assert np.abs(program.function()(X, designs)[0] - formula(X, designs, np)).max() < 1e-14


def test_a_program_runs_over_numbers_of_another_kind():
    from mpmath import mp

    namespace = SimpleNamespace(sin=mp.sin, cos=mp.cos, sqrt=mp.sqrt, atan2=mp.atan2, abs=abs, divide=lambda a, b: a / b)
    recorder = Recorder()
    x = recorder.input("x")
    y = NAMESPACE.sqrt(NAMESPACE.sin(x) ** 2 + NAMESPACE.cos(x) ** 2) - NAMESPACE.hypot(0.6, 0.8)
    with mp.workdps(40):
        assert abs(recorder.program([y]).function(namespace)(mp.mpf("0.3"))[0] - (1 - np.hypot(0.6, 0.8))) < 1e-38


def test_comparisons_of_parameters_are_guards():
    recorder = Recorder()
    a, b = recorder.input("a", 2.0), recorder.input("b", 3.0)
    low, high = sorted([b, a])
    assert low is a
    turns = np.floor(high / low)  # one: from 1 to 2, and no more
    assert turns == 1.0
    assert a != 0.0
    assert not np.where(a >= b, True, False)
    kept = recorder.conditions().kept
    assert kept(np.array([2.0, 2.9, 3.5, 1.0, 0.0]), 3.0).tolist() == [True, True, False, False, False]
    assert kept(np.array([2.0, 2.0]), np.array([[3.0], [4.5]])).tolist() == [[True, True], [False, False]]


def test_guards_hold_at_equality_as_the_comparison_does():
    recorder = Recorder()
    a = recorder.input("a", 2.0)
    assert a > 1.0
    assert a >= 1.5
    assert not a > 3.0
    assert not a >= 4.0
    kept = recorder.conditions().kept
    assert kept(np.array([1.0, 1.5, 3.0, 4.0])).tolist() == [False, True, True, False]
    other = Recorder()
    assert other.input("a", 2.0) >= 1.5
    assert not other.inputs[0] > 1e9
    assert other.conditions().kept(np.array([1.5, 1e9, 2e9])).tolist() == [True, True, False]


def test_guards_of_signs_and_extremes():
    recorder = Recorder()
    a = recorder.input("a", -2.0)
    program = recorder.program([abs(a), np.sign(a), np.maximum(a, -3.0), np.clip(a, -5.0, 5.0)])
    assert program.function("math")(-1.5) == (1.5, -1.0, -1.5, -1.5)
    assert recorder.conditions().kept(np.array([-2.0, 2.0, -3.5, -6.0])).tolist() == [True, False, False, False]


def test_arrays_of_recorded_numbers():
    recorder = Recorder()
    a, b = recorder.input("a", 2.0), recorder.input("b", 1.0)
    edges = np.sort(np.array([0.0, a, b, 3.0]))
    middles = 0.5 * (edges[1:] + edges[:-1])
    assert np.searchsorted(edges, a + 0.1) == 3
    program = recorder.program([*middles, *(a * np.arange(2.0)), *NAMESPACE.sin(edges)])
    result = program.function("math")(2.0, 1.0)
    assert result[:5] == (0.5, 1.5, 2.5, 0.0, 2.0)
    assert result[5:] == (0.0, math.sin(1.0), math.sin(2.0), math.sin(3.0))


@pytest.mark.parametrize(
    "losing",
    [
        lambda x: float(x),
        lambda x: math.sin(x),
        lambda x: np.asarray(x, dtype=float),
        lambda x: np.isfinite(x),
        lambda x: 1.0 if x > 0.0 else 0.0,
        lambda x: int(x),
        lambda x: x + Recorder().input("of another recording"),
        lambda x: range(x),
    ],
)
def test_what_would_lose_the_record_fails(losing):
    with pytest.raises(TypeError):
        losing(Recorder().input("x"))


def test_code_holds_operations_and_places_alone():
    program = recorded()[1]
    other = Recorder()
    x, p = other.input("a'; import os", None), other.input("b")
    same = other.program([formula(x, p, NAMESPACE), p * 1.0])._replace(places=tuple(v + 7e-9 for v in program.places))
    for kind in ("math", "numpy", "numba"):
        text = source(program, kind)
        assert text == source(same, kind)
        assert not re.search(r"\d*\.\d*[1-9]|[1-9]\d{3}|import|'", text)
    assert same.function("math").__code__ is program.function("math").__code__
    assert same.function("math")(0.1, 0.7) != program.function("math")(0.1, 0.7)
    assert pickle.loads(pickle.dumps(program)) == program


def test_what_has_no_effect_is_left_out():
    recorder = Recorder()
    x = recorder.input("x")
    y = (x * 1.0 + 0.0) / 1.0 - 0.0 * NAMESPACE.exp(x)
    assert y is x
    assert x - x == 0.0
    program = recorder.program([x * 2.0 + x * 2.0, NAMESPACE.where(False, x, 3.0)])
    assert program.operations == (("multiply", 0, 1), ("add", 3, 3))
    assert program.function("math")(2.0) == (8.0, 3.0)


def test_systems_are_solved_whatever_pivots_vanish():
    recorder = Recorder()
    entries = [recorder.input(str(k)) for k in range(12)]
    rows = [entries[4 * i : 4 * i + 3] for i in range(3)]
    program = recorder.program(solved([*rows, [0.0, 0.0, 0.0]], [*entries[3::4], 0.0]))
    for seed in range(5):
        table = np.random.default_rng(seed).normal(size=(3, 4))
        for hidden in ((), (0, 0), (1, 1), (2, 2)):
            if hidden:
                table[hidden] = 1e-14 * table[hidden]
            result = program.function("math")(*table.ravel().tolist())
            assert np.abs(table[:, :3] @ result - table[:, 3]).max() < 1e-12 * (1.0 + np.abs(result).max())


def test_what_chooses_between_values_is_called_where_it_may_not_be_defined():
    recorder = Recorder()
    x = recorder.input("x")

    def law(x):
        with np.errstate(invalid="ignore"):
            result = np.where(x > 0.0, np.sqrt(x) * np.sqrt(x), 0.0)
        return float(result) if isinstance(x, float) else result

    for _ in range(2):
        compiled = recorder.program([recorder.through(law, [x]), x]).function("math")
        assert compiled(-1.0) == (0.0, -1.0)


@pytest.mark.slow
def test_machine_code_gives_the_same():
    extra("numba")
    program = recorded()[1]
    designs = np.array([[0.2], [0.7]])
    result = program.function("numba")(X, designs)
    assert np.abs(result[0] - formula(X, designs, np)).max() < 1e-14
    assert result[1].shape == (2, 9)


@pytest.mark.parametrize("of_both", [np.maximum, np.minimum])
def test_where_two_are_equal_the_partials_are_those_of_the_first(of_both):
    """Their sum is 1 wherever both arguments move alike."""
    assert function(lambda x, y: of_both(x, y)).partials(2.0, 2.0) == (2.0, pytest.approx((1.0, 0.0)))


def inputs(recorder, count):
    return [recorder.input(f"x{k}") for k in range(count)]


def compiled(source, count):
    recorder = Recorder()
    return recorder.program(source(*inputs(recorder, count))).function("math")


def test_arithmetic_and_functions_are_taken_down():
    def given(x, y):
        return [
            x * y - 1.0,
            np.sin(x) / (2.0 + y),
            -x + y**2,
            abs(x),
            np.hypot(x, y),
            np.arctan2(y, x),
            np.sign(x),
            np.square(y),
        ]

    values = compiled(given, 2)
    for x, y in ((0.3, 1.2), (-2.0, 0.5)):
        np.testing.assert_allclose(values(x, y), [float(v) for v in given(x, y)], rtol=1e-14)


@pytest.mark.parametrize("value", [np.float64(-2.0), -2.0, 0.0, 3.0])
def test_sign_takes_numpys_numbers_too(value):
    assert compiled(lambda x: [np.sign(x)], 1)(value) == (np.sign(value),)


def test_zeros_and_ones_leave_no_code():
    recorder = Recorder()
    (x,) = inputs(recorder, 1)
    assert x * 1.0 is x
    assert x + 0.0 is x
    assert isinstance(0.0 * x, float)
    assert 0.0 * x == 0.0
    assert x / 1.0 is x


def test_what_branches_stays_a_call():
    def branching(x):
        return 2.0 * x if x > 0.0 else -x

    recorder = Recorder()
    (x,) = inputs(recorder, 1)
    program = recorder.program([recorder.through(branching, [x]), recorder.through(math.floor, [x])])
    compiled = program.function("math")
    assert compiled(1.5) == (3.0, 1)
    assert compiled(-1.5) == (1.5, -2)


def test_slopes_with_respect_to_each_of_several_arguments_are_recorded():
    law = function(lambda a, b: a * np.sin(b) + a / b - np.hypot(a, b) + (2.0 - a) ** 3)
    recorder = Recorder()
    x, y = inputs(recorder, 2)
    value, slopes = law.partials(x, y)
    assert not any(isinstance(result, Dual) for result in (value, *slopes))
    expected, exact = law.partials(0.7, 1.3)
    np.testing.assert_allclose(recorder.program([value, *slopes]).function("math")(0.7, 1.3), [expected, *exact], rtol=1e-13)


def test_names_are_no_code():
    recorder = Recorder()
    (x,) = inputs(recorder, 1)
    called = []
    recorder.program([recorder.call(called.append, (x,))]).function("math")("); raise SystemExit")
    assert called == ["); raise SystemExit"]
