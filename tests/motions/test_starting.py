"""Starting, from rest and at a standstill."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import flywheel
from flywheel import Machine, SceneError, transient
from flywheel.components.motors import DC, Started, Switch, resistance_steps
from flywheel.motions.starting import load_at_rest, mapped_run_up
from flywheel.motions.transients import estimates
from flywheel.tables import motions
from tests.limits import sample

# Motors that are started: closed forms and scipy's stepping beside what is followed in time; faults of a start.


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


@pytest.mark.slow
def test_star_delta_of_an_inertia_alone_by_closed_forms():
    """Time of the switch and of the end, and the rotor's heat: kinetic energy, whatever the voltage."""
    result = transient(scene(PLATE | {"start": {"type": "star-delta", "until": "1400 rpm"}}), end="1480 rpm")
    started = result.scene.motor
    own = started.own
    at_switch, at_end = (100 / 1500, 20 / 1500)
    star = kloss_time((1.0, at_switch), own.breakdown_torque / 3, own.breakdown_slip)
    delta = kloss_time((at_switch, at_end), own.breakdown_torque, own.breakdown_slip)
    assert started.times == pytest.approx((star,), rel=1e-9)
    assert result.time == pytest.approx(star + delta, rel=1e-9)
    heat = 0.5 * INERTIA * SYNCHRONOUS**2 * (1 - at_end**2)
    assert result.energy.rotor_heat == pytest.approx(heat, rel=1e-10)
    assert result.start_heat.winding == pytest.approx(0.5 * INERTIA * SYNCHRONOUS**2 * (1 - (50 / 1500) ** 2), rel=1e-10)
    assert result.peaks.current is None  # no rated current on the plate


@pytest.mark.slow
def test_a_switch_by_time_and_its_heat_are_those_of_the_equations():
    from scipy.integrate import solve_ivp

    plate = {"voltage": "400 V", "current": "15 A", "power_factor": 0.83, "starting_current": 6.5, "starting_torque": 2.2}
    plate |= {"locked_rotor_time": "4 s", "locked_rotor_time_cold": "9 s"}
    motor = PLATE | plate | {"start": {"type": "star-delta", "until": "2 s"}}
    result = transient(scene(motor, "-0.0006*omega**2"), end="1460 rpm")
    own, heat = result.scene.motor.own, result.start_heat

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
    errors = estimates(result)["motor_start"]
    assert 0 < errors["current_squared"] < 1e-7
    assert abs(heat.current_squared - run.y[2, -1]) <= errors["current_squared"] + 1e-10 * heat.current_squared
    assert f"{heat.starts} such start" in motions.transient_text(result)


def test_a_start_that_does_not_come_to_its_switch_is_told():
    motor = PLATE | {"start": {"type": "star-delta", "until": "1495 rpm"}}
    result = transient(scene(motor, "-0.001*omega**2"), end="8 s", rtol=1e-6)
    assert result.scene.motor.times == ()
    (message,) = (message for message in result.messages if "star-delta" in message)
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
    result = running.current_at(speeds, at)
    own, added = running.heat_at(speeds, at), running.added_heat_at(speeds, at)
    np.testing.assert_allclose(own, 0.05 * result**2, rtol=1e-13)
    np.testing.assert_allclose(own + added + 2.0 * np.array(speeds) * result, 250.0 * result, rtol=1e-13)


