import numpy as np
import pytest

import flywheel
from flywheel.machine.dynamics import Dynamics
from flywheel.machine.machine import Machine
from flywheel.regime.stepping import SlidingError, one_cycle
from tests import regimes

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


@pytest.mark.slow
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


def governed(gain: float, inertia: float) -> tuple[Machine, np.ndarray]:
    """A rotor held at 10 rad/s by a drive of a gain (N m s), and its speed less 10 at 128 angles.

    v = omega - 10 obeys gain v = -80 sin phi - 20 cos 3 phi - inertia (10 + v) v', by iteration on its Fourier series.
    """
    scene = {
        "load": [{"on": "crank", "torque": "-100 - 80*sin(phi) - 20*cos(3*phi)"}],
        "inertia": [{"on": "crank", "value": inertia}],
        "drive": {"torque": f"{100 + 10 * gain} - {gain}*omega"},
        "flywheel": {"inertia": 0},
        "regime": {},
    }
    phi, order = 2 * np.pi * np.arange(128) / 128, np.fft.fftfreq(128, 1 / 128)
    load = 80 * np.sin(phi) + 20 * np.cos(3 * phi)
    v = -load / gain
    for _ in range(60):
        slope = np.fft.ifft(np.where(np.abs(order) < 40, 1j * order * np.fft.fft(v), 0)).real
        v = -(load + inertia * (10 + v) * slope) / gain
    return Machine(flywheel.load(scene)), v


@pytest.mark.parametrize("gain", [1e3, 1e4, 1e5, 1e6])
def test_a_steep_drive_is_stepped_in_few_steps_and_keeps_its_digits(gain):
    """Up to 6e7 time constants a cycle, and a drive whose torque of 1e7 N m leaves but 100 N m."""
    machine, v = governed(gain, 0.01)
    scale = 0.1 * float(np.ptp(v))
    steps = one_cycle(Dynamics(machine, 0.0), 10.0, scale, np.array([0.0, v[0] / (10 * scale)]), 3e-14)
    found = np.concatenate([step.dense(np.linspace(step.start, step.end, 9)) for step in steps], axis=1)
    series = np.fft.fft(v) / 128
    exact = (series * np.exp(1j * np.outer(found[0], np.fft.fftfreq(128, 1 / 128)))).sum(axis=1).real
    assert len(steps) < 250
    assert np.abs(10 * scale * found[1] - exact).max() < 1e-11 * np.ptp(v) + 20 * np.finfo(float).eps * 10


@pytest.mark.parametrize("inductance", [1e-3, 1e-6])
def test_a_fast_current_is_confirmed_by_the_steady_motion(inductance):
    scene = regimes.scene("dc-inductance", inertia=0.1)
    motor = {**scene["drive"]["motor"], "inductance": inductance}
    result = flywheel.size(flywheel.load({**scene, "drive": {**scene["drive"], "motor": motor}}))
    assert result.simulation.route == "time"
    assert abs(result.simulation.irregularity / result.run.irregularity - 1) <= 1e-12
    assert result.error.simulation <= 1e-9
