"""Equations along the causal strokes: leaks, stores that follow, loops, laws either way, and one story of what is wrong."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from bondgraph import (
    RS,
    Builder,
    C,
    Dynamics,
    GraphError,
    I,
    R,
    Se,
    Sf,
    causality,
    equilibrium,
    linearize,
    motion_equation,
    simulate,
    state_equations,
    table,
    to_modelica,
)
from tests.limits import sample


def leaky(leak):
    """A capacitor with a leak beside it feeds a coil."""
    b = Builder().zero("node").one("coil").bond("node", "coil").on("node", C("c", 1e-6), R("leak", leak))
    return b.on("coil", I("L", 1e-3), R("r", 1.0)).build()


@pytest.mark.parametrize("leak", [1.0, 1e4, 1e10, 1e12, 1e18, 1e20])
def test_a_leak_of_any_size_beside_a_capacitor_leaves_its_rates_right(leak):
    dynamics = Dynamics(leaky(leak))
    assert dynamics.names == ("q_c", "p_L")
    q, p = 2.7e-6, -3.1e-6
    expected = [-q / 1e-6 / leak - p / 1e-3, q / 1e-6 - p / 1e-3]
    assert_allclose(dynamics.rates(0.0, q, p), expected, rtol=1e-15)
    assert_allclose(state_equations(leaky(leak)).numeric()(0.0, [q, p]), expected, rtol=1e-15)


@pytest.mark.parametrize("leak", [1e10, 1e20])
def test_a_capacitor_with_a_great_leak_discharges_into_its_coil(leak):
    run = simulate(leaky(leak), 1e-3, initial={"c": 1e-6})
    matrix = np.array([[-1e6 / leak, -1e3], [1e6, -1e3]])
    truth = expm(1e-3 * matrix) @ [1e-6, 0.0]
    assert_allclose(run.ends[-1], truth, rtol=1e-7)
    assert run.reached
    assert run.audit.power < 1e-12
    assert run.evaluations < 10_000


def test_two_stages_without_inertia_are_simulated_as_they_come():
    """A microsecond beside two seconds."""
    b = Builder().one("source").zero("first").one("line").zero("second")
    b.bond("source", "first").bond("first", "line").bond("line", "second").on("source", Se("E", 1.0), R("R1", 1.0))
    b.on("first", C("C1", 1e-6)).on("line", R("R2", 1e3)).on("second", C("C2", 2e-3))
    run = simulate(b.build(), 2.0)
    assert run.dynamics.names == ("q_C1", "q_C2")
    matrix = np.array([[-1e6 - 1e3, 0.5], [1e3, -0.5]])
    rest = np.linalg.solve(matrix, [-1.0, 0.0])
    assert_allclose(run.ends[-1], rest - expm(2.0 * matrix) @ rest, rtol=1e-7)
    assert run.reached


def test_two_capacitors_on_a_node_or_across_a_transformer_are_one_state():
    b = Builder().zero("node").one("line").bond("line", "node").on("line", Se("E", 6.0), R("r", 2.0))
    node = b.on("node", C("c1", 0.5), C("c2", 1.5)).build()
    assert Dynamics(node).names == ("q_c1",)
    assert_allclose(Dynamics(node).rates(0.0, 1.0), [0.25 * (6.0 - 2.0) / 2.0], rtol=1e-15)
    b = Builder().zero("a").zero("b").one("line").bond("line", "a").on("line", Se("E", 6.0), R("r", 2.0))
    across = b.on("a", C("c1", 0.5)).on("b", C("c2", 1.5)).transform("a", "b", 0.5, name="T").build()
    assert Dynamics(across).names == ("q_c1",)
    flow = 2.0  # e_a = 2, e_b = 4: it feeds c1 and, through the transformer, half as fast, c2 at twice the effort
    assert_allclose(Dynamics(across).rates(0.0, 1.0), [0.5 * flow / (0.5 + 1.5 / 0.25 * 1.0)], rtol=1e-15)
    q, c1, c2 = sympy.symbols("q_c1 c1 c2")
    E, r = sympy.symbols("E r")
    assert sympy.simplify(state_equations(node).derivatives[0] - c1 * (E - q / c1) / r / (c1 + c2)) == 0


def across(first, ratio, second, kind="one"):
    b = Builder()
    for name, source in (("x", first), ("y", second)):
        getattr(b, kind)(name).on(name, source)
    return b.transform("x", "y", ratio, name="T").build()


CALLS = [table, state_equations, Dynamics, motion_equation, lambda graph: simulate(graph, 1.0)]


@pytest.mark.parametrize(
    ("graph", "line"),
    [
        (
            across(Se("u", 1.0), 2.0, Se("w", 1.0), "zero"),
            "Se:u (bond 1) and Se:w (bond 2) both set the effort of TF:T (bonds 3, 4): remove one, or put an R between",
        ),
        (
            across(Sf("u", 1.0), 2.0, Sf("w", 1.0)),
            "Sf:u (bond 1) and Sf:w (bond 2) both set the flow of TF:T (bonds 3, 4): remove one, or put an R between",
        ),
        (
            Builder().one("x").zero("y").on("x", Sf("u", 1.0)).on("y", Se("w", 1.0)).gyrate("x", "y", 2.0, name="T").build(),
            "Sf:u (bond 1) and Se:w (bond 2) both set the effort of GY:T (bonds 3, 4): remove one, or put an R between",
        ),
        (
            Builder().one("x").on("x", Se("u", 1.0), Se("w", 1.0)).build(),
            "Se:u (bond 1) and Se:w (bond 2) both set the effort of 1:x (bonds 1, 2): remove one, or put an R between",
        ),
    ],
)
def test_sources_that_contradict_each_other_are_told_in_one_line_by_every_call(graph, line):
    assert causality(graph).conflicts == (line,)
    for call in CALLS:
        with pytest.raises(GraphError) as caught:
            call(graph)
        assert str(caught.value) == line


def tanks(law):
    """Two tanks of area 2 and 3 m2 joined by an orifice, the first one fed."""
    b = Builder().zero("left", "hydraulic").one("pipe", "hydraulic").zero("right", "hydraulic")
    b.bond("left", "pipe").bond("pipe", "right").on("left", Sf("pump", 0.1), C("A", 2e-4)).on("right", C("B", 3e-4))
    return b.on("pipe", R("orifice", law)).build()


def test_a_resistor_is_given_either_way_round():
    """Q = k sqrt(dp), or dp = (Q/k)^2, of which the orifice between two tanks asks for the first."""
    explicit = tanks(lambda e: 1e-3 * np.sign(e) * np.sqrt(np.abs(e)))
    implicit = tanks(lambda f: 1e6 * f * np.abs(f))
    q = [1.5, 0.6]
    flow = 1e-3 * np.sqrt(1.5 / 2e-4 - 0.6 / 3e-4)
    for graph in (explicit, implicit):
        assert_allclose(Dynamics(graph).rates(0.0, *q), [0.1 - flow, flow], rtol=1e-12)
    result = state_equations(explicit)
    assert_allclose(result.numeric()(0.0, q), [0.1 - flow, flow], rtol=1e-14)
    with pytest.raises(GraphError, match=r"R:orifice \(bond 6\): .* no formula gives its flow; give the law as f"):
        state_equations(implicit)
    runs = [simulate(graph, 3.0, initial={"A": 1.5, "B": 0.6}, rtol=1e-9) for graph in (explicit, implicit)]
    assert_allclose(runs[0].ends[-1], runs[1].ends[-1], rtol=1e-8)


def test_a_diode_lets_a_capacitor_keep_its_charge():
    """i = Is (exp(u/V) - 1) as f(e): a half-wave rectifier without inertia."""
    b = Builder().one("line").zero("out").bond("line", "out").on("out", C("c", 1e-3), R("load", 100.0))
    b.on("line", Se("u", lambda t: 5.0 * np.sin(300.0 * t)), R("diode", lambda e: 1e-9 * (np.exp(e / 0.05) - 1.0)))
    run = simulate(b.build(), 0.03, rtol=1e-7, method="LSODA")

    def by_hand(t, q):
        return [1e-9 * (np.exp((5.0 * np.sin(300.0 * t) - q[0] / 1e-3) / 0.05) - 1.0) - q[0] / 1e-3 / 100.0]

    truth = solve_ivp(by_hand, (0.0, 0.03), [0.0], "LSODA", rtol=1e-11, atol=1e-15, max_step=1e-4).y[0, -1]
    assert_allclose(run.displacement("c", 0.03), truth, rtol=1e-6)


def test_a_law_given_as_flow_of_effort_is_solved_where_the_stroke_asks_for_the_effort():
    """A damper f = e^3 on a mass: e = cbrt(f)."""
    graph = Builder().one("m").on("m", I("M", 2.0), R("d", lambda e: e**3)).build()
    assert_allclose(Dynamics(graph).rates(0.0, 16.0), [-2.0], rtol=1e-13)
    with pytest.raises(GraphError, match=r"R:d \(bond 2\): .* no formula gives its effort; give the law as e"):
        state_equations(graph)


def test_an_inertia_may_have_a_curve_of_its_own():
    """A coil that saturates: f = tanh(p)."""
    graph = Builder().one("coil").on("coil", I("L", lambda p: np.tanh(p)), R("r", 2.0), Se("U", 1.0)).build()
    dynamics = Dynamics(graph)
    assert dynamics.names == ("p_L",)
    assert_allclose(dynamics.rates(0.0, 0.7), [1.0 - 2.0 * np.tanh(0.7)], rtol=1e-14)
    run = simulate(graph, 2.0, initial={"coil": 0.9}, rtol=1e-9)
    assert_allclose(run.flow("coil", 0.0), 0.9, rtol=1e-12)
    assert run.audit.energy < 1e-9


def test_expressions_are_as_short_as_a_person_leaves_them():
    b = Builder().zero("a").one("x").one("y").zero("b").bond("a", "x").bond("y", "b").gyrate("x", "y", 2.0, name="G")
    result = state_equations(b.on("a", C("c1", 1.0), R("r1", 1.0)).on("b", C("c2", 1.0), R("r2", 1.0)).build())
    assert [sympy.count_ops(rate) for rate in result.derivatives] == [6, 5]
    G, c1, c2, r1, q1, q2 = sympy.symbols("G c1 c2 r1 q_c1 q_c2")
    assert result.derivatives[0] == -q1 / (c1 * r1) - q2 / (G * c2)


@pytest.mark.parametrize(("ratio", "leak"), [(1e6, 0.1), (1e-6, 1e20)])
def test_gyrators_and_leaks_of_any_size_keep_their_digits(ratio, leak):
    b = Builder().zero("a").one("x").one("y").zero("b").bond("a", "x").bond("y", "b").gyrate("x", "y", ratio, name="G")
    graph = b.on("a", C("c1", 0.5), R("r1", leak)).on("b", C("c2", 0.25), R("r2", leak)).build()
    expected = [-1.2 / leak - 2.8 / ratio, -2.8 / leak + 1.2 / ratio]
    assert_allclose(Dynamics(graph).rates(0.0, 0.6, 0.7), expected, rtol=1e-14)
    assert_allclose(state_equations(graph).numeric()(0.0, [0.6, 0.7]), expected, rtol=1e-14)


@pytest.mark.parametrize("leaks", [(5.92593e11, 1.43718, 0.00804863), (1e20, 0.1), (1e20, 1e-3, 1e17, 1e20)])
def test_a_loop_of_leaks_and_resistors_is_solved_to_its_last_digit(leaks):
    """An inertia at a node of resistors: in floats, 1e20 ohm beside 0.1 ohm left no digit to the rate."""
    graph = Builder().zero("a").on("a", *(R(f"R{k}", leak) for k, leak in enumerate(leaks)), I("m", 2.0)).build()
    effort = -float(1 / sum(1 / Fraction(leak) for leak in leaks))
    dynamics = Dynamics(graph)
    assert_allclose(dynamics.rates(0.0, 2.0), [effort], rtol=1e-15)
    assert_allclose(dynamics.linear[0], [[effort / 2.0]], rtol=1e-15)
    at = dynamics.at(0.0, [2.0])
    assert_allclose([at.flows[k] for k in range(1, 1 + len(leaks))], [effort / leak for leak in leaks], rtol=1e-14)


def test_a_field_of_resistors_in_a_loop_is_solved_in_fractions_too():
    """Coupled resistors beside a leak: the effort of the node solves (K^-1 summed + 1/leak) e = -f."""
    matrix, leak = [[3.0, 1.0], [1.0, 2.0]], 1e20
    graph = Builder().zero("a").on("a", I("m", 2.0), R("leak", leak)).field(R("K", matrix), "a", "a").build()
    conductance = Fraction(3 + 2 - 1 - 1, 5) + 1 / Fraction(leak)
    assert_allclose(Dynamics(graph).rates(0.0, 2.0), [-float(1 / conductance)], rtol=1e-15)
    assert_allclose(state_equations(graph).numeric()(0.0, [2.0]), [-float(1 / conductance)], rtol=1e-15)
    b = Builder().zero("n").one("j").bond("n", "j").on("n", C("c", 0.5)).on("j", R("r", leak))
    graph = b.field(R("K", matrix), "j", "j").build()  # in series: their resistances add up
    expected = [-float(4 / (Fraction(leak) + 3 + 2 + 1 + 1))]
    assert_allclose(Dynamics(graph).rates(0.0, 2.0), expected, rtol=1e-15)
    assert_allclose(state_equations(graph).numeric()(0.0, [2.0]), expected, rtol=1e-15)
    assert_allclose(state_equations(graph.with_law("r", 0.25)).numeric()(0.0, [2.0]), [-4 / 7.25], rtol=1e-15)


@pytest.mark.parametrize("ratio", [-1.0, 3.0, 3e4])
def test_a_great_store_that_follows_small_ones_leaves_their_rates_right(ratio):
    """With f the flow of the common junction and i = e_b/r of the leak, f/a + T (T f - i)/b + f/c = 0."""
    g = Builder().zero("n").zero("m").one("j").bond("j", "n").transform("j", "m", ratio, name="T")
    g = g.on("n", C("a", 1e-6)).on("m", C("b", 1e-9), R("r", 1e19)).on("j", C("c", 1.0))
    T, a, b, c = (Fraction(x) for x in (ratio, 1e-6, 1e-9, 1.0))
    leak = Fraction(2e-9) / b / Fraction(1e19)
    flow = T * leak / b / (1 / a + T * T / b + 1 / c)
    dynamics = Dynamics(g.build())
    assert dynamics.names == ("q_a", "q_b")
    expected = [float(flow), float(T * flow - leak)]
    assert_allclose(dynamics.rates(0.0, 1e-6, 2e-9), expected, rtol=1e-14)
    assert_allclose(dynamics.at(0.0, [1e-6, 2e-9]).rates, expected, rtol=1e-14)


@pytest.mark.parametrize("great", [1.0, 1e12])
def test_a_great_store_that_follows_small_ones_and_a_source_of_time_leaves_their_rates_right(great):
    """Its effort is e1 + e2 + u(t): c e' = i - f at both nodes, f = C (e1' + e2' + u')."""
    b = Builder().zero("n").zero("m").one("x").bond("n", "x").bond("m", "x").on("x", Se("u", lambda t: 2.0 + 0.5 * t))
    b.on("n", C("a", 1.0), R("r", 1.0), Sf("i", 3.0)).on("m", C("b", 2.0), R("s", 4.0))
    graph = b.on("x", C("great", great)).build()
    dynamics, number = Dynamics(graph), graph.bond_of("great").number
    whole, left, right = Fraction(great), 3 - Fraction(1.25), -Fraction(0.75) / 2 / 4
    flow = whole * (left + right / 2 + Fraction(1, 2)) / (1 + whole + whole / 2)
    assert dynamics.names == ("q_a", "q_b")
    assert_allclose(dynamics.rates(0.0, 1.25, 0.75), [float(left - flow), float(right - flow)], rtol=1e-14)
    assert_allclose(dynamics.at(0.0, [1.25, 0.75]).flows[number], float(flow), rtol=1e-14)


def test_a_loop_beside_a_field_of_inertias_is_one_fraction_in_symbols_too():
    """Nodes joined by a gyrator, each with a resistor and a port of the field: e0/G + G (e0/R0 + i0)/R1 + i1 = 0."""
    mass, ratio, resistors = [[0.79, 0.00415], [0.00415, 0.307]], 771.275, (5e17, 127.0)
    b = Builder().zero("a").zero("b").gyrate("b", "a", ratio).on("a", I("m", 0.05), R("R0", resistors[0]))
    graph = b.on("b", R("R1", resistors[1])).field(I("M", mass), "a", "b").build()
    momenta = {"p_m": 0.3, "p_M_1": 0.7, "p_M_2": -0.4}
    (k, c), (_, n) = ([Fraction(x) for x in row] for row in mass)
    p, q, s = (Fraction(momenta[name]) for name in ("p_M_1", "p_M_2", "p_m"))
    flows = (n * p - c * q) / (k * n - c * c) + s / Fraction(0.05), (k * q - c * p) / (k * n - c * c)
    G, R0, R1 = map(Fraction, (ratio, *resistors))
    effort = -(flows[1] + G * flows[0] / R1) / (1 / G + G / (R0 * R1))
    expected = {"p_m": effort, "p_M_1": effort, "p_M_2": G * (effort / R0 + flows[0])}
    names = [str(s) for s in state_equations(graph).states]
    rates = state_equations(graph).numeric()(0.0, [momenta[n] for n in names])
    assert_allclose(rates, [float(expected[n]) for n in names], rtol=1e-13)


def test_a_mesh_of_resistors_has_equations_in_seconds():
    """Nested fractions share so much that as a tree they are millions of operations, which took minutes to walk."""
    b = Builder()
    for k in range(12):
        b.zero(f"n{k}")
    steps = [(k, k + 1) for k in range(12) if k % 4 < 3] + [(k, k + 4) for k in range(8)]
    for k, (i, j) in enumerate(steps):
        b.one(f"x{k}").bond(f"n{i}", f"x{k}").bond(f"x{k}", f"n{j}").on(f"x{k}", R(f"r{k}", 1.0 + k % 3))
    graph = b.on("n0", C("c", 1.0)).on("n11", C("d", 2.0)).build()
    expected = Dynamics(graph).rates(0.0, 0.6, 0.7)
    assert_allclose(state_equations(graph).numeric()(0.0, [0.6, 0.7]), expected, rtol=1e-13)
    assert expected[0] == -expected[1] != 0.0


def test_bonds_that_cancel_across_equal_junctions_decide_nothing():
    """A flow that leaves three equal junctions at one and comes back at another leaves the 0-junction between no effort."""
    b = Builder().one("a").one("b").zero("n").bond("a", "b").bond("b", "n").bond("n", "a")
    graph = b.on("a", I("m", 2.0), Se("u", 1.0)).on("b", R("r", 4.0)).on("n", R("s", 1.0), R("q", 3.0)).build()
    assert_allclose(Dynamics(graph).rates(0.0, 3.0), [1.0 - 4.0 * 1.5], rtol=1e-15)


def test_a_loop_without_a_solution_is_refused_alike_by_every_call():
    graph = Builder().zero("n").on("n", R("d", -1.0), R("s", 1.0), I("m", 1.0)).build()
    calls = (Dynamics, lambda g: simulate(g, 1.0), equilibrium, linearize, state_equations, to_modelica)
    for call in calls:
        with pytest.raises(GraphError, match=r"^the loop of R:d \(bond 1\), R:s \(bond 2\) has no solution"):
            call(graph)


def test_a_law_without_a_solution_is_given_up_after_few_evaluations():
    """u = f^2 + 1 has none below u = 1: a search that halves its steps for ever took 22 s where a motion comes to that."""
    calls = []

    def law(f):
        calls.append(f)
        return f**2 + 1.0 if f > -1e300 else 1.0  # a branch: it stays a call, which counts

    graph = Builder().one("a").on("a", Se("u", lambda t: 2.0 - t), R("d", law), C("k", 1e6)).build()
    rates = Dynamics(graph).rates
    assert_allclose(rates(0.5, 0.0), [0.5**0.5], rtol=1e-10)
    calls.clear()
    with pytest.raises(GraphError, match=r"^no value solves the law of R:d \(bond 2\): sought from"):
        rates(1.5, 0.0)
    assert len(calls) < 2000


def ladder(rungs):
    b = Builder().one("s0").on("s0", Se("E", 1.0), R("Rs0", 1.0))
    for k in range(1, rungs + 1):
        b.zero(f"n{k}").bond(f"s{k - 1}", f"n{k}").on(f"n{k}", R(f"Rp{k}", 1.0))
        b.one(f"s{k}").bond(f"n{k}", f"s{k}").on(f"s{k}", R(f"Rs{k}", 1.0))
    return b.on(f"s{rungs}", C("c", 1.0)).build()


@pytest.mark.parametrize(("rungs", "most"), sample(((1, 15), (2, 45), (3, 150)), 3))
def test_a_ladder_of_resistors_is_one_fraction(rungs, most):
    """Of equal resistors, Thevenin's source and resistance by halving step by step."""
    result = state_equations(ladder(rungs), values=True)
    source, resistance = sympy.Integer(1), sympy.Integer(1)
    for _ in range(rungs):
        source, resistance = source / (1 + resistance), resistance / (1 + resistance) + 1
    assert sympy.simplify(result.derivatives[0] - (source - sympy.Symbol("q_c")) / resistance) == 0
    assert sympy.count_ops(state_equations(ladder(rungs)).derivatives[0]) <= most


