"""What `flywheel reduce` writes of machines whose torques depend on speed or time, and what it says of them."""

import json
import math
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.tables.reduction import reduced
from tests.regimes import GEARED, PUMP, SECTION_C
from tests.scenes import yoke

CLAMP = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.toml"
WHEEL = {"flywheel": {"inertia": 3}}


def test_the_speed_is_a_key_and_a_sentence():
    text, conditions = reduced(flywheel.load(SECTION_C | WHEEL), points=5, as_json=True)
    assert json.loads(text)["speed"] == pytest.approx(10 / 2.387, rel=1e-12)
    assert conditions == "of M*: what depends on speed is taken at a constant 4.18935903 rad/s"


def test_a_balance_keeps_the_speed_asked():
    text, conditions = reduced(flywheel.load(PUMP | WHEEL), points=5, as_json=True)
    assert json.loads(text)["speed"] == pytest.approx(4 * 3.141592653589793)
    assert "12.5663706 rad/s" in conditions


@pytest.mark.slow
def test_position_alone_needs_no_words():
    text, conditions = reduced(flywheel.load(yoke()), points=5, as_json=True)
    assert json.loads(text)["speed"] is None
    assert conditions == ""


def test_losses_and_times_are_named():
    assert reduced(flywheel.load(GEARED | WHEEL), points=2)[1] == "of M*: losses in meshes are left out"
    timed = SECTION_C | WHEEL | {"load": [{"on": "slider-crank.slider", "force": "-5 - 2*(t > 1)"}]}
    assert reduced(flywheel.load(timed), points=2)[1].endswith("; what depends on time is taken at t = 0")


def test_csv_alone_goes_to_standard_output(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text('drive.torque = "10 - 2*omega"\ninertia = [{on = "crank", value = 1}]\nflywheel.inertia = 2\n')
    result = CliRunner().invoke(main, ["reduce", str(path), "--points", "2"])
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("phi [rad],")
    assert result.stderr == "of M*: what depends on speed is taken at a constant 5 rad/s\n"


def test_a_stroke_is_told_by_its_own_speed():
    scene = tomllib.loads(CLAMP.read_text(encoding="utf-8"))
    bare = json.loads(reduced(flywheel.load(scene), [0.1], as_json=True)[0])
    loaded = {**scene, "load": [{"on": "platen", "force": "-3*v"}]}
    text, conditions = reduced(flywheel.load(loaded), [0.1], as_json=True)
    assert conditions == "of F*: what depends on speed is taken at a constant 0.3289474 m/s"
    gain = bare["gains"]["toggle-clamp.platen"][0]
    added = json.loads(text)["reduced_force"][0] - bare["reduced_force"][0]
    assert added == pytest.approx(-3 * gain * gain * 0.3289474)


def columns_of(text):
    """Columns of a CSV by their heads."""
    names, *rows = (line.split(",") for line in text.splitlines())
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(names)}


def test_positions_stand_beside_the_influence_coefficients():
    """The source's read-out of the clamp at 190 mm: theta2, theta3, theta6 and the platen."""
    found = columns_of(reduced(flywheel.load(CLAMP), [0.19])[0])
    assert found["position toggle-clamp.bell_crank [rad]"] == pytest.approx([2.83967308], abs=1e-8)
    assert found["position toggle-clamp.coupler [rad]"] == pytest.approx([1.89155612], abs=1e-8)
    assert found["position toggle-clamp.platen [m]"] == pytest.approx([0.48], abs=2e-9)
    assert found["position toggle-clamp.rod.com.x [m]"] == pytest.approx([0.35], abs=2e-9)
    data = json.loads(reduced(flywheel.load(CLAMP), [0.19], as_json=True)[0])
    assert data["positions"]["toggle-clamp.platen"] == found["position toggle-clamp.platen [m]"]
    assert set(data["errors"]["positions"]) == set(data["positions"])
    assert 0.0 < data["errors"]["positions"]["toggle-clamp.platen"][0] < 1e-13


def test_positions_of_a_cycle_are_those_of_every_body():
    data = json.loads(reduced(flywheel.load(yoke()), [0.5], as_json=True)[0])
    assert data["positions"]["crank"] == [0.5]
    assert data["positions"]["scotch-yoke.yoke"][0] == pytest.approx(0.5 * math.cos(0.5), rel=1e-15)
    assert "position scotch-yoke.yoke [m]" in columns_of(reduced(flywheel.load(yoke()), [0.5])[0])


def test_the_acceleration_of_a_point_on_a_pivot_is_told_in_all_and_by_its_parts():
    """-1.3169 m/s² along its circle of 110 mm, 0.0638 towards the pivot; x and y from the angle, its rate and slope."""
    for at, rates in (([0.19], {}), ([0.05], {"stroke": {"from": -0.06, "to": 0.19, "speed": 0.5, "acceleration": 3.0}})):
        scene = flywheel.load(tomllib.loads(CLAMP.read_text(encoding="utf-8")) | rates)
        found = columns_of(reduced(scene, at)[0])
        data = json.loads(reduced(scene, at, as_json=True)[0])
        alpha, omega = (found[f"{kind} toggle-clamp.bell_crank [rad/s{of}]"][0] for kind, of in (("a", "^2"), ("v", "")))
        angle = found["position toggle-clamp.bell_crank [rad]"][0] + 0.30199 + math.pi
        x = -0.11 * (alpha * math.sin(angle) + omega**2 * math.cos(angle))
        y = 0.11 * (alpha * math.cos(angle) - omega**2 * math.sin(angle))
        true = {"": math.hypot(x, y), ".tangential": 0.11 * alpha, ".normal": 0.11 * omega**2, ".x": x, ".y": y}
        for part, value in true.items():
            name = f"toggle-clamp.bell_crank.com{part}"
            assert found[f"a {name} [m/s^2]"][0] == pytest.approx(value, rel=1e-12)
            assert data["accelerations"][name] == found[f"a {name} [m/s^2]"]
            assert abs(data["accelerations"][name][0] - value) <= data["errors"]["accelerations"][name][0] < 1e-11
    assert data["gains"]["toggle-clamp.bell_crank.com"][0] == found["g toggle-clamp.bell_crank.com [1]"][0]
