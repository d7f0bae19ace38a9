"""Strokes by sequential assignment, what follows what, and algebraic loops."""

import itertools

import pytest
from hypothesis import HealthCheck, assume, given, settings

from bondgraph import Builder, C, GraphError, I, R, Se, Sf
from bondgraph.causal.strokes import causality
from tests.bondgraph.causal.causal_graphs import (
    GRAPHS,
    divider,
    graphs,
    hub,
    rivals,
    shaft,
    slider_crank,
    violations,
)


@pytest.mark.parametrize("prefer", ["integral", "derivative"])
@pytest.mark.parametrize("graph", GRAPHS.values(), ids=GRAPHS)
def test_every_bond_gets_a_stroke_and_every_rule_holds(graph, prefer):
    found = causality(graph, prefer)
    assert set(found.strokes) == set(found.reasons) == {b.number for b in graph.bonds}
    assert found.conflicts == ()
    assert violations(graph, found.strokes) == []
    assert sorted(found.integral + found.derivative) == sorted(e.name for e in graph.of_kind("I", "C"))


@pytest.mark.parametrize("slider_first", [False, True])
def test_slider_crank_has_the_crank_integral_and_the_slider_follows_whatever_is_declared_first(slider_first):
    found = causality(slider_crank(slider_first=slider_first))
    assert (found.integral, found.derivative) == (("J",), ("m",))
    assert found.follows == {"m": "I:m follows I:J through MTF:T"}
    assert found.loops == ()


def test_reasons_say_what_came_first():
    graph = slider_crank()
    found = causality(graph)
    kinds = [found.reasons[b.number].kind for b in graph.bonds]
    assert kinds == ["source", "preferred", "derivative", "propagated", "source", "propagated", "propagated"]
    assert found.reasons[1].text == "Se:M imposes its effort"
    assert found.reasons[2].text == "I:J integral, gives its flow"
    assert found.reasons[3].text == "I:m has to follow: bond 7 sets the flow of 1:slider"
    assert found.reasons[7].text == "MTF:T passes on bond 6"


def test_a_backward_pass_through_a_modulated_transformer_is_named_where_it_cannot_be_avoided():
    found = causality(slider_crank(crank=False))
    assert found.integral == ("m",)
    assert "f_5 = f_6 / T divides by MTF:T, singular where it is 0" in found.reasons[5].text
    assert not any("divides" in r.text for r in causality(slider_crank()).reasons.values())


def test_a_fixed_transformer_is_passed_either_way():
    b = Builder().one("a").one("b").on("b", I("Jb", 1.0)).on("a", I("Ja", 1.0)).transform("a", "b", 2.0, name="T")
    found = causality(b.build())
    assert found.integral == ("Jb",)
    assert found.follows["Ja"] == "I:Ja follows I:Jb through TF:T"
    assert not any("divides" in reason.text for reason in found.reasons.values())


def test_a_resistor_given_as_a_function_of_its_flow_is_taken_as_resistance():
    for graph in (divider(second=lambda f: f**3), hub(Se("V", 1.0), R("b", lambda f: f**3), R("a", 1.0))):
        found = causality(graph)
        assert found.strokes[graph.bond_of("b").number] == "x"
        assert found.strokes[graph.bond_of("a").number] == "a"
    forced = causality(hub(Se("V", 1.0), R("b", lambda f: f**3)))
    assert "the law e(f) of R:b has to be solved for f" in forced.reasons[2].text


def test_preferences_can_be_turned_round_for_all_or_some():
    assert causality(shaft(), "derivative").derivative == ("Ja", "k")  # the 0-junction leaves one flow to I:Jb
    assert causality(slider_crank(), {"J": "derivative"}).integral == ("m",)
    assert causality(hub(I("a", 1.0), I("b", 1.0)), {"a": "derivative"}).integral == ("b",)


def test_a_store_of_nothing_does_not_become_a_state():
    assert causality(hub(I("a", 0.0), I("b", 1.0))).integral == ("b",)


@pytest.mark.parametrize(
    ("prefer", "message"),
    [
        ("both", "prefer: found 'both', expected 'integral', 'derivative'"),
        ({"M": "integral"}, "prefer: 'M' is no I or C of the graph"),
        ({"J": "none"}, "prefer: found 'none' for I:J"),
    ],
)
def test_other_preferences_are_refused(prefer, message):
    with pytest.raises(GraphError, match=message):
        causality(slider_crank(), prefer)


