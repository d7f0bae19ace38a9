"""Reactions by two routes, driving actions against energy, what friction costs, and quasi-static analysis."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.reactions import Reactions, constraints, reactions, virtual_power
from flywheel.mechanisms.linkages.wrenches import Effort, Force, Torque, centres
from flywheel.numerics.faults import SceneError
from tests.limits import sample
from tests.linkages import forced
from tests.linkages.forced import EVERY, RANGES, solution

G = 9.81
TURNING = [name for name in EVERY if name not in RANGES]
Q = np.linspace(0.1, 6.2, 17)
SPEED = 9.0 + 2.0 * np.sin(Q)


def loaded(name, **more):
    linkage = EVERY[name]
    q = linkage.start + np.linspace(0.05, RANGES.get(name, 6.2), 19)
    pushed, turned, worked = linkage.links[-1].name, linkage.links[1].name, linkage.joints[-1].name
    loads = (Force(pushed, "o", -200.0, 60 * np.cos(q)), Torque(turned, 5.0), Effort(worked, 3.0))
    if linkage.joint(worked).kind == "fixed":
        loads = loads[:2]
    return reactions(solution(name), q, -12.0, 30.0, gravity=(0.5, -9.81), loads=loads, **more)


@pytest.mark.parametrize("name", sample(EVERY, 2))
def test_virtual_power_agrees_with_newton_and_euler(name):
    """By velocities at joints and contacts, which do not part in the motion that the driver makes."""
    found = loaded(name)
    known = [size for joint in found.forces if not np.isnan(size := found.resultant(joint)).any()]
    largest = max((size.max() for size in known), default=np.abs(found.action).max())
    for joint, parts in virtual_power(found).items():
        for part, value in parts.items():
            mine = found.actions[joint] if part == "drive" else found.components[joint][part]
            np.testing.assert_allclose(mine, value, rtol=0, atol=1e-10 * largest)
    assert found.residual.max() < 1e-12
    assert found.friction.converged.all()
    poses = found.poses
    for (joint, part), row in constraints(poses, [poses.linkage.driver]).items():
        parting = np.einsum("bin,bin->n", row, poses.rate)
        atol = 1e-11 * np.abs(poses.rate).max()
        np.testing.assert_allclose(parting, float(part == "drive"), rtol=0, atol=atol, err_msg=f"{joint}.{part}")


def test_releasing_a_redundant_constraint_sets_nothing_free():
    found = loaded("redundant slider-crank")
    other = virtual_power(found)
    assert set(found.undetermined) == {f"{g}.{p}" for g in ("guide", "other_guide") for p in ("normal", "moment")}
    for guide in ("guide", "other_guide"):
        assert all(np.isnan(part).all() for part in other[guide].values())
    assert not np.isnan(found.action).any()
    assert not np.isnan(found.components["slider_pin"]["x"]).any()


@pytest.mark.parametrize("name", TURNING)
def test_the_drive_pays_for_energy_and_friction(name):
    """Q qdot + M_friction qdot + power of the load = d(T + V)/dt, T + V by differences along the motion qdot(q)."""
    linkage, eps = EVERY[name], 2e-5
    last = linkage.links[-1].name

    def energy(q):
        middle = centres(solution(name).poses(q))
        total = np.zeros(q.shape)
        for k, link in enumerate(linkage.links, 1):
            vx, vy, omega = middle.rate[k] * (9.0 + 2.0 * np.sin(q))
            total += 0.5 * link.mass * (vx**2 + vy**2) + 0.5 * link.inertia * omega**2 + link.mass * G * middle.value[k, 1]
        return total

    acceleration = SPEED * 2.0 * np.cos(Q)
    found = reactions(solution(name), Q, SPEED, acceleration, gravity=(0.0, -G), loads=[Force(last, "o", -50.0, 20.0)])
    rate = found.poses.point(last, (0.0, 0.0)).rate
    growth = (energy(Q + eps) - energy(Q - eps)) / (2 * eps) * SPEED
    paid = (found.action + found.friction.moment - 50.0 * rate[0] + 20.0 * rate[1]) * SPEED
    np.testing.assert_allclose(paid, growth, rtol=0, atol=2e-7 * np.abs(growth).max() + 1e-6)
    np.testing.assert_allclose(found.power, found.action * SPEED, rtol=1e-12)


RUBBING = [name for name in TURNING if "rubbing" in name or name in ("six-bar", "slider-crank with a shoe")]


@pytest.mark.parametrize("name", RUBBING)
def test_friction_only_takes(name):
    """Its power is never positive, whichever way the machine runs, and it is what the driving action grows by."""
    for speed in (6.0, -6.0):
        found = reactions(solution(name), Q, speed, 40.0, gravity=(0.0, -G))
        smooth = reactions(solution(name), Q, speed, 40.0, gravity=(0.0, -G), friction=False)
        cost = found.friction.moment
        assert (cost * speed <= 0).all()
        assert (cost * speed < 0).any()
        np.testing.assert_allclose(found.action - smooth.action, -cost, rtol=0, atol=1e-11 * np.abs(found.action).max())
        assert smooth.friction.iterations == 0
        assert not smooth.friction.moment.any()


def test_without_inertia_the_analysis_is_quasi_static():
    """At a standstill both are the same; the inertia's part grows with the square of the speed."""
    linkage, still = forced.four_bar(), {"gravity": (0.0, -G)}
    static = reactions(linkage, Q, 30.0, 5.0, inertia=False, **still)
    rest = reactions(linkage, Q, 0.0, **still)
    np.testing.assert_allclose(static.action, rest.action, rtol=1e-13)
    slow, fast = (reactions(linkage, Q, speed, **still).action - rest.action for speed in (10.0, 20.0))
    np.testing.assert_allclose(fast, 4 * slow, rtol=1e-9, atol=1e-9)


