"""The equations of a graph in symbols: explicit first-order equations, and for one degree of freedom the equation of motion.

Both are read from one walk (`bondgraph.motion.dynamics.Walk`) over the graph's symbolic twin (`bondgraph.twin`):
M(q) u' = Q in the independent flows u, with every store that depends on others folded in by its gain. No step divides by
a modulus, so the equations hold at dead centres too. The result is complete or an error, never part of a system.
`generic` is the graph of two flows tied by one ratio, f_B = T(q) f_A, each with its source, inertia, resistor and spring:
any mechanism of one degree of freedom with two velocities of interest is a case of it, with elements left out.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.elements import (
    OWN_DISPLACEMENT,
    OWN_FLOW,
    SOURCES,
    TIME,
    C,
    Displacement,
    Element,
    Function,
    GraphError,
    I,
    R,
    Se,
    exact,
    full_digits,
    law_of,
    parts,
    refuse,
    replaced,
)
from bondgraph.graph import BondGraph, Builder, as_graph
from bondgraph.motion.dynamics import Dynamics
from bondgraph.motion.formulation import Formulation, PortBond, exact_gains
from bondgraph.twin import SymbolicWalk, Twin

if TYPE_CHECKING:
    from bondgraph.strokes import Causality


def inert(read: SymbolicWalk) -> Iterator[str]:
    """A line for each source, resistor or store without effect."""
    form, graph = read.form, read.twin.graph
    columns = {p.element.name: form.column[p.output] for p in form.ports}
    felt: dict[int, set[int]] = {}  # column -> the columns of the stores and displacements that feel it
    for port in form.ports:
        for k in form.support[port.input]:
            felt.setdefault(k, set()).add(columns[port.element.name])
    displaced = {k for d in form.displacements for k in form.support[form.variable(d.of)]}
    for port in form.ports:
        name, at = port.element.name, graph.where(port.element.name)
        if name in form.massless or graph.coupled(name):
            continue
        if port.element.law == 0.0:
            yield f"{at} acts on nothing: its value is 0"
        elif columns[name] not in displaced and not _acts(read, port, columns[name]):
            by_flow = [(columns[p.element.name],) for p in form.acting if p.element.kind == "Sf"]
            settled = form.support[form.flow[port.bond]] in by_flow
            if port.element.kind == "Sf":
                yield f"{at} acts on nothing: no element feels the flow that it imposes"
            elif settled:
                yield f"{at} acts on nothing: sources of flow alone determine its flow"
            else:
                yield f"{at} acts on nothing: its gain is zero"


def _acts(read: SymbolicWalk, port: PortBond, column: int) -> bool:
    """True if the output of a port acts on a store or a resistor other than sources, through gains that are not 0."""
    form = read.form
    if port in form.stores:
        return True
    todo, seen = [column], set[int]()
    by_column = {form.column[p.output]: p for p in form.ports}
    while todo:
        k = todo.pop()
        seen.add(k)
        for other in form.ports:
            gain = read.gain[other.input].get(k, 0)
            if (other is by_column[k] and other.element.kind != "R") or not (
                gain if isinstance(gain, float) else read.twin.finish(gain)
            ):
                continue
            if other in form.stores:
                return True
            place = form.column[other.output]
            if other.element.kind == "R" and place not in seen:
                todo.append(place)
            elif other in form.followers and any(c < len(form.stores) for c in form.support[other.input]):
                return True
    return False


def followers(read: SymbolicWalk) -> Iterator[str]:
    """A line for each inertia or spring that follows others, with the two-ports between."""
    form, graph = read.form, read.twin.graph
    for port in form.followers:
        leaders = [p for p in (*form.stores, *form.acting) if form.column[p.output] in form.support[port.input]]
        leads, name = [], port.element.name
        for leader in (p for p in leaders if p.element.kind != "R"):
            junction = form.name_of(leader.output)
            named = junction in graph.elements and leader.element.kind not in SOURCES
            leads.append(f"{graph.elements[junction].kind}:{junction}" if named else graph.title(leader.element.name))
        between = ", ".join(graph.title(t) for t in form.through(port.input) if t in graph.elements)
        at = " and ".join(dict.fromkeys(leads)) or "nothing that moves"
        together = ": they move together" if port.element.kind == "C" and not between else ""
        yield f"{graph.where(name)} follows {at}" + (f" through {between}" if between else together)


Equation = tuple[Any, Any]  # a symbol, and the expression that it equals


@dataclass(frozen=True, eq=False)
class StateEquations:
    """The explicit equations d states/dt = derivatives of a graph. Made by `state_equations`.

    Args:
        graph: the graph.
        states: a symbol for each state: p_NAME, an inertia's momentum; f_JUNCTION, a flow that no single inertia determines;
            displacements by their own names; q_NAME, a spring's displacement.
        derivatives: their time derivatives, expressions of states, inputs and parameters.
        values: symbol -> number, of elements and parameters that have one.
        inputs: the time and the signals (a signal's own rate, with `dot` behind its name, where it is needed).
        inert: a line for each source, resistor or store without effect, which is in no equation.
        algebraic: the flows without inertia, and their solutions.
        derivative_stores: a line for each inertia or spring that follows others.
        opaque: modulus left as a function, such as T(theta) -> its expression.
        own: element -> the symbol of its number.
        causality: the given one.

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
    causality: Causality | None = None

    @property
    def open(self) -> tuple[Any, ...]:
        """The parameters that have no value yet."""
        symbols = {part for part in parts(*map(self._whole, self.derivatives)) if part.is_Symbol}
        names = {*self.states, *self.inputs, *self.values}
        return tuple(sorted(symbols - names, key=str))

    def check(self) -> StateEquations:
        """The equations themselves, if they are complete.

        Raises:
            GraphError: with a line for each fault: a state without its equation, a symbol that is neither state, input nor
                parameter, an equation that is not finite anywhere, a missing source or resistor.

        """
        import sympy  # type: ignore[import-untyped]

        faults = []
        if len(self.states) != len(self.derivatives):
            faults.append(f"found {len(self.derivatives)} equations for {len(self.states)} states")
        used = {part for part in parts(*self.derivatives, *(e for _, e in self.algebraic)) if part.is_Symbol}
        symbols = {*self.values, *map(sympy.Symbol, self.graph.parameters), *self.states, *self.inputs}
        faults += [
            f"{symbol} is neither a state, an input nor a parameter, but is in the equations"
            for symbol in sorted(used - symbols, key=str)
        ]
        for state, expression in zip(self.states, self.derivatives, strict=False):
            if _endless(expression):
                faults.append(f"the rate of {state} is not determined: its effective inertia vanishes")
        for element in self.graph.of_kind("Se", "Sf", "R"):
            symbol, at = self.own.get(element.name), self.graph.where(element.name)
            if symbol is not None and symbol not in used and not any(line.startswith(f"{at} ") for line in self.inert):
                faults.append(f"{at} is in no equation")
        refuse(faults)
        return self

    def numeric(self, signals: Mapping[str, Any] | None = None) -> Callable[[float, Sequence[float]], list[float]]:
        """f(t, states) -> rates of the states, in their order, with all values inserted.

        `signals` gives a number or a function of t (s) for each signal that the graph declares.

        Raises:
            GraphError: if a parameter is open or a signal has no function.

        """
        import sympy

        rates = self._formulas(called=True)
        functions = Dynamics(self.graph, signals).signals.values()
        compiled = sympy.lambdify([*self.inputs, *self.states], rates, modules="numpy", cse=True)
        with_rates = len(self.inputs) > 1 + len(functions)

        def at(t: float, states: Sequence[float]) -> list[float]:
            now = [signal(*[t] * len(signal.of)) for signal in functions]
            slopes = [signal.partials(t)[1][0] if signal.of else 0.0 for signal in functions] if with_rates else []
            return [float(rate) for rate in compiled(t, *now, *slopes, *states)]

        return at

    def machine_code(self) -> Callable[..., Any]:
        """Returns f(t, states) -> array of their rates, compiled by numba, for its own code and for any solver.

        Of a graph with signals, f(t, states, signals): their values, in the order of `inputs[1:]`.

        Raises:
            GraphError: if a parameter is open, or a law is no formula.
            ImportError: if numba is not installed (`pip install 'flywheel-design[numba]'`).

        >>> from bondgraph import Builder, C, I, R
        >>> b = Builder().one("m").on("m", I("M", 2.0), C("k", stiffness=8.0), R("d", 1.0))
        >>> state_equations(b.build()).machine_code()(0.0, np.array([2.0, 1.0])).tolist()  # doctest: +SKIP
        [-9.0, 1.0]

        """
        import sympy

        rates = self._formulas()
        import numba  # type: ignore[import-untyped,unused-ignore]

        plain = sympy.lambdify([*self.inputs, *self.states], tuple(rates), modules="math", cse=True)
        signature = ["t", *(f"u[{k}]" for k in range(len(self.inputs) - 1)), *(f"y[{k}]" for k in range(len(self.states)))]
        space = {"kernel": numba.njit(plain), "np": np}
        arguments = "t, y" + (", u" if len(self.inputs) > 1 else "")
        exec(f"def rates({arguments}):\n    return np.array(kernel({', '.join(signature)}), dtype=np.float64)\n", space)
        compiled: Callable[..., Any] = numba.njit(space["rates"])
        return compiled

    def _formulas(self, called: bool = False) -> list[Any]:
        """The derivatives in numbers, states and inputs; refused if open, or unless `called` if one is known by values."""
        import sympy

        if self.open:
            names = ", ".join(map(str, self.open))
            raise GraphError(f"no value for {names}: graph.with_parameters({self.open[0]}=...), then state_equations again")
        filled = {symbol: sympy.Float(value, 17) for symbol, value in self.values.items()}
        rates = [full_digits(replaced(self._whole(d), lambda part: filled.get(part, part))) for d in self.derivatives]
        for state, rate in zip(self.states, rates, strict=True):
            for function in parts(rate) if not called else ():
                if hasattr(function, "_imp_"):
                    raise GraphError(
                        f"the rate of {state} holds {function.func}, which is known by values, not by a formula"
                    )
        return rates

    def text(self, *, sequential: bool = False) -> str:
        """The equations, a line each, and their omissions; `sequential`: common parts first, under new names."""
        lines = [f"d{s}/dt = {d}" for s, d in zip(self.states, self.derivatives, strict=True)]
        lines += [f"{s} = {e}" for s, e in self.algebraic]
        if sequential:
            shared, rates = self.sequence()
            lines = [f"{s} = {e}" for s, e in shared]
            lines += [f"d{s}/dt = {d}" for s, d in zip(self.states, rates, strict=True)]
        return "\n".join([*lines, *self.derivative_stores, *self.inert])

    def sequence(self) -> tuple[tuple[Equation, ...], tuple[Any, ...]]:
        """Common expressions under new symbols, each of those before, and the derivatives in terms of them.

        Loops of resistors are eliminated one resistor after the other, so that a long ladder takes a few steps a rung.
        """
        import sympy

        taken = {str(s) for e in self.derivatives for s in e.free_symbols} | {str(s) for s in self.states}
        fresh = (symbol for symbol in sympy.numbered_symbols("z", start=1) if str(symbol) not in taken)
        read = _read(self.graph, bool(self.opaque), self.causality, sequential=True)
        rates = [read.twin.unfold(rate) for rate in read.rates()]
        if not read.steps:
            shared, rates = sympy.cse(list(self.derivatives), symbols=fresh)
            return tuple(shared), tuple(rates)
        steps = [(symbol, read.twin.unfold(value)) for symbol, value in read.steps.items()]
        needed, live = set[Any]().union(*(e.free_symbols for e in rates)), list[Equation]()
        for symbol, value in reversed(steps):
            if symbol in needed:
                needed |= value.free_symbols
                live.insert(0, (symbol, value))
        uses = Counter(s for e in (*rates, *(value for _, value in live)) for s in e.free_symbols)
        named = {s: exact(sympy.Float(v)) for s, v in self.values.items() if not taken.intersection(map(str, self.values))}
        equations: list[Equation] = []
        for symbol, value in live:  # what is used once stands where it is used
            formula = read.twin.finish(value.xreplace(named)).xreplace(named)
            named[symbol] = formula if uses[symbol] == 1 else next(fresh)
            equations += [] if uses[symbol] == 1 else [(named[symbol], formula)]
        return tuple(equations), tuple(read.twin.finish(rate.xreplace(named)).xreplace(named) for rate in rates)

    def latex(self) -> str:
        """The equations as LaTeX, aligned at their equals signs."""
        import sympy

        rates = [(rf"\dot{{{sympy.latex(s)}}}", d) for s, d in zip(self.states, self.derivatives, strict=True)]
        rows = rates + [(sympy.latex(s), e) for s, e in self.algebraic]
        return _aligned(f"{left} &= {sympy.latex(right)}" for left, right in rows)

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
        return _aligned(lines)


def _aligned(lines: Iterable[str]) -> str:
    """Lines of LaTeX, aligned at their `&`."""
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
        values: True inserts the numbers for the elements' symbols.
        opaque: leave moduli that vary as functions, T(theta) and its derivative.
        causality: whose integral inertias give their momenta as states (default: the first on each independent flow).

    Raises:
        GraphError: if the graph has no such equations: sources that contradict each other, an undetermined flow, a
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
    graph = as_graph(graph)
    read = _read(graph, opaque, causality)
    twin, finish = read.twin, read.twin.finish
    derivatives = tuple(read.formulas())
    algebraic = tuple(read.algebraic())
    used = {part for part in parts(*derivatives, *(e for _, e in algebraic)) if part.is_Symbol}
    rates = [finish(rate) for rate in twin.rates.values()]
    signals = [finish(twin.places[name]) for name in twin.rates]
    lost = list(inert(read))
    for element in twin.graph.of_kind("Se", "Sf"):  # a spring held at a constant effort, a point held at a constant speed
        symbol, at = twin.own.get(element.name), twin.graph.where(element.name)
        silent = symbol is not None and symbol not in used and not any(line.startswith(f"{at} ") for line in lost)
        if silent and twin.graph.is_linear(element.name):
            lost.append(f"{at} acts by being constant: its value is in no equation")
    equations = StateEquations(
        graph=graph,
        states=tuple(map(finish, read.state)),
        derivatives=derivatives,
        values=read.twin.values,
        inputs=(finish(twin.places[TIME]), *signals, *(rates if used & set(rates) else ())),
        inert=tuple(lost),
        algebraic=algebraic,
        derivative_stores=tuple(followers(read)),
        opaque=read.twin.opaque,
        own=read.twin.own,
        causality=causality,
    ).check()
    return _filled(equations) if values else equations


def _read(graph: BondGraph, opaque: bool, causality: Causality | None, *, sequential: bool = False) -> SymbolicWalk:
    """The walk over a graph's symbols, by the formulation of its numbers where it has them all."""
    if None in graph.parameters.values():
        twin = Twin(graph, opaque=opaque)
        return SymbolicWalk(twin, Formulation(twin.graph, causality), sequential)
    form = Formulation(graph, causality)
    exact_gains(form)  # refuses loops without a solution, or of several
    twin = Twin(graph, opaque=opaque)
    return SymbolicWalk(twin, form.of(twin.graph), sequential)


def motion_equation(graph: BondGraph, coordinate: str | None = None, *, opaque: bool = False) -> MotionEquation:
    """The equation of motion I* phi'' + 1/2 dI*/dphi phi'^2 = M* of a graph of one degree of freedom.

    I* = sum I g^2 and M* = sum e g over the elements, with g their gain of flow on phi'. M* holds resistors, springs and
    gyrators too; springs and further displacements remain separate states (`others`).

    Args:
        graph: a graph of one independent flow.
        coordinate: the displacement (or 1-junction) to write it in; default: the one of the independent flow.
        opaque: leave moduli that vary as functions, T(theta) and its derivative.

    Raises:
        GraphError: if the graph has another number of degrees of freedom, if the effective inertia varies with time or
            signals or is driven by a flow source, or if the coordinate does not determine the motion.

    >>> import sympy
    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().one("crank", displacement="theta").one("ram").on("crank", I("J", 2.0), Se("M", 3.0))
    >>> b = b.on("ram", I("m", 4.0)).transform("crank", "ram", -sympy.sin(sympy.Symbol("theta")), name="T")
    >>> equation = motion_equation(b.build())
    >>> equation.inertia, equation.slope, equation.moment
    (J + m*sin(theta)**2, 2*m*sin(theta)*cos(theta), M)

    """
    graph, name = _measured(as_graph(graph), coordinate)
    form, junction = _of_one_freedom(graph, name)
    twin = Twin(graph, opaque=opaque)
    read = SymbolicWalk(twin, form.of(twin.graph))
    finish, unfold, form = twin.finish, twin.unfold, read.form
    place = next(k for k, p in enumerate(form.stores) if p.element.name in form.massless)
    owned = [d.name for d in form.displacements if form.variable(d.of) == form.variable(junction)]
    chosen = name or next(iter(owned), None)
    phi = twin.places[chosen] if chosen else twin.symbol(f"phi_{junction}", "x")
    rate = read.state[place]
    twin.rename(rate, f"{phi.name}dot")
    _same_form(read)
    inertia = unfold(read.mass_and_force()[0][0][0])
    gains = {d.name: read.gain[read.dynamics.owner_of[d.name]].get(place, 0) for d in reversed(form.displacements)}
    slope = sum(inertia.diff(twin.places[name]) * unfold(gain) for name, gain in gains.items())
    port, others = form.stores[place], {k for k in range(len(read.state)) if k != place and read.state[k] != phi}
    springs = [(k, read.own_rate(p)) for k, p in enumerate(form.stores) if k != place]
    flows = [read.whole(read.dynamics.owner_of[d.name]) for d in form.displacements]
    moved = [*((k + len(form.stores), flow) for k, flow in enumerate(flows)), *springs]
    return MotionEquation(
        coordinate=finish(phi),
        rate=finish(rate),
        inertia=finish(inertia),
        slope=finish(slope),
        moment=finish(port.sign * read.value(port.input)),
        others=tuple((finish(read.state[k]), finish(moves)) for k, moves in moved if k in others),
        values=twin.values,
        opaque=twin.opaque,
    )


def _of_one_freedom(graph: BondGraph, name: str | None) -> tuple[Formulation, str]:
    """The formulation in the flow that a coordinate measures, which alone determines the motion, and its 1-junction."""
    form = Formulation(graph)
    inertias = [k for k, p in enumerate(form.stores) if p.element.kind == "I"]
    if len(inertias) != 1:
        names = ", ".join(form.name_of(form.stores[k].output) for k in inertias) or "none"
        raise GraphError(f"expected one independent flow with inertia, found {len(inertias)} ({names}): use state_equations")
    settles = [d for d in form.displacements if form.flow_state(d.of) == inertias[0]]
    owner = form.stores[inertias[0]].output
    junction = next((d.of for d in settles if d.name == name or name is None), form.name_of(owner))
    along = Formulation.along(graph, junction) if graph.elements.get(junction) else form
    free = [k for k, p in enumerate(along.stores) if p.element.name in along.massless]
    weighed = {p.element.kind for p in along.stores} - {"C"}
    measured = name is None or along.flow_state(graph.displacements[name].of) in free
    if (
        len(free) != 1
        or not weighed
        or along.divided()
        or not measured
        or any(p.element.kind == "C" for p in along.followers)
    ):
        if name is None:
            raise GraphError("no one coordinate determines the motion: use state_equations")
        use = form.name_of(owner)
        raise GraphError(f"the coordinate {name!r} does not determine the motion (a modulus may vanish): use {use!r}")
    return along, junction


def _filled(source: StateEquations) -> StateEquations:
    """The equations with numbers in place of symbols."""
    import sympy

    at = {symbol: exact(sympy.Float(value)) for symbol, value in source.values.items()}
    equations = [
        *((f"the rate of {state}", d) for state, d in zip(source.states, source.derivatives, strict=True)),
        *((f"the flow {flow}", e) for flow, e in source.algebraic),
    ]
    names = {symbol: source.graph.where(name) for name, symbol in source.own.items()}
    faults = []
    for what, e in equations:
        if _endless(e.xreplace(at)):  # by the numbers of the elements that do so alone, or else of all together
            used = sorted(sympy.fraction(sympy.together(e))[1].free_symbols & set(at), key=str)
            alone = [symbol for symbol in used if _endless(e.xreplace({symbol: at[symbol]}))]
            at_fault = ", ".join(f"{names.get(symbol, symbol)} = {source.values[symbol]:g}" for symbol in alone or used)
            together = "" if alone else ", together,"
            faults.append(
                f"{what} has no finite value: {at_fault}{together} makes it a division by zero; give another value, or "
                "leave the element out"
            )
    refuse(faults)
    return replace(
        source,
        derivatives=tuple(d.xreplace(at) for d in source.derivatives),
        algebraic=tuple((s, e.xreplace(at)) for s, e in source.algebraic),
    )


def _endless(expression: Any) -> bool:
    import sympy

    return not parts(expression).isdisjoint((sympy.zoo, sympy.nan, sympy.oo, -sympy.oo))


def _measured(graph: BondGraph, coordinate: str | None) -> tuple[BondGraph, str | None]:
    """The graph with the coordinate's displacement declared first, and the displacement's name."""
    if coordinate is None:
        return graph, None
    declared = graph.displacements.get(coordinate)
    if declared is None and coordinate in graph.elements:
        declared = next((d for d in graph.displacements.values() if d.of == coordinate), None)
        declared = declared or Displacement(f"phi_{coordinate}", coordinate)
    if declared is None:
        names = ", ".join(graph.displacements) or "no displacement"
        raise GraphError(f"the coordinate {coordinate!r} is no displacement or 1-junction of the graph; it declares {names}")
    others = {name: d for name, d in graph.displacements.items() if name != declared.name}
    return replace(graph, displacements={declared.name: declared, **others}), declared.name


def _same_form(read: SymbolicWalk) -> None:
    """Raises if inertia varies with more than displacements, so that the equation has other terms."""
    graph, form = read.twin.graph, read.form
    imposed = {form.column[p.output] for p in form.acting if p.element.kind == "Sf" and p.element.law != 0.0}
    for port in form.followers:
        if imposed.intersection(form.support[port.input]):
            raise GraphError(f"{graph.where(port.element.name)} moves with a source of flow too: use state_equations")
    for name in dict.fromkeys(name for p in form.followers for name in form.through(p.input)):
        varying = [n for n in graph.depends_on(name) if n not in graph.displacements]
        if varying:
            what = " and ".join("the time" if n == TIME else f"signal {n!r}" for n in varying)
            raise GraphError(f"{graph.where(name)} varies with {what}, so the inertia does too: use state_equations")


_MODELICA = {"Abs": "abs", "Min": "min", "Max": "max", "log": "log", "atan2": "atan2", "sign": "sign"}
_MODELICA |= {name: name for name in ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "sinh", "cosh", "tanh", "sqrt")}
_RESERVED = re.compile(
    "algorithm|and|annotation|block|break|class|connect|connector|constant|constrainedby|der|discrete|each|else|elseif|"
    "elsewhen|encapsulated|end|enumeration|equation|expandable|extends|external|false|final|flow|for|function|if|import|"
    "impure|in|initial|inner|input|loop|model|not|operator|or|outer|output|package|parameter|partial|protected|public|pure|"
    "record|redeclare|replaceable|return|stream|then|time|true|type|when|while|within"
)


