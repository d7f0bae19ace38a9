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
    found = figures.references(Machine(scene, folder), 1e-24)
    cycle, speed, wheel, regime = found["cycle"], found["speed"], scene["flywheel"], {"closure": Real(0)}
    if found["balance"] is None:
        regime["closure"] = cycle.work.edges[-1]
    starts = [Real(0), *(area["to"] for area in found["areas"])]
    areas = [{"from": start} | area for start, area in zip(starts, found["areas"], strict=False)]
    shafts = {name: real(shaft["ratio"]) for name, shaft in scene.get("shafts", {}).items()}
    ratio = shafts.get(wheel.get("on", "crank"), Real(1))
    sized = {k: found["flywheel"].get(k) for k in ("exact", "approximate", "approximate_total", "inertia_torque")}
    given = None if "irregularity" in wheel else real(wheel["inertia"])
    flywheel = (found["flywheel"]["exact"] if given is None else given) * ratio**2
    run = figures.run_of(cycle, speed, flywheel)
    assert run is not None
    motion = dict(figures.motion_figures(cycle, run, flywheel)) | {"irregularity_approximate": None}
    if given is None:
        rough = figures.run_of(cycle, speed, found["flywheel"]["approximate"] * ratio**2)
        motion["irregularity_approximate"] = rough and rough.irregularity
    work, swing = cycle.drive_work, found["energy_fluctuation"]
    kept = {k: found[k] for k in ("balance", "power", "accumulated_max", "accumulated_min", "reduced_inertia")}
    return regime | kept | {
        "cycle": cycle.mesh.edges[-1], "speed": speed, "work_exchanged": found["exchanged"], "areas": areas,
        "energy_fluctuation": swing, "coefficient_of_energy": swing / work if work else None,
        "flywheel": {"inertia": given} | sized | {"needed": found.get("needed")}, "simulation": motion,
        **{key: angles(found[key].angles, cycle.mesh.edges[-1]) for key in ("angle_speed_max", "angle_speed_min")},
    }  # fmt: skip


def angles(found: Any, length: Any) -> list[Any]:
    """The distinct angles of a cycle, ascending, its end being its start."""
    kept: list[Any] = []
    for phi in sorted(x - plain.floor((x + Real("1e-12")) / length) * length for x in found):
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
    found = {
        "speed": speed, "closure": sums[-1] / swing, "work_exchanged": np.abs(works).sum(),
        "areas": [{"work": w, "accumulated": a} for w, a in zip(works, sums, strict=True)],
        "accumulated_max": top, "accumulated_min": bottom, "energy_fluctuation": swing,
    }  # fmt: skip
    if "irregularity" in wheel:
        size = swing / (real(wheel["irregularity"]) * speed**2) / ratio**2
        names = ("exact", "approximate", "approximate_total")
        return found | {"flywheel": {"inertia": None} | dict.fromkeys(names, size), "simulation": None}
    eps = swing / (real(wheel["inertia"]) * ratio**2 * speed**2)
    run = {"irregularity": eps, "speed_max": speed * (1 + eps / 2), "speed_min": speed * (1 - eps / 2)}
    return found | {"flywheel": {"inertia": real(wheel["inertia"])}, "simulation": run}


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


def apart(mine: Any, known: Any, scale: float = 0.0) -> float:
    """The greatest relative difference of two trees of figures, small ones against their scale; inf where not alike."""
    if isinstance(known, dict):
        if mine.keys() != known.keys():
            return float("inf")
        scale = float(known.get("work_exchanged") or known.get("max") or known.get("approximate_total") or scale)
        by = {"to": 1.0, "from": 1.0, "cycle": 1.0, "areas": scale}
        return max((apart(mine[k], known[k], by.get(k, scale)) for k in known), default=0.0)
    if isinstance(known, list):
        return (
            max(map(lambda a, b: apart(a, b, scale or 1.0), mine, known), default=0.0) if len(mine) == len(known) else np.inf
        )
    if known is None or isinstance(known, bool) or known.endswith(".toml"):
        return 0.0 if mine == known else float("inf")
    return float(abs(mp.mpf(mine) - mp.mpf(known)) / max(abs(mp.mpf(known)), scale * 1e-3, mp.mpf("1e-30")))


def main(arguments: list[str]) -> int:
    """Compute the named scenes, or all, and write the file, or tell how far it is from them."""
    target, wanted = HERE / "references.json", [a for a in arguments if a != "--check"]
    known = {r["scene"]: r for r in json.loads(target.read_text())}
    names = sorted(path.name for path in (HERE / "scenes").glob("*.toml"))
    worst = 0.0
    for name in names:
        if wanted and name.removesuffix(".toml") not in wanted:
            continue
        found = computed(HERE / "scenes" / name)
        if "--check" in arguments:
            worst = max(worst, gap := apart(found, known[name]))
            print(f"{name}: {gap:.1e}", flush=True)
            continue
        known[name] = found
        target.write_text(json.dumps([known[n] for n in names if n in known], indent=1, ensure_ascii=False) + "\n")
    return int(worst > 1e-17)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
