"""A graph with a symbol in place of every number, and the walk over it, for the equations that are read from them.

The twin has the structure of the graph it comes from, so that `bondgraph.motion.walk.Walk` runs on it; `SymbolicWalk` keeps
values of laws as symbols, and solves loops of resistors in fractions. A number becomes a symbol named after its element,
parameters, displacements, signals and the time become symbols of their own names. Inside, the symbols are real, so that |x|
has a slope; `Twin.finish` hands out plain ones, and whole numbers and halves exactly.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from bondgraph.elements import (
    OWN_FLOW,
    TIME,
    Dual,
    Element,
    Function,
    GraphError,
    Here,
    Law,
    Modulus,
    Motion,
    exact,
    replaced,
)
from bondgraph.graph import BondGraph
from bondgraph.motion.algebra import eliminated, readable, total
from bondgraph.motion.dynamics import Dynamics, Walk
from bondgraph.motion.formulation import Formulation, PortBond, displacements, unsolvable

_ONE_FRACTION = 8  # resistors of a loop whose flows and efforts are one fraction each
_ZERO_STAYS = frozenset({"I", "R", "TF", "GY", "Sf"})  # a zero there changes which flows are independent, and how held


class SymbolicGraph(BondGraph):
    """A graph whose parameters are symbols; checked already, as the graph that it comes from."""

    def __post_init__(self) -> None:
        """Skips the checks, which have been made."""

    def constant(self, name: str) -> Any:
        """The expression that an element's constant law stands for."""
        law = self.elements[name].law
        if not isinstance(law, Function):
            return law
        return law.symbolic({n: self.parameters[n] for n in law.of})

    def parameter(self, parameter: str, element: str) -> Any:
        """A parameter's symbol."""
        return self.parameters[parameter]


