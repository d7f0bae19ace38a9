"""Draw scenes, try each on every route, and count what becomes of them.

    python -m tests.generated --seed 1 --scenes 200

Scenes `1000000 SEED` and those that follow are drawn, with `--special` those of duties, strokes, models of a stroke, steps
of a start, friction in joints, limits of heat and current, in a numbering of their own, with `--strokes` those of machines
with clutch and brake, with `--rounded` those with the numbers of a textbook, some of which cannot be assembled. On the
route `accuracy` figures at a loose accuracy are compared with those at a close one, on `proof` proven intervals with the
figures of the sizing. Every defect is printed with its number, and makes the exit code 1; `--only N` draws one scene,
prints it and all that is said of it.
"""

from __future__ import annotations

import argparse
import collections
import multiprocessing
import pprint
import time
from typing import Any

from tests.generated import identities
from tests.generated.judging import DEFECTS, PROOF, ROUTES, Verdict, judged
from tests.generated.rounded import rounded
from tests.generated.scenes import drawn
from tests.generated.special import special
from tests.generated.strokes import drawn_strokes, tried_strokes

KINDS: dict[str, Any] = {"strokes": None, "special": special, "rounded": rounded}


def tried(seed: int, routes: tuple[str, ...] = ROUTES, kind: str = "") -> tuple[int, list[Verdict]]:
    """The verdicts on a scene by its number."""
    if kind == "strokes":
        return seed, tried_strokes(seed)
    if kind == "rounded":
        verdicts = judged(rounded(seed), routes)
        return seed, [v for v in verdicts if not (v.route == "load" and v.outcome == "untrue")]
    return seed, identities.tried(special(seed)) if kind else judged(drawn(seed), routes)


def table(verdicts: list[Verdict], scenes: int, seconds: float) -> str:
    """Table of scenes a minute, and their outcomes by route."""
    outcomes = ("right", "refused", "undecided", *DEFECTS)
    lines = [f"{scenes} scenes in {seconds:.0f} s, {60 * scenes / max(seconds, 1e-9):.0f} a minute"]
    routes = [r for r in ("load", *ROUTES, PROOF) if any(v.route == r for v in verdicts)]
    routes += sorted({v.route for v in verdicts} - set(routes))
    wide = max(map(len, routes), default=0) + 1
    lines.append(f"{'':{wide}}" + "".join(f"{name:>11}" for name in outcomes))
    for route in routes:
        counts = collections.Counter(v.outcome for v in verdicts if v.route == route)
        lines.append(f"{route:{wide}}" + "".join(f"{counts[name]:11}" for name in outcomes))
    computing = sum(v.seconds for v in verdicts), sum(v.oracle for v in verdicts)
    lines.append(f"{computing[0]:.0f} s of computing by the toolkit, {computing[1]:.0f} s by the oracle")
    return "\n".join(lines)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.generated", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1, help="scenes 1000000 SEED and those that follow")
    parser.add_argument("--scenes", type=int, default=100, help="number of scenes")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--routes", nargs="+", choices=(*ROUTES, PROOF), default=ROUTES, help="what each scene is tried on")
    parser.add_argument("--special", action="store_true", help="scenes of what meets the rest more seldom; on all routes")
    parser.add_argument("--strokes", action="store_true", help="scenes with clutch and brake")
    parser.add_argument("--rounded", action="store_true", help="scenes whose angles, ratios and laws coincide")
    parser.add_argument("--only", type=int, help="a single scene, shown with all that is said of it")
    request = parser.parse_args()
    routes, kind = tuple(request.routes), next((name for name in KINDS if getattr(request, name)), "")
    if request.only is not None:
        scene = drawn_strokes(request.only)[0] if kind == "strokes" else KINDS.get(kind, drawn)(request.only).scene
        pprint.pprint(scene, width=120, sort_dicts=False)
        for verdict in tried(request.only, routes, kind)[1]:
            took = f"({verdict.seconds:.2f} s, oracle {verdict.oracle:.2f} s)"
            print(f"{verdict.route}: {verdict.outcome} {took} {verdict.detail}")
        return
    first, begun, result = 10**6 * request.seed, time.monotonic(), list[Verdict]()
    with multiprocessing.Pool(request.jobs) as pool:
        numbers = range(first, first + request.scenes)
        rows = (
            pool.imap_unordered(_one, [(n, routes, kind) for n in numbers])
            if request.jobs > 1
            else map(_one, [(n, routes, kind) for n in numbers])
        )
        for seed, verdicts in rows:
            result += verdicts
            for v in verdicts:
                if v.outcome in DEFECTS:
                    print(f"--only {seed} {v.route}: {v.outcome} {v.detail}", flush=True)
    print(table(result, request.scenes, time.monotonic() - begun))
    if {v.outcome for v in result} & {*DEFECTS} - {"late"}:  # what is late is so on a slow machine
        raise SystemExit(1)


def _one(given: tuple[int, tuple[str, ...], str]) -> tuple[int, list[Verdict]]:
    return tried(*given)


if __name__ == "__main__":
    main()
