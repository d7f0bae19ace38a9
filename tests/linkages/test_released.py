"""Single reactions by virtual power are those of Newton's and Euler's equations, in every kind of joint and coupling."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.reactions import constraints, reactions, virtual_power
from flywheel.mechanisms.linkages.statics import DRIVE
from flywheel.mechanisms.linkages.wrenches import Effort, Force, Torque
from tests.linkages.forced import EVERY

GRAVITY = (0.5, -9.81)


def places(name):
    return EVERY[name].start + np.linspace(0.05, {"rack": 2.0, "rack above": 2.0, "parallelogram": 1.5}.get(name, 6.2), 19)


def loaded(name, **more):
    linkage, q = EVERY[name], places(name)
    pushed, turned, worked = linkage.links[-1].name, linkage.links[1].name, linkage.joints[-1].name
    loads = (Force(pushed, "o", -200.0, 60 * np.cos(q)), Torque(turned, 5.0), Effort(worked, 3.0))
    if linkage.joint(worked).kind == "fixed":
        loads = loads[:2]
    return reactions(linkage, q, -12.0, 30.0, gravity=GRAVITY, loads=loads, **more)


@pytest.mark.parametrize("name", EVERY)
def test_the_two_routes_agree(name):
    found = loaded(name)
    other = virtual_power(found)
    known = [size for joint in found.forces if not np.isnan(size := found.resultant(joint)).any()]
    largest = max((size.max() for size in known), default=np.abs(found.action).max())
    compared = 0
    for joint, parts in other.items():
        for part, value in parts.items():
            mine = found.actions[joint] if part == DRIVE else found.components[joint][part]
            np.testing.assert_allclose(mine, value, rtol=0, atol=1e-10 * largest)
            compared += 1
    assert compared == sum(len(parts) for parts in other.values()) >= 5
    assert found.residual.max() < 1e-12
    assert found.friction.converged.all()


@pytest.mark.parametrize("name", EVERY)
def test_no_constraint_gives_way_in_the_motion_that_the_driver_makes(name):
    """Contacts lie where both bodies' velocities along the force are equal: pitch points, eccentricities, normals."""
    found = loaded(name, friction=False)
    poses = found.poses
    largest = np.abs(poses.rate).max()
    for (joint, part), row in constraints(poses, [poses.linkage.driver]).items():
        parting = np.einsum("bin,bin->n", row, poses.rate)
        wanted = 1.0 if part == DRIVE else 0.0
        np.testing.assert_allclose(parting, wanted, rtol=0, atol=1e-11 * largest, err_msg=f"{joint}.{part}")


def test_releasing_a_redundant_constraint_sets_nothing_free():
    found = loaded("redundant slider-crank")
    other = virtual_power(found)
    assert set(found.undetermined) == {f"{g}.{p}" for g in ("guide", "other_guide") for p in ("normal", "moment")}
    for guide in ("guide", "other_guide"):
        assert all(np.isnan(part).all() for part in other[guide].values())
    assert not np.isnan(found.action).any()
    assert not np.isnan(found.components["slider_pin"]["x"]).any()
