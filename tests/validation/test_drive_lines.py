"""Drive lines of textbooks, and motions by other programs."""

from __future__ import annotations

from math import exp, pi, tau
from typing import Any

import pytest

import flywheel
from tests.limits import sample
from tests.validation.test_books import CASES, G, agree, inputs, sized

# Drive lines of textbooks: gear trains with losses, flywheels chosen by the motor's torque, heat of a start.


def hoists(case: dict[str, Any]) -> dict[str, Any]:
    """The figures of a motor with a geared load and a hoist whose drum is taken with a radius of 1 m."""
    speed = case["N_rpm"] * pi / 30
    shafts = {"load": {"ratio": case["a"], "efficiency": case["eta1"]}}
    inertia = [{"on": "crank", "value": case["Jm"]}, {"on": "load", "value": case["J1"]}]
    load = [{"on": "load", "torque": -case["T1"]}]
    if "M" in case:
        shafts["drum"] = {"ratio": case["v"] / speed, "efficiency": case["eta2"]}
        inertia.append({"on": "drum", "value": case["M"]})
        load.append({"on": "drum", "torque": -case["M"] * case["g"]})
    drive = {"drive": {"torque": "balance"}, "regime": {"speed": speed}, "flywheel": {"inertia": 0}}
    return sized({"shafts": shafts, "inertia": inertia, "load": load, **drive})


@pytest.mark.parametrize("name", ["dubey-2.1", "gupta-drives-1.4", "gupta-drives-1.3"])
def test_geared_loads_each_with_its_losses(name: str) -> None:
    result = hoists(inputs(name))
    power = result["energy"]["mean_power"]
    outcome = {"J": result["reduced_inertia"]["mean"], "T_Nm": result["balance"]["value"], "P_W": power, "P_kW": power / 1e3}
    agree(name, **{key: value for key, value in outcome.items() if key in CASES[name]["computed"]})


def armature(case: dict[str, Any], *ratios: float) -> float:
    """Inertia at an armature whose pinion drives discs of one width, stage behind stage, to the load."""
    shafts, inertia, on = {}, [{"on": "crank", "value": case["IM"]}], "crank"
    for k, ratio in enumerate(ratios):
        shafts[f"s{k}"] = {"on": on, "ratio": 1 / ratio}
        inertia += [{"on": on, "value": case["IP"]}, {"on": f"s{k}", "value": case["IP"] * ratio**4}]
        on = f"s{k}"
    inertia.append({"on": on, "value": case["IL"]})
    scene = {"shafts": shafts, "inertia": inertia, "regime": {"speed": 1}, "flywheel": {"inertia": 0}}
    return float(flywheel.reduce(flywheel.load(scene), [0.0]).inertia[0])


def test_shigley_16_26_gears_of_one_stage() -> None:
    case = inputs("shigley-16.26")
    agree("shigley-16.26", Ie=armature(case, case["n"]))


def test_shigley_16_28_gears_of_two_stages_in_series() -> None:
    case, true = inputs("shigley-16.28"), CASES["shigley-16.28"]
    result = [armature(case, n, case["R"] / n) for n in case["n"]]
    assert result == pytest.approx(true["computed"]["Ie"], rel=1e-12)
    assert result == pytest.approx(true["printed"]["Ie"], rel=true["printed_rtol"])
    best = true["computed"]["n_least"]
    assert armature(case, best, case["R"] / best) < min(result)


def test_khurmi_3_18_mine_hoist_shaft_behind_shaft() -> None:
    case = inputs("khurmi-3.18")
    mass, friction, radius, rpm = case["m_kg"], case["friction_Nm"], case["d_drum_m"] / 2, case["N_rpm"]
    k = dict(zip(("motor", "inter", "drum", "pulley"), case["k"], strict=True))
    up, down = case["cages_kg"]
    shafts = {
        "inter": {"ratio": rpm["inter"] / rpm["motor"], "drag": friction["inter"]},
        "drum": {"on": "inter", "ratio": rpm["drum"] / rpm["inter"], "drag": friction["drum"]},
        "pulley": {"on": "drum", "ratio": case["d_drum_m"] / case["d_pulley_m"], "drag": 2 * friction["pulley_each"]},
    }
    count = {"motor": 1, "inter": 1, "drum": 1, "pulley": 2}
    inertia = [{"on": "crank" if n == "motor" else n, "value": count[n] * mass[n] * k[n] ** 2} for n in k]
    rope = (up - down) * G + sum(case["friction_N"])
    scene = {
        "shafts": shafts,
        "inertia": inertia,
        "load": [{"on": "drum", "torque": -rope * radius}],
        "drive": {"torque": "balance"},
        "regime": {"speed": rpm["motor"] * pi / 30},
        "flywheel": {"inertia": 0},
    }
    result = sized(scene)
    alpha = case["a"] / radius * rpm["motor"] / rpm["drum"]
    cages = (up + down) * (radius * rpm["drum"] / rpm["motor"]) ** 2
    wheels = result["reduced_inertia"]["mean"]
    agree("khurmi-3.18", I_eq=wheels, T_Nm=(wheels + cages) * alpha + result["balance"]["value"])


