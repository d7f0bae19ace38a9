"""Sketches of machines: symbols, couplings, names, views."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import flywheel
from flywheel import SceneError
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.pictures import sketch as sketching
from flywheel.pictures import sketch as whole_sketch
from flywheel.pictures.figures import Array, along, settle, settled
from flywheel.pictures.sketch import Shape, Sketch, placed, places, radii, sketch, sliding
from flywheel.scene.linkage import FRAME, PIN, SLIDE, SLOT, Joint, Link, Linkage, Point
from tests.linkages.linkages import CASES, cam_rocker, four_bar, geared_five_bar, rolling, slider_crank, whitworth
from tests.pictures.linkages import O, cycle, eccentric, pin, planetary, roller
from tests.scenes import press, rotor, shaper

# Mechanisms of a scene as they are drawn: at the machine's own coordinate, with the points asked for.


CLAMP: dict[str, Any] = {
    "mechanism": {
        "type": "toggle-clamp",
        "frame": {"height": 0.14},
        "bell_crank": {"drive_length": 0.16763, "clamp_length": 0.22, "angle": 0.30199},
        "coupler": {"length": 0.095},
        "rod": {"length": 0.26},
    },
    "stroke": {"from": -0.06, "to": 0.19, "speed": 0.3289474},
}
FEED = {"type": "law", "name": "feed", "outputs": {"out": {"x": "0.01*sin(phi)", "mass": 1}}}


def of(scene: dict[str, Any], *points: str) -> tuple[sketching.View, ...]:
    return sketching.views(flywheel.load(scene), points)


def test_a_mechanism_follows_its_shaft_and_phase() -> None:
    scene = shaper()
    scene["mechanism"]["phase"] = "30 deg"
    (view,) = of(scene)
    crank = view.poses(np.radians([0.0, 100.0, 360.0, 700.0])).angle("crank").value
    expected = np.radians([30.0, 80.0, 210.0, 380.0])
    np.testing.assert_allclose(np.cos(crank - expected), 1.0, atol=1e-14)


def test_a_stroke_is_followed_from_end_to_end() -> None:
    (view,) = of(CLAMP)
    assert (view.solution.low, view.solution.high) == (-0.06, 0.19)
    slide = view.solution.coordinate("block_guide", view.poses([-0.06, 0.19])).value
    np.testing.assert_allclose(slide, [-0.06, 0.19], atol=1e-12)


def test_default_positions_are_a_handful_within_a_turn_or_stroke() -> None:
    turning = sketching.positions(flywheel.load(shaper()))
    assert len(turning) == 6
    assert np.degrees(max(turning)) == pytest.approx(600.0)
    sliding = sketching.positions(flywheel.load(CLAMP))
    assert min(sliding) == -0.06
    assert max(sliding) == pytest.approx(0.19)


@pytest.mark.parametrize("name", ["crank_pin", "rod.crank_pin", "press.crank_pin", "press.rod.slider_pin"])
def test_points_are_found_by_any_of_their_names(name: str) -> None:
    (view,) = of(press(), name)
    assert len(view.sketch.traces) == 1


def test_points_of_one_of_several_mechanisms() -> None:
    base = press()["mechanism"]
    scene = press(mechanism=[base, base | {"name": "other"}])
    scene["load"][0]["on"] = "press.slider"
    first, second = of(scene, "other.crank_pin")
    assert first.points == ()
    assert second.points == ("crank_pin",)
    assert not first.sketch.traces


def test_unknown_points_are_all_reported_with_the_nearest() -> None:
    with pytest.raises(SceneError) as caught:
        of(press(), "crankpin", "nil")
    assert [fault.path for fault in caught.value.faults] == ["points", "points"]
    assert "did you mean 'crank_pin'?" in str(caught.value)


@pytest.mark.parametrize("at", [-0.07, 0.2, float("nan")])
def test_positions_beyond_a_stroke_are_refused(at: float) -> None:
    with pytest.raises(SceneError, match="at: found"):
        sketching.checked(flywheel.load(CLAMP), [at])


def test_what_has_no_bodies_is_refused_in_a_line() -> None:
    areas = {"areas": {"values": [1, -1], "scale": 1}, "regime": {"speed": 1}, "flywheel": {"inertia": 5}}
    with pytest.raises(SceneError, match="found a diagram of areas, expected a mechanism to draw"):
        of(areas)
    with pytest.raises(SceneError, match="expected a mechanism to draw"):
        of(rotor())
    with pytest.raises(SceneError, match=r'mechanism\.type: found "law", which has no bodies'):
        of(rotor(mechanism=FEED))


def test_a_law_beside_a_mechanism_is_left_out_and_named() -> None:
    scene = flywheel.load(press(title="Press", mechanism=[press()["mechanism"], FEED]))
    assert [view.mechanism.name for view in sketching.views(scene)] == ["press"]
    assert sketching.headline(scene) == "Press (not drawn: feed, a law without bodies)"


def test_coordinates_are_told_as_designers_read_them() -> None:
    assert sketching.coordinate_text(flywheel.load(press()), -np.pi / 6) == "−30°"
    assert sketching.coordinate_text(flywheel.load(CLAMP), 0.19) == "190 mm"


# What is drawn of a linkage: every figure stands where the linkage has it, at every position.


def of_kind(drawn: Sketch, *kinds: str) -> list[Shape]:
    return [shape for shape in drawn.shapes if shape.kind in kinds]


def test_outlines_move_with_their_bodies() -> None:
    poses = cycle(four_bar())
    shape = Shape("bar", "coupler", np.array([[0.0, 0.1], [0.0, 0.05]]), ("coupler", (0.2, 0.0)), "coupler")
    x, y, theta = poses.value[poses.linkage.names.index("coupler")]
    expected = x + 1j * y + np.exp(1j * theta) * np.array([[0.2], [0.3 + 0.05j]])
    outline = placed(shape, poses)
    np.testing.assert_allclose(outline[0] + 1j * outline[1], expected, atol=1e-15)


@pytest.mark.parametrize("name", CASES)
def test_every_pin_is_a_circle_on_both_its_bodies(name: str) -> None:
    poses = cycle(CASES[name][0])
    drawn = sketch(poses)
    rings = [placed(shape, poses)[:, :-1].mean(axis=1) for shape in of_kind(drawn, "pin")]
    joints = [joint for joint in poses.linkage.joints if joint.kind in (PIN, SLOT)]
    assert len(rings) == len(joints)
    for ring, joint in zip(rings, joints, strict=True):
        np.testing.assert_allclose(ring, poses.point(joint.second, joint.second_at).value, atol=1e-12)


@pytest.mark.parametrize("name", CASES)
def test_fixed_pivots_stand_on_hatched_supports(name: str) -> None:
    poses = cycle(CASES[name][0])
    fixed = {(j.first_at.x, j.first_at.y) for j in poses.linkage.joints if j.first == FRAME and j.kind == PIN}
    assert {shape.at[1] for shape in of_kind(sketch(poses), "support")} == fixed


@pytest.mark.parametrize("name", CASES)
def test_every_body_is_seen(name: str) -> None:
    poses = cycle(CASES[name][0])
    seen = {shape.body for shape in sketch(poses).shapes}
    assert seen >= set(poses.linkage.names)


def test_three_points_are_a_plate_and_two_a_bar() -> None:
    base = four_bar()
    links = (base.links[0], base.links[1]._replace(points=(*base.links[1].points, Point("Q", 0.2, 0.1))), base.links[2])
    poses = cycle(Linkage(base.ground, links, base.joints, base.driver, sides=base.sides))
    drawn = sketch(poses)
    assert [shape.body for shape in of_kind(drawn, "plate")] == ["coupler"]
    assert [shape.body for shape in of_kind(drawn, "bar")] == ["crank", "rocker"]
    assert [shape.at for shape in of_kind(drawn, "dot")] == [("coupler", (0.2, 0.1))]


def test_a_slot_holds_its_pin_all_the_time() -> None:
    poses = cycle(whitworth())
    joint = next(joint for joint in poses.linkage.joints if joint.kind == SLOT)
    drawn = sketch(poses)
    (slot,) = of_kind(drawn, "slot")
    outline, path = placed(slot, poses), poses.point(joint.second, joint.second_at).value
    for k in range(0, poses.q.size, 8):
        rim = along(outline[:, [*range(outline.shape[1]), 0], k], 0.1 * drawn.unit)
        assert np.hypot(*(rim.T - path[:, k, None])).min() == pytest.approx(1.35 * drawn.unit, rel=1e-2)
    low, high = sliding(poses, joint)
    assert np.ptp(outline[0, :, 0]) <= high - low + 3 * drawn.unit
    assert high - low > 0.05


@pytest.mark.parametrize("direction", [0.0, 60.0, 90.0, 180.0, 240.0, -90.0])
def test_the_ground_lies_under_the_block_all_the_way(direction: float) -> None:
    angle = np.radians(direction)
    base = slider_crank()
    turn = complex(np.cos(angle), np.sin(angle))
    joints = []
    for joint in base.joints:
        if joint.kind == SLIDE:
            first = turn * complex(joint.first_at.x, joint.first_at.y)
            joint = joint._replace(first_at=Point("G", first.real, first.imag), direction=angle)
        joints.append(joint)
    links = tuple(link._replace(guess=None if link.guess is None else link.guess + angle) for link in base.links)
    linkage = Linkage(base.ground, links, tuple(joints), base.driver, start=angle)
    poses = cycle(linkage)
    drawn = sketch(poses)
    (block,) = of_kind(drawn, "block")
    joint = next(joint for joint in joints if joint.kind == SLIDE)
    ground = next(s for s in of_kind(drawn, "ground") if s.at[1] == (joint.first_at.x, joint.first_at.y))
    lines = placed(ground, poses)[:, :, 0]
    way = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-way[1], way[0]])
    blocks = placed(block, poses)
    level = across @ (lines[:, 0] - np.array(joint.first_at[1:]))
    under = across @ (blocks.reshape(2, -1) - np.array(joint.first_at[1:])[:, None])
    assert min(abs(under.min() - level), abs(under.max() - level)) < 1e-9
    assert (level < 0.0) == (np.cos(angle) > -1e-9)
    reach = way @ blocks.reshape(2, -1)
    assert np.nanmin(way @ lines[:, :2]) < reach.min()
    assert np.nanmax(way @ lines[:, :2]) > reach.max()


def test_a_yoke_is_a_rail_joined_to_its_block() -> None:
    """The yoke's slot stands across its guide; a node off the slot is joined to it."""
    crank, yoke = Link("crank", (O, Point("A", 0.1))), Link("yoke", (O, Point("B", 0.3)))
    joints = (
        pin("O", FRAME, "crank"),
        Joint("A", SLOT, "yoke", "crank", O, Point("A", 0.1), direction=np.pi / 2, guess=0.0),
        Joint("guide", SLIDE, FRAME, "yoke", O, Point("B", 0.3)),
    )
    poses = cycle(Linkage(Link(FRAME, (O,)), (crank, yoke), joints, "O"))
    drawn = sketch(poses)
    rails = [shape for shape in of_kind(drawn, "rail") if shape.body == "yoke"]
    bars = [shape for shape in of_kind(drawn, "bar") if shape.body == "yoke"]
    assert len(rails) == len(bars) == 1
    assert np.ptp(rails[0].outline[1]) > 0.2
    assert np.ptp(bars[0].outline[0]) == pytest.approx(0.3 + 2 * 0.62 * drawn.unit, rel=1e-2)


