"""A plain grid, against the script that people write."""

from math import pi

import numpy as np
import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.study import steppers
from flywheel.study.reference import Question
from tests.scenes import press, yoke

COUNT = 91  # no angle on a jump


def asked(scene):
    machine = Machine(flywheel.load(scene))
    return Question.of(flywheel.size(machine, simulate=False))


def script(machine):
    """Angles one by one: W by the trapezoidal rule, balanced by a constant torque, and I*."""
    angles = [2 * pi * k / COUNT for k in range(COUNT + 1)]
    states = [machine.reduce(np.array([angle])) for angle in angles]
    loads = [float(state.moment[0]) for state in states]
    inertia = [float(state.inertia[0]) for state in states]
    net = sum((loads[k] + loads[k + 1]) / 2 * (2 * pi / COUNT) for k in range(COUNT))
    torque, work = -net / (2 * pi), [0.0]
    for k in range(COUNT):
        work.append(work[-1] + ((loads[k] + loads[k + 1]) / 2 + torque) * (2 * pi / COUNT))
    return work, inertia


def test_a_sizing_is_that_of_a_script():
    own = asked(press())
    speed, eps = 4 * pi, 0.05
    work, inertia = script(own.machine)
    high = max(w - (1 + eps / 2) ** 2 * speed**2 * i / 2 for w, i in zip(work, inertia, strict=True))
    low = min(w - (1 - eps / 2) ** 2 * speed**2 * i / 2 for w, i in zip(work, inertia, strict=True))
    assert steppers.by_grid(own, COUNT) == pytest.approx((high - low) / (eps * speed**2), rel=1e-11)


def test_an_analysis_is_that_of_a_script():
    own = asked(yoke(flywheel={"inertia": 300}))
    work, inertia = script(own.machine)

    def speeds(level):
        return [(2 * (level + w) / (300 + i)) ** 0.5 for w, i in zip(work, inertia, strict=True)]

    low, high = -min(work), 1e6
    for _ in range(200):  # bisection for the mean of extremes
        middle = (low + high) / 2
        omega = speeds(middle)
        low, high = (middle, high) if max(omega) + min(omega) < 4 * pi else (low, middle)
    wanted = 2 * (max(omega) - min(omega)) / (max(omega) + min(omega))
    assert steppers.by_grid(own, COUNT) == pytest.approx(wanted, rel=1e-9)


def test_the_error_goes_down_with_the_angles():
    own = asked(press())
    true = flywheel.size(own.machine, simulate=False).flywheel.exact
    errors = [abs(steppers.by_grid(own, count) / true - 1) for count in (36, 360, 3600)]
    assert errors[2] < errors[1] / 5 < errors[0] / 25


def test_torques_that_depend_on_speed_are_taken_at_a_constant_one():
    scene = {
        "inertia": [{"on": "crank", "value": 2}],
        "drive": {"torque": "100 - 4*omega"},
        "load": [{"on": "crank", "torque": "-60", "from": 0, "to": "180 deg"}],
        "flywheel": {"irregularity": 0.01},
    }
    machine = Machine(flywheel.load(scene))
    samples = steppers.sampled(machine, 3600)
    assert samples.speed == pytest.approx((100 - 30) / 4, rel=1e-3)  # no net work in a cycle
    assert samples.work[-1] == pytest.approx(0.0, abs=0.1)
    assert samples.work.min() == pytest.approx(-30 * pi, rel=2e-3)
