"""What a walk over a graph looks up: found once, the same at every state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from bondgraph.elements import Element, Law, Modulus
from bondgraph.laws import Function
from bondgraph.motion.formulation import Formulation, Port, ratios


class Tables(NamedTuple):
    """What a walk looks up, found once for a graph."""

    form: Formulation
    signals: Mapping[str, Function]
    moduli: tuple[tuple[Any, str], ...]  # varying ratios and the transformers' names
    support: tuple[tuple[int, ...], ...]  # by flow variable, the coordinates that it depends on
    owner_of: Mapping[str, int]  # displacement -> flow variable
    displacement_of: Mapping[str, str]  # 1-junction -> displacement
    inertias: tuple[tuple[float, int], ...]
    springs: tuple[Port, ...]
    imposed: tuple[Element, ...]
    acting: tuple[int, ...]  # places in `form.ports` whose effort a law gives
    partner: Mapping[int, int]  # gyrator's bond -> flow variable at its other side
    static: frozenset[int]
    iterated: bool
    loose: str  # the flows that no inertia weighs, by name
    anchored: tuple[str, ...]


def tables(form: Formulation, signals: Mapping[str, Function]) -> Tables:
    """Look everything up that does not change from state to state."""
    graph = form.graph
    elements = {id(e.law): e.name for e in graph.elements.values() if e.law is not None}
    moduli = {id(r): r for step in form.steps for r in ratios(step) if isinstance(r, Function | Modulus)}
    return Tables(
        form=form,
        signals=signals,
        moduli=tuple((ratio, elements[key]) for key, ratio in moduli.items()),
        support=tuple(form.support[v] for v in range(len(form.support))),
        owner_of={d.name: form.variable(d.of) for d in form.displacements},
        displacement_of={d.of: d.name for d in reversed(form.displacements)},
        inertias=tuple(
            (graph.constant(p.element.name), p.variable) for p in form.ports if p.element.kind == "I" and p.element.law
        ),
        springs=tuple(p for p in form.ports if p.element.kind == "C" and not isinstance(p.element.law, Law)),
        imposed=tuple(p.element for p in form.ports if p.element.kind == "Sf"),
        acting=tuple(k for k, p in enumerate(form.ports) if p.element.kind in ("Se", "C", "R", "GY")),
        partner=_partners(form),
        static=form.static,
        iterated=_iterated(form),
        loose=", ".join(form.name_of(form.coordinates.all[k]) for k in form.massless),
        anchored=graph.motions,
    )


def _partners(form: Formulation) -> dict[int, int]:
    """Of each gyrator's bond, the flow variable at its other side."""
    partner: dict[int, int] = {}
    for gyrator in form.graph.of_kind("GY"):
        into, out = form.graph.ends(gyrator.name)
        partner |= {into.number: form.flow[out.number], out.number: form.flow[into.number]}
    return partner


def _iterated(form: Formulation) -> bool:
    """Whether a massless flow meets a resistor whose law is no straight line, so that its equation takes iterations."""
    curved = [p for p in form.ports if p.element.kind == "R" and form.graph.is_curve(p.element.name)]
    return any(k in form.support[p.variable] for p in curved for k in form.massless)
