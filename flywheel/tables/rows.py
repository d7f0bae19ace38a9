"""How results are written: rows and sentences of a page, figures in the words of the trade, columns as CSV, data as JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.records import NamedTuple
from flywheel.numerics.units import MOST, columns, figure

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


def page(blocks: Iterable[Iterable[str]]) -> str:
    """Blocks of lines as a text, an empty line between two of them; those without a line are left out."""
    return "\n\n".join("\n".join(lines) for lines in map(list, blocks) if lines) + "\n"


def printable(text: str) -> str:
    """The text with a space for every character that would move the cursor."""
    return "".join(c if c.isprintable() else " " for c in text)


def wrapped(sentence: str, indent: str = "  ", first: str | None = None) -> list[str]:
    """A sentence as lines of a page; `first` is what its first line begins with, the indent if None."""
    from textwrap import wrap

    head = indent if first is None else first
    return wrap(printable(sentence), WIDTH, initial_indent=head, subsequent_indent=indent)


def sentences(found: Iterable[str], indent: str = "  ") -> list[str]:
    """Sentences as lines of a page, each from a new line on."""
    return [line for sentence in found for line in wrapped(sentence, indent)]


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
    deviation, steadiness = percent_and_steadiness(eps, error, 6)
    return f"{irregularity(eps, error)} ({deviation} %, steadiness {steadiness})"


def or_unknown(value: float, error: float, most: int = MOST) -> str:
    """A figure, or a question mark where its error leaves nothing of it."""
    return "?" if 0.0 < value <= error else figure(value, error, most)


def plain(value: float, decimals: int) -> str:
    """A positive number to three digits without an exponent, to two where it takes more decimals.

    >>> plain(0.08581, 3), plain(7104.2, 3), plain(0.63, 2)
    ('0.086', '7100', '0.63')
    """
    from decimal import Decimal

    three = Decimal(f"{value:.3g}")
    exponent = three.as_tuple().exponent
    fine = isinstance(exponent, int) and exponent < -decimals
    return f"{Decimal(f'{value:.2g}') if fine else three:f}"


def csv(columns: Iterable[tuple[str, NDArray[np.float64]]]) -> str:
    """Columns under the names that head them, floats at full precision; empty where a value is not known (NaN)."""
    names, arrays = zip(*columns, strict=True)
    rows = zip(*((array + 0.0).tolist() for array in arrays), strict=True)  # + 0.0: no "-0.0"
    lines = [",".join(names), *(",".join("" if math.isnan(v) else repr(v) for v in row) for row in rows)]
    return "\n".join(lines) + "\n"


def encoded(data: Mapping[str, Any], indent: int | None = None) -> str:
    """JSON in plain ASCII with floats at full precision; a number that is not finite becomes null.

    >>> encoded({"a": np.float64(0.1), "b": float("inf"), "c": np.array([1.0, 2.0])})
    '{"a": 0.1, "b": null, "c": [1.0, 2.0]}'
    """
    import json  # pages and CSV do without

    return json.dumps(_plain(data), indent=indent, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
