"""Equations of state and of motion, in symbols and in numbers."""

import re
import shutil
import subprocess

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import (
    Builder,
    C,
    Dynamics,
    GraphError,
    I,
    Law,
    Modulus,
    Motion,
    R,
    Se,
    Sf,
    causality,
    generic,
    generic_equation,
    motion_equation,
    simplify,
    simulate,
    state_equations,
    to_modelica,
)
from bondgraph.elements import exact
from bondgraph.motion.algebra import solve_symmetric
from bondgraph.motion.formulation import Formulation
from bondgraph.twin import Twin, clean, numeric_function
from examples.bond_graphs.planar import Bar, four_bar
from tests.extras import extra
from tests.limits import sample

# What the tests of symbolic equations share: a slider-crank, and whether formulas agree with numbers.


theta = sympy.Symbol("theta")
LAMBDA = sympy.Rational(1, 2)
T = LAMBDA * sympy.sin(2 * theta) / (2 * sympy.sqrt(1 - LAMBDA**2 * sympy.sin(theta) ** 2)) + sympy.sin(theta)


def slider_crank(ratio=T, *more):
    """A crank with M and J, a slider with m, B and F; `more` hangs on the slider."""
    b = Builder().one("crank", "rotation", displacement="theta").one("slider", "translation")
    b.on("crank", Se("M", 3.0), I("J", 2.0)).on("slider", I("m", 1.5), R("B", 0.7), Se("F", -4.0), *more)
    return b.transform("crank", "slider", ratio, name="T")


def equal(a, b):
    return sympy.simplify(a - b) == 0


def agrees(graph, signals=None):
    """Symbolic rates against `Dynamics.rates`, at several states and times, relative to the largest rate."""
    result, dynamics = state_equations(graph), Dynamics(graph, signals)
    assert [str(s) for s in result.states] == [clean(name) for name in dynamics.names]
    numeric = result.numeric(signals)
    rng = np.random.default_rng(1)
    for now in (0.0, 0.7, 1.9):
        states = rng.uniform(0.2, 1.0, len(result.states)).tolist()
        expected = np.array(dynamics.at(now, states).rates, float)
        got = np.array(numeric(now, states))
        assert np.max(np.abs(got - expected)) <= 1e-12 * max(1.0, np.max(np.abs(expected)))
    return result


# Symbolic equations against Lagrange's, against numbers, and what their reading finds.


theta, J, m, B, F, M, k, t = sympy.symbols("theta J m B F M k t")


def lagrange(kinetic, q, qdot, force, dissipation=0):
    """q'' from T(q, q'), generalised force and Rayleigh's dissipation, written down without any bond graph."""
    momentum = sympy.diff(kinetic, qdot)
    right = force - sympy.diff(dissipation, qdot) + sympy.diff(kinetic, q) - sympy.diff(momentum, q) * qdot
    return right / sympy.diff(momentum, qdot)


def test_slider_crank_is_lagranges_equation():
    w = sympy.Symbol("thetadot")
    result = motion_equation(slider_crank().build())
    assert (result.coordinate, result.rate) == (theta, w)
    assert equal(result.inertia, J + m * T**2)
    assert equal(result.slope, 2 * m * T * T.diff(theta))
    assert equal(result.moment, M + T * F - B * T**2 * w)
    expected = lagrange((J + m * T**2) * w**2 / 2, theta, w, M + T * F, B * (T * w) ** 2 / 2)
    assert equal(result.acceleration, expected)


def test_the_opaque_form_is_the_textbooks():
    ratio = sympy.Function("T")
    result = motion_equation(slider_crank().build(), opaque=True)
    angle = sympy.Function("theta")(t)
    rate = ratio(angle)
    left = (J + m * rate**2) * angle.diff(t, 2) + m * rate * rate.diff(angle) * angle.diff(t) ** 2
    assert result.equation == sympy.Eq(left, M + F * rate - B * rate**2 * angle.diff(t))
    assert result.opaque == {ratio(theta): T}
    assert result.latex().count(r"\ddot{\theta}") == 1


def test_the_state_is_the_momentum_of_the_integral_inertia():
    graph = slider_crank().build()
    result = agrees(graph)
    p = sympy.Symbol("p_J")
    assert result.states == (p, theta)
    w = p / J
    expected = J * (M + T * F - B * T**2 * w - m * T * T.diff(theta) * w**2) / (J + m * T**2)
    assert equal(result.derivatives[0], expected)
    assert result.values == {M: 3.0, J: 2.0, m: 1.5, B: 0.7, F: -4.0}
    assert result.inputs == (t,)
    assert result.inert == result.algebraic == result.open == ()
    assert result.derivative_stores == ("I:m (bond 3) follows 1:crank through MTF:T",)


