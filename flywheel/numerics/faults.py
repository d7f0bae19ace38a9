"""Faults instead of a traceback: one line each, with the place, the value found, the expected one, and the remedy.

Also the words for a wrong value, the valid name most similar to a wrong one, and checks of arguments of the library: finite
numbers, arrays of them, known names, objects of the right type.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from itertools import accumulate
from math import degrees
from numbers import Real
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from flywheel.language import message, untranslated, use
from flywheel.language import text as _

__all__ = [
    "ANY", "LONGEST_NAME", "LONGEST_TEXT", "NOT_NEGATIVE", "POSITIVE", "Fault", "Remark", "SceneError", "array", "brief",
    "coordinate_text", "entry", "fits", "name_faults", "nearest", "number_faults", "quote", "refuse", "require", "show",
    "suggestion", "vector",
]  # fmt: skip

Array = NDArray[np.float64]
T = TypeVar("T")


class Fault(NamedTuple):
    """One fault: its place, the value found, the expected one, and the remedy.

    In a scene that was read from a text it has a `line` (and a `column`, where the text is no TOML), and an `item` within an
    array of tables, counted from 1. The path counts from 0. `locks` are the driver's coordinates (rad or m) at which a
    mechanism locks.

    >>> print(Fault("load[0].on", "3", "a text", line=12, item="the 1st [[load]]"))
    load[0].on (the 1st [[load]], line 12): found 3, expected a text
    """

    path: str
    defect: str
    expected: str
    advice: str = ""
    line: int | None = None
    column: int | None = None
    item: str = ""
    locks: tuple[float, ...] = ()

    def __str__(self) -> str:
        return f"{self.path}{self.description}"

    def under(self, table: str) -> Fault:
        """The fault of a table's own record, at its path in the scene."""
        return self._replace(path=f"{table}.{self.path}")

    @property
    def place(self) -> str:
        """Item, line and column in words; empty if none is known."""
        return _place(self.item, self.line, self.column)

    @property
    def description(self) -> str:
        """The text after the path."""
        return f"{f' ({self.place})' if self.place else ''}: {self.sentence}"

    @property
    def sentence(self) -> str:
        """The value found, the expected one and the advice in the language in use; English if any part is."""
        if any(map(untranslated, (self.defect, self.expected, self.advice))):
            with use("en"):
                return self.sentence
        words = {"found": message(self.defect, numbers=False), "expected": message(self.expected, numbers=False)}
        tail = f"; {message(self.advice, numbers=False)}" if self.advice else ""
        return _("found {found}, expected {expected}", **words) + tail


class Remark(NamedTuple):
    """A number of a scene that is valid but unlikely to be intended: the place, its value, the remedy.

    >>> print(Remark("mechanism.crank.length", "80 m", 'write "80 mm" if millimetres are meant', line=5))
    mechanism.crank.length (line 5): 80 m; write "80 mm" if millimetres are meant
    """

    path: str
    defect: str
    advice: str
    line: int | None = None
    item: str = ""

    def __str__(self) -> str:
        place = _place(self.item, self.line, None)
        return f"{self.path}{f' ({place})' if place else ''}: {self.sentence}"

    @property
    def sentence(self) -> str:
        """The words for the value and the advice, in the language in use."""
        return f"{message(self.defect)}; {message(self.advice)}"


def _place(item: str, line: int | None, column: int | None) -> str:
    in_line = "" if line is None else _("line {n}", n=line)
    words = (message(item), in_line, "" if column is None else _("column {n}", n=column))
    return ", ".join(filter(None, words))


