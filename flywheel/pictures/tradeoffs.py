"""Work and precision: the error of every method over its time, both logarithmic, every point with its label."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator
from numpy.typing import NDArray

from flywheel.numerics.units import figure as number
from flywheel.pictures.figures import BLACK, BLUE, DPI, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, figure, name_axes, save
from flywheel.study.tradeoff import FAMILIES, RESTARTED, Row, Tradeoff, ordered
from flywheel.tables.rows import plain, printable

Array = NDArray[np.float64]

_SIZE = (11.0, 7.5)
_FONT = 7.5  # of labels
_LEAST = 1e-17  # what an error bound of 0 is drawn at
_ROOM = 2.5  # factor beyond the outermost points
_LONGEST_TITLE = 90
_MARK, _RINGED, _LEADER = 5.0, 10.0, 8.0  # half a mark's width, ringed; distance from which a label gets a leader
_LOOKS = (
    *((VERMILLION, "s"), (ORANGE, "D"), (GREY, "X"), (BLUE, "o"), (BLUE, "o"), (SKY, "p")),
    *(("#8C6D31", "v"), (GREEN, "^"), (PURPLE, "<"), ("#882255", ">"), ("#44AA99", "d")),
    *((BLACK, "P"), ("#C0A000", "*")),
)
_LOOK = dict(zip(FAMILIES, _LOOKS, strict=True))
_OTHER = (BLACK, "h")


def plot(found: Tradeoff, path: str | Path) -> None:
    """Draw a comparison into a file: PNG, SVG or PDF, as its ending says; ValueError for any other."""
    save(draw(found), path)


def draw(found: Tradeoff) -> Figure:
    """The picture, not yet written anywhere.

    Errors below the reference's own error bound stand on the upper edge of a shaded floor. Methods that start afresh where
    loads break are filled, those that do not are hollow. Colour and marker tell the family, a line joins its settings.
    """
    rows = [row for row in ordered(found.rows) if row.error is not None and row.seconds]
    title = " ".join(printable(found.title or "").split())
    title = title if len(title) <= _LONGEST_TITLE else title[: _LONGEST_TITLE - 1] + "…"
    heading = f"{found.figure}: error against time"
    made = figure(*_SIZE, f"{title}\n{heading}" if title else heading)
    made.set_dpi(DPI)  # sizes of texts are those of the picture that is written
    panel = made.subplots()
    name_axes(panel, _subtitle(found, len(rows)), "median time, ms", "true relative error")
    panel.title.set_fontsize(10.5)

    floor = max(found.reference.doubt, _LEAST)
    points = np.array([(1e3 * (row.seconds or 0.0), max(row.error or 0.0, floor)) for row in rows]).reshape(-1, 2)
    panel.set_xscale("log")
    panel.set_yscale("log")
    low, high = (points[:, 0].min(), points[:, 0].max()) if len(points) else (0.1, 1e3)
    panel.set_xlim(low / _ROOM, high * _ROOM**2)
    errors = np.append(points[:, 1], [floor, found.rtol])
    panel.set_ylim(errors.min() / _ROOM**3, errors.max() * _ROOM**2)
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value, most=6)))
    panel.yaxis.set_major_locator(LogLocator(numticks=20))
    panel.yaxis.set_minor_locator(LogLocator(subs=()))
    panel.axhline(found.rtol, color=VERMILLION, lw=1.2, ls="--", zorder=1, label=f"asked: {found.rtol:g}")
    label = f"the reference's doubt: {floor:.1e}"
    panel.axhspan(panel.get_ylim()[0], floor, color=GREY, alpha=0.18, lw=0, zorder=0, label=label)

    left, right = panel.get_xlim()
    lines = [((left, found.rtol), (right, found.rtol)), *_draw_series(panel, rows, points)]
    marks = np.full(len(rows), _MARK)
    for k, row in enumerate(rows):
        if row.name == found.cheapest:
            panel.plot(*points[k], "o", ms=17, mfc="none", mec=VERMILLION, mew=2.0, zorder=4, label="cheapest that keeps it")
            marks[k] = _RINGED
    if any(_hollow(row, rows) for row in rows):
        panel.plot([], [], ls=":", marker="o", color=GREY, mfc="white", ms=7, label="hollow: without restart")
    made.legend(loc="outside lower center", ncols=4, fontsize=8.5, frameon=False)
    made.get_layout_engine().execute(made)  # type: ignore[union-attr]
    made.set_layout_engine("none")  # the panel has its place now
    texts = [made.text(0.0, 0.0, row.label, fontsize=_FONT, va="bottom", parse_math=False) for row in rows]
    if texts:
        _arrange(made, panel, points, marks, texts, lines)
    return made


def _subtitle(found: Tradeoff, shown: int) -> str:
    best = "No method that was run keeps what is asked"
    if found.cheapest is not None:
        row = found.row(found.cheapest)
        best = f"Cheapest that keeps {found.rtol:g}: {row.name}, {plain(1e3 * (row.seconds or 0.0), 3)} ms"
    if not found.complete:
        return f"{best}\nNOT WHOLE: {len(found.rows) - shown} of {len(found.rows)} methods are missing"
    return f"{best}; {len(found.rows) - shown} methods have no answer" if shown < len(found.rows) else best


def _draw_series(panel: Axes, rows: list[Row], points: Array) -> list[tuple[Array, Array]]:
    """Markers of each family, and lines through its settings, those with a restart apart from those without."""
    lines: list[tuple[Array, Array]] = []
    labelled = set[str]()
    for (family, _), group in groupby(range(len(rows)), lambda k: (rows[k].family, rows[k].name.endswith(RESTARTED))):
        places = list(group)
        own = points[places]
        colour, marker = _LOOK.get(family, _OTHER)
        style: Any = {"color": colour, "marker": marker, "ms": 7, "mew": 1.3, "lw": 1.0, "alpha": 0.95}
        hollow = _hollow(rows[places[0]], rows)
        label = None if family in labelled else family
        panel.plot(*own.T, mfc="white" if hollow else colour, ls=":" if hollow else "-", label=label, zorder=3, **style)
        labelled.add(family)
        lines += pairwise(own)
    return lines


def _hollow(row: Row, rows: list[Row]) -> bool:
    """Whether a row has no restart where others of its family have one."""
    family = [other for other in rows if other.family == row.family]
    return not row.name.endswith(RESTARTED) and any(other.name.endswith(RESTARTED) for other in family)


def _arrange(made: Figure, panel: Axes, points: Array, marks: Array, texts: list[Any], lines: Sequence[Any]) -> None:
    """Put labels beside their points, and draw thin leaders to them; lengths are counted in points (1/72 inch).

    `marks` is half of every mark's width, `lines` the ends of lines in the panel's units.
    """
    dots = 72.0 / made.dpi
    sizes = dots * np.array([[box.width, box.height] for box in (text.get_window_extent() for text in texts)])
    pixels = panel.transData.transform
    segments = np.array([[pixels(start), pixels(end)] for start, end in lines]).reshape(-1, 4)
    anchors = dots * np.array([pixels(point) for point in points])
    blocks = np.concatenate([anchors - marks[:, None], anchors + marks[:, None]], axis=1)
    found = placed(anchors, sizes, dots * np.array(panel.get_window_extent().extents), blocks, dots * segments)
    whole = np.array(_SIZE) * 72.0
    for text, corner, end, point in zip(texts, found.corners, found.ends, anchors, strict=True):
        text.set_position(corner / whole)
        if np.hypot(*(end - point)) > _LEADER:
            made.add_artist(Line2D(*np.stack([point, end], axis=1) / whole[:, None], color=GREY, lw=0.5, zorder=2))


# -- places of labels --------------------------------------------------------------------------------------------------

_DIRECTIONS, _RINGS = 32, 32
_GAP = 6.0  # from a point to its label (the unit of all lengths: pixels, or points)
_AROUND = 2.0  # around a label
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
    offers = []  # of each label its places and what they cost whatever other labels do, the cheapest first
    for point, size in zip(points, sizes, strict=True):
        boxes = _offers(point, size, frame)
        distance = np.hypot(*(_leaders(boxes, point)[:, 2:] - point).T)
        apart = points[(np.abs(points - point) > _GAP).any(axis=1)]
        dots = np.concatenate([apart - 0.5 * _GAP, apart + 0.5 * _GAP], axis=1)
        cost = distance * (1.0 + distance / _FAR) + _COVERED * _overlaps(boxes, blocks).sum(axis=1)
        cost = cost + _DOTTED * _struck(_leaders(boxes, point), dots).sum(axis=1)
        cost = cost + _UNDER * _struck(lines, boxes).sum(axis=0)
        order = np.argsort(cost, kind="stable")
        offers.append((boxes[order], cost[order]))
    count = len(points)
    order = np.argsort([-float((1.0 / (20.0 + np.hypot(*(points - point).T))).sum()) for point in points], kind="stable")
    boxes, leaders = np.full((count, 4), np.nan), np.full((count, 4), np.nan)
    for _ in range(_SWEEPS):
        before = boxes.copy()
        for k in order:
            others = ~np.isnan(boxes[:, 0]) & (np.arange(count) != k)
            own, costs = offers[k]
            boxes[k] = _cheapest(own, costs, points[k], boxes[others], leaders[others])
            leaders[k] = _leaders(boxes[k][None], points[k])[0]
        if np.array_equal(boxes, before):
            break
    return Placed(boxes[:, :2] + _AROUND, leaders[:, 2:])


def _offers(point: Array, size: Array, frame: Sequence[float] | Array) -> Array:
    """Boxes around a point within the frame, the nearest first; one moved into the frame where none fits."""
    width, height = size + 2 * _AROUND
    turns = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    radii = _GAP + _STEP * np.arange(_RINGS) ** 1.25
    way = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    half = np.array([0.5 * width, 0.5 * height])
    # the box's edge, not its middle, goes around the point
    corner = (point + way[None] * radii[:, None, None] + way * half - half).reshape(-1, 2)
    boxes = np.concatenate([corner, corner + np.array([width, height])], axis=1)
    left, bottom, right, top = frame
    inside = (boxes[:, 0] >= left) & (boxes[:, 1] >= bottom) & (boxes[:, 2] <= right) & (boxes[:, 3] <= top)
    if inside.any():
        return np.asarray(boxes[inside])
    x, y = np.clip(point, [left, bottom], [max(left, right - width), max(bottom, top - height)])
    return np.array([[x, y, x + width, y + height]])


def _cheapest(boxes: Array, base: Array, point: Array, others: Array, standing: Array) -> Array:
    """The best of places beside labels and leaders that stand; those too dear by themselves are not looked at."""
    best, least = boxes[0], np.inf
    for start in range(0, len(boxes), _CHUNK):
        if base[start] >= least:
            break
        part = boxes[start : start + _CHUNK]
        leaders = _leaders(part, point)
        cost = _COVERED * _overlaps(part, others).sum(axis=1)
        cost = cost + _STRUCK * (_struck(leaders, others).sum(axis=1) + _struck(standing, part).sum(axis=0))
        cost = base[start : start + _CHUNK] + (cost + _CROSSED * _crossings(leaders, standing).sum(axis=1))
        k = int(cost.argmin())
        if cost[k] < least:
            best, least = part[k], float(cost[k])
    return np.asarray(best)


def _leaders(boxes: Array, point: Array) -> Array:
    """Segments from a point to the nearest place of each box."""
    ends = np.clip(point, boxes[:, :2] + _AROUND, boxes[:, 2:] - _AROUND)
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
