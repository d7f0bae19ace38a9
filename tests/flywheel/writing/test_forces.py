"""`flywheel reactions`: tables, CSV, JSON and pictures of the forces in joints, and its faults."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

import flywheel
from flywheel.joints import joint_forces
from tests.flywheel.test_cli import YOKE, run
from tests.flywheel.test_joint_friction import crank_press

EXAMPLES = Path(__file__).parents[3] / "examples"
PUMP = EXAMPLES / "linkages" / "offset_slider_crank.toml"
CLAMP = EXAMPLES / "machines" / "injection_clamp.toml"


def test_text_names_angles_in_degrees() -> None:
    result = run("reactions", PUMP, "--at", "30 deg", "--at", "270 deg")
    assert (result.exit_code, result.stderr) == (0, "")
    rows = [line.split() for line in result.stdout.splitlines()]
    assert ["phi", "(deg)", "main", "(N", "m)"] in rows
    assert sum(row[:1] == ["270"] for row in rows) == 5
    assert "largest forces" in result.stdout


def test_csv_has_the_library_s_figures() -> None:
    result = run("reactions", PUMP, "--csv", "--points", "8")
    rows = list(csv.DictReader(io.StringIO(result.stdout)))
    found = joint_forces(flywheel.load(PUMP), np.arange(8) * np.pi / 4)
    forces = found.mechanisms["linkage"]
    assert [float(row["omega [rad/s]"]) for row in rows] == found.motion.omega.tolist()
    assert [float(row["linkage.cylinder.normal [N]"]) for row in rows] == forces.components["cylinder"]["normal"].tolist()
    assert [float(row["linkage.main.drive [N m]"]) for row in rows] == forces.action.tolist()


def test_json_has_units_and_extremes() -> None:
    data = json.loads(run("reactions", PUMP, "--json", "--points", "36").stdout)
    joints = data["mechanisms"]["linkage"]["joints"]
    assert joints["cylinder"]["units"] == {"normal": "N", "moment": "N m"}
    largest = data["mechanisms"]["linkage"]["largest"]["main"]
    assert largest["force"] == max(joints["main"]["resultant"])
    assert data["reduction"] == "crank"


def test_a_stroke_has_positions_and_velocities() -> None:
    result = run("reactions", CLAMP, "--csv", "--at", "190 mm")
    head, row = result.stdout.splitlines()
    assert head.startswith("x [m],v [m/s],a [m/s^2],toggle-clamp.block_guide.drive [N]")
    assert row.startswith("0.19,0.3289474,0.0,")


def test_friction_is_reported(tmp_path: Path) -> None:
    scene = flywheel.load(crank_press(0.1))
    from flywheel.writing.forces import text

    shown = text(scene, joint_forces(scene, [0.3, 2.0]))
    assert "friction: " in shown
    assert "its share of the moment is -" in shown


def test_a_constant_speed_and_no_inertia() -> None:
    slow, fast = (
        run("reactions", PUMP, "--csv", "--at", "1 rad", "--speed", w, "--quasi-static") for w in ("1 rpm", "900 rpm")
    )
    first, second = (row.stdout.splitlines()[1].split(",")[3:] for row in (slow, fast))
    np.testing.assert_allclose(np.array(first, float), np.array(second, float), rtol=1e-9)


def test_plot(tmp_path: Path) -> None:
    path = tmp_path / "forces.svg"
    assert run("reactions", PUMP, "--plot", path, "--at", "30 deg", "--at", "60 deg").exit_code == 0
    assert path.stat().st_size > 4000


def test_output_is_a_file_but_never_the_scene(tmp_path: Path) -> None:
    path = tmp_path / "forces.csv"
    assert run("reactions", PUMP, "--csv", "--points", "2", "--output", path).stdout == ""
    assert path.read_text().count("\n") == 3
    scene = tmp_path / "yoke.toml"
    scene.write_text(YOKE)
    result = run("reactions", scene, "--output", scene)
    assert result.exit_code == 2
    assert scene.read_text() == YOKE


@pytest.mark.parametrize(
    "arguments",
    [
        ["--json", "--csv"],
        ["--at", "30 deg", "--points", "3"],
        ["--speed", "12"],
        ["--speed", "3 kg"],
        ["--speed", "2 m/s"],
        ["--at", "3 mm"],
        ["--plot", "a.gif"],
    ],
)
def test_usage_errors(arguments: list[str]) -> None:
    result = run("reactions", PUMP, *arguments)
    assert result.exit_code == 2
    assert "Traceback" not in result.output