@pytest.mark.parametrize("rungs", [5, pytest.param(9, marks=pytest.mark.slow)])
def test_a_long_ladder_takes_a_few_steps_a_rung(rungs):
    """Of equal resistors, Thevenin's source and resistance by halving step by step."""
    graph = ladder(rungs)
    result = state_equations(graph)
    source, resistance = sympy.Integer(1), sympy.Integer(1)
    for _ in range(rungs):
        source, resistance = source / (1 + resistance), resistance / (1 + resistance) + 1
    expected = [float((source - sympy.Rational(7, 10)) / resistance)]
    assert_allclose(result.numeric()(0.0, [0.7]), expected, rtol=1e-13)
    shared, (rate,) = result.sequence()
    assert sum(map(sympy.count_ops, [rate, *(e for _, e in shared)])) <= 16 * rungs
    for symbol, value in reversed(shared):
        rate = rate.xreplace({symbol: value})
    assert_allclose(float(rate.subs(result.values).subs({"q_c": 0.7})), expected[0], rtol=1e-13)


def test_an_initial_value_is_told_what_is_meant():
    b = Builder().one("m", displacement="x").on("m", I("Jm", 2.0), I("follower", 3.0))
    with pytest.raises(GraphError, match=r"initial 'Jm': no such state; give p_Jm; the independent ones are p_Jm, x"):
        simulate(b.build(), 1.0, initial={"Jm": 2.0})
    follows = r"initial 'p_follower': found 5, but I:follower follows I:Jm, which makes it 6 \(difference 1\)"
    with pytest.raises(GraphError, match=follows):
        simulate(b.build(), 1.0, initial={"m": 2.0, "p_follower": 5.0})
    run = simulate(b.build(), 1.0, initial={"m": 2.0, "p_follower": 6.0})
    assert_allclose(run.displacement("x", 1.0), 2.0, rtol=1e-12)


