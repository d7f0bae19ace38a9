"""Tables of numbers, CSV files, and the laws of efforts and positions: numbers, expressions or tables."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics.expressions import RESERVED, Expression, ExpressionError, parse
from flywheel.numerics.faults import nearest, quote, show, suggestion
from flywheel.numerics.units import DIMENSIONS, QuantityError, Unit, convert, middle_of, parse_range, product, split_quantity
from flywheel.reading.fields import (
    REPORTED,
    TOLERANCE,
    Faults,
    Item,
    SceneQuantity,
    Setting,
    as_table,
    read_item,
    read_unit,
    whole,
)
from flywheel.reading.schema import MOST_TURNS, TABLE
from flywheel.scene.scene import Output, Table

Array = NDArray[np.float64]
Window = tuple[float, float]


def read_table(
    raw: object, dimension: str | None, path: str, folder: Path | None, faults: Faults, along: str = "angle"
) -> Table | None:
    """A table in SI whose angles ascend; `dimension` is that of its values, `along` that of its angles.

    Along a stroke that slides the "angles" are lengths. None after noting its faults.
    """
    before = len(faults)
    mapping = as_table(raw, path, faults)
    if mapping is None:
        return None
    item = read_item(mapping, TABLE, path, faults)
    if along == "length":
        item.fields["angle_unit"] = mapping.get("angle_unit", "m")
    units = [read_unit(item, "angle_unit", along), read_unit(item, "value_unit", dimension)]
    columns = columns_of(item, ("angle", "value"), "neither", folder)
    if columns is not None and len(columns[0]) != len(columns[1]):
        defect = f"{len(columns[0])} angles and {len(columns[1])} values"
        faults.add(path, defect, "the same number of both")
    if columns is None or len(faults) > before:
        return None
    arrays: list[Array] = []
    for name, column, unit in zip(("angle", "value"), columns, units, strict=True):
        try:  # each number is rounded once
            arrays.append(_in_si(tuple(column), unit or Unit()))
        except QuantityError as error:
            faults.add(f"{path}.{name}", error.defect, error.expected)
    if len(faults) > before or not _ascends(arrays[0], path, faults):
        return None
    texts = [item.fields[f"{name}_unit"] or "" for name in ("angle", "value")]
    written = [[f"{number} {text}" for number in column] for column, text in zip(columns, texts, strict=True)]
    angle, value = arrays
    return Table(angle, value, item.fields["interpolation"], np.array(written))


@lru_cache(maxsize=32)
def _in_si(column: tuple[float | str, ...], unit: Unit) -> Array:
    """The numbers of a column in SI; the last columns are kept, because most edits of a scene leave its tables alone."""
    numbers = np.array([convert(number, unit) for number in column])
    numbers.flags.writeable = False
    return numbers


def columns_of(
    item: Item, names: tuple[str, str], nothing: str, folder: Path | None
) -> Sequence[Sequence[float | str]] | None:
    """Both columns of a table as numbers or decimal texts, from its file or from the scene itself; None after faults."""
    inline = item.present(*names)
    if "file" in item.raw and not inline:
        return read_columns(item.raw["file"], item.raw.get("column"), folder, item.path, item.faults)
    if "file" in item.raw or "column" in item.raw or len(inline) != 2:
        defect = " and ".join(item.present("file", "column", *names)) or nothing
        item.faults.add(item.path, defect, f"either file (and column), or {names[0]} and {names[1]}")
        return None
    columns = [item.fields[name] for name in names]
    return None if None in columns else columns


def _ascends(angle: Array, path: str, faults: Faults) -> bool:
    """Checks for enough rows in ascending order; two equal angles inside are a jump."""
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
    """The table fitted exactly to its period, or a fault if it does not span it."""
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
        expected = f"{_angle(start)} to {_angle(end)} (its load's window), or {_angle(every)} in all"
        faults.add(path, _spans(table), expected, _in_degrees(span, every))
        return None
    near_first, near_last = abs(table.angle[0] - first) <= slack, abs(table.angle[-1] - last) <= slack
    table = _moved_ends(table, first if near_first else None, last if near_last else None)
    return _within_reach(table, every, path, faults)


def fit_stroke(table: Table, window: Window, path: str, faults: Faults) -> Table | None:
    """The table of a load that acts once, from one end of a window to the other: it must cover that."""
    slack = TOLERANCE * (window[1] - window[0])
    first, last = float(table.angle[0]), float(table.angle[-1])
    if first > window[0] + slack or last < window[1] - slack:
        defect = f"values from {first:.10g} to {last:.10g}"
        faults.add(path, defect, f"values from {window[0]:.10g} to {window[1]:.10g}, all along its load")
        return None
    return table


def _moved_ends(table: Table, first: float | None, last: float | None) -> Table:
    """The table with its end rows moved exactly to the ends that they nearly reach."""
    angle = table.angle.copy()
    if first is not None:
        angle[0] = min(first, angle[1])
    if last is not None:
        angle[-1] = max(last, angle[-2])
    return replace(table, angle=angle)


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
    """An angle in words."""
    return f"{math.degrees(angle):.10g} deg"


# CSV files

LARGEST = 32 * 2**20
MOST_ROWS = 40_000
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def read_columns(
    name: object, column: object, folder: Path | None, path: str, faults: Faults
) -> tuple[list[str], list[str]] | None:
    """The angle's column and the chosen one, as checked decimal texts; None after noting a fault.

    name: the file's name as the scene has it; column: a name in the header, or a number from 1 (None: the second).
    """
    file = _find(name, folder, f"{path}.file", faults)
    text = None if file is None else _read(file, f"{path}.file", faults)
    if text is None:
        return None
    if (rows := len(text.splitlines())) > MOST_ROWS:
        faults.add(
            f"{path}.file", f"{rows} lines in {show(name)}", f"at most {MOST_ROWS}", "leave out points on a straight line"
        )
        return None
    lines = lines_of(text)
    named = lines and not torn_number(lines[0][1]) and not any(map(_NUMBER.fullmatch, lines[0][1]))
    header = lines.pop(0)[1] if named else None  # none of its fields is a number, however misspelt
    if not lines:
        faults.add(f"{path}.file", f"no rows of numbers in {show(name)}", "an angle and a value in every row")
        return None
    index = _column(column, header, len(lines[0][1]), f"{path}.column", faults)
    return None if index is None else _numbers(lines, header, index, f"{path}.file", faults)


def _find(name: object, folder: Path | None, path: str, faults: Faults) -> Path | None:
    """The file of a name, beside the scene; no file outside the scene's folder is ever opened."""
    if not isinstance(name, str) or not name:
        faults.add(path, show(name), "the name of a CSV file in the scene's folder")
        return None
    if folder is None:
        faults.add(path, show(name), "a scene that lies in a folder", "give the folder, or read the scene from its file")
        return None
    try:
        file = (folder / name).resolve()
        inside = not Path(name).is_absolute() and file.is_relative_to(folder.resolve())
        there = inside and file.is_file()
    except (OSError, ValueError, RuntimeError):
        inside = there = False
    if not inside:
        faults.add(path, show(name), "a file in the scene's own folder", _elsewhere(name))
    elif not there:
        advice = _elsewhere(name)
        if not advice:
            with suppress(OSError):  # the nearest name among the CSV files that are there
                advice = suggestion(file.name, [other.name for other in file.parent.glob("*.csv")][:1000])
        faults.add(path, f"no file {show(name)} in the scene's folder", "a CSV file", advice)
    return file if there else None


