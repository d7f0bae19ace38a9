"""Labels beside points, pushed apart: no label covers another, a point, or the edge of its panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_DIRECTIONS, _RINGS = 32, 32
_GAP = 6.0  # from a point to its label (the unit of all lengths: pixels, or points)
_ROOM = 2.0  # around a label
_STEP = 8.0  # between two rings of candidates
_SWEEPS = 4
_CHUNK = 48  # places looked at together
_FAR = 40.0  # beyond which distance counts more than in proportion
_COVERED, _STRUCK, _DOTTED, _CROSSED, _UNDER = 1e6, 1e3, 300.0, 150.0, 15.0  # what a place costs beside the distance


class Placed(NamedTuple):
    """Where labels stand: lower left corners, and of each the point on its edge that its leader comes to; shape (n, 2)."""

    corners: Array
    ends: Array


def placed(points: Array, sizes: Array, frame: Sequence[float] | Array, blocks: Array, lines: Array) -> Placed:
    """Places of labels beside their points, by a greedy choice among places around each, looked over again a few times.

    The most crowded labels choose first. A place costs its distance, and more where it lies across a leader or a line.

    Args:
        points: what is labelled, shape (n, 2).
        sizes: widths and heights of the labels, shape (n, 2).
        frame: left, bottom, right, top, that labels stay within.
        blocks: rectangles (left, bottom, right, top) that no label may cover, shape (m, 4).
        lines: segments (x, y, x, y) that labels had better not cover, shape (k, 4).

    """
    count = len(points)
    offers = [_ranked(point, size, frame, blocks, points, lines) for point, size in zip(points, sizes, strict=True)]
    order = np.argsort([-_crowd(points, point) for point in points], kind="stable")
    boxes: Array = np.full((count, 4), np.nan)
    leaders: Array = np.full((count, 4), np.nan)
    for _ in range(_SWEEPS):
        before = boxes.copy()
        for k in order:
            others = ~np.isnan(boxes[:, 0]) & (np.arange(count) != k)
            boxes[k] = _cheapest(offers[k], points[k], boxes[others], leaders[others])
            leaders[k] = _leaders(boxes[k][None], points[k])[0]
        if np.array_equal(boxes, before):
            break
    return Placed(boxes[:, :2] + _ROOM, leaders[:, 2:])


def _ranked(
    point: Array, size: Array, frame: Sequence[float] | Array, blocks: Array, points: Array, lines: Array
) -> tuple[Array, Array]:
    """Places of a label and what they cost whatever other labels do, the cheapest first."""
    boxes = _offers(point, size, frame)
    cost = _base(boxes, point, blocks, points, lines)
    order = np.argsort(cost, kind="stable")
    return boxes[order], cost[order]


def _cheapest(ranked: tuple[Array, Array], point: Array, others: Array, standing: Array) -> Array:
    """The best of ranked places beside labels that stand; those that are too dear by themselves are not looked at."""
    boxes, base = ranked
    best, least = boxes[0], np.inf
    for start in range(0, len(boxes), _CHUNK):
        if base[start] >= least:
            break
        part = slice(start, start + _CHUNK)
        cost = base[part] + _cost(boxes[part], point, others, standing)
        k = int(cost.argmin())
        if cost[k] < least:
            best, least = boxes[part][k], float(cost[k])
    return np.asarray(best)


def _offers(point: Array, size: Array, frame: Sequence[float] | Array) -> Array:
    """Boxes around a point within the frame, the nearest first; one moved into the frame where none fits."""
    width, height = size + 2 * _ROOM
    turns = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    radii = _GAP + _STEP * np.arange(_RINGS) ** 1.25
    way = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    reach = way[None] * radii[:, None, None]
    # the box's edge, not its middle, goes around the point
    middle = point + reach + way * np.array([0.5 * width, 0.5 * height])
    corner = (middle - np.array([0.5 * width, 0.5 * height])).reshape(-1, 2)
    boxes = np.concatenate([corner, corner + np.array([width, height])], axis=1)
    left, bottom, right, top = frame
    inside = (boxes[:, 0] >= left) & (boxes[:, 1] >= bottom) & (boxes[:, 2] <= right) & (boxes[:, 3] <= top)
    if inside.any():
        return np.asarray(boxes[inside])
    x, y = np.clip(point, [left, bottom], [max(left, right - width), max(bottom, top - height)])
    return np.array([[x, y, x + width, y + height]])


def _base(boxes: Array, point: Array, blocks: Array, points: Array, lines: Array) -> Array:
    """What places cost whatever other labels do."""
    distance = np.hypot(*(_nearest(boxes, point) - point).T)
    cost = distance * (1.0 + distance / _FAR) + _COVERED * _overlaps(boxes, blocks).sum(axis=1)
    leaders = _leaders(boxes, point)
    apart = points[(np.abs(points - point) > _GAP).any(axis=1)]
    dots = np.concatenate([apart - 0.5 * _GAP, apart + 0.5 * _GAP], axis=1)
    cost = cost + _DOTTED * _struck(leaders, dots).sum(axis=1)
    return np.asarray(cost + _UNDER * _struck(lines, boxes).sum(axis=0))


def _cost(boxes: Array, point: Array, others: Array, standing: Array) -> Array:
    """What places cost for the labels that stand already, and their leaders."""
    leaders = _leaders(boxes, point)
    cost = _COVERED * _overlaps(boxes, others).sum(axis=1)
    cost = cost + _STRUCK * (_struck(leaders, others).sum(axis=1) + _struck(standing, boxes).sum(axis=0))
    return np.asarray(cost + _CROSSED * _crossings(leaders, standing).sum(axis=1))


def _crowd(points: Array, point: Array) -> float:
    return float((1.0 / (20.0 + np.hypot(*(points - point).T))).sum())


def _nearest(boxes: Array, point: Array) -> Array:
    """Of each box the place that is nearest to a point."""
    return np.asarray(np.clip(point, boxes[:, :2] + _ROOM, boxes[:, 2:] - _ROOM))


def _leaders(boxes: Array, point: Array) -> Array:
    ends = _nearest(boxes, point)
    return np.concatenate([np.broadcast_to(point, ends.shape), ends], axis=1)


def _overlaps(first: Array, second: Array) -> NDArray[np.bool_]:
    """Whether boxes overlap, each of the first with each of the second."""
    a, b = first[:, None, :], second[None, :, :]
    return np.asarray((a[..., :2] < b[..., 2:]).all(axis=-1) & (b[..., :2] < a[..., 2:]).all(axis=-1))


def _struck(segments: Array, boxes: Array) -> NDArray[np.bool_]:
    """Whether segments run through boxes, each through each, by the shares of the segment within a box's sides."""
    start, way = segments[:, None, :2], segments[:, None, 2:] - segments[:, None, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (boxes[None, :, :2] - start) / way, (boxes[None, :, 2:] - start) / way
    near, far = np.fmin(low, high), np.fmax(low, high)
    still = way == 0.0
    within = (start > boxes[None, :, :2]) & (start < boxes[None, :, 2:])
    near = np.where(still, np.where(within, -np.inf, np.inf), near).max(axis=-1)
    far = np.where(still, np.where(within, np.inf, -np.inf), far).min(axis=-1)
    return np.asarray(np.maximum(near, 0.0) < np.minimum(far, 1.0))


def _crossings(first: Array, second: Array) -> NDArray[np.bool_]:
    """Whether segments cross, each with each; those from one point do not."""
    p, q = first[:, None, :2], first[:, None, 2:]
    r, s = second[None, :, :2], second[None, :, 2:]
    return np.asarray((_side(p, q, r) * _side(p, q, s) < 0.0) & (_side(r, s, p) * _side(r, s, q) < 0.0))


def _side(a: Array, b: Array, c: Array) -> Array:
    return np.asarray((b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0]))
