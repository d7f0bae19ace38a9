"""Try thousands of mutants in processes of their own, and tell what became of them."""

import argparse
import time
from collections import Counter
from pathlib import Path

from tests.fuzzing.mutants import KINDS, Mutant, mutant
from tests.fuzzing.running import SCENES, Tried, again, all_tried, as_expected, tried, way_of

OUTCOMES = ("sized", "reduced", "refused", "failed")


def _table(found: list[Tried]) -> str:
    """Kinds against outcomes, the slowest, and every failure."""
    counts = Counter((each.kind, each.verdict.outcome) for each in found)
    lines = [f"{'kind':16s}" + "".join(f"{outcome:>9s}" for outcome in OUTCOMES)]
    lines += [f"{kind:16s}" + "".join(f"{counts[kind, outcome]:9d}" for outcome in OUTCOMES) for kind in KINDS]
    totals = Counter(each.verdict.outcome for each in found)
    lines.append(f"{'all':16s}" + "".join(f"{totals[outcome]:9d}" for outcome in OUTCOMES))
    ways = Counter("command" if each.way not in ("time", "library") else each.way for each in found)
    lines.append("tried by " + ", ".join(f"{way} {count}" for way, count in sorted(ways.items())))
    lines.append(f"largest memory {max(each.verdict.memory for each in found):.0f} MB above the beginning")
    late = sum(each.verdict.seconds > (2.0 if each.way == "library" else 5.0) for each in found)
    lines.append(f"{late} took longer than 2 s, or 5 s with time stepping or by a command; slowest:")
    slow = sorted(found, key=lambda each: -each.verdict.seconds)[:12]
    lines += [f"  {e.verdict.seconds:5.2f} s  {e.seed} {e.kind}, {e.way}: {e.verdict.outcome} {e.base}" for e in slow]
    bad = [each for each in found if each.verdict.outcome == "failed"]
    lines.append(f"{len(bad)} failures" + (":" if bad else ""))
    lines += [f"  --only {e.seed} {e.kind}, {e.way}, {e.base}: {e.verdict.detail}" for e in bad]
    return "\n".join(lines)


def _kept(found: Mutant, folder: Path) -> None:
    """A mutant's files, to be looked at."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_bytes(found.content)
    for name, content in found.files.items():
        (folder / name).write_bytes(content)


def _all_again() -> None:
    """Every scene that once failed, tried again."""
    for name in SCENES:
        outcome, detail, seconds, _ = again(name)
        mark = "" if as_expected(name, outcome, detail) else "NOT AS EXPECTED "
        print(f"{seconds:5.2f} s  {mark}{name}: {outcome} {detail[:60]}", flush=True)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzzing", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="how many mutants")
    parser.add_argument("--seed", type=int, default=1, help="mutants 1000000 SEED and those that follow")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--only", type=int, help="try a single mutant and show it")
    parser.add_argument("--keep", type=Path, help="a folder for the files of mutants that fail (with --only: of that one)")
    parser.add_argument("--kept", action="store_true", help="try every scene that once failed instead")
    request = parser.parse_args()
    if request.kept:
        _all_again()
        return
    if request.only is not None:
        result = mutant(request.only)
        content = result.content[:6000].decode("utf-8", "replace")
        print(f"{result.kind}, from {result.base}, by {way_of(request.only)}\n{content}")
        print(*(f"{name}: {content[:400]!r}" for name, content in result.files.items()), sep="\n")
        if request.keep:
            _kept(result, request.keep)
        print(tried(request.only).verdict)
        return
    start, so_far = time.monotonic(), list[Tried]()
    first = 10**6 * request.seed
    for each in all_tried(list(range(first, first + request.count)), request.jobs):
        so_far.append(each)
        if each.verdict.outcome == "failed":
            print(f"--only {each.seed} {each.kind}, {each.way}, {each.base}: {each.verdict.detail}", flush=True)
            if request.keep:
                _kept(mutant(each.seed), request.keep / str(each.seed))
        if len(so_far) % 500 == 0:
            print(f"{len(so_far)} tried in {time.monotonic() - start:.0f} s", flush=True)
    print(_table(so_far))


if __name__ == "__main__":
    main()