def test_a_sliding_driver_needs_a_force():
    """The same machine driven at its slider: F* s' = M*, with s' the slider's rate in the crank's angle."""
    linkage = forced.slider_crank(driver="guide", start=0.4)
    links = [link._replace(guess={"crank": 1.0, "rod": -0.3}.get(link.name)) for link in linkage.links]
    sliding = forced.Linkage(linkage.ground, tuple(links), linkage.joints, "guide", start=0.4)
    turned = reactions(forced.slider_crank(), np.linspace(0.6, 1.4, 7), 0.0, gravity=(0.0, -G))
    s = turned.poses.point("slider", (0.0, 0.0))
    pushed = reactions(sliding, s.value[0], 0.0, gravity=(0.0, -G))
    np.testing.assert_allclose(pushed.action * s.rate[0], turned.action, rtol=1e-9)
    assert pushed.table().splitlines()[1].split() == ["guide", "(m)", "guide", "(N)"]


def test_a_spring_between_two_bodies_takes_no_part_in_the_sum_of_forces():
    """An effort in a joint is a pair: the foundation feels the same with it and without, but for the driving torque."""
    plain = reactions(forced.four_bar(), Q, 10.0)
    sprung = reactions(forced.four_bar(), Q, 10.0, loads=[Effort("coupler_pin", -8.0 * np.cos(Q))])
    for found in (plain, sprung):
        feet = found.forces["pivot"] + found.forces["rocker_pivot"]
        np.testing.assert_allclose(feet, plain.forces["pivot"] + plain.forces["rocker_pivot"], atol=1e-10)
    assert np.abs(sprung.action - plain.action).max() > 0.1


def test_one_position_and_a_solution_will_do():
    bars = solve(forced.four_bar(), 0.0, 6.3)
    one, many = reactions(bars, 1.3, 10.0), reactions(bars, [0.4, 1.3], [5.0, 10.0])
    assert isinstance(one, Reactions)
    assert one.action[0] == pytest.approx(many.action[1], rel=1e-13)


def weightless(linkage):
    links = tuple(link._replace(mass=0.0, inertia=0.0) for link in linkage.links)
    return forced.Linkage(linkage.ground, links, linkage.joints, linkage.driver, linkage.couplings)


