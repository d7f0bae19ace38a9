"""What has no power in a graph: bonds without effort or without flow, and where they lead.

A dangling 1-junction, like a source Se = 0, leaves its neighbour a bond without effort whose flow is free; a dangling
0-junction, a source Sf = 0 and the ground leave one without flow whose effort is free. A bond without effort is no term at a
1-junction; at a 0-junction it takes the effort of all the others; through a transformer it goes on without effort, through a
gyrator without flow; a one-port on it has no power. The same holds with flow and effort exchanged. So all of them can be
dropped alike, and every port that stays has the effort and the flow that it had.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Set
from dataclasses import replace
from itertools import chain, count
from typing import NamedTuple

from bondgraph.connections import neighbours, reached_from
from bondgraph.elements import JUNCTIONS, ONE_PORTS, TWO_PORTS, Element
from bondgraph.faults import GraphError, refuse
from bondgraph.graph import Bond, BondGraph

SHARING = {"Se": "0", "Sf": "1"}  # the junction where one bond without effort (flow) leaves none to the others
_DUAL = {"Se": "Sf", "Sf": "Se"}


class Pin(NamedTuple):
    """A bond seen from its end `at`: its effort is 0 and its flow free (zero "Se"), or the other way round ("Sf")."""

    bond: Bond
    at: str
    zero: str


class _Cut(NamedTuple):
    """Elements and bonds that go, and the junctions that stay, held by a zero source of this kind."""

    names: set[str]
    bonds: set[int]
    held: dict[str, str]


def without(graph: BondGraph, start: str, pins: Iterable[Pin], kept: frozenset[str]) -> tuple[BondGraph, str] | None:
    """The graph without an element and all that has no power then.

    Args:
        graph: the graph; it is left as it is.
        start: the element that goes.
        pins: its bonds, seen from their other ends.
        kept: elements that must stay; so must 1-junctions where something is measured.

    Returns:
        The new graph, and the words for what went; None if the graph would fall apart.

    Raises:
        GraphError: where a source contradicts the zeros, or where nothing is left.

    """
    staying = kept | graph.measured
    cut = _spread(graph, start, pins, staying)
    sources, fresh = _holding(graph, cut)
    bonds = [b for b in graph.bonds if b.number not in cut.bonds] + fresh
    elements = {n: e for n, e in graph.elements.items() if n not in cut.names} | {s.name: s for s in sources}
    pieces = list(_pieces(elements, bonds, staying))
    if not pieces:
        raise GraphError(f"nothing is left without {graph.title(start)}: no element has power")
    if len(pieces) > 1:
        return None
    gone = graph.elements.keys() - pieces[0]
    what = [
        f"{titles(graph, gone)} dropped",
        *(f"{s.kind}:{s.name} = 0 holds {b.head}" for s, b in zip(sources, fresh, strict=True)),
    ]
    return edited(graph, [b for b in bonds if b.tail in pieces[0]], gone, sources), ", ".join(what)


def _spread(graph: BondGraph, start: str, pins: Iterable[Pin], staying: Set[str]) -> _Cut:
    """Follow bonds without effort (flow) from `start` on."""
    cut, todo = _Cut({start}, set(), {}), list(pins)
    stuck: list[Pin] = []
    faults: list[str] = []
    while todo:
        pin = todo.pop()
        kind = graph.elements[pin.at].kind
        faults += _contradiction(graph, pin)
        if kind in JUNCTIONS and (kind != SHARING[pin.zero] or pin.at in cut.names | staying):
            cut.bonds.add(pin.bond.number)
            cut.held.update({pin.at: pin.zero} if kind == SHARING[pin.zero] and pin.at in staying else {})
        elif pin.at not in staying and _passes(graph, pin):
            cut.bonds.add(pin.bond.number)
            cut.names.add(pin.at)
            zero = _DUAL[pin.zero] if kind == "GY" else pin.zero
            todo += [Pin(b, b.other(pin.at), zero) for b in graph.at(pin.at) if b.number not in cut.bonds]
        else:
            stuck.append(pin)
    refuse(dict.fromkeys(faults))
    cut.held.update({pin.bond.other(pin.at): pin.zero for pin in stuck if pin.bond.number not in cut.bonds})
    cut.names.difference_update(cut.held)
    return cut


def _passes(graph: BondGraph, pin: Pin) -> bool:
    """Whether an element adds nothing but zeros and what is free, for any value that its law may take."""
    element = graph.elements[pin.at]
    if element.kind in ONE_PORTS:
        return element.kind != pin.zero or element.law == 0.0
    if element.kind not in TWO_PORTS or _not_zero(element.law):
        return True
    enters = pin.bond.head == pin.at  # f_out = T f_in and e_in = T e_out carry a zero on if it is their right-hand side
    return pin.zero == "Sf" if element.kind == "GY" else enters == (pin.zero == "Sf")


def _not_zero(law: object) -> bool:
    return isinstance(law, float | int) and law != 0


def _contradiction(graph: BondGraph, pin: Pin) -> list[str]:
    element = graph.elements[pin.at]
    if element.kind != pin.zero or not _not_zero(element.law):
        return []
    what = {"Se": "an effort", "Sf": "a flow"}[pin.zero]
    where = f"bond {pin.bond.number}: {graph.label(pin.at)} sets {what} that the rest keeps at 0"
    return [f"{where}; drop it or hang it elsewhere"]


def _holding(graph: BondGraph, cut: _Cut) -> tuple[list[Element], list[Bond]]:
    """Zero sources for the held junctions that keep none of their own; a new name, for what it holds back is new.

    A junction that two zeros hold keeps one: what each of them held back was undetermined, and has no power.
    """
    left = [b for b in graph.bonds if b.number not in cut.bonds]
    sources: list[Element] = []
    bonds: list[Bond] = []
    for name, kind in cut.held.items():
        if not is_held(graph, name, kind, left) and not _equal(graph, name, left) & {b.head for b in bonds}:
            sources.append(Element(kind, fresh_name(graph, f"{name}.zero"), 0.0, graph.elements[name].domain))
            bonds.append(new_bond(graph, sources[-1].name, name, len(bonds)))
    return sources, bonds


def is_held(graph: BondGraph, junction: str, kind: str, bonds: Iterable[Bond]) -> bool:
    """Whether, by these bonds, a source of value 0 of this kind holds a junction or an equal one that is joined to it."""
    group = _equal(graph, junction, bonds)
    around = [graph.elements[name] for bond in bonds if group & set(bond[1:]) for name in bond[1:]]
    return any(element.kind == kind and element.law == 0.0 for element in around)


def _equal(graph: BondGraph, junction: str, bonds: Iterable[Bond]) -> set[str]:
    """The junction and those of its kind that these bonds join to it."""
    same = {name for name, e in graph.elements.items() if e.kind == graph.elements[junction].kind}
    return reached_from(junction, neighbours(same, [b for b in bonds if same.issuperset(b[1:])]))


def _pieces(elements: Mapping[str, Element], bonds: Iterable[Bond], staying: Set[str]) -> Iterator[set[str]]:
    """The connected pieces that a graph falls into; junctions and two-ports alone are none."""
    near, left = neighbours(elements, bonds), set(elements)
    for name in elements:
        if name in left:
            piece = reached_from(name, near)
            left -= piece
            if any(n in staying or elements[n].kind in ONE_PORTS for n in piece):
                yield piece


def edited(graph: BondGraph, bonds: Iterable[Bond], gone: Collection[str] = (), added: Iterable[Element] = ()) -> BondGraph:
    """The graph with these bonds, without the elements that are gone, and with those added."""
    elements = {name: element for name, element in graph.elements.items() if name not in gone}
    return replace(graph, elements=elements | {e.name: e for e in added}, bonds=tuple(sorted(bonds)))


def titles(graph: BondGraph, names: Collection[str]) -> str:
    """These elements as they are drawn: `1:crank, MTF:T`."""
    return ", ".join(graph.title(name) for name in graph.elements if name in names)


def fresh_name(graph: BondGraph, name: str) -> str:
    """The name itself, or the first of NAME.2, NAME.3... that is still free."""
    names = chain([name], (f"{name}.{k}" for k in count(2)))
    return next(n for n in names if n not in graph.elements)


def new_bond(graph: BondGraph, tail: str, head: str, ahead: int = 0) -> Bond:
    """A bond with the next free number, or one further ahead."""
    return Bond(max(bond.number for bond in graph.bonds) + 1 + ahead, tail, head)
