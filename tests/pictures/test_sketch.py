"""What is drawn of a linkage: every figure stands where the linkage has it, at every position."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.positions import Poses
from flywheel.pictures.figures import along
from flywheel.pictures.sketch import Shape, Sketch, placed, places, sketch, sliding
from flywheel.scene.linkage import FRAME, PIN, SLIDE, SLOT, Joint, Link, Linkage, Point
from tests.linkages.linkages import CASES, four_bar, slider_crank, whitworth
from tests.pictures.linkages import O, cycle, pin


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
