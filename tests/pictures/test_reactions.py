"""Plots of reactions: the curves are the forces, marked where the crank stands."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import flywheel
from flywheel.machine.machine import Machine
from flywheel.machine.reactions import close_positions
from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.mechanisms.linkages.reactions import reactions as reactions_along
from flywheel.motions.joint_forces import JointForces, axis, force_curves, joint_forces
from flywheel.numerics.faults import SceneError
from flywheel.pictures import reactions
from flywheel.scene.linkage import Linkage
from tests.linkages.linkages import slider_crank
from tests.scenes import press

TURN = 2 * np.pi


@cache
def found(scale: float = 1.0) -> Reactions:
    """Reactions of a slider-crank with masses, a value every degree."""
    base = slider_crank()
    masses = zip(base.links, (1.0, 2.0, 3.0), strict=True)
    links = tuple(link._replace(mass=scale * mass, inertia=0.01 * scale, com=(0.05, 0.01)) for link, mass in masses)
    linkage = Linkage(base.ground, links, base.joints, base.driver)
    q = np.linspace(0.0, TURN, 361)
    return reactions_along(solve(linkage, 0.0, TURN), q, 50.0, gravity=(0.0, -9.80665))


def drawn(*joints: str, of: Reactions | None = None) -> list[Axes]:
    """The panels of joints, without the driving action's."""
    axes = reactions.polar(of or found(), joints=joints or None).axes
    return [panel for panel in axes if not panel.get_title().startswith("driving") and (panel.axison or panel.texts)]


def curve(panel: Axes, k: int = 0) -> Any:
    return np.array([np.asarray(data, dtype=float) for data in panel.lines[k].get_data()])


@pytest.mark.slow
def test_every_joint_has_a_panel_with_its_largest_force() -> None:
    panels = [panel for panel in drawn() if panel.get_title()]
    assert [panel.get_title().split(":")[0] for panel in panels] == ["O", "A", "B", "guide"]
    worst = next(extreme for extreme in found().extremes() if extreme.joint == "A")
    assert f"at most {worst.force:.4g} N, at {np.degrees(worst.at):.4g}°" in panels[1].get_title()


def test_a_hodograph_is_the_force_with_equal_scales() -> None:
    (panel,) = drawn("A")
    np.testing.assert_array_equal(curve(panel), found().forces["A"])
    assert panel.get_aspect() == 1.0
    assert panel.get_xlabel() == "Fx, N"


def test_marks_stand_every_30_degrees() -> None:
    (panel,) = drawn("B")
    assert [text.get_text() for text in panel.texts] == [f"{k}°" for k in range(0, 360, 30)]
    dots = next(line for line in panel.lines if line.get_marker() == "o")
    np.testing.assert_allclose(np.array(dots.get_data()), found().forces["B"][:, :-1:30], rtol=1e-12)


def test_a_slide_shows_normal_force_and_moment_over_the_angle() -> None:
    panel, moment = drawn("guide")
    x, y = curve(panel)
    np.testing.assert_allclose(x, np.arange(361.0), atol=1e-9)
    np.testing.assert_array_equal(y, found().components["guide"]["normal"])
    np.testing.assert_array_equal(curve(moment)[1], found().components["guide"]["moment"])
    assert panel.get_xlabel() == "crank angle φ, deg"


def part(*, upto: int, step: int = 1) -> Reactions:
    """The same at some of its positions."""
    few = slice(0, upto, step)
    linkage = solve(found().poses.linkage, 0.0, TURN)
    return reactions_along(linkage, found().poses.q[few], 50.0, gravity=(0.0, -9.80665))


@pytest.mark.slow
def test_a_whole_turn_is_closed() -> None:
    of = part(upto=360, step=10)
    pin, panel, _ = drawn("A", "guide", of=of)
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
    assert [text.get_text() for text in drawn("A", of=twice)[0].texts] == [f"{k}°" for k in range(0, 720, 60)]


def test_rounding_is_drawn_as_nought() -> None:
    guide = dict(found().components["guide"]) | {"normal": np.full(361, 1e-12)}
    panel = drawn("guide", of=found()._replace(components=dict(found().components) | {"guide": guide}))[0]
    assert not curve(panel)[1].any()


def test_large_forces_are_in_kilonewtons() -> None:
    (panel,) = drawn("A", of=found(1000.0))
    np.testing.assert_allclose(curve(panel), 1e-3 * found(1000.0).forces["A"])
    assert panel.get_xlabel().endswith("kN")


def test_a_force_that_is_left_open_is_said_to_be() -> None:
    forces = dict(found().forces) | {"A": np.full((2, 361), np.nan)}
    (panel,) = drawn("A", of=found()._replace(forces=forces))
    assert not panel.axison
    assert "redundant constraints" in panel.texts[0].get_text()


@pytest.mark.slow
def test_gaps_stay_gaps() -> None:
    force = found().forces["A"].copy()
    force[:, 85:95] = np.nan
    (panel,) = drawn("A", of=found()._replace(forces=dict(found().forces) | {"A": force}))
    assert np.isnan(curve(panel)[0, 85:95]).all()
    assert "90°" not in [text.get_text() for text in panel.texts]


def test_a_force_that_jumps_leaves_a_gap_and_a_steep_one_does_not() -> None:
    x = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 4.1, 5.0])
    values = np.array([0.0, 0.1, 0.2, 5.0, 5.1, 5.2, 5.3, 6.2])
    places, (broken,) = reactions.parted(x, values)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(places)), [3])
    assert np.isnan(broken[3])
    smooth = np.sin(np.linspace(0.0, 6.0, 100))
    assert not np.isnan(reactions.parted(np.linspace(0.0, 6.0, 100), smooth)[0]).any()


def test_the_driving_torque_stands_beside_and_bodies_are_named() -> None:
    axes = reactions.polar(found(), joints=["A"]).axes
    assert axes[0].get_title().startswith("A: crank on rod\n")
    assert axes[-1].get_title().startswith("driving torque at O")
    np.testing.assert_array_equal(curve(axes[-1])[1], found().action)


def test_unknown_joints_are_refused_with_the_nearest() -> None:
    with pytest.raises(SceneError, match=r"joints: found 'guid', expected one of O, A, B, guide; did you mean 'guide'\?"):
        drawn("guid")


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["svg"])
def test_the_same_reactions_give_the_same_file(ending: str, tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.{ending}" for name in ("one", "two")]
    for path in paths:
        reactions.polar(found(), path, ["A"])
    assert paths[0].read_bytes() == paths[1].read_bytes()


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
