"""Newton's law with reactions, multipliers and the reduced equation at single states."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest
from numpy.testing import assert_allclose

from flywheel.mechanisms.linkages.multibody import (
    Actions,
    Closure,
    UnreachableError,
    by_multipliers,
    by_newton,
    components,
    model,
    reaction_wrenches,
    reduced,
    system,
)
from flywheel.mechanisms.linkages.positions import solve_over
from flywheel.mechanisms.linkages.reactions import reactions
from flywheel.scene.linkage import Link
from tests.linkages.linkages import four_bar
from tests.linkages.machines import MACHINES, STARTS, prepared

SPEEDS = (0.0, 1.3, -6.0)


def uniform_four_bar():
    """The course's: uniform bars of 0.1, 0.35, 0.3 m and 0.4 m between supports; the third runs from support to pin."""
    base = four_bar()
    lengths = 0.1, 0.35, 0.3
    links = tuple(
        link._replace(mass=m, inertia=m * length**2 / 12, com=(length / 2, 0.0))
        for link, length, m in zip(base.links, lengths, (2.0, 3.0, 2.5), strict=True)
    )
    return type(base)(base.ground, links, base.joints, base.driver, base.couplings, base.sides)


def test_the_four_bar_has_17_equations_for_17_unknowns():
    linkage = uniform_four_bar()
    found = model(linkage, Actions())
    closure = Closure(found, prepared_pose(linkage, 1.1))
    state = found.state(*closure.at(1.1))
    matrix, right = system(found, 0.0, state, reaction_wrenches(found, state))
    assert matrix.shape == (17, 17)
    assert right.shape == (17,)
    assert found.masses.size == 9
    assert components(linkage) == [(joint, part) for joint in "OABD" for part in "xy"]
    assert np.linalg.matrix_rank(matrix) == 17


def prepared_pose(linkage, q):
    from flywheel.mechanisms.linkages.multibody import coordinates

    return coordinates(solve_over(linkage, (0.0, q)).poses(q))


@pytest.mark.parametrize("phi", [0.3, 1.1, 2.9, 4.4])
def test_the_courses_nine_equations_of_motion(phi):
    """Written out as there, body by body; its third angle is psi, where the print repeats phi."""
    linkage = uniform_four_bar()
    found = model(linkage, Actions())
    state = found.state(*scaled(Closure(found, prepared_pose(linkage, phi)).at(phi), 7.0))
    a, r = by_newton(found, 0.0, state)
    (l1, l2, l3), (m1, m2, m3) = (0.1, 0.35, 0.3), (2.0, 3.0, 2.5)
    theta, psi = state.places[2].theta, state.places[3].theta
    r41, r21, r32, r43 = r[0:2], -r[2:4], r[4:6], r[6:8]
    r32 = -r32  # of the third bar on the second
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


def scaled(pose, speed):
    x, g = pose
    return x, g * speed


@pytest.mark.parametrize("name", MACHINES)
def test_all_laws_give_the_acceleration_of_the_reduced_equation(name):
    """I*, its slope and M* here from the linkage solver's poses, g and g': another way than the closures in x, y, theta."""
    found, x = prepared(name)
    closure = Closure(found, x)
    q0 = STARTS[name]
    for q, speed in ((q0 + 0.02 * k, w) for k in (0, 1, 2) for w in SPEEDS):
        pose, g = closure.at(q)
        state = found.state(pose, g * speed)
        inertia, half, moment = from_poses(found, q, state)
        alpha = (moment - half * speed**2) / inertia
        size = (abs(moment) + abs(half) * speed**2) / inertia
        ours = reduced(found, 0.3, pose, g, speed)
        assert ours.inertia == pytest.approx(inertia, rel=1e-12)
        assert ours.acceleration == pytest.approx(alpha, abs=1e-12 * size)
        for law in (by_newton, by_multipliers):
            a = law(found, 0.3, state).accelerations
            assert float(state.along @ a) + state.bend == pytest.approx(alpha, abs=2e-12 * size)


def from_poses(found, q, state):
    """I*, ½ dI*/dq and M* from `Poses`."""
    linkage = found.linkage
    poses = solve_over(linkage, (linkage.start, q)).poses(q)
    inertia, half, gains = 0.0, 0.0, []
    for link in linkage.links:
        centre, angle = poses.centre(link.name), poses.angle(link.name)
        rate, slope = np.append(centre.rate[:, 0], angle.rate), np.append(centre.slope[:, 0], angle.slope)
        masses = np.array([link.mass, link.mass, link.inertia])
        inertia += float(masses @ rate**2)
        half += float(masses @ (rate * slope))
        gains.append(rate)
    return inertia, half, float(np.concatenate(gains) @ found.forces(0.3, state))


@pytest.mark.parametrize("name", MACHINES)
def test_reactions_of_free_bodies_are_the_multipliers(name):
    """Forces where they act equal the transposed Jacobian: ideal joints do no work."""
    found, x = prepared(name)
    state = found.state(x, np.random.default_rng(3).normal(size=x.size))
    assert_allclose(reaction_wrenches(found, state), state.jacobian.T, rtol=0, atol=1e-13)


def test_a_linkage_without_mass_has_no_motion():
    linkage = four_bar()
    found = model(linkage, Actions(drive=1.0))
    x, g = Closure(found, prepared_pose(linkage, 1.1)).at(1.1)
    with pytest.raises(UnreachableError, match="an inertia above 0"):
        reduced(found, 0.0, x, g, 1.0)


def test_bodies_without_mass_between_heavy_ones_are_no_obstacle():
    """Only I* has to be positive: M itself may be singular."""
    linkage = four_bar()
    links = (linkage.links[0]._replace(inertia=0.2), Link(*linkage.links[1]), Link(*linkage.links[2]))
    linkage = type(linkage)(linkage.ground, links, linkage.joints, linkage.driver, (), linkage.sides)
    found = model(linkage, Actions(drive=3.0))
    x, g = Closure(found, prepared_pose(linkage, 1.1)).at(1.1)
    a = by_newton(found, 0.0, found.state(x, g * 5.0)).accelerations
    assert a[2] == pytest.approx(15.0, rel=1e-12)


@pytest.mark.parametrize("name", [name for name, linkage in MACHINES.items() if not linkage.couplings])
def test_reactions_are_those_of_kinetostatics(name):
    """The inverse problem at the acceleration found here gives back the drive and every reaction."""
    found, x = prepared(name, Actions((0.3, -9.81), 4.0))
    q, speed = STARTS[name], 1.7
    pose, g = Closure(found, x).at(q)
    state = found.state(pose, g * speed)
    a, r = by_newton(found, 0.0, state)
    alpha = float(state.along @ a) + state.bend
    back = reactions(found.linkage, [q], speed, alpha, gravity=(0.3, -9.81))
    size = np.abs(r).max()
    assert back.action == pytest.approx(4.0, abs=1e-11 * size)
    for (joint, part), value in zip(components(found.linkage), r, strict=True):
        assert back.components[joint][part][0] == pytest.approx(value, abs=1e-11 * size)
