"""Kloss's formula against the circuit it comes from, and rated data that contradict each other."""

import math

import numpy as np
import pytest
from mpmath import mp, mpf

from flywheel.components.motors import Induction
from flywheel.numerics.faults import SceneError

RPM = math.pi / 30
PLATE = {"power": 7500.0, "speed": 1450 * RPM, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
MOTOR = Induction(**PLATE)


def circuit_torque(omega: float, motor: Induction) -> mpf:
    """Torque of a rotor circuit r/s + jx behind a stiff voltage, scaled to the breakdown torque: s_b = r/x.

    The power that crosses the air gap, I² r/s, divided by synchronous speed.
    """
    slip = 1 - mpf(omega) * motor.poles / (4 * mp.pi * motor.frequency)
    r, x = mpf(1), 1 / mpf(motor.breakdown_slip)
    gap, greatest = (r / slip) / ((r / slip) ** 2 + x**2), 1 / (2 * x)
    return mpf(motor.breakdown_torque) * gap / greatest


def test_torque_is_that_of_the_circuit():
    speeds = np.array([-100.0, 0.0, 80.0, 131.9, 140.0, 151.8, 156.9, 157.2, 170.0, 300.0])
    with mp.workdps(30):
        expected = [float(circuit_torque(speed, MOTOR)) for speed in speeds]
    np.testing.assert_allclose(MOTOR.torque(speeds), expected, rtol=2e-14)


def test_the_curve_passes_through_rated_point_and_breakdown():
    assert MOTOR.torque(MOTOR.rated.speed) == pytest.approx(7500 / (1450 * RPM), rel=1e-14)
    assert MOTOR.rated.power == pytest.approx(7500.0, rel=1e-15)
    fine = np.linspace(100.0, 157.0, 200_001)
    torques = MOTOR.torque(fine)
    assert torques.max() == pytest.approx(2.5 * MOTOR.rated.torque, rel=1e-9)
    assert fine[torques.argmax()] == pytest.approx(MOTOR.breakdown.speed, abs=1e-3)
    assert MOTOR.slope_at(MOTOR.breakdown.speed) == pytest.approx(0.0, abs=1e-11)


def test_marks_of_the_curve():
    assert MOTOR.synchronous_speed == pytest.approx(1500 * RPM, rel=1e-15)
    assert MOTOR.rated_slip == pytest.approx(1 / 30, rel=1e-13)
    assert MOTOR.breakdown_slip == pytest.approx((2.5 + math.sqrt(5.25)) / 30, rel=1e-13)
    with mp.workdps(30):
        assert MOTOR.starting_torque == pytest.approx(float(circuit_torque(0.0, MOTOR)), rel=1e-14)
    assert MOTOR.torque(MOTOR.synchronous_speed) == 0.0


def test_starting_torque_of_a_textbook_motor():
    """Breakdown torque 500 N m at slip 0.236: 2 * 500/(1/0.236 + 0.236) at rest."""
    slip, ratio = 0.236, 2.0
    rated_slip = slip / (ratio + math.sqrt(3.0))
    speed = 1500 * RPM * (1 - rated_slip)
    motor = Induction(power=250.0 * speed, speed=speed, poles=4, frequency=50.0, breakdown_ratio=ratio)
    assert motor.breakdown == pytest.approx((1500 * RPM * (1 - slip), 500.0), rel=1e-13)
    assert motor.starting_torque == pytest.approx(1000 / (1 / slip + slip), rel=1e-13)


def test_it_generates_above_synchronous_speed_as_it_drives_below():
    off = np.linspace(0.1, 60.0, 50)
    above, below = (MOTOR.torque(MOTOR.synchronous_speed + side * off) for side in (1, -1))
    np.testing.assert_allclose(above, -below, rtol=1e-12)
    assert MOTOR.speed_at(-MOTOR.rated.torque) == pytest.approx(1550 * RPM, rel=1e-14)


def test_speed_at_no_load_and_near_it_is_exact():
    assert MOTOR.speed_at(0.0) == MOTOR.synchronous_speed
    slip = 1 - MOTOR.speed_at(1e-6) / MOTOR.synchronous_speed
    assert slip == pytest.approx(1e-6 / (2 * MOTOR.breakdown_torque) * MOTOR.breakdown_slip, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "path", "hint"),
    [
        ({"poles": 6}, "speed", "has 4 poles"),
        ({"poles": 2}, "speed", "has 4 poles"),
        ({"speed": 1500 * RPM}, "speed", "1500 rpm of 4 poles"),
        ({"speed": 3600 * RPM}, "speed", "1500 rpm"),
        ({"poles": 3}, "poles", "even"),
        ({"poles": 2.5}, "poles", "even"),
        ({"poles": 0}, "poles", "even"),
        ({"breakdown_ratio": 1.0}, "breakdown_ratio", "above 1"),
        ({"power": -1.0}, "power", "above 0"),
        ({"frequency": math.inf}, "frequency", "above 0"),
    ],
)
def test_data_that_contradict_each_other(change, path, hint):
    with pytest.raises(SceneError) as caught:
        Induction(**PLATE | change)
    (fault,) = caught.value.faults
    assert fault.path == path
    assert hint in str(fault)


def test_advice_only_where_poles_would_fit():
    with pytest.raises(SceneError) as caught:
        Induction(**PLATE | {"speed": 3600 * RPM})
    assert "poles" not in caught.value.faults[0].advice
    with pytest.raises(SceneError) as caught:
        Induction(**PLATE | {"speed": 1500 * RPM})
    assert not caught.value.faults[0].advice
