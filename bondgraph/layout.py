"""The places of a bond graph's labels, bonds and numbers in a drawing, in points.

Names are shortened only where the picture stays unambiguous: a name that only repeats the neighbours' names is omitted, a
first part that whole groups of names share is left out while the rest stays unique, and long names wrap at their dots. The
size of a text is estimated, never too small.

Elements start in layers of a breadth-first walk; then they move on a grid as long as that lowers a cost: that of all that
makes a drawing hard to read: labels that overlap, bonds through labels, crossings, bonds too short for their number, too
long, oblique, or side by side. A graph that is too long for a sheet is folded in rows. Every step is deterministic: the same
graph, the same drawing. The result of `layout` has no flaws in the sense of `flaws`, for any graph.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, hypot, remainder, tan, tau
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import JUNCTIONS, ONE_PORTS, TWO_PORTS, Function, GraphError
from bondgraph.graph import Bond, BondGraph, activated
from bondgraph.numerics import Array, Indices, reached_from

LABEL_SIZE, JUNCTION_SIZE, NAME_SIZE, NUMBER_SIZE = 11.5, 14.0, 8.5, 8.0  # points
LINE_SPACING = 1.25
Mask = NDArray[np.bool_]
Places = dict[str, tuple[float, float]]
_WRAP = 12  # characters
LETTERS = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi omega "
    "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
)
GREEK = dict(zip(LETTERS.split(), "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ", strict=True))
_BREAK = re.compile(r"(?<=\.)(?!\d|[^(]*\))|(?=->)|(?=\()")
TOKEN = re.compile(r"(?<![A-Za-z0-9_])([A-Za-z]+)_?([A-Za-z0-9]*)(?![A-Za-z0-9_])")
STEP = np.array([24.0, 24.0])  # points: the grid
_FREE, _SHORTEST = 6.0, 32.0  # points: free around labels, of a bond to be seen between its labels
_STROKE, _FARTHEST = 11.0, 26.0  # points: a causal stroke, and how far it moves out where bonds crowd
_HALF_STROKE = 6.0  # points: half a stroke, with its line
_WINDOW, _SWEEPS = 5, 14
_OVERLAP, _THROUGH, _CROSSING, _CRAMPED, _NARROW, _BENT = 900.0, 700.0, 260.0, 5.0, 80.0, 40.0
_OBLIQUE, _UPWARD, _ONWARD = 55.0, 8.0, 40.0
_PITCH = 4.0  # steps between layers at the start
_WIDEST, _PAGE, _GUTTER = 1000.0, 1.41, 24.0  # points: wider drawings are folded in rows; sides of a sheet; between rows
_LARGEST = 20  # elements of a branch that moves as one
_ROOM = (14.0, 20.0)  # points around the labels of the backbone while the one-ports are still to come
_PULL, _SHAKE = 1.3, 40.0  # times and points, where all is arranged once more
_ANGLE_COSINE = np.cos(np.radians(34.0))
_WIDE, _CLOSE = (
    np.stack(np.meshgrid(*2 * [np.arange(-reach, reach + 1)]), axis=-1).reshape(-1, 2) * STEP for reach in (_WINDOW, 2)
)
_MOVES = [(-1, 0), (1, 0), (0, 1), (0, -1), (-1, -1), (1, -1), (-1, 1), (1, 1), (-2, 1), (2, 1), (-2, -1), (2, -1)]
_ONE_PORT_SIDES = {"Se": (-1.0, 0.1), "Sf": (-1.0, 0.1), "I": (0.1, 1.0), "R": (0.1, -1.0), "C": (-0.1, -1.0)}
_CLEAR = 3.0  # points between a label and the end of its bond
_ASIDE = 7.0  # points from a bond to the middle of its number
_NUMBER_PLACES = (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82)  # of the bond, where its number may stand
BARB = 8.5  # points: the half arrow's barb
_GROWTH, _GROWTHS, _ATTEMPTS = 1.06, 10, 20  # a drawing grows by 1.06 up to ten times, then is arranged anew
_FLOW_SIDE = (0.6, -0.8)  # half arrows lie on the flow side of a bond, which is below or to the right


class ElementLabel(NamedTuple):
    """The words at one element: its symbol (MTF, I, 1...) and the lines of its name, none if these are omitted."""

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
    """Each name as it is drawn: without its first part if the rest is unique."""
    names = list(graph.displacements)
    for name in reversed(list(graph.elements)):  # except for those composed of neighbours' names, as `Builder` does
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
    return TOKEN.sub(lambda m: GREEK.get(m[1], m[1]) + m[2] if is_symbol(m) else m[0], text)


def is_symbol(match: re.Match[str]) -> bool:
    """True of a single or Greek letter, with an index or without."""
    letters, index = match[1], match[2]
    joined = match[0] == letters + index
    return (len(letters) == 1 or letters in GREEK) and (index == "" or index.isdigit() or not joined)


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
    taste: Array  # the direction that each bond would like to have; 0 if it does not mind
    clear: Array  # points from the middle of each element to where its bonds begin to be seen
    groups: tuple[tuple[int, ...], ...]  # what moves together: an element, a junction with its one-ports, a branch


def place(graph: BondGraph, half: Mapping[str, tuple[float, float]]) -> Places:
    """The centre of every element, in points, given the half width and half height of its label.

    The backbone of junctions and two-ports comes first, with extra space; then the one-ports follow, each in its preferred
    free direction at its junction, and all move. A long graph is then folded in rows.
    """
    backbone = [name for name, element in graph.elements.items() if element.kind not in ONE_PORTS]
    if len(backbone) == 1 and len(half) > 1 + len(_MOVES):
        return star(graph, half, backbone[0])
    layers = _ordered(graph, _layers(graph))
    start = {
        name: (_PITCH * STEP[0] * column, _PITCH * STEP[1] * ((len(layer) - 1) // 2 - row))
        for column, layer in enumerate(layers)
        for row, name in enumerate(layer)
    }
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
    return _folded(graph, half, layers, _settled(graph, half, at))


def star(graph: BondGraph, half: Mapping[str, tuple[float, float]], hub: str) -> Places:
    """The one-ports of a single junction in a ring, as close as the greatest label allows in each direction."""
    ways = {name: _ONE_PORT_SIDES[element.kind] for name, element in graph.elements.items() if name != hub}
    ports = sorted(ways, key=lambda name: atan2(ways[name][1], ways[name][0]) % tau)
    wide, high = (2.0 * max(half[name][k] for name in ports) + _FREE for k in (0, 1))
    angles = np.linspace(0.0, tau, 1 + 16 * len(ports))
    across, up = (np.maximum(np.abs(side), 1e-9) for side in (np.sin(angles), np.cos(angles)))
    sizes = np.maximum(np.minimum(wide / across, high / up), 0.6 * (wide * across + high * up))  # the bonds pass, too
    starts = np.concatenate([[0.0], np.cumsum(1.0 / sizes)[:-1]])  # labels on a unit of radius
    turns = np.interp(np.arange(len(ports)) / len(ports), starts / starts[-1], angles)
    radius = max(len(ports) / (starts[-1] * angles[1]), 0.5 * wide + 2.0 * _SHORTEST)
    return {hub: (0.0, 0.0)} | {
        n: (float(radius * np.cos(a)), float(radius * np.sin(a))) for n, a in zip(ports, turns, strict=True)
    }


def _folded(graph: BondGraph, half: Mapping[str, tuple[float, float]], layers: list[list[str]], at: Places) -> Places:
    """The places of a graph that is too long for a sheet, in rows that alternate in direction, one below the other.

    The cuts are at elements that are alone in their layer, and so join the parts before and behind them: behind
    such an element the rest may be mirrored, and no bond crosses another that did not before. Where there are none, every
    other row is turned upside down, and bonds lead round each other from one row to the next, the uppermost outside.
    """
    column = {name: k for k, layer in enumerate(layers) for name in layer}
    column |= {b.other(name): k for name, k in column.items() for b in graph.at(name) if b.other(name) not in column}
    if max(x for x, _ in at.values()) - min(x for x, _ in at.values()) <= _WIDEST:
        return at
    names = list(half)
    table, size, layer_of = (np.array([own[name] for name in names]) for own in (at, half, column))
    index = {name: k for k, name in enumerate(names)}
    ends_of = np.array([(index[b.tail], index[b.head]) for b in graph.bonds])
    for k in range(1, len(layers)):  # closer together from layer to layer, as far as the labels and bonds allow
        behind = layer_of >= k
        gap = table[None, behind] - table[~behind, None]
        room = size[None, behind] + size[~behind, None]
        beside = np.abs(gap[..., 1]) < room[..., 1] + _FREE
        slack = [float((gap[..., 0] - room[..., 0])[beside].min(initial=np.inf)) - _FREE]
        for one, two in ends_of[behind[ends_of[:, 0]] != behind[ends_of[:, 1]]]:
            along = np.abs(table[two] - table[one])
            slack.append(float(along[0] - size[one][0] - size[two][0]) - _SHORTEST)
        table[behind, 0] -= max(np.floor(min(slack) / STEP[0]), 0.0) * STEP[0]
    at = dict(zip(names, map(tuple, table.tolist()), strict=True))
    width, height = np.ptp(table, axis=0) + 2.0 * size.max(axis=0)
    rows = min(range(1, len(layers) + 1), key=lambda n: max(width / n / _PAGE, n * (height + _GUTTER)))
    alone = [k for k in range(1, len(layers) - 1) if len(layers[k]) == 1]
    cuts = alone or list(range(1, len(layers) - 2))
    if not cuts:
        return _settled(graph, half, at)
    left = min(x for x, _ in at.values())
    ideal = [left + n * width / rows for n in range(1, rows)]
    inner = {min(cuts, key=lambda k, x=x: abs(at[layers[k][0]][0] - x)) for x in ideal}  # type: ignore[misc]
    ends = [*sorted(inner), len(layers) - 1]  # the last layers of the rows
    folded: Places = {}
    turn, below = 0.0, 0.0
    turning = [layers[k] if alone else [*layers[k], *layers[k + 1]] for k in ends[:-1]]
    loose = {b.other(name) for names in turning for name in names for b in graph.at(name)}
    for n, last in enumerate(ends):
        first, way, before = ends[n - 1] + 1 if n else 0, -1.0 if n % 2 else 1.0, turn
        own = {name: (way * x, y if alone else way * y) for name, (x, y) in at.items() if first <= column[name] <= last}
        begin = own[layers[first][0]][0] if alone else -way * max(-way * x for x, _ in own.values())
        own = {name: (x + (before - begin if n else 0.0), y) for name, (x, y) in own.items()}
        turn = own[layers[last][0]][0] if alone else way * max(way * x for x, _ in own.values())
        for k, edge, side in ((first, before, -way), (last, turn, way)):
            if alone or (k == first and n == 0) or (k == last and last == ends[-1]):
                continue
            upwards = sorted(layers[k], key=lambda name: own[name][1])
            for rank, name in enumerate(upwards if k == last else reversed(upwards)):
                move = edge + side * _PITCH * STEP[0] * rank - own[name][0]
                ports = (b.other(name) for b in graph.at(name) if graph.elements[b.other(name)].kind in ONE_PORTS)
                own |= {other: (own[other][0] + move, own[other][1]) for other in (name, *ports)}
        top, bottom = (
            side(y + sign * half[name][1] for name, (_, y) in own.items()) for side, sign in ((max, 1), (min, -1))
        )
        shift = np.ceil((top - below + _GUTTER) / STEP[1]) * STEP[1] if n else 0.0
        folded |= {name: (x, y - shift) for name, (x, y) in own.items()}
        below = bottom - shift
    return _settled(graph, half, {name: folded[name] for name in at}, loose)


def rearranged(graph: BondGraph, half: Mapping[str, tuple[float, float]], at: Places, attempt: int) -> Places:
    """New places for the same elements: pulled apart and shaken, differently at each attempt, then moved again."""
    k = np.arange(len(at))
    shake = _SHAKE * np.sin(np.stack([7.0 * k, 11.0 * k], axis=-1) + attempt)
    aligned = np.round((_PULL * np.array(list(at.values())) + shake) / STEP) * STEP
    return _settled(graph, half, dict(zip(at, map(tuple, aligned.tolist()), strict=True)))


def _settled(
    graph: BondGraph, half: Mapping[str, tuple[float, float]], start: Places, loose: Collection[str] | None = None
) -> Places:
    """The part of the graph whose half sizes are given, each group of elements moved to its cheapest place nearby.

    Costs are those of what a group can meet, and it is examined again only if something there has moved since; at first
    only near what is `loose` (None: everywhere).
    """
    problem = _problem(graph, half)
    at, ends = np.array([start[name] for name in half]), problem.ends
    moved = np.array([loose is None or name in loose for name in half], dtype=np.intp)  # when each element moved last
    last: dict[tuple[int, ...], tuple[int, Array, Array, Mask]] = {}
    clock = 1
    for _ in range(_SWEEPS):
        before = clock
        for group in problem.groups:
            mine = np.zeros(len(at), dtype=bool)
            mine[list(group)] = True
            reach = problem.half[mine].max(axis=0) + _WINDOW * STEP
            when, low, high, around = last.get(group, (0, at[mine].min(axis=0) - reach, at[mine].max(axis=0) + reach, mine))
            if not ((moved > when) & (around | ((at > low) & (at < high)).all(axis=-1))).any():
                continue
            own = ends[mine[ends].any(axis=1)].ravel()
            tied = own[~mine[own]]
            lead = at[group[0]]
            middle = np.round(at[tied if len(tied) else [group[0]]].mean(axis=0) / STEP) * STEP  # of the neighbours
            targets = np.concatenate([[lead], lead + _WIDE, middle + _CLOSE])
            shifts = targets - lead
            corners = np.concatenate([at[mine] + shifts.min(axis=0), at[mine] + shifts.max(axis=0), at[tied]])
            reach = problem.half[mine].max(axis=0)
            low, high = corners.min(axis=0) - reach, corners.max(axis=0) + reach
            boxes = ((at + problem.half > low) & (at - problem.half < high)).all(axis=-1)
            between = (at[ends].max(axis=1) > low) & (at[ends].min(axis=1) < high)
            near = np.flatnonzero(boxes), np.flatnonzero(between.all(axis=-1))
            boxes[ends[near[1]]] = True
            candidates = np.repeat(at[None], len(targets), axis=0)
            candidates[:, list(group)] += shifts[:, None]
            costs = strain(problem, candidates, mine)
            now = costs[0] + clashes(problem, candidates[:1], mine, *near)[0]
            better = np.flatnonzero(costs < now - 1e-6)  # clashes only add to it
            costs = costs[better] + clashes(problem, candidates[better], mine, *near)
            if costs.min(initial=now) < now - 1e-6:
                at[:] = candidates[better[int(np.argmin(costs))]]
                clock += 1
                moved[mine] = clock
            last[group] = clock, low, high, boxes
        if clock == before:
            break
    return dict(zip(half, map(tuple, at.tolist()), strict=True))


def _problem(graph: BondGraph, half: Mapping[str, tuple[float, float]]) -> Arrangement:
    index = {name: k for k, name in enumerate(half)}
    bonds = [bond for bond in (*graph.bonds, *activated(graph)) if bond.tail in half and bond.head in half]
    near = [[index[bond.other(name)] for bond in graph.at(name) if bond.other(name) in half] for name in half]
    kinds = [graph.elements[name].kind for name in half]
    pairs = [(k, a, b) for k, others in enumerate(near) for n, a in enumerate(others) for b in others[:n] if a != b]
    layer = {name: k for k, names in enumerate(_layers(graph)) for name in names}
    taste = []  # inertias up, resistors and springs down, as textbooks print them; what lies further on, to the right
    for bond in bonds:
        if bond.number < 0:
            taste.append((0.0, 0.0))
        elif bond.tail in layer and bond.head in layer:
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
                if 1 < len(branch) < min(len(near) / 2, _LARGEST):
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
    """Each layer sorted by the mean place of its neighbours, in both directions, to the order with the fewest crossings."""
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


def clashes(problem: Arrangement, at: Array, chosen: Mask, boxes: Indices, bonds: Indices) -> Array:
    """The cost of a group's flaws, for each set of positions (k, n, 2), never below 0.

    That is labels on labels, bonds through labels and crossings, with the other elements and bonds that are given.
    """
    half, ends = problem.half, problem.ends
    touched: Mask = np.asarray(chosen[ends].any(axis=1))
    still = bonds[~touched[bonds]]

    gap = np.abs(at[:, chosen, None] - at[:, None, boxes]) - (half[chosen, None] + half[None, boxes])
    meet = (gap < 0).all(axis=-1) & (np.flatnonzero(chosen)[:, None] != boxes)[None]
    total = _OVERLAP * meet.sum(axis=(1, 2), dtype=float)

    for own, where in ((ends[touched], boxes), (ends[still], np.flatnonzero(chosen))):  # bonds through labels of others
        hit = enters(at[:, own[:, 0], None], at[:, own[:, 1], None], at[:, None, where], half[where])
        total += _THROUGH * (hit & ~(own[:, :, None] == where).any(axis=1)).sum(axis=(1, 2))

    other = np.concatenate([np.flatnonzero(touched), still])
    apart = (ends[touched, None, :, None] != ends[None, other][:, :, None, :]).all(axis=(2, 3))
    once = np.where(touched[other][None, :], 0.5, 1.0) * apart
    a, b = at[:, ends[touched, 0], None], at[:, ends[touched, 1], None]
    c, d = at[:, None, ends[other, 0]], at[:, None, ends[other, 1]]
    across = (_cross(b - a, c - a) * _cross(b - a, d - a) < 0) & (_cross(d - c, a - c) * _cross(d - c, b - c) < 0)
    return np.asarray(total + _CROSSING * (across * once).sum(axis=(1, 2)))


def strain(problem: Arrangement, at: Array, chosen: Mask) -> Array:
    """The cost of the lengths, directions and angles of a group's bonds, for each set of positions (k, n, 2)."""
    half, ends = problem.half, problem.ends
    touched: Mask = np.asarray(chosen[ends].any(axis=1))
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
    total = (visible + _CRAMPED * cramped + _OBLIQUE * oblique + taste).sum(axis=1)

    met = chosen[problem.pairs].any(axis=1)  # bends at two-ports; elsewhere, what an angle is below the narrowest good one
    pairs = problem.pairs[met]
    one, two = (at[:, pairs[:, k]] - at[:, pairs[:, 0]] for k in (1, 2))
    lengths = np.hypot(one[..., 0], one[..., 1]) * np.hypot(two[..., 0], two[..., 1]) + 1e-9
    cosine = (one * two).sum(axis=-1) / lengths
    narrow = _NARROW * np.maximum(cosine - _ANGLE_COSINE, 0.0) / (1.0 - _ANGLE_COSINE)
    return np.asarray(total + np.where(problem.straight[met], _BENT * (1.0 + cosine), narrow).sum(axis=1))


