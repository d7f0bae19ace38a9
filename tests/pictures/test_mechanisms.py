"""Pictures of mechanisms: drawn, moved, with their curves and forces."""

from __future__ import annotations

import re
from functools import cache
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from PIL import Image

import flywheel
from flywheel import JointForces, Machine, Scene, SceneError, joint_forces, language, motion
from flywheel.machine.reactions import close_positions
from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.mechanisms.linkages.reactions import reactions as reactions_along
from flywheel.motions.joint_forces import axis, force_curves
from flywheel.pictures import animation, diagrams, figures, forms, mechanisms, reactions
from flywheel.pictures.designs import placed
from flywheel.pictures.kinematics import broken, draw, plot
from flywheel.pictures.sketch import views
from flywheel.scene.linkage import Linkage
from flywheel.scene.scene import Mechanism
from tests.limits import sample
from tests.linkages.linkages import CASES, slider_crank
from tests.pictures.linkages import eccentric
from tests.pictures.test_sketch import CLAMP
from tests.scenes import press, rotor, shaper, yoke

# Pictures of mechanisms: everything of the sketch is drawn, in its place; how it looks was judged by eye.


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
    """Artists of a kind (or of a kind and a body) at the first position, faint ones left out."""
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


# The animation: as many frames as asked, the mechanism and the marker where they belong in each.


@pytest.mark.slow
@pytest.mark.parametrize("scene", sample([press(), CLAMP], 2), ids=["press", "clamp"])
def test_a_gif_with_the_frames_asked_for(scene: dict[str, object], tmp_path: Path) -> None:
    path = tmp_path / "made.gif"
    animation.animate(flywheel.load(scene), path, frames=3, fps=10)
    with Image.open(path) as image:
        assert image.format == "GIF"
        assert image.n_frames == 3  # type: ignore[attr-defined]
        assert image.info["duration"] == 100
        assert image.info["loop"] == 0
        assert image.size[0] == 880
        frames = []
        for k in range(3):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB"), dtype=int))
    assert all((one != other).any() for one, other in pairwise(frames))
    assert path.stat().st_size < 300_000


@pytest.mark.slow
@pytest.mark.parametrize("kind", sample(["clamp", "shaper"], 2))
def test_mechanism_and_marker_stand_where_the_machine_is(kind: str) -> None:
    scene = flywheel.load({"shaper": shaper(), "clamp": CLAMP}[kind])
    stage = animation.stage(scene, 8)
    (view,) = views(scene)
    for k in (0, 3, 7):
        animation.show(stage, k, scene)
        poses = view.poses([stage.q[k]])
        for shape, artist, _ in stage.bodies:
            if shape.kind == "pin" and isinstance(artist, Polygon):
                centre = artist.get_xy()[:-1].mean(axis=0)
                np.testing.assert_allclose(centre, 1000 * poses.point(*shape.at).value[:, 0], atol=2.0)
        ((x, y),) = stage.marker.get_xydata().tolist()  # type: ignore[union-attr]
        assert x == pytest.approx(1000 * stage.q[k] if kind == "clamp" else np.degrees(stage.q[k]))
        curve = stage.marker.axes.lines[0]  # type: ignore[union-attr]
        assert y == pytest.approx(np.interp(x, *np.asarray(curve.get_xydata()).T), rel=1e-6)
        assert ("x = " if kind == "clamp" else "φ = ") in stage.clock.get_text()


def test_a_law_beside_a_mechanism_is_named_as_left_out() -> None:
    feed = {"type": "law", "name": "feed", "outputs": {"out": {"x": "0.01*sin(phi)", "mass": 1}}}
    stage = animation.stage(flywheel.load(press(mechanism=[press()["mechanism"], feed])), 2)
    assert stage.figure.get_suptitle() == "(not drawn: feed, a law without bodies)"
    assert len(stage.figure.axes) == 2  # the press, and the curve


