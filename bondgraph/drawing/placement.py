"""Where the elements of a graph go: layers of a breadth-first walk to start from, then moves on a grid that lower a cost.

The cost adds up what makes a drawing hard to read: labels that overlap, bonds through labels, crossings, bonds too short
for their number, too long, oblique, or side by side. Every step is deterministic: the same graph, the same drawing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import ONE_PORTS, TWO_PORTS
from bondgraph.graph import Bond, BondGraph, reached_from

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

STEP = np.array([24.0, 24.0])  # points: the grid
SHORTEST = 32.0  # points of a bond to be seen between its labels
_MARGIN = 6.0  # points to keep free around labels
_STROKE, _FARTHEST = 6.0, 26.0  # points: half a causal stroke, and how far strokes move out where bonds crowd
_WINDOW, _SWEEPS = 5, 14
_OVERLAP, _THROUGH, _CROSSING, _CRAMPED, _NARROW, _BENT = 900.0, 700.0, 260.0, 5.0, 80.0, 40.0
_OBLIQUE, _UPWARD, _ONWARD = 55.0, 8.0, 40.0
_ROOM = (14.0, 20.0)  # points around the labels of the backbone while the one-ports are still to come
_PULL, _SHAKE = 1.3, 40.0  # times and points, where all is arranged once more
_NARROWEST = np.cos(np.radians(34.0))

_WAYS = [(-1, 0), (1, 0), (0, 1), (0, -1), (-1, -1), (1, -1), (-1, 1), (1, 1), (-2, 1), (2, 1), (-2, -1), (2, -1)]
_FAVOURITES = {"Se": (-1.0, 0.1), "Sf": (-1.0, 0.1), "I": (0.1, 1.0), "R": (0.1, -1.0), "C": (-0.1, -1.0)}


class Problem(NamedTuple):
    """A graph as arrays: half sizes of the labels, the two ends of each bond, pairs of bonds that share an element."""

    names: tuple[str, ...]
    half: Array
    ends: Indices
    pairs: Indices  # shared element, other end of one bond, other end of the other
    straight: Mask  # of the pairs: whether they meet at a two-port, where the way should go straight on
    taste: Array  # the direction that each bond would like to have; 0 where it does not mind
    clear: Array  # points from the middle of each element to where its bonds begin to be seen
    ports: tuple[tuple[int, ...], ...]  # the one-ports of each element
    branches: tuple[tuple[int, ...], ...]  # what hangs on the rest by one junction alone, led by its element next to it


def place(graph: BondGraph, half: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """The centre of every element, in points, given the half width and half height of its label.

    The backbone of junctions and two-ports comes first, with room to spare; then the one-ports join and all move.
    """
    backbone = [name for name in graph.elements if not _is_port(graph, name)]
    start = _start(_ordered(graph, _layers(graph)))
    roomy = {name: (half[name][0] + _ROOM[0], half[name][1] + _ROOM[1]) for name in backbone}
    at = _settled(_problem(graph, roomy), start)
    for name in backbone:
        _spread_ports(graph, name, at)
    return _settled(_problem(graph, half), at)


def rearranged(
    graph: BondGraph, half: Mapping[str, tuple[float, float]], at: Mapping[str, tuple[float, float]], attempt: int
) -> dict[str, tuple[float, float]]:
    """Other places for the same elements: pulled apart and shaken, another way at each attempt, then moved again."""
    pulled = {
        name: (_PULL * x + _SHAKE * np.sin(7.0 * k + attempt), _PULL * y + _SHAKE * np.sin(11.0 * k + attempt))
        for k, (name, (x, y)) in enumerate(at.items())
    }
    aligned = {name: tuple((np.round(np.array(place) / STEP) * STEP).tolist()) for name, place in pulled.items()}
    return _settled(_problem(graph, half), aligned)


def _settled(problem: Problem, start: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    at = np.array([start[name] for name in problem.names])
    for _ in range(_SWEEPS):
        if not _sweep(problem, at):
            break
    return {name: (float(x), float(y)) for name, (x, y) in zip(problem.names, at, strict=True)}


def _is_port(graph: BondGraph, name: str) -> bool:
    return graph.elements[name].kind in ONE_PORTS


def _problem(graph: BondGraph, half: Mapping[str, tuple[float, float]]) -> Problem:
    """The part of the graph whose half sizes are given."""
    index = {name: k for k, name in enumerate(half)}
    bonds = [bond for bond in graph.bonds if bond.tail in half and bond.head in half]
    near = [[index[bond.other(name)] for bond in graph.at(name) if bond.other(name) in half] for name in half]
    kinds = [graph.elements[name].kind for name in half]
    pairs = [(k, a, b) for k, others in enumerate(near) for n, a in enumerate(others) for b in others[:n] if a != b]
    layer = {name: k for k, names in enumerate(_layers(graph)) for name in names}
    return Problem(
        tuple(half),
        np.array(list(half.values())).reshape(-1, 2) + _MARGIN / 2.0,
        np.array([(index[b.tail], index[b.head]) for b in bonds], dtype=np.intp).reshape(-1, 2),
        np.array(pairs, dtype=np.intp).reshape(-1, 3),
        np.array([kinds[k] in TWO_PORTS for k, _, _ in pairs], dtype=np.bool_),
        np.array([_taste(graph, bond, layer) for bond in bonds]).reshape(-1, 2),
        np.array([min(_STROKE / np.tan(np.pi / max(len(others), 3)), _FARTHEST) for others in near]),
        tuple(tuple(n for n in others if kinds[n] in ONE_PORTS) for others in near),
        tuple(_branches(near)),
    )


def _taste(graph: BondGraph, bond: Bond, layer: Mapping[str, int]) -> tuple[float, float]:
    """Inertias up, resistors and springs down, as textbooks print them; what lies further on, to the right."""
    if bond.tail in layer and bond.head in layer:
        return _ONWARD * float(np.sign(layer[bond.head] - layer[bond.tail])), 0.0
    port, sign = (bond.tail, -1.0) if bond.tail not in layer else (bond.head, 1.0)
    return 0.0, sign * {"I": _UPWARD, "R": -_UPWARD, "C": -_UPWARD}.get(graph.elements[port].kind, 0.0)


def _branches(near: Sequence[Sequence[int]]) -> Iterator[tuple[int, ...]]:
    """The smaller parts that a graph falls into without one of its elements."""
    for joint, others in enumerate(near):
        apart = {k: [n for n in around if n != joint] for k, around in enumerate(near)}
        seen: set[int] = {joint}
        for lead in others:
            if lead not in seen:
                branch = reached_from(lead, apart)
                seen |= branch
                if 1 < len(branch) < len(near) / 2:
                    yield (lead, *sorted(branch - {lead}))


# -- the start: layers from left to right -------------------------------------------------------------------------------


def _start(layers: Sequence[Sequence[str]]) -> dict[str, tuple[float, float]]:
    across, up = 4.0 * STEP[0], 4.0 * STEP[1]
    return {
        name: (across * column, up * ((len(layer) - 1) // 2 - row))
        for column, layer in enumerate(layers)
        for row, name in enumerate(layer)
    }


def _spread_ports(graph: BondGraph, name: str, at: dict[str, tuple[float, float]]) -> None:
    """Put one-ports around their junction to start from: each in its favourite direction among those that are free."""
    here = np.array(at[name])
    taken = [np.array(at[bond.other(name)]) - here for bond in graph.at(name) if bond.other(name) in at]
    for port in (bond.other(name) for bond in graph.at(name) if _is_port(graph, bond.other(name))):
        wish = _FAVOURITES[graph.elements[port].kind]
        ways = [np.array(way) for way in sorted(_WAYS, key=lambda way: np.hypot(*np.subtract(way, wish)))]
        best = max(ways, key=lambda way: min((_apart(way * STEP, other) for other in taken), default=1.0))
        taken.append(best * STEP)
        at[port] = tuple((here + 3.0 * best * STEP).tolist())


def _apart(one: Array, two: Array) -> float:
    """How far two directions are apart, by the cosine; anything beyond about 80 degrees counts as far."""
    cosine = float(one @ two) / (float(np.hypot(*one) * np.hypot(*two)) + 1e-9)
    return min(1.0 - cosine, 0.8)


def _layers(graph: BondGraph) -> list[list[str]]:
    """Junctions and two-ports by their distance from the junction that was named first, branches kept together."""
    walk = _walk(graph)
    distance = {walk[0]: 0}
    reached = [walk[0]]
    for name in reached:
        fresh = [bond.other(name) for bond in graph.at(name) if bond.other(name) not in distance]
        fresh = [other for other in fresh if not _is_port(graph, other)]
        distance |= dict.fromkeys(fresh, distance[name] + 1)
        reached += dict.fromkeys(fresh)
    return [[name for name in walk if distance[name] == k] for k in range(max(distance.values()) + 1)]


def _walk(graph: BondGraph) -> list[str]:
    """Junctions and two-ports in the order of a depth-first walk."""
    todo = [name for name in graph.elements if not _is_port(graph, name)][:1]
    seen: dict[str, None] = {}
    while todo:
        name = todo.pop()
        if name not in seen:
            seen[name] = None
            todo += [b.other(name) for b in reversed(graph.at(name)) if not _is_port(graph, b.other(name))]
    return list(seen)


def _ordered(graph: BondGraph, layers: list[list[str]]) -> list[list[str]]:
    """Each layer sorted by the mean place of its neighbours, to and fro, to the order with the fewest crossings."""
    best, fewest = layers, _crossings(graph, layers)
    for sweep in range(12):
        layers = [list(layer) for layer in layers]
        order = range(1, len(layers)) if sweep % 2 == 0 else range(len(layers) - 2, -1, -1)
        for k in order:
            fixed = layers[k - 1] if sweep % 2 == 0 else layers[k + 1]
            layers[k] = _by_mean(graph, layers[k], fixed)
        layers = [_switched(graph, layers, k) for k in range(len(layers))]
        count = _crossings(graph, layers)
        if count < fewest:
            best, fewest = layers, count
    return best


def _by_mean(graph: BondGraph, layer: Sequence[str], fixed: Sequence[str]) -> list[str]:
    place = {name: k for k, name in enumerate(fixed)}

    def mean(name: str) -> float:
        places = [place[b.other(name)] for b in graph.at(name) if b.other(name) in place]
        return sum(places) / len(places) if places else float(layer.index(name))

    return sorted(layer, key=mean)


def _switched(graph: BondGraph, layers: list[list[str]], k: int) -> list[str]:
    """The layer with neighbours switched wherever that leaves fewer crossings."""
    layer = layers[k]
    for n in range(len(layer) - 1):
        other = [*layer[:n], layer[n + 1], layer[n], *layer[n + 2 :]]
        around = [*layers[max(k - 1, 0) : k], other, *layers[k + 1 : k + 2]]
        before = [*layers[max(k - 1, 0) : k], layer, *layers[k + 1 : k + 2]]
        if _crossings(graph, around) < _crossings(graph, before):
            layer = other
    return layer


def _crossings(graph: BondGraph, layers: Sequence[Sequence[str]]) -> int:
    count = 0
    for left, right in pairwise(layers):
        place = {name: k for k, name in enumerate(right)}
        ends = [(k, place[b.other(n)]) for k, n in enumerate(left) for b in graph.at(n) if b.other(n) in place]
        count += sum((a[0] - b[0]) * (a[1] - b[1]) < 0 for i, a in enumerate(ends) for b in ends[:i])
    return count


# -- the moves ----------------------------------------------------------------------------------------------------------


def _sweep(problem: Problem, at: Array) -> bool:
    """Move every element, or a junction with all its one-ports, to its cheapest place nearby; whether any moved."""
    moved = False
    for group in _groups(problem):
        candidates = _candidates(problem, at, group)
        costs = cost(problem, candidates, group)
        best = int(np.argmin(costs))
        if costs[best] < costs[0] - 1e-6:
            at[:] = candidates[best]
            moved = True
    return moved


def _groups(problem: Problem) -> Iterator[tuple[int, ...]]:
    """What moves together: each one-port, each other element, each junction with its one-ports, each branch."""
    ports = [port for own in problem.ports for port in own]
    yield from ((port,) for port in ports)
    for k, own in enumerate(problem.ports):
        if k not in ports:
            yield (k,)
        if own:
            yield (k, *own)
    yield from problem.branches


def _candidates(problem: Problem, at: Array, group: tuple[int, ...]) -> Array:
    """All positions with the group elsewhere: as it is, around its place, around the middle of its neighbours."""
    near = [b if a in group else a for a, b in problem.ends if (a in group) != (b in group)]
    lead = group[0]
    middle = np.round(at[near or [lead]].mean(axis=0) / STEP) * STEP
    targets = np.concatenate([[at[lead]], at[lead] + _grid(_WINDOW), middle + _grid(_WINDOW // 2)])
    moved = np.repeat(at[None], len(targets), axis=0)
    moved[:, list(group)] += (targets - at[lead])[:, None]
    return moved


def _grid(reach: int) -> Array:
    steps = np.arange(-reach, reach + 1)
    return np.asarray(np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * STEP)


def cost(problem: Problem, at: Array, group: Sequence[int]) -> Array:
    """What a drawing costs as far as a group of elements has a part in it, for each set of positions (k, n, 2)."""
    chosen = np.zeros(len(problem.names), dtype=bool)
    chosen[list(group)] = True
    touched: Mask = np.asarray(chosen[problem.ends].any(axis=1))
    return np.asarray(
        _OVERLAP * _overlaps(problem, at, chosen)
        + _THROUGH * _passes(problem, at, chosen, touched)
        + _CROSSING * _bond_crossings(problem, at, touched)
        + _bond_costs(problem, at, touched)
        + _angles(problem, at, chosen)
    )


def _overlaps(problem: Problem, at: Array, chosen: Mask) -> Array:
    gap = np.abs(at[:, chosen, None] - at[:, None]) - (problem.half[chosen, None] + problem.half[None])
    meet = (gap[..., 0] < 0) & (gap[..., 1] < 0)
    meet &= ~(np.flatnonzero(chosen)[:, None] == np.arange(len(chosen)))[None]
    return np.asarray(meet.sum(axis=(1, 2)), dtype=float)


def _passes(problem: Problem, at: Array, chosen: Mask, touched: Mask) -> Array:
    """How many bonds pass through labels of others."""
    count = np.zeros(len(at))
    for bonds, boxes in ((touched, np.ones_like(chosen)), (~touched, chosen)):
        ends, where = problem.ends[bonds], np.flatnonzero(boxes)
        hit = enters(at[:, ends[:, 0], None], at[:, ends[:, 1], None], at[:, None, where], problem.half[where])
        count += (hit & ~(ends[:, :, None] == where).any(axis=1)).sum(axis=(1, 2))
    return count


def enters(start: Array, end: Array, centre: Array, half: Array) -> Mask:
    """Whether segments pass through boxes, all arrays broadcast."""
    along = end - start
    along = np.where(np.abs(along) < 1e-9, 1e-9, along)
    one, two = (centre - half - start) / along, (centre + half - start) / along
    first, last = np.minimum(one, two), np.maximum(one, two)
    latest = np.maximum(np.maximum(first[..., 0], first[..., 1]), 0.0)
    return np.asarray(latest < np.minimum(np.minimum(last[..., 0], last[..., 1]), 1.0))


def _bond_crossings(problem: Problem, at: Array, touched: Mask) -> Array:
    ends = problem.ends
    apart = (ends[touched, None, :, None] != ends[None, :, None, :]).all(axis=(2, 3))
    once = np.where(touched[None, :], 0.5, 1.0) * apart
    a, b = at[:, ends[touched, 0], None], at[:, ends[touched, 1], None]
    c, d = at[:, None, ends[:, 0]], at[:, None, ends[:, 1]]
    across = (_cross(b - a, c - a) * _cross(b - a, d - a) < 0) & (_cross(d - c, a - c) * _cross(d - c, b - c) < 0)
    return np.asarray((across * once).sum(axis=(1, 2)))


def _cross(u: Array, v: Array) -> Array:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _bond_costs(problem: Problem, at: Array, touched: Mask) -> Array:
    """Length, shortness between the labels, slope, and each one-port's taste."""
    tail, head = problem.ends[touched].T
    along = at[:, head] - at[:, tail]
    length = np.hypot(along[..., 0], along[..., 1]) + 1e-9
    unit = along / length[..., None]
    covered = sum(
        np.maximum(np.min(problem.half[end] / (np.abs(unit) + 1e-9), axis=-1), problem.clear[end]) for end in (tail, head)
    )
    visible = length - covered
    cramped = np.maximum(SHORTEST - visible, 0.0)
    oblique = (2.0 * unit[..., 0] * unit[..., 1]) ** 2
    taste = -(unit * problem.taste[touched]).sum(axis=-1)
    return np.asarray((visible + _CRAMPED * cramped + _OBLIQUE * oblique + taste).sum(axis=1))


def _angles(problem: Problem, at: Array, chosen: Mask) -> Array:
    """Bends at two-ports, and how far the angles between bonds at one junction fall below the narrowest good one."""
    met = chosen[problem.pairs].any(axis=1)
    pairs = problem.pairs[met]
    one, two = (at[:, pairs[:, k]] - at[:, pairs[:, 0]] for k in (1, 2))
    lengths = np.hypot(one[..., 0], one[..., 1]) * np.hypot(two[..., 0], two[..., 1]) + 1e-9
    cosine = (one * two).sum(axis=-1) / lengths
    narrow = _NARROW * np.maximum(cosine - _NARROWEST, 0.0) / (1.0 - _NARROWEST)
    return np.asarray(np.where(problem.straight[met], _BENT * (1.0 + cosine), narrow).sum(axis=1))
