"""Reduction to one coordinate: unit flow in, flow gain of every bond out, and from the gains I*, dI*/dphi and M*.

The junction structure is compiled once into a plan of local steps (`bondgraph.graph.plan`: scale by a constant, scale by a
modulus, sum at a 0-junction); where loops leave flows that no single step gives, one linear system A g = b per position
solves them, and A g' = b' - A' g their slopes. Running the plan costs a few array operations per transformer, for any
number of positions at once. Positions are counted: `counted` starts a tally of them, which costs nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from copy import copy
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import (
    OWN_DISPLACEMENT,
    SINGULAR,
    TIME,
    Displacement,
    Element,
    Function,
    GraphError,
    Here,
    Law,
    Modulus,
    Motion,
    refuse,
)
from bondgraph.graph import (
    BondGraph,
    Ratio,
    SolutionStep,
    as_graph,
    places,
    plan,
    relations,
    variables,
)
from bondgraph.numerics import count as count  # walks of graphs are counted by it

Positions = Mapping[str, Callable[[Any], Any]]
_Source = tuple[Element, int, float]  # with its flow variable, and the sign of its effort on the coordinate


class FlowRates(NamedTuple):
    """Flow gain g and slope dg/dphi of every flow variable; numbers where constant, arrays where not."""

    gain: list[Any]
    slope: list[Any]


class Reduced(NamedTuple):
    """The machine seen from its coordinate, at an array of positions (numbers where nothing varies).

    inertia I* = sum I g²; slope dI*/dphi = 2 sum I g g'; moment M* = sum e g without the unknown; per_unknown is the
    factor of the unknown in M*; exchanged is sum |e g|, the scale that a balance is judged by; resistance R* = sum R g²;
    steepness 2 sum |I g g'|, the scale that dI*/dphi is rounded at.
    """

    inertia: Any
    slope: Any
    moment: Any
    per_unknown: Any
    exchanged: Any
    resistance: Any
    steepness: Any = 0.0

    def __repr__(self) -> str:
        """The number of positions and the range of I*, instead of every array."""
        inertia = np.atleast_1d(np.asarray(self.inertia, dtype=float))
        ends = f"{inertia.min():.6g} to {inertia.max():.6g}" if inertia.size else "none"
        return f"Reduced({max(inertia.size, np.size(self.moment))} positions, I* {ends})"


class Reduction:
    """A graph compiled for one coordinate, the flow of a 1-junction.

    The velocity graph gives flows, not positions. Displacements that turn in a constant ratio to the coordinate follow
    from it; for any other that a law depends on, `positions` holds a function of the coordinate's own displacement, by
    the displacement's name (for a spring's own displacement, by the spring's).

    Laws that depend on speed or time are not part of M*: `at` gives them, for any speeds.

    >>> from bondgraph import I, Se
    >>> from bondgraph.graph import Builder
    >>> b = Builder()
    >>> b = b.one("crank", displacement="phi").one("wheel").transform("crank", "wheel", 3.0)
    >>> b = b.on("wheel", I("J", 2.0), Se("M", 5.0))
    >>> r = Reduction(b.build(), "crank")(0.0)
    >>> r.inertia, r.moment
    (18.0, 15.0)

    """

    def __init__(self, graph: BondGraph, coordinate: str, positions: Positions | None = None) -> None:
        self.graph = graph = as_graph(graph)
        refuse(
            f"{graph.where(name)} is switched: take one of its modes, mode(graph, {name}=True)" for name in graph.switched
        )
        self.coordinate = coordinate
        self.positions = positions or {}
        self._flow = variables(graph, "1")
        self.variable = {name: self._flow[graph.bond_of(name).number] for name in graph.elements}
        self._steps = _planned(graph, self._flow, coordinate)
        self.uniform = {self.variable[coordinate]: 1.0}  # flow variables in a constant ratio to the coordinate, with it
        for step in self._steps:
            terms = [(v, ratio) for v, ratio in step.terms or () if v in self.uniform and isinstance(ratio, (float, Real))]
            if step.terms is not None and len(terms) == len(step.terms):
                self.uniform[step.unknown[0]] = sum(ratio * self.uniform[v] for v, ratio in terms)
        self._include(graph.elements)

    def part(self, names: Container[str]) -> Reduction:
        """The same graph with some of its one-ports alone, by their names."""
        part = copy(self)
        part._include(names)
        return part

    def _include(self, names: Container[str]) -> None:
        """The one-ports that are summed."""
        graph = self.graph
        one_ports = [(e, self.variable[e.name]) for e in graph.elements.values() if e.name in names]
        self._inertias = [(e, graph.constant(e.name), f) for e, f in one_ports if e.kind == "I" and e.law]
        sources = [
            (e, f, graph.bond_of(e.name).sign(e.name) * -1.0) for e, f in one_ports if e.kind in ("Se", "C") and e.law
        ]
        moving = [isinstance(e.law, Law) and e.law.moving for e, _, _ in sources]
        self._sources = [source for source, moves in zip(sources, moving, strict=True) if not moves]
        self._moving = [source for source, moves in zip(sources, moving, strict=True) if moves]
        resistors = [(e, f) for e, f in one_ports if e.kind == "R" and e.law]
        for element, _ in resistors:
            if not graph.is_linear(element.name):
                raise GraphError(f"R:{element.name} follows a law of its own: simulate the whole graph")
        self._resistors = [(e, graph.constant(e.name), f) for e, f in resistors]
        self._rates_at_anchor: tuple[float, FlowRates] | None = None
        self._in_piece: tuple[float, list[_Source], list[_Source]] | None = None
        self._lumped: dict[int, float] = {}
        for _, inertia, flow in self._inertias:
            self._lumped[flow] = self._lumped.get(flow, 0.0) + inertia

    def __call__(self, phi: Any, anchor: Any = None, ns: Any = np) -> Reduced:
        """I*, dI*/dphi and M* at positions phi (rad, any shape); `anchor` is the middle of each one's smooth piece."""
        return Station(self, phi, anchor, ns).reduced

    @property
    def moving(self) -> tuple[str, ...]:
        """The names of the sources that depend on speed or time."""
        return tuple(element.name for element, _, _ in self._moving)

    def at(self, phi: Any, anchor: Any = None, ns: Any = np) -> Station:
        """The positions phi, from which moments that depend on speed or time follow for any speeds."""
        return Station(self, phi, anchor, ns)

    def flows(self, phi: Any, anchor: Any = None, ns: Any = np) -> FlowRates:
        """Flow gains and slopes alone."""
        return Station(self, phi, anchor, ns).flows

    def anchored(self, anchor: Any) -> FlowRates:
        """Flows at an anchor; those of the last single one are kept, because time stepping needs them repeatedly."""
        if not isinstance(anchor, float):
            return self.flows(anchor)
        if self._rates_at_anchor is None or self._rates_at_anchor[0] != anchor:
            self._rates_at_anchor = anchor, self.flows(anchor)
        return self._rates_at_anchor[1]

    def inertias(self, flows: FlowRates) -> dict[str, Any]:
        """Each inertia's share of I*, by the name of the part that it belongs to."""
        return _by_part((e, value * flows.gain[f] ** 2) for e, value, f in self._inertias)

    def moments(
        self,
        phi: Any,
        anchor: Any = None,
        unknown: float = 0.0,
        *,
        by_name: bool = False,
        speed: Any = None,
        time: Any = 0.0,
    ) -> dict[str, Any]:
        """Each source's share of M*, by the name of the part that it belongs to, or by its own.

        With a speed of the coordinate: also laws that depend on speed or time, and resistors, at that speed.
        """
        return self.at(phi, anchor).moments(unknown, by_name=by_name, speed=speed, time=time)

    def _acting(self, at: Station) -> tuple[list[_Source], list[_Source]]:
        """The sources to be summed, and those that depend on speed or time: in one piece alone only those that act there.

        Those of the last piece are kept, because time stepping needs them repeatedly.
        """
        if not isinstance(at.anchor, float):
            return self._sources, self._moving
        if self._in_piece is None or self._in_piece[0] != at.anchor:
            by_kind: list[list[_Source]] = [[], []]
            for kept, sources in zip(by_kind, (self._sources, self._moving), strict=True):
                for source in sources:
                    law = source[0].law
                    if not isinstance(law, Law) or law.acts is None or law.acts(at.both(law.motion)[1]):
                        kept.append(source)
            self._in_piece = at.anchor, by_kind[0], by_kind[1]
        return self._in_piece[1:]


