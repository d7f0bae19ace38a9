"""Where the power goes: by hand, by the oracle of drive lines, and as a balance in every kind of machine."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flywheel
from tests import regimes, scenes
from tests.limits import sample
from tests.motions.test_passive_resistances import press
from tests.oracle.drive_lines import DriveLine
from tests.oracle.test_drive_lines import PRESS

ROOT = Path(__file__).parents[2]


def flow_of(scene, **options):
    return flywheel.size(flywheel.load(scene), simulate=False, **options).power_flow


def by_name(flow):
    return {(stream.kind, stream.name): stream for stream in flow.streams}


def closes(flow, points=40):
    """In = out + losses on the mean, and what comes to every shaft leaves it at every angle."""
    assert abs(flow.left) <= max(1e-9, flow.error) * flow.scale
    assert flow.input - flow.output == pytest.approx(sum(s.mean for s in flow.streams if s.lost), abs=1e-9 * flow.scale)
    assert all(stream.mean >= 0.0 for stream in flow.streams if stream.kind != "shaft")
    assert all(stream.least >= 0.0 for stream in flow.streams if stream.lost)
    phi = np.random.default_rng(0).uniform(0.0, flow.scene.cycle, points)
    net: dict[str, np.ndarray] = {}
    for stream, power in zip(flow.streams, flow.along(phi), strict=True):
        net[stream.source] = net.get(stream.source, 0.0) - power
        net[stream.target] = net.get(stream.target, 0.0) + power
    inner = [place for place in net if place.startswith("shafts.") and place[7:] in flow.scene.shafts]
    inner += ["drive"] if "mains" in net else []
    largest = max(abs(stream.greatest) + abs(stream.least) for stream in flow.streams)
    assert max(np.abs(net[place]).max() for place in inner) <= max(1e-9, 2 * flow.error) * max(largest, flow.scale)


def test_constant_torques_through_two_meshes_by_hand():
    """200 N m at 10 rad/s; a fan behind a mesh of 0.8 with 5 N m at 30 rad/s; a motor behind one of 0.9 at 80 rad/s."""
    scene = scenes.rotor(
        shafts={"motor": {"ratio": 8, "efficiency": 0.9}, "fan": {"ratio": 3, "efficiency": 0.8}},
        load=[{"on": "crank", "torque": "-200 N m"}, {"on": "fan", "torque": "-5 N m"}],
        damper=[{"on": "crank", "coefficient": 2.0}],
        drive={"on": "motor", "torque": "balance"},
        regime={"speed": 10.0},
        flywheel={"inertia": 3.0},
    )
    flow = flow_of(scene)
    found = by_name(flow)
    on_crank = 2000.0 + 2.0 * 100.0 + 150.0 / 0.8
    assert flow.input == pytest.approx(on_crank / 0.9, rel=1e-12)
    assert flow.output == pytest.approx(2150.0, rel=1e-12)
    assert found["mesh", "shafts.motor"].mean == pytest.approx(on_crank / 9.0, rel=1e-12)
    assert found["mesh", "shafts.fan"].mean == pytest.approx(37.5, rel=1e-12)
    assert found["damper", "damper[0]"].mean == pytest.approx(200.0, rel=1e-12)
    assert found["shaft", "shafts.motor"].mean == pytest.approx(on_crank, rel=1e-12)
    assert flow.efficiency == pytest.approx(2150.0 * 0.9 / on_crank, rel=1e-12)
    motor = next(row for row in flow.shafts if row.shaft == "motor")
    assert (motor.on, motor.to, motor.speed) == ("crank", "crank", 80.0)
    assert motor.torque_mean == pytest.approx(on_crank / 0.9 / 80.0, rel=1e-12)
    assert motor.torque_rms == pytest.approx(motor.torque_mean, rel=1e-12)
    assert flow.at(1.0)[0] == pytest.approx(flow.streams[0].mean, rel=1e-12)
    closes(flow)


def test_a_flywheel_behind_a_mesh_pays_for_what_it_stores():
    """A lossy wheel alone on its shaft: what enters on the mean is lost, and that is less than what swings."""
    scene = scenes.rotor(
        shafts={"wheel": {"ratio": 4, "efficiency": 0.95}},
        load=[{"on": "crank", "torque": "-60 N m", "from": 0, "to": "180 deg"}],
        inertia=[{"on": "crank", "value": 0.4}],
        flywheel={"on": "wheel", "inertia": 0.2},
    )
    flow = flow_of(scene)
    found = by_name(flow)
    assert flow.losses == pytest.approx(found["mesh", "shafts.wheel"].mean, rel=1e-12)
    assert flow.losses > 1.0
    assert found["stored", "flywheel"].mean == 0.0
    assert found["stored", "flywheel"].least < -100.0 < 100.0 < found["stored", "flywheel"].greatest
    closes(flow)


def test_the_electric_side_of_motors():
    """DC: U i in, and L i di/dt stored; induction: the field's power T omega_s, with a plate all of it."""
    case = regimes.CASES["dc-inductance"]
    result = flywheel.size(flywheel.load(regimes.scene("dc-inductance", inertia=case.inertias[-1])), simulate=False)
    flow, motor = result.power_flow, result.scene.motor
    found, ratio = by_name(flow), result.scene.shafts[result.scene.drive.on]
    current = (motor.voltage - motor.constant * ratio * flow.scene.cycle / flow.period) / motor.resistance  # over time
    assert found["input", "drive"].mean == pytest.approx(motor.voltage * current, rel=1e-9)
    assert found["copper", "drive.copper"].mean == pytest.approx(result.energy.copper_heat, rel=1e-9)
    assert ("stored", "drive.inductance") in found
    closes(flow)
    scene = flywheel.load(ROOT / "examples" / "regimes" / "punch_press.toml")
    sizing = flywheel.size(scene, simulate=False)
    flow, found = sizing.power_flow, by_name(sizing.power_flow)
    assert found["rotor", "drive.rotor"].mean == pytest.approx(sizing.energy.rotor_heat, rel=1e-9)
    assert found["input", "drive"].mean == pytest.approx(sizing.energy.mean_power + sizing.energy.rotor_heat, rel=1e-12)
    closes(flow)


