"""The line current of an induction motor by its name plate, against phasors, and plates that contradict themselves."""

import cmath
import math

import numpy as np
import pytest

from flywheel.components.motors import Induction, Plate
from flywheel.numerics.faults import SceneError

RPM = math.pi / 30
DATA = {"power": 7500.0, "speed": 1450 * RPM, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
FULL = Plate(voltage=400.0, current=15.0, power_factor=0.83)


def motor(**plate):
    return Induction(**DATA, plate=FULL._replace(**plate))


def by_phasors(found: Induction, omega: float) -> complex:
    """The line current of a circuit U/(R/s + jX) that gives Kloss's torque, with magnetizing and loss branches beside it."""
    phase, sync = found.plate.voltage / math.sqrt(3), found.synchronous_speed
    reactance = 3 * phase**2 / (2 * sync * found.breakdown_torque)
    resistance = found.breakdown_slip * reactance

    def load(speed: float) -> complex:
        return phase / (resistance * sync / (sync - speed) + 1j * reactance)

    rated = found.plate.current * cmath.exp(-1j * math.acos(found.plate.power_factor))
    return load(omega) + rated - load(found.speed)


def test_the_current_is_that_of_the_circuit_through_the_rated_point():
    speeds = np.array([-40.0, 0.0, 100.0, 131.0, 140.0, 151.0, 1450 * RPM, 156.0, 160.0, 200.0])
    expected = [abs(by_phasors(motor(), omega)) for omega in speeds]
    np.testing.assert_allclose(motor().current(speeds), expected, rtol=1e-13)


def test_without_a_plate_the_current_goes_with_the_rotor_heat():
    bare = Induction(**DATA)
    speeds = np.array([0.0, 100.0, 140.0, 151.0, 156.0, 160.0])
    heat = bare.rotor_heat(speeds) / bare.rotor_heat(bare.speed)
    np.testing.assert_allclose(bare.current_share(speeds) ** 2, heat, rtol=1e-13)
    assert bare.rated_current is None
    assert bare.current(100.0) is None
    assert not bare.line_current.complete


@pytest.mark.parametrize("plate", [{}, {"no_load_current": 7.0}, {"starting_current": 6.5, "starting_torque": 2.2}])
def test_rated_point_no_load_and_locked_rotor_hold(plate):
    found = motor(**plate)
    assert found.current(found.speed) == pytest.approx(15.0, rel=1e-14)
    assert found.torque(found.speed) == pytest.approx(found.rated.torque, rel=1e-14)
    assert found.breakdown.torque == pytest.approx(2.5 * found.rated.torque, rel=1e-13)
    if "no_load_current" in plate:
        assert found.current(found.synchronous_speed) == pytest.approx(7.0, rel=1e-14)
    if "starting_current" in plate:
        assert found.current(0.0) == pytest.approx(6.5 * 15.0, rel=1e-14)
        assert found.starting_torque == pytest.approx(2.2 * found.rated.torque, rel=1e-14)


def test_the_locked_rotor_leaves_the_running_branch_as_it_is():
    speeds = np.linspace(motor().breakdown.speed, 180.0, 50)
    started = motor(starting_current=6.5, starting_torque=2.2)
    np.testing.assert_array_equal(started.torque(speeds), motor().torque(speeds))
    np.testing.assert_array_equal(started.current(speeds), motor().current(speeds))
    near = started.breakdown.speed - 1e-6
    assert started.slope_at(near) == pytest.approx(float(motor().slope_at(near)), abs=1e-5)


def test_losses_add_up_at_the_rated_point():
    found = motor(efficiency=0.87)
    taken = math.sqrt(3) * 400.0 * 15.0 * 0.83  # current and power factor count
    assert found.electric_power(found.speed) == pytest.approx(taken, rel=1e-13)
    losses = found.stator_heat(found.speed) + found.rotor_heat(found.speed) + found.constant_losses
    assert losses == pytest.approx(taken - 7500.0, rel=1e-12)
    twice = found.synchronous_speed - 2 * (found.synchronous_speed - found.speed)
    assert found.stator_heat(twice) == pytest.approx(found.rated_stator_heat * (found.current(twice) / 15.0) ** 2, rel=1e-14)


def test_any_two_of_three_tell_the_third():
    by_current = motor()
    efficiency = by_current.line_current.efficiency
    by_efficiency = motor(power_factor=None, efficiency=efficiency)
    by_both = motor(current=None, efficiency=efficiency)
    for found in (by_efficiency, by_both):
        assert found.rated_current == pytest.approx(15.0, rel=1e-14)
        assert found.current(140.0) == pytest.approx(float(by_current.current(140.0)), rel=1e-12)


@pytest.mark.parametrize(
    ("plate", "path", "words"),
    [
        ({"efficiency": 0.7}, "efficiency", "6037.9 W"),
        ({"voltage": 230.0, "efficiency": 0.87}, "efficiency", "between lines"),
        ({"power_factor": 0.99, "efficiency": 0.95, "current": None}, "power_factor", "0.98 at most"),
        ({"current": 11.0}, "current", "1.186"),
        ({"current": 11.0, "power_factor": None, "efficiency": 0.87}, "current", "8620.7 W taken of 7621 V A"),
        ({"current": None, "power_factor": None, "efficiency": 0.97}, "efficiency", "below 0.9667"),
        ({"no_load_current": 1.0}, "no_load_current", "which the losses take"),
        ({"no_load_current": 16.0, "voltage": None, "power_factor": None}, "no_load_current", "below the rated current"),
        ({"no_load_current": 3.0, "current": None}, "no_load_current", "a current beside it"),
        ({"starting_torque": 2.6}, "starting_torque", "breakdown_ratio of 2.5"),
        ({"starting_current": 1.0}, "starting_current", "more than 1"),
        ({"power_factor": 1.1}, "power_factor", "share of 1"),
    ],
)
def test_plates_that_contradict_themselves(plate, path, words):
    with pytest.raises(SceneError) as caught:
        motor(**plate)
    (fault,) = caught.value.faults
    assert fault.path == path
    assert words in str(fault)