class Twin:
    """A symbolic graph and the meaning of its symbols.

    Args:
        graph: the graph that it comes from.
        opaque: True leaves moduli that vary as functions such as T(theta).

    Attributes:
        graph: the symbolic graph.
        values: plain symbol -> number, of the elements' numbers and of the parameters that have a value.
        own: element -> the plain symbol of its number.
        places: the time, displacements and signals -> real symbol, by their names in the graph.
        rates: signal -> the real symbol of its time derivative.
        opaque: a modulus as a function of plain symbols -> its expression.
        law_values: symbol that a law's value is kept as while a walk runs -> the value. The walk multiplies by signs +-1.0,
            which would turn the fractions in a formula into floats.
        plain: real symbol -> plain symbol.

    Raises:
        GraphError: if a law cannot be written as a formula.

    """

    def __init__(self, graph: BondGraph, *, opaque: bool = False) -> None:
        self.source, self._taken, take = graph, set[str](), self.symbol
        displaced = {d.name: d for d in displacements(graph)}
        self.places = {name: take(name, "x") for name in (TIME, *displaced, *graph.signals)}
        self.rates = {name: take(f"{clean(name)}dot", "x") for name in graph.signals}
        named = {name: take(name, "x") for name in graph.parameters}
        self.parameters: dict[str, Any] = dict(named)
        self.law_values: dict[Any, Any] = {}
        self.plain: dict[Any, Any] = {}
        values = {named[name]: value for name, value in graph.parameters.items() if value is not None}
        own: dict[str, Any] = {}
        self.opaque: dict[Any, Any] = {}
        elements = {}
        for name, element in graph.elements.items():
            law = element.law
            if isinstance(law, float | int) and not (law == 0 and element.kind in _ZERO_STAYS):
                own[name] = take(name, element.kind)
                values[own[name]], law = float(law), self._constant(element, own[name])
            elif isinstance(law, Modulus | Law):
                law = self._of_motion(element, law)
            elif isinstance(law, Function):
                law = self._function(element, law, opaque)
            elements[name] = element._replace(law=law)
        self.graph = SymbolicGraph(elements, graph.bonds, displaced, graph.signals, self.parameters)
        self.values = {self.finish(symbol): value for symbol, value in values.items()}
        self.own = {name: self.finish(symbol) for name, symbol in own.items()}
        self.opaque = {self.finish(called): self.finish(e) for called, e in self.opaque.items()}

    def _function(self, element: Element, law: Function, opaque: bool) -> Function:
        """A law as an expression; of a modulus that varies, if it is to be opaque, a function."""
        import sympy  # type: ignore[import-untyped]

        try:
            expression = exact(law.symbolic({name: sympy.Symbol(name, real=True) for name in law.of}))
        except GraphError as error:
            raise GraphError(f"{self.source.where(element.name)}: {error}") from error
        symbols = {**self.places, **self.parameters}
        varying = tuple(n for n in law.of if n not in self.source.parameters)
        if varying and not (opaque and element.kind in ("TF", "GY") and symbols.keys() >= {*varying}):
            return Function(expression, law.of, law.of)  # what reads flows or efforts is a formula, whatever is wanted
        meant = expression.xreplace({s: symbols[s.name] for s in expression.free_symbols})
        if not varying:
            return self._constant(element, meant)
        called = sympy.Function(self.free(element.name, element.kind))
        self.opaque[called(*(self.places[name] for name in varying))] = meant
        return Function(called(*(sympy.Symbol(name, real=True) for name in varying)), varying, varying)

    def _constant(self, element: Element, value: Any) -> Function:
        """A law of one symbol, under a name that no graph's law has."""
        import sympy

        key, symbol = f"{element.kind}:{element.name}", value if value.is_Symbol else sympy.Dummy(real=True)
        if symbol != value:
            self.law_values[symbol] = value
        self.parameters[key] = symbol
        return Function(symbol, (symbol.name,), (key,))

    def _of_motion(self, element: Element, law: Modulus | Law) -> Function | Law:
        """A mechanism's own law: a function of the displacement that is known by its values."""
        import sympy

        motion, name = law.motion, self.free(element.name, element.kind)
        if isinstance(law, Law) and law.moving:  # a function of those flows and the time too that it sees

            def value(q: Any, *seen: Any) -> Any:
                here = Here(q, motion.position(q, np, q), np)._replace(**dict(zip(law.sees, seen, strict=True)))
                return law.effort(here, here)

            moving = numeric_function(name, value)

            def effort(here: Here, anchor: Here) -> Any:
                return moving(here.q, *(getattr(here, what) for what in law.sees))

            return Law(effort, Motion(motion.of), None, True, law.sees)
        of = next(d.name for d in displacements(self.source) if d.of == motion.of)
        if isinstance(law, Law):
            called = numeric_function(name, lambda q: law.effort(*(Here(q, motion.position(q, np, q), np),) * 2))
        else:
            slope = numeric_function(f"{name}_slope", lambda q: law.slope(motion.position(q, np, q)))
            called = numeric_function(name, lambda q: law.value(motion.position(q, np, q)), slope)
        return Function(called(sympy.Symbol(of, real=True)), (of,), (of,))

    def signals(self) -> dict[str, Callable[[Any], Any]]:
        """The signals as functions of time that answer with their symbols."""

        def answering(symbol: Any, rate: Any) -> Callable[[Any], Any]:
            return lambda t: Dual(symbol, rate) if isinstance(t, Dual) else symbol

        return {name: answering(self.places[name], rate) for name, rate in self.rates.items()}

    def hold(self, value: Any) -> Any:
        """A symbol that stands for a law's value until it is unfolded."""
        import sympy

        if value.is_Integer or value.is_Float or value.is_Symbol:
            return value
        symbol = sympy.Dummy(real=True)
        self.law_values[symbol] = self.unfold(value)
        return symbol

    def unfold(self, expression: Any) -> Any:
        """An expression with the laws' values in it, and exact whole numbers and halves."""
        import sympy

        return replaced(exact(sympy.sympify(expression, strict=True)), lambda part: self.law_values.get(part, part))

    def finish(self, expression: Any) -> Any:
        """An expression unfolded, in plain symbols."""
        import sympy

        def plain(part: Any) -> Any:
            return self.plain.setdefault(part, sympy.Symbol(part.name)) if part.is_Symbol else part

        return replaced(self.unfold(expression), plain)

    def symbol(self, name: str, kind: str) -> Any:
        """A real symbol of a name, as an identifier; if that is taken, with its kind in front."""
        import sympy

        return sympy.Symbol(self.free(name, kind), real=True)

    def free(self, name: str, kind: str) -> str:
        """The name that `symbol` gives, taken from then on."""
        text = clean(name)
        if text in self._taken:
            text = f"{kind}_{text}"
        while text in self._taken:
            text += "_"
        self._taken.add(text)
        return text

    def rename(self, symbol: Any, name: str) -> None:
        """Hand out a real symbol under another name, or one like it where that is taken."""
        import sympy

        self.plain[symbol] = sympy.Symbol(self.free(name, "rate"))


def clean(name: str) -> str:
    """A name as an identifier.

    >>> clean("crank->slider")
    'crank_slider'
    """
    text = re.sub(r"\W+", "_", name).strip("_") or "x"
    return f"x{text}" if text[0].isdigit() else text


def numeric_function(name: str, value: Callable[..., Any], slope: Any = None) -> Any:
    """A SymPy function that is known by its values only; of one variable, its derivative may be another."""
    import sympy

    body: dict[str, Any] = {"_imp_": staticmethod(value)}
    if slope is not None:
        body["fdiff"] = lambda self, argument=1: slope(*self.args)
    return type(name, (sympy.Function,), body)


