"""Servo drives: torque within the peak curve, rms point, peak point, losses by the continuous curve, ratio of inertias."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import flywheel
from flywheel import SceneError, language
from flywheel.components.motors import Servo
from flywheel.page import data as page_data
from flywheel.pictures import sizing as pictures
from tests.limits import sample

RPM = math.pi / 30
MOTOR = """type = "servo"
speed = "3000 rpm"
torque = "8 N m"
standstill_torque = "10 N m"
peak_torque = "{peak} N m"
corner_speed = "{corner} rpm"
maximum_speed = "5000 rpm"
set_speed = "{asked} rpm"
efficiency = "90 %"
inertia = "8 kg cm^2"
"""
SCENE = """
[shafts.motor]
ratio = 5
[[inertia]]
on = "crank"
value = {inertia}
[[load]]
on = "crank"
torque = "-{load}*(1 - cos(phi))"
[drive]
on = "motor"
[drive.motor]
{motor}{more}
[flywheel]
inertia = 0
"""
RATED, REST, LAST = 300 * math.pi / 3, 10.0, 5000 * RPM


def scene(load=30, peak=30, corner=2500, request=1500, inertia=0.05, more=""):
    motor = MOTOR.format(peak=peak, corner=corner, asked=request)
    return flywheel.load(SCENE.format(load=load, motor=motor, inertia=inertia, more=more))


def limit(omega, peak, corner):
    return min(peak, max(0.0, peak * (LAST - abs(omega)) / (LAST - corner * RPM)))


def hand(omega, peak=30.0, corner=2500, request=1500):
    """Torque by the definition of the drive, at its shaft."""
    most = limit(omega, peak, corner)
    return min(most, max(-most, 8.0 / (0.01 * request * RPM) * (request * RPM - omega)))


def continuous(omega):
    return REST - 2.0 * omega / RATED


@pytest.mark.parametrize(
    ("load", "peak", "corner", "asked", "inertia"),
    sample(
        [(30, 11, 2500, 1500, 0.4), (30, 30, 2500, 1500, 0.05), (16, 20, 2500, 4000, 0.3)], 3
    ),  # cut off, free, beyond the corner
)
def test_a_cycle_is_that_of_the_equation_of_motion(load, peak, corner, asked, inertia):
    result = flywheel.size(scene(load, peak, corner, asked, inertia))
    whole = inertia + 25 * 8e-4

    def rates(phi, y):
        torque, omega = hand(5 * y[0], peak, corner, asked), 5 * y[0]
        heat = 8 * RATED * (1 / 0.9 - 1) * (torque**2 + REST**2 - continuous(omega) ** 2) / REST**2
        speed = (5 * torque - load * (1 - math.cos(phi))) / (whole * y[0])
        return [speed, *(value / y[0] for value in (1.0, omega, torque**2, heat, torque * omega))]

    def cycle(begin):
        return solve_ivp(
            rates, (0, 2 * math.pi), [begin, *[0.0] * 5], method="DOP853", rtol=1e-11, atol=1e-12, max_step=0.02
        )

    idle = asked * RPM / 5
    begin = brentq(lambda w: cycle(w).y[0, -1] - w, 0.6 * idle, idle, xtol=1e-12)
    run = cycle(begin)
    time, turned, square, heat, work = run.y[1:, -1]
    servo, energy = result.servo, result.energy
    assert servo.mean_speed == pytest.approx(turned / time, rel=1e-9)
    assert servo.rms_torque == pytest.approx(math.sqrt(square / time), rel=1e-7)
    assert servo.continuous_share == pytest.approx(servo.rms_torque / continuous(turned / time), rel=1e-7)
    assert energy.copper_heat == pytest.approx(heat / time, rel=1e-7)
    assert result.inverter.power == pytest.approx((work + heat) / time, rel=1e-7)
    shares = [abs(hand(5 * w, peak, corner, asked)) / limit(5 * w, peak, corner) for w in run.y[0]]
    assert servo.peak_share == pytest.approx(max(shares), abs=2e-4)
    assert servo.at_peak == (max(shares) == 1.0) == any("PEAK CURVE" in line for line in result.messages)
    at = run.t[int(np.argmax(np.array(shares) >= (1.0 if servo.at_peak else max(shares))))]
    assert servo.peak_angle == pytest.approx(at, abs=0.03)
    assert servo.peak_speed == pytest.approx(5 * float(np.interp(servo.peak_angle, run.t, run.y[0])), rel=1e-4)
    if not servo.at_peak:  # its place is one angle, at which torque and speed are those of the equation of motion
        fine = np.linspace(servo.peak_angle - 0.01, servo.peak_angle + 0.01, 20001)
        dense = solve_ivp(rates, (0, fine[-1]), run.y[:, 0], "DOP853", fine, rtol=1e-11, atol=1e-12, max_step=0.02).y[0]
        shares = [abs(hand(5 * w, peak, corner, asked)) / limit(5 * w, peak, corner) for w in dense]
        k = int(np.argmax(shares))
        assert abs(servo.peak_angle - fine[k]) <= servo.errors["peak_angle"] + 1e-6 < 1e-3
        assert abs(servo.peak_speed / (5 * dense[k]) - 1) <= servo.errors["peak_speed"] + 1e-9 < 1e-6
        torque = hand(5 * dense[k], peak, corner, asked)
        assert abs(servo.peak_torque / torque - 1) <= servo.errors["peak_torque"] + 1e-9 < 1e-6
    assert servo.inertia_ratio == pytest.approx(inertia / 25 / 8e-4, rel=1e-12)
    assert any("hard to damp" in line for line in result.messages) == (servo.inertia_ratio > 10)


def test_the_share_of_the_peak_curve_is_within_its_error_where_the_law_bends_steeply():
    """The law is cut off at 1; the cell beside the bend goes on straight, 57 times as steep as the speed."""
    for rtol in (1e-6, 1e-9, 1e-11):
        servo = flywheel.size(scene(60, 14, 3000, 2200, 0.2), rtol).servo
        assert abs(servo.peak_share - 1) <= servo.errors["peak_share"] <= 1e-7
        assert servo.at_peak
        assert servo.peak_angle == 0.0  # on the whole of a flat stretch that begins there
        stretch = servo.errors["peak_angle"]
        assert 0.19 < stretch < 0.2


PHASES = """
[[duty]]
name = "heavy"
duration = "6 s"
[[duty]]
name = "light"
duration = "9 s"
loads = 0.3
[[duty]]
name = "rest"
duration = "3 s"
rest = true
standstill_cooling = 0.5
"""


@pytest.mark.slow
def test_a_duty_warms_the_windings_as_the_losses_of_its_motion_do():
    """Two time constants beside cycles of 0.2 s: what rises within one is in the error."""
    warms = (0.6 * 80.0, 20.0), (0.4 * 80.0, 3.0)
    more = (
        'thermal = {time_constant = "20 s", rise = "80 K", class = "F", winding_time_constant = "3 s", winding_share = 0.4}'
    )
    duty = flywheel.load(
        SCENE.format(load=30, motor=MOTOR.format(peak=30, corner=2500, asked=1500), inertia=0.4, more=more) + PHASES
    )
    result, whole = flywheel.size(duty), 0.4 + 25 * 8e-4

    def rates(t, y, load):
        torque, omega = hand(5 * y[1]), 5 * y[1]
        q = (torque**2 + REST**2 - continuous(omega) ** 2) / REST**2
        heats = [(rise * q - part) / time for part, (rise, time) in zip(y[2:], warms, strict=True)]
        return [y[1], (5 * torque - load * (1 - math.cos(y[0]))) / whole, *heats]

    rises, speed = np.zeros(2), 30.0
    for _ in range(8):
        ends, top = [], 0.0
        for load, time in ((30.0, 6.0), (9.0, 9.0)):
            start = [0.0, speed, *rises]
            run = solve_ivp(rates, (0, time), start, args=(load,), method="LSODA", rtol=1e-8, atol=1e-9, max_step=0.02)
            rises, speed, top = run.y[2:, -1], run.y[1, -1], max(top, float(run.y[2:].sum(axis=0).max()))
            ends.append(float(rises.sum()))
        rises, speed = rises * np.exp([-0.5 * 3 / 20, -3 / 3]), 31.2
        ends.append(float(rises.sum()))
    error = result.temperature.error * result.temperature.greatest
    assert abs(result.temperature.greatest - top) < error < 0.03 * top
    assert all(abs(rise - end) < error for (_, rise), end in zip(result.temperature.phases, ends, strict=True))


def test_losses_on_the_continuous_curve_are_those_it_bears_for_ever():
    servo = scene().motor
    bears = 8 * RATED / 0.9 - 8 * RATED
    for omega in (0.0, 100.0, RATED):
        assert float(servo.losses_at(omega, continuous(omega))) == pytest.approx(bears, rel=1e-12)
    assert servo.rated_heat == pytest.approx(bears)
    wound = scene(more="").motor.__class__(
        speed=RATED, continuous_torque=8.0, set_speed=157.0, peak_torque=30.0, corner_speed=260.0, maximum_speed=523.0,
        losses=1.5 * 0.8 * (10.0 / 1.3) ** 2, standstill_torque=10.0, torque_constant=1.3,
    )  # fmt: skip
    text = MOTOR.format(peak=30, corner=2500, asked=1500).replace(
        'efficiency = "90 %"', "resistance = 0.8\ntorque_constant = 1.3"
    )
    read = flywheel.load(SCENE.format(load=30, motor=text, inertia=0.05, more="")).motor
    assert read.losses == pytest.approx(wound.losses, rel=1e-12)
    assert read.rated_current == pytest.approx(8.0 / 1.3)


def test_a_start_is_by_the_peak_torque():
    run = flywheel.run_up(scene(load=0.001, inertia=0.4))
    whole, gain = 0.4 / 25 + 8e-4, 8.0 / (0.01 * 1500 * RPM)
    rising = quad(lambda w: whole / 30.0, 0.0, 1500 * RPM - 30.0 / gain)[0]
    assert run.time > rising
    omega = float(np.interp(rising, run.motion.t, run.motion.omega))
    assert 5 * omega == pytest.approx(1500 * RPM - 30.0 / gain, rel=1e-3)


def test_windings_of_a_servo_drive_rise_by_its_losses():
    result = flywheel.size(scene(more='thermal = {time_constant = "30 min", class = "F"}'))
    assert result.temperature.greatest == pytest.approx(105 * result.energy.copper_heat_share, rel=1e-4)  # and its ripple


def test_a_load_that_drives_trips_it_without_a_resistor():
    result = flywheel.size(scene(load=-10))
    (trip,) = result.inverter.trips
    assert trip.kind == "overvoltage"
    assert trip.value == pytest.approx(-result.inverter.power_least)
    assert flywheel.size(scene(load=-10, more='braking = "regenerative"')).inverter.trips == ()


@pytest.mark.parametrize(
    ("old", "new", "paths"),
    [
        ('"2500 rpm"', '"6000 rpm"', ["corner_speed"]),
        ('"1500 rpm"', '"5000 rpm"', ["set_speed"]),
        ('"30 N m"', '"9 N m"', ["peak_torque"]),
        ('"10 N m"', '"7 N m"', ["standstill_torque"]),
        ('efficiency = "90 %"', "resistance = 0.8", ["torque_constant"]),
        ('efficiency = "90 %"', 'efficiency = "90 %"\nresistance = 0.8', [""]),
        ('inertia = "8 kg cm^2"', 'braking = "resistor"', ["chopper_power"]),
    ],
)
def test_a_fault_of_a_servo_drive_has_its_place(old, new, paths):
    motor = MOTOR.format(peak=30, corner=2500, asked=1500)
    assert old in motor
    with pytest.raises(SceneError) as caught:
        flywheel.load(SCENE.format(load=30, motor=motor.replace(old, new), inertia=0.05, more=""))
    assert [fault.path for fault in caught.value.faults] == [f"drive.motor.{path}".rstrip(".") for path in paths]


def test_the_running_branch_ends_where_the_peak_curve_cuts_it_off():
    for request in (1500, 3000, 4500):
        servo = scene(request=request).motor
        assert isinstance(servo, Servo)
        low, high = servo.stable
        inside = np.linspace(low + 1e-6, high - 1e-6, 200)
        assert (np.diff(servo.torque(inside)) < 0.0).all()
        assert float(servo.torque(low - 1.0)) <= float(servo.torque(low)) + 1e-9
        assert float(servo.torque(high + 1.0)) >= float(servo.torque(high)) - 1e-9


def test_the_diagram_has_the_area_the_loop_and_both_points():
    result = flywheel.size(scene(peak=11, inertia=0.4))
    panel = page_data.answer(result, {"panels": ["servo"]})["servo"]
    speeds = np.array(panel["speeds"])
    assert panel["peak"] == pytest.approx([limit(w, 11.0, 2500) for w in speeds], abs=1e-9)
    within = np.minimum(continuous(speeds), [limit(w, 11.0, 2500) for w in speeds])
    assert panel["continuous"] == pytest.approx(within, abs=1e-9)
    assert panel["torque"] == pytest.approx([hand(w, 11.0) for w in panel["speed"]], abs=1e-7)
    rms, peak = panel["diagram"]["rows"][0]["marks"]
    assert (rms["at"], rms["value"]) == (result.servo.mean_speed, result.servo.rms_torque)
    assert (peak["at"], peak["value"]) == (result.servo.peak_speed, result.servo.peak_torque)


@pytest.mark.usefixtures("blank")
def test_the_report_has_its_points_and_its_picture():
    result = flywheel.size(scene(), simulate=False)
    for name, words, curve in (("en", "Inertia ratio", "peak curve"), ("es", "Relación de inercias", "curva de pico")):
        assert words in flywheel.report.html(result, language=name)
        with language.use(name):
            assert curve in pictures.panel(result, "servo")
