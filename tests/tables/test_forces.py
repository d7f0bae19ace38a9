"""Tables of forces, power, reduction and trade-offs."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import flywheel
from flywheel import Sizing, joint_forces
from flywheel.cli import main
from flywheel.machine.reactions import close_positions
from flywheel.motions.joint_forces import closely, force_curves
from flywheel.study.tradeoff import ordered
from flywheel.tables import power as figures
from flywheel.tables.designs import error, tradeoff_text, unfinished
from flywheel.tables.reduction import forces_csv as csv_text
from flywheel.tables.reduction import forces_text as text
from flywheel.tables.reduction import reduced
from flywheel.tables.rows import plain
from tests.cli.test_cli import YOKE, run
from tests.regimes import GEARED, SECTION_C
from tests.regimes import PUMP as REDUCTION_PUMP
from tests.scenes import crank_press, rotor, straight_drive, yoke
from tests.study.test_comparison import compared, whole
from tests.study.test_comparison import row as tradeoff_row
from tests.tables.test_sizing import PRESS as POWER_PRESS
from tests.tables.test_sizing import sized_regime as sized

# `flywheel reactions`: tables, CSV, JSON and pictures of the forces in joints, and its faults.


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


def test_only_angles_at_which_a_law_switches_have_two_sides() -> None:
    """The jaw crusher's load acts while the jaw closes: between its dead centres, whatever ends a cell beside them."""
    crusher = EXAMPLES / "linkages" / "six_bar.toml"
    machine = flywheel.Machine(flywheel.load(crusher))
    at = close_positions(machine, 0)
    assert np.degrees(at) == pytest.approx([89.3036899] * 3 + [269.277025] * 3, abs=1e-6)
    assert machine.breakpoints.size > 4  # and 0, 360, and the angle at which a cell ends
    rows = run("reactions", crusher, "--csv", "--points", 5, "--breaks").stdout.splitlines()
    assert len(rows) == 1 + 5 + 6


def test_a_stroke_is_looked_at_up_to_both_ends() -> None:
    scene = flywheel.load(CLAMP)
    at = close_positions(flywheel.Machine(scene), 360)
    assert scene.stroke is not None
    assert (at[0], at[-1]) == pytest.approx((scene.stroke.start, scene.stroke.end), rel=1e-15)


def test_rounding_is_nought_in_the_text_and_stays_in_the_data() -> None:
    loaded = flywheel.load(straight_drive())
    forces = joint_forces(loaded)
    normal = forces.mechanisms["linkage"].components["bore"]["normal"]
    assert np.abs(normal).max() < 1e-9
    normal[7] = 3e-14  # as another processor may round it
    assert "bore: 0 N at" in text(loaded, forces)
    assert "share of the moment is 0 N m" in text(loaded, forces)
    assert "3e-14" in csv_text(loaded, forces)


def test_csv_has_the_library_s_figures() -> None:
    result = run("reactions", PUMP, "--csv", "--points", "8")
    rows = list(csv.DictReader(io.StringIO(result.stdout)))
    outcome = joint_forces(flywheel.load(PUMP), np.arange(8) * np.pi / 4)
    forces = outcome.mechanisms["linkage"]
    assert [float(row["omega [rad/s]"]) for row in rows] == outcome.motion.omega.tolist()
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


# Power with the flywheel and without it, beside what the motor is rated for.


RPM = 0.10471975511965977  # rad/s


def lines(sizing: Sizing) -> str:
    return "\n".join(figures.with_and_without(sizing))


def row(text: str, name: str) -> list[float]:
    result = next(line for line in text.splitlines() if line.strip().startswith(name))
    return [float(cell) for cell in result.replace(name, "").split()]


def test_a_balanced_drive_evens_out_with_the_flywheel() -> None:
    sizing = sized(yoke())  # 1000 N against the yoke over half a turn at 60 rpm: 1000 J a turn
    text = lines(sizing)
    assert row(text, "mean, W")[1] == pytest.approx(1000)
    assert row(text, "greatest, W") == pytest.approx([1000 * 1.02, 1000 * 3.14159265], rel=1e-5)
    assert row(text, "greatest over mean")[1] == pytest.approx(3.14159265, rel=1e-5)
    assert row(text, "energy in an hour, kWh")[1] == pytest.approx(1.0)


