"""A bond graph as a picture, laid out in points: labels, elements, visible bonds, their numbers, half arrows and strokes.

Names are shortened only where the picture stays unambiguous: a name that repeats the neighbours' names says nothing new, a
first part that whole groups of names share is left out while the rest stays unique, and long names wrap at their dots. The
room that a text takes is guessed, never too small.

Elements start in layers of a breadth-first walk; then they move on a grid as long as that lowers a cost: what makes a
drawing hard to read, labels that overlap, bonds through labels, crossings, bonds too short for their number, too long,
oblique, or side by side. Every step is deterministic: the same graph, the same drawing. What `layout` returns has no flaws
in the sense of `flaws`, whatever the graph.

Half arrows, causal strokes, bond numbers, energy domains by colour: figures are objects of their own, no global state is
touched, nothing is shown. The colours are those of Okabe and Ito, which the colour-blind can tell apart.
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, hypot, remainder, tan, tau
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import DOMAINS, JUNCTIONS, ONE_PORTS, STORES, TWO_PORTS
from bondgraph.files import replacement
from bondgraph.graph import Bond, BondGraph, as_graph, reached_from
from bondgraph.laws import Function, GraphError, refuse
from bondgraph.strokes import causality as strokes_of
from bondgraph.strokes import is_integral

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from bondgraph.strokes import Causality

LABEL_SIZE, JUNCTION_SIZE, NAME_SIZE, NUMBER_SIZE = 11.5, 14.0, 8.5, 8.0  # points
LINE_SPACING = 1.25
Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]
Places = dict[str, tuple[float, float]]
_WRAP = 12  # characters
_LETTERS = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi omega "
    "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
)
_GREEK = dict(zip(_LETTERS.split(), "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ", strict=True))
_BREAK = re.compile(r"(?<=\.)(?!\d|[^(]*\))|(?=->)|(?=\()")
_TOKEN = re.compile(r"(?<![A-Za-z0-9_])([A-Za-z]+)_?([A-Za-z0-9]*)(?![A-Za-z0-9_])")
STEP = np.array([24.0, 24.0])  # points: the grid
_FREE, _SHORTEST = 6.0, 32.0  # points: free around labels, of a bond to be seen between its labels
_STROKE, _FARTHEST = 11.0, 26.0  # points: a causal stroke, and how far it moves out where bonds crowd
_HALF_STROKE = 6.0  # points: half a stroke, with its line
_WINDOW, _SWEEPS = 5, 14
_OVERLAP, _THROUGH, _CROSSING, _CRAMPED, _NARROW, _BENT = 900.0, 700.0, 260.0, 5.0, 80.0, 40.0
_OBLIQUE, _UPWARD, _ONWARD = 55.0, 8.0, 40.0
_ROOM = (14.0, 20.0)  # points around the labels of the backbone while the one-ports are still to come
_PULL, _SHAKE = 1.3, 40.0  # times and points, where all is arranged once more
_ANGLE_COSINE = np.cos(np.radians(34.0))
_MOVES = [(-1, 0), (1, 0), (0, 1), (0, -1), (-1, -1), (1, -1), (-1, 1), (1, 1), (-2, 1), (2, 1), (-2, -1), (2, -1)]
_ONE_PORT_SIDES = {"Se": (-1.0, 0.1), "Sf": (-1.0, 0.1), "I": (0.1, 1.0), "R": (0.1, -1.0), "C": (-0.1, -1.0)}
_CLEAR = 3.0  # points between a label and the end of its bond
_ASIDE = 7.0  # points from a bond to the middle of its number
_NUMBER_PLACES = (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82)  # of the bond, where its number may stand
_BARB = 8.5  # points: the half arrow's barb
_GROWTH, _GROWTHS, _ATTEMPTS = 1.06, 10, 20  # a drawing grows by 1.06 up to ten times, then is arranged anew
_FLOW_SIDE = (0.6, -0.8)  # half arrows lie on the flow side of a bond, which is below or to the right


class ElementLabel(NamedTuple):
    """The words at one element: its symbol (MTF, I, 1...) and the lines of its name, none where it says nothing new."""

    symbol: str
    lines: tuple[str, ...]
    junction: bool


def labels(graph: BondGraph) -> dict[str, ElementLabel]:
    """The label of every element, by its name.

    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().one("a").one("b").on("a", Se("M", 1.0)).on("b", I("J", 1.0)).transform("a", "b", 3.0)
    >>> [(label.symbol, label.lines) for label in labels(b.build()).values()]
    [('1', ('a',)), ('1', ('b',)), ('Se', ('M',)), ('I', ('J',)), ('TF', ('3',))]
    """
    short, by_name = short_names(graph), {}
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
        by_name[name] = ElementLabel(graph.symbol(name), tuple(filter(None, lines)), element.kind in JUNCTIONS)
    return by_name


def short_names(graph: BondGraph) -> dict[str, str]:
    """Each name that is drawn, as it is drawn: without its first part where the rest tells it from all others."""
    names = list(graph.displacements)
    for name in reversed(list(graph.elements)):  # but for what only puts together its neighbours' names, as `Builder` does
        near = [bond.other(name) for bond in graph.at(name)]
        implied = {f"{a}{sign}{b}" for a in near for b in near for sign in ("->", "-")}
        implied |= {f"{a}.{what}" for a in near for what in ("sum", "rate")}
        if name not in implied:
            names.insert(0, name)
    rest = {name: name.partition(".")[2] for name in names}
    shared = Counter(name.partition(".")[0] for name in rest)
    taken = Counter([*rest, *rest.values()])
    clear = dict.fromkeys(shared, True)
    for name, short in rest.items():
        clear[name.partition(".")[0]] &= taken[short] == 1 or not short
    return {n: s if s and clear[n.partition(".")[0]] and shared[n.partition(".")[0]] > 1 else n for n, s in rest.items()}


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
    """The width of a text at a font size, in points: never less than the serif font of the drawing needs."""

    def em(character: str) -> float:
        if character in "iljftIr.,:;[]()|!'- ":
            return 0.42
        if character in "mMwW@%" or character > "\u2e80":
            return 1.0
        if character in "acesz":
            return 0.51
        return 0.78 if character.isupper() or not character.isascii() else 0.54

    return size * sum(map(em, plain(text)))


class Arrangement(NamedTuple):
    """A graph as arrays: half sizes of the labels, the two ends of each bond, pairs of bonds that share an element."""

    half: Array
    ends: Indices
    pairs: Indices  # shared element, other end of one bond, other end of the other
    straight: Mask  # of the pairs: whether they meet at a two-port, where the way should go straight on
    taste: Array  # the direction that each bond would like to have; 0 where it does not mind
    clear: Array  # points from the middle of each element to where its bonds begin to be seen
    groups: tuple[tuple[int, ...], ...]  # what moves together: an element, a junction with its one-ports, a branch


def place(graph: BondGraph, half: Mapping[str, tuple[float, float]]) -> Places:
    """The centre of every element, in points, given the half width and half height of its label.

    The backbone of junctions and two-ports comes first, with room to spare; then the one-ports join, each in its favourite
    direction among those that are free at its junction, and all move.
    """
    layers = _ordered(graph, _layers(graph))
    start = {
        name: (4.0 * STEP[0] * column, 4.0 * STEP[1] * ((len(layer) - 1) // 2 - row))
        for column, layer in enumerate(layers)
        for row, name in enumerate(layer)
    }
    backbone = [name for name, element in graph.elements.items() if element.kind not in ONE_PORTS]
    at = _settled(graph, {name: (half[name][0] + _ROOM[0], half[name][1] + _ROOM[1]) for name in backbone}, start)

    def apart(one: Array, two: Array) -> float:
        """The distance of two directions, by the cosine; anything beyond about 80 degrees counts as far."""
        cosine = float(one @ two) / (float(np.hypot(*one) * np.hypot(*two)) + 1e-9)
        return min(1.0 - cosine, 0.8)

    for name in backbone:
        here, near = np.array(at[name]), [bond.other(name) for bond in graph.at(name)]
        taken = [np.array(at[other]) - here for other in near if other in at]
        for port in (other for other in near if graph.elements[other].kind in ONE_PORTS):
            wish = _ONE_PORT_SIDES[graph.elements[port].kind]
            ways = [np.array(way) for way in sorted(_MOVES, key=lambda way: np.hypot(*np.subtract(way, wish)))]
            best = max(ways, key=lambda way: min((apart(way * STEP, other) for other in taken), default=1.0))
            taken.append(best * STEP)
            at[port] = tuple((here + 3.0 * best * STEP).tolist())
    return _settled(graph, half, at)


def rearranged(graph: BondGraph, half: Mapping[str, tuple[float, float]], at: Places, attempt: int) -> Places:
    """New places for the same elements: pulled apart and shaken, differently at each attempt, then moved again."""
    k = np.arange(len(at))
    shake = _SHAKE * np.sin(np.stack([7.0 * k, 11.0 * k], axis=-1) + attempt)
    aligned = np.round((_PULL * np.array(list(at.values())) + shake) / STEP) * STEP
    return _settled(graph, half, dict(zip(at, map(tuple, aligned.tolist()), strict=True)))


def _settled(graph: BondGraph, half: Mapping[str, tuple[float, float]], start: Places) -> Places:
    """The part of the graph whose half sizes are given, each group of elements moved to its cheapest place nearby."""
    problem = _problem(graph, half)
    at = np.array([start[name] for name in half])
    for _ in range(_SWEEPS):
        moved = False
        for group in problem.groups:
            near = [b if a in group else a for a, b in problem.ends if (a in group) != (b in group)]
            lead = at[group[0]]
            middle = np.round(at[near or [group[0]]].mean(axis=0) / STEP) * STEP  # of the neighbours
            targets = np.concatenate([[lead], lead + _grid(_WINDOW), middle + _grid(_WINDOW // 2)])
            candidates = np.repeat(at[None], len(targets), axis=0)
            candidates[:, list(group)] += (targets - lead)[:, None]
            costs = cost(problem, candidates, group)
            best = int(np.argmin(costs))
            if costs[best] < costs[0] - 1e-6:
                at[:] = candidates[best]
                moved = True
        if not moved:
            break
    return dict(zip(half, map(tuple, at.tolist()), strict=True))


def _grid(reach: int) -> Array:
    steps = np.arange(-reach, reach + 1)
    return np.asarray(np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * STEP)


def _problem(graph: BondGraph, half: Mapping[str, tuple[float, float]]) -> Arrangement:
    index = {name: k for k, name in enumerate(half)}
    bonds = [bond for bond in graph.bonds if bond.tail in half and bond.head in half]
    near = [[index[bond.other(name)] for bond in graph.at(name) if bond.other(name) in half] for name in half]
    kinds = [graph.elements[name].kind for name in half]
    pairs = [(k, a, b) for k, others in enumerate(near) for n, a in enumerate(others) for b in others[:n] if a != b]
    layer = {name: k for k, names in enumerate(_layers(graph)) for name in names}
    taste = []  # inertias up, resistors and springs down, as textbooks print them; what lies further on, to the right
    for bond in bonds:
        if bond.tail in layer and bond.head in layer:
            taste.append((_ONWARD * float(np.sign(layer[bond.head] - layer[bond.tail])), 0.0))
        else:
            port, sign = (bond.tail, -1.0) if bond.tail not in layer else (bond.head, 1.0)
            taste.append((0.0, sign * {"I": _UPWARD, "R": -_UPWARD, "C": -_UPWARD}.get(graph.elements[port].kind, 0.0)))
    ports = [tuple(n for n in others if kinds[n] in ONE_PORTS) for others in near]
    loose = [port for own in ports for port in own]
    groups: list[tuple[int, ...]] = [(port,) for port in loose]
    for k, own in enumerate(ports):
        groups += ([(k,)] if k not in loose else []) + ([(k, *own)] if own else [])
    for joint, others in enumerate(near):  # branches: the smaller parts that the graph falls into without one element
        apart = {k: [n for n in around if n != joint] for k, around in enumerate(near)}
        seen = {joint}
        for lead in others:
            if lead not in seen:
                branch = reached_from(lead, apart)
                seen |= branch
                if 1 < len(branch) < len(near) / 2:
                    groups.append((lead, *sorted(branch - {lead})))
    return Arrangement(
        np.array(list(half.values())).reshape(-1, 2) + _FREE / 2.0,
        np.array([(index[b.tail], index[b.head]) for b in bonds], dtype=np.intp).reshape(-1, 2),
        np.array(pairs, dtype=np.intp).reshape(-1, 3),
        np.array([kinds[k] in TWO_PORTS for k, _, _ in pairs], dtype=np.bool_),
        np.array(taste).reshape(-1, 2),
        np.array([min(_HALF_STROKE / np.tan(np.pi / max(len(others), 3)), _FARTHEST) for others in near]),
        tuple(groups),
    )


def _layers(graph: BondGraph) -> list[list[str]]:
    """Junctions and two-ports by their distance from the one named first, in the order of a depth-first walk."""
    near = {
        name: [b.other(name) for b in graph.at(name) if graph.elements[b.other(name)].kind not in ONE_PORTS]
        for name, element in graph.elements.items()
        if element.kind not in ONE_PORTS
    }
    walk: dict[str, None] = {}
    distance: dict[str, int] = {}
    for first in near:  # parts that only laws tie, such as those of a field, one after the other
        todo = [first]
        while todo:
            name = todo.pop()
            if name not in walk:
                walk[name] = None
                todo += reversed(near[name])
        reached = [] if first in distance else [first]
        distance |= dict.fromkeys(reached, 1 + max(distance.values(), default=-1))
        for name in reached:
            fresh = [other for other in near[name] if other not in distance]
            distance |= dict.fromkeys(fresh, distance[name] + 1)
            reached += dict.fromkeys(fresh)
    return [[name for name in walk if distance[name] == k] for k in range(max(distance.values()) + 1)]


def _ordered(graph: BondGraph, layers: list[list[str]]) -> list[list[str]]:
    """Each layer sorted by the mean place of its neighbours, to and fro, to the order with the fewest crossings."""
    best, fewest = layers, _crossings(graph, layers)
    for sweep in range(12):
        layers = [list(layer) for layer in layers]
        onward = sweep % 2 == 0
        for k in range(1, len(layers)) if onward else range(len(layers) - 2, -1, -1):
            places = {name: place for place, name in enumerate(layers[k - 1] if onward else layers[k + 1])}
            mean: dict[str, float] = {}
            for row, name in enumerate(layers[k]):
                near = [places[b.other(name)] for b in graph.at(name) if b.other(name) in places]
                mean[name] = sum(near) / len(near) if near else float(row)
            layers[k] = sorted(layers[k], key=lambda name, mean=mean: mean[name])  # type: ignore[misc]
        fresh = []
        for k, layer in enumerate(layers):  # neighbours switched wherever that leaves fewer crossings
            before, after = layers[max(k - 1, 0) : k], layers[k + 1 : k + 2]
            for n in range(len(layer) - 1):
                other = [*layer[:n], layer[n + 1], layer[n], *layer[n + 2 :]]
                if _crossings(graph, [*before, other, *after]) < _crossings(graph, [*before, layer, *after]):
                    layer = other
            fresh.append(layer)
        layers = fresh
        count = _crossings(graph, layers)
        if count < fewest:
            best, fewest = layers, count
    return best


def _crossings(graph: BondGraph, layers: Sequence[Sequence[str]]) -> int:
    count = 0
    for left, right in pairwise(layers):
        place = {name: k for k, name in enumerate(right)}
        ends = [(k, place[b.other(n)]) for k, n in enumerate(left) for b in graph.at(n) if b.other(n) in place]
        count += sum((a[0] - b[0]) * (a[1] - b[1]) < 0 for i, a in enumerate(ends) for b in ends[:i])
    return count


def cost(problem: Arrangement, at: Array, group: Sequence[int]) -> Array:
    """The share of a group of elements in the cost of a drawing, for each set of positions (k, n, 2)."""
    half, ends = problem.half, problem.ends
    chosen = np.zeros(len(half), dtype=bool)
    chosen[list(group)] = True
    touched: Mask = np.asarray(chosen[ends].any(axis=1))

    gap = np.abs(at[:, chosen, None] - at[:, None]) - (half[chosen, None] + half[None])
    meet = (gap < 0).all(axis=-1) & (np.flatnonzero(chosen)[:, None] != np.arange(len(chosen)))[None]
    total = _OVERLAP * meet.sum(axis=(1, 2), dtype=float)

    for bonds, boxes in ((touched, np.ones_like(chosen)), (~touched, chosen)):  # bonds through labels of others
        own, where = ends[bonds], np.flatnonzero(boxes)
        hit = enters(at[:, own[:, 0], None], at[:, own[:, 1], None], at[:, None, where], half[where])
        total += _THROUGH * (hit & ~(own[:, :, None] == where).any(axis=1)).sum(axis=(1, 2))

    apart = (ends[touched, None, :, None] != ends[None, :, None, :]).all(axis=(2, 3))
    once = np.where(touched[None, :], 0.5, 1.0) * apart
    a, b = at[:, ends[touched, 0], None], at[:, ends[touched, 1], None]
    c, d = at[:, None, ends[:, 0]], at[:, None, ends[:, 1]]
    across = (_cross(b - a, c - a) * _cross(b - a, d - a) < 0) & (_cross(d - c, a - c) * _cross(d - c, b - c) < 0)
    total += _CROSSING * (across * once).sum(axis=(1, 2))

    tail, head = ends[touched].T
    along = at[:, head] - at[:, tail]
    length = np.hypot(along[..., 0], along[..., 1]) + 1e-9
    unit = along / length[..., None]
    visible = length - sum(
        np.maximum(np.min(half[end] / (np.abs(unit) + 1e-9), axis=-1), problem.clear[end]) for end in (tail, head)
    )
    cramped = np.maximum(_SHORTEST - visible, 0.0)
    oblique = (2.0 * unit[..., 0] * unit[..., 1]) ** 2
    taste = -(unit * problem.taste[touched]).sum(axis=-1)
    total += (visible + _CRAMPED * cramped + _OBLIQUE * oblique + taste).sum(axis=1)

    met = chosen[problem.pairs].any(axis=1)  # bends at two-ports; elsewhere, what an angle is below the narrowest good one
    pairs = problem.pairs[met]
    one, two = (at[:, pairs[:, k]] - at[:, pairs[:, 0]] for k in (1, 2))
    lengths = np.hypot(one[..., 0], one[..., 1]) * np.hypot(two[..., 0], two[..., 1]) + 1e-9
    cosine = (one * two).sum(axis=-1) / lengths
    narrow = _NARROW * np.maximum(cosine - _ANGLE_COSINE, 0.0) / (1.0 - _ANGLE_COSINE)
    total += np.where(problem.straight[met], _BENT * (1.0 + cosine), narrow).sum(axis=1)
    return np.asarray(total)


def _cross(u: Array, v: Array) -> Array:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def enters(start: Array, end: Array, centre: Array, half: Array) -> Mask:
    """True where segments pass through boxes; all arrays broadcast."""
    along = end - start
    along = np.where(np.abs(along) < 1e-9, 1e-9, along)
    one, two = (centre - half - start) / along, (centre + half - start) / along
    first, last = np.minimum(one, two), np.maximum(one, two)
    latest = np.maximum(np.maximum(first[..., 0], first[..., 1]), 0.0)
    return np.asarray(latest < np.minimum(np.minimum(last[..., 0], last[..., 1]), 1.0))


class Spot(NamedTuple):
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
        """True where two boxes share an area."""
        across = 2.0 * abs(self.x - other.x) < self.width + other.width
        return across and 2.0 * abs(self.y - other.y) < self.height + other.height

    def grown(self, across: float, up: float) -> Box:
        """The box with margins to its sides, and above and below."""
        return Box(self.x, self.y, self.width + 2.0 * across, self.height + 2.0 * up)


class Segment(NamedTuple):
    """A straight line from one point to another; a bond's goes from tail to head, as far as it is visible."""

    start: Spot
    end: Spot

    @property
    def length(self) -> float:
        """The length in points."""
        return hypot(self.end.x - self.start.x, self.end.y - self.start.y)

    def point(self, share: float, aside: float = 0.0) -> Spot:
        """The point at a share of the way, so far to the flow side of it."""
        dx, dy = self.end.x - self.start.x, self.end.y - self.start.y
        length = self.length or 1.0
        ux, uy = dy / length, -dx / length
        sign = 1.0 if ux * _FLOW_SIDE[0] + uy * _FLOW_SIDE[1] > 0 else -1.0
        return Spot(self.start.x + share * dx + aside * sign * ux, self.start.y + share * dy + aside * sign * uy)

    def passes(self, box: Box) -> bool:
        """True where it passes through a box."""
        half = np.array([box.width, box.height]) / 2.0
        return bool(enters(np.array(self.start), np.array(self.end), np.array([box.x, box.y]), half))


