"""The junction structure of a graph by its causal strokes: what gives every variable, and in which order they follow.

Causality (`bondgraph.strokes`) says of every one-port whether it gives its flow or its effort. These outputs z are known one
after the other, and all other flows and efforts w follow from them through junctions and two-ports,

    w = S(q, t) z,   with the power of all ports adding up to 0.

Stores in integral causality give from their state (`p_NAME`, `q_NAME`), sources and resistors by their laws. A resistor that
needs itself, through others or not, is part of a loop that is solved as one. A store in derivative causality follows the
integral ones and sources.

No step divides by a modulus that may vanish, unless strokes leave nothing else: what loops leave over is a linear system in
blocks as small as can be. Where an inertia that alone weighs a motion lies behind a modulated transformer, the flow before
the transformer is the state, without an inertia of its own, so that dead centres are ordinary positions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import (
    ONE_PORTS,
    OWN_EFFORT,
    SOURCES,
    Displacement,
    Element,
    Function,
    GraphError,
    I,
    Law,
    Modulus,
    function,
    refuse,
)
from bondgraph.graph import (
    BondGraph,
    Relation,
    SolutionStep,
    constant,
    new_bond,
    places,
    plan,
    ratios,
    relations,
    sources,
    variables,
)
from bondgraph.motion.algebra import eliminated
from bondgraph.numerics import components, reached_from
from bondgraph.strokes import Causality, causality

_SINGULAR = 1e-12


class PortBond(NamedTuple):
    """A one-port's bond: sign +1 if power flows into the element, and its variables: its output and its input.

    `gives` is "f" or "e".
    """

    element: Element
    bond: int
    sign: float
    gives: str
    output: int
    input: int

    @property
    def sense(self) -> float:
        """The sign of what a store gives by its state: that of the bond for an inertia, whose state counts by the bond."""
        return self.sign if self.element.kind == "I" else 1.0


class OutputGroup(NamedTuple):
    """Acting ports whose outputs follow at once: one by one, or, in a loop, together."""

    ports: tuple[PortBond, ...]
    loop: bool


class Formulation:
    """A graph's variables, the elements that give them, and their order.

    Attributes:
        source, graph: the graph; and with an additional inertia of 0 at a junction whose flow is a state (`massless`).
        follows: store in derivative causality -> the stores that it follows, and the elements between.
        flow, effort: bond number -> variable; flows come before efforts.
        ports: every one-port, in the order of the elements.
        stores: those whose state is one of the graph's.
        acting: sources and resistors, and stores whose output a motion or a value of 0 determines.
        followers: stores in derivative causality.
        groups: the order of the outputs of `acting` ports.
        column: variable -> its place among the outputs: of stores, acting ports, followers.
        steps: computation of the other variables, in order; support: variable -> the columns that it depends on.
        ties: port of a field in derivative causality -> the other ports that its store follows, each with its transformer.
        displacements: the declared ones, and one for each further 1-junction that a motion refers to.

    """

    def __init__(self, graph: BondGraph, strokes: Causality | None = None) -> None:
        refuse(
            f"{graph.where(name)} is switched: take one of its modes, mode(graph, {name}=True)" for name in graph.switched
        )
        self.source = graph
        self.massless: tuple[str, ...] = ()
        rewritten, assignment, self.ties = without_shared_followers(graph, strokes or causality(graph))
        self._written(rewritten, assignment)
        for junction in self.divided() if strokes is None else ():
            self._move_state(junction)
        self.displacements = tuple(displacements(graph))

    @classmethod
    def along(cls, graph: BondGraph, junction: str) -> Formulation:
        """The formulation with the flow of a 1-junction as a state of its own, if it can be one."""
        form = cls(graph)
        if all(bond.tail != junction for bond in form.graph.bonds if bond.head in form.massless):
            form._move_state(junction)
        return form

    def of(self, graph: BondGraph) -> Formulation:
        """The same formulation of a graph with the same structure."""
        form = object.__new__(Formulation)
        form.source, form.massless, form.displacements, form.ties = graph, self.massless, self.displacements, self.ties
        own = {name: e for name, e in self.graph.elements.items() if e is not self.source.elements.get(name)}
        elements = {**graph.elements, **own}
        form._written(replace(graph, elements=elements, bonds=self.graph.bonds), self.strokes)
        return form

    def _written(self, graph: BondGraph, strokes: Causality) -> None:
        """All attributes from the strokes."""
        refuse(strokes.conflicts)
        self.graph, self.strokes, self.follows = graph, strokes, strokes.follows
        self.flow = variables(graph, "1")
        first = len(set(self.flow.values()))
        self.effort = {bond: first + v for bond, v in variables(graph, "0").items()}
        ports = []
        for element in graph.of_kind(*ONE_PORTS):
            bond = graph.bond_of(element.name)
            flow, effort = self.flow[bond.number], self.effort[bond.number]
            gives_flow = strokes.strokes[bond.number] == element.name
            pair = (flow, effort) if gives_flow else (effort, flow)
            ports.append(PortBond(element, bond.number, bond.sign(element.name), "f" if gives_flow else "e", *pair))
        self.ports = tuple(ports)
        integral = [p for p in self.ports if p.element.name in strokes.integral and not isinstance(p.element.law, Law)]
        derivative = [p for p in self.ports if p.element.name in strokes.derivative]
        self.stores = tuple(p for p in integral if p.element.law != 0.0 or p.element.name in self.massless)
        self.followers = tuple(p for p in derivative if p.element.law != 0.0 and not isinstance(p.element.law, Law))
        settled = {p.element.name for p in (*self.stores, *self.followers)}
        self.acting = tuple(p for p in self.ports if p.element.name not in settled)
        outputs = [p.output for p in (*self.stores, *self.acting, *self.followers)]
        self.column = {variable: k for k, variable in enumerate(outputs)}
        self._plan()
        # acting ports in an order in which each finds what it needs, loops as one
        last, needs = len(self.stores) + len(self.acting), dict[int, set[int]]()
        for k, port in enumerate(self.acting):
            on = {c for v in self.reads(port) for c in self.support[v] if c < last}
            needs[k] = {c - len(self.stores) for c in on if c >= len(self.stores)}
        groups = components(needs)
        self.groups = tuple(
            OutputGroup(tuple(self.acting[k] for k in group), len(group) > 1 or group[0] in needs[group[0]])
            for group in groups
        )

    def _plan(self) -> None:
        """Steps from the outputs to all other variables."""
        graph = self.graph
        waiting = relations(graph, self.flow, "0") + relations(graph, self.effort, "1")
        for gyrator in graph.of_kind("GY"):
            ratio: Any = graph.constant(gyrator.name) if graph.is_linear(gyrator.name) else gyrator.law
            into, out = (b.number for b in graph.ends(gyrator.name))
            for answer, cause in ((self.effort[out], self.flow[into]), (self.effort[into], self.flow[out])):
                waiting.append(Relation(gyrator.name, ((answer, 1.0, 1.0), (cause, ratio, -1.0))))
        waiting = [r._replace(terms=tuple(term for term in r.terms if term[1] != 0.0)) for r in waiting]
        determined = set(self.column)
        every = {*self.flow.values(), *self.effort.values()}
        self.steps: list[SolutionStep] = []
        self.steps += plan(waiting, determined)
        for block in _blocks(graph, waiting, every - determined):
            if block.unknown[0] in determined:
                continue
            _check_rank(graph, block)
            if not sources(block) and any(isinstance(ratio, Function | Modulus) for ratio in ratios(block)):
                names = ", ".join(dict.fromkeys(self.name_of(v) for v in block.unknown))
                at = ", ".join(dict.fromkeys(places(graph, block.relations)))
                raise GraphError(f"over-constrained: {at} lock {names}, which can only be zero: remove one of them")
            self.steps.append(block)
            determined.update(block.unknown)
            waiting = [r for r in waiting if r not in block.relations]
            self.steps += plan(waiting, determined)
        self.support: dict[int, tuple[int, ...]] = {variable: (k,) for variable, k in self.column.items()}
        for step in self.steps:
            on = {k for v in sources(step) for k in self.support[v]}
            self.support |= dict.fromkeys(step.unknown, tuple(sorted(on)))

    @property
    def weighed(self) -> tuple[int, ...]:
        """The places of stores that others follow, or that have no inertia of their own."""
        places = {p.element.name: k for k, p in enumerate(self.stores)}
        near = {k: {places[n] for n in self.graph.coupled(p.element.name)} for k, p in enumerate(self.stores)}
        tied = {k for p in self.followers for k in self.support[p.input] if k < len(self.stores)}
        tied = {other for k in tied for other in reached_from(k, near)}
        return tuple(sorted(tied | {places[name] for name in self.massless}))

    def divided(self) -> list[str]:
        """The 1-junctions whose flows follow by a division by a modulus, from inertias behind it."""
        groups = []
        for step in self.steps:
            if step.terms is not None or len(step.unknown) > 1 or len(step.relations[0].terms) != 2:
                continue
            (target,), relation = step.unknown, step.relations[0]
            ratio = next(r for v, r, _ in relation.terms if v == target)
            if constant(ratio) or self.graph.elements[relation.name].kind != "TF" or target not in self.flow.values():
                continue
            bond = self.graph.ends(relation.name)[0]
            junction = bond.tail
            if self.graph.elements[junction].kind == "1" and self.flow[bond.number] == target:
                groups.append(junction)
        return list(dict.fromkeys(groups))

    def _move_state(self, junction: str) -> None:
        """Makes the flow of a 1-junction a state of its own, in place of an inertia behind it, where causality allows it."""
        name = _starred(self.graph.elements, f"{junction}*")
        elements, bonds = {**self.graph.elements, name: I(name, 0.0)}, self.graph.bonds
        more = replace(self.graph, elements=elements, bonds=(*bonds, new_bond(bonds, junction, name)))
        preferences = dict.fromkeys((*self.massless, name), "integral")
        assignment = causality(more, preferences)
        moved = set(self.strokes.integral) - set(assignment.integral)
        if assignment.conflicts or name not in assignment.integral or len(assignment.integral) != len(self.strokes.integral):
            return
        if any(more.elements[n].kind != "I" for n in moved):
            return
        self.massless = (*self.massless, name)
        self._written(more, assignment)

    def variable(self, name: str) -> int:
        """The flow variable of an element: of a two-port, that of the bond that enters it."""
        return self.flow[self.graph.bond_of(name).number]

    def name_of(self, variable: int) -> str:
        """The name of a flow or effort variable: that of its junction, else of its bond."""
        kind, by = ("1", self.flow) if variable in self.flow.values() else ("0", self.effort)
        bond = next(b for b in self.graph.bonds if by[b.number] == variable)
        junctions = [n for n in (bond.tail, bond.head) if self.graph.elements[n].kind == kind]
        return junctions[0] if junctions else f"bond {bond.number}"

    def state_name(self, port: PortBond) -> str:
        """The name of the state of a store."""
        if port.element.name in self.massless:
            return f"f_{self.name_of(port.output)}"
        return f"{'p' if port.element.kind == 'I' else 'q'}_{port.element.name}"

    def flow_state(self, junction: str) -> int | None:
        """The place of the store that alone settles the flow of a 1-junction; None if there is none, or no such junction."""
        element = self.graph.elements.get(junction)
        on = self.support[self.variable(junction)] if element is not None and element.kind == "1" else ()
        alone = len(on) == 1 and on[0] < len(self.stores) and self.stores[on[0]].element.kind == "I"
        return on[0] if alone else None

    def through(self, variable: int) -> list[str]:
        """The two-ports by which a variable follows from outputs."""
        names, todo, seen = dict[str, None](), [variable], set[int]()
        while todo:
            target = todo.pop()
            for step in self.steps if target not in seen else ():
                if target not in step.unknown:
                    continue
                todo += [v for v in sources(step) if v not in self.column]
                names |= {r.name: None for r in step.relations if self.graph.elements[r.name].kind in ("TF", "GY")}
            seen.add(target)
        return list(names)

    def reads(self, port: PortBond) -> tuple[int, ...]:
        """The variables that the law of an acting port depends on at the same instant."""
        law, kind = port.element.law, port.element.kind
        if isinstance(law, Law):
            speed, own = self.variable(law.motion.of), self.flow[port.bond]
            seen = {"speed": speed, "flow": own}
            return tuple(v for name, v in seen.items() if law.moving and name in law.sees)
        read = [v for name in getattr(law, "of", ()) if (v := self.read(port, name)) is not None]
        return (*((port.input,) if kind == "R" else ()), *read)

    def sides(self, port: PortBond) -> tuple[tuple[int, float], dict[str, tuple[int, float]]]:
        """The quantity that the law of an acting port gives, and those that it reads at the same instant, by name.

        Each is a variable with its sign in the law: of a resistor e = law(f), or f = law(e) where its law reads its effort.
        """
        effort, flow = (port.output, port.input) if port.gives == "e" else (port.input, port.output)
        own, law = self.graph.own(port.element.name), port.element.law
        reads = {n: (v, 1.0) for n in getattr(law, "of", ()) if (v := self.read(port, n)) is not None}
        if own == OWN_EFFORT:
            return (flow, port.sign), {own: (effort, 1.0), **reads}
        if own is not None:
            reads[own] = flow, port.sign
        return (effort if port.element.kind == "R" else port.output, 1.0), reads

    def read(self, port: PortBond, name: str) -> int | None:
        """The variable that a law reads under a name; None if it reads none, but a state or what is declared."""
        if name == self.graph.own(port.element.name):
            return None
        signal = self.graph.reading(name)
        return None if signal is None or signal[0] in "pq" else self.read_variable(*signal)

    def read_variable(self, letter: str, bond: int) -> int:
        """The flow f or effort e of a bond."""
        return (self.flow if letter == "f" else self.effort)[bond]

    def upstream(self, goals: set[int]) -> tuple[int, ...]:
        """The places of the steps that variables follow by."""
        needed, collected = set(goals), list[int]()
        for k in reversed(range(len(self.steps))):
            if needed.intersection(self.steps[k].unknown):
                collected.append(k)
                needed.update(sources(self.steps[k]))
        return tuple(reversed(collected))


def displacements(graph: BondGraph) -> Iterator[Displacement]:
    """The declared displacements, and one for each further 1-junction that a motion refers to."""
    yield from graph.displacements.values()
    declared = {d.of for d in graph.displacements.values()}
    for junction in graph.motions:
        if junction not in declared:
            yield Displacement(junction, junction)


def _starred(taken: Container[str], name: str) -> str:
    """The name with as many stars behind it as it takes to be new."""
    while name in taken:
        name += "*"
    return name


def _check_rank(graph: BondGraph, block: SolutionStep) -> None:
    """Refuses a system that its numbers make singular; moduli count as numbers in no relation to each other."""
    numbers: dict[int, float] = {}
    matrix = np.zeros((len(block.unknown),) * 2)
    for row, relation in enumerate(block.relations):
        for variable, ratio, sign in relation.terms:
            if variable in block.unknown:
                constant = isinstance(ratio, float | int)
                value = float(ratio) if constant else numbers.setdefault(id(ratio), math.sqrt(2.3 + len(numbers)))  # type: ignore[arg-type]
                matrix[row, block.unknown.index(variable)] += sign * value
    matrix /= np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), 1e-300)
    if np.linalg.matrix_rank(matrix, rtol=_SINGULAR) < len(matrix):
        raise GraphError(_contradiction(graph, block.relations))


Ties = Mapping[str, Sequence[tuple[str, str]]]


def without_shared_followers(graph: BondGraph, strokes: Causality) -> tuple[BondGraph, Causality, Ties]:
    """The graph with every port of a linear field that is in derivative causality as a store of its own, and its strokes.

    With e = K q of the ports and d the port, E = 1/2 q^T K q is 1/2 K_dd (q_d + T q)^2 + 1/2 q^T (K - K_d K_d^T/K_dd) q over
    the others, T = K_d/K_dd: a store 1/K_dd that transformers join to the others' bonds, which keep states and causality.
    An inertia's are the same with flow and effort exchanged.
    """
    following = [name for name in strokes.derivative if graph.coupled(name)]
    if strokes.conflicts or not following:
        return graph, strokes, {}
    import sympy  # type: ignore[import-untyped]

    near = {e.name: graph.coupled(e.name) for e in graph.of_kind("I", "C")}
    fields = {name: sorted(reached_from(name, near)) for name in following}
    slopes = {places: slope for names in fields.values() for places, slope in _slopes(graph, names).items()}
    elements, bonds = dict(graph.elements), list(graph.bonds)

    def added(element: Element) -> str:
        name = _starred(elements, element.name)
        elements[name] = element._replace(name=name)
        return name

    def before(port: str, kind: str) -> str:
        """A junction between a port and its bond."""
        place = next(k for k, b in enumerate(bonds) if b.head == port)
        junction = added(Element(kind, f"{port}*"))
        bonds[place] = bonds[place]._replace(head=junction)
        bonds.append(new_bond(bonds, junction, port))
        return junction

    beside: dict[str, str] = {}
    ties: dict[str, list[tuple[str, str]]] = {}
    for name in following:
        pivot, inertia = slopes[name, name], elements[name].kind == "I"
        others = [n for n in fields[name] if n != name and (n, name) in slopes and slopes[n, name] != 0]
        store = before(name, "1" if inertia else "0") if others else name
        for n in others:
            ratio = slopes[n, name] / pivot
            if n not in beside:
                beside[n] = before(n, "0" if inertia else "1")
            tie = added(Element("TF", f"{n}->{name}", _law_of(-ratio if inertia else ratio)))
            ties.setdefault(name, []).append((n, tie))
            for tail, head in ((store, tie), (tie, beside[n])) if inertia else ((beside[n], tie), (tie, store)):
                bonds.append(new_bond(bonds, tail, head))
            for m in others:
                slopes[n, m] = _less(slopes[n, m], ratio * slopes[name, m])
        elements[name] = elements[name]._replace(law=_law_of(1 / pivot))
        slopes = {places: slope for places, slope in slopes.items() if name not in places}
    letter = {name: "p" if elements[name].kind == "I" else "q" for names in fields.values() for name in names}
    for n in {one for one, _ in slopes}:
        terms = {m: slope for (one, m), slope in slopes.items() if one == n and slope != 0}
        if set(terms) == {n}:
            law = _law_of(1 / terms[n])
        else:
            names = {m: letter[m] if m == n else f"{letter[m]}_{m}" for m in terms}
            law = function(sum(slope * sympy.Symbol(names[m]) for m, slope in terms.items()))
        elements[n] = elements[n]._replace(law=law)
    rewritten = replace(graph, elements=elements, bonds=tuple(bonds))
    preferences = dict.fromkeys(strokes.integral, "integral") | dict.fromkeys(strokes.derivative, "derivative")
    return rewritten, causality(rewritten, preferences), ties


def _slopes(graph: BondGraph, names: Sequence[str]) -> dict[tuple[str, str], Any]:
    """The slopes of the laws of a linear field's ports by one another's states."""
    import sympy

    kinds = {graph.elements[n].kind for n in names}
    letter = "p" if kinds == {"I"} else "q"
    symbols = {n: sympy.Symbol(f"{letter}_{n}", real=True) for n in names}
    slopes: dict[tuple[str, str], Any] = {}
    for n in names:
        law = graph.elements[n].law
        assert isinstance(law, Function)
        value = law.symbolic({graph.own(n) or "": symbols[n], **{f"{letter}_{m}": s for m, s in symbols.items() if m != n}})
        slopes |= {(n, m): value.diff(s) for m, s in symbols.items()}
    curved = [s for slope in slopes.values() for s in slope.free_symbols if s in symbols.values()]
    outward = [n for n in names if graph.bond_of(n).head != n]
    if len(kinds) > 1 or curved or outward or any(slopes[n, m] != slopes[m, n] for n, m in slopes):
        where = ", ".join(graph.where(n) for n in names)
        raise GraphError(
            f"{where} share one energy, and one of them follows other stores or sources, which only a field of a symmetric "
            "matrix may: put an R, or a store of the other kind, between"
        )
    return slopes


def _less(slope: Any, other: Any) -> Any:
    """The difference of two slopes; 0 where nothing but rounding is left of it, which would tie ports that are apart."""
    import sympy

    left = slope - other
    if other.free_symbols:
        return left if sympy.cancel(sympy.nsimplify(left, rational=True)) != 0 else sympy.S.Zero
    return left if abs(left) > _SINGULAR * abs(other) else sympy.S.Zero


def _law_of(expression: Any) -> Any:
    """A law of parameters, or a number."""
    return function(expression) if expression.free_symbols else float(expression)


def _contradiction(graph: BondGraph, relations: Sequence[Relation]) -> str:
    named = ", ".join(dict.fromkeys(places(graph, relations)))
    return (
        f"over-constrained: {named} contradict or repeat the conditions of the others on the same flows and efforts: "
        "remove one of them, or change a ratio"
    )


def _blocks(graph: BondGraph, waiting: Sequence[Relation], unknown: Collection[int]) -> list[SolutionStep]:
    """The equations that local steps leave, as the smallest linear systems, in the order of their solution."""
    can = [[v for v, ratio, _ in r.terms if v in unknown and ratio != 0.0] for r in waiting]
    owner: dict[int, int] = {}  # unknown variable -> the relation that gives it

    def augment(k: int, seen: set[int]) -> bool:
        for variable in can[k]:
            if variable not in seen:
                seen.add(variable)
                if variable not in owner or augment(owner[variable], seen):
                    owner[variable] = k
                    return True
        return False

    left = [r for k, r in enumerate(waiting) if not augment(k, set())]
    if left or len(owner) < len(unknown):
        raise GraphError(_contradiction(graph, left or waiting))
    gives = {k: variable for variable, k in owner.items()}
    needs = {k: {owner[v] for v in can[k] if owner[v] != k} for k in gives}
    return [
        SolutionStep(tuple(sorted(gives[k] for k in group)), tuple(waiting[k] for k in group)) for group in components(needs)
    ]


def exact_gains(form: Formulation) -> dict[int, dict[int, float]]:
    """Gains of variables in loops of constant resistors, of those that constant followers give, and of all after them.

    Leaks of 1e20 ohm beside 1 ohm, or a great store that follows a small one, leave no digit to a solution in floats: both
    are solved in fractions, and rounded once.
    """
    loops = [(group.ports, [_line(form, port) for port in group.ports]) for group in form.groups if group.loop]
    if not any(all(lines) for _, lines in loops) and not form.followers:
        return {}
    gain = {variable: {k: Fraction(1)} for variable, k in form.column.items()}
    unit = {variable: {variable: Fraction(1)} for variable in form.support}

    def combined(terms: Iterable[tuple[int, Fraction]], of: Mapping[int, Mapping[int, Fraction]]) -> dict[int, Fraction]:
        gains: dict[int, Fraction] = {}
        for v, factor in terms:
            for k, share in of[v].items():
                gains[k] = gains.get(k, Fraction()) + factor * share
        return {k: share for k, share in gains.items() if share}

    for step in form.steps:
        terms, made = [term for r in step.relations for term in r.terms], step.unknown
        if all(isinstance(ratio, float | int) and (v in gain or v in made) for v, ratio, _ in terms):
            rows = [[(v, int(sign) * Fraction(ratio)) for v, ratio, sign in r.terms] for r in step.relations]  # type: ignore[arg-type]
            own = [combined(((v, a) for v, a in row if v in made), unit) for row in rows]
            gain |= eliminated(own, [combined(((v, -a) for v, a in row if v not in made), gain) for row in rows])
    closed = set[int]()

    def put(outputs: Mapping[int, Mapping[int, Fraction]]) -> None:
        for v in [v for v, shares in gain.items() if outputs.keys() & shares.keys()]:
            with_inputs = {**outputs, **{k: {k: Fraction(1)} for k in gain[v] if k not in outputs}}
            gain[v] = combined(gain[v].items(), with_inputs)
            closed.add(v)

    for ports, lines in loops:
        if not all(line and gain.keys() >= {v for v, _ in line} for line in lines):
            continue
        columns = {form.column[p.output] for p in ports}
        whole = [combined(line, gain) for line in lines]
        inside = [{k: a for k, a in row.items() if k in columns} for row in whole]
        try:
            put(eliminated(inside, [{k: -a for k, a in row.items() if k not in columns} for row in whole]))
        except GraphError as error:
            raise unsolvable(form.graph, ports, error) from error
    put(_followed(form, gain, combined))
    return {v: {k: float(share) for k, share in gain[v].items()} for v in closed}


def _followed(form: Formulation, gain: Mapping[int, Any], combined: Callable[..., dict[int, Fraction]]) -> Any:
    """The gains of what followers give, if they and their leaders are constants throughout; else none.

    With y' = G z the rates of the leading stores' states and z' = S y' those of what they give, a follower of inertia or
    compliance w gives w g z'. The rate of a source's law has a column of its own behind those of all outputs.
    """
    graph, first, places = form.graph, len(form.stores), form.weighed
    last, ports = first + len(form.acting), [form.stores[k] for k in places]
    if form.massless or not gain.keys() >= {p.input for p in (*ports, *form.followers)}:
        return {}
    driven = {k for p in form.followers for k in gain[p.input] if k >= first}
    acting = {k: form.acting[k - first] if k < last else form.followers[k - last] for k in driven}
    if any(p.element.kind not in SOURCES or isinstance(p.element.law, Law) for p in acting.values()):
        return {}
    at: dict[str | None, int] = {form.state_name(p): k for k, p in zip(places, ports, strict=True)}
    varying = {k: k + len(form.column) for k, p in acting.items() if not isinstance(p.element.law, float)}
    slopes = {k: {rate: Fraction(1)} for k, rate in varying.items()}  # of what a store gives by the states, or a source
    for k, port in zip(places, ports, strict=True):
        law, name, sign = port.element.law, port.element.name, port.sense
        if (constant := _number(graph, name)) is not None:
            slopes[k] = {k: Fraction(sign) / Fraction(constant)}
        elif isinstance(law, Function) and law.is_affine and (at := at | {graph.own(name) or "": k}).keys() >= {*law.of}:
            slopes[k] = {
                at[n]: Fraction(sign * s) for n, s in zip(law.of, law.partials(*[0.0] * len(law.of))[1], strict=True)
            }
        else:
            return {}
    gives: dict[int, dict[int, Fraction]] = {}  # column of a follower -> its shares of the leaders' rates
    for k, port in enumerate(form.followers, last):
        if (weight := _number(graph, port.element.name)) is None:
            return {}
        gives[k] = combined(
            ((c, Fraction(port.sign * weight) * g) for c, g in gain[port.input].items() if c < first or c in varying), slopes
        )
    rows, right = [], []
    for k, port in zip(places, ports, strict=True):
        sign = 1 if port.element.kind == "I" else int(port.sign)
        shares = {c: sign * g for c, g in gain[port.input].items()}
        row = combined([(-1, Fraction(1)), *((c, -g) for c, g in shares.items() if c >= last)], {**gives, -1: {k: 1}})
        rows.append({c: g for c, g in row.items() if c < first})
        right.append({c: g for c, g in shares.items() if c < last} | {c: -g for c, g in row.items() if c >= first})
    try:
        rates = eliminated(rows, right)
    except GraphError:  # inertias that cancel: refused where the rates are asked for
        return {}
    rates |= {rate: {rate: Fraction(1)} for rate in varying.values()}
    return {c: combined(shares.items(), rates) for c, shares in gives.items()}


def _number(graph: BondGraph, name: str) -> float | None:
    """An element's constant; None if it has another law, or is a symbol."""
    constant = graph.constant(name) if graph.is_linear(name) else None
    return constant if isinstance(constant, float) else None


