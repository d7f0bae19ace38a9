"""Forces in the joints of a scene's mechanisms while the machine runs: kinetostatics with the scene's own loads.

Every mechanism is taken as a linkage, and the loads on its ports act on its bodies. The torque that its crank needs
is the driving action. The motion is the steady regime, the stroke's own, one at a constant speed, or one followed
in time: a run-up, a run-down, any transient.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.numerics import summits
from flywheel.components.motors.motor import States
from flywheel.machine.machine import Machine, scene_of
from flywheel.machine.reactions import MachineMotion, close_positions, port_forces
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.motions.motion import TIME, Transient, regime_motion, sampled, scales_of, steady_motion, time_along
from flywheel.numerics import notebook
from flywheel.numerics.cells import ROUNDING, middles
from flywheel.numerics.faults import Fault, SceneError, nearest
from flywheel.numerics.units import figure as number
from flywheel.numerics.units import round_speed
from flywheel.regime import constant_speed, state
from flywheel.regime.joint_friction import machine_of
from flywheel.scene.linkage import PIN
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

EVENLY = 500  # times of a motion that was followed, where none are named
_BESIDE = 1e-7  # of a stretch of motion: distance from its ends at which forces are evaluated
_IN_A_STRETCH = (3, 60)  # positions in every stretch of a motion, over which the largest forces are sought: least and most
_CLOSELY = 12_000  # positions in all
_TOPS = 4  # samples of a curve about which its greatest value is searched for
_FINER, _ROUNDS = 7, 14  # places about an extreme, and how often they are laid closer


class StateErrors(NamedTuple):
    """Estimated absolute errors of a motion: angle, speed, acceleration, time, the scene's unknown (SI); 0 if given."""

    phi: Array | float = 0.0
    omega: Array | float = 0.0
    alpha: Array | float = 0.0
    time: Array | float = 0.0
    balance: float = 0.0


class JointForces(NamedTuple):
    """Forces in the joints of every mechanism of a machine, by the mechanism's name, over a motion.

    `machine` is the moving one, with friction in joints of that motion. `condition` describes the motion in words;
    `errors` are its estimated errors, `balance` the value (SI) of the scene's unknown. `messages` are important
    notes; `inertia` is true if inertia forces are included.
    """

    motion: MachineMotion
    mechanisms: Mapping[str, Reactions]
    errors: StateErrors = StateErrors()
    balance: float = 0.0
    condition: str = ""
    messages: tuple[str, ...] = ()
    machine: Machine | None = None
    inertia: bool = True

    def __repr__(self) -> str:
        """The number of joints and positions, instead of every array."""
        joints = sum(len(reactions.components) for reactions in self.mechanisms.values())
        of = f"{joints} joints of {', '.join(self.mechanisms)}"
        return f"JointForces({of} at {self.motion.phi.size} positions, {self.condition!r})"

    def _repr_html_(self) -> str | None:
        """HTML for a notebook."""
        return notebook.html(self)


