"""The table of a graph's equations, bond by bond: one equation for every effort and one for every flow, as causality has it.

Each variable stands on the left of one equation, that of the element that gives it, so the table can be computed line by
line where there is no algebraic loop and no store in derivative causality, and says so where there is. Laws appear by the
names of their elements: J, B, T(theta), a linear C by its compliance. A half arrow that leaves a
resistor or a store turns the sign of its law.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bondgraph.causal.strokes import COMMON, Causality, Inputs, Variable, giver, inputs
from bondgraph.causal.strokes import causality as strokes_of
from bondgraph.elements import JUNCTIONS, SOURCES, STORES, Law
from bondgraph.graph import CONVENTION, Bond, BondGraph, as_graph
from bondgraph.laws import TIME, GraphError, refuse

_HEADINGS = ("bond", "from", "to", "half arrow", "stroke at", "effort", "flow", "state")


class Quantity(NamedTuple):
    """An effort e, flow f, momentum p or displacement q of a bond, or its rate of change."""

    letter: str
    bond: int
    rate: bool = False


class Symbol(NamedTuple):
    """An element's law by the element's name, with what it varies with, itself or inverted."""

    name: str
    kind: str
    arguments: tuple[str | Term, ...] = ()
    inverse: bool = False


class Term(NamedTuple):
    """One term of a sum: quantity, factor, factor times quantity, or quantity divided by the factor."""

    quantity: Quantity | None
    factor: Symbol | None = None
    divided: bool = False
    positive: bool = True


class Equation(NamedTuple):
    """What stands on the left is the sum of the terms; 0 where there are none."""

    left: Quantity
    right: tuple[Term, ...]


class Row(NamedTuple):
    """One bond: its ends, where its stroke is, the equations of its effort and flow, and of its state at a store."""

    bond: int
    tail: str
    head: str
    half_arrow: tuple[str, str]
    stroke: str
    effort: Equation
    flow: Equation
    state: Equation | None


@dataclass(frozen=True)
class Table:
    """The equations of a graph, a row for every bond. Made by `table`; print it with `text`, `markdown` or `latex`.

    Args:
        rows: one for every bond, in the graph's order.
        notes: which stores follow others, and which equations are implicit because of an algebraic loop.

    """

    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def text(self) -> str:
        """The table in aligned columns."""
        lines = [_HEADINGS, *(_cells(row, _plain, str, "->") for row in self.rows)]
        wide = [max(len(line[k]) for line in lines) for k in range(len(_HEADINGS))]
        body = ["  ".join(cell.ljust(w) for cell, w in zip(line, wide, strict=True)).rstrip() for line in lines]
        return "\n".join([*body, *self._footer()])

    def markdown(self) -> str:
        """The table in Markdown, its equations as code."""
        lines = [_cells(row, lambda e: f"`{_plain(e)}`", _markdown, "->") for row in self.rows]
        body = ["| " + " | ".join(line) + " |" for line in (_HEADINGS, ("---",) * len(_HEADINGS), *lines)]
        return "\n".join([*body, "", *(f"- {_markdown(line)}" for line in self._footer())])

    def latex(self) -> str:
        r"""The table as a LaTeX tabular with its convention below it; no package is needed."""
        lines = [_cells(row, lambda e: f"${_latex(e)}$", _escaped, r"$\rightarrow$") for row in self.rows]
        body = [" & ".join(line) + r" \\" for line in (_HEADINGS, *lines)]
        columns = "r" + "l" * (len(_HEADINGS) - 1)
        return "\n".join(
            [
                rf"\begin{{tabular}}{{{columns}}}",
                r"\hline",
                body[0],
                r"\hline",
                *body[1:],
                r"\hline",
                r"\end{tabular}",
                *(rf"\par {_escaped(line)}" for line in self._footer()),
            ]
        )

    def _footer(self) -> list[str]:
        return [f"convention: {CONVENTION}", *self.notes]


def table(graph: BondGraph, causality: Causality | None = None) -> Table:
    """The equations of every bond, each variable computed where causality says.

    Args:
        graph: the graph.
        causality: its causal strokes; those of `bondgraph.causality` where none are given.

    Raises:
        GraphError: if the strokes contradict each other, or are those of another graph.

    >>> from bondgraph import Builder, I, R, Se
    >>> print(table(Builder().one("shaft").on("shaft", Se("M", 1.0), I("J", 2.0), R("b", 0.1)).build()).text())
    bond  from     to       half arrow  stroke at  effort           flow         state
    1     Se:M     1:shaft  ->          shaft      e_1 = M          f_1 = f_2
    2     1:shaft  I:J      ->          J          e_2 = e_1 - e_3  f_2 = p_2/J  dp_2/dt = e_2
    3     1:shaft  R:b      ->          shaft      e_3 = b f_3      f_3 = f_2
    convention: f_out = T f_in, e_in = T e_out

    """
    graph = as_graph(graph)
    found = strokes_of(graph) if causality is None else causality
    if found.graph is not graph:
        raise GraphError("the causality is that of another graph: give the one of this graph, or none")
    refuse(found.conflicts)
    known = inputs(graph, found.strokes)
    rows = tuple(_row(graph, found, known, bond) for bond in graph.bonds)
    implicit = [f"implicit equations: {loop.text}" for loop in found.loops]
    return Table(rows, (*(found.follows[name] for name in found.derivative), *implicit))


# -- equations ------------------------------------------------------------------------------------------------------------


def _row(graph: BondGraph, found: Causality, known: Inputs, bond: Bond) -> Row:
    effort, flow = (_equation(graph, found, known, bond, letter) for letter in "ef")
    store = next((n for n in bond[1:] if graph.elements[n].kind in STORES), None)
    return Row(
        bond.number,
        graph.title(bond.tail),
        graph.title(bond.head),
        (bond.tail, bond.head),
        found.strokes[bond.number],
        effort,
        flow,
        _state(graph, bond, store, store in found.integral) if store is not None else None,
    )


def _equation(graph: BondGraph, found: Causality, known: Inputs, bond: Bond, letter: str) -> Equation:
    name = giver(bond, letter, found.strokes)
    kind = graph.elements[name].kind
    needs = [Quantity(*v) for v in known[Variable(letter, bond.number)]]
    left = Quantity(letter, bond.number)
    if kind in SOURCES:
        return Equation(left, (Term(None, _source(graph, bond, name)),))
    if kind in STORES:
        return Equation(left, (_stored(graph, bond, name, letter),))
    if kind == "R":
        inward, inverse = bond.sign(name) > 0, needs[0].letter == "e"
        if not _nonlinear(graph, name):
            return Equation(left, (Term(needs[0], _symbol(graph, name), divided=inverse, positive=inward),))
        if inverse:
            return Equation(left, (Term(None, _symbol(graph, name, Term(needs[0]), inverse=True), positive=inward),))
        return Equation(left, (Term(None, _symbol(graph, name, Term(needs[0], positive=inward))),))
    if kind not in JUNCTIONS:
        into = bond.head == name
        divided = letter == "f" if kind == "GY" else (letter == "f") == into
        return Equation(left, (Term(needs[0], _symbol(graph, name), divided),))
    if letter == COMMON[kind]:
        return Equation(left, tuple(Term(need) for need in needs))
    signs = {b.number: b.sign(name) for b in graph.at(name)}
    terms = [Term(need, positive=signs[need.bond] != signs[bond.number]) for need in needs]
    return Equation(left, tuple(sorted(terms, key=lambda term: not term.positive)))


def _stored(graph: BondGraph, bond: Bond, name: str, letter: str) -> Term:
    """What a store gives: from its state, or its state's rate of change."""
    kind = graph.elements[name].kind
    state = _state_of(kind, bond)
    if letter == ("e" if kind == "I" else "f"):
        return Term(state._replace(rate=True), positive=bond.sign(name) > 0)
    if _nonlinear(graph, name):
        return Term(None, _symbol(graph, name, Term(state)))
    return Term(state, _symbol(graph, name), divided=True)


