"""One evaluation of a graph: from a state to its rates, and to every flow and effort.

`Walk` is one evaluation: gains, what sources and resistors give, rates, flows and efforts. It is written once against
arithmetic and calls of laws, so that it runs on floats, on arrays (many states at once, for the power audit), on SymPy
expressions, and on a recording of itself as straight-line code, which is what time stepping runs. A store in derivative
causality is folded in by its gains, M z' = Q with M = W + S^T D S. `Dynamics` has the data of walks that are constant,
computed once for a graph.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import (
    SOURCES,
    STORES,
    TIME,
    Function,
    GraphError,
    Here,
    Law,
    Modulus,
    Motion,
    function,
    is_symbolic,
    refuse,
)
from bondgraph.graph import BondGraph, Ratio, SolutionStep, as_graph, constant, ratios, sources
from bondgraph.motion.algebra import SOUGHT, Balance, settle, solutions, solve, solve_symmetric, total
from bondgraph.motion.formulation import Formulation, OutputGroup, PortBond, exact_gains, loop_name, unsolvable
from bondgraph.motion.runge_kutta import MANY
from bondgraph.numerics import Array
from bondgraph.recording import Recorded, Recorder

_CANCELLED = 1e-9  # of the greatest gain: what rounding leaves of shares that cancel


class GraphInstant(NamedTuple):
    """A graph at one time, or at many.

    flows, efforts: of every bond, by its number; a store's in derivative causality with the others' rates in it. rates: of
    the state. moduli: of every two-port that varies, by name.
    """

    flows: dict[int, Any]
    efforts: dict[int, Any]
    rates: list[Any]
    moduli: dict[str, Any]


class Walk:
    """The state, and what follows from it step by step.

    `outputs` holds the outputs of iterated groups, as far as they are known; with `stop`, the walk ends at that group, with
    its residual and slopes as `balance`. Where it is `still`, sources give 0.
    """

    def __init__(
        self,
        dynamics: Dynamics,
        t: Any,
        state: Sequence[Any],
        anchors: Mapping[str, Any] = MappingProxyType({}),
        outputs: Sequence[Sequence[Any]] = (),
        stop: int | None = None,
        acts: bool = True,
        still: bool = False,
    ) -> None:
        self.dynamics, self.form, self.graph = dynamics, dynamics.form, dynamics.form.graph
        self.t, self.anchors, self.state = t, anchors, list(state)
        self._outputs, self._stop, self._still = outputs, stop, still
        stores, displaced = len(self.form.stores), self.form.displacements
        self._places: dict[str, Any] = {TIME: t}
        for displacement, value in zip(displaced, self.state[stores:], strict=True):
            self._places[displacement.name] = value
        self._motions: dict[int, tuple[Any, Any]] = {}
        self.moduli: dict[int, tuple[Any, tuple[tuple[str, Any], ...]]] = {}
        for name, signal in dynamics.signals.items():
            self._places[name] = self._call(signal, [t] * len(signal.of))
        self.outputs: list[Any] = [None] * (2 * len(self.form.column))  # and rates of sources, where `closed` holds them
        for k, port in enumerate(self.form.stores):
            self.outputs[k] = self.stored(port, self.state[k])
        self.gain: Any = None
        self._values: dict[int, Any] = {}
        self._weighed: list[Any] | None = None
        self._biased: dict[int, Any] | None = None
        self._gain()
        self.balance: Balance | None = None
        if acts:
            self._act()

    def rates(self) -> list[Any]:
        """The rates of the state."""
        stores = self._store_rates()
        return stores + [self.whole(self.dynamics.owner_of[d.name]) for d in self.form.displacements]

    def instant(self) -> GraphInstant:
        """Flows, efforts, rates of the state."""
        rates = self.rates()
        flows = {b.number: self.whole(self.form.flow[b.number]) for b in self.form.source.bonds}
        efforts = {b.number: self.whole(self.form.effort[b.number]) for b in self.form.source.bonds}
        return GraphInstant(flows, efforts, rates, {name: self.moduli[id(ratio)][0] for ratio, name in self.dynamics.moduli})

    def value(self, variable: int) -> Any:
        """A flow or effort without the outputs of followers."""
        if variable not in self._values:
            last = len(self.form.stores) + len(self.form.acting)
            self._values[variable] = total(g * self.outputs[k] for k, g in self.gain[variable].items() if k < last)
        return self._values[variable]

    def whole(self, variable: int) -> Any:
        """A flow or effort with the outputs of followers."""
        last = len(self.form.stores) + len(self.form.acting)
        more = [k for k in self.gain[variable] if k >= last]
        if any(last <= k < len(self.form.column) for k in more) and self.outputs[last] is None:
            self._store_rates()
        for k in (k for k in more if k >= len(self.form.column) and self.outputs[k] is None):
            port = self.form.acting[k - len(self.form.column) - len(self.form.stores)]
            self.outputs[k] = self._rate_of_source(port.element.name)
        return (
            self.value(variable) + total(self.gain[variable][k] * self.outputs[k] for k in more)
            if more
            else self.value(variable)
        )

    def stored(self, port: PortBond, x: Any) -> Any:
        """The output of a store in integral causality: the flow of an inertia, the effort of a compliance."""
        name = port.element.name
        return port.sense * self._law(name, x) if self.graph.is_curve(name) else port.sense * x / self._constant(port)

    def _constant(self, port: PortBond) -> Any:
        """The inertia or compliance of a store of a linear law; 1 where a flow is the state."""
        return 1.0 if port.element.name in self.form.massless else self.graph.constant(port.element.name)

    def _slopes(self, port: PortBond, x: Any) -> dict[int, Any]:
        """The slopes of a curved store's law by the states of stores, at their places: its own, and those that it reads."""
        law, name = port.element.law, port.element.name
        assert isinstance(law, Function)
        partials = dict(zip(law.of, self._partials(law, name, x)[1], strict=True))
        places = {self.form.state_name(p): k for k, p in enumerate(self.form.stores)}
        signs = [p.sense for p in (*self.form.stores, port)]
        slopes = {}
        for n in (n for n in law.of if n not in self.graph.parameters):
            k = places.get(self.form.state_name(port), -1) if n == self.graph.own(name) else places[n]
            slopes[k] = signs[k] * signs[-1] * partials[n]
        return slopes

    def output_slopes(self, place: int) -> dict[int, Any]:
        """The slopes of a store's output by the states of stores, at their places."""
        port = self.form.stores[place]
        if self.graph.is_curve(port.element.name):
            return self._slopes(port, self.state[place])
        return {place: port.sense / self._constant(port)}

    def _call(self, called: Callable[..., Any], arguments: Sequence[Any], results: int = 0) -> Any:
        """Calls a law, or records it where the walk is recorded; `results` is the length of the tuple that it returns."""
        node = next((a for a in arguments if isinstance(a, Recorded)), None)
        if node is not None:
            return node.recorder.through(called, arguments, results)
        return by_rows(called, arguments, results)

    def _arguments(self, law: Function, name: str, own: Any = None, outputs: Mapping[Any, Any] | None = None) -> list[Any]:
        """The arguments of a law; `outputs` has flows and efforts that are not yet known, besides its own."""
        outputs, form = {self.graph.own(name): own} if outputs is None else outputs, self.form
        values = []
        for argument in law.of:
            if argument in outputs:
                values.append(outputs[argument])
            elif argument in self.graph.parameters:
                values.append(self.graph.parameter(argument, name))
            elif (signal := self.graph.reading(argument)) is None:
                values.append(self._places[argument])
            elif signal[0] in "fe":
                variable = form.read_variable(*signal)
                # a modulus is needed before the gains, and reads what stores give
                values.append(self.outputs[form.column[variable]] if self.gain is None else self.value(variable))
            else:
                place = next((k for k, port in enumerate(form.stores) if port.bond == signal[1]), None)
                if place is None:
                    where, leads = self.graph.where(name), form.follows[argument[2:]]
                    raise GraphError(f"{where} reads {argument}, which is no state: {leads}")
                values.append(self.state[place])
        return values

    def _law(self, name: str, own: Any = None) -> Any:
        law = self.graph.elements[name].law
        if isinstance(law, Function):
            arguments = self._arguments(law, name, own)
            if any(map(is_symbolic, arguments)):
                return self._symbolic(law, arguments)
            return self._named(name, law, arguments)
        if isinstance(law, Law):
            return self._call(law.effort, self._both(law.motion)) if not law.moving else self._moving_effort(name, law)
        return law

    def _moving_effort(self, name: str, law: Law) -> Any:
        """The effort of a law that depends on speed or time."""
        speed = self.value(self.form.variable(law.motion.of)) if "speed" in law.sees else 0.0
        own = self.value(self.form.variable(name)) if "flow" in law.sees else 0.0

        def effort(here: Here, anchor: Here, speed: Any, own: Any, t: Any) -> Any:
            return law.effort(*(place._replace(speed=speed, flow=own, time=t) for place in (here, anchor)))

        return self._call(effort, (*self._both(law.motion), speed, own, self.t))

    def _partials(self, law: Function, name: str, own: Any = None) -> tuple[Any, tuple[Any, ...]]:
        arguments = self._arguments(law, name, own)
        if any(map(is_symbolic, arguments)):
            return self._symbolic_partials(law, arguments)

        def flat(*values: Any) -> tuple[Any, ...]:
            value, partials = law.partials(*values)
            return (value, *partials)

        value, *partials = self._named(name, flat, arguments, 1 + len(arguments))
        return value, tuple(partials)

    def _named(self, name: str, called: Callable[..., Any], arguments: list[Any], results: int = 0) -> Any:
        """Calls an element's law; the error where it is not defined names the element."""
        try:
            return self._call(called, arguments, results)
        except (ValueError, ArithmeticError) as error:
            of = getattr(self.graph.elements[name].law, "of", ())
            where = ", ".join(f"{n} = {v}" for n, v in zip(of, arguments, strict=False))
            raise GraphError(f"the law of {self.graph.title(name)} is not defined at {where}: {error}") from error

    def _symbolic(self, law: Function, arguments: list[Any]) -> Any:
        return law.symbolic(dict(zip(law.of, arguments, strict=True)))

    def _symbolic_partials(self, law: Function, arguments: list[Any]) -> tuple[Any, tuple[Any, ...]]:
        """A law's value and partial derivatives at arguments that may be whole expressions, such as a flow."""
        import sympy  # type: ignore[import-untyped]

        places = [sympy.Dummy(name, real=True) for name in law.of]
        value = law.symbolic(dict(zip(law.of, places, strict=True)))
        at = {place: sympy.sympify(argument, strict=True) for place, argument in zip(places, arguments, strict=True)}
        return value.xreplace(at), tuple(value.diff(place).xreplace(at) for place in places)

    def _both(self, motion: Motion) -> tuple[Any, Any]:
        pair = self._motions.get(id(motion))
        if pair is None:
            q = self._places[self.dynamics.displacement_of[motion.of]]
            anchor = self.anchors.get(motion.of, q)
            here = self._call(_here, (motion.position, q, anchor))
            pair = self._motions[id(motion)] = here, self._call(_here, (motion.position, anchor, anchor))
        return pair

    def _ratio(self, ratio: Ratio) -> Any:
        return self.moduli[id(ratio)][0] if isinstance(ratio, Function | Modulus) else ratio

    def _ratio_rate(self, ratio: Ratio) -> Any:
        total: Any = 0.0
        for name, partial in self.moduli[id(ratio)][1] if isinstance(ratio, Function | Modulus) else ():
            total = total + partial * self._rate(name)
        return total

    def _rate(self, name: str) -> Any:
        """The time derivative of something that laws depend on."""
        if name == TIME:
            return 1.0
        if name in self.dynamics.owner_of:
            return self.value(self.dynamics.owner_of[name])
        if name not in self.dynamics.signals:
            raise GraphError(
                f"the rate of {name} is needed, for a store follows by it: only displacements and signals have one"
            )
        signal = self.dynamics.signals[name]
        return self._call(lambda t: signal.partials(t)[1][0], (self.t,)) if signal.of else 0.0

    def _rate_of_source(self, name: str) -> Any:
        law = self.graph.elements[name].law
        if isinstance(law, Law):
            raise GraphError(f"{self.graph.title(name)}: the rate of its effort is needed, but its law gives efforts only")
        total: Any = 0.0
        if isinstance(law, Function):
            for argument, partial in zip(law.of, self._partials(law, name)[1], strict=True):
                if argument not in self.graph.parameters:
                    total = total + partial * self._rate(argument)
        return total

    def _gain(self) -> None:
        """The gains of every variable, {column: gain}."""
        for ratio, name in self.dynamics.moduli:
            # a transformer's ratio, and its partial derivatives by the names that it depends on
            if isinstance(ratio, Function):
                value, partials = self._partials(ratio, name)
                self.moduli[id(ratio)] = (
                    value,
                    tuple((n, p) for n, p in zip(ratio.of, partials, strict=True) if n not in self.graph.parameters),
                )
            else:
                here = self._both(ratio.motion)[0]
                of = self.dynamics.displacement_of[ratio.motion.of]
                value, slope = (
                    self._call(lambda at, pick=pick: pick(at.position), (here,)) for pick in (ratio.value, ratio.slope)
                )
                self.moduli[id(ratio)] = value, ((of, slope),)
        self.gain = [{} for _ in self.form.support]
        for variable, k in self.form.column.items():
            self.gain[variable] = {k: 1.0}
        self.gain = [dict(self.dynamics.closed.get(v, gain)) for v, gain in enumerate(self.gain)]
        for step in self.form.steps:
            if self.dynamics.closed.keys() >= {*step.unknown}:
                continue
            if step.terms is not None:
                terms = [(self._ratio(ratio), self.gain[v]) for v, ratio in step.terms]
                columns = sorted({k for _, gain in terms for k in gain})
                self.gain[step.unknown[0]] = {
                    k: total(ratio * gain[k] for ratio, gain in terms if k in gain) for k in columns
                }
            else:
                columns, right = sorted({k for v in sources(step) for k in self.gain[v]}), []
                for relation in step.relations:
                    summands = [(v, -sign * self._ratio(r)) for v, r, sign in relation.terms if v not in step.unknown]
                    right.append(
                        [total(factor * self.gain[v][k] for v, factor in summands if k in self.gain[v]) for k in columns]
                    )
                solution = solve(self._matrix(step), right) if columns else [[] for _ in step.unknown]
                for row, variable in enumerate(step.unknown):
                    self.gain[variable] = dict(zip(columns, solution[row], strict=True))

    def _matrix(self, step: SolutionStep) -> list[list[Any]]:
        return [
            [total(s * self._ratio(ratio) for v, ratio, s in relation.terms if v == unknown) for unknown in step.unknown]
            for relation in step.relations
        ]

    def _act(self) -> None:
        """The outputs of sources and resistors, group by group."""
        place = 0
        for group in self.form.groups:
            ports = group.ports
            if group in self.dynamics.iterated:
                if place == self._stop:
                    self.balance = self._residual(ports, self._outputs[place])
                    return
                if place < len(self._outputs):
                    output = self._outputs[place]
                else:  # by iteration, at all times together
                    shapes = [np.shape(value) for value in (self.t, *self.state, *self._places.values())]
                    shape, where = np.broadcast_shapes(*shapes), loop_name(self.graph, ports)
                    output = settle(lambda outputs: self._residual(ports, outputs), len(ports), shape, where)  # noqa: B023
                    self._values.clear()
                place += 1
            elif ports[0].output in self.dynamics.closed:
                output = [self.value(port.output) for port in ports]
            elif group.loop or self._inverted(ports[0]):
                output = self._closed(ports)
            else:
                output = [self._own_output(port) for port in ports]
            for port, value in zip(ports, output, strict=True):
                self.outputs[self.form.column[port.output]] = value

    def _inverted(self, port: PortBond) -> bool:
        """True of a resistor whose curve gives the other than what is asked of it."""
        name = port.element.name
        return port.element.kind == "R" and self.graph.is_curve(name) and not self.graph.is_native(name, port.gives)

    def _own_output(self, port: PortBond) -> Any:
        """The output of an acting port that needs nothing of its own."""
        name, kind, law = port.element.name, port.element.kind, port.element.law
        if (kind in STORES and not isinstance(law, Law)) or (self._still and kind in SOURCES):  # or an inertia of 0
            return 0.0
        if kind != "R":
            return self._moving_effort(name, law) if isinstance(law, Law) and law.moving else self._law(name)
        argument = self.value(port.input)
        if self.graph.is_curve(name):
            return self._law(name, port.sign * argument) if port.gives == "e" else port.sign * self._law(name, argument)
        resistance = self._resistance(name)
        if port.gives == "e":
            return resistance * port.sign * argument
        if isinstance(resistance, float) and resistance == 0.0:
            raise GraphError(f"{self.graph.where(name)}: its resistance is 0 where its flow follows from its effort")
        return port.sign * argument / resistance

    def _resistance(self, name: str) -> Any:
        return self.graph.constant(name) if self.graph.is_linear(name) else self._law(name)

    def _residual(self, ports: Sequence[PortBond], outputs: Sequence[Any]) -> Balance:
        """The residual of the equations of resistors in a loop at their outputs, and its slopes."""
        columns = [self.form.column[p.output] for p in ports]
        for k, value in zip(columns, outputs, strict=True):
            self.outputs[k] = value
        self._values.clear()
        residual, slopes = [], []
        for port in ports:
            (left, sign), reads = self.form.sides(port)
            name, law = port.element.name, port.element.law
            if reads:
                assert isinstance(law, Function)
                own = next((factor * self.value(v) for n, (v, factor) in reads.items() if n == self.graph.own(name)), None)
                value, partials = self._partials(law, name, own)
                terms = [(reads[n][0], reads[n][1] * d) for n, d in zip(law.of, partials, strict=True) if n in reads]
            else:
                flow, resistance = port.input if port.gives == "e" else port.output, port.sign * self._resistance(name)
                value, terms = resistance * self.value(flow), [(flow, resistance)]
            residual.append(sign * self.value(left) - value)
            row = [total(a * self.gain[v].get(k, 0.0) for v, a in terms) for k in columns]
            slopes.append([sign * self.gain[left].get(k, 0.0) - slope for k, slope in zip(columns, row, strict=True)])
        return residual, slopes

    def _closed(self, ports: Sequence[PortBond]) -> list[Any]:
        """The outputs of linear resistors in a loop."""
        residual, slopes = self._residual(ports, [0.0] * len(ports))
        self._values.clear()
        try:
            return [row[0] for row in solve(slopes, [[0.0 - r] for r in residual])]
        except GraphError as error:
            raise unsolvable(self.graph, ports, error) from error

    def _store_rates(self) -> list[Any]:
        """The rates of momenta and displacements; on the way, what followers give."""
        form, last = self.form, len(self.form.stores) + len(self.form.acting)
        if self.dynamics.closed.keys() >= {p.output for p in form.followers} and not form.massless:
            return [self.own_rate(p) for p in form.stores]
        shares, bias = self._shares(), self._bias()
        for k, (port, weight) in enumerate(zip(form.followers, self.weights(), strict=True), start=last):
            led = total(g * shares[leader][0] for leader, g in self.gain[port.input].items() if leader in shares)
            self.outputs[k] = port.sign * weight * (bias.get(port.input, 0.0) + led)
        rates = []
        for k, port in enumerate(form.stores):
            if k not in shares:
                rates.append(self.own_rate(port))
            else:
                curved = self.graph.is_curve(port.element.name)
                rates.append(port.sense * (shares[k][1] if curved else self._constant(port) * shares[k][0]))
        return rates

    def own_rate(self, port: PortBond) -> Any:
        """The rate of a store that no other follows: an inertia's momentum by its effort, a compliance by its flow."""
        input_value = self.whole(port.input)
        return input_value if port.element.kind == "I" else port.sign * input_value

    def _shares(self) -> dict[int, tuple[Any, Any]]:
        """The rates of the output and of the momentum or displacement of every store that others follow."""
        places = self.dynamics.weighed
        matrix, force = self.mass_and_force()
        ports = [self.form.stores[k] for k in places]
        bending = [self.graph.is_curve(p.element.name) for p in ports]
        if not any(bending):
            return {k: (rate, None) for k, rate in zip(places, solve_symmetric(matrix, force), strict=True)}
        slopes = [self._slopes(p, self.state[k]) if b else {} for k, p, b in zip(places, ports, bending, strict=True)]
        at = {k: i for i, k in enumerate(places)}
        own = [1.0 if b else self.graph.constant(p.element.name) for p, b in zip(ports, bending, strict=True)]
        rows = []  # the unknowns are the rates of a curved store's own, and of what others give
        for i in range(len(places)):
            row: list[Any] = [0.0] * len(places)
            row[i] = 1.0 if bending[i] else 0.0
            for j, bent in enumerate(bending):
                mass = matrix[max(i, j)][min(i, j)]
                for k, slope in slopes[j].items() if bent else ((places[j], 1.0),):
                    row[at[k]] = row[at[k]] + mass * slope * (own[at[k]] if bent else 1.0)
            rows.append(row)
        shares = [row[0] for row in solve(rows, [[value] for value in force])]
        return {
            k: (
                total(slope * own[at[n]] * shares[at[n]] for n, slope in slopes[i].items()) if bending[i] else shares[i],
                shares[i],
            )
            for k, i in at.items()
        }

    def mass_and_force(self) -> tuple[list[list[Any]], list[Any]]:
        """M (lower triangle) and Q of M z' = Q for what the weighed stores give.

        A store of a curved law is without its own weight in M, for the slope of its law may be infinite.
        """
        form, places = self.form, self.dynamics.weighed
        at = {k: i for i, k in enumerate(places)}
        matrix: list[list[Any]] = [[0.0] * len(places) for _ in places]
        force: list[Any] = []
        for i, k in enumerate(places):
            port = form.stores[k]
            force.append(port.sign * self.value(port.input))
            if port.element.name not in form.massless and not self.graph.is_curve(port.element.name):
                matrix[i][i] = self.graph.constant(port.element.name)
        bias, weights = self._bias(), self.weights()
        for port, weight in zip(form.followers, weights, strict=True):
            gains = {at[k]: g for k, g in self.gain[port.input].items() if k in at}
            self._check_shares(port)
            for i, gain in gains.items():
                momentum = weight * gain
                force[i] = force[i] - momentum * bias.get(port.input, 0.0)
                for j, other in gains.items():
                    if j <= i:
                        matrix[i][j] = matrix[i][j] + momentum * other
        return matrix, force

    def _check_shares(self, port: PortBond) -> None:
        """Refuses a follower that follows resistors, or other followers: its numbers make more of it than its strokes.

        Their shares cancel by the structure: power is kept, so that what one side gives the other takes back.
        """
        first, last = len(self.form.stores), len(self.form.stores) + len(self.form.acting)
        cancelling = {first + k for k, p in enumerate(self.form.acting) if p.element.kind == "R"}
        on = [k for k in self.form.support[port.input] if k >= last or k in cancelling]
        shares = {k: self.gain[port.input].get(k, 0.0) for k in on}
        most = max((abs(g) for g in self.gain[port.input].values() if isinstance(g, float)), default=0.0)
        for k, share in shares.items():
            if isinstance(share, float) and abs(share) > _CANCELLED * most:
                other = self.form.followers[k - last] if k >= last else self.form.acting[k - first]
                where, leads = (self.graph.where(p.element.name) for p in (port, other))
                raise GraphError(f"{where} follows {leads}, which depends on it at the same instant: put a C or I between")

    def weights(self) -> list[Any]:
        """The inertia or compliance of every follower at its own momentum or displacement."""
        if self._weighed is None:
            self._weighed = [
                1 / self._slopes(p, self.followed(k))[-1]
                if k in self.dynamics.bending
                else self.graph.constant(p.element.name)
                for k, p in enumerate(self.form.followers)
            ]
        return self._weighed

    def followed(self, k: int) -> Any:
        """The momentum or displacement of a follower; of a field's port, of the store that stands for it."""
        port = self.form.followers[k]
        return self.inverse(port, self.value(port.input))

    def following(self) -> dict[str, Any]:
        """The momentum or displacement of every follower, by the name that it would have as a state."""
        form = self.form
        by_name = dict(zip(map(form.state_name, form.stores), self.state, strict=False))
        by_name |= {form.state_name(port): self.followed(k) for k, port in enumerate(form.followers)}
        for name, ties in reversed([*form.ties.items()]):  # the store is y_d + sum T y of the ports that are tied to it
            letter = "p" if self.graph.elements[name].kind == "I" else "q"
            for other, tie in ties:
                share = self.graph.constant(tie) * (-1.0 if letter == "p" else 1.0)
                by_name[f"{letter}_{name}"] = by_name[f"{letter}_{name}"] - share * by_name[f"{letter}_{other}"]
        return {form.state_name(port): by_name[form.state_name(port)] for port in form.followers}

    def inverse(self, port: PortBond, output: Any) -> Any:
        """The momentum (displacement) at which a store gives a flow (effort)."""
        name, law = port.element.name, port.element.law
        output = port.sense * output
        if not self.graph.is_curve(name):
            return self._constant(port) * output
        assert isinstance(law, Function)
        own = law.of.index(self.graph.own(name) or "")

        def equation(values: list[Any]) -> Balance:
            value, partials = self._partials(law, name, values[0])
            return [value - output], [[partials[own]]]

        try:  # from where its tangent at 0 leads, whatever its scale
            with np.errstate(all="ignore"):
                at_rest, partials = self._partials(law, name, 0.0 * output)
                near = (output - at_rest) / partials[own]
        except (GraphError, ArithmeticError):
            near = np.inf
        return settle(equation, 1, np.shape(output), self.graph.where(name), [near] if np.all(np.isfinite(near)) else None)[
            0
        ]

    def _bias(self) -> dict[int, Any]:
        """The rate by varying moduli and sources of the inputs of followers, and of all variables that these follow from."""
        if self._biased is not None:
            return self._biased
        steps = [self.form.steps[k] for k in self.dynamics.varying]
        needed = {v for step in steps for v in sources(step)} | {p.input for p in self.form.followers}
        bias: dict[int, Any] = {}
        for port in self.form.acting:
            if port.output in needed and port.element.kind in SOURCES:
                bias[port.output] = self._rate_of_source(port.element.name)
        for step in steps:
            if step.terms is not None:
                rates = [self._ratio(ratio) * bias.get(v, 0.0) for v, ratio in step.terms]
                rates += [self._ratio_rate(ratio) * self.value(v) for v, ratio in step.terms if not constant(ratio)]
                bias[step.unknown[0]] = total(rates)
            else:
                right = []
                for relation in step.relations:
                    varying = total(
                        -sign * self._ratio_rate(ratio) * self.value(v)
                        for v, ratio, sign in relation.terms
                        if not constant(ratio)
                    )
                    summands = [term for term in relation.terms if term[0] not in step.unknown]
                    right.append(
                        [varying + total(-sign * self._ratio(ratio) * bias.get(v, 0.0) for v, ratio, sign in summands)]
                    )
                solution = solve(self._matrix(step), right)
                for row, variable in enumerate(step.unknown):
                    bias[variable] = solution[row][0]
        self._biased = bias
        return bias


