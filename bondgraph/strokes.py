"""Causal strokes: which end of every bond receives the effort, found by the sequential causality assignment procedure.

Sources fix theirs; then stores take the causality they prefer, one at a time; then resistors, and whatever is left, are
chosen. After each step everything that follows through junctions, transformers and gyrators is filled in. A step that
contradicts existing strokes is undone and tried the other way. Stores whose choice would pass backwards through a modulated
transformer, f_in = f_out / T, wait for the others, for T may vanish (dead centres).

The element at the stroke's end of a bond receives the effort and gives the flow; the element at the other end gives the
effort. So every effort and flow has one giver, and the giver's law says which other efforts and flows it is computed from:
hence causal paths, algebraic loops, and what derivative stores follow. The output of a store is computed from none of them:
it is its state in integral causality, a rate of change in derivative causality.

In the table of equations each variable stands on the left of one equation, that of the element that gives it, so the table
can be computed line by line if there is no algebraic loop and no store in derivative causality, and a note states it
otherwise. Laws appear by the names of their elements: J, B, T(theta), a linear C by its compliance. A half arrow that leaves
a resistor or a store turns the sign of its law.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, NamedTuple

from bondgraph.elements import JUNCTIONS, ONE_PORTS, SOURCES, STORES, TIME, TWO_PORTS, GraphError, Law, refuse
from bondgraph.graph import CONVENTION, OTHER, Bond, BondGraph, activated, as_graph, variables
from bondgraph.numerics import components, reached_from, representatives

COMMON = {"1": "f", "0": "e"}  # what the bonds of a junction share
DECIDES_AT = {"1": False, "0": True, "TF": True}  # whether the one bond that decides has its stroke at the element
_INTEGRAL, _DERIVATIVE = "integral", "derivative"
_WORDS = {"e": "effort", "f": "flow"}
_MOST_PATHS, _MOST_TRIALS = 1000, 20  # zero-order causal paths; steps per bond before the search for strokes gives up


class Signal(NamedTuple):
    """An effort e, flow f, momentum p or displacement q of a bond, or its rate of change."""

    letter: str
    bond: int
    rate: bool = False

    def __str__(self) -> str:
        return f"d{self.letter}_{self.bond}/dt" if self.rate else f"{self.letter}_{self.bond}"


Inputs = Mapping[Signal, tuple[Signal, ...]]


class Circle(NamedTuple):
    """An algebraic loop: efforts and flows that need one another at the same instant; they are solved for together."""

    elements: tuple[str, ...]
    bonds: tuple[int, ...]
    text: str


def giver(bond: Bond, letter: str, strokes: Mapping[int, str]) -> str:
    """The element that gives a bond's effort or flow."""
    end = strokes[bond.number]
    return end if letter == "f" else bond.other(end)


def is_integral(store: str, gives_flow: bool) -> bool:
    """True if an I or C that gives its flow (or else its effort) gives it from its state: an I a flow, a C an effort."""
    return gives_flow == (store == "I")


def deciding(graph: BondGraph, strokes: Mapping[int, str], name: str) -> list[Bond]:
    """The bonds that decide at an element: at a 1-junction the flow, at a 0-junction the effort, at a TF what it scales.

    Where causality is right there is one. Bonds without a stroke are left out.
    """
    at = DECIDES_AT[graph.elements[name].kind]
    return [b for b in graph.at(name) if b.number in strokes and (strokes[b.number] == name) is at]


def inputs(graph: BondGraph, strokes: Mapping[int, str]) -> dict[Signal, tuple[Signal, ...]]:
    """Every effort and flow, with the efforts and flows that its giver computes it from at the same instant."""
    dependencies: dict[Signal, tuple[Signal, ...]] = {}
    for bond, letter in product(graph.bonds, "ef"):
        name = giver(bond, letter, strokes)
        kind, others = graph.elements[name].kind, [b.number for b in graph.at(name) if b is not bond]
        if kind in ONE_PORTS:
            others = [bond.number] if kind == "R" else []
        elif kind in JUNCTIONS and letter == COMMON[kind]:
            others = [b.number for b in deciding(graph, strokes, name) if b is not bond][:1]
        letter_in_use = OTHER[letter] if kind in ("R", "GY") else letter
        dependencies[Signal(letter, bond.number)] = tuple(Signal(letter_in_use, number) for number in others)
    return dependencies


def follows(graph: BondGraph, strokes: Mapping[int, str], relations: Inputs, name: str) -> str:
    """The stores and sources that a store in derivative causality depends on: `I:m follows I:J through MTF:T`."""
    bond = graph.bond_of(name)
    start = Signal("f" if graph.elements[name].kind == "I" else "e", bond.number)
    gives = _givers(graph, strokes)
    towards = _towards(start, relations)
    ends = []
    for variable in towards:
        end = gives[variable]
        if relations[variable] or end == name or graph.elements[end].kind not in ONE_PORTS:
            continue
        path = [gives[v] for v in _path(variable, towards)]
        passed = [graph.title(n) for n in path if graph.elements[n].kind in TWO_PORTS | {"R"}]
        ends.append(graph.title(end) + (f" through {', '.join(dict.fromkeys(passed))}" if passed else ""))
    what = " and ".join(dict.fromkeys(ends)) or "no store and no source: the junctions alone decide it"
    return f"{graph.title(name)} follows {what}"