@pytest.mark.parametrize(
    ("frames", "fps", "name"), [(1, 20, "a.gif"), (601, 20, "a.gif"), (5, 0, "a.gif"), (5, 20, "a.png")]
)
def test_what_no_gif_can_be_is_refused(frames: int, fps: int, name: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"found .*, expected"):
        animation.animate(flywheel.load(yoke()), tmp_path / name, frames=frames, fps=fps)


def test_a_rotor_alone_has_no_picture(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="expected a mechanism to draw"):
        animation.animate(flywheel.load(rotor()), tmp_path / "a.gif")


# Pictures of a motion: panels, units, extremes, jumps that are no strokes.


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
    assert all(re.fullmatch(r"(?:about )?[^ ]+ at \d+(?:\.\d)?°", each) for panel in axes for each in texts(panel))
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
    assert float(place.rstrip("°")) == pytest.approx(np.degrees(phi[speed.argmax()]), abs=0.05)


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


# Labels are pushed apart, and stay beside their points.


ROOM = (0.0, 0.0, 720.0, 420.0)
NONE = np.empty((0, 4))


def boxes(found, sizes):
    corners, _ = found
    return np.concatenate([corners, corners + sizes], axis=1)


def overlaps(first, second):
    return (first[:2] < second[2:]).all() and (second[:2] < first[2:]).all()


def check(points, sizes, blocks=NONE):
    found = boxes(placed(points, sizes, ROOM, blocks, NONE), sizes)
    assert (found[:, :2] >= ROOM[:2]).all()
    assert (found[:, 2:] <= ROOM[2:]).all()
    for k, box in enumerate(found):
        assert not any(overlaps(box, other) for other in [*found[:k], *blocks])
    return found


def sizes_of(count, width=95.0):
    return np.tile([width, 9.0], (count, 1))


def test_twenty_points_anywhere():
    points = np.random.default_rng(1).uniform([20, 20], [400, 200], (20, 2))
    check(points, sizes_of(20))


def test_twelve_points_in_one_place():
    points = np.tile([360.0, 15.0], (12, 1)) + np.linspace(0.0, 2.0, 12)[:, None]
    faults = check(points, sizes_of(12))
    middles = 0.5 * (faults[:, :2] + faults[:, 2:])
    assert np.hypot(*(middles - points).T).max() < 300


def test_blocks_are_left_free():
    blocks = np.array([[80.0, 80.0, 260.0, 120.0], [120.0, 60.0, 130.0, 140.0]])
    check(np.array([[125.0, 100.0], [150.0, 100.0]]), sizes_of(2), blocks)


def test_lines_are_avoided_where_there_is_room():
    points, sizes = np.array([[200.0, 200.0]]), sizes_of(1)
    line = np.array([[200.0, 200.0, 400.0, 200.0], [200.0, 200.0, 200.0, 400.0]])
    (left, bottom, right, top) = boxes(placed(points, sizes, ROOM, NONE, line), sizes)[0]
    assert not (bottom < 200 < top and right > 200)
    assert not (left < 200 < right and top > 200)


def test_leaders_end_at_their_labels():
    points = np.tile([360.0, 200.0], (9, 1))
    corners, ends = placed(points, sizes_of(9), ROOM, NONE, NONE)
    assert np.array_equal(ends, np.clip(ends, corners, corners + sizes_of(9)))


def test_a_label_that_fits_nowhere_is_moved_into_the_frame():
    corners, _ = placed(np.array([[5.0, 5.0]]), np.array([[900.0, 9.0]]), ROOM, NONE, NONE)
    assert corners[0] == pytest.approx([2.0, 7.0], abs=5)


# Plots of reactions: the curves are the forces, marked where the crank stands.


TURN = 2 * np.pi


@cache
def found_reactions(scale: float = 1.0) -> Reactions:
    """Reactions of a slider-crank with masses, a value every degree."""
    base = slider_crank()
    masses = zip(base.links, (1.0, 2.0, 3.0), strict=True)
    links = tuple(link._replace(mass=scale * mass, inertia=0.01 * scale, com=(0.05, 0.01)) for link, mass in masses)
    linkage = Linkage(base.ground, links, base.joints, base.driver)
    q = np.linspace(0.0, TURN, 361)
    return reactions_along(solve(linkage, 0.0, TURN), q, 50.0, gravity=(0.0, -9.80665))