def _line(form: Formulation, port: PortBond) -> list[tuple[int, Fraction]]:
    """The terms of variables whose sum is 0 by a resistor's law, if that is a straight line of numbers; else none."""
    law, ((left, sign), reads) = port.element.law, form.sides(port)
    if port.element.kind == "R" and (resistance := _number(form.graph, port.element.name)) is not None:
        flow = port.input if port.gives == "e" else port.output
        return [(left, Fraction(1)), (flow, -Fraction(port.sign * resistance))]
    if port.element.kind != "R" or not isinstance(law, Function) or not law.is_affine or reads.keys() != {*law.of}:
        return []
    value, slopes = law.partials(*[0.0] * len(law.of))
    terms = [(reads[n][0], Fraction(reads[n][1] * slope)) for n, slope in zip(law.of, slopes, strict=True)]
    return [] if value else [(left, Fraction(-sign)), *terms]


def loop_name(graph: BondGraph, ports: Sequence[PortBond]) -> str:
    """The name of a loop of resistors in an error."""
    return ", ".join(graph.where(p.element.name) for p in ports)


def unsolvable(graph: BondGraph, ports: Sequence[PortBond], error: GraphError) -> GraphError:
    """The error of a loop of resistors whose equations are singular."""
    return GraphError(f"the loop of {loop_name(graph, ports)} has no solution, or more than one: {error}")