def by_rows(called: Callable[..., Any], arguments: Sequence[Any], results: int = 0) -> Any:
    """A law at numbers or arrays; one that branches, or uses functions of plain numbers, at one state after the other."""
    try:
        return called(*arguments)
    except (TypeError, ValueError):
        if not any(isinstance(a, np.ndarray) for a in arguments):
            raise
    shape = np.broadcast_shapes(*(np.shape(a) for a in arguments))
    rows = zip(*(np.broadcast_to(a, shape).ravel().tolist() for a in arguments), strict=True)
    values = np.array([called(*row) for row in rows], dtype=float)
    return tuple(c.reshape(shape) for c in values.reshape(-1, results).T) if results else values.reshape(shape)


def _here(position: Callable[[Any, Any, Any], Any], q: Any, anchor: Any) -> Here:
    return Here(q, position(q, np, anchor), np)


_NUMBERED = (*SOURCES, *STORES, "R", "TF", "GY")
Rates = Callable[..., tuple[Any, ...]]
PlainRates = Callable[[float, Sequence[float]], Sequence[float]]


@dataclass
class RateLog:
    """The number of evaluations of rates so far, and the last time, state and anchors at which they were not defined."""

    evaluations: int = 0
    undefined: tuple[float, list[float], Mapping[str, float]] | None = None


