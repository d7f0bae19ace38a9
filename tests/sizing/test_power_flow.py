"""Power and energy of a cycle."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, root

import flywheel
from flywheel.motions.motion import speed_at
from flywheel.regime import turning_moment
from flywheel.tables.power import sentence
from tests import regimes, scenes
from tests.generated.scenes import drawn
from tests.limits import sample
from tests.motions.test_joint_forces import resisted_press as press
from tests.oracle.drive_lines import DriveLine
from tests.oracle.test_oracle import PRESS

# Where the power goes: by hand, by the oracle of drive lines, and as a balance in every kind of machine.


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
    result = by_name(flow)
    on_crank = 2000.0 + 2.0 * 100.0 + 150.0 / 0.8
    assert flow.input == pytest.approx(on_crank / 0.9, rel=1e-12)
    assert flow.output == pytest.approx(2150.0, rel=1e-12)
    assert result["mesh", "shafts.motor"].mean == pytest.approx(on_crank / 9.0, rel=1e-12)
    assert result["mesh", "shafts.fan"].mean == pytest.approx(37.5, rel=1e-12)
    assert result["damper", "damper[0]"].mean == pytest.approx(200.0, rel=1e-12)
    assert result["shaft", "shafts.motor"].mean == pytest.approx(on_crank, rel=1e-12)
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
    result = by_name(flow)
    assert flow.losses == pytest.approx(result["mesh", "shafts.wheel"].mean, rel=1e-12)
    assert flow.losses > 1.0
    assert result["stored", "flywheel"].mean == 0.0
    assert result["stored", "flywheel"].least < -100.0 < 100.0 < result["stored", "flywheel"].greatest
    closes(flow)


def test_the_electric_side_of_motors():
    """DC: U i in, and L i di/dt stored; induction: the field's power T omega_s, with a plate all of it."""
    case = regimes.CASES["dc-inductance"]
    result = flywheel.size(flywheel.load(regimes.scene("dc-inductance", inertia=case.inertias[-1])), simulate=False)
    flow, motor = result.power_flow, result.scene.motor
    outcome, ratio = by_name(flow), result.scene.shafts[result.scene.drive.on]
    current = (motor.voltage - motor.constant * ratio * flow.scene.cycle / flow.period) / motor.resistance  # over time
    assert outcome["input", "drive"].mean == pytest.approx(motor.voltage * current, rel=1e-9)
    assert outcome["copper", "drive.copper"].mean == pytest.approx(result.energy.copper_heat, rel=1e-9)
    assert ("stored", "drive.inductance") in outcome
    closes(flow)
    scene = flywheel.load(ROOT / "examples" / "regimes" / "punch_press.toml")
    sizing = flywheel.size(scene, simulate=False)
    flow, outcome = sizing.power_flow, by_name(sizing.power_flow)
    assert outcome["rotor", "drive.rotor"].mean == pytest.approx(sizing.energy.rotor_heat, rel=1e-9)
    assert outcome["input", "drive"].mean == pytest.approx(sizing.energy.mean_power + sizing.energy.rotor_heat, rel=1e-12)
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
    result = by_name(flow)
    field = result["stored", "drive.field"]
    assert field.mean == 0.0
    assert field.least < -30.0 < 30.0 < field.greatest
    torque = next(row for row in flow.shafts if row.shaft == "motor").torque_mean
    assert result["input", "drive"].mean == pytest.approx(torque * 50.0 * np.pi, rel=1e-9)
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
    result = flywheel.size(flywheel.load(areas))
    assert result.power_flow is None
    assert (result.as_dict()["power_flow"], result.as_dict()["error"]["power_flow"]) == (None, None)
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
    result = by_name(flow)
    friction = result["friction", "friction in joints"].mean
    assert friction > 5.0
    assert result["shaft", "shafts.motor"].mean == pytest.approx(result["load", "load[0]"].mean + friction, rel=1e-9)
    closes(flow)


