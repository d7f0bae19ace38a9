"""Work and precision: the error of every method over its time, both logarithmic, every point with its label."""

from __future__ import annotations

from itertools import groupby, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator
from numpy.typing import NDArray

from flywheel.numerics.units import figure as number
from flywheel.pictures import figures
from flywheel.pictures.figures import BLACK, BLUE, DPI, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, figure, name_axes, save
from flywheel.report.rows import printable
from flywheel.report.tradeoffs import ordered, plain
from flywheel.study.question import FAMILIES, RESTARTED
from flywheel.study.tradeoff import Row, Tradeoff

Array = NDArray[np.float64]

_SIZE = (11.0, 7.5)
_FONT = 7.5  # of labels
_LEAST = 1e-17  # what a doubt of 0 is drawn at
_ROOM = 2.5  # factor beyond the outermost points
_LONGEST_TITLE = 90
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

    Errors below the reference's doubt stand on the upper edge of a shaded floor. Methods that start afresh where loads
    break are filled, those that do not are hollow.
    """
    rows = [row for row in ordered(found.rows) if row.error is not None and row.seconds]
    made = figure(*_SIZE, _heading(found))
    made.set_dpi(DPI)  # sizes of texts are those of the picture that is written
    panel = made.subplots()
    name_axes(panel, _subtitle(found, len(rows)), "median time, ms", "true relative error")
    panel.title.set_fontsize(10.5)
    points = _points(found, rows)
    _scales(panel, found, points)
    _levels(panel, found)
    lines = [_asked(panel, found), *_series(panel, rows, points)]
    marks = _ring(panel, found, rows, points)
    if any(_hollow(row, rows) for row in rows):
        panel.plot([], [], ls=":", marker="o", color=GREY, mfc="white", ms=7, label="hollow: without restart")
    made.legend(loc="outside lower center", ncols=4, fontsize=8.5, frameon=False)
    made.get_layout_engine().execute(made)  # type: ignore[union-attr]
    made.set_layout_engine("none")  # the panel has its place now
    texts = [made.text(0.0, 0.0, row.label, fontsize=_FONT, va="bottom", parse_math=False) for row in rows]
    _arrange(made, panel, points, marks, texts, lines)
    return made


def _heading(found: Tradeoff) -> str:
    title = " ".join(printable(found.title or "").split())
    title = title if len(title) <= _LONGEST_TITLE else title[: _LONGEST_TITLE - 1] + "…"
    asked = f"{found.figure}: error against time"
    return f"{title}\n{asked}" if title else asked


def _subtitle(found: Tradeoff, shown: int) -> str:
    best = "No method that was run keeps what is asked"
    if found.cheapest is not None:
        row = found.row(found.cheapest)
        best = f"Cheapest that keeps {found.rtol:g}: {row.name}, {plain(1e3 * (row.seconds or 0.0), 3)} ms"
    if not found.complete:
        return f"{best}\nNOT WHOLE: {len(found.rows) - shown} of {len(found.rows)} methods are missing"
    return f"{best}; {len(found.rows) - shown} methods have no answer" if shown < len(found.rows) else best


def _points(found: Tradeoff, rows: list[Row]) -> Array:
    """Times (ms) and errors, these no lower than what is known of the reference; shape (n, 2)."""
    floor = _floor(found)
    return np.array([(1e3 * (row.seconds or 0.0), max(row.error or 0.0, floor)) for row in rows]).reshape(-1, 2)


def _floor(found: Tradeoff) -> float:
    return max(found.reference.doubt, _LEAST)


# -- the panel -------------------------------------------------------------------------------------------------------


def _scales(panel: Axes, found: Tradeoff, points: Array) -> None:
    panel.set_xscale("log")
    panel.set_yscale("log")
    low, high = (points[:, 0].min(), points[:, 0].max()) if len(points) else (0.1, 1e3)
    panel.set_xlim(low / _ROOM, high * _ROOM**2)
    errors = np.append(points[:, 1], [_floor(found), found.rtol])
    panel.set_ylim(errors.min() / _ROOM**3, errors.max() * _ROOM**2)
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value, most=6)))
    panel.yaxis.set_major_locator(LogLocator(numticks=20))
    panel.yaxis.set_minor_locator(LogLocator(subs=()))


def _levels(panel: Axes, found: Tradeoff) -> None:
    """What is asked as a line, and the floor below which nothing is known."""
    floor = _floor(found)
    panel.axhline(found.rtol, color=VERMILLION, lw=1.2, ls="--", zorder=1, label=f"asked: {found.rtol:g}")
    label = f"the reference's doubt: {floor:.1e}"
    panel.axhspan(panel.get_ylim()[0], floor, color=GREY, alpha=0.18, lw=0, zorder=0, label=label)


class _Segment(NamedTuple):
    """A line between two settings of a family, in the panel's units."""

    start: Array
    end: Array


