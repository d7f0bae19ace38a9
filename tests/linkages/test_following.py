"""Assemblies followed without a jump, to locks and branches."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, pi, tau

import numpy as np
import pytest

from flywheel import SceneError
from flywheel.mechanisms.linkage import followed as turned
from flywheel.mechanisms.linkages.assembly import assembled
from flywheel.mechanisms.linkages.equations import Equations, loops, settle
from flywheel.mechanisms.linkages.positions import follow, solve, tangent
from flywheel.scene.scene import Mechanism
from tests.limits import sample
from tests.linkages.linkages import (
    CASES,
    four_bar,
    slider_crank,
    whole,
)

# Assemblies are followed without a jump; locks and branches are named with their position.


@pytest.mark.parametrize("case", CASES)
def test_a_turn_forth_comes_to_where_it_began(case: str) -> None:
    solution = whole(case)
    gain = solution.trace.value[-1] - solution.trace.value[0]
    turns = gain / tau
    slides = [k for k, name in enumerate(solution.equations.loops.names) if name.startswith("slide")]
    assert np.abs(turns - np.round(turns))[[k for k in range(turns.size) if k not in slides]].max() < 1e-12
    assert np.abs(gain[slides]).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("case", sample(["four-bar", "whitworth"], 2))
def test_halving_every_step_follows_the_same_assembly(case: str) -> None:
    solution = whole(case)
    middles = 0.5 * (solution.trace.value[1:, 0] + solution.trace.value[:-1, 0])
    z = solution.trace.value[0]
    for node in np.sort(np.concatenate((middles, solution.trace.value[1:, 0]))):
        z = follow(solution.equations, z, float(z[0]), float(node)).value[-1]
    np.testing.assert_allclose(z, solution.trace.value[-1], atol=1e-12)


def test_nothing_else_lies_in_the_certified_ball() -> None:
    equations = Equations(loops(four_bar()))
    z = assembled(equations)
    here = tangent(equations, z)
    rng = np.random.default_rng(1)
    around = z + here.rate * here.step + here.radius * rng.uniform(-1.0, 1.0, (50, z.size))
    around[:, 0] = z[0] + here.step
    ends = settle(equations, around)[0]
    assert np.abs(ends - ends[0]).max() < 1e-12


@pytest.mark.parametrize("gap", [1e-2, 1e-8])
def test_a_four_bar_that_nearly_locks_is_followed(gap: float) -> None:
    linkage = four_bar(0.4, 0.1, 0.25 + gap, 0.25)
    solution = solve(linkage, 0.0, tau)
    poses = solution.poses(np.linspace(0.0, tau, 721))
    b = poses.point("rocker", linkage.link("rocker").point("E")).value
    a = poses.point("crank", linkage.link("crank").point("E")).value
    left = (0.4 - a[0]) * (b[1] - a[1]) - (0.0 - a[1]) * (b[0] - a[0])
    assert (left > 0.0).all()


@pytest.mark.parametrize("gap", [1e-2, 1e-6])
def test_a_four_bar_that_just_locks_names_its_angle(gap: float) -> None:
    d, r, c, length = 0.4, 0.1, 0.25 - gap, 0.25
    cosine = (d**2 + r**2 - (c + length) ** 2) / (2 * d * r)
    with pytest.raises(SceneError) as caught:
        solve(four_bar(d, r, c, length), 0.0, tau)
    text = str(caught.value)
    named = float(text.split("locks with the driver O at ")[1].split(" deg")[0])
    assert named == pytest.approx(degrees(np.arccos(cosine)), abs=1e-6)
    assert "two assemblies meet there" in text


def test_a_slider_crank_too_short_to_turn() -> None:
    with pytest.raises(SceneError, match=r"locks with the driver O at 56\.44269"):
        solve(slider_crank(0.1, 0.1 / 1.2, 0.0), 0.0, tau)


def test_a_rod_as_long_as_the_crank_branches() -> None:
    with pytest.raises(SceneError, match=r"branches .* with the driver O at 90"):
        solve(slider_crank(0.1, 0.1, 0.0), 0.0, tau)


def test_a_part_of_the_turn_that_stays_clear_is_followed() -> None:
    solution = solve(slider_crank(0.1, 0.1 / 1.2, 0.0), -0.9, 0.9)
    assert np.isfinite(solution.poses([-0.9, 0.0, 0.9]).slope).all()


def test_a_slide_that_drives_through_its_dead_centre_locks() -> None:
    base = slider_crank(0.1, 0.3, 0.0)
    crank, rod, slider = base.links
    pushed = replace(base, links=(crank._replace(guess=0.5), rod, slider), driver="guide", start=0.35)
    with pytest.raises(SceneError, match=r"locks with the driver guide at 0\.4.* m"):
        solve(pushed, 0.3, 0.41)
    assert solve(pushed, 0.3, 0.3999).poses([0.3999]).angle("crank").value[0] < pi / 4


@pytest.mark.parametrize("seed", sample(range(12), 4))
def test_slides_drawn_at_random_lock_where_crank_and_rod_are_in_line(seed: int) -> None:
    """The dead centre of a slide that drives: x = sqrt((l + r)² - e²) outwards, where the crank turns no further."""
    rng = np.random.default_rng(100 + seed)
    r = float(rng.uniform(0.05, 0.15))
    length, offset = r * float(rng.uniform(2.0, 4.0)), r * float(rng.uniform(-0.8, 0.8))
    base = slider_crank(r, length, offset)
    crank, rod, slider = base.links
    outer = float(np.sqrt((length + r) ** 2 - offset**2))
    inside = outer - 0.4 * r
    pushed = replace(base, links=(crank._replace(guess=0.9), rod._replace(guess=None), slider), driver="guide")
    pushed = replace(pushed, start=inside)
    with pytest.raises(SceneError, match="locks with the driver guide at") as caught:
        solve(pushed, inside, outer + 0.1 * r)
    places = str(caught.value).split("locks with the driver guide at ")[1].split(" m")[0]
    assert float(places.split(" and ")[-1]) == pytest.approx(outer, rel=1e-8)
    near = solve(pushed, inside, outer - 1e-4 * r).poses([outer - 1e-4 * r])
    in_line = float(near.angle("crank").value[0] - near.angle("rod").value[0])
    assert abs((in_line + pi) % tau - pi) < 0.1


def test_a_linkage_that_locks_names_both_angles_and_the_stroke_between_them() -> None:
    bars = four_bar(0.1, 0.4, 0.15, 0.2)
    cosine = (0.1**2 + 0.4**2 - (0.15 + 0.2) ** 2) / (2 * 0.1 * 0.4)
    low = degrees(np.arccos(cosine))

    def refusal(start: float, stroke: tuple[float, float] | None = None) -> str:
        linkage = replace(bars, start=start)
        with pytest.raises(SceneError) as caught:
            turned(Mechanism("linkage", "bars", linkage=linkage, stroke=stroke))
        return str(caught.value)

    for start, stroke in ((0.0, None), (0.3, None), (tau - 0.3, None), (0.0, (0.0, 1.5)), (0.0, (-1.5, 0.0))):
        text = refusal(start, stroke)
        first, second = text.split("locks with the driver O at ")[1].split(" deg,")[0].split(" and ")
        turn = 360.0 if start > pi else 0.0
        assert (float(first), float(second)) == pytest.approx((turn - low, turn + low), abs=1e-6)
        assert text.endswith("; a [stroke] may lie between the two")
