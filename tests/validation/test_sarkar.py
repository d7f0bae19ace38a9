"""Sarkar, Theory of Machines: areas of a diagram, and presses with a given flywheel."""

from __future__ import annotations

from math import pi, radians, sqrt

import pytest

from flywheel.components import press_work

from .common import agree, inputs, mean_and_eps, of_areas, press

RPM = pi / 30


def test_6_4_areas_in_square_centimetres() -> None:
    case = inputs("sarkar-6.4")
    scale = case["scale_Nm_per_cm"] * radians(case["scale_deg_per_cm"])
    result = of_areas(case["areas_cm2"], scale, f"{case['N_rpm']} rpm", irregularity=case["Cs"])
    agree("sarkar-6.4", m_kg=result["flywheel"]["exact"] / case["k_m"] ** 2, dE_J=result["energy_fluctuation"])


def test_6_7_press_with_a_given_flywheel() -> None:
    case = inputs("sarkar-6.7")
    mean, eps = mean_and_eps(case)
    inertia = case["m_kg"] * case["k_m"] ** 2
    busy = 1 - case["t_recharge_s"] / case["cycle_s"]
    swing = inertia * eps * (mean * RPM) ** 2
    result = press(swing / (1 - busy), busy, case["cycle_s"], mean, inertia=inertia)
    ratio = mean * case["cycle_s"] / 60
    assert result["simulation"]["speed_max"] * ratio / RPM == pytest.approx(case["N1_rpm"], rel=1e-9)
    assert result["simulation"]["speed_min"] * ratio / RPM == pytest.approx(case["N2_rpm"], rel=1e-9)
    agree("sarkar-6.7", E_J=result["power"] * case["cycle_s"])
    agree("sarkar-6.7", P_kW=result["power"] / 1000)


def test_6_9_strokes_per_hour_and_drop_of_speed() -> None:
    case = inputs("sarkar-6.9")
    cycle = case["E_J"] / case["P_W"]
    spent = case["E_J"] - case["P_W"] * case["t_s"]
    lowest = sqrt((case["N1_rpm"] * RPM) ** 2 - 2 * spent / case["I"]) / RPM
    mean = (case["N1_rpm"] + lowest) / 2
    result = press(case["E_J"], case["t_s"] / cycle, cycle, mean, inertia=case["I"])
    motion, ratio = result["simulation"], mean * cycle / 60
    agree("sarkar-6.9", drop_rpm=(motion["speed_max"] - motion["speed_min"]) * ratio / RPM, rtol=1e-8)
    agree("sarkar-6.9", n_per_h=result["speed"] / (2 * pi) * 3600)
    assert motion["speed_max"] * ratio / RPM == pytest.approx(case["N1_rpm"], rel=1e-9)


def test_6_7_and_6_9_by_formula() -> None:
    case = inputs("sarkar-6.7")
    given = press_work.energy_given(case["m_kg"] * case["k_m"] ** 2, case["N1_rpm"] * RPM, case["N2_rpm"] * RPM)
    press = press_work.press_of(given, case["cycle_s"], case["cycle_s"] - case["t_recharge_s"])
    agree("sarkar-6.7", P_kW=press.power / 1000, E_J=press.energy)
    case = inputs("sarkar-6.9")
    press = press_work.press_at(case["E_J"], case["P_W"], case["t_s"])
    low = press_work.speed_after(case["I"], case["N1_rpm"] * RPM, press.given)
    agree("sarkar-6.9", n_per_h=3600 * press.rate, drop_rpm=case["N1_rpm"] - low / RPM)