def test_causality_says_which_momentum():
    b = Builder().one("shaft").on("shaft", I("J1", 1.0), I("J2", 2.0), Se("M", 3.0))
    graph = b.build()
    assert str(state_equations(graph).states[0]) == "p_J1"
    chosen = causality(graph, {"J2": "integral", "J1": "derivative"})
    result = state_equations(graph, causality=chosen)
    J1, J2 = sympy.symbols("J1 J2")
    assert result.states == (sympy.Symbol("p_J2"),)
    assert result.derivatives == (M * J2 / (J1 + J2),)


@pytest.mark.slow
def test_several_branches_from_one_crank():
    branches = 2
    b = Builder().one("crank", displacement="theta").on("crank", I("J", 2.0), Se("M", 3.0))
    w, kinetic, force = sympy.Symbol("thetadot"), J * sympy.Symbol("thetadot") ** 2 / 2, M
    for n in range(1, branches + 1):
        ratio = sympy.sin(theta + n) / n
        b.one(f"v{n}").on(f"v{n}", I(f"m{n}", 0.5 * n), Se(f"F{n}", -1.0 * n)).transform("crank", f"v{n}", ratio)
        kinetic += sympy.Symbol(f"m{n}") * (ratio * w) ** 2 / 2
        force += sympy.Symbol(f"F{n}") * ratio
    graph = b.build()
    assert equal(motion_equation(graph).acceleration, lagrange(kinetic, theta, w, force))
    assert len(agrees(graph).derivative_stores) == branches


def test_a_spring_on_the_slider_is_a_state_of_its_own():
    graph = slider_crank(sympy.sin(theta), C("spring", 0.25)).build()
    q, w, spring = sympy.symbols("q_spring thetadot spring")
    result = motion_equation(graph)
    assert equal(result.moment, M + (F - q / spring - B * sympy.sin(theta) * w) * sympy.sin(theta))
    assert result.others == ((q, w * sympy.sin(theta)),)
    assert agrees(graph).states == (sympy.Symbol("p_J"), q, theta)


def test_a_motor_drives_the_crank_through_a_gyrator():
    b = slider_crank().one("circuit", "electric").on("circuit", Se("U", 12.0), I("L", 0.1), R("Ra", 0.5))
    graph = b.gyrate("circuit", "crank", 0.3, name="K").build()
    result = agrees(graph)
    L, Ra, U, K, pL, pJ = sympy.symbols("L Ra U K p_L p_J")
    rates = dict(zip(result.states, result.derivatives, strict=True))
    assert equal(rates[pL], U - Ra * pL / L - K * pJ / J)
    assert equal(rates[pJ].subs({pJ: 0, F: 0}), J * (M + K * pL / L) / (J + m * T**2))


def test_the_second_transformers_modulus_depends_on_the_firsts_displacement():
    x, w, m1, m2 = sympy.symbols("x thetadot m1 m2")
    b = Builder().one("crank", displacement="theta").one("rod", displacement="x").one("ram")
    b.on("crank", I("J", 2.0), Se("M", 3.0)).on("rod", I("m1", 0.5)).on("ram", I("m2", 0.7), Se("F", -1.0))
    graph = b.transform("crank", "rod", sympy.sin(theta)).transform("rod", "ram", x**2).build()
    result = motion_equation(graph)
    s, c = sympy.sin(theta), sympy.cos(theta)
    assert equal(result.inertia, J + m1 * s**2 + m2 * s**2 * x**4)
    assert equal(result.slope, 2 * m1 * s * c + 2 * m2 * s * c * x**4 + 4 * m2 * s**2 * x**3 * s)
    assert result.others == ((x, w * s),)
    whole = dict(zip(agrees(graph).states, state_equations(graph).derivatives, strict=True))
    acceleration = result.acceleration.subs(w, sympy.Symbol("p_J") / J)
    assert equal(whole[sympy.Symbol("p_J")], J * acceleration)


def test_another_coordinate_of_the_same_motion():
    b = Builder().one("motor", displacement="phi").one("wheel", displacement="theta").on("wheel", I("J", 2.0), Se("M", 3.0))
    graph = b.transform("motor", "wheel", 0.25, name="n").build()
    n = sympy.Symbol("n")
    assert motion_equation(graph, "theta").inertia == J
    by_motor = motion_equation(graph, "motor")
    assert by_motor.coordinate == sympy.Symbol("phi")
    assert equal(by_motor.inertia, n**2 * J)
    assert equal(by_motor.moment, n * M)


def test_a_compliant_shaft_has_two_independent_inertias():
    b = Builder().one("a").one("b").on("a", I("J1", 1.0), Se("M", 3.0)).on("b", I("J2", 2.0), R("B", 0.3))
    graph = b.between("a", "b", C("shaft", 0.01), R("d", 0.2)).build()
    result = agrees(graph)
    p1, p2, q, J1, J2, shaft, d = sympy.symbols("p_J1 p_J2 q_shaft J1 J2 shaft d")
    twist = p1 / J1 - p2 / J2
    assert result.states == (p1, p2, q)
    expected = (M - q / shaft - d * twist, q / shaft + d * twist - B * p2 / J2, twist)
    assert all(equal(a, b) for a, b in zip(result.derivatives, expected, strict=True))
    with pytest.raises(GraphError, match=r"found 2 \(a, b\): use state_equations"):
        motion_equation(graph)


