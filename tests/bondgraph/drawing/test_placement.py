import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.drawing.layout import STEP, enters, place, rearranged
from tests.bondgraph.drawing.drawn_graphs import GRAPHS

places = st.floats(-10.0, 10.0)
points = st.tuples(places, places).map(np.array)
HALF = (12.0, 8.0)


def room(graph):
    return dict.fromkeys(graph.elements, HALF)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(points, points, points, st.tuples(st.floats(0.5, 5.0), st.floats(0.5, 5.0)).map(np.array))
def test_a_segment_enters_a_box_where_one_of_its_points_lies_inside(start, end, centre, half):
    along = start + np.linspace(0.0, 1.0, 501)[:, None] * (end - start)
    deepest = (half - np.abs(along - centre)).min(axis=1).max()
    if abs(deepest) > 0.05:  # the points are not dense enough to tell a graze
        assert bool(enters(start, end, centre, half)) == (deepest > 0.0)


def test_segments_and_boxes_broadcast():
    starts, ends = np.array([[0.0, 0.0], [0.0, 5.0]]), np.array([[9.0, 0.0], [9.0, 5.0]])
    boxes = np.array([[4.0, 0.0], [4.0, 5.0], [4.0, 20.0]])
    hit = enters(starts[:, None], ends[:, None], boxes, np.ones(2))
    assert hit.tolist() == [[True, False, False], [False, True, False]]


@pytest.mark.parametrize("name", ["condensed", "generic", "motor"])
def test_no_two_elements_take_the_same_room(name):
    graph = GRAPHS[name]()
    at = place(graph, room(graph))
    assert at.keys() == graph.elements.keys()
    centres = np.array(list(at.values()))
    apart = np.abs(centres[:, None] - centres[None]) >= 2.0 * np.array(HALF)
    assert (apart.any(axis=-1) | np.eye(len(centres), dtype=bool)).all()


def test_inertias_hang_above_their_junction_and_resistors_below():
    graph = GRAPHS["condensed"]()
    at = place(graph, room(graph))
    assert at["J"][1] > at["crank"][1]
    assert at["B"][1] < at["slider"][1]


def test_another_arrangement_is_another_one_each_time_and_on_the_grid():
    graph = GRAPHS["condensed"]()
    at = place(graph, room(graph))
    others = [rearranged(graph, room(graph), at, attempt) for attempt in (0, 1)]
    assert others[0] == rearranged(graph, room(graph), at, 0)
    assert others[0] != at
    for other in others:
        assert np.allclose(np.array(list(other.values())) % STEP, 0.0)
