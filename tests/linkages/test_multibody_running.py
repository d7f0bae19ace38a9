"""Whole motions by every route."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from flywheel.mechanisms.linkages.multibody import ENERGY, MULTIPLIERS, NEWTON, REDUCED, ROUTES, Wrench, simulate
from flywheel.mechanisms.linkages.positions import solve, solve_over
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import Link, Linkage
from tests.linkages.linkages import four_bar
from tests.linkages.machines import (
    EXACT,
    GRAVITY,
    MACHINES,
    STARTS,
    double_guided,
    engine,
    heavy,
    motor,
    pendulum,
    published,
    published_rates,
)

TIMES = np.array(list(EXACT))


@pytest.fixture(scope="module")
def motions():
    """The published slider-crank, from rest at a right angle, by every route."""
    return {
        route: simulate(published(), route, np.pi / 2, 0.0, 5.0, gravity=GRAVITY, drive=motor, rtol=1e-10)
        for route in ROUTES
    }


def test_two_references_agree():
    """Taylor series at 30 digits and Runge-Kutta of the eighth order on the equation written by hand."""
    found = solve_ivp(published_rates, (0, 5), [np.pi / 2, 0.0], "DOP853", TIMES, rtol=3e-14, atol=1e-14)
    assert_allclose(found.y.T, list(EXACT.values()), rtol=0, atol=3e-12)


@pytest.mark.parametrize("route", ROUTES)
def test_published_slider_crank(motions, route):
    assert_allclose(np.transpose(motions[route].at(TIMES)), list(EXACT.values()), rtol=0, atol=1e-8)
    assert motions[route].t[-1] == 5.0
    assert (motions[route].q[-1], motions[route].qdot[-1]) == pytest.approx(EXACT[5.0], abs=1e-8)


def test_its_figures_to_five_decimals(motions):
    printed = [(2.30098, 2.83038), (4.29275, 4.76466), (8.00001, 3.32778), (20.27036, 3.21967)]
    assert_allclose(np.transpose(motions[MULTIPLIERS].at(TIMES)), printed, rtol=0, atol=5.1e-6)


@pytest.mark.parametrize("route", ROUTES)
def test_its_loop_stays_closed(motions, route):
    """a2 sin theta2 + a3 sin theta3 = 0 and its derivative, from the angles and speeds of both bars."""
    theta, omega = (values[:, :2, 2].T for values in (motions[route].coordinates, motions[route].velocities))
    assert np.abs(0.2 * np.sin(theta[0]) + 0.6 * np.sin(theta[1])).max() < 2e-15
    assert np.abs(0.2 * np.cos(theta[0]) * omega[0] + 0.6 * np.cos(theta[1]) * omega[1]).max() < 1e-14
    assert motions[route].closure < 1e-15
    assert theta[1, 0] == pytest.approx(5.9433484, abs=1e-7)


def test_drift_is_told_only_where_coordinates_drift(motions):
    assert 1e-14 < motions[MULTIPLIERS].drift < 1e-10
    assert [motions[route].drift for route in (REDUCED, NEWTON, ENERGY)] == [0.0, 0.0, 0.0]


def test_drift_follows_the_tolerance(motions):
    coarse = simulate(published(), MULTIPLIERS, np.pi / 2, 0.0, 1.0, gravity=GRAVITY, drive=motor, rtol=1e-6)
    assert 100 * motions[MULTIPLIERS].drift < coarse.drift < 1e-5
    assert coarse.closure < 1e-15


def test_energy_residuals(motions):
    assert motions[ENERGY].energy_residual is None
    for route in (REDUCED, NEWTON, MULTIPLIERS):
        assert 0.0 < motions[route].energy_residual < 1e-8


def test_reactions_by_newton_and_by_multipliers_agree(motions):
    """Compared at the end, where both have a step; the slider's own balance from its acceleration by differences."""
    newton, multipliers = motions[NEWTON].reactions, motions[MULTIPLIERS].reactions
    assert motions[REDUCED].reactions is None
    assert motions[ENERGY].reactions is None
    assert {name: part.shape[1] for name, part in newton.items()} == {
        "pivot": 2,
        "crank pin": 2,
        "slider pin": 2,
        "guide": 2,
    }
    for name, found in newton.items():
        assert_allclose(found[-1], multipliers[name][-1], rtol=0, atol=1e-6)
    h = 1e-4
    phi, omega = motions[NEWTON].at([5.0 - 2 * h, 5.0 - h, 5.0])
    speed = slider_speed(phi, omega)
    acceleration = (3 * speed[2] - 4 * speed[1] + speed[0]) / (2 * h)
    assert newton["slider pin"][-1, 0] == pytest.approx(6.0 * acceleration, rel=1e-5)
    assert newton["slider pin"][-1, 1] + newton["guide"][-1, 0] == pytest.approx(6.0 * 9.81, rel=1e-9)
    assert newton["guide"][-1, 1] == pytest.approx(0.0, abs=1e-9)


