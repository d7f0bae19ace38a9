"""The named mechanisms as linkages: the solver, which knows no closed form, finds the same motion."""

from __future__ import annotations

from dataclasses import replace
from math import pi, tau
from typing import Any

import numpy as np
import pytest

from flywheel.mechanisms.families import build
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages.positions import Poses, Solution, Track, solve
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import Link, Linkage
from flywheel.scene.scene import Mechanism
from tests.mechanisms.chains import clamp, four_bar, shaper, slider, walked, yoke

SLIDES = {
    "scotch-yoke": {"yoke": "guide"},
    "slider-crank": {"slider": "guide"},
    "four-bar": {},
    "crank-shaper": {"ram": "guide"},
    "toggle-clamp": {"block": "block_guide", "platen": "platen_guide"},
}
PLAIN = {
    "yoke aslant": yoke(2.1),
    "slider": slider(0.1, 0.3),
    "slider, offset below": slider(0.1, 0.2, -0.09),
    "crank-rocker": four_bar(4.0, 1.0, 3.0, 3.5),
    "crank-rocker, crossed": four_bar(4.0, 1.0, 3.0, 3.5, "crossed"),
    "drag-link": four_bar(1.0, 2.0, 2.5, 2.2),
    "drag-link, crossed": four_bar(1.0, 2.0, 2.5, 2.2, "crossed"),
    "shaper": shaper(0.1, 0.4),
    "whitworth": shaper(0.4, 0.1),
    "clamp": clamp(),
    "clamp, crossed, behind": clamp(assembly="crossed-behind"),
    "clamp, short rod": clamp(rod=0.1, stroke=(0.08, 0.2)),
    "clamp backwards": clamp(stroke=(0.19, -0.06)),
}
NEARLY_LOCKED = {
    "slider, offset": slider(0.5, 1.0, 0.499999),
    "crank-rocker": four_bar(4.0, 1.0, 2.000001, 3.0),
    "drag-link": four_bar(1.0, 2.0, 1.000001, 2.0),
    "shaper": shaper(0.4, 0.401),
    "clamp": clamp(stroke=(-0.2222, 0.2222)),
}


def slowly(name: str, mechanism: Mechanism, twin: str) -> Any:
    """A case by its name; that of a four-bar beside another is not for the default run."""
    return pytest.param(mechanism, id=name, marks=[pytest.mark.slow] if name == twin else [])


def ends(mechanism: Mechanism) -> tuple[float, float]:
    low, high = sorted(mechanism.stroke or (0.0, tau))
    return low, high


def followed(mechanism: Mechanism, q: np.ndarray) -> tuple[Solution, Poses]:
    solution = solve(linkage_of(mechanism), *ends(mechanism))
    return solution, solution.poses(q)


def positions(mechanism: Mechanism) -> np.ndarray:
    return np.linspace(*ends(mechanism), 37)


def exactly(mechanism: Mechanism, q: np.ndarray) -> dict[str, Track]:
    """The closed form's ports, and the gains of all its velocities with their slopes."""
    family = build(mechanism)
    position, gains = family.position(q, np), walked(family, q)
    tracks = {name: Track(q, gain + 0 * q, slope + 0 * q) for name, (gain, slope) in gains.items()}
    return tracks | {n: tracks[port.velocity]._replace(value=port.position(position)) for n, port in family.ports.items()}


def motion(mechanism: Mechanism, solution: Solution, poses: Poses) -> dict[str, Track]:
    """The solver's motion by the names of the closed form: ports, and velocities of the centres of mass."""
    found = {}
    for name in build(mechanism).ports:
        slide = SLIDES[mechanism.type].get(name)
        found[name] = solution.coordinate(slide, poses) if slide else poses.angle(name)
    for link in linkage_of(mechanism).links:
        for axis, name in enumerate(("x", "y")):
            found[f"{link.name}.com.{name}"] = Track(*(part[axis] for part in poses.centre(link.name)))
    return found


def gap(found: Track, exact: Track, turning: bool) -> list[float]:
    """Greatest difference of value, g and g', each as a share of the greatest there is, or of 1."""
    first = found.value - exact.value
    first = (first + pi) % tau - pi if turning else first
    parts = (first, found.rate - exact.rate, found.slope - exact.slope)
    return [float(np.max(np.abs(part)) / max(1.0, np.max(np.abs(of)))) for part, of in zip(parts, exact, strict=True)]


