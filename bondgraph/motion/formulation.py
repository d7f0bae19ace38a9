"""Which flows of a graph are independent, and every other flow as a sum of gains times these.

A graph of inertias, springs, resistors, sources, transformers and gyrators is written in its independent flows u:

    f = G(q, t) u,   sum over the ports of G^T e = 0,   e = d(I f)/dt for an inertia,

so that an inertia whose flow depends on others (derivative causality, through a modulated transformer too) is folded in
by its gain: M u' + ... = Q with M = G^T I G. No step divides by a modulus. Gyrators tie efforts to flows and stay out of
G: they act as a pair of ports. Flows that no inertia weighs follow from an algebraic equation, flows that a source
imposes are given.

Independent flows are taken in layers: first those that inertias alone see, then those that resistors and gyrators see,
last those that only springs see. So a layer's flows leave the layers before it alone: the mass matrix is regular, and what
springs alone hold is told apart from what a resistor holds too. `Layers` answers this linear question in numbers, once for a
graph; moduli that vary count as numbers in no relation to each other: where they vanish or agree is a matter of single
positions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import ONE_PORTS, Displacement, Element
from bondgraph.graph import (
    BondGraph,
    Ratio,
    Relation,
    Scale,
    Solve,
    Step,
    Sum,
    entry,
    flow_relations,
    flow_variables,
    places,
    plan,
)
from bondgraph.laws import GraphError

Array = NDArray[np.float64]

INERTIAS, RESISTORS, SPRINGS = range(3)
_SEEN_BY = ({"Sf", "I"}, {"Sf", "I", "R", "GY"}, {"Sf", "I", "R", "GY", "C"})
_SAME = 1e-9
_NOTHING = 1e-12


class Layers:
    """The layers of a graph's flow variables.

    Attributes:
        of: by flow variable, the first layer whose elements' flows leave it no freedom; 3 where no layer's do.

    """

    def __init__(self, graph: BondGraph, flow: Mapping[int, int]) -> None:
        self.graph, self.flow = graph, flow
        numbers: dict[int, float] = {}
        relations = flow_relations(graph, flow)
        matrix = np.zeros((len(relations), len(set(flow.values()))))
        for row, relation in enumerate(relations):
            for variable, ratio, sign in relation.terms:
                if isinstance(ratio, float | int) and ratio:  # 0 says what a modulus says where it vanishes
                    matrix[row, variable] += sign * float(ratio)
                else:
                    matrix[row, variable] += sign * numbers.setdefault(id(ratio), _arbitrary(len(numbers)))
        self._basis = _unit(_complement(_unit(matrix)))  # of the flows that satisfy all relations, a row for each variable
        self.of = [len(_SEEN_BY)] * len(self._basis)
        for layer in (SPRINGS, RESISTORS, INERTIAS):
            seen = [e for e in graph.of_kind(*_SEEN_BY[layer]) if e.kind == "Sf" or e.law != 0.0]
            rows = _span(self._basis[[flow[b.number] for e in seen for b in graph.at(e.name)]])
            left = np.linalg.norm(self._basis - self._basis @ rows.T @ rows, axis=1)
            for settled in np.flatnonzero(left <= _SAME):
                self.of[settled] = layer
        for still in self.locked():
            self.of[still] = len(_SEEN_BY)

    def locked(self) -> list[int]:
        """The flow variables that the relations leave nothing but zero."""
        return [int(v) for v in np.flatnonzero(np.linalg.norm(self._basis, axis=1) <= _NOTHING)]

    def unsettled(self, coordinates: Sequence[int], resisted: Sequence[int]) -> list[int] | None:
        """Those of the resisted coordinates that resistors and gyrators do not settle: the slopes of their equations vanish.

        None where the coordinates do not settle the other flows.
        """
        columns = [coordinates.index(v) for v in resisted]
        chosen = self._basis[list(coordinates)]
        if len(_span(chosen)) < self._basis.shape[1]:
            return None
        every = np.linalg.solve(chosen.T, self._basis.T).T
        gains = _unit(np.where(np.abs(every) > _SAME * np.linalg.norm(every, axis=1)[:, None], every, 0.0)[:, columns])
        slopes = np.zeros((len(columns), len(columns)))
        for element in self.graph.of_kind("R"):
            gain = gains[self.flow[self.graph.bond_of(element.name).number]]
            slopes += np.outer(gain, gain) * (element.law != 0.0)
        for k, element in enumerate(self.graph.of_kind("GY")):
            into, out = (gains[self.flow[bond.number]] for bond in self.graph.ends(element.name))
            slopes += _arbitrary(k) * (np.outer(into, out) - np.outer(out, into)) * (element.law != 0.0)
        loose = np.abs(_complement(slopes)).max(axis=1, initial=0.0)
        return [v for v, share in zip(resisted, loose, strict=True) if share > _SAME]


def _arbitrary(k: int) -> float:
    """Numbers in no relation to each other."""
    return math.sqrt(2.3 + k)


def _unit(rows: Array) -> Array:
    """Rows divided by their lengths, so that small ratios count; what is nothing but rounding, as zero."""
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(np.where(lengths > _NOTHING, rows / np.where(lengths > _NOTHING, lengths, 1.0), 0.0))


def _span(rows: Array) -> Array:
    """An orthonormal basis, by rows, of what rows span."""
    _, sizes, basis = np.linalg.svd(rows)
    return np.asarray(basis[: _rank(sizes)])


def _complement(rows: Array) -> Array:
    """An orthonormal basis, by columns, of what is at right angles to all rows."""
    _, sizes, basis = np.linalg.svd(rows)
    return np.asarray(basis[_rank(sizes) :].T)


def _rank(sizes: Array) -> int:
    return int(np.sum(sizes > _SAME * sizes.max(initial=0.0)))


class Port(NamedTuple):
    """A bond through which an element takes power from the junction structure (sign +1) or gives it (-1)."""

    element: Element
    bond: int
    variable: int
    sign: float


class Coordinates(NamedTuple):
    """Independent flow variables: weighed by inertia, without any, and imposed by the flow sources of the same order."""

    moving: tuple[int, ...]
    massless: tuple[int, ...]
    imposed: tuple[int, ...]

    @property
    def all(self) -> tuple[int, ...]:
        """All of them, in this order."""
        return self.moving + self.massless + self.imposed


class Formulation:
    """A graph in its independent flows.

    Attributes:
        graph: the graph.
        flow: bond number -> flow variable.
        coordinates: the independent flow variables.
        steps: how the other flow variables follow, in order.
        support: flow variable -> positions in `coordinates.all` that it depends on.
        ports: every one-port's bond, and both bonds of every gyrator.
        displacements: the declared ones, and one for each further 1-junction that a motion refers to.

    """

    def __init__(self, graph: BondGraph) -> None:
        self.graph = graph
        self.flow = flow_variables(graph)
        self.displacements = tuple(displacements(graph))
        self._layers = Layers(graph, self.flow)
        self._check_free()
        chosen, self.steps = self._chosen()
        self.coordinates = self._sorted(chosen)
        self._check_held()
        self.support = self._supports(self.coordinates.all)
        bonds = [(e, graph.bond_of(e.name)) for e in graph.of_kind(*ONE_PORTS)]
        bonds += [(e, bond) for e in graph.of_kind("GY") for bond in graph.ends(e.name)]
        self.ports = tuple(Port(e, b.number, self.flow[b.number], b.sign(e.name)) for e, b in bonds)

    @property
    def massless(self) -> range:
        """The places in `coordinates.all` of the flows that no inertia weighs."""
        first = len(self.coordinates.moving)
        return range(first, first + len(self.coordinates.massless))

    @property
    def static(self) -> frozenset[int]:
        """The places in `coordinates.all` of the flows that springs alone hold."""
        return frozenset(k for k in self.massless if self._layers.of[self.coordinates.all[k]] == SPRINGS)

    def variable(self, name: str) -> int:
        """The flow variable of an element: of a two-port, that of the bond that enters it."""
        return self.flow[entry(self.graph, name).number]

    def name_of(self, variable: int) -> str:
        """How a flow variable is called: by its 1-junction, else by its bond."""
        bond = next(b for b in self.graph.bonds if self.flow[b.number] == variable)
        junctions = [n for n in (bond.tail, bond.head) if self.graph.elements[n].kind == "1"]
        return junctions[0] if junctions else f"bond {bond.number}"

    def _chosen(self) -> tuple[tuple[int, ...], list[Step]]:
        graph = self.graph
        waiting = flow_relations(graph, self.flow)
        chosen = [self.flow[graph.bond_of(source.name).number] for source in graph.of_kind("Sf")]
        known = set(chosen)
        steps = plan(waiting, known)
        while unknown := set(self.flow.values()) - known:
            step = None
            for group, relations in _groups(unknown, waiting):
                if len(relations) > len(group):
                    raise GraphError(_contradiction(graph, relations))
                if len(relations) == len(group):
                    step = Solve(tuple(sorted(group)), tuple(relations))
                    break
            if step is not None:
                steps.append(step)
                known.update(step.unknown)
                for relation in step.relations:
                    waiting.remove(relation)
            else:
                chosen.append(min(unknown, key=lambda v: self._rank(v, unknown)))
                known.add(chosen[-1])
            steps += plan(waiting, known)
        if waiting:
            raise GraphError(_contradiction(graph, waiting))
        return tuple(chosen), steps

    def _rank(self, variable: int, unknown: set[int]) -> tuple[int, bool, int, bool, int]:
        """Lowest is chosen: by layer, none behind a modulus (it may vanish), then owners of displacements, then inertias."""
        graph, behind, owner, weighed = self.graph, False, len(self.displacements), False
        for element in graph.of_kind("TF"):
            into, out = graph.ends(element.name)
            varies = not graph.is_linear(element.name)
            behind |= varies and self.flow[out.number] == variable and self.flow[into.number] in unknown
        for k, displacement in enumerate(self.displacements):
            if self.variable(displacement.of) == variable:
                owner = min(owner, k)
        for element in graph.of_kind("I"):
            weighed |= self.flow[graph.bond_of(element.name).number] == variable and element.law != 0.0
        return self._layers.of[variable], behind, owner, not weighed, variable

    def _supports(self, chosen: tuple[int, ...]) -> dict[int, tuple[int, ...]]:
        support: dict[int, tuple[int, ...]] = {variable: (k,) for k, variable in enumerate(chosen)}
        for step in self.steps:
            if isinstance(step, Scale):
                support[step.target] = support[step.source]
            elif isinstance(step, Sum):
                support[step.target] = tuple(sorted({k for source, _ in step.terms for k in support[source]}))
            else:
                sources = [v for relation in step.relations for v, _, _ in relation.terms if v in support]
                support |= dict.fromkeys(step.unknown, tuple(sorted({k for v in sources for k in support[v]})))
        return support

    def _sorted(self, chosen: tuple[int, ...]) -> Coordinates:
        count = len(self.graph.of_kind("Sf"))
        imposed, free = chosen[:count], chosen[count:]
        for variable in free:
            if self._layers.of[variable] > SPRINGS:
                where = self.name_of(variable)
                sources = ", ".join(self.graph.where(e.name) for e in self.graph.of_kind("Se")) or "no source"
                raise GraphError(
                    f"nothing holds the flow of {where}: it meets no inertia, resistor, spring or gyrator, only {sources}"
                )
        moving = tuple(v for v in free if self._layers.of[v] == INERTIAS)
        massless = sorted((v for v in free if v not in moving), key=lambda v: self._layers.of[v])
        return Coordinates(moving, tuple(massless), imposed)

    def _check_free(self) -> None:
        """Whether any flow can only be zero."""
        locked = self._layers.locked()
        meant = [self.variable(d.of) for d in self.displacements]  # no current in a ground node's lead is no contradiction
        meant += [self.flow[self.graph.bond_of(e.name).number] for e in self.graph.of_kind("I") if e.law != 0.0]
        if any(variable in locked for variable in meant):
            relations = [r for r in flow_relations(self.graph, self.flow) if all(v in locked for v, _, _ in r.terms)]
            at = ", ".join(places(self.graph, relations))
            raise GraphError(
                f"over-constrained: {at} contradict each other and lock {', '.join(map(self.name_of, locked))}, whose flow "
                "can only be zero: take one of them out, or change a ratio"
            )

    def _check_held(self) -> None:
        """Whether resistors and gyrators settle the flows that no inertia weighs."""
        resisted = [self.coordinates.all[k] for k in self.massless if k not in self.static]
        loose = self._layers.unsettled(self.coordinates.all, resisted)
        if loose is None:
            raise GraphError(
                _contradiction(self.graph, [r for s in self.steps if isinstance(s, Solve) for r in s.relations])
            )
        if loose:
            where = ", ".join(self.name_of(v) for v in loose)
            gyrators = " and ".join(self.graph.where(e.name) for e in self.graph.of_kind("GY"))
            raise GraphError(
                f"the flow of {where} is tied through {gyrators} to a store or source on the other side, without an inertia "
                f"or a resistor of its own: hang an I or R, a small one will do, where {where} is"
            )


def ratios(step: Step) -> Iterator[Ratio]:
    """The ratios that a step uses."""
    if isinstance(step, Scale):
        yield step.ratio
    elif isinstance(step, Solve):
        yield from (ratio for relation in step.relations for _, ratio, _ in relation.terms)


def displacements(graph: BondGraph) -> Iterator[Displacement]:
    """The declared displacements, and one for each further 1-junction that a motion refers to."""
    yield from graph.displacements.values()
    declared = {d.of for d in graph.displacements.values()}
    for junction in graph.motions:
        if junction not in declared:
            yield Displacement(junction, junction)


def _groups(unknown: set[int], waiting: list[Relation]) -> Iterator[tuple[set[int], list[Relation]]]:
    """Unknown variables that hang together through relations, with these relations."""
    left = set(unknown)
    while left:
        group, relations = {left.pop()}, []
        pending = [r for r in waiting if any(v in unknown for v, _, _ in r.terms)]
        grown = True
        while grown:
            touching = [r for r in pending if any(v in group for v, _, _ in r.terms)]
            pending = [r for r in pending if r not in touching]
            relations += touching
            grown = bool(touching)
            group |= {v for r in touching for v, _, _ in r.terms if v in unknown}
        left -= group
        yield group, relations


def _contradiction(graph: BondGraph, relations: list[Relation]) -> str:
    sources = "".join(f", {graph.where(e.name)}" for e in graph.of_kind("Sf"))
    return (
        f"over-constrained: {', '.join(places(graph, relations))} ask of the same flows what other transformers, junctions "
        f"or flow sources{sources} already settle; they contradict or repeat each other: take one of them out"
    )
