"""The equation of motion of a machine, evaluated and recorded."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import flywheel
from bondgraph import state_equations
from flywheel import Machine
from flywheel.components.motors import DC
from flywheel.machine.dynamics import MachineDynamics
from flywheel.machine.equation import Moments
from flywheel.machine.machine import Anchor
from flywheel.numerics import cells
from tests import regimes, scenes
from tests.regimes import SECTION_C

STEP = 1e-6


# name, a speed at which it runs, a value of the balance, a current
KINDS = {
    "section-c": (4.2, 0.0, None),
    "pump": (12.6, 50.0, None),
    "two-mechanisms": (14.0, 60.0, None),
    "brake": (125.0, 0.1, None),
    "geared-loss": (13.6, 15.0, None),
    "geared-loss-line": (12.5, 0.0, None),
    "dc-inductance": (13.5, 0.0, 11.0),
}


def moments_of(scene):
    machine = Machine(flywheel.load(scene))
    return Moments(machine, cells.cells(machine.mesh))


def case(name):
    """Moments with a speed that varies over the cycle, a balance, a flywheel on the crank, and a current."""
    scene = regimes.scene(name, inertia=0.5)
    if name == "dc-inductance":
        scene["drive"] = scene["drive"] | {"motor": scene["drive"]["motor"] | {"friction": 0.01}}
    moments = moments_of(scene)
    speed, unknown, current = KINDS[name]
    phi = moments.mesh.phi
    omega = speed * (1 + 0.05 * np.sin(phi) - 0.03 * np.cos(2 * phi))
    return moments, omega, unknown, 2.5, () if current is None else (current * (1 + 0.1 * np.cos(phi)),)


@pytest.mark.parametrize("name", KINDS)
def test_slopes_are_those_of_the_moment(name):
    moments, omega, unknown, inertia, states = case(name)
    result = moments.rate(omega, unknown, inertia, states)

    def slope(*changed):
        rows = [[a if b is None else a + s * b for a, b in changed] for s in (1, -1)]
        more, less = (moments.rate(*row[:3], row[3:]).moment for row in rows)
        return (more - less) / (2 * STEP)

    one = STEP * np.ones_like(omega)
    state = [omega, unknown, inertia, *states]
    assert result.by_states.shape == (len(states), *omega.shape)
    for k, analytic in enumerate([result.by_speed, result.by_unknown, result.by_inertia, *result.by_states]):
        changed = [(value, (one if np.ndim(value) else STEP) if j == k else None) for j, value in enumerate(state)]
        numeric = slope(*changed)
        assert_allclose(analytic, numeric, rtol=1e-6, atol=1e-6 * np.abs(result.moment).max())
        assert k != 0 or np.abs(analytic).max() > 0


@pytest.mark.parametrize("name", KINDS)
def test_the_moment_is_that_of_time_stepping(name):
    moments, omega, unknown, inertia, states = case(name)
    result = moments.rate(omega, unknown, inertia, states)
    dynamics = MachineDynamics(moments.machine, inertia, unknown)
    middle = cells.MIDDLE  # where the directions of meshes are decided
    for k in range(0, len(omega), 2):
        phi, anchor = float(moments.mesh.phi[k, middle]), float(moments.mesh.anchor[k, 0])
        now = [float(state[k, middle]) for state in states]
        at = dynamics.at(phi, anchor, float(omega[k, middle]), states=now)
        assert at.moment == pytest.approx(result.moment[k, middle], rel=1e-12, abs=1e-10)
        energy = at.inertia * at.acceleration + 0.5 * moments.slope[k, middle] * omega[k, middle] ** 2
        assert energy == pytest.approx(result.moment[k, middle], rel=1e-11, abs=1e-9)


@pytest.mark.parametrize("efficiency", [0.95, 0.6])
def test_what_a_mesh_loses_is_its_share_of_what_it_transmits(efficiency):
    scene = regimes.scene("geared-loss", inertia=0.05)
    scene["shafts"] = {"motor": {"ratio": 8, "efficiency": efficiency}}
    moments, plain = moments_of(scene), moments_of(scene | {"shafts": {"motor": {"ratio": 8}}})
    omega = 13.6 * (1 + 0.05 * np.sin(moments.mesh.phi))
    (tau,) = moments.rate(omega, 15.0, 3.2).transmitted
    middle = slice(cells.MIDDLE, cells.MIDDLE + 1)
    lost = np.where(tau[:, middle] > 0, (1 / efficiency - 1) * tau, (efficiency - 1) * tau)
    assert (lost[:, middle] >= 0).all()
    assert {True, False} == set((tau[:, middle] > 0).ravel().tolist())  # it changes sides within the cycle
    gap = plain.rate(omega, 15.0, 3.2).moment - moments.rate(omega, 15.0, 3.2).moment
    assert_allclose(gap, lost, rtol=1e-11, atol=1e-10)
    # tau = I_s alpha + ½ I_s' omega² - M_s of all behind the mesh, alpha that of the whole machine
    alpha = (moments.rate(omega, 15.0, 3.2).moment - 0.5 * moments.slope * omega**2) / (3.2 + moments.inertia)
    assert_allclose(tau, (3.2 + 64 * 0.01) * alpha - 8 * 15.0, rtol=1e-10)


def test_speeds_may_be_many_at_once():
    for name in ("kloss-press", "geared-loss-line", "dc-inductance"):
        moments = moments_of(regimes.scene(name, inertia=0.5))
        speeds = np.array([3.0, 8.0, 13.0])
        every = moments.constant(speeds, 0.0)
        for k, speed in enumerate(speeds.tolist()):
            for name, one in moments.constant(speed, 0.0)._asdict().items():
                rows = getattr(every, name)
                mine = [row[k] for row in rows] if name in ("by_states", "transmitted") else rows[k]
                assert_allclose(np.ravel(mine), np.ravel(one), rtol=1e-14)


def test_at_a_constant_speed_nothing_is_accelerated():
    moments = moments_of(regimes.scene("geared-loss", inertia=0.05))
    result, speed, phi = moments.constant(13.0, 15.0), 13.0, moments.mesh.phi
    # the motor's shaft carries the drive alone: 120 N m at the crank drives it through the mesh at 0.9
    plain = moments.machine.reduction.moments(phi, moments.mesh.anchor, 15.0)
    others = sum(value for name, value in plain.items() if name != "drive")
    assert_allclose(result.moment, others + 0.9 * 8 * 15.0, rtol=1e-13)
    assert_allclose(result.by_unknown, 0.9 * 8)
    (tau,) = moments.constant_losses(speed, 15.0)
    assert_allclose(tau, -8 * 15.0)


def test_a_steady_current_is_that_of_the_line():
    moments = moments_of(regimes.scene("dc-inductance", inertia=0.1))
    assert_allclose(moments.steady_states(np.array([0.0, 10.0]))[0], [220 / 0.8, (220 - 1.5 * 100) / 0.8])
    result = (
        moments.constant(10.0, 0.0).moment
        - moments.machine.reduction.moments(moments.mesh.phi, moments.mesh.anchor)["load[0] on slider-crank.slider"]
    )
    assert_allclose(result, 10 * 1.5 * (220 - 150) / 0.8, rtol=1e-12)


@pytest.mark.parametrize(("name", "torque"), [("section-c", lambda w: 10 - 2.387 * w), ("pump", lambda w: 50 + 0 * w)])
def test_the_drives_share_is_its_own_torque(name, torque):
    moments, omega, unknown, _, states = case(name)
    assert_allclose(moments.drive(omega, unknown, states), torque(omega), rtol=1e-14)


def test_switches_are_what_decides_branches_at_a_speed():
    moments = moments_of(regimes.scene("governor", inertia=0.5))
    omega = 13.0 + 0.5 * np.sin(moments.mesh.phi)
    result = [switch for switch in moments.switches(omega) if np.ptp(switch) > 0]
    inner = 4 * (110 - 8 * omega)  # max(0, inner) and min(40, that)
    assert any(np.allclose(np.abs(switch), np.abs(inner)) for switch in result)
    assert any(np.allclose(np.abs(switch), np.abs(40 - np.maximum(inner, 0))) for switch in result)


def test_an_efficiency_of_next_to_nothing_keeps_its_digits():
    """The drive pays the work of the load through ratio and efficiency: 80 J = 2 pi 2 eta u."""
    scene = {
        "shafts": {"s": {"ratio": 2, "efficiency": 1e-6}},
        "inertia": [{"on": "crank", "value": 0.3}],
        "load": [{"on": "crank", "torque": -80, "from": 1, "to": 2}],
        "drive": {"on": "s", "torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"irregularity": 0.01},
    }
    result = flywheel.size(flywheel.load(scene), simulate=False)
    assert result.balance.value == pytest.approx(80 / (4 * np.pi * 1e-6), rel=4e-15)
    assert result.error.exact < 1e-12


def dynamics(scene, inertia=1.0, **inputs):
    return MachineDynamics(flywheel.Machine(flywheel.load(scene)), inertia, **inputs)


def geared(efficiency):
    """A wheel of 3 kg m² on the crank, and through a mesh a rotor of 0.5 kg m² four times as fast, which 7 N m drives."""
    return {
        "shafts": {"motor": {"ratio": 4, "efficiency": efficiency}},
        "inertia": [{"on": "motor", "value": 0.5}],
        "load": [{"on": "crank", "torque": "-20"}],
        "drive": {"on": "motor", "torque": "7 - 0.01*omega"},
        "flywheel": {"inertia": 3},
    }


def test_laws_are_read_just_inside_a_piece_where_its_end_is_not_defined():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "-sqrt(2 - phi)", "from": 0, "to": 2}], drive={"torque": 0})
    assert dynamics(scene).at(2.5, 1.0, 1.0, ends=(0.0, 2.0)).moment == pytest.approx(0.0, abs=1e-4)


def test_what_a_mesh_loses_follows_from_the_forces_on_both_sides():
    """The rotor's own equation: torque to the mesh = 7 - 0.01*4*2 - 0.5*4*alpha; the crank gets eta of it, four times."""
    eta, omega = 0.8, 2.0
    now = dynamics(geared(eta), 3.0).at(1.0, 3.0, omega)
    to_mesh = 7 - 0.01 * 4 * omega - 0.5 * 4 * now.acceleration
    assert to_mesh > 0
    assert 3 * now.acceleration == pytest.approx(-20 + eta * 4 * to_mesh, rel=1e-13)
    assert now.loss == pytest.approx((1 - eta) * 4 * to_mesh, rel=1e-13)
    assert now.inertia == pytest.approx(3 + 0.5 * 16)
    assert now.inertia * now.acceleration == pytest.approx(now.moment, rel=1e-13)