def _state(graph: BondGraph, bond: Bond, name: str, integral: bool) -> Equation:
    """A store's state: its rate of change in integral causality, its value in derivative causality."""
    kind = graph.elements[name].kind
    state = _state_of(kind, bond)
    if integral:
        rate = Quantity("e" if kind == "I" else "f", bond.number)
        return Equation(state._replace(rate=True), (Term(rate, positive=bond.sign(name) > 0),))
    given = Quantity("f" if kind == "I" else "e", bond.number)
    if _nonlinear(graph, name):
        return Equation(state, (Term(None, _symbol(graph, name, Term(given), inverse=True)),))
    return Equation(state, (Term(given, _symbol(graph, name)),))


def _state_of(kind: str, bond: Bond) -> Quantity:
    return Quantity("p" if kind == "I" else "q", bond.number)


def _nonlinear(graph: BondGraph, name: str) -> bool:
    """Whether a resistor's or compliance's law is a function of its own flow or displacement, no factor."""
    element = graph.elements[name]
    return graph.is_curve(name) or (element.kind == "C" and isinstance(element.law, Law))


def _source(graph: BondGraph, bond: Bond, name: str) -> Symbol:
    """A source's law, which may depend on flows and time besides."""
    symbol, law = _symbol(graph, name), graph.elements[name].law
    if not isinstance(law, Law) or not law.moving:
        return symbol
    driving = graph.at(law.motion.of)[0].number
    also: dict[str, str | Term] = {
        "speed": Term(Quantity("f", driving)),
        "flow": Term(Quantity("f", bond.number)),
        "time": TIME,
    }
    return symbol._replace(arguments=(*symbol.arguments, *(also[name] for name in law.sees)))


