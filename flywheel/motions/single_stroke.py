"""The load of flywheel, clutch, brake and motor of a machine that works stroke by stroke (`single_stroke`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bondgraph.numerics import root, summit, threshold
from flywheel.components import press_work
from flywheel.components.motors.thermal import Losses
from flywheel.components.motors.thermal import course as rise_over
from flywheel.components.press_work import Speeds
from flywheel.language import number
from flywheel.language import text as _
from flywheel.machine.dynamics import NODES, Trail
from flywheel.machine.machine import Machine
from flywheel.motions.motion import works_of
from flywheel.motions.strokes import (
    BRAKE,
    NAME,
    Phases,
    Ramp,
    Strokes,
    along_phases,
    check,
    crank_at,
    extreme,
    periodic,
    regaining,
    slip_heat,
    torque_at,
)
from flywheel.numerics.cells import Array, Index
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import figure
from flywheel.regime.state import DRIVE
from flywheel.scene.scene import TURN, Scene, rtol_faults
from flywheel.sizing.drive import trip_messages
from flywheel.sizing.findings import Finding
from flywheel.sizing.limits import asked_of
from flywheel.sizing.results import Limit, Trip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STEP, _LOOSER = 0.02, 100.0  # tolerance of steps, over that of figures, and of those that they are compared with
_FINEST, _COARSEST = 1e-12, 1e-6  # tolerances of steps
_RATE = 1e-6  # of a limit, to which the greatest rate is found
_SIGNALS, _SIGNAL_WIDTH = 25, 1e-6  # stop signals tried, and the width of time, of the stroke, to which the worst is found
_RECOVERED = 0.95  # of the drop of speed: what counts as recovered
_FAILS = 1e-4  # of a speed: to which that is found below which a stroke fails
_SLOWER = 0.93  # of a speed: the next that is tried
_NEAR_IDLE = 1e-7  # of the speed at which the drive idles: the clutch engages there after any time
_ADDING = 100.0  # tolerances of a step, which the errors of a stroke add up to
_NO_POWER = 1e-9  # of the rated power: less that is returned is rounding
_NO_CYCLE = (
    *("balance", "areas", "accumulated_max", "accumulated_min", "energy_fluctuation", "coefficient_of_energy"),
    *("angle_speed_max", "angle_speed_min", "reduced_inertia", "simulation"),
)
_NO_FLYWHEELS = "approximate", "approximate_total", "inertia_torque", "needed"
_NULL = "a machine that works stroke by stroke has no steady cycle: its crank stands still between strokes"
_TIME = "time of the stroke"
_MOTOR_SHARES = "motor torque", "motor heat"
_HOUR = 3600.0
_SAFETY = 2.0
_HEAVIEST = 1e5  # times the inertia on either side of the clutch, of a flywheel that is searched for


FINDINGS: tuple[Finding, ...] = (
    Finding("period", "s", "from one engagement of the clutch to the next", words=lambda: _("period")),
    Finding("rate", "1/s", "strokes a second", words=lambda: _("rate of strokes")),
    Finding("stroke_time", "s", "from engagement to standstill", words=lambda: _("from engagement to standstill")),
    Finding("speed_greatest", "rad/s", "of the flywheel's shaft", words=lambda: _("greatest speed of the flywheel")),
    Finding("speed_least", "rad/s", "of the flywheel's shaft", words=lambda: _("least speed of the flywheel")),
    Finding("irregularity", "", "(greatest - least)/mean of these two", words=lambda: _("irregularity")),
    Finding(
        "recovery_time", "s", "from the least speed until 95 % of its drop is made up", words=lambda: _("recovery time")
    ),
    Finding("wheel_energy", "J", "that flywheel and driving side give at most", words=lambda: _("energy from the flywheel")),
    Finding("slip_time", "s", "how long the clutch slips until it locks", words=lambda: _("clutch slips for")),
    Finding("lock_angle", "rad", "crank angle at which the clutch locks", words=lambda: _("clutch locks at")),
    Finding("clutch_torque", "N m", "the greatest that the locked clutch passes", words=lambda: _("clutch torque, locked")),
    Finding("second_slip_time", "s", "for which it slips again under the work", words=lambda: _("clutch slips again for")),
    Finding("second_slip_angle", "rad", "crank angle where that begins", words=lambda: _("clutch slips again from")),
    Finding("second_slip_heat", "J", "of that, in the clutch's heat", words=lambda: _("heat of slipping again")),
    Finding("clutch_heat", "J", "of the clutch in a period", words=lambda: _("clutch heat a period")),
    Finding("clutch_heat_per_hour", "J", "of the clutch", words=lambda: _("clutch heat an hour")),
    Finding("brake_heat", "J", "of the brake in a period", words=lambda: _("brake heat a period")),
    Finding("brake_heat_per_hour", "J", "of the brake", words=lambda: _("brake heat an hour")),
    Finding("brake_angle", "rad", "of the crank from putting the brake on to standstill", words=lambda: _("braking angle")),
    Finding("stopping_time", "s", "from putting the brake on to standstill", words=lambda: _("stopping time")),
    Finding("overrun", "rad", "how far past stop_at the crank stands", words=lambda: _("overrun past stop_at")),
    Finding("emergency_time", "s", "from a stop signal to standstill at most", words=lambda: _("emergency stop within")),
    Finding("emergency_angle", "rad", "crank angle of that signal", words=lambda: _("longest from a signal at")),
    Finding("safety_distance", "m", "K T + C by ISO 13855", words=lambda: _("safety distance")),
    Finding("inch_angle", "rad", "that the crank turns by an inching touch", words=lambda: _("inching touch turns")),
    Finding("holding_torque", "N m", "of the brake at standstill, on its shaft", words=lambda: _("brake torque at rest")),
    Finding("mean_power", "W", "of the drive", words=lambda: _("mean power of the drive")),
    Finding("motor_torque_mean", "N m", "of the drive, over time", words=lambda: _("drive torque, mean")),
    Finding("motor_torque_rms", "N m", "of the drive, over time", words=lambda: _("drive torque, rms")),
    Finding("motor_torque_peak", "N m", "of the drive, in size", words=lambda: _("drive torque, greatest")),
    Finding("motor_heat", "W", "of the motor, mean over time", words=lambda: _("motor heat")),
    Finding("inverter_current", "", "greatest over the motor's rated one", words=lambda: _("current of the inverter")),
    Finding("power_returned", "W", "greatest that the motor returns", words=lambda: _("power returned to the inverter")),
    Finding("temperature", "K", "greatest rise of the motor's windings", words=lambda: _("greatest rise of the windings")),
    Finding("greatest_rate", "1/s", "at which the first load comes to its limit", words=lambda: _("greatest rate")),
    Finding("energy_residual", "", "drive's work less all heats and works of loads, over the drive's work"),
)
BY_KEY = {one.key: one for one in FINDINGS}


def share_name(name: str) -> str:
    """The name of a load over its limit in the language in use."""
    return {
        "motor torque": _("motor torque"),
        "motor heat": _("motor heat"),
        "motor temperature": _("temperature of the windings"),
        "inverter current": _("current of the inverter"),
        "braking resistor": _("power of the braking resistor"),
        "clutch torque": _("clutch torque"),
        "clutch heat a stroke": _("clutch heat a stroke"),
        "clutch heat an hour": _("clutch heat an hour"),
        "brake heat a stroke": _("brake heat a stroke"),
        "brake heat an hour": _("brake heat an hour"),
        "brake at rest": _("brake at rest"),
        "time of the stroke": _("time of the stroke"),
    }.get(name, name)


def rate_limit(found: SingleStroke) -> Iterator[str]:
    """The sentence on the greatest rate: which limit it meets."""
    if found.greatest_rate is None:
        return
    if found.greatest_rate == 0.0:
        yield _("Beyond its limit at any rate: {what}.", what=share_name(found.decides))
        return
    rate = number(figure(60.0 * found.greatest_rate, 60.0 * found.error["greatest_rate"], 4))
    yield _("At {rate} strokes a minute the limit is {what}.", rate=rate, what=share_name(found.decides))


@dataclass(frozen=True)
class SingleStroke:
    """One stroke among many alike, with the flywheel given or found. SI: s, rad, rad/s at the flywheel's shaft, N m, J, W.

    `period` is the time from one engagement of the clutch to the next (of `continuous` strokes together). `keeps_up`: the
    motor is loaded within its rating (by the root of the torque's mean square and, where known, by its heat). `irregularity`
    is (greatest - least speed)/mean of the two. `slip_time` and `lock_angle` are those of the clutch, `clutch_torque` the
    greatest torque while it is locked. `clutch_heat` and `brake_heat` are of one period. `brake_angle` is the angle that
    the crank turns from the brake's application to rest, in `stopping_time`; `overrun` its angle beyond `stop_at` at rest.
    `recovery_time` is that from the least speed until 95 % of the drop is recovered. `greatest_rate` (1/s) is that at which
    `decides` reaches its limit. `shares` are the limited loads over their limits. `error` has absolute errors,
    those of `shares` and `energy` under these names, and for `keeps_up` that of the motor's greatest share.
    `formulas` are what the formulas of presses give for some of the figures (`components.press_work`). `trips` are those of
    the motor's inverter, each where its cause is greatest; their times (s) count from the engagement of the clutch.
    `energy_residual`: the work of the motor less all heats and works of loads, over the work of the motor.
    """

    scene: Scene
    on: str
    inertia: float
    given: bool
    figures: Mapping[str, float | bool | str | None]
    formulas: Mapping[str, float]
    shares: Mapping[str, float]
    energy: Mapping[str, float]
    error: Mapping[str, Any]
    phases: Phases
    strokes: Strokes = field(repr=False)
    limits: Mapping[str, Limit]
    binding: str | None
    trips: tuple[Trip, ...]

    def __getattr__(self, name: str) -> Any:
        figures = self.__dict__.get("figures", {})
        if name in figures:
            return figures[name]
        raise AttributeError(name)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Sentences on an inverter that trips, loads beyond limits, and a clutch that slips under the work."""
        found = [*trip_messages(self.trips)]
        found += [f"{name}: {100 * share:.4g} % of its limit" for name, share in self.shares.items() if share > 1.0]
        if self.phases.slips:
            angle, time, heat = (self.figures[f"second_slip_{name}"] for name in ("angle", "time", "heat"))
            where = math.degrees(float(angle or 0.0) % TURN)
            found.append(
                f"the clutch slips again from crank angle {where:.4g} deg on, for {time:.4g} s, and heats by {heat:.4g} J"
            )
        return tuple(found)

    def plot(self, path: str | Path | None = None) -> Figure | None:
        """The picture of `flywheel size --plot`: written into a PNG, SVG or PDF file, or else as a figure of matplotlib."""
        import flywheel

        if path is None:
            return flywheel.notebooks.picture(self)
        flywheel.notebooks.save_picture(self, path)
        return None

    def report(self, path: str | Path, *, language: str | None = None, units: str = "si") -> None:
        """The worked report, written into an HTML or PDF file; `language` "en" or "es", `units` "si" or "us"."""
        import flywheel

        flywheel.report.write(self, path, language=language, units=units)

    def as_dict(self) -> dict[str, Any]:
        """The result for JSON: the keys of every sizing, null where they need a steady cycle, and `single_stroke`."""
        given, exact = (self.inertia, None) if self.given else (None, self.inertia)
        wheel = {"on": self.on, "inertia": given, "exact": exact, **dict.fromkeys(_NO_FLYWHEELS)}
        if self.limits:
            wheel |= {"limits": {name: limit.as_dict() for name, limit in self.limits.items()}, "binding": self.binding}
        off, power = self.error.get("inertia"), self.figures["mean_power"]
        error = {
            "exact": None if off is None else off / self.inertia,
            "power": self.error["mean_power"] / float(power or 1.0),
        }
        return {
            "title": self.scene.title,
            "reduction": "crank",
            "cycle": self.scene.cycle,
            "speed": None,
            "speed_asked": self.scene.speed,
            "irregularity": self.scene.irregularity,
            "power": power,
            **dict.fromkeys(_NO_CYCLE),
            "null_because": _NULL,
            "flywheel": wheel,
            "single_stroke": {
                **self.figures,
                "formulas": dict(self.formulas),
                "shares": dict(self.shares),
                "energy": dict(self.energy),
                "verdicts": list(self.verdicts),
                "trips": [trip._asdict() for trip in self.trips],
            },
            "error": {**dict.fromkeys(("simulation", *_NO_CYCLE)), **error, "single_stroke": dict(self.error)},
        }


def single_stroke(
    machine: Machine | Scene, rtol: float | None = None, *, rates: bool = True, near: SingleStroke | None = None
) -> SingleStroke:
    """The periodic stroke of a machine with clutch and brake, with its flywheel given, or sized for an irregularity.

    While the clutch slips it passes the torque T, whatever the speeds: J1 dw1/dt = M1 - T, J2 dw2/dt = M2 + T, and heats by
    T (w1 - w2). Two inertias that lock with nothing else acting lose J1 J2/(J1 + J2) (w1 - w2)²/2.

    Args:
        machine: a `Scene` with `[single_stroke]`, or its `Machine`.
        rtol: required relative accuracy of every figure but the greatest rate; the scene's own if None. Where it is not
            reached, the error says so.
        rates: False to leave out the search of the greatest rate, which then is None.
        near: the stroke of nearly the same machine, where the search of flywheel and stroke begins; no guess if None.

    Raises:
        SceneError: for a stroke that is not completed, with angle and time: a clutch that never locks or slips again, a
            machine that stalls, a brake that does not stop or hold the crank, a rate that leaves no time for the stroke.

    """
    scene = machine.scene if isinstance(machine, Machine) else machine
    if scene.single_stroke is None:
        raise SceneError([Fault("single_stroke", "nothing", "a table with rate or idle")])
    check(scene)
    if not scene.has_flywheel:
        raise SceneError([Fault("flywheel", "nothing", "a table with irregularity or inertia")])
    rtol = float(scene.rtol if rtol is None else rtol)
    if faults := rtol_faults(rtol):
        raise SceneError(faults)
    tolerance = min(max(_STEP * rtol, _FINEST), _COARSEST)
    with np.errstate(all="ignore"):
        limits, binding, closest = dict[str, Limit](), None, max(_SIZED, _STEP * rtol)
        if scene.inertia is None:
            strokes, phases, limits, binding = _sized(scene, tolerance, closest, near)
        else:
            strokes = Strokes(scene, scene.inertia, tolerance, None if near is None else near.strokes)
            phases = periodic(strokes, None if near is None else near.phases)
        inertia, rougher = strokes.inertia, Strokes(scene, strokes.inertia, _LOOSER * tolerance, strokes)
        tight, loose = _Run.of(strokes, phases), _Run.of(rougher, periodic(rougher, phases))
        both = (strokes, tight), (rougher, loose)
        for each, one in both:
            touch = each.plan.inch
            one.figures.update(_emergency(each, one.phases), inch_angle=None if touch is None else each.inching(touch))
        greatest, decides, off = None, None, 0.0
        if rates:
            roughest = Strokes(scene, inertia, max(_LOOSER * tolerance, _COARSEST), strokes)
            greatest, decides, off = _greatest_rate(roughest, loose)
    figures = {**tight.figures, "greatest_rate": greatest, "decides": decides}
    shares = tight.shares
    error: dict[str, Any] = _off(tight.figures, loose.figures)
    error |= {"shares": _off(shares, loose.shares), "energy": _off(tight.energy, loose.energy), "greatest_rate": off}
    if tight.figures["temperature"] is not None:  # what constant losses about each node leave out
        coarse = _temperature(strokes, _driving_sides(strokes, tight.phases), 2)
        error["temperature"] += abs(tight.figures["temperature"] - (coarse or 0.0))
    if figures["keeps_up"] is not None:
        error["keeps_up"] = max(error["shares"][name] for name in _MOTOR_SHARES if name in shares)
    if scene.inertia is None:
        name = binding or "irregularity"
        kept, rough = (_limited(one, run.phases, [name])[name] / asked_of(scene)[name] for one, run in both)
        error["inertia"] = inertia * (closest + _SAFETY * (abs(kept - 1.0) * (inertia > 0.0) + abs(kept - rough)))
    return SingleStroke(
        scene,
        scene.flywheel_on,
        inertia,
        scene.inertia is not None,
        figures,
        _by_formulas(strokes, tight),
        shares,
        tight.energy,
        error,
        tight.phases,
        strokes,
        limits,
        binding,
        tuple(one for one in _inverter_loads(strokes, tight.phases) if one.value > one.limit),
    )


def _off(tight: Mapping[str, Any], loose: Mapping[str, Any]) -> dict[str, float]:
    """Absolute errors of figures: the difference to a run with a greater tolerance, doubled, and rounding."""
    pairs = {name: (value, loose[name]) for name, value in tight.items() if isinstance(value, float)}
    return {name: _SAFETY * abs(one - other) + 1e-13 * abs(one) for name, (one, other) in pairs.items()}


# -- the figures of a stroke ------------------------------------------------------------------------------------------


class _Run(NamedTuple):
    """A periodic stroke with its figures, loads over their limits, and energies (J in a period)."""

    phases: Phases
    figures: dict[str, Any]
    shares: dict[str, float]
    energy: dict[str, float]

    @classmethod
    def of(cls, strokes: Strokes, found: Phases) -> _Run:
        """The speeds of a stroke that returns."""
        energy = _energy(strokes, found)
        figures = _figures(strokes, found, energy)
        return cls(found, figures, _shares(strokes, found, figures), energy)


def _figures(strokes: Strokes, found: Phases, energy: Mapping[str, float]) -> dict[str, Any]:
    """All figures but the greatest rate."""
    plan, wheel = strokes.plan, strokes.wheel
    sides = _driving_sides(strokes, found)
    speeds, slowest = _speeds(sides)
    slips, locked = found.slips, [leg.driven for leg in found.legs if not leg.sense]
    drive = _drive_load(strokes, sides, found.period)
    fed: list[float | None] = [*(max(one.value, 0.0) for one in _inverter_loads(strokes, found))] or [None, None]
    hours = _HOUR / found.period
    within = [share <= 1.0 for share in _motor_shares(strokes, drive).values()]
    return {
        "period": found.period,
        "rate": plan.continuous / found.period,
        "keeps_up": all(within) if within else None,
        "speed_greatest": speeds.high * wheel,
        "speed_least": speeds.low * wheel,
        "irregularity": speeds.irregularity,
        "slip_time": found.lock_time,
        "lock_angle": found.lock_angle,
        "clutch_torque": strokes.clutch.static_torque if slips else max(map(strokes.greatest_passed, locked)),
        "second_slip_time": float(sum(leg.end - leg.begin for leg in slips)),
        "second_slip_angle": float(slips[0].driven.start.phi) if slips else None,
        "second_slip_heat": float(sum(slip_heat(leg, strokes.ratio) for leg in slips)),
        "clutch_heat": energy["clutch_heat"],
        "clutch_heat_per_hour": energy["clutch_heat"] * hours,
        "brake_heat": energy["brake_heat"],
        "brake_heat_per_hour": energy["brake_heat"] * hours,
        "brake_angle": found.rest - strokes.brakes_at,
        "stopping_time": found.stop_time - found.brake_time,
        "overrun": found.rest - plan.stop_at - plan.continuous * TURN,
        "stroke_time": found.stop_time,
        "recovery_time": _recovery(sides, speeds.low, slowest, found),
        "wheel_energy": 0.5 * driving_inertia(strokes) * (found.begin[0] ** 2 - speeds.low**2),
        "holding_torque": abs(found.resting) / strokes.scene.shafts[strokes.brake.on],
        "mean_power": energy["motor"] / found.period,
        **drive,
        "inverter_current": fed[0],
        "power_returned": fed[1],
        "temperature": _temperature(strokes, sides),
        "energy_residual": energy["residual"] / energy["motor"] if energy["motor"] else energy["residual"],
    }


# -- the course of a period --------------------------------------------------------------------------------------------


class Course(NamedTuple):
    """A period at times (s), each jump twice: before and after it. Works (J) count from the engagement of the clutch.

    `driving` is the speed of the clutch's shaft, `crank` that of the crank as if at that shaft (rad/s), `phi` the crank
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


def course(found: SingleStroke, count: int) -> Course:
    """The course of a period, at about so many times, ends of phases among them."""
    strokes, phases = found.strokes, found.phases
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
    phi, crank = crank_at(phases, inside)
    driving = _driving_speeds(strokes, phases, inside)
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS_POINTS)
    half = 0.5 * np.diff(time)[:, None]
    between = (0.5 * (time[:-1] + time[1:])[:, None] + half * nodes).ravel()
    ratio = _motor_ratio(strokes)
    speeds = ratio * _driving_speeds(strokes, phases, between)
    power = (_torque(strokes, speeds) * speeds).reshape(half.shape[0], -1)
    drive_work = np.concatenate(([0.0], np.cumsum((half * weights * power).sum(axis=1))))
    inertia = driving_inertia(strokes)
    return Course(
        time,
        phi,
        driving,
        strokes.ratio * crank,
        _clutch_torque(strokes, phases, inside),
        _brake_torque(strokes, phases, inside),
        _torque(strokes, ratio * driving),
        drive_work,
        0.5 * inertia * (driving[0] ** 2 - driving**2),
    )


def _switches(trail: Trail) -> Array:
    """The times (s) within a motion at which its laws change."""
    pairs = zip(trail.stretches[:-1], trail.stretches[1:], strict=True)
    return np.array([one.step.end for one, other in pairs if one.anchor != other.anchor], dtype=float)


def driven_inertia(strokes: Strokes, phases: Phases) -> float:
    """I* of the driven side (kg m² at the crank) where the crank stands as the clutch engages."""
    rest = phases.begin[1]
    return float(strokes.driven.at(rest, rest, 0.0).inertia)


def driving_inertia(strokes: Strokes) -> float:
    """All that turns on the driving side (kg m² at the clutch's shaft), its flywheel included."""
    return float(strokes.driving.at(math.pi, math.pi, strokes.typical * strokes.ratio, 0.0).inertia)


def _driving_speeds(strokes: Strokes, phases: Phases, times: Array) -> Array:
    """Speed (rad/s) of the clutch's shaft."""
    speeds: Array = along_phases(
        times, [(trail, clock, factor) for trail, factor, clock in _driving_sides(strokes, phases)]
    )[1]
    return speeds


def _clutch_torque(strokes: Strokes, phases: Phases, times: Array) -> Array:
    """The torque (N m) that the clutch gives to the driven side."""
    found = np.zeros(times.size)
    for leg in phases.legs:
        mine = (times >= leg.begin) & (times < leg.end)
        on_clock = times[mine] - leg.clock
        if leg.sense:
            found[mine] = leg.sense * torque_at(leg.torque, on_clock)
        elif mine.any():
            found[mine] = strokes.locked_torque(leg.driven, on_clock, leg.driven.owners(on_clock))
    return found


def _brake_torque(strokes: Strokes, phases: Phases, times: Array) -> Array:
    """The torque (N m) of the brake on its shaft: against the motion, and at rest the holding torque."""
    brake, found = strokes.brake, np.zeros(times.size)
    since, released = times - phases.brake_time, times < brake.fall
    acts = (since >= 0.0) & (times <= phases.stop_time)
    found[acts] = -torque_at(Ramp(brake.torque, 0.0, brake.rise), since[acts])
    found[times > phases.stop_time] = -phases.resting / strokes.scene.shafts[brake.on]
    if brake.fall > 0.0:
        found[released] = -torque_at(Ramp(brake.torque, 0.0, brake.fall, True), times[released])
    return found


def _by_formulas(strokes: Strokes, run: _Run) -> dict[str, float]:
    """Figures by the formulas of presses: a clutch alone against inertias, then the work as a blow from the flywheel."""
    inertia, speed = driving_inertia(strokes), run.phases.begin[0]
    clutch, energy, period = strokes.clutch, max(run.energy["loads"], 0.0), run.phases.period
    behind = driven_inertia(strokes, run.phases)
    joined = press_work.engage(inertia, speed, behind / strokes.ratio**2, torque=clutch.torque)
    press = press_work.press_cycle(energy, period, 0.0)
    at_once = joined.time or 0.0  # of a torque without a rise; the impulse is the same with one
    slip = at_once + 0.5 * clutch.rise if at_once >= 0.5 * clutch.rise else math.sqrt(2.0 * at_once * clutch.rise)
    found = {"clutch_heat": joined.heat, "slip_time": slip}
    found |= {"wheel_energy": press.given, "mean_power": press.power}
    try:
        stroke = press_work.single_stroke(inertia, speed, energy, behind / strokes.ratio**2)
    except SceneError:  # the formula lets the wheel stop
        return found
    return found | {"speed_least": stroke.speed * strokes.wheel}


def _emergency(strokes: Strokes, found: Phases) -> dict[str, float | None]:
    """The longest stop from a signal while the clutch holds, and the distance that a hand needs meanwhile (ISO 13855).

    At the signal the clutch holds for its `hold` and its `fall`; then it lets go, and the brake is put on.
    """
    plan = strokes.plan
    if plan.approach is None:
        return dict.fromkeys(("emergency_time", "emergency_angle", "safety_distance"))
    wait = strokes.clutch.hold + strokes.clutch.fall
    last = max(found.release_time - wait - found.lock_time, 0.0)

    def lasts(signal: float) -> float:
        phi, omega = crank_at(found, np.array([found.lock_time + signal + wait]))[:, 0].tolist()
        return wait + float(strokes.braked_from(phi, omega).t[-1])

    signals = np.linspace(0.0, last, _SIGNALS)
    times = [lasts(signal) for signal in signals.tolist()]
    top = int(np.argmax(times))
    ends = float(signals[max(top - 1, 0)]), float(signals[min(top + 1, _SIGNALS - 1)])
    when, longest = summit(lasts, *ends, _SIGNAL_WIDTH * last)
    if times[top] >= longest:
        when, longest = float(signals[top]), times[top]
    stopping = plan.response + longest
    return {
        "emergency_time": stopping,
        "emergency_angle": float(crank_at(found, np.array([found.lock_time + when]))[0, 0]),
        "safety_distance": press_work.safety_distance(plan.approach, stopping, plan.intrusion),
    }


_Side = tuple[Trail, float, float]
"""A motion of the driving side, the factor from its speed to the clutch shaft's, and its clock (s)."""


def _driving_sides(strokes: Strokes, found: Phases) -> list[_Side]:
    """The driving side over a whole period."""
    legs = [(leg.driving, 1.0 if leg.sense else strokes.ratio, leg.clock) for leg in found.legs]
    return [*legs, (found.recovery, 1.0, found.release_time)]


def _speeds(sides: list[_Side]) -> tuple[Speeds, float]:
    """The extremes of the driving side's speed in a period, on the clutch's shaft, and when (s) it is least."""
    least, when = _greatest(sides, lambda speeds: -speeds)
    return Speeds(_greatest(sides, lambda speeds: speeds)[0], -least), when


def _recovery(sides: list[_Side], least: float, when: float, found: Phases) -> float:
    """The time (s) from the least speed until most of the drop is recovered."""
    level = least + _RECOVERED * (found.speed - least)
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
    return found.period - when


def _gauss(sides: list[_Side], ratio: float) -> tuple[Array, Array]:
    """Speeds of the motor (rad/s) over a period, and their weights (s); `ratio`: of its speed over the clutch shaft's."""
    speeds, weights = list[Array](), list[Array]()
    for trail, factor, _begin in sides:
        times, owners, lasting = trail.gauss()
        speeds.append(trail.states(times, owners)[1] * factor * ratio)
        weights.append(lasting)
    return np.concatenate(speeds), np.concatenate(weights)


def _motor_ratio(strokes: Strokes) -> float:
    drive = strokes.scene.drive
    assert drive is not None
    return strokes.scene.shafts[drive.on] / strokes.ratio


def _torque(strokes: Strokes, speeds: Array) -> Array:
    """Torque of the drive (N m) at speeds of its shaft, rad/s."""
    if strokes.scene.motor is not None:
        return np.asarray(strokes.scene.motor.torque(speeds))
    drive = strokes.scene.drive
    assert drive is not None
    values = {**strokes.scene.parameters, "omega": speeds, "phi": 0.0, "x": 0.0, "v": speeds}
    return np.asarray(drive.law.evaluate(values, np, values)) + 0.0 * speeds  # type: ignore[union-attr]


def _drive_load(strokes: Strokes, sides: list[_Side], period: float) -> dict[str, float | None]:
    """Torque of the drive over time (N m), and the mean heat of its motor (W), None if its type does not give it."""
    ratio, motor = _motor_ratio(strokes), strokes.scene.motor
    speeds, weights = _gauss(sides, ratio)
    torques = _torque(strokes, speeds)
    heat = None if motor is None or motor.heated is None else float(weights @ np.asarray(motor.total_heat(speeds)))
    return {
        "motor_torque_mean": float(weights @ torques) / period,
        "motor_torque_rms": math.sqrt(float(weights @ torques**2) / period),
        "motor_torque_peak": _greatest(sides, lambda speeds: np.abs(_torque(strokes, ratio * speeds)))[0],
        "motor_heat": None if heat is None else heat / period,
    }


def _greatest(sides: list[_Side], value: Callable[[Array], Array]) -> tuple[float, float]:
    """The greatest value along the driving side, a function of the speed of the clutch's shaft (rad/s), and its time (s)."""

    def along(trail: Trail, factor: float) -> Callable[[Array, Index], Array]:
        return lambda times, owners: value(trail.states(times, owners)[1] * factor)

    tops = [(extreme(trail, along(trail, factor)), begin) for trail, factor, begin in sides]
    return max(((most, begin + time) for (time, most), begin in tops), key=lambda top: top[0])


def _inverter_loads(strokes: Strokes, found: Phases) -> tuple[Trip, ...]:
    """The greatest current over the motor's rated one, and the greatest power (W) that it returns; none without an inverter.

    Each with the limit beyond which the inverter trips. Power that is returned charges its capacitors, whose energy is
    neglected; of power less than a share of the rated one rounding cannot tell that it is returned.
    """
    motor, ratio = strokes.scene.motor, _motor_ratio(strokes)
    if motor is None or motor.inverter is None or motor.rated is None:
        return ()

    def current(speeds: Array) -> Array:
        share = motor.current_share(ratio * speeds)
        return 0.0 * speeds if share is None else share

    def returned(speeds: Array) -> Array:
        return -motor.input_power(ratio * speeds, motor.torque(ratio * speeds))

    loads, sides = list[Trip](), _driving_sides(strokes, found)
    for value, (kind, limit) in zip((current, returned), motor.inverter.limits, strict=True):
        most, time = _greatest(sides, value)
        angle = float(crank_at(found, np.array([time]))[0, 0])
        loads.append(Trip(kind, most, max(limit, _NO_POWER * motor.rated.power * (value is returned)), angle, time))
    return tuple(loads)


def _temperature(strokes: Strokes, sides: list[_Side], together: int = 1) -> float | None:
    """The greatest rise (K) of the motor's windings over strokes that follow one another for ever; None without `thermal`.

    The losses count as constant about each node of Gauss' rule, or about so many `together`.
    """
    motor = strokes.scene.motor
    if motor is None or motor.thermal is None:
        return None
    speeds, weights = _gauss(sides, _motor_ratio(strokes))
    heats = (weights * motor.heat_share(speeds)).reshape(-1, together).sum(axis=1)
    times = weights.reshape(-1, together).sum(axis=1)
    return rise_over(motor.thermal, map(Losses, times.tolist(), (heats / times).tolist())).greatest


def _motor_shares(strokes: Strokes, load: Mapping[str, Any]) -> dict[str, float]:
    """The motor's torque and heat over time over its rated ones; empty without a rated point."""
    motor = strokes.scene.motor
    if motor is None or motor.rated is None:
        return {}
    torque, warmth = _MOTOR_SHARES
    found = {torque: load["motor_torque_rms"] / motor.rated.torque}
    if load["motor_heat"] is not None:
        found[warmth] = load["motor_heat"] / motor.rated_total_heat
    return found


def _shares(strokes: Strokes, found: Phases, figures: Mapping[str, Any]) -> dict[str, float]:
    """The loads that have limits, over these limits."""
    clutch, brake = strokes.clutch, strokes.brake
    shares, motor = _motor_shares(strokes, figures), strokes.scene.motor
    if motor is not None and motor.thermal is not None:
        shares["motor temperature"] = figures["temperature"] / motor.thermal.limit
    if motor is not None and motor.inverter is not None and figures["inverter_current"] is not None:
        shares["inverter current"] = figures["inverter_current"] / motor.inverter.overcurrent
        if motor.inverter.chopper_power is not None:
            shares["braking resistor"] = figures["power_returned"] / motor.inverter.chopper_power
    shares["clutch torque"] = figures["clutch_torque"] / clutch.static_torque
    for name, part in (("clutch", clutch), ("brake", brake)):
        if part.heat_per_stroke is not None:
            shares[f"{name} heat a stroke"] = figures[f"{name}_heat"] / part.heat_per_stroke
        if part.heat_per_hour is not None:
            shares[f"{name} heat an hour"] = figures[f"{name}_heat_per_hour"] / part.heat_per_hour
    shares["brake at rest"] = figures["holding_torque"] / brake.torque
    shares[_TIME] = found.stop_time / found.period
    return shares


# -- energy ------------------------------------------------------------------------------------------------------------


def _energy(strokes: Strokes, found: Phases) -> dict[str, float]:
    """Works and heats of one period, J, and their residual.

    By quadrature of every law over the motions apart from the stepping; the clutch's heat by the speeds of both its sides.
    """
    works: dict[str, float] = {}
    meshes = 0.0
    trails = [trail for leg in found.legs for trail in (leg.driving, leg.driven)[: 2 if leg.sense else 1]]
    for trail in (*trails, found.coasting, found.braking, found.recovery):
        if trail is None or not trail.stretches:
            continue
        parts, lost, _ = works_of(trail)
        meshes += lost
        for part, work in parts.items():
            works[part] = works.get(part, 0.0) + work
    motor = works.pop(DRIVE, 0.0)
    brake = -sum(work for part, work in works.items() if part.startswith(BRAKE))
    works = {part: work for part, work in works.items() if not part.startswith((f"{NAME} on", BRAKE))}
    clutch = float(sum(slip_heat(leg, strokes.ratio) for leg in found.legs if leg.sense))
    loads = -sum(works.values())
    energy = {"motor": motor, "loads": loads, "mesh_heat": meshes, "clutch_heat": clutch, "brake_heat": brake}
    return {**energy, "residual": motor - loads - meshes - clutch - brake}


# -- searches ----------------------------------------------------------------------------------------------------------

_SIZED = 1e-8  # relative, the closest to which a flywheel is found
_WIDER = 4.0  # times: how far the next flywheel lies from the last, where all are looked through; beside one that is near
_CLOSER = 1.1
_BROKEN = 1e-6  # of a limit: what is beyond it by more is not kept


def _sized(
    scene: Scene, tolerance: float, closest: float, near: SingleStroke | None
) -> tuple[Strokes, Phases, dict[str, Limit], str | None]:
    """The machine with the smallest flywheel that keeps all limits, its stroke, that for each limit, and the deciding one.

    A heavier flywheel keeps every limit better: the largest of those for single limits keeps all.
    """
    last: list[SceneError] = []
    begin: list[Phases] = [] if near is None else [near.phases]  # the last that returns: a guess of the next
    known: dict[float, Mapping[str, float]] = {}
    runs: dict[float, tuple[Strokes, Phases]] = {}
    asked = asked_of(scene)

    def reached(inertia: float) -> Mapping[str, float]:
        """The values compared with the limits; none if the stroke is not completed."""
        if inertia not in known:
            tried = Strokes(scene, inertia, tolerance, strokes)
            try:
                found = periodic(tried, begin[0] if begin else None)
            except SceneError as error:
                last[:], begin[:], known[inertia] = [error], [], {}
            else:
                begin[:], known[inertia], runs[inertia] = [found], _limited(tried, found, asked), (tried, found)
        return known[inertia]

    strokes = Strokes(scene, 1.0, tolerance, None if near is None else near.strokes)
    own = driving_inertia(strokes) - strokes.wheel**2
    crank = float(strokes.driven.at(0.0, 0.0, strokes.typical, 0.0).inertia)
    scale, step = max(own, crank / strokes.ratio**2) / strokes.wheel**2, _WIDER
    first = scale
    if near is not None and near.inertia > 0.0:
        first, step = near.inertia, _CLOSER

    def smallest(name: str) -> float:
        """The smallest flywheel that keeps one limit."""

        def above(inertia: float) -> float:
            """The relative excess over the limit; infinite where the stroke is not completed."""
            return reached(inertia).get(name, math.inf) / asked[name] - 1.0

        def within(place: float) -> float:
            over = above(1.0 / place)
            return over if abs(over) > closest else 0.0

        low = high = first
        while above(high) > 0.0:
            low, high = high, step * high if low == high else _WIDER * high
            if high > _HEAVIEST * scale and last and not known[low]:
                raise last[0]
            if high > _HEAVIEST * scale:
                found = f"{100.0 * asked[name]:.4g} %, and {100.0 * reached(low)[name]:.4g} % with {low:.3g} kg m²"
                path = f"flywheel.limits.{name}" if scene.limits else "flywheel.irregularity"
                raise SceneError([Fault(path, found, "a limit that a flywheel keeps", "a larger motor, or a lower rate")])
        while above(low) <= 0.0:
            if low < high and own > 0.0 and above(0.0) <= 0.0:
                return 0.0
            low, high = low / (step if low == high else _WIDER), low
        while math.isinf(above(low)):  # the least flywheel that carries the stroke through
            middle = math.sqrt(low * high)
            low, high = (middle, high) if above(middle) > 0.0 else (low, middle)
            if high / low < 1.0 + closest:
                return high
        return 1.0 / root(within, 1.0 / low, 1.0 / high)  # most limits are nearly straight lines of 1/inertia

    alone = {name: smallest(name) for name in asked}
    binding = max(alone, key=lambda name: alone[name])
    inertia = alone[binding]
    values = reached(inertia)
    limits = {name: Limit(asked[name], values[name], alone[name]) for name in scene.limits}
    for name, limit in limits.items():
        if limit.reached > limit.asked * (1.0 + _BROKEN):
            found = f"{100.0 * limit.reached:.4g} % with the {inertia:.5g} kg m² that {binding} needs"
            raise SceneError([Fault(f"flywheel.limits.{name}", found, "limits that one flywheel keeps", "allow more")])
    return *runs[inertia], limits, binding if limits else None


def _limited(strokes: Strokes, found: Phases, names: Iterable[str]) -> dict[str, float]:
    """The figures of limits along a stroke, those of the motor over its rated ones."""
    sides, motor = _driving_sides(strokes, found), strokes.scene.motor
    shown = {"irregularity": _speeds(sides)[0].irregularity}
    if motor is not None and motor.rated is not None:
        load = _drive_load(strokes, sides, found.period)
        shares = _motor_shares(strokes, load)
        shown["motor_torque"] = (load["motor_torque_peak"] or 0.0) / motor.rated.torque
        rows = zip(("motor_rms", "motor_heat"), _MOTOR_SHARES, strict=True)
        shown |= {name: shares[own] for name, own in rows if own in shares}
    return {name: shown[name] for name in names}


def _greatest_rate(strokes: Strokes, run: _Run) -> tuple[float, str, float]:
    """The greatest rate (1/s) within all limits, the load that decides it, and its error.

    The speed at which the clutch engages is the unknown: the sooner it engages again, the lower it is. The time until the
    driving side has it again is the period, so that no rate has to be tried at which no stroke returns.
    """
    count, known = strokes.plan.continuous, dict[float, tuple[float, str, float]]()
    nominal, idle = run.phases.begin[0], strokes.typical * strokes.ratio
    last = [run.phases]

    def over(speed: float) -> float:
        """The load that is greatest over its limit, less 1; infinite where the stroke fails.

        Of a clutch that slips under the work, the share of the period.
        """
        if speed not in known:
            try:
                tried = _Run.of(strokes, regaining(strokes, speed, last[0]))
            except SceneError as error:
                known[speed] = math.inf, f"{error.faults[0].path}: {error.faults[0].found}", 0.0
            else:
                last[0] = tried.phases
                excess = {each: share - 1.0 for each, share in tried.shares.items()}
                if tried.phases.slips:
                    excess["clutch torque"] = tried.figures["second_slip_time"] / tried.phases.period
                name = max(excess, key=lambda each: excess[each])
                known[speed] = excess[name], name, tried.phases.period
        return known[speed][0]

    low = high = nominal
    while over(high) > 0.0:
        low, high = high, idle - 0.2 * (idle - high)
        if idle - high < _NEAR_IDLE * idle:
            return 0.0, known[low][1], 0.0
    while over(low) <= 0.0:
        low *= _SLOWER
    if math.isinf(over(low)):
        low = threshold(lambda speed: math.isfinite(over(speed)), low, high, _FAILS * high)
        if over(low) <= 0.0:  # it fails before anything comes to its limit
            _, _, period = known[low]
            failing = max(each for each in known if each < low)
            step = abs(known[high][2] - period) / max(abs(high - low), 1e-300) if high > low else 0.0
            return count / period, known[failing][1], count / period**2 * step * (low - failing)
    limit = root(lambda speed: over(speed) if abs(over(speed)) > _RATE else 0.0, low, high)
    (off, name, period), others = known[limit], [each for each in known if each != limit and known[each][2] > 0.0]
    other = min(others, key=lambda each: abs(each - limit))
    steepness = abs((known[other][0] - off) / (known[other][2] - period))
    return count / period, name, count / period**2 * (abs(off) + _RATE + _ADDING * strokes.rtol) / steepness