def test_the_flow_of_a_junction_starts_the_store_that_settles_it_through_a_gear():
    b = Builder().one("motor").one("wheel").on("motor", Se("M", 0.0)).on("wheel", I("J", 2.0))
    run = simulate(b.transform("motor", "wheel", 0.25).build(), 1.0, initial={"motor": 8.0})
    assert_allclose(run.states(0.0)["p_J"], 4.0, rtol=1e-15)


# Laws that read the motion, and resistors that heat.


def test_a_series_motors_constant_is_its_own_current():
    b = Builder().one("arm").one("rot").on("arm", Se("U", 10.0), R("R", 1.0), I("L", 0.1))
    b.on("rot", I("J", 0.02), R("b", 0.01))
    graph = b.gyrate("arm", "rot", lambda f_arm: 0.5 * f_arm, name="k").build()
    assert_allclose(Dynamics(graph).rates(0.0, 0.2, 0.06), [10.0 - 2.0 - 1.0 * 3.0, 1.0 * 2.0 - 0.03], rtol=1e-14)
    assert_allclose(state_equations(graph).numeric()(0.0, [0.2, 0.06]), [5.0, 1.97], rtol=1e-14)
    run = simulate(graph, 1.0)
    assert run.audit.power < 1e-14
    assert run.audit.energy < 1e-12


