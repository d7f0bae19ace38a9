"""Reduction to one coordinate: unit flow in, flow gain of every bond out, and from the gains I*, dI*/dphi and M*.

The junction structure is compiled once into a plan of local steps (scale by a constant, scale by a modulus, sum
at a 0-junction); where loops leave flows that no single step gives, one linear system A g = b per position solves them,
and A g' = b' - A' g their slopes. Running the plan costs a few array operations per transformer, for any number of
positions at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import Element, GraphError, Here, Law, Modulus, Motion
from bondgraph.graph import BondGraph


class _Scale(NamedTuple):
    source: int
    target: int
    ratio: float | Modulus


class _Sum(NamedTuple):
    target: int
    terms: tuple[tuple[int, float], ...]


class _Solve(NamedTuple):
    unknown: tuple[int, ...]
    equations: tuple[tuple[tuple[int, float | Modulus, float], ...], ...]


_Step = _Scale | _Sum | _Solve


class Flows(NamedTuple):
    """Flow gain g and slope dg/dphi of every flow variable; numbers where constant, arrays where not."""

    gain: list[Any]
    slope: list[Any]


class Reduced(NamedTuple):
    """The machine seen from its coordinate, at an array of positions (numbers where nothing varies).

    inertia I* = sum I g²; slope dI*/dphi = 2 sum I g g'; moment M* = sum e g without the unknown; per_unknown is the
    factor of the unknown in M*; exchanged is sum |e g|, the scale that a balance is judged by; resistance R* = sum R g².
    """

    inertia: Any
    slope: Any
    moment: Any
    per_unknown: Any
    exchanged: Any
    resistance: Any


class Reduction:
    """A graph compiled for one coordinate, the flow of a 1-junction.

    >>> from bondgraph import I, Se
    >>> from bondgraph.builder import Builder
    >>> b = Builder()
    >>> b = b.one("crank", displacement="phi").one("wheel").transform("crank", "wheel", 3.0)
    >>> b = b.on("wheel", I("J", 2.0), Se("M", 5.0))
    >>> r = Reduction(b.build(), "crank")(0.0)
    >>> r.inertia, r.moment
    (18.0, 15.0)
    """

    def __init__(self, graph: BondGraph, coordinate: str) -> None:
        self.graph = graph
        self.coordinate = coordinate
        self._flow = _flow_variables(graph)
        self.variable = {name: self._flow[_entry(graph, name)] for name in graph.elements}
        self._steps = _plan(graph, self._flow, coordinate)
        one_ports = [(e, self.variable[e.name]) for e in graph.elements.values()]
        self._inertias = [(e, f) for e, f in one_ports if e.kind == "I" and e.law]
        self._sources = [(e, f, _sign(graph, e)) for e, f in one_ports if e.kind in ("Se", "C") and e.law]
        self._resistors = [(e, f) for e, f in one_ports if e.kind == "R" and e.law]
        self._lumped: dict[int, float] = {}
        for element, flow in self._inertias:
            self._lumped[flow] = self._lumped.get(flow, 0.0) + element.law  # type: ignore[operator]

    def __call__(self, phi: Any, anchor: Any = None, ns: Any = np) -> Reduced:
        """I*, dI*/dphi and M* at positions phi (rad, any shape); `anchor` is the middle of each one's smooth piece."""
        at = _Positions(self, phi, phi if anchor is None else anchor, ns)
        flows = self._run(at)
        inertia: Any = 0.0
        slope: Any = 0.0
        for flow, value in self._lumped.items():
            gain, gain_slope = flows.gain[flow], flows.slope[flow]
            momentum = value * gain
            inertia = inertia + momentum * gain
            if gain_slope is not _ZERO:
                slope = slope + momentum * gain_slope
        moment, per_unknown, exchanged = self._moments(at, flows)
        resistance: Any = 0.0
        for element, flow in self._resistors:
            resistance = resistance + element.law * flows.gain[flow] ** 2
        return Reduced(inertia, slope + slope, moment, per_unknown, exchanged, resistance)

    def flows(self, phi: Any, anchor: Any = None, ns: Any = np) -> Flows:
        """Flow gains and slopes alone."""
        return self._run(_Positions(self, phi, phi if anchor is None else anchor, ns))

    def inertias(self, flows: Flows) -> dict[str, Any]:
        """What each inertia adds to I*, by the name of the part that it belongs to."""
        return _by_part((e, e.law * flows.gain[f] ** 2) for e, f in self._inertias)

    def moments(self, phi: Any, anchor: Any = None, unknown: float = 0.0, *, by_name: bool = False) -> dict[str, Any]:
        """What each source adds to M*, by the name of the part that it belongs to, or by its own."""
        at = _Positions(self, phi, phi if anchor is None else anchor, np)
        flows = self._run(at)
        efforts = [(e, sign * _effort(e.law, at, unknown) * flows.gain[f]) for e, f, sign in self._sources]
        return {e.name: effort for e, effort in efforts} if by_name else _by_part(efforts)

    def _moments(self, at: _Positions, flows: Flows) -> tuple[Any, Any, Any]:
        moment: Any = 0.0
        per_unknown: Any = 0.0
        exchanged: Any = 0.0
        for element, flow, sign in self._sources:
            gain = flows.gain[flow]
            contribution = sign * _effort(element.law, at) * gain
            moment = moment + contribution
            exchanged = exchanged + abs(contribution)
            law = element.law
            if isinstance(law, Law) and law.per_unknown is not None:
                here, anchor = at.both(law.motion)
                per_unknown = per_unknown + sign * law.per_unknown(here, anchor) * gain
        return moment, per_unknown, exchanged

    def _run(self, at: _Positions) -> Flows:
        count = max(self._flow.values()) + 1
        flows = at.flows = Flows([None] * count, [_ZERO] * count)
        flows.gain[self.variable[self.coordinate]] = 1.0
        for step in self._steps:
            _RUN[type(step)](step, flows, at)
        return flows


