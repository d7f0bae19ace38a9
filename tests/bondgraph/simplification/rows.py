"""Small graphs written as rows of junctions, and their bonds as text."""

from itertools import pairwise

from bondgraph import Builder, I, One, Se, Zero


def line(*pairs, elements=None):
    """Junctions such as "1:a", joined in a row, with one-ports hung on them."""
    b = Builder()
    names = [b.add((One if pair[0] == "1" else Zero)(pair[2:])) for pair in pairs]
    for tail, head in pairwise(names):
        b.bond(tail, head)
    for name, ports_there in (elements or {}).items():
        b.on(name, *ports_there)
    return b


def listed(graph):
    return [f"{graph.label(b.tail)} -> {graph.label(b.head)}" for b in graph.bonds]


LOAD = {"a": [Se("M", 3.0), I("J", 2.0)]}