def test_bevan_2_11_car_on_its_gears() -> None:
    case = inputs("bevan-2.11")
    result = []
    for gear, efficiency in zip(case["G"], case["eta"], strict=True):
        scene = {
            "shafts": {"engine": {"ratio": gear, "efficiency": efficiency}},
            "inertia": [
                {"on": "crank", "value": case["mass_lb"] / 32.2},
                {"on": "engine", "value": case["engine_lb"] / 32.2},
            ],
            "drive": {"on": "engine", "torque": case["force_per_G_lbf"]},
            "regime": {"speed": 1},
            "flywheel": {"inertia": 0},
        }
        result.append(flywheel.simulate(flywheel.load(scene), 0.0, 0.0, 2.0).omega[-1] / 2.0)
    assert result == pytest.approx(CASES["bevan-2.11"]["computed"]["a"], rel=1e-9)
    assert result == pytest.approx(CASES["bevan-2.11"]["printed"]["a"], rel=CASES["bevan-2.11"]["printed_rtol"])


class Duty:
    """A motor whose torque falls in a straight line with speed, a high load for a time, then a low one; in closed form.

    T(t) = T_high - (T_high - T) exp(-t/tau) while the high load acts, with tau = J times the line's slope. Loads go by
    angle here, one turn of the crank to a duty: windows end at the angles which that motion comes to in its times.
    """

    def __init__(self, case: dict[str, Any], total: float, *, rest: float | None = None, start: float | None = None) -> None:
        """`total` is the inertia of all (kg m²), `rest` the time of the low load, `start` the torque before the high one."""
        rated = case.get("T_rated") or case["P_W"] / (case["N_rated_rpm"] * pi / 30)
        self.rated, self.idle = rated, case["N0_rpm"] * pi / 30
        slip = case["slip_rated"] if "slip_rated" in case else 1 - case["N_rated_rpm"] / case["N0_rpm"]
        self.slope, self.low, self.high = self.idle * slip / rated, case["T_low"], case["T_high"]
        lag, time = total * self.slope, case["t_high"]
        begun = self.low if start is None else start
        self.greatest = self.high - (self.high - begun) * exp(-time / lag)
        rest = 26 * lag if rest is None else rest
        self.busy = self._way(time, lag, self.high, begun)
        self.ratio = (self.busy + self._way(rest, lag, self.low, self.greatest)) / tau

    def _way(self, time: float, lag: float, load: float, torque: float) -> float:
        """The angle of the motor in a time under a load, from a torque."""
        return self.idle * time - self.slope * (load * time - (load - torque) * lag * (1 - exp(-time / lag)))

    def scene(self, wheel: dict[str, Any], inertia: float = 0.0) -> dict[str, Any]:
        """The scene, the flywheel on the motor's shaft."""
        motor = {"type": "line", "no_load_speed": self.idle, "speed": self.idle - self.slope * self.rated}
        end = self.busy / self.ratio
        load = [{"on": "motor", "torque": -self.high, "from": 0, "to": end}]
        if self.low:
            load.append({"on": "motor", "torque": -self.low, "from": end, "to": tau})
        return {
            "shafts": {"motor": {"ratio": self.ratio}},
            "load": load,
            "drive": {"on": "motor", "motor": motor | {"torque": self.rated, "inertia": inertia}},
            "flywheel": {"on": "motor", **wheel},
        }


LIMITED = ["theraja-45.21", "dubey-2.3", "gupta-singhal-4.13", "theraja-45.20", "theraja-45.23"]


