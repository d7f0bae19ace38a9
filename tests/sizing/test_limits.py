"""Limits of the drive and of the wheel, on every shaft."""

from functools import cache
from math import pi, radians, sin, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flywheel
from flywheel import Machine, SceneError, Sizing
from flywheel.components.wheels import parts
from flywheel.designs.figures import ALONE, REFINED, TRACED
from flywheel.regime import turning_moment
from flywheel.regime.branch import Existence, resonates
from flywheel.sizing import limits
from flywheel.sizing.limits import FlywheelPoint, LimitState, Search
from flywheel.sizing.motor import Share
from flywheel.tables import sizing as report
from tests import regimes, scenes
from tests.limits import sample
from tests.oracle.inertia_scan import Textbook, irregularity, kept, mean

# Flywheels sized for limits: each found again by shooting on equations written here, the one that binds, and refusals.


RATIO, OWN, START, END, LOAD = 6.5, 0.4, radians(40), radians(100), 1200.0
POWER, SPEED, VOLTAGE, EFFICIENCY = 7500.0, 1420 * pi / 30, 440.0, 0.88
RATED, AMPS = POWER / SPEED, POWER / (EFFICIENCY * VOLTAGE)
RESISTANCE = 0.5 * (VOLTAGE * AMPS - POWER) / AMPS**2
CONSTANT = (VOLTAGE - RESISTANCE * AMPS) / SPEED
FRICTION = 0.5 * (VOLTAGE * AMPS - POWER) / SPEED**2
LIMITS = {"irregularity": 0.1, "motor_torque": 1.6, "motor_rms": 0.8, "motor_heat": 0.6, "current_pulsation": 1.0}


def punch(limits: dict[str, Any], inductance: float = 0.0, **motor: Any) -> dict[str, Any]:
    """A rotor that a window of torque brakes, behind a gear, with a DC motor."""
    plate = {"type": "dc", "voltage": VOLTAGE, "power": POWER, "speed": SPEED, "efficiency": EFFICIENCY}
    return {
        "inertia": [{"on": "crank", "value": OWN}],
        "load": [{"on": "crank", "torque": -LOAD, "from": START, "to": END}],
        "shafts": {"motor": {"ratio": RATIO}},
        "drive": {"on": "motor", "motor": (plate | {"inductance": inductance}) | motor},
        "flywheel": {"limits": limits},
    }


def sized(limits: dict[str, Any], *, simulate: bool = False, **of: Any) -> flywheel.Sizing:
    """The sizing of such a scene."""
    return flywheel.size(flywheel.load(punch(limits, **of)), simulate=simulate)


def current(omega: Any) -> Any:
    """Armature current (A) at speeds of the crank."""
    return (VOLTAGE - CONSTANT * RATIO * omega) / RESISTANCE


def torque(omega: Any) -> Any:
    """Torque on the motor's shaft (N m) at speeds of the crank."""
    return CONSTANT * current(omega) - FRICTION * RATIO * omega


