"""What hangs together: which elements bonds lead to from one another, and which things are one because ties join them."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from bondgraph.graph import Bond

T = TypeVar("T", bound=Hashable)


def neighbours(names: Iterable[str], bonds: Iterable[Bond]) -> dict[str, list[str]]:
    """The names that each element has bonds with."""
    found: dict[str, list[str]] = {name: [] for name in names}
    for bond in bonds:
        found[bond.tail].append(bond.head)
        found[bond.head].append(bond.tail)
    return found


def reached_from(start: T, near: Mapping[T, Iterable[T]]) -> set[T]:
    """Everything that a walk from `start` comes to, given what is near each thing.

    >>> sorted(reached_from("a", {"a": ["b"], "b": ["a", "c"], "c": ["b"], "d": []}))
    ['a', 'b', 'c']
    """
    seen, todo = {start}, [start]
    while todo:
        fresh = [other for other in near[todo.pop()] if other not in seen]
        seen.update(fresh)
        todo.extend(fresh)
    return seen


def representatives(things: Iterable[T], ties: Iterable[Sequence[T]]) -> dict[T, T]:
    """For each thing the one that stands for all it is tied to: what stood for the first of a tie stands for the rest too.

    >>> representatives([1, 2, 3, 4], [(2, 3), (3, 1)])
    {1: 2, 2: 2, 3: 2, 4: 4}
    """
    found = {thing: thing for thing in things}
    for tie in ties:
        together = {found[thing] for thing in tie}
        found = {thing: found[tie[0]] if one in together else one for thing, one in found.items()}
    return found
