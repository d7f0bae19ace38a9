"""Position, velocity and acceleration of everything in a machine: bodies, joints, points, centres of mass, slides, shafts.

What moves is found once, against the driver's coordinate q: its place x, the influence coefficient g = dx/dq and
g' = d²x/dq². With the driver's rate and acceleration they give v = g q̇ and a = g q̈ + g' q̇².
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.machine.machine import Machine
from flywheel.machine.reactions import solution_of
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.families import build
from flywheel.mechanisms.linkages.positions import Track
from flywheel.numerics import arguments
from flywheel.numerics.cells import ROUNDING, middles
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import state
from flywheel.scene.linkage import PIN, SLIDE, SLOT, straight
from flywheel.scene.scene import TURN, Mechanism, Scene

Array = NDArray[np.float64]

ANGLE, POINT, WAY = "angle", "point", "slide"
UNITS = {ANGLE: "rad", POINT: "m", WAY: "m"}
DRIVER, TIME = "driver", "time"
DRIVERS = ("t", "q", "rate", "acceleration")
POINTS = 361

# -- what moves, against the driver's coordinate ---------------------------------------------------------------------


class Place(NamedTuple):
    """What moves with the driver: an angle (rad), a point (x and y, m) or the way of a slide (m), with g and g'.

    `unit` (m, or 1 of angles) and `per` (m, or 1 of a driver that turns) are sizes that its rounding is counted in.
    """

    kind: str
    track: Track
    unit: float = 1.0
    per: float = 1.0


def places(
    scene: Scene, mechanisms: Sequence[Mechanism], own: Array, anchor: Array
) -> tuple[dict[str, Place], dict[str, str]]:
    """Everything that moves at own coordinates (rad or m, from where the machine's begin), by name; and other names of it.

    anchor: inside the smooth piece that every coordinate belongs to, where a law decides its branches.
    """
    found: dict[str, Place] = {}
    other: dict[str, str] = {}
    sliding = scene.reduction_element == "slide"
    if not (sliding and mechanisms):
        for name, ratio in {scene.reduction_element: 1.0, **scene.shafts}.items():
            if not sliding or name == scene.reduction_element:
                value = ratio * (own + scene.origin)
                found[name] = Place(WAY if sliding else ANGLE, Track(value, ratio + 0.0 * own, 0.0 * own))
    for mechanism in mechanisms:
        ratio = scene.shafts[mechanism.shaft]
        psi, middle = ratio * own + mechanism.phase, ratio * anchor + mechanism.phase
        if mechanism.type == "law":
            moving, names = _outputs(mechanism, psi, middle, scene.parameters), dict[str, str]()
        else:
            moving, names = _bodies_and_joints(mechanism, psi)
        prefix = f"{mechanism.name}."
        for name, place in moving.items():
            track = Track(place.track.value, ratio * place.track.rate, ratio**2 * place.track.slope)
            other[f"{prefix}{name}"] = title = _free(
                name if len(mechanisms) == 1 else f"{prefix}{name}", found, track, prefix
            )
            found[title] = place._replace(track=track)
        other |= {f"{prefix}{name}": other[f"{prefix}{of}"] for name, of in names.items()}
    ends = [name.partition(".")[2] for name in other]
    bare = {name.partition(".")[2]: of for name, of in other.items() if ends.count(name.partition(".")[2]) == 1}
    return found, {name: of for name, of in (bare | other).items() if name not in found}


def _free(name: str, taken: Mapping[str, Place], track: Track, prefix: str) -> str:
    """The name, with its mechanism's before it where it is that of a shaft that turns otherwise."""
    if name not in taken or all(np.array_equal(a, b) for a, b in zip(taken[name].track, track, strict=True)):
        return name
    return prefix + name


def _outputs(mechanism: Mechanism, psi: Array, anchor: Array, parameters: Mapping[str, float]) -> dict[str, Place]:
    """The outputs of a law."""
    family = build(mechanism, parameters)
    position, found = family.position(psi, np, anchor), {}
    sizes = family.position(np.linspace(0.0, mechanism.period, POINTS, endpoint=False), np)
    for output in mechanism.outputs:
        jet = position.jet(output.name)
        value = family.ports[output.name].position(position)
        track = Track(*(part + 0.0 * psi for part in (value, jet.first, jet.second)))
        size = float(np.max(np.abs(sizes.jet(output.name).value + 0.0)))
        found[output.name] = Place(ANGLE if output.rotating else WAY, track, max(size, 1.0) if output.rotating else size)
    return found


def _bodies_and_joints(mechanism: Mechanism, psi: Array) -> tuple[dict[str, Place], dict[str, str]]:
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
    found: dict[str, Place] = {}
    other: dict[str, str] = {}

    def put(name: str, kind: str, track: Track, gain: float = 0.0) -> str:
        while name in found:
            name = f"{name}.place"
        track = track._replace(value=track.value + gain * turns) if gain else track
        found[name] = Place(kind, track, 1.0 if kind == ANGLE else unit, solution.scale)
        return name

    held, moving = straight(linkage.joints), [link for link in linkage.links if link.name]
    for link in moving:
        if link.name not in held:
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
        if joint.kind == SLIDE and joint.second in held and joint.first == linkage.names[0]:
            other.setdefault(joint.second, joint.name)
    for name in held - other.keys() - found.keys():
        put(name, ANGLE, poses.angle(name), gained[name])
    return found, {name: of for name, of in other.items() if name not in found}


def edges_of(scene: Scene) -> Array:
    """Own coordinates between which everything moves smoothly: 0, where a law or a cam's lift goes over, the cycle."""
    cycle = scene.cycle
    found = [np.array([0.0, cycle])]
    for mechanism in scene.mechanisms:
        cams = mechanism.linkage is not None and any(pair.lift is not None for pair in mechanism.linkage.couplings)
        if mechanism.type != "law" and not cams:
            continue
        breaks = np.array(build(mechanism, scene.parameters).breakpoints)
        ratio = scene.shafts[mechanism.shaft]
        period = mechanism.period if mechanism.type == "law" else solution_of(mechanism)[1]
        if period is None:
            found.append((breaks - mechanism.phase) / ratio)
        else:
            turns = np.arange(-1.0, np.ceil(ratio * cycle / period) + 2.0)
            found.append(((breaks[:, None] + period * turns - mechanism.phase) / ratio).ravel())
    edges = np.concatenate(found)
    edges = np.unique(edges[(edges >= 0.0) & (edges <= cycle)])
    return np.asarray(edges[np.append(True, np.diff(edges) > 64 * ROUNDING * cycle)])


# -- the record --------------------------------------------------------------------------------------------------------


class Curve(NamedTuple):
    """Position, velocity and acceleration of one thing over a motion.

    `kind` is "angle", "point" or "slide" and `unit` that of the position, rad or m. Of n positions of the driver, angles and
    slides have arrays of shape (n,), points (2, n): x and y along the frame's axes. Velocity and acceleration are per unit
    of the driver (g, g') or per second. `parts` are those of the acceleration that come from the driver's acceleration and from
    its speed, g q̈ and g' q̇² (0 and g' per unit of the driver). `errors` are estimated absolute errors of position,
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
        return _amount(self.velocity)

    @property
    def total(self) -> Array:
        """The amount of the acceleration, (n,)."""
        return _amount(self.acceleration)

    @property
    def tangential(self) -> Array:
        """A point's acceleration along its velocity, (n,); NaN where it stands still, and has no direction."""
        return self._along(self.velocity)

    @property
    def normal(self) -> Array:
        """A point's acceleration to the left of its velocity, v²/radius of its path, (n,); NaN where it stands still."""
        return self._along(np.stack((-self.velocity[1], self.velocity[0])))

    def _along(self, direction: Array) -> Array:
        if self.kind != POINT:
            raise SceneError([Fault(self.name, f"one of kind {self.kind}", "a point, which has a path")])
        speed = _amount(direction)
        still = speed <= _amount(self.errors[1])
        return np.where(still, np.nan, (direction * self.acceleration).sum(axis=0) / np.where(still, 1.0, speed))


def _amount(vector: Array) -> Array:
    return np.abs(vector) if vector.ndim == 1 else np.hypot(vector[0], vector[1])


@dataclass(frozen=True)
class Kinematics:
    """The motion of everything in a machine, by name, over the driver's coordinate or over time.

    Attributes:
        scene: the machine's.
        condition: in words, how the driver moves.
        over: "driver" or "time".
        t: s, shape (n,); None per unit of the driver.
        q: the driver's coordinate (rad, or m where it slides), not reduced to a turn.
        rate: its rate; None per unit of the driver.
        acceleration: its acceleration; None per unit of the driver.
        curves: by name: bodies `rod`, centres of mass `rod.com`, points `rod.P`, joints `crank_pin`, angles between the
            bodies that a pin joins `crank_pin.angle`, slides `guide`, shafts `crank`; of several mechanisms `NAME.rod`.
        breakpoints: where on the axis (q or t) something switches.
        dead_centres: by curve, where its velocity passes zero.
        errors: estimated absolute errors of t, q, rate and acceleration.
        other_names: names of the same curves that they may be asked by.
        messages: what is to be said beside.

    """

    scene: Scene
    condition: str
    over: str
    t: Array | None
    q: Array
    rate: Array | None
    acceleration: Array | None
    curves: Mapping[str, Curve]
    breakpoints: Array
    dead_centres: Mapping[str, Array]
    messages: tuple[str, ...] = ()
    errors: Mapping[str, Array] = field(default_factory=dict)
    other_names: Mapping[str, str] = field(default_factory=dict)

    @property
    def axis(self) -> Array:
        """What the curves are drawn over: q (rad or m) or t (s)."""
        return self.q if self.over == DRIVER or self.t is None else self.t

    @cached_property
    def sliding(self) -> bool:
        """Whether the driver slides."""
        return self.scene.reduction_element == "slide"

    def __getitem__(self, name: str) -> Curve:
        """The curve of a name; a SceneError with the nearest one where there is none."""
        return self.curves[chosen(name, self.curves, self.other_names)]


def chosen(name: str, curves: Mapping[str, object], other: Mapping[str, str]) -> str:
    """A curve's own name; a SceneError with the nearest name where there is none."""
    if name in curves:
        return name
    if name in other:
        return other[name]
    faults = arguments.name_faults("of", name, {**curves, **other})
    raise SceneError([fault._replace(expected=f"one of {', '.join(curves)}") for fault in faults])


# -- how the driver moves ----------------------------------------------------------------------------------------------


class Driver(NamedTuple):
    """The driver at n instants: t (s), q (rad or m), rate and acceleration, and their estimated absolute errors.

    Per unit of the driver there is neither time nor rate.
    """

    q: Array
    t: Array | None = None
    rate: Array | None = None
    acceleration: Array | None = None
    errors: tuple[Array | float, Array | float, Array | float, Array | float] = (0.0, 0.0, 0.0, 0.0)


class Course(NamedTuple):
    """How the driver moves: `at` gives it at values of a variable, its coordinate or time, from `start` to `end`."""

    condition: str
    variable: str
    start: float
    end: float
    at: Callable[[Array], Driver]
    switches: tuple[float, ...] = ()
    messages: tuple[str, ...] = ()


def _per_unit(scene: Scene) -> Course:
    return Course("per unit of the driver", DRIVER, scene.origin, scene.origin + scene.cycle, Driver)


def _constant_speed(scene: Scene, speed: float, over: str) -> Course:
    """The driver at a constant speed (rad/s or m/s), through a cycle or along the stroke, from whichever end it comes."""
    unit = "m/s" if scene.reduction_element == "slide" else "rad/s"
    first = scene.origin if speed > 0.0 or scene.stroke is None else scene.origin + scene.cycle

    def at(q: Array, t: Array) -> Driver:
        off = 4 * ROUNDING * (np.abs(t) + abs(first / speed))
        return Driver(q, t, np.full(q.size, speed), np.zeros(q.size), (off, off * abs(speed), 0.0, 0.0))

    condition = f"at {speed:.10g} {unit}"
    if over == TIME:
        return Course(condition, TIME, 0.0, abs(scene.cycle / speed), lambda t: at(first + speed * t, t))
    return Course(condition, DRIVER, scene.origin, scene.origin + scene.cycle, lambda q: at(q, (q - first) / speed))


# -- the motion of everything ------------------------------------------------------------------------------------------


@np.errstate(all="ignore")
def motion(
    machine: Machine | Scene,
    *,
    of: Sequence[str] = (),
    over: str | None = None,
    at: ArrayLike | None = None,
    points: int | None = None,
    speed: float | None = None,
) -> Kinematics:
    """Position, velocity and acceleration of everything that moves in a machine, with estimated errors.

    Args:
        machine: a `Scene`, or a `Machine` of one.
        of: names of the curves that are wanted; all if empty.
        over: "driver" or "time".
        at: positions of the driver (rad, or m where it slides), or times (s) where it is over time.
        points: how many, evenly, in place of `at`; 361 if None.
        speed: constant speed of the driver, rad/s, or m/s where it slides; if None everything is per unit of the driver.

    Raises:
        SceneError: for a name that there is not, with the nearest; for what cannot move so.

    >>> import flywheel
    >>> press = {"type": "slider-crank", "crank": {"length": 1.0}, "rod": {"length": 2.0}}
    >>> scene = flywheel.load({"mechanism": press, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    >>> slider = motion(scene, at=[np.pi / 2], speed=5.0)["slider"]
    >>> slider.position.round(6).tolist(), slider.velocity.round(9).tolist(), slider.acceleration.round(6).tolist()
    ([1.732051], [-5.0], [14.433757])

    """
    scene = machine.scene if isinstance(machine, Machine) else machine
    if scene.areas is not None:
        raise SceneError([Fault("areas", "a diagram of areas", "a machine that moves", "give a mechanism instead")])
    axis = over or DRIVER
    if axis not in (DRIVER, TIME):
        raise SceneError([Fault("over", arguments.shown(over), f'"{DRIVER}" or "{TIME}"')])
    if speed is None and axis == TIME:
        advice = "give speed, regime, law or transient"
        raise SceneError([Fault("over", "time without a motion in time", "a motion in time", advice)])
    if speed is not None:
        arguments.refuse(arguments.number_faults("speed", speed))
        if speed == 0.0:
            raise SceneError([Fault("speed", "0", "a speed that is not 0")])
    course = _per_unit(scene) if speed is None else _constant_speed(scene, float(speed), axis)
    return _along(scene, course, axis, _instants(course, at, points), of)


def _instants(course: Course, at: ArrayLike | None, points: int | None) -> Array:
    """Values of a course's variable: those that are wanted, or so many evenly."""
    if at is None:
        return np.linspace(course.start, course.end, POINTS if points is None else points)
    wanted = np.atleast_1d(arguments.array("at", at)).ravel()
    if not wanted.size:
        raise SceneError([Fault("at", "no position", "one at least, or None")])
    return wanted


def _along(scene: Scene, course: Course, over: str, instants: Array, of: Sequence[str]) -> Kinematics:
    """The curves over a course, with their errors."""
    moving = Moving(scene)
    driver = course.at(instants)
    curves, other = moving.curves(driver)
    wanted = list(dict.fromkeys(chosen(name, curves, other) for name in of)) or list(curves)
    return Kinematics(
        scene=scene,
        condition=course.condition,
        over=over,
        t=driver.t,
        q=driver.q,
        rate=driver.rate,
        acceleration=driver.acceleration,
        curves={name: curves[name] for name in wanted},
        breakpoints=np.array(course.switches),
        dead_centres={},
        messages=course.messages,
        errors={name: error + 0.0 * driver.q for name, error in zip(DRIVERS, driver.errors, strict=True)},
        other_names=other,
    )


class Moving:
    """What moves in a scene: at coordinates of the driver, and found again by other roundings."""

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

    def places(self, q: Array) -> tuple[dict[str, Place], dict[str, str]]:
        """Everything that moves, by name, and other names of it."""
        return places(self.scene, self.scene.mechanisms, *self._own(q))

    def errors(self, q: Array, found: Mapping[str, Place]) -> dict[str, tuple[Array, Array, Array]]:
        """Estimated absolute errors of x, g and g' by rounding: found again a few roundings aside, lengths a few off."""
        own, anchor = self._own(q)
        size, again = max(self.scene.cycle, float(np.abs(q).max())), []
        for mechanisms, share in zip(self.others, (1.0, 0.4), strict=True):
            aside = state.beside(own, anchor, size, share)
            try:
                again.append(places(self.scene, mechanisms, aside, anchor)[0])
            except SceneError:  # at the very limit of what can be assembled
                again.append(places(self.scene, self.scene.mechanisms, aside, anchor)[0])
        floor = state.EVALUATED * ROUNDING
        return {
            name: tuple(
                state.spread(part, [other[name].track[k] for other in again]) + floor * place.unit / place.per**k
                for k, part in enumerate(place.track)
            )
            for name, place in found.items()
        }

    def curves(self, driver: Driver) -> tuple[dict[str, Curve], dict[str, str]]:
        """Position, velocity and acceleration of everything as the driver moves, with errors; other names of them."""
        found, other = self.places(driver.q)
        errors = self.errors(driver.q, found)
        return {name: _curve(name, place, errors[name], driver) for name, place in found.items()}, other


def _curve(name: str, place: Place, errors: tuple[Array, Array, Array], driver: Driver) -> Curve:
    """Velocity g q̇ and acceleration g q̈ + g' q̇², with what all errors come to."""
    x, g, bend = place.track
    if driver.rate is None or driver.acceleration is None:
        return Curve(name, place.kind, UNITS[place.kind], x, g, bend, (0.0 * g, bend), errors)
    rate, speeding, (_, off, slower, less) = driver.rate, driver.acceleration, driver.errors
    of_x, of_g, of_bend = errors
    parts = g * speeding, bend * rate**2
    total = parts[0] + parts[1]
    size = np.abs(rate)
    apart = (
        of_x + np.abs(g) * off,
        of_g * size + np.abs(g) * slower + np.abs(bend) * size * off,
        of_g * np.abs(speeding)
        + of_bend * size**2
        + np.abs(g) * less
        + 2 * np.abs(bend) * size * slower
        + np.abs(bend) * off * np.abs(speeding)
        + state.EVALUATED * ROUNDING * (np.abs(parts[0]) + np.abs(parts[1])),
    )
    return Curve(name, place.kind, UNITS[place.kind], x, g * rate, total, parts, apart)