class Dynamics:
    """A graph ready to be evaluated.

    The state holds, in this order: of every store in integral causality its momentum (`p_` and the inertia's name) or
    displacement (`q_` and the spring's), in the order of the elements, and the displacements that are declared or that
    motions refer to (by name). Where inertias lie behind modulated transformers only, the flow before these is the state
    (`f_` and the 1-junction's name).

    Attributes:
        graph, signals, form: the graph, its signals as functions of time, and its formulation.
        names: those of the states, in order.
        moduli: varying ratios, and the two-ports' names.
        owner_of: displacement -> flow variable; displacement_of: 1-junction -> displacement.
        iterated: groups of ports whose laws are no straight lines in what they give.
        closed: variables of loops and followers of constants -> gains, rounded once.
        bending: places of followers whose own displacement or momentum is found by iteration.
        weighed: places of stores that others follow, or that have no inertia of their own.
        varying: places of the steps whose rates the followers need.

    >>> from bondgraph import Builder, C, I
    >>> b = Builder().one("mass", "translation", displacement="x").on("mass", I("m", 2.0), C("spring", stiffness=8.0))
    >>> dynamics = Dynamics(b.build())
    >>> dynamics.names
    ('p_m', 'q_spring', 'x')
    >>> dynamics.at(0.0, [6.0, 1.0, 1.0]).rates
    [-8.0, 3.0, 3.0]

    """

    def __init__(
        self, graph: BondGraph, signals: Mapping[str, Any] | None = None, formulation: Formulation | None = None
    ) -> None:
        self.graph = graph = as_graph(graph)
        self.signals = _checked_signals(graph, signals or {})
        self.form = Formulation(graph) if formulation is None else formulation
        form = self.form
        self.names = (*map(form.state_name, form.stores), *(d.name for d in form.displacements))
        laws = {id(e.law): e.name for e in form.graph.elements.values() if e.law is not None}
        moduli = {id(r): r for step in form.steps for r in ratios(step) if isinstance(r, Function | Modulus)}
        self.moduli = tuple((ratio, laws[key]) for key, ratio in moduli.items())
        self.owner_of = {d.name: form.variable(d.of) for d in form.displacements}
        self.displacement_of = {d.of: d.name for d in reversed(form.displacements)}
        self.iterated = tuple(group for group in form.groups if self._bends(group))
        self.closed = exact_gains(form)
        self.bending = frozenset(k for k, p in enumerate(form.followers) if form.graph.is_curve(p.element.name))
        self.weighed = form.weighed
        self.varying = form.upstream({p.input for p in form.followers})
        self._check_rates()

    def _bends(self, group: OutputGroup) -> bool:
        """True if outputs are found by iteration: a curve in a loop, or one that is asked for its inverse."""
        form, ports = self.form, group.ports
        curved = [p for p in ports if form.graph.is_curve(p.element.name)]
        moving = [p for p in ports if isinstance(p.element.law, Law)]
        if group.loop and moving:
            where = form.graph.title(moving[0].element.name)
            raise GraphError(f"{where} depends on a flow without inertia: give it as a resistor, or add inertia")
        reads = [p for p in ports if any(form.read(p, name) is not None for name in getattr(p.element.law, "of", ()))]
        if all(isinstance(p.element.law, Function) and p.element.law.is_affine for p in {*curved, *reads}):
            return False
        return (
            bool(curved or reads) if group.loop else any(not form.graph.is_native(p.element.name, p.gives) for p in curved)
        )

    def _check_rates(self) -> None:
        """Refuses a modulus whose rate a follower needs, and that varies with what a follower gives."""
        form, graph = self.form, self.form.graph
        last = len(form.stores) + len(form.acting)
        needed = {id(r) for k in self.varying for r in ratios(form.steps[k])}
        settled = {p.output for p in form.stores}
        for ratio, name in self.moduli:
            for displacement in graph.depends_on(name):
                read = graph.reading(displacement)
                if read is not None and read[0] in "fe":
                    if form.read_variable(*read) not in settled:
                        raise GraphError(
                            f"{graph.where(name)} reads {displacement}, which no store gives from its state: a modulus may "
                            "read such alone"
                        )
                    if id(ratio) in needed:
                        follower = next(p for p in form.followers if name in form.through(p.input))
                        raise GraphError(
                            f"{graph.where(name)}: the rate of {displacement} is needed, for a store follows by it, "
                            f"{graph.where(follower.element.name)}: let it read a displacement or a signal, or put a spring "
                            "between"
                        )
                if id(ratio) not in needed:
                    continue
                on = form.support[self.owner_of[displacement]] if displacement in self.owner_of else ()
                if any(k >= last for k in on):
                    raise GraphError(
                        f"{graph.where(name)} varies with {displacement}, whose rate a store in derivative causality gives: "
                        f"attach an I or R to {form.name_of(self.owner_of[displacement])}"
                    )

    def __reduce__(self) -> tuple[Any, ...]:
        return Dynamics, (self.graph, self.signals)

    def at(self, t: Any, state: Sequence[Any], anchors: Mapping[str, Any] | None = None) -> GraphInstant:
        """Flows, efforts and rates at a time t (s) and a state (numbers, or arrays of the same shape, one per name).

        `anchors` gives, by 1-junction, the displacement in the middle of the smooth piece that laws of motion are in.
        """
        return Walk(self, t, state, anchors or {}).instant()

    def stored(self, port: PortBond, value: float) -> float:
        """The momentum (displacement) at which a store gives a flow (effort)."""
        return float(Walk(self, 0.0, [0.0] * len(self.names), {}, acts=False).inverse(port, value))

    def branches(self, state: Sequence[float]) -> Iterator[str]:
        """Yields a line for each loop of resistors whose laws have several solutions at a state, and the one kept."""
        walk = Walk(self, 0.0, state, {})
        for group in self.iterated:
            ports = group.ports
            kept = [walk.outputs[self.form.column[p.output]] for p in ports]
            roots = solutions(lambda values, ports=ports: walk._residual(ports, values), len(ports))  # type: ignore[misc]
            walk._residual(ports, kept)
            if len(roots) > 1:
                what, first = ("flow", "effort")[ports[0].gives == "e"], sorted(one[0] for one in roots)
                yield (
                    f"{loop_name(self.graph, ports)}: the {what} of {self.graph.title(ports[0].element.name)} has several "
                    f"solutions, {', '.join(f'{x:.6g}' for x in first)}, sought from "
                    f"{', '.join(f'{x:g}' for x in SOUGHT)} on; the motion begins with {kept[0]:.6g}"
                )

    @property
    def anchored(self) -> tuple[str, ...]:
        """The 1-junctions that motions refer to: those whose anchors matter, in the order that `rates` takes them."""
        return self.graph.motions

    @cached_property
    def rates(self) -> Rates:
        """(t, *state, *anchors) -> rates of the state, recorded as straight-line code; of many linear ones a matrix."""
        if self.bending:
            return self._evaluated
        if len(self.names) >= MANY and self.linear is not None:
            matrix, constant, _ = self.linear
            return lambda t, *values: (matrix @ np.array(values) + constant).tolist()
        groups = self.iterated
        if not groups:
            return self._recorded(Walk.rates)
        balances = [self._recorded(_flat, k + 1, k) for k in range(len(groups))]
        rates = self._recorded(Walk.rates, len(groups))
        last: list[list[Any] | None] = [None] * len(groups)

        def iterated(t: Any, *values: Any) -> tuple[Any, ...]:
            outputs: tuple[Any, ...] = ()
            for k, group in enumerate(groups):
                size, balance, before = len(group.ports), balances[k], outputs

                def equations(trial: list[Any]) -> Balance:
                    rest = balance(t, *values, *before, *trial)  # noqa: B023 - called at once
                    return list(rest[:size]), [list(rest[size * j : size * (j + 1)]) for j in range(1, size + 1)]  # noqa: B023

                settled = settle(equations, size, (), loop_name(self.graph, group.ports), last[k])
                last[k], outputs = settled, (*outputs, *settled)
            return rates(t, *values, *outputs)

        return iterated

    def within(
        self, log: RateLog, anchors: Mapping[str, float] = MappingProxyType({}), last: float = math.inf
    ) -> PlainRates:
        """(t, state) -> rates in plain numbers, within one smooth piece; not a number where a law is not defined.

        `anchors` gives the middle of the piece, as for `at`; without it laws switch where they are. From the piece's end on
        the time is `last`, just before: a law that jumps there is still on its branch.
        """
        rates, finite, undefined = self.rates, math.isfinite, (math.nan,) * len(self.names)
        places = [(junction, self.names.index(self.displacement_of[junction])) for junction in self.anchored]

        def at(t: float, values: Sequence[float]) -> Sequence[float]:
            log.evaluations += 1
            t = t if t < last else last
            try:
                slopes = rates(t, *values, *[anchors.get(j, values[k]) for j, k in places]) if places else rates(t, *values)
            except (ValueError, ArithmeticError, TypeError):
                slopes = undefined
            if not finite(sum(slopes)) and finite(sum(values)):
                log.undefined = t, [*values], anchors
            return slopes

        return at

    @cached_property
    def linear(self) -> tuple[Array, Array, float] | None:
        """A and b of the rates A x + b of a graph of constants, and the greatest |eigenvalue| of A, 1/s.

        A is that of the graph without its sources, so that no digit of it is lost.
        """
        if self.bending or not all(self.graph.is_linear(e.name) for e in self.graph.of_kind(*_NUMBERED)):
            return None
        size = len(self.names)
        constant = Walk(self, 0.0, [0.0] * size, {}).rates()
        rows = [np.broadcast_to(row, size) for row in Walk(self, 0.0, list(np.eye(size)), {}, still=True).rates()]
        matrix = np.array(rows, dtype=float).reshape(size, size)
        return matrix, np.array(constant, dtype=float), float(np.abs(np.linalg.eigvals(matrix)).max(initial=0.0))

    def _evaluated(self, t: Any, *values: Any) -> tuple[Any, ...]:
        """The rates, walked anew at every state."""
        count = len(self.names)
        anchors = dict(zip(self.anchored, values[count:], strict=True))
        return tuple(Walk(self, t, values[:count], anchors).rates())

    def _recorded(self, what: Callable[[Walk], Sequence[Any]], groups: int = 0, stop: int | None = None) -> Rates:
        """The results of a walk as straight-line code of (t, *state, *anchors, *outputs of the first iterated groups)."""
        count, recorder = len(self.names), Recorder()
        sizes = [len(g.ports) for g in self.iterated[:groups]]
        t, *values = (recorder.input(str(k)) for k in range(1 + count + len(self.anchored) + sum(sizes)))
        anchors = dict(zip(self.anchored, values[count:], strict=False))
        inputs, first = [], count + len(self.anchored)
        for size in sizes:
            inputs.append(values[first : first + size])
            first += size
        return recorder.program(what(Walk(self, t, values[:count], anchors, inputs, stop))).function("math")


def _flat(walk: Walk) -> list[Any]:
    """Residual and slopes of the group that a walk stopped at."""
    assert walk.balance is not None
    residual, slopes = walk.balance
    return residual + [slope for row in slopes for slope in row]


def _checked_signals(graph: BondGraph, signals: Mapping[str, Any]) -> dict[str, Function]:
    declared = ", ".join(graph.signals) or "none"
    faults = [f"no signal {name!r}: the graph declares {declared}" for name in signals if name not in graph.signals]
    faults += [
        f"signal {name!r} has no function of t: signals={{{name!r}: ...}}" for name in graph.signals if name not in signals
    ]
    checked = {}
    for name, signal in signals.items():
        if not (callable(signal) or is_symbolic(signal) or isinstance(signal, Real)):
            faults.append(f"signal {name!r}: found {signal!r}, expected a number, a function of t or a SymPy expression")
            continue
        varies = not isinstance(signal, Real) and (callable(signal) or bool(signal.free_symbols))
        checked[name] = function(signal if varies else lambda t, value=float(signal): value + 0.0 * t)
        if len(checked[name].of) > 1:
            faults.append(f"signal {name!r}: found a function of {', '.join(checked[name].of)}, expected one of t")
    refuse(faults)
    return checked
