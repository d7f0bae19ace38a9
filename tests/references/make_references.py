"""Write references.json: the figures of every scene in scenes/, by the oracle with 45 digits, apart from the toolkit.

Run by hand, from the root of the project: `python -m tests.references.make_references [--check] [SCENE ...]`. Nothing here
imports `flywheel` or `bondgraph`; positions are differentiated, energies are summed, moments are virtual work. With names of
scenes, only those are computed anew. With `--check` nothing is written: the greatest difference from the file is printed.
The file's figures came from a route of their own (one angle at a time, root finding on the functions themselves), so that
this compares two.
"""

from __future__ import annotations

import json
import os
import sys
import tomllib
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # before the oracle is imported; whoever imports this keeps the digits that there are
    os.environ.setdefault("ORACLE_DIGITS", "45")

import numpy as np
from mpmath import mp  # type: ignore[import-untyped]

from tests.oracle import figures
from tests.oracle.machine import Machine
from tests.oracle.numbers import Real, plain, real

HERE = Path(__file__).parent
DIGITS = 20


def machine(scene: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The figures of a scene with a machine."""
    result = figures.references(Machine(scene, folder), 1e-24)
    cycle, speed, wheel, regime = result["cycle"], result["speed"], scene["flywheel"], {"closure": Real(0)}
    if result["balance"] is None:
        regime["closure"] = cycle.work.edges[-1]
    starts = [Real(0), *(area["to"] for area in result["areas"])]
    areas = [{"from": start} | area for start, area in zip(starts, result["areas"], strict=False)]
    shafts = {name: real(shaft["ratio"]) for name, shaft in scene.get("shafts", {}).items()}
    ratio = shafts.get(wheel.get("on", "crank"), Real(1))
    sized = {k: result["flywheel"].get(k) for k in ("exact", "approximate", "approximate_total", "inertia_torque")}
    inputs = None if "irregularity" in wheel else real(wheel["inertia"])
    flywheel = (result["flywheel"]["exact"] if inputs is None else inputs) * ratio**2
    run = figures.run_of(cycle, speed, flywheel)
    assert run is not None
    motion = dict(figures.motion_figures(cycle, run, flywheel)) | {"irregularity_approximate": None}
    if inputs is None:
        rough = figures.run_of(cycle, speed, result["flywheel"]["approximate"] * ratio**2)
        motion["irregularity_approximate"] = rough and rough.irregularity
    work, swing = cycle.drive_work, result["energy_fluctuation"]
    kept = {k: result[k] for k in ("balance", "power", "accumulated_max", "accumulated_min", "reduced_inertia")}
    return regime | kept | {
        "cycle": cycle.mesh.edges[-1], "speed": speed, "work_exchanged": result["exchanged"], "areas": areas,
        "energy_fluctuation": swing, "coefficient_of_energy": swing / work if work else None,
        "flywheel": {"inertia": inputs} | sized | {"needed": result.get("needed")}, "simulation": motion,
        **{key: angles(result[key].angles, cycle.mesh.edges[-1]) for key in ("angle_speed_max", "angle_speed_min")},
    }  # fmt: skip


def angles(result: Any, length: Any) -> list[Any]:
    """The distinct angles of a cycle, ascending, its end being its start."""
    kept: list[Any] = []
    for phi in sorted(x - plain.floor((x + Real("1e-12")) / length) * length for x in result):
        if all(abs(phi - other) > 1e-12 for other in kept):
            kept.append(phi)
    return kept


def summed(scene: dict[str, Any]) -> dict[str, Any]:
    """The figures of a scene that gives areas in place of a machine."""
    works = np.array([real(value) * real(scene["areas"]["scale"]) for value in scene["areas"]["values"]])
    sums = np.cumsum(works)
    top, bottom = max(*sums, Real(0)), min(*sums, Real(0))
    swing, shafts = top - bottom, {"crank": Real(1)} | {n: real(s["ratio"]) for n, s in scene.get("shafts", {}).items()}
    regime, wheel = scene["regime"], scene["flywheel"]
    speed = real(regime["speed"]) / shafts[regime.get("on", "crank")]
    ratio = shafts[wheel.get("on", "crank")]
    result = {
        "speed": speed, "closure": sums[-1] / swing, "work_exchanged": np.abs(works).sum(),
        "areas": [{"work": w, "accumulated": a} for w, a in zip(works, sums, strict=True)],
        "accumulated_max": top, "accumulated_min": bottom, "energy_fluctuation": swing,
    }  # fmt: skip
    if "irregularity" in wheel:
        size = swing / (real(wheel["irregularity"]) * speed**2) / ratio**2
        names = ("exact", "approximate", "approximate_total")
        return result | {"flywheel": {"inertia": None} | dict.fromkeys(names, size), "simulation": None}
    eps = swing / (real(wheel["inertia"]) * ratio**2 * speed**2)
    run = {"irregularity": eps, "speed_max": speed * (1 + eps / 2), "speed_min": speed * (1 - eps / 2)}
    return result | {"flywheel": {"inertia": real(wheel["inertia"])}, "simulation": run}


def written(value: Any) -> Any:
    """A figure as JSON holds it: numbers as decimal texts."""
    if isinstance(value, dict):
        return {key: written(item) for key, item in value.items()}
    if isinstance(value, list):
        return [written(item) for item in value]
    return value if value is None or isinstance(value, bool | str) else mp.nstr(mp.mpf(value), DIGITS)


def computed(path: Path) -> dict[str, Any]:
    """The references of one scene."""
    scene = tomllib.loads(path.read_text(encoding="utf-8"), parse_float=Real)
    return {"scene": path.name, **written(summed(scene) if "areas" in scene else machine(scene, path.parent))}


def apart(mine: Any, reference: Any, scale: float = 0.0) -> float:
    """The greatest relative difference of two trees of figures, small ones against their scale; inf where not alike."""
    if isinstance(reference, dict):
        if mine.keys() != reference.keys():
            return float("inf")
        scale = float(reference.get("work_exchanged") or reference.get("max") or reference.get("approximate_total") or scale)
        by = {"to": 1.0, "from": 1.0, "cycle": 1.0, "areas": scale}
        return max((apart(mine[k], reference[k], by.get(k, scale)) for k in reference), default=0.0)
    if isinstance(reference, list):
        return (
            max(map(lambda a, b: apart(a, b, scale or 1.0), mine, reference), default=0.0)
            if len(mine) == len(reference)
            else np.inf
        )
    if reference is None or isinstance(reference, bool) or reference.endswith(".toml"):
        return 0.0 if mine == reference else float("inf")
    return float(abs(mp.mpf(mine) - mp.mpf(reference)) / max(abs(mp.mpf(reference)), scale * 1e-3, mp.mpf("1e-30")))


def main(arguments: list[str]) -> int:
    """Compute the named scenes, or all, and write the file, or tell how far it is from them."""
    target, expected = HERE / "references.json", [a for a in arguments if a != "--check"]
    reference = {r["scene"]: r for r in json.loads(target.read_text())}
    names = sorted(path.name for path in (HERE / "scenes").glob("*.toml"))
    worst = 0.0
    for name in names:
        if expected and name.removesuffix(".toml") not in expected:
            continue
        result = computed(HERE / "scenes" / name)
        if "--check" in arguments:
            worst = max(worst, gap := apart(result, reference[name]))
            print(f"{name}: {gap:.1e}", flush=True)
            continue
        reference[name] = result
        target.write_text(json.dumps([reference[n] for n in names if n in reference], indent=1, ensure_ascii=False) + "\n")
    return int(worst > 1e-17)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
