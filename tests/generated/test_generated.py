"""Scenes drawn over the whole schema: what the toolkit says of them is what an oracle finds that shares nothing with it."""

from __future__ import annotations

import pytest

import flywheel
from tests.extras import extra
from tests.generated import identities
from tests.generated.judging import DEFECTS, PROOF, judged
from tests.generated.rounded import rounded
from tests.generated.scenes import drawn
from tests.generated.special import special
from tests.generated.strokes import drawn_strokes, tried_strokes
from tests.limits import sample
from tests.oracle.strokes import TURN, stroke

BY_LOSSES, AT_A_JUMP = 1000348, 1000457  # meshes alone fix the speed; it starts where a load drives it back on both sides
IDLE = 1000462  # in its regime a wheel behind a mesh takes nothing but the rounding of the speed
WAYS = (("size",), ("rest", "both"), ("size", "regime"), ("down", "both"))
LATE = "late"
QUICK = (0, 1, 4, 9, 11, 19, 27, 28, 30, 35, 41, 49, 51, 54, BY_LOSSES, AT_A_JUMP)
LONG = (3, 6, 7, 21, 29, 33, 55)  # some in 20 s: left to `python -m tests.generated`, which draws thousands
FIXED = [*QUICK, *(pytest.param(k, marks=pytest.mark.slow) for k in (*range(66), IDLE) if k not in {*QUICK, *LONG})]
SPECIAL = sample((1, 7, 19, 25, 13, 31, 20, 0, 39, 15, 4, 36, 41, 53, 23, 29), 4)  # of each kind the cheaper ones
# rotors and slider-cranks, losses on either side of the clutch, friction, weights; motors on inverters, servo drives
STROKES = sample((9000004, 11, 2, 7, 19), 5)
ROUNDED = sample((960000003, 960000005, 960000010, 960000012, 960000016, 960000021), 3)
PROVEN = sample((70012, 71000042, 70059, 71000002, 70095), 3)
ROW = 264  # friction, weight, meshes that lose on both sides, ramps of clutch and brake, an induction motor
NEXT_TO_NOTHING = 10**6 + 60  # is what a mesh passes beside rubbing joints when it changes its side


def defects(seed: int, routes: tuple[str, ...]) -> list[str]:
    """Defects of a scene on some routes, which `python -m tests.generated --only SEED` shows."""
    result = judged(drawn(seed), routes)
    return [f"--only {seed} {v.route}: {v.outcome} {v.detail}" for v in result if v.outcome in DEFECTS and v.outcome != LATE]


def seldom(seed: int) -> list[str]:
    """Defects of a special scene, which `--special --only SEED` shows."""
    result = identities.tried(special(seed))
    return [
        f"--special --only {seed} {v.route}: {v.outcome} {v.detail}"
        for v in result
        if v.outcome in DEFECTS and v.outcome != LATE
    ]


@pytest.mark.parametrize("seed", FIXED)
def test_fixed_scenes(seed: int) -> None:
    """Half of them in steady running, half of them in time."""
    assert defects(seed, WAYS[seed % 4]) == []


@pytest.mark.parametrize("seed", SPECIAL)
def test_special_scenes(seed: int) -> None:
    """Duties, strokes, loads over a stroke, starts by steps, friction in joints, limits of heat and current."""
    assert seldom(seed) == []


@pytest.mark.parametrize("seed", ROUNDED)
def test_rounded_scenes(seed: int) -> None:
    """Angles, ratios and laws that coincide."""
    verdicts = judged(rounded(seed))
    assert verdicts
    wrong = [v for v in verdicts if v.outcome in DEFECTS and v.outcome != LATE]
    assert [f"--rounded --only {seed} {v.route}: {v.outcome} {v.detail}" for v in wrong] == []


@pytest.mark.parametrize("seed", PROVEN)
def test_proven_intervals_hold_the_figures(seed: int) -> None:
    """Limits of velocities, places and laws that decide branches, motors of all kinds."""
    extra("flint")
    assert [(v.outcome, v.detail) for v in judged(drawn(seed), (PROOF,)) if v.route == PROOF] == [("right", "")]


@pytest.mark.parametrize("seed", STROKES)
def test_strokes(seed: int) -> None:
    """By clutch and brake; the stroke that returns, its heats, torques and speeds."""
    (result,) = tried_strokes(seed)
    assert (result.outcome, result.detail) == ("right", "")


@pytest.mark.slow
def test_the_stroke_that_returns_is_the_last_of_a_hundred() -> None:
    """Each by the equations of its two sides, the first from the idling wheel; those after one that repeats are like it."""
    scene, drawn_plan = drawn_strokes(ROW)
    plan = drawn_plan._replace(motor=lambda omega: 3.0 * drawn_plan.motor(omega))
    scene["drive"]["motor"]["power"] *= 3.0
    result = flywheel.single_stroke(flywheel.load(scene), rates=False)
    speed, rest = result.strokes.typical * plan.ratio, 0.0
    for _ in range(100):
        before, last = speed, stroke(plan, speed, rest)
        speed, rest = last.pop("speed"), last.pop("rest") - TURN
        if abs(speed - before) < 1e-11 * speed:
            break
    assert abs(speed / (result.strokes.typical * plan.ratio) - 1.0) > 0.005  # the idling wheel is not it
    assert result.phases.begin == pytest.approx((speed, rest), rel=1e-8)
    last["motor_heat"] *= result.scene.motor.rated_total_heat
    for name, right in last.items():
        if (value := result.figures[name]) is not None:  # no inverter
            assert abs(value - right) <= result.error[name] + 1e-8 * abs(right), name


@pytest.mark.slow
def test_a_mesh_that_passes_next_to_nothing_beside_rubbing_joints() -> None:
    assert seldom(NEXT_TO_NOTHING) == []