def test_what_the_numbers_rule_out_is_refused_in_symbols_too():
    b = Builder().one("a").one("b").on("a", Se("F", 1.0)).on("b", R("B", 2.0))
    b.sum("c", [("a", 2.0), ("b", 3.0)], "").on("c", I("m1", 1.0)).on("c", Sf("v", 1.0))
    b.sum("d", [("a", 4.0), ("b", 6.0)], "").on("d", Sf("w", 1.0))  # twice the flow of c
    with pytest.raises(GraphError, match="contradict or repeat"):
        state_equations(b.build())


def test_a_massless_flow_is_solved_for():
    b = Builder().one("mass").one("joint").zero("z")
    b.on("mass", I("m", 2.0), Se("F", 1.0)).bond("mass", "z").bond("z", "joint").on("joint", R("B", 4.0), C("c", 0.5))
    b.port("z", R("leak", 8.0))
    graph = b.build()
    result = agrees(graph)
    assert len(result.algebraic) == 1
    symbol, expression = result.algebraic[0]
    p, q, c, leak = sympy.symbols("p_m q_c c leak")
    assert symbol == sympy.Symbol("f_joint")
    assert equal(expression, (leak * p / m - q / c) / (B + leak))


def test_laws_stay_formulas():
    b = Builder().one("crank", displacement="theta").signal("u").parameter(k=None, mu=0.1)
    b.on("crank", I("J", 2.0), C("spring", lambda q, k: k * q**3), R("brake", lambda f, mu: mu * f * abs(f)))
    b.on("crank", R("rub", lambda theta: 2.0 + np.cos(theta)), Se("M", lambda t, u: u * np.sin(3 * t)))
    graph = b.build()
    result = state_equations(graph)
    p, q, u, mu, k = sympy.symbols("p_J q_spring u mu k")
    f = p / J
    expected = u * sympy.sin(3 * t) - k * q**3 - mu * f * sympy.Abs(f) - (sympy.cos(theta) + 2) * f
    assert equal(result.derivatives[0], expected)
    assert result.open == (k,)
    assert result.inputs == (t, u)
    with pytest.raises(GraphError, match=r"no value for k: graph\.with_parameters\(k=...\)"):
        result.numeric({"u": 1.0})
    agrees(graph.with_parameters(k=5.0), {"u": lambda t: np.cos(t)})


def test_a_modulus_of_a_signal_needs_the_signals_rate():
    b = Builder().one("crank").one("ram").signal("r").on("crank", I("J", 2.0), Se("M", 3.0)).on("ram", I("m", 1.0))
    graph = b.transform("crank", "ram", lambda r: r**2, name="T").build()
    result = agrees(graph, {"r": lambda t: 1.0 + np.sin(t)})
    assert result.inputs == (t, *sympy.symbols("r rdot"))
    with pytest.raises(GraphError, match=r"MTF:T \(bond 4\) varies with signal 'r'.*use state_equations"):
        motion_equation(graph)


def test_a_modulus_of_time():
    ratio = sympy.sin(t) + theta
    agrees(slider_crank(ratio).build())
    with pytest.raises(GraphError, match="varies with the time"):
        motion_equation(slider_crank(ratio).build())


def test_an_inertia_that_a_flow_source_drives_too():
    b = Builder().one("a").one("b").on("a", Sf("v", lambda t: t**2)).on("b", I("J", 1.0), Se("M", 3.0))
    graph = b.sum("c", [("a", 1.0), ("b", 2.0)], "").on("c", I("m", 0.4)).build()
    agrees(graph)
    with pytest.raises(GraphError, match=r"I:m .* moves with a source of flow too: use state_equations"):
        motion_equation(graph)


def test_a_source_law_that_moves_is_a_function_of_flows_and_time():
    position = Motion("crank", lambda q, ns, anchor: ns.sin(q))

    def effort(here, anchor):
        return 3.0 * here.position - 0.5 * here.flow * here.speed + here.time

    law = Law(effort, position, moving=True)
    b = Builder().one("crank").on("crank", I("J", 2.0)).one("ram").transform("crank", "ram", 0.5)
    result = agrees(b.on("ram", I("m", 4.0), Se("F", law)).build())
    assert "F(crank, p_J/J, T*p_J/J, t)".replace("T", "crank_ram") in result.text()
    seen = Law(lambda here, anchor: -0.5 * here.flow, position, moving=True, sees=("flow",))
    b = Builder().one("crank").on("crank", I("J", 2.0), Se("M", seen))
    assert "M(crank, p_J/J)" in agrees(b.build()).text()
    assert str(motion_equation(b.build()).moment) == "M(crank, crankdot)"


