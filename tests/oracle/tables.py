"""Tables of numbers against angle: linear, step, monotone cubic, periodic cubic spline."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .numbers import KIND, Jet, Real, chain, real, reals, unit


class Cubics(NamedTuple):
    """Cubic pieces in (angle - start), `coefficients` (4, pieces) from the constant up, up to `ends`."""

    starts: Any
    ends: Any
    coefficients: Any

    def at(self, angle: Jet, anchor: Any) -> Jet:
        """Values at angles, the piece being that of an anchor."""
        k = np.clip(np.searchsorted(self.ends, anchor, side="right"), 0, self.ends.size - 1)
        d = angle.value - self.starts[k]
        c = [row[k] for row in self.coefficients]
        value = c[0] + d * (c[1] + d * (c[2] + d * c[3]))
        return chain(angle, value, c[1] + d * (2 * c[2] + 3 * d * c[3]), 2 * c[2] + 6 * d * c[3])


def columns(table: dict[str, Any], folder: Path) -> tuple[Any, Any]:
    """Angles (rad) and values (SI) of a table written in the scene or in a CSV file."""
    angle, value = table.get("angle"), table.get("value")
    if "file" in table:
        rows = [line.split(",") for line in (folder / table["file"]).read_text().splitlines() if line.strip()]
        column = table.get("column", 2)
        if isinstance(column, str):
            column = [name.strip() for name in rows[0]].index(column) + 1
        rows = [row for row in rows if row[0].strip()[-1] in "0123456789."]
        angle, value = [row[0].strip() for row in rows], [row[int(column) - 1].strip() for row in rows]
    by, per = unit(table.get("angle_unit", "rad")), unit(table.get("value_unit", ""))
    return np.array([real(a) * by for a in angle]), np.array([real(v) * per for v in value])


def pieces(table: dict[str, Any], folder: Path) -> Cubics:
    """The pieces of a load's table; two equal angles are a jump, on either side of which it starts afresh."""
    angle, value = columns(table, folder)
    kind = {"linear": linear, "step": step, "pchip": pchip}[table.get("interpolation", "linear")]
    jumps = [0, *(np.flatnonzero(np.diff(angle) == 0) + 1), angle.size]
    runs = [kind(angle[a:b], value[a:b]) for a, b in itertools.pairwise(jumps)]
    return Cubics(*(np.concatenate(parts, axis=-1) for parts in zip(*runs, strict=True)))


def step(x: Any, y: Any) -> Cubics:
    """Each value holds from its angle to the next one."""
    flat = np.zeros(x.size - 1, dtype=KIND)
    return Cubics(x[:-1], x[1:], np.stack((y[:-1], flat, flat, flat)))


def linear(x: Any, y: Any) -> Cubics:
    """Straight lines between neighbours."""
    flat = np.zeros(x.size - 1, dtype=KIND)
    return Cubics(x[:-1], x[1:], np.stack((y[:-1], np.diff(y) / np.diff(x), flat, flat)))


def hermite(x: Any, y: Any, slope: Any) -> Cubics:
    """Cubics with the given values and slopes at the ends."""
    h, chord = np.diff(x), np.diff(y) / np.diff(x)
    square = (3 * chord - 2 * slope[:-1] - slope[1:]) / h
    cube = (slope[:-1] + slope[1:] - 2 * chord) / h**2
    return Cubics(x[:-1], x[1:], np.stack((y[:-1], slope[:-1], square, cube)))


def pchip(x: Any, y: Any) -> Cubics:
    """The monotone cubic of Fritsch and Butland, with limited three-point slopes at the ends."""
    if x.size == 2:
        return linear(x, y)
    h, chord = np.diff(x), np.diff(y) / np.diff(x)
    slope = np.zeros_like(y)
    for i in range(1, x.size - 1):
        if chord[i - 1] * chord[i] > 0:
            a, b = 2 * h[i] + h[i - 1], h[i] + 2 * h[i - 1]
            slope[i] = (a + b) / (a / chord[i - 1] + b / chord[i])
    slope[0] = end_slope(h[0], h[1], chord[0], chord[1])
    slope[-1] = end_slope(h[-1], h[-2], chord[-1], chord[-2])
    return hermite(x, y, slope)


def end_slope(h: Any, k: Any, near: Any, far: Any) -> Any:
    """The one-sided slope at an end, held within what keeps the curve monotone."""
    slope = ((2 * h + k) * near - h * far) / (h + k)
    if slope * near <= 0:
        return Real(0)
    return 3 * near if near * far <= 0 and abs(slope) > 3 * abs(near) else slope


def spline(table: dict[str, Any], folder: Path) -> Cubics:
    """The C² cubic through the points whose slope and curvature agree at the two ends; the values may gain."""
    x, y = columns(table, folder)
    n, h, chord = x.size - 1, np.diff(x), np.diff(y) / np.diff(x)
    matrix, right = np.zeros((n, n), dtype=KIND), np.zeros(n, dtype=KIND)
    for i in range(n):
        before, after = h[i - 1], h[i]
        matrix[i, (i - 1) % n] += after
        matrix[i, i] += 2 * (before + after)
        matrix[i, (i + 1) % n] += before
        right[i] = 3 * (after * chord[i - 1] + before * chord[i])
    slope = solved(matrix, right)
    return hermite(x, y, np.append(slope, slope[0]))


def solved(matrix: Any, right: Any) -> Any:
    """The solution of a linear system: that in double, refined by its residuals."""
    rough = matrix.astype(float)
    found = reals(np.linalg.solve(rough, right.astype(float)))
    for _ in range(4):
        found += np.linalg.solve(rough, (right - matrix @ found).astype(float))
    return found
