"""Proven intervals over ranges of numbers: designs and closed forms all over them lie inside, and they are little wider."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from itertools import product
from typing import Any

import pytest
from mpmath import mp  # type: ignore[import-untyped]

import flywheel
from flywheel.language import use
from flywheel.reading.paths import dotted
from flywheel.tables import summary
from tests.estimates.ranges import ranged
from tests.extras import extra
from tests.limits import sample
from tests.motions.test_starting import PLATE
from tests.sizing.test_proof import PRESS, at, proven
from tests.sizing.test_proven_motions import KINK, QUADRATIC, over_a_kink, quadratic

balls, proof, wide = (extra(f"flywheel.{name}") for name in ("numerics.balls", "sizing.proof", "sizing.ranges"))
LOAD = "-20*sin(phi) - 0.5*max(omega**2, 100)"


def corners(scene: dict[str, Any], ranges: dict[str, tuple[float, float]]) -> Iterator[dict[str, Any]]:
    """Results of the designs at the ends of all ranges, by paths with middle and half of the width in SI."""
    base = flywheel.load(scene)
    for sides in product((-1, 1), repeat=len(ranges)):
        numbers = {path: middle + side * half for side, (path, (middle, half)) in zip(sides, ranges.items(), strict=True)}
        yield flywheel.size(base.with_(numbers), accuracy="normal").as_dict()


def value_of(design: dict[str, Any], key: str) -> Any:
    return design["balance"]["value"] if key == "balance.value" else at(design, key)


@pytest.mark.parametrize("wheel", [{"irregularity": "4 %"}, {"inertia": "2300 kg m^2 ± 0.2 %"}])
def test_intervals_over_ranges_hold_all_corners_and_are_little_wider(wheel: dict[str, Any]) -> None:
    scene = copy.deepcopy(PRESS) | {"flywheel": wheel}
    scene["mechanism"]["crank"]["length"] = "80 mm ± 0.16 mm"
    scene["load"][0]["force"] = "(-40 +/- 0.08) kN"
    ranges = {"mechanism.crank.length": (0.08, 0.00016), "load.0.force": (-40e3, 80.0)}
    ranges |= {"flywheel.inertia": (2300.0, 4.6)} if "inertia" in wheel else {}
    result = proven(scene)
    designs = list(corners(scene, ranges))
    assert result.ranges
    assert "for all numbers in the scene's ranges" in result.statement
    for key, (low, high) in result.figures.items():
        values = [value_of(design, key) for design in designs]
        assert low - 1e-9 * abs(low) <= min(values), key
        assert max(values) <= high + 1e-9 * abs(high), key
        assert high - low <= 1.2 * (max(values) - min(values)) + 1e-9 * abs(high), key


def test_ranges_move_the_angles_at_which_loads_jump() -> None:
    """Where sin(phi) passes a, and where the slider turns back: at both, work moves in the first order."""

    def figures_of(a: Any, offset: str) -> Any:
        load = [{"on": "crank", "torque": "-900*(sin(phi) > a)"}, {"on": "slider", "force": "-3000*sign(v)"}]
        mechanism = {**PRESS["mechanism"], "slider": {"mass": "60 kg", "offset": offset}}
        return proven({**PRESS, "parameters": {"a": a}, "mechanism": mechanism, "load": load}).figures

    wide = figures_of("0.4 ± 0.01", "31.7 mm ± 2 mm")
    corner = [figures_of(a, offset) for a, offset in product((0.39, 0.41), ("29.7 mm", "33.7 mm"))]
    for key in ("balance.value", "flywheel.exact"):
        (low, high), ends = wide[key], [each[key] for each in corner]
        assert low <= min(end[0] for end in ends)
        assert max(end[1] for end in ends) <= high
        assert high - low < 1.2 * (max(end[1] for end in ends) - min(end[0] for end in ends)), key


def test_ranges_of_a_rotor_by_its_closed_form() -> None:
    """A torque T over an angle L: fluctuation T L (1 - L/2 pi), which is greatest in the middle of the range of L."""
    scene = {
        "inertia": [{"on": "crank", "value": "2 kg m^2 ± 1 %"}],
        "load": [{"on": "crank", "torque": "10 N m ± 1 %", "from": 0, "to": "180 ± 1 deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": "10 rad/s ± 1 %"},
        "flywheel": {"irregularity": 0.1},
    }
    result = proven(scene).figures
    size = math.pi * (1 - 1 / 180**2) / 2
    ends = {
        "energy_fluctuation": (9.9 * size, 10.1 * math.pi / 2),
        "flywheel.approximate_total": (9.9 * size / (0.1 * 10.1**2), 10.1 * math.pi / 2 / (0.1 * 9.9**2)),
        "balance.value": (-10.1 * 181 / 360, -9.9 * 179 / 360),
        "reduced_inertia.max": (1.98, 2.02),
    }
    for key, (least, most) in ends.items():
        low, high = result[key]
        assert low <= least * (1 + math.copysign(1e-12, least)), key
        assert most <= high * (1 + math.copysign(1e-12, high)), key
        assert high - low < 1.2 * (most - least), key


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            {
                "shafts": {"motor": {"ratio": 24}},
                "drive": {"on": "motor", "motor": {**PLATE, "inertia": "1 kg m^2"}},
                "regime": {},
                "flywheel": {"limits": {"irregularity": "4 %"}},
            },
            "ranges of numbers under limits",
        ),
        (
            {"load": [{**PRESS["load"][0], "from": "20 ± 5 deg"}, {**PRESS["load"][0], "to": "24 deg", "from": 0}]},
            "decision",
        ),
    ],
)
def test_ranges_that_cannot_be_proven_are_refused_with_their_reason(change: dict[str, Any], reason: str) -> None:
    scene = copy.deepcopy(PRESS) | change
    scene["mechanism"]["slider"]["mass"] = "60 kg ± 1 %"
    result = proven(scene)
    assert (result.figures, result.ranges) == ({}, True)
    assert reason in result.reason


@pytest.mark.parametrize(
    ("written", "fault"),
    [
        ("80 mm ± 0 mm", "half the width of a range, above 0"),
        ("80 mm ± 0.1 kg", "expected a length"),
        ("80 mm ± x", "expected a length"),
        ("80 mm ± 0.1 mm ± 0.1 mm", "expected a length"),
        ("-80 mm ± 0.1 mm", "above 0"),
    ],
)
def test_a_faulty_range_is_a_fault(written: str, fault: str) -> None:
    scene = copy.deepcopy(PRESS)
    scene["mechanism"]["crank"]["length"] = written
    with pytest.raises(flywheel.SceneError, match=rf"mechanism\.crank\.length.*{fault}"):
        flywheel.load(scene)


def test_both_parts_of_a_range_have_one_dimension() -> None:
    scene = copy.deepcopy(PRESS) | {"parameters": {"F": "40 kN ± 1 mm"}}
    with pytest.raises(flywheel.SceneError, match=r"parameters\.F.*in a unit of its middle"):
        flywheel.load(scene)


@pytest.mark.parametrize("language", ["en", "es"])
def test_a_range_has_a_remark_and_its_interval_in_the_summary(language: str) -> None:
    scene = copy.deepcopy(PRESS)
    scene["mechanism"]["crank"]["length"] = "80 ± 0.16 mm"
    result = flywheel.size(flywheel.load(scene), accuracy="proof")
    assert any("80 mm" in remark.defect for remark in result.scene.remarks)
    with use(language):
        sentences = " ".join(summary.text(result).split())
    assert {"en": "exact flywheel from", "es": "volante exacto de"}[language] in sentences


@pytest.mark.parametrize(("seed", "most"), [(5_000_020, 1.03), pytest.param(5_000_041, 1.3, marks=pytest.mark.slow)])
def test_intervals_are_little_wider_where_effects_of_numbers_cancel(seed: int, most: float) -> None:
    """A weight and a balance; a slider-crank whose I* is least at both dead centres, where no length matters."""
    outcome = ranged(seed, designs=4)
    assert outcome is not None
    assert outcome.outside == ()
    assert max(outcome.widths) < most


@pytest.mark.parametrize("seed", sample(range(3_000_000, 3_000_012), 4))
def test_random_designs_lie_in_the_intervals_over_their_ranges(seed: int) -> None:
    outcome = ranged(seed, designs=2)
    assert outcome is None or outcome.outside == ()


# -- motions -----------------------------------------------------------------------------------------------------------


def over_ranges(scene: dict[str, Any]) -> Any:
    result = flywheel.size(flywheel.load(scene), accuracy="proof").proof
    assert result is not None
    assert (result.reason, result.ranges) == ("", True)
    return result.figures


def assert_little_wider(ends: tuple[float, float], values: list[Any], most: float = 1.2) -> None:
    """The interval contains values, which lie all over a figure's range, and is little wider."""
    low, high = ends
    assert low <= min(values)
    assert max(values) <= high
    assert high - low <= most * float(max(values) - min(values))


