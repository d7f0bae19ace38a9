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


def test_a_machine_that_would_stop_has_no_motion():
    _, cycle = resolved(scenes.rotor())
    with pytest.raises(turning_moment.NoMotionError):
        turning_moment.run(cycle, 10 * np.pi, 0.01)


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


@pytest.mark.parametrize("amplitude", [50.0, 99.0, 99.9, 99.999])
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