def _elsewhere(name: str) -> str:
    r"""The advice for a name that is a path on a disk, or that has escapes: "C:\new" contains a line's end."""
    spelt = name
    for sign, letter in zip("\n\t\r\b\f", "ntrbf", strict=True):
        spelt = spelt.replace(sign, f"\\{letter}")
    plain = spelt.replace("\\", "/")
    why = "between double quotes \\ begins an escape" if spelt != name else ""
    if re.match(r"[A-Za-z]:|[/~]", plain) and plain[-1] != "/":
        moved = f"put the file into the scene's folder and write {quote(plain.rpartition('/')[2])}"
        return f"{why}; {moved}" if why else moved
    return f"{why or 'write / for every backslash'}: {quote(plain)}" if plain != name else ""


def _read(file: Path, path: str, faults: Faults) -> str | None:
    """The file's text; too large, unreadable or not UTF-8 is a fault."""
    try:
        with file.open("rb") as stream:
            content = stream.read(LARGEST + 1)
    except OSError as error:
        faults.add(path, f"{quote(file.name)}, which cannot be read ({error.strerror})", "a readable file")
        return None
    if len(content) > LARGEST:
        faults.add(path, f"{quote(file.name)} of more than {LARGEST >> 20} MiB", "a smaller file")
        return None
    if is_utf16(content):
        faults.add(path, f"{quote(file.name)}, a text in UTF-16", "a CSV file in UTF-8", 'save it as "CSV UTF-8"')
        return None
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        faults.add(path, f"{quote(file.name)}, which is not UTF-8 text", "a CSV file in UTF-8")
        return None


