"""Bond graphs drawn: layout, text of the picture, marks of causality."""

from functools import cache
from math import hypot
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.patches import Rectangle

from bondgraph import Bond, BondGraph, Builder, C, GraphError, I, One, R, Se, Sf, WordGraph, draw
from bondgraph.drawing import COLOURS, mathtext, svg
from bondgraph.graph import activated
from bondgraph.layout import (
    STEP,
    Box,
    Segment,
    Spot,
    enters,
    flaws,
    half_arrow,
    labels,
    layout,
    place,
    plain,
    rearranged,
    short_names,
    stroke,
    width,
)
from tests.limits import sample

# The graphs that the drawing is tested on: the sources' own and what harder machines add.


def condensed():
    b = Builder().one("crank", "rotation", displacement="theta").one("slider", "translation")
    b.on("crank", Se("M", 3.0), I("J", 2.0)).transform("crank", "slider", lambda theta: -0.5 * np.sin(theta), name="T")
    return b.on("slider", I("m", 4.0), R("B", 1.0), Se("F", 2.0)).build()


def generic():
    b = Builder().one("a", "rotation", displacement="theta").one("b", "translation")
    b.on("a", Se("M_A", 3.0), I("J_A", 2.0), R("R_A", 1.0), C("C_A", 1.0))
    b.transform("a", "b", lambda theta: -0.5 * np.sin(theta), name="T")
    return b.on("b", I("m_B", 4.0), R("R_B", 1.0), C("C_B", 1.0), Se("F_B", 2.0)).build()


def motor():
    b = Builder().one("armature", "electric").one("rotor", "rotation").one("crank", "rotation", displacement="theta")
    b.on("armature", Se("u", 24.0), I("L", 0.01), R("Ra", 1.0)).gyrate("armature", "rotor", 0.05, name="k")
    b.on("rotor", I("Jm", 1e-3), R("b", 1e-3)).between("rotor", "crank", C("shaft", 1e-3), R("damping", 0.1))
    b.on("crank", I("J", 2.0)).one("slider", "translation")
    b.transform("crank", "slider", lambda theta: -0.5 * np.sin(theta), name="T")
    return b.on("slider", I("m", 4.0), R("B", 1.0), Se("F", 2.0)).build()


def rosenberg():
    """Two planar bodies pinned together, in the manner of Rosenberg: 36 bonds in two big loops."""
    b = Builder().one("omega1", "rotation", displacement="theta").one("omega2", "rotation", displacement="phi")
    for k in "12":
        b.on(f"omega{k}", I(f"J{k}", 1.0))
        for axis in "xy":
            b.one(f"v{axis}{k}", "translation").on(f"v{axis}{k}", I(f"m_{k}{axis}", 1.0))
    for axis in "xy":
        body(b, axis)
    b.on("omega1", Se("M", 1.0)).on("cy", Sf("guide", 0.0)).one("slider", "translation").bond("cx", "slider")
    return b.on("slider", I("ms", 1.0), R("B", 1.0), Se("F", 1.0)).build()


def body(b, axis):
    for zero in "pgc":
        b.zero(f"{zero}{axis}", "translation")
    b.transform("omega1", f"v{axis}1", lambda theta: np.sin(theta), name=f"T1{axis}").bond(f"v{axis}1", f"p{axis}")
    b.transform("omega1", f"p{axis}", lambda theta: np.sin(theta), name=f"T2{axis}").bond(f"p{axis}", f"g{axis}")
    b.transform("omega2", f"g{axis}", lambda phi: np.sin(phi), name=f"T3{axis}").bond(f"g{axis}", f"v{axis}2")
    b.transform("omega2", f"c{axis}", lambda phi: np.sin(phi), name=f"T4{axis}").bond(f"v{axis}2", f"c{axis}")


def hub(spokes=6):
    """A shaft that many rods hang on, with names as scenes give them."""
    b = Builder().one("crank", "rotation").on("crank", I("inertia[0]", 1.0), Se("drive.torque", 1.0))
    for k in range(spokes):
        b.transform("crank", f"cylinder{k}.rod.com.x", 2.0).one(f"cylinder{k}.rod.com.x", "translation")
        b.on(f"cylinder{k}.rod.com.x", I(f"cylinder{k}.mass[0]", 1.0))
    return b.build()


def chain(masses):
    """Masses in a row with a spring and a damper between neighbours."""
    b = Builder().one("v1", "translation").on("v1", Se("F", 1.0), I("m1", 1.0))
    for k in range(2, masses + 1):
        b.one(f"v{k}", "translation").on(f"v{k}", I(f"m{k}", 1.0))
        b.between(f"v{k - 1}", f"v{k}", C(f"k{k}", 1.0), R(f"d{k}", 0.1))
    return b.build()


GRAPHS = {graph.__name__: graph for graph in (condensed, generic, motor, rosenberg, hub)}