def test_a_mean_of_nought_has_no_ratio() -> None:
    text = lines(sized(SECTION_C | {"flywheel": {"inertia": 2}}))
    assert row(text, "mean, W") == [0.0, 0.0]
    assert "greatest over mean" not in text


def test_the_motor_s_rating_stands_beside() -> None:
    text = " ".join(lines(sized(POWER_PRESS)).split())
    assert "induction motor, rated power 3 kW (19.8944 N m at 1440 rpm): mean 72.2 %" in text
    assert "too hot" not in text
    assert "stalls" not in text
    energy = sized(POWER_PRESS).energy
    assert energy is not None
    rms = re.search(r"root of its mean square over time ([0-9.]+) N m, ([0-9.]+) % of the rated one", text)
    assert rms is not None
    assert float(rms[1]) == pytest.approx(energy.rms_torque, rel=1e-5)
    assert float(rms[2]) == pytest.approx(100 * energy.rms_torque / 19.8944, rel=1e-2)
    torque = re.search(r"greatest torque ([0-9.]+) N m on its shaft, ([0-9.]+) % of the rated one, ([0-9.]+) % of the", text)
    assert torque is not None  # near 1410 rpm, where power is greatest too
    assert float(torque[3]) == pytest.approx(float(torque[2]) / 2.5, rel=0.01)
    assert float(torque[1]) == pytest.approx(energy.peak_power / (12 * 12.4), rel=0.01)


def test_too_small_a_motor_is_warned_of() -> None:
    drive = {**POWER_PRESS["drive"], "motor": {**POWER_PRESS["drive"]["motor"], "power": "1.5 kW"}}
    wheel = {"on": "motor", "irregularity": 0.15}
    text = " ".join(lines(sized(POWER_PRESS | {"drive": drive, "flywheel": wheel})).split())
    assert "too hot for continuous running. Choose a larger motor: even at a constant speed it would be" in text
    assert "of the breakdown torque" in text


def test_motors_without_a_rating_or_a_fall_are_told_of() -> None:
    dc = {"type": "dc", "voltage": 48, "resistance": 0.5, "constant": 0.6}
    text = lines(sized(SECTION_C | {"drive": {"motor": dc}, "load": [{"on": "crank", "torque": "-5 N m"}],
                                    "flywheel": {"inertia": 2}}))  # fmt: skip
    assert "DC motor without a rated point; greatest torque" in text
    assert "Mean copper heat of its armature" in text
    assert "unknown without a rated point" in " ".join(text.split())
    constant = rotor(drive={"motor": {"type": "constant", "torque": "50 N m"}})
    constant["load"] = [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}]
    text = lines(sized(constant))
    assert "greatest torque 50 N m" in text
    assert "rated" not in text.replace("without a rated point", "")
    assert "does not give its losses" in text


def test_a_motor_that_brakes_is_said_to() -> None:
    load = [{"on": "crank", "torque": "100 N m", "from": 0, "to": "180 deg"}]
    text = lines(sized(rotor(load=load)))
    mean = next(line for line in text.splitlines() if line.strip().startswith("mean, W"))
    assert mean.count("(it brakes)") == 2
    assert "-" in mean


def press(power_: str, rpm: str, wheel: dict[str, object], ratio: float = 2.5) -> dict[str, object]:
    """The press on another induction motor."""
    motor = {**POWER_PRESS["drive"]["motor"], "power": power_, "speed": rpm, "breakdown_ratio": ratio}
    return POWER_PRESS | {"drive": {"on": "motor", "motor": motor}, "flywheel": {"on": "motor", **wheel}}


