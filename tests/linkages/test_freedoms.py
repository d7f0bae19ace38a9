"""Several degrees of freedom: inertia matrices, Lagrange's equations, simulation and driving actions by other routes."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel
from flywheel import SceneError, arm, freedoms
from flywheel.kinetostatics import Effort, Force, Motion, Torque, chain_reactions
from flywheel.linkage import Coupling, Driver, Link, Linkage, solve
from flywheel.scene.linkage import FRAME, GEAR, SLIDE, Joint, Point
from tests.limits import sample
from tests.linkages.linkages import O, bar, dyad, geared_five_bar, ground, pin
from tests.linkages.machines import double_guided, heavy

DOWN = (0.0, -9.81)
EXAMPLES = Path(__file__).parents[2] / "examples"

# -- machines ----------------------------------------------------------------------------------------------------------

BARS = (
    (0.2, (0.1, 0.0), 1.0, 0.004),
    (0.2, (0.09, 0.01), 1.2, 0.005),
    (0.45, (0.2, 0.0), 0.8, 0.012),
    (0.45, (0.19, -0.01), 0.9, 0.014),
)
"""Length, centre of mass, mass, inertia of the five-bar's moving bars: two cranks, two rods."""
SPAN, START = 0.5, (2.0, 1.1)


def five_bar() -> Linkage:
    """Two cranks on O and D, each with a motor, and two rods that meet above them."""
    frame = ground(D=(SPAN, 0.0))
    names, guesses = ("left", "right", "left_rod", "right_rod"), (None, None, 0.6, 2.4)
    links = tuple(
        bar(name, length, guess)._replace(mass=mass, inertia=inertia, com=com)
        for name, guess, (length, com, mass, inertia) in zip(names, guesses, BARS, strict=True)
    )
    ends = [link.point("E") for link in links]
    joints = (
        pin("O", FRAME, "left"),
        pin("D", FRAME, "right", frame.point("D")),
        pin("A", "left", "left_rod", ends[0]),
        pin("B", "right", "right_rod", ends[1]),
        pin("P", "left_rod", "right_rod", ends[2], ends[3]),
    )
    return Linkage(frame, links, joints, "O", start=START[0], further=(Driver("D", START[1]),))


def chain(bars) -> Linkage:
    """An open arm of bars (length, mass, inertia, com), relative angles; every pin drives."""
    links = tuple(
        bar(f"bar{k}", length)._replace(mass=mass, inertia=inertia, com=(com, 0.0))
        for k, (length, mass, inertia, com) in enumerate(bars, 1)
    )
    pairs = enumerate(zip((None, *links), links, strict=False), 1)
    joints = tuple(
        pin(f"pin{k}", FRAME, here.name) if before is None else pin(f"pin{k}", before.name, here.name, before.point("E"))
        for k, (before, here) in pairs
    )
    return Linkage(ground(), links, joints, "pin1", further=tuple(Driver(joint.name) for joint in joints[1:]))


def cart(rod_inertia: float = 0.02) -> Linkage:
    """A cart of 2 kg on a level rail, a rod of 0.5 kg hinged to it with its centre 0.3 m below at 0."""
    rod = Link("rod", (O,), 0.5, rod_inertia, (0.0, -0.3), guess=0.0)
    joints = Joint("rail", SLIDE, FRAME, "cart", O, O), pin("hinge", "cart", "rod")
    return Linkage(ground(), (Link("cart", (O,), 2.0), rod), joints, "rail", further=(Driver("hinge"),))


# -- against closed forms ------------------------------------------------------------------------------------------------


def test_two_link_arm_against_its_closed_form():
    closed = arm.TwoLinkArm(arm.slender(0.5, 6.0), arm.slender(0.4, 3.0), 9.81)
    linkage = chain([bar[:4] for bar in closed_bars(closed)])
    rng = np.random.default_rng(3)
    q, qdot, qddot = rng.uniform(-3, 3, (3, 2, 6))
    own = np.stack((q[0] + np.pi / 2, q[1] - q[0]))  # of the pins: from +x, and against the first bar
    rates, turning = (np.stack((part[0], part[1] - part[0])) for part in (qdot, qddot))
    expected = arm.driving_torques(closed, q, qdot, qddot)
    result = freedoms.driving_actions(linkage, own, rates, turning, gravity=DOWN)
    forces = freedoms.reactions(linkage, own, rates, turning, gravity=DOWN)
    pins = arm.reactions(closed, q, qdot, qddot)
    for k, name in enumerate(("pin1", "pin2")):
        assert result[name] == pytest.approx(expected[k], rel=1e-13, abs=1e-12)
        assert forces.actions[name] == pytest.approx(expected[k], rel=1e-12, abs=1e-12)
        assert forces.forces[name] == pytest.approx(pins[k], rel=1e-12, abs=1e-12)
    drives = {name: expected[k, 0] for k, name in enumerate(("pin1", "pin2"))}
    assert freedoms.accelerations(linkage, own[:, 0], rates[:, 0], drives, gravity=DOWN) == pytest.approx(
        turning[:, 0], rel=1e-12
    )
    change = np.array([[1.0, 0.0], [-1.0, 1.0]])  # of the pins' coordinates by the bars' own angles
    matrix = np.einsum("ai,abn,bj->ijn", change, freedoms.mass_matrix(linkage, own), change)
    assert matrix == pytest.approx(arm.mass_matrix(closed, q), rel=1e-13, abs=1e-13)
    result, expected = freedoms.energy(linkage, own, rates, gravity=DOWN), arm.energy(closed, q, qdot)
    assert result[0] == pytest.approx(expected[0], rel=1e-13)
    assert result[1] == pytest.approx(expected[1], rel=1e-13)


