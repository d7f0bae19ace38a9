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
        lines = [_HEADINGS, *(_cells(row, _written, str, "->") for row in self.rows)]
        wide = [max(len(line[k]) for line in lines) for k in range(len(_HEADINGS))]
        body = ["  ".join(cell.ljust(w) for cell, w in zip(line, wide, strict=True)).rstrip() for line in lines]
        return "\n".join([*body, *self._footer()])

    def markdown(self) -> str:
        """The table in Markdown, its equations as code."""
        lines = [_cells(row, lambda e: f"`{_written(e)}`", _markdown, "->") for row in self.rows]
        body = ["| " + " | ".join(line) + " |" for line in (_HEADINGS, ("---",) * len(_HEADINGS), *lines)]
        return "\n".join([*body, "", *(f"- {_markdown(line)}" for line in self._footer())])

    def latex(self) -> str:
        r"""The table as a LaTeX tabular with its convention below it; no package is needed."""
        lines = [_cells(row, lambda e: f"${_written(e, tex=True)}$", _escaped, r"$\rightarrow$") for row in self.rows]
        body = [" & ".join(line) + r" \\" for line in (_HEADINGS, *lines)]
        columns = "r" + "l" * (len(_HEADINGS) - 1)
        table = [rf"\begin{{tabular}}{{{columns}}}", r"\hline", body[0], r"\hline", *body[1:], r"\hline", r"\end{tabular}"]
        return "\n".join([*table, *(rf"\par {_escaped(line)}" for line in self._footer())])

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


def _row(graph: BondGraph, found: Causality, known: Inputs, bond: Bond) -> Row:
    effort, flow = (_equation(graph, found, known, bond, letter) for letter in "ef")
    store = next((n for n in bond[1:] if graph.elements[n].kind in STORES), None)
    state = None
    if store is not None:  # its rate of change in integral causality, its value in derivative causality
        inertia = graph.elements[store].kind == "I"
        left = Quantity("p" if inertia else "q", bond.number)
        if store in found.integral:
            rate = Quantity("e" if inertia else "f", bond.number)
            state = Equation(left._replace(rate=True), (Term(rate, positive=bond.sign(store) > 0),))
        else:
            given = Term(Quantity("f" if inertia else "e", bond.number))
            curved = Term(None, _symbol(graph, store, given, inverse=True))
            state = Equation(left, (curved if _nonlinear(graph, store) else given._replace(factor=_symbol(graph, store)),))
    ends = graph.title(bond.tail), graph.title(bond.head), (bond.tail, bond.head)
    return Row(bond.number, *ends, found.strokes[bond.number], effort, flow, state)


def _equation(graph: BondGraph, found: Causality, known: Inputs, bond: Bond, letter: str) -> Equation:
    name = giver(bond, letter, found.strokes)
    kind, law, inward = graph.elements[name].kind, graph.elements[name].law, bond.sign(name) > 0
    needs = [Quantity(*v) for v in known[Variable(letter, bond.number)]]
    symbol = _symbol(graph, name)
    if kind in SOURCES:
        if isinstance(law, Law) and law.moving:  # it may depend on flows and time besides
            driving = Term(Quantity("f", graph.at(law.motion.of)[0].number))
            also: dict[str, str | Term] = {"speed": driving, "flow": Term(Quantity("f", bond.number)), "time": TIME}
            symbol = symbol._replace(arguments=(*symbol.arguments, *(also[name] for name in law.sees)))
        terms = [Term(None, symbol)]
    elif kind in STORES:  # from its state, or its state's rate of change
        state = Quantity("p" if kind == "I" else "q", bond.number)
        if letter == ("e" if kind == "I" else "f"):
            terms = [Term(state._replace(rate=True), positive=inward)]
        elif _nonlinear(graph, name):
            terms = [Term(None, _symbol(graph, name, Term(state)))]
        else:
            terms = [Term(state, symbol, divided=True)]
    elif kind == "R":
        inverse = needs[0].letter == "e"
        if not _nonlinear(graph, name):
            terms = [Term(needs[0], symbol, divided=inverse, positive=inward)]
        elif inverse:
            terms = [Term(None, _symbol(graph, name, Term(needs[0]), inverse=True), positive=inward)]
        else:
            terms = [Term(None, _symbol(graph, name, Term(needs[0], positive=inward)))]
    elif kind not in JUNCTIONS:
        terms = [Term(needs[0], symbol, divided=letter == "f" if kind == "GY" else (letter == "f") == (bond.head == name))]
    elif letter == COMMON[kind]:
        terms = [Term(need) for need in needs]
    else:
        signs = {b.number: b.sign(name) for b in graph.at(name)}
        terms = [Term(need, positive=signs[need.bond] != signs[bond.number]) for need in needs]
        terms.sort(key=lambda term: not term.positive)
    return Equation(Quantity(letter, bond.number), tuple(terms))


def _nonlinear(graph: BondGraph, name: str) -> bool:
    """Whether a resistor's or compliance's law is a function of its own flow or displacement, no factor."""
    element = graph.elements[name]
    return graph.is_curve(name) or (element.kind == "C" and isinstance(element.law, Law))


def _symbol(graph: BondGraph, name: str, own: Term | None = None, inverse: bool = False) -> Symbol:
    varies = graph.depends_on(name)
    if isinstance(graph.elements[name].law, Law) and not inverse:
        own = None  # such a law is a function of a motion's position instead
    return Symbol(name, graph.elements[name].kind, varies if own is None else (own, *varies), inverse)


def _cells(row: Row, equation: Callable[[Equation], str], word: Callable[[str], str], arrow: str) -> tuple[str, ...]:
    words = (word(row.tail), word(row.head), arrow, word(row.stroke))
    state = equation(row.state) if row.state is not None else ""
    return (str(row.bond), *words, equation(row.effort), equation(row.flow), state)


def _written(equation: Equation, tex: bool = False) -> str:
    return f"{_quantity(equation.left, tex)} = {_sum(equation.right, tex)}"


def _quantity(quantity: Quantity, tex: bool) -> str:
    letter, bond, rate = quantity
    if tex:
        return (rf"\dot{{{letter}}}" if rate else letter) + f"_{{{bond}}}"
    return f"d{letter}_{bond}/dt" if rate else f"{letter}_{bond}"


def _sum(terms: Sequence[Term], tex: bool) -> str:
    text = ""
    for k, term in enumerate(terms):
        text += (("", "-"), (" + ", " - "))[k > 0][not term.positive]
        parts = [_factor(term.factor, tex)] if term.factor is not None else []
        parts += [_quantity(term.quantity, tex)] if term.quantity is not None else []
        if term.divided:
            text += rf"\frac{{{parts[1]}}}{{{parts[0]}}}" if tex else f"{parts[1]}/{parts[0]}"
        else:
            text += (r"\," if tex else " ").join(parts)
    return text or "0"


def _factor(symbol: Symbol, tex: bool) -> str:
    if tex:
        name, inverse = _latex_name(symbol.name), "^{-1}"
    else:
        name = symbol.name if re.fullmatch(r"[\w.]+", symbol.name) else f"{symbol.kind}[{symbol.name}]"
        inverse = "^-1"
    word = _latex_name if tex else str
    arguments = [word(a) if isinstance(a, str) else _sum([a], tex) for a in symbol.arguments]
    return name + inverse * symbol.inverse + (f"({', '.join(arguments)})" if arguments else "")


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
