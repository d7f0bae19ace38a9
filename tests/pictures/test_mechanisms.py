"""Pictures of mechanisms: everything of the sketch is drawn, in its place; how it looks was judged by eye."""

from __future__ import annotations

from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

import flywheel
from flywheel.pictures import figures, mechanisms
from flywheel.pictures.sketch import views
from flywheel.scene.linkage import Linkage
from flywheel.scene.scene import Mechanism, Scene
from tests.limits import sample
from tests.linkages.linkages import CASES
from tests.pictures.linkages import eccentric
from tests.pictures.test_sketch_views import CLAMP
from tests.scenes import press, shaper, yoke

TYPES: dict[str, dict[str, Any]] = {
    "yoke": yoke(),
    "press": press(),
    "shaper": shaper(),
    "clamp": CLAMP,
    "two": press(mechanism=[press()["mechanism"], press()["mechanism"] | {"name": "other", "phase": "90 deg"}]),
}


def of_linkage(linkage: Linkage) -> Scene:
    return Scene(speed=10.0, mechanisms=(Mechanism("linkage", "made", linkage=linkage),))


def loaded(kind: str) -> Scene:
    return flywheel.load(TYPES[kind]) if kind in TYPES else of_linkage(CASES[kind][0])


@cache
def drawn(kind: str) -> Figure:
    return mechanisms.draw(loaded(kind))


def artists(panel: Axes, kind: str) -> list[Any]:
    """What was drawn of figures of a kind (or of a kind and a body) at the first position, faint ones left out."""
    found = [a for a in panel.get_children() if isinstance(a, Line2D | Polygon) and f"{a.get_gid()} ".startswith(f"{kind} ")]
    return [a for a in found if a.get_zorder() != 1.6]


def panels(figure: Figure) -> list[Axes]:
    return [panel for panel in figure.axes if panel.axison]


@pytest.mark.parametrize("kind", sample([*TYPES, *CASES], 8))
def test_every_figure_is_drawn_within_equal_axes(kind: str) -> None:
    scene = loaded(kind)
    shown = views(scene)
    for panel, view in zip(panels(drawn(kind)), shown, strict=True):
        assert panel.get_aspect() == 1.0
        assert panel.get_xlabel()[-2:] in ("mm", " m")
        counted = [str(a.get_gid()).split()[0] for a in panel.get_children() if a.get_gid() and a.get_zorder() != 1.6]
        kinds = [shape.kind.split()[0] for shape in view.sketch.shapes] + ["path"] * len(view.sketch.traces)
        assert sorted(counted) == sorted(kinds)
        low, high = np.array([panel.get_xlim(), panel.get_ylim()]).T
        for artist in panel.get_children():
            if isinstance(artist, Polygon):
                assert (artist.get_xy().min(axis=0) > low).all()
                assert (artist.get_xy().max(axis=0) < high).all()


def test_the_first_position_is_drawn_and_the_others_faintly() -> None:
    figure = mechanisms.draw(flywheel.load(press()), at=np.radians([90.0, 180.0, 270.0]).tolist())
    (panel,) = panels(figure)
    (bold,) = artists(panel, "bar crank")
    assert bold.get_xy().max(axis=0) == pytest.approx([0.0, 100.0], abs=5.0)
    faint = [a for a in panel.patches if a.get_gid() == "bar crank" and a.get_zorder() == 1.6]
    assert len(faint) == 2
    assert faint[0].get_xy().min(axis=0) == pytest.approx([-100.0, 0.0], abs=5.0)  # type: ignore[attr-defined]
    assert "φ = 90° (faint: 180°, 270°)" in panel.get_title()


def test_paths_are_the_points_over_the_whole_turn() -> None:
    (panel,) = panels(mechanisms.draw(flywheel.load(press()), points=["crank_pin"]))
    (path,) = artists(panel, "path")
    x, y = np.asarray(path.get_xdata()), np.asarray(path.get_ydata())
    np.testing.assert_allclose(np.hypot(x, y), 100.0, rtol=1e-12)
    assert np.ptp(x) == pytest.approx(200.0)
    assert path.get_gid() == "path crank_pin"


@pytest.mark.slow
def test_units_follow_the_size() -> None:
    (small,) = panels(drawn("press"))
    (large,) = panels(drawn("yoke"))
    assert small.get_xlabel() == "x, mm"
    assert large.get_xlabel() == "x, m"


@pytest.mark.parametrize("kind", ["clamp", "six-bar"])
def test_names_do_not_overlap_and_stay_inside(kind: str) -> None:
    (panel,) = panels(drawn(kind))
    boxes = [text.get_window_extent() for text in panel.texts]
    for one, other in combinations(boxes, 2):
        assert not one.overlaps(other)
    for box in boxes:
        assert panel.bbox.x0 <= box.x0
        assert box.x1 <= panel.bbox.x1
        assert panel.bbox.y0 <= box.y0
        assert box.y1 <= panel.bbox.y1


@pytest.mark.slow
def test_a_cam_is_drawn_by_its_profile() -> None:
    (panel,) = panels(mechanisms.draw(of_linkage(eccentric())))
    (cam,) = artists(panel, "cam")
    assert np.ptp(cam.get_xy(), axis=0) == pytest.approx([100.0, 100.0], rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_the_same_scene_gives_the_same_file(ending: str, tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.{ending}" for name in ("one", "two")]
    for path in paths:
        mechanisms.draw(flywheel.load(press(title="Press $5 & more")), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert paths[0].stat().st_size > 5000


def test_panels_are_arranged_to_the_shape_of_a_page() -> None:
    wide, tall = np.array([[0.0, 4.0], [0.0, 1.0]]), np.array([[0.0, 1.0], [0.0, 2.0]])
    assert mechanisms.columns_for([wide] * 3) == 1
    assert mechanisms.columns_for([tall] * 3) == 3
    assert mechanisms.columns_for([wide]) == 1


def test_shades_go_to_white_and_to_black() -> None:
    assert figures.shade("#204060", 1.0) == (1.0, 1.0, 1.0)
    assert figures.shade("#204060", -1.0) == (0.0, 0.0, 0.0)


@pytest.mark.slow
def test_instant_centres_are_marked_named_or_told():
    """The rod's where the crank's line meets the one across the slider's; the slider's own is at infinity."""
    press = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}}
    scene = flywheel.load({"mechanism": press})
    figure = mechanisms.draw_centres(flywheel.instant_centres(scene, [0.5, np.pi / 2 - 1e-3]))
    near, far = figure.axes
    crosses = [line.get_xydata()[0] for line in near.lines if line.get_marker() == "x"]
    x = 100 * np.cos(0.5) + np.sqrt(9e4 - 1e4 * np.sin(0.5) ** 2)
    np.testing.assert_allclose(crosses, [(x, x * np.tan(0.5))])
    names = {text.get_text() for text in near.texts}
    assert {"P(rod)", "P(crank, slider)"} < names
    assert "P(slider)" not in names
    assert near.get_title() == "slider-crank: φ = 28.6479°\nat infinity: P(slider) along 90°"
    assert "far away: P(rod) at (282.9; 2.829e+05) mm" in far.get_title()
