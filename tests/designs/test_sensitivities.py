"""Derivatives of flywheels that keep limits."""

from __future__ import annotations

import math

import pytest

import flywheel
from flywheel.reading.paths import with_numbers
from tests.limits import sample
from tests.scenes import press

# The smallest flywheel moves with the crossing of the limit that decides: its derivative is that of sizings beside it.

MOTOR = {"type": "dc", "power": "3 kW", "speed": "1450 rpm", "current": "16 A", "voltage": "220 V"}
COIL = {"inductance": "20 mH"}
LIMITS = {"motor_torque": 1.5, "motor_rms": 0.9, "irregularity": 0.2}


def limited(motor=(), **limits):
    """A press on a DC motor whose flywheel keeps limits."""
    return flywheel.load(
        press(
            shafts={"motor": {"on": "crank", "ratio": 12}},
            drive={"on": "motor", "motor": {**MOTOR, **dict(motor)}},
            regime={},
            flywheel={"limits": {**LIMITS, **limits}},
        )
    )


@pytest.mark.parametrize(
    ("changes", "binding"),
    sample([({}, "motor_torque"), ({"irregularity": 0.05}, "irregularity"), ({"motor": COIL}, "motor_torque")], 3),
    ids=["torque", "irregularity", "states"],
)
def test_derivatives_of_the_smallest_flywheel_are_those_of_designs_on_both_sides(changes, binding):
    scene, limit = limited(**changes), f"flywheel.limits.{binding}"
    paths = ["mechanism.crank.length", "drive.motor.speed", limit]
    slopes = flywheel.sensitivities(scene, paths, figures=["exact", "speed", "angle_speed_max"], rtol=1e-10)
    assert flywheel.size(scene, 1e-10, accuracy="normal").binding == binding
    for path in paths:
        step = 1e-3 * slopes.numbers[path]
        ends = [slopes.numbers[path] + sign * step for sign in (-1.0, 1.0)]
        low, high = (flywheel.size(with_numbers(scene, {path: end}), 1e-10, accuracy="normal") for end in ends)
        for name, one, other in (
            ("exact", low.flywheel.exact, high.flywheel.exact),
            ("speed", low.speed, high.speed),
            ("angle_speed_max", low.angle_speed_max, high.angle_speed_max),
        ):
            result = slopes.derivative(name, path)
            scale = 1e-5 * slopes.values[name] / slopes.numbers[path]
            assert math.isclose(result.value, (other - one) / (2 * step), rel_tol=1e-4, abs_tol=scale)
            assert result.error < 1e-6 * max(abs(result.value), slopes.values[name] / slopes.numbers[path])


@pytest.mark.slow
def test_where_two_limits_decide_the_flywheel_has_a_slope_on_each_side():
    even = flywheel.size(limited(), 1e-12, accuracy="normal").limits["irregularity"].reached
    scene = limited(irregularity=even)
    slopes = flywheel.sensitivities(scene, "flywheel.limits.motor_torque", figures=["exact"], rtol=1e-10)
    result = slopes.derivative("exact", "flywheel.limits.motor_torque")
    assert math.isnan(result.value)
    assert result.left < -10.0
    assert abs(result.right) <= 10 * result.right_error
