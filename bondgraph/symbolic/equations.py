"""The equations of a graph in symbols: explicit first-order equations, and for one degree of freedom the equation of motion.

Both are read from one walk (`bondgraph.motion.walk`) over the graph's symbolic twin (`bondgraph.symbolic.twin`):
M(q) u' = Q in the independent flows u, with every store that depends on others folded in by its gain. No step divides by
a modulus, so the equations hold at dead centres too. What is handed out is complete or an error, never part of a system.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bondgraph.elements import Displacement
from bondgraph.faults import GraphError, refuse
from bondgraph.graph import BondGraph, as_graph
from bondgraph.laws import TIME, full_digits
from bondgraph.motion.dynamics import Dynamics
from bondgraph.symbolic.reading import Reading, SymbolicWalk, followers, inert, through
from bondgraph.symbolic.twin import Twin, exact

if TYPE_CHECKING:
    from bondgraph.causal.assignment import Causality

Equation = tuple[Any, Any]  # a symbol, and the expression that it equals


@dataclass(frozen=True, eq=False)
class StateEquations:
    """The explicit equations d states/dt = derivatives of a graph. Made by `state_equations`.

    Args:
        graph: the graph.
        states: a symbol for each state: p_NAME, an inertia's momentum; f_JUNCTION, a flow that no single inertia keeps;
            displacements by their own names; q_NAME, a spring's displacement.
        derivatives: their time derivatives, expressions of states, inputs and parameters.
        values: symbol -> number, of elements and parameters that have one.
        inputs: the time and the signals (a signal's own rate, with `dot` behind its name, where it is needed).
        inert: a line for each source, resistor or store that acts on nothing, and so is in no equation.
        algebraic: the flows that no inertia weighs, and what they were solved to.
        derivative_stores: a line for each inertia or spring that follows others.
        opaque: modulus left as a function, such as T(theta) -> its expression.
        own: element -> the symbol of its number.

    """

    graph: BondGraph
    states: tuple[Any, ...]
    derivatives: tuple[Any, ...]
    values: Mapping[Any, float]
    inputs: tuple[Any, ...]
    inert: tuple[str, ...]
    algebraic: tuple[Equation, ...]
    derivative_stores: tuple[str, ...]
    opaque: Mapping[Any, Any]
    own: Mapping[str, Any]

    @property
    def open(self) -> tuple[Any, ...]:
        """The parameters that have no value yet."""
        found = set().union(*(self._whole(d).free_symbols for d in self.derivatives))
        known = {*self.states, *self.inputs, *self.values}
        return tuple(sorted(found - known, key=str))

    def check(self) -> StateEquations:
        """The equations themselves, if they are complete.

        Raises:
            GraphError: with a line for each fault: a state without its equation, a symbol that is neither state, input nor
                parameter, an equation that is no number anywhere, a source or resistor lost on the way.

        """
        refuse(_incomplete(self))
        return self

    def numeric(self, signals: Mapping[str, Any] | None = None) -> Callable[[float, Sequence[float]], list[float]]:
        """f(t, states) -> rates of the states, in their order, with all values filled in.

        `signals` gives a number or a function of t (s) for each signal that the graph declares.

        Raises:
            GraphError: if a parameter is open or a signal has no function.

        """
        import sympy  # type: ignore[import-untyped]

        if self.open:
            names = ", ".join(map(str, self.open))
            raise GraphError(f"no value for {names}: graph.with_parameters({self.open[0]}=...), then state_equations again")
        filled = {symbol: sympy.Float(value, 17) for symbol, value in self.values.items()}
        rates = [full_digits(self._whole(d).xreplace(filled)) for d in self.derivatives]
        given = Dynamics(self.graph, signals).signals.values()
        compiled = sympy.lambdify([*self.inputs, *self.states], rates, modules="numpy", cse=True)
        with_rates = len(self.inputs) > 1 + len(given)

        def at(t: float, states: Sequence[float]) -> list[float]:
            now = [signal(*[t] * len(signal.of)) for signal in given]
            slopes = [signal.partials(t)[1][0] if signal.of else 0.0 for signal in given] if with_rates else []
            return [float(rate) for rate in compiled(t, *now, *slopes, *states)]

        return at

    def text(self) -> str:
        """The equations, a line each, and what they leave out."""
        lines = [f"d{s}/dt = {d}" for s, d in zip(self.states, self.derivatives, strict=True)]
        lines += [f"{s} = {e}" for s, e in self.algebraic]
        return "\n".join([*lines, *self.derivative_stores, *self.inert])

    def latex(self) -> str:
        """The equations as LaTeX, aligned at their equals signs."""
        import sympy

        rates = [(rf"\dot{{{sympy.latex(s)}}}", d) for s, d in zip(self.states, self.derivatives, strict=True)]
        rows = rates + [(sympy.latex(s), e) for s, e in self.algebraic]
        body = " \\\\\n".join(f"{left} &= {sympy.latex(right)}" for left, right in rows)
        return f"\\begin{{aligned}}\n{body}\n\\end{{aligned}}"

    def _whole(self, expression: Any) -> Any:
        return expression.xreplace(self.opaque).doit() if self.opaque else expression


@dataclass(frozen=True, eq=False)
class MotionEquation:
    """I* phi'' + 1/2 dI*/dphi phi'^2 = M* of a graph of one degree of freedom. Made by `motion_equation`.

    Args:
        coordinate: the symbol phi.
        rate: the symbol of phi', called as phi with `dot` behind.
        inertia: I*(phi).
        slope: dI*/dphi.
        moment: M*, of phi, phi', springs' displacements, the time and signals.
        others: the remaining states (springs' and further displacements), and their time derivatives.
        values: symbol -> number, of elements and parameters that have one.
        opaque: modulus left as a function, such as T(theta) -> its expression.

    """

    coordinate: Any
    rate: Any
    inertia: Any
    slope: Any
    moment: Any
    others: tuple[Equation, ...]
    values: Mapping[Any, float]
    opaque: Mapping[Any, Any]

    @property
    def equation(self) -> Any:
        """The equation as a SymPy Eq, with phi and the other states as functions of t."""
        import sympy

        t = sympy.Symbol(TIME)
        phi = sympy.Function(str(self.coordinate))(t)
        moving = {symbol: sympy.Function(str(symbol))(t) for symbol, _ in self.others}
        moving |= {self.coordinate: phi}
        inertia, slope, moment = (part.xreplace(moving) for part in (self.inertia, self.slope, self.moment))
        left = inertia * phi.diff(t, 2) + slope / 2 * phi.diff(t) ** 2
        return sympy.Eq(left, moment.xreplace({self.rate: phi.diff(t)}))

    @property
    def acceleration(self) -> Any:
        """The explicit phi'', as an expression of phi, phi' and the other states."""
        return (self.moment - self.slope / 2 * self.rate**2) / self.inertia

    def latex(self) -> str:
        """The equation as LaTeX, with dots for time derivatives, then one line for each of the other states."""
        import sympy

        phi, dot = sympy.latex(self.coordinate), sympy.latex(self.rate)
        left = f"\\left({sympy.latex(self.inertia)}\\right) \\ddot{{{phi}}}"
        if self.slope != 0:
            left += f" + \\frac{{1}}{{2}} \\left({sympy.latex(self.slope)}\\right) {dot}^{{2}}"
        lines = [f"{left} &= {sympy.latex(self.moment)}"]
        lines += [f"\\dot{{{sympy.latex(s)}}} &= {sympy.latex(e)}" for s, e in self.others]
        body = " \\\\\n".join(lines)
        return f"\\begin{{aligned}}\n{body}\n\\end{{aligned}}"


def state_equations(
    graph: BondGraph, *, values: bool = False, opaque: bool = False, causality: Causality | None = None
) -> StateEquations:
    """The explicit state equations of a graph.

    M(q) u' = Q for the independent flows u, dq/dt = f for displacements; where one inertia keeps an independent flow, its
    momentum p = I f is the state.

    Args:
        graph: any graph; parameters may be open.
        values: put the numbers in place of the elements' symbols.
        opaque: leave moduli that vary as functions, T(theta) and its derivative.
        causality: whose integral inertias give their momenta as states (default: the first on each independent flow).

    Raises:
        GraphError: if the graph has no such equations: sources that contradict each other, a flow that nothing holds, a
            resistor's law that cannot be solved for its flow.

    >>> import numpy as np
    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().one("crank", displacement="theta").one("ram").on("crank", I("J", 2.0), Se("M", 3.0))
    >>> b = b.on("ram", I("m", 4.0)).transform("crank", "ram", lambda theta: -np.sin(theta), name="T")
    >>> print(state_equations(b.build()).text())
    dp_J/dt = J*(M - m*p_J**2*sin(theta)*cos(theta)/J**2)/(J + m*sin(theta)**2)
    dtheta/dt = p_J/J
    I:m (bond 3) follows 1:crank through MTF:T

    """
    read = Reading(as_graph(graph), opaque, causality)
    finish = read.twin.finish
    derivatives = tuple(finish(rate) for rate in (*read.accelerations(), *read.displaced()))
    algebraic = tuple((finish(s), finish(read.walk.coordinates[k])) for k, s in read.massless.items())
    used = set().union(*(d.free_symbols for d in derivatives), *(e.free_symbols for _, e in algebraic))
    found = StateEquations(
        graph=graph,
        states=tuple(map(finish, read.state)),
        derivatives=derivatives,
        values=read.twin.values,
        inputs=_inputs(read.twin, used),
        inert=(*inert(read), *_cancelling(read, used)),
        algebraic=algebraic,
        derivative_stores=tuple(followers(read)),
        opaque=read.twin.opaque,
        own=read.twin.own,
    ).check()
    return _filled(found) if values else found


def _cancelling(read: Reading, used: Set[Any]) -> Iterator[str]:
    """Sources of a constant value that the motion does not feel: a spring held at an effort, a point held at a speed."""
    graph, acting = read.twin.graph, set(inert(read))
    for element in graph.of_kind("Se", "Sf"):
        symbol, at = read.twin.own.get(element.name), graph.where(element.name)
        silent = symbol is not None and symbol not in used and not any(line.startswith(f"{at} ") for line in acting)
        if silent and graph.is_linear(element.name):
            yield f"{at} acts by being constant: its value is in no equation"


def motion_equation(graph: BondGraph, coordinate: str | None = None, *, opaque: bool = False) -> MotionEquation:
    """The equation of motion I* phi'' + 1/2 dI*/dphi phi'^2 = M* of a graph of one degree of freedom.

    I* = sum I g^2 and M* = sum e g over the elements, with g their gain of flow on phi'. M* holds resistors, springs and
    gyrators too; springs and further displacements stay states of their own (`others`).

    Args:
        graph: a graph of one independent flow.
        coordinate: the displacement (or 1-junction) to write it in; default: the one of the independent flow.
        opaque: leave moduli that vary as functions, T(theta) and its derivative.

    Raises:
        GraphError: if the graph has another number of degrees of freedom, if the inertia that the motion sees varies with
            time or signals or is driven by a flow source, or if the coordinate does not determine the motion.

    >>> import sympy
    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().one("crank", displacement="theta").one("ram").on("crank", I("J", 2.0), Se("M", 3.0))
    >>> b = b.on("ram", I("m", 4.0)).transform("crank", "ram", -sympy.sin(sympy.Symbol("theta")), name="T")
    >>> found = motion_equation(b.build())
    >>> found.inertia, found.slope, found.moment
    (J + m*sin(theta)**2, 2*m*sin(theta)*cos(theta), M)

    """
    graph, name = _measured(as_graph(graph), coordinate)
    read = Reading(graph, opaque, None, momenta=False)
    phi, rate = _coordinate(read, name), read.state[0]
    read.twin.rename(rate, f"{phi.name}dot")
    _same_form(read)
    finish = read.twin.finish
    inertia = read.twin.unfold(read.walk.mass_and_force()[0][0][0])
    return MotionEquation(
        coordinate=finish(phi),
        rate=finish(rate),
        inertia=finish(inertia),
        slope=finish(_slope(read, inertia)),
        moment=finish(_moment(read)),
        others=tuple((finish(s), finish(f)) for s, f in zip(read.state[1:], read.displaced(), strict=True) if s != phi),
        values=read.twin.values,
        opaque=read.twin.opaque,
    )


def _inputs(twin: Twin, used: set[Any]) -> tuple[Any, ...]:
    signals = [twin.finish(twin.places[name]) for name in twin.rates]
    rates = [twin.finish(rate) for rate in twin.rates.values()]
    return (twin.finish(twin.places[TIME]), *signals, *(rates if used & set(rates) else ()))


def _filled(found: StateEquations) -> StateEquations:
    """The equations with numbers in place of symbols."""
    import sympy

    at = {symbol: exact(sympy.Float(value)) for symbol, value in found.values.items()}
    equations = [
        *((f"the rate of {state}", d) for state, d in zip(found.states, found.derivatives, strict=True)),
        *((f"the flow {flow}", e) for flow, e in found.algebraic),
    ]
    refuse(f"{what} has no finite value: {_infinite(found, e, at)}" for what, e in equations if _endless(e.xreplace(at)))
    return replace(
        found,
        derivatives=tuple(d.xreplace(at) for d in found.derivatives),
        algebraic=tuple((s, e.xreplace(at)) for s, e in found.algebraic),
    )


def _endless(expression: Any) -> bool:
    import sympy

    return bool(expression.has(sympy.zoo, sympy.nan, sympy.oo, -sympy.oo))


def _infinite(found: StateEquations, expression: Any, at: Mapping[Any, Any]) -> str:
    """Whose number makes an expression infinite: the elements that do so alone, or else all that do so together."""
    import sympy

    names = {symbol: found.graph.where(name) for name, symbol in found.own.items()}
    used = sorted(sympy.fraction(sympy.together(expression))[1].free_symbols & set(at), key=str)
    alone = [symbol for symbol in used if _endless(expression.xreplace({symbol: at[symbol]}))]
    at_fault = ", ".join(f"{names.get(symbol, symbol)} = {found.values[symbol]:g}" for symbol in alone or used)
    together = "" if alone else ", together,"
    return f"{at_fault}{together} leaves nothing to divide by; give another value, or leave the element out"


def _incomplete(found: StateEquations) -> Iterator[str]:
    import sympy

    if len(found.states) != len(found.derivatives):
        yield f"found {len(found.derivatives)} equations for {len(found.states)} states"
    expressions = [*found.derivatives, *(e for _, e in found.algebraic)]
    used = set().union(*(e.free_symbols for e in expressions))
    parameters = {*found.values, *(sympy.Symbol(name) for name in found.graph.parameters)}
    for symbol in sorted(used - parameters - {*found.states, *found.inputs}, key=str):
        yield f"{symbol} is neither a state, an input nor a parameter, but is in the equations"
    for state, expression in zip(found.states, found.derivatives, strict=False):
        if _endless(expression):
            yield f"the rate of {state} is not determined: the inertia that it sees vanishes"
    for element in found.graph.of_kind("Se", "Sf", "R"):
        symbol, at = found.own.get(element.name), found.graph.where(element.name)
        if symbol is not None and symbol not in used and not any(line.startswith(f"{at} ") for line in found.inert):
            yield f"{at} is in no equation"


# -- one degree of freedom -------------------------------------------------------------------------------------------------


def _measured(graph: BondGraph, coordinate: str | None) -> tuple[BondGraph, str | None]:
    """The graph with the coordinate's displacement declared first, and the displacement's name."""
    if coordinate is None:
        return graph, None
    declared = graph.displacements.get(coordinate)
    if declared is None and coordinate in graph.elements:
        declared = next((d for d in graph.displacements.values() if d.of == coordinate), None)
        declared = declared or Displacement(f"phi_{coordinate}", coordinate)
    if declared is None:
        known = ", ".join(graph.displacements) or "no displacement"
        raise GraphError(f"the coordinate {coordinate!r} is no displacement or 1-junction of the graph; it declares {known}")
    others = {name: d for name, d in graph.displacements.items() if name != declared.name}
    return replace(graph, displacements={declared.name: declared, **others}), declared.name


def _coordinate(read: Reading, name: str | None) -> Any:
    """The symbol of the one independent displacement."""
    form = read.form
    moving = form.coordinates.moving
    if len(moving) != 1:
        names = ", ".join(form.name_of(v) for v in moving) or "none"
        raise GraphError(
            f"expected one independent flow that an inertia weighs, found {len(moving)} ({names}): use state_equations"
        )
    owned = [d for d in form.displacements if form.variable(d.of) == moving[0]]
    if name is not None and name not in [d.name for d in owned]:
        raise GraphError(
            f"the coordinate {name!r} does not determine the motion (a modulus may vanish): use {form.name_of(moving[0])!r}"
        )
    chosen = name or (owned[0].name if owned else None)
    return read.twin.places[chosen] if chosen else read.twin.names.take(f"phi_{form.name_of(moving[0])}", "x")


def _same_form(read: Reading) -> None:
    """Raise where inertia varies with more than displacements, so that the equation has other terms."""
    graph, form = read.twin.graph, read.form
    imposed = range(len(form.coordinates.all) - len(form.coordinates.imposed), len(form.coordinates.all))
    driven = [p for p in form.ports if p.element.kind == "I" and any(k in imposed for k in form.support[p.variable])]
    for port in driven if any(source.law != 0.0 for source in graph.of_kind("Sf")) else ():
        raise GraphError(f"{graph.where(port.element.name)} moves with a source of flow too: use state_equations")
    weighed = {name for p in form.ports if p.element.kind == "I" for name in through(form, p.variable)}
    for name in weighed:
        varying = [n for n in graph.depends_on(name) if n not in graph.displacements]
        if varying:
            what = " and ".join("the time" if n == TIME else f"signal {n!r}" for n in varying)
            raise GraphError(f"{graph.where(name)} varies with {what}, so the inertia does too: use state_equations")


def _slope(read: Reading, inertia: Any) -> Any:
    """How the inertia varies along the motion: by each displacement, at the gain of its flow."""
    gains = {d.name: read.walk.gain[read.tables.owner_of[d.name]].get(0, 0) for d in reversed(read.form.displacements)}
    return sum(inertia.diff(read.twin.places[name]) * read.twin.unfold(gain) for name, gain in gains.items())


def _moment(read: Reading) -> Any:
    """M*: the force without inertias."""
    walk = SymbolicWalk(read.twin, read.tables._replace(inertias=()), read.state)
    return walk.mass_and_force()[1][0]