@pytest.mark.slow
def test_meshes_as_by_the_oracle():
    flow, true = flow_of(PRESS), DriveLine(PRESS).analysed(0.3)
    result, rows = by_name(flow), {row.shaft: row for row in flow.shafts}
    assert flow.period == pytest.approx(true.period, rel=1e-11)
    for name, passed in true.flows.items():
        own, lost = rows[name], result["mesh", f"shafts.{name}"]
        sign = 1.0 if own.to == name else -1.0
        assert sign * own.power_mean == pytest.approx(passed.mean, rel=1e-11)
        assert own.torque_rms == pytest.approx(passed.rms_torque, rel=1e-10)
        assert lost.mean == pytest.approx(passed.lost, rel=1e-10)
        assert sign * own.power_greatest == pytest.approx(passed.greatest if sign > 0 else passed.least, rel=1e-8)
    works = {"load 0": "load[0]", "load 1": "load[1]", "load 2": "load[2]"}
    for name, path in works.items():
        assert result["load", path].work == pytest.approx(-true.works[name], rel=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 8, 14, 18, 22, 24, 28, 30, 34, 38, 42, 48, 54, 58, 62])
def test_in_is_out_and_losses_in_drawn_machines(seed):
    closes(flow_of(drawn(seed).scene))


# Power and energy of whole machines: against closed forms, and against points of the motion itself.


def sized(scene):
    return flywheel.size(flywheel.load(scene), simulate=False)


def test_the_course_s_exam_of_march_2010():
    """x = -3 R cos phi1, 750 N over half a turn; 71.6197 N m at 210 rpm: exactly 1575 W, 678.2297 kcal of 4.18 kJ."""
    law = {"type": "law", "outputs": {"saw": {"x": "-0.3*cos(phi)"}}}
    load = [{"on": "saw", "force": "-750 N", "from": 0, "to": "180 deg"}]
    scene = scenes.rotor(mechanism=law, load=load, regime={"speed": "210 rpm"}, flywheel={"irregularity": 0.05})
    energy = sized(scene).energy
    assert energy.work == pytest.approx(450, rel=1e-12)
    assert energy.mean_power_alone == pytest.approx(1575, rel=1e-12)
    assert energy.mean_power_alone * 1800 / 4180 == pytest.approx(678.2297, abs=5e-5)
    assert energy.peak_power_alone == pytest.approx(750 * 0.3 * 7 * np.pi, rel=1e-12)  # at mid-stroke
    assert energy.peak_power == pytest.approx(450 / (2 * np.pi) * 7 * np.pi * 1.025, rel=1e-12)  # at the greatest speed


@pytest.mark.parametrize(
    "name", sample(["section-c", "kloss-press", "pump", "geared-loss-line", "dc-inductance", "governor"], 2)
)
def test_the_drive_works_along_the_motion(name):
    case = regimes.CASES[name]
    result = sized(regimes.scene(name, inertia=case.inertias[-1]))
    true = regimes.figures(name)["analysis"][repr(case.inertias[-1])]
    energy = result.energy
    assert energy.period == pytest.approx(float(true["period"]), rel=1e-9)
    if "drive_work" in true:
        assert energy.work == pytest.approx(float(true["drive_work"]), rel=1e-9, abs=1e-9)
        assert result.power == pytest.approx(float(true["power"]), rel=1e-9, abs=1e-9)
    assert energy.mean_power == pytest.approx(energy.work / energy.period)


def test_a_motor_that_follows_the_loads_gives_what_they_take_at_a_constant_speed():
    """Without a flywheel: the loads' moment along the motion, at the mean of extremes; a line motor's own mean here."""
    result = sized(regimes.scene("peaks", inertia=5))
    energy = result.energy
    assert energy.peak_power_alone == pytest.approx(100 * result.speed, rel=1e-9)
    assert energy.mean_power_alone == pytest.approx(100 / 8 * result.speed, rel=1e-9)
    assert energy.peak_to_mean_alone == pytest.approx(8, rel=1e-9)
    assert energy.peak_to_mean < 2