@pytest.mark.slow
def test_resistance_steps_of_a_dc_motor_by_exponentials():
    motor = {"type": "dc", "voltage": "250 V", "resistance": 0.05, "constant": 2.0}
    motor["start"] = {"type": "resistance", "added": [6.0, 2.0], "until": ["60 rad/s", "0.5 s"]}
    result = transient(scene(motor, inertia=5.0), end=1.0)
    first = 5.0 * 0.35 / 4.0  # time constant J R/k²
    switch = first * math.log(125.0 / 65.0)
    second = 5.0 * 0.15 / 4.0
    assert result.scene.motor.times == pytest.approx((max(switch, 0.0), max(switch, 0.5)), rel=1e-9)
    speed = 60.0
    if switch < 0.5:
        speed = 125.0 - 65.0 * math.exp(-(0.5 - switch) / second)
    last = 5.0 * 0.05 / 4.0
    expected = 125.0 - (125.0 - speed) * math.exp(-(1.0 - max(switch, 0.5)) / last)
    assert result.omega == pytest.approx(expected, rel=1e-9)


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

    result = transient(scene(PLATE | {"start": start}), end=1.5)
    own = result.scene.motor.own
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12, "max_step": 0.01}
    end = solve_ivp(lambda t, w: [float(torque(own, w[0], t)) / INERTIA], (0.0, 1.5), [0.0], **options).y[0, -1]
    assert result.omega == pytest.approx(end, rel=1e-8)


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
    result = transient(flywheel.load(train), end="90 %")
    assert result.reason == "share"
    assert result.energy.residual < 1e-9
    assert result.energy.meshes > 0
    assert len(result.scene.motor.times) == 1


# -- the load at rest, and the run-up through a torque map -----------------------------------------------------------------


class Line:
    """A drawn drive line over plain lists: the shaft that each meshes with, gear, efficiency, drag, inertia, load."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(3, 6))
        self.near = [0] + [int(rng.integers(0, k)) for k in range(1, count)]
        self.gear = [1.0] + [round(float(rng.uniform(0.7, 3.0)), 3) for _ in range(1, count)]
        self.efficiency = [1.0] + [float(rng.choice([1.0, 0.97, 0.9, 0.7, 0.5])) for _ in range(1, count)]
        self.drag = [0.0] + [round(float(rng.choice([0.0, 0.4, 1.1])), 3) for _ in range(1, count)]
        self.inertia = [2.0] + [round(float(rng.uniform(0.0, 0.2)), 3) for _ in range(1, count)]
        self.load = [round(float(rng.uniform(-30.0, 60.0)), 2) if rng.random() < 0.6 else 0.0 for _ in range(count)]
        self.motor, self.speed = count - 1, [1.0]
        for k in range(1, count):
            self.speed.append(self.speed[self.near[k]] * self.gear[k])

    def scene(self, drive, wheel=0.0):
        names = ["crank", *(f"s{k}" for k in range(1, len(self.near)))]
        shafts = {}
        for k in range(1, len(names)):
            shafts[names[k]] = {"on": names[self.near[k]], "ratio": self.gear[k]}
            shafts[names[k]] |= {"efficiency": self.efficiency[k]} if self.efficiency[k] < 1 else {}
            shafts[names[k]] |= {"drag": self.drag[k]} if self.drag[k] else {}
        return {
            "shafts": shafts,
            "inertia": [{"on": name, "value": value} for name, value in zip(names, self.inertia, strict=True) if value],
            "load": [{"on": name, "torque": -value} for name, value in zip(names, self.load, strict=True) if value],
            "drive": {"on": names[self.motor]} | drive,
            "flywheel": {"inertia": wheel},
        }

    def spare(self, torque, acceleration, wheel=0.0, rotor=0.0):
        """Torque left at the crank where the motor gives a torque and the crank has an acceleration."""
        needed = []
        for k, speed in enumerate(self.speed):
            inertia = self.inertia[k] + wheel * (k == 0) + rotor * (k == self.motor)
            needed.append(inertia * speed * acceleration + self.load[k] + self.drag[k] - torque * (k == self.motor))
        for k in range(len(needed) - 1, 0, -1):
            given = needed[k] / self.efficiency[k] if needed[k] > 0 else needed[k] * self.efficiency[k]
            needed[self.near[k]] += given * self.gear[k]
        return -needed[0]

    def root(self, function, low, high):
        for _ in range(80):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if function(middle) > 0 else (middle, high)
        return high


@pytest.mark.parametrize("seed", range(40))
def test_the_load_at_rest_of_drawn_drive_lines(seed):
    line = Line(seed)
    expected = line.root(lambda torque: line.spare(torque, 0.0), -1e4, 1e4)
    result = load_at_rest(Machine(flywheel.load(line.scene({"torque": 100.0}))), np.array([0.0, 2.0]))
    np.testing.assert_allclose(result, expected, rtol=1e-10, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_drawn_starts_are_those_of_the_equations(seed):
    """omega' by the balance of every mesh, stepped by scipy: time, turns and heat of a start, direct or by star-delta."""
    from scipy.integrate import solve_ivp

    line, share = Line(seed), (1.0, 1 / 3)[seed % 2]
    load = line.root(lambda torque: line.spare(torque, 0.0), -1e4, 1e4)
    motor = PLATE | {"power": max(load, 5.0) * 400.0, "inertia": 0.02, "starting_torque": 2.2, "starting_current": 6.0}
    if share < 1:
        motor["start"] = {"type": "star-delta", "until": "1200 rpm"}
    wheel = 4.0 * line.speed[line.motor] ** 2
    machine = Machine(flywheel.load(line.scene({"motor": motor}, wheel)))
    own, ratio = machine.scene.motor, line.speed[line.motor]
    target = 0.95 * SYNCHRONOUS / ratio

    def stage(part):
        def slope(t, state):
            speed = ratio * state[0]
            torque, current = part * float(own.torque(speed)), float(own.current_share(speed)) * math.sqrt(part)
            acceleration = line.root(lambda a: -line.spare(torque, a, wheel, own.inertia), -1e3, 1e3)
            return [acceleration, state[0] / (2 * math.pi), current**2]

        return slope

    state, clock = [0.0, 0.0, 0.0], 0.0
    for part, level in ((1 / 3, 1200 * math.pi / 30 / ratio), (1.0, target))[share == 1.0 :]:

        def reached(t, y, level=level):
            return y[0] - level

        reached.terminal = True
        run = solve_ivp(stage(part), (clock, 1e4), state, events=reached, rtol=1e-6, atol=1e-8)
        state, clock = run.y[:, -1], run.t[-1]
    result = mapped_run_up(machine, wheel, 0.0, target)
    assert result.reached
    assert result.time == pytest.approx(clock, rel=1e-3)
    assert result.turns == pytest.approx(state[1], rel=1e-3)
    assert result.current_squared == pytest.approx(state[2], rel=1e-3)