@pytest.mark.parametrize("name", sample(LIMITED, len(LIMITED)))
def test_flywheel_of_a_motor_whose_torque_is_limited(name: str) -> None:
    case, wheel = inputs(name), CASES[name]["computed"]["J"]
    own = case.get("Jm", 0.0)
    duty = Duty(case, wheel + own)
    share = case["T_max_over_rated"] if "T_max_over_rated" in case else case["T_max"] / duty.rated
    assert duty.greatest == pytest.approx(share * duty.rated, rel=1e-12)
    result = sized(duty.scene({"limits": {"motor_torque": share}}, own))
    agree(name, J=result["flywheel"]["exact"])
    assert result["flywheel"]["binding"] == "motor_torque"


def test_theraja_45_17_given_flywheel() -> None:
    case = inputs("theraja-45.17")
    duty = Duty(case, case["J"])
    result = sized(duty.scene({"inertia": case["J"]}))
    least = result["simulation"]["speed_min"] * duty.ratio
    agree("theraja-45.17", N_min_rpm=least * 30 / pi, T_max_kgf_m=(duty.idle - least) / duty.slope / 9.81)


def test_theraja_45_18_rolling_mill_in_its_regime() -> None:
    case, true = inputs("theraja-45.18"), CASES["theraja-45.18"]["computed"]
    slope = case["N0_rpm"] * case["slip_rated"] / case["T_rated"]
    duty = Duty(case, case["J"], rest=case["t_low"], start=(case["N0_rpm"] - true["N_max_rpm"]) / slope)
    result = sized(duty.scene({"inertia": case["J"]}))
    speeds = {key: result["simulation"][key] * duty.ratio * 30 / pi for key in ("speed_min", "speed_max")}
    agree("theraja-45.18", N_min_rpm=speeds["speed_min"], N_max_rpm=speeds["speed_max"])


def test_dubey_6_7_heat_of_a_start() -> None:
    case, true = inputs("dubey-6.7"), CASES["dubey-6.7"]["computed"]
    synchronous, slip = 2 * tau * case["f_Hz"] / case["poles"], 0.02
    share = (true["s_max"] / slip + slip / true["s_max"]) / 2  # breakdown torque over that at this slip
    speed = (1 - slip) * synchronous
    motor = {
        "type": "induction",
        "power": true["T_max_Nm"] / share * speed,
        "speed": speed,
        "poles": case["poles"],
        "frequency": f"{case['f_Hz']} Hz",
        "breakdown_ratio": share,
    }
    scene = {"drive": {"motor": motor}, "inertia": [{"on": "crank", "value": case["J"]}], "flywheel": {"inertia": 0}}
    start = flywheel.simulate(flywheel.load(scene), 0.0, 0.0, true["t_s"])
    assert start.omega[-1] == pytest.approx(0.95 * synchronous, rel=1e-8)
    agree("dubey-6.7", t_s=float(start.t[-1]))


# Moving slider-cranks: a multibody program's runs, and the energy equation at 25 digits.


def slider_crank(crank: dict[str, float], rod: dict[str, float], slider: float, **more: Any) -> flywheel.Machine:
    kind = {"type": "slider-crank", "crank": crank, "rod": rod, "slider": {"mass": slider}}
    scene = {"mechanism": kind, **more, "regime": {"speed": 10}, "flywheel": {"irregularity": 0.1}}
    return flywheel.Machine(flywheel.load(scene))


def test_free_for_a_second() -> None:
    case = inputs("xtool-exudyn-free")
    crank = {"length": case["r"], "inertia": case["I1"]}
    rod = {"length": case["l"], "mass": case["m2"], "inertia": case["I2"], "com": case["l"] / 2}
    motion = flywheel.simulate(slider_crank(crank, rod, case["m3"]), phi=0.0, omega=case["w0"], until=1.0)
    agree("xtool-exudyn-free", omega_1s=motion.omega[-1], phi_1s=motion.phi[-1])


def uniform(length: float, mass: float) -> dict[str, float]:
    return {"length": length, "mass": mass, "inertia": mass * length**2 / 12, "com": length / 2}


@pytest.mark.slow
def test_driven_from_rest() -> None:
    case = inputs("exudyn-driven")
    crank, rod = uniform(case["r"], case["m1"]), uniform(case["l"], case["m2"])
    machine = slider_crank(crank, rod, case["m3"], drive={"torque": case["torque"]})
    motion = flywheel.simulate(machine, phi=0.0, omega=0.0, until=case["t"])
    agree("exudyn-driven", phi=motion.phi[-1], omega=motion.omega[-1])
