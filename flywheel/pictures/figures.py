"""What all pictures share: colours, one way to make a figure and one to write it, the same every time.

Figures are objects of their own: no global state is touched, nothing is shown. Colours are those of Okabe and Ito, which
the colour-blind can tell apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from numpy.typing import NDArray

from bondgraph.storage.files import replacement
from flywheel.numerics.units import figure as number

Array = NDArray[np.float64]

BLACK, GREY, PALE = "#000000", "#6E6E6E", "#DDDDDD"
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
BODIES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, "#8C6D31", "#999999")
FORMATS: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
STYLE: Any = {"font.size": 10.0, "axes.titlesize": 11.5, "svg.hashsalt": "flywheel", "pdf.fonttype": 42}
DPI = 125


def figure(width: float, height: float, title: str, apart: float = 0.08) -> Figure:
    """An empty figure (inches), laid out so that nothing overlaps; panels stand `apart` (inches, on each side)."""
    made = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    made.get_layout_engine().set(w_pad=apart, h_pad=apart)  # type: ignore[union-attr, call-arg]
    if title:
        made.suptitle(title, fontsize=13, parse_math=False)
    return made


def save(made: Figure, path: str | Path) -> None:
    """Write a figure as PNG, SVG or PDF, as the path ends; ValueError for any other ending, OSError where it cannot be."""
    import warnings

    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in FORMATS:
        raise ValueError(f"found {str(path)!r}, expected a file name ending in .png, .svg or .pdf")
    with replacement(path, kind) as fresh, rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # of a title; the picture has a box there
        made.savefig(fresh, format=kind, dpi=DPI, metadata=FORMATS[kind])


def name_axes(panel: Axes, title: str, xlabel: str, ylabel: str) -> None:
    """Title, labels and a faint grid."""
    panel.set_title(title, parse_math=False)
    panel.set_xlabel(xlabel)
    panel.set_ylabel(ylabel)
    panel.grid(color=PALE, linewidth=0.6)
    panel.set_axisbelow(True)


def shade(colour: str, light: float) -> tuple[float, float, float]:
    """A colour mixed with white (light > 0) or with black (light < 0), by that share.

    >>> shade("#0000FF", 0.5), shade("#0000FF", -0.5)
    ((0.5, 0.5, 1.0), (0.0, 0.0, 0.5))
    """
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    end, share = (1.0, light) if light > 0 else (0.0, -light)
    return tuple(part + share * (end - part) for part in (red, green, blue))  # type: ignore[return-value]


def told(value: float, most: int = 5, error: float = 0.0) -> str:
    """A number with a true minus sign."""
    return number(value, error, most).replace("-", "−")


def say(panel: Axes, title: str, why: str) -> None:
    """A panel that has nothing to draw says why."""
    panel.set_title(title)
    panel.set_axis_off()
    panel.text(0.5, 0.5, why, ha="center", va="center", transform=panel.transAxes, fontsize=11, color=GREY)


# -- places of names: beside what they name, clear of lines and of each other as far as there is room -------------------

_AWAY = (5.0, 9.0, 15.0, 24.0, 36.0)  # points from an anchor to the name's box
_WAYS = np.radians(np.arange(16) * 22.5)
_SPARE = 1.5  # points around a name
_LINE, _NAME, _OUTSIDE, _FAR, _TASTE = 4.0, 150.0, 400.0, 0.5, 1.5  # what a place costs


def settled(anchors: Array, sizes: Array, lines: Array, bounds: Array, towards: Array | None = None) -> Array:
    """The centres (k, 2) of names of `sizes` (k, 2) beside `anchors` (k, 2), all in points; earlier names choose first.

    `lines` (p, 2) are points along everything drawn, close enough together that no name fits between two of them;
    `bounds` (4,) are left, bottom, right and top of the picture; `towards` (k, 2) are the
    directions in which names would like to go, up to the right if None. The same input gives the same places.
    """
    towards = np.ones_like(anchors) if towards is None else towards
    halves = 0.5 * sizes + _SPARE
    ways = np.stack((np.cos(_WAYS), np.sin(_WAYS)), axis=1)
    away, way = np.repeat(_AWAY, _WAYS.size), np.tile(ways, (len(_AWAY), 1))
    found = np.empty_like(anchors)
    for k, (anchor, half) in enumerate(zip(anchors, halves, strict=True)):
        centres = anchor + way * half / np.abs(way).max(axis=1, keepdims=True) + away[:, None] * way
        on_lines = (np.abs(lines[None] - centres[:, None]) <= half).all(axis=2).sum(axis=1)
        on_names = (np.abs(found[None, :k] - centres[:, None]) <= half + halves[None, :k]).all(axis=2).sum(axis=1)
        outside = ((centres - half < bounds[:2]) | (centres + half > bounds[2:])).any(axis=1)
        cost = _FAR * away + _LINE * on_lines + _OUTSIDE * outside
        cost += _NAME * on_names
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


def settle(panel: Axes, texts: Sequence[Text], spots: Array, lines: Sequence[Array], towards: Array | None = None) -> None:
    """Put texts beside spots (k, 2), clear of lines (2, m) and of each other; all in the units of the panel's axes.

    `towards` (k, 2) are the directions in which texts would like to go. The panel must have its place already.
    """
    if not texts:
        return
    for text in texts:
        text.set(ha="center", va="center", in_layout=False)
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white", alpha=0.8)])
    points, to_pixels = 72.0 / panel.figure.dpi, panel.transData.transform
    sizes = points * np.array([text.get_window_extent().size for text in texts])
    drawn = np.concatenate([along(points * to_pixels(line.T).T, 3.0) for line in lines])
    centres = settled(points * to_pixels(spots), sizes, drawn, points * np.array(panel.bbox.extents), towards)
    for text, centre in zip(texts, panel.transData.inverted().transform(centres / points), strict=True):
        text.set_position(centre)