# The direct problem without idle tables: a mechanism and what drives it, from rest to an angle, a speed or a time.


YOKE = {
    "mechanism": {
        "type": "scotch-yoke",
        "crank": {"length": 0.5, "inertia": 2},
        "block": {"mass": 3},
        "yoke": {"mass": 20},
    },
    "drive": {"torque": "100 N m"},
}
SHAPER = {
    "mechanism": {
        "type": "crank-shaper",
        "crank": {"length": 0.1, "inertia": 2},
        "frame": {"length": 0.25},
        "rocker": {"length": 0.6, "inertia": 3},
        "block": {"mass": 2, "inertia": 0.01},
        "rocker_pin": {"mass": 1},
        "ram": {"mass": 50},
    },
    "drive": {"torque": "100 N m"},
}
BARS = {
    "type": "four-bar",
    "ground": {"length": 0.2},
    "crank": {"length": 0.15, "inertia": 0.01},
    "coupler": {"length": 0.1},
    "rocker": {"length": 0.12},
}


def inertia_of_yoke(phi):
    return 2 + 3 * 0.25 + 20 * 0.25 * np.sin(phi) ** 2


def inertia_of_shaper(phi):
    r, d, arm = 0.1, 0.25, 0.6
    g = r * (r + d * np.cos(phi)) / (r * r + d * d + 2 * r * d * np.cos(phi))
    rocker = np.arctan2(r * np.sin(phi), d + r * np.cos(phi))
    return 2 + 2 * r**2 + g**2 * (3 + 0.01 + 1 * arm**2 + 50 * (arm * np.cos(rocker)) ** 2)


