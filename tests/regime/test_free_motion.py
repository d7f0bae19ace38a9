"""The motion from any start: what ends a stretch, how good it is, cycles that return, and how it ends."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flywheel
from bondgraph.motion.stepping import Step
from flywheel import Machine, transient
from flywheel.machine.dynamics import MachineDynamics, StartState, later, source
from flywheel.numerics.budget import counted
from flywheel.regime.branch import Outcome, outcome_of
from flywheel.regime.free_motion import Goal, SwitchingTimes, follow, returns
from tests import regimes, scenes
from tests.limits import sample

EXAMPLES = Path(__file__).parents[2] / "examples" / "regimes"


def rotor(inertia=2.0, **parts):
    scene = {"inertia": [{"on": "crank", "value": inertia}], "regime": {"speed": 5}, "flywheel": {"inertia": 0}}
    return flywheel.load(scene | parts)


def test_a_torque_that_switches_at_a_speed_switches_there():
    """30 N m up to 5 rad/s, then 10: the speed is met after 1/3 s, and a step ends there."""
    motion = flywheel.simulate(rotor(drive={"torque": "30 if omega < 5 else 10"}), 0.0, 0.0, 1.0)
    assert np.abs(motion.t - 1 / 3).min() < 1e-13
    assert motion.omega[-1] == pytest.approx(5 + 5 * (2 / 3), rel=1e-12)
    assert motion.phi[-1] == pytest.approx(5 / 6 + 10 / 3 + 2.5 * 4 / 9, rel=1e-12)
    assert motion.t.size < 25


def test_a_switch_of_position_and_speed_together():
    """The brake comes on where v = 0.3 omega² passes 3.. in a law of both: omega + phi > 4."""
    motion = flywheel.simulate(rotor(drive={"torque": "4 if omega + phi < 4 else -4"}), 0.0, 0.0, 1.7)
    first = -1 + math.sqrt(1 + 4)  # 2 t + t² = 4
    speed = 2 * first
    assert np.abs(motion.t - first).min() < 1e-12
    assert motion.omega[-1] == pytest.approx(speed - 2 * (1.7 - first), rel=1e-11)


def test_a_motion_that_both_sides_of_a_switch_hold_is_refused():
    with pytest.raises(flywheel.SceneError, match=r"sticks.*5 rad/s"):
        flywheel.simulate(rotor(drive={"torque": "30 if omega < 5 else -10"}), 0.0, 0.0, 1.0)


def test_a_goal_of_its_own_ends_a_motion():
    dynamics = MachineDynamics(flywheel.Machine(rotor(drive={"torque": 6})), 0.0)
    trail = follow(dynamics, StartState(0.0, 0.0), 10.0, 1e-10, [Goal("far", lambda t, phi, omega: 13.5 - phi)])
    assert (trail.goal, trail.t[-1]) == ("far", pytest.approx(3.0, rel=1e-10))
    assert trail.cycles == 2
    assert trail.states(np.array([3.0]))[0, 0] == pytest.approx(13.5, rel=1e-12)


def test_the_end_of_every_cycle_is_asked():
    dynamics = MachineDynamics(flywheel.Machine(rotor(drive={"torque": 0})), 1.0)
    seen = []

    def passing(t, omega):
        seen.append((t, omega))
        return "enough" if len(seen) == 3 else None

    trail = follow(dynamics, StartState(1.0, 2.0), 100.0, 1e-10, [], passing)
    assert trail.goal == "enough"
    np.testing.assert_allclose(seen, [((2 * math.pi * k - 1) / 2, 2.0) for k in (1, 2, 3)], rtol=1e-12)


@pytest.mark.parametrize(("name", "rtol"), sample([("governor", 1e-9), ("section-c", 1e-5)], 2))
def test_the_error_told_is_not_below_the_true_one_nor_far_above(name, rtol):
    machine = flywheel.Machine(flywheel.load(regimes.scene(name, inertia=0.4)))
    motion = flywheel.simulate(machine, 0.5, 3.0, 1.0, rtol=rtol)
    exact = flywheel.simulate(machine, 0.5, 3.0, 1.0, rtol=1e-13)
    times = np.linspace(0.0, 1.0, 101)
    (phi, omega), (true_phi, true_omega) = motion.at(times), exact.at(times)
    true = max(np.abs(phi - true_phi).max() / np.ptp(true_phi), np.abs(omega - true_omega).max() / true_omega.max())
    assert true <= motion.error <= rtol
    assert motion.error < max(1000 * true, 1e-12)  # it is that of a run with ten times the tolerance, doubled


@pytest.mark.parametrize("until", sample([1.0, 5.0], 2))
def test_section_c_from_rest(until):
    """The digests' figures, and 12 digits by another integrator on the reduced equation written out."""
    motion = flywheel.simulate(flywheel.load(regimes.scene("section-c", inertia=0)), math.pi / 2, 0.0, until, rtol=1e-9)
    times = [t for t in (0.5, 1.0, 2.0, 5.0) if t <= until]
    phi, omega = motion.at(times)
    np.testing.assert_allclose(phi, [2.30098, 4.29275, 8.00001, 20.27036][: len(times)], atol=6e-6)
    np.testing.assert_allclose(omega, [2.83038, 4.76466, 3.32778, 3.21967][: len(times)], atol=6e-6)
    assert motion.error <= 1e-9
    assert (phi[-1], omega[-1]) == pytest.approx(by_hand(until), rel=1e-9)


