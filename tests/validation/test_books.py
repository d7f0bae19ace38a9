"""Worked examples of textbooks."""

from __future__ import annotations

import json
from math import cos, pi, radians, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import flywheel
from flywheel.components import press_work
from flywheel.components.gear_trains import Shaft, Stage, geared_acceleration, geared_torque, with_rope
from flywheel.components.press_work import Speeds, energy_given, inertia_for
from flywheel.motions.stroke_course import slip_heat
from flywheel.motions.strokes import Strokes

# The published data, and the few shapes of scene that most of the problems come down to.


CASES: dict[str, dict[str, Any]] = {
    case["id"]: case for case in json.loads((Path(__file__).parent / "cases.json").read_text(encoding="utf-8"))
}
BOOK_GRAVITY = 32.2 / (9.80665 / 0.3048)  # of books that take g = 32.2 ft/s²
LBF_IN = 0.45359237 * 9.80665 * 0.0254  # J
G = 9.81  # m/s², as the metric books take it


def inputs(name: str) -> dict[str, Any]:
    """The data of a case."""
    data: dict[str, Any] = CASES[name]["inputs"]
    return data


def agree(name: str, rtol: float = 1e-9, **figures: float) -> None:
    """Figures are the true ones of a case, and the printed ones as far as its source rounds them."""
    case = CASES[name]
    for key, value in figures.items():
        assert value == pytest.approx(case["computed"][key], rel=rtol), key
        if key in case["printed"] and key not in case.get("not_met", ()):
            assert value == pytest.approx(case["printed"][key], rel=case["printed_rtol"]), f"printed {key}"


def sized(scene: dict[str, Any]) -> dict[str, Any]:
    """The figures of a scene, without time stepping."""
    return flywheel.size(flywheel.load(scene), simulate=False).as_dict()


def of_areas(works: list[float], scale: str | float, speed: str | float, **wheel: Any) -> dict[str, Any]:
    """The figures of areas between crossings."""
    return sized({"areas": {"values": works, "scale": scale}, "regime": {"speed": speed}, "flywheel": wheel})


def of_swing(swing: float, speed: str | float, **wheel: Any) -> dict[str, Any]:
    """The figures of a known swing of energy (J)."""
    return of_areas([swing, -swing], 1, speed, **wheel)


def four_stroke(works: list[float], speed: str, **wheel: Any) -> dict[str, Any]:
    """The figures of an engine with a triangular moment on each of four strokes, against a constant load; works in J."""
    peaks = [2 * work / pi for work in works]
    values = [value for peak in peaks for value in (0.0, peak)] + [0.0]
    table = {"angle": [90 * i for i in range(9)], "angle_unit": "deg", "value": values}
    regime = {"speed": speed, "cycle": "720 deg"}
    load = [{"on": "crank", "table": table}]
    return sized({"load": load, "drive": {"torque": "balance"}, "regime": regime, "flywheel": wheel})


def press(energy: float, busy: float, cycle: float, mean_rpm: float, **wheel: Any) -> dict[str, Any]:
    """The figures of a press that spends `energy` (J) evenly over the share `busy` of each `cycle` (s).

    The crank turns once per operation; the flywheel's shaft is as much faster as its mean speed asks.
    """
    ratio = mean_rpm * cycle / 60
    load = {"on": "crank", "torque": -energy / (2 * pi * busy), "from": 0, "to": f"{360 * busy!r} deg"}
    return sized(
        {
            "shafts": {"wheel": {"ratio": ratio}},
            "load": [load],
            "drive": {"on": "wheel", "torque": "balance"},
            "regime": {"on": "wheel", "speed": f"{mean_rpm!r} rpm"},
            "flywheel": {"on": "wheel", **wheel},
        }
    )


def mean_and_eps(case: dict[str, Any]) -> tuple[float, float]:
    """The mean of two extreme speeds (rpm) of a case, and the irregularity."""
    high, low = max(case["N1_rpm"], case["N2_rpm"]), min(case["N1_rpm"], case["N2_rpm"])
    return (high + low) / 2, 2 * (high - low) / (high + low)


# Khurmi and Gupta, Theory of Machines: kinematics (5), dynamics (3), engines (15), flywheels (16).


RPM = pi / 30
AT_REST: dict[str, Any] = {"regime": {"speed": 1}, "flywheel": {"inertia": 1}}


