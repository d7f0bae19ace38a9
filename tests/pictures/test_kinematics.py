"""Pictures of a motion: panels, units, extremes, jumps that are no strokes."""

import numpy as np
import pytest

import flywheel
from flywheel.motions.kinematics import motion
from flywheel.numerics.faults import SceneError
from flywheel.pictures.kinematics import broken, draw, plot

PRESS = {"type": "slider-crank", "crank": {"length": 0.3}, "rod": {"length": 0.5, "mass": 1.0, "com": 0.2}}
SCENE = {"title": "Press", "mechanism": PRESS, "regime": {"speed": 10}, "flywheel": {"inertia": 1}}


@pytest.fixture(scope="module")
def scene():
    return flywheel.load(SCENE)


@pytest.fixture(scope="module")
def found(scene):
    return motion(scene, of=["rod", "slider"], points=73)


def texts(axes):
    return [text.get_text() for text in axes.texts]


@pytest.mark.slow
def test_three_panels_for_angles_and_three_for_lengths(found):
    axes = draw(found).axes
    assert [panel.get_ylabel() for panel in axes] == [
        *("angle, deg", "displacement, mm"),
        *("θ' = dθ/dφ, 1", "s' = ds/dφ, mm/rad"),
        *("θ'' = d²θ/dφ², 1", "s'' = d²s/dφ², mm/rad²"),
    ]
    assert axes[4].get_xlabel() == axes[5].get_xlabel() == "driver's angle φ, deg"
    assert texts(axes[0]) == ["−36.87 at 90°", "36.87 at 270°"]
    assert texts(axes[1]) == ["200 at 180°", "800 at 0°"]
    rod = axes[0].lines[2]  # after its two dead centres
    k = np.searchsorted(rod.get_xdata(), 90.0)
    assert rod.get_ydata()[k] == pytest.approx(-np.degrees(np.arcsin(0.6)), rel=1e-6)


@pytest.mark.slow
def test_over_time_units_are_those_of_time(scene):
    figure = draw(motion(scene, of=["rod.com"], points=73, speed=10.0, over="time"))
    assert [panel.get_ylabel() for panel in figure.axes] == ["displacement, mm", "velocity, m/s", "acceleration, m/s²"]
    assert figure.axes[2].get_xlabel() == "time, s"
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["rod.com.x", "rod.com.y"]
    assert figure.axes[0].lines[0].get_linestyle() == "-"
    assert figure.axes[0].lines[1].get_linestyle() == "--"
    assert figure.get_suptitle().startswith("Press: motion at 10 rad/s")
    assert figure.axes[1].lines[2].get_ydata()[0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.slow
def test_extremes_are_not_those_of_the_samples(scene):
    """The slider's greatest velocity lies between two of nine positions."""
    panel = draw(motion(scene, of=["slider"], points=9)).axes[1]
    phi = np.linspace(1.0, 1.3, 300001)
    speed = 300 * (np.sin(phi) + 0.3 * np.sin(2 * phi) / (2 * np.sqrt(0.25 - 0.09 * np.sin(phi) ** 2)))
    value, place = texts(panel)[0].split(" at ")
    assert float(value.replace("−", "-")) == pytest.approx(-speed.max(), rel=1e-4)
    assert float(place.rstrip("°")) == pytest.approx(np.degrees(phi[speed.argmax()]), abs=0.01)


def test_a_jump_is_a_gap_and_a_corner_is_none():
    x = np.linspace(0.0, 1.0, 101)
    stepped = np.where(x < 0.505, x, x + 3.0)
    cut = broken(x, stepped, np.array([0.505]))[1]
    assert np.flatnonzero(np.isnan(cut)).tolist() == [51]
    assert broken(x, stepped, np.array([0.3]))[1].size == 101  # nothing switches there
    assert broken(x, np.abs(x - 0.5), np.array([0.5]))[1].size == 101
    both_sides, jump = np.sort(np.append(x, 0.5)), np.where(np.arange(102) < 51, 0.0, 1.0)
    assert np.flatnonzero(np.isnan(broken(both_sides, jump, np.array([0.5]))[1])).tolist() == [51]


def test_dead_centres_and_breakpoints_are_drawn_and_named():
    """A follower at rest for half a turn: its acceleration jumps, and the picture has a gap there and no stroke."""
    law = {"type": "law", "outputs": {"follower": {"x": "0.01*(1 - cos(2*phi)) if phi < pi else 0"}}}
    found = motion(flywheel.load({"mechanism": law}), of=["follower"], points=73)
    panels = draw(found).axes
    legend = [text.get_text() for text in panels[0].get_legend().get_texts()]
    assert legend == ["follower", "dead centres (in its colour)", "something switches"]
    lines = [(line.get_linestyle(), line.get_xdata()[0]) for line in panels[1].lines[:2]]
    assert lines == [(":", pytest.approx(180.0)), ("-.", pytest.approx(90.0))]
    assert np.isnan(panels[2].lines[2].get_ydata()).sum() == 1


@pytest.mark.slow
def test_of_everything_bodies_and_slides_are_drawn(scene):
    figure = draw(motion(scene, points=13))
    names = [[text.get_text() for text in panel.get_legend().get_texts()] for panel in figure.axes[:2]]
    assert [labels[0] for labels in names] == ["rod", "slider (guide)"]
    assert "more curves can be drawn by name" in figure.get_suptitle()


def test_a_single_position_is_refused(scene):
    with pytest.raises(SceneError, match="two at least"):
        draw(motion(scene, at=[1.0]))


def test_other_endings_are_refused(scene, tmp_path):
    with pytest.raises(ValueError, match=r"\.txt"):
        plot(motion(scene, of=["rod"], points=5), tmp_path / "a.txt")


@pytest.mark.slow
def test_files_are_the_same_every_time(found, tmp_path):
    for name in ("a.svg", "b.svg"):
        plot(found, tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
