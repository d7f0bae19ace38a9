"""Motors that are started: closed forms and scipy's stepping beside what is followed in time; faults of a start."""

import math

import numpy as np
import pytest

import flywheel
from flywheel.components.motors import DC, Started, Switch, resistance_steps
from flywheel.motions.transients import estimates, transient
from flywheel.tables import transients

PLATE = {
    "type": "induction",
    "power": "7.5 kW",
    "speed": "1450 rpm",
    "poles": 4,
    "frequency": "50 Hz",
    "breakdown_ratio": 2.5,
}
INERTIA, SYNCHRONOUS = 2.5, 50 * math.pi


def scene(motor, load=None, inertia=INERTIA):
    given = {"inertia": [{"on": "crank", "value": inertia}], "drive": {"motor": motor}, "flywheel": {"inertia": 0}}
    return flywheel.load(given if load is None else given | {"load": [{"on": "crank", "torque": load}]})


def kloss_time(slips, torque, breakdown_slip):
    """Time of an inertia alone from one slip to another: J domega/dt = 2 T_b/(s/s_b + s_b/s), integrated."""
    first, last = slips
    ratio = (first**2 - last**2) / (2 * breakdown_slip) + breakdown_slip * math.log(first / last)
    return INERTIA * SYNCHRONOUS / (2 * torque) * ratio


def test_star_delta_of_an_inertia_alone_by_closed_forms():
    """Time of the switch and of the end, and the rotor's heat: kinetic energy, whatever the voltage."""
    found = transient(scene(PLATE | {"start": {"type": "star-delta", "until": "1400 rpm"}}), end="1480 rpm")
    started = found.scene.motor
    own = started.own
    at_switch, at_end = (100 / 1500, 20 / 1500)
    star = kloss_time((1.0, at_switch), own.breakdown_torque / 3, own.breakdown_slip)
    delta = kloss_time((at_switch, at_end), own.breakdown_torque, own.breakdown_slip)
    assert started.times == pytest.approx((star,), rel=1e-9)
    assert found.time == pytest.approx(star + delta, rel=1e-9)
    heat = 0.5 * INERTIA * SYNCHRONOUS**2 * (1 - at_end**2)
    assert found.energy.rotor_heat == pytest.approx(heat, rel=1e-10)
    assert found.start_heat.winding == pytest.approx(0.5 * INERTIA * SYNCHRONOUS**2 * (1 - (50 / 1500) ** 2), rel=1e-10)
    assert found.peaks.current is None  # no rated current on the plate


@pytest.mark.slow
def test_a_switch_by_time_and_its_heat_are_those_of_the_equations():
    from scipy.integrate import solve_ivp

    plate = {"voltage": "400 V", "current": "15 A", "power_factor": 0.83, "starting_current": 6.5, "starting_torque": 2.2}
    plate |= {"locked_rotor_time": "4 s", "locked_rotor_time_cold": "9 s"}
    motor = PLATE | plate | {"start": {"type": "star-delta", "until": "2 s"}}
    found = transient(scene(motor, "-0.0006*omega**2"), end="1460 rpm")
    own, heat = found.scene.motor.own, found.start_heat

    def slope(t, state, share):
        torque = share * float(own.torque(state[0]))
        windings = share * float(own.current_share(state[0])) ** 2
        return [(torque - 0.0006 * state[0] ** 2) / INERTIA, torque * (SYNCHRONOUS - state[0]), windings]

    def rated(t, state, share):
        return state[0] - own.speed

    rated.terminal = True
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-11, "max_step": 0.05}
    star = solve_ivp(slope, (0.0, 2.0), [0.0, 0.0, 0.0], args=(1 / 3,), **options).y[:, -1]
    run = solve_ivp(slope, (2.0, 30.0), star, args=(1.0,), events=rated, **options)
    assert heat.over
    assert heat.time == pytest.approx(run.t[-1], rel=1e-9)
    assert heat.winding == pytest.approx(run.y[1, -1], rel=1e-10)
    assert heat.current_squared == pytest.approx(run.y[2, -1], rel=1e-10)
    assert heat.stator == pytest.approx(own.rated_stator_heat * run.y[2, -1], rel=1e-10)
    assert heat.share == pytest.approx(run.y[2, -1] / (6.5**2 * 4.0), rel=1e-10)
    assert heat.starts == math.floor(1 / heat.share)
    assert heat.starts_cold == math.floor(6.5**2 * 9.0 / heat.current_squared)
    errors = estimates(found)["motor_start"]
    assert 0 < errors["current_squared"] < 1e-7
    assert abs(heat.current_squared - run.y[2, -1]) <= errors["current_squared"] + 1e-10 * heat.current_squared
    assert f"{heat.starts} such start" in transients.text(found)


