import json
import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph import GraphError, function
from bondgraph.storage.graphs import MAX_DEPTH, OPERATIONS, as_tree, from_tree, names_in, tree_faults

x, y = sympy.Symbol("x"), sympy.Symbol("y")


NAMED = st.sampled_from([x, y])
NUMBERS = st.one_of(
    st.integers(-9, 9).map(sympy.Integer),
    st.fractions(-3, 3, max_denominator=50).map(lambda f: sympy.Rational(f.numerator, f.denominator)),
    st.floats(-3, 3, allow_subnormal=False).map(sympy.Float),
    st.sampled_from([sympy.pi, sympy.E]),
)


def grown(inner):
    one = st.sampled_from([sympy.sin, sympy.cos, sympy.atan, sympy.tanh, sympy.exp, sympy.Abs, sympy.sign, lambda e: e**2])
    two = st.sampled_from([lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, sympy.Max, sympy.Min, sympy.atan2])
    choice = st.tuples(inner, NAMED, inner).map(lambda t: sympy.Piecewise((t[0], t[1] < 1), (t[2], True)))
    return st.one_of(
        st.tuples(one, inner).map(lambda t: t[0](t[1])), st.tuples(two, inner, inner).map(lambda t: t[0](t[1], t[2])), choice
    )


@settings(max_examples=25, deadline=None)
@given(st.recursive(st.one_of(NAMED, NUMBERS), grown, max_leaves=8))
def test_any_expression_comes_back_from_its_tree(expression):
    if expression.has(sympy.nan, sympy.zoo, sympy.I):
        return
    numbers = expression.atoms(sympy.Float)
    if any(number and not float(number) for number in numbers):  # SymPy multiplies past what a double holds
        with pytest.raises(GraphError, match="that a double holds"):
            as_tree(expression)
        return
    tree = as_tree(expression)
    assert not list(tree_faults(tree, "tree"))
    assert from_tree(json.loads(json.dumps(tree))) == expression


@pytest.mark.parametrize("name", [n for n, o in OPERATIONS.items() if o.gives == "value" and o.least])
def test_every_operation_comes_back_and_has_values_and_slopes(name):
    operation = OPERATIONS[name]
    made = getattr(sympy, operation.sympy)(*(x / 2, y)[: operation.least])
    law = function(from_tree(as_tree(made)))
    at = [1.5 if name == "acosh" else 0.4, 0.7][: len(law.of)]
    at = [3.0] if name == "acosh" else at
    assert from_tree(as_tree(made)) == made
    value, slopes = law.partials(*at)
    assert math.isfinite(value)
    assert all(math.isfinite(slope) for slope in slopes)
    assert np.allclose(law(*(np.array([v, v]) for v in at)), value)


@pytest.mark.parametrize(
    "test", [x < 1, x <= y, sympy.Eq(x, 1), sympy.Ne(x, y), ~(sympy.Eq(x, 0)), (x > 0) & (x < 1), (x >= 2) | (y > 1)]
)
def test_conditions_come_back(test):
    made = sympy.Piecewise((x, test), (y, True))
    assert from_tree(as_tree(made)) == made


def test_deep_and_shared_formulas_are_refused_in_no_time():
    deep = shared = x
    for _ in range(MAX_DEPTH + 20):
        deep = sympy.sin(deep)
    for _ in range(40):
        shared = sympy.Add(sympy.sin(shared), sympy.cos(shared), evaluate=False)
    for made in (deep, shared):
        with pytest.raises(GraphError, match="or 100 levels"):
            as_tree(made)


SIN = ["sin", ["name", "theta"]]


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        ([], ": found nothing, expected an operation: name, ratio"),
        (["eval", "1"], ": found 'eval', expected an operation"),
        (["mul", SIN, ["__import__", "os"]], "[2]: found '__import__', expected an operation"),
        ([["sin"], 1], ": found a list of 1, expected an operation"),
        ("theta", ": found 'theta', expected a finite number or [operation, argument, ...]"),
        (["sin", "theta"], "[1]: found 'theta', expected a finite number or [operation, argument, ...]"),
        (["sin"], ": found sin of 0 arguments, expected 1"),
        (["add", 1], ": found add of 1 arguments, expected 2 to 10000"),
        (["sin", math.nan], "[1]: found nan, expected a finite number"),
        (["mul", SIN, 10**400], "[2]: found a huge number, expected a finite number"),
        (["name", 3], ": found a list of 2, expected [name, text]"),
        (["name", ["name", "t"]], ": found a list of 2, expected [name, text]"),
        (["ratio", 1, 0], ": found a list of 3, expected [ratio, whole number, whole number above 0]"),
        (["ratio", 1.5, 2], ": found a list of 3, expected [ratio"),
        (["ratio", True, 2], ": found a list of 3, expected [ratio"),
        (["less", 1, 2], ": found less, which is a condition, expected a value"),
        (["piecewise", 1, SIN], "[2]: found sin, which is a value, expected a condition"),
        (["piecewise", 1, 2], "[2]: found 2, expected a condition"),
        (["piecewise", 1, ["name", "t"]], "[2]: found a list of 2, expected a condition"),
        (["piecewise", 1, ["true"], 2], ": found piecewise of 3 arguments, expected pairs of value and condition"),
        (["piecewise"], ": found piecewise of 0 arguments, expected pairs"),
        (
            ["piecewise", 1, ["less", ["add", 1, ["piecewise", 1, ["true"]]], 2]],
            "[2][1][2]: found piecewise, expected a value w",
        ),
        (["power", 7, 10**9], ": found a power of exact numbers with more than 100000 bits"),
        (["power", ["power", ["power", 7, 999], 999], 999], ": found a power of exact numbers"),
        (["power", 7, ["power", 10, 9]], ": found a power of exact numbers"),
        (["power", ["mul", 2, ["name", "t"]], -(10**9)], ": found a power of exact numbers"),
        (["power", 2, ["add", ["name", "t"], 10**9]], ": found a power of exact numbers"),
        (["power", ["ratio", 3, 2], ["ratio", 10**9, 7]], ": found a power of exact numbers"),
        (["mul", *([SIN] * 6000)], ": found more than 10000 operations or 100 levels"),
    ],
)
def test_faults_of_trees_are_named_with_their_place(tree, line):
    assert next(tree_faults(tree, "law")).startswith(f"law{line}")


def test_every_fault_of_a_tree_comes_at_once():
    lines = tree_faults(["mul", ["foo"], ["bar"], ["sin"]], "law")
    assert [line.split(":")[0] for line in lines] == ["law[1]", "law[2]", "law[3]"]


@pytest.mark.slow
def test_endless_and_deep_trees_are_refused():
    deep: list = ["sin", 1]
    for _ in range(100_000):
        deep = ["sin", deep]
    endless: list = ["add", 1]
    endless += [endless, endless]
    for tree in (deep, endless):
        assert list(tree_faults(tree, "law")) == [
            "law: found more than 10000 operations or 100 levels, expected a smaller tree"
        ]


def test_names_like_functions_are_names():
    law = function(from_tree(["sin", ["name", "sin"]]))
    assert law(0.5) == math.sin(0.5)


def test_the_names_in_a_tree_are_those_of_its_leaves():
    assert names_in(["add", 1, ["name", "t"], ["sin", ["mul", ["name", "x"], ["name", "t"]]]]) == {"t", "x"}
    assert names_in(2.0) == names_in(["pi"]) == set()
