"""A bond graph: its elements, bonds and declared names, their faults, and the builder that writes it.

Bonds of a 1-junction share one flow variable, bonds of a 0-junction one effort variable.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple, TypeGuard

from bondgraph.elements import (
    DOMAINS,
    GY,
    HEAT,
    JUNCTIONS,
    ONE_PORTS,
    SOURCES,
    STORES,
    TF,
    TIME,
    TWO_PORTS,
    Displacement,
    Domain,
    Element,
    Field,
    Function,
    GraphError,
    Law,
    Modulus,
    One,
    Zero,
    law_of,
    own_name,
    ports_of,
    refuse,
    renamed,
)
from bondgraph.numerics import reached_from, representatives

_DRAWN = 40  # bonds that a notebook draws unasked: more take seconds to lay out


def neighbours(names: Iterable[str], bonds: Iterable[Bond]) -> dict[str, list[str]]:
    """The names of the elements that each element has bonds with."""
    near: dict[str, list[str]] = {name: [] for name in names}
    for bond in bonds:
        near[bond.tail].append(bond.head)
        near[bond.head].append(bond.tail)
    return near


_KINDS = ONE_PORTS | TWO_PORTS | JUNCTIONS


_SOUND: set[Any] = set()  # shapes of graphs without a fault, the last of them
_MOST_SOUND = 256


def structural_faults(graph: BondGraph) -> Iterator[str]:
    """All faults of a graph's elements, bonds, names and domains; graphs that differ only in numbers have one shape."""
    laws = [e.law.of if isinstance(e.law, Function) else () for e in graph.elements.values()]
    elements = [(name, e.name, e.kind, e.domain, *of) for (name, e), of in zip(graph.elements.items(), laws, strict=True)]
    declared = *graph.displacements, "", *graph.signals, "", *graph.parameters
    shape = graph.parts, declared, tuple(elements), tuple(graph.bonds)
    if shape not in _SOUND:
        if names := [*_wrong_names(graph)]:
            yield from names
            return
        parts = _wrong_counts, _unconnected, _mixed_domains, _rival_sources
        faults = [fault for part in parts for fault in part(graph)]
        yield from faults
        if not faults:
            if len(_SOUND) >= _MOST_SOUND:
                _SOUND.clear()
            _SOUND.add(shape)
    yield from _wrong_declarations(graph)
    yield from _wrong_laws(graph)


def _wrong_names(graph: BondGraph) -> Iterator[str]:
    elements, bonds = graph.elements, graph.bonds
    yield from (f"{e.kind}:{name}: no such kind of element" for name, e in elements.items() if e.kind not in _KINDS)
    yield from (f"{e.kind}:{e.name} is listed as {n!r}; use its own name" for n, e in elements.items() if e.name != n)
    for bond in bonds:
        for name in bond[1:]:
            if name not in elements:
                from difflib import get_close_matches  # wanted only once something is wrong

                other, near = elements.get(bond.other(name)), get_close_matches(str(name), list(elements), 1)
                joined = f" to join {other.kind}:{other.name} to" if other is not None else ""
                junctions = ", ".join(n for n, e in elements.items() if e.kind in JUNCTIONS) or "none"
                meant = f"did you mean {near[0]!r}?" if near else f"the junctions are {junctions}"
                yield f"bond {bond.number}: no element {name!r}{joined}; {meant}"
    numbers = [b.number for b in bonds]
    yield from (f"two bonds are numbered {n}" for n in sorted(set(numbers)) if numbers.count(n) > 1)


def _unconnected(graph: BondGraph) -> Iterator[str]:
    if not graph.elements:
        yield "the graph is empty"
    elif not graph.parts:
        adjacent = neighbours(graph.elements, graph.bonds)
        for quantity, name in readings(graph):
            adjacent[name].append(quantity[2:])
            adjacent[quantity[2:]].append(name)
        if len(seen := reached_from(next(iter(graph.elements)), adjacent)) < len(graph.elements):
            yield "not connected to the rest: " + ", ".join(name for name in graph.elements if name not in seen)


def _wrong_declarations(graph: BondGraph) -> Iterator[str]:
    for name, displacement in graph.displacements.items():
        owner = graph.elements.get(displacement.of)
        if owner is None or owner.kind != "1":
            yield f"displacement {name!r}: {displacement.of!r} is no 1-junction of the graph"
        if not math.isfinite(displacement.initial):
            yield f"displacement {name!r}: found initial value {displacement.initial}, expected a finite number"
    for name, value in graph.parameters.items():
        if value is not None and not (isinstance(value, Real) and math.isfinite(value)):
            yield f"parameter {name!r}: found {value!r}, expected a finite number, or None where it is still open"
    declared = [*graph.displacements, *graph.signals, *graph.parameters]
    for name in sorted(set(declared)):
        if declared.count(name) > 1:
            yield f"{name!r} is declared twice, as two of displacement, signal and parameter"
        if name == TIME:
            yield f"{name!r} is declared, but always means the time"


def readings(graph: BondGraph) -> Iterator[tuple[str, str]]:
    """The flows, efforts and states that laws read of the motion, each with the element whose law it is."""
    for name, element in graph.elements.items():
        for quantity in element.law.of if isinstance(element.law, Function) else ():
            if graph.reading(quantity) is not None:
                yield quantity, name


