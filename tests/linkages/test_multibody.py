"""Linkages moved in time, with friction and without."""

from __future__ import annotations

from dataclasses import replace
from math import asin, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.special import ellipk

import flywheel
from flywheel import SceneError
from flywheel.mechanisms.linkages.multibody import (
    ENERGY,
    MULTIPLIERS,
    NEWTON,
    REDUCED,
    ROUTES,
    Closure,
    LinkageActions,
    UnreachableError,
    Wrench,
    by_driver,
    by_multipliers,
    by_newton,
    components,
    coordinates,
    simulate,
    system,
)
from flywheel.mechanisms.linkages.positions import solve, solve_over
from flywheel.mechanisms.linkages.reactions import reactions
from flywheel.scene.linkage import CAM, FIXED, FRAME, PIN, SLIDE, Joint, Link, Linkage, Point
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

# Multibody dynamics: equations of motion at single states, poses closed in absolute coordinates, motions by every route.


every_machine = pytest.mark.parametrize("name", MACHINES)


# -- relations and forces -------------------------------------------------------------------------------------------------


def slope(function, h=1e-3):
    """Derivative at 0 by differences of the sixth order."""
    weights = {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    return np.sum([w * (function(k * h) - function(-k * h)) for k, w in weights.items()], axis=0) / h


@every_machine
def test_jacobian_and_gamma_by_differences(name):
    result, x = prepared(name)
    assert np.abs(result.state(x, 0 * x).value).max() < 1e-14
    assert len(components(result.linkage)) == len(result.state(x, 0 * x).value)
    generator = np.random.default_rng(7)
    x = x + 0.01 * generator.normal(size=x.size)
    v = generator.normal(size=x.size)
    state = result.state(x, v)
    assert_allclose(state.jacobian @ v, slope(lambda h: result.state(x + h * v, v).value), rtol=0, atol=1e-11)
    assert_allclose(-state.gamma, slope(lambda h: result.state(x + h * v, v).jacobian @ v), rtol=0, atol=1e-10)
    assert state.qdot == pytest.approx(slope(lambda h: np.array(result.state(x + h * v, v).q)), abs=1e-11)
    assert state.bend == pytest.approx(slope(lambda h: np.array(result.state(x + h * v, v).qdot)), abs=1e-10)


def test_whole_turns_do_not_open_a_rigid_joint():
    result, x = prepared("rigid joint")
    assert np.abs(result.state(x + 4 * np.pi * np.eye(x.size)[-1], 0 * x).value).max() < 1e-14


@every_machine
def test_forces_do_the_work_of_gravity_drive_and_wrenches(name):
    """Power by the forces where they act, written anew: m g · v_G, drive times rate, F · v_P + T omega."""
    result, x = prepared(name)
    v = np.random.default_rng(8).normal(size=x.size)
    state = result.state(x, v)
    link = result.linkage.links[-1]
    arm = np.array([0.04, -0.03]) - link.com
    c, s = np.cos(x[-1]), np.sin(x[-1])
    point = v[-3:-1] + v[-1] * np.array([-(s * arm[0] + c * arm[1]), c * arm[0] - s * arm[1]])
    power = np.sum([b.mass * (0.3 * v[3 * k] - 9.81 * v[3 * k + 1]) for k, b in enumerate(result.linkage.links)])
    power += (4.0 - 0.2 * state.qdot) * state.qdot + v[-2]
    power += 3.0 * point[0] + (0.7 - 2.0 * state.qdot) * point[1] + 1.5 * v[-1]
    assert result.forces(0.7, state) @ v == pytest.approx(power, rel=1e-13)


@every_machine
def test_reactions_of_free_bodies_are_the_multipliers(name):
    """Forces where they act equal the transposed Jacobian: ideal joints do no work."""
    result, x = prepared(name)
    state = result.state(x, np.random.default_rng(3).normal(size=x.size))
    assert_allclose(result.reaction_wrenches(state), state.jacobian.T, rtol=0, atol=1e-13)


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
    result = model_at(linkage, phi, LinkageActions())
    x, g = Closure(result).at(phi)
    state = result.state(x, 7.0 * g)
    matrix, right = system(result, result.forces(0.0, state), state, result.reaction_wrenches(state))
    assert (matrix.shape, right.shape, np.linalg.matrix_rank(matrix)) == ((17, 17), (17,), 17)
    assert components(linkage) == [(joint, part) for joint in "OABD" for part in "xy"]
    a, r = by_newton(result, 0.0, state)
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
    result, _ = prepared(name)
    linkage, q = result.linkage, STARTS[name] + 0.02
    pose, g = Closure(result).at(q)
    poses = solve_over(linkage, (linkage.start, q)).poses(q)
    tracks = [(poses.centre(link.name), poses.angle(link.name)) for link in linkage.links]
    rate, bend = (
        np.concatenate([[*getattr(c, part)[:, 0], *getattr(a, part)] for c, a in tracks]) for part in ("rate", "slope")
    )
    inertia, half = float(result.masses @ rate**2), float(result.masses @ (rate * bend))
    for speed in (1.3, -6.0):
        state = result.state(pose, g * speed)
        moment = float(rate @ result.forces(0.3, state))
        alpha, size = (moment - half * speed**2) / inertia, (abs(moment) + abs(half) * speed**2) / inertia
        for law in (by_newton, by_multipliers):
            a, _ = law(result, 0.3, state)
            assert float(state.along @ a) + state.bend == pytest.approx(alpha, abs=2e-12 * size)


@pytest.mark.parametrize("name", [name for name, linkage in MACHINES.items() if not linkage.couplings])
def test_reactions_are_those_of_kinetostatics(name):
    """The inverse problem at the acceleration found here gives back the drive and every reaction."""
    result, _ = prepared(name, LinkageActions((0.3, -9.81), 4.0))
    q, speed = STARTS[name], 1.7
    pose, g = Closure(result).at(q)
    state = result.state(pose, g * speed)
    a, r = by_newton(result, 0.0, state)
    alpha = float(state.along @ a) + state.bend
    back = reactions(result.linkage, [q], speed, alpha, gravity=(0.3, -9.81))
    size = np.abs(r).max()
    assert back.action == pytest.approx(4.0, abs=1e-11 * size)
    for (joint, part), value in zip(components(result.linkage), r, strict=True):
        assert back.components[joint][part][0] == pytest.approx(value, abs=1e-11 * size)


def test_only_the_reduced_inertia_has_to_be_positive():
    """Bodies without mass between heavy ones are no obstacle; a linkage without any mass has no motion."""
    linkage = four_bar()
    result = model_at(linkage, 1.1, LinkageActions(drive=3.0))
    with pytest.raises(UnreachableError, match="an inertia above 0"):
        by_driver(result, 1.1, 1.0, 0.1, 1e-9, newton=False)
    result = model_at(
        replace(linkage, links=(linkage.links[0]._replace(inertia=0.2), *linkage.links[1:])), 1.1, result.actions
    )
    x, g = Closure(result).at(1.1)
    assert by_newton(result, 0.0, result.state(x, g * 5.0))[0][2] == pytest.approx(15.0, rel=1e-12)


# -- poses closed in absolute coordinates ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_poses_and_influence_coefficients_over_the_cycle(name):
    result, _ = prepared(name)
    closure, solution = Closure(result), solve(MACHINES[name], 0.0, 2 * np.pi)
    for q in np.arange(1.1, 6.2, 0.9):
        poses = solution.poses(q)
        place, g = closure.at(float(q))
        assert_allclose(place, coordinates(poses), rtol=0, atol=2e-14 * np.abs(place).max())
        centres = [(*poses.centre(link.name).rate[:, 0], poses.angle(link.name).rate[0]) for link in result.linkage.links]
        assert_allclose(g, np.ravel(centres), rtol=0, atol=1e-12)


def test_a_step_as_long_as_half_a_turn_stays_in_its_assembly():
    result, _ = prepared("four-bar")
    near = Closure(result)
    for q in np.linspace(1.1, 1.1 + np.pi, 60):
        near.at(float(q))
    assert_allclose(Closure(result).at(1.1 + np.pi)[0], near.x, atol=1e-14)


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
    result = solve_ivp(published_rates, (0, 5), [np.pi / 2, 0.0], "DOP853", list(EXACT), rtol=3e-14, atol=1e-14)
    assert_allclose(result.y.T, list(EXACT.values()), rtol=0, atol=3e-12)


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
    for name, result in newton.items():
        assert_allclose(result[-1], multipliers[name][-1], rtol=0, atol=1e-6)
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
    assert float(caught.value.faults[0].defect.split()[-2]) == pytest.approx(top, abs=1e-5)
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
    with pytest.raises(
        SceneError,
        match=r"mechanism\.driver: found a lock at 78\.58.*; the route multipliers follows a motion through a dead centre",
    ):
        simulate(LOCKING, route, 0.9, 8.0, 1.0, rtol=1e-3)


def test_a_lock_is_named_with_its_angle():
    """By the cosine rule."""
    limit = np.degrees(np.arccos((0.4**2 + 0.3**2 - 0.45**2) / (2 * 0.4 * 0.3)))
    with pytest.raises(UnreachableError) as caught:
        Closure(model_at(LOCKING, 0.9, LinkageActions())).at(3.0)
    assert caught.value.fault.path == "mechanism.driver"
    assert float(caught.value.fault.defect.split()[-2]) == pytest.approx(limit, abs=1e-3)


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
    text = float(caught.value.faults[0].defect.split()[-2])
    assert text == pytest.approx(180.0 if speed > 0 else 0.0, abs=0.1 if route != MULTIPLIERS else 40.0)


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


# Motion with friction in joints: closed forms, a slider-crank written out by hand, statics at single instants.


ORIGIN = Point("o")
both_routes = pytest.mark.parametrize("route", [NEWTON, MULTIPLIERS])


def alone(joint: Joint, link: Link) -> Linkage:
    """One body on the frame."""
    return Linkage(Link(FRAME, (ORIGIN,)), (link,), (joint,), joint.name)


def wheel(mu=0.3, radius=0.02):
    """A balanced wheel of 5 kg and 0.2 kg m² on a rough pivot."""
    joint = Joint("pivot", PIN, FRAME, "wheel", ORIGIN, ORIGIN, friction=mu, radius=radius)
    return alone(joint, Link("wheel", (ORIGIN,), mass=5.0, inertia=0.2))


"""A four-bar driven at a bar that cannot turn."""
DRAG = 0.02 * 0.3 / hypot(1.0, 0.3) * 5.0 * 9.81  # N m, the friction circle under the wheel's weight


def block(mu=0.2, length=0.0, com=(0.0, 0.0)):
    """A block of 10 kg in a guide along x."""
    joint = Joint("guide", SLIDE, FRAME, "block", ORIGIN, ORIGIN, friction=mu, length=length)
    return alone(joint, Link("block", (ORIGIN,), mass=10.0, inertia=1.0, com=com))


@both_routes
def test_a_wheel_runs_down_and_stays(route):
    """Its drag is constant: it stops after J omega/M, having turned J omega²/(2 M); all its energy went into the pivot."""
    run = simulate(wheel(), route, 0.0, 10.0, 8.0, gravity=GRAVITY)
    stop = 0.2 * 10.0 / DRAG
    assert run.rests == (pytest.approx((stop, 8.0), abs=1e-10),)
    assert run.q[-1] == pytest.approx(0.5 * 10.0 * stop, abs=1e-9)
    assert run.friction["pivot"][0] == pytest.approx(-DRAG, rel=1e-12)
    assert np.isnan(run.friction["pivot"][-1])
    assert run.friction_work["pivot"][-1] == pytest.approx(-10.0, abs=1e-9)
    assert run.energy_residual < 1e-11
    assert_allclose(run.at([1.0, 7.5]), [[10.0 - 0.5 * DRAG / 0.2, run.q[-1]], [10.0 - DRAG / 0.2, 0.0]], atol=1e-9)


@pytest.mark.parametrize("route", sample([NEWTON, MULTIPLIERS], 2))
def test_a_rising_torque_breaks_it_away(route):
    """0.1 t against the drag: it starts when they are equal, and goes by J omega = 0.05 (t² - t0²) - M (t - t0)."""
    run = simulate(wheel(), route, 0.0, 0.0, 8.0, gravity=GRAVITY, drive=lambda t, q, qdot: -0.1 * t)
    start = DRAG / 0.1
    assert run.rests == (pytest.approx((0.0, start), abs=1e-12),)
    assert run.qdot[-1] == pytest.approx(-(0.05 * (64 - start**2) - DRAG * (8 - start)) / 0.2, rel=1e-12)
    stays = simulate(wheel(), route, 0.0, 0.0, 8.0, gravity=GRAVITY, drive=0.999 * DRAG)
    assert stays.rests == ((0.0, 8.0),)
    assert stays.messages == ("mechanism: friction that holds it at 0 deg: it stands still from 0 s on",)
    assert stays.q[-1] == 0.0


@both_routes
def test_a_block_whose_weight_is_lifted_rubs_on_the_other_side(route):
    """N = 100 - 200 t changes sides at half a second: the speed lost is 0.2 times the integral of |N|/m."""
    lift = Wrench("block", (0.0, lambda t, q, qdot: 200.0 * t))
    run = simulate(block(), route, 0.0, 30.0, 1.0, gravity=(0.0, -10.0), wrenches=[lift])
    assert run.qdot[-1] == pytest.approx(29.0, abs=1e-11)
    turned = int(np.argmax(run.t == 0.5)) or int(np.argmin(np.abs(run.t - 0.5)))
    assert run.t[turned] == pytest.approx(0.5, abs=1e-9)
    assert_allclose(run.friction["guide"], -0.2 * np.abs(100 - 200 * run.t), atol=1e-7)


@both_routes
def test_a_shoe_jams_under_a_high_centre_of_mass(route):
    """Its friction F tilts it by F h, which presses its ends with F h/(L/2): no forces are in balance where 2 mu h > L."""
    run = simulate(block(0.2, 0.1, (0.0, 0.2)), route, 0.0, 1.0, 0.1, gravity=(0.0, -10.0))
    assert run.qdot[-1] == pytest.approx(1.0 - 0.1 * 2.0, rel=1e-9)  # tilted too little to lift an end
    with pytest.raises(SceneError, match=r"mechanism\.guide\.friction: found friction that locks .* at 0 m") as caught:
        simulate(block(0.2, 0.05, (0.0, 0.2)), route, 0.0, 1.0, 0.1, gravity=(0.0, -10.0))
    assert len(caught.value.faults) == 1
    push = Wrench("block", (500.0, 0.0))  # through its centre of mass
    rests = simulate(block(0.2, 0.05, (0.0, 0.2)), route, 0.0, 0.0, 0.1, gravity=(0.0, -10.0), wrenches=[push])
    assert rests.messages == (
        "mechanism.guide.friction: friction that locks the mechanism at 0 m: it stands still from 0 s on",
    )


@pytest.mark.parametrize("route", sample([NEWTON, MULTIPLIERS], 2))
def test_a_pendulum_swings_out_beside_its_lowest_place(route):
    """It comes to rest where its weight's moment is below that of the friction circle; what it lost went into its pivot."""
    base = pendulum()
    rough = replace(base, joints=(base.joints[0]._replace(friction=0.5, radius=0.15),))
    run = simulate(rough, route, 0.2, 0.0, 4.0, gravity=GRAVITY, rtol=1e-8)
    ((begin, end),) = run.rests
    assert 1.0 < begin < end == 4.0
    circle = 0.15 * 0.5 / hypot(1.0, 0.5)
    assert 0.0 < abs(run.q[-1] + pi / 2) < asin(circle / 0.5)
    assert run.friction_work["O"][-1] == pytest.approx(2.0 * 9.81 * 0.5 * (sin(run.q[-1]) - sin(0.2)), rel=1e-7)
    assert run.energy_residual < 1e-8


# -- a slider-crank with four rough joints ----------------------------------------------------------------------------------

MU, MU_GUIDE, RADII = 0.1, 0.15, (0.03, 0.025, 0.02)
R, L, C, I2, I3, M2, M3, M4, G = 0.2, 0.6, 0.3, 1.0, 3.0, 12.0, 6.0, 6.0, 9.81


def rough_slider_crank() -> Linkage:
    base = published()
    pins = [joint._replace(friction=MU, radius=r) for joint, r in zip(base.joints[:3], RADII, strict=True)]
    return replace(base, joints=(*pins, base.joints[3]._replace(friction=MU_GUIDE)))


def falling(t, q, qdot):
    return 40.0 - 8.0 * qdot


def newton_and_euler(phi, omega, signs):
    """alpha, and what friction takes per unit of time, from the free bodies; loads of rough joints by repeated solution."""
    s, c = sin(phi), cos(phi)
    sb = -R * s / L
    cb = sqrt(1 - sb * sb)
    b1 = -R * c / (L * cb)
    w3 = b1 * omega
    a, r = np.zeros((12, 12)), np.zeros(12)  # alpha2, a3x, a3y, alpha3, a4; O, A, B (x, y); N
    a[0, 5], a[0, 7] = 1, -1
    a[1, 6], a[1, 8], r[1] = 1, -1, M2 * G
    a[2, 0], a[2, 7], a[2, 8] = -I2, R * s, -R * c
    a[3, 1], a[3, 7], a[3, 9] = -M3, 1, -1
    a[4, 2], a[4, 8], a[4, 10], r[4] = -M3, 1, -1, M3 * G
    a[5, 3], a[5, 7], a[5, 8], a[5, 9], a[5, 10] = -I3, C * sb, -C * cb, (L - C) * sb, -(L - C) * cb
    a[6, 4], a[6, 9] = -M4, 1
    a[7, 10], a[7, 11], r[7] = 1, 1, M4 * G
    a[8, 0], a[8, 3], a[8, 1], r[8] = R * s, C * sb, 1, -R * c * omega**2 - C * cb * w3**2
    a[9, 0], a[9, 3], a[9, 2], r[9] = -R * c, -C * cb, 1, -R * s * omega**2 - C * sb * w3**2
    a[10, 0], a[10, 3], a[10, 4], r[10] = R * s, L * sb, 1, -R * c * omega**2 - L * cb * w3**2
    a[11, 0], a[11, 3], r[11] = R * c, L * cb, R * s * omega**2 + L * sb * w3**2
    inverse = np.linalg.inv(a)
    circle = MU / hypot(1.0, MU)
    rub = np.zeros(4)
    for _ in range(60):
        right = r.copy()
        right[2] -= falling(0.0, phi, omega) + rub[0] - rub[1]
        right[5] -= rub[1] - rub[2]
        right[6] -= rub[3]
        x = inverse @ right
        loads = [*(RADII[k] * circle * hypot(x[5 + 2 * k], x[6 + 2 * k]) for k in range(3)), MU_GUIDE * abs(x[11])]
        before, rub = rub, -np.array(signs) * loads
        if np.abs(rub - before).max() < 1e-14 * np.abs(rub).max():
            break
    rates = omega * np.array([1.0, b1 - 1.0, -b1, -R * s - L * sb * b1])
    return x[0], float(rub @ rates)


def by_hand(until, phi=pi / 2, omega=0.0):
    """phi, omega, friction's work: restarted at every quarter of a turn, where the rod or the slider turns back."""
    t, y, k = 0.0, [phi, omega, 0.0], int(phi / (pi / 2))
    while t < until:
        k += 1
        middle = (k - 0.5) * pi / 2
        turns = (1.0, -1.0, np.sign(cos(middle)), -np.sign(sin(middle)))  # of the three pins, and the slider's way

        def rates(t, y, signs=turns):
            alpha, power = newton_and_euler(y[0], y[1], signs)
            return [y[1], alpha, power]

        def over(t, y, end=k * pi / 2):
            return y[0] - end

        over.terminal = True
        result = solve_ivp(rates, (t, until), y, "DOP853", rtol=1e-12, atol=1e-13, events=over)
        t, y = result.t[-1], result.y[:, -1]
    return y


@pytest.mark.slow
@both_routes
def test_a_rough_slider_crank_under_a_falling_torque(route):
    """Friction in all its joints, from rest at a dead centre of its rod, against the bodies' equations written out."""
    run = simulate(rough_slider_crank(), route, pi / 2, 0.0, 2.0, gravity=GRAVITY, drive=falling)
    phi, omega, work = by_hand(2.0)
    assert (run.q[-1], run.qdot[-1]) == pytest.approx((phi, omega), abs=1e-8)
    assert sum(part[-1] for part in run.friction_work.values()) == pytest.approx(work, rel=1e-8)
    assert run.energy_residual < 1e-9
    assert run.closure < 1e-14
    assert all((part <= 1e-12).all() for part in run.friction_work.values())


@pytest.mark.slow
def test_its_slider_turns_back_by_both_routes():
    """Past its inner dead centre, where its friction and the pins' loads jump."""
    options = {"gravity": GRAVITY, "drive": falling}
    ends = [simulate(rough_slider_crank(), route, 3.0, 3.0, 0.1, **options) for route in (NEWTON, MULTIPLIERS)]
    phi, omega, work = by_hand(0.1, 3.0, 3.0)
    assert phi > pi
    for run in ends:
        assert (run.q[-1], run.qdot[-1]) == pytest.approx((phi, omega), abs=1e-9)
        assert sum(part[-1] for part in run.friction_work.values()) == pytest.approx(work, rel=1e-8)
    for name, result in ends[0].reactions.items():
        assert_allclose(result[-1], ends[1].reactions[name][-1], rtol=0, atol=1e-6)


def test_joints_hold_it_fast():
    """Pins as thick as the crank is long: from rest no drive moves it, and a push does not get far."""
    base = rough_slider_crank()
    pins = tuple(joint._replace(friction=3.0, radius=0.15) for joint in base.joints[:3])
    state = replace(base, joints=(*pins, base.joints[3]._replace(friction=3.0)))
    run = simulate(state, NEWTON, 0.3, 0.0, 2.0, gravity=GRAVITY, drive=500.0)
    assert run.rests == ((0.0, 2.0),)
    assert run.messages == ("mechanism: friction that holds it at 17.1887339 deg: it stands still from 0 s on",)
    moved = simulate(state, NEWTON, 0.3, 5.0, 2.0, gravity=GRAVITY)
    assert 0.0 < moved.rests[0][0] < 0.5
    assert moved.energy_residual < 1e-9


def test_loads_that_are_no_numbers_at_rest():
    def drive(t, q, qdot):
        return np.nan if t > 0.1 else 0.0

    with pytest.raises(SceneError, match=r"simulate: found loads that are not finite at 0\.1"):
        simulate(wheel(), NEWTON, 0.0, 0.0, 1.0, drive=drive)
    with pytest.raises(SceneError, match=r"simulate: found loads that are not finite at the start"):
        simulate(wheel(), NEWTON, 0.0, 0.0, 1.0, drive=lambda t, q, qdot: np.nan)


@pytest.mark.slow
def test_multipliers_with_friction_pass_a_dead_centre_of_the_driver():
    """Forwards is along the motion of all bodies: friction opposes it on, while the driver turns back."""
    run = simulate(roughened(LOCKING, 0.02), MULTIPLIERS, 0.9, 4.0, 0.3)
    assert run.q.min() < run.q.max() - 0.3
    assert not run.rests
    assert all((np.diff(part) <= 1e-12).all() for part in run.friction_work.values())
    assert run.energy_residual < 1e-9


@pytest.mark.slow
@both_routes
def test_simulated_machines_with_friction_move_the_same(route):
    """The reduced equation of a scene, another integration of the same law, for the same slider-crank."""
    pins = {"pivot": (FRAME, "crank", "origin"), "crank_pin": ("crank", "rod", "E"), "slider_pin": ("rod", "slider", "E")}
    joints = [
        {"name": name, "type": "pin", "between": [f"{one}.{at}", f"{two}.origin"], "friction": MU, "radius": radius}
        for (name, (one, two, at)), radius in zip(pins.items(), RADII, strict=True)
    ]
    joints.append(
        {"name": "guide", "type": "slide", "between": ["frame.origin", "slider.origin"], "friction": MU_GUIDE, "length": 0.1}
    )
    bodies = {
        "crank": {"points": {"E": [R, 0.0]}, "mass": M2, "inertia": I2},
        "rod": {"points": {"E": [L, 0.0]}, "mass": M3, "inertia": I3, "com": [C, 0.0], "guess": 0.0},
        "slider": {"mass": M4},
    }
    mechanism = {"type": "linkage", "driver": "pivot", "bodies": bodies, "joints": joints}
    scene = {"mechanism": mechanism, "gravity": {"g": G}, "drive": {"torque": "40 - 8*omega"}}
    machine = flywheel.load(scene)
    motion = flywheel.simulate(machine, 1.0, 0.0, 1.0, rtol=1e-11)
    run = simulate(machine.mechanisms[0].linkage, route, 1.0, 0.0, 1.0, gravity=(0.0, -G), drive=falling)
    assert run.q[-1] == pytest.approx(motion.phi[-1], abs=1e-8)
    assert run.qdot[-1] == pytest.approx(motion.omega[-1], abs=1e-8)


# -- linkages of every kind -------------------------------------------------------------------------------------------------


def roughened(linkage: Linkage, mu=0.08) -> Linkage:
    """The same with friction in every joint that moves, in cams, and teeth with a pressure angle."""
    joints = tuple(
        joint
        if joint.kind == FIXED
        else joint._replace(friction=mu, radius=0.01 * (joint.kind == PIN), length=0.05 * (joint.kind == SLIDE))
        for joint in linkage.joints
    )
    couplings = tuple(
        pair._replace(friction=mu) if pair.kind == CAM else pair._replace(pressure_angle=0.35) for pair in linkage.couplings
    )
    return replace(linkage, joints=joints, couplings=couplings)


@pytest.mark.parametrize("name", sample(list(MACHINES), 8))
def test_friction_and_reactions_are_those_of_kinetostatics(name):
    """The inverse problem at the acceleration that needs just this drive has the same friction and reactions everywhere."""
    linkage, q = roughened(MACHINES[name]), STARTS[name]
    speed = 0.6 if linkage.sliding else 8.0
    run = simulate(linkage, NEWTON, q, speed, 1e-3, gravity=GRAVITY, drive=1.0)

    def back(acceleration):
        return reactions(linkage, [q], speed, acceleration, gravity=GRAVITY)

    low, high = -100.0, 100.0
    for _ in range(8):
        one, other = back(low).action[0] - 1.0, back(high).action[0] - 1.0
        if one == other:
            break
        low, high = high, high - other * (high - low) / (other - one)
    result = back(high)
    assert result.action[0] == pytest.approx(1.0, abs=1e-9)
    size = max(float(np.abs(part[0]).max()) for part in run.reactions.values())
    for joint in linkage.joints:
        ours = run.reactions[joint.name][0]
        parts = [part for name, part in components(linkage) if name == joint.name]
        assert_allclose([result.components[joint.name][part][0] for part in parts], ours, rtol=0, atol=1e-9 * size)
    for name, part in run.friction.items():
        assert result.components[name]["friction"][0] == pytest.approx(part[0], abs=1e-9 * size)


@pytest.mark.parametrize("name", sample(list(MACHINES), 4))
def test_both_routes_agree_with_friction_on_linkages_of_every_kind(name):
    linkage, q = roughened(MACHINES[name]), STARTS[name]
    speed = 0.6 if linkage.sliding else 8.0
    one, two = (simulate(linkage, r, q, speed, 0.05, gravity=GRAVITY, drive=1.0) for r in (NEWTON, MULTIPLIERS))
    assert one.q[-1] == pytest.approx(two.q[-1], rel=1e-9)
    assert one.qdot[-1] == pytest.approx(two.qdot[-1], rel=1e-8)
    assert max(one.energy_residual, two.energy_residual) < 1e-9
    assert all(part[-1] <= 0.0 for part in one.friction_work.values())


def test_friction_on_a_guide_too_many_is_refused():
    """Both guides share their load as they like: what rubs is not determined."""
    twice = heavy(double_guided())
    joints = (*twice.joints[:-1], twice.joints[-1]._replace(friction=0.1))
    with pytest.raises(SceneError, match=r"mechanism\.second guide\.friction: found friction that follows a force"):
        simulate(replace(twice, joints=joints), NEWTON, 0.4, 9.0, 0.03)
