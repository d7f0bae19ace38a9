"""Periodic motion: branches, steps, results."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import flywheel
from bondgraph.motion.runge_kutta import Implicit, RateField, decay
from bondgraph.motion.stepping import Events, Piece, through
from flywheel import Machine
from flywheel.machine.dynamics import MachineDynamics
from flywheel.machine.equation import Moments, moments_on
from flywheel.numerics import cells
from flywheel.regime import constant_speed, periodic_motion, turning_moment
from flywheel.regime.branch import Branch, Existence
from flywheel.regime.cycle_equations import Demand, NoRegimeError, carried, first_guess, periodic
from flywheel.regime.several_motions import lighter_motions
from flywheel.sizing.confirmation import SlidingError, one_cycle
from tests import regimes
from tests.components.test_electrical_machines import KRAUSE, two_axis_by_hand
from tests.limits import sample

# Periodic motion by Newton's method: it closes, and what holds for moments of the angle alone holds along it.


def fine(name, parts=3, **flywheel_):
    """Moments on the machine's mesh with every cell cut up, and its constant speed and balance."""
    machine = Machine(flywheel.load(regimes.scene(name, **(flywheel_ or {"inertia": 1}))))
    speed, unknown = constant_speed.operating_point(machine)
    edges = machine.mesh
    pieces = [np.linspace(a, b, parts, endpoint=False) for a, b in pairwise(edges)]
    return Moments(machine, cells.cells(np.concatenate([*pieces, edges[-1:]]))), speed or machine.scene.speed, unknown


def solved(name, inertia, parts=3):
    moments, speed, unknown = fine(name, parts)
    hold = speed if moments.machine.scene.unknown is not None else None
    states = [float(state) for state in moments.steady_states(speed)]
    return periodic(moments, speed, Demand(inertia, None, hold), first_guess(moments, speed, inertia, unknown, states))


@pytest.mark.parametrize("name", ["section-c", "four-bar", "engine", "shaper", "two-speeds-fast", "pump", "brake"])
def test_the_cycle_closes_and_its_multiplier_is_the_integral_of_the_slope(name):
    """E' = F(phi, omega(E)): a small change of E grows by exp of the integral of dF/domega/((J + I*) omega)."""
    result = solved(name, 40.0)
    state, half = result.state, result.moments.mesh.half
    swing = np.ptp(state.edges)
    assert abs(state.edges[-1, 0] - state.edges[0, 0]) < 1e-11 * swing
    assert abs(cells.integral(result.rate.moment, half).sum()) < 1e-11 * swing
    total = 40.0 + result.moments.inertia
    growth = cells.integral(result.rate.by_speed / (total * result.omega), half).sum()
    assert result.multiplier == pytest.approx(np.exp(growth), rel=1e-10)
    assert result.damping == pytest.approx(-np.expm1(growth), rel=1e-9)
    energy = state.nodes[:, 0] + 0.5 * result.reference**2 * (
        40.0 + result.moments.inertia[:, :1] * 0 + _start(result.moments)
    )
    assert_allclose(0.5 * total * result.omega**2, energy, rtol=1e-12)


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
    dynamics = MachineDynamics(sizing.machine, inertia)
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
    result = solved(name, factor * float(regimes.CASES[name].inertias[-1]) * _ratio(name) ** 2, parts=1)
    assert result.steps <= 8
    assert 0 < result.damping < 20 / factor
    assert result.irregularity < 2 / factor


def test_a_motion_far_from_the_reference_speed_keeps_its_digits():
    """On cells that do not end where a mesh changes sides the speed is some 0.3 % off; what varies is 1e-8 of it."""
    moments, speed, _ = fine("geared-loss-line", 1)
    request = Demand(None, 1e-8, None)
    result = periodic(moments, speed, request, first_guess(moments, speed, 4e8, 0.0))
    assert result.irregularity == pytest.approx(1e-8, rel=1e-12)
    assert abs(result.speed / speed - 1) > 1e-4
    assert result.reference == pytest.approx(result.speed, rel=1e-7)


@pytest.mark.parametrize(("name", "eps"), [("section-c", 1e-10), ("pump", 1e-2), ("section-c", 0.3)])
def test_inertia_level_and_balance_are_one_problem(name, eps):
    moments, speed, unknown = fine(name, irregularity=eps)
    balanced = moments.machine.scene.unknown is not None
    guess = {"section-c": 0.7, "pump": 1.8}[name] / eps
    request = Demand(None, eps, speed if balanced else None)
    result = periodic(moments, speed, request, first_guess(moments, speed, guess, unknown))
    assert result.irregularity == pytest.approx(eps, rel=1e-11)
    if balanced:
        assert result.speed == pytest.approx(speed, rel=1e-14)
    again = solved(name, result.state.inertia)  # the other way round
    assert again.irregularity == pytest.approx(eps, rel=1e-10)
    assert again.state.unknown == pytest.approx(result.state.unknown, rel=1e-11)


def test_extremes_lie_at_jumps_too():
    result = solved("peaks", 5.0)
    mesh, extremes = result.moments.mesh, result.extremes
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
    state = machine.scene.speed if machine.scene.unknown is not None else None
    ratio = machine.scene.flywheel_ratio
    inputs = (
        Demand(wheel["inertia"] * ratio**2, None, state)
        if "inertia" in wheel
        else Demand(None, wheel["irregularity"], state)
    )
    reference = state or sizing.speed
    guess = 0.0 if sizing.flywheel.exact is None else sizing.flywheel.exact * ratio**2
    return periodic_motion.own_motion(machine, reference, inputs, guess, sizing.constant.balance or 0.0, rtol)


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


