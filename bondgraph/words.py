"""Word bond graphs: the parts of a system as words with named ports, joined by bonds, and their bond graph."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bondgraph.elements import Domain, refuse
from bondgraph.graph import Bond, BondGraph, Builder, Part


@dataclass(frozen=True, eq=False)
class WordGraph:
    """A system in words: each has named ports, and a bond graph with these ports open, or none yet.

    Args:
        words: by name, the part that a word stands for (`Builder.part`), or only the names of its ports.
        bonds: pairs "WORD.PORT" from tail to head: power counts as positive where it flows from the first to the second. A
            port takes one bond, and may stay open.

    Raises:
        GraphError: for a bond to a word or port that there is none of, from a word to itself, or to a port that has one, and
            for a word without a bond.

    Source: D. C. Karnopp, D. L. Margolis, R. C. Rosenberg, System Dynamics, Wiley 2012, chapter 1.

    >>> from bondgraph import I, R, Se
    >>> motor = Builder().one("shaft", "rotation").on("shaft", Se("M", 3.0), I("J", 2.0)).part("shaft")
    >>> fan = Builder().one("hub", "rotation").on("hub", R("air", 0.5)).part(drive="hub")
    >>> system = WordGraph({"motor": motor, "fan": fan}, [("motor.shaft", "fan.drive")])
    >>> print(system)
    word bond graph: 2 words, 1 bond
       1  motor.shaft -> fan.drive
    >>> print(system.expand())
    bond graph: 5 elements, 4 bonds (f_out = T f_in, e_in = T e_out)
       1  Se:motor.M = 3 -> 1:motor.shaft
       2  1:motor.shaft -> I:motor.J = 2
       3  1:fan.drive -> R:fan.air = 0.5
       4  1:motor.shaft -> 1:fan.drive

    """

    words: Mapping[str, Part | Sequence[str]]
    bonds: Sequence[tuple[str, str]]

    def __post_init__(self) -> None:
        faults: list[str] = []
        taken: dict[str, int] = {}
        for number, ends in enumerate(self.bonds, 1):
            for end in ends:
                word, _, port = end.rpartition(".")
                if word not in self.words:
                    faults.append(f"bond {number}: no word {word!r} in {end!r}; the words are {', '.join(self.words)}")
                elif port not in self.ports(word):
                    names = ", ".join(self.ports(word)) or "none"
                    faults.append(f"bond {number}: word {word!r} has no port {port!r}; its ports are {names}")
                elif end in taken:
                    faults.append(
                        f"bond {number}: port {end!r} has bond {taken[end]} already; open another port of {word!r}"
                    )
                taken.setdefault(end, number)
            if len({end.rpartition(".")[0] for end in ends}) < 2:
                faults.append(f"bond {number}: joins {ends[0]!r} to its own word")
        joined = {end.rpartition(".")[0] for ends in self.bonds for end in ends}
        faults += [
            f"word {word!r} has no bond: join one of its ports, or leave it out" for word in self.words if word not in joined
        ]
        refuse(faults)

    def ports(self, word: str) -> tuple[str, ...]:
        """Returns the names of a word's ports."""
        part = self.words[word]
        return tuple(part.ports if isinstance(part, Part) else part)

    def joined(self) -> tuple[tuple[Bond, tuple[str, str], tuple[str, str]], ...]:
        """Returns every bond between words, with the port (its word and name) at its tail and that at its head."""
        ends = [[end.rpartition(".") for end in bond] for bond in self.bonds]
        return tuple(
            (Bond(k, tail, head), (tail, out), (head, into)) for k, ((tail, _, out), (head, _, into)) in enumerate(ends, 1)
        )

    def domain(self, word: str, port: str) -> Domain | None:
        """Returns the energy domain of a word's port; None if the word has no bond graph or no domain."""
        part = self.words[word]
        if not isinstance(part, Part):
            return None
        graph = BondGraph(part.elements, part.bonds, part.displacements, part.signals, part.parameters, parts=True)
        return graph.domain(graph.at(part.ports[port])[0])

    def expand(self) -> BondGraph:
        """Returns the bond graph that the words stand for: names of a part get `WORD.` in front.

        Raises:
            GraphError: if a word has no bond graph, or if the result is not valid.

        """
        empty = [word for word, part in self.words.items() if not isinstance(part, Part)]
        refuse(f"word {word!r} stands for no bond graph: give it a part in place of ports" for word in empty)
        builder = Builder()
        for word, part in self.words.items():
            assert isinstance(part, Part)
            builder.include(word, part)
        for tail, head in self.bonds:
            builder.bond(tail, head)
        return builder.build()

    def __str__(self) -> str:
        count = f"{len(self.words)} words, {len(self.bonds)} bond{'s' * (len(self.bonds) != 1)}"
        return "\n".join([f"word bond graph: {count}", *(f"{k:4d}  {a} -> {b}" for k, (a, b) in enumerate(self.bonds, 1))])
