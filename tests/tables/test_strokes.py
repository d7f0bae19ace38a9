"""`flywheel reduce` along a stroke: names and units of its own where the driver slides."""

import csv
import json
import math
from pathlib import Path

import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose

import flywheel
from flywheel.cli import main
from flywheel.reference import text

EXAMPLE = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.toml"
LEVER = """
mechanism.type = "linkage"
mechanism.driver = "pivot"
mechanism.bodies = {frame = {points = {O = [0.1, 0]}}, arm = {mass = 3, points = {P = [0.2, 0]}}}
mechanism.joints = [{name = "pivot", type = "pin", between = ["frame.O", "arm.P"]}]
stroke = {from = "10 deg", to = "100 deg", speed = 2, acceleration = 3}
"""


def run(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def lever(tmp_path):
    path = tmp_path / "lever.toml"
    path.write_text(LEVER)
    return path


def test_json_of_a_driver_that_slides():
    data = json.loads(run("reduce", EXAMPLE, "--json", "--at", "190 mm", "--at", "0.1 m").stdout)
    state = flywheel.reduce(flywheel.load(EXAMPLE), [0.19, 0.1])
    assert data["reduction"] == "slide"
    assert data["stroke"] == {"from": -0.06, "to": 0.19, "speed": 0.3289474, "acceleration": 0.0}
    assert data["x"] == [0.19, 0.1]
    assert_allclose(data["reduced_mass"], state.inertia)
    assert_allclose(data["reduced_mass_slope"], state.slope)
    assert_allclose(data["reduced_force"], state.moment)
    assert_allclose(data["driving_force"], 0.5 * state.slope * 0.3289474**2 - state.moment)
    assert_allclose(sum(map(sum, data["mass_parts"].values())), state.inertia.sum())
    assert_allclose(1e3 * data["velocities"]["toggle-clamp.platen"][0], 0.02179, atol=5e-6)
    assert_allclose(1e3 * data["accelerations"]["toggle-clamp.platen"][0], -235.27, atol=5e-3)
    assert not {"phi", "inertia", "moment"} & set(data)


def test_the_clamp_has_the_masses_of_its_source():
    """At full stretch, where all lies on the platen's line: from the speeds there, to the digits that they have here."""
    v, turn, coupler, rod = 0.3289474, -0.7616, 4.0698, 0.6445  # m/s and rad/s
    half = 0.0475 * coupler  # the coupler stands at 1.89156 rad; its upper pin is the block's
    across = math.hypot(-v + half * math.sin(1.89156), half * math.cos(1.89156))
    energy = (33.2930 + 10.0088) * v**2 + 16.1475 * (0.11 * turn) ** 2 + 0.1195 * turn**2
    energy += 1.3051 * across**2 + 0.0022 * coupler**2
    energy += 16.7364 * (0.22 * turn + 0.13 * rod) ** 2 + 0.1699 * rod**2
    data = json.loads(run("reduce", EXAMPLE, "--json", "--at", "190 mm").stdout)
    assert_allclose(data["reduced_mass"], energy / v**2, rtol=2e-5)
    platen = [column[0] for name, column in data["mass_parts"].items() if name.endswith("platen")]
    assert_allclose(platen, (298.4963 + 97.4437) * data["gains"]["toggle-clamp.platen"][0] ** 2)
    weight = 16.1475 * 0.11 * turn + 16.7364 * (0.22 * turn + 0.13 * rod) - 1.3051 * half * math.cos(1.89156)
    assert_allclose(data["reduced_force"], -9.80665 * weight / v, rtol=2e-4)


def test_json_of_a_driver_that_turns(lever):
    data = json.loads(run("reduce", lever, "--json", "--at", "60 deg").stdout)
    assert data["reduction"] == "crank"
    assert_allclose(data["inertia"], 3 * 0.2**2)
    assert_allclose(data["driving_torque"], 3 * 3 * 0.2**2)
    assert not {"x", "reduced_mass", "driving_force"} & set(data)


def test_every_key_is_explained(lever):
    for scene in (EXAMPLE, lever):
        data = json.loads(run("reduce", scene, "--json", "--points", 2).stdout)
        assert all(f"`{key}`" in text("stroke") for key in {*data, *data["stroke"]} - {"title"})


def test_csv_runs_from_end_to_end_with_its_units():
    rows = list(csv.DictReader(run("reduce", EXAMPLE, "--points", 6).stdout.splitlines()))
    assert_allclose([float(row["x [m]"]) for row in rows], [-0.06, -0.01, 0.04, 0.09, 0.14, 0.19])
    state = flywheel.reduce(flywheel.load(EXAMPLE), [0.19])
    last = {key: float(value) for key, value in rows[-1].items()}
    assert_allclose(last["m* [kg]"], state.inertia)
    assert_allclose(last["dm*/dx [kg/m]"], state.slope)
    for name, unit in (("rod", "1/m"), ("platen", "1")):
        assert_allclose(last[f"g toggle-clamp.{name} [{unit}]"], state.gains[f"toggle-clamp.{name}"])
    assert_allclose(last["dg/dx toggle-clamp.rod [1/m^2]"], state.gain_slopes["toggle-clamp.rod"])
    assert_allclose(last["dg/dx toggle-clamp.platen [1/m]"], state.gain_slopes["toggle-clamp.platen"])
    assert_allclose(last["v toggle-clamp.rod [rad/s]"], 0.6445, atol=5e-5)
    assert_allclose(last["a toggle-clamp.platen [m/s^2]"], -0.23527, atol=5e-6)
    assert {"F* [N]", "F_drive [N]"} <= set(last)


@pytest.mark.parametrize(
    ("at", "code", "words"), [("30 deg", 2, "no position"), ("0.2 m", 1, "x: found 0.2 m"), ("5", 2, "no")]
)
def test_places_that_a_stroke_does_not_have(at, code, words):
    result = run("reduce", EXAMPLE, "--at", at)
    assert (result.exit_code, result.stdout) == (code, "")
    assert words in result.stderr


def test_a_crank_has_angles(lever):
    result = run("reduce", lever, "--at", "30 mm")
    assert result.exit_code == 2
    assert "'30 mm' is no angle with its unit" in result.stderr


def test_sizing_refuses_in_one_line():
    result = run("size", EXAMPLE)
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert "a one-way stroke, which has no cycle and so no flywheel" in line


@pytest.mark.parametrize("option", [[], ["--simplify"]])
def test_the_graph_shows_the_slide(option):
    result = run("graph", EXAMPLE, *option)
    assert result.exit_code == 0, result.stderr
    assert "1:slide" in result.stdout
    assert "crank " not in result.stdout.replace("bell_crank", "")
