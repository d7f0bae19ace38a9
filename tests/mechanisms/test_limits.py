"""Breakpoints close in on complex singularities so that order-16 cells follow them."""

from __future__ import annotations

from itertools import pairwise
from math import pi, tau

import numpy as np
import pytest

from flywheel.mechanisms.families import build, graded, within_turn
from flywheel.scene.scene import Mechanism


@pytest.mark.parametrize("distance", [0.4, 0.1, 1e-3, 1e-6])
def test_graded_cells_follow_a_pole_to_1e_8(distance: float) -> None:
    edges = np.array([-1.0, *graded(0.0, distance, reach=1.0), 1.0])
    nodes = np.cos((2 * np.arange(17) + 1) * pi / 34)
    for a, b in pairwise(edges):
        half, middle = (b - a) / 2, (a + b) / 2
        fitted = np.polynomial.chebyshev.chebfit(nodes, distance / (middle + half * nodes - 1j * distance), 16)
        probe = np.linspace(-1.0, 1.0, 101)
        error = np.polynomial.chebyshev.chebval(probe, fitted) - distance / (middle + half * probe - 1j * distance)
        assert np.max(np.abs(error)) < 1e-8


def test_far_singularities_need_no_breakpoint() -> None:
    assert graded(0.0, 0.7) == []
    assert build(Mechanism("slider-crank", "m", geometry={"crank.length": 0.25, "rod.length": 1.0})).breakpoints == ()


@pytest.mark.parametrize(
    ("kind", "geometry", "centres"),
    [
        ("slider-crank", {"crank.length": 0.95, "rod.length": 1.0}, [pi / 2, 3 * pi / 2]),
        ("slider-crank", {"crank.length": 0.5, "rod.length": 1.0, "slider.offset": 0.49}, [3 * pi / 2]),
        ("slider-crank", {"crank.length": 0.5, "rod.length": 1.0, "slider.offset": -0.49}, [pi / 2]),
        ("crank-shaper", {"crank.length": 0.5, "frame.length": 0.51, "rocker.length": 1.0}, [pi]),
        (
            "four-bar",
            {"ground.length": 4.0, "crank.length": 1.0, "coupler.length": 2.01, "rocker.length": 3.0},
            [pi],
        ),
        (
            "four-bar",
            {"ground.length": 4.0, "crank.length": 1.0, "coupler.length": 5.99, "rocker.length": 3.0},
            [0.0],
        ),
    ],
)
def test_breakpoints_stand_about_the_near_lock(kind: str, geometry: dict[str, float], centres: list[float]) -> None:
    found = np.array(build(Mechanism(kind, "m", geometry=geometry)).breakpoints)
    assert np.all((found >= 0.0) & (found < tau) & (np.diff(found, append=7.0) > 0.0))
    assert {c for c in (0.0, pi / 2, pi, 3 * pi / 2) if np.any(np.isclose(found, c))} == set(centres)
    assert all(min(abs((angle - c + pi) % tau - pi) for c in centres) < 1.0 for angle in found)


def test_a_hair_below_zero_stays_within_the_turn() -> None:
    assert within_turn([-1e-20]) == (0.0,)
