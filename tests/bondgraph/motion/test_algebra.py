"""Recordings, small linear systems and Newton's iteration: the same over floats, arrays, symbols and recordings."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import GraphError, function
from bondgraph.laws import Dual
from bondgraph.motion.algebra import settle, solve, solve_symmetric
from bondgraph.recording import Recorder


def inputs(recorder, count):
    return [recorder.input(f"x{k}") for k in range(count)]


def recorded(given, count):
    recorder = Recorder()
    return recorder.program(given(*inputs(recorder, count))).function("math")


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

    compiled = recorded(given, 2)
    for x, y in ((0.3, 1.2), (-2.0, 0.5)):
        assert_allclose(compiled(x, y), [float(v) for v in given(x, y)], rtol=1e-14)


@pytest.mark.parametrize("value", [np.float64(-2.0), -2.0, 0.0, 3.0])
def test_sign_takes_numpys_numbers_too(value):
    assert recorded(lambda x: [np.sign(x)], 1)(value) == (np.sign(value),)


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
    assert not any(isinstance(found, Dual) for found in (value, *slopes))
    expected, exact = law.partials(0.7, 1.3)
    assert_allclose(recorder.program([value, *slopes]).function("math")(0.7, 1.3), [expected, *exact], rtol=1e-13)


def test_names_are_no_code():
    recorder = Recorder()
    (x,) = inputs(recorder, 1)
    called = []
    recorder.program([recorder.call(called.append, (x,))]).function("math")("); raise SystemExit")
    assert called == ["); raise SystemExit"]


def positive_definite(size, seed):
    a = np.random.default_rng(seed).normal(size=(size, size))
    return a @ a.T + 0.1 * np.eye(size)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 6), st.integers(0, 1000))
def test_solutions_are_numpys(size, seed):
    matrix = positive_definite(size, seed)
    right = np.random.default_rng(seed + 1).normal(size=size)
    expected = np.linalg.solve(matrix, right)
    assert_allclose(solve_symmetric(matrix.tolist(), right.tolist()), expected, rtol=1e-9, atol=1e-9)
    assert_allclose(
        [row[0] for row in solve(matrix.tolist(), [[r] for r in right.tolist()])], expected, rtol=1e-9, atol=1e-9
    )


def test_only_the_lower_triangle_is_read():
    assert solve_symmetric([[2.0, None], [1.0, 4.0]], [4.0, 9.0]) == [1.0, 2.0]


@pytest.mark.parametrize("size", [1, 2, 3])
def test_arrays_symbols_and_recordings_give_what_floats_give(size):
    matrices = [positive_definite(size, seed) for seed in range(4)]
    right = [float(k + 1) for k in range(size)]
    each = [[row[0] for row in solve(m.tolist(), [[r] for r in right])] for m in matrices]
    stacked = [[np.array([m[i, j] for m in matrices]) for j in range(size)] for i in range(size)]
    assert_allclose([row[0] for row in solve(stacked, [[r] for r in right])], np.transpose(each), rtol=1e-12)
    assert_allclose(solve_symmetric(stacked, right), np.transpose(each), rtol=1e-12)
    recorder = Recorder()
    nodes = inputs(recorder, size * size)
    rows = [nodes[size * i : size * (i + 1)] for i in range(size)]
    outputs = [*(row[0] for row in solve(rows, [[r] for r in right])), *solve_symmetric(rows, right)]
    solved = recorder.program(outputs).function("math")
    assert_allclose(solved(*matrices[0].ravel().tolist()), each[0] * 2, rtol=1e-12)
    symbols = [[sympy.Symbol(f"a{i}{j}") for j in range(size)] for i in range(size)]
    at = {symbols[i][j]: matrices[0][i, j] for i in range(size) for j in range(size)}
    found = [float(row[0].subs(at)) for row in solve(symbols, [[sympy.Float(r)] for r in right])]
    assert_allclose(found, each[0], rtol=1e-9)


@pytest.mark.parametrize("matrix", [[[0.0]], [[1.0, 2.0], [2.0, 4.0]]])
def test_singular_systems_are_errors(matrix):
    with pytest.raises(GraphError, match="lock or branch"):
        solve(matrix, [[1.0] for _ in matrix])
    with pytest.raises(GraphError, match="lock or branch"):
        solve([[sympy.Float(entry) for entry in row] for row in matrix], [[sympy.Integer(1)] for _ in matrix])


def test_a_mass_matrix_that_is_not_positive_is_an_error():
    for matrix in ([[0.0]], [[-1.0]], [[1.0, None], [1.0, 1.0]]):
        with pytest.raises(GraphError, match="the inertia that the motion sees vanishes"):
            solve_symmetric(matrix, [1.0] * len(matrix))


def test_newton_settles_each_of_many_states():
    efforts = np.array([4.0, -9.0, 1e-8, 0.0])
    (found,) = settle(lambda u: ([u[0] * abs(u[0]) - efforts], [[2.0 * abs(u[0])]]), 1, (4,), "pipe")
    assert_allclose(found, np.sign(efforts) * np.sqrt(np.abs(efforts)), rtol=1e-10, atol=1e-15)
    pair = settle(
        lambda u: ([u[0] + u[1] - 3.0, u[0] * u[1] ** 2 - 2.0], [[1.0, 1.0], [u[1] ** 2, 2 * u[0] * u[1]]]), 2, (), ""
    )
    assert_allclose([pair[0] + pair[1], pair[0] * pair[1] ** 2], [3.0, 2.0], rtol=1e-12)


def test_where_it_was_last_is_where_it_goes_on():
    calls = []

    def equations(flows):
        calls.append(flows)
        return [flows[0] ** 2 - 4.0], [[2.0 * flows[0]]]

    assert settle(equations, 1, (), "pipe", near=[-2.0]) == [-2.0]
    assert calls == [[-2.0]]


def test_a_step_into_where_a_law_is_not_defined_is_shortened():
    def equations(flows):
        if flows[0] <= 0.0:
            raise ValueError("no logarithm")
        return [np.log(flows[0]) + 3.0], [[1.0 / flows[0]]]

    assert_allclose(settle(equations, 1, (), "pipe"), np.exp(-3.0), rtol=1e-12)


@pytest.mark.parametrize("slope", [0.0, 1.0])
def test_equations_without_solution_are_an_error_that_names_the_flows(slope):
    with pytest.raises(GraphError, match="no flow of pipe, which no inertia weighs, solves the resistors' laws"):
        settle(lambda flows: ([1.0 + flows[0] ** 2], [[slope * 2.0 * flows[0]]]), 1, (), "pipe")
