"""Methods compared: what is asked, measured and shown."""

from __future__ import annotations

import json
import sys
import time
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel import Fault, Machine, SceneError, Tradeoff
from flywheel.machine.programs import recorded
from flywheel.numerics.budget import count
from flywheel.study import answers, tradeoff
from flywheel.study.answers import NoAnswerError, Question, Reference, answer
from flywheel.study.tradeoff import (
    DONE,
    FAILED,
    FAMILIES,
    LEFT,
    OUT_OF_TIME,
    MethodRow,
    MethodRun,
    OutOfTimeError,
    StudyMethod,
    limited,
)
from tests.extras import extra
from tests.limits import sample
from tests.scenes import press, rotor, shaper, yoke

# Comparisons made by hand, for tests of what is told and drawn.


REFERENCE = Reference(2.0, 1e-14, "Gauss' rule", "the closed form is 1e-15 apart, within its estimate")


def row(family: str, setting: str = "", error: float | None = 1e-3, seconds: float = 1e-3, **changes: Any) -> MethodRow:
    """A method that was run to its end, unless its error is None."""
    name = f"{family}, {setting}" if setting else family
    own = MethodRow(name, family, name[-16:], "done", 2.0, error, False, seconds, seconds, seconds, 7, 100, None, "", "")
    if error is None:
        own = own._replace(outcome="not run", value=None, meets=None, seconds=None, repeats=0, evaluations=None)
    else:
        own = own._replace(meets=error + REFERENCE.doubt <= 1e-6, value=2 * (1 + error))
    return own._replace(**changes)


def compared(*rows: MethodRow, **changes: Any) -> Tradeoff:
    """A comparison of these, of which none is the cheapest yet."""
    own: dict[str, Any] = {
        "title": "Rotor",
        "figure": "exact flywheel",
        "unit": "kg m²",
        "rtol": 1e-6,
        "reference": REFERENCE,
        "scale": 2.5,
        "rows": rows,
        "cheapest": None,
        "level": (),
        "cheapest_promised": None,
        "cannot": {},
        "budget": 60.0,
        "seconds": 1.0,
        "interrupted": False,
    }
    return Tradeoff(**{**own, **changes})


def whole() -> Tradeoff:
    """One with something of everything."""
    rows = (
        row("accumulated areas", "", 0.02, 6e-4, leaves_out="that I* varies over the cycle"),
        *(row("plain grid", f"{count} angles", 3 / count, 1e-7 * count, leaves_out="angles between") for count in (36, 360)),
        *(row("exact, closed form", f"rtol {rtol}", 3e-16, 6.4e-4, promised=float(rtol)) for rtol in ("0.001", "1e-06")),
        row("time stepping, RK4", "36 steps, restarted", 4e-7, 0.4),
        row("time stepping, RK4", "36 steps", 3e-3, 0.35, leaves_out="jumps within steps"),
        row("time stepping, Euler", "360 steps, restarted", 1.2e-2, 0.6),
        row("time stepping, Euler", "360 steps", None, leaves_out="jumps within steps", reason="the budget was spent"),
        row("Lagrange's multipliers", "rtol 1e-06, restarted", None, outcome="no answer", reason="the machine stops"),
    )
    cheapest = "exact, closed form, rtol 1e-06"
    level = ("exact, closed form, rtol 0.001",)
    cannot = {"whole bond graph": "it takes no springs"}
    return compared(*rows, cheapest=cheapest, level=level, cheapest_promised=cheapest, cannot=cannot)


# Whole comparisons of two small scenes: the errors told are those against 30-digit figures.


FOLDER = Path(__file__).parents[1] / "references"
REFERENCES = {entry["scene"]: entry for entry in json.loads((FOLDER / "references.json").read_text())}
RTOL = 1e-6
TRUE = 353.5214273222  # of the yoke of scenes.py


FEW = ("accumulated", "inertia", "plain", "exact", "collocation", "time stepping, RK45, rtol 1e-06, restarted")