@dataclass(frozen=True)
class Layout:
    """A graph's drawing: what each element's label says and the boxes it fills, each bond's visible line and number."""

    labels: Mapping[str, ElementLabel]
    boxes: Mapping[str, tuple[Box, ...]]
    bonds: Mapping[int, Segment]
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

    The elements take the places that `place` finds; the drawing then grows, or is arranged anew, until it has no flaws.

    >>> from bondgraph import Builder, I, Se
    >>> graph = Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build()
    >>> drawn = layout(graph)
    >>> sorted(drawn.bonds), list(flaws(drawn))
    ([1, 2], [])

    Raises:
        GraphError: if no arrangement without flaws was found.

    """
    written = labels(graph)
    half = {}  # of the smallest box around each label that has its anchor in the middle
    for name, label in written.items():
        boxes = _boxes(label, 0.0, 0.0)
        half[name] = max(b.width / 2.0 for b in boxes), max(abs(b.y) + b.height / 2.0 for b in boxes)
    ends = {b.number: (b.tail, b.head) for b in graph.bonds}
    at = place(graph, half)
    for attempt in range(_ATTEMPTS):
        for growth in range(_GROWTHS):  # farther and farther apart
            scale = _GROWTH**growth
            filled = {name: _boxes(label, scale * at[name][0], scale * at[name][1]) for name, label in written.items()}
            lines = {b.number: _visible(graph, b, filled) for b in graph.bonds}
            drawn = Layout(written, filled, lines, _numbers(lines, filled), ends)
            if not any(flaws(drawn)):
                return drawn
        at = rearranged(graph, half, at, attempt)
    raise GraphError("this graph is too entangled to be drawn clearly; draw parts of it by themselves")


def flaws(drawn: Layout) -> Iterator[str]:
    """The faults of a layout: labels on labels, bonds too short or through labels of others, numbers on labels."""
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
    # bonds that run through the end of another, where its stroke or half arrow would read as theirs
    tips = [(number, name) for number in drawn.bonds for name in drawn.ends[number]]
    marks, size = _arrays(Box(*tip, _STROKE, _STROKE) for line in drawn.bonds.values() for tip in line)
    for number, line in drawn.bonds.items():
        for k in np.flatnonzero(enters(np.array(line.start), np.array(line.end), marks, size)):
            other, name = tips[k]
            if other != number and name not in drawn.ends[number]:
                yield f"bond {number} passes through the end of bond {other} at {name!r}"
    numbered, size = _arrays(drawn.numbers.values())
    for one, two in zip(*np.nonzero((np.abs(numbered[:, None] - centre) < size[:, None] + half).all(axis=-1)), strict=True):
        yield f"the number of bond {list(drawn.numbers)[one]} lies on the label of {owned[two][0]!r}"


def half_arrow(line: Segment) -> Segment:
    """The barb of a bond's half arrow: from its head back, on the flow side."""
    return Segment(line.end, line.point(1.0 - 0.87 * _BARB / max(line.length, _BARB), 0.5 * _BARB))


