"""Forces in a linkage: statics, wrenches, reactions, friction."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from flywheel import SceneError
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.reactions import Reactions, constraints, reactions, reactions_at, virtual_power
from flywheel.mechanisms.linkages.statics import (
    Effort,
    Force,
    Torque,
    applied,
    centres,
    friction_sizes,
    inertial,
    joint_rate,
    weights,
)
from flywheel.scene.linkage import Joint, Link, Linkage, Point
from tests.limits import sample
from tests.linkages import forced
from tests.linkages.forced import EVERY, RANGES, solution

# Reactions by two routes, driving actions against energy, what friction costs, and quasi-static analysis.


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
    result = loaded(name)
    reference = [size for joint in result.forces if not np.isnan(size := result.resultant(joint)).any()]
    largest = max((size.max() for size in reference), default=np.abs(result.action).max())
    for joint, parts in virtual_power(result).items():
        for part, value in parts.items():
            mine = result.actions[joint] if part == "drive" else result.components[joint][part]
            np.testing.assert_allclose(mine, value, rtol=0, atol=1e-10 * largest)
    assert result.residual.max() < 1e-12
    assert result.friction.converged.all()
    poses = result.poses
    for (joint, part), row in constraints(poses, [poses.linkage.driver]).items():
        parting = np.einsum("bin,bin->n", row, poses.rate)
        atol = 1e-11 * np.abs(poses.rate).max()
        np.testing.assert_allclose(parting, float(part == "drive"), rtol=0, atol=atol, err_msg=f"{joint}.{part}")


def test_releasing_a_redundant_constraint_sets_nothing_free():
    result = loaded("redundant slider-crank")
    other = virtual_power(result)
    assert set(result.undetermined) == {f"{g}.{p}" for g in ("guide", "other_guide") for p in ("normal", "moment")}
    for guide in ("guide", "other_guide"):
        assert all(np.isnan(part).all() for part in other[guide].values())
    assert not np.isnan(result.action).any()
    assert not np.isnan(result.components["slider_pin"]["x"]).any()


@pytest.mark.parametrize("name", sample(TURNING, 3))
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
    result = reactions(solution(name), Q, SPEED, acceleration, gravity=(0.0, -G), loads=[Force(last, "o", -50.0, 20.0)])
    rate = result.poses.point(last, (0.0, 0.0)).rate
    growth = (energy(Q + eps) - energy(Q - eps)) / (2 * eps) * SPEED
    paid = (result.action + result.friction.moment - 50.0 * rate[0] + 20.0 * rate[1]) * SPEED
    np.testing.assert_allclose(paid, growth, rtol=0, atol=2e-7 * np.abs(growth).max() + 1e-6)
    np.testing.assert_allclose(result.power, result.action * SPEED, rtol=1e-12)


RUBBING = [name for name in TURNING if "rubbing" in name or name in ("six-bar", "slider-crank with a shoe")]


@pytest.mark.parametrize("name", RUBBING)
def test_friction_only_takes(name):
    """Its power is never positive, whichever way the machine runs, and it is what the driving action grows by."""
    for speed in (6.0, -6.0):
        result = reactions(solution(name), Q, speed, 40.0, gravity=(0.0, -G))
        smooth = reactions(solution(name), Q, speed, 40.0, gravity=(0.0, -G), friction=False)
        cost = result.friction.moment
        assert (cost * speed <= 0).all()
        assert (cost * speed < 0).any()
        np.testing.assert_allclose(result.action - smooth.action, -cost, rtol=0, atol=1e-11 * np.abs(result.action).max())
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
    for result in (plain, sprung):
        feet = result.forces["pivot"] + result.forces["rocker_pivot"]
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
    result = reactions(weightless(forced.rack()), [0.4, 1.1], 1.0, loads=loads, friction=False)
    np.testing.assert_allclose(result.action, 60.0 * 0.08, rtol=1e-12)
    np.testing.assert_allclose(result.components["mesh"]["tangential"], 60.0, rtol=1e-12)
    np.testing.assert_allclose(result.components["mesh"]["radial"], 60.0 * np.tan(0.35), rtol=1e-12)
    normal = result.components["guide"]["normal"]  # the rack lies below: it is pressed down
    np.testing.assert_allclose(normal, 60.0 * np.tan(0.35), rtol=1e-12)
    push = load + 1j * normal * np.exp(0.3j) * -1.0
    np.testing.assert_allclose(result.forces["mesh"][0] + 1j * result.forces["mesh"][1], push, rtol=1e-12)
    np.testing.assert_allclose(result.forces["pivot"][0] + 1j * result.forces["pivot"][1], push, rtol=1e-12)


@pytest.mark.parametrize("kind", sample(["flat", "roller"], 2))
def test_a_cam_by_hand(kind):
    """80 N on the follower: the drive bears 80 lift'; a flat face takes it at the eccentricity, a roller by its normal."""
    way = solve(weightless(forced.cam(kind)), 0.0, 6.3)
    result = reactions(way, Q, 1.0, loads=[Force("follower", "o", 0.0, -80.0)])
    lift = 0.05 + 0.01 * np.cos(Q) + 0.003 * np.sin(2 * Q)
    slope = -0.01 * np.sin(Q) + 0.006 * np.cos(2 * Q)
    np.testing.assert_allclose(result.action, 80.0 * slope, rtol=1e-11, atol=1e-12)
    guide, normal = result.components["follower_joint"], result.components["contact"]["normal"]
    if kind == "flat":
        np.testing.assert_allclose(normal, 80.0, rtol=1e-12)
        np.testing.assert_allclose(guide["moment"], -80.0 * (slope - 0.01), rtol=1e-11)
        np.testing.assert_allclose(guide["normal"], 0.0, atol=1e-12)
    else:
        slant = (slope - 0.01) / lift  # tangent of the pressure angle, offset 0.01
        np.testing.assert_allclose(normal, 80.0 * np.hypot(1.0, slant), rtol=1e-11)
        np.testing.assert_allclose(np.abs(guide["normal"]), 80.0 * np.abs(slant), rtol=1e-11)
        np.testing.assert_allclose(guide["moment"], 0.0, atol=1e-12)
    assert not result.pulling()
    lifted = reactions(way, Q, 1.0, loads=[Force("follower", "o", 0.0, 80.0 * np.sign(Q - 3.0))])
    np.testing.assert_array_equal(lifted.pulling()["contact"], Q[Q > 3.0])
    assert "it lifts off" in lifted.table()


