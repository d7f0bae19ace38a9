"""The DC motor against its differential equations, solved exactly, and its bond graph against both."""

import numpy as np
import pytest
from scipy.linalg import expm

from bondgraph import Builder, I, Se, simulate
from flywheel.components.motors import DC, Point, dc_from_plate
from flywheel.numerics.faults import SceneError

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
    net = (MOTOR.torque_of_current(omega, current) - LOAD) / (MOTOR.inertia + INERTIA)
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
        assert MOTOR.torque(omega) == pytest.approx(MOTOR.torque_of_current(omega, current), rel=1e-13, abs=1e-13)
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
