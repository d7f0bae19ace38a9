"""Write references.json: the figures of every case at 30 digits, computed apart from the toolkit.

Run by hand, from the root of the project: `python -m tests.extremes.make_references [WORDS ...]`; with words, only the cases
whose names begin with one of them. The machines are those of `tests/references`, which imports nothing of the toolkit.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from mpmath import mp  # type: ignore[import-untyped]

from tests.references.figures import Cycle, wittenbauer
from tests.references.machine import Machine

from .cases import Case, cases

TARGET = Path(__file__).parent / "references.json"
DIGITS = 20


def figures(cycle: Cycle, speed: float, irregularity: float) -> dict[str, Any]:
    """What a flywheel at one speed and irregularity is compared by; nothing is floored at 0."""
    w, eps = mp.mpf(speed), mp.mpf(irregularity)
    works = [value for value, _ in cycle.values(mp.zero)] + [mp.zero]
    swaying = [value for value, _ in cycle.values(w**2 / 2)]
    return {
        "speed": speed,
        "irregularity": irregularity,
        "exact": text(wittenbauer(cycle, w, eps)),
        "approximate_total": text((max(works) - min(works)) / (eps * w**2)),
        "inertia_torque": text((max(swaying) - min(swaying)) / (eps * w**2)),
    }


def text(value: Any) -> str:
    """A number as JSON holds it."""
    return str(mp.nstr(mp.mpf(value), DIGITS))


def spanning(scene: Any) -> Any:
    """The scene with its tables' last angles put exactly onto a turn, as the scene format has it."""
    if isinstance(scene, dict):
        whole = {key: spanning(item) for key, item in scene.items()}
        if "angle" in whole and "value" in whole:
            whole["angle"] = [*whole["angle"][:-1], whole["angle"][0] + 2 * mp.pi]
        return whole
    return [spanning(item) for item in scene] if isinstance(scene, list) else scene


def computed(found: Case) -> dict[str, Any]:
    """The references of one case."""
    mp.dps = 60  # a shaper whose pin all but meets the pivot loses twenty digits
    cycle = Cycle(Machine(spanning(found.scene), Path()))
    least, greatest = cycle.inertia_extremes()
    return {
        "balance": text(cycle.unknown),
        "exchanged": text(cycle.exchange),
        "areas": len(cycle.areas()),
        "least": text(least),
        "greatest": text(greatest),
        "flywheels": [figures(cycle, *pair) for pair in found.asked],
    }


def main(words: list[str]) -> None:
    """Compute the cases named, or all, and write the file."""
    known = json.loads(TARGET.read_text()) if TARGET.exists() else {}
    every = cases()
    for name, found in every.items():
        if not words or name.startswith(tuple(words)):
            known[name] = computed(found)
            print(name, file=sys.stderr, flush=True)
            kept = {key: known[key] for key in every if key in known}
            TARGET.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
