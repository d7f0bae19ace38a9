"""Common parts of all pictures: colours, one way to make a figure and one to write it, with the same output every time.

Figures are separate objects: no global state is changed, nothing is displayed. Colours are those of Okabe and Ito, which the
colour-blind can distinguish; in the form for print they become greys, with a dash for each line and a hatch for each fill.
Texts of an SVG stay texts: that is why there is no mathematical typesetting and no effect on texts.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection
from matplotlib.colors import to_hex, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text
from matplotlib.ticker import ScalarFormatter
from numpy.typing import NDArray

from bondgraph.files import replacement
from flywheel import language
from flywheel.pictures import current_form

Array = NDArray[np.float64]

BLACK, GREY, PALE = "#000000", "#6E6E6E", "#DDDDDD"
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
COLOURS = {
    "ink": BLACK,
    "grey": "#BBBBBB",
    "blue": BLUE,
    "vermillion": VERMILLION,
    "green": GREEN,
    "purple": PURPLE,
    "orange": ORANGE,
    "sky": SKY,
    "yellow": "#F0E442",
}
BODIES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, "#8C6D31", "#999999")
FORMATS: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
STYLE: Any = {
    "font.size": 10.0,
    "font.sans-serif": ["DejaVu Sans", "Verdana", "sans-serif"],
    "axes.titlesize": 11.5,
    "hatch.linewidth": 0.6,
    "svg.fonttype": "none",
    "svg.hashsalt": "flywheel",
    "pdf.fonttype": 42,
}
DPI = 125


class Picture(Figure):
    """A figure whose names inside panels get their places when it is first drawn, by the functions in `later`."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.later: list[Callable[[], None]] = []

    def draw(self, renderer: Any) -> None:
        """Draws it; the first time also determines its layout."""
        later, self.later = self.later, []
        if later:
            super().draw(renderer)
            for rest in later:
                rest()
        super().draw(renderer)


