"""Loops: what closes them, and what bodies and joints cannot be put together."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flywheel.mechanisms.linkages.equations import loops
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import FRAME, SLIDE, Joint, Link
from tests.linkages.linkages import O, four_bar, six_bar, slider_crank, whitworth


@pytest.mark.parametrize(
    ("linkage", "unknowns", "closures"),
    [(four_bar(), 2, 1), (six_bar(), 4, 2), (slider_crank(), 2, 1), (whitworth(), 4, 2)],
)
def test_two_equations_a_loop(linkage: object, unknowns: int, closures: int) -> None:
    found = loops(linkage)  # type: ignore[arg-type]
    assert (found.unknowns, len(found.closures)) == (unknowns, closures)
    assert found.equations == found.unknowns


def test_a_loop_names_its_joints() -> None:
    assert loops(four_bar()).paths == (("A", "O", "D", "B"),) or set(loops(four_bar()).paths[0]) == {"O", "A", "B", "D"}


def test_bodies_that_slide_share_their_angle() -> None:
    found = loops(slider_crank())
    names = found.linkage.names
    assert not found.angles[names.index("slider")].weights.any()
    assert found.names == ("coordinate of O", "angle of rod", "slide of guide")


def test_a_body_on_nothing() -> None:
    base = four_bar()
    with pytest.raises(SceneError, match=r"bodies\.stray: found a body that no joints connect"):
        loops(replace(base, links=(*base.links, Link("stray", (O,)))))


def test_a_driver_that_cannot_move() -> None:
    base = slider_crank()
    other = Joint("rail", SLIDE, FRAME, "crank", O, O)
    with pytest.raises(SceneError, match=r"driver: found O between frame and crank, which cannot turn"):
        loops(replace(base, joints=(*base.joints, other)))


def test_two_slides_that_disagree() -> None:
    base = slider_crank()
    other = Joint("rail", SLIDE, FRAME, "slider", O, O, angle=0.1)
    with pytest.raises(SceneError, match=r"rail, which turns slider by 5\.7.* deg against"):
        loops(replace(base, joints=(*base.joints, other)))


def test_two_slides_that_agree_are_one_too_many() -> None:
    base = slider_crank()
    other = Joint("rail", SLIDE, FRAME, "slider", O, O)
    assert loops(replace(base, joints=(*base.joints, other))).doubled == ("rail",)


def test_a_pin_between_moving_bodies_may_drive() -> None:
    base = six_bar()
    found = loops(replace(base, driver="B"))
    assert found.names[0] == "coordinate of B"
