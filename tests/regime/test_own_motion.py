"""The motion on cells fine enough: what holds for moments of the angle alone holds along it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel.machine.dynamics import Moments
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.regime import periodic_motion, turning_moment
from flywheel.regime.periodic_motion import Demand, NoRegimeError, carried
from tests import regimes

SIZED = [
    ("section-c", 0.3),
    ("section-c", 1e-6),
    ("kloss-press", 0.1),
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


@pytest.mark.parametrize(("name", "eps"), SIZED)
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


@pytest.mark.parametrize("name", ["section-c", "yoke", "engine", "two-mechanisms", "shaper", "geared-loss-line"])
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


@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-12])
def test_cells_are_as_fine_as_the_error_asks(rtol):
    motion = motion_of("kloss-press", rtol, inertia=0.1)
    assert motion.run.error <= rtol
    assert motion.level_error <= rtol
    counts = [motion_of("kloss-press", tolerance, inertia=0.1).cycle.mesh.half.size for tolerance in (1e-4, 1e-12)]
    assert counts[0] < counts[1] < 200


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


def _start(moments):
    return float(cells.value(cells.fit(moments.inertia[:1]), np.array([-1.0]))[0])


def _run_of(name):
    motion = motion_of(name, inertia=3)
    return motion.cycle, motion.speed, motion.run


def test_a_heavy_wheel_leads_down_to_a_light_one():
    """Far from the motion at constant speed the iteration starts from heavier flywheels."""
    motion = motion_of("dc-inductance", irregularity=1.5)
    assert motion.run.irregularity == pytest.approx(1.5, rel=1e-12)
    assert motion_of("dc-inductance", inertia=motion.inertia / 100).run.irregularity == pytest.approx(1.5, rel=1e-8)


def test_no_motion_is_named():
    machine = Machine(flywheel.load(regimes.BAD["light"].scene))
    with pytest.raises(NoRegimeError, match="stop within the cycle"):
        periodic_motion.own_motion(machine, 7.5, Demand(0.2, None, None), 0.0, 0.0, 1e-9)


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
        (2, 1e-4, 20.0, 0.999),
        (2, 1e-5, 20.0, 0.9995),
        (2, 1.0, 20.0, 0.9995),
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
