"""The program as a user calls it: options, messages, exit codes, what it imports, what is public."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner, Result

import flywheel
from flywheel.cli import main
from flywheel.scene.scene import LEVELS
from flywheel.starters import starter
from tests.limits import sample
from tests.scenes import yoke

# The command line: exit codes, streams, files, and how little it imports.


SCENES = Path(__file__).parents[1] / "references" / "scenes"
ROOT = Path(__file__).parents[2]

YOKE = """
title = "Yoke"
mechanism = {type = "scotch-yoke", crank = {length = "0.5 m"}, yoke = {mass = 20}}
load = [{on = "yoke", force = "1000 N", from = 0, to = "180 deg"}]
drive = {torque = "balance"}
regime = {speed = "60 rpm"}
flywheel = {irregularity = 0.04}
"""


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "yoke.toml"
    path.write_text(YOKE)
    return path


# -- size ------------------------------------------------------------------------------------------------------------


def test_json_is_the_library_s_dictionary_alone_on_standard_output(scene: Path) -> None:
    import flywheel

    result = run("size", scene, "--json", "--no-simulate")
    assert result.exit_code == 0
    data = json.loads(result.stdout)
    own = json.loads(json.dumps(flywheel.size(flywheel.load(yoke(title="Yoke")), simulate=False).as_dict()))
    assert data.pop("cost")["evaluations"] == own.pop("cost")["evaluations"]  # its seconds are never the same
    assert data == own


def test_json_has_every_key_of_the_contract(scene: Path) -> None:
    data = json.loads(run("size", scene, "--json").stdout)
    keys = (
        "title reduction cycle speed speed_asked irregularity balance power areas accumulated_max accumulated_min "
        "energy_fluctuation coefficient_of_energy angle_speed_max angle_speed_min reduced_inertia flywheel simulation "
        "error"
    )
    assert set(keys.split()) <= set(data)
    assert set(data["areas"][0]) == {"from", "to", "work", "accumulated"}
    assert set(data["reduced_inertia"]) == {"min", "max", "mean"}
    assert data["simulation"]["irregularity"] == pytest.approx(0.04, rel=1e-8)
    wheel = data["flywheel"]
    assert {"on", "inertia", "exact", "approximate", "approximate_total", "inertia_torque", "needed"} <= set(wheel)


@pytest.mark.parametrize("path", sample(sorted(SCENES.glob("*.toml")), 6), ids=lambda path: path.stem)
def test_json_of_every_scene_is_strict(path: Path) -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    result = run("size", path, "--json", "--no-simulate")
    assert result.exit_code == 0, result.stderr
    json.loads(result.stdout, parse_constant=refuse)


@pytest.mark.parametrize("command", ["size", "power", "simulate", "motion", "reactions", "report -o r.html"])
def test_faults_and_remarks_are_in_the_language_asked_for(tmp_path: Path, command: str) -> None:
    name, *options = command.split()
    scene = tmp_path / "press.toml"
    scene.write_text(YOKE.replace('"0.5 m"', '"-0.5 m"').replace("irregularity", "iregularity"), "utf-8")
    lines = run(name, scene, *options, "--language", "es").stderr.splitlines()
    assert len(lines) == 2
    assert lines[0] == f'{scene}: mechanism.crank.length (línea 3): hay "-0.5 m", se esperaba un valor mayor que 0 m'
    assert lines[1].endswith('hay la clave "iregularity", se esperaba una clave conocida; ¿quería decir "irregularity"?')
    assert "expected" in run(name, scene, *options).stderr


def test_faults_are_lines_with_file_and_path(tmp_path: Path) -> None:
    path = tmp_path / "press.toml"
    path.write_text(YOKE.replace('"0.5 m"', '"0.5 kg"').replace("0.04", "-1"))
    result = run("size", path)
    assert result.exit_code == 1
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert len(lines) == 2
    assert all(line.startswith(f"{path}: ") for line in lines)
    places = {"mechanism.crank.length (line 3)", "flywheel.irregularity (line 7)"}
    assert {line.split(": ")[1] for line in lines} == places
    assert all("found" in line and "expected" in line for line in lines)


@pytest.mark.parametrize("content", [None, "", "not toml", "[regime]\nspeed = "])
def test_a_file_that_is_no_scene_is_one_line(content: str | None, tmp_path: Path) -> None:
    path = tmp_path / "odd.toml"
    if content is not None:
        path.write_text(content)
    result = run("size", path)
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert re.match(rf"{re.escape(str(path))}( \(line \d+, column \d+\))?: found", line)
    assert line.count("odd.toml") == 1


def test_a_machine_that_cannot_run_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "open.toml"
    path.write_text(YOKE.replace('torque = "balance"', 'torque = "1 N m"'))
    result = run("size", path)
    assert result.exit_code == 1
    assert "net work" in result.stderr
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["--rtol", "nan"],
        ["--rtol", "0"],
        ["--rtol", "-1e-9"],
        ["--rtol", "1"],
        ["--rtol", "much"],
        ["--accuracy", "exact"],
        ["--accuracy", "audit", "--no-simulate"],
        ["--plot", "plot.jpg"],
        ["--plot", "plot"],
        ["--loud"],
        ["another.toml"],
    ],
)
def test_usage_errors_come_before_any_work(arguments: list[str]) -> None:
    result = run("size", "missing.toml", *arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "missing.toml" not in result.stderr.replace("another.toml", "")


@pytest.mark.slow
def test_the_levels_of_accuracy(scene: Path) -> None:
    result = {level: json.loads(run("size", scene, "--json", "--accuracy", level).stdout) for level in LEVELS}
    assert {level: data["accuracy"] for level, data in result.items()} == {level: level for level in LEVELS} | {
        "fast": "normal"
    }
    assert result["fast"]["flywheel"] == result["normal"]["flywheel"]
    routes = [data["simulation"] and data["simulation"]["route"] for data in result.values()]
    assert routes == [None, None, "collocation", "time", None]
    assert json.loads(run("size", scene, "--json").stdout)["accuracy"] == "audit"


def test_no_simulate_is_normal_and_may_be_said_twice(scene: Path) -> None:
    alone, both = (run("size", scene, "--no-simulate", *more) for more in ([], ["--accuracy", "normal"]))
    assert alone.exit_code == both.exit_code == 0
    assert alone.stdout == both.stdout
    assert "NOT confirmed at accuracy normal" in alone.stdout


def test_another_level_is_refused_with_those_that_are(scene: Path) -> None:
    result = run("size", scene, "--accuracy", "quick")
    assert result.exit_code == 2
    assert all(level in result.stderr for level in LEVELS)


def test_explain_follows_the_report(scene: Path) -> None:
    plain, output = (run("size", scene, "--accuracy", "normal", *more).stdout for more in ([], ["--explain"]))
    assert output.startswith(plain)
    assert "Method of solution (normal)" in output[len(plain) :]
    assert "bodies without mass or inertia: scotch-yoke.crank" in output
    assert "Cost, without" in output


def test_a_plot_that_cannot_be_written_is_one_line(scene: Path, tmp_path: Path) -> None:
    result = run("size", scene, "--no-simulate", "--json", "--plot", tmp_path / "no" / "plot.png")
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"{tmp_path / 'no' / 'plot.png'}: cannot be written")
    assert result.stdout == ""  # known before anything is computed


# -- reduce ----------------------------------------------------------------------------------------------------------


def test_reduce_is_csv_with_units_and_full_precision(scene: Path) -> None:
    result = run("reduce", scene, "--points", 8)
    assert result.exit_code == 0
    rows = list(csv.DictReader(result.stdout.splitlines()))
    assert len(rows) == 8
    for k, row in enumerate(rows):
        phi = k * math.pi / 4
        assert float(row["phi [rad]"]) == phi
        assert float(row["phi [deg]"]) == pytest.approx(45 * k)
        assert float(row["g scotch-yoke.yoke [m]"]) == pytest.approx(-0.5 * math.sin(phi), abs=1e-15)
        assert float(row["dg/dphi scotch-yoke.yoke [m]"]) == pytest.approx(-0.5 * math.cos(phi), abs=1e-15)
        assert float(row["I* [kg m^2]"]) == pytest.approx(5 * math.sin(phi) ** 2, abs=1e-14)
        assert float(row["dI*/dphi [kg m^2]"]) == pytest.approx(5 * math.sin(2 * phi), abs=1e-14)
        push = -500 * math.sin(phi) if k < 4 else 0.0
        assert float(row["M* [N m]"]) == pytest.approx(500 / math.pi + push, abs=1e-9)
    assert "-0.0" not in result.stdout.replace("-0.0000", "").split(",")


def test_reduce_at_given_angles_as_json(scene: Path) -> None:
    data = json.loads(run("reduce", scene, "--json", "--at", "30 deg", "--at", "-1.5 rad").stdout)
    assert data["phi"] == pytest.approx([math.pi / 6, -1.5])
    assert data["inertia"] == pytest.approx([1.25, 5 * math.sin(1.5) ** 2])
    assert data["balance"] == {"name": "drive", "value": pytest.approx(500 / math.pi)}
    assert set(data["gains"]) == set(data["gain_slopes"]) == {"crank", "scotch-yoke.yoke"}


def test_reduce_writes_a_file(scene: Path, tmp_path: Path) -> None:
    target = tmp_path / "table.csv"
    result = run("reduce", scene, "--points", 3, "--output", target)
    assert (result.exit_code, result.stdout) == (0, "")
    assert target.read_text() == run("reduce", scene, "--points", 3).stdout
    assert run("reduce", scene, "--output", tmp_path / "no" / "table.csv").exit_code == 1


@pytest.mark.parametrize(
    "arguments",
    [["--json", "--csv"], ["--points", "0"], ["--points", "4", "--at", "1 rad"], ["--at", "30"], ["--at", "3 kg"]],
)
def test_reduce_usage(scene: Path, arguments: list[str]) -> None:
    result = run("reduce", scene, *arguments)
    assert result.exit_code == 2
    assert result.stdout == ""


def test_areas_cannot_be_reduced() -> None:
    result = run("reduce", SCENES / "areas-sizing.toml")
    assert result.exit_code == 1
    assert "areas (line 2): found a diagram of areas" in result.stderr


# -- new, reference, the rest ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["slider-crank", "rotor", "areas", "press"])
def test_new_writes_a_scene_that_sizes(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("new", kind).exit_code == 0
    path = tmp_path / f"{kind}.toml"
    assert "#" in path.read_text()
    result = run("size", path, "--no-simulate")
    assert result.exit_code == 0, result.stderr


def test_new_never_overwrites(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("precious")
    result = run("new", "press", path)
    assert result.exit_code == 1
    assert path.read_text() == "precious"
    (line,) = result.stderr.splitlines()
    assert line.startswith(str(path))


def test_new_into_a_missing_folder_is_one_line(tmp_path: Path) -> None:
    result = run("new", "press", tmp_path / "no" / "mine.toml")
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 1


def test_new_prints_or_lists() -> None:
    assert "[flywheel]" in run("new", "press", "-").stdout
    assert {"press", "rotor", "scotch-yoke"} <= set(run("new").stdout.split())


@pytest.mark.parametrize(("command", "wrong", "right"), [("new", "pres", "press"), ("reference", "gravty", "gravity")])
def test_wrong_names_are_usage_errors_with_the_nearest(command: str, wrong: str, right: str) -> None:
    result = run(command, wrong)
    assert result.exit_code == 2
    assert f"did you mean '{right}'?" in result.stderr


def test_reference_has_every_topic() -> None:
    from flywheel.reference import topics

    overview = run("reference").stdout
    for topic in topics():
        result = run("reference", topic)
        assert result.exit_code == 0
        assert result.stdout.startswith("#")
        assert topic in overview


def test_version() -> None:
    result = run("--version")
    assert result.exit_code == 0
    assert result.stdout.startswith("flywheel")


# -- as processes ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", sample(["reference", "reduce"], 2))
def test_a_closed_pipe_leaves_no_traceback(command: str, scene: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    try:
        arguments = [command, *([str(scene), "--points", "2000"] if command == "reduce" else [])]
        line, environment = [sys.executable, "-m", "flywheel", *arguments], os.environ | {"PYTHONPATH": str(ROOT)}
        result = subprocess.run(line, stdout=writer, stderr=subprocess.PIPE, text=True, env=environment, timeout=600)
        assert result.stderr == ""
    finally:
        os.close(writer)


def test_an_interrupt_leaves_no_traceback(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("flywheel.sizing.sizing.size", interrupted)
    result = run("size", scene)
    assert (result.exit_code, result.stdout, result.stderr) == (130, "", "interrupted\n")
    assert isinstance(result.exception, SystemExit)


def test_an_encoding_without_the_signs_prints_all_the_same(scene: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "latin-1"}
    command = [sys.executable, "-m", "flywheel", "reference", "quantities"]
    result = subprocess.run(command, capture_output=True, env=environment, timeout=600)
    assert result.returncode == 0
    assert b"?" in result.stdout


# -- files that are written ------------------------------------------------------------------------------------------------

TABLE = (
    'regime.speed = 10\nflywheel.irregularity = "2 %"\ndrive.torque = "balance"\n'
    '[[load]]\non = "crank"\ntable = { file = "load.csv" }\n'
)


@pytest.mark.parametrize(
    ("arguments", "target"),
    [
        (["size", "--no-simulate", "--plot"], "s.svg"),
        (["draw", "-o"], "hard.svg"),
        (["graph", "--plot"], "folder/../soft.svg"),
        (["tradeoff", "--plot"], "s.svg"),
        (["reactions", "--csv", "--output"], "soft.svg"),
        (["reduce", "--output"], "load.csv"),
        (["simulate", "--csv"], "hard.csv"),
    ],
)
def test_no_output_replaces_an_input(
    arguments: list[str], target: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    table = "phi [rad],omega [rad/s],alpha [rad/s^2]\n0,-3,0\n6.283185307179586,-3,0\n"
    Path("s.svg").write_text(TABLE)
    Path("load.csv").write_text(table)
    Path("folder").mkdir()
    os.link("s.svg", "hard.svg")
    os.symlink("s.svg", "soft.svg")
    os.link("load.csv", "hard.csv")
    result = CliRunner().invoke(main, [arguments[0], "s.svg", *arguments[1:], target])
    assert result.exit_code == 2
    assert target in result.stderr
    assert Path("s.svg").read_text() == TABLE
    assert Path("load.csv").read_text() == table
    assert len(list(tmp_path.iterdir())) == 6


def test_no_file_is_named_for_two_outputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    press = str(ROOT / "examples" / "machines" / "press.toml")
    result = CliRunner().invoke(main, ["simulate", press, "--csv", "new.csv", "--output", "./new.csv"])
    assert result.exit_code == 2
    assert "is named for two outputs" in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "name", "content"),
    sample(
        [
            (["draw", "-o"], "a.png", "GIF89a..."),
            (["reduce", "--output"], "a.csv", "phi,M\n1,2\n"),
            (["reduce", "--json", "--output"], "a.json", '{"title": 1, "mine": 2}'),
            (["reactions", "--output"], "a.txt", "a letter\n"),
        ],
        2,
    ),
)
def test_what_is_there_is_replaced_only_by_its_like(
    arguments: list[str], name: str, content: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text(starter("slider-crank"))
    command = [arguments[0], "s.toml", *arguments[1:], name]
    Path(name).write_text(content)
    refused = CliRunner().invoke(main, command)
    assert refused.exit_code == 1
    assert refused.stderr.splitlines()[-1].startswith(f"{name}: cannot be written (it exists already and ")
    assert Path(name).read_text() == content
    picture = name.endswith(".png")
    Path(name).write_bytes(b"\x89PNG\r\n\x1a\n" if picture else b"")
    for _ in range(1 if picture else 2):  # the second time over the first
        assert CliRunner().invoke(main, command).exit_code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([name, "s.toml"])


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize(("arguments", "closed"), [(["--help"], True), (["reference"], False), (["new"], False)])
def test_output_that_goes_nowhere_is_no_success(arguments: list[str], closed: bool) -> None:
    command = f"{sys.executable} -m flywheel {' '.join(arguments)} {'>&-' if closed else '>/dev/full'}"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    result = subprocess.run(command, shell=True, stderr=subprocess.PIPE, text=True, env=environment, timeout=120)
    reason = "it is closed" if closed else "No space left on device"
    assert (result.returncode, result.stderr) == (1, f"standard output: cannot be written ({reason})\n")


def test_a_scene_that_is_no_file_is_named_as_what_it_is(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "link.toml").symlink_to("nowhere")
    (tmp_path / "file").write_text("")
    for name, outcome in (
        ("pipe.toml", "a pipe"),
        ("link.toml", "a broken link"),
        ("", "a folder"),
        ("no/s.toml", 'no such file, for there is no folder "no"'),
        ("file/s.toml", 'no such file, for "file" is no folder'),
    ):
        result = CliRunner().invoke(main, ["size", str(tmp_path / name)])
        assert result.exit_code == 1
        assert result.stderr == f"{tmp_path / name}: found {outcome}, expected a scene in a TOML file\n"
    result = CliRunner().invoke(main, ["size", "."])
    assert (result.exit_code, result.stderr) == (1, ".: found a folder, expected a scene in a TOML file\n")
    (tmp_path / "s.toml").write_text(starter("slider-crank"))
    result = CliRunner().invoke(main, ["reduce", str(tmp_path / "s.toml"), "--output", str(tmp_path / "pipe.toml")])
    assert (result.exit_code, "it is a pipe without a reader" in result.stderr) == (1, True)


# What a command loads: the heavy libraries and parts come in by five doors, and only where they are needed.


REPOSITORY = Path(flywheel.__file__).parents[1]
PRESS = "examples/machines/press.toml"
DOORS = ("scipy", "sympy", "matplotlib", "flywheel.mechanisms.linkages", "flywheel.pictures")
PARTS = ("flywheel.machine", "flywheel.sizing", "flywheel.study", "flywheel.designs", "bondgraph")


def loaded(*steps: str) -> list[set[str]]:
    """The modules of one process after each of these steps, lines of Python or commands of the program."""
    code = "import sys\n"
    for step in steps:
        line = step if step.startswith("import") else f"main({step.split()}, standalone_mode=False)"
        code += f"{line}\nprint('loaded', *sys.modules, file=sys.stderr)\n"
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, capture_output=True, text=True, check=True, cwd=REPOSITORY, env=environment, timeout=600)
    return [set(line.split()) for line in run.stderr.splitlines() if line.startswith("loaded")]


SETTINGS = """
import importlib, locale, os, pathlib, sys, warnings
import numpy
def settings():
    return (list(sys.meta_path), list(sys.path), list(sys.path_hooks), list(warnings.filters), numpy.geterr(),
            locale.setlocale(locale.LC_ALL), dict(os.environ), sys.getrecursionlimit())
