import numpy as np
import pytest

import flywheel
from flywheel.stepping import TIGHTEST, Tolerance, reduced_at, through
from tests.flywheel import scenes

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


def test_laws_are_read_just_inside_a_piece_where_its_end_is_not_defined():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "-sqrt(2 - phi)", "from": 0, "to": 2}])
    machine = flywheel.Machine(flywheel.load(scene))
    _, _, moment = reduced_at(machine, 2.5, 1.0, 0.0, (0.0, 2.0))
    assert moment == pytest.approx(0.0, abs=1e-4)
    assert 0.0 < TIGHTEST < 1e-12
