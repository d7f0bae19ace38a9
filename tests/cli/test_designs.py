"""The commands sensitivities, tolerance and optimize: options, tables, data, pictures, faults."""

import json

import pytest
from click.testing import CliRunner

from flywheel.cli import main

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


def run(command, *arguments):
    return CliRunner().invoke(main, [command, *map(str, arguments)])


def test_sensitivities_as_a_table_of_80_columns(scene):
    result = run("sensitivities", scene, "regime.speed", "load.0.to")
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert max(map(len, lines)) <= 80
    assert "exact flywheel: 17.4533 kg m^2" in lines
    assert any(line.split() == ["regime.speed", "-1.16355", "kg", "m^2/(rad/s)", "-2"] for line in lines)


def test_sensitivities_as_data(scene):
    data = json.loads(run("sensitivities", scene, "regime.speed", "--json").stdout)
    assert data["figures"]["exact"]["derivatives"]["regime.speed"]["elasticity"] == pytest.approx(-2.0, rel=1e-8)
    assert data["numbers"]["regime.speed"] == {"value": 30.0, "unit": "rad/s"}


@pytest.mark.slow
def test_tolerance_of_intervals_and_of_deviations(scene):
    result = run("tolerance", scene, "--vary", "regime.speed=29:31", "--samples", 64, "--of", "power")
    assert (result.exit_code, result.stderr) == (0, "")
    assert any(
        line.split() == ["power", "1500", "1450", "-3.33", "%", "1550", "+3.33", "%", "W"]
        for line in result.stdout.splitlines()
    )
    assert max(map(len, result.stdout.splitlines())) <= 80
    data = json.loads(run("tolerance", scene, "--vary", "load.0.torque=±2 N m", "--samples", 64, "--json").stdout)
    assert data["figures"]["power"]["deviation"] == pytest.approx(30.0, rel=1e-3)
    assert data["figures"]["power"]["least"] is None


@pytest.mark.slow
def test_optimize_with_a_limit(scene):
    options = ("--over", "load.0.to=60deg:120deg", "--subject-to", "power>=0.6kW", "--starts", 1)
    result = run("optimize", scene, "--minimize", "flywheel.exact", *options)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "Held by a limit: 600 W <= power." in result.stdout
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
    result = run(options[0], scene, *options[1:], "--plot", picture)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "load.0.to" in picture.read_text(encoding="utf-8") or options[0] == "optimize"


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("sensitivities", "load.0.too"), 1, 'load.0.too: found no number of the scene, expected the path of one; did you'),
        (("sensitivities", "--of", "exakt"), 1, 'figures: found "exakt", expected a figure; did you mean "exact"?'),
        (("tolerance", "--vary", "load.0.to"), 2, "is no PATH=LOW:HIGH"),
        (("tolerance", "--vary", "load.0.to=1kg:2kg"), 1, "load.0.to: found"),
        (("optimize", "--over", "load.0.to=1:2"), 2, "Give --minimize FIGURE or --maximize FIGURE."),
        (("optimize", "--minimize", "exact", "--over", "load.0.to=1:2", "--subject-to", "power"), 2, "is no limit such as"),
        (("optimize", "--minimize", "exact", "--over", "load.0.to=2:1"), 1, "load.0.to: found bounds from 2 to 1"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line(scene, arguments, code, words):
    result = run(arguments[0], scene, *arguments[1:])
    assert (result.exit_code, result.stdout) == (code, "")
    assert words in result.stderr
    assert "Traceback" not in result.stderr
