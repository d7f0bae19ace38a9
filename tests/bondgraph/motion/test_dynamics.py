"""From a state to its rates: states and signals by name, and starts."""

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from bondgraph import Builder, C, GraphError, I, Law, Modulus, Motion, R, Se
from bondgraph.motion.dynamics import Dynamics


def oscillator():
    b = Builder().signal("push").one("mass", "translation", displacement="x").on("mass", I("m", 2.0), R("d", 0.5))
    return b.on("mass", C("spring", stiffness=8.0), Se("F", lambda push: push)).build()


def test_the_state_is_flows_displacements_springs():
    dynamics = Dynamics(oscillator(), {"push": 3.0})
    assert dynamics.state == (("f_mass", "x", "q_spring"), 1, 1)
    assert dynamics.at(0.0, [1.0, 0.5, 0.25]).rates == [(3.0 - 0.5 - 2.0) / 2.0, 1.0, 1.0]


@pytest.mark.parametrize("push", [2, 2.0, np.float64(2.0), lambda t: 4.0 * t, 4 * sympy.Symbol("t"), sympy.Integer(2)])
def test_signals_are_numbers_functions_or_expressions(push):
    assert_allclose(Dynamics(oscillator(), {"push": push}).rates(0.5, 0.0, 0.0, 0.0), [1.0, 0.0, 0.0], rtol=1e-15)


@pytest.mark.parametrize(
    ("signals", "match"),
    [
        ({}, "signal 'push' has no function of t"),
        ({"push": 1.0, "pull": 1.0}, "no signal 'pull': the graph declares push"),
        ({"push": "sin(t)"}, r"signal 'push': found 'sin\(t\)', expected a number, a function of t"),
        ({"push": lambda t, x: t}, "signal 'push': found a function of t, x, expected one of t"),
    ],
)
def test_wrong_signals_are_named(signals, match):
    with pytest.raises(GraphError, match=match):
        Dynamics(oscillator(), signals)


def test_open_parameters_are_named():
    graph = Builder().parameter(k=None).one("a").on("a", I("m", sympy.Symbol("k")), Se("F", 1.0)).build()
    with pytest.raises(GraphError, match=r"parameter 'k' \(I:m, bond 1\) has no value"):
        Dynamics(graph)
    assert Dynamics(graph.with_parameters(k=4.0)).at(0.0, [0.0]).rates == [0.25]


def test_evaluating_leaves_the_graph_alone():
    graph = oscillator()
    before = str(graph), dict(graph.elements), graph.bonds
    dynamics = Dynamics(graph, {"push": 3.0})
    first, second = (dynamics.rates(0.1, 1.0, 2.0, 3.0) for _ in range(2))
    assert first == second == tuple(dynamics.at(0.1, [1.0, 2.0, 3.0]).rates)
    assert before == (str(graph), dict(graph.elements), graph.bonds)


def test_springs_that_hold_a_flow_alone_must_balance_at_the_start():
    b = Builder().one("mass").one("end").on("mass", I("m", 1.0)).between("mass", "end", C("k1", stiffness=5.0))
    dynamics = Dynamics(b.on("end", C("k2", stiffness=3.0)).build())
    assert dynamics.unbalanced([0.0, 0.3, 0.5]) == []
    (fault,) = dynamics.unbalanced([0.0, 1.0, 0.0])
    assert fault.startswith(
        "C:k1, C:k2 alone hold the flow of end, and their efforts there are off balance by 5 at the start"
    )


def test_a_spring_whose_law_a_motion_gives_is_no_state_and_motions_are_anchored_once_each():
    law = Law(lambda here, anchor: here.q, Motion("a"))
    b = Builder().one("a").one("ram").on("a", I("m", 1.0), C("k", 1.0), C("cam", law), Se("M", law)).on("ram", I("M'", 1.0))
    dynamics = Dynamics(b.transform("a", "ram", Modulus(np.sin, np.cos, Motion("a"))).build())
    assert dynamics.state.names == ("f_a", "a", "q_k")
    assert dynamics.anchored == ("a",)
