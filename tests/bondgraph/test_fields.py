"""Fields: several ports of one matrix or of one energy, against Kirchhoff and Lagrange by hand."""

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from bondgraph import (
    Builder,
    C,
    Dynamics,
    GraphError,
    I,
    R,
    Se,
    Sf,
    as_data,
    from_data,
    linearize,
    simulate,
    state_equations,
)

INDUCTANCE = np.array([[2.0, 1.0], [1.0, 3.0]])


def coils(second, inductance=INDUCTANCE):
    b = Builder().one("a", "electric").one("b", "electric").on("a", Se("u", 5.0), R("r1", 0.5)).on("b", second)
    return b.field(I("coils", inductance), "a", "b").build()


def test_coupled_coils_are_kirchhoffs():
    """L i' = u - R i."""
    graph = coils(R("r2", 0.7))
    result = linearize(graph, outputs=["f_a", "f_b"])
    assert result.states == ("p_coils_1", "p_coils_2")
    inverse = np.linalg.inv(INDUCTANCE)
    assert_allclose(result.A, -np.diag([0.5, 0.7]) @ inverse, rtol=1e-15)
    assert_allclose(result.C, inverse, rtol=1e-15)
    run = simulate(graph, 40.0)
    assert_allclose([run.flow("a", 40.0)[0], run.flow("b", 40.0)[0]], [10.0, 0.0], atol=1e-2)
    assert run.audit.energy < 1e-12


def test_a_coil_whose_current_is_given_follows_and_induces():
    """p1 = L11 i1 + L12 i(t); the second voltage is L12 i1' + L22 i'."""
    graph = coils(Sf("i", lambda t: np.sin(t)))
    run = simulate(graph, 3.0)
    assert run.dynamics.names == ("p_coils_1",)
    truth = solve_ivp(lambda t, p: 5.0 - 0.5 * (p - np.sin(t)) / 2.0, (0, 3.0), [0.0], method="DOP853", rtol=1e-12)
    current = (truth.y[0, -1] - np.sin(3.0)) / 2.0
    assert_allclose(run.flow("a", 3.0), current, rtol=1e-8)
    slope = (5.0 - 0.5 * current - np.cos(3.0)) / 2.0
    assert_allclose(run.effort(graph.bond_of("coils_2").number, 3.0), slope + 3.0 * np.cos(3.0), rtol=1e-8)
    assert run.audit.energy < 1e-9
    assert "I:coils_2 (bond 5) follows MSf:i" in state_equations(graph).text()


def test_a_port_that_follows_keeps_its_own_displacement():
    """q = S e of both ports, one of which lies beside a capacitor."""
    b = Builder().one("a").zero("n").bond("a", "n").on("a", Se("u", 1.0), R("r", 2.0)).on("n", C("c", 3.0)).one("k")
    b.on("k", R("s", 1.0), Se("v", 0.3)).zero("m").bond("k", "m")
    graph = b.field(C("F", [[2.0, 1.0], [1.0, 3.0]]), "n", "m").build()
    run = simulate(graph, 2.0)
    efforts = [run.effort(graph.bond_of(f"F_{k}").number, 2.0)[0] for k in (1, 2)]
    charges = [run.displacement(f"F_{k}", 2.0)[0] for k in (1, 2)]
    assert_allclose(charges, np.array([[2.0, 1.0], [1.0, 3.0]]) @ efforts, rtol=1e-12)


def test_a_port_that_no_other_acts_on_is_a_plain_store():
    b = Builder().one("a").on("a", Se("u", 1.0)).field(I("F", [[9.0, 0.0], [0.0, 4.0]]), "a", "a")
    assert [b.build().constant(f"F_{k}") for k in (1, 2)] == [9.0, 4.0]


