"""Newton's and Euler's equations of every body as one linear system a position: sum F = m a_G, sum M_G = J alpha.

Unknowns are the driving actions and the components of every joint's reaction, as unit actions of its first body on its
second. There are three equations a moving body; a mechanism whose driver moves it without locking makes them independent,
so that forces always exist, however many components there are. With more unknowns than equations (redundant
constraints) those that the equations leave open are named.

| joint | components | size that friction follows | Coulomb's friction |
| --- | --- | --- | --- |
| pin | x, y in the frame's axes (N) | resultant R of x and y | couple r R mu/sqrt(1 + mu²) (N m): the friction circle |
| slide | normal (N) at second's point, a quarter turn from the guide's way; moment (N m) | normal N | mu N along the guide |
| slide with a shoe of length L | the same | normals N/2 ± M/L at its two ends | mu (front + rear) |
| pin-in-slot | normal (N) | normal N | mu N along the slot |
| fixed | x, y (N), moment (N m) | | |
| gear, rolling | tangential (N) at the pitch point; radial = tangential tan(pressure angle), which parts the wheels | | |
| cam | normal (N), away from the cam's axis | normal N | mu N along the surface, at the contact point |

Friction opposes the motion of second on first; where that rests or reverses there is none: at rest it is not determined.
Without friction the reactions are x0; unit passive actions add a response G, so that

    x = x0 + G (f * s(x)),   s_j(x) = |B_j x|

with s_j the size of the reaction that passive action j follows, f_j its factor. s is homogeneous of degree one,
s = s'(x) x, so that Newton's step needs the sizes y = s alone: (1 - s' G f) y = s' x0.

A wrench is (force x, force y, moment about the body's centre of mass) in the frame's axes; wrenches of all bodies form an
array of shape (bodies, 3, n), the frame first. Forces in N, moments in N m.

Also where two bodies of a gear pair, a rolling pair or a cam touch, and in which direction they push each other (`contact`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.linkages.equations import Poses, Track, lift_at, solved
from flywheel.numerics.faults import Fault, SceneError, array, brief, entry, require, vector
from flywheel.scene.linkage import CAM, FIXED, GEAR, PIN, SLIDE, Coupling, Joint

__all__ = [
    "COUPLE", "DRIVE", "FORCE", "FRICTION", "OPEN", "RADIAL", "Component", "Contact", "Effort", "Force", "Friction", "Load",
    "Pair", "Passive", "ReactionBalance", "Response", "Sizes", "Torque", "Unknowns", "along", "applied", "balance",
    "centres", "contact", "continued_sizes", "coulomb", "cross", "direction", "effort_pair", "friction_power",
    "friction_sizes", "guide", "index", "inertial", "joint_rate", "masses", "perp", "response", "shoe_ends", "size_forms",
    "unknowns", "values_at", "velocity", "weights",
]  # fmt: skip

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FORCE, COUPLE = "N", "N m"
DRIVE, RADIAL, FRICTION = "drive", "radial", "friction"

OPEN = 1e-7
"""Share of the null space from which a component counts as open."""

_LOCKED = 1e-13  # of the largest singular value: below it the equations depend on one another
_STILL = 1e-12  # share of the largest rate below which a rate is rounding, and the joint at rest
_LIMIT = 30
_RESIDUAL_SETTLED = 1e-12  # residual, as a share of the largest size, at which the iteration stops
_TOLERATED = 1e-11  # and where it still counts as converged: rounding
_SETTLED = 1e-15  # of the largest size: a change after which the iteration of forces that keep their signs stops
_SQUARED = 1e-9  # change after which one more step is the last
_LOST = 1e-9  # and its greatest value then
_NO_LENGTH = float(np.finfo(float).tiny)  # N, of a force that has no direction
_STAGES = np.linspace(0.1, 1.0, 10)  # in which friction is raised where Newton's iteration alone fails


# -- forces on bodies -------------------------------------------------------------------------------------------------


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
    """Effort of a spring, motor or cylinder in a joint, from its first body on its second, along its coordinate.

    A torque (N m) in a pin, a force (N) in a slide or a pin in a slot; a number or shape (n,).
    """

    joint: str
    value: ArrayLike


Load = Force | Torque | Effort


class Pair(NamedTuple):
    """An action of one body on another, and its reaction: a force (2, n) at one place (2, n), and a couple (n,).

    first, second: indices of bodies; the force and the couple act from first on second.
    """

    first: int
    second: int
    force: Array
    at: Array
    couple: Array

    def on_bodies(self, centres: Array) -> Array:
        """Wrenches on all bodies, shape (bodies, 3, n), with centres of mass at `centres` (bodies, >= 2, n)."""
        wrenches = np.zeros((len(centres), 3, self.at.shape[1]))
        for sign, body in ((-1.0, self.first), (1.0, self.second)):
            wrenches[body, :2] += sign * self.force
            wrenches[body, 2] += sign * (cross(self.at - centres[body, :2], self.force) + self.couple)
        return wrenches


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

    Along a guide it is the velocity of second's point relative to the matter of first there, s' = d · (v2 - v1).
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
        raise SceneError([Fault("loads", brief(loads), "a list of Force, Torque and Effort")])
    middle = centres(poses).value
    wrenches, faults = np.zeros_like(middle), list[Fault]()
    for k, load in enumerate(loads):
        try:
            wrenches += _applied(poses, middle, load, f"loads[{k}]")
        except SceneError as error:
            faults += error.faults
    if faults:
        raise SceneError(faults)
    return wrenches


def _applied(poses: Poses, middle: Array, load: Load, path: str) -> Array:
    require(path, load, (Force, Torque, Effort), "a Force, Torque or Effort")
    linkage = poses.linkage
    if isinstance(load, Effort):
        joint = entry(f"{path}.joint", load.joint, {j.name: j for j in linkage.joints if j.kind != FIXED})
        return effort_pair(poses, joint).on_bodies(middle) * values_at(load.value, poses.q, f"{path}.value")
    body, wrenches = load.body, np.zeros_like(middle)
    k = entry(f"{path}.body", body, {name: k for k, name in enumerate(linkage.names)})
    if isinstance(load, Torque):
        wrenches[k, 2] = values_at(load.value, poses.q, f"{path}.value")
        return wrenches
    at = load.at
    if isinstance(at, str):
        at = entry(f"{path}.at", at, {point.name: point[1:] for point in linkage.link(body).points})
    at = vector(f"{path}.at", at, "m")
    force = np.stack([values_at(part, poses.q, f"{path}.{axis}") for axis, part in (("x", load.x), ("y", load.y))])
    wrenches[k, :2] = force
    wrenches[k, 2] = cross(poses.point(body, at).value - middle[k, :2], force)
    return wrenches


def values_at(numbers: ArrayLike, q: Array, path: str) -> Array:
    """A number, or one for every position, as an array (n,); SceneError for another shape or infinite values."""
    values = array(path, numbers)
    if values.shape not in ((), (1,), q.shape):
        raise SceneError([Fault(path, f"an array of shape {values.shape}", f"a number or shape {q.shape}")])
    return np.broadcast_to(values, q.shape)


class Contact(NamedTuple):
    """A contact at `at` (2, n), where body `first` pushes body `second` with a positive force along `push` (2, n).

    aside: unit vectors (2, n). Of teeth: the way in which the pressure angle inclines second's force. Of a cam: along its
        surface, as second slides on first when the cam's coordinate grows; 0 if it does not slide.
    couple: of a belt, which turns second by a couple alone, 1 (n,).
    """

    first: int
    second: int
    at: Array
    push: Array
    aside: Array
    couple: Array | None = None


def contact(poses: Poses, coupling: Coupling) -> Contact:
    """The contact of a coupling; SceneError where no body is common to its joints, or where there is no contact.

    The pair's two joints share one body, the carrier. Seen from it the first body turns about its pin, the second turns
    about another pin or slides along a guide, so that the contact follows from the coupling's ratio (or the lift's slope)
    alone.

    Gear: teeth meet at the pitch point P = (c1 - rho c2)/(1 - rho), where the wheels' relative velocity vanishes, rho being
    the second wheel's speed over the first's. The force is positive along the common tangent, a quarter turn from c1 -> c2.
    Teeth press the wheels apart: second along c1 -> c2 outside (rho < 0), against it inside.

    Belt: at rho = 1 there is no such point. A belt or chain between equal wheels turns the second one by a couple, whose
    reaction turns the first one back; the pull of both strands on the pins is left out.

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
        defect = f"joints {coupling.first} and {coupling.second} without a body in common"
        raise SceneError([Fault(path, defect, "joints of one carrier, for forces to be found")])
    senses = [1.0 if joint.first == carrier else -1.0 for joint in joints]  # +1 if the carrier is first
    ends = [(j.second, j.second_at) if j.first == carrier else (j.first, j.first_at) for j in joints]
    first, second = (index(poses, body) for body, _ in ends)
    pivot, other = (poses.point(body, at).value for body, at in ends)
    way = None if joints[1].kind == PIN else guide(poses, joints[1])
    if coupling.kind == GEAR:
        ratio = coupling.ratio * senses[0] * senses[1]
        if ratio == 1.0:
            if coupling.pressure_angle:
                raise SceneError(
                    [Fault(f"{path}.pressure_angle", "one at a ratio of 1", "none", "a belt has no tooth flanks")]
                )
            still = np.zeros_like(pivot)
            return Contact(first, second, 0.5 * (pivot + other), still, still, np.ones(still.shape[1]))
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
        defect = f"a contact point that does not move against the cam at {worst:.9g}"
        raise SceneError([Fault(f"{path}.contact", defect, "a point off the cam's axis")])
    outward = across * np.where(along(across, place - pivot) < 0, -1.0, 1.0)  # normal of the surface
    return Contact(first, second, place, outward, surface)


