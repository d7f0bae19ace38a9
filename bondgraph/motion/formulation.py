"""A graph's equations by its causal strokes: what each element gives, and every flow and effort as a sum of these.

Causality (`bondgraph.strokes`) says of every one-port whether it gives its flow or its effort. These outputs z are known one
after the other, and all other flows and efforts w follow from them through junctions and two-ports,

    w = S(q, t) z,   with the power of all ports adding up to 0.

Stores in integral causality give from their state (`p_NAME`, `q_NAME`), sources and resistors by their laws. A resistor that
needs itself, through others or not, is part of a loop that is solved as one. A store in derivative causality follows the
integral ones and sources: it is folded in by its gains, M z' = Q with M = W + S^T D S.

No step divides by a modulus that may vanish, unless strokes leave nothing else: what loops leave over is a linear system in
blocks as small as can be. Where an inertia that alone weighs a motion lies behind a modulated transformer, the flow before
the transformer is the state, without an inertia of its own, so that dead centres are ordinary positions.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import ONE_PORTS, Displacement, Element, I, Law, Modulus
from bondgraph.graph import (
    Bond,
    BondGraph,
    Ratio,
    Relation,
    Scale,
    Solve,
    Step,
    Sum,
    constant,
    effort_relations,
    effort_variables,
    entry,
    flow_relations,
    flow_variables,
    places,
    plan,
)
from bondgraph.laws import Function, GraphError, function, refuse
from bondgraph.numerics import components, reached_from
from bondgraph.strokes import Causality, causality

_SINGULAR = 1e-12


class Port(NamedTuple):
    """A one-port's bond: sign +1 if power flows into the element, and its variables: what it gives, what it is given.

    `gives` is "f" or "e".
    """

    element: Element
    bond: int
    sign: float
    gives: str
    output: int
    input: int


class Group(NamedTuple):
    """Places in `Formulation.acting` whose outputs follow at once: one by one, or, in a loop, together."""

    members: tuple[int, ...]
    loop: bool


class Formulation:
    """A graph's variables, who gives them, and in which order.

    Attributes:
        graph: the graph; with an inertia of 0 more at a junction whose flow is a state of its own (`massless`).
        strokes: its causality.
        flow, effort: bond number -> variable; flows come before efforts.
        ports: every one-port, in the order of the elements.
        stores: those whose state is one of the graph's.
        acting: sources and resistors, and stores that a motion or a value of 0 settles.
        followers: stores in derivative causality.
        groups: the order in which `acting` ports give.
        column: variable -> its place among the outputs: of stores, acting ports, followers.
        steps: how the other variables follow, in order; support: variable -> the columns that it depends on.
        ties: port of a field in derivative causality -> the other ports that its store follows, each with its transformer.
        displacements: the declared ones, and one for each further 1-junction that a motion refers to.

    """

    def __init__(self, graph: BondGraph, strokes: Causality | None = None) -> None:
        refuse(
            f"{graph.where(name)} is switched: take one of its modes, mode(graph, {name}=True)" for name in graph.switched
        )
        self.given = graph
        self.massless: tuple[str, ...] = ()
        rewritten, found, self.ties = without_shared_followers(graph, strokes or causality(graph))
        self._written(rewritten, found)
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
        form.given, form.massless, form.displacements, form.ties = graph, self.massless, self.displacements, self.ties
        own = {name: e for name, e in self.graph.elements.items() if e is not self.given.elements.get(name)}
        elements = {**graph.elements, **own}
        form._written(replace(graph, elements=elements, bonds=self.graph.bonds), self.strokes)
        return form

    def variable(self, name: str) -> int:
        """The flow variable of an element: of a two-port, that of the bond that enters it."""
        return self.flow[entry(self.graph, name).number]

    def name_of(self, variable: int) -> str:
        """The name of a flow or effort variable: that of its junction, else of its bond."""
        kind, by = ("1", self.flow) if variable in self.flow.values() else ("0", self.effort)
        bond = next(b for b in self.graph.bonds if by[b.number] == variable)
        junctions = [n for n in (bond.tail, bond.head) if self.graph.elements[n].kind == kind]
        return junctions[0] if junctions else f"bond {bond.number}"

    def state_name(self, port: Port) -> str:
        """The name of the state of a store."""
        if port.element.name in self.massless:
            return f"f_{self.name_of(port.output)}"
        return f"{'p' if port.element.kind == 'I' else 'q'}_{port.element.name}"

    def flow_state(self, junction: str) -> int | None:
        """The place of the store that alone settles the flow of a 1-junction, through fixed ratios if any."""
        on = self.support[self.variable(junction)]
        alone = len(on) == 1 and on[0] < len(self.stores) and self.stores[on[0]].element.kind == "I"
        return on[0] if alone else None

    def through(self, variable: int) -> list[str]:
        """The two-ports by which a variable follows from outputs."""
        names, todo, seen = dict[str, None](), [variable], set[int]()
        while todo:
            target = todo.pop()
            for origin, step in zip(self.origins, self.steps, strict=True) if target not in seen else ():
                if target not in targets(step):
                    continue
                todo += [v for v in sources(step) if v not in self.column]
                names |= {n: None for n in origin if self.graph.elements[n].kind in ("TF", "GY")}
            seen.add(target)
        return list(names)

    def _written(self, graph: BondGraph, strokes: Causality) -> None:
        """All attributes from the strokes."""
        refuse(strokes.conflicts)
        self.graph, self.strokes = graph, strokes
        self.flow = flow_variables(graph)
        first = len(set(self.flow.values()))
        self.effort = {bond: first + v for bond, v in effort_variables(graph).items()}
        self.ports = tuple(self._port(e) for e in graph.of_kind(*ONE_PORTS))
        integral = [p for p in self.ports if p.element.name in strokes.integral and not isinstance(p.element.law, Law)]
        derivative = [p for p in self.ports if p.element.name in strokes.derivative]
        self.stores = tuple(p for p in integral if p.element.law != 0.0 or p.element.name in self.massless)
        self.followers = tuple(p for p in derivative if p.element.law != 0.0 and not isinstance(p.element.law, Law))
        settled = {p.element.name for p in (*self.stores, *self.followers)}
        self.acting = tuple(p for p in self.ports if p.element.name not in settled)
        outputs = [p.output for p in (*self.stores, *self.acting, *self.followers)]
        self.column = {variable: k for k, variable in enumerate(outputs)}
        self._plan()
        self.groups = tuple(self._ordered())

    def _port(self, element: Element) -> Port:
        bond = self.graph.bond_of(element.name)
        flow, effort = self.flow[bond.number], self.effort[bond.number]
        gives_flow = self.strokes.strokes[bond.number] == element.name
        pair = (flow, effort) if gives_flow else (effort, flow)
        return Port(element, bond.number, bond.sign(element.name), "f" if gives_flow else "e", *pair)

    def _plan(self) -> None:
        """Steps from the outputs to all other variables."""
        graph = self.graph
        waiting = flow_relations(graph, self.flow) + effort_relations(graph, self.effort)
        for gyrator in graph.of_kind("GY"):
            ratio: Any = graph.constant(gyrator.name) if graph.is_linear(gyrator.name) else gyrator.law
            into, out = (b.number for b in graph.ends(gyrator.name))
            for answer, cause in ((self.effort[out], self.flow[into]), (self.effort[into], self.flow[out])):
                waiting.append(Relation(gyrator.name, ((answer, 1.0, 1.0), (cause, ratio, -1.0))))
        waiting = [r._replace(terms=tuple(term for term in r.terms if term[1] != 0.0)) for r in waiting]
        known = set(self.column)
        every = {*self.flow.values(), *self.effort.values()}
        self.steps: list[Step] = []
        self.origins: list[tuple[str, ...]] = []
        self._extend(waiting, known)
        for block in _blocks(graph, waiting, every - known):
            if block.unknown[0] in known:
                continue
            _check_rank(graph, block)
            if not sources(block) and any(isinstance(ratio, Function | Modulus) for ratio in ratios(block)):
                names = ", ".join(dict.fromkeys(self.name_of(v) for v in block.unknown))
                at = ", ".join(dict.fromkeys(places(graph, block.relations)))
                raise GraphError(f"over-constrained: {at} lock {names}, which can only be zero: remove one of them")
            self.steps.append(block)
            self.origins.append(tuple(r.name for r in block.relations))
            known.update(block.unknown)
            waiting = [r for r in waiting if r not in block.relations]
            self._extend(waiting, known)
        self.support: dict[int, tuple[int, ...]] = {variable: (k,) for variable, k in self.column.items()}
        for step in self.steps:
            on = {k for v in sources(step) for k in self.support[v]}
            self.support |= dict.fromkeys(targets(step), tuple(sorted(on)))

    def _extend(self, waiting: list[Relation], known: set[int]) -> None:
        before = list(waiting)
        steps = plan(waiting, known)
        left = [r for r in before if r not in waiting]
        for step in steps:
            (target,), from_ = targets(step), set(sources(step))
            relation = next(r for r in left if {v for v, _, _ in r.terms} == {target, *from_})
            left.remove(relation)
            self.steps.append(step)
            self.origins.append((relation.name,))

    def untold(self, port: Port) -> list[int]:
        """Columns that what a follower is given cannot depend on: of resistors and followers, whose shares cancel.

        The structure alone does not give it: power is kept, so that what one side gives the other takes back.
        """
        first, last = len(self.stores), len(self.stores) + len(self.acting)
        of_resistors = {first + k for k, p in enumerate(self.acting) if p.element.kind == "R"}
        return [k for k in self.support[port.input] if k >= last or k in of_resistors]

    def reads(self, port: Port) -> tuple[int, ...]:
        """The variables that the law of an acting port depends on at the same instant."""
        law, kind = port.element.law, port.element.kind
        if isinstance(law, Law):
            speed, own = self.variable(law.motion.of), self.flow[port.bond]
            seen = {"speed": speed, "flow": own}
            return tuple(v for name, v in seen.items() if law.moving and name in law.sees)
        read = [v for name in getattr(law, "of", ()) if (v := self.read(port, name)) is not None]
        return (*((port.input,) if kind == "R" else ()), *read)

    def read(self, port: Port, name: str) -> int | None:
        """The variable that a law reads under a name; None if it reads none, but a state or what is declared."""
        if name == self.graph.own(port.element.name):
            return None
        found = self.graph.reading(name)
        if found is None or found[0] in "pq":
            return None
        return (self.flow if found[0] == "f" else self.effort)[found[1]]

    def _ordered(self) -> Iterator[Group]:
        """Acting ports in an order in which each finds what it needs, loops as one."""
        first, last = len(self.stores), len(self.stores) + len(self.acting)
        needs: dict[int, set[int]] = {}
        for k, port in enumerate(self.acting):
            on = {c for v in self.reads(port) for c in self.support[v] if c < last}
            needs[k] = {c - first for c in on if c >= first}
        for members in components(needs):
            loop = len(members) > 1 or members[0] in needs[members[0]]
            yield Group(tuple(members), loop)

    def divided(self) -> list[str]:
        """The 1-junctions whose flows follow by a division by a modulus, from inertias behind it."""
        found = []
        for step in self.steps:
            if not isinstance(step, Solve) or len(step.unknown) > 1 or len(step.relations[0].terms) != 2:
                continue
            (target,), relation = step.unknown, step.relations[0]
            ratio = next(r for v, r, _ in relation.terms if v == target)
            if constant(ratio) or self.graph.elements[relation.name].kind != "TF" or target not in self.flow.values():
                continue
            bond = self.graph.ends(relation.name)[0]
            junction = bond.tail
            if self.graph.elements[junction].kind == "1" and self.flow[bond.number] == target:
                found.append(junction)
        return list(dict.fromkeys(found))

    def _move_state(self, junction: str) -> None:
        """Make the flow of a 1-junction a state of its own, in place of an inertia behind it, where causality allows it."""
        name = f"{junction}*"
        while name in self.graph.elements:
            name += "*"
        number = max(b.number for b in self.graph.bonds) + 1
        elements = {**self.graph.elements, name: I(name, 0.0)}
        more = replace(self.graph, elements=elements, bonds=(*self.graph.bonds, Bond(number, junction, name)))
        wanted = dict.fromkeys((*self.massless, name), "integral")
        found = causality(more, wanted)
        moved = set(self.strokes.integral) - set(found.integral)
        if found.conflicts or name not in found.integral or len(found.integral) != len(self.strokes.integral):
            return
        if any(more.elements[n].kind != "I" for n in moved):
            return
        self.massless = (*self.massless, name)
        self._written(more, found)


def targets(step: Step) -> tuple[int, ...]:
    """The variables that a step gives."""
    return step.unknown if isinstance(step, Solve) else (step.target,)


def sources(step: Step) -> tuple[int, ...]:
    """The variables that a step needs."""
    if isinstance(step, Scale):
        return (step.source,)
    if isinstance(step, Sum):
        return tuple(v for v, _ in step.terms)
    return tuple(v for r in step.relations for v, _, _ in r.terms if v not in step.unknown)


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


def _check_rank(graph: BondGraph, block: Solve) -> None:
    """Refuse a system that its numbers make singular; moduli count as numbers in no relation to each other."""
    numbers: dict[int, float] = {}
    matrix = np.zeros((len(block.unknown),) * 2)
    for row, relation in enumerate(block.relations):
        for variable, ratio, sign in relation.terms:
            if variable in block.unknown:
                given = isinstance(ratio, float | int)
                value = float(ratio) if given else numbers.setdefault(id(ratio), math.sqrt(2.3 + len(numbers)))  # type: ignore[arg-type]
                matrix[row, block.unknown.index(variable)] += sign * value
    matrix /= np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), 1e-300)
    sizes = np.linalg.svd(matrix, compute_uv=False)
    if not sizes[-1] > _SINGULAR * sizes[0]:
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

    def joined(tail: str, head: str) -> None:
        bonds.append(Bond(1 + max(b.number for b in bonds), tail, head))

    def added(element: Element) -> str:
        name = element.name
        while name in elements:
            name += "*"
        elements[name] = element._replace(name=name)
        return name

    def before(port: str, kind: str) -> str:
        """A junction between a port and its bond."""
        place = next(k for k, b in enumerate(bonds) if b.head == port)
        junction = added(Element(kind, f"{port}*"))
        bonds[place] = bonds[place]._replace(head=junction)
        joined(junction, port)
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
                joined(tail, head)
            for m in others:
                slopes[n, m] = slopes[n, m] - ratio * slopes[name, m]
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
    wanted = dict.fromkeys(strokes.integral, "integral") | dict.fromkeys(strokes.derivative, "derivative")
    return rewritten, causality(rewritten, wanted), ties


def _slopes(graph: BondGraph, names: Sequence[str]) -> dict[tuple[str, str], Any]:
    """The slopes of the laws of a linear field's ports by one another's states."""
    import sympy

    kinds = {graph.elements[n].kind for n in names}
    letter = "p" if kinds == {"I"} else "q"
    symbols = {n: sympy.Symbol(f"{letter}_{n}", real=True) for n in names}
    found: dict[tuple[str, str], Any] = {}
    for n in names:
        law = graph.elements[n].law
        assert isinstance(law, Function)
        value = law.symbolic({graph.own(n) or "": symbols[n], **{f"{letter}_{m}": s for m, s in symbols.items() if m != n}})
        found |= {(n, m): value.diff(s) for m, s in symbols.items()}
    curved = [s for slope in found.values() for s in slope.free_symbols if s in symbols.values()]
    outward = [n for n in names if graph.bond_of(n).head != n]
    if len(kinds) > 1 or curved or outward or any(found[n, m] != found[m, n] for n, m in found):
        where = ", ".join(graph.where(n) for n in names)
        raise GraphError(
            f"{where} share one energy, and one of them follows other stores or sources, which only a field of a symmetric "
            "matrix may: put an R, or a store of the other kind, between"
        )
    return found


def _law_of(expression: Any) -> Any:
    """A law of parameters, or a number."""
    return function(expression) if expression.free_symbols else float(expression)


def _contradiction(graph: BondGraph, relations: Sequence[Relation]) -> str:
    named = ", ".join(dict.fromkeys(places(graph, relations)))
    return (
        f"over-constrained: {named} contradict or repeat the conditions of the others on the same flows and efforts: "
        "remove one of them, or change a ratio"
    )


def _blocks(graph: BondGraph, waiting: Sequence[Relation], unknown: Collection[int]) -> list[Solve]:
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
    return [Solve(tuple(sorted(gives[k] for k in group)), tuple(waiting[k] for k in group)) for group in components(needs)]
