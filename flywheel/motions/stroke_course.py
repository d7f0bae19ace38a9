"""The course of a period of a machine that works stroke by stroke: speeds, torques and works over time, its drive."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from bondgraph.numerics import root
from flywheel.components.energy import ServoLoad
from flywheel.components.motors.motor import Motor
from flywheel.components.motors.thermal import Temperature, greatest_rise
from flywheel.components.press_work import Speeds
from flywheel.machine.dynamics import NODES, Trail
from flywheel.motions.strokes import Leg, Phases, Ramp, Strokes, torque_at
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array, Index
from flywheel.sizing.drive import share_of_peak
from flywheel.sizing.motor import IRREGULARITY
from flywheel.sizing.results import Trip

__all__ = [
    "MOTOR_HEAT", "MOTOR_TORQUE", "Course", "Side", "along_phases", "course", "crank_at", "drive_load", "drive_torque",
    "driven_inertia", "driving_inertia", "driving_sides", "inverter_loads", "limited_figures", "motor_limits", "motor_ratio",
    "recovery_time", "servo_load", "slip_heat", "speed_extremes", "temperature",
]  # fmt: skip

MOTOR_TORQUE, MOTOR_HEAT = "motor torque", "motor heat"
_RECOVERED = 0.95  # of the drop of speed: what counts as recovered
_NO_POWER = 1e-9  # of the rated power: less that is returned is rounding


def driven_inertia(strokes: Strokes, phases: Phases) -> float:
    """I* of the driven side (kg m² at the crank) where the crank stands as the clutch engages."""
    rest = phases.begin[1]
    return float(strokes.driven.at(rest, rest, 0.0).inertia)


def driving_inertia(strokes: Strokes) -> float:
    """Inertia of the driving side (kg m² at the clutch's shaft), its flywheel included."""
    return float(strokes.driving.at(math.pi, math.pi, strokes.typical * strokes.ratio, 0.0).inertia)


def along_phases(times: Array, parts: Iterable[tuple[Trail | None, float, float]]) -> Array:
    """Rows of states at times (s) by motions one after the other, each with its clock and a factor of its speeds."""
    states = np.zeros((2, times.size))
    for trail, clock, factor in parts:
        if trail is None:
            continue
        mine = (times >= clock + trail.start.time) & (times <= clock + trail.t[-1])
        if mine.any():
            states[:, mine] = trail.states(times[mine] - clock)[:2] * np.array([[1.0], [factor]])
    return states


def crank_at(phases: Phases, times: Array) -> Array:
    """Crank angle (rad) and speed (rad/s): two rows."""
    legs = [(leg.driven, leg.clock, 1.0) for leg in phases.legs]
    states = along_phases(
        times, [*legs, (phases.coasting, phases.release_time, 1.0), (phases.braking, phases.brake_time, 1.0)]
    )
    states[0, times > phases.stop_time] = phases.rest
    return states


Side = tuple[Trail, float, float]
"""A motion of the driving side, the factor from its speed to the clutch shaft's, and its clock (s)."""


def driving_sides(strokes: Strokes, phases: Phases) -> list[Side]:
    """The driving side over a whole period."""
    legs = [(leg.driving, 1.0 if leg.sense else strokes.ratio, leg.clock) for leg in phases.legs]
    return [*legs, (phases.recovery, 1.0, phases.release_time)]


def motor_ratio(strokes: Strokes) -> float:
    """The speed of the drive's shaft over that of the clutch's."""
    drive = strokes.scene.drive
    assert drive is not None
    return strokes.scene.shafts[drive.on] / strokes.ratio


def drive_torque(strokes: Strokes, speeds: Array) -> Array:
    """The torque of the drive (N m) at speeds of its shaft, rad/s."""
    if strokes.scene.motor is not None:
        return np.asarray(strokes.scene.motor.torque(speeds))
    drive = strokes.scene.drive
    assert drive is not None
    values = {**strokes.scene.parameters, "omega": speeds, "phi": 0.0, "x": 0.0, "v": speeds}
    return np.asarray(drive.law.evaluate(values, np, values)) + 0.0 * speeds  # type: ignore[union-attr]


def _driving_speeds(strokes: Strokes, phases: Phases, times: Array) -> Array:
    """Speed (rad/s) of the clutch's shaft."""
    speeds: Array = along_phases(times, [(trail, clock, factor) for trail, factor, clock in driving_sides(strokes, phases)])[
        1
    ]
    return speeds


def _clutch_torque(strokes: Strokes, phases: Phases, times: Array) -> Array:
    """The torque (N m) that the clutch gives to the driven side."""
    torques = np.zeros(times.size)
    for leg in phases.legs:
        mine = (times >= leg.begin) & (times < leg.end)
        on_clock = times[mine] - leg.clock
        if leg.sense:
            torques[mine] = leg.sense * torque_at(leg.torque, on_clock)
        elif mine.any():
            torques[mine] = strokes.locked_torque(leg.driven, on_clock, leg.driven.owners(on_clock))
    return torques


def _brake_torque(strokes: Strokes, phases: Phases, times: Array, speeds: Array) -> Array:
    """The torque (N m) of the brake on its shaft at speeds of the crank: against the motion; at rest that which holds it."""
    brake, on, torques, ratio = (
        strokes.brake,
        strokes.clutch.on,
        np.zeros(times.size),
        strokes.scene.shafts[strokes.brake.on],
    )
    since, released = times - phases.brake_time, times < brake.fall
    acts = (since >= 0.0) & (times <= phases.stop_time)
    torques[acts] = -torque_at(Ramp(brake.torque, 0.0, brake.rise), since[acts])
    torques[times > phases.stop_time] = -phases.resting / ratio
    if released.any():
        forwards, backwards = (
            torque_at(Ramp(torque, 0.0, brake.fall, True), times) for torque in (brake.torque, brake.reverse_torque)
        )
        torques[released] = np.where(speeds < 0.0, backwards, -forwards)[released]
    standing = released & (speeds == 0.0)  # the clutch's torque is not yet enough
    gain = strokes.ratio * math.prod(strokes.scene.efficiencies.get(name, 1.0) for name in strokes.scene.inwards(on))
    torques[standing] = -(phases.resting + gain * torque_at(phases.legs[0].torque, times[standing])) / ratio
    return torques


def slip_heat(leg: Leg, ratio: float) -> float:
    """The integral of torque times slip, J, by Gauss' rule between all times at which either side or the torque changes.

    Args:
        leg: in which the clutch slips.
        ratio: speed of the clutch's shaft over that of the crank.

    """
    begin, end, torque = leg.driven.start.time, float(leg.driven.t[-1]), leg.torque
    edges = np.unique(np.concatenate((leg.driving.t, leg.driven.t, [torque.begin, torque.begin + torque.lasting])))
    edges = edges[(edges >= begin) & (edges <= end)]
    times, weights = _gauss_rule(edges, 10)
    slip = leg.driving.states(times)[1] - ratio * leg.driven.states(times)[1]
    return float(weights.ravel() @ (leg.sense * torque_at(torque, times) * slip))


def _gauss_rule(edges: Array, points: int) -> tuple[Array, Array]:
    """Times of Gauss's rule between neighbouring edges, and their weights, (intervals, points)."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    half = 0.5 * np.diff(edges)[:, None]
    return (0.5 * (edges[:-1] + edges[1:])[:, None] + half * nodes).ravel(), half * weights


class Course(NamedTuple):
    """A period at times (s), each jump twice: before and after it. Works (J) count from the engagement of the clutch.

    `driving` is the speed of the clutch's shaft, `crank` that of the crank referred to that shaft (rad/s), `phi` the crank
    angle (rad). `clutch` is the torque that the clutch gives to the crank, `brake` that of the brake on its shaft, at rest
    the holding torque, `drive` that of the drive at its own shaft (N m). `drive_work` is the work of the drive,
    `wheel_work` the kinetic energy given by the inertia of the driving side.
    """

    time: Array
    phi: Array
    driving: Array
    crank: Array
    clutch: Array
    brake: Array
    drive: Array
    drive_work: Array
    wheel_work: Array


_SIDE = 1e-9  # of a period: how far beside a jump a course is taken
_GAUSS_POINTS = 4  # between neighbouring times of a course


def course(strokes: Strokes, phases: Phases, count: int) -> Course:
    """The course of a period, at about that number of times, ends of phases among them."""
    release, brake, stop = phases.release_time, phases.brake_time, phases.stop_time
    trails = [(leg.driven, leg.clock) for leg in phases.legs] + [(phases.coasting, release), (phases.braking, brake)]
    switches = np.concatenate([begin + _switches(trail) for trail, begin in trails if trail is not None])
    ends = np.unique(
        np.concatenate((switches, [0.0, release, brake, stop, phases.period], [leg.end for leg in phases.legs]))
    )
    ends = ends[np.diff(ends, prepend=-1.0) > _SIDE * phases.period]
    shares = np.sqrt(np.diff(ends))  # short parts get more than their share
    points = 2 + np.round(count * shares / shares.sum()).astype(int)
    parts = [np.linspace(low, high, n) for low, high, n in zip(ends[:-1], ends[1:], points.tolist(), strict=True)]
    time = np.concatenate(parts)
    side = _SIDE * phases.period
    inside = np.concatenate([np.clip(part, part[0] + side, part[-1] - side) for part in parts])
    inside[0] = 0.0  # a period has no other side there
    phi, crank = crank_at(phases, inside)
    driving = _driving_speeds(strokes, phases, inside)
    between, weights = _gauss_rule(time, _GAUSS_POINTS)
    ratio = motor_ratio(strokes)
    speeds = ratio * _driving_speeds(strokes, phases, between)
    power = (drive_torque(strokes, speeds) * speeds).reshape(weights.shape)
    drive_work = np.concatenate(([0.0], np.cumsum((weights * power).sum(axis=1))))
    inertia = driving_inertia(strokes)
    return Course(
        time,
        phi,
        driving,
        strokes.ratio * crank,
        _clutch_torque(strokes, phases, inside),
        _brake_torque(strokes, phases, inside, crank),
        drive_torque(strokes, ratio * driving),
        drive_work,
        0.5 * inertia * (driving[0] ** 2 - driving**2),
    )


def _switches(trail: Trail) -> Array:
    """The times (s) within a motion at which its laws change."""
    pairs = zip(trail.stretches[:-1], trail.stretches[1:], strict=True)
    return np.array([one.step.end for one, other in pairs if one.anchor != other.anchor], dtype=float)


# -- the load of the driving side ---------------------------------------------------------------------------------------


def speed_extremes(sides: list[Side]) -> tuple[Speeds, float]:
    """The extremes of the driving side's speed in a period, on the clutch's shaft, and when (s) it is least."""
    least, when = _greatest(sides, lambda speeds: -speeds)
    return Speeds(_greatest(sides, lambda speeds: speeds)[0], -least), when


def recovery_time(sides: list[Side], least: float, when: float, phases: Phases) -> float:
    """The time (s) from the least speed until most of the drop is recovered."""
    level = least + _RECOVERED * (phases.speed - least)
    for trail, factor, begin in sides:
        times, owners = trail.within(NODES)
        speeds = trail.states(times, owners)[1] * factor
        above = np.flatnonzero((speeds >= level) & (times + begin > when))
        if not above.size:
            continue
        k = int(above[0])
        if k == 0 or times[k - 1] + begin < when:
            return float(times[k]) + begin - when
        which = owners[k : k + 1]

        def over(t: float, trail: Trail = trail, factor: float = factor, which: Any = which) -> float:
            return float(trail.states(np.array([t]), which)[1, 0]) * factor - level

        low, high = float(times[k - 1]), float(times[k])
        return (low if over(low) >= 0.0 else root(over, low, high)) + begin - when
    return phases.period - when


def _gauss(sides: list[Side], ratio: float) -> tuple[Array, Array]:
    """Speeds of the motor (rad/s) over a period, and their weights (s); `ratio`: of its speed over the clutch shaft's."""
    speeds, weights = list[Array](), list[Array]()
    for trail, factor, _begin in sides:
        times, owners, lasting = trail.gauss()
        speeds.append(trail.states(times, owners)[1] * factor * ratio)
        weights.append(lasting)
    return np.concatenate(speeds), np.concatenate(weights)


def drive_load(strokes: Strokes, sides: list[Side], period: float) -> dict[str, float | None]:
    """Torque of the drive over time (N m), and the mean heat of its motor (W), None if its type does not give it."""
    ratio, motor = motor_ratio(strokes), strokes.scene.motor
    speeds, weights = _gauss(sides, ratio)
    torques = drive_torque(strokes, speeds)
    heat = None if motor is None or motor.heated is None else float(weights @ np.asarray(motor.total_heat(speeds)))
    return {
        "motor_torque_mean": float(weights @ torques) / period,
        "motor_torque_rms": math.sqrt(float(weights @ torques**2) / period),
        "motor_torque_peak": _greatest(sides, lambda speeds: np.abs(drive_torque(strokes, ratio * speeds)))[0],
        "motor_heat": None if heat is None else heat / period,
    }


def _greatest(sides: list[Side], value: Callable[[Array], Array]) -> tuple[float, float]:
    """The greatest value along the driving side, a function of the speed of the clutch's shaft (rad/s), and its time (s)."""

    def along(trail: Trail, factor: float) -> Callable[[Array, Index], Array]:
        return lambda times, owners: value(trail.states(times, owners)[1] * factor)

    tops = [(trail.greatest(along(trail, factor)), begin) for trail, factor, begin in sides]
    return max(((most, begin + time) for (time, most), begin in tops), key=lambda top: top[0])


def inverter_loads(strokes: Strokes, phases: Phases) -> tuple[Trip, ...]:
    """The greatest current over the motor's rated one, and the greatest power (W) that it returns; none without an inverter.

    Each with the limit beyond which the inverter trips. Power that is returned charges its capacitors, whose energy is
    neglected; power below a small share of the rated one is within rounding and does not count as returned.
    """
    motor, ratio = strokes.scene.motor, motor_ratio(strokes)
    if motor is None or motor.inverter is None or motor.rated is None:
        return ()

    def current(speeds: Array) -> Array:
        share = motor.current_share(ratio * speeds)
        return 0.0 * speeds if share is None else share

    def returned(speeds: Array) -> Array:
        return -motor.input_power(ratio * speeds, motor.torque(ratio * speeds))

    loads, sides = list[Trip](), driving_sides(strokes, phases)
    for value, (kind, limit) in zip((current, returned), motor.inverter.limits, strict=True):
        most, time = _greatest(sides, value)
        angle = float(crank_at(phases, np.array([time]))[0, 0])
        loads.append(Trip(kind, most, max(limit, _NO_POWER * motor.rated.power * (value is returned)), angle, time))
    return tuple(loads)


def servo_load(strokes: Strokes, phases: Phases) -> ServoLoad | None:
    """The motion of a servo drive in its area of torque and speed over a period; None for another drive.

    Its ratio of inertias is that of the driving side alone, as between strokes.
    """
    motor, ratio, sides = strokes.scene.motor, motor_ratio(strokes), driving_sides(strokes, phases)
    if motor is None or motor.peak(0.0) is None:
        return None
    speeds, weights = _gauss(sides, ratio)
    mean = float(weights @ np.abs(speeds)) / phases.period
    rms = math.sqrt(float(weights @ motor.torque(speeds) ** 2) / phases.period)
    limit = float(motor.continuous(mean))
    share, time = _greatest(sides, lambda speeds: share_of_peak(motor, ratio * speeds))
    at = np.array([time])
    there, angle = ratio * float(_driving_speeds(strokes, phases, at)[0]), float(crank_at(phases, at)[0, 0])
    inertia = driving_inertia(strokes) / ratio**2 / motor.inertia - 1.0 if motor.inertia else None
    off = {"peak_share": 24.0 * ROUNDING}
    return ServoLoad(mean, rms, limit, rms / limit, float(motor.torque(there)), there, angle, share, inertia, off)


def temperature(strokes: Strokes, sides: list[Side]) -> Temperature | None:
    """Rise of the motor's windings over an endless series of strokes; None without `thermal`."""
    motor = strokes.scene.motor
    if motor is None or motor.thermal is None:
        return None
    half, shares = list[Array](), list[Array]()
    for trail, factor, _begin in sides:
        times, owners = trail.within(0.5 * (1.0 + cells.NODES))
        speeds = trail.states(times, owners)[1].reshape(len(trail.stretches), -1)[:, 1:-1] * factor
        half.append(0.5 * np.diff(trail.t))
        shares.append(motor.heat_share(motor_ratio(strokes) * speeds))
    losses = np.concatenate(shares)
    return greatest_rise(motor.thermal, np.concatenate(half), np.ones_like(losses), losses)


def motor_limits(motor: Motor | None, load: Mapping[str, Any]) -> dict[str, tuple[str, float]]:
    """The figures of the motor's torque and heat over time, with its rated ones; empty without a rated point."""
    if motor is None or motor.rated is None:
        return {}
    limits = {MOTOR_TORQUE: ("motor_torque_rms", motor.rated.torque)}
    if load["motor_heat"] is not None:
        limits[MOTOR_HEAT] = "motor_heat", motor.rated_total_heat
    return limits


def limited_figures(strokes: Strokes, phases: Phases, names: Iterable[str]) -> dict[str, float]:
    """The figures of limits along a stroke, those of the motor over its rated ones."""
    sides, motor, names = driving_sides(strokes, phases), strokes.scene.motor, [*names]
    extra = {IRREGULARITY: speed_extremes(sides)[0].irregularity} if IRREGULARITY in names else {}
    if motor is not None and motor.rated is not None and names != [*extra]:
        load = drive_load(strokes, sides, phases.period)
        extra["motor_torque"] = (load["motor_torque_peak"] or 0.0) / motor.rated.torque
        rated = zip(("motor_rms", "motor_heat"), motor_limits(motor, load).values(), strict=False)
        extra |= {name: (load[key] or 0.0) / limit for name, (key, limit) in rated}
    return {name: extra[name] for name in names}
