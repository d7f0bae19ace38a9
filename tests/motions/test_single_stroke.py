"""Work stroke by stroke, by formulas, an integration of its own, and one stroke after another."""

import json
import math
import re
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

import flywheel
from flywheel import SceneError, presses, starters
from flywheel.cli import main
from flywheel.motions.single_stroke import brake_for_stop, verdicts_of_parts
from flywheel.motions.stroke_course import course, slip_heat
from flywheel.motions.strokes import Strokes, periodic
from flywheel.numerics.units import parse_quantity
from flywheel.page import data
from flywheel.reference import text
from flywheel.report import contents, document
from flywheel.tables.strokes import blocks
from tests.generated.strokes import drawn_strokes
from tests.limits import sample

TURN = 2 * math.pi
DEGREE = math.pi / 180

J_WHEEL, J_CRANK, RATIO, CLUTCH, BRAKE = 1.5, 5.0, 4.0, 120.0, 400.0
ROTOR = f"""
shafts.wheel = {{ratio = {RATIO}, clutch = {{torque = {CLUTCH}, disengage = "300 deg"}}}}
inertia = [{{on = "crank", value = {J_CRANK}}}]
load = [{{on = "crank", torque = "-150 N m", from = "120 deg", to = "200 deg"}}]
brake = [{{torque = {BRAKE}, engage = "310 deg"}}]
single_stroke.rate = "40 1/min"
drive = {{on = "wheel", torque = "2*(40 - omega)"}}
flywheel = {{on = "wheel", inertia = {J_WHEEL}}}
"""
IDLE = {"drive.torque": "1e-13*(40 - omega)", "load": None}


def rotor(**changes):
    return flywheel.load(ROTOR).with_({key.replace("__", "."): value for key, value in changes.items()})


@cache
def plain():
    """The periodic stroke of the rotor as it is."""
    return flywheel.single_stroke(rotor())


def wound_up(scene):
    return Strokes(scene, J_WHEEL, 1e-11)


# -- by formulas -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("static", sample([1.2, 1.0], 2))
def test_a_clutch_that_slips_again_under_the_work(static):
    """Uniformly accelerated: from the work's beginning both sides slow down, after its end the crank is taken along."""
    window = {"load": [{"on": "crank", "torque": -700.0, "from": "120 deg", "to": "130 deg"}]}
    scene = flywheel.load(ROTOR).with_(IDLE | window | {"shafts.wheel.clutch.static_torque": static * CLUTCH})
    strokes = wound_up(scene)
    result = strokes.stroke(38.0, 0.0)
    (slip,) = result.slips
    assert slip.driven.start.phi == pytest.approx(120 * DEGREE)
    driven = J_CRANK / RATIO**2
    speed = J_WHEEL * 38.0 / (J_WHEEL + driven) / RATIO  # of the crank
    slower, faster = (CLUTCH * RATIO - 700.0) / J_CRANK, CLUTCH * RATIO / J_CRANK
    through = (math.sqrt(speed**2 + 2 * slower * 10 * DEGREE) - speed) / slower
    apart = through * (-CLUTCH / J_WHEEL - RATIO * slower)
    closing = RATIO * faster + CLUTCH / J_WHEEL
    assert slip.end - slip.begin == pytest.approx(through + apart / closing, rel=1e-7)
    assert slip_heat(slip, RATIO) == pytest.approx(CLUTCH * apart * (through + apart / closing) / 2, rel=1e-7)
    changes = {"load": window["load"], "shafts__wheel__clutch__static_torque": static * CLUTCH}
    whole = flywheel.single_stroke(rotor(**changes), rates=False)
    assert whole.clutch_torque == static * CLUTCH
    assert abs(whole.energy_residual) < 1e-8
    assert re.search("slips again from crank angle 120 deg", whole.verdicts[0])
    assert {one.part: one.suffices for one in verdicts_of_parts(whole)}["clutch"] is False


def test_a_jump_of_the_load_decides_which_way_the_clutch_slips():
    """Pushed before the work, the crank drives the wheel; from its first instant on the wheel is the faster side."""
    loads = [
        {"on": "crank", "torque": torque, "from": f"{low} deg", "to": f"{high} deg"}
        for torque, low, high in ((50.0, 60, 120), ("-700 + 600*(phi - 2)", 120, 130))
    ]
    result = wound_up(flywheel.load(ROTOR).with_(IDLE | {"load": loads})).stroke(38.0, 0.0)
    assert [leg.sense for leg in result.legs] == [1, 0, 1, 0]
    assert result.slips[0].driven.start.phi == pytest.approx(120 * DEGREE)


def test_torque_that_vanishes_gives_its_impulse_to_both_sides():
    """Brake and clutch act together from the release on: the clutch slips when the brake asks for more than it holds."""
    changes = {"shafts.wheel.clutch.hold": "10 ms", "shafts.wheel.clutch.fall": "20 ms", "brake.0.engage": "300 deg"}
    strokes = wound_up(flywheel.load(ROTOR).with_(IDLE | changes | {"load": None, "brake.0.torque": 1000.0}))
    result = strokes.stroke(38.0, 0.0)
    driven = J_CRANK / RATIO**2
    speed = J_WHEEL * 38.0 / (J_WHEEL + driven)
    share = 1000.0 / RATIO * J_WHEEL / (J_WHEEL + driven)  # of the brake's torque that comes from the wheel
    assert share > CLUTCH  # so that it slips at once, and passes its torque for 10 ms and, evenly less, for 20 ms
    assert result.speed == pytest.approx(speed - CLUTCH * 0.02 / J_WHEEL, rel=1e-8)
    stop = (speed / RATIO * J_CRANK + CLUTCH * RATIO * 0.02) / 1000.0
    assert result.stop_time - result.brake_time == pytest.approx(stop, rel=1e-8)


def test_a_crank_falls_back_until_the_clutch_takes_it_along():
    """Its moment turns it back from rest; the clutch's torque, which builds up, stops it and takes it forwards."""
    strokes = wound_up(
        flywheel.load(ROTOR).with_(IDLE | {"load": [{"on": "crank", "torque": -50.0}], "shafts.wheel.clutch.rise": 0.1})
    )
    first = strokes.stroke(38.0, 0.0).legs[0]
    turns = 2 * 50.0 * 0.1 / (CLUTCH * RATIO)  # the impulses of both are equal then
    lowest = (CLUTCH * RATIO * turns**3 / 0.6 - 50.0 * turns**2 / 2) / J_CRANK
    phi, omega = first.driven.states(np.array([turns]))[:2, 0]
    assert phi == pytest.approx(lowest, rel=1e-7)
    assert omega == pytest.approx(0.0, abs=1e-9)
    # both have one speed when the impulse of the clutch, T (t - rise/2), has brought them there
    each = CLUTCH / J_WHEEL + RATIO**2 * CLUTCH / J_CRANK
    assert first.end == pytest.approx((38.0 + each * 0.05) / (each - RATIO * 50.0 / J_CRANK), rel=1e-9)
    speed = 38.0 - CLUTCH / J_WHEEL * (first.end - 0.05)
    lost = J_WHEEL * (38.0**2 - speed**2) / 2 - J_CRANK * (speed / RATIO) ** 2 / 2
    assert slip_heat(first, RATIO) == pytest.approx(
        lost - 50.0 * float(first.driven.states(first.driven.t[-1:])[0, 0]), rel=1e-8
    )


