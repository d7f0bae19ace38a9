"""Flywheels sized for limits: each found again by shooting on equations written here, the one that binds, and refusals."""

from math import pi, radians, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flywheel
from flywheel import SceneError
from flywheel.sizing import limits

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
        def found(phi: float, y: Any) -> list[float]:
            w = sqrt(y[0])
            drive, amps = torque(w), current(w)
            return [2 * (RATIO * drive - load) / (inertia + OWN), 1 / w, drive**2 / w, amps**2 / w]

        return found

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
        assert true_shares(limit.alone)[name] == pytest.approx(limit.asked, rel=2e-9), name
        assert 0.0 < limit.alone_error < 1e-9
    assert sizing.flywheel.exact == max(limit.alone for limit in sizing.limits.values())
    assert sizing.binding == "current_pulsation"
    true = true_shares(sizing.flywheel.exact)
    for name, limit in sizing.limits.items():
        assert limit.reached == pytest.approx(true[name], rel=2e-9)
        assert limit.reached <= limit.asked * (1 + 1e-9)
    assert sizing.reached
    data = sizing.as_dict()
    assert data["flywheel"]["binding"] == "current_pulsation"
    assert data["flywheel"]["limits"]["motor_heat"]["alone"] == sizing.limits["motor_heat"].alone
    assert set(data["error"]["limits"]) == set(LIMITS)
    assert sizing.energy is not None
    assert sizing.energy.copper_heat_share == pytest.approx(sizing.limits["motor_heat"].reached, rel=1e-9)


@pytest.mark.slow
def test_a_loose_accuracy_keeps_its_word():
    scene, tight = punch({"motor_torque": 1.6}), sized({"motor_torque": 1.6}).flywheel.exact
    for rtol in (1e-3, 1e-6):
        sizing = flywheel.size(flywheel.load(scene), rtol, simulate=False)
        assert abs(sizing.flywheel.exact / tight - 1) <= sizing.error.exact <= rtol


@pytest.mark.slow
def test_a_current_with_a_state_of_its_own_and_its_confirmation_in_time():
    sizing = sized({"irregularity": 0.1, "current_pulsation": 1.0}, inductance=0.05, simulate=True)
    assert sizing.binding == "current_pulsation"
    assert sizing.limits["current_pulsation"].alone < sized({"current_pulsation": 1.0}).flywheel.exact
    for limit in sizing.limits.values():
        assert limit.simulated == pytest.approx(limit.reached, rel=1e-9)


def test_the_irregularity_alone_is_the_sizing_for_it():
    plain = punch({}) | {"flywheel": {"irregularity": 0.1}}
    asked, sizing = flywheel.size(flywheel.load(plain), simulate=False), sized({"irregularity": 0.1})
    assert sizing.flywheel == asked.flywheel
    assert (sizing.binding, sizing.limits["irregularity"].alone) == ("irregularity", asked.flywheel.exact)
    assert asked.as_dict()["flywheel"]["limits"] is None
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
    def hump(_machine: Any, motion: Any, rtol: float) -> dict[str, limits.Share]:
        total = motion.inertia + 1.0
        value = 0.5 + 5 / total + 0.4 * float(np.exp(-((np.log(total / 160) / 0.4) ** 2)))
        return {"motor_rms": limits.Share(value, 0.01 * rtol)}

    monkeypatch.setattr(limits, "shares_along", hump)
    sizing = sized({"motor_rms": 0.75})
    assert sizing.flywheel.exact == pytest.approx(19.0, rel=1e-9)
    assert any("motor_rms is not kept by heavier flywheels of" in message for message in sizing.messages)


def test_limits_that_no_flywheel_reaches_are_told_with_the_best():
    with pytest.raises(SceneError) as caught:
        sized({"motor_rms": 0.3, "motor_torque": 0.3, "irregularity": 0.1})
    mean = 100 * LOAD * (END - START) / (2 * pi * RATIO) / RATED  # at a constant speed the motor gives the mean torque
    assert [fault.path for fault in caught.value.faults] == ["flywheel.limits.motor_torque", "flywheel.limits.motor_rms"]
    assert all(f"at a constant speed, it is {mean:.6g} %" in fault.found for fault in caught.value.faults)
    assert sized({"motor_rms": mean / 100 + 1e-5}).limits["motor_rms"].reached == pytest.approx(mean / 100 + 1e-5)


def test_a_pulsation_of_the_current_of_the_load_alone_is_told():
    plate = {"type": "induction", "power": POWER, "speed": "1420 rpm", "poles": 4, "frequency": 50, "breakdown_ratio": 2.6}
    scene = punch({"current_pulsation": 1.0})
    told = {}
    for name, more in (("alone", {}), ("whole", {"voltage": 400, "current": 16, "power_factor": 0.82})):
        scene["drive"] = {"on": "motor", "motor": plate | more}
        told[name] = " ".join(flywheel.size(flywheel.load(scene), simulate=False).messages)
    assert "give power_factor or no_load_current" in told["alone"]
    assert "power_factor" not in told["whole"]


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
    ("limits", "motor", "told"),
    [
        ({}, {}, "flywheel.limits: found no limit"),
        ({"motor_heat": 110}, {}, 'write "110 %"'),
        ({"motor_hat": 1}, {}, 'did you mean "motor_heat"?'),
        ({"motor_heat": 1}, {"type": "engine"}, "which does not tell what heats it"),
        ({"current_pulsation": 0.4}, {"type": "engine"}, "whose current is not known"),
        ({"motor_rms": 1}, {"type": "constant"}, "without a rated point"),
        ({"motor_rms": 1}, None, "motor_rms without a motor"),
    ],
)
def test_limits_that_cannot_be_are_told_in_a_line(limits, motor, told):
    scene = punch(limits)
    if motor is None:
        scene["drive"], scene["regime"] = {"torque": "balance"}, {"speed": 10}
    elif motor:
        others = {"engine": {"speed": SPEED, "torque": RATED, "droop": 0.08}, "constant": {"torque": RATED}}
        scene["drive"] = {"on": "motor", "motor": motor | others[motor["type"]]}
    with pytest.raises(SceneError) as caught:
        flywheel.load(scene)
    assert told in str(caught.value)


def test_limits_stand_beside_no_irregularity_and_no_inertia():
    with pytest.raises(SceneError, match="exactly one of irregularity, inertia, gd2, limits"):
        flywheel.load(punch(LIMITS) | {"flywheel": {"limits": LIMITS, "irregularity": 0.1}})


@pytest.mark.slow
def test_a_sweep_takes_limits_one_by_one():
    found = flywheel.sweep(flywheel.load(punch({"motor_torque": 1.6})), {"flywheel.limits.motor_torque": [1.4, 1.8]})
    assert found["exact"].tolist() == [sized({"motor_torque": share}).flywheel.exact for share in (1.4, 1.8)]
