"""Figures of couplings: they touch where the motion says, and roll without slipping."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.positions import Poses
from flywheel.pictures.sketch import Shape, placed, radii, sketch
from flywheel.scene.linkage import FRAME, Linkage
from tests.linkages.linkages import cam_rocker, geared_five_bar, rolling
from tests.pictures.linkages import cycle, eccentric, planetary, roller


def shapes(poses: Poses, *kinds: str) -> list[Shape]:
    return [shape for shape in sketch(poses).shapes if shape.kind in kinds]


def radius(shape: Shape) -> float:
    return float(np.hypot(*shape.outline).max())


def rim_velocity(poses: Poses, wheel: Shape, at: np.ndarray) -> np.ndarray:
    """Velocity (by q) of the point of a wheel that is at a place (2, n) now."""
    centre, spin = poses.point(*wheel.at), poses.angle(wheel.body).rate
    arm = at - centre.value
    return np.asarray(centre.rate + spin * np.stack((-arm[1], arm[0])))


@pytest.mark.parametrize("linkage", [geared_five_bar(), planetary(-0.5), planetary(3.0), planetary(0.25)])
def test_pitch_circles_touch_and_roll(linkage: Linkage) -> None:
    poses = cycle(linkage)
    one, two = shapes(poses, "wheel")
    first, second = poses.point(*one.at).value, poses.point(*two.at).value
    gap = second - first
    distance = np.hypot(*gap)
    inside = linkage.couplings[0].ratio > 0.0
    reach = abs(radius(one) - radius(two)) if inside else radius(one) + radius(two)
    np.testing.assert_allclose(distance, reach, rtol=1e-12)
    sign = -1.0 if inside and radius(two) > radius(one) else 1.0
    pitch = first + sign * radius(one) * gap / distance
    np.testing.assert_allclose(rim_velocity(poses, one, pitch), rim_velocity(poses, two, pitch), atol=1e-12)


def test_equal_speeds_have_no_pitch_circles() -> None:
    assert radii(1.0, 0.1) == (np.inf, np.inf)
    assert not shapes(cycle(planetary(1.0)), "wheel")


@pytest.mark.parametrize("linkage", [rolling(), roller()])
def test_wheels_roll_on_their_lines(linkage: Linkage) -> None:
    poses = cycle(linkage)
    (wheel,) = shapes(poses, "wheel")
    centre = poses.point(*wheel.at).value
    side = radius(wheel) * np.array([0.0, -1.0 if linkage.couplings[0].name == "roll" else 1.0])
    contact = centre + side[:, None]
    lines = [s for s in shapes(poses, "track", "ground") if abs(placed(s, poses)[1, 0, 0] - contact[1, 0]) < 1e-12]
    assert len(lines) == 1
    ends = placed(lines[0], poses)[0, :2]
    assert (ends.min(axis=0) < contact[0]).all()
    assert (ends.max(axis=0) > contact[0]).all()
    under = poses.point(lines[0].body, (0.0, 0.0)).rate
    np.testing.assert_allclose(rim_velocity(poses, wheel, contact), under, atol=1e-12)
    assert lines[0].body == (FRAME if linkage.couplings[0].name == "roll" else "slider")


def test_a_cam_s_profile_passes_through_its_contact() -> None:
    poses = cycle(eccentric(contact=True))
    (cam,) = shapes(poses, "cam")
    outline, contact = placed(cam, poses), poses.point("follower", (0.0, 0.0)).value
    away = np.hypot(*(outline - contact[:, None, :])).min(axis=0)
    assert away.max() < 1e-12


def test_the_profile_under_a_flat_face_is_the_eccentric_disc() -> None:
    poses = cycle(eccentric(), 361)
    (cam,) = shapes(poses, "cam")
    centre = 0.5 * (cam.outline.max(axis=1) + cam.outline.min(axis=1))
    assert np.hypot(*centre) == pytest.approx(0.02, rel=1e-3)
    np.testing.assert_allclose(np.hypot(*(cam.outline - centre[:, None])), 0.05, rtol=1e-3)
    top = placed(cam, poses)[1].max(axis=0)
    np.testing.assert_allclose(top, poses.point("follower", (0.0, 0.0)).value[1], rtol=1e-3)


def test_a_cam_whose_profile_is_not_known_is_a_disc() -> None:
    """The follower's point passes the axis: no flat face can be there."""
    poses = cycle(cam_rocker())
    (cam,) = shapes(poses, "cam")
    np.testing.assert_allclose(np.hypot(*cam.outline), radius(cam), rtol=1e-12)
    assert radius(cam) == pytest.approx(6 * sketch(poses).unit)


def test_half_a_turn_gives_half_a_profile() -> None:
    poses = cycle(eccentric(contact=True))
    half = Poses(poses.linkage, poses.q[:61], poses.value[:, :, :61], poses.rate[:, :, :61], poses.slope[:, :, :61])
    assert not shapes(half, "cam")
    assert [shape.body for shape in shapes(half, "track")] == ["cam"]