def test_a_mesh_that_is_driven_from_the_crank_loses_the_other_way_round():
    scene = geared(0.8) | {"drive": {"on": "motor", "torque": "-7 - 0.01*omega"}, "load": []}
    now = dynamics(scene, 3.0).at(1.0, 3.0, 2.0)
    to_rotor = 0.5 * 4 * now.acceleration + 7 + 0.01 * 4 * 2
    assert to_rotor > 0
    assert 3 * now.acceleration == pytest.approx(-4 * to_rotor / 0.8, rel=1e-13)


def test_moments_by_part_add_up_to_the_whole():
    scene = scenes.yoke(
        damper=[{"on": "yoke", "coefficient": 30}],
        gravity={"direction": "0 deg"},
        drive={"torque": "40 - 3*omega"},
        flywheel={"inertia": 1},
    )
    result = dynamics(scene)
    parts = result.moments(np.array([1.0]), Anchor(1.5, 2.0, 0.0), np.array([2.0]), np.zeros(1))
    assert float(parts["drive"][0]) == pytest.approx(34.0)
    assert sum(float(part[0]) for part in parts.values()) == pytest.approx(result.at(1.0, 1.5, 2.0).moment, rel=1e-13)


def test_branches_are_decided_at_the_anchor():
    result = dynamics(scenes.rotor(load=[], drive={"torque": "30 if omega < 5 else 10"}))
    assert result.at(1.0, 3.0, 5.5).moment == 10
    assert result.at(1.0, 3.0, 5.5, anchor=Anchor(3.0, 4.9, 0.0)).moment == 30
    assert float(result.switches(1.0, Anchor(3.0, 4.9, 0.0), 5.5, 0.0)[0]) == pytest.approx(0.5)