@pytest.mark.parametrize(
    ("scene", "inertia"), sample([(SHAPER, inertia_of_shaper), (YOKE, inertia_of_yoke)], 2), ids=["shaper", "yoke"]
)
def test_a_constant_torque_from_rest(scene, inertia):
    """The energy theorem in closed form: omega² = 2 T phi/I*(phi), t = integral of dphi/omega, with phi = u²."""
    run = flywheel.transient(flywheel.load(scene), end="0.75 turns")
    assert (run.reason, run.inertia, run.regime_speed, run.messages) == ("way", 0.0, None, ())
    phi = 1.5 * np.pi
    assert run.phi == pytest.approx(phi, rel=1e-9)
    assert run.omega == pytest.approx(np.sqrt(200 * phi / inertia(phi)), rel=1e-9)
    time, _ = quad(lambda u: 2 * np.sqrt(inertia(u * u) / 200), 0, np.sqrt(phi), epsabs=0, epsrel=1e-12, limit=200)
    assert run.time == pytest.approx(time, rel=1e-9)
    assert run.energy.kinetic_gained == pytest.approx(100 * phi, rel=1e-9)


def test_until_an_angle_a_speed_and_a_time():
    scene = flywheel.load(YOKE)
    assert flywheel.transient(scene, end="40 deg", rtol=1e-6).phi == pytest.approx(np.pi / 4.5, rel=1e-6)
    assert flywheel.transient(scene, end="3 rad/s", rtol=1e-6).omega == pytest.approx(3.0, rel=1e-6)
    assert flywheel.transient(scene, end="0.1 s", rtol=1e-6).time == 0.1


@pytest.mark.parametrize("torque", [1e-9, 1e9])
def test_the_way_is_reached_however_weak_or_strong_the_torque(torque):
    run = flywheel.transient(flywheel.load(YOKE | {"drive": {"torque": torque}}), end="90 deg", rtol=1e-6)
    assert run.reason == "way"
    assert run.omega == pytest.approx(np.sqrt(np.pi * torque / inertia_of_yoke(np.pi / 2)), rel=1e-6)


def test_an_end_must_be_said_where_nothing_fixes_a_speed():
    with pytest.raises(
        SceneError, match=r"until: found a regime, although no torque fixes the speed of this machine.*--until \"2 turns\""
    ):
        flywheel.transient(flywheel.load(YOKE))
    with pytest.raises(SceneError, match=r"neither regime\.speed nor a torque that depends on speed"):
        flywheel.transient(flywheel.load(YOKE), end="95 %")


def test_torques_that_depend_on_speed_have_a_regime_without_a_flywheel():
    rotor = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": "100 - 20*omega"}}
    run = flywheel.transient(flywheel.load(rotor))
    assert (run.reason, run.inertia) == ("regime", 0.0)
    assert run.regime_speed == pytest.approx(5.0, rel=1e-9)


@pytest.mark.parametrize(
    ("end", "message"),
    [
        ("5 s", "; it did not reach 5 s"),
        ("90 deg", "; it did not reach a travel of 1.5708 rad (0.25 turns)"),
        ("900 rpm", "; it did not reach 94.2478 rad/s"),
    ],
)
def test_a_stroke_that_ends_before_is_not_told_as_whole(end, message):
    scene = flywheel.load({"mechanism": BARS, "drive": {"torque": 1}, "stroke": {"from": "30 deg", "to": "60 deg"}})
    run = flywheel.transient(scene, end=end)
    assert run.reason == "stroke"
    assert run.ended.endswith(message)
    assert run.omega == pytest.approx(np.sqrt(2 * np.pi / 6 / 0.01), rel=1e-9)