def stroke(line: Segment, at_end: bool) -> Segment:
    """The causal stroke: a short bar across a bond, at its end (the half arrow's head) or else at its start."""
    share = 1.0 if at_end else 0.0
    return Segment(line.point(share, -_STROKE / 2.0), line.point(share, _STROKE / 2.0))


def _arrays(boxes: Iterable[Box]) -> tuple[Array, Array]:
    table = np.array(list(boxes)).reshape(-1, 4)
    return table[:, :2], table[:, 2:] / 2.0


def _boxes(label: ElementLabel, x: float, y: float) -> tuple[Box, ...]:
    """The boxes of a label at its anchor: a junction's digit with its name below, or one for all the others."""
    name = max((width(line, NAME_SIZE if label.junction else LABEL_SIZE) for line in label.lines), default=0.0)
    if not label.junction:
        first = width(f"{label.symbol}:{label.lines[0]}" if label.lines else label.symbol, LABEL_SIZE)
        return (Box(x, y, max(first, name), LINE_SPACING * LABEL_SIZE * max(len(label.lines), 1)),)
    digit = Box(x, y, 0.6 * JUNCTION_SIZE, JUNCTION_SIZE)
    tall = LINE_SPACING * NAME_SIZE * len(label.lines)
    return (digit, Box(x, y - (digit.height + tall) / 2.0, name, tall)) if label.lines else (digit,)


