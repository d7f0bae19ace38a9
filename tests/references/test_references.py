"""Figures held against references of many digits."""

from __future__ import annotations

import json
from collections.abc import Callable
from decimal import Decimal
from itertools import pairwise
from math import cos, exp, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import flywheel
from tests import regimes
from tests.limits import sample

# Every figure of every reference scene, against values computed at 30 digits apart from this package.
#
# `tests/references/make_references.py` wrote them: positions differentiated, moments by virtual work, Legendre series at
# 45 digits. Each figure must be within rtol of them, and its true error must not exceed the estimate that comes with it.


FOLDER = Path(__file__).parent.parent / "references"
REFERENCES = {r["scene"].removesuffix(".toml"): r for r in json.loads((FOLDER / "references.json").read_text())}
ROUNDING = 4e-16  # the figure itself is a double
LOOSE, TIGHT = 1e-4, 1e-12


def sized(name: str, rtol: float | None = None) -> dict[str, Any]:
    scene = flywheel.load(FOLDER / "scenes" / f"{name}.toml")
    return flywheel.size(scene, rtol=rtol, simulate=False).as_dict()


def error(result: Any, true: Any, scale: float = 0.0) -> float:
    """The relative error of a figure; infinite where only one of the two is there."""
    if result is None or true is None:
        return 0.0 if result is true else float("inf")
    return float(abs(result - float(true)) / max(abs(float(true)), scale, 1e-300))


def works(result: dict[str, Any], true: dict[str, Any]) -> dict[str, float]:
    scale = float(true["work_exchanged"])
    keys = ("accumulated_max", "accumulated_min", "energy_fluctuation")
    errors = {key: error(result[key], true[key], scale) for key in keys}
    assert len(result["areas"]) == len(true["areas"])
    for i, (outcome, area) in enumerate(zip(result["areas"], true["areas"], strict=True)):
        errors |= {f"area {i} {key}": error(outcome[key], area[key], scale) for key in ("work", "accumulated")}
    return errors


def inertias(result: dict[str, Any], true: dict[str, Any]) -> dict[str, float]:
    if result["irregularity"] is None:
        return {}
    ratio = float(true["flywheel"]["approximate_total"]) or 1.0
    keys = ("exact", "approximate", "approximate_total", "inertia_torque")
    errors = {k: error(result["flywheel"][k], true["flywheel"][k], ratio) for k in keys if k in true["flywheel"]}
    return errors | inertia_torque_alone(result, true, ratio)


def inertia_torque_alone(result: dict[str, Any], true: dict[str, Any], scale: float) -> dict[str, float]:
    """The flywheel by the inertia torque: the total less the machine's own least inertia, at the flywheel's shaft."""
    if "reduced_inertia" not in true or "inertia_torque" not in true["flywheel"]:
        return {}
    fixed = flywheel.load(FOLDER / "scenes" / true["scene"]).flywheel_ratio
    total, least = Decimal(true["flywheel"]["inertia_torque"]), Decimal(true["reduced_inertia"]["min"])
    alone = max(total - least / Decimal(fixed) ** 2, Decimal(0))
    return {"inertia_torque_flywheel": error(result["flywheel"]["inertia_torque_flywheel"], alone, scale)}


def motion(result: dict[str, Any], true: dict[str, Any]) -> dict[str, float]:
    if result["simulation"] is None or true["simulation"] is None:
        return {}
    return {key: error(result["simulation"][key], value) for key, value in true["simulation"].items()}


def machine(result: dict[str, Any], true: dict[str, Any]) -> dict[str, float]:
    if "balance" not in true:
        return {}
    inertia, outcome = true["reduced_inertia"], result["reduced_inertia"]
    errors = {f"I* {key}": error(outcome[key], inertia[key], float(inertia["max"])) for key in inertia}
    errors |= {key: error(result[key], true[key]) for key in ("cycle", "power", "coefficient_of_energy")}
    value = result["balance"] and result["balance"]["value"]
    return errors | {"balance": error(value, true["balance"])}


def apart(angle: float, others: list[str], cycle: float) -> float:
    """Distance of an angle from the nearest of others, around the cycle."""
    gaps = [abs(angle - float(other)) for other in others]
    return min(min(gap, cycle - gap) for gap in gaps)


def angles(result: dict[str, Any], true: dict[str, Any]) -> dict[str, float]:
    if "angle_speed_max" not in true:
        return {}
    pairs = zip(result["areas"], true["areas"], strict=True)
    errors = {f"area {i} to": abs(outcome["to"] - float(area["to"])) for i, (outcome, area) in enumerate(pairs)}
    keys = ("angle_speed_max", "angle_speed_min")
    return errors | {key: apart(result[key], true[key], result["cycle"]) for key in keys}