SIDES = (-1, 0, 1)


def test_speeds_over_ranges_are_those_of_the_closed_form() -> None:
    scene = {**QUADRATIC, "inertia": [{"on": "crank", "value": "2 kg m^2 ± 0.2 %"}], "drive": {"torque": "50 N m ± 0.2 %"}}
    result = over_ranges({**scene, "flywheel": {"inertia": "3 kg m^2 ± 0.2 %"}})
    with mp.workdps(30):
        speeds = [
            quadratic(5 + mp.mpf(2 * one + 3 * other) / 500, 50 + mp.mpf(side) / 10)
            for one, other, side in product(SIDES, SIDES, SIDES)
        ]
        assert_little_wider(result["simulation.speed_max"], [fast for fast, _ in speeds])
        assert_little_wider(result["simulation.speed_min"], [slow for _, slow in speeds])
        assert_little_wider(result["speed"], [(fast + slow) / 2 for fast, slow in speeds])
        assert_little_wider(result["simulation.irregularity"], [2 * (fast - slow) / (fast + slow) for fast, slow in speeds])


def test_a_flywheel_over_ranges_is_that_of_the_closed_form() -> None:
    result = over_ranges({**QUADRATIC, "drive": {"torque": "50 N m ± 0.2 %"}, "flywheel": {"irregularity": "8 % ± 0.01 %"}})

    def wheel(drive: Any, eps: Any) -> Any:
        def off(total: Any) -> Any:
            fast, slow = quadratic(total, drive)
            return 2 * (fast - slow) / (fast + slow) - eps

        return mp.findroot(off, 5) - 2

    with mp.workdps(30):
        wheels = [wheel(50 + mp.mpf(one) / 10, mp.mpf(800 + other) / 10000) for one, other in product(SIDES, SIDES)]
        assert_little_wider(result["flywheel.exact"], wheels)


