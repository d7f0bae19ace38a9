import numpy as np
import pytest

import flywheel
from flywheel.fate import Fate, fate_of
from flywheel.machine import Machine
from tests.flywheel import regimes


def rotor(drive: str, load: float) -> Machine:
    scene = {"load": [{"on": "crank", "torque": load}], "drive": {"torque": drive}, "flywheel": {"inertia": 2.0}}
    return Machine(flywheel.load({**scene, "regime": {"speed": 10}}))


def test_a_machine_that_stalls_is_stopped_where_its_energy_ends():
    """J omega²/2 = M phi: 100 J are gone after 10 rad against 10 N m."""
    ending = fate_of(rotor("0*omega", -10.0), 10.0, 2.0, 0.0)
    assert ending.fate is Fate.STALLS
    angle = np.degrees(10.0 % (2 * np.pi))
    assert f"crank angle {angle:.6g} deg" in ending.where
    assert ending.where.endswith("after 2 s")


def test_a_machine_that_runs_away():
    assert fate_of(rotor("30 + omega", -10.0), 10.0, 2.0, 0.0).fate is Fate.RUNS_AWAY


def test_a_machine_that_goes_on():
    assert fate_of(rotor("30 - 2*omega", -10.0), 10.0, 2.0, 0.0).fate is Fate.UNKNOWN


@pytest.mark.parametrize("slope", [1e7])
def test_a_machine_too_stiff_to_be_followed_is_given_up(slope):
    assert fate_of(rotor(f"{slope}*(10 - omega)", -10.0), 10.0, 1e-3, 0.0).fate is Fate.UNKNOWN


def test_the_light_flywheel_of_the_references():
    case = regimes.BAD["light"]
    machine = Machine(flywheel.load(case.scene))
    assert fate_of(machine, 7.5, 0.2, 0.0).fate is Fate.STALLS
