"""Where names go in a picture: beside what they name, clear of lines and of each other as far as there is room."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_AWAY = (5.0, 9.0, 15.0, 24.0, 36.0)  # points from an anchor to the name's box
_WAYS = np.radians(np.arange(16) * 22.5)
_SPARE = 1.5  # points around a name
_LINE, _NAME, _OUTSIDE, _FAR, _TASTE = 4.0, 150.0, 400.0, 0.5, 1.5


def settled(anchors: Array, sizes: Array, lines: Array, bounds: Array, towards: Array | None = None) -> Array:
    """The centres (k, 2) of names of `sizes` (k, 2) beside `anchors` (k, 2), all in points; earlier names choose first.

    `lines` (p, 2) are points along everything drawn, close enough together that no name fits between two of them;
    `bounds` (4,) are left, bottom, right and top of the picture; `towards` (k, 2) are the
    directions in which names would like to go, up to the right if None. The same input gives the same places.
    """
    towards = np.ones_like(anchors) if towards is None else towards
    half = 0.5 * sizes + _SPARE
    found = np.empty_like(anchors)
    for k, anchor in enumerate(anchors):
        centres, away, way = _candidates(anchor, half[k])
        cost = _FAR * away + _LINE * _inside(centres, half[k], lines) + _OUTSIDE * _beyond(centres, half[k], bounds)
        cost += _NAME * _overlaps(centres, half[k], found[:k], half[:k])
        cost -= _TASTE * (way @ towards[k]) / max(float(np.hypot(*towards[k])), 1e-300)
        found[k] = centres[int(cost.argmin())]
    return found


def along(path: Array, step: float) -> Array:
    """Points (p, 2) along a polyline (2, m), at most `step` apart; strokes end where it has NaN."""
    start, end = path[:, :-1].T, path[:, 1:].T
    whole = np.isfinite(start).all(axis=1) & np.isfinite(end).all(axis=1)
    start, end = start[whole], end[whole]
    counts = np.maximum(np.ceil(np.hypot(*(end - start).T) / step).astype(int), 1)
    first = np.concatenate(([0], np.cumsum(counts)[:-1]))
    share = (np.arange(counts.sum()) - np.repeat(first, counts)) / np.repeat(counts, counts)
    between = np.repeat(start, counts, axis=0) + share[:, None] * np.repeat(end - start, counts, axis=0)
    return np.concatenate((between, end[-1:]))


def _candidates(anchor: Array, half: Array) -> tuple[Array, Array, Array]:
    """Centres around an anchor, (c, 2), how far from it (points) their boxes are, and in which direction (c, 2)."""
    way = np.stack((np.cos(_WAYS), np.sin(_WAYS)), axis=1)
    reach = way * half / np.abs(way).max(axis=1, keepdims=True)
    centres = [anchor + reach + away * way for away in _AWAY]
    return np.concatenate(centres), np.repeat(_AWAY, _WAYS.size), np.tile(way, (len(_AWAY), 1))


def _inside(centres: Array, half: Array, points: Array) -> Array:
    """How many points lie in the box about every centre."""
    near = np.abs(points[None] - centres[:, None]) <= half
    return np.asarray(near.all(axis=2).sum(axis=1), dtype=float)


def _overlaps(centres: Array, half: Array, others: Array, halves: Array) -> Array:
    """How many of the other boxes every box meets."""
    near = np.abs(others[None] - centres[:, None]) <= half + halves[None]
    return np.asarray(near.all(axis=2).sum(axis=1), dtype=float)


def _beyond(centres: Array, half: Array, bounds: Array) -> Array:
    """Whether a box leaves the picture."""
    return np.asarray(((centres - half < bounds[:2]) | (centres + half > bounds[2:])).any(axis=1), dtype=float)