def test_eulers_body_keeps_its_energy_and_angular_momentum():
    b = Builder()
    for name, inertia in (("x", 1.0), ("y", 2.0), ("z", 3.0)):
        b.one(name).on(name, I(f"J{name}", inertia))
    b.gyrate("x", "y", lambda p_Jz: p_Jz).gyrate("y", "z", lambda p_Jx: p_Jx).gyrate("z", "x", lambda p_Jy: p_Jy)
    run = simulate(b.build(), 5.0, initial={"x": 1.0, "y": 0.1, "z": 0.3}, rtol=1e-9)
    assert_allclose(run.dynamics.rates(0.0, 1.0, 2.0, 3.0), [-1.0, 2.0, -1.0], rtol=1e-14)  # p' = p x omega
    assert_allclose((run.ends**2).sum(axis=1), 1.0 + 0.04 + 0.81, rtol=1e-9)
    assert run.audit.energy < 1e-9


def test_a_controller_reads_a_flow_and_an_effort():
    b = Builder().one("m").on("m", I("M", 2.0), Se("F", lambda f_m, e_node: 1.0 - 3.0 * f_m + e_node)).zero("node")
    graph = b.bond("m", "node").on("node", C("c", 0.5)).build()
    assert_allclose(Dynamics(graph).rates(0.0, 4.0, 0.7), [1.0 - 6.0 + 1.4 - 1.4, 2.0], rtol=1e-14)
    assert simulate(graph, 2.0).audit.energy < 1e-9