@pytest.mark.slow
def test_a_modulus_that_reads_a_flow_is_a_formula_in_the_opaque_form_too():
    b = Builder().one("arm").one("rotor").on("arm", Se("u", 12.0), R("r", 1.0), I("L", 0.1)).on("rotor", I("J", 1.0))
    graph = b.gyrate("arm", "rotor", lambda f_arm: 0.3 * f_arm, name="K").build()
    assert state_equations(graph, opaque=True).derivatives == state_equations(graph).derivatives


def test_a_modulated_gyrator_and_its_opaque_form():
    b = slider_crank().one("circuit").on("circuit", I("L", 0.1), Se("U", 1.0))
    graph = b.gyrate("circuit", "crank", lambda theta: 1.0 + 0.5 * np.cos(theta), name="K").build()
    agrees(graph)
    opaque = state_equations(graph, opaque=True)
    assert sympy.Function("K")(theta) in opaque.opaque
    states = [0.3, 0.4, 0.5]
    assert opaque.numeric()(0.0, states) == pytest.approx(state_equations(graph).numeric()(0.0, states), rel=1e-13)


def test_a_mechanisms_own_modulus_stays_a_function():
    motion = Motion("crank", lambda q, ns, anchor: ns.sin(q))
    ratio = Modulus(lambda s: 1.0 + s**2, lambda s: 2.0 * s * np.sqrt(1.0 - s**2), motion)
    graph = slider_crank(ratio).build()
    result = agrees(graph)
    assert "T(theta)" in result.text()
    assert "T_slope(theta)" in result.text()


def test_values_fill_in_readable_numbers():
    result = state_equations(slider_crank(lambda theta: -0.5 * np.sin(theta)).build(), values=True)
    assert "1.0*" not in result.text()
    assert set().union(*(d.free_symbols for d in result.derivatives)) == {sympy.Symbol("p_J"), theta}
    states = [0.3, 0.4]
    symbolic = state_equations(slider_crank(lambda theta: -0.5 * np.sin(theta)).build()).numeric()
    assert result.numeric()(0.0, states) == pytest.approx(symbolic(0.0, states), rel=1e-14)


def test_names_become_identifiers_and_stay_apart():
    b = Builder().one("theta", displacement="J").one("slider").on("theta", I("J", 2.0), Se("t", 1.0))
    graph = b.on("slider", I("2 m", 1.0)).transform("theta", "slider", 3.0).build()
    result = agrees(graph)
    assert {str(s) for s in result.values} == {"I_J", "Se_t", "x2_m", "theta_slider"}


def test_text_and_latex_hold_every_equation():
    result = state_equations(slider_crank(sympy.sin(theta), C("c", 1.0)).build())
    assert result.text().count("/dt = ") == 3
    assert result.latex().count("&=") == 3


@pytest.mark.parametrize(
    ("graph", "message"),
    [
        (
            lambda: Builder().one("a").one("b").on("a", Sf("v", 1.0)).on("b", Sf("w", 1.0)).transform("a", "b", 2.0),
            "TF:a->b",
        ),
        (
            lambda: Builder().one("a").on("a", Se("F", 1.0)),
            r"1:a: none of bond 1 \(from Se:F\) sets its flow; attach an I or R to it",
        ),
        (
            lambda: Builder().one("a").on("a", Se("F", 1.0), R("B", lambda f: f**3)),
            r"R:B \(bond 2\): its law is not linear",
        ),
        (lambda: slider_crank(lambda theta: 1.0 if theta > 0 else 2.0), r"MTF:T \(bond 6\): cannot be written"),
    ],
)
def test_what_has_no_equations_is_refused(graph, message):
    with pytest.raises(GraphError, match=message):
        state_equations(graph().build())


def test_the_coordinate_must_determine_the_motion():
    b = slider_crank()
    b.displacement("x", "slider")
    with pytest.raises(GraphError, match="'x' does not determine the motion"):
        motion_equation(b.build(), "x")
    with pytest.raises(GraphError, match="'y' is no displacement or 1-junction"):
        motion_equation(b.build(), "y")


def test_a_massless_graph_has_no_equation_of_motion():
    graph = Builder().one("a").on("a", Se("F", 1.0), R("B", 2.0)).build()
    with pytest.raises(GraphError, match="found 0"):
        motion_equation(graph)


def test_check_finds_what_is_left_over():
    from dataclasses import replace

    result = state_equations(slider_crank().build())
    stray = replace(result, derivatives=(sympy.Symbol("e_7"), *result.derivatives[1:]))
    with pytest.raises(GraphError, match=r"e_7 is neither a state") as caught:
        stray.check()
    assert "R:B (bond 4) is in no equation" in str(caught.value)
    with pytest.raises(GraphError, match="found 1 equations for 2 states"):
        replace(result, derivatives=result.derivatives[:1]).check()


