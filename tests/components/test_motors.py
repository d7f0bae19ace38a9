"""What holds for every kind of motor: one law of omega alone, its slope, its marks, and the way from torque to speed."""

import math

import numpy as np
import pytest

import flywheel
import flywheel.components.motors
from flywheel.components.motors import DC, Constant, Curve, Engine, Induction, Line, Point
from flywheel.numerics.faults import SceneError
from flywheel.numerics.jets import Jet, jet_namespace

LINEAR = Curve(speeds=(0.0, 60.0, 100.0, 150.0), torques=(20.0, 18.0, 30.0, -5.0))
PCHIP = Curve(speeds=(0.0, 60.0, 100.0, 130.0, 150.0), torques=(20.0, 18.0, 30.0, 24.0, -5.0), interpolation="pchip")
FULL_LOAD = Curve(speeds=(80.0, 140.0, 230.0), torques=(700.0, 900.0, 800.0))
MOTORS = {
    "constant": Constant(value=40.0),
    "line": Line(at_rest=10.0, fall=2.387),
    "table": LINEAR,
    "pchip": PCHIP,
    "dc": DC(voltage=48.0, resistance=0.4, constant=0.25, inductance=0.002, friction=0.002),
    "induction": Induction(power=7500.0, speed=1450 * math.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.5),
    "engine": Engine(speed=150.0, full_load=200.0, droop=0.08, braking_torque=30.0),
    "curved engine": Engine(speed=210.0, full_load=FULL_LOAD, droop=0.07, idle=80.0, braking_torque=100.0),
    "engine without brake": Engine(speed=150.0, full_load=200.0, droop=0.08),
}
RUNNING = {name: motor for name, motor in MOTORS.items() if motor.stable is not None}
SPEEDS = np.linspace(-40.0, 260.0, 1201)


def inside(motor, count: int = 101) -> np.ndarray:
    """Speeds within the running branch, as far as the motor's own scale reaches."""
    reach = 1.5 * motor.no_load_speed
    low, high = max(motor.stable[0], -reach), min(motor.stable[1], reach)
    return np.linspace(low, high, count + 2)[1:-1]


@pytest.mark.parametrize("motor", MOTORS.values(), ids=MOTORS)
def test_the_law_is_the_torque_and_knows_speed_alone(motor):
    law = motor.law()
    assert law.names <= {"omega"}
    assert law.uses_speed == (motor.stable is not None)
    values = np.broadcast_to(law.evaluate({"omega": SPEEDS}, np), SPEEDS.shape)
    np.testing.assert_array_equal(motor.torque(SPEEDS), values)
    assert motor.torque(SPEEDS[1:].reshape(3, -1)).shape == (3, 400)
    assert float(motor.torque(50)) == motor.torque([50.0])[0]


