"""What the report says of machines whose torques depend on speed."""

from __future__ import annotations

import re
from functools import cache
from math import log
from typing import Any

import pytest

import flywheel
from flywheel.sizing.results import Cyclic, Sizing
from flywheel.tables import rows
from flywheel.tables import sizing as report
from flywheel.tables.flywheels import candidates
from tests.regimes import GEARED, KLOSS, PUMP, SECTION_C, figures
from tests.scenes import rotor, yoke

PRESS = {key: value for key, value in KLOSS.items() if key not in ("parameters", "drive", "inertia")} | {
    "drive": {
        "on": "motor",
        "motor": {
            "type": "induction", "power": "3 kW", "speed": "1440 rpm", "poles": 4, "frequency": "50 Hz",
            "breakdown_ratio": 2.5, "inertia": "0.02 kg m^2",
        },
    },
    "regime": {"speed": "121 rpm"},
    "flywheel": {"on": "motor", "irregularity": 0.04},
}  # fmt: skip


@cache
def _sized(scene: str) -> Sizing:
    return flywheel.size(flywheel.load(SCENES[scene]), simulate=False)


def sized(scene: dict[str, Any]) -> Sizing:
    return flywheel.size(flywheel.load(scene), simulate=False)


SCENES: dict[str, dict[str, Any]] = {
    "section C": SECTION_C | {"flywheel": {"inertia": 5}},
    "section C sized": SECTION_C | {"flywheel": {"irregularity": 0.05}},
    "press": PRESS,
    "pump": PUMP | {"flywheel": {"irregularity": 0.05}},
    "geared": GEARED | {"flywheel": {"irregularity": 0.05}},
}


def number(text: str, pattern: str) -> float:
    found = re.search(pattern + r"\s+(-?[0-9.e+-]+)", text)
    assert found, f"{pattern} not in\n{text}"
    return float(found[1])


@pytest.mark.parametrize("name", SCENES)
def test_reports_fit_and_hide_no_nan(name: str) -> None:
    text = report.text(_sized(name))
    assert max(map(len, text.splitlines())) <= rows.WIDTH
    assert not {"nan", "None", "inf"} & set(text.split())
    assert "Proven" not in text


def test_the_multiplier_is_told_with_what_it_means() -> None:
    expected = float(figures("section-c")["analysis"]["5"]["multiplier"])
    period = float(figures("section-c")["analysis"]["5"]["period"])
    text = report.text(_sized("section C"))
    cycles = log(0.01) / log(expected)
    assert number(text, "cycle multiplier") == pytest.approx(expected, rel=1e-5)
    assert number(text, "settles to 1 % in") == pytest.approx(cycles, rel=2e-3)
    assert number(text, "settles to 1 % in .* cycles,") == pytest.approx(cycles * period, rel=1e-2)
    assert "1 - multiplier" not in text


@pytest.mark.parametrize(
    ("multiplier", "damping", "expected"),
    [
        (0.5, 0.5, log(0.01) / log(0.5)),
        (0.01, 0.99, 1.0),
        (1.0, 1e-15, log(100) * 1e15),
        (0.0, 1.0, 0.0),
        (0.9, 0.4, log(0.01) / log(0.9)),  # of a pair that turns: |m| = 0.9, its real part 0.6
    ],
)
def test_cycles_to_settle(multiplier: float, damping: float, expected: float) -> None:
    assert report.settling_cycles(Cyclic(multiplier, damping, 1, 0.0, 1.0)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_what_never_settles_is_said_to() -> None:
    lossy = yoke(
        shafts={"m": {"ratio": 5, "efficiency": 0.9}},
        inertia=[{"on": "m", "value": 1}],
        drive={"on": "m", "torque": "balance"},
    )
    text = report.text(sized(lossy))
    assert "no torque brings a change of speed back" in text
    assert "1 - multiplier" not in text
    driven = [{"on": "crank", "torque": "3*omega - 90 + 50*sin(phi)"}]
    grows = report.text(sized(rotor(load=driven, drive={"torque": "balance"})))
    assert "a change grows from cycle to cycle" in grows


def test_speed_asked_stands_beside_the_speed_taken() -> None:
    text = report.text(_sized("press"))
    assert number(text, "asked for") == pytest.approx(121)
    assert number(text, "mean of extremes") == pytest.approx(_sized("press").speed * 30 / 3.141592653589793)
    assert abs(number(text, "mean of extremes") - 121) > 0.01
    assert "off the speed asked for" in text
    assert "asked for  " not in report.text(_sized("pump"))  # a balance keeps the speed
    assert "asked for  " not in report.text(_sized("section C"))


def test_areas_are_those_of_a_constant_speed() -> None:
    sizing, text = _sized("section C"), report.text(_sized("section C"))
    expected = 10 / 2.387  # weights do no net work
    assert sizing.cyclic is not None
    assert sizing.cyclic.constant_speed == pytest.approx(expected, rel=1e-12)
    assert number(text, "take the torques at a constant") == pytest.approx(expected, rel=1e-6)
    assert "Areas of the turning moment at constant speed" in text
    plain = report.text(sized(yoke()))
    assert "constant speed, and" not in plain
    assert "How the motion holds itself" not in plain


def test_a_candidate_s_irregularity_is_that_of_its_own_motion() -> None:
    sizing = _sized("section C sized")
    for candidate in candidates(sizing)[1:]:
        given = sized(SECTION_C | {"flywheel": {"inertia": candidate.inertia}}).simulation
        assert candidate.gives is not None
        assert given is not None
        assert candidate.gives[0] == pytest.approx(given.irregularity, rel=1e-9)
        assert candidate.motion is not None
        assert candidate.motion.speed != sizing.speed


def test_far_off_figures_are_explained_without_naming_the_wrong_cause() -> None:
    text = report.text(sized(SECTION_C | {"flywheel": {"irregularity": 0.48}}))
    assert "takes torques at a constant speed" in text
    assert "at this speed the varying inertia" not in text
