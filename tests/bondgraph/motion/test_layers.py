"""Which elements settle which flows."""

import numpy as np

from bondgraph import GY, TF, Builder, C, I, R, Se, Sf
from bondgraph.graph import flow_variables
from bondgraph.motion.formulation import INERTIAS, RESISTORS, SPRINGS, Formulation, Layers


def layers(builder):
    """The layers of a graph, and the flow variable of each of its elements."""
    graph = builder.build(loose=True)
    flow = flow_variables(graph)
    return Layers(graph, flow), {name: flow[graph.at(name)[0].number] for name in graph.elements}


def test_a_flow_belongs_to_the_first_layer_that_leaves_it_no_freedom():
    b = Builder().one("a").one("b").one("c").one("d").zero("z").on("a", I("J", 1.0), R("r", 1.0)).on("b", R("s", 1.0))
    b.on("c", C("k", 1.0)).on("d", Se("F", 1.0))
    for name in "abcd":
        b.bond(name, "z")
    found, variable = layers(b)
    assert [found.of[variable[name]] for name in "abcd"] == [INERTIAS, RESISTORS, SPRINGS, SPRINGS]  # d: minus the others


def test_a_flow_that_only_sources_of_effort_meet_is_in_no_layer():
    found, variable = layers(Builder().one("a").on("a", Se("F", 1.0)))
    assert found.of[variable["a"]] > SPRINGS


def test_sources_of_flow_and_what_follows_from_them_count_as_settled():
    found, variable = layers(Builder().one("a").one("b").on("a", Sf("v", 1.0)).on("b", R("r", 1.0)).transform("a", "b", 2.0))
    assert found.of[variable["a"]] == found.of[variable["b"]] == INERTIAS


def test_an_element_of_0_settles_nothing():
    found, variable = layers(Builder().one("a").on("a", I("J", 0.0), R("r", 1.0)))
    assert found.of[variable["a"]] == RESISTORS


def test_flows_that_relations_leave_nothing_but_zero_are_locked():
    b = Builder().one("a").one("b").on("a", I("J", 1.0)).on("b", I("K", 1.0)).transform("a", "b", 2.0)
    assert layers(b)[0].locked() == []
    found, variable = layers(b.transform("a", "b", 3.0, name="other"))
    assert sorted(found.locked()) == sorted({variable["a"], variable["b"]})


def test_varying_ratios_are_in_no_relation_to_each_other():
    b = Builder().one("a", displacement="x").one("b").on("a", I("J", 1.0)).on("b", I("K", 1.0))
    b.transform("a", "b", lambda x: np.sin(x)).transform("a", "b", lambda x: np.sin(x), name="other")
    assert layers(b)[0].locked() != []


def test_a_spring_behind_a_gyrator_leaves_its_flow_unsettled_and_a_resistor_settles_it():
    for hung, loose in ((C("k", 1.0), ["shaft"]), (R("r", 1.0), [])):
        b = Builder().one("coil").one("shaft").on("coil", I("L", 1.0)).on("shaft", hung).gyrate("coil", "shaft", 2.0)
        found, variable = layers(b)
        coordinates = [variable["coil"], variable["shaft"]]
        assert found.unsettled(coordinates, [variable["shaft"]]) == [variable[name] for name in loose]


def test_coordinates_that_do_not_settle_the_rest_are_refused():
    found, variable = layers(
        Builder().one("a").one("b").on("a", I("J", 1.0)).on("b", I("K", 1.0)).between("a", "b", R("r", 1))
    )
    assert found.unsettled([variable["a"]], []) is None


def test_small_ratios_count_as_much_as_others():
    b = Builder().one("piston").one("oil").on("piston", I("m", 1.0), Se("F", 1.0)).transform("piston", "oil", 1e-7)
    b.on("oil", C("volume", 1e-12), R("leak", 1e9))
    form = Formulation(b.build())
    assert len(form.coordinates.all) == 1
    assert form.coordinates.massless == ()


def test_two_gyrators_of_equal_ratio_side_by_side_are_no_accident():
    b = Builder().one("a").one("b").on("a", R("r", 1.0), Se("E", 1.0)).on("b", I("J", 1.0))
    b.add(GY("g", 1.0))
    b.add(TF("t", 0.5))
    b.zero("z").bond("a", "g").bond("g", "z").bond("b", "t").bond("t", "z").on("z", R("s", 1.0))
    assert len(Formulation(b.build()).coordinates.moving) == 1
