"""What computes what once every bond has its causal stroke: causal paths, algebraic loops, what derivative stores follow.

The element at the stroke's end of a bond receives the effort and gives the flow; the element at the other end gives the
effort. So every effort and flow has one giver, and the giver's law says which other efforts and flows it is computed from.
What a store gives is computed from none: its state in integral causality, a rate of change in derivative causality.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from bondgraph.elements import JUNCTIONS, ONE_PORTS, TWO_PORTS
from bondgraph.graph import Bond, BondGraph

COMMON = {"1": "f", "0": "e"}  # what the bonds of a junction share
DECIDES_AT = {"1": False, "0": True, "TF": True}  # whether the one bond that decides has its stroke at the element
OTHER = {"e": "f", "f": "e"}


class Variable(NamedTuple):
    """The effort ("e") or the flow ("f") of a bond."""

    letter: str
    bond: int

    def __str__(self) -> str:
        return f"{self.letter}_{self.bond}"


Inputs = Mapping[Variable, tuple[Variable, ...]]


class Loop(NamedTuple):
    """An algebraic loop: efforts and flows that need one another at the same instant; they are solved for together."""

    elements: tuple[str, ...]
    bonds: tuple[int, ...]
    text: str


def giver(bond: Bond, letter: str, strokes: Mapping[int, str]) -> str:
    """The element that gives a bond's effort or flow."""
    end = strokes[bond.number]
    return end if letter == "f" else bond.other(end)


def is_integral(store: str, gives_flow: bool) -> bool:
    """Whether an I or C that gives its flow, or else its effort, gives it from its state: an I a flow, a C an effort."""
    return gives_flow == (store == "I")


def deciding(graph: BondGraph, strokes: Mapping[int, str], name: str) -> list[Bond]:
    """The bonds that decide at an element: at a 1-junction the flow, at a 0-junction the effort, at a TF what it scales.

    Where causality is right there is one. Bonds without a stroke are left out.
    """
    at = DECIDES_AT[graph.elements[name].kind]
    return [b for b in graph.at(name) if b.number in strokes and (strokes[b.number] == name) is at]


def inputs(graph: BondGraph, strokes: Mapping[int, str]) -> dict[Variable, tuple[Variable, ...]]:
    """Every effort and flow, with the efforts and flows that its giver computes it from at the same instant."""
    return {
        Variable(letter, bond.number): _inputs(graph, strokes, giver(bond, letter, strokes), letter, bond)
        for bond in graph.bonds
        for letter in "ef"
    }


def _inputs(graph: BondGraph, strokes: Mapping[int, str], name: str, letter: str, bond: Bond) -> tuple[Variable, ...]:
    kind = graph.elements[name].kind
    if kind in ONE_PORTS:
        return (Variable(OTHER[letter], bond.number),) if kind == "R" else ()
    others = [b.number for b in graph.at(name) if b is not bond]
    if kind == "GY":
        return (Variable(OTHER[letter], others[0]),)
    if kind in JUNCTIONS and letter == COMMON[kind]:
        others = [b.number for b in deciding(graph, strokes, name) if b is not bond][:1]
    return tuple(Variable(letter, number) for number in others)


def follows(graph: BondGraph, strokes: Mapping[int, str], known: Inputs, name: str) -> str:
    """What a store in derivative causality depends on: `I:m follows I:J through MTF:T`."""
    bond = graph.bond_of(name)
    start = Variable("f" if graph.elements[name].kind == "I" else "e", bond.number)
    gives = _givers(graph, strokes)
    towards = _towards(start, known)
    ends = []
    for variable in towards:
        end = gives[variable]
        if known[variable] or end == name or graph.elements[end].kind not in ONE_PORTS:
            continue
        path = [gives[v] for v in _path(variable, towards)]
        passed = [graph.title(n) for n in path if graph.elements[n].kind in TWO_PORTS | {"R"}]
        ends.append(graph.title(end) + (f" through {', '.join(dict.fromkeys(passed))}" if passed else ""))
    what = " and ".join(dict.fromkeys(ends)) or "no store and no source: the junctions alone decide it"
    return f"{graph.title(name)} follows {what}"


def loops(graph: BondGraph, strokes: Mapping[int, str], known: Inputs) -> tuple[Loop, ...]:
    """The algebraic loops: groups of efforts and flows each of which is computed from all the others."""
    gives = _givers(graph, strokes)
    return tuple(_loop(graph, gives, known, group) for group in _groups(known))


def _givers(graph: BondGraph, strokes: Mapping[int, str]) -> dict[Variable, str]:
    return {Variable(x, bond.number): giver(bond, x, strokes) for bond in graph.bonds for x in "ef"}


def _towards(start: Variable, known: Inputs) -> dict[Variable, Variable]:
    """Everything that `start` is computed from, each with the next variable on the shortest way to it."""
    found = {start: start}
    queue = [start]
    for variable in queue:
        fresh = [v for v in known[variable] if v not in found]
        found |= dict.fromkeys(fresh, variable)
        queue += fresh
    return found


def _path(variable: Variable, towards: Mapping[Variable, Variable]) -> Iterator[Variable]:
    yield variable
    while towards[variable] != variable:
        variable = towards[variable]
        yield variable


def _groups(known: Inputs) -> Iterator[list[Variable]]:
    left = dict(known)
    while settled := [v for v, needs in left.items() if not any(n in left for n in needs)]:
        for variable in settled:
            del left[variable]
    needs = {v: tuple(n for n in known[v] if n in left) for v in left}
    reach = {v: {w for n in needs[v] for w in _towards(n, needs)} for v in left}
    while left:
        first = next(iter(left))
        group = [v for v in left if v in reach[first] and first in reach[v]]
        if group:
            yield group
        for variable in group or [first]:
            del left[variable]


def _loop(graph: BondGraph, gives: Mapping[Variable, str], known: Inputs, group: list[Variable]) -> Loop:
    members = {gives[v] for v in group}
    elements = tuple(name for name in graph.elements if name in members)
    resistors = [graph.title(name) for name in elements if graph.elements[name].kind == "R"]
    start = next((v for v in group if graph.elements[gives[v]].kind == "R"), group[0])
    needs = {v: tuple(n for n in known[v] if n in group) for v in group}
    back = [_towards(v, needs) for v in needs[start]]  # what each input of `start` is computed from, `start` itself if found
    circles = [[*_path(start, towards), start] for towards in back if start in towards]
    circle = min(circles, key=lambda steps: len(steps))
    passed = ", ".join(graph.title(n) for n in dict.fromkeys(gives[v] for v in circle))
    through = " and ".join(resistors) or f"the junction structure at {passed}"
    more = f" ({len(group)} efforts and flows in all)" if len(group) > len(circle) - 1 else ""
    text = f"algebraic loop through {through}: {' -> '.join(map(str, circle))}{more}"
    return Loop(elements, tuple(sorted({v.bond for v in group})), text)
