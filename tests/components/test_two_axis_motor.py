"""Induction motors with fluxes as states: against Krause's equations written by hand, and against the static circuit."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import flywheel
from flywheel.components.motors import Impedances, Induction, Plate, TwoAxisInduction
from flywheel.components.motors.two_axis import impedances_of
from flywheel.motions.transients import transient
from flywheel.numerics.faults import SceneError

# Krause, Wasynczuk and Sudhoff, Analysis of Electric Machinery and Drive Systems, 2nd ed., table 4.10-1: 3 hp, 220 V
KRAUSE = {
    "type": "induction",
    "power": 2238.0,
    "speed": "1710 rpm",
    "poles": 4,
    "frequency": 60.0,
    "breakdown_ratio": 4.95,
    "electrical": "two-axis",
    "voltage": 220.0,
    "stator_resistance": 0.435,
    "stator_reactance": 0.754,
    "magnetizing_reactance": 26.13,
    "rotor_resistance": 0.816,
    "rotor_reactance": 0.754,
    "inertia": 0.089,
}
MAINS = 2 * math.pi * 60.0
SHARED = np.array([[26.884, 0, 26.13, 0], [0, 26.884, 0, 26.13], [26.13, 0, 26.884, 0], [0, 26.13, 0, 26.884]]) / MAINS
TO_CURRENTS = np.linalg.inv(SHARED)


def by_hand(y, load, inertia):
    """d(l_qs, l_ds, l_qr, l_dr, omega)/dt; and the torque."""
    qs, ds, qr, dr, omega = y
    iqs, ids, iqr, idr = TO_CURRENTS @ y[:4]
    slip = MAINS - 2 * omega
    torque = 1.5 * 2 * (ds * iqs - qs * ids)
    fluxes = [
        220 * math.sqrt(2 / 3) - 0.435 * iqs - MAINS * ds,
        -0.435 * ids + MAINS * qs,
        -0.816 * iqr - slip * dr,
        -0.816 * idr + slip * qr,
    ]
    return np.array([*fluxes, (torque + load) / inertia]), torque


def scene(load=None, inertia=0.0, **motor):
    loads = [] if load is None else [{"on": "crank", "torque": load}]
    return flywheel.load({"drive": {"motor": KRAUSE | motor}, "load": loads, "flywheel": {"inertia": inertia}})


def test_free_acceleration_is_that_of_krause():
    """Section 4.10: the shaft's torque swings with the mains at first, up to eleven times the base torque of 11.9 N m."""
    found = transient(scene(), end=0.05, rtol=1e-8)
    times = np.linspace(0.0, 0.05, 2001)
    true = solve_ivp(
        lambda t, y: by_hand(y, 0.0, 0.089)[0], (0.0, 0.05), np.zeros(5), "DOP853", times, rtol=1e-11, atol=1e-12
    ).y
    assert found.omega == pytest.approx(true[4, -1], rel=1e-8)
    assert [state[-1] for state in found.motion.states.values()] == pytest.approx(true[:4, -1].tolist(), abs=1e-8)
    torques = np.array([by_hand(y, 0.0, 0.089)[1] for y in true.T])
    assert found.peaks.torque.value == pytest.approx(torques.max(), rel=1e-3)
    assert found.peaks.torque.value > 11 * 11.9
    heat = np.array([1.5 * 0.816 * ((TO_CURRENTS @ y[:4])[2:] ** 2).sum() for y in true.T])
    assert found.energy.rotor_heat == pytest.approx(np.trapezoid(heat, times), rel=1e-4)


def test_states_that_stand_still_give_the_static_curve():
    motor = scene().motor
    speeds = np.array([0.0, 50.0, 120.0, motor.speed, 188.0, 200.0])
    states = motor.circuit.steady(speeds)
    assert motor.circuit.torque(speeds, states) == pytest.approx(motor.torque(speeds), rel=1e-12)
    assert np.abs(motor.circuit.rates(speeds, states)).max() < 1e-11
    assert motor.circuit.rotor_heat(states) == pytest.approx(motor.rotor_heat(speeds), rel=1e-11)
    start, t = np.array([0.1, 0.05, -0.02, 0.03]), 0.03
    true = solve_ivp(lambda t, y: motor.circuit.rates(0.0, y), (0.0, t), start, rtol=1e-11, atol=1e-13).y[:, -1]
    assert motor.circuit.standing(start, t) == pytest.approx(true, abs=1e-9)


