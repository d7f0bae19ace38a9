"""Writing a graph by hand: step by step, and from parts with open ports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bondgraph.elements import GY, JUNCTIONS, SOURCES, TF, Displacement, Element, Law, Modulus, One, Zero
from bondgraph.graph import Bond, BondGraph, dead_ends
from bondgraph.laws import OWN, TIME, Function, GraphError, refuse


@dataclass(frozen=True, eq=False)
class Part:
    """A sub-graph with open ports: junctions that bonds of a bigger graph may join. Made by `Builder.part`."""

    elements: Mapping[str, Element]
    bonds: tuple[Bond, ...]
    displacements: Mapping[str, Displacement]
    signals: tuple[str, ...]
    parameters: Mapping[str, float | None]
    ports: Mapping[str, str]


class Builder:
    """Writes a graph step by step; `build()` checks it. Every step but `add` returns the builder, so steps chain.

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
        """Add an element, not yet bonded; its name must be new. Returns the name."""
        if not isinstance(element, Element):
            raise GraphError(f"found {element!r}, expected an element, such as I('J', 2.0)")
        if not isinstance(element.name, str) or not element.name:
            raise GraphError(f"found {element.name!r} as a name, expected a text that is not empty")
        if element.name in self._elements:
            raise GraphError(f"two elements are named {element.name!r}: give one of them another name (name=...)")
        self._elements[element.name] = element
        return element.name

    def one(self, name: str, domain: str = "", *, displacement: str | None = None, initial: float = 0.0) -> Builder:
        """Add a 1-junction, and declare the integral of its flow under the name `displacement` if one is given."""
        self.add(One(name, domain))
        return self if displacement is None else self.displacement(displacement, name, initial)

    def zero(self, name: str, domain: str = "") -> Builder:
        """Add a 0-junction."""
        self.add(Zero(name, domain))
        return self

    def displacement(self, name: str, of: str, initial: float = 0.0) -> Builder:
        """Declare the integral of the flow of the 1-junction `of`, so that laws may depend on it."""
        if name in self._displacements:
            raise GraphError(f"two displacements are named {name!r}")
        self._displacements[name] = Displacement(name, of, float(initial))
        return self

    def signal(self, *names: str) -> Builder:
        """Declare functions of time that laws may depend on; a simulation is given them."""
        self._signals += [name for name in names if name not in self._signals]
        return self

    def parameter(self, **values: float | None) -> Builder:
        """Declare named constants that laws may use, with their values (None: left open)."""
        self._parameters |= values
        return self

    def bond(self, tail: str, head: str) -> Builder:
        """Join two elements by the next bond, half arrow at `head`."""
        self._bonds.append(Bond(len(self._bonds) + 1, tail, head))
        return self

    def port(self, junction: str, element: Element) -> Builder:
        """Hang a one-port on a junction: power flows out of sources and into everything else."""
        name = self.add(element)
        return self.bond(*((name, junction) if element.kind in SOURCES else (junction, name)))

    def on(self, junction: str, *elements: Element) -> Builder:
        """Hang one-ports on a junction, each as `port` does."""
        for element in elements:
            self.port(junction, element)
        return self

    def between(self, first: str, second: str, *elements: Element, name: str | None = None) -> Builder:
        """Hang one-ports on the difference of two flows, f_first - f_second, through a 0-junction."""
        node = name or f"{first}-{second}"
        self.zero(node).bond(first, node).bond(node, second)
        if len(elements) == 1:
            return self.port(node, elements[0])
        return self.one(f"{node}.rate").bond(node, f"{node}.rate").on(f"{node}.rate", *elements)

    def transform(self, source: str, target: str, ratio: Any, *, name: str | None = None) -> Builder:
        """Join two junctions by a transformer, named after them unless told: f_target = ratio f_source."""
        element = self.add(TF(name or f"{source}->{target}", ratio))
        return self.bond(source, element).bond(element, target)

    def gyrate(self, source: str, target: str, ratio: Any, *, name: str | None = None) -> Builder:
        """Join two junctions by a gyrator, named after them unless told: e_target = ratio f_source."""
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
        """Put a part into this graph: its names get `name.` in front; bonds then join its ports `name.port`.

        Parameters, signals and the time are shared by name, displacements are the part's own. A parameter that the part
        leaves open takes the graph's value; two values that differ are a fault.
        """
        own = {old: f"{name}.{old}" for old in part.elements}
        own |= {junction: f"{name}.{port}" for port, junction in part.ports.items()}
        measured = {old: f"{name}.{old}" for old in part.displacements}
        for element in part.elements.values():
            self.add(element._replace(name=own[element.name], law=_renamed(element, own, measured)))
        for displacement in part.displacements.values():
            self.displacement(measured[displacement.name], own.get(displacement.of, displacement.of), displacement.initial)
        for bond in part.bonds:
            self.bond(own.get(bond.tail, bond.tail), own.get(bond.head, bond.head))
        for parameter, value in part.parameters.items():
            known = self._parameters.get(parameter)
            if known is not None and value is not None and known != value:
                raise GraphError(
                    f"parameter {parameter!r}: found {value} in part {name!r}, but {known} before; leave one open"
                )
            self._parameters[parameter] = value if known is None else known
        return self.signal(*part.signals)

    def __len__(self) -> int:
        return len(self._elements)

    def __contains__(self, name: str) -> bool:
        return name in self._elements

    def part(self, *ports: str, **named: str) -> Part:
        """What was written so far as a part: its open ports are these junctions, under their own or other names."""
        open_ports = {port: port for port in ports} | named
        for port, junction in open_ports.items():
            if junction not in self._elements or self._elements[junction].kind not in JUNCTIONS:
                raise GraphError(f"port {port!r}: {junction!r} is no junction of the part")
            if list(open_ports.values()).count(junction) > 1:
                raise GraphError(f"port {port!r}: {junction!r} is open under two names; give it one")
        return Part(**self._written(), ports=open_ports)

    def build(self, *, loose: bool = False) -> BondGraph:
        """The checked graph. Junctions that nothing hangs on are a fault unless `loose`, which is for simplifying."""
        graph = BondGraph(**self._written())
        refuse(() if loose else dead_ends(graph))
        return graph

    def _written(self) -> dict[str, Any]:
        """What was written so far, copied, by the fields that a graph and a part share."""
        return {
            "elements": dict(self._elements),
            "bonds": tuple(self._bonds),
            "displacements": dict(self._displacements),
            "signals": tuple(self._signals),
            "parameters": dict(self._parameters),
        }


def _renamed(element: Element, elements: Mapping[str, str], displacements: Mapping[str, str]) -> Any:
    law = element.law
    if isinstance(law, Function):
        fixed = (TIME, OWN.get(element.kind))
        return law.renamed({old: new for old, new in displacements.items() if old not in fixed})
    if isinstance(law, Modulus | Law):
        return law._replace(motion=law.motion._replace(of=elements.get(law.motion.of, law.motion.of)))
    return law
