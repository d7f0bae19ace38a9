"""Where two bodies of a gear pair, a rolling pair or a cam touch, and in which direction they push each other.

The pair's two joints share one body, the carrier. Seen from it the first body turns about its pin, the second turns about
another pin or slides along a guide, so that the contact follows from the coupling's ratio (or the lift's slope) alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault, SceneError
from flywheel.linkage import lifts
from flywheel.linkage.description import CAM, GEAR, PIN, Coupling, Joint
from flywheel.linkage.poses import Poses
from flywheel.linkage.wrenches import along, guide, index, perp

Array = NDArray[np.float64]


class Contact(NamedTuple):
    """A contact at `at` (2, n), where body `first` pushes body `second` with a positive force along `push` (2, n).

    aside: unit vectors (2, n). Of teeth: the way in which the pressure angle inclines second's force. Of a cam: along its
        surface, as second slides on first when the cam's coordinate grows; 0 where it does not slide.
    """

    first: int
    second: int
    at: Array
    push: Array
    aside: Array


class Seen(NamedTuple):
    """The moving bodies as the carrier sees them, with their points in the joints; senses: +1 where the carrier is first."""

    first: int
    second: int
    pivot: Array
    other: Array
    guide: Array | None
    senses: tuple[float, float]


def contact(poses: Poses, coupling: Coupling) -> Contact:
    """The contact of a coupling; SceneError where no body is common to its joints, or where none can be found."""
    seen = _seen(poses, coupling)
    if coupling.kind == CAM:
        return _cam(poses, coupling, seen)
    if coupling.kind == GEAR:
        return _gear(poses, coupling, seen)
    return _rolling(poses, coupling, seen)


def _path(poses: Poses, coupling: Coupling) -> str:
    return f"{poses.linkage.path}.couplings.{coupling.name}"


def _seen(poses: Poses, coupling: Coupling) -> Seen:
    linkage = poses.linkage
    joints = linkage.joint(coupling.first), linkage.joint(coupling.second)
    carrier = linkage.carrier(coupling)
    if not carrier:
        found = f"joints {coupling.first} and {coupling.second} without a body in common"
        raise SceneError([Fault(_path(poses, coupling), found, "joints of one carrier, for forces to be found")])
    senses = tuple(1.0 if joint.first == carrier else -1.0 for joint in joints)
    ends = [(j.second, j.second_at) if j.first == carrier else (j.first, j.first_at) for j in joints]
    others = [index(poses, body) for body, _ in ends]
    places = [poses.point(body, at).value for body, at in ends]
    along_guide = None if joints[1].kind == PIN else guide(poses, joints[1])
    return Seen(others[0], others[1], places[0], places[1], along_guide, (senses[0], senses[1]))


def _gear(poses: Poses, coupling: Coupling, seen: Seen) -> Contact:
    """Teeth meet at the pitch point P = (c1 - rho c2)/(1 - rho), where the wheels' relative velocity vanishes.

    rho = second wheel's speed over the first's, both seen from the carrier; the force is positive along the common tangent,
    a quarter turn from c1 -> c2. Teeth press the wheels apart: second along c1 -> c2 outside (rho < 0), against it inside.
    """
    ratio = coupling.ratio * seen.senses[0] * seen.senses[1]
    if ratio == 1.0:
        raise SceneError(
            [Fault(f"{_path(poses, coupling)}.ratio", "1", "a ratio with a pitch point", "equal speeds need no gear")]
        )
    line = seen.other - seen.pivot
    line = line / np.hypot(*line)
    place = (seen.pivot - ratio * seen.other) / (1.0 - ratio)
    return Contact(seen.first, seen.second, place, perp(line), -np.sign(ratio) * line)


def _rolling(poses: Poses, coupling: Coupling, seen: Seen) -> Contact:
    """The wheel touches at |ratio| from its centre, across the guide, on the side where both have the same velocity.

    The force is positive along the guide. With a pressure angle (a rack) it also presses the rack away from the wheel.
    """
    if seen.guide is None:
        raise SceneError([Fault(f"{_path(poses, coupling)}.second", "a pin", "a slide on which the wheel rolls")])
    reach = -seen.senses[0] * seen.senses[1] * coupling.ratio
    across = perp(seen.guide)
    return Contact(seen.first, seen.second, seen.pivot + reach * across, seen.guide, np.sign(reach) * across)


def _cam(poses: Poses, coupling: Coupling, seen: Seen) -> Contact:
    """A cam pushes across the velocity that the follower has against it, and away from the cam's axis.

    Through a named contact point P (a roller's centre); without one the follower's flat face, across its travel through its
    guide's point, is touched where the cam moves along the travel as fast as the follower: at the eccentricity lift'.
    """
    slope = _slope(poses, coupling)
    turn, carried = seen.senses[0], seen.senses[1] * slope
    if coupling.contact is not None:
        body, name = coupling.contact
        place = poses.point(body, poses.linkage.link(body).point(name)).value
    elif seen.guide is not None:
        height = along(seen.guide, seen.other - seen.pivot)
        place = seen.pivot + height * seen.guide - turn * carried * perp(seen.guide)
    else:
        raise SceneError(
            [Fault(f"{_path(poses, coupling)}.contact", "none", "a body and its point, for a follower that turns")]
        )
    follower = carried * (perp(place - seen.other) if seen.guide is None else seen.guide)
    sliding = follower - turn * perp(place - seen.pivot)
    pace = np.hypot(*sliding)
    surface = np.divide(sliding, pace, out=np.zeros_like(sliding), where=pace > 0)
    return Contact(seen.first, seen.second, place, _outward(poses, coupling, seen, surface, place), surface)


def _outward(poses: Poses, coupling: Coupling, seen: Seen, surface: Array, place: Array) -> Array:
    """Normals (2, n) of the surface away from the cam's axis."""
    across = seen.guide if coupling.contact is None and seen.guide is not None else perp(surface)
    if not np.all(np.hypot(*across) > 0):
        worst = float(poses.q[np.argmin(np.hypot(*across))])
        found = f"a contact point that does not move against the cam at {worst:.9g}"
        raise SceneError([Fault(f"{_path(poses, coupling)}.contact", found, "a point off the cam's axis")])
    return across * np.where(along(across, place - seen.pivot) < 0, -1.0, 1.0)


def _slope(poses: Poses, coupling: Coupling) -> Array:
    """The lift's derivative (m/rad, or 1) by the coordinate of the cam's pin."""
    assert coupling.lift is not None
    joint: Joint = poses.linkage.joint(coupling.first)
    angle = poses.angle(joint.second).value - poses.angle(joint.first).value
    return lifts.at(coupling.lift, angle)[1]
