"""The command `power`: its table sums to the input, in both languages; its JSON; what it refuses."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from flywheel.cli import main

PUNCH = str(Path(__file__).parents[2] / "examples" / "regimes" / "punch_press.toml")


def run(*arguments):
    return CliRunner().invoke(main, ["power", *arguments])


def test_losses_and_loads_sum_to_the_input():
    found = run(PUNCH)
    assert found.exit_code == 0
    rows = {line[:24].strip(): line[24:].split()[0] for line in found.stdout.splitlines() if line[24:].split()}
    assert float(rows["comes in"]) == pytest.approx(float(rows["lost and arrived"]), abs=0.02)
    assert float(rows["rotor of the motor"]) + float(rows["mesh motor–crank"]) == pytest.approx(float(rows["is lost"]), 1e-4)
    assert "motor  1426.61       crank" in found.stdout


def test_at_an_angle_in_spanish_with_a_picture(tmp_path):
    picture = tmp_path / "flow.svg"
    found = run(PUNCH, "--at", "300 deg", "--language", "es", "--plot", str(picture), "--style", "print")
    assert found.exit_code == 0
    assert "a 300°" in found.stdout
    assert "llega" in found.stdout
    drawn = picture.read_text(encoding="utf-8")
    assert "Flujo de potencia con la manivela a 300°" in drawn


def test_json_is_that_of_the_sizing():
    found = run(PUNCH, "--json", "--at", "300 deg")
    data = json.loads(found.stdout)
    assert data["at"] == pytest.approx(5.2359877559829888)
    assert data["input"] == pytest.approx(data["output"] + data["losses"], rel=1e-12)
    powers = {stream["kind"]: stream["power"] for stream in data["streams"] if stream["kind"] in ("input", "rotor", "drive")}
    assert powers["input"] == pytest.approx(powers["rotor"] + powers["drive"], rel=1e-12)
    assert 0.0 < data["error"] < 1e-8


def test_what_it_refuses(tmp_path):
    areas = tmp_path / "areas.toml"
    areas.write_text("areas = {values = [5, -5], scale = 1}\nregime.speed = 9\nflywheel.inertia = 1\n", encoding="utf-8")
    found = run(str(areas))
    assert found.exit_code == 1
    assert "found a diagram of areas, expected a machine; areas do not tell where power goes" in found.stderr
    assert run(PUNCH, "--at", "300").exit_code == 2
    assert run(PUNCH, "--at", "3 kg").exit_code == 2
    assert run(PUNCH, "--json", "--language", "es").exit_code == 2
    assert run(PUNCH, "--plot", "flow.txt").exit_code == 2