# -- components and passive actions -----------------------------------------------------------------------------------


class Component(NamedTuple):
    """A component of a reaction: the joint's or coupling's name, its own, its unit, and the pair of actions for one unit."""

    joint: str
    name: str
    unit: str
    pair: Pair


class Passive(NamedTuple):
    """An action `factor` times the size of a reaction: friction, or the share due to a tooth's inclined flank.

    The size is the root of the sum of squares of `forms`, each a weighted sum of the joint's components by name.
    `factor` has shape (n,) and unit 1, or m for a couple.
    """

    joint: str
    name: str
    unit: str
    pair: Pair
    factor: Array
    forms: tuple[Mapping[str, float], ...]


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

    def sense(joint: Joint) -> Array:
        """Sign (n,) of a joint's speed; 0 if its rate is rounding beside the largest of its kind."""
        rates = poses.rate[:, 2:] if joint.kind == PIN else poses.rate[:, :2]
        rate = joint_rate(poses, joint)
        return np.where(np.abs(rate) > _STILL * np.abs(rates).max(initial=0.0), np.sign(rate), 0.0) * forward

    components: list[Component] = []
    passives: list[Passive] = []
    for joint in linkage.joints:
        components += _of_joint(poses, joint)
        if friction and joint.friction:
            passives += _friction(f"{linkage.path}.joints.{joint.name}", joint, effort_pair(poses, joint), sense(joint))
    for coupling in linkage.couplings:
        sliding = sense(linkage.joint(coupling.first)) if friction and coupling.friction else None
        component, more = _of_coupling(poses, coupling, sliding)
        components.append(component)
        passives += more
    driven = [linkage.joint(name) for name in drivers]
    components += [Component(j.name, DRIVE, COUPLE if j.kind == PIN else FORCE, effort_pair(poses, j)) for j in driven]
    return Unknowns(tuple(components), tuple(passives))


