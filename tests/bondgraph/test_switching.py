"""Switched junctions and dry friction: events, what passes them, modes, against the same motions piece by piece by hand."""

import pickle

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from bondgraph import (
    Builder,
    C,
    GraphError,
    I,
    R,
    Se,
    as_data,
    causality,
    from_data,
    mode,
    reduce,
    simplify,
    simulate,
    state_equations,
)


def clutch(when=lambda t: t > 1.0):
    """A driven flywheel and a braked one, joined at t = 1."""
    b = Builder().one("a", "rotation").one("b", "rotation").zero("clutch", when=when).bond("a", "clutch").bond("clutch", "b")
    return b.on("a", I("J1", 2.0), Se("M", 3.0)).on("b", I("J2", 4.0), R("d", 0.5)).build()


def test_a_clutch_that_closes_keeps_the_momentum():
    """w1 = 1.5 and w2 = 0 become 3/6; then 6 w' = 3 - w/2. Lost: 2.25 - 0.75 J."""
    run = simulate(clutch(), 3.0, rtol=1e-9)
    (event,) = run.events
    assert event.name == "clutch"
    assert event.on == 1
    assert abs(event.time - 1.0) < 1e-9
    assert_allclose([run.flow("a", 0.9999)[0], run.flow("b", 0.9999)[0]], [1.5 * 0.9999, 0.0], rtol=1e-9, atol=1e-12)
    truth = 6.0 - 5.5 * np.exp(-(3.0 - 1.0) * 0.5 / 6.0)
    assert_allclose([run.flow("a", 3.0)[0], run.flow("b", 3.0)[0]], [truth, truth], rtol=1e-9)
    states = run.states([0.5, 3.0])
    assert_allclose(states["p_J2"], [0.0, 4.0 * truth], rtol=1e-9, atol=1e-12)
    braked = solve_ivp(lambda t, y: [(3.0 - 0.5 * y[0]) / 6.0, 0.5 * y[0] ** 2], (1, 3), [0.5, 0.0], rtol=1e-11, atol=1e-12)
    assert_allclose(run.audit.dissipated[-1], 1.5 + braked.y[1, -1], rtol=1e-8)
    assert run.audit.energy < 1e-9
    assert run.reached


@pytest.mark.parametrize(("method", "order"), [("euler", 1), ("rk2", 2), ("rk4", 4)])
def test_equal_steps_pass_from_mode_to_mode_at_their_order(method, order):
    """A clutch that closes; friction that stops a mass and holds it: m v' = -3 - v, v(0) = 2."""
    truth, errors = 6.0 - 5.5 * np.exp(-(3.0 - 1.0) * 0.5 / 6.0), []
    for step in (0.25, 0.125):
        run = simulate(clutch(), 3.0, method=method, step=step)
        errors.append(abs(run.flow("a", 3.0)[0] - truth))
        assert [(e.name, e.on) for e in run.events] == [("clutch", 1)]
        assert errors[-1] / truth < run.error < 1.0
        assert run.audit.power < 1e-12
    assert abs(np.log2(errors[0] / errors[1]) - order) < 0.3
    b = Builder().one("m", displacement="x").on("m", I("M", 1.0), R("rub", lambda f: 3.0 * np.sign(f) + f))
    run = simulate(b.build(), 2.0, initial={"p_M": 2.0}, method=method, step=0.01)
    assert_allclose(run.events[0].time, np.log(5.0 / 3.0), rtol=3e-2 / 100 ** min(order - 1, 2))
    assert run.flow("m", 1.5)[0] == 0.0


def test_inertias_of_a_curved_law_that_join_keep_their_momentum():
    """p + q = 3 + 1, and after it p / (1 + p^2)^(1/2) = q / 2."""
    b = Builder().one("a").one("b").zero("k", when=lambda t: t > 1.0).bond("a", "k").bond("k", "b")
    graph = b.on("a", I("m", lambda p: p / np.sqrt(1.0 + p * p)), Se("F", 1.0)).on("b", I("n", 2.0)).build()
    run = simulate(graph, 1.5, initial={"p_m": 3.0}, method="rk4", step=0.1)
    after = [run.states(1.0 + 1e-9)[name][0] for name in ("p_m", "p_n")]
    assert_allclose(sum(after), 4.0, rtol=1e-8)
    assert_allclose(after[0] / np.hypot(1.0, after[0]), after[1] / 2.0, rtol=1e-12)


