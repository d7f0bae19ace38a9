"""Gruebler's count against the rank: too many joints, too few, and joints that repeat each other."""

from __future__ import annotations

from dataclasses import replace
from math import tau

import numpy as np
import pytest

from flywheel.mechanisms.linkages.assembly import gruebler
from flywheel.mechanisms.linkages.positions import solve
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import FRAME, GEAR, SLIDE, Coupling, Joint, Link, Linkage, Point, Side
from tests.linkages.linkages import O, bar, four_bar, geared_five_bar, ground, pin, slider_crank


def parallelogram(third: float = 0.2) -> Linkage:
    """Two equal cranks and a third one between them, which is one too many: at the share `third`/0.4 of the coupler."""
    frame = ground(D=(0.4, 0.0), M=(third, 0.0))
    links = (bar("crank", 0.1), bar("coupler", 0.4, guess=0.0, M=(0.2, 0.0)), bar("rocker", 0.1), bar("middle", 0.1))
    joints = (
        pin("O", FRAME, "crank"),
        pin("A", "crank", "coupler", links[0].point("E")),
        pin("B", "coupler", "rocker", links[1].point("E"), links[2].point("E")),
        pin("D", FRAME, "rocker", frame.point("D")),
        pin("M", FRAME, "middle", frame.point("M")),
        pin("N", "middle", "coupler", links[3].point("E"), links[1].point("M")),
    )
    return Linkage(frame, links, joints, "O", start=1.0)


def test_a_redundant_crank_is_named() -> None:
    found = solve(parallelogram(), 0.5, 2.5).mobility
    assert (found.gruebler, found.freedom) == (0, 1)
    assert all("keeps its bodies parallel" in text for text in found.redundant)
    assert {"N", "M"} & set(" ".join(found.redundant).split())


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_three_cranks_in_line_turn_fully_though_two_of_them_branch(start: float) -> None:
    poses = solve(replace(parallelogram(), start=start), 0.0, tau).poses(np.linspace(0.0, tau, 61))
    np.testing.assert_allclose(np.exp(1j * poses.angle("coupler").value), 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("rocker").rate, 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("middle").slope, 0.0, atol=1e-11)


@pytest.mark.parametrize("start", [0.0, 1.0])
@pytest.mark.parametrize("idler", [False, True])
def test_a_gear_pair_carries_a_parallelogram_through_its_change_points(start: float, idler: bool) -> None:
    base = parallelogram()
    frame = ground(D=(0.4, 0.0), I=(0.2, 0.0))
    plain = replace(base, ground=frame, links=base.links[:3], joints=base.joints[:4], start=start)
    geared = replace(plain, couplings=(Coupling("belt", GEAR, "O", "D", 1.0),))
    if idler:
        wheels = Coupling("first", GEAR, "O", "I", -1.0), Coupling("second", GEAR, "I", "D", -1.0)
        wheel = Link("idler", (O,), guess=-start)
        pivot = pin("I", FRAME, "idler", frame.point("I"))
        geared = replace(plain, links=(*plain.links, wheel), joints=(*plain.joints, pivot), couplings=wheels)
    poses = solve(geared, 0.0, tau).poses(np.linspace(0.0, tau, 61))
    np.testing.assert_allclose(np.exp(1j * poses.angle("coupler").value), 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("rocker").rate, 1.0, atol=1e-12)


def test_three_cranks_out_of_line_turn_fully() -> None:
    base = parallelogram()
    frame = ground(D=(0.4, 0.0), M=(0.15, 0.12))
    coupler = base.links[1]._replace(points=(*base.links[1].points[:2], Point("M", 0.15, 0.12)))
    links = (base.links[0], coupler, *base.links[2:])
    places = {"M": frame.point("M"), "N": coupler.point("M")}
    joints = tuple(
        j._replace(first_at=places["M"]) if j.name == "M" else j._replace(second_at=places["N"]) if j.name == "N" else j
        for j in base.joints
    )
    solution = solve(replace(base, ground=frame, links=links, joints=joints), 0.0, tau)
    poses = solution.poses(np.linspace(0.0, tau, 61))
    np.testing.assert_allclose(np.exp(1j * poses.angle("coupler").value), 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("rocker").rate, 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("middle").slope, 0.0, atol=1e-11)
    assert solution.mobility.freedom == 1


def test_a_third_crank_out_of_place_cannot_be_assembled() -> None:
    with pytest.raises(SceneError, match="cannot be assembled"):
        solve(parallelogram(0.25), 0.5, 2.5)


@pytest.mark.parametrize(("start", "crossed"), [(0.0, False), (1.0, False), (1.0, True)])
def test_change_points_of_the_parallelogram_are_named(start: float, crossed: bool) -> None:
    base = parallelogram()
    crank, _, rocker, _ = base.links
    sides = (Side(("rocker", "E"), ("crank", "E"), (FRAME, "D"), -1 if crossed else 1),) if start == 1.0 else ()
    links = (crank, bar("coupler", 0.4), rocker)
    with pytest.raises(SceneError) as caught:
        solve(replace(base, links=links, joints=base.joints[:4], sides=sides, start=start), 0.5, 4.0)
    kind = "an antiparallelogram" if crossed else "a parallelogram"
    angle = f"{180 if start else 0} deg"
    expected = f"found {kind} (coupler, crank, frame, rocker) that branches (a change point) with the driver O at {angle}"
    assert expected in str(caught.value)
    rate = -(0.4 - 0.1) / (0.4 + 0.1) if start else -(0.4 + 0.1) / (0.4 - 0.1)  # distances of the relative pole on the line
    text = str(caught.value)
    assert "a parallelogram: coupler 0 rad, rocker 1 rad per rad of the driver; or an antiparallelogram: coupler" in text
    assert f"rocker {rate:.4g} rad per rad" in text
    assert "a gear pair, or a third crank" in text


def test_two_guides_of_one_slider() -> None:
    base = slider_crank()
    twice = replace(base, joints=(*base.joints, Joint("rail", SLIDE, FRAME, "slider", Point("G", 0.0, 0.02), O)))
    found = solve(twice, 0.0, tau).mobility
    assert (found.gruebler, found.freedom) == (-1, 1)
    assert any("rail" in text for text in found.redundant)
    assert len(found.redundant) == 2


def test_too_few_joints() -> None:
    base = geared_five_bar()
    with pytest.raises(SceneError, match=r"2 degrees of freedom \(Gruebler 2\): with the driver held, angle of"):
        solve(replace(base, couplings=()), 0.0, tau)


def test_too_many_joints() -> None:
    base = four_bar()
    extra = replace(
        base,
        links=(*base.links, Link("strut", (O, Point("E", 0.42)))),
        joints=(*base.joints, pin("S", FRAME, "strut"), pin("T", "strut", "rocker", Point("E", 0.42), Point("E", 0.15))),
    )
    with pytest.raises(SceneError, match=r"loop .* stays open by .*; Gruebler's count is 0 .* a joint may be too many"):
        solve(extra, 0.0, tau)
    assert gruebler(extra) == 0
