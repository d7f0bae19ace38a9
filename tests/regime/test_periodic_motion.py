"""Periodic motion by Newton's method: it closes, its multiplier is the growth of a change, heavy wheels are no harder."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import flywheel
from flywheel.machine.dynamics import Dynamics, Moments
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.regime import constant_speed
from flywheel.regime.periodic_motion import Demand, NoRegimeError, first_guess, periodic
from tests import regimes

SMOOTH = ["section-c", "kloss-press", "yoke", "four-bar", "engine", "law", "constant-drive", "shaper", "two-speeds-fast"]
BALANCED = ["pump", "two-mechanisms", "brake"]


def fine(name, parts=3, **flywheel_):
    """Moments on the machine's mesh with every cell cut up, and its constant speed and balance."""
    machine = Machine(flywheel.load(regimes.scene(name, **(flywheel_ or {"inertia": 1}))))
    speed, unknown = constant_speed.operating_point(machine)
    edges = machine.mesh
    pieces = [np.linspace(a, b, parts, endpoint=False) for a, b in pairwise(edges)]
    return Moments(machine, cells.cells(np.concatenate([*pieces, edges[-1:]]))), speed or machine.scene.speed, unknown


def solved(name, inertia, parts=3):
    moments, speed, unknown = fine(name, parts)
    held = speed if moments.machine.scene.unknown is not None else None
    current = 0.0 if moments.circuit is None else float(moments.steady_current(np.array(speed)))
    return periodic(moments, speed, Demand(inertia, None, held), first_guess(moments, speed, inertia, unknown, current))


@pytest.mark.parametrize("name", SMOOTH + BALANCED)
def test_the_cycle_closes_and_its_multiplier_is_the_integral_of_the_slope(name):
    """E' = F(phi, omega(E)): a small change of E grows by exp of the integral of dF/domega/((J + I*) omega)."""
    found = solved(name, 40.0)
    state, half = found.state, found.moments.mesh.half
    swing = np.ptp(state.edges)
    assert abs(state.edges[-1, 0] - state.edges[0, 0]) < 1e-11 * swing
    assert abs(cells.integral(found.rate.moment, half).sum()) < 1e-11 * swing
    total = 40.0 + found.moments.inertia
    growth = cells.integral(found.rate.by_speed / (total * found.omega), half).sum()
    assert found.multiplier == pytest.approx(np.exp(growth), rel=1e-10)
    assert found.damping == pytest.approx(-np.expm1(growth), rel=1e-9)
    energy = state.nodes[:, 0] + 0.5 * found.reference**2 * (40.0 + found.moments.inertia[:, :1] * 0 + _start(found))
    assert_allclose(0.5 * total * found.omega**2, energy, rtol=1e-12)


def _start(found):
    return cells.value(cells.fit(found.moments.inertia[:1]), np.array([-1.0]))[0]


def after_a_cycle(dynamics, speed, edges):
    """Speed at phi = 0 one cycle later, by stepping in the angle."""
    state = [speed]
    for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        middle = 0.5 * (low + high)

        def rates(phi, state, middle=middle, ends=(low, high)):
            return [dynamics.at(phi, middle, float(state[0]), ends=ends).acceleration / state[0]]

        state = solve_ivp(rates, (low, high), state, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return float(state[0])


@pytest.mark.parametrize(("name", "inertia"), [("section-c", 0.5), ("kloss-press", 14.4), ("peaks", 5.0)])
def test_the_multiplier_is_what_a_cycle_leaves_of_a_change_in_a_run(name, inertia):
    sizing = flywheel.size(
        flywheel.load(regimes.scene(name, inertia=inertia / _ratio(name) ** 2)), rtol=1e-11, simulate=False
    )
    dynamics = Dynamics(sizing.machine, inertia)
    start = sizing.run.cycle.inertia_at_start + inertia
    speed = np.sqrt(sizing.speed**2 + 2 * sizing.run.offset / start)
    change = 2e-5 * speed
    edges = sizing.cycle.mesh.edges  # where a mesh changes sides, too
    runs = [after_a_cycle(dynamics, speed + sign * change, edges) for sign in (1, 0, -1)]
    assert runs[1] == pytest.approx(speed, rel=1e-10)
    assert (runs[0] - runs[2]) / (2 * change) == pytest.approx(sizing.cyclic.multiplier, rel=1e-5)


def _ratio(name):
    """Speed of the flywheel's shaft over the crank's."""
    return regimes.scene(name).get("shafts", {}).get(regimes.CASES[name].on, {}).get("ratio", 1)


@pytest.mark.parametrize(
    "name", ["section-c", "kloss-press", "pump", "engine", "governor", "geared-loss-line", "dc-inductance"]
)
@pytest.mark.parametrize("factor", [1e2, 1e4, 1e6])
def test_a_flywheel_too_heavy_by_far_takes_a_few_steps(name, factor):
    found = solved(name, factor * float(regimes.CASES[name].inertias[-1]) * _ratio(name) ** 2, parts=1)
    assert found.steps <= 8
    assert 0 < found.damping < 20 / factor
    assert found.irregularity < 2 / factor


def test_a_motion_far_from_the_reference_speed_keeps_its_digits():
    """On cells that do not end where a mesh changes sides the speed is some 0.3 % off; what varies is 1e-8 of it."""
    moments, speed, _ = fine("geared-loss-line", 1)
    asked = Demand(None, 1e-8, None)
    found = periodic(moments, speed, asked, first_guess(moments, speed, 4e8, 0.0))
    assert found.irregularity == pytest.approx(1e-8, rel=1e-12)
    assert abs(found.speed / speed - 1) > 1e-4
    assert found.reference == pytest.approx(found.speed, rel=1e-7)


@pytest.mark.parametrize("eps", [1e-10, 1e-6, 1e-2, 0.3])
@pytest.mark.parametrize("name", ["section-c", "pump"])
def test_inertia_level_and_balance_are_one_problem(name, eps):
    moments, speed, unknown = fine(name, irregularity=eps)
    balanced = moments.machine.scene.unknown is not None
    guess = {"section-c": 0.7, "pump": 1.8}[name] / eps
    asked = Demand(None, eps, speed if balanced else None)
    found = periodic(moments, speed, asked, first_guess(moments, speed, guess, unknown))
    assert found.irregularity == pytest.approx(eps, rel=1e-11)
    if balanced:
        assert found.speed == pytest.approx(speed, rel=1e-14)
    again = solved(name, found.state.inertia)  # the other way round
    assert again.irregularity == pytest.approx(eps, rel=1e-10)
    assert again.state.unknown == pytest.approx(found.state.unknown, rel=1e-11)


def test_a_wheel_too_light_stops_the_machine():
    moments, speed, _ = fine("peaks")
    with pytest.raises(NoRegimeError, match="stop within the cycle"):
        periodic(moments, speed, Demand(0.2, None, None), first_guess(moments, speed, 0.2, 0.0))


def test_extremes_lie_at_jumps_too():
    found = solved("peaks", 5.0)
    mesh, extremes = found.moments.mesh, found.extremes
    angles = mesh.edges[extremes.cell + (extremes.t > 0)]
    assert_allclose(np.degrees(angles), [90, 135])
