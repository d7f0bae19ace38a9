"""The description of a linkage: its bodies, ports and driver's names, and that equal ones are one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flywheel.scene.linkage import FRAME, Lift, Link, Point, common_body, offered, shadowing, straight
from tests.linkages.linkages import SINE, cam_rocker, four_bar, geared_five_bar, pin, six_bar, slider_crank, whitworth


def test_bodies_and_points_by_name() -> None:
    linkage = four_bar()
    assert linkage.names == (FRAME, "crank", "coupler", "rocker")
    assert linkage.link(FRAME).point("D") == Point("D", 0.4, 0.0)
    with pytest.raises(KeyError):
        Link("bar").point("E")


def test_equal_linkages_and_lifts_are_one() -> None:
    assert hash(four_bar()) == hash(four_bar())
    assert four_bar() == four_bar() != four_bar(side=-1)
    assert Lift(SINE.curve, 1.0) == Lift(SINE.curve, 1.0) != Lift(SINE.curve, 2.0)
    assert cam_rocker() == cam_rocker()


def test_the_frame_carries_before_any_other_body() -> None:
    linkage = geared_five_bar()
    assert linkage.carrier(linkage.couplings[0]) == FRAME
    assert common_body(pin("A", "x", FRAME), pin("B", FRAME, "x")) == FRAME
    assert common_body(pin("A", "x", "y"), pin("B", "z", "y")) == "y"
    assert common_body(pin("A", "x", "y"), pin("B", "z", "w")) == ""


def test_what_slides_and_what_rubs() -> None:
    linkage = slider_crank()
    assert not linkage.sliding
    assert replace(linkage, driver="guide").sliding
    assert not linkage.rubs
    rough = tuple(joint._replace(friction=0.1) if joint.name == "guide" else joint for joint in linkage.joints)
    assert replace(linkage, joints=rough).rubs


def test_bodies_turn_and_slides_travel() -> None:
    assert offered(six_bar(), ["tool"]) == {"coupler": True, "rocker": True, "link": True, "output": True, "tool": False}
    assert offered(whitworth()) == {"rocker": True, "link": True, "slot": False, "guide": False}
    renamed = tuple(joint._replace(name="slide") if joint.name == "guide" else joint for joint in whitworth().joints)
    assert offered(replace(whitworth(), joints=renamed)) == {"rocker": True, "link": True, "slot": False, "slide": False}


def test_what_a_slide_holds_cannot_turn() -> None:
    assert straight(slider_crank().joints) == {"slider"}
    assert "slider" not in offered(slider_crank())


def test_a_driver_called_slide_is_the_element_itself() -> None:
    base = slider_crank()
    joints = tuple(j._replace(name="slide") if j.name == "guide" else j for j in base.joints)
    assert "slide" not in offered(replace(base, joints=joints, driver="slide"))


def test_names_by_which_loads_reach_the_driver() -> None:
    assert shadowing(["crank", "rod"], sliding=False) == ["crank"]
    assert shadowing(["crank", "slide"], sliding=True) == ["slide"]
