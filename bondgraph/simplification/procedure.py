"""The formal procedure for drawing a bond graph, in seven steps, each shown.

1 a 1-junction for every velocity; 2 forces, resistors and springs on one, or through a 0-junction between two, and
inertias; 3 transformers and gyrators; 4 power directions; 5 without ground and dangling junctions; 6 simplified;
7 causality. Only what has power directions can be checked as a graph, so steps 1 to 3 are lists of what joins what.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from bondgraph.builder import Builder
from bondgraph.elements import ONE_PORTS, SOURCES, TWO_PORTS, Element
from bondgraph.graph import BondGraph
from bondgraph.laws import refuse
from bondgraph.simplification.rules import drop_dangling, drop_zero_velocity, simplify

Place = tuple[Element, str] | tuple[Element, str, str]


class Step(NamedTuple):
    """One step: its number and title, what was done, line by line, and the graph then (None before it has directions)."""

    number: int
    title: str
    what: tuple[str, ...]
    graph: BondGraph | None

    def __str__(self) -> str:
        lines = [f"{self.number} {self.title}", *(f"    {line}" for line in self.what or ("nothing to do",))]
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class Procedure:
    """The seven steps and what they lead to; `str(procedure)` tells what each one did.

    Args:
        steps: in order.
        graph: the final graph.
        causality: its causality, a `bondgraph.Causality`.

    """

    steps: tuple[Step, ...]
    graph: BondGraph
    causality: Any

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
    """Draw a bond graph by the seven steps.

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
        GraphError: with a line for everything that does not fit together.

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
    given = _Given(dict(velocities), tuple(elements), tuple(transducers), tuple(zero), dict(displacements or {}))
    refuse(_faults(given))
    drawn = _drawn(given).signal(*signals).parameter(**dict(parameters or {})).build(loose=True)
    return _carried_out(given, drawn, tuple(keep))


class _Given(NamedTuple):
    velocities: dict[str, str]
    elements: tuple[Place, ...]
    transducers: tuple[tuple[Element, str, str], ...]
    zero: tuple[str, ...]
    displacements: dict[str, str | tuple[str, float]]


def _carried_out(given: _Given, drawn: BondGraph, keep: tuple[str, ...]) -> Procedure:
    from bondgraph.causal.strokes import causality

    moving = drop_zero_velocity(drawn, given.zero, keep)
    hung = drop_dangling(moving.graph, keep)
    small = simplify(hung.graph, keep)
    found = causality(small.graph)
    junctions = [
        f"1:{name}" + f" ({domain})" * bool(domain) + " = 0" * (name in given.zero)
        for name, domain in given.velocities.items()
    ]
    places = [
        f"{drawn.label(element.name)} on "
        + (f"0:{first}-{second[0]}.{element.name} between 1:{first} and 1:{second[0]}" if second else f"1:{first}")
        for element, first, *second in _ordered(given)
    ]
    joints = [f"{drawn.label(e.name)} between 1:{source} and 1:{target}" for e, source, target in given.transducers]
    causal = [f"bond {number}: effort goes to {name}" for number, name in sorted(found.strokes.items())]
    named = (("integral", found.integral), ("derivative", found.derivative))
    causal += [f"{kind}: {', '.join(names)}" for kind, names in named if names]
    dropped = tuple(map(str, (*moving.log, *hung.log)))
    steps = (
        Step(1, "a 1-junction for every velocity", tuple(junctions), None),
        Step(2, "forces, resistors, springs and inertias", tuple(places), None),
        Step(3, "transformers and gyrators", tuple(joints), None),
        Step(4, "power directions", tuple(str(drawn).splitlines()[1:]), drawn),
        Step(5, "without zero velocities and dangling junctions", dropped, hung.graph),
        Step(6, "simplified", tuple(map(str, small.log)), small.graph),
        Step(7, "causality", (*causal, *found.conflicts), small.graph),
    )
    return Procedure(steps, small.graph, found)


def _faults(given: _Given) -> Iterator[str]:
    known, used = given.velocities, set[str]()
    named = [*known, *(place[0].name for place in (*given.elements, *given.transducers))]
    yield from (f"two of the velocities and elements are named {n!r}" for n in sorted(set(named)) if named.count(n) > 1)
    for kinds, places, counts in ((ONE_PORTS, given.elements, (1, 2)), (TWO_PORTS, given.transducers, (2,))):
        for element, *where in places:
            title = f"{element.symbol}:{element.name}"
            used.update(where)
            if element.kind not in kinds:
                yield f"{title}: found a {element.kind}, expected one of {', '.join(sorted(kinds))}"
            if len(where) not in counts or len(set(where)) < len(where):
                expected = f"{' or '.join(map(str, counts))} different ones"
                yield f"{title}: found velocities {', '.join(where) or 'none'}, expected {expected}"
            yield from (f"{title}: no velocity {name!r}" for name in where if name not in known)
    yield from (f"zero velocity {name!r}: no such velocity" for name in given.zero if name not in known)
    yield from (f"displacement {q!r}: no velocity {of!r}" for q, of, _ in _integrals(given) if of not in known)
    yield from (f"velocity {name!r}: nothing is on it, leave it out" for name in known if name not in used)


def _integrals(given: _Given) -> Iterator[tuple[str, str, float]]:
    for name, of in given.displacements.items():
        yield (name, of, 0.0) if isinstance(of, str) else (name, *of)


def _ordered(given: _Given) -> list[Place]:
    """Forces first, then resistors and springs, then inertias: the order of the second step."""
    rank = {"Se": 0, "Sf": 0, "R": 1, "C": 1, "I": 2}
    return sorted(given.elements, key=lambda place: rank[place[0].kind])


def _drawn(given: _Given) -> Builder:
    """The whole graph with its power directions: from sources to the rest, from the first velocity to the second."""
    b = Builder()
    for name, domain in given.velocities.items():
        b.one(name, domain)
    for name, of, initial in _integrals(given):
        b.displacement(name, of, initial)
    for element, first, *second in _ordered(given):
        if second:
            node = f"{first}-{second[0]}.{element.name}"
            # a source between two velocities pushes the first one on and the second one back
            ends = (second[0], first) if element.kind in SOURCES else (first, second[0])
            b.zero(node).bond(ends[0], node).bond(node, ends[1]).port(node, element)
        else:
            b.port(first, element)
    for element, source, target in given.transducers:
        b.add(element)
        b.bond(source, element.name).bond(element.name, target)
    return b
