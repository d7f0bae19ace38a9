import numpy as np
import pytest

from flywheel.regime.stepping import Tolerance, Watch, through

TIGHT = Tolerance(1e-12, np.array([1e-12, 1e-12]))


def falling(acceleration):
    def rates(t, state):
        return np.array([state[1], acceleration])

    return rates


def test_the_last_step_ends_exactly_where_phi_leaves_the_piece():
    steps = list(through(falling(2.0), 0.0, np.array([0.0, 1.0]), (0.0, 6.0), 100.0, TIGHT, None))
    assert steps[-1].end == pytest.approx(2.0, rel=1e-14)
    assert steps[-1].dense(steps[-1].end)[1] == pytest.approx(5.0, rel=1e-12)


def test_a_motion_that_passes_the_end_and_comes_back_within_a_step_is_stopped_at_the_end():
    steps = list(through(falling(-2.0), 0.0, np.array([0.0, 2.0]), (0.0, 0.999), 100.0, TIGHT, 10.0))
    assert steps[-1].end == pytest.approx(1 - np.sqrt(1 - 0.999), rel=1e-12)


def test_a_motion_that_turns_back_leaves_by_the_other_end():
    steps = list(through(falling(-2.0), 0.0, np.array([0.5, 1.0]), (0.0, 5.0), 100.0, TIGHT, None))
    end = steps[-1].end
    assert 0.5 + end - end**2 == pytest.approx(0.0, abs=1e-12)


def test_time_may_run_out_first():
    steps = list(through(falling(0.0), 0.0, np.array([0.0, 1.0]), (0.0, 5.0), 2.5, TIGHT, None))
    assert steps[-1].end == 2.5


def watched(values, sides=(1.0,)):
    return Watch(values, np.array(sides))


def test_a_step_ends_where_something_watched_changes_its_sign():
    watch = watched(lambda t, y: (7.0 - y[1])[None])
    steps = list(through(falling(2.0), 0.0, np.array([0.0, 1.0]), (0.0, 1e3), 100.0, TIGHT, None, watch))
    assert steps[-1].end == pytest.approx(3.0, rel=1e-13)
    assert steps[-1].crossed == 0


def test_the_first_of_several_ends_it():
    watch = watched(lambda t, y: np.array([2.5 - t, t - 2.0]), (1.0, -1.0))
    steps = list(through(falling(0.0), 0.0, np.array([0.0, 1.0]), (0.0, 50.0), 10.0, TIGHT, 10.0, watch))
    assert (steps[-1].crossed, steps[-1].end) == (1, pytest.approx(2.0, rel=1e-13))


def test_what_dips_below_within_a_step_and_comes_back_is_not_missed():
    watch = watched(lambda t, y: (((t - 3.123) ** 2) - 1e-6)[None])
    steps = list(through(falling(0.0), 0.0, np.array([0.0, 1.0]), (0.0, 50.0), 10.0, TIGHT, 10.0, watch))
    assert steps[-1].end == pytest.approx(3.122, abs=1e-10)


def test_what_leaves_its_side_at_once_ends_the_step_at_its_start():
    watch = watched(lambda t, y: (-t)[None])
    (step,) = through(falling(0.0), 0.0, np.array([0.0, 1.0]), (0.0, 50.0), 10.0, TIGHT, 1.0, watch)
    assert step.start == step.end == 0.0


def test_what_only_touches_zero_does_not_end_it():
    watch = watched(lambda t, y: ((t - 3.0) ** 2 + 1e-9)[None])
    steps = list(through(falling(0.0), 0.0, np.array([0.0, 1.0]), (0.0, 50.0), 10.0, TIGHT, None, watch))
    assert steps[-1].end == 10.0
    assert steps[-1].crossed is None