def figure(width: float, height: float, title: str, apart: float = 0.08) -> Picture:
    """An empty figure (inches), laid out so that nothing overlaps; panels stand `apart` (inches, on each side)."""
    made = Picture(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    made.get_layout_engine().set(w_pad=apart, h_pad=apart)  # type: ignore[union-attr, call-arg]
    if title:
        made.suptitle(title, fontsize=13, parse_math=False)
    return made


def lay_out(made: Figure) -> None:
    """Gives every panel of a figure its place, for good: what comes later, such as names, needs no more room."""
    made.get_layout_engine().execute(made)  # type: ignore[union-attr]
    made.set_layout_engine("none")


def save(made: Figure, path: str | Path) -> None:
    """Writes a figure as PNG, SVG or PDF, by its ending; ValueError for any other, OSError if it cannot be written."""
    import warnings

    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in FORMATS:
        raise ValueError(f"found {str(path)!r}, expected a file name ending in .png, .svg or .pdf")
    finish(made)
    with replacement(path, kind) as fresh, rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # of a title; the picture has a box there
        made.savefig(fresh, format=kind, dpi=DPI, metadata=FORMATS[kind])


class Numbers(ScalarFormatter):
    """The numbers along an axis, with the decimal mark of the language in use."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """A number as text."""
        return language.number(super().__call__(x, pos))

    def get_offset(self) -> str:
        """Common offset of all numbers."""
        return language.number(super().get_offset())


def finish(made: Figure) -> None:
    """Last steps: numbers in the language in use, names in their places, greys in the form for print."""
    if language.current() != "en":
        for axis in made.findobj(Axis):
            if type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(Numbers())
    if isinstance(made, Picture) and made.later:
        made.draw_without_rendering()
    if current_form() == "print":
        in_greys(made)


_IN_PRINT: dict[str, tuple[str, Any, str]] = {  # of a colour: its grey, the dash of its lines, the hatch of its fills
    BLUE: ("#000000", (0, (6, 1.5)), "///"),
    VERMILLION: ("#000000", (0, (4, 2)), "---"),
    GREEN: ("#000000", (0, (7, 2, 1, 2)), "xxx"),
    PURPLE: ("#000000", (0, (1, 1.5)), "|||"),
    ORANGE: ("#555555", (0, (4, 2)), "\\\\\\"),
    SKY: ("#555555", "-", "///"),
    "#8C6D31": ("#555555", (0, (7, 2, 1, 2)), "++"),
    "#F0E442": ("#777777", (0, (1, 1.5)), "+++"),
}


def in_greys(made: Figure) -> None:
    """Turns a figure into the form for print: lines distinguished by dashes, fills by hatches, in greys."""
    for panel in (*made.findobj(Axes), *made.legends):
        lines = panel.findobj(Line2D)
        colours = {to_hex(line.get_color()).upper() for line in lines if line.get_linestyle() != "None"}
        several = len(colours & _IN_PRINT.keys()) > 1
        for line in lines:
            colour = to_hex(line.get_color()).upper()
            grey, dash, _ = _IN_PRINT.get(colour, (_grey(colour), "-", ""))
            if several and colour in _IN_PRINT and line.get_linestyle() == "-":
                line.set_linestyle(dash)
            line.set(color=grey, markerfacecolor=grey, markeredgecolor=grey)
    for text in made.findobj(Text):
        text.set_color(_grey(to_hex(text.get_color())))
    for fill in [*made.findobj(Patch), *made.findobj(Collection)]:
        faces = to_rgba_array(fill.get_facecolor())  # type: ignore[attr-defined]
        edges = to_rgba_array(fill.get_edgecolor())  # type: ignore[attr-defined]
        colour = to_hex(faces[0]).upper() if len(faces) else ""
        if colour in _IN_PRINT and faces[0, 3] > 0.0:
            fill.set(facecolor="white", edgecolor="#555555", hatch=_IN_PRINT[colour][2], alpha=1.0)
            continue
        for own, shades in ((fill.set_facecolor, faces), (fill.set_edgecolor, edges)):  # type: ignore[attr-defined]
            if len(shades):
                greys = [(*_level(shade), shade[3]) for shade in shades]
                own(greys if isinstance(fill, Collection) else greys[0])


def _level(colour: Array) -> tuple[float, float, float]:
    """The grey as bright as a colour."""
    bright = float(np.dot(colour[:3], (0.2126, 0.7152, 0.0722)))
    return bright, bright, bright


def _grey(colour: str) -> str:
    """The grey of a colour, dark enough to read if it is no grey already."""
    red, green, blue, _ = to_rgba_array(colour)[0]
    return colour if red == green == blue else "#000000"


_DECIMALS = re.compile(r"-?\d+\.\d+")


def _hundredths(match: re.Match[str]) -> str:
    """A coordinate to a hundredth of a point."""
    return f"{float(match[0]):.2f}".rstrip("0").rstrip(".")


def svg(made: Figure, name: str, title: str, description: str) -> str:
    """A figure as an SVG element for an HTML document, as wide as there is room; its ids begin with `name`, unique there.

    A screen reader reads the title and the description.
    """
    finish(made)
    into = StringIO()
    with rc_context(STYLE):
        made.savefig(into, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    drawn = into.getvalue()
    box = re.search(r'viewBox="([^"]*)"', drawn)
    assert box is not None
    body = drawn[drawn.index("<g id=") : drawn.rindex("</svg>")]
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', body))
    body = re.sub(r' id="([^"]*)"', lambda match: f' id="{name}-{match[1]}"' if match[1] in used else "", body)
    body = re.sub(r' d="([^"]*)"', lambda match: f' d="{_DECIMALS.sub(_hundredths, match[1])}"', body)
    body = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", body)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="{box[1]}" role="img" '
        f'aria-labelledby="{name}-title {name}-desc" stroke-linejoin="round" stroke-linecap="butt">\n'
        f'<title id="{name}-title">{escape(title)}</title>\n<desc id="{name}-desc">{escape(description)}</desc>\n'
    )
    return f"{head}{body}</svg>\n"


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
    end, share = (1.0, light) if light > 0 else (0.0, -light)
    return tuple(part + share * (end - part) for part in rgb(colour))  # type: ignore[return-value]


def say(panel: Axes, title: str, why: str) -> None:
    """Writes into a panel why there is nothing to draw."""
    panel.set_title(title)
    panel.set_axis_off()
    panel.text(0.5, 0.5, why, ha="center", va="center", transform=panel.transAxes, fontsize=11, color=GREY)


# -- places of names: beside what they name, clear of lines and of each other as far as there is room -------------------

_AWAY = (5.0, 9.0, 15.0, 24.0, 36.0)  # points from an anchor to the name's box
_WAYS = np.radians(np.arange(16) * 22.5)
_SPARE = 1.5  # points around a name
_LINE, _NAME, _OUTSIDE, _FAR, _TASTE = 4.0, 150.0, 400.0, 0.5, 1.5  # what a place costs
_LONGEST = 10_000  # steps along one segment of a line


def settled(anchors: Array, sizes: Array, lines: Array, bounds: Array, towards: Array | None = None) -> Array:
    """The centres (k, 2) of names of `sizes` (k, 2) beside `anchors` (k, 2), all in points; earlier names choose first.

    `lines` (p, 2) are points along everything drawn, close enough together that no name fits between two of them;
    `bounds` (4,) are left, bottom, right and top of the picture; `towards` (k, 2) are the preferred directions of the names,
    up to the right if None. The same input gives the same places.
    """
    towards = np.ones_like(anchors) if towards is None else towards
    halves = 0.5 * sizes + _SPARE
    ways = np.stack((np.cos(_WAYS), np.sin(_WAYS)), axis=1)
    away, way = np.repeat(_AWAY, _WAYS.size), np.tile(ways, (len(_AWAY), 1))
    places = np.empty_like(anchors)
    for k, (anchor, half) in enumerate(zip(anchors, halves, strict=True)):
        centres = anchor + way * half / np.abs(way).max(axis=1, keepdims=True) + away[:, None] * way
        on_lines = (np.abs(lines[None] - centres[:, None]) <= half).all(axis=2).sum(axis=1)
        on_names = (np.abs(places[None, :k] - centres[:, None]) <= half + halves[None, :k]).all(axis=2).sum(axis=1)
        outside = ((centres - half < bounds[:2]) | (centres + half > bounds[2:])).any(axis=1)
        cost = _FAR * away + _LINE * on_lines + _OUTSIDE * outside
        cost += _NAME * on_names
        cost -= _TASTE * (way @ towards[k]) / max(float(np.hypot(*towards[k])), 1e-300)
        places[k] = centres[int(cost.argmin())]
    return places


def along(path: Array, step: float) -> Array:
    """Points (p, 2) along a polyline (2, m), at most `step` apart; strokes end where it has NaN.

    A segment that is far longer than any panel, such as a tangent of a loop that is a point, has `_LONGEST` of them.
    """
    start, end = path[:, :-1].T, path[:, 1:].T
    whole = np.isfinite(start).all(axis=1) & np.isfinite(end).all(axis=1)
    start, end = start[whole], end[whole]
    counts = np.clip(np.ceil(np.hypot(*(end - start).T) / step), 1, _LONGEST).astype(int)
    first = np.concatenate(([0], np.cumsum(counts)[:-1]))
    share = (np.arange(counts.sum()) - np.repeat(first, counts)) / np.repeat(counts, counts)
    between = np.repeat(start, counts, axis=0) + share[:, None] * np.repeat(end - start, counts, axis=0)
    return np.concatenate((between, end[-1:]))


def scale(panel: Axes) -> tuple[float, float]:
    """Points for each unit along a panel's axes, which must have their places already."""
    origin, unit = panel.transData.transform([(0.0, 0.0), (1.0, 1.0)])
    across, up = 72.0 / panel.figure.dpi * (unit - origin)
    return float(across), float(up)


def size(panel: Axes, text: Text) -> tuple[float, float]:
    """The width and the height of a text, points."""
    text.set_visible(True)
    box = text.get_window_extent()
    return 72.0 / panel.figure.dpi * box.width, 72.0 / panel.figure.dpi * box.height


def name(panel: Axes, words: str, **style: Any) -> Text:
    """A name inside a panel, which `settle` places when the figure has its layout."""
    return panel.text(0.5, 0.5, words, in_layout=False, visible=False, ha="center", va="center", **style)


def thinned(x: Array, *curves: Array, tolerance: float = 3e-4) -> list[Array]:
    """X and curves over it without the points that lie on lines between others, within a share of the heights.

    >>> [part.tolist() for part in thinned(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, 2.0, 0.0]))]
    [[0.0, 2.0, 3.0], [0.0, 2.0, 0.0]]
    """
    points = np.stack([x, *curves])
    heights = points[1:] / max(float(np.ptp(points[1:])), 1e-300)
    keep = np.zeros(x.size, dtype=bool)
    keep[[0, -1]] = True
    pieces = [(0, x.size - 1)]
    while pieces:
        first, last = pieces.pop()
        if last - first < 2:
            continue
        wide = x[last] - x[first]
        share = (x[first : last + 1] - x[first]) / wide if wide > 0.0 else np.zeros(last + 1 - first)
        between = heights[:, first, None] + share * (heights[:, last] - heights[:, first])[:, None]
        off = np.abs(heights[:, first : last + 1] - between).max(axis=0)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            keep[first + worst] = True
            pieces += [(first, first + worst), (first + worst, last)]
    return list(points[:, keep])


def settle(
    panel: Axes,
    texts: Sequence[Text],
    spots: Array,
    lines: Sequence[Array],
    towards: Array | None = None,
    *,
    keep: int | None = None,
    leaders: bool = False,
) -> None:
    """Puts texts beside spots (k, 2), clear of lines (2, m) and of each other; all in the units of the panel's axes.

    `towards` (k, 2) are the preferred directions of the texts. The panel must have its place already. Of the texts
    from number `keep` on, those that would lie on another or outside are left out. With leaders a thin line joins a spot to
    a distant text.
    """
    if not texts:
        return
    for text in texts:
        text.set(ha="center", va="center", in_layout=False, visible=True)
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.4})
    points, to_pixels = 72.0 / panel.figure.dpi, panel.transData.transform
    sizes = points * np.array([text.get_window_extent().size for text in texts])
    drawn = np.concatenate([along(points * to_pixels(line.T).T, 3.0) for line in lines])
    anchors, bounds = points * to_pixels(spots), points * np.array(panel.bbox.extents)
    centres = settled(anchors, sizes, drawn, bounds, towards)
    taken: list[int] = []
    for k, (text, centre) in enumerate(zip(texts, panel.transData.inverted().transform(centres / points), strict=True)):
        text.set_position(centre)
        half = 0.5 * sizes[k]
        upon = any((np.abs(centres[k] - centres[j]) < half + 0.5 * sizes[j]).all() for j in taken)
        outside = bool((centres[k] - half < bounds[:2]).any() or (centres[k] + half > bounds[2:]).any())
        if keep is not None and k >= keep and (upon or outside):
            text.remove()
            continue
        taken.append(k)
        apart = np.abs(centres[k] - anchors[k]) - half
        if leaders and apart.max() > 6.0:
            panel.plot(*np.stack((spots[k], centre), axis=1), color=GREY, lw=0.6, zorder=5.5)


def rgb(colour: str) -> tuple[float, float, float]:
    """A colour's red, green and blue, from 0 to 1."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue
