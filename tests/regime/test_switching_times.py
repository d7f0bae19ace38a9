import numpy as np
import pytest

import flywheel
from flywheel.regime.free_motion import SwitchingTimes
from tests import scenes


def times(torque, until, **given):
    scene = scenes.rotor(load=[{"on": "crank", "torque": torque}], drive={"torque": 5}, **given)
    return SwitchingTimes(flywheel.Machine(flywheel.load(scene)), until)


def test_steps_and_periodic_switches_are_all_found():
    assert times("-50 - 30*(t > 2)", 10.0).every() == [2.0]
    found = times("-(sin(50*t) > 0.99)", 1.0).every()
    rise, fall = np.arcsin(0.99) / 50, (np.pi - np.arcsin(0.99)) / 50
    expected = sorted([rise + k * np.pi / 25 for k in range(8)] + [fall + k * np.pi / 25 for k in range(8)])
    np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_a_short_pulse_is_not_missed():
    found = times("-1e4*(t > 3)*(t < 3.0000001)", 100.0).every()
    np.testing.assert_allclose(found, [3.0, 3.0000001], rtol=1e-14)


def test_parameters_may_say_when():
    assert times("-(t > t0)", 10.0, parameters={"t0": 1.5}).every() == [1.5]


def test_what_depends_on_more_than_time_is_not_looked_for():
    assert times("-(t > omega)", 10.0).every() == []


def test_without_an_end_stretch_after_stretch_is_looked_through():
    found = times("-(t > 1000)", np.inf)
    stops = [found.after(0.0)]
    while stops[-1] < 1100.0:
        stops.append(found.after(stops[-1]))
    assert min(abs(stop - 1000.0) for stop in stops) < 1e-9


def test_too_many_switches_are_a_fault():
    with pytest.raises(flywheel.SceneError, match="too often"):
        times("-(sin(1e7*t) > 0.5)", 100.0).every()


def test_a_steep_pulse_is_closed_in_and_a_gentle_law_is_left_alone():
    found = np.array(times("-50*exp(-((t - 2)/0.002)**2)", 10.0).every())
    assert np.min(np.abs(found - 2.0)) < 0.01
    assert np.min(np.diff(found)) < 0.01
    assert times("-5 - 0.1*t", 10.0).every() == []


def test_a_law_of_time_without_a_value_is_told_with_its_reason():
    scene = {"inertia": [{"on": "crank", "value": 1}], "load": [{"on": "crank", "torque": "-5/(t-2)"}]}
    machine = flywheel.load({**scene, "drive": {"torque": "200 - 8*omega"}, "flywheel": {"inertia": 0.1}})
    with pytest.raises(flywheel.SceneError, match=r"near t = 2 \(.*: a division by t - 2, which comes to 0\)"):
        flywheel.simulate(machine, phi=0.0, omega=20.0, until=5.0)