def test_a_law_reads_what_a_resistor_settles_after_it_is_settled():
    """Two resistors in series, and a source beside them that reads the effort between."""
    b = Builder().one("line").zero("mid").bond("line", "mid").on("line", Se("U", 6.0), R("a", 1.0)).on("mid", R("b", 2.0))
    graph = b.one("m").on("m", I("M", 1.0), Se("F", lambda e_mid: 10.0 * e_mid)).build()
    assert_allclose(Dynamics(graph).rates(0.0, 0.0), [40.0], rtol=1e-14)


def test_a_source_that_reads_a_loop_by_no_straight_line_is_solved_in_numbers_and_refused_in_symbols():
    """x = 3 - e^2/10 by the effort of the node: 0.1 e^2 + 1.5 e - 2.3 = 0 at a flow of 0.7 behind it."""
    b = Builder().one("a").zero("n").one("c").bond("a", "n").bond("n", "c")
    b = b.on("a", Se("x", lambda e_n: 3.0 - 0.1 * e_n**2), R("r", 1.0)).on("n", R("l", 2.0))
    graph = b.on("c", R("s", 1.0), I("m", 1.0)).build()
    effort = (np.sqrt(2.25 + 0.92) - 1.5) / 0.2
    for rates in (Dynamics(graph).rates(0.0, 0.7), Dynamics(graph).at(0.0, [np.array([0.7])]).rates):
        assert_allclose(np.ravel(rates), [effort - 0.7], rtol=1e-13)
    with pytest.raises(GraphError, match=r"^MSe:x \(bond 3\): its law is not linear, and no formula solves the loop"):
        state_equations(graph)
    assert_allclose(linearize(graph, at={"p_m": 0.7}).A, [[-1.0 - 1.0 / (1.5 + 0.2 * effort)]], rtol=1e-12)


