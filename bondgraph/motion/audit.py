"""The power audit of a motion: a check by the elements' laws alone, without the equations of the motion.

Every junction and two-port must transmit exactly the power that it receives, every one-port must exchange power by its own
law, and the energy must add up over the run: stored - stored at the start + dissipated - supplied.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import JUNCTIONS, ONE_PORTS, SOURCES, TIME, TWO_PORTS, Element, Function, Here, Law, Modulus
from bondgraph.graph import BondGraph
from bondgraph.motion.dynamics import Dynamics, GraphInstant, by_rows
from bondgraph.motion.stepping import Step
from bondgraph.numerics import Array, Indices

_NO_POWER = 1e-60  # W: less than this is the remains of an iteration towards zero
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)


class Audit(NamedTuple):
    """Results of the audit.

    power: the greatest power that a junction or two-port does not pass on, over the greatest power of any bond in the run.
    power_at: the element where that happens. energy: the greatest |stored - stored at the start + dissipated - supplied|,
    over the greatest of the energies in the run. stored, dissipated, supplied (J) at the times of the steps, the last two
    since the start.
    """

    power: float
    power_at: str
    energy: float
    stored: Array
    dissipated: Array
    supplied: Array

    def __repr__(self) -> str:
        """Three lines: power, energy, and the course of the energy in the run."""
        gained = self.stored[-1] - self.stored[0]
        return (
            f"power: {self.power:.2g} of the greatest is not accounted for, at {self.power_at or 'no bond'}\n"
            f"energy: {self.energy:.2g} of the greatest is missing\n"
            f"supplied {self.supplied[-1] + 0.0:.6g} J, stored {gained:.6g} J more, dissipated {self.dissipated[-1]:.6g} J"
        )


class Auditor:
    """Flows and efforts at times (n,), and what the elements' laws require of them, without the equations of motion."""

    def __init__(
        self, dynamics: Dynamics, graph: BondGraph, times: Array, states: Mapping[str, Array], anchors: Any, at: GraphInstant
    ) -> None:
        self.graph, self.times, self.shape, self.state, self.anchors = graph, times, times.shape, states, anchors
        self.displacement_of = dynamics.displacement_of
        self.flows = {number: filled(value, self.shape) for number, value in at.flows.items()}
        self.efforts = {number: filled(value, self.shape) for number, value in at.efforts.items()}
        self.places: dict[str, Any] = {}  # what laws read; declared names go before flows and efforts that are called so
        for letter, values in (("f", self.flows), ("e", self.efforts)):
            self.places |= {f"{letter}_{name}": values[graph.at(name)[0].number] for name in graph.elements}
        self.places |= {TIME: times, **states}
        self.places |= {name: signal(*[times] * len(signal.of)) for name, signal in dynamics.signals.items()}

    def law(self, name: str, own: Any = None) -> Array:
        """The value of an element's law, from its own quantity if it depends on that."""
        law, named = self.graph.elements[name].law, self.graph.own(name)
        if not isinstance(law, Function):
            return filled(self._motion(name, law) if isinstance(law, Law | Modulus) else law, self.shape)
        arguments = []
        for of in law.of:
            parameter = of in self.graph.parameters and of != named
            value = own if of == named else self.graph.parameter(of, name) if parameter else self.places[of]
            arguments.append(filled(value, self.shape))
        return filled(by_rows(law, arguments), self.shape)

    def _motion(self, name: str, law: Law | Modulus) -> Array:
        """A law or modulus of a motion, position by position."""
        q = self.state[self.displacement_of[law.motion.of]]
        anchors = filled(self.anchors.get(law.motion.of, q), self.shape)
        speed = self.flows[self.graph.bond_of(law.motion.of).number]
        own = self.flows[self.graph.bond_of(name).number]

        def at(q: Any, anchor: Any, speed: Any, flow: Any, t: Any) -> Any:
            here, there = (Here(x, law.motion.position(x, np, anchor), np, speed, flow, t) for x in (q, anchor))
            return law.value(here.position) if isinstance(law, Modulus) else law.effort(here, there)

        return filled(by_rows(at, [q, anchors, speed, own, self.times]), self.shape)

    def wrong_power(self, element: Element) -> Array:
        """The power of an element that its law does not explain; of a junction or two-port, the power not passed on."""
        name, e, f = element.name, self.efforts, self.flows
        if element.kind in JUNCTIONS:
            bonds, (common, summed) = self.graph.at(name), (f, e) if element.kind == "1" else (e, f)
            shared = common[bonds[0].number]
            net = sum((b.sign(name) * summed[b.number] for b in bonds), start=np.zeros(self.shape)) * shared
            return np.asarray(
                np.max(np.abs([net, *((common[b.number] - shared) * summed[b.number] for b in bonds)]), axis=0)
            )
        if element.kind in TWO_PORTS:
            (i, o), ratio = (b.number for b in self.graph.ends(name)), self.law(name)
            if element.kind == "TF":
                amiss = [(f[o] - ratio * f[i]) * e[o], (e[i] - ratio * e[o]) * f[i]]
            else:
                amiss = [(e[o] - ratio * f[i]) * f[o], (e[i] - ratio * f[o]) * f[i]]
            return np.asarray(np.max(np.abs(amiss), axis=0))
        bond = self.graph.bond_of(name)
        effort, flow, into = self.efforts[bond.number], self.flows[bond.number], bond.sign(name)
        if element.kind in SOURCES:
            return (self.law(name) - (effort if element.kind == "Se" else flow)) * (flow if element.kind == "Se" else effort)
        if element.kind == "R":
            if self.graph.own(name) == "e":
                return (self.law(name, effort) - into * flow) * effort
            value = self.law(name, into * flow)
            return ((value if self.graph.is_curve(name) else value * into * flow) - effort) * flow
        stored = self.state.get(f"{'p' if element.kind == 'I' else 'q'}_{name}")
        if stored is None or any(not {f"p_{n}", f"q_{n}"}.intersection(self.state) for n in self.graph.coupled(name)):
            return np.zeros(self.shape)  # a follower, or one of its field: the energy over the run tells
        value = stored / self.graph.constant(name) if self.graph.is_linear(name) else self.law(name, stored)
        return (value - into * flow) * effort if element.kind == "I" else (value - effort) * flow

    def flow(self, name: str) -> Array:
        """The flow into a one-port."""
        bond = self.graph.bond_of(name)
        return bond.sign(name) * self.flows[bond.number]

    def power(self, name: str) -> Array:
        """The power into a one-port."""
        return self.efforts[self.graph.bond_of(name).number] * self.flow(name)


