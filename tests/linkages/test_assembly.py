"""Every assembly is found, and the choice among them is never silent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from flywheel.mechanisms.linkages.assembly import assembled, assemblies
from flywheel.mechanisms.linkages.equations import Equations, loops
from flywheel.mechanisms.linkages.positions import solve
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import FRAME, GEAR, Coupling, Link, Linkage, Point, Side
from tests.linkages.linkages import (
    O,
    cam_rocker,
    four_bar,
    geared_five_bar,
    pin,
    rolling,
    six_bar,
    slider_crank,
    whitworth,
)


def unguessed(linkage: Linkage) -> Linkage:
    """The linkage without guesses and sides."""
    return replace(linkage, links=tuple(link._replace(guess=None) for link in linkage.links), sides=())


@pytest.mark.parametrize(
    ("linkage", "count"),
    [(four_bar(), 2), (slider_crank(), 2), (six_bar(), 4), (whitworth(), 2), (geared_five_bar(), 2), (cam_rocker(), 2)],
)
def test_finds_all_assemblies(linkage: Linkage, count: int) -> None:
    equations = Equations(loops(unguessed(linkage)))
    found = assemblies(equations)
    assert len(found) == count
    assert np.abs(equations.residual(found, equations.bases(found))).max() < 1e-10


def test_without_a_guess_the_assemblies_are_listed() -> None:
    with pytest.raises(SceneError) as caught:
        assembled(Equations(loops(unguessed(four_bar()))))
    text = str(caught.value)
    assert "2 assemblies that fit with O at 0 deg" in text
    assert text.count("coupler") == 2
    assert "guess or side" in text


def test_a_guess_between_two_assemblies_is_refused() -> None:
    base = unguessed(four_bar())
    found = assemblies(Equations(loops(base)))
    middle = float(np.angle(np.exp(1j * found[:, 1]).sum()))
    crank, coupler, rocker = base.links
    doubtful = replace(base, links=(crank, coupler._replace(guess=middle + 0.02), rocker))
    with pytest.raises(SceneError, match="guesses that do not tell the assemblies apart"):
        assembled(Equations(loops(doubtful)))


@pytest.mark.parametrize("off", [-0.5, 0.5])
def test_a_rough_guess_takes_the_nearest(off: float) -> None:
    base = unguessed(four_bar())
    found = assemblies(Equations(loops(base)))
    crank, coupler, rocker = base.links
    for z in found:
        guessed = replace(base, links=(crank, coupler._replace(guess=float(z[1]) + off), rocker))
        chosen = assembled(Equations(loops(guessed)))
        assert abs((chosen[1] - z[1] + pi) % (2 * pi) - pi) < 1e-9


def test_sides_choose() -> None:
    left, right = (assembled(Equations(loops(four_bar(side=side)))) for side in (1, -1))
    assert left[2] > 0.0
    assert abs(left[2] + right[2]) < 1e-9


def test_sides_that_contradict() -> None:
    base = four_bar()
    side = base.sides[0]
    with pytest.raises(SceneError, match=r"assembly: found sides that no assembly fits"):
        assembled(Equations(loops(replace(base, sides=(side, Side(*side[:3], -side.sense))))))


def test_bars_that_do_not_reach() -> None:
    with pytest.raises(SceneError, match=r"cannot be assembled with O at 0 deg, .* the loop .* stays open by 1\.25 m"):
        assembled(Equations(loops(four_bar(d=2.0))))


def test_a_start_in_a_singular_position() -> None:
    flat = replace(slider_crank(0.1, 0.1, 0.0), start=pi / 2)
    with pytest.raises(SceneError, match=r"branches \(a change point\) with the driver O at 90 deg"):
        assembled(Equations(loops(flat)))


def test_guesses_that_contradict_each_other() -> None:
    base = unguessed(six_bar())
    found = assemblies(Equations(loops(base)))
    first = found[0]
    other = next(z for z in found[1:] if np.allclose(z[1:3], first[1:3]))
    wanted = {"coupler": first[1], "rocker": first[2], "link": first[3], "output": other[4]}
    guesses = {name: float(value) for name, value in wanted.items()}
    links = tuple(link._replace(guess=guesses.get(link.name)) for link in base.links)
    with pytest.raises(SceneError, match=r"contradict each other, as angle of|do not tell the assemblies apart"):
        assembled(Equations(loops(replace(base, links=links))))


@pytest.mark.parametrize("ratio", [-1.0, 0.5])
@pytest.mark.parametrize("phase", [-150.0, 30.0, 690.0])
def test_gears_hold_their_relation_and_the_side_is_kept(ratio: float, phase: float) -> None:
    base = unguessed(geared_five_bar(ratio, phase * pi / 180))
    side = Side(("left", "E"), ("crank", "E"), ("second", "E"), 1)
    solution = solve(replace(base, sides=(side,)), 0.0, 1.0)
    phi = np.linspace(0.0, 1.0, 7)
    poses = solution.poses(phi)
    second = ratio * phi + phase * pi / 180
    np.testing.assert_allclose(np.exp(1j * poses.angle("second").value), np.exp(1j * second), atol=1e-12)
    a, b = 0.08 * np.exp(1j * phi), 0.3 + 0.06 * np.exp(1j * second)
    along = (0.3**2 - 0.28**2 + abs(b - a) ** 2) / (2 * abs(b - a))
    c = a + (b - a) / abs(b - a) * (along + 1j * np.sqrt(0.3**2 - along**2))
    np.testing.assert_allclose(np.exp(1j * poses.angle("left").value), (c - a) / abs(c - a), atol=1e-12)


def geared_arm(ratio: float, guess: float | None) -> Linkage:
    """A four-bar whose rocker drives an arm on a pivot of the frame by a gear pair."""
    base = four_bar()
    arm = Link("arm", (O, Point("E", 0.1)), guess=guess)
    joints = (*base.joints, pin("W", FRAME, "arm", Point("W", 0.6, 0.1)))
    return replace(base, links=(*base.links, arm), joints=joints, couplings=(Coupling("pair", GEAR, "D", "W", ratio),))


def test_turns_of_a_geared_rocker_are_counted_within_half_a_turn_unless_guessed() -> None:
    rocker = float(solve(four_bar(), 0.0, 1.0).poses([0.0]).angle("rocker").value[0])
    rocker = (rocker + pi) % (2 * pi) - pi
    plain = solve(geared_arm(0.5, None), 0.0, 1.0).poses([0.0]).angle("arm").value[0]
    assert plain == pytest.approx(0.5 * rocker, abs=1e-12)
    other = solve(geared_arm(0.5, 0.5 * rocker + pi), 0.0, 1.0).poses([0.0]).angle("arm").value[0]
    assert np.exp(1j * other) == pytest.approx(np.exp(1j * (0.5 * rocker + pi)), abs=1e-12)


@pytest.mark.parametrize("guess", [1.9, 1.9 + 4 * pi])
def test_angles_start_within_half_a_turn_of_their_guesses(guess: float) -> None:
    base = unguessed(four_bar())
    crank, coupler, rocker = base.links
    solution = solve(replace(base, links=(crank, coupler, rocker._replace(guess=guess))), 0.0, 1.0)
    assert abs(solution.poses([0.0]).angle("rocker").value[0] - guess) < pi


@pytest.mark.parametrize("make", [six_bar, whitworth, geared_five_bar, cam_rocker, four_bar])
def test_every_assembly_is_chosen_by_its_own_angles(make: Callable[[], Linkage]) -> None:
    base = unguessed(make())
    found = Equations(loops(base))
    for z in assemblies(found):
        angles = {name.removeprefix("angle of "): float(v) for name, v in zip(found.loops.names, z, strict=True)}
        links = tuple(link._replace(guess=angles.get(link.name)) for link in base.links)
        chosen = assembled(Equations(loops(replace(base, links=links))))
        np.testing.assert_allclose(np.exp(1j * chosen), np.exp(1j * z), atol=1e-9)


def test_a_small_pinion_turns_as_often_as_its_rack_asks() -> None:
    base, radius = rolling(), 0.004
    links = tuple(link._replace(guess=None) for link in base.links)
    joints = tuple(j._replace(guess=0.39) if j.name == "guide" else j for j in base.joints)
    pair = base.couplings[0]._replace(ratio=radius, phase=-0.967)
    solution = solve(replace(base, links=links, joints=joints, couplings=(pair,)), 0.0, 1.0)
    poses = solution.poses([0.0])
    slide = float(solution.coordinate("guide", poses).value[0])
    assert slide == pytest.approx(0.1 + np.sqrt(0.09 - 0.02**2), abs=1e-12)
    assert poses.angle("pinion").value[0] == pytest.approx((slide + 0.967) / radius, rel=1e-12)
