import numpy as np
import pytest

from flywheel.regime.stepping import Implicit, RateField, Tolerance, Watch, decay, through

ENDS = (0.0, 1e9)


def relaxing(rate: float):
    """phi' = 1, y' = -rate (y - cos t) - sin t: y = cos t + (y0 - 1) exp(-rate t)."""

    def along(t, states):
        return np.array([np.ones_like(t), -rate * (states[1] - np.cos(t)) - np.sin(t)])

    def rates(t, state):
        return along(np.array([t]), np.asarray(state)[:, None])[:, 0]

    return rates, RateField(along, np.ones(2))


@pytest.mark.parametrize("rate", [1e2, 1e4, 1e6, 1e8])
def test_a_stiff_relaxation_takes_few_steps_at_full_accuracy(rate):
    rates, along = relaxing(rate)
    tolerance = Tolerance(1e-13, np.full(2, 1e-13))
    steps = list(through(rates, 0.0, np.array([0.0, 3.0]), ENDS, 10.0, tolerance, None, None, along))
    assert len(steps) < 150
    assert steps[-1].end == 10.0
    for step in steps:
        times = np.linspace(step.start, step.end, 7)
        expected = np.cos(times) + 2.0 * np.exp(-rate * times)
        assert step.dense(times)[1] == pytest.approx(expected, abs=2e-12)


def test_a_stiff_motion_ends_exactly_where_it_leaves_the_piece():
    rates, along = relaxing(1e5)
    tolerance = Tolerance(1e-13, np.full(2, 1e-13))
    steps = list(through(rates, 0.0, np.array([0.0, 1.0]), (0.0, 2.5), 10.0, tolerance, None, None, along))
    assert steps[-1].end == pytest.approx(2.5, rel=1e-14)
    assert steps[-1].dense(steps[-1].end) == pytest.approx([2.5, np.cos(2.5)], rel=1e-12)


def test_what_is_watched_is_found_within_a_long_implicit_step():
    rates, along = relaxing(1e5)
    watch = Watch(lambda t, states: (states[1] + 0.5)[None], np.array([1.0]))
    tolerance = Tolerance(1e-13, np.full(2, 1e-13))
    steps = list(through(rates, 0.0, np.array([0.0, 1.0]), ENDS, 10.0, tolerance, None, watch, along))
    assert (steps[-1].crossed, steps[-1].end) == (0, pytest.approx(2 * np.pi / 3, rel=1e-12))


def test_the_two_ways_agree_on_a_law_that_is_not_linear():
    """y' = -50 (y³ - 1 - sin t): explicit steps of DOP853 and implicit ones."""

    def along(t, states):
        return np.array([np.ones_like(t), -50 * (states[1] ** 3 - 1 - np.sin(t))])

    def rates(t, state):
        return along(np.array([t]), np.asarray(state)[:, None])[:, 0]

    tolerance = Tolerance(1e-13, np.full(2, 1e-13))
    ends = [
        list(through(rates, 0.0, np.array([0.0, 2.0]), ENDS, 1.5, tolerance, None, None, way))[-1].dense(1.5)[1]
        for way in (None, RateField(along, np.ones(2)))
    ]
    assert ends[1] == pytest.approx(ends[0], rel=1e-11)


def test_what_is_not_stiff_is_stepped_as_without():
    rates, along = relaxing(1.0)
    tolerance = Tolerance(1e-12, np.full(2, 1e-12))
    plain, offered = (
        list(through(rates, 0.0, np.array([0.0, 3.0]), ENDS, 10.0, tolerance, None, None, way)) for way in (None, along)
    )
    assert [step.end for step in plain] == [step.end for step in offered]


def test_where_no_implicit_step_is_accepted_explicit_ones_go_on():
    """Rates at many instants that are no numbers: Newton's method never settles."""
    rates, along = relaxing(30.0)
    broken = RateField(lambda t, states: along.rates(t, states) + np.where(t > 0.5, np.nan, 0.0), along.sizes, 0.0)
    tolerance = Tolerance(1e-12, np.full(2, 1e-12))
    steps = list(through(rates, 0.0, np.array([0.0, 1.0]), ENDS, 1.0, tolerance, None, None, broken))
    assert steps[-1].dense(1.0)[1] == pytest.approx(np.cos(1.0), abs=1e-10)


