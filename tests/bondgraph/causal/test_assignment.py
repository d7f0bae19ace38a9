import itertools

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from bondgraph import GY, TF, Builder, C, GraphError, I, One, R, Se, Sf, Zero
from bondgraph.causal.assignment import causality


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


def test_the_generic_graph_has_three_states_and_one_dependent_inertia():
    found = causality(generic())
    assert (found.integral, found.derivative) == (("I1", "C1", "C2"), ("I2",))


def test_the_motor_has_two_states():
    found = causality(motor())
    assert (found.integral, found.derivative, found.loops) == (("L", "J"), (), ())


def test_a_compliant_shaft_parts_its_inertias():
    found = causality(shaft())
    assert (found.integral, found.derivative) == (("Ja", "Jb", "k"), ())


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


@settings(max_examples=60, deadline=None, derandomize=True)
@given(graphs())
def test_trees_without_sources_and_with_a_resistor_everywhere_never_conflict(graph):
    found = causality(graph)
    assert found.conflicts == ()
    assert violations(graph, found.strokes) == []


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
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
