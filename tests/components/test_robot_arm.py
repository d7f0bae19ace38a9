"""The arm against Lagrange's equations in symbols, Newton-Euler bar by bar, energy kept and the pendulum's period."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from mpmath import mp
from numpy.testing import assert_allclose

from flywheel.components.robot_arm import (
    Bar,
    TwoLinkArm,
    accelerations,
    driving_torques,
    energy,
    lagrange_equations,
    mass_matrix,
    reactions,
    rest,
    simulate_arm,
    slender,
)
from flywheel.numerics.faults import SceneError

ARM = TwoLinkArm(Bar(0.7, 4.0, 0.25, 0.4), Bar(0.5, 2.5, 0.09, 0.3))
SWUNG = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=-3.7)
START = [2.4, 0.5], [1.0, -3.0]


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


@pytest.mark.parametrize("arm", [ARM, SWUNG])
def test_numbers_agree_with_the_closed_form_at_25_digits(found, arm):
    q, qdot, qddot = [0.8, -1.9], [2.5, -4.0], [30.0, 11.0]
    motion = [angle + w * found.t + b * found.t**2 / 2 for angle, w, b in zip(q, qdot, qddot, strict=True)]
    put = {symbol: sp.Float(value, 30) for symbol, value in found.values(arm).items()}
    left = [
        sp.N(side.subs(put).subs(dict(zip(found.q, motion, strict=True))).doit().subs(found.t, 0), 25) for side in found.left
    ]
    assert [float(left[0] + left[1]), float(left[1])] == pytest.approx(
        driving_torques(arm, q, qdot, qddot).tolist(), rel=1e-13
    )
    matrix = found.mass.subs(put).subs(dict(zip(found.q, q, strict=True)))
    assert np.array(matrix, dtype=float) == pytest.approx(mass_matrix(arm, q), rel=1e-14)


def test_torques_do_work_between_the_bars(found):
    """Virtual power T1 w1 + T2 (w2 - w1)."""
    t1, t2 = found.torques
    w1, w2 = sp.symbols("w1 w2")
    assert sp.expand(found.right[0] * w1 + found.right[1] * w2 - t1 * w1 - t2 * (w2 - w1)) == 0


def test_a_cart_with_a_pendulum_in_symbols():
    """By hand: m1 + m2, m2 c sin and cos of the pendulum's angle from the upward vertical; absolute and relative alike."""
    for relative in (False, True):
        cart = lagrange_equations("PR", relative=relative)
        _, m1, _, _, m2, i2, c2, g = cart.parameters
        (x, a), (force, torque) = cart.q, cart.torques
        xdd, ad, add = x.diff(cart.t, 2), a.diff(cart.t), a.diff(cart.t, 2)
        wanted = (
            (m1 + m2) * xdd - m2 * c2 * (add * sp.cos(a) - ad**2 * sp.sin(a)),
            (i2 + m2 * c2**2) * add - m2 * c2 * xdd * sp.cos(a) - m2 * g * c2 * sp.sin(a),
        )
        assert [sp.expand(left - side) for left, side in zip(cart.left, wanted, strict=True)] == [0, 0]
        assert cart.right == (force, torque)


@pytest.mark.slow
def test_absolute_and_relative_angles_are_one_motion():
    """T and V of three bars, the absolute angles being sums of the relative ones."""
    one, other = lagrange_equations("RRR"), lagrange_equations("RRR", relative=True)
    sums = {q: sum(other.q[: k + 1]) for k, q in enumerate(one.q)}
    gap = (one.kinetic - one.potential).subs(sums).doit() - (other.kinetic - other.potential)
    assert sp.expand(gap) == 0
    assert [str(side) for side in one.right] == ["T1 - T2", "T2 - T3", "T3"]


@pytest.mark.parametrize("joints", ["", "RX", "RRRRRRR", 2])
def test_joints_that_are_none_are_refused(joints):
    with pytest.raises(SceneError, match=r"joints: found .* expected 1 to 6 letters R"):
        lagrange_equations(joints)


def test_values_are_one_bar_a_joint(found):
    with pytest.raises(SceneError, match="arm: found 1 bars, expected one a joint, 2 in all"):
        found.values([slender(1.0, 1.0)])


def states(count=30):
    """Angles, speeds, accelerations: shape (2, count)."""
    rng = np.random.default_rng(5)
    return tuple(rng.normal(scale=scale, size=(2, count)) for scale in (3.0, 5.0, 20.0))


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