def gyrated(*on_the_other_side):
    b = Builder().one("a").one("b").on("a", I("L", 1.0), Se("U", 2.0)).on("b", *on_the_other_side)
    return b.gyrate("a", "b", 3.0, name="G").build()


def test_a_spring_and_damper_behind_a_gyrator():
    result = agrees(gyrated(C("c", 0.5), R("B", 0.2)))
    G, U, p, q, c, L = sympy.symbols("G U p_L q_c c L")
    flow = (G * p / L - q / c) / B
    assert result.algebraic[0][0] == sympy.Symbol("f_b")
    assert equal(result.algebraic[0][1], flow)
    assert all(equal(x, y) for x, y in zip(result.derivatives, (U - G * flow, flow), strict=True))


def test_a_coil_follows_a_spring_through_a_gyrator():
    """f_L = q/(c G) and e_L = d(L f_L)/dt: the spring moves by q' (1 + L/(c G^2)) = U/G."""
    result = agrees(gyrated(C("c", 0.5)))
    G, U, c, L, p = sympy.symbols("G U c L p_L")
    assert result.states == (p,)
    assert equal(result.derivatives[0], U * L / (L + c * G**2))
    assert result.derivative_stores == ("C:c (bond 3) follows 1:a through GY:G",)


@pytest.mark.slow
def test_a_planar_four_bar_has_the_same_rates_in_symbols_and_in_numbers():
    linkage = four_bar(4.0, Bar(1.0, 1.0, 0.5, 0.5), Bar(3.0, 2.0, 0.6, 1.5), Bar(3.0, 3.0, 0.7, 1.5))
    graph = simplify(linkage.graph, keep=(linkage.coordinate,)).graph
    numeric, rates = state_equations(graph).numeric(), Dynamics(graph).rates
    for phi in (0.0, 0.7, 3.0):
        angles = [phi, *(float(linkage.positions[name](phi)) for name in ("coupler.theta", "rocker.theta"))]
        state = [0.5 * 2.0, *angles]  # the crank's momentum, at 2 rad/s
        assert_allclose(numeric(0.0, state), rates(0.0, *state), rtol=1e-9, atol=1e-12)


def test_numbers_that_leave_nothing_to_divide_by_are_refused_with_the_element():
    """Filled in, they gave zoo."""
    b = Builder().one("a").one("b").on("a", I("m", 1.0), Se("F", 1.0)).on("b", I("J", -4.0)).transform("a", "b", 0.5)
    with pytest.raises(GraphError, match=r"the rate of .*: I:J.* = -4, .*I:m.* = 1, together, makes it a division by zero"):
        state_equations(b.build(), values=True)


@pytest.mark.slow
@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(1, 4), st.integers(0, 2**32))
def test_rates_solve_the_system_of_their_mass_matrix(size, seed):
    rng = np.random.default_rng(seed)
    whole = rng.integers(-2, 3, (size, size))
    whole = whole @ whole.T + np.eye(size, dtype=int)
    force = rng.integers(-3, 4, size)
    result = solve_symmetric([[sympy.Integer(v) for v in row[: i + 1]] for i, row in enumerate(whole)], force.tolist())
    assert sympy.Matrix(whole.tolist()) * sympy.Matrix(result) == sympy.Matrix(force.tolist())


def test_a_mass_matrix_without_inverse_is_an_error():
    with pytest.raises(GraphError, match="the effective inertia vanishes"):
        solve_symmetric([[J], [J, J]], [1, 0])


def test_a_flow_is_followed_through_all_transformers_to_the_independent_ones():
    b = Builder().one("a").one("b").one("c").on("a", I("J", 1.0)).on("c", I("m", 1.0))
    graph = b.transform("a", "b", 2.0, name="T").transform("b", "c", 3.0, name="U").build()
    form = Formulation(graph)
    assert form.through(form.variable("c")) == ["U", "T"]
    assert form.through(form.variable("a")) == []


def test_flows_without_an_inertia_in_common_keep_their_own_determinant():
    b = Builder()
    for side in "ab":
        for n in "12":
            b.one(side + n).on(side + n, I(f"J{side}{n}", 1.0), Se(f"M{side}{n}", 2.0))
        b.sum(f"{side}3", [(f"{side}1", 2.0), (f"{side}2", 3.0)], "").on(f"{side}3", I(f"m{side}", 0.5))
    result = agrees(b.between("a3", "b3", C("c", 1.0)).build())
    symbols = result.derivatives[0].free_symbols
    assert sympy.Symbol("Ja2") in symbols
    assert sympy.Symbol("Jb1") not in symbols


def test_a_resistor_of_zero_is_listed():
    b = slider_crank().on("crank", R("none", 0.0))
    assert agrees(b.build()).inert == ("R:none (bond 8) acts on nothing: its value is 0",)