def activated(graph: BondGraph) -> tuple[Bond, ...]:
    """The paths of signals without power, numbered from -1 down: from the flow or effort that a law reads to its element.

    >>> from bondgraph import I, R, Se
    >>> b = Builder().one("arm").one("rotor").on("arm", R("Ra", 1.0), Se("u", lambda f_rotor: -f_rotor))
    >>> activated(b.on("rotor", I("J", 1.0)).gyrate("arm", "rotor", 2.0).build())
    (Bond(number=-1, tail='rotor', head='u'),)
    """
    reads = [(quantity[2:], name) for quantity, name in readings(graph) if quantity[0] in "fe" and quantity[2:] != name]
    return tuple(Bond(-k, *ends) for k, ends in enumerate(dict.fromkeys(reads), 1))


def _wrong_counts(graph: BondGraph) -> Iterator[str]:
    elements, bonds = graph.elements, graph.bonds
    incoming = dict.fromkeys(elements, 0)
    outgoing = dict(incoming)
    for bond in bonds:
        if bond.tail == bond.head:
            yield f"bond {bond.number}: joins {bond.tail!r} to itself"
        outgoing[bond.tail] += 1
        incoming[bond.head] += 1
    for name, element in elements.items():
        count = incoming[name] + outgoing[name]
        if element.kind in ONE_PORTS and count != 1:
            yield f"{element.symbol}:{name} has {count} bonds, a one-port has 1"
        elif element.kind in JUNCTIONS and count == 0:
            yield f"{element.kind}:{name} has no bond"
        elif element.kind in TWO_PORTS and (incoming[name], outgoing[name]) != (1, 1):
            yield f"{element.symbol}:{name} has {incoming[name]} bonds in and {outgoing[name]} out, expected 1 and 1"
    for bond in bonds:
        if not {elements[bond.tail].kind, elements[bond.head].kind} & JUNCTIONS:
            two = f"{elements[bond.tail].symbol}:{bond.tail} and {elements[bond.head].symbol}:{bond.head}"
            yield f"bond {bond.number}: joins {two} directly; put a 1- or 0-junction between them"


_OWN = {"R": "flow is f, its own effort e", "C": "displacement is q", "I": "momentum is p"}
_READ = {"f": "flow of a 1-junction or one-port", "e": "effort of a 0-junction or one-port"}
_READ |= {"p": "momentum of an inertia", "q": "displacement of a compliance"}


def _wrong_laws(graph: BondGraph) -> Iterator[str]:
    variables = {TIME, *graph.displacements, *graph.signals, *graph.parameters}
    for name, element in graph.elements.items():
        law = element.law
        bare = law is None and element.kind in JUNCTIONS
        if bare or isinstance(law, Law | Modulus) or (isinstance(law, float) and 0.0 < abs(law) < math.inf):
            continue
        where = f"{element.symbol}:{name}" + "".join(f", bond {b.number}" for b in graph.at(name))
        if element.kind in JUNCTIONS:
            names = law.of if isinstance(law, Function) else ()
            for missing in [
                n for n in names if n not in variables | {f"e_{name}", f"f_{name}"} and graph.reading(n) is None
            ]:
                yield f"{where}: its condition depends on {missing!r}, which a law cannot read"
            continue
        if law is None:
            yield f"{where}: has no value; give it a number or a function"
        elif isinstance(law, (float, Real)):
            if not abs(law) < math.inf:
                yield f"{where}: found {law}, expected a finite number"
            elif element.kind == "C" and law == 0.0:
                yield f"{where}: found compliance 0, expected another number; a rigid joint is left out"
        elif isinstance(law, Function):
            own = {own_name(element.kind, law.of, variables)} - {None}
            hint = f"; its own {_OWN[element.kind]}" if element.kind in _OWN else ""
            for missing in [n for n in law.of if n not in variables | own and graph.reading(n) is None]:
                of = f", nor the {_READ[missing[0]]}" if missing[:2] in ("f_", "e_", "p_", "q_") else ""
                expected = f"no declared displacement, signal or parameter, nor t{of}{hint}"
                yield f"{where}: depends on {missing!r}, which is {expected}"
            varying = [n for n in graph.depends_on(name) if (graph.reading(n) or "f")[0] not in "pq"]
            if (
                element.kind in STORES
                and varying
                and not [n for n in varying if n not in variables and not graph.reading(n)]
            ):
                expected = "a store's law may hold parameters only" + hint
                yield f"{where}: varies with {', '.join(varying)}; {expected}"
        else:
            yield f"{where}: found {law!r}, expected a number, a function of named quantities or a SymPy expression"


