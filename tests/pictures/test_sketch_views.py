"""Mechanisms of a scene as they are drawn: at the machine's own coordinate, with the points asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.numerics.faults import SceneError
from flywheel.pictures import sketch
from tests.scenes import press, rotor, shaper

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


def of(scene: dict[str, Any], *points: str) -> tuple[sketch.View, ...]:
    return sketch.views(flywheel.load(scene), points)


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
    turning = sketch.positions(flywheel.load(shaper()))
    assert len(turning) == 6
    assert np.degrees(max(turning)) == pytest.approx(600.0)
    sliding = sketch.positions(flywheel.load(CLAMP))
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
        sketch.checked(flywheel.load(CLAMP), [at])


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
    assert [view.mechanism.name for view in sketch.views(scene)] == ["press"]
    assert sketch.headline(scene) == "Press (not drawn: feed, a law without bodies)"


def test_coordinates_are_told_as_designers_read_them() -> None:
    assert sketch.told(flywheel.load(press()), -np.pi / 6) == "−30°"
    assert sketch.told(flywheel.load(CLAMP), 0.19) == "190 mm"