before, found = settings(), {}
import flywheel, bondgraph
for name in ("duty", "wheel", "energy", "motors", "arm", "linkage", "report", "scene", "graph", "elements"):
    try:
        found[name] = importlib.import_module(name)
    except ModuleNotFoundError:
        pass
assert not found, found
assert settings() == before
"""
"""Settings of Python, numpy and the system, before and after the import."""


def test_an_import_changes_nothing_outside_and_leaves_the_names_of_the_users_own_files_to_them(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    subprocess.run([sys.executable, "-c", SETTINGS], check=True, cwd=tmp_path, env=environment, timeout=600)
    for name in ("duty", "wheel", "energy", "motors", "arm"):
        (tmp_path / f"{name}.py").write_text("mine = True\n", encoding="utf-8")
    own = "import flywheel, bondgraph, duty, wheel, energy, motors, arm; assert duty.mine and wheel.mine and motors.mine"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join((str(tmp_path), str(REPOSITORY)))}
    subprocess.run([sys.executable, "-c", own], check=True, cwd=tmp_path, env=environment, timeout=600)


@pytest.mark.slow
def test_the_library_and_its_commands_open_only_the_doors_that_they_need(tmp_path: Path) -> None:
    library, _, output, sized, plotted, drawn, arm = loaded(
        "import flywheel",
        "import flywheel.cli; from flywheel.cli import main",
        "tradeoff --help",
        f"size {PRESS} --accuracy normal --json",
        f"size {PRESS} --accuracy normal --plot {tmp_path}/sizing.svg",
        f"draw {PRESS} -o {tmp_path}/press.svg",
        "import flywheel.arm",
    )
    assert [name for name in library if name.startswith("flywheel.")] == []
    assert library.isdisjoint(("numpy", "scipy", "sympy", "matplotlib", "mpmath"))
    assert "click" in output
    assert output.isdisjoint((*DOORS, *PARTS))
    assert sized.isdisjoint(DOORS)
    assert plotted.isdisjoint(("scipy", "sympy", DOORS[3]))
    assert "flywheel.pictures" in drawn
    assert "sympy" not in drawn
    assert "flywheel.arm" in arm
    assert "sympy" not in arm


@pytest.mark.slow
def test_a_flywheel_that_is_confirmed_opens_no_door() -> None:
    _, confirmed = loaded("import flywheel.cli; from flywheel.cli import main", f"size {PRESS}")
    assert "bondgraph.motion.stepping" in confirmed
    assert confirmed.isdisjoint(DOORS)


# What `import flywheel` brings, and what it costs.


PUBLIC_PARTS = (
    *("arm", "energy", "every_shaft", "gearing", "kinetostatics", "load_models", "masses", "motors"),
    *("multibody", "presses", "recovery", "transients", "two_speeds", "wheel"),
)


def test_every_name_is_listed_and_there():
    assert set(dir(flywheel)) == set(flywheel.__all__) >= set(PUBLIC_PARTS)
    assert all(hasattr(flywheel, name) for name in flywheel.__all__)
    with pytest.raises(AttributeError, match="no attribute 'wheels'"):
        _ = flywheel.wheels


def _check_names(part: ModuleType) -> None:
    """A public module lists its names, none of which it took from numpy, typing or the checks of arguments."""
    assert part.__all__ == [name for name in part.__all__ if hasattr(part, name)]
    assert not {"Any", "np", "require"} & set(part.__all__)


def test_every_module_that_the_documents_name_lists_its_names():
    documents = [*ROOT.glob("*.md"), *ROOT.glob("flywheel/reference/*.md"), *ROOT.glob("examples/**/*.py")]
    text = "".join(file.read_text("utf-8") for file in documents)
    paths = {(path, "") for path in re.findall(r"\b(?:flywheel|bondgraph)(?:\.[a-z_]+)+", text)}
    paths |= {
        (home, name) for home, names in re.findall(r"from ([\w.]+) import ([\w, ]+)", text) for name in names.split(", ")
    }
    modules = set()
    for path, name in paths:
        home, _, last = (path, "", name) if name else path.rpartition(".")
        for file, own in ((path, name), (home, last)):
            if file.startswith(("flywheel.", "bondgraph.")) and (ROOT / f"{file.replace('.', '/')}.py").is_file():
                part = import_module(file)
                _check_names(part)
                assert own in (*part.__all__, ""), path
                modules.add(file)
    assert len(modules) > 25


def test_parts_are_imported_under_their_public_names():
    """As the README and the examples name them: modules of those names, which hold the functions of their homes."""
    from flywheel.linkage import solve
    from flywheel.load_models.gas import piston_area
    from flywheel.wheel import choose

    assert solve is import_module("flywheel.mechanisms.linkages.positions").solve
    assert piston_area is import_module("flywheel.components.load_models").piston_area
    assert choose is flywheel.wheel.choose is import_module("flywheel.components.wheels").choose
    others = ("duty", "freedoms", "linkage", "linkage.instant_centres", "load_models.gas", "notebooks", "report", "stroke")
    for name in (*PUBLIC_PARTS, *others):
        part = import_module(f"flywheel.{name}")
        assert part.__name__ == f"flywheel.{name}"
        assert part.__doc__
        _check_names(part)
    for name in ("language", "mechanisms", "reference", "starters"):
        _check_names(import_module(f"flywheel.{name}"))
    with pytest.raises(ModuleNotFoundError):
        import_module("flywheel.wheels")
