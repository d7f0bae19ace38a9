"""Write README.md beside this file: every extreme, how wrong the worst answer was, and what the program said of it.

Run by hand, from the root of the project: `python -m tests.extremes.report`. The rows are those that the tests assert on.
"""

from __future__ import annotations

import importlib
from pathlib import Path

from tests.extremes.measured import Row

HERE = Path(__file__).parent
HEADER = """# Extremes

Written by `python -m tests.extremes.report` from the rows that the tests of this folder assert on. An error is that of the
flywheel's inertia at an `rtol` of 1e-9, relative to the larger of the figure and its scale, unless the remark tells another;
the estimate is what the program itself states there. References have 30 digits and come from `make_references.py`
(geometry, virtual work and Legendre series in mpmath; nothing of the toolkit) or from closed forms.
"""
COLUMNS = "\n| extreme | tried | worst true error | estimate there | remark |\n| --- | --- | --- | --- | --- |\n"


def number(value: float | None) -> str:
    """A figure of the table."""
    return "" if value is None else f"{value:.1e}" if value else "0"


def line(row: Row) -> str:
    """One row of the table; a refusal is quoted."""
    refused = row.error is None and row.estimate is None
    said = f"refused: `{row.remark}`" if refused and row.remark else row.remark
    cells = [row.extreme, row.range, number(row.error), number(row.estimate), said]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"


def tables() -> str:
    """One table for every module of tests that has rows, under its title."""
    text = ""
    for path in sorted(HERE.glob("test_*.py")):
        module = importlib.import_module(f"{__package__}.{path.stem}")
        for title, results in getattr(module, "RESULTS", {}).items():
            text += f"\n## {title}\n{COLUMNS}" + "".join(map(line, results()))
    return text


if __name__ == "__main__":
    (HERE / "README.md").write_text(HEADER + tables(), encoding="utf-8")