def test_a_brake_has_the_heat_of_the_handbook():
    """Shigley's Mechanical Engineering Design, 8th ed., example 16-5: 289 lbf in s² from 250 rpm to rest are 10.6 Btu."""
    inertia, speed = parse_quantity("289 lbf in s^2", "inertia"), parse_quantity("250 rpm", "speed")
    braked = {"inertia.0.value": inertia, "brake.0.torque": 20e3, "load": None, "drive.torque": "1e-13*(40 - omega)"}
    result = wound_up(flywheel.load(ROTOR).with_(braked)).braked_from(5.5, speed)
    heat = 20e3 * (result.states(result.t[-1:])[0, 0] - 5.5)
    assert heat / 1055.06 == pytest.approx(10.6, abs=0.05)
    assert heat == pytest.approx(inertia * speed**2 / 2, rel=1e-9)


@pytest.mark.parametrize("rise", [0.0, 0.03])
def test_two_inertias_that_lock_lose_the_energy_of_an_inelastic_impact(rise):
    scene = flywheel.load(ROTOR).with_(IDLE | {"shafts.wheel.clutch.rise": rise})
    strokes = wound_up(scene)
    result = strokes.stroke(38.0, 0.0)
    driven = J_CRANK / RATIO**2
    assert slip_heat(result.legs[0], RATIO) == pytest.approx(J_WHEEL * driven / (J_WHEEL + driven) * 38.0**2 / 2, rel=1e-9)
    speed = J_WHEEL * 38.0 / (J_WHEEL + driven)
    assert result.speed == pytest.approx(speed, rel=1e-9)
    # the clutch's impulse is what the driving side loses; the brake takes the crank's energy over its angle
    assert CLUTCH * (result.lock_time - rise / 2) == pytest.approx(J_WHEEL * (38.0 - speed), rel=1e-9)
    braked = (result.rest - 310 * DEGREE) * BRAKE
    assert braked == pytest.approx(J_CRANK * (speed / RATIO) ** 2 / 2, rel=1e-8)


def test_a_brake_that_builds_up_stops_by_its_impulse():
    scene = flywheel.load(ROTOR).with_(IDLE | {"brake.0.rise": "50 ms"})
    result = wound_up(scene).stroke(38.0, 0.0)
    lasting = result.stop_time - result.brake_time
    assert lasting > 0.05
    assert BRAKE * (lasting - 0.025) == pytest.approx(J_CRANK * result.braking.start.omega, rel=1e-9)


def test_energy_goes_in_and_comes_out_by_name():
    result = plain()
    energy = result.energy
    assert energy["loads"] == pytest.approx(150.0 * 80 * DEGREE, rel=1e-9)
    assert energy["brake_heat"] == pytest.approx(BRAKE * result.brake_angle, rel=1e-8)
    out = energy["loads"] + energy["mesh_heat"] + energy["clutch_heat"] + energy["brake_heat"]
    assert energy["motor"] == pytest.approx(out, rel=1e-8)
    assert abs(result.energy_residual) < 1e-8
    assert result.mean_power * result.period == pytest.approx(energy["motor"], rel=1e-12)


@pytest.mark.slow
def test_a_mesh_with_losses_heats_by_its_share():
    result = flywheel.single_stroke(rotor(shafts__wheel__efficiency=0.9), rates=False)
    assert result.energy["mesh_heat"] > 0.05 * result.energy["loads"]
    assert abs(result.energy_residual) < 1e-8


# -- by an integration of its own --------------------------------------------------------------------------------------


def independent(speed, rest, period):
    """Speed and resting angle after one stroke of the rotor, and when it locks and stops, by scipy."""
    tight = {"rtol": 1e-12, "atol": 1e-12, "method": "DOP853"}

    def drive(w):
        return 2 * (40 - w)

    def run(rate, start, begin, *events):
        for event in events:
            event.terminal = True
        result = solve_ivp(rate, (begin, 60.0), start, events=events, **tight)
        return result.t[-1], result.y[:, -1]

    t, state = run(
        lambda t, y: [(drive(y[0]) - CLUTCH) / J_WHEEL, y[2], CLUTCH * RATIO / J_CRANK, CLUTCH * (y[0] - RATIO * y[2])],
        [speed, rest, 0.0, 0.0], 0.0, lambda t, y: y[0] - RATIO * y[2],
    )  # fmt: skip
    lock, (_, phi, omega, heat) = t, state
    whole, lowest = J_CRANK + J_WHEEL * RATIO**2, omega * RATIO
    for end, load in ((120, 0.0), (200, -150.0), (300, 0.0)):
        t, (phi, omega) = run(
            lambda t, y, load=load: [y[1], (RATIO * drive(RATIO * y[1]) + load) / whole],
            [phi, omega], t, lambda t, y, end=end: y[0] - end * DEGREE,
        )  # fmt: skip
        lowest = min(lowest, omega * RATIO)
    release, driving = t, omega * RATIO
    t += 10 * DEGREE / omega
    stop, rest = t + omega * J_CRANK / BRAKE, 310 * DEGREE + omega**2 * J_CRANK / BRAKE / 2
    after = 40 + (driving - 40) * math.exp(-2 / J_WHEEL * (period - release))
    return after, rest - TURN, lock, stop, heat, lowest


def test_the_periodic_stroke_is_that_of_an_independent_integration():
    result = plain()
    state = np.array([38.0, 0.0])
    for _ in range(40):  # what a stroke leaves of a difference is a third
        state = np.array(independent(*state, 1.5)[:2])
    speed, rest, lock, stop, heat, lowest = independent(*state, 1.5)
    assert result.phases.begin == pytest.approx((speed, rest), rel=1e-8)
    assert result.slip_time == pytest.approx(lock, rel=1e-8)
    assert result.stroke_time == pytest.approx(stop, rel=1e-8)
    assert result.clutch_heat == pytest.approx(heat, rel=1e-8)
    assert result.overrun == pytest.approx(rest, rel=1e-8)
    assert result.speed_least == pytest.approx(lowest, rel=1e-8)
    true = {"slip_time": lock, "stroke_time": stop, "clutch_heat": heat, "overrun": rest, "speed_least": lowest}
    for name, value in true.items():
        assert abs(result.figures[name] - value) <= result.error[name] + 3e-10 * abs(value), name