def to_modelica(graph: BondGraph, *, name: str = "Graph", initial: Mapping[str, float] | None = None) -> str:
    """Returns the state equations of a graph as a Modelica model: parameters, states with their start, signals as inputs.

    Args:
        graph: any graph whose laws are formulas; parameters may be open.
        name: of the model.
        initial: states by name, by default 0 (a displacement: its own initial value).

    Raises:
        GraphError: if there are no such equations, a function has no form in Modelica, or a state is unknown.

    >>> from bondgraph import Builder, C, I
    >>> b = Builder().one("m").on("m", I("M", 2.0), C("k", stiffness=8.0))
    >>> print(to_modelica(b.build(), name="Oscillator", initial={"q_k": 0.1}))
    model Oscillator
      parameter Real M = 2.0;
      parameter Real k = 0.125;
      Real p_M(start = 0.0, fixed = true);
      Real q_k(start = 0.1, fixed = true);
    equation
      der(p_M) = -q_k/k;
      der(q_k) = p_M/M;
    end Oscillator;

    """
    import sympy

    equations = state_equations(graph)
    states = {str(s): s for s in equations.states}
    starts = dict(initial or {})
    refuse(f"initial {n!r}: no such state; they are {', '.join(states)}" for n in starts if n not in states)
    start = {n: d.initial for n, d in graph.displacements.items()} | starts
    used = set().union(*(d.free_symbols for d in equations.derivatives))
    numbers = {str(s): float(v) for s, v in equations.values.items() if s in used}
    written = {
        s: sympy.Symbol(f"{s}_" if _RESERVED.fullmatch(str(s)) else str(s))
        for s in {*used, *equations.states, *equations.inputs}
    }
    written[equations.inputs[0]] = sympy.Symbol("time")
    signals = equations.inputs[1 : 1 + len(graph.signals)]
    written |= {
        s: sympy.Symbol(f"der({written[of]})") for s, of in zip(equations.inputs[1 + len(signals) :], signals, strict=False)
    }
    names = {str(s): str(w) for s, w in written.items()}
    lines = [f"model {name}"]
    lines += [f"  parameter Real {names[n]} = {value!r};" for n, value in numbers.items()]
    lines += [f"  parameter Real {names[str(s)]};" for s in equations.open]
    lines += [f"  input Real {names[str(s)]};" for s in signals]
    lines += [f"  Real {names[n]}(start = {float(start.get(n, 0.0))!r}, fixed = true);" for n in states]
    lines.append("equation")
    for state, rate in zip(equations.states, equations.derivatives, strict=True):
        lines.append(f"  der({names[str(state)]}) = {_modelica(equations._whole(rate).xreplace(written))};")
    return "\n".join([*lines, f"end {name};"])


