"""The equations of motion of a graph in numbers: from a state to its rates, and to every flow and effort.

`Walk` is one evaluation: gains, the flows that no inertia weighs, accelerations, efforts. It is written once against
arithmetic and calls of laws, so that it runs on floats, on arrays (many states at once, for the power audit), on SymPy
expressions, and on a recording of itself as straight-line code, which is what time stepping runs. The equations are those of
`bondgraph.motion.formulation`; `Tables` holds what a walk looks up, found once for a graph.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import Element, Here, Law, Modulus, Motion
from bondgraph.graph import BondGraph, Ratio, Scale, Solve, Sum, as_graph
from bondgraph.laws import OWN, OWN_DISPLACEMENT, OWN_FLOW, TIME, Function, GraphError, function, is_symbolic, refuse
from bondgraph.motion.algebra import Balance, settle, solve, solve_symmetric, total
from bondgraph.motion.formulation import Formulation, Port, ratios
from bondgraph.recording import Recorded, Recorder


class Tables(NamedTuple):
    """What a walk looks up, found once for a graph."""

    form: Formulation
    signals: Mapping[str, Function]
    moduli: tuple[tuple[Any, str], ...]  # varying ratios and the transformers' names
    support: tuple[tuple[int, ...], ...]  # by flow variable, the coordinates that it depends on
    owner_of: Mapping[str, int]  # displacement -> flow variable
    displacement_of: Mapping[str, str]  # 1-junction -> displacement
    inertias: tuple[tuple[float, int], ...]
    springs: tuple[Port, ...]
    imposed: tuple[Element, ...]
    acting: tuple[int, ...]  # places in `form.ports` whose effort a law gives
    partner: Mapping[int, int]  # gyrator's bond -> flow variable at its other side
    static: frozenset[int]
    iterated: bool  # a massless flow meets a resistor whose law is no straight line
    loose: str  # the flows that no inertia weighs, by name
    anchored: tuple[str, ...]


def tables(form: Formulation, signals: Mapping[str, Function]) -> Tables:
    """Look everything up that does not change from state to state."""
    graph = form.graph
    elements = {id(e.law): e.name for e in graph.elements.values() if e.law is not None}
    curved = [p for p in form.ports if p.element.kind == "R" and graph.is_curve(p.element.name)]
    partner: dict[int, int] = {}
    for gyrator in graph.of_kind("GY"):
        into, out = graph.ends(gyrator.name)
        partner |= {into.number: form.flow[out.number], out.number: form.flow[into.number]}
    moduli = {id(r): r for step in form.steps for r in ratios(step) if isinstance(r, Function | Modulus)}
    return Tables(
        form=form,
        signals=signals,
        moduli=tuple((ratio, elements[key]) for key, ratio in moduli.items()),
        support=tuple(form.support[v] for v in range(len(form.support))),
        owner_of={d.name: form.variable(d.of) for d in form.displacements},
        displacement_of={d.of: d.name for d in reversed(form.displacements)},
        inertias=tuple(
            (graph.constant(p.element.name), p.variable) for p in form.ports if p.element.kind == "I" and p.element.law
        ),
        springs=tuple(p for p in form.ports if p.element.kind == "C" and not isinstance(p.element.law, Law)),
        imposed=tuple(p.element for p in form.ports if p.element.kind == "Sf"),
        acting=tuple(k for k, p in enumerate(form.ports) if p.element.kind in ("Se", "C", "R", "GY")),
        partner=partner,
        static=form.static,
        iterated=any(k in form.support[p.variable] for p in curved for k in form.massless),
        loose=", ".join(form.name_of(form.coordinates.all[k]) for k in form.massless),
        anchored=graph.motions,
    )


Anchors = Mapping[str, Any]


class Instant(NamedTuple):
    """A graph at one time, or at many.

    flows: of every flow variable. rates: of the state. efforts: of every port, in the order of `Formulation.ports`, an
    inertia's with its own acceleration in it, None for a source of flow. moduli: of every transformer, by name.
    """

    flows: list[Any]
    rates: list[Any]
    efforts: list[Any]
    moduli: dict[str, Any]


class Walk:
    """The state, and what follows from it step by step."""

    def __init__(self, tables: Tables, t: Any, state: Sequence[Any], anchors: Anchors, massless: Any = None) -> None:
        self.tables, self.form, self.graph = tables, tables.form, tables.form.graph
        self.t, self.anchors = t, anchors
        moving, displacements = len(self.form.coordinates.moving), self.form.displacements
        self._moving = list(state[:moving])
        self._places: dict[str, Any] = {TIME: t}
        for displacement, value in zip(displacements, state[moving:], strict=False):
            self._places[displacement.name] = value
        self._stretch = {
            p.element.name: q for p, q in zip(tables.springs, state[moving + len(displacements) :], strict=True)
        }
        self._motions: dict[int, tuple[Any, Any]] = {}
        self.moduli: dict[int, tuple[Any, tuple[tuple[str, Any], ...]]] = {}
        for name, signal in tables.signals.items():
            self._places[name] = self._call(signal, [t] * len(signal.of))
        self._gain()
        imposed = [self._law(source.name) for source in tables.imposed]
        self._settle(imposed, massless)

    def rates(self) -> list[Any]:
        """The rates of the state."""
        accelerations, _ = self._accelerations()
        return self._state_rates(accelerations)

    def instant(self) -> Instant:
        """Flows, rates of the state, efforts."""
        accelerations, bias = self._accelerations()
        efforts = []
        for number, port in enumerate(self.form.ports):
            if port.element.kind == "I":
                gains = self.gain[port.variable].items()
                rate = bias[port.variable] + total(g * accelerations[k] for k, g in gains if k < len(accelerations))
                efforts.append(self.graph.constant(port.element.name) * port.sign * rate)
            else:
                efforts.append(self._efforts.get(number))
        moduli = {name: self.moduli[id(ratio)][0] for ratio, name in self.tables.moduli}
        return Instant(self.flow, self._state_rates(accelerations), efforts, moduli)

    def _state_rates(self, accelerations: list[Any]) -> list[Any]:
        displaced = [self.flow[self.tables.owner_of[d.name]] for d in self.form.displacements]
        return accelerations + displaced + [p.sign * self.flow[p.variable] for p in self.tables.springs]

    def _call(self, called: Callable[..., Any], arguments: Sequence[Any], results: int = 0) -> Any:
        """Call a law, or take it down where the walk is being recorded; `results` is the length of the tuple it gives."""
        node = next((a for a in arguments if isinstance(a, Recorded)), None)
        if node is not None:
            return node.recorder.through(called, arguments, results)
        try:
            return called(*arguments)
        except (TypeError, ValueError):  # a law that branches, or uses functions of plain numbers, takes one at a time
            if not any(isinstance(a, np.ndarray) for a in arguments):
                raise
            shape = np.broadcast_shapes(*(np.shape(a) for a in arguments))
            rows = zip(*(np.broadcast_to(a, shape).ravel().tolist() for a in arguments), strict=True)
            found = np.array([called(*row) for row in rows], dtype=float)
            return tuple(c.reshape(shape) for c in found.reshape(-1, results).T) if results else found.reshape(shape)

    def _arguments(self, law: Function, name: str, own: Any = None) -> list[Any]:
        element = self.graph.elements[name]
        own_name = OWN.get(element.kind)
        values = []
        for argument in law.of:
            if argument == own_name:
                values.append(own)
            elif argument in self.graph.parameters:
                values.append(self.graph.parameter(argument, name))
            else:
                values.append(self._places[argument])
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
        speed = self.flow[self.form.variable(law.motion.of)]
        own = self.flow[self.form.variable(name)]

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
        """Call an element's law; where it is not defined, say whose it is."""
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
        found = self._motions.get(id(motion))
        if found is None:
            q = self._places[self.tables.displacement_of[motion.of]]
            anchor = self.anchors.get(motion.of, q)
            here = self._call(_here, (motion.position, q, anchor))
            found = self._motions[id(motion)] = here, self._call(_here, (motion.position, anchor, anchor))
        return found

    def _modulus(self, ratio: Modulus | Function, name: str) -> tuple[Any, tuple[tuple[str, Any], ...]]:
        """A transformer's ratio, and its partial derivatives by the names that it depends on."""
        if isinstance(ratio, Function):
            value, partials = self._partials(ratio, name)
            return value, tuple((n, p) for n, p in zip(ratio.of, partials, strict=True) if n not in self.graph.parameters)
        here = self._both(ratio.motion)[0]
        of = self.tables.displacement_of[ratio.motion.of]
        value, slope = (self._call(lambda at, pick=pick: pick(at.position), (here,)) for pick in (ratio.value, ratio.slope))
        return value, ((of, slope),)

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
        if name in self.tables.owner_of:
            return self.flow[self.tables.owner_of[name]]
        signal = self.tables.signals[name]
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
        """Of every flow variable, {coordinate: gain}."""
        for ratio, name in self.tables.moduli:
            self.moduli[id(ratio)] = self._modulus(ratio, name)
        self.gain: list[dict[int, Any]] = [{} for _ in self.tables.support]
        for k, variable in enumerate(self.form.coordinates.all):
            self.gain[variable] = {k: 1.0}
        for step in self.form.steps:
            if isinstance(step, Scale):
                ratio = self._ratio(step.ratio)
                self.gain[step.target] = {k: ratio * g for k, g in self.gain[step.source].items()}
            elif isinstance(step, Sum):
                self.gain[step.target] = {
                    k: total(sign * self.gain[v][k] for v, sign in step.terms if k in self.gain[v])
                    for k in self.tables.support[step.target]
                }
            else:
                columns, right = self.tables.support[step.unknown[0]], []
                for relation in step.relations:
                    known = [(v, -sign * self._ratio(r)) for v, r, sign in relation.terms if v not in step.unknown]
                    right.append(
                        [total(factor * self.gain[v][k] for v, factor in known if k in self.gain[v]) for k in columns]
                    )
                solution = solve(self._matrix(step), right)
                for row, variable in enumerate(step.unknown):
                    self.gain[variable] = dict(zip(columns, solution[row], strict=True))

    def _matrix(self, step: Solve) -> list[list[Any]]:
        return [
            [total(s * self._ratio(ratio) for v, ratio, s in relation.terms if v == unknown) for unknown in step.unknown]
            for relation in step.relations
        ]

    def _flows(self) -> None:
        u = self.coordinates
        self.flow = [total(g * u[k] for k, g in gains.items()) for gains in self.gain]

    def _settle(self, imposed: list[Any], massless: list[Any] | None) -> None:
        """All flows; the massless ones, if they are not given, from their equations."""
        size = len(self.form.massless)

        def equations(flows: list[Any]) -> Balance:
            self.coordinates = self._moving + flows + imposed
            self._flows()
            return self.balance()

        if massless is None and self.tables.iterated:
            known = [self.t, *self._moving, *self._stretch.values(), *self._places.values()]
            shape = np.broadcast_shapes(*(np.shape(value) for value in known))
            massless = settle(equations, size, shape, self.tables.loose)
        if massless is None and size:
            residual, slopes = equations([0.0] * size)
            massless = [row[0] for row in solve(slopes, [[0.0 - r] for r in residual])]
        self.coordinates = self._moving + (massless or []) + imposed
        self._flows()

    def balance(self) -> Balance:
        """Residual of the massless equations (their rate, where springs alone hold the flow), and its slopes."""
        order = self.form.massless
        residual: list[Any] = [0.0] * len(order)
        slopes: list[list[Any]] = [[0.0] * len(order) for _ in order]
        for port in (self.form.ports[number] for number in self.tables.acting):
            gains = self.gain[port.variable]
            for row, k in enumerate(order):
                static = k in self.tables.static
                if k not in gains or (static and port.element.kind in ("R", "GY")):
                    continue
                effort, answering, answer = self._static_reaction(port) if static else self._reaction(port)
                weight = port.sign * gains[k]
                residual[row] = residual[row] + weight * effort
                for column, j in enumerate(order):
                    if j in self.gain[answering]:
                        slopes[row][column] = slopes[row][column] + weight * answer * self.gain[answering][j]
        return residual, slopes

    def held(self, k: int) -> dict[str, Any]:
        """What springs and sources do to the equation of a flow that springs alone hold, by kind and name."""
        ports = [p for p in self.form.ports if p.element.kind in ("Se", "C") and k in self.gain[p.variable]]
        return {f"{p.element.symbol}:{p.element.name}": p.sign * self.gain[p.variable][k] * self._effort(p) for p in ports}

    def _reaction(self, port: Port) -> tuple[Any, int, Any]:
        """The effort of a port, the flow variable that it answers to, and its slope."""
        if port.element.kind == "R":
            effort, slope = self._resistor(port)
            return effort, port.variable, slope * port.sign
        if port.element.kind == "GY":
            modulus = self._law(port.element.name)
            return modulus * self.flow[self.tables.partner[port.bond]], self.tables.partner[port.bond], modulus
        law = port.element.law
        if isinstance(law, Law) and law.moving:
            where = self.graph.title(port.element.name)
            raise GraphError(f"{where} depends on a flow that no inertia weighs: give it as a resistor, or add inertia")
        return self._effort(port), port.variable, 0.0

    def _static_reaction(self, port: Port) -> tuple[Any, int, Any]:
        """The same for the rate of a port's effort: of springs and sources."""
        if port.element.kind == "C" and port in self.tables.springs:
            name, law = port.element.name, port.element.law
            if self.graph.is_linear(name):
                stiffness = 1.0 / self.graph.constant(name)
            else:
                assert isinstance(law, Function)
                stiffness = self._partials(law, name, self._stretch[name])[1][law.of.index(OWN_DISPLACEMENT)]
            return stiffness * port.sign * self.flow[port.variable], port.variable, stiffness * port.sign
        return self._rate_of_source(port.element.name), port.variable, 0.0

    def _resistor(self, port: Port) -> tuple[Any, Any]:
        """E and de/df of a resistor, for the flow into it."""
        name, own = port.element.name, port.sign * self.flow[port.variable]
        law = port.element.law
        if isinstance(law, Function) and OWN_FLOW in law.of:
            value, partials = self._partials(law, name, own)
            return value, partials[law.of.index(OWN_FLOW)]
        resistance = self.graph.constant(name) if self.graph.is_linear(name) else self._law(name)
        return resistance * own, resistance

    def _effort(self, port: Port) -> Any:
        """The effort of a port that its law gives from flows and positions: all but inertias and flow sources."""
        kind, name = port.element.kind, port.element.name
        if kind == "R":
            own = port.sign * self.flow[port.variable]
            return self._law(name, own) if self.graph.is_curve(name) else self._resistor(port)[0]
        if kind == "GY":
            return self._law(name) * self.flow[self.tables.partner[port.bond]]
        if kind == "C" and name in self._stretch:
            return self.spring(name, self._stretch[name])
        return self._law(name)

    def spring(self, name: str, q: Any) -> Any:
        """The effort of a spring at a displacement of its own."""
        return q / self.graph.constant(name) if self.graph.is_linear(name) else self._law(name, q)

    def _accelerations(self) -> tuple[list[Any], list[Any]]:
        """The rates of the moving coordinates, and of every flow variable the part that these do not make."""
        matrix, force, bias = self.mass_and_force()
        return solve_symmetric(matrix, force), bias

    def mass_and_force(self) -> tuple[list[list[Any]], list[Any], list[Any]]:
        """M (lower triangle) and Q of M u' = Q, and every flow variable's rate at u' = 0."""
        size = len(self.form.coordinates.moving)
        bias = self._bias([self._rate_of_source(source.name) for source in self.tables.imposed])
        matrix: list[list[Any]] = [[0.0] * size for _ in range(size)]
        force: list[Any] = [0.0] * size
        for inertia, variable in self.tables.inertias:
            gains = self.gain[variable]
            for i in (k for k in gains if k < size):
                momentum = inertia * gains[i]
                force[i] = force[i] - momentum * bias[variable]
                for j in (k for k in gains if k <= i):
                    matrix[i][j] = matrix[i][j] + momentum * gains[j]
        self._efforts = {number: self._effort(self.form.ports[number]) for number in self.tables.acting}
        for number, effort in self._efforts.items():
            port = self.form.ports[number]
            for i, g in self.gain[port.variable].items():
                if i < size:
                    force[i] = force[i] - port.sign * effort * g
        return matrix, force, bias

    def _bias(self, imposed: list[Any]) -> list[Any]:
        """What varying moduli and imposed flows make of every flow's rate."""
        bias: list[Any] = [0.0] * len(self.tables.support)
        for variable, rate in zip(self.form.coordinates.imposed, imposed, strict=True):
            bias[variable] = rate
        for step in self.form.steps:
            if isinstance(step, Scale):
                rate = self._ratio_rate(step.ratio)
                bias[step.target] = self._ratio(step.ratio) * bias[step.source] + rate * self.flow[step.source]
            elif isinstance(step, Sum):
                bias[step.target] = total(sign * bias[source] for source, sign in step.terms)
            else:
                right = []
                for relation in step.relations:
                    varying = total(-sign * self._ratio_rate(ratio) * self.flow[v] for v, ratio, sign in relation.terms)
                    known = [term for term in relation.terms if term[0] not in step.unknown]
                    right.append([varying + total(-sign * self._ratio(ratio) * bias[v] for v, ratio, sign in known)])
                solution = solve(self._matrix(step), right)
                for row, variable in enumerate(step.unknown):
                    bias[variable] = solution[row][0]
        return bias