def test_it_is_what_stroke_after_stroke_comes_to():
    strokes = Strokes(rotor(), J_WHEEL, 1e-9)
    state = 35.0, 0.3
    for _ in range(20):  # each leaves a third of a difference
        result = strokes.stroke(*state)
        state = result.speed, result.rest - TURN
    assert periodic(strokes).begin == pytest.approx(state, rel=1e-6)


# -- rates, rows of strokes, the flywheel sought -----------------------------------------------------------------------


@pytest.mark.slow
def test_the_flywheel_of_an_irregularity_has_it():
    sized = flywheel.single_stroke(rotor(flywheel__inertia=None, flywheel__irregularity=0.3))
    assert sized.irregularity == pytest.approx(0.3, rel=1e-6)
    wheel = sized.as_dict()["flywheel"]
    assert {key: wheel[key] for key in ("on", "inertia", "exact")} == {
        "on": "wheel",
        "inertia": None,
        "exact": sized.inertia,
    }
    again = flywheel.single_stroke(rotor(flywheel__inertia=sized.inertia))
    assert again.irregularity == pytest.approx(0.3, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("irregularity", [0.29, 0.1])
def test_a_stroke_that_is_looked_for_beside_another_is_the_same(irregularity):
    known = flywheel.single_stroke(rotor(flywheel__inertia=None, flywheel__irregularity=0.3), 1e-4, rates=False)
    scene = rotor(flywheel__inertia=None, flywheel__irregularity=irregularity)
    beside, alone = (flywheel.single_stroke(scene, 1e-4, rates=False, near=near) for near in (known, None))
    assert beside.irregularity == pytest.approx(irregularity, rel=1e-4)  # the accuracy that was asked for
    assert beside.inertia == pytest.approx(alone.inertia, abs=beside.error["inertia"] + alone.error["inertia"])
    assert beside.error["inertia"] < 1e-4 * beside.inertia
    assert (beside.compared is known) == (irregularity == 0.29)  # whose errors serve where little differs
    for name in ("speed_least", "clutch_heat", "mean_power"):
        assert beside.figures[name] == pytest.approx(alone.figures[name], abs=beside.error[name] + alone.error[name])
        assert beside.error[name] <= 1.5e-4 * abs(beside.figures[name])  # 1.5 times those of the other stroke


@pytest.mark.parametrize("sized", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_rate_that_a_slider_changes_takes_few_more_strokes(sized, monkeypatch):
    """The recovery alone is followed anew for Newton's first step; the slopes are the neighbour's."""
    flywheel_of = {"on": "wheel", "irregularity": 0.3} if sized else {"on": "wheel", "inertia": J_WHEEL}
    scene = rotor(flywheel=flywheel_of, single_stroke__approach="2 m/s")
    known = flywheel.single_stroke(scene, 1e-4, rates=False)
    beside = flywheel.single_stroke(scene.with_({"single_stroke.rate": "39 1/min"}), 1e-4, rates=False, near=known)
    strokes, follow = [], Strokes.stroke
    monkeypatch.setattr(Strokes, "stroke", lambda *args, **more: strokes.append(args) or follow(*args, **more))
    other = scene.with_({"single_stroke.rate": "38.8 1/min"})
    quick = flywheel.single_stroke(other, 1e-4, rates=False, near=beside)
    assert len(strokes) <= (4 if sized else 2)
    assert quick.compared is known
    alone = flywheel.single_stroke(other, 1e-7, rates=False)
    for name, error in quick.error.items():
        if name not in ("shares", "energy", "greatest_rate", "keeps_up", "emergency_angle"):
            value, right = (one.inertia if name == "inertia" else one.figures[name] for one in (quick, alone))
            assert abs(value - right) <= error + 1e-6 * abs(right), name


@pytest.mark.slow
def test_the_flywheel_of_limits_keeps_them_all_and_names_the_one_that_decides():
    limits = {"irregularity": 0.5, "motor_torque": 1.2, "motor_rms": 0.9}
    motor = {"type": "line", "power": 2 * 7.0 * 33.0, "speed": "33 rad/s", "no_load_speed": "40 rad/s"}
    scene = rotor(drive={"on": "wheel", "motor": motor}, flywheel={"on": "wheel", "limits": limits})
    result = flywheel.single_stroke(scene, 1e-7)
    assert result.binding == max(result.limits, key=lambda name: result.limits[name].alone)
    assert result.inertia == result.limits[result.binding].alone
    reached = {name: limit.reached / limits[name] for name, limit in result.limits.items()}
    assert max(reached.values()) == pytest.approx(reached[result.binding]) == pytest.approx(1.0, rel=1e-6)
    given = flywheel.single_stroke(scene.with_({"flywheel": {"on": "wheel", "inertia": result.inertia}}), 1e-7)
    assert given.irregularity == pytest.approx(result.limits["irregularity"].reached, rel=1e-6)
    assert given.motor_torque_peak / 14.0 == pytest.approx(result.limits["motor_torque"].reached, rel=1e-6)


@pytest.mark.slow
def test_a_limit_whose_flywheel_hardly_carries_the_stroke_through_refuses_no_other():
    """With 0.2306 kg m², by which its motor's rms torque would be kept, it stalls at a greater tolerance."""
    scene, _ = drawn_strokes(5480000012)
    result = flywheel.single_stroke(flywheel.load(scene), 1e-6, rates=False)
    assert result.binding == "irregularity"
    assert result.limits["motor_rms"].alone == pytest.approx(0.2306, rel=1e-3)
    assert result.limits["motor_rms"].alone_error == 1.0
    assert result.limits["motor_rms"].reached_error < 1e-4


@pytest.mark.parametrize("inertia", [3.0, pytest.param(10.0, marks=pytest.mark.slow)])
def test_the_error_of_a_flywheel_allows_for_a_limit_that_hardly_depends_on_it(inertia):
    """From 10 to 15 kg m² the motor's rms torque changes by 0.04 %: its error of 1e-6 is one of 3 % of the inertia's."""
    motor = {"type": "line", "power": 2 * 7.0 * 33.0, "speed": "33 rad/s", "no_load_speed": "40 rad/s"}
    drive = {"drive": {"on": "wheel", "motor": motor}}
    given = flywheel.single_stroke(rotor(**drive, flywheel={"on": "wheel", "inertia": inertia}), 1e-9, rates=False)
    limit = {"motor_rms": given.motor_torque_rms / 14.0}
    sized = flywheel.single_stroke(rotor(**drive, flywheel={"on": "wheel", "limits": limit}), 1e-4, rates=False)
    assert abs(sized.inertia - inertia) <= sized.error["inertia"] <= 0.01 * inertia
    assert sized.as_dict()["error"]["limits"]["motor_rms"] == pytest.approx(sized.error["inertia"] / sized.inertia)


@pytest.mark.parametrize(
    ("torque", "words"),
    [
        (400.0, r"25\.05 deg before stop_at; .* put on at about 335 deg, or"),
        (100.0, "past stop_at; it would stop there with a brake"),
    ],
)
def test_a_crank_that_stops_far_from_its_stop_is_a_remark_with_what_mends_it(torque, words):
    result = flywheel.single_stroke(rotor(brake__0__torque=torque), 1e-4, rates=False)
    (said,) = (line for line in result.verdicts if "stop_at" in line)
    assert re.search(words, said)
    engage, other = brake_for_stop(result)
    mended = {"brake__0__torque": other} if engage is None else {"brake__0__torque": torque, "brake__0__engage": engage}
    again = flywheel.single_stroke(rotor(**mended), 1e-4, rates=False)
    assert abs(again.overrun) < 0.1 * abs(result.overrun)
    assert brake_for_stop(again) is None
    (clutch,) = (block for block in blocks(result) if block.name == "clutch")
    assert any("stop_at" in line for line in clutch.sentences)


@pytest.mark.parametrize("touch", [0.02, 0.2])
def test_an_inching_touch_turns_the_crank_by_its_impulse(touch):
    strokes = wound_up(flywheel.load(ROTOR).with_(IDLE | {"single_stroke.inch": touch}))
    locks = J_WHEEL * 40 / (J_WHEEL * RATIO + J_CRANK / RATIO)  # the speed of both, on the crank
    slip = min(touch, locks * J_CRANK / (CLUTCH * RATIO))
    speed = CLUTCH * RATIO * slip / J_CRANK
    turned = speed * slip / 2 + speed * (touch - slip) + speed**2 * J_CRANK / BRAKE / 2
    assert strokes.inching(touch) == pytest.approx(turned, rel=1e-8)


@pytest.mark.slow
def test_the_safety_distance_is_that_of_the_longest_stop():
    safety = {"approach": "2 m/s", "response": "30 ms", "intrusion": "100 mm"}
    changes = {f"single_stroke__{name}": value for name, value in safety.items()}
    result = flywheel.single_stroke(rotor(brake__0__rise="20 ms", load=None, **changes))
    fastest = result.phases.legs[1].driven.states(np.linspace(0, result.phases.legs[1].driven.t[-1], 2000))[1].max()
    assert result.emergency_time == pytest.approx(0.03 + 0.01 + fastest * J_CRANK / BRAKE, rel=1e-7)
    assert result.safety_distance == pytest.approx(0.1 + 2.0 * result.emergency_time)
    assert plain().safety_distance is None


@pytest.mark.slow
def test_without_other_limits_the_greatest_rate_leaves_no_standstill():
    result = plain()
    assert result.decides == "time of the stroke"
    at_once = flywheel.single_stroke(rotor(single_stroke__rate=None, single_stroke__idle=0.0))
    assert at_once.rate == pytest.approx(result.greatest_rate, rel=1e-5)
    assert at_once.period == at_once.stroke_time


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"drive.torque": "20*(40 - omega)", "single_stroke.rate": "6 1/min"},  # the wheel waits at its idling speed
        {"load.1": {"on": "crank", "torque": 600.0, "from": "220 deg", "to": "299 deg"}, "drive.torque": "0.6*(40 - omega)"},
    ],
    ids=["waits", "is driven faster"],
)
def test_the_greatest_rate_of_a_wheel_at_its_idling_speed_or_above(changes):
    """It leaves no standstill; beyond a limit of heat at the given rate it is that at which an hour's heat is the limit."""
    scene = rotor(brake__0__torque=1500.0, shafts__wheel__clutch__static_torque=300.0).with_(changes)
    free = flywheel.single_stroke(scene, 1e-4)
    assert free.decides == "time of the stroke"
    near = scene.with_({"single_stroke.rate": 0.999 * free.greatest_rate})
    fast = flywheel.single_stroke(near, 1e-4, rates=False, near=free)
    assert fast.shares["time of the stroke"] == pytest.approx(0.999, rel=2e-3)
    limit = {"brake.0.heat_per_hour": 0.8 * free.brake_heat_per_hour}
    result = flywheel.single_stroke(scene.with_(limit), 1e-4)
    assert result.decides == "brake heat an hour"
    there = flywheel.single_stroke(scene.with_(limit | {"single_stroke.rate": result.greatest_rate}), 1e-6, rates=False)
    assert there.shares["brake heat an hour"] == pytest.approx(1.0, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("heat", [500e3, 75e3])
def test_heat_an_hour_decides_the_rate_where_it_is_least(heat):
    """At the lower rate the driving side idles for most of the period."""
    limit = {"shafts.wheel.clutch.heat_per_hour": heat}
    scene = flywheel.load(ROTOR).with_(limit)
    result = flywheel.single_stroke(scene)
    assert result.decides == "clutch heat an hour"
    assert result.shares["clutch heat an hour"] == pytest.approx(result.clutch_heat_per_hour / heat)
    assert any("clutch" in text for text in result.verdicts) == (result.shares["clutch heat an hour"] > 1.0)
    there = flywheel.single_stroke(scene.with_({"single_stroke.rate": result.greatest_rate}))
    assert there.clutch_heat_per_hour == pytest.approx(heat, rel=1e-3)


@pytest.mark.slow
def test_a_limit_that_every_flywheel_keeps_decides_on_none():
    """The driving side has no inertia but the flywheel: lighter and lighter ones would be tried for ever."""
    motor = {"type": "induction", "power": 800.0, "speed": "38 rad/s", "poles": 2, "frequency": "6.3 Hz"}
    limits = {"motor_rms": 1.5, "irregularity": 0.3}

    def scene(names):
        wheel = {"on": "wheel", "limits": {name: limits[name] for name in names}}
        return rotor(drive={"on": "wheel", "motor": motor | {"breakdown_ratio": 2.5}}, flywheel=wheel)

    with pytest.raises(flywheel.SceneError, match=r"flywheel\.limits\.motor_rms: found 150 %, which every flywheel keeps"):
        flywheel.single_stroke(scene(["motor_rms"]), 1e-5, rates=False)
    result = flywheel.single_stroke(scene(limits), 1e-5, rates=False)
    assert (result.binding, result.limits["motor_rms"].alone) == ("irregularity", 0.0)


@pytest.mark.parametrize(
    ("more", "kinds"),
    [
        ({"overcurrent": 1.3}, ["overcurrent", "overvoltage"]),
        ({"braking": "resistor", "chopper_power": "150 W"}, ["chopper_power"]),
        pytest.param({"braking": "resistor", "chopper_power": "2 kW"}, [], marks=pytest.mark.slow),
        pytest.param({"braking": "regenerative"}, [], marks=pytest.mark.slow),
    ],
)
def test_an_inverter_trips_where_current_or_returned_power_is_greatest(more, kinds):
    """The wheel slows down in the slip, and a load that drives takes it beyond the field's speed."""
    motor = {"type": "induction", "power": 800.0, "speed": "38 rad/s", "poles": 2, "frequency": "6.3 Hz"}
    motor |= {"breakdown_ratio": 2.5, "voltage": "400 V", "current": "2 A", "power_factor": 0.8}
    motor["inverter"] = {"frequency": "6.3 Hz", "overcurrent": 3.0} | more
    load = [{"on": "crank", "torque": 600.0, "from": "200 deg", "to": "290 deg"}]
    scene = rotor(drive={"on": "wheel", "motor": motor}, load=load, single_stroke__continuous=2, single_stroke__rate=0.7)
    result = flywheel.single_stroke(scene, 1e-6, rates=False)
    along, own = course(result.strokes, result.phases, 4000), result.scene.motor
    current, power = own.current_share(along.driving), own.input_power(along.driving, own.torque(along.driving))
    assert result.inverter_current == pytest.approx(current.max(), rel=1e-5)
    assert result.power_returned == pytest.approx(-power.min(), rel=1e-4)
    assert [trip.kind for trip in result.trips] == kinds
    assert [each["kind"] for each in result.as_dict()["single_stroke"]["trips"]] == kinds
    assert sum("THE INVERTER TRIPS" in line for line in result.verdicts) == len(kinds)
    for trip in result.trips:
        value = current if trip.kind == "overcurrent" else -power
        assert np.interp(trip.time, along.time, value) == pytest.approx(trip.value, rel=1e-4)
        assert np.interp(trip.time, along.time, along.phi) == pytest.approx(trip.angle, rel=1e-4)
    if "overcurrent" in kinds:
        assert result.shares["inverter current"] == pytest.approx(result.inverter_current / 1.3)


@pytest.mark.parametrize("constant", sample([3600.0, 1.0], 2))
def test_windings_warm_up_by_the_losses_of_strokes_without_end(constant):
    thermal = {"time_constant": constant, "rise": 80.0, "class": "F"}
    motor = {"type": "induction", "power": 800.0, "speed": "38 rad/s", "poles": 2, "frequency": "6.3 Hz"}
    scene = rotor(drive={"on": "wheel", "motor": {**motor, "breakdown_ratio": 2.5, "thermal": thermal}})
    result = flywheel.single_stroke(scene, rates=False)
    share = result.motor_heat / scene.motor.rated_total_heat
    along = course(result.strokes, result.phases, 100_000)
    heat = scene.motor.heat_share(along.driving)
    grown = np.exp(along.time / constant)
    steps = 0.5 * np.diff(along.time) * ((heat * grown)[:-1] + (heat * grown)[1:])
    sums = np.append(0.0, np.cumsum(steps)) / constant
    rise = 80.0 * (sums[-1] / (grown[-1] - 1.0) + sums) / grown  # which returns
    assert result.temperature == pytest.approx(rise.max(), rel=1e-6)
    if constant > 1.0:
        assert result.temperature == pytest.approx(80.0 * share, rel=1e-3)
        parts = [
            part for section in contents.worked(result).parts for part in section.parts if isinstance(part, document.Step)
        ]
        (step,) = (part for part in parts if part.result is not None and part.result.symbol == "theta_max")
        assert step.result.value == result.temperature
    assert result.shares["motor temperature"] == pytest.approx(result.temperature / 105.0)


def test_the_brake_holds_weight_less_counterbalance():
    """The slide hangs at the crank with its arm dx/dphi, the rod with its share of that and of the pin's."""
    r, length, com, counter = 0.05, 0.5, 0.15, 4600.0
    crank = {"length": r, "inertia": 14.0}
    press = {
        "type": "slider-crank",
        "crank": crank,
        "rod": {"length": length, "mass": 90.0, "com": com},
        "slider": {"mass": 450.0},
    }
    changes = {"mechanism": press, "load": [{"on": "slider", "force": counter}], "gravity": {"direction": "180 deg"}}
    result = wound_up(flywheel.load(ROTOR).with_(IDLE | changes | {"brake.0.fall": "50 ms"})).stroke(38.0, -0.2)
    sine, cosine = math.sin(result.rest), math.cos(result.rest)
    arm = r * sine + r * r * sine * cosine / math.sqrt(length**2 - (r * sine) ** 2)
    rod = (1 - com / length) * r * sine + com / length * arm
    assert result.resting == pytest.approx(9.80665 * (450.0 * arm + 90.0 * rod) - counter * arm, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("weight", "key"), [(-20.0, "reverse_torque"), (20.0, "torque")])
def test_a_band_brake_holds_with_the_torque_of_the_direction(weight, key):
    band = presses.band_brake(400.0, 0.5, 0.25, math.pi)
    parts = {"load": [{"on": "crank", "torque": weight}], "brake.0.torque": band.torque}
    result = flywheel.single_stroke(rotor(**parts, brake__0__reverse_torque=band.reverse_torque), rates=False)
    held = {"torque": band.torque, "reverse_torque": band.reverse_torque}[key]
    assert result.shares["brake at rest"] == pytest.approx(20.0 / held, rel=1e-9)
    assert band.torque == pytest.approx(band.reverse_torque * math.exp(0.25 * math.pi), rel=1e-12)
    if key == "reverse_torque":
        with pytest.raises(SceneError, match=r"brake\[0\].reverse_torque: found a brake of 19 N m that does not hold"):
            flywheel.single_stroke(rotor(**parts, brake__0__reverse_torque=19.0), rates=False)


def test_a_band_brake_that_lets_go_follows_its_two_torques():
    parts = {"load": [{"on": "crank", "torque": -300.0, "from": "300 deg", "to": "100 deg"}]}
    parts |= {
        "brake.0.fall": "80 ms",
        "brake.0.reverse_torque": 320.0,
        "shafts.wheel.clutch.rise": "0.4 s",
        "single_stroke.rate": "20 1/min",
    }
    result = flywheel.single_stroke(rotor(**parts), rates=False)
    along = course(result.strokes, result.phases, 2000)
    begin = (along.time < 0.08) & (along.crank == 0.0)
    held = 300.0 - RATIO * CLUTCH * along.time[begin] / 0.4
    assert along.brake[begin] == pytest.approx(held, abs=1e-4)
    falls = (along.time < 0.08) & (along.crank < 0.0)  # backwards, when the reverse torque is less than the weight's
    assert along.brake[falls] == pytest.approx(320.0 * (1 - along.time[falls] / 0.08), abs=1e-3)
    let_go = 20.0 / (320.0 / 0.08 - RATIO * CLUTCH / 0.4)
    assert along.time[begin].max() == pytest.approx(let_go, rel=1e-6)
    assert abs(result.energy_residual) < 1e-8


def test_errors_are_no_less_than_what_the_stroke_returns_by():
    result = plain()
    begin, phases = result.phases.begin, result.phases
    least = 2.0 * max(abs(phases.speed / begin[0] - 1.0), abs(phases.rest - TURN - begin[1]) / TURN)
    assert all(result.error[name] >= least * result.figures[name] for name in ("clutch_heat", "speed_least", "mean_power"))
    assert all(result.error["energy"][name] >= result.strokes.rtol * value for name, value in result.energy.items())


@pytest.mark.slow
def test_a_limit_to_which_the_flywheel_is_sized_is_kept():
    changes = {"flywheel.irregularity": None, "flywheel.limits.motor_rms": 1.0, "drive.motor.power": "0.55 kW"}
    result = flywheel.single_stroke(flywheel.load(starters.starter("single-stroke")).with_(changes), rates=False)
    assert not any("motor torque" in line for line in result.verdicts)


@pytest.mark.slow
def test_a_press_begins_where_no_torque_tells_which_way_its_belt_passes_power():
    shafts = {"on": "wheel", "ratio": 2.0, "efficiency": 0.9}
    scene = rotor(
        shafts__wheel__clutch__rise=0.03, shafts__motor=shafts, drive={"on": "motor", "torque": "0.5*(80 - omega)"}
    )
    assert abs(flywheel.single_stroke(scene, rates=False).energy_residual) < 1e-8


@pytest.mark.slow
def test_strokes_in_a_row_turn_the_crank_as_often():
    one, three = plain(), flywheel.single_stroke(rotor(single_stroke__continuous=3), rates=False)
    assert three.period == pytest.approx(3 * one.period)
    assert three.energy["loads"] == pytest.approx(3 * one.energy["loads"], rel=1e-9)
    assert three.phases.rest - three.overrun == pytest.approx(3 * TURN)


def test_idle_time_follows_the_standstill():
    result = flywheel.single_stroke(rotor(single_stroke__rate=None, single_stroke__idle="1 s"), rates=False)
    assert result.period - result.stroke_time == pytest.approx(1.0, rel=1e-9)


def test_idling_is_an_exponential_however_long_it_lasts():
    result = flywheel.single_stroke(rotor(single_stroke__rate=None, single_stroke__idle="60 s"), rates=False)
    recovery = result.phases.recovery
    assert len(recovery.stretches) < 200  # of 380 turns, each of which a step would end
    times = np.array([1.0, 3.0, 12.0, 15.0])
    phi, omega, work = recovery.states(times)
    begin, left = recovery.start.omega - 40.0, np.exp(-2.0 / J_WHEEL * times)
    assert omega - 40.0 == pytest.approx(begin * left, rel=1e-4)
    assert phi == pytest.approx(40.0 * times + begin * (1.0 - left) * J_WHEEL / 2.0, rel=1e-9)
    assert work == pytest.approx(J_WHEEL / 2.0 * (omega**2 - (40.0 + begin) ** 2), rel=1e-8)
    assert abs(result.energy_residual) < 1e-8


# -- what is refused ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"shafts.wheel.clutch.torque": 4.0, "load": None}, r"never locks: at its release at crank angle 300 deg"),
        ({"load.0.from": "0 deg", "load.0.to": "90 deg", "load.0.torque": -600.0}, "does not move the crank|falls back"),
        ({"load.0": {"on": "crank", "torque": "-2e3*omega"}, "shafts.wheel.clutch.torque": 60.0}, "not locked after 6.2"),
        ({"load.0.torque": -3000.0, "shafts.wheel.clutch.torque": 20.0}, "a crank that turns back at crank angle 123"),
        ({"load.0.torque": -1500.0}, r"a crank that stalls at crank angle 1.* slips again from crank angle 120 deg on"),
        ({"brake.0": {"torque": 4e3, "engage": "300 deg"}, "shafts.wheel.clutch.hold": 0.2}, "that still passes torque"),
        ({"load.0.torque": -3000.0, "shafts.wheel.clutch.static_torque": 9e9}, "stalls at crank angle 1"),
        ({"brake.0.torque": 1.0, "load": None}, "a brake of 1 N m that leaves the crank at"),
        ({"load.0": {"on": "crank", "torque": -450.0, "from": "330 deg", "to": "350 deg"}}, "400 N m that does not hold"),
        ({"shafts.wheel.clutch.static_torque": 119.0}, "static_torque: found 119.0, expected at least the torque of 120"),
        ({"drive.torque": "balance"}, "drive.torque"),
        ({"drive.torque": 5.0}, "does not depend on speed"),
        ({"flywheel.on": "crank"}, "flywheel.on: found a flywheel on crank, behind the clutch"),
        ({"brake.0.on": "wheel"}, "before the clutch"),
        ({"brake.0.engage": "200 deg"}, "before the clutch lets go"),
        ({"drive.on": "crank"}, "drive.on"),
        ({"load.0.torque": "-10*t"}, "depends on time"),
    ],
)  # fmt: skip
def test_what_does_not_work_is_refused_with_its_reason(changes, words):
    with pytest.raises(SceneError, match=words):
        flywheel.single_stroke(flywheel.load(ROTOR).with_(changes))