def test_a_machine_that_stops_before_is_told():
    run = flywheel.transient(flywheel.load(YOKE | {"drive": {"torque": "20 - 40*phi"}}), end="2 turns", rtol=1e-7)
    assert run.reason in ("stop", "stall")
    assert run.phi == pytest.approx(1.0, rel=1e-6)
    assert run.ended.endswith("it did not reach a travel of 12.5664 rad (2 turns)")


def test_ways_and_speeds_are_those_of_the_driver():
    with pytest.raises(SceneError, match=r"until: found a way of a driver that slides, where it turns.*90 deg"):
        flywheel.transient(flywheel.load(YOKE), end="50 mm")
    with pytest.raises(SceneError, match=r"until: found a speed of a driver that slides, where it turns.*200 rpm"):
        flywheel.transient(flywheel.load(YOKE), end="0.3 m/s")
    bodies = {"frame": {"points": {"O": [0, 0]}}, "ram": {"mass": 2.0}}
    guide = {"name": "O", "type": "slide", "between": ["frame.O", "ram.origin"]}
    ram = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [guide]}
    scene = flywheel.load({"mechanism": ram, "drive": {"force": 4}, "stroke": {"from": 0, "to": 0.1}})
    run = flywheel.transient(scene, end="50 mm")
    assert (run.reason, run.phi) == ("way", pytest.approx(0.05, rel=1e-9))
    assert run.omega == pytest.approx(np.sqrt(2 * 4 * 0.05 / 2), rel=1e-9)
    with pytest.raises(SceneError, match="a way of a driver that turns, where it slides"):
        flywheel.transient(scene, end="90 deg")


