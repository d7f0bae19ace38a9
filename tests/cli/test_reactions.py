"""The command `reactions`: curves over the driver or the time, motions in time, and what does not go together."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from flywheel.cli import main

PRESS = """
[mechanism]
type = "slider-crank"
crank = {length = 0.1, mass = 2}
rod = {length = 0.3, mass = 3, inertia = 0.03, com = 0.12}
slider.mass = 5
[[load]]
on = "slider"
force = "-100 - 40*sin(20*t)"
[drive]
torque = 60
[flywheel]
inertia = 0.5
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "press.toml"
    path.write_text(PRESS, encoding="utf-8")
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["reactions", *map(str, arguments)])


def test_curves_of_some_joints_are_listed_over_the_time(scene: Path) -> None:
    result = run(scene, "--speed", "10 rad/s", "--over", "time", "--of", "guide", "--of", "pivot", "--points", 3)
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0] == "Machine: forces in the joints, at 10 rad/s"
    assert lines[2:4] == ["guide", "  t (s)     phi (deg)  normal (N)  moment (N m)  resultant (N)"]
    assert "least and greatest" in lines
    assert not any(line == "crank_pin" for line in lines)


@pytest.mark.slow
def test_a_motion_in_time_is_taken_as_simulate_takes_it(scene: Path, tmp_path: Path) -> None:
    picture = tmp_path / "forces.png"
    result = run(
        scene,
        "--from",
        "rest",
        "--at",
        "30 deg",
        "--until",
        "0.05 s",
        "--csv",
        "--points",
        4,
        "--of",
        "pivot",
        "--plot",
        picture,
    )
    assert result.exit_code == 0
    head, *rows = csv.reader(result.stdout.splitlines())
    assert head[:4] == ["t [s]", "phi [rad]", "omega [rad/s]", "alpha [rad/s^2]"]
    assert [float(row[0]) for row in rows] == pytest.approx([0.0, 0.05 / 3, 0.1 / 3, 0.05])
    action = head.index("slider-crank.pivot.drive [N m]")
    for row in rows:  # the crank gets what the flywheel leaves of the torque
        assert float(row[action]) == pytest.approx(60.0 - 0.5 * float(row[3]), rel=1e-9)
    assert picture.read_bytes()[1:4] == b"PNG"


def test_json_has_the_components_asked_for_with_their_errors(scene: Path) -> None:
    result = run(scene, "--until", "0.02 s", "--component", "x,driving", "--json", "--points", 2)
    data = json.loads(result.stdout)
    mechanism, errors = data["mechanisms"]["slider-crank"], data["errors"]["mechanisms"]["slider-crank"]
    assert list(mechanism["driving"]) == ["pivot"]
    assert {part for parts in mechanism["joints"].values() for part in parts} == {"x", "units"}
    assert {part for parts in errors["joints"].values() for part in parts} == {"x"}
    assert data["t"] == [0.0, pytest.approx(0.02)]
    assert data["condition"].startswith("followed from 0 rad/s: ended at")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--speed", "1 rad/s", "--from", "rest"], "exclude each other"),
        (["--from", "rest", "--at", "1 deg", "--at", "2 deg"], "starts at one place"),
        (["--flywheel", "2 kg m^2"], "belongs to a motion in time"),
        (["--hodograph", "--together"], "--hodograph and --together exclude each other"),
        (["--component", "z"], "'z' is no component"),
    ],
)
def test_what_does_not_go_together_is_told(scene: Path, options: list[str], said: str) -> None:
    result = run(scene, *options)
    assert result.exit_code == 2
    assert said in " ".join(result.stderr.split())


def test_a_joint_that_there_is_not_is_a_fault_with_the_nearest(scene: Path) -> None:
    result = run(scene, "--speed", "1 rad/s", "--of", "gude")
    assert result.exit_code == 1
    assert "joints: found 'gude'" in result.stderr
    assert "did you mean 'guide'?" in result.stderr