def test_a_drag_that_vanishes_leaves_the_motion_without_it():
    """On cells that resolve moment and inertia but not the speed, one of two summits that differ by 1e-8 is the greater."""
    scene = {
        "mechanism": {"type": "scotch-yoke", "crank": {"length": 1}, "yoke": {"mass": 1}},
        "load": [{"on": "crank", "torque": "0.03*sin(2*phi - 0.3) + 1e-8*cos(phi)"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"inertia": 0.001},
        "accuracy": {"rtol": 1e-3},
    }
    free = flywheel.size(flywheel.load(scene), accuracy="normal")
    scene["load"].append({"on": "crank", "torque": "-1e-15*omega"})
    result = flywheel.size(flywheel.load(scene), accuracy="normal")
    assert result.simulation.irregularity == pytest.approx(free.simulation.irregularity, rel=1e-12)
    assert result.simulation.speed_max == pytest.approx(free.simulation.speed_max, rel=1e-12)
    assert result.angle_speed_max == pytest.approx(free.angle_speed_max, abs=1e-9)


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
    edges, reference = solved.moments.mesh.edges, solved.moments.machine.mesh
    cuts = [edge for edge in edges if np.abs(reference - edge).min() > 1e-9]
    assert len(cuts) >= 2
    (tau,) = solved.rate.transmitted
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


def test_motions_on_the_way_to_a_light_flywheel_serve_the_next_search_of_the_same_motion_alone(monkeypatch):
    """They are those of a machine by its speeds, unknown and inertia: another search finds what it finds by itself."""
    solutions: list[Moments] = []
    monkeypatch.setattr(periodic_motion, "periodic", lambda *a, **k: solutions.append(a[0]) or periodic(*a, **k))
    scene = flywheel.load(regimes.scene("dc-inductance", irregularity=0.05))
    speed, _ = constant_speed.operating_point(Machine(scene))

    def light(machine, reference, held=None, unknown=0.0):
        """From a heavy flywheel, so that the first on the way is the same for all."""
        solutions.clear()
        try:
            motion = periodic_motion.own_motion(machine, reference, Demand(None, 0.05, held), 1e4, unknown, 1e-9)
        except NoRegimeError as refused:
            return str(refused), len(solutions)
        return motion.inertia, len(solutions)

    machine = Machine(scene)
    by_itself, again = light(machine, speed), light(machine, speed)
    assert again[0] == by_itself[0] > 0.0
    assert again[1] < 0.7 * by_itself[1]
    for other in ((0.99 * speed,), (speed, 0.99 * speed), (speed, None, 1.0)):
        assert light(machine, *other) == light(Machine(scene), *other)


@pytest.mark.parametrize(("name", "inertia"), [("peaks", 5 / 30), ("pump", 1 / 6), ("kloss-press", 0.1 / 30)])
def test_an_iteration_with_a_given_flywheel_ends_after_twelve_steps_that_stay_long(name, inertia):
    with pytest.raises(NoRegimeError, match="not converged in 13 steps"):
        solved(name, inertia, parts=1)


def test_an_iteration_for_a_flywheel_goes_on_however_long_its_steps_stay():
    moments, speed, unknown = fine("yoke", 1, irregularity=1.0)
    near, far = (
        periodic(moments, speed, Demand(None, 1.0, None), first_guess(moments, speed, guess, unknown)) for guess in (1, 1e7)
    )
    assert far.steps > 20 > near.steps
    assert far.state.inertia == pytest.approx(near.state.inertia, rel=1e-10)


@pytest.mark.slow
def test_no_motion_is_named():
    machine = Machine(flywheel.load(regimes.BAD["light"].scene))
    with pytest.raises(NoRegimeError, match="stop within the cycle"):
        periodic_motion.own_motion(machine, 7.5, Demand(0.2, None, None), 0.0, 0.0, 1e-4)


@pytest.mark.parametrize("k", range(0, 40, 3))
def test_what_moves_of_a_jump_at_a_speed_is_in_the_errors(k):
    """A rotor whose load jumps at a speed, in closed form: on its four pieces the energy is a straight line of the angle."""
    inertia, load, further, mean = 40.0, 120.0, round(7.0 + 0.37 * k, 2), 10.0
    jump = round(9.9 + 0.007 * k, 4)
    with mp.workdps(40):
        at_jump = mp.mpf(inertia) * mp.mpf(repr(jump)) ** 2 / 2

        def lowest(drive, highest):
            return at_jump - (load - drive) * (mp.pi - (highest - at_jump) / (load + further - drive))

        def missed(drive, highest):
            left = mp.pi - (at_jump - lowest(drive, highest)) / drive
            speeds = [mp.sqrt(2 * energy / inertia) for energy in (highest, lowest(drive, highest))]
            return at_jump + (drive - further) * left - highest, sum(speeds) / 2 - mean

        drive, highest = mp.findroot(missed, (load / 2 + further / 2, inertia * (1.02 * mean) ** 2 / 2))
        top, bottom = (mp.sqrt(2 * energy / inertia) for energy in (highest, lowest(drive, highest)))
        scene = {
            "inertia": [{"on": "crank", "value": inertia}],
            "load": [
                {"on": "crank", "torque": -load, "from": 0, "to": "180 deg"},
                {"on": "crank", "torque": f"-{further!r}*(omega > {jump!r})"},
            ],
            "drive": {"torque": "balance"},
            "regime": {"speed": mean},
            "flywheel": {"inertia": 0.0},
        }
        result = flywheel.size(flywheel.load(scene), accuracy="normal")
        errors = result.as_dict()["error"]
        assert abs(result.balance.value / drive - 1) <= errors["balance"] <= 1e-9
        assert abs(result.simulation.irregularity / (2 * (top - bottom) / (top + bottom)) - 1) <= errors["irregularity"]


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
    result = flywheel.size(flywheel.load(made_to_measure(inertia, damping, speed, share)), simulate=False)
    period = 2 * np.pi / speed / np.sqrt((1 - share) * (1 + share))
    assert abs(result.simulation.irregularity / (2 * share) - 1) <= result.run.error
    assert abs(result.speed / speed - 1) <= result.cyclic.level_error
    assert abs(result.simulation.period / period - 1) <= result.error.period
    assert abs(result.simulation.speed_min / (speed * (1 - share)) - 1) <= result.error.extreme_speeds


# The search for a steady motion with a flywheel: a motion, a stop that shows there is none; against own integration.


TURN = 2 * math.pi


def branch(scene):
    machine = Machine(flywheel.load({"flywheel": {"inertia": 1}} | scene))
    return Branch(machine, constant_speed.chosen_speed(moments_on(machine, machine.mesh, local=True))[0])


def settled(rates, start, edges, turns=200, rtol=1e-8):
    """Irregularity and speed at phi = 0 of the motion that a machine comes to: states y over phi, the first the speed.

    `rates(phi, y, middle)` is dy/dphi in the piece around `middle`.
    """
    state = np.array(start, dtype=float)

    def turned(state, dense):
        high, low = -math.inf, math.inf
        for a, b in pairwise(edges):
            step = solve_ivp(
                rates, (a, b), state, "LSODA", args=(0.5 * (a + b),), rtol=rtol, atol=1e-2 * rtol, dense_output=dense
            )
            state = step.y[:, -1]
            if dense:
                speeds = step.sol(np.linspace(a, b, 20001))[0]
                high, low = max(high, speeds.max()), min(low, speeds.min())
        return state, high, low

    for _ in range(turns):
        before, (state, _, _) = state, turned(state, False)
        if abs(state / before - 1.0).max() < 1e-7:
            break
    start = float(state[0])
    _, high, low = turned(state, True)
    return 2 * (high - low) / (high + low), start


WINDOW = {"load": [{"on": "crank", "torque": -120, "from": 0, "to": "60 deg"}], "drive": {"torque": "40-2*omega"}}


def test_a_machine_without_a_motion_is_shown_to_stop_and_with_one_it_is_found():
    """40 N m at rest against 120: 80 are lacking. Flywheels that turn end at 1.06303670 kg m²."""
    every = branch(WINDOW)
    for inertia in (2.0, 1.3, 1.1):
        result = every.at(inertia, 1e-9)
        assert result.existence is Existence.MOTION
        assert result.stop is None

    def rates(phi, y, middle):
        return [(40 - 2 * y[0] - 120 * (middle < math.pi / 3)) / (1.1 * y[0])]

    own, _ = settled(rates, [19.0], [0.0, math.pi / 3, TURN])
    assert result.motion.run.irregularity == pytest.approx(own, rel=1e-5)
    fastest = result.motion.run.speed_max
    for inertia in (1.0, 0.0):
        result = every.at(inertia, 1e-9)
        assert result.existence is Existence.NONE
        assert result.motion is None
        assert result.stop.shortfall == pytest.approx(80.0, rel=1e-6)
        assert 0.0 <= result.stop.phi <= math.pi / 3
        assert inertia == 0.0 or result.stop.speed >= fastest  # it starts above any motion that there could be


def test_a_stop_is_shown_where_a_weight_drives_at_any_speed():
    """A weight of 30 N m drives for half a turn however fast the crank: a speed that nothing exceeds is that of its work."""
    weight = {"on": "crank", "torque": "30*sin(phi)"}
    falling = {"on": "crank", "torque": "40/(1 + 0.01*omega**2)"}  # it drives at any speed, too
    load = {"on": "crank", "torque": -120, "from": "60 deg", "to": "120 deg"}
    result = branch({"load": [weight, load, falling], "drive": {"torque": "5/(1 + 0.1*omega)"}}).at(0.3, 1e-9)
    assert result.existence is Existence.NONE
    assert result.stop.shortfall > 0.0


def test_the_angle_of_a_stop_is_that_of_the_motion_from_above():
    """Followed from 20 rad/s or more: it stops in the window, J omega omega' = -80 - 2 omega, at the angle of own steps."""
    result = branch(WINDOW).at(0.5, 1e-9)
    speed = result.stop.speed  # at phi = 0, as the inertia is the same everywhere
    loss = [speed]

    def ended(phi, y):
        return y[0] - 1e-3

    ended.terminal = True
    at, turns = 0.0, -1
    for _ in range(result.stop.turns + 1):
        inside = solve_ivp(lambda phi, y: [(-80 - 2 * y[0]) / (0.5 * y[0])], (0, math.pi / 3), loss, rtol=1e-9, events=ended)
        turns += 1
        if inside.status == 1:
            at = float(inside.t[-1])
            break
        after = solve_ivp(lambda phi, y: [(40 - 2 * y[0]) / (0.5 * y[0])], (math.pi / 3, TURN), inside.y[:, -1], rtol=1e-9)
        loss = after.y[:, -1]
    assert result.stop.turns == turns
    assert result.stop.phi == pytest.approx(at, abs=1e-5)


SYNCHRONOUS = {
    "type": "synchronous",
    "power": "10 kW",
    "poles": 8,
    "frequency": "50 Hz",
    "pull_out_ratio": 2,
    "asynchronous_slip": "1 %",
    "inertia": "0.1 kg m^2",
}


@pytest.mark.parametrize("ratio", [1.7, 2.0, 2.6])
def test_a_synchronous_motor_runs_on_its_stable_branch(ratio):
    """Light rotors were taken to the load angle pi - d: T_p sin d + c u, dd/dt = p u, by own integration."""
    loads = [{"on": "crank", "torque": -500}, {"on": "crank", "torque": -250, "from": 0, "to": "180 deg"}]
    drive = {"on": "motor", "motor": SYNCHRONOUS | {"pull_out_ratio": ratio}}
    scene = {"shafts": {"motor": {"ratio": 5}}, "load": loads, "drive": drive}
    field = 50 * TURN / 4
    rated = 10e3 / field
    damping = rated / (0.01 * field)

    def rates(phi, y, middle):
        lag = field - 5 * y[0]
        moment = 5 * (ratio * rated * math.sin(y[1]) + damping * lag) - 500 - 250 * (middle < math.pi)
        return [moment / (2.5 * y[0]), 4 * lag / y[0]]

    own, _ = settled(rates, [field / 5, math.asin(125 / ratio / rated)], [0.0, math.pi, TURN])
    result = flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": 0}}), accuracy="normal")
    assert result.simulation.irregularity == pytest.approx(own, rel=1e-5)
    assert abs(result.cyclic.multiplier) < 0.2
    assert result.run.along[0].max() < 0.5 * math.pi
    outcome = branch(scene).at(0.0, 1e-9)
    assert outcome.motion.run.irregularity == pytest.approx(own, rel=1e-5)


def test_a_synchronous_motor_that_settles_out_of_step_is_refused_as_such():
    """Its load angle changes by a whole turn in each cycle: the motion repeats, but the motor does not keep its speed."""
    loads = [{"on": "crank", "torque": -100}, {"on": "crank", "torque": -4000, "from": 0, "to": "60 deg"}]
    drive = {"on": "motor", "motor": SYNCHRONOUS | {"asynchronous_slip": "5 %"}}
    scene = {"shafts": {"motor": {"ratio": 5}}, "load": loads, "drive": drive, "flywheel": {"inertia": 2}}
    with pytest.raises(flywheel.SceneError, match=r"out of step .* load angle changes by 360 deg in each cycle"):
        flywheel.size(flywheel.load(scene), accuracy="normal")


def test_a_motor_s_current_that_swings_faster_than_the_load_is_resolved():
    """A long window of load on a direct-current motor with 49 mH: on the machine's own cells nothing settled."""
    motor = {
        "type": "dc",
        "voltage": 220,
        "constant": 1.8377,
        "resistance": 0.30476,
        "inductance": 0.049351,
        "inertia": 2.0189e-3,
    }
    loads = [{"on": "crank", "torque": -44.487}, {"on": "crank", "torque": -124.44, "from": "78.6 deg", "to": "335.2 deg"}]
    scene = {"shafts": {"motor": {"ratio": 10.814}}, "load": loads, "drive": {"on": "motor", "motor": motor}}
    first, last = math.radians(78.6), math.radians(335.2)
    inertia = 2.0189e-3 * 10.814**2 + 0.05

    def rates(phi, y, middle):
        moment = 10.814 * 1.8377 * y[1] - 44.487 - 124.44 * (first < middle < last)
        return [moment / inertia / y[0], (220 - 0.30476 * y[1] - 1.8377 * 10.814 * y[0]) / 0.049351 / y[0]]

    own, _ = settled(rates, [11.0, 7.0], [0.0, first, last, TURN], rtol=1e-10)
    result = flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": 0.05}}), accuracy="normal")
    assert result.simulation.irregularity == pytest.approx(own, rel=1e-5)


@pytest.mark.parametrize("name", ["dc-inductance", "geared-loss"])
def test_an_intermediate_motion_has_the_figures_of_one_solved_to_the_end_within_its_error(name):
    machine = Machine(flywheel.load(regimes.scene(name, inertia=1)))
    speed, unknown = constant_speed.operating_point(machine)
    heavy = periodic_motion.own_motion(machine, speed, Demand(2.0, None, None), 0.0, unknown, 1e-9)
    whole = periodic_motion.own_motion(machine, speed, Demand(1.0, None, None), 0.0, unknown, 1e-11)
    between = periodic_motion.own_motion_near(machine, heavy, 1.0, None, 1e-4, intermediate=True)
    assert abs(between.run.irregularity / whole.run.irregularity - 1.0) <= between.run.error <= 1e-4
    assert between.solved.multiplier == pytest.approx(whole.solved.multiplier, rel=1e-3)
    assert heavy.solved.left == whole.solved.left == 0.0


@pytest.mark.parametrize("name", ["dc-inductance", "geared-loss"])
def test_a_motion_begins_nearer_along_the_secant_through_two(name):
    machine = Machine(flywheel.load(regimes.scene(name, inertia=1)))
    speed, unknown = constant_speed.operating_point(machine)
    demands = Demand(1.1, None, None), Demand(1.2, None, None)
    heavy, heavier = (periodic_motion.own_motion(machine, speed, each, 0.0, unknown, 1e-10) for each in demands)
    plain, along = (
        periodic_motion.own_motion_near(machine, heavy, 1.0, None, 1e-10, beyond=beyond) for beyond in (None, heavier)
    )
    assert abs(along.run.irregularity / plain.run.irregularity - 1.0) <= along.run.error + plain.run.error
    if name == "dc-inductance":  # solved once, as nothing cuts its cells
        assert along.solved.steps < plain.solved.steps


def test_a_motion_in_which_no_mesh_reverses_is_solved_to_the_end():
    line = {"type": "line", "starting_torque": 40, "slope": 1.0, "inertia": 0.001}
    scene = {"shafts": {"motor": {"ratio": 3, "efficiency": 0.9}}, "drive": {"on": "motor", "motor": line}}
    machine = Machine(flywheel.load({**scene, "load": [{"on": "crank", "torque": "-50 - 5*sin(phi)"}]}))
    motion = periodic_motion.own_motion(machine, 8.0, Demand(1.0, None, None), 0.0, 0.0, 1e-9)
    assert np.isin(motion.solved.moments.mesh.edges, machine.mesh).all()
    assert motion.solved.left == 0.0


@pytest.mark.parametrize("asked", [{"inertia": 0}, {"inertia": 0.5}, {"irregularity": 0.01}])
def test_the_steady_point_of_a_two_axis_motor_under_an_even_load_is_algebra(asked):
    """Speed and multiplier by Krause's equations in currents: the linear system at the point, over one turn."""
    scene = {"drive": {"motor": KRAUSE}, "load": [{"on": "crank", "torque": -10}], "flywheel": asked}
    inertia = 0.089 + asked.get("inertia", 0.0)

    def rates(y):  # fluxes of stator and rotor on q and d, speed
        return two_axis_by_hand(y, -10, inertia)[0]

    state = np.array([0.02, -0.47, 0.0, -0.45, 180.0])
    for _ in range(60):  # Newton's method
        jacobian = np.array([(rates(state + h) - rates(state - h)) / (2 * h.sum()) for h in 1e-6 * np.eye(5)]).T
        state = state - np.linalg.solve(jacobian, rates(state))
    result = flywheel.size(flywheel.load(scene), accuracy="normal")
    assert result.speed == pytest.approx(state[4], rel=1e-9)
    if "irregularity" in asked:
        assert result.flywheel.exact == 0.0
        assert result.flywheel.needed is False
    else:
        assert result.simulation.irregularity == 0.0
    slowest = np.linalg.eigvals(jacobian).real.max()
    assert result.cyclic.multiplier == pytest.approx(math.exp(slowest * TURN / state[4]), rel=1e-5)


@pytest.mark.slow
def test_a_yoke_that_weighs_nothing_at_its_dead_centres_needs_no_flywheel():
    """The limit of light wheels, by own integration with 1e-3 and 5e-4 kg m²; none is asked of the machine itself."""
    scene = {
        "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.05}, "yoke": {"mass": 40}},
        "load": [{"on": "crank", "torque": -20}],
        "drive": {"torque": "1000*(1 - omega/10)"},
    }

    def own(inertia):
        def rates(phi, y, middle):
            total, slope = inertia + 0.1 * math.sin(phi) ** 2, 0.2 * math.sin(phi) * math.cos(phi)
            return [(1000 * (1 - y[0] / 10) - 20 - 0.5 * slope * y[0] ** 2) / (total * y[0])]

        return settled(rates, [9.8], [0.0, math.pi, TURN], turns=2)[0]

    limit = 2 * own(5e-4) - own(1e-3)
    assert limit == pytest.approx(0.0098, rel=1e-4)
    result = flywheel.size(flywheel.load({**scene, "flywheel": {"irregularity": 0.05}}))
    assert result.flywheel.exact == 0.0
    assert result.flywheel.needed is False
    assert result.simulation.irregularity == pytest.approx(limit, rel=1e-5)
    assert any("limit for ever lighter flywheels" in message for message in result.messages)
    needed = flywheel.size(flywheel.load({**scene, "flywheel": {"irregularity": 0.009}}), accuracy="normal").flywheel
    assert needed.needed
    with pytest.raises(flywheel.SceneError, match="I\\* \\+ J = 0"):
        flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": 0}}))
    light = branch(scene).at(0.0, 1e-9)
    assert light.motion.vanishing
    assert light.motion.inertia == 0.0


def test_a_stiff_machine_that_needs_no_flywheel_is_found_to_need_none():
    """A hydraulic motor whose relief valve opens in the window, on 1e-4 kg m²: a change fades by exp(-1e4) in a cycle."""
    motor = {
        "type": "hydraulic",
        "displacement": "24.08 cm^3",
        "flow": "62.36 l/min",
        "pressure": "98.31 bar",
        "volumetric_efficiency": 0.9663,
        "mechanical_efficiency": 0.8937,
    }
    loads = [{"on": "crank", "torque": -0.5325}, {"on": "crank", "torque": -18.843, "from": "27.7 deg", "to": "167.5 deg"}]
    scene = {"load": loads, "drive": {"motor": motor}, "inertia": [{"on": "crank", "value": 1e-4}]}
    own = flywheel.size(flywheel.load({**scene, "flywheel": {"irregularity": 0.1}}), accuracy="confirm")
    assert own.flywheel.exact == 0.0
    volume, idle = 24.08e-6 / TURN, 62.36e-3 / 60 / (24.08e-6 / TURN)
    most = 0.8937 * 98.31e5 * volume

    def rates(phi, y, middle):
        drive = min(most, most * (idle - y[0]) / ((1 - 0.9663) * idle))
        return [(drive - 0.5325 - 18.843 * (math.radians(27.7) < middle < math.radians(167.5))) / (1e-4 * y[0])]

    expected, _ = settled(rates, [0.98 * idle], [0.0, math.radians(27.7), math.radians(167.5), TURN], turns=2)
    assert own.simulation.irregularity == pytest.approx(expected, rel=1e-5)


# Steps through a smooth piece: explicit, implicit, what ends them, and one steady cycle of them.


TIGHT, ENDS = 1e-13, (0.0, 1e9)


def stepped(rates, first, until, ends=ENDS, *, tight=TIGHT, hint=None, events=None, along=None):
    tolerance = tight, np.full(2, tight)
    return list(through(Piece(rates, ends, until, tolerance, along), 0.0, np.array(first), hint, events))


def falling(acceleration):
    return lambda t, state: np.array([state[1], acceleration])


@pytest.mark.parametrize(
    ("acceleration", "first", "ends", "hint", "end"),
    [
        (2.0, [0.0, 1.0], (0.0, 6.0), None, 2.0),
        (-2.0, [0.0, 2.0], (0.0, 0.999), 10.0, 1 - np.sqrt(1 - 0.999)),  # past the end and back within a step
        (-2.0, [0.5, 1.0], (0.0, 5.0), None, 0.5 + np.sqrt(0.75)),  # turns back and leaves by the other end
        (0.0, [0.0, 1.0], (0.0, 500.0), None, 100.0),  # time runs out
    ],
)
def test_the_last_step_ends_exactly_where_phi_leaves_the_piece(acceleration, first, ends, hint, end):
    steps = stepped(falling(acceleration), first, 100.0, ends, hint=hint)
    assert steps[-1].end == pytest.approx(end, rel=1e-12)
    assert steps[-1].dense(end)[1] == pytest.approx(first[1] + acceleration * end, rel=1e-11)


@pytest.mark.parametrize(
    ("values", "sides", "crossed", "end"),
    [
        (lambda t, y: np.array([2.5 - t, t - 2.0]), (1.0, -1.0), 1, 2.0),  # the first of several
        (lambda t, y: (((t - 3.123) ** 2) - 1e-6)[None], (1.0,), 0, 3.122),  # below within a step, and back
        (lambda t, y: (-t)[None], (1.0,), 0, 0.0),  # at once
        (lambda t, y: ((t - 3.0) ** 2 + 1e-9)[None], (1.0,), None, 10.0),  # only touches zero
    ],
)
def test_a_step_ends_where_something_watched_changes_its_sign(values, sides, crossed, end):
    steps = stepped(falling(0.0), [0.0, 1.0], 10.0, (0.0, 50.0), hint=10.0, events=Events(values, np.array(sides)))
    assert (steps[-1].crossed, steps[-1].end) == (crossed, pytest.approx(end, abs=1e-10))


def test_an_event_ends_the_motion_before_laws_that_are_not_defined_beyond_it():
    def rates(t, state):
        if t > 7.35:
            raise ValueError("beyond")
        return np.array([1.0, 40.0 * math.cos(40.0 * t)])

    events = Events(lambda t, y: (7.3 - t)[None], np.array([1.0]))
    steps = stepped(rates, [0.0, 0.0], 10.0, (0.0, 50.0), events=events)
    assert len(steps) > 30
    assert (steps[-1].crossed, steps[-1].end) == (0, pytest.approx(7.3, abs=1e-10))
    assert all(step.crossed is None for step in steps[:-1])
    with pytest.raises(ValueError, match="beyond"):
        stepped(rates, [0.0, 0.0], 10.0, (0.0, 50.0), events=Events(lambda t, y: (8.0 - t)[None], np.array([1.0])))


def test_a_piece_that_one_step_passes_costs_one_step():
    taken = []

    def rates(t, state):
        taken.append(t)
        return np.array([1.0 + 0.1 * state[1], math.cos(3.0 * t)])

    (step,) = stepped(rates, [0.0, 0.0], 10.0, (0.0, 0.02), hint=1.0)
    assert len(taken) < 20
    end = step.end
    assert step.last[0] == 0.02
    assert end + 0.1 * (1.0 - math.cos(3.0 * end)) / 9.0 == pytest.approx(0.02, rel=1e-13)
    assert step.last[1] == pytest.approx(math.sin(3.0 * end) / 3.0, rel=1e-13)


def of(along):
    """Rates of a state at an instant, of those at many."""
    return lambda t, state: along(np.array([t]), np.asarray(state)[:, None])[:, 0]


def relaxing(rate: float):
    """phi' = 1, y' = -rate (y - cos t) - sin t: y = cos t + (y0 - 1) exp(-rate t)."""

    def along(t, states):
        return np.array([np.ones_like(t), -rate * (states[1] - np.cos(t)) - np.sin(t)])

    return of(along), RateField(along, np.ones(2))


@pytest.mark.parametrize("rate", [1e2, 1e8])
def test_a_stiff_relaxation_takes_few_steps_at_full_accuracy(rate):
    rates, along = relaxing(rate)
    steps = stepped(rates, [0.0, 3.0], 10.0, along=along)
    assert len(steps) < 150
    assert steps[-1].end == 10.0
    for step in steps:
        times = np.linspace(step.start, step.end, 7)
        assert step.dense(times)[1] == pytest.approx(np.cos(times) + 2.0 * np.exp(-rate * times), abs=2e-12)


def test_a_stiff_motion_ends_exactly_where_it_leaves_the_piece_or_something_watched_its_side():
    rates, along = relaxing(1e5)
    last = stepped(rates, [0.0, 1.0], 10.0, (0.0, 2.5), along=along)[-1]
    assert last.end == pytest.approx(2.5, rel=1e-14)
    assert last.dense(last.end) == pytest.approx([2.5, np.cos(2.5)], rel=1e-12)
    events = Events(lambda t, states: (states[1] + 0.5)[None], np.array([1.0]))
    last = stepped(rates, [0.0, 1.0], 10.0, events=events, along=along)[-1]
    assert (last.crossed, last.end) == (0, pytest.approx(2 * np.pi / 3, rel=1e-12))


def test_the_two_ways_agree_on_a_law_that_is_not_linear():
    """y' = -50 (y³ - 1 - sin t): explicit steps of DOP853 and implicit ones."""

    def along(t, states):
        return np.array([np.ones_like(t), -50 * (states[1] ** 3 - 1 - np.sin(t))])

    ways = (None, RateField(along, np.ones(2)))
    ends = [stepped(of(along), [0.0, 2.0], 0.5, along=way)[-1].dense(0.5)[1] for way in ways]
    assert ends[1] == pytest.approx(ends[0], rel=1e-11)


def test_what_is_not_stiff_is_stepped_as_without():
    rates, along = relaxing(1.0)
    plain, offered = (stepped(rates, [0.0, 3.0], 10.0, tight=1e-12, along=way) for way in (None, along))
    assert [step.end for step in plain] == [step.end for step in offered]


def test_where_no_implicit_step_is_accepted_explicit_ones_go_on():
    """Rates at many instants that are no numbers: Newton's method never settles."""
    rates, along = relaxing(30.0)
    broken = RateField(lambda t, states: along.rates(t, states) + np.where(t > 0.5, np.nan, 0.0), along.sizes, 0.0)
    last = stepped(rates, [0.0, 1.0], 1.0, tight=1e-12, along=broken)[-1]
    assert last.dense(1.0)[1] == pytest.approx(np.cos(1.0), abs=1e-10)


def test_a_stretch_of_many_steps_goes_on_implicitly():
    def along(t, states):
        return np.array([np.ones_like(t), 40 * np.cos(40 * t)])

    ways = (None, RateField(along, np.ones(2), np.inf))
    explicit, both = (stepped(of(along), [0.0, 0.0], 3.0, along=way) for way in ways)
    for steps in (explicit, both):
        assert steps[-1].dense(3.0)[1] == pytest.approx(np.sin(120.0), abs=1e-11)
    assert len(both) < len(explicit)


def test_the_fastest_decay_is_told():
    _, along = relaxing(250.0)
    assert decay(along.one, along.sizes, 0.0, [0.0, 1.0]) == pytest.approx(250.0, rel=1e-6)
    growing = RateField(lambda t, states: np.array([np.ones_like(t), 3.0 * states[1]]), np.ones(2))
    assert decay(growing.one, growing.sizes, 0.0, [0.0, 1.0]) == 0.0


def test_rounding_does_not_stop_the_steps():
    """Two large torques that nearly cancel: rates are rough by 1e-16 of them, far above the tolerance."""
    big = 1e6

    def along(t, states):
        return np.array([np.ones_like(t), (1e7 + np.sin(t)) - big * (10.0 + 1e-5 * states[1])])

    solver = Implicit(RateField(along, np.array([1.0, 1e5])), 0.0, np.array([0.0, 0.0]), 3e-14, np.full(2, 3e-14))
    count = 0
    while solver.t < 5.0:
        assert solver.step(5.0 - solver.t, 1.0) is not None
        count += 1
    assert count < 60
    # y' = sin t - 10 y
    expected = (10 * np.sin(5.0) - np.cos(5.0)) / 101
    assert solver.state[1] == pytest.approx(expected, abs=1e-8)


def test_from_rest_a_step_starts_exactly_where_it_is():
    """A pace of -1e-16 there would look like a motion that turns back at once."""

    def along(t, states):
        return np.array([states[1], 10.0 - 2.0 * states[1]])

    solver = Implicit(RateField(along, np.ones(2)), 0.0, np.zeros(2), 1e-12, np.full(2, 1e-12))
    dense = solver.step(4.0, 0.0)
    assert dense is not None
    assert (dense(0.0) == 0.0).all()
    times = np.array([0.0, 1e-9, 1e-3])
    assert dense(times)[1] == pytest.approx(-5.0 * np.expm1(-2.0 * times), rel=1e-9)
    assert dense(times)[0] == pytest.approx(2.5 * (2.0 * times + np.expm1(-2.0 * times)), rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(("gain", "width"), [(1e3, 1e-4), (1e2, 1e-3)])
def test_a_law_that_saturates_does_not_pass_for_rounding(gain, width):
    """y' = -gain tanh((y - cos t)/width) from far off: Newton's method goes astray in long steps, which are none to take."""

    def along(t, states):
        return np.array([np.ones_like(t), -np.sin(t) - gain * np.tanh((states[1] - np.cos(t)) / width)])

    offset, last = 3.0 * width, 5.0 * width / gain + 1e-3
    for step in stepped(of(along), [0.0, 1.0 + offset], last, along=RateField(along, np.ones(2))):
        times = np.linspace(step.start, step.end, 5)
        # y - cos t = d: d' = -gain tanh(d/width), so that sinh(d/width) = sinh(d0/width) exp(-gain t/width)
        expected = np.cos(times) + width * np.arcsinh(np.sinh(offset / width) * np.exp(-gain * times / width))
        assert step.dense(times)[1] == pytest.approx(expected, abs=2e-11)


def cycle_of(name: str, inertia: float, *, scale: float = 1.0) -> tuple[Machine, float, list, float]:
    """A case's cycle from the state at phi = 0 that the references give."""
    machine = Machine(flywheel.load(regimes.scene(name, inertia=inertia)))
    [result] = [item for item in regimes.figures(name)["analysis"].values() if float(item["inertia"]) == inertia]
    speed, start = float(result["speed"]), float(result["speed_at_zero"])
    balance = float(result["balance"]) if result["balance"] is not None else 0.0
    dynamics = MachineDynamics(machine, inertia * machine.scene.flywheel_ratio**2, balance)
    u = (start / speed - 1) / scale
    steps = one_cycle(dynamics, speed, scale, np.array([0.0, u]), 1e-12)
    return machine, speed, steps, u


@pytest.mark.parametrize("name", sample(["governor", "geared-loss"], 2))
def test_a_periodic_motion_comes_back_to_where_it_started(name):
    inertia = regimes.CASES[name].inertias[0]
    machine, _, steps, u = cycle_of(name, inertia)
    last = steps[-1]
    phi, end = last.dense(last.end)[:2]
    assert phi == pytest.approx(machine.scene.cycle, rel=1e-12)
    assert end == pytest.approx(u, abs=1e-9)


def test_the_scale_changes_nothing():
    inertia = regimes.CASES["governor"].inertias[0]
    ends = [cycle_of("governor", inertia, scale=scale)[2][-1].end for scale in (1.0, 0.01)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-10)


@pytest.mark.slow
def test_a_motion_along_a_jump_is_told_apart():
    """Friction that sets in above a speed holds the motion at that speed: no step gets on."""
    rotor = {
        "load": [
            {"on": "crank", "torque": -30, "from": 0, "to": "90 deg"},
            {"on": "crank", "torque": "-60*(omega > 10)"},
        ],
        "drive": {"torque": "20"},
        "flywheel": {"inertia": 2.0},
        "regime": {"speed": 10},
    }
    dynamics = MachineDynamics(Machine(flywheel.load(rotor)), 2.0)
    with pytest.raises(SlidingError):
        one_cycle(dynamics, 10.0, 1.0, np.array([0.0, 0.0]), 1e-10)


def governed(gain: float, inertia: float) -> tuple[Machine, np.ndarray]:
    """A rotor held at 10 rad/s by a drive of a gain (N m s), and its speed less 10 at 128 angles.

    v = omega - 10 obeys gain v = -80 sin phi - 20 cos 3 phi - inertia (10 + v) v', by iteration on its Fourier series.
    """
    scene = {
        "load": [{"on": "crank", "torque": "-100 - 80*sin(phi) - 20*cos(3*phi)"}],
        "inertia": [{"on": "crank", "value": inertia}],
        "drive": {"torque": f"{100 + 10 * gain} - {gain}*omega"},
        "flywheel": {"inertia": 0},
        "regime": {},
    }
    phi, order = 2 * np.pi * np.arange(128) / 128, np.fft.fftfreq(128, 1 / 128)
    load = 80 * np.sin(phi) + 20 * np.cos(3 * phi)
    v = -load / gain
    for _ in range(60):
        slope = np.fft.ifft(np.where(np.abs(order) < 40, 1j * order * np.fft.fft(v), 0)).real
        v = -(load + inertia * (10 + v) * slope) / gain
    return Machine(flywheel.load(scene)), v


@pytest.mark.parametrize("gain", sample([1e6, 1e3], 2))
def test_a_steep_drive_is_stepped_in_few_steps_and_keeps_its_digits(gain):
    """Up to 6e7 time constants a cycle, and a drive whose torque of 1e7 N m leaves but 100 N m."""
    machine, v = governed(gain, 0.01)
    scale = 0.1 * float(np.ptp(v))
    steps = one_cycle(MachineDynamics(machine, 0.0), 10.0, scale, np.array([0.0, v[0] / (10 * scale)]), 3e-14)
    result = np.concatenate([step.dense(np.linspace(step.start, step.end, 9)) for step in steps], axis=1)
    series = np.fft.fft(v) / 128
    exact = (series * np.exp(1j * np.outer(result[0], np.fft.fftfreq(128, 1 / 128)))).sum(axis=1).real
    assert len(steps) < 250
    assert np.abs(10 * scale * result[1] - exact).max() < 1e-11 * np.ptp(v) + 20 * np.finfo(float).eps * 10


def test_a_fast_current_is_confirmed_by_the_steady_motion():
    scene = regimes.scene("dc-inductance", inertia=0.1)
    motor = {**scene["drive"]["motor"], "inductance": 1e-6}
    result = flywheel.size(flywheel.load({**scene, "drive": {**scene["drive"], "motor": motor}}))
    assert result.simulation.route == "time"
    assert abs(result.simulation.irregularity / result.run.irregularity - 1) <= 1e-12
    assert result.error.simulation <= 1e-9


# One machine with several flywheels at once.

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("name", "heaviest", "least"),
    [("drive_lines/compressor", 40.0, 12), ("drive_lines/press", 8_000.0, 3), ("regimes/punch_press", 6_000.0, 3)],
)
def test_motions_with_lighter_and_lighter_flywheels_are_those_of_each_by_itself(name, heaviest, least):
    """Meshes of the presses reverse elsewhere with each flywheel, and the lightest let them stop: there the series ends."""
    machine = Machine(flywheel.load(EXAMPLES / f"{name}.toml"))
    speed = constant_speed.chosen_speed(moments_on(machine, machine.mesh, local=True))[0]
    branch, inertias = Branch(machine, speed), heaviest * 0.5 ** np.arange(1, 13)
    heavier = branch.at(heaviest, 1e-4).motion
    with np.errstate(all="ignore"):  # of those that stop
        together = lighter_motions(machine, heavier, inertias, None, 1e-4)
    result = {place: (motions, row) for motions, places in together for row, place in enumerate(places) if place >= 0}
    assert sorted(result) == [*range(len(result))]
    assert len(result) >= least
    for place, (motions, row) in sorted(result.items()):
        alone, runs = branch.at(float(inertias[place]), 1e-4).motion, motions.runs()
        again = motions.again(row, None, 1e-4)
        assert abs(runs.irregularity[row] / alone.run.irregularity - 1.0) <= runs.error[row] + alone.run.error
        assert again.run.irregularity == pytest.approx(alone.run.irregularity, rel=again.run.error + alone.run.error)
        for one in (np.ptp, np.max):  # on the same cells, but where a mesh may reverse
            assert one(again.run.drive) == pytest.approx(one(alone.run.drive), rel=1e-6)
        for figure in ("inertia", "speed", "speed_max", "speed_min"):
            assert getattr(runs, figure)[row] == pytest.approx(getattr(alone.run, figure), rel=1e-9)
            assert getattr(again.run, figure) == pytest.approx(getattr(alone.run, figure), rel=1e-9)
    with np.errstate(all="ignore"):
        assert all(branch.at(inertia, 1e-4).motion is None for inertia in inertias[len(result) + 1 :].tolist())
