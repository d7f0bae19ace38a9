"""Where couplings touch, against what wheels and cams are known to do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.reactions import reactions, reactions_at
from flywheel.mechanisms.linkages.wrenches import contact
from flywheel.numerics.faults import SceneError
from tests.linkages import forced

Q = np.linspace(0.1, 3.0, 5)


def touch(linkage):
    poses = solve(linkage, 0.0, 3.1).poses(Q)
    return contact(poses, linkage.couplings[0]), poses


@pytest.mark.parametrize(
    ("linkage", "at", "aside"),
    [
        (forced.geared_five_bar(0.3), (0.2, 0.0), (1.0, 0.0)),  # outside: 0.3 m split 2 : 1, pressed apart
        (forced.internal(), (0.06, 0.08), (0.6, 0.8)),  # inside: radii 0.05 and 0.1, the ring is pressed outwards
    ],
)
def test_wheels_touch_where_their_pitch_circles_do(linkage, at, aside):
    found, _ = touch(linkage)
    np.testing.assert_allclose(found.at, np.outer(at, Q**0), atol=1e-15)
    np.testing.assert_allclose(found.aside, np.outer(aside, Q**0), atol=1e-14)


def test_a_planet_touches_its_sun_on_the_arm():
    found, poses = touch(forced.planetary())
    arm = poses.point("arm", (0.1, 0.0)).value
    np.testing.assert_allclose(found.at, 0.6 * arm, atol=1e-15)  # sun 0.06, planet 0.04: 1.5 turns a turn
    assert (found.first, found.second) == (0, 2)


def test_a_wheel_rolls_below_its_axle():
    found, poses = touch(forced.rolling_wheel())
    axle = poses.point("slider", (0.0, 0.05)).value
    np.testing.assert_allclose(found.at, axle - np.array([[0.0], [0.05]]), atol=1e-15)


def test_a_flat_face_is_touched_at_the_eccentricity_of_the_lifts_slope():
    found, _ = touch(forced.cam("flat"))
    slope = -0.01 * np.sin(Q) + 0.006 * np.cos(2 * Q)
    lift = 0.05 + 0.01 * np.cos(Q) + 0.003 * np.sin(2 * Q)
    np.testing.assert_allclose(found.at, np.stack((slope, lift)), atol=1e-15)
    np.testing.assert_allclose(found.push, np.stack((0 * Q, 1 + 0 * Q)), atol=1e-15)


def test_a_roller_is_pushed_across_the_pitch_curve():
    """The normal of the curve that the roller's centre draws on the cam, by differences of that curve."""
    linkage = forced.cam("roller")
    found, poses = touch(linkage)
    near = solve(linkage, 0.0, 3.1)

    def drawn(q):
        p = near.poses(q)
        x, y = p.point("follower", (0.0, 0.0)).value
        angle = p.angle("cam").value
        return (x + 1j * y) * np.exp(-1j * angle)

    along = (drawn(Q + 1e-5) - drawn(Q - 1e-5)) * np.exp(1j * poses.angle("cam").value)
    assert np.abs(found.push[0] * along.real + found.push[1] * along.imag).max() < 1e-9 * np.abs(along).min() * 10
    assert (found.push[1] > 0.5).all()


def test_the_pressure_angle_parts_the_wheels_whichever_flank_drives():
    """Radial force = |tangential| tan(alpha); the pins feel it, the driving torque does not."""
    alpha = 0.35
    q = np.linspace(0.1, 6.0, 7)
    plain, slanted = (reactions(forced.geared_five_bar(a), q, 15.0) for a in (0.0, alpha))
    tangential = plain.components["mesh"]["tangential"]
    assert (tangential > 0).any()
    assert (tangential < 0).any()
    radial = slanted.components["mesh"]["radial"]
    np.testing.assert_allclose(slanted.components["mesh"]["tangential"], tangential, rtol=1e-12)
    np.testing.assert_allclose(radial, np.abs(tangential) * np.tan(alpha), rtol=1e-12)
    np.testing.assert_allclose(slanted.action, plain.action, rtol=1e-12)
    for pivot, sense in (("pivot", 1.0), ("pinion_pivot", -1.0)):  # the frame holds both wheels together
        change = slanted.components[pivot]["x"] - plain.components[pivot]["x"]
        np.testing.assert_allclose(change, sense * radial, rtol=1e-9)


def refused(linkage, **change):
    other = linkage.couplings[0]._replace(**change)
    poses = solve(linkage, 0.0, 0.2).poses([0.1])
    with pytest.raises(SceneError) as caught:
        contact(poses, other)
    return str(caught.value)


def test_what_has_no_contact_is_refused():
    assert "ratio with a pitch point" in refused(forced.geared_five_bar(), ratio=1.0)
    assert "mesh" in refused(forced.geared_five_bar(), second="top")
    assert "a slide on which the wheel rolls" in refused(forced.geared_five_bar(), kind="rolling")
    assert "contact" in refused(forced.cam("rocker"), contact=None)


def test_friction_of_teeth_is_refused():
    linkage = forced.geared_five_bar()
    rubbing = replace(linkage, couplings=(linkage.couplings[0]._replace(friction=0.1),))
    with pytest.raises(SceneError, match="nothing slides"):
        reactions_at(solve(linkage, 0.0, 1.0).poses([0.5])._replace(linkage=rubbing), 1.0)
