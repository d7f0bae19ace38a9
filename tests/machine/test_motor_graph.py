"""A DC motor as its own bond graph within the machine's: drawn, written as equations, and followed on a compliant shaft."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flywheel
from bondgraph import state_equations
from flywheel.machine.dynamics import Dynamics
from flywheel.machine.machine import Machine
from tests.limits import sample
from tests.regimes import FOUR_BAR, PUMP, SECTION_C

MOTOR = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.3, "inductance": 0.02, "friction": 0.01}
SHAFT = {"ratio": 3.0, "stiffness": 40.0, "damping": 0.05}


def scene(shaft, **motor):
    return flywheel.load(
        {
            "shafts": {"motor": shaft},
            "inertia": [{"on": "motor", "value": 0.15}, {"on": "crank", "value": 1.0}],
            "load": [{"on": "crank", "torque": "-4 - 0.5*omega"}],
            "drive": {"on": "motor", "motor": {**MOTOR, **motor}},
            "flywheel": {"inertia": 0.5},
        }
    )


def by_hand(until, inductance):
    """Two wheels, the spring between them and the circuit, written out: crank, its speed, motor, its speed, current."""

    def rates(t, y):
        phi, omega, angle, speed, current = y
        twist = 40.0 * (3 * phi - angle) + 0.05 * (3 * omega - speed)
        steady = (48.0 - 0.3 * speed) / 0.4
        driving = 0.3 * (current if inductance else steady) - 0.01 * speed
        slope = (48.0 - 0.4 * current - 0.3 * speed) / inductance if inductance else 0.0
        return [omega, (-4 - 0.5 * omega - 3 * twist) / 1.5, speed, (driving + twist) / 0.2, slope]

    found = solve_ivp(rates, (0, until), [0.0, 5.0, 0.0, 15.0, 0.0], "DOP853", rtol=1e-12, atol=1e-12)
    return found.y[:, -1]


@pytest.mark.parametrize("inductance", [0.02, 0.0])
def test_a_motor_on_a_compliant_shaft_moves_as_its_equations_written_by_hand(inductance):
    motion = flywheel.simulate(scene(SHAFT, inductance=inductance, inertia=0.05), 0.0, 5.0, 0.5, rtol=1e-9)
    phi, omega, _, speed, current = by_hand(0.5, inductance)
    assert motion.phi[-1] == pytest.approx(phi, rel=1e-8)
    assert motion.omega[-1] == pytest.approx(omega, rel=1e-8)
    assert motion.run is not None
    assert motion.run.flow("motor", np.array([0.5]))[0] == pytest.approx(speed, rel=1e-8)
    steady = (48.0 - 0.3 * speed) / 0.4
    expected = current if inductance else steady
    assert motion.run.flow("drive.motor.armature", np.array([0.5]))[0] == pytest.approx(expected, rel=1e-7)


def test_the_rotor_counts_once():
    graph = Machine(scene({"ratio": 3.0}, inertia=0.05)).with_values(0.0, 0.5)
    assert sum(e.law for e in graph.of_kind("I") if e.part != "" or "inertia" in e.name) == pytest.approx(1.7)
    assert "drive.motor.inductance" in graph.elements


@pytest.mark.parametrize(
    "machine",
    sample(
        [
            SECTION_C,
            PUMP,
            FOUR_BAR,
            SECTION_C | {"load": [{"on": "slider-crank.slider", "force": "-20*v - 3*(t > 0.5)*omega"}]},
        ],
        4,
    ),
    ids=["section C", "pump", "four-bar", "time"],
)
def test_state_equations_of_machines_whose_loads_depend_on_speed_are_those_of_time_stepping(machine):
    own = Machine(flywheel.load(machine | {"flywheel": {"inertia": 2}}))
    equations = state_equations(own.with_values(1.3, 2.0))
    inertia = next(element.law for element in equations.graph.of_kind("I"))
    omega, t = 4.4, 1.0
    ratios = {d.name: own.scene.shafts[d.of] for d in equations.graph.displacements.values()}
    for phi in (0.4, 2.3, 4.9):
        states = [inertia * omega if str(s).startswith("p_") else ratios[str(s)] * phi for s in equations.states]
        rate = equations.numeric()(t, states)[0] / inertia
        expected = Dynamics(own, 2.0, 1.3).at(phi, float(own.anchors(phi)), omega, t).acceleration
        assert rate == pytest.approx(expected, rel=1e-12)


def test_the_current_at_the_start_is_taken_on_a_compliant_shaft_too():
    motion = flywheel.simulate(scene(SHAFT, inertia=0.05), 0.0, 5.0, 1e-3, rtol=1e-9, current=70.0)
    assert motion.current is not None
    assert motion.current[0] == pytest.approx(70.0, rel=1e-12)
    with pytest.raises(flywheel.SceneError, match="current"):
        flywheel.simulate(scene(SHAFT, inductance=0.0), 0.0, 5.0, 1e-3, current=70.0)
