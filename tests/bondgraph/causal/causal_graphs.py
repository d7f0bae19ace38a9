"""The graphs that causality is tested on, drawn ones and random ones, and the rules that every assignment obeys."""

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from bondgraph import GY, TF, Builder, C, GraphError, I, One, R, Se, Sf, Zero


def ratio(theta):
    return np.sin(theta)


def slider_crank(crank=True, slider_first=False):
    b = Builder().one("crank", "rotation", displacement="theta").one("slider", "translation")
    on_crank, on_slider = [Se("M", 3.0), *([I("J", 2.0)] if crank else [])], [I("m", 4.0), R("B", 0.5), Se("F", -1.0)]
    sides = [("crank", on_crank), ("slider", on_slider)]
    for junction, elements in reversed(sides) if slider_first else sides:
        b.on(junction, *elements)
    return b.transform("crank", "slider", ratio, name="T").build()


def generic():
    b = Builder().one("A", displacement="theta").one("B")
    b.on("A", Se("Se1", 1.0), I("I1", 1.0), R("B1", 1.0), C("C1", 1.0)).transform("A", "B", ratio, name="T")
    return b.on("B", I("I2", 1.0), R("B2", 1.0), C("C2", 1.0), Se("Se2", 1.0)).build()


def motor():
    b = Builder().one("coil", "electric").one("rotor", "rotation").on("coil", Se("V", 12.0), I("L", 0.1), R("Ra", 2.0))
    return b.gyrate("coil", "rotor", 0.5, name="G").on("rotor", I("J", 0.3), R("b", 0.01)).build()


def shaft():
    b = Builder().one("a").one("b").on("a", Se("M", 1.0), I("Ja", 1.0)).on("b", I("Jb", 1.0))
    return b.between("a", "b", C("k", 0.01), R("d", 2.0)).build()


def divider(second=1.0):
    return Builder().one("x").on("x", Se("V", 1.0), R("a", 1.0), R("b", second)).build()


def rivals():
    b = Builder().zero("x").zero("y").on("x", Se("a", 1.0), R("r", 1.0)).transform("x", "y", 2.0, name="T")
    return b.on("y", Se("b", 1.0), I("k", 1.0)).build()


def hub(*elements, kind="1"):
    b = Builder()
    b.add(One("x") if kind == "1" else Zero("x"))
    return b.on("x", *elements).build()


def violations(graph, strokes):
    """The rules of causality that strokes break, by element."""
    found = []
    for name, element in graph.elements.items():
        at = [strokes[b.number] == name for b in graph.at(name)]
        right = {
            "1": at.count(False) == 1,
            "0": at.count(True) == 1,
            "TF": at.count(True) == 1,
            "GY": len(set(at)) == 1,
            "Se": at == [False],
            "Sf": at == [True],
        }
        if not right.get(element.kind, True):
            found.append(name)
    return found


GRAPHS = {
    "slider-crank": slider_crank(),
    "slider-crank without J": slider_crank(crank=False),
    "generic": generic(),
    "motor": motor(),
    "shaft": shaft(),
    "divider": divider(),
    "Sf drives I": hub(Sf("v", 1.0), I("m", 1.0)),
    "two I on a 1": hub(I("a", 1.0), I("b", 1.0), R("r", 1.0)),
    "two C on a 0": hub(C("a", 1.0), C("b", 1.0), R("r", 1.0), kind="0"),
}
_MAKE = {"I": I, "C": C, "R": R, "Se": Se, "Sf": Sf}


@st.composite
def graphs(draw, ports=("I", "C", "R"), most=6, ring=False, needs_r=True):
    """Random trees of junctions, joined directly or by two-ports; with `ring` one more bond that closes a loop."""
    b, kinds = Builder(), []
    for k in range(draw(st.integers(1, most))):
        kinds.append(draw(st.sampled_from("01")))
        b.add(One(f"j{k}") if kinds[k] == "1" else Zero(f"j{k}"))
        if k:
            _join(draw, b, draw(st.integers(0, k - 1)), k)
    if ring and len(kinds) > 2:
        _join(draw, b, 0, len(kinds) - 1)
    for k in range(len(kinds)):
        hung = (["R"] if needs_r else []) + draw(st.lists(st.sampled_from(ports), max_size=2))
        for n, kind in enumerate(hung):
            b.port(f"j{k}", _MAKE[kind](f"{kind}{k}{n}", 1.0))
    try:
        return b.build(loose=True)
    except GraphError:
        assume(False)


def _join(draw, b, first, second):
    way = draw(st.sampled_from(["bond", "TF", "GY"]))
    tail, head = draw(st.permutations([f"j{first}", f"j{second}"]))
    if way == "bond":
        b.bond(tail, head)
        return
    name = b.add({"TF": TF, "GY": GY}[way](f"{way}{first}-{second}-{len(b)}", 2.0))
    b.bond(tail, name).bond(name, head)
