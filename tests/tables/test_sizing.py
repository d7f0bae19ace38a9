"""The printed table: every kind of scene reads well, in order, in at most 100 columns."""

from __future__ import annotations

import re
from ast import literal_eval
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import flywheel
from flywheel.regime import turning_moment
from flywheel.sizing.results import Sizing
from flywheel.tables import rows as outcome
from flywheel.tables import sizing as report
from tests.limits import sample
from tests.scenes import press, rotor, yoke

MACHINES = Path(__file__).parents[2] / "examples" / "machines"
SCENES = sorted((Path(__file__).parents[1] / "references" / "scenes").glob("*.toml"))


def sized(scene: dict[str, Any] | Path, simulate: bool = False) -> Sizing:
    return _sized(scene if isinstance(scene, Path) else repr(scene), simulate)


@cache
def _sized(scene: Path | str, simulate: bool) -> Sizing:
    return flywheel.size(flywheel.load(literal_eval(scene) if isinstance(scene, str) else scene), simulate=simulate)


def number(text: str, pattern: str) -> float:
    found = re.search(pattern + r"\s*([-+0-9.e]+)", text)
    assert found, f"{pattern} not in\n{text}"
    return float(found[1])


@pytest.mark.parametrize("path", sample(SCENES, 4), ids=lambda path: path.stem)
def test_every_scene_fits_and_hides_no_nan(path: Path) -> None:
    text = report.text(sized(path))
    assert max(map(len, text.splitlines())) <= outcome.WIDTH
    assert "nan" not in text.split()
    assert "None" not in text
    assert "\x1b" not in text


def test_order_and_figures_of_a_sizing() -> None:
    sizing = sized(yoke(title="Yoke", source="p. 103"), simulate=True)
    text = report.text(sizing)
    headings = [
        "Yoke",
        "Source: p. 103",
        "Flywheel on the crank for irregularity 0.04 (±2 %, steadiness 25), crank at 60 rpm",
        "exact (Wittenbauer)",
        "accumulated areas",
        "inertia torque",
        "Proven: exact between",
        "Torque, power, energy",
        "Speed of the crank",
        "Reduced inertia I*",
        "Areas of the turning moment",
        "Confirmed by time simulation",
        "Estimated relative errors",
    ]
    places = [text.index(heading) for heading in headings]
    assert places == sorted(places)
    assert number(text, r"exact \(Wittenbauer\)") == pytest.approx(353.521427322, rel=1e-9)
    assert "-1.282 %" in text
    assert "+0.1998 %" in text
    assert "0.04051842141" in text
    assert number(text, "energy fluctuation") == pytest.approx(551.1019658, rel=1e-9)
    assert "1             kW = 1.341 hp = 1.3596 metric hp" in text
    assert "1e-09 asked, reached" in text


def test_areas_carry_angles_and_marks() -> None:
    text = report.text(sized(yoke()))
    row = next(line.split() for line in text.splitlines() if line.startswith("  A2"))
    assert [row[0], row[4], row[6]] == ["A2", "S2", "least"]
    assert [float(x) for x in row[1:3]] == pytest.approx([18.560745, 161.43926], abs=1e-5)
    assert sum("greatest" in line for line in text.splitlines() if "  S" in line) == 1


def test_dominating_inertia_is_said_in_words() -> None:
    text = report.text(sized(yoke(regime={"speed": 100})))
    assert "The approximate flywheel is 44 times too small" in text
    assert "varying inertia of the machine" in text
    assert "-97.73 %" in text


def test_approximate_of_zero_is_said_in_words() -> None:
    scene = press(regime={"speed": "600 rpm"}, load=[], flywheel={"irregularity": 0.001}, gravity={})
    sizing = sized(scene)
    assert sizing.flywheel.approximate is not None
    text = report.text(sizing)
    assert "ask for no flywheel at all" in text or "times too small" in text


def test_own_inertia_suffices() -> None:
    sizing = sized(rotor(inertia=[{"on": "crank", "value": 900}]))
    text = report.text(sizing)
    assert sizing.flywheel.needed is False
    assert "No flywheel is needed: the machine's own inertia suffices" in text
    assert "Proven" not in text
    confirmed = report.text(sized(rotor(inertia=[{"on": "crank", "value": 900}]), simulate=True))
    assert "(asked at most 0.01)" in confirmed