# A graph's layout: labels, places, and drawings without flaws.


@cache
def drawn_of(name):
    return layout(GRAPHS[name]())


def crossing(one: Segment, two: Segment) -> bool:
    def side(line, point):
        (x, y), (u, v) = line
        return (u - x) * (point.y - y) - (v - y) * (point.x - x)

    return side(one, two.start) * side(one, two.end) < 0 > side(two, one.start) * side(two, one.end)


def middle(line: Segment) -> Spot:
    return line.point(0.5)


def away(point: Spot, boxes: tuple[Box, ...]) -> float:
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
    line, bar = (
        Segment(Spot(0.0, 0.0), Spot(30.0, 40.0)),
        stroke(Segment(Spot(0.0, 0.0), Spot(30.0, 40.0)), at_end=True),
    )
    along = (line.end.x * (bar.end.x - bar.start.x), line.end.y * (bar.end.y - bar.start.y))
    assert sum(along) == pytest.approx(0.0, abs=1e-9)
    assert middle(bar) == pytest.approx(line.end)


@pytest.mark.parametrize("end", [(50.0, 0.0), (-50.0, 0.0), (0.0, 50.0), (0.0, -50.0), (40.0, 30.0), (-40.0, 30.0)])
def test_half_arrows_lie_on_the_flow_side_whichever_way_the_bond_points(end):
    line = Segment(Spot(0.0, 0.0), Spot(*end))
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
    result = list(flaws(spoilt))
    assert "labels of 'M' and 'J' overlap" in result
    assert "the number of bond 1 lies on the label of 'M'" in result
    through = Segment(Spot(near["M"][0].x - 50.0, near["M"][0].y), Spot(near["M"][0].x + 50.0, near["M"][0].y))
    spoilt = type(drawn)(drawn.labels, drawn.boxes, {6: through}, {6: Box(0.0, 900.0, 1.0, 1.0)}, drawn.ends)
    assert "bond 6 passes through the label of 'M'" in list(flaws(spoilt))


def rails(lengths):
    """A chain of so many junctions, and a second one beside it that holds it at each of them: no element cuts it in two."""
    b = Builder()
    for k in range(lengths):
        for rail, kinds in (("a", (b.one, b.zero)), ("b", (b.zero, b.one))):
            kinds[k % 2](f"{rail}{k}").on(f"{rail}{k}", (I if kinds[k % 2] == b.one else C)(f"s{rail}{k}", 1.0))
            b = b.bond(f"{rail}{k - 1}", f"{rail}{k}") if k else b
        b.bond(f"a{k}", f"b{k}")
    return b.build()


def star(ports, name="e"):
    b = Builder().one("hub")
    for k in range(ports):
        b.on("hub", (I, C, R, Se)[k % 4](f"{name}{k}", 1.0))
    return b.build()


LONG = [
    (lambda: chain(9), 24),
    pytest.param(lambda: chain(30), 24, marks=pytest.mark.slow),
    pytest.param(lambda: rails(20), 15, marks=pytest.mark.slow),
    (lambda: star(50), 24),
    (lambda: star(15), 24),
    (lambda: star(30, "a_long_name_of_it"), 24),
]


@pytest.mark.parametrize(("graph", "pitch"), LONG)
def test_a_long_graph_is_laid_out_to_fit_a_sheet_without_crossings(graph, pitch):
    drawn = layout(graph())
    assert list(flaws(drawn)) == []
    lines = list(drawn.bonds.values())
    assert not any(crossing(one, two) for k, one in enumerate(lines) for two in lines[:k])
    left, bottom, right, top = drawn.bounds
    assert right - left < 1190  # A3 in points: texts keep their size
    assert top - bottom < 842
    assert right - left < pitch * len(lines)  # in one row it takes more


def ring(junctions):
    b, names = Builder(), [f"n{k}" for k in range(junctions)]
    for k, name in enumerate(names):
        (b.one(name) if k % 2 else b.zero(name)).on(name, I(f"m{k}", 1.0))
    for one, two in zip(names, [*names[1:], names[0]], strict=True):
        b.transform(one, two, 2.0)
    return b


def test_wide_rings_and_ladders_have_no_crossings():
    ladder = ring(10)
    for k in range(4):
        ladder.transform(f"n{k}", f"n{9 - k}", 3.0, name=f"rung{k}")
    for graph in (ring(16).build(), ladder.build()):
        drawn = layout(graph)
        assert list(flaws(drawn)) == []
        lines = list(drawn.bonds.values())
        assert not any(crossing(one, two) for k, one in enumerate(lines) for two in lines[:k])


