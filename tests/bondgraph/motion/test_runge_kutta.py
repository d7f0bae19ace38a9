"""Methods of order 5 and 8 in plain numbers: their order at the end of a step and within it, and what is kept of a step."""

import math
import pickle

import numpy as np
import pytest

from bondgraph.motion.runge_kutta import ORDER_5, ORDER_8, DormandPrince, at, method

ORDERS = {5: (ORDER_5, 5, 4), 8: (ORDER_8, 8, 7)}


def swing(t, y):
    """Of y'' = -y, and the integral of t cos t."""
    return y[1], -y[0], t * math.cos(t)


def truth(t):
    t = np.asarray(t)
    return np.array([np.cos(t), -np.sin(t), t * np.sin(t) + np.cos(t) - 1.0])


@pytest.mark.parametrize("order", ORDERS)
def test_errors_fall_by_the_order_of_the_method(order):
    chosen, at_end, within = ORDERS[order]
    ends, inside = [], []
    for h in (1.0, 0.5):
        step = DormandPrince(swing, 0.0, (1.0, 0.0, 0.0), 10.0, 1.0, (math.inf,) * 3, h, chosen).step()
        ends.append(abs(np.array(step.after) - truth(h)).max())
        inside.append(abs(step(h * np.array([0.3, 0.6])) - truth(h * np.array([0.3, 0.6]))).max())
    assert math.log2(ends[0] / ends[1]) > at_end + 0.7
    assert math.log2(inside[0] / inside[1]) > within + 0.5


@pytest.mark.parametrize("order", ORDERS)
def test_a_motion_is_as_good_as_asked_and_told_alike_in_every_way(order):
    chosen, tolerance = ORDERS[order][0], 1e-8
    runner, steps = DormandPrince(swing, 0.0, (1.0, 0.0, 0.0), 10.0, tolerance, (tolerance,) * 3, method=chosen), []
    while runner.t < 10.0:
        steps.append(runner.step())
    times = np.linspace(0.0, 10.0, 101)
    owners = np.clip(np.searchsorted([step.t + step.h for step in steps], times), 0, len(steps) - 1)
    found = at(steps, owners, times)
    assert abs(found - truth(times)).max() < 100 * tolerance
    one_by_one = np.array([steps[owner](t) for owner, t in zip(owners, times, strict=True)]).T
    plain = np.array([steps[owner].one(2)(t) for owner, t in zip(owners, times, strict=True)])
    assert abs(one_by_one - found).max() < 1e-14
    assert abs(plain - found[2]).max() < 1e-13
    kept = pickle.loads(pickle.dumps(steps[-1]))
    assert np.array_equal(kept(9.99), steps[-1](9.99))


def test_a_loose_tolerance_is_met_by_the_lower_order():
    assert (method(1e-3).order, method(1e-10).order) == (5, 8)