def test_slopes_are_those_of_torque_and_rates():
    circuit, omega, states = scene().motor.circuit, 150.0, np.array([0.1, 0.4, 0.05, 0.3])
    slopes, step = circuit.slopes(omega, states), 1e-6
    for k in range(4):
        more, less = (states + sign * step * np.eye(4)[k] for sign in (1, -1))
        assert slopes.torque_by_states[k] == pytest.approx(
            (circuit.torque(omega, more) - circuit.torque(omega, less)) / (2 * step)
        )
        found = (np.array(circuit.rates(omega, more)) - circuit.rates(omega, less)) / (2 * step)
        assert [row[k] for row in slopes.rates_by_states] == pytest.approx(found.tolist(), abs=1e-6)
    found = (np.array(circuit.rates(omega + 0.1, states)) - circuit.rates(omega - 0.1, states)) / 0.2
    assert slopes.rates_by_speed == pytest.approx(found.tolist(), abs=1e-9)


@pytest.mark.slow
def test_the_regime_is_that_of_shooting():
    def cycle(start, points=None):
        def rates(phi, y):
            found, _ = by_hand(y[:5], -8.0 - 6.0 * math.sin(phi), 0.389)
            return [*(found / y[4]), 1.0 / y[4]]

        return solve_ivp(rates, (0.0, 2 * math.pi), [*start, 0.0], "DOP853", points, rtol=1e-11, atol=1e-12).y

    sizing = flywheel.size(scene("-8 - 6*sin(phi)", 0.3))
    first = np.array([*sizing.run.states, sizing.run.speed_min])
    start = root(lambda y: cycle(y)[:5, -1] - y, first, tol=1e-11).x
    assert list(sizing.run.states) == pytest.approx(start[:4].tolist(), abs=1e-8)
    y = cycle(start, np.linspace(0.0, 2 * math.pi, 2001))
    assert sizing.run.speed_max == pytest.approx(y[4].max(), rel=1e-7)
    assert sizing.run.speed_min == pytest.approx(y[4].min(), rel=1e-7)
    assert sizing.simulation.period == pytest.approx(y[5, -1], rel=1e-9)
    heat = np.array([1.5 * 0.816 * ((TO_CURRENTS @ one[:4])[2:] ** 2).sum() for one in y.T])
    assert sizing.energy.rotor_heat == pytest.approx(np.trapezoid(heat, y[5]) / y[5, -1], rel=1e-6)
    flow = sizing.power_flow
    assert abs(flow.left) <= 1e-9 * flow.input


@pytest.mark.slow
def test_whether_the_fluxes_matter_is_measured():
    beside = flywheel.size(scene("-8 - 6*sin(phi)", 0.0), simulate=False).electrical_transients
    assert beside.irregularity.difference == pytest.approx(0.063, abs=0.002)
    assert beside.matters
    static = flywheel.size(scene("-8 - 6*sin(phi)", 0.0, electrical="static"), simulate=False)
    assert static.electrical_transients is None


def test_no_shaft_twists_beside_it():
    table = {
        "shafts": {"motor": {"ratio": 1.0, "stiffness": 1e4}},
        "drive": {"on": "motor", "motor": KRAUSE},
        "inertia": [{"on": "crank", "value": 0.3}],
        "flywheel": {"inertia": 0.1},
    }
    with pytest.raises(SceneError, match="shaft that twists"):
        flywheel.simulate(flywheel.load(table), 0.0, 180.0, 0.01)


def test_a_name_plate_has_a_circuit():
    plate = Plate(voltage=400.0, current=15.0, power_factor=0.83)
    given = {"power": 7500.0, "speed": 1450 * math.pi / 30, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
    motor = Induction(**given, plate=plate)
    found = TwoAxisInduction(**given, plate=plate, voltage=400.0, impedances=impedances_of(motor))
    assert float(found.torque(motor.speed)) == pytest.approx(motor.rated.torque, rel=1e-9)
    assert found.breakdown_torque == pytest.approx(motor.breakdown_torque, rel=1e-9)
    circuit = found.circuit
    assert circuit.current(motor.speed, circuit.steady(motor.speed)) == pytest.approx(15.0, rel=1e-9)


@pytest.mark.parametrize(
    ("motor", "match"),
    [
        ({"rotor_resistance": None}, "without rotor_resistance"),
        ({"rotor_resistance": 1.6}, "rotor_resistance.* of the circuit at rated speed"),
        ({"breakdown_ratio": 2.5}, "breakdown_ratio.*about 4.95"),
        (dict.fromkeys(Impedances._fields), "electrical.*name plate without"),
        ({"start": {"type": "soft", "ramp": 2.0}}, "states of its own|start"),
    ],
)
def test_what_cannot_be_is_refused(motor, match):
    given = {key: value for key, value in (KRAUSE | motor).items() if value is not None}
    with pytest.raises(SceneError, match=match):
        flywheel.load({"drive": {"motor": given}, "flywheel": {"inertia": 1.0}})