def test_a_synchronous_motor_s_field_stores_what_its_load_angle_takes_up():
    """The mains give T omega_s; what of T (omega_s - omega) is no heat of the damper winding comes back within the cycle."""
    motor = {"type": "synchronous", "power": "10 kW", "poles": 4, "frequency": "50 Hz", "pull_out_ratio": 2.0}
    scene = {
        "shafts": {"motor": {"ratio": 12, "efficiency": 0.96}},
        "load": [{"on": "crank", "torque": "-300 - 200*sin(phi)"}],
        "inertia": [{"on": "crank", "value": 3.0}],
        "drive": {"on": "motor", "motor": motor | {"damping": "4 N m s", "inertia": "0.1 kg m^2"}},
        "flywheel": {"inertia": 20.0},
    }
    flow = flow_of(scene)
    found = by_name(flow)
    field = found["stored", "drive.field"]
    assert field.mean == 0.0
    assert field.least < -30.0 < 30.0 < field.greatest
    torque = next(row for row in flow.shafts if row.shaft == "motor").torque_mean
    assert found["input", "drive"].mean == pytest.approx(torque * 50.0 * np.pi, rel=1e-9)
    closes(flow)


def test_an_engine_gives_and_its_drive_takes():
    flow = flow_of(regimes.scene("brake", inertia=0.3))
    gas = next(stream for stream in flow.streams if stream.kind == "load" and stream.on.endswith("slider"))
    assert gas.target == "shafts.crank"
    assert flow.input == pytest.approx(gas.mean, rel=1e-12)
    closes(flow)
    flow = flow_of(ROOT / "examples" / "machines" / "three_cylinder.toml")
    assert by_name(flow)["drive", "drive"].source == "shafts.crank"
    assert flow.output == pytest.approx(by_name(flow)["drive", "drive"].mean, rel=1e-12)


def test_areas_have_none_and_json_has_all():
    areas = {"areas": {"values": [10, -10], "scale": 1}, "regime": {"speed": 10}, "flywheel": {"irregularity": 0.1}}
    found = flywheel.size(flywheel.load(areas))
    assert found.power_flow is None
    assert (found.as_dict()["power_flow"], found.as_dict()["error"]["power_flow"]) == (None, None)
    sizing = flywheel.size(flywheel.load(scenes.press()), simulate=False)
    data = sizing.as_dict()["power_flow"]
    assert {stream["kind"] for stream in data["streams"]} == {"drive", "load", "stored"}
    assert data["streams"][0]["from"] == "drive"
    assert [row["shaft"] for row in data["shafts"]] == ["crank"]
    assert sizing.figures["power_flow.input"] == pytest.approx(sizing.energy.mean_power, rel=1e-12)
    assert sizing.power_flow.as_dict(at=1.0)["streams"][0]["power"] == sizing.power_flow.at(1.0)[0]
    assert 0.0 < sizing.as_dict()["error"]["power_flow"] < 1e-9