def test_analysis_gives_irregularity_swing_and_steadiness() -> None:
    sizing = sized(yoke(flywheel={"inertia": 300}))
    text = report.text(sizing)
    assert sizing.simulation is not None
    eps = sizing.simulation.irregularity
    assert "Given flywheel of 300 kg m² on the crank, crank at 60 rpm" in text
    assert number(text, r"  irregularity") == pytest.approx(eps, rel=1e-9)
    assert number(text, r"as ± %\s*±") == pytest.approx(50 * eps, rel=1e-9)
    assert number(text, r"steadiness") == pytest.approx(1 / eps, rel=1e-9)
    assert "by quadrature (no time simulation)" in text


def test_areas_scene_has_no_angles() -> None:
    scene = {
        "areas": {"values": [52, -124, 72], "scale": 10},
        "regime": {"speed": 60},
        "flywheel": {"irregularity": 0.02},
    }
    text = report.text(sized(scene))
    assert "deg" not in text
    assert "tells nothing of the machine's own inertia" in text
    assert number(text, "accumulated areas") == pytest.approx(1240 / (0.02 * 3600), rel=1e-9)


def test_flywheel_on_another_shaft_is_named_with_its_speed() -> None:
    scene = yoke(shafts={"motor": {"ratio": 10}}, flywheel={"on": "motor", "irregularity": 0.04})
    text = report.text(sized(scene))
    assert "on shaft motor (10 turns to one of the crank)" in text
    assert number(text, "mean, shaft motor") == pytest.approx(600)


def test_balance_on_a_parameter_and_a_braking_drive() -> None:
    scene = yoke(
        parameters={"push": "balance"},
        load=[{"on": "yoke", "force": "-push", "from": 0, "to": "180 deg"}],
        drive={"torque": "-100 N m"},
    )
    text = report.text(sized(scene))
    assert "push (balance)" in text
    assert "(it brakes)" in text
    assert number(text, r"push \(balance\)") == pytest.approx(200 * 3.141592653589793, rel=1e-9)


def test_machine_that_would_stop_is_said_so(monkeypatch: pytest.MonkeyPatch) -> None:
    sizing = sized(yoke())

    def stops(*_: object) -> None:
        raise turning_moment.NoMotionError

    monkeypatch.setattr(turning_moment, "run", stops)
    rows = [line for line in report.text(sizing).splitlines() if "no steady motion" in line]
    assert [row.split()[0] for row in rows] == ["accumulated", "inertia"]


def test_messages_and_missed_accuracy_are_shown() -> None:
    from dataclasses import replace

    sizing = replace(sized(yoke()), messages=("a sentence " * 20,), rtol=1e-16)
    text = report.text(sizing)
    assert "Note: a sentence" in text
    assert "NOT reached" in text
    assert max(map(len, text.splitlines())) <= outcome.WIDTH


def test_idle_ports_are_named() -> None:
    scene = press(mechanism={"type": "slider-crank", "name": "press", "crank": {"length": 0.1}, "rod": {"length": 0.5}})
    text = report.text(sized(scene | {"load": [{"on": "crank", "torque": "-5", "from": 0, "to": 1}]}))
    assert "left out, as nothing hangs on it" in text
    assert "press.slider" in text


def test_titles_cannot_steer_a_terminal() -> None:
    text = report.text(sized(yoke(title="a\x1b[31mb")))
    assert "\x1b" not in text


@pytest.mark.parametrize("path", sample(SCENES, 4), ids=lambda path: path.stem)
def test_inertia_torque_brackets_the_exact_flywheel(path: Path) -> None:
    sizing = sized(path)
    wheel, inertia = sizing.flywheel, sizing.reduced_inertia
    if not wheel.needed or inertia is None:
        return
    assert wheel.exact is not None
    assert wheel.inertia_torque is not None
    square = sizing.scene.flywheel_ratio**2
    slack = 1e-9 * wheel.inertia_torque
    assert wheel.inertia_torque - inertia.greatest / square - slack <= wheel.exact
    assert wheel.exact <= wheel.inertia_torque - inertia.least / square + slack


def test_headline_is_short_and_printable() -> None:
    lines = report.headline(sized(yoke(title="x" * 300 + "\x1b"))).splitlines()
    assert len(lines[0]) == outcome.WIDTH
    assert lines[1] == "flywheel 353.521 kg m² on crank for irregularity 0.04, crank at 60 rpm"


def test_nothing_acts() -> None:
    text = report.text(sized({"regime": {"speed": 10}, "flywheel": {"irregularity": 0.01}}))
    assert "nothing acts on the machine" in text
    assert "no steady motion" not in text
    assert "no drive in the scene" in text
