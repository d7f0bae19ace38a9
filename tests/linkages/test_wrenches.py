"""Loads on bodies: what they come to about the centres of mass, and what does not fit."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.wrenches import Effort, Force, Torque, applied, centres, inertial, joint_rate, weights
from flywheel.numerics.faults import SceneError
from tests.linkages import forced

Q = np.linspace(0.2, 6.0, 9)


@pytest.fixture(scope="module")
def machine():
    return solve(forced.whitworth(), 0.0, 6.3)


@pytest.fixture(scope="module")
def poses(machine):
    return machine.poses(Q)


def power(poses, wrenches):
    return np.einsum("bin,bin->n", wrenches, centres(poses).rate)


def test_a_force_has_the_power_of_its_own_point(poses):
    fx, fy = np.cos(Q), 3.0
    for at, place in (("end", (0.55, 0.0)), ((0.1, -0.2), (0.1, -0.2))):
        rate = poses.point("rod", place).rate
        np.testing.assert_allclose(power(poses, applied(poses, [Force("rod", at, fx, fy)])), fx * rate[0] + fy * rate[1])


def test_a_torque_has_the_power_of_its_bodys_turning(poses):
    np.testing.assert_allclose(power(poses, applied(poses, [Torque("lever", Q)])), Q * poses.angle("lever").rate)


@pytest.mark.parametrize("joint", ["pivot", "lever_pivot", "slot", "lever_pin", "guide"])
def test_an_effort_has_the_power_of_its_joints_coordinate(machine, poses, joint):
    rate = machine.coordinate(joint, poses).rate
    np.testing.assert_allclose(joint_rate(poses, poses.linkage.joint(joint)), rate, atol=1e-13)
    np.testing.assert_allclose(power(poses, applied(poses, [Effort(joint, 2.0)])), 2.0 * rate, atol=1e-13)


def test_weights_lower_the_centres(poses):
    heights = sum(link.mass * poses.centre(link.name).rate[1] for link in poses.linkage.links)
    np.testing.assert_allclose(power(poses, weights(poses, (0.0, -9.81))), -9.81 * heights, rtol=1e-12)


def test_inertia_forces_take_the_growth_of_the_energy(machine, poses):
    """Their power is -dT/dt, T = ½ I*(q) qdot², by differences of I*."""
    speed, acceleration, eps = 7.0, -11.0, 1e-5

    def reduced(q):
        rate = centres(machine.poses(q)).rate
        links = machine.linkage.links
        return sum(
            b.mass * (rate[k, 0] ** 2 + rate[k, 1] ** 2) + b.inertia * rate[k, 2] ** 2 for k, b in enumerate(links, 1)
        )

    growth = reduced(Q) * acceleration + 0.5 * (reduced(Q + eps) - reduced(Q - eps)) / (2 * eps) * speed**2
    found = power(poses, inertial(poses, np.full_like(Q, speed), np.full_like(Q, acceleration)))
    np.testing.assert_allclose(found, -growth, rtol=0, atol=1e-8 * np.abs(growth).max())


@pytest.mark.parametrize(
    ("load", "path"),
    [
        (Force("rud", "o", 1.0), r"loads\[1\].body: found .rud..*rod"),
        (Force("rod", "ende", 1.0), r"loads\[1\].at: found .ende..*end"),
        (Torque("rod", [1.0, 2.0]), r"loads\[1\].value.*shape \(2,\).*shape \(9,\)"),
        (Torque("rod", np.nan), r"loads\[1\].value: found nan, expected finite"),
        (Torque("rod", "much"), r"loads\[1\].value"),
        (Effort("hinge", 1.0), r"loads\[1\].joint: found .hinge..*slot"),
    ],
)
def test_loads_that_do_not_fit_are_named(poses, load, path):
    with pytest.raises(SceneError, match=path):
        applied(poses, [Torque("crank", 1.0), load])


def test_all_faults_of_loads_come_at_once(poses):
    with pytest.raises(SceneError) as caught:
        applied(poses, [Torque("a", 1.0), Torque("b", 1.0)])
    assert len(caught.value.faults) == 2
