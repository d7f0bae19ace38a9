"""Forces on the bodies of a linkage: loads that a user names, weights, inertia forces, and pairs of action and reaction.

A wrench is (force x, force y, moment about the body's centre of mass) in the frame's axes; wrenches of all bodies form an
array of shape (bodies, 3, n), the frame first. Forces in N, moments in N m.

Also where two bodies of a gear pair, a rolling pair or a cam touch, and in which direction they push each other (`contact`).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.linkages.equations import lift_at
from flywheel.mechanisms.linkages.positions import Poses, Track
from flywheel.numerics.arguments import array, known, require, shown, vector
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import CAM, FIXED, GEAR, PIN, Coupling, Joint

Array = NDArray[np.float64]


class Force(NamedTuple):
    """A force (N) in the frame's axes at a point of a body: a point's name, or a place in the body's own frame (m).

    x, y: a number, or one for every position, shape (n,).
    """

    body: str
    at: str | tuple[float, float]
    x: ArrayLike = 0.0
    y: ArrayLike = 0.0


class Torque(NamedTuple):
    """A torque (N m) on a body, counter-clockwise; a number or shape (n,)."""

    body: str
    value: ArrayLike


class Effort(NamedTuple):
    """What a spring, a motor or a cylinder in a joint does, from its first body to its second, along its coordinate.

    A torque (N m) in a pin, a force (N) in a slide or a pin in a slot; a number or shape (n,).
    """

    joint: str
    value: ArrayLike


Load = Force | Torque | Effort


class Pair(NamedTuple):
    """An action of one body on another, and its reaction: a force (2, n) at one place (2, n), and a couple (n,).

    first, second: indices of bodies; the force and the couple are what first does to second.
    """

    first: int
    second: int
    force: Array
    at: Array
    couple: Array

    def on_bodies(self, centres: Array) -> Array:
        """Wrenches on all bodies, shape (bodies, 3, n), with centres of mass at `centres` (bodies, >= 2, n)."""
        found = np.zeros((len(centres), 3, self.at.shape[1]))
        for sign, body in ((-1.0, self.first), (1.0, self.second)):
            found[body, :2] += sign * self.force
            found[body, 2] += sign * (cross(self.at - centres[body, :2], self.force) + self.couple)
        return found


def cross(a: Array, b: Array) -> Array:
    """Moment a_x b_y - a_y b_x of vectors of shape (2, n)."""
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def perp(a: Array) -> Array:
    """Vectors (2, n) turned by a right angle, counter-clockwise."""
    return np.stack((-a[1], a[0]))


def direction(angle: Array) -> Array:
    """Unit vectors (2, n) at angles (rad) from +x."""
    return np.stack((np.cos(angle), np.sin(angle)))


def velocity(poses: Poses, body: int, place: Array) -> Array:
    """Velocity (2, n) by the driver's coordinate of a body's matter at `place` (2, n): o' + theta' k × (p - o)."""
    return np.asarray(poses.rate[body, :2] + poses.rate[body, 2] * perp(place - poses.value[body, :2]))


def index(poses: Poses, body: str) -> int:
    """Index of a body in the arrays of poses."""
    return poses.linkage.names.index(body)


def guide(poses: Poses, joint: Joint) -> Array:
    """Unit vectors (2, n) along the guide of a slide or a slot."""
    return direction(poses.angle(joint.first).value + joint.direction)


def joint_rate(poses: Poses, joint: Joint) -> Array:
    """Rate (n,) of a joint's coordinate by the driver's: of the angle of a pin, the displacement of a slide or slot.

    Along a guide it is what second's point does against the matter of first that is there, s' = d · (v2 - v1).
    """
    if joint.kind == PIN:
        return np.asarray(poses.angle(joint.second).rate - poses.angle(joint.first).rate)
    place = poses.point(joint.second, joint.second_at)
    return along(guide(poses, joint), place.rate - velocity(poses, index(poses, joint.first), place.value))


def along(unit: Array, vector: Array) -> Array:
    """Component of vectors (2, n) along unit vectors."""
    return np.asarray(np.einsum("in,in->n", unit, vector))


def effort_pair(poses: Poses, joint: Joint) -> Pair:
    """The pair that a unit effort along a joint's coordinate makes."""
    place = poses.point(joint.second, joint.second_at).value
    still = np.zeros_like(place)
    first, second = index(poses, joint.first), index(poses, joint.second)
    if joint.kind == PIN:
        return Pair(first, second, still, place, np.ones(place.shape[1]))
    return Pair(first, second, guide(poses, joint), place, still[0])