def _modelica(expression: Any) -> str:
    """A formula as Modelica writes it."""
    from sympy.printing.str import StrPrinter  # type: ignore[import-untyped]

    class Printer(StrPrinter):  # type: ignore[misc]
        def _print_Pow(self, power: Any, rational: bool = False) -> str:
            return str(super()._print_Pow(power, rational=False)).replace("**", "^")

        def _print_Function(self, called: Any) -> str:
            name = _MODELICA.get(called.func.__name__)
            if name is None or hasattr(called, "_imp_"):
                raise GraphError(f"{called.func} has no form in Modelica: give the law as a formula of its functions")
            return f"{name}({', '.join(map(self._print, called.args))})"

        def _print_Float(self, number: Any) -> str:
            return repr(float(number))

        def _print_Relational(self, relation: Any) -> str:
            return f"{self._print(relation.lhs)} {relation.rel_op} {self._print(relation.rhs)}"

        def _print_And(self, all_of: Any) -> str:
            return "(" + " and ".join(map(self._print, all_of.args)) + ")"

        def _print_Or(self, any_of: Any) -> str:
            return "(" + " or ".join(map(self._print, any_of.args)) + ")"

        def _print_Piecewise(self, pieces: Any) -> str:
            *first, last = pieces.args
            chosen = "".join(f"if {self._print(c)} then {self._print(v)} else " for v, c in first)
            return f"({chosen}{self._print(last[0])})"

    Printer._print_Min = Printer._print_Max = Printer._print_Abs = Printer._print_Function
    return str(Printer().doprint(expression))