def _cross(u: Array, v: Array) -> Array:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def enters(start: Array, end: Array, centre: Array, half: Array) -> Mask:
    """True if segments pass through boxes; all arrays broadcast."""
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
        """True if two boxes share an area."""
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
        """The point at a share of the way, at a distance to its flow side."""
        dx, dy = self.end.x - self.start.x, self.end.y - self.start.y
        length = self.length or 1.0
        ux, uy = dy / length, -dx / length
        sign = 1.0 if ux * _FLOW_SIDE[0] + uy * _FLOW_SIDE[1] > 0 else -1.0
        return Spot(self.start.x + share * dx + aside * sign * ux, self.start.y + share * dy + aside * sign * uy)

    def passes(self, box: Box) -> bool:
        """True if it passes through a box."""
        half = np.array([box.width, box.height]) / 2.0
        return bool(enters(np.array(self.start), np.array(self.end), np.array([box.x, box.y]), half))


@dataclass(frozen=True)
class Layout:
    """A graph's drawing: each element's label with its boxes, each bond's visible line and number."""

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


def layout(
    graph: BondGraph, written: Mapping[str, ElementLabel] | None = None, texts: Mapping[int, str] | None = None
) -> Layout:
    """Lays a graph out: labels, bonds and numbers that keep clear of each other; the same graph, the same layout.

    The elements take the places that `place` finds; the drawing then grows, or is arranged anew, until it has no flaws.
    written, texts: labels of the elements and texts beside the bonds, in place of their names and numbers.

    >>> from bondgraph import Builder, I, Se
    >>> graph = Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build()
    >>> drawn = layout(graph)
    >>> sorted(drawn.bonds), list(flaws(drawn))
    ([1, 2], [])

    Raises:
        GraphError: if no arrangement without flaws was found.

    """
    written = labels(graph) if written is None else written
    room = max((width(text, NUMBER_SIZE) for text in (texts or {}).values()), default=0.0) / 2.0
    texts = {bond.number: str(bond.number) for bond in graph.bonds} if texts is None else texts
    half = {}  # of the smallest box around each label that has its anchor in the middle
    for name, label in written.items():
        boxes = _boxes(label, 0.0, 0.0)
        half[name] = room + max(b.width / 2.0 for b in boxes), max(abs(b.y) + b.height / 2.0 for b in boxes)
    bonds = (*graph.bonds, *activated(graph))
    ends = {b.number: (b.tail, b.head) for b in bonds}
    at = place(graph, half)
    for attempt in range(_ATTEMPTS):
        for growth in range(_GROWTHS):  # farther and farther apart
            scale = _GROWTH**growth
            filled = {name: _boxes(label, scale * at[name][0], scale * at[name][1]) for name, label in written.items()}
            lines = {b.number: _visible(bonds, b, filled) for b in bonds}
            drawn = Layout(written, filled, lines, _numbers(lines, filled, texts), ends)
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
        if line.length < 2.0 * BARB:
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
    return Segment(line.end, line.point(1.0 - 0.87 * BARB / max(line.length, BARB), 0.5 * BARB))


