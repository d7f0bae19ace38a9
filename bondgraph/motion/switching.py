"""Motion of a graph whose junctions are switched, or whose resistors hold at rest: modes, the events between, one run.

A mode says of every switched junction whether it is on, and of every resistor whose effort jumps where its flow changes its
sign (dry friction) whether it slides forwards, backwards or sticks. In a mode the graph is an ordinary one with strokes and
states of its own (`mode`): a 1-junction that is off is as many flows of 0 as it has bonds, a 0-junction efforts of 0, a
resistor that sticks a flow of 0.

A mode lasts until a condition changes, to the last digit of the dense output. What passes an event is every store's momentum
or displacement. Stores that share a flow (an effort) from then on exchange impulses that do no work on what is free: of
every state the sum with the followers' shares is kept,

    y_k + sum g_dk y_d = the same before,   y_d = W_d w_d after,

so that momentum is conserved where inertias join, charge where capacitors do. The energy that is lost counts as dissipated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bondgraph.elements import OWN_FLOW, Element, Function, GraphError, refuse
from bondgraph.graph import BondGraph, as_graph, new_bond
from bondgraph.motion import stepping
from bondgraph.motion.algebra import Balance, settle
from bondgraph.motion.audit import Auditor
from bondgraph.motion.dynamics import Dynamics, PlainRates, RateLog, Walk
from bondgraph.motion.run import Event, Mode, Run, difference, rounding
from bondgraph.motion.stepping import Events, Step, adaptive, crossing, fixed
from bondgraph.numerics import Array

_ON, _DRY = {0: "off", 1: "on"}, {0: "at rest", 1: "sliding", -1: "sliding back"}
_TINY = 1e-300  # a flow of either sign, by which a law that jumps is asked for its two values
_TRIED = (0.37, -0.71, 1.0)  # values of what a law depends on, at which a jump is searched for
_SMALL = 1e-12  # a flow at which a law that jumps is still what it is beside its jump, and one with a pole is not
_JUMP = 1e-9  # of the law at 1: less is none
_NOTHING = 1e-12  # of the greatest value so far: closer to its change a condition is at it
_AT_ONCE, _SOON = 20, 1e-9  # events within a share of the time, beyond which they chatter
_MOST_EVENTS = 20_000


def mode(graph: BondGraph, **states: Any) -> BondGraph:
    """A graph with some of its switched junctions on or off, and dry resistors sliding (1, -1) or at rest (0).

    Raises:
        GraphError: for a name that is neither.

    >>> from bondgraph import Builder, I, causality
    >>> b = Builder().one("a").one("b").zero("clutch", when=lambda t: t > 1).bond("a", "clutch").bond("clutch", "b")
    >>> graph = b.on("a", I("J1", 2.0)).on("b", I("J2", 3.0)).build()
    >>> causality(mode(graph, clutch=False)).integral, causality(mode(graph, clutch=True)).integral
    (('J1', 'J2'), ('J1',))

    """
    graph = as_graph(graph)
    dry = dry_resistors(graph)
    names = ", ".join((*graph.switched, *dry)) or "none"
    refuse(f"mode {n!r}: nothing that is switched; found {names}" for n in states if n not in (*graph.switched, *dry))
    elements, bonds = dict(graph.elements), list(graph.bonds)

    def hang(junction: str, name: str, kind: str) -> None:
        elements[name] = Element(kind, name, 0.0)
        bonds.append(new_bond(bonds, name, junction))

    for name, state in states.items():
        kind, law = graph.elements[name].kind, graph.elements[name].law
        elements[name] = elements[name]._replace(law=None)
        if kind == "R" and state:
            elements[name] = elements[name]._replace(law=_sliding(graph, name, state))
        elif kind == "R":  # it takes whatever holds it
            elements[name] = Element("Sf", name, 0.0, graph.elements[name].domain)
        elif not state:
            assert isinstance(law, Function)
            source = "Sf" if kind == "1" else "Se"
            hang(name, f"{name}.off", source)
            for k, bond in enumerate(graph.at(name)[1:], 2):
                other, place = f"{name}.{k}", bonds.index(next(b for b in bonds if b.number == bond.number))
                elements[other] = Element(kind, other, None, graph.elements[name].domain)
                bonds[place] = bond.moved(name, other)
                hang(other, f"{other}.off", source)
    return replace(graph, elements=elements, bonds=tuple(bonds), parts=True)


def dry_resistors(graph: BondGraph) -> tuple[str, ...]:
    """The resistors whose effort jumps where their flow changes its sign.

    >>> import numpy as np
    >>> from bondgraph import Builder, I, R
    >>> b = Builder().one("a").on("a", I("m", 1.0), R("rub", lambda f: 2.0 * np.sign(f)), R("oil", lambda f: f * abs(f)))
    >>> dry_resistors(b.build())
    ('rub',)
    """
    resistors = []
    for element in graph.of_kind("R"):
        law = element.law
        if graph.own(element.name) != OWN_FLOW or not isinstance(law, Function):
            continue
        for other in _TRIED:
            values = [graph.parameters.get(n, other) or other for n in law.of]
            own = law.of.index(OWN_FLOW)
            flows = (-_TINY, _TINY, -_SMALL, _SMALL, 1.0)
            try:
                with np.errstate(all="ignore"):
                    low, high, under, over, one = (float(law(*values[:own], f, *values[own + 1 :])) for f in flows)
            except (ValueError, ArithmeticError, TypeError, GraphError):
                continue
            least = _JUMP * max(abs(one), abs(high))
            if high - low > least and max(abs(high - over), abs(low - under)) < _SMALL * abs(high - low) / _JUMP:
                resistors.append(element.name)
                break
    return tuple(resistors)


def _sliding(graph: BondGraph, name: str, way: int) -> Function:
    """A dry resistor's law on one side of its jump, continued past it."""
    law = graph.elements[name].law
    assert isinstance(law, Function)
    own = law.of.index(OWN_FLOW)

    def beside(*values: Any) -> Any:
        flow = np.maximum(values[own], _TINY) if way > 0 else np.minimum(values[own], -_TINY)
        return law(*values[:own], flow, *values[own + 1 :])

    return Function(beside, law.arguments, law.of)


