"""Costs foretold against costs counted."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import flywheel
from flywheel.scene.accuracy import LEVELS
from flywheel.study import explanation
from flywheel.study.explanation import predicted
from tests import regimes
from tests.references.test_references import FOLDER

EXAMPLES = Path(flywheel.__file__).parents[1] / "examples"
REFERENCE = sorted(path.stem for path in (FOLDER / "scenes").glob("*.toml") if not path.stem.startswith("areas"))
QUICK = [(name, 1e-6) for name in REFERENCE[1::7]] + [("press", None), ("rotor-every", None), ("no-load", 1e-4)]
MOVING = ["pump", "governor", "section-c", "kloss-press"]


def factors(scene: flywheel.Scene, rtol: float | None = None) -> dict[tuple[str, str], float]:
    """Evaluations foretold over those counted, for every pair of levels."""
    found = {level: flywheel.size(scene, rtol, accuracy=level) for level in LEVELS}
    counted = {level: sizing.cost.evaluations for level, sizing in found.items()}
    foretold = {level: predicted(sizing) for level, sizing in found.items()}
    return {(one, two): foretold[one][two].evaluations / counted[two] for one in LEVELS for two in LEVELS}


@pytest.mark.parametrize(("name", "rtol"), QUICK)
def test_evaluations_are_foretold_within_a_factor_of_three(name: str, rtol: float | None) -> None:
    found = factors(flywheel.load(FOLDER / "scenes" / f"{name}.toml"), rtol)
    assert {pair: factor for pair, factor in found.items() if not 1 / 3 <= factor <= 3} == {}


@pytest.mark.parametrize("name", MOVING)
def test_so_are_those_of_torques_that_depend_on_speed(name: str) -> None:
    case = regimes.CASES[name]
    found = factors(flywheel.load(regimes.scene(name, irregularity=case.irregularities[0])), 1e-6)
    assert {pair: factor for pair, factor in found.items() if not 1 / 3 <= factor <= 3} == {}


def test_its_own_level_is_the_one_measured() -> None:
    for level in LEVELS:
        sizing = flywheel.size(flywheel.load(FOLDER / "scenes" / "press.toml"), accuracy=level)
        costs = predicted(sizing)
        assert costs[level] is sizing.cost
        assert [*costs] == [*LEVELS]
        assert all(cost.seconds > 0.0 for cost in costs.values())


def test_seconds_of_a_confirmation_grow_with_cells_and_not_with_their_square(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explanation, "_walk", lambda _, phi: 7e-6 * len(phi))  # as measured
    monkeypatch.setattr(explanation, "_system", lambda: 8e-6)
    foretold = {}
    for name in ("press", "three_cylinder"):
        sizing = flywheel.size(flywheel.load(EXAMPLES / "machines" / f"{name}.toml"), accuracy="normal")
        costs = predicted(sizing)
        foretold[name] = costs["confirm"].seconds - costs["normal"].seconds
    assert 0.01 / 3 < foretold["press"] < 0.01 * 3  # measured: 0.01 s on 9 cells, 0.13 s on 1080
    assert 0.13 / 3 < foretold["three_cylinder"] < 0.13 * 3


@pytest.mark.parametrize("name", ["six_bar", "cam_press", "geared_five_bar"])
def test_implicit_steps_of_linkages_are_foretold_within_a_factor_of_three(name: str) -> None:
    scene = flywheel.load(EXAMPLES / "linkages" / f"{name}.toml")
    foretold = predicted(flywheel.size(scene, accuracy="normal"))["audit"].evaluations
    assert 1 / 3 <= foretold / flywheel.size(scene).cost.evaluations <= 3


def test_foretelling_loads_no_integrator() -> None:
    code = (
        "import flywheel, sys; from flywheel.prediction import predicted; from tests import scenes;"
        "predicted(flywheel.size(flywheel.load(scenes.yoke()), accuracy='normal')); print('scipy' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "False\n"


def test_a_diagram_of_areas_has_nothing_to_foretell() -> None:
    sizing = flywheel.size(flywheel.load(FOLDER / "scenes" / "areas-sizing.toml"))
    assert {cost.evaluations for cost in predicted(sizing).values()} == {0}