def _symbol(graph: BondGraph, name: str, own: Term | None = None, inverse: bool = False) -> Symbol:
    varies = graph.depends_on(name)
    if isinstance(graph.elements[name].law, Law) and not inverse:
        own = None  # such a law is a function of a motion's position instead
    return Symbol(name, graph.elements[name].kind, varies if own is None else (own, *varies), inverse)


# -- words ----------------------------------------------------------------------------------------------------------------


def _cells(row: Row, equation: Callable[[Equation], str], word: Callable[[str], str], arrow: str) -> tuple[str, ...]:
    words = (word(row.tail), word(row.head), arrow, word(row.stroke))
    state = equation(row.state) if row.state is not None else ""
    return (str(row.bond), *words, equation(row.effort), equation(row.flow), state)


def _sum(terms: Sequence[Term], one: Callable[[Term], str]) -> str:
    if not terms:
        return "0"
    rest = "".join((" + " if term.positive else " - ") + one(term) for term in terms[1:])
    return ("" if terms[0].positive else "-") + one(terms[0]) + rest


def _plain(equation: Equation) -> str:
    return f"{_plain_quantity(equation.left)} = {_sum(equation.right, _plain_term)}"


def _plain_quantity(quantity: Quantity) -> str:
    plain = f"{quantity.letter}_{quantity.bond}"
    return f"d{plain}/dt" if quantity.rate else plain


def _plain_term(term: Term) -> str:
    parts = [_plain_symbol(term.factor)] if term.factor is not None else []
    if term.quantity is not None:
        parts.append(_plain_quantity(term.quantity))
    return "/".join(reversed(parts)) if term.divided else " ".join(parts)


def _plain_symbol(symbol: Symbol) -> str:
    name = symbol.name if re.fullmatch(r"[\w.]+", symbol.name) else f"{symbol.kind}[{symbol.name}]"
    arguments = ", ".join(a if isinstance(a, str) else _sum([a], _plain_term) for a in symbol.arguments)
    return name + ("^-1" if symbol.inverse else "") + (f"({arguments})" if arguments else "")


def _latex(equation: Equation) -> str:
    return f"{_latex_quantity(equation.left)} = {_sum(equation.right, _latex_term)}"


def _latex_quantity(quantity: Quantity) -> str:
    letter = rf"\dot{{{quantity.letter}}}" if quantity.rate else quantity.letter
    return f"{letter}_{{{quantity.bond}}}"


def _latex_term(term: Term) -> str:
    factor = _latex_symbol(term.factor) if term.factor is not None else ""
    quantity = _latex_quantity(term.quantity) if term.quantity is not None else ""
    return rf"\frac{{{quantity}}}{{{factor}}}" if term.divided else r"\,".join(filter(None, (factor, quantity)))


def _latex_symbol(symbol: Symbol) -> str:
    arguments = ", ".join(_latex_name(a) if isinstance(a, str) else _sum([a], _latex_term) for a in symbol.arguments)
    return _latex_name(symbol.name) + ("^{-1}" if symbol.inverse else "") + (f"({arguments})" if arguments else "")


_GREEK = (
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|iota|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|upsilon|phi|chi|psi|omega|"
    "Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Upsilon|Phi|Psi|Omega"
)
_LETTER = re.compile(rf"([A-Za-z]|{_GREEK})_?([0-9]*)")


def _latex_name(name: str) -> str:
    r"""A name in formulas: letters and Greek letters as symbols, digits after them as a subscript, all else upright.

    >>> print(_latex_name("theta"), _latex_name("B1"), _latex_name("rod.m"))
    \theta B_{1} \mbox{rod.m}
    """
    match = _LETTER.fullmatch(name)
    if match is None:
        return rf"\mbox{{{_escaped(name)}}}"
    letter = match[1] if len(match[1]) == 1 else rf"\{match[1]}"
    return letter + (f"_{{{match[2]}}}" if match[2] else "")


_ESCAPES = {character: f"\\{character}" for character in "&%$#_{}"}
_ESCAPES |= {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_ESCAPES |= {"<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}"}


def _escaped(text: str) -> str:
    return "".join(_ESCAPES.get(character, character) for character in text)


def _markdown(text: str) -> str:
    return re.sub(r"([\\`*_|<>\[\]])", r"\\\1", text)
