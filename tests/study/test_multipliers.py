"""A cycle by Lagrange's multipliers is that of the reduced machine, and what they cannot is told."""

import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.study import steppers
from flywheel.study.steppers import Trial
from tests.scenes import press, rotor, shaper, yoke


def machine(scene):
    return Machine(flywheel.load(scene))


@pytest.mark.slow
def test_they_agree_to_their_tolerance():
    built = machine(press(load=[{"on": "press.slider", "force": "-900*sin(phi)"}]))
    trial = Trial(inertia=40.0, balance=10.0, speed=12.0, states=(), period=0.52)
    true = steppers.adaptive(built, "DOP853", 1e-8, True)(trial)
    found = steppers.by_multipliers(built, 1e-5, True)(trial)
    assert found._replace(states=0.0) == pytest.approx(true._replace(states=0.0), rel=1e-5)


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (rotor(), "one mechanism"),
        (shaper(), "turn with the crank"),
        (press(mechanism={"type": "law", "outputs": {"slider": {"x": "0.1*sin(phi)", "mass": 2}}}, load=[]), "no bodies"),
        (yoke(inertia=[{"on": "yoke", "value": 5}]), "no inertia on ports"),
    ],
)
def test_what_they_cannot(scene, reason):
    assert reason in steppers.obstacle(machine(scene))


def test_a_constant_inertia_on_the_crank_is_no_obstacle():
    assert steppers.obstacle(machine(yoke(inertia=[{"on": "crank", "value": 5}]))) is None
