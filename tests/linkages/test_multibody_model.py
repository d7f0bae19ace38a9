"""Closure equations and forces of whole linkages against differences, and what a model refuses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.multibody import Actions, Wrench, components, model
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import Linkage
from tests.linkages.machines import MACHINES, prepared

Array = NDArray[np.float64]


def slope(function: Callable[[float], Array], h: float = 1e-3) -> Array:
    """Derivative at 0 by differences of the sixth order."""
    weights = {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    return np.sum([w * (function(k * h) - function(-k * h)) for k, w in weights.items()], axis=0) / h


@pytest.mark.parametrize("name", MACHINES)
def test_jacobian_and_gamma_by_differences(name):
    found, x = prepared(name)
    generator = np.random.default_rng(7)
    x = x + 0.01 * generator.normal(size=x.size)
    v = generator.normal(size=x.size)
    state = found.state(x, v)
    assert_allclose(state.jacobian @ v, slope(lambda h: found.state(x + h * v, v).value), rtol=0, atol=1e-11)
    assert_allclose(-state.gamma, slope(lambda h: found.state(x + h * v, v).jacobian @ v), rtol=0, atol=1e-10)
    assert state.qdot == pytest.approx(slope(lambda h: np.array(found.state(x + h * v, v).q)), abs=1e-11)
    assert state.bend == pytest.approx(slope(lambda h: np.array(found.state(x + h * v, v).qdot)), abs=1e-10)


@pytest.mark.parametrize("name", MACHINES)
def test_closed_poses_of_the_solver_fulfil_the_closures(name):
    found, x = prepared(name)
    assert np.abs(found.state(x, 0 * x).value).max() < 1e-14
    assert len(components(found.linkage)) == len(found.state(x, 0 * x).value)


@pytest.mark.parametrize("name", MACHINES)
def test_forces_do_the_work_of_gravity_drive_and_wrenches(name):
    """Power by the forces where they act, written anew: m g · v_G, drive times rate, F · v_P + T omega."""
    found, x = prepared(name)
    v = np.random.default_rng(8).normal(size=x.size)
    state = found.state(x, v)
    link = found.linkage.links[-1]
    theta = x[-1]
    arm = np.array([0.04, -0.03]) - link.com
    c, s = np.cos(theta), np.sin(theta)
    point = v[-3:-1] + v[-1] * np.array([-(s * arm[0] + c * arm[1]), c * arm[0] - s * arm[1]])
    power = np.sum([b.mass * (0.3 * v[3 * k] - 9.81 * v[3 * k + 1]) for k, b in enumerate(found.linkage.links)])
    power += (4.0 - 0.2 * state.qdot) * state.qdot + v[-2]
    power += 3.0 * point[0] + (0.7 - 2.0 * state.qdot) * point[1] + 1.5 * v[-1]
    assert found.forces(0.7, state) @ v == pytest.approx(power, rel=1e-13)


def with_friction(linkage: Linkage) -> Linkage:
    return replace(linkage, joints=(linkage.joints[0]._replace(friction=0.1), *linkage.joints[1:]))


def test_friction_is_refused_by_name():
    with pytest.raises(SceneError, match=r"mechanism\.O\.friction: found friction, expected none"):
        model(with_friction(MACHINES["four-bar"]), Actions())


def test_wrenches_need_a_body_that_moves_and_a_point_that_it_has():
    wrong = (Wrench("frame", (1.0, 0.0)), Wrench("crank", (1.0, 0.0), at="X"), Wrench("crank", (1.0, 0.0), at="E"))
    with pytest.raises(SceneError) as caught:
        model(MACHINES["four-bar"], Actions(wrenches=wrong))
    first, second = caught.value.faults
    assert first.path == "wrenches[0].body"
    assert "coupler" in first.expected
    assert (second.path, second.found, second.expected) == ("wrenches[1].at", "'X'", "a point of crank: O, E")
