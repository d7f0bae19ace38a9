"""Every way to a flywheel on three scenes, its true error and its time beside ours: one run, one Markdown table.

    python tests/benchmarks/bench_methods.py [--quick] [--budget SECONDS] [--exudyn PYTHON]

The scotch yoke of p.103 at 100 rad/s, a slider-crank press, and a slider-crank on a motor whose torque falls with its speed.
Rows are the toolkit's own methods as `flywheel tradeoff` measures them, those that tell most; then what people use today,
written out by hand without the toolkit (`by_hand`): a script over a dense grid, a root search over simulations by solve_ivp;
and Exudyn, a multibody code, on the slider-cranks, where a Python has it (PYTHON, or this one).

Errors are relative, against 30-digit values of the flywheel; times are ratios to our exact sizing at rtol 1e-9 (the
flywheel with its estimate, from a machine that is built). Whether the errors that `flywheel tradeoff` tells are those
against 30-digit values is printed too; where they differ by more than it allows for its reference, the run fails.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from decimal import Decimal
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[2]))

import flywheel
from flywheel import Tradeoff, tradeoff
from tests import regimes
from tests.benchmarks import by_hand

REFERENCES = Path(__file__).parents[1] / "references"
BUDGET, HURRIED = 80.0, 4.0  # seconds for a scene's methods
STEPS = 4000  # of Exudyn in a cycle
OURS = "exact 1e-09"
ROUNDING = 2.3e-16

METHODS = {
    "areas": "accumulated areas (I* constant)",
    "inertia torque": "inertia torque at constant speed",
    "grid 36": "plain grid, 36 angles",
    "grid 360": "plain grid, 360 angles",
    "grid 3600": "plain grid, 3600 angles",
    OURS: "**exact, rtol 1e-9**",
    "exact 1e-12": "**exact, rtol 1e-12**",
    "collocation 1e-09": "collocation, rtol 1e-9",
    "Euler 360": "Euler, 360 steps",
    "Euler 360 restarted": "Euler, 360 steps, restarted",
    "RK4 360": "RK4, 360 steps",
    "RK4 360 restarted": "RK4, 360 steps, restarted",
    "RK45 1e-06": "RK45, rtol 1e-6",
    "RK45 1e-06 restarted": "RK45, rtol 1e-6, restarted",
    "DOP853 1e-09": "DOP853, rtol 1e-9",
    "DOP853 1e-09 restarted": "DOP853, rtol 1e-9, restarted",
    "DOP853 1e-12 restarted": "DOP853, rtol 1e-12, restarted",
    "LSODA 1e-09": "LSODA, rtol 1e-9",
    "LSODA 1e-09 restarted": "LSODA, rtol 1e-9, restarted",
    "bond graph 1e-06": "whole bond graph, rtol 1e-6",
    "bond graph 1e-09": "whole bond graph, rtol 1e-9",
    "multipliers 0.0001 restarted": "Lagrange's multipliers, rtol 1e-4, restarted",
    "multipliers 1e-06 restarted": "Lagrange's multipliers, rtol 1e-6, restarted",
}
"""Labels of the toolkit's methods, and how they stand in the table."""
SIMULATIONS = {
    "by hand: root search over solve_ivp, its defaults": (by_hand.DEFAULTS, 1e-3),
    "by hand: root search over solve_ivp, DOP853, 1e-9": (by_hand.CAREFUL, 1e-9),
}
MULTIBODY = f"Exudyn, {STEPS} steps in a cycle, root search"
GRIDS = {f"by hand: grid of {count} angles, np.gradient": count for count in (3600, 100_000)}
ROWS = METHODS | {name: name for name in (*GRIDS, *SIMULATIONS, MULTIBODY)}


class Case(NamedTuple):
    """A scene, by its name in `by_hand`, and its true flywheel (kg m²)."""

    title: str
    name: str
    scene: flywheel.Scene
    true: Decimal


class Cell(NamedTuple):
    """A method on a scene: its flywheel (kg m²) and its time (s), or why there is neither."""

    value: float | None
    seconds: float | None
    reason: str = ""


class Column(NamedTuple):
    """A scene's cells by label; `scale` (kg m²) is what errors are relative to where the flywheel is smaller."""

    case: Case
    scale: float
    cells: dict[str, Cell]

    def error(self, value: float) -> float:
        """The relative error of a flywheel (kg m²), against 30 digits."""
        return float(abs(Decimal(value) - self.case.true) / max(self.case.true, Decimal(self.scale)))

    def texts(self, label: str) -> tuple[str, str]:
        """Error and ratio of time, as the table has them."""
        cell = self.cells.get(label)
        if cell is None or cell.value is None or cell.seconds is None:
            return "–", "–"
        error, ours = self.error(cell.value), self.cells[OURS].seconds or 1.0
        return "< 1e-15" if error < 1e-15 else f"{error:.0e}", rounded(cell.seconds / ours)


def rounded(ratio: float) -> str:
    """A ratio to two digits, without an exponent."""
    return f"{Decimal(f'{ratio:.2g}'):f}"


# -- the scenes ------------------------------------------------------------------------------------------------------------


