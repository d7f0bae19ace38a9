import numpy as np
from numpy.testing import assert_allclose

import flywheel
from tests import regimes, scenes

PHI = np.linspace(0, 6, 13)


def test_parts_add_up_to_the_whole():
    state = flywheel.reduce(flywheel.load(scenes.press()), PHI)
    assert_allclose(sum(state.inertia_parts.values()), state.inertia, rtol=1e-13)
    assert_allclose(sum(state.moment_parts.values()), state.moment, rtol=1e-12, atol=1e-9)


def test_the_balance_is_solved_for_unless_given():
    scene = flywheel.load(scenes.yoke())
    solved, given = flywheel.reduce(scene, [4.0]), flywheel.reduce(scene, [4.0], balance=100.0)
    assert_allclose(solved.moment, 500 / np.pi)
    assert_allclose(given.moment, 100.0)


def test_influence_coefficients_have_their_slopes():
    scene = flywheel.load(scenes.shaper())
    step = 1e-6
    state = flywheel.reduce(scene, PHI)
    higher, lower = (flywheel.reduce(scene, PHI + d) for d in (step, -step))
    for name, gain in state.gains.items():
        slope = (higher.gains[name] - lower.gains[name]) / (2 * step)
        inside = PHI > 0.01
        assert_allclose(state.gain_slopes[name][inside], slope[inside], atol=1e-8)
        assert gain.shape == PHI.shape


def test_ports_that_carry_nothing_have_their_coefficients_too():
    bare = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}}
    scene = flywheel.load({"mechanism": bare, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    state = flywheel.reduce(scene, [np.pi / 2])
    assert_allclose(state.gains["slider-crank.slider"], -0.1)
    assert_allclose(state.gains["slider-crank.rod"], 0.0, atol=1e-16)
    assert_allclose(state.inertia, 0.0)


# -- torques that depend on speed ----------------------------------------------------------------------------------------


def test_the_moment_at_a_speed_holds_loads_dampers_and_the_drive():
    scene = flywheel.load(regimes.scene("yoke", inertia=3))
    state = flywheel.reduce(scene, PHI, speed=8.0)
    gain = -0.3 * np.sin(PHI)
    load = np.where(gain < 0, gain * (-200 - 30 * gain * 8 * np.abs(gain * 8)), 0.0)
    assert_allclose(state.moment, 160 - 12 * 8 - 150 * gain**2 * 8 + load, rtol=1e-12, atol=1e-12)
    assert_allclose(sum(state.moment_parts.values()), state.moment, rtol=1e-12, atol=1e-12)
    assert set(state.moment_parts) == {"drive", "load[0] on scotch-yoke.yoke", "damper[0] on scotch-yoke.yoke"}
    faster = flywheel.reduce(scene, PHI, speed=9.0)
    assert_allclose(faster.inertia, state.inertia)
    assert (faster.moment < state.moment).all()


def test_without_a_speed_it_is_the_one_asked_for_or_that_of_zero_net_work():
    scene = flywheel.load(regimes.scene("pump", inertia=5))
    asked = flywheel.reduce(scene, PHI)
    given = flywheel.reduce(scene, PHI, speed=4 * np.pi)
    balance = float(regimes.figures("pump")["constant"]["balance"])
    assert_allclose(asked.moment, given.moment)
    assert_allclose(asked.moment_parts["drive"], balance, rtol=1e-9)
    free = flywheel.reduce(flywheel.load(regimes.scene("section-c", inertia=0)), PHI)
    assert_allclose(
        free.moment_parts["drive"], 10 - 2.387 * float(regimes.figures("section-c")["constant"]["speed"]), atol=1e-14
    )


def test_a_branch_that_a_velocity_decides_is_taken_where_the_machine_stands():
    """Drag past 1.2 m/s: at 8 rad/s none of it within 30 deg of the dead centre."""
    load = [{"on": "yoke", "force": "-400*max(0, abs(v) - 1.2)*sign(v)"}]
    scene = flywheel.load(regimes.scene("yoke", inertia=3) | {"load": load, "damper": []})
    phi = np.array([0.1, np.pi / 6 - 1e-9, np.pi / 6 + 1e-3, 1.0, 3.0, 4.0])
    velocity = -0.3 * np.sin(phi) * 8
    force = -400 * np.maximum(0, np.abs(velocity) - 1.2) * np.sign(velocity)
    state = flywheel.reduce(scene, phi, speed=8.0)
    assert_allclose(state.moment_parts["load[0] on scotch-yoke.yoke"], force * -0.3 * np.sin(phi), rtol=1e-11, atol=1e-11)


def test_losses_in_meshes_are_no_part_of_the_moment():
    scene = regimes.scene("geared-loss", inertia=0.05)
    plain = scene | {"shafts": {"motor": {"ratio": 8}}}
    states = [flywheel.reduce(flywheel.load(each), PHI, balance=15.0) for each in (scene, plain)]
    assert_allclose(states[0].moment, states[1].moment, rtol=1e-13)
    assert_allclose(states[0].inertia, states[1].inertia, rtol=1e-13)
