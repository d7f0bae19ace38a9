"""The labels of a drawn graph, and its geometry in points: boxes, visible bonds, their numbers, half arrows and strokes.

Names are shortened only where the picture stays unambiguous: a name that repeats the neighbours' names says nothing new, a
first part that whole groups of names share is left out while the rest stays unique, and long names wrap at their dots. The
room that a text takes is guessed, never too small. What `layout` returns has no flaws in the sense of `flaws`, whatever the
graph.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import atan2, hypot, remainder, tan, tau
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.drawing.placement import enters, place, rearranged
from bondgraph.elements import JUNCTIONS, TWO_PORTS
from bondgraph.graph import Bond, BondGraph
from bondgraph.laws import Function, GraphError

LABEL_SIZE, JUNCTION_SIZE, NAME_SIZE, NUMBER_SIZE = 11.5, 14.0, 8.5, 8.0  # points
LINE_SPACING = 1.25
_WRAP = 12  # characters
_LETTERS = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi omega "
    "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
)
_GREEK = dict(zip(_LETTERS.split(), "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ", strict=True))
_BREAK = re.compile(r"(?<=\.)(?!\d|[^(]*\))|(?=->)|(?=\()")
_TOKEN = re.compile(r"(?<![A-Za-z0-9_])([A-Za-z]+)_?([A-Za-z0-9]*)(?![A-Za-z0-9_])")


class Label(NamedTuple):
    """The words at one element: its symbol (MTF, I, 1...) and the lines of its name, none where it says nothing new."""

    symbol: str
    lines: tuple[str, ...]
    junction: bool


def labels(graph: BondGraph) -> dict[str, Label]:
    """The label of every element, by its name.

    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().one("a").one("b").on("a", Se("M", 1.0)).on("b", I("J", 1.0)).transform("a", "b", 3.0)
    >>> [(label.symbol, label.lines) for label in labels(b.build()).values()]
    [('1', ('a',)), ('1', ('b',)), ('Se', ('M',)), ('I', ('J',)), ('TF', ('3',))]
    """
    short, found = short_names(graph), {}
    for name, element in graph.elements.items():
        text = short.get(name, "")
        if element.kind in TWO_PORTS and not text and isinstance(element.law, float | int):
            text = f"{element.law:.4g}"
        if isinstance(element.law, Function) and not text.endswith(")"):
            varies = ", ".join(short.get(of, of) for of in graph.depends_on(name))
            text += f"({varies})" if varies else ""
        lines = [""]
        for piece in _BREAK.split(text) if len(text) > _WRAP else [text]:
            if lines[-1] and len(lines[-1] + piece) > _WRAP:
                lines.append("")
            lines[-1] += piece
        found[name] = Label(graph.symbol(name), tuple(filter(None, lines)), element.kind in JUNCTIONS)
    return found


def short_names(graph: BondGraph) -> dict[str, str]:
    """Each name that is drawn, as it is drawn: without its first part where the rest tells it from all others."""
    names = [*(name for name in graph.elements if not _implied(graph, name)), *graph.displacements]
    rest = {name: name.partition(".")[2] for name in names}
    shared = Counter(name.partition(".")[0] for name in rest)
    taken = Counter([*rest, *rest.values()])
    clear = dict.fromkeys(shared, True)
    for name, short in rest.items():
        clear[name.partition(".")[0]] &= taken[short] == 1 or not short
    return {n: s if s and clear[n.partition(".")[0]] and shared[n.partition(".")[0]] > 1 else n for n, s in rest.items()}


def _implied(graph: BondGraph, name: str) -> bool:
    """Whether a name only puts together the names of its neighbours, as `Builder` does where it is told none."""
    near = [bond.other(name) for bond in graph.at(name)]
    made = {f"{a}{sign}{b}" for a in near for b in near for sign in ("->", "-")}
    return name in made | {f"{a}.sum" for a in near} | {f"{a}.rate" for a in near}


def plain(text: str) -> str:
    """A name with its Greek letters, for measuring.

    >>> plain("T(theta)")
    'T(θ)'
    """
    return _TOKEN.sub(lambda m: _GREEK.get(m[1], m[1]) + m[2] if _is_symbol(m) else m[0], text)


def mathtext(text: str) -> str:
    r"""A name as mathtext: single and Greek letters are symbols, with what follows as a subscript; words stay words.

    >>> print(mathtext("T(theta)"), mathtext("m2"), mathtext("rod.com.x"))
    $T$($\theta$) $m_{2}$ rod.com.$x$
    """
    return _TOKEN.sub(_symbol if "$" not in text else lambda m: m[0], text.replace("$", r"\$"))


def _is_symbol(match: re.Match[str]) -> bool:
    letters, index = match[1], match[2]
    joined = match[0] == letters + index
    return (len(letters) == 1 or letters in _GREEK) and (index == "" or index.isdigit() or not joined)


def _symbol(match: re.Match[str]) -> str:
    if not _is_symbol(match):
        return match[0]
    base = f"\\{match[1]}" if match[1] in _GREEK else match[1]
    return f"${base}_{{{match[2]}}}$" if match[2] else f"${base}$"


def width(text: str, size: float) -> float:
    """How wide a text is at a font size, in points: never less than the truth for the serif font that is drawn with."""
    return size * sum(_em(character) for character in plain(text))


def _em(character: str) -> float:
    if character in "iljftIr.,:;[]()|!'- ":
        return 0.42
    if character in "mMwW@%" or character > "\u2e80":
        return 1.0
    if character in "acesz":
        return 0.51
    return 0.78 if character.isupper() or not character.isascii() else 0.54


# -- the geometry ------------------------------------------------------------------------------------------------------


_GAP = 3.0  # points between a label and the end of its bond
_ASIDE = 7.0  # points from a bond to the middle of its number
_SHARES = (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82)  # of the bond, where its number may stand
_BARB, _STROKE = 8.5, 11.0  # points: the half arrow's barb, the causal stroke
_FARTHEST = 26.0  # points from an element to the end of its bond, where neighbours are close
_GROWTH, _GROWTHS, _ATTEMPTS = 1.06, 10, 20  # a drawing grows by 1.06 up to ten times, then is arranged anew
_FLOW_SIDE = (0.6, -0.8)  # half arrows lie on the flow side of a bond, which is below or to the right


class Point(NamedTuple):
    """A place in the drawing, in points; y upwards."""

    x: float
    y: float


class Box(NamedTuple):
    """An upright rectangle by its centre and size, in points."""

    x: float
    y: float
    width: float
    height: float

    def overlaps(self, other: Box) -> bool:
        """Whether two boxes share an area."""
        across = 2.0 * abs(self.x - other.x) < self.width + other.width
        return across and 2.0 * abs(self.y - other.y) < self.height + other.height

    def grown(self, across: float, up: float) -> Box:
        """The box with margins to its sides, and above and below."""
        return Box(self.x, self.y, self.width + 2.0 * across, self.height + 2.0 * up)


class Line(NamedTuple):
    """A straight line from one point to another; a bond's goes from tail to head, as far as it is visible."""

    start: Point
    end: Point

    @property
    def length(self) -> float:
        """Its length in points."""
        return hypot(self.end.x - self.start.x, self.end.y - self.start.y)

    def point(self, share: float, aside: float = 0.0) -> Point:
        """The point at a share of the way, so far to the flow side of it."""
        dx, dy = self.end.x - self.start.x, self.end.y - self.start.y
        ux, uy = self._flow_side()
        return Point(self.start.x + share * dx + aside * ux, self.start.y + share * dy + aside * uy)

    def passes(self, box: Box) -> bool:
        """Whether it passes through a box."""
        half = np.array([box.width, box.height]) / 2.0
        return bool(enters(np.array(self.start), np.array(self.end), np.array([box.x, box.y]), half))

    def _flow_side(self) -> Point:
        length = self.length or 1.0
        x, y = (self.end.y - self.start.y) / length, (self.start.x - self.end.x) / length
        sign = 1.0 if x * _FLOW_SIDE[0] + y * _FLOW_SIDE[1] > 0 else -1.0
        return Point(sign * x, sign * y)