def centres(poses: Poses) -> Track:
    """Centres of mass and angles of all bodies with g and g', arrays of shape (bodies, 3, n)."""
    tracks = [poses.centre(name) for name in poses.linkage.names]
    parts = zip(*tracks, strict=True), (poses.value, poses.rate, poses.slope)
    return Track(*(np.concatenate((np.stack(p), whole[:, 2:]), axis=1) for p, whole in zip(*parts, strict=True)))


def weights(poses: Poses, gravity: tuple[float, float]) -> Array:
    """Weights m (gx, gy) of all bodies; gravity in m/s²."""
    pull = np.array((*vector("gravity", gravity, "m/s²"), 0.0))
    return np.asarray(masses(poses) * pull[:, None] + np.zeros_like(poses.value))


def inertial(poses: Poses, speed: Array, acceleration: Array) -> Array:
    """D'Alembert's forces of all bodies, -m a_G and -J alpha, with a = g qddot + g' qdot²."""
    middle = centres(poses)
    return np.asarray(-masses(poses) * (middle.rate * acceleration + middle.slope * speed**2))


def masses(poses: Poses) -> Array:
    """Mass, mass and inertia of every body, shape (bodies, 3, 1); 0 of the frame."""
    return np.array([(0.0,) * 3, *((link.mass, link.mass, link.inertia) for link in poses.linkage.links)])[:, :, None]


def applied(poses: Poses, loads: Iterable[Load]) -> Array:
    """Wrenches of a user's loads on all bodies; SceneError names every load that does not fit the linkage."""
    if isinstance(loads, Load) or not isinstance(loads, Iterable):
        raise SceneError([Fault("loads", shown(loads), "a list of Force, Torque and Effort")])
    middle = centres(poses).value
    found, faults = np.zeros_like(middle), list[Fault]()
    for k, load in enumerate(loads):
        try:
            found += _applied(poses, middle, load, f"loads[{k}]")
        except SceneError as error:
            faults += error.faults
    if faults:
        raise SceneError(faults)
    return found


def _applied(poses: Poses, middle: Array, load: Load, path: str) -> Array:
    require(path, load, (Force, Torque, Effort), "a Force, Torque or Effort")
    linkage = poses.linkage
    if isinstance(load, Effort):
        joint = known(f"{path}.joint", load.joint, {j.name: j for j in linkage.joints if j.kind != FIXED})
        return effort_pair(poses, joint).on_bodies(middle) * values_at(load.value, poses.q, f"{path}.value")
    body, found = load.body, np.zeros_like(middle)
    k = known(f"{path}.body", body, {name: k for k, name in enumerate(linkage.names)})
    if isinstance(load, Torque):
        found[k, 2] = values_at(load.value, poses.q, f"{path}.value")
        return found
    at = load.at
    if isinstance(at, str):
        at = known(f"{path}.at", at, {point.name: point[1:] for point in linkage.link(body).points})
    at = vector(f"{path}.at", at, "m")
    force = np.stack([values_at(part, poses.q, f"{path}.{axis}") for axis, part in (("x", load.x), ("y", load.y))])
    found[k, :2] = force
    found[k, 2] = cross(poses.point(body, at).value - middle[k, :2], force)
    return found


def values_at(given: ArrayLike, q: Array, path: str) -> Array:
    """A number, or one for every position, as an array (n,); SceneError for another shape or what is not finite."""
    found = array(path, given)
    if found.shape not in ((), (1,), q.shape):
        raise SceneError([Fault(path, f"an array of shape {found.shape}", f"a number or shape {q.shape}")])
    return np.broadcast_to(found, q.shape)


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


