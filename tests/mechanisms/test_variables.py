"""Variables of a linkage over its turns, and positions that are kept."""

from __future__ import annotations

from math import tau

import numpy as np

from flywheel.mechanisms.families import build
from flywheel.scene.scene import Mechanism
from tests.linkages.linkages import geared_five_bar


def test_the_last_single_positions_are_kept_and_arrays_are_not() -> None:
    at = build(Mechanism("linkage", "m", linkage=geared_five_bar(-2.0))).position
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
    family = build(Mechanism("linkage", "m", linkage=geared_five_bar(-2.0)))
    near, far = (family.position(q, np, anchor) for q, anchor in ((0.3, 0.5), (0.3 + 3 * tau, 0.5 + 3 * tau)))
    left, second = family.ports["left"], family.ports["second"]
    assert abs(float(left.position(near)) - float(left.position(far))) < 1e-13
    assert abs(float(second.position(near)) - 6 * tau - float(second.position(far))) < 1e-12
