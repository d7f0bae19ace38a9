"""The arm's equations in symbols: the printed ones, and the closed form's numbers."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from flywheel.components.robot_arm import Bar, TwoLinkArm, driving_torques, lagrange_equations, mass_matrix

ARM = TwoLinkArm(Bar(0.7, 4.0, 0.25, 0.4), Bar(0.5, 2.5, 0.09, 0.3))


@pytest.fixture(scope="module")
def found():
    return lagrange_equations()


def test_the_printed_lagrangian_for_bars_with_their_centres_in_the_middle(found):
    """L of the course, p. 68, example 3."""
    l1, m1, i1, c1, m2, i2, c2, g = found.parameters
    l2 = sp.Symbol("l2", positive=True)
    (q1, q2), (w1, w2) = found.q, (q.diff(found.t) for q in found.q)
    printed = m1 * l1**2 / 4 * w1**2 / 2 + i1 * w1**2 / 2 + m2 * l1**2 * w1**2 / 2 + m2 * l2**2 * w2**2 / 8
    printed += m2 * l1 * l2 * w1 * w2 * sp.cos(q1 - q2) / 2 + i2 * w2**2 / 2
    printed -= m1 * g * l1 / 2 * sp.cos(q1) + m2 * g * (l1 * sp.cos(q1) + l2 / 2 * sp.cos(q2))
    own = (found.kinetic - found.potential).subs({c1: l1 / 2, c2: l2 / 2})
    assert sp.simplify(own - printed) == 0


def test_numbers_agree_with_the_closed_form_at_25_digits(found):
    q, qdot, qddot = [0.8, -1.9], [2.5, -4.0], [30.0, 11.0]
    motion = [angle + w * found.t + b * found.t**2 / 2 for angle, w, b in zip(q, qdot, qddot, strict=True)]
    put = {symbol: sp.Float(value, 30) for symbol, value in found.values(ARM).items()}
    left = [
        sp.N(side.subs(put).subs(dict(zip(found.q, motion, strict=True))).doit().subs(found.t, 0), 25) for side in found.left
    ]
    assert [float(left[0] + left[1]), float(left[1])] == pytest.approx(
        driving_torques(ARM, q, qdot, qddot).tolist(), rel=1e-13
    )
    matrix = found.mass.subs(put).subs(dict(zip(found.q, q, strict=True)))
    assert np.array(matrix, dtype=float) == pytest.approx(mass_matrix(ARM, q), rel=1e-14)


def test_torques_do_work_between_the_bars(found):
    """Virtual power T1 w1 + T2 (w2 - w1)."""
    t1, t2 = found.torques
    w1, w2 = sp.symbols("w1 w2")
    assert sp.expand(found.right[0] * w1 + found.right[1] * w2 - t1 * w1 - t2 * (w2 - w1)) == 0
