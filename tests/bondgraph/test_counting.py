import numpy as np
import pytest

from bondgraph import Se
from bondgraph.builder import Builder
from bondgraph.elements import I
from bondgraph.reduction import Reduction, count, counted
from flywheel.numerics.intervals import Interval


def test_positions_are_counted_whatever_they_come_as():
    with counted() as tally:
        count(3)
        count(np.zeros((4, 5)))
        count(0.5)
        count(np.float64(0.5))
        count(Interval(np.zeros(6), np.ones(6)))
        count(Interval(0.0, 1.0))
    assert tally.evaluations == 3 + 20 + 1 + 1 + 6 + 1


def test_nobody_pays_who_does_not_count():
    count(3)
    with counted() as tally:
        pass
    count(3)
    assert tally.evaluations == 0


def test_an_inner_tally_counts_for_the_outer_one_too():
    with counted() as outer:
        count(1)
        with counted() as inner:
            count(10)
        count(100)
    assert (inner.evaluations, outer.evaluations) == (10, 111)


def test_a_tally_that_was_left_by_an_error_counts_no_further():
    tallies = []

    def left():
        with counted() as tally:
            tallies.append(tally)
            count(2)
            raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        left()
    count(5)
    assert tallies[0].evaluations == 2


def test_every_walk_of_a_graph_counts_its_positions():
    graph = Builder().one("crank", displacement="phi").on("crank", I("J", 2.0), Se("M", 5.0)).build()
    reduction = Reduction(graph, "crank")
    with counted() as tally:
        reduction(np.zeros(7))
        reduction.at(np.zeros((2, 3))).reduced  # noqa: B018
        reduction.flows(0.0)
        reduction.moments(np.zeros(4))
    assert tally.evaluations == 7 + 6 + 1 + 4
