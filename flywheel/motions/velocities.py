"""Velocities by instant centres: of every point of a scene's mechanisms, and those by influence coefficients.

The two are independent: the centre of a body comes from the velocity of one of its points and its angular rate, and gives
the velocity of every other one as omega r, across the ray from the centre.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.machine.machine import Machine, scene_of
from flywheel.machine.reactions import poses_of
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.instant_centres import InstantCentre, centres_of, velocity
from flywheel.numerics import arguments
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import state
from flywheel.scene.linkage import FRAME, Point
from flywheel.scene.scene import Mechanism, Scene

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

    Centres lie at positions alone; their errors are found as those of
    `flywheel.motion`: computed again with positions and lengths changed by a few roundings.

    Args:
        machine: a `Scene`, or a `Machine` of one.
        q: crank angles (rad), taken modulo the cycle; on a stroke the driver's coordinates (rad or m), any shape.
        speed: of the driver (rad/s or m/s), one or as many as q; velocities are per unit of the driver if None.

    Raises:
        SceneError: for a scene without a mechanism that has joints, for positions that are no numbers or not there.

    >>> import flywheel
    >>> press = {"type": "slider-crank", "crank": {"length": 3.0}, "rod": {"length": 5.0}}
    >>> scene = flywheel.load({"mechanism": press, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    >>> found = instant_centres(scene, [0.0]).mechanisms["slider-crank"]
    >>> found.centres["frame", "rod"].place.round(9).tolist()
    [[8.0], [0.0]]

    """
    scene = scene_of(machine)
    arguments.require("scene", scene, Scene, "a Scene, or a Machine")
    wanted = np.atleast_1d(arguments.array("q", q)).ravel()
    if not wanted.size:
        raise SceneError([Fault("q", "no position", "one at least")])
    given = None if speed is None else arguments.array("speed", speed).ravel()
    if given is not None and given.size not in (1, wanted.size):
        raise SceneError([Fault("speed", f"{given.size} speeds", f"one, or {wanted.size} as there are positions")])
    rate = np.ones(wanted.size) if given is None else np.broadcast_to(given, wanted.shape)
    jointed = [mechanism for mechanism in scene.mechanisms if has_joints(mechanism)]
    if not jointed:
        bare = ", ".join(mechanism.type for mechanism in scene.mechanisms) or "no mechanism"
        raise SceneError([Fault("mechanism", bare, "a mechanism with bodies, which have instant centres")])
    own = state.own_coordinate(scene, wanted)
    aside = [state.beside(own, np.full_like(own, 0.5 * scene.cycle), scene.cycle, share) for share in (1.0, 0.4)]
    found = {}
    for mechanism in jointed:
        ratio = scene.shafts[mechanism.shaft]
        others = []
        for other, at in zip(state.mechanisms_rounded_otherwise((mechanism,)), aside, strict=True):
            try:
                others.append(poses_of(other[0], ratio * at + mechanism.phase))
            except SceneError:  # at the very limit of what can be assembled
                others.append(poses_of(mechanism, ratio * at + mechanism.phase))
        found[mechanism.name] = _centres(mechanism, poses_of(mechanism, ratio * own + mechanism.phase), others, ratio * rate)
    return InstantCentres(scene, wanted, None if given is None else rate, found)


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
