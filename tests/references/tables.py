"""Tables of numbers against angle: linear, step, monotone cubic (Fritsch-Carlson with Butland's slopes), cubic spline."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

from .quantities import unit


class Cubic(NamedTuple):
    """One stretch of a table: a polynomial in (angle - start) up to `end`, coefficients from the constant up."""

    start: Any
    end: Any
    coefficients: tuple[Any, ...]

    def __call__(self, angle: Any) -> Any:
        total = self.coefficients[-1]
        for c in self.coefficients[-2::-1]:
            total = total * (angle - self.start) + c
        return total


def columns(table: dict[str, Any], folder: Path) -> tuple[list[Any], list[Any]]:
    """Angles (rad) and values (SI) of a table written in the scene or in a CSV file."""
    if "file" in table:
        rows = [line.split(",") for line in (folder / table["file"]).read_text().splitlines() if line.strip()]
        column = table.get("column", 2)
        if isinstance(column, str):
            column = [name.strip() for name in rows[0]].index(column) + 1
        rows = [row for row in rows if row[0].strip()[-1] in "0123456789."]
        angle, value = [row[0].strip() for row in rows], [row[int(column) - 1].strip() for row in rows]
    else:
        angle, value = table["angle"], table["value"]
    by, per = unit(table.get("angle_unit", "rad")), unit(table.get("value_unit", ""))
    return [mp.mpf(a) * by for a in angle], [mp.mpf(v) * per for v in value]


def stretches(table: dict[str, Any], folder: Path) -> list[Cubic]:
    """The pieces of a load's table; two equal angles are a jump, on either side of which a cubic starts afresh."""
    angle, value = columns(table, folder)
    kind = table.get("interpolation", "linear")
    pieces: list[Cubic] = []
    first = 0
    for last in range(1, len(angle) + 1):
        if last == len(angle) or angle[last] == angle[last - 1]:
            run = {"linear": linear, "step": step, "pchip": pchip}[kind]
            pieces += run(angle[first:last], value[first:last])
            first = last
    return pieces


def linear(x: list[Any], y: list[Any]) -> list[Cubic]:
    """Straight lines between neighbours."""
    return [Cubic(x[i], x[i + 1], (y[i], (y[i + 1] - y[i]) / (x[i + 1] - x[i]))) for i in range(len(x) - 1)]


def step(x: list[Any], y: list[Any]) -> list[Cubic]:
    """Each value holds from its angle to the next one."""
    return [Cubic(x[i], x[i + 1], (y[i],)) for i in range(len(x) - 1)]


def hermite(x: list[Any], y: list[Any], slope: list[Any]) -> list[Cubic]:
    """Cubics with the given values and slopes at the ends."""
    pieces = []
    for i in range(len(x) - 1):
        h = x[i + 1] - x[i]
        chord = (y[i + 1] - y[i]) / h
        square = (3 * chord - 2 * slope[i] - slope[i + 1]) / h
        cube = (slope[i] + slope[i + 1] - 2 * chord) / h**2
        pieces.append(Cubic(x[i], x[i + 1], (y[i], slope[i], square, cube)))
    return pieces


def pchip(x: list[Any], y: list[Any]) -> list[Cubic]:
    """The monotone cubic: weighted harmonic mean of the chords inside, a limited three-point slope at the ends."""
    n = len(x)
    h = [x[i + 1] - x[i] for i in range(n - 1)]
    chord = [(y[i + 1] - y[i]) / h[i] for i in range(n - 1)]
    if n == 2:
        return linear(x, y)
    inside = [butland(h[i], h[i + 1], chord[i], chord[i + 1]) for i in range(n - 2)]
    ends = end_slope(h[0], h[1], chord[0], chord[1]), end_slope(h[-1], h[-2], chord[-1], chord[-2])
    return hermite(x, y, [ends[0], *inside, ends[1]])


def butland(h: Any, k: Any, before: Any, after: Any) -> Any:
    """The slope at a knot between chords `before` (width h) and `after` (width k)."""
    if before * after <= 0:
        return mp.zero
    a, b = 2 * k + h, k + 2 * h
    return (a + b) / (a / before + b / after)


def end_slope(h: Any, k: Any, near: Any, far: Any) -> Any:
    """The one-sided slope at an end, held within what keeps the curve monotone."""
    slope = ((2 * h + k) * near - h * far) / (h + k)
    if slope * near <= 0:
        return mp.zero
    return 3 * near if near * far <= 0 and abs(slope) > 3 * abs(near) else slope


def periodic_spline(x: list[Any], y: list[Any]) -> list[Cubic]:
    """The C² cubic through the points whose slope and curvature agree at the two ends (the value may gain)."""
    n = len(x) - 1
    h = [x[i + 1] - x[i] for i in range(n)]
    chord = [(y[i + 1] - y[i]) / h[i] for i in range(n)]
    matrix, right = mp.zeros(n, n), mp.zeros(n, 1)
    for i in range(n):
        before, after = h[i - 1], h[i]
        matrix[i, (i - 1) % n] += after
        matrix[i, i] += 2 * (before + after)
        matrix[i, (i + 1) % n] += before
        right[i] = 3 * (after * chord[i - 1] + before * chord[i])
    slope = list(mp.lu_solve(matrix, right))
    return hermite(x, y, [*slope, slope[0]])


def read_scene(path: Path) -> dict[str, Any]:
    """The scene as TOML gives it, its decimal numbers kept as they are written."""
    return tomllib.loads(path.read_text(encoding="utf-8"), parse_float=mp.mpf)