def test_a_law_that_reads_a_flow_is_joined_to_it_by_a_full_arrow():
    b = Builder().one("arm", "electric").one("rotor", "rotation").on("arm", Se("u", lambda f_rotor: -f_rotor), R("Ra", 1.0))
    b.on("rotor", I("J", 1.0)).gyrate("arm", "rotor", lambda f_arm: 2.0 * f_arm, name="k")
    ways = [(way.tail, way.head) for way in activated(b.build())]
    assert ways == [("rotor", "u"), ("arm", "k")]
    drawn = layout(b.build())
    assert list(flaws(drawn)) == []
    assert drawn.numbers.keys() == {1, 2, 3, 4, 5}
    beside = next(n for n, ends in drawn.ends.items() if n > 0 and ends == ("arm", "k"))
    assert not crossing(drawn.bonds[-2], drawn.bonds[beside])
    assert abs(middle(drawn.bonds[-2]).y - middle(drawn.bonds[beside]).y) > 8.0
    assert "signal, without power" in texts(draw(b.build(), causality={}))
    assert "signal, without power" not in texts(draw(condensed(), causality=STROKES))


def test_parts_have_a_colour_each_that_the_picture_explains():
    figure = draw(condensed(), causality={}, parts={"crank": ["crank", "J"], "slider": ["slider", "m"]})
    bare = draw(condensed(), causality={})
    assert sorted(texts(figure)) == sorted([*texts(bare), "crank", "slider"])
    colours = [line.get_color() for line in figure.axes[0].lines]
    added = set(colours) - {line.get_color() for line in bare.axes[0].lines}
    assert len(added) == 2
    assert all(colours.count(colour) == 4 for colour in added)  # two labels in a junction, one in a store, and the sample


def test_explanations_take_other_words():
    result = texts(draw(condensed(), causality={}, words={"rotation": "rotación", "transformer": "transformador"}))
    assert "rotación" in result
    assert "translation" in result
    assert any(text.startswith("transformador: $f_{") for text in result)


def test_parts_of_elements_that_are_none_are_named():
    with pytest.raises(GraphError, match="part 'rod': no element 'm_rod'"):
        draw(condensed(), parts={"rod": ["slider", "m_rod"]})


