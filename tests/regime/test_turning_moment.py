"""The resolved cycle, the speed with a given inertia, and how far angles and the period can be trusted."""

from __future__ import annotations

from math import pi
from typing import Any

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel.regime import turning_moment
from tests import scenes


def resolved(scene):
    machine = flywheel.Machine(flywheel.load(scene))
    return machine, turning_moment.resolve(machine, machine.mesh)


def test_the_work_of_the_yoke_is_the_closed_form():
    _, cycle = resolved(scenes.yoke())
    phi = np.linspace(0, np.pi, 50)
    work, variation = cycle.at(*cycle.where(phi))
    assert_allclose(work, 500 / np.pi * phi - 500 * (1 - np.cos(phi)), atol=1e-11)
    assert_allclose(variation, 5 * np.sin(phi) ** 2, atol=1e-13)


def test_inertia_accumulated_from_its_slope_is_the_inertia():
    machine, cycle = resolved(scenes.press())
    phi = np.linspace(0, 2 * np.pi, 77)
    _, variation = cycle.at(*cycle.where(phi))
    assert_allclose(cycle.inertia_at_start + variation, machine.reduce(phi).inertia, rtol=1e-11)


def test_run_puts_the_mean_of_extremes_at_the_speed_asked():
    _, cycle = resolved(scenes.press())
    for inertia in (20.0, 200.0, 2e6):
        run = turning_moment.run(cycle, 4 * np.pi, inertia)
        assert 0.5 * (run.speed_max + run.speed_min) == pytest.approx(4 * np.pi, rel=1e-14)


def test_tiny_irregularities_keep_their_digits():
    _, cycle = resolved(scenes.rotor())
    swing = 50 * np.pi
    for inertia in (1e3, 1e9, 1e14):
        run = turning_moment.run(cycle, 10 * np.pi, inertia)
        expected = swing / (inertia * (10 * np.pi) ** 2)
        assert run.irregularity == pytest.approx(expected, rel=1e-12)
        assert abs(run.irregularity / expected - 1) <= run.error


def test_speed_over_the_cycle_obeys_the_energy_balance():
    machine, cycle = resolved(scenes.press())
    run = turning_moment.run(cycle, 4 * np.pi, 50.0)
    phi = np.linspace(0, 2 * np.pi, 60)
    omega = turning_moment.speed_over_cycle(cycle, 4 * np.pi, run, phi)
    energy = 0.5 * (50.0 + machine.reduce(phi).inertia) * omega**2
    work, _ = cycle.at(*cycle.where(phi))
    assert_allclose(energy - energy[0], work - work[0], atol=1e-9 * energy.max())


def test_the_period_is_the_integral_of_one_over_speed():
    _machine, cycle = resolved(scenes.rotor())
    speed, inertia = 10 * np.pi, 0.3
    run = turning_moment.run(cycle, speed, inertia)
    period, error = turning_moment.period(cycle, speed, run, 1e-12)
    # constant torque on each half turn: the mean speed of each half is that of its ends
    expected = 2 * np.pi / (0.5 * (run.speed_max + run.speed_min))
    assert period == pytest.approx(expected, rel=1e-12)
    assert abs(period / expected - 1) <= error


def test_the_least_inertia_that_keeps_turning_has_irregularity_two():
    _, cycle = resolved(scenes.rotor())
    least = 50 * np.pi / (2 * (10 * np.pi) ** 2)
    assert turning_moment.run(cycle, 10 * np.pi, 1.0001 * least).irregularity == pytest.approx(2 / 1.0001, rel=1e-9)
    with pytest.raises(turning_moment.NoMotionError):
        turning_moment.run(cycle, 10 * np.pi, 0.9999 * least)


