"""Every figure of every reference scene, against values computed at 30 digits apart from this package.

`tests/references/make_references.py` wrote them: positions differentiated, moments by virtual work, Legendre series at
45 digits. Each figure must be within rtol of them, and its true error must not exceed the estimate that comes with it.
"""

from __future__ import annotations

import json
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest

import flywheel
from tests.limits import sample

FOLDER = Path(__file__).parent.parent / "references"
REFERENCES = {r["scene"].removesuffix(".toml"): r for r in json.loads((FOLDER / "references.json").read_text())}
ROUNDING = 4e-16  # the figure itself is a double
LOOSE, TIGHT = 1e-4, 1e-12


def sized(name: str, rtol: float | None = None) -> dict[str, Any]:
    scene = flywheel.load(FOLDER / "scenes" / f"{name}.toml")
    return flywheel.size(scene, rtol=rtol, simulate=False).as_dict()


def error(found: Any, true: Any, scale: float = 0.0) -> float:
    """The relative error of a figure; infinite where only one of the two is there."""
    if found is None or true is None:
        return 0.0 if found is true else float("inf")
    return float(abs(found - float(true)) / max(abs(float(true)), scale, 1e-300))


def works(result: dict[str, Any], true: dict[str, Any]) -> dict[str, float]:
    scale = float(true["work_exchanged"])
    keys = ("accumulated_max", "accumulated_min", "energy_fluctuation")
    errors = {key: error(result[key], true[key], scale) for key in keys}
    assert len(result["areas"]) == len(true["areas"])
    for i, (found, area) in enumerate(zip(result["areas"], true["areas"], strict=True)):
        errors |= {f"area {i} {key}": error(found[key], area[key], scale) for key in ("work", "accumulated")}
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
    inertia, found = true["reduced_inertia"], result["reduced_inertia"]
    errors = {f"I* {key}": error(found[key], inertia[key], float(inertia["max"])) for key in inertia}
    errors |= {key: error(result[key], true[key]) for key in ("cycle", "power", "coefficient_of_energy")}
    value = result["balance"] and result["balance"]["value"]
    return errors | {"balance": error(value, true["balance"])}


def apart(angle: float, others: list[str], cycle: float) -> float:
    """How far an angle is from the nearest of others, around the cycle."""
    gaps = [abs(angle - float(other)) for other in others]
    return min(min(gap, cycle - gap) for gap in gaps)


def angles(result: dict[str, Any], true: dict[str, Any]) -> dict[str, float]:
    if "angle_speed_max" not in true:
        return {}
    pairs = zip(result["areas"], true["areas"], strict=True)
    errors = {f"area {i} to": abs(found["to"] - float(area["to"])) for i, (found, area) in enumerate(pairs)}
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
    for name, found in inertias(result, true).items():
        groups.setdefault(name.removesuffix("_total"), {})[name] = found
    for group, errors in groups.items():
        if errors and estimate[group] is not None:
            assert worse(errors, estimate[group] + ROUNDING) == {}, group
    for name, found in machine(result, true).items():
        allowed = estimate["reduced_inertia" if name.startswith("I*") else name] if name != "cycle" else 0.0
        assert found <= (allowed or 0.0) + ROUNDING, name
    assert error(result["speed"], true["speed"]) <= estimate["speed"]
    for name, found in angles(result, true).items():
        assert found <= estimate["extremes" if "speed" in name else "angles"] + ROUNDING * 13, name


def test_the_references_cover_every_scene() -> None:
    assert {path.stem for path in (FOLDER / "scenes").glob("*.toml")} == set(REFERENCES)
