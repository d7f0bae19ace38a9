"""The command `sweep`: numbers that vary, tables, files, faults, interruptions."""

import csv
import io

import numpy as np
import pytest
from click.testing import CliRunner

from flywheel.cli import main, studies
from flywheel.designs import figures as designs
from flywheel.designs.sweep import sweep as sweep_of

ROTOR = """
title = "Rotor"
load = [{on = "crank", torque = "-100 N m", from = 0, to = "180 deg"}]
drive = {torque = "balance"}
regime = {speed = "300 rpm"}
flywheel = {irregularity = 0.01}
"""
EPS, SPEED = "flywheel.irregularity", "regime.speed"


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "rotor.toml"
    path.write_text(ROTOR, encoding="utf-8")
    return path


def run(*arguments, engine="size"):
    return CliRunner().invoke(main, ["sweep", *map(str, arguments), "--engine", engine])


def test_all_combinations_are_told_in_eighty_columns(scene):
    result = run(scene, "--vary", f"{EPS}=1%:3%:3", "--vary", "load[0].from = 0 deg, 0.5 rad", "--vary", f"{SPEED}=300rpm")
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[:2] == ["Rotor", "A sweep of 6 designs, on a grid of 3 x 2 x 1, to a relative error of 1e-10"]
    assert max(map(len, lines)) <= 80
    assert "The least flywheel: design 5" in lines
    table = lines[lines.index("The least flywheel: design 5") :]
    assert any(line.split()[:2] == ["5", "0.03"] for line in table)


def test_csv_on_standard_output_is_nothing_else(scene):
    result = run(scene, "--vary", f"{EPS}=0.01,-1", "--csv", "-")
    first, second = csv.DictReader(io.StringIO(result.stdout))
    assert float(first["exact [kg m^2]"]) == pytest.approx(15.915494309189533, rel=1e-10)
    assert second["exact [kg m^2]"] == second["needed"] == ""
    assert second["reason"] == "flywheel.irregularity: found -1.0, expected a value above 0 and below 2"
    assert "1 of 2 designs are refused" in result.stderr


@pytest.mark.parametrize(
    ("options", "code", "told"),
    [
        (["--vary", f"{EPS}=1%"], 0, ""),
        (["--vary", f"{EPS}=-1,-2"], 1, ""),
        ([], 2, "Missing option '--vary'"),
        (["--vary", EPS], 2, "is no PATH=LOW:HIGH:COUNT"),
        (["--vary", f"{EPS}=1%:2%"], 2, "is no PATH=LOW:HIGH:COUNT"),
        (["--vary", f"{EPS}=1%:2%:1"], 2, "no count from 2"),
        (["--vary", "flywheel.ireg=1%:2%:3"], 1, '--vary flywheel.ireg: found no number of the scene, expected the path'),
        (["--vary", f"{SPEED}=1kg:2kg:3"], 1, 'regime.speed: found "1kg", expected a speed such as "210 rpm"'),
        (["--vary", f"{EPS}=1%", "--vary", f"{EPS}=2%"], 1, "found two columns, expected one --vary for each"),
        (["--vary", f"{EPS}=1%", "--npz", "a.txt"], 2, "does not end in .npz"),
        (["--vary", f"{EPS}=1%", "--jobs", "0"], 2, "--jobs"),
        (["--vary", f"{EPS}=1%", "--rtol", "1"], 2, "not from 1e-14 to 0.1"),
        (["--vary", f"{EPS}=1%", "--npz", "nowhere/a.npz"], 1, "there is no folder 'nowhere'"),
    ],
)  # fmt: skip
def test_exit_codes_and_lines(scene, options, code, told):
    result = run(scene, *options)
    assert result.exit_code == code
    assert told in result.stderr
    assert code == 2 or len(result.stderr.splitlines()) == bool(told)


def test_no_file_of_the_user_is_replaced(scene, tmp_path):
    text = scene.read_text(encoding="utf-8")
    assert run(scene, "--vary", f"{EPS}=1%", "--csv", scene).exit_code == 2
    mine = tmp_path / "mine.npz"
    np.savez(mine, a=np.zeros(1))
    before = mine.read_bytes()
    result = run(scene, "--vary", f"{EPS}=1%", "--npz", mine)
    assert result.exit_code == 1
    assert "give another name" in result.stderr
    assert mine.read_bytes() == before
    assert scene.read_text(encoding="utf-8") == text


def test_a_sweep_goes_on_from_its_file_and_no_other_does(scene, tmp_path):
    file = tmp_path / "a.npz"
    first = run(scene, "--vary", f"{EPS}=1%:2%:3", "--npz", file)
    again = run(scene, "--vary", f"{EPS}=1%:2%:3", "--npz", file)
    assert first.exit_code == again.exit_code == 0
    assert first.stdout == again.stdout
    other = run(scene, "--vary", f"{EPS}=1%:2%:3", "--npz", file, "--rtol", "1e-8")
    assert other.exit_code == 1
    assert other.stderr == (
        f"{file}: found a sweep of another rtol 1e-10, expected one of this rtol 1e-08; "
        "give another file, or take this one away\n"
    )


def test_an_interrupted_sweep_says_what_is_missing(scene, tmp_path, monkeypatch):
    def interrupted(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr(designs, "sized", interrupted)
    result = run(scene, "--vary", f"{EPS}=1%:2%:3", "--npz", tmp_path / "a.npz")
    assert result.exit_code == 130
    assert "interrupted: 3 of 3 designs are missing; the same sweep goes on from" in " ".join(result.stdout.split())


def test_the_command_offers_the_engines_of_the_library():
    option = next(each for each in studies.sweep.params if each.name == "engine")
    assert tuple(option.type.choices) == designs.ENGINES
    assert sweep_of.__kwdefaults__["engine"] is None
