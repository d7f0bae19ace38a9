"""Whole comparisons of two small scenes: the errors told are those against 30-digit figures."""

import json
import sys
from pathlib import Path

import pytest

import flywheel
from flywheel.study import steppers, tradeoff
from flywheel.study.reference import Question
from flywheel.study.tradeoff import FAMILIES, Measured, Run
from tests.limits import sample
from tests.scenes import press, rotor, yoke

FOLDER = Path(__file__).parents[1] / "references"
REFERENCES = {entry["scene"]: entry for entry in json.loads((FOLDER / "references.json").read_text())}
RTOL = 1e-6
TRUE = 353.5214273222  # of the yoke of scenes.py


FEW = ("accumulated", "inertia", "plain", "exact", "collocation", "time stepping, RK45, rtol 1e-06, restarted")


def few(monkeypatch, names=FEW):
    """Let the quickest methods be all there are, each run twice: no test hangs on how fast the machine is."""
    every = tradeoff.methods
    monkeypatch.setattr(tradeoff, "methods", lambda asked: [own for own in every(asked) if own.name.startswith(names)])
    monkeypatch.setattr(tradeoff, "_REPEATS", 1)
    monkeypatch.setattr(tradeoff, "_ROUNDS", 2)


@pytest.fixture(scope="module", params=sample(["rotor-window", "yoke-analysis"], 2))
def found_and_true(request):
    name = f"{request.param}.toml"
    scene, true = flywheel.load(FOLDER / "scenes" / name), REFERENCES[name]
    value = true["simulation"]["irregularity"] if scene.irregularity is None else true["flywheel"]["exact"]
    with pytest.MonkeyPatch.context() as monkeypatch:
        few(monkeypatch)
        return flywheel.tradeoff(scene, RTOL, budget=600.0), float(value)


def test_the_reference_is_true_within_its_doubt(found_and_true):
    found, true = found_and_true
    assert abs(found.reference.value - true) <= (found.reference.doubt + 4e-16) * max(true, found.scale)


def test_the_errors_are_true(found_and_true):
    found, true = found_and_true
    done = [row for row in found.rows if row.outcome == "done"]
    assert found.complete
    assert len(done) >= 12
    for row in done:
        own = abs(row.value - true) / max(abs(true), found.scale)
        assert row.error == pytest.approx(own, rel=1e-9, abs=2 * found.reference.doubt)


def test_a_method_keeps_what_its_error_says(found_and_true):
    found, _ = found_and_true
    for row in found.rows:
        assert row.meets is (None if row.error is None else row.error + found.reference.doubt <= RTOL)


def test_the_cheapest_keeps_it(found_and_true):
    found, _ = found_and_true
    kept = {row.name for row in found.rows if row.meets}
    assert {found.cheapest, found.cheapest_promised, *found.level} <= kept
    assert found.cheapest not in found.level
    assert found.row(found.cheapest_promised).promised <= RTOL


def choice(monkeypatch, **times):
    """What is chosen where each of three methods of the yoke has taken these times (s)."""
    names = {
        "grid": "plain grid, 36 angles",
        "loose": "exact, closed form, rtol 0.001",
        "tight": "exact, closed form, rtol 1e-06",
    }

    def measured(found, budget, progress, spent):
        by_name = {own.name: own for own in found}
        runs = [Run(by_name[names[key]], "done", TRUE * (1 + 1e-8), (seconds,)) for key, seconds in times.items()]
        return Measured(runs, False, 0.0)

    monkeypatch.setattr(tradeoff, "measured", measured)
    monkeypatch.setattr(tradeoff, "decided", lambda runs: (list(runs), False))
    return flywheel.tradeoff(flywheel.load(yoke()), RTOL)


def test_the_fastest_is_chosen_and_the_fastest_promise_beside_it(monkeypatch):
    found = choice(monkeypatch, grid=1e-4, loose=5e-4, tight=6e-4)
    assert (found.cheapest, found.cheapest_promised) == ("plain grid, 36 angles", "exact, closed form, rtol 1e-06")
    assert found.level == ()


def test_of_those_that_are_level_one_that_promises_it_is_chosen(monkeypatch):
    found = choice(monkeypatch, grid=5.9e-4, loose=5.9e-4, tight=6e-4)
    assert found.cheapest == found.cheapest_promised == "exact, closed form, rtol 1e-06"
    assert set(found.level) == {"plain grid, 36 angles", "exact, closed form, rtol 0.001"}


