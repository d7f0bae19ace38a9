"""Graphs whose junctions are switched, or whose resistors hold at rest, in each of their modes.

A mode says of every switched junction whether it is on, and of every resistor whose effort jumps where its flow changes its
sign (dry friction) whether it slides forwards, backwards or sticks. In a mode the graph is an ordinary one with strokes and
states of its own (`mode`): a 1-junction that is off is as many flows of 0 as it has bonds, a 0-junction efforts of 0, a
resistor that sticks a flow of 0.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bondgraph.elements import OWN_FLOW, Element, Function, GraphError, refuse
from bondgraph.graph import BondGraph, as_graph, new_bond

TINY = 1e-300  # a flow of either sign, by which a law that jumps is asked for its two values
_TRIED = (0.37, -0.71, 1.0)  # values of what a law depends on, at which a jump is searched for
_SMALL = 1e-12  # a flow at which a law that jumps is still what it is beside its jump, and one with a pole is not
_JUMP = 1e-9  # of the law at 1: less is none


def mode(graph: BondGraph, **states: Any) -> BondGraph:
    """A graph with some of its switched junctions on or off, and dry resistors sliding (1, -1) or at rest (0).

    Raises:
        GraphError: for a name that is neither.

    >>> from bondgraph import Builder, I, causality
    >>> b = Builder().one("a").one("b").zero("clutch", when=lambda t: t > 1).bond("a", "clutch").bond("clutch", "b")
    >>> graph = b.on("a", I("J1", 2.0)).on("b", I("J2", 3.0)).build()
    >>> causality(mode(graph, clutch=False)).integral, causality(mode(graph, clutch=True)).integral
    (('J1', 'J2'), ('J1',))

    """
    graph = as_graph(graph)
    dry = dry_resistors(graph)
    names = ", ".join((*graph.switched, *dry)) or "none"
    refuse(f"mode {n!r}: nothing that is switched; found {names}" for n in states if n not in (*graph.switched, *dry))
    elements, bonds = dict(graph.elements), list(graph.bonds)

    def hang(junction: str, name: str, kind: str) -> None:
        elements[name] = Element(kind, name, 0.0)
        bonds.append(new_bond(bonds, name, junction))

    for name, state in states.items():
        kind, law = graph.elements[name].kind, graph.elements[name].law
        elements[name] = elements[name]._replace(law=None)
        if kind == "R" and state:
            elements[name] = elements[name]._replace(law=_sliding(graph, name, state))
        elif kind == "R":  # it takes whatever holds it
            elements[name] = Element("Sf", name, 0.0, graph.elements[name].domain)
        elif not state:
            assert isinstance(law, Function)
            source = "Sf" if kind == "1" else "Se"
            hang(name, f"{name}.off", source)
            for k, bond in enumerate(graph.at(name)[1:], 2):
                other, place = f"{name}.{k}", bonds.index(next(b for b in bonds if b.number == bond.number))
                elements[other] = Element(kind, other, None, graph.elements[name].domain)
                bonds[place] = bond.moved(name, other)
                hang(other, f"{other}.off", source)
    return replace(graph, elements=elements, bonds=tuple(bonds), parts=True)


def dry_resistors(graph: BondGraph) -> tuple[str, ...]:
    """The resistors whose effort jumps where their flow changes its sign.

    >>> import numpy as np
    >>> from bondgraph import Builder, I, R
    >>> b = Builder().one("a").on("a", I("m", 1.0), R("rub", lambda f: 2.0 * np.sign(f)), R("oil", lambda f: f * abs(f)))
    >>> dry_resistors(b.build())
    ('rub',)
    """
    resistors = []
    for element in graph.of_kind("R"):
        law = element.law
        if graph.own(element.name) != OWN_FLOW or not isinstance(law, Function):
            continue
        for other in _TRIED:
            values = [graph.parameters.get(n, other) or other for n in law.of]
            own = law.of.index(OWN_FLOW)
            flows = (-TINY, TINY, -_SMALL, _SMALL, 1.0)
            try:
                with np.errstate(all="ignore"):
                    low, high, under, over, one = (float(law(*values[:own], f, *values[own + 1 :])) for f in flows)
            except (ValueError, ArithmeticError, TypeError, GraphError):
                continue
            least = _JUMP * max(abs(one), abs(high))
            if high - low > least and max(abs(high - over), abs(low - under)) < _SMALL * abs(high - low) / _JUMP:
                resistors.append(element.name)
                break
    return tuple(resistors)


def _sliding(graph: BondGraph, name: str, way: int) -> Function:
    """A dry resistor's law on one side of its jump, continued past it."""
    law = graph.elements[name].law
    assert isinstance(law, Function)
    own = law.of.index(OWN_FLOW)

    def beside(*values: Any) -> Any:
        flow = np.maximum(values[own], TINY) if way > 0 else np.minimum(values[own], -TINY)
        return law(*values[:own], flow, *values[own + 1 :])

    return Function(beside, law.arguments, law.of)
