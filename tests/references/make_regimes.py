"""Write regimes.json: steady motions of the machines of tests/regimes.py, by the oracle with 36 digits.

Run by hand, from the root of the project: `python -m tests.references.make_regimes [--check] [NAME ...]`. With `--check`
nothing is written: the greatest difference from the file is printed. The file's figures came from shooting with an
extrapolated midpoint rule at 30 digits, so that this compares two routes. The motor with inductance, the run-ups and the
multipliers stay as that rule gave them: `test_regimes.py` holds them against equations written by hand.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any

if __name__ == "__main__":  # before the oracle is imported; whoever imports this keeps the digits that there are
    os.environ.setdefault("ORACLE_DIGITS", "36")

import numpy as np
from mpmath import mp  # type: ignore[import-untyped]

from tests.oracle import figures, panels, regimes
from tests.oracle import regimes as motions
from tests.oracle.machine import Machine
from tests.oracle.numbers import Real
from tests.regimes import CASES, REFERENCES, scene

DIGITS = 18


def machine_of(name: str, **flywheel: Any) -> tuple[Machine, Any]:
    """A case's machine, and the ratio of its flywheel's shaft."""
    machine = Machine(scene(name, **flywheel))
    return machine, machine.shafts[CASES[name].on]


def analysed(name: str, reference: dict[str, Any], kind: str, key: str) -> dict[str, Any]:
    """A motion near the one that is known, with a given flywheel or an irregularity."""
    machine, ratio = machine_of(name, **{"inertia" if kind == "analysis" else "irregularity": float(key)})
    speed, wheel, unknown = Real(reference["speed"]), Real(reference["inertia"]) * ratio**2, Real(reference["balance"] or 0)
    request = speed if machine.balanced else None
    around = (1 + Real("1e-5")) * speed
    guess = motions.Guess(speed, wheel, unknown, lambda phi: np.full(phi.shape, float(around)))
    motion = motions.found(machine, motions.Held(wheel, None, request), guess)
    if kind == "sizing":  # from a flywheel that is not the one asked for
        guess = motions.Guess(speed, wheel * (1 + Real("1e-4")), unknown, motion.pace)
        motion = motions.found(machine, motions.Held(None, Real(float(key)), request), guess)
    high, low = motion.excess
    half = motion.mesh.half
    result = motion.w * np.array([(1 + (high + low) / 2), 1 + high, 1 + low])
    speeds = motion.w * np.frompyfunc(mp.sqrt, 1, 1)(1 + motion.state.nodes)
    time, angles = panels.integrals(1 / speeds, half).sum(), motion.places.angles(motion.mesh)
    return {
        "inertia": motion.state.inertia / ratio**2, "irregularity": (high - low) / (1 + (high + low) / 2),
        "speed": result[0], "speed_max": result[1], "speed_min": result[2],
        "angle_speed_max": angles[motion.s.argmax()], "angle_speed_min": angles[motion.s.argmin()],
        "speed_time_mean": motion.mesh.edges[-1] / time, "period": time,
        "balance": motion.state.unknown if machine.balanced else None,
        "speed_at_zero": motion.w * mp.sqrt(1 + motion.state.edges[0]),
    }  # fmt: skip


def at_constant_speed(name: str, reference: dict[str, Any]) -> dict[str, Any]:
    """Figures at a constant speed: the speed, the balance, the areas' extremes, the flywheels."""
    machine, _ = machine_of(name, inertia=0)
    speed = Real(reference["speed"])
    if not machine.balanced:
        speed = regimes.constant_speed(machine, speed)
    cycle = regimes.constant_cycle(machine, speed, Real(reference["balance"] or 0))
    (least, most), works = figures.extremes_of_inertia(cycle), figures.works(cycle)
    frozen = {repr(e): figures.inertias(cycle, speed, Real(e))["exact"] for e in CASES[name].irregularities}
    return {
        "speed": speed, "balance": cycle.unknown if machine.balanced else None,
        "accumulated_max": max(works["accumulated_max"], Real(0)), "accumulated_min": min(works["accumulated_min"], Real(0)),
        "work_exchanged": cycle.exchanged, "drive_work": cycle.drive_work, "inertia_min": least, "inertia_max": most,
        "frozen": frozen,
    }  # fmt: skip


def texts(figures: dict[str, Any]) -> dict[str, Any]:
    """Numbers as decimal texts."""
    return {k: texts(v) if isinstance(v, dict) else v if v is None else mp.nstr(v, DIGITS) for k, v in figures.items()}


def differences(result: dict[str, Any], reference: dict[str, Any]) -> dict[str, float]:
    """Differences of every figure from the file, relative to it or, of an energy, to the work exchanged."""
    scale = mp.mpf(reference.get("work_exchanged", 0))
    whole = dict.fromkeys(("accumulated_max", "accumulated_min", "drive_work"), scale)
    gaps = {}
    for key, value in result.items():
        if isinstance(value, dict):
            gaps |= {f"{key} {k}": gap for k, gap in differences(value, reference[key]).items()}
        elif value is not None:
            true = mp.mpf(reference[key])
            gaps[key] = float(abs(mp.mpf(value) - true) / max(abs(true), whole.get(key, 0), mp.mpf("1e-30")))
    return gaps


def main(arguments: list[str]) -> int:
    """Compute the named cases, or all, and write the file, or tell how far it is from them."""
    reference = json.loads(REFERENCES.read_text())
    worst = 0.0
    for name in [a for a in arguments if a != "--check"] or [n for n in CASES if n != "dc-inductance"]:
        for kind in ("analysis", "sizing"):
            for key, old in reference[name][kind].items():
                result = texts(analysed(name, old, kind, key))
                gaps = differences(result, old)
                worst = max(worst, *gaps.values())
                print(name, kind, key, f"{max(gaps.values()):.1e} ({max(gaps, key=lambda k: gaps[k])})", flush=True)
                reference[name][kind][key] = old | result
        if "constant" in reference[name]:
            result = texts(at_constant_speed(name, reference[name]["constant"]))
            gaps = differences(result, reference[name]["constant"])
            worst = max(worst, *gaps.values())
            print(name, "constant", f"{max(gaps.values()):.1e} ({max(gaps, key=lambda k: gaps[k])})", flush=True)
            reference[name]["constant"] |= result
    if "--check" not in arguments:
        REFERENCES.write_text(json.dumps(reference, indent=1) + "\n")
    return int(worst > 1e-15)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
