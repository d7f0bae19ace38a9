"""Cycles that come out as they went in, and those that do not."""

import numpy as np
import pytest

import flywheel
from flywheel.machine.dynamics import Dynamics
from flywheel.machine.machine import Machine
from flywheel.regime.free_motion import Goal, Start, follow, later, returns, source
from flywheel.regime.stepping import Step

YOKE = {
    "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.1, "inertia": 0.05}, "yoke": {"mass": 2}},
    "regime": {"speed": 10},
    "flywheel": {"inertia": 0.0},
}
PUSH = [{"on": "yoke", "force": -50, "while": "v > 0"}]


def machine(**more):
    return Machine(flywheel.load(YOKE | more))


def followed(until, goals=(), passing=None, **more):
    return follow(Dynamics(machine(**more), 0.0), Start(0.0, 10.0), until, 1e-9, goals, passing)


@pytest.mark.parametrize(
    ("more", "balance", "back"),
    [
        ({}, 0.0, True),
        ({"spring": [{"on": "yoke", "stiffness": 100}]}, 0.0, True),
        ({"load": PUSH, "drive": {"torque": "balance"}}, 50 * 0.2 / (2 * np.pi), True),
        ({"load": PUSH, "drive": {"torque": "balance"}}, 50 * 0.2 / (2 * np.pi) * (1 + 1e-9), False),
        ({"drive": {"torque": "1e-6"}}, 0.0, False),
        ({"drive": {"torque": "1 - 0.1*omega"}}, 0.0, False),
        ({"load": [{"on": "crank", "torque": "sin(t)"}]}, 0.0, False),
    ],
)
def test_a_speed_returns_where_the_work_of_a_cycle_is_zero_whatever_it_is(more, balance, back):
    assert returns(machine(**more), balance) is back


def test_a_later_step_tells_the_same_later():
    step = Step(lambda t: np.array([t, 2 * t]), 1.0, 3.0)
    moved = later(step, 10.0)
    assert (moved.start, moved.end) == (11.0, 13.0)
    assert moved.dense(12.0).tolist() == [2.0, 4.0]
    assert source(moved) is source(step) is step.dense


def test_what_is_repeated_is_what_would_be_stepped(monkeypatch):
    repeated = followed(16.0)
    monkeypatch.setattr("flywheel.regime.free_motion.returns", lambda machine, balance: False)
    stepped = followed(16.0)
    assert repeated.repeated > 15
    assert stepped.repeated == 0
    assert stepped.cycles == repeated.cycles
    times = np.linspace(0.0, 16.0, 300)
    assert np.abs(repeated.states(times)[:2] - stepped.states(times)[:2]).max() < 1e-6


def test_ends_are_the_states_at_the_ends():
    trail = followed(30.0)
    ends = trail.ends()
    assert np.abs(ends - trail.states(trail.t, np.arange(-1, len(trail.stretches)).clip(0))).max() < 1e-9


def test_a_goal_far_away_is_found_where_it_lies():
    there = 40.3 * 2 * np.pi
    trail = followed(1e4, [Goal("there", lambda t, phi, omega: there - phi)])
    assert trail.goal == "there"
    assert trail.repeated > 30
    assert trail.ends()[0, -1] == pytest.approx(there, rel=1e-12)


def test_what_is_asked_at_the_end_of_a_cycle_ends_the_motion():
    told = []

    def passing(t, omega):
        told.append(omega)
        return "enough" if len(told) == 50 else None

    trail = followed(1e4, passing=passing)
    assert trail.goal == "enough"
    assert trail.cycles == 50
    assert told == pytest.approx([10.0] * 50, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("more", [{}, {"load": PUSH, "drive": {"torque": "8 - 0.2*omega"}}], ids=["repeats", "settles"])
def test_a_motion_without_a_last_time_goes_on_until_it_is_ended(more):
    seen = []

    def passing(t, omega):
        seen.append(t)
        return "enough" if len(seen) == 40 else None

    trail = followed(np.inf, passing=passing, **more)
    assert (trail.goal, trail.cycles) == ("enough", 40)
    assert (trail.repeated > 0) is not bool(more)
    assert trail.t[-1] == seen[-1]
