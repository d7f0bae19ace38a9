"""Presses: strokes, rates and clutches, against energy and momentum kept by hand."""

import math

import pytest
from scipy.integrate import solve_ivp

from flywheel.components import press_work
from flywheel.components.press_work import inertia_between, inertia_for
from flywheel.numerics.faults import SceneError


def test_a_triangle_of_force_is_the_energy_per_area():
    perimeter, thickness, strength = math.pi * 0.04, 0.015, 400e6
    force = press_work.shearing_force(perimeter, thickness, strength)
    energy = press_work.stroke_energy(force, thickness)
    assert energy == pytest.approx(press_work.cutting_energy(perimeter, thickness, strength * thickness / 2), rel=1e-14)
    assert press_work.stroke_energy(force, thickness, "constant") == 2 * energy


def test_a_press_whose_punch_works_for_a_share_of_its_travel():
    """38 mm holes in 32 mm plate, 7 J/mm², one in 10 s, stroke 100 mm, rim at 25 m/s within 3 %."""
    energy = press_work.cutting_energy(math.pi * 0.038, 0.032, 7e6)
    press = press_work.press_cycle(energy, 10.0, press_work.busy_time(0.032, 0.1, 10.0))
    assert press.power == pytest.approx(math.pi * 38 * 32 * 7 / 10, rel=1e-14)
    assert press.given == pytest.approx(energy * 0.84, rel=1e-14)
    mass = inertia_for(press.given, 25.0, 0.03)
    assert mass == pytest.approx(inertia_between(press.given, 25.0 * 1.015, 25.0 * 0.985), rel=1e-13)


@pytest.mark.parametrize("losses", [(0.8, 1.0), (1.0, 0.8), (0.9, 0.7)])
def test_energy_is_kept_whatever_is_known_first(losses):
    """While the tool works flywheel and motor give what it takes and what is lost on the way; the motor gives all of it."""
    press = press_work.press_cycle(9e3, 4.0, 0.5, *losses)
    after, before = losses
    assert press.motor_power * press.cycle * before * after == pytest.approx(press.energy, rel=1e-15)
    reaching = press.motor_power * before
    assert (press.given + reaching * press.busy) * after == pytest.approx(press.energy, rel=1e-15)
    assert reaching * (press.cycle - press.busy) == pytest.approx(press.given, rel=1e-14)  # what the flywheel gets back
    assert press_work.press_at(9e3, press.motor_power, 0.5, *losses) == pytest.approx(press, rel=1e-14)
    assert press_work.press_of(press.given, 4.0, 0.5, *losses) == pytest.approx(press, rel=1e-14)


def test_the_flywheel_gives_what_is_lost_behind_it():
    """Jindal, example 19.4: 2035.752 J in a sixth of each second, 95 % of the motor's energy reaches the tool."""
    assert press_work.press_cycle(2035.752, 1.0, 1 / 6, 0.95).given == pytest.approx(1785.747, abs=1e-3)
    assert press_work.press_cycle(2035.752, 1.0, 1 / 6, drive_efficiency=0.95).given == pytest.approx(1696.46, abs=1e-3)


def test_a_clutch_loses_what_its_sides_do_not_have():
    met = press_work.engage(30.0, 20.0, 10.0, driven_speed=4.0, torque=80.0)
    assert 40.0 * met.speed == pytest.approx(30.0 * 20.0 + 10.0 * 4.0, rel=1e-15)
    assert met.given == pytest.approx(15.0 * (20.0**2 - met.speed**2), rel=1e-14)
    assert met.taken == pytest.approx(5.0 * (met.speed**2 - 4.0**2), rel=1e-14)
    assert met.heat == pytest.approx(met.given - met.taken, rel=1e-14)
    assert 20.0 - 80.0 / 30.0 * met.time == pytest.approx(met.speed, rel=1e-14)
    assert 4.0 + 80.0 / 10.0 * met.time == pytest.approx(met.speed, rel=1e-14)


