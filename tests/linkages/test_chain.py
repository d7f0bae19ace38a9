"""Open chains: positions, velocities, accelerations, and as many driving actions as degrees of freedom."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.mechanisms.linkages.reactions import Motion, chain_poses, chain_reactions, driving_actions, virtual_power
from flywheel.mechanisms.linkages.wrenches import Force
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import Linkage
from tests.linkages import forced

TIME = np.linspace(0.0, 2.0, 11)
G = 9.81


def arm() -> Linkage:
    frame = forced.ground()
    upper, lower = forced.bar("upper", 0.5, 3.0), forced.bar("lower", 0.4, 2.0)
    joints = forced.pin("shoulder", frame, "o", upper), forced.pin("elbow", upper, "end", lower)
    return Linkage(frame, (upper, lower), joints, "shoulder")


def robot() -> Linkage:
    """A turning column, a telescope in it, a hand welded to that, a finger on a pin whose first body is the finger."""
    frame = forced.ground(base=(0.1, 0.2))
    column, telescope = forced.bar("column", 0.3, 2.0), forced.bar("telescope", 0.4, 1.0)
    hand, finger = forced.bar("hand", 0.1, 0.5), forced.bar("finger", 0.15, 0.2)
    joints = (
        forced.pin("knuckle", finger, "o", hand, "end"),
        forced.Joint("weld", "fixed", "telescope", "hand", telescope.point("end"), hand.point("o"), angle=0.7),
        forced.slide("reach", column, "end", telescope, "o", direction=0.3, angle=0.2),
        forced.pin("turn", frame, "base", column),
    )
    return Linkage(frame, (column, telescope, hand, finger), joints, "turn")


def courses(t=TIME):
    return {
        "turn": Motion(np.sin(t), np.cos(t), -np.sin(t)),
        "reach": Motion(0.1 + 0.05 * t**2, 0.1 * t, 0.1 + 0 * t),
        "knuckle": Motion(0.4 * t, 0.4 + 0 * t, 0.0),
    }


def test_velocities_and_accelerations_are_those_of_the_positions():
    eps = 1e-5
    now, before, after = (chain_poses(robot(), courses(TIME + d), TIME + d) for d in (0.0, -eps, eps))
    np.testing.assert_allclose(now.rate, (after.value - before.value) / (2 * eps), atol=1e-9)
    np.testing.assert_allclose(now.slope, (after.rate - before.rate) / (2 * eps), atol=1e-9)


def test_joints_hold():
    poses = chain_poses(robot(), courses(), TIME)
    for joint in robot().joints:
        first, second = poses.point(joint.first, joint.first_at).value, poses.point(joint.second, joint.second_at).value
        gap = second - first
        if joint.kind == "slide":
            angle = poses.angle("column").value + 0.3
            gap -= np.asarray(courses()["reach"].value) * np.stack((np.cos(angle), np.sin(angle)))
        np.testing.assert_allclose(gap, 0.0, atol=1e-15)
    np.testing.assert_allclose(poses.angle("hand").value - poses.angle("telescope").value, 0.7)
    np.testing.assert_allclose(poses.angle("hand").value - poses.angle("finger").value, 0.4 * TIME)


def test_two_link_arm_has_the_torques_of_lagranges_equations():
    """Its equations with m1, c1 (complex: centre in the link's frame), l1, J1 and so on, written out by angle of link."""
    q1, q2 = 0.3 + np.sin(2 * TIME), 1.0 + 0.5 * TIME
    v1, v2 = 2 * np.cos(2 * TIME), 0.5 + 0 * TIME
    a1, a2 = -4 * np.sin(2 * TIME), 0 * TIME
    pull = 15.0
    found = chain_reactions(
        arm(),
        {"shoulder": Motion(q1, v1, a1), "elbow": Motion(q2, v2, a2)},
        TIME,
        gravity=(0.0, -G),
        loads=[Force("lower", "end", pull, 0.0)],
    )
    upper, lower = arm().links
    m1, m2, j1, j2, l1, l2 = upper.mass, lower.mass, upper.inertia, lower.inertia, 0.5, 0.4
    c1, c2 = complex(*upper.com), complex(*lower.com)
    a, b = q1, q1 + q2  # angles of both links; T = ½ A a'² + ½ B b'² + C a' b' cos(b - a + gamma)
    big_a, big_b, big_c, gamma = j1 + m1 * abs(c1) ** 2 + m2 * l1**2, j2 + m2 * abs(c2) ** 2, m2 * l1 * abs(c2), np.angle(c2)
    va, vb, aa, ab = v1, v1 + v2, a1, a1 + a2
    lean = b - a + gamma
    of_a = big_a * aa + big_c * (ab * np.cos(lean) - vb**2 * np.sin(lean))
    of_b = big_b * ab + big_c * (aa * np.cos(lean) + va**2 * np.sin(lean))
    of_a += G * (m1 * (c1 * np.exp(1j * a)).real + m2 * l1 * np.cos(a)) + pull * l1 * np.sin(a)
    of_b += G * m2 * (c2 * np.exp(1j * b)).real + pull * l2 * np.sin(b)
    np.testing.assert_allclose(found.actions["shoulder"], of_a + of_b, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(found.actions["elbow"], of_b, rtol=1e-11, atol=1e-11)


def test_the_routes_agree_for_many_drives():
    found = chain_reactions(robot(), courses(), TIME, gravity=(1.0, -G), loads=[Force("finger", "end", 5.0, TIME)])
    by_hand = sum(found.actions[name] * np.asarray(motion.speed) for name, motion in courses().items())
    np.testing.assert_allclose(found.power, by_hand, atol=1e-12)
    other = virtual_power(found)
    for joint, parts in other.items():
        for part, value in parts.items():
            mine = found.actions[joint] if part == "drive" else found.components[joint][part]
            np.testing.assert_allclose(mine, value, rtol=0, atol=1e-10 * 50)
    unit = [{n: Motion(m.value, float(n == name)) for n, m in courses().items()} for name in found.actions]
    coefficients = [chain_poses(robot(), motions, TIME) for motions in unit]
    for mine, value in zip(found.actions.values(), driving_actions(coefficients, found.others), strict=True):
        np.testing.assert_allclose(mine, value, rtol=0, atol=1e-11 * 50)


def test_the_table_goes_by_time():
    found = chain_reactions(robot(), courses(), TIME)
    lines = found.table().splitlines()
    assert lines[1].split("  ")[1] == "time (s)"
    assert all(f"{name} (N" in lines[1] for name in courses())
    assert found.csv().startswith("time (s),knuckle.drive (N m),reach.drive (N),turn.drive (N m),")


def test_what_is_no_open_chain_is_refused():
    with pytest.raises(SceneError, match="closes a loop"):
        chain_poses(forced.four_bar(), {}, TIME)
    with pytest.raises(SceneError, match=r"elbow: found no motion"):
        chain_poses(arm(), {"shoulder": Motion(0.0)}, TIME)
    with pytest.raises(SceneError, match=r"motions.wrist"):
        chain_poses(arm(), {"shoulder": Motion(0.0), "elbow": Motion(0.0), "wrist": Motion(0.0)}, TIME)
    with pytest.raises(SceneError, match=r"motions.elbow.speed"):
        chain_poses(arm(), {"shoulder": Motion(0.0), "elbow": Motion(0.0, [1.0, 2.0])}, TIME)
    loose = Linkage(arm().ground, arm().links, (arm().joints[1], arm().joints[1]._replace(name="twice")), "elbow")
    with pytest.raises(SceneError, match="open chain"):
        chain_poses(loose, {"elbow": Motion(0.0), "twice": Motion(0.0)}, TIME)