def contact(poses: Poses, coupling: Coupling) -> Contact:
    """The contact of a coupling; SceneError where no body is common to its joints, or where none can be found.

    The pair's two joints share one body, the carrier. Seen from it the first body turns about its pin, the second turns
    about another pin or slides along a guide, so that the contact follows from the coupling's ratio (or the lift's slope)
    alone.

    Gear: teeth meet at the pitch point P = (c1 - rho c2)/(1 - rho), where the wheels' relative velocity vanishes, rho being
    the second wheel's speed over the first's. The force is positive along the common tangent, a quarter turn from c1 -> c2.
    Teeth press the wheels apart: second along c1 -> c2 outside (rho < 0), against it inside.

    Rolling: the wheel touches at |ratio| from its centre, across the guide, on the side where both have the same velocity.
    The force is positive along the guide. With a pressure angle (a rack) it also presses the rack away from the wheel.

    Cam: it pushes across the velocity that the follower has against it, and away from the cam's axis, through a named
    contact point P (a roller's centre); without one the follower's flat face, across its travel through its guide's point,
    is touched where the cam moves along the travel as fast as the follower: at the eccentricity lift'.
    """
    linkage = poses.linkage
    path = f"{linkage.path}.couplings.{coupling.name}"
    joints = linkage.joint(coupling.first), linkage.joint(coupling.second)
    carrier = linkage.carrier(coupling)
    if not carrier:
        found = f"joints {coupling.first} and {coupling.second} without a body in common"
        raise SceneError([Fault(path, found, "joints of one carrier, for forces to be found")])
    senses = [1.0 if joint.first == carrier else -1.0 for joint in joints]  # +1 where the carrier is first
    ends = [(j.second, j.second_at) if j.first == carrier else (j.first, j.first_at) for j in joints]
    first, second = (index(poses, body) for body, _ in ends)
    pivot, other = (poses.point(body, at).value for body, at in ends)
    way = None if joints[1].kind == PIN else guide(poses, joints[1])
    if coupling.kind == GEAR:
        ratio = coupling.ratio * senses[0] * senses[1]
        if ratio == 1.0:
            raise SceneError([Fault(f"{path}.ratio", "1", "a ratio with a pitch point", "equal speeds need no gear")])
        line = other - pivot
        line = line / np.hypot(*line)
        return Contact(first, second, (pivot - ratio * other) / (1.0 - ratio), perp(line), -np.sign(ratio) * line)
    if coupling.kind != CAM:
        if way is None:
            raise SceneError([Fault(f"{path}.second", "a pin", "a slide on which the wheel rolls")])
        reach = -senses[0] * senses[1] * coupling.ratio
        return Contact(first, second, pivot + reach * perp(way), way, np.sign(reach) * perp(way))
    assert coupling.lift is not None
    cam_angle = poses.angle(joints[0].second).value - poses.angle(joints[0].first).value
    carried = senses[1] * lift_at(coupling.lift, cam_angle)[1]  # the lift's slope (m/rad, or 1) by the cam's coordinate
    if coupling.contact is not None:
        body, name = coupling.contact
        place = poses.point(body, linkage.link(body).point(name)).value
    elif way is not None:
        place = pivot + along(way, other - pivot) * way - senses[0] * carried * perp(way)
    else:
        raise SceneError([Fault(f"{path}.contact", "none", "a body and its point, for a follower that turns")])
    follower = carried * (perp(place - other) if way is None else way)
    sliding = follower - senses[0] * perp(place - pivot)
    speed = np.hypot(*sliding)
    surface = np.divide(sliding, speed, out=np.zeros_like(sliding), where=speed > 0)
    across = way if coupling.contact is None and way is not None else perp(surface)
    if not np.all(np.hypot(*across) > 0):
        worst = float(poses.q[np.argmin(np.hypot(*across))])
        found = f"a contact point that does not move against the cam at {worst:.9g}"
        raise SceneError([Fault(f"{path}.contact", found, "a point off the cam's axis")])
    outward = across * np.where(along(across, place - pivot) < 0, -1.0, 1.0)  # normal of the surface
    return Contact(first, second, place, outward, surface)
