"""What the equations of a graph are read from: its symbolic twin, walked once.

Next to the walk: which symbol stands for which state, and, in a line each, what acts on nothing and what is folded in.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from bondgraph.elements import Law
from bondgraph.faults import GraphError
from bondgraph.graph import BondGraph
from bondgraph.laws import OWN_FLOW, TIME, Function
from bondgraph.motion.dynamics import Dynamics
from bondgraph.motion.formulation import Formulation, Port
from bondgraph.motion.tables import Tables
from bondgraph.motion.walk import Walk
from bondgraph.structure import Scale, Solve, Sum
from bondgraph.symbolic.twin import Twin, exact, twin

if TYPE_CHECKING:
    from bondgraph.causal.assignment import Causality


class SymbolicWalk(Walk):
    """A walk on symbols that keeps every value of a law as one symbol, unfolded at the end."""

    def __init__(self, twin: Twin, tables: Tables, state: Sequence[Any]) -> None:
        self.twin = twin
        super().__init__(tables, twin.places[TIME], state, {})

    def _moving_effort(self, name: str, law: Law) -> Any:
        return self.twin.hold(exact(super()._moving_effort(name, law)))

    def _symbolic(self, law: Function, arguments: list[Any]) -> Any:
        return self.twin.hold(super()._symbolic(law, arguments))

    def _symbolic_partials(self, law: Function, arguments: list[Any]) -> tuple[Any, tuple[Any, ...]]:
        value, partials = super()._symbolic_partials(law, arguments)
        return self.twin.hold(value), tuple(map(self.twin.hold, partials))


class Reading:
    """A graph's symbolic twin, walked once.

    Attributes:
        twin: the symbolic graph. form, tables: what `Dynamics` finds out about it.
        keepers: independent flow -> the inertia whose momentum is the state.
        scales: the factors from independent flows to states.
        state: the states' symbols.
        massless: place of a flow that no inertia weighs -> its symbol.
        walk: the walk at the state.

    """

    def __init__(self, graph: BondGraph, opaque: bool, causality: Causality | None, momenta: bool = True) -> None:
        self.twin, dynamics = _like(graph, opaque)
        self.form: Formulation = dynamics.form
        self.tables = dynamics.tables._replace(iterated=False)
        _solvable(self.twin.graph, self.form)
        take, moving = self.twin.names.take, self.form.coordinates.moving
        self.keepers = {v: k for v in moving if momenta and (k := _keeper(self.form, v, causality))}
        self.scales = [self._scale(v) for v in moving]
        kept = [f"p_{self.keepers[v].element.name}" if v in self.keepers else self._flow(v) for v in moving]
        self.state = [take(name, "state") for name in kept]
        flows = [state / scale for state, scale in zip(self.state, self.scales, strict=True)]
        self.state += [self.twin.places[d.name] for d in self.form.displacements]
        self.state += [take(f"q_{p.element.name}", "state") for p in self.tables.springs]
        order = self.form.massless
        self.massless = {k: take(self._flow(self.form.coordinates.all[k]), "state") for k in order}
        self.walk = SymbolicWalk(self.twin, self.tables, flows + self.state[len(flows) :])

    def accelerations(self) -> list[Any]:
        """The rates of the flows or momenta among the states."""
        matrix, force, _ = self.walk.mass_and_force()
        return [rate * scale for rate, scale in zip(_solved(matrix, force), self.scales, strict=True)]

    def displaced(self) -> list[Any]:
        """The rates of the displacements and springs among the states."""
        flow = self.walk.flow
        rates = [flow[self.tables.owner_of[d.name]] for d in self.form.displacements]
        return rates + [p.sign * flow[p.variable] for p in self.tables.springs]

    def acts(self, port: Port) -> bool:
        """Whether a port moves, or is moved by, a flow that is not imposed."""
        free = len(self.form.coordinates.moving) + len(self.form.coordinates.massless)
        return any(k < free and self.twin.finish(g) != 0 for k, g in self.walk.gain[port.variable].items())

    def _flow(self, variable: int) -> str:
        return f"f_{self.form.name_of(variable)}"

    def _scale(self, variable: int) -> Any:
        keeper = self.keepers.get(variable)
        inertia: Any = self.twin.graph.constant(keeper.element.name) if keeper else 1
        return inertia if keeper is None else int(keeper.sign) * inertia


def _like(graph: BondGraph, opaque: bool) -> tuple[Twin, Dynamics]:
    """A graph's twin, with the same independent flows as the graph has with its numbers."""
    settled = None not in graph.parameters.values()
    expected = Formulation(graph).coordinates if settled else None
    for ratios in (True, False):
        try:
            found = twin(graph, opaque=opaque, ratios=ratios)
            dynamics = Dynamics(found.graph, found.signals())
            if not settled or dynamics.form.coordinates == expected:
                return found, dynamics
        except GraphError:
            if not settled or not ratios:
                raise
    raise GraphError(
        "the numbers of the transformers' parameters decide which flows are independent: put them in the ratios"
    )


def _keeper(form: Formulation, variable: int, causality: Causality | None) -> Port | None:
    """The inertia whose momentum stands for an independent flow."""
    held = [p for p in form.ports if p.element.kind == "I" and p.element.law != 0.0 and p.variable == variable]
    chosen = [p for p in held if causality is None or p.element.name in causality.integral]
    return next(iter(chosen), None)


