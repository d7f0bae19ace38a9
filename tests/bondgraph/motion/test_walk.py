"""One walk on floats, on arrays and recorded gives the same; states, signals and starts by name."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import Builder, C, GraphError, I, Law, Modulus, Motion, R, Se, Sf
from bondgraph.motion.dynamics import Dynamics

t, u, theta, f = sympy.symbols("t u theta f")


def coil_and_shaft():
    b = Builder().one("coil", "electric").one("shaft", "rotation", displacement="theta")
    return b.on("coil", Se("V", 3.0), R("Ra", 2.0)).on("shaft", I("J", 0.5), R("b", 0.1))


def modulated_gyrator():
    b = coil_and_shaft().on("coil", I("L", 0.1)).gyrate("coil", "shaft", lambda theta: 1 + 0.5 * np.sin(theta))
    return b.on("shaft", R("brake", lambda f, theta: 0.1 * f * (1 + theta**2)))


def no_inductance():
    return coil_and_shaft().gyrate("coil", "shaft", 0.7)


def two_gyrators():
    b = coil_and_shaft().one("middle").on("middle", R("r", 1.0)).on("coil", I("L", 0.1))
    return b.gyrate("coil", "middle", 2.0).gyrate("middle", "shaft", 4.0)


def algebraic_loop():
    b = Builder().one("a").one("b").one("mass", displacement="x").on("mass", I("m", 2.0)).on("a", Se("F", 3.0), R("ra", 1.0))
    return b.on("b", R("rb", 2.0)).between("a", "b", R("ab", 3.0)).between("b", "mass", R("bm", 0.5), C("k", stiffness=4.0))


def bent_resistor_without_mass():
    b = Builder().one("mass").one("end", displacement="x").on("mass", I("m", 2.0), C("k0", stiffness=3.0))
    return b.between("mass", "end", C("k", stiffness=5.0)).on("end", R("d", lambda f: f * np.abs(f) + f**3))


def springs_in_series():
    b = Builder().one("mass").one("end").on("mass", I("m", 2.0)).between("mass", "end", C("k1", lambda q: q + q**3))
    return b.on("end", C("k2", stiffness=3.0))


def parallel_capacitors():
    b = Builder().zero("node").one("line").bond("line", "node").on("line", Se("E", lambda t: 5 + t), R("Rs", 2.0))
    return b.on("node", C("c1", 0.1), C("c2", 0.3), R("leak", 10.0))


def driven_mechanism():
    b = Builder().one("crank", displacement="theta").one("ram").transform("crank", "ram", sympy.sin(theta) + 2)
    return b.on("ram", I("m", 1.0), R("r", 1.0)).on("crank", Sf("w", lambda t: np.cos(3 * t)))


def modulus_of_time():
    b = Builder().signal("u").one("a").one("b", displacement="x").on("a", I("m", 1.0), Se("F", lambda u: u))
    return b.transform("a", "b", lambda u, t: 2 + np.sin(u) * t).on("b", I("M", 2.0), R("r", sympy.sqrt(1 + u**2) * f))


def by_closure():
    """A four-bar: rod's and rocker's speeds from two loop equations."""
    b = Builder().one("crank", "rotation", displacement="theta").one("rod", "rotation", displacement="phi", initial=0.3)
    b.one("rocker", "rotation", displacement="psi", initial=1.2).zero("x", "translation").zero("y", "translation")
    for name, angle, length in (("crank", "theta", 0.2), ("rod", "phi", 0.6), ("rocker", "psi", -0.5)):
        symbol = sympy.Symbol(angle)
        b.transform(name, "x", -length * sympy.sin(symbol)).transform(name, "y", length * sympy.cos(symbol))
    return b.on("crank", I("J", 0.1), Se("M", 1.0)).on("rod", I("K", 0.2)).on("rocker", I("L", 0.3), R("r", 0.4))


GALLERY = [
    modulated_gyrator, no_inductance, two_gyrators, algebraic_loop, bent_resistor_without_mass, springs_in_series,
    parallel_capacitors, driven_mechanism, modulus_of_time, by_closure,
]  # fmt: skip
SIGNALS = {"u": lambda t: t * t}


@pytest.mark.parametrize("make", GALLERY)
def test_floats_arrays_and_recordings_give_the_same_rates(make):
    graph = make().build()
    dynamics = Dynamics(graph, {name: SIGNALS[name] for name in graph.signals})
    rng = np.random.default_rng(5)
    times, states = rng.uniform(0.1, 1.0, 6), rng.uniform(0.2, 1.0, (len(dynamics.state.names), 6))
    together = dynamics.at(times, list(states))
    for k, time in enumerate(times.tolist()):
        values = states[:, k].tolist()
        alone = dynamics.at(time, values)
        assert all(isinstance(rate, float) for rate in alone.rates)
        assert_allclose(dynamics.rates(time, *values), alone.rates, rtol=1e-12, atol=1e-12)
        for whole, one in ((together.rates, alone.rates), (together.flows, alone.flows)):
            assert_allclose([np.broadcast_to(v, times.shape)[k] for v in whole], one, rtol=1e-12, atol=1e-12)
        pairs = [(w, o) for w, o in zip(together.efforts, alone.efforts, strict=True) if o is not None]
        assert_allclose(
            [np.broadcast_to(w, times.shape)[k] for w, _ in pairs], [o for _, o in pairs], rtol=1e-12, atol=1e-12
        )


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 6), st.integers(0, 999))
def test_accelerations_of_several_flows_are_those_of_the_mass_matrix(size, seed):
    """Masses m_k on every flow, and one on each sum of two: M = diag(m) + coupling, M u' = F."""
    rng = np.random.default_rng(seed)
    masses, coupled, forces = rng.uniform(0.5, 2.0, size), rng.uniform(0.5, 2.0, size - 1), rng.normal(size=size)
    b, matrix = Builder(), np.diag(masses)
    for k in range(size):
        b.one(f"v{k}").on(f"v{k}", I(f"m{k}", masses[k]), Se(f"F{k}", forces[k]))
    for k in range(size - 1):
        ratio = float(rng.normal())
        b.sum(f"s{k}", [(f"v{k}", 1.0), (f"v{k + 1}", ratio)], "translation").on(f"s{k}", I(f"c{k}", coupled[k]))
        row = np.eye(size)[k] + ratio * np.eye(size)[k + 1]
        matrix = matrix + coupled[k] * np.outer(row, row)
    dynamics = Dynamics(b.build())
    assert dynamics.state.names == tuple(f"f_v{k}" for k in range(size))
    assert_allclose(dynamics.at(0.0, [0.0] * size).rates, np.linalg.solve(matrix, forces), rtol=1e-10, atol=1e-12)