def _mixed_domains(graph: BondGraph) -> Iterator[str]:
    elements, bonds = graph.elements, graph.bonds
    regions = _regions(elements, bonds)
    for region, names in regions:
        for domain, name in names:
            if domain not in DOMAINS:
                yield f"{elements[name].symbol}:{name}: found domain {domain!r}, expected one of {', '.join(DOMAINS)}"
        first = dict(reversed(names))  # domain -> the first element that names it
        if len(first) > 1:
            both = " and ".join(f"{elements[name].symbol}:{name} ({domain})" for domain, name in sorted(first.items()))
            meet = [b for b in region if len({elements[n].domain for n in b[1:]} - {""}) > 1]  # none: through unnamed ones
            numbers = ", ".join(str(bond.number) for bond in meet or region)
            yield f"bond {numbers}: {both} are joined without a transducer; put a TF or GY between them"
        still = bool(names) and names[0][0] in DOMAINS and DOMAINS[names[0][0]].momentum.name == "-"
        for bond in region if still else ():
            for name in (n for n in bond[1:] if elements[n].kind == "I"):
                where = f"I:{name} (bond {bond.number})"
                yield f"{where}: the {names[0][0]} domain has no momentum, and so no inertia: remove it"
    heat = {bond for region, names in regions if names and names[0][0] == HEAT for bond in region}
    for element in (e for e in elements.values() if heat and e.kind in TWO_PORTS):
        ends = [b for b in bonds if element.name in b[1:]]
        if len(ends) == 2 and len({bond in heat for bond in ends}) > 1:
            yield (
                f"bond {ends[0].number}, {ends[1].number}: {element.symbol}:{element.name} joins heat, whose bonds carry no "
                "power, to another domain: give the heat flow as a source, such as Sf(..., lambda e_R, f_R: e_R * f_R)"
            )


def _regions(elements: Mapping[str, Element], bonds: Sequence[Bond]) -> list[tuple[list[Bond], list[tuple[str, str]]]]:
    """Groups of bonds connected without a two-port, and the (domain, element) named there."""
    junctions = [name for name, element in elements.items() if element.kind in JUNCTIONS]
    ties = [[b.number for b in bonds if name in b[1:]] for name in junctions]
    region_of = representatives([b.number for b in bonds], filter(None, ties))
    regions: dict[int, list[Bond]] = {}
    for bond in bonds:
        regions.setdefault(region_of[bond.number], []).append(bond)
    parts = []
    for region in regions.values():
        inside = dict.fromkeys(n for b in region for n in b[1:] if elements[n].kind not in TWO_PORTS)
        parts.append((region, [(elements[n].domain, n) for n in inside if elements[n].domain]))
    return parts


def _rival_sources(graph: BondGraph) -> Iterator[str]:
    """Two sources that both determine the one flow (effort) of a 1-(0-)junction, directly or through equal junctions."""
    elements, bonds = graph.elements, graph.bonds
    for kind, source, what in (("1", "Sf", "flow"), ("0", "Se", "effort")):
        junctions = [name for name, element in elements.items() if element.kind == kind]
        equal = representatives(junctions, [b[1:] for b in bonds if b.tail in junctions and b.head in junctions])
        deciding: dict[str, list[tuple[str, int]]] = {}
        for bond in bonds:
            name = bond.tail if elements[bond.tail].kind in SOURCES else bond.head
            if elements[name].kind == source and bond.other(name) in equal:
                deciding.setdefault(equal[bond.other(name)], []).append((name, bond.number))
        for junction, rivals in deciding.items():
            if len(rivals) > 1:
                both = " and ".join(f"{source}:{name} (bond {number})" for name, number in rivals)
                yield f"{both} both set the {what} of {kind}:{junction}; keep one of them"


OTHER = {"e": "f", "f": "e"}
CONVENTION = "f_out = T f_in, e_in = T e_out"


class Bond(NamedTuple):
    """A numbered bond; its half arrow points from `tail` to `head`, where power counts as positive."""

    number: int
    tail: str
    head: str

    def other(self, name: str) -> str:
        """The element at the other end."""
        return self.head if name == self.tail else self.tail

    def moved(self, old: str, new: str) -> Bond:
        """The bond with another element in place of one at its ends."""
        return Bond(self.number, *(new if name == old else name for name in self[1:]))

    def sign(self, name: str) -> float:
        """+1 if power flows into an element along the half arrow, -1 if it flows out."""
        return 1.0 if self.head == name else -1.0


def new_bond(bonds: Iterable[Bond], tail: str, head: str) -> Bond:
    """A bond with the next free number."""
    return Bond(1 + max(bond.number for bond in bonds), tail, head)


