"""The command `tradeoff`: options, files, faults, interruptions."""

import json
import os
import signal
import time

import pytest
from click.testing import CliRunner

from flywheel.cli import machines, main
from flywheel.pictures import tradeoffs as drawing
from flywheel.study import tradeoff as comparison
from tests.study.made import compared, row, whole

ROTOR = """
inertia = [{on = "crank", value = 1}]
load = [{on = "crank", torque = "-100 N m", from = 0, to = "180 deg"}]
drive = {torque = "balance"}
regime = {speed = "300 rpm"}
flywheel = {irregularity = 0.01}
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "rotor.toml"
    path.write_text(ROTOR, encoding="utf-8")
    return path


@pytest.fixture
def asked(monkeypatch):
    """What the comparison is called with; it is one made by hand."""
    calls = []

    def tradeoff(scene, rtol, *, budget, progress):
        calls.append((rtol, budget))
        progress(4, 9, "plain grid")
        return whole()

    monkeypatch.setattr(comparison, "tradeoff", tradeoff)
    return calls


def gives(monkeypatch, answer):
    def tradeoff(scene, rtol, **options):
        if isinstance(answer, BaseException):
            raise answer
        return answer

    monkeypatch.setattr(comparison, "tradeoff", tradeoff)


def run(*arguments):
    return CliRunner().invoke(main, ["tradeoff", *map(str, arguments)])


def test_a_comparison_is_told_as_text(scene):
    result = run(scene, "--budget", "0.01", "--rtol", "1e-6")
    assert result.exit_code == 0
    assert "reference  14.915494309189" in result.stdout
    assert "Accuracy against time: the exact flywheel, to a relative error of 1e-06" in result.stdout


def test_the_options_are_handed_on(scene, asked):
    assert run(scene).exit_code == 0
    assert run(scene, "--rtol", "1e-4", "--budget", "7").exit_code == 0
    assert asked == [(None, 60.0), (1e-4, 7.0)]


def test_json_stands_alone_on_standard_output(scene, asked):
    result = run(scene, "--json")
    assert json.loads(result.stdout)["cheapest"] == "exact, closed form, rtol 1e-06"
    assert result.stderr == "NOT WHOLE: 9 of 10 methods were run to their end within 60 s; --budget 120 runs more.\n"


@pytest.mark.slow
def test_a_picture_is_drawn(scene, monkeypatch, tmp_path):
    gives(monkeypatch, compared(row("plain grid")))
    picture = tmp_path / "errors.svg"
    result = run(scene, "--plot", picture)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "plain grid" in picture.read_text()


def test_a_picture_that_cannot_be_written_is_one_line(scene, monkeypatch, tmp_path):
    gives(monkeypatch, compared(row("plain grid")))
    result = run(scene, "--plot", tmp_path / "nowhere" / "errors.svg")
    assert result.exit_code == 1
    assert "cannot be written" in result.stderr
    assert result.stdout == ""  # known before anything is compared


def test_an_interrupted_comparison_is_told_and_drawn(scene, monkeypatch, tmp_path):
    gives(monkeypatch, compared(row("plain grid"), row("collocation", "", None), interrupted=True))
    drawn = []
    monkeypatch.setattr(drawing, "plot", lambda found, path: drawn.append(path))
    picture = tmp_path / "errors.svg"
    result = run(scene, "--plot", picture)
    assert (result.exit_code, drawn) == (130, [picture])
    assert result.stdout.endswith("NOT WHOLE: interrupted; 1 of 2 methods were run to their end.\n")


def test_an_interruption_before_anything_is_finished_is_one_line(scene, monkeypatch):
    gives(monkeypatch, KeyboardInterrupt())
    result = run(scene)
    assert (result.exit_code, result.stdout, result.stderr) == (130, "", "interrupted\n")


def test_a_comparison_that_a_signal_interrupts_tells_what_it_has(scene, monkeypatch):
    """The second of three methods sends the signal and waits for it."""

    def stop():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)

    every = comparison.methods
    stopping = comparison.Method("stopping", "", "stopping", stop)
    monkeypatch.setattr(comparison, "methods", lambda own: [every(own)[0], stopping, every(own)[1]])
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        done = run(scene)
    finally:
        signal.signal(signal.SIGINT, before)
    assert (done.exit_code, done.stderr) == (130, "")
    assert done.stdout.endswith("NOT WHOLE: interrupted; 1 of 3 methods were run to their end.\n")


def test_a_long_comparison_tells_what_is_run(scene, monkeypatch):
    monkeypatch.setattr(machines, "_QUIET", 0.0)
    told = []

    def tradeoff(scene, rtol, *, budget, progress):
        progress(4, 9, "plain grid, 36 angles")
        while not told:
            time.sleep(0.001)
        return whole()

    monkeypatch.setattr(machines.click, "echo", lambda text, err=False, nl=True: told.append(text) if err else None)
    monkeypatch.setattr(comparison, "tradeoff", tradeoff)
    assert run(scene).exit_code == 0
    assert told[0].startswith(("finding the reference", "5 of 9: plain grid, 36 angles"))
    assert "s of about 60 s)" in told[0]


def test_on_a_terminal_one_line_is_written_anew(capsys):
    progress = machines._Progress(60.0)
    progress.rewriting = True
    progress(0, 9, "plain grid " + 200 * "x")
    progress.tell()
    progress.tell()
    progress.erase()
    first, second, last = capsys.readouterr().err.split("\r\x1b[2K")[1:]
    assert first == second
    assert first.startswith("1 of 9: plain grid xxx")
    assert (len(first) < 200, last) == (True, "")


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ('areas = {values = [1, -1], scale = "1 J"}\nregime = {speed = 9}\nflywheel = {irregularity = 0.1}', "areas"),
        (ROTOR.replace('"-100 N m", from = 0, to = "180 deg"', '"-10*(t > 2)"'), "depends on time"),
        (ROTOR.replace("irregularity", "irregularities"), "irregularities"),
    ],
)
def test_refusals_are_lines(scene, text, word):
    scene.write_text(text, encoding="utf-8")
    result = run(scene)
    assert (result.exit_code, result.stdout) == (1, "")
    assert word in result.stderr
    assert all(line.startswith(f"{scene}: ") for line in result.stderr.splitlines())


@pytest.mark.parametrize(
    "options",
    [("--budget", "0"), ("--budget", "-1"), ("--budget", "nan"), ("--budget", "inf"), ("--rtol", "1"), ("--plot", "a.txt")],
)
def test_usage_is_checked(scene, options):
    result = run(scene, *options)
    assert (result.exit_code, result.stdout) == (2, "")
    assert options[0] in result.stderr