def test_a_stretch_of_many_steps_goes_on_implicitly():
    def along(t, states):
        return np.array([np.ones_like(t), 40 * np.cos(40 * t)])

    def rates(t, state):
        return along(np.array([t]), np.asarray(state)[:, None])[:, 0]

    tolerance = Tolerance(1e-13, np.full(2, 1e-13))
    free = RateField(along, np.ones(2), np.inf)
    counts = {}
    for name, way in {"explicit": None, "both": free}.items():
        steps = list(through(rates, 0.0, np.array([0.0, 0.0]), ENDS, 8.0, tolerance, None, None, way))
        counts[name] = len(steps)
        assert steps[-1].dense(8.0)[1] == pytest.approx(np.sin(320.0), abs=1e-11)
    assert counts["both"] < counts["explicit"]


def test_the_fastest_decay_is_told():
    _, along = relaxing(250.0)
    assert decay(along, 0.0, np.array([0.0, 1.0])) == pytest.approx(250.0, rel=1e-6)
    growing = RateField(lambda t, states: np.array([np.ones_like(t), 3.0 * states[1]]), np.ones(2))
    assert decay(growing, 0.0, np.array([0.0, 1.0])) == 0.0


def test_rounding_does_not_stop_the_steps():
    """Two large torques that nearly cancel: rates are rough by 1e-16 of them, far above the tolerance."""
    big = 1e6

    def along(t, states):
        return np.array([np.ones_like(t), (1e7 + np.sin(t)) - big * (10.0 + 1e-5 * states[1])])

    solver = Implicit(RateField(along, np.array([1.0, 1e5])), 0.0, np.array([0.0, 0.0]), 3e-14, np.full(2, 3e-14))
    count = 0
    while solver.t < 5.0:
        assert solver.step(5.0 - solver.t, 1.0) is not None
        count += 1
    assert count < 60
    # y' = sin t - 10 y
    expected = (10 * np.sin(5.0) - np.cos(5.0)) / 101
    assert solver.state[1] == pytest.approx(expected, abs=1e-8)


def test_from_rest_a_step_starts_exactly_where_it_is():
    """A pace of -1e-16 there would look like a motion that turns back at once."""

    def along(t, states):
        return np.array([states[1], 10.0 - 2.0 * states[1]])

    solver = Implicit(RateField(along, np.ones(2)), 0.0, np.zeros(2), 1e-12, np.full(2, 1e-12))
    dense = solver.step(4.0, 0.0)
    assert dense is not None
    assert (dense(0.0) == 0.0).all()
    times = np.array([0.0, 1e-9, 1e-3])
    assert dense(times)[1] == pytest.approx(-5.0 * np.expm1(-2.0 * times), rel=1e-9)
    assert dense(times)[0] == pytest.approx(2.5 * (2.0 * times + np.expm1(-2.0 * times)), rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(("gain", "width"), [(1e3, 1e-3), (1e3, 1e-4), (1e2, 1e-3)])
def test_a_law_that_saturates_does_not_pass_for_rounding(gain, width):
    """y' = -gain tanh((y - cos t)/width) from far off: Newton's method goes astray in long steps, which are none to take."""

    def along(t, states):
        return np.array([np.ones_like(t), -np.sin(t) - gain * np.tanh((states[1] - np.cos(t)) / width)])

    def rates(t, state):
        return along(np.array([t]), np.asarray(state)[:, None])[:, 0]

    tolerance = Tolerance(1e-13, np.full(2, 1e-13))
    offset, last = 3.0 * width, 5.0 * width / gain + 1e-3
    steps = list(
        through(rates, 0.0, np.array([0.0, 1.0 + offset]), ENDS, last, tolerance, None, None, RateField(along, np.ones(2)))
    )
    for step in steps:
        times = np.linspace(step.start, step.end, 5)
        # y - cos t = d: d' = -gain tanh(d/width), so that sinh(d/width) = sinh(d0/width) exp(-gain t/width)
        expected = np.cos(times) + width * np.arcsinh(np.sinh(offset / width) * np.exp(-gain * times / width))
        assert step.dense(times)[1] == pytest.approx(expected, abs=2e-11)
