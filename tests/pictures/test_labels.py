"""Labels are pushed apart, and stay beside their points."""

import numpy as np
import pytest

from flywheel.pictures.tradeoffs import placed

FRAME = (0.0, 0.0, 720.0, 420.0)
NONE = np.empty((0, 4))


def boxes(found, sizes):
    return np.concatenate([found.corners, found.corners + sizes], axis=1)


def overlaps(first, second):
    return (first[:2] < second[2:]).all() and (second[:2] < first[2:]).all()


def check(points, sizes, blocks=NONE):
    found = boxes(placed(points, sizes, FRAME, blocks, NONE), sizes)
    assert (found[:, :2] >= FRAME[:2]).all()
    assert (found[:, 2:] <= FRAME[2:]).all()
    for k, box in enumerate(found):
        assert not any(overlaps(box, other) for other in [*found[:k], *blocks])
    return found


def sizes_of(count, width=95.0):
    return np.tile([width, 9.0], (count, 1))


def test_twenty_points_anywhere():
    points = np.random.default_rng(1).uniform([20, 20], [400, 200], (20, 2))
    check(points, sizes_of(20))


def test_twelve_points_in_one_place():
    points = np.tile([360.0, 15.0], (12, 1)) + np.linspace(0.0, 2.0, 12)[:, None]
    found = check(points, sizes_of(12))
    middles = 0.5 * (found[:, :2] + found[:, 2:])
    assert np.hypot(*(middles - points).T).max() < 300


def test_blocks_are_left_free():
    blocks = np.array([[80.0, 80.0, 260.0, 120.0], [120.0, 60.0, 130.0, 140.0]])
    check(np.array([[125.0, 100.0], [150.0, 100.0]]), sizes_of(2), blocks)


def test_lines_are_avoided_where_there_is_room():
    points, sizes = np.array([[200.0, 200.0]]), sizes_of(1)
    line = np.array([[200.0, 200.0, 400.0, 200.0], [200.0, 200.0, 200.0, 400.0]])
    (left, bottom, right, top) = boxes(placed(points, sizes, FRAME, NONE, line), sizes)[0]
    assert not (bottom < 200 < top and right > 200)
    assert not (left < 200 < right and top > 200)


def test_leaders_end_at_their_labels():
    points = np.tile([360.0, 200.0], (9, 1))
    found = placed(points, sizes_of(9), FRAME, NONE, NONE)
    inside = np.clip(found.ends, found.corners, found.corners + sizes_of(9))
    assert np.array_equal(found.ends, inside)


def test_a_label_that_fits_nowhere_is_moved_into_the_frame():
    found = placed(np.array([[5.0, 5.0]]), np.array([[900.0, 9.0]]), FRAME, NONE, NONE)
    assert found.corners[0] == pytest.approx([2.0, 7.0], abs=5)