def test_a_motor_whose_torque_is_within_its_rating_may_have_too_much_heat() -> None:
    """Torque by its root mean square does not heat a rotor: slip does, and that grows more than torque does."""
    sizing = sized(press("2.6 kW", "1300 rpm", {"inertia": 0.09}, 1.6))
    energy = sizing.energy
    assert energy is not None
    assert energy.rotor_heat_share is not None
    rated = 2600 / (1300 * RPM)
    assert energy.rms_torque < rated
    assert energy.rotor_heat_share > 1.2
    text = " ".join(lines(sizing).split())
    rotor_heat = re.search(r"heat of its rotor .*?: ([0-9.]+) W, ([0-9.]+) % of the ([0-9.]+) W at the rated point", text)
    assert rotor_heat is not None
    assert float(rotor_heat[1]) == pytest.approx(energy.rotor_heat, rel=1e-4)
    assert float(rotor_heat[2]) == pytest.approx(100 * energy.rotor_heat_share, rel=1e-3)
    assert float(rotor_heat[3]) == pytest.approx(rated * 200 * RPM, rel=1e-4)
    assert "too hot for continuous running. Choose a larger motor, or more flywheel: at a constant speed" in text


def test_more_flywheel_cures_what_it_is_said_to_cure() -> None:
    heavy = sized(press("2.6 kW", "1300 rpm", {"inertia": 50.0}, 1.6))
    text = " ".join(lines(sized(press("2.6 kW", "1300 rpm", {"inertia": 0.09}, 1.6))).split())
    output = re.search(r"at a constant speed it would be ([0-9.]+) %", text)
    assert output is not None
    assert heavy.energy is not None
    assert float(output[1]) == pytest.approx(100 * (heavy.energy.rotor_heat_share or 0.0), rel=5e-3)
    assert "within its rating" in " ".join(lines(heavy).split())


def test_an_induction_motor_past_its_breakdown_is_told_of() -> None:
    text = " ".join(lines(sized(press("1.5 kW", "1440 rpm", {"irregularity": 0.25}))).split())
    assert "past the breakdown torque, 24.868 N m at 1212.52 rpm" in text
    assert "is inaccurate there" in text


DC_PLATE = {"type": "dc", "voltage": 220, "power": "3 kW", "speed": "1440 rpm", "efficiency": 0.82}


def test_a_dc_motor_is_judged_by_its_copper_heat() -> None:
    sizing = sized(POWER_PRESS | {"drive": {"on": "motor", "motor": DC_PLATE}, "flywheel": {"on": "motor", "inertia": 0.1}})
    energy, text = sizing.energy, " ".join(lines(sizing).split())
    assert energy is not None
    assert energy.copper_heat_share is not None
    current = 3000 / (0.82 * 220)
    shares = re.search(r"mean square over time ([0-9.]+) A, ([0-9.]+) % of the rated one; greatest ([0-9.]+) A", text)
    assert shares is not None
    assert float(shares[1]) == pytest.approx(energy.current_rms, rel=1e-4)
    assert float(shares[2]) == pytest.approx(100 * float(shares[1]) / current, rel=1e-2)
    assert energy.copper_heat_share == pytest.approx((float(shares[1]) / current) ** 2, rel=1e-4)
    assert ("too hot" in text) == (energy.copper_heat_share > 1)


ENGINE = {
    "load": [{"on": "crank", "torque": "-570 N m", "from": "180 deg", "to": "270 deg"}],
    "drive": {"motor": {"type": "engine", "speed": "1500 rpm", "droop": "8 %", "torque": "148 N m"}},
    "flywheel": {"irregularity": "3 %"},
}


def test_an_engine_has_full_load_and_a_governor_and_no_breakdown_and_no_windings() -> None:
    text = " ".join(lines(sized(ENGINE)).split())
    assert "governed engine, full load 23.2478 kW (148 N m at 1500 rpm): mean" in text
    assert "below 1500 rpm, the greatest speed at full load" in text
    for word in ("breakdown", "heat", "hot", "mean square", "rated", "stall"):
        assert word not in text


def test_a_straight_line_and_a_table_are_judged_by_nothing_that_is_not_known() -> None:
    load = [{"on": "crank", "torque": "-30 N m", "from": 0, "to": "180 deg"}]
    line = {"type": "line", "no_load_speed": "1500 rpm", "speed": "1400 rpm", "power": "2 kW"}
    text = " ".join(lines(sized({"load": load, "drive": {"motor": line}, "flywheel": {"irregularity": 0.03}})).split())
    assert "The mean power is more than the rated one." in text
    assert "hot" not in text
    table = {"type": "table", "speed": [1200, 1300, 1400, 1450], "torque": [30, 32, 20, 10], "speed_unit": "rpm"}
    text = " ".join(lines(sized({"load": load, "drive": {"motor": table}, "flywheel": {"irregularity": 0.1}})).split())
    assert "It runs from 1346.73 to 1488.49 rpm, but its data cover 1200 to 1450 rpm" in text
    for word in ("hot", "breakdown", "rated point at"):
        assert word not in text