@pytest.mark.parametrize(
    "load",
    [
        None,  # a brake of 5 N m does not stop the crank within a turn; one of 400 N m does not hold it under the load
        [{"on": "crank", "torque": -450.0, "from": "330 deg", "to": "350 deg"}],
    ],
)
def test_a_brake_too_weak_is_refused_with_the_torque_that_mends_it(load):
    torque = 5.0 if load is None else 400.0
    weak = {"brake.0.torque": torque, "load": load, "single_stroke.rate": "10 1/min"}
    with pytest.raises(SceneError, match=r"leaves the crank|does not hold") as refused:
        flywheel.single_stroke(flywheel.load(ROTOR).with_(weak), 1e-4, rates=False)
    needs = float(re.search(r"(?:about|at least) ([\d.]+) N m", str(refused.value))[1])
    assert needs > torque
    enough = 2.0 * needs if load is None else 1.05 * needs  # it stops in half a turn, before the clutch would be released
    flywheel.single_stroke(flywheel.load(ROTOR).with_(weak | {"brake.0.torque": enough}), 1e-4, rates=False)


@pytest.mark.slow
def test_a_brake_that_lets_the_crank_run_into_the_work_is_refused_with_the_torque_that_stops_it():
    changes = {"flywheel.irregularity": None, "flywheel.inertia": 1.1, "brake.0.torque": 10.0}
    scene = flywheel.load(starters.starter("single-stroke")).with_(changes)
    with pytest.raises(SceneError, match=r"about .* N m to stop it at stop_at") as refused:
        flywheel.single_stroke(scene, rates=False)
    torque = float(re.search(r"about (\S+) N m", str(refused.value))[1])
    assert abs(flywheel.single_stroke(scene.with_({"brake.0.torque": torque}), rates=False).overrun) < 20 * DEGREE