def _series(panel: Axes, rows: list[Row], points: Array) -> list[_Segment]:
    """Markers of each family, and lines through its settings, those with a restart apart from those without."""
    lines: list[_Segment] = []
    named = set[str]()
    for (family, _), group in groupby(range(len(rows)), lambda k: (rows[k].family, _restarted(rows[k]))):
        places = list(group)
        own = points[places]
        colour, marker = _LOOK.get(family, _OTHER)
        style: Any = {"color": colour, "marker": marker, "ms": 7, "mew": 1.3, "lw": 1.0, "alpha": 0.95}
        hollow = _hollow(rows[places[0]], rows)
        label = None if family in named else family
        panel.plot(*own.T, mfc="white" if hollow else colour, ls=":" if hollow else "-", label=label, zorder=3, **style)
        named.add(family)
        lines += [_Segment(a, b) for a, b in pairwise(own)]
    return lines


def _restarted(row: Row) -> bool:
    return row.name.endswith(RESTARTED)


def _hollow(row: Row, rows: list[Row]) -> bool:
    """Whether a row has no restart where others of its family have one."""
    return not _restarted(row) and any(_restarted(other) for other in rows if other.family == row.family)


def _asked(panel: Axes, found: Tradeoff) -> _Segment:
    left, right = panel.get_xlim()
    return _Segment(np.array([left, found.rtol]), np.array([right, found.rtol]))


def _ring(panel: Axes, found: Tradeoff, rows: list[Row], points: Array) -> Array:
    """A ring around the cheapest that keeps what is asked; returned is half of every mark's width."""
    halves = np.full(len(rows), _MARK)
    for k, row in enumerate(rows):
        if row.name == found.cheapest:
            panel.plot(*points[k], "o", ms=17, mfc="none", mec=VERMILLION, mew=2.0, zorder=4, label="cheapest that keeps it")
            halves[k] = _RINGED
    return halves


# -- labels ----------------------------------------------------------------------------------------------------------

_MARK, _RINGED, _LEADER = 5.0, 10.0, 8.0  # half a mark's width, ringed; distance from which a label gets a leader


def _arrange(made: Figure, panel: Axes, points: Array, marks: Array, texts: list[Any], lines: list[_Segment]) -> None:
    """Put labels beside their points, and draw thin leaders to them; lengths are counted in points (1/72 inch)."""
    if not texts:
        return
    dots = 72.0 / made.dpi
    sizes = dots * np.array([[box.width, box.height] for box in (text.get_window_extent() for text in texts)])
    segments = np.array([[_place(panel, line.start), _place(panel, line.end)] for line in lines]).reshape(-1, 4)
    anchors = dots * np.array([_place(panel, point) for point in points])
    blocks = np.concatenate([anchors - marks[:, None], anchors + marks[:, None]], axis=1)
    found = figures.placed(anchors, sizes, dots * np.array(panel.get_window_extent().extents), blocks, dots * segments)
    whole = np.array(_SIZE) * 72.0
    for text, corner, end, point in zip(texts, found.corners, found.ends, anchors, strict=True):
        text.set_position(corner / whole)
        if np.hypot(*(end - point)) > _LEADER:
            made.add_artist(_leader(point / whole, end / whole))


def _place(panel: Axes, point: Array) -> Array:
    return np.asarray(panel.transData.transform(point))


def _leader(start: Array, end: Array) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([start[0], end[0]], [start[1], end[1]], color=GREY, lw=0.5, zorder=2)
