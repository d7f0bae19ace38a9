"""A scene holds what its command needs and no more: every command on mechanisms alone."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import flywheel
from flywheel.cli import main
from flywheel.mechanisms import KINDS
from tests.limits import sample

BODY = 'mass = "1 kg", inertia = "0.01 kg m^2", com = "30 mm"'
ALONE = {
    "scotch-yoke": 'crank.length = "0.1 m"\nyoke.mass = "3 kg"',
    "slider-crank": f'crank.length = "80 mm"\nrod = {{length = "300 mm", {BODY}}}\nslider.mass = "2 kg"',
    "four-bar": f"ground.length = 0.3\ncrank.length = 0.08\ncoupler.length = 0.25\nrocker = {{length = 0.18, {BODY}}}",
    "crank-shaper": f"crank.length = 0.1\nframe.length = 0.25\nrocker = {{length = 0.6, {BODY}}}\nram.mass = 5",
    "toggle-clamp": (
        "frame.height = 0.14\nbell_crank = {drive_length = 0.168, clamp_length = 0.22, angle = 0.3, mass = 16}\n"
        'coupler.length = 0.095\nrod.length = 0.26\nplaten.mass = 298\n[stroke]\nfrom = "-60 mm"\nto = "150 mm"'
    ),
    "law": "outputs.ram = {x = '0.1*sin(phi)', mass = 3}",
    "linkage": (
        "driver = 'A'\nbodies.frame.points = {A = [0, 0], C = [0.3, 0]}\n"
        "bodies.crank = {points = {A = [0, 0], B = [0.08, 0]}, mass = 1, com = [0.04, 0]}\n"
        "bodies.rod = {points = {B = [0, 0], D = [0.25, 0]}, guess = '40 deg'}\n"
        "bodies.rocker.points = {C = [0, 0], D = [0.18, 0]}\n"
        "assembly = [{point = 'rod.D', side = 'left', from = 'crank.B', to = 'frame.C'}]\n"
        "joints = [{name = 'A', type = 'pin', between = ['frame.A', 'crank.A']},"
        "{name = 'B', type = 'pin', between = ['crank.B', 'rod.B']},"
        "{name = 'C', type = 'pin', between = ['frame.C', 'rocker.C']},"
        "{name = 'D', type = 'pin', between = ['rod.D', 'rocker.D']}]"
    ),
}
"""A scene of every type with nothing but itself, and a stroke where its driver slides."""
LINKED = "slider-crank"


def text(kind: str, more: str = "") -> str:
    return f'[mechanism]\ntype = "{kind}"\n{ALONE[kind]}\n{more}'


@pytest.fixture
def scene(tmp_path: Path):
    def written(content: str) -> Path:
        path = tmp_path / "alone.toml"
        path.write_text(content)
        return path

    return written


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_there_is_one_of_every_type():
    assert set(ALONE) == set(KINDS)


@pytest.mark.parametrize("kind", sample(list(ALONE), 3))
def test_every_type_is_reduced_and_graphed_and_not_sized(kind, scene):
    path = scene(text(kind))
    reduced = run("reduce", path, "--points", 2)
    assert reduced.exit_code == 0, reduced.stderr
    assert len(reduced.stdout.splitlines()) == 3
    graph = run("graph", path)
    assert graph.exit_code == 0, graph.stderr
    assert "MTF" in graph.stdout
    refused = run("size", path)
    assert (refused.exit_code, refused.stdout) == (1, "")
    lines = refused.stderr.splitlines()
    if kind == "toggle-clamp":
        assert "found a one-way stroke" in lines[0]
    else:
        assert lines[0].endswith("flywheel: found nothing, expected a table with irregularity or inertia")
        assert "regime.speed: found nothing, expected a speed such as" in lines[1]


@pytest.mark.parametrize("kind", ["slider-crank", "toggle-clamp"])
def test_forces_ask_for_a_speed_or_none(kind, scene):
    path = scene(text(kind))
    refused = run("reactions", path)
    (line,) = refused.stderr.splitlines()
    assert refused.exit_code == 1
    assert "speed" in line.split(": found nothing")[0]
    assert "--speed" in line
    assert "--quasi-static" in line
    speed = "0.1 m/s" if kind == "toggle-clamp" else "60 rpm"
    for option in (["--speed", speed], ["--quasi-static"]):
        assert run("reactions", path, "--points", 2, *option).exit_code == 0


def test_a_law_is_told_to_have_no_joints_before_anything_is_asked_for(scene):
    refused = run("reactions", scene(text("law")))
    assert "mechanism.type (line 2): found a mechanism of type law" in refused.stderr
    assert "--speed" not in refused.stderr


def test_a_speed_without_a_flywheel_is_constant():
    loaded = flywheel.load(text(LINKED, "[regime]\nspeed = 10"))
    found = flywheel.joint_forces(loaded, [0.3, 2.0])
    assert found.motion.omega.tolist() == [10.0, 10.0]
    assert found.motion.alpha.tolist() == [0.0, 0.0]
    assert found.messages == ("no flywheel is given: the speed is taken as a constant 10 rad/s",)


def test_loads_that_depend_on_speed_are_reduced_at_the_speed_given(scene):
    path = scene(text(LINKED, "[[damper]]\non = 'slider'\ncoefficient = 100"))
    refused = run("reduce", path, "--at", "90 deg")
    assert refused.exit_code == 1
    assert "--speed" in refused.stderr
    found = run("reduce", path, "--at", "90 deg", "--speed", "10 rad/s", "--json")
    state = json.loads(found.stdout)
    gain = state["gains"]["slider-crank.slider"][0]
    assert state["moment"][0] == pytest.approx(-100 * 10.0 * gain**2, rel=1e-12)
    assert (state["speed"], state["errors"]["speed"]) == (10.0, 0.0)
    assert "taken at a constant 10 rad/s" in found.stderr


@pytest.mark.parametrize(
    "more",
    [
        "[[load]]\non = 'slider'\nforce = '-100 N'\nwhile = 'v > 0'",
        "[shafts.motor]\nratio = 2\nefficiency = 0.9\n[drive]\non = 'motor'\ntorque = 5",
        "[drive]\ntorque = '5*sin(t)'",
    ],
)
def test_reducing_asks_for_no_balance(more, scene):
    assert run("reduce", scene(text(LINKED, more)), "--points", 4).exit_code == 0


def test_a_stroke_without_speed_is_reduced_but_for_what_depends_on_it(scene):
    path = scene(text("toggle-clamp"))
    found = run("reduce", path, "--points", 3)
    heads = next(csv.reader(io.StringIO(found.stdout)))
    assert "F* [N]" in heads
    assert "F_drive [N]" not in heads
    assert "no speed is given" in found.stderr
    data = json.loads(run("reduce", path, "--points", 3, "--json").stdout)
    assert data["driving_force"] is data["velocities"] is data["accelerations"] is data["stroke"]["speed"] is None
    timed = json.loads(run("reduce", path, "--points", 3, "--json", "--speed", "0.3 m/s").stdout)
    v = np.array(timed["velocities"]["toggle-clamp.platen"])
    np.testing.assert_allclose(v, 0.3 * np.array(data["gains"]["toggle-clamp.platen"]), rtol=1e-14)


def test_what_has_no_inertia_is_graphed_with_a_speed_given(scene):
    path = scene('[mechanism]\ntype = "scotch-yoke"\ncrank.length = 1\n[[load]]\non = "yoke"\nforce = "-3 N"')
    found = run("graph", path)
    assert found.exit_code == 0
    assert "a source of flow moves the driver" in found.stdout
    assert "Sf:speed" in found.stdout


def test_a_mechanism_alone_is_animated_evenly():
    from flywheel.pictures.mechanisms import timing
    from flywheel.pictures.sketch import views

    loaded = flywheel.load(text(LINKED))
    found = timing(loaded, views(loaded)[0])
    assert "no speed is given" in found.title
    assert not found.timed
    assert np.ptp(np.diff(found.evenly(40)[1])) < 1e-12
    gain = flywheel.reduce(loaded, found.q[[100, 700]]).gains["slider-crank.slider"]
    np.testing.assert_allclose(found.curve[[100, 700]], gain, rtol=1e-12)