@pytest.mark.parametrize("time", [0.7, 3e-6])
def test_a_switch_closes_at_any_time_on_charges_of_any_size(time):
    """4 nC of two capacitors of e = u + 0.2 u^3, 3 u + 0.5 u^3, u = q/1 nC."""
    b = Builder().zero("x").zero("y").one("switch", when=lambda t: t > time).bond("x", "switch").bond("switch", "y")
    b.on("x", C("one", lambda q: q / 1e-9 + 0.2 * (q / 1e-9) ** 3))
    graph = b.on("y", C("two", lambda q: 3.0 * q / 1e-9 + 0.5 * (q / 1e-9) ** 3)).build()
    run = simulate(graph, 2.0 * time, initial={"q_one": 4e-9}, method="rk2", step=0.5 * time)
    assert [event.name for event in run.events] == ["switch"]
    share = brentq(lambda u: u + 0.2 * u**3 - 3.0 * (4.0 - u) - 0.5 * (4.0 - u) ** 3, 0.0, 4.0)
    assert_allclose(
        [run.states(1.5 * time)[n][0] for n in ("q_one", "q_two")], [share * 1e-9, (4 - share) * 1e-9], rtol=1e-9
    )


def test_equal_steps_slip_from_rest():
    graph = Builder().one("x").on("x", I("m", 1.0), Se("F", lambda t: 8.0 * t), R("mu", lambda f: 4.0 * np.sign(f))).build()
    run = simulate(graph, 1.0, method="euler", step=1e-2)
    assert_allclose([run.events[0].time, run.flow("x", 1.0)[0]], [0.5, 1.0], rtol=0.05)


def test_a_mode_has_strokes_and_states_of_its_own():
    assert causality(mode(clutch(), clutch=False)).integral == ("J1", "J2")
    closed = mode(clutch(), clutch=True)
    assert causality(closed).follows["J2"] == "I:J2 follows I:J1"
    assert [str(s) for s in state_equations(closed).states] == ["p_J1"]


@pytest.mark.slow
def test_a_clutch_of_the_speed_closes_where_it_is_reached():
    run = simulate(clutch(lambda f_a, f_b, t: (f_a + 10.0 * f_b > 0.75) | (t > 9.0)), 0.6)
    assert_allclose([e.time for e in run.events], [0.5], rtol=1e-9)
    with pytest.raises(GraphError, match="chatters"):  # the speed falls below it as soon as it closes
        simulate(clutch(lambda f_a: f_a > 0.75), 0.6)
    assert len(simulate(clutch(lambda f_a: f_a > 7.0), 1.0).events) == 0


def test_capacitors_that_are_joined_share_their_charge():
    """4 C on 1 F and nothing on 3 F: 1 V on both, and 6 of 8 J are lost."""
    b = Builder().zero("a").zero("b").one("switch", when=lambda t: t > 1.0).bond("a", "switch").bond("switch", "b")
    run = simulate(b.on("a", C("c1", 1.0)).on("b", C("c2", 3.0)).build(), 2.0, initial={"c1": 4.0})
    assert_allclose(np.ravel(list(run.states([0.5, 1.5]).values())), [4.0, 1.0, 0.0, 3.0], rtol=1e-12, atol=1e-15)
    assert_allclose(run.audit.dissipated[-1], 6.0, rtol=1e-12)
    assert run.audit.energy < 1e-12


def test_a_flow_that_is_switched_off_stops_what_it_carries():
    b = Builder().one("m", when=lambda t: t < 1.0).on("m", I("M", 2.0), Se("F", 1.0))
    run = simulate(b.build(), 2.0)
    assert_allclose(run.flow("m", [0.9, 1.5]), [0.45, 0.0], rtol=1e-9, atol=1e-12)
    assert run.audit.energy < 1e-9


def rectifier(load=5.0):
    b = Builder().one("diode", when=lambda e_diode, f_diode: e_diode + f_diode > 0).zero("out").bond("diode", "out")
    b.on("diode", Se("u", lambda t: 10 * np.sin(t)), R("ri", 0.1)).on("out", C("c", 2.0), R("load", load))
    return b.build()


