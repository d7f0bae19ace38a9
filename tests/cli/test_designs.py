"""Sweeps, trade-offs and other comparisons of designs from the shell."""

import csv
import io
import itertools
import json
import os
import signal
import sys
import time

import numpy as np
import pytest
from click.testing import CliRunner

from flywheel import sweep as sweep_of
from flywheel.cli import machines, main, studies
from flywheel.designs import figures as designs
from flywheel.pictures import designs as drawing
from flywheel.study import tradeoff as comparison
from tests.extras import extra
from tests.study.test_comparison import compared, row, whole

# The commands sensitivities, tolerance and optimize: options, tables, data, pictures, faults.


ROTOR = """
load = [{on = "crank", torque = "-100 N m", from = 0, to = "180 deg"}]
drive = {torque = "balance"}
regime = {speed = "30 rad/s"}
flywheel = {irregularity = 0.01}
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "rotor.toml"
    path.write_text(ROTOR, encoding="utf-8")
    return path


def run_design(command, *arguments):
    return CliRunner().invoke(main, [command, *map(str, arguments)])


def test_sensitivities_as_a_table_of_80_columns(scene):
    result = run_design("sensitivities", scene, "regime.speed", "load.0.to")
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert max(map(len, lines)) <= 80
    assert "exact flywheel: 17.4533 kg m^2" in lines
    assert any(line.split() == ["regime.speed", "-1.16355", "kg", "m^2/(rad/s)", "-2"] for line in lines)


def test_sensitivities_as_data(scene):
    data = json.loads(run_design("sensitivities", scene, "regime.speed", "--json").stdout)
    assert data["figures"]["exact"]["derivatives"]["regime.speed"]["elasticity"] == pytest.approx(-2.0, rel=1e-8)
    assert data["numbers"]["regime.speed"] == {"value": 30.0, "unit": "rad/s"}


@pytest.mark.slow
def test_tolerance_of_intervals_and_of_deviations(scene):
    result = run_design("tolerance", scene, "--vary", "regime.speed=29:31", "--samples", 64, "--of", "power")
    assert (result.exit_code, result.stderr) == (0, "")
    assert any(
        line.split() == ["power", "1500", "1450", "-3.33", "%", "1550", "+3.33", "%", "W"]
        for line in result.stdout.splitlines()
    )
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert "power: of the drive at the mean of the extreme speeds." in result.stdout
    asked = ("--keep", "power<=1.6kW", "--quantile", 0.9)
    data = json.loads(
        run_design("tolerance", scene, "--vary", "load.0.torque=±2 N m", "--samples", 64, *asked, "--json").stdout
    )
    assert data["kept"]["probability"] == data["figures"]["power"]["kept"]["probability"]
    assert [each["share"] for each in data["figures"]["power"]["quantiles"]] == [0.9]
    assert (
        "Probability that a limit is kept" in run_design("tolerance", scene, "--vary", "regime.speed=29:31", *asked).stdout
    )
    assert data["figures"]["power"]["deviation"] == pytest.approx(30.0, rel=1e-3)
    assert data["figures"]["power"]["least"] is None


@pytest.mark.slow
def test_optimize_with_a_limit(scene):
    options = ("--over", "load.0.to=60deg:120deg", "--subject-to", "power>=0.6kW", "--starts", 1)
    result = run_design("optimize", scene, "--minimize", "flywheel.exact", *options)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "At a limit: 600 W <= power." in result.stdout
    assert any(line.split()[:3] == ["load.0.to", "72", "deg"] for line in result.stdout.splitlines())
    assert max(map(len, result.stdout.splitlines())) <= 80


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        ("sensitivities",),
        ("tolerance", "--vary", "regime.speed=29:31", "--vary", "load.0.to=170deg:180deg", "--samples", 64),
        ("optimize", "--maximize", "exact", "--over", "load.0.to=100deg:220deg", "--starts", 1),
    ],
)
def test_pictures_are_drawn(scene, options, tmp_path):
    picture = tmp_path / "designs.svg"
    result = run_design(options[0], scene, *options[1:], "--plot", picture)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "load.0.to" in picture.read_text(encoding="utf-8") or options[0] == "optimize"


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("sensitivities", "load.0.too"), 1, 'load.0.too: found no number of the scene, expected the path of one; did you'),
        (("sensitivities", "--of", "exakt"), 1, 'figures: found "exakt", expected a figure; did you mean "exact"?'),
        (("tolerance", "--vary", "load.0.to"), 2, "is not a PATH=LOW:HIGH"),
        (("tolerance", "--vary", "load.0.to=1kg:2kg"), 1, "load.0.to: found"),
        (("optimize", "--over", "load.0.to=1:2"), 2, "Give --minimize FIGURE or --maximize FIGURE."),
        (("optimize", "--minimize", "exact", "--over", "load.0.to=1:2", "--subject-to", "power"), 2, "is not a limit"),
        (("optimize", "--minimize", "exact", "--over", "load.0.to=2:1"), 1, "load.0.to: found bounds from 2 to 1"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line(scene, arguments, code, words):
    result = run_design(arguments[0], scene, *arguments[1:])
    assert (result.exit_code, result.stdout) == (code, "")
    assert words in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("command", ["tolerance", "sensitivities", "optimize", "sweep"])
def test_a_path_is_taken_as_a_fault_writes_it(scene, command):
    options = {
        "tolerance": ("--vary", "load[0].to=170deg:190deg", "--samples", 64, "--of", "power"),
        "sensitivities": ("load[0].to",),
        "optimize": ("--minimize", "power", "--over", "load[0].to=170deg:190deg", "--starts", 1),
        "sweep": ("--vary", "load[0].to=170deg:190deg:2"),
    }
    result = run_design(command, scene, *options[command])
    assert (result.exit_code, result.stderr) == (0, "")
    assert "load.0.to" in result.stdout


# The command `sweep`: numbers that vary, tables, files, faults, interruptions.


SWEEP_ROTOR = """
title = "Rotor"
load = [{on = "crank", torque = "-100 N m", from = 0, to = "180 deg"}]
drive = {torque = "balance"}
regime = {speed = "300 rpm"}
flywheel = {irregularity = 0.01}
"""
EPS, SPEED = "flywheel.irregularity", "regime.speed"


@pytest.fixture
def sweep_scene(tmp_path):
    path = tmp_path / "rotor.toml"
    path.write_text(SWEEP_ROTOR, encoding="utf-8")
    return path


def run_sweep(*arguments, engine="size"):
    return CliRunner().invoke(main, ["sweep", *map(str, arguments), "--engine", engine])


def test_all_combinations_are_told_in_eighty_columns(sweep_scene):
    result = run_sweep(
        sweep_scene, "--vary", f"{EPS}=1%:3%:3", "--vary", "load[0].from = 0 deg, 0.5 rad", "--vary", f"{SPEED}=300rpm"
    )
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[:2] == ["Rotor", "A sweep of 6 designs, on a grid of 3 x 2 x 1, to a relative error of 1e-10"]
    assert max(map(len, lines)) <= 80
    assert "The least flywheel: design 5" in lines
    table = lines[lines.index("The least flywheel: design 5") :]
    assert any(line.split()[:2] == ["5", "0.03"] for line in table)


def test_csv_on_standard_output_is_nothing_else(sweep_scene):
    result = run_sweep(sweep_scene, "--vary", f"{EPS}=0.01,-1", "--csv", "-")
    first, second = csv.DictReader(io.StringIO(result.stdout))
    assert float(first["exact [kg m^2]"]) == pytest.approx(15.915494309189533, rel=1e-10)
    assert second["exact [kg m^2]"] == second["needed"] == ""
    assert second["reason"] == "flywheel.irregularity: found -1.0, expected a value above 0 and below 2"
    assert "1 of 2 designs are refused" in result.stderr


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (["--vary", f"{EPS}=1%"], 0, ""),
        (["--vary", f"{EPS}=-1,-2"], 1, ""),
        ([], 2, "Missing option '--vary'"),
        (["--vary", f"{EPS}=1%:2%:3", "--samples", "4"], 2, "is not a PATH=LOW:HIGH, as --samples takes it"),
        (["--vary", f"{EPS}=1%", "--designs", "SCENE"], 2, "--vary excludes --designs"),
        (["--designs", "SCENE"], 1, "rotor.toml, line 2: found 1 cells"),
        (["--vary", EPS], 2, "is not a PATH=LOW:HIGH:COUNT"),
        (["--vary", f"{EPS}=1%:2%"], 2, "is not a PATH=LOW:HIGH:COUNT"),
        (["--vary", f"{EPS}=1%:2%:1"], 2, "not a count from 2"),
        (["--vary", "flywheel.ireg=1%:2%:3"], 1, '--vary flywheel.ireg: found no number of the scene, expected the path'),
        (["--vary", f"{SPEED}=1kg:2kg:3"], 1, 'regime.speed: found "1kg", expected a speed such as "210 rpm"'),
        (["--vary", f"{EPS}=1%", "--vary", f"{EPS}=2%"], 1, "found two columns, expected one --vary for each"),
        (["--vary", f"{EPS}=1%", "--npz", "a.txt"], 2, "does not end in .npz"),
        (["--vary", f"{EPS}=1%", "--jobs", "0"], 2, "--jobs"),
        (["--vary", f"{EPS}=1%", "--rtol", "1"], 2, "not from 1e-14 to 0.1"),
        (["--vary", f"{EPS}=1%", "--npz", "nowhere/a.npz"], 1, "there is no folder 'nowhere'"),
    ],
)  # fmt: skip
def test_exit_codes_and_lines(sweep_scene, options, code, message):
    result = run_sweep(sweep_scene, *(sweep_scene if word == "SCENE" else word for word in options))
    assert result.exit_code == code
    assert message in result.stderr
    assert code == 2 or len(result.stderr.splitlines()) == bool(message)


def test_a_table_that_could_not_be_written_is_refused_before_the_designs_are_sized(sweep_scene, tmp_path, monkeypatch):
    table = tmp_path / "mine.csv"
    table.write_text("flywheel.irregularity,mine\n1,2\n", encoding="utf-8")
    monkeypatch.setattr(designs, "sized", lambda *given: pytest.fail("designs were sized"))
    result = run_sweep(sweep_scene, "--vary", f"{EPS}=1%", "--vary", f"{SPEED}=300rpm", "--csv", table)
    assert result.exit_code == 1
    assert result.stderr.strip().endswith("give another name, or remove it first)")
    assert table.read_text(encoding="utf-8").startswith("flywheel.irregularity,mine")


def test_samples_and_designs_of_a_table_are_sized(sweep_scene, tmp_path):
    table, designs_file = tmp_path / "out.csv", tmp_path / "in.csv"
    result = run_sweep(sweep_scene, "--samples", 5, "--vary", f"{EPS}=1%:2%", "--vary", f"{SPEED}=300rpm", "--csv", table)
    assert (result.exit_code, result.stderr) == (0, "")
    rows = list(csv.DictReader(io.StringIO(table.read_text(encoding="utf-8"))))
    assert sorted(int((float(row[EPS]) - 0.01) / 0.002) for row in rows) == [0, 1, 2, 3, 4]
    designs_file.write_text(f"{EPS},{SPEED} [rpm]\n1 %,300\n2 %,150\n", encoding="utf-8")
    result = run_sweep(sweep_scene, "--designs", designs_file, "--csv", "-")
    exact = [float(row["exact [kg m^2]"]) for row in csv.DictReader(io.StringIO(result.stdout))]
    assert exact == pytest.approx([15.915494309189533, 2 * 15.915494309189533], rel=1e-10)


def test_a_parquet_file_of_another_is_refused_before_the_designs_are_sized(sweep_scene, tmp_path, monkeypatch):
    parquet, arrow = extra("pyarrow.parquet"), extra("pyarrow")
    parquet.write_table(arrow.table({"a": [1]}), tmp_path / "mine.parquet")
    monkeypatch.setattr(designs, "sized", lambda *given: pytest.fail("designs were sized"))
    result = run_sweep(
        *(sweep_scene, "--vary", f"{EPS}=1%", "--csv", tmp_path / "a.csv", "--npz", tmp_path / "a.npz"),
        *("--parquet", tmp_path / "mine.parquet"),
    )
    assert result.exit_code == 1
    refusal = f"{tmp_path / 'mine.parquet'}: cannot be written (it exists already and is not this sweep's"
    assert result.stderr.startswith(refusal)
    assert [each.name for each in tmp_path.iterdir() if each.suffix in (".csv", ".npz")] == []


def test_no_file_of_the_user_is_replaced(sweep_scene, tmp_path):
    text = sweep_scene.read_text(encoding="utf-8")
    assert run_sweep(sweep_scene, "--vary", f"{EPS}=1%", "--csv", sweep_scene).exit_code == 2
    mine = tmp_path / "mine.npz"
    np.savez(mine, a=np.zeros(1))
    before = mine.read_bytes()
    result = run_sweep(sweep_scene, "--vary", f"{EPS}=1%", "--npz", mine)
    assert result.exit_code == 1
    assert "give another name" in result.stderr
    assert mine.read_bytes() == before
    assert sweep_scene.read_text(encoding="utf-8") == text


def test_a_sweep_goes_on_from_its_file_and_no_other_does(sweep_scene, tmp_path):
    file = tmp_path / "a.npz"
    first = run_sweep(sweep_scene, "--vary", f"{EPS}=1%:2%:3", "--npz", file)
    again = run_sweep(sweep_scene, "--vary", f"{EPS}=1%:2%:3", "--npz", file)
    assert first.exit_code == again.exit_code == 0
    assert first.stdout == again.stdout
    other = run_sweep(sweep_scene, "--vary", f"{EPS}=1%:2%:3", "--npz", file, "--rtol", "1e-8")
    assert other.exit_code == 1
    assert other.stderr == (
        f"{file}: found a sweep of another rtol 1e-10, expected one of this rtol 1e-08; "
        "give another file, or remove this one\n"
    )


def test_an_interrupted_sweep_says_what_is_missing(sweep_scene, tmp_path, monkeypatch):
    def interrupted(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr(designs, "sized", interrupted)
    result = run_sweep(sweep_scene, "--vary", f"{EPS}=1%:2%:3", "--npz", tmp_path / "a.npz")
    assert result.exit_code == 130
    assert "interrupted: 3 of 3 designs are missing; the same sweep goes on from" in " ".join(result.stdout.split())


def test_a_sweep_is_written_as_parquet_with_its_units(sweep_scene, tmp_path):
    parquet = extra("pyarrow.parquet")
    files = tmp_path / "a.csv", tmp_path / "a.parquet"
    result = run_sweep(sweep_scene, "--vary", f"{EPS}=1%:2%:3", "--csv", files[0], "--parquet", files[1])
    assert (result.exit_code, result.stderr) == (0, "")
    header, *rows = csv.reader(io.StringIO(files[0].read_text(encoding="utf-8")))
    table = parquet.read_table(files[1])
    units = [(field.metadata or {}).get(b"unit", b"").decode() for field in table.schema]
    assert [f"{name} [{unit}]" if unit else name for name, unit in zip(table.column_names, units, strict=True)] == header
    exact = header.index("exact [kg m^2]")
    assert table["exact"].to_pylist() == [float(row[exact]) for row in rows]


def test_parquet_without_pyarrow_or_under_another_ending(sweep_scene, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setattr(designs, "sized", None)  # it is said before anything is sized
    file = tmp_path / "a.parquet"
    result = run_sweep(sweep_scene, "--vary", f"{EPS}=1%", "--parquet", file)
    output = "--parquet: found no pyarrow, expected pyarrow, which it needs; pip install pyarrow\n"
    assert (result.exit_code, result.stdout, result.stderr, file.exists()) == (1, "", output, False)
    assert "does not end in .parquet" in run_sweep(sweep_scene, "--vary", f"{EPS}=1%", "--parquet", "a.csv").stderr


# Ctrl-C: a real signal to this process, sent when so many designs have been sized one by one.


@pytest.fixture
def interrupted(monkeypatch):
    """Runs a command that the signal interrupts in the sizing of that number."""

    def run(after, *arguments):
        own, count = designs.size, itertools.count(1)

        def counted(*given, **options):
            if next(count) == after:
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(60)
            return own(*given, **options)

        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            with monkeypatch.context() as patch:
                patch.setattr(designs, "size", counted)
                return CliRunner().invoke(main, [*map(str, arguments), "--engine", "size"])
        finally:
            signal.signal(signal.SIGINT, before)

    return run


def test_an_optimum_that_a_signal_interrupts_is_the_best_design_until_then(scene, interrupted):
    over = ("--over", "load.0.to=10deg:170deg", "--maximize", "energy_fluctuation", "--json")
    for after in (8, 68):  # in the survey, in a search
        done = interrupted(after, "optimize", scene, *over)
        data = json.loads(done.stdout)
        assert (done.exit_code, data["interrupted"], data["confirmed"]) == (130, True, False)
        assert "interrupted: the best of " in done.stderr
        to = data["numbers"]["load.0.to"]["value"]
        assert 2.0 < to <= np.radians(170.0) * (1 + 1e-12)
        assert data["value"] == pytest.approx(100.0 * to * (1 - to / (2 * np.pi)), rel=1e-9)


def test_a_tolerance_that_a_signal_interrupts_is_that_of_the_designs_until_then(scene, interrupted):
    vary = ("--vary", "regime.speed=29:31", "--of", "power", "--samples", 64, "--json")
    done = interrupted(42, "tolerance", scene, *vary)
    data = json.loads(done.stdout)
    assert (done.exit_code, done.stderr, data["interrupted"], data["samples"]) == (130, "", True, 40)
    assert data["messages"] == [
        "interrupted: 40 of 128 samples were sized",
        "interrupted: least and greatest values are those of the designs until then",
    ]
    power = data["figures"]["power"]
    assert 1450.0 <= power["least"]["value"] < 1500.0 < power["greatest"]["value"] <= 1550.0
    assert power["mean"] == pytest.approx(1500.0, abs=5.0)


def test_designs_at_once_are_kept_portion_by_portion(scene, monkeypatch):
    own, count = designs.at_once, itertools.count(1)

    def ended(*given, **options):
        if next(count) == 4:  # after the scene's own and two portions
            raise KeyboardInterrupt
        return own(*given, **options)

    monkeypatch.setattr(designs, "at_once", ended)
    monkeypatch.setattr(designs, "_PORTION", 50)
    vary = ("--vary", "regime.speed=29:31", "--of", "power", "--samples", "64", "--json")
    done = CliRunner().invoke(main, ["tolerance", str(scene), *vary])
    assert (done.exit_code, json.loads(done.stdout)["messages"][0]) == (130, "interrupted: 100 of 128 samples were sized")


def test_a_command_that_a_signal_interrupts_before_it_has_anything_is_one_line(scene, interrupted):
    for command in (("tolerance", scene, "--vary", "regime.speed=29:31"), ("sensitivities", scene, "regime.speed")):
        done = interrupted(3, *command)
        assert (done.exit_code, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_the_command_offers_the_engines_of_the_library():
    option = next(each for each in studies.sweep.params if each.name == "engine")
    assert tuple(option.type.choices) == designs.ENGINES
    assert sweep_of.__kwdefaults__["engine"] is None


# The command `tradeoff`: options, files, faults, interruptions.


TRADEOFF_ROTOR = """
inertia = [{on = "crank", value = 1}]
load = [{on = "crank", torque = "-100 N m", from = 0, to = "180 deg"}]
drive = {torque = "balance"}
regime = {speed = "300 rpm"}
flywheel = {irregularity = 0.01}
"""


@pytest.fixture
def tradeoff_scene(tmp_path):
    path = tmp_path / "rotor.toml"
    path.write_text(TRADEOFF_ROTOR, encoding="utf-8")
    return path


@pytest.fixture
def asked(monkeypatch):
    """Arguments of the comparison, which is one made by hand."""
    calls = []

    def tradeoff(tradeoff_scene, rtol, *, budget, progress):
        calls.append((rtol, budget))
        progress(4, 9, "plain grid")
        return whole()

    monkeypatch.setattr(comparison, "tradeoff", tradeoff)
    return calls


def gives(monkeypatch, answer):
    def tradeoff(tradeoff_scene, rtol, **options):
        if isinstance(answer, BaseException):
            raise answer
        return answer

    monkeypatch.setattr(comparison, "tradeoff", tradeoff)


def run_tradeoff(*arguments):
    return CliRunner().invoke(main, ["tradeoff", *map(str, arguments)])


def test_a_comparison_is_told_as_text(tradeoff_scene):
    result = run_tradeoff(tradeoff_scene, "--budget", "0.01", "--rtol", "1e-6")
    assert result.exit_code == 0
    assert "reference  14.915494309189" in result.stdout
    assert "Accuracy against time: the exact flywheel, to a relative error of 1e-06" in result.stdout


def test_the_options_are_handed_on(tradeoff_scene, asked):
    assert run_tradeoff(tradeoff_scene).exit_code == 0
    assert run_tradeoff(tradeoff_scene, "--rtol", "1e-4", "--budget", "7").exit_code == 0
    assert asked == [(None, 60.0), (1e-4, 7.0)]


def test_json_stands_alone_on_standard_output(tradeoff_scene, asked):
    result = run_tradeoff(tradeoff_scene, "--json")
    assert json.loads(result.stdout)["cheapest"] == "exact, closed form, rtol 1e-06"
    assert result.stderr == "INCOMPLETE: 9 of 10 methods were run to completion within 60 s; --budget 120 runs more.\n"


@pytest.mark.slow
def test_a_picture_is_drawn(tradeoff_scene, monkeypatch, tmp_path):
    gives(monkeypatch, compared(row("plain grid")))
    picture = tmp_path / "errors.svg"
    result = run_tradeoff(tradeoff_scene, "--plot", picture)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "plain grid" in picture.read_text()


def test_a_picture_that_cannot_be_written_is_one_line(tradeoff_scene, monkeypatch, tmp_path):
    gives(monkeypatch, compared(row("plain grid")))
    result = run_tradeoff(tradeoff_scene, "--plot", tmp_path / "nowhere" / "errors.svg")
    assert result.exit_code == 1
    assert "cannot be written" in result.stderr
    assert result.stdout == ""  # known before anything is compared


def test_an_interrupted_comparison_is_told_and_drawn(tradeoff_scene, monkeypatch, tmp_path):
    gives(monkeypatch, compared(row("plain grid"), row("collocation", "", None), interrupted=True))
    drawn = []
    monkeypatch.setattr(drawing, "plot_tradeoff", lambda found, path: drawn.append(path))
    picture = tmp_path / "errors.svg"
    result = run_tradeoff(tradeoff_scene, "--plot", picture)
    assert (result.exit_code, drawn) == (130, [picture])
    assert result.stdout.endswith("INCOMPLETE: interrupted; 1 of 2 methods were run to completion.\n")


def test_an_interruption_before_anything_is_finished_is_one_line(tradeoff_scene, monkeypatch):
    gives(monkeypatch, KeyboardInterrupt())
    result = run_tradeoff(tradeoff_scene)
    assert (result.exit_code, result.stdout, result.stderr) == (130, "", "interrupted\n")


def test_a_comparison_that_a_signal_interrupts_tells_what_it_has(tradeoff_scene, monkeypatch):
    """The second of three methods sends the signal and waits for it."""

    def stop():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)

    every = comparison.methods
    stopping = comparison.StudyMethod("stopping", "", "stopping", stop)
    monkeypatch.setattr(comparison, "methods", lambda own: [every(own)[0], stopping, every(own)[1]])
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        done = run_tradeoff(tradeoff_scene)
    finally:
        signal.signal(signal.SIGINT, before)
    assert (done.exit_code, done.stderr) == (130, "")
    assert done.stdout.endswith("INCOMPLETE: interrupted; 1 of 3 methods were run to completion.\n")


def test_a_long_comparison_tells_what_is_run(tradeoff_scene, monkeypatch):
    monkeypatch.setattr(machines, "_QUIET", 0.0)
    output = []

    def tradeoff(tradeoff_scene, rtol, *, budget, progress):
        progress(4, 9, "plain grid, 36 angles")
        while not output:
            time.sleep(0.001)
        return whole()

    monkeypatch.setattr(machines.click, "echo", lambda text, err=False, nl=True: output.append(text) if err else None)
    monkeypatch.setattr(comparison, "tradeoff", tradeoff)
    assert run_tradeoff(tradeoff_scene).exit_code == 0
    assert output[0].startswith(("finding the reference", "5 of 9: plain grid, 36 angles"))
    assert "s of about 60 s)" in output[0]


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
        (TRADEOFF_ROTOR.replace('"-100 N m", from = 0, to = "180 deg"', '"-10*(t > 2)"'), "depends on time"),
        (TRADEOFF_ROTOR.replace("irregularity", "irregularities"), "irregularities"),
    ],
)
def test_refusals_are_lines(tradeoff_scene, text, word):
    tradeoff_scene.write_text(text, encoding="utf-8")
    result = run_tradeoff(tradeoff_scene)
    assert (result.exit_code, result.stdout) == (1, "")
    assert word in result.stderr
    assert all(line.startswith(f"{tradeoff_scene}: ") for line in result.stderr.splitlines())


@pytest.mark.parametrize(
    "options",
    [("--budget", "0"), ("--budget", "-1"), ("--budget", "nan"), ("--budget", "inf"), ("--rtol", "1"), ("--plot", "a.txt")],
)
def test_usage_is_checked(tradeoff_scene, options):
    result = run_tradeoff(tradeoff_scene, *options)
    assert (result.exit_code, result.stdout) == (2, "")
    assert options[0] in result.stderr
