"""Motors and wheels read."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flywheel
from flywheel import Scene, SceneError, load
from flywheel.components.motors import Curve, Point, line_through
from flywheel.components.wheel_stresses import MATERIALS, WheelAsked, material
from flywheel.reading.motors import MOTORS
from flywheel.reading.scenes import parse_scene
from flywheel.reference import text
from flywheel.scene.scene import Inertia

# Motors as a scene writes them, and a clear line for every one that cannot be.


RPM = math.pi / 30
INDUCTION = "type = 'induction', power = '7.5 kW', speed = '1450 rpm', poles = 4, frequency = '50 Hz', breakdown_ratio = 2.5"
PLATE = "type = 'dc', voltage = '220 V', power = '1.5 kW', speed = '1000 rpm'"


def scene(motor: str, on: str = "motor", folder=None, more: str = "") -> Scene:
    source = f"""
shafts.motor.ratio = 5
drive = {{on = "{on}", motor = {{{motor}}}{more}}}
regime.speed = 10
flywheel.irregularity = 0.05
"""
    return parse_scene(source, folder=folder)


def faults(motor: str, folder=None, more: str = "") -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        scene(motor, folder=folder, more=more)
    lines = [str(fault) for fault in caught.value.faults]
    assert all("\n" not in line for line in lines)
    return {fault.path: line for fault, line in zip(caught.value.faults, lines, strict=True)}


@pytest.mark.parametrize(
    ("motor", "speed", "torque"),
    [
        ("type = 'constant', torque = '40 N m'", 7.0, 40.0),
        ("type = 'line', starting_torque = '10 N m', slope = '2.387 N m s'", 2.0, 10 - 2 * 2.387),
        ("type = 'line', starting_torque = '1 kNm', no_load_speed = '300 rpm'", 5 * math.pi, 500.0),
        ("type = 'line', no_load_speed = '1500 rpm', speed = '1450 rpm', torque = '50 N m'", 1475 * RPM, 25.0),
        ("type = 'line', no_load_speed = '1500 rpm', speed = '1450 rpm', power = '8 kW'", 1450 * RPM, 8000 / (1450 * RPM)),
        ("type = 'table', speed = [0, 100, 150], torque = [20, 30, 0]", 125.0, 15.0),
        ("type = 'table', speed = [0, 60], torque = [2, 1], speed_unit = 'rpm', torque_unit = 'kNm'", math.pi, 1500.0),
        ("type = 'dc', voltage = '48 V', resistance = '400 mohm', constant = '0.25 N m/A'", 96.0, 15.0),
        ("type = 'dc', voltage = 48, resistance = 0.4, constant = 0.25, friction = '0.01 N m s'", 96.0, 14.04),
        (PLATE + ", current = '8 A'", 1000 * RPM, 1500 / (1000 * RPM)),
        (PLATE + ", efficiency = '82 %', armature_share = '60 %'", 1000 * RPM, 1500 / (1000 * RPM)),
        (INDUCTION, 1450 * RPM, 7500 / (1450 * RPM)),
        ("type = 'engine', speed = '1500 rpm', torque = '200 N m', droop = '8 %'", 1560 * RPM, 100.0),
        ("type = 'engine', speed = '1500 rpm', power = '30 kW', droop = 0.08", 1000 * RPM, 30e3 / (1500 * RPM)),
        ("type = 'engine', speed = 150, droop = 0.1, full_load = {speed = [80, 160], torque = [100, 180]}", 157.5, 85.0),
        ("type = 'engine', speed = 150, torque = 90, droop = 0.1, braking_torque = '9 N m', idle = 50", 400.0, -9.0),
    ],
)
def test_motors(motor, speed, torque):
    result = scene(motor)
    assert result.motor.torque(speed) == pytest.approx(torque, rel=1e-12)
    assert result.drive.law == result.motor.law()
    assert (result.drive.on, result.drive.path, result.drive.model) == ("motor", "drive", result.motor.title)
    assert (result.unknown, result.inertias) == (None, ())


def test_the_machine_of_the_course():
    result = scene("type = 'line', starting_torque = '10 N m', slope = '2.387 N m s'")
    assert result.drive.law.text == "10.0 - 2.387*omega"


def test_a_rated_point_is_kept():
    result = scene("type = 'line', no_load_speed = 157, speed = 150, torque = 35").motor
    assert result == line_through(157.0, Point(150.0, 35.0))
    plate = scene(PLATE + ", efficiency = 0.82, inductance = '3 mH'").motor
    assert plate.rated.power == pytest.approx(1500.0)
    assert plate.current(plate.rated.speed) == pytest.approx(1500 / (0.82 * 220))
    assert plate.inductance == 0.003


def test_a_rotor_is_an_inertia_on_the_shaft_it_drives():
    result = scene(INDUCTION + ", inertia = '0.03 kg m^2'")
    assert result.inertias == (Inertia("motor", 0.03, "drive.motor.inertia"),)
    assert result.motor.inertia == 0.03


def test_a_table_from_a_file(tmp_path):
    (tmp_path / "curve.csv").write_text("rpm; amps; Nm\n0; 9; 20\n600; 7; 24.5\n900; 2; 0\n")
    motor = "type = 'table', file = 'curve.csv', column = 'Nm', speed_unit = 'rpm', interpolation = 'pchip'"
    result = scene(motor, folder=tmp_path).motor
    np.testing.assert_allclose(result.speeds, [0.0, 600 * RPM, 900 * RPM], rtol=1e-15)
    assert result.torques == (20.0, 24.5, 0.0)
    assert result.interpolation == "pchip"
    engine = (
        "type = 'engine', speed = '800 rpm', droop = 0.1, full_load = {file = 'curve.csv', column = 3, speed_unit = 'rpm'}"
    )
    assert isinstance(scene(engine, folder=tmp_path).motor.full_load, Curve)


def test_a_scene_with_a_motor_needs_no_speed():
    result = parse_scene("""