@pytest.mark.slow
def test_a_diode_rectifier_conducts_where_its_voltage_leads():
    run = simulate(rectifier(), 10.0, rtol=1e-9)
    state, t, times, conducts = [0.0], 0.0, [], True
    while t < 10.0:

        def lead(t, q):
            return 10.0 * np.sin(t) - q[0] / 2.0

        def rate(t, q, on=conducts):
            return [(lead(t, q) / 0.1 if on else 0.0) - q[0] / 10.0]

        lead.terminal, lead.direction = True, -1.0 if conducts else 1.0
        piece = solve_ivp(rate, (t, 10.0), state, events=lead, method="DOP853", rtol=1e-12, atol=1e-12)
        t, state, conducts = piece.t[-1], piece.y[:, -1], not conducts
        times.append(t)
    assert [e.on for e in run.events] == [0, 1, 0][: len(times) - 1]
    assert_allclose([e.time for e in run.events], times[:-1], rtol=1e-9)
    assert_allclose(run.states(10.0)["q_c"], state, rtol=1e-8)
    assert run.audit.energy < 1e-9
    assert run.reached


def test_dry_friction_sticks_until_it_is_overcome():
    """5 sin t on 2 kg that 3 N hold: it leaves at asin 0.6, stops with its momentum used up, leaves at pi + asin 0.6."""
    b = Builder().one("m", "translation", displacement="x")
    b.on("m", I("M", 2.0), R("mu", lambda f: 3.0 * np.sign(f)), Se("F", lambda t: 5.0 * np.sin(t)))
    run = simulate(b.build(), 5.0, rtol=1e-9)
    leaves = np.arcsin(0.6)
    stops = brentq(lambda t: 5.0 * (np.cos(leaves) - np.cos(t)) - 3.0 * (t - leaves), 2.0, 5.0, xtol=1e-15)
    assert [e.on for e in run.events] == [1, 0, -1]
    assert_allclose([e.time for e in run.events], [leaves, stops, np.pi + leaves], rtol=1e-9)
    rests = run.flow("m", np.linspace(stops + 1e-6, np.pi + leaves - 1e-6, 5))
    assert np.abs(rests).max() < 1e-12
    mu = run.effort(run.dynamics.graph.bond_of("mu").number, [0.1, 2.0, 4.5])
    assert_allclose(mu, [5.0 * np.sin(0.1), 3.0, -3.0], rtol=1e-9)
    assert run.audit.energy < 1e-9


def test_an_oscillation_under_dry_friction_loses_the_same_each_half_turn():
    """3 m, 2.5, 2, ... of which each half cycle takes 2 mu/k = 0.5, until 0 m, where it stays."""
    b = Builder().one("m").on("m", I("M", 1.0), C("k", stiffness=4.0), R("mu", lambda f: np.sign(f)))
    run = simulate(b.build(), 10.0, initial={"q_k": 2.9})
    assert [e.on for e in run.events] == [1, -1, 1, -1, 1, 0]
    turns = np.array([e.time for e in run.events])
    assert_allclose(turns, np.pi / 2.0 * np.arange(1, 7), rtol=1e-8)
    assert_allclose(run.states(turns)["q_k"], [-2.4, 1.9, -1.4, 0.9, -0.4, -0.1], atol=1e-7)
    assert run.audit.energy < 1e-9


@pytest.mark.slow
def test_friction_that_varies_and_wet_friction_beside_it():
    """v' = 0.5 - (1 + 0.2 x) - 0.1 v stops, and the slope does not move it again."""
    b = Builder().one("m", displacement="x").on("m", I("M", 1.0), Se("F", 0.5), R("oil", 0.1))
    b.on("m", R("mu", lambda f, x: (1 + 0.2 * x) * np.sign(f)))
    run = simulate(b.build(), 10.0, initial={"m": 2.0})
    stop = lambda t, y: y[0]  # noqa: E731
    stop.terminal = True
    truth = solve_ivp(
        lambda t, y: [0.5 - 1.0 - 0.2 * y[1] - 0.1 * y[0], y[0]], (0, 10), [2.0, 0.0], events=stop, rtol=1e-12, atol=1e-13
    )
    assert_allclose([e.time for e in run.events], truth.t[-1:], rtol=1e-8)
    assert_allclose(run.displacement("x", 10.0), truth.y[1, -1:], rtol=1e-8)


