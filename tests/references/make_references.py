"""Write references.json: the figures of every scene in scenes/, computed at 30 digits apart from the toolkit.

Run by hand, from the root of the project: `python -m tests.references.make_references [SCENE ...]`. Nothing here
imports `flywheel` or `bondgraph`; positions are differentiated, energies are summed, moments are virtual work.
With names of scenes, only those are computed anew. With `--check` first, nothing is written: the works and the mean
inertia in the file are compared with mpmath's own quadrature (tanh-sinh, where the file comes from Legendre series).
"""

from __future__ import annotations

import itertools
import json
import sys
import time
from pathlib import Path
from typing import Any

from mpmath import mp  # type: ignore[import-untyped]

from .figures import constant, references, share, summed
from .machine import Machine
from .tables import read_scene

HERE = Path(__file__).parent
DIGITS = 20


def written(value: Any) -> Any:
    """A figure as JSON holds it: numbers as decimal texts."""
    if isinstance(value, dict):
        return {key: written(item) for key, item in value.items()}
    if isinstance(value, list):
        return [written(item) for item in value]
    return value if value is None or isinstance(value, bool | str) else mp.nstr(mp.mpf(value), DIGITS)


def computed(path: Path) -> dict[str, Any]:
    """The references of one scene."""
    mp.dps = 45
    scene = read_scene(path)
    figures = summed(scene) if "areas" in scene else references(Machine(scene, path.parent))
    return {"scene": path.name, **written(figures)}


def discrepancy(path: Path, known: dict[str, Any]) -> Any:
    """The largest relative difference of a scene's works and mean inertia from mpmath's quadrature."""
    mp.dps = 30
    machine = Machine(read_scene(path), path.parent)
    unknown = mp.mpf(known["balance"] or 0)
    edges = sorted({*machine.breaks, *(mp.mpf(area["to"]) for area in known["areas"])})
    done, turned, worst = mp.zero, mp.zero, mp.zero
    sums = {mp.mpf(area["to"]): mp.mpf(area["accumulated"]) for area in known["areas"]}
    for a, b in itertools.pairwise(edges):
        sample = machine.piece((a + b) / 2)
        done += mp.quad(lambda phi, s=sample: constant(s(phi)) + unknown * share(s(phi)), [a, b])
        turned += mp.quad(lambda phi, s=sample: s(phi).inertia, [a, b])
        worst = max(worst, abs(done - sums.get(b, done)) / mp.mpf(known["work_exchanged"]))
    mean = mp.mpf(known["reduced_inertia"]["mean"])
    return max(worst, abs(turned / machine.cycle - mean) / (mean or 1))


def check(wanted: list[str]) -> None:
    """Print the discrepancy of the named scenes, or of all."""
    for known in json.loads((HERE / "references.json").read_text()):
        if "balance" in known and (not wanted or known["scene"].removesuffix(".toml") in wanted):
            print(known["scene"], mp.nstr(discrepancy(HERE / "scenes" / known["scene"], known), 3), flush=True)


def main(wanted: list[str]) -> None:
    """Compute the named scenes, or all, and write the file."""
    target = HERE / "references.json"
    known = {r["scene"]: r for r in json.loads(target.read_text())} if target.exists() else {}
    names = sorted(path.name for path in (HERE / "scenes").glob("*.toml"))
    for name in names:
        if not wanted or name.removesuffix(".toml") in wanted:
            start = time.perf_counter()
            known[name] = computed(HERE / "scenes" / name)
            print(f"{name}: {time.perf_counter() - start:.1f} s", file=sys.stderr)
            kept = [known[n] for n in names if n in known]
            target.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--check"]:
        check(sys.argv[2:])
    else:
        main(sys.argv[1:])