def reduce(
    graph: BondGraph, phi: Any, coordinate: str = "crank", anchor: Any = None, *, positions: Positions | None = None
) -> Reduced:
    """I*, dI*/dphi and M* of a graph at positions phi of its coordinate; compile a `Reduction` to do it often.

    Raises:
        GraphError: if a ratio or an effort has no finite value, with the element and the position.

    >>> from bondgraph.graph import Builder
    >>> from bondgraph.elements import I
    >>> b = Builder().one("crank", displacement="phi").one("ram").on("ram", I("m", 4.0))
    >>> reduced = reduce(b.transform("crank", "ram", lambda phi: 0.5 * np.sin(phi)).build(), np.pi / 4)
    >>> round(reduced.inertia, 12), round(reduced.slope, 12)  # m (sin phi)²/4, and its slope
    (0.5, 1.0)

    """
    reduction, at = Reduction(graph, coordinate, positions), np.asarray(phi, float)[()]
    with np.errstate(all="ignore"):
        try:
            reduced = reduction(at, anchor)
        except ZeroDivisionError as error:  # of one position, in plain numbers
            raise GraphError(_endless(reduction, float(at))) from error
        endless = ~np.isfinite(sum(np.abs(np.broadcast_to(value, np.shape(at))) for value in reduced))
        if np.any(endless):
            raise GraphError(_endless(reduction, float(np.atleast_1d(at)[np.atleast_1d(endless)][0])))
    return reduced