def slider_speed(phi, omega):
    return -omega * (0.2 * np.sin(phi) + 0.04 * np.sin(phi) * np.cos(phi) / np.sqrt(0.36 - 0.04 * np.sin(phi) ** 2))


@pytest.mark.parametrize("name", MACHINES)
def test_all_routes_agree_on_linkages_of_every_kind(name):
    linkage, start = MACHINES[name], STARTS[name]
    pull = Wrench(linkage.links[-1].name, (lambda t, q, qdot: 3.0 * np.cos(5 * t), 2.0), 0.1)
    speed, until = (0.6, 0.03) if linkage.sliding else (8.0, 0.06)
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
    run = simulate(pendulum(), route, -np.pi / 2 + np.pi / 3, 0.0, quarter, gravity=GRAVITY)
    assert run.q[-1] == pytest.approx(-np.pi / 2, abs=1e-9)
    assert run.qdot[-1] == pytest.approx(-np.sqrt(2 * 9.81 / 0.5 * 0.5), rel=1e-9)


def test_the_energy_route_stops_where_the_speed_would_change_sign():
    """A pendulum thrown from its lowest place at 3 rad/s: it rises until 1 - cos = l omega²/(2 g)."""
    top = -90 + np.degrees(np.arccos(1 - 0.5 * 3.0**2 / (2 * 9.81)))
    with pytest.raises(SceneError, match=r"route: found a motion that stops at") as caught:
        simulate(pendulum(), ENERGY, -np.pi / 2, 3.0, 2.0, gravity=GRAVITY)
    assert float(caught.value.faults[0].found.split()[-2]) == pytest.approx(top, abs=1e-5)
    swung = [simulate(pendulum(), route, -np.pi / 2, 3.0, 2.0, gravity=GRAVITY) for route in (REDUCED, NEWTON, MULTIPLIERS)]
    for run in swung:
        assert run.q.max() < np.radians(top) + 1e-9
        assert run.q[-1] == pytest.approx(swung[0].q[-1], abs=1e-9)


def test_the_energy_route_needs_something_that_moves_it():
    with pytest.raises(SceneError, match="at rest that nothing moves"):
        simulate(published(), ENERGY, 1.0, 0.0, 1.0)


@pytest.mark.parametrize("route", [REDUCED, NEWTON, ENERGY])
def test_a_lock_of_the_driver_is_named(route):
    with pytest.raises(SceneError, match=r"mechanism\.driver: found a lock at 78\.58"):
        simulate(swinging(), route, 0.9, 4.0, 1.0, rtol=1e-7)


def swinging() -> Linkage:
    """A four-bar driven at a bar that cannot turn: its other two bars come into line at acos(19/96) = 78.58 deg."""
    return replace(heavy(four_bar(d=0.4, r=0.3, c=0.35, length=0.1)), start=0.9)


def test_multipliers_pass_a_dead_centre_of_the_driver():
    """All bodies go on where the driver stops and turns: energy is kept, and the bar comes back."""
    run = simulate(swinging(), MULTIPLIERS, 0.9, 4.0, 1.0, rtol=1e-11)
    assert run.q.max() == pytest.approx(np.arccos((0.4**2 + 0.3**2 - 0.45**2) / (2 * 0.4 * 0.3)), abs=5e-3)
    assert run.q.min() < run.q.max() - 0.3
    assert run.energy_residual < 1e-9
    assert run.closure < 1e-14


@pytest.mark.parametrize("route", ROUTES)
@pytest.mark.parametrize("turns", [5.0, -5.0])
def test_a_parallelogram_is_not_carried_through_its_change_point(route, turns):
    """At 0 and 180 deg all its bars are in line, where it may go on as an antiparallelogram."""
    linkage = replace(heavy(four_bar(d=0.4, r=0.1, c=0.4, length=0.1)), start=0.9)
    with pytest.raises(SceneError, match=r"assemblies that meet|a lock at") as caught:
        simulate(linkage, route, 0.9, turns, 2.0, rtol=1e-7)
    told = float(caught.value.faults[0].found.split()[-2])
    assert told == pytest.approx(180.0 if turns > 0 else 0.0, abs=0.1 if route != MULTIPLIERS else 40.0)