def test_a_current_that_is_a_state_of_its_own_drives_in_place_of_the_steady_law():
    motor = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.25, "inductance": 0.002, "friction": 0.002}
    scene = {"shafts": {"fast": {"ratio": 5}}, "drive": {"on": "fast", "motor": motor}, "flywheel": {"inertia": 2}}
    result = dynamics(scene, 2.0)
    now = result.at(0.5, 3.0, 4.0, states=(10.0,))
    same = DC(voltage=48, resistance=0.4, constant=0.25, inductance=0.002, friction=0.002)
    assert now.moment == pytest.approx(5 * same.circuit.torque(20.0, (10.0,)))
    assert now.rates[0] == pytest.approx(same.current_rate(20.0, 10.0))


MOTOR = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.3, "inductance": 0.02, "friction": 0.01}
SHAFT = {"ratio": 3.0, "stiffness": 40.0, "damping": 0.05}


def scene(shaft, **motor):
    return flywheel.load(
        {
            "shafts": {"motor": shaft},
            "inertia": [{"on": "motor", "value": 0.15}, {"on": "crank", "value": 1.0}],
            "load": [{"on": "crank", "torque": "-4 - 0.5*omega"}],
            "drive": {"on": "motor", "motor": {**MOTOR, **motor}},
            "flywheel": {"inertia": 0.5},
        }
    )