@dataclass(frozen=True, eq=False)
class BondGraph:
    """A checked bond graph. Write one with `bondgraph.Builder`; `str(graph)` lists it with its convention.

    Args:
        elements: by name.
        bonds: numbered, each with its half arrow from tail to head.
        displacements: declared integrals of the flows of 1-junctions, by name.
        signals: names of functions of time that laws may use and a simulation is given.
        parameters: named constants that laws may use; None if the value is still open.
        parts: True allows several separate parts.

    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().parameter(M=None).one("shaft", "rotation").on("shaft", I("J", 2.0), Se("drive", lambda M: 3.0 * M))
    >>> graph = b.build()
    >>> graph.title("J"), graph.label("J"), graph.where("drive")
    ('I:J', 'I:J = 2', 'Se:drive (bond 2)')
    >>> graph.with_parameters(M=4.0).constant("drive"), graph.with_law("J", 5.0).constant("J")
    (12.0, 5.0)
    >>> graph.domain(graph.bond_of("J")).effort.unit
    'N m'

    """

    elements: Mapping[str, Element]
    bonds: tuple[Bond, ...]
    displacements: Mapping[str, Displacement] = field(default_factory=dict)
    signals: tuple[str, ...] = ()
    parameters: Mapping[str, float | None] = field(default_factory=dict)
    parts: bool = False

    def __post_init__(self) -> None:
        refuse(structural_faults(self))

    def at(self, name: str) -> tuple[Bond, ...]:
        """The bonds of one element."""
        return self._incident[name]

    @cached_property
    def _incident(self) -> Mapping[str, tuple[Bond, ...]]:
        incident: dict[str, tuple[Bond, ...]] = dict.fromkeys(self.elements, ())
        for bond in self.bonds:
            incident[bond.tail] += (bond,)
            incident[bond.head] += (bond,)
        return incident

    def ends(self, name: str) -> tuple[Bond, Bond]:
        """The bonds that enter and leave a two-port."""
        first, second = self.at(name)
        return (first, second) if first.head == name else (second, first)

    def bond_of(self, name: str) -> Bond:
        """The bond whose flow counts as an element's: its only one, or of several the first that enters it, if any."""
        bonds = self.at(name)
        return next((bond for bond in bonds if bond.head == name), bonds[0])

    def of_kind(self, *kinds: str) -> tuple[Element, ...]:
        """The elements of these kinds, in the order in which they were named."""
        return tuple(element for element in self.elements.values() if element.kind in kinds)

    def depends_on(self, name: str) -> tuple[str, ...]:
        """The displacements, signals and `t` that an element's law varies with, its own flow or displacement left out."""
        law = self.elements[name].law
        if isinstance(law, Modulus | Law):
            return (next((d.name for d in self.displacements.values() if d.of == law.motion.of), law.motion.of),)
        own = self.own(name)
        names = law.of if isinstance(law, Function) else ()
        return tuple(n for n in names if n not in self.parameters and n != own)

    def own(self, name: str) -> str | None:
        """The name of the element's own quantity in a law: f or e of a resistor, q of a compliance, p of an inertia."""
        element, law = self.elements[name], self.elements[name].law
        return own_name(element.kind, law.of, self._declared) if isinstance(law, Function) else None

    def reading(self, quantity: str) -> tuple[str, int] | None:
        """The letter and bond of a quantity of the motion that a law may read without power; None for other names.

        f_NAME is the flow of a 1-junction or one-port, e_NAME the effort of a 0-junction or one-port, p_NAME an inertia's
        momentum, q_NAME a compliance's displacement. A declared name has its declared meaning.
        """
        letter, _, name = quantity.partition("_")
        element = self.elements.get(name)
        if quantity in self._declared or element is None or not self._incident[name]:
            return None
        of = {"f": ONE_PORTS | {"1"}, "e": ONE_PORTS | {"0"}, "p": {"I"}, "q": {"C"}}
        return (letter, self._incident[name][0].number) if element.kind in of.get(letter, ()) else None

    @cached_property
    def _declared(self) -> frozenset[str]:
        return frozenset({*self.displacements, *self.signals, *self.parameters})

    def coupled(self, name: str) -> tuple[str, ...]:
        """The stores whose states a store's law reads: the other ports of a field."""
        law = self.elements[name].law
        read = law.of if self.elements[name].kind in STORES and isinstance(law, Function) else ()
        return tuple(n[2:] for n in read if (self.reading(n) or "f")[0] in "pq" and n != self.own(name))

    def is_linear(self, name: str) -> bool:
        """True if an element's law is one constant (e = R f, e = q/C, p = I f, a fixed ratio), parameters allowed."""
        law = self.elements[name].law
        if isinstance(law, Function):
            return all(n in self.parameters for n in law.of) and not self.is_curve(name)
        return isinstance(law, (float, Real))

    def is_curve(self, name: str) -> bool:
        """True if a law is a function of the element's own: a resistor's flow or effort, a store's state."""
        return self.own(name) is not None

    def is_native(self, name: str, gives: str) -> bool:
        """True if the curve of a resistor gives the required output, "e" from its flow or "f" from its effort."""
        return self.own(name) == OTHER[gives]

    def symbol(self, name: str) -> str:
        """The kind as it is drawn: MSe, MTF, MR... where the law varies with displacements, time or signals."""
        element = self.elements[name]
        modulated = element.kind not in JUNCTIONS | STORES and self.depends_on(name)
        return f"M{element.kind}" if modulated else element.kind

    def title(self, name: str) -> str:
        """Kind and name, as it is drawn: `MTF:T`."""
        return f"{self.symbol(name)}:{name}"

    def where(self, name: str) -> str:
        """Kind, name and first bond, for messages: `MTF:T (bond 4)`."""
        return f"{self.title(name)} (bond {self.at(name)[0].number})"

    def label(self, name: str) -> str:
        """Kind, name and, where it is a number, value: `I:J = 2`."""
        law = self.elements[name].law
        return self.title(name) + (f" = {law:g}" if isinstance(law, (float, Real)) else "")

    @property
    def switched(self) -> tuple[str, ...]:
        """The junctions that a condition switches."""
        return tuple(e.name for e in self.of_kind(*JUNCTIONS) if isinstance(e.law, Function))

    @property
    def motions(self) -> tuple[str, ...]:
        """The 1-junctions whose displacements the motions of laws and moduli refer to, in the order of the elements."""
        laws = [element.law for element in self.elements.values()]
        return tuple(dict.fromkeys(law.motion.of for law in laws if isinstance(law, Modulus | Law)))

    @property
    def measured(self) -> frozenset[str]:
        """The 1-junctions whose flow is integrated: by declared displacements, and by the motions of laws and moduli."""
        return frozenset({*self.motions, *(d.of for d in self.displacements.values())})

    @property
    def varies(self) -> bool:
        """True if a source, a resistor or a condition varies with the time, a signal or a displacement."""
        names = {TIME, *self.displacements, *self.signals, *self.motions}
        return any(names.intersection(self.depends_on(e.name)) for e in self.of_kind(*SOURCES, "R", *JUNCTIONS))

    def domain(self, bond: Bond) -> Domain | None:
        """The energy domain of a bond; None if it has no name."""
        return DOMAINS.get(self._domains.get(bond.number, ""))

    @cached_property
    def pseudo(self) -> frozenset[int]:
        """The bonds of the domain `heat`, whose temperature times heat flow is no power."""
        return frozenset(number for number, name in self._domains.items() if name == HEAT)

    @cached_property
    def _domains(self) -> Mapping[int, str]:
        return {b.number: names[0][0] for region, names in _regions(self.elements, self.bonds) if names for b in region}

    def with_law(self, name: str, law: Any) -> BondGraph:
        """The same graph with another law for one element, such as a changed transformer ratio."""
        element = self.elements[name]._replace(law=law_of(law))
        return replace(self, elements={**self.elements, name: element})

    def with_parameters(self, **values: float) -> BondGraph:
        """The same graph with values for some of its parameters."""
        unknown = [name for name in values if name not in self.parameters]
        if unknown:
            raise GraphError(f"no parameter {unknown[0]!r}: the graph declares {', '.join(self.parameters) or 'none'}")
        return replace(self, parameters={**self.parameters, **{k: float(v) for k, v in values.items()}})

    def constant(self, name: str) -> float:
        """The number of an element's constant law, its parameters inserted."""
        law = self.elements[name].law
        if isinstance(law, (float, Real)):
            return law
        if not isinstance(law, Function) or not self.is_linear(name):
            raise GraphError(f"{self.title(name)} is no constant")
        return float(law(*(self.parameter(n, name) for n in law.of)))

    def parameter(self, parameter: str, element: str) -> float:
        """A parameter's value for the law of an element; an error if it is still open."""
        value = self.parameters[parameter]
        if value is None:
            where = f"{self.title(element)}, bond {self.at(element)[0].number}"
            raise GraphError(f"parameter {parameter!r} ({where}) has no value: graph.with_parameters({parameter}=...)")
        return value

    def __repr__(self) -> str:
        """The numbers of elements and bonds; `str(graph)` lists them."""
        return f"BondGraph({len(self.elements)} elements, {len(self.bonds)} bonds)"

    def _repr_svg_(self) -> str | None:
        """The picture that a notebook shows, with causal strokes; None for a graph with a slow layout."""
        import bondgraph

        if len(self.bonds) > _DRAWN:
            return None
        try:
            return bondgraph.svg(self)
        except Exception:  # a notebook shows the text instead: to look at a graph must never fail
            return None

    def __str__(self) -> str:
        lines = [f"bond graph: {len(self.elements)} elements, {len(self.bonds)} bonds ({CONVENTION})"]
        lines += [f"{b.number:4d}  {self.label(b.tail)} -> {self.label(b.head)}" for b in self.bonds]
        return "\n".join(lines)