@pytest.mark.parametrize("mechanism", [slowly(name, m, "drag-link, crossed") for name, m in PLAIN.items()])
def test_the_solver_has_the_motion_and_the_inertia_of_the_closed_form(mechanism: Mechanism) -> None:
    family, q = build(mechanism), positions(mechanism)
    solution, poses = followed(mechanism, q)
    exact, found = exactly(mechanism, q), motion(mechanism, solution, poses)
    for name in family.ports:
        assert max(gap(found[name], exact[name], name not in SLIDES[mechanism.type])) <= 1e-12, name
    for name in set(exact) & {name for name in found if ".com." in name}:
        assert max(gap(found[name]._replace(value=q), exact[name], False)) <= 1e-12, name
    inertia: Any = sum(mass.value * exact[mass.velocity].rate ** 2 for mass in family.masses)
    expected = np.zeros_like(q)
    for link in linkage_of(mechanism).links:
        expected += link.mass * (poses.centre(link.name).rate ** 2).sum(axis=0)
        expected += link.inertia * poses.angle(link.name).rate ** 2
    assert np.max(np.abs(inertia - expected)) <= 1e-12 * np.max(expected)
    assert solution.mobility == (1, 1, ())


@pytest.mark.parametrize("mechanism", [slowly(name, m, "drag-link") for name, m in NEARLY_LOCKED.items()])
@pytest.mark.slow
def test_close_to_a_lock_they_agree_as_far_as_lengths_are_known(mechanism: Mechanism) -> None:
    """To 1e-12, or to what one rounding of each length makes of g and g' where that is more."""
    family, q = build(mechanism), positions(mechanism)
    exact, found = exactly(mechanism, q), motion(mechanism, *followed(mechanism, q))
    for name in family.ports:
        turning = name not in SLIDES[mechanism.type]
        known = np.zeros(3)
        for length, value in mechanism.geometry.items():
            moved = replace(mechanism, geometry={**mechanism.geometry, length: value * (1 + 2.0**-52)})
            known += gap(exactly(moved, q)[name], exact[name], turning)
        assert np.all(np.array(gap(found[name], exact[name], turning)) <= np.maximum(1e-12, 4 * known)), name


@pytest.mark.parametrize("mechanism", PLAIN.values(), ids=PLAIN.keys())
def test_joints_and_bodies_are_named_as_documented(mechanism: Mechanism) -> None:
    linkage = linkage_of(mechanism)
    rows = [line.strip() for line in (linkage_of.__doc__ or "").splitlines()]
    row = next(line for line in rows if line.startswith(f"| {mechanism.type} |"))
    _, _, bodies, joints, _ = (cell.strip() for cell in row.split("|"))
    assert bodies.split(", ") == list(linkage.names[1:])
    assert joints.replace(" (slide)", "").split(", ") == [joint.name for joint in linkage.joints]
    assert joints.count("(slide)") == sum(joint.kind == "slide" for joint in linkage.joints)
    assert linkage.driver == linkage.joints[0].name
    for joint in linkage.joints:
        assert joint.first_at.name == joint.second_at.name == joint.name


def test_slides_inside_have_the_coordinates_of_the_field() -> None:
    for mechanism in (yoke(2.1), shaper(0.1, 0.4), shaper(0.4, 0.1)):
        q = positions(mechanism)
        solution, poses = followed(mechanism, q)
        position = build(mechanism).position(q, np)
        if mechanism.type == "scotch-yoke":
            expected = {"slot": 0.5 * np.sin(q - 2.1)}
        else:
            expected = {"rocker_slot": position.distance, "ram_slot": 0.8 * position.rocker_cos}
        for joint, value in expected.items():
            assert np.max(np.abs(solution.coordinate(joint, poses).value - value)) <= 1e-14


def test_the_driver_starts_where_the_stroke_does() -> None:
    assert linkage_of(clamp()).start == -0.06
    assert linkage_of(clamp(stroke=(0.19, -0.06))).start == 0.19
    assert linkage_of(clamp()).sliding
    assert not linkage_of(slider(0.1, 0.3)).sliding


def test_a_linkage_is_given_back_as_it_is() -> None:
    linkage = Linkage(Link("frame"), (), (), "pivot")
    assert linkage_of(Mechanism("linkage", "m", linkage=linkage)) is linkage


@pytest.mark.parametrize("kind", ["law", "gearbox"])
def test_what_has_no_joints_is_refused(kind: str) -> None:
    with pytest.raises(SceneError, match=rf"^mechanism\[1\].type: found a mechanism of type {kind}, expected one of sc"):
        linkage_of(Mechanism(kind, "m", path="mechanism[1]"))


def test_a_mechanism_that_locks_is_refused_with_its_length() -> None:
    with pytest.raises(SceneError, match=r"mechanism.rod.length: .* locks at 30, 150, 210 and 330 deg"):
        linkage_of(slider(0.5, 0.25))