def closed_bars(closed):
    return [(part.length, part.mass, part.inertia, part.com) for part in (closed.first, closed.second)]


def test_cart_with_pendulum_against_its_closed_form():
    q, qdot = np.array([0.4, 0.7]), np.array([1.5, -2.0])
    result = freedoms.equations(cart(), q, qdot, gravity=DOWN)
    s, c, lever = np.sin(q[1]), np.cos(q[1]), 0.5 * 0.3
    assert result.mass == pytest.approx(np.array([[2.5, lever * c], [lever * c, 0.5 * 0.09 + 0.02]]), rel=1e-14)
    assert result.rest == pytest.approx([-lever * s * qdot[1] ** 2, 0.0], abs=1e-15)
    assert result.forces == pytest.approx([0.0, -lever * 9.81 * s], abs=1e-14)
    assert result.slope[:, :, 1] == pytest.approx(np.array([[0.0, -lever * s], [-lever * s, 0.0]]), abs=1e-15)
    assert not result.slope[:, :, 0].any()


def test_three_link_arm_against_newton_and_euler_bar_by_bar():
    linkage = chain([(0.7, 4.0, 0.25, 0.4), (0.5, 2.5, 0.09, 0.3), (0.4, 1.5, 0.05, 0.15)])
    motion = np.random.default_rng(5).normal(size=(3, 3, 4))
    inputs = {f"pin{k}": Motion(*motion[:, k - 1]) for k in (1, 2, 3)}
    expected = chain_reactions(linkage, inputs, np.arange(4.0), gravity=DOWN, loads=[Torque("bar3", 2.0)])
    result = freedoms.driving_actions(linkage, *motion, gravity=DOWN, loads=[Torque("bar3", 2.0)])
    for name, action in result.items():
        assert action == pytest.approx(expected.actions[name], rel=1e-12, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("joints", ["RRR", "RPR"])
def test_arms_of_three_bars_against_the_equations_in_symbols(joints):
    """Turned from the upward vertical there, from +x here: the first angle differs by a right angle."""
    bars = [arm.Bar(0.7, 4.0, 0.25, 0.4), arm.Bar(0.5, 2.5, 0.09, 0.3), arm.Bar(0.4, 1.5, 0.05, 0.15)]
    linkage = chain(bars)
    if joints == "RPR":
        slide = linkage.joints[1]._replace(kind=SLIDE)
        linkage = replace(linkage, joints=(linkage.joints[0], slide, linkage.joints[2]))
    q, qdot, qddot = np.array([0.8, -0.6, 1.1]), np.array([2.5, -1.5, 3.0]), np.array([4.0, 1.0, -7.0])
    result = arm.lagrange_equations(joints, relative=True)
    put = result.values(bars, gravity=9.81)
    for order, numbers in ((2, qddot), (1, qdot), (0, q)):
        put |= {own.diff(result.t, order): number for own, number in zip(result.q, numbers, strict=True)}
    expected = [float(left.subs(put, simultaneous=True)) for left in result.left]
    right = [float(side.subs(dict(zip(result.torques, (1.0, 2.0, 3.0), strict=True)))) for side in result.right]
    actions = freedoms.driving_actions(linkage, [q[0] + np.pi / 2, *q[1:]], qdot, qddot, gravity=DOWN)
    assert list(actions.values()) == pytest.approx(expected, rel=1e-12)
    assert right == [1.0, 2.0, 3.0]


def test_springs_struts_dampers_and_loads_by_virtual_work():
    linkage = cart()
    q, qdot = np.array([0.4, 0.7]), np.array([1.5, -2.0])
    springs = (
        freedoms.Spring("rail", 30.0, 0.1, 2.0),
        freedoms.Spring("hinge", 4.0, -0.2, 0.3),
        freedoms.Strut((FRAME, (0.2, 0.5)), ("rod", (0.0, -0.6)), 50.0, 0.4, 1.5),
    )
    loads = (Force("rod", (0.0, -0.6), x=lambda t, q, v: 2.0 + t + v[0]), Torque("rod", 0.7), Effort("rail", -1.1))
    result = freedoms.equations(linkage, q, qdot, springs=springs, loads=loads, t=3.0)

    def place(q):
        return np.array([q[0] + 0.6 * np.sin(q[1]), -0.6 * np.cos(q[1])])

    def stored(q):
        far = np.hypot(*(place(q) - (0.2, 0.5)))
        return 15.0 * (q[0] - 0.1) ** 2 + 2.0 * (q[1] + 0.2) ** 2 + 25.0 * (far - 0.4) ** 2

    arm_at = np.array([[1.0, 0.6 * np.cos(q[1])], [0.0, 0.6 * np.sin(q[1])]])
    along = (place(q) - (0.2, 0.5)) / np.hypot(*(place(q) - (0.2, 0.5)))
    force = np.array([2.0 + 3.0 + 1.5, 0.0]) - 1.5 * (along @ arm_at @ qdot) * along
    expected = arm_at.T @ force + np.array([-1.1 - 2.0 * 1.5, 0.7 + 0.3 * 2.0])
    step = 1e-6
    slopes = [(stored(q + step * e) - stored(q - step * e)) / (2 * step) for e in np.eye(2)]
    assert result.potential == pytest.approx(stored(q), rel=1e-13)
    assert result.forces == pytest.approx(expected - slopes, rel=1e-8)
    forces = freedoms.reactions(linkage, q, qdot, springs=springs, loads=loads, t=3.0)
    actions = freedoms.driving_actions(linkage, q, qdot, springs=springs, loads=loads, t=3.0)
    assert {name: float(value[0]) for name, value in forces.actions.items()} == pytest.approx(
        {name: float(value) for name, value in actions.items()}, rel=1e-12
    )


def test_one_driver_is_the_reduced_machine():
    scene = flywheel.load(EXAMPLES / "linkages" / "geared_five_bar.toml").with_({"inertia": None})
    linkage = scene.mechanisms[0].linkage
    assert linkage is not None
    for phi in (0.3, 2.0):
        expected = flywheel.reduce(scene, phi)
        result = freedoms.equations(linkage, [phi], [1.0])
        assert float(result.mass[0, 0]) == pytest.approx(float(expected.inertia), rel=1e-12)
        assert float(result.rest[0]) == pytest.approx(0.5 * float(expected.slope), rel=1e-10)


# -- a closed loop -------------------------------------------------------------------------------------------------------


def test_five_bar_against_thirty_digits():
    q = (2.3, 0.8)
    with mp.workdps(40):
        bars = [(mp.mpf(str(length)), mp.mpc(*map(str, com)), mp.mpf(str(m)), mp.mpf(str(i))) for length, com, m, i in BARS]

        def bodies(*q):
            """Centres of mass and angles by circles that intersect."""
            knees = bars[0][0] * mp.expj(q[0]), mp.mpf(SPAN) + bars[1][0] * mp.expj(q[1])
            tip = dyad(*knees, bars[2][0], bars[3][0], 1)
            starts = 0, mp.mpf(SPAN), *knees
            angles = *q, mp.arg(tip - knees[0]), mp.arg(tip - knees[1])
            turned = zip(starts, bars, angles, strict=True)
            return [(start + part[1] * mp.expj(angle), angle) for start, part, angle in turned]

        parts = (lambda body: body[0].real, lambda body: body[0].imag, lambda body: body[1])

        def partial(order):
            """All coordinates of all bodies, differentiated."""
            return [[mp.diff(lambda *q, k=k, p=p: p(bodies(*q)[k]), q, order) for p in parts] for k in range(4)]

        orders = {(i, j): (int(i == 0) + int(j == 0), int(i == 1) + int(j == 1)) for i in (0, 1) for j in (0, 1)}
        first = [partial((1, 0)), partial((0, 1))]
        second = {order: partial(order) for order in set(orders.values())}
        weights = [(part[2], part[2], part[3]) for part in bars]

        def sums(a, b):
            return float(sum(w * x * y for row in zip(weights, a, b, strict=True) for w, x, y in zip(*row, strict=True)))

        mass = np.array([[sums(first[i], first[j]) for j in (0, 1)] for i in (0, 1)])
        terms = np.array([[[sums(first[i], second[orders[j, k]]) for k in (0, 1)] for j in (0, 1)] for i in (0, 1)])
        lifted = [sum(part[2] * body[1] for part, body in zip(bars, first[i], strict=True)) for i in (0, 1)]
        weight = [float(-mp.mpf("9.81") * rise) for rise in lifted]
    result = freedoms.equations(five_bar(), q, gravity=DOWN)
    assert result.mass == pytest.approx(mass, rel=1e-13)
    assert result.christoffel == pytest.approx(terms, rel=1e-12, abs=1e-15)
    assert result.forces == pytest.approx(weight, rel=1e-12)
    assert result.slope == pytest.approx(terms + terms.transpose(1, 0, 2), rel=1e-12, abs=1e-15)


class NewtonEuler:
    """The five-bar in the twelve coordinates of its bodies with ten joint equations: nothing of the toolkit's own."""

    ends = tuple(((-c[0], -c[1]), (length - c[0], -c[1])) for length, c, _, _ in BARS)
    pins = (
        (None, (0.0, 0.0), 0, ends[0][0]),
        (None, (SPAN, 0.0), 1, ends[1][0]),
        (0, ends[0][1], 2, ends[2][0]),
        (1, ends[1][1], 3, ends[3][0]),
        (2, ends[2][1], 3, ends[3][1]),
    )
    masses = np.concatenate([(m, m, i) for _, _, m, i in BARS])

    @classmethod
    def closures(cls, x, v):
        jacobian, right, gaps = np.zeros((10, 12)), np.zeros(10), np.zeros(10)
        for k, joint in enumerate(cls.pins):
            rows = slice(2 * k, 2 * k + 2)
            for sign, body, (px, py) in ((-1, *joint[:2]), (1, *joint[2:])):
                if body is None:
                    gaps[rows] += sign * np.array((px, py))
                    continue
                s, c = np.sin(x[3 * body + 2]), np.cos(x[3 * body + 2])
                arm = np.array((c * px - s * py, s * px + c * py))
                gaps[rows] += sign * (x[3 * body : 3 * body + 2] + arm)
                jacobian[2 * k, 3 * body] = jacobian[2 * k + 1, 3 * body + 1] = sign
                jacobian[rows, 3 * body + 2] = sign * np.array((-arm[1], arm[0]))
                right[rows] += sign * arm * v[3 * body + 2] ** 2
        return gaps, jacobian, right

    @classmethod
    def accelerations(cls, t, x, v, torques):
        _, jacobian, right = cls.closures(x, v)
        forces = cls.masses * np.tile((*DOWN, 0.0), 4)
        forces[2], forces[5] = torques(t, x[[2, 5]], v[[2, 5]])
        matrix = np.block([[np.diag(cls.masses), jacobian.T], [jacobian, np.zeros((10, 10))]])
        result = np.linalg.solve(matrix, np.concatenate((forces, right)))
        return result[:12], -result[12:]


def torques(t, q, w):
    return 0.3 * np.sin(5 * t) - 0.05 * w[0], 0.2 - 0.05 * w[1]


DRIVES = {"O": lambda t, q, w: torques(t, q, w)[0], "D": lambda t, q, w: torques(t, q, w)[1]}


def started(linkage, q, qdot):
    poses = freedoms.positions(linkage, q).motion(qdot)
    states = [(poses.centre(link.name), poses.angle(link.name)) for link in linkage.links]
    return [
        np.concatenate([(*getattr(c, part)[:, 0], getattr(a, part)[0]) for c, a in states]) for part in ("value", "rate")
    ]


def test_five_bar_against_newton_and_euler():
    linkage, q, qdot = five_bar(), np.array(START), np.array([1.0, -2.0])
    x, v = started(linkage, q, qdot)
    gaps, jacobian, _ = NewtonEuler.closures(x, v)
    assert max(np.abs(gaps).max(), np.abs(jacobian @ v).max()) < 1e-15
    expected, forces = NewtonEuler.accelerations(0.0, x, v, torques)
    result = freedoms.accelerations(linkage, q, qdot, DRIVES, gravity=DOWN)
    assert result == pytest.approx(expected[[2, 5]], rel=1e-12)
    back = freedoms.reactions(linkage, q, qdot, result, gravity=DOWN)
    assert [float(back.actions[name][0]) for name in ("O", "D")] == pytest.approx(torques(0.0, q, qdot), abs=1e-12)
    assert np.concatenate([back.forces[name][:, 0] for name in ("O", "D", "A", "B", "P")]) == pytest.approx(
        forces, abs=1e-11
    )


@pytest.mark.parametrize("until", [0.05, pytest.param(0.35, marks=pytest.mark.slow)])
def test_five_bar_in_motion_against_newton_and_euler(until):
    linkage, qdot = five_bar(), np.array([1.0, -2.0])
    x, v = started(linkage, START, qdot)

    def rates(t, y):
        return np.concatenate((y[12:], NewtonEuler.accelerations(t, y[:12], y[12:], torques)[0]))

    other = solve_ivp(
        rates, (0.0, until), np.concatenate((x, v)), method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True
    )
    run = freedoms.simulate(linkage, START, qdot, until, DRIVES, gravity=DOWN, rtol=1e-8)
    times = np.linspace(0.0, until, 23)
    q, w = run.at(times)
    expected = other.sol(times)
    gaps = [
        np.abs(q - expected[[2, 5]]).max() / np.abs(q - q[:, :1]).max(),
        np.abs(w - expected[[14, 17]]).max() / np.abs(w).max(),
    ]
    assert max(gaps) < run.error + 1e-10 < 1e-8 + 1e-9
    assert run.energy_residual < 1e-9
    assert run.closure < 1e-14
    assert not run.messages
    assert q[:, 0] == pytest.approx(START, abs=1e-15)


def test_driving_actions_bring_a_planned_motion_about():
    linkage, t = five_bar(), np.linspace(0.0, 0.4, 5)
    q, qdot, qddot = (
        np.stack((at + way, other - way)) for at, other, way in ((2, 1.1, 0.2 * t**2), (0, 0, 0.4 * t), (0, 0, 0.4 + 0 * t))
    )
    torque = freedoms.driving_actions(linkage, q, qdot, qddot, gravity=DOWN)
    for k in range(5):
        drives = {name: float(action[k]) for name, action in torque.items()}
        result = freedoms.accelerations(linkage, q[:, k], qdot[:, k], drives, gravity=DOWN)
        assert result == pytest.approx(qddot[:, k], rel=1e-12)
    forces = freedoms.reactions(linkage, q, qdot, qddot, gravity=DOWN, t=t)
    assert forces.coordinate == ("time", "s")
    assert forces.actions["O"] == pytest.approx(torque["O"], rel=1e-11)
    assert forces.residual.max() < 1e-13


def test_redundant_joints_and_inner_drivers():
    """A slider guided twice on a swinging crank's rod; a five-bar driven at two of its knees."""
    base = heavy(double_guided())
    one = freedoms.equations(base, [0.7], [1.0])
    poses = solve(base, 0.0, 1.0).poses([0.7])
    speeds = [(link, poses.centre(link.name).rate, poses.angle(link.name).rate[0]) for link in base.links]
    expected = sum(link.mass * (speed**2).sum() + link.inertia * spin**2 for link, speed, spin in speeds)
    assert float(one.mass[0, 0]) == pytest.approx(expected, rel=1e-12)
    linkage = five_bar()
    place = freedoms.positions(linkage, START)
    knees = [float(place.value[b, 2, 0] - place.value[a, 2, 0]) for a, b in ((1, 3), (2, 4))]
    links = tuple(link._replace(guess=float(place.value[k, 2, 0])) for k, link in enumerate(linkage.links, 1))
    inner = replace(linkage, links=links, driver="A", start=knees[0], further=(Driver("B", knees[1]),))
    change = np.array([[place.rate[j, b, 2, 0] - place.rate[j, a, 2, 0] for j in (0, 1)] for a, b in ((1, 3), (2, 4))])
    matrix = change.T @ freedoms.mass_matrix(inner, knees) @ change
    assert matrix == pytest.approx(freedoms.mass_matrix(linkage, START), rel=1e-12)


def excavator(boom: float = 0.6, stick: float = -0.9) -> Linkage:
    """A boom and a stick at these angles (rad), each moved by a cylinder: two slides whose guides turn, in two loops."""
    foot, eye, ear, end, heel = 0.5 - 0.3j, 1.5 + 0.4j, 1.6 + 0.5j, 3.0 + 0.0j, -0.4 + 0.2j

    def point(name, place):
        return Point(name, place.real, place.imag)

    frame = Link(FRAME, (O, point("foot", foot)))
    one = Link("boom", (O, point("eye", eye), point("ear", ear), point("end", end)), 300.0, 250.0, (1.4, 0.2), boom)
    two = Link("stick", (O, point("heel", heel)), 150.0, 60.0, (0.6, 0.0), stick)
    barrels = [Link(name, (O,), 20.0, 2.0, (0.4, 0.0), at) for name, at in (("barrel1", 0.8), ("barrel2", 0.4))]
    pistons = [Link(name, (O,), 12.0, 1.5, (-0.3, 0.0)) for name in ("piston1", "piston2")]
    joints = (
        pin("base", FRAME, "boom"),
        pin("elbow", "boom", "stick", one.point("end")),
        pin("foot", FRAME, "barrel1", frame.point("foot")),
        Joint("lift", SLIDE, "barrel1", "piston1", O, O),
        pin("eye", "piston1", "boom", O, one.point("eye")),
        pin("ear", "boom", "barrel2", one.point("ear")),
        Joint("curl", SLIDE, "barrel2", "piston2", O, O),
        pin("heel", "piston2", "stick", O, two.point("heel")),
    )
    turned = np.exp(1j * boom)
    lengths = abs(eye * turned - foot), abs(end * turned + heel * np.exp(1j * stick) - ear * turned)
    links = (one, two, barrels[0], pistons[0], barrels[1], pistons[1])
    return Linkage(frame, links, joints, "lift", start=lengths[0], further=(Driver("curl", lengths[1]),))


def platform() -> Linkage:
    """A platform on three arms, each a crank with a motor and a rod: three degrees of freedom."""
    feet, pins = ([size * np.exp(1j * (2 * np.pi * k / 3 + np.pi / 2)) for k in range(3)] for size in (0.5, 0.12))
    frame = Link(FRAME, (O, *(Point(f"F{k}", z.real, z.imag) for k, z in enumerate(feet))))
    plate = Link("plate", tuple(Point(f"P{k}", z.real, z.imag) for k, z in enumerate(pins)), 2.0, 0.02, (0.01, 0.0), 0.1)
    links, joints, drivers = [plate], [], []
    for k in range(3):
        reach = pins[k] * np.exp(0.1j) - feet[k]
        turn = np.angle(reach) + np.arccos(abs(reach) / 0.6)  # crank and rod are 0.3 m long
        crank = bar(f"crank{k}", 0.3)._replace(mass=1.0, inertia=0.008, com=(0.14, 0.01))
        rod = bar(f"rod{k}", 0.3, float(np.angle(reach - 0.3 * np.exp(1j * turn))))
        rod = rod._replace(mass=0.6, inertia=0.005, com=(0.15, 0.0))
        links += [crank, rod]
        joints += [
            pin(f"motor{k}", FRAME, crank.name, frame.point(f"F{k}")),
            pin(f"knee{k}", crank.name, rod.name, crank.point("E")),
            pin(f"pin{k}", rod.name, "plate", rod.point("E"), plate.point(f"P{k}")),
        ]
        drivers.append(Driver(f"motor{k}", float(turn)))
    first, *further = drivers
    return Linkage(frame, tuple(links), tuple(joints), first.joint, start=first.start, further=tuple(further))


@pytest.mark.parametrize("linkage", sample([platform(), excavator()], 2), ids=["platform", "excavator"])
def test_coefficients_are_derivatives_and_both_routes_find_the_same_actions(linkage):
    q = np.array([driver.start for driver in linkage.drivers]) + [0.08, -0.06, 0.05][: len(linkage.drivers)]
    place, step = freedoms.positions(linkage, q), 1e-5
    still = place.motion(0.0)
    for joint in linkage.joints:
        ends = still.point(joint.first, joint.first_at).value, still.point(joint.second, joint.second_at).value
        turn = float(still.angle(joint.first).value[0])
        across = (ends[1] - ends[0])[:, 0] @ [-np.sin(turn), np.cos(turn)] if joint.kind == SLIDE else ends[1] - ends[0]
        assert np.abs(across).max() < 1e-14
    for k, shift in enumerate(step * np.eye(q.size)):
        one, other = freedoms.positions(linkage, q + shift), freedoms.positions(linkage, q - shift)
        assert (one.value - other.value) / (2 * step) == pytest.approx(place.rate[k], abs=1e-8)
        assert (one.rate - other.rate) / (2 * step) == pytest.approx(place.slope[:, k], abs=2e-8)
    motion = np.random.default_rng(1).normal(size=(2, q.size))
    result = freedoms.driving_actions(linkage, q, *motion, gravity=(1.3, -9.81))
    forces = freedoms.reactions(linkage, q, *motion, gravity=(1.3, -9.81))
    assert [float(forces.actions[name][0]) for name in result] == pytest.approx(
        [float(a) for a in result.values()], rel=1e-12
    )


@pytest.mark.slow
@pytest.mark.parametrize("linkage", [excavator(), platform(), cart()], ids=["excavator", "platform", "cart"])
def test_the_estimate_of_a_motion_holds_and_is_not_far_off(linkage):
    q = [driver.start + 0.05 for driver in linkage.drivers]
    tight = freedoms.simulate(linkage, q, np.full(len(q), 0.3), 0.2, gravity=DOWN, rtol=1e-11)
    times = np.linspace(0.0, 0.2, 37)
    for rtol in (1e-5, 1e-8):
        run = freedoms.simulate(linkage, q, np.full(len(q), 0.3), 0.2, gravity=DOWN, rtol=rtol)
        pairs = list(zip(run.at(times), tight.at(times), strict=True))
        sizes = np.abs(pairs[0][1] - pairs[0][1][:, :1]).max(), np.abs(pairs[1][1]).max()
        off = max(np.abs(one - other).max() / size for (one, other), size in zip(pairs, sizes, strict=True))
        assert off <= run.error <= rtol
        assert run.error < 1e4 * off
        assert run.energy_residual < max(10 * rtol, 1e-12)


def test_a_tolerance_beyond_rounding_is_told():
    run = freedoms.simulate(cart(), [0.0, 0.5], [0.0, 0.0], 0.05, gravity=DOWN, rtol=1e-15)
    assert run.messages[0].startswith("rtol 1e-15 not reached: the motion is good to ")
    assert run.error > 1e-15


def test_couplings_take_freedoms_away():
    """A five-bar with gears, driven at one crank or at the other."""
    linkage = heavy(geared_five_bar(-2.0, 0.7))
    one, q = freedoms.mass_matrix(linkage, [0.4]), -2.0 * 0.4 + 0.7
    poses = solve(linkage, 0.0, 1.0).poses([0.4])
    links = tuple(link._replace(guess=float(poses.angle(link.name).value[0])) for link in linkage.links)
    other = freedoms.mass_matrix(replace(linkage, links=links, driver="D", start=q), [q])
    assert float(one[0, 0]) == pytest.approx(4.0 * float(other[0, 0]), rel=1e-12)


# -- refusals ------------------------------------------------------------------------------------------------------------


def one_line(call, *args, **kwargs):
    with pytest.raises(SceneError) as refused:
        call(*args, **kwargs)
    text = str(refused.value)
    assert "\n" not in text
    return text


def test_wrong_numbers_of_drivers_are_refused():
    few = one_line(freedoms.mass_matrix, replace(five_bar(), further=()), [2.0])
    assert "1 driver (O) of a linkage of 2 degrees of freedom" in few
    assert "expected 2 drivers" in few
    place = freedoms.positions(five_bar(), START).value[:, 2, 0]
    agreeing = replace(five_bar(), further=(Driver("D", START[1]), Driver("A", float(place[3] - place[1]))))
    many = one_line(freedoms.mass_matrix, agreeing, [*START, float(place[3] - place[1])])
    assert "3 drivers (O, D, A) of a linkage of 2 degrees of freedom" in many
    geared = replace(geared_five_bar(), further=(Driver("D", 1.0),))
    assert "expected 1 driver" in one_line(freedoms.positions, geared, [0.0, 1.0])


def test_drivers_that_depend_on_each_other_are_refused():
    frame, wheels = ground(D=(0.3, 0.0)), (bar("one", 0.1), bar("two", 0.1), bar("three", 0.2))
    joints = pin("O", FRAME, "one"), pin("D", FRAME, "two", frame.point("D")), pin("E", "two", "three", wheels[1].point("E"))
    gears = (Coupling("gears", GEAR, "O", "D", -2.0),)
    linkage = Linkage(frame, wheels, joints, "O", gears, further=(Driver("D"),))
    assert "drivers (O, D) that depend on each other" in one_line(freedoms.positions, linkage, [0.0, 0.0])
    assert freedoms.mass_matrix(heavy(replace(linkage, further=(Driver("E"),))), [0.0, 0.0]).shape == (2, 2)


def short_five_bar(rod: float = 0.4) -> Linkage:
    """The five-bar with shorter rods, which come into line where the knees are as far apart as both are long."""
    linkage, end = five_bar(), Point("E", rod)
    links = tuple(link._replace(points=(O, end)) if "rod" in link.name else link for link in linkage.links)
    joints = (*linkage.joints[:-1], linkage.joints[-1]._replace(first_at=end, second_at=end))
    return replace(linkage, links=links, joints=joints)


def test_a_lock_is_named_with_where_all_drivers_stand():
    text = one_line(freedoms.positions, short_five_bar(), np.array([2.0 + 1.2, 1.1 - 1.2]))

    def apart(x):
        return abs(0.5 + 0.2 * np.exp(1j * (1.1 - x)) - 0.2 * np.exp(1j * (2.0 + x))) - 0.8

    turned = np.degrees(brentq(apart, 0.0, 1.0))
    assert f"locks with the drivers O at {np.degrees(2.0) + turned:.9g} deg" in text
    assert f"and D at {np.degrees(1.1) - turned:.9g} deg" in text


@pytest.mark.parametrize("seed", sample(range(10), 4))
def test_drivers_drawn_at_random_lock_where_the_rods_come_into_line(seed):
    rng = np.random.default_rng(seed)
    rod, speeds = float(rng.uniform(0.36, 0.4)), rng.uniform(0.6, 1.0, 2) * (1, -1)
    start = np.array([2.0, 1.1])

    def apart(x):
        turns = start + speeds * x
        return abs(0.5 + 0.2 * np.exp(1j * turns[1]) - 0.2 * np.exp(1j * turns[0])) - 2.0 * rod

    lock = brentq(apart, 0.0, 1.0)
    at = np.degrees(start + speeds * lock)
    text = one_line(freedoms.positions, short_five_bar(rod), np.array([start + speeds * x for x in (0.0, 1.3 * lock)]).T)
    named = re.search(r"locks with the drivers O at (\S+) deg and D at (\S+) deg", text)
    assert named is not None
    assert [float(one) for one in named.groups()] == pytest.approx(list(at), rel=1e-7)


@pytest.mark.slow
def test_a_motion_into_a_lock_is_given_until_there():
    """The rods come into line: the motion until then is that of a run that ends before, and says that it is partial."""
    state = short_five_bar(), (2.35, 0.75), [1.0, -1.0]
    run = freedoms.simulate(*state, 2.0, rtol=1e-6)
    assert run.stopped is not None
    (message,) = run.messages
    assert message.startswith(f"partial motion: it ends at {run.t[-1]:.6g} s of 2 s: ")
    knees = 0.5 + 0.2 * np.exp(1j * run.q[1, -1]) - 0.2 * np.exp(1j * run.q[0, -1])
    assert abs(knees) == pytest.approx(0.8, abs=1e-6)
    whole = freedoms.simulate(*state, 0.05, rtol=1e-9)
    assert whole.stopped is None
    assert run.at(0.05)[0] == pytest.approx(whole.q[:, -1], abs=1e-6)
    assert run.error < 1e-6
    assert "times: found 1 s, expected times from 0 to 0.0828" in one_line(run.at, 1.0)


def test_motions_without_mass_are_refused():
    light = cart()
    bare = replace(light, links=(light.links[0], light.links[1]._replace(mass=0.0, inertia=0.0)))
    assert "a motion of hinge moves no mass" in one_line(freedoms.accelerations, bare, [0.0, 0.0])
    point = chain([(0.5, 0.0, 0.0, 0.0), (0.5, 1.0, 0.0, 0.5)])
    assert "a singular inertia matrix" in one_line(freedoms.accelerations, point, [0.3, 0.0])


def test_arguments_are_refused_in_a_line():
    linkage = five_bar()
    assert "q: found an array of shape (3,), expected a row for each of the drivers: O, D" in one_line(
        freedoms.mass_matrix, linkage, [1, 2, 3]
    )
    assert "qdot: found an array of shape (3,)" in one_line(freedoms.equations, linkage, START, [1.0, 2.0, 3.0])
    assert 'drives.C: found "C", expected one of O, D' in one_line(freedoms.accelerations, linkage, START, drives={"C": 1.0})
    assert "loads[0].body" in one_line(freedoms.equations, linkage, START, loads=[Torque("rod", 1.0)])
    assert "springs[0].joint" in one_line(freedoms.equations, linkage, START, springs=[freedoms.Spring("Q", 1.0)])
    strut = freedoms.Strut(("left", "X"), ("frame", "O"), 1.0)
    assert "springs[0].first[1]" in one_line(freedoms.equations, linkage, START, springs=[strut])
    text = one_line(freedoms.accelerations, linkage, START, drives={"O": lambda t, q, w: [1.0, 2.0]})
    assert text == "drives.O: found an array of shape (2,), expected a finite number"
    strut = freedoms.Strut(("left", "E"), ("frame", ("a", 0.0)), 1.0)
    assert 'springs[0].second[1][0]: found "a"' in one_line(freedoms.equations, linkage, START, springs=[strut])
    assert "t: found an array of shape (2,)" in one_line(freedoms.reactions, linkage, START, t=[1.0, 2.0])
    assert 't: found "1 s"' in one_line(freedoms.equations, linkage, START, t="1 s")
    assert "mechanism.further: found" in one_line(freedoms.mass_matrix, replace(linkage, further=[Driver("D")]), START)
    rubbing = replace(linkage, joints=(linkage.joints[0]._replace(friction=0.1, radius=0.01), *linkage.joints[1:]))
    assert "mechanism.O.friction: found 0.1" in one_line(freedoms.simulate, rubbing, START, [0.0, 0.0], 1.0)
    assert "2 drivers (O, D), expected one driver" in one_line(solve, linkage, 0.0, 1.0)
    slot = replace(linkage, further=(Driver("Q"),))
    assert 'further[0].joint: found "Q"' in one_line(freedoms.positions, slot, START)
    assert "it drives already" in one_line(freedoms.positions, replace(linkage, further=(Driver("O"),)), START)
    run = freedoms.simulate(cart(), [0.0, 0.1], [0.0, 0.0], 0.1, rtol=1e-6)
    assert "times: found 1 s, expected times from 0 to 0.1 s" in one_line(run.at, 1.0)
