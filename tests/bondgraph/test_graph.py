"""A graph's elements, bonds and laws, what hangs together, the relations of its junctions and their order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bondgraph import DOMAINS, GY, TF, Bond, Builder, C, GraphError, I, Law, Modulus, Motion, One, R, Se
from bondgraph.graph import (
    Relation,
    Scale,
    Solve,
    Sum,
    closed,
    flow_relations,
    flow_variables,
    neighbours,
    places,
    plan,
    reached_from,
    representatives,
)


def two_shafts(ratio: float = 3.0) -> Builder:
    b = Builder()
    b.add(One("crank"))
    b.sum("wheel", [("crank", ratio)], "rotation")
    b.port("wheel", I("J", 2.0))
    b.port("crank", Se("M", 5.0))
    return b


def test_bonds_are_numbered_in_order_and_half_arrows_follow_power():
    graph = two_shafts().build()
    assert [b.number for b in graph.bonds] == [1, 2, 3, 4]
    assert graph.at("J")[0].head == "J"  # power flows into an inertia
    assert graph.at("M")[0].tail == "M"  # and out of a source


def test_with_law_changes_one_element_and_leaves_the_graph_alone():
    graph = two_shafts().build()
    other = graph.with_law("crank->wheel", 4.0)
    assert graph.elements["crank->wheel"].law == 3.0
    assert other.elements["crank->wheel"].law == 4.0


def test_linear_laws_are_one_constant_and_curves_are_functions_of_their_own_flow_or_displacement():
    b = Builder().parameter(k=2.0).one("a", displacement="x").on("a", I("J", 2.0), R("r", lambda k: 3.0 * k))
    b.on("a", R("curve", lambda f, k: k * f**3), R("rub", lambda x: 1.0 + x**2), C("spring", lambda q: q**3))
    graph = b.on("a", Se("M", lambda t: t), C("c", 2.0)).build()
    assert [name for name in graph.elements if graph.is_linear(name)] == ["J", "r", "c"]
    assert [name for name in graph.elements if graph.is_curve(name)] == ["curve", "spring"]


def test_flows_are_measured_by_displacements_and_by_motions():
    b = Builder().one("a", displacement="x").one("b").one("c").on("a", I("J", 1.0)).on("b", I("K", 1.0)).on("c", I("L", 1.0))
    b.transform("a", "b", Modulus(np.sin, np.cos, Motion("b"))).transform("b", "c", Modulus(np.sin, np.cos, Motion("b")))
    graph = b.build()
    assert graph.motions == ("b",)
    assert graph.measured == {"a", "b"}


def test_an_element_is_called_by_kind_name_value_and_bond():
    graph = two_shafts().build()
    assert (graph.title("M"), graph.label("M"), graph.where("M")) == ("Se:M", "Se:M = 5", "Se:M (bond 4)")


TIES = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), max_size=12)


def test_neighbours_are_at_the_other_ends_of_bonds():
    bonds = [Bond(1, "a", "b"), Bond(2, "c", "b")]
    assert neighbours("abcd", bonds) == {"a": ["b"], "b": ["a", "c"], "c": ["b"], "d": []}


@given(TIES)
def test_things_are_one_exactly_where_ties_lead_from_one_to_the_other(ties):
    near = {k: [b for a, b in ties if a == k] + [a for a, b in ties if b == k] for k in range(10)}
    one = representatives(range(10), ties)
    for k in range(10):
        assert {other for other in range(10) if one[other] == one[k]} == reached_from(k, near)
        assert one[k] in reached_from(k, near)


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


EXPONENTS = {  # of kg, m, s, A, K, mol
    "N": (1, 1, -2, 0, 0, 0), "m": (0, 1, 0, 0, 0, 0), "s": (0, 0, 1, 0, 0, 0), "rad": (0, 0, 0, 0, 0, 0),
    "V": (1, 2, -3, -1, 0, 0), "A": (0, 0, 0, 1, 0, 0), "C": (0, 0, 1, 1, 0, 0), "Wb": (1, 2, -2, -1, 0, 0),
    "Pa": (1, -1, -2, 0, 0, 0), "m^3": (0, 3, 0, 0, 0, 0), "K": (0, 0, 0, 0, 1, 0), "W": (1, 2, -3, 0, 0, 0),
    "J": (1, 2, -2, 0, 0, 0), "mol": (0, 0, 0, 0, 0, 1),
}  # fmt: skip
SI = {unit: np.array(exponents) for unit, exponents in EXPONENTS.items()}


def dimension(unit):
    """The exponents of a unit such as `N m/s`."""
    above, _, below = unit.partition("/")
    return sum(SI[part] for part in above.split()) - sum(SI[part] for part in below.split())


def times(*units):
    return sum(map(dimension, units))


def test_effort_times_flow_is_power_in_every_domain():
    assert {"translation", "rotation", "electric", "magnetic", "hydraulic", "thermal", "chemical"} == set(DOMAINS)
    for domain in DOMAINS.values():
        assert (times(domain.effort.unit, domain.flow.unit) == dimension("W")).all(), domain.name


def test_momentum_and_displacement_are_integrals_over_time():
    for domain in DOMAINS.values():
        assert (dimension(domain.displacement.unit) == times(domain.flow.unit, "s")).all(), domain.name
        if domain.momentum.unit != "-":
            assert (dimension(domain.momentum.unit) == times(domain.effort.unit, "s")).all(), domain.name


def test_modulated_elements_show_an_m():
    law = Law(lambda here, anchor: here.q, Motion("crank"))
    b = Builder()
    b.add(One("crank"))
    b.port("crank", Se("F", law))
    b.port("crank", C("spring", law))
    graph = b.build()
    assert "MSe:F -> 1:crank" in str(graph)
    assert graph.at("spring")[0].head == "spring"


def test_plain_numbers_leave_an_element_unmodulated():
    assert [e.symbol for e in (Se("s", 1.0), I("i", 2.0), TF("t", 3.0), GY("g", 4.0), One("j"))] == [
        "Se",
        "I",
        "TF",
        "GY",
        "1",
    ]