def _centre(boxes: Mapping[str, tuple[Box, ...]], name: str) -> Spot:
    return Spot(boxes[name][0].x, boxes[name][0].y)


def _visible(graph: BondGraph, bond: Bond, boxes: Mapping[str, tuple[Box, ...]]) -> Segment:
    """A bond from where it leaves its tail's boxes to where it reaches its head's, apart from its neighbours."""
    whole = Segment(_centre(boxes, bond.tail), _centre(boxes, bond.head))
    beside = [b.number for b in graph.at(bond.tail) if b.other(bond.tail) == bond.head]
    aside = 2.0 * _ASIDE * (beside.index(bond.number) - (len(beside) - 1) / 2.0)
    whole = Segment(whole.point(0.0, aside), whole.point(1.0, aside))
    first, last = (
        max(_leaving(line, boxes[name]), min(_clearance(graph, bond, name, boxes) / max(whole.length, 1.0), 0.3))
        for line, name in ((whole, bond.tail), (Segment(whole.end, whole.start), bond.head))
    )
    return Segment(whole.point(min(first, 1.0 - last)), whole.point(max(first, 1.0 - last)))


def _clearance(graph: BondGraph, bond: Bond, name: str, boxes: Mapping[str, tuple[Box, ...]]) -> float:
    """The least distance of a bond from an element at which its stroke keeps clear of those of its neighbours."""
    here = _centre(boxes, name)
    ways = {b.number: _centre(boxes, b.other(name)) for b in graph.at(name)}
    angles = {n: atan2(there.y - here.y, there.x - here.x) for n, there in ways.items()}
    apart = [abs(remainder(angle - angles[bond.number], tau)) for n, angle in angles.items() if n != bond.number]
    return min(0.55 * _STROKE / tan(max(min(apart), 0.1) / 2.0), _FARTHEST) if apart else 0.0


