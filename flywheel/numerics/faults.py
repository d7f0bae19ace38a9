"""Faults instead of a traceback: one line each, with the place, the value found, the expected one, and the remedy.

Also the words for a wrong value, and the valid name most similar to a wrong one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import accumulate
from math import degrees
from numbers import Real
from types import MappingProxyType
from typing import NamedTuple

from flywheel.language import message, untranslated, use
from flywheel.language import text as _

__all__ = [
    "LONGEST_NAME", "LONGEST_TEXT", "Fault", "Remark", "SceneError", "coordinate_text", "nearest", "quote", "show",
    "suggestion",
]  # fmt: skip


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
