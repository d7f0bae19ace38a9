"""The command `simulate`."""

from __future__ import annotations

import json
import math
import re

import pytest
from click.testing import CliRunner

from flywheel.cli import common, main

# The command `simulate`: options, files, faults.


FAN = """
title = "Fan"
inertia = [{on = "crank", value = 2}]
drive = {torque = "20 - 4*omega"}
load = [{on = "crank", torque = "-2*sign(omega)"}]
flywheel = {inertia = 0}
"""


@pytest.fixture
def transients_scene(tmp_path):
    path = tmp_path / "fan.toml"
    path.write_text(FAN, encoding="utf-8")
    return path


def run_simulate(*arguments):
    return CliRunner().invoke(main, ["simulate", *map(str, arguments)])


def test_a_run_up_is_told_as_text(transients_scene):
    result = run_simulate(transients_scene, "--from", "rest", "--until", "95 %")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "first at 95 % of it           after 1.497866 s" in result.stdout


def test_files_are_written(transients_scene, tmp_path):
    table, picture, data = tmp_path / "a.csv", tmp_path / "a.png", tmp_path / "a.json"
    result = run_simulate(
        transients_scene, "--until", "1 s", "--csv", table, "--plot", picture, "--json", "--output", data, "--points", 4
    )
    assert (result.exit_code, result.output) == (0, "")
    assert len(table.read_text().splitlines()) == 5
    assert picture.read_bytes()[1:4] == b"PNG"
    assert len(json.loads(data.read_text())["samples"]["t"]) == 4


def test_a_run_down_ends_at_its_stop(transients_scene):
    result = run_simulate(transients_scene, "--from", "regime", "--no-drive", "--json", "--points", 2)
    data = json.loads(result.stdout)
    assert data["reason"] == "stop"
    assert data["end"]["t"] == pytest.approx(4.5 * 2 / 2, rel=1e-8)


def test_position_speed_and_flywheel_are_taken(transients_scene):
    result = run_simulate(
        transients_scene, "--from", "60 rpm", "--at", "90 deg", "--flywheel", "3 kg m^2", "--until", "1 turn", "--json"
    )
    data = json.loads(result.stdout)
    assert data["start"] == {"phi": pytest.approx(1.5707963), "omega": pytest.approx(6.2831853)}
    assert (data["flywheel"]["inertia"], data["turns"]) == (3.0, pytest.approx(1.0))


def test_a_machine_that_does_not_start_is_a_fault(tmp_path):
    path = tmp_path / "held.toml"
    path.write_text(FAN.replace("-2*sign(omega)", "-30"), encoding="utf-8")
    result = run_simulate(path, "--until", "1 turn")
    assert result.exit_code == 1
    assert "held.toml: from: found a machine that does not start" in result.stderr


def test_a_balance_that_is_zero_within_its_error_is_printed_so(tmp_path):
    path = tmp_path / "swing.toml"
    loads = '[{on = "crank", torque = "sin(phi) + cos(3*phi) - 0.3*sin(5*phi)"}]\nregime = {speed = "60 rpm"}'
    scene = FAN.replace('[{on = "crank", torque = "-2*sign(omega)"}]', loads).replace("20 - 4*omega", "balance")
    path.write_text(scene, encoding="utf-8")
    output = run_simulate(path, "--from", "60 rpm", "--until", "1 s").stdout
    assert re.search(r"greatest torque of the drive +0 N m\n +greatest power of the drive +0 W\n", output)


def test_breaks_are_added_where_asked(tmp_path):
    path, table = tmp_path / "window.toml", tmp_path / "a.csv"
    window = ', {on = "crank", torque = "-1 N m", from = "40 deg", to = "100 deg"}]\nflywheel'
    path.write_text(FAN.replace("]\nflywheel", window), encoding="utf-8")
    assert run_simulate(path, "--until", "1 turn", "--csv", table, "--points", 3, "--breaks").exit_code == 0
    angles = [float(line.split(",")[1]) for line in table.read_text().splitlines()[1:]]
    assert {round(math.degrees(angle)) for angle in angles} >= {40, 100}


def test_a_speed_below_zero_is_shown_as_it_was_typed(transients_scene):
    result = run_simulate(transients_scene, "--from", "-20 rpm")
    assert result.exit_code == 2
    assert "'--from': '-20 rpm' is below 0" in result.stderr


def test_a_long_motion_tells_how_far_it_is(transients_scene, monkeypatch):
    monkeypatch.setattr(common, "_EVERY", 0.0)
    result = run_simulate(transients_scene, "--until", "1 s", "--json", "--points", 2)
    assert result.stderr.startswith("following the motion until 1 s at ")
    assert "run 2" in result.stderr
    assert json.loads(result.stdout)["reason"] == "time"


def test_an_interrupted_motion_leaves_one_line(transients_scene, monkeypatch):
    def interrupt(watching, t, phi):
        watching.run = 1
        raise KeyboardInterrupt

    monkeypatch.setattr(common._Watching, "__call__", interrupt)
    result = run_simulate(transients_scene, "--until", "1 s")
    assert (result.exit_code, result.stdout) == (130, "")
    assert result.stderr == "interrupted at 0 s, 0 turns, run 1\n"


@pytest.mark.parametrize(
    "options",
    [
        ("--until", "soon"),
        ("--from", "3 kg"),
        ("--at", "3 s"),
        ("--flywheel", "3 s"),
        ("--rtol", "1"),
        ("--plot", "a.txt"),
        ("--csv", "-", "--json"),
        ("--from", "0.3 m/s"),
        ("--output", "SCENE"),
    ],
)
def test_usage_is_checked(transients_scene, options):
    result = run_simulate(transients_scene, *(transients_scene if option == "SCENE" else option for option in options))
    assert result.exit_code == 2
    assert result.stdout == ""