def as_graph(source: Any) -> BondGraph:
    """The argument of a function of graphs, if it is a graph; else a GraphError with the remedy."""
    if isinstance(source, BondGraph):
        return source
    advice = "; call its build() first" if hasattr(source, "build") else ""
    raise GraphError(f"found a {type(source).__name__}, expected a BondGraph{advice}")


Ratio = float | Function | Modulus
Term = tuple[int, Ratio, float]  # variable, ratio, sign


class Relation(NamedTuple):
    """Sum of sign * ratio * variable = 0, and the element that it comes from."""

    name: str
    terms: tuple[Term, ...]


class SolutionStep(NamedTuple):
    """Variables that follow from as many relations: one that is a sum of terms, ratio times variable, or a linear system."""

    unknown: tuple[int, ...]
    relations: tuple[Relation, ...]
    terms: tuple[tuple[int, Ratio], ...] | None = None


def sources(step: SolutionStep) -> tuple[int, ...]:
    """The variables that a step needs."""
    return tuple(v for r in step.relations for v, _, _ in r.terms if v not in step.unknown)


def ratios(step: SolutionStep) -> tuple[Ratio, ...]:
    """The ratios that a step uses."""
    return tuple(ratio for r in step.relations for _, ratio, _ in r.terms)


def variables(graph: BondGraph, kind: str) -> dict[int, int]:
    """Bond number -> variable: the bonds of a 1-junction share one flow, those of a 0-junction one effort."""
    ties = [[bond.number for bond in graph.at(junction.name)] for junction in graph.of_kind(kind)]
    shared = representatives([bond.number for bond in graph.bonds], ties)
    variable = {one: k for k, one in enumerate(dict.fromkeys(shared[number] for number in sorted(shared)))}
    return {number: variable[one] for number, one in shared.items()}