def by_hand(until):
    """Section C's machine with every velocity written out: crank 1 kg m², rod 6 kg and 3 kg m², slider 6 kg."""
    r, rod, half = 0.2, 0.6, 0.3

    def rates(t, y):
        sin, cos = math.sin(y[0]), math.cos(y[0])
        root = math.sqrt(rod**2 - (r * sin) ** 2)
        turn = -r * cos / root
        turn_slope = r * sin / root - r * cos * r**2 * sin * cos / root**3
        slide = -r * sin - r**2 * sin * cos / root
        slide_slope = -r * cos - r**2 * (cos**2 - sin**2) / root - r**4 * (sin * cos) ** 2 / root**3
        x, y_ = 0.5 * (-r * sin + slide), (1 - half / rod) * r * cos
        x_slope, y_slope = 0.5 * (-r * cos + slide_slope), -(1 - half / rod) * r * sin
        inertia = 1 + 3 * turn**2 + 6 * (x**2 + y_**2) + 6 * slide**2
        slope = 3 * turn * turn_slope + 6 * (x * x_slope + y_ * y_slope) + 6 * slide * slide_slope
        moment = 10 - 2.387 * y[1] - 6 * 9.81 * y_
        return [y[1], (moment - slope * y[1] ** 2) / inertia]

    result = solve_ivp(rates, (0, until), [math.pi / 2, 0.0], "DOP853", rtol=1e-12, atol=1e-13)
    return result.y[:, -1]


def test_quadratic_drag_counts_when_a_motor_with_inductance_starts():
    """omega' = 1.3 i - 3 omega², i' = (220 - 2 i - 1.3 omega)/0.025, by another integrator."""

    def rates(t, y):
        return [1.3 * y[1] - 3 * y[0] ** 2, (220 - 2 * y[1] - 1.3 * y[0]) / 0.025]

    motor = {"type": "dc", "voltage": 220, "resistance": 2, "constant": 1.3, "inductance": 0.025}
    drag = {"on": "crank", "torque": "-3*omega*abs(omega)"}
    own = solve_ivp(rates, (0, 0.3), [0, 0], "DOP853", rtol=1e-11, atol=1e-12)
    run = transient(rotor(1.0, load=[drag], drive={"motor": motor}), end=0.3)
    assert run.omega == pytest.approx(own.y[0, -1], rel=1e-8)


@pytest.mark.slow
def test_a_step_that_tries_beyond_the_stroke_is_not_a_fault():
    raw = tomllib.loads((EXAMPLES / "hydraulic_clamp.toml").read_text(encoding="utf-8"))
    raw["parameters"]["throttle"] = 4 * 18.6e3
    assert flywheel.simulate(flywheel.load(raw), phi=-0.06, omega=0.0, until=5.0, rtol=1e-6).ended


@pytest.mark.parametrize("force", sample(["3000 - 2000*v", 3000], 2))
def test_a_place_where_nothing_weighs_is_named_when_the_motion_comes_to_it(force):
    """The driver of a toggle passes 161.477 mm while every mass stands."""
    toggle = {
        "type": "toggle-clamp",
        "frame": {"height": "140 mm"},
        "bell_crank": {"drive_length": "167.63 mm", "clamp_length": "220 mm", "angle": "17.303 deg", "mass": "16 kg"},
        "coupler": {"length": "95 mm"},
        "rod": {"length": "260 mm", "mass": "17 kg", "com": "130 mm"},
        "platen": {"mass": "298 kg"},
    }
    stroke = {"from": "-60 mm", "to": "190 mm", "speed": "330 mm/s"}
    scene = flywheel.load({"mechanism": toggle, "drive": {"force": force}, "stroke": stroke})
    with pytest.raises(flywheel.SceneError, match=r"m\* = 0 kg at slide position 0.161477 m"):
        transient(scene, end=0.5, rtol=1e-4)
    assert transient(scene, end=0.2, rtol=1e-4).reason == "time"