Point = Callable[[int | PortBond], float]  # at an operating point: a flow or effort by its variable, what a follower holds


class SymbolicWalk(Walk):
    """A walk on symbols that keeps every value of a law as one symbol, unfolded at the end.

    With a `point`, laws that no formula turns round are their tangents there, so that all slopes at the point are right.
    """

    def __init__(self, twin: Twin, form: Formulation, sequential: bool = False, point: Point | None = None) -> None:
        self.twin, self.sequential, self.point = twin, sequential, point
        self.steps: dict[Any, Any] = {}  # symbol -> what it stands for, in symbols before it; where it is sequential
        self.solved: dict[int, tuple[Callable[[Any], Any], Any]] = {}  # variable of a loop -> its solution, how to write it
        self.nested = False  # whether a loop was solved by elimination
        self.driven: dict[str, Any] | None = None  # source of a plain value -> the symbol of its rate; None: it has none
        dynamics = Dynamics(twin.graph, twin.signals(), form)
        dynamics.iterated = ()  # formulas, too
        state = [twin.symbol(form.state_name(port), "state") for port in form.stores]
        super().__init__(dynamics, twin.places[TIME], [*state, *(twin.places[d.name] for d in form.displacements)])

    def formulas(self) -> list[Any]:
        """The rates of the states, in plain symbols."""
        return [self.formula(rate) for rate in self.rates()]

    def algebraic(self) -> Iterator[tuple[Any, Any]]:
        """The flows of 1-junctions that resistors determine, each variable once, with their formulas."""
        form, done = self.form, set[int]()
        resistors = {form.column[p.output] for p in form.acting if p.element.kind == "R"}
        for junction in self.twin.graph.of_kind("1"):
            variable = form.variable(junction.name)
            if variable not in done and resistors.intersection(form.support[variable]):
                done.add(variable)
                symbol = self.twin.symbol(f"f_{junction.name}", "state")
                yield self.twin.finish(symbol), self.formula(self.whole(variable))

    def formula(self, value: Any) -> Any:
        """A value in plain symbols, in the shortest of its forms."""
        return self.twin.finish(value) if self.nested else readable(self.twin.finish(value))

    def _moving_effort(self, name: str, law: Law) -> Any:
        return self.twin.hold(exact(super()._moving_effort(name, law)))

    def _rate_of_source(self, name: str) -> Any:
        import sympy

        if self.driven is None or not self.graph.is_linear(name):
            return super()._rate_of_source(name)
        return self.driven.setdefault(name, sympy.Symbol(f"{name}'", real=True))

    def _closed(self, ports: Sequence[PortBond]) -> list[Any]:
        """The outputs of a loop of resistors: of a few as one fraction; of many, or in sequence, by elimination.

        The flows and efforts between are unknowns too, so that what has few neighbours keeps few.
        """
        import sympy

        form, columns = self.form, {self.form.column[p.output] for p in ports}
        steps = [form.steps[k] for k in form.upstream({v for p in ports for v in form.reads(p)})]
        needed = {v for step in steps for v in step.unknown} | set(form.column)
        unknown = {v for v in needed if columns.intersection(form.support[v])}
        made: list[list[tuple[int, Any]]] = []
        for step in (step for step in steps if unknown.intersection(step.unknown)):
            if step.terms is not None:
                made.append([(step.unknown[0], -1), *((v, self._ratio(ratio)) for v, ratio in step.terms)])
            else:
                made += [[(v, sign * self._ratio(ratio)) for v, ratio, sign in r.terms] for r in step.relations]
        lines = [self._line(port) for port in ports]
        constants = [0] * len(made) + [constant for _, constant in lines]
        made += [terms for terms, _ in lines]
        rows: list[dict[int, Any]] = []
        right: list[Any] = []
        few = not self.sequential and len(ports) <= _ONE_FRACTION
        numbers: dict[Any, Any] = {}  # floats -> symbols that stand for them, so that nothing of a fraction is rounded

        def entry(value: Any) -> Any:
            value = self.twin.unfold(value)
            fresh = {x: numbers.setdefault(x, sympy.Dummy(real=True)) for x in (value.atoms(sympy.Float) if few else ())}
            self.twin.law_values.update({symbol: x for x, symbol in fresh.items()})
            return value.xreplace(fresh)

        for terms, constant in zip(made, constants, strict=True):
            inside = {v: total(a for u, a in terms if u == v) for v, _ in terms if v in unknown}
            rows.append({v: entry(a) for v, a in inside.items()})
            right.append(entry(-constant - total(a * self.value(v) for v, a in terms if v not in unknown)))
        flat = [a for row in (*rows, dict(enumerate(right))) for a in row.values()]
        field, entries = sympy.construct_domain(flat if few else [], field=True)
        if few := few and field.is_Exact and not field.is_EX:
            values = iter(entries)
            rows, right = [{v: next(values) for v in row} for row in rows], list(values)
        self.nested = self.nested or not few
        try:
            outputs = eliminated(rows, [{0: b} for b in right], (lambda a: a) if few else self._step)
        except GraphError as error:
            raise unsolvable(self.graph, ports, error) from error
        whole = (lambda z: sympy.factor_terms(field.to_sympy(field.convert(z)))) if few else sympy.sympify
        self.solved |= {v: (whole, x.get(0, 0)) for v, x in outputs.items()}
        return [self.value(port.output) for port in ports]

    def value(self, variable: int) -> Any:
        """A flow or effort without what followers give; in a loop, as the loop's solution has it."""
        if variable in self.solved:
            whole, share = self.solved.pop(variable)
            self._values[variable] = self.twin.hold(whole(share))
        return super().value(variable)

    def _line(self, port: PortBond) -> tuple[list[tuple[int, Any]], Any]:
        """The terms and the constant whose sum is 0 by a law that is a straight line in what the loop gives."""
        import sympy

        name, law, own = port.element.name, port.element.law, self.graph.own(port.element.name)
        (left, sign), reads = self.form.sides(port)
        if port.element.kind == "R" and own is None:
            flow = port.input if port.gives == "e" else port.output
            return [(left, -1), (flow, port.sign * self._resistance(name))], 0
        assert isinstance(law, Function)
        names = {n: sympy.Dummy(real=True) for n in reads}
        value, partials = super()._symbolic_partials(law, self._arguments(law, name, outputs=names))
        there = dict.fromkeys(names.values(), sympy.S.Zero)
        if any(partial.has(*names.values()) for partial in partials):
            if self.point is None:
                line = f"{self.graph.where(name)}: its law is not linear, and no formula"
                if own is None:
                    raise GraphError(f"{line} solves the loop that it reads from; use Dynamics")
                expected, other = ("flow", "f(e)") if own == OWN_FLOW else ("effort", "e(f)")
                raise GraphError(f"{line} gives its {expected}; give the law as {other}, or use Dynamics")
            there = {names[n]: sympy.Float(factor * self.point(v), 17) for n, (v, factor) in reads.items()}
        tangent = {n: d.xreplace(there) for n, d in zip(law.of, partials, strict=True)}  # itself, if it is a straight line
        constant = value.xreplace(there) - total(tangent[n] * there[names[n]] for n in names)
        return [(left, -sign), *((v, factor * tangent[n]) for n, (v, factor) in reads.items())], constant

    def _step(self, value: Any) -> Any:
        """A symbol for an intermediate result, if it is more than one."""
        import sympy

        value = sympy.sympify(value)
        if not value.args or not self.sequential:
            return self.twin.hold(value) if value.args else value
        symbol = sympy.Dummy(real=True)
        self.steps[symbol] = value
        return symbol

    def inverse(self, port: PortBond, output: Any) -> Any:
        """The momentum (displacement) at which a store of a straight line gives a flow (effort)."""
        import sympy

        name, law = port.element.name, port.element.law
        if not self.graph.is_curve(name) or not isinstance(law, Function):
            return super().inverse(port, output)
        own = sympy.Dummy(real=True)
        arguments = self._arguments(law, name, own)
        value, partials = super()._symbolic_partials(law, arguments)
        slope, output = partials[arguments.index(own)], port.sense * output
        if slope.has(own) and self.point is not None:  # to the second order, for its slope varies
            at = {own: sympy.Float(self.point(port), 17)}
            away, first, second = output - value.xreplace(at), slope.xreplace(at), slope.diff(own).xreplace(at)
            return at[own] + away / first - second * away**2 / (2 * first**3)
        if slope.has(own):
            of = "momentum" if port.element.kind == "I" else "displacement"
            raise GraphError(
                f"{self.graph.where(name)}: its law is not linear, and no formula gives its {of}; "
                "let it lead, by state_equations(graph, causality=causality(graph, {NAME: 'derivative'})) of those that it "
                "follows, or use Dynamics"
            )
        return output / slope - value.subs(own, 0) / slope

    def _symbolic(self, law: Function, arguments: list[Any]) -> Any:
        return self.twin.hold(super()._symbolic(law, arguments))

    def _symbolic_partials(self, law: Function, arguments: list[Any]) -> tuple[Any, tuple[Any, ...]]:
        value, partials = super()._symbolic_partials(law, arguments)
        return self.twin.hold(value), tuple(map(self.twin.hold, partials))
