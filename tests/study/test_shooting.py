"""The search for a steady cycle, with cycles of whose motion a formula is known."""

from math import pi, sqrt

import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.study.reference import Question
from flywheel.study.steppers import NoAnswerError, Revolution, by_shooting, stretches_of
from tests.scenes import rotor

OWN, SPEED = 2.0, 10 * pi


def asked(wheel):
    """A rotor with a load of 100 N m over the first half of a turn."""
    scene = rotor(
        load=[{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
        inertia=[{"on": "crank", "value": OWN}],
        drive={"torque": "balance"},
        regime={"speed": SPEED},
        flywheel=wheel,
    )
    machine = Machine(flywheel.load(scene))
    return Question.of(flywheel.size(machine, simulate=False))


def by_energy(trial):
    """The rotor's cycle: omega² changes by 2/(J + I) times the work."""
    total = trial.inertia + OWN
    half = trial.speed**2 + 2 * (trial.balance - 100) * pi / total
    end = half + 2 * trial.balance * pi / total
    if min(half, end) <= 0.0:
        return Revolution(0.0, (), trial.speed, 0.0)
    speeds = [trial.speed, sqrt(half), sqrt(end)]
    return Revolution(speeds[-1], (), max(speeds), min(speeds))


def test_a_flywheel_is_found():
    found = by_shooting(asked({"irregularity": 0.01}), by_energy, 1e-12)
    assert found == pytest.approx(50 * pi / (0.01 * SPEED**2) - OWN, rel=1e-10)


def test_an_irregularity_is_found():
    found = by_shooting(asked({"inertia": 13.0}), by_energy, 1e-12)
    assert found == pytest.approx(50 * pi / (15 * SPEED**2), rel=1e-10)


def test_no_motion_is_no_answer():
    with pytest.raises(NoAnswerError, match="no steady motion"):
        by_shooting(asked({"irregularity": 0.01}), lambda trial: Revolution(1.0, (), 1.0, -1.0), 1e-9)


def test_stretches_run_from_break_to_break():
    machine = asked({"irregularity": 0.01}).machine
    whole, parts = stretches_of(machine, False), stretches_of(machine, True)
    assert [(one.low, one.high, one.middle) for one in whole] == [(0.0, 2 * pi, None)]
    assert [one.high for one in parts] == pytest.approx([pi, 2 * pi])
    assert [one.low for one in parts] == pytest.approx([0.0, pi])
    assert all(one.low < one.middle < one.high for one in parts)