def reduce(graph: BondGraph, phi: Any, coordinate: str = "crank", anchor: Any = None) -> Reduced:
    """I*, dI*/dphi and M* of a graph at positions phi of its coordinate; compile a `Reduction` to do it often."""
    return Reduction(graph, coordinate)(phi, anchor)


_ZERO = 0.0  # the one object that marks a slope as identically zero, so that constant chains cost no array work


class _Positions:
    """The motions evaluated at phi and at the anchors, each once per walk."""

    def __init__(self, reduction: Reduction, phi: Any, anchor: Any, ns: Any) -> None:
        self.reduction, self.phi, self.anchor, self.ns = reduction, phi, anchor, ns
        self.flows = Flows([], [])
        self._cache: dict[int, tuple[Here, Here]] = {}

    def both(self, motion: Motion) -> tuple[Here, Here]:
        """The motion here and at the anchor."""
        found = self._cache.get(id(motion))
        if found is None:
            rate = self.rate(motion)
            q, q_anchor = rate * self.phi, rate * self.anchor
            here = Here(q, motion.position(q, self.ns, q_anchor), self.ns)
            anchor = Here(q_anchor, motion.position(q_anchor, self.ns, q_anchor), self.ns)
            found = self._cache[id(motion)] = here, anchor
        return found

    def rate(self, motion: Motion) -> float:
        """dq/dphi of the displacement that a motion depends on; it must be constant."""
        variable = self.reduction.variable[motion.of]
        if self.flows.slope[variable] is not _ZERO:
            raise GraphError(f"1:{motion.of} does not turn in a constant ratio to the coordinate")
        return float(self.flows.gain[variable])