def relations(graph: BondGraph, variable: Mapping[int, int], summing: str) -> list[Relation]:
    """One relation per transformer and summing junction: of flows where 0-junctions sum, of efforts where 1-junctions do.

    Of a transformer f_out - T f_in = 0, or e_in - T e_out = 0.
    """
    made = []
    for element in graph.of_kind("TF", summing):
        if element.kind == "TF":
            into, out = (variable[bond.number] for bond in graph.ends(element.name))
            scaled, source = (out, into) if summing == "0" else (into, out)
            ratio = element.law
            if not isinstance(ratio, (float, Real, Function, Modulus)):
                raise GraphError(f"TF:{element.name} has no ratio")
            if isinstance(ratio, Function) and graph.is_linear(element.name):
                ratio = graph.constant(element.name)  # a number, or the symbol that stands for one
            made.append(Relation(element.name, ((scaled, 1.0, 1.0), (source, ratio, -1.0))))
        else:  # what comes in and goes out again by parallel bonds is added up, or cancels
            total: dict[int, float] = {}
            for bond in graph.at(element.name):
                total[variable[bond.number]] = total.get(variable[bond.number], 0.0) + bond.sign(element.name)
            made.append(Relation(element.name, tuple((v, 1.0, sign) for v, sign in total.items() if sign)))
    return made


def constant(ratio: Ratio) -> TypeGuard[float]:
    """True if a ratio is a plain number, or a symbol that stands for one."""
    return not isinstance(ratio, Function | Modulus)


def plan(waiting: list[Relation], determined: set[int]) -> list[SolutionStep]:
    """All steps that give a relation's one unknown from known variables, without division by a modulus.

    `waiting` and `determined` are updated.

    >>> gear = Relation("gear", ((1, 1.0, 1.0), (0, 2.0, -1.0)))  # f_1 - 2 f_0 = 0
    >>> [step.terms for step in (*plan([gear], {0}), *plan([gear], {1}))]
    [((0, 2.0),), ((1, 0.5),)]
    """
    steps: list[SolutionStep] = []
    before = -1
    while before < len(steps):
        before = len(steps)
        for relation in list(waiting):
            unknown = [term for term in relation.terms if term[0] not in determined]
            if len(unknown) != 1:
                continue
            target, factor, sign = unknown[0]
            if not constant(factor) or factor == 0.0:
                continue
            others = [(v, ratio, -other / (sign * factor)) for v, ratio, other in relation.terms if v != target]
            plain = all(constant(ratio) for _, ratio, _ in others)
            if plain or (len(others) == 1 and others[0][2] == 1.0):  # else a modulus would have to be scaled
                terms = tuple((v, ratio * scale if constant(ratio) else ratio) for v, ratio, scale in others)
                waiting.remove(relation)
                steps.append(SolutionStep((target,), (relation,), terms))
                determined.add(target)
    return steps


def places(graph: BondGraph, relations: Sequence[Relation]) -> list[str]:
    """The origins of relations, by element and bonds."""
    return [f"{graph.title(r.name)} (bonds {', '.join(str(b.number) for b in graph.at(r.name))})" for r in relations]


# -- writing a graph by hand, step by step and from parts with open ports ----------------------------------------------


@dataclass(frozen=True, eq=False)
class Part:
    """A sub-graph with open ports: junctions that bonds of a larger graph may join. Made by `Builder.part`."""

    elements: Mapping[str, Element]
    bonds: tuple[Bond, ...]
    displacements: Mapping[str, Displacement]
    signals: tuple[str, ...]
    parameters: Mapping[str, float | None]
    ports: Mapping[str, str]


