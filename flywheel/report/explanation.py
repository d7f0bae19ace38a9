"""The explanation of a sizing in plain text."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from flywheel.numerics.budget import LIBRARIES, NOT, NOW, PARTS
from flywheel.numerics.units import columns, figure
from flywheel.report.rows import wrapped

if TYPE_CHECKING:
    from flywheel.study.explanation import Explanation


def text(explanation: Explanation) -> str:
    """The whole explanation, at most 100 columns wide."""
    blocks = [
        _listed(f"How it was worked out ({explanation.sizing.accuracy})", _done(explanation)),
        _listed("What the torques depend on", explanation.because),
        _listed("Not modelled, as this scene or this level does not need it", explanation.not_modelled),
        _listed("What takes more than a smooth machine would", explanation.forced),
        _listed("Libraries", _libraries(explanation)),
        _costs(explanation),
    ]
    return "\n\n".join("\n".join(lines) for lines in blocks if lines) + "\n"


def _listed(title: str, rows: Iterable[str]) -> list[str]:
    lines = [line for row in rows for line in _item(row)]
    return [title, *lines] if lines else []


def _item(row: str) -> list[str]:
    first, *rest = wrapped(row, "    ")
    return [f"  - {first[4:]}", *rest]


def _done(explanation: Explanation) -> list[str]:
    return [f"figures: {explanation.formulation}", f"motion: {explanation.motion}"]


def _libraries(explanation: Explanation) -> list[str]:
    """Libraries by name, and the parts of the package that this run has loaded, or done without."""
    states = explanation.imports
    found = [", ".join(f"{name} {states[name]}" for name in LIBRARIES)]
    for state, told in ((NOW, "parts of the package loaded"), (NOT, NOT)):
        titles = [title for name, title in PARTS.items() if name not in LIBRARIES and states[name] == state]
        found += [f"{told}: {'; '.join(titles)}"] if titles else []
    return found


def _costs(explanation: Explanation) -> list[str]:
    """What every level costs, its own as measured."""
    rows, own = [], explanation.sizing.accuracy
    for level, cost in explanation.costs.items():
        times = explanation.times(level)
        told = "" if times is None else "1" if level == own else figure(times, 0.0, 2)
        rows.append((level, str(cost.evaluations), told, "measured" if level == own else "foretold"))
    header = ("", "evaluations", "times as long", "")
    title = "What each level of accuracy costs, loading of libraries left out (foretold times are rough)"
    return [title, *columns(rows, header)]
