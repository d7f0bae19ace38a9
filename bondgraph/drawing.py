"""A bond graph as a picture: half arrows, causal strokes, bond numbers, energy domains by colour.

A picture is a list of marks, which `draw` hands to matplotlib and `svg` writes by itself. Figures are separate objects, no
global state is changed, nothing is displayed. The colours are those of Okabe and Ito, which the colour-blind can
distinguish.
"""

from __future__ import annotations

import inspect
import re
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from colorsys import hls_to_rgb
from html import escape
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from bondgraph.elements import DOMAINS, STORES, Domain, GraphError, One, refuse
from bondgraph.files import replacement
from bondgraph.graph import BondGraph, activated, as_graph
from bondgraph.layout import (
    GREEK,
    JUNCTION_SIZE,
    LABEL_SIZE,
    LETTERS,
    LINE_SPACING,
    NAME_SIZE,
    NUMBER_SIZE,
    TOKEN,
    Box,
    ElementLabel,
    Layout,
    Segment,
    Spot,
    arrow_head,
    half_arrow,
    is_symbol,
    layout,
    stroke,
    width,
)
from bondgraph.numerics import Array
from bondgraph.strokes import causality as strokes_of
from bondgraph.strokes import is_integral
from bondgraph.words import WordGraph

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bondgraph.strokes import Causality


COLOURS = {
    "translation": "#D55E00",
    "rotation": "#0072B2",
    "electric": "#009E73",
    "magnetic": "#E69F00",
    "hydraulic": "#56B4E9",
    "thermal": "#CC79A7",
    "heat": "#882255",
    "chemical": "#6E6E6E",
}
_INK, _FAINT, _MARKED = "#000000", "#555555", "#F0E442"
_MARGIN, _LINE = 18.0, 15.0  # points: around the picture, per line of the legend
_CAPTION_WIDTH = 300.0  # points: room for the caption
_DPI = 200
_TRANSFORMER = "transformer: f_out = T f_in,  e_in = T e_out"
_GYRATOR = "gyrator: e_out = G f_in,  e_in = G f_out"
_SIGNAL = "signal, without power"
_DERIVATIVE = "store in derivative causality"
_DATES: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}


def mathtext(text: str) -> str:
    r"""A name as mathtext: single and Greek letters are symbols, with what follows as a subscript; words stay words.

    >>> print(mathtext("T(theta)"), mathtext("m2"), mathtext("rod.com.x"))
    $T$($\theta$) $m_{2}$ rod.com.$x$
    """
    return TOKEN.sub(_symbol if "$" not in text else lambda m: m[0], text.replace("$", r"\$"))


def _symbol(match: re.Match[str]) -> str:
    if not is_symbol(match):
        return match[0]
    base = f"\\{match[1]}" if match[1] in GREEK else match[1]
    index = f"\\mathrm{{{match[2]}}}" if match[2].isalpha() and len(match[2]) > 1 else match[2]
    return f"${base}_{{{index}}}$" if index else f"${base}$"


class Mark(NamedTuple):
    """A line, a text or a dashed box of a picture: its place in points, its colour, and its width or font size.

    A text has its middle (or left end, by `side`) at the start of `at`; the `literal` text precedes it unchanged, while
    single letters of the text are symbols.
    """

    at: Segment
    colour: str
    size: float
    text: str = ""
    side: str = "center"
    dashed: bool = False
    literal: str = ""


GraphDrawing = tuple[tuple[float, float, float, float], tuple[Mark, ...]]
"""A drawn graph: its left, bottom, right and top edges, in points, and its marks, those behind others first."""


