"""Newton's and Euler's equations written out by hand for a slider-crank, redundant constraints, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.reactions import reactions, reactions_at
from flywheel.mechanisms.linkages.wrenches import Force
from flywheel.numerics.faults import SceneError
from tests.linkages import forced

OMEGA, ALPHA, G = 20.0, -35.0, 9.81


def spin(angle, at):
    """A point (a, b) of a body turned by an angle: a e^(i angle), as complex numbers."""
    return complex(*at) * np.exp(1j * angle)


def moved(origin, angle, at):
    """Place, velocity, acceleration of a point; origin and angle are such triples themselves."""
    arm = spin(angle[0], at)
    return (
        origin[0] + arm,
        origin[1] + 1j * angle[1] * arm,
        origin[2] + (1j * angle[2] - angle[1] ** 2) * arm,
    )


def moment(arm, force_x, force_y):
    """Coefficients of a force's two parts in an equation of moments."""
    return -arm.imag * force_x + arm.real * force_y


@pytest.mark.parametrize("theta", [0.3, 2.9, 4.4])
def test_slider_crank(theta):
    """Crank r = 0.1, rod 0.35 m: nine equations, eight reactions and the torque; nothing of the toolkit but its data."""
    linkage = forced.slider_crank()
    crank, rod, slider = linkage.links
    r, length = 0.1, 0.35
    sine = -r * np.sin(theta) / length
    beta = np.arcsin(sine)
    beta1 = -r * np.cos(theta) * OMEGA / (length * np.cos(beta))
    beta2 = (r * (OMEGA**2 * np.sin(theta) - ALPHA * np.cos(theta)) / length + beta1**2 * np.sin(beta)) / np.cos(beta)
    turn, sway, still = (theta, OMEGA, ALPHA), (beta, beta1, beta2), (0.0, 0.0, 0.0)
    tip = moved(still, turn, (r, 0.0))
    end = moved(tip, sway, (length, 0.0))
    end = tuple(complex(part.real, 0.0) for part in end)
    g2, g3, g4 = moved(still, turn, crank.com), moved(tip, sway, rod.com), moved(end, still, slider.com)
    push = -500.0

    # unknowns: A (frame on crank), B (crank on rod), C (rod on slider), N, M (frame on slider), T (frame on crank)
    a, b = np.zeros((9, 9)), np.zeros(9)
    ax, ay, bx, by, cx, cy, n, m, t = range(9)
    a[0, [ax, bx]] = 1, -1
    a[1, [ay, by]] = 1, -1
    a[2, [ax, ay]] = -(0 - g2[0]).imag, (0 - g2[0]).real
    a[2, [bx, by]] = (tip[0] - g2[0]).imag, -(tip[0] - g2[0]).real
    a[2, t] = 1
    a[3, [bx, cx]] = 1, -1
    a[4, [by, cy]] = 1, -1
    a[5, [bx, by]] = -(tip[0] - g3[0]).imag, (tip[0] - g3[0]).real
    a[5, [cx, cy]] = (end[0] - g3[0]).imag, -(end[0] - g3[0]).real
    a[6, cx] = 1
    a[7, [cy, n]] = 1, 1
    a[8, [cx, cy]] = -(end[0] - g4[0]).imag, (end[0] - g4[0]).real
    a[8, [n, m]] = (end[0] - g4[0]).real, 1
    b[0], b[1], b[2] = crank.mass * g2[2].real, crank.mass * (g2[2].imag + G), crank.inertia * ALPHA
    b[3], b[4], b[5] = rod.mass * g3[2].real, rod.mass * (g3[2].imag + G), rod.inertia * beta2
    b[6], b[7] = slider.mass * g4[2].real - push, slider.mass * (g4[2].imag + G)
    b[8] = -moment(end[0] - g4[0], push, 0.0)
    by_hand = np.linalg.solve(a, b)

    found = reactions(linkage, [theta], OMEGA, ALPHA, gravity=(0.0, -G), loads=[Force("slider", "o", push)])
    parts = found.components
    mine = [parts[j][c][0] for j in ("pivot", "crank_pin", "slider_pin") for c in "xy"]
    mine += [parts["guide"]["normal"][0], parts["guide"]["moment"][0], found.action[0]]
    np.testing.assert_allclose(mine, by_hand, rtol=0, atol=1e-11 * np.abs(by_hand).max())


def test_a_third_crank_leaves_open_what_the_coupler_shares_among_them():
    """Across each massless crank nothing acts, along it anything: with masses each crank alone gives the force across it."""
    q = np.linspace(1.0, 2.5, 7)
    found = reactions(forced.parallelogram(), q, -12.0, 30.0, gravity=(0.0, -G))
    third = forced.parallelogram().link("third")
    parts = found.components["third_pin"]
    assert np.isnan(parts["x"]).all()
    assert "third_pin.x" in found.undetermined
    direction = np.exp(1j * q)
    centre = complex(*third.com)
    acceleration = (30.0j - 144.0) * centre * direction
    turning = third.inertia * 30.0 + ((centre * direction).conjugate() * third.mass * (acceleration + 1j * G)).imag
    across = -turning / 0.1  # third does it to the coupler, a quarter turn from its line
    np.testing.assert_allclose(np.cos(parts["known_angle"] - q), 0.0, atol=1e-10)
    np.testing.assert_allclose(parts["known"] * np.sin(parts["known_angle"] - q), across, rtol=1e-9)
    assert not np.isnan(found.action).any()
    assert np.isnan(found.resultant("third_pin")).all()


def test_friction_on_what_is_left_open_is_refused():
    linkage = forced.slider_crank(0.1, guides=2, radius=0.01)
    with pytest.raises(SceneError, match=r"guide: found friction that follows the normal.*open"):
        reactions(linkage, [1.0], 10.0)
    assert reactions(linkage, [1.0], 10.0, friction=False).undetermined


def test_a_freedom_that_nothing_drives_is_refused():
    linkage = forced.slider_crank()
    poses = solve(linkage, 0.0, 3.0).poses([1.0])
    free = forced.Linkage(linkage.ground, linkage.links, linkage.joints[:3], "pivot")
    with pytest.raises(SceneError, match="as many driven joints"):
        reactions_at(poses._replace(linkage=free), 1.0)


def test_forces_without_limit_name_the_position():
    """A slider drives the crank through its dead centre: both in line."""
    linkage = forced.slider_crank()
    poses = solve(linkage, 0.0, 3.0).poses([0.0, 1.0])
    driven = forced.slider_crank(driver="guide")
    with pytest.raises(SceneError, match="guide stands at 0 m"):
        reactions_at(poses._replace(linkage=driven), 0.0, inertia=False)
