"""Methods, their orders, and restarts at breaks."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import GraphError
from bondgraph.motion.stepping import ADAPTIVE, FIXED, Breaks, Stretch, adaptive, fixed, runge_kutta_step, through_breaks


def oscillator(t, y):
    return np.array([y[1], -y[0]])


@pytest.mark.parametrize(("name", "order"), [("euler", 1), ("rk2", 2), ("rk4", 4)])
def test_a_step_satisfies_its_order_conditions(name, order):
    """On y' = y a step of order p is the exponential series up to h^p."""
    h = 0.3
    stepped = runge_kutta_step(FIXED[name], lambda t, y: y, 0.0, np.ones(1), h, np.ones(1))[0]
    assert_allclose(stepped, sum(h**k / [1, 1, 2, 6, 24][k] for k in range(order + 1)), rtol=1e-15)


def test_equal_steps_end_exactly_and_are_joined_smoothly():
    steps = list(fixed("rk4", oscillator, 0.0, np.array([1.0, 0.0]), 1.0, 0.3))
    assert [s.start for s in steps] == pytest.approx([0.0, 0.3, 0.6, 0.9])
    assert steps[-1].end == 1.0
    for before, after in pairwise(steps):
        assert_allclose(before.dense(before.end), after.dense(after.start), rtol=1e-15)
    times = np.linspace(0.3, 0.6, 7)
    assert_allclose(steps[1].dense(times)[0], np.cos(times), atol=2e-4)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_every_adaptive_method_keeps_its_tolerance(method):
    steps = list(adaptive(method, oscillator, 0.0, np.array([1.0, 0.0]), 3.0, (1e-8, 1e-8 * np.ones(2))))
    assert steps[0].start == 0.0
    assert steps[-1].end == 3.0
    assert_allclose(steps[-1].dense(3.0), [np.cos(3.0), -np.sin(3.0)], atol=1e-6)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_a_field_that_ends_is_an_error_with_the_time(method):
    def field(t, y):
        return np.array([1.0 if y[0] < 1.0 else np.nan])

    with pytest.raises(GraphError, match=r"the motion cannot be followed past t = (0|1)"):
        list(adaptive(method, field, 0.0, np.zeros(1), 3.0, (1e-6, 1e-6 * np.ones(1))))


def test_equal_steps_into_nowhere_are_an_error():
    with pytest.raises(GraphError, match=r"cannot be followed past t = 0\.9 s"):
        list(fixed("rk4", lambda t, y: np.array([1.0 if y[0] < 0.95 else np.nan]), 0.0, np.zeros(1), 3.0, 0.1))


def test_pieces_are_those_between_breaks():
    breaks = Breaks(0, np.array([1.0, 4.0]), None)
    assert breaks.around(2.0, forwards=True) == (1.0, 4.0)
    assert breaks.around(1.0, forwards=True) == (1.0, 4.0)
    assert breaks.around(1.0, forwards=False) == (-np.inf, 1.0)
    assert breaks.around(5.0, forwards=True) == (4.0, np.inf)
    periodic = Breaks(0, np.array([1.0, 4.0]), 2 * np.pi)
    low, high = periodic.around(-3.0, forwards=True)
    assert_allclose([low, high], [1.0 - 2 * np.pi, 4.0 - 2 * np.pi])
    assert_allclose(periodic.around(4.0 + 20 * np.pi, forwards=True), [4.0 + 20 * np.pi, 1.0 + 22 * np.pi])
    assert_allclose(periodic.around(0.5, forwards=True), [4.0 - 2 * np.pi, 1.0])


def pushed(accelerations, edges, start, until, times=()):
    """A mass with a constant acceleration in each piece between the edges, stepped."""
    edges = np.array(edges, dtype=float)

    def acceleration(q):
        return accelerations[int(np.searchsorted(edges, q, side="right"))]

    def steps(t, y, stop, anchors):
        a = acceleration(anchors[0])
        return adaptive("DOP853", lambda t, y: np.array([y[1], a]), t, y, stop, (1e-10, 1e-10 * np.ones(2)))

    def rate(t, y):
        return np.array([y[1], acceleration(y[0])])

    return list(through_breaks(steps, rate, [Breaks(0, edges, None, "q")], times, np.array(start, dtype=float), until))


PUSHES, EDGES = (2.0, -3.0, 2.0, -1.0), (1.0, 4.0, 4.01)


def by_hand(accelerations, edges, start, until):
    """The same motion, from the roots of its parabolas."""
    (q, v), t = start, 0.0
    place = int(np.searchsorted(edges, q + 1e-9 * (v or accelerations[int(np.searchsorted(edges, q, side="right"))])))
    while True:
        a, span = accelerations[place], until - t
        leaves = []
        for edge, to in [(edges[k], k + 1 - (k < place)) for k in (place - 1, place) if 0 <= k < len(edges)]:
            roots = np.roots([0.5 * a, v, q - edge])
            leaves += [(r.real, to, edge) for r in roots if abs(r.imag) < 1e-12 and 1e-9 < r.real < span]
        when, to, edge = min(leaves, default=(span, place, None))
        q, v, t = q + v * when + 0.5 * a * when**2 if edge is None else edge, v + a * when, t + when
        if edge is None:
            return q, v
        place = to if to != place else (place - 1 if edge == edges[place - 1] else place + 1)