def test_a_load_of_constant_power_is_no_dry_friction():
    """e = P/f has a pole where friction has a jump: m v' = F - P/v."""
    b = Builder().one("m").on("m", I("M", 2.0), Se("F", 3.0), R("load", lambda f: 4.0 / f))
    b.on("m", R("root", lambda f: f / np.sqrt(abs(f))))
    run = simulate(b.build(), 1.0, initial={"m": 5.0})  # where no law is asked for its value at rest
    truth = solve_ivp(lambda t, v: (3.0 - 4.0 / v - v**0.5) / 2.0, (0, 1.0), [5.0], method="DOP853", rtol=1e-12, atol=1e-13)
    assert_allclose(run.flow("m", 1.0), truth.y[:, -1], rtol=1e-8)
    assert run.events == ()


def test_a_condition_that_undoes_itself_chatters():
    b = Builder().one("m").one("drive").zero("relay", when=lambda f_m: f_m < 1.0).bond("drive", "relay").bond("relay", "m")
    b.on("drive", Se("F", 30.0), R("ri", 1.0)).on("relay", R("slip", 1.0)).on("m", I("M", 1.0), R("b", 1.0))
    with pytest.raises(GraphError, match=r"the condition of 0:relay \(bond 1\) chatters at t = 0\.0702403"):
        simulate(b.build(), 5.0)


def test_switched_graphs_are_kept_and_never_simplified_away():
    again = from_data(as_data(clutch()))
    assert again.switched == ("clutch",)
    assert simulate(again, 2.0).events == simulate(clutch(), 2.0).events
    b = Builder().one("a").one("b", when=lambda t: t > 1.0).bond("a", "b").on("a", Se("F", 1.0)).on("b", I("m", 1.0))
    assert simplify(b.build()).graph.switched == ("b",)


WRONG = [
    (lambda: Builder().one("m", when=3), r"1:m: its condition found 3"),
    (lambda: Builder().one("m", when=lambda t: t > 1 and t < 2), r"1:m: its condition cannot be written as a formula"),
    (lambda: clutch(lambda f_z: f_z > 1.0), r"0:clutch, bond 1, bond 2: its condition depends on 'f_z'"),
    (
        lambda: state_equations(clutch()),
        r"0:clutch \(bond 1\) is switched: take one of its modes, mode\(graph, clutch=True\)",
    ),
    (lambda: reduce(clutch(), 0.0, "a"), r"0:clutch \(bond 1\) is switched"),
    (lambda: mode(clutch(), x=True), r"mode 'x': nothing that is switched; found clutch"),
    (lambda: simulate(clutch(), 2.0, breaks={"t": [1.0]}), r"breaks: found .* beside switched junctions"),
    (
        lambda: simulate(clutch(), 2.0, step=1e-6, method="rk4"),
        r"take 28942412 evaluations of the rates by rk4, 2000000 are",
    ),
]


@pytest.mark.parametrize(("wrong", "match"), WRONG)
def test_what_cannot_be_switched_is_named(wrong, match):
    with pytest.raises(GraphError, match=match) as caught:
        wrong()
    assert len(str(caught.value).splitlines()) == 1


def test_a_run_through_several_modes_is_kept_with_its_laws():
    b = Builder().one("a").one("b").zero("clutch", when=sympy.Symbol("t") - 1).bond("a", "clutch").bond("clutch", "b")
    b.on("a", I("J1", 2.0), Se("M", sympy.cos(sympy.Symbol("t")))).on("b", I("J2", 3.0))
    run = simulate(b.build(), 2.0)
    kept = pickle.loads(pickle.dumps(run))
    assert kept.events == run.events
    assert np.array_equal(kept.flow("b"), run.flow("b"))


def test_a_condition_reads_a_signal_that_is_called_as_a_flow():
    b = Builder().one("arm").signal("f_arm").zero("z", when=lambda f_arm: f_arm > 0.5).bond("arm", "z")
    graph = b.on("arm", Se("u", 1.0), R("r", 1.0), I("L", 0.1)).on("z", C("c", 1.0)).build()
    (event,) = simulate(graph, 3.0, signals={"f_arm": np.cos}).events
    assert event.time == pytest.approx(np.pi / 3, abs=1e-9)
