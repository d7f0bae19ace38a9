"""Recorded numbers: programs give what the arithmetic gives, guards tell where they hold, and nothing is lost in silence."""

import math
import pickle
import re
from types import SimpleNamespace

import numpy as np
import pytest

from bondgraph.recording import NAMESPACE, Recorder, solved, source
from tests.extras import extra

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
    found = program.function("math")(2.0, 1.0)
    assert found[:5] == (0.5, 1.5, 2.5, 0.0, 2.0)
    assert found[5:] == (0.0, math.sin(1.0), math.sin(2.0), math.sin(3.0))


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
            found = program.function("math")(*table.ravel().tolist())
            assert np.abs(table[:, :3] @ found - table[:, 3]).max() < 1e-12 * (1.0 + np.abs(found).max())


def test_what_chooses_between_values_is_called_where_it_may_not_be_defined():
    recorder = Recorder()
    x = recorder.input("x")

    def law(x):
        with np.errstate(invalid="ignore"):
            found = np.where(x > 0.0, np.sqrt(x) * np.sqrt(x), 0.0)
        return float(found) if isinstance(x, float) else found

    for _ in range(2):
        compiled = recorder.program([recorder.through(law, [x]), x]).function("math")
        assert compiled(-1.0) == (0.0, -1.0)


@pytest.mark.slow
def test_machine_code_gives_the_same():
    extra("numba")
    program = recorded()[1]
    designs = np.array([[0.2], [0.7]])
    found = program.function("numba")(X, designs)
    assert np.abs(found[0] - formula(X, designs, np)).max() < 1e-14
    assert found[1].shape == (2, 9)
