"""Following a machine: what ends a stretch, and how good a motion is."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flywheel
from flywheel.machine.dynamics import Dynamics
from flywheel.motion.transients import transient
from flywheel.regime.free_motion import Goal, Start, follow
from tests import regimes

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


def test_a_governor_that_lets_go_of_its_limit():
    """min(40, max(0, 4 (11 - omega))) on 2 kg m²: 20 rad/s² up to 1 rad/s, then exp(-2 t) towards 11."""
    motion = flywheel.simulate(rotor(drive={"torque": "min(40, max(0, 4*(11 - omega)))"}), 0.0, 0.0, 2.0)
    assert motion.omega[-1] == pytest.approx(11 - 10 * math.exp(-2 * (2 - 0.05)), rel=1e-10)


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
    dynamics = Dynamics(flywheel.Machine(rotor(drive={"torque": 6})), 0.0)
    trail = follow(dynamics, Start(0.0, 0.0), 10.0, 1e-10, [Goal("far", lambda t, phi, omega: 13.5 - phi)])
    assert (trail.goal, trail.t[-1]) == ("far", pytest.approx(3.0, rel=1e-10))
    assert trail.cycles == 2
    assert trail.states(np.array([3.0]))[0, 0] == pytest.approx(13.5, rel=1e-12)


def test_the_end_of_every_cycle_is_asked():
    dynamics = Dynamics(flywheel.Machine(rotor(drive={"torque": 0})), 1.0)
    seen = []

    def passing(t, omega):
        seen.append((t, omega))
        return "enough" if len(seen) == 3 else None

    trail = follow(dynamics, Start(1.0, 2.0), 100.0, 1e-10, [], passing)
    assert trail.goal == "enough"
    np.testing.assert_allclose(seen, [((2 * math.pi * k - 1) / 2, 2.0) for k in (1, 2, 3)], rtol=1e-12)


@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
@pytest.mark.parametrize("name", ["section-c", "kloss-press", "governor"])
def test_the_error_told_is_not_below_the_true_one_nor_far_above(name, rtol):
    machine = flywheel.Machine(flywheel.load(regimes.scene(name, inertia=0.4)))
    motion = flywheel.simulate(machine, 0.5, 3.0, 1.0, rtol=rtol)
    exact = flywheel.simulate(machine, 0.5, 3.0, 1.0, rtol=1e-13)
    times = np.linspace(0.0, 1.0, 101)
    (phi, omega), (true_phi, true_omega) = motion.at(times), exact.at(times)
    true = max(np.abs(phi - true_phi).max() / np.ptp(true_phi), np.abs(omega - true_omega).max() / true_omega.max())
    assert true <= motion.error <= rtol
    assert motion.error < max(1000 * true, 1e-12)  # it is that of a run with ten times the tolerance, doubled


def test_section_c_from_rest():
    """The digests' figures, and 12 digits by another integrator on the reduced equation written out."""
    motion = flywheel.simulate(flywheel.load(regimes.scene("section-c", inertia=0)), math.pi / 2, 0.0, 5.0, rtol=1e-9)
    phi, omega = motion.at([0.5, 1, 2, 5])
    np.testing.assert_allclose(phi, [2.30098, 4.29275, 8.00001, 20.27036], atol=6e-6)
    np.testing.assert_allclose(omega, [2.83038, 4.76466, 3.32778, 3.21967], atol=6e-6)
    assert motion.error <= 1e-9
    true_phi, true_omega = by_hand(5.0)
    assert motion.phi[-1] == pytest.approx(true_phi, rel=1e-9)
    assert motion.omega[-1] == pytest.approx(true_omega, rel=1e-9)


def by_hand(until):
    """Section C's machine with every velocity written out: crank 1 kg m², rod 6 kg and 3 kg m², slider 6 kg."""
    from scipy.integrate import solve_ivp

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

    found = solve_ivp(rates, (0, until), [math.pi / 2, 0.0], "DOP853", rtol=1e-13, atol=1e-14)
    return found.y[:, -1]


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


def test_a_place_where_nothing_weighs_is_named_when_the_motion_comes_to_it():
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
    for force in (3000, "3000 - 2000*v"):
        scene = flywheel.load({"mechanism": toggle, "drive": {"force": force}, "stroke": stroke})
        with pytest.raises(flywheel.SceneError, match=r"m\* = 0 kg at slide position 0.161477 m"):
            transient(scene, end=0.5, rtol=1e-6)
    assert transient(scene, end=0.2, rtol=1e-6).reason == "time"


def test_a_crank_without_mass_is_named_at_its_dead_centres_however_it_is_started():
    """The one piece of its cycle has a dead centre in its middle, where nothing weighs."""
    crank = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.4}, "slider": {"mass": 1}}
    for torque, phi, omega in ((5, 1.0, 0.0), (0, math.pi, 3.0), (0, 1.0, 3.0), ("5 - omega", math.pi, 0.0)):
        scene = {"mechanism": crank, "drive": {"torque": torque}, "regime": {"speed": 10}, "flywheel": {"inertia": 0}}
        with pytest.raises(flywheel.SceneError, match=r"I\* \+ J = 0 kg m² at crank angle 180 deg"):
            flywheel.simulate(flywheel.load(scene), phi, omega, 5.0)