def test_a_speed_at_which_a_torque_switches_may_move_along_the_cycle() -> None:
    result = over_ranges({**KINK, "load": [{"on": "crank", "torque": LOAD}], "drive": {"torque": "51 N m ± 0.05 %"}})
    with mp.workdps(30):
        speeds = [over_a_kink(51 + 51 * mp.mpf(side) * 5 / 10000) for side in SIDES]
    assert_little_wider(result["simulation.speed_max"], [fast for fast, _ in speeds])
    assert_little_wider(result["simulation.speed_min"], [slow for _, slow in speeds])


def test_an_even_motion_over_ranges_is_that_of_its_closed_form() -> None:
    """Speeds at which 100 - 4 omega and a load of 60 N m balance."""
    rotor = {"inertia": [{"on": "crank", "value": "3 kg m^2 ± 1 %"}], "load": [{"on": "crank", "torque": "-60 N m ± 1 %"}]}
    result = over_ranges({**rotor, "drive": {"torque": "100 - 4*omega"}, "flywheel": {"inertia": 1}})
    assert_little_wider(result["speed"], [(100 - 60.6) / 4 + 1e-12, (100 - 59.4) / 4 - 1e-12])


GEARED = {
    **PRESS,
    "shafts": {"motor": {"ratio": 5, "efficiency": "94 % ± 0.2 %"}},
    "inertia": [{"on": "motor", "value": "2 kg m^2"}],
    "drive": {"on": "motor", "torque": "balance"},
    "flywheel": {"on": "motor", "irregularity": "8 %"},
}


@pytest.mark.parametrize(
    "change",
    [
        {"load": [PRESS["load"][0], {"on": "crank", "torque": "-30*omega"}]},
        {
            "drive": {"motor": {"type": "line", "no_load_speed": "66 rpm", "starting_torque": "14 kN m"}},
            "regime": {},
        },
        GEARED,
    ],
    ids=["damper", "motor", "mesh"],
)
@pytest.mark.parametrize("wheel", [{}, {"inertia": "2300 kg m^2 ± 0.2 %"}], ids=["sized", "given"])
def test_motions_over_ranges_hold_all_corners(change: dict[str, Any], wheel: dict[str, Any]) -> None:
    scene = copy.deepcopy({**PRESS, **change})
    scene["mechanism"]["crank"]["length"] = "80 mm ± 0.16 mm"
    scene["load"][0]["force"] = "(-40 +/- 0.08) kN"
    ranges = {"mechanism.crank.length": (0.08, 0.00016), "load.0.force": (-40e3, 80.0)}
    if wheel:
        scene["flywheel"] = {key: value for key, value in scene["flywheel"].items() if key == "on"} | wheel
        ranges["flywheel.inertia"] = (2300.0, 4.6)
    if "shafts" in scene:
        ranges["shafts.motor.efficiency"] = (0.94, 0.002)
    result, designs = over_ranges(scene), list(corners(scene, ranges))
    for key, (low, high) in result.items():
        values = [value_of(design, key) for design in designs]
        assert low - 1e-9 * abs(low) <= min(values), key
        assert max(values) <= high + 1e-9 * abs(high), key
        assert high - low <= 1.3 * (max(values) - min(values)) + 1e-9 * abs(high), key


