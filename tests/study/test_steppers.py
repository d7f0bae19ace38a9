"""Steps of fixed length have their order, jumps take it from them, and a restart gives it back."""

from functools import cache

import numpy as np
import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.study import steppers
from flywheel.study.reference import Question
from flywheel.study.steppers import NoAnswerError, Trial, by_shooting
from tests.scenes import yoke

SMOOTH = yoke(load=[{"on": "yoke", "force": "400*sin(phi)"}])
JUMP = yoke(load=[{"on": "yoke", "force": 1000, "from": "45 deg", "to": "180 deg"}])
TRIAL = Trial(inertia=30.0, balance=20.0, speed=8.0, states=(), period=0.8)


def machine(scene):
    return Machine(flywheel.load(scene))


@cache
def cycle(jumps):
    """The true one, with the jump or smooth."""
    return steppers.adaptive(machine(JUMP if jumps else SMOOTH), "DOP853", 1e-13, True)(TRIAL)


def errors(scene, name, counts, restart):
    """Of the speed at the cycle's end, by so many steps."""
    built, true = machine(scene), cycle(scene is JUMP).speed
    return np.array([abs(steppers.fixed(built, name, count, restart)(TRIAL).speed - true) for count in counts])


@pytest.mark.parametrize(("name", "order"), [("Euler", 1), ("RK4", 4)])
@pytest.mark.parametrize(("scene", "restart"), [(SMOOTH, False), (JUMP, True)])
def test_the_order_of_a_rule(name, order, scene, restart):
    rough, fine = errors(scene, name, (16, 128), restart)
    assert np.log2(rough / fine) / 3 == pytest.approx(order, abs=0.3)


@pytest.mark.slow
def test_a_jump_within_a_step_takes_the_order():
    counts = (32, 64)
    over, restarted = (errors(JUMP, "RK4", counts, restart) for restart in (False, True))
    assert (over > 1e3 * restarted).all()


@pytest.mark.parametrize("name", steppers.ADAPTIVE)
def test_adaptive_rules_come_to_the_same_cycle(name):
    built, true = machine(JUMP), cycle(True)
    found = steppers.adaptive(built, name, 1e-8, True)(TRIAL)
    assert found._replace(states=0.0) == pytest.approx(true._replace(states=0.0), rel=1e-6)
    assert found.least <= min(TRIAL.speed, found.speed) <= max(TRIAL.speed, found.speed) <= found.greatest


@pytest.mark.parametrize("revolve", [steppers.fixed, steppers.adaptive])
def test_a_machine_that_stops_has_no_cycle(revolve):
    setting = ("RK4", 36) if revolve is steppers.fixed else ("RK45", 1e-6)
    stopping = revolve(machine(SMOOTH), *setting, True)
    with pytest.raises(NoAnswerError, match="stops within its cycle"):
        stopping(TRIAL._replace(balance=-500.0))


@pytest.mark.slow
def test_the_fastest_of_nearly_equal_lobes_is_found_among_many_steps():
    """Seven lobes a hair apart: the greatest speed is not beside the greatest of the steps' ends."""
    torque = "100*sin(7*phi + 0.3) + 0.01*sin(phi + 1)"
    scene = {
        "inertia": [{"on": "crank", "value": 1.0}],
        "load": [{"on": "crank", "torque": torque}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 10.0},
        "flywheel": {"inertia": 1.0},
    }
    built = machine(scene)
    sizing = flywheel.size(built, 1e-12, accuracy="normal")
    found = by_shooting(Question.of(sizing), steppers.fixed(built, "RK4", 720, True), 1e-9)
    assert found == pytest.approx(sizing.simulation.irregularity, rel=1e-7)