@pytest.mark.slow
def test_a_long_cycle_is_no_mean() -> None:
    slow = {
        "type": "induction",
        "power": "3 kW",
        "speed": "1440 rpm",
        "poles": 4,
        "frequency": "50 Hz",
        "breakdown_ratio": 2.5,
    }
    drive = {"on": "motor", "motor": slow}
    load = [{"on": "crank", "torque": "-30 kN m", "from": 0, "to": "180 deg"}]
    scene = {"shafts": {"motor": {"ratio": 2000}}, "load": load, "drive": drive}
    text = lines(sized(scene | {"flywheel": {"on": "motor", "inertia": 0.1}}))
    assert "above the mean for a while" in " ".join(text.split())


def test_a_motor_with_a_relief_valve_gives_no_less_where_the_valve_is_open() -> None:
    motor = {"type": "hydraulic", "displacement": "164 cm^3", "flow": "360 l/min", "pressure": "70 bar"}
    motor |= {"volumetric_efficiency": 0.91, "mechanical_efficiency": 0.93}
    load = {"on": "crank", "torque": "-520 N m", "from": 0, "to": "90 deg"}
    sizing = sized({"load": [load], "drive": {"motor": motor}, "flywheel": {"irregularity": 0.3}})
    (output,) = figures.warnings(sizing, sizing.scene.motor)
    assert "the flywheel gives the rest of the load" in output
    assert "gives less" not in output


# What `flywheel reduce` writes of machines whose torques depend on speed or time, and what it says of them.


REDUCTION_CLAMP = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.toml"
WHEEL = {"flywheel": {"inertia": 3}}


def test_the_speed_is_a_key_and_a_sentence():
    text, conditions = reduced(flywheel.load(SECTION_C | WHEEL), points=5, as_json=True)
    assert json.loads(text)["speed"] == pytest.approx(10 / 2.387, rel=1e-12)
    assert conditions == "of M*: torques that depend on speed are those at a constant 4.18935903 rad/s"


def test_a_balance_keeps_the_speed_asked():
    text, conditions = reduced(flywheel.load(REDUCTION_PUMP | WHEEL), points=5, as_json=True)
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
    assert reduced(flywheel.load(timed), points=2)[1].endswith("; loads that depend on time are those at t = 0")


def test_csv_alone_goes_to_standard_output(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text('drive.torque = "10 - 2*omega"\ninertia = [{on = "crank", value = 1}]\nflywheel.inertia = 2\n')
    result = CliRunner().invoke(main, ["reduce", str(path), "--points", "2"])
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("phi [rad],")
    assert result.stderr == "of M*: torques that depend on speed are those at a constant 5 rad/s\n"


def test_a_stroke_is_told_by_its_own_speed():
    scene = tomllib.loads(REDUCTION_CLAMP.read_text(encoding="utf-8"))
    bare = json.loads(reduced(flywheel.load(scene), [0.1], as_json=True)[0])
    loaded = {**scene, "load": [{"on": "platen", "force": "-3*v"}]}
    text, conditions = reduced(flywheel.load(loaded), [0.1], as_json=True)
    assert conditions == "of F*: torques that depend on speed are those at a constant 0.3289474 m/s"
    gain = bare["gains"]["toggle-clamp.platen"][0]
    added = json.loads(text)["reduced_force"][0] - bare["reduced_force"][0]
    assert added == pytest.approx(-3 * gain * gain * 0.3289474)


def columns_of(text):
    """Columns of a CSV by their heads."""
    names, *rows = (line.split(",") for line in text.splitlines())
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(names)}


