import numpy as np

from bondgraph import Builder, C, I, Modulus, Motion, One, R, Se


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
