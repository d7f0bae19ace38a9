"""Small linear systems over floats, arrays, symbols and recordings."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import GraphError
from bondgraph.motion.algebra import Recorder, solve, solve_symmetric


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
    nodes = recorder.inputs(size * size)
    rows = [nodes[size * i : size * (i + 1)] for i in range(size)]
    solved = recorder.function([*(row[0] for row in solve(rows, [[r] for r in right])), *solve_symmetric(rows, right)])
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
