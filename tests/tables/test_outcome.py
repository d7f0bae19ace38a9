"""What a sizing means: the irregularity that each flywheel gives."""

import pytest

import flywheel
from flywheel.tables.flywheels import candidates


def test_a_machine_without_inertia_has_the_irregularity_that_its_torques_leave():
    """100 - 2 omega drives it, 30 N m load it over half a turn: it runs between 35 and 50 rad/s; a wheel evens it."""
    scene = {
        "load": [{"on": "crank", "torque": -30.0, "from": 0.0, "to": "180 deg"}],
        "damper": [{"on": "crank", "coefficient": 2.0}],
        "drive": {"torque": 100.0},
    }
    sizing = flywheel.size(flywheel.load(scene | {"flywheel": {"irregularity": 1.5}}), simulate=False)
    exact, areas, _ = candidates(sizing)
    assert exact.inertia == 0.0
    assert exact.gives[0] == pytest.approx(15.0 / 42.5, rel=1e-9)
    given = flywheel.size(flywheel.load(scene | {"flywheel": {"inertia": areas.inertia}}), simulate=False)
    assert areas.gives[0] == pytest.approx(given.simulation.irregularity, rel=1e-9)
    assert areas.gives[0] < exact.gives[0]
