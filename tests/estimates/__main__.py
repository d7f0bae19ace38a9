"""Run random scenes and tell what their estimates are worth."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from itertools import count

import numpy as np

from tests.estimates.checking import FLOOR, PROVEN, Outcome, outcome
from tests.estimates.ranges import ranged

SPAN = 1_000_000  # seeds of scenes belong to a seed of runs by this


def run(wanted: int, seed: int, accuracy: str = "normal") -> Iterator[Outcome]:
    """Outcomes until so many scenes were compared."""
    done = 0
    for k in count():
        result = outcome(SPAN * seed + k, accuracy)
        done += result.counts
        yield result
        if done >= wanted:
            return


def ratios(found: list[Outcome]) -> dict[str, np.ndarray]:
    """Estimate over true error, figure by figure."""
    pairs: dict[str, list[float]] = {}
    for row in (row for item in found for row in item.rows if not row.name.startswith(PROVEN)):
        name = row.name.split()[-1] if row.name.startswith("area ") else row.name
        pairs.setdefault(name, []).append(row.estimate / max(row.true, FLOOR))
    return {name: np.array(values) for name, values in sorted(pairs.items())}


def summary(found: list[Outcome]) -> str:
    """Result of a run, in a few lines."""
    sized = [item for item in found if item.counts]
    lost = [item.seed for item in found if item.lost]
    lines = [f"{len(sized)} scenes ({sum(i.moving for i in sized)} with torques that depend on speed), "]
    lines[0] += (
        f"{sum(len(i.rows) for i in sized)} figures; beside them {sum(i.refused is not None for i in found)} refused, "
    )
    lines[0] += f"{len(lost)} without a reference {lost or ''}"
    if proven := sum(item.proven for item in sized):
        inside = sum(row.kept for item in sized for row in item.rows if row.name.startswith(PROVEN))
        lines.append(f"{proven} scenes proven, {inside} true values inside their intervals")
    shares = ratios(found)
    if shares:
        shares["all"] = np.concatenate(list(shares.values()))
    for name, values in shares.items():
        least, middle, most = np.quantile(values, [0.0, 0.5, 1.0])
        lines.append(f"  {name:20s} {values.size:6d}  estimate/true: median {middle:8.3g}, {least:.3g} to {most:.3g}")
    bad = [item for item in found if item.faults]
    lines += [f"seed {item.seed}: {'; '.join(item.faults)}" for item in bad]
    return "\n".join([*lines, f"{len(bad)} scenes at fault"])


def shown(item: Outcome) -> str:
    """One scene, figure by figure."""
    rows = [f"{r.name:24s} true {r.true:9.3g}  estimate {r.estimate:9.3g}{'' if r.kept else '  <--'}" for r in item.rows]
    return "\n".join([f"seed {item.seed}" + (f", refused: {item.refused}" if item.refused else ""), *rows, *item.faults])


def over_ranges(wanted: int, seed: int) -> int:
    """Prints a run of scenes with numbers in ranges; exit status 1 where a design lies outside a proven interval."""
    outcomes = {k: one for k in range(SPAN * seed, SPAN * seed + 8 * wanted) if (one := ranged(k, motions=True)) is not None}
    widths = np.array([width for one in outcomes.values() for width in one.widths])
    middle, usual, most = np.quantile(widths, [0.5, 0.9, 1.0])
    print(
        f"{len(outcomes)} scenes, {widths.size} figures: width over that of designs {middle:.3g} at the median, "
        f"{usual:.3g} at 90 %, {most:.3g} at most; {(widths > 1.2).sum()} above 1.2"
    )
    bad = [f"seed {k}: {text}" for k, one in outcomes.items() for text in one.outside]
    print("\n".join([*bad, f"{len(bad)} figures outside"]))
    return int(bool(bad))


def main() -> int:
    """Exit status 1 where an estimate is below the true error."""
    parser = argparse.ArgumentParser(prog="python -m tests.estimates", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="scenes that are compared")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="the seed of one scene, as a run names it")
    parser.add_argument(
        "--against", choices=("proof",), help="hold the intervals of --accuracy proof against the reference too"
    )
    parser.add_argument(
        "--ranges", action="store_true", help="prove scenes with numbers in ranges instead, beside designs in them"
    )
    chosen = parser.parse_args()
    if chosen.ranges:
        return over_ranges(chosen.count, chosen.seed)
    accuracy = chosen.against or "normal"
    if chosen.only is not None:
        result = [outcome(chosen.only, accuracy)]
        print(shown(result[0]))
        return int(bool(result[0].faults))
    result, start = [], time.monotonic()
    for item in run(chosen.count, chosen.seed, accuracy):
        result.append(item)
        if item.faults or len(result) % 50 == 0:
            output = f"{len(result)} scenes, {time.monotonic() - start:.0f} s"
            print(output, f"seed {item.seed}: {'; '.join(item.faults)}" if item.faults else "", file=sys.stderr, flush=True)
    print(summary(result))
    return int(any(item.faults for item in result))


if __name__ == "__main__":
    sys.exit(main())
