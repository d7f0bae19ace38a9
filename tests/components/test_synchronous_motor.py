"""Synchronous motors: load angle and pull-out, damper winding, swings; motions against equations written by hand."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import flywheel
from flywheel.components.motors import Synchronous
from flywheel.components.motors.synchronous import pull_out
from flywheel.motions.transients import transient
from flywheel.numerics.faults import SceneError

MOTOR = {
    "type": "synchronous",
    "power": 150e3,
    "poles": 20,
    "frequency": 50.0,
    "pull_out_ratio": 2.0,
    "asynchronous_slip": 0.04,
    "saliency": 0.2,
    "inertia": 20.0,
}
PAIRS, FIELD = 10, 2 * math.pi * 5.0
RATED = 150e3 / FIELD
SYNCHRONIZING = 2.0 * RATED / pull_out(0.2)[1]
DAMPING = RATED / (0.04 * FIELD)


def scene(inertia=300.0, mean=3000.0, rtol=1e-9, **motor):
    load = [{"on": "crank", "torque": f"-{mean} - 2500*sin(phi) - 1200*sin(2*phi + 0.5)"}]
    wheel = {"inertia": inertia}
    return flywheel.load({"drive": {"motor": MOTOR | motor}, "load": load, "flywheel": wheel, "accuracy": {"rtol": rtol}})


def by_hand(inertia, phi, y):
    """d(omega, d, t, integral of d over t)/dphi."""
    omega, d = y[:2]
    slip = FIELD - omega
    torque = SYNCHRONIZING * (np.sin(d) + 0.2 * np.sin(2 * d)) + DAMPING * slip
    load = -3000.0 - 2500.0 * np.sin(phi) - 1200.0 * np.sin(2 * phi + 0.5)
    return [(torque + load) / (inertia + 20.0) / omega, PAIRS * slip / omega, 1 / omega, d / omega]


def cycle_by_hand(inertia, start, points=None):
    found = solve_ivp(
        lambda phi, y: by_hand(inertia, phi, y),
        (0.0, 2 * math.pi),
        [*start, 0.0, 0.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        t_eval=points,
    )
    return found.y


@pytest.mark.parametrize("inertia", [pytest.param(80.0, marks=pytest.mark.slow), 2000.0])
def test_the_regime_is_that_of_shooting(inertia):
    start = root(lambda y: cycle_by_hand(inertia, y)[:2, -1] - y, [FIELD, 0.3], tol=1e-13).x
    phi = np.linspace(0.0, 2 * math.pi, 1201)
    omega, angle, t, product = cycle_by_hand(inertia, start, phi)
    sizing = flywheel.size(scene(inertia))
    near = np.clip(np.array([omega.argmax(), omega.argmin()]), 1, 1199)
    tops = [
        np.polyval(p := np.polyfit(phi[k - 1 : k + 2] - phi[k], omega[k - 1 : k + 2], 2), -p[1] / (2 * p[0])) for k in near
    ]
    assert sizing.run.speed_max == pytest.approx(tops[0], rel=1e-8)
    assert sizing.run.speed_min == pytest.approx(tops[1], rel=1e-8)
    assert sizing.simulation.period == pytest.approx(0.2, rel=1e-12)
    assert sizing.simulation.speed_time_mean == pytest.approx(FIELD, rel=1e-12)
    assert sizing.error.simulation < 1e-9
    found = sizing.synchronism
    assert found.load_angle == pytest.approx(product[-1] / t[-1], abs=1e-9)
    assert found.load_angle_greatest == pytest.approx(angle.max(), abs=1e-5)
    assert found.load_angle_least == pytest.approx(angle.min(), abs=1e-5)
    assert sizing.run.states[0] == pytest.approx(start[1], abs=1e-9)
    flow = sizing.power_flow
    assert abs(flow.left) <= 1e-9 * flow.input


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-11])
def test_errors_hold_at_every_tolerance(rtol):
    best, found = (flywheel.size(scene(150.0, rtol=one)) for one in (1e-12, rtol))
    for name in ("irregularity", "period", "speed_max"):
        true = getattr(best.simulation, name)
        assert abs(getattr(found.simulation, name) / true - 1) <= found.error.simulation + best.error.simulation


def test_small_swings_have_the_frequency_of_the_formula():
    """Kundur, section 12.3: omega_n² = p (dT/dd)/J, zeta = c/(2 J omega_n)."""
    motor = Synchronous(power=150e3, poles=20, frequency=50.0, pull_out_ratio=2.0, saliency=0.2, damping=50.0)
    angle, inertia = motor.load_angle(3000.0), 320.0
    natural = motor.swing_frequency(angle, inertia)
    matrix = np.array([[-50.0 / inertia, float(motor.stiffness(angle)) / inertia], [-PAIRS, 0.0]])
    value = np.linalg.eigvals(matrix)[0]
    assert abs(value) == pytest.approx(natural, rel=1e-12)
    assert -value.real / abs(value) == pytest.approx(50.0 / (2 * inertia * natural), rel=1e-12)


def test_a_heavier_flywheel_towards_resonance_is_named():
    light = flywheel.size(scene(5.0, asynchronous_slip=0.3), simulate=False).synchronism
    assert light.heavier_is_nearer.order in (1, 2)
    heavy = flywheel.size(scene(3000.0, asynchronous_slip=0.3), simulate=False).synchronism
    assert heavy.heavier_is_nearer is None
    assert heavy.near_resonance is None


def test_steady_and_in_time_agree():
    found = transient(scene(), start="regime", end=1.0)
    sizing = flywheel.size(scene())
    assert found.motion.omega[-1] == pytest.approx(found.motion.omega[0], rel=1e-7)
    assert found.turns == pytest.approx(5.0, rel=1e-8)
    assert found.motion.states["load_angle"][-1] == pytest.approx(sizing.run.states[0], abs=1e-7)


@pytest.mark.slow
def test_a_field_that_is_switched_pulls_the_rotor_in():
    motor = {"asynchronous_ratio": 1.5, "asynchronous_slip": 0.02, "field_at": 30.5, "field_time": 0.2}
    load = [{"on": "crank", "torque": "-1000*omega/31.4"}]
    table = {"drive": {"motor": MOTOR | motor}, "load": load, "flywheel": {"inertia": 100.0}}
    found = transient(flywheel.load(table), end=8.0, rtol=1e-7)
    angle, field = (found.motion.states[name] for name in ("load_angle", "field"))
    assert field[0] == 0.0
    assert field[-1] == pytest.approx(1.0, abs=1e-6)
    assert found.omega == pytest.approx(FIELD, rel=1e-5)
    assert math.sin(angle[-1]) > 0.0


@pytest.mark.slow
def test_the_bond_graph_swings_alike():
    table = {
        "drive": {"motor": MOTOR},
        "load": [{"on": "crank", "torque": "-3000 - 2000*sin(phi)"}],
        "flywheel": {"inertia": 300.0},
    }
    stiff = table | {
        "shafts": {"motor": {"ratio": 1.0, "stiffness": 1e9, "damping": 1e5}},
        "drive": {"on": "motor", "motor": MOTOR},
    }
    states = {"load_angle": 0.3}
    rigid, twisted = (
        flywheel.simulate(flywheel.load(one), 0.0, FIELD, 0.05, states=states, rtol=1e-6) for one in (table, stiff)
    )
    assert twisted.states["load_angle"][0] == pytest.approx(0.3)
    assert twisted.omega[-1] == pytest.approx(rigid.omega[-1], rel=1e-4)
    assert twisted.states["load_angle"][-1] == pytest.approx(rigid.states["load_angle"][-1], abs=1e-3)


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ({"mean": 9900.0}, "above the pull-out torque of 9549.3"),
        ({"load_angle": 0.7, "saliency": None}, "load_angle"),
        ({"damping": 100.0}, "damping and asynchronous_slip"),
        ({"field_at": 31.4, "field_time": 0.1}, "field_at"),
        ({"saliency": 3.0}, "saliency"),
    ],
)
def test_what_cannot_be_is_refused(table, match):
    given = {key: value for key, value in (MOTOR | table).items() if value is not None and key != "mean"}
    load = [{"on": "crank", "torque": -table.get("mean", 3000.0)}]
    with pytest.raises(SceneError, match=match):
        flywheel.size(flywheel.load({"drive": {"motor": given}, "load": load, "flywheel": {"inertia": 300.0}}))


def test_no_balance_stands_beside_it():
    table = {
        "parameters": {"a": "balance"},
        "drive": {"motor": MOTOR},
        "load": [{"on": "crank", "torque": "-a*(1 + sin(phi))"}],
        "regime": {"speed": FIELD},
        "flywheel": {"inertia": 300.0},
    }
    with pytest.raises(SceneError, match="keeps its speed whatever the load"):
        flywheel.size(flywheel.load(table))
