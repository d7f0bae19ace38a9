"""The formal procedure for drawing a bond graph, in seven steps, each shown.

1 a 1-junction for every velocity; 2 forces, resistors and springs on one, or through a 0-junction between two, and
inertias; 3 transformers and gyrators; 4 power directions; 5 without ground and dangling junctions; 6 simplified;
7 causality. Only what has power directions can be checked as a graph, so steps 1 to 3 are lists of what joins what.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bondgraph.builder import Builder
from bondgraph.causal.strokes import Causality
from bondgraph.causal.strokes import causality as strokes_of
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
        causality: its causality.

    """

    steps: tuple[Step, ...]
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
    found = strokes_of(small.graph)
    junctions = [
        f"1:{name}" + f" ({domain})" * bool(domain) + " = 0" * (name in ground) for name, domain in velocities.items()
    ]
    places = [
        f"{drawn.label(element.name)} on "
        + (f"0:{first}-{second[0]}.{element.name} between 1:{first} and 1:{second[0]}" if second else f"1:{first}")
        for element, first, *second in ordered
    ]
    joints = [f"{drawn.label(e.name)} between 1:{source} and 1:{target}" for e, source, target in transducers]
    causal = [f"bond {number}: effort goes to {name}" for number, name in sorted(found.strokes.items())]
    named = (("integral", found.integral), ("derivative", found.derivative))
    causal += [f"{kind}: {', '.join(names)}" for kind, names in named if names]
    steps = (
        Step(1, "a 1-junction for every velocity", tuple(junctions), None),
        Step(2, "forces, resistors, springs and inertias", tuple(places), None),
        Step(3, "transformers and gyrators", tuple(joints), None),
        Step(4, "power directions", tuple(str(drawn).splitlines()[1:]), drawn),
        Step(5, "without zero velocities and dangling junctions", tuple(map(str, (*moving.log, *hung.log))), hung.graph),
        Step(6, "simplified", tuple(map(str, small.log)), small.graph),
        Step(7, "causality", (*causal, *found.conflicts), small.graph),
    )
    return Procedure(steps, small.graph, found)


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
