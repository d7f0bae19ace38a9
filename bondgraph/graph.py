"""The graph itself: named elements, numbered bonds, declared displacements, signals and parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

from bondgraph.checks import bond_domains, structural_faults
from bondgraph.domains import DOMAINS, Domain
from bondgraph.elements import JUNCTIONS, Displacement, Element, Law, Modulus
from bondgraph.faults import GraphError, refuse
from bondgraph.laws import OWN, Function, law_of

CONVENTION = "f_out = T f_in, e_in = T e_out"


class Bond(NamedTuple):
    """A numbered bond; its half arrow points from `tail` to `head`, where power counts as positive."""

    number: int
    tail: str
    head: str

    def other(self, name: str) -> str:
        """The element at the other end."""
        return self.head if name == self.tail else self.tail

    def sign(self, name: str) -> float:
        """+1 where power flows into an element along the half arrow, -1 where it flows out."""
        return 1.0 if self.head == name else -1.0


@dataclass(frozen=True, eq=False)
class BondGraph:
    """A checked bond graph. Write one with `bondgraph.Builder`; `str(graph)` lists it with its convention.

    Args:
        elements: by name.
        bonds: numbered, each with its half arrow from tail to head.
        displacements: declared integrals of the flows of 1-junctions, by name.
        signals: names of functions of time that laws may use and a simulation is given.
        parameters: named constants that laws may use; None where the value is still open.

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

    def __post_init__(self) -> None:
        refuse(structural_faults(self))

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

    def ends(self, name: str) -> tuple[Bond, Bond]:
        """The bonds that enter and leave a two-port."""
        first, second = self.at(name)
        return (first, second) if first.head == name else (second, first)

    def bond_of(self, name: str) -> Bond:
        """The one bond of a one-port."""
        return self.at(name)[0]

    def of_kind(self, *kinds: str) -> tuple[Element, ...]:
        """The elements of these kinds, in the order in which they were named."""
        return tuple(element for element in self.elements.values() if element.kind in kinds)

    def depends_on(self, name: str) -> tuple[str, ...]:
        """The displacements, signals and `t` that an element's law varies with, its own flow or displacement left out."""
        law = self.elements[name].law
        if isinstance(law, Modulus | Law):
            return (next((d.name for d in self.displacements.values() if d.of == law.motion.of), law.motion.of),)
        own = OWN.get(self.elements[name].kind)
        names = law.of if isinstance(law, Function) else ()
        return tuple(n for n in names if n not in self.parameters and n != own)

    def is_linear(self, name: str) -> bool:
        """Whether an element's law is one constant (e = R f, e = q/C, p = I f, a fixed ratio), parameters allowed."""
        law = self.elements[name].law
        if isinstance(law, Function):
            return all(n in self.parameters for n in law.of)
        return isinstance(law, float | int)

    def is_curve(self, name: str) -> bool:
        """Whether an element's law is a function of its own flow (a resistor's) or its own displacement (a compliance's)."""
        element = self.elements[name]
        return isinstance(element.law, Function) and OWN.get(element.kind) in element.law.of

    def symbol(self, name: str) -> str:
        """The kind as it is drawn: MSe, MTF, MR... where the law varies with displacements, time or signals."""
        element = self.elements[name]
        modulated = element.kind not in JUNCTIONS | {"C"} and self.depends_on(name)
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
        return self.title(name) + (f" = {law:g}" if isinstance(law, float | int) else "")

    @property
    def motions(self) -> tuple[str, ...]:
        """The 1-junctions whose displacements the motions of laws and moduli refer to, in the order of the elements."""
        laws = [element.law for element in self.elements.values()]
        return tuple(dict.fromkeys(law.motion.of for law in laws if isinstance(law, Modulus | Law)))

    @property
    def measured(self) -> frozenset[str]:
        """The 1-junctions whose flow is integrated: by declared displacements, and by the motions of laws and moduli."""
        return frozenset({*self.motions, *(d.of for d in self.displacements.values())})

    def domain(self, bond: Bond) -> Domain | None:
        """The energy domain of a bond; None where nobody named it."""
        return DOMAINS.get(self._domains.get(bond.number, ""))

    @cached_property
    def _domains(self) -> Mapping[int, str]:
        return bond_domains(self.elements, self.bonds)

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
        """The number that an element's constant law stands for, its parameters filled in."""
        law = self.elements[name].law
        if isinstance(law, float | int):
            return float(law)
        if not isinstance(law, Function) or not self.is_linear(name):
            raise GraphError(f"{self.title(name)} is no constant")
        return float(law(*(self.parameter(n, name) for n in law.of)))

    def parameter(self, parameter: str, element: str) -> float:
        """A parameter's value for the law of an element; an error where it is still open."""
        value = self.parameters[parameter]
        if value is None:
            where = f"{self.title(element)}, bond {self.at(element)[0].number}"
            raise GraphError(f"parameter {parameter!r} ({where}) has no value: graph.with_parameters({parameter}=...)")
        return value

    def __str__(self) -> str:
        lines = [f"bond graph: {len(self.elements)} elements, {len(self.bonds)} bonds ({CONVENTION})"]
        lines += [f"{b.number:4d}  {self.label(b.tail)} -> {self.label(b.head)}" for b in self.bonds]
        return "\n".join(lines)


def as_graph(given: Any) -> BondGraph:
    """What a function of graphs was given, if it is one; a GraphError that says what to do if not."""
    if isinstance(given, BondGraph):
        return given
    advice = "; call its build() first" if hasattr(given, "build") else ""
    raise GraphError(f"found a {type(given).__name__}, expected a BondGraph{advice}")
