"""Instant centres: by construction with 30 digits, by Aronhold and Kennedy, near infinity, and velocities by them."""

from itertools import combinations
from math import pi

import mpmath as mp
import numpy as np
import pytest

from flywheel.mechanisms.linkages.instant_centres import ANYWHERE, FINITE, INFINITE, centres_of, velocity
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import FRAME
from tests.linkages.linkages import CASES, four_bar_reference, slider_crank, slider_crank_reference, solve, whole

ANGLES = np.linspace(0.13, 6.1, 9)


def crossing(a, b, c, d):
    """Where the line through a and b meets that through c and d."""
    share = mp.im(mp.conj(d - c) * (c - a)) / mp.im(mp.conj(d - c) * (b - a))
    return a + share * (b - a)


def off(centre, k, true):
    return abs(mp.mpc(*map(float, centre.place[:, k])) - true)


def test_those_of_a_four_bar_are_where_its_bars_meet():
    found = centres_of(whole("four-bar").poses(ANGLES))
    for k, phi in enumerate(map(mp.mpf, ANGLES.tolist())):
        angles = four_bar_reference(phi)
        a, b, d = mp.mpf("0.1") * mp.expj(phi), mp.mpf("0.4") + mp.mpf("0.3") * mp.expj(angles["rocker"]), mp.mpf("0.4")
        for pair, true in (((FRAME, "coupler"), crossing(0, a, d, b)), (("crank", "rocker"), crossing(0, d, a, b))):
            centre = found[pair]
            assert not centre.permanent
            assert centre.kind[k] == FINITE
            assert off(centre, k, true) <= centre.error[k] < 1e-9 * (1 + abs(true)) ** 2


def test_far_away_the_error_is_told():
    """The rod's is on the crank's line, above the slider: it goes to infinity as the crank comes to stand across."""
    away = np.concatenate([[s * 10.0**-k for s in (-1, 1)] for k in range(1, 15)])
    found = centres_of(whole("slider-crank").poses(pi / 2 + away))[FRAME, "rod"]
    seen = 0
    for k, phi in enumerate((pi / 2 + away).tolist()):
        true = slider_crank_reference(mp.mpf(phi))["guide"] * mp.mpc(1, mp.tan(mp.mpf(phi)))
        if found.kind[k] == FINITE:
            assert off(found, k, true) <= found.error[k] < 1e-12 * abs(true) ** 2 * 100
            seen += 1
        else:
            assert abs(true) > 1e11
            assert np.isnan(found.place[:, k]).all()
    assert 24 <= seen <= 27
    assert found.error[20] > 1e3 * found.error[10]


def test_far_away_a_rate_that_is_a_small_difference_counts():
    """The coupler of a four-bar comes to a translation, its centre to infinity, where crank and rocker are parallel."""
    solution = whole("four-bar")
    low, high = 1.7, 2.3
    for _ in range(60):
        middle = 0.5 * (low + high)
        signs = np.sign(solution.poses([low, middle]).angle("coupler").rate)
        low, high = (low, middle) if signs[0] != signs[1] else (middle, high)
    phi = low + 10.0 ** -np.arange(2.0, 13.0)
    found = centres_of(solution.poses(phi))[FRAME, "coupler"]
    assert np.count_nonzero(found.kind == FINITE) >= 10
    for k in np.flatnonzero(found.kind == FINITE):
        with mp.workdps(30):
            angle = four_bar_reference(mp.mpf(float(phi[k])))["rocker"]
            b, d = mp.mpf("0.4") + mp.mpf("0.3") * mp.expj(angle), mp.mpf("0.4")
            true = crossing(mp.mpf(0), mp.expj(mp.mpf(float(phi[k]))), d, b)
            assert off(found, k, true) <= found.error[k] < 1e-11 * abs(true) ** 2


def test_at_infinity_there_is_the_direction_alone():
    inline = slider_crank(e=0.0)
    poses = solve(inline, 0.0, 7.0).poses([pi / 2, 1.0])
    found = centres_of(poses)
    rod, guide = found[FRAME, "rod"], found[FRAME, "slider"]
    assert rod.kind.tolist() == [INFINITE, FINITE]
    assert not rod.permanent
    assert guide.kind.tolist() == [INFINITE] * 2
    assert guide.permanent
    assert abs(rod.direction[0]) == pytest.approx(pi / 2, abs=1e-12)
    assert np.isnan(rod.direction[1])
    assert found["rod", "slider"].permanent
    assert found["rod", "slider"].kind[0] == FINITE


@pytest.mark.parametrize("case", CASES)
def test_three_bodies_have_three_centres_on_a_line(case):
    linkage = CASES[case][0]
    found = centres_of(whole(case).poses(ANGLES))
    tried = 0
    for triple in combinations(linkage.names, 3):
        centres = [found[pair] for pair in combinations(triple, 2)]
        finite = np.all([centre.kind == FINITE for centre in centres], axis=0)
        (x1, y1), (x2, y2), (x3, y3) = (centre.place[:, finite] for centre in centres)
        area = (x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)
        reach = np.hypot(x2 - x1, y2 - y1) + np.hypot(x3 - x1, y3 - y1)
        error = np.sum([centre.error[finite] for centre in centres], axis=0)
        assert (np.abs(area) <= 2 * reach * error + 1e-300).all()
        tried += int(finite.sum())
    assert tried >= 9


@pytest.mark.parametrize("case", CASES)
def test_they_give_the_velocities_that_influence_coefficients_give(case):
    linkage, poses = CASES[case][0], whole(case).poses(ANGLES)
    found = centres_of(poses)
    for link in linkage.links:
        centre = found[FRAME, link.name]
        for point in link.points:
            by_centre, error = velocity(poses, link.name, point, centre)
            assert (np.abs(by_centre - poses.point(link.name, point).rate) <= error + 1e-16).all()
            assert error.max() < 1e-10


def test_the_sliders_speed_is_omega_times_the_distance_of_the_shared_point():
    """And, as the source has it, omega r PB/PA with the rod's centre P."""
    poses = whole("slider-crank").poses(ANGLES)
    found = centres_of(poses)
    slider = np.abs(poses.point("slider", (0.0, 0.0)).rate[0])
    np.testing.assert_allclose(np.hypot(*found["crank", "slider"].place), slider, rtol=1e-12)
    pin, end, centre = poses.point("rod", (0, 0)).value, poses.point("rod", (0.3, 0)).value, found[FRAME, "rod"].place
    np.testing.assert_allclose(0.1 * np.hypot(*(end - centre)) / np.hypot(*(pin - centre)), slider, rtol=1e-12)


def test_gears_touch_in_their_pitch_point():
    """Between the axes, at their distance shared out as the radii."""
    found = centres_of(whole("geared five-bar").poses(ANGLES))["crank", "second"]
    np.testing.assert_allclose(found.place, np.outer([0.2, 0.0], np.ones(9)), atol=1e-14)


def test_a_follower_that_dwells_has_no_motion_of_its_own():
    found = centres_of(whole("cam and lever").poses([0.0]))
    assert found[FRAME, "lever"].kind[0] == FINITE
    assert found[FRAME, "lever"].permanent
    assert found[FRAME, "bar"].kind[0] == ANYWHERE
    assert np.isnan(found[FRAME, "bar"].error[0])
    still, error = velocity(whole("cam and lever").poses([0.0]), "bar", (0.1, 0.0), found[FRAME, "bar"])
    assert np.abs(still).max() == 0.0
    assert error[0] < 1e-12


def test_what_is_no_pose_is_refused():
    with pytest.raises(SceneError, match="expected Poses"):
        centres_of("poses")
