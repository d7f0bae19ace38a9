"""Printed solutions for comparison with ours: a file, JSON or TOML, with a table for each scene, named as the scene's file.

    [p103_1]
    source = "the course's answers, p. 103"
    remarks = [{ en = "The print writes ...", es = "El impreso escribe ..." }]

    [[p103_1.row]]
    what = { en = "Flywheel by the areas", es = "Volante por áreas" }
    figure = "flywheel.approximate"   # a path in `flywheel size --json`; with `at`, a field of `flywheel.reduce` there
    printed = "348.989"               # a text, so that its digits are known
    unit = "kg m²"
    misprint = { en = "...", es = "..." }   # where the print is wrong: why

`factor` multiplies our figure before it is compared (for a quantity that follows from it), `at` is a crank angle ("30 deg").
A printed figure agrees if ours, rounded or truncated to its digits, is equal: hand calculation does both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import ROUND_DOWN, Decimal, InvalidOperation
from pathlib import Path
from typing import Any, NamedTuple

from flywheel import language
from flywheel.language import text as _
from flywheel.numerics.faults import Fault, SceneError, suggestion
from flywheel.numerics.units import QuantityError, parse_quantity
from flywheel.regime.state import reduce
from flywheel.report.document import Cell, Note, Part, Section, Table
from flywheel.report.formulas import Quantity
from flywheel.sizing.results import Sizing

_NO_FIGURE = 1e-12  # of the greatest figure of a unit
_KEYS = {"what", "figure", "printed", "unit", "at", "factor", "misprint"}


class PrintedFigure(NamedTuple):
    """One figure of a printed solution: its name, the path of this package, and the printed text."""

    what: str
    figure: str
    printed: str
    unit: str = ""
    at: float | None = None
    factor: float = 1.0
    misprint: str = ""


class PrintedSolution(NamedTuple):
    """A printed solution of a scene, in the language in use."""

    rows: tuple[PrintedFigure, ...]
    source: str = ""
    remarks: tuple[str, ...] = ()


def solution(path: str | Path, scene: str | Path) -> PrintedSolution:
    """The printed solution of a scene's file, from a file of solutions, in the language in use.

    Raises:
        SceneError: if the file cannot be read, does not contain that scene, or is not valid.

    """
    import json
    import tomllib

    place, expected = Path(path), "a file of solutions, JSON or TOML"
    try:
        text = place.read_text("utf-8")
        tables = json.loads(text) if place.suffix.lower() == ".json" else tomllib.loads(text)
    except OSError as error:
        raise SceneError([Fault(str(path), f"a file that cannot be read ({error.strerror})", expected)]) from None
    except ValueError as error:
        raise SceneError([Fault(str(path), f"what is no such file ({error})", expected)]) from None
    name = Path(scene).stem
    table = tables.get(name) if isinstance(tables, dict) else None
    if not isinstance(table, dict):
        hint = suggestion(name, list(tables)) if isinstance(tables, dict) else ""
        raise SceneError([Fault(str(path), f"no table {name!r}", "one named as the scene's file", hint)])
    rows, faults = [], []
    for k, entry in enumerate(table.get("row", [])):
        here = f"{name}.row[{k}]"
        try:
            rows.append(_row(entry))
        except (KeyError, TypeError, ValueError, QuantityError, InvalidOperation) as error:
            faults.append(Fault(here, f"{error.args[0] if error.args else error}", "what, figure, printed as texts"))
    if faults:
        raise SceneError(faults)
    return PrintedSolution(
        tuple(rows), _translation(table.get("source", "")), tuple(map(_translation, table.get("remarks", ())))
    )


def _row(entry: Mapping[str, Any]) -> PrintedFigure:
    if unknown := sorted(set(entry) - _KEYS):
        raise ValueError(f"key {unknown[0]!r}")
    if not isinstance(entry["printed"], str) or not isinstance(entry["figure"], str):
        raise TypeError("printed or figure that is no text")
    Decimal(entry["printed"])
    at = entry.get("at")
    return PrintedFigure(
        what=_translation(entry["what"]),
        figure=entry["figure"],
        printed=entry["printed"],
        unit=str(entry.get("unit", "")),
        at=None if at is None else parse_quantity(at, "angle"),
        factor=float(entry.get("factor", 1.0)),
        misprint=_translation(entry.get("misprint", "")),
    )


def _translation(value: Any) -> str:
    """A text, or the one in the language in use from a table."""
    if isinstance(value, Mapping):
        return str(value.get(language.current(), value["en"]))
    if not isinstance(value, str):
        raise TypeError("a text that is none")
    return value


def ours(sizing: Sizing, row: PrintedFigure) -> float | None:
    """The computed figure of a row, or None if there is none."""
    if row.at is None:
        tables: Any = sizing.as_dict()
    else:
        state = reduce(sizing.machine or sizing.scene, [row.at])
        tables = {
            **{name: float(value[0]) for name, value in zip(state._fields[1:4], state[1:4], strict=True)},
            **{part: {key: float(v[0]) for key, v in getattr(state, part).items()} for part in state._fields[4:]},
        }
    own = _within(tables, row.figure)
    if isinstance(own, bool) or not isinstance(own, int | float) or not math.isfinite(own):
        return None
    return own * row.factor


def _within(tables: Any, path: str) -> Any:
    """A value by its path: keys joined by dots, which may contain dots themselves; items of lists from 0."""
    if not path:
        return tables
    if isinstance(tables, Sequence) and not isinstance(tables, str):
        place, _dot, rest = path.partition(".")
        return _within(tables[int(place)], rest) if place.isdecimal() and int(place) < len(tables) else None
    if not isinstance(tables, Mapping):
        return None
    for key, inner in tables.items():
        if path == key or path.startswith(f"{key}."):
            return _within(inner, path[len(key) + 1 :])
    return None


def meets(printed: str, value: float) -> bool:
    """Tests whether ours has the printed digits: rounded to them, or (after a decimal point) truncated to them.

    >>> meets("27", 27.0095), meets("-60", -60.76), meets("678.22", 678.2297), meets("7.72767", 7.727687)
    (True, False, True, False)
    """
    ours, print_ = Decimal(value), Decimal(printed)
    digit = Decimal(1).scaleb(int(print_.as_tuple().exponent))
    cut = digit < 1 and ours.quantize(digit, ROUND_DOWN) == print_
    return abs(ours - print_) <= digit / 2 or cut


def _whole(value: float, row: PrintedFigure, rows: Sequence[PrintedFigure], values: Sequence[float | None]) -> float:
    """A figure, or 0 if it is only rounding compared with others of its unit."""
    beside = [abs(other or 0.0) for one, other in zip(rows, values, strict=True) if one.unit == row.unit]
    return 0.0 if abs(value) <= _NO_FIGURE * max(beside) else value


def section(sizing: Sizing, printed: PrintedSolution) -> Section:
    """Section with printed figures, ours, and misprints."""
    rows: list[tuple[Cell, ...]] = []
    misprints: list[str] = []
    own_values = [ours(sizing, row) for row in printed.rows]
    for row, value in zip(printed.rows, own_values, strict=True):
        own: Cell = _("not found") if value is None else Quantity("", _whole(value, row, printed.rows, own_values), "", 7)
        if row.misprint and row.misprint not in misprints:
            misprints.append(row.misprint)
        if value is None:
            verdict = _("no computed figure")
        elif row.misprint:
            verdict = _("misprint [{n}]", n=misprints.index(row.misprint) + 1)
        else:
            verdict = _("agrees") if meets(row.printed, value) else _("differs")
        rows.append((row.what, language.number(row.printed).replace("-", "−"), own, row.unit, verdict))
    head = (_("figure"), _("printed"), _("ours"), _("unit"), _("verdict"))
    caption = _("Comparison with the printed solution") + (f": {printed.source}" if printed.source else "")
    parts: list[Part] = [Table(caption, head, tuple(rows), kind="printed")]
    for k, misprint in enumerate(misprints, 1):
        parts.append(
            Note(_("Misprint [{n}]: {why}. The computed figure is right.", n=k, why=misprint.rstrip(".")), "remark")
        )
    parts += [Note(remark) for remark in printed.remarks]
    return Section(_("The printed solution"), tuple(parts))
