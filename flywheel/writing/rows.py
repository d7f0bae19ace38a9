"""What the blocks of a report share: rows, wrapped sentences, and figures in the words of those who read them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from flywheel.results import Sizing
from flywheel.writing.digits import MOST, columns, figure

WIDTH = 100
RPM = 9.549296585513721  # rad/s -> rev/min
NOTHING = 1e-12  # an irregularity that rounding makes
DEGREES = 57.29577951308232


class Row(NamedTuple):
    """A line of a block: what it is, the figure, its unit and what goes with it."""

    name: str
    value: str
    unit: str = ""


def block(title: str, rows: Iterable[Row]) -> list[str]:
    """Rows under a title; nothing where there are none."""
    lines = columns(rows)
    return [title, *lines] if lines else []


def printable(text: str) -> str:
    """The text with a space for every character that would move the cursor."""
    return "".join(c if c.isprintable() else " " for c in text)


def wrapped(sentence: str, indent: str = "  ") -> list[str]:
    """A sentence as lines of a report."""
    from textwrap import wrap

    return wrap(printable(sentence), WIDTH, initial_indent=indent, subsequent_indent=indent)


def sentences(found: Iterable[str]) -> list[str]:
    """Sentences as lines of a report, each from a new line on."""
    return [line for sentence in found for line in wrapped(sentence)]


def rpm(speed: float) -> str:
    """A speed (rad/s) in turns a minute.

    >>> rpm(6.283185307179586)
    '60 rpm'
    """
    return f"{figure(speed * RPM)} rpm"


def percent_and_steadiness(eps: float, error: float, most: int) -> tuple[str, str]:
    """An irregularity as a deviation to either side in per cent, and as its reciprocal."""
    if eps <= max(error, NOTHING):
        return ("±0", "without limit") if max(eps, error) <= NOTHING else ("?", "?")
    return f"±{figure(50 * eps, 50 * error, most)}", figure(1 / eps, error / eps**2, most)


def irregularity(eps: float, error: float) -> str:
    """An irregularity as a figure: 0 where rounding alone makes it."""
    return figure(eps, max(error, NOTHING if eps <= NOTHING else 0.0))


def irregularity_in_words(eps: float, error: float = 0.0) -> str:
    """An irregularity as its reader may know it.

    >>> irregularity_in_words(0.04)
    '0.04 (±2 %, steadiness 25)'
    """
    swing, steadiness = percent_and_steadiness(eps, error, 6)
    return f"{irregularity(eps, error)} ({swing} %, steadiness {steadiness})"


def or_unknown(value: float, error: float, most: int = MOST) -> str:
    """A figure, or a question mark where its error leaves nothing of it."""
    return "?" if 0.0 < value <= error else figure(value, error, most)


def shaft_of_wheel(sizing: Sizing) -> str:
    """The flywheel's shaft."""
    on, ratio = sizing.flywheel.on, sizing.scene.flywheel_ratio
    return "the crank" if on == "crank" else f"shaft {on} ({figure(ratio)} turns to one of the crank)"