def few(monkeypatch, names=FEW):
    """Let the quickest methods be all there are, each run twice: no test hangs on how fast the machine is."""
    every = tradeoff.methods
    monkeypatch.setattr(tradeoff, "methods", lambda request: [own for own in every(request) if own.name.startswith(names)])
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
    result, true = found_and_true
    assert abs(result.reference.value - true) <= (result.reference.doubt + 4e-16) * max(true, result.scale)


def test_the_errors_are_true(found_and_true):
    result, true = found_and_true
    done = [row for row in result.rows if row.outcome == "done"]
    assert result.complete
    assert len(done) >= 12
    for row in done:
        own = abs(row.value - true) / max(abs(true), result.scale)
        assert row.error == pytest.approx(own, rel=1e-9, abs=2 * result.reference.doubt)


def test_a_method_keeps_what_its_error_says(found_and_true):
    result, _ = found_and_true
    for row in result.rows:
        assert row.meets is (None if row.error is None else row.error + result.reference.doubt <= RTOL)


def test_the_cheapest_keeps_it(found_and_true):
    result, _ = found_and_true
    kept = {row.name for row in result.rows if row.meets}
    assert {result.cheapest, result.cheapest_promised, *result.level} <= kept
    assert result.cheapest not in result.level
    assert result.row(result.cheapest_promised).promised <= RTOL


def choice(monkeypatch, **times):
    """Choice where each of three methods of the yoke has taken these times (s)."""
    names = {
        "grid": "plain grid, 36 angles",
        "loose": "exact, closed form, rtol 0.001",
        "tight": "exact, closed form, rtol 1e-06",
    }

    def measured(result, budget, progress, spent):
        by_name = {own.name: own for own in result}
        runs = [MethodRun(by_name[names[key]], "done", TRUE * (1 + 1e-8), (seconds,)) for key, seconds in times.items()]
        return runs, False, 0.0

    monkeypatch.setattr(tradeoff, "measured", measured)
    monkeypatch.setattr(tradeoff, "decided", lambda runs: (list(runs), False))
    return flywheel.tradeoff(flywheel.load(yoke()), RTOL)


def test_the_fastest_is_chosen_and_the_fastest_promise_beside_it(monkeypatch):
    result = choice(monkeypatch, grid=1e-4, loose=5e-4, tight=6e-4)
    assert (result.cheapest, result.cheapest_promised) == ("plain grid, 36 angles", "exact, closed form, rtol 1e-06")
    assert result.level == ()


def test_of_those_that_are_level_one_that_promises_it_is_chosen(monkeypatch):
    result = choice(monkeypatch, grid=5.9e-4, loose=5.9e-4, tight=6e-4)
    assert result.cheapest == result.cheapest_promised == "exact, closed form, rtol 1e-06"
    assert set(result.level) == {"plain grid, 36 angles", "exact, closed form, rtol 0.001"}


def test_a_fast_method_that_misses_it_is_not_chosen(monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "TRUE", TRUE * (1 + 1e-5))
    result = choice(monkeypatch, grid=1e-4, tight=6e-4)
    assert (result.cheapest, result.cheapest_promised, result.level) == (None, None, ())


def every_method(scene):
    machine = flywheel.Machine(flywheel.load(scene))
    request = Question.of(flywheel.size(machine, simulate=False))
    return tradeoff.methods(request), request


def test_every_family_has_its_place():
    """Over scenes whose torques depend on position alone, and on speed; none has a place that is no method's."""
    request = [rotor(), yoke(flywheel={"inertia": 300}), press(), rotor(drive={"torque": "100 - 4*omega"}, regime={})]
    assert {own.family for scene in request for own in every_method(scene)[0]} == set(FAMILIES)


