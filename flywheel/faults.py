"""What a user gets instead of a traceback: one line per fault, each with its place and its mend."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Fault(NamedTuple):
    """One thing that is wrong: where, what was found, what was expected, and what to do about it.

    In a scene that was read from a text it stands in a `line` (and a `column`, where the text is no TOML), and perhaps in an
    `item` of an array of tables, counted from 1. The path counts from 0.

    >>> print(Fault("load[0].on", "3", "a text", line=12, item="the 1st [[load]]"))
    load[0].on (the 1st [[load]], line 12): found 3, expected a text
    """

    path: str
    found: str
    expected: str
    advice: str = ""
    line: int | None = None
    column: int | None = None
    item: str = ""

    def __str__(self) -> str:
        return f"{self.path}{self.told}"

    @property
    def place(self) -> str:
        """Item, line and column in words; empty where none is known."""
        return _place(self.item, self.line, self.column)

    @property
    def told(self) -> str:
        """What follows the path."""
        place = f" ({self.place})" if self.place else ""
        tail = f"; {self.advice}" if self.advice else ""
        return f"{place}: found {self.found}, expected {self.expected}{tail}"


class Remark(NamedTuple):
    """A number of a scene that is a good one, but hardly the one that was meant: where, what it comes to, the mend.

    >>> print(Remark("mechanism.crank.length", "80 m", 'write "80 mm" if millimetres are meant', line=5))
    mechanism.crank.length (line 5): 80 m; write "80 mm" if millimetres are meant
    """

    path: str
    found: str
    advice: str
    line: int | None = None
    item: str = ""

    def __str__(self) -> str:
        place = _place(self.item, self.line, None)
        return f"{self.path}{f' ({place})' if place else ''}: {self.found}; {self.advice}"


def _place(item: str, line: int | None, column: int | None) -> str:
    words = (item, "" if line is None else f"line {line}", "" if column is None else f"column {column}")
    return ", ".join(filter(None, words))


class SceneError(ValueError):
    """All the faults of a scene, or of the machine that it describes, at once.

    >>> print(SceneError([Fault("regime.speed", "-3 rad/s", "a speed above 0", "drop the sign")]))
    regime.speed: found -3 rad/s, expected a speed above 0; drop the sign
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(map(str, self.faults)))
