"""`flywheel reactions`: tables, CSV, JSON and pictures of the forces in joints, and its faults."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

import flywheel
from flywheel.machine.reactions import close_positions
from flywheel.motions.joint_forces import closely, force_curves, joint_forces
from flywheel.tables.forces import csv as csv_text
from flywheel.tables.forces import text
from tests.cli.test_cli import YOKE, run
from tests.machine.test_joint_friction import crank_press, straight_drive

EXAMPLES = Path(__file__).parents[2] / "examples"
PUMP = EXAMPLES / "linkages" / "offset_slider_crank.toml"
CLAMP = EXAMPLES / "machines" / "injection_clamp.toml"
PRESS = EXAMPLES / "machines" / "press.toml"
PUMPS = EXAMPLES / "machines" / "three_cylinder.toml"


def test_text_names_angles_in_degrees() -> None:
    result = run("reactions", PUMP, "--at", "30 deg", "--at", "270 deg")
    assert (result.exit_code, result.stderr) == (0, "")
    rows = [line.split() for line in result.stdout.splitlines()]
    assert ["phi", "(deg)", "main", "(N", "m)"] in rows
    assert sum(row[:1] == ["270"] for row in rows) == 5
    assert "largest forces of these positions" in result.stdout


def largest(text: str) -> dict[str, float]:
    lines = text.split("\nlargest forces\n")[1].split("\n\n")[0].splitlines()
    return {name.strip(): float(rest.split()[0]) for name, rest in (line.split(":") for line in lines)}


def test_the_largest_forces_are_those_of_the_whole_cycle() -> None:
    shown = largest(run("reactions", PRESS).stdout)
    scene = flywheel.load(PRESS)
    fine, coarse = (joint_forces(scene, np.arange(n) * 2 * np.pi / n).mechanisms["press"] for n in (4000, 24))
    for extreme in fine.extremes():
        assert shown[extreme.joint] == pytest.approx(extreme.force, rel=2e-3)
    assert shown["guide"] > 1.3 * coarse.resultant("guide").max()


def test_both_sides_of_a_load_s_edge_are_looked_at() -> None:
    machine = flywheel.Machine(flywheel.load(PRESS))
    at = close_positions(machine, 7)
    for edge in machine.breakpoints:
        for side in (edge - 1e-9 * 2 * np.pi, edge + 1e-9 * 2 * np.pi):
            assert np.abs((at - side + np.pi) % (2 * np.pi) - np.pi).min() < 1e-14


def test_a_stroke_is_looked_at_up_to_both_ends() -> None:
    scene = flywheel.load(CLAMP)
    at = close_positions(flywheel.Machine(scene), 360)
    assert scene.stroke is not None
    assert (at[0], at[-1]) == pytest.approx((scene.stroke.start, scene.stroke.end), rel=1e-15)


def test_rounding_is_nought_in_the_text_and_stays_in_the_data() -> None:
    loaded = flywheel.load(straight_drive())
    found = joint_forces(loaded)
    normal = found.mechanisms["linkage"].components["bore"]["normal"]
    assert 0.0 < np.abs(normal).max() < 1e-9
    assert "bore: 0 N at" in text(loaded, found)
    assert "share of the moment is 0 N m" in text(loaded, found)
    assert repr(float(normal[7])) in csv_text(loaded, found)


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


def test_friction_is_reported() -> None:
    scene = flywheel.load(crank_press(0.1))
    shown = text(scene, joint_forces(scene, [0.3, 2.0], speed=20.0))
    assert "friction: " in shown
    assert "its share of the moment is -" in shown


def test_a_constant_speed_and_no_inertia() -> None:
    slow, fast = (
        run("reactions", PUMP, "--csv", "--at", "1 rad", "--speed", w, "--quasi-static") for w in ("1 rpm", "900 rpm")
    )
    first, second = (row.stdout.splitlines()[1].split(",")[3:] for row in (slow, fast))
    np.testing.assert_allclose(np.array(first, float), np.array(second, float), rtol=1e-9)


@pytest.mark.slow
def test_plot(tmp_path: Path) -> None:
    path = tmp_path / "forces.svg"
    result = run("reactions", PUMP, "--plot", path, "--at", "30 deg", "--at", "60 deg")
    assert (result.exit_code, result.stderr) == (0, f"wrote {path}\n")
    assert path.stat().st_size > 4000


def test_one_position_is_no_curve(tmp_path: Path) -> None:
    result = run("reactions", PUMP, "--plot", tmp_path / "forces.svg", "--at", "30 deg")
    assert result.exit_code == 1
    assert "positions: found a single one, expected two at least" in result.stderr


@pytest.mark.slow
def test_several_mechanisms_have_a_file_each(tmp_path: Path) -> None:
    result = run("reactions", PUMPS, "--plot", tmp_path / "f.svg", "--points", "15", "--csv")
    names = joint_forces(flywheel.load(PUMPS), [0.5]).mechanisms
    assert len(names) > 1
    assert result.stderr.splitlines() == [f"wrote {tmp_path / f'f-{name}.svg'}" for name in names]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(f"f-{name}.svg" for name in names)


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


def test_extremes_are_found_between_the_positions() -> None:
    """An 1e9th of the largest force, from 40 positions as from 7000; the least resultant is a sharp one."""
    machine = flywheel.Machine(flywheel.load(CLAMP))
    start = joint_forces(machine, [0.0])
    few, many = (
        {c.name: c.values for c in force_curves(closely(start, lambda x: joint_forces(machine, x), n))} for n in (40, 2000)
    )
    for name, values in few.items():
        assert [values.min(), values.max()] == pytest.approx([many[name].min(), many[name].max()], rel=0, abs=1e-9 * 4370)
    assert few["block_pin.x"].max() == pytest.approx(990.7962, abs=5e-5)