def test_a_slot_by_hand():
    """A torque of 30 N m on the lever: its slot takes 30/s from the crank's pin, across itself."""
    way = solve(weightless(forced.whitworth()), 0.0, 6.3)
    result = reactions(way, Q, 1.0, loads=[Torque("lever", 30.0)])
    s = way.coordinate("slot", result.poses).value
    np.testing.assert_allclose(result.components["slot"]["normal"], 30.0 / s, rtol=1e-10)
    np.testing.assert_allclose(result.action, -30.0 * result.poses.angle("lever").rate, rtol=1e-10)


def test_motion_that_does_not_fit_is_refused():
    with pytest.raises(SceneError, match=r"speed: found an array of shape \(2,\), expected a number or shape \(17,\)"):
        reactions(forced.four_bar(), Q, [1.0, 2.0])
    with pytest.raises(SceneError, match="acceleration: found inf, expected finite numbers"):
        reactions(forced.four_bar(), Q, 1.0, np.inf)


def test_names_must_differ():
    linkage = forced.geared_five_bar()
    twin = (linkage.couplings[0]._replace(name="top"),)
    with pytest.raises(SceneError, match=r'couplings\[0\].name: found "top", expected a unique name'):
        reactions(forced.Linkage(linkage.ground, linkage.links, linkage.joints, "pivot", twin), Q, 1.0)


# Friction against figures found by hand, and where it locks a mechanism.


ORIGIN = Point("o")


