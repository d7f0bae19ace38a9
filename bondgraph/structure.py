"""The junction structure as relations between flows (or efforts), and the order in which they give one after another.

Bonds of a 1-junction share one flow variable, bonds of a 0-junction one effort variable. Transformers and the other
junctions are linear relations between variables. `plan` turns relations and what is known into local steps, none of which
divides by a modulus (it vanishes at dead centres); what loops leave over is one linear system.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from bondgraph.connections import representatives
from bondgraph.elements import Element, Modulus
from bondgraph.faults import GraphError
from bondgraph.graph import Bond, BondGraph
from bondgraph.laws import Function

SINGULAR = "the constraints lock or branch at one of the positions: singular flow system"

Ratio = float | Function | Modulus
Term = tuple[int, Ratio, float]  # variable, ratio, sign


class Relation(NamedTuple):
    """Sum of sign * ratio * variable = 0, and the element that it comes from."""

    name: str
    terms: tuple[Term, ...]


class Scale(NamedTuple):
    """A variable is a ratio times another."""

    source: int
    target: int
    ratio: Ratio


class Sum(NamedTuple):
    """A variable is a sum of others."""

    target: int
    terms: tuple[tuple[int, float], ...]


class Solve(NamedTuple):
    """Several variables follow together from as many relations."""

    unknown: tuple[int, ...]
    relations: tuple[Relation, ...]


Step = Scale | Sum | Solve


def flow_variables(graph: BondGraph) -> dict[int, int]:
    """Bond number -> flow variable: the bonds of a 1-junction share one."""
    return _variables(graph, "1")


def effort_variables(graph: BondGraph) -> dict[int, int]:
    """Bond number -> effort variable: the bonds of a 0-junction share one."""
    return _variables(graph, "0")


def _variables(graph: BondGraph, kind: str) -> dict[int, int]:
    ties = [[bond.number for bond in graph.at(junction.name)] for junction in graph.of_kind(kind)]
    shared = representatives([bond.number for bond in graph.bonds], ties)
    variable = {one: k for k, one in enumerate(dict.fromkeys(shared[number] for number in sorted(shared)))}
    return {number: variable[one] for number, one in shared.items()}


def entry(graph: BondGraph, name: str) -> Bond:
    """The bond whose flow counts as an element's: of a two-port, the one that enters it."""
    bonds = graph.at(name)
    return next((bond for bond in bonds if bond.head == name), bonds[0])


def flow_relations(graph: BondGraph, flow: Mapping[int, int]) -> list[Relation]:
    """f_out - T f_in = 0 of every transformer, and the sum of flows of every 0-junction."""
    return _relations(graph, flow, "0", lambda into, out: (out, into))


def effort_relations(graph: BondGraph, effort: Mapping[int, int]) -> list[Relation]:
    """e_in - T e_out = 0 of every transformer, and the sum of efforts of every 1-junction."""
    return _relations(graph, effort, "1", lambda into, out: (into, out))


def _relations(
    graph: BondGraph, variable: Mapping[int, int], summing: str, by_ratio: Callable[[Bond, Bond], tuple[Bond, Bond]]
) -> list[Relation]:
    """One relation per transformer (the first bond's variable is the ratio times the second's) and summing junction."""
    relations = []
    for element in graph.of_kind("TF", summing):
        if element.kind == "TF":
            scaled, source = (variable[bond.number] for bond in by_ratio(*graph.ends(element.name)))
            relations.append(Relation(element.name, ((scaled, 1.0, 1.0), (source, _ratio(graph, element), -1.0))))
        else:
            relations.append(Relation(element.name, _balance(graph, element.name, variable)))
    return relations


def _balance(graph: BondGraph, name: str, variable: Mapping[int, int]) -> tuple[Term, ...]:
    """The sum at a junction; what comes in and goes out again by parallel bonds is added up, or cancels."""
    total: dict[int, float] = {}
    for bond in graph.at(name):
        total[variable[bond.number]] = total.get(variable[bond.number], 0.0) + bond.sign(name)
    return tuple((v, 1.0, sign) for v, sign in total.items() if sign)


def _ratio(graph: BondGraph, element: Element) -> Ratio:
    law = element.law
    if isinstance(law, Function):
        return graph.constant(element.name) if graph.is_linear(element.name) else law
    if not isinstance(law, float | int | Modulus):
        raise GraphError(f"TF:{element.name} has no ratio")
    return law


def constant(ratio: Ratio) -> bool:
    """Whether a ratio is a plain number, or a symbol that stands for one."""
    return not isinstance(ratio, Function | Modulus)


def plan(waiting: list[Relation], known: set[int]) -> list[Step]:
    """Local steps, as far as they go, from what is known; `waiting` and `known` are brought up to date.

    >>> gear = Relation("gear", ((1, 1.0, 1.0), (0, 2.0, -1.0)))  # f_1 - 2 f_0 = 0
    >>> plan([gear], {0}), plan([gear], {1})
    ([Scale(source=0, target=1, ratio=2.0)], [Scale(source=1, target=0, ratio=0.5)])
    """
    steps: list[Step] = []
    progress = True
    while progress:
        progress = False
        for relation in list(waiting):
            step = _local(relation, known)
            if step is not None:
                waiting.remove(relation)
                steps.append(step)
                known.add(step.target)
                progress = True
    return steps


def _local(relation: Relation, known: set[int]) -> Scale | Sum | None:
    """The step that gives a relation's one unknown variable, if it needs no division by a modulus."""
    unknown = [term for term in relation.terms if term[0] not in known]
    if len(unknown) != 1 or not constant(unknown[0][1]) or unknown[0][1] == 0.0:
        return None
    target, factor, sign = unknown[0]
    assert not isinstance(factor, Function | Modulus)
    others = [term for term in relation.terms if term[0] != target]
    if len(others) == 1:
        source, ratio, other = others[0]
        scale = -other / (sign * factor)
        if isinstance(ratio, Function | Modulus):
            return Scale(source, target, ratio) if scale == 1.0 else None
        return Scale(source, target, ratio * scale)
    if not all(constant(ratio) for _, ratio, _ in others):
        return None
    return Sum(target, tuple((v, -s / sign) for v, _, s in others))


def closed(graph: BondGraph, variable: Mapping[int, int], waiting: Sequence[Relation], unknown: Iterable[int]) -> Solve:
    """The linear system that loops leave over; an error where it is not square."""
    missing = tuple(sorted(unknown))
    if len(waiting) < len(missing):
        names = [next(b for b in graph.bonds if variable[b.number] == v) for v in missing]
        free = ", ".join(f"bond {b.number} ({b.tail} - {b.head})" for b in names)
        raise GraphError(f"more than one degree of freedom: nothing ties {free} to the coordinate")
    if len(waiting) > len(missing):
        raise GraphError("over-constrained: too many relations at " + ", ".join(places(graph, waiting)))
    return Solve(missing, tuple(waiting))


def places(graph: BondGraph, relations: Sequence[Relation]) -> list[str]:
    """Where relations come from, by element and bonds."""
    return [f"{graph.title(r.name)} (bonds {', '.join(str(b.number) for b in graph.at(r.name))})" for r in relations]