def test_a_straight_line_that_follows_is_turned_round_and_a_curve_is_refused_in_symbols():
    """Two capacitors on a node, e = q + 3 and e = 4 q - 1 or 4 q^3: one state."""
    b = Builder().zero("n").one("s").bond("s", "n").on("s", Se("u", 3.0), R("r", 2.0)).on("n", C("a", lambda q: q + 3.0))
    line = b.on("n", C("b", lambda q: 4.0 * q - 1.0)).build()
    (rate,) = state_equations(line).derivatives
    q, u, r = sympy.symbols("q_a u r")
    assert sympy.simplify(rate - (u - q - 3) / r * sympy.Rational(4, 5)) == 0
    assert_allclose(Dynamics(line).rates(0.0, 0.7), [(3.0 - 3.7) / 2.0 * 0.8], rtol=1e-14)
    curve = line.with_law("b", lambda q: 4.0 * q**3)
    with pytest.raises(GraphError, match=r"C:b \(bond 5\): its law is not linear, and no formula gives its displacement"):
        state_equations(curve)
    led = state_equations(curve, causality=causality(curve, {"a": "derivative"}))
    assert [str(s) for s in led.states] == ["q_b"]


def test_a_loop_with_several_solutions_says_which_one_is_kept():
    """f^3 - 3 f = 1 at 2 cos 20, -2 cos 40 and -2 cos 80 degrees."""
    b = Builder().one("a").on("a", Se("u", 1.0), R("r", lambda f: f**3 - 3.0 * f))
    result = simulate(b.build(), 1.0)
    (line,) = result.messages
    first = "R:r (bond 2): the flow of R:r has several solutions, -1.53209, -0.347296, 1.87939, sought from 0.001, 1, -0.001"
    assert line.startswith(first)
    assert line.endswith(f"the motion begins with {result.flow('a')[0]:.6g}")