def test_springs_in_series_share_their_rate_by_stiffness():
    dynamics = Dynamics(springs_in_series().build())
    assert dynamics.state.names == ("f_mass", "q_k1", "q_k2")
    stiffness = 1 + 3 * 0.5**2
    share = stiffness / (stiffness + 3.0)
    assert_allclose(dynamics.at(0.0, [2.0, 0.5, 0.2]).rates[1:], [2.0 * (1 - share), 2.0 * share], rtol=1e-14)


def test_a_varying_modulus_takes_its_part_of_the_acceleration():
    """T = 2 + u t with m, M at its ends: (m + T^2 M) a' = F - T T' M a - ..., T' = u' t + u."""
    b = Builder().signal("u").one("a").one("b").on("a", I("m", 1.0)).on("b", I("M", 2.0))
    graph = b.transform("a", "b", lambda u, t: 2 + u * t).build()
    for signal in (lambda t: t * t, t**2):
        ratio, slope = 2 + 0.5**3, 3 * 0.5**2
        rates = Dynamics(graph, {"u": signal}).rates(0.5, 0.7)
        assert_allclose(rates, [-ratio * slope * 2.0 * 0.7 / (1.0 + ratio**2 * 2.0)], rtol=1e-14)


def test_a_flow_source_through_a_mechanism_takes_the_force_that_its_law_needs():
    """T = sin(theta) + 2 driven at w(t): the inertia's effort is m (T w' + T' w^2)."""
    dynamics = Dynamics(driven_mechanism().build())
    instant = dynamics.at(0.4, [0.3])
    flow, rate = np.cos(1.2), -3 * np.sin(1.2)
    (inertia,) = [e for p, e in zip(dynamics.form.ports, instant.efforts, strict=True) if p.element.name == "m"]
    assert_allclose(inertia, (np.sin(0.3) + 2) * rate + np.cos(0.3) * flow**2, rtol=1e-14)


@pytest.mark.parametrize(
    ("law", "inverse"),
    [
        (lambda f: f * np.abs(f), lambda e: np.sign(e) * np.sqrt(np.abs(e))),
        (lambda f: f**3, np.cbrt),
        (lambda f: np.sign(f) * np.sqrt(np.abs(f)), lambda e: e * np.abs(e)),
        (lambda f: 2.0 * np.arctan(50.0 * f) + 0.1 * f, None),
        (f * sympy.Abs(f), lambda e: np.sign(e) * np.sqrt(np.abs(e))),
    ],
    ids=["square", "cube", "root", "saturating", "SymPy"],
)
@pytest.mark.parametrize("effort", [4.0, -300.0, 1e-6, 0.0])
def test_resistors_that_bend_settle_flows_without_inertia(law, inverse, effort):
    graph = Builder().one("a", displacement="x").on("a", Se("E", effort), R("r", law)).build()
    dynamics = Dynamics(graph)
    flow = dynamics.at(0.0, [0.0]).flows[0]
    if inverse is None:
        assert_allclose(2.0 * np.arctan(50.0 * flow) + 0.1 * flow, effort, rtol=1e-9, atol=1e-15)
    else:
        assert_allclose(flow, inverse(effort), rtol=1e-10, atol=1e-15)
    assert_allclose(dynamics.rates(0.0, 0.0), [flow], rtol=1e-10, atol=1e-20)


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