def _leaving(line: Segment, boxes: Iterable[Box]) -> float:
    """The share of a line at which it has left all boxes that it passes, with room for a stroke across it."""
    slant = _STROKE / 2.0 / max(line.length, 1.0)
    lean = (slant * abs(line.end.y - line.start.y), slant * abs(line.end.x - line.start.x))
    shares = [0.0]
    for k, box in enumerate(boxes):
        grown = box.grown(_CLEAR + lean[0], _CLEAR + lean[1]) if k == 0 else box.grown(_CLEAR + _STROKE / 2.0, _CLEAR)
        if line.passes(grown):
            across = _exits(line.start.x, line.end.x, grown.x, grown.width / 2.0)
            up = _exits(line.start.y, line.end.y, grown.y, grown.height / 2.0)
            shares.append(min(across, up))
    return min(max(shares), 1.0)


def _exits(start: float, end: float, centre: float, half: float) -> float:
    step = end - start
    return max((centre - half - start) / step, (centre + half - start) / step) if abs(step) > 1e-9 else 1.0


def _numbers(lines: Mapping[int, Segment], boxes: Mapping[str, tuple[Box, ...]]) -> dict[int, Box]:
    """The box of each bond's number: beside the bond, away from the half arrow, where it hides least."""
    words = _arrays(box.grown(_CLEAR, _CLEAR) for own in boxes.values() for box in own)
    ink = [part for line in lines.values() for part in (line, half_arrow(line), stroke(line, True), stroke(line, False))]
    starts, ends = (np.array([part[k] for part in ink]) for k in (0, 1))
    boxed: dict[int, Box] = {}
    for number, line in lines.items():
        size = (width(str(number), NUMBER_SIZE), NUMBER_SIZE)
        candidates = [Box(*line.point(share, -_ASIDE), *size) for share in _NUMBER_PLACES]
        centre, half = _arrays(candidates)
        on_words = (np.abs(words[0] - centre[:, None]) < words[1] + half[:, None]).all(axis=-1).sum(axis=1)
        on_ink = enters(starts, ends, centre[:, None], half[:, None]).sum(axis=1)
        on_numbers = np.array([sum(box.overlaps(other) for other in boxed.values()) for box in candidates])
        boxed[number] = candidates[int(np.argmin(100 * on_words + 10 * on_numbers + on_ink))]
    return boxed


