"""Open chains: as many driven joints as degrees of freedom, each moved as its user prescribes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.faults import Fault, SceneError
from flywheel.linkage.description import FIXED, FRAME, PIN, SLOT, Joint, Linkage, Point
from flywheel.linkage.poses import Poses
from flywheel.linkage.wrenches import direction, perp, values

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """A joint's coordinate over time (rad or m): value, speed, acceleration; numbers, or arrays of shape (n,)."""

    value: ArrayLike
    speed: ArrayLike = 0.0
    acceleration: ArrayLike = 0.0


_State = tuple[Array, Array, Array]  # x, y, angle of a body's frame, shape (3, n): value, velocity, acceleration


def chain_poses(linkage: Linkage, motions: Mapping[str, Motion], time: ArrayLike) -> Poses:
    """Poses of an open chain whose joints all move as prescribed, with q = time (s): g is velocity, g' acceleration.

    Args:
        linkage: bodies and joints without closed loops or couplings; its `driver` is one of the driven joints.
        motions: the motion of every pin and slide, by its name.
        time: instants (s) that the motions' arrays belong to, shape (n,).

    Raises:
        SceneError: for a loop, a coupling, a joint without motion or a motion without joint.

    >>> from flywheel.linkage.description import Link
    >>> o = Point("o")
    >>> mast = Linkage(Link("frame", (o,)), (Link("mast", (o,)),), (Joint("foot", PIN, "frame", "mast", o, o),), "foot")
    >>> poses = chain_poses(mast, {"foot": Motion(0.0, 2.0)}, 0.0)
    >>> poses.point("mast", (3.0, 0.0)).slope.tolist()
    [[-12.0], [0.0]]

    """
    instants = np.atleast_1d(np.asarray(time, dtype=float)).ravel()
    _check(linkage, motions)
    still = np.zeros((3, instants.size))
    states: dict[str, _State] = {FRAME: (still, still, still)}
    left = list(linkage.joints)
    while left:
        reached = [joint for joint in left if (joint.first in states) != (joint.second in states)]
        if not reached:
            raise SceneError([Fault(linkage.path, f"a loop or loose bodies at joint {left[0].name}", "an open chain")])
        joint = reached[0]
        left.remove(joint)
        motion = motions.get(joint.name, Motion(0.0))
        given = [values(part, instants, f"motions.{joint.name}.{name}") for name, part in motion._asdict().items()]
        _step(joint, states, given)
    found = [np.stack([states[name][k] for name in linkage.names]) for k in range(3)]
    return Poses(linkage, instants, found[0], found[1], found[2])


def _check(linkage: Linkage, motions: Mapping[str, Motion]) -> None:
    path = linkage.path
    free = {joint.name for joint in linkage.joints if joint.kind != FIXED}
    faults = [
        Fault(f"{path}.joints.{joint.name}", "a pin in a slot", "pins and slides")
        for joint in linkage.joints
        if joint.kind == SLOT
    ]
    faults += [
        Fault(f"{path}.joints.{name}", "no motion", "one for every pin and slide") for name in sorted(free - set(motions))
    ]
    faults += [Fault(f"motions.{name}", "no pin or slide of that name", "a joint") for name in sorted(set(motions) - free)]
    faults += [Fault(f"{path}.couplings", coupling.name, "none in an open chain") for coupling in linkage.couplings]
    if len(linkage.joints) != len(linkage.links):
        found = f"{len(linkage.joints)} joints of {len(linkage.links)} bodies"
        faults.append(Fault(f"{path}.joints", found, "one joint a body", "another joint closes a loop"))
    if faults:
        raise SceneError(faults)


def _step(joint: Joint, states: dict[str, _State], motion: list[Array]) -> None:
    """Place the body beyond a joint, whichever of the joint's two bodies it is."""
    outward = joint.first in states
    known, beyond = (joint.first, joint.second) if outward else (joint.second, joint.first)
    sense, still = (1.0 if outward else -1.0), np.zeros_like(motion[0])
    turns = motion if joint.kind == PIN else [still + joint.angle, still, still]
    angles = [part[2] + sense * turn for part, turn in zip(states[known], turns, strict=True)]
    loose = tuple(np.stack((still, still, angle)) for angle in angles)
    first, second = _local(joint.first_at, still), _local(joint.second_at, still)
    if joint.kind not in (PIN, FIXED):
        guide = np.array([np.cos(joint.direction), np.sin(joint.direction)])[:, None]
        first = [place + guide * part for place, part in zip(first, motion, strict=True)]
    near, far = (first, second) if outward else (second, first)
    spots, arms = _carried(states[known], near), _carried((loose[0], loose[1], loose[2]), far)
    placed = [np.vstack((spot - arm, angle)) for spot, arm, angle in zip(spots, arms, angles, strict=True)]
    states[beyond] = placed[0], placed[1], placed[2]


def _local(at: Point, still: Array) -> list[Array]:
    """A point at rest in its body's frame: place, velocity, acceleration there, each (2, n)."""
    return [np.stack((still + at.x, still + at.y)), np.stack((still, still)), np.stack((still, still))]


def _carried(body: _State, local: list[Array]) -> list[Array]:
    """Place, velocity, acceleration (2, n) of a point that moves in a moving body: with Coriolis' term 2 omega k × v."""
    unit = direction(body[0][2])
    arm, speed, bend = (part[0] * unit + part[1] * perp(unit) for part in local)
    omega, alpha = body[1][2], body[2][2]
    return [
        body[0][:2] + arm,
        body[1][:2] + omega * perp(arm) + speed,
        body[2][:2] + alpha * perp(arm) - omega**2 * arm + 2 * omega * perp(speed) + bend,
    ]