def test_a_fast_method_that_misses_it_is_not_chosen(monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "TRUE", TRUE * (1 + 1e-5))
    found = choice(monkeypatch, grid=1e-4, tight=6e-4)
    assert (found.cheapest, found.cheapest_promised, found.level) == (None, None, ())


def every_method(scene):
    machine = flywheel.Machine(flywheel.load(scene))
    asked = Question.of(flywheel.size(machine, simulate=False))
    return tradeoff.methods(asked), asked


def test_every_family_has_its_place():
    """Over scenes whose torques depend on position alone, and on speed; none has a place that is no method's."""
    asked = [rotor(), yoke(flywheel={"inertia": 300}), press(), rotor(drive={"torque": "100 - 4*omega"}, regime={})]
    assert {own.family for scene in asked for own in every_method(scene)[0]} == set(FAMILIES)


@pytest.mark.parametrize("scene", [rotor(), yoke(), yoke(flywheel={"inertia": 300})])
def test_every_method_has_a_name_of_its_own(scene):
    found, asked = every_method(scene)
    names = [own.name for own in found]
    assert len(set(names)) == len(names) >= 30
    assert len({own.label for own in found}) == len(names)
    families = {own.family for own in found} | ({tradeoff.MULTIPLIERS} if steppers.obstacle(asked.machine) else set())
    assert {f"time stepping, {kind}" for kind in ("Euler", "RK4", "RK45", "DOP853", "LSODA")} <= families
    assert {
        "accumulated areas",
        "plain grid",
        "exact, closed form",
        "whole bond graph",
        tradeoff.MULTIPLIERS,
    } <= families


def test_no_method_is_helped_by_what_another_evaluated():
    found, _ = every_method(press())
    again = [own for own in found if own.family == tradeoff.COLLOCATION]
    first, second = (run.evaluations for run in tradeoff.measured([again[0], again[0]], 10.0).runs)
    assert first == second > 0


@pytest.mark.slow
def test_torques_that_depend_on_speed_have_a_reference_in_time(monkeypatch):
    scene = {
        "inertia": [{"on": "crank", "value": 2}],
        "drive": {"torque": "100 - 4*omega"},
        "load": [{"on": "crank", "torque": "-60*(1 + sin(phi))"}],
        "flywheel": {"irregularity": 0.01},
    }
    few(monkeypatch, ("exact, collocation, rtol 1e-06",))
    found = flywheel.tradeoff(flywheel.load(scene), RTOL, budget=600.0)
    assert "stepped in time" in found.reference.verified
    assert found.reference.doubt < 1e-9
    assert found.row("exact, collocation, rtol 1e-06").meets


def test_a_machine_may_be_given():
    machine = flywheel.Machine(flywheel.load(yoke()))
    assert flywheel.tradeoff(machine, budget=0.01).reference.value == pytest.approx(353.521427322, rel=1e-11)


@pytest.mark.parametrize(
    ("scene", "word"),
    [
        (
            {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": 9}, "flywheel": {"irregularity": 0.1}},
            "areas",
        ),
        (rotor(load=[{"on": "crank", "torque": "-10*(t > 2)"}]), "time"),
        (rotor(shafts={"s": {"ratio": 1, "stiffness": 900}}, inertia=[{"on": "s", "value": 1}]), "compliant"),
    ],
)
def test_scenes_without_the_question_are_refused(scene, word):
    with pytest.raises(flywheel.SceneError, match=word):
        flywheel.tradeoff(flywheel.load(scene), budget=1.0)


@pytest.mark.parametrize("budget", [0.0, -1.0, float("nan")])
def test_a_budget_is_above_nothing(budget):
    with pytest.raises(flywheel.SceneError, match="budget"):
        flywheel.tradeoff(flywheel.load(rotor()), budget=budget)


@pytest.mark.parametrize("rtol", [0.0, -1.0, 0.5, float("nan")])
def test_what_is_asked_can_be_kept(rtol):
    with pytest.raises(flywheel.SceneError, match="rtol"):
        flywheel.tradeoff(flywheel.load(rotor()), rtol)


def test_something_else_is_no_scene():
    with pytest.raises(TypeError, match="Machine or a Scene"):
        flywheel.tradeoff({"load": []})