@dataclass(frozen=True)
class Layout:
    """A graph's drawing: what each element's label says and the boxes it fills, each bond's visible line and number."""

    labels: Mapping[str, Label]
    boxes: Mapping[str, tuple[Box, ...]]
    bonds: Mapping[int, Line]
    numbers: Mapping[int, Box]
    ends: Mapping[int, tuple[str, str]]

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top of everything."""
        boxes = [box for own in self.boxes.values() for box in own] + list(self.numbers.values())
        left, bottom = (min(b[k] - b[k + 2] / 2 for b in boxes) for k in (0, 1))
        right, top = (max(b[k] + b[k + 2] / 2 for b in boxes) for k in (0, 1))
        return left, bottom, right, top


def layout(graph: BondGraph) -> Layout:
    """Lay a graph out: labels, bonds and numbers that keep clear of each other; the same graph, the same layout.

    The elements take the places that `bondgraph.drawing.placement.place` finds; the drawing then grows, or is arranged
    anew, until it has no flaws.

    >>> from bondgraph import Builder, I, Se
    >>> graph = Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build()
    >>> drawn = layout(graph)
    >>> sorted(drawn.bonds), list(flaws(drawn))
    ([1, 2], [])

    Raises:
        GraphError: if no arrangement without flaws was found.

    """
    written = labels(graph)
    half = {name: _half(label) for name, label in written.items()}
    at = place(graph, half)
    for attempt in range(_ATTEMPTS):
        for growth in range(_GROWTHS):  # farther and farther apart
            scale = _GROWTH**growth
            drawn = _laid(graph, written, {name: (scale * x, scale * y) for name, (x, y) in at.items()})
            if not any(flaws(drawn)):
                return drawn
        at = rearranged(graph, half, at, attempt)
    raise GraphError("this graph is too entangled to be drawn clearly; draw parts of it by themselves")


def flaws(drawn: Layout) -> Iterator[str]:
    """What is unreadable in a layout: labels on labels, bonds too short or through labels of others, numbers on labels."""
    owned = [(name, box) for name, own in drawn.boxes.items() for box in own]
    centre, half = _arrays(box for _, box in owned)
    meet = (np.abs(centre[:, None] - centre[None]) < half[:, None] + half[None]).all(axis=-1)
    for one, two in zip(*np.nonzero(np.triu(meet, 1)), strict=True):
        if owned[one][0] != owned[two][0]:
            yield f"labels of {owned[one][0]!r} and {owned[two][0]!r} overlap"
    for number, line in drawn.bonds.items():
        if line.length < 2.0 * _BARB:
            yield f"bond {number} is too short to be seen"
        for k in np.flatnonzero(enters(np.array(line.start), np.array(line.end), centre, half)):
            if owned[k][0] not in drawn.ends[number]:
                yield f"bond {number} passes through the label of {owned[k][0]!r}"
    yield from _marks_on_bonds(drawn)
    numbered, size = _arrays(drawn.numbers.values())
    for one, two in zip(*np.nonzero((np.abs(numbered[:, None] - centre) < size[:, None] + half).all(axis=-1)), strict=True):
        yield f"the number of bond {list(drawn.numbers)[one]} lies on the label of {owned[two][0]!r}"


def _marks_on_bonds(drawn: Layout) -> Iterator[str]:
    """Bonds that run through the end of another, where its stroke or half arrow would read as theirs."""
    tips = [(number, name) for number in drawn.bonds for name in drawn.ends[number]]
    boxes = [Box(*tip, _STROKE, _STROKE) for line in drawn.bonds.values() for tip in line]
    centre, half = _arrays(boxes)
    for number, line in drawn.bonds.items():
        for k in np.flatnonzero(enters(np.array(line.start), np.array(line.end), centre, half)):
            other, name = tips[k]
            if other != number and name not in drawn.ends[number]:
                yield f"bond {number} passes through the end of bond {other} at {name!r}"


def half_arrow(line: Line) -> Line:
    """The barb of a bond's half arrow: from its head back, on the flow side."""
    return Line(line.end, line.point(1.0 - 0.87 * _BARB / max(line.length, _BARB), 0.5 * _BARB))


