"""The command `motion`: options, what is told, files, faults."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from flywheel.cli import main

PRESS = """
[mechanism]
type = "slider-crank"
crank.length = "1 m"
rod = {length = "2 m", mass = 1, com = "1 m"}
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "press.toml"
    path.write_text(PRESS, encoding="utf-8")
    return path


def run(*arguments):
    return CliRunner().invoke(main, ["motion", *map(str, arguments)])


def test_a_mechanism_alone_is_moved_per_unit_of_its_driver(scene):
    result = run(scene, "--of", "slider")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "guide: displacement of slider" in result.stdout
    assert "  90              1.73205         -1                       0.57735" in result.stdout
    assert "velocity passes zero at 0 deg, 180 deg" in result.stdout
    every = run(scene).stdout
    assert "rod.com: place" in every
    assert "at rest: pivot (0, 0) m" in every
    assert max(map(len, every.splitlines())) <= 110


def test_one_position_is_a_line_for_each_figure(scene):
    result = run(scene, "--of", "slider,rod", "--speed", "5 rad/s", "--at", "90 deg")
    assert [line.split() for line in result.stdout.splitlines()[4:]] == [
        ["guide", "1.73205", "m", "-5", "m/s", "14.4338", "m/s^2"],
        ["rod", "-0.523599", "rad", "0", "rad/s", "14.4338", "rad/s^2"],
    ]


def test_every_figure_of_json_has_its_error(scene):
    data = json.loads(run(scene, "--law", "sin(t)", "--until", "2 s", "--points", 3, "--json").stdout)
    assert (data["condition"], data["over"], data["t"]) == ("imposed: sin(t)", "time", [0.0, 1.0, 2.0])

    def alike(figures, errors, path):
        if isinstance(errors, dict):
            assert isinstance(figures, dict), path
            for key, part in figures.items():
                if key not in ("kind", "units", "quantity", "component", "which"):
                    alike(part, errors[key], f"{path}.{key}")
        elif isinstance(errors, list):
            assert len(figures) == len(errors), path
            for one, error in zip(figures, errors, strict=True):
                alike(one, error, path)
        else:
            assert (figures is None) == (errors is None), path
            assert errors is None or errors >= 0.0, path

    for name in ("t", "q", "rate", "acceleration", "breakpoints", "curves"):
        alike(data[name], data["errors"][name], name)
    assert data["curves"]["guide"]["velocity"][1] == pytest.approx(-0.5475182, abs=1e-7)


def test_csv_has_a_row_for_every_position(scene, tmp_path):
    table = tmp_path / "motion.csv"
    assert run(scene, "--speed", "60 rpm", "--over", "time", "--csv", "-o", table).exit_code == 0
    head, *rows = table.read_text().splitlines()
    assert len(rows) == 361
    assert head.split(",")[:4] == ["t [s]", "phi [rad]", "omega [rad/s]", "alpha [rad/s^2]"]
    column = head.split(",").index("rod.com acceleration total [m/s^2]")
    assert float(rows[0].split(",")[column]) == pytest.approx(1.25 * (2 * np.pi) ** 2)


def test_a_transient_begins_where_it_is_told(scene):
    driven = PRESS + '[drive]\ntorque = "10 N m"\n'
    scene.write_text(driven, encoding="utf-8")
    result = run(scene, "--from", "rest", "--at", "90 deg", "--until", "0.05 s", "--of", "crank", "--at", "0 s")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "motion from 90 deg, 0 rad/s" in result.stdout
    assert "t = 0 s, phi = 90 deg" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["--of", "sldier"], 1, 'did you mean "slider"?'),
        (["--over", "time"], 1, "time without a motion in time"),
        (["--law", "sin(t)"], 1, "a law without an end"),
        (["--law", "sin(t)", "--until", "2 turns"], 2, "is no duration"),
        (["--law", "sin(t)", "--regime"], 2, "exclude each other"),
        (["--law", "sin(t)", "--until", "2 s", "--at", "30 deg"], 2, "is no time with its unit"),
        (["--at", "30 deg", "--points", "5"], 2, "exclude each other"),
        (["--flywheel", "2 kg m^2"], 2, "--regime or --from"),
        (["--from", "rest", "--at", "1 deg", "--at", "2 deg"], 2, "give --at once"),
        (["--regime"], 1, "flywheel"),
        (["--speed", "5 kg"], 2, "is no speed"),
        (["--csv", "--json"], 2, "exclude each other"),
    ],
)
def test_what_cannot_be_is_one_line(scene, arguments, code, told):
    result = run(scene, *arguments)
    assert result.exit_code == code
    assert told in result.stderr
    assert "Traceback" not in result.output
