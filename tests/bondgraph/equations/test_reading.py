import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph import Builder, C, GraphError, I, R, Se, Sf
from bondgraph.equations.equations import Reading, _solved, state_equations, through
from tests.bondgraph.equations.written import agrees, slider_crank


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(1, 4), st.integers(0, 2**32))
def test_rates_solve_the_system_of_their_mass_matrix(size, seed):
    rng = np.random.default_rng(seed)
    whole = rng.integers(-2, 3, (size, size))
    whole = whole @ whole.T + np.eye(size, dtype=int)
    force = rng.integers(-3, 4, size)
    found = _solved([[int(v) for v in row[: i + 1]] for i, row in enumerate(whole)], [int(v) for v in force])
    assert sympy.Matrix(whole.tolist()) * sympy.Matrix(found) == sympy.Matrix(force.tolist())


def test_a_mass_matrix_without_inverse_is_an_error():
    with pytest.raises(GraphError, match="independent flows have no inertia of their own"):
        _solved([[1], [1, 1]], [1, 0])


def test_a_flow_is_followed_through_all_transformers_to_the_independent_ones():
    b = Builder().one("a").one("b").one("c").on("a", I("J", 1.0)).on("c", I("m", 1.0))
    graph = b.transform("a", "b", 2.0, name="T").transform("b", "c", 3.0, name="U").build()
    read = Reading(graph, False, None)
    assert through(read.form, read.form.variable("c")) == ["U", "T"]
    assert through(read.form, read.form.variable("a")) == []


def test_flows_without_an_inertia_in_common_keep_their_own_determinant():
    b = Builder()
    for side in "ab":
        for n in "12":
            b.one(side + n).on(side + n, I(f"J{side}{n}", 1.0), Se(f"M{side}{n}", 2.0))
        b.sum(f"{side}3", [(f"{side}1", 2.0), (f"{side}2", 3.0)], "").on(f"{side}3", I(f"m{side}", 0.5))
    found = agrees(b.between("a3", "b3", C("c", 1.0)).build())
    symbols = found.derivatives[0].free_symbols
    assert sympy.Symbol("Ja2") in symbols
    assert sympy.Symbol("Jb1") not in symbols


def test_a_resistor_of_zero_is_listed():
    b = slider_crank().on("crank", R("none", 0.0))
    assert agrees(b.build()).inert == ("R:none (bond 8) acts on nothing: its value is 0",)


def test_springs_that_share_one_effort():
    b = Builder().one("mass").zero("z").on("mass", I("m", 2.0), Se("F", 1.0)).bond("mass", "z")
    graph = b.on("z", C("c1", 0.5), C("c2", 0.25)).build()
    found = agrees(graph)
    assert any("c2" in line and "move together" in line for line in found.derivative_stores)


def test_sources_and_resistors_that_act_on_nothing_are_listed():
    b = Builder().one("drive").on("drive", Sf("v", 1.0), Se("F", 2.0), R("B", 3.0)).one("mass").on("mass", I("m", 2.0))
    graph = (
        b.between("drive", "mass", C("c", 1.0)).one("idle").transform("mass", "idle", 0.0).on("idle", Se("F0", 1.0)).build()
    )
    found = agrees(graph)
    assert [line.split(" acts")[0] for line in found.inert] == ["Se:F (bond 2)", "R:B (bond 3)", "Se:F0 (bond 10)"]
    assert "gain is zero" in found.inert[2]
    assert "sources of flow alone" in found.inert[0]


def test_a_flow_source_that_nothing_feels():
    graph = Builder().one("a").on("a", Sf("v", 1.0), I("J", 1.0)).build()
    found = state_equations(graph)
    assert found.states == ()
    assert found.inert == (
        "Sf:v (bond 1) acts on nothing: no element feels the flow that it imposes",
        "I:J (bond 2) acts on nothing: sources of flow alone settle its flow",
    )