def slopes_of(scene: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Every figure over the ranges, taken as they are, with balls of its slopes by numbers."""
    over = dict[str, Any]()

    class Noted(wide.RangeEnds):  # type: ignore[name-defined, misc]
        def __init__(self, figures: Any, numbers: Any, *limits: float) -> None:
            over.update(figures(((0.0, 1.0),) * len(numbers)))
            raise balls.UnprovenError("noted")

    monkeypatch.setattr(proof, "RangeEnds", Noted)
    assert "noted" in flywheel.size(flywheel.load(scene), accuracy="proof").proof.reason  # type: ignore[union-attr]
    return over


MOVED = {
    **PRESS,
    "load": [{**PRESS["load"][0], "from": "20 ± 2 deg"}, {"on": "crank", "torque": "-60*omega"}],
    "regime": {"speed": "60 rpm ± 0.5 %"},
}


@pytest.mark.parametrize(
    ("scene", "numbers"),
    [
        (MOVED, {"load.0.from": (math.radians(20), math.radians(2)), "regime.speed": (2 * math.pi, 0.01 * math.pi)}),
        (
            {**MOVED, "flywheel": {"inertia": "900 kg m^2 ± 1 %"}},
            {"load.0.from": (math.radians(20), math.radians(2)), "flywheel.inertia": (900.0, 9.0)},
        ),
        (
            {**QUADRATIC, "drive": {"torque": "50 N m ± 2 %"}, "flywheel": {"inertia": "3 kg m^2 ± 2 %"}},
            {"drive.torque": (50.0, 1.0), "flywheel.inertia": (3.0, 0.06)},
        ),
        (
            {**GEARED, "flywheel": {"on": "motor", "irregularity": "8 % ± 0.1 %"}},
            {"shafts.motor.efficiency": (0.94, 0.002), "flywheel.irregularity": (0.08, 0.001)},
        ),
        (
            {
                **GEARED,
                "shafts": {"motor": {"ratio": 5, "efficiency": 0.5}},
                "inertia": [*GEARED["inertia"], {"on": "crank", "value": "300 kg m^2 ± 10 %"}],
                "load": [*GEARED["load"], {"on": "crank", "torque": "-20*omega"}],
            },
            {"inertia.1.value": (300.0, 30.0)},
        ),
        (
            {
                "mechanism": {**PRESS["mechanism"], "slider": {"mass": "60 kg ± 0.1 %"}},
                "load": [{"on": "slider", "force": "-40*v*abs(v)"}],
                "drive": {"torque": "90 - 2*omega"},
                "flywheel": {"inertia": "1 kg m^2 ± 0.1 %"},
            },
            {"mechanism.slider.mass": (60.0, 0.06), "flywheel.inertia": (1.0, 0.001)},
        ),
        (
            {**KINK, "drive": {"torque": "51 N m ± 0.5 %"}, "load": [{"on": "crank", "torque": LOAD}]},
            {"drive.torque": (51.0, 0.255)},
        ),
    ],
    ids=["sized", "given", "quadratic", "mesh", "reversal", "masses", "switch"],
)
def test_slopes_over_ranges_hold_those_of_designs_at_their_ends(
    scene: dict[str, Any], numbers: dict[str, tuple[float, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """f(m ± h) - f(m) is a slope in the ball times ± h, for one number at a time."""
    over, base = slopes_of(scene, monkeypatch), flywheel.load(scene)
    written = [dotted(path) for path in base.document.quantities] if base.document else []

    def figures(change: dict[str, float]) -> dict[str, Any]:
        return flywheel.size(base.with_(change), rtol=1e-12, accuracy="normal").as_dict()

    middle = figures({})
    for path, (centre, half) in numbers.items():
        k = next(own for own in range(len(written)) if written[own] == path)
        for side in (-half, half):
            beyond = figures({path: centre + side})
            for name, figure in over.items():
                one, other = (
                    each["balance"]["value"] if name == "balance.value" else at(each, name) for each in (beyond, middle)
                )
                slope, rounding = (one - other) / side, 1e-10 * abs(other) / half
                low, high = balls.ends(balls.ball(figure.slopes[k]))
                assert low - rounding <= slope <= high + rounding, (name, path)