def loops(graph: BondGraph, strokes: Mapping[int, str], relations: Inputs) -> tuple[Circle, ...]:
    """The algebraic loops: groups of efforts and flows each of which is computed from all the others."""
    gives = _givers(graph, strokes)
    circles, place = [], {variable: k for k, variable in enumerate(relations)}
    for group in sorted(components(relations), key=lambda group: place[group[0]]):
        if len(group) == 1 and group[0] not in relations[group[0]]:
            continue
        members = {gives[v] for v in group}
        elements = tuple(name for name in graph.elements if name in members)
        start = next((v for v in group if graph.elements[gives[v]].kind == "R"), group[0])
        inside = {v: tuple(n for n in relations[v] if n in group) for v in group}
        back = [_towards(v, inside) for v in inside[start]]  # what each input of `start` is computed from
        circle = min(([*_path(start, towards), start] for towards in back if start in towards), key=len)
        resistors = [graph.title(name) for name in elements if graph.elements[name].kind == "R"]
        passed = ", ".join(graph.title(n) for n in dict.fromkeys(gives[v] for v in circle))
        through = " and ".join(resistors) or f"the junction structure at {passed}"
        more = f" ({len(group)} efforts and flows in all)" if len(group) > len(circle) - 1 else ""
        text = f"algebraic loop through {through}: {' -> '.join(map(str, circle))}{more}"
        circles.append(Circle(elements, tuple(sorted({v.bond for v in group})), text))
    return tuple(circles)


class Path(NamedTuple):
    """A zero-order causal path: efforts and flows round a loop, the elements that pass them on, and the loop's gain.

    gain: a SymPy expression of the elements' names; value: the same in numbers, None if a law is no constant.
    """

    signals: tuple[Signal, ...]
    elements: tuple[str, ...]
    gain: Any
    value: float | None

    def __str__(self) -> str:
        around = " -> ".join(map(str, (*self.signals, self.signals[0])))
        return f"{around}: gain {self.gain}" + ("" if self.value is None else f" = {self.value:.6g}")


def zero_order_paths(graph: BondGraph) -> tuple[Path, ...]:
    """Returns every causal path that leads back to its beginning without passing a store, as in algebraic loops.

    Raises:
        GraphError: if the strokes contradict each other, or there are more than a thousand such paths.

    >>> from bondgraph import Builder, I, R, Se
    >>> b = Builder().one("a").one("b").on("a", Se("u", 1.0), R("r", 2.0)).on("b", R("s", 3.0), I("m", 1.0))
    >>> b = b.zero("node").bond("a", "node").bond("node", "b").on("node", R("leak", 4.0))
    >>> for path in zero_order_paths(b.build()):
    ...     print(path)
    e_5 -> e_7 -> f_7 -> f_5 -> f_2 -> e_2 -> e_5: gain -r/leak = -0.5

    """
    import sympy  # type: ignore[import-untyped]

    assignment = causality(graph)
    refuse(assignment.conflicts)
    relations = inputs(graph, assignment.strokes)
    cycles: dict[frozenset[Signal], list[Signal]] = {}
    numbers = {e: k for k, e in enumerate(relations)}
    for circle in assignment.loops:
        inside = {v: [n for n in relations[v] if n.bond in circle.bonds] for v in relations if v.bond in circle.bonds}
        for start in inside:
            work, walk = [(start, iter(inside[start]))], [start]
            while work:
                for other in work[-1][1]:
                    if other == start:
                        cycles.setdefault(frozenset(walk), walk[::-1])
                    elif other not in walk and numbers[other] > numbers[start]:
                        walk.append(other)
                        work.append((other, iter(inside[other])))
                        break
                else:
                    work.pop()
                    walk.pop()
                if len(cycles) > _MOST_PATHS:
                    raise GraphError(f"more than {_MOST_PATHS} zero-order causal paths: list those of a part of the graph")
    paths = []
    bonds = {b.number: b for b in graph.bonds}
    for cycle in cycles.values():
        gain, value, passed = sympy.Integer(1), 1.0, []
        for cause, answer in zip(cycle, [*cycle[1:], cycle[0]], strict=True):
            bond, before = bonds[answer.bond], bonds[cause.bond]
            name = giver(bond, answer.letter, assignment.strokes)
            kind = graph.elements[name].kind
            passed.append(name)
            if kind in JUNCTIONS:
                sign = -1 if answer.letter != COMMON[kind] and before.sign(name) == bond.sign(name) else 1
                gain, value = sign * gain, sign * value
                continue
            constant = graph.is_linear(name) and None not in graph.parameters.values()
            down = answer.letter == "f" if kind != "TF" else (answer.letter == "f") == (bond.head == name)
            sign, power = int(bond.sign(name)) if kind == "R" else 1, -1 if down else 1
            gain = sign * gain * sympy.Symbol(name) ** power
            value = sign * value * (graph.constant(name) ** power if constant else math.nan)
        paths.append(Path(tuple(cycle), tuple(dict.fromkeys(passed)), gain, None if math.isnan(value) else value))
    return tuple(paths)


def _givers(graph: BondGraph, strokes: Mapping[int, str]) -> dict[Signal, str]:
    return {Signal(x, bond.number): giver(bond, x, strokes) for bond in graph.bonds for x in "ef"}


