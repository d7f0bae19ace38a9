import numpy as np
import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.numerics.budget import metered
from flywheel.regime.free_motion import Outcome, outcome_of
from tests import regimes

SINE = {
    "inertia": [{"on": "crank", "value": 2}],
    "load": [{"on": "crank", "torque": "sin(omega*1e9) - 60*sin(phi)"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 13.6},
    "flywheel": {"inertia": 10},
}


def rotor(drive: str, load: float) -> Machine:
    scene = {"load": [{"on": "crank", "torque": load}], "drive": {"torque": drive}, "flywheel": {"inertia": 2.0}}
    return Machine(flywheel.load({**scene, "regime": {"speed": 10}}))


def test_a_machine_that_stalls_is_stopped_where_its_energy_ends():
    """J omega²/2 = M phi: 100 J are gone after 10 rad against 10 N m."""
    ending = outcome_of(rotor("0*omega", -10.0), 10.0, 2.0, 0.0)
    assert ending.outcome is Outcome.STALLS
    angle = np.degrees(10.0 % (2 * np.pi))
    assert f"crank angle {angle:.6g} deg" in ending.where
    assert ending.where.endswith("after 2 s")


def test_a_machine_that_runs_away():
    assert outcome_of(rotor("30 + omega", -10.0), 10.0, 2.0, 0.0).outcome is Outcome.RUNS_AWAY


def test_a_machine_that_goes_on():
    assert outcome_of(rotor("30 - 2*omega", -10.0), 10.0, 2.0, 0.0).outcome is Outcome.UNKNOWN


@pytest.mark.parametrize("slope", [1e7])
def test_a_machine_too_stiff_to_be_followed_is_given_up(slope):
    assert outcome_of(rotor(f"{slope}*(10 - omega)", -10.0), 10.0, 1e-3, 0.0).outcome is Outcome.UNKNOWN


def test_the_light_flywheel_of_the_references():
    case = regimes.BAD["light"]
    machine = Machine(flywheel.load(case.scene))
    assert outcome_of(machine, 7.5, 0.2, 0.0).outcome is Outcome.STALLS


def test_how_far_a_machine_is_followed_does_not_depend_on_the_clock(monkeypatch):
    """A sine that fast is given up: each time at the same work, and in a hurry after a third of it."""
    monkeypatch.setattr("flywheel.regime.free_motion._WORK", 3_000.0)
    monkeypatch.setattr("flywheel.regime.free_motion._HURRIED", 1_000.0)
    scene, taken = flywheel.load(SINE), []
    for hurried in (True, True, False):
        machine = Machine(scene)
        with metered() as meter, np.errstate(all="ignore"):  # as within a sizing
            assert outcome_of(machine, 13.6, 10.0, 0.0, hurried=hurried).outcome is Outcome.UNKNOWN
        taken.append(meter.cost.evaluations)
    assert taken[0] == taken[1]
    assert 2 * taken[0] < taken[2] < 4 * taken[0]