def test_a_flywheel_that_a_stroke_does_not_slow_down_is_refused():
    with pytest.raises(SceneError, match=r"1e.10 kg m², whose speed a stroke hardly changes"):
        flywheel.single_stroke(rotor(flywheel__inertia=1e10))
    with pytest.raises(SceneError, match=r"single_stroke.continuous"):
        rotor(single_stroke__continuous=200)


@pytest.mark.slow
def test_a_rate_that_leaves_no_time_for_the_stroke_is_refused_with_one_that_does():
    with pytest.raises(SceneError, match=r"rate: found a stroke that lasts .* fewer than [\d.]+ strokes") as refused:
        flywheel.single_stroke(rotor(single_stroke__rate="200 1/min"), 1e-4, rates=False)
    fewer = 0.999 * float(re.search(r"fewer than ([\d.]+)", str(refused.value))[1])
    assert flywheel.single_stroke(rotor(single_stroke__rate=f"{fewer} 1/min"), 1e-4, rates=False).rate > 0.99 * fewer / 60


@pytest.mark.slow
def test_a_stroke_that_fails_because_the_motor_does_not_keep_the_rate_has_the_rate_as_its_remedy():
    weak = rotor(drive__torque="0.03*(40 - omega)", load__0__torque=-300.0, single_stroke__rate="60 1/min")
    with pytest.raises(SceneError, match=r"clutch.*at most about") as refused:
        flywheel.single_stroke(weak, 1e-4, rates=False)
    most = float(re.search(r"about ([\d.]+)", str(refused.value))[1])
    flywheel.single_stroke(weak.with_({"single_stroke.rate": f"{0.9 * most} 1/min"}), 1e-4, rates=False)