def true_shares(inertia: float) -> dict[str, float]:
    """The figures along the periodic motion with a flywheel, by shooting over the crank angle."""

    def rates(load: float) -> Any:
        def result(phi: float, y: Any) -> list[float]:
            w = sqrt(y[0])
            drive, amps = torque(w), current(w)
            return [2 * (RATIO * drive - load) / (inertia + OWN), 1 / w, drive**2 / w, amps**2 / w]

        return result

    def cycle(square: float) -> tuple[Any, list[float]]:
        y, ends = np.array([square, 0.0, 0.0, 0.0]), [square]
        for a, b, load in ((0.0, START, 0.0), (START, END, LOAD), (END, 2 * pi, 0.0)):
            y = solve_ivp(rates(load), (a, b), y, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
            ends.append(float(y[0]))
        return y, ends

    square = 540.0
    for _ in range(4):
        (y, _ends), (other, _) = cycle(square), cycle(square * 1.0001)
        square -= (y[0] - square) / ((other[0] - y[0]) / (square * 1e-4) - 1.0)
    y, ends = cycle(square)
    fast, slow = sqrt(max(ends)), sqrt(min(ends))  # the load sets in and ends at the extremes
    return {
        "irregularity": 2 * (fast - slow) / (fast + slow),
        "motor_torque": torque(slow) / RATED,
        "motor_rms": sqrt(y[2] / y[1]) / RATED,
        "motor_heat": y[3] / y[1] / AMPS**2,
        "current_pulsation": (current(slow) - current(fast)) / AMPS,
    }


def test_each_limit_alone_is_met_by_its_flywheel_and_the_largest_of_them_keeps_all():
    sizing = sized(LIMITS)
    for name, limit in sizing.limits.items():
        assert true_shares(limit.alone)[name] == pytest.approx(limit.requirement, rel=2e-9), name
        assert 0.0 < limit.alone_error < 1e-9
    assert sizing.flywheel.exact == max(limit.alone for limit in sizing.limits.values())
    assert sizing.binding == "current_pulsation"
    true = true_shares(sizing.flywheel.exact)
    for name, limit in sizing.limits.items():
        assert limit.reached == pytest.approx(true[name], rel=2e-9)
        assert limit.reached <= limit.requirement * (1 + 1e-9)
    assert sizing.reached
    data = sizing.as_dict()
    assert data["flywheel"]["binding"] == "current_pulsation"
    assert data["flywheel"]["limits"]["motor_heat"]["alone"] == sizing.limits["motor_heat"].alone
    assert set(data["error"]["limits"]) == set(LIMITS)
    assert sizing.energy is not None
    assert sizing.energy.copper_heat_share == pytest.approx(sizing.limits["motor_heat"].reached, rel=1e-9)


def test_a_drag_against_the_motion_is_that_by_the_square_of_the_speed_for_limits_too():
    """It bends at standstill alone: no cell along any motion ends there."""
    motor = {"type": "induction", "power": POWER, "speed": 150.0, "poles": 4, "frequency": "50 Hz", "breakdown_ratio": 2.6}
    scene = punch({"irregularity": 0.1, "motor_torque": 1.6}) | {"drive": {"on": "motor", "motor": motor}}
    exact = [
        flywheel.size(flywheel.load({**scene, "load": [*scene["load"], drag]}), simulate=False).flywheel.exact
        for drag in ({"on": "crank", "torque": "-0.01*omega**2"}, {"on": "crank", "torque": "-0.01*omega*abs(omega)"})
    ]
    assert exact[0] > 0.0
    assert exact[1] == pytest.approx(exact[0], rel=1e-9)


@pytest.mark.slow
def test_a_loose_accuracy_keeps_its_word():
    scene, tight = punch({"motor_torque": 1.6}), sized({"motor_torque": 1.6}).flywheel.exact
    for rtol in (1e-3, 1e-6):
        sizing = flywheel.size(flywheel.load(scene), rtol, simulate=False)
        assert abs(sizing.flywheel.exact / tight - 1) <= sizing.error.exact <= rtol


@pytest.mark.slow
@pytest.mark.parametrize(("inductance", "rtol"), sample([(0.0, 1e-4), (3.5e-3, 1e-4), (0.0, 1e-6)], 2))
def test_figures_along_the_motion_allow_for_what_is_open_of_the_flywheel(inductance: float, rtol: float):
    """By 1e-13 of a flywheel the speed changes by no more than rounding; by 1e-4 it may."""
    scene = flywheel.load(punch(LIMITS, inductance))
    loose, close = (flywheel.size(scene, each, accuracy="normal") for each in (rtol, 1e-13))
    loosely, closely, off = loose.as_dict(), close.as_dict(), loose.as_dict()["error"]
    assert loosely["flywheel"]["exact"] != closely["flywheel"]["exact"]
    pairs = {name: (loosely[name], closely[name], off[name]) for name in ("speed", "power")}
    pairs |= {
        name: (loosely["energy"][name], closely["energy"][name], off["energy"])
        for name in ("peak_power", "rms_torque", "mean_power")
    }
    for name, (mine, true, error) in pairs.items():
        assert abs(mine - true) <= (error + 1e-14) * abs(true), name
    for name in ("angle_speed_max", "angle_speed_min"):
        assert abs(loosely[name] - closely[name]) <= off[name] + 1e-12, name


def test_figures_along_a_motion_with_a_current_allow_for_what_is_open_of_the_flywheel():
    """A flywheel for an irregularity that is known to 3e-4 leaves open the speed and the currents with it."""
    motor = {"type": "dc", "voltage": "200 V", "resistance": "15.11 ohm", "constant": "1.994 V s", "inductance": "0.2173 H"}
    scene = flywheel.load(
        {
            "mechanism": {
                "type": "slider-crank",
                "crank": {"length": 0.25, "mass": 0.59, "inertia": 0.003},
                "rod": {"length": 0.73},
                "slider": {"mass": 1.44},
            },
            "shafts": {"s": {"ratio": 3.057}},
            "load": [{"on": "slider", "force": "-2*v"}, {"on": "s", "torque": -0.3}],
            "drive": {"on": "s", "motor": motor},
            "flywheel": {"irregularity": 0.00868},
        }
    )
    loose, close = (flywheel.size(scene, each, accuracy="normal").as_dict() for each in (1e-2, 1e-12))
    assert loose["flywheel"]["exact"] != close["flywheel"]["exact"]
    pairs = {"speed": (loose["speed"], close["speed"])}
    pairs |= {name: (loose["energy"][name], close["energy"][name]) for name in ("current_rms", "current_peak")}
    for name, (mine, true) in pairs.items():
        assert 1e-12 < abs(mine / true - 1) <= loose["error"][name], name


def test_a_current_with_a_state_of_its_own_and_its_confirmation_in_time():
    sizing = sized({"irregularity": 0.1, "current_pulsation": 1.0}, inductance=0.05, simulate=True)
    assert sizing.binding == "current_pulsation"
    assert sizing.limits["current_pulsation"].alone < sized({"current_pulsation": 1.0}).flywheel.exact
    for limit in sizing.limits.values():
        assert limit.simulated == pytest.approx(limit.reached, rel=1e-9)


def test_the_irregularity_alone_is_the_sizing_for_it():
    plain = punch({}) | {"flywheel": {"irregularity": 0.1}}
    request, sizing = flywheel.size(flywheel.load(plain), simulate=False), sized({"irregularity": 0.1})
    assert sizing.flywheel == request.flywheel
    assert (sizing.binding, sizing.limits["irregularity"].alone) == ("irregularity", request.flywheel.exact)
    assert request.as_dict()["flywheel"]["limits"] is None
    diagram = {"areas": {"values": [100, -100], "scale": 1}, "regime": {"speed": 10}}
    diagram["flywheel"] = {"limits": {"irregularity": 0.02}}
    assert flywheel.size(flywheel.load(diagram)).limits["irregularity"].alone == 50.0


def test_nothing_binds_where_the_machine_keeps_its_limits_alone():
    scene = punch({"motor_torque": 1.6, "irregularity": 0.2})
    scene["inertia"] = [{"on": "crank", "value": 60.0}]
    sizing = flywheel.size(flywheel.load(scene), simulate=False)
    assert (sizing.flywheel.exact, sizing.flywheel.needed, sizing.binding) == (0.0, False, None)
    assert sizing.limits["motor_torque"].reached < 1.6


def test_of_a_figure_that_rises_between_the_least_crossing_counts(monkeypatch):
    def hump(_machine: Any, motion: Any, rtol: float) -> dict[str, Share]:
        total = motion.inertia + 1.0
        value = 0.5 + 5 / total + 0.4 * float(np.exp(-((np.log(total / 160) / 0.4) ** 2)))
        return {"motor_rms": Share(value, 0.01 * rtol)}

    monkeypatch.setattr(limits, "lighter_motions", lambda *_: [])  # whose figures are those of many motions at once
    monkeypatch.setattr(limits, "shares_along", hump)
    sizing = sized({"motor_rms": 0.75})
    assert sizing.flywheel.exact == pytest.approx(19.0, rel=1e-9)
    assert any("motor_rms is not kept by heavier flywheels of" in message for message in sizing.messages)


def test_limits_that_no_flywheel_reaches_are_told_with_the_best():
    with pytest.raises(SceneError) as caught:
        sized({"motor_rms": 0.3, "motor_torque": 0.3, "irregularity": 0.1})
    mean = 100 * LOAD * (END - START) / (2 * pi * RATIO) / RATED  # at a constant speed the motor gives the mean torque
    assert [fault.path for fault in caught.value.faults] == ["flywheel.limits.motor_torque", "flywheel.limits.motor_rms"]
    assert all(f"at a constant speed, it is {mean:.6g} %" in fault.defect for fault in caught.value.faults)
    assert sized({"motor_rms": mean / 100 + 1e-5}).limits["motor_rms"].reached == pytest.approx(mean / 100 + 1e-5)


def test_a_pulsation_of_the_current_of_the_load_alone_is_told():
    plate = {"type": "induction", "power": POWER, "speed": "1420 rpm", "poles": 4, "frequency": 50, "breakdown_ratio": 2.6}
    scene = punch({"current_pulsation": 1.0})
    output = {}
    for name, more in (("alone", {}), ("whole", {"voltage": 400, "current": 16, "power_factor": 0.82})):
        scene["drive"] = {"on": "motor", "motor": plate | more}
        output[name] = " ".join(flywheel.size(flywheel.load(scene), simulate=False).messages)
    assert "give power_factor or no_load_current" in output["alone"]
    assert "power_factor" not in output["whole"]


@pytest.mark.slow
def test_a_crossing_beside_those_of_other_limits_is_found():
    """The crossing of one limit leaves a cluster of flywheels, from which the next zero of another came again and again."""
    plate = {"type": "induction", "power": 7500, "speed": "1400 rpm", "poles": 4, "frequency": 50, "breakdown_ratio": 2.6}
    scene = {
        "shafts": {
            "wheel": {"ratio": 5, "efficiency": 0.97, "drag": 15},
            "motor": {"on": "wheel", "ratio": 3.5, "efficiency": 0.95, "slip": 0.02},
        },
        "mechanism": {
            "type": "slider-crank",
            "crank": {"length": 0.06, "mass": 110, "inertia": 3},
            "rod": {"length": 0.52, "mass": 70, "inertia": 2.2, "com": 0.16},
            "slider": {"mass": 240},
        },
        "load": [
            {"on": "slider", "force": "-420 kN", "from": "335 deg", "to": "358 deg"},
            {"on": "slider", "model": {"type": "constant", "force": "1.2 kN"}},
        ],
        "inertia": [{"on": "wheel", "value": 0.6}],
        "drive": {"on": "motor", "motor": plate | {"voltage": 400, "current": 16, "power_factor": 0.82, "inertia": 0.03}},
        "flywheel": {"on": "wheel", "limits": {"motor_torque": 1.5, "current_pulsation": 0.9}},
    }
    sizing = flywheel.size(flywheel.load(scene), simulate=False)
    assert sizing.binding == "current_pulsation"
    assert sizing.limits["current_pulsation"].reached == pytest.approx(0.9, rel=1e-8)
    assert sizing.error.exact < 1e-8


@pytest.mark.parametrize(
    ("limits", "motor", "message"),
    [
        ({}, {}, "flywheel.limits: found no limit"),
        ({"motor_heat": 110}, {}, 'write "110 %"'),
        ({"motor_hat": 1}, {}, 'did you mean "motor_heat"?'),
        ({"motor_heat": 1}, {"type": "engine"}, "whose losses are not known"),
        ({"current_pulsation": 0.4}, {"type": "engine"}, "whose current is not known"),
        ({"motor_rms": 1}, {"type": "constant"}, "without a rated point"),
        ({"motor_rms": 1}, None, "motor_rms without a motor"),
    ],
)
def test_limits_that_cannot_be_are_told_in_a_line(limits, motor, message):
    scene = punch(limits)
    if motor is None:
        scene["drive"], scene["regime"] = {"torque": "balance"}, {"speed": 10}
    elif motor:
        others = {"engine": {"speed": SPEED, "torque": RATED, "droop": 0.08}, "constant": {"torque": RATED}}
        scene["drive"] = {"on": "motor", "motor": motor | others[motor["type"]]}
    with pytest.raises(SceneError) as caught:
        flywheel.load(scene)
    assert message in str(caught.value)


def test_limits_stand_beside_no_irregularity_and_no_inertia():
    with pytest.raises(SceneError, match="exactly one of irregularity, inertia, gd2, limits"):
        flywheel.load(punch(LIMITS) | {"flywheel": {"limits": LIMITS, "irregularity": 0.1}})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "alone"),
    [({"motor_torque": 1.6}, False), ({"motor_torque": 1.6, "irregularity": 0.2}, False), ({"motor_heat": 0.6}, True)],
)
def test_a_sweep_finds_the_flywheels_that_keep_limits(limits, alone):
    """Many at once, but for a limit of the heat that a current makes."""
    columns = {f"flywheel.limits.{name}": [value, 1.1 * value] for name, value in limits.items()}
    columns["inertia.0.value"] = [0.4, 0.3]
    result = flywheel.sweep(flywheel.load(punch(limits)), columns)
    assert set(result.ways.tolist()) <= ({ALONE} if alone else {TRACED, REFINED})
    for k in (0, 1):
        sizing = flywheel.size(result.design(k), 1e-12, simulate=False)
        assert result.exact[k] == pytest.approx(sizing.flywheel.exact, rel=result.error.exact[k] + 1e-12)
        assert result.speed[k] == pytest.approx(sizing.speed, rel=result.error.speed[k] + 1e-12)


