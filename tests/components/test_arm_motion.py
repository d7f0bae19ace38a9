"""The arm's motion: energy kept, a Taylor series at 30 digits, the pendulum's period, the way back from torques."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp
from numpy.testing import assert_allclose

from flywheel.components.robot_arm import Bar, TwoLinkArm, driving_torques, simulate_arm, slender
from flywheel.numerics.faults import SceneError

ARM = TwoLinkArm(Bar(0.7, 4.0, 0.25, 0.4), Bar(0.5, 2.5, 0.09, 0.3))
START = [2.4, 0.5], [1.0, -3.0]


def test_energy_stays_without_torques():
    motion = simulate_arm(ARM, *START, 3.0, rtol=1e-12)
    total = motion.kinetic + motion.potential
    assert np.ptp(motion.kinetic) > 10.0
    assert motion.energy_residual < 1e-10
    scale = max(motion.kinetic.max(), np.ptp(motion.potential))
    assert motion.energy_residual == pytest.approx(np.abs(total - total[0]).max() / scale, rel=1e-12)
    assert not motion.work.any()


def test_energy_reports_a_loose_tolerance():
    loose, tight = (simulate_arm(ARM, *START, 2.0, rtol=rtol).energy_residual for rtol in (1e-4, 1e-9))
    assert tight < 1e-7 < 1e-6 < loose


def taylor(until, steps, order=28):
    """(q, q') at `until` by Taylor series at 30 digits: recurrences for sin, cos, products and the division by det M."""
    (l1, m1, i1, c1), (_, m2, i2, c2) = ([mp.mpf(v) for v in bar] for bar in (ARM.first, ARM.second))
    a, b, c, g = i1 + m1 * c1**2 + m2 * l1**2, m2 * l1 * c2, i2 + m2 * c2**2, mp.mpf(ARM.gravity)
    weights = (m1 * c1 + m2 * l1) * g, m2 * c2 * g

    def product(u, v, n):
        return mp.fsum(u[k] * v[n - k] for k in range(n + 1))

    def next_sine(angle, sine, cosine, n):
        sine.append(mp.fsum(k * angle[k] * cosine[n - k] for k in range(1, n + 1)) / n)
        cosine.append(-mp.fsum(k * angle[k] * sine[n - k] for k in range(1, n + 1)) / n)

    def stepped(q, w, h):
        angles = [[q[0]], [q[1]], [q[0] - q[1]]]
        speeds = [[w[0]], [w[1]]]
        sines, cosines = [[mp.sin(x[0])] for x in angles], [[mp.cos(x[0])] for x in angles]
        turning = [[], []]
        squares, det = [[], []], []
        for n in range(order):
            if n:
                for angle, sine, cosine in zip(angles, sines, cosines, strict=True):
                    next_sine(angle, sine, cosine, n)
            for square, speed in zip(squares, speeds, strict=True):
                square.append(product(speed, speed, n))
            det.append(b * b * product(sines[2], sines[2], n) + (a * c - b * b if n == 0 else 0))
            one = [weights[0] * sines[0][k] - b * product(sines[2], squares[1], k) for k in range(n + 1)]
            two = [weights[1] * sines[1][k] + b * product(sines[2], squares[0], k) for k in range(n + 1)]
            tops = c * one[n] - b * product(cosines[2], two, n), a * two[n] - b * product(cosines[2], one, n)
            for i in range(2):
                turning[i].append((tops[i] - mp.fsum(turning[i][k] * det[n - k] for k in range(n))) / det[0])
                speeds[i].append(turning[i][n] / (n + 1))
                angles[i].append(speeds[i][n] / (n + 1))
            angles[2].append(angles[0][n + 1] - angles[1][n + 1])
        return [[mp.polyval(s[::-1], h) for s in series] for series in (angles[:2], speeds)]

    state = [[mp.mpf(v) for v in values] for values in START]
    for _ in range(steps):
        state = stepped(*state, mp.mpf(until) / steps)
    return state


def test_motion_is_that_of_a_taylor_series_at_30_digits():
    with mp.workdps(30):
        coarse, fine = taylor(0.25, 8), taylor(0.25, 10)
        exact = np.array(fine, dtype=float)
        assert max(abs(x - y) for u, v in zip(coarse, fine, strict=True) for x, y in zip(u, v, strict=True)) < 1e-18
    motion = simulate_arm(ARM, *START, 0.25, rtol=1e-13)
    assert_allclose([motion.q[:, -1], motion.qdot[:, -1]], exact, rtol=1e-11)


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
def test_refusals(changes, text):
    with pytest.raises(SceneError, match=text):
        simulate_arm(**({"arm": ARM, "q": START[0], "qdot": START[1], "until": 1.0} | changes))
