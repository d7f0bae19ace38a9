"""Friction against figures found by hand, and where it locks a mechanism."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.positions import Poses
from flywheel.mechanisms.linkages.reactions import reactions, reactions_at
from flywheel.mechanisms.linkages.statics import friction_sizes
from flywheel.mechanisms.linkages.wrenches import Force, Torque
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import Joint, Link, Linkage, Point
from tests.linkages import forced

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
    found = reactions_at(block(), speed, gravity=(0.0, -10.0), loads=[Force("block", "o", 0.0, lift)])
    force = 0.2 * abs(100.0 - lift) * np.sign(speed)
    assert found.action[0] == pytest.approx(force, rel=1e-12)
    assert found.components["guide"]["friction"][0] == pytest.approx(-force, rel=1e-12)
    assert found.friction.moment[0] == pytest.approx(-force, rel=1e-12)
    np.testing.assert_allclose(found.forces["guide"][:, 0], [-force, 100.0 - lift], atol=1e-12)


def test_there_is_no_friction_at_rest():
    found = reactions_at(block(), 0.0, gravity=(0.0, -10.0))
    assert found.action[0] == 0.0
    assert found.friction.iterations <= 1


def test_a_tilting_block_rubs_at_both_ends_of_its_shoe():
    """A couple of 30 N m on a shoe of 0.1 m: normals of 300 N up in front and down behind, each of which rubs."""
    found = reactions_at(block(length=0.1), 1.0, loads=[Torque("block", -30.0)])
    parts = {name: part[0] for name, part in found.components["guide"].items()}
    assert parts == pytest.approx(
        {"normal": 0.0, "moment": 30.0, "friction": -120.0, "front": 300.0, "rear": -300.0}, abs=1e-9
    )
    assert found.action[0] == pytest.approx(120.0, rel=1e-12)


def test_a_wheel_on_its_pivot_drags_by_the_friction_circle():
    """M = r mu/sqrt(1 + mu²) R, with R = 50 N."""
    joint = Joint("pivot", "pin", "frame", "wheel", ORIGIN, ORIGIN, friction=0.75, radius=0.02)
    poses = alone(joint, Link("wheel", (ORIGIN,)))
    found = reactions_at(poses, 8.0, loads=[Force("wheel", "o", 30.0, -40.0)])
    assert found.action[0] == pytest.approx(0.6 * 0.02 * 50.0, rel=1e-12)
    assert found.components["pivot"]["friction"][0] == pytest.approx(-0.6, rel=1e-12)


def weightless(linkage: Linkage) -> Linkage:
    links = tuple(link._replace(mass=0.0, inertia=0.0) for link in linkage.links)
    return Linkage(linkage.ground, links, linkage.joints, linkage.driver, start=linkage.start)


def test_a_rod_between_two_friction_circles():
    """A two-force rod's line touches both circles: it leans against the pins' line by asin of the circles' sum over l."""
    mu, radius, load = 0.3, 0.02, -800.0
    rho = radius * mu / np.hypot(1.0, mu)
    q = np.linspace(0.2, 6.1, 23)
    found = reactions(weightless(forced.slider_crank(mu, radius)), q, 5.0, loads=[Force("slider", "o", load)])
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
    np.testing.assert_allclose(found.resultant("slider_pin"), push, rtol=1e-11)
    np.testing.assert_allclose(found.action, torque, rtol=0, atol=1e-10 * np.abs(torque).max())
    assert found.friction.converged.all()
    assert 1 < found.friction.iterations < 8


def test_a_driving_slider_locks_where_the_rod_passes_inside_the_friction_circle():
    """The crank turns against a torque only where the force's lever about its pivot exceeds the circle there."""
    mu, radius = 0.25, 0.03
    rho = radius * mu / np.hypot(1.0, mu)
    linkage = weightless(forced.slider_crank(mu, radius, driver="guide", start=0.4))
    rubless = tuple(joint._replace(friction=0.0) if joint.name == "guide" else joint for joint in linkage.joints)
    crank, rod, slider = linkage.links
    links = crank._replace(guess=1.0), rod._replace(guess=-0.25), slider
    linkage = Linkage(linkage.ground, links, rubless, "guide", start=0.39)
    q = np.linspace(0.4489, 0.30, 30)  # pushed inwards from close to full stretch
    found = reactions(linkage, q, -0.5, loads=[Torque("crank", -20.0)], inertia=False)
    poses = found.poses
    turn, sway = poses.angle("crank"), poses.angle("rod")
    assert (turn.rate < 0).all()  # the crank turns counter-clockwise as the slider goes in
    against_crank, against_slider = np.sign(-(sway.rate - turn.rate)), np.sign(-sway.rate)
    offset = rho * (against_crank + against_slider) / 0.35
    unit = np.exp(1j * sway.value)
    force = -unit * np.sqrt(1 - offset**2) + 1j * unit * offset
    lever = (0.1 * np.exp(-1j * turn.value) * force).imag + rho * against_crank - rho
    moves = lever > 0
    assert 0 < moves.sum() < len(q)
    np.testing.assert_array_equal(found.friction.converged, moves)
    assert np.isnan(found.action[~moves]).all()
    assert np.isnan(found.friction.moment[~moves]).all()
    np.testing.assert_allclose(found.resultant("crank_pin")[moves], 20.0 / lever[moves], rtol=1e-9)
    np.testing.assert_array_equal(found.locked, q[~moves])
    assert "friction locks at" in found.table()


def test_violent_friction_is_solved_or_reported():
    """Factors far past a contraction: what counts as converged fulfils the equations, also where stages were needed."""
    rng = np.random.default_rng(1)
    free, response = rng.normal(size=(500, 4)), rng.normal(size=(500, 4, 2))
    forms = np.zeros((2, 2, 4))
    forms[0, 0, 0] = forms[1, 0, 2] = forms[1, 1, 3] = 1.0
    factor = rng.uniform(-0.5, 0.5, size=(500, 2))
    found = friction_sizes(free, response, factor, forms)
    x = free + np.einsum("nmp,np->nm", response, factor * found.sizes)
    gap = np.abs(np.stack((np.abs(x[:, 0]), np.hypot(x[:, 2], x[:, 3])), axis=1) - found.sizes).max(axis=1)
    assert found.iterations > 30
    assert 0.97 < found.converged.mean() < 1.0
    assert (gap[found.converged] < 1e-9 * found.sizes[found.converged].max(axis=1)).all()


@pytest.mark.parametrize(("load", "wanted"), [(1.0, None), (-1.0, 1 / 3)])
def test_what_pushes_itself_fast_is_reported(load, wanted):
    """X - 2 |x| = 1 has no solution; x - 2 |x| = -1 has two, of which -1/3 grows out of the one without friction."""
    found = friction_sizes(np.array([[load]]), np.ones((1, 1, 1)), np.array([[2.0]]), np.array([[[1.0], [0.0]]]))
    assert found.converged[0] == (wanted is not None)
    if wanted is not None:
        assert found.sizes[0, 0] == pytest.approx(wanted)


def test_what_friction_needs_is_asked_for():
    with pytest.raises(SceneError, match=r"joints.pivot.radius.*the radius of a pin that has friction"):
        reactions(forced.slider_crank(0.1), [1.0], 10.0)
    weld = Joint("weld", "fixed", "frame", "block", ORIGIN, ORIGIN, friction=0.1)
    with pytest.raises(SceneError, match="does not slide"):
        reactions_at(alone(weld, Link("block", (ORIGIN,))), 1.0)
