import pytest

from bondgraph import Builder, I, R, Se
from bondgraph.causal.strokes import causality
from tests.bondgraph.causal.causal_graphs import GRAPHS, divider, violations


def strokes(graph):
    return causality(graph).strokes


def test_stores_on_one_junction_follow_the_first():
    assert causality(GRAPHS["two I on a 1"]).follows == {"b": "I:b follows I:a"}
    assert causality(GRAPHS["two C on a 0"]).follows == {"b": "C:b follows C:a"}
    assert causality(GRAPHS["Sf drives I"]).follows == {"m": "I:m follows Sf:v"}


def test_two_resistors_form_a_named_loop():
    (loop,) = causality(divider()).loops
    assert loop.elements == ("x", "a", "b")
    assert loop.bonds == (2, 3)
    assert loop.text == "algebraic loop through R:a and R:b: e_2 -> e_3 -> f_3 -> f_2 -> e_2"
    assert "an algebraic loop" in causality(divider()).reasons[2].text


@pytest.mark.parametrize("join", ["transform", "gyrate"])
def test_loops_go_through_transformers_and_gyrators(join):
    b = Builder().one("x").one("y").on("x", Se("V", 1.0), R("a", 1.0))
    far = "y"
    if join == "gyrate":
        b.zero("z").bond("y", "z")
        far = "z"
    getattr(b, join)("x", "y", 2.0, name="T").on(far, R("b", 1.0), R("c", 1.0))
    found = causality(b.build())
    (loop,) = found.loops
    assert {"a", "b", "T"} <= set(loop.elements)
    assert violations(found.graph, found.strokes) == []


def test_a_ring_of_transformers_is_a_loop_of_the_junction_structure():
    b = Builder().one("x").one("y").zero("p").zero("q").on("x", I("J", 1.0)).on("y", R("r", 1.0))
    b.bond("x", "p").bond("p", "y").bond("x", "q").transform("q", "y", 2.0, name="T")
    found = causality(b.build())
    assert found.conflicts == ()
    assert violations(found.graph, found.strokes) == []
    assert found.follows == {"J": "I:J follows no store and no source: the junctions alone decide it"}
    assert [loop.elements for loop in found.loops] == [("x", "y", "p", "q", "T")] * 2
    assert found.loops[0].text.startswith("algebraic loop through the junction structure at 1:x, ")
    assert found.loops[0].text.endswith(": e_3 -> e_4 -> e_7 -> e_6 -> e_5 -> e_3")
    assert found.reasons[3].text.startswith("nothing decides it: 0:p taken to receive the effort")