def joint_forces(
    machine: Machine | Scene,
    phi: ArrayLike | None = None,
    *,
    speed: float | None = None,
    acceleration: float = 0.0,
    inertia: bool = True,
    friction: bool = True,
    transient: Transient | None = None,
    t: ArrayLike | None = None,
) -> JointForces:
    """Driving action and reactions of every joint of a machine, with the loads, weights and added masses of its scene.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angles (rad), shape (n,), taken modulo the cycle; 360 over the cycle if None. On a stroke the driver's own
            coordinates (rad or m), 181 from end to end if None.
        speed: constant crank speed (rad/s, or m/s); if None that of the steady regime with the scene's flywheel, exact
            one for an irregularity, with its acceleration; without a flywheel, the scene's speed or the
            machine's own, constant. On a stroke the scene's.
        acceleration: beside a given `speed`, rad/s² or m/s².
        inertia: False leaves inertia forces out: quasi-static. A speed is then needed for loads that depend on it alone:
            without one the machine creeps forwards.
        friction: False leaves Coulomb friction in the joints out.
        transient: a motion of the machine that was followed in time (`flywheel.transient`): forces are those of its own
            angle, speed, acceleration and time, with loads taken at that instant.
        t: times (s) of that motion, shape (n,); 500 from its start to its end if None.

    Raises:
        SceneError: for a scene without mechanisms, or with a law, which has no joints; if there is no speed; for times
            outside the motion.

    At a constant speed time counts from crank angle 0 (from where a stroke begins), at a negative one from the other end.
    Friction in joints opposes the motion of the instant; in a lasting standstill it is undetermined, and left out. A joint's
    reaction acts from its first body on its second; see `flywheel.kinetostatics`.

    >>> import flywheel
    >>> press = {"type": "slider-crank", "crank": {"length": 3}, "rod": {"length": 5}, "slider": {}}
    >>> scene = flywheel.load({"mechanism": press, "load": [{"on": "slider", "force": "-100 N"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": 10}, "flywheel": {"inertia": 1}})
    >>> forces = joint_forces(scene, [np.pi / 2], speed=10.0).mechanisms["slider-crank"]
    >>> forces.action.round(9).tolist(), forces.components["guide"]["normal"].round(9).tolist()
    ([-300.0], [75.0])

    """
    if transient is not None:
        return _along(machine, transient, phi, speed, t, inertia, friction)
    if t is not None:
        raise SceneError(
            [Fault("t", "times without a motion in time", "the transient to which they belong", "give phi instead")]
        )
    scene = _with_joints(machine)
    machine, stroke = machine if isinstance(machine, Machine) else Machine(machine), scene.stroke
    if phi is None:
        positions = spread(scene, 360 if stroke is None else 181)
    else:
        angles = np.atleast_1d(np.asarray(phi, dtype=float)).ravel()
        if not angles.size:
            raise SceneError([Fault("phi", "no position", "one at least, or None for a whole cycle or stroke")])
        positions = state.own_coordinate(scene, angles) + scene.origin
    if speed is None and stroke is not None and stroke.speed is not None:
        speed, acceleration = stroke.speed, stroke.acceleration
    taken: tuple[str, ...] = ()
    if speed is None and scene.has_flywheel and scene.has_speed and stroke is None:
        motion, errors, balance, condition, machine = _steady(machine, positions)
    else:
        own = None if speed is not None else _constant(machine, inertia)
        if own is not None and stroke is None:
            taken = (f"no flywheel is given: the speed is taken as a constant {number(own)} rad/s",)
        speed = own if speed is None else float(speed)
        motion, condition = _at_speed(machine, positions, speed, float(acceleration))
        balance, off = _balance(machine, speed)
        errors = StateErrors(time=0.0 if motion.time is None else 2 * ROUNDING * np.abs(motion.time), balance=off)
    forces = _forces(machine, motion, errors, balance, condition, inertia, friction)
    return forces._replace(messages=(*taken, *forces.messages))


def _with_joints(source: Machine | Scene) -> Scene:
    scene = scene_of(source)
    if scene.areas is not None:
        raise SceneError([Fault("areas", "a diagram of areas", "a machine with joints", "give mechanism and loads instead")])
    if not scene.mechanisms:
        raise SceneError([Fault("mechanism", "no mechanism", "at least one, as joints are requested")])
    for mechanism in scene.mechanisms:
        if not has_joints(mechanism):
            linkage_of(mechanism)  # which says why
    return scene


