"""What `flywheel reduce` writes of machines whose torques depend on speed or time, and what it says of them."""

import json
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.report.reduction import reduced
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