class Builder:
    """Writes a graph step by step; `build()` checks it. Every step except `add` returns the builder, so steps chain.

    >>> import numpy as np
    >>> from bondgraph import I, Se
    >>> b = Builder().one("crank", "rotation", displacement="theta").one("ram", "translation")
    >>> b = b.on("crank", I("J", 2.0), Se("M", 3.0)).on("ram", I("m", 4.0))
    >>> b = b.transform("crank", "ram", lambda theta: -0.5 * np.sin(theta), name="T")
    >>> print(b.build())
    bond graph: 6 elements, 5 bonds (f_out = T f_in, e_in = T e_out)
       1  1:crank -> I:J = 2
       2  Se:M = 3 -> 1:crank
       3  1:ram -> I:m = 4
       4  1:crank -> MTF:T
       5  MTF:T -> 1:ram
    """

    def __init__(self) -> None:
        self._elements: dict[str, Element] = {}
        self._bonds: list[Bond] = []
        self._displacements: dict[str, Displacement] = {}
        self._signals: list[str] = []
        self._parameters: dict[str, float | None] = {}

    def add(self, element: Element) -> str:
        """Adds an element, not yet bonded; its name must be new. Returns the name."""
        if not isinstance(element, Element):
            raise GraphError(f"found {element!r}, expected an element, such as I('J', 2.0)")
        if not isinstance(element.name, str) or not element.name:
            raise GraphError(f"found {element.name!r} as a name, expected a text that is not empty")
        if element.name in self._elements:
            raise GraphError(f"two elements are named {element.name!r}: give one of them another name (name=...)")
        if isinstance(element.law, Field):
            raise GraphError(f"{element.kind}:{element.name} has several ports: attach it to their junctions by field(...)")
        self._elements[element.name] = element
        return element.name

    def one(
        self, name: str, domain: str = "", *, displacement: str | None = None, initial: float = 0.0, when: Any = None
    ) -> Builder:
        """Adds a 1-junction, and declares the integral of its flow under the name `displacement` if one is given.

        With `when`, a function such as `lambda t: t > 1`, it is switched: while that does not hold, its flow is 0. Besides
        the quantities of laws, the condition of a switched junction may read its own `f_NAME` and `e_NAME`, one of which is
        the sum over its bonds: an ideal diode is `one("diode", when=lambda e_diode, f_diode: e_diode + f_diode > 0)`.
        """
        self.add(One(name, domain, when))
        return self if displacement is None else self.displacement(displacement, name, initial)

    def zero(self, name: str, domain: str = "", *, when: Any = None) -> Builder:
        """Adds a 0-junction; with `when`, a switched one: while that does not hold, its effort is 0.

        A clutch: `b.zero("clutch", when=lambda t: t > 1).bond("motor", "clutch").bond("clutch", "load")`.
        """
        self.add(Zero(name, domain, when))
        return self

    def displacement(self, name: str, of: str, initial: float = 0.0) -> Builder:
        """Declares the integral of the flow of the 1-junction `of`, so that laws may depend on it."""
        if name in self._displacements:
            raise GraphError(f"two displacements are named {name!r}")
        self._displacements[name] = Displacement(name, of, float(initial))
        return self

    def signal(self, *names: str) -> Builder:
        """Declares functions of time that laws may depend on; a simulation is given them."""
        self._signals += [name for name in names if name not in self._signals]
        return self

    def parameter(self, **values: float | None) -> Builder:
        """Declares named constants that laws may use, with their values (None: left open)."""
        self._parameters |= values
        return self

    def bond(self, tail: str, head: str) -> Builder:
        """Joins two elements by the next bond, half arrow at `head`."""
        self._bonds.append(Bond(len(self._bonds) + 1, tail, head))
        return self

    def port(self, junction: str, element: Element) -> Builder:
        """Attaches a one-port to a junction: power flows out of sources and into everything else."""
        name = self.add(element)
        return self.bond(*((name, junction) if element.kind in SOURCES else (junction, name)))

    def on(self, junction: str, *elements: Element) -> Builder:
        """Attaches one-ports to a junction, each like `port`."""
        for element in elements:
            self.port(junction, element)
        return self

    def field(self, element: Element, *junctions: str, **ports: str) -> Builder:
        """Attaches a field to several junctions: a C, I or R of a matrix, or a C or I of an energy.

        Its ports are one-ports NAME_1, NAME_2... of a matrix, NAME_ARGUMENT of an energy, each with its own state
        (`q_NAME_1`). Efforts are the energy's derivatives by displacements, flows those by momenta: arguments p, p_a, p1 are
        momenta, q and x likewise displacements, others what the element is, an I or a C. Parameters are declared before.

        Args:
            element: the field.
            junctions: one for each row of the matrix, or each argument of the energy, in order.
            ports: the same by name.

        >>> from bondgraph import I, Se
        >>> b = Builder().one("a").one("b").on("a", Se("u", 1.0))
        >>> graph = b.field(I("coils", [[2.0, 1.0], [1.0, 3.0]]), "a", "b").build()
        >>> list(graph.elements), graph.coupled("coils_1")
        (['a', 'b', 'u', 'coils_1', 'coils_2'], ('coils_2',))

        """
        for junction, port in ports_of(element, junctions, ports, self._parameters):
            self.port(junction, port)
        return self

    def between(self, first: str, second: str, *elements: Element, name: str | None = None) -> Builder:
        """Attaches one-ports to the difference of two flows, f_first - f_second, through a 0-junction."""
        node = name or f"{first}-{second}"
        self.zero(node).bond(first, node).bond(node, second)
        if len(elements) == 1:
            return self.port(node, elements[0])
        return self.one(f"{node}.rate").bond(node, f"{node}.rate").on(f"{node}.rate", *elements)

    def transform(self, source: str, target: str, ratio: Any, *, name: str | None = None) -> Builder:
        """Joins two junctions by a transformer, named after them by default: f_target = ratio f_source."""
        element = self.add(TF(name or f"{source}->{target}", ratio))
        return self.bond(source, element).bond(element, target)

    def gyrate(self, source: str, target: str, ratio: Any, *, name: str | None = None) -> Builder:
        """Joins two junctions by a gyrator, named after them by default: e_target = ratio f_source."""
        element = self.add(GY(name or f"{source}->{target}", ratio))
        return self.bond(source, element).bond(element, target)

    def sum(self, target: str, terms: list[tuple[str, Any]], domain: str) -> Builder:
        """A new 1-junction `target` whose flow is the sum of ratio times flow of others (through a 0-junction)."""
        self.one(target, domain)
        if len(terms) == 1:
            return self.transform(terms[0][0], target, terms[0][1])
        node = self.add(Zero(f"{target}.sum", domain))
        for source, ratio in terms:
            self.transform(source, node, ratio)
        return self.bond(node, target)

    def include(self, name: str, part: Part) -> Builder:
        """Inserts a part into this graph: its names get `name.` in front; bonds then join its ports `name.port`.

        Parameters, signals and the time are shared by name, displacements are the part's own. A parameter that the part
        leaves open takes the graph's value; two values that differ are a fault.
        """
        own = {old: f"{name}.{old}" for old in part.elements}
        own |= {junction: f"{name}.{port}" for port, junction in part.ports.items()}
        measured = {old: f"{name}.{old}" for old in part.displacements}
        for element in part.elements.values():
            self.add(element._replace(name=own[element.name], law=renamed(element, own, measured)))
        for displacement in part.displacements.values():
            self.displacement(measured[displacement.name], own.get(displacement.of, displacement.of), displacement.initial)
        for bond in part.bonds:
            self.bond(own.get(bond.tail, bond.tail), own.get(bond.head, bond.head))
        for parameter, value in part.parameters.items():
            earlier = self._parameters.get(parameter)
            if earlier is not None and value is not None and earlier != value:
                raise GraphError(
                    f"parameter {parameter!r}: found {value} in part {name!r}, but {earlier} before; leave one open"
                )
            self._parameters[parameter] = value if earlier is None else earlier
        return self.signal(*part.signals)

    def __len__(self) -> int:
        return len(self._elements)

    def __contains__(self, name: str) -> bool:
        return name in self._elements

    def part(self, *ports: str, **named: str) -> Part:
        """The graph so far as a part: its open ports are these junctions, under their own or other names."""
        open_ports = {port: port for port in ports} | named
        for port, junction in open_ports.items():
            if junction not in self._elements or self._elements[junction].kind not in JUNCTIONS:
                raise GraphError(f"port {port!r}: {junction!r} is no junction of the part")
            if list(open_ports.values()).count(junction) > 1:
                raise GraphError(f"port {port!r}: {junction!r} is open under two names; give it one")
        return Part(**self._written(), ports=open_ports)

    def build(self, *, loose: bool = False) -> BondGraph:
        """The checked graph. Junctions without further elements are a fault unless `loose`, which is for simplification."""
        graph, dangling = BondGraph(**self._written()), []
        for element in () if loose else graph.of_kind(*JUNCTIONS):
            first, *others = graph.at(element.name)
            beyond = graph.elements[first.other(element.name)]
            if not others and beyond.kind not in ONE_PORTS and element.name not in graph.measured:
                dangling.append(
                    f"{element.kind}:{element.name} dangles: bond {first.number} to {beyond.kind}:{beyond.name} is its only "
                    "one; attach something to it, leave it out, or build(loose=True) and simplify"
                )
        refuse(dangling)
        return graph

    def _written(self) -> dict[str, Any]:
        """A copy of the graph so far, by the fields that a graph and a part share; resistors with heat as two elements."""
        elements, bonds = dict(self._elements), list(self._bonds)
        for rubbing in (e for e in self._elements.values() if e.kind == "RS"):
            _heated(rubbing, elements, bonds)
        return {
            "elements": elements,
            "bonds": tuple(bonds),
            "displacements": dict(self._displacements),
            "signals": tuple(self._signals),
            "parameters": dict(self._parameters),
        }