def by_hand(until, inductance):
    """Two wheels, the spring between them and the circuit, written out: crank, its speed, motor, its speed, current."""

    def rates(t, y):
        phi, omega, angle, speed, current = y
        twist = 40.0 * (3 * phi - angle) + 0.05 * (3 * omega - speed)
        steady = (48.0 - 0.3 * speed) / 0.4
        driving = 0.3 * (current if inductance else steady) - 0.01 * speed
        slope = (48.0 - 0.4 * current - 0.3 * speed) / inductance if inductance else 0.0
        return [omega, (-4 - 0.5 * omega - 3 * twist) / 1.5, speed, (driving + twist) / 0.2, slope]

    result = solve_ivp(rates, (0, until), [0.0, 5.0, 0.0, 15.0, 0.0], "DOP853", rtol=1e-12, atol=1e-12)
    return result.y[:, -1]


@pytest.mark.parametrize("inductance", [0.02, 0.0])
def test_a_motor_on_a_compliant_shaft_moves_as_its_equations_written_by_hand(inductance):
    motion = flywheel.simulate(scene(SHAFT, inductance=inductance, inertia=0.05), 0.0, 5.0, 0.5, rtol=1e-9)
    phi, omega, _, speed, current = by_hand(0.5, inductance)
    assert motion.phi[-1] == pytest.approx(phi, rel=1e-8)
    assert motion.omega[-1] == pytest.approx(omega, rel=1e-8)
    assert motion.run is not None
    assert motion.run.flow("motor", np.array([0.5]))[0] == pytest.approx(speed, rel=1e-8)
    steady = (48.0 - 0.3 * speed) / 0.4
    expected = current if inductance else steady
    assert motion.run.flow("drive.motor.armature", np.array([0.5]))[0] == pytest.approx(expected, rel=1e-7)


def test_the_rotor_counts_once():
    graph = Machine(scene({"ratio": 3.0}, inertia=0.05)).with_values(0.0, 0.5)
    assert sum(e.law for e in graph.of_kind("I") if e.part != "" or "inertia" in e.name) == pytest.approx(1.7)
    assert "drive.motor.inductance" in graph.elements


def test_state_equations_of_machines_whose_loads_depend_on_speed_are_those_of_time_stepping():
    machine = SECTION_C | {"load": [{"on": "slider-crank.slider", "force": "-20*v - 3*(t > 0.5)*omega"}]}
    own = Machine(flywheel.load(machine | {"flywheel": {"inertia": 2}}))
    equations = state_equations(own.with_values(1.3, 2.0))
    inertia = next(element.law for element in equations.graph.of_kind("I"))
    omega, t = 4.4, 1.0
    ratios = {d.name: own.scene.shafts[d.of] for d in equations.graph.displacements.values()}
    for phi in (0.4, 2.3, 4.9):
        states = [inertia * omega if str(s).startswith("p_") else ratios[str(s)] * phi for s in equations.states]
        rate = equations.numeric()(t, states)[0] / inertia
        expected = MachineDynamics(own, 2.0, 1.3).at(phi, float(own.anchors(phi)), omega, t).acceleration
        assert rate == pytest.approx(expected, rel=1e-12)


def test_the_current_at_the_start_is_taken_on_a_compliant_shaft_too():
    motion = flywheel.simulate(scene(SHAFT, inertia=0.05), 0.0, 5.0, 1e-3, rtol=1e-9, current=70.0)
    assert motion.current is not None
    assert motion.current[0] == pytest.approx(70.0, rel=1e-12)
    with pytest.raises(flywheel.SceneError, match="current"):
        flywheel.simulate(scene(SHAFT, inductance=0.0), 0.0, 5.0, 1e-3, current=70.0)