def near_a_stall(amplitude, **level):
    """A rotor of 1 kg m² under a sine at 10 rad/s: all is known in closed form, omega² = c - 2 A cos(phi)."""
    scene = {
        "load": [{"on": "crank", "torque": f"{amplitude}*sin(phi)"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"inertia": 1},
    }
    return flywheel.size(flywheel.load(scene), **level)


@pytest.mark.parametrize("amplitude", [50.0, 99.999])
def test_the_error_of_the_period_grows_towards_a_stall(amplitude):
    with mpmath.workdps(30):
        slow, fast = 10 - mpmath.mpf(amplitude) / 10, 10 + mpmath.mpf(amplitude) / 10
        true = 4 / fast * mpmath.ellipk(4 * mpmath.mpf(amplitude) / fast**2)
        found = near_a_stall(amplitude, simulate=False)
        assert abs(found.simulation.period / true - 1) <= found.error.period
        assert abs(found.simulation.speed_min / slow - 1) <= found.error.simulation
    assert found.error.period < (1e-8 if amplitude < 99.95 else 1e-5)


@pytest.mark.parametrize("accuracy", ["confirm", "audit"])
def test_a_confirmed_period_has_an_error_of_its_own(accuracy):
    found = near_a_stall(50.0, accuracy=accuracy)
    true = 4 / 15 * float(mpmath.ellipk(200 / 225))
    assert abs(found.simulation.period / true - 1) <= found.error.period <= found.error.simulation


ROTOR: dict[str, Any] = {"inertia": [{"on": "crank", "value": 2.0}], "regime": {"speed": 10.0}}


def sized(scene: dict[str, Any]) -> Any:
    return flywheel.size(flywheel.load(scene), simulate=False)


def test_a_sine_crosses_zero_at_half_a_turn() -> None:
    load = [{"on": "crank", "torque": "100*sin(phi)"}]
    found = sized({**ROTOR, "load": load, "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.1}})
    assert 0.0 < found.error.angles < 1e-12
    assert abs(found.areas[0].end - pi) <= found.error.angles
    assert abs(found.angle_speed_max - pi) <= found.error.extremes


def test_a_jump_through_zero_is_known_to_rounding() -> None:
    load = [{"on": "crank", "torque": -100.0, "from": 1.0, "to": 2.0}]
    found = sized({**ROTOR, "load": load, "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.1}})
    assert found.angle_speed_max == 1.0
    assert found.angle_speed_min == 2.0
    assert found.error.extremes < 1e-14


def test_speeds_that_are_not_known_leave_angles_open() -> None:
    """A given flywheel's extremes depend on the speed; the error of that is in theirs."""
    scene = {
        "mechanism": {"type": "slider-crank", "crank": {"length": 0.2}, "rod": {"length": 0.7}, "slider": {"mass": 30}},
        "load": [{"on": "slider", "force": "-500*sign(v)"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 20.0},
        "flywheel": {"inertia": 1.5},
    }
    loose, tight = (sized({**scene, "accuracy": {"rtol": rtol}}) for rtol in (1e-3, 1e-13))
    for key in ("angle_speed_max", "angle_speed_min"):
        assert abs(getattr(loose, key) - getattr(tight, key)) <= loose.error.extremes + tight.error.extremes
    assert tight.error.extremes < 1e-9


@pytest.mark.parametrize("steep", [0.05, 60.0])
def test_a_speed_that_has_settled_has_no_angle(steep: float) -> None:
    """Strongly damped, the speed settles between loads: where it is least is anyone's guess, and the estimate says so."""
    scene = {
        "load": [{"on": "crank", "torque": 5.0, "from": 0.6, "to": 0.62}, {"on": "crank", "torque": -2.5}],
        "inertia": [{"on": "crank", "value": 3.0}],
        "drive": {"torque": f"{2.5 + 14.0 * steep} - {33.0 * steep}*omega"},
        "flywheel": {"inertia": 0.1},
        "accuracy": {"rtol": 1e-10},
    }
    found = sized(scene)
    assert abs(found.angle_speed_max - 0.62) <= max(1e-12, found.error.extremes)
    assert (found.error.extremes > 1.0) == (steep > 10.0)
    assert found.error.angles < 1e-12