def quick_return(crank: float, frame: float, port: str) -> float:
    """Ratio of the crank angles of the two strokes of a port, from the zeros of its influence coefficient."""
    kind = {"type": "crank-shaper", "crank": {"length": crank}, "frame": {"length": frame}}
    kind |= {"rocker": {"length": 1, "inertia": 1}, "ram": {"mass": 1}}  # a port without mass or load is left out
    machine = flywheel.Machine(flywheel.load({"mechanism": kind, **AT_REST}))

    def gain(phi: float) -> float:
        return float(flywheel.reduce(machine, [phi]).gains[f"crank-shaper.{port}"][0])

    forward = brentq(gain, 0, pi, xtol=1e-14) + 2 * pi - brentq(gain, pi, 2 * pi, xtol=1e-14)
    return float(forward / (2 * pi - forward))


def test_5_1_slotted_lever() -> None:
    case = inputs("khurmi-5.1")
    agree("khurmi-5.1", ratio=quick_return(case["crank_mm"] / 1000, case["centre_distance_mm"] / 1000, "rocker"))


def test_5_4_whitworth() -> None:
    case = inputs("khurmi-5.4")
    agree("khurmi-5.4", ratio=quick_return(case["CA_mm"] / 1000, case["CD_mm"] / 1000, "ram"))


def test_3_13_geared_drum() -> None:
    case = inputs("khurmi-3.13")
    weight = case["M_kg"] * G * case["r_m"]
    scene = {
        "shafts": {"motor": {"ratio": case["G"]}},
        "inertia": [
            {"on": "crank", "value": case["IA"] + case["M_kg"] * case["r_m"] ** 2},
            {"on": "motor", "value": case["IB"]},
        ],
        "load": [{"on": "crank", "torque": weight}],
        **AT_REST,
    }
    state = flywheel.reduce(flywheel.load(scene), [0.0])
    agree("khurmi-3.13", a=float(state.moment[0] / state.inertia[0]) * case["r_m"])


def test_3_13_geared_drum_with_losses() -> None:
    case = inputs("khurmi-3.13")
    drum = with_rope(Shaft(case["IA"]), case["M_kg"], case["r_m"], case["M_kg"] * G)
    for key, efficiency in (("a", 1.0), ("a_eta", case["eta"])):
        stages = [Stage("drum", "rotor", case["G"], efficiency)]
        running = geared_acceleration({"drum": drum, "rotor": Shaft(case["IB"])}, stages)
        agree("khurmi-3.13", **{key: running.accelerations["drum"] * case["r_m"]})


def hoist() -> tuple[dict[str, Any], float, float]:
    """The mine hoist's scene, the inertia of its cages at the motor, and the motor's acceleration."""
    case = inputs("khurmi-3.18")
    mass, friction, radius = case["m_kg"], case["friction_Nm"], case["d_drum_m"] / 2
    k = dict(zip(("motor", "inter", "drum", "pulley"), case["k"], strict=True))
    speed = case["N_rpm"] | {"pulley": case["N_rpm"]["drum"] * case["d_drum_m"] / case["d_pulley_m"]}
    ratio = {name: rpm / speed["motor"] for name, rpm in speed.items()}
    count = {"motor": 1, "inter": 1, "drum": 1, "pulley": 2}
    up, down = case["cages_kg"]
    rope = (up - down) * G + sum(case["friction_N"])
    torques = {"inter": friction["inter"], "drum": friction["drum"] + rope * radius}
    torques["pulley"] = 2 * friction["pulley_each"]
    place = {name: "crank" if name == "motor" else name for name in ratio}
    scene = {
        "shafts": {name: {"ratio": ratio[name]} for name in ("inter", "drum", "pulley")},
        "inertia": [{"on": place[n], "value": count[n] * mass[n] * k[n] ** 2} for n in ratio]
        + [{"on": "drum", "value": (up + down) * radius**2}],
        "load": [{"on": name, "torque": -torque} for name, torque in torques.items()],
        **AT_REST,
    }
    cages = (up + down) * (radius * ratio["drum"]) ** 2
    return scene, cages, case["a"] / (radius * ratio["drum"])


def test_3_18_mine_hoist() -> None:
    scene, cages, acceleration = hoist()
    state = flywheel.reduce(flywheel.load(scene), [0.0])
    inertia = float(state.inertia[0])
    agree("khurmi-3.18", I_eq=inertia - cages, T_Nm=inertia * acceleration - float(state.moment[0]))


