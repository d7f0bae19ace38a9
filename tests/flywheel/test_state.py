import numpy as np
from numpy.testing import assert_allclose

import flywheel
from tests.flywheel import scenes

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


def test_angles_are_taken_modulo_the_cycle():
    scene = flywheel.load(scenes.press())
    assert_allclose(flywheel.reduce(scene, PHI + 2 * np.pi).inertia, flywheel.reduce(scene, PHI).inertia, rtol=1e-12)


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


def test_at_a_breakpoint_the_piece_that_begins_there_counts():
    state = flywheel.reduce(flywheel.load(scenes.rotor()), [0.0, np.pi])
    assert_allclose(state.moment, [-50.0, 50.0])


def test_ports_that_carry_nothing_have_their_coefficients_too():
    bare = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}}
    scene = flywheel.load({"mechanism": bare, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    state = flywheel.reduce(scene, [np.pi / 2])
    assert_allclose(state.gains["slider-crank.slider"], -0.1)
    assert_allclose(state.gains["slider-crank.rod"], 0.0, atol=1e-16)
    assert_allclose(state.inertia, 0.0)
