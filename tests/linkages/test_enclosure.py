"""Enclosures hold what they enclose, and tighten as their stretches narrow."""

from __future__ import annotations

from math import tau

import numpy as np
import pytest

from flywheel.mechanisms.linkage import enclosed
from flywheel.mechanisms.linkages.positions import solve
from tests.linkages.linkages import CASES, slider_crank


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("width", [1e-1, 1e-2, 1e-4])
def test_holds_every_position_of_the_stretch(case: str, width: float) -> None:
    solution = solve(CASES[case][0], 0.0, tau)
    low = np.linspace(0.0, tau - width, 40)
    found = enclosed(solution, low, low + width)
    for share in np.linspace(0.0, 1.0, 7):
        moved = solution.movement(low + share * width)
        for (middle, reach), value in zip(found, moved, strict=True):
            assert (np.abs(value - middle) <= reach).all()


@pytest.mark.parametrize("case", CASES)
def test_narrow_stretches_are_tight(case: str) -> None:
    solution = solve(CASES[case][0], 0.0, tau)
    low = np.linspace(0.0, tau - 1e-6, 60)
    (_, z_reach), _, (slope, slope_reach) = enclosed(solution, low, low + 1e-6)
    scale = np.abs(slope).max()
    assert np.isfinite(slope_reach).all()
    assert z_reach.max() < 1e-5
    assert slope_reach.max() < 1e-3 * max(scale, 1.0) * (50 if "cam" in case else 1)


def test_too_wide_a_stretch_is_left_open() -> None:
    solution = solve(slider_crank(0.1, 0.1001, 0.0), 0.0, tau)
    (_, reach), *_ = enclosed(solution, np.array([1.0]), np.array([2.0]))
    assert np.isinf(reach[:, 1:]).all()
    assert reach[0, 0] == pytest.approx(0.5)