def drawn_reactions(*joints: str, of: Reactions | None = None) -> list[Axes]:
    """The panels of joints, without the driving action's."""
    axes = reactions.polar(of or found_reactions(), joints=joints or None).axes
    return [panel for panel in axes if not panel.get_title().startswith("driving") and (panel.axison or panel.texts)]


def curve(panel: Axes, k: int = 0) -> Any:
    return np.array([np.asarray(data, dtype=float) for data in panel.lines[k].get_data()])


@pytest.mark.slow
def test_every_joint_has_a_panel_with_its_largest_force() -> None:
    panels = [panel for panel in drawn_reactions() if panel.get_title()]
    assert [panel.get_title().split(":")[0] for panel in panels] == ["O", "A", "B", "guide"]
    worst = next(extreme for extreme in found_reactions().extremes() if extreme.joint == "A")
    _head, force, at = re.split(r"at most | N, at ", panels[1].get_title().rstrip("°"))
    assert float(force) == pytest.approx(worst.force, rel=1e-3)
    assert float(at) == pytest.approx(np.degrees(worst.at), abs=1.0)


def test_a_hodograph_is_the_force_with_equal_scales() -> None:
    (panel,) = drawn_reactions("A")
    np.testing.assert_array_equal(curve(panel), found_reactions().forces["A"])
    assert panel.get_aspect() == 1.0
    assert panel.get_xlabel() == "Fx, N"


def test_marks_stand_every_30_degrees() -> None:
    (panel,) = drawn_reactions("B")
    assert [text.get_text() for text in panel.texts] == [f"{k}°" for k in range(0, 360, 30)]
    dots = next(line for line in panel.lines if line.get_marker() == "o")
    np.testing.assert_allclose(np.array(dots.get_data()), found_reactions().forces["B"][:, :-1:30], rtol=1e-12)


def test_a_slide_shows_normal_force_and_moment_over_the_angle() -> None:
    panel, moment = drawn_reactions("guide")
    x, y = curve(panel)
    np.testing.assert_allclose(x, np.arange(361.0), atol=1e-9)
    np.testing.assert_array_equal(y, found_reactions().components["guide"]["normal"])
    np.testing.assert_array_equal(curve(moment)[1], found_reactions().components["guide"]["moment"])
    assert panel.get_xlabel() == "crank angle φ, deg"


def part(*, upto: int, step: int = 1) -> Reactions:
    """The same at some of its positions."""
    few = slice(0, upto, step)
    linkage = solve(found_reactions().poses.linkage, 0.0, TURN)
    return reactions_along(linkage, found_reactions().poses.q[few], 50.0, gravity=(0.0, -9.80665))


@pytest.mark.slow
def test_a_whole_turn_is_closed() -> None:
    of = part(upto=360, step=10)
    pin, panel, _ = drawn_reactions("A", "guide", of=of)
    line = curve(pin)
    np.testing.assert_array_equal(line[:, :-1], of.forces["A"])
    np.testing.assert_array_equal(line[:, -1], of.forces["A"][:, 0])
    assert panel.get_xlim() == pytest.approx((0.0, 360.0))
    assert curve(panel)[0, -1] == pytest.approx(360.0)
    assert curve(panel)[1, -1] == of.components["guide"]["normal"][0]


def test_two_turns_are_marked_once_where_they_end() -> None:
    q = np.linspace(0.0, 2 * TURN, 240, endpoint=False)
    once = part(upto=360, step=3)
    twice = once._replace(
        poses=once.poses._replace(q=q, value=np.tile(once.poses.value, 2)),
        forces={name: np.tile(values, 2) for name, values in once.forces.items()},
        actions={name: np.tile(values, 2) for name, values in once.actions.items()},
    )
    assert [text.get_text() for text in drawn_reactions("A", of=twice)[0].texts] == [f"{k}°" for k in range(0, 720, 60)]


