"""A bond graph as a picture: half arrows, causal strokes, bond numbers, energy domains by colour.

Figures are objects of their own: no global state is touched, nothing is shown. The colours are those of Okabe and Ito, which
the colour-blind can tell apart.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from bondgraph.causal.strokes import is_integral
from bondgraph.drawing.layout import (
    JUNCTION_SIZE,
    LABEL_SIZE,
    LINE_SPACING,
    NAME_SIZE,
    NUMBER_SIZE,
    Box,
    Layout,
    Line,
    Point,
    half_arrow,
    layout,
    mathtext,
    stroke,
    width,
)
from bondgraph.elements import DOMAINS, STORES
from bondgraph.graph import BondGraph, as_graph
from bondgraph.laws import GraphError, refuse
from bondgraph.storage.files import replacement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from bondgraph.causal.strokes import Causality

COLOURS = {
    "translation": "#D55E00",
    "rotation": "#0072B2",
    "electric": "#009E73",
    "magnetic": "#E69F00",
    "hydraulic": "#56B4E9",
    "thermal": "#CC79A7",
    "chemical": "#6E6E6E",
}
_INK, _FAINT = "#000000", "#555555"
_MARGIN, _LINE = 18.0, 15.0  # points: around the picture, per line of the legend
_NARROWEST = 300.0  # points: room for the caption
_DPI = 200
_TRANSFORMER = r"transformer: $f_{\mathrm{out}} = T\,f_{\mathrm{in}}$,  $e_{\mathrm{in}} = T\,e_{\mathrm{out}}$"
_GYRATOR = r"gyrator: $e_{\mathrm{out}} = G\,f_{\mathrm{in}}$,  $e_{\mathrm{in}} = G\,f_{\mathrm{out}}$"
_DATES: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}


def draw(
    graph: BondGraph,
    file: str | Path | None = None,
    *,
    causality: Causality | Mapping[int, str] | None = None,
    numbers: bool = True,
    title: str | None = None,
) -> Figure:
    """Draw a graph, and save the picture if a file is named; the same graph gives the same file every time.

    Half arrows point where power counts as positive and lie on the flow side of their bonds, below or to the right, with
    the bond numbers on the other side; the bar at one end of a bond is its causal stroke, where effort is received.

    Args:
        graph: the graph.
        file: where to save it, ending in .png, .svg or .pdf.
        causality: the causal strokes, as `bondgraph.causality` finds them (which is what None means), or the name of the
            element at the stroke's end by bond number; an empty mapping draws no strokes.
        numbers: whether to number the bonds.
        title: a line above the picture.

    Raises:
        GraphError: for another file ending, or strokes at elements that their bonds do not have.

    >>> from bondgraph import Builder, I, Se
    >>> figure = draw(Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build(), causality={1: "J"})
    >>> [text.get_text() for text in figure.axes[0].texts]
    ['1', 'shaft', 'I:$J$', 'Se:$M$', '1', '2']

    """
    kind = Path(file).suffix.lower().lstrip(".") if file is not None else ""
    if file is not None and kind not in _DATES:
        raise GraphError(f"found {str(file)!r}, expected a file name ending in .png, .svg or .pdf")
    graph = as_graph(graph)
    strokes, derivative = _causes(graph, causality)
    drawn = layout(graph)
    notes = _notes(graph, derivative)
    axes = _canvas(drawn, title, len(notes))
    for bond in graph.bonds:
        line, domain = drawn.bonds[bond.number], graph.domain(bond)
        colour = COLOURS[domain.name] if domain is not None else _INK
        _plot(axes, line, colour, 1.2)
        _plot(axes, half_arrow(line), colour, 1.2)
        if bond.number in strokes:
            _plot(axes, stroke(line, strokes[bond.number] == bond.head), colour, 2.0)
    for name, label in drawn.labels.items():
        first, *below = drawn.boxes[name]
        lines = [mathtext(line) for line in label.lines]
        if label.junction:
            _write(axes, label.symbol, first.x, first.y, JUNCTION_SIZE)
            for box in below:
                _write(axes, "\n".join(lines), box.x, box.y, NAME_SIZE, _FAINT)
            continue
        text = "\n".join([f"{label.symbol}:{lines[0]}", *lines[1:]]) if lines else label.symbol
        _write(axes, text, first.x, first.y, LABEL_SIZE)
        if name in derivative:
            _dash(axes, first.grown(1.5, 1.5))
    if numbers:
        for number, box in drawn.numbers.items():
            _write(axes, str(number), box.x, box.y, NUMBER_SIZE, _FAINT)
    _draw_notes(axes, notes)
    figure: Figure = axes.figure  # type: ignore[assignment]
    if file is not None:
        from matplotlib import rc_context

        style = rc_context({"svg.hashsalt": "bondgraph", "pdf.fonttype": 42})
        with replacement(Path(file), kind) as fresh, style, warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Glyph .* missing")  # of a name; the picture has a box there
            figure.savefig(fresh, format=kind, dpi=_DPI, metadata=_DATES[kind])
    return figure


def svg(graph: BondGraph) -> str:
    """The picture of a graph as SVG, with its causal strokes, or without them where they conflict.

    >>> from bondgraph import Builder, I, Se
    >>> svg(Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build())[:5]
    '<?xml'

    """
    from io import StringIO

    from matplotlib import rc_context

    try:
        figure = draw(graph)
    except GraphError:
        figure = draw(graph, causality={})
    written = StringIO()
    with rc_context({"svg.hashsalt": "bondgraph", "svg.fonttype": "none"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        figure.savefig(written, format="svg", metadata=_DATES["svg"])
    return written.getvalue()


def _causes(graph: BondGraph, given: Causality | Mapping[int, str] | None) -> tuple[Mapping[int, str], frozenset[str]]:
    """The strokes, and the stores whose causality is derivative: those with their stroke at the wrong end."""
    if given is None:
        from bondgraph.causal.strokes import causality

        given = causality(graph)
    strokes = given if isinstance(given, Mapping) else given.strokes
    bonds = {bond.number: bond for bond in graph.bonds}
    wrong = {n: name for n, name in strokes.items() if n not in bonds or name not in bonds[n][1:]}
    refuse(
        f"the stroke of bond {n} is at {name!r}, found "
        + (f"a bond that joins {bonds[n].tail!r} and {bonds[n].head!r}" if n in bonds else f"no bond {n}")
        for n, name in wrong.items()
    )
    stroked = [(e, strokes.get(graph.bond_of(e.name).number)) for e in graph.of_kind(*STORES)]
    return strokes, frozenset(e.name for e, at in stroked if at is not None and not is_integral(e.kind, at == e.name))


class Note(NamedTuple):
    """A line below the picture: patches of colour with their names, or a sentence, maybe with a sample box."""

    colours: tuple[tuple[str, str], ...] = ()
    text: str = ""
    boxed: bool = False


def _notes(graph: BondGraph, derivative: frozenset[str]) -> list[Note]:
    present = {domain.name for domain in map(graph.domain, graph.bonds) if domain is not None}
    notes = [Note(tuple((name, COLOURS[name]) for name in DOMAINS if name in present))] if present else []
    if derivative:
        notes.append(Note(text="store in derivative causality", boxed=True))
    kinds = {element.kind for element in graph.elements.values()}
    conventions = [_TRANSFORMER] * ("TF" in kinds) + [_GYRATOR] * ("GY" in kinds)
    return notes + [Note(text=text) for text in conventions]


def _canvas(drawn: Layout, title: str | None, lines: int) -> Axes:
    """Axes that fill their figure and count in points, with room for the lines below and the title above."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    left, bottom, right, top = drawn.bounds
    spare = max(_NARROWEST - (right - left), 0.0) / 2.0
    left, right = left - _MARGIN - spare, right + _MARGIN + spare
    bottom -= _MARGIN + (_LINE * lines + _MARGIN / 2.0 if lines else 0.0)
    top += _MARGIN + (2.0 * LABEL_SIZE if title else 0.0)
    figure = Figure(figsize=((right - left) / 72.0, (top - bottom) / 72.0))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(left, right), ylim=(bottom, top))
    axes.set_axis_off()
    if title:
        _write(axes, title.replace("$", r"\$"), (left + right) / 2.0, top - _MARGIN / 2.0 - LABEL_SIZE / 2.0, LABEL_SIZE)
    return axes