def alone(joint: Joint, link: Link, count: int = 1) -> Poses:
    """Poses of one body on the frame, at q = 0: a block on a guide along x, or a wheel on its pivot."""
    linkage = Linkage(Link("frame", (ORIGIN,)), (link,), (joint,), joint.name)
    rate = np.zeros((2, 3, count))
    rate[1, 2 if joint.kind == "pin" else 0] = 1.0
    return Poses(linkage, np.zeros(count), np.zeros((2, 3, count)), rate, np.zeros((2, 3, count)))


def block(mu=0.2, length=0.0):
    joint = Joint("guide", "slide", "frame", "block", ORIGIN, ORIGIN, friction=mu, length=length)
    return alone(joint, Link("block", (ORIGIN,), mass=10.0))


@pytest.mark.parametrize("speed", [2.0, -3.0])
@pytest.mark.parametrize("lift", [0.0, 150.0])
def test_sliding_block(speed, lift):
    """F = mu |m g - lift| against the motion, whichever side of the guide bears."""
    result = reactions_at(block(), speed, gravity=(0.0, -10.0), loads=[Force("block", "o", 0.0, lift)])
    force = 0.2 * abs(100.0 - lift) * np.sign(speed)
    assert result.action[0] == pytest.approx(force, rel=1e-12)
    assert result.components["guide"]["friction"][0] == pytest.approx(-force, rel=1e-12)
    assert result.friction.moment[0] == pytest.approx(-force, rel=1e-12)
    np.testing.assert_allclose(result.forces["guide"][:, 0], [-force, 100.0 - lift], atol=1e-12)


def test_there_is_no_friction_at_rest():
    result = reactions_at(block(), 0.0, gravity=(0.0, -10.0))
    assert result.action[0] == 0.0
    assert result.friction.iterations <= 1


def test_a_tilting_block_rubs_at_both_ends_of_its_shoe():
    """A couple of 30 N m on a shoe of 0.1 m: normals of 300 N up in front and down behind, each of which rubs."""
    result = reactions_at(block(length=0.1), 1.0, loads=[Torque("block", -30.0)])
    parts = {name: part[0] for name, part in result.components["guide"].items()}
    assert parts == pytest.approx(
        {"normal": 0.0, "moment": 30.0, "friction": -120.0, "front": 300.0, "rear": -300.0}, abs=1e-9
    )
    assert result.action[0] == pytest.approx(120.0, rel=1e-12)


def test_a_wheel_on_its_pivot_drags_by_the_friction_circle():
    """M = r mu/sqrt(1 + mu²) R, with R = 50 N."""
    joint = Joint("pivot", "pin", "frame", "wheel", ORIGIN, ORIGIN, friction=0.75, radius=0.02)
    poses = alone(joint, Link("wheel", (ORIGIN,)))
    result = reactions_at(poses, 8.0, loads=[Force("wheel", "o", 30.0, -40.0)])
    assert result.action[0] == pytest.approx(0.6 * 0.02 * 50.0, rel=1e-12)
    assert result.components["pivot"]["friction"][0] == pytest.approx(-0.6, rel=1e-12)


def friction_weightless(linkage: Linkage) -> Linkage:
    links = tuple(link._replace(mass=0.0, inertia=0.0) for link in linkage.links)
    return Linkage(linkage.ground, links, linkage.joints, linkage.driver, start=linkage.start)


def test_a_rod_between_two_friction_circles():
    """A two-force rod's line touches both circles: it leans against the pins' line by asin of the circles' sum over l."""
    mu, radius, load = 0.3, 0.02, -800.0
    rho = radius * mu / np.hypot(1.0, mu)
    q = np.linspace(0.2, 6.1, 23)
    result = reactions(friction_weightless(forced.slider_crank(mu, radius)), q, 5.0, loads=[Force("slider", "o", load)])
    beta = np.arcsin(-0.1 * np.sin(q) / 0.35)
    beta1 = -0.1 * np.cos(q) / (0.35 * np.cos(beta))
    sway, slip = np.sign(beta1 - 1.0), np.sign(beta1)  # of the rod against the crank and against the slider: -slip
    rod = np.exp(1j * beta)
    offset = rho * (sway + slip) / 0.35
    force = -np.exp(1j * beta) * np.sqrt(1 - offset**2) + 1j * rod * offset  # of slider on rod, for a push of 1
    speed = -np.sign(0.1 * np.sin(q) + 0.1 * np.cos(q) * np.tan(-beta))
    # slider: -force P + load + friction + i N = 0, friction = -mu |N| speed
    push = load / force.real
    for _ in range(200):
        push = (load - mu * np.abs(push * force.imag) * speed) / force.real
    tip = 0.1 * np.exp(1j * q)
    torque = -(tip.conjugate() * force * push).imag + rho * push * (1 - sway)
    assert (push > 0).all()
    np.testing.assert_allclose(result.resultant("slider_pin"), push, rtol=1e-11)
    np.testing.assert_allclose(result.action, torque, rtol=0, atol=1e-10 * np.abs(torque).max())
    assert result.friction.converged.all()
    assert 1 < result.friction.iterations < 8


