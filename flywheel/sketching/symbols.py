"""Outlines of the symbols that mechanisms are drawn with, about the place where they sit: x and y (m), shape (2, m).

Each is given in a frame of its own, x along the guide where there is one. A gap between strokes is a column of NaN.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ROUND = 96  # points of a full circle


def circle(radius: float, centre: tuple[float, float] = (0.0, 0.0), start: float = 0.0, end: float = 2 * np.pi) -> Array:
    """An arc from `start` to `end` (rad), a full circle if not told otherwise."""
    count = max(int(np.ceil(_ROUND * abs(end - start) / (2 * np.pi))), 2) + 1
    angle = np.linspace(start, end, count)
    return np.stack((centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)))


def box(half_length: float, half_height: float) -> Array:
    """A rectangle about its centre.

    >>> box(2.0, 1.0).T.tolist()
    [[-2.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-2.0, 1.0]]
    """
    return np.array([[-half_length, half_length, half_length, -half_length], [-half_height] * 2 + [half_height] * 2])


def slot(low: float, high: float, half_width: float) -> Array:
    """A slot along x with round ends, whose pin goes from low to high."""
    right = circle(half_width, (high, 0.0), -np.pi / 2, np.pi / 2)
    left = circle(half_width, (low, 0.0), np.pi / 2, 3 * np.pi / 2)
    return np.concatenate((right, left), axis=1)


def support(size: float) -> Array:
    """The triangle under a fixed pivot at its apex."""
    return size * np.array([[0.0, -1.0, 1.0], [0.0, -1.7, -1.7]])


def ground(low: float, high: float, step: float) -> Array:
    """A line along x and short oblique strokes on its lower side, about a `step` (m) apart: something that is fixed."""
    count = max(round((high - low) / step), 2)
    foot = low + (np.arange(count) + 0.6) * (high - low) / count
    gap = np.full(count, np.nan)
    strokes = np.stack((np.stack((foot, foot - 0.8 * step, gap)), np.stack((0 * foot, 0 * foot - 0.8 * step, gap))))
    line = np.array([[low, high, np.nan], [0.0, 0.0, np.nan]])
    return np.concatenate((line, strokes.transpose(0, 2, 1).reshape(2, -1)), axis=1)


def straight_arrow(length: float, head: float) -> Array:
    """An arrow along +x from the origin."""
    return np.array([[0.0, length, length - head, length, length - head], [0.0, 0.0, 0.5 * head, 0.0, -0.5 * head]])


def round_arrow(radius: float, head: float, sense: int) -> Array:
    """An arrow over the upper side of a pivot, counter-clockwise for a sense of +1."""
    arc = circle(radius, (0.0, 0.0), np.radians(40.0), np.radians(140.0))
    tip = arc[:, -1:]
    barbs = [tip + head * np.array([[np.cos(angle)], [np.sin(angle)]]) for angle in np.radians([25.0, 85.0])]
    whole = np.concatenate((arc, barbs[0], tip, barbs[1]), axis=1)
    return whole if sense > 0 else whole * np.array([[-1.0], [1.0]])


def turned(outline: Array, angle: float, shift: tuple[float, float] = (0.0, 0.0)) -> Array:
    """An outline turned about the origin (rad, counter-clockwise), then shifted."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(np.array([[c, -s], [s, c]]) @ outline + np.reshape(shift, (2, 1)))


def rounded(points: Array, radius: float) -> Array:
    """The outline of a bar or plate through points (2, m): their convex hull, a radius wider on every side."""
    rim = circle(radius)[:, :-1]
    return hull((points[:, :, None] + rim[:, None, :]).reshape(2, -1))


def hull(points: Array) -> Array:
    """The convex hull of points (2, m), counter-clockwise.

    >>> hull(np.array([[0.0, 2.0, 1.0, 1.0], [0.0, 0.0, 1.0, 0.2]])).T.tolist()
    [[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]]
    """
    ordered = sorted(set(map(tuple, points.T.tolist())))
    return np.array(_half_hull(ordered)[:-1] + _half_hull(ordered[::-1])[:-1]).T


def _half_hull(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """One side of the hull: a point is kept where the outline turns left."""
    kept: list[tuple[float, float]] = []
    for point in ordered:
        while len(kept) > 1 and _turn(kept[-2], kept[-1], point) <= 0.0:
            kept.pop()
        kept.append(point)
    return kept


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Twice the area of a triangle, positive counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def in_line(points: Array) -> bool:
    """Whether points (2, m) lie on one line, within a thousandth of their extent.

    >>> in_line(np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]])), in_line(np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 0.0]]))
    (True, False)
    """
    spread = np.linalg.svd(points - points.mean(axis=1, keepdims=True), compute_uv=False)
    return bool(spread[1] <= 1e-3 * spread[0])