def _endless(reduction: Reduction, phi: float) -> str:
    """A line that names the elements without a finite value at a position."""
    at, graph = Station(reduction, np.array([phi])), reduction.graph
    values = [(e, "ratio", at.ratio(e.law)) for e in graph.of_kind("TF")]  # type: ignore[arg-type]
    values += [(e, "ratio's slope", at.ratio_slope(e.law)) for e in graph.of_kind("TF")]  # type: ignore[arg-type]
    values += [(e, "effort", at.effort(e)) for e, _, _ in reduction._sources]
    faults = [
        f"the {what} of {graph.title(e.name)} is {np.ravel(v)[0]:g}" for e, what, v in values if not np.all(np.isfinite(v))
    ]
    reason = "; ".join(faults) or "its inertia or moment is beyond the largest number"
    return f"no reduction at {reduction.coordinate} = {phi:.9g}: {reason}"


_ZERO = 0.0  # the one object that marks a slope as identically zero, so that constant chains cost no array work


class Station:
    """Positions phi of a graph's coordinate: motions, moduli and flows there, each computed once, and what follows from it.

    Moments of sources that depend on speed or time are evaluated there as often as required.
    """

    def __init__(self, reduction: Reduction, phi: Any, anchor: Any = None, ns: Any = np) -> None:
        self.reduction, self.phi, self.anchor, self.ns = reduction, phi, phi if anchor is None else anchor, ns
        self._motions: dict[int, tuple[Here, Here]] = {}
        self._values: dict[int, Any] = {}
        self._moduli: dict[int, tuple[Any, tuple[Any, ...]]] = {}

    @cached_property
    def flows(self) -> FlowRates:
        """The flow rates, by a walk of the graph when they are first needed.

        Gains first, slopes after them: a modulus varies at the rate that its own displacement's gain gives.
        """
        reduction = self.reduction
        count(self.phi)
        size = max(reduction._flow.values()) + 1
        flows = self.flows = FlowRates([None] * size, [_ZERO] * size)  # slopes of ratios read the gains so far
        flows.gain[reduction.variable[reduction.coordinate]] = 1.0
        gain, slope = flows
        for step in reduction._steps:
            if step.terms is not None:
                added: Any = 0.0
                for v, ratio in step.terms:
                    added = added + self.ratio(ratio) * gain[v]
                gain[step.unknown[0]] = added
            else:
                solution = _linear(*_assembled(step, self, self.ratio, gain))
                for k, variable in enumerate(step.unknown):
                    gain[variable] = solution[..., k]
        for step in reduction._steps:
            if step.terms is not None:
                added = _ZERO
                for v, ratio in step.terms:
                    along, ratio_slope = slope[v], self.ratio_slope(ratio)
                    if along is not _ZERO:
                        added = added + self.ratio(ratio) * along
                    if ratio_slope is not _ZERO:
                        added = added + ratio_slope * gain[v]
                slope[step.unknown[0]] = added
            else:
                matrix, right = _assembled(step, self, self.ratio, slope)
                matrix_slope, right_slope = _assembled(step, self, self.ratio_slope, gain)
                gains = np.stack([np.broadcast_to(gain[variable], np.shape(self.phi)) for variable in step.unknown], axis=-1)
                solution = _linear(matrix, right + right_slope - (matrix_slope @ gains[..., None])[..., 0])
                for k, variable in enumerate(step.unknown):
                    slope[variable] = solution[..., k]
        return flows

    def of(self, part: Reduction) -> Station:
        """The same positions for a part of the graph (see `Reduction.part`): all parts share the flows."""
        station = Station(part, self.phi, self.anchor, self.ns)
        station._motions, station._values, station._moduli = self._motions, self._values, self._moduli
        station.flows = self.flows
        return station

    def gain(self, flow: int) -> Any:
        """The gain of a flow variable, without a walk where it is constant."""
        return self.reduction.uniform[flow] if flow in self.reduction.uniform else self.flows.gain[flow]

    def both(self, motion: Motion) -> tuple[Here, Here]:
        """The motion here and at the anchor."""
        pair = self._motions.get(id(motion))
        if pair is None:
            rate = self.rate(motion.of)
            q, q_anchor = rate * self.phi, rate * self.anchor
            here = Here(q, motion.position(q, self.ns, q_anchor), self.ns)
            anchor = Here(q_anchor, motion.position(q_anchor, self.ns, q_anchor), self.ns)
            pair = self._motions[id(motion)] = here, anchor
        return pair

    def rate(self, junction: str) -> float:
        """dq/dphi of the displacement of a 1-junction; it must be constant."""
        variable = self.reduction.variable[junction]
        if variable not in self.reduction.uniform:
            raise GraphError(f"1:{junction} does not turn in a constant ratio to the coordinate")
        return self.reduction.uniform[variable]

    def displacement(self, name: str, element: Element) -> Any:
        """The value of something that a law depends on, where the coordinate is at phi."""
        graph = self.reduction.graph
        if name in graph.parameters:
            return graph.parameter(name, element.name)
        if element.kind == "C" and name == OWN_DISPLACEMENT:
            return self._along(Displacement(element.name, element.name))
        if name in graph.displacements:
            return self._along(graph.displacements[name])
        what = "the time" if name == TIME else f"the signal {name!r}"
        raise GraphError(f"{element.symbol}:{element.name} depends on {what}: a graph of one position only can be reduced")

    def _along(self, displacement: Displacement) -> Any:
        reduction = self.reduction
        if displacement.name in reduction.positions:
            return reduction.positions[displacement.name](self.phi)
        variable = reduction.variable[displacement.of]
        if variable not in reduction.uniform:
            raise GraphError(
                f"the displacement {displacement.name!r} of {displacement.of!r} is in no constant ratio to the coordinate: "
                f"give positions={{{displacement.name!r}: function of its displacement}}"
            )
        own = reduction.graph.displacements.values()
        start = next((d.initial for d in own if d.of == reduction.coordinate), 0.0)
        return displacement.initial + reduction.uniform[variable] * (self.phi - start)

    def ratio(self, ratio: Ratio) -> Any:
        """The value of a transformer's ratio."""
        if isinstance(ratio, (float, Real)):
            return ratio
        if isinstance(ratio, Function):
            return self._partials(ratio)[0]
        if id(ratio) not in self._values:
            self._values[id(ratio)] = ratio.value(self.both(ratio.motion)[0].position)
        return self._values[id(ratio)]

    def ratio_slope(self, ratio: Ratio) -> Any:
        """The slope of a ratio: dT/dphi = sum of dT/dq times the gain of q's flow."""
        if isinstance(ratio, (float, Real)):
            return _ZERO
        if isinstance(ratio, Modulus):
            slope, rate = ratio.slope(self.both(ratio.motion)[0].position), self.rate(ratio.motion.of)
            return slope if rate == 1.0 else rate * slope
        graph, total = self.reduction.graph, _ZERO
        for name, partial in zip(ratio.of, self._partials(ratio)[1], strict=True):
            if name in graph.displacements:
                total = total + partial * self.flows.gain[self.reduction.variable[graph.displacements[name].of]]
        return total

    def _partials(self, ratio: Function) -> tuple[Any, tuple[Any, ...]]:
        if id(ratio) not in self._moduli:
            graph = self.reduction.graph
            element = next(e for e in graph.elements.values() if e.law is ratio)
            self._moduli[id(ratio)] = ratio.partials(*(self.displacement(name, element) for name in ratio.of))
        return self._moduli[id(ratio)]

    def effort(self, element: Element, unknown: float = 0.0) -> Any:
        """The effort of a source, or of a spring (e = q/C where its law is a number)."""
        law = element.law
        if isinstance(law, Law):
            here, anchor = self.both(law.motion)
            effort = law.effort(here, anchor)
            return effort + unknown * law.per_unknown(here, anchor) if law.per_unknown is not None else effort
        if element.kind == "C" and self.reduction.graph.is_linear(element.name):
            return self.displacement(OWN_DISPLACEMENT, element) / self.reduction.graph.constant(element.name)
        if isinstance(law, Function):
            return law(*(self.displacement(name, element) for name in law.of))
        return law

    @cached_property
    def _anchor_flows(self) -> FlowRates:
        return self.reduction.anchored(self.anchor)

    @cached_property
    def reduced(self) -> Reduced:
        """I*, its slope and M* at these positions."""
        flows, reduction = self.flows, self.reduction
        inertia: Any = 0.0
        slope: Any = 0.0
        steepness: Any = 0.0
        for flow, value in reduction._lumped.items():
            gain, gain_slope = flows.gain[flow], flows.slope[flow]
            momentum = value * gain
            inertia = inertia + momentum * gain
            if gain_slope is not _ZERO:
                steep = momentum * gain_slope
                slope, steepness = slope + steep, steepness + abs(steep)
        moment: Any = 0.0
        per_unknown: Any = 0.0
        exchanged: Any = 0.0
        for element, flow, sign in reduction._acting(self)[0]:
            gain = flows.gain[flow]
            contribution = sign * self.effort(element) * gain
            moment = moment + contribution
            exchanged = exchanged + abs(contribution)
            law = element.law
            if isinstance(law, Law) and law.per_unknown is not None:
                here, anchor = self.both(law.motion)
                per_unknown = per_unknown + sign * law.per_unknown(here, anchor) * gain
        resistance: Any = 0.0
        for _, value, flow in reduction._resistors:
            resistance = resistance + value * flows.gain[flow] ** 2
        return Reduced(inertia, slope + slope, moment, per_unknown, exchanged, resistance, steepness + steepness)

    def moments(self, unknown: float = 0.0, *, by_name: bool = False, speed: Any = None, time: Any = 0.0) -> dict[str, Any]:
        """The share of M* of each source, by its part, or by its own name: `Reduction.moments` at these positions."""
        gain, reduction = self.flows.gain, self.reduction
        efforts = [(e, sign * self.effort(e, unknown) * gain[f]) for e, f, sign in reduction._sources]
        if speed is not None:
            efforts += [(e, effort + unknown * factor) for e, effort, factor in self.contributions(speed, time)]
            efforts += [(e, -value * gain[f] ** 2 * speed) for e, value, f in reduction._resistors]
        return {e.name: effort for e, effort in efforts} if by_name else _by_part(efforts)

    def resistances(self) -> dict[str, Any]:
        """Each resistor's share of R*, by the part that it belongs to."""
        gain = self.flows.gain
        return _by_part((e, value * gain[f] ** 2) for e, value, f in self.reduction._resistors)

    def efforts(
        self, speed: Any, time: Any = 0.0, anchor_speed: Any = None, anchor_time: Any = None, unknown: float = 0.0
    ) -> dict[str, Any]:
        """The effort of every source with a law that acts there, by its own name, before it is reduced."""
        still = {e.name: sign * self.effort(e, unknown) for e, _, sign in self.reduction._acting(self)[0]}
        moving = zip(self.reduction._acting(self)[1], self.places(speed, time, anchor_speed, anchor_time), strict=True)
        for (element, _, sign), (_, here, anchor) in moving:
            law = element.law
            assert isinstance(law, Law)
            per_unknown = 0.0 if law.per_unknown is None else law.per_unknown(here, anchor)
            still[element.name] = sign * (law.effort(here, anchor) + unknown * per_unknown)
        return still

    def contributions(
        self, speed: Any, time: Any = 0.0, anchor_speed: Any = None, anchor_time: Any = None, *, local: bool = False
    ) -> list[tuple[Element, Any, Any]]:
        """Every such source with its share of M* at speeds of the coordinate, and its factor of the unknown.

        speed: arrays, or numbers of any kind that arrays multiply (jets, for slopes); `anchor_speed`, plain, and
        `anchor_time` are speed and time at the anchors, where switches are decided. Without an anchor speed, or with one
        for every position (`local`), switches that depend on speed are decided at the positions themselves.
        """
        rows = []
        places = self.places(speed, time, anchor_speed, anchor_time, local=local)
        for (_, law, _, sign, gain, *_), (element, here, anchor) in zip(self._moving, places, strict=True):
            gain = sign * gain
            per_unknown = 0.0 if law.per_unknown is None else law.per_unknown(here, anchor) * gain
            rows.append((element, law.effort(here, anchor) * gain, per_unknown))
        return rows

    def places(
        self, speed: Any, time: Any = 0.0, anchor_speed: Any = None, anchor_time: Any = None, *, local: bool = False
    ) -> list[tuple[Element, Here, Here]]:
        """The arguments of the law of every such source, here and at the anchors."""
        middle, angles = speed if anchor_speed is None else anchor_speed, []
        then = time if anchor_time is None else anchor_time
        for element, _, flow, _, gain, rate, here, anchor in self._moving:
            constant = local or anchor_speed is None or flow in self.reduction.uniform
            deciding = gain if constant else self._anchor_flows.gain[flow]
            here = here._replace(speed=rate * speed, flow=gain * speed, time=time)
            anchor = anchor._replace(speed=rate * middle, flow=deciding * middle, time=then)
            angles.append((element, here, anchor))
        return angles

    @cached_property
    def _moving(self) -> list[tuple[Element, Law, int, float, Any, float, Here, Here]]:
        """The sources that depend on speed or time and act there: law, flow variable, sign, gain, rate of q, arguments."""
        sources = []
        for element, flow, sign in self.reduction._acting(self)[1] if self.reduction._moving else ():
            law = element.law
            assert isinstance(law, Law)
            gain, rate = self.gain(flow), self.rate(law.motion.of)
            sources.append((element, law, flow, sign, gain, rate, *self.both(law.motion)))
        return sources


