"""Variables of a linkage over its turns, and positions that are kept."""

from __future__ import annotations

from math import tau

import numpy as np

from flywheel.mechanisms.linkage import Angle, LinkagePosition, Positions, angle_of, are_slides
from flywheel.mechanisms.linkages.positions import solve
from tests.linkages.linkages import geared_five_bar, slider_crank


def positions() -> Positions:
    return Positions(solve(slider_crank(), 0.0, tau), tau, np.array([tau, 0.0, 0.0]))


def test_the_last_single_positions_are_kept_and_arrays_are_not() -> None:
    at = positions()
    first, other = at(0.3, np, 0.5), at(0.4, np, 0.5)
    assert at(0.3, np, 0.5) is first
    assert at(0.4, np, 0.5) is other
    assert at(0.3, np, 7.0) is not first
    for k in range(4):
        at(1.0 + k, np, 0.5)
    assert at(0.3, np, 0.5) is not first
    table = np.array([0.3])
    assert at(table, np) is not at(table, np)


def test_psi_is_brought_into_the_anchor_s_turn() -> None:
    at = positions()
    near, far = (at(q, np, anchor) for q, anchor in ((0.3, 0.5), (0.3 + 3 * tau, 0.5 + 3 * tau)))
    assert abs(float(near.kept(1).value) - float(far.kept(1).value)) < 1e-14
    assert abs(float(far.kept(0).value) - 0.3 - 3 * tau) < 1e-13


def test_an_angle_adds_its_variables() -> None:
    solution = solve(geared_five_bar(), 0.0, tau)
    p = LinkagePosition(solution, None, np.zeros(len(solution.equations.loops.names)), np.array([0.7]), np)
    form = solution.equations.loops.angles[2]
    angle = angle_of(*form)
    poses = solution.poses([0.7])
    assert float(p.angle(angle)[0]) == float(poses.value[2, 2, 0])
    assert float(p.turning(angle)[0]) == float(poses.rate[2, 2, 0])
    assert p.angle(Angle((), 0.25)) == 0.25


def test_which_variables_are_displacements() -> None:
    assert are_slides(solve(slider_crank(), 0.0, tau)) == [False, False, True]
