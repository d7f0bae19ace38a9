"""Scenes drawn over the whole schema: what the toolkit says of them is what an oracle finds that shares nothing with it."""

from __future__ import annotations

import pytest

from tests.generated import identities
from tests.generated.judging import DEFECTS, ROUTES, judged
from tests.generated.scenes import drawn
from tests.generated.special import special
from tests.generated.strokes import tried_strokes

LONG = (3, 7, 21, 29, 33, 55)  # sized in some seconds each: left to the slow leg
BY_LOSSES, AT_A_JUMP = 1000348, 1000457  # meshes alone fix the speed; it starts where a load drives it back on both sides
IDLE = 1000462  # in its regime a wheel behind a mesh takes nothing but the rounding of the speed
FIXED = [*(seed for seed in range(66) if seed not in LONG), BY_LOSSES, AT_A_JUMP, IDLE]
WAYS = (("size",), ("rest", "both"), ("size", "regime"), ("down", "both"))
LATE = "late"
SLOW, TOGETHER = 1000, 20
SPECIAL = (1, 7, 13, 19, 25, 31, 20, 23, 29, 41, 53, 15, 39, 36, 0, 4)  # the cheaper ones of each kind
SELDOM = 60
STROKES = (2, 7, 11, 19)  # rotors and slider-cranks, losses on either side of the clutch, friction, weights
NEXT_TO_NOTHING = 10**6 + 60  # is what a mesh passes beside rubbing joints when it changes its side


def defects(seed: int, routes: tuple[str, ...]) -> list[str]:
    """Defects of a scene on some routes, which `python -m tests.generated --only SEED` shows."""
    found = judged(drawn(seed), routes)
    return [f"--only {seed} {v.route}: {v.outcome} {v.detail}" for v in found if v.outcome in DEFECTS and v.outcome != LATE]


def seldom(seed: int) -> list[str]:
    """Defects of a special scene, which `--special --only SEED` shows."""
    found = identities.tried(special(seed))
    return [
        f"--special --only {seed} {v.route}: {v.outcome} {v.detail}"
        for v in found
        if v.outcome in DEFECTS and v.outcome != LATE
    ]


@pytest.mark.parametrize("seed", FIXED)
def test_fixed_scenes(seed: int) -> None:
    """Half of them in steady running, half of them in time."""
    assert defects(seed, WAYS[seed % 4]) == []


@pytest.mark.slow
@pytest.mark.parametrize("first", range(10**6, 10**6 + SLOW, TOGETHER))
def test_many_scenes(first: int) -> None:
    assert [line for seed in range(first, first + TOGETHER) for line in defects(seed, ROUTES)] == []


@pytest.mark.parametrize("seed", SPECIAL)
def test_special_scenes(seed: int) -> None:
    """Duties, strokes, loads over a stroke, starts by steps, friction in joints, limits of heat and current."""
    assert seldom(seed) == []


@pytest.mark.slow
@pytest.mark.parametrize("first", range(10**6, 10**6 + SELDOM, 10))
def test_many_special_scenes(first: int) -> None:
    assert [line for seed in range(first, first + 10) for line in seldom(seed)] == []


@pytest.mark.parametrize("seed", STROKES)
def test_strokes(seed: int) -> None:
    """By clutch and brake; the stroke that returns, its heats, torques and speeds."""
    (found,) = tried_strokes(seed)
    assert (found.outcome, found.detail) == ("right", "")


@pytest.mark.slow
@pytest.mark.parametrize("first", range(100, 220, 20))
def test_many_strokes(first: int) -> None:
    found = {seed: tried_strokes(seed)[0] for seed in range(first, first + 20)}
    assert {seed: v.detail for seed, v in found.items() if v.outcome in DEFECTS} == {}


@pytest.mark.slow
def test_a_mesh_that_passes_next_to_nothing_beside_rubbing_joints() -> None:
    assert seldom(NEXT_TO_NOTHING) == []