def test_what_has_no_inertia_asks_for_it():
    light = {"mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}}, "drive": {"torque": 1}}
    with pytest.raises(SceneError, match=r"inertia: found I\* = .* add \[\[inertia\]\]"):
        flywheel.transient(flywheel.load(light), end="1 s")


# Machines at rest under dry laws: held by the set of what these take, released at the root of effort less capacity.


def rotor(inertia, *loads, drive=None, drag=0.0, **changes):
    scene = {"inertia": [{"on": "crank", "value": inertia}], "load": [{"on": "crank", **load} for load in loads]}
    scene |= {} if drive is None else {"drive": {"torque": drive} if not isinstance(drive, dict) else drive}
    return flywheel.load(scene | ({"shafts": {"crank": {"drag": drag}}} if drag else {}) | changes)


def exponential(drive, dry, slope, inertia, t):
    """J omega' = drive - dry - slope omega, from rest."""
    return (drive - dry) / slope * (1.0 - math.exp(-slope * t / inertia))


DRY_BESIDE_V = {
    "model": {"model": {"type": "losses", "constant": "2 N m", "proportional": "0.1 N m s"}},
    "sign": {"torque": "-2*sign(v) - 0.1*v"},
    "choice": {"torque": "(-2 if v > 0 else 2) - 0.1*v"},
    "omega": {"torque": "-2*sign(omega) - 0.1*omega"},
}


@pytest.mark.parametrize("law", DRY_BESIDE_V.values(), ids=DRY_BESIDE_V)
def test_a_dry_share_beside_one_of_the_speed_acts_from_rest(law):
    """It was lost: 9.516 rad/s at 1 s for 7.613."""
    result = flywheel.simulate(rotor(1.0, law, drive=10.0), 0.0, 0.0, 1.0)
    assert result.omega[-1] == pytest.approx(exponential(10, 2, 0.1, 1.0, 1.0), rel=1e-11)
    assert result.energy_residual < 1e-12


PAIRS = {
    "drag": ([{"torque": "-3*sign(v)"}], 1.0),
    "two": ([{"torque": "-3*sign(v)"}, {"torque": "-1*sign(v)"}], 0.0),
    "model": ([{"model": {"type": "constant", "torque": "3 N m"}}, {"torque": "1 if v < 0 else -1"}], 0.0),
    "while": ([{"torque": "-4", "while": "v > 0"}, {"torque": "4", "while": "v < 0"}], 0.0),
    "five": ([{"torque": f"-{k}*sign(v)"} for k in (0.5, 0.75, 1.25)] + [{"torque": "-0.5*sign(omega)"}], 1.0),
}


@pytest.mark.parametrize(("laws", "drag"), PAIRS.values(), ids=PAIRS)
def test_dry_laws_together_stop_a_machine_and_hold_it(laws, drag):
    """Two of them drove it backwards for ever: J omega' = -4, from 5 rad/s."""
    scene = rotor(1.0, *laws, drag=drag)
    for result in (flywheel.simulate(scene, 0.0, 5.0, 3.0), transient(scene, start=5.0, end="3 s").motion):
        assert result.t[-1] == pytest.approx(1.25, rel=1e-12)
        assert "stands still" in result.ended
        assert result.at(3.0)[0][0] == pytest.approx(25 / 8, rel=1e-12)


@pytest.mark.parametrize("end", ["2 s", "30 rad/s"])
def test_a_drive_that_still_grows_is_waited_for(end):
    """Released at 1 s by min(60, 30 t) against 30: 15 (t - 1)² up to 2 s."""
    result = transient(rotor(1.0, {"torque": "-30*sign(v)"}, drive="min(60, 30*t)"), end=end)
    if end == "2 s":
        assert result.omega == pytest.approx(15.0, rel=1e-11)
    else:
        assert result.time == pytest.approx(2.5, rel=1e-11)
    assert "held at rest by dry friction for 1 s" in result.messages[0]


def test_a_step_in_time_releases_at_that_time():
    """It did not return within 40 s."""
    result = flywheel.simulate(rotor(1.0, drive="20 if t < 1 else 60", drag=30.0), 0.0, 0.0, 3.0)
    assert result.omega[-1] == pytest.approx(60.0, rel=1e-11)
    assert result.phi[-1] == pytest.approx(60.0, rel=1e-11)


@pytest.mark.slow
def test_a_push_that_comes_and_goes_is_not_passed_over():
    """10 sin(200 t) against friction that falls below 10 at 5 s: some 160 humps are too low, the next is not."""
    scene = rotor(1.0, {"torque": "-(12 - 0.4*t)*sign(v)"}, drive="10*sin(200*t)")
    result = flywheel.simulate(scene, 0.0, 0.0, 5.05)
    pushes = 10 * np.sin(200 * np.linspace(5.0, 5.05, 200_001))
    first = 5.0 + 0.05 * np.flatnonzero(pushes > 12 - 0.4 * np.linspace(5.0, 5.05, 200_001))[0] / 200_000
    assert result.t[np.flatnonzero(result.omega)[0] - 1] == pytest.approx(first, abs=1e-6)


def test_a_machine_that_is_released_backwards_goes_back_and_is_held_again():
    """M = 3 t against 1 and a spring: from -2.5 at phi = -0.25 it is let go when 2.5 - 3 t < 1."""
    scene = rotor(1.0, {"torque": "-5 + 3*t"}, {"torque": "-2*sign(v)"})
    result = flywheel.simulate(scene, 0.0, 0.0, 4.0)
    # back by -3 + 3 t: stops at 2 s, is held until 5 - 3 t = -2, 7/3 s, then goes forwards by 3 (t - 7/3)
    assert result.at(2.0)[0][0] == pytest.approx(-2.0, rel=1e-10)
    assert result.at(7 / 3)[0][0] == pytest.approx(-2.0, rel=1e-10)
    assert result.omega[-1] == pytest.approx(1.5 * (4 - 7 / 3) ** 2, rel=1e-10)
    assert result.energy_residual < 1e-12


def test_everything_behind_a_lossy_mesh_passes_where_the_mesh_passes_nothing():
    """It "stuck". The crank has nothing of its own: the mesh never passes anything, and its losses are none."""
    scene = {
        "shafts": {"side": {"ratio": 3, "efficiency": 0.9}},
        "mechanism": {
            "type": "slider-crank", "shaft": "side",
            "crank": {"length": 0.25}, "rod": {"length": 1.2}, "slider": {"mass": 20},
        },
        "inertia": [{"on": "side", "value": 50}],
        "load": [{"on": "rod", "torque": "-1.5*v"}],
    }  # fmt: skip
    result = flywheel.simulate(flywheel.load(scene), 0.0, 3.0, 3.0)
    loose = flywheel.simulate(flywheel.load(scene | {"shafts": {"side": {"ratio": 3}}}), 0.0, 3.0, 3.0)
    assert result.omega[-1] == pytest.approx(2.95926, rel=1e-5)
    assert result.omega[-1] == pytest.approx(loose.omega[-1], rel=1e-9)


PENDULUM = [{"torque": "-9.81*sin(phi) + 0.5*sin(3*t)"}]
SERVO = [{"torque": "30*(1 - phi) - 4*omega"}]


@pytest.mark.parametrize("loads", [PENDULUM, SERVO], ids=["pendulum", "servo"])
def test_for_a_time_a_transient_goes_on_through_rests(loads):
    """It ended at the first one, where `simulate` went on."""
    scene = rotor(1.0, *loads)
    result, same = transient(scene, end="5 s"), flywheel.simulate(scene, 0.0, 0.0, 5.0)
    assert result.time == 5.0
    assert result.phi == pytest.approx(same.phi[-1], rel=1e-7)
    assert result.motion.omega.min() < 0.0


def test_states_at_the_ends_of_steps_are_those_of_the_motion():
    """Steps that are parts of an implicit one had the state of its last."""
    friction = [
        {"name": "S", "type": "slide", "between": ["frame.origin", "block.origin"], "friction": 0.2, "direction": "30 deg"}
    ]
    bodies = {"block": {"mass": 2.0}}
    mechanism = {"type": "linkage", "driver": "S", "bodies": bodies, "joints": friction}
    scene = {"mechanism": mechanism, "stroke": {"from": 0.0, "to": 4.0}, "gravity": {}}
    result = flywheel.simulate(flywheel.load(scene), 2.0, 1.5, 0.7)
    phi, omega = result.at(result.t)
    assert result.phi == pytest.approx(phi, rel=1e-12)
    assert result.omega == pytest.approx(omega, abs=1e-12)


@pytest.mark.slow
def test_a_compressor_that_a_speed_loads_starts_where_the_loaded_one_does_not():
    """Unloaded up to a speed, by an expression of omega: against scipy's stepping with the switch as an event."""
    run = transient(scene(PLATE, "-3 - (40 + 20*sin(phi) if omega > 100 else 0)"), end="8 s")
    own = run.scene.motor
    assert own is not None

    def rates(t, y, compresses):
        load = 3.0 + compresses * (40.0 + 20.0 * math.sin(y[0]))
        return [y[1], (float(own.torque(y[1])) - load) / INERTIA]

    def loaded(t, y, compresses):
        return y[1] - 100.0

    loaded.terminal = True
    first = solve_ivp(rates, (0.0, 9.0), [0.0, 0.0], "DOP853", events=loaded, args=(0,), rtol=1e-11, atol=1e-11)
    second = solve_ivp(rates, (first.t[-1], 8.0), first.y[:, -1], "DOP853", args=(1,), rtol=1e-11, atol=1e-11)
    assert first.t[-1] < 6.0
    assert run.omega == pytest.approx(second.y[1, -1], rel=1e-8)
    with pytest.raises(SceneError, match="does not start"):
        transient(scene(PLATE, "-3 - (40 + 20*sin(phi))"), end="regime")
