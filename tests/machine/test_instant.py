import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel.components.motors import DC
from flywheel.machine.dynamics import Anchor, Dynamics
from tests import scenes


def dynamics(scene, inertia=1.0, **given):
    return Dynamics(flywheel.Machine(flywheel.load(scene)), inertia, **given)


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


def test_arrays_say_the_same_as_single_instants():
    found = dynamics(geared(0.9), 3.0)
    omega = np.array([1.0, 2.0, 5.0])
    one_by_one = [found.at(1.0, 3.0, float(w)) for w in omega]
    factors = one_by_one[0].factors
    now = found.along(np.full(3, 1.0), Anchor(3.0, 1.0, 0.0, factors), omega, np.zeros(3))
    assert_allclose(now.acceleration, [each.acceleration for each in one_by_one], rtol=1e-14)
    assert_allclose(now.loss, [each.loss for each in one_by_one], rtol=1e-14)


def test_moments_by_part_add_up_to_the_whole():
    scene = scenes.yoke(
        damper=[{"on": "yoke", "coefficient": 30}],
        gravity={"direction": "0 deg"},
        drive={"torque": "40 - 3*omega"},
        flywheel={"inertia": 1},
    )
    found = dynamics(scene)
    parts = found.moments(np.array([1.0]), Anchor(1.5, 2.0, 0.0), np.array([2.0]), np.zeros(1))
    assert float(parts["drive"][0]) == pytest.approx(34.0)
    assert sum(float(part[0]) for part in parts.values()) == pytest.approx(found.at(1.0, 1.5, 2.0).moment, rel=1e-13)


def test_branches_are_decided_at_the_anchor():
    found = dynamics(scenes.rotor(load=[], drive={"torque": "30 if omega < 5 else 10"}))
    assert found.at(1.0, 3.0, 5.5).moment == 10
    assert found.at(1.0, 3.0, 5.5, anchor=Anchor(3.0, 4.9, 0.0)).moment == 30
    assert float(found.switches(1.0, Anchor(3.0, 4.9, 0.0), 5.5, 0.0)[0]) == pytest.approx(0.5)


def test_a_current_that_is_a_state_of_its_own_drives_in_place_of_the_steady_law():
    motor = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.25, "inductance": 0.002, "friction": 0.002}
    scene = {"shafts": {"fast": {"ratio": 5}}, "drive": {"on": "fast", "motor": motor}, "flywheel": {"inertia": 2}}
    found = dynamics(scene, 2.0)
    now = found.at(0.5, 3.0, 4.0, current=10.0)
    same = DC(voltage=48, resistance=0.4, constant=0.25, inductance=0.002, friction=0.002)
    assert now.moment == pytest.approx(5 * same.torque_of_current(20.0, 10.0))
    assert now.current_rate == pytest.approx(same.current_rate(20.0, 10.0))


def test_many_instants_are_those_one_at_a_time_also_past_where_a_law_ends():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "-sqrt(2 - phi)", "from": 0, "to": 2}], drive={"torque": 0})
    machine, phi = dynamics(scene), np.array([0.5, 1.9, 2.5])
    one = [machine.at(angle, 1.0, 1.0, ends=(0.0, 2.0)).acceleration for angle in phi]
    many = machine.along(phi, Anchor(1.0, None, None), np.ones(3), np.zeros(3), ends=(0.0, 2.0))
    assert_allclose(many.acceleration, one, rtol=1e-14)