def _ratio(ratio: float | Modulus, at: _Positions) -> tuple[Any, Any]:
    if not isinstance(ratio, Modulus):
        return ratio, _ZERO
    position = at.both(ratio.motion)[0].position
    rate = at.rate(ratio.motion)
    slope = ratio.slope(position)
    return ratio.value(position), slope if rate == 1.0 else rate * slope


def _scale(step: _Scale, flows: Flows, at: _Positions) -> None:
    ratio, ratio_slope = _ratio(step.ratio, at)
    gain, slope = flows.gain[step.source], flows.slope[step.source]
    flows.gain[step.target] = ratio * gain
    if slope is not _ZERO and ratio_slope is not _ZERO:
        flows.slope[step.target] = ratio * slope + ratio_slope * gain
    elif slope is not _ZERO:
        flows.slope[step.target] = ratio * slope
    elif ratio_slope is not _ZERO:
        flows.slope[step.target] = ratio_slope * gain


def _sum(step: _Sum, flows: Flows, at: _Positions) -> None:
    gain: Any = 0.0
    slope: Any = 0.0
    varies = False
    for source, sign in step.terms:
        gain = gain + sign * flows.gain[source]
        if flows.slope[source] is not _ZERO:
            varies = True
            slope = slope + sign * flows.slope[source]
    flows.gain[step.target] = gain
    if varies:
        flows.slope[step.target] = slope


def _solve(step: _Solve, flows: Flows, at: _Positions) -> None:
    shape, size = np.shape(at.phi), len(step.unknown)
    matrix = np.zeros((*shape, size, size))
    matrix_slope = np.zeros_like(matrix)
    right = np.zeros((*shape, size))
    right_slope = np.zeros_like(right)
    column = {variable: k for k, variable in enumerate(step.unknown)}
    for row, equation in enumerate(step.equations):
        for variable, ratio, sign in equation:
            value, slope = _ratio(ratio, at)
            if variable in column:
                matrix[..., row, column[variable]] += sign * value
                matrix_slope[..., row, column[variable]] += sign * slope
            else:
                gain, gain_slope = flows.gain[variable], flows.slope[variable]
                right[..., row] -= sign * value * gain
                right_slope[..., row] -= sign * (slope * gain + value * gain_slope)
    gains = _linear(matrix, right)
    slopes = _linear(matrix, right_slope - (matrix_slope @ gains[..., None])[..., 0])
    for variable, k in column.items():
        flows.gain[variable], flows.slope[variable] = gains[..., k], slopes[..., k]


def _linear(matrix: Any, right: Any) -> Any:
    try:
        return np.linalg.solve(matrix, right[..., None])[..., 0]
    except np.linalg.LinAlgError as error:
        raise GraphError("the constraints lock or branch at one of the positions: singular flow system") from error


_RUN: Mapping[type, Callable[[Any, Flows, _Positions], None]] = {_Scale: _scale, _Sum: _sum, _Solve: _solve}


def _effort(law: Any, at: _Positions, unknown: float = 0.0) -> Any:
    if not isinstance(law, Law):
        return law
    here, anchor = at.both(law.motion)
    effort = law.effort(here, anchor)
    if unknown and law.per_unknown is not None:
        effort = effort + unknown * law.per_unknown(here, anchor)
    return effort


def _by_part(items: Any) -> dict[str, Any]:
    parts: dict[str, Any] = {}
    for element, value in items:
        name = element.part or element.name
        parts[name] = parts[name] + value if name in parts else value
    return parts


def _sign(graph: BondGraph, element: Element) -> float:
    """+1 where the bond's half arrow leaves the element (it gives power), -1 where it enters."""
    return 1.0 if graph.at(element.name)[0].tail == element.name else -1.0


def _entry(graph: BondGraph, name: str) -> int:
    """The number of the bond that stands for an element's flow: for a two-port, of the one that enters it."""
    bonds = graph.at(name)
    return next((b.number for b in bonds if b.head == name), bonds[0].number)


