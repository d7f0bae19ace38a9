"""Places of names: clear of lines and of each other, near to what they name, in the picture."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from flywheel.pictures.figures import Array, along, settled

BOUNDS = np.array([0.0, 0.0, 400.0, 300.0])


def boxes(centres: Array, sizes: Array) -> list[tuple[Array, Array]]:
    return [(c - 0.5 * s, c + 0.5 * s) for c, s in zip(centres, sizes, strict=True)]


def test_names_at_one_place_do_not_overlap() -> None:
    anchors, sizes = np.full((6, 2), 150.0), np.tile([40.0, 12.0], (6, 1))
    centres = settled(anchors, sizes, np.zeros((0, 2)), BOUNDS)
    for (low, high), (other_low, other_high) in combinations(boxes(centres, sizes), 2):
        assert (low >= other_high).any() or (other_low >= high).any()


def test_names_keep_clear_of_lines() -> None:
    cross = np.concatenate(
        [along(np.array([[0.0, 400.0], [150.0, 150.0]]), 2.0), along(np.array([[200, 200], [0, 300]]), 2.0)]
    )
    sizes = np.array([[30.0, 10.0]])
    (box,) = boxes(settled(np.array([[200.0, 150.0]]), sizes, cross, BOUNDS), sizes)
    assert not ((cross > box[0]) & (cross < box[1])).all(axis=1).any()


@pytest.mark.parametrize("corner", [(0.0, 0.0), (400.0, 0.0), (0.0, 300.0), (400.0, 300.0)])
def test_names_stay_in_the_picture(corner: tuple[float, float]) -> None:
    sizes = np.array([[60.0, 12.0]])
    (box,) = boxes(settled(np.array([corner]), sizes, np.zeros((0, 2)), BOUNDS), sizes)
    assert (box[0] >= BOUNDS[:2]).all()
    assert (box[1] <= BOUNDS[2:]).all()


@pytest.mark.parametrize("way", [(1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 0.0)])
def test_names_go_where_they_would_like_to(way: tuple[float, float]) -> None:
    anchor, sizes = np.array([[200.0, 150.0]]), np.array([[20.0, 20.0]])
    shift = (settled(anchor, sizes, np.zeros((0, 2)), BOUNDS, np.array([way])) - anchor)[0]
    assert shift @ np.array(way) == pytest.approx(np.hypot(*shift) if any(way) else 0.0)
    assert np.hypot(*shift) < 25.0 * np.sqrt(2)


def test_points_along_a_line_are_close_and_skip_gaps() -> None:
    path = np.array([[0.0, 10.0, np.nan, 50.0, 50.0], [0.0, 0.0, np.nan, 0.0, 7.0]])
    points = along(path, 1.0)
    assert not ((points[:, 0] > 10.0) & (points[:, 0] < 50.0)).any()
    first = points[points[:, 0] <= 10.0]
    assert np.diff(first[:, 0]).max() <= 1.0 + 1e-12
    assert points[-1].tolist() == [50.0, 7.0]