class SceneError(ValueError):
    """All faults of a scene, or of the machine that it describes.

    >>> print(SceneError([Fault("regime.speed", "-3 rad/s", "a speed above 0", "drop the sign")]))
    regime.speed: found -3 rad/s, expected a speed above 0; drop the sign
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(map(str, self.faults)))


# -- advice ------------------------------------------------------------------------------------------------------------


LONGEST_TEXT = 60
LONGEST_NAME = 64


def show(value: object) -> str:
    r"""A wrong value in words short enough for one line.

    >>> print(show("1,5 m"), show(True), show([1, 2]), show({}), show(2.5), show("a\nb"))
    "1,5 m" true a list a table 2.5 "a\nb"
    """
    if isinstance(value, str):
        return quote(value)
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, (list, tuple)):
        return "a list"
    # a number as it is, anything else by its type: dates and times, arrays, objects of a library user
    name = type(value).__name__
    if name in ("datetime", "date", "time"):
        return f"a {name}"
    if isinstance(value, int):
        return str(value) if abs(value) < 10**15 else "a whole number of more than 15 digits"
    if getattr(value, "is_recorded", False):
        return f"{value}"
    return repr(float(value)) if isinstance(value, Real) else f"a value of type {name}"


def quote(text: str) -> str:
    """A text between double quotes on one line, shortened if necessary."""
    pieces = [c if c.isprintable() else c.encode("unicode_escape").decode() for c in text[: LONGEST_TEXT + 1]]
    if len(text) <= LONGEST_TEXT and sum(map(len, pieces)) <= LONGEST_TEXT:
        return f'"{"".join(pieces)}"'
    lengths = accumulate(map(len, pieces))
    return f'"{"".join(c for c, length in zip(pieces, lengths, strict=True) if length < LONGEST_TEXT)}…"'


def coordinate_text(value: float, sliding: bool) -> str:
    """A driver's coordinate in words.

    >>> coordinate_text(0.19, True), coordinate_text(3.141592653589793, False)
    ('0.19 m', '180 deg')
    """
    return f"{value:.10g} m" if sliding else f"{degrees(value):.10g} deg"


def nearest(name: str, valid: Iterable[str]) -> str:
    """The valid name most similar to a wrong one; empty if none is similar.

    >>> nearest("lenght", ["mass", "length"]), nearest("MM", ["Mm", "mm"]), nearest("zzz", ["mass"])
    ('length', 'mm', '')
    """
    names = sorted(valid, key=lambda other: (other != name.lower(), other))
    for other in names:
        if other.casefold() == name.casefold():
            return other
    if not names or len(name) > LONGEST_NAME:
        return ""
    from difflib import get_close_matches  # 3 ms, and wanted only once something is wrong

    return next(iter(get_close_matches(name, names, n=1, cutoff=0.55)), "")


def suggestion(name: str, valid: Iterable[str], short: Mapping[str, str] = MappingProxyType({})) -> str:
    """Advice for an unknown name: the nearest valid one, or all of them where they are at most 12.

    `short` has other forms of valid names, each with the whole name.
    """
    names = sorted(valid)
    near = nearest(name, [*names, *short])
    if near:
        near = short.get(near, near)
        return f"did you mean {quote(near)}?"
    return f"valid here: {', '.join(quote(name)[1:-1] for name in names)}" if 0 < len(names) <= 12 else ""


# -- arguments ---------------------------------------------------------------------------------------------------------


ANY, NOT_NEGATIVE, POSITIVE = "a finite number", "a finite number, 0 or above", "a finite number above 0"

_NUMBERS = (float, int, np.floating, np.integer)
_GREATEST = sys.float_info.max


def fits(value: Any, expected: str = ANY) -> bool:
    """Tests whether a value is a finite number; with `NOT_NEGATIVE` or `POSITIVE`, one of that sign.

    >>> fits(0), fits(float("nan")), fits("1"), fits(True), fits(0.0, POSITIVE), fits(0.0, NOT_NEGATIVE)
    (True, False, False, False, False, True)
    """
    if getattr(value, "is_recorded", False):
        return bool(abs(value) <= _GREATEST and (expected == ANY or value > 0 or (expected == NOT_NEGATIVE and value == 0)))
    if not _numeric(value):
        return False
    number = value if isinstance(value, int) else float(value)
    return abs(number) <= _GREATEST and (expected == ANY or number > 0 or (expected == NOT_NEGATIVE and number == 0))


def number_faults(path: str, value: object, expected: str = ANY, unit: str = "") -> list[Fault]:
    """The fault of a value that is not such a number; empty if it is."""
    if fits(value, expected):
        return []
    return [Fault(path, f"{brief(value)} {unit}" if unit and _numeric(value) else brief(value), expected)]


def refuse(faults: list[Fault]) -> None:
    """Raises SceneError with all faults, if there are any."""
    if faults:
        raise SceneError(faults)


def require(path: str, value: object, kind: type | tuple[type, ...], expected: str) -> None:
    """Raises SceneError if a value is not of a type.

    >>> require("arm", 2.5, str, "a name")
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: arm: found 2.5, expected a name
    """
    if not isinstance(value, kind):
        raise SceneError([Fault(path, brief(value), expected)])


def entry(path: str, name: object, valid: Mapping[str, T]) -> T:
    """The value of a name; SceneError for an unknown name."""
    faults = name_faults(path, name, valid)
    refuse(faults)
    return valid[str(name)]


def name_faults(path: str, name: object, valid: Mapping[str, object]) -> list[Fault]:
    """The fault of a name that is not valid, with the nearest one that is.

    >>> print(*name_faults("driver", "pivt", {"pivot": 1, "guide": 2}))
    driver: found "pivt", expected one of pivot, guide; did you mean "pivot"?
    """
    if isinstance(name, str) and name in valid:
        return []
    advice = suggestion(name, valid) if isinstance(name, str) else ""
    return [Fault(path, brief(name), f"one of {', '.join(valid) or 'none'}", "" if advice.startswith("valid") else advice)]


def array(path: str, value: object) -> Array:
    """Finite numbers of any shape as an array; SceneError for anything else, texts of digits included.

    >>> array("q", "20")
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: q: found "20", expected finite numbers
    """
    values = None  # of texts, truth values, ragged lists and objects
    if value is not None:
        with suppress(TypeError, ValueError):
            numbers = np.asarray(value)  # of other libraries too
            values = np.asarray(numbers, dtype=float) if numbers.dtype.kind in "fiuO" else None
    if values is None:
        raise SceneError([Fault(path, brief(value), "finite numbers")])
    if not np.isfinite(values).all():
        what = "a value that is not finite" if values.ndim else brief(float(values))
        raise SceneError([Fault(path, what, "finite numbers")])
    return values


def vector(path: str, value: object, unit: str) -> tuple[float, float]:
    """Two components, along x and y.

    >>> vector("gravity", 9.81, "m/s²")
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: gravity: found 9.81, expected two numbers, along x and y, in m/s²
    """
    components = array(path, value)
    if components.shape != (2,):
        what = f"an array of shape {components.shape}" if components.ndim else brief(value)
        raise SceneError([Fault(path, what, f"two numbers, along x and y, in {unit}")])
    return float(components[0]), float(components[1])


def brief(value: object) -> str:
    """A wrong value in words: a sequence by its type's name."""
    return f"a value of type {type(value).__name__}" if isinstance(value, (list, tuple)) else show(value)


def _numeric(value: object) -> bool:
    return isinstance(value, _NUMBERS) and not isinstance(value, bool)