def cases() -> list[Case]:
    """The three scenes."""
    references = {r["scene"]: r for r in json.loads((REFERENCES / "references.json").read_text())}
    result = []
    for title, name in (("scotch yoke of p.103, 100 rad/s", "yoke-100rad"), ("slider-crank press", "press")):
        true = Decimal(references[f"{name}.toml"]["flywheel"]["exact"])
        result.append(Case(title, name, flywheel.load(REFERENCES / "scenes" / f"{name}.toml"), true))
    true = Decimal(regimes.figures("section-c")["sizing"]["0.1"]["inertia"])
    scene = flywheel.load(regimes.scene("section-c", irregularity=0.1))
    return [*result, Case("torque falls with speed", "section-c", scene, true)]


# -- the ways --------------------------------------------------------------------------------------------------------------


def column(case: Case, budget: float, exudyn: str | None, quick: bool) -> Column:
    """All the ways on one scene."""
    told(f"{case.title}: the toolkit's methods")
    result = tradeoff(flywheel.Machine(case.scene), 1e-9, budget=budget)
    own = {row.label: Cell(row.value, row.seconds, row.reason or row.outcome) for row in result.rows}
    filled = Column(case, result.scale, own | dict(others(case, exudyn, quick)))
    check(filled, result)
    return filled


def others(case: Case, exudyn: str | None, quick: bool) -> Iterator[tuple[str, Cell]]:
    """Methods of other packages in use today."""
    script = by_hand.SCRIPTS[case.name]
    for name, count in GRIDS.items():
        yield name, run(partial(by_hand.by_grid, script, count), 1 if quick else 15)
    for name, (inputs, tolerance) in SIMULATIONS.items():
        told(f"{case.title}: {name}")
        yield name, run(partial(by_hand.by_simulation, script, inputs, tolerance), 1 if quick else 3)
    if exudyn is not None and case.name != "yoke-100rad":
        told(f"{case.title}: {MULTIBODY}")
        yield MULTIBODY, by_exudyn(exudyn, case.name)


def run(call: Callable[[], float], repeats: int) -> Cell:
    """A way's answer and its median time."""
    times, value = [], 0.0
    try:
        for _ in range(repeats):
            start = time.perf_counter()
            value = call()
            times.append(time.perf_counter() - start)
    except (ValueError, RuntimeError, IndexError) as error:
        return Cell(None, None, str(error))
    return Cell(value, statistics.median(times))


def by_exudyn(python: str, name: str) -> Cell:
    """Exudyn's answer, in a process of its own; its import is not timed."""
    program = [python, str(Path(__file__).with_name("by_exudyn.py")), name, str(STEPS)]
    try:
        done = subprocess.run(program, capture_output=True, text=True, timeout=180)
    except subprocess.TimeoutExpired:
        return Cell(None, None, "not done after 180 s")
    if done.returncode:
        return Cell(None, None, (done.stderr.strip().splitlines() or ["failed"])[-1])
    result: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return Cell(result["inertia"], result["seconds"])


# -- what comes of it ------------------------------------------------------------------------------------------------------


def check(filled: Column, result: Tradeoff) -> None:
    """Print how far the errors that `tradeoff` tells are from those against 30 digits; too far ends the run."""
    rows = [row for row in result.rows if row.value is not None and row.error is not None]
    apart, row = max((abs((row.error or 0.0) - filled.error(row.value or 0.0)), row) for row in rows)
    allowed = result.reference.doubt + ROUNDING * max(row.error or 0.0, 1.0)
    line = f"{filled.case.title}: errors told by tradeoff are at most {apart:.1e} from those against 30 digits"
    told(f"{line} ({row.name}); its reference allows {result.reference.doubt:.1e}")
    if apart > allowed:
        sys.exit("the errors that tradeoff tells are not true")


def told(line: str) -> None:
    """Say what is going on, beside the table."""
    print(line, file=sys.stderr, flush=True)


def table(columns: list[Column]) -> Iterator[str]:
    """The table's lines."""
    yield f"| method | {' | '.join(f'{column.case.title}: error | time' for column in columns)} |"
    yield f"| --- |{' --- | --- |' * len(columns)}"
    for label, name in ROWS.items():
        texts = [text for column in columns for text in column.texts(label)]
        if any(text != "–" for text in texts):
            yield f"| {name} | {' | '.join(texts)} |"


def missing(filled: Column) -> Iterator[str]:
    """Rows without an answer on a scene, by the reason."""
    reasons: dict[str, list[str]] = {}
    for label, name in ROWS.items():
        cell = filled.cells.get(label)
        if cell is not None and cell.value is None:
            reasons.setdefault(cell.reason, []).append(name)
    for reason, names in reasons.items():
        yield f"without an answer, {filled.case.title} ({reason}): {'; '.join(names)}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--budget", type=float)
    parser.add_argument("--exudyn", default=sys.executable if find_spec("exudyn") else None)
    options = parser.parse_args()
    budget = options.budget or (HURRIED if options.quick else BUDGET)
    if options.quick or options.exudyn is None:
        told("Exudyn is left out: --quick" if options.quick else "Exudyn is left out: no Python that has it was given")
    begun = time.perf_counter()
    columns = [column(case, budget, None if options.quick else options.exudyn, options.quick) for case in cases()]
    print("\n".join(table(columns)))
    print("\nOur exact sizing at rtol 1e-9, which is 1:", end=" ")
    print(", ".join(f"{filled.case.title} {1e3 * (filled.cells[OURS].seconds or 0.0):.2f} ms" for filled in columns))
    print("\n".join(["", *(line for filled in columns for line in missing(filled))]))
    told(f"{time.perf_counter() - begun:.0f} s in all")


if __name__ == "__main__":
    main()
