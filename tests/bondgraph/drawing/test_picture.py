from functools import cache

import pytest
from matplotlib.patches import Rectangle

from bondgraph import GraphError
from bondgraph.drawing.layout import layout
from bondgraph.drawing.picture import COLOURS, draw
from tests.bondgraph.drawing.drawn_graphs import GRAPHS, condensed
from tests.limits import sample

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
    found = texts(figure)
    assert {r"MTF:$T$($\theta$)", "I:$J$", "Se:$M$", "crank", "slider", "7"} <= set(found)
    assert any("f_{\\mathrm{in}}" in text for text in found)
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


def test_without_a_causality_the_library_finds_one():
    from bondgraph.causal.strokes import causality

    found = causality(condensed())
    assert len(draw(condensed()).axes[0].lines) == len(draw(condensed(), causality=found.strokes).axes[0].lines)


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
