"""Pictures of sweeps: curves, maps and parallel coordinates show every design, and where the approximate one is light."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection

import flywheel
from flywheel.pictures.sweeps import draw, too_light
from tests.scenes import press

SPEED, LENGTH, EPS = "regime.speed", "mechanism.crank.length", "flywheel.irregularity"
DANGER = "approximate below exact: too light, danger"


@pytest.fixture(scope="module")
def scene():
    return flywheel.load(press())


def legend(made):
    return [text.get_text() for text in made.legends[0].get_texts()]


def test_one_number_gives_curves_and_where_they_part(scene):
    found = flywheel.sweep(scene, {SPEED: np.append(-1.0, np.linspace(5.0, 120.0, 24))})
    assert too_light(found).any()
    made = draw(found)
    above, below = made.axes
    assert above.get_ylabel() == "flywheel at its shaft, kg m²"
    assert below.get_xlabel() == "regime.speed, rad/s"
    exact, approximate = (line.get_ydata() for line in above.get_lines()[:2])
    assert np.array_equal(exact, found.exact, equal_nan=True)
    assert np.array_equal(approximate, found.approximate, equal_nan=True)
    assert legend(made) == ["exact", "approximate", DANGER, "refused"]


@pytest.mark.slow
def test_more_numbers_give_a_map_or_parallel_coordinates(scene):
    grid = {SPEED: np.linspace(5.0, 120.0, 6), LENGTH: np.append(np.linspace(0.05, 0.2, 4), 0.7)}
    found = flywheel.sweep(scene, grid, grid=True)
    made = draw(found)
    assert (made.axes[0].get_xlabel(), made.axes[0].get_ylabel()) == ("regime.speed, rad/s", "crank.length, m")
    least, *others = legend(made)
    assert least.startswith("least: ")
    assert others == [DANGER, "refused"]
    found = flywheel.sweep(scene, {**grid, EPS: [0.02, 0.05]}, grid=True)
    made = draw(found)
    names = [label.get_text().split(",")[0] for label in made.axes[0].get_xticklabels()]
    assert names == [
        "regime.speed",
        "crank.length",
        EPS,
        "exact flywheel",
        "approximate flywheel",
        "mean power of the drive",
    ]
    lines = sum(len(each.get_segments()) for each in made.axes[0].collections if isinstance(each, LineCollection))
    assert lines == np.isfinite(found.exact).sum() + len(found.pareto("exact", "power"))


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
    found = flywheel.sweep(scene, columns)
    found.plot(tmp_path / "a.svg")
    assert max(map(len, found.table().splitlines())) <= 80
