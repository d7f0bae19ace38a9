"""Every example runs: exam scripts agree with their true figures, scenes size, the engine's table can be made again."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

import flywheel
from tests.limits import sample

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMS, MACHINES = EXAMPLES / "exams", EXAMPLES / "machines"
SCRIPTS = sorted(path for path in EXAMS.glob("*.py") if path.name != "steps.py")
SCENES = sorted(EXAMPLES.glob("*/*.toml"))
ONE_WAY = [path for path in SCENES if "\n[stroke]" in path.read_text(encoding="utf-8")]
ALONE = [path for path in SCENES if not {"[stroke]", "[flywheel]"} & set(path.read_text(encoding="utf-8").split())]
SIZED = [path for path in SCENES if path not in (*ONE_WAY, *ALONE)]


def name(path: Path) -> str:
    return path.stem


@pytest.fixture
def steps(monkeypatch):
    """Their shared helper, importable as it is for a script run from its own folder."""
    monkeypatch.syspath_prepend(str(EXAMS))
    monkeypatch.delitem(sys.modules, "steps", raising=False)
    import steps

    yield steps
    sys.modules.pop("steps", None)


def test_there_are_examples():
    assert len(SCRIPTS) == 10
    assert len(SCENES) >= 20


@pytest.mark.parametrize("script", sample(SCRIPTS, 5), ids=name)
def test_exam_agrees_with_its_true_figures_and_says_where_the_print_errs(script, steps, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script), run_name="__main__")
    printed = capsys.readouterr().out
    assert "verdict" in printed
    assert "DISAGREES" not in printed
    wrong_in_print = {"march_2010", "may_2013", "may_2014", "p107_2", "p115_2"}
    assert ("print errs" in printed) == (script.stem in wrong_in_print)


@pytest.mark.parametrize("scene", ONE_WAY, ids=name)
def test_scene_of_one_way_is_reduced_from_end_to_end(scene):
    loaded = flywheel.load(scene)
    ends = [loaded.stroke.start, loaded.stroke.end]
    assert (flywheel.reduce(loaded, ends).inertia > 0).all()
    with pytest.raises(flywheel.SceneError, match="one-way stroke"):
        flywheel.size(loaded)


@pytest.mark.parametrize("scene", ALONE, ids=name)
def test_scene_of_a_mechanism_alone_moves_and_has_no_flywheel_to_size(scene):
    loaded = flywheel.load(scene)
    assert flywheel.motion(loaded, points=5).curves
    with pytest.raises(flywheel.SceneError, match="flywheel"):
        flywheel.size(loaded)


@pytest.mark.parametrize("scene", sample(SIZED, 4), ids=name)
def test_scene_documents_itself_and_sizes_to_its_irregularity(scene):
    loaded, text = flywheel.load(scene), scene.read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert loaded.title or scene.parent.name not in ("machines", "regimes")
    sizing = flywheel.size(loaded, simulate=False)
    assert sizing.energy_fluctuation > 0
    if loaded.irregularity is None:
        assert sizing.simulation.irregularity > 0
        assert sizing.flywheel.exact is None
    else:
        assert sizing.reached
        assert sizing.flywheel.needed
        assert sizing.flywheel.exact > 0
    if sizing.balance is not None:
        assert abs(sizing.balance.value) > 1e-3


def test_pinion_press_needs_the_same_swing_as_the_press_with_its_gear_inertia():
    on_crank = flywheel.size(flywheel.load(MACHINES / "press.toml"), simulate=False)
    on_pinion = flywheel.size(flywheel.load(MACHINES / "press_pinion.toml"), simulate=False)
    gears = 38.0 + 36 * 0.12
    assert 36 * on_pinion.flywheel.exact + gears == pytest.approx(on_crank.flywheel.exact, rel=1e-8)


def test_three_cylinders_carry_three_times_the_load():
    single = flywheel.size(flywheel.load(MACHINES / "engine.toml"), simulate=False)
    triple = flywheel.size(flywheel.load(MACHINES / "three_cylinder.toml"), simulate=False)
    assert -triple.balance.value == pytest.approx(3 * single.balance.value, rel=1e-9)
    assert triple.energy_fluctuation < single.energy_fluctuation


def test_given_press_flywheel_lies_where_sizing_puts_it():
    given = flywheel.size(flywheel.load(MACHINES / "press_given.toml"), simulate=False)
    text = (MACHINES / "press_given.toml").read_text(encoding="utf-8")
    asked = text.replace('inertia = "12 kg m^2"', f"irregularity = {given.simulation.irregularity!r}")
    assert asked != text
    (sized,) = [flywheel.size(flywheel.load(asked), simulate=False)]
    assert sized.flywheel.exact == pytest.approx(12.0, rel=1e-8)


def test_engine_cycle_is_made_again_byte_for_byte():
    made = runpy.run_path(str(MACHINES / "make_engine_cycle.py"), run_name="engine_cycle")
    assert made["cycle_csv"]().encode("ascii") == (MACHINES / "engine_cycle.csv").read_bytes()


def test_engine_cycle_script_writes_beside_itself(tmp_path):
    script = tmp_path / "make_engine_cycle.py"
    script.write_bytes((MACHINES / script.name).read_bytes())
    runpy.run_path(str(script), run_name="__main__")
    assert (tmp_path / "engine_cycle.csv").read_bytes() == (MACHINES / "engine_cycle.csv").read_bytes()


def test_a_wrong_step_fails(steps, capsys):
    with pytest.raises(SystemExit, match="1 of 2 steps disagree"):
        steps.report("title", [steps.Step("right", 1.0, "1.00"), steps.Step("wrong", 1.0, "1.02")])
    assert "DISAGREES with the print" in capsys.readouterr().out


def test_an_erratum_needs_an_error_and_a_true_figure_its_digits(steps):
    assert steps.verdict(steps.Step("I", 348.9894, "348.989", erratum="no")).startswith("NO ERRATUM")
    assert steps.verdict(steps.Step("I", 1.0, "2", true=1.0, erratum="yes")) == "print errs"
    assert steps.verdict(steps.Step("I", 1.0 + 1e-8, "1", true=1.0)).startswith("DISAGREES with the true")
