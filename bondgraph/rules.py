"""Simplification: rewrite a graph with fewer bonds, so that effort and flow at every remaining port are unchanged.

Six rules (20-sim's reference manual) and the removal of velocities that are zero, each a separate function; `simplify`
applies the six until none applies. 1-junctions where a displacement or a law's motion is measured stay; if two of them
merge, the declarations move along.

Parts without power are removed by one rule (`without`). A dangling 1-junction, like a source Se = 0, leaves its neighbour a
bond without effort whose flow is free; a dangling 0-junction, a source Sf = 0 and the ground leave one without flow whose
effort is free. A bond without effort is no term at a 1-junction; at a 0-junction it takes the effort of all the others;
through a transformer it continues without effort, through a gyrator without flow; a one-port on it has no power. The same
holds with flow and effort exchanged. So all of them can be dropped alike, and every port that stays keeps its effort and
flow.

The formal procedure for drawing a bond graph has seven steps, each shown: 1 a 1-junction for every velocity; 2 forces,
resistors and springs on one, or through a 0-junction between two, and inertias; 3 transformers and gyrators; 4 power
directions; 5 without ground and dangling junctions; 6 simplified; 7 causality. Only what has power directions can be checked
as a graph, so steps 1 to 3 are lists of connections.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, combinations, count
from typing import NamedTuple

from bondgraph.elements import JUNCTIONS, ONE_PORTS, SOURCES, TWO_PORTS, Element, GraphError, Law, Modulus, One, refuse
from bondgraph.graph import Bond, BondGraph, Builder, as_graph, neighbours, new_bond
from bondgraph.numerics import reached_from
from bondgraph.strokes import Causality
from bondgraph.strokes import causality as strokes_of

SHARING = {"Se": "0", "Sf": "1"}  # the junction where one bond without effort (flow) leaves none to the others
_DUAL = {"Se": "Sf", "Sf": "Se"}


class Action(NamedTuple):
    """One rewriting: the rule, its change, the reason why it is allowed, and the numbers of the bonds removed or moved."""

    rule: str
    what: str
    why: str
    bonds: tuple[int, ...]

    def __str__(self) -> str:
        numbers = f"bond {', '.join(map(str, self.bonds))}: " if self.bonds else ""
        return f"{self.rule}: {numbers}{self.what}; {self.why}"


class Simplified(NamedTuple):
    """A simplified graph and the log of its changes, in order."""

    graph: BondGraph
    log: tuple[Action, ...]

    def __str__(self) -> str:
        return "\n".join([*map(str, self.log), str(self.graph)])


_Step = tuple[BondGraph, Action] | None
_Rule = Callable[[BondGraph, frozenset[str]], _Step]


def simplify(graph: BondGraph, keep: Iterable[str] = ()) -> Simplified:
    """Apply all six rules until none applies, and number the bonds anew from 1.

    Args:
        graph: any graph, also one built with `build(loose=True)`.
        keep: names of elements that must stay, such as the 1-junction of a coordinate.

    Raises:
        GraphError: if the graph contradicts itself, where nothing is left, or if `keep` holds an unknown name.

    >>> from bondgraph import Builder, I, R, Se
    >>> b = Builder().one("crank", "rotation").one("shaft", "rotation").one("idle", "rotation")
    >>> b = b.on("crank", Se("M", 3.0)).on("shaft", I("J", 2.0), R("B", 0.5))
    >>> b = b.bond("crank", "shaft").bond("shaft", "idle")
    >>> print(simplify(b.build(loose=True)))
    dangling: bond 5: 1:idle dropped; no element is on 1:idle, so its bond has no effort
    two bonds: bond 1, 4: 1:crank dropped; Se:M -> 1:shaft says the same
    all rules: from 5 bonds to 3; numbered anew
    bond graph: 4 elements, 3 bonds (f_out = T f_in, e_in = T e_out)
       1  Se:M = 3 -> 1:shaft
       2  1:shaft -> I:J = 2
       3  1:shaft -> R:B = 0.5

    """
    simpler, log = _run(_RULES, graph, keep)
    bonds = tuple(bond._replace(number=k) for k, bond in enumerate(simpler.bonds, 1))
    what = f"from {len(graph.bonds)} bonds to {len(bonds)}"
    return Simplified(replace(simpler, bonds=bonds), (*log, Action("all rules", what, "numbered anew", ())))


def drop_dangling(graph: BondGraph, keep: Iterable[str] = ()) -> Simplified:
    """Rule 1: drop junctions with a single bond, with all parts that lose their power thereby.

    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().one("shaft").one("idle").on("shaft", Se("M", 3.0), I("J", 2.0)).bond("shaft", "idle")
    >>> print(drop_dangling(b.build(loose=True)).log[0])
    dangling: bond 3: 1:idle dropped; no element is on 1:idle, so its bond has no effort
    """
    return _run((_dangling,), graph, keep)


def drop_two_bond_junctions(graph: BondGraph, keep: Iterable[str] = ()) -> Simplified:
    """Rule 2: drop junctions with one bond in and one out; where both half arrows point in, or out, a sign would be lost.

    >>> from bondgraph import Builder, I, R, Se
    >>> b = Builder().one("a").zero("between").one("b").on("a", Se("M", 3.0), I("J", 2.0)).on("b", I("m", 1.0), R("B", 0.5))
    >>> print(drop_two_bond_junctions(b.bond("a", "between").bond("between", "b").build()).log[0])
    two bonds: bond 5, 6: 0:between dropped; 1:a -> 1:b says the same
    """
    return _run((_two_bonds,), graph, keep)


def merge_equal_junctions(graph: BondGraph, keep: Iterable[str] = ()) -> Simplified:
    """Rule 3: merge neighbouring junctions of one kind, also where several bonds join them.

    >>> from bondgraph import Builder, I, R, Se
    >>> b = Builder().one("a").one("b").on("a", Se("M", 3.0), I("J", 2.0)).on("b", R("B", 0.5)).bond("a", "b")
    >>> print(merge_equal_junctions(b.build()).log[0])
    equal junctions: bond 4: 1:b becomes part of 1:a; both have one flow
    """
    return _run((_rules_equal,), graph, keep)


def drop_zero_sources(graph: BondGraph, keep: Iterable[str] = ()) -> Simplified:
    """Rule 4: drop sources of value 0, with all parts that lose their power thereby.

    >>> from bondgraph import Builder, I, Se
    >>> print(drop_zero_sources(Builder().one("a").on("a", I("J", 2.0), Se("M", 3.0), Se("F", 0.0)).build()).log[0])
    zero source: bond 3: Se:F dropped; F = 0 leaves no effort
    """
    return _run((partial(_zero_source, kinds=("Se", "Sf")),), graph, keep)


def absorb_junctions(graph: BondGraph, keep: Iterable[str] = ()) -> Simplified:
    """Rule 5: give neighbours of a 0-junction whose effort an Se sets (1, flow, Sf) sources NAME.2, NAME.3... of their own.

    Only where the rest still hangs together: a bond that alone holds the graph together stays; nor is a source in `keep`
    copied. The powers of the source and its copies add up to its former power.

    >>> from bondgraph import Builder, I, R, Se
    >>> b = Builder().zero("bus").one("a").one("b").bond("bus", "a").bond("bus", "b").bond("a", "b").on("bus", Se("u", 3.0))
    >>> print(absorb_junctions(b.on("a", I("L", 2.0)).on("b", R("r", 1.0)).build()).log[0].rule)
    source at a junction
    """
    return _run((_absorbed,), graph, keep)


def merge_double_differences(graph: BondGraph, keep: Iterable[str] = ()) -> Simplified:
    """Rule 6: two 0-junctions that take the same difference of the same two flows become one, that feeds a 1-junction.

    >>> from bondgraph import Builder, C, I, R
    >>> b = Builder().one("a").one("b").on("a", I("m", 1.0)).on("b", I("n", 2.0)).between("a", "b", C("k", 1.0))
    >>> print(merge_double_differences(b.between("a", "b", R("d", 1.0), name="beside").build()).log[0].rule)
    double difference
    """
    return _run((_double_difference,), graph, keep)


def drop_zero_velocity(graph: BondGraph, names: Iterable[str] = (), keep: Iterable[str] = ()) -> Simplified:
    """Hold the named 1-junctions (the ground) at flow 0, and drop them and those with Sf = 0 with all that has no power.

    A 1-junction stays, held by a source Sf = 0, where a displacement is measured at it, where the graph would fall apart
    without it, or where a modulated transformer beyond it might leave its far side free.

    >>> from bondgraph import Builder, C, I
    >>> b = Builder().one("mass", "translation").one("ground", "translation").on("mass", I("m", 2.0))
    >>> simplified = drop_zero_velocity(b.between("mass", "ground", C("k", stiffness=8.0)).build(loose=True), ["ground"])
    >>> print(simplified.graph)
    bond graph: 4 elements, 3 bonds (f_out = T f_in, e_in = T e_out)
       1  1:mass -> I:m = 2
       2  1:mass -> 0:mass-ground
       4  0:mass-ground -> C:k = 0.125
    """
    names, kept, log = tuple(dict.fromkeys(names)), _checked(graph, keep), []
    wrong = [n for n in names if n not in graph.elements or graph.elements[n].kind != "1"]
    refuse(f"zero velocity {name!r}: no 1-junction of the graph" for name in wrong)
    graph = _with_domains(graph)
    for name in names:
        if name in graph.elements:
            pins = [(bond, bond.other(name), "Sf") for bond in graph.at(name)]
            rest = None if name in kept | graph.measured else without(graph, name, pins, kept)
            if rest:
                graph, action = _dropped("zero velocity", graph, rest, f"1:{name} does not move")
            elif has_zero_source(graph, name, "Sf", graph.bonds):
                action = Action("zero velocity", f"1:{name} stays", "a source Sf = 0 holds it already", ())
            else:
                source = Element("Sf", fresh_name(graph, f"{name}.zero"), 0.0, graph.elements[name].domain)
                graph = edited(graph, [*graph.bonds, new_bond(graph.bonds, source.name, name)], (), [source])
                why = "it must stay, and does not move"
                action = Action("zero velocity", f"Sf:{source.name} = 0 holds 1:{name}", why, ())
            log.append(action)
    simplified = _run((partial(_zero_source, kinds=("Sf",)),), graph, kept)
    return Simplified(simplified.graph, (*log, *simplified.log))


def _run(rules: Iterable[_Rule], graph: BondGraph, keep: Iterable[str]) -> Simplified:
    """Apply the first rule that applies, until none does. Every action leaves fewer loops, or fewer bonds, so this ends."""
    kept, log = _checked(graph, keep), []
    graph = _with_domains(graph)
    while applied := next((step for rule in rules if (step := rule(graph, kept))), None):
        graph = applied[0]
        log.append(applied[1])
    return Simplified(graph, tuple(log))


def _checked(graph: BondGraph, keep: Iterable[str]) -> frozenset[str]:
    graph, kept = as_graph(graph), (keep,) if isinstance(keep, str) else tuple(keep)
    refuse(f"keep {name!r}: no element of the graph has this name" for name in kept if name not in graph.elements)
    return frozenset((*kept, *graph.switched))


def _with_domains(graph: BondGraph) -> BondGraph:
    """Every element names its domain, so that a region keeps its own when the element that named it goes."""
    domains = {name: graph.domain(graph.at(name)[0]) for name, e in graph.elements.items() if e.kind not in TWO_PORTS}
    named = {name: graph.elements[name]._replace(domain=domain.name) for name, domain in domains.items() if domain}
    return replace(graph, elements={**graph.elements, **named})


def _dangling(graph: BondGraph, kept: frozenset[str]) -> _Step:
    staying = kept | graph.measured
    for name, kind in ((e.name, e.kind) for e in graph.of_kind(*JUNCTIONS)):
        bond = graph.at(name)[0]
        beyond = bond.other(name)
        if name in staying or len(graph.at(name)) > 1 or graph.elements[beyond].kind in ONE_PORTS:
            continue
        rest = without(graph, name, [(bond, beyond, "Se" if kind == "1" else "Sf")], kept)
        if rest and len(rest[0].bonds) < len(graph.bonds):
            what = "effort" if kind == "1" else "flow"
            return _dropped("dangling", graph, rest, f"no element is on {kind}:{name}, so its bond has no {what}")
    return None


def _dropped(rule: str, before: BondGraph, rest: tuple[BondGraph, str], why: str) -> tuple[BondGraph, Action]:
    """The graph that `without` found, and the action with the numbers of the bonds that went, or lead elsewhere now."""
    numbers = tuple(bond.number for bond in before.bonds if bond not in rest[0].bonds)
    return rest[0], Action(rule, rest[1], why, numbers)


def _two_bonds(graph: BondGraph, kept: frozenset[str]) -> _Step:
    for element in graph.of_kind(*JUNCTIONS):
        name, at = element.name, graph.at(element.name)
        if name in kept | graph.measured or len(at) != 2 or at[0].sign(name) == at[1].sign(name):
            continue
        into, out = graph.ends(name)
        rest = [b for b in graph.bonds if b not in at]
        ends = [graph.elements[into.tail], graph.elements[out.head]]
        # whether two zero sources that decide the same flow (effort) would meet if these two were joined
        meet = any(
            all(
                (e.kind == zero and e.law == 0.0) or (e.kind == at_one and has_zero_source(graph, e.name, zero, graph.bonds))
                for e in ends
            )
            for zero, at_one in SHARING.items()
        )
        if into.tail != out.head and {e.kind for e in ends} & JUNCTIONS and not meet:
            simpler = edited(graph, [*rest, Bond(min(at).number, into.tail, out.head)], {name})
            why = f"{graph.title(into.tail)} -> {graph.title(out.head)} says the same"
        elif into.tail == out.head and len(graph.at(into.tail)) > 2:
            simpler = edited(graph, rest, {name})
            why = f"power that leaves {graph.title(into.tail)} comes straight back"
        else:
            continue
        return simpler, Action("two bonds", f"{element.kind}:{name} dropped", why, tuple(b.number for b in at))
    return None


def _rules_equal(graph: BondGraph, kept: frozenset[str]) -> _Step:
    rank = {name: (name not in kept, name not in graph.measured, k) for k, name in enumerate(graph.elements)}
    for bond in graph.bonds:
        stays, goes = sorted(bond[1:], key=lambda name: rank[name])
        kind = graph.elements[stays].kind
        between = [b for b in graph.at(stays) if b.other(stays) == goes]
        alone = len(between) == len(graph.at(stays)) == len(graph.at(goes))
        switched = stays in graph.switched
        if kind not in JUNCTIONS or graph.elements[goes].kind != kind or goes in kept or alone or switched:
            continue
        what = f"{kind}:{goes} becomes part of {kind}:{stays}"
        what += "".join(f", displacement {d.name!r} moves there" for d in graph.displacements.values() if d.of == goes)
        numbers = tuple(b.number for b in between)
        bonds = [bond.moved(goes, stays) for bond in graph.bonds if bond not in between]
        elements = {}
        for name, element in graph.elements.items():
            law = element.law
            if isinstance(law, Modulus | Law) and law.motion.of == goes:
                law = law._replace(motion=law.motion._replace(of=stays))
            elements[name] = element._replace(law=law)
        del elements[goes]
        displacements = {name: d._replace(of=stays if d.of == goes else d.of) for name, d in graph.displacements.items()}
        merged = replace(graph, elements=elements, bonds=tuple(bonds), displacements=displacements)
        why = "both have one flow" if kind == "1" else "both have one effort"
        return merged, Action("equal junctions", what, why, numbers)
    return None


def _zero_source(graph: BondGraph, kept: frozenset[str], kinds: Collection[str]) -> _Step:
    for source in graph.of_kind(*kinds):
        if source.law != 0.0 or source.name in kept:
            continue
        bond = graph.bond_of(source.name)
        rest = without(graph, source.name, [(bond, bond.other(source.name), source.kind)], kept)
        if rest and len(rest[0].bonds) < len(graph.bonds):
            what = "effort" if source.kind == "Se" else "flow"
            return _dropped("zero source", graph, rest, f"{source.name} = 0 leaves no {what}")
    return None


def _absorbed(graph: BondGraph, kept: frozenset[str]) -> _Step:
    for source in (e for e in graph.of_kind(*SOURCES) if e.law != 0.0 and e.name not in kept):
        junction = graph.bond_of(source.name).other(source.name)
        kind = graph.elements[junction].kind
        for bond in graph.at(junction) if kind == SHARING[source.kind] else ():
            beyond = graph.elements[bond.other(junction)].kind
            if beyond not in JUNCTIONS or beyond == kind:
                continue
            bonds = [b for b in graph.bonds if b != bond]
            if len(reached_from(bond.tail, neighbours(graph.elements, bonds))) < len(graph.elements):
                continue  # it holds the graph together
            copy = source._replace(name=fresh_name(graph, source.name))
            what = f"{source.kind}:{copy.name}, a copy of {source.name}, takes the place of {kind}:{junction} there"
            why = f"{source.name} sets all of {kind}:{junction}"
            simpler = edited(graph, [*bonds, bond.moved(junction, copy.name)], (), [copy])
            return simpler, Action("source at a junction", what, why, (bond.number,))
    return None


def _difference(
    graph: BondGraph, zero: str, ones: tuple[str, str]
) -> tuple[tuple[Bond, Bond], Bond, tuple[float, float, float]] | None:
    """The bonds of a 0-junction to two 1-junctions, the third bond, and the signs there."""
    at = {bond.other(zero): bond for bond in graph.at(zero)}
    if len(at) != 3 or len(graph.at(zero)) != 3 or not at.keys() >= set(ones):
        return None
    third = next(bond for name, bond in at.items() if name not in ones)
    ring = at[ones[0]], at[ones[1]]
    return ring, third, (ring[0].sign(zero), ring[1].sign(zero), third.sign(zero))


def _double_difference(graph: BondGraph, kept: frozenset[str]) -> _Step:
    for pair in combinations([e.name for e in graph.of_kind("1")], 2):
        taken = [(e.name, d) for e in graph.of_kind("0") if (d := _difference(graph, e.name, pair))]
        for one, other in combinations(sorted(taken, key=lambda item: item[0] not in kept), 2):
            (stays, (_, third, signs)), (goes, (ring, dropped, other_signs)) = one, other
            if goes in kept or third == dropped or signs not in (other_signs, tuple(-s for s in other_signs)):
                continue
            rate = One(fresh_name(graph, f"{stays}.rate"), graph.elements[stays].domain)
            gone = (*ring, dropped, third)
            hung = [third.moved(stays, rate.name), dropped.moved(goes, rate.name)]
            ends = (rate.name, stays) if signs[2] > 0 else (stays, rate.name)
            bonds = [*(b for b in graph.bonds if b not in gone), *hung, new_bond(graph.bonds, *ends)]
            what = f"0:{goes} dropped, 1:{rate.name} carries the flow of 0:{stays} to the elements of both"
            numbers = tuple(b.number for b in gone)
            action = Action("double difference", what, "both take the same difference of two flows", numbers)
            return edited(graph, bonds, {goes}, [rate]), action
    return None


_RULES: tuple[_Rule, ...] = (
    _dangling,
    partial(_zero_source, kinds=("Se", "Sf")),
    _two_bonds,
    _rules_equal,
    _double_difference,
    _absorbed,
)


FreedBond = tuple[Bond, str, str]  # a bond, one of its ends, and "Se" where its effort is 0 and its flow free, else "Sf"


def without(graph: BondGraph, start: str, pins: Iterable[FreedBond], kept: frozenset[str]) -> tuple[BondGraph, str] | None:
    """The graph without an element and all parts that have no power then.

    Args:
        graph: the graph; it is left as it is.
        start: the element that goes.
        pins: its bonds, seen from their other ends.
        kept: elements that must stay; so must 1-junctions where something is measured.

    Returns:
        The new graph, and the words for the removed parts; None if the graph would fall apart.

    Raises:
        GraphError: if a source contradicts the zeros, or if no element remains.

    """
    staying = kept | graph.measured
    names, cut, zeros = {start}, set[int](), dict[str, str]()  # what goes; the junctions that stay, held by a zero source
    todo, stuck = list(pins), list[FreedBond]()
    faults: list[str] = []
    while todo:
        bond, at, zero = todo.pop()
        element = graph.elements[at]
        kind = element.kind
        not_zero = isinstance(element.law, float | int) and element.law != 0
        if kind == zero and not_zero:
            where = f"bond {bond.number}: {graph.label(at)} sets {'an effort' if kind == 'Se' else 'a flow'}"
            faults.append(f"{where} that the rest keeps at 0; drop it or attach it elsewhere")
        # whether the element adds nothing but zeros and what is free, for any value that its law may take
        passes = kind not in ONE_PORTS or kind != zero or element.law == 0.0
        if (
            kind in TWO_PORTS and not not_zero
        ):  # f_out = T f_in and e_in = T e_out carry a zero on from their right-hand side
            passes = zero == "Sf" if kind == "GY" else (bond.head == at) == (zero == "Sf")
        if kind in JUNCTIONS and (kind != SHARING[zero] or at in names | staying):
            cut.add(bond.number)
            zeros |= {at: zero} if kind == SHARING[zero] and at in staying else {}
        elif at not in staying and passes:
            cut.add(bond.number)
            names.add(at)
            onward = _DUAL[zero] if kind == "GY" else zero
            todo += [(b, b.other(at), onward) for b in graph.at(at) if b.number not in cut]
        else:
            stuck.append((bond, at, zero))
    refuse(dict.fromkeys(faults))
    zeros |= {bond.other(at): zero for bond, at, zero in stuck if bond.number not in cut}
    names.difference_update(zeros)

    # zero sources for the held junctions that keep none of their own; a new name, for what it holds back is new. A junction
    # that two zeros hold keeps one: what each of them held back was undetermined, and has no power
    left = [b for b in graph.bonds if b.number not in cut]
    sources, fresh = list[Element](), list[Bond]()
    for name, zero in zeros.items():
        if not has_zero_source(graph, name, zero, left) and not _equal(graph, name, left) & {b.head for b in fresh}:
            sources.append(Element(zero, fresh_name(graph, f"{name}.zero"), 0.0, graph.elements[name].domain))
            fresh.append(new_bond((*graph.bonds, *fresh), sources[-1].name, name))
    bonds = left + fresh

    # the connected pieces that the graph falls into; junctions and two-ports alone are none
    elements = {n: e for n, e in graph.elements.items() if n not in names} | {s.name: s for s in sources}
    near, unseen, pieces = neighbours(elements, bonds), set(elements), list[set[str]]()
    for name in elements:
        if name in unseen:
            piece = reached_from(name, near)
            unseen -= piece
            if any(n in staying or elements[n].kind in ONE_PORTS for n in piece):
                pieces.append(piece)
    if not pieces:
        raise GraphError(f"nothing is left without {graph.title(start)}: no element has power")
    if len(pieces) > 1:
        return None
    gone = graph.elements.keys() - pieces[0]
    what = [
        f"{', '.join(graph.title(name) for name in graph.elements if name in gone)} dropped",
        *(f"{s.kind}:{s.name} = 0 holds {b.head}" for s, b in zip(sources, fresh, strict=True)),
    ]
    return edited(graph, [b for b in bonds if b.tail in pieces[0]], gone, sources), ", ".join(what)


def has_zero_source(graph: BondGraph, junction: str, kind: str, bonds: Iterable[Bond]) -> bool:
    """True if, by these bonds, a source of value 0 of this kind holds a junction or an equal one joined to it."""
    group = _equal(graph, junction, bonds)
    around = [graph.elements[name] for bond in bonds if group & set(bond[1:]) for name in bond[1:]]
    return any(element.kind == kind and element.law == 0.0 for element in around)


def _equal(graph: BondGraph, junction: str, bonds: Iterable[Bond]) -> set[str]:
    """The junction and those of its kind that these bonds join to it."""
    same = {name for name, e in graph.elements.items() if e.kind == graph.elements[junction].kind}
    return reached_from(junction, neighbours(same, [b for b in bonds if same.issuperset(b[1:])]))


def edited(graph: BondGraph, bonds: Iterable[Bond], gone: Collection[str] = (), added: Iterable[Element] = ()) -> BondGraph:
    """The graph with these bonds, without the elements that are gone, and with those added."""
    elements = {name: element for name, element in graph.elements.items() if name not in gone}
    return replace(graph, elements=elements | {e.name: e for e in added}, bonds=tuple(sorted(bonds)))


def fresh_name(graph: BondGraph, name: str) -> str:
    """The name itself, or the first of NAME.2, NAME.3... that is still free."""
    names = chain([name], (f"{name}.{k}" for k in count(2)))
    return next(n for n in names if n not in graph.elements)


# -- the formal procedure ----------------------------------------------------------------------------------------------


Place = tuple[Element, str] | tuple[Element, str, str]


class DrawingStep(NamedTuple):
    """One step: its number and title, its changes, line by line, and the graph after it (None before it has directions)."""

    number: int
    title: str
    what: tuple[str, ...]
    graph: BondGraph | None

    def __str__(self) -> str:
        lines = [f"{self.number} {self.title}", *(f"    {line}" for line in self.what or ("nothing to do",))]
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class Procedure:
    """The seven steps and their result; `str(procedure)` lists the changes of each.

    Args:
        steps: in order.
        graph: the final graph.
        causality: its causality.

    """

    steps: tuple[DrawingStep, ...]
    graph: BondGraph
    causality: Causality

    def __str__(self) -> str:
        return "\n".join([*map(str, self.steps), str(self.graph)])


def procedure(
    velocities: Mapping[str, str],
    elements: Sequence[Place],
    transducers: Sequence[tuple[Element, str, str]] = (),
    *,
    zero: Iterable[str] = (),
    displacements: Mapping[str, str | tuple[str, float]] | None = None,
    signals: Iterable[str] = (),
    parameters: Mapping[str, float | None] | None = None,
    keep: Iterable[str] = (),
) -> Procedure:
    """Draws a bond graph by the seven steps.

    Args:
        velocities: their names, each with its energy domain.
        elements: one-ports, each with the velocity that it is on, or the two between which it acts (first minus second).
        transducers: transformers and gyrators, each with the velocities that it leads from and to.
        zero: velocities that are zero, such as the ground.
        displacements: names of integrals of velocities, each with its velocity, or with that and its value at the start.
        signals: names of functions of time that laws depend on.
        parameters: named constants that laws depend on.
        keep: elements that must not be simplified away, such as the velocity of a coordinate.

    Raises:
        GraphError: with a line for every contradiction.

    >>> from bondgraph import I, R, Se
    >>> drawn = procedure(
    ...     {"car": "translation", "road": "translation"},
    ...     [(Se("F", 300.0), "car"), (I("m", 900.0), "car"), (R("drag", 15.0), "car", "road")],
    ...     zero=["road"],
    ... )
    >>> print(drawn.steps[1])
    2 forces, resistors, springs and inertias
        Se:F = 300 on 1:car
        R:drag = 15 on 0:car-road.drag between 1:car and 1:road
        I:m = 900 on 1:car
    >>> print(drawn.graph)
    bond graph: 4 elements, 3 bonds (f_out = T f_in, e_in = T e_out)
       1  Se:F = 300 -> 1:car
       2  1:car -> R:drag = 15
       3  1:car -> I:m = 900

    """
    integrals = [(q, of, 0.0) if isinstance(of, str) else (q, *of) for q, of in (displacements or {}).items()]
    ground, kept = tuple(zero), tuple(keep)
    refuse(_faults(velocities, elements, transducers, ground, integrals))
    rank = {"Se": 0, "Sf": 0, "R": 1, "C": 1, "I": 2}  # of the second step: forces, resistors and springs, inertias
    ordered = sorted(elements, key=lambda place: rank[place[0].kind])

    b = Builder()  # with power directions from sources to the rest, from the first velocity to the second
    for name, domain in velocities.items():
        b.one(name, domain)
    for name, of, initial in integrals:
        b.displacement(name, of, initial)
    for element, first, *second in ordered:
        if second:
            node = f"{first}-{second[0]}.{element.name}"
            # a source between two velocities pushes the first one on and the second one back
            ends = (second[0], first) if element.kind in SOURCES else (first, second[0])
            b.zero(node).bond(ends[0], node).bond(node, ends[1]).port(node, element)
        else:
            b.port(first, element)
    for element, source, target in transducers:
        b.add(element)
        b.bond(source, element.name).bond(element.name, target)
    drawn = b.signal(*signals).parameter(**dict(parameters or {})).build(loose=True)

    moving = drop_zero_velocity(drawn, ground, kept)
    hung = drop_dangling(moving.graph, kept)
    small = simplify(hung.graph, kept)
    assigned = strokes_of(small.graph)
    junctions = [
        f"1:{name}" + f" ({domain})" * bool(domain) + " = 0" * (name in ground) for name, domain in velocities.items()
    ]
    places = [
        f"{drawn.label(element.name)} on "
        + (f"0:{first}-{second[0]}.{element.name} between 1:{first} and 1:{second[0]}" if second else f"1:{first}")
        for element, first, *second in ordered
    ]
    joints = [f"{drawn.label(e.name)} between 1:{source} and 1:{target}" for e, source, target in transducers]
    causal = [f"bond {number}: effort goes to {name}" for number, name in sorted(assigned.strokes.items())]
    named = (("integral", assigned.integral), ("derivative", assigned.derivative))
    causal += [f"{kind}: {', '.join(names)}" for kind, names in named if names]
    steps = (
        DrawingStep(1, "a 1-junction for every velocity", tuple(junctions), None),
        DrawingStep(2, "forces, resistors, springs and inertias", tuple(places), None),
        DrawingStep(3, "transformers and gyrators", tuple(joints), None),
        DrawingStep(4, "power directions", tuple(str(drawn).splitlines()[1:]), drawn),
        DrawingStep(
            5, "without zero velocities and dangling junctions", tuple(map(str, (*moving.log, *hung.log))), hung.graph
        ),
        DrawingStep(6, "simplified", tuple(map(str, small.log)), small.graph),
        DrawingStep(7, "causality", (*causal, *assigned.conflicts), small.graph),
    )
    return Procedure(steps, small.graph, assigned)


def _faults(
    velocities: Mapping[str, str],
    elements: Sequence[Place],
    transducers: Sequence[tuple[Element, str, str]],
    zero: Sequence[str],
    integrals: Sequence[tuple[str, str, float]],
) -> Iterator[str]:
    used = set[str]()
    named = [*velocities, *(place[0].name for place in (*elements, *transducers))]
    yield from (f"two of the velocities and elements are named {n!r}" for n in sorted(set(named)) if named.count(n) > 1)
    for kinds, places, counts in ((ONE_PORTS, elements, (1, 2)), (TWO_PORTS, transducers, (2,))):
        for element, *where in places:
            title = f"{element.symbol}:{element.name}"
            used.update(where)
            if element.kind not in kinds:
                yield f"{title}: found a {element.kind}, expected one of {', '.join(sorted(kinds))}"
            if len(where) not in counts or len(set(where)) < len(where):
                expected = f"{' or '.join(map(str, counts))} different ones"
                yield f"{title}: found velocities {', '.join(where) or 'none'}, expected {expected}"
            yield from (f"{title}: no velocity {name!r}" for name in where if name not in velocities)
    yield from (f"zero velocity {name!r}: no such velocity" for name in zero if name not in velocities)
    yield from (f"displacement {q!r}: no velocity {of!r}" for q, of, _ in integrals if of not in velocities)
    yield from (f"velocity {name!r}: nothing is on it, leave it out" for name in velocities if name not in used)