def test_welds_are_marked() -> None:
    poses = cycle(four_bar())
    welded = Linkage(
        poses.linkage.ground,
        (*poses.linkage.links, Link("arm", (O, Point("T", 0.0, 0.1)))),
        (*poses.linkage.joints, Joint("weld", "fixed", "rocker", "arm", O, O)),
        "O",
        sides=poses.linkage.sides,
    )
    drawn = sketch(cycle(welded))
    assert [shape.turns_with for shape in of_kind(drawn, "weld")] == ["rocker"]


def test_a_rotor_alone_is_a_disc() -> None:
    poses = cycle(Linkage(Link(FRAME, (O,)), (Link("rotor", (O,)),), (pin("O", FRAME, "rotor"),), "O"))
    drawn = sketch(poses)
    assert [shape.kind for shape in drawn.shapes if shape.body == "rotor"] == ["plate", "mark"]
    assert not drawn.traces


# -- the driver's arrow ----------------------------------------------------------------------------------------------


def test_the_arrow_follows_the_driver_s_positive_sense() -> None:
    (turning,) = of_kind(sketch(cycle(four_bar())), "arrow")
    assert turning.outline[0, 0] > 0.0  # from the right over the top: counter-clockwise
    ram = Link("ram", (O,))
    guide = Joint("guide", SLIDE, FRAME, "ram", O, O, direction=np.pi)
    poses = _slid(Linkage(Link(FRAME, (O,)), (ram,), (guide,), "guide"))
    (sliding_arrow,) = of_kind(sketch(poses), "arrow")
    outline = placed(sliding_arrow, poses)[:, :, 0]
    block = placed(of_kind(sketch(poses), "block")[0], poses)[:, :, 0]
    assert outline[0, 1] < outline[0, 0]  # the tip lies to the left
    assert outline[1].min() > block[1].max()  # above the block, clear of the hatching


