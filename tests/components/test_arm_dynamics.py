"""The arm in closed form, against Lagrange's equations at 30 digits and Newton-Euler bar by bar."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp
from numpy.testing import assert_allclose

from flywheel.components.robot_arm import (
    Bar,
    TwoLinkArm,
    accelerations,
    driving_torques,
    energy,
    mass_matrix,
    reactions,
    rest,
    slender,
)
from flywheel.numerics.faults import SceneError

ARM = TwoLinkArm(Bar(0.7, 4.0, 0.25, 0.4), Bar(0.5, 2.5, 0.09, 0.3))
SWUNG = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=-3.7)


def states(count=30):
    """Angles, speeds, accelerations: shape (2, count)."""
    rng = np.random.default_rng(5)
    return tuple(rng.normal(scale=scale, size=(2, count)) for scale in (3.0, 5.0, 20.0))


def lagrangian(arm, q, qdot):
    """T - V from the velocities of the centres in x and y."""
    (l1, m1, i1, c1), (_, m2, i2, c2) = arm.first, arm.second
    (q1, q2), (w1, w2) = q, qdot
    knee = -l1 * mp.cos(q1) * w1, -l1 * mp.sin(q1) * w1
    first = (c1 * w1) ** 2
    second = (knee[0] - c2 * mp.cos(q2) * w2) ** 2 + (knee[1] - c2 * mp.sin(q2) * w2) ** 2
    kinetic = (m1 * first + i1 * w1**2 + m2 * second + i2 * w2**2) / 2
    return kinetic - arm.gravity * (m1 * c1 * mp.cos(q1) + m2 * (l1 * mp.cos(q1) + c2 * mp.cos(q2)))


def lagrange(arm, q, qdot, qddot):
    """d/dt(dL/dq') - dL/dq by central differences at 90 digits, along the parabola q + q' t + q'' t²/2."""
    step = mp.mpf(10) ** -20

    def moved(values, k, by):
        return [v + (by if i == k else 0) for i, v in enumerate(values)]

    def momentum(k, t):
        at = [a + w * t + b * t * t / 2 for a, w, b in zip(q, qdot, qddot, strict=True)]
        speed = [w + b * t for w, b in zip(qdot, qddot, strict=True)]
        return (lagrangian(arm, at, moved(speed, k, step)) - lagrangian(arm, at, moved(speed, k, -step))) / (2 * step)

    def one(k):
        rate = (momentum(k, step) - momentum(k, -step)) / (2 * step)
        return rate - (lagrangian(arm, moved(q, k, step), qdot) - lagrangian(arm, moved(q, k, -step), qdot)) / (2 * step)

    first, second = one(0), one(1)
    return first + second, second


@pytest.mark.parametrize("arm", [ARM, SWUNG])
def test_torques_are_lagranges_at_30_digits(arm):
    q, qdot, qddot = states(4)
    found = driving_torques(arm, q, qdot, qddot)
    with mp.workdps(90):
        for k in range(4):
            exact = lagrange(arm, *([mp.mpf(v) for v in values[:, k].tolist()] for values in (q, qdot, qddot)))
            assert_allclose(found[:, k], [float(v) for v in exact], rtol=1e-13, atol=1e-12)


@pytest.mark.parametrize("arm", [ARM, SWUNG])
def test_newton_and_euler_agree_bar_by_bar(arm):
    """Reactions from Newton's law, torques from Euler's about each centre: x, y, z components written out."""
    q, qdot, qddot = states()
    shoulder, elbow = reactions(arm, q, qdot, qddot)
    (l1, _, i1, c1), (_, _, i2, c2) = arm.first, arm.second
    e1, e2 = (np.array([-np.sin(a), np.cos(a)]) for a in q)

    def moment(arm_of_force, force):
        return arm_of_force[0] * force[1] - arm_of_force[1] * force[0]

    second = i2 * qddot[1] - moment(-c2 * e2, elbow)
    first = i1 * qddot[0] + second - moment(-c1 * e1, shoulder) - moment((l1 - c1) * e1, -elbow)
    assert_allclose(driving_torques(arm, q, qdot, qddot), [first, second], rtol=1e-11, atol=1e-10)


def test_reactions_carry_the_centres():
    """Sum of the forces is m1 a_G1 + m2 a_G2, by differencing positions along the parabola."""
    q, qdot, qddot = (v[:, :5] for v in states())
    (l1, m1, _, c1), (_, m2, _, c2) = ARM.first, ARM.second

    def carried(t):
        e1, e2 = (np.array([-np.sin(a), np.cos(a)]) for a in q + qdot * t + qddot * t * t / 2)
        return m1 * c1 * e1 + m2 * (l1 * e1 + c2 * e2)

    h = 1e-4
    force = (carried(h) - 2 * carried(0.0) + carried(-h)) / h**2
    force[1] += (m1 + m2) * ARM.gravity
    assert_allclose(reactions(ARM, q, qdot, qddot).shoulder, force, rtol=1e-4, atol=1e-2)


def test_direct_dynamics_undo_inverse_dynamics():
    q, qdot, qddot = states()
    assert_allclose(accelerations(ARM, q, qdot, driving_torques(ARM, q, qdot, qddot)), qddot, rtol=1e-11, atol=1e-10)


def test_accelerations_solve_the_mass_matrix():
    q, qdot, _ = states()
    forces = np.array([7.0 - 2.0, 2.0])
    solved = [np.linalg.solve(mass_matrix(ARM, a), forces - rest(ARM, a, w)) for a, w in zip(q.T, qdot.T, strict=True)]
    assert_allclose(accelerations(ARM, q, qdot, (7.0, 2.0)), np.transpose(solved), rtol=1e-11)


def test_kinetic_energy_is_half_of_momentum_times_speed():
    q, qdot, _ = states()
    kinetic, potential = energy(ARM, q, qdot)
    assert_allclose(kinetic, 0.5 * np.einsum("in,ijn,jn->n", qdot, mass_matrix(ARM, q), qdot), rtol=1e-12)
    (l1, m1, _, c1), (_, m2, _, c2) = ARM.first, ARM.second
    heights = c1 * np.cos(q[0]), l1 * np.cos(q[0]) + c2 * np.cos(q[1])
    assert_allclose(potential, ARM.gravity * (m1 * heights[0] + m2 * heights[1]), rtol=1e-12, atol=1e-12)


def test_the_determinant_keeps_its_digits_where_the_arm_is_straight():
    """A heavy second bar whose inertia is nearly all about the elbow: A C and B² agree to 12 digits."""
    arm = TwoLinkArm(Bar(1.0, 1e-6, 0.0, 1e-3), Bar(1.0, 1.0, 1e-6, 1.0), gravity=0.0)
    found = accelerations(arm, [0.3, 0.3], [0.0, 0.0], [1.0, 0.0])
    with mp.workdps(40):
        a, b, c = mp.mpf(1e-6) * mp.mpf(1e-3) ** 2 + 1, mp.mpf(1), mp.mpf(1e-6) + 1
        exact = [float(v / (a * c - b * b)) for v in (c, -b)]
    assert_allclose(found, exact, rtol=1e-12)


@pytest.mark.parametrize(
    ("bars", "text"),
    [
        ((Bar(0.0, 1.0, 0.1, 0.1), slender(1, 1)), "first.length: found 0.0 m"),
        ((slender(1, 1), Bar(1.0, -1.0, 0.1, 0.1)), "second.mass: found -1.0 kg"),
        ((slender(1, 1), Bar(1.0, 1.0, np.nan, 0.1)), "second.inertia: found nan kg m²"),
        ((slender(1, 1), Bar(1.0, 1.0, 0.1, np.inf)), "second.com: found inf m"),
        ((1, slender(1, 1)), "first: found 1, expected a Bar"),
        ((slender(1, 1), Bar(1.0, "2", 0.1, 0.1)), 'second.mass: found "2", expected a finite number above 0'),
        ((slender(1, 1), Bar(1.0, 1.0, 0.0, 0.0)), "turn without moving any mass"),
        ((Bar(1.0, 1.0, 0.0, 0.0), Bar(1.0, 1.0, 0.0, 1.0)), "turn without moving any mass"),
    ],
)
def test_bars_that_are_none(bars, text):
    with pytest.raises(SceneError) as refused:
        TwoLinkArm(*bars)
    assert text in str(refused.value)
    assert len(refused.value.faults) == 1


def test_arguments_of_different_shapes_or_no_arm():
    with pytest.raises(SceneError, match=r"qdot: found an array of shape \(2, 4\), expected arguments of one shape"):
        rest(ARM, np.zeros((2, 3)), np.zeros((2, 4)))
    with pytest.raises(SceneError, match="arm: found 1, expected a TwoLinkArm"):
        mass_matrix(1, [0.0, 0.0])
    level = accelerations(ARM, np.zeros((2, 3)), np.zeros((2, 3)), (1.0, 0.0))
    assert_allclose(level[:, 1], accelerations(ARM, [0.0, 0.0], [0.0, 0.0], (1.0, 0.0)), rtol=1e-14)


def test_a_slender_bar_has_a_length_and_a_mass():
    with pytest.raises(SceneError) as refused:
        slender("a", -2.0)
    assert [str(fault) for fault in refused.value.faults] == [
        'length: found "a", expected a finite number above 0',
        "mass: found -2.0 kg, expected a finite number above 0",
    ]


def test_arguments_that_are_no_pair():
    with pytest.raises(SceneError, match="q: found an array of shape"):
        mass_matrix(ARM, [1.0, 2.0, 3.0])
    with pytest.raises(SceneError, match="qdot: found a value that is not finite"):
        rest(ARM, [1.0, 2.0], [np.nan, 0.0])
    with pytest.raises(SceneError, match="gravity: found nan"):
        TwoLinkArm(slender(1, 1), slender(1, 1), np.nan)