def _forces(
    machine: Machine,
    motion: MachineMotion,
    errors: StateErrors,
    balance: float,
    condition: str,
    inertia: bool,
    friction: bool,
) -> JointForces:
    """The forces in a motion, and a message on standstill."""
    mechanisms = machine.scene.mechanisms
    reactions = {m.name: port_forces(machine, motion, balance, m, inertia=inertia, friction=friction) for m in mechanisms}
    messages = []
    still = motion.sense == 0.0
    if friction and machine.scene.rubs and still.any():
        when = "" if motion.time is None else f" (t = {number(float(motion.time[still][0]))} s)"
        messages.append(
            f"standing still{when}, the direction of friction in joints is undetermined: the forces there are without it"
        )
    words = condition if inertia else f"{condition}, without inertia forces"
    return JointForces(motion, reactions, errors, balance, words, tuple(messages), machine, inertia)


# -- motions -----------------------------------------------------------------------------------------------------------


def _constant(machine: Machine, inertia: bool) -> float | None:
    """The constant speed (rad/s, or m/s) of a machine without a flywheel: the scene's, or the machine's own.

    None if neither inertia forces nor loads depend on it.
    """
    scene = machine.scene
    if scene.stroke is None and scene.speed is not None:
        return scene.speed
    if machine.depends_on_speed and scene.stroke is None and scene.unknown is None:
        return constant_speed.operating_point(machine_of(machine))[0] or 0.0
    if inertia or machine.depends_on_speed or machine.depends_on_time:
        quasi = "" if machine.depends_on_speed else ", or leave inertia forces out: --quasi-static (inertia=False)"
        fault = constant_speed.no_speed(scene, "for inertia forces, and for quantities that depend on speed")
        follow = "; or follow a motion in time: --from rest --until ... (in Python transient=)"
        raise SceneError([fault._replace(advice=fault.advice + quasi + follow)])
    return None


def _at_speed(machine: Machine, positions: Array, speed: float | None, acceleration: float) -> tuple[MachineMotion, str]:
    """A motion at a constant speed, which has a time where it does not accelerate; without a speed it creeps forwards."""
    scene = machine.scene
    if speed is None:
        still = np.zeros(positions.size)
        return MachineMotion(positions, still, still, creeps=True), "creeping forwards"
    rates = np.full(positions.size, speed), np.full(positions.size, acceleration)
    first = scene.origin + (scene.cycle if speed < 0.0 else 0.0)
    time = (positions - first) / speed if speed and not acceleration else None
    if time is None and machine.depends_on_time:
        paths = [effort.path for effort in machine.efforts if effort.uses_time]
        expected = "a constant speed without acceleration, so that every position has its time"
        advice = "or follow the machine in time (--from rest --until ...)"
        raise SceneError([Fault(path, "a law that depends on time", expected, advice) for path in paths])
    unit = _unit_of_speed(scene)
    words = f"at {number(speed)} {unit}" if scene.sliding else f"at {round_speed(speed)}"
    return MachineMotion(positions, *rates, time), f"{words} and {number(acceleration)} {unit}²" if acceleration else words


def _balance(machine: Machine, speed: float | None) -> tuple[float, float]:
    """The value (SI) of the scene's unknown and its error: at the scene's speed, or without one at that of the motion.

    If it acts on no port, no joint depends on it.
    """
    scene = machine.scene
    if not any(effort.depends_on_unknown and effort.load.on not in scene.shafts for effort in machine.efforts):
        return 0.0, 0.0
    at, value = constant_speed.operating_point(machine, speed if scene.speed is None else None)
    return value, abs(value) * constant_speed.operating_point_errors(machine, at)[1]


def regime_forces(sizing: Sizing, phi: Array, mechanisms: Sequence[str] = ()) -> JointForces:
    """Forces in the joints of a machine's mechanisms, or of some, in the steady regime of its sizing.

    Args:
        sizing: of a machine.
        phi: crank angles from 0 to the cycle (rad), shape (n,).
        mechanisms: names; all if empty.

    """
    machine, motion = sizing.machine, regime_motion(sizing, phi)
    assert machine is not None
    balance = 0.0 if sizing.balance is None else sizing.balance.value
    reactions = {
        mechanism.name: port_forces(machine, motion, balance, mechanism)
        for mechanism in machine.scene.mechanisms
        if mechanism.name in mechanisms or not mechanisms
    }
    return JointForces(motion, reactions, StateErrors(), balance, "steady regime", (), machine)