def test_the_flywheels_of_a_search_turn_with_the_machine_s_own_inertia_in_even_steps():
    search = Search({"irregularity": 0.1}, 0.75, 52.0, 1e-9, per_decade=12)
    totals = 0.75 + np.array(search.inertias)
    assert (search.inertias[0], search.inertias[-1]) == (pytest.approx(52.0), 0.0)
    steps = totals[:-1] / totals[1:]
    assert steps == pytest.approx(np.full(steps.shape, steps[0]))
    assert 1.15 < steps[0] <= 10 ** (1 / 12)


def test_a_current_resonates_with_flywheels_whose_swing_it_damps_too_little():
    """L di/dt = U - R i - k w, J dw/dt = k i - T: damping ratio R/2 sqrt(J/L)/k, and a peak of w below 1/sqrt(2)."""
    motor = {"type": "dc", "voltage": 220, "constant": 1.3, "resistance": 2.0, "inductance": 0.025, "inertia": 0.01}
    machine = Machine(flywheel.load({"load": [{"on": "crank", "torque": -8}], "drive": {"motor": motor}}))
    speed = (220 - 2.0 * 8 / 1.3) / 1.3
    decisive = 2.0 * 0.025 * (1.3 / 2.0) ** 2 - 0.01
    for inertia, resonant in ((0.0, True), (0.99 * decisive, True), (1.01 * decisive, False), (1.0, False)):
        assert resonates(machine, speed, [inertia], 0.0) is resonant
    assert resonates(machine, speed, [1.0, 0.0], 0.0)
    assert not resonates(machine, speed, [1.1 * decisive, 1.0], 0.0)