def test_a_driving_slider_locks_where_the_rod_passes_inside_the_friction_circle():
    """The crank turns against a torque only where the force's lever about its pivot exceeds the circle there."""
    mu, radius = 0.25, 0.03
    rho = radius * mu / np.hypot(1.0, mu)
    linkage = friction_weightless(forced.slider_crank(mu, radius, driver="guide", start=0.4))
    rubless = tuple(joint._replace(friction=0.0) if joint.name == "guide" else joint for joint in linkage.joints)
    crank, rod, slider = linkage.links
    links = crank._replace(guess=1.0), rod._replace(guess=-0.25), slider
    linkage = Linkage(linkage.ground, links, rubless, "guide", start=0.39)
    q = np.linspace(0.4489, 0.30, 30)  # pushed inwards from close to full stretch
    result = reactions(linkage, q, -0.5, loads=[Torque("crank", -20.0)], inertia=False)
    poses = result.poses
    turn, sway = poses.angle("crank"), poses.angle("rod")
    assert (turn.rate < 0).all()  # the crank turns counter-clockwise as the slider goes in
    against_crank, against_slider = np.sign(-(sway.rate - turn.rate)), np.sign(-sway.rate)
    offset = rho * (against_crank + against_slider) / 0.35
    unit = np.exp(1j * sway.value)
    force = -unit * np.sqrt(1 - offset**2) + 1j * unit * offset
    lever = (0.1 * np.exp(-1j * turn.value) * force).imag + rho * against_crank - rho
    moves = lever > 0
    assert 0 < moves.sum() < len(q)
    np.testing.assert_array_equal(result.friction.converged, moves)
    assert np.isnan(result.action[~moves]).all()
    assert np.isnan(result.friction.moment[~moves]).all()
    np.testing.assert_allclose(result.resultant("crank_pin")[moves], 20.0 / lever[moves], rtol=1e-9)
    np.testing.assert_array_equal(result.locked, q[~moves])
    assert "friction locks at" in result.table()


def test_violent_friction_is_solved_or_reported():
    """Factors far past a contraction: what counts as converged fulfils the equations, also where stages were needed."""
    rng = np.random.default_rng(1)
    free, response = rng.normal(size=(500, 4)), rng.normal(size=(500, 4, 2))
    forms = np.zeros((2, 2, 4))
    forms[0, 0, 0] = forms[1, 0, 2] = forms[1, 1, 3] = 1.0
    factor = rng.uniform(-0.5, 0.5, size=(500, 2))
    followed = np.einsum("pkm,nmj->npkj", forms, response) * factor[:, None, None, :]
    result = friction_sizes(np.einsum("pkm,nm->npk", forms, free), followed)
    x = free + np.einsum("nmp,np->nm", response, factor * result.sizes)
    gap = np.abs(np.stack((np.abs(x[:, 0]), np.hypot(x[:, 2], x[:, 3])), axis=1) - result.sizes).max(axis=1)
    assert result.iterations > 30
    assert 0.97 < result.converged.mean() < 1.0
    assert (gap[result.converged] < 1e-9 * result.sizes[result.converged].max(axis=1)).all()


