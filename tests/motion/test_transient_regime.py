import numpy as np
import pytest
from scipy.integrate import quad

import flywheel
from flywheel.machine.machine import Machine
from flywheel.motion.transients import regime_of, speed_at, time_along
from tests import regimes, scenes


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
