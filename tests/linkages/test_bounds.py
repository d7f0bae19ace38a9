"""Bounds of positions over stretches, and of a cam's lift near every angle: they hold, and are not far above the truth."""

from __future__ import annotations

from dataclasses import replace
from math import tau

import numpy as np
import pytest

from flywheel.mechanisms.law import followed
from flywheel.mechanisms.linkage import enclosed
from flywheel.mechanisms.linkages.equations import WINDOW, lift_at, lift_bound
from flywheel.mechanisms.linkages.positions import solve
from flywheel.numerics.expressions import parse
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import Lift, Linkage
from flywheel.scene.scene import Output
from tests.limits import sample
from tests.linkages.linkages import CASES, cam_rocker, slider_crank, whole


def lift(text: str) -> Lift:
    """A lift as a scene would have it, with breakpoints where it is narrow."""
    return Lift(followed(Output("lift", False, parse(text), 0.0), tau, {}, "lift"), tau)


def with_lift(text: str) -> Linkage:
    base = cam_rocker()
    return replace(base, couplings=(base.couplings[0]._replace(lift=lift(text)),))


def bump(height: float, width: float) -> str:
    return f"0.02*(1 - cos(phi)) + {height}*exp(-((phi - 2.0005)/{width})**2)"


@pytest.mark.parametrize("text", ["0.02*(1 - cos(2*phi))", bump(1e-3, 0.05), bump(1e-4, 1e-3)])
def test_bounds_hold_and_are_not_absurd(text: str) -> None:
    law = lift(text)
    angle = np.concatenate((np.linspace(0.0, tau, 4001), 2.0005 + np.linspace(-4e-3, 4e-3, 2001)))
    second = np.abs(lift_at(law, angle)[2])
    h = 1e-7
    third = np.abs(lift_at(law, angle + h)[2] - lift_at(law, angle - h)[2]) / (2 * h)
    for order, values in ((2, second), (3, third)):
        limit = lift_bound(law, angle, order)
        assert (values <= limit * (1 + 1e-6) + 1e-6 * values.max()).all()
        assert limit.max() < 40 * values.max()
    far = lift_bound(law, np.array([5.0]), 2)[0]
    assert far < 1.0


def test_a_bound_looks_as_far_as_the_window() -> None:
    law = lift(bump(1e-4, 1e-3))
    near, beyond = lift_bound(law, np.array([2.0005 - 0.9 * WINDOW, 2.0005 - 2 * WINDOW]), 2)
    assert near > 50.0 > beyond


@pytest.mark.parametrize("width", sample([2e-4, 1e-2], 2))
def test_enclosures_hold_on_a_narrow_bump(width: float) -> None:
    solution = solve(with_lift(bump(width / 50, width)), 0.0, 2.2)
    low = 2.0005 + width * np.linspace(-4.0, 4.0, 21)
    found = enclosed(solution, low, low + width / 50)
    for share in (0.0, 0.3, 1.0):
        moved = solution.movement(low + share * width / 50)
        for (middle, reach), value in zip(found, moved, strict=True):
            assert (np.abs(value - middle) <= reach).all()


@pytest.mark.slow
def test_a_bump_that_the_bar_cannot_follow_locks() -> None:
    with pytest.raises(SceneError, match=r"locks with the driver O at 11[34]\."):
        solve(with_lift(bump(0.3, 5e-3)), 0.0, 2.2)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("width", sample([1e-1, 1e-2, 1e-4], 2))
def test_holds_every_position_of_the_stretch(case: str, width: float) -> None:
    solution = whole(case)
    low = np.linspace(0.0, tau - width, 20)
    found = enclosed(solution, low, low + width)
    for share in (0.0, 0.3, 1.0):
        moved = solution.movement(low + share * width)
        for (middle, reach), value in zip(found, moved, strict=True):
            assert (np.abs(value - middle) <= reach).all()


@pytest.mark.parametrize("case", CASES)
def test_narrow_stretches_are_tight(case: str) -> None:
    solution = whole(case)
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
