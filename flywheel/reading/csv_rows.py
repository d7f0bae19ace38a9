"""Columns of a CSV file that lies beside its scene: found safely, read strictly."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flywheel.advice import mean, quote, show
from flywheel.reading.fields import Faults

LARGEST = 32 * 2**20
MOST_ROWS = 40_000
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_REPORTED = 5  # faulty rows that are spelt out; a wrong separator would otherwise fill the screen


class Line(NamedTuple):
    """A line of the file that holds data: its number, from 1, and its fields."""

    number: int
    fields: Sequence[str]


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
        faults.add(f"{path}.file", f"{rows} lines in {show(name)}", f"at most {MOST_ROWS}", "leave out what lies on a line")
        return None
    lines = _split(text)
    header = lines.pop(0) if lines and _is_header(lines[0]) else None
    if not lines:
        faults.add(f"{path}.file", f"no rows of numbers in {show(name)}", "an angle and a value in every row")
        return None
    index = _column(column, header, len(lines[0].fields), f"{path}.column", faults)
    return None if index is None else _numbers(lines, header, index, f"{path}.file", faults)


def _find(name: object, folder: Path | None, path: str, faults: Faults) -> Path | None:
    """The file beside the scene that a name stands for; nothing outside the scene's folder is ever opened."""
    if not isinstance(name, str) or not name:
        faults.add(path, show(name), "the name of a CSV file beside the scene")
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
        faults.add(path, f"no file {show(name)} beside the scene", "a CSV file", _elsewhere(name) or _other_files(file))
    return file if there else None


def _elsewhere(name: str) -> str:
    r"""The advice for a name that is a place on a disk, or that escapes have spoilt: "C:\new" holds a line's end."""
    spelt = name
    for sign, letter in zip("\n\t\r\b\f", "ntrbf", strict=True):
        spelt = spelt.replace(sign, f"\\{letter}")
    plain = spelt.replace("\\", "/")
    why = "between double quotes \\ begins an escape" if spelt != name else ""
    if re.match(r"[A-Za-z]:|[/~]", plain) and plain[-1] != "/":
        moved = f"put the file beside the scene and write {quote(plain.rpartition('/')[2])}"
        return f"{why}; {moved}" if why else moved
    return f"{why or 'write / for every backslash'}: {quote(plain)}" if plain != name else ""


def _other_files(file: Path) -> str:
    """The nearest name among the CSV files that are there."""
    try:
        return mean(file.name, [other.name for other in file.parent.glob("*.csv")][:1000])
    except OSError:
        return ""


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
    """Whether a text of Latin letters is in UTF-16, by its mark or by every second byte of its beginning."""
    return re.match(rb"\xff\xfe|\xfe\xff|\0[^\0]\0[^\0]|[^\0]\0[^\0]\0", content) is not None


def _split(text: str) -> list[Line]:
    """The lines that hold something besides a comment, split by the separator that the first of them shows."""
    kept = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1)]
    kept = [(i, line) for i, line in kept if line and not line.startswith("#")]
    if not kept:
        return []
    separator = next((mark for mark in (";", "\t", ",") if mark in kept[-1][1]), None)
    return [Line(i, _fields(line, separator)) for i, line in kept]


def _fields(line: str, separator: str | None) -> list[str]:
    """The fields of a line; separators between double quotes do not count."""
    if '"' not in line:
        return [field.strip() for field in line.split(separator)]
    import csv  # a quoted header is the only thing that needs it

    try:
        found = next(csv.reader([line], delimiter=separator or " ", skipinitialspace=True))
    except csv.Error:
        found = [line]
    return [field.strip() for field in found]


def _is_header(line: Line) -> bool:
    """Whether a line names columns: none of its fields is a number, however misspelt."""
    return not any(_NUMBER.fullmatch(field) for field in line.fields) and not _comma(line)


def _comma(line: Line) -> bool:
    """Whether a field is a number with a decimal comma, or two numbers that a decimal comma tore apart."""
    return any(re.fullmatch(r"[+-]?[0-9]+,[0-9]+|[0-9]+\s+[+-]?[0-9]+", field) for field in line.fields)


def _column(column: object, header: Line | None, width: int, path: str, faults: Faults) -> int | None:
    """Index of the chosen column, from 0."""
    if isinstance(column, str):
        return _named_column(column, header, path, faults)
    number = 2 if column is None else column
    if isinstance(number, bool) or not isinstance(number, (int, np.integer)):
        faults.add(path, show(column), "the name of a column or its number")
    elif not 2 <= number <= width:
        found = f"column {number}" if column is not None else "a single column"
        faults.add(path, found, f"a number from 2 to {width}" if width > 1 else "a column of values after the angles")
    else:
        return int(number) - 1
    return None


def _named_column(column: str, header: Line | None, path: str, faults: Faults) -> int | None:
    """Index of the column with a name."""
    names = list(header.fields) if header else []
    if header is None:
        faults.add(path, show(column), "a number", "the file has no header that would name its columns")
    elif column not in names:
        faults.add(path, show(column), "the name of a column", mean(column, names[1:]))
    elif names.count(column) > 1 or names.index(column) == 0:
        faults.add(path, show(column), "a name that one column of values bears, the angle's being the first")
    else:
        return names.index(column)
    return None


def _numbers(
    lines: list[Line], header: Line | None, index: int, path: str, faults: Faults
) -> tuple[list[str], list[str]] | None:
    """Both columns, once every row has proved to have the right width and numbers in them."""
    width = len(header.fields if header else lines[0].fields)
    wrong = [line for line in lines if len(line.fields) != width or not _good(line, index)]
    for line in wrong[:_REPORTED]:
        faults.add(path, *_row_fault(line, width, index))
    if len(wrong) > _REPORTED:
        faults.add(path, f"{len(wrong) - _REPORTED} more rows like these", "rows of numbers")
    if wrong:
        return None
    return [line.fields[0] for line in lines], [line.fields[index] for line in lines]


def _good(line: Line, index: int) -> bool:
    return bool(_NUMBER.fullmatch(line.fields[0]) and _NUMBER.fullmatch(line.fields[index]))


def _row_fault(line: Line, width: int, index: int) -> tuple[str, str, str]:
    """What is wrong with a row: found, expected, advice."""
    if _comma(line):
        torn = next(field for field in line.fields if _comma(Line(0, [field])))
        return f"{quote(torn)} in line {line.number}", "a number", "write 1.5, not 1,5"
    if len(line.fields) != width:
        return f"{len(line.fields)} columns in line {line.number}", f"{width}, as in the line before the first row", ""
    wrong = next(line.fields[i] for i in (0, index) if not _NUMBER.fullmatch(line.fields[i]))
    return f"{quote(wrong)} in line {line.number}", "a number", ""
