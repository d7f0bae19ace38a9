"""The motion of a graph that a simulation gives: its states, flows, efforts and powers at any time, and its power audit.

A motion is a chain of steps, each in a mode of the graph, which says of every switch what it does; a graph without switches
has one mode. What a mode makes follow others, or holds at rest, has its value there as well.

The power audit checks a motion by the elements' laws alone, without the equations of the motion: every junction and two-port
must transmit exactly the power that it receives, every one-port must exchange power by its own law, and the energy must add
up over the run: stored - stored at the start + dissipated - supplied.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import (
    JUNCTIONS,
    ONE_PORTS,
    SOURCES,
    TIME,
    TWO_PORTS,
    Element,
    Function,
    GraphError,
    Here,
    Law,
    Modulus,
)
from bondgraph.graph import BondGraph
from bondgraph.motion import runge_kutta, stepping
from bondgraph.motion.dynamics import Dynamics, GraphInstant, Walk, by_rows
from bondgraph.motion.stepping import Step
from bondgraph.numerics import Array, Indices

Mode = tuple[int, ...]  # of every switch: 1 on (0 off); of a dry resistor 1 or -1 sliding, 0 at rest

_MOST_COMPARED = 20_000  # steps at which two runs are
_NO_POWER = 1e-60  # W: less than this is the remains of an iteration towards zero
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)


class Event(NamedTuple):
    """A change of mode: its time (s), the switched junction or dry resistor, and its state after it (1, 0; -1 backwards)."""

    time: float
    name: str
    on: int


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """A simulated motion.

    Attributes:
        graph, dynamics: the graph, and its equations in the mode that it begins in; phases: mode -> its equations.
        stretches: the steps; modes, anchors: of each its mode, and the middles of the smooth pieces that it lies in.
        t: times of the steps, s.
        error: error bound of the states, each relative to its greatest absolute value in the run (to what it would be with
            all the energy of the run, where it stays at rounding: its energy below 2e-16 of the run's): twice the difference
            to a run with longer steps and a looser tolerance, never less than the tolerance (fixed steps: to a run with
            steps of 0.382 of the length).
        rtol: the required one; None for fixed steps.
        method: the method used; another than the required one if that one's steps were limited by modes that had long
            decayed.
        messages: notes on the method of the motion.
        audit: the power audit.
        evaluations: number of evaluations of the rates, all runs together.
        events: where switched junctions and dry resistors changed: time, name, state after it (1, 0; -1 slides back).

    """

    graph: BondGraph
    phases: Mapping[Mode, Dynamics]
    stretches: tuple[Step, ...]
    modes: tuple[Mode, ...]
    anchors: tuple[Mapping[str, float], ...]
    events: tuple[Event, ...] = ()
    error: float = 0.0
    rtol: float | None = None
    evaluations: int = 0
    method: str = ""
    messages: tuple[str, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        return Run, tuple(getattr(self, one.name) for one in fields(self))

    def __repr__(self) -> str:
        """The extent and error of the run, instead of every step."""
        names, error = ", ".join(self.names) or "no state", f"error={self.error:.2g}"
        return f"Run({len(self.stretches)} steps to t = {self.stretches[-1].end:g} s, {names}, {self.method}, {error})"

    @property
    def dynamics(self) -> Dynamics:
        """The equations of the mode that it begins in."""
        return self.phases[self.modes[0]]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the states of all modes."""
        return tuple(dict.fromkeys(name for dynamics in self.phases.values() for name in dynamics.names))

    @property
    def t(self) -> Array:
        """Times of the steps, s."""
        return np.array([self.stretches[0].start, *(s.end for s in self.stretches)])

    @property
    def ends(self) -> Array:
        """The states after every step, a row each."""
        if len(self.phases) > 1:
            return self._looked_at(self.t[1:], np.arange(len(self.stretches)))[1].T
        return np.array([s.after for s in self.stretches])

    @property
    def reached(self) -> bool:
        """True if the estimated error is within the required rtol (with fixed steps there is none)."""
        return self.rtol is None or self.error <= self.rtol

    @cached_property
    def audit(self) -> Audit:
        """The power audit of the run."""
        changed = [k for k in range(1, len(self.stretches)) if self.modes[k] != self.modes[k - 1]]
        return audit(self.stretches, self._auditor, changed)

    def states(self, t: Any = None) -> dict[str, Array]:
        """Every state by name at times t (those of the steps if None)."""
        times = self._times(t)
        at = times, stepping.owners(self.stretches, times)
        values = self._dense(*at) if len(self.phases) == 1 else self._looked_at(*at)[1]
        return dict(zip(self.names, values, strict=True))

    def flow(self, name: str, t: Any = None) -> Array:
        """The flow of an element: of a 1-junction the common one, of a one-port the one into it along its bond."""
        self._check_name(name)
        return self._variables(t)[0][self.graph.bond_of(name).number]

    def displacement(self, name: str, t: Any = None) -> Array:
        """A declared displacement, or a spring's own, which a spring has too that follows others."""
        states = self.states(t)
        displacement = states.get(name, states.get(f"q_{name}"))
        if displacement is None and len(self.phases) == 1:
            times = self._times(t)
            _, state, anchors = self._looked_at(times, stepping.owners(self.stretches, times))
            following = Walk(self.dynamics, times, list(state), anchors).following()
            key = next((key for key in following if key[0] == "q" and name in (key, key[2:])), None)
            displacement = np.array(np.broadcast_to(following[key], times.shape)) if key else None
        if displacement is None:
            raise GraphError(f"no displacement {name!r}: the states are {', '.join(states)}")
        return displacement

    def effort(self, bond: int, t: Any = None) -> Array:
        """The effort of a bond by its number."""
        efforts = self._variables(t)[1]
        if bond not in efforts:
            raise GraphError(f"no bond {bond}: the graph has bonds 1 to {len(efforts)}")
        return efforts[bond]

    def power(self, name: str, t: Any = None) -> Array:
        """The power into a one-port (out of a source: negative)."""
        self._check_name(name)
        if self.graph.elements[name].kind not in ONE_PORTS:
            raise GraphError(f"{self.graph.title(name)} is no one-port: it transmits power; name a one-port")
        bond, (flows, efforts) = self.graph.bond_of(name), self._variables(t)
        return bond.sign(name) * efforts[bond.number] * flows[bond.number]

    def _check_name(self, name: str) -> None:
        if name not in self.graph.elements:
            raise GraphError(f"no element {name!r}: the graph has {', '.join(self.graph.elements)}")

    def _times(self, t: Any) -> Array:
        times = self.t if t is None else np.atleast_1d(np.asarray(t, dtype=float))
        outside = times[~((times >= self.t[0]) & (times <= self.t[-1]))]
        if outside.size:
            raise GraphError(f"found the time {outside[0]:g} s, expected one within 0 and {self.t[-1]:g} s")
        return times

    def _dense(self, times: Array, owners: Indices) -> Array:
        """The states of one mode at times within its stretches."""
        used, where = np.unique(owners, return_inverse=True)
        steps = [self.stretches[owner].dense for owner in used.tolist()]
        if all(isinstance(step, runge_kutta.MethodStep) for step in steps):
            return runge_kutta.at(steps, where, times)
        shared = {id(dense): k for k, dense in enumerate(steps)}  # several steps may share their dense output
        place = np.array([shared[id(dense)] for dense in steps])[where]
        values = np.empty((len(self.phases[self.modes[owners[0]]].names), times.size))
        order = np.argsort(place, kind="stable")
        groups, firsts = np.unique(place[order], return_index=True)
        for k, mine in zip(groups.tolist(), np.split(order, firsts[1:]), strict=True):
            values[:, mine] = steps[k](times[mine])
        return values

    def _looked_at(self, times: Array, owners: Indices) -> tuple[GraphInstant, Array, dict[str, Array]]:
        """The graph at times, its states there, and the middles of their smooth pieces."""
        states, numbers = np.zeros((len(self.names), times.size)), [bond.number for bond in self.graph.bonds]
        flows, efforts = ({number: np.zeros(times.size) for number in numbers} for _ in "fe")
        anchors = {junction: np.array([self.anchors[owner][junction] for owner in owners]) for junction in self.anchors[0]}
        for mode in dict.fromkeys(self.modes[owner] for owner in np.unique(owners)):
            dynamics, alone = self.phases[mode], len(self.phases) == 1
            mine: Any = slice(None) if alone else np.array([self.modes[owner] == mode for owner in owners])
            values = self._dense(times[mine], owners[mine])
            walk = Walk(dynamics, times[mine], list(values), {junction: at[mine] for junction, at in anchors.items()})
            instant = walk.instant()
            for number in numbers:
                flows[number][mine], efforts[number][mine] = instant.flows[number], instant.efforts[number]
            by_name = dict(zip(dynamics.names, values, strict=True))
            by_name |= {} if alone else walk.following()
            for row, name in enumerate(self.names):
                if name in by_name:
                    states[row, mine] = by_name[name]
                elif name[0] == "f":  # a flow that is no state here
                    states[row, mine] = walk.whole(dynamics.form.variable(name[2:]))
        return GraphInstant(flows, efforts, [], {}), states, anchors

    def _variables(self, t: Any) -> tuple[dict[int, Array], dict[int, Array]]:
        """The flows and the efforts by bond at times."""
        times = self._times(t)
        instant = self._looked_at(times, stepping.owners(self.stretches, times))[0]
        return instant.flows, instant.efforts

    def _auditor(self, times: Array, owners: Indices) -> Auditor:
        at, states, anchors = self._looked_at(times, owners)
        return Auditor(self.dynamics, self.graph, times, dict(zip(self.names, states, strict=True)), anchors, at)


def difference(run: Run, other: Run, scale: Array) -> float:
    """The greatest difference of two runs, at the ends of the first's steps and within them, each state by its scale.

    Events' times differ by shares of the time, and between those of one the states are left out; runs of other events differ
    infinitely.
    """
    if [event[1:] for event in run.events] != [event[1:] for event in other.events]:
        return math.inf
    until, starts, widths = run.t[-1], run.t[:-1], np.diff(run.t)
    some = slice(None, None, 1 + widths.size // _MOST_COMPARED)
    times = np.minimum((starts[some, None] + widths[some, None] * stepping.WITHIN).ravel(), until)
    worst = 0.0
    for mine, theirs in zip(run.events, other.events, strict=True):
        low, high = sorted((mine.time, theirs.time))
        worst = max(worst, (high - low) / until)
        times = times[(times < low) | (times > high)]
    a, b = (np.array(list(each.states(times).values())) for each in (run, other))
    return max(float(np.max(np.abs(a - b) / scale[:, None], initial=0.0)), worst)


def rounding(run: Run) -> float:
    """The least error of the states by rounding, to which each step contributes."""
    return float(4.0 * np.finfo(float).eps * math.sqrt(len(run.stretches)))


def energy_scales(dynamics: Dynamics, times: Array, states: Array, anchors: Mapping[str, Any]) -> Array:
    """The value of each state with all the energy of a run in it, from states (a column for every time).

    E = greatest energy of all stores + integral of |e f| over all other ports. A linear store has sqrt(2 E W), W its own
    inertia or compliance with those that follow it; one of a curved law the least power of two with |e(q) q|/2 >= E (an
    inertia: |f(p) p|/2); a declared displacement what these flows make of it in the time of the run.
    """
    walk, form = Walk(dynamics, times, list(states), anchors), dynamics.form
    with np.errstate(all="ignore"):
        instant, passed, stored = walk.instant(), np.zeros(times.shape), np.zeros(times.shape)
        for port in form.ports:
            power = filled(instant.efforts.get(port.bond, 0.0) * instant.flows.get(port.bond, 0.0), times.shape)
            place = next((k for k, p in enumerate(form.stores) if p == port), None)
            if place is not None and port.element.name not in form.massless:
                outputs = filled(walk.outputs[place], times.shape)
                stored = stored + 0.5 * np.abs(outputs * states[place])
            elif port in form.followers and form.graph.is_linear(port.element.name):
                constant = form.graph.constant(port.element.name)
                stored = stored + 0.5 * constant * filled(walk.value(port.input), times.shape) ** 2
            elif port.element.name not in form.massless:
                passed = passed + np.abs(power)
        energy = float(np.nanmax(stored) + np.nansum(0.5 * (passed[1:] + passed[:-1]) * np.diff(times)))
        matrix, _ = walk.mass_and_force()
    weights = {k: float(np.max(matrix[i][i])) for i, k in enumerate(dynamics.weighed)}
    greatest, scales = [], []
    for k, port in enumerate(form.stores):
        curved = form.graph.is_curve(port.element.name)
        own = 0.0 if port.element.name in form.massless or curved else form.graph.constant(port.element.name)
        weight = max(weights.get(k, own), 1e-300)
        if curved:
            # the least power of two at which a store of a curved law holds an energy
            trial, stretch, taken = Walk(dynamics, 0.0, states[:, 0].tolist()), 2.0**-100, 0.0
            while taken < energy and stretch < 2.0**100:
                stretch *= 2.0
                try:
                    taken = 0.5 * stretch * max(abs(trial.stored(port, side * stretch)) for side in (-1.0, 1.0))
                except GraphError:  # the law ends here
                    break
            scales.append(stretch)
        else:
            scales.append((1.0 if port.element.name in form.massless else own) * math.sqrt(2.0 * energy / weight))
        greatest.append(float(np.max(np.abs(walk.outputs[k]))) if curved else math.sqrt(2.0 * energy / weight))
    greatest += [float(np.max(np.abs(z))) if z is not None else 0.0 for z in walk.outputs[len(form.stores) :]]
    for displacement in form.displacements:
        gains = walk.gain[dynamics.owner_of[displacement.name]]
        scales.append(float(times[-1]) * sum(float(np.max(np.abs(gain))) * greatest[k] for k, gain in gains.items()))
    return np.array(scales)


# -- the power audit --------------------------------------------------------------------------------------------------------


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