[[load]]
on = "crank"
torque = -5
[drive]
motor = {type = "line", starting_torque = 10, slope = 2}
[flywheel]
inertia = 1
""")
    assert result.speed is None


@pytest.mark.parametrize(
    ("motor", "path", "hint"),
    [
        ("", "drive.motor.type", "nothing"),
        ("type = 'steam'", "drive.motor.type", "induction"),
        ("type = 'enigne'", "drive.motor.type", 'did you mean "engine"?'),
        ("type = 3", "drive.motor.type", "found 3"),
        ("type = 'constant'", "drive.motor.torque", "nothing"),
        ("type = 'constant', torque = -3", "drive.motor.torque", "above 0"),
        ("type = 'constant', torque = '3 J'", "drive.motor.torque", "energy"),
        ("type = 'constant', torque = 3, slope = 2", "drive.motor.slope", 'key "slope"'),
        ("type = 'constant', torque = 3, inertia = '-1 kg m^2'", "drive.motor.inertia", "at least 0"),
        ("type = 'line'", "drive.motor", "no values"),
        ("type = 'line', starting_torque = 3", "drive.motor", "starting_torque and slope; or no_load_speed"),
        ("type = 'line', starting_torque = 3, slope = 1, no_load_speed = 3", "drive.motor", "no_load_speed and slope and"),
        ("type = 'line', no_load_speed = 100, speed = 100, torque = 3", "drive.motor.speed", "below the no-load speed"),
        ("type = 'line', starting_torque = 3, slope = '2 Hz'", "drive.motor.slope", "N m s/rad"),
        ("type = 'table'", "drive.motor", "no rows"),
        ("type = 'table', speed = [0, 1]", "drive.motor", "either file"),
        ("type = 'table', speed = [0, 1], torque = 3", "drive.motor.torque", "a list"),
        ("type = 'table', speed = [0, 'x'], torque = [3, 2]", "drive.motor.speed[1]", "finite number"),
        ("type = 'table', speed = [0, 1, 1], torque = [3, 2, 1]", "drive.motor.speed[2]", "ascend"),
        ("type = 'table', speed = [0, 1], torque = [3, 2, 1]", "drive.motor.torque", "2 speeds and 3 torques"),
        ("type = 'table', speed = [0, 1], torque = [3, 2], speed_unit = 'Hz'", "drive.motor.speed_unit", "rev/s"),
        ("type = 'table', speed = [0, 1], torque = [3, 2], torque_unit = 5", "drive.motor.torque_unit", "found 5"),
        ("type = 'table', speed = [0, 1], torque = [3, 2], column = 2", "drive.motor", "either file"),
        ("type = 'table', speed = [0, 1], torque = [3, 2], interpolation = 'step'", "drive.motor.interpolation", "pchip"),
        ("type = 'table', speed = [0, 1e300], torque = [3, 2]", "drive.motor.speed", "at most 1e+50"),
        ("type = 'table', speed = [0, 1e308], torque = [3, 2], speed_unit = 'rev/s'", "drive.motor.speed", "floating-point"),
        ("type = 'table', file = 'curve.csv'", "drive.motor.file", "folder"),
        ("type = 'dc', voltage = '48 V'", "drive.motor", "a voltage alone"),
        ("type = 'dc', voltage = '48 V', resistance = 1", "drive.motor.constant", "motor constant such as"),
        ("type = 'dc', voltage = '48 V', resistance = 1, constant = 1, power = 3", "drive.motor", "either resistance"),
        ("type = 'dc', voltage = '48 A', resistance = 1, constant = 1", "drive.motor.voltage", "unit of current"),
        ("type = 'dc', voltage = '48 V', power = 3, current = 1", "drive.motor.speed", "nothing"),
        (PLATE, "drive.motor", "exactly one of current, efficiency"),
        (PLATE + ", current = 8, efficiency = 0.8", "drive.motor", "exactly one"),
        (PLATE + ", efficiency = 1.2", "drive.motor.efficiency", "below 1"),
        (PLATE + ", current = '5 A'", "drive.motor.power", "less than voltage times current"),
        (INDUCTION.replace("poles = 4", "poles = 6"), "drive.motor.speed", "has 4 poles"),
        (INDUCTION.replace("poles = 4", "poles = 3"), "drive.motor.poles", "even"),
        (INDUCTION.replace("poles = 4", "poles = 2.5"), "drive.motor.poles", "even"),
        (INDUCTION.replace("2.5", "0.9"), "drive.motor.breakdown_ratio", "above 1"),
        (INDUCTION.replace("50 Hz", "50 rpm"), "drive.motor.frequency", "frequency such as"),
        (INDUCTION.replace("poles = 4, ", ""), "drive.motor.poles", "nothing"),
        ("type = 'engine', speed = 150, droop = 0.1", "drive.motor", "none of torque, power, full_load"),
        ("type = 'engine', speed = 150, droop = 0, torque = 3", "drive.motor.droop", "above 0"),
        ("type = 'engine', speed = 150, droop = 0.1, torque = 3, power = 3", "drive.motor", "torque and power"),
        ("type = 'engine', speed = 150, droop = 0.1, torque = 3, idle = 150", "drive.motor.idle", "below the rated speed"),
        ("type = 'engine', speed = 150, droop = 0.1, full_load = 3", "drive.motor.full_load", "a table"),
        (
            "type = 'engine', speed = 150, droop = 0.1, full_load = {speed = [1, 0], torque = [3, 2]}",
            "drive.motor.full_load.speed[1]",
            "ascend",
        ),
        (
            "type = 'engine', speed = 150, droop = 0.1, full_load = {speed = [0, 100], torque = [3, 2]}",
            "drive.motor.full_load",
            "rated speed of 150",
        ),
        (
            "type = 'engine', speed = 150, droop = 0.1, full_load = {speed = [0, 200], torque = [3, 2], inertia = 1}",
            "drive.motor.full_load.inertia",
            "key",
        ),
    ],
)
def test_faulty_motors(motor, path, hint):
    result = faults(motor)
    assert list(result) == [path]
    assert hint in result[path]


def test_all_faults_come_at_once():
    result = faults("type = 'induction', power = -1, speed = '5 Hz', poles = 1, frequency = 'x', ratio = 2")
    assert set(result) == {
        f"drive.motor.{key}" for key in ("power", "speed", "poles", "frequency", "breakdown_ratio", "ratio")
    }


def test_a_motor_stands_alone():
    result = faults("type = 'constant', torque = 3", more=", torque = 'balance'")
    assert result == {"drive": "drive (line 3): found torque and motor, expected exactly one of torque, motor"}


@pytest.mark.parametrize("motor", ["3", "'induction'", "[1]"])
def test_what_is_no_motor_at_all(motor):
    with pytest.raises(SceneError, match=r"drive\.motor .*: found .* expected a table"):
        parse_scene(f"drive.motor = {motor}\nregime.speed = 1\nflywheel.inertia = 1")


def test_a_drive_of_nothing_hears_of_motors():
    with pytest.raises(SceneError, match="or a motor"):
        parse_scene("drive.on = 'crank'\nregime.speed = 1\nflywheel.inertia = 1")


def test_what_slides_has_no_motor():
    with pytest.raises(SceneError, match=r'drive\.motor .*: found a motor on "slide", which slides, expected a force'):
        parse_scene(
            "mechanism = {type = 'toggle-clamp'}\nstroke = {from = 0, to = 0.1, speed = 0.3}\n"
            "drive.motor = {type = 'constant', torque = 3}"
        )


def test_odd_poles_are_told_beside_another_fault():
    result = faults("type = 'induction', power = '7.5 kg', speed = '1450 rpm', poles = 5, frequency = '50 Hz'")
    assert set(result) == {"drive.motor.power", "drive.motor.poles", "drive.motor.breakdown_ratio"}
    assert "an even number, 2 or more" in result["drive.motor.poles"]
    assert result["drive.motor.breakdown_ratio"].endswith('expected a number such as "2.5"')


def test_a_motor_named_by_a_text_is_a_table_to_be():
    for text_ in ("induction", "inducton"):
        with pytest.raises(SceneError, match=r'write motor = \{type = "induction", ...\}; see flywheel reference motor'):
            load({"drive": {"motor": text_}, "flywheel": {"inertia": 1}})


def test_a_bare_rated_speed_is_in_radians_a_second():
    plate = "type = 'induction', power = '7.5 kW', speed = 1450, poles = 4, frequency = '50 Hz', breakdown_ratio = 2.5"
    assert faults(plate)["drive.motor.speed"].endswith('write "1450 rpm"')
    assert "write" not in faults(INDUCTION.replace("1450 rpm", "1400 rad/s"))["drive.motor.speed"]


def test_an_efficiency_in_per_cent_without_its_sign():
    assert faults(PLATE + ", efficiency = 82")["drive.motor.efficiency"].endswith('write "82 %"')


_GOOD = {  # where there is more than a new form begins with
    "line": {"no_load_speed": 100.0, "speed": 90.0, "power": 10.0},
    "table": {"speed": [0, 1], "torque": [3, 2], "speed_unit": "rpm", "torque_unit": "N m", "interpolation": "pchip"},
    "dc": {"voltage": 220.0, "power": 1500.0, "speed": 100.0, "efficiency": 0.8, "armature_share": 0.5, "inductance": 0.01},
    "induction": {
        "power": 7500.0,
        "speed": 150.0,
        "poles": 4,
        "frequency": 50.0,
        "breakdown_ratio": 2.5,
        "voltage": 400.0,
        "current": 15.0,
        "power_factor": 0.83,
        "efficiency": 0.87,
        "no_load_current": 6.5,
        "starting_current": 6.5,
        "starting_torque": 2.0,
        "stator_share": 0.5,
        "locked_rotor_time": 9.0,
        "start": {"type": "soft", "ramp": 2.0},
    },
    "synchronous": {
        "power": 15000.0,
        "poles": 4,
        "frequency": 50.0,
        "pull_out_ratio": 2.0,
        "load_angle": 0.5,
        "asynchronous_slip": 0.04,
        "asynchronous_ratio": 1.5,
        "field_at": 140.0,
        "field_time": 0.3,
    },
    "servo": {
        "speed": 300.0,
        "torque": 8.0,
        "standstill_torque": 10.0,
        "peak_torque": 30.0,
        "corner_speed": 250.0,
        "maximum_speed": 500.0,
        "set_speed": 150.0,
        "droop": 0.02,
        "efficiency": 0.9,
        "torque_constant": 1.5,
        "chopper_power": 2000.0,
        "braking": "resistor",
    },
    "hydraulic": {
        "displacement": 1e-4,
        "flow": 1e-3,
        "pressure": 1e7,
        "volumetric_efficiency": 0.9,
        "mechanical_efficiency": 0.9,
        "override": 0.1,
    },
    "engine": {"speed": 150.0, "full_load": {"speed": [0, 160], "torque": [3, 2]}, "droop": 0.1, "braking_torque": 1.0},
}
_ODD = [True, None, "x", "", "5 m", -1, 0, 1e-300, 1e300, math.nan, math.inf, 10**400, [], [1], {}, {"a": 1}, [[1], [2]]]


@pytest.mark.parametrize("kind", MOTORS)
def test_whatever_a_key_holds_is_a_motor_or_a_clear_refusal(kind):
    def read(motor: object) -> object:
        return load({"drive": {"motor": motor}, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})

    good = {"type": kind, **_GOOD.get(kind, MOTORS[kind].begin), "inertia": 0.1}
    assert isinstance(read(good), Scene)
    refused = []
    for key in good:
        for odd in _ODD:
            try:
                read(good | {key: odd})
            except SceneError as error:
                refused.append(error.faults)
    assert all(fault.path.startswith("drive.motor") for faults in refused for fault in faults)
    assert len(refused) > 8 * len(good)


@pytest.mark.parametrize(
    "start",
    [
        {"type": "star-delta", "until": "3 s"},
        {"type": "transformer", "voltage": 0.5, "until": "900 rpm"},
        {"type": "soft", "voltage": 0.4, "ramp": 3.0, "torque_limit": 1.5, "current_limit": 3.0, "until": "9 s"},
        {"type": "resistance", "added": [3, 1], "until": ["500 rpm", "9 s"]},
    ],
    ids=lambda start: start["type"],
)
def test_whatever_a_start_holds_is_one_or_a_clear_refusal(start):
    motor = {"type": "induction", "power": 7500.0, "speed": 150.0, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}

    def read(inputs: object) -> object:
        scene = {"drive": {"motor": motor | {"start": inputs}}, "regime": {"speed": 1}, "flywheel": {"inertia": 1}}
        return load(scene).motor.start

    assert read(start).connections
    refused = []
    for key in start:
        for odd in _ODD:
            try:
                read(start | {key: odd})
            except SceneError as error:
                refused.append(error.faults)
    assert all(fault.path.startswith("drive.motor.start") for faults in refused for fault in faults)
    assert len(refused) > 8 * len(start)


# The wheel of `[flywheel]` in a scene: what it becomes, and every fault in it.


def wheel(**keys):
    """The wheel of a scene with some keys in `[flywheel]`."""
    return wheels_scene(**keys).wheel


def wheels_scene(**keys):
    load_ = {"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}
    return load(
        {
            "load": [load_],
            "drive": {"torque": "balance"},
            "regime": {"speed": "300 rpm"},
            "flywheel": {"irregularity": 0.01} | keys,
        }
    )


def wheels_faults(**keys):
    with pytest.raises(flywheel.SceneError) as error:
        wheel(**keys)
    return [str(fault) for fault in error.value.faults]


def test_no_wheel_is_asked_for():
    assert wheel() is None


def test_a_disc():
    request = wheel(shape="disc", material="carbon steel", outer_radius="300 mm", step="0.5 kg m^2")
    steel = MATERIALS["carbon steel"]
    assert request == WheelAsked("disc", steel, outer_radius=0.3, step=0.5, path="flywheel")


def test_every_key():
    """Each key of the wheel arrives where it belongs."""
    request = wheel(
        shape="arms",
        density="7.2 t/m^3",
        allowable_stress="7.5 MPa",
        strength="150 MPa",
        poisson=0.25,
        method="thin",
        at="mean",
        rim_speed="25 m/s",
        width="200 mm",
        arms=8,
        arm_width="120 mm",
        arm_thickness="50 mm",
        bore="80 mm",
        hub_diameter="180 mm",
        hub_length="210 mm",
        torque="2 kN m",
        size_step="5 mm",
    )
    own = material(density=7200.0, allowable=7.5e6, strength=150e6, poisson=0.25)
    sizes = {"rim_speed": 25.0, "width": 0.2, "arms": 8, "arm_width": 0.12, "arm_thickness": 0.05}
    hub = {"bore": 0.08, "hub_diameter": 0.18, "hub_length": 0.21, "torque": 2000.0, "size_step": 0.005}
    assert request == WheelAsked("arms", own, method="thin", at="mean", path="flywheel", **sizes, **hub)


def test_the_other_keys():
    request = wheel(shape="rim", material="alloy steel", safety=5, mean_radius=0.4, thickness="2 cm", rim_share="90 %")
    assert request.material.allowable == 130e6
    assert (request.mean_radius, request.thickness, request.rim_share) == (0.4, 0.02, 0.9)
    lightest = wheel(shape="lightest", material="aluminium", max_radius=0.4, width_to_thickness=3, bore=0.05, arm_share=0.3)
    assert (lightest.max_radius, lightest.width_to_thickness, lightest.arm_share) == (0.4, 3.0, 0.3)


def test_a_given_inertia_may_have_a_wheel_too():
    result = load('regime.speed = 10\n[flywheel]\ninertia = "2 kg m^2"\nshape = "disc"\ndensity = 7000\nwidth = 0.1')
    assert result.inertia == 2.0
    assert result.wheel.width == 0.1


@pytest.mark.parametrize(
    ("keys", "wanted"),
    [
        (
            {"outer_radius": 0.3},
            ["flywheel.shape: found nothing, expected a shape (disc, rim, arms, lightest) with outer_radius"],
        ),
        ({"shape": "disk", "density": 7000, "width": 1}, ['flywheel.shape: found "disk", expected one of "disc", "rim"']),
        (
            {"shape": "disc", "material": "steel", "width": 1},
            ['flywheel.material: found "steel", expected one of "grey cast iron"'],
        ),
        ({"shape": "disc", "width": 1}, ["flywheel.material: found neither material nor density"]),
        ({"shape": "disc", "density": 7000, "safety": 2, "width": 1}, ["flywheel.safety: found a safety factor without"]),
        ({"shape": "disc", "density": 7000}, ["flywheel: found none of outer_radius, rim_speed, max_radius, width"]),
        (
            {"shape": "disc", "density": 7000, "width": 1, "outer_radius": 1},
            ["flywheel: found outer_radius and width, expected exactly one of"],
        ),
        (
            {"shape": "rim", "density": "7000 kg", "width": "1 kg", "bore": -1},
            ['flywheel.density: found "7000 kg"', 'flywheel.width: found "1 kg"', "flywheel.bore: found -1"],
        ),
        (
            {"shape": "rim", "density": 7000, "widht": 1},
            ['flywheel.widht: found key "widht", expected a known key; did you mean'],
        ),
        (
            {"shape": "arms", "density": 7000, "outer_radius": 1, "arms": 2.5},
            ["flywheel.arms: found 2.5, expected a value at least 3"],
        ),
        (
            {"shape": "arms", "density": 7000, "outer_radius": 1, "bore": 0.1, "arms": 4.5},
            ["flywheel.arms: found 4.5, expected a whole number from 3 to 100"],
        ),
        (
            {"shape": "disc", "density": 7000, "width": 0.1, "torque": 5, "thickness": 0.1},
            ["flywheel.thickness: found thickness of a disc", "flywheel.torque: found torque of a disc"],
        ),
    ],
)
def test_faults(keys, wanted):
    result = wheels_faults(**keys)
    assert len(result) == len(wanted)
    for fault, words in zip(sorted(result), sorted(wanted), strict=True):
        assert fault.startswith(words)


def test_the_reference_has_the_table_of_materials():
    for name, result in MATERIALS.items():
        row = next(line for line in text("wheel").splitlines() if line.startswith(f"| `{name}`"))
        cells = [cell.strip() for cell in row.split("|")[2:7]]
        usual = "" if result.rim_speed is None else f"{result.rim_speed:g}"
        numbers = [result.density, result.strength / 1e6, result.allowable / 1e6, result.poisson]
        assert cells == [*(f"{number:g}" for number in numbers), usual]


# GD², in place of an inertia: a mass or a weight times a square

REST = "regime.speed = 10\n"


def text_faults(text_):
    with pytest.raises(flywheel.SceneError) as caught:
        load(text_)
    return [(fault.path, fault.defect) for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("given", "inertia"),
    [
        ("48", 12.0),
        ("'48 kg m^2'", 12.0),
        ("'48 kgf m^2'", 12.0),
        ("'48 kgf·m²'", 12.0),
        ("'470.7192 N m^2'", 12.0),
        ("'0.48 kN m^2'", 480 / 9.80665 / 4),
        ("'1000 lb ft^2'", 250 * 0.45359237 * 0.3048**2),
        ("'1000 lbf ft^2'", 250 * 0.45359237 * 0.3048**2),
        ("'8 lbf in s^2'", 2 * 0.45359237 * 9.80665 * 0.0254),
        ("'8 N m s^2'", 2.0),
        ("'480000 kg cm^2'", 12.0),
        ("0", 0.0),
    ],
)
def test_a_given_flywheel_by_its_gd2(given, inertia):
    result = load(f"{REST}flywheel.gd2 = {given}")
    assert result.inertia == pytest.approx(inertia, rel=1e-14)
    assert result.irregularity is None


def test_an_added_inertia_by_its_gd2():
    result = load(REST + "flywheel.inertia = 1\n[[inertia]]\non = 'crank'\ngd2 = '3 kgf m^2'")
    assert result.inertias == (Inertia("crank", 0.75, "inertia[0]"),)


def test_gd2_and_inertia_are_one_machine():
    machine = {"load": [{"on": "crank", "torque": -90, "from": 0, "to": "90 deg"}], "drive": {"torque": "balance"}}
    machine["regime"] = {"speed": "300 rpm"}
    by_inertia, by_gd2 = ({**machine, "flywheel": {key: value}} for key, value in (("inertia", 2.5), ("gd2", "10 kg m^2")))
    figures = [flywheel.size(load(scene), simulate=False).simulation for scene in (by_inertia, by_gd2)]
    assert figures[0] == figures[1]


@pytest.mark.parametrize(
    ("given", "path", "found"),
    [
        ("flywheel = {gd2 = -1}", "flywheel.gd2", "-1"),
        ("flywheel = {gd2 = '-1 kgf m^2'}", "flywheel.gd2", '"-1 kgf m^2"'),
        ("flywheel = {gd2 = '48 kg m'}", "flywheel.gd2", '"48 kg m"'),
        ("flywheel = {gd2 = '48 kgf m'}", "flywheel.gd2", '"48 kgf m"'),
        ("flywheel = {gd2 = '48'}", "flywheel.gd2", '"48"'),
        ("flywheel = {gd2 = true}", "flywheel.gd2", "true"),
        ("flywheel = {gd2 = [4]}", "flywheel.gd2", "a list"),
        ("flywheel = {gd2 = 1, inertia = 2}", "flywheel", "inertia and gd2"),
        ("flywheel = {gd2 = 1, irregularity = 0.1}", "flywheel", "irregularity and gd2"),
        ("flywheel.inertia = 1\ninertia = [{on = 'crank', gd2 = 1, value = 2}]", "inertia[0]", "value and gd2"),
        ("flywheel.inertia = 1\ninertia = [{on = 'crank', gd2 = '1 m'}]", "inertia[0].gd2", '"1 m"'),
        ("flywheel.inertia = 1\ninertia = [{on = 'crank'}]", "inertia[0].value", "nothing"),
    ],
)
def test_faulty_gd2(given, path, found):
    assert text_faults(REST + given) == [(path, found)]


def test_what_translates_has_no_gd2():
    mechanism = "[mechanism]\ntype = 'scotch-yoke'\ncrank.length = 1\n"
    scene = REST + "flywheel.inertia = 1\ninertia = [{on = 'yoke', gd2 = 1}]\n" + mechanism
    assert text_faults(scene) == [("inertia[0].gd2", 'a GD² on "scotch-yoke.yoke", which translates')]