def test_rival_sources_are_a_conflict_that_names_both_and_the_rest_is_assigned():
    found = causality(rivals())
    assert len(found.strokes) == 6
    assert violations(found.graph, found.strokes) == ["T"]
    assert len(found.conflicts) == 1
    assert "TF:T: bond 3 (from Se:a on bond 1) gives it effort and bond 4 (from Se:b on bond 5)" in found.conflicts[0]


def test_a_junction_whose_flow_nobody_sets_is_a_conflict():
    found = causality(hub(Se("a", 1.0), Se("b", 1.0)))
    assert found.conflicts == ("1:x: none of bond 1 (from Se:a), bond 2 (from Se:b) sets its flow; hang an I or R on it",)


def test_two_flow_sources_through_a_gyrator_conflict():
    b = Builder().one("x").zero("y").on("x", Sf("a", 1.0)).on("y", Se("b", 1.0)).gyrate("x", "y", 2.0, name="G")
    (line,) = causality(b.build()).conflicts
    assert line.startswith(
        "GY:G: bond 3 (from Sf:a on bond 1) gives it flow and bond 4 (from Se:b on bond 2) gives it effort"
    )


def test_describe_lists_every_bond_and_all_that_was_found():
    text = causality(slider_crank()).describe()
    assert len(text.splitlines()) == 1 + 7 + 5
    assert "preferred: I:J integral" in text
    assert "  I:m follows I:J through MTF:T" in text
    assert "conflicts: none" in text
    assert "algebraic loop through R:a and R:b" in causality(divider()).describe()
    assert "expected one effort and one flow" in causality(rivals()).describe()


@settings(max_examples=12, deadline=None, derandomize=True)
@given(graphs())
@pytest.mark.slow
def test_trees_without_sources_and_with_a_resistor_everywhere_never_conflict(graph):
    found = causality(graph)
    assert found.conflicts == ()
    assert violations(graph, found.strokes) == []


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(graphs(ports=("I", "C", "R", "Se", "Sf"), most=4, ring=True, needs_r=False))
def test_a_conflict_is_reported_exactly_where_no_assignment_exists(graph):
    assume(len(graph.bonds) <= 11)
    found = causality(graph)
    numbers = [b.number for b in graph.bonds]
    every = itertools.product(*(b[1:] for b in graph.bonds))
    possible = any(not violations(graph, dict(zip(numbers, ends, strict=True))) for ends in every)
    assert possible == (found.conflicts == ())
    assert (violations(graph, found.strokes) == []) == possible


def test_sixty_bonds_and_more_are_assigned():
    b = Builder().one("v0").on("v0", Se("M", 1.0), I("J0", 1.0))
    for k in range(1, 40):
        b.one(f"v{k}").on(f"v{k}", I(f"J{k}", 1.0)).between(f"v{k - 1}", f"v{k}", C(f"k{k}", 1.0), R(f"d{k}", 1.0))
    found = causality(b.build())
    assert len(found.integral) == 79
    assert violations(found.graph, found.strokes) == []


def test_what_is_asked_for_by_name_is_asked_first():
    b = Builder().one("crank", displacement="theta").one("slider").on("crank", I("J", 1.0), Se("M", 1.0))
    graph = b.on("slider", I("m", 2.0)).transform("crank", "slider", lambda theta: theta, name="T").build()
    assert causality(graph).integral == ("J",)
    asked = causality(graph, prefer={"m": "integral"})
    assert (asked.integral, asked.derivative, asked.conflicts) == (("m",), ("J",), ())
    assert any("divides by MTF:T" in reason.text for reason in asked.reasons.values())


def test_the_order_of_writing_does_not_turn_transformers_round():
    b = Builder().one("slider").on("slider", I("m", 2.0)).one("crank", displacement="theta")
    graph = b.on("crank", I("J", 1.0), Se("M", 1.0)).transform("crank", "slider", lambda theta: theta, name="T").build()
    assert causality(graph).integral == ("J",)
    loop = Builder().one("crank", displacement="theta").one("rod")
    loop.transform("crank", "rod", lambda theta: 0.3 * theta, name="T1")
    loop.sum("x", [("crank", lambda theta: theta), ("rod", lambda theta: 1 + theta)], "translation")
    loop.on("rod", I("J_rod", 1.0)).on("x", I("m", 1.0)).on("crank", I("J", 1.0), Se("M", 1.0))
    found = causality(loop.build())
    assert (found.integral, found.loops) == (("J",), ())


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
