"""Operating points, linear equations, modes and transfer functions, against formulas by hand and against differences."""

from pathlib import Path
from runpy import run_path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph import Builder, C, Dynamics, GraphError, I, R, Se, equilibrium, linearize, reach
from tests.extras import extra


def motor():
    """L di/dt = U - R i - k w, J dw/dt = k i - b w."""
    b = Builder().one("coil").one("rotor", displacement="phi").on("coil", Se("U", 12.0), R("Ra", 2.0), I("L", 0.1))
    return b.gyrate("coil", "rotor", 0.5, name="k").on("rotor", I("J", 0.02), R("b", 0.01), Se("load", -0.2)).build()


def test_a_dc_motor_is_its_textbook_transfer_function():
    result = linearize(motor(), at={}, outputs=["f_rotor", "f_coil", "phi"])
    assert (result.states, result.inputs) == (("p_L", "p_J", "phi"), ("U", "load"))
    assert_allclose(result.A, [[-20.0, -25.0, 0.0], [5.0, -0.5, 0.0], [0.0, 50.0, 0.0]], rtol=1e-14)
    assert_allclose(result.B, [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    s = 1j * np.array([0.3, 4.0, 90.0])
    under = (0.1 * s + 2.0) * (0.02 * s + 0.01) + 0.25
    assert_allclose(result.response("U", "f_rotor", s.imag), 0.5 / under, rtol=1e-12)
    assert_allclose(result.response("load", "f_rotor", s.imag), (0.1 * s + 2.0) / under, rtol=1e-12)
    over, below = result.transfer("U", "f_coil")
    assert_allclose(np.polyval(over, s) / np.polyval(below, s), (0.02 * s + 0.01) / under, rtol=1e-10)
    decibels, degrees = result.bode("U", "f_rotor", s.imag)
    assert_allclose(decibels, 20 * np.log10(np.abs(0.5 / under)), rtol=1e-12)
    assert_allclose(degrees, np.degrees(np.angle(0.5 / under)), rtol=1e-12)
    assert_allclose(np.sort(result.zeros("load", "f_rotor").real), [-20.0, 0.0], atol=1e-9)  # the pole of phi cancels


def test_modes_of_two_masses_have_their_frequencies_damping_and_shapes():
    b = Builder()
    for n in "12":
        b.one(n).on(n, I(f"m{n}", 2.0), C(f"k{n}", stiffness=8.0))
    result = linearize(b.between("1", "2", C("k", stiffness=10.0)).build(), at={})
    swinging = [mode.frequency for mode in result.modes if mode.frequency > 1e-6]
    assert_allclose(swinging, [2.0, 2.0, 14.0**0.5, 14.0**0.5], rtol=1e-12)
    together, against = result.modes[-4], result.modes[-1]
    assert abs(together.damping) < 1e-12
    assert_allclose(together.shape["p_m1"] / together.shape["p_m2"], 1.0, atol=1e-9)
    assert_allclose(against.shape["p_m1"] / against.shape["p_m2"], -1.0, atol=1e-9)


def curved():
    b = Builder().signal("u").one("m", displacement="x").on("m", I("M", 2.0), C("k", lambda q: q + q**3))
    return b.on("m", R("d", lambda f: 0.5 * f + f**3), Se("F", lambda u: 3.0 * u), Se("g", 1.0)).build()


def test_slopes_at_a_state_are_those_of_differences():
    at, step = {"p_M": 1.2, "q_k": 0.7, "x": 0.1}, 1e-6
    result, rates = linearize(curved(), at=at, signals={"u": 0.4}), Dynamics(curved(), {"u": 0.4}).rates
    for k in range(3):
        ahead, behind = (rates(0.0, *(np.array(list(at.values())) + side * step * np.eye(3)[k])) for side in (1, -1))
        assert_allclose(result.A[:, k], (np.array(ahead) - behind) / (2 * step), atol=1e-8)
    assert result.inputs == ("g", "u")
    assert_allclose(result.B, [[1.0, 3.0], [0.0, 0.0], [0.0, 0.0]])


def test_an_equilibrium_balances_all_rates():
    result = equilibrium(curved(), signals={"u": 3.0})
    assert_allclose(result["q_k"] + result["q_k"] ** 3, 10.0, rtol=1e-10)
    assert result["p_M"] == 0.0
    assert_allclose(result["x"], result["q_k"], rtol=1e-12)
    assert linearize(curved(), signals={"u": 3.0}).at == result


def test_what_no_motion_changes_is_that_of_the_start_in_an_equilibrium():
    """Two tanks with a pipe of turbulent flow share their liquid; a valve's three springs hold two freedoms."""
    b = Builder().zero("a", "hydraulic").one("pipe").zero("b", "hydraulic").on("a", C("A", 2.0)).on("b", C("B", 3.0))
    b.on("pipe", R("orifice", lambda f: 3.0 * f * abs(f))).bond("a", "pipe").bond("pipe", "b")
    assert_allclose(list(equilibrium(b.build(), near={"q_A": 5.0}).values()), [2.0, 3.0], rtol=1e-9)
    valve = run_path(str(Path(__file__).parents[2] / "examples" / "bond_graphs" / "torque_motor.py"))
    result = equilibrium(valve["valve"]().expand())
    assert_allclose((result["spool.x"], result["q_spool.forces"]), valve["at_rest"](), rtol=1e-12)
    angle = result["armature.theta"]
    assert_allclose(result["q_feedback spring.k"], valve["BALL"] * angle - result["spool.x"], rtol=1e-12)


def test_states_of_any_size_have_an_equilibrium_and_slopes():
    """A nanofarad beside a diode, and one whose voltage rises with the square of its charge, behind 1 kohm at 5 V."""
    b = Builder().one("s").zero("n").bond("s", "n").on("s", Se("u", 5.0), R("r", 1e3))
    graph = b.on("n", C("c", 1e-9), R("diode", lambda e: 1e-12 * (np.exp(e / 0.026) - 1.0))).build()
    charge = equilibrium(graph)["q_c"]
    current = 1e-12 * (np.exp(charge / 1e-9 / 0.026) - 1.0)
    assert_allclose(5.0 - 1e3 * current, charge / 1e-9, rtol=1e-9)
    assert_allclose(linearize(graph).A, [[-(1e-3 + (current + 1e-12) / 0.026) / 1e-9]], rtol=1e-9)
    b = Builder().one("s").zero("n").bond("s", "n").on("s", Se("u", 5.0), R("r", 1e3))
    graph = b.on("n", C("varactor", lambda q: 1e9 * q + 2e17 * q**2)).build()
    charge = (np.sqrt(1e18 + 4e18) - 1e9) / 4e17
    assert_allclose(equilibrium(graph)["q_varactor"], charge, rtol=1e-9)
    assert_allclose(linearize(graph).A, [[-(1e9 + 4e17 * charge) / 1e3]], rtol=1e-9)


def test_laws_that_no_formula_turns_round_have_their_slopes_at_the_point():
    """An orifice of e = f |f| between tanks, a spring that follows a tank, and what their rates' differences say."""
    b = Builder().zero("a").one("pipe").zero("b").bond("a", "pipe").bond("pipe", "b").on("a", C("A", 2.0), R("leak", 3.0))
    b.on("pipe", R("orifice", lambda f: f * abs(f))).on("b", C("B", 1.0))
    graph = b.zero("c").on("c", C("curved", lambda q: 4.0 * q + 3.0 * q**3)).transform("b", "c", 0.5).build()
    at = {"q_A": 5.0, "q_B": 1.0}
    result, dynamics = linearize(graph, at=at, outputs=["f_pipe", "e_c"]), Dynamics(graph)
    assert result.states == ("q_A", "q_B")
    columns = []
    for k in range(2):
        ahead, behind = ([v + side * 1e-5 * (j == k) for j, v in enumerate(at.values())] for side in (1, -1))
        columns.append((np.array(dynamics.rates(0.0, *ahead)) - dynamics.rates(0.0, *behind)) / 2e-5)
    assert_allclose(result.A, np.transpose(columns), rtol=1e-8)
    assert_allclose(result.C, [[0.25 / np.sqrt(1.5), -0.5 / np.sqrt(1.5)], [0.0, 2.0]], rtol=1e-12)


def test_a_law_that_is_not_defined_at_the_start_is_no_equilibrium():
    b = Builder().one("m").on("m", I("M", 2.0), Se("F", 3.0), C("gas", lambda q: np.log(q)))
    with pytest.raises(GraphError, match=r"^no equilibrium was sought: a law is not defined at p_M = 0, q_gas = 0; give"):
        equilibrium(b.build())
    assert_allclose(equilibrium(b.build(), near={"q_gas": 1.0})["q_gas"], np.exp(3.0), rtol=1e-9)


def test_dry_friction_that_slips_has_no_slope_and_at_rest_a_kink():
    graph = Builder().one("x").on("x", I("m", 2.0), R("mu", lambda f: 4.0 * np.sign(f) + 0.5 * f * abs(f))).build()
    assert_allclose(linearize(graph, at={"p_m": 6.0}).A, [[-1.5]])
    with pytest.raises(GraphError, match=r"^linearize: R:mu \(bond 2\) has a kink at p_m = 0"):
        linearize(graph, at={})


def test_zeros_and_numerators_have_no_trace_of_rounding():
    """Two masses on a spring and damper: the far one answers with one zero, at -k/d, the near one with two."""
    b = Builder().one("a").zero("z").one("b").on("a", I("A", 1.0), Se("F", 1.0), R("ra", 0.2)).on("b", I("B", 2.0))
    b.bond("a", "z").bond("z", "b").one("rate").bond("z", "rate").on("rate", C("k", stiffness=50.0), R("d", 0.3))
    result = linearize(b.build(), at={}, outputs=["f_a", "f_b", "q_k"])
    assert_allclose(result.zeros("F", "f_b"), [-50.0 / 0.3], rtol=1e-12)
    assert_allclose(np.sort_complex(result.zeros("F", "f_a")), np.sort_complex(np.roots([2.0, 0.3, 50.0])), rtol=1e-12)
    assert result.transfer("F", "f_b")[0][:2].tolist() == [0.0, 0.0]
    assert_allclose(result.zeros("F", "q_k"), [0.0], atol=1e-12)


def test_what_has_no_equilibrium_says_what_goes_on():
    falling = Builder().one("m").on("m", I("M", 2.0), Se("F", 3.0)).build()
    with pytest.raises(GraphError, match=r"no equilibrium was found: p_M goes on changing, at a rate of 3"):
        equilibrium(falling)
    b = Builder().one("a").one("b").on("a", R("ra", 1.0)).on("b", R("rb", 1.0)).zero("z").bond("a", "z").bond("b", "z")
    state = b.on("z", I("L", 1.0)).one("m", displacement="x").bond("z", "m").on("m", I("M", 1.0), C("k", 1.0)).build()
    assert set(equilibrium(state).values()) == {0.0}


def test_states_out_of_reach_are_named():
    """Two equal masses on equal springs, pushed alike, never move against each other."""
    b = Builder().one("a").one("b").zero("push").one("drive").on("drive", Se("F", 1.0), I("M", 1.0))
    b.on("a", I("m1", 1.0), C("k1", 1.0), R("r1", 1.0)).on("b", I("m2", 1.0), C("k2", 1.0), R("r2", 1.0))
    b.bond("drive", "push").on("push", C("c", 1.0))
    for side in "ab":
        b.bond("push", side)
    result = linearize(b.build(), at={})
    assert set(result.unreachable()) == {"p_m1", "p_m2", "q_k1", "q_k2"}
    assert linearize(motor(), at={}).unreachable() == ()
    assert linearize(motor(), at={}, outputs=["f_rotor"]).unobservable() == ("phi",)
    assert linearize(motor(), at={}, outputs=["phi"]).unobservable() == ()


@pytest.mark.slow
def test_the_same_in_scipy():
    result = linearize(motor(), at={}, inputs=["U"], outputs=["f_rotor"])
    same = result.to_scipy()
    for ours, theirs in ((result.A, same.A), (result.B, same.B), (result.C, same.C), (result.D, same.D)):
        assert_allclose(ours, theirs)


def test_wrong_requests_are_told_what_there_is():
    for open_law in (C("c", lambda q, k: k * q), R("d", lambda k: k)):
        graph = Builder().parameter(k=None).one("m").on("m", I("M", 2.0), open_law).build()
        with pytest.raises(GraphError, match=r"has no value: graph.with_parameters\(k=...\)$"):
            linearize(graph)
    varying = Builder().one("m").on("m", I("M", 2.0), R("d", lambda f: abs(f)), Se("F", lambda t: t)).build()
    for inputs, match in (
        ({"at": {"p_L": 1.0}}, r"at 'p_L': no such state; they are p_M"),
        ({"inputs": ["F"]}, r"input 'F': MSe:F \(bond 3\) has a law of its own; give it as a number or a signal"),
        ({"outputs": ["f_zz"]}, r"output 'f_zz': expected a state \(p_M\), f_NAME or e_NAME"),
        ({}, r"linearize: R:d \(bond 2\) has a kink at p_M = 0, with another slope to either side"),
    ):
        with pytest.raises(GraphError, match=match):
            linearize(varying, **({"at": {}} | inputs))


def test_the_same_in_python_control():
    extra("control")
    result = linearize(motor(), at={}, inputs=["U"], outputs=["f_rotor"]).to_control()
    ours = linearize(motor(), at={}, inputs=["U"], outputs=["f_rotor"])
    assert result.input_labels == ["U"]
    assert result.output_labels == ["f_rotor"]
    assert result.state_labels == list(ours.states)
    assert_allclose(result(3.0j), ours.response("U", "f_rotor", 3.0)[0], rtol=1e-12)


def test_a_bode_diagram_is_drawn_and_saved(tmp_path):
    result = linearize(motor(), at={}, outputs=["f_rotor"])
    omega = np.logspace(-1, 3, 50)
    figure = result.draw_bode("U", "f_rotor", omega, tmp_path / "bode.svg")
    upper, lower = figure.axes
    magnitude, phase = result.bode("U", "f_rotor", omega)
    assert_allclose(upper.lines[0].get_ydata(), magnitude)
    assert_allclose(lower.lines[0].get_ydata(), phase)
    assert upper.get_title() == "f_rotor / U"
    assert (tmp_path / "bode.svg").read_text().startswith("<?xml")
    with pytest.raises(GraphError, match="expected a file name ending in"):
        result.draw_bode("U", "f_rotor", omega, "bode.txt")


def test_a_transfer_function_that_needs_the_rate_of_an_input_is_refused():
    """A voltage across a capacitor makes the current C du/dt: no D says that. The current of the coil is proper."""
    b = Builder().zero("n").one("s").on("s", Se("u", 1.0)).bond("s", "n").on("n", C("c", 2.0), I("L", 4.0))
    result = linearize(b.build(), at={}, outputs=["f_s", "f_L"])
    assert result.driven == {"u": ("f_s",)}
    assert_allclose(result.response("u", "f_L", 3.0), [1.0 / 12.0j])
    for call in (lambda: result.transfer("u", "f_s"), lambda: result.zeros("u", "f_s"), result.to_scipy):
        with pytest.raises(GraphError, match=r"^input 'u': f_s depends on its rate, for a store follows it"):
            call()
    assert linearize(motor(), at={}).driven == {}


def test_what_is_out_of_reach_has_a_reason():
    """Two circuits of a store each, the second of which pushes the first: no input of the first gets to the second."""
    b = Builder().one("a").one("b").on("a", Se("F", 1.0), I("m", 1.0), R("d", 1.0), Se("G", lambda f_b: 2.0 * f_b))
    graph = b.on("b", I("n", 2.0), C("k", 1.0), R("e", 1.0)).build()
    result = reach(graph, inputs=["F"], outputs=["f_b"])
    assert result.unreachable == {n: f"no causal path leads to {k}:{n} from Se:F" for k, n in (("I", "n"), ("C", "k"))}
    assert result.unobservable == {"m": "no causal path leads from I:m to f_b"}
    assert reach(graph, outputs=["p_m"]).unobservable == {}
    twins = Builder().one("a").on("a", Se("F", 1.0), I("m", 1.0), C("k", 1.0), C("l", 2.0)).build()
    assert list(reach(twins).unreachable.values()) == ["C:l keeps integral causality where all prefer derivative"]
    assert linearize(twins, at={}).unreachable() == ("q_k", "q_l")
    for wrong, match in (({"inputs": ["x"]}, "'x': no such source"), ({"outputs": ["x"]}, "'x': expected f_NAME")):
        with pytest.raises(GraphError, match=match):
            reach(graph, **wrong)