def test_a_loop_is_solved_from_whichever_start_leads_there():
    """f^3 - 3 f = u has one solution beyond +-2, which Newton's method does not find from everywhere."""
    for u in (3.0, -3.0, 40.0, -40.0):
        b = Builder().one("a").on("a", Se("u", u), R("r", lambda f: f**3 - 3.0 * f)).zero("n").bond("a", "n")
        dynamics = Dynamics(b.on("n", C("c", 1.0)).build())
        (flow,) = (root.real for root in np.roots([1.0, 0.0, -3.0, -u]) if abs(root.imag) < 1e-9)
        for rates in (dynamics.rates(0.0, 0.0), dynamics.at(0.0, [np.zeros(2)]).rates):
            assert_allclose(np.ravel(rates), flow, rtol=1e-12)


@pytest.mark.slow
def test_a_loop_without_a_solution_is_refused():
    """2 + f^2 = 1 nowhere."""
    none = Builder().one("a").on("a", Se("u", 1.0), R("r", lambda f: 2.0 + f**2)).build()
    with pytest.raises(
        GraphError, match=r"no value solves the law of R:r \(bond 2\): sought from 0.001, 1, -0.001, -1, 1000, -1000 on"
    ):
        simulate(none, 1.0)


def test_a_modulus_may_read_no_flow_that_is_not_a_state():
    b = Builder().one("a").one("b").on("a", Se("U", 1.0), R("r", 1.0)).on("b", I("J", 1.0))
    with pytest.raises(GraphError, match=r"reads f_a, which no store gives from its state: a modulus may read such alone"):
        Dynamics(b.gyrate("a", "b", lambda f_a: f_a, name="k").build()).at(0.0, [1.0])
    b = Builder().one("a").one("b").on("a", I("L", 1.0)).on("b", I("m", 1.0)).transform("a", "b", lambda f_a: f_a, name="T")
    with pytest.raises(GraphError, match="the rate of f_a is needed, for a store follows by it"):
        Dynamics(b.build()).at(0.0, [1.0])


def bodies(joined):
    """Two bodies, T = 300 exp(S/C), joined by a wall."""
    b = Builder().zero("hot", "thermal").zero("cold", "thermal").one("wall", "thermal")
    b.bond("hot", "wall").bond("wall", "cold").on("wall", joined)
    for name, capacity in (("hot", 50.0), ("cold", 80.0)):
        b.on(name, C(f"C_{name}", lambda q, capacity=capacity: 300.0 * np.exp(q / capacity)))
    return b.bond("wall.k", "cold").build() if joined.kind == "RS" else b.build()


def test_heat_that_goes_from_body_to_body_is_neither_made_nor_lost():
    run = simulate(bodies(RS("wall.k", 2.0)), 500.0, initial={"C_hot": 10.0})
    heat = [300.0 * c * np.expm1(run.displacement(f"C_{n}") / c) for n, c in (("hot", 50.0), ("cold", 80.0))]
    assert_allclose(heat[0] + heat[1], heat[0][0], rtol=1e-9)
    temperatures = [300.0 * np.exp(run.displacement(f"C_{n}", 500.0) / c) for n, c in (("hot", 50.0), ("cold", 80.0))]
    assert_allclose(temperatures[0], temperatures[1], rtol=1e-6)
    assert run.messages == ()
    (line,) = simulate(bodies(R("wall.k", 2.0)), 1.0, initial={"C_hot": 10.0}).messages
    assert line.startswith("R:wall.k (bond 3) removes power from a thermal network, but heat cannot vanish: give it as RS")


