"""Machines with compliant shafts, whose whole bond graph is followed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import flywheel
from flywheel.numerics.faults import SceneError
from tests.limits import sample

R, LENGTH = 0.2, 0.6


def scene(**shaft):
    return {
        "shafts": {"motor": {"ratio": 3.0, **shaft}},
        "mechanism": {
            "type": "slider-crank",
            "crank": {"length": R},
            "rod": {"length": LENGTH},
            "slider": {"mass": 3.0},
        },
        "inertia": [{"on": "motor", "value": 0.2}, {"on": "crank", "value": 1.0}],
        "load": [{"on": "slider", "force": -40.0, "from": "30 deg", "to": "150 deg"}],
        "drive": {"on": "motor", "torque": 0.5},
        "regime": {"speed": 10.0},
        "flywheel": {"on": "motor", "inertia": 0.0},
    }


def gains(phi):
    root = np.sqrt(LENGTH**2 - (R * np.sin(phi)) ** 2)
    first = -R * np.sin(phi) - R**2 * np.sin(phi) * np.cos(phi) / root
    second = -R * np.cos(phi) - R**2 * (np.cos(2 * phi) / root + (R * np.sin(phi) * np.cos(phi)) ** 2 / root**3)
    return first, second


def by_hand(stiffness, damping, until, flywheel_inertia=0.0):
    """The two angles' equations, written out, and stepped from one end of the load's window to the next."""

    def rates(t, y, loaded):
        phi, omega, angle, speed = y
        g, g_slope = gains(phi)
        torque = stiffness * (3 * phi - angle) + damping * (3 * omega - speed)
        force = -40.0 if loaded else 0.0
        alpha = (force * g - 3 * torque - 3.0 * g * g_slope * omega**2) / (1.0 + 3.0 * g**2)
        return [omega, alpha, speed, (0.5 + torque) / (0.2 + flywheel_inertia)]

    t, y = 0.0, [0.0, 10.0, 0.0, 30.0]
    edges = [2 * np.pi * turn + np.radians(a) for turn in range(100) for a in (30.0, 150.0)]
    for k, edge in enumerate(edges):

        def passing(t, y, loaded, edge=edge):
            return y[0] - edge

        passing.terminal, passing.direction = True, 1.0
        found = solve_ivp(rates, (t, until), y, "DOP853", rtol=1e-13, atol=1e-13, events=passing, args=(k % 2 == 1,))
        t, y = found.t[-1], found.y[:, -1]
        if found.status == 0:
            return y
    raise AssertionError("more turns than expected")


@pytest.mark.parametrize(("stiffness", "damping", "wheel"), sample([(50.0, 0.0, 0.7), (300.0, 0.4, 0.0)], 2))
def test_a_compliant_shaft_moves_as_its_equations_written_by_hand(stiffness, damping, wheel):
    """The flywheel turns with its own shaft."""
    machine = flywheel.Machine(flywheel.load(scene(stiffness=stiffness, damping=damping)))
    motion = flywheel.simulate(machine, phi=0.0, omega=10.0, until=0.3, rtol=1e-10, inertia=wheel)
    phi, omega, angle, speed = by_hand(stiffness, damping, 0.3, wheel)
    assert_allclose(motion.at(0.3), [[phi], [omega]], rtol=1e-9)
    assert_allclose(motion.run.displacement("phi_motor", 0.3), angle, rtol=1e-9)
    assert_allclose(motion.run.flow("motor", 0.3), speed, rtol=1e-9)
    assert motion.energy_residual < 1e-9
    assert motion.run.audit.power < 1e-13


@pytest.mark.slow
def test_mechanisms_on_rigid_shafts_start_and_break_at_their_own_angles():
    valve = {"type": "scotch-yoke", "name": "valve", "shaft": "cam", "phase": "40 deg", "crank": {"length": 0.1}}

    def with_valve(**shaft):
        given = scene(**shaft)
        given["shafts"]["cam"] = {"ratio": 2.0}
        given["mechanism"] = [given["mechanism"] | {"name": "main"}, valve | {"yoke": {"mass": 5.0}}]
        given["load"][0]["on"] = "main.slider"
        given["load"].append({"on": "valve.yoke", "force": 30.0, "from": "20 deg", "to": "100 deg"})
        return flywheel.load(given)

    rigid = flywheel.simulate(with_valve(), phi=1.0, omega=10.0, until=0.5)
    stiff = flywheel.simulate(with_valve(stiffness=1e5, damping=20.0), phi=1.0, omega=10.0, until=0.5, rtol=1e-7)
    assert_allclose(stiff.omega[-1], rigid.omega[-1], rtol=1e-4)
    assert_allclose(stiff.run.displacement("phi_cam"), 2.0 * stiff.phi, rtol=1e-6)


def test_the_unknown_is_balanced_with_rigid_shafts_unless_it_is_given():
    balanced = scene(stiffness=200.0) | {"drive": {"on": "motor", "torque": "balance"}}
    rigid = flywheel.size(flywheel.load(scene() | {"drive": {"on": "motor", "torque": "balance"}}), simulate=False)
    load = flywheel.load(balanced)
    given = flywheel.simulate(load, phi=0.0, omega=10.0, until=0.05, balance=rigid.balance.value)
    found = flywheel.simulate(load, phi=0.0, omega=10.0, until=0.05)
    assert_allclose(found.omega[-1], given.omega[-1], rtol=1e-12)


@pytest.mark.parametrize("ask", [flywheel.size, lambda s: flywheel.reduce(s, [0.0])])
def test_what_needs_one_angle_refuses_a_shaft_that_twists(ask):
    with pytest.raises(SceneError, match=r"shafts\.motor\.stiffness: found a compliant shaft.*flywheel\.simulate"):
        ask(flywheel.load(scene(stiffness=100.0)))


def test_the_graph_holds_the_twist_as_a_spring_and_a_resistor_between_gear_and_shaft():
    graph = flywheel.Machine(flywheel.load(scene(stiffness=100.0, damping=2.0))).graph
    assert {"motor.gear", "motor.twist", "motor.compliance", "motor.damping"} <= set(graph.elements)
    assert graph.constant("motor.compliance") == 0.01


def test_a_side_of_a_compliant_shaft_without_inertia_is_named():
    light = {key: value for key, value in scene(stiffness=80.0).items() if key not in ("mechanism", "load")}
    light["inertia"] = [{"on": "motor", "value": 0.2}]
    with pytest.raises(SceneError, match=r'inertia: found nothing that weighs on crank.*add \[\[inertia\]\] on = "crank"'):
        flywheel.simulate(flywheel.load(light), phi=0.0, omega=5.0, until=1.0)


@pytest.mark.slow
def test_loads_of_speed_and_time_on_a_stiff_shaft_move_it_like_a_rigid_one():
    loads = [
        {"on": "slider", "force": "-40 - 8*v*abs(v)", "from": "30 deg", "to": "150 deg"},
        {"on": "crank", "torque": "-2*(t > 0.1)"},
    ]
    parts = {
        "load": loads,
        "damper": [{"on": "slider", "coefficient": 20}, {"on": "motor", "coefficient": 0.01}],
        "drive": {"on": "motor", "torque": "min(3, 6 - 0.1*omega)"},
    }
    rigid = flywheel.simulate(flywheel.load(scene() | parts), 0.0, 10.0, 0.2)
    stiff = flywheel.simulate(flywheel.load(scene(stiffness=2e4, damping=20.0) | parts), 0.0, 10.0, 0.2, rtol=1e-6)
    assert stiff.omega[-1] == pytest.approx(rigid.omega[-1], rel=3e-5)
    assert stiff.phi[-1] == pytest.approx(rigid.phi[-1], rel=3e-5)
    assert np.abs(stiff.t - 0.1).min() < 1e-12
    assert stiff.run.audit.energy < 1e-6
