"""Points and centres of mass from poses, with their derivatives."""

from __future__ import annotations

from dataclasses import replace
from math import tau

import numpy as np

from flywheel.mechanisms.linkages.positions import solve
from tests.linkages.linkages import four_bar, six_bar

Q = np.linspace(0.2, 6.0, 7)


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