def _assembled(step: SolutionStep, at: Station, ratio_of: Callable[[Ratio], Any], values: list[Any]) -> tuple[Any, Any]:
    """A of the unknown and b = - sum over the known, with every ratio as `ratio_of` gives it; 1 counts as constant."""
    shape, size = np.shape(at.phi), len(step.unknown)
    matrix, right = np.zeros((*shape, size, size)), np.zeros((*shape, size))
    column = {variable: k for k, variable in enumerate(step.unknown)}
    for row, relation in enumerate(step.relations):
        for variable, ratio, sign in relation.terms:
            if variable in column:
                matrix[..., row, column[variable]] += sign * ratio_of(ratio)
            else:
                right[..., row] -= sign * ratio_of(ratio) * values[variable]
    return matrix, right


def _linear(matrix: Any, right: Any) -> Any:
    try:
        return np.linalg.solve(matrix, right[..., None])[..., 0]
    except np.linalg.LinAlgError as error:
        raise GraphError(SINGULAR) from error


def _by_part(items: Any) -> dict[str, Any]:
    parts: dict[str, Any] = {}
    for element, value in items:
        name = element.part or element.name
        parts[name] = parts[name] + value if name in parts else value
    return parts


def _planned(graph: BondGraph, flow: Mapping[int, int], coordinate: str) -> list[SolutionStep]:
    if coordinate not in graph.elements or graph.elements[coordinate].kind != "1":
        junctions = ", ".join(e.name for e in graph.of_kind("1"))
        raise GraphError(f"the coordinate {coordinate!r} is no 1-junction of the graph; its 1-junctions are {junctions}")
    grounded = [e.name for e in graph.of_kind("Sf") if e.law == 0.0]
    for element in graph.of_kind("GY", "Sf"):
        if element.name not in grounded:
            raise GraphError(f"{element.symbol}:{element.name} adds a state of its own: simulate the whole graph")
    flows = {flow[graph.at(coordinate)[0].number]}
    waiting = relations(graph, flow, "0")
    still = {flow[graph.bond_of(name).number] for name in grounded}
    steps = [SolutionStep((variable,), (), ()) for variable in sorted(still)]
    if flows & still:
        raise GraphError(f"the coordinate 1:{coordinate} is held at zero flow")
    flows |= still
    steps += plan(waiting, flows)
    unknown = tuple(sorted(set(flow.values()) - flows))
    if len(waiting) < len(unknown):
        bonds = [next(b for b in graph.bonds if flow[b.number] == v) for v in unknown]
        free = ", ".join(f"bond {b.number} ({b.tail} - {b.head})" for b in bonds)
        raise GraphError(f"more than one degree of freedom: nothing connects {free} with the coordinate")
    if len(waiting) > len(unknown):
        raise GraphError("over-constrained: too many relations at " + ", ".join(places(graph, waiting)))
    return [*steps, SolutionStep(unknown, tuple(waiting))] if unknown else steps