@pytest.mark.parametrize(("load", "wanted"), [(1.0, None), (-1.0, 1 / 3)])
def test_what_pushes_itself_fast_is_reported(load, wanted):
    """X - 2 |x| = 1 has no solution; x - 2 |x| = -1 has two, of which -1/3 grows out of the one without friction."""
    result = friction_sizes(np.array([[[load, 0.0]]]), np.array([[[[2.0], [0.0]]]]))
    assert result.converged[0] == (wanted is not None)
    if wanted is not None:
        assert result.sizes[0, 0] == pytest.approx(wanted)


def test_what_friction_needs_is_asked_for():
    with pytest.raises(SceneError, match=r"joints.pivot.radius.*the radius of a pin that has friction"):
        reactions(forced.slider_crank(0.1), [1.0], 10.0)
    weld = Joint("weld", "fixed", "frame", "block", ORIGIN, ORIGIN, friction=0.1)
    with pytest.raises(SceneError, match="does not slide"):
        reactions_at(alone(weld, Link("block", (ORIGIN,))), 1.0)


# Results as tables, extremes and resultants.


REACTIONS_Q = np.linspace(0.1, 6.2, 40)


@pytest.fixture(scope="module")
def found():
    loads = [Force("slider", "o", -400.0)]
    return reactions(forced.slider_crank(0.1, 0.02, 0.08), REACTIONS_Q, 15.0, gravity=(0.0, -9.81), loads=loads)


def test_a_resultant_is_the_whole_force_friction_included(found):
    parts = found.components["guide"]
    np.testing.assert_allclose(found.resultant("guide"), np.hypot(parts["normal"], parts["friction"]), rtol=1e-12)
    pin = found.components["crank_pin"]
    np.testing.assert_allclose(found.forces["crank_pin"], np.stack((pin["x"], pin["y"])), rtol=1e-12)


def test_the_shoes_two_normals_are_the_force_and_the_moment(found):
    parts = found.components["guide"]
    np.testing.assert_allclose(parts["front"] + parts["rear"], parts["normal"], rtol=1e-12)
    np.testing.assert_allclose((parts["front"] - parts["rear"]) * 0.04, parts["moment"], rtol=1e-11)
    rubbing = 0.1 * (np.abs(parts["front"]) + np.abs(parts["rear"]))
    np.testing.assert_allclose(np.abs(parts["friction"]), rubbing, rtol=1e-11)


def test_extremes_are_the_largest_of_each_joint(found):
    extremes = {extreme.joint: extreme for extreme in found.extremes()}
    assert list(extremes) == ["pivot", "crank_pin", "slider_pin", "guide", "guide.front", "guide.rear"]
    for end in ("front", "rear"):
        assert extremes[f"guide.{end}"].force == np.abs(found.components["guide"][end]).max()
    size = found.resultant("slider_pin")
    assert extremes["slider_pin"].force == size.max()
    assert extremes["slider_pin"].at == REACTIONS_Q[size.argmax()]


def test_csv_reads_back_to_the_last_digit(found):
    rows = list(csv.DictReader(io.StringIO(found.csv())))
    assert len(rows) == len(REACTIONS_Q)
    assert list(rows[0])[:2] == ["pivot (rad)", "pivot.drive (N m)"]
    for name, values in (("pivot.drive (N m)", found.action), ("guide.moment (N m)", found.components["guide"]["moment"])):
        assert [float(row[name]) for row in rows] == values.tolist()


def test_the_table_has_a_block_for_every_joint(found):
    blocks = found.table().split("\n\n")
    assert [block.splitlines()[0] for block in blocks] == [
        "driving action", "pivot", "crank_pin", "slider_pin", "guide", "largest forces of these positions",
    ]  # fmt: skip
    assert "normal (N)" in blocks[4]
    assert len(blocks[4].splitlines()) == len(REACTIONS_Q) + 2


def test_the_largest_forces_may_come_from_more_positions(found):
    few = reactions(forced.slider_crank(guides=2), REACTIONS_Q[:2], 15.0)
    many = reactions(forced.slider_crank(guides=2), REACTIONS_Q, 15.0)
    block = few.table(many).split("\n\n")[-2].splitlines()
    worst = next(extreme for extreme in many.extremes() if extreme.joint == "pivot")
    assert worst.force > few.resultant("pivot").max()
    assert block[:2] == ["largest forces", f"  pivot: {worst.force:.6g} N at {worst.at:.6g} rad"]


