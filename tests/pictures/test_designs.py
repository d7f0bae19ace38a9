"""Diagrams of sweeps and trade-offs."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.collections import LineCollection

import flywheel
from flywheel.pictures.designs import draw_sweep, draw_tradeoff, plot_tradeoff, too_light
from tests.scenes import press
from tests.study.test_comparison import REFERENCE, compared, row, whole

# Pictures of sweeps: curves, maps and parallel coordinates show every design, and where the approximate one is light.


SPEED, LENGTH, EPS = "regime.speed", "mechanism.crank.length", "flywheel.irregularity"
DANGER = "approximate below exact: too light, danger"


@pytest.fixture(scope="module")
def scene():
    return flywheel.load(press())


def legend(made):
    return [text.get_text() for text in made.legends[0].get_texts()]


def test_one_number_gives_curves_and_where_they_part(scene):
    sweep = flywheel.sweep(scene, {SPEED: np.append(-1.0, np.linspace(5.0, 120.0, 24))})
    assert too_light(sweep).any()
    made = draw_sweep(sweep)
    above, below = made.axes
    assert above.get_ylabel() == "flywheel at its shaft, kg m²"
    assert below.get_xlabel() == "regime.speed, rpm"
    assert above.get_xlim()[1] > 1000.0
    exact, approximate = (line.get_ydata() for line in above.get_lines()[:2])
    assert np.array_equal(exact, sweep.exact, equal_nan=True)
    assert np.array_equal(approximate, sweep.approximate, equal_nan=True)
    assert legend(made) == ["exact", "approximate", DANGER, "refused"]


@pytest.mark.slow
def test_more_numbers_give_a_map_or_parallel_coordinates(scene):
    grid = {SPEED: np.linspace(5.0, 120.0, 6), LENGTH: np.append(np.linspace(0.05, 0.2, 4), 0.7)}
    sweep = flywheel.sweep(scene, grid, grid=True)
    made = draw_sweep(sweep)
    assert (made.axes[0].get_xlabel(), made.axes[0].get_ylabel()) == ("regime.speed, rpm", "crank.length, m")
    least, *others = legend(made)
    assert least.startswith("least: ")
    assert others == [DANGER, "refused"]
    sweep = flywheel.sweep(scene, {**grid, EPS: [0.02, 0.05]}, grid=True)
    made = draw_sweep(sweep)
    names = [label.get_text().split(",")[0] for label in made.axes[0].get_xticklabels()]
    assert names == [
        "regime.speed",
        "crank.length",
        EPS,
        "exact flywheel",
        "approximate flywheel",
        "power of the drive at the mean of the extreme speeds",
    ]
    lines = sum(len(each.get_segments()) for each in made.axes[0].collections if isinstance(each, LineCollection))
    assert lines == np.isfinite(sweep.exact).sum() + len(sweep.pareto("exact", "power"))


@pytest.mark.slow
@pytest.mark.parametrize(
    "columns",
    [
        {EPS: [0.02]},
        {EPS: [-1.0, -2.0]},
        {EPS: [0.02, 0.03, 0.04, 0.05], SPEED: [10.0, 11.0, 12.0, 13.0]},  # on a line
        {EPS: [0.02, 0.02], SPEED: 10.0},
        {EPS: np.geomspace(1e-4, 0.5, 9), SPEED: np.geomspace(1.0, 200.0, 9)[::-1]},
    ],
)
def test_odd_sweeps_have_pictures_too(scene, columns, tmp_path):
    sweep = flywheel.sweep(scene, columns)
    sweep.plot(tmp_path / "a.svg")
    assert max(map(len, sweep.table().splitlines())) <= 80


# Errors over times: every point is there with its label, and no label lies on another.


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
    result = request.param()
    return result, draw_tradeoff(result)


@pytest.mark.slow
def test_every_answer_has_a_label(drawn):
    result, made = drawn
    shown = [own.label for own in result.rows if own.error is not None]
    assert sorted(text.get_text() for text in labels_of(made, result)) == sorted(shown)


def test_no_label_lies_on_another(drawn):
    result, made = drawn
    extents = [text.get_window_extent() for text in labels_of(made, result)]
    assert not [pair for pair in combinations(extents, 2) if pair[0].overlaps(pair[1])]


def test_all_labels_are_within_the_panel(drawn):
    result, made = drawn
    panel = made.axes[0].get_window_extent()
    for text in labels_of(made, result):
        box = text.get_window_extent()
        assert panel.x0 <= box.x0 < box.x1 <= panel.x1
        assert panel.y0 <= box.y0 < box.y1 <= panel.y1


def test_no_label_lies_on_a_point(drawn):
    result, made = drawn
    panel = made.axes[0]
    points = [(1e3 * own.seconds, max(own.error, REFERENCE.doubt)) for own in result.rows if own.error is not None]
    for x, y in panel.transData.transform(points):
        assert not [text for text in labels_of(made, result) if text.get_window_extent().contains(x, y)]


def test_points_stand_at_their_times_and_errors(drawn):
    result, made = drawn
    marks = np.concatenate([line.get_xydata() for line in made.axes[0].lines if line.get_marker() not in ("None", None, "")])
    for own in result.rows:
        if own.error is not None:
            wanted = (1e3 * own.seconds, max(own.error, REFERENCE.doubt))  # below the doubt, on the floor's edge
            assert np.isclose(marks, wanted, rtol=1e-12, atol=0.0).all(axis=1).any()


def test_what_is_asked_the_floor_and_the_cheapest_are_in_the_legend(drawn):
    result, made = drawn
    output = [text.get_text() for text in made.legends[0].get_texts()]
    assert {"asked: 1e-06", "the reference's doubt: 1.0e-14", "cheapest that keeps it", "hollow: without restart"} <= set(
        output
    )
    assert len(output) == len(set(output)) == 4 + len({own.family for own in result.rows if own.error is not None})


def test_the_cheapest_is_ringed(drawn):
    result, made = drawn
    rings = [line for line in made.axes[0].lines if line.get_label() == "cheapest that keeps it"]
    best = result.row(result.cheapest)
    assert [tuple(ring.get_xydata()[0]) for ring in rings] == [(1e3 * best.seconds, REFERENCE.doubt)]


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (compared(row("plain grid", "36 angles", None), title="$x$ \x1b" + 99 * "y"), "INCOMPLETE: 1 of 1"),
        (compared(row("a", error=0.0), reference=REFERENCE._replace(doubt=0.0)), "No method"),
    ],
)
def test_odd_ones_are_drawn_too(found, words):
    assert words in draw_tradeoff(found).axes[0].get_title()


def test_another_kind_of_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"ending in \.png"):
        plot_tradeoff(compared(), tmp_path / "a.txt")
