"""Curves of all moving quantities of a machine: bodies, joints, points, centres of mass, slides, shafts.

Every motion is computed once over the driver's coordinate q: the position x, the influence coefficient g = dx/dq and
g' = d²x/dq². With the driver's rate and acceleration they give v = g q̇ and a = g q̈ + g' q̇².
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.reactions import solution_of
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.families import build, has_joints
from flywheel.mechanisms.linkages.equations import Track
from flywheel.motions.motion import DriverMotion
from flywheel.numerics.cells import ROUNDING, middles
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import state
from flywheel.scene.linkage import CRANK, PIN, SLIDE, SLOT, straight
from flywheel.scene.scene import TURN, Mechanism, Scene

Array = NDArray[np.float64]

ANGLE, POINT, WAY = "angle", "point", "slide"
UNITS = {ANGLE: "rad", POINT: "m", WAY: "m"}
POINTS = 361


class MovingPlace(NamedTuple):
    """Moving quantity: an angle (rad), a point (x and y, m) or the displacement of a slide (m), with g and g'.

    `unit` (m, or 1 of angles) and `per` (m, or 1 of a driver that turns) are the scales of its rounding.
    """

    kind: str
    track: Track
    unit: float = 1.0
    per: float = 1.0


def places(
    scene: Scene, mechanisms: Sequence[Mechanism], own: Array, anchor: Array
) -> tuple[dict[str, MovingPlace], dict[str, str]]:
    """All moving quantities at own coordinates (rad or m, from the machine's start), by name; and other names of them.

    anchor: inside the smooth piece that every coordinate belongs to, where a law decides its branches.
    """
    all_places: dict[str, MovingPlace] = {}
    other: dict[str, str] = {}
    sliding = scene.sliding
    if not (sliding and mechanisms):
        for name, ratio in {scene.reduction_element: 1.0, **scene.shafts}.items():
            if not sliding or name == scene.reduction_element:
                value = ratio * (own + scene.origin)
                all_places[name] = MovingPlace(WAY if sliding else ANGLE, Track(value, ratio + 0.0 * own, 0.0 * own))
    for mechanism in mechanisms:
        ratio = scene.shafts[mechanism.shaft]
        psi, middle = ratio * own + mechanism.phase, ratio * anchor + mechanism.phase
        if mechanism.outputs:
            moving, names = _outputs(mechanism, psi, middle, scene.parameters), dict[str, str]()
        else:
            moving, names = _bodies_and_joints(mechanism, psi)
        prefix = f"{mechanism.name}."
        turns_so = mechanism.shaft == CRANK and mechanism.phase == scene.origin
        for name, place in moving.items():
            alone = len(mechanisms) == 1 and (name not in scene.shafts or (name == CRANK and turns_so))
            other[f"{prefix}{name}"] = title = name if alone else f"{prefix}{name}"
            track = Track(place.track.value, ratio * place.track.rate, ratio**2 * place.track.slope)
            all_places.setdefault(title, place._replace(track=track))
        other |= {f"{prefix}{name}": other[f"{prefix}{of}"] for name, of in names.items()}
    ends = [name.partition(".")[2] for name in other]
    bare = {name.partition(".")[2]: of for name, of in other.items() if ends.count(name.partition(".")[2]) == 1}
    return all_places, {name: of for name, of in (bare | other).items() if name not in all_places}


def _outputs(mechanism: Mechanism, psi: Array, anchor: Array, parameters: Mapping[str, float]) -> dict[str, MovingPlace]:
    """The outputs of a law."""
    family = build(mechanism, parameters)
    position, outputs = family.position(psi, np, anchor), {}
    sizes = family.position(np.linspace(0.0, mechanism.period, POINTS, endpoint=False), np)
    for output in mechanism.outputs:
        jet = position.jet(output.name)
        value = family.ports[output.name].position(position)
        track = Track(*(part + 0.0 * psi for part in (value, jet.first, jet.second)))
        size = float(np.max(np.abs(sizes.jet(output.name).value + 0.0)))
        outputs[output.name] = MovingPlace(
            ANGLE if output.rotating else WAY, track, max(size, 1.0) if output.rotating else size
        )
    return outputs


def _bodies_and_joints(mechanism: Mechanism, psi: Array) -> tuple[dict[str, MovingPlace], dict[str, str]]:
    """Bodies, joints, points and ports of a mechanism with joints; and other names of the same."""
    solution, period = solution_of(mechanism)
    linkage, unit = solution.linkage, solution.unit
    turns = 0.0 * psi if period is None else np.floor(psi / period)
    own = np.clip(psi, solution.low, solution.high) if period is None else psi - period * turns
    poses = solution.poses(own)
    gained = dict.fromkeys(linkage.names, 0.0)
    if period is not None:
        ends = solution.poses(np.array([0.0, period])).value[:, 2]
        gained = dict(zip(linkage.names, (TURN * np.round((ends[:, 1] - ends[:, 0]) / TURN)).tolist(), strict=True))
    all_places: dict[str, MovingPlace] = {}
    other: dict[str, str] = {}

    def put(name: str, kind: str, track: Track, gain: float = 0.0) -> str:
        while name in all_places:
            name = f"{name}.place"
        track = track._replace(value=track.value + gain * turns) if gain else track
        all_places[name] = MovingPlace(kind, track, 1.0 if kind == ANGLE else unit, solution.scale)
        return name

    guides, moving = straight(linkage.joints), [link for link in linkage.links if link.name]
    for link in moving:
        if link.name not in guides:
            put(link.name, ANGLE, poses.angle(link.name), gained[link.name])
    at: dict[tuple[str, str], str] = {}
    for joint in linkage.joints:
        first, second = (joint.first, joint.first_at), (joint.second, joint.second_at)
        if joint.kind in (SLIDE, SLOT):
            put(joint.name, WAY, solution.coordinate(joint.name, poses))
            place = put(f"{joint.name}.place", POINT, poses.point(*second))
        else:
            place = put(joint.name, POINT, poses.point(*first))
            at[first[0], first[1].name] = place
        at[second[0], second[1].name] = place
        if joint.kind in (PIN, SLOT):
            a, b = poses.angle(joint.first), poses.angle(joint.second)
            turn = Track(*(y - x for x, y in zip(a, b, strict=True)))
            put(f"{joint.name}.angle", ANGLE, turn, gained[joint.second] - gained[joint.first])
    for link in moving:
        if link.mass or link.com != (0.0, 0.0):
            put(f"{link.name}.com", POINT, poses.centre(link.name))
    for link in (linkage.ground, *moving):
        for point in link.points:
            if (link.name, point.name) in at:
                other[f"{link.name}.{point.name}"] = at[link.name, point.name]
            else:
                put(f"{link.name}.{point.name}", POINT, poses.point(link.name, point))
    for port in mechanism.points:
        seen = poses.point(port.body, linkage.link(port.body).point(port.point))
        axis = np.array([[np.cos(port.direction)], [np.sin(port.direction)]])
        put(port.name, WAY, Track(*((part * axis).sum(axis=0) for part in seen)))
    other |= dict(KINDS[mechanism.type].guides)
    for joint in linkage.joints:
        if joint.kind == SLIDE and joint.second in guides and joint.first == linkage.names[0]:
            other.setdefault(joint.second, joint.name)
    for name in guides - other.keys() - all_places.keys():
        put(name, ANGLE, poses.angle(name), gained[name])
    return all_places, {name: of for name, of in other.items() if name not in all_places}


def edges_of(scene: Scene) -> Array:
    """Own coordinates between which everything moves smoothly: 0, switches of laws and of cams' lifts, the cycle."""
    cycle = scene.cycle
    pieces = [np.array([0.0, cycle])]
    for mechanism in scene.mechanisms:
        if KINDS[mechanism.type].smooth(mechanism):
            continue
        breaks = np.array(build(mechanism, scene.parameters).breakpoints)
        ratio = scene.shafts[mechanism.shaft]
        period = solution_of(mechanism)[1] if has_joints(mechanism) else mechanism.period
        if period is None:
            pieces.append((breaks - mechanism.phase) / ratio)
        else:
            turns = np.arange(-1.0, np.ceil(ratio * cycle / period) + 2.0)
            pieces.append(((breaks[:, None] + period * turns - mechanism.phase) / ratio).ravel())
    edges = np.concatenate(pieces)
    edges = np.unique(edges[(edges >= 0.0) & (edges <= cycle)])
    return np.asarray(edges[np.append(True, np.diff(edges) > 64 * ROUNDING * cycle)])


class MotionCurve(NamedTuple):
    """Position, velocity and acceleration of one thing over a motion.

    `kind` is "angle", "point" or "slide" and `unit` that of the position, rad or m. Of n positions of the driver, angles and
    slides have arrays of shape (n,), points (2, n): x and y along the frame's axes. Velocity and acceleration are per unit
    of the driver (g, g') or per second. `parts` are those of the acceleration that come from the driver's acceleration and
    from its speed, g q̈ and g' q̇² (0 and g' per unit of the driver). `errors` are estimated absolute errors of position,
    velocity and acceleration.
    """

    name: str
    kind: str
    unit: str
    position: Array
    velocity: Array
    acceleration: Array
    parts: tuple[Array, Array]
    errors: tuple[Array, Array, Array]

    @property
    def speed(self) -> Array:
        """The amount of the velocity, (n,)."""
        return amount(self.velocity)

    @property
    def total(self) -> Array:
        """The amount of the acceleration, (n,)."""
        return amount(self.acceleration)

    @property
    def tangential(self) -> Array:
        """A point's acceleration along its velocity, (n,); NaN if it stands still, and has no direction."""
        return self._along(self.velocity)

    @property
    def normal(self) -> Array:
        """A point's acceleration to the left of its velocity, v²/radius of its path, (n,); NaN if it stands still."""
        return self._along(np.stack((-self.velocity[1], self.velocity[0])))

    @property
    def direction_error(self) -> Array:
        """Estimated error of the tangential and of the normal acceleration, (n,): their own and the direction's."""
        speed, off = amount(self.velocity), amount(self.errors[1])
        turned = np.divide(2 * off, speed, out=np.full_like(speed, np.nan), where=speed > off)
        return np.asarray(amount(self.errors[2]) + turned * self.total)

    def _along(self, direction: Array) -> Array:
        if self.kind != POINT:
            raise SceneError([Fault(self.name, f"one of kind {self.kind}", "a point, which has a path")])
        speed = amount(direction)
        still = speed <= amount(self.errors[1])
        return np.where(still, np.nan, (direction * self.acceleration).sum(axis=0) / np.where(still, 1.0, speed))


def amount(vector: Array) -> Array:
    """Size of an angle's rate, (n,), or of a point's vector, (2, n)."""
    return np.abs(vector) if vector.ndim == 1 else np.hypot(vector[0], vector[1])


class Moving:
    """Moving quantities of a scene: at coordinates of the driver, and computed again with other roundings."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.edges = edges_of(scene)
        self.others = state.mechanisms_rounded_otherwise(scene.mechanisms)

    def _own(self, q: Array) -> tuple[Array, Array]:
        """The machine's own coordinates, and the middles of the pieces that they lie in."""
        scene = self.scene
        if scene.stroke is not None:
            own = state.own_coordinate(scene, q)
            return own, np.asarray(middles(self.edges, own))
        turns = np.floor(q / scene.cycle) * scene.cycle
        return q, turns + middles(self.edges, q - turns)

    def places(self, q: Array) -> tuple[dict[str, MovingPlace], dict[str, str]]:
        """All moving places, by name, and other names of them."""
        return places(self.scene, self.scene.mechanisms, *self._own(q))

    def errors(self, q: Array, curves: Mapping[str, MovingPlace]) -> dict[str, tuple[Array, Array, Array]]:
        """Estimated absolute errors of x, g and g': computed again with positions and lengths changed by a few roundings."""
        own, anchor = self._own(q)
        size, again = max(self.scene.cycle, float(np.abs(q).max())), []
        for mechanisms, share in zip(self.others, (1.0, 0.4), strict=True):
            aside = state.beside(own, anchor, size, share)
            try:
                again.append(places(self.scene, mechanisms, aside, anchor)[0])
            except SceneError:  # at the very limit of what can be assembled
                again.append(places(self.scene, self.scene.mechanisms, aside, anchor)[0])
        floor = state.ROUNDINGS * ROUNDING
        return {
            name: tuple(
                state.spread(part, [other[name].track[k] for other in again]) + floor * place.unit / place.per**k
                for k, part in enumerate(place.track)
            )
            for name, place in curves.items()
        }

    def curves(self, driver: DriverMotion) -> tuple[dict[str, MotionCurve], dict[str, str]]:
        """Position, velocity and acceleration of everything as the driver moves, with errors; other names of them."""
        curves, other = self.places(driver.q)
        errors = self.errors(driver.q, curves)
        off = driver.errors[1] + 0.0 * driver.q
        if off.any():  # the driver's own place is not known better
            for side in (-1.0, 1.0):
                q = driver.q + side * off
                stroke = self.scene.stroke
                beside = self.places(q if stroke is None else np.clip(q, stroke.start, stroke.end))[0]
                for name, (_, track, *_) in curves.items():
                    for error, there, here in zip(errors[name], beside[name].track, track, strict=True):
                        error += np.abs(there - here)
        return {name: _curve(name, place, errors[name], driver) for name, place in curves.items()}, other

    def plain(self, driver: DriverMotion, names: Sequence[str]) -> dict[str, tuple[Array, Array, Array]]:
        """Position, velocity and acceleration of some curves, without errors."""
        curves = self.places(driver.q)[0]
        return {name: _moved(curves[name].track, driver)[:3] for name in names}


def _moved(track: Track, driver: DriverMotion) -> tuple[Array, Array, Array, tuple[Array, Array]]:
    """Place, velocity g q̇, acceleration g q̈ + g' q̇² and its two parts; x, g, g' per unit of the driver."""
    x, g, bend = track
    if driver.rate is None or driver.acceleration is None:
        return x, g, bend, (0.0 * g, bend)
    parts = g * driver.acceleration, bend * driver.rate**2
    return x, g * driver.rate, parts[0] + parts[1], parts


def _curve(name: str, place: MovingPlace, errors: tuple[Array, Array, Array], driver: DriverMotion) -> MotionCurve:
    """A curve with its errors, from those of position, g, g' and of the driver's motion."""
    x, v, a, parts = _moved(place.track, driver)
    if driver.rate is None or driver.acceleration is None:
        return MotionCurve(name, place.kind, UNITS[place.kind], x, v, a, parts, errors)
    (_, g, bend), (of_x, of_g, of_bend) = place.track, errors
    size, speeding, (_, _, slower, less) = np.abs(driver.rate), np.abs(driver.acceleration), driver.errors
    apart = (
        of_x,
        of_g * size + (np.abs(g) + of_g) * slower,
        of_g * speeding
        + of_bend * size**2
        + (np.abs(g) + of_g) * less
        + (np.abs(bend) + of_bend) * (2 * size + slower) * slower
        + state.ROUNDINGS * ROUNDING * (np.abs(parts[0]) + np.abs(parts[1])),
    )
    return MotionCurve(name, place.kind, UNITS[place.kind], x, v, a, parts, apart)