def is_utf16(content: bytes) -> bool:
    """Tests whether a text of Latin letters is in UTF-16, by its mark or by every second byte of its beginning."""
    return re.match(rb"\xff\xfe|\xfe\xff|\0[^\0]\0[^\0]|[^\0]\0[^\0]\0", content) is not None


def lines_of(text: str) -> list[tuple[int, list[str]]]:
    """The lines with data: the number of each, from 1, and its fields, split by the separator that the last of them has.

    Separators between double quotes do not count.
    """
    kept = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1)]
    kept = [(i, line) for i, line in kept if line and not line.startswith("#")]
    separator = next((mark for mark in (";", "\t", ",") if kept and mark in kept[-1][1]), None)
    lines = []
    for i, line in kept:
        fields = line.split(separator) if '"' not in line else [line]
        if '"' in line:
            import csv  # a quoted header is the only thing that needs it

            with suppress(csv.Error):
                fields = next(csv.reader([line], delimiter=separator or " ", skipinitialspace=True))
        lines.append((i, [field.strip() for field in fields]))
    return lines


def torn_number(fields: Sequence[str]) -> bool:
    """Tests whether a field is a number with a decimal comma, or two numbers split by a decimal comma."""
    return any(re.fullmatch(r"[+-]?[0-9]+,[0-9]+|[0-9]+\s+[+-]?[0-9]+", field) for field in fields)


def _column(column: object, header: Sequence[str] | None, width: int, path: str, faults: Faults) -> int | None:
    """Index of the chosen column, from 0, by its name in the header or its number."""
    names = list(header or [])
    number = 2 if column is None else column
    if isinstance(column, str):
        if header is None:
            faults.add(path, show(column), "a number", "the file has no header that would name its columns")
        elif column not in names:
            faults.add(path, show(column), "the name of a column", suggestion(column, names[1:]))
        elif names.count(column) > 1 or names.index(column) == 0:
            faults.add(path, show(column), "the name of one column of values (the first column holds the angle)")
        else:
            return names.index(column)
    elif isinstance(number, bool) or not isinstance(number, (int, np.integer)):
        faults.add(path, show(column), "the name of a column or its number")
    elif not 2 <= number <= width:
        defect = f"column {number}" if column is not None else "a single column"
        faults.add(path, defect, f"a number from 2 to {width}" if width > 1 else "a column of values after the angles")
    else:
        return int(number) - 1
    return None


def _numbers(
    lines: list[tuple[int, list[str]]], header: Sequence[str] | None, index: int, path: str, faults: Faults
) -> tuple[list[str], list[str]] | None:
    """Both columns, after a check that every row has the right width and contains numbers."""
    width, wrong = len(header or lines[0][1]), 0
    for line, fields in lines:
        if len(fields) == width and _NUMBER.fullmatch(fields[0]) and _NUMBER.fullmatch(fields[index]):
            continue
        wrong += 1
        if wrong > REPORTED:
            continue
        where = f"in line {line}"
        if torn_number(fields):
            torn = next(field for field in fields if torn_number([field]))
            faults.add(path, f"{quote(torn)} {where}", "a number", "write 1.5, not 1,5")
        elif len(fields) != width:
            faults.add(path, f"{len(fields)} columns {where}", f"{width}, as in the line before the first row")
        else:
            bad = next(fields[i] for i in (0, index) if not _NUMBER.fullmatch(fields[i]))
            faults.add(path, f"{quote(bad)} {where}", "a number")
    if wrong > REPORTED:
        faults.add(path, f"{wrong - REPORTED} more rows like these", "rows of numbers")
    return None if wrong else ([fields[0] for _, fields in lines], [fields[index] for _, fields in lines])


# Laws: of efforts, and of positions

_WORDS = re.compile(r"\b(?:if|else|and|or|not)\b|[+(<>=]")


def read_effort(value: object, dimension: str, path: str, setting: Setting) -> float | Expression | None:
    """A force or torque: a number in SI, a quantity, or any other text as an expression; None after noting a fault."""
    middle = middle_of(value)
    parts = split_quantity(middle) if isinstance(middle, str) else None
    if isinstance(value, str):
        unit = "" if parts is None else parts[1] or DIMENSIONS[dimension].si
        if not re.match(r"[^\W\d_]|[%°,]|1\s*/", unit) or _WORDS.search(unit):
            return read_expression(value, path, setting)
    try:  # a text that is a number alone is SI, as it would be in an expression
        alone = parts is not None and isinstance(value, str) and value.strip() == parts[0]
        number = convert(parts[0], Unit()) if parts is not None and alone else parse_range(value, dimension)
    except QuantityError as error:
        advice = product(str(value), setting.names | RESERVED) or error.advice
        setting.faults.add(path, error.defect, f"{error.expected}, or an expression", advice)
        return None
    setting.faults.quantities[path] = SceneQuantity(value, number, dimension, False)
    return number