def stroke(line: Line, at_end: bool) -> Line:
    """The causal stroke: a short bar across a bond, at its end (the half arrow's head) or else at its start."""
    share = 1.0 if at_end else 0.0
    return Line(line.point(share, -_STROKE / 2.0), line.point(share, _STROKE / 2.0))


def _arrays(boxes: Iterable[Box]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    table = np.array(list(boxes)).reshape(-1, 4)
    return table[:, :2], table[:, 2:] / 2.0


def _boxes(label: Label, x: float, y: float) -> tuple[Box, ...]:
    """The boxes of a label at its anchor: a junction's digit with its name below, or one for all the others."""
    name = max((width(line, NAME_SIZE if label.junction else LABEL_SIZE) for line in label.lines), default=0.0)
    if not label.junction:
        first = width(f"{label.symbol}:{label.lines[0]}" if label.lines else label.symbol, LABEL_SIZE)
        return (Box(x, y, max(first, name), LINE_SPACING * LABEL_SIZE * max(len(label.lines), 1)),)
    digit = Box(x, y, 0.6 * JUNCTION_SIZE, JUNCTION_SIZE)
    tall = LINE_SPACING * NAME_SIZE * len(label.lines)
    return (digit, Box(x, y - (digit.height + tall) / 2.0, name, tall)) if label.lines else (digit,)


def _half(label: Label) -> tuple[float, float]:
    """Half width and half height of the smallest box around a label that has its anchor in the middle."""
    boxes = _boxes(label, 0.0, 0.0)
    return max(b.width / 2.0 for b in boxes), max(abs(b.y) + b.height / 2.0 for b in boxes)


def _laid(graph: BondGraph, written: Mapping[str, Label], at: Mapping[str, tuple[float, float]]) -> Layout:
    boxes = {name: _boxes(label, *at[name]) for name, label in written.items()}
    lines = {b.number: _visible(graph, b, boxes) for b in graph.bonds}
    ends = {b.number: (b.tail, b.head) for b in graph.bonds}
    return Layout(written, boxes, lines, _numbers(lines, boxes), ends)


def _centre(boxes: Mapping[str, tuple[Box, ...]], name: str) -> Point:
    return Point(boxes[name][0].x, boxes[name][0].y)


def _visible(graph: BondGraph, bond: Bond, boxes: Mapping[str, tuple[Box, ...]]) -> Line:
    """A bond from where it leaves its tail's boxes to where it reaches its head's, apart from its neighbours."""
    whole = Line(_centre(boxes, bond.tail), _centre(boxes, bond.head))
    beside = [b.number for b in graph.at(bond.tail) if b.other(bond.tail) == bond.head]
    aside = 2.0 * _ASIDE * (beside.index(bond.number) - (len(beside) - 1) / 2.0)
    whole = Line(whole.point(0.0, aside), whole.point(1.0, aside))
    first, last = (
        max(_leaving(line, boxes[name]), min(_clearance(graph, bond, name, boxes) / max(whole.length, 1.0), 0.3))
        for line, name in ((whole, bond.tail), (Line(whole.end, whole.start), bond.head))
    )
    return Line(whole.point(min(first, 1.0 - last)), whole.point(max(first, 1.0 - last)))


def _clearance(graph: BondGraph, bond: Bond, name: str, boxes: Mapping[str, tuple[Box, ...]]) -> float:
    """How far from an element a bond stays at least, so that its stroke keeps clear of those of its neighbours."""
    here = _centre(boxes, name)
    ways = {b.number: _centre(boxes, b.other(name)) for b in graph.at(name)}
    angles = {n: atan2(there.y - here.y, there.x - here.x) for n, there in ways.items()}
    apart = [abs(remainder(angle - angles[bond.number], tau)) for n, angle in angles.items() if n != bond.number]
    return min(0.55 * _STROKE / tan(max(min(apart), 0.1) / 2.0), _FARTHEST) if apart else 0.0


def _leaving(line: Line, boxes: Iterable[Box]) -> float:
    """The share of a line at which it has left all boxes that it passes, with room for a stroke across it."""
    slant = _STROKE / 2.0 / max(line.length, 1.0)
    lean = (slant * abs(line.end.y - line.start.y), slant * abs(line.end.x - line.start.x))
    shares = [0.0]
    for k, box in enumerate(boxes):
        grown = box.grown(_GAP + lean[0], _GAP + lean[1]) if k == 0 else box.grown(_GAP + _STROKE / 2.0, _GAP)
        if line.passes(grown):
            across = _exits(line.start.x, line.end.x, grown.x, grown.width / 2.0)
            up = _exits(line.start.y, line.end.y, grown.y, grown.height / 2.0)
            shares.append(min(across, up))
    return min(max(shares), 1.0)


def _exits(start: float, end: float, centre: float, half: float) -> float:
    step = end - start
    return max((centre - half - start) / step, (centre + half - start) / step) if abs(step) > 1e-9 else 1.0


def _numbers(lines: Mapping[int, Line], boxes: Mapping[str, tuple[Box, ...]]) -> dict[int, Box]:
    """The box of each bond's number: beside the bond, away from the half arrow, where it hides least."""
    words = _arrays(box.grown(_GAP, _GAP) for own in boxes.values() for box in own)
    ink = [part for line in lines.values() for part in (line, half_arrow(line), stroke(line, True), stroke(line, False))]
    starts, ends = (np.array([part[k] for part in ink]) for k in (0, 1))
    found: dict[int, Box] = {}
    for number, line in lines.items():
        size = (width(str(number), NUMBER_SIZE), NUMBER_SIZE)
        candidates = [Box(*line.point(share, -_ASIDE), *size) for share in _SHARES]
        centre, half = _arrays(candidates)
        on_words = (np.abs(words[0] - centre[:, None]) < words[1] + half[:, None]).all(axis=-1).sum(axis=1)
        on_ink = enters(starts, ends, centre[:, None], half[:, None]).sum(axis=1)
        on_numbers = np.array([sum(box.overlaps(other) for other in found.values()) for box in candidates])
        found[number] = candidates[int(np.argmin(100 * on_words + 10 * on_numbers + on_ink))]
    return found