def _heated(element: Element, elements: dict[str, Element], bonds: list[Bond]) -> None:
    """Writes a resistor with a thermal port as R and a source of the entropy (or heat) that its power makes: S' = e f/T."""
    name, own = element.name, [k for k, b in enumerate(bonds) if element.name in b[1:]]
    regions = _regions(elements, bonds)
    hot = next((k for k in reversed(own) if bonds[k].tail == name and elements[bonds[k].head].kind == "0"), None)
    if len(own) != 2 or hot is None:
        raise GraphError(
            f"RS:{name}: found {len(own)} bonds, expected two: one that brings its power, and one from it to the 0-junction "
            f'of the body that it heats, as bond("{name}", BODY)'
        )
    side = next(bonds[k] for k in own if k != hot)
    body, source, sign = bonds[hot].head, f"{name}.heat", side.sign(name)
    elements[name] = element._replace(kind="R")
    law = Function(lambda e, f, T: sign * e * f / T, ("e", "f", "T"), (f"e_{name}", f"f_{name}", f"e_{body}"))
    if any(bonds[hot] in region and names and names[0][0] == HEAT for region, names in regions):
        law = Function(lambda e, f: sign * e * f, ("e", "f"), (f"e_{name}", f"f_{name}"))
    elements[source] = Element("Sf", source, law, "", element.part)
    bonds[hot] = bonds[hot]._replace(tail=source)