def test_a_brake_heats_its_drum_by_all_that_the_wheel_loses():
    b = Builder().one("wheel", "rotation").zero("drum", "thermal")
    b.on("wheel", I("J", 2.0), RS("rub", lambda f: 0.3 * f + f**3))
    graph = b.bond("rub", "drum").on("drum", C("heat", lambda q: 300.0 * np.exp(q / 50.0))).build()
    run = simulate(graph, 3.0, initial={"wheel": 4.0}, rtol=1e-10)
    kept = 0.5 * 2.0 * run.flow("wheel") ** 2 + 300.0 * 50.0 * np.expm1(run.displacement("heat") / 50.0)
    assert_allclose(kept, 16.0, rtol=1e-9)
    with pytest.raises(GraphError, match=r'RS:rub: found 1 bonds, expected two: .* as bond\("rub", BODY\)'):
        Builder().one("wheel").on("wheel", I("J", 2.0), RS("rub", 1.0)).build()


def test_a_domain_without_momentum_has_no_inertia():
    b = Builder().one("a", "thermal").on("a", I("m", 1.0), Se("T", 300.0))
    with pytest.raises(GraphError, match=r"I:m \(bond 1\): the thermal domain has no momentum, and so no inertia"):
        b.build()


def test_a_run_and_its_audit_are_told_in_a_few_lines():
    run = simulate(Builder().one("m").on("m", I("M", 2.0), Se("F", 3.0), R("d", 1.0)).build(), 1.0)
    assert repr(run).startswith(f"Run({len(run.stretches)} steps to t = 1 s, p_M, DOP853, error=")
    lines = str(run.audit).splitlines()
    assert [line.split()[0] for line in lines] == ["power:", "energy:", "supplied"]
    assert all(len(line) < 100 for line in lines)


def test_what_long_equations_share_is_written_once():
    result = state_equations(ladder(2))
    shared, rates = result.sequence()
    expression = rates[0]
    for symbol, value in reversed(shared):
        expression = expression.xreplace({symbol: value})
    assert sympy.simplify(expression - result.derivatives[0]) == 0
    lines = result.text(sequential=True).splitlines()
    assert lines[0].startswith("z1 = ")
    assert lines[len(shared)].startswith("dq_c/dt = ")
    assert sum(sympy.count_ops(e) for _, e in shared) + sympy.count_ops(rates[0]) < sympy.count_ops(result.derivatives[0])


def test_a_chain_of_fifty_masses_has_its_equations_term_by_term():
    b = Builder()
    for k in range(50):
        b.one(f"v{k}").on(f"v{k}", I(f"m{k}", 1.0 + k), R(f"r{k}", 0.1))
        if k:
            b.between(f"v{k - 1}", f"v{k}", C(f"c{k}", 0.5))
    result = state_equations(b.build())
    assert len(result.states) == 99
    p, q, m, c, r = (sympy.Symbol(name) for name in ("p_m0", "q_c1", "m0", "c1", "r0"))
    assert result.derivatives[0] == -p * r / m - q / c


def test_heat_flows_through_pseudo_bonds_outside_the_audit():
    """A brake heats its drum: C T' = M w - (T - 293)/h; w' = (3 - w/2)/2."""
    b = Builder().one("shaft", "rotation").zero("drum", "heat").one("out", "heat").zero("room", "heat")
    b.on("shaft", I("J", 2.0), Se("M", 3.0), RS("rub", 0.5)).bond("rub", "drum").on("drum", C("Cb", 50.0))
    graph = b.bond("drum", "out").on("out", R("h", 0.2)).bond("out", "room").on("room", Se("T0", 293.0)).build()
    run = simulate(graph, 20.0, initial={"q_Cb": 50 * 293.0})
    truth = solve_ivp(
        lambda t, y: [(3.0 - 0.5 * y[0]) / 2.0, (0.5 * y[0] ** 2 - (y[1] - 293.0) / 0.2) / 50.0],
        (0, 20.0),
        [0.0, 293.0],
        method="DOP853",
        rtol=1e-11,
        atol=1e-10,
    ).y[:, -1]
    assert_allclose([run.flow("shaft", 20.0)[0], run.states(20.0)["q_Cb"][0] / 50.0], truth, rtol=1e-9)
    assert run.audit.energy < 1e-9
    assert_allclose(run.audit.supplied[-1] - run.audit.dissipated[-1], truth[0] ** 2, rtol=1e-8)  # the shaft's alone
    assert "bonds 4, 5, 6, 7, 8, 9 carry temperature and heat flow, which is no power" in run.messages[0]
    assert run.audit.power_at in graph.elements
    with pytest.raises(GraphError, match="TF:a->b joins heat, whose bonds carry no power, to another domain"):
        Builder().zero("a", "heat").zero("b", "thermal").on("a", C("c", 1.0)).on("b", C("d", 1.0)).transform(
            "a", "b", 1.0
        ).build()
