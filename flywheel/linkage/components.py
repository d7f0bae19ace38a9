"""Components of every joint's reaction, as unit actions of its first body on its second, and the friction that follows them.

| joint | components | friction |
| --- | --- | --- |
| pin | x, y in the frame's axes (N) | couple r R mu/sqrt(1 + mu²) (N m), R the resultant: the friction circle |
| slide | normal (N) at second's point, a quarter turn from the guide's way; moment (N m) | force mu N along the guide |
| slide with a shoe of length L | the same; front and rear normals N/2 ± M/L at its two ends | mu (front + rear) |
| pin-in-slot | normal (N) | mu N along the slot |
| fixed | x, y (N), moment (N m) | - |
| gear, rolling | tangential (N) at the pitch point; radial = tangential tan(pressure angle), which parts the wheels | - |
| cam | normal (N), away from the cam's axis | mu N along the surface, at the contact point |

Friction opposes the motion of second on first; where that rests or turns back there is none: at rest it is not determined.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault, SceneError
from flywheel.linkage.contacts import Contact, contact
from flywheel.linkage.description import CAM, FIXED, PIN, SLIDE, Coupling, Joint
from flywheel.linkage.poses import Poses
from flywheel.linkage.wrenches import Pair, effort_pair, guide, index, pace, perp

Array = NDArray[np.float64]

_STILL = 1e-12  # share of the largest rate below which a rate is rounding, and the joint at rest

FORCE, COUPLE = "N", "N m"
DRIVE, FRICTION, RADIAL = "drive", "friction", "radial"


class Component(NamedTuple):
    """A component of a reaction: the joint's or coupling's name, its own, its unit, and the pair that a unit of it is."""

    joint: str
    name: str
    unit: str
    pair: Pair


class Passive(NamedTuple):
    """An action `factor` times the size of a reaction: friction, or what a tooth's inclined flank adds.

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
    _check_names(poses)
    components: list[Component] = []
    passives: list[Passive] = []
    for joint in linkage.joints:
        components += _of_joint(poses, joint)
        if friction and joint.friction:
            passives += _rubbing(poses, joint, forward)
    for coupling in linkage.couplings:
        found, more = _of_coupling(poses, coupling, forward, friction)
        components.append(found)
        passives += more
    driven = [linkage.joint(name) for name in drivers]
    components += [Component(j.name, DRIVE, COUPLE if j.kind == PIN else FORCE, effort_pair(poses, j)) for j in driven]
    return Unknowns(tuple(components), tuple(passives))


def _check_names(poses: Poses) -> None:
    names = [*(joint.name for joint in poses.linkage.joints), *(coupling.name for coupling in poses.linkage.couplings)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise SceneError(
            [Fault(f"{poses.linkage.path}.{name}", "two joints or couplings of that name", "one") for name in twice]
        )


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


def ends(joint: Joint) -> dict[str, Mapping[str, float]]:
    """The two normals of a slide's shoe by its normal and moment: N = front + rear, M = (front - rear) L/2."""
    if joint.kind != SLIDE or not joint.length:
        return {}
    lever = 1.0 / joint.length
    return {"front": {"normal": 0.5, "moment": lever}, "rear": {"normal": 0.5, "moment": -lever}}


def _rubbing(poses: Poses, joint: Joint, forward: Array) -> list[Passive]:
    """Coulomb's friction of a joint, against the motion of second on first."""
    path = f"{poses.linkage.path}.joints.{joint.name}"
    if joint.kind == FIXED:
        raise SceneError([Fault(f"{path}.friction", f"{joint.friction:.9g}", "none", "a fixed joint does not slide")])
    if joint.kind == PIN and not joint.radius > 0:
        raise SceneError([Fault(f"{path}.radius", f"{joint.radius:.9g} m", "the radius of a pin that has friction")])
    sense = _sense(pace(poses, joint), poses.rate[:, 2:] if joint.kind == PIN else poses.rate[:, :2]) * forward
    pair = effort_pair(poses, joint)
    if joint.kind == PIN:
        circle = joint.radius * joint.friction / float(np.hypot(1.0, joint.friction))
        return [Passive(joint.name, FRICTION, COUPLE, pair, -circle * sense, ({"x": 1.0}, {"y": 1.0}))]
    sizes = ends(joint).values() or ({"normal": 1.0},)
    return [Passive(joint.name, FRICTION, FORCE, pair, -joint.friction * sense, (size,)) for size in sizes]


def _sense(rate: Array, rates: Array) -> Array:
    """Sign of a rate; 0 where it is rounding beside the largest of its kind."""
    return np.where(np.abs(rate) > _STILL * np.abs(rates).max(initial=0.0), np.sign(rate), 0.0)


def _of_coupling(poses: Poses, coupling: Coupling, forward: Array, friction: bool) -> tuple[Component, list[Passive]]:
    """The force between the two bodies of a coupling, and what its friction or its pressure angle adds."""
    touch = contact(poses, coupling)
    still = np.zeros(poses.q.shape)
    push = Pair(touch.first, touch.second, touch.push, touch.at, still)
    side = Pair(touch.first, touch.second, touch.aside, touch.at, still)
    if coupling.kind == CAM:
        passives = []
        if friction and coupling.friction:
            sense = _cam_sense(poses, coupling) * forward
            passives.append(Passive(coupling.name, FRICTION, FORCE, side, -coupling.friction * sense, ({"normal": 1.0},)))
        return Component(coupling.name, "normal", FORCE, push), passives
    return Component(coupling.name, "tangential", FORCE, push), _inclined(poses, coupling, touch, side)


def _cam_sense(poses: Poses, coupling: Coupling) -> Array:
    joint = poses.linkage.joint(coupling.first)
    return _sense(pace(poses, joint), poses.rate[:, 2:])


def _inclined(poses: Poses, coupling: Coupling, touch: Contact, side: Pair) -> list[Passive]:
    if coupling.friction:
        path = f"{poses.linkage.path}.couplings.{coupling.name}.friction"
        raise SceneError([Fault(path, f"{coupling.friction:.9g}", "none", "at the pitch point nothing slides")])
    if not coupling.pressure_angle:
        return []
    slant = np.full(poses.q.shape, np.tan(abs(coupling.pressure_angle)))
    return [Passive(coupling.name, RADIAL, FORCE, side, slant, ({"tangential": 1.0},))]
