"""Multibody dynamics: equations of motion at single states, poses closed in absolute coordinates, motions by every route."""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from flywheel.mechanisms.linkages.multibody import (
    ENERGY,
    MULTIPLIERS,
    NEWTON,
    REDUCED,
    ROUTES,
    Actions,
    Closure,
    UnreachableError,
    Wrench,
    by_multipliers,
    by_newton,
    components,
    coordinates,
    reduced,
    simulate,
    system,
)
from flywheel.mechanisms.linkages.positions import solve, solve_over
from flywheel.mechanisms.linkages.reactions import reactions
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import Linkage
from tests.limits import sample
from tests.linkages.linkages import CASES, four_bar
from tests.linkages.machines import (
    EXACT,
    GRAVITY,
    MACHINES,
    STARTS,
    double_guided,
    engine,
    heavy,
    model_at,
    motor,
    pendulum,
    prepared,
    published,
    published_rates,
)

every_machine = pytest.mark.parametrize("name", MACHINES)


# -- relations and forces -------------------------------------------------------------------------------------------------


def slope(function, h=1e-3):
    """Derivative at 0 by differences of the sixth order."""
    weights = {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    return np.sum([w * (function(k * h) - function(-k * h)) for k, w in weights.items()], axis=0) / h


@every_machine
def test_jacobian_and_gamma_by_differences(name):
    found, x = prepared(name)
    assert np.abs(found.state(x, 0 * x).value).max() < 1e-14
    assert len(components(found.linkage)) == len(found.state(x, 0 * x).value)
    generator = np.random.default_rng(7)
    x = x + 0.01 * generator.normal(size=x.size)
    v = generator.normal(size=x.size)
    state = found.state(x, v)
    assert_allclose(state.jacobian @ v, slope(lambda h: found.state(x + h * v, v).value), rtol=0, atol=1e-11)
    assert_allclose(-state.gamma, slope(lambda h: found.state(x + h * v, v).jacobian @ v), rtol=0, atol=1e-10)
    assert state.qdot == pytest.approx(slope(lambda h: np.array(found.state(x + h * v, v).q)), abs=1e-11)
    assert state.bend == pytest.approx(slope(lambda h: np.array(found.state(x + h * v, v).qdot)), abs=1e-10)


def test_whole_turns_do_not_open_a_rigid_joint():
    found, x = prepared("rigid joint")
    assert np.abs(found.state(x + 4 * np.pi * np.eye(x.size)[-1], 0 * x).value).max() < 1e-14


@every_machine
def test_forces_do_the_work_of_gravity_drive_and_wrenches(name):
    """Power by the forces where they act, written anew: m g · v_G, drive times rate, F · v_P + T omega."""
    found, x = prepared(name)
    v = np.random.default_rng(8).normal(size=x.size)
    state = found.state(x, v)
    link = found.linkage.links[-1]
    arm = np.array([0.04, -0.03]) - link.com
    c, s = np.cos(x[-1]), np.sin(x[-1])
    point = v[-3:-1] + v[-1] * np.array([-(s * arm[0] + c * arm[1]), c * arm[0] - s * arm[1]])
    power = np.sum([b.mass * (0.3 * v[3 * k] - 9.81 * v[3 * k + 1]) for k, b in enumerate(found.linkage.links)])
    power += (4.0 - 0.2 * state.qdot) * state.qdot + v[-2]
    power += 3.0 * point[0] + (0.7 - 2.0 * state.qdot) * point[1] + 1.5 * v[-1]
    assert found.forces(0.7, state) @ v == pytest.approx(power, rel=1e-13)


@every_machine
def test_reactions_of_free_bodies_are_the_multipliers(name):
    """Forces where they act equal the transposed Jacobian: ideal joints do no work."""
    found, x = prepared(name)
    state = found.state(x, np.random.default_rng(3).normal(size=x.size))
    assert_allclose(found.reaction_wrenches(state), state.jacobian.T, rtol=0, atol=1e-13)


# -- equations of motion at single states ---------------------------------------------------------------------------------


def uniform_four_bar() -> Linkage:
    """The course's: uniform bars of 0.1, 0.35, 0.3 m and 0.4 m between supports; the third runs from support to pin."""
    base = four_bar()
    links = tuple(
        link._replace(mass=m, inertia=m * length**2 / 12, com=(length / 2, 0.0))
        for link, length, m in zip(base.links, (0.1, 0.35, 0.3), (2.0, 3.0, 2.5), strict=True)
    )
    return replace(base, links=links)


@pytest.mark.parametrize("phi", [1.1, 4.4])
def test_the_courses_nine_equations_of_motion(phi):
    """Written out as there, body by body; its third angle is psi, where the print repeats phi."""
    linkage = uniform_four_bar()
    found = model_at(linkage, phi, Actions())
    x, g = Closure(found).at(phi)
    state = found.state(x, 7.0 * g)
    matrix, right = system(found, found.forces(0.0, state), state, found.reaction_wrenches(state))
    assert (matrix.shape, right.shape, np.linalg.matrix_rank(matrix)) == ((17, 17), (17,), 17)
    assert components(linkage) == [(joint, part) for joint in "OABD" for part in "xy"]
    a, r = by_newton(found, 0.0, state)
    (l1, l2, l3), (m1, m2, m3) = (0.1, 0.35, 0.3), (2.0, 3.0, 2.5)
    theta, psi = x[5], x[8]
    r41, r21, r32, r43 = r[0:2], -r[2:4], -r[4:6], r[6:8]  # r32 of the third bar on the second
    equations = [
        *(r21 + r41 - m1 * a[0:2]),
        (r41[0] - r21[0]) * l1 / 2 * sin(phi) + (r21[1] - r41[1]) * l1 / 2 * cos(phi) - m1 * l1**2 / 12 * a[2],
        *(r32 - r21 - m2 * a[3:5]),
        (r32[1] + r21[1]) * l2 / 2 * cos(theta) - (r32[0] + r21[0]) * l2 / 2 * sin(theta) - m2 * l2**2 / 12 * a[5],
        *(r43 - r32 - m3 * a[6:8]),
        -(r43[1] + r32[1]) * l3 / 2 * cos(psi) + (r43[0] + r32[0]) * l3 / 2 * sin(psi) - m3 * l3**2 / 12 * a[8],
    ]
    assert np.abs(r).max() > 1.0
    assert_allclose(equations, 0.0, atol=1e-12 * np.abs(r).max())


@every_machine
def test_all_laws_give_the_acceleration_of_the_reduced_equation(name):
    """I*, its slope and M* here from the linkage solver's poses, g and g': another way than the closures in x, y, theta."""
    found, _ = prepared(name)
    linkage, q = found.linkage, STARTS[name] + 0.02
    pose, g = Closure(found).at(q)
    poses = solve_over(linkage, (linkage.start, q)).poses(q)
    tracks = [(poses.centre(link.name), poses.angle(link.name)) for link in linkage.links]
    rate, bend = (
        np.concatenate([[*getattr(c, part)[:, 0], *getattr(a, part)] for c, a in tracks]) for part in ("rate", "slope")
    )
    inertia, half = float(found.masses @ rate**2), float(found.masses @ (rate * bend))
    for speed in (1.3, -6.0):
        state = found.state(pose, g * speed)
        moment = float(rate @ found.forces(0.3, state))
        alpha, size = (moment - half * speed**2) / inertia, (abs(moment) + abs(half) * speed**2) / inertia
        ours = reduced(found, 0.3, pose, g, speed)
        assert ours.inertia == pytest.approx(inertia, rel=1e-12)
        assert ours.acceleration == pytest.approx(alpha, abs=1e-12 * size)
        for law in (by_newton, by_multipliers):
            a = law(found, 0.3, state).accelerations
            assert float(state.along @ a) + state.bend == pytest.approx(alpha, abs=2e-12 * size)


@pytest.mark.parametrize("name", [name for name, linkage in MACHINES.items() if not linkage.couplings])
def test_reactions_are_those_of_kinetostatics(name):
    """The inverse problem at the acceleration found here gives back the drive and every reaction."""
    found, _ = prepared(name, Actions((0.3, -9.81), 4.0))
    q, speed = STARTS[name], 1.7
    pose, g = Closure(found).at(q)
    state = found.state(pose, g * speed)
    a, r = by_newton(found, 0.0, state)
    alpha = float(state.along @ a) + state.bend
    back = reactions(found.linkage, [q], speed, alpha, gravity=(0.3, -9.81))
    size = np.abs(r).max()
    assert back.action == pytest.approx(4.0, abs=1e-11 * size)
    for (joint, part), value in zip(components(found.linkage), r, strict=True):
        assert back.components[joint][part][0] == pytest.approx(value, abs=1e-11 * size)


def test_only_the_reduced_inertia_has_to_be_positive():
    """Bodies without mass between heavy ones are no obstacle; a linkage without any mass has no motion."""
    linkage = four_bar()
    found = model_at(linkage, 1.1, Actions(drive=3.0))
    with pytest.raises(UnreachableError, match="an inertia above 0"):
        reduced(found, 0.0, *Closure(found).at(1.1), 1.0)
    found = model_at(
        replace(linkage, links=(linkage.links[0]._replace(inertia=0.2), *linkage.links[1:])), 1.1, found.actions
    )
    x, g = Closure(found).at(1.1)
    assert by_newton(found, 0.0, found.state(x, g * 5.0)).accelerations[2] == pytest.approx(15.0, rel=1e-12)


# -- poses closed in absolute coordinates ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_poses_and_influence_coefficients_over_the_cycle(name):
    found, _ = prepared(name)
    closure, solution = Closure(found), solve(MACHINES[name], 0.0, 2 * np.pi)
    for q in np.arange(1.1, 6.2, 0.9):
        poses = solution.poses(q)
        place, g = closure.at(float(q))
        assert_allclose(place, coordinates(poses), rtol=0, atol=2e-14 * np.abs(place).max())
        centres = [(*poses.centre(link.name).rate[:, 0], poses.angle(link.name).rate[0]) for link in found.linkage.links]
        assert_allclose(g, np.ravel(centres), rtol=0, atol=1e-12)


def test_a_step_as_long_as_half_a_turn_stays_in_its_assembly():
    found, _ = prepared("four-bar")
    near = Closure(found)
    for q in np.linspace(1.1, 1.1 + np.pi, 60):
        near.at(float(q))
    assert_allclose(Closure(found).at(1.1 + np.pi)[0], near.x, atol=1e-14)


# -- whole motions --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def motions():
    """The published slider-crank, from rest at a right angle, by every route."""
    options = {"gravity": GRAVITY, "drive": motor, "rtol": 1e-10}
    ends = {REDUCED: 0.5, NEWTON: 1.0, MULTIPLIERS: 5.0, ENERGY: 0.5}
    return {route: simulate(published(), route, np.pi / 2, 0.0, ends[route], **options) for route in ROUTES}


@pytest.mark.parametrize("route", ROUTES)
def test_published_slider_crank(motions, route):
    run = motions[route]
    exact = {t: pair for t, pair in EXACT.items() if t <= run.t[-1]}
    assert_allclose(np.transpose(run.at(list(exact))), list(exact.values()), rtol=0, atol=1e-8)
    assert (run.q[-1], run.qdot[-1]) == pytest.approx(EXACT[float(run.t[-1])], abs=1e-8)
    theta, omega = (values[:, :2, 2].T for values in (run.coordinates, run.velocities))
    assert np.abs(0.2 * np.sin(theta[0]) + 0.6 * np.sin(theta[1])).max() < 2e-15
    assert np.abs(0.2 * np.cos(theta[0]) * omega[0] + 0.6 * np.cos(theta[1]) * omega[1]).max() < 1e-14
    assert run.closure < 1e-15
    assert theta[1, 0] == pytest.approx(5.9433484, abs=1e-7)


def test_its_figures_to_five_decimals(motions):
    printed = [(2.30098, 2.83038), (4.29275, 4.76466), (8.00001, 3.32778), (20.27036, 3.21967)]
    assert_allclose(np.transpose(motions[MULTIPLIERS].at(list(EXACT))), printed, rtol=0, atol=5.1e-6)
    found = solve_ivp(published_rates, (0, 5), [np.pi / 2, 0.0], "DOP853", list(EXACT), rtol=3e-14, atol=1e-14)
    assert_allclose(found.y.T, list(EXACT.values()), rtol=0, atol=3e-12)


def test_drift_and_energy_residuals_are_told(motions):
    """Drift where coordinates drift, by the tolerance; energy where it is not the state itself."""
    assert 1e-14 < motions[MULTIPLIERS].drift < 1e-10
    assert [motions[route].drift for route in (REDUCED, NEWTON, ENERGY)] == [0.0, 0.0, 0.0]
    coarse = simulate(published(), MULTIPLIERS, np.pi / 2, 0.0, 1.0, gravity=GRAVITY, drive=motor, rtol=1e-6)
    assert 100 * motions[MULTIPLIERS].drift < coarse.drift < 1e-5
    assert coarse.closure < 1e-15
    assert motions[ENERGY].energy_residual is None
    assert all(0.0 < motions[route].energy_residual < 1e-8 for route in (REDUCED, NEWTON, MULTIPLIERS))


def test_reactions_by_newton_and_by_multipliers_agree(motions):
    """Compared at the end, where both have a step; the slider's own balance from its acceleration by differences."""
    newton = motions[NEWTON].reactions
    options = {"gravity": GRAVITY, "drive": motor, "rtol": 1e-10}
    multipliers = simulate(published(), MULTIPLIERS, np.pi / 2, 0.0, 1.0, **options).reactions
    assert motions[REDUCED].reactions is motions[ENERGY].reactions is None
    assert [(name, part.shape[1]) for name, part in newton.items()] == [
        ("pivot", 2),
        ("crank pin", 2),
        ("slider pin", 2),
        ("guide", 2),
    ]
    for name, found in newton.items():
        assert_allclose(found[-1], multipliers[name][-1], rtol=0, atol=1e-6)
    h = 1e-4
    phi, omega = motions[NEWTON].at([1.0 - 2 * h, 1.0 - h, 1.0])
    speed = -omega * (0.2 * np.sin(phi) + 0.04 * np.sin(phi) * np.cos(phi) / np.sqrt(0.36 - 0.04 * np.sin(phi) ** 2))
    acceleration = (3 * speed[2] - 4 * speed[1] + speed[0]) / (2 * h)
    assert newton["slider pin"][-1, 0] == pytest.approx(6.0 * acceleration, rel=1e-5)
    assert newton["slider pin"][-1, 1] + newton["guide"][-1, 0] == pytest.approx(6.0 * 9.81, rel=1e-9)
    assert newton["guide"][-1, 1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", sample(["whitworth", "rack and pinion", "driven by the slider"], 2))
def test_all_routes_agree_on_linkages_of_every_kind(name):
    linkage, start = MACHINES[name], STARTS[name]
    pull = Wrench(linkage.links[-1].name, (lambda t, q, qdot: 3.0 * np.cos(5 * t), 2.0), 0.1)
    speed, until = (0.6, 0.03) if linkage.sliding else (8.0, 0.03)
    options = {"gravity": GRAVITY, "drive": 1.0, "wrenches": (pull,), "rtol": 1e-10}
    ends = [simulate(linkage, route, start, speed, until, **options) for route in ROUTES]
    for run in ends[1:]:
        assert run.q[-1] == pytest.approx(ends[0].q[-1], rel=1e-9)
        assert run.qdot[-1] == pytest.approx(ends[0].qdot[-1], rel=1e-8)
    assert all(run.energy_residual < 1e-9 for run in ends[:3])


@pytest.mark.parametrize("route", ROUTES)
def test_a_pendulum_falls_as_the_elliptic_integral_says(route):
    """From rest at 60 deg above the lowest place it reaches that after a quarter of its period 4 K(sin² 30°) sqrt(l/g)."""
    quarter = float(ellipk(np.sin(np.pi / 6) ** 2)) * np.sqrt(0.5 / 9.81)
    run = simulate(pendulum(), route, -np.pi / 2 + np.pi / 3, 0.0, quarter, gravity=GRAVITY, rtol=1e-9)
    assert run.q[-1] == pytest.approx(-np.pi / 2, abs=1e-8)
    assert run.qdot[-1] == pytest.approx(-np.sqrt(2 * 9.81 / 0.5 * 0.5), rel=1e-8)


def test_the_energy_route_stops_where_the_speed_would_change_sign():
    """A pendulum thrown from its lowest place at 3 rad/s: it rises until 1 - cos = l omega²/(2 g), and swings back."""
    top = -90 + np.degrees(np.arccos(1 - 0.5 * 3.0**2 / (2 * 9.81)))
    with pytest.raises(SceneError, match=r"route: found a motion that stops at") as caught:
        simulate(pendulum(), ENERGY, -np.pi / 2, 3.0, 2.0, gravity=GRAVITY, rtol=1e-7)
    assert float(caught.value.faults[0].found.split()[-2]) == pytest.approx(top, abs=1e-5)
    swung = [
        simulate(pendulum(), route, -np.pi / 2, 3.0, 0.6, gravity=GRAVITY, rtol=1e-8) for route in (REDUCED, MULTIPLIERS)
    ]
    assert swung[0].qdot[-1] < 0.0
    assert swung[1].q[-1] == pytest.approx(swung[0].q[-1], abs=1e-7)
    with pytest.raises(SceneError, match="at rest that nothing moves"):
        simulate(published(), ENERGY, 1.0, 0.0, 1.0)


LOCKING = replace(heavy(four_bar(d=0.4, r=0.3, c=0.35, length=0.1)), start=0.9)
"""A four-bar driven at a bar that cannot turn: its other two bars come into line at acos(19/96) = 78.58 deg."""


@pytest.mark.parametrize("route", sample([REDUCED, ENERGY], 2))
def test_a_lock_of_the_driver_is_named(route):
    with pytest.raises(SceneError, match=r"mechanism\.driver: found a lock at 78\.58"):
        simulate(LOCKING, route, 0.9, 8.0, 1.0, rtol=1e-3)


def test_a_lock_is_named_with_its_angle():
    """By the cosine rule."""
    limit = np.degrees(np.arccos((0.4**2 + 0.3**2 - 0.45**2) / (2 * 0.4 * 0.3)))
    with pytest.raises(UnreachableError) as caught:
        Closure(model_at(LOCKING, 0.9, Actions())).at(3.0)
    assert caught.value.fault.path == "mechanism.driver"
    assert float(caught.value.fault.found.split()[-2]) == pytest.approx(limit, abs=1e-3)


def test_multipliers_pass_a_dead_centre_of_the_driver():
    """All bodies go on where the driver stops and turns: energy is kept, and the bar comes back."""
    run = simulate(LOCKING, MULTIPLIERS, 0.9, 4.0, 0.3, rtol=1e-11)
    assert run.q.max() == pytest.approx(np.arccos((0.4**2 + 0.3**2 - 0.45**2) / (2 * 0.4 * 0.3)), abs=5e-3)
    assert run.q.min() < run.q.max() - 0.3
    assert run.energy_residual < 1e-9
    assert run.closure < 1e-14


@pytest.mark.parametrize(("route", "speed"), sample([(MULTIPLIERS, -5.0), (REDUCED, 5.0)], 2))
def test_a_parallelogram_is_not_carried_through_its_change_point(route, speed):
    """At 0 and 180 deg all its bars are in line, where it may go on as an antiparallelogram."""
    linkage = replace(heavy(four_bar(d=0.4, r=0.1, c=0.4, length=0.1)), start=0.9)
    with pytest.raises(SceneError, match=r"assemblies that meet|a lock at") as caught:
        simulate(linkage, route, 0.9, speed, 2.0, rtol=1e-5)
    told = float(caught.value.faults[0].found.split()[-2])
    assert told == pytest.approx(180.0 if speed > 0 else 0.0, abs=0.1 if route != MULTIPLIERS else 40.0)


def test_a_sliding_driver_takes_a_force():
    """The slider-crank driven at its slider by 20 N does as the same driven at its crank with the force on the slider."""
    by_slider = heavy(engine())
    at_crank = replace(by_slider, driver="O", start=0.0, links=tuple(link._replace(guess=None) for link in by_slider.links))
    poses = solve_over(by_slider, 0.325).poses(0.325)
    phi, gain = float(poses.angle("crank").value[0]), float(poses.angle("crank").rate[0])
    one = simulate(by_slider, MULTIPLIERS, 0.325, -1.0, 0.05, drive=20.0, rtol=1e-11)
    push = Wrench("slider", (20.0, 0.0), at=(0.0, 0.0))
    two = simulate(at_crank, NEWTON, phi, -gain, 0.05, wrenches=(push,), rtol=1e-11, start=poses)
    assert_allclose(one.coordinates[-1], two.coordinates[-1], rtol=0, atol=1e-10)
    assert abs(one.q[-1] - 0.325) > 0.01


@pytest.mark.parametrize("route", sample([MULTIPLIERS, NEWTON], 2))
def test_a_guide_too_many_leaves_the_motion_and_opens_its_reactions(route):
    """Both guides share normal force and moment as they like; pins, and the motion, are as with one."""
    twice = heavy(double_guided())
    once = replace(twice, joints=twice.joints[:-1])
    runs = [simulate(linkage, route, 0.4, 9.0, 0.03, gravity=GRAVITY) for linkage in (once, twice)]
    assert runs[1].q[-1] == pytest.approx(runs[0].q[-1], abs=1e-9)
    for name in "OAB":
        assert_allclose(runs[1].reactions[name][-1], runs[0].reactions[name][-1], rtol=1e-7)
    assert np.isfinite(runs[0].reactions["guide"]).all()
    assert np.isnan(runs[1].reactions["guide"]).all()
    assert np.isnan(runs[1].reactions["second guide"]).all()


def test_it_starts_from_the_assembly_at_the_drivers_position():
    linkage = MACHINES["whitworth"]
    run = simulate(linkage, MULTIPLIERS, 4.0, 1.0, 0.01)
    expected = solve(linkage, 0.0, 4.0).poses(4.0)
    assert_allclose(run.coordinates[0, :, 2], [expected.angle(link.name).value[0] for link in linkage.links], atol=1e-13)


# -- what is refused ------------------------------------------------------------------------------------------------------


def test_arguments_at_fault_are_named_together():
    with pytest.raises(SceneError) as caught:
        simulate(published(), "hamilton", 0.0, np.nan, -1.0, rtol=0.0)
    assert [fault.path for fault in caught.value.faults] == ["route", "qdot", "until", "rtol"]
    assert caught.value.faults[0].expected == "one of reduced, newton, multipliers, energy"


RUBBED = replace(published(), joints=(published().joints[0]._replace(friction=0.1, radius=0.02), *published().joints[1:]))
RUBBING = replace(published(), joints=(published().joints[0]._replace(friction=0.1), *published().joints[1:]))


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"q": "1"}, 'q: found "1", expected a finite number'),
        ({"until": "1"}, 'until: found "1", expected a finite number above 0'),
        ({"gravity": 9.81}, "gravity: found 9.81, expected two numbers"),
        ({"gravity": (0.0, np.nan)}, "gravity: found a value that is not finite"),
        ({"drive": "5"}, 'drive: found "5", expected a finite number'),
        ({"drive": np.nan}, "drive: found nan, expected a finite number"),
        ({"drive": lambda t, q, qdot: np.nan}, "simulate: found loads that are not finite at the start"),
        ({"drive": lambda t, q, qdot: np.nan if t > 0.1 else 1.0}, "rtol: found a motion that cannot be followed"),
        ({"wrenches": Wrench("crank")}, "wrenches: found a value of type Wrench, expected a list of Wrench"),
        ({"wrenches": [("crank", 1.0)]}, r"wrenches\[0\]: found a value of type tuple, expected a Wrench"),
        ({"wrenches": [Wrench("crank", 5.0)]}, r"wrenches\[0\].force: found 5.0, expected two laws"),
        ({"wrenches": [Wrench("crank", torque=np.inf)]}, r"wrenches\[0\].torque: found inf, expected a finite number"),
        ({"wrenches": [Wrench("crank", at=0.1)]}, r"wrenches\[0\].at: found 0.1, expected two numbers"),
        ({"wrenches": [Wrench("frame", at="E")]}, r"wrenches\[0\].body: found 'frame', expected a moving body: crank, rod"),
        ({"wrenches": [Wrench("crank", at="X")]}, r"wrenches\[0\].at: found 'X', expected a point of crank: O, E"),
        (
            {"linkage": RUBBING},
            r"mechanism\.joints\.pivot\.radius: found 0 m, expected the radius of a pin that has friction",
        ),
        (
            {"linkage": RUBBED, "route": REDUCED},
            r"route: found reduced for joints with friction, .* expected newton or mult",
        ),
        ({"start": 0.5}, "start: found 0.5, expected Poses"),
        ({"linkage": None}, "linkage: found nothing, expected a Linkage"),
    ],
)
def test_arguments_of_another_type_are_refused(changes, text):
    with pytest.raises(SceneError, match=f"^{text}"):
        simulate(**({"linkage": published(), "route": MULTIPLIERS, "q": 0.0, "qdot": 1.0, "until": 1.0} | changes))