def test_ports_that_only_rounding_ties_stay_apart():
    """Ports 2 and 3 follow port 1; C13 = 0, which its inverse has to rounding: q1' = (C k)_1 e', e = k e1."""
    matrix, k = np.array([[11.0, -2.0, 0.0], [-2.0, 14.0, 6.0], [0.0, 6.0, 7.0]]), np.array([1.0, 0.4, 0.4 / -0.7])
    b = Builder().zero("n0").zero("n1").zero("n2").transform("n0", "n1", 2.5).transform("n1", "n2", -0.7)
    graph = b.field(C("F", matrix), "n0", "n1", "n2").on("n0", R("r", 0.5), Sf("u", 1.0)).build()
    first, whole = (matrix @ k)[0], k @ matrix @ k
    rate = first * (1.0 - 1.3 / first / 0.5) / whole
    assert_allclose(state_equations(graph).numeric()(0.0, [1.3]), [rate], rtol=1e-13)
    assert_allclose(Dynamics(graph).rates(0.0, 1.3), [rate], rtol=1e-13)


def test_an_inertia_that_follows_two_ports_has_the_same_rates_in_symbols():
    """With e the effort of n and f = -(f2 + f3 + f_m) of x: e + u = r f + o f', f2' + f3' from K p' = K (-q/C, e, e)."""
    b = Builder().one("a").zero("n").one("x").bond("n", "x").on("a", C("C", 0.25))
    b.field(I("F", [[8.0, -6.0, -3.0], [-6.0, 10.0, 0.0], [-3.0, 0.0, 11.0]]), "a", "n", "n").on("n", I("m", 2.3))
    graph = b.on("x", I("o", 0.7), R("r", 1.3), Se("u", 1.0)).build()
    K, p, q, m = (
        np.linalg.inv([[8.0, -6.0, -3.0], [-6.0, 10.0, 0.0], [-3.0, 0.0, 11.0]]),
        np.array([0.3, 0.4, 0.5]),
        0.6,
        0.7,
    )
    both, flow = K[1] + K[2], -((K[1] + K[2]) @ p + m / 2.3)
    effort = (-1.0 + 1.3 * flow + 0.7 * both[0] * q / 0.25) / (1.0 + 0.7 * (both[1] + both[2] + 1.0 / 2.3))
    by_name = {"p_F_1": p[0], "p_F_2": p[1], "p_F_3": p[2], "q_C": q, "p_m": m}
    rates = {"p_F_1": -q / 0.25, "p_F_2": effort, "p_F_3": effort, "q_C": K[0] @ p, "p_m": effort}
    names = Dynamics(graph).names
    expected, state = [rates[name] for name in names], [by_name[name] for name in names]
    assert_allclose(Dynamics(graph).rates(0.0, *state), expected, rtol=1e-13)
    assert_allclose(state_equations(graph).numeric()(0.0, state), expected, rtol=1e-12)


def test_ports_in_series_are_one_store():
    """Two coils that aid each other: L11 + L22 + 2 L12; two that one flow drives against each other: - 2 L12."""
    graph = Builder().one("a").on("a", Se("u", 1.0)).field(I("coils", INDUCTANCE), "a", "a").build()
    assert_allclose(linearize(graph, at={}, outputs=["f_a"]).transfer("u", "f_a")[0][-1], 1.0 / 7.0, rtol=1e-14)
    b = Builder().one("a").one("b").on("a", Se("u", 1.0)).transform("a", "b", -1.0).field(I("coils", INDUCTANCE), "a", "b")
    assert_allclose(linearize(b.build(), at={}, outputs=["f_a"]).transfer("u", "f_a")[0][-1], 1.0 / 3.0, rtol=1e-14)


def test_an_inertia_beside_a_field_is_folded_in():
    """The mass of the second coil's circuit follows: (L + diag(0, 4)) i' = u - R i."""
    graph = coils(I("more", 4.0))
    result = linearize(graph, at={}, outputs=["f_a", "f_b"])
    matrix = INDUCTANCE + np.diag([0.0, 4.0])
    assert_allclose(
        sorted(result.poles), sorted(np.linalg.eigvals(-np.linalg.inv(matrix) @ np.diag([0.5, 0.0]))), atol=1e-14
    )


