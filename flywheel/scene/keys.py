"""Keys of the tables of a scene, each with the words that describe it in the format.

The reader checks a scene against these records, the reference is printed from them, and a family of mechanisms describes
its own tables with them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flywheel.numerics.functions import is_recorded

_TINIEST = 1e-50  # least positive number: squares and products of smaller ones leave the floating-point range


class Range(NamedTuple):
    """The values a key may take, from `low` to `high`; an end may be left out of the range."""

    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    high_open: bool = False

    def __contains__(self, value: object) -> bool:
        if not isinstance(value, (int, float)) and not is_recorded(value):
            return False
        if self.low_open and self.low == 0.0 and value < _TINIEST:
            return False
        above = value > self.low if self.low_open else value >= self.low
        return above and (value < self.high if self.high_open else value <= self.high)

    def __str__(self) -> str:
        low = f"{'above' if self.low_open else 'at least'} {self.low:g}" if self.low > -math.inf else ""
        high = f"{'below' if self.high_open else 'at most'} {self.high:g}" if self.high < math.inf else ""
        return " and ".join(filter(None, (low, high))) or "any"


ANY = Range()
POSITIVE = Range(0.0, low_open=True)
NOT_NEGATIVE = Range(0.0)


class Key(NamedTuple):
    """One key of a table.

    kind: a dimension of `flywheel.numerics.units.DIMENSIONS`; two of them for a place that translates and one that rotates
    ("mass | inertia"); or "text", "name", "choice", "law" (quantity or expression), "position" (expression or table),
    "table", "numbers", "index", "unit", "tables" (a table of named tables), "list" (of tables, names or lengths), "flag",
    "model" (a table whose keys depend on its type), "changes" (values by paths of the scene).
    default: SI, or None if there is none. missing: advice where a required key is not there. example: of a value, where
    that of its dimension does not suit it. many_turns: an angle that may be any number of turns also where it is written
    without a unit.
    """

    name: str
    kind: str
    about: str
    default: float | str | None = None
    range: Range = ANY
    required: bool = False
    choices: tuple[str, ...] = ()
    missing: str = ""
    example: str = ""
    many_turns: bool = False


def length(about: str, name: str = "length") -> Key:
    """A length above 0 that has to be given."""
    return Key(name, "length", about, required=True, range=POSITIVE)


MASS = Key("mass", "mass", "mass of the body", 0.0, NOT_NEGATIVE)
OWN_INERTIA = Key("inertia", "inertia", "inertia about its own centre of mass", 0.0, NOT_NEGATIVE)
POINT = (MASS,)
BODY = (
    MASS,
    OWN_INERTIA,
    Key("com", "length", "distance of the centre of mass from the first pin, towards the other pin", 0.0),
    Key("com_angle", "angle", "angle of that distance from the line of the pins, counter-clockwise", 0.0),
)