def _here(position: Callable[[Any, Any, Any], Any], q: Any, anchor: Any) -> Here:
    return Here(q, position(q, np, anchor), np)


Rates = Callable[..., tuple[Any, ...]]
_BALANCED = 1e-9  # of the greatest effort


class State(NamedTuple):
    """What the state of a graph consists of: names, in order, and how many are flows, displacements and springs'."""

    names: tuple[str, ...]
    flows: int
    displacements: int


class Dynamics:
    """A graph ready to be evaluated.

    The state holds, in this order: the independent flows that inertia weighs (`f_` and the 1-junction's name), the
    displacements that are declared or that motions refer to (by name), and the springs' own (`q_` and the spring's name).

    >>> from bondgraph import Builder, C, I
    >>> b = Builder().one("mass", "translation", displacement="x").on("mass", I("m", 2.0), C("spring", stiffness=8.0))
    >>> dynamics = Dynamics(b.build())
    >>> dynamics.state.names
    ('f_mass', 'x', 'q_spring')
    >>> dynamics.at(0.0, [0.0, 1.0, 1.0]).rates
    [-4.0, 0.0, 0.0]

    """

    def __init__(self, graph: BondGraph, signals: Mapping[str, Any] | None = None) -> None:
        self.graph = graph = as_graph(graph)
        self.signals = _checked_signals(graph, signals or {})
        self.form = Formulation(graph)
        self.tables = tables(self.form, self.signals)
        moving = self.form.coordinates.moving
        names = [f"f_{self.form.name_of(v)}" for v in moving]
        names += [d.name for d in self.form.displacements]
        names += [f"q_{p.element.name}" for p in self.tables.springs]
        self.state = State(tuple(names), len(moving), len(self.form.displacements))

    def __reduce__(self) -> tuple[Any, ...]:
        return Dynamics, (self.graph, self.signals)

    def at(self, t: Any, state: Sequence[Any], anchors: Mapping[str, Any] | None = None) -> Instant:
        """Flows, efforts and rates at a time t (s) and a state (numbers, or arrays of the same shape, one per name).

        `anchors` gives, by 1-junction, the displacement in the middle of the smooth piece that laws of motion are in.
        """
        return Walk(self.tables, t, state, anchors or {}).instant()

    def unbalanced(self, state: Sequence[float]) -> list[str]:
        """What keeps a state from being a start: springs alone hold a flow, and their efforts do not balance there."""
        if not self.tables.static:
            return []
        walk, faults = Walk(self.tables, 0.0, state, {}), []
        for k in sorted(self.tables.static):
            held = walk.held(k)
            off, most = abs(sum(held.values())), max(abs(effort) for effort in held.values())
            if off > _BALANCED * most:
                where, names = self.form.name_of(self.form.coordinates.all[k]), ", ".join(held)
                faults.append(
                    f"{names} alone hold the flow of {where}, and their efforts there are off balance by {off:.6g} at the "
                    "start: give initial displacements that balance"
                )
        return faults

    @property
    def anchored(self) -> tuple[str, ...]:
        """The 1-junctions that motions refer to: those whose anchors matter, in the order that `rates` takes them."""
        return self.tables.anchored

    @cached_property
    def rates(self) -> Rates:
        """(t, *state, *anchors) -> rates of the state, recorded as straight-line code."""
        if not self.tables.iterated:
            return self._recorded(Walk.rates)
        size = len(self.form.massless)  # of flows that are iterated first, from where they were last

        def flat(walk: Walk) -> list[Any]:
            residual, slopes = walk.balance()
            return residual + [slope for row in slopes for slope in row]

        balance, rates = self._recorded(flat, size), self._recorded(Walk.rates, size)
        last: list[float] | None = None

        def iterated(t: Any, *values: Any) -> tuple[Any, ...]:
            nonlocal last

            def equations(flows: list[Any]) -> Balance:
                found = balance(t, *values, *flows)
                return list(found[:size]), [list(found[size * k : size * (k + 1)]) for k in range(1, size + 1)]

            last = settle(equations, size, (), self.tables.loose, last)
            return rates(t, *values, *last)

        return iterated

    def _recorded(self, what: Callable[[Walk], Sequence[Any]], massless: int = 0) -> Rates:
        """What follows from a walk as straight-line code of (t, *state, *anchors, *massless flows)."""
        count, recorder = len(self.state.names), Recorder()
        t, *values = (recorder.input(str(k)) for k in range(1 + count + len(self.anchored) + massless))
        anchors = dict(zip(self.anchored, values[count:], strict=False))
        given = values[len(values) - massless :] if massless else None
        return recorder.program(what(Walk(self.tables, t, values[:count], anchors, given))).function("math")


def _checked_signals(graph: BondGraph, signals: Mapping[str, Any]) -> dict[str, Function]:
    declared = ", ".join(graph.signals) or "none"
    faults = [f"no signal {name!r}: the graph declares {declared}" for name in signals if name not in graph.signals]
    faults += [
        f"signal {name!r} has no function of t: signals={{{name!r}: ...}}" for name in graph.signals if name not in signals
    ]
    found = {}
    for name, given in signals.items():
        if not (callable(given) or is_symbolic(given) or isinstance(given, Real)):
            faults.append(f"signal {name!r}: found {given!r}, expected a number, a function of t or a SymPy expression")
            continue
        varies = not isinstance(given, Real) and (callable(given) or bool(given.free_symbols))
        found[name] = function(given if varies else lambda t, value=float(given): value + 0.0 * t)
        if len(found[name].of) > 1:
            faults.append(f"signal {name!r}: found a function of {', '.join(found[name].of)}, expected one of t")
    refuse(faults)
    return found