def test_the_heat_is_the_clutch_torque_over_the_slip_however_it_varies():
    def rates(time, state):
        torque = 200.0 * time * (3.0 + math.sin(40.0 * time))
        return [-torque / 30.0, torque / 10.0, torque * (state[0] - state[1])]

    def slip(_, state):
        return state[0] - state[1]

    slip.terminal = True
    end = solve_ivp(rates, (0.0, 10.0), [20.0, 0.0, 0.0], rtol=1e-11, atol=1e-11, events=slip, method="DOP853").y[:, -1]
    met = press_work.engage(30.0, 20.0, 10.0)
    assert end == pytest.approx([met.speed, met.speed, met.heat], rel=1e-8)


def test_nothing_behind_the_clutch_loses_nothing():
    stroke = press_work.single_stroke(2.0, 30.0, 500.0)
    assert stroke.engagement.heat == 0.0
    assert stroke.speed == pytest.approx(20.0, rel=1e-15)
    assert stroke.slow_down == pytest.approx(1 / 3, rel=1e-14)


def test_a_single_stroke_keeps_account_of_all_energy():
    stroke = press_work.single_stroke(12.0, 40.0, 3e3, driven_inertia=1.5, power=2e3, busy=0.3)
    before, after = 6.0 * 40.0**2, 6.75 * stroke.speed**2
    assert before + 2e3 * 0.3 == pytest.approx(after + 3e3 + stroke.engagement.heat, rel=1e-14)


def test_a_single_stroke_pays_for_its_losses():
    """The tool's 3 kJ are 80 % of what the shaft gives, and 90 % of the motor's power reach it."""
    losses = {"efficiency": 0.8, "drive_efficiency": 0.9}
    stroke = press_work.single_stroke(12.0, 40.0, 3e3, driven_inertia=1.5, power=2e3, busy=0.3, **losses)
    assert stroke.energy == pytest.approx(3e3 / 0.8 - 0.9 * 2e3 * 0.3, rel=1e-14)
    plain = press_work.single_stroke(12.0, 40.0, 3e3 / 0.8, driven_inertia=1.5, power=1.8e3, busy=0.3)
    assert stroke.speed == pytest.approx(plain.speed, rel=1e-14)


@pytest.mark.parametrize(("low", "driven"), [(35.0, 0.0), (35.0, 2.0), (0.0, 2.0), (39.9, 0.1)])
def test_the_flywheel_of_a_single_stroke(low, driven):
    inertia = press_work.inertia_for_single_stroke(40.0, low, 3e3, driven)
    assert press_work.single_stroke(inertia * (1 + 1e-12), 40.0, 3e3, driven).speed == pytest.approx(low, rel=1e-9, abs=1e-3)
    if driven == 0.0:
        assert inertia == pytest.approx(inertia_between(3e3, 40.0, low), rel=1e-14)


@pytest.mark.parametrize(
    ("call", "paths"),
    [
        (lambda: press_work.shearing_force(0.0, -1.0, math.inf), ["perimeter", "thickness", "strength"]),
        (lambda: press_work.stroke_energy(1.0, 1.0, "square"), ["shape"]),
        (lambda: press_work.cutting_energy(1.0, 1.0, "6"), ["energy_per_area"]),
        (lambda: press_work.busy_time(0.2, 0.1, 1.0), ["travel"]),
        (lambda: press_work.press_cycle(1.0, 2.0, 2.0, 1.1), ["busy", "efficiency"]),
        (lambda: press_work.press_cycle(1.0, 2.0, 1.0, 0.0, 1.1), ["efficiency", "drive_efficiency"]),
        (lambda: press_work.single_stroke(2.0, 30.0, 500.0, efficiency=95.0), ["efficiency"]),
        (lambda: press_work.press_at(1e3, 1e3, 1.5), ["busy"]),
        (lambda: press_work.press_of(1e3, 1.0, 1.0), ["busy"]),
        (lambda: press_work.engage(1.0, 2.0, 1.0, 3.0), ["driven_speed"]),
        (lambda: press_work.engage(1.0, 2.0, 1.0, torque=0.0), ["torque"]),
        (lambda: press_work.single_stroke(1.0, 2.0, 3.0), ["energy"]),
        (lambda: press_work.inertia_for_single_stroke(1.0, 1.0, 3.0), ["low"]),
    ],
)
def test_what_cannot_be_is_refused(call, paths):
    with pytest.raises(SceneError) as caught:
        call()
    assert [fault.path for fault in caught.value.faults] == paths
