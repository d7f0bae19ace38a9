"""What becomes of methods that are run within a budget, with methods made up."""

import pytest

from flywheel.numerics.budget import count
from flywheel.numerics.faults import Fault, SceneError
from flywheel.study import tradeoff
from flywheel.study.steppers import NoAnswerError
from flywheel.study.tradeoff import DONE, FAILED, LEFT, OUT_OF_TIME, Method, Run


def method(answer, name="made up", setting=""):
    return Method(name, setting, name, answer)


def raising(error):
    def answer():
        raise error

    return method(answer)


def endless():
    while True:
        count(1)


def run_of(answer, budget=10.0):
    return tradeoff.measured([method(answer)], budget).runs[0]


def test_an_answer_has_its_times_and_evaluations():
    calls = []

    def answer():
        calls.append(1)
        count(5)
        return 3.0

    found = run_of(answer)
    assert (found.outcome, found.value, found.evaluations) == (DONE, 3.0, 5)
    assert len(found.times) == len(calls) - 1  # the first warms up
    assert min(found.times) <= found.seconds <= max(found.times)


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
    found = tradeoff.measured([raising(error), method(lambda: 1.0)], 10.0)
    assert [(run.outcome, run.reason) for run in found.runs] == [(FAILED, reason), (DONE, "")]
    assert (found.runs[0].value, found.runs[0].seconds) == (None, None)


def test_an_answer_that_is_not_finite_is_none():
    assert run_of(lambda: float("nan"))[1:3] == (FAILED, None)


def test_a_method_ends_with_its_time():
    found = run_of(endless, 0.01)
    assert (found.outcome, found.value) == (OUT_OF_TIME, None)


def test_finer_settings_of_a_method_that_took_too_long_are_not_begun():
    rough, fine, other = method(endless, "a", "rough"), method(lambda: 1.0, "a", "fine"), method(lambda: 1.0, "b", "fine")
    found = tradeoff.measured([rough, fine, other], 1.0)
    assert [run.outcome for run in found.runs] == [OUT_OF_TIME, LEFT, DONE]
    assert "took too long" in found.runs[1].reason


def test_nothing_is_begun_when_the_budget_is_spent(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(tradeoff.time, "perf_counter", lambda: now[0])

    def slow():
        now[0] += 2.0
        return 1.0

    found = tradeoff.measured([method(slow), method(slow, "other")], 1.0)
    assert [run.outcome for run in found.runs] == [DONE, LEFT]
    assert not found.interrupted


def test_what_was_finished_before_an_interruption_stays():
    third = method(lambda: 3.0)
    found = tradeoff.measured([method(lambda: 1.0), raising(KeyboardInterrupt()), third], 10.0)
    assert [run.outcome for run in found.runs] == [DONE, LEFT, LEFT]
    assert found.interrupted
    assert found.runs[2].method is third


def test_progress_is_told_before_each():
    told = []
    tradeoff.measured([method(lambda: 1.0, "a"), method(lambda: 1.0, "b")], 10.0, lambda *where: told.append(where))
    assert told == [(0, 2, "a"), (1, 2, "b")]


def timed(times, answer=lambda: 1.0):
    return Run(method(answer), DONE, 1.0, times)


def test_those_near_the_fastest_are_run_again_in_turns():
    order = []
    fast, near = timed((1e-3,), lambda: order.append("fast") or 1.0), timed((1.5e-3,), lambda: order.append("near") or 1.0)
    found, stopped = tradeoff.decided([fast, near, timed((0.5,)), Run(method(endless), LEFT)])
    assert not stopped
    assert order == ["fast", "near"] * (len(order) // 2)
    assert [len(run.times) for run in found] == [len(order) // 2] * 2


def test_one_alone_is_not_run_again():
    alone = timed((1e-3,))
    assert tradeoff.decided([alone, timed((0.5,), lambda: pytest.fail("run again"))]) == ([alone], False)
    assert tradeoff.decided([]) == ([], False)


def test_an_interruption_of_the_last_round_leaves_the_times_there_are():
    def interrupt():
        raise KeyboardInterrupt

    near = [timed((1e-3,)), timed((1.1e-3,), interrupt)]
    assert tradeoff.decided(near) == (near, True)
