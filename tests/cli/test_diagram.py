"""The bond graph of a scene, printed and drawn by the command."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from flywheel.cli import main
from tests.limits import sample

MACHINES = Path(__file__).parents[2] / "examples" / "machines"
AREAS = """
areas.values = [1, -1]
regime.speed = 10
flywheel.irregularity = 0.1
"""


def run(*arguments):
    return CliRunner().invoke(main, ["graph", *map(str, arguments)])


@pytest.mark.parametrize("scene", sample(sorted(MACHINES.glob("*.toml")), 5), ids=lambda path: path.stem)
def test_every_machine_has_a_table_or_says_why_not(scene):
    result = run(scene)
    if "[areas]" in scene.read_text():
        assert result.exit_code == 1
        assert re.search(r": areas \(line \d+\): found areas without a mechanism", result.output)
        return
    assert result.exit_code == 0, result.output
    assert "f_out = T f_in, e_in = T e_out" in result.output
    assert result.output.count("e_1 = ") == 1


@pytest.mark.parametrize(("form", "sign"), [("text", "bond  from"), ("markdown", "| bond | from"), ("latex", "tabular")])
def test_the_table_comes_in_three_forms(form, sign):
    assert sign in run(MACHINES / "press.toml", "--format", form).output


@pytest.mark.slow
@pytest.mark.parametrize("suffix", sample(["png", "svg", "pdf"], 3))
def test_the_picture_is_written(tmp_path, suffix):
    path = tmp_path / f"press.{suffix}"
    assert run(MACHINES / "pump.toml", "--plot", path).exit_code == 0
    assert path.stat().st_size > 5_000


def test_simplifying_lists_what_it_did_and_leaves_fewer_bonds():
    whole, simpler = run(MACHINES / "press.toml").output, run(MACHINES / "press.toml", "--simplify").output
    assert "two bonds" in simpler
    assert "from 31 bonds to 30" in simpler
    assert "\n31 " in whole
    assert "\n31 " not in simpler


def test_wrong_files_and_formats_are_named(tmp_path):
    wrong = run(MACHINES / "press.toml", "--plot", tmp_path / "press.jpg")
    assert wrong.exit_code == 2
    assert ".png, .svg or .pdf" in wrong.output
    nowhere = run(MACHINES / "press.toml", "--plot", tmp_path / "no" / "press.png")
    assert nowhere.exit_code == 1
    assert "cannot be written" in nowhere.output
    scene = tmp_path / "areas.toml"
    scene.write_text(AREAS)
    result = run(scene)
    assert result.exit_code == 1
    assert re.search(r": areas \(line \d+\): found areas without a mechanism", result.output)


def test_a_compliant_shaft_is_drawn_as_spring_and_resistor(tmp_path):
    scene = tmp_path / "twist.toml"
    text = (MACHINES / "press_pinion.toml").read_text()
    name = text.split("[shafts.")[1].split("]")[0]
    scene.write_text(text.replace(f"[shafts.{name}]", f"[shafts.{name}]\nstiffness = 900\ndamping = 2"))
    result = run(scene)
    assert result.exit_code == 0, result.output
    assert f"C:{name}.compliance" in result.output
    assert f"R:{name}.damping" in result.output


def test_a_machine_without_any_inertia_is_refused_by_bond(tmp_path):
    scene = tmp_path / "weightless.toml"
    text = 'mechanism = {type = "scotch-yoke", crank.length = 0.5}\ndrive.torque = "balance"\nregime.speed = 6\n'
    scene.write_text(text + 'flywheel.inertia = 0\n[[load]]\non = "yoke"\nforce = 5\nfrom = 0\nto = 3\n')
    result = run(scene)
    assert result.exit_code == 1
    assert "graph: found MTF:crank->scotch-yoke.yoke: bond 1" in result.output
    assert "give the machine inertia or a flywheel" in result.output


DRIVEN = """
[mechanism]
type = "scotch-yoke"
crank = { length = 0.3, inertia = 0.5 }
yoke.mass = 20

[shafts.motor]
ratio = 5
efficiency = 0.9

[[inertia]]
on = "motor"
value = 0.1

[[load]]
on = "yoke"
force = "-200 - 30*v*abs(v) - 10*(t > 2)"

[[load]]
on = "yoke"
force = "-0.1*omega"

[[damper]]
on = "yoke"
coefficient = 20

[drive]
on = "motor"
DRIVE

[flywheel]
inertia = 3
"""


def driven(tmp_path, drive):
    scene = tmp_path / "driven.toml"
    scene.write_text(DRIVEN.replace("DRIVE", drive))
    return scene


def test_efforts_show_the_flows_and_the_time_that_they_depend_on(tmp_path):
    rows = run(driven(tmp_path, 'torque = "160 - 12*omega"')).output
    number = {row.split()[1]: row.split()[0] for row in rows.splitlines()[2:] if row[:1].isdigit()}
    own, drive = number["MSe:load[0].force"], number["MSe:drive.torque"]
    assert f"Se[load[0].force](phi, f_{own}, t)" in rows
    assert f"drive.torque(phi, f_{drive})" in rows
    assert "Se[load[1].force](phi, f_1)" in rows  # omega of a port is the driving shaft's: bond 1 leaves the crank
    assert "R:damper[0]" in rows


def test_losses_in_meshes_are_said_to_be_left_out(tmp_path):
    scene = driven(tmp_path, "torque = 5")
    assert run(scene).output.startswith("shafts.motor: losses in its mesh (efficiency 0.9) are no element of the graph\n\n")
    assert "shafts.motor: losses" in run(scene, "--simplify").output
    assert "losses" not in run(MACHINES / "press.toml").output


@pytest.mark.parametrize("inductance", [pytest.param("", marks=pytest.mark.slow), "inductance = 0.02, "])
@pytest.mark.slow
def test_a_dc_motor_is_drawn_as_its_own_graph(tmp_path, inductance):
    motor = (
        f'motor = {{type = "dc", voltage = 110, resistance = 0.8, constant = 0.6, {inductance}friction = 1, inertia = 0.02}}'
    )
    result = run(driven(tmp_path, motor), *(("--plot", tmp_path / "motor.svg") if inductance else ()))
    assert result.exit_code == 0, result.output
    for name in ("Se:drive.motor.voltage", "GY:drive.motor.constant", "R:drive.motor.resistance", "1:drive.motor.rotor"):
        assert name in result.output
    assert ("I:drive.motor.inductance" in result.output) is bool(inductance)
    assert "MSe:drive.motor" not in result.output
    assert sum("  I:drive.motor.inertia  " in line for line in result.output.splitlines()) == 1
