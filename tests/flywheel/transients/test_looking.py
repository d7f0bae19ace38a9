import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel.transients.looking import peak, sampled, worked
from tests.flywheel import regimes


@pytest.fixture(scope="module")
def trail():
    scene = flywheel.load(regimes.scene("four-bar", inertia=1))
    return flywheel.simulate(scene, 0.4, 6.0, 1.2, rtol=1e-9).trail


def test_acceleration_is_the_slope_of_speed_and_power_that_of_energy(trail):
    times = np.array([0.1, 0.33, 0.61, 1.0])
    h = 1e-5
    now, before, after = (sampled(trail, times + shift) for shift in (0.0, -h, h))
    assert_allclose(now.acceleration, (after.omega - before.omega) / (2 * h), rtol=1e-5)
    assert_allclose(now.moment * now.omega, (after.kinetic - before.kinetic) / (2 * h), rtol=1e-5)
    assert_allclose(now.power, (95 - 4.5 * now.omega) * now.omega, rtol=1e-12)


def test_works_of_all_parts_make_the_kinetic_energy(trail):
    works = worked(trail)
    ends = sampled(trail, np.array([0.0, 1.2])).kinetic
    assert {"drive", "load[0] on fan", "load[1] on four-bar.rocker"} <= set(works.by_part)
    assert sum(works.by_part.values()) == pytest.approx(ends[1] - ends[0], rel=1e-9)
    assert works.meshes == 0.0
    assert works.copper is None


def test_a_peak_lies_between_the_samples(trail):
    found = peak(trail, "omega", sampled(trail, np.union1d(trail.t, np.linspace(0.0, 1.2, 40))))
    dense = sampled(trail, np.union1d(trail.t, np.linspace(0.0, 1.2, 5001))).omega.max()
    assert found.value == pytest.approx(dense, rel=1e-7)
    assert found.value >= dense * (1 - 1e-12)