def test_positions_stand_beside_the_influence_coefficients():
    """The source's read-out of the clamp at 190 mm: theta2, theta3, theta6 and the platen."""
    result = columns_of(reduced(flywheel.load(REDUCTION_CLAMP), [0.19])[0])
    assert result["position toggle-clamp.bell_crank [rad]"] == pytest.approx([2.83967308], abs=1e-8)
    assert result["position toggle-clamp.coupler [rad]"] == pytest.approx([1.89155612], abs=1e-8)
    assert result["position toggle-clamp.platen [m]"] == pytest.approx([0.48], abs=2e-9)
    assert result["position toggle-clamp.rod.com.x [m]"] == pytest.approx([0.35], abs=2e-9)
    data = json.loads(reduced(flywheel.load(REDUCTION_CLAMP), [0.19], as_json=True)[0])
    assert data["positions"]["toggle-clamp.platen"] == result["position toggle-clamp.platen [m]"]
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
        scene = flywheel.load(tomllib.loads(REDUCTION_CLAMP.read_text(encoding="utf-8")) | rates)
        result = columns_of(reduced(scene, at)[0])
        data = json.loads(reduced(scene, at, as_json=True)[0])
        alpha, omega = (result[f"{kind} toggle-clamp.bell_crank [rad/s{of}]"][0] for kind, of in (("a", "^2"), ("v", "")))
        angle = result["position toggle-clamp.bell_crank [rad]"][0] + 0.30199 + math.pi
        x = -0.11 * (alpha * math.sin(angle) + omega**2 * math.cos(angle))
        y = 0.11 * (alpha * math.cos(angle) - omega**2 * math.sin(angle))
        true = {"": math.hypot(x, y), ".tangential": 0.11 * alpha, ".normal": 0.11 * omega**2, ".x": x, ".y": y}
        for part, value in true.items():
            name = f"toggle-clamp.bell_crank.com{part}"
            assert result[f"a {name} [m/s^2]"][0] == pytest.approx(value, rel=1e-12)
            assert data["accelerations"][name] == result[f"a {name} [m/s^2]"]
            assert abs(data["accelerations"][name][0] - value) <= data["errors"]["accelerations"][name][0] < 1e-11
    assert data["gains"]["toggle-clamp.bell_crank.com"][0] == result["g toggle-clamp.bell_crank.com [1]"][0]


# A comparison as text: question, reference, table, what is missing, what follows.


def lines_of(found):
    return tradeoff_text(found).splitlines()


def line(found, start):
    return next(each for each in lines_of(found) if each.strip().startswith(start))


def test_the_question_and_its_reference_come_first():
    output = lines_of(whole())
    assert output[:3] == [
        "Rotor",
        "Accuracy against time: the exact flywheel, to a relative error of 1e-06",
        "  reference  2 kg m², with an error of 1.0e-14 (relative)",
    ]
    assert "Second route: the closed form is 1e-15 apart" in tradeoff_text(whole())
    assert "Errors are relative to 2.5 kg m²" in tradeoff_text(whole())


def test_an_analysis_has_no_unit_and_no_scale():
    output = tradeoff_text(compared(figure="irregularity", unit="", scale=0.0, title=None))
    assert output.startswith("Accuracy against time: the irregularity")
    assert "  reference  2, with an error" in output
    assert "Errors are relative" not in output


def test_a_line_of_the_table_has_all_that_was_measured():
    assert line(whole(), "36 steps, restarted").split()[3:] == ["4.0e-07", "yes", "400", "625", "100", "7"]
    assert line(whole(), "accumulated areas").split()[2:] == ["2.0e-02", "no", "0.6", "0.94", "100", "7"]


def test_errors_below_the_doubt_are_told_as_that():
    assert line(whole(), "rtol 1e-06").split()[2:4] == ["<", "1.0e-14"]
    assert error(whole(), tradeoff_row("a", error=0.0)) == "< 1.0e-14"
    assert error(whole(), tradeoff_row("a", error=1.1e-14)) == "1.1e-14"


def test_the_cheapest_and_its_equals_are_marked():
    result = whole()
    assert line(result, "rtol 1e-06").endswith("cheapest")
    assert line(result, "rtol 0.001").endswith("level")
    assert not line(result, "36 angles").endswith(("cheapest", "level", "promised"))
    promised = compared(*result.rows, cheapest=result.rows[0].name, cheapest_promised=result.cheapest)
    assert line(promised, "rtol 1e-06").endswith("promised")