def _towards(start: Signal, relations: Inputs) -> dict[Signal, Signal]:
    """All variables from which `start` is computed, each with the next variable on the shortest way to it."""
    towards = {start: start}
    queue = [start]
    for variable in queue:
        fresh = [v for v in relations[variable] if v not in towards]
        towards |= dict.fromkeys(fresh, variable)
        queue += fresh
    return towards


def _path(variable: Signal, towards: Mapping[Signal, Signal]) -> Iterator[Signal]:
    yield variable
    while towards[variable] != variable:
        variable = towards[variable]
        yield variable


class Reason(NamedTuple):
    """Reason for the place of a stroke; its kind is source, preferred, propagated, chosen or derivative."""

    kind: str
    text: str


@dataclass(frozen=True, eq=False)
class Causality:
    """The causal strokes of a graph. Made by `causality`; `describe()` lists it.

    Args:
        graph: the graph.
        strokes: bond number -> name of the element at the stroke's end; it receives the effort and gives the flow.
        reasons: bond number -> why.
        integral: stores in integral causality: each is a state of its own.
        derivative: stores in derivative causality: they follow other stores and sources.
        follows: derivative store -> the stores that it follows, and the elements between.
        conflicts: a line for each contradiction; empty if the assignment is right.
        loops: the algebraic loops; not searched for if there are conflicts.

    """

    graph: BondGraph
    strokes: Mapping[int, str]
    reasons: Mapping[int, Reason]
    integral: tuple[str, ...]
    derivative: tuple[str, ...]
    follows: Mapping[str, str]
    conflicts: tuple[str, ...]
    loops: tuple[Circle, ...]

    def describe(self) -> str:
        """Every bond with its stroke and reason, then the stores, conflicts and loops, as text."""
        bonds = self.graph.bonds
        arrows = [f"{b.tail} -> {b.head}" for b in bonds]
        wide, end = max(10, *map(len, arrows)), max(9, *map(len, self.strokes.values()))
        lines = [f"bond  {'half arrow':{wide}}  {'stroke at':{end}}  reason"]
        for bond, arrow in zip(bonds, arrows, strict=True):
            reason = self.reasons[bond.number]
            stroke = self.strokes[bond.number]
            lines.append(f"{bond.number:4d}  {arrow:{wide}}  {stroke:{end}}  {reason.kind}: {reason.text}")
        lines.append("integral: " + (", ".join(self.graph.title(n) for n in self.integral) or "none"))
        follows, circles = [self.follows[n] for n in self.derivative], [loop.text for loop in self.loops]
        for what, items in (("derivative", follows), ("conflicts", self.conflicts), ("algebraic loops", circles)):
            lines += [f"{what}:", *(f"  {line}" for line in items)] if items else [f"{what}: none"]
        return "\n".join(lines)


def causality(graph: BondGraph, prefer: str | Mapping[str, str] = _INTEGRAL) -> Causality:
    """The causal strokes of a graph by sequential assignment.

    Conflicts are reported, not raised: the rest of the graph is assigned as well as it can be. An inertia of 0 has no
    momentum to be a state and prefers derivative causality, unless `prefer` names it.

    Args:
        graph: the graph.
        prefer: preference of stores, "integral" or "derivative"; or by name for some of them, integral for the others.

    Raises:
        GraphError: if `prefer` has another value, or a name that is no store.

    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().one("crank", displacement="theta").one("slider").on("crank", Se("M", 1.0), I("J", 2.0))
    >>> b = b.on("slider", I("m", 3.0)).transform("crank", "slider", lambda theta: theta, name="T")
    >>> strokes = causality(b.build())
    >>> strokes.integral, strokes.derivative, strokes.follows["m"]
    (('J',), ('m',), 'I:m follows I:J through MTF:T')

    """
    preferences = _preferences(as_graph(graph), prefer)
    fixed = []  # the sources' strokes, and all that follows from them and from the structure alone
    for source in graph.of_kind(*SOURCES):
        bond = graph.bond_of(source.name)
        end = source.name if source.kind == "Sf" else bond.other(source.name)
        fixed.append((bond, _StrokeMark(end, "source", source.name)))
    fixed += [(bond, _StrokeMark(end, "chosen", "")) for bond, end in _cancelling(graph)]
    draft = _extended(_Assignment(graph, {}, dict(_rings(graph)), frozenset()), fixed, list(graph.elements))
    for name in () if isinstance(prefer, str) else prefer:  # what is asked for by name comes first, if it can be had
        trial = _store(draft, preferences, name)
        free = graph.bond_of(name).number not in draft.marks
        draft = trial if free and len(trial.conflicts) == len(draft.conflicts) else draft
    draft = _completed(draft, preferences)
    strokes = {b.number: draft.marks[b.number].end for b in graph.bonds}
    relations = inputs(graph, strokes)
    circles = () if draft.conflicts else loops(graph, strokes, relations)
    how = {}
    for e in graph.of_kind(*STORES):
        how[e.name] = _INTEGRAL if is_integral(e.kind, strokes[graph.bond_of(e.name).number] == e.name) else _DERIVATIVE
    derivative = tuple(name for name, is_ in how.items() if is_ == _DERIVATIVE)
    return Causality(
        graph,
        strokes,
        {b.number: _reason(draft, b, preferences, how, circles) for b in graph.bonds},
        tuple(name for name, is_ in how.items() if is_ == _INTEGRAL),
        derivative,
        {name: follows(graph, strokes, relations, name) for name in derivative},
        tuple(draft.conflicts.values()),
        circles,
    )


