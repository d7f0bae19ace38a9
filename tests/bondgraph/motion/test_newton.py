"""Newton's iteration, for one state and for many at once."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph import GraphError
from bondgraph.motion.algebra import settle


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
