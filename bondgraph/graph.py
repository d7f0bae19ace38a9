"""The graph itself: named elements, numbered bonds, and the checks of its structure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from bondgraph.elements import JUNCTIONS, ONE_PORTS, TF, TWO_PORTS, Element, GraphError, Modulus, One, Zero

CONVENTION = "f_out = T f_in, e_in = T e_out"


class Bond(NamedTuple):
    """A numbered bond; its half arrow points from `tail` to `head`, where power counts as positive."""

    number: int
    tail: str
    head: str


@dataclass(frozen=True, eq=False)
class BondGraph:
    """A checked bond graph. Build one with `Builder`; `str(graph)` lists it with its convention."""

    elements: Mapping[str, Element]
    bonds: tuple[Bond, ...]

    def __post_init__(self) -> None:
        faults = list(structural_faults(self.elements, self.bonds))
        if faults:
            raise GraphError("\n".join(faults))

    def at(self, name: str) -> tuple[Bond, ...]:
        """The bonds of one element."""
        return self._incident[name]

    @cached_property
    def _incident(self) -> Mapping[str, tuple[Bond, ...]]:
        found: dict[str, tuple[Bond, ...]] = dict.fromkeys(self.elements, ())
        for bond in self.bonds:
            found[bond.tail] += (bond,)
            found[bond.head] += (bond,)
        return found

    def with_law(self, name: str, law: float | Modulus) -> BondGraph:
        """The same graph with another law for one element, such as a changed transformer ratio."""
        element = self.elements[name]._replace(law=law)
        return BondGraph({**self.elements, name: element}, self.bonds)

    def __str__(self) -> str:
        lines = [f"bond graph: {len(self.elements)} elements, {len(self.bonds)} bonds ({CONVENTION})"]
        lines += [f"{b.number:4d}  {self._label(b.tail)} -> {self._label(b.head)}" for b in self.bonds]
        return "\n".join(lines)

    def _label(self, name: str) -> str:
        element = self.elements[name]
        value = f" = {element.law:g}" if isinstance(element.law, int | float) else ""
        return f"{element.symbol}:{name}{value}"


def structural_faults(elements: Mapping[str, Element], bonds: tuple[Bond, ...]) -> Iterator[str]:
    """Everything that keeps elements and bonds from being a bond graph, one line each."""
    unknown = [f"bond {b.number}: no element {n!r}" for b in bonds for n in b[1:] if n not in elements]
    if unknown:
        yield from unknown
        return
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
    yield from _unreached(elements, bonds)


def _unreached(elements: Mapping[str, Element], bonds: tuple[Bond, ...]) -> Iterator[str]:
    neighbours: dict[str, list[str]] = {name: [] for name in elements}
    for bond in bonds:
        neighbours[bond.tail].append(bond.head)
        neighbours[bond.head].append(bond.tail)
    start = next(iter(elements), None)
    if start is None:
        yield "the graph is empty"
        return
    seen, todo = {start}, [start]
    while todo:
        fresh = [name for name in neighbours[todo.pop()] if name not in seen]
        seen.update(fresh)
        todo.extend(fresh)
    if len(seen) < len(elements):
        yield "not connected to the rest: " + ", ".join(name for name in elements if name not in seen)


class Builder:
    """Writes a graph step by step; `build()` checks it.

    >>> from bondgraph import I, One, Se
    >>> b = Builder()
    >>> b.add(One("crank"))
    'crank'
    >>> b.port("crank", I("J", 2.0))
    >>> b.port("crank", Se("M", 3.0))
    >>> print(b.build())
    bond graph: 3 elements, 2 bonds (f_out = T f_in, e_in = T e_out)
       1  1:crank -> I:J = 2
       2  Se:M = 3 -> 1:crank
    """

    def __init__(self) -> None:
        self._elements: dict[str, Element] = {}
        self._bonds: list[Bond] = []

    def add(self, element: Element) -> str:
        """Add an element; its name must be new."""
        if element.name in self._elements:
            raise GraphError(f"two elements are named {element.name!r}")
        self._elements[element.name] = element
        return element.name

    def bond(self, tail: str, head: str) -> None:
        """Join two elements by the next bond, half arrow at `head`."""
        self._bonds.append(Bond(len(self._bonds) + 1, tail, head))

    def port(self, junction: str, element: Element) -> None:
        """Hang a one-port on a junction: power flows out of sources and into everything else."""
        name = self.add(element)
        self.bond(*((name, junction) if element.kind in ("Se", "Sf") else (junction, name)))

    def transform(self, source: str, target: str, ratio: float | Modulus) -> None:
        """Join two junctions by a transformer named after them: f_target = ratio f_source."""
        name = self.add(TF(f"{source}->{target}", ratio))
        self.bond(source, name)
        self.bond(name, target)

    def sum(self, target: str, terms: list[tuple[str, float | Modulus]], domain: str) -> None:
        """A new 1-junction `target` whose flow is the sum of ratio times flow of others (through a 0-junction)."""
        self.add(One(target, domain))
        if len(terms) == 1:
            self.transform(terms[0][0], target, terms[0][1])
            return
        node = self.add(Zero(f"{target}.sum", domain))
        for source, ratio in terms:
            self.transform(source, node, ratio)
        self.bond(node, target)

    def __len__(self) -> int:
        return len(self._elements)

    def build(self) -> BondGraph:
        """The checked graph."""
        return BondGraph(dict(self._elements), tuple(self._bonds))