def test_3_18_mine_hoist_by_shafts() -> None:
    case = inputs("khurmi-3.18")
    mass, friction, radius = case["m_kg"], case["friction_Nm"], case["d_drum_m"] / 2
    k = dict(zip(("motor", "inter", "drum", "pulley"), case["k"], strict=True))
    shafts = {name: Shaft(mass[name] * k[name] ** 2, 0.0, friction.get(name, 0.0)) for name in ("motor", "inter", "drum")}
    shafts["pulley"] = Shaft(2 * mass["pulley"] * k["pulley"] ** 2, 0.0, 2 * friction["pulley_each"])
    rpm = case["N_rpm"]
    stages = [Stage("motor", "inter", rpm["inter"] / rpm["motor"]), Stage("inter", "drum", rpm["drum"] / rpm["inter"])]
    stages.append(Stage("drum", "pulley", case["d_drum_m"] / case["d_pulley_m"]))
    alpha = case["a"] / radius * rpm["motor"] / rpm["drum"]
    without_cages = geared_torque(shafts, stages, "motor", alpha)
    for cage, sense, drag in zip(case["cages_kg"], (-1, 1), case["friction_N"], strict=True):
        shafts["drum"] = with_rope(shafts["drum"], cage, radius, sense * cage * G - drag)
    agree("khurmi-3.18", I_eq=without_cages.inertia, T_Nm=geared_torque(shafts, stages, "motor", alpha).torque)


def engine(r: float, rod: float, mass: float, force: float, phi: float, **more: Any) -> Any:
    """The state at an angle of a slider-crank whose piston is pushed towards the crank; phi = 0 at the far dead centre."""
    kind = {"type": "slider-crank", "crank": {"length": r}, "rod": {"length": rod}, "slider": {"mass": mass}}
    scene = {"mechanism": kind, "load": [{"on": "slider", "force": -force}], **more, **AT_REST}
    return flywheel.reduce(flywheel.load(scene), [phi])


def turning_moment(state: Any, omega: float) -> float:
    """Moment at the crank at constant speed: M* less the inertia moment ½ dI*/dphi omega²."""
    return float(state.moment[0] - state.slope[0] * omega**2 / 2)


def disc(diameter: float) -> float:
    return pi * diameter**2 / 4


def two_term(r: float, rod: float, phi: float) -> float:
    """The series of the piston's acceleration over omega², cut after two terms."""
    return r * (cos(phi) + cos(2 * phi) * r / rod)


def test_15_5_piston_velocity_and_acceleration() -> None:
    case = inputs("khurmi-15.5")
    phi, omega = radians(case["theta_deg"]), case["N_rpm"] * RPM
    state = engine(case["r_m"], case["l_m"], 1, 0, phi)
    velocity = -float(state.gains["slider-crank.slider"][0]) * omega
    acceleration = -float(state.gain_slopes["slider-crank.slider"][0]) * omega**2
    agree("khurmi-15.5", vP=velocity, aP=acceleration)
    series = two_term(case["r_m"], case["l_m"], phi) * omega**2
    assert series == pytest.approx(CASES["khurmi-15.5"]["computed"]["aP_two_term"], rel=1e-9)
    assert series == pytest.approx(acceleration, rel=5e-4)


def test_15_7_horizontal_engine() -> None:
    case = inputs("khurmi-15.7")
    force = case["dp_Pa"] * disc(case["D_m"])
    state = engine(case["r_m"], case["l_m"], case["mR_kg"], force, radians(case["theta_deg"]))
    moment = turning_moment(state, case["N_rpm"] * RPM) / 1000
    agree("khurmi-15.7", T_exact_accel_kNm=moment)
    assert moment == pytest.approx(CASES["khurmi-15.7"]["printed"]["T_kNm"], rel=2e-4)


def test_15_8_vertical_engine() -> None:
    case = inputs("khurmi-15.8")
    force = case["p1_Pa"] * disc(case["D_m"]) - case["p2_Pa"] * (disc(case["D_m"]) - disc(case["d_rod_m"]))
    weight = {"gravity": {"g": G, "direction": "180 deg"}}
    at = radians(case["theta_deg"])
    state = engine(case["stroke_m"] / 2, case["l_m"], case["mR_kg"], force, at, **weight)
    moment = turning_moment(state, case["N_rpm"] * RPM)
    agree("khurmi-15.8", T_exact_accel_Nm=moment)
    assert moment == pytest.approx(CASES["khurmi-15.8"]["printed"]["T_Nm"], rel=1e-3)