def _rings(graph: BondGraph) -> Iterator[tuple[str, str]]:
    """A line for each bond that closes a ring of equal junctions, round which an effort (flow) of any size may go."""
    kind = {e.name: e.kind for e in graph.of_kind(*JUNCTIONS)}
    joined = [b for b in graph.bonds if kind.get(b.tail) == kind.get(b.head) is not None]
    for k, bond in enumerate(joined):
        one = representatives(kind, [b[1:] for b in joined[:k]])
        if one[bond.tail] == one[bond.head]:
            ends, free = f"{graph.title(bond.tail)} and {graph.title(bond.head)}", _WORDS[OTHER[COMMON[kind[bond.tail]]]]
            what = (
                f"bond {bond.number} joins {ends}, which other bonds join already: nothing determines its {free}; remove it"
            )
            yield f"bond {bond.number}", what


def _cancelling(graph: BondGraph) -> Iterator[tuple[Bond, str]]:
    """Pairs of bonds that join a 1-junction and a 0-junction both ways, each with the 1-junction as its stroke's end.

    The power of one returns by the other: such a pair decides neither the flow of the one nor the effort of the other. Equal
    junctions that bonds join count as one.
    """
    waiting: dict[tuple[str, str], list[Bond]] = {}
    kind = {e.name: e.kind for e in graph.of_kind(*JUNCTIONS)}
    one = representatives(kind, [b[1:] for b in graph.bonds if kind.get(b.tail) == kind.get(b.head) is not None])
    for bond in graph.bonds:
        if {graph.elements[bond.tail].kind, graph.elements[bond.head].kind} == JUNCTIONS:
            back = waiting.get((one[bond.head], one[bond.tail]))
            if back:
                yield from ((each, each.tail if kind[each.tail] == "1" else each.head) for each in (back.pop(), bond))
            else:
                waiting.setdefault((one[bond.tail], one[bond.head]), []).append(bond)


def _preferences(graph: BondGraph, prefer: str | Mapping[str, str]) -> dict[str, str]:
    stores = graph.of_kind(*STORES)
    preferred = dict.fromkeys([e.name for e in stores if e.law != 0.0], prefer) if isinstance(prefer, str) else dict(prefer)
    faults = []
    if isinstance(prefer, str) and prefer not in (_INTEGRAL, _DERIVATIVE):
        raise GraphError(f"prefer: found {prefer!r}, expected 'integral', 'derivative' or one of them by element name")
    for name, how in preferred.items():
        if name not in graph.elements or graph.elements[name].kind not in STORES:
            faults.append(f"prefer: {name!r} is no I or C of the graph")
        elif how not in (_INTEGRAL, _DERIVATIVE):
            faults.append(f"prefer: found {how!r} for {graph.title(name)}, expected 'integral' or 'derivative'")
    refuse(faults)
    preferences = {e.name: _DERIVATIVE if e.law == 0.0 else _INTEGRAL for e in stores} | preferred
    behind = _behind(graph)
    return {
        name: preferences[name]
        for name in sorted(preferences, key=lambda name: (name in behind) == (preferences[name] == _INTEGRAL))
    }


def _behind(graph: BondGraph) -> set[str]:
    """Inertias behind transformers whose ratios may vanish, and before which is weighed or measured too.

    They are the last to be states, the first not to be: otherwise these transformers would be turned round.
    """
    flow = variables(graph, "1")
    before: dict[int, set[int]] = {variable: set() for variable in flow.values()}
    for element in graph.of_kind("TF", "0"):
        bonds = graph.at(element.name)
        into, out = ([flow[b.number] for b in bonds if (b.head == element.name) is inward] for inward in (True, False))
        for variable in out:
            before[variable].update(into)
    weighed = {flow[graph.bond_of(e.name).number] for e in graph.of_kind("I") if e.law != 0.0}
    weighed |= {flow[graph.at(junction)[0].number] for junction in graph.measured}
    varying = [[flow[b.number] for b in graph.ends(e.name)] for e in graph.of_kind("TF") if not graph.is_linear(e.name)]
    beyond = set()
    for element in graph.of_kind("I") if varying else ():
        near = reached_from(flow[graph.bond_of(element.name).number], before)
        ahead = {v for into, out in varying if out in near for v in reached_from(into, before)}
        if ahead & weighed:
            beyond.add(element.name)
    return beyond


class _StrokeMark(NamedTuple):
    """A stroke: its end; whether and by which element it was decided or passed on; the bonds that it was passed on from."""

    end: str
    kind: str
    by: str
    causes: tuple[int, ...] = ()


class _Assignment(NamedTuple):
    graph: BondGraph
    marks: dict[int, _StrokeMark]
    conflicts: dict[str, str]
    backwards: frozenset[str]

    @property
    def strokes(self) -> dict[int, str]:
        """The stroke's end of every bond that has one so far."""
        return {number: mark.end for number, mark in self.marks.items()}


_Trial = Callable[[], _Assignment]


