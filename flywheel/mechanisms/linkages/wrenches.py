"""Forces on the bodies of a linkage: loads that a user names, weights, inertia forces, and pairs of action and reaction.

A wrench is (force x, force y, moment about the body's centre of mass) in the frame's axes; wrenches of all bodies form an
array of shape (bodies, 3, n), the frame first. Forces in N, moments in N m.

Where two bodies of a gear pair, a rolling pair or a cam touch, and in which direction they push each other.

The pair's two joints share one body, the carrier. Seen from it the first body turns about its pin, the second turns about
another pin or slides along a guide, so that the contact follows from the coupling's ratio (or the lift's slope) alone.

Components of every joint's reaction, as unit actions of its first body on its second; friction adds its own to them.

| joint | components |
| --- | --- |
| pin | x, y in the frame's axes (N) |
| slide | normal (N) at second's point, a quarter turn from the guide's way; moment (N m) |
| pin-in-slot | normal (N) |
| fixed | x, y (N), moment (N m) |
| gear, rolling | tangential (N) at the pitch point; radial = tangential tan(pressure angle), which parts the wheels |
| cam | normal (N), away from the cam's axis |

Newton's and Euler's equations of every body as one linear system a position: sum F = m a_G, sum M_G = J alpha.

Unknowns are the components of all reactions and the driving actions. There are three equations a moving body; a mechanism
whose driver moves it without locking makes them independent, so that forces can always be found, however many components
there are. With more unknowns than equations (redundant constraints) those that the equations leave open are named.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.linkages.equations import lift_at, solved
from flywheel.mechanisms.linkages.friction import COUPLE, FORCE, FRICTION, Passive, Settled, of_joint, sense, settle
from flywheel.mechanisms.linkages.positions import Poses, Track
from flywheel.numerics.arguments import array, known, require, shown, vector
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import CAM, FIXED, GEAR, PIN, SLIDE, Coupling, Joint

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


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


def pace(poses: Poses, joint: Joint) -> Array:
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
    pull, found = np.array(vector("gravity", gravity, "m/s²")), np.zeros_like(poses.value)
    for k, link in enumerate(poses.linkage.links, 1):
        found[k, :2] = link.mass * pull[:, None]
    return found


def inertial(poses: Poses, speed: Array, acceleration: Array) -> Array:
    """D'Alembert's forces of all bodies, -m a_G and -J alpha, with a = g qddot + g' qdot²."""
    middle = centres(poses)
    motion = middle.rate * acceleration + middle.slope * speed**2
    links = (poses.linkage.ground, *poses.linkage.links)
    amounts = np.array([(link.mass, link.mass, link.inertia) for link in links])
    amounts[0] = 0.0
    return np.asarray(-amounts[:, :, None] * motion)


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
        return effort_pair(poses, joint).on_bodies(middle) * values(load.value, poses.q, f"{path}.value")
    body, found = load.body, np.zeros_like(middle)
    k = known(f"{path}.body", body, {name: k for k, name in enumerate(linkage.names)})
    if isinstance(load, Torque):
        found[k, 2] = values(load.value, poses.q, f"{path}.value")
        return found
    at = load.at
    if isinstance(at, str):
        at = known(f"{path}.at", at, {point.name: point[1:] for point in linkage.link(body).points})
    at = vector(f"{path}.at", at, "m")
    force = np.stack([values(part, poses.q, f"{path}.{axis}") for axis, part in (("x", load.x), ("y", load.y))])
    found[k, :2] = force
    found[k, 2] = cross(poses.point(body, at).value - middle[k, :2], force)
    return found


def values(given: ArrayLike, q: Array, path: str) -> Array:
    """A number, or one for every position, as an array (n,); SceneError for another shape or what is not finite."""
    found = array(path, given)
    if found.shape not in ((), (1,), q.shape):
        raise SceneError([Fault(path, f"an array of shape {found.shape}", f"a number or shape {q.shape}")])
    return np.broadcast_to(found, q.shape)


# -- contacts ----------------------------------------------------------------------------------------------------------


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
    assert coupling.lift is not None
    joint = poses.linkage.joint(coupling.first)
    cam_angle = poses.angle(joint.second).value - poses.angle(joint.first).value
    slope = lift_at(coupling.lift, cam_angle)[1]  # of the lift (m/rad, or 1) by the coordinate of the cam's pin
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
    across = seen.guide if coupling.contact is None and seen.guide is not None else perp(surface)
    if not np.all(np.hypot(*across) > 0):
        worst = float(poses.q[np.argmin(np.hypot(*across))])
        found = f"a contact point that does not move against the cam at {worst:.9g}"
        raise SceneError([Fault(f"{_path(poses, coupling)}.contact", found, "a point off the cam's axis")])
    outward = across * np.where(along(across, place - seen.pivot) < 0, -1.0, 1.0)  # normal of the surface
    return Contact(seen.first, seen.second, place, outward, surface)


# -- components --------------------------------------------------------------------------------------------------------


DRIVE, RADIAL = "drive", "radial"