@lru_cache(maxsize=2)  # positions of one machine are asked for several times
def _steady_sizing(machine: Machine) -> Sizing:
    return size(machine, simulate=False)


def _steady(machine: Machine, phi: Array) -> tuple[MachineMotion, StateErrors, float, str, Machine]:
    """The steady regime with the scene's flywheel, its errors, the scene's unknown there, words for it, and the machine."""
    sizing = _steady_sizing(machine)
    motion, (omega, alpha) = steady_motion(machine, sizing, phi)
    balance = sizing.balance
    off = 0.0 if balance is None else abs(balance.value) * balance.error
    wheel = "" if sizing.inertia is None else f" with {number(sizing.inertia, most=6)} kg m^2"
    if sizing.cycle is None or sizing.run is None:
        time, late = phi / sizing.speed, 0.0 * phi
    else:
        time = np.where(phi == 0.0, 0.0, time_along(sizing, phi))
        late = time * float(np.max(omega / motion.omega)) + 0.1 * sizing.rtol * machine.scene.cycle / sizing.speed
    errors = StateErrors(0.0, omega, alpha, late + 4 * ROUNDING * time, off)
    words, value = f"steady regime{wheel}", 0.0 if balance is None else balance.value
    return motion._replace(time=time), errors, value, words, sizing.machine or machine


def _along(
    machine: Machine | Scene,
    run: Transient,
    phi: ArrayLike | None,
    speed: float | None,
    t: ArrayLike | None,
    inertia: bool,
    friction: bool,
) -> JointForces:
    """Forces at times of a motion that was followed."""
    scene = _with_joints(machine)
    options = {"phi": phi, "speed": speed}
    faults = [
        Fault(name, "a value", "none, as it follows from the motion") for name, value in options.items() if value is not None
    ]
    if scene.mechanisms != run.scene.mechanisms:
        faults.append(Fault("transient", "a motion of another scene", "one of this scene"))
    if faults:
        raise SceneError(faults)
    times = np.linspace(0.0, run.time, EVENLY) if t is None else np.atleast_1d(np.asarray(t, dtype=float)).ravel()
    outside = ~((times >= 0.0) & (times <= run.time * (1.0 + ROUNDING)))
    if not times.size or outside.any():
        defect = "no time" if not times.size else f"{times[outside][0]:.6g} s"
        raise SceneError([Fault("t", defect, f"times of the motion, from 0 to {run.time:.6g} s")])
    return along_run(run, times, inertia=inertia, friction=friction)


def along_run(
    run: Transient, times: Array, owners: Indices | None = None, *, inertia: bool = True, friction: bool = True
) -> JointForces:
    """Forces in the joints at times (s) of a motion in time; at a switch `owners` select the stretch (the side)."""
    trail = run.motion.trail
    assert trail is not None
    owners = trail.owners(times) if owners is None else owners
    machine, samples = trail.dynamics.machine, sampled(trail, times, owners)
    gone, anchor = trail.anchors(owners)
    motion = MachineMotion(samples.phi + machine.scene.origin, samples.omega, samples.acceleration, times, gone, anchor)
    words = f"followed from {number(float(run.motion.omega[0]))} {_unit_of_speed(machine.scene)}: {run.ended}"
    errors = _errors_along(run, motion, () if samples.states is None else np.array([*samples.states.values()]))
    return _forces(machine, motion, errors, run.balance, words, inertia, friction)


def _unit_of_speed(scene: Scene) -> str:
    return "m/s" if scene.sliding else "rad/s"