def test_15_12_engine_with_flywheel() -> None:
    case = inputs("khurmi-15.12")
    force = case["p1_Pa"] * disc(case["D_m"]) - case["p2_Pa"] * (disc(case["D_m"]) - disc(case["d_rod_m"]))
    omega = case["N_rpm"] * RPM
    state = engine(case["r_m"], case["l_m"], case["mR_kg"], force, radians(case["theta_deg"]))
    moment = turning_moment(state, omega)
    agree("khurmi-15.12", T_exact_accel_Nm=moment)
    printed = CASES["khurmi-15.12"]["printed"]
    assert moment == pytest.approx(printed["T_Nm"], rel=1e-3)
    alpha = (moment - case["P_load_W"] / omega) / (case["m_fly"] * case["k_fly"] ** 2)
    assert alpha == pytest.approx(printed["alpha"], rel=2e-3)


def test_16_1_extreme_speeds() -> None:
    case = inputs("khurmi-16.1")
    result = of_swing(case["dE_J"], f"{case['N_rpm']} rpm", inertia=case["m_kg"] * case["k_m"] ** 2)
    motion = result["simulation"]
    agree("khurmi-16.1", N1_rpm=motion["speed_max"] / RPM, N2_rpm=motion["speed_min"] / RPM)


def test_16_3_mass_from_coefficient_of_energy() -> None:
    case = inputs("khurmi-16.3")
    swing = case["CE"] * case["P_W"] * 60 / case["N_rpm"]
    result = of_swing(swing, f"{case['N_rpm']} rpm", irregularity=case["Cs"])
    agree("khurmi-16.3", m_kg=result["flywheel"]["exact"] / case["k_m"] ** 2)


def test_16_4_petrol_engine() -> None:
    case = inputs("khurmi-16.4")
    scale = case["scale_torque_Nm_per_mm"] * radians(case["scale_angle_deg_per_mm"])
    inertia = case["m_kg"] * case["k_m"] ** 2
    result = of_areas(case["areas_mm2"], scale, f"{case['N_rpm']} rpm", inertia=inertia)
    swing, top, bottom = (result[k] for k in ("energy_fluctuation", "accumulated_max", "accumulated_min"))
    eps = 100 * result["simulation"]["irregularity"]
    extremes = {"Emax_mm2": top / scale, "Emin_mm2": bottom / scale, "dE_mm2": swing / scale}
    agree("khurmi-16.4", Cs_percent=eps, dE_J=swing, **extremes)


def test_16_5_multi_cylinder() -> None:
    case = inputs("khurmi-16.5")
    scale = case["scale_torque_Nm_per_mm"] * radians(case["scale_angle_deg_per_mm"])
    result = of_areas(case["areas_mm2"], scale, f"{case['N_rpm']} rpm", irregularity=case["Cs"])
    extremes = {"Emax_mm2": result["accumulated_max"] / scale, "Emin_mm2": result["accumulated_min"] / scale}
    mass = result["flywheel"]["exact"] / case["R_m"] ** 2
    agree("khurmi-16.5", m_kg=mass, dE_J=result["energy_fluctuation"], **extremes)


def test_16_7_two_triangles() -> None:
    case = inputs("khurmi-16.7")
    first, second = case["triangle1"], case["triangle2"]
    angle = [*first["base_deg"], *second["base_deg"][1:], first["apex_deg"], second["apex_deg"]]
    table = {"angle": sorted(angle), "value": [0, first["peak_Nm"], 0, second["peak_Nm"], 0], "angle_unit": "deg"}
    result = sized(
        {
            "load": [{"on": "crank", "table": table}],
            "drive": {"torque": "balance"},  # the drive of the scene is the engine's load
            "regime": {"speed": f"{case['N_rpm']} rpm"},
            "flywheel": {"irregularity": case["Cs"]},
        }
    )
    agree(
        "khurmi-16.7",
        CE_percent=-100 * result["coefficient_of_energy"],
        m_kg=result["flywheel"]["exact"] / case["k_m"] ** 2,
        theta_min_deg=np.degrees(result["angle_speed_min"]),
        theta_max_deg=np.degrees(result["angle_speed_max"]),
        dE_J=result["energy_fluctuation"],
    )