def _slid(linkage: Linkage) -> Poses:
    from flywheel.mechanisms.linkages.positions import solve

    return solve(linkage, 0.0, 0.2).poses(np.linspace(0.0, 0.2, 21))


# -- paths and names -------------------------------------------------------------------------------------------------


def test_paths_are_of_moving_points_each_once() -> None:
    poses = cycle(four_bar())
    drawn = sketch(poses)
    assert [t.name for t in drawn.traces] == ["A", "B"]
    np.testing.assert_allclose(drawn.traces[1].path, poses.point("rocker", poses.linkage.link("rocker").points[1]).value)


def test_paths_of_points_asked_for() -> None:
    drawn = sketch(cycle(four_bar()), ["B"])
    assert [t.name for t in drawn.traces] == ["B"]
    with pytest.raises(KeyError):
        sketch(cycle(four_bar()), ["nobody"])


def test_joints_of_one_place_share_a_name() -> None:
    drawn = sketch(cycle(slider_crank()))
    texts = [label.text for label in drawn.labels if label.body == FRAME]
    assert "B, guide" in texts
    assert [label.text for label in drawn.labels if label.body != FRAME] == ["crank", "rod", "slider"]


def test_places_are_joints_and_points() -> None:
    assert {"A", "rod.E", "guide"} <= set(places(slider_crank()))