def worse(errors: dict[str, float], allowed: float) -> dict[str, float]:
    return {name: value for name, value in errors.items() if not value <= allowed}


@pytest.mark.parametrize("name", REFERENCES)
def test_every_figure_is_the_reference_within_rtol_and_its_estimate(name: str) -> None:
    true, result = REFERENCES[name], sized(name)
    relative = works(result, true) | inertias(result, true) | motion(result, true) | machine(result, true)
    assert worse(relative | {"speed": error(result["speed"], true["speed"])}, result["rtol"]) == {}
    assert worse(angles(result, true), 1e-6) == {}
    assert result["flywheel"]["needed"] is true["flywheel"].get("needed", result["flywheel"]["needed"])
    assert result["reached"] is (float(true["closure"]) <= result["rtol"])  # what is left over is an error too
    assert_honest(result, true)


@pytest.mark.parametrize("rtol", [LOOSE, TIGHT])
@pytest.mark.parametrize("name", sample(REFERENCES, 4))
def test_a_loose_and_a_tight_rtol_have_honest_estimates_too(name: str, rtol: float) -> None:
    true, result = REFERENCES[name], sized(name, rtol)
    assert_honest(result, true)
    relative = works(result, true) | inertias(result, true) | motion(result, true) | machine(result, true)
    assert worse(relative, LOOSE) == {}


def assert_honest(result: dict[str, Any], true: dict[str, Any]) -> None:
    """No true error exceeds the estimate that comes with its figure."""
    estimate = result["error"]
    groups = {"work": works(result, true), "simulation": motion(result, true)}
    for name, outcome in inertias(result, true).items():
        groups.setdefault(name.removesuffix("_total"), {})[name] = outcome
    for group, errors in groups.items():
        if errors and estimate[group] is not None:
            assert worse(errors, estimate[group] + ROUNDING) == {}, group
    for name, outcome in machine(result, true).items():
        allowed = estimate["reduced_inertia" if name.startswith("I*") else name] if name != "cycle" else 0.0
        assert outcome <= (allowed or 0.0) + ROUNDING, name
    assert error(result["speed"], true["speed"]) <= estimate["speed"]
    for name, outcome in angles(result, true).items():
        assert outcome <= estimate["extremes" if "speed" in name else "angles"] + ROUNDING * 13, name


def test_the_references_cover_every_scene() -> None:
    assert {path.stem for path in (FOLDER / "scenes").glob("*.toml")} == set(REFERENCES)


# What the oracle does not know of the reference figures, by DOP853 on equations written by hand.


Rate = Callable[[float, float], float]


def slider(phi: float, r: float, l: float, e: float = 0.0) -> tuple[float, float, float, float]:  # noqa: E741
    """x'(phi), x''(phi) of the slider, rod's angle' and angle''."""
    s, c = sin(phi), cos(phi)
    run = sqrt(l * l - (r * s - e) ** 2)
    spin = -r * c / run
    dspin = r * s / run + r * c * (-(r * s - e) * r * c / run) / run**2
    x1 = -r * s - (r * s - e) * r * c / run
    x2 = -r * c - ((r * c) ** 2 - (r * s - e) * r * s) / run - ((r * s - e) * r * c) ** 2 / run**3
    return x1, x2, spin, dspin


def regime_machine(phi: float, sizes: dict[str, float]) -> tuple[float, float, float, float]:
    """I*, its slope, the weights' moment over g (weights along -y), the slider's x'."""
    r, l, a = sizes["r"], sizes["l"], sizes["com"]  # noqa: E741
    x1, x2, spin, dspin = slider(phi, r, l)
    share = a / l
    gx1, gx2 = (1 - share) * -r * sin(phi) + share * x1, (1 - share) * -r * cos(phi) + share * x2
    gy1, gy2 = (1 - share) * r * cos(phi), -(1 - share) * r * sin(phi)
    m, j, slide = sizes["m"], sizes["j"], sizes["slider"]
    inertia = sizes["crank"] + m * (gx1**2 + gy1**2) + j * spin**2 + slide * x1**2
    slope = 2 * (m * (gx1 * gx2 + gy1 * gy2) + j * spin * dspin + slide * x1 * x2)
    weight = -m * gy1 - sizes.get("crank mass", 0.0) * sizes.get("crank com", 0.0) * cos(phi)
    return inertia, slope, weight, x1


C_SIZES = {"r": 0.2, "l": 0.6, "com": 0.3, "m": 6.0, "j": 3.0, "slider": 6.0, "crank": 1.0}
PRESS = {"r": 0.1, "l": 0.5, "com": 0.2, "m": 10.0, "j": 0.3, "slider": 50.0}
PRESS |= {"crank": 0.1 + 5 * 0.02**2, "crank mass": 5.0, "crank com": 0.02}