def _of_joint(poses: Poses, joint: Joint) -> list[Component]:
    """The components of a joint's reaction."""
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


def _friction(path: str, joint: Joint, pair: Pair, sliding: Array) -> list[Passive]:
    """Coulomb's friction of a joint, from the pair of a unit effort along its coordinate and the sense of its motion (n,).

    Raises:
        SceneError: for a fixed joint with friction, and for a pin without radius.

    """
    if joint.kind == FIXED:
        raise SceneError([Fault(f"{path}.friction", f"{joint.friction:.9g}", "none", "a fixed joint does not slide")])
    if joint.kind == PIN and not joint.radius > 0:
        raise SceneError([Fault(f"{path}.radius", f"{joint.radius:.9g} m", "the radius of a pin that has friction")])
    action = COUPLE if joint.kind == PIN else FORCE
    return [Passive(joint.name, FRICTION, action, pair, -size * sliding, sizes) for size, sizes in coulomb(joint)]


def coulomb(joint: Joint) -> list[tuple[float, tuple[Mapping[str, float], ...]]]:
    """Coulomb's friction of a joint: its size by that of the reaction it follows, and that reaction's components.

    A pin of radius r: a couple r R sin(atan mu) = r R mu/sqrt(1 + mu²). Others: mu N, for each end of a shoe with a length.

    >>> coulomb(Joint("guide", SLIDE, "frame", "ram", "O", "P", friction=0.1))
    [(0.1, ({'normal': 1.0},))]
    """
    if joint.kind == PIN:
        return [(joint.radius * joint.friction / float(np.hypot(1.0, joint.friction)), ({"x": 1.0}, {"y": 1.0}))]
    return [(joint.friction, (size,)) for size in shoe_ends(joint).values() or ({"normal": 1.0},)]