def arrow_head(line: Segment) -> tuple[Segment, Segment]:
    """The two barbs of a signal's full arrow, at its end."""
    share = 1.0 - 0.8 * BARB / max(line.length, BARB)
    return tuple(Segment(line.end, line.point(share, aside * BARB)) for aside in (-0.35, 0.35))  # type: ignore[return-value]


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


def _visible(bonds: Sequence[Bond], bond: Bond, boxes: Mapping[str, tuple[Box, ...]]) -> Segment:
    """A bond between its tail's and its head's boxes, away from its neighbours."""
    whole = Segment(_centre(boxes, bond.tail), _centre(boxes, bond.head))
    beside = [b.number for b in bonds if {b.tail, b.head} == {bond.tail, bond.head}]
    aside = 2.0 * _ASIDE * (beside.index(bond.number) - (len(beside) - 1) / 2.0)
    whole = Segment(whole.point(0.0, aside), whole.point(1.0, aside))
    first, last = (
        max(_leaving(line, boxes[name]), min(_clearance(bonds, bond, name, boxes) / max(whole.length, 1.0), 0.3))
        for line, name in ((whole, bond.tail), (Segment(whole.end, whole.start), bond.head))
    )
    return Segment(whole.point(min(first, 1.0 - last)), whole.point(max(first, 1.0 - last)))