def _solvable(graph: BondGraph, form: Formulation) -> None:
    """Raise where a flow that no inertia weighs meets a resistor whose law is no straight line."""
    import sympy  # type: ignore[import-untyped]

    own = sympy.Symbol(OWN_FLOW, real=True)
    for port in form.ports:
        law = port.element.law
        if port.element.kind != "R" or not isinstance(law, Function) or OWN_FLOW not in law.of:
            continue
        massless = [k for k in form.massless if k in form.support[port.variable]]
        if massless and law.symbolic({OWN_FLOW: own}).diff(own).has(own):
            flow = form.name_of(form.coordinates.all[massless[0]])
            raise GraphError(
                f"{graph.where(port.element.name)}: its law is no straight line, and the flow of {flow}, which no inertia "
                "weighs, follows from it by no formula; put an inertia there, or use Dynamics"
            )


def _solved(matrix: Sequence[Sequence[Any]], force: Sequence[Any]) -> list[Any]:
    """The u' of M u' = Q, with M given by its lower triangle: one fraction for each, over the determinant of its block."""
    import sympy

    lower = [[exact(sympy.sympify(entry)) for entry in row] for row in matrix]
    right = [exact(sympy.sympify(entry)) for entry in force]
    rates: dict[int, Any] = {}
    for block in _blocks(lower):
        whole = sympy.Matrix([[lower[max(i, j)][min(i, j)] for j in block] for i in block])
        adjugate, determinant = _adjugate(whole)
        if determinant == 0:
            raise GraphError("the inertia that the motion sees vanishes: independent flows have no inertia of their own")
        for i, loads in zip(block, adjugate.tolist(), strict=True):
            rates[i] = sum(load * right[j] for load, j in zip(loads, block, strict=True)) / determinant
    return [rates[i] for i in range(len(force))]


def _blocks(lower: Sequence[Sequence[Any]]) -> list[list[int]]:
    """The places of the rows that hang together through entries off the diagonal."""
    blocks: list[list[int]] = []
    for i, row in enumerate(lower):
        tied = [block for block in blocks if any(row[j] != 0 for j in block)]
        blocks = [block for block in blocks if block not in tied]
        blocks.append(sorted([i, *(j for block in tied for j in block)]))
    return blocks


def _adjugate(matrix: Any) -> tuple[Any, Any]:
    """The adjugate and the determinant, by Cayley and Hamilton's theorem: no step divides."""
    import sympy
    from sympy.polys.matrices import DomainMatrix  # type: ignore[import-untyped]

    size = matrix.rows
    if size == 1:
        return sympy.eye(1), matrix[0, 0]
    given = DomainMatrix.from_Matrix(matrix)
    unit = DomainMatrix.eye(size, given.domain)
    *inner, last = given.charpoly()[1:]
    product = unit
    for coefficient in inner:
        product = given * product + coefficient * unit
    sign = 1 if size % 2 else -1
    return sign * product.to_Matrix(), -sign * given.domain.to_sympy(last)


def inert(read: Reading) -> Iterator[str]:
    """A line for each source, resistor or store that acts on nothing."""
    form = read.form
    for port in form.ports:
        at = read.twin.graph.where(port.element.name)
        if port.element.kind == "Sf":
            if not _drives(read, port):
                yield f"{at} acts on nothing: no element feels the flow that it imposes"
        elif port.element.law == 0.0:
            yield f"{at} acts on nothing: its value is 0"
        elif port.element.kind != "GY" and not read.acts(port):
            free = any(form.coordinates.all[k] not in form.coordinates.imposed for k in form.support[port.variable])
            reason = "its gain is zero" if free else "sources of flow alone settle its flow"
            yield f"{at} acts on nothing: {reason}"


def _drives(read: Reading, source: Port) -> bool:
    """Whether a flow source moves a displacement or a spring, or an element that also feels other flows."""
    place = read.form.coordinates.all.index(source.variable)
    felt = [p for p in read.form.ports if p.element.name != source.element.name and p.element.kind != "Se"]
    moved = [p.variable for p in felt if p.element.kind in ("C", "GY") or read.acts(p)]
    moved += [read.tables.owner_of[d.name] for d in read.form.displacements]
    return any(read.twin.finish(read.walk.gain[v].get(place, 0)) != 0 for v in moved)


def followers(read: Reading) -> Iterator[str]:
    """A line for each inertia or spring that follows others, with the transformers between."""
    form, graph = read.form, read.twin.graph
    for port in form.ports:
        name, kind = port.element.name, port.element.kind
        on = form.support[port.variable]
        if kind == "I" and port.element.law != 0.0 and read.keepers.get(port.variable) is not port:
            leaders = " and ".join(f"1:{form.name_of(form.coordinates.all[k])}" for k in on)
            between = ", ".join(graph.title(t) for t in through(form, port.variable))
            yield f"{graph.where(name)} follows {leaders}" + (f" through {between}" if between else "")
        elif kind == "C" and any(k in read.tables.static for k in on):
            yield f"{graph.where(name)} shares its effort with other springs or sources: they move together"


def through(form: Formulation, variable: int) -> list[str]:
    """The transformers by which a flow follows from the independent ones."""
    graph, found = form.graph, dict[str, None]()
    todo, seen = [variable], set[int]()
    while todo:
        target = todo.pop()
        for step in form.steps if target not in seen else ():
            if isinstance(step, Scale) and step.target == target:
                pair = {step.source, target}
                todo.append(step.source)
                between = [e.name for e in graph.of_kind("TF") if {form.flow[b.number] for b in graph.ends(e.name)} == pair]
                found |= dict.fromkeys(between)
            elif isinstance(step, Sum) and step.target == target:
                todo += [source for source, _ in step.terms]
            elif isinstance(step, Solve) and target in step.unknown:
                found |= dict.fromkeys(r.name for r in step.relations if graph.elements[r.name].kind == "TF")
        seen.add(target)
    return list(found)