@pytest.mark.parametrize(("torque", "phi"), sample([(5, 1.0), ("5 - omega", math.pi)], 2))
def test_a_crank_without_mass_is_named_at_its_dead_centres_however_it_is_started(torque, phi):
    """The one piece of its cycle has a dead centre in its middle, where nothing weighs."""
    crank = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.4}, "slider": {"mass": 1}}
    scene = {"mechanism": crank, "drive": {"torque": torque}, "regime": {"speed": 10}, "flywheel": {"inertia": 0}}
    with pytest.raises(flywheel.SceneError, match=r"I\* \+ J = 0 kg m² at crank angle 180 deg"):
        flywheel.simulate(flywheel.load(scene), phi, 0.0, 5.0)


YOKE = {
    "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.1, "inertia": 0.05}, "yoke": {"mass": 2}},
    "regime": {"speed": 10},
    "flywheel": {"inertia": 0.0},
}


PUSH = [{"on": "yoke", "force": -50, "while": "v > 0"}]


def yoke(**more):
    return Machine(flywheel.load(YOKE | more))


def followed(until, goals=(), passing=None, **more):
    return follow(MachineDynamics(yoke(**more), 0.0), StartState(0.0, 10.0), until, 1e-9, goals, passing)


@pytest.mark.parametrize(
    ("more", "balance", "back"),
    [
        ({}, 0.0, True),
        ({"spring": [{"on": "yoke", "stiffness": 100}]}, 0.0, True),
        ({"load": PUSH, "drive": {"torque": "balance"}}, 50 * 0.2 / (2 * np.pi), True),
        ({"load": PUSH, "drive": {"torque": "balance"}}, 50 * 0.2 / (2 * np.pi) * (1 + 1e-9), False),
        ({"drive": {"torque": "1e-6"}}, 0.0, False),
        ({"drive": {"torque": "1 - 0.1*omega"}}, 0.0, False),
        ({"load": [{"on": "crank", "torque": "sin(t)"}]}, 0.0, False),
    ],
)
def test_a_speed_returns_where_the_work_of_a_cycle_is_zero_whatever_it_is(more, balance, back):
    assert returns(yoke(**more), balance) is back


def test_a_later_step_tells_the_same_later():
    step = Step(lambda t: np.array([t, 2 * t]), 1.0, 3.0)
    moved = later(step, 10.0)
    assert (moved.start, moved.end) == (11.0, 13.0)
    assert moved.dense(12.0).tolist() == [2.0, 4.0]
    assert source(moved) is source(step) is step.dense


@pytest.mark.slow
def test_what_is_repeated_is_what_would_be_stepped(monkeypatch):
    monkeypatch.setattr("flywheel.regime.free_motion.FEWEST", 4)
    repeated = followed(5.0)
    monkeypatch.setattr("flywheel.regime.free_motion.returns", lambda machine, balance: False)
    stepped = followed(5.0)
    assert repeated.repeated > 4
    assert stepped.repeated == 0
    assert stepped.cycles == repeated.cycles
    times = np.linspace(0.0, 5.0, 100)
    assert np.abs(repeated.states(times)[:2] - stepped.states(times)[:2]).max() < 1e-6


