"""Periodic motion by Newton's method: it closes, and what holds for moments of the angle alone holds along it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import flywheel
from flywheel.machine.dynamics import Dynamics, Moments
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.regime import constant_speed, periodic_motion, turning_moment
from flywheel.regime.periodic_motion import Demand, NoRegimeError, carried, first_guess, periodic
from tests import regimes
from tests.limits import sample


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
    states = [float(state) for state in moments.steady_states(speed)]
    return periodic(moments, speed, Demand(inertia, None, held), first_guess(moments, speed, inertia, unknown, states))


@pytest.mark.parametrize("name", ["section-c", "four-bar", "engine", "shaper", "two-speeds-fast", "pump", "brake"])
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
    energy = state.nodes[:, 0] + 0.5 * found.reference**2 * (40.0 + found.moments.inertia[:, :1] * 0 + _start(found.moments))
    assert_allclose(0.5 * total * found.omega**2, energy, rtol=1e-12)


def _start(moments):
    return cells.value(cells.fit(moments.inertia[:1]), np.array([-1.0]))[0]


def after_a_cycle(dynamics, speed, edges):
    """Speed at phi = 0 one cycle later, by stepping in the angle."""
    state = [speed]
    for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        middle = 0.5 * (low + high)

        def rates(phi, state, middle=middle, ends=(low, high)):
            return [dynamics.at(phi, middle, float(state[0]), ends=ends).acceleration / state[0]]

        state = solve_ivp(rates, (low, high), state, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return float(state[0])


@pytest.mark.parametrize(("name", "inertia"), sample([("peaks", 5.0), ("section-c", 0.5)], 2))
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


@pytest.mark.parametrize("name", ["kloss-press", "pump", "governor", "geared-loss-line", "dc-inductance"])
@pytest.mark.parametrize("factor", [1e2, 1e6])
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


@pytest.mark.parametrize(("name", "eps"), [("section-c", 1e-10), ("pump", 1e-2), ("section-c", 0.3)])
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


def test_extremes_lie_at_jumps_too():
    found = solved("peaks", 5.0)
    mesh, extremes = found.moments.mesh, found.extremes
    angles = mesh.edges[extremes.cell + (extremes.t > 0)]
    assert_allclose(np.degrees(angles), [90, 135])


SIZED = [
    ("section-c", 0.3),
    ("section-c", 1e-6),
    ("pump", 0.05),
    ("law", 0.02),
    ("geared-loss", 0.05),
    ("dc-inductance", 0.05),
]


def motion_of(name, rtol=1e-9, **wheel):
    machine = Machine(flywheel.load(regimes.scene(name, **wheel)))
    sizing = flywheel.size(machine, rtol, simulate=False)
    held = machine.scene.speed if machine.scene.unknown is not None else None
    ratio = machine.scene.flywheel_ratio
    given = (
        Demand(wheel["inertia"] * ratio**2, None, held) if "inertia" in wheel else Demand(None, wheel["irregularity"], held)
    )
    reference = held or sizing.speed
    guess = 0.0 if sizing.flywheel.exact is None else sizing.flywheel.exact * ratio**2
    return periodic_motion.own_motion(machine, reference, given, guess, sizing.constant.balance or 0.0, rtol)


@pytest.mark.parametrize(("name", "eps"), sample(SIZED, 2))
def test_wittenbauers_formula_holds_with_the_moment_along_the_motion(name, eps):
    """I = [max(W - z+ w² I*/2) - min(W - z- w² I*/2)]/(eps w²), W the integral of the moment that the motion meets."""
    motion = motion_of(name, irregularity=eps)
    square, z = motion.speed**2, (1 + 0.5 * eps * np.array([1.0, -1.0])) ** 2
    extremes, _ = turning_moment.combined(motion.cycle, np.stack((np.ones(2), -0.5 * z * square), axis=1))
    total = (extremes.greatest[0] - extremes.least[1]) / (eps * square)
    # with I* counted from its value at phi = 0, as 2 eps stands for z+ - z-
    assert motion.inertia + motion.cycle.inertia_at_start == pytest.approx(total, rel=1e-9)
    assert motion.run.irregularity == pytest.approx(eps, rel=1e-11)
    assert_allclose([extremes.angle_greatest[0], extremes.angle_least[1]], _angles(motion), atol=1e-6)


def _angles(motion):
    return [motion.run.angle_speed_max, motion.run.angle_speed_min]


@pytest.mark.parametrize("name", sample(["yoke", "two-mechanisms", "geared-loss-line"], 3))
def test_the_motion_is_that_of_its_own_moment(name):
    """The closed form for moments of the angle, given the moment along the motion, finds the motion again."""
    motion = motion_of(name, inertia=regimes.CASES[name].inertias[-1])
    again = turning_moment.run(motion.cycle, motion.speed, motion.inertia)
    assert again.irregularity == pytest.approx(motion.run.irregularity, rel=1e-11)
    assert (again.speed_max, again.speed_min) == pytest.approx((motion.run.speed_max, motion.run.speed_min), rel=1e-12)
    assert again.offset == pytest.approx(motion.run.offset, rel=1e-9, abs=1e-9 * motion.inertia * motion.speed**2)
    phi = np.linspace(0, 2 * np.pi, 41)[:-1]
    speeds = turning_moment.speed_over_cycle(motion.cycle, motion.speed, motion.run, phi)
    nodes = motion.solved.moments.mesh.phi.ravel()
    assert_allclose(
        turning_moment.speed_over_cycle(motion.cycle, motion.speed, motion.run, nodes),
        motion.solved.omega.ravel(),
        rtol=1e-9,
    )
    assert (speeds <= motion.run.speed_max * (1 + 1e-12)).all()
    assert (speeds >= motion.run.speed_min * (1 - 1e-12)).all()


def test_cells_are_as_fine_as_the_error_asks():
    motions = [motion_of("kloss-press", rtol, inertia=0.1) for rtol in (1e-4, 1e-12)]
    for motion, rtol in zip(motions, (1e-4, 1e-12), strict=True):
        assert max(motion.run.error, motion.level_error) <= rtol
    assert motions[0].cycle.mesh.half.size < motions[1].cycle.mesh.half.size < 200


def test_meshes_that_change_sides_cut_the_cycle_there():
    motion = motion_of("geared-loss-line", inertia=0.05)
    solved = motion.solved
    edges, known = solved.moments.mesh.edges, solved.moments.machine.mesh
    cuts = [edge for edge in edges if np.abs(known - edge).min() > 1e-9]
    assert len(cuts) >= 2
    (tau,) = solved.moments.transmitted(solved.omega, 0.0, motion.inertia)
    left, right = (cells.value(cells.fit(tau), np.full(len(tau), t)) for t in (-1.0, 1.0))
    at_cuts = [min(abs(right[k - 1]), abs(left[k])) for k in np.searchsorted(edges, cuts)]
    assert sum(value < 1e-9 * np.abs(tau).max() for value in at_cuts) >= 2
    assert not solved.moments.local


def test_states_are_carried_to_other_cells():
    solved = motion_of("yoke", inertia=3).solved
    machine = solved.moments.machine
    edges = np.linspace(0, 2 * np.pi, 40)
    finer = Moments(machine, cells.cells(np.unique(np.concatenate((edges, machine.breakpoints)))))
    state = carried(solved, finer)
    speeds = np.sqrt(
        solved.reference**2
        + (2 * state.nodes[:, 0] - solved.reference**2 * (finer.inertia - _start(finer))) / (3 + finer.inertia)
    )
    motion = turning_moment.speed_over_cycle(*_run_of("yoke"), finer.mesh.phi.ravel())
    assert_allclose(speeds.ravel(), motion, rtol=1e-8)
    assert state.inertia == solved.state.inertia


def _run_of(name):
    motion = motion_of(name, inertia=3)
    return motion.cycle, motion.speed, motion.run


@pytest.mark.slow
def test_a_heavy_wheel_leads_down_to_a_light_one():
    """Far from the motion at constant speed the iteration starts from heavier flywheels."""
    motion = motion_of("dc-inductance", irregularity=1.5)
    assert motion.run.irregularity == pytest.approx(1.5, rel=1e-12)
    assert motion_of("dc-inductance", inertia=motion.inertia / 100).run.irregularity == pytest.approx(1.5, rel=1e-8)


@pytest.mark.slow
def test_no_motion_is_named():
    machine = Machine(flywheel.load(regimes.BAD["light"].scene))
    with pytest.raises(NoRegimeError, match="stop within the cycle"):
        periodic_motion.own_motion(machine, 7.5, Demand(0.2, None, None), 0.0, 0.0, 1e-4)


def made_to_measure(inertia, damping, speed, share):
    """A machine whose motion is omega = speed (1 + share sin phi): its load is what that takes."""
    rise = f"({speed}*(1 + {share}*sin(phi)))*({speed}*{share}*cos(phi))"
    return {
        "load": [{"on": "crank", "torque": f"{inertia}*{rise} + {damping}*{speed}*{share}*sin(phi)"}],
        "drive": {"torque": f"{damping * speed} - {damping}*omega"},
        "flywheel": {"inertia": inertia},
    }


@pytest.mark.parametrize(
    ("inertia", "damping", "speed", "share"),
    [
        (2, 1e-4, 20.0, 0.99995),
        (2, 5e-5, 20.0, 0.9995),
        (2, 10.0, 20.0, 0.475),
        (1e6, 1.0, 1e6, 1e-7),
    ],
)
def test_what_hardly_holds_the_speed_is_told_the_more_the_slower_the_machine(inertia, damping, speed, share):
    found = flywheel.size(flywheel.load(made_to_measure(inertia, damping, speed, share)), simulate=False)
    period = 2 * np.pi / speed / np.sqrt((1 - share) * (1 + share))
    assert abs(found.simulation.irregularity / (2 * share) - 1) <= found.run.error
    assert abs(found.speed / speed - 1) <= found.cyclic.level_error
    assert abs(found.simulation.period / period - 1) <= found.error.period <= found.error.simulation + 1e-9
    assert abs(found.simulation.speed_min / (speed * (1 - share)) - 1) <= found.error.simulation
