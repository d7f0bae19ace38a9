"""Positions and influence coefficients of linkages of every kind against 30-digit references."""

from __future__ import annotations

from dataclasses import replace
from math import pi, tau

import mpmath as mp
import numpy as np
import pytest

from flywheel.mechanisms.linkages.equations import correction
from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import FIXED, FRAME, Joint, Link
from tests.linkages.linkages import CASES, Reference, four_bar, six_bar, slider_crank, whole

ANGLES = (0.0, 1.1, 3.0, 4.6, tau)
Q = np.linspace(0.2, 6.0, 7)


def found_at(solution: Solution, name: str, q: float) -> tuple[float, float, float]:
    """A body's angle or a slide's displacement with its two derivatives."""
    poses = solution.poses(q)
    track = poses.angle(name) if name in solution.linkage.names else solution.coordinate(name, poses)
    return float(track.value[0]), float(track.rate[0]), float(track.slope[0])


def derivatives(reference: Reference, name: str, q: float) -> list[float]:
    """Value and derivatives of a reference, by differences at 60 digits."""
    with mp.workdps(60):
        h, x = mp.mpf(10) ** -15, mp.mpf(q)
        low, mid, high = (reference(x + k * h)[name] for k in (-1, 0, 1))
        return [float(v) for v in (mid, (high - low) / (2 * h), (high - 2 * mid + low) / h**2)]


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_the_reference(case: str) -> None:
    linkage, reference = CASES[case]
    solution = solve(linkage, 0.0, tau)
    assert solution.mobility == (1, 1, ())
    for name in reference(mp.mpf(1)):
        expected = [derivatives(reference, name, q) for q in ANGLES]
        scale = max(abs(value) for triple in expected for value in triple[1:])
        for q, (value, rate, slope) in zip(ANGLES, expected, strict=True):
            found = found_at(solution, name, q)
            gap = found[0] - value
            if name in linkage.names:
                gap = (gap + pi) % tau - pi
            assert abs(gap) < 1e-13 * max(scale, 1.0), (name, q)
            assert abs(found[1] - rate) < 1e-12 * scale, (name, q)
            assert abs(found[2] - slope) < 1e-12 * scale, (name, q)


@pytest.mark.parametrize("case", CASES)
def test_poses_close_every_joint(case: str) -> None:
    linkage = CASES[case][0]
    q = np.linspace(0.0, tau, 57)
    poses = solve(linkage, 0.0, tau).poses(q)
    for joint in linkage.joints:
        if joint.kind == "pin":
            ends = poses.point(joint.first, joint.first_at), poses.point(joint.second, joint.second_at)
            for a, b in zip(*ends, strict=True):
                np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)


@pytest.mark.parametrize("case", CASES)
def test_newton_converges_quadratically(case: str) -> None:
    solution = whole(case)
    z = solution.movement(np.array([0.3, 2.0, 4.0])).z
    z[:, 1:] += 0.02
    step = 0.02
    for _ in range(5):
        move = correction(solution.equations, z)
        z[:, 1:] += move
        before, step = step, float(np.abs(move).max())
        assert step <= 30 * before**2 + 1e-14 or before == 0.02
    assert step < 1e-9


def test_driver_that_slides() -> None:
    base = slider_crank(e=0.0)
    links = tuple(link._replace(guess=g) for link, g in zip(base.links, (0.5, None, None), strict=True))
    pushed = replace(base, links=links, driver="guide", start=0.35)
    solution = solve(pushed, 0.25, 0.39)
    x = np.array([0.25, 0.3, 0.39])
    crank = solution.poses(x).angle("crank")
    cosine = (x**2 + 0.1**2 - 0.3**2) / (2 * x * 0.1)
    np.testing.assert_allclose(np.cos(crank.value), cosine, atol=1e-13)
    slope = (1 / 0.1 - (x**2 + 0.1**2 - 0.3**2) / (2 * x**2 * 0.1)) / -np.sin(crank.value)
    np.testing.assert_allclose(crank.rate, slope, rtol=1e-12)
    assert solution.linkage.sliding


def test_positions_outside_the_range_are_refused() -> None:
    solution = solve(four_bar(), 0.0, 1.0)
    with pytest.raises(SceneError, match=r"114\.59.* deg, expected one from 0 deg to 57\.29"):
        solution.poses([0.5, 2.0])


