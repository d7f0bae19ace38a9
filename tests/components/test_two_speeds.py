"""A flywheel between two speeds, against energies and motions integrated another way."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from flywheel.components import press_work
from flywheel.components.press_work import Speeds, energy_given, extreme_speeds, inertia_between, inertia_for, speed_after
from flywheel.numerics.faults import SceneError

LINE = (500.0, 100.0)  # starting torque, no-load speed


def test_energy_inertia_and_speed_undo_one_another():
    energy = energy_given(3.0, 110.0, 95.0)
    assert energy == pytest.approx(3.0 * 110.0**2 / 2 - 3.0 * 95.0**2 / 2, rel=1e-14)
    assert inertia_between(energy, 110.0, 95.0) == pytest.approx(3.0, rel=1e-15)
    assert speed_after(3.0, 110.0, energy) == pytest.approx(95.0, rel=1e-14)
    assert speed_after(3.0, 95.0, -energy) == pytest.approx(110.0, rel=1e-14)
    assert extreme_speeds(3.0, 102.5, energy) == pytest.approx((110.0, 95.0), rel=1e-14)
    assert inertia_for(energy, 102.5, Speeds(110.0, 95.0).irregularity) == pytest.approx(3.0, rel=1e-14)


def test_a_swing_far_below_the_energy_held_keeps_its_digits():
    high, low = 100.0 + 1e-10, 100.0
    assert energy_given(2.0, high, low) == pytest.approx(2.0 * 100.0 * (high - low), rel=1e-12)


@pytest.mark.parametrize(
    ("call", "path"),
    [
        (lambda: energy_given(1.0, 5.0, 6.0), "low"),
        (lambda: energy_given(-1.0, 6.0, 5.0), "inertia"),
        (lambda: inertia_between(1.0, 5.0, 5.0), "low"),
        (lambda: inertia_for(1.0, 5.0, 2.0), "irregularity"),
        (lambda: inertia_for(1.0, 0.0, 0.1), "mean"),
        (lambda: extreme_speeds(1.0, 2.0, 8.0), "energy"),
        (lambda: speed_after(1.0, 2.0, 2.1), "energy"),
        (lambda: press_work.recovery_time(1.0, 2.0, 3.0, 0.0), "power"),
        (lambda: press_work.recovery_time_on_line(1.0, 2.0, 100.0, *LINE), "high"),
        (lambda: press_work.recovery_time_of_induction(1.0, 2.0, 101.0, 100.0, 60.0, 0.2), "high"),
        (lambda: press_work.steady_on_line(1e-6, *LINE, 600.0, 0.2, 1.0), "load"),
        (lambda: press_work.steady_on_line(1.0, *LINE, 100.0, 1.0, 1.0), "busy"),
        (lambda: press_work.inertia_on_line(0.05, *LINE, 600.0, 0.9, 1.0), "load"),
        (lambda: press_work.inertia_on_line(0.5, *LINE, 100.0, 0.2, 1.0), "irregularity"),
    ],
)
def test_what_cannot_be_is_refused(call, path):
    with pytest.raises(SceneError) as caught:
        call()
    assert [fault.path for fault in caught.value.faults] == [path]


def test_every_fault_is_told_at_once():
    with pytest.raises(SceneError) as caught:
        energy_given(math.nan, -1.0, "fast")
    assert [fault.path for fault in caught.value.faults] == ["inertia", "high", "low"]


def slower(inertia, low, high, torque):
    """Time from one speed to another by quadrature of I dw/T."""
    return quad(lambda w: inertia / torque(w), low, high, epsabs=0.0, epsrel=1e-13)[0]


def kloss(speed):
    slip = (100.0 - speed) / 100.0
    return 2 * 60.0 * slip * 0.2 / (slip**2 + 0.2**2)


@pytest.mark.parametrize(("low", "high"), [(0.0, 99.0), (60.0, 95.0), (90.0, 90.5), (40.0, 40.0)])
def test_recovery_times(low, high):
    constant = press_work.recovery_time(2.0, low, high, 5e3)
    line = press_work.recovery_time_on_line(2.0, low, high, *LINE)
    induction = press_work.recovery_time_of_induction(2.0, low, high, 100.0, 60.0, 0.2)
    assert constant == pytest.approx(slower(2.0, low, high, lambda w: 5e3 / w if w else math.inf), rel=1e-11)
    assert line == pytest.approx(slower(2.0, low, high, lambda w: 500.0 * (1 - w / 100.0)), rel=1e-11)
    assert induction == pytest.approx(slower(2.0, low, high, kloss), rel=1e-11)


@pytest.mark.parametrize(("inertia", "load", "busy"), [(2.0, 120.0, 0.2), (40.0, 450.0, 0.5), (0.5, 300.0, 0.7)])
def test_steady_running_on_a_line_repeats_itself(inertia, load, busy):
    speeds = press_work.steady_on_line(inertia, *LINE, load, busy, 1.0)

    def leg(speed, torque, time):
        def rate(_, w):
            return (500.0 * (1 - w / 100.0) - torque) / inertia

        return solve_ivp(rate, (0.0, time), [speed], rtol=1e-12, atol=1e-12, method="DOP853").y[0, -1]

    assert leg(speeds.high, load, busy) == pytest.approx(speeds.low, rel=1e-10)
    assert leg(speeds.low, 0.0, 1.0 - busy) == pytest.approx(speeds.high, rel=1e-10)


def test_a_heavy_flywheel_on_a_line_settles_where_the_motor_gives_the_mean_load():
    speeds = press_work.steady_on_line(1e9, *LINE, 120.0, 0.2, 1.0)
    assert speeds == pytest.approx((100.0 * (1 - 24.0 / 500.0),) * 2, rel=1e-7)


@pytest.mark.parametrize("irregularity", [1e-6, 0.01, 0.1])
@pytest.mark.parametrize("busy", [0.05, 0.6])
def test_inertia_on_a_line_gives_its_irregularity(irregularity, busy):
    inertia = press_work.inertia_on_line(irregularity, *LINE, 300.0, busy, 1.0)
    speeds = press_work.steady_on_line(inertia, *LINE, 300.0, busy, 1.0)
    assert speeds.irregularity == pytest.approx(irregularity, rel=1e-8)
    assert np.isfinite(inertia)