def test_rounding_is_drawn_as_nought() -> None:
    guide = dict(found_reactions().components["guide"]) | {"normal": np.full(361, 1e-12)}
    panel = drawn_reactions(
        "guide", of=found_reactions()._replace(components=dict(found_reactions().components) | {"guide": guide})
    )[0]
    assert not curve(panel)[1].any()


def test_large_forces_are_in_kilonewtons() -> None:
    (panel,) = drawn_reactions("A", of=found_reactions(1000.0))
    np.testing.assert_allclose(curve(panel), 1e-3 * found_reactions(1000.0).forces["A"])
    assert panel.get_xlabel().endswith("kN")


def test_a_force_that_is_left_open_is_said_to_be() -> None:
    forces = dict(found_reactions().forces) | {"A": np.full((2, 361), np.nan)}
    (panel,) = drawn_reactions("A", of=found_reactions()._replace(forces=forces))
    assert not panel.axison
    assert "redundant constraints" in panel.texts[0].get_text()


@pytest.mark.slow
def test_gaps_stay_gaps() -> None:
    force = found_reactions().forces["A"].copy()
    force[:, 85:95] = np.nan
    (panel,) = drawn_reactions("A", of=found_reactions()._replace(forces=dict(found_reactions().forces) | {"A": force}))
    assert np.isnan(curve(panel)[0, 85:95]).all()
    assert "90°" not in [text.get_text() for text in panel.texts]


def test_a_force_that_jumps_leaves_a_gap_and_a_steep_one_does_not() -> None:
    x = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 4.1, 5.0])
    values = np.array([0.0, 0.1, 0.2, 5.0, 5.1, 5.2, 5.3, 6.2])
    assert forms.breaks(x, values) == (3,)
    smooth = np.sin(np.linspace(0.0, 6.0, 100))
    assert not forms.breaks(np.linspace(0.0, 6.0, 100), smooth)
    ends = np.add.outer([3.04, 3.08], [-1e-9, 0.0, 1e-9]).ravel()  # of two cells, each on both sides
    cells = np.sort(np.append(np.linspace(0.0, 6.0, 100), ends))
    assert not forms.breaks(cells, np.sin(cells))
    assert forms.breaks(x[:3], values[:3], cyclic=True) == (0,)


def test_the_driving_torque_stands_beside_and_bodies_are_named() -> None:
    axes = reactions.polar(found_reactions(), joints=["A"]).axes
    assert axes[0].get_title().startswith("A: crank on rod\n")
    assert axes[-1].get_title().startswith("driving torque at O")
    np.testing.assert_array_equal(curve(axes[-1])[1], found_reactions().action)


@pytest.mark.slow
def test_the_picture_draws_the_rows_of_the_page() -> None:
    sizing = flywheel.size(flywheel.load(press()))
    part = forms.part_of(sizing.scene, sizing.machine, sizing, 181)
    forces = diagrams.forces_of(part)
    page = diagrams.made(part, "reactions", forces)
    found = forces.mechanisms["press"]
    panels = reactions.polar(found._replace(poses=found.poses._replace(q=part.axis.values))).axes
    rows = {row.key: row for row in reversed(page.rows)}.values()  # of a slide its forces, the moment stands beside them
    assert {panel.get_title() for panel in panels} - {""} == {f"{row.title}\n{row.about}" for row in rows}
    plane = next(row for row in page.rows if row.kind == "plane")
    dots = next(line for line in panels[0].lines if line.get_marker() == "o")
    assert len(dots.get_xdata()) == len(plane.along) == 12
    assert panels[0].get_xlabel() == f"Fx, {plane.unit}"


def test_a_largest_force_beside_a_jump_is_one_that_is_reached() -> None:
    force = np.zeros((2, 361))
    force[0] = np.where(np.arange(361) <= 90, 100.0 + np.arange(361), -50.0)
    changed = found_reactions()._replace(forces=dict(found_reactions().forces) | {"A": force})
    joints = forms.force_figures(changed, changed.poses.q, ["A"])["joints"]
    assert joints[0]["largest"] == pytest.approx({"value": 190.0, "at": np.radians(90.0)})