def test_rounding_is_cleared_and_nothing_else(found):
    force, moment = found.scales()
    assert force >= max(extreme.force for extreme in found.extremes())
    parts = dict(found.components["guide"])
    parts["normal"] = np.where(np.arange(len(REACTIONS_Q)) == 1, 0.9e-12 * force, parts["normal"])
    parts["moment"] = np.where(np.arange(len(REACTIONS_Q)) == 2, -0.9e-12 * moment, parts["moment"])
    clear = found._replace(components=dict(found.components) | {"guide": parts}).cleared()
    assert clear.components["guide"]["normal"][1] == 0.0
    assert clear.components["guide"]["moment"][2] == 0.0
    np.testing.assert_array_equal(clear.components["guide"]["normal"][2:], found.components["guide"]["normal"][2:])
    np.testing.assert_array_equal(clear.action, found.action)


def test_what_is_left_open_is_said_and_never_given_a_number():
    open_ = reactions(forced.slider_crank(guides=2), REACTIONS_Q, 15.0)
    text = open_.table()
    assert "left open by redundant constraints: guide.normal, guide.moment, other_guide.normal" in text
    guide = next(block for block in text.split("\n\n") if block.startswith("guide\n"))
    assert all(line.split()[1:] == ["none"] * 3 for line in guide.splitlines()[2:])
    assert ",,," in open_.csv()
    assert [extreme.joint for extreme in open_.extremes()] == ["pivot", "crank_pin", "slider_pin"]


# Newton's and Euler's equations written out by hand for a slider-crank, redundant constraints, and what is refused.


OMEGA, ALPHA, STATICS_G = 20.0, -35.0, 9.81


def spin(angle, at):
    """A point (a, b) of a body turned by an angle: a e^(i angle), as complex numbers."""
    return complex(*at) * np.exp(1j * angle)


def moved(origin, angle, at):
    """Place, velocity, acceleration of a point; origin and angle are such triples themselves."""
    arm = spin(angle[0], at)
    return (
        origin[0] + arm,
        origin[1] + 1j * angle[1] * arm,
        origin[2] + (1j * angle[2] - angle[1] ** 2) * arm,
    )


def moment(arm, force_x, force_y):
    """Coefficients of a force's two parts in an equation of moments."""
    return -arm.imag * force_x + arm.real * force_y


