"""Motors: curves, direct current, hydraulic, two speeds."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.linalg import expm
from scipy.optimize import brentq

import flywheel
import flywheel.components.motors
from bondgraph import Builder, I, Se, simulate
from flywheel import SceneError
from flywheel.components import press_work
from flywheel.components.motors import DC, Constant, Curve, Engine, Hydraulic, Induction, Line, Point, dc_from_plate
from flywheel.components.press_work import Speeds, energy_given, extreme_speeds, inertia_between, inertia_for, speed_after
from flywheel.numerics.jets import Jet, jet_namespace

# What holds for every kind of motor: one law of omega alone, its slope, its marks, and the way from torque to speed.


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
    result = [motor.speed_at(float(torque)) for torque in motor.torque(speeds)]
    np.testing.assert_allclose(result, speeds, rtol=1e-12, atol=1e-12)
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


# Curves of rows: between them numpy's and SciPy's interpolation, beyond them straight on.


CURVE_SPEEDS = (0.0, 60.0, 100.0, 130.0, 150.0)
TORQUES = (20.0, 18.0, 30.0, 24.0, -5.0)


def curve(speeds=CURVE_SPEEDS, torques=TORQUES, **kwargs) -> Curve:
    return Curve(speeds=tuple(speeds), torques=tuple(torques), **kwargs)


def test_linear_between_the_rows():
    inside = np.linspace(0.0, 150.0, 977)
    np.testing.assert_allclose(curve().torque(inside), np.interp(inside, CURVE_SPEEDS, TORQUES), rtol=1e-13, atol=1e-13)
    np.testing.assert_array_equal(curve().torque(CURVE_SPEEDS[:-1]), TORQUES[:-1])


def test_pchip_between_the_rows():
    inside = np.linspace(0.0, 150.0, 977)
    motor = curve(interpolation="pchip")
    np.testing.assert_allclose(
        motor.torque(inside), PchipInterpolator(CURVE_SPEEDS, TORQUES)(inside), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize("interpolation", ["linear", "pchip"])
def test_straight_on_beyond_the_rows(interpolation):
    motor = curve(interpolation=interpolation)
    for start, side in ((0.0, -1.0), (150.0, 1.0)):
        slope = motor.slope_at(start + 1e-9 * -side)
        far = start + side * np.array([1.0, 20.0, 300.0])
        np.testing.assert_allclose(motor.torque(far), motor.torque(start) + slope * (far - start), rtol=1e-7)
        np.testing.assert_allclose(np.diff(motor.slope_at(far)), 0.0, atol=1e-14)


def test_many_rows_make_a_shallow_tree():
    speeds = np.linspace(0.0, 157.0, 200)
    torques = 30 + 10 * np.sin(speeds / 20) - (speeds / 100) ** 4 * 6
    motor = curve(speeds, torques)
    probe = np.linspace(0.0, 157.0, 1001)
    np.testing.assert_allclose(motor.torque(probe), np.interp(probe, speeds, torques), rtol=1e-12)

    def depth(node) -> int:
        return 1 + max((depth(arg) for arg in node.args), default=0)

    assert depth(motor.law().tree) <= 14
    assert len(motor.law().switches()) == 198


@pytest.mark.parametrize(
    ("torques", "interpolation", "expected"),
    [
        ((20.0, 18.0, 30.0, 24.0, 6.0), "linear", 150 + 20 / 3),
        ((20.0, 18.0, 30.0, 24.0, 0.0), "linear", 150.0),
        ((20.0, 18.0, 30.0, 0.0, -4.0), "linear", 130.0),
        ((20.0, -18.0, 30.0, -6.0, -7.0), "linear", 125.0),
        ((20.0, 18.0, 30.0, 24.0, 26.0), "linear", None),
        ((20.0, 18.0, 30.0, 24.0, 24.0), "pchip", None),
    ],
)
def test_no_load_speed(torques, interpolation, expected):
    result = curve(torques=torques, interpolation=interpolation).no_load_speed
    assert result is expected is None or result == pytest.approx(expected, rel=1e-14)


def test_no_load_speed_of_cubics():
    motor = curve(interpolation="pchip")
    (root,) = (r for r in PchipInterpolator(CURVE_SPEEDS, TORQUES).roots(extrapolate=False))
    assert motor.no_load_speed == pytest.approx(root, rel=1e-13)
    beyond = curve(torques=(20.0, 18.0, 30.0, 24.0, 6.0), interpolation="pchip")
    slope = PchipInterpolator(CURVE_SPEEDS, (20.0, 18.0, 30.0, 24.0, 6.0))(150.0, 1)
    assert beyond.no_load_speed == pytest.approx(150.0 - 6.0 / slope, rel=1e-13)


@pytest.mark.parametrize(
    ("torques", "interpolation", "expected"),
    [
        (TORQUES, "linear", (100.0, math.inf)),
        ((20.0, 18.0, 10.0, 4.0, 0.0), "linear", (-math.inf, math.inf)),
        ((20.0, 18.0, 30.0, 24.0, 26.0), "linear", (100.0, 130.0)),
        ((20.0, 21.0, 30.0, -5.0, 8.0), "linear", (100.0, 130.0)),
        ((20.0, 21.0, 30.0, -5.0, -5.0), "linear", (100.0, 130.0)),
        ((20.0, 18.0, 30.0, 5.0, -0.0), "pchip", (100.0, math.inf)),
        ((20.0, 20.0, 18.0, 9.0, 8.0), "pchip", (60.0, 150.0)),  # pchip ends flat there
        ((1.0, 2.0, 3.0, 3.0, 4.0), "linear", None),
    ],
)
def test_running_branch(torques, interpolation, expected):
    assert curve(torques=torques, interpolation=interpolation).stable == expected


def test_a_torque_that_never_falls_finds_no_speed():
    assert curve(torques=(1.0, 2.0, 3.0, 3.0, 4.0)).speed_at(2.0) is None
    assert curve(torques=(20.0, 18.0, 30.0, 24.0, 26.0)).speed_at(5.0) is None


@pytest.mark.parametrize(
    ("change", "path", "hint"),
    [
        ({"speeds": (0.0, 60.0, 60.0, 130.0, 150.0)}, "speed[2]", "ascend"),
        ({"speeds": (0.0, 60.0, 50.0, 130.0, 150.0)}, "speed[2]", "50 rad/s after 60 rad/s"),
        ({"speeds": (0.0, 60.0)}, "torque", "2 speeds and 5 torques"),
        ({"speeds": (0.0, math.nan, 1.0, 2.0, 3.0)}, "speed[1]", "finite"),
        ({"speeds": (0.0,), "torques": (1.0,)}, "speed", "2 to 200"),
        ({"torques": (0.0, -1.0, -2.0, -3.0, -4.0)}, "torque", "above 0"),
        ({"interpolation": "pchipp"}, "interpolation", 'did you mean "pchip"?'),
    ],
)
def test_rows_that_make_no_curve(change, path, hint):
    with pytest.raises(SceneError) as caught:
        curve(**change)
    (fault,) = caught.value.faults
    assert fault.path == path
    assert hint in str(fault)


# The DC motor against its differential equations, solved exactly, and its bond graph against both.


MOTOR = DC(voltage=48.0, resistance=0.4, constant=0.25, inductance=0.002, friction=0.002, inertia=0.004)
LOAD, INERTIA = 3.0, 0.05  # N m, kg m², on the shaft


def system(motor: DC) -> tuple[np.ndarray, np.ndarray]:
    """Matrix A and vector b of d(i, omega)/dt = A (i, omega) + b, written down afresh."""
    inertia = motor.inertia + INERTIA
    matrix = np.array(
        [
            [-motor.resistance / motor.inductance, -motor.constant / motor.inductance],
            [motor.constant / inertia, -motor.friction / inertia],
        ]
    )
    return matrix, np.array([motor.voltage / motor.inductance, -LOAD / inertia])


def exact(motor: DC, times: np.ndarray) -> np.ndarray:
    """Current and speed from rest: x(t) = (exp(A t) - 1) A^-1 b, shape (2, n)."""
    matrix, vector = system(motor)
    steady = np.linalg.solve(matrix, vector)
    return np.stack([(expm(matrix * t) - np.eye(2)) @ steady for t in times], axis=1)


def machine(motor: DC):
    b = Builder().include("motor", motor.graph())
    return b.on("motor.rotor", I("load inertia", INERTIA), Se("load", -LOAD)).build()


def test_rates_are_those_of_the_equations():
    matrix, vector = system(MOTOR)
    current, omega = np.array([0.0, 20.0, -5.0]), np.array([0.0, 100.0, 190.0])
    rates = matrix @ np.stack([current, omega]) + vector[:, None]
    np.testing.assert_allclose(MOTOR.current_rate(omega, current), rates[0], rtol=1e-14)
    net = (MOTOR.circuit.torque(omega, (current,)) - LOAD) / (MOTOR.inertia + INERTIA)
    np.testing.assert_allclose(net, rates[1], rtol=1e-13)


def test_the_bond_graph_runs_up_as_the_equations_do():
    times = np.linspace(0.0, 0.4, 9)
    run = simulate(machine(MOTOR), 0.4, rtol=1e-10)
    current, speed = exact(MOTOR, times)
    np.testing.assert_allclose(run.flow("motor.armature", times), current, rtol=1e-7, atol=1e-6)
    np.testing.assert_allclose(run.flow("motor.rotor", times), speed, rtol=1e-7, atol=1e-6)


def test_without_inductance_the_bond_graph_follows_the_straight_line():
    motor = DC(voltage=48.0, resistance=0.4, constant=0.25, friction=0.002)
    times = np.linspace(0.0, 0.5, 9)
    run = simulate(machine(motor), 0.5, rtol=1e-10)
    line = motor.quasi_static
    end, rate = (line.at_rest - LOAD) / line.fall, line.fall / INERTIA
    np.testing.assert_allclose(run.flow("motor.rotor", times), end * -np.expm1(-rate * times), rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(
        run.flow("motor.armature", times[1:]), motor.current(run.flow("motor.rotor", times[1:])), rtol=1e-7
    )


def test_the_law_is_the_steady_state_of_the_equations():
    for omega in (-20.0, 0.0, 100.0, 189.0, 250.0):
        current = MOTOR.current(omega)
        assert MOTOR.current_rate(omega, current) == pytest.approx(0.0, abs=1e-9)
        assert MOTOR.torque(omega) == pytest.approx(MOTOR.circuit.torque(omega, (current,)), rel=1e-13, abs=1e-13)
    matrix, vector = system(MOTOR)
    current, omega = -np.linalg.solve(matrix, vector)
    assert MOTOR.speed_at(LOAD) == pytest.approx(omega, rel=1e-13)
    assert MOTOR.current(omega) == pytest.approx(current, rel=1e-12)
    assert MOTOR.time_constant == pytest.approx(0.005)


def test_parts_that_are_not_there_are_left_out():
    bare = DC(voltage=48.0, resistance=0.4, constant=0.25)
    assert set(MOTOR.graph().elements) - set(bare.graph().elements) == {"inductance", "inertia", "friction"}
    with pytest.raises(SceneError, match=r"inductance: found 0 H.*follows the speed"):
        bare.current_rate(0.0, 0.0)


@pytest.mark.parametrize("share", [0.3, 0.5, 1.0])
def test_a_name_plate_gives_back_its_point_and_balances_power(share):
    voltage, current, rated = 220.0, 24.0, Point(157.0, 30.0)
    motor = dc_from_plate(voltage, rated, current, share)
    assert motor.torque(rated.speed) == pytest.approx(rated.torque, rel=1e-13)
    assert motor.current(rated.speed) == pytest.approx(current, rel=1e-12)
    assert motor.rated == rated
    copper, rubbed = motor.resistance * current**2, motor.friction * rated.speed**2
    assert copper + rubbed == pytest.approx(voltage * current - rated.power, rel=1e-12)
    assert copper == pytest.approx(share * (copper + rubbed), rel=1e-12)


def test_half_the_losses_in_the_armature_make_efficiency_greatest_near_rated_load():
    best = {}
    for share in (0.25, 0.5, 0.9):
        motor = dc_from_plate(220.0, Point(157.0, 30.0), 24.0, share)
        speeds = np.linspace(0.8, 1.0, 20_001)[:-1] * motor.no_load_speed
        efficiency = motor.torque(speeds) * speeds / (motor.voltage * motor.current(speeds))
        best[share] = motor.current(speeds[efficiency.argmax()])
    assert best[0.5] == pytest.approx(24.0, rel=0.1)
    assert best[0.9] < 0.5 * 24.0
    assert best[0.25] > 1.4 * 24.0


@pytest.mark.parametrize(
    ("arguments", "path"),
    [
        ((220.0, Point(157.0, 40.0), 24.0), "power"),
        ((220.0, Point(157.0, 30.0), 24.0, 1.2), "armature_share"),
        ((220.0, Point(157.0, 30.0), 24.0, 0.0), "armature_share"),
        ((220.0, Point(157.0, 30.0), -1.0), "current"),
        ((220.0, Point(0.0, 30.0), 24.0), "speed"),
    ],
)
def test_name_plates_that_cannot_be(arguments, path):
    with pytest.raises(SceneError) as caught:
        dc_from_plate(*arguments)
    assert [fault.path for fault in caught.value.faults] == [path]


# A hydraulic motor against its flow balance, and a textbook's.


DATA = {
    "displacement": 164e-6,
    "flow": 0.006,
    "pressure": 70e5,
    "volumetric_efficiency": 0.92,
    "mechanical_efficiency": 0.93,
}


def by_flows(motor: Hydraulic, omega: float) -> float:
    """Torque by the pressure at which pump, motor, leakage and valve have the same flow."""
    d = motor.displacement / (2 * math.pi)
    leak = (1 - motor.volumetric_efficiency) * motor.flow / motor.pressure

    def left(p: float) -> float:
        through = motor.flow * (p / motor.pressure - 1) / motor.override if p > motor.pressure else 0.0
        return motor.flow - d * omega - leak * p - through

    p = brentq(left, -10 * motor.pressure, 10 * motor.pressure, xtol=1e-6, rtol=1e-15)
    return d * p * (motor.mechanical_efficiency if p > 0 else 1 / motor.mechanical_efficiency)


def test_torque_is_that_of_the_flow_balance():
    motor = Hydraulic(**DATA, override=0.15)
    speeds = np.array(
        [-20.0, 0.0, 60.0, 150.0, 0.9 * motor.no_load_speed, 0.95 * motor.no_load_speed, motor.no_load_speed + 5]
    )
    np.testing.assert_allclose(motor.torque(speeds), [by_flows(motor, omega) for omega in speeds], rtol=1e-10)


def test_a_textbook_motor():
    """Esposito, Fluid Power with Applications, 7th ed., example 7-9: 164 cm³, 70 bar, 2000 rpm, 0.006 m³/s, 170 N m.

    Printed: volumetric efficiency 91.1 %, mechanical 93.0 %, overall 84.8 %, 35.6 kW.
    """
    share = 164e-6 * 2000 / 60 / 0.006
    mechanical = 170.0 / (164e-6 * 70e5 / (2 * math.pi))
    assert (100 * share, 100 * mechanical) == pytest.approx((91.1, 93.0), abs=0.06)
    motor = Hydraulic(**DATA | {"volumetric_efficiency": share, "mechanical_efficiency": mechanical})
    assert motor.rated.speed == pytest.approx(2000 * math.pi / 30, rel=1e-13)
    assert motor.rated.torque == pytest.approx(170.0, rel=1e-13)
    assert motor.rated.power / 1e3 == pytest.approx(35.6, abs=0.05)
    assert 100 * motor.rated.power / (70e5 * 0.006) == pytest.approx(84.8, abs=0.05)


def test_marks_of_the_curve():
    motor = Hydraulic(**DATA)
    assert motor.torque(motor.rated.speed) == pytest.approx(motor.rated.torque, rel=1e-13)
    assert motor.torque([0.0, 100.0]).tolist() == [motor.rated.torque] * 2
    assert motor.breakdown.speed == motor.rated.speed
    assert motor.speed_at(motor.rated.torque / 2) == pytest.approx(0.96 * motor.no_load_speed, rel=1e-12)
    high = motor.stable[1]
    assert motor.torque(high) == pytest.approx(-motor.rated.torque / 0.93**2, rel=1e-12)
    assert motor.torque(high + 50) == pytest.approx(float(motor.torque(high)), rel=1e-12)
    assert Hydraulic(**DATA, override=0.1).stable[0] == -math.inf


def test_a_press_runs_on_oil():
    scene = {
        "load": [{"on": "crank", "torque": "-300 N m", "from": 0, "to": "90 deg"}],
        "drive": {
            "motor": {
                "type": "hydraulic",
                "displacement": "164 cm^3",
                "flow": "360 l/min",
                "pressure": "70 bar",
                "volumetric_efficiency": "92 %",
                "mechanical_efficiency": "93 %",
            }
        },
        "flywheel": {"irregularity": "4 %"},
    }
    result = flywheel.size(flywheel.load(scene), simulate=False)
    assert result.scene.motor.flow == pytest.approx(0.006, rel=1e-15)
    assert result.energy.mean_power == pytest.approx(300 * math.pi / 2 / result.energy.period, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"volumetric_efficiency": 1.0}, "volumetric_efficiency"),
        ({"mechanical_efficiency": 1.1}, "mechanical_efficiency"),
        ({"pressure": -1.0}, "pressure"),
        ({"flow": 0.0}, "flow"),
        ({"override": -0.1}, "override"),
    ],
)
def test_faulty_motors(change, path):
    with pytest.raises(SceneError) as caught:
        Hydraulic(**DATA | change)
    (fault,) = caught.value.faults
    assert fault.path == path


# A flywheel between two speeds, against energies and motions integrated another way.


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