def test_unknown_joints_are_refused_with_the_nearest() -> None:
    with pytest.raises(SceneError, match=r"joints: found 'guid', expected one of O, A, B, guide; did you mean 'guide'\?"):
        drawn_reactions("guid")


# -- curves over the driver or the time -----------------------------------------------------------------------------------


@cache
def pressed() -> JointForces:
    """A press at constant speed, with both sides of its load's edges among the positions."""
    machine = Machine(flywheel.load(press()))
    return joint_forces(machine, close_positions(machine, 90), speed=5.0)


def drawn_curves(over: str, *, together: bool, **asked: Any) -> Figure:
    forces = pressed()
    return reactions.curves(force_curves(forces, **asked), axis(forces, over), "Press", together=together)


def labels(panel: Axes) -> list[str]:
    legend = panel.get_legend()
    assert legend is not None
    return [text.get_text() for text in legend.get_texts()]


def test_each_joint_has_a_panel_with_its_components_and_their_extremes() -> None:
    made = drawn_curves("driver", together=False, of=["crank_pin", "guide"], components=["x", "y", "moment"])
    pin, guide = made.axes[:2]
    assert [panel.get_title(loc="left") for panel in (pin, guide)] == ["crank_pin", "guide"]
    x, y = curve(pin)
    forces = pressed()
    whole = ~np.isnan(x)
    np.testing.assert_array_equal(x[whole], np.degrees(forces.motion.phi))
    np.testing.assert_allclose(y[whole], 1e-3 * forces.mechanisms["press"].components["crank_pin"]["x"])
    assert labels(pin)[0] == f"Fx: {np.nanmin(y):.4g} to {np.nanmax(y):.4g} kN".replace("-", "−")
    low = next(line for line in pin.lines if line.get_marker() == "v")
    assert low.get_ydata()[0] == np.nanmin(y)
    jumps = np.flatnonzero(np.isnan(x))
    assert np.abs(y[jumps + 1] - y[jumps - 1]).max() > 19.0  # 20 kN set in: both sides are there, and nothing between
    assert guide.get_xlabel() == "crank angle φ, deg"


def test_joints_stand_together_under_each_component_over_the_time() -> None:
    made = drawn_curves("time", together=True, components=["x", "driving"])
    driving, across = made.axes
    assert [label.split(":")[0] for label in labels(across)] == ["pivot", "crank_pin", "slider_pin", "guide"]
    assert driving.get_ylabel() == "driving action, N m"
    assert across.get_xlabel() == "time, s"
    times = curve(across)[0]
    np.testing.assert_allclose(times[~np.isnan(times)] * 5.0, pressed().motion.phi, rtol=1e-14)
    colours = {line.get_color() for line in across.lines if line.get_marker() == "None" and line.get_linewidth() == 1.6}
    assert len(colours) == 4


def test_no_legend_covers_a_curve() -> None:
    made = drawn_curves("driver", together=False, of=["guide"])
    made.draw_without_rendering()
    for panel in made.axes:
        if (legend := panel.get_legend()) is not None:
            assert not legend.get_window_extent().overlaps(panel.get_window_extent())
            assert legend.get_window_extent().x1 <= made.bbox.x1


@pytest.mark.slow
def test_names_of_a_hodograph_stand_off_its_enlarged_corner() -> None:
    """The word at a jump, and the coordinates: but for its stroke a press has small forces."""
    machine = Machine(flywheel.load(Path(__file__).parents[2] / "examples/machines/press.toml"))
    found = joint_forces(machine, close_positions(machine, 90), speed=TURN)
    (forces,) = found.mechanisms.values()
    with language.use("es"):
        made = reactions.polar(forces)
    made.canvas.draw()
    enlarged = [panel for panel in made.axes if panel.child_axes]
    assert len(enlarged) >= 3
    for panel in enlarged:
        corner = panel.child_axes[0].get_tightbbox()
        names = [text.get_window_extent() for text in panel.texts]
        assert names
        assert not any(name.overlaps(corner) for name in names)