def _extended(draft: _Assignment, decided: Iterable[tuple[Bond, _StrokeMark]], todo: Sequence[str] = ()) -> _Assignment:
    """A draft with more strokes decided and all that follows from them filled in."""
    graph, marks, conflicts = draft.graph, dict(draft.marks), dict(draft.conflicts)
    strokes = draft.strokes
    queue = list(todo)
    for bond, mark in decided:
        marks[bond.number], strokes[bond.number] = mark, mark.end
        queue += bond[1:]
    backwards = set(draft.backwards)
    for name in queue:
        if graph.elements[name].kind in ONE_PORTS:
            continue
        for bond, at, causes in _forced(graph, strokes, name):
            end = name if at else bond.other(name)
            marks[bond.number] = _StrokeMark(end, "propagated", name, tuple(b.number for b in causes))
            strokes[bond.number] = end
            queue.append(bond.other(name))
        bonds = graph.at(name)
        marked = [b for b in bonds if b.number in strokes]
        if graph.elements[name].kind == "GY":
            contradicts = len({strokes[b.number] == name for b in marked}) > 1
        else:
            deciders = len(deciding(graph, strokes, name))
            contradicts = deciders > 1 or (deciders == 0 and len(marked) == len(bonds))
        if contradicts and name not in conflicts:
            conflicts[name] = _conflict(graph, marks, strokes, name)
        if _divides(graph, strokes, name):
            backwards.add(name)
    return _Assignment(graph, marks, conflicts, frozenset(backwards))


def _forced(graph: BondGraph, strokes: Mapping[int, str], name: str) -> list[tuple[Bond, bool, list[Bond]]]:
    """Strokes that an element's other bonds leave no choice for: the bond, whether it is at the element, why."""
    marked = [b for b in graph.at(name) if b.number in strokes]
    free = [b for b in graph.at(name) if b.number not in strokes]
    kind = graph.elements[name].kind
    if kind == "GY":
        return [(b, strokes[marked[0].number] == name, marked) for b in free] if marked else []
    decided = deciding(graph, strokes, name)
    if decided:
        return [(b, not DECIDES_AT[kind], decided[:1]) for b in free]
    return [(free[0], DECIDES_AT[kind], marked)] if len(free) == 1 else []


def _divides(graph: BondGraph, strokes: Mapping[int, str], name: str) -> bool:
    """True if causality divides by the ratio of a two-port, and that ratio may vanish."""
    if graph.elements[name].kind not in TWO_PORTS or (graph.is_linear(name) and graph.elements[name].law != 0.0):
        return False
    return strokes.get(graph.ends(name)[0].number) == name  # TF: f_in = f_out / T; GY: f_out = e_in / G


def _completed(draft: _Assignment, preferences: Mapping[str, str]) -> _Assignment:
    """The first assignment in the order of preference that adds no conflict; if there is none, one that adds few."""
    stack: list[_Trial] = [lambda: draft]
    for _ in range(_MOST_TRIALS * len(draft.graph.bonds)):
        if not stack:
            break
        tried = stack.pop()()
        if len(tried.conflicts) > len(draft.conflicts):
            continue
        trials = _trials(tried, preferences)
        if not trials:
            return tried
        stack += reversed(trials)
    while trials := _trials(draft, preferences):
        draft = min((trial() for trial in trials), key=lambda trial: len(trial.conflicts))
    return draft


def _trials(draft: _Assignment, preferences: Mapping[str, str]) -> list[_Trial]:
    """The two ways to decide the next open bond, the better one first; none if all bonds have their strokes."""
    graph = draft.graph
    if len(draft.marks) == len(graph.bonds):
        return []
    stores = [name for name in preferences if graph.bond_of(name).number not in draft.marks]
    if stores:  # the first that gets what it prefers without a conflict or a division by a modulus; else the first of all
        waiting = []
        for name in stores:
            trial = _store(draft, preferences, name)
            waiting.append(trial)
            if trial.backwards == draft.backwards and len(trial.conflicts) == len(draft.conflicts):
                return [lambda: waiting[-1], partial(_store, draft, preferences, name, opposite=True)]
        return [lambda: waiting[0], partial(_store, draft, preferences, stores[0], opposite=True)]
    resistors = [e.name for e in graph.of_kind("R") if graph.bond_of(e.name).number not in draft.marks]
    if resistors:  # first those whose laws cannot be solved for their flows, as resistances
        name = min(resistors, key=lambda n: _solvable(graph, n))
        bond = graph.bond_of(name)
        ends = bond.other(name), name
    else:
        bond, name = next(b for b in graph.bonds if b.number not in draft.marks), ""
        ends = bond.head, bond.tail
    both = [_extended(draft, [(bond, _StrokeMark(end, "chosen", name))]) for end in ends]
    better = sorted(both, key=lambda trial: len(trial.backwards)) if not name or _solvable(graph, name) else both
    return [lambda trial=trial: trial for trial in better]  # type: ignore[misc]


def _store(draft: _Assignment, preferences: Mapping[str, str], name: str, *, opposite: bool = False) -> _Assignment:
    """The draft with a store in the causality that is wanted of it, or in the opposite one."""
    bond = draft.graph.bond_of(name)
    gives_flow = is_integral(draft.graph.elements[name].kind, (preferences[name] == _INTEGRAL) != opposite)
    mark = _StrokeMark(name if gives_flow else bond.other(name), "chosen" if opposite else "preferred", name)
    return _extended(draft, [(bond, mark)])