def test_springs_that_share_one_effort():
    b = Builder().one("mass").zero("z").on("mass", I("m", 2.0), Se("F", 1.0)).bond("mass", "z")
    graph = b.on("z", C("c1", 0.5), C("c2", 0.25)).build()
    result = agrees(graph)
    assert any("c2" in line and "move together" in line for line in result.derivative_stores)


def test_sources_and_resistors_that_act_on_nothing_are_listed():
    b = Builder().one("drive").on("drive", Sf("v", 1.0), Se("F", 2.0), R("B", 3.0)).one("mass").on("mass", I("m", 2.0))
    graph = (
        b.between("drive", "mass", C("c", 1.0)).one("idle").transform("mass", "idle", 0.0).on("idle", Se("F0", 1.0)).build()
    )
    result = agrees(graph)
    assert [line.split(" acts")[0] for line in result.inert] == ["Se:F (bond 2)", "R:B (bond 3)", "Se:F0 (bond 10)"]
    assert "gain is zero" in result.inert[2]
    assert "sources of flow alone" in result.inert[0]


def test_a_flow_source_that_nothing_feels():
    graph = Builder().one("a").on("a", Sf("v", 1.0), I("J", 1.0)).build()
    result = state_equations(graph)
    assert result.states == ()
    assert result.inert == (
        "Sf:v (bond 1) acts on nothing: no element feels the flow that it imposes",
        "I:J (bond 2) acts on nothing: sources of flow alone determine its flow",
    )


NAMES = "Se1 I1 B1 C1 Se2 I2 B2 C2"
Se1, I1, B1, C1, Se2, I2, B2, C2 = sympy.symbols(NAMES)
theta, w, q1, q2 = sympy.symbols("theta thetadot q_C1 q_C2")
TURNS = sympy.sin(theta) * (1 + theta)


def test_all_values_open():
    graph = generic(TURNS)
    assert set(graph.parameters) == set(NAMES.split())
    result = generic_equation(TURNS)
    assert equal(result.inertia, I1 + TURNS**2 * I2)
    assert equal(result.slope, 2 * I2 * TURNS * TURNS.diff(theta))
    assert equal(result.moment, Se1 + TURNS * Se2 - (B1 + TURNS**2 * B2) * w - q1 / C1 - TURNS * q2 / C2)
    assert result.others == ((q1, w), (q2, w * TURNS))


@pytest.mark.slow
def test_it_is_the_other_sides_equation_where_the_ratio_does_not_vanish():
    result = generic_equation(TURNS, opaque=True)
    acceleration, ratio = result.acceleration, sympy.Function("T")(theta)
    f_B, rate_B = ratio * w, ratio * acceleration + ratio.diff(theta) * w**2
    passed = (Se1 - I1 * acceleration - B1 * w - q1 / C1) / ratio
    assert equal(rate_B, (Se2 - B2 * f_B - q2 / C2 + passed) / I2)
    printed = (Se2 - B2 * f_B - q2 / C2 - passed) / I2
    assert not equal(rate_B, printed)  # the published sign: its transformer takes power from both sides


def test_power_is_conserved():
    values = dict(zip(NAMES.split(), (3.0, 2.0, 0.3, 0.5, -4.0, 1.5, 0.7, 0.2), strict=True))
    result = generic_equation(TURNS, **values)
    at = {theta: 0.8, w: 1.3, q1: 0.1, q2: -0.2} | result.values
    at |= dict(zip((Se1, I1, B1, C1, Se2, I2, B2, C2), values.values(), strict=True))
    f_A, a_A, ratio = 1.3, float(result.acceleration.subs(at)), float(TURNS.subs(at))
    f_B, a_B = ratio * f_A, ratio * a_A + float(TURNS.diff(theta).subs(at)) * f_A**2
    into = 3.0 * f_A - 4.0 * f_B
    out = (2.0 * a_A + 0.3 * f_A + 0.1 / 0.5) * f_A + (1.5 * a_B + 0.7 * f_B - 0.2 / 0.2) * f_B
    assert into == pytest.approx(out, rel=1e-12)


@pytest.mark.parametrize("ratio", [0.5, lambda theta: np.sin(theta), sympy.sin(theta)])
def test_any_kind_of_ratio_runs_in_numbers(ratio):
    values = dict.fromkeys(NAMES.split(), 1.0)
    dynamics = Dynamics(generic(ratio, **values))
    assert all(np.isfinite(dynamics.at(0.0, [1.0, 0.0, 0.1, 0.2]).rates))  # at a dead centre: T = 0
    assert len(state_equations(generic(ratio, **values)).derivatives) == 4


def test_quantities_of_the_ratio_are_parameters():
    r = sympy.Symbol("r")
    graph = generic(r * sympy.sin(theta), displacement="theta", r=0.1)
    assert graph.parameters["r"] == 0.1
    assert generic(r * sympy.sin(theta), r=0.1).displacements.keys() == {"theta"}
    with pytest.raises(GraphError, match="depends on r, theta: say which is the displacement"):
        generic(r * sympy.sin(theta))


