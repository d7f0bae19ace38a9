"""Which ports a linkage offers, and which names the driver takes."""

from __future__ import annotations

from dataclasses import replace

from flywheel.scene.linkage import offered, shadowing, straight
from tests.linkages.linkages import six_bar, slider_crank, whitworth


def test_bodies_turn_and_slides_travel() -> None:
    assert offered(six_bar(), ["tool"]) == {"coupler": True, "rocker": True, "link": True, "output": True, "tool": False}
    assert offered(whitworth()) == {"rocker": True, "link": True, "slot": False, "guide": False}


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
