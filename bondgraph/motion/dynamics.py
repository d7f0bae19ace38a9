"""The equations of motion of a graph in numbers, by its causal strokes.

Stores in integral causality give from their state (`p_NAME`, `q_NAME`), sources and resistors by their laws. A resistor that
needs itself, through others or not, is part of a loop that is solved as one. A store in derivative causality follows the
integral ones and sources: it is folded in by its gains, M z' = Q with M = W + S^T D S.

No step divides by a modulus that may vanish, unless strokes leave nothing else: what loops leave over is a linear system in
blocks as small as can be. Where an inertia that alone weighs a motion lies behind a modulated transformer, the flow before
the transformer is the state, without an inertia of its own, so that dead centres are ordinary positions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import (
    ONE_PORTS,
    SOURCES,
    STORES,
    Element,
    Function,
    GraphError,
    I,
    Law,
    Modulus,
    function,
    is_symbolic,
    refuse,
)
from bondgraph.graph import (
    Bond,
    BondGraph,
    Relation,
    SolutionStep,
    as_graph,
    constant,
    places,
    plan,
    ratios,
    relations,
    sources,
    variables,
)
from bondgraph.motion.algebra import SOUGHT, Balance, eliminated, settle, solutions
from bondgraph.motion.runge_kutta import MANY
from bondgraph.motion.walk import (
    GraphInstant,
    JunctionStructure,
    OutputGroup,
    PortBond,
    Tables,
    Walk,
    displacements,
    loop_name,
    unsolvable,
    upstream,
)
from bondgraph.numerics import components, reached_from
from bondgraph.recording import Recorder
from bondgraph.strokes import Causality, causality

_SINGULAR = 1e-12


class Formulation(JunctionStructure):
    """The junction structure of a graph by its strokes."""

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
        self.groups = tuple(OutputGroup(tuple(each), len(each) > 1 or each[0] in needs[each[0]]) for each in groups)

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
        name = f"{junction}*"
        while name in self.graph.elements:
            name += "*"
        number = max(b.number for b in self.graph.bonds) + 1
        elements = {**self.graph.elements, name: I(name, 0.0)}
        more = replace(self.graph, elements=elements, bonds=(*self.graph.bonds, Bond(number, junction, name)))
        preferences = dict.fromkeys((*self.massless, name), "integral")
        assignment = causality(more, preferences)
        moved = set(self.strokes.integral) - set(assignment.integral)
        if assignment.conflicts or name not in assignment.integral or len(assignment.integral) != len(self.strokes.integral):
            return
        if any(more.elements[n].kind != "I" for n in moved):
            return
        self.massless = (*self.massless, name)
        self._written(more, assignment)


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


def tables(form: Formulation, signals: Mapping[str, Function]) -> Tables:
    """Looks up everything that does not change from state to state."""
    graph = form.graph
    elements = {id(e.law): e.name for e in graph.elements.values() if e.law is not None}
    moduli = {id(r): r for step in form.steps for r in ratios(step) if isinstance(r, Function | Modulus)}
    made = Tables(
        form=form,
        signals=signals,
        moduli=tuple((ratio, elements[key]) for key, ratio in moduli.items()),
        owner_of={d.name: form.variable(d.of) for d in form.displacements},
        displacement_of={d.of: d.name for d in reversed(form.displacements)},
        iterated=tuple(g for g in form.groups if _bends(form, g)),
        closed=exact_gains(form),
        bending=frozenset(k for k, p in enumerate(form.followers) if graph.is_curve(p.element.name)),
        weighed=_weighed(form),
        varying=upstream(form, {p.input for p in form.followers}),
    )
    _check_rates(made)
    return made


def _bends(form: Formulation, group: OutputGroup) -> bool:
    """True if outputs are found by iteration: a curve in a loop, or one that is asked for its inverse."""
    ports = [form.acting[k] for k in group.members]
    curved = [p for p in ports if form.graph.is_curve(p.element.name)]
    moving = [p for p in ports if isinstance(p.element.law, Law)]
    if group.loop and moving:
        where = form.graph.title(moving[0].element.name)
        raise GraphError(f"{where} depends on a flow without inertia: give it as a resistor, or add inertia")
    reads = [p for p in ports if any(form.read(p, name) is not None for name in getattr(p.element.law, "of", ()))]
    if all(isinstance(p.element.law, Function) and p.element.law.is_affine for p in {*curved, *reads}):
        return False
    return bool(curved or reads) if group.loop else any(not form.graph.is_native(p.element.name, p.gives) for p in curved)


def exact_gains(form: Formulation) -> dict[int, dict[int, float]]:
    """Gains of variables in loops of constant resistors, of those that constant followers give, and of all after them.

    Leaks of 1e20 ohm beside 1 ohm, or a great store that follows a small one, leave no digit to a solution in floats: both
    are solved in fractions, and rounded once.
    """
    loops = [[_line(form, form.acting[k]) for k in g.members] for g in form.groups if g.loop]
    members = [[form.acting[k] for k in g.members] for g in form.groups if g.loop]
    if not any(map(all, loops)) and not form.followers:
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

    for lines, ports in zip(loops, members, strict=True):
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
    graph, first, places = form.graph, len(form.stores), _weighed(form)
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
        law, name, sign = port.element.law, port.element.name, port.sign if port.element.kind == "I" else 1.0
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


def _weighed(form: Formulation) -> tuple[int, ...]:
    tied = {k for p in form.followers for k in form.support[p.input] if k < len(form.stores)}
    places = {p.element.name: k for k, p in enumerate(form.stores)}
    near = {k: {places[n] for n in form.graph.coupled(p.element.name)} for k, p in enumerate(form.stores)}
    tied = {other for k in tied for other in reached_from(k, near)}
    return tuple(sorted(tied | {places[name] for name in form.massless}))


def _check_rates(tables: Tables) -> None:
    """Refuses a modulus whose rate a follower needs, and that varies with what a follower gives."""
    form, graph = tables.form, tables.form.graph
    last = len(form.stores) + len(form.acting)
    needed = {id(r) for k in tables.varying for r in ratios(form.steps[k])}
    settled = {p.output for p in form.stores}
    for ratio, name in tables.moduli:
        for displacement in graph.depends_on(name):
            read = graph.reading(displacement)
            if read is not None and read[0] in "fe":
                if (form.flow if read[0] == "f" else form.effort)[read[1]] not in settled:
                    raise GraphError(
                        f"{graph.where(name)} reads {displacement}, which no store gives from its state: a modulus may read "
                        "such alone"
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
            on = form.support[tables.owner_of[displacement]] if displacement in tables.owner_of else ()
            if any(k >= last for k in on):
                raise GraphError(
                    f"{graph.where(name)} varies with {displacement}, whose rate a store in derivative causality gives: "
                    f"attach an I or R to {form.name_of(tables.owner_of[displacement])}"
                )


_NUMBERED = (*SOURCES, *STORES, "R", "TF", "GY")
Array = NDArray[np.float64]
Rates = Callable[..., tuple[Any, ...]]


class StateLayout(NamedTuple):
    """Contents of a graph's state: names, in order, and the numbers of stores' states and displacements."""

    names: tuple[str, ...]
    stores: int
    displacements: int


class Dynamics:
    """A graph ready to be evaluated.

    The state holds, in this order: of every store in integral causality its momentum (`p_` and the inertia's name) or
    displacement (`q_` and the spring's), in the order of the elements, and the displacements that are declared or that
    motions refer to (by name). Where inertias lie behind modulated transformers only, the flow before these is the state
    (`f_` and the 1-junction's name).

    >>> from bondgraph import Builder, C, I
    >>> b = Builder().one("mass", "translation", displacement="x").on("mass", I("m", 2.0), C("spring", stiffness=8.0))
    >>> dynamics = Dynamics(b.build())
    >>> dynamics.state.names
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
        self.tables = tables(self.form, self.signals)
        names = [self.form.state_name(p) for p in self.form.stores]
        names += [d.name for d in self.form.displacements]
        self.state = StateLayout(tuple(names), len(self.form.stores), len(self.form.displacements))

    def __reduce__(self) -> tuple[Any, ...]:
        return Dynamics, (self.graph, self.signals)

    def at(self, t: Any, state: Sequence[Any], anchors: Mapping[str, Any] | None = None) -> GraphInstant:
        """Flows, efforts and rates at a time t (s) and a state (numbers, or arrays of the same shape, one per name).

        `anchors` gives, by 1-junction, the displacement in the middle of the smooth piece that laws of motion are in.
        """
        return Walk(self.tables, t, state, anchors or {}).instant()

    def stored(self, port: PortBond, value: float) -> float:
        """The momentum (displacement) at which a store gives a flow (effort)."""
        if port.element.name in self.form.massless:
            return value
        return float(Walk(self.tables, 0.0, [0.0] * len(self.state.names), {}, acts=False).inverse(port, value))

    def branches(self, state: Sequence[float]) -> Iterator[str]:
        """Yields a line for each loop of resistors whose laws have several solutions at a state, and the one kept."""
        walk = Walk(self.tables, 0.0, state, {})
        for group in self.tables.iterated:
            ports = [self.form.acting[k] for k in group.members]
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
        if self.tables.bending:
            return self._evaluated
        if len(self.state.names) >= MANY and self.linear is not None:
            matrix, constant, _ = self.linear
            return lambda t, *values: (matrix @ np.array(values) + constant).tolist()
        groups = self.tables.iterated
        if not groups:
            return self._recorded(Walk.rates)
        balances = [self._recorded(_flat, k + 1, k) for k in range(len(groups))]
        rates = self._recorded(Walk.rates, len(groups))
        last: list[list[Any] | None] = [None] * len(groups)

        def iterated(t: Any, *values: Any) -> tuple[Any, ...]:
            outputs: tuple[Any, ...] = ()
            for k, group in enumerate(groups):
                size, balance, before = len(group.members), balances[k], outputs

                def equations(trial: list[Any]) -> Balance:
                    rest = balance(t, *values, *before, *trial)  # noqa: B023 - called at once
                    return list(rest[:size]), [list(rest[size * j : size * (j + 1)]) for j in range(1, size + 1)]  # noqa: B023

                ports = [self.form.acting[k] for k in group.members]
                settled = settle(equations, size, (), loop_name(self.graph, ports), last[k])
                last[k], outputs = settled, (*outputs, *settled)
            return rates(t, *values, *outputs)

        return iterated

    @cached_property
    def linear(self) -> tuple[Array, Array, float] | None:
        """A and b of the rates A x + b of a graph of constants, and the greatest |eigenvalue| of A, 1/s.

        A is that of the graph without its sources, so that no digit of it is lost.
        """
        if self.tables.bending or not all(self.graph.is_linear(e.name) for e in self.graph.of_kind(*_NUMBERED)):
            return None
        size = len(self.state.names)
        constant = Walk(self.tables, 0.0, [0.0] * size, {}).rates()
        rows = [np.broadcast_to(row, size) for row in Walk(self.tables, 0.0, list(np.eye(size)), {}, still=True).rates()]
        matrix = np.array(rows, dtype=float).reshape(size, size)
        return matrix, np.array(constant, dtype=float), float(np.abs(np.linalg.eigvals(matrix)).max(initial=0.0))

    def _evaluated(self, t: Any, *values: Any) -> tuple[Any, ...]:
        """The rates, walked anew at every state."""
        count = len(self.state.names)
        anchors = dict(zip(self.anchored, values[count:], strict=True))
        return tuple(Walk(self.tables, t, values[:count], anchors).rates())

    def _recorded(self, what: Callable[[Walk], Sequence[Any]], groups: int = 0, stop: int | None = None) -> Rates:
        """The results of a walk as straight-line code of (t, *state, *anchors, *outputs of the first iterated groups)."""
        count, recorder = len(self.state.names), Recorder()
        sizes = [len(g.members) for g in self.tables.iterated[:groups]]
        t, *values = (recorder.input(str(k)) for k in range(1 + count + len(self.anchored) + sum(sizes)))
        anchors = dict(zip(self.anchored, values[count:], strict=False))
        inputs, first = [], count + len(self.anchored)
        for size in sizes:
            inputs.append(values[first : first + size])
            first += size
        return recorder.program(what(Walk(self.tables, t, values[:count], anchors, inputs, stop))).function("math")


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