@pytest.mark.parametrize("motor", MOTORS.values(), ids=MOTORS)
def test_slopes_are_those_of_differences(motor):
    speeds, step = SPEEDS + 0.1234, 1e-5  # away from every kink
    difference = (motor.torque(speeds + step) - motor.torque(speeds - step)) / (2 * step)
    np.testing.assert_allclose(motor.slope_at(speeds), difference, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("motor", MOTORS.values(), ids=MOTORS)
def test_torque_is_continuous_and_second_slopes_exist(motor):
    fine = np.linspace(-40.0, 260.0, 300_001)
    steepest = np.abs(motor.slope_at(fine)).max()
    assert np.abs(np.diff(motor.torque(fine))).max() <= 1.001 * steepest * 1e-3 + 1e-12
    jet = motor.law().evaluate({"omega": Jet(fine[:5], np.ones(5), np.zeros(5))}, jet_namespace(np))
    assert np.isfinite(jet.second if isinstance(jet, Jet) else 0.0).all()


@pytest.mark.parametrize("motor", RUNNING.values(), ids=RUNNING)
def test_torque_falls_in_the_running_branch_and_not_beside_it(motor):
    assert (motor.slope_at(inside(motor)) < 0).all()
    step = 1e-3
    if math.isfinite(motor.stable[0]):
        assert motor.slope_at(motor.stable[0] - step) >= 0
        assert motor.breakdown == (motor.stable[0], motor.torque(motor.stable[0]))
        assert motor.breakdown.torque >= motor.torque(inside(motor)).max()
    else:
        assert motor.breakdown is None
    if math.isfinite(motor.stable[1]):
        assert motor.slope_at(motor.stable[1] + step) >= 0


@pytest.mark.parametrize("motor", RUNNING.values(), ids=RUNNING)
def test_no_load_speed_is_where_torque_ends(motor):
    speed = motor.no_load_speed
    assert motor.torque(speed) == pytest.approx(0.0, abs=1e-11)
    assert motor.stable[0] < speed <= motor.stable[1]


@pytest.mark.parametrize("motor", RUNNING.values(), ids=RUNNING)
def test_speed_at_a_torque_lies_on_the_running_branch(motor):
    speeds = inside(motor, 15)
    found = [motor.speed_at(float(torque)) for torque in motor.torque(speeds)]
    np.testing.assert_allclose(found, speeds, rtol=1e-12, atol=1e-12)
    if motor.breakdown is not None:
        assert motor.speed_at(motor.breakdown.torque * (1 + 1e-9)) is None
        assert motor.speed_at(motor.breakdown.torque * (1 - 1e-9)) == pytest.approx(motor.breakdown.speed, rel=1e-4)


@pytest.mark.parametrize("motor", RUNNING.values(), ids=RUNNING)
def test_every_kink_is_a_switch_of_the_law(motor):
    fine = np.linspace(-40.0, 260.0, 30_001)
    jet = motor.law().evaluate({"omega": Jet(fine, np.ones_like(fine), np.zeros_like(fine))}, jet_namespace(np))
    slope, bend = (np.zeros_like(fine) + part for part in (jet.first, jet.second))
    kinks = np.abs(np.diff(slope) - 0.005 * (bend[1:] + bend[:-1])) > 1e-4 * np.abs(slope).max()  # trapezium, h = 0.01
    jumps = np.abs(np.diff(bend)) > 0.01 * np.abs(bend).max() + 1e-9
    crossed = np.zeros_like(kinks)
    for switch in motor.law().switches():
        values = switch.evaluate({"omega": fine}, np)
        crossed |= np.sign(values[1:]) != np.sign(values[:-1])
    smooth = isinstance(motor, (Line, DC, Induction))
    assert crossed[kinks].all()
    assert smooth or crossed[jumps].all()
    assert crossed.any() != smooth


def test_a_constant_torque_has_no_running_branch():
    motor = MOTORS["constant"]
    assert (motor.no_load_speed, motor.stable, motor.breakdown, motor.speed_at(40.0)) == (None, None, None, None)
    assert motor.starting_torque == 40.0


@pytest.mark.parametrize("motor", MOTORS.values(), ids=MOTORS)
def test_what_the_data_cover(motor):
    low, high = motor.covers
    assert low < high
    assert motor.title
    assert motor.starting_torque == motor.torque(0.0)


def test_ranges_of_the_data():
    assert LINEAR.covers == (0.0, 150.0)
    assert MOTORS["curved engine"].covers == (80.0, math.inf)
    assert Engine(speed=150.0, full_load=200.0, droop=0.08, idle=50.0).covers == (50.0, math.inf)
    assert MOTORS["line"].covers == (-math.inf, math.inf)


def test_public_names_exist():
    assert {getattr(flywheel.motors, name).__name__ for name in flywheel.motors.__all__} == set(flywheel.motors.__all__)
    with pytest.raises(AttributeError, match="Steam"):
        flywheel.motors.Steam  # noqa: B018


@pytest.mark.parametrize(
    ("build", "path"),
    [
        (lambda: Constant(value=0.0), "value"),
        (lambda: Constant(value=1.0, inertia=-1.0), "inertia"),
        (lambda: Line(at_rest=10.0, fall=0.0), "fall"),
        (lambda: Line(at_rest=math.nan, fall=1.0), "at_rest"),
        (lambda: DC(voltage=1.0, resistance=0.0, constant=1.0), "resistance"),
        (lambda: DC(voltage=1.0, resistance=1.0, constant=1.0, inductance=-1.0), "inductance"),
        (lambda: Engine(speed=100.0, full_load=-5.0, droop=0.1), "torque"),
        (lambda: flywheel.motors.line_through(100.0, Point(0.0, 1.0)), "speed"),
        (lambda: flywheel.motors.line_from_no_load(-1.0, 1.0), "no_load_speed"),
    ],
)
def test_values_out_of_range_are_refused(build, path):
    with pytest.raises(SceneError) as caught:
        build()
    assert [fault.path for fault in caught.value.faults] == [path]