def _flow_variables(graph: BondGraph) -> dict[int, int]:
    """Bond number -> flow variable: the bonds of a 1-junction share one."""
    variable = {bond.number: bond.number for bond in graph.bonds}
    for name, element in graph.elements.items():
        if element.kind == "1":
            shared = {variable[bond.number] for bond in graph.at(name)}
            merged = min(shared)
            variable = {number: merged if v in shared else v for number, v in variable.items()}
    order = {v: k for k, v in enumerate(sorted(set(variable.values())))}
    return {number: order[v] for number, v in variable.items()}


Relation = tuple[tuple[int, float | Modulus, float], ...]  # sum of sign * ratio * flow = 0


def _relations(graph: BondGraph, flow: Mapping[int, int]) -> list[tuple[str, Relation]]:
    relations: list[tuple[str, Relation]] = []
    for name, element in graph.elements.items():
        bonds = graph.at(name)
        if element.kind == "TF":
            into, out = sorted(bonds, key=lambda b: b.tail == name)
            relations.append((name, ((flow[out.number], 1.0, 1.0), (flow[into.number], _modulus(element), -1.0))))
        elif element.kind == "0":
            terms = tuple((flow[b.number], 1.0, 1.0 if b.head == name else -1.0) for b in bonds)
            relations.append((name, terms))
        elif element.kind in ("GY", "Sf"):
            raise GraphError(f"{element.symbol}:{name} adds a state of its own: simulate the graph whole")
    return relations


def _modulus(element: Element) -> float | Modulus:
    if isinstance(element.law, Law) or element.law is None:
        raise GraphError(f"TF:{element.name} has no ratio")
    return element.law


def _plan(graph: BondGraph, flow: Mapping[int, int], coordinate: str) -> list[_Step]:
    if coordinate not in graph.elements or graph.elements[coordinate].kind != "1":
        raise GraphError(f"the coordinate {coordinate!r} is no 1-junction of the graph")
    known = {flow[graph.at(coordinate)[0].number]}
    waiting = _relations(graph, flow)
    steps: list[_Step] = []
    while True:
        ready = next((item for item in waiting if _local(item[1], known) is not None), None)
        if ready is None:
            break
        waiting.remove(ready)
        step = _local(ready[1], known)
        assert step is not None
        steps.append(step)
        known.add(step.target)
    unknown = tuple(sorted(set(flow.values()) - known))
    if unknown or waiting:
        steps.append(_closed(graph, flow, waiting, unknown))
    return steps


def _local(relation: Relation, known: set[int]) -> _Scale | _Sum | None:
    """The step that gives a relation's one unknown flow, if it needs no division by a modulus."""
    unknown = [term for term in relation if term[0] not in known]
    if len(unknown) != 1 or isinstance(unknown[0][1], Modulus) or unknown[0][1] == 0.0:
        return None
    target, factor, sign = unknown[0]
    if len(relation) == 2 and not isinstance(factor, Modulus):
        source, ratio, other = next(term for term in relation if term[0] != target)
        scale = -other / (sign * factor)
        if isinstance(ratio, Modulus):
            return _Scale(source, target, ratio) if scale == 1.0 else None
        return _Scale(source, target, ratio * scale)
    return _Sum(target, tuple((v, -s / sign) for v, _, s in relation if v != target))


def _closed(
    graph: BondGraph, flow: Mapping[int, int], waiting: list[tuple[str, Relation]], unknown: tuple[int, ...]
) -> _Solve:
    names = {v: next(b for b in graph.bonds if flow[b.number] == v) for v in unknown}
    if len(waiting) < len(unknown):
        free = ", ".join(f"bond {b.number} ({b.tail} - {b.head})" for b in names.values())
        raise GraphError(f"more than one degree of freedom: nothing ties {free} to the coordinate")
    if len(waiting) > len(unknown):
        raise GraphError("over-constrained: too many relations at " + ", ".join(name for name, _ in waiting))
    return _Solve(unknown, tuple(relation for _, relation in waiting))