def read_expression(text: str, path: str, setting: Setting) -> Expression | None:
    """An expression whose names are the variables and the scene's parameters."""
    try:
        return parse(text, setting.names)
    except ExpressionError as error:
        advice = error.advice
        if not advice and nearest(text.strip().lower(), ["balance"]):
            advice = "only the drive's torque, or a parameter that an expression uses, can be the balance"
        elif not advice and re.search(r"\d\s*[^\W\d_]", text):
            advice = "numbers in an expression are SI, without units"
        setting.faults.add(path, error.defect, error.expected, advice)
        return None


def read_position(value: object, path: str, setting: Setting) -> Expression | None:
    """The position of a law's output: an expression of phi and of parameters that have a value."""
    if not isinstance(value, str):
        setting.faults.add(path, show(value), "an expression of phi, or a table")
        return None
    parts = split_quantity(value)
    if parts is not None and re.match(r"[^\W\d_]|[%°]", parts[1]) and not _WORDS.search(parts[1]):
        setting.faults.add(path, show(value), "an expression of phi, or a table", "its numbers are SI, without units")
        return None
    expression = read_expression(value, path, setting)
    if expression is None:
        return None
    if foreign := sorted(expression.names & {"x", "v", "omega", "t"}):
        setting.faults.add(path, f"an expression of {', '.join(foreign)}", "one of phi and parameters")
        return None
    if unknown := sorted(expression.names - {"phi", *setting.parameters}):
        advice = "a balance makes up for loads; it cannot change the geometry"
        setting.faults.add(path, f"an expression of {', '.join(unknown)}", "parameters that have a value", advice)
        return None
    return expression


_SMOOTH_ROWS = 4
_CLOSES = 1e-9  # share of a law's range by which its ends may differ


def read_law(raw: object, key: str, path: str, setting: Setting) -> Expression | Table | None:
    """The law of an output: an expression, or a table that a periodic spline can follow."""
    if isinstance(raw, Mapping) and set(raw) == {"table"}:
        raw, path = raw["table"], f"{path}.table"
    if not isinstance(raw, Mapping):
        return read_position(raw, path, setting)
    if raw.get("interpolation", "spline") != "spline":
        defect = show(raw["interpolation"])
        setting.faults.add(f"{path}.interpolation", defect, "none", "a law's table is a spline: else inertia would jump")
        return None
    raw = {name: value for name, value in raw.items() if name != "interpolation"}
    table = read_table(raw, "length" if key == "x" else "angle", path, setting.folder, setting.faults)
    if table is None:
        return None
    if np.any(np.diff(table.angle) == 0):
        setting.faults.add(path, "a jump (two equal angles)", "none: a mechanism's position does not jump")
        return None
    if table.angle.size < _SMOOTH_ROWS:
        setting.faults.add(path, f"{table.angle.size} rows", f"at least {_SMOOTH_ROWS} for a spline")
        return None
    value = table.value.copy()
    if key == "x":  # both ends of a periodic position are put exactly onto each other
        if abs(value[-1] - value[0]) > _CLOSES * np.ptp(value):
            defect = f"{value[0]:.10g} m at the first row and {value[-1]:.10g} m at the last"
            setting.faults.add(path, defect, "the same position")
            return None
        value[-1] = value[0]
    return replace(table, value=value, interpolation="spline")


def repeats(output: Output, period: float) -> int | None:
    """Number of times that a table's span fits into the period; None if that is not whole."""
    return whole(period / float(output.law.angle[-1] - output.law.angle[0])) if isinstance(output.law, Table) else 1


def fitted(output: Output, period: float, path: str, faults: Faults) -> Output:
    """An output that repeats after the period: a shorter table is repeated until it fills the period."""
    law, times = output.law, repeats(output, period)
    if not isinstance(law, Table):
        return output
    if times is not None and times <= MOST_TURNS:
        gain, turns = law.value[-1] - law.value[0], np.arange(times)[:, None]  # what it gains, it gains each time
        angle = np.append((law.angle[:-1] + turns * (period / times)).ravel(), law.angle[0] + period)
        value = np.append((law.value[:-1] + turns * gain).ravel(), law.value[0] + times * gain)
        if np.all(np.diff(angle) > 0):
            return output._replace(law=replace(law, angle=angle, value=value))
    defect = f"a table of {np.degrees(law.angle[-1] - law.angle[0]):.10g} deg"
    expected = f"a span that fits a whole number of times into {np.degrees(period):.10g} deg"
    faults.add(f"{path}.{output.name}", defect, expected)
    return output
