"""Power and energy of whole machines: against closed forms, and against points of the motion itself."""

import numpy as np
import pytest
from scipy.integrate import quad

import flywheel
from flywheel import steady
from tests.flywheel import regimes, scenes


def sized(scene):
    return flywheel.size(flywheel.load(scene), simulate=False)


def test_the_course_s_exam_of_march_2010():
    """x = -3 R cos phi1, 750 N over half a turn; 71.6197 N m at 210 rpm: exactly 1575 W, 678.2297 kcal of 4.18 kJ."""
    law = {"type": "law", "outputs": {"saw": {"x": "-0.3*cos(phi)"}}}
    load = [{"on": "saw", "force": "-750 N", "from": 0, "to": "180 deg"}]
    scene = scenes.rotor(mechanism=law, load=load, regime={"speed": "210 rpm"}, flywheel={"irregularity": 0.05})
    energy = sized(scene).energy
    assert energy.work == pytest.approx(450, rel=1e-12)
    assert energy.mean_power_alone == pytest.approx(1575, rel=1e-12)
    assert energy.mean_power_alone * 1800 / 4180 == pytest.approx(678.2297, abs=5e-5)
    assert energy.peak_power_alone == pytest.approx(750 * 0.3 * 7 * np.pi, rel=1e-12)  # at mid-stroke
    assert energy.peak_power == pytest.approx(450 / (2 * np.pi) * 7 * np.pi * 1.025, rel=1e-12)  # at the greatest speed


@pytest.mark.parametrize("name", ["section-c", "kloss-press", "pump", "geared-loss-line", "dc-inductance", "governor"])
def test_the_drive_works_along_the_motion(name):
    case = regimes.CASES[name]
    result = sized(regimes.scene(name, inertia=case.inertias[-1]))
    true = regimes.figures(name)["analysis"][repr(case.inertias[-1])]
    energy = result.energy
    assert energy.period == pytest.approx(float(true["period"]), rel=1e-9)
    if "drive_work" in true:
        assert energy.work == pytest.approx(float(true["drive_work"]), rel=1e-9, abs=1e-9)
        assert result.power == pytest.approx(float(true["power"]), rel=1e-9, abs=1e-9)
    assert energy.mean_power == pytest.approx(energy.work / energy.period)


def test_peaks_are_those_of_power_over_the_cycle():
    result = sized(regimes.scene("kloss-press", inertia=0.1))
    phi = np.linspace(0, 2 * np.pi, 20001)[:-1]
    omega = steady.speed_over_cycle(result.cycle, result.speed, result.run, phi)
    slip = 1 - 12 * omega / (50 * np.pi)
    power = 12 * 2 * 49.7 * 0.1916 * slip / (slip**2 + 0.1916**2) * omega
    assert result.energy.peak_power == pytest.approx(power.max(), rel=1e-6)
    assert result.energy.peak_power >= power.max() * (1 - 1e-12)
    assert result.energy.mean_power == pytest.approx(_time_mean(power, omega), rel=1e-4)


def _time_mean(power, omega):
    return np.sum(power / omega) / np.sum(1 / omega)


def test_a_motor_that_follows_the_loads_gives_what_they_take_at_a_constant_speed():
    """Without a flywheel: the loads' moment along the motion, at the mean of extremes; a line motor's own mean here."""
    result = sized(regimes.scene("peaks", inertia=5))
    energy = result.energy
    assert energy.peak_power_alone == pytest.approx(100 * result.speed, rel=1e-9)
    assert energy.mean_power_alone == pytest.approx(100 / 8 * result.speed, rel=1e-9)
    assert energy.peak_to_mean_alone == pytest.approx(8, rel=1e-9)
    assert energy.peak_to_mean < 2


def test_a_current_s_power_is_that_of_its_torque():
    result = sized(regimes.scene("dc-inductance", inertia=0.1))
    true = regimes.figures("dc-inductance")["analysis"]["0.1"]
    mechanical = float(true["electric_work"]) - float(true["heat"])
    assert result.energy.work == pytest.approx(mechanical, rel=1e-9)


def test_without_a_drive_there_is_no_power():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "30*sin(phi)"}])
    del scene["drive"]
    assert sized(scene).energy is None
    assert sized(scene).as_dict()["energy"] is None


def test_negative_peaks_count_by_their_size():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "100*sin(phi)"}], drive={"torque": "-100*sin(phi)"})
    scene["flywheel"] = {"inertia": 1e6}
    energy = sized(scene).energy
    assert abs(energy.peak_power) == pytest.approx(100 * 10 * np.pi, rel=1e-4)
    assert energy.mean_power == pytest.approx(0, abs=1e-6)
    assert energy.peak_to_mean is None or abs(energy.peak_to_mean) > 1e6


def test_the_figures_agree_with_quadrature():
    result = sized(regimes.scene("section-c", inertia=0))
    speed = lambda phi: float(steady.speed_over_cycle(result.cycle, result.speed, result.run, np.array([phi]))[0])  # noqa: E731
    period = quad(lambda phi: 1 / speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    work = quad(lambda phi: 10 - 2.387 * speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    square = quad(lambda phi: (10 - 2.387 * speed(phi)) ** 2 / speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    assert (result.energy.period, result.energy.work) == pytest.approx((period, work), rel=1e-8, abs=1e-8)
    assert result.energy.rms_torque == pytest.approx(np.sqrt(square / period), rel=1e-8)


def test_the_rms_torque_of_a_constant_drive_is_that_torque_on_its_own_shaft():
    scene = scenes.rotor(shafts={"motor": {"ratio": 5}})
    scene["drive"] = {"on": "motor", "torque": "balance"}
    result = sized(scene)
    assert result.energy.rms_torque == pytest.approx(result.balance.value, rel=1e-13)


def test_the_rms_torque_of_a_sine_counts_by_time():
    """T = 50 + 50 sin(phi) at an even speed: 50 sqrt(1 + 1/2)."""
    scene = scenes.rotor(load=[{"on": "crank", "torque": "-50 - 50*sin(phi)"}], drive={"torque": "50 + 50*sin(phi)"})
    scene["flywheel"] = {"inertia": 1}
    assert sized(scene).energy.rms_torque == pytest.approx(50 * np.sqrt(1.5), rel=1e-12)


def test_rounding_is_no_power():
    energy = sized(scenes.rotor(load=[{"on": "crank", "torque": "-100*sin(17*phi)"}])).energy
    assert (energy.mean_power, energy.peak_power, energy.rms_torque) == (0.0, 0.0, 0.0)
    assert energy.peak_power_alone == pytest.approx(1000 * np.pi)
