"""A few of the mutants in every run, and mutants that once failed."""

import re
from pathlib import Path

import pytest

import flywheel
from flywheel.numerics.budget import BudgetError, limited, spend
from flywheel.numerics.faults import SceneError
from tests.fuzzing.guards import Watched, watched
from tests.fuzzing.judge import judged
from tests.fuzzing.mutants import KINDS, mutant
from tests.fuzzing.regressions import BY_CHANCE, BY_HAND, DEAR, NOT_REACHED, REFUSED, SCENES, as_expected
from tests.fuzzing.running import again, tried, way_of
from tests.limits import sample

SAMPLE = range(7_000_000, 7_000_150)
_ONCE_FAILED = [
    *sample([name for name in SCENES if name not in (*BY_HAND, *DEAR)], 6),
    *(pytest.param(name, marks=pytest.mark.slow) for name in DEAR),
]


@pytest.mark.parametrize("seed", sample([seed for seed in SAMPLE if way_of(seed) == "library"][:60], 6))
def test_a_mutant_is_sized_or_refused(seed):
    found = tried(seed)
    assert found.verdict.outcome != "failed", found.verdict.detail


@pytest.mark.parametrize("seed", sample([seed for seed in SAMPLE if way_of(seed) not in ("library", "time", "size")][:8], 3))
def test_a_mutant_goes_through_a_command(seed):
    found = tried(seed)
    assert found.verdict.outcome != "failed", found.verdict.detail


def test_mutants_are_the_same_every_time_and_of_every_kind():
    assert mutant(12345) == mutant(12345)
    seen = set()
    for seed in SAMPLE:
        seen.add(mutant(seed).kind)
        if seen == set(KINDS):
            break
    assert seen == set(KINDS)


@pytest.mark.parametrize("name", _ONCE_FAILED)
def test_what_once_failed(name):
    outcome, detail, *_ = again(name)
    assert as_expected(name, outcome, detail), f"{outcome}: {detail}"


def test_an_outcome_is_expected_by_name():
    assert {*REFUSED, *NOT_REACHED, *BY_CHANCE, *BY_HAND} <= set(SCENES)
    assert as_expected("layered_mesh", "refused", REFUSED["layered_mesh"])
    assert not as_expected("layered_mesh", "refused", "another fault")
    assert not as_expected("layered_mesh", "sized", "")
    assert not as_expected("enormous quantity", "refused", "")


@pytest.mark.parametrize(
    ("deed", "seen"),
    [
        (lambda folder: exec("1"), r"exec '<string>'"),
        (lambda folder: eval("1"), r"exec '<string>'"),
        (lambda folder: (folder / "canary").write_text("x"), r"open '.*canary'"),
        (lambda folder: Path("/etc/hostname").open().close(), r"open '/etc/hostname'"),
        (lambda folder: __import__("subprocess").run(["true"], check=True), r"subprocess\.Popen"),
        (lambda folder: __import__("os").system("true"), r"os\.system"),
        (lambda folder: __import__("socket").socket().close(), r"socket\."),
        (lambda folder: __import__("warnings").warn("x", stacklevel=1), r"UserWarning: x"),
    ],
    ids=["exec", "eval", "write", "read", "process", "shell", "socket", "warning"],
)
def test_the_watch_sees_what_must_not_be(deed, seen, tmp_path):
    results: list[Watched] = []
    with watched(tmp_path, 2.0, results):
        deed(tmp_path)
    assert any(re.search(seen, line) for line in results[0].seen), results[0].seen


def test_the_watch_sees_no_harm_in_reading_a_scene(tmp_path):
    (tmp_path / "scene.toml").write_text("title = 'x'")
    results: list[Watched] = []
    with watched(tmp_path, 2.0, results):
        (tmp_path / "scene.toml").read_text()
    assert results[0].seen == []


def test_a_verdict_tells_a_hang(monkeypatch):
    def never(path):
        while True:
            pass

    monkeypatch.setattr("flywheel.load", never)
    monkeypatch.setattr("tests.fuzzing.judge.WORK", 5)
    assert judged(mutant(1)).detail.startswith("too slow")


def test_a_verdict_tells_a_traceback(monkeypatch):
    def wrong(path):
        raise KeyError("x")

    monkeypatch.setattr("flywheel.load", wrong)
    verdict = judged(mutant(1))
    assert verdict.outcome == "failed"
    assert verdict.detail.startswith("KeyError")


def test_a_table_of_too_many_lines_is_refused_before_it_is_taken_apart(tmp_path):
    (tmp_path / "t.csv").write_text("0,1\n" * 40_001)
    (tmp_path / "scene.toml").write_text(
        'load = [{on = "crank", table = {file = "t.csv"}}]\nregime.speed = 1\nflywheel.inertia = 1'
    )
    with pytest.raises(SceneError, match=r'table\.file .*: found 40001 lines in "t\.csv", expected at most 40000'):
        flywheel.load(tmp_path / "scene.toml")


def test_a_search_is_given_up_after_so_much_work():
    spend(1e12)  # without a limit
    with limited(10.0):
        spend(6.0)
        with limited(100.0):
            spend(50.0)
        with pytest.raises(BudgetError, match="not found in bearable time"):
            spend(6.0)
    spend(1e12)