# -- the picture -------------------------------------------------------------------------------------------------------


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
_TRANSFORMER = r"transformer: $f_{\mathrm{out}} = T\,f_{\mathrm{in}}$,  $e_{\mathrm{in}} = T\,e_{\mathrm{out}}$"
_GYRATOR = r"gyrator: $e_{\mathrm{out}} = G\,f_{\mathrm{in}}$,  $e_{\mathrm{in}} = G\,f_{\mathrm{out}}$"
_DERIVATIVE = "store in derivative causality"
_DATES: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}


def draw(
    graph: BondGraph,
    file: str | Path | None = None,
    *,
    causality: Causality | Mapping[int, str] | None = None,
    numbers: bool = True,
    title: str | None = None,
    loops: bool = False,
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
        loops: whether bonds of zero-order causal paths, which make algebraic loops, are marked.

    Raises:
        GraphError: for another file ending, or strokes at elements that their bonds do not have.

    >>> from bondgraph import Builder, I, Se
    >>> figure = draw(Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build(), causality={1: "J"})
    >>> [text.get_text() for text in figure.axes[0].texts]
    ['1', 'shaft', 'I:$J$', 'Se:$M$', '1', '2']

    """
    _kind(file)
    graph = as_graph(graph)
    strokes, derivative = _causes(graph, causality)
    drawn = layout(graph)
    notes = _notes(graph, derivative)
    marked = {n for loop in strokes_of(graph).loops for n in loop.bonds} if loops else ()
    axes = _canvas(drawn, title, len(notes))
    for bond in graph.bonds:
        line, domain = drawn.bonds[bond.number], graph.domain(bond)
        colour = COLOURS[domain.name] if domain is not None else _INK
        if bond.number in marked:
            _plot(axes, line, _MARKED, 7.0)
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
    _save(figure, file)
    return figure


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
        given = strokes_of(graph)
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


def _notes(graph: BondGraph, derivative: frozenset[str]) -> list[str | list[str]]:
    """The lines below the picture: the domains whose colours it has, or a sentence."""
    present = {domain.name for domain in map(graph.domain, graph.bonds) if domain is not None}
    domains = [name for name in DOMAINS if name in present]
    kinds = {element.kind for element in graph.elements.values()}
    notes: list[str | list[str]] = [domains] if domains else []
    return notes + [_DERIVATIVE] * bool(derivative) + [_TRANSFORMER] * ("TF" in kinds) + [_GYRATOR] * ("GY" in kinds)


def _canvas(drawn: Layout, title: str | None, lines: int) -> Axes:
    """Axes that fill their figure and count in points, with room for the lines below and the title above."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    left, bottom, right, top = drawn.bounds
    spare = max(_CAPTION_WIDTH - (right - left), 0.0) / 2.0
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


def _plot(axes: Axes, line: Segment, colour: str, thick: float) -> None:
    (x0, y0), (x1, y1) = line.start, line.end
    axes.plot([x0, x1], [y0, y1], color=colour, linewidth=thick, solid_capstyle="butt", scalex=False, scaley=False)


def _dash(axes: Axes, box: Box) -> None:
    from matplotlib.patches import Rectangle

    corner = (box.x - box.width / 2.0, box.y - box.height / 2.0)
    axes.add_patch(Rectangle(corner, box.width, box.height, fill=False, linewidth=0.8, linestyle=(0, (3, 2)), color=_INK))


def _draw_notes(axes: Axes, notes: list[str | list[str]]) -> None:
    left, bottom = axes.get_xlim()[0] + _MARGIN, axes.get_ylim()[0] + _MARGIN / 2.0
    for row, note in enumerate(reversed(notes)):
        x, y = left, bottom + _LINE * (row + 0.5)
        if note == _DERIVATIVE:  # with a sample of its box
            _dash(axes, Box(x + 8.0, y, 16.0, 9.0))
            x += 20.0
        if isinstance(note, str):
            _write(axes, note, x, y, NAME_SIZE, ha="left")
            continue
        for name in note:
            _plot(axes, Segment(Spot(x, y), Spot(x + 16.0, y)), COLOURS[name], 2.0)
            _write(axes, name, x + 20.0, y, NAME_SIZE, ha="left")
            x += 30.0 + width(name, NAME_SIZE)
