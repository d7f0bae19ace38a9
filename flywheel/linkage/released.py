"""Reactions by virtual power: release one constraint, let the mechanism move by it alone, and add up everyone's power.

Released, the mechanism has one more degree of freedom; with the driver held, its motion V follows from the constraints'
Jacobian, the released row set to 1 and all others to 0. The reaction is then minus the power of all other forces. The rows
are written as velocities of the joints' own points, in the velocities of the bodies' origins, and share nothing with the
equations of Newton and Euler but the places where couplings touch.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from flywheel.arguments import require
from flywheel.linkage.components import DRIVE
from flywheel.linkage.contacts import contact
from flywheel.linkage.description import CAM, FIXED, PIN, SLIDE, Coupling, Joint
from flywheel.linkage.newton import solved
from flywheel.linkage.poses import Poses
from flywheel.linkage.reactions import Reactions
from flywheel.linkage.wrenches import centres, guide, perp

Array = NDArray[np.float64]
Named = tuple[tuple[str, str], Array]  # (joint, component), row of shape (bodies, 3, n)

_FOLLOWS = 1e-8  # how well a released motion must respect all other constraints


def virtual_power(reactions: Reactions) -> dict[str, dict[str, Array]]:
    """Every component of every reaction, and every driving action as `drive`, by releasing one constraint at a time.

    x_k = -(sum of F · v_G + M omega over all bodies), v and omega being the influence coefficients of the released motion
    and F, M the loads, weights, inertia and friction forces in `reactions.others`. NaN where a release sets nothing free:
    the constraint is redundant there.
    """
    require("reactions", reactions, Reactions, "Reactions, as `kinetostatics.reactions` finds them")
    poses = reactions.poses
    named = rows(poses, reactions.actions)
    jacobian = np.stack([row[1:].reshape(-1, poses.q.size) for _, row in named]).transpose(2, 0, 1)
    motions = _motions(jacobian)
    work = _by_origins(poses, reactions.others)[1:].reshape(-1, poses.q.size)
    powers = -np.einsum("nrk,rn->kn", motions, work)
    found: dict[str, dict[str, Array]] = {}
    for ((joint, name), _), power in zip(named, powers, strict=True):
        found.setdefault(joint, {})[name] = power
    return found


def _motions(jacobian: Array) -> Array:
    """Columns: the motion that each constraint, released, sets free; NaN where it frees none. Shape (n, 3 bodies, rows)."""
    count, columns = jacobian.shape[1:]
    one = np.broadcast_to(np.eye(count), (len(jacobian), count, count))
    if count == columns:
        return solved(jacobian, one)
    motions = np.linalg.pinv(jacobian)
    astray = np.abs(jacobian @ motions - one).max(axis=1, keepdims=True)
    return np.where(astray < _FOLLOWS, motions, np.nan)


def _by_origins(poses: Poses, wrenches: Array) -> Array:
    """Wrenches about centres of mass moved to the origins of the bodies' frames."""
    arms = centres(poses).value[:, :2] - poses.value[:, :2]
    found = wrenches.copy()
    found[:, 2] += arms[:, 0] * wrenches[:, 1] - arms[:, 1] * wrenches[:, 0]
    return found


def rows(poses: Poses, drivers: Iterable[str]) -> list[Named]:
    """The constraints' Jacobian in the velocities (x', y', theta') of the bodies' origins, a row a component."""
    linkage = poses.linkage
    found = [named for joint in linkage.joints for named in _of_joint(poses, joint)]
    found += [_of_coupling(poses, coupling) for coupling in linkage.couplings]
    return [*found, *(((name, DRIVE), _coordinate(poses, linkage.joint(name))) for name in drivers)]


def _of_joint(poses: Poses, joint: Joint) -> list[Named]:
    turn = _turning(poses, joint)
    if joint.kind in (PIN, FIXED):
        still = np.zeros(poses.q.shape)
        axes = (("x", np.stack((still + 1.0, still))), ("y", np.stack((still, still + 1.0))))
        found: list[Named] = [((joint.name, name), _gap(poses, joint, axis, False)) for name, axis in axes]
        return found if joint.kind == PIN else [*found, ((joint.name, "moment"), turn)]
    normal: Named = (joint.name, "normal"), _gap(poses, joint, perp(guide(poses, joint)), True)
    return [normal, ((joint.name, "moment"), turn)] if joint.kind == SLIDE else [normal]


def _gap(poses: Poses, joint: Joint, axis: Array, sliding: bool) -> Array:
    """Velocity of second's point less first's along an axis; first's is at its own point or, sliding, where second's is."""
    names = poses.linkage.names
    end = poses.point(joint.second, joint.second_at).value
    start = end if sliding else poses.point(joint.first, joint.first_at).value
    return _apart(poses, (names.index(joint.first), start), (names.index(joint.second), end), axis)


def _apart(poses: Poses, first: tuple[int, Array], second: tuple[int, Array], axis: Array) -> Array:
    """Velocity along an axis at a place of the second body less that at a place of the first."""
    found = np.zeros_like(poses.value)
    for sign, (body, place) in ((-1.0, first), (1.0, second)):
        arm = perp(place - poses.value[body, :2])
        found[body, :2] += sign * axis
        found[body, 2] += sign * (arm * axis).sum(axis=0)
    return found


def _turning(poses: Poses, joint: Joint) -> Array:
    found = np.zeros_like(poses.value)
    found[poses.linkage.names.index(joint.first), 2] -= 1.0
    found[poses.linkage.names.index(joint.second), 2] += 1.0
    return found


def _coordinate(poses: Poses, joint: Joint) -> Array:
    """Rate of a joint's own coordinate."""
    return _turning(poses, joint) if joint.kind == PIN else _gap(poses, joint, guide(poses, joint), True)


def _of_coupling(poses: Poses, coupling: Coupling) -> Named:
    """How fast the two surfaces part at their contact, along the force between them."""
    touch = contact(poses, coupling)
    name = "normal" if coupling.kind == CAM else "tangential"
    return (coupling.name, name), _apart(poses, (touch.first, touch.at), (touch.second, touch.at), touch.push)
