"""Newton's iteration by itself: batches, and singular systems among them."""

from __future__ import annotations

import numpy as np

from flywheel.mechanisms.linkages.assembly import assembled
from flywheel.mechanisms.linkages.equations import Equations, correction, loops, settle, solved
from tests.linkages.linkages import six_bar


def test_a_batch_settles_like_each_alone() -> None:
    equations = Equations(loops(six_bar()))
    z = assembled(equations)
    off = np.tile(z, (5, 1))
    off[:, 1:] += np.random.default_rng(0).uniform(-0.05, 0.05, (5, z.size - 1))
    together, last = settle(equations, off)
    np.testing.assert_allclose(together, np.tile(z, (5, 1)), atol=1e-12)
    assert (last < 1e-9).all()


def test_a_correction_vanishes_on_a_solution() -> None:
    equations = Equations(loops(six_bar()))
    z = assembled(equations)
    assert np.abs(correction(equations, z[None])).max() < 1e-12


def test_singular_systems_are_nan_and_leave_the_others() -> None:
    matrix = np.array([[[2.0, 0.0], [0.0, 4.0]], [[1.0, 1.0], [1.0, 1.0]]])
    found = solved(matrix, np.array([[2.0, 4.0], [1.0, 0.0]]))
    assert found[0].tolist() == [1.0, 1.0]
    assert np.isnan(found[1]).all()


def test_a_position_that_is_lost_does_not_stop_the_others() -> None:
    equations = Equations(loops(six_bar()))
    z = assembled(equations)
    off = np.tile(z, (2, 1))
    off[0, 1:] += 0.05
    off[1] = np.nan
    found, last = settle(equations, off)
    np.testing.assert_allclose(found[0], z, atol=1e-12)
    assert not last[1] < 1e-9
