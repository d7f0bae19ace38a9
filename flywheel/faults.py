"""What a user gets instead of a traceback: one line per fault, each with its place and its mend."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Fault(NamedTuple):
    """One thing that is wrong: where, what was found, what was expected, and what to do about it."""

    path: str
    found: str
    expected: str
    advice: str = ""

    def __str__(self) -> str:
        tail = f"; {self.advice}" if self.advice else ""
        return f"{self.path}: found {self.found}, expected {self.expected}{tail}"


class SceneError(ValueError):
    """All the faults of a scene, or of the machine that it describes, at once.

    >>> print(SceneError([Fault("regime.speed", "-3 rad/s", "a speed above 0", "drop the sign")]))
    regime.speed: found -3 rad/s, expected a speed above 0; drop the sign
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(map(str, self.faults)))