def shoe_ends(joint: Joint) -> dict[str, Mapping[str, float]]:
    """The two normals of a slide's shoe by its normal and moment: N = front + rear, M = (front - rear) L/2."""
    if joint.kind != SLIDE or not joint.length:
        return {}
    lever = 1.0 / joint.length
    return {"front": {"normal": 0.5, "moment": lever}, "rear": {"normal": 0.5, "moment": -lever}}


def _of_coupling(poses: Poses, coupling: Coupling, sliding: Array | None) -> tuple[Component, list[Passive]]:
    """The force between the bodies of a coupling, and the actions by its friction (if it slides) or pressure angle."""
    touch = contact(poses, coupling)
    still = np.zeros(poses.q.shape)
    push = Pair(touch.first, touch.second, touch.push, touch.at, still if touch.couple is None else touch.couple)
    side = Pair(touch.first, touch.second, touch.aside, touch.at, still)
    if coupling.kind == CAM:
        normal = Component(coupling.name, "normal", FORCE, push)
        if sliding is None:
            return normal, []
        return normal, [Passive(coupling.name, FRICTION, FORCE, side, -coupling.friction * sliding, ({"normal": 1.0},))]
    if touch.couple is not None:
        return Component(coupling.name, "moment", COUPLE, push), []
    if coupling.friction:
        path = f"{poses.linkage.path}.couplings.{coupling.name}.friction"
        raise SceneError([Fault(path, f"{coupling.friction:.9g}", "none", "at the pitch point nothing slides")])
    slant = np.full(poses.q.shape, np.tan(abs(coupling.pressure_angle)))
    inclined = Passive(coupling.name, RADIAL, FORCE, side, slant, ({"tangential": 1.0},))
    return Component(coupling.name, "tangential", FORCE, push), [inclined] if coupling.pressure_angle else []


# -- the system of equations ------------------------------------------------------------------------------------------


class Sizes(NamedTuple):
    """Sizes that passive actions follow, shape (n, passives), and how the iteration went.

    iterations: Newton steps of the slowest position; gap: the residual s(x) - y, as a share of the largest size, (n,);
    converged: False if no solution continues the one without friction, (n,): the mechanism locks itself.
    """

    sizes: Array
    iterations: int
    gap: Array
    converged: Flags


class ReactionBalance(NamedTuple):
    """Components in the order of the unknowns, (components, n): NaN if friction locks, one of many values where open.

    amounts: values of the passive actions, (passives, n); others: wrenches of everything but reactions, passive actions
    included, (bodies, 3, n); loose: which components are open, (components, n); open: an orthonormal basis of what can be
    added to the components without a load, (n, components, redundant); residual: of the equations as a share of the largest
    load, (n,).
    """

    values: Array
    amounts: Array
    others: Array
    loose: Flags
    open: Array
    sizes: Sizes
    residual: Array


class Response(NamedTuple):
    """Response of the unknowns to k loads and to a unit of every passive action, at n positions.

    values: shape (n, components, k + passives); loose, open: which components are open, and what can be added to them
    (see `ReactionBalance`); matrix: of the equations, (n, 3 bodies, components); scales: of its rows, which make all forces.
    """

    values: Array
    loose: Flags
    open: Array
    matrix: Array
    scales: Array


