import numpy as np
import pytest

import flywheel
from flywheel.regime import turning_moment
from flywheel.sizing.results import Sizing
from flywheel.tables import sizing as report
from tests import regimes

PRESS = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": "80 mm"},
        "rod": {"length": "480 mm"},
        "slider": {"mass": "420 kg"},
    },
    "shafts": {"motor": {"ratio": 5}},
    "load": [{"on": "slider", "force": "-400 kN", "from": "340 deg", "to": "360 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "60 rpm"},
}


def sized(**wheel: object) -> Sizing:
    return flywheel.size(flywheel.load({**PRESS, "flywheel": {"irregularity": 0.15, **wheel}}), simulate=False)


def test_a_wheel_carries_the_exact_inertia_and_keeps_the_irregularity():
    found = sized(shape="disc", material="carbon steel", outer_radius="0.6 m")
    assert found.built is not None
    assert found.built.wheel.inertia == pytest.approx(found.flywheel.exact, rel=1e-12)
    assert found.built.irregularity == pytest.approx(0.15, rel=1e-10)
    assert found.built.wheel.speed == pytest.approx(2 * np.pi * 1.075, rel=1e-12)
    assert found.built.torque is None


def test_a_wheel_rounded_up_gives_the_irregularity_of_its_own_inertia():
    found = sized(shape="disc", material="carbon steel", outer_radius="0.6 m", step="50 kg m^2")
    assert found.built is not None
    assert found.flywheel.exact is not None
    inertia = 50 * np.ceil(found.flywheel.exact / 50)
    assert found.built.wheel.inertia == pytest.approx(inertia)
    given = flywheel.load({**PRESS, "flywheel": {"inertia": inertia}})
    again = flywheel.size(given, simulate=False).simulation
    assert again is not None
    assert found.built.irregularity == pytest.approx(again.irregularity, rel=1e-10)


def test_the_wheel_turns_with_its_own_shaft():
    disc = {"shape": "disc", "material": "carbon steel", "outer_radius": "0.3 m"}
    slow, fast = sized(**disc), sized(on="motor", **disc)
    assert slow.built is not None
    assert fast.built is not None
    assert fast.built.wheel.speed == pytest.approx(5 * slow.built.wheel.speed)
    assert fast.built.wheel.mass == pytest.approx(slow.built.wheel.mass / 25)


def test_arms_pass_on_what_accelerates_the_wheel():
    asked = {"shape": "arms", "material": "carbon steel", "outer_radius": "0.9 m", "bore": "80 mm"}
    found = sized(**asked)
    assert found.built is not None
    assert found.run is not None
    assert found.machine is not None
    assert found.cycle is not None
    phi = np.linspace(np.radians(340.0) + 1e-9, 2 * np.pi - 1e-9, 2001)
    omega = turning_moment.speed_over_cycle(found.cycle, found.speed, found.run, phi)
    state = flywheel.reduce(found.machine, phi)
    alpha = (state.moment - 0.5 * state.slope * omega**2) / (state.inertia + found.run.inertia)
    torque = found.flywheel.exact * float(np.abs(alpha).max())
    given = sized(**asked, torque=torque)
    assert given.built is not None
    assert found.built.torque == pytest.approx(torque, rel=1e-5)
    assert given.built.torque == torque
    assert "N m, inertia times the greatest acceleration" in report.text(found)
    assert "greatest acceleration" not in report.text(given)
    place = "arms at the hub"
    assert found.built.wheel.stresses[place] == pytest.approx(given.built.wheel.stresses[place], rel=1e-5)


def test_a_machine_that_sets_its_own_speed_is_solved_again_with_the_wheel_as_built():
    wheel = {"shape": "disc", "material": "grey cast iron", "outer_radius": "0.4 m", "step": "1 kg m^2"}
    found = flywheel.size(flywheel.load({**regimes.SECTION_C, "flywheel": {"irregularity": 0.1, **wheel}}), simulate=False)
    given = flywheel.size(flywheel.load({**regimes.SECTION_C, "flywheel": {"inertia": 6.0}}), simulate=False)
    assert found.built is not None
    assert given.simulation is not None
    assert found.built.wheel.inertia == pytest.approx(6.0)
    assert found.built.irregularity == pytest.approx(given.simulation.irregularity, rel=1e-9)


def test_no_wheel_where_no_flywheel_is_needed():
    scene = {"drive": {"torque": 5}, "load": [{"on": "crank", "torque": -5}], "regime": {"speed": 10}}
    asked = {"irregularity": 0.1, "shape": "disc", "material": "carbon steel", "outer_radius": "0.4 m"}
    found = flywheel.size(flywheel.load({**scene, "flywheel": asked}), simulate=False)
    assert found.built is None
    assert any("no wheel" in message for message in found.messages)


def test_a_wheel_for_a_diagram_of_areas():
    asked = {"irregularity": 0.02, "shape": "rim", "material": "grey cast iron", "outer_radius": "0.5 m"}
    scene = {"areas": {"values": [30, -50, 20], "scale": "100 J"}, "regime": {"speed": "300 rpm"}, "flywheel": asked}
    found = flywheel.size(flywheel.load(scene))
    assert found.built is not None
    assert found.built.wheel.inertia == pytest.approx(found.flywheel.exact, rel=1e-9)
    assert found.built.irregularity == pytest.approx(0.02, rel=1e-9)