def test_a_goal_far_away_is_found_where_it_lies():
    there = 40.3 * 2 * np.pi
    trail = followed(1e4, [Goal("there", lambda t, phi, omega: there - phi)])
    assert trail.goal == "there"
    assert trail.repeated > 30
    assert trail.ends()[0, -1] == pytest.approx(there, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("more", [{}, {"load": PUSH, "drive": {"torque": "8 - 0.2*omega"}}], ids=["repeats", "settles"])
def test_a_motion_without_a_last_time_goes_on_until_it_is_ended(more):
    seen = []

    def passing(t, omega):
        seen.append(t)
        return "enough" if len(seen) == 40 else None

    trail = followed(np.inf, passing=passing, **more)
    assert (trail.goal, trail.cycles) == ("enough", 40)
    assert (trail.repeated > 0) is not bool(more)
    assert trail.t[-1] == seen[-1]


def times(torque, until, **inputs):
    scene = scenes.rotor(load=[{"on": "crank", "torque": torque}], drive={"torque": 5}, **inputs)
    return SwitchingTimes(flywheel.Machine(flywheel.load(scene)), until)


def test_steps_and_periodic_switches_are_all_found():
    assert times("-50 - 30*(t > 2)", 10.0).every() == [2.0]
    result = times("-(sin(50*t) > 0.99)", 1.0).every()
    rise, fall = np.arcsin(0.99) / 50, (np.pi - np.arcsin(0.99)) / 50
    expected = sorted([rise + k * np.pi / 25 for k in range(8)] + [fall + k * np.pi / 25 for k in range(8)])
    np.testing.assert_allclose(result, expected, rtol=1e-13)


def test_a_short_pulse_is_not_missed():
    result = times("-1e4*(t > 3)*(t < 3.0000001)", 100.0).every()
    np.testing.assert_allclose(result, [3.0, 3.0000001], rtol=1e-14)


def test_what_depends_on_more_than_time_is_not_looked_for():
    assert times("-(t > omega)", 10.0).every() == []


def test_without_an_end_stretch_after_stretch_is_looked_through():
    result = times("-(t > 1000)", np.inf)
    stops = [result.after(0.0)]
    while stops[-1] < 1100.0:
        stops.append(result.after(stops[-1]))
    assert min(abs(stop - 1000.0) for stop in stops) < 1e-9


def test_too_many_switches_are_a_fault():
    with pytest.raises(flywheel.SceneError, match="too often"):
        times("-(sin(1e7*t) > 0.5)", 100.0).every()


def test_a_steep_pulse_is_closed_in_and_a_gentle_law_is_left_alone():
    result = np.array(times("-50*exp(-((t - 2)/0.002)**2)", 10.0).every())
    assert np.min(np.abs(result - 2.0)) < 0.01
    assert np.min(np.diff(result)) < 0.01
    assert times("-5 - 0.1*t", 10.0).every() == []


def test_a_law_of_time_without_a_value_is_told_with_its_reason():
    scene = {"inertia": [{"on": "crank", "value": 1}], "load": [{"on": "crank", "torque": "-5/(t-2)"}]}
    machine = flywheel.load({**scene, "drive": {"torque": "200 - 8*omega"}, "flywheel": {"inertia": 0.1}})
    with pytest.raises(flywheel.SceneError, match=r"near t = 2 \(.*: a division by t - 2, which is 0\)"):
        flywheel.simulate(machine, phi=0.0, omega=20.0, until=5.0)


SINE = {
    "inertia": [{"on": "crank", "value": 2}],
    "load": [{"on": "crank", "torque": "sin(omega*1e9) - 60*sin(phi)"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 13.6},
    "flywheel": {"inertia": 10},
}


def driven(drive, load):
    scene = {"load": [{"on": "crank", "torque": load}], "drive": {"torque": drive}, "flywheel": {"inertia": 2.0}}
    return Machine(flywheel.load({**scene, "regime": {"speed": 10}}))


def test_a_machine_that_stalls_is_stopped_where_its_energy_ends():
    """J omega²/2 = M phi: 100 J are gone after 10 rad against 10 N m."""
    ending = outcome_of(driven("0*omega", -10.0), 10.0, 2.0, 0.0)
    assert ending.outcome is Outcome.STALLS
    angle = np.degrees(10.0 % (2 * np.pi))
    assert f"crank angle {angle:.6g} deg" in ending.where
    assert ending.where.endswith("after 2 s")


def test_a_machine_that_runs_away():
    assert outcome_of(driven("30 + omega", -10.0), 10.0, 2.0, 0.0).outcome is Outcome.RUNS_AWAY


def test_a_machine_too_stiff_to_be_followed_is_given_up(monkeypatch):
    monkeypatch.setattr("flywheel.regime.branch._WORK", 3_000.0)
    assert outcome_of(driven("1e7*(10 - omega)", -10.0), 10.0, 1e-3, 0.0).outcome is Outcome.UNKNOWN


def test_how_far_a_machine_is_followed_does_not_depend_on_the_clock(monkeypatch):
    """A sine that fast is given up: each time at the same work, and in a hurry after a third of it."""
    monkeypatch.setattr("flywheel.regime.branch._WORK", 1_500.0)
    monkeypatch.setattr("flywheel.regime.branch._HURRIED", 500.0)
    scene, taken = flywheel.load(SINE), []
    for hurried in (True, True, False):
        machine = Machine(scene)
        with counted() as tally, np.errstate(all="ignore"):  # as within a sizing
            assert outcome_of(machine, 13.6, 10.0, 0.0, hurried=hurried).outcome is Outcome.UNKNOWN
        taken.append(tally.evaluations)
    assert taken[0] == taken[1]
    assert 2 * taken[0] < taken[2] < 4 * taken[0]


def test_dry_and_viscous_drag_in_one_law_hold_and_release_a_machine_of_many_pieces() -> None:
    """30 t - 20 - 2 omega from t = 2/3 on; where one program served all pieces, no motion was found from there."""
    windows = [{"on": "crank", "torque": -1e-12, "from": f"{30 * k} deg", "to": f"{30 * k + 10} deg"} for k in range(1, 11)]
    load = [{"on": "crank", "torque": "-20*(sign(v) + v/10)"}, *windows]
    scene = {"inertia": [{"on": "crank", "value": 1}], "load": load, "drive": {"torque": "30*t"}, "flywheel": {"inertia": 0}}
    run = flywheel.simulate(flywheel.load(scene), 0.5, 0.0, 2.0, rtol=1e-9)
    moving = 2.0 - 2.0 / 3.0
    assert run.omega[-1] == pytest.approx(15 * moving - 7.5 * (1 - np.exp(-2 * moving)), rel=1e-9)