def _write(axes: Axes, text: str, x: float, y: float, size: float, colour: str = _INK, **style: Any) -> None:
    style = {"ha": "center", "va": "center", "family": ["STIXGeneral", "DejaVu Sans"], "math_fontfamily": "stix"} | style
    spacing = LINE_SPACING if size in (LABEL_SIZE, NAME_SIZE) else 1.0
    axes.text(x, y, text, size=size, color=colour, linespacing=spacing, **style)


def _plot(axes: Axes, line: Line, colour: str, thick: float) -> None:
    (x0, y0), (x1, y1) = line.start, line.end
    axes.plot([x0, x1], [y0, y1], color=colour, linewidth=thick, solid_capstyle="butt", scalex=False, scaley=False)


def _dash(axes: Axes, box: Box) -> None:
    from matplotlib.patches import Rectangle

    corner = (box.x - box.width / 2.0, box.y - box.height / 2.0)
    axes.add_patch(Rectangle(corner, box.width, box.height, fill=False, linewidth=0.8, linestyle=(0, (3, 2)), color=_INK))


def _draw_notes(axes: Axes, notes: list[Note]) -> None:
    left, bottom = axes.get_xlim()[0] + _MARGIN, axes.get_ylim()[0] + _MARGIN / 2.0
    for row, note in enumerate(reversed(notes)):
        x, y = left, bottom + _LINE * (row + 0.5)
        for name, colour in note.colours:
            _plot(axes, Line(Point(x, y), Point(x + 16.0, y)), colour, 2.0)
            _write(axes, name, x + 20.0, y, NAME_SIZE, ha="left")
            x += 30.0 + width(name, NAME_SIZE)
        if note.boxed:
            _dash(axes, Box(x + 8.0, y, 16.0, 9.0))
        _write(axes, note.text, x + (20.0 if note.boxed else 0.0), y, NAME_SIZE, ha="left")
