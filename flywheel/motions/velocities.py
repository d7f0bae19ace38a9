"""Velocities by instant centres: of every point of a scene's mechanisms, and those by influence coefficients.

The two are independent: the centre of a body comes from the velocity of one of its points and its angular rate, and gives
the velocity of every other one as omega r, across the ray from the centre.

A body's velocity field is v(p) = v_o + theta' J (p - o), with J (x, y) = (-y, x). Two of them agree at

    P = r + J (v_j(r) - v_i(r))/(theta_j' - theta_i')        for any point r,

the relative centre; with the frame as body i it is the absolute one, about which body j turns: v(p) = theta_j' J (p - P).
Where the bodies turn alike their relative motion is a translation and the centre lies at infinity, across it. A pin is
always the centre of its two bodies; that of a guide is always at infinity, perpendicular to it.

Rates are those by the driver's coordinate (influence coefficients): centres depend on position alone, not on speed.

Source: J. E. Shigley, J. J. Uicker, Theory of Machines and Mechanisms, McGraw-Hill 1980, chapter 3 (theorem of Aronhold
and Kennedy: the three centres of three bodies lie on one line); for the slider-crank v = omega l PB/PA, P that of the rod.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.machine.machine import Machine, scene_of
from flywheel.machine.reactions import poses_of
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkages.equations import Poses, Track
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError, array, entry, require
from flywheel.regime import state
from flywheel.scene.linkage import FIXED, FRAME, PIN, SLIDE, Joint, Point
from flywheel.scene.scene import Mechanism, Scene

FINITE, INFINITE, ANYWHERE = "finite", "at infinity", "no relative motion"
_ROUNDINGS = 32  # roundings of the sizes that a centre is made of


class InstantCentre(NamedTuple):
    """The instant centre of two bodies at n positions; the frame is the first body of an absolute one.

    kind: shape (n,), one of `finite`, `at infinity` and `no relative motion`, where every point is one.
    place: x, y (m) in the frame's axes, shape (2, n); NaN if it is not finite.
    direction: angle (rad, from -pi/2 to pi/2) of the lines that meet at a centre at infinity, across the relative
        translation, shape (n,); NaN elsewhere.
    rate: angular rate of the second body less that of the first, by the driver's coordinate, shape (n,).
    error: estimated absolute error of the place (m), or of the direction (rad), shape (n,).
    permanent: True if it is that of a joint: a pin is the centre, a guide has it at infinity, a weld leaves no motion.
    """

    first: str
    second: str
    kind: NDArray[np.str_]
    place: Array
    direction: Array
    rate: Array
    error: Array
    permanent: bool

    @property
    def absolute(self) -> bool:
        """True if the first body is the frame, so that the second turns about this centre."""
        return self.first == FRAME


class _RelativeMotion(NamedTuple):
    """Relative motion of two bodies: its rate (n,), its velocity (2, n) at a place (2, n); and both rounding errors.

    These follow from the sizes of the subtracted terms, shape (n,) each.
    """

    rate: Array
    velocity: Array
    place: Array
    rate_rounding: Array
    velocity_rounding: Array


@np.errstate(all="ignore")
def centres_of(poses: Poses, others: Sequence[Poses] = ()) -> dict[tuple[str, str], InstantCentre]:
    """The centres of every two bodies, absolute ones first, by the names of the two.

    Args:
        poses: of a linkage at n positions.
        others: the same computed otherwise (such as with lengths changed by a few roundings): the difference is the error by
        rounding. Without them errors include only rounding in the evaluation.

    A centre counts as one at infinity where the relative rate is not above its own error. The error of a distant centre is
    large: it grows with the square of its distance.

    >>> from flywheel.mechanisms.linkage import linkage_of
    >>> from flywheel.mechanisms.linkages.positions import solve
    >>> from flywheel.scene.scene import Mechanism
    >>> press = Mechanism("slider-crank", "press", geometry={"crank.length": 3.0, "rod.length": 5.0})
    >>> centres = centres_of(solve(linkage_of(press), 0.0, 7.0).poses([0.0, np.arctan2(4, 3)]))
    >>> centres["frame", "rod"].place[:, 0].round(9).tolist()
    [8.0, 0.0]
    >>> shared = centres["crank", "slider"].place  # O P across the slider's travel: v = omega |OP|
    >>> np.hypot(*shared).round(9).tolist()
    [0.0, 3.384875226]

    """
    require("poses", poses, Poses, "Poses")
    names = poses.linkage.names
    return {(first, second): _centre(poses, others, first, second) for first, second in combinations(names, 2)}


def _centre(poses: Poses, others: Sequence[Poses], first: str, second: str) -> InstantCentre:
    field, fields = _field(poses, first, second), [_field(other, first, second) for other in others]
    # the joint that makes the centre of two bodies a permanent one: a pin, a guide or a weld between them
    between = [joint for joint in poses.linkage.joints if {joint.first, joint.second} == {first, second}]
    joint = next((joint for kind in (FIXED, SLIDE, PIN) for joint in between if joint.kind == kind), None)
    rate_error = _apart(field.rate, [other.rate for other in fields]) + field.rate_rounding
    velocity_error = _apart(field.velocity, [other.velocity for other in fields]).max(axis=0) + field.velocity_rounding
    speed = np.hypot(*field.velocity)
    turning = np.abs(field.rate) > rate_error
    moving = turning | (speed > velocity_error)
    if joint is not None:
        turning, moving = np.full_like(turning, joint.kind == PIN), np.full_like(moving, joint.kind != FIXED)
    place = _place(poses, field, joint)
    off = np.hypot(*_apart(place, [_place(other, own, joint) for other, own in zip(others, fields, strict=True)]))
    off = off + _ROUNDINGS * ROUNDING * np.hypot(*field.place)
    if joint is None:
        off = off + (field.velocity_rounding + speed / np.abs(field.rate) * field.rate_rounding) / np.abs(field.rate)
    direction = _direction(poses, field, joint)
    turns = [_direction(other, own, joint) - direction for other, own in zip(others, fields, strict=True)]
    tilt = 2 * np.max([np.abs((turn + np.pi / 2) % np.pi - np.pi / 2) for turn in turns], axis=0, initial=0.0)
    tilt = tilt + _ROUNDINGS * ROUNDING + (field.velocity_rounding / speed if joint is None else 0.0)
    return InstantCentre(
        first,
        second,
        np.where(turning, FINITE, np.where(moving, INFINITE, ANYWHERE)),
        np.where(turning, place, np.nan),
        np.where(moving & ~turning, direction, np.nan),
        field.rate,
        np.where(turning, off, np.where(moving, tilt, np.nan)),
        joint is not None,
    )


def _field(poses: Poses, first: str, second: str) -> _RelativeMotion:
    """The motion of the second body relative to the first, at the origin of the second."""
    origin = Point("origin")
    own, base = poses.point(second, origin), poses.point(first, origin)
    turn, rate = poses.angle(first).rate, poses.angle(second).rate
    gap = own.value - base.value
    swept = turn * np.stack((-gap[1], gap[0]))
    turning = np.abs(poses.rate[:, 2]).max(axis=0)  # what rounding leaves of a rate is a share of the fastest body's
    reach = np.hypot(*own.value) + np.hypot(*base.value)  # places are known to roundings of these
    moving = np.hypot(*own.rate) + np.hypot(*base.rate) + turning * reach
    rounding = _ROUNDINGS * ROUNDING
    return _RelativeMotion(rate - turn, own.rate - base.rate - swept, own.value, rounding * turning, rounding * moving)


def _place(poses: Poses, field: _RelativeMotion, joint: Joint | None) -> Array:
    """P = r + J v/theta' (m), wherever it lies; a pin's own place."""
    if joint is not None and joint.kind == PIN:
        return poses.point(joint.first, joint.first_at).value
    return np.asarray(field.place + np.stack((-field.velocity[1], field.velocity[0])) / field.rate)


def _direction(poses: Poses, field: _RelativeMotion, joint: Joint | None) -> Array:
    """Angle (rad, from -pi/2 to pi/2) across the relative velocity, or across a guide."""
    x, y = field.velocity
    angle = np.arctan2(x, -y)
    if joint is not None and joint.kind == SLIDE:
        angle = poses.angle(joint.first).value + joint.direction + np.pi / 2
    return np.asarray(angle - np.pi * np.ceil(angle / np.pi - 0.5))


def _apart(figures: Array, others: Sequence[Array]) -> Array:
    """Twice the difference between figures and the same figures found by another route."""
    apart = np.max([np.abs(other - figures) for other in others], axis=0) if others else np.zeros_like(figures)
    return np.asarray(2 * apart)


def velocity(poses: Poses, body: str, at: Point | tuple[float, float], centre: InstantCentre) -> tuple[Array, Array]:
    """Velocity of a point of a body by its absolute centre, theta' J (p - P), per unit of the driver; and its error.

    Of a body that translates it is that of any of its points; of one that stands still, zero.

    Args:
        poses: of the linkage.
        body: its name.
        at: the point, in the body's frame (m).
        centre: the body's absolute centre at the same positions.

    Returns:
        x and y, shape (2, n); and the estimated absolute error, shape (n,).

    """
    entry("body", body, dict.fromkeys(poses.linkage.names))
    point: Track = poses.point(body, at)
    arm = point.value - centre.place
    turned = centre.rate * np.stack((-arm[1], arm[0]))
    translation = poses.point(body, Point("origin")).rate
    kinds = np.broadcast_to(centre.kind, turned.shape)
    velocities = np.where(kinds == FINITE, turned, np.where(kinds == INFINITE, translation, 0.0))
    off = np.abs(centre.rate) * np.nan_to_num(centre.error) + _ROUNDINGS * ROUNDING * np.hypot(*velocities)
    return velocities, off


Array = NDArray[np.float64]


class PointVelocity(NamedTuple):
    """Velocity of a point, x and y of shape (2, n): omega r about its body's centre, and g times the driver's rate.

    `error` is the estimated absolute error of the one by the centre, shape (n,).
    """

    name: str
    body: str
    by_centre: Array
    by_coefficients: Array
    error: Array


class Centres(NamedTuple):
    """The instant centres of a mechanism at n positions, and the velocities of its points by them.

    `poses` are those of its bodies; `centres` by the names of two bodies, the frame first; `rate` is that of the mechanism's
    own driver, per unit of the machine's driver or per second, shape (n,).
    """

    poses: Poses
    centres: Mapping[tuple[str, str], InstantCentre]
    velocities: tuple[PointVelocity, ...]
    rate: Array


class InstantCentres(NamedTuple):
    """The instant centres of every mechanism with joints, by its name, at the driver's coordinates q (rad or m).

    `speed` are the driver's rates (rad/s or m/s), shape (n,); None if velocities are per unit of the driver.
    """

    scene: Scene
    q: Array
    speed: Array | None
    mechanisms: Mapping[str, Centres]


def instant_centres(machine: Machine | Scene, q: ArrayLike, *, speed: ArrayLike | None = None) -> InstantCentres:
    """Instant centres of every two bodies of every mechanism, and velocities of all points by them.

    Centres depend on position alone; their errors are computed like those of
    `flywheel.motion`: computed again with positions and lengths changed by a few roundings.

    Args:
        machine: a `Scene`, or a `Machine` of one.
        q: crank angles (rad), taken modulo the cycle; on a stroke the driver's coordinates (rad or m), any shape.
        speed: of the driver (rad/s or m/s), one or as many as q; velocities are per unit of the driver if None.

    Raises:
        SceneError: for a scene without a mechanism that has joints, for positions that are no numbers or outside the stroke.

    >>> import flywheel
    >>> press = {"type": "slider-crank", "crank": {"length": 3.0}, "rod": {"length": 5.0}}
    >>> scene = flywheel.load({"mechanism": press, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    >>> mechanism = instant_centres(scene, [0.0]).mechanisms["slider-crank"]
    >>> mechanism.centres["frame", "rod"].place.round(9).tolist()
    [[8.0], [0.0]]

    """
    scene = scene_of(machine)
    require("scene", scene, Scene, "a Scene, or a Machine")
    positions = np.atleast_1d(array("q", q)).ravel()
    if not positions.size:
        raise SceneError([Fault("q", "no position", "one at least")])
    rates = None if speed is None else array("speed", speed).ravel()
    if rates is not None and rates.size not in (1, positions.size):
        raise SceneError([Fault("speed", f"{rates.size} speeds", f"one, or {positions.size} as there are positions")])
    rate = np.ones(positions.size) if rates is None else np.broadcast_to(rates, positions.shape)
    jointed = [mechanism for mechanism in scene.mechanisms if has_joints(mechanism)]
    if not jointed:
        bare = ", ".join(mechanism.type for mechanism in scene.mechanisms) or "no mechanism"
        raise SceneError([Fault("mechanism", bare, "a mechanism with bodies, which have instant centres")])
    own = state.own_coordinate(scene, positions)
    aside = [state.beside(own, np.full_like(own, 0.5 * scene.cycle), scene.cycle, share) for share in (1.0, 0.4)]
    centres = {}
    for mechanism in jointed:
        ratio = scene.shafts[mechanism.shaft]
        others = []
        for other, at in zip(state.mechanisms_rounded_otherwise((mechanism,)), aside, strict=True):
            try:
                others.append(poses_of(other[0], ratio * at + mechanism.phase))
            except SceneError:  # at the very limit of what can be assembled
                others.append(poses_of(mechanism, ratio * at + mechanism.phase))
        poses = poses_of(mechanism, ratio * own + mechanism.phase)
        centres[mechanism.name] = _centres(mechanism, poses, others, ratio * rate)
    return InstantCentres(scene, positions, None if rates is None else rate, centres)


def _centres(mechanism: Mechanism, poses: Poses, others: list[Poses], rate: Array) -> Centres:
    linkage = poses.linkage
    centres = centres_of(poses, others)
    velocities = []
    for link in linkage.links:
        points = [*link.points] + ([Point("com", *link.com)] if link.mass else [])
        for point in points:
            by_centre, error = velocity(poses, link.name, point, centres[FRAME, link.name])
            own = poses.point(link.name, point).rate
            apart = [np.hypot(*(other.point(link.name, point).rate - own)) for other in others]
            error = error + 2 * np.max(apart, axis=0)
            name = f"{link.name}.{point.name}"
            velocities.append(PointVelocity(name, link.name, rate * by_centre, rate * own, np.abs(rate) * error))
    return Centres(poses, centres, tuple(velocities), rate)
