import numpy as np
import pytest

import flywheel
from flywheel.instant import Dynamics
from flywheel.machine import Machine
from flywheel.one_cycle import SlidingError, one_cycle
from tests.flywheel import regimes

TIGHT = 1e-12


def stepped(name: str, inertia: float, *, scale: float = 1.0) -> tuple[Machine, float, list, float]:
    """A case's cycle from the state at phi = 0 that the references give."""
    machine = Machine(flywheel.load(regimes.scene(name, inertia=inertia)))
    [found] = [item for item in regimes.figures(name)["analysis"].values() if float(item["inertia"]) == inertia]
    speed, start = float(found["speed"]), float(found["speed_at_zero"])
    balance = float(found["balance"]) if found["balance"] is not None else 0.0
    dynamics = Dynamics(machine, inertia * machine.scene.flywheel_ratio**2, balance)
    u = (start / speed - 1) / scale
    steps = one_cycle(dynamics, speed, scale, np.array([0.0, u]), TIGHT)
    return machine, speed, steps, u


@pytest.mark.parametrize("name", ["section-c", "governor", "geared-loss", "yoke"])
def test_a_periodic_motion_comes_back_to_where_it_started(name):
    inertia = regimes.CASES[name].inertias[0]
    machine, _, steps, u = stepped(name, inertia)
    last = steps[-1]
    phi, end = last.dense(last.end)[:2]
    assert phi == pytest.approx(machine.scene.cycle, rel=1e-12)
    assert end == pytest.approx(u, abs=1e-9)


def test_the_time_of_a_cycle_is_that_of_the_references():
    inertia = regimes.CASES["section-c"].inertias[0]
    _, speed, steps, _ = stepped("section-c", inertia)
    [found] = [item for item in regimes.figures("section-c")["analysis"].values() if float(item["inertia"]) == inertia]
    assert steps[-1].end / speed == pytest.approx(float(found["period"]), rel=1e-10)


def test_the_scale_changes_nothing():
    inertia = regimes.CASES["section-c"].inertias[0]
    ends = [stepped("section-c", inertia, scale=scale)[2][-1].end for scale in (1.0, 0.01)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-10)


def test_steps_end_where_a_law_switches():
    """A governor's torque bends at a speed: there the motion starts afresh."""
    inertia = regimes.CASES["governor"].inertias[0]
    _, _, steps, _ = stepped("governor", inertia)
    assert any(step.crossed is not None for step in steps)


def test_a_motion_along_a_jump_is_told_apart():
    """Friction that sets in above a speed holds the motion at that speed: no step gets on."""
    rotor = {
        "load": [
            {"on": "crank", "torque": -30, "from": 0, "to": "90 deg"},
            {"on": "crank", "torque": "-60*(omega > 10)"},
        ],
        "drive": {"torque": "20"},
        "flywheel": {"inertia": 2.0},
        "regime": {"speed": 10},
    }
    dynamics = Dynamics(Machine(flywheel.load(rotor)), 2.0)
    with pytest.raises(SlidingError):
        one_cycle(dynamics, 10.0, 1.0, np.array([0.0, 0.0]), 1e-10)
