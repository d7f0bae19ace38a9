"""The estimated error of angles: true angles known, and stretches in which no angle is to be told."""

from __future__ import annotations

from math import pi
from typing import Any

import pytest

import flywheel

ROTOR: dict[str, Any] = {"inertia": [{"on": "crank", "value": 2.0}], "regime": {"speed": 10.0}}


def sized(scene: dict[str, Any]) -> Any:
    return flywheel.size(flywheel.load(scene), simulate=False)


def test_a_sine_crosses_zero_at_half_a_turn() -> None:
    load = [{"on": "crank", "torque": "100*sin(phi)"}]
    found = sized({**ROTOR, "load": load, "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.1}})
    assert 0.0 < found.error.angles < 1e-12
    assert abs(found.areas[0].end - pi) <= found.error.angles
    assert abs(found.angle_speed_max - pi) <= found.error.extremes


def test_a_jump_through_zero_is_known_to_rounding() -> None:
    load = [{"on": "crank", "torque": -100.0, "from": 1.0, "to": 2.0}]
    found = sized({**ROTOR, "load": load, "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.1}})
    assert found.angle_speed_max == 1.0
    assert found.angle_speed_min == 2.0
    assert found.error.extremes < 1e-14


def test_speeds_that_are_not_known_leave_angles_open() -> None:
    """A given flywheel's extremes depend on the speed; the error of that is in theirs."""
    scene = {
        "mechanism": {"type": "slider-crank", "crank": {"length": 0.2}, "rod": {"length": 0.7}, "slider": {"mass": 30}},
        "load": [{"on": "slider", "force": "-500*sign(v)"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 20.0},
        "flywheel": {"inertia": 1.5},
    }
    loose, tight = (sized({**scene, "accuracy": {"rtol": rtol}}) for rtol in (1e-3, 1e-13))
    for key in ("angle_speed_max", "angle_speed_min"):
        assert abs(getattr(loose, key) - getattr(tight, key)) <= loose.error.extremes + tight.error.extremes
    assert tight.error.extremes < 1e-9


@pytest.mark.parametrize("steep", [0.05, 60.0])
def test_a_speed_that_has_settled_has_no_angle(steep: float) -> None:
    """Strongly damped, the speed settles between loads: where it is least is anyone's guess, and the estimate says so."""
    scene = {
        "load": [{"on": "crank", "torque": 5.0, "from": 0.6, "to": 0.62}, {"on": "crank", "torque": -2.5}],
        "inertia": [{"on": "crank", "value": 3.0}],
        "drive": {"torque": f"{2.5 + 14.0 * steep} - {33.0 * steep}*omega"},
        "flywheel": {"inertia": 0.1},
        "accuracy": {"rtol": 1e-10},
    }
    found = sized(scene)
    assert found.angle_speed_max == pytest.approx(0.62, abs=1e-12)
    assert (found.error.extremes > 1.0) == (steep > 10.0)
    assert found.error.angles < 1e-12
