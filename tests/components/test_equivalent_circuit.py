"""The equivalent circuit of an induction motor: printed cases of textbooks, and Kloss's formula as its simplification."""

import math

import numpy as np
import pytest

from flywheel.components.motors import EquivalentCircuit, Induction, Plate
from flywheel.numerics.faults import SceneError

CHAPMAN = EquivalentCircuit(
    voltage=460.0,
    synchronous_speed=60 * math.pi,
    stator_resistance=0.641,
    stator_reactance=1.106,
    rotor_resistance=0.332,
    rotor_reactance=0.464,
    magnetizing_reactance=26.3,
)
FITZGERALD = EquivalentCircuit(
    voltage=220.0,
    synchronous_speed=40 * math.pi,
    stator_resistance=0.294,
    stator_reactance=0.503,
    rotor_resistance=0.144,
    rotor_reactance=0.209,
    magnetizing_reactance=13.25,
)


def test_chapman_example_6_3():
    """Printed for a slip of 2.2 %: 18.88 A, 0.833, 12,530 W taken, 685 W in the stator, 11,845 W in the gap, 62.8 N m.

    With 1100 W of rotational losses 10,485 W and 56.9 N m at the shaft, 83.7 %. The book rounds the impedances: 18.89 A.
    """
    current = complex(CHAPMAN.current(0.022))
    taken = 3 * 460 / math.sqrt(3) * current.real
    gap = float(CHAPMAN.torque(0.022)) * CHAPMAN.synchronous_speed
    assert abs(current) == pytest.approx(18.88, abs=0.02)
    assert CHAPMAN.power_factor(0.022) == pytest.approx(0.833, abs=1.5e-3)
    assert taken == pytest.approx(12530, abs=10)
    assert taken - gap == pytest.approx(685, abs=2)
    assert taken - gap == pytest.approx(3 * 0.641 * abs(current) ** 2, rel=1e-12)
    assert gap == pytest.approx(11845, abs=10)
    assert CHAPMAN.torque(0.022) == pytest.approx(62.8, abs=0.05)
    shaft = gap * (1 - 0.022) - 1100
    assert shaft == pytest.approx(10485, abs=10)
    assert shaft / (CHAPMAN.synchronous_speed * 0.978) == pytest.approx(56.9, abs=0.07)
    assert 100 * shaft / taken == pytest.approx(83.7, abs=0.05)


def test_chapman_example_6_5_and_its_slip():
    """Printed: breakdown at a slip of 0.198 with 229 N m, start with 104 N m; rotor resistance doubled, 0.396 and 170 N m.

    The text has X_TH + X_2 with X_TH = 1.075 ohm, but its numbers are those of X_1 + X_2 and of 266 V for a phase: with the
    formulas as they stand it is 0.2014 and 230.8 N m, 106.6 N m; 0.4028 and 174.1 N m.
    """
    thevenin, reactance, slipped = 255.2, 1.106 + 0.464, 0.332 / math.hypot(0.590, 1.106 + 0.464)
    assert slipped == pytest.approx(0.198, abs=5e-4)
    assert 3 * thevenin**2 / (2 * 188.5 * (0.590 + math.hypot(0.590, reactance))) == pytest.approx(229, abs=0.5)
    assert CHAPMAN.breakdown_slip == pytest.approx(0.2014, abs=5e-5)
    assert CHAPMAN.breakdown_torque == pytest.approx(230.8, abs=0.05)
    assert CHAPMAN.torque(1.0) == pytest.approx(106.6, abs=0.05)
    slips = np.linspace(0.15, 0.25, 100_001)
    assert CHAPMAN.torque(slips).max() == pytest.approx(CHAPMAN.breakdown_torque, rel=1e-9)


def test_fitzgerald_examples_6_2_and_6_3():
    """Printed: slip 2 %, 18.8 A, 5740 W in the gap, with 403 W of losses 42.4 N m; breakdown 175 N m at 970 rpm."""
    current = complex(FITZGERALD.current(0.02))
    gap = float(FITZGERALD.torque(0.02)) * FITZGERALD.synchronous_speed
    assert abs(current) == pytest.approx(18.8, abs=0.05)
    assert gap == pytest.approx(5740, abs=5)
    assert (0.98 * gap - 403) / (0.98 * FITZGERALD.synchronous_speed) == pytest.approx(42.4, abs=0.05)
    assert FITZGERALD.breakdown_torque == pytest.approx(175, abs=0.5)
    assert 1200 * (1 - FITZGERALD.breakdown_slip) == pytest.approx(970, abs=0.5)


def test_without_a_stator_it_is_kloss_s_motor_and_its_line_current():
    circuit = EquivalentCircuit(
        voltage=400.0,
        synchronous_speed=50 * math.pi,
        stator_resistance=0.0,
        stator_reactance=0.0,
        rotor_resistance=0.5,
        rotor_reactance=3.0,
        magnetizing_reactance=40.0,
    )
    slip = 0.03
    rated = complex(circuit.current(slip))
    speed = circuit.synchronous_speed * (1 - slip)
    torque = float(circuit.torque(slip))
    plate = Plate(voltage=400.0, current=abs(rated), power_factor=rated.real / abs(rated))
    data = {"power": torque * speed, "speed": speed, "poles": 4, "frequency": 50.0}
    ratio = circuit.breakdown_torque / torque
    motor = Induction(**data, breakdown_ratio=ratio, plate=plate._replace(power_factor=plate.power_factor, voltage=None))
    slips = np.array([-0.2, 0.01, 0.03, 0.1, 0.5, 1.0])
    speeds = circuit.synchronous_speed * (1 - slips)
    np.testing.assert_allclose(motor.torque(speeds), circuit.torque(slips), rtol=1e-11)
    np.testing.assert_allclose(motor.current(speeds), np.abs(circuit.current(slips)), rtol=1e-11)


def test_values_out_of_range():
    with pytest.raises(SceneError, match="rotor_resistance"):
        EquivalentCircuit(
            voltage=400.0,
            synchronous_speed=157.0,
            stator_resistance=0.0,
            stator_reactance=0.0,
            rotor_resistance=0.0,
            rotor_reactance=3.0,
            magnetizing_reactance=40.0,
        )
