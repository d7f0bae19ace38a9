import numpy as np
from numpy.testing import assert_allclose

import flywheel
from flywheel.regime import turning_moment
from tests import scenes


def resolved(scene):
    machine = flywheel.Machine(flywheel.load(scene))
    return machine, turning_moment.resolve(machine, machine.mesh)


def test_the_work_of_the_yoke_is_the_closed_form():
    _, cycle = resolved(scenes.yoke())
    phi = np.linspace(0, np.pi, 50)
    work, variation = cycle.at(*cycle.where(phi))
    assert_allclose(work, 500 / np.pi * phi - 500 * (1 - np.cos(phi)), atol=1e-11)
    assert_allclose(variation, 5 * np.sin(phi) ** 2, atol=1e-13)


def test_inertia_accumulated_from_its_slope_is_the_inertia():
    machine, cycle = resolved(scenes.press())
    phi = np.linspace(0, 2 * np.pi, 77)
    _, variation = cycle.at(*cycle.where(phi))
    assert_allclose(cycle.inertia_at_start + variation, machine.reduce(phi).inertia, rtol=1e-11)


def test_errors_bound_the_closed_form():
    _, cycle = resolved(scenes.yoke())
    work, _ = cycle.at(*cycle.where(np.array([np.pi])))
    assert abs(work[0] - (500 - 1000)) <= cycle.errors.work
