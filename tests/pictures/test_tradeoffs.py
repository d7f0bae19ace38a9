"""Errors over times: every point is there with its label, and no label lies on another."""

from itertools import combinations

import numpy as np
import pytest

from flywheel.pictures.tradeoffs import draw, plot
from tests.study.made import REFERENCE, compared, row, whole

KINDS = ("Euler", "RK4", "LSODA")


def crowd():
    """Some thirty methods, many of them in one place."""
    rows = [row("exact, closed form", f"rtol {k}", 0.0, 6e-4 * 1.01**k, label=f"exact closed 1e-{k:02d}") for k in range(9)]
    for j, kind in enumerate(KINDS):
        for k in range(2):
            for restart in (", restarted", ""):
                error, seconds = 10.0 ** (-5 - k + 0.1 * j), 0.3 * 1.7**k * 1.1**j
                label = f"{kind} 1e-{k} {restart[2:]}"
                rows.append(row(f"time stepping, {kind}", f"rtol {k}{restart}", error, seconds, label=label))
    rows += [row("plain grid", f"{n} angles", 1 / n, 1e-4, label=f"grid {n}") for n in (36, 360, 3600)]
    rows += [row("whole bond graph", f"rtol {k}", 2e-6, 0.7, label=f"bond graph {k}") for k in range(3)]
    return compared(*rows, cheapest=rows[0].name)


def labels_of(made, found):
    names = {own.label for own in found.rows}
    return [text for text in made.texts if text.get_text() in names]


@pytest.fixture(scope="module", params=[pytest.param(crowd, marks=pytest.mark.slow), whole])
def drawn(request):
    found = request.param()
    return found, draw(found)


@pytest.mark.slow
def test_every_answer_has_a_label(drawn):
    found, made = drawn
    shown = [own.label for own in found.rows if own.error is not None]
    assert sorted(text.get_text() for text in labels_of(made, found)) == sorted(shown)


def test_no_label_lies_on_another(drawn):
    found, made = drawn
    extents = [text.get_window_extent() for text in labels_of(made, found)]
    assert not [pair for pair in combinations(extents, 2) if pair[0].overlaps(pair[1])]


def test_all_labels_are_within_the_panel(drawn):
    found, made = drawn
    panel = made.axes[0].get_window_extent()
    for text in labels_of(made, found):
        box = text.get_window_extent()
        assert panel.x0 <= box.x0 < box.x1 <= panel.x1
        assert panel.y0 <= box.y0 < box.y1 <= panel.y1


def test_no_label_lies_on_a_point(drawn):
    found, made = drawn
    panel = made.axes[0]
    points = [(1e3 * own.seconds, max(own.error, REFERENCE.doubt)) for own in found.rows if own.error is not None]
    for x, y in panel.transData.transform(points):
        assert not [text for text in labels_of(made, found) if text.get_window_extent().contains(x, y)]


def test_points_stand_at_their_times_and_errors(drawn):
    found, made = drawn
    marks = np.concatenate([line.get_xydata() for line in made.axes[0].lines if line.get_marker() not in ("None", None, "")])
    for own in found.rows:
        if own.error is not None:
            wanted = (1e3 * own.seconds, max(own.error, REFERENCE.doubt))  # below the doubt, on the floor's edge
            assert np.isclose(marks, wanted, rtol=1e-12, atol=0.0).all(axis=1).any()


def test_what_is_asked_the_floor_and_the_cheapest_are_in_the_legend(drawn):
    found, made = drawn
    told = [text.get_text() for text in made.legends[0].get_texts()]
    assert {"asked: 1e-06", "the reference's doubt: 1.0e-14", "cheapest that keeps it", "hollow: without restart"} <= set(
        told
    )
    assert len(told) == len(set(told)) == 4 + len({own.family for own in found.rows if own.error is not None})


def test_the_cheapest_is_ringed(drawn):
    found, made = drawn
    rings = [line for line in made.axes[0].lines if line.get_label() == "cheapest that keeps it"]
    best = found.row(found.cheapest)
    assert [tuple(ring.get_xydata()[0]) for ring in rings] == [(1e3 * best.seconds, REFERENCE.doubt)]


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (compared(row("plain grid", "36 angles", None), title="$x$ \x1b" + 99 * "y"), "NOT WHOLE: 1 of 1"),
        (compared(row("a", error=0.0), reference=REFERENCE._replace(doubt=0.0)), "No method"),
    ],
)
def test_odd_ones_are_drawn_too(found, words):
    assert words in draw(found).axes[0].get_title()


def test_another_kind_of_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"ending in \.png"):
        plot(compared(), tmp_path / "a.txt")