def test_entries_may_be_expressions_of_parameters():
    L1, L2, M, p1, p2, r1, r2, u = sympy.symbols("L1 L2 M p_coils_1 p_coils_2 r1 r2 u")
    b = (
        Builder()
        .parameter(L1=2.0, L2=3.0, M=None)
        .one("a")
        .one("b")
        .on("a", Se("u", 5.0), R("r1", 0.5))
        .on("b", R("r2", 0.7))
    )
    graph = b.field(I("coils", sympy.Matrix([[L1, M], [M, L2]])), "a", "b").build()
    result = state_equations(graph).derivatives
    whole = L1 * L2 - M**2
    assert sympy.simplify(result[0] - u + r1 * (L2 * p1 - M * p2) / whole) == 0
    assert sympy.simplify(result[1] + r2 * (L1 * p2 - M * p1) / whole) == 0
    assert_allclose(linearize(graph.with_parameters(M=1.0)).A, linearize(coils(R("r2", 0.7))).A, rtol=1e-14)


def test_a_condenser_microphone_keeps_its_energy():
    """E = q^2 (g - x)/(2 c): the voltage is q (g - x)/c, the force on the plate -q^2/(2 c)."""
    b = Builder().parameter(g=1.0, c=3.0).one("n", "electric").one("plate", "translation")
    b.on("n", Se("E", 2.0), R("r", 3.0)).on("plate", I("m", 0.5), C("k", stiffness=4.0), R("d", 0.2))
    b.on("plate", Se("sound", lambda t: 0.1 * np.sin(t)))
    graph = b.field(C("mic", energy=lambda q, x, g, c: q**2 * (g - x) / (2 * c)), q="n", x="plate").build()
    run = simulate(graph, 5.0, initial={"q_mic_q": 1.0}, rtol=1e-10)

    def rates(t, y):
        p, q, x = y
        return [0.1 * np.sin(t) - 4.0 * x - 0.2 * p / 0.5 + q * q / 6.0, (2.0 - q * (1.0 - x) / 3.0) / 3.0, p / 0.5]

    truth = solve_ivp(rates, (0, 5.0), [0.0, 1.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    states = run.states(5.0)
    assert_allclose([states[n][0] for n in ("p_m", "q_mic_q", "q_mic_x")], truth, rtol=1e-9)
    assert run.audit.energy < 1e-9
    assert str(state_equations(from_data(as_data(graph))).text()) == state_equations(graph).text()


def test_a_solenoid_has_a_momentum_and_a_displacement():
    """E = p^2 (1 + x)/(2 L): the current is its slope by the linkage p, the force that by x; both ways round, as a C too."""
    b = Builder().one("coil", "electric").one("plunger", "translation").on("coil", Se("u", 2.0), R("r", 1.0))
    b.on("plunger", I("m", 0.2), C("k", stiffness=50.0), R("d", 0.3))
    graph = b.field(I("sol", energy=lambda p, x: p**2 * (1 + x) / (2 * 0.5)), p="coil", x="plunger").build()
    assert graph.elements["sol_p"].kind == "I"
    assert graph.elements["sol_x"].kind == "C"
    p, x, d, k, m, p_m, q_k, r, u = sympy.symbols("p_sol_p q_sol_x d k m p_m q_k r u")
    expected = [-d * p_m / m - p**2 - q_k / k, p_m / m, -2.0 * p * r * (x + 1) + u, p_m / m]
    result = state_equations(graph)
    assert [str(s) for s in result.states] == ["p_m", "q_k", "p_sol_p", "q_sol_x"]
    assert [sympy.expand(sympy.nsimplify(a - b)) for a, b in zip(result.derivatives, expected, strict=True)] == [0] * 4
    run = simulate(graph, 3.0)
    assert run.audit.energy < 1e-9
    magnetic = (
        Builder().one("coil").one("iron").one("plunger").on("coil", Se("u", 2.0), R("r", 1.0)).gyrate("coil", "iron", 10.0)
    )
    magnetic.on("plunger", I("m", 0.2), C("k", stiffness=50.0), R("d", 0.3))
    magnetic.field(C("gap", energy=lambda phi, x: 100 * phi**2 * (1 + x)), phi="iron", x="plunger")
    again = simulate(magnetic.build(), 3.0)
    assert_allclose(again.flow("plunger", 3.0), run.flow("plunger", 3.0), rtol=1e-6)


def test_a_resistor_field_may_gyrate_but_makes_no_power():
    """e = (S + A) f: the turned part of the matrix takes none."""
    matrix = np.array([[1.0, 2.0], [-2.0, 0.5]])
    b = Builder().one("a").one("b").on("a", Se("u", 3.0), I("J", 1.0)).on("b", I("K", 2.0))
    flows = -matrix @ np.diag([1.0, 0.5])
    assert_allclose(linearize(b.field(R("r", matrix), "a", "b").build()).A, flows, rtol=1e-14)
    b = Builder().zero("a").zero("b").on("a", Sf("i", 3.0), C("c", 1.0)).on("b", C("k", 2.0))
    graph = b.field(R("r", matrix), "a", "b").build()
    conductance = -np.linalg.inv(matrix) @ np.diag([1.0, 0.5])
    assert_allclose(linearize(graph).A, conductance, rtol=1e-14)
    run = simulate(graph, 4.0)
    assert run.audit.power < 1e-12
    assert run.audit.energy < 1e-12


def test_a_law_of_its_flow_is_turned_round_for_its_effort_in_symbols_too():
    b = Builder().zero("a").one("s").bond("s", "a").on("a", C("c", 1.0)).on("s", Se("u", 2.0), R("d", lambda f: 3.0 * f))
    assert state_equations(b.build()).numeric()(0.0, [0.5]) == [0.5]


def hung(element, *junctions, **ports):
    b = Builder().parameter(g=1.0).one("a").one("b").on("a", Se("u", 1.0), R("r1", 1.0)).on("b", R("r2", 1.0))
    return b.field(element, *junctions, **ports).build()


WRONG = [
    (lambda: hung(C("c", [[1, 2], [3, 4]]), "a", "b"), r"C:c: found 3.0 in row 2, column 1 of its matrix and 2.0 in row 1"),
    (lambda: hung(I("c", [[1, 2], [3]]), "a", "b"), r"I:c: found rows of 2, 1 entries, expected a square matrix"),
    (lambda: hung(C("c", [[1, 0], [0, 1]]), "a"), r"C:c: found 1 ports for a matrix of 2 rows, expected 2"),
    (
        lambda: hung(R("c", [[1, 5], [0.5, 2]]), "a", "b"),
        r"R:c: its matrix has the eigenvalue -1.29508 in its symmetric part",
    ),
    (lambda: hung(C("c", [[1, 1], [1, 1]]), "a", "b"), r"C:c: its matrix is singular"),
    (
        lambda: hung(C("c", energy=lambda q, z: q * z), q="a"),
        r"C:c: its energy depends on 'z', which is neither one of its ports \(q\)",
    ),
    (lambda: hung(C("c", energy=lambda q: q * q), q="a", x="b"), r"C:c: its energy is no function of the port 'x'"),
    (lambda: hung(C("c", energy=lambda q, x: q * q), q="a", x="b"), r"C:c: its energy is no function of the port 'x'"),
    (lambda: hung(C("c", energy=lambda q, x: q if x > 0 else x), q="a", x="b"), r"C:c: its energy cannot be written as a"),
    (lambda: hung(C("c", 2.0), "a", "b"), r"C:c: found 2.0, expected a matrix, or energy="),
    (lambda: hung(C("c", energy=lambda q, x: q * q * x), "a", "b", "a"), r"C:c: found 3 junctions for 2 ports \(q, x\)"),
    (lambda: hung(C("c", [[1, np.nan], [0, 1]]), "a", "b"), r"C:c: found a matrix with entries that are not finite"),
    (lambda: Builder().one("a").on("a", C("c", [[1, 0], [0, 1]])), r"C:c has several ports: attach it .* by field"),
    (lambda: C("c", 1.0, energy=lambda q: q), r"C:c: found a law and an energy, expected one of them"),
    (
        lambda: simulate(
            Builder()
            .one("a")
            .one("b")
            .on("a", Se("u", 1.0))
            .on("b", Sf("v", 1.0))
            .field(I("c", energy=lambda p1, p2: p1**2 + p2**4 + p1 * p2), "a", "b")
            .build(),
            1.0,
        ),
        r"I:c_p1 \(bond 3\), I:c_p2 \(bond 4\) share one energy, and one of them follows other stores or sources",
    ),
]


@pytest.mark.parametrize(("wrong", "match"), WRONG)
def test_what_is_no_field_is_named(wrong, match):
    with pytest.raises(GraphError, match=match) as caught:
        wrong()
    assert len(str(caught.value).splitlines()) == 1