@pytest.mark.slow
def test_a_rate_that_the_motor_does_not_keep_is_refused_with_one_that_it_keeps():
    weak = rotor(drive__torque="0.05*(40 - omega)")
    with pytest.raises(SceneError, match=r"at most about [\d.]+ strokes a minute, or a stronger motor") as refused:
        flywheel.single_stroke(weak, 1e-4, rates=False)
    most = float(re.search(r"about ([\d.]+)", str(refused.value))[1])
    kept = flywheel.single_stroke(weak.with_({"single_stroke.rate": f"{0.95 * most} 1/min"}), 1e-4)
    assert kept.decides == "recovery of the drive"  # below it strokes from slower speeds return at lower rates again
    for share, returns in ((0.999, True), (1.001, False)):
        scene = weak.with_({"single_stroke.rate": share * kept.greatest_rate})
        if returns:
            assert flywheel.single_stroke(scene, 1e-4, rates=False, near=kept).rate == share * kept.greatest_rate
        else:
            with pytest.raises(SceneError):
                flywheel.single_stroke(scene, 1e-4, rates=False, near=kept)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"single_stroke": None}, r"clutch: found nothing to engage it, expected a table \[single_stroke\]"),
        ({"single_stroke.idle": 1.0}, "single_stroke"),
        ({"brake": None}, "brake: found nothing"),
        ({"shafts.wheel.clutch": None}, "found no clutch"),
        ({"shafts.wheel.clutch.engage": "20 deg"}, "engage: found 20 deg, and stop_at at 0 deg"),
        ({"single_stroke.rate": "30 rpm"}, "single_stroke.rate: found"),
        ({"brake.0.engage": "400 deg"}, 'engage: found "400 deg", expected an angle from 0 to 360 deg'),
        ({"single_stroke.continuous": 1.5}, "a whole number of strokes"),
        ({"shafts.wheel.clutch.torqe": 1.0}, 'did you mean "torque"'),
        ({"single_stroke.response": "1 s"}, "approach together with it"),
        ({"duty": [{"duration": "60 s"}]}, r"duty together with \[single_stroke\]"),
    ],
)
def test_faults_of_the_scene(changes, words):
    with pytest.raises(SceneError, match=words):
        flywheel.load(ROTOR).with_(changes)


