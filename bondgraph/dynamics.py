"""The equations of motion of a graph in numbers: from a state to its rates, and to every flow and effort.

One walk (`bondgraph.walk`) serves one state, many at once (arrays, for the power audit), symbols, and a recording of itself
as straight-line code, which is what time stepping runs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

from bondgraph.elements import Law, Modulus
from bondgraph.faults import GraphError
from bondgraph.formulation import Formulation, ratios
from bondgraph.graph import BondGraph
from bondgraph.laws import Function, function
from bondgraph.recording import Node, Recorder
from bondgraph.walk import Instant, Tables, Walk

Rates = Callable[..., tuple[Any, ...]]


class State(NamedTuple):
    """What the state of a graph consists of: names, in order, and how many are flows, displacements and springs'."""

    names: tuple[str, ...]
    flows: int
    displacements: int


class Dynamics:
    """A graph ready to be evaluated.

    The state holds, in this order: the independent flows that inertia weighs (`f_` and the 1-junction's name), the
    displacements that are declared or that motions refer to (by name), and the springs' own (`q_` and the spring's name).

    >>> from bondgraph import Builder, C, I
    >>> b = Builder().one("mass", "translation", displacement="x").on("mass", I("m", 2.0), C("spring", stiffness=8.0))
    >>> dynamics = Dynamics(b.build())
    >>> dynamics.state.names
    ('f_mass', 'x', 'q_spring')
    >>> dynamics.at(0.0, [0.0, 1.0, 1.0]).rates
    [-4.0, 0.0, 0.0]

    """

    def __init__(self, graph: BondGraph, signals: Mapping[str, Any] | None = None) -> None:
        self.graph = graph
        self.signals = _checked_signals(graph, signals or {})
        self.form = Formulation(graph)
        self.tables = _tables(self.form, self.signals)
        moving = self.form.coordinates.moving
        names = [f"f_{self.form.name_of(v)}" for v in moving]
        names += [d.name for d in self.form.displacements]
        names += [f"q_{p.element.name}" for p in self.tables.springs]
        self.state = State(tuple(names), len(moving), len(self.form.displacements))

    def at(self, t: Any, state: Sequence[Any], anchors: Mapping[str, Any] | None = None) -> Instant:
        """Flows, efforts and rates at a time t (s) and a state (numbers, or arrays of the same shape, one per name).

        `anchors` gives, by 1-junction, the displacement in the middle of the smooth piece that laws of motion are in.
        """
        return Walk(self.tables, t, state, anchors or {}).instant()

    @property
    def anchored(self) -> tuple[str, ...]:
        """The 1-junctions that motions refer to: those whose anchors matter, in the order that `rates` takes them."""
        return self.tables.anchored

    @cached_property
    def rates(self) -> Rates:
        """(t, *state, *anchors) -> rates of the state, recorded as straight-line code where nothing has to be iterated."""
        count = len(self.state.names)

        def walked(t: Any, *values: Any) -> tuple[Any, ...]:
            anchors = dict(zip(self.anchored, values[count:], strict=True))
            return tuple(Walk(self.tables, t, values[:count], anchors).rates())

        if self.tables.iterated:
            return walked
        recorder = Recorder()
        return recorder.function(walked(*recorder.inputs(1 + count + len(self.anchored))))


def _checked_signals(graph: BondGraph, signals: Mapping[str, Any]) -> dict[str, Function]:
    faults = [f"no signal {name!r}: the graph declares {', '.join(graph.signals) or 'none'}" for name in signals]
    faults = [fault for name, fault in zip(signals, faults, strict=True) if name not in graph.signals]
    faults += [
        f"signal {name!r} has no function of t: signals={{{name!r}: ...}}" for name in graph.signals if name not in signals
    ]
    found = {}
    for name, given in signals.items():
        found[name] = function(given if callable(given) or hasattr(given, "free_symbols") else _constantly(float(given)))
        if len(found[name].of) > 1:
            faults.append(f"signal {name!r}: found a function of {', '.join(found[name].of)}, expected one of t")
    if faults:
        raise GraphError("\n".join(faults))
    return found


def _constantly(value: float) -> Callable[[Any], Any]:
    return lambda t: value + 0.0 * t


def _tables(form: Formulation, signals: Mapping[str, Function]) -> Tables:
    graph = form.graph
    elements = {id(e.law): e.name for e in graph.elements.values() if e.law is not None}
    moduli = {id(r): r for step in form.steps for r in ratios(step) if not isinstance(r, float | int)}
    laws = [e.law for e in graph.elements.values()]
    motions = [law.motion.of for law in laws if isinstance(law, Modulus | Law)]
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
        static=_static(form),
        iterated=_iterated(form),
        anchored=tuple(dict.fromkeys(motions)),
    )


def _partners(form: Formulation) -> dict[int, int]:
    """Of each gyrator's bond, the flow variable at its other side."""
    partner: dict[int, int] = {}
    for gyrator in form.graph.of_kind("GY"):
        into, out = form.graph.ends(gyrator.name)
        partner |= {into.number: form.flow[out.number], out.number: form.flow[into.number]}
    return partner


def _held_by(form: Formulation, k: int) -> set[str]:
    return {p.element.kind for p in form.ports if k in form.support[p.variable]}


def _static(form: Formulation) -> frozenset[int]:
    """Massless flows that only springs hold: the springs' efforts are tied, so the rates of their displacements are."""
    for k in form.massless:
        if not _held_by(form, k) & {"R", "GY", "C"}:
            where = form.name_of(form.coordinates.all[k])
            raise GraphError(f"nothing holds the flow of {where}: it meets no inertia, resistor, spring or gyrator")
    return frozenset(k for k in form.massless if not _held_by(form, k) & {"R", "GY"})


def _iterated(form: Formulation) -> bool:
    """Whether a massless flow meets a resistor whose law is no straight line, so that its equation takes iterations."""
    bent = [p for p in form.ports if p.element.kind == "R" and "f" in getattr(p.element.law, "of", ())]
    return any(k in form.support[p.variable] for p in bent for k in form.massless)


__all__ = ["Dynamics", "Instant", "Node", "State"]