def test_a_sliding_driver_takes_a_force():
    """The slider-crank driven at its slider by 20 N does as the same driven at its crank with the force on the slider."""
    by_slider = heavy(engine())
    at_crank = replace(by_slider, driver="O", start=0.0, links=tuple(link._replace(guess=None) for link in by_slider.links))
    poses = solve_over(by_slider, 0.325).poses(0.325)
    phi, gain = float(poses.angle("crank").value[0]), float(poses.angle("crank").rate[0])
    one = simulate(by_slider, NEWTON, 0.325, -1.0, 0.05, drive=20.0, rtol=1e-11)
    push = Wrench("slider", (20.0, 0.0), at=(0.0, 0.0))
    two = simulate(at_crank, NEWTON, phi, -gain, 0.05, wrenches=(push,), rtol=1e-11, start=poses)
    assert_allclose(one.coordinates[-1], two.coordinates[-1], rtol=0, atol=1e-10)
    assert abs(one.q[-1] - 0.325) > 0.01


@pytest.mark.parametrize("route", [NEWTON, MULTIPLIERS])
def test_a_guide_too_many_leaves_the_motion_and_opens_its_reactions(route):
    """Both guides share normal force and moment as they like; pins, and the motion, are as with one."""
    twice = heavy(double_guided())
    once = replace(twice, joints=twice.joints[:-1])
    runs = [simulate(linkage, route, 0.4, 9.0, 0.1, gravity=GRAVITY) for linkage in (once, twice)]
    assert runs[1].q[-1] == pytest.approx(runs[0].q[-1], abs=1e-9)
    for name in "OAB":
        assert_allclose(runs[1].reactions[name][-1], runs[0].reactions[name][-1], rtol=1e-7)
    assert np.isfinite(runs[0].reactions["guide"]).all()
    assert np.isnan(runs[1].reactions["guide"]).all()
    assert np.isnan(runs[1].reactions["second guide"]).all()


def test_it_starts_from_the_assembly_at_the_drivers_position():
    run = simulate(MACHINES["whitworth"], REDUCED, 4.0, 1.0, 0.01)
    expected = solve(MACHINES["whitworth"], 0.0, 4.0).poses(4.0)
    assert_allclose(run.coordinates[0, :, 2], [expected.angle(link.name).value[0] for link in run_links()], atol=1e-13)


def run_links() -> tuple[Link, ...]:
    return MACHINES["whitworth"].links


def test_arguments_at_fault_are_named_together():
    with pytest.raises(SceneError) as caught:
        simulate(published(), "hamilton", 0.0, np.nan, -1.0, rtol=0.0)
    assert [fault.path for fault in caught.value.faults] == ["route", "qdot", "until", "rtol"]
    assert caught.value.faults[0].expected == "one of reduced, newton, multipliers, energy"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"q": "1"}, 'q: found "1", expected a finite number'),
        ({"until": "1"}, 'until: found "1", expected a finite number above 0'),
        ({"gravity": 9.81}, "gravity: found 9.81, expected two numbers"),
        ({"gravity": (0.0, np.nan)}, "gravity: found a value that is not finite"),
        ({"drive": "5"}, 'drive: found "5", expected a finite number'),
        ({"drive": np.nan}, "drive: found nan, expected a finite number"),
        ({"wrenches": Wrench("crank")}, "wrenches: found a value of type Wrench, expected a list of Wrench"),
        ({"wrenches": [("crank", 1.0)]}, r"wrenches\[0\]: found a value of type tuple, expected a Wrench"),
        ({"wrenches": [Wrench("crank", 5.0)]}, r"wrenches\[0\].force: found 5.0, expected two laws"),
        ({"wrenches": [Wrench("crank", torque=np.inf)]}, r"wrenches\[0\].torque: found inf, expected a finite number"),
        ({"wrenches": [Wrench("crank", at=0.1)]}, r"wrenches\[0\].at: found 0.1, expected two numbers"),
        ({"start": 0.5}, "start: found 0.5, expected Poses"),
        ({"linkage": None}, "linkage: found nothing, expected a Linkage"),
    ],
)
def test_arguments_of_another_type_are_refused(changes, text):
    with pytest.raises(SceneError, match=f"^{text}"):
        simulate(**({"linkage": published(), "route": NEWTON, "q": 0.0, "qdot": 1.0, "until": 1.0} | changes))


def test_loads_that_are_not_finite_are_refused():
    with pytest.raises(SceneError, match="loads that are not finite at the start"):
        simulate(published(), MULTIPLIERS, 0.0, 1.0, 1.0, drive=lambda t, q, qdot: np.nan)
    with pytest.raises(SceneError, match="a motion that cannot be followed"):
        simulate(published(), MULTIPLIERS, 0.0, 1.0, 1.0, drive=lambda t, q, qdot: np.nan if t > 0.1 else 1.0)