def _solvable(graph: BondGraph, name: str) -> bool:
    """True if a resistor's flow can be computed from its effort, f = e / R; a function e(f) is not solved for f."""
    return graph.elements[name].law != 0.0 and not graph.is_curve(name)


def _conflict(graph: BondGraph, marks: Mapping[int, _StrokeMark], strokes: Mapping[int, str], name: str) -> str:
    kind, bonds = graph.elements[name].kind, graph.at(name)
    marked = [b for b in bonds if b.number in strokes]
    rivals = marked if kind in TWO_PORTS else deciding(graph, strokes, name) or marked
    led = dict.fromkeys(number for b in rivals for number in _roots(graph, marks, b))
    leading = {number: graph.elements[marks[number].by] for number in led}
    if len(led) > 1 and all(element.kind in SOURCES for element in leading.values()):
        both = " and ".join(f"{graph.title(element.name)} (bond {number})" for number, element in leading.items())
        sets = _WORDS["f"] if all(element.kind == "Sf" for element in leading.values()) else _WORDS["e"]
        numbers = ", ".join(str(b.number) for b in bonds)
        every = "both" if len(led) == 2 else "all"
        return f"{both} {every} set the {sets} of {graph.title(name)} (bonds {numbers}): remove one, or put an R between"
    if kind in TWO_PORTS:
        causes = [f"{_from(graph, marks, b)} gives it {'effort' if strokes[b.number] == name else 'flow'}" for b in bonds]
        rule = "one effort and one flow" if kind == "TF" else "two efforts or two flows"
        return f"{graph.title(name)}: {' and '.join(causes)}, expected {rule}; remove or reverse one of the two"
    word = _WORDS[COMMON[kind]]
    decided = [_from(graph, marks, b) for b in deciding(graph, strokes, name)]
    if decided:
        return f"{kind}:{name}: {' and '.join(decided)} both set its {word}; keep one of them"
    what = "an I or R" if kind == "1" else "a C or R"
    return f"{kind}:{name}: none of {', '.join(_from(graph, marks, b) for b in bonds)} sets its {word}; attach {what} to it"


def _roots(graph: BondGraph, marks: Mapping[int, _StrokeMark], bond: Bond) -> list[int]:
    """The bonds at which elements decided what a bond has its stroke from."""
    queue, seen = [bond.number], {bond.number}
    for number in queue:
        fresh = [n for n in marks[number].causes if n not in seen]
        seen.update(fresh)
        queue += fresh
    return [n for n in sorted(queue) if not marks[n].causes and marks[n].by in graph.elements]


def _from(graph: BondGraph, marks: Mapping[int, _StrokeMark], bond: Bond) -> str:
    """A bond and the elements whose decisions it has its stroke from: `bond 3 (from Se:a on bond 1)`."""
    roots = _roots(graph, marks, bond)
    places = {n: graph.title(marks[n].by) + (f" on bond {n}" if n != bond.number else "") for n in roots}
    return f"bond {bond.number}" + (f" (from {', '.join(places.values())})" if places else "")


def _reason(
    draft: _Assignment, bond: Bond, preferences: Mapping[str, str], how: Mapping[str, str], circles: Sequence[Circle]
) -> Reason:
    graph, mark = draft.graph, draft.marks[bond.number]
    port = next((n for n in bond[1:] if graph.elements[n].kind in ONE_PORTS), "")
    kind, text = mark.kind, _text(graph, mark, how)
    if how.get(port) == _DERIVATIVE != preferences.get(port):
        kind = "derivative"
        text = f"{graph.title(port)} has to follow: {text}" if mark.kind == "propagated" else text
    if kind == "chosen" and any(bond.number in loop.bonds for loop in circles):
        text += "; its causal path leads back to it, an algebraic loop"
    # what this stroke asks of a law that it may not give: a law's inverse, a division by a ratio that may vanish
    end, element = mark.end, graph.elements[port].kind if port else ""
    if element == "R" and end == port and not _solvable(graph, port):
        text += f"; the law e(f) of {graph.title(port)} has to be solved for f"
    elif element == "C" and how[port] == _DERIVATIVE and not graph.is_linear(port):
        text += f"; the law e(q) of {graph.title(port)} has to be solved for q"
    elif graph.elements[end].kind in TWO_PORTS and bond.head == end and _divides(graph, {bond.number: end}, end):
        source = f"{'f' if graph.elements[end].kind == 'TF' else 'e'}_{graph.ends(end)[1].number}"
        text += f"; f_{bond.number} = {source} / {end} divides by {graph.title(end)}, singular where it is 0"
    return Reason(kind, text)