def test_a_start_that_does_not_come_to_its_switch_is_told():
    motor = PLATE | {"start": {"type": "star-delta", "until": "1495 rpm"}}
    found = transient(scene(motor, "-0.001*omega**2"), end="8 s", rtol=1e-6)
    assert found.scene.motor.times == ()
    (message,) = (message for message in found.messages if "star-delta" in message)
    assert "1495 rpm" in message


def test_a_regime_is_that_of_the_last_connection():
    direct = scene(PLATE, "-20")
    started = scene(PLATE | {"start": {"type": "star-delta", "until": "1400 rpm"}}, "-20")
    assert flywheel.size(started).speed == flywheel.size(direct).speed


def test_chapman_starter_of_a_shunt_motor():
    """Chapman, Electric Machinery Fundamentals, 5th ed., example 8-7: 250 V, 0.05 ohm, 700 to 350 A.

    Printed: segments of 0.1786, 0.0893 and 0.0393 ohm, cut out at 125, 187.5 and 218.75 V induced.
    """
    motor = DC(voltage=250.0, resistance=0.05, constant=2.0)
    segments = (0.1786, 0.0893, 0.0393)
    beside = [sum(segments[k:]) / motor.resistance for k in range(3)]
    start = resistance_steps(motor, beside, [Switch(speed=volts / 2.0) for volts in (125.0, 187.5, 218.75)])
    times = (1.0, 2.0, 3.0)
    running = Started.of(motor, start, times)
    speeds = [0.0, 62.5, 62.5, 93.75, 93.75, 109.375, 109.375]
    at = [0.0, 0.9, 1.1, 1.9, 2.1, 2.9, 3.1]
    currents = [700.0, 350.0, 700.0, 350.0, 700.0, 350.0, 625.0]
    np.testing.assert_allclose(running.current_at(speeds, at), currents, rtol=1e-3)  # of four digits of the segments
    found = running.current_at(speeds, at)
    own, added = running.heat_at(speeds, at), running.added_heat_at(speeds, at)
    np.testing.assert_allclose(own, 0.05 * found**2, rtol=1e-13)
    np.testing.assert_allclose(own + added + 2.0 * np.array(speeds) * found, 250.0 * found, rtol=1e-13)


@pytest.mark.slow
def test_resistance_steps_of_a_dc_motor_by_exponentials():
    motor = {"type": "dc", "voltage": "250 V", "resistance": 0.05, "constant": 2.0}
    motor["start"] = {"type": "resistance", "added": [6.0, 2.0], "until": ["60 rad/s", "0.5 s"]}
    found = transient(scene(motor, inertia=5.0), end=1.0)
    first = 5.0 * 0.35 / 4.0  # time constant J R/k²
    switch = first * math.log(125.0 / 65.0)
    second = 5.0 * 0.15 / 4.0
    assert found.scene.motor.times == pytest.approx((max(switch, 0.0), max(switch, 0.5)), rel=1e-9)
    speed = 60.0
    if switch < 0.5:
        speed = 125.0 - 65.0 * math.exp(-(0.5 - switch) / second)
    last = 5.0 * 0.05 / 4.0
    expected = 125.0 - (125.0 - speed) * math.exp(-(1.0 - max(switch, 0.5)) / last)
    assert found.omega == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "torque"),
    [
        ({"type": "soft", "ramp": "2 s", "voltage": 0.4}, lambda own, w, t: own.torque(w) * min(0.4 + 0.3 * t, 1.0) ** 2),
        ({"type": "soft", "current_limit": 3}, lambda own, w, t: own.torque(w) * min(3 / own.current_share(w), 1.0) ** 2),
        ({"type": "soft", "torque_limit": 0.9}, lambda own, w, t: min(own.torque(w), 0.9 * own.rated.torque)),
        ({"type": "transformer", "voltage": 0.65, "until": "9 s"}, lambda own, w, t: own.torque(w) * 0.65**2),
        ({"type": "resistance", "added": [5], "until": ["9 s"]}, lambda own, w, t: own.torque((5 * SYNCHRONOUS + w) / 6)),
    ],
    ids=lambda one: str(one.get("type")) if isinstance(one, dict) else "",
)  # fmt: skip
def test_starts_by_the_equations(start, torque):
    from scipy.integrate import solve_ivp

    found = transient(scene(PLATE | {"start": start}), end=1.5)
    own = found.scene.motor.own
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12, "max_step": 0.01}
    end = solve_ivp(lambda t, w: [float(torque(own, w[0], t)) / INERTIA], (0.0, 1.5), [0.0], **options).y[0, -1]
    assert found.omega == pytest.approx(end, rel=1e-8)


