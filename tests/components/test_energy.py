"""Power and energy over a cycle, against closed forms."""

from math import pi

import numpy as np
import pytest

from flywheel.components import energy
from flywheel.numerics.faults import SceneError


def gauss(n=200):
    nodes, weights = np.polynomial.legendre.leggauss(n)
    return pi * (nodes + 1), pi * weights


def test_powers_with_and_without_a_flywheel():
    phi, weights = gauss()
    omega, load = 20 + 2 * np.cos(phi), -(50 + 30 * np.sin(phi))
    found = energy.of_cycle(omega, 50.0, load, weights)
    period = 2 * pi / np.sqrt(20**2 - 2**2)  # the integral of dphi/(a + b cos phi)
    assert found.period == pytest.approx(period, rel=1e-13)
    assert found.work == pytest.approx(100 * pi, rel=1e-13)
    assert found.mean_power == pytest.approx(100 * pi / period, rel=1e-13)
    assert found.peak_power == pytest.approx(50 * 22, rel=1e-3)
    assert found.mean_power_alone == pytest.approx(50 * 20, rel=1e-4)
    assert found.peak_to_mean_alone == pytest.approx(80 / 50, rel=1e-3)


def test_points_without_weight_count_for_peaks_alone():
    phi, weights = gauss()
    ends = np.append(phi, [0.0, pi / 2])
    loads = -(50 + 30 * np.sin(ends))
    found = energy.of_cycle(20 + 2 * np.cos(ends), 50.0, loads, np.append(weights, [0.0, 0.0]), speed=20.0)
    assert found.work == pytest.approx(100 * pi, rel=1e-13)
    assert found.peak_power == 1100.0
    assert found.peak_power_alone == 1600.0
    assert found.mean_power_alone == pytest.approx(1000.0, rel=1e-13)


def test_a_motor_that_brakes_has_powers_below_zero():
    found = energy.of_cycle([10.0, 10.0], -3.0, [6.0, 0.0], [pi, pi])
    assert (found.mean_power, found.peak_power) == pytest.approx((-30.0, -30.0))
    assert found.peak_power_alone == -60.0
    assert found.peak_to_mean == pytest.approx(1.0)
    assert found.peak_to_mean_alone == pytest.approx(2.0)


def test_no_mean_power_gives_no_ratio():
    found = energy.of_cycle([10.0, 10.0], 0.0, [6.0, -6.0], [pi, pi])
    assert found.peak_to_mean is None
    assert found.peak_to_mean_alone is None
    assert found.as_dict()["kilowatt_hours"] == 0.0


def test_the_exam_of_march_2010():
    """x = -3 R cos phi, R = 0.1 m, 750 N over half a turn at 210 rpm: 1575 W, printed 678.22 kcal in half an hour."""
    nodes, halves = np.polynomial.legendre.leggauss(40)
    once = pi / 2 * (nodes + 1)
    weights = np.concatenate((pi / 2 * halves, pi / 2 * halves))
    load = np.concatenate((-750.0 * 0.3 * np.sin(once), np.zeros(40)))
    found = energy.of_cycle(np.full(80, 7 * pi), 225 / pi, load, weights)
    assert found.work == pytest.approx(450.0, rel=1e-14)
    assert found.mean_power == pytest.approx(1575.0, rel=1e-13)
    assert energy.kilocalories(found.mean_power, 1800.0, 4.18) == pytest.approx(678.2297, abs=5e-5)
    assert found.as_dict()["kilowatt_hours"] == pytest.approx(1.575, rel=1e-13)
    assert found.peak_to_mean_alone == pytest.approx(pi, rel=1e-2)


@pytest.mark.parametrize(
    ("arguments", "paths"),
    [
        (([], 1.0, 1.0, []), ["omega"]),
        (([1.0, 0.0], 1.0, 1.0, [1.0, 1.0]), ["omega"]),
        (([1.0, 2.0], 1.0, 1.0, [1.0]), ["weights"]),
        (([1.0, 2.0], 1.0, 1.0, [1.0, -1.0]), ["weights"]),
        (([1.0, 2.0], [1.0], 1.0, [1.0, 1.0]), ["drive"]),
        (([1.0, 2.0], 1.0, np.nan, [1.0, 1.0]), ["load"]),
        (([1.0, 2.0], 1.0, 1.0, [1.0, 1.0], -1.0), ["speed"]),
    ],
)
def test_what_is_no_cycle_is_refused(arguments, paths):
    with pytest.raises(SceneError) as caught:
        energy.of_cycle(*arguments)
    assert [fault.path for fault in caught.value.faults] == paths


def test_numbers_alone_are_converted():
    with pytest.raises(SceneError, match="calorie"):
        energy.kilocalories(1.0, 1.0, 0.0)
    with pytest.raises(SceneError, match="power"):
        energy.kilowatt_hours("1 kW", 1.0)
