"""The load of flywheel, clutch, brake and motor of a machine that works stroke by stroke (`single_stroke`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bondgraph.numerics import root, summit
from flywheel.components import press_work
from flywheel.components.motors.thermal import Temperature
from flywheel.language import message, number
from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.motions.motion import works_of
from flywheel.motions.stroke_course import (
    MOTOR_HEAT,
    MOTOR_TORQUE,
    crank_at,
    drive_load,
    driven_inertia,
    driving_inertia,
    driving_sides,
    inverter_loads,
    limited_figures,
    motor_limits,
    recovery_time,
    servo_load,
    slip_heat,
    speed_extremes,
    temperature,
)
from flywheel.motions.strokes import BRAKE, NAME, NEAR_STOP, Phases, Strokes, check, fitted, holding, periodic, regaining
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import figure
from flywheel.regime.state import DRIVE
from flywheel.scene.scene import TURN, Scene, rtol_faults
from flywheel.sizing.drive import trip_messages
from flywheel.sizing.findings import Finding
from flywheel.sizing.limits import requirements_of
from flywheel.sizing.motor import IRREGULARITY
from flywheel.sizing.results import Limit, Trip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STEP, _LOOSER = 0.02, 100.0  # tolerance of steps, over that of figures, and of those that they are compared with
_FINEST, _COARSEST = 1e-12, 1e-6  # tolerances of steps
_RATE = 1e-5  # of a limit, to which the greatest rate is found
_SIGNALS, _SIGNAL_WIDTH = 25, 0.1  # stop signals tried; to which the worst is found, times the root of a step's tolerance
_FAILS = 1e-3  # of that lack: to which that is found beyond which a stroke fails
_SLOWER, _FASTER = 1.6, 0.3  # of the logarithm of what a speed lacks to that of idling: steps to the next that is tried
_NEAR_IDLE = 1e-7  # of the speed at which the drive idles: the clutch engages there after any time
_LONGEST_WAIT, _WAITING = 3.0, 0.1  # of the logarithm of the period over that after which the drive idles: most, and a step
_NEIGHBOUR = 0.2  # relative: by how much a stroke may differ from one whose errors, times the latter, serve for it
_LIKENESS = frozenset(("inertia", "period", "speed_least", "slip_time", "clutch_heat", "brake_heat", "mean_power"))
_ADDING = 100.0  # tolerances of a step, which the errors of a stroke add up to
_OF_STEPS = 10.0  # the same of a figure: of steps that are the same at a greater tolerance
_NO_CYCLE = (
    *("balance", "areas", "accumulated_max", "accumulated_min", "energy_fluctuation", "coefficient_of_energy"),
    *("angle_speed_max", "angle_speed_min", "reduced_inertia", "simulation"),
)
_NO_FLYWHEELS = "approximate", "approximate_total", "inertia_torque", "needed"
_NULL = "a machine that works stroke by stroke has no steady cycle: its crank stands still between strokes"
_TIME, _RECOVERY = "time of the stroke", "recovery of the drive"
_LOADS_OF = {
    "clutch": ("clutch torque", "clutch heat a stroke", "clutch heat an hour"),
    "brake": ("brake at rest", "brake heat a stroke", "brake heat an hour"),
    "motor": (MOTOR_TORQUE, MOTOR_HEAT, "motor temperature", "inverter current", "braking resistor"),
}
_SERVO = "mean_speed", "continuous_share", "peak_speed", "peak_share", "inertia_ratio"
_HOUR, _SAFETY, _CARRIED = 3600.0, 2.0, 1.5
_HEAVIEST, _LIGHTEST = 1e5, 1e-3  # times the inertia on either side of the clutch, of flywheels that are searched for
_HEAVIEST_GIVEN = 1e7  # times the same: a flywheel whose speed a stroke changes by no more than what rounding leaves


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
    Finding("servo_mean_speed", "rad/s", "of a servo drive's shaft, over time; its torque there is `motor_torque_rms`"),
    Finding("servo_continuous_share", "", "that torque over the continuous curve at that speed"),
    Finding("servo_peak_speed", "rad/s", "of its shaft, where its torque is the largest share of the peak curve"),
    Finding("servo_peak_share", "", "that share; 1 if the peak curve limits the torque"),
    Finding("servo_inertia_ratio", "", "inertia that it moves between strokes, at its shaft, over its rotor's"),
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
        _TIME: _("time of the stroke"),
        _RECOVERY: _("recovery of the drive"),
    }.get(name) or message(name)


def exceeds(share: float, error: float) -> bool:
    """Tests whether a load is over its limit by more than its error, and by more than a limit is sized to.

    >>> exceeds(1.0 + 1e-9, 0.0), exceeds(1.01, 1e-9)
    (False, True)
    """
    return share > 1.0 + max(error, _BROKEN)


class Verdict(NamedTuple):
    """The answer whether a part suffices for the rate, None without a limit, and its `load` that is greatest over its limit.

    `share` is that load over its limit, `unknown` the key of the heat that has no limit.
    """

    part: str
    suffices: bool | None
    load: str | None
    share: float | None
    unknown: str | None


def verdicts_of_parts(result: SingleStroke) -> tuple[Verdict, ...]:
    """The answers whether flywheel, clutch, brake and motor each suffice for the rate.

    A flywheel suffices that carries the stroke and keeps its limits, as others are refused. A clutch does not if it slips
    under the work, a brake if the crank passes `stop_at` by more than ten degrees, a motor if its inverter trips.
    """
    verdicts = [Verdict("flywheel", True, None, None, None)]
    fails = {"clutch": bool(result.phases.slips), "brake": result.overrun > NEAR_STOP, "motor": bool(result.trips)}
    for part, names in _LOADS_OF.items():
        loads = {name: result.shares[name] for name in names if name in result.shares}
        top = max(loads, key=lambda name: loads[name], default=None)
        failing = fails[part] or any(exceeds(share, result.error["shares"][name]) for name, share in loads.items())
        known = any(part == "motor" or "heat" in name for name in loads)
        if part != "motor" or result.scene.motor is not None:
            unknown = None if known or part == "motor" else f"{part}_heat_per_hour"
            suffices = False if failing else known or None
            verdicts.append(Verdict(part, suffices, top, None if top is None else loads[top], unknown))
    return tuple(verdicts)


def brake_for_stop(result: SingleStroke) -> tuple[float | None, float] | None:
    """The brake that would stop the crank at `stop_at`: its crank angle (rad), or else its torque (N m).

    From the work of the brake, which absorbs the same energy; the angle is None where the clutch still acts. None if the
    crank stops within ten degrees.
    """
    strokes, overrun = result.strokes, result.overrun
    way = result.brake_angle - overrun
    if abs(overrun) <= NEAR_STOP or way <= 0.0:
        return None
    earlier = strokes.brakes_at - overrun
    possible = strokes.end <= earlier < strokes.brakes_at + way
    return earlier % TURN if possible else None, strokes.brake.torque * result.brake_angle / way


def rate_limit(stroke: SingleStroke) -> Iterator[str]:
    """The sentence on the greatest rate and the limit that it reaches."""
    if stroke.greatest_rate is None:
        return
    if stroke.greatest_rate == 0.0:
        rate = number(f"{60.0 * stroke.error['greatest_rate']:.2g}")
        yield _("Beyond its limit at {rate} strokes a minute and more: {what}.", rate=rate, what=share_name(stroke.decides))
        return
    rate = number(figure(60.0 * stroke.greatest_rate, 60.0 * stroke.error["greatest_rate"], 4))
    yield _("At {rate} strokes a minute the limit is: {what}.", rate=rate, what=share_name(stroke.decides))


@dataclass(frozen=True)
class SingleStroke:
    """One stroke of many equal ones, with the flywheel given or sized. SI: s, rad, rad/s at the flywheel's shaft, N m, J, W.

    `period` is the time from one engagement of the clutch to the next (of `continuous` strokes together). `keeps_up`: the
    motor is loaded within its rating (by the root of the torque's mean square and, where known, by its heat). `irregularity`
    is (greatest - least speed)/mean of the two. `slip_time` and `lock_angle` are those of the clutch, `clutch_torque` the
    greatest torque while it is locked. `clutch_heat` and `brake_heat` are of one period. `brake_angle` is the angle that
    the crank turns from the brake's application to rest, in `stopping_time`; `overrun` its angle beyond `stop_at` at rest.
    `recovery_time` is that from the least speed until 95 % of the drop is recovered. `greatest_rate` (1/s) is that at which
    `decides` reaches its limit. `shares` are the limited loads over their limits. `error` has absolute errors,
    those of `shares` and `energy` under these names, and for `keeps_up` that of the motor's greatest share.
    `formulas` has some of the figures by the formulas of presses (`components.press_work`). `trips` are those of
    the motor's inverter, each where its cause is greatest; their times (s) count from the engagement of the clutch.
    `energy_residual`: the work of the motor less all heats and works of loads, over the work of the motor. `compared` is the
    neighbouring stroke whose errors are used for this one, None if they are its own.
    """

    scene: Scene
    on: str
    inertia: float
    is_analysis: bool
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
    compared: SingleStroke | None = field(default=None, repr=False)

    def __getattr__(self, name: str) -> Any:
        figures = self.__dict__.get("figures", {})
        if name in figures:
            return figures[name]
        raise AttributeError(name)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Sentences on trips, loads beyond limits, a clutch that slips under the work, and a crank far from its stop."""
        messages = [*trip_messages(self.trips)]
        messages += [
            f"{name}: {100 * share:.4g} % of its limit"
            for name, share in self.shares.items()
            if exceeds(share, self.error["shares"][name])
        ]
        if self.phases.slips:
            angle, time, heat = (self.figures[f"second_slip_{name}"] for name in ("angle", "time", "heat"))
            where = math.degrees(float(angle or 0.0) % TURN)
            messages.append(
                f"the clutch slips again from crank angle {where:.4g} deg on, for {time:.4g} s, and heats by {heat:.4g} J"
            )
        if (mended := brake_for_stop(self)) is not None:
            brake = f"a brake of about {mended[1]:.3g} N m"
            if mended[0] is not None:
                brake = f"its brake put on at about {math.degrees(mended[0]):.3g} deg, or with {brake}"
            side = "past stop_at" if self.overrun > 0.0 else "before stop_at"
            stop = math.degrees(abs(self.overrun))
            messages.append(f"the crank stops {stop:.4g} deg {side}; it would stop there with {brake}")
        return tuple(messages)

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
        analysed_inertia, exact = (self.inertia, None) if self.is_analysis else (None, self.inertia)
        wheel = {"on": self.on, "inertia": analysed_inertia, "exact": exact, **dict.fromkeys(_NO_FLYWHEELS)}
        if self.limits:
            wheel |= {"limits": {name: limit.as_dict() for name, limit in self.limits.items()}, "binding": self.binding}
        off, power = self.error.get("inertia"), self.figures["mean_power"]
        error = {
            "exact": None if off is None else off / (self.inertia or 1.0),
            "power": self.error["mean_power"] / float(power or 1.0),
            "limits": {name: max(one.reached_error, one.alone_error) for name, one in self.limits.items()} or None,
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
                "suffices": {one.part: one.suffices for one in verdicts_of_parts(self)},
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
    T (w1 - w2). Two inertias that lock without other torques lose J1 J2/(J1 + J2) (w1 - w2)²/2.

    Args:
        machine: a `Scene` with `[single_stroke]`, or its `Machine`.
        rtol: required relative accuracy of every figure except the greatest rate; the scene's own if None. If it is not
            reached, the error shows it.
        rates: False to leave out the search for the greatest rate, which is then None.
        near: the stroke of a similar machine, where the search for flywheel and stroke begins; no guess if None. Without
            `rates` its errors, increased by half, are used for a stroke that differs little from it.

    Raises:
        SceneError: for a stroke that is not completed, with angle and time: a clutch that never locks, a machine that
            stalls, a brake that does not stop or hold the crank, a rate that leaves no time for the stroke.

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
    closest = max(_SIZED, _STEP * rtol) * (1.0 if rates or near is None else _NEARLY)
    with np.errstate(all="ignore"):
        limits, binding = dict[str, Limit](), None
        if scene.inertia is None:
            strokes, phases, limits, binding, alone = _sized(scene, tolerance, closest, near)
        else:
            strokes = Strokes(scene, scene.inertia, tolerance, None if near is None else near.strokes)
            if scene.inertia > (most := _HEAVIEST_GIVEN * _scale(strokes)):
                defect = f"{scene.inertia:.4g} kg m², whose speed a stroke hardly changes"
                raise SceneError([Fault("flywheel.inertia", defect, f"at most {most:.2g} kg m²")])
            phases = periodic(strokes, None if near is None else near.phases, _at_its_rate(strokes, near))
        if phases.period < phases.stop_time:
            raise strokes.too_fast(phases.stop_time, phases.period)
        tight, loose = _StrokeRun.of(strokes, phases), None
        like = None if rates or near is None else _like(strokes, tight, near)
        signal = None if near is None else near.figures["emergency_angle"]
        if like is None:
            rougher = Strokes(scene, strokes.inertia, _LOOSER * tolerance, strokes)
            loose = _StrokeRun.of(rougher, periodic(rougher, phases))
            loose.figures.update(_while_locked(rougher, loose.phases))
            signal = loose.figures["emergency_angle"]
        tight.figures.update(_while_locked(strokes, phases, signal if isinstance(signal, float) else None))
        greatest, decides, off = None, None, 0.0
        if loose is not None and rates:
            roughest = Strokes(scene, strokes.inertia, max(_LOOSER * tolerance, _COARSEST), strokes)
            greatest, decides, off = _greatest_rate(roughest, loose)
        if like is None:
            assert loose is not None
            of_wheel = 0.0
            if scene.inertia is None:
                demands = requirements_of(scene)
                of_wheels = {name: _wheel_error(*run, name, demands[name], closest) for name, run in alone.items()}
                of_wheel = of_wheels.get(binding or IRREGULARITY, 0.0)
                values, others = (limited_figures(*run, limits) for run in ((strokes, phases), (rougher, loose.phases)))
                own = _off(values, others, _OF_STEPS * strokes.rtol)
                of_limits = {n: (own[n] / max(values[n], 1e-300), of_wheels.get(n, 0.0)) for n in limits}
            error = {**_errors(strokes, tight, loose, of_wheel), "greatest_rate": off}
            if scene.inertia is None:
                error["inertia"] = strokes.inertia * of_wheel
        else:
            error = {
                name: {each: _CARRIED * one for each, one in off.items()} if isinstance(off, Mapping) else _CARRIED * off
                for name, off in like.error.items()
            }
            if (slopes := tight.phases.slopes) is not None and scene.inertia is None:
                error["inertia"] += strokes.inertia * closest / max(abs(1.0 - float(slopes[-1, -1])), closest)
            of_limits = {n: (_CARRIED * one.reached_error, _CARRIED * one.alone_error) for n, one in like.limits.items()}
        for name in limits:
            reached, lone = of_limits.get(name, (0.0, 0.0))
            limits[name] = limits[name]._replace(reached_error=reached, alone_error=lone)
    over = {name for name, share in tight.shares.items() if exceeds(share, error["shares"][name])}
    keeps_up = None if MOTOR_TORQUE not in tight.shares else not over & {MOTOR_TORQUE, MOTOR_HEAT}
    return SingleStroke(
        scene,
        scene.flywheel_on,
        strokes.inertia,
        scene.inertia is not None,
        {**tight.figures, "keeps_up": keeps_up, "greatest_rate": greatest, "decides": decides},
        _by_formulas(strokes, tight),
        tight.shares,
        tight.energy,
        error,
        tight.phases,
        strokes,
        limits,
        binding,
        tuple(one for one in inverter_loads(strokes, tight.phases) if one.value > one.limit),
        like,
    )


def _errors(strokes: Strokes, tight: _StrokeRun, loose: _StrokeRun, of_wheel: float) -> dict[str, Any]:
    """Absolute errors of the figures, shares and energies of a stroke by the same with a greater tolerance.

    At least they have, relative, what is open of the flywheel, and what Newton's method leaves: the more, the slower what a
    stroke begins with fades in the strokes that follow.
    """
    phases, turns = tight.phases, strokes.plan.continuous * TURN
    returns = np.array([phases.speed / phases.begin[0] - 1.0, (phases.rest - turns - phases.begin[1]) / TURN])
    if phases.slopes is not None:
        scale = np.array([phases.begin[0], TURN])
        returns = np.linalg.solve(np.eye(2) - phases.slopes[:2, :2] * scale / scale[:, None], returns)
    least = _SAFETY * float(np.abs(returns).max()) + _OF_STEPS * strokes.rtol + of_wheel
    error: dict[str, Any] = _off(tight.figures, loose.figures, least)
    error |= {"shares": _off(tight.shares, loose.shares, least), "energy": _off(tight.energy, loose.energy, least)}
    if tight.windings is not None:
        error["temperature"] += tight.windings.error * tight.windings.greatest
    if MOTOR_TORQUE in tight.shares:
        error["keeps_up"] = max(error["shares"][name] for name in (MOTOR_TORQUE, MOTOR_HEAT) if name in tight.shares)
    return error


def _like(strokes: Strokes, tight: _StrokeRun, near: SingleStroke) -> SingleStroke | None:
    """The neighbour with errors by comparison, if a stroke of its tolerance differs so little that these are valid."""
    like, figures = near.compared or near, tight.figures
    earlier = {**like.figures, "inertia": like.inertia}
    missing = (figures[name] is None for name in figures)
    if like.strokes.rtol != strokes.rtol or [*missing] != [earlier[name] is None for name in figures]:
        return None
    pairs = ((value, earlier[name]) for name, value in {**figures, "inertia": strokes.inertia}.items() if name in _LIKENESS)
    numbers = ((float(one), float(other)) for one, other in pairs if one is not None and other is not None)
    return like if all(abs(one - other) <= _NEIGHBOUR * abs(other) for one, other in numbers) else None


def _at_its_rate(strokes: Strokes, near: SingleStroke | None) -> Phases | None:
    """A neighbour's stroke with the recovery of a machine that differs from its own only in its rate; else None."""
    plan, of = strokes.plan, None if near is None else near.strokes
    if near is None or of is None or (of.rtol, of.inertia) != (strokes.rtol, strokes.inertia):
        return None
    same = of.plan._replace(rate=plan.rate, idle=plan.idle) == plan
    if not same or replace(near.scene, single_stroke=plan) != strokes.scene:
        return None
    with suppress(SceneError):
        return strokes.renewed(near.phases)
    return None


def _off(tight: Mapping[str, Any], loose: Mapping[str, Any], least: float) -> dict[str, float]:
    """Absolute errors of figures: four times the difference to a run with a greater tolerance, and a least relative one."""
    pairs = {name: (value, loose[name]) for name, value in tight.items() if isinstance(value, float)}
    return {name: 2 * _SAFETY * abs(one - other) + least * abs(one) for name, (one, other) in pairs.items()}


# -- the figures of a stroke ------------------------------------------------------------------------------------------


class _StrokeRun(NamedTuple):
    """A periodic stroke with its figures, loads over their limits, energies (J in a period), and rise of the windings."""

    phases: Phases
    figures: dict[str, Any]
    shares: dict[str, float]
    energy: dict[str, float]
    windings: Temperature | None

    @classmethod
    def of(cls, strokes: Strokes, phases: Phases) -> _StrokeRun:
        """The speeds of a stroke that returns."""
        energy = _energy(strokes, phases)
        windings = temperature(strokes, driving_sides(strokes, phases))
        figures = _figures(strokes, phases, energy, windings)
        shares = {name: figures[key] / limit for name, (key, limit) in load_limits(strokes, phases, figures).items()}
        return cls(phases, figures, shares, energy, windings)


def _figures(strokes: Strokes, phases: Phases, energy: Mapping[str, float], windings: Temperature | None) -> dict[str, Any]:
    """All figures but the greatest rate."""
    plan, wheel = strokes.plan, strokes.wheel
    sides, point = driving_sides(strokes, phases), servo_load(strokes, phases)
    speeds, slowest = speed_extremes(sides)
    slips, locked = phases.slips, [leg.driven for leg in phases.legs if not leg.sense]
    drive = drive_load(strokes, sides, phases.period)
    fed: list[float | None] = [*(max(one.value, 0.0) for one in inverter_loads(strokes, phases))] or [None, None]
    hours = _HOUR / phases.period
    return {
        "period": phases.period,
        "rate": plan.continuous / phases.period,
        "speed_greatest": speeds.high * wheel,
        "speed_least": speeds.low * wheel,
        "irregularity": speeds.irregularity,
        "slip_time": phases.lock_time,
        "lock_angle": phases.lock_angle,
        "clutch_torque": strokes.clutch.static_torque if slips else max(map(strokes.greatest_passed, locked)),
        "second_slip_time": float(sum(leg.end - leg.begin for leg in slips)),
        "second_slip_angle": float(slips[0].driven.start.phi) if slips else None,
        "second_slip_heat": float(sum(slip_heat(leg, strokes.ratio) for leg in slips)),
        "clutch_heat": energy["clutch_heat"],
        "clutch_heat_per_hour": energy["clutch_heat"] * hours,
        "brake_heat": energy["brake_heat"],
        "brake_heat_per_hour": energy["brake_heat"] * hours,
        "brake_angle": phases.rest - strokes.brakes_at,
        "stopping_time": phases.stop_time - phases.brake_time,
        "overrun": phases.rest - plan.stop_at - plan.continuous * TURN,
        "stroke_time": phases.stop_time,
        "recovery_time": recovery_time(sides, speeds.low, slowest, phases),
        "wheel_energy": 0.5 * driving_inertia(strokes) * (phases.begin[0] ** 2 - speeds.low**2),
        "holding_torque": abs(phases.resting) / strokes.scene.shafts[strokes.brake.on],
        "mean_power": energy["motor"] / phases.period,
        **drive,
        **{f"servo_{name}": None if point is None else getattr(point, name) for name in _SERVO},
        "inverter_current": fed[0],
        "power_returned": fed[1],
        "temperature": None if windings is None else windings.greatest,
        "energy_residual": energy["residual"] / energy["motor"] if energy["motor"] else energy["residual"],
    }


def _by_formulas(strokes: Strokes, run: _StrokeRun) -> dict[str, float]:
    """Figures by the formulas of presses: a clutch alone against inertias, then the work as a blow from the flywheel."""
    inertia, speed = driving_inertia(strokes), run.phases.begin[0]
    clutch, energy, period = strokes.clutch, max(run.energy["loads"], 0.0), run.phases.period
    behind = driven_inertia(strokes, run.phases)
    joined = press_work.engage(inertia, speed, behind / strokes.ratio**2, torque=clutch.torque)
    press = press_work.press_cycle(energy, period, 0.0)
    at_once = joined.time or 0.0  # of a torque without a rise; the impulse is the same with one
    slip = at_once + 0.5 * clutch.rise if at_once >= 0.5 * clutch.rise else math.sqrt(2.0 * at_once * clutch.rise)
    figures = {"clutch_heat": joined.heat, "slip_time": slip}
    figures |= {"wheel_energy": press.given, "mean_power": press.power}
    try:
        stroke = press_work.single_stroke(inertia, speed, energy, behind / strokes.ratio**2)
    except SceneError:  # the formula lets the wheel stop
        return figures
    return figures | {"speed_least": stroke.speed * strokes.wheel}


def _while_locked(strokes: Strokes, phases: Phases, near: float | None = None) -> dict[str, float | None]:
    """The longest stop from a signal while the clutch holds, the safety distance for it, an inching touch.

    At the signal the clutch holds for its `hold` and its `fall`; then it opens, and the brake is applied. The distance is
    that of ISO 13855. `near`: the crank angle (rad) about which the worst signal is searched for; anywhere if None.
    """
    plan = strokes.plan
    inched = {"inch_angle": None if plan.inch is None else strokes.inching(plan.inch)}
    if plan.approach is None:
        return inched | dict.fromkeys(("emergency_time", "emergency_angle", "safety_distance"))
    wait = strokes.clutch.hold + strokes.clutch.fall
    last = max(phases.release_time - wait - phases.lock_time, 0.0)

    def lasts(signal: float) -> float:
        phi, omega = crank_at(phases, np.array([phases.lock_time + signal + wait]))[:, 0].tolist()
        return wait + float(strokes.braked_from(phi, omega).t[-1])

    signals = np.linspace(0.0, last, _SIGNALS)
    angles = crank_at(phases, phases.lock_time + signals)[0]
    middle = max(signals.tolist(), key=lasts) if near is None else float(np.interp(near, angles, signals))
    low, high = max(middle - signals[1], 0.0), min(middle + signals[1], last)
    when, longest = summit(lasts, low, high, _SIGNAL_WIDTH * math.sqrt(strokes.rtol) * last)
    for end in {low, high} & {0.0, last}:
        when, longest = max((when, longest), (end, lasts(end)), key=lambda each: each[1])
    stopping = plan.response + longest
    return inched | {
        "emergency_time": stopping,
        "emergency_angle": float(crank_at(phases, np.array([phases.lock_time + when]))[0, 0]),
        "safety_distance": press_work.safety_distance(plan.approach, stopping, plan.intrusion),
    }


def load_limits(strokes: Strokes, phases: Phases, figures: Mapping[str, Any]) -> dict[str, tuple[str, float]]:
    """The loads that have limits: the key of each one's figure, and its limit."""
    clutch, brake, motor = strokes.clutch, strokes.brake, strokes.scene.motor
    limits = motor_limits(motor, figures)
    if motor is not None and motor.thermal is not None:
        limits["motor temperature"] = "temperature", motor.thermal.limit
    if motor is not None and motor.inverter is not None and figures["inverter_current"] is not None:
        limits["inverter current"] = "inverter_current", motor.inverter.overcurrent
        if motor.inverter.chopper_power is not None:
            limits["braking resistor"] = "power_returned", motor.inverter.chopper_power
    limits["clutch torque"] = "clutch_torque", clutch.static_torque
    hot = ("clutch heat a stroke", "clutch heat an hour", clutch), ("brake heat a stroke", "brake heat an hour", brake)
    for stroke, hour, part in hot:
        heat = "clutch_heat" if part is clutch else "brake_heat"
        limits |= {} if part.heat_per_stroke is None else {stroke: (heat, part.heat_per_stroke)}
        limits |= {} if part.heat_per_hour is None else {hour: (f"{heat}_per_hour", part.heat_per_hour)}
    torque = holding(brake, phases.resting)
    return limits | {"brake at rest": ("holding_torque", torque), _TIME: ("stroke_time", figures["period"])}


# -- energy ------------------------------------------------------------------------------------------------------------


def _energy(strokes: Strokes, phases: Phases) -> dict[str, float]:
    """Works and heats of one period, J, and their residual.

    By quadrature of every law over the motions apart from the stepping; the clutch's heat by the speeds of both its sides.
    """
    works: dict[str, float] = {}
    meshes = 0.0
    trails = [trail for leg in phases.legs for trail in (leg.driving, leg.driven)[: 2 if leg.sense else 1]]
    for trail in (*trails, phases.coasting, phases.braking, phases.recovery):
        if trail is None or not trail.stretches:
            continue
        parts, lost, _ = works_of(trail)
        meshes += lost
        for part, work in parts.items():
            works[part] = works.get(part, 0.0) + work
    motor = works.pop(DRIVE, 0.0)
    brake = -sum(work for part, work in works.items() if part.startswith(BRAKE))
    works = {part: work for part, work in works.items() if not part.startswith((f"{NAME} on", BRAKE))}
    clutch = float(sum(slip_heat(leg, strokes.ratio) for leg in phases.legs if leg.sense))
    loads = -sum(works.values())
    energy = {"motor": motor, "loads": loads, "mesh_heat": meshes, "clutch_heat": clutch, "brake_heat": brake}
    return {**energy, "residual": motor - loads - meshes - clutch - brake}


# -- searches ----------------------------------------------------------------------------------------------------------

_SIZED = 1e-8  # relative, the closest to which a flywheel is found
_NEARLY = 8.0  # times that, beside a neighbour: steps that fall otherwise change a limit's figure by so much
_ROUGHLY = 1e-3  # the same of the rough one that it is found beside
_BESIDE = 2.5e-4  # of a flywheel: the nearest one for the slope of a limit, by the next factor
_STRAIGHT = 1e-2  # of the change of a limit to that flywheel: errors within which its slope is constant
_WIDER = 4.0  # times: how far the second flywheel lies from the first, where all are looked through
_BROKEN = 1e-6  # of a limit: what is beyond it by more is not kept


def _sized(
    scene: Scene, tolerance: float, closest: float, near: SingleStroke | None
) -> tuple[Strokes, Phases, dict[str, Limit], str | None, dict[str, tuple[Strokes, Phases]]]:
    """The machine with the smallest flywheel that keeps all limits, its stroke, all limits, the binding one, each one's own.

    A heavier flywheel keeps every limit better: the largest of those for single limits keeps all. Each is searched roughly,
    then computed together with its stroke; a single limit at once, or from a neighbour's, unless that fails.
    """
    demands, last = requirements_of(scene), list[SceneError]()
    runs: dict[tuple[float, float], tuple[Strokes, Phases] | None] = {}

    def beside(name: str, start: Strokes, close: float, guess: Phases | None, earlier: Phases | None = None) -> Strokes:
        """The machine with the flywheel that just reaches one limit, close to another machine."""

        def excess(tried: Strokes, phases: Phases) -> float:
            if tried.inertia < _LIGHTEST * scale:
                raise kept_by_all(name)
            return limited_figures(tried, phases, [name])[name] / demands[name] - 1.0

        phases = fitted(start, guess, excess, close, earlier)
        runs[phases[0].inertia, start.rtol] = phases
        return phases[0]

    def kept_by_all(name: str) -> SceneError:
        defect = f"{100.0 * demands[name]:.4g} %, which every flywheel keeps, and no other inertia on the driving side"
        advice = "give the motor's inertia, or the flywheel"
        return SceneError([Fault(path_of(name), defect, "a limit that a flywheel decides on", advice)])

    def path_of(name: str) -> str:
        return f"flywheel.limits.{name}" if scene.limits else "flywheel.irregularity"

    def reached(inertia: float, rtol: float) -> Mapping[str, float]:
        """The values compared with the limits; none if the stroke is not completed."""
        if (inertia, rtol) not in runs:
            try:
                before = next((run[1] for run in reversed(runs.values()) if run is not None), None)
                tried = Strokes(scene, inertia, rtol, strokes)
                runs[inertia, rtol] = tried, periodic(tried, before)
            except SceneError as error:
                last[:], runs[inertia, rtol] = [error], None
        run = runs[inertia, rtol]
        return {} if run is None else limited_figures(*run, demands)

    def smallest(name: str, start: float, rtol: float, close: float, wider: float) -> float:
        """The smallest flywheel that keeps one limit, searched from one on, by ever wider steps."""

        @cache
        def above(inertia: float) -> float:
            """The relative excess over the limit; infinite where the stroke is not completed."""
            return reached(inertia, rtol).get(name, math.inf) / demands[name] - 1.0

        def within(place: float) -> float:
            over = above(1.0 / place)
            beyond[over > 0.0].append(place)
            gap = min(beyond[True], default=math.inf) / max(beyond[False], default=1e-300) - 1.0
            return over if abs(over) > close < gap else 0.0  # a bracket that narrow is rounding

        low, high, step, beyond = start, start, wider, {True: list[float](), False: list[float]()}
        while above(high) > 0.0:
            low, high, step = high, step * high, step * wider
            if high > _HEAVIEST * scale and last and math.isinf(above(low)):
                raise last[0]
            if high > _HEAVIEST * scale:
                value = 100.0 * (1.0 + above(low)) * demands[name]
                defect = f"{100.0 * demands[name]:.4g} %, and {value:.4g} % with {low:.3g} kg m²"
                raise SceneError(
                    [Fault(path_of(name), defect, "a limit that a flywheel keeps", "a larger motor, or a lower rate")]
                )
        while above(low) <= 0.0:
            if low < _LIGHTEST * scale or (low < high and own > 0.0 and above(0.0) <= 0.0):
                return 0.0
            low, high, step = low / step, low, step * wider
        while math.isinf(above(low)):  # the least flywheel that carries the stroke through
            middle = math.sqrt(low * high)
            low, high = (middle, high) if above(middle) > 0.0 else (low, middle)
            if high / low < 1.0 + close:
                return high
        return 1.0 / root(within, 1.0 / low, 1.0 / high)  # most limits are nearly straight lines of 1/inertia

    strokes = Strokes(scene, 1.0, tolerance, None if near is None else near.strokes)
    own, scale, alone = driving_inertia(strokes) - strokes.wheel**2, _scale(strokes), dict[str, float]()
    for name in demands:
        inertia = None
        with suppress(SceneError):
            if near is not None and near.inertia > 0.0 and len(demands) == 1:
                start = Strokes(scene, near.inertia, tolerance, strokes)
                alone[name] = beside(name, start, closest, near.phases, _at_its_rate(start, near)).inertia
                continue
            if len(demands) == 1:
                inertia = beside(name, Strokes(scene, _WIDER * scale, _COARSEST, strokes), _ROUGHLY, None).inertia
        if inertia is None:
            inertia = smallest(name, scale, _COARSEST, _ROUGHLY, _WIDER)
        try:
            run = runs.get((inertia, _COARSEST))
            alone[name] = (
                inertia and beside(name, Strokes(scene, inertia, tolerance, strokes), closest, run and run[1]).inertia
            )
        except SceneError:
            alone[name] = smallest(name, inertia, tolerance, closest, 1.0 + _WIDER * _ROUGHLY)
    binding = max(alone, key=lambda name: alone[name])
    if alone[binding] == 0.0 and not own > 0.0:
        raise kept_by_all(binding)
    values, run = reached(alone[binding], tolerance), runs[alone[binding], tolerance]
    assert run is not None
    limits = {name: Limit(demands[name], values[name], alone[name]) for name in scene.limits}
    for name, limit in limits.items():
        if limit.reached > limit.requirement * (1.0 + _BROKEN):
            defect = f"{100.0 * limit.reached:.4g} % with the {alone[binding]:.5g} kg m² that {binding} needs"
            raise SceneError([Fault(f"flywheel.limits.{name}", defect, "limits that one flywheel keeps", "allow more")])
    own_runs = {name: each for name, inertia in alone.items() if inertia > 0.0 and (each := runs[inertia, tolerance])}
    return *run, limits, binding if limits else None, own_runs


def _scale(strokes: Strokes) -> float:
    """The greater inertia of both sides without the flywheel (kg m² at the flywheel's shaft)."""
    own = driving_inertia(strokes) - strokes.inertia * strokes.wheel**2
    crank = float(strokes.driven.at(0.0, 0.0, strokes.typical, 0.0).inertia)
    return max(own, crank / strokes.ratio**2) / strokes.wheel**2


def _wheel_error(strokes: Strokes, phases: Phases, name: str, demand: float, closest: float) -> float:
    """Relative error of the flywheel that just keeps a limit.

    The figure's own is the difference to a run with a greater tolerance, doubled, and the tolerance of a step. With the
    excess over the limit it becomes an error of inertia by the change of the figure to a flywheel on either side that
    differs in it by more. If none up to twice the inertia does, the error is as large as the inertia; so it is of a flywheel
    that with a greater tolerance does not carry the stroke through.
    """

    def figure_with(inertia: float) -> float:
        beside = Strokes(strokes.scene, inertia, _LOOSER * strokes.rtol, strokes)
        return limited_figures(beside, periodic(beside, phases), [name])[name] / demand

    reached, widest = limited_figures(strokes, phases, [name])[name] / demand, closest
    try:
        rough = figure_with(strokes.inertia)
    except SceneError:
        return 1.0
    own = _SAFETY * abs(reached - rough) + strokes.rtol
    for way in (-1, 1):
        step, off, change = _BESIDE, max(way * (reached - 1.0), 0.0) + own, 0.0
        while change <= off and step < 1.0:
            step *= _WIDER
            with suppress(SceneError):  # where no stroke is completed, the figure ends
                change = math.inf
                change = abs(figure_with(strokes.inertia * (1.0 + step) ** way) - rough)
        straight = abs(reached - 1.0) + own < _STRAIGHT * change < math.inf  # the same slope serves for the other side
        off = abs(reached - 1.0) + own if straight else off
        widest = max(widest, closest + step * min(_SAFETY * off / change if change else 1.0, 1.0))
        if straight:
            break
    return widest


def _greatest_rate(strokes: Strokes, run: _StrokeRun) -> tuple[float, str, float]:
    """The greatest rate (1/s) within all limits, the load that decides it, and its error.

    The speed at which the clutch engages is the unknown: the sooner it engages again, the lower it is. The time until the
    driving side has it again is the period, so that no rate without a periodic stroke has to be tried. The difference
    between the idling speed and the speed falls nearly exponentially with the time, so that the search varies its logarithm.
    Below `idling` the side waits at that speed, and the search varies the logarithm of the rate; so it does from the given
    one where the clutch engages at a speed above that, to which the driven side has brought it.
    """
    count, rates = strokes.plan.continuous, dict[float, tuple[float, str, float]]()
    nominal, idle, last = run.phases.begin[0], strokes.typical * strokes.ratio, [run.phases]
    faster, idling = nominal > (1.0 + strokes.rtol) * idle, math.log(_NEAR_IDLE * idle)

    def begun(gap: float) -> _StrokeRun:
        phases = run.phases if faster else regaining(strokes, idle - math.exp(max(gap, idling)), last[0])
        if faster or gap < idling:
            plan = strokes.plan._replace(rate=count / phases.period * math.exp(gap - idling), idle=None)
            slower = Strokes(replace(strokes.scene, single_stroke=plan), strokes.inertia, strokes.rtol, strokes)
            return _StrokeRun.of(slower, fitted(slower, phases, None, 1.0, slower.renewed(phases))[1])
        return _StrokeRun.of(strokes, phases)

    def noted(gap: float, tried: _StrokeRun) -> None:
        excess = {each: share - 1.0 for each, share in tried.shares.items()}
        if tried.phases.slips:
            excess["clutch torque"] = tried.figures["second_slip_time"] / tried.phases.period
        name = max(excess, key=lambda each: excess[each])
        rates[gap] = excess[name], name, tried.phases.period

    def over(gap: float) -> float:
        """The load that is greatest over its limit, less 1; infinite where the stroke fails.

        For a clutch that slips under the work, the share of the period.
        """
        if gap not in rates:
            try:
                tried = begun(gap)
            except SceneError as error:
                rates[gap] = math.inf, f"{error.faults[0].path}: {error.faults[0].defect}", 0.0
            else:
                last[0] = tried.phases
                noted(gap, tried)
        return rates[gap][0]

    slow = fast = idling if faster else math.log(max(idle - nominal, math.exp(idling)))
    if faster or slow > idling:
        noted(slow, run)
    while over(slow) > 0.0:
        waits = [(1.0 + rates[gap][0], rates[gap][2]) for gap in (fast, slow) if gap < idling]
        rising = [share**power * period - period for power in (1, 2) for share, period in waits]  # of a mean a + b/period
        endless = slow < fast < idling and rising[0] < rising[1] and rising[2] < rising[3]
        if slow <= idling - _LONGEST_WAIT or endless:
            return 0.0, rates[slow][1], count / max(run.phases.period, *(period for *_, period in rates.values()))
        step = _SLOWER if slow > idling else min(_SLOWER, 2.0 * math.log1p(over(slow)) + _WAITING)
        slow, fast = max(slow - step, idling - _LONGEST_WAIT), slow
    while over(fast) <= 0.0:  # on the way of the recovery, to where the load that decides would come to its limit
        sooner = 0.0 if faster else idle - _sooner(last[0], 1.0 + over(fast))
        slow, fast = fast, max(fast + _FASTER, math.log(max(sooner, math.exp(idling))))
    while math.isinf(over(fast)) and fast - slow > _FAILS:
        middle = 0.5 * (slow + fast)
        slow, fast = (middle, fast) if over(middle) <= 0.0 else (slow, middle)
    if math.isinf(over(fast)):  # it fails before anything comes to its limit
        place, name, period = slow, rates[fast][1], rates[slow][2]
        slower = max((gap for gap in rates if gap < slow), default=slow)
        step = abs(rates[slower][2] - period) / max(slow - slower, 1e-300)
        off = step * (fast - slow)
    else:
        place = root(lambda gap: over(gap) if abs(over(gap)) > _RATE else 0.0, slow, fast)
        (excess, name, period), others = rates[place], [gap for gap in rates if gap != place and rates[gap][2] > 0.0]
        other = min(others, key=lambda gap: abs(gap - place))
        off = (abs(excess) + _RATE + _ADDING * strokes.rtol) / abs((rates[other][0] - excess) / (rates[other][2] - period))
    within = sorted({place, *(gap for gap in rates if over(gap) <= 0.0)})
    k = min(range(len(within)), key=lambda each: rates[within[each]][2])
    if rates[within[k]][2] < (1.0 - _RATE) * period:  # from a lower speed the recovery lasts longer again
        ends = within[max(k - 1, 0)], within[min(k + 1, len(within) - 1)]
        _gap, least = summit(lambda gap: -math.inf if over(gap) > 0.0 else -rates[gap][2], *ends, _FAILS)
        name, period, off = _RECOVERY, -least, (_RATE + _ADDING * strokes.rtol) * -least
    return count / period, name, count / period**2 * off


def _sooner(phases: Phases, share: float) -> float:
    """The speed (rad/s), about, at which the clutch engages after a share of the period."""
    since = max(share * phases.period, phases.stop_time) - phases.release_time
    then = float(phases.recovery.states(np.array([min(since, float(phases.recovery.t[-1]))]))[1, 0])
    left = 0.0 if phases.slopes is None else float(phases.slopes[0, 0])
    return phases.begin[0] - max(phases.begin[0] - then, 0.0) / max(1.0 - left, 0.1)