def test_other_commands_do_not_pass_over_clutch_and_brake():
    calls = (
        *(flywheel.size, flywheel.run_up, lambda scene: flywheel.simulate(scene, 0.0, 1.0, 1.0)),
        lambda scene: flywheel.suitable_motors(scene, "motors.csv"),
    )
    for call in calls:
        with pytest.raises(SceneError, match="works stroke by stroke"):
            call(rotor())
    with pytest.raises(SceneError, match="single_stroke: found nothing"):
        flywheel.single_stroke(rotor(single_stroke=None, brake=None, shafts__wheel__clutch=None))


# -- the press of the reference, by the command ------------------------------------------------------------------------


@pytest.mark.slow
def test_the_press_of_the_reference(tmp_path):
    scene = tmp_path / "press.toml"
    scene.write_text(re.search(r"```\n(\[shafts.*?)```", text("single-stroke"), re.DOTALL)[1])
    run = CliRunner().invoke(main, ["size", str(scene), "--json"])
    assert run.exit_code == 0
    result = json.loads(run.stdout)
    figures = result["single_stroke"]
    assert figures["keeps_up"] is True
    assert figures["period"] == 3.0
    assert abs(figures["energy_residual"]) < 1e-7
    assert result["error"]["single_stroke"].keys() <= figures.keys()
    assert result["simulation"] is None
    assert "no steady cycle" in result["null_because"]
    assert {f"`{name}`" for name in figures} <= set(re.findall(r"`\w+`", text("single-stroke")))
    shown = CliRunner().invoke(main, ["size", str(scene)])
    assert re.search(r"overrun past stop_at +-19\.870 deg", shown.stdout)
    (row,) = re.findall(r"clutch torque +([\d.e-]+) % +([\d.e-]+) N m of 900\.0 N m", shown.stdout)
    assert float(row[1]) == pytest.approx(9.0 * float(row[0]), rel=2e-3)
    full = CliRunner().invoke(main, ["size", str(scene), "--full", "--rtol", "1e-6"]).stdout
    assert [key for key, value in figures.items() if isinstance(value, float) and key not in full] == []
    spanish = CliRunner().invoke(main, ["size", str(scene), "--language", "es", "--units", "us", "--rtol", "1e-6"]).stdout
    assert re.search(r"par del embrague acoplado +326,46 lbf ft", spanish)
    refused = CliRunner().invoke(main, ["size", str(scene), "--explain"])
    assert (refused.exit_code, "--explain does not apply" in refused.stderr) == (2, True)


# -- curves, pictures, the live page -----------------------------------------------------------------------------------


def test_a_course_is_the_motion_with_both_sides_of_every_jump():
    result = plain()
    along = course(result.strokes, result.phases, 400)
    assert (np.diff(along.time) >= 0.0).all()
    assert along.drive_work[-1] == pytest.approx(result.energy["motor"], rel=1e-10)
    assert along.wheel_work.max() == pytest.approx(result.wheel_energy, rel=1e-7)
    assert along.wheel_work[-1] == pytest.approx(0.0, abs=1e-6 * result.wheel_energy)
    locked = (along.time > result.slip_time) & (along.time < result.phases.release_time)
    assert along.crank[locked] == pytest.approx(along.driving[locked], rel=1e-12)
    assert along.clutch[along.time < result.slip_time] == pytest.approx(CLUTCH)
    assert np.abs(along.clutch[locked]).max() == pytest.approx(result.clutch_torque, rel=1e-6)
    jump = np.flatnonzero((np.diff(along.time) == 0.0) & (np.abs(np.diff(along.clutch)) > 20.0))
    assert along.phi[jump] == pytest.approx([*result.phases.lock_angle * np.ones(1), 120 * DEGREE, 200 * DEGREE], abs=1e-6)


