import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

import flywheel
from flywheel.machine.machine import Machine
from flywheel.motions.transients import energy_of, peak, regime_of, sampled, samples_of, speed_at, switching, time_along
from tests import regimes, scenes


@pytest.fixture(scope="module")
def trail():
    scene = flywheel.load(regimes.scene("four-bar", inertia=1))
    return flywheel.simulate(scene, 0.4, 6.0, 0.25, rtol=1e-9).trail


def test_acceleration_is_the_slope_of_speed_and_power_that_of_energy(trail):
    times = np.array([0.05, 0.11, 0.23])
    h = 1e-5
    now, before, after = (sampled(trail, times + shift) for shift in (0.0, -h, h))
    assert_allclose(now.acceleration, (after.omega - before.omega) / (2 * h), rtol=1e-5)
    assert_allclose(now.moment * now.omega, (after.kinetic - before.kinetic) / (2 * h), rtol=1e-5)
    assert_allclose(now.power, (95 - 4.5 * now.omega) * now.omega, rtol=1e-12)


def test_works_of_all_parts_make_the_kinetic_energy(trail):
    energy = energy_of(trail, sampled(trail, np.array([0.0, 0.25])).kinetic)
    assert {"load[0] on fan", "load[1] on four-bar.rocker"} <= set(energy.works)
    assert energy.drive + sum(energy.works.values()) == pytest.approx(energy.kinetic_gained, rel=1e-9)
    assert energy.meshes == 0.0
    assert energy.copper is None


def test_a_peak_lies_between_the_samples(trail):
    found = peak(trail, "omega", *samples_of(trail))
    dense = sampled(trail, np.union1d(trail.t, np.linspace(0.0, 0.25, 3001))).omega.max()
    assert found.value == pytest.approx(dense, rel=1e-7)
    assert found.value >= dense * (1 - 1e-12)


@pytest.fixture(scope="module")
def saw():
    """From 1 rad on the torque is 12 - 4 phi, 0 before: its greatest value stands on the right side of the jump alone."""
    scene = {"inertia": [{"on": "crank", "value": 2}], "regime": {"speed": 1}, "flywheel": {"inertia": 0}}
    torque = "12 - 4*phi if phi > 1 and phi < 1.2 else 0"
    return flywheel.simulate(flywheel.load(scene | {"drive": {"torque": torque}}), 0.0, 1.0, 5.0, rtol=1e-9).trail


def test_a_peak_may_stand_on_one_side_of_a_jump_alone(saw):
    found = peak(saw, "drive", *samples_of(saw))
    assert found.value == pytest.approx(8.0, rel=1e-12)
    assert found.time == pytest.approx(1.0, rel=1e-12)


def test_both_sides_of_a_switch_are_there(saw):
    times, owners = switching(saw)
    assert_allclose(times[:2], 1.0, rtol=1e-12)
    drive = sampled(saw, times, owners).drive
    assert_allclose(drive[:4], [0.0, 8.0, 7.2, 0.0], atol=1e-9)
    assert np.all(np.diff(times) >= 0.0)


def test_the_highest_of_many_like_tops_is_found():
    """Torque 10 + sin(9 phi) over a cycle whose speed grows: every top is 11, whatever steps stand around it."""
    scene = {"inertia": [{"on": "crank", "value": 2}], "regime": {"speed": 1}, "flywheel": {"inertia": 0}}
    trail = flywheel.simulate(
        flywheel.load(scene | {"drive": {"torque": "10 + sin(9*phi)"}}), 0.0, 1.0, 1.5, rtol=1e-6
    ).trail
    assert peak(trail, "drive", *samples_of(trail)).value == pytest.approx(11.0, rel=1e-10)


def test_the_regime_of_section_c():
    found = regime_of(Machine(flywheel.load(regimes.scene("section-c", inertia=0))), 0.0)
    assert found.period == pytest.approx(1.538536393184, rel=1e-10)
    assert found.speed == pytest.approx(2 * np.pi / 1.538536393184, rel=1e-10)


@pytest.mark.parametrize("scene", [scenes.press(flywheel={"inertia": 20}), regimes.scene("section-c", inertia=0)])
def test_time_along_the_cycle_is_the_integral_of_dphi_over_omega(scene):
    sizing = flywheel.size(flywheel.load(scene), simulate=False)
    angles = np.array([0.0, 0.7, 3.0, 5.5, 2 * np.pi])
    breaks = sizing.machine.breakpoints
    for angle, time in zip(angles, time_along(sizing, angles), strict=True):
        inner = [b for b in breaks if 0 < b < angle] or None
        expected = quad(
            lambda p: float(1 / speed_at(sizing, p)), 0.0, angle, points=inner, epsabs=1e-13, epsrel=1e-13, limit=200
        )[0]
        assert time == pytest.approx(expected, rel=1e-9, abs=1e-13)


def test_beyond_a_cycle_whole_periods_are_added():
    sizing = flywheel.size(flywheel.load(scenes.press(flywheel={"inertia": 20})), simulate=False)
    period = sizing.simulation.period
    assert time_along(sizing, 2 * np.pi) == pytest.approx(period, rel=1e-9)
    assert time_along(sizing, 4 * np.pi + 1) - time_along(sizing, 1.0) == pytest.approx(2 * period, rel=1e-9)


def test_diagrams_of_areas_have_no_motion():
    areas = {"areas": {"values": [1, -1], "scale": "1 J"}, "regime": {"speed": 10}, "flywheel": {"irregularity": 0.1}}
    with pytest.raises(flywheel.SceneError, match="steady motion"):
        time_along(flywheel.size(flywheel.load(areas), simulate=False), 1.0)