def test_laws_of_elements_may_be_functions():
    result = generic_equation(TURNS, without=("C1", "C2"), Se1=lambda t, M0: M0 * np.sin(t), B1=lambda f: f * abs(f))
    assert equal(result.moment.subs({B2: 0, Se2: 0}), sympy.Symbol("M0") * sympy.sin(sympy.Symbol("t")) - w * sympy.Abs(w))


@pytest.mark.parametrize("wrong", [{"I3": 1.0}, {"without": ("C3",)}])
def test_unknown_names_are_refused(wrong):
    with pytest.raises(GraphError, match=r"no element or quantity '.3': expected Se1"):
        generic(2.0, **wrong)


x = sympy.Symbol("x")


def press(law=lambda theta, u, k: k * u * np.sin(theta)):
    b = Builder().one("crank", displacement="theta").signal("u").parameter(k=2.0, open=None)
    return b.on("crank", I("J", 3.0), Se("M", law), R("rub", lambda f, open: open * f)).build()


def test_the_twin_has_the_graphs_structure_with_a_symbol_for_every_number():
    graph = press()
    result = Twin(graph)
    assert result.graph.bonds == graph.bonds
    assert {str(s): v for s, v in result.values.items()} == {"J": 3.0, "k": 2.0}
    assert {name: str(s) for name, s in result.own.items()} == {"J": "J"}
    assert {name: str(s) for name, s in result.places.items()} == {"t": "t", "theta": "theta", "u": "u"}
    assert {name: str(s) for name, s in result.rates.items()} == {"u": "udot"}
    assert str(result.finish(result.graph.constant("J"))) == "J"


def test_a_law_that_is_no_formula_is_named_with_its_bond():
    with pytest.raises(GraphError, match=r"MSe:M \(bond 2\): cannot be written as a formula"):
        Twin(press(lambda theta: 1.0 if theta > 0 else 0.0))


def test_names_are_handed_out_once_as_identifiers():
    names = Twin(slider_crank().build())
    taken = [str(names.symbol(*pair)) for pair in (("a->b", "TF"), ("a b", "I"), ("a.b", "I"), ("2", "C"), ("*", "R"))]
    assert taken == ["a_b", "I_a_b", "I_a_b_", "x2", "x"]
    assert clean("rod.m") == "rod_m"


def test_whole_numbers_and_halves_become_exact_and_no_others():
    assert exact(2.0 * x**1.5 - 0.5) == 2 * x ** sympy.Rational(3, 2) - sympy.Rational(1, 2)
    assert exact(0.3 * x) == 0.3 * x


def test_a_function_known_by_its_values_has_another_as_its_derivative():
    slope = numeric_function("T_slope", lambda q: 2.0 * q)
    called = numeric_function("T", lambda q: q**2, slope)
    assert str(called(x).diff(x)) == "T_slope(x)"
    assert sympy.lambdify(x, [called(x), called(x).diff(x)], modules="numpy")(3.0) == [9.0, 6.0]


@pytest.mark.parametrize(("rungs", "most"), sample(((2, 23), (3, 76), (4, 247)), 3))
def test_a_ladder_of_resistors_is_one_fraction(rungs, most):
    """u g1 g2 over the sum of products, less the inner resistance, as nodal analysis leaves it."""
    b = Builder().one("s1").on("s1", Se("u", 1.0), R("r1", 1.0)).zero("n1").bond("s1", "n1").on("n1", R("g1", 2.0))
    for k in range(2, rungs + 1):
        b.one(f"s{k}").bond(f"n{k - 1}", f"s{k}").on(f"s{k}", R(f"r{k}", 1.0 + k))
        b.zero(f"n{k}").bond(f"s{k}", f"n{k}").on(f"n{k}", R(f"g{k}", 2.0 + k))
    graph = b.one("out").bond(f"n{rungs}", "out").on("out", I("m", 1.5)).build()
    (rate,) = state_equations(graph).derivatives
    assert sympy.count_ops(rate) <= most
    inner, voltage = 0.0, 1.0  # Thevenin's, rung by rung
    for k in range(1, rungs + 1):
        series, leak = inner + (1.0 if k == 1 else 1.0 + k), 2.0 if k == 1 else 2.0 + k
        inner, voltage = series * leak / (series + leak), voltage * leak / (series + leak)
    assert_allclose(state_equations(graph).numeric()(0.0, [0.7]), [voltage - inner * 0.7 / 1.5], rtol=1e-13)


# Equations handed over: machine code and Modelica.


def handed_over():
    """A spring that pushes only, drag, and a force of a signal that switches with the position."""
    b = Builder().signal("load").parameter(k=3.0, end=0.7).one("m", displacement="x").on("m", I("M", 2.0))
    b.on("m", R("d", lambda f, end: end * f * abs(f)), C("s", lambda q, k: k * np.maximum(q, 0) ** 3))
    b.on("m", Se("F", lambda load, t, x: np.where(x > 1, load * np.cos(t), -load) * np.sqrt(1 + x**2)))
    return b.build()