@pytest.mark.parametrize("efficiency", sample([1.0, 0.8], 2))
def test_the_clutch_passes_what_the_driven_side_takes(efficiency):
    scene = flywheel.load(ROTOR).with_(
        {
            "shafts.motor": {"on": "wheel", "ratio": 2.0, "efficiency": efficiency},
            "drive": {"on": "motor", "torque": "2*(80 - omega)"},
            "inertia.1": {"on": "motor", "value": 0.05},
        }
    )
    result = flywheel.single_stroke(scene, rates=False)
    locked = result.phases.legs[1].driven
    times = locked.t[0] + np.linspace(0.01, 0.99, 25) * (locked.t[-1] - locked.t[0])
    phi, omega, _ = locked.states(times)
    load = np.where((phi > 120 * DEGREE) & (phi < 200 * DEGREE), 150.0, 0.0)
    motor = 2 * (80 - 2 * RATIO * omega)  # passes what is left of it forwards or, braking, more of it backwards
    own, whole = 0.05 * 2 * RATIO, J_CRANK + J_WHEEL * RATIO**2
    for eta in (efficiency, 1 / efficiency):
        alpha = (2 * RATIO * eta * motor - load) / (whole + 2 * RATIO * eta * own)
        fits = (motor - own * alpha) * (1 if eta <= 1 else -1) >= 0.0
        torque = (J_CRANK * alpha + load) / RATIO
        assert result.strokes.locked_torque(locked, times, locked.owners(times))[fits] == pytest.approx(
            torque[fits], rel=1e-8
        )


@pytest.mark.slow
def test_formulas_are_those_of_the_motion_where_nothing_else_acts():
    result = flywheel.single_stroke(
        rotor(drive__torque="0.01*(40 - omega)", load=None, single_stroke__rate="1 1/min"), 1e-4, rates=False
    )
    assert result.formulas["clutch_heat"] == pytest.approx(result.clutch_heat, rel=2e-3)
    assert result.formulas["slip_time"] == pytest.approx(result.slip_time, rel=2e-3)


@pytest.mark.slow
def test_the_report_has_every_figure_with_its_formula(tmp_path):
    result = flywheel.single_stroke(rotor(single_stroke__approach="2 m/s", brake__0__rise="20 ms"), 1e-6)
    worked = contents.worked(result)
    assert (document.untraced(worked), document.unreproduced(worked)) == ([], [])
    sections = [part for part in worked.parts if isinstance(part, document.Section)]
    tables = [part for section in sections for part in section.parts if isinstance(part, document.Table)]
    (loads,) = (table for table in tables if "of its limit" in table.head)
    for _, value, limit, share in loads.rows:
        assert share.value == pytest.approx(value.value / limit.value)
    assert loads.rows[-2][2].value == BRAKE
    result.report(tmp_path / "stroke.html", language="es")
    page = (tmp_path / "stroke.html").read_text()
    for words in ("La carrera que se repite", "ISO 13855", "Cargas y límites", "el embrague patina"):
        assert words in page
    sheet = contents.html(result, cover_sheet=True, units="us")
    answers, wheel = (
        sheet.index("Do the parts suffice for 40"),
        sheet.index(f"{J_WHEEL / 0.45359237 / 0.3048**2:.3f} lb ft²"),
    )
    assert answers < wheel < sheet.index("clutch torque, locked")  # first what a buyer asks
    assert "La carrera que se repite" not in sheet


@pytest.mark.slow
def test_a_servo_drive_has_its_area_points_and_ratio_of_inertias(tmp_path):
    motor = {"type": "servo", "speed": 62.5, "torque": 60.0, "standstill_torque": 70.0, "peak_torque": 90.0}
    motor |= {
        "corner_speed": 43.75,
        "maximum_speed": 125.0,
        "set_speed": 50.0,
        "droop": "4 %",
        "efficiency": 0.9,
        "inertia": 0.3,
    }
    scene = rotor(
        shafts__motor={"on": "wheel", "ratio": 1.25}, drive={"on": "motor", "motor": motor | {"braking": "regenerative"}}
    )
    result = flywheel.single_stroke(scene, 1e-8, rates=False)

    def torque(omega):
        return np.clip(60.0 / (0.04 * 50.0) * (50.0 - omega), -90.0, 90.0)

    along = course(result.strokes, result.phases, 20_000)
    speeds = 1.25 * along.driving
    peak = np.minimum(90.0, 90.0 * (125.0 - speeds) / 81.25)
    mean = np.trapezoid(speeds, along.time) / result.period
    rms = (np.trapezoid(np.clip(torque(speeds), -peak, peak) ** 2, along.time) / result.period) ** 0.5
    assert result.servo_mean_speed == pytest.approx(mean, rel=1e-6)
    assert result.servo_continuous_share == pytest.approx(rms / (70.0 - 10.0 * mean / 62.5), rel=1e-5)
    shares = np.abs(torque(speeds)) / peak
    assert result.servo_peak_share == pytest.approx(min(shares.max(), 1.0), rel=1e-6)
    assert result.servo_peak_speed == pytest.approx(speeds[np.argmax(shares >= result.servo_peak_share - 1e-9)], rel=1e-2)
    assert result.servo_inertia_ratio == pytest.approx(J_WHEEL / 1.25**2 / 0.3)
    page = data.answer(result)
    assert page["figures"] == ["mechanism", "single_stroke", "servo"]
    assert [mark["at"] for mark in page["servo"]["diagram"]["rows"][0]["marks"]] == [
        result.servo_mean_speed,
        result.servo_peak_speed,
    ]
    result.plot(tmp_path / "stroke.svg")
    assert "continuous curve" in (tmp_path / "stroke.svg").read_text()
    assert "Relación de inercias" in contents.html(result, language="es")


@pytest.mark.slow
def test_the_picture_is_drawn_and_the_page_has_it_over_time(tmp_path):
    result = flywheel.single_stroke(rotor(), 1e-6)
    result.plot(tmp_path / "stroke.svg")
    assert "the clutch slips" in (tmp_path / "stroke.svg").read_text()
    page = data.answer(rotor(), rest=False)
    assert page["driver"] == {"kind": "time", "stroke": False, "from": 0.0, "to": 1.5, "backwards": False}
    assert page["figures"] == ["mechanism", "single_stroke"]
    assert page["why"] == {}
    assert len(page["single_stroke"]["clutch"]) == len(page["phi"])
    stalled = data.answer(rotor(load__0__torque=-3000.0, shafts__wheel__clutch__static_torque=9e9))
    assert stalled["figures"] == ["mechanism"]
    assert "stalls" in stalled["faults"][0].defect
