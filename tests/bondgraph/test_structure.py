"""The junction structure as relations, and their order."""

import pytest

from bondgraph import Builder, GraphError, I, Se
from bondgraph.graph import (
    Relation,
    Scale,
    Solve,
    Sum,
    closed,
    flow_relations,
    flow_variables,
    places,
    plan,
)


def geared():
    b = Builder().one("a").one("b").zero("node").on("a", I("J", 1.0), Se("M", 2.0)).on("b", I("K", 3.0))
    return (
        b.transform("a", "node", 2.0, name="T").bond("b", "node").bond("node", "b2").one("b2").on("b2", I("L", 1.0)).build()
    )


def test_parallel_bonds_between_the_same_junctions_add_up_or_cancel():
    b = Builder().one("a").zero("z").one("c").bond("a", "z").bond("z", "a").bond("z", "c")
    graph = b.on("a", I("J", 1.0)).on("c", I("K", 1.0)).build()
    (relation,) = flow_relations(graph, flow_variables(graph))
    assert len(relation.terms) == 1
    b = Builder().one("a").zero("z").one("c").bond("a", "z").bond("a", "z").bond("z", "c")
    graph = b.on("a", I("J", 1.0)).on("c", I("K", 1.0)).build()
    (relation,) = flow_relations(graph, flow_variables(graph))
    assert sorted(sign for _, _, sign in relation.terms) == [-1.0, 2.0]


def test_a_plan_goes_as_far_as_it_can_without_dividing_by_a_modulus():
    graph = geared()
    law = graph.with_law("T", lambda t: 1 + t).elements["T"].law
    waiting = [Relation("T", ((1, 1.0, 1.0), (0, law, -1.0)))]
    known = {1}
    assert plan(waiting, known) == []
    assert len(waiting) == 1
    known = {0}
    assert plan(waiting, known) == [Scale(0, 1, law)]
    assert waiting == []
    assert known == {0, 1}


def test_sums_and_constant_ratios_are_turned_round():
    waiting = [Relation("z", ((0, 1.0, 1.0), (1, 1.0, 1.0), (2, 1.0, -1.0))), Relation("T", ((2, 1.0, 1.0), (3, 4.0, -1.0)))]
    assert plan(waiting, {0, 3}) == [Scale(3, 2, 4.0), Sum(1, ((0, -1.0), (2, 1.0)))]
    assert plan([Relation("T", ((2, 1.0, 1.0), (3, 4.0, -1.0)))], {2}) == [Scale(2, 3, 0.25)]


def test_what_is_left_over_must_be_square():
    graph = geared()
    flow = flow_variables(graph)
    relations = flow_relations(graph, flow)
    assert closed(graph, flow, relations, [0, 1]) == Solve((0, 1), tuple(relations))
    with pytest.raises(
        GraphError, match=r"more than one degree of freedom: nothing ties bond 1 \(a - J\), .* to the coordinate"
    ):
        closed(graph, flow, relations, [0, 1, 2])
    with pytest.raises(GraphError, match=r"too many relations at 0:node \(bonds 5, 6, 7\), TF:T \(bonds 4, 5\)"):
        closed(graph, flow, relations, [0])
    assert places(graph, relations) == ["0:node (bonds 5, 6, 7)", "TF:T (bonds 4, 5)"]