def _clearance(bonds: Sequence[Bond], bond: Bond, name: str, boxes: Mapping[str, tuple[Box, ...]]) -> float:
    """The least distance of a bond from an element at which its stroke keeps clear of those of its neighbours."""
    here = _centre(boxes, name)
    ways = {b.other(name): _centre(boxes, b.other(name)) for b in bonds if name in b[1:]}
    angles = {other: atan2(there.y - here.y, there.x - here.x) for other, there in ways.items()}
    own = bond.other(name)
    apart = [abs(remainder(angle - angles[own], tau)) for other, angle in angles.items() if other != own]
    farthest = _FARTHEST * max(1.0, len(angles) / len(_MOVES))
    return min(0.55 * _STROKE / tan(max(min(apart), 0.1) / 2.0), farthest) if apart else 0.0


def _leaving(line: Segment, boxes: Iterable[Box]) -> float:
    """The share of a line at which it has left all its boxes, with room for a stroke across it."""
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


def _numbers(lines: Mapping[int, Segment], boxes: Mapping[str, tuple[Box, ...]], texts: Mapping[int, str]) -> dict[int, Box]:
    """The box of each bond's number: beside the bond, away from the half arrow if there is room, where it hides least."""
    words = _arrays(box.grown(_CLEAR, _CLEAR) for own in boxes.values() for box in own)
    ink = [part for line in lines.values() for part in (line, half_arrow(line), stroke(line, True), stroke(line, False))]
    starts, ends = (np.array([part[k] for part in ink]) for k in (0, 1))
    boxed: dict[int, Box] = {}
    placed = np.zeros((len(lines), 4))
    for k, (number, line) in enumerate((n, line) for n, line in lines.items() if n > 0):
        size = (width(texts[number], NUMBER_SIZE), NUMBER_SIZE)
        slope = abs(line.end.y - line.start.y) / max(line.length, 1.0)
        off = _ASIDE + max(size[0] / 2.0 - _ASIDE, 0.0) * slope  # a wide text keeps off an oblique bond
        candidates = [Box(*line.point(share, aside), *size) for aside in (-off, off) for share in _NUMBER_PLACES]
        centre, half = _arrays(candidates)
        low, high = centre.min(axis=0) - half[0], centre.max(axis=0) + half[0]
        near = (np.minimum(starts, ends) < high).all(axis=-1) & (np.maximum(starts, ends) > low).all(axis=-1)
        on_words = (np.abs(words[0] - centre[:, None]) < words[1] + half[:, None]).all(axis=-1).sum(axis=1)
        on_ink = enters(starts[near], ends[near], centre[:, None], half[:, None]).sum(axis=1)
        others = placed[:k, :2], placed[:k, 2:]
        on_numbers = (np.abs(others[0] - centre[:, None]) < others[1] + half[:, None]).all(axis=-1).sum(axis=1)
        beside = 30 * (np.arange(len(candidates)) >= len(_NUMBER_PLACES))
        best = int(np.argmin(100 * on_words + 10 * on_numbers + on_ink + beside))
        boxed[number], placed[k] = candidates[best], (*centre[best], *half[best])
    return boxed