def test_what_a_machine_alone_hardly_breaks_asks_for_a_small_flywheel():
    """A figure over its limit by a share of 1e-5, or of 1e-7: flywheels in that ratio, however roughly trials are solved."""
    dc = {"type": "dc", "voltage": 220, "resistance": 2, "constant": 1.3, "inductance": 0.025, "inertia": 0.03}
    cylinder = {"type": "compressor", "bore": 0.1, "clearance": 0.06, "suction": 1e5, "discharge": 6e5, "exponent": 1.3}
    crank = {"length": 0.04, "inertia": 0.012}
    scene = {
        "mechanism": {"type": "slider-crank", "crank": crank, "rod": {"length": 0.18}, "slider": {"mass": 3.2}},
        "shafts": {"motor": {"ratio": 4.5}},
        "load": [{"on": "slider", "model": cylinder}],
        "drive": {"on": "motor", "motor": dc},
    }

    def result(**wheel: float) -> Sizing:
        return flywheel.size(flywheel.load({**scene, "flywheel": wheel}), simulate=False)

    alone = result(inertia=0.0).run.irregularity
    light, lighter = (result(irregularity=alone * (1.0 - share)).flywheel.exact for share in (1e-5, 1e-7))
    assert light > 0.0
    assert lighter == pytest.approx(0.01 * light, rel=1e-4)


# The smallest flywheel, and the heavier ones that break what it keeps, against scans of inertias by textbook equations.


SCAN = np.concatenate(([0.0], np.geomspace(1e-3, 1e2, 99)))