def test_a_rack_by_hand():
    """60 N along the guide against a pinion of 0.08 m, teeth at 0.35 rad: the guide bears what parts them."""
    load = 60.0 * np.exp(0.3j)
    loads = [Force("plate", "o", -load.real, -load.imag)]
    found = reactions(weightless(forced.rack()), [0.4, 1.1], 1.0, loads=loads, friction=False)
    np.testing.assert_allclose(found.action, 60.0 * 0.08, rtol=1e-12)
    np.testing.assert_allclose(found.components["mesh"]["tangential"], 60.0, rtol=1e-12)
    np.testing.assert_allclose(found.components["mesh"]["radial"], 60.0 * np.tan(0.35), rtol=1e-12)
    normal = found.components["guide"]["normal"]  # the rack lies below: it is pressed down
    np.testing.assert_allclose(normal, 60.0 * np.tan(0.35), rtol=1e-12)
    push = load + 1j * normal * np.exp(0.3j) * -1.0
    np.testing.assert_allclose(found.forces["mesh"][0] + 1j * found.forces["mesh"][1], push, rtol=1e-12)
    np.testing.assert_allclose(found.forces["pivot"][0] + 1j * found.forces["pivot"][1], push, rtol=1e-12)


@pytest.mark.parametrize("kind", sample(["flat", "roller"], 2))
def test_a_cam_by_hand(kind):
    """80 N on the follower: the drive bears 80 lift'; a flat face takes it at the eccentricity, a roller by its normal."""
    way = solve(weightless(forced.cam(kind)), 0.0, 6.3)
    found = reactions(way, Q, 1.0, loads=[Force("follower", "o", 0.0, -80.0)])
    lift = 0.05 + 0.01 * np.cos(Q) + 0.003 * np.sin(2 * Q)
    slope = -0.01 * np.sin(Q) + 0.006 * np.cos(2 * Q)
    np.testing.assert_allclose(found.action, 80.0 * slope, rtol=1e-11, atol=1e-12)
    guide, normal = found.components["follower_joint"], found.components["contact"]["normal"]
    if kind == "flat":
        np.testing.assert_allclose(normal, 80.0, rtol=1e-12)
        np.testing.assert_allclose(guide["moment"], -80.0 * (slope - 0.01), rtol=1e-11)
        np.testing.assert_allclose(guide["normal"], 0.0, atol=1e-12)
    else:
        slant = (slope - 0.01) / lift  # tangent of the pressure angle, offset 0.01
        np.testing.assert_allclose(normal, 80.0 * np.hypot(1.0, slant), rtol=1e-11)
        np.testing.assert_allclose(np.abs(guide["normal"]), 80.0 * np.abs(slant), rtol=1e-11)
        np.testing.assert_allclose(guide["moment"], 0.0, atol=1e-12)
    assert not found.pulling()
    lifted = reactions(way, Q, 1.0, loads=[Force("follower", "o", 0.0, 80.0 * np.sign(Q - 3.0))])
    np.testing.assert_array_equal(lifted.pulling()["contact"], Q[Q > 3.0])
    assert "it lifts off" in lifted.table()


def test_a_slot_by_hand():
    """A torque of 30 N m on the lever: its slot takes 30/s from the crank's pin, across itself."""
    way = solve(weightless(forced.whitworth()), 0.0, 6.3)
    found = reactions(way, Q, 1.0, loads=[Torque("lever", 30.0)])
    s = way.coordinate("slot", found.poses).value
    np.testing.assert_allclose(found.components["slot"]["normal"], 30.0 / s, rtol=1e-10)
    np.testing.assert_allclose(found.action, -30.0 * found.poses.angle("lever").rate, rtol=1e-10)


def test_motion_that_does_not_fit_is_refused():
    with pytest.raises(SceneError, match=r"speed: found an array of shape \(2,\), expected a number or shape \(17,\)"):
        reactions(forced.four_bar(), Q, [1.0, 2.0])
    with pytest.raises(SceneError, match="acceleration: found inf, expected finite numbers"):
        reactions(forced.four_bar(), Q, 1.0, np.inf)


def test_names_must_differ():
    linkage = forced.geared_five_bar()
    twin = (linkage.couplings[0]._replace(name="top"),)
    with pytest.raises(SceneError, match=r'couplings\[0\].name: found "top", expected a name of its own'):
        reactions(forced.Linkage(linkage.ground, linkage.links, linkage.joints, "pivot", twin), Q, 1.0)
