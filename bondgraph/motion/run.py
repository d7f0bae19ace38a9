"""The motion of a graph that a simulation gives: its states, flows, efforts and powers at any time, and its power audit.

A motion is a chain of steps, each in a mode of the graph, which says of every switch what it does; a graph without switches
has one mode. What a mode makes follow others, or holds at rest, has its value there as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import ONE_PORTS, GraphError
from bondgraph.graph import BondGraph
from bondgraph.motion import runge_kutta, stepping
from bondgraph.motion.audit import Audit, Auditor, audit
from bondgraph.motion.dynamics import Dynamics, GraphInstant, Walk
from bondgraph.motion.stepping import Step
from bondgraph.numerics import Array, Indices

Mode = tuple[int, ...]  # of every switch: 1 on (0 off); of a dry resistor 1 or -1 sliding, 0 at rest

_MOST_COMPARED = 20_000  # steps at which two runs are


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
        return tuple(dict.fromkeys(name for dynamics in self.phases.values() for name in dynamics.state.names))

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
        values = np.empty((len(self.phases[self.modes[owners[0]]].state.names), times.size))
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
            by_name = dict(zip(dynamics.state.names, values, strict=True))
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