def picture(
    graph: BondGraph,
    causality: Causality | Mapping[int, str] | None = None,
    *,
    numbers: bool = True,
    title: str | None = None,
    loops: bool = False,
    parts: Mapping[str, Sequence[str]] = MappingProxyType({}),
    words: Mapping[str, str] = MappingProxyType({}),
) -> GraphDrawing:
    """Returns the picture of a graph as marks, which `draw` and `svg` write; the options are those of `draw`."""
    strokes, derivative = _causes(graph, causality)
    refuse(f"part {part!r}: no element {n!r}" for part, own in parts.items() for n in own if n not in graph.elements)
    drawn = layout(graph)
    looped = {n for loop in strokes_of(graph).loops for n in loop.bonds} if loops else ()
    marks: list[Mark] = []
    tints = [hls_to_rgb(0.618 * k % 1.0, 0.88 - 0.04 * (k % 3), 0.8) for k in range(len(parts))]  # hues far from each other
    hexes = ["#" + bytes(round(255 * share) for share in tint).hex() for tint in tints]
    samples = COLOURS | dict(zip(parts, hexes, strict=True))
    for name, own in parts.items():
        for box in (box for element in dict.fromkeys(own) for box in drawn.boxes[element]):
            middle = Segment(Spot(box.x - box.width / 2.0, box.y), Spot(box.x + box.width / 2.0, box.y))
            marks.append(Mark(middle, samples[name], box.height))
    for bond in (*graph.bonds, *activated(graph)):
        line = drawn.bonds[bond.number]
        if bond.number < 0:
            marks += [Mark(part, _INK, 0.8) for part in (line, *arrow_head(line))]
            continue
        marks += [Mark(line, _MARKED, 7.0)] * (bond.number in looped)
        marks += _bond_marks(line, graph.domain(bond))
        if bond.number in strokes:
            marks.append(Mark(stroke(line, strokes[bond.number] == bond.head), marks[-1].colour, 2.0))
    for name, label in drawn.labels.items():
        first, *below = drawn.boxes[name]
        if label.junction:
            marks.append(_text(label.symbol, first, JUNCTION_SIZE))
            marks += [_text("\n".join(label.lines), box, NAME_SIZE, _FAINT) for box in below]
            continue
        literal = f"{label.symbol}:" if label.lines else label.symbol
        marks.append(_text("\n".join(label.lines), first, LABEL_SIZE)._replace(literal=literal))
        if name in derivative:
            marks.append(_dashes(first.grown(1.5, 1.5)))
    marks += [_text(str(n), box, NUMBER_SIZE, _FAINT) for n, box in drawn.numbers.items()] if numbers else []

    return _framed(drawn, marks, _notes(graph, derivative), title, samples, parts, words)


def _framed(
    drawn: Layout,
    marks: list[Mark],
    notes: list[str | list[str]],
    title: str | None,
    samples: Mapping[str, str],
    parts: Collection[str] = (),
    words: Mapping[str, str] = MappingProxyType({}),
) -> GraphDrawing:
    """The picture with margins, title and explanations: of its colours, lines, two-ports and parts."""
    left, bottom, right, top = drawn.bounds
    spare = max(_CAPTION_WIDTH - (right - left), 0.0) / 2.0
    left, right = left - _MARGIN - spare, right + _MARGIN + spare
    rows: list[list[str]] = []
    for name in parts:
        if not rows or sum(30.0 + width(other, NAME_SIZE) for other in [*rows[-1], name]) > right - left - 2.0 * _MARGIN:
            rows.append([])
        rows[-1].append(name)
    notes += rows
    bottom -= _MARGIN + (_LINE * len(notes) + _MARGIN / 2.0 if notes else 0.0)
    top += _MARGIN + (2.0 * LABEL_SIZE if title else 0.0)
    for row, note in enumerate(reversed(notes)):
        x, y = left + _MARGIN, bottom + _MARGIN / 2.0 + _LINE * (row + 0.5)
        for name in [note] if isinstance(note, str) else note:
            sample = Segment(Spot(x, y), Spot(x + 16.0, y))
            if note == _DERIVATIVE:
                marks.append(_dashes(Box(x + 8.0, y, 16.0, 9.0)))
            elif note == _SIGNAL:
                marks += [Mark(part, _INK, 0.8) for part in (sample, *arrow_head(sample))]
            elif name in samples:
                marks.append(Mark(sample, samples[name], 9.0 if name in parts else 2.0))
            x += 20.0 * (name in samples or note in (_DERIVATIVE, _SIGNAL))
            first, colon, rest = name.partition(":")
            label = words.get(first, first) + colon if name not in parts else name
            mark = _text("" if name in parts else rest, Box(x, y, 0.0, 0.0), NAME_SIZE)
            marks.append(mark._replace(side="left", literal=label))
            x += 10.0 + width(label + mark.text, NAME_SIZE)
    if title:
        place = Box((left + right) / 2.0, top - _MARGIN / 2.0 - LABEL_SIZE / 2.0, 0.0, 0.0)
        marks.insert(0, _text("", place, LABEL_SIZE)._replace(literal=title))
    return (left, bottom, right, top), tuple(marks)