def _text(graph: BondGraph, mark: _StrokeMark, how: Mapping[str, str]) -> str:
    """The words of a mark: who decided the stroke, or which element passed it on from which bonds."""
    gives = "flow" if mark.end == mark.by else "effort"
    if mark.kind == "source":
        return f"{graph.title(mark.by)} imposes its {gives}"
    if mark.kind == "propagated":
        element, where = graph.elements[mark.by], graph.title(mark.by)
        causes = ("bonds " if len(mark.causes) > 1 else "bond ") + ", ".join(map(str, mark.causes))
        if element.kind in TWO_PORTS:
            return f"{where} passes on {causes}"
        word = _WORDS[COMMON[element.kind]]
        if (mark.end == mark.by) is not DECIDES_AT[element.kind]:
            return f"{causes} sets the {word} of {where}"
        return f"no other bond sets the {word} of {where}" + (f" ({causes} cannot)" if mark.causes else "")
    if not mark.by:
        return f"nothing decides it: {graph.title(mark.end)} taken to receive the effort"
    if mark.by in how:
        because = "" if mark.kind == "preferred" else ", for the other way would contradict the rest"
        return f"{graph.title(mark.by)} {how[mark.by]}, gives its {gives}{because}"
    if gives == "flow":
        return f"{graph.title(mark.by)} taken as a conductance, f = e / {mark.by}"
    law = f"{mark.by} f" if _solvable(graph, mark.by) else f"{mark.by}(f)"
    return f"{graph.title(mark.by)} taken as a resistance, e = {law}"


# -- the table of equations --------------------------------------------------------------------------------------------


_HEADINGS = ("bond", "from", "to", "half arrow", "stroke at", "effort", "flow", "state")


class Symbol(NamedTuple):
    """An element's law by the element's name, with what it varies with, itself or inverted."""

    name: str
    kind: str
    arguments: tuple[str | Summand, ...] = ()
    inverse: bool = False


class Summand(NamedTuple):
    """One term of a sum: quantity, factor, factor times quantity, or quantity divided by the factor."""

    quantity: Signal | None
    factor: Symbol | None = None
    divided: bool = False
    positive: bool = True


class Equation(NamedTuple):
    """A quantity on the left (by name, as a law reads it), and the terms whose sum it is; 0 if there are none."""

    left: Signal | str
    right: tuple[Summand, ...]


class BondRow(NamedTuple):
    """One bond: its ends, where its stroke is, the equations of its effort and flow, and of its state at a store.

    An activated bond has a number below 0, no stroke, and the effort or flow that a law reads, by its name there.
    """

    bond: int
    tail: str
    head: str
    half_arrow: tuple[str, str]
    stroke: str
    effort: Equation | None
    flow: Equation | None
    state: Equation | None


@dataclass(frozen=True)
class Table:
    """The equations of a graph, a row for every bond. Made by `table`; print it with `text`, `markdown` or `latex`.

    Args:
        rows: one for every bond, in the graph's order, then one for every activated bond.
        notes: which stores follow others, and which equations are implicit because of an algebraic loop.

    """

    rows: tuple[BondRow, ...]
    notes: tuple[str, ...] = ()

    def text(self) -> str:
        """The table in aligned columns."""
        lines = [_HEADINGS, *(_cells(row, _written, str, "->", "=>") for row in self.rows)]
        wide = [max(len(line[k]) for line in lines) for k in range(len(_HEADINGS))]
        body = ["  ".join(cell.ljust(w) for cell, w in zip(line, wide, strict=True)).rstrip() for line in lines]
        return "\n".join([*body, *self._footer()])

    def markdown(self) -> str:
        """The table in Markdown, its equations as code."""
        lines = [_cells(row, lambda e: f"`{_written(e)}`", _markdown, "->", "=>") for row in self.rows]
        body = ["| " + " | ".join(line) + " |" for line in (_HEADINGS, ("---",) * len(_HEADINGS), *lines)]
        return "\n".join([*body, "", *(f"- {_markdown(line)}" for line in self._footer())])

    def latex(self) -> str:
        r"""The table as a LaTeX tabular with its convention below it; no package is needed."""
        arrows = r"$\rightarrow$", r"$\Rightarrow$"
        lines = [_cells(row, lambda e: f"${_written(e, tex=True)}$", _escaped, *arrows) for row in self.rows]
        body = [" & ".join(line) + r" \\" for line in (_HEADINGS, *lines)]
        columns = "r" + "l" * (len(_HEADINGS) - 1)
        table = [rf"\begin{{tabular}}{{{columns}}}", r"\hline", body[0], r"\hline", *body[1:], r"\hline", r"\end{tabular}"]
        return "\n".join([*table, *(rf"\par {_escaped(line)}" for line in self._footer())])

    def _footer(self) -> list[str]:
        return [f"convention: {CONVENTION}", *self.notes]


_assigned = causality  # where an argument has its name


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
    assigned = _assigned(graph) if causality is None else causality
    if assigned.graph is not graph:
        raise GraphError("the causality is that of another graph: give the one of this graph, or none")
    refuse(assigned.conflicts)
    relations = inputs(graph, assigned.strokes)
    rows = [_row(graph, assigned, relations, bond) for bond in graph.bonds]
    for signal in activated(graph):
        read = {x: f"{x}_{signal.tail}" for x in "ef" if f"{x}_{signal.tail}" in graph.depends_on(signal.head)}
        equations = {x: Equation(name, (Summand(Signal(*(graph.reading(name) or (x, 0)))),)) for x, name in read.items()}
        ends = graph.title(signal.tail), graph.title(signal.head), (signal.tail, signal.head)
        rows.append(BondRow(signal.number, *ends, "", equations.get("e"), equations.get("f"), None))
    implicit = [f"implicit equations: {loop.text}" for loop in assigned.loops]
    return Table(tuple(rows), (*(assigned.follows[name] for name in assigned.derivative), *implicit))


