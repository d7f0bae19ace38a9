"""Numbers as a reader wants them: no digit beyond the estimated error, decimal points under one another."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import ceil, floor, isfinite, log10

MOST = 10


def figure(value: float, error: float = 0.0, most: int = MOST) -> str:
    """A number with as many significant digits as its absolute error leaves standing, at most `most`.

    A value that its error swallows is 0; zeros that only pad the fraction are dropped.

    >>> figure(353.52142732, 1e-4), figure(353.52142732), figure(1234.5678, 20.0), figure(3e-17, 1e-15), figure(-4e-7)
    ('353.5214', '353.5214273', '1.2e+03', '0', '-4e-07')
    """
    if not isfinite(value):
        return "none"
    if value == 0.0 or abs(value) <= error:
        return "0"
    digits = most
    if error > 0.0:
        digits = min(most, floor(log10(abs(value))) + 1 - ceil(log10(error)))
    # value > error leaves at least half a digit: the one that is then shown is good to its own size
    return f"{value:.{max(digits, 1)}g}"


def short(value: float) -> str:
    """A small error or tolerance: two digits."""
    return f"{value:.2g}"


def aligned(cells: Sequence[str]) -> list[str]:
    """Texts of one width with their decimal points under one another; a text that is no number stands to the left.

    >>> aligned(["12.5", "-3", "0.25", ""])
    ['12.5 ', '-3   ', ' 0.25', '     ']
    """
    split = [_around_point(cell) for cell in cells]
    left = max((len(head) for head, _ in split), default=0)
    lines = [head.rjust(left) + tail if head else tail for head, tail in split]
    width = max(map(len, lines), default=0)
    return [line.ljust(width) for line in lines]


def _around_point(cell: str) -> tuple[str, str]:
    """What stands before the decimal point (sign included), and the rest; all is rest where there is no number."""
    if not cell or not (cell[0].isdigit() or cell[0] in "+-±"):
        return "", cell
    for k, character in enumerate(cell):
        if not (character.isdigit() or character in "+-±"):
            return cell[:k], cell[k:]
    return cell, ""


def columns(rows: Iterable[Sequence[str]], header: Sequence[str] = (), gap: str = "  ", indent: str = "  ") -> list[str]:
    """Rows as lines, each column aligned; the first holds names and stands to the left, the rest under their header.

    >>> columns([("mass", "2.5", "kg"), ("length", "10", "m")])
    ['  mass     2.5  kg', '  length  10    m']
    """
    table = list(rows)
    if not table:
        return []
    names, *rest = zip(*table, strict=True)
    head, *heads = header or [""] * len(table[0])
    width = max(map(len, (head, *names)))
    stacked = [[head.ljust(width), *(name.ljust(width) for name in names)]]
    for title, cells in zip(heads, rest, strict=True):
        body = aligned(cells)
        width = max(len(title), len(body[0]))
        stacked.append([title.rjust(width), *(cell.rjust(width) for cell in body)])
    lines = [(indent + gap.join(cells)).rstrip() for cells in zip(*stacked, strict=True)]
    return lines if header else lines[1:]
