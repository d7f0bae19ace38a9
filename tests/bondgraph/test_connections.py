from hypothesis import given
from hypothesis import strategies as st

from bondgraph import Bond
from bondgraph.graph import neighbours, reached_from, representatives

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