def test_an_svg_has_every_label_number_and_stroke():
    root = fromstring(svg(condensed(), title="Crank & slider, r < l"))
    written = ["".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {"Crank & slider, r < l", "MTF:T(θ)", "I:J", "crank", "7"} <= set(written)
    strokes = len(root.findall(".//{http://www.w3.org/2000/svg}path"))
    bare = fromstring(svg(condensed(), causality={}, numbers=False))
    assert strokes - len(bare.findall(".//{http://www.w3.org/2000/svg}path")) == 7
    wide, high = map(float, root.get("viewBox").split()[2:])
    assert all(0 < float(text.get("x")) < wide and 0 < float(text.get("y")) < high for text in root.iter() if text.get("x"))


def test_a_graph_that_no_arrangement_makes_clear_is_refused(monkeypatch):
    monkeypatch.setattr("bondgraph.layout.flaws", lambda drawn: iter(["labels of 'J' and 'M' overlap"]))
    with pytest.raises(GraphError, match="too entangled to be drawn clearly; draw parts of it by themselves"):
        layout(Builder().one("shaft").on("shaft", I("J", 2.0), Se("M", 3.0)).build())


def test_labels_say_symbol_name_and_what_a_law_varies_with():
    result = labels(condensed())
    assert result["T"][:2] == ("MTF", ("T(theta)",))
    assert result["J"][:2] == ("I", ("J",))
    assert result["crank"] == ("1", ("crank",), True)


def test_names_that_only_join_their_neighbours_are_left_out():
    result = labels(motor())
    assert result["rotor-crank"].lines == ()
    assert result["rotor-crank.rate"].lines == ()
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


SEVERAL = ("condensed", "motor")
STROKES = {1: "crank", 2: "J", 3: "T", 4: "slider", 5: "slider", 6: "B", 7: "slider"}  # m in derivative causality


@cache
def figure_of(name):
    return draw(GRAPHS[name](), causality={}, title=f"The {name} graph")


def texts(figure):
    return [text.get_text() for text in figure.axes[0].texts]


def patches(figure):
    return [patch for patch in figure.axes[0].patches if isinstance(patch, Rectangle)]


def inside(points, box):  # with a fifth of a point for the renderer's whole pixels
    x, y, width, height = box
    (x0, y0), (x1, y1) = points
    return abs(x0 + x1 - 2 * x) + (x1 - x0) <= width + 0.2 and abs(y0 + y1 - 2 * y) + (y1 - y0) <= height + 0.2


@pytest.mark.parametrize("name", sample(SEVERAL, 2))
def test_true_extents_of_all_texts_lie_inside_the_boxes_that_the_layout_kept_free(name):
    axes, drawn = figure_of(name).axes[0], layout(GRAPHS[name]())
    boxes = [box for own in drawn.boxes.values() for box in own] + list(drawn.numbers.values())
    renderer, back = figure_of(name).canvas.get_renderer(), axes.transData.inverted()
    written = axes.texts[1 : len(boxes) + 1]  # the title comes first
    for text in written:
        extent = back.transform(text.get_window_extent(renderer))
        assert any(inside(extent, box) for box in boxes), text.get_text()


@pytest.mark.parametrize("name", SEVERAL)
@pytest.mark.slow
def test_everything_lies_inside_the_picture(name):
    figure = figure_of(name)
    axes, renderer = figure.axes[0], figure.canvas.get_renderer()
    for artist in [*axes.texts, *axes.lines]:
        extent = artist.get_window_extent(renderer)
        assert extent.x0 >= 0.0 <= extent.y0
        assert extent.x1 <= figure.bbox.x1
        assert extent.y1 <= figure.bbox.y1


def test_labels_numbers_strokes_and_the_convention_are_drawn():
    figure = draw(condensed(), causality=STROKES)
    result = texts(figure)
    assert {r"MTF:$T$($\theta$)", "I:$J$", "Se:$M$", "crank", "slider", "7"} <= set(result)
    assert any("f_{\\mathrm{in}}" in text for text in result)
    without = draw(condensed(), causality={}, numbers=False)
    assert len(figure.axes[0].lines) - len(without.axes[0].lines) == len(STROKES)
    assert "7" not in texts(without)


def test_stores_in_derivative_causality_are_boxed_and_explained_only_where_there_are_any():
    figure = draw(condensed(), causality=STROKES)
    assert "store in derivative causality" in texts(figure)
    assert len(patches(figure)) == 2  # the store and the sample beside the explanation
    integral = draw(condensed(), causality={**STROKES, 5: "m"})
    assert "store in derivative causality" not in texts(integral)
    assert patches(integral) == []


@pytest.mark.parametrize("call", [draw, svg])
def test_an_option_that_there_is_none_of_is_refused_with_those_that_there_are(call):
    line = "^option 'strokes': no such option of a picture; they are causality, numbers, title, loops, parts, words$"
    with pytest.raises(GraphError, match=line):
        call(condensed(), strokes=True)
    with pytest.raises(GraphError, match=r"^option 'numbers': .* they are title$"):
        call(WordGraph({"a": ["p"], "b": ["p"]}, [("a.p", "b.p")]), numbers=False)


def test_without_a_causality_the_library_finds_one():
    from bondgraph import causality

    result = causality(condensed())
    assert len(draw(condensed()).axes[0].lines) == len(draw(condensed(), causality=result.strokes).axes[0].lines)


def test_bonds_have_the_colour_of_their_domain_and_a_legend_names_those_present():
    figure = figure_of("motor")
    assert {"translation", "rotation", "electric"} <= set(texts(figure))
    assert "hydraulic" not in texts(figure)
    used = {line.get_color() for line in figure.axes[0].lines}
    assert used == {COLOURS[name] for name in ("translation", "rotation", "electric")}


def test_conventions_are_printed_for_the_two_ports_there_are():
    assert sum("gyrator" in text for text in texts(figure_of("motor"))) == 1
    assert not any("gyrator" in text for text in texts(figure_of("condensed")))


@pytest.mark.parametrize("suffix", ["svg", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("png", "pdf"))])
def test_the_same_graph_gives_the_same_file(suffix, tmp_path):
    for name in ("one", "two"):
        draw(condensed(), tmp_path / f"{name}.{suffix}", causality=STROKES, title="Crank & slider, $1")
    assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"two.{suffix}").read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_another_file_ending_is_refused(tmp_path):
    with pytest.raises(GraphError, match=r"found '.*graph\.jpeg', expected a file name ending in \.png, \.svg or \.pdf"):
        draw(condensed(), tmp_path / "graph.jpeg", causality={})
    assert list(tmp_path.iterdir()) == []


def test_a_failure_while_saving_leaves_the_old_file(tmp_path, monkeypatch):
    file = tmp_path / "graph.png"
    file.write_bytes(b"\x89PNG\r\n\x1a\nold")

    def fail(self, where, **kwargs):
        where.write_bytes(b"half")
        raise OSError("disk full")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", fail)
    with pytest.raises(OSError, match="disk full"):
        draw(condensed(), file, causality={})
    assert file.read_bytes().endswith(b"old")
    assert list(tmp_path.iterdir()) == [file]


def test_strokes_at_elements_that_a_bond_does_not_join_are_refused():
    with pytest.raises(GraphError) as error:
        draw(condensed(), causality={1: "J", 40: "M"})
    assert str(error.value).splitlines() == [
        "the stroke of bond 1 is at 'J', found a bond that joins 'M' and 'crank'",
        "the stroke of bond 40 is at 'M', found no bond 40",
    ]