def test_start_may_lie_anywhere_in_the_range() -> None:
    base = four_bar()
    late = replace(base, start=2.5)
    q = np.linspace(0.0, tau, 9)
    early, other = (solve(linkage, 0.0, tau).poses(q) for linkage in (base, late))
    np.testing.assert_allclose(np.exp(1j * early.value[:, 2]), np.exp(1j * other.value[:, 2]), atol=1e-13)


@pytest.mark.parametrize("ratio", [0.3, 0.999999])
def test_slider_crank_close_to_its_lock(ratio: float) -> None:
    solution = solve(slider_crank(0.1, 0.1 / ratio, 0.0), 0.0, tau)
    with mp.workdps(40):
        for q in (0.3, pi / 2 - 1e-3, pi / 2, 4.7):
            r, length, x = mp.mpf(0.1), mp.mpf(0.1 / ratio), mp.mpf(q)
            run = mp.sqrt(length**2 - (r * mp.sin(x)) ** 2)
            value = r * mp.cos(x) + run
            rate = -r * mp.sin(x) - r**2 * mp.sin(x) * mp.cos(x) / run
            found = found_at(solution, "guide", q)
            closeness = float(length / run)
            assert abs(found[0] - float(value)) < 1e-16 * 20 * closeness
            assert abs(found[1] - float(rate)) < 1e-16 * 40 * closeness**2 * 0.1 + 1e-16


def test_positions_that_are_not_reached_are_told() -> None:
    base = slider_crank(0.1, 0.3, 0.0)
    links = tuple(link._replace(guess=0.5 if link.name == "crank" else link.guess) for link in base.links)
    pushed = replace(base, links=links, driver="guide", start=0.35)
    with pytest.raises(SceneError, match=r"a position that Newton's iteration does not reach, 0\.41 m"):
        solve(pushed, 0.3, 0.3999999).movement(np.array([0.41]))


def test_a_start_beside_the_range_s_end() -> None:
    base = four_bar()
    beside = replace(base, start=1e-15)
    poses = solve(beside, 0.0, 1.0).poses([-5e-10, 0.0])
    assert np.abs(poses.value).max() < 10.0


def test_arrays_that_are_kept_cannot_be_changed() -> None:
    solution = solve(four_bar(), 0.0, tau)
    with pytest.raises(ValueError, match="read-only"):
        solution.trace.z[0, 0] = 1.0
    q = np.array([0.5])
    poses = solution.poses(q)
    q[0] = 9.0
    assert poses.q[0] == 0.5


def test_a_crank_s_point_goes_round() -> None:
    track = solve(four_bar(), 0.0, tau).poses(Q).point("crank", (0.1, 0.05))
    point = (0.1 + 0.05j) * np.exp(1j * Q)
    for found, expected in zip(track, (point, 1j * point, -point), strict=True):
        np.testing.assert_allclose(found[0] + 1j * found[1], expected, atol=1e-15)


def test_derivatives_of_a_floating_point() -> None:
    solution, h = solve(six_bar(), 0.0, tau), 1e-4
    low, mid, high = (solution.poses(Q + k * h).point("link", (0.1, 0.2)) for k in (-1, 0, 1))
    np.testing.assert_allclose((high.value - low.value) / (2 * h), mid.rate, atol=1e-6)
    np.testing.assert_allclose((high.rate - low.rate) / (2 * h), mid.slope, atol=1e-6)


def test_the_centre_of_mass_is_a_point_of_its_body() -> None:
    base = four_bar()
    linkage = replace(base, links=tuple(link._replace(com=(0.07, -0.02)) for link in base.links))
    poses = solve(linkage, 0.0, tau).poses(Q)
    np.testing.assert_array_equal(poses.centre("coupler").slope, poses.point("coupler", (0.07, -0.02)).slope)


def test_a_body_that_holds_the_frame_at_an_angle_is_turned_against_it() -> None:
    base = slider_crank()
    weld = Joint("weld", FIXED, "stand", FRAME, base.ground.points[0], base.ground.points[0], angle=0.3)
    held = replace(base, links=(*base.links, Link("stand", base.ground.points)), joints=(weld, *base.joints))
    poses, plain = (solve(linkage, 0.0, 1.0).poses([0.7]) for linkage in (held, base))
    np.testing.assert_allclose(poses.angle("stand").value, -0.3, atol=1e-15)
    np.testing.assert_allclose(poses.angle("rod").value, plain.angle("rod").value, atol=1e-14)
