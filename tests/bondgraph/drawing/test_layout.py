"""A graph's layout: labels, places, and drawings without flaws."""

from functools import cache
from math import hypot

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph import Bond, BondGraph, Builder, GraphError, I, One, R, Se
from bondgraph.drawing.layout import (
    STEP,
    Box,
    Line,
    Point,
    enters,
    flaws,
    half_arrow,
    labels,
    layout,
    mathtext,
    place,
    plain,
    rearranged,
    short_names,
    stroke,
    width,
)
from tests.bondgraph.drawing.drawn_graphs import GRAPHS, condensed, hub, motor
from tests.limits import sample


@cache
def drawn_of(name):
    return layout(GRAPHS[name]())


def crossing(one: Line, two: Line) -> bool:
    def side(line, point):
        (x, y), (u, v) = line
        return (u - x) * (point.y - y) - (v - y) * (point.x - x)

    return side(one, two.start) * side(one, two.end) < 0 > side(two, one.start) * side(two, one.end)


def middle(line: Line) -> Point:
    return line.point(0.5)


def away(point: Point, boxes: tuple[Box, ...]) -> float:
    def gap(box):
        across, up = abs(point.x - box.x) - box.width / 2, abs(point.y - box.y) - box.height / 2
        return hypot(max(across, 0.0), max(up, 0.0))

    return min(gap(box) for box in boxes)


@pytest.mark.parametrize("name", sample(sorted(GRAPHS), 3))
def test_a_layout_is_clear(name):
    """No label on another, no bond or number on a label, no crossing of planar bonds; the stroke where it is asked for."""
    drawn = drawn_of(name)
    assert list(flaws(drawn)) == []
    boxes = [(owner, box) for owner, own in drawn.boxes.items() for box in own]
    for k, (owner, box) in enumerate(boxes):  # the same once more, box by box
        assert not any(box.overlaps(other) for name, other in boxes[:k] if name != owner)
        assert not any(box.overlaps(number) for number in drawn.numbers.values())
        assert not any(line.passes(box) for n, line in drawn.bonds.items() if owner not in drawn.ends[n])
    lines = list(drawn.bonds.values())
    assert not any(crossing(one, two) for k, one in enumerate(lines) for two in lines[:k])
    for number, line in drawn.bonds.items():
        tail, head = (drawn.boxes[end] for end in drawn.ends[number])
        assert line.length > 15.0
        at_head, at_tail = stroke(line, at_end=True), stroke(line, at_end=False)
        for at in (line.start, middle(at_tail)):
            assert away(at, tail) < away(at, head)
        for at in (line.end, middle(at_head)):
            assert away(at, head) < away(at, tail)
        assert not any(bar.passes(box) for bar in (at_head, at_tail) for _, box in boxes)
        barb, (x, y) = half_arrow(line), drawn.numbers[number][:2]  # the number is on the side away from the half arrow
        (ax, ay), (bx, by) = line
        left = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        assert left * ((bx - ax) * (barb.end.y - ay) - (by - ay) * (barb.end.x - ax)) < 0


def test_a_stroke_stands_across_its_bond():
    line, bar = Line(Point(0.0, 0.0), Point(30.0, 40.0)), stroke(Line(Point(0.0, 0.0), Point(30.0, 40.0)), at_end=True)
    along = (line.end.x * (bar.end.x - bar.start.x), line.end.y * (bar.end.y - bar.start.y))
    assert sum(along) == pytest.approx(0.0, abs=1e-9)
    assert middle(bar) == pytest.approx(line.end)


@pytest.mark.parametrize("end", [(50.0, 0.0), (-50.0, 0.0), (0.0, 50.0), (0.0, -50.0), (40.0, 30.0), (-40.0, 30.0)])
def test_half_arrows_lie_on_the_flow_side_whichever_way_the_bond_points(end):
    line = Line(Point(0.0, 0.0), Point(*end))
    barb, plain = half_arrow(line).end, line.point(0.7)
    assert half_arrow(line).start == line.end
    aside = line.point(0.7, 5.0)
    assert (barb.x - line.end.x) * (aside.x - plain.x) + (barb.y - line.end.y) * (aside.y - plain.y) > 0
    assert aside.y < plain.y or aside.x > plain.x  # below or to the right


def test_the_condensed_slider_crank_is_one_straight_line_from_left_to_right():
    boxes = drawn_of("condensed").boxes
    chain = [boxes[name][0] for name in ("M", "crank", "T", "slider", "F")]
    assert len({box.y for box in chain}) == 1
    assert [box.x for box in chain] == sorted(box.x for box in chain)
    assert boxes["J"][0].y > chain[0].y > boxes["B"][0].y


def test_the_same_graph_has_the_same_layout():
    assert layout(condensed()) == drawn_of("condensed")


def test_parallel_bonds_are_drawn_apart():
    elements = {e.name: e for e in (One("a"), One("b"), I("J", 1.0), Se("M", 1.0))}
    bonds = (Bond(1, "a", "b"), Bond(2, "b", "a"), Bond(3, "a", "J"), Bond(4, "M", "b"))
    drawn = layout(BondGraph(elements, bonds))
    assert list(flaws(drawn)) == []
    one, two = middle(drawn.bonds[1]), middle(drawn.bonds[2])
    assert hypot(one.x - two.x, one.y - two.y) > 10.0


