"""Shigley's Mechanical Engineering Design: a table of engine torque, and a press between two speeds."""

from __future__ import annotations

from math import pi

import pytest

from flywheel.components.press_work import Speeds, energy_given, inertia_for

from .common import CASES, LBF_IN, agree, inputs, of_swing, sized


def test_16_6_engine_torque_table() -> None:
    case = inputs("shigley-16.6")
    torque = [*case["torque_lbf_in"], case["torque_lbf_in"][0]]
    angle = [case["theta_step_deg"] * i for i in range(len(torque))]
    table = {"angle": angle, "value": torque, "angle_unit": "deg", "value_unit": "lbf in"}
    result = sized(
        {
            "load": [{"on": "crank", "table": table}],
            "drive": {"torque": "balance"},
            "regime": {"speed": case["omega"], "cycle": "720 deg"},
            "flywheel": {"irregularity": case["Cs"]},
        }
    )
    mean = -result["balance"]["value"] / LBF_IN
    agree("shigley-16.6", Tm_lbf_in=mean, work_lbf_in=mean * 4 * pi)
    swing, inertia = result["energy_fluctuation"] / LBF_IN, result["flywheel"]["exact"] / LBF_IN
    agree("shigley-16.6", dU_crossings_resolved=swing, I_crossings_resolved=inertia)
    assert swing == pytest.approx(CASES["shigley-16.6"]["printed"]["dU_lbf_in"], rel=0.016)


def test_16_press_between_two_speeds() -> None:
    case, true = inputs("shigley-16-press"), CASES["shigley-16-press"]["computed"]
    inertia = f"{case['I_lbf_s2_in']} lbf in s^2"
    result = of_swing(true["dE_exact"] * LBF_IN, true["omega_mean"], inertia=inertia)
    motion = result["simulation"]
    agree("shigley-16-press", Cs=motion["irregularity"], omega_mean=result["speed"])
    assert motion["speed_max"] == pytest.approx(case["omega_max"], rel=1e-9)
    assert motion["speed_min"] == pytest.approx(case["omega_min"], rel=1e-9)


def test_16_press_by_formula() -> None:
    case = inputs("shigley-16-press")
    speeds, inertia = Speeds(case["omega_max"], case["omega_min"]), case["I_lbf_s2_in"]
    agree("shigley-16-press", omega_mean=speeds.mean, Cs=speeds.irregularity)
    agree("shigley-16-press", E1=energy_given(inertia, speeds.low, 0.0), E2=energy_given(inertia, speeds.high, 0.0))
    given = energy_given(inertia, *speeds)
    agree("shigley-16-press", dE_exact=given)
    assert inertia_for(given, speeds.mean, speeds.irregularity) == pytest.approx(inertia, rel=1e-12)