@pytest.mark.parametrize("theta", [0.3, 2.9, 4.4])
def test_slider_crank(theta):
    """Crank r = 0.1, rod 0.35 m: nine equations, eight reactions and the torque; nothing of the toolkit but its data."""
    linkage = forced.slider_crank()
    crank, rod, slider = linkage.links
    r, length = 0.1, 0.35
    sine = -r * np.sin(theta) / length
    beta = np.arcsin(sine)
    beta1 = -r * np.cos(theta) * OMEGA / (length * np.cos(beta))
    beta2 = (r * (OMEGA**2 * np.sin(theta) - ALPHA * np.cos(theta)) / length + beta1**2 * np.sin(beta)) / np.cos(beta)
    turn, sway, still = (theta, OMEGA, ALPHA), (beta, beta1, beta2), (0.0, 0.0, 0.0)
    tip = moved(still, turn, (r, 0.0))
    end = moved(tip, sway, (length, 0.0))
    end = tuple(complex(part.real, 0.0) for part in end)
    g2, g3, g4 = moved(still, turn, crank.com), moved(tip, sway, rod.com), moved(end, still, slider.com)
    push = -500.0

    # unknowns: A (frame on crank), B (crank on rod), C (rod on slider), N, M (frame on slider), T (frame on crank)
    a, b = np.zeros((9, 9)), np.zeros(9)
    ax, ay, bx, by, cx, cy, n, m, t = range(9)
    a[0, [ax, bx]] = 1, -1
    a[1, [ay, by]] = 1, -1
    a[2, [ax, ay]] = -(0 - g2[0]).imag, (0 - g2[0]).real
    a[2, [bx, by]] = (tip[0] - g2[0]).imag, -(tip[0] - g2[0]).real
    a[2, t] = 1
    a[3, [bx, cx]] = 1, -1
    a[4, [by, cy]] = 1, -1
    a[5, [bx, by]] = -(tip[0] - g3[0]).imag, (tip[0] - g3[0]).real
    a[5, [cx, cy]] = (end[0] - g3[0]).imag, -(end[0] - g3[0]).real
    a[6, cx] = 1
    a[7, [cy, n]] = 1, 1
    a[8, [cx, cy]] = -(end[0] - g4[0]).imag, (end[0] - g4[0]).real
    a[8, [n, m]] = (end[0] - g4[0]).real, 1
    b[0], b[1], b[2] = crank.mass * g2[2].real, crank.mass * (g2[2].imag + STATICS_G), crank.inertia * ALPHA
    b[3], b[4], b[5] = rod.mass * g3[2].real, rod.mass * (g3[2].imag + STATICS_G), rod.inertia * beta2
    b[6], b[7] = slider.mass * g4[2].real - push, slider.mass * (g4[2].imag + STATICS_G)
    b[8] = -moment(end[0] - g4[0], push, 0.0)
    by_hand = np.linalg.solve(a, b)

    result = reactions(linkage, [theta], OMEGA, ALPHA, gravity=(0.0, -STATICS_G), loads=[Force("slider", "o", push)])
    parts = result.components
    mine = [parts[j][c][0] for j in ("pivot", "crank_pin", "slider_pin") for c in "xy"]
    mine += [parts["guide"]["normal"][0], parts["guide"]["moment"][0], result.action[0]]
    np.testing.assert_allclose(mine, by_hand, rtol=0, atol=1e-11 * np.abs(by_hand).max())


def test_a_third_crank_leaves_open_what_the_coupler_shares_among_them():
    """Across each massless crank nothing acts, along it anything: with masses each crank alone gives the force across it."""
    q = np.linspace(1.0, 2.5, 7)
    result = reactions(forced.parallelogram(), q, -12.0, 30.0, gravity=(0.0, -STATICS_G))
    third = forced.parallelogram().link("third")
    parts = result.components["third_pin"]
    assert np.isnan(parts["x"]).all()
    assert "third_pin.x" in result.undetermined
    direction = np.exp(1j * q)
    centre = complex(*third.com)
    acceleration = (30.0j - 144.0) * centre * direction
    turning = third.inertia * 30.0 + ((centre * direction).conjugate() * third.mass * (acceleration + 1j * STATICS_G)).imag
    across = -turning / 0.1  # third does it to the coupler, a quarter turn from its line
    np.testing.assert_allclose(np.cos(parts["known_angle"] - q), 0.0, atol=1e-10)
    np.testing.assert_allclose(parts["known"] * np.sin(parts["known_angle"] - q), across, rtol=1e-9)
    assert not np.isnan(result.action).any()
    assert np.isnan(result.resultant("third_pin")).all()


def test_friction_on_what_is_left_open_is_refused():
    linkage = forced.slider_crank(0.1, guides=2, radius=0.01)
    with pytest.raises(SceneError, match=r"guide: found friction that follows the normal.*open"):
        reactions(linkage, [1.0], 10.0)
    assert reactions(linkage, [1.0], 10.0, friction=False).undetermined


def test_a_freedom_that_nothing_drives_is_refused():
    linkage = forced.slider_crank()
    poses = solve(linkage, 0.0, 3.0).poses([1.0])
    free = forced.Linkage(linkage.ground, linkage.links, linkage.joints[:3], "pivot")
    with pytest.raises(SceneError, match="as many driven joints"):
        reactions_at(poses._replace(linkage=free), 1.0)


def test_forces_without_limit_name_the_position():
    """A slider drives the crank through its dead centre: both in line."""
    linkage = forced.slider_crank()
    poses = solve(linkage, 0.0, 3.0).poses([0.0, 1.0])
    driven = forced.slider_crank(driver="guide")
    with pytest.raises(SceneError, match="guide stands at 0 m"):
        reactions_at(poses._replace(linkage=driven), 0.0, inertia=False)


