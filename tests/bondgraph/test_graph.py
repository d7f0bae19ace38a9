import pytest

from bondgraph import TF, Builder, GraphError, I, One, Se, Zero


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


def test_the_printed_graph_states_the_transformer_convention():
    assert "f_out = T f_in, e_in = T e_out" in str(two_shafts().build())


def test_with_law_changes_one_element_and_leaves_the_graph_alone():
    graph = two_shafts().build()
    other = graph.with_law("crank->wheel", 4.0)
    assert graph.elements["crank->wheel"].law == 3.0
    assert other.elements["crank->wheel"].law == 4.0


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda b: b.add(I("loose", 1.0)), "has 0 bonds, a one-port has 1"),
        (lambda b: (b.add(Zero("z")), b.bond("z", "z")), "joins 'z' to itself"),
        (lambda b: (b.add(TF("t", 1.0)), b.bond("crank", "t")), "has 1 bonds in and 0 out"),
        (lambda b: b.bond("crank", "nowhere"), "no element 'nowhere'"),
        (lambda b: (b.add(One("a")), b.port("a", I("b", 1.0))), "not connected to the rest: a, b"),
        (lambda b: b.add(One("alone")), "has no bond"),
    ],
)
def test_structural_faults_are_named(spoil, message):
    b = two_shafts()
    spoil(b)
    with pytest.raises(GraphError, match=message):
        b.build()


def test_all_structural_faults_come_at_once():
    b = two_shafts()
    b.add(I("one", 1.0))
    b.add(I("two", 1.0))
    with pytest.raises(GraphError) as caught:
        b.build()
    assert "one" in str(caught.value)
    assert "two" in str(caught.value)


def test_two_elements_cannot_share_a_name():
    with pytest.raises(GraphError, match="two elements are named 'crank'"):
        two_shafts().add(One("crank"))


def test_an_empty_graph_is_refused():
    with pytest.raises(GraphError, match="empty"):
        Builder().build()
