"""Bevan, The Theory of Machines: problems in feet, pounds and inches."""

from __future__ import annotations

from math import pi, radians

import flywheel
from flywheel.components.gear_trains import Shaft, Stage, geared_acceleration, with_rope

from .common import BOOK_GRAVITY, CASES, agree, inputs, of_areas


def test_2_10_geared_drum() -> None:
    case = inputs("bevan-2.10")
    mass, radius = case["m_lb"], case["r_in"]
    weight = mass * 32.2 * radius / 12  # lb ft²/s²
    scene = {
        "shafts": {"motor": {"ratio": case["G"]}},
        "inertia": [
            {"on": "crank", "value": f"{case['Ia_lbft2'] + mass * (radius / 12) ** 2!r} lb ft^2"},
            {"on": "motor", "value": f"{case['Ib_lbft2']} lb ft^2"},
        ],
        "load": [{"on": "crank", "torque": f"{weight / 32.2 * BOOK_GRAVITY!r} lbf ft"}],
        "regime": {"speed": 1},
        "flywheel": {"inertia": 1},
    }
    state = flywheel.reduce(flywheel.load(scene), [0.0])
    agree("bevan-2.10", a_ft_s2=float(state.moment[0] / state.inertia[0]) * radius / 12)


def test_2_10_geared_drum_with_losses() -> None:
    case = inputs("bevan-2.10")  # in lb and ft: forces then are poundals
    drum = with_rope(Shaft(case["Ia_lbft2"]), case["m_lb"], case["r_in"] / 12, case["m_lb"] * 32.2)
    for key, efficiency in (("a_ft_s2", 1.0), ("a_eta", case["eta"])):
        stages = [Stage("drum", "rotor", case["G"], efficiency)]
        running = geared_acceleration({"drum": drum, "rotor": Shaft(case["Ib_lbft2"])}, stages)
        agree("bevan-2.10", **{key: running.accelerations["drum"] * case["r_in"] / 12})


def test_12_3_crank_torque() -> None:
    case = inputs("bevan-12.3")
    bore, rod = pi * case["D_in"] ** 2 / 4, pi * case["d_rod_in"] ** 2 / 4
    force = case["p1_psi"] * bore - case["p2_psi"] * (bore - rod)
    kind = {
        "type": "slider-crank",
        "crank": {"length": f"{case['stroke_in'] / 2} in"},
        "rod": {"length": f"{case['l_in']} in"},
        "slider": {},
    }
    load = {"on": "slider", "force": f"{-force!r} lbf"}
    scene = {"mechanism": kind, "load": [load], "regime": {"speed": 1}, "flywheel": {"inertia": 1}}
    moment = float(flywheel.reduce(flywheel.load(scene), [radians(case["theta_deg"])]).moment[0])
    exact = moment / (0.45359237 * 9.80665 * 0.3048)
    agree("bevan-12.3", T_exact_lbft=exact)
    assert abs(exact / CASES["bevan-12.3"]["printed"]["T_lbft"] - 1) < 2e-3


def test_12_8_weight_of_a_flywheel() -> None:
    case = inputs("bevan-12.8")
    speed = f"{case['N_rpm']} rpm"
    result = of_areas([case["dE_ftlb"], -case["dE_ftlb"]], "1 lbf ft", speed, irregularity=case["Cs"])
    pounds = result["flywheel"]["exact"] / (case["k_ft"] * 0.3048) ** 2 / 0.45359237
    agree("bevan-12.8", W_ton=pounds * BOOK_GRAVITY / 2240)


def test_12_9_two_given_flywheels() -> None:
    case = inputs("bevan-12.9")
    swing = case["ke"] * case["ihp"] * 33000 / case["N_rpm"]
    inertia = f"{case['W_lb'] * case['k_ft'] ** 2!r} lb ft^2"
    result = of_areas([swing, -swing], "1 lbf ft", f"{case['N_rpm']} rpm", inertia=inertia)
    agree("bevan-12.9", Cs_percent=100 * result["simulation"]["irregularity"] * BOOK_GRAVITY)
