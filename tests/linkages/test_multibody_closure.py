"""Poses closed in absolute coordinates against the linkage solver, whatever the way there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from flywheel.mechanisms.linkages.multibody import Actions, Closure, UnreachableError, coordinates, model
from flywheel.mechanisms.linkages.positions import solve, solve_over
from tests.linkages.linkages import CASES, four_bar
from tests.linkages.machines import MACHINES, prepared


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("step", [0.1, 0.9])
def test_poses_and_influence_coefficients_over_the_cycle(name, step):
    found, x = prepared(name)
    closure, solution = Closure(found, x), solve(MACHINES[name], 0.0, 2 * np.pi)
    for q in np.arange(1.1, 6.2, step):
        poses = solution.poses(q)
        place, g = closure.at(float(q))
        assert_allclose(place, coordinates(poses), rtol=0, atol=2e-14 * np.abs(place).max())
        centres = [(*poses.centre(link.name).rate[:, 0], poses.angle(link.name).rate[0]) for link in found.linkage.links]
        assert_allclose(g, np.ravel(centres), rtol=0, atol=1e-12)


def test_a_step_as_long_as_half_a_turn_stays_in_its_assembly():
    found, x = prepared("four-bar")
    far = Closure(found, x).at(1.1 + np.pi)[0]
    near = Closure(found, x)
    for q in np.linspace(1.1, 1.1 + np.pi, 60):
        near.at(float(q))
    assert_allclose(far, near.x, atol=1e-14)


def test_a_lock_is_named_with_its_angle():
    """A four-bar driven at a bar that swings: coupler and other bar in line, by the cosine rule."""
    linkage = replace(four_bar(d=0.4, r=0.3, c=0.35, length=0.1), start=0.9)
    found = model(linkage, Actions())
    x = coordinates(solve_over(linkage, 0.9).poses(0.9))
    limit = np.degrees(np.arccos((0.4**2 + 0.3**2 - 0.45**2) / (2 * 0.4 * 0.3)))
    with pytest.raises(UnreachableError) as caught:
        Closure(found, x).at(3.0)
    told = float(caught.value.fault.found.split()[-2])
    assert caught.value.fault.path == "mechanism.driver"
    assert told == pytest.approx(limit, abs=1e-3)