@pytest.mark.slow
def test_machine_code_gives_the_rates():
    extra("numba")
    code = state_equations(handed_over()).machine_code()
    for t, y in ((0.3, [0.7, 0.5, 1.2]), (1.9, [-0.7, -0.5, 0.2])):
        expected = state_equations(handed_over()).numeric({"load": 2.0})(t, y)
        assert_allclose(code(t, np.array(y), np.array([2.0])), expected, rtol=1e-14)
    bridge = Builder().one("a").zero("node").bond("a", "node").on("a", Se("u", 2.0), R("r", 2.0)).on("node", R("leak", 4.0))
    graph = bridge.one("b").bond("node", "b").on("b", I("m", 1.5), R("s", 1.0)).build()
    flow, node = 0.7 / 1.5, (2.0 / 2.0 - 0.7 / 1.5) / (1.0 / 2.0 + 1.0 / 4.0)
    assert_allclose(state_equations(graph).machine_code()(0.0, np.array([0.7])), [node - flow], rtol=1e-14)


def read_back(text, t, signals):
    """The rates that a Modelica model gives at its start, by its own text."""
    lines = text.splitlines()
    space = {name: getattr(np, name) for name in ("sqrt", "cos", "sin")} | {"time": t, "max": max, **signals}
    for line in lines:
        if "parameter Real" in line or "(start =" in line:
            name, value = re.match(r"\s*(?:parameter )?Real (\w+)(?: = |\(start = )([-\d.e]+)", line).groups()
            space[name] = float(value)
    rates = []
    for line in (line for line in lines if "der(" in line):
        right = line.split(" = ", 1)[1].rstrip(";").replace("^", "**")
        right = re.sub(r"if (.*?) then (.*?) else (.*?)\)", r"(\2) if (\1) else (\3))", right)
        rates.append(eval(right, space))
    return rates


@pytest.mark.parametrize("start", [{"p_M": 0.7, "q_s": 0.5, "x": 1.2}, {"p_M": -0.7, "q_s": -0.5, "x": 0.2}])
def test_a_modelica_model_says_the_same(start):
    text = to_modelica(handed_over(), name="Press", initial=start)
    assert text.splitlines()[0] == "model Press"
    assert text.endswith("end Press;")
    assert "  parameter Real end_ = 0.7;" in text
    assert "  input Real load;" in text
    expected = state_equations(handed_over()).numeric({"load": 2.0})(0.3, list(start.values()))
    assert_allclose(read_back(text, 0.3, {"load": 2.0}), expected, rtol=1e-13)


@pytest.mark.slow
def test_a_modelica_model_moves_as_the_graph_does(tmp_path):
    """The model is compiled and simulated where OpenModelica's compiler is at hand."""
    compiler = shutil.which("omc")
    if compiler is None:
        pytest.skip("OpenModelica's omc is not installed")
    b = Builder().one("m", displacement="x").on("m", I("M", 2.0), R("d", lambda f: 0.7 * f * abs(f)))
    b.on("m", C("s", lambda q: 3.0 * q**3), Se("F", lambda t: np.cos(t)))
    graph, start = b.build(), {"p_M": 0.7, "q_s": 0.5, "x": 0.5}
    (tmp_path / "Press.mo").write_text(to_modelica(graph, name="Press", initial=start), "utf-8")
    run = 'simulate(Press, stopTime=2.0, tolerance=1e-10, outputFormat="csv");'
    (tmp_path / "run.mos").write_text(f'loadFile("Press.mo");\n{run}\ngetErrorString();\n', "utf-8")
    output = subprocess.run([compiler, "run.mos"], cwd=tmp_path, capture_output=True, text=True, check=True)
    result = tmp_path / "Press_res.csv"
    assert result.exists(), output.stdout
    rows = np.genfromtxt(result, delimiter=",", names=True)
    ours = simulate(graph, 2.0, initial=start, rtol=1e-10).states()
    for name in start:
        assert_allclose(rows[name][-1], ours[name][-1], rtol=1e-6)


def test_what_cannot_be_handed_over_is_named():
    with pytest.raises(GraphError, match=r"initial 'z': no such state; they are p_M, q_s, x"):
        to_modelica(handed_over(), initial={"z": 1.0})
    law = Law(lambda here, anchor: -here.q, Motion("m"))
    graph = Builder().one("m", displacement="x").on("m", I("M", 2.0), Se("F", law)).build()
    with pytest.raises(GraphError, match="F has no form in Modelica"):
        to_modelica(graph)
    with pytest.raises(GraphError, match="the rate of p_M holds F, which is known by values, not by a formula"):
        state_equations(graph).machine_code()
