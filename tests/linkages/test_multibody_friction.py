"""Motion with friction in joints: closed forms, a slider-crank written out by hand, statics at single instants."""

from __future__ import annotations

from dataclasses import replace
from math import asin, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import flywheel
from flywheel.mechanisms.linkages.multibody import MULTIPLIERS, NEWTON, Wrench, components, simulate
from flywheel.mechanisms.linkages.reactions import reactions
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import CAM, FIXED, FRAME, PIN, SLIDE, Joint, Link, Linkage, Point
from tests.limits import sample
from tests.linkages.linkages import four_bar
from tests.linkages.machines import GRAVITY, MACHINES, STARTS, double_guided, heavy, pendulum, published

ORIGIN = Point("o")
both_routes = pytest.mark.parametrize("route", [NEWTON, MULTIPLIERS])


def alone(joint: Joint, link: Link) -> Linkage:
    """One body on the frame."""
    return Linkage(Link(FRAME, (ORIGIN,)), (link,), (joint,), joint.name)


def wheel(mu=0.3, radius=0.02):
    """A balanced wheel of 5 kg and 0.2 kg m² on a rough pivot."""
    joint = Joint("pivot", PIN, FRAME, "wheel", ORIGIN, ORIGIN, friction=mu, radius=radius)
    return alone(joint, Link("wheel", (ORIGIN,), mass=5.0, inertia=0.2))


LOCKING = replace(heavy(four_bar(d=0.4, r=0.3, c=0.35, length=0.1)), start=0.9)
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
        found = solve_ivp(rates, (t, until), y, "DOP853", rtol=1e-12, atol=1e-13, events=over)
        t, y = found.t[-1], found.y[:, -1]
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
    for name, found in ends[0].reactions.items():
        assert_allclose(found[-1], ends[1].reactions[name][-1], rtol=0, atol=1e-6)


def test_joints_hold_it_fast():
    """Pins as thick as the crank is long: from rest no drive moves it, and a push does not get far."""
    base = rough_slider_crank()
    pins = tuple(joint._replace(friction=3.0, radius=0.15) for joint in base.joints[:3])
    held = replace(base, joints=(*pins, base.joints[3]._replace(friction=3.0)))
    run = simulate(held, NEWTON, 0.3, 0.0, 2.0, gravity=GRAVITY, drive=500.0)
    assert run.rests == ((0.0, 2.0),)
    assert run.messages == ("mechanism: friction that holds it at 17.1887339 deg: it stands still from 0 s on",)
    moved = simulate(held, NEWTON, 0.3, 5.0, 2.0, gravity=GRAVITY)
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
    found = back(high)
    assert found.action[0] == pytest.approx(1.0, abs=1e-9)
    size = max(float(np.abs(part[0]).max()) for part in run.reactions.values())
    for joint in linkage.joints:
        ours = run.reactions[joint.name][0]
        parts = [part for name, part in components(linkage) if name == joint.name]
        assert_allclose([found.components[joint.name][part][0] for part in parts], ours, rtol=0, atol=1e-9 * size)
    for name, part in run.friction.items():
        assert found.components[name]["friction"][0] == pytest.approx(part[0], abs=1e-9 * size)


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
