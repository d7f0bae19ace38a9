"""The bond graph of a scene, printed and drawn by the command."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from flywheel.cli import main

MACHINES = Path(__file__).parents[2] / "examples" / "machines"
AREAS = """
areas.values = [1, -1]
regime.speed = 10
flywheel.irregularity = 0.1
"""


def run(*arguments):
    return CliRunner().invoke(main, ["graph", *map(str, arguments)])


@pytest.mark.parametrize("scene", sorted(MACHINES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_machine_has_a_table_or_says_why_not(scene):
    result = run(scene)
    if "[areas]" in scene.read_text():
        assert result.exit_code == 1
        assert "areas: found areas without a mechanism" in result.output
        return
    assert result.exit_code == 0, result.output
    assert "f_out = T f_in, e_in = T e_out" in result.output
    assert result.output.count("e_1 = ") == 1


@pytest.mark.parametrize(("form", "sign"), [("text", "bond  from"), ("markdown", "| bond | from"), ("latex", "tabular")])
def test_the_table_comes_in_three_forms(form, sign):
    assert sign in run(MACHINES / "press.toml", "--format", form).output


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
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
    assert "areas: found areas without a mechanism" in result.output


def test_a_compliant_shaft_is_drawn_as_spring_and_resistor(tmp_path):
    scene = tmp_path / "twist.toml"
    text = (MACHINES / "press_pinion.toml").read_text()
    name = text.split("[shafts.")[1].split("]")[0]
    scene.write_text(text.replace(f"[shafts.{name}]", f"[shafts.{name}]\nstiffness = 900\ndamping = 2"))
    result = run(scene, "--plot", tmp_path / "twist.svg")
    assert result.exit_code == 0, result.output
    assert f"C:{name}.compliance" in result.output
    assert f"R:{name}.damping" in result.output


def test_a_flywheel_to_be_sized_stands_in_the_graph_as_an_open_parameter():
    assert "I:flywheel" in run(MACHINES / "press.toml").output


def test_a_machine_without_any_inertia_is_refused_by_bond(tmp_path):
    scene = tmp_path / "weightless.toml"
    text = 'mechanism = {type = "scotch-yoke", crank.length = 0.5}\ndrive.torque = "balance"\nregime.speed = 6\n'
    scene.write_text(text + 'flywheel.inertia = 0\n[[load]]\non = "yoke"\nforce = 5\nfrom = 0\nto = 3\n')
    result = run(scene)
    assert result.exit_code == 1
    assert "graph: found MTF:crank->scotch-yoke.yoke: bond 1" in result.output
    assert "give the machine inertia or a flywheel" in result.output
