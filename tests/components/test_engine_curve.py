"""The governed engine: full load, droop, brake."""

import numpy as np
import pytest

from flywheel.components.motors import Curve, Engine, Point
from flywheel.numerics.faults import SceneError

FULL_LOAD = Curve(speeds=(80.0, 140.0, 180.0, 230.0), torques=(700.0, 900.0, 890.0, 800.0))
ENGINE = Engine(speed=205.0, full_load=FULL_LOAD, droop=0.06, idle=75.0, braking_torque=100.0)


def test_droop_by_its_definition():
    motor = Engine(speed=150.0, full_load=200.0, droop=0.05)
    assert (motor.no_load_speed - motor.rated.speed) / motor.rated.speed == pytest.approx(0.05, rel=1e-13)
    assert motor.rated == Point(150.0, 200.0)
    assert motor.torque(150.0 * 1.0125) == pytest.approx(150.0, rel=1e-12)  # a quarter of the droop, a quarter of the load
    assert motor.torque([0.0, 149.9]).tolist() == [200.0, 200.0]
    assert motor.torque([157.6, 400.0]).tolist() == [0.0, 0.0]


def test_the_curve_rules_up_to_rated_speed_and_the_governor_above():
    below = np.linspace(80.0, 205.0, 57)
    np.testing.assert_array_equal(ENGINE.torque(below), FULL_LOAD.torque(below))
    assert ENGINE.rated == (205.0, pytest.approx(845.0))
    line = np.linspace(205.0, ENGINE.no_load_speed, 21)
    np.testing.assert_allclose(ENGINE.torque(line), np.linspace(845.0, 0.0, 21), rtol=1e-12, atol=1e-10)
    assert ENGINE.torque(300.0) == -100.0


def test_the_running_branch_begins_where_full_load_begins_to_fall():
    assert ENGINE.stable == (140.0, pytest.approx(205.0 * 1.06 + 100.0 * 205.0 * 0.06 / 845.0))
    assert ENGINE.breakdown == Point(140.0, 900.0)
    assert Engine(speed=130.0, full_load=FULL_LOAD, droop=0.06).stable[0] == 130.0
    assert Engine(speed=140.0, full_load=FULL_LOAD, droop=0.06).stable[0] == 140.0
    assert ENGINE.speed_at(870.0) == pytest.approx(180.0 + 50.0 * 20.0 / 90.0)  # lugging, on the curve of full load
    assert ENGINE.speed_at(901.0) is None


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"droop": 0.0}, "droop"),
        ({"idle": 205.0}, "idle"),
        ({"speed": 231.0}, "full_load"),
        ({"speed": 76.0}, "full_load"),
        ({"speed": -1.0}, "speed"),
        ({"braking_torque": -1.0}, "braking_torque"),
        ({"full_load": Curve(speeds=(0.0, 205.0), torques=(10.0, 0.0))}, "full_load"),
    ],
)
def test_engines_that_cannot_be(change, path):
    given = {"speed": 205.0, "full_load": FULL_LOAD, "droop": 0.06, "idle": 75.0, "braking_torque": 100.0}
    with pytest.raises(SceneError) as caught:
        Engine(**given | change)
    assert [fault.path for fault in caught.value.faults] == [path]