class Switched:
    """A graph with switches; `phases` has the equations of the modes that were met so far."""

    def __init__(self, graph: BondGraph, signals: Mapping[str, Any], evaluations: int) -> None:
        self.graph, self.signals = graph, signals
        self.dry, self.switches = dry_resistors(graph), (*graph.switched, *dry_resistors(graph))
        self.phases: dict[Mode, Dynamics] = {}
        self.log, self.budget = RateLog(), evaluations
        self.scale: dict[tuple[int, int], float] = {}  # of every condition its greatest value so far

    def dynamics(self, at: Mode) -> Dynamics:
        """The equations of a mode."""
        if at not in self.phases:
            states = dict(zip(self.switches, at, strict=True))
            try:
                dynamics = Dynamics(mode(self.graph, **states), self.signals)
            except GraphError as error:
                said = ", ".join(f"{n} {(_DRY if n in self.dry else _ON)[s]}" for n, s in states.items())
                raise GraphError(f"with {said}: {error}") from error
            if any(p.element.name != n for p in dynamics.form.followers for n in self.graph.coupled(p.element.name)):
                raise GraphError("a field's ports follow in one mode and not in another: put an R, or a C, between")
            self.phases[at] = dynamics
        return self.phases[at]

    def margins(self, at: Mode, times: Array, states: Array) -> tuple[Array, list[tuple[int, int]]]:
        """The margins of a mode, each above 0 within it, at times (n,); for each the switch and its state beyond."""
        here, rows = self._observed(self.dynamics(at), times, states), []
        beyond: list[tuple[int, int]] = []
        for k, (name, on) in enumerate(zip(self.switches, at, strict=True)):
            if name not in self.dry:
                value = here.law(name)
                rows.append(value if on else -value)
                beyond.append((k, 1 - on))
            elif on:
                rows.append(on * here.flow(name))
                beyond.append((k, 0))
            else:
                effort = here.efforts[self.graph.bond_of(name).number]
                rows += [here.law(name, _TINY) - effort, effort - here.law(name, -_TINY)]
                beyond += [(k, 1), (k, -1)]
        return np.array(rows).reshape(len(rows), *np.shape(times)), beyond

    def _observed(self, dynamics: Dynamics, times: Array, states: Array) -> Auditor:
        """The graph with all that conditions may read: of a switched junction the sum over its bonds, too."""
        with np.errstate(all="ignore"):
            instant = dynamics.at(times, list(states))
        here = Auditor(dynamics, self.graph, times, dict(zip(dynamics.state.names, states, strict=True)), {}, instant)
        for name in self.graph.switched:
            letter, summed = ("e", here.efforts) if self.graph.elements[name].kind == "1" else ("f", here.flows)
            if (read := f"{letter}_{name}") not in (*self.graph.displacements, *self.graph.signals):
                here.places[read] = sum(b.sign(name) * summed[b.number] for b in self.graph.at(name))
        return here

    def contents(self, at: Mode, t: float, state: Sequence[float]) -> dict[str, float]:
        """The momentum or displacement of every store, and every further state, by name."""
        dynamics = self.dynamics(at)
        following = Walk(dynamics, t, list(state)).following()
        return dict(zip(dynamics.state.names, map(float, state), strict=True)) | {n: float(x) for n, x in following.items()}

    def carried(self, stored: Mapping[str, float], at: Mode, t: float) -> Array:
        """The state of a mode that begins with the stores' present values; followers share theirs with their leaders."""
        dynamics = self.dynamics(at)
        form = dynamics.form
        state = np.array([stored.get(name, 0.0) for name in dynamics.state.names])
        if not form.stores or not (form.followers or form.massless):
            return state
        size, names = len(form.stores), [form.state_name(p) for p in (*form.stores, *form.followers)]
        sign = [p.sense for p in (*form.stores, *form.followers)]
        own = [0.0 if p.element.name in form.massless else sign[k] for k, p in enumerate(form.stores)]
        before, rest = [stored.get(name, 0.0) for name in names], state[size:].tolist()
        largest = {x: max((abs(v) for n, v in zip(names, before, strict=True) if n[0] == x), default=0.0) for x in "fpq"}
        scale = [largest[name[0]] or 1.0 for name in names[:size]]

        def balance(shares: list[float]) -> Balance:
            values = [share * unit for share, unit in zip(shares, scale, strict=True)]
            walk = Walk(dynamics, t, [*values, *rest])
            outputs = [walk.output_slopes(k) for k in range(size)]
            residuals = [own[k] * (values[k] - before[k]) for k in range(size)]
            slopes = [[own[i] if i == j else 0.0 for j in range(size)] for i in range(size)]
            for k, (port, weight) in enumerate(zip(form.followers, walk.weights(), strict=True), start=size):
                more = sign[k] * (float(walk.followed(k - size)) - before[k])
                gains = {column: float(gain) for column, gain in walk.gain[port.input].items() if column < size}
                for i, gain in gains.items():
                    residuals[i] += gain * more
                    for other, n, slope in ((g, n, s) for j, g in gains.items() for n, s in outputs[j].items()):
                        slopes[i][n] += gain * weight * other * slope
            rows = [[slope * unit / scale[i] for slope, unit in zip(slopes[i], scale, strict=True)] for i in range(size)]
            return [residual / unit for residual, unit in zip(residuals, scale, strict=True)], rows

        where = ", ".join(self.graph.where(p.element.name) for p in form.followers) or "the joint inertia"
        start = [value / unit for value, unit in zip(state.tolist(), scale, strict=False)]
        shares = settle(balance, size, (), where, start)
        return np.array([*(share * unit for share, unit in zip(shares, scale, strict=True)), *rest])

    def settled(self, at: Mode, t: float, stored: Mapping[str, float]) -> tuple[Mode, Array]:
        """The mode that continues from the stores' present values: that given, or another if its conditions fail."""
        seen = [at]
        while True:
            state = self.carried(stored, at, t)
            values, beyond = self.margins(at, np.array([t]), state[:, None])
            failed = (p for value, p in zip(values[:, 0], beyond, strict=True) if value < -_NOTHING * self.scale.get(p, 0.0))
            change = next(failed, None)
            if change is None:
                return at, state
            at = (*at[: change[0]], change[1], *at[change[0] + 1 :])
            if at in seen:
                self._chatters(t, seen)
            seen.append(at)

    def _chatters(self, t: float, seen: Sequence[Mode]) -> None:
        last = {k for one in seen for two in seen for k, (a, b) in enumerate(zip(one, two, strict=True)) if a != b}
        names = ", ".join(self.graph.where(self.switches[k]) for k in sorted(last))
        raise GraphError(
            f"the condition of {names} chatters at t = {t:.9g} s: each state of it requires the other at once; "
            "let it read quantities that its own change does not affect"
        )

    def follow(self, start: tuple[Mode, Array], until: float, rtol: float, method: str) -> Run:
        """The motion within rtol: runs at tighter tolerance until two agree, in their events too."""
        longest = until / stepping.LEAST_STEPS if self.graph.varies else math.inf
        tolerance = max(stepping.FIRST * rtol, 10.0 * stepping.FINEST)

        def tighter(tolerance: float, looser: Run) -> tuple[Run, float]:
            nonlocal longest
            sizes = _sizes(looser)
            run, longest = self._run(start, until, method, (tolerance, sizes), longest), stepping.SHORTER * longest
            return run, _error(run, looser, sizes)

        first, _ = tighter(tolerance, self._run(start, until, method, (max(stepping.PILOT, rtol), {}), longest))
        run, error = stepping.agreement(first, tighter, rtol, tolerance)
        return replace(run, error=error)

    def stepped(self, start: tuple[Mode, Array], until: float, method: str, steps: tuple[float, float]) -> Run:
        """The motion in equal steps from event to event, with twice its difference to one with steps of another length."""
        run, other = (self._run(start, until, method, (0.0, {}), math.inf, step) for step in steps)
        return replace(run, error=_error(run, other, _sizes(other)))

    def begin(self, start: Callable[[Dynamics], Array]) -> tuple[Mode, Array]:
        """The mode that a motion begins in, and its state; `start` gives that of a mode, or does not know its states."""
        fault: GraphError | None = None
        for at in self._freest():
            try:
                state = start(self.dynamics(at))
            except GraphError as error:
                fault = fault or error
                continue
            here = self._observed(self.dynamics(at), np.array([0.0]), state[:, None])
            ways = {name: int(np.sign(here.flow(name)[0])) for name in self.dry}
            first = tuple(ways.get(n, s) for n, s in zip(self.switches, at, strict=True))
            return self.settled(first, 0.0, self.contents(at, 0.0, state.tolist()))
        assert fault is not None
        raise fault

    def _freest(self) -> list[Mode]:
        """Modes, those with the most states first: what is given of a start is not bound by what is joined."""
        freedoms: dict[Mode, int] = {}

        def states(at: Mode) -> int:
            if at not in freedoms:
                try:
                    freedoms[at] = len(self.dynamics(at).state.names)
                except GraphError:
                    freedoms[at] = -1
            return freedoms[at]

        best = tuple(1 for _ in self.switches)
        states(best)
        for k, name in enumerate(self.switches):
            other = (*best[:k], 0, *best[k + 1 :])
            if name not in self.dry and states(other) > states(best):
                best = other
        return sorted(freedoms, key=lambda at: -freedoms[at])

    def _run(
        self,
        start: tuple[Mode, Array],
        until: float,
        method: str,
        tolerance: tuple[float, Mapping[str, float]],
        longest: float,
        length: float | None = None,
    ) -> Run:
        """The motion from a mode and state on; with a `length`, s, in equal steps."""
        (at, state), t = start, 0.0
        stretches: list[Step] = []
        modes: list[Mode] = []
        events: list[Event] = []
        turns: list[float] = []
        while t < until:
            dynamics = self.dynamics(at)
            scales = np.array([tolerance[0] * tolerance[1].get(n, 1.0) for n in dynamics.state.names])
            beyond = self.margins(at, np.array([t]), state[:, None])[1]
            relative = (0.0, np.maximum(scales, 1e-300))
            crossed = None
            rates = self._rates(dynamics)
            equal = fixed(method, rates, t, state, until, length) if length else None
            for step in equal or adaptive(method, rates, t, state, until, relative, longest):
                step = crossing(self._watched(at, step, beyond), step) if beyond else step
                crossed = step.crossed
                state = np.asarray(step.dense(step.end) if crossed is not None else step.last, dtype=float)
                stretches.append(step._replace(crossed=None, after=state))
                modes.append(at)
                if step.end == step.start:  # it leaves at once
                    stretches.pop()
                    modes.pop()
                t = step.end
                if crossed is not None:
                    break
            if crossed is None:
                break
            stored, place = self.contents(at, t, state.tolist()), beyond[crossed]
            after, state = self.settled((*at[: place[0]], place[1], *at[place[0] + 1 :]), t, stored)
            events += [Event(t, self.switches[k], b) for k, (a, b) in enumerate(zip(at, after, strict=True)) if a != b]
            turns.append(t)
            if len(turns) > _AT_ONCE and t - turns[-_AT_ONCE] <= _SOON * until:
                self._chatters(t, [at, (*at[: place[0]], place[1], *at[place[0] + 1 :])])
            if len(events) > _MOST_EVENTS:
                raise GraphError(f"{_MOST_EVENTS} events reach t = {t:.6g} s only: ask for a shorter time")
            at = after
        return Run(self.graph, self.phases, tuple(stretches), tuple(modes), ({},) * len(modes), tuple(events))

    def _watched(self, at: Mode, step: Step, beyond: Sequence[tuple[int, int]]) -> Events:
        """The conditions of a mode as events of a step."""
        times = step.start + (step.end - step.start) * stepping.WITHIN
        sizes = np.abs(self.margins(at, times, step.dense(times))[0]).max(axis=1)
        for (k, state), size in zip(beyond, sizes.tolist(), strict=True):
            for side in (state,) if self.switches[k] in self.dry else (0, 1):  # one condition, on either side
                self.scale[k, side] = max(self.scale.get((k, side), 0.0), size)
        rounding = np.array([_NOTHING * self.scale[place] for place in beyond])
        return Events(lambda times, states: self.margins(at, times, states)[0], np.ones(len(beyond)), rounding=rounding)

    def _rates(self, dynamics: Dynamics) -> PlainRates:
        """The rates of a mode, as long as evaluations are left."""
        rates = dynamics.within(self.log)

        def limited(t: float, values: Sequence[float]) -> Sequence[float]:
            if self.log.evaluations >= self.budget:
                raise GraphError(
                    f"{self.budget} evaluations of the rates are spent at t = {t:.6g} s: ask for a shorter time or a larger "
                    "rtol, or use a method for stiff equations (Radau); evaluations= allows more"
                )
            return rates(t, values)

        return limited


def _sizes(run: Run) -> dict[str, float]:
    """The greatest absolute value of every state of a run, 1 of one that stays 0."""
    return {name: float(np.abs(values).max()) or 1.0 for name, values in run.states().items()}


def _error(run: Run, other: Run, sizes: Mapping[str, float]) -> float:
    """An error bound of a run, by its difference to another one."""
    return max(2.0 * difference(run, other, np.array([sizes.get(name, 1.0) for name in run.names])), rounding(run))
