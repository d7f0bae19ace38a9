"""A hydraulic motor against its flow balance, and a textbook's."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import flywheel
from flywheel.components.motors import Hydraulic
from flywheel.numerics.faults import SceneError

DATA = {
    "displacement": 164e-6,
    "flow": 0.006,
    "pressure": 70e5,
    "volumetric_efficiency": 0.92,
    "mechanical_efficiency": 0.93,
}


def by_flows(motor: Hydraulic, omega: float) -> float:
    """Torque by the pressure at which pump, motor, leakage and valve have the same flow."""
    d = motor.displacement / (2 * math.pi)
    leak = (1 - motor.volumetric_efficiency) * motor.flow / motor.pressure

    def left(p: float) -> float:
        through = motor.flow * (p / motor.pressure - 1) / motor.override if p > motor.pressure else 0.0
        return motor.flow - d * omega - leak * p - through

    p = brentq(left, -10 * motor.pressure, 10 * motor.pressure, xtol=1e-6, rtol=1e-15)
    return d * p * (motor.mechanical_efficiency if p > 0 else 1 / motor.mechanical_efficiency)


def test_torque_is_that_of_the_flow_balance():
    motor = Hydraulic(**DATA, override=0.15)
    speeds = np.array(
        [-20.0, 0.0, 60.0, 150.0, 0.9 * motor.no_load_speed, 0.95 * motor.no_load_speed, motor.no_load_speed + 5]
    )
    np.testing.assert_allclose(motor.torque(speeds), [by_flows(motor, omega) for omega in speeds], rtol=1e-10)


def test_a_textbook_motor():
    """Esposito, Fluid Power with Applications, 7th ed., example 7-9: 164 cm³, 70 bar, 2000 rpm, 0.006 m³/s, 170 N m.

    Printed: volumetric efficiency 91.1 %, mechanical 93.0 %, overall 84.8 %, 35.6 kW.
    """
    share = 164e-6 * 2000 / 60 / 0.006
    mechanical = 170.0 / (164e-6 * 70e5 / (2 * math.pi))
    assert (100 * share, 100 * mechanical) == pytest.approx((91.1, 93.0), abs=0.06)
    motor = Hydraulic(**DATA | {"volumetric_efficiency": share, "mechanical_efficiency": mechanical})
    assert motor.rated.speed == pytest.approx(2000 * math.pi / 30, rel=1e-13)
    assert motor.rated.torque == pytest.approx(170.0, rel=1e-13)
    assert motor.rated.power / 1e3 == pytest.approx(35.6, abs=0.05)
    assert 100 * motor.rated.power / (70e5 * 0.006) == pytest.approx(84.8, abs=0.05)


def test_marks_of_the_curve():
    motor = Hydraulic(**DATA)
    assert motor.torque(motor.rated.speed) == pytest.approx(motor.rated.torque, rel=1e-13)
    assert motor.torque([0.0, 100.0]).tolist() == [motor.rated.torque] * 2
    assert motor.breakdown.speed == motor.rated.speed
    assert motor.speed_at(motor.rated.torque / 2) == pytest.approx(0.96 * motor.no_load_speed, rel=1e-12)
    high = motor.stable[1]
    assert motor.torque(high) == pytest.approx(-motor.rated.torque / 0.93**2, rel=1e-12)
    assert motor.torque(high + 50) == pytest.approx(float(motor.torque(high)), rel=1e-12)
    assert Hydraulic(**DATA, override=0.1).stable[0] == -math.inf


def test_a_press_runs_on_oil():
    scene = {
        "load": [{"on": "crank", "torque": "-300 N m", "from": 0, "to": "90 deg"}],
        "drive": {
            "motor": {
                "type": "hydraulic",
                "displacement": "164 cm^3",
                "flow": "360 l/min",
                "pressure": "70 bar",
                "volumetric_efficiency": "92 %",
                "mechanical_efficiency": "93 %",
            }
        },
        "flywheel": {"irregularity": "4 %"},
    }
    found = flywheel.size(flywheel.load(scene), simulate=False)
    assert found.scene.motor.flow == pytest.approx(0.006, rel=1e-15)
    assert found.energy.mean_power == pytest.approx(300 * math.pi / 2 / found.energy.period, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"volumetric_efficiency": 1.0}, "volumetric_efficiency"),
        ({"mechanical_efficiency": 1.1}, "mechanical_efficiency"),
        ({"pressure": -1.0}, "pressure"),
        ({"flow": 0.0}, "flow"),
        ({"override": -0.1}, "override"),
    ],
)
def test_faulty_motors(change, path):
    with pytest.raises(SceneError) as caught:
        Hydraulic(**DATA | change)
    (fault,) = caught.value.faults
    assert fault.path == path