class Component(NamedTuple):
    """A component of a reaction: the joint's or coupling's name, its own, its unit, and the pair that a unit of it is."""

    joint: str
    name: str
    unit: str
    pair: Pair


class Unknowns(NamedTuple):
    """All components of a linkage's reactions, driving actions last, and the passive actions that follow them."""

    components: tuple[Component, ...]
    passives: tuple[Passive, ...]


def unknowns(poses: Poses, drivers: Iterable[str], forward: Array, friction: bool) -> Unknowns:
    """The components of all joints and couplings, and the driving action of every joint in `drivers`.

    forward: sign of the driver's speed, (n,); where it is 0 nothing slides and there is no friction.
    """
    linkage = poses.linkage
    names = [*(joint.name for joint in linkage.joints), *(coupling.name for coupling in linkage.couplings)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        doubled = "two joints or couplings of that name"
        raise SceneError([Fault(f"{linkage.path}.{name}", doubled, "one") for name in twice])
    components: list[Component] = []
    passives: list[Passive] = []
    for joint in linkage.joints:
        components += _of_joint(poses, joint)
        if friction and joint.friction:
            rates = poses.rate[:, 2:] if joint.kind == PIN else poses.rate[:, :2]
            sliding = sense(pace(poses, joint), rates, forward)
            passives += of_joint(f"{linkage.path}.joints.{joint.name}", joint, effort_pair(poses, joint), sliding)
    for coupling in linkage.couplings:
        found, more = _of_coupling(poses, coupling, forward, friction)
        components.append(found)
        passives += more
    driven = [linkage.joint(name) for name in drivers]
    components += [Component(j.name, DRIVE, COUPLE if j.kind == PIN else FORCE, effort_pair(poses, j)) for j in driven]
    return Unknowns(tuple(components), tuple(passives))


def _of_joint(poses: Poses, joint: Joint) -> list[Component]:
    place = poses.point(joint.second, joint.second_at).value
    still, unit = np.zeros_like(place), np.ones(place.shape[1])
    bodies = index(poses, joint.first), index(poses, joint.second)
    moment = Component(joint.name, "moment", COUPLE, Pair(*bodies, still, place, unit))
    if joint.kind in (PIN, FIXED):
        axes = (("x", np.stack((unit, still[0]))), ("y", np.stack((still[0], unit))))
        pins = [Component(joint.name, name, FORCE, Pair(*bodies, axis, place, still[0])) for name, axis in axes]
        return pins if joint.kind == PIN else [*pins, moment]
    normal = Component(joint.name, "normal", FORCE, Pair(*bodies, perp(guide(poses, joint)), place, still[0]))
    return [normal, moment] if joint.kind == SLIDE else [normal]


def _of_coupling(poses: Poses, coupling: Coupling, forward: Array, friction: bool) -> tuple[Component, list[Passive]]:
    """The force between the two bodies of a coupling, and what its friction or its pressure angle adds."""
    touch = contact(poses, coupling)
    still = np.zeros(poses.q.shape)
    push = Pair(touch.first, touch.second, touch.push, touch.at, still)
    side = Pair(touch.first, touch.second, touch.aside, touch.at, still)
    if coupling.kind == CAM:
        passives = []
        if friction and coupling.friction:
            sliding = sense(pace(poses, poses.linkage.joint(coupling.first)), poses.rate[:, 2:], forward)
            passives.append(Passive(coupling.name, FRICTION, FORCE, side, -coupling.friction * sliding, ({"normal": 1.0},)))
        return Component(coupling.name, "normal", FORCE, push), passives
    if coupling.friction:
        path = f"{poses.linkage.path}.couplings.{coupling.name}.friction"
        raise SceneError([Fault(path, f"{coupling.friction:.9g}", "none", "at the pitch point nothing slides")])
    inclined = []
    if coupling.pressure_angle:
        slant = np.full(poses.q.shape, np.tan(abs(coupling.pressure_angle)))
        inclined.append(Passive(coupling.name, RADIAL, FORCE, side, slant, ({"tangential": 1.0},)))
    return Component(coupling.name, "tangential", FORCE, push), inclined


# -- statics -----------------------------------------------------------------------------------------------------------


OPEN = 1e-7
"""Share of the null space from which a component counts as open."""

_LOCKED = 1e-13  # of the largest singular value: below it the equations depend on one another


class Balance(NamedTuple):
    """Components in the order of the unknowns, (components, n): NaN where friction locks, one of many values where open.

    amounts: what the passive actions come to, (passives, n); others: wrenches of all that is no reaction, passive actions
    included, (bodies, 3, n); loose: which components are open, (components, n); open: an orthonormal basis of what can be
    added to the components without a load, (n, components, redundant); residual: of the equations as a share of
    the largest load, (n,).
    """

    values: Array
    amounts: Array
    others: Array
    loose: Flags
    open: Array
    settled: Settled
    residual: Array


class Scales(NamedTuple):
    """Equations of moments are divided by a length and unknown couples multiplied by it, so that all are forces."""

    rows: Array
    columns: Array


def solve(poses: Poses, unknowns: Unknowns, loads: Array) -> Balance:
    """All reactions and driving actions under `loads`, wrenches (bodies, 3, n) with the inertia forces among them."""
    middle = centres(poses).value
    matrix = _columns(unknowns.components, middle)
    passive = _columns(unknowns.passives, middle)
    right = loads[1:].reshape(-1, poses.q.size).T
    free = matrix.shape[1] - matrix.shape[2]
    if free > 0:
        found = f"{free} freedom(s) that nothing drives"
        raise SceneError([Fault(poses.linkage.path, found, "as many driven joints as degrees of freedom")])
    scales = _scales(unknowns.components, matrix)
    scaled = matrix * scales.columns / scales.rows[:, None]
    wanted = -np.concatenate((right[..., None], passive), axis=2) / scales.rows[:, None]
    response, space = _respond(scaled, wanted)
    loose = np.linalg.norm(space, axis=2) > OPEN
    wrong = ~np.isfinite(response).all(axis=(1, 2))
    if wrong.any():
        at = f"{float(poses.q[np.argmax(wrong)]):.9g} {'m' if poses.linkage.sliding else 'rad'}"
        found = f"forces without limit where {poses.linkage.driver} stands at {at}"
        raise SceneError([Fault(poses.linkage.path, found, "a position where the driver moves everything")])
    response = response * scales.columns[:, None]
    settled = _settled(poses, unknowns, response, loose)
    amounts = _factors(unknowns.passives, poses.q.size) * settled.sizes
    values = response[..., 0] + np.einsum("nmp,np->nm", response[..., 1:], amounts)
    whole = right + np.einsum("nrp,np->nr", passive, amounts)
    gap = (np.einsum("nrm,nm->nr", matrix, values) + whole) / scales.rows
    left, largest = np.abs(gap).max(axis=1), np.abs(whole / scales.rows).max(axis=1)
    residual = np.divide(left, largest, out=np.zeros_like(left), where=largest > 0)
    others = np.concatenate((np.zeros((1, *loads.shape[1:])), whole.T.reshape(-1, 3, poses.q.size)))
    values = np.where(settled.converged[:, None], values, np.nan)
    return Balance(values.T, amounts.T, others, loose.T, space, settled, residual)


def _columns(parts: tuple[Component, ...] | tuple[Passive, ...], middle: Array) -> Array:
    """Wrenches of unit actions on the moving bodies, shape (n, 3 bodies, parts)."""
    found = [part.pair.on_bodies(middle)[1:].reshape(-1, middle.shape[2]) for part in parts]
    empty = np.zeros((middle.shape[2], 3 * (len(middle) - 1), 0))
    return np.stack(found).transpose(2, 1, 0) if found else empty


def _factors(passives: tuple[Passive, ...], count: int) -> Array:
    return np.stack([passive.factor for passive in passives], axis=1) if passives else np.zeros((count, 0))


def _scales(components: tuple[Component, ...], matrix: Array) -> Scales:
    couples = np.array([component.unit == COUPLE for component in components])
    arms = np.abs(matrix[:, 2::3][:, :, ~couples])
    length = float(arms.max(initial=0.0)) or 1.0
    rows = np.ones(matrix.shape[1])
    rows[2::3] = length
    return Scales(rows, np.where(couples, length, 1.0))


def _respond(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Unknowns for each right side, of least norm where some are open, and the matrix's null space, (n, m, m - rows)."""
    rows, columns = matrix.shape[1:]
    if rows == columns:
        return solved(matrix, right), np.zeros((len(matrix), columns, 0))
    u, s, vh = np.linalg.svd(matrix)
    s = np.where(s > _LOCKED * s[:, :1], s, np.nan)
    found = vh[:, :rows].transpose(0, 2, 1) @ ((u.transpose(0, 2, 1) @ right) / s[..., None])
    return found, vh[:, rows:].transpose(0, 2, 1)


def _settled(poses: Poses, unknowns: Unknowns, response: Array, loose: Flags) -> Settled:
    """Sizes that the passive actions follow; SceneError where friction follows a component that is open."""
    index = {(c.joint, c.name): k for k, c in enumerate(unknowns.components)}
    forms = np.zeros((len(unknowns.passives), 2, len(unknowns.components)))
    faults = []
    for j, passive in enumerate(unknowns.passives):
        for k, form in enumerate(passive.forms):
            for name, weight in form.items():
                at = index[passive.joint, name]
                forms[j, k, at] = weight
                if loose[:, at].any() and np.any(passive.factor):
                    found = f"{passive.name} that follows the {name}, which redundant constraints leave open"
                    advice = "take the friction away, or the constraint that is one too many"
                    path = f"{poses.linkage.path}.{passive.joint}"
                    faults.append(Fault(path, found, "a force that the equations determine", advice))
    if faults:
        raise SceneError(dict.fromkeys(faults))
    return settle(response[..., 0], response[..., 1:], _factors(unknowns.passives, poses.q.size), forms)