def swinging(**wheel):
    """A rotor that a sine brakes, behind a DC motor whose current swings with it."""
    motor = {"type": "dc", "voltage": 440, "inductance": "3.5 mH", "power": 12000, "speed": "3300 rpm"}
    return {
        "inertia": [{"on": "crank", "value": 0.05}],
        "load": [{"on": "crank", "torque": "-150 - 120*sin(phi)"}],
        "shafts": {"fw": {"ratio": 2}, "motor": {"ratio": 3, "on": "fw"}},
        "drive": {"on": "motor", "motor": motor | {"efficiency": 0.965, "inertia": 0.002}},
        "flywheel": {"on": "fw"} | wheel,
    }


LIGHT_AMPS, RATED_SPEED = 12000.0 / (440.0 * 0.965), 3300 * pi / 30
LOST = 0.5 * (440.0 * LIGHT_AMPS - 12000.0)  # half of it in the copper
LIGHT_RESISTANCE, LIGHT_FRICTION = LOST / LIGHT_AMPS**2, LOST / RATED_SPEED**2
LIGHT_CONSTANT = (440.0 - LIGHT_RESISTANCE * LIGHT_AMPS) / RATED_SPEED


def at_once(omega):
    """The current of an armature without inductance."""
    return (440.0 - LIGHT_CONSTANT * omega) / LIGHT_RESISTANCE


def by_hand(load: float = 1.0, inductance: float = 3.5e-3) -> Textbook:
    return Textbook(
        inertia=lambda phi: (0.05 + 36 * 0.002, 0.0),
        torque=lambda omega, i: LIGHT_CONSTANT * (i if inductance else at_once(omega)) - LIGHT_FRICTION * omega,
        load=lambda phi: -load * (150 + 120 * sin(phi)),
        ratio=6.0,
        speed=RATED_SPEED / 6,
        amps=0.7 * LIGHT_AMPS,
        current=(lambda omega, i: (at_once(omega) - i) * LIGHT_RESISTANCE / inductance) if inductance else None,
    )


@pytest.fixture(scope="module")
def motions():
    return by_hand().motions(4 * SCAN)


@pytest.mark.slow
def test_an_irregularity_that_rises_with_inertia_and_falls_again(motions):
    true = irregularity(motions[0])
    assert true[0] < 0.026 < true.max()
    sizing = flywheel.size(flywheel.load(swinging(irregularity=0.026)), simulate=False)
    assert (sizing.flywheel.exact, sizing.flywheel.needed) == (0.0, False)
    clear = np.abs(true / 0.026 - 1.0) > 1e-4
    assert (kept(sizing, SCAN) == (true <= 0.026))[clear].all()
    (broken,) = sizing.flywheel.broken
    edges = irregularity(by_hand().motions(4 * np.array([broken.start, broken.end]))[0])
    assert edges == pytest.approx(0.026, rel=1e-4)  # of steps of a degree
    data = sizing.as_dict()
    assert data["flywheel"]["broken"] == [{"from": broken.start, "to": broken.end}]
    assert 0.0 < data["error"]["broken"] < 1e-9
    assert any("not kept by heavier flywheels of 0.018437 to 0.77587 kg m^2" in output for output in sizing.messages)
    tighter = flywheel.size(flywheel.load(swinging(irregularity=0.025)), simulate=False)
    assert (kept(tighter, SCAN) == (true <= 0.025))[np.abs(true / 0.025 - 1.0) > 1e-4].all()
    assert tighter.flywheel.exact > broken.start


@pytest.mark.parametrize("name", sample(["motor_heat", "motor_torque", "motor_rms", "current_pulsation"], 3))
def test_limits_of_a_motor_with_a_current_of_its_own(name, motions):
    rated, (omega, i) = 12000.0 / RATED_SPEED, motions
    torque = by_hand().torque(6 * omega, i)
    true = {
        "motor_torque": np.abs(torque).max(axis=0) / rated,
        "motor_rms": np.sqrt(mean(torque**2, omega)) / rated,
        "motor_heat": mean(i**2, omega) / LIGHT_AMPS**2,
        "current_pulsation": np.ptp(i, axis=0) / LIGHT_AMPS,
    }[name]
    for share in (0.3, 0.9):
        request = float(true.min() + share * np.ptp(true))
        sizing = flywheel.size(flywheel.load(swinging(limits={name: request})), simulate=False)
        assert (kept(sizing, SCAN) == (true <= request))[np.abs(true / request - 1.0) > 1e-4].all(), request


@pytest.mark.slow
def test_a_limit_that_is_kept_without_a_flywheel_is_not_lost_where_the_motion_is_stiff():
    def yoke(**limits):
        motor = {"type": "hydraulic", "displacement": "60 cm^3", "flow": "24 l/min", "pressure": "100 bar"}
        return {
            "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.08, "inertia": 1.0}, "yoke": {"mass": 1000}},
            "load": [{"on": "yoke", "force": "-1000*sign(v)"}],
            "drive": {"motor": motor | {"mechanical_efficiency": 0.94, "volumetric_efficiency": 0.93}},
            "flywheel": {"limits": limits},
        }

    volume, even = 60e-6 / (2 * pi), 24e-3 / 60 / (60e-6 / (2 * pi))
    rated = 0.94 * volume * 100e5

    def torque(omega, _):
        below = rated * np.minimum((even - omega) / (0.07 * even), 1.0)
        return np.where(omega <= even, below, np.maximum(below, -rated) / 0.94**2)

    own = 1000 * 0.08**2
    machine = Textbook(
        inertia=lambda phi: (1.0 + own * sin(phi) ** 2, own * sin(2 * phi)),
        torque=torque,
        load=lambda phi: -1000 * 0.08 * abs(sin(phi)),
        speed=0.95 * even,
    )
    omega = machine.motions([0.0])[0]
    torques = torque(omega, 0.0)
    sizing = flywheel.size(flywheel.load(yoke(motor_torque=1.5, motor_rms=1.0)), simulate=False)
    assert (sizing.flywheel.exact, sizing.flywheel.needed, sizing.binding) == (0.0, False, None)
    assert sizing.limits["motor_torque"].reached == pytest.approx(np.abs(torques).max() / rated, rel=1e-3)
    assert sizing.limits["motor_rms"].reached == pytest.approx(np.sqrt(mean(torques**2, omega)[0]) / rated, rel=1e-2)