_MAKERS: dict[str, Callable[..., Element]] = {"Se": Se, "I": I, "B": R, "C": C}
_JUNCTIONS = {"1": "A", "2": "B"}
_ELEMENTS = tuple(f"{kind}{side}" for side in _JUNCTIONS for kind in _MAKERS)


def generic(ratio: Any, *, displacement: str | None = None, without: Collection[str] = (), **values: Any) -> BondGraph:
    """The graph of two flows f_A and f_B = T f_A: 1:A with Se1, I1, B1 (an R), C1 and 1:B with Se2, I2, B2, C2.

    Both sources drive: their power counts as positive into the machine, so a load is a negative effort.

    Args:
        ratio: T, a number, a function written with numpy's functions, or a SymPy expression.
        displacement: which quantity of the ratio is the integral of f_A; may be left out if there is one only.
        without: elements left out.
        values: by element, its law (source: effort; I: inertia; B: resistance; C: compliance, 1/k); by any other quantity
            of the laws, the parameter's value. A missing value stays an open parameter of its own name.

    Raises:
        GraphError: for a name that is none of these, or an ambiguous displacement.

    >>> import numpy as np
    >>> graph = generic(lambda theta: 0.1 * np.sin(theta), without=("C1", "C2", "B1"), I1=2.0, Se1=10.0)
    >>> graph.symbol("T"), list(graph.parameters)
    ('MTF', ['Se2', 'I2', 'B2'])

    """
    import sympy

    laws = {name: law_of(value) for name, value in values.items()}
    tie = law_of(ratio)
    free = [n for n in getattr(tie, "of", ()) if n != TIME and n not in values]
    if len(free) > 1 and not displacement:
        raise GraphError(f"the ratio depends on {', '.join(free)}: say which is the displacement, displacement={free[0]!r}")
    q = displacement or next(iter(free), "phi")
    there = [name for name in _ELEMENTS if name not in without]
    named = {n for law in (tie, *(laws.get(name) for name in there)) for n in getattr(law, "of", ())}
    quantities = sorted(named - {q, TIME, OWN_FLOW, OWN_DISPLACEMENT, *there})
    for unknown in sorted({*values, *without} - {*_ELEMENTS, *quantities})[:1]:
        raise GraphError(f"no element or quantity {unknown!r}: expected {', '.join([*_ELEMENTS, *quantities])}")
    b = Builder().one("A", displacement=q).one("B")
    b = b.parameter(**{name: values.get(name) for name in quantities}).parameter(**{n: None for n in there if n not in laws})
    for name in there:
        law = laws[name] if name in laws else Function(sympy.Symbol(name), (name,), (name,))
        b.on(_JUNCTIONS[name[-1]], _MAKERS[name[:-1]](name, law))
    return b.transform("A", "B", tie, name="T").build()


def generic_equation(ratio: Any, *, opaque: bool = False, **values: Any) -> MotionEquation:
    """The equation of motion of `generic(ratio, **given)`, seen from side A, without division by T.

        (I1 + T^2 I2) f_A' + I2 T T' f_A^2 = Se1 + T Se2 - (B1 + T^2 B2) f_A - q_C1/C1 - T q_C2/C2

    Divided by T where T != 0, this is the form that is solved for side B,

        f_B' = [Se2 - B2 f_B - q_B/C2 + (Se1 - I1 f_A' - B1 f_A - q_A/C1)/T] / I2.

    It is also published with a minus in front of the last bracket (a thesis of 2023, its eq. 84): there both half arrows
    point into the transformer, which then takes the power e_5 f_A + e_6 f_B = 2 e_5 f_A, so that I2 would make the machine
    lighter. A transformer passes power on: the sign is plus.

    Args:
        ratio: as for `generic`.
        opaque: leave T a function T(q).
        values: as for `generic`.

    >>> generic_equation(2.0, without=("B1", "B2", "C1", "C2")).inertia
    I1 + I2*T**2

    """
    return motion_equation(generic(ratio, **values), opaque=opaque)