@st.composite
def graphs(draw):
    b = Builder()
    size = draw(st.integers(2, 6))
    for k in range(size):
        b.one(f"v{k}").on(f"v{k}", *(I(f"cylinder.mass[{k}].{n}", 1.0) for n in range(draw(st.integers(0, 4)))))
        if k:
            b.transform(f"v{draw(st.integers(0, k - 1))}", f"v{k}", 2.0, name=f"T{k}")
    for _ in range(draw(st.integers(0, 4))):
        tail, head = (f"v{draw(st.integers(0, size - 1))}" for _ in range(2))
        if tail != head:
            b.transform(tail, head, 2.0, name=f"extra{len(b)}")
    return b.build(loose=True)


@settings(max_examples=3, deadline=None, derandomize=True)
@given(graphs())
def test_any_graph_has_a_layout_without_flaws(graph):
    assert list(flaws(layout(graph))) == []


def test_flaws_are_named():
    drawn = drawn_of("condensed")
    near = {**drawn.boxes, "J": (drawn.boxes["M"][0],)}
    spoilt = type(drawn)(drawn.labels, near, {1: drawn.bonds[1]}, {1: near["M"][0]}, drawn.ends)
    found = list(flaws(spoilt))
    assert "labels of 'M' and 'J' overlap" in found
    assert "the number of bond 1 lies on the label of 'M'" in found
    through = Line(Point(near["M"][0].x - 50.0, near["M"][0].y), Point(near["M"][0].x + 50.0, near["M"][0].y))
    spoilt = type(drawn)(drawn.labels, drawn.boxes, {6: through}, {6: Box(0.0, 900.0, 1.0, 1.0)}, drawn.ends)
    assert "bond 6 passes through the label of 'M'" in list(flaws(spoilt))


def test_a_graph_that_no_arrangement_makes_clear_is_refused(monkeypatch):
    monkeypatch.setattr("bondgraph.drawing.layout.flaws", lambda drawn: iter(["labels of 'J' and 'M' overlap"]))
    with pytest.raises(GraphError, match="too entangled to be drawn clearly; draw parts of it by themselves"):
        layout(Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build())


def test_labels_say_symbol_name_and_what_a_law_varies_with():
    found = labels(condensed())
    assert found["T"][:2] == ("MTF", ("T(theta)",))
    assert found["J"][:2] == ("I", ("J",))
    assert found["crank"] == ("1", ("crank",), True)


def test_names_that_only_join_their_neighbours_are_left_out():
    found = labels(motor())
    assert found["rotor-crank"].lines == ()
    assert found["rotor-crank.rate"].lines == ()
    assert labels(hub())["crank->cylinder0.rod.com.x"][:2] == ("TF", ("2",))


def test_a_shared_first_part_is_left_out_where_the_rest_is_clear():
    b = Builder().one("press.rod").on("press.rod", I("press.mass[0]", 1.0), Se("load", 1.0), Se("drive.torque", 1.0))
    assert short_names(b.build()) == {
        "press.rod": "rod",
        "press.mass[0]": "mass[0]",
        "load": "load",
        "drive.torque": "drive.torque",
    }


def test_first_parts_stay_where_anything_would_be_told_apart_no_more():
    names = short_names(hub(2))
    assert names["cylinder0.mass[0]"] == "cylinder0.mass[0]"
    b = Builder().one("rod").on("rod", I("press.rod", 1.0), R("press.B", 1.0))
    assert short_names(b.build())["press.B"] == "press.B"


def test_long_names_wrap_at_their_dots_and_lose_nothing():
    lines = labels(hub())["cylinder0.rod.com.x"].lines
    assert lines == ("cylinder0.", "rod.com.x")
    assert all("".join(label.lines) in {*hub().elements, "2", ""} for label in labels(hub()).values())


@pytest.mark.parametrize(
    ("name", "tex", "read"),
    [
        ("theta", r"$\theta$", "θ"),
        ("m_1x", "$m_{1x}$", "m1x"),
        ("omega2", r"$\omega_{2}$", "ω2"),
        ("damping", "damping", "damping"),
        ("Jm", "Jm", "Jm"),
        ("mass[0]", "mass[0]", "mass[0]"),
        ("3.5", "3.5", "3.5"),
        ("a$b", r"a\$b", "a$b"),
    ],
)
def test_single_and_greek_letters_are_symbols_and_words_stay_words(name, tex, read):
    assert mathtext(name) == tex
    if "$" not in name:
        assert plain(name) == read


def test_width_grows_with_the_text_and_the_font():
    assert width("I:mm", 10.0) > width("I:m", 10.0)
    assert width("I:m", 20.0) == pytest.approx(2.0 * width("I:m", 10.0))


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


def test_bounds_hold_every_box_and_no_more():
    drawn = drawn_of("motor")
    boxes = [box for own in drawn.boxes.values() for box in own] + list(drawn.numbers.values())
    xs = [box.x + sign * box.width / 2 for box in boxes for sign in (-1, 1)]
    ys = [box.y + sign * box.height / 2 for box in boxes for sign in (-1, 1)]
    assert drawn.bounds == (min(xs), min(ys), max(xs), max(ys))