def response(poses: Poses, unknowns: Unknowns, loads: Array) -> Response:
    """Reactions and driving actions under each of k loads alone, wrenches (k, bodies, 3, n), then under passive actions.

    Equations of moments are divided by a length and unknown couples multiplied by it, so that all are forces.

    Raises:
        SceneError: for freedoms that nothing drives, and for a position where the driver cannot move the other bodies.

    """
    count, path = poses.q.size, poses.linkage.path
    middle = centres(poses).value
    matrix, passive = _columns(unknowns.components, middle), _columns(unknowns.passives, middle)
    right = loads[:, 1:].reshape(len(loads), -1, count).transpose(2, 1, 0)
    rows, columns = matrix.shape[1:]
    if rows > columns:
        defect = f"{rows - columns} freedom(s) that nothing drives"
        raise SceneError([Fault(path, defect, "as many driven joints as degrees of freedom")])
    couples = np.array([component.unit == COUPLE for component in unknowns.components])
    length = float(np.abs(matrix[:, 2::3][:, :, ~couples]).max(initial=0.0)) or 1.0
    row_scales, column_scales = np.tile((1.0, 1.0, length), rows // 3), np.where(couples, length, 1.0)
    scaled = matrix * column_scales / row_scales[:, None]
    right_sides = -np.concatenate((right, passive), axis=2) / row_scales[:, None]
    if rows == columns:
        values, space = solved(scaled, right_sides), np.zeros((count, columns, 0))
    else:  # unknowns of least norm, and the matrix's null space
        u, s, vh = np.linalg.svd(scaled)
        s = np.where(s > _LOCKED * s[:, :1], s, np.nan)
        values = vh[:, :rows].transpose(0, 2, 1) @ ((u.transpose(0, 2, 1) @ right_sides) / s[..., None])
        space = vh[:, rows:].transpose(0, 2, 1)
    wrong = ~np.isfinite(values).all(axis=(1, 2))
    if wrong.any():
        at = f"{float(poses.q[np.argmax(wrong)]):.9g} {'m' if poses.linkage.sliding else 'rad'}"
        defect = f"forces without limit where {poses.linkage.driver} stands at {at}"
        raise SceneError([Fault(path, defect, "a position in which the driver moves all bodies")])
    loose = np.linalg.norm(space, axis=2) > OPEN
    return Response(values * column_scales[:, None], loose, space, matrix, row_scales)


def balance(poses: Poses, unknowns: Unknowns, loads: Array) -> ReactionBalance:
    """All reactions and driving actions under `loads`, wrenches (bodies, 3, n) with the inertia forces among them."""
    count, passives = poses.q.size, unknowns.passives
    responses = response(poses, unknowns, loads[None])
    free, pull = responses.values[..., 0], responses.values[..., 1:]
    factors = np.stack([one.factor for one in passives], axis=1) if passives else np.zeros((count, 0))
    forms = size_forms(poses, unknowns, responses.loose)
    followed = np.einsum("pkm,nmj->npkj", forms, pull) * factors[:, None, None, :]
    sizes = friction_sizes(np.einsum("pkm,nm->npk", forms, free), followed)
    amounts = factors * sizes.sizes
    values = free + np.einsum("nmp,np->nm", pull, amounts)
    passive = _columns(passives, centres(poses).value)
    total = loads[1:].reshape(-1, count).T + np.einsum("nrp,np->nr", passive, amounts)
    left = np.abs((np.einsum("nrm,nm->nr", responses.matrix, values) + total) / responses.scales).max(axis=1)
    largest = np.abs(total / responses.scales).max(axis=1)
    residual = np.divide(left, largest, out=np.zeros_like(left), where=largest > 0)
    others = np.concatenate((np.zeros((1, *loads.shape[1:])), total.T.reshape(-1, 3, count)))
    values = np.where(sizes.converged[:, None], values, np.nan)
    return ReactionBalance(values.T, amounts.T, others, responses.loose.T, responses.open, sizes, residual)


def _columns(parts: tuple[Component, ...] | tuple[Passive, ...], middle: Array) -> Array:
    """Wrenches of unit actions on the moving bodies, shape (n, 3 bodies, parts)."""
    wrenches = [part.pair.on_bodies(middle)[1:].reshape(-1, middle.shape[2]) for part in parts]
    empty = np.zeros((middle.shape[2], 3 * (len(middle) - 1), 0))
    return np.stack(wrenches).transpose(2, 1, 0) if wrenches else empty


def size_forms(poses: Poses, unknowns: Unknowns, loose: Flags) -> Array:
    """Linear forms of the sizes that passive actions follow, (passives, 2, components); none may follow an open one."""
    index = {(c.joint, c.name): k for k, c in enumerate(unknowns.components)}
    forms = np.zeros((len(unknowns.passives), 2, len(unknowns.components)))
    faults = []
    for j, passive in enumerate(unknowns.passives):
        for k, form in enumerate(passive.forms):
            for name, weight in form.items():
                at = index[passive.joint, name]
                forms[j, k, at] = weight
                if loose[:, at].any() and np.any(passive.factor):
                    defect = f"{passive.name} that follows the {name}, which redundant constraints leave open"
                    advice = "take the friction away, or the constraint that is one too many"
                    path = f"{poses.linkage.path}.{passive.joint}"
                    faults.append(Fault(path, defect, "a force that the equations determine", advice))
    if faults:
        raise SceneError(dict.fromkeys(faults))
    return forms


# -- friction ---------------------------------------------------------------------------------------------------------


def friction_sizes(free: Array, pull: Array) -> Sizes:
    """Sizes y = |free + pull y| of the forces that passive actions follow, on the branch that starts without friction.

    Args:
        free: forces without passive actions, (x, y) of a resultant or (normal, 0), shape (n, p, 2).
        pull: the change of these forces by a unit of each size, (n, p, 2, p).

    A solution is taken only where det(1 - s' G f) > 0, as on the branch that starts at 1 without friction: past its root
    friction would have to push.

    A shoe of 0.1 m, tilted by a load of 10 N that is out of line by 0.02 m, with mu = 0.2: F = 10 + 2 mu F 0.02/0.1.

    >>> friction = friction_sizes(np.array([[[10.0, 0.0]]]), np.array([[[[0.08], [0.0]]]]))
    >>> friction.sizes.round(9).tolist(), friction.converged.tolist()
    ([[10.869565217]], [True])

    """
    count, passives = free.shape[:2]
    if not passives:
        return Sizes(np.zeros((count, 0)), 0, np.zeros(count), np.ones(count, dtype=bool))
    sizes = _newton(free, pull, np.hypot(*np.moveaxis(free, 2, 0)))
    wrong = ~sizes.converged
    if not wrong.any():
        return sizes
    start, steps = np.hypot(*np.moveaxis(free[wrong], 2, 0)), sizes.iterations
    for share in _STAGES:
        again = _newton(free[wrong], share * pull[wrong], start)
        start, steps = np.where(again.converged[:, None], again.sizes, start), steps + again.iterations
    sizes.sizes[wrong], sizes.gap[wrong], sizes.converged[wrong] = again.sizes, again.gap, again.converged
    return sizes._replace(iterations=steps)


def _newton(free: Array, pull: Array, start: Array) -> Sizes:
    """Newton's iteration from sizes `start`: (1 - s' pull) y = s' free."""
    sizes, steps, unit = start, 0, np.eye(start.shape[1])
    gap, determinant = np.full(len(free), np.inf), np.ones(len(free))
    largest = np.linalg.norm(free, axis=2).max(axis=1)
    parts = free + np.einsum("npkj,nj->npk", pull, sizes)
    while steps < _LIMIT and np.any(gap > _RESIDUAL_SETTLED):
        steps += 1
        size = np.linalg.norm(parts, axis=2, keepdims=True)
        along = np.divide(parts, size, out=np.zeros_like(parts), where=size > 0)  # 0 if a size is 0
        matrix = unit - np.einsum("npk,npkj->npj", along, pull)
        determinant = np.linalg.det(matrix)
        matrix[np.abs(determinant) < 1e-14] = unit
        sizes = np.linalg.solve(matrix, (along * free).sum(axis=2)[..., None])[..., 0]
        parts = free + np.einsum("npkj,nj->npk", pull, sizes)
        scale = np.maximum(np.abs(sizes).max(axis=1), largest)
        left = np.abs(np.linalg.norm(parts, axis=2) - sizes).max(axis=1)
        gap = np.divide(left, scale, out=np.zeros_like(left), where=scale > 0)
    return Sizes(sizes, steps, gap, (gap <= _TOLERATED) & (determinant > 1e-14))


def continued_sizes(
    free: Array, pull: Array, curved: Flags, signs: Array, lines: Array | None = None, start: Array | None = None
) -> tuple[Array, Array]:
    """Sizes y as by `friction_sizes` where forces keep their signs, and the matrix 1 - s' pull that they solve.

    Then all is linear except for resultants (`curved`, of the p forces), whose errors Newton's iteration squares each time.

    Args:
        free: as in `friction_sizes`.
        pull: as in `friction_sizes`.
        curved: which forces are resultants, (p,).
        signs: of the others, (n, p).
        lines: directions (rad) of resultants that keep to a line and may pass zero there, NaN of others, (n, p).
        start: sizes to begin with, (n, p); those without friction if None.

    Returns:
        sizes, NaN of an instant without a solution, and negative of a force that turned against its sign; the matrix.

    """
    one, bends = np.eye(free.shape[1]), bool(curved.any())
    along, across, pull_along, pull_across = free[..., 0], free[..., 1], pull[:, :, 0], pull[:, :, 1]
    x, y = along, across
    if bends and start is not None:
        x, y = along + (pull_along @ start[:, :, None])[..., 0], across + (pull_across @ start[:, :, None])[..., 0]
    lines = np.full_like(signs, np.nan) if lines is None else lines
    lined = bends and bool(np.isfinite(lines).any())
    cosine, sine = (np.cos(lines), np.sin(lines)) if lined else (lines, lines)
    length, unit, normal = np.hypot(x, y) if bends else across, signs, np.zeros_like(signs)
    gap, most = np.inf, 0.0
    for _ in range(_LIMIT):
        if bends:
            back = np.where(x * cosine + y * sine < 0.0, -1.0, 1.0) if lined else 1.0  # 1 if there is no line
            share = back / np.maximum(length, _NO_LENGTH)
            unit, normal = np.where(curved, x * share, signs), np.where(curved, y * share, 0.0)
        matrix = one - (unit[:, :, None] * pull_along + normal[:, :, None] * pull_across)
        try:
            sizes = np.asarray(np.linalg.solve(matrix, (unit * along + normal * across)[..., None])[..., 0])
        except np.linalg.LinAlgError:
            sizes = np.full_like(signs, np.nan)
        if gap <= _SQUARED * most or not bends:
            return sizes, matrix
        x = along + (pull_along @ sizes[:, :, None])[..., 0]
        y = across + (pull_across @ sizes[:, :, None])[..., 0]
        length = np.hypot(x, y)
        gap, most = float((np.abs(length - np.abs(sizes)) * curved).max()), float(np.abs(sizes).max())
        if gap <= _SETTLED * most:
            return sizes, matrix
    return (sizes if gap <= _LOST * most else np.full_like(sizes, np.nan)), matrix


class Friction(NamedTuple):
    """Friction in the joints, and its cost in iterations.

    moment: its share of the reduced moment M* (N m; N where the driver slides): the driving action grows by -moment.
    iterations: Newton steps of the slowest position, 0 if nothing had to be iterated; gap: relative change that the
    last one left, (n,); converged: False if friction locks the mechanism, (n,): there is no result there.
    lever: the greatest moment if every joint is pressed with 1 N, (n,), in m (1 if the driver slides).
    """

    moment: Array
    iterations: int
    gap: Array
    converged: Flags
    lever: Array


def friction_power(poses: Poses, passives: Iterable[Passive], amounts: Array, sizes: Sizes) -> Friction:
    """Friction's power by unit speed of the driver, and how the iteration went; amounts of the passive actions, (p, n)."""
    middle = centres(poses)
    moment, lever = np.zeros(len(sizes.gap)), np.zeros(len(sizes.gap))
    for passive, amount in zip(passives, amounts, strict=True):
        if passive.name == FRICTION:
            way = np.einsum("bin,bin->n", passive.pair.on_bodies(middle.value), middle.rate)
            moment, lever = moment + amount * way, lever + np.abs(passive.factor * way)
    return Friction(moment, sizes.iterations, sizes.gap, sizes.converged, lever)