def _row(graph: BondGraph, assigned: Causality, relations: Inputs, bond: Bond) -> BondRow:
    effort, flow = (_equation(graph, assigned, relations, bond, letter) for letter in "ef")
    store = next((n for n in bond[1:] if graph.elements[n].kind in STORES), None)
    state = None
    if store is not None:  # its rate of change in integral causality, its value in derivative causality
        inertia = graph.elements[store].kind == "I"
        left = Signal("p" if inertia else "q", bond.number)
        if store in assigned.integral:
            rate = Signal("e" if inertia else "f", bond.number)
            state = Equation(left._replace(rate=True), (Summand(rate, positive=bond.sign(store) > 0),))
        else:
            summand = Summand(Signal("f" if inertia else "e", bond.number))
            curved = Summand(None, _symbol(graph, store, summand, inverse=True))
            state = Equation(left, (curved if _nonlinear(graph, store) else summand._replace(factor=_symbol(graph, store)),))
    ends = graph.title(bond.tail), graph.title(bond.head), (bond.tail, bond.head)
    return BondRow(bond.number, *ends, assigned.strokes[bond.number], effort, flow, state)


def _equation(graph: BondGraph, assigned: Causality, relations: Inputs, bond: Bond, letter: str) -> Equation:
    name = giver(bond, letter, assigned.strokes)
    kind, law, inward = graph.elements[name].kind, graph.elements[name].law, bond.sign(name) > 0
    needs = relations[Signal(letter, bond.number)]
    symbol = _symbol(graph, name)
    if kind in SOURCES:
        if isinstance(law, Law) and law.moving:  # it may depend on flows and time besides
            driving, own = (Summand(Signal("f", number)) for number in (graph.at(law.motion.of)[0].number, bond.number))
            also: dict[str, str | Summand] = {"speed": driving, "flow": own, "time": TIME}
            symbol = symbol._replace(arguments=(*symbol.arguments, *(also[name] for name in law.sees)))
        terms = [Summand(None, symbol)]
    elif kind in STORES:  # from its state, or its state's rate of change
        state = Signal("p" if kind == "I" else "q", bond.number)
        if letter == ("e" if kind == "I" else "f"):
            terms = [Summand(state._replace(rate=True), positive=inward)]
        elif _nonlinear(graph, name):
            terms = [Summand(None, _symbol(graph, name, Summand(state)))]
        else:
            terms = [Summand(state, symbol, divided=True)]
    elif kind == "R":
        inverse = needs[0].letter == "e"
        if not _nonlinear(graph, name):
            terms = [Summand(needs[0], symbol, divided=inverse, positive=inward)]
        elif inverse:
            terms = [Summand(None, _symbol(graph, name, Summand(needs[0]), inverse=True), positive=inward)]
        else:
            terms = [Summand(None, _symbol(graph, name, Summand(needs[0], positive=inward)))]
    elif kind not in JUNCTIONS:
        divided = (letter == "f") == (kind == "GY" or bond.head == name)
        terms = [Summand(needs[0], symbol, divided=divided)]
    elif letter == COMMON[kind]:
        terms = [Summand(need) for need in needs]
    else:
        signs = {b.number: b.sign(name) for b in graph.at(name)}
        terms = [Summand(need, positive=signs[need.bond] != signs[bond.number]) for need in needs]
        terms.sort(key=lambda term: not term.positive)
    return Equation(Signal(letter, bond.number), tuple(terms))


def _nonlinear(graph: BondGraph, name: str) -> bool:
    """True if a resistor's or compliance's law is a function of its own flow or displacement, no factor."""
    element = graph.elements[name]
    return graph.is_curve(name) or (element.kind == "C" and isinstance(element.law, Law))


def _symbol(graph: BondGraph, name: str, own: Summand | None = None, inverse: bool = False) -> Symbol:
    varies = graph.depends_on(name)
    if isinstance(graph.elements[name].law, Law) and not inverse:
        own = None  # such a law is a function of a motion's position instead
    return Symbol(name, graph.elements[name].kind, varies if own is None else (own, *varies), inverse)


def _cells(
    row: BondRow, equation: Callable[[Equation], str], word: Callable[[str], str], half: str, full: str
) -> tuple[str, ...]:
    words = (word(row.tail), word(row.head), half if row.bond > 0 else full, word(row.stroke))
    equations = [equation(one) if one is not None else "" for one in (row.effort, row.flow, row.state)]
    return (str(row.bond) if row.bond > 0 else "", *words, *equations)


def _written(equation: Equation, tex: bool = False) -> str:
    return f"{_quantity(equation.left, tex)} = {_sum(equation.right, tex)}"


def _quantity(quantity: Signal | str, tex: bool) -> str:
    if isinstance(quantity, str):
        return _latex_name(quantity) if tex else quantity
    letter, bond, rate = quantity
    return (rf"\dot{{{letter}}}" if rate else letter) + f"_{{{bond}}}" if tex else str(quantity)


def _sum(terms: Sequence[Summand], tex: bool) -> str:
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
_ESCAPES = {character: f"\\{character}" for character in "&%$#_{}"}
_ESCAPES |= {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_ESCAPES |= {"<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}"}


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


def _escaped(text: str) -> str:
    return "".join(_ESCAPES.get(character, character) for character in text)


def _markdown(text: str) -> str:
    return re.sub(r"([\\`*_|<>\[\]])", r"\\\1", text)