@pytest.mark.parametrize("scene", [rotor(), yoke(), yoke(flywheel={"inertia": 300})])
def test_every_method_has_a_name_of_its_own(scene):
    result, request = every_method(scene)
    names = [own.name for own in result]
    assert len(set(names)) == len(names) >= 30
    assert len({own.label for own in result}) == len(names)
    families = {own.family for own in result} | ({tradeoff.MULTIPLIERS} if answers.obstacle(request.machine) else set())
    assert {f"time stepping, {kind}" for kind in ("Euler", "RK4", "RK45", "DOP853", "LSODA")} <= families
    assert {
        "accumulated areas",
        "plain grid",
        "exact, closed form",
        "whole bond graph",
        tradeoff.MULTIPLIERS,
    } <= families


def test_no_method_is_helped_by_what_another_evaluated():
    result, _ = every_method(press())
    again = [own for own in result if own.family == tradeoff.COLLOCATION]
    first, second = (run.evaluations for run in tradeoff.measured([again[0], again[0]], 10.0)[0])
    assert first == second > 0


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (yoke(), ""),
        (yoke(flywheel={"inertia": 300}), ""),
        (rotor(drive={"torque": "100 - 4*omega"}, regime={}), ""),
        (rotor(drive={"torque": "100 - 4*omega if omega > 1 else 96"}, regime={}), ""),
        (
            rotor(drive={"torque": "100 - 4.12345678901*omega"}, regime={}),
            "not provable: a number, 4.12345678901, that may have been calculated with roundings",
        ),
        (
            rotor(drive={"torque": "100 - 4*omega"}, regime={}, inertia=[{"on": "crank", "value": "1 kg m^2 ± 0.1 %"}]),
            "proven over ranges of numbers: no single figure",
        ),
    ],
)
def test_a_proof_is_a_method_or_says_why_it_is_none(scene, reason):
    extra("flint")
    result, _ = every_method(scene)
    run = tradeoff.measured([own for own in result if own.family == tradeoff.PROOF], 10.0)[0][0]
    assert (run.outcome, run.reason) == ("no answer" if reason else "done", reason)
    if not reason:
        true = answer(flywheel.size(flywheel.load(scene)))
        assert run.value == pytest.approx(true, rel=1e-12)


@pytest.mark.slow
def test_torques_that_depend_on_speed_have_a_reference_in_time(monkeypatch):
    scene = {
        "inertia": [{"on": "crank", "value": 2}],
        "drive": {"torque": "100 - 4*omega"},
        "load": [{"on": "crank", "torque": "-60*(1 + sin(phi))"}],
        "flywheel": {"irregularity": 0.01},
    }
    few(monkeypatch, ("exact, collocation, rtol 1e-06",))
    result = flywheel.tradeoff(flywheel.load(scene), RTOL, budget=600.0)
    assert "stepped in time" in result.reference.verified
    assert result.reference.doubt < 1e-9
    assert result.row("exact, collocation, rtol 1e-06").meets


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


# What becomes of methods that are run within a budget, with methods made up.


def method(answer, name="made up", setting=""):
    return StudyMethod(name, setting, name, answer)


def raising(error):
    def answer():
        raise error

    return method(answer)


def endless():
    while True:
        count(1)


def run_of(answer, budget=10.0):
    return tradeoff.measured([method(answer)], budget)[0][0]


def test_an_answer_has_its_times_and_evaluations():
    calls = []

    def answer():
        calls.append(1)
        count(5)
        return 3.0

    result = run_of(answer)
    assert (result.outcome, result.value, result.evaluations) == (DONE, 3.0, 5)
    assert len(result.times) == len(calls) - 1  # the first warms up
    assert min(result.times) <= result.seconds <= max(result.times)


def test_a_slow_method_is_run_once(monkeypatch):
    monkeypatch.setattr(tradeoff, "_ENOUGH", 0.0)
    calls = []
    assert len(run_of(lambda: calls.append(1) or 1.0).times) == len(calls) == 1


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (NoAnswerError("no motion"), "no motion"),
        (SceneError([Fault("load", "x", "y")]), "load: found x, expected y"),
        (ZeroDivisionError(), "ZeroDivisionError"),
        (ValueError("one\ntwo"), "one"),
    ],
)
def test_a_method_that_fails_says_why(error, reason):
    runs, *_ = tradeoff.measured([raising(error), method(lambda: 1.0)], 10.0)
    assert [(run.outcome, run.reason) for run in runs] == [(FAILED, reason), (DONE, "")]
    assert (runs[0].value, runs[0].seconds) == (None, None)