CASES = [name for name, case in regimes.CASES.items() if name != "unstable" and case.inertias + case.irregularities]


@pytest.mark.parametrize("name", sample(CASES, 8))
def test_in_is_out_and_losses_in_every_regime(name):
    case = regimes.CASES[name]
    given = {"inertia": case.inertias[-1]} if case.inertias else {"irregularity": case.irregularities[0]}
    closes(flow_of(regimes.scene(name, **given)))


@pytest.mark.slow
@pytest.mark.parametrize("file", sorted(ROOT.glob("examples/**/*.toml")) + sorted(ROOT.glob("flywheel/starters/*.toml")),
                         ids=lambda path: path.stem)  # fmt: skip
def test_in_is_out_and_losses_in_every_example(file):
    try:
        flow = flow_of(file)
    except flywheel.SceneError:
        return  # a stroke, a mechanism alone
    if flow is not None:
        closes(flow)


@pytest.mark.slow
def test_friction_in_joints_is_lost():
    """Beside a mesh: what the crank needs of the motor is what the ram takes, and friction along the motion."""
    shafts = {"motor": {"ratio": 5, "efficiency": 0.93}}
    load = [{"on": "ram", "force": "-300 N", "from": "200 deg", "to": "330 deg"}]
    drive = {"on": "motor", "torque": "balance"}
    flow = flow_of(press(shafts=shafts, load=load, drive=drive, regime={"speed": 12.0}, flywheel={"inertia": 6.0}))
    found = by_name(flow)
    friction = found["friction", "friction in joints"].mean
    assert friction > 5.0
    assert found["shaft", "shafts.motor"].mean == pytest.approx(found["load", "load[0]"].mean + friction, rel=1e-9)
    closes(flow)


@pytest.mark.slow
def test_meshes_as_by_the_oracle():
    flow, true = flow_of(PRESS), DriveLine(PRESS).analysed(0.3)
    found, rows = by_name(flow), {row.shaft: row for row in flow.shafts}
    assert flow.period == pytest.approx(true.period, rel=1e-11)
    for name, passed in true.flows.items():
        own, lost = rows[name], found["mesh", f"shafts.{name}"]
        sign = 1.0 if own.to == name else -1.0
        assert sign * own.power_mean == pytest.approx(passed.mean, rel=1e-11)
        assert own.torque_rms == pytest.approx(passed.rms_torque, rel=1e-10)
        assert lost.mean == pytest.approx(passed.lost, rel=1e-10)
        assert sign * own.power_greatest == pytest.approx(passed.greatest if sign > 0 else passed.least, rel=1e-8)
    works = {"load 0": "load[0]", "load 1": "load[1]", "load 2": "load[2]"}
    for name, path in works.items():
        assert found["load", path].work == pytest.approx(-true.works[name], rel=1e-10)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    st.floats(2.0, 12.0),
    st.floats(0.3, 0.999),
    st.floats(0.3, 0.999),
    st.floats(0.0, 20.0),
    st.floats(30.0, 300.0),
    st.sampled_from(["crank", "motor", "fan"]),
    st.sampled_from([None, 0.02, 0.2]),
)
def test_in_is_out_and_losses_in_random_machines(ratio, motor, fan, drag, start, wheel, eps):
    scene = scenes.press(
        shafts={"motor": {"ratio": ratio, "efficiency": motor}, "fan": {"ratio": 3, "efficiency": fan}},
        load=[
            {"on": "press.slider", "force": "-3 kN", "from": f"{start} deg", "to": f"{start + 40} deg"},
            {"on": "fan", "torque": f"-0.02*omega*abs(omega) - {drag!r}"},
        ],
        damper=[{"on": "press.slider", "coefficient": 30.0}],
        inertia=[{"on": "motor", "value": 0.02}, {"on": "fan", "value": 0.01}],
        drive={"on": "motor", "torque": "balance"},
        flywheel={"on": wheel, **({"inertia": 2.0} if eps is None else {"irregularity": eps})},
    )
    try:
        flow = flow_of(scene)
    except flywheel.SceneError:
        return
    closes(flow)