def test_energy_stays_without_torques():
    motion = simulate_arm(ARM, *START, 0.7, rtol=1e-12)
    total = motion.kinetic + motion.potential
    assert np.ptp(motion.kinetic) > 10.0
    assert motion.energy_residual < 1e-10
    scale = max(motion.kinetic.max(), np.ptp(motion.potential))
    assert motion.energy_residual == pytest.approx(np.abs(total - total[0]).max() / scale, rel=1e-12)
    assert not motion.work.any()


def test_energy_reports_a_loose_tolerance():
    loose, tight = (simulate_arm(ARM, *START, 1.0, rtol=rtol).energy_residual for rtol in (1e-4, 1e-9))
    assert tight < 1e-7 < 1e-6 < loose


def test_bars_balanced_at_the_elbow_swing_like_a_pendulum():
    """With its centre in the elbow bar 2 does not turn; half a period is 2 K(sin(q0/2)) sqrt(A/G1)."""
    arm = TwoLinkArm(slender(0.8, 2.0), Bar(0.4, 1.5, 0.03, 0.0))
    amplitude = 2.0
    k = arm.constants
    half = 2 * float(mp.ellipk(mp.sin(amplitude / 2) ** 2)) * np.sqrt(k.A / k.G1)
    motion = simulate_arm(arm, [np.pi - amplitude, 0.7], [0.0, 0.0], half, rtol=1e-12)
    assert motion.q[:, -1] == pytest.approx([np.pi + amplitude, 0.7], abs=1e-9)
    assert motion.qdot[:, -1] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_torques_from_a_motion_bring_that_motion_about():
    def wanted(t):
        q = np.array([1.0 + 0.5 * np.sin(2 * t), 0.3 * t + 0.4 * np.cos(3 * t)])
        qdot = np.array([np.cos(2 * t), 0.3 - 1.2 * np.sin(3 * t)])
        return q, qdot, np.array([-2 * np.sin(2 * t), -3.6 * np.cos(3 * t)])

    motion = simulate_arm(
        ARM, *wanted(0.0)[:2], 1.0, torques=lambda t, q, qdot: driving_torques(ARM, *wanted(t)), rtol=1e-12
    )
    times = np.linspace(0, 1, 7)
    for found, asked in zip(motion.at(times), wanted(times), strict=False):
        assert_allclose(found, asked, atol=1e-6)
    assert_allclose(motion.at(motion.t)[0], motion.q, atol=1e-13)
    assert motion.energy_residual < 1e-10
    assert np.abs(motion.work).max() > 1.0


def test_work_of_constant_torques_is_torque_times_angle():
    motion = simulate_arm(ARM, *START, 1.0, torques=lambda t, q, qdot: (3.0, -0.5))
    turned = motion.q[:, -1] - motion.q[:, 0]
    assert motion.work[-1] == pytest.approx(3.0 * turned[0] - 0.5 * (turned[1] - turned[0]), rel=1e-9)


def test_damping_takes_energy():
    motion = simulate_arm(ARM, *START, 3.0, torques=lambda t, q, qdot: (-2 * qdot[0], -(qdot[1] - qdot[0])))
    assert (np.diff(motion.work) <= 0).all()
    assert motion.energy_residual < 1e-8


def test_at_rest_in_balance_nothing_moves():
    motion = simulate_arm(ARM, [0.0, 0.0], [0.0, 0.0], 1.0)
    assert not motion.q.any()
    assert motion.energy_residual == 0.0


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"until": 0.0}, "until: found 0.0"),
        ({"until": "1"}, 'until: found "1"'),
        ({"arm": 1.0}, "arm: found 1.0, expected a TwoLinkArm"),
        ({"q": np.zeros((2, 3))}, r"q: found an array of shape \(2, 3\)"),
        ({"q": "ab"}, 'q: found "ab", expected finite numbers'),
        ({"until": np.inf}, "until: found inf"),
        ({"rtol": -1.0}, "rtol: found -1.0"),
        ({"q": [0.0]}, r"q: found an array of shape \(1,\)"),
        ({"qdot": [0.0, np.nan]}, "qdot: found a value that is not finite"),
        ({"torques": lambda t, q, qdot: (np.nan, 0.0)}, "torques: found a value that is not finite"),
        ({"torques": lambda t, q, qdot: 1.0}, "torques: found an array of shape"),
    ],
)
def test_motions_that_cannot_be(changes, text):
    with pytest.raises(SceneError, match=text):
        simulate_arm(**({"arm": ARM, "q": START[0], "qdot": START[1], "until": 1.0} | changes))