def test_without_a_drive_there_is_no_power():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "30*sin(phi)"}])
    del scene["drive"]
    assert sized(scene).energy is None
    assert sized(scene).as_dict()["energy"] is None


def test_negative_peaks_count_by_their_size():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "100*sin(phi)"}], drive={"torque": "-100*sin(phi)"})
    scene["flywheel"] = {"inertia": 1e6}
    energy = sized(scene).energy
    assert abs(energy.peak_power) == pytest.approx(100 * 10 * np.pi, rel=1e-4)
    assert energy.mean_power == pytest.approx(0, abs=1e-6)
    assert energy.peak_to_mean is None or abs(energy.peak_to_mean) > 1e6


def test_the_figures_agree_with_quadrature():
    result = sized(regimes.scene("section-c", inertia=0))
    speed = lambda phi: float(turning_moment.speed_over_cycle(result.cycle, result.speed, result.run, np.array([phi]))[0])  # noqa: E731
    period = quad(lambda phi: 1 / speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    work = quad(lambda phi: 10 - 2.387 * speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    square = quad(lambda phi: (10 - 2.387 * speed(phi)) ** 2 / speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    assert (result.energy.period, result.energy.work) == pytest.approx((period, work), rel=1e-8, abs=1e-8)
    assert result.energy.rms_torque == pytest.approx(np.sqrt(square / period), rel=1e-8)


def test_the_rms_torque_of_a_constant_drive_is_that_torque_on_its_own_shaft():
    scene = scenes.rotor(shafts={"motor": {"ratio": 5}})
    scene["drive"] = {"on": "motor", "torque": "balance"}
    result = sized(scene)
    assert result.energy.rms_torque == pytest.approx(result.balance.value, rel=1e-13)


def test_rounding_is_no_power():
    energy = sized(scenes.rotor(load=[{"on": "crank", "torque": "-100*sin(17*phi)"}])).energy
    assert (energy.mean_power, energy.peak_power, energy.rms_torque) == (0.0, 0.0, 0.0)
    assert energy.peak_power_alone == pytest.approx(1000 * np.pi)


# -- what heats the motor ------------------------------------------------------------------------------------------------

SOFT = {"type": "induction", "power": "1.1 kW", "speed": "1320 rpm", "poles": 4, "frequency": "50 Hz", "inertia": 0.02}
SOFT["breakdown_ratio"] = 2.2
PLATE = {"type": "dc", "voltage": 220, "power": "1.5 kW", "speed": "1000 rpm", "efficiency": 0.8, "inertia": 0.01}
WOUND = {"type": "dc", "voltage": 220, "resistance": 3.0, "constant": 1.9, "friction": 0.01, "inductance": 0.3}
HEATED = {
    "induction": SOFT,
    "dc from its plate": PLATE,
    "dc with inductance": WOUND,
}
LOADS = {"working": (-65.0, -5.0), "driven for half of it": (-75.0, 55.0)}
RATIO, CRANK, WHEEL, HALF = 5.0, 0.4, 0.05, np.pi


def heated(motor, load, efficiency):
    """A motor on its own shaft, geared to a crank whose load takes one value over half a turn and another over the rest."""
    parts = [{"on": "crank", "torque": torque, "from": k * HALF, "to": (k + 1) * HALF} for k, torque in enumerate(load)]
    return scenes.rotor(
        shafts={"motor": {"ratio": RATIO, "efficiency": efficiency}},
        inertia=[{"on": "crank", "value": CRANK}],
        load=parts,
        drive={"on": "motor", "motor": motor},
        regime={},
        flywheel={"on": "motor", "inertia": WHEEL},
    )


def by_hand(motor, load, efficiency):
    """Period, mean and greatest of what heats the motor: its equations in time, stepped from half turn to half turn."""
    rotor = WHEEL + motor.inertia
    inductive = getattr(motor, "inductance", 0.0) > 0.0

    def torque(speed, current):
        return motor.constant * current - motor.friction * speed if inductive else float(motor.torque(speed))

    def rates(t, state, moment):
        speed = RATIO * state[1]
        driving = torque(speed, state[2])
        alpha = (moment + RATIO * driving) / (CRANK + RATIO**2 * rotor)
        if efficiency < 1.0:
            passed = CRANK * alpha - moment  # to the crank
            k = efficiency if passed > 0.0 else 1.0 / efficiency
            alpha = (moment + k * RATIO * driving) / (CRANK + k * RATIO**2 * rotor)
        if hasattr(motor, "synchronous_speed"):
            value = driving * (motor.synchronous_speed - speed)
        else:
            current = state[2] if inductive else (motor.voltage - motor.constant * speed) / motor.resistance
            value = motor.resistance * current**2
        rate = float(motor.current_rate(speed, state[2])) if inductive else 0.0
        return [state[1], alpha, rate, value]

    def turned(start):
        state, time, currents = [0.0, *start, 0.0], 0.0, []
        for k, moment in enumerate(load):
            end = lambda t, y, moment, k=k: y[0] - (k + 1) * HALF  # noqa: E731
            end.terminal = True
            run = solve_ivp(
                rates, (0, 10), state, "DOP853", args=(moment,), events=end, rtol=1e-11, atol=1e-11, dense_output=True
            )
            state, time = run.y_events[0][0], time + run.t_events[0][0]
            dense = run.sol(np.linspace(0, run.t_events[0][0], 2001))
            currents.append(dense[2] if inductive else dense[1] * RATIO)
        return state, time, np.concatenate(currents)

    def returned(start):
        return np.array(turned(start)[0][1:3]) - start

    if inductive:
        start = root(returned, [20.0, 3.0], tol=1e-13).x
    else:
        start = [brentq(lambda w: returned([w, 0.0])[0], 10, 40, xtol=1e-13), 0.0]
    state, time, currents = turned(np.array(start))
    if not inductive and hasattr(motor, "voltage"):
        currents = (motor.voltage - motor.constant * currents) / motor.resistance
    return time, state[3] / time, currents


@pytest.mark.parametrize("load", sample(LOADS, 5))
@pytest.mark.parametrize(("name", "efficiency"), list(zip(HEATED, (1.0, 0.9, 0.9), strict=True)))
def test_what_heats_a_motor_is_that_of_its_equations_in_time(name, load, efficiency):
    """Rotor heat T (omega_s - omega), copper heat R i², on the mean over time; while it generates, too."""
    result = sized(heated(HEATED[name], LOADS[load], efficiency))
    motor, energy, error = result.scene.motor, result.energy, result.as_dict()["error"]
    period, heat, currents = by_hand(motor, LOADS[load], efficiency)
    assert energy.period == pytest.approx(period, rel=1e-9)
    assert (result.run.drive.min() < 0.0) == (load != "working")
    if "induction" in name:
        rated = motor.rated.torque * (motor.synchronous_speed - motor.speed)
        assert energy.rotor_heat == pytest.approx(heat, rel=1e-8)
        assert energy.rotor_heat_share == pytest.approx(heat / rated, rel=1e-8)
        output = {"rotor_heat", "rotor_heat_share"}
    else:
        peak = currents[np.abs(currents).argmax()]
        assert energy.copper_heat == pytest.approx(heat, rel=1e-8)
        assert energy.current_rms == pytest.approx(np.sqrt(heat / motor.resistance), rel=1e-8)
        assert energy.current_peak == pytest.approx(peak, rel=1e-6)
        assert abs(energy.current_peak) >= abs(peak) * (1 - 1e-9)
        output = {"copper_heat", "current_rms", "current_peak"} | ({"copper_heat_share"} if "plate" in name else set())
        if "plate" in name:
            current = 1500 / (0.8 * 220)
            assert energy.copper_heat_share == pytest.approx(heat / (motor.resistance * current**2), rel=1e-8)
    every = {"rotor_heat", "rotor_heat_share", "copper_heat", "copper_heat_share", "current_rms", "current_peak"}
    assert {key for key in every if result.as_dict()["energy"][key] is not None} == output
    assert {key for key in every if error[key] is not None} == output
    assert all(0.0 < error[key] < 1e-8 for key in output)


def test_the_heat_of_a_constant_load_is_that_of_its_speed():
    """At the rated point the rotor has its rated heat, whatever the mesh between: share 1, and no more."""
    load = [{"on": "crank", "torque": -5 * 1100 / (1320 * np.pi / 30)}]
    scene = heated(SOFT, (0, 0), 1.0) | {"load": load}
    energy = sized(scene).energy
    assert energy.rotor_heat_share == pytest.approx(1.0, rel=1e-9)
    assert energy.rotor_heat == pytest.approx(1100 * 180 / 1320, rel=1e-9)  # the slip's share of what the field gives


def test_errors_of_heats_cover_what_a_coarse_motion_misses():
    scene = flywheel.load(heated(PLATE, LOADS["working"], 0.9))
    fine, coarse = (flywheel.size(scene, rtol=rtol, simulate=False).energy for rtol in (1e-11, 1e-2))
    for key, error in coarse.errors.items():
        true = getattr(fine, key)
        assert abs(getattr(coarse, key) - true) <= (error + fine.errors[key]) * abs(true)


def test_heat_of_a_stator_is_the_integral_of_the_line_current():
    plate = {"voltage": 400.0, "current": 15.0, "power_factor": 0.83, "no_load_current": 7.0}
    motor = {"type": "induction", "power": 7500.0, "speed": 151.8, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
    load = {"on": "crank", "torque": -150.0, "from": 0, "to": 2.0}
    result = flywheel.size(
        flywheel.load({"load": [load], "drive": {"motor": motor | plate}, "flywheel": {"inertia": 0.8}}), simulate=False
    )
    points, weights = np.polynomial.legendre.leggauss(40)
    edges = np.array([0.0, 2.0, 4.0, 2 * np.pi])
    half = 0.5 * np.diff(edges)[:, None]
    omega = speed_at(result, (edges[:-1, None] + half * (1 + points)).ravel())
    lasting = (half * weights).ravel() / omega
    share = result.scene.motor.current_share(omega)
    energy = result.energy
    assert energy.stator_heat_share == pytest.approx(lasting @ share**2 / lasting.sum(), rel=1e-10)
    assert energy.stator_heat == pytest.approx(energy.stator_heat_share * result.scene.motor.rated_stator_heat, rel=1e-14)
    assert energy.current_rms == pytest.approx(15.0 * energy.stator_heat_share**0.5, rel=1e-14)
    edge = result.scene.motor.current(speed_at(result, [0.0, 2.0]))
    assert energy.current_peak == pytest.approx(float(edge.max()), rel=1e-10)
    assert 0 < energy.errors["stator_heat_share"] < 1e-9


def test_the_sentence_tells_the_share_that_arrives_and_what_is_lost():
    shafts = {"motor": {"ratio": 8, "efficiency": 0.9}}
    load, drive = [{"on": "crank", "torque": "-200 N m"}], {"on": "motor", "torque": "balance"}
    flow = flow_of(scenes.rotor(shafts=shafts, load=load, drive=drive, regime={"speed": 10.0}, flywheel={"inertia": 3.0}))
    assert sentence(flow) == "90 % of 2.22 kW reaches the loads; lost: mesh motor–crank 222 W."
    assert sentence(flow, losses=False) == "90 % of 2.22 kW reaches the loads."