def test_a_duty_whose_first_phase_idles_is_that_of_any_order():
    phases = [{"name": "idle", "duration": "10 s", "loads": 0}, {"name": "full", "duration": "10 s"}]
    press = {
        "inertia": [{"on": "crank", "value": 0.0003}],
        "load": [{"on": "crank", "torque": -20, "from": 0, "to": "120 deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 150},
        "flywheel": {"irregularity": 0.1},
    }
    there, back = (flywheel.size(flywheel.load(press | {"duty": way}), simulate=False) for way in (phases, phases[::-1]))
    work = 20 * (2 * pi / 3) * (2 / 3)  # of the window, less what the drive gives within it
    assert there.flywheel.exact == back.flywheel.exact == pytest.approx(work / (0.1 * 150**2) - 0.0003, rel=1e-9)
    assert (there.duty.governing, back.duty.governing) == ("full", "full")


@pytest.mark.slow
def test_heat_over_a_duty_that_is_kept_without_a_flywheel_or_with_the_least():
    phases = [{"name": "full", "duration": "40 s"}, {"name": "half", "duration": "20 s", "loads": 0.5}]

    def sized(heat):
        scene = swinging(limits={"irregularity": 0.1, "motor_heat": heat}) | {"duty": phases}
        del scene["drive"]["motor"]["inductance"]
        return flywheel.size(flywheel.load(scene), simulate=False)

    true = 0.0
    for time, load in ((40.0, 1.0), (20.0, 0.5)):
        omega = by_hand(load, inductance=0.0).motions(4 * SCAN)[0]
        true = true + time / 60.0 * mean(at_once(6 * omega) ** 2, omega) / LIGHT_AMPS**2
    loose = sized(1.01 * true[0])
    assert (loose.flywheel.exact, loose.flywheel.needed, loose.binding) == (0.0, False, None)
    assert loose.limits["motor_heat"].reached == pytest.approx(true[0], rel=1e-4)
    request = 0.5 * (true.min() + true.max())
    assert (kept(sized(request), SCAN) == (true <= request))[np.abs(true / request - 1.0) > 1e-4].all()


def test_the_error_of_a_least_flywheel_covers_lighter_ones_of_which_nothing_is_known():
    """From 0.5 kg m² down no motion is known: the least flywheel may be any of those."""

    def at(inertia: float, error: float) -> FlywheelPoint:
        if inertia < 0.5:
            return FlywheelPoint(inertia, Existence.UNKNOWN)
        return FlywheelPoint(inertia, Existence.MOTION, (None,), {"irregularity": Share(0.1 / inertia, 1e-9)})

    unknown, kept = limits.answered(Search({"irregularity": 0.3}, 1e-3, 1e3, 1e-6).spans("irregularity"), at)
    assert (unknown.state, kept.state) == (LimitState.UNKNOWN, LimitState.KEPT)
    assert kept.first == pytest.approx(0.5, rel=0.2)
    assert kept.error == 1.0


def requests(search: Search, *, alone: bool, figures) -> tuple[float, int]:
    """The least flywheel that keeps the limits of a search, and the number of flywheels requested for it."""
    requested = []

    def at(inertia: float, error: float) -> FlywheelPoint:
        requested.append(inertia)
        shares = {name: Share(figure(inertia), 1e-12) for name, figure in figures.items()}
        return FlywheelPoint(inertia, Existence.MOTION, (None,), shares)

    return limits.answered(limits.first_kept(search, 1.0, alone=alone), at)[1], len(requested)


def test_the_range_of_one_limit_is_not_looked_for_where_another_is_broken():
    figures = {"irregularity": lambda j: 1.0 / (1.0 + j), "motor_heat": lambda j: 1.0 / (1.0 + 0.1 * j)}
    both = {"irregularity": 0.1, "motor_heat": 0.1}  # from 9 and from 90 kg m² on
    (inertia, every), (same, fewer) = (
        requests(Search(both, 0.5, 1e3, 1e-9), alone=alone, figures=figures) for alone in (True, False)
    )
    assert inertia == pytest.approx(90.0, rel=1e-8)
    assert same == pytest.approx(inertia, rel=1e-8)
    assert fewer < every - 3


def test_a_limit_that_is_kept_between_two_flywheels_that_break_it_is_not_overlooked():
    """The heat dips below its limit between two flywheels of the grid, where the irregularity comes to be kept."""

    def heat(j: float) -> float:
        return (1.0 - 1.2 * np.exp(-((np.log((j + 1e-9) / 18.0) / 0.15) ** 2) / 2.0)) / (1.0 + j / 200.0)

    figures, both = {"irregularity": lambda j: 1.9 / (1.0 + j), "motor_heat": heat}, {"irregularity": 0.1, "motor_heat": 0.5}
    least = [requests(Search(both, 0.5, 1e4, 1e-9), alone=alone, figures=figures)[0] for alone in (True, False)]
    assert least == pytest.approx([18.0, 18.0], rel=1e-8)


PRESS = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": "80 mm"},
        "rod": {"length": "480 mm"},
        "slider": {"mass": "420 kg"},
    },
    "shafts": {"motor": {"ratio": 5}},
    "load": [{"on": "slider", "force": "-400 kN", "from": "340 deg", "to": "360 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "60 rpm"},
}


def sized_built(**wheel: object) -> Sizing:
    return flywheel.size(flywheel.load({**PRESS, "flywheel": {"irregularity": 0.15, **wheel}}), simulate=False)


def test_a_wheel_carries_the_exact_inertia_and_keeps_the_irregularity():
    result = sized_built(shape="disc", material="carbon steel", outer_radius="0.6 m")
    assert result.built is not None
    assert result.built.wheel.inertia == pytest.approx(result.flywheel.exact, rel=1e-12)
    assert result.built.irregularity == pytest.approx(0.15, rel=1e-10)
    assert result.built.wheel.speed == pytest.approx(2 * np.pi * 1.075, rel=1e-12)
    assert result.built.torque is None


def test_a_wheel_rounded_up_gives_the_irregularity_of_its_own_inertia():
    result = sized_built(shape="disc", material="carbon steel", outer_radius="0.6 m", step="50 kg m^2")
    assert result.built is not None
    assert result.flywheel.exact is not None
    inertia = 50 * np.ceil(result.flywheel.exact / 50)
    assert result.built.wheel.inertia == pytest.approx(inertia)
    given = flywheel.load({**PRESS, "flywheel": {"inertia": inertia}})
    again = flywheel.size(given, simulate=False).simulation
    assert again is not None
    assert result.built.irregularity == pytest.approx(again.irregularity, rel=1e-10)


def test_the_wheel_turns_with_its_own_shaft():
    disc = {"shape": "disc", "material": "carbon steel", "outer_radius": "0.3 m"}
    slow, fast = sized_built(**disc), sized_built(on="motor", **disc)
    assert slow.built is not None
    assert fast.built is not None
    assert fast.built.wheel.speed == pytest.approx(5 * slow.built.wheel.speed)
    assert fast.built.wheel.mass == pytest.approx(slow.built.wheel.mass / 25)


def test_arms_pass_on_what_accelerates_the_wheel():
    request = {"shape": "arms", "material": "carbon steel", "outer_radius": "0.9 m", "bore": "80 mm"}
    result = sized_built(**request)
    assert result.built is not None
    assert result.run is not None
    assert result.machine is not None
    assert result.cycle is not None
    phi = np.linspace(np.radians(340.0) + 1e-9, 2 * np.pi - 1e-9, 2001)
    omega = turning_moment.speed_over_cycle(result.cycle, result.speed, result.run, phi)
    state = flywheel.reduce(result.machine, phi)
    alpha = (state.moment - 0.5 * state.slope * omega**2) / (state.inertia + result.run.inertia)
    torque = result.flywheel.exact * float(np.abs(alpha).max())
    given = sized_built(**request, torque=torque)
    assert given.built is not None
    assert result.built.torque == pytest.approx(torque, rel=1e-5)
    assert given.built.torque == torque
    assert "N m, inertia times the greatest acceleration" in report.text(result)
    assert "greatest acceleration" not in report.text(given)
    place = "arms at the hub"
    assert result.built.wheel.stresses[place] == pytest.approx(given.built.wheel.stresses[place], rel=1e-5)


def test_a_machine_that_sets_its_own_speed_is_solved_again_with_the_wheel_as_built():
    wheel = {"shape": "disc", "material": "grey cast iron", "outer_radius": "0.4 m", "step": "1 kg m^2"}
    result = flywheel.size(flywheel.load({**regimes.SECTION_C, "flywheel": {"irregularity": 0.1, **wheel}}), simulate=False)
    given = flywheel.size(flywheel.load({**regimes.SECTION_C, "flywheel": {"inertia": 6.0}}), simulate=False)
    assert result.built is not None
    assert given.simulation is not None
    assert result.built.wheel.inertia == pytest.approx(6.0)
    assert result.built.irregularity == pytest.approx(given.simulation.irregularity, rel=1e-9)


def test_no_wheel_where_no_flywheel_is_needed():
    scene = {"drive": {"torque": 5}, "load": [{"on": "crank", "torque": -5}], "regime": {"speed": 10}}
    request = {"irregularity": 0.1, "shape": "disc", "material": "carbon steel", "outer_radius": "0.4 m"}
    result = flywheel.size(flywheel.load({**scene, "flywheel": request}), simulate=False)
    assert result.built is None
    assert any("no wheel" in message for message in result.messages)


def test_a_wheel_for_a_diagram_of_areas():
    request = {"irregularity": 0.02, "shape": "rim", "material": "grey cast iron", "outer_radius": "0.5 m"}
    scene = {"areas": {"values": [30, -50, 20], "scale": "100 J"}, "regime": {"speed": "300 rpm"}, "flywheel": request}
    result = flywheel.size(flywheel.load(scene))
    assert result.built is not None
    assert result.built.wheel.inertia == pytest.approx(result.flywheel.exact, rel=1e-9)
    assert result.built.irregularity == pytest.approx(0.02, rel=1e-9)


# The flywheel of a sizing on every shaft, with its wheel made wider.


SHAFTS = {"slow": {"ratio": 0.5}, "fast": {"ratio": 4, "efficiency": 0.9}}


@cache
def sized_on_shafts(**given):
    wheel = {"on": "fast", "irregularity": 0.04, **given}
    return flywheel.size(flywheel.load(scenes.yoke(shafts=SHAFTS, flywheel=wheel)), simulate=False)


def test_every_shaft_s_flywheel_stores_the_same_energy():
    sizing = sized_on_shafts()
    rows = {row.shaft: row for row in sizing.shafts}
    assert list(rows) == ["crank", "slow", "fast"]
    assert rows["fast"].inertia == sizing.flywheel.exact
    for row in rows.values():
        assert row.energy == pytest.approx(rows["fast"].energy, rel=1e-14)
        assert row.gd2 == 4 * row.inertia
        assert row.mass is None


@pytest.mark.parametrize("shape", ["disc", "rim"])
def test_a_wheel_made_wider_has_the_inertia_of_its_shaft(shape):
    sizing = sized_on_shafts(shape=shape, material="carbon steel", outer_radius="0.5 m")
    wheel = sizing.built.wheel
    for row in sizing.shafts:
        body = wheel.body
        wider = body._replace(width=body.width * row.inertia / wheel.inertia)
        (part,) = parts(wider, wheel.material.density)
        assert part.inertia == pytest.approx(row.inertia, rel=1e-12)
        assert part.mass == pytest.approx(row.mass, rel=1e-12)
        assert row.radius == 0.5
        assert row.rim_speed == pytest.approx(0.5 * row.ratio * sizing.run.speed_max, rel=1e-12)


def test_the_report_says_what_the_table_holds_for():
    plain = report.text(sized_on_shafts())
    assert "The same flywheel on every shaft" in plain
    assert "losses in meshes" in plain
    assert "made wider" not in plain
    assert "made wider or narrower" in report.text(
        sized_on_shafts(shape="disc", material="carbon steel", outer_radius="0.5 m")
    )
    alone = flywheel.size(flywheel.load(scenes.yoke()), simulate=False)
    assert "every shaft" not in report.text(alone)


def test_a_wheel_that_is_rounded_up_is_compared_as_it_is_built():
    sizing = sized_on_shafts(shape="disc", material="carbon steel", outer_radius="0.5 m", step="5 kg m^2")
    wheel = sizing.built.wheel
    rows = {row.shaft: row for row in sizing.shafts}
    assert wheel.inertia == pytest.approx(25.0)
    assert wheel.inertia > 1.1 * sizing.flywheel.exact
    assert (rows["fast"].inertia, rows["fast"].mass) == (wheel.inertia, pytest.approx(wheel.mass, rel=1e-14))
    assert rows["crank"].gd2 == pytest.approx(4 * 16 * 25.0)
    text = " ".join(report.text(sizing).split())
    assert "Rounded up: it has 25 kg m² for 22." in text
    assert "all other figures are those of the exact inertia" in text
    assert "Rounded up" not in report.text(sized_on_shafts(shape="disc", material="carbon steel", outer_radius="0.5 m"))


def test_gd2_stands_beside_the_inertias():
    text = report.text(flywheel.size(flywheel.load(scenes.yoke()), simulate=False))
    assert "GD² = 4 J: 1414.09 exact, 1395.96 by the areas, 1416.91 by the torque, kg m²." in text
    given = report.text(flywheel.size(flywheel.load(scenes.yoke(flywheel={"inertia": 300})), simulate=False))
    assert any(line.split()[-3:] == ["1200", "kg", "m²"] for line in given.splitlines() if "GD²" in line)


def edged(last: float):
    """A search over flywheels whose irregularity falls like 1/J, with motions from 0.9 kg m² up to the last one only."""
    search = Search({"irregularity": 0.1}, 0.75, 52.0, 1e-9)

    def at(inertia, _error):
        stands = 0.9 <= inertia <= last
        share = {"irregularity": Share(0.1 / inertia, 1e-9)}
        return FlywheelPoint(inertia, Existence.MOTION, (None,), share) if stands else FlywheelPoint(inertia, Existence.NONE)

    return search, at


def test_the_error_of_an_inertia_takes_its_slope_from_a_lighter_flywheel_where_no_heavier_one_turns():
    search, at = edged(1.0)
    here = limits.answered(search.closely(1.0), at)
    assert limits.answered(search.slope("irregularity", here), at) == pytest.approx(0.1, rel=2e-3)


def test_an_inertia_beside_which_no_flywheel_turns_has_no_known_error():
    """Its figure's slope is unknown: a steep one would leave the inertia no error, a flat one any."""
    search, at = edged(0.9)
    here = limits.answered(search.closely(0.9), at)
    assert limits.answered(search.slope("irregularity", here), at) == np.inf
    assert limits.answered(search._error("irregularity", 0.1, here), at) == np.inf