def _errors_along(run: Transient, motion: MachineMotion, states: States) -> StateErrors:
    """Errors of angle, speed and acceleration by the error of a run: the last computed again with the others changed."""
    trail, anchor, time = run.motion.trail, motion.anchor, motion.time
    assert trail is not None
    assert anchor is not None
    assert time is not None
    dynamics, machine = trail.dynamics, trail.dynamics.machine
    phi, omega = (run.error * scale for scale in scales_of(run.motion.phi, run.motion.omega, machine.scene))
    own = motion.own(machine)

    def acceleration(dphi: float, domega: float, share: float) -> Array:
        place = np.clip(own + dphi, 0.0, machine.scene.cycle)
        accelerations = dynamics.at_many(place, anchor, motion.omega + domega, time, np.multiply(states, 1.0 + share))
        return np.asarray(accelerations.acceleration)

    apart = [
        np.abs(acceleration(*off) - motion.alpha) for off in ((phi, 0.0, 0.0), (0.0, omega, 0.0), (0.0, 0.0, run.error))
    ]
    alpha = np.nan_to_num(np.sum(apart, axis=0)) + state.ROUNDINGS * ROUNDING * np.abs(motion.alpha)
    return StateErrors(phi, omega, alpha, ROUNDING * time)


def close_times(run: Transient) -> tuple[Array, Indices]:
    """Times in every stretch of a motion, dense enough for the largest forces, also close to its ends; and the stretches."""
    trail = run.motion.trail
    assert trail is not None
    count = int(np.clip(_CLOSELY // len(trail.stretches), *_IN_A_STRETCH))
    shares = np.concatenate(([_BESIDE], np.arange(1, count) / count, [1.0 - _BESIDE]))
    times, owners = trail.within(shares)
    inner = np.tile(np.arange(shares.size + 2), len(trail.stretches))
    kept = (inner > 0) & (inner <= shares.size)
    kept[[0, -1]] = True  # start and end themselves
    return times[kept], owners[kept].astype(np.intp)


# -- curves ------------------------------------------------------------------------------------------------------------

DRIVING, RESULTANT = "driving", "resultant"
COMPONENTS = (
    "x", "y", "normal", "moment", RESULTANT, DRIVING, "friction", "front", "rear", "tangential", "radial",
)  # fmt: skip
"""Components that a joint may have: `x` and `y` (of the whole force, in the frame's axes) exist for every one."""


class ForceCurve(NamedTuple):
    """One component of a joint's reaction, or its driving action, over a motion: its values (n,) in N or N m."""

    name: str
    mechanism: str
    joint: str
    component: str
    unit: str
    values: Array


def force_curves(forces: JointForces, of: Sequence[str] = (), components: Sequence[str] = ()) -> list[ForceCurve]:
    """Components of the reactions by joint, the driving action of a driven joint before them.

    Args:
        forces: as `joint_forces` found them.
        of: names of joints and couplings (after the mechanism's name where several have that name); all if empty.
        components: of `COMPONENTS`; those of each joint, and the resultant, if empty.

    Raises:
        SceneError: for a joint that does not exist, with the nearest; for a component that none of the joints has.

    """
    places = joints_named(forces, of)
    several = len(forces.mechanisms) > 1
    rows = []
    for mechanism, joint in places:
        parts = _parts(forces.mechanisms[mechanism], joint)
        own = (
            [name for name in parts if name in components] if components else [n for n, (_, _, own) in parts.items() if own]
        )
        prefix = f"{mechanism}.{joint}" if several else joint
        rows += [ForceCurve(f"{prefix}.{name}", mechanism, joint, name, *parts[name][:2]) for name in own]
    missing = [name for name in components if name not in {curve.component for curve in rows}]
    if missing:
        names = dict.fromkeys(name for place in places for name in _parts(forces.mechanisms[place[0]], place[1]))
        raise SceneError(
            [Fault("component", f"{n!r}, which no requested joint has", f"one of {', '.join(names)}") for n in missing]
        )
    return rows


def close_angles(forces: JointForces, count: int) -> Array:
    """Coordinates dense enough for the largest forces, with both sides of every jump.

    Jumps are those of loads, and reversals of joints with friction.
    """
    machine = forces.machine
    assert machine is not None
    omega = forces.motion.omega
    if machine.has_joint_friction and omega.size and (omega == omega[0]).all():
        with suppress(SceneError):  # where friction locks there is no moment of it
            machine = machine_of(machine, None if forces.motion.creeps else float(omega[0]))
    return close_positions(machine, count)


def closely(forces: JointForces, along: Callable[[Array], JointForces], count: int) -> JointForces:
    """Forces at coordinates close to one another (see `close_angles`), and where every curve is least and greatest.

    along: gives forces at coordinates. Extremes are accurate to about 1e-9 of the largest force, also on either side of a
    jump.
    """
    phi = close_angles(forces, count)
    return _with_extremes(lambda q, _: along(q), phi, np.zeros(phi.size, dtype=np.intp))


def closely_along(run: Transient, *, inertia: bool = True, friction: bool = True) -> JointForces:
    """Forces at times close to one another along a motion that was followed, and where every curve is least and greatest."""
    return _with_extremes(partial(along_run, run, inertia=inertia, friction=friction), *close_times(run))


def _with_extremes(along: Callable[[Array, Indices], JointForces], places: Array, owners: Indices) -> JointForces:
    """Forces at places, coordinates or times in stretches, and where every curve is least and greatest within a stretch."""
    every = np.arange(places.size)
    before, after = np.maximum(every - 1, 0), np.minimum(every + 1, places.size - 1)
    before = np.where(owners[before] == owners, before, every)
    after = np.where(owners[after] == owners, after, every)
    more, which = _extreme_places(along(places, owners), places, before, after, lambda q, tops: along(q, owners[tops]))
    rows = np.unique(np.column_stack((np.append(owners, owners[which]), np.append(places, more))), axis=0)
    return along(np.asarray(rows[:, 1], dtype=float), rows[:, 0].astype(np.intp))


def _extreme_places(
    forces: JointForces, places: Array, before: Indices, after: Indices, along: Callable[[Array, Indices], JointForces]
) -> tuple[Array, Indices]:
    """Places at which every curve is least and greatest, with those on either side, and the samples nearest.

    places: of the forces; before, after: the neighbours of each. along: gives forces at other places, with those samples.
    Samples that differ from the extreme one by less than the curve changes near them are refined as well.
    """
    values = _both_ways(forces)
    sides = np.maximum(values - values[:, before], values - values[:, after])
    peaks = (values >= values[:, before]) & (values >= values[:, after]) & np.isfinite(values)
    greatest = values.max(axis=1, keepdims=True, initial=-np.inf)
    rivals = peaks & (sides > 0.0) & (greatest - values <= sides)
    pairs = [(row, k) for row, near in enumerate(rivals) for k in _highest(values[row], np.flatnonzero(near))]
    rows, tops = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    low, high = places[before[tops]], places[after[tops]]

    def curves(grid: Array, which: Indices) -> Array:
        every = _both_ways(along(grid.ravel(), np.repeat(tops[which], grid.shape[1]))).reshape(-1, *grid.shape)
        return np.asarray(every[rows[which], np.arange(which.size)])

    highest = summits(curves, low, high, _FINER, _ROUNDS)
    return np.concatenate((highest.low, highest.place, highest.high)), np.tile(tops, 3)


def _both_ways(forces: JointForces) -> Array:
    """The values of all curves and their negatives, (2m, n); -inf where they are not known."""
    values = np.array([curve.values for curve in force_curves(forces)])
    both = np.concatenate((values, -values))
    return np.where(np.isnan(both), -np.inf, both)


def _highest(values: Array, which: Indices) -> Indices:
    """The samples with the greatest values."""
    return np.asarray(which[np.argsort(values[which], kind="stable")[-_TOPS:]])


class CurveAxis(NamedTuple):
    """Horizontal axis of curves: name and unit, values (n,), and the places between them at which something switches."""

    name: str
    unit: str
    values: Array
    edges: Array


def axis(forces: JointForces, over: str) -> CurveAxis:
    """The driver's position (deg, or m where it slides) or the time (s) of forces, in the order that they stand in.

    Raises:
        SceneError: for a motion without a time.

    """
    machine, motion, anchor = forces.machine, forces.motion, forces.motion.anchor
    assert machine is not None
    own = motion.own(machine) if anchor is None else anchor.phi
    switched = np.diff(middles(machine.switches, own)) != 0.0
    if anchor is not None:  # a new stretch without a new piece begins at a time or a speed
        piece = (
            np.searchsorted(machine.restarts, anchor.phi)
            + np.asarray(motion.gone) / machine.scene.cycle * machine.restarts.size
        )
        switched |= (np.diff(anchor.time) != 0.0) & (np.diff(piece) == 0.0)
    first = np.flatnonzero(switched) + 1
    if over == TIME and motion.time is None:
        expected, advice = (
            "a motion in time",
            "without acceleration every speed has its time; or follow one: --from, --until",
        )
        raise SceneError([Fault("over", f"time, for forces {forces.condition}", expected, advice)])
    if over == TIME and motion.time is not None:
        return CurveAxis("t", "s", motion.time, motion.time[first])
    if machine.scene.sliding:
        return CurveAxis("x", "m", motion.phi, motion.phi[first])
    return CurveAxis("phi", "deg", degrees := np.degrees(motion.phi), degrees[first])


def _parts(reactions: Reactions, joint: str) -> dict[str, tuple[str, Array, bool]]:
    """Unit and values of all figures of a joint, and whether each is shown by default."""
    parts: dict[str, tuple[str, Array, bool]] = {}
    if joint in reactions.actions:
        kind = reactions.poses.linkage.joint(joint).kind
        parts[DRIVING] = "N m" if kind == PIN else "N", reactions.actions[joint], True
    units = reactions.units[joint]
    parts |= {name: (units[name], values, True) for name, values in reactions.components[joint].items()}
    for name, values in zip(("x", "y"), reactions.forces[joint], strict=True):
        parts.setdefault(name, ("N", values, False))
    return parts | {RESULTANT: ("N", reactions.resultant(joint), "N" in units.values())}


def joints_named(forces: JointForces, of: Sequence[str] = ()) -> list[tuple[str, str]]:
    """Mechanism and joint of each name; of all joints if there is none."""
    every = [(mechanism, joint) for mechanism, reactions in forces.mechanisms.items() for joint in reactions.components]
    names: dict[str, list[tuple[str, str]]] = {}
    for place in every:
        for name in {place[1], ".".join(place)}:
            names.setdefault(name, []).append(place)
    faults = []
    for name in of:
        if name not in names:
            expected = f"one of {', '.join(j if len(names[j]) == 1 else f'{m}.{j}' for m, j in every)}"
            near = nearest(name, list(names))
            faults.append(Fault("joints", repr(name), expected, f"did you mean {near!r}?" if near else ""))
        elif len(names[name]) > 1:
            expected = " or ".join(f"{mechanism}.{joint}" for mechanism, joint in names[name])
            faults.append(Fault("joints", f"{name!r}, which several mechanisms have", expected))
    if faults:
        raise SceneError(faults)
    return list(dict.fromkeys(names[name][0] for name in of)) if of else every


# -- errors ------------------------------------------------------------------------------------------------------------


@np.errstate(all="ignore")
def joint_errors(
    machine: Machine, forces: JointForces, *, inertia: bool = True, friction: bool = True
) -> dict[str, dict[str, Any]]:
    """Estimated absolute errors of forces in joints, by mechanism, in the arrangement of `figures_of`.

    As with `flywheel.regime.state.state_errors` the forces are computed again with angles and lengths changed by a few
    roundings, which gives linkages' positions and the equations of equilibrium other rounding errors. Added to that
    difference are the effects of the errors of angle, speed, acceleration and unknown, one by one, and of the residuals of
    equilibrium and of the iteration of friction.

    Args:
        machine: the machine.
        forces: as `joint_forces` found them.
        inertia: as for the forces.
        friction: as for the forces.

    """
    motion, off, origin = forces.motion, forces.errors, machine.scene.origin
    own = motion.own(machine)
    anchor = machine.anchors(own) if motion.anchor is None else np.asarray(motion.anchor.phi)
    options = {"inertia": inertia, "friction": friction}

    def beside(share: float) -> MachineMotion:
        return motion._replace(phi=origin + motion.gone + state.beside(own, anchor, machine.scene.cycle, share))

    inwards = np.where(anchor < own, -1.0, 1.0)
    changes = [
        (motion._replace(phi=motion.phi + inwards * off.phi), 0.0, off.phi),
        (motion._replace(omega=motion.omega + np.where(motion.omega < 0.0, -1.0, 1.0) * off.omega), 0.0, off.omega),
        (motion._replace(alpha=motion.alpha + off.alpha), 0.0, off.alpha),
        (motion, off.balance, off.balance),
    ]
    moved = [(other, more) for other, more, size in changes if np.any(size)]
    others = state.rounded_otherwise(machine, friction=False)
    errors = {}
    for k, mechanism in enumerate(machine.scene.mechanisms):
        reactions = forces.mechanisms[mechanism.name]
        again = [
            port_forces(other, beside(share), forces.balance, other.scene.mechanisms[k], **options)
            for other, share in zip(others, (1.0, 0.4), strict=True)
        ]
        apart = state.spread(figures_of(reactions), [figures_of(other) for other in again])
        for other, more in moved:
            there = figures_of(port_forces(machine, other, forces.balance + more, mechanism, **options))
            apart = _sum(apart, there, figures_of(reactions))
        friction_gap, linkage = reactions.friction.gap, reactions.poses.linkage
        left = reactions.residual + np.where(np.isfinite(friction_gap), friction_gap, 0.0) + state.ROUNDINGS * ROUNDING
        force, moment = reactions.scales()  # what equilibrium and the iteration of friction leave over is a share of these
        sizes = {"N": force, "N m": moment}
        drive = {name: moment if linkage.joint(name).kind == PIN else force for name in reactions.actions}
        iterated = bool(reactions.friction.iterations) * (force if linkage.sliding else moment)
        errors[mechanism.name] = {
            "driving": {name: error + left * drive[name] for name, error in apart["driving"].items()},
            "joints": {
                joint: {part: error + left * sizes[reactions.units[joint].get(part, "N")] for part, error in parts.items()}
                for joint, parts in apart["joints"].items()
            },
            "friction": {"moment": apart["friction"]["moment"] + left * iterated},
        }
    return errors


def _sum(errors: Any, there: Any, here: Any) -> Any:
    """Errors, and differences of figures of another motion from these, with a tenth for nonlinearity."""
    if isinstance(errors, Mapping):
        return {name: _sum(value, there[name], here[name]) for name, value in errors.items()}
    return errors + 1.1 * np.abs(there - here)


def figures_of(reactions: Reactions) -> dict[str, Any]:
    """Driving actions; components, x and y of the whole force and its size for every joint, by their names."""

    def of_joint(name: str) -> dict[str, Array]:
        x, y = reactions.forces[name]
        return {"x": x, "y": y, **reactions.components[name], RESULTANT: reactions.resultant(name)}

    joints = {name: of_joint(name) for name in reactions.components}
    return {"driving": dict(reactions.actions), "joints": joints, "friction": {"moment": reactions.friction.moment}}


def spread(scene: Scene, count: int) -> Array:
    """Positions spaced evenly over the cycle, from 0 and without its end, or over the stroke from end to end."""
    if scene.stroke is not None:
        return np.linspace(scene.stroke.start, scene.stroke.end, count)
    return scene.cycle * np.arange(count) / count