# Figures of couplings: they touch where the motion says, and roll without slipping.


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


# Places of names: clear of lines and of each other, near to what they name, in the picture.


BOUNDS = np.array([0.0, 0.0, 400.0, 300.0])


def boxes(centres: Array, sizes: Array) -> list[tuple[Array, Array]]:
    return [(c - 0.5 * s, c + 0.5 * s) for c, s in zip(centres, sizes, strict=True)]


def test_names_at_one_place_do_not_overlap() -> None:
    anchors, sizes = np.full((6, 2), 150.0), np.tile([40.0, 12.0], (6, 1))
    centres = settled(anchors, sizes, np.zeros((0, 2)), BOUNDS)
    for (low, high), (other_low, other_high) in combinations(boxes(centres, sizes), 2):
        assert (low >= other_high).any() or (other_low >= high).any()


def test_names_keep_clear_of_lines() -> None:
    cross = np.concatenate(
        [along(np.array([[0.0, 400.0], [150.0, 150.0]]), 2.0), along(np.array([[200, 200], [0, 300]]), 2.0)]
    )
    sizes = np.array([[30.0, 10.0]])
    (box,) = boxes(settled(np.array([[200.0, 150.0]]), sizes, cross, BOUNDS), sizes)
    assert not ((cross > box[0]) & (cross < box[1])).all(axis=1).any()