def test_without_a_cheapest_there_is_no_ratio():
    result = compared(tradeoff_row("plain grid", "36 angles", 0.1))
    header = next(each for each in lines_of(result) if "time, ms" in each)
    assert "ratio" not in header
    assert header.split() == ["error", "keeps", "time,", "ms", "positions", "runs"]
    assert line(result, "36 angles").split()[2:] == ["1.0e-01", "no", "1", "100", "7"]


def test_families_stand_together_in_order():
    output = [each.strip() for each in lines_of(whole())]
    heads = [own for own in output if own in {entry.family for entry in whole().rows}]
    assert heads == ["plain grid", "exact, closed form", "time stepping, Euler", "time stepping, RK4"]
    fixed = [own.name for own in ordered(whole().rows) if "RK4" in own.name]
    assert fixed == ["time stepping, RK4, 36 steps, restarted", "time stepping, RK4, 36 steps"]
    assert [own.family for own in ordered([tradeoff_row("unheard of"), tradeoff_row("collocation")])] == [
        "collocation",
        "unheard of",
    ]


def test_those_without_an_answer_are_told_with_the_reason():
    output = lines_of(whole())
    assert "  not run (the budget was spent): time stepping, Euler, without restart" in output
    assert "  no answer (the machine stops): Lagrange's multipliers" in output
    assert "  not for this scene: whole bond graph: it takes no springs" in output


def test_one_reason_is_told_once():
    rows = [tradeoff_row("time stepping, RK4", f"{n} steps{r}", None) for n in (36, 360) for r in ("", ", restarted")]
    rows += [tradeoff_row("time stepping, RK45", f"rtol {rtol:g}, restarted", None) for rtol in (1e-6, 1e-9)]
    rows += [tradeoff_row("time stepping, RK45", "rtol 1e-06")]
    rows += [tradeoff_row("plain grid", f"{n} angles", None if n == 36 else 0.1) for n in (36, 360)]
    output = tradeoff_text(compared(*rows))
    assert output.count("not run") == 1
    assert "not run: plain grid (36 angles); time stepping, RK4; time stepping, RK45, restarted\n" in output


def test_what_methods_leave_out_is_told_once():
    output = lines_of(whole())
    assert "  accumulated areas: that I* varies over the cycle" in output
    assert "  plain grid: angles between" in output
    assert "  time stepping, Euler, RK4, without restart: jumps within steps" in output


@pytest.mark.parametrize("changes", [{}, {"interrupted": True}])
def test_a_table_that_is_not_whole_says_so_in_its_last_line(changes):
    result = compared(tradeoff_row("plain grid", "36 angles"), tradeoff_row("collocation", "", None), budget=30.0, **changes)
    wanted = {
        False: "INCOMPLETE: 1 of 2 methods were run to completion within 30 s; --budget 60 runs more.",
        True: "INCOMPLETE: interrupted; 1 of 2 methods were run to completion.",
    }[result.interrupted]
    assert lines_of(result)[-1] == wanted
    assert unfinished(result) == [wanted]


def test_nothing_finished_is_a_text_too():
    output = tradeoff_text(compared(tradeoff_row("plain grid", "36 angles", None), interrupted=True))
    assert "No method that was run keeps" in output
    assert "time, ms" not in output


def test_the_width_is_kept():
    wide = whole()
    slow = tuple(own if own.seconds is None else own._replace(seconds=37.123456 * own.seconds / 1e-3) for own in wide.rows)
    assert max(map(len, lines_of(compared(*slow, cheapest=wide.cheapest, cheapest_promised=slow[3].name)))) <= 100


@pytest.mark.parametrize(
    ("value", "decimals", "message"),
    [
        (0.0123456, 3, "0.012"),
        (0.123456, 3, "0.123"),
        (12.3456, 3, "12.3"),
        (123456.0, 3, "123000"),
        (1.0, 2, "1"),
        (3e-5, 2, "0.00003"),
    ],
)
def test_numbers_without_exponents(value, decimals, message):
    assert plain(value, decimals) == message
