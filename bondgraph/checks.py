"""What keeps elements and bonds from being a bond graph, found all at once, a line each."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING

from bondgraph.connections import neighbours, reached_from, representatives
from bondgraph.domains import DOMAINS
from bondgraph.elements import JUNCTIONS, ONE_PORTS, SOURCES, STORES, TWO_PORTS, Element, Law, Modulus
from bondgraph.laws import OWN, TIME, Function

if TYPE_CHECKING:
    from bondgraph.graph import Bond, BondGraph

_KINDS = ONE_PORTS | TWO_PORTS | JUNCTIONS


def structural_faults(graph: BondGraph) -> Iterator[str]:
    """Everything that is wrong with a graph's elements, bonds, names and domains."""
    elements, bonds = graph.elements, graph.bonds
    faults = [f"{e.kind}:{name}: no such kind of element" for name, e in elements.items() if e.kind not in _KINDS]
    faults += [f"{e.kind}:{e.name} is listed as {n!r}; use its own name" for n, e in elements.items() if e.name != n]
    faults += [_unknown(b, n, elements) for b in bonds for n in b[1:] if n not in elements]
    numbers = [b.number for b in bonds]
    faults += [f"two bonds are numbered {n}" for n in sorted(set(numbers)) if numbers.count(n) > 1]
    if faults:
        yield from faults
        return
    yield from _wrong_counts(elements, bonds)
    yield from _unreached(elements, bonds)
    yield from _wrong_names(graph)
    yield from _wrong_laws(graph)
    yield from _mixed_domains(elements, bonds)
    yield from _rival_sources(elements, bonds)


def _unknown(bond: Bond, name: str, elements: Mapping[str, Element]) -> str:
    """What a bond joins to a name that no element has, and the name that may have been meant."""
    from difflib import get_close_matches

    other = elements.get(bond.other(name))
    joined = f" to join {other.kind}:{other.name} to" if other is not None else ""
    near = get_close_matches(str(name), list(elements), 1)
    meant = f"; did you mean {near[0]!r}?" if near else f"; the junctions are {', '.join(_junctions(elements)) or 'none'}"
    return f"bond {bond.number}: no element {name!r}{joined}{meant}"


def _junctions(elements: Mapping[str, Element]) -> list[str]:
    return [name for name, element in elements.items() if element.kind in JUNCTIONS]


def dead_ends(graph: BondGraph) -> Iterator[str]:
    """Junctions that one bond leads to, nothing leads on from and no displacement is measured at: a line each."""
    for element in graph.of_kind(*JUNCTIONS):
        name, at = element.name, graph.at(element.name)
        beyond = graph.elements[at[0].other(name)]
        if len(at) == 1 and beyond.kind not in ONE_PORTS and name not in graph.measured:
            yield (
                f"{element.kind}:{name} dangles: bond {at[0].number} to {beyond.kind}:{beyond.name} is its only one; hang "
                "something on it, leave it out, or build(loose=True) and simplify"
            )


def bond_domains(elements: Mapping[str, Element], bonds: Sequence[Bond]) -> dict[int, str]:
    """Bond number -> name of its energy domain, for the bonds whose region names one."""
    return {b.number: names[0][0] for region, names in _regions(elements, bonds) if names for b in region}


def _wrong_counts(elements: Mapping[str, Element], bonds: Sequence[Bond]) -> Iterator[str]:
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


def _unreached(elements: Mapping[str, Element], bonds: Sequence[Bond]) -> Iterator[str]:
    start = next(iter(elements), None)
    if start is None:
        yield "the graph is empty"
        return
    seen = reached_from(start, neighbours(elements, bonds))
    if len(seen) < len(elements):
        yield "not connected to the rest: " + ", ".join(name for name in elements if name not in seen)


def _wrong_names(graph: BondGraph) -> Iterator[str]:
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


def _wrong_laws(graph: BondGraph) -> Iterator[str]:
    known = {TIME, *graph.displacements, *graph.signals, *graph.parameters}
    for name, element in graph.elements.items():
        where = f"{element.symbol}:{name}" + "".join(f", bond {b.number}" for b in graph.at(name))
        law = element.law
        if element.kind in JUNCTIONS:
            continue
        if law is None:
            yield f"{where}: has no value; give it a number or a function"
        elif isinstance(law, float | int):
            if not math.isfinite(law):
                yield f"{where}: found {law}, expected a finite number"
            elif element.kind == "C" and law == 0.0:
                yield f"{where}: found compliance 0, expected another number; a rigid joint is left out"
        elif isinstance(law, Function):
            own = {OWN[element.kind]} if element.kind in OWN else set()
            for missing in [n for n in law.of if n not in known | own]:
                expected = "no declared displacement, signal or parameter, nor t" + _hint(element)
                yield f"{where}: depends on {missing!r}, which is {expected}"
            varying = graph.depends_on(name)
            if element.kind in STORES and varying and not set(law.of) - known - own:
                expected = "a store's law may hold parameters only" + _hint(element)
                yield f"{where}: varies with {', '.join(varying)}; {expected}"
        elif not isinstance(law, Law | Modulus):
            yield f"{where}: found {law!r}, expected a number, a function of named quantities or a SymPy expression"


def _hint(element: Element) -> str:
    return {"R": "; its own flow is f", "C": "; its own displacement is q"}.get(element.kind, "")


def _mixed_domains(elements: Mapping[str, Element], bonds: Sequence[Bond]) -> Iterator[str]:
    for region, names in _regions(elements, bonds):
        for domain, name in names:
            if domain not in DOMAINS:
                yield f"{elements[name].symbol}:{name}: found domain {domain!r}, expected one of {', '.join(DOMAINS)}"
        found = dict(reversed(names))  # domain -> the first element that names it
        if len(found) > 1:
            both = " and ".join(f"{elements[name].symbol}:{name} ({domain})" for domain, name in sorted(found.items()))
            numbers = ", ".join(str(bond.number) for bond in _between(region, elements))
            yield f"bond {numbers}: {both} are joined without a transducer; put a TF or GY between them"


def _between(region: Sequence[Bond], elements: Mapping[str, Element]) -> list[Bond]:
    """The bonds where two named domains meet; the whole region where they meet through elements that name none."""
    meet = [b for b in region if len({elements[n].domain for n in b[1:]} - {""}) > 1]
    return meet or list(region)


def _regions(elements: Mapping[str, Element], bonds: Sequence[Bond]) -> list[tuple[list[Bond], list[tuple[str, str]]]]:
    """Bonds that hang together without a two-port between, and the (domain, element) that are named there."""
    junctions = [name for name, element in elements.items() if element.kind in JUNCTIONS]
    ties = [[b.number for b in bonds if name in b[1:]] for name in junctions]
    region_of = representatives([b.number for b in bonds], filter(None, ties))
    regions: dict[int, list[Bond]] = {}
    for bond in bonds:
        regions.setdefault(region_of[bond.number], []).append(bond)
    found = []
    for region in regions.values():
        inside = dict.fromkeys(n for b in region for n in b[1:] if elements[n].kind not in TWO_PORTS)
        found.append((region, [(elements[n].domain, n) for n in inside if elements[n].domain]))
    return found


def _rival_sources(elements: Mapping[str, Element], bonds: Sequence[Bond]) -> Iterator[str]:
    """Two sources that would both decide the one flow (effort) of a 1-(0-)junction, directly or through equal junctions."""
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