# Loads on bodies: what they come to about the centres of mass, and what does not fit.


WRENCHES_Q = np.linspace(0.2, 6.0, 9)


@pytest.fixture(scope="module")
def machine():
    return solve(forced.whitworth(), 0.0, 6.3)


@pytest.fixture(scope="module")
def poses(machine):
    return machine.poses(WRENCHES_Q)


def power(poses, wrenches):
    return np.einsum("bin,bin->n", wrenches, centres(poses).rate)


def test_a_force_has_the_power_of_its_own_point(poses):
    fx, fy = np.cos(WRENCHES_Q), 3.0
    for at, place in (("end", (0.55, 0.0)), ((0.1, -0.2), (0.1, -0.2))):
        rate = poses.point("rod", place).rate
        np.testing.assert_allclose(power(poses, applied(poses, [Force("rod", at, fx, fy)])), fx * rate[0] + fy * rate[1])


def test_a_torque_has_the_power_of_its_bodys_turning(poses):
    np.testing.assert_allclose(
        power(poses, applied(poses, [Torque("lever", WRENCHES_Q)])), WRENCHES_Q * poses.angle("lever").rate
    )


@pytest.mark.parametrize("joint", ["pivot", "lever_pivot", "slot", "lever_pin", "guide"])
def test_an_effort_has_the_power_of_its_joints_coordinate(machine, poses, joint):
    rate = machine.coordinate(joint, poses).rate
    np.testing.assert_allclose(joint_rate(poses, poses.linkage.joint(joint)), rate, atol=1e-13)
    np.testing.assert_allclose(power(poses, applied(poses, [Effort(joint, 2.0)])), 2.0 * rate, atol=1e-13)


def test_weights_lower_the_centres(poses):
    heights = sum(link.mass * poses.centre(link.name).rate[1] for link in poses.linkage.links)
    np.testing.assert_allclose(power(poses, weights(poses, (0.0, -9.81))), -9.81 * heights, rtol=1e-12)


def test_inertia_forces_take_the_growth_of_the_energy(machine, poses):
    """Their power is -dT/dt, T = ½ I*(q) qdot², by differences of I*."""
    speed, acceleration, eps = 7.0, -11.0, 1e-5

    def reduced(q):
        rate = centres(machine.poses(q)).rate
        links = machine.linkage.links
        return sum(
            b.mass * (rate[k, 0] ** 2 + rate[k, 1] ** 2) + b.inertia * rate[k, 2] ** 2 for k, b in enumerate(links, 1)
        )

    growth = (
        reduced(WRENCHES_Q) * acceleration
        + 0.5 * (reduced(WRENCHES_Q + eps) - reduced(WRENCHES_Q - eps)) / (2 * eps) * speed**2
    )
    result = power(poses, inertial(poses, np.full_like(WRENCHES_Q, speed), np.full_like(WRENCHES_Q, acceleration)))
    np.testing.assert_allclose(result, -growth, rtol=0, atol=1e-8 * np.abs(growth).max())


@pytest.mark.parametrize(
    ("load", "path"),
    [
        (Force("rud", "o", 1.0), r"loads\[1\].body: found .rud..*rod"),
        (Force("rod", "ende", 1.0), r"loads\[1\].at: found .ende..*end"),
        (Torque("rod", [1.0, 2.0]), r"loads\[1\].value.*shape \(2,\).*shape \(9,\)"),
        (Torque("rod", np.nan), r"loads\[1\].value: found nan, expected finite"),
        (Torque("rod", "much"), r"loads\[1\].value"),
        (Effort("hinge", 1.0), r"loads\[1\].joint: found .hinge..*slot"),
    ],
)
def test_loads_that_do_not_fit_are_named(poses, load, path):
    with pytest.raises(SceneError, match=path):
        applied(poses, [Torque("crank", 1.0), load])


def test_all_faults_of_loads_come_at_once(poses):
    with pytest.raises(SceneError) as caught:
        applied(poses, [Torque("a", 1.0), Torque("b", 1.0)])
    assert len(caught.value.faults) == 2
