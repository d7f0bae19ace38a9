"""The equations of motion of a graph in numbers: from a state to its rates, and to every flow and effort.

One walk (`bondgraph.motion.walk`) serves one state, many at once (arrays, for the power audit), symbols, and a recording
of itself as straight-line code, which is what time stepping runs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple

from bondgraph.faults import refuse
from bondgraph.graph import BondGraph, as_graph
from bondgraph.laws import Function, function, is_symbolic
from bondgraph.motion.formulation import Formulation
from bondgraph.motion.newton import Balance, settle
from bondgraph.motion.recording import Recorder
from bondgraph.motion.tables import tables
from bondgraph.motion.walk import Instant, Walk

Rates = Callable[..., tuple[Any, ...]]
_BALANCED = 1e-9  # of the greatest effort


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
        self.graph = graph = as_graph(graph)
        self.signals = _checked_signals(graph, signals or {})
        self.form = Formulation(graph)
        self.tables = tables(self.form, self.signals)
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

    def unbalanced(self, state: Sequence[float]) -> list[str]:
        """What keeps a state from being a start: springs alone hold a flow, and their efforts do not balance there."""
        if not self.tables.static:
            return []
        walk, faults = Walk(self.tables, 0.0, state, {}), []
        for k in sorted(self.tables.static):
            held = walk.held(k)
            off, most = abs(sum(held.values())), max(abs(effort) for effort in held.values())
            if off > _BALANCED * most:
                where, names = self.form.name_of(self.form.coordinates.all[k]), ", ".join(held)
                faults.append(
                    f"{names} alone hold the flow of {where}, and their efforts there are off balance by {off:.6g} at the "
                    "start: give initial displacements that balance"
                )
        return faults

    @property
    def anchored(self) -> tuple[str, ...]:
        """The 1-junctions that motions refer to: those whose anchors matter, in the order that `rates` takes them."""
        return self.tables.anchored

    @cached_property
    def rates(self) -> Rates:
        """(t, *state, *anchors) -> rates of the state, recorded as straight-line code."""
        if self.tables.iterated:
            return self._iterated()
        return self._recorded(Walk.rates)

    def _recorded(self, what: Callable[[Walk], Sequence[Any]], massless: int = 0) -> Rates:
        """What follows from a walk as straight-line code of (t, *state, *anchors, *massless flows)."""
        count, recorder = len(self.state.names), Recorder()
        t, *values = recorder.inputs(1 + count + len(self.anchored) + massless)
        anchors = dict(zip(self.anchored, values[count:], strict=False))
        given = values[len(values) - massless :] if massless else None
        return recorder.function(what(Walk(self.tables, t, values[:count], anchors, given)))

    def _iterated(self) -> Rates:
        """The rates where massless flows are iterated: these first, from where they were last, then all that follows."""
        size = len(self.form.massless)
        balance, rates = self._recorded(_flat_balance, size), self._recorded(Walk.rates, size)
        last: list[float] | None = None

        def iterated(t: Any, *values: Any) -> tuple[Any, ...]:
            nonlocal last

            def equations(flows: list[Any]) -> Balance:
                found = balance(t, *values, *flows)
                return list(found[:size]), [list(found[size * k : size * (k + 1)]) for k in range(1, size + 1)]

            last = settle(equations, size, (), self.tables.loose, last)
            return rates(t, *values, *last)

        return iterated


def _flat_balance(walk: Walk) -> list[Any]:
    residual, slopes = walk.balance()
    return residual + [slope for row in slopes for slope in row]


def _checked_signals(graph: BondGraph, signals: Mapping[str, Any]) -> dict[str, Function]:
    declared = ", ".join(graph.signals) or "none"
    faults = [f"no signal {name!r}: the graph declares {declared}" for name in signals if name not in graph.signals]
    faults += [
        f"signal {name!r} has no function of t: signals={{{name!r}: ...}}" for name in graph.signals if name not in signals
    ]
    found = {}
    for name, given in signals.items():
        if not (callable(given) or is_symbolic(given) or isinstance(given, Real)):
            faults.append(f"signal {name!r}: found {given!r}, expected a number, a function of t or a SymPy expression")
            continue
        varies = not isinstance(given, Real) and (callable(given) or bool(given.free_symbols))
        found[name] = function(given if varies else _constantly(float(given)))
        if len(found[name].of) > 1:
            faults.append(f"signal {name!r}: found a function of {', '.join(found[name].of)}, expected one of t")
    refuse(faults)
    return found


def _constantly(value: float) -> Callable[[Any], Any]:
    return lambda t: value + 0.0 * t