@pytest.mark.parametrize(
    ("start", "until"),
    [
        ((0.0, 3.0), 5.0),
        ((5.0, -3.0), 5.0),
        ((0.2, 0.0), 5.0),
        ((4.0, 0.0), 0.59),
        ((1.0, 0.4), 5.0),
        ((4.0 + 1e-7, -1e-3), 5.0),
        ((6.0, -20.0), 5.0),
    ],
    ids=["forwards", "backwards", "from rest", "from rest on a break", "from a break", "just before a break", "fast"],
)
def test_motions_through_breaks_are_those_of_the_pieces_by_hand(start, until):
    steps = pushed(PUSHES, EDGES, start, until)
    assert_allclose(steps[-1].dense(until), by_hand(PUSHES, EDGES, start, until), rtol=1e-10, atol=1e-10)
    for before, after in pairwise(steps):
        assert before.end == after.start
        assert_allclose(before.dense(before.end), after.dense(after.start), rtol=1e-12, atol=1e-12)


def test_a_motion_that_comes_to_rest_where_either_side_leads_away_keeps_its_energy():
    """From rest at 4 it is back there after 0.6 s, pushed away on both sides: the last digit says which way it goes."""
    work = np.concatenate(([0.0], np.cumsum(np.multiply(PUSHES[1:3], np.diff(EDGES)))))  # up to each edge, from q = 1
    for step in pushed(PUSHES, EDGES, (4.0, 0.0), 5.0):
        q, v = step.after
        place = int(np.searchsorted(EDGES, q))
        level = (work[place - 1] + PUSHES[place] * (q - EDGES[place - 1])) if place else PUSHES[0] * (q - 1.0)
        assert_allclose(0.5 * v * v - level, -work[1], rtol=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.floats(-2.0, 7.0), st.floats(0.1, 8.0), st.booleans())
def test_starts_anywhere(q, speed, forwards):
    start = q, speed if forwards else -speed
    steps = pushed(PUSHES, EDGES, start, 3.0)
    assert_allclose(steps[-1].dense(3.0), by_hand(PUSHES, EDGES, start, 3.0), rtol=1e-8, atol=1e-8)


def test_a_step_does_not_jump_over_a_narrow_window():
    steps = pushed((0.0, -1000.0, 0.0), (1.0, 1.0001), (0.0, 3.0), 5.0)
    assert_allclose(steps[-1].dense(5.0)[1], np.sqrt(9.0 - 2 * 1000 * 0.0001), rtol=1e-12)
    assert any(abs(s.end - 1 / 3) < 1e-15 for s in steps)


def test_a_motion_that_turns_beyond_a_break_is_seen_even_between_the_ends_of_a_step():
    steps = pushed((-1.0, -9.0), (1.0,), (0.0, 1.5), 5.0)
    assert_allclose(steps[-1].dense(5.0), by_hand((-1.0, -9.0), (1.0,), (0.0, 1.5), 5.0), rtol=1e-11)


def test_laws_that_drive_a_motion_back_onto_a_break_from_both_sides_are_an_error():
    with pytest.raises(GraphError, match="sticks at q = 1, t = 0 s"):
        pushed((2.0, -3.0), (1.0,), (1.0, 0.0), 5.0)


@pytest.mark.parametrize("place", [0.1, 1.0 / 3.0, 7.7, -123.4, 1e6])
def test_a_start_at_rest_on_a_break_is_left_at_once_whatever_its_digits(place):
    with pytest.raises(GraphError, match="sticks at q = "):
        pushed((2.0, -3.0), (place,), (place, 0.0), 5.0)


def test_steps_end_at_given_times():
    steps = pushed((1.0, 1.0), (100.0,), (0.0, 1.0), 2.0, times=(0.5, 1.25, 7.0, 0.0))
    ends = [s.end for s in steps]
    assert 0.5 in ends
    assert 1.25 in ends
    assert ends[-1] == 2.0


def test_far_too_many_steps_are_an_error(monkeypatch):
    monkeypatch.setattr("bondgraph.motion.stepping._MOST_STEPS", 10)

    def steps(t, y, stop, anchors):
        return (Stretch(0.01 * k, 0.01 * (k + 1), np.zeros(1), lambda t: np.zeros(1)) for k in range(1000))

    with pytest.raises(GraphError, match=r"10 steps reach t = 0.11 s only: .*Radau, LSODA"):
        list(through_breaks(steps, lambda t, y: y, [], (), np.zeros(1), 5.0))