def test_an_answer_that_is_not_finite_is_none():
    assert run_of(lambda: float("nan"))[1:3] == (FAILED, None)


def test_a_method_ends_with_its_time():
    result = run_of(endless, 0.01)
    assert (result.outcome, result.value) == (OUT_OF_TIME, None)


def test_finer_settings_of_a_method_that_took_too_long_are_not_begun():
    rough, fine, other = method(endless, "a", "rough"), method(lambda: 1.0, "a", "fine"), method(lambda: 1.0, "b", "fine")
    runs, *_ = tradeoff.measured([rough, fine, other], 1.0)
    assert [run.outcome for run in runs] == [OUT_OF_TIME, LEFT, DONE]
    assert "took too long" in runs[1].reason


def test_nothing_is_begun_when_the_budget_is_spent(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(tradeoff.time, "perf_counter", lambda: now[0])

    def slow():
        now[0] += 2.0
        return 1.0

    runs, interrupted, _ = tradeoff.measured([method(slow), method(slow, "other")], 1.0)
    assert [run.outcome for run in runs] == [DONE, LEFT]
    assert not interrupted


def test_what_was_finished_before_an_interruption_stays():
    third = method(lambda: 3.0)
    runs, interrupted, _ = tradeoff.measured([method(lambda: 1.0), raising(KeyboardInterrupt()), third], 10.0)
    assert [run.outcome for run in runs] == [DONE, LEFT, LEFT]
    assert interrupted
    assert runs[2].method is third


def test_progress_is_told_before_each():
    text = []
    tradeoff.measured([method(lambda: 1.0, "a"), method(lambda: 1.0, "b")], 10.0, lambda *where: text.append(where))
    assert text == [(0, 2, "a"), (1, 2, "b")]


def timed(times, answer=lambda: 1.0):
    return MethodRun(method(answer), DONE, 1.0, times)


def test_those_near_the_fastest_are_run_again_in_turns():
    order = []
    fast, near = timed((1e-3,), lambda: order.append("fast") or 1.0), timed((1.5e-3,), lambda: order.append("near") or 1.0)
    result, stopped = tradeoff.decided([fast, near, timed((0.5,)), MethodRun(method(endless), LEFT)])
    assert not stopped
    assert order == ["fast", "near"] * (len(order) // 2)
    assert [len(run.times) for run in result] == [len(order) // 2] * 2


def test_one_alone_is_not_run_again():
    alone = timed((1e-3,))
    assert tradeoff.decided([alone, timed((0.5,), lambda: pytest.fail("run again"))]) == ([alone], False)
    assert tradeoff.decided([]) == ([], False)


def test_an_interruption_of_the_last_round_leaves_the_times_there_are():
    def interrupt():
        raise KeyboardInterrupt

    near = [timed((1e-3,)), timed((1.1e-3,), interrupt)]
    assert tradeoff.decided(near) == (near, True)


# What is concluded from a comparison, in all cases.


GRID = row("plain grid", "36 angles", 1e-7, 1e-4)
EXACT = row("exact, closed form", "rtol 1e-06", 3e-16, 6e-4, promised=1e-6)
LOOSE = row("exact, closed form", "rtol 0.001", 3e-16, 5e-4, promised=1e-3)
RESULT_LEFT = row("whole bond graph", "rtol 1e-06", None)


def test_nothing_keeps_it():
    result = compared(row("plain grid", "36 angles", 0.1))
    assert result.sentence == "No method that was run keeps the relative error of 1e-06 on this scene."


def test_the_cheapest_promises_it():
    result = compared(GRID, EXACT, cheapest=EXACT.name, cheapest_promised=EXACT.name)
    assert result.sentence.startswith(
        "Cheapest that keeps a relative error of 1e-06 on this scene: exact, closed form, rtol 1e-06"
    )
    assert "0.6 ms" in result.sentence
    assert "no error estimate" not in result.sentence


@pytest.mark.parametrize("best", [GRID, LOOSE])
def test_the_cheapest_does_not_know_it(best):
    result = compared(best, EXACT, cheapest=best.name, cheapest_promised=EXACT.name)
    assert "the cheapest method that has one is exact, closed form, rtol 1e-06" in result.sentence


def test_none_that_promises_it_was_run():
    result = compared(GRID, RESULT_LEFT, cheapest=GRID.name)
    assert result.sentence.endswith("no method that has one was run to completion.")


def test_those_that_are_level_are_named():
    result = compared(LOOSE, EXACT, cheapest=EXACT.name, level=(LOOSE.name,), cheapest_promised=EXACT.name)
    assert "level with it within the noise: exact, closed form, rtol 0.001." in result.sentence


@pytest.mark.parametrize(
    ("rows", "interrupted", "complete"),
    [
        ((GRID, EXACT), False, True),
        ((GRID, row("whole bond graph", "", None, outcome="no answer")), False, True),
        ((GRID, row("whole bond graph", "", None, outcome="out of time")), False, False),
        ((GRID, RESULT_LEFT), False, False),
        ((GRID, EXACT), True, False),
    ],
)
def test_what_is_whole(rows, interrupted, complete):
    assert compared(*rows, interrupted=interrupted).complete is complete


def test_rows_are_found_by_name():
    assert compared(GRID, EXACT).row(EXACT.name) is EXACT


def test_data_are_plain():
    result = whole()
    data = json.loads(json.dumps(result.as_dict()))
    assert [entry["name"] for entry in data["rows"]] == [own.name for own in result.rows]
    assert data["sentence"] == result.sentence
    assert data["reference"]["value"] == 2.0


# What all methods are asked for, and how errors are relative.


def asked_and_sizing(scene):
    machine = Machine(flywheel.load(scene))
    sizing = flywheel.size(machine, simulate=False)
    return Question.of(sizing), sizing


def test_a_sizing_asks_for_the_exact_flywheel():
    request, sizing = asked_and_sizing(yoke())
    assert (request.figure, request.unit) == ("exact flywheel", "kg m²")
    assert answer(sizing) == sizing.flywheel.exact
    assert request.scale == pytest.approx(sizing.energy_fluctuation / (0.04 * sizing.speed**2), rel=1e-12)


def test_an_analysis_asks_for_the_irregularity():
    request, sizing = asked_and_sizing(yoke(flywheel={"inertia": 300}))
    assert (request.figure, request.unit, request.scale) == ("irregularity", "", 0.0)
    assert answer(sizing) == pytest.approx(sizing.run.irregularity, rel=1e-12)


def test_errors_of_a_flywheel_near_nothing_are_relative_to_the_scale():
    request, _ = asked_and_sizing(yoke())
    assert request.error(1.01 * request.scale, request.scale) == pytest.approx(0.01)
    assert request.error(0.01 * request.scale, 0.0) == pytest.approx(0.01)
    assert request.error(1.02 * 3 * request.scale, 3 * request.scale) == pytest.approx(0.02)


def test_inertia_on_a_shaft_goes_to_the_crank_by_the_square_of_its_ratio():
    request, _ = asked_and_sizing(shaper(flywheel={"irregularity": 0.1, "on": "bull"}))
    assert request.crank == 0.25


# A time that is over ends what works, and only what is inside.


def test_evaluations_are_counted_while_there_is_time():
    with limited(time.perf_counter() + 60.0) as tally:
        count(3)
        count(4)
    assert tally.evaluations == 7


def test_the_first_evaluation_past_the_end_raises():
    with pytest.raises(OutOfTimeError), limited(time.perf_counter() - 1.0):
        count(1)


def test_outside_there_is_no_limit():
    with limited(time.perf_counter() - 1.0):
        pass
    count(1)


def test_what_is_inside_keeps_the_limit_around_it():
    now = time.perf_counter()
    with pytest.raises(OutOfTimeError), limited(now - 1.0), limited(now + 60.0):
        count(1)


def test_a_machine_whose_recording_is_cut_off_is_not_taken_for_one_without():
    with pytest.raises(OutOfTimeError), limited(time.perf_counter() - 1.0):
        recorded(flywheel.load(yoke()), ("flywheel.irregularity",), [0.05])


# A plain grid, against the script that people write.


COUNT = 91  # no angle on a jump


def asked(scene):
    machine = Machine(flywheel.load(scene))
    return Question.of(flywheel.size(machine, simulate=False))


def script(machine):
    """Angles one by one: W by the trapezoidal rule, balanced by a constant torque, and I*."""
    angles = [2 * pi * k / COUNT for k in range(COUNT + 1)]
    states = [machine.reduce(np.array([angle])) for angle in angles]
    loads = [float(state.moment[0]) for state in states]
    inertia = [float(state.inertia[0]) for state in states]
    net = sum((loads[k] + loads[k + 1]) / 2 * (2 * pi / COUNT) for k in range(COUNT))
    torque, work = -net / (2 * pi), [0.0]
    for k in range(COUNT):
        work.append(work[-1] + ((loads[k] + loads[k + 1]) / 2 + torque) * (2 * pi / COUNT))
    return work, inertia


def test_a_sizing_is_that_of_a_script():
    own = asked(press())
    speed, eps = 4 * pi, 0.05
    work, inertia = script(own.machine)
    high = max(w - (1 + eps / 2) ** 2 * speed**2 * i / 2 for w, i in zip(work, inertia, strict=True))
    low = min(w - (1 - eps / 2) ** 2 * speed**2 * i / 2 for w, i in zip(work, inertia, strict=True))
    assert answers.by_grid(own, COUNT) == pytest.approx((high - low) / (eps * speed**2), rel=1e-11)


def test_an_analysis_is_that_of_a_script():
    own = asked(yoke(flywheel={"inertia": 300}))
    work, inertia = script(own.machine)

    def speeds(level):
        return [(2 * (level + w) / (300 + i)) ** 0.5 for w, i in zip(work, inertia, strict=True)]

    low, high = -min(work), 1e6
    for _ in range(200):  # bisection for the mean of extremes
        middle = (low + high) / 2
        omega = speeds(middle)
        low, high = (middle, high) if max(omega) + min(omega) < 4 * pi else (low, middle)
    expected = 2 * (max(omega) - min(omega)) / (max(omega) + min(omega))
    assert answers.by_grid(own, COUNT) == pytest.approx(expected, rel=1e-9)


def test_the_error_goes_down_with_the_angles():
    own = asked(press())
    true = flywheel.size(own.machine, simulate=False).flywheel.exact
    errors = [abs(answers.by_grid(own, count) / true - 1) for count in (36, 360, 3600)]
    assert errors[2] < errors[1] / 5 < errors[0] / 25


def test_torques_that_depend_on_speed_are_taken_at_a_constant_one():
    scene = {
        "inertia": [{"on": "crank", "value": 2}],
        "drive": {"torque": "100 - 4*omega"},
        "load": [{"on": "crank", "torque": "-60", "from": 0, "to": "180 deg"}],
        "flywheel": {"irregularity": 0.01},
    }
    machine = Machine(flywheel.load(scene))
    samples = answers.sampled(machine, 3600)
    assert samples.speed == pytest.approx((100 - 30) / 4, rel=1e-3)  # no net work in a cycle
    assert samples.work[-1] == pytest.approx(0.0, abs=0.1)
    assert samples.work.min() == pytest.approx(-30 * pi, rel=2e-3)