def word_picture(system: WordGraph, title: str | None = None) -> GraphDrawing:
    """Returns the picture of a word bond graph: words in frames, bonds with half arrows, ports and colours of domains."""
    joined = system.joined()
    stand_in = BondGraph({word: One(word) for word in system.words}, tuple(bond for bond, _, _ in joined), parts=True)
    texts = {bond.number: out if out == into else f"{out} - {into}" for bond, (_, out), (_, into) in joined}
    drawn = layout(stand_in, {word: ElementLabel(f" {word} ", (), False) for word in system.words}, texts)
    marks, present = [], []
    for bond, tail, head in joined:
        line, domain = drawn.bonds[bond.number], system.domain(*tail) or system.domain(*head)
        present += [domain.name] if domain is not None else []
        marks += _bond_marks(line, domain)
        marks.append(_text("", drawn.numbers[bond.number], NUMBER_SIZE, _FAINT)._replace(literal=texts[bond.number]))
    for word, (box,) in drawn.boxes.items():
        x, y, dx, dy = box.x, box.y, box.width / 2.0, box.height / 2.0
        corners = [Spot(x + a * dx, y + b * dy) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
        marks += [Mark(Segment(*pair), _INK, 0.8) for pair in pairwise(corners)]
        marks.append(_text("", box, LABEL_SIZE)._replace(literal=word))
    domains = [name for name in DOMAINS if name in present]
    return _framed(drawn, marks, [domains] if domains else [], title, COLOURS)


def _bond_marks(line: Segment, domain: Domain | None) -> list[Mark]:
    colour = _INK if domain is None else COLOURS[domain.name]
    return [Mark(line, colour, 1.2), Mark(half_arrow(line), colour, 1.2)]


def _text(text: str, box: Box, size: float, colour: str = _INK) -> Mark:
    return Mark(Segment(Spot(box.x, box.y), Spot(box.x, box.y)), colour, size, text)


def _dashes(box: Box) -> Mark:
    lower = Spot(box.x - box.width / 2.0, box.y - box.height / 2.0)
    return Mark(Segment(lower, Spot(lower.x + box.width, lower.y + box.height)), _INK, 0.8, dashed=True)


def draw(graph: BondGraph | WordGraph, file: str | Path | None = None, **options: Any) -> Figure:
    """Draws a graph, and saves the picture if a file is named; the same graph gives the same file every time.

    Half arrows point where power counts as positive and lie on the flow side of their bonds, below or to the right, with
    the bond numbers on the other side; the bar at one end of a bond is its causal stroke, where effort is received. A full
    arrow without stroke leads from a flow or effort to the element whose law reads it, without power (an activated bond).

    Args:
        graph: the graph, or a graph of words.
        file: where to save it, ending in .png, .svg or .pdf.
        options: of a graph of words, `title` alone; of a graph, these:

            causality: the causal strokes, as from `bondgraph.causality` (the default), or the name of the
            element at the stroke's end by bond number; an empty mapping draws no strokes.

            numbers: True numbers the bonds.

            title: a line above the picture.

            loops: True marks bonds of zero-order causal paths, which make algebraic loops.

            parts: elements by the part that they belong to, each part in its own colour, which the picture explains.

            words: other words for those of the explanations below the picture, such as {"rotation": "rotación"}.

    Raises:
        GraphError: for another file ending, an unknown option, or strokes at elements that their bonds do not have.

    >>> from bondgraph import Builder, I, Se
    >>> figure = draw(Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build(), causality={1: "J"})
    >>> [text.get_text() for text in figure.axes[0].texts]
    ['1', 'shaft', 'I:$J$', 'Se:$M$', '1', '2']

    """
    _kind(file)
    figure = figure_of(_picture(graph, options))
    _save(figure, file)
    return figure


def figure_of(picture: GraphDrawing) -> Figure:
    """Returns a picture as a figure of matplotlib, whose single pair of axes fills it, in points."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    (left, bottom, right, top), marks = picture
    figure = Figure(figsize=((right - left) / 72.0, (top - bottom) / 72.0))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(left, right), ylim=(bottom, top))
    axes.set_axis_off()
    for mark in marks:
        (x0, y0), (x1, y1) = mark.at
        if mark.text or mark.literal:
            style: dict[str, Any] = {"family": ["STIXGeneral", "DejaVu Sans"], "math_fontfamily": "stix"}
            style["linespacing"] = LINE_SPACING if "\n" in mark.text else 1.0
            style |= {"size": mark.size, "color": mark.colour, "ha": mark.side, "va": "center"}
            text = "\n".join(map(mathtext, mark.text.split("\n")))
            axes.text(x0, y0, mark.literal.replace("$", r"\$") + text, **style)
        elif mark.dashed:
            box = Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, linewidth=mark.size, linestyle=(0, (3, 2)))
            axes.add_patch(box).set_edgecolor(mark.colour)
        else:
            style = {"color": mark.colour, "linewidth": mark.size, "solid_capstyle": "butt"}
            axes.plot([x0, x1], [y0, y1], scalex=False, scaley=False, **style)
    return figure


def svg(graph: BondGraph | WordGraph, **options: Any) -> str:
    """The picture of a graph as SVG, with its causal strokes, or without them where they conflict; options as of `draw`.

    >>> from bondgraph import Builder, I, Se
    >>> svg(Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build())[:5]
    '<?xml'

    """
    if isinstance(graph, BondGraph) and options.get("causality") is None and strokes_of(graph).conflicts:
        options = options | {"causality": {}, "loops": False}
    return svg_of(_picture(graph, options))


def _picture(graph: BondGraph | WordGraph, options: Mapping[str, Any]) -> GraphDrawing:
    """The picture of a graph of either kind; unknown options are refused."""
    writes: Callable[..., GraphDrawing] = word_picture if isinstance(graph, WordGraph) else picture
    _, *parameters = inspect.signature(writes).parameters
    refuse(
        f"option {name!r}: no such option of a picture; they are {', '.join(parameters)}"
        for name in options
        if name not in parameters
    )
    return writes(graph if isinstance(graph, WordGraph) else as_graph(graph), **options)


def svg_of(picture: GraphDrawing) -> str:
    """Returns a picture as SVG."""
    (left, bottom, right, top), marks = picture
    wide, high = f"{right - left:.1f}", f"{top - bottom:.1f}"
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}pt" height="{high}pt" viewBox="0 0 {wide} {high}" '
        "font-family=\"STIXGeneral, 'STIX Two Text', 'Times New Roman', Times, serif\">",
        f'<rect width="{wide}" height="{high}" fill="#FFFFFF"/>',
    ]
    for mark in marks:
        (x0, y0), (x1, y1) = ((x - left, top - y) for x, y in mark.at)
        if mark.dashed:
            size = f'x="{x0:.2f}" y="{y1:.2f}" width="{x1 - x0:.2f}" height="{y0 - y1:.2f}"'
            lines.append(
                f'<rect {size} fill="none" stroke="{mark.colour}" stroke-width="{mark.size}" stroke-dasharray="3 2"/>'
            )
        elif not mark.text and not mark.literal:
            d = f"M{x0:.2f} {y0:.2f}L{x1:.2f} {y1:.2f}"
            lines.append(f'<path d="{d}" stroke="{mark.colour}" stroke-width="{mark.size}"/>')
        anchor = "start" if mark.side == "left" else "middle"
        rows = mark.text.split("\n") if mark.text or mark.literal else []
        for k, row in enumerate(rows):
            y = y0 + mark.size * (0.34 + LINE_SPACING * (k - (len(rows) - 1) / 2.0))
            words = f'x="{x0:.2f}" y="{y:.2f}" font-size="{mark.size}" fill="{mark.colour}" text-anchor="{anchor}"'
            literal = escape(mark.literal) if k == 0 else ""
            lines.append(f"<text {words}>{literal}{_spans(row, mark.size)}</text>")
    return "\n".join([*lines, "</svg>", ""])


def _spans(text: str, size: float) -> str:
    """A name as spans of SVG: symbols in italics, with lowered indices."""
    parts, at, lowered = [], 0, 0.0
    for match in [m for m in TOKEN.finditer(text) if is_symbol(m)]:
        shift = f' dy="{-lowered:.2f}"' if lowered else ""
        before = escape(text[at : match.start()])
        parts += [f"<tspan{shift}>{before}</tspan>"] if before and shift else [before]
        shift = "" if before else shift
        upright = "" if match[1] in LETTERS.split()[24:] else ' font-style="italic"'
        parts.append(f"<tspan{shift}{upright}>{GREEK.get(match[1], match[1])}</tspan>")
        lowered = 0.25 * size if match[2] else 0.0
        if match[2]:
            parts.append(f'<tspan dy="{lowered:.2f}" font-size="{0.7 * size:.2f}">{escape(match[2])}</tspan>')
        at = match.end()
    rest = escape(text[at:])
    return "".join([*parts, f'<tspan dy="{-lowered:.2f}">{rest}</tspan>' if rest and lowered else rest])


def _kind(file: str | Path | None) -> str:
    kind = Path(file).suffix.lower().lstrip(".") if file is not None else ""
    if file is not None and kind not in _DATES:
        raise GraphError(f"found {str(file)!r}, expected a file name ending in .png, .svg or .pdf")
    return kind


def _save(figure: Figure, file: str | Path | None) -> None:
    """Saves a picture if a file is named."""
    if file is not None:
        from matplotlib import rc_context

        kind, style = _kind(file), rc_context({"svg.hashsalt": "bondgraph", "pdf.fonttype": 42})
        with replacement(Path(file), kind) as fresh, style, warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Glyph .* missing")  # of a name; the picture has a box there
            figure.savefig(fresh, format=kind, dpi=_DPI, metadata=_DATES[kind])


def bode_figure(omega: Array, magnitude: Array, phase: Array, title: str, file: str | Path | None) -> Figure:
    """Returns a Bode diagram: magnitude (dB) and phase (degrees) over angular frequency (rad/s)."""
    from matplotlib.figure import Figure as Empty

    _kind(file)
    figure = Empty(figsize=(6.0, 4.8), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for axes, values, label in ((upper, magnitude, "magnitude (dB)"), (lower, phase, "phase (degrees)")):
        axes.semilogx(omega, values, color=_INK, linewidth=1.4)
        axes.set_ylabel(label)
        axes.grid(True, which="both", color="#D8D8D8", linewidth=0.5)
    upper.set_title(title)
    lower.set_xlabel("angular frequency (rad/s)")
    lower.set_xlim(float(omega.min()), float(omega.max()))
    _save(figure, file)
    return figure


def _causes(graph: BondGraph, causes: Causality | Mapping[int, str] | None) -> tuple[Mapping[int, str], frozenset[str]]:
    """The strokes, and the stores whose causality is derivative: those with their stroke at the opposite end."""
    if causes is None:
        causes = strokes_of(graph)
    strokes = causes if isinstance(causes, Mapping) else causes.strokes
    bonds = {bond.number: bond for bond in graph.bonds}
    wrong = {n: name for n, name in strokes.items() if n not in bonds or name not in bonds[n][1:]}
    refuse(
        f"the stroke of bond {n} is at {name!r}, found "
        + (f"a bond that joins {bonds[n].tail!r} and {bonds[n].head!r}" if n in bonds else f"no bond {n}")
        for n, name in wrong.items()
    )
    stroked = [(e, strokes.get(graph.bond_of(e.name).number)) for e in graph.of_kind(*STORES)]
    return strokes, frozenset(e.name for e, at in stroked if at is not None and not is_integral(e.kind, at == e.name))


def _notes(graph: BondGraph, derivative: frozenset[str]) -> list[str | list[str]]:
    """The lines below the picture: the domains whose colours it has, or a sentence."""
    present = {domain.name for domain in map(graph.domain, graph.bonds) if domain is not None}
    domains = [name for name in DOMAINS if name in present]
    kinds = {element.kind for element in graph.elements.values()}
    notes: list[str | list[str]] = [domains] if domains else []
    notes += [_DERIVATIVE] * bool(derivative) + [_SIGNAL] * bool(activated(graph))
    return notes + [_TRANSFORMER] * ("TF" in kinds) + [_GYRATOR] * ("GY" in kinds)