def cylinder(name: str, phase: int, table: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """A shaft that turns with the crank, a phase behind, and the torque on it."""
    kind = {"type": "law", "name": name, "phase": f"{phase} deg", "outputs": {"turn": {"theta": "phi"}}}
    return kind, {"on": f"{name}.turn", "table": table}


def test_16_8_three_cylinders() -> None:
    case = inputs("khurmi-16.8")
    angle, value = [0, case["apex_deg"], case["zero_deg"], 360], [0, case["peak_Nm"], 0, 0]
    table = {"angle": angle, "value": value, "angle_unit": "deg"}
    third = 360 // case["n_cyl"]
    pairs = [cylinder(f"cylinder-{i}", -third * i, table) for i in range(case["n_cyl"])]
    inertia = case["m_kg"] * case["k_m"] ** 2
    scene = flywheel.load(
        {
            "mechanism": [kind for kind, _ in pairs],
            "load": [load for _, load in pairs],
            "drive": {"torque": "balance"},
            "regime": {"speed": f"{case['N_rpm']} rpm"},
            "flywheel": {"inertia": inertia},
        }
    )
    result = flywheel.size(scene, simulate=False).as_dict()
    greatest = float(flywheel.reduce(scene, [radians(case["apex_deg"])]).moment[0])
    agree(
        "khurmi-16.8",
        P_kW=-result["power"] / 1000,
        Cs_percent=100 * result["simulation"]["irregularity"],
        CE_percent=-100 * result["coefficient_of_energy"],
        alpha_max=greatest / inertia,
        dE_J=result["energy_fluctuation"],
    )


def strokes(case: dict[str, Any], areas: str) -> list[float]:
    """Works of suction, compression, expansion and exhaust from their areas; expansion alone is done by the gas."""
    signs = (-1, -1, 1, -1)
    return [sign * area * case["scale_J_per_m2"] for sign, area in zip(signs, case[areas], strict=True)]


def test_16_10_gas_engine() -> None:
    case = inputs("khurmi-16.10")
    mean, eps = mean_and_eps(case)
    result = four_stroke(strokes(case, "areas_m2"), f"{mean} rpm", irregularity=eps)
    mass = result["flywheel"]["exact"] / case["R_m"] ** 2
    agree("khurmi-16.10", m_kg=mass, dE_J=result["energy_fluctuation"], Tmean=-result["balance"]["value"])


def test_16_11_second_harmonic() -> None:
    case = inputs("khurmi-16.11")
    drive = "20000 + 9500*sin(2*phi) - 5700*cos(2*phi)"
    scene = flywheel.load(
        {
            "parameters": {"load": "balance"},
            "load": [{"on": "crank", "torque": "-load"}],
            "drive": {"torque": drive},
            "regime": {"speed": f"{case['N_rpm']} rpm"},
            "flywheel": {"irregularity": case["Cs"]},
        }
    )
    result = flywheel.size(scene, simulate=False).as_dict()
    inertia = result["flywheel"]["exact"]
    agree(
        "khurmi-16.11",
        P_kW=result["power"] / 1000,
        dE_J=result["energy_fluctuation"],
        I_kgm2=inertia,
        alpha_45=float(flywheel.reduce(scene, [radians(45)]).moment[0]) / inertia,
    )


def third_harmonic(load: str) -> dict[str, Any]:
    case = inputs("khurmi-16.13")
    return sized(
        {
            "load": [{"on": "crank", "torque": f"-({load})"}],
            "drive": {"torque": "5000 + 1500*sin(3*phi)"},
            "regime": {"speed": f"{case['N_rpm']} rpm"},
            "flywheel": {"inertia": case["I_kgm2"]},
        }
    )


def test_16_13_third_harmonic_against_a_constant_load() -> None:
    result = third_harmonic("5000")
    agree("khurmi-16.13", P_kW=result["power"] / 1000, Cs_i_percent=100 * result["simulation"]["irregularity"])


def test_16_13_third_harmonic_against_a_first() -> None:
    result = third_harmonic("5000 + 600*sin(phi)")
    agree("khurmi-16.13", Cs_ii_percent=100 * result["simulation"]["irregularity"])
    agree("khurmi-16.13", dE_ii_J=result["energy_fluctuation"])


def test_16_15_steam_engine() -> None:
    case = inputs("khurmi-16.15")
    swing = case["CE"] * case["P_W"] * 60 / case["N_rpm"]
    result = of_swing(swing, f"{case['N_rpm']} rpm", irregularity=case["Cs"])
    rim = case["rim_fraction"] * result["flywheel"]["exact"]
    agree("khurmi-16.15", m_kg=rim / (case["D_m"] / 2) ** 2)


def test_16_17_diesel_engine() -> None:
    case = inputs("khurmi-16.17")
    mean, eps = mean_and_eps(case)
    result = four_stroke(strokes(case, "areas_m2"), f"{mean} rpm", irregularity=eps)
    agree("khurmi-16.17", I_kgm2=result["flywheel"]["exact"], dE_J=result["energy_fluctuation"])


def test_16_18_expansion_stronger_than_the_cycle() -> None:
    case = inputs("khurmi-16.18")
    cycle = case["P_W"] * 2 * 60 / case["N_rpm"]
    works = [0, (1 - case["work_ratio"]) * cycle, case["work_ratio"] * cycle, 0]
    result = four_stroke(works, f"{case['N_rpm']} rpm", irregularity=case["Cs"])
    agree("khurmi-16.18", dE_J=result["energy_fluctuation"])


def test_16_19_punching_press() -> None:
    case = inputs("khurmi-16.19")
    mean, eps = mean_and_eps(case)
    cycle = 3600 / case["holes_per_h"]
    result = press(case["E_hole_J"], case["t_punch_s"] / cycle, cycle, mean, irregularity=eps)
    mass = result["flywheel"]["exact"] / case["k_m"] ** 2
    agree("khurmi-16.19", P_kW=result["power"] / 1000, m_kg=mass)


def test_16_21_riveting_machine() -> None:
    case = inputs("khurmi-16.21")
    cycle, inertia = case["E_J"] / case["P_W"], case["m_kg"] * case["k_m"] ** 2
    spent = case["E_J"] - case["P_W"] * case["t_s"]
    lowest = sqrt((case["N1_rpm"] * RPM) ** 2 - 2 * spent / inertia) / RPM
    mean = (case["N1_rpm"] + lowest) / 2
    result = press(case["E_J"], case["t_s"] / cycle, cycle, mean, inertia=inertia)
    ratio = mean / (60 / cycle)
    agree("khurmi-16.21", N2_rpm=result["simulation"]["speed_min"] * ratio / RPM)
    agree("khurmi-16.21", rivets_per_min=result["speed"] / RPM)
    assert result["simulation"]["speed_max"] * ratio / RPM == pytest.approx(case["N1_rpm"], rel=1e-9)
    assert result["power"] == pytest.approx(case["P_W"], rel=1e-9)


def test_16_1_and_16_3_by_formula() -> None:
    case = inputs("khurmi-16.1")
    speeds = press_work.extreme_speeds(case["m_kg"] * case["k_m"] ** 2, case["N_rpm"] * RPM, case["dE_J"])
    agree("khurmi-16.1", N1_rpm=speeds.high / RPM, N2_rpm=speeds.low / RPM)
    case = inputs("khurmi-16.3")
    swing = case["CE"] * case["P_W"] * 60 / case["N_rpm"]
    agree("khurmi-16.3", m_kg=press_work.inertia_for(swing, case["N_rpm"] * RPM, case["Cs"]) / case["k_m"] ** 2)


def test_16_19_and_16_22_by_formula() -> None:
    case = inputs("khurmi-16.19")
    press = press_work.press_cycle(case["E_hole_J"], 3600 / case["holes_per_h"], case["t_punch_s"])
    inertia = press_work.inertia_between(press.given, case["N1_rpm"] * RPM, case["N2_rpm"] * RPM)
    agree("khurmi-16.19", P_kW=press.motor_power / 1000, m_kg=inertia / case["k_m"] ** 2)
    case = inputs("khurmi-16.22")
    energy = press_work.cutting_energy(pi * case["d_mm"] / 1e3, case["t_mm"] / 1e3, case["e_J_per_mm2"] * 1e6)
    press = press_work.press_cycle(energy, 60 / case["rate_per_min"], case["t_punch_s"])
    inertia = press_work.inertia_between(press.given, case["N1_rpm"] * RPM, case["N2_rpm"] * RPM)
    agree("khurmi-16.22", m_kg=inertia / case["k_m"] ** 2)


@pytest.mark.slow
def test_11_14_a_clutch_takes_a_shaft_along() -> None:
    case = inputs("bhandari-11.14")
    speed, driven = case["N_rpm"] * RPM, case["m2_kg"] * case["k2_m"] ** 2
    wheel, torque = case["m1_kg"] * case["k1_m"] ** 2, case["P_W"] / speed
    joined = press_work.engage(wheel, speed, driven, torque=torque)
    agree("bhandari-11.14", t_s=joined.time or 0.0, E_J=joined.heat)
    scene = {
        "shafts": {"wheel": {"ratio": 1, "clutch": {"torque": torque, "disengage": "300 deg"}}},
        "inertia": [{"on": "crank", "value": driven}],
        "brake": [{"torque": 300, "engage": "310 deg"}],
        "single_stroke": {"rate": "20 1/min", "continuous": 2},
        "drive": {"on": "wheel", "torque": f"1e-13*({speed!r} - omega)"},
        "flywheel": {"on": "wheel", "inertia": wheel},
    }
    slip = Strokes(flywheel.load(scene), wheel, 1e-10).stroke(speed, 0.0).legs[0]
    agree("bhandari-11.14", 1e-8, t_s=slip.end, E_J=slip_heat(slip, 1.0))


def test_16_21_by_formula() -> None:
    case = inputs("khurmi-16.21")
    press = press_work.press_at(case["E_J"], case["P_W"], case["t_s"])
    low = press_work.speed_after(case["m_kg"] * case["k_m"] ** 2, case["N1_rpm"] * RPM, press.given)
    agree("khurmi-16.21", N2_rpm=low / RPM, rivets_per_min=60 * press.rate)


def test_16_22_punch() -> None:
    case = inputs("khurmi-16.22")
    mean, eps = mean_and_eps(case)
    energy = pi * case["d_mm"] * case["t_mm"] * case["e_J_per_mm2"]
    cycle = 60 / case["rate_per_min"]
    result = press(energy, case["t_punch_s"] / cycle, cycle, mean, irregularity=eps)
    agree("khurmi-16.22", m_kg=result["flywheel"]["exact"] / case["k_m"] ** 2)


# Bevan, The Theory of Machines: problems in feet, pounds and inches.


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


# Sarkar, Theory of Machines: areas of a diagram, and presses with a given flywheel.


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
    source = press_work.energy_given(case["m_kg"] * case["k_m"] ** 2, case["N1_rpm"] * RPM, case["N2_rpm"] * RPM)
    press = press_work.press_of(source, case["cycle_s"], case["cycle_s"] - case["t_recharge_s"])
    agree("sarkar-6.7", P_kW=press.power / 1000, E_J=press.energy)
    case = inputs("sarkar-6.9")
    press = press_work.press_at(case["E_J"], case["P_W"], case["t_s"])
    low = press_work.speed_after(case["I"], case["N1_rpm"] * RPM, press.given)
    agree("sarkar-6.9", n_per_h=3600 * press.rate, drop_rpm=case["N1_rpm"] - low / RPM)


# Shigley's Mechanical Engineering Design: a table of engine torque, and a press between two speeds.


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
    source = energy_given(inertia, *speeds)
    agree("shigley-16-press", dE_exact=source)
    assert inertia_for(source, speeds.mean, speeds.irregularity) == pytest.approx(inertia, rel=1e-12)


# Single problems from other books: Norton, Uicker, and a quiz.


def test_norton_11_3_areas_that_leave_a_closure() -> None:
    case = inputs("norton-11.3")
    result = of_areas(case["areas_lbf_in"], "1 lbf in", case["omega"], irregularity=case["k"])
    swing, inertia = result["energy_fluctuation"] / LBF_IN, result["flywheel"]["exact"] / LBF_IN
    agree("norton-11.3", dE_lbf_in=swing, Is_lb_in_s2=inertia, closure_lbf_in=result["closure"] * swing)


def test_uicker_18_2_disc_flywheel() -> None:
    case = inputs("uicker-18.2")
    result = of_swing(case["dU_J"], f"{case['N_rpm']} rpm", irregularity=case["Cs"])
    agree("uicker-18.2", I=result["flywheel"]["exact"])


def test_quiz_160_both_ways() -> None:
    case = inputs("quiz-160")
    result = of_swing(case["dE_J"], case["omega"], irregularity=f"{100 * case['Cs']} %")
    agree("quiz-160", I=result["flywheel"]["exact"])
    assert result["irregularity"] == pytest.approx(2 * 0.0175)


def test_quiz_160_by_formula() -> None:
    case = inputs("quiz-160")
    agree("quiz-160", I=inertia_for(case["dE_J"], case["omega"], case["Cs"]))
