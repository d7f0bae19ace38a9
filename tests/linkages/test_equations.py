"""Residual, Jacobian and second derivatives against differences; bounds against what they bound."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.equations import Equations, loops
from tests.linkages.linkages import CASES

STEP = 1e-6


def setting(case: str) -> tuple[Equations, np.ndarray]:
    equations = Equations(loops(CASES[case][0]))
    return equations, np.random.default_rng(3).uniform(-1.0, 1.0, (6, len(equations.loops.names)))


@pytest.mark.parametrize("case", CASES)
def test_jacobian_is_the_derivative_of_the_residual(case: str) -> None:
    equations, z = setting(case)
    jacobian = equations.jacobian(z, equations.bases(z))
    for k in range(z.shape[1]):
        move = np.zeros(z.shape[1])
        move[k] = STEP
        ends = [equations.residual(z + sign * move, equations.bases(z + sign * move)) for sign in (1, -1)]
        np.testing.assert_allclose(jacobian[:, :, k], (ends[0] - ends[1]) / (2 * STEP), atol=1e-8)


@pytest.mark.parametrize("case", CASES)
def test_bending_is_the_second_derivative_along_a_motion(case: str) -> None:
    equations, z = setting(case)
    rate = np.random.default_rng(4).uniform(-1.0, 1.0, z.shape)
    h = 1e-4
    low, mid, high = (equations.residual(z + k * h * rate, equations.bases(z + k * h * rate)) for k in (-1, 0, 1))
    bent = equations.bending(equations.bases(z), rate)
    np.testing.assert_allclose(bent, (high - 2 * mid + low) / h**2, atol=1e-6)


@pytest.mark.parametrize("case", CASES)
def test_bounds_hold(case: str) -> None:
    equations, z = setting(case)
    rng = np.random.default_rng(5)
    a, b = rng.uniform(-1.0, 1.0, (2, *z.shape))
    bases = equations.bases(z)
    mixed = 0.25 * (equations.bending(bases, a + b) - equations.bending(bases, a - b))
    assert (np.abs(mixed) <= equations.bound(z, np.abs(bases.whole), np.abs(a), np.abs(b)) + 1e-12).all()
    h = 1e-5
    ends = [equations.bending(equations.bases(z + s * h * b), a) for s in (1, -1)]
    third = np.abs(ends[0] - ends[1]) / (2 * h)
    limit = equations.bound(z, np.abs(bases.whole), np.abs(a), np.abs(a), np.abs(b))
    assert (third <= limit * (1 + 1e-6) + 1e-6).all()