def section_c(flywheel: float) -> Rate:
    def rate(phi: float, omega: float) -> float:
        inertia, slope, weight, _ = regime_machine(phi, C_SIZES)
        return (10 - 2.387 * omega + 9.81 * weight - slope * omega**2 / 2) / (inertia + flywheel)

    return rate


@pytest.mark.parametrize("key", ["0", "5", "500"])
def test_the_multiplier_is_the_integral_along_the_motion(key: str) -> None:
    true = regimes.figures("section-c")["analysis"][key]
    rate, start = section_c(float(key)), float(true["speed_at_zero"])

    def field(phi: float, s: Any) -> list[float]:
        return [rate(phi, s[0]) / s[0], -2.387 / (regime_machine(phi, C_SIZES)[0] + float(key)) / s[0]]

    end = solve_ivp(field, (0, 2 * pi), [start, 0.0], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert exp(end[1]) == pytest.approx(float(true["multiplier"]), rel=1e-11)


def test_section_c_is_what_the_source_gives() -> None:
    true = regimes.figures("section-c")["analysis"]["0"]
    assert float(true["irregularity"]) == pytest.approx(0.483227, abs=5e-7)
    assert float(true["speed"]) == pytest.approx(4.12273, abs=5e-6)
    assert float(true["period"]) == pytest.approx(1.538536393184, abs=5e-13)


@pytest.mark.parametrize("name", ["start-section-c", "start-section-c-flywheel", "start-section-c-dead-centre"])
def test_a_start_by_dop853_in_time(name: str) -> None:
    start = regimes.STARTS[name]
    rate = section_c(start.inertia)
    listed: Any = regimes.figures(name)
    truth = np.array([[float(f["phi"]), float(f["omega"])] for f in listed])
    field = lambda t, s: [s[1], rate(s[0], s[1])]  # noqa: E731
    first = [start.half_turns * pi, 0.0]
    result = solve_ivp(field, (0, 5), first, method="DOP853", rtol=1e-13, atol=1e-14, t_eval=start.times).y.T
    assert result == pytest.approx(truth, rel=5e-11)


@pytest.mark.parametrize(("kind", "key"), [("analysis", "0.1"), ("sizing", "0.05")])
def test_a_motor_with_inductance_turns_volts_into_heat_and_work(kind: str, key: str) -> None:
    true = regimes.figures("dc-inductance")[kind][key]
    work = quad(lambda phi: 20e3 * slider(phi, 0.1, 0.5)[0], 5 * pi / 3, 23 * pi / 12, epsabs=1e-10)[0]
    assert float(true["electric_work"]) - float(true["heat"]) == pytest.approx(work, rel=1e-12)
    assert float(true["electric_work"]) == pytest.approx(
        220 * float(true["current_time_mean"]) * float(true["period"]), rel=1e-14
    )


def test_a_motor_with_inductance_settles_on_its_motion() -> None:
    true = {
        k: v if isinstance(v, list) else float(v) for k, v in regimes.figures("dc-inductance")["analysis"]["0.1"].items()
    }
    edges = [0, *np.radians([300, 345, 360])]
    state = [13.0, 10.0, 0.0, 0.0]
    for _ in range(12):
        state[2:] = [0.0, 0.0]
        for at, stop in pairwise(edges):
            force = 20e3 if at == edges[1] else 0.0

            def field(phi: float, s: Any, force: float = force) -> list[float]:
                inertia, slope, _, x1 = regime_machine(phi, PRESS)
                moment = 15 * s[1] - force * x1 - slope * s[0] ** 2 / 2
                current = (220 - 0.8 * s[1] - 15 * s[0]) / 0.05
                return [moment / (inertia + 100 * 0.13) / s[0], current / s[0], 1 / s[0], s[1] / s[0]]

            state = list(solve_ivp(field, (at, stop), state, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1])
    assert state[2] == pytest.approx(true["period"], rel=1e-10)
    assert state[3] / state[2] == pytest.approx(true["current_time_mean"], rel=1e-10)


@pytest.mark.parametrize("name", ["unstable", "two-speeds-slow"])
def test_unstable_motions_grow(name: str) -> None:
    assert all(float(result["multiplier"]) > 1 for result in regimes.figures(name)["analysis"].values())


def test_every_case_has_its_figures() -> None:
    for name, case in regimes.CASES.items():
        result = regimes.figures(name)
        assert list(result["analysis"]) == [repr(j) for j in case.inertias]
        assert list(result["sizing"]) == [repr(e) for e in case.irregularities]
        assert [float(result["sizing"][repr(e)]["irregularity"]) for e in case.irregularities] == pytest.approx(
            case.irregularities, rel=1e-15
        )
