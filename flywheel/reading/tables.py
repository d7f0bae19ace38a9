"""Tables of numbers against angle: read into SI, checked for order, and fitted to the span they must cover."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.advice import show
from flywheel.reading.fields import Faults, Fields, as_table, items, read_fields
from flywheel.reading.schema import TABLE
from flywheel.scene import Table
from flywheel.units import QuantityError, Unit, convert, parse_unit, plain_number

Array = NDArray[np.float64]
Window = tuple[float, float]

TOLERANCE = 1e-9
"""Share of a period by which an angle may miss its end, onto which it is then put exactly."""
_REPORTED = 5


def read_table(
    raw: object, dimension: str | None, path: str, folder: Path | None, faults: Faults, along: str = "angle"
) -> Table | None:
    """A table in SI whose angles ascend; `dimension` is that of its values, `along` that of its angles.

    Along a stroke that slides the "angles" are lengths. None after noting what is wrong with it.
    """
    before = len(faults)
    mapping = as_table(raw, path, faults)
    if mapping is None:
        return None
    fields = read_fields(mapping, TABLE.keys, path, faults)
    if along == "length":
        fields["angle_unit"] = mapping.get("angle_unit", "m")
    units = _units(fields, (along, dimension), path, faults)
    columns = _columns(mapping, fields, path, folder, faults)
    if columns is None or units is None or len(faults) > before:
        return None
    angle = _converted(columns[0], units[0], f"{path}.angle", faults)
    value = _converted(columns[1], units[1], f"{path}.value", faults)
    if angle is None or value is None or not _ascends(angle, path, faults):
        return None
    return Table(angle, value, fields["interpolation"])


def _units(fields: Fields, dimensions: tuple[str, str | None], path: str, faults: Faults) -> tuple[Unit, Unit] | None:
    """Units of angles and values; values are SI unless the scene says otherwise."""
    found = []
    for key, expected in zip(("angle_unit", "value_unit"), dimensions, strict=True):
        text = fields[key]
        if text is None:
            found.append(Unit())
        elif not isinstance(text, str):
            faults.add(f"{path}.{key}", show(text), "a text that names a unit")
        else:
            try:
                found.append(parse_unit(text, expected))
            except QuantityError as error:
                faults.add(f"{path}.{key}", error.found, error.expected, error.advice)
    return (found[0], found[1]) if len(found) == 2 else None


def _columns(
    raw: Mapping[str, Any], fields: Fields, path: str, folder: Path | None, faults: Faults
) -> tuple[Sequence[float | str], Sequence[float | str]] | None:
    """Angles and values as numbers or decimal texts, from the file or from the scene itself."""
    inline = [key for key in ("angle", "value") if key in raw]
    if "file" in raw and not inline:
        from flywheel.reading.csv_rows import read_columns  # only scenes with a file pay for its reader

        return read_columns(raw["file"], raw.get("column"), folder, path, faults)
    if "file" in raw or len(inline) != 2 or "column" in raw:
        given = [key for key in ("file", "column", "angle", "value") if key in raw]
        faults.add(path, " and ".join(given) or "neither", "either file (and column), or angle and value")
        return None
    angle, value = (listed_numbers(fields[key], f"{path}.{key}", faults) for key in ("angle", "value"))
    if angle is None or value is None:
        return None
    if len(angle) != len(value):
        faults.add(path, f"{len(angle)} angles and {len(value)} values", "as many of the one as of the other")
        return None
    return angle, value


def listed_numbers(raw: object, path: str, faults: Faults) -> list[float] | None:
    """A list of finite numbers; None after noting what is wrong with it."""
    found = items(raw)
    if found is None:
        faults.add(path, show(raw), "a list of numbers")
        return None
    return numbers(found, path, faults)


def numbers(found: Sequence[object], path: str, faults: Faults) -> list[float] | None:
    """Finite floats of a list; the first few that are none are noted, each with its index."""
    plain = [plain_number(item) for item in found]
    wrong = [i for i, number in enumerate(plain) if number is None or not math.isfinite(number)]
    for i in wrong[:_REPORTED]:
        faults.add(f"{path}[{i}]", show(found[i]), "a finite number")
    if len(wrong) > _REPORTED:
        faults.add(path, f"{len(wrong) - _REPORTED} more like these", "finite numbers")
    return None if wrong else [number for number in plain if number is not None]


def _converted(column: Sequence[float | str], unit: Unit, path: str, faults: Faults) -> Array | None:
    """A column in SI, each number rounded once."""
    try:
        return np.array([convert(number, unit) for number in column])
    except QuantityError as error:
        faults.add(path, error.found, error.expected)
        return None


def _ascends(angle: Array, path: str, faults: Faults) -> bool:
    """Whether there are rows enough, in ascending order; two equal angles inside are a jump."""
    if angle.size < 2:
        faults.add(path, f"{angle.size} rows", "at least 2")
        return False
    steps = np.diff(angle)
    back = np.flatnonzero(steps < 0)
    triple = np.flatnonzero((steps[1:] == 0) & (steps[:-1] == 0))
    if back.size:
        row = int(back[0]) + 2
        faults.add(path, f"an angle in row {row} that is less than the one before", "angles that ascend")
    elif triple.size:
        faults.add(path, f"three equal angles from row {int(triple[0]) + 1}", "two at most: a jump")
    elif steps[0] == 0 or steps[-1] == 0:
        where = "first" if steps[0] == 0 else "last"
        advice = "ends that differ make a jump at the seam"
        faults.add(path, f"a jump at the {where} row", "jumps between other rows", advice)
    else:
        return True
    return False


def fit_period(table: Table, every: float, path: str, faults: Faults) -> Table | None:
    """The table put exactly onto its period, or a fault if it does not span it."""
    span = float(table.angle[-1] - table.angle[0])
    if abs(span - every) > TOLERANCE * every:
        faults.add(path, _spans(table), f"a span of {_angle(every)}, after which the load repeats", _in_degrees(span, every))
        return None
    return _within_reach(_moved_ends(table, None, float(table.angle[0]) + every), every, path, faults)


def fit_window(table: Table, window: Window, every: float, path: str, faults: Faults) -> Table | None:
    """The table of a load that acts in a window: it must cover the window, or span the whole period."""
    span = float(table.angle[-1] - table.angle[0])
    if abs(span - every) <= TOLERANCE * every:
        return fit_period(table, every, path, faults)
    start, end = window[0], window[1] + (every if window[1] < window[0] else 0.0)
    slack = TOLERANCE * every
    shift = every * math.floor((float(table.angle[-1]) + slack - end) / every)
    first, last = start + shift, end + shift
    if span > every or float(table.angle[0]) > first + slack:
        wanted = f"{_angle(start)} to {_angle(end)} (its load's window), or {_angle(every)} in all"
        faults.add(path, _spans(table), wanted, _in_degrees(span, every))
        return None
    near_first, near_last = abs(table.angle[0] - first) <= slack, abs(table.angle[-1] - last) <= slack
    table = _moved_ends(table, first if near_first else None, last if near_last else None)
    return _within_reach(table, every, path, faults)


def fit_stroke(table: Table, window: Window, path: str, faults: Faults) -> Table | None:
    """The table of a load that acts once, from one end of a window to the other: it must cover that."""
    slack = TOLERANCE * (window[1] - window[0])
    first, last = float(table.angle[0]), float(table.angle[-1])
    if first > window[0] + slack or last < window[1] - slack:
        found = f"values from {first:.10g} to {last:.10g}"
        faults.add(path, found, f"values from {window[0]:.10g} to {window[1]:.10g}, all along its load")
        return None
    return table


def _moved_ends(table: Table, first: float | None, last: float | None) -> Table:
    """The table with its end rows put exactly where they nearly are."""
    angle = table.angle.copy()
    if first is not None:
        angle[0] = min(first, angle[1])
    if last is not None:
        angle[-1] = max(last, angle[-2])
    return table._replace(angle=angle)


def _within_reach(table: Table, every: float, path: str, faults: Faults) -> Table | None:
    """The table, unless it begins more than a period away from angle 0."""
    if abs(table.angle[0]) <= every * (1 + TOLERANCE):
        return table
    faults.add(path, _spans(table), f"a first angle between {_angle(-every)} and {_angle(every)}")
    return None


def _spans(table: Table) -> str:
    return f"angles from {_angle(float(table.angle[0]))} to {_angle(float(table.angle[-1]))}"


def _in_degrees(span: float, every: float) -> str:
    """The advice for angles in radians that would fit if they were degrees."""
    return 'write angle_unit = "deg"' if every < span <= math.degrees(every) * (1 + TOLERANCE) else ""


def _angle(angle: float) -> str:
    """An angle as a designer reads it."""
    return f"{math.degrees(angle):.10g} deg"
