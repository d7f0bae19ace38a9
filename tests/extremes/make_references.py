"""Write references.json: the figures of every case by the oracle with 60 digits, apart from the toolkit.

Run by hand, from the root of the project: `python -m tests.extremes.make_references [WORDS ...]`; with words, only the cases
whose names begin with one of them. A shaper whose pin all but meets the pivot loses twenty digits.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # before the oracle is imported; whoever imports this keeps the digits that there are
    os.environ.setdefault("ORACLE_DIGITS", "60")

from mpmath import mp  # type: ignore[import-untyped]

from tests.extremes.cases import Case, cases
from tests.oracle.figures import Cycle, cycle_of, extremes_of_inertia, inertias, works
from tests.oracle.machine import Machine
from tests.oracle.numbers import PI, Real

TARGET = Path(__file__).parent / "references.json"
DIGITS = 20


def figures(cycle: Cycle, speed: float, irregularity: float) -> dict[str, Any]:
    """Figures that a flywheel is compared by at one speed and irregularity; none is floored at 0."""
    result = inertias(cycle, Real(speed), Real(irregularity))
    sizes = {key: text(result[key]) for key in ("exact", "approximate_total", "inertia_torque")}
    return {"speed": speed, "irregularity": irregularity} | sizes


def text(value: Any) -> str:
    """A number as JSON holds it."""
    return str(mp.nstr(mp.mpf(value), DIGITS))


def spanning(scene: Any) -> Any:
    """The scene with its tables' last angles put exactly onto a turn, as the scene format has it."""
    if isinstance(scene, dict):
        whole = {key: spanning(item) for key, item in scene.items()}
        if "angle" in whole and "value" in whole:
            whole["angle"] = [*whole["angle"][:-1], whole["angle"][0] + 2 * PI]
        return whole
    return [spanning(item) for item in scene] if isinstance(scene, list) else scene


def computed(result: Case) -> dict[str, Any]:
    """The references of one case."""
    cycle = cycle_of(Machine(spanning(result.scene)))
    least, greatest = extremes_of_inertia(cycle)
    return {
        "balance": text(cycle.unknown),
        "exchanged": text(cycle.exchanged),
        "areas": len(works(cycle)["areas"]),
        "least": text(least),
        "greatest": text(greatest),
        "flywheels": [figures(cycle, *pair) for pair in result.asked],
    }


def main(words: list[str]) -> None:
    """Compute the cases named, or all, and write the file."""
    reference = json.loads(TARGET.read_text()) if TARGET.exists() else {}
    every = cases()
    for name, result in every.items():
        if not words or name.startswith(tuple(words)):
            reference[name] = computed(result)
            print(name, file=sys.stderr, flush=True)
            kept = {key: reference[key] for key in every if key in reference}
            TARGET.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