@pytest.mark.parametrize(
    ("start", "path", "words"),
    [
        ({}, "type", "star-delta"),
        ({"type": "star"}, "type", "star-delta"),
        ({"type": "star-delta"}, "until", "nothing"),
        ({"type": "star-delta", "until": 3}, "until", "with its unit"),
        ({"type": "star-delta", "until": "3 kg"}, "until", "with its unit"),
        ({"type": "star-delta", "until": "3 s", "ramp": "2 s"}, "ramp", "of a start by star-delta"),
        ({"type": "star-delta", "until": ["3 s", "4 s"]}, "until", "2 ends"),
        ({"type": "transformer", "voltage": 1.2, "until": "3 s"}, "voltage", "1.2"),
        ({"type": "soft"}, "type", "limits nothing"),
        ({"type": "soft", "voltage": 0.4}, "voltage", "without a ramp"),
        ({"type": "resistance", "added": [3, 1], "until": "3 s"}, "until", "2 resistances and 1 ends"),
        ({"type": "resistance", "added": [1, 3], "until": ["3 s", "5 s"]}, "added[1]", "3 after one of 1"),
        ({"type": "resistance", "added": [3, 1], "until": ["900 rpm", "500 rpm"]}, "until[1]", "later than 900 rpm"),
        ({"type": "field", "field": [1.2], "until": "3 s"}, "type", "a DC motor"),
        ("star-delta", "", "a table"),
    ],
)
def test_faults_of_a_start(start, path, words):
    with pytest.raises(flywheel.SceneError) as caught:
        scene(PLATE | {"start": start})
    (fault,) = caught.value.faults
    assert fault.path == ".".join(filter(None, ("drive.motor.start", path)))
    assert words in str(fault)


def test_steps_leave_no_inductance():
    motor = {"type": "dc", "voltage": "250 V", "resistance": 0.05, "constant": 2.0, "inductance": "1 mH"}
    with pytest.raises(flywheel.SceneError, match="leave the inductance out"):
        scene(motor | {"start": {"type": "resistance", "added": [3], "until": "1 s"}})


@pytest.mark.slow
def test_a_press_train_is_brought_up_from_dead_centre():
    """Two lossy meshes in series; at the dead centre what the outer one passes is next to nothing, and has no sign."""
    train = {
        "mechanism": {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.45}, "slider": {"mass": 40.0}},
        "shafts": {"fly": {"ratio": 4, "efficiency": 0.96}, "motor": {"on": "fly", "ratio": 3, "efficiency": 0.95}},
        "load": [{"on": "slider", "force": -8000.0, "from": "290 deg", "to": "350 deg"}],
        "flywheel": {"on": "fly", "inertia": 2.0},
        "drive": {"on": "motor", "motor": PLATE | {"start": {"type": "star-delta", "until": "1300 rpm"}}},
    }
    found = transient(flywheel.load(train), end="90 %")
    assert found.reason == "share"
    assert found.energy.residual < 1e-9
    assert found.energy.meshes > 0
    assert len(found.scene.motor.times) == 1