@pytest.mark.parametrize("corner", [(0.0, 0.0), (400.0, 0.0), (0.0, 300.0), (400.0, 300.0)])
def test_names_stay_in_the_picture(corner: tuple[float, float]) -> None:
    sizes = np.array([[60.0, 12.0]])
    (box,) = boxes(settled(np.array([corner]), sizes, np.zeros((0, 2)), BOUNDS), sizes)
    assert (box[0] >= BOUNDS[:2]).all()
    assert (box[1] <= BOUNDS[2:]).all()


@pytest.mark.parametrize("way", [(1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 0.0)])
def test_names_go_where_they_would_like_to(way: tuple[float, float]) -> None:
    anchor, sizes = np.array([[200.0, 150.0]]), np.array([[20.0, 20.0]])
    shift = (settled(anchor, sizes, np.zeros((0, 2)), BOUNDS, np.array([way])) - anchor)[0]
    assert shift @ np.array(way) == pytest.approx(np.hypot(*shift) if any(way) else 0.0)
    assert np.hypot(*shift) < 25.0 * np.sqrt(2)


def test_points_along_a_line_are_close_and_skip_gaps() -> None:
    path = np.array([[0.0, 10.0, np.nan, 50.0, 50.0], [0.0, 0.0, np.nan, 0.0, 7.0]])
    points = along(path, 1.0)
    assert not ((points[:, 0] > 10.0) & (points[:, 0] < 50.0)).any()
    first = points[points[:, 0] <= 10.0]
    assert np.diff(first[:, 0]).max() <= 1.0 + 1e-12
    assert points[-1].tolist() == [50.0, 7.0]


# Outlines: they have the sizes that their names promise.


def area(outline: whole_sketch.Array) -> float:
    """Area inside a closed outline, positive counter-clockwise."""
    x, y = outline
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def test_a_bar_is_a_strip_with_round_ends() -> None:
    bar = whole_sketch.rounded(np.array([[0.0, 3.0], [0.0, 4.0]]), 0.5)
    assert area(bar) == pytest.approx(5.0 * 1.0 + np.pi * 0.25, rel=1e-3)


def test_a_plate_is_its_hull_a_radius_wider() -> None:
    corners = np.array([[0.0, 4.0, 0.0, 1.0], [0.0, 0.0, 3.0, 0.5]])
    plate = whole_sketch.rounded(corners, 0.1)
    assert area(plate) == pytest.approx(6.0 + 12.0 * 0.1 + np.pi * 0.01, rel=1e-3)


def test_a_slot_is_as_long_as_its_pin_goes() -> None:
    slot = whole_sketch.slot(-1.0, 2.0, 0.25)
    assert slot.min(axis=1) == pytest.approx([-1.25, -0.25], abs=1e-3)
    assert slot.max(axis=1) == pytest.approx([2.25, 0.25], abs=1e-3)
    assert area(slot) == pytest.approx(3.0 * 0.5 + np.pi / 16, rel=1e-3)


def test_ground_is_hatched_below() -> None:
    ground = whole_sketch.ground(-1.0, 1.0, 0.2)
    assert np.nanmax(ground[1]) == 0.0
    assert np.nanmin(ground[1]) < 0.0
    assert np.nanmax(np.abs(ground[0])) <= 1.0 + 0.2


def test_round_arrows_show_the_sense() -> None:
    left, right = whole_sketch.round_arrow(1.0, 0.3, 1), whole_sketch.round_arrow(1.0, 0.3, -1)
    assert left[0, 0] > 0.0 > left[0, -2]
    assert right[0, 0] < 0.0 < right[0, -2]


@pytest.mark.parametrize("way", [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
def test_a_name_that_has_no_room_is_left_out(way: tuple[float, float]) -> None:
    """More than half as wide and as high as its panel: beside the middle it stands beyond one side, whichever it likes."""
    figure = Figure(figsize=(100 / 72, 100 / 72))
    panel = figure.add_axes((0.3, 0.3, 0.4, 0.4))
    names = [panel.text(0.0, 0.0, "M", fontsize=size) for size in (36, 4)]
    for name in names:
        settle(panel, [name], np.array([[0.5, 0.5]]), [np.array([[0.0, 0.1], [0.0, 0.0]])], np.array([way]), keep=0)
    assert list(panel.texts) == names[1:]
