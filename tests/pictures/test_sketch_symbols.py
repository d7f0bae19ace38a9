"""Outlines: they have the sizes that their names promise."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.pictures import sketch


def area(outline: sketch.Array) -> float:
    """Area inside a closed outline, positive counter-clockwise."""
    x, y = outline
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def test_a_bar_is_a_strip_with_round_ends() -> None:
    bar = sketch.rounded(np.array([[0.0, 3.0], [0.0, 4.0]]), 0.5)
    assert area(bar) == pytest.approx(5.0 * 1.0 + np.pi * 0.25, rel=1e-3)


def test_a_plate_is_its_hull_a_radius_wider() -> None:
    corners = np.array([[0.0, 4.0, 0.0, 1.0], [0.0, 0.0, 3.0, 0.5]])
    plate = sketch.rounded(corners, 0.1)
    assert area(plate) == pytest.approx(6.0 + 12.0 * 0.1 + np.pi * 0.01, rel=1e-3)


def test_a_slot_is_as_long_as_its_pin_goes() -> None:
    slot = sketch.slot(-1.0, 2.0, 0.25)
    assert slot.min(axis=1) == pytest.approx([-1.25, -0.25], abs=1e-3)
    assert slot.max(axis=1) == pytest.approx([2.25, 0.25], abs=1e-3)
    assert area(slot) == pytest.approx(3.0 * 0.5 + np.pi / 16, rel=1e-3)


def test_ground_is_hatched_below() -> None:
    ground = sketch.ground(-1.0, 1.0, 0.2)
    assert np.nanmax(ground[1]) == 0.0
    assert np.nanmin(ground[1]) < 0.0
    assert np.nanmax(np.abs(ground[0])) <= 1.0 + 0.2


def test_round_arrows_show_the_sense() -> None:
    left, right = sketch.round_arrow(1.0, 0.3, 1), sketch.round_arrow(1.0, 0.3, -1)
    assert left[0, 0] > 0.0 > left[0, -2]
    assert right[0, 0] < 0.0 < right[0, -2]