def audit(stretches: Sequence[Step], looked_at: Callable[[Array, Indices], Auditor], impacts: Sequence[int] = ()) -> Audit:
    """Audit a run, from five points in each of its steps; `looked_at(times, owner)` gives the motion there.

    Energy that linear stores lose where one of the stretches `impacts` begins counts as dissipated. Bonds of heat carry no
    power, and are left out.
    """
    starts = np.array([s.start for s in stretches])
    widths = np.array([s.end - s.start for s in stretches])
    times = (starts[:, None] + 0.5 * widths[:, None] * (1.0 + _POINTS)).ravel()
    inside = looked_at(times, np.repeat(np.arange(len(stretches)), _POINTS.size))
    graph = inside.graph
    real = {n for b in graph.bonds if b.number not in graph.pseudo for n in b[1:]}
    power = {e.name: inside.power(e.name) for e in graph.of_kind(*ONE_PORTS) if e.name in real}

    def since_start(names: Sequence[str]) -> Array:
        total = sum((power[name] for name in names), start=np.zeros(times.size))
        by_step = 0.5 * widths * (total.reshape(-1, _POINTS.size) @ _WEIGHTS)
        return np.concatenate(([0.0], np.cumsum(by_step)))

    def of(*kinds: str) -> list[str]:
        return [e.name for e in graph.of_kind(*kinds) if e.name in real]

    edges = np.append(starts, stretches[-1].end)
    owners = np.append(np.arange(len(stretches)), len(stretches) - 1)
    ends = looked_at(edges, owners)
    kept = [name for name in of("I", "C") if graph.is_linear(name)]
    linear = sum((_energy(ends, name) for name in kept), start=np.zeros(edges.shape))
    stored = linear + since_start([name for name in of("I", "C") if name not in kept])
    imbalances = {n: float(np.abs(inside.wrong_power(e)).max()) for n, e in graph.elements.items() if n in real}
    where = max(imbalances, key=lambda name: imbalances[name], default="")
    largest = [
        {n: float(np.abs(value).max()) for n, value in of.items() if n not in graph.pseudo}
        for of in (inside.efforts, inside.flows)
    ]
    greatest = max((float(np.abs(inside.efforts[n] * inside.flows[n]).max()) for n in largest[0]), default=0.0)
    usual = max(largest[0].values(), default=0.0) * max(largest[1].values(), default=0.0)
    usual = max(float(np.abs(stored).max()) / stretches[-1].end, usual)
    nothing = greatest <= max(_NO_POWER, 1e-13 * usual)  # flows but the rounding of the usual power
    worst = 0.0 if nothing else imbalances[where] / greatest
    dissipated, supplied = since_start(of("R")), -since_start(of("Se", "Sf"))
    if impacts:
        at = np.array(impacts)
        before = looked_at(edges[at], at - 1)
        for k, lost in zip(
            impacts, sum((_energy(before, name) for name in kept), start=np.zeros(at.size)) - linear[at], strict=True
        ):
            dissipated[k:] += lost
    residual = np.abs(stored - stored[0] + dissipated - supplied).max()
    passed = [stored, dissipated, supplied, since_start(of("I")), since_start(of("C"))]
    scale = max(float(np.abs(energy).max()) for energy in passed)
    return Audit(worst, where, float(residual / scale) if scale > _NO_POWER else 0.0, stored, dissipated, supplied)


def _energy(at: Auditor, name: str) -> Array:
    """The energy in a linear store: from its state where it has one of its own, else from what it follows."""
    element, bond, constant = at.graph.elements[name], at.graph.bond_of(name).number, at.graph.constant(name)
    stored = at.state.get(f"{'p' if element.kind == 'I' else 'q'}_{name}")
    if stored is None:
        stored = constant * (at.flows if element.kind == "I" else at.efforts)[bond]
    return np.asarray(0.5 * stored**2 / constant) if constant else np.zeros(at.shape)


def filled(value: Any, shape: tuple[int, ...]) -> Array:
    """Returns a value as an array of a shape."""
    return np.broadcast_to(np.asarray(value, dtype=float), shape)


def lost_heat(graph: BondGraph) -> Iterator[str]:
    """Yields a line for heat bonds, and for every resistor that takes power out of a thermal network, where it is kept."""
    if graph.pseudo:
        numbers = ", ".join(map(str, sorted(graph.pseudo)))
        yield f"bonds {numbers} carry temperature and heat flow, which is no power: the power audit leaves them out"
    for element in graph.of_kind("R"):
        domain = graph.domain(graph.bond_of(element.name))
        if domain is not None and domain.name == "thermal" and f"{element.name}.heat" not in graph.elements:
            yield (
                f"{graph.where(element.name)} removes power from a thermal network, but heat cannot vanish: give it as RS, "
                "with a bond to the 0-junction of the body that it heats"
            )
