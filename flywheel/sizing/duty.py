"""Duty of a machine: the flywheel for the hardest phase, and the motor's load over all phases.

Every phase has its own steady regime with the one flywheel. Over the duty, of period t, torque and heat are

    T_rms = sqrt(sum T_i² t_i / t_c),  P_heat = sum P_i t_i / t_c,  t_c = sum of t_i running + k sum of t_i at rest

with T_i the root of the mean square over time in a phase, P_i its mean heat, and k the share by which standstill counts for
the cooling. Short changes between the regimes of two phases are left out; `settling` is their time. Starts are
counted by their own heat and torque, from rest until the regime is reached.

Valid for a duty that is short compared with the minutes in which windings warm up: 10 minutes unless another time is agreed
on, by IEC 60034-1 for S3 to S8. Source: IEC 60034-1, duty types; Fischer, Elektrische Maschinen (Betriebsarten); Dubey,
Fundamentals of Electrical Drives, chapter 4 (ratings by the root mean square).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from math import inf, log, sqrt
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.motors.thermal import Losses, Temperature, course, starts_an_hour
from flywheel.machine.machine import circuit_of
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import NOT_NEGATIVE, POSITIVE, Fault, SceneError, number_faults, refuse
from flywheel.regime import turning_moment
from flywheel.regime.branch import Existence
from flywheel.regime.cycle_equations import NoRegimeError
from flywheel.regime.periodic_motion import OwnMotion
from flywheel.scene.scene import Phase, Scene
from flywheel.sizing import limits
from flywheel.sizing.drive import trip_messages
from flywheel.sizing.findings import estimates
from flywheel.sizing.limits import FlywheelPoint, LimitState, Span
from flywheel.sizing.motor import MotorShaft, Share, heat_share, shares
from flywheel.sizing.results import Duty, Limit, PhaseLoad, Sizing

LONGEST = 600.0
"""Longest period (s) of a duty for which the mean heat is decisive; 10 minutes in IEC 60034-1, unless otherwise agreed."""
_FADED = 0.05  # fraction of a change of speed left when it has settled
_GONE = 1e-6  # the same where it is no longer followed
_TOO_LONG = 0.05  # fraction of a phase that settling may take
_FOLLOWED = 0.002  # fraction of a phase from which on the change of speed into it is followed in time
_CHANGES = 1e-7  # error allowed of that
_TO_AND_FRO = 2.0  # of the greatest rise of a steady cycle over its mean: the rise within a cycle that begins anywhere
_COLD = 2.0  # K over the surroundings, within which a motor counts as cold (IEC 60034-1, S2)
_ROUGHLY = 1e-6  # relative error above which a start is taken as linear in the flywheel


class Stretch(NamedTuple):
    """A stretch of a duty: its time (s), its value, and the share of its time that counts for the cooling."""

    time: float
    value: float
    cooling: float = 1.0


def mean(stretches: Iterable[Stretch]) -> float:
    """The mean of a heat (or any value) over a duty: sum of value times time, over the time that cools.

    Args:
        stretches: times (s) not below 0, values of one unit, shares of cooling from 0 to 1.

    Raises:
        SceneError: for a number out of range, or no time that cools.

    Valid if the duty is short compared with the motor's thermal time constant.

    >>> mean([Stretch(60.0, 300.0), Stretch(120.0, 0.0, 1 / 3)])
    180.0

    """
    parts = list(stretches)
    for each in parts:
        refuse(number_faults("time", each.time, NOT_NEGATIVE, "s") + number_faults("value", each.value))
        refuse(number_faults("cooling", each.cooling, NOT_NEGATIVE))
    cooled = sum(each.time * each.cooling for each in parts)
    refuse(number_faults("time", cooled, POSITIVE, "s"))
    return sum(each.time * each.value for each in parts) / cooled


def root_mean_square(stretches: Iterable[Stretch]) -> float:
    """The root mean square of a torque, power or current over a duty: sqrt(sum of T² t over the time that cools).

    Args:
        stretches: as in `mean`; a value is itself the root of the mean square in its stretch.

    Raises:
        SceneError: as in `mean`.

    Valid if losses grow with the square of the torque, as near the rated point at a constant flux.
    Source: Dubey, Fundamentals of Electrical Drives, chapter 4 (selection of motor power rating); Theraja and Theraja, A
    Textbook of Electrical Technology, vol. III, chapter 44 (rating and service capacity).

    >>> round(root_mean_square([Stretch(10.0, 40.0), Stretch(20.0, 10.0), Stretch(30.0, 0.0)]), 6)
    17.320508

    """
    return sqrt(mean(each._replace(value=each.value**2) for each in stretches))


def sized(scene: Scene, size: Callable[[Scene], Sizing], plain: Callable[[Scene], Sizing]) -> Sizing:
    """The sizing of the phase that decides the flywheel, with the duty.

    Limits of irregularity, torque and current are kept in every phase, those of the motor's heat and of the root mean
    square of its torque over the whole duty.

    Args:
        scene: with a duty.
        size: sizes the scene of the phase that decides, as requested.
        plain: sizes a scene without its own confirmation, for the other phases.

    Raises:
        SceneError: with the faults of all phases that cannot run, and if no flywheel keeps a limit over the duty.

    """
    running = [phase for phase in scene.duty if phase.scene is not None]
    if scene.inertia is not None:
        runs = _all(running, lambda phase: plain(_scene(phase)))
        hardest = max(running, key=lambda phase: _irregularity(runs[phase.name]))
        result, duty = size(_scene(hardest)), over(scene.duty, runs, scene.inertia)._replace(governing=hardest.name)
        messages = (*result.messages, *_messages(duty, scene, None), *_trips(runs, hardest))
        return replace(_with_duty(result, duty, scene, runs), messages=tuple(dict.fromkeys(messages)))
    whole = {name: scene.limits[name] for name in WHOLE if name in scene.limits}
    if whole and len(whole) == len(scene.limits):
        alone_there = f"limits of {' and '.join(whole)} alone, which are those of the whole duty"
        raise SceneError([Fault("flywheel.limits", alone_there, "an irregularity with them", "which every phase keeps")])
    if whole:
        running = [phase._replace(scene=_without(_scene(phase), whole)) for phase in running]
    alone = _all(running, lambda phase: plain(_scene(phase)))
    spans = {_of(phase): ranges(alone[phase.name]) for phase in running}
    if whole:
        branches = _PhaseBranches(scene, running, alone, whole)
        search = _search(running, alone, whole)
        try:
            spans |= {name: limits.answered(search.spans(name), branches.at) for name in whole}
        except NoRegimeError as stopped:
            expected = "a motion that returns to its speed each cycle"
            fault = Fault("flywheel.limits", str(stopped), expected)
            raise branches.refusal or SceneError([fault]) from None
        limits.check_reached(search, {name: spans[name] for name in whole}, 1.0, duty=True)
    limits.check_together(spans, 1.0)
    every = limits.together(spans.values())
    inertia, error = next((span.first, span.error) for span in every if span.state is LimitState.KEPT)
    runs = _all(running, lambda phase: _loosened(plain(analysed(_scene(phase), inertia)), error))

    def hardness(phase: Phase) -> tuple[bool, float, float]:
        """Order of the phases: whose limit decides, by the flywheel that each needs, then by its irregularity."""
        own = alone[phase.name].inertia or 0.0
        return _begins(spans[_of(phase)], inertia), own, _irregularity(runs[phase.name])

    hardest = max(running, key=hardness)
    decides = next((name for name in whole if inertia > 0.0 and _begins(spans[name], inertia)), None)
    if decides is None and alone[hardest.name].inertia == inertia:
        result = size(_scene(hardest))
        runs[hardest.name] = result if result.simulation else runs[hardest.name]
    else:
        analysis = _loosened(size(analysed(_scene(hardest), inertia)), error)
        result = _with_flywheel(_scene(hardest), analysis, inertia, error)
    wheel = result.flywheel._replace(broken=limits.broken_beyond(every, inertia))
    duty = over(scene.duty, runs, inertia, follow=not whole)._replace(governing=hardest.name)
    needed = {name: next(span.first for span in spans[name] if span.state is LimitState.KEPT) for name in whole}
    for name in scene.limits.keys() - whole.keys():
        needed[name] = max(sizing.limits[name].alone for sizing in alone.values())
    kept = {name: _reached(name, limit, duty, runs, needed[name], error) for name, limit in scene.limits.items()}
    others = {name: each for name, each in spans.items() if name != _of(hardest) or result.scene.limits != scene.limits}
    messages = (
        *result.messages,
        *_messages(duty, scene, decides),
        *_trips(runs, hardest),
        *limits.gaps(others, inertia, 1.0),
    )
    if whole and len(running) > 1:
        messages = (*messages, f"with a limit of {' and '.join(whole)} changes of speed between phases are left out")
    binding = decides or (alone[hardest.name].binding if inertia > 0.0 else None)
    result = replace(_with_duty(result, duty, scene, runs), flywheel=wheel, limits=kept, binding=binding)
    return replace(result, messages=tuple(dict.fromkeys(messages)))


def _all(phases: Iterable[Phase], run: Callable[[Phase], Sizing]) -> dict[str, Sizing]:
    """The sizings of phases, by name; refused with the faults of all."""
    sizings, faults = dict[str, Sizing](), list[Fault]()
    for phase in phases:
        try:
            sizings[phase.name] = run(phase)
        except SceneError as error:
            faults += [fault._replace(path=f"{phase.path} ({phase.name}): {fault.path}") for fault in error.faults]
    refuse(faults)
    return sizings


def _of(phase: Phase) -> str:
    """Requirement of a phase, in words."""
    return f"the requirements of {phase.name}"


def ranges(sizing: Sizing) -> list[Span]:
    """The flywheels (kg m² at their own shaft) with which a sized machine keeps its limits, and those that break them."""
    exact, broken = sizing.inertia or 0.0, sizing.flywheel.broken
    kept = Span(LimitState.KEPT, exact, inf, sizing.error.exact or 0.0)
    spans = [kept] if exact == 0.0 else [Span(LimitState.BROKEN, 0.0, exact), kept]
    for each in broken:
        spans[-1] = spans[-1]._replace(last=each.start)
        spans.append(Span(LimitState.BROKEN, each.start, inf if each.end is None else each.end, each.start_error))
        if each.end is not None:
            spans.append(Span(LimitState.KEPT, each.end, inf, each.end_error))
    return spans


def _begins(spans: Iterable[Span], inertia: float) -> bool:
    """Tests whether a limit is kept by a flywheel, and not by slightly lighter ones."""
    return any(span.state is LimitState.KEPT and span.first == inertia for span in spans)


WHOLE = {"motor_heat": "heat_share", "motor_rms": "rms_torque_share"}
"""Limits that apply to the whole duty, and their figures of it."""


def _scene(phase: Phase) -> Scene:
    assert phase.scene is not None
    return phase.scene


def _without(scene: Scene, names: Mapping[str, float]) -> Scene:
    """The scene without some of its limits."""
    left = {name: limit for name, limit in scene.limits.items() if name not in names}
    return replace(scene, limits=left)


def analysed(scene: Scene, inertia: float) -> Scene:
    """The scene with a given flywheel (kg m² at its own shaft), in place of its requirements."""
    return scene if scene.inertia == inertia else scene.with_flywheel(inertia)


def _with_flywheel(scene: Scene, analysis: Sizing, inertia: float, error: float) -> Sizing:
    """An analysis as the sizing of a scene with that flywheel."""
    wheel = analysis.flywheel._replace(inertia=None, exact=inertia, needed=inertia > 0.0)
    return replace(analysis, scene=scene, flywheel=wheel, error=analysis.error._replace(exact=error))


def _loosened(sizing: Sizing, share: float) -> Sizing:
    """An analysis whose flywheel is known to a share: as if the irregularity changed by it, the speed by it times that."""
    run, cyclic, error = sizing.run, sizing.cyclic, sizing.error
    if run is None:
        return sizing
    level = share * run.irregularity
    more = {"simulation": 2 * share, "extreme_speeds": level, "period": level}
    own = {name: getattr(error, name) for name in more}
    return replace(
        sizing,
        run=limits.loosened(run, share, level),
        cyclic=cyclic and cyclic._replace(level_error=cyclic.level_error + level),
        error=error._replace(**{name: each + more[name] for name, each in own.items() if each is not None}),
    )


def _figures(names: Iterable[str], run: Sizing) -> dict[str, Share]:
    """The limited figures of a phase."""
    if run.cycle is None or run.run is None:
        return {}
    return shares(names, MotorShaft(run.scene, run.cycle, run.run, run.speed, run.rtol))


class _PhaseBranches:
    """The steady motions of all phases of a duty over its flywheel, and their figures of the motor's limits."""

    def __init__(self, scene: Scene, running: list[Phase], alone: Mapping[str, Sizing], names: Iterable[str]) -> None:
        self.scene, self.running, self.alone, self.names = scene, running, alone, tuple(names)
        self.branches = {phase.name: limits.branch_of(alone[phase.name]) for phase in running}
        self.lightest = max(sizing.inertia or 0.0 for sizing in alone.values())
        self.rated = {phase.name: _rated(alone[phase.name]) for phase in running}
        self.linear = dict[str, tuple[_PhaseStart, _PhaseStart, float]]()
        self.refusal: SceneError | None = None  # the last of a start

    def at(self, inertia: float, rtol: float) -> FlywheelPoint:
        """The limits of the duty with a flywheel (kg m² at its own shaft), and the motions of its phases."""
        findings = [self.branches[p.name].at(inertia * _scene(p).flywheel_ratio ** 2, rtol) for p in self.running]
        kinds = {finding.existence for finding in findings}
        if kinds != {Existence.MOTION}:
            return FlywheelPoint(inertia, Existence.NONE if Existence.NONE in kinds else Existence.UNKNOWN)
        motions = {p.name: finding.motion for p, finding in zip(self.running, findings, strict=True) if finding.motion}
        try:
            rows = [self._row(phase, motions.get(phase.name), inertia, rtol) for phase in self.scene.duty]
        except SceneError as error:  # starts that do not come to the regime, or not in time
            self.refusal = error
            return FlywheelPoint(inertia, Existence.NONE)
        shares = dict[str, Share]()
        for name in self.names:
            value, off = _combined(WHOLE[name], rows)
            assert value is not None
            assert off is not None
            shares[name] = Share(value, off * abs(value))
        return FlywheelPoint(inertia, Existence.MOTION, tuple(motions.values()), shares)

    def _row(self, phase: Phase, motion: OwnMotion | None, inertia: float, rtol: float) -> PhaseLoad:
        """Contribution of a phase to the limits of the duty."""
        if motion is None:
            return PhaseLoad(phase.name, True, phase.duration or 0.0, phase.cooling)
        shaft = MotorShaft(_scene(phase), motion.cycle, motion.run, motion.speed, rtol)
        values, off = _at_motor(self.rated[phase.name], shares(self.names, shaft))
        period, of_period = 0.0, 0.0
        if phase.duration is None:
            period, of_period = turning_moment.period(motion.cycle, motion.speed, motion.run, rtol)
        start = self._start(phase, inertia, rtol) if phase.starts else None
        steady, duration = _times(phase, start, period)
        if start is not None:
            values, off = _with_starts(values, off, start, phase.starts, steady / duration, duration)
        errors = {**off, "duration": steady * of_period}
        limited = {WHOLE[name]: values[WHOLE[name]] for name in self.names}
        return PhaseLoad(phase.name, False, duration, errors=errors, **limited)

    def _start(self, phase: Phase, inertia: float, rtol: float) -> _PhaseStart:
        """A start with a flywheel; approximately from two others, because its time and heat are proportional to inertia."""
        if rtol < _ROUGHLY:
            return _start(phase, inertia)
        if phase.name not in self.linear:
            heavier = self.lightest + max(limits.extent_of(self.alone[phase.name])[0], self.lightest)
            self.linear[phase.name] = _start(phase, self.lightest), _start(phase, heavier), heavier
        light, heavy, heavier = self.linear[phase.name]
        share = (inertia - self.lightest) / (heavier - self.lightest)

        def between(first: float, second: float) -> float:
            return max(first + share * (second - first), 0.0)

        heat = None if light.heat is None or heavy.heat is None else between(light.heat, heavy.heat)
        time, work = between(light.time, heavy.time), between(light.work, heavy.work)
        return _PhaseStart(time, work, heat, between(light.square, heavy.square), heavy.error)


def _search(running: list[Phase], alone: Mapping[str, Sizing], whole: Mapping[str, float]) -> limits.Search:
    """The search over flywheels (kg m² at their own shaft) for the limits of a whole duty."""
    extents = [limits.extent_of(alone[phase.name]) for phase in running]
    own, heaviest = min(each[0] for each in extents), max(each[1] for each in extents)
    swings = any(circuit_of(_scene(phase)) is not None for phase in running)
    dense = limits.PER_DECADE_RESONANT if swings else limits.PER_DECADE
    rtol = next(iter(alone.values())).rtol
    return limits.Search(whole, own, heaviest, rtol, swings=swings, per_decade=dense)


def _rated(sizing: Sizing) -> dict[str, float]:
    """Torque (N m) and heat (W) of a motor at its rated point; 0 if unknown."""
    motor, values = sizing.scene.motor, _of_motor(sizing)[0]
    torque = 0.0 if motor is None or motor.rated is None else motor.rated.torque
    return {"rms_torque": torque, "heat": values["heat"] / values["heat_share"] if values["heat_share"] else 0.0}


def _at_motor(rated: Mapping[str, float], shares: Mapping[str, Share]) -> tuple[dict[str, Any], dict[str, float]]:
    """The load of a motor from its shares, as in `_of_motor`, and errors."""
    values: dict[str, Any] = dict.fromkeys(_FIGURES)
    off = {"mean_power": 0.0}
    for name, share in shares.items():
        figure = WHOLE[name].removesuffix("_share")
        scale = rated[figure]
        values |= {WHOLE[name]: share.value, figure: share.value * scale}
        off |= {WHOLE[name]: share.error, figure: share.error * scale}
    return values, dict.fromkeys(_FIGURES, 0.0) | off


def _reached(name: str, limit: float, duty: Duty, runs: Mapping[str, Sizing], alone: float, error: float) -> Limit:
    """A limit of the scene, with the figure of the whole duty, or of the phase nearest to the limit."""
    if name in WHOLE:
        reached = float(getattr(duty, WHOLE[name]))
        return Limit(limit, reached, alone, None, duty.errors.get(WHOLE[name], 0.0), error)
    shares = [share[name] for run in runs.values() if (share := _figures((name,), run))]
    worst = max(shares, key=lambda each: each.value, default=Share(0.0, 0.0))
    return Limit(limit, worst.value, alone, None, worst.error / max(worst.value, 1e-300), error)


def _irregularity(sizing: Sizing) -> float:
    return 0.0 if sizing.simulation is None else sizing.simulation.irregularity


# -- the motor over the duty -------------------------------------------------------------------------------------------

_FIGURES = ("mean_power", "rms_torque", "rms_torque_share", "heat", "heat_share", "current_rms")
_OTHER_SPEED = 0.1  # share by which speeds of phases differ in duty S8
_SQUARED = ("rms_torque", "rms_torque_share", "current_rms")  # figures averaged by their squares


class _PhaseStart(NamedTuple):
    """A start from rest, or a change of speed: time (s), the motor's work and heat (J), the integral of its torque squared.

    That is in N² m² s; `error` is relative, `speed` the crank's at the end, rad/s.
    """

    time: float
    work: float
    heat: float | None
    square: float
    error: float
    speed: float = 0.0


def _start(phase: Phase, inertia: float, change: tuple[float, float] | None = None) -> _PhaseStart:
    """One start of a phase's machine from rest to its regime, or a change of speed: from crank angle 0 and a speed on.

    change: that speed (rad/s), and the time for which it is followed (s).
    """
    import flywheel  # motions in time stand above sizings

    scene, path = _scene(phase), f"{phase.path}.starts"
    if scene.motor is None:
        raise SceneError([Fault(path, "starts of a drive that is no motor", "a motor", "leave starts out")])
    try:
        analysis = analysed(scene, inertia)
        if change is None:
            run = flywheel.run_up(analysis)
        else:
            running = replace(analysis, motor=replace(scene.motor, start=None))
            run = flywheel.transient(running, start=change[0], at=0.0, end=change[1], rtol=_CHANGES)
    except SceneError as error:
        raise SceneError([fault._replace(path=f"{path}: {fault.path}") for fault in error.faults]) from None
    if change is None and run.reason != "regime":
        raise SceneError(
            [Fault(path, f"a start that does not reach the regime: {run.ended}", "a start that reaches the regime")]
        )
    samples, owners = run.samples
    count = int(np.bincount(owners)[0])
    _, weights = np.polynomial.legendre.leggauss(count - 2)
    columns = (samples.t, samples.drive, samples.omega)
    t, torque, omega = (np.asarray(column).reshape(-1, count) for column in columns)
    half, heat = 0.5 * (t[:, -1] - t[:, 0]), run.energy.copper
    square = float(half @ (torque[:, 1:-1] ** 2 @ weights))
    if scene.motor.heated == "rotor_heat" and scene.drive is not None:
        speed, begun = scene.shafts[scene.drive.on] * omega[:, 1:-1], None if change is not None else run.start_heat
        if scene.motor.start is None or begun is None:
            heat = float(half @ (scene.motor.total_heat(speed) @ weights))
        else:  # by its connections up to the rated speed in the last of them, then as it runs
            later = scene.motor.stator_heat(speed)
            later = np.zeros_like(speed) if later is None else np.where(t[:, 1:-1] > begun.time, later, 0.0)
            heat = (run.energy.rotor_heat or 0.0) + (begun.stator or 0.0) + float(half @ (later @ weights))
    return _PhaseStart(run.time, run.energy.drive, heat, square, 2 * run.error, run.omega)


def _load(phase: Phase, sizing: Sizing, inertia: float, begin: float | None = None) -> PhaseLoad:
    """The load of a running phase, from the sizing of its machine with the flywheel (kg m²), and from one of its starts.

    Without starts the change of speed from that at its beginning (rad/s) is followed in time, if it takes long enough.
    """
    energy, motion = sizing.energy, sizing.simulation
    period = None if motion is None else motion.period
    if phase.duration is None and period is None:
        defect = f"{phase.cycles:g} cycles of a machine that has no motion"
        raise SceneError([Fault(f"{phase.path}.cycles", defect, "a duration")])
    # time (s) in which a change of speed decays to 5 %; None if unknown
    cyclic, cycle_period = sizing.cyclic, None if sizing.simulation is None else sizing.simulation.period
    if cyclic is None or cycle_period is None or not 0.0 < cyclic.multiplier < 1.0:
        settling = None
    else:
        settling = cycle_period * log(_FADED) / log(cyclic.multiplier)
    start = _start(phase, inertia) if phase.starts else None
    change = None
    if start is None and begin is not None and settling is not None and phase.duration is not None:
        change = _change(phase, begin, inertia, settling)
    steady, duration = _times(phase, start, period or 0.0)
    of_period = sizing.error.period or ROUNDING
    errors = {"duration": steady * of_period if phase.duration is None else ROUNDING * duration}
    row = PhaseLoad(
        phase.name, False, duration, 1.0, phase.loaded, period and steady / period, phase.starts, sizing.speed,
        None if motion is None else motion.irregularity, settling=settling,
        start_time=start and start.time, start_heat=start and start.heat,
        change_time=change and change.time, change_heat=change and change.heat,
        change_speed=change and change.speed,
    )  # fmt: skip
    if energy is None:
        return row._replace(errors=errors)
    values, off = _of_motor(sizing)
    if start is not None:
        values, off = _with_starts(values, off, start, phase.starts, steady / duration, duration)
    elif change is not None:
        values, off = _with_starts(values, off, change, 1, 1.0 - change.time / duration, duration)
    return row._replace(**values, peak_power=energy.peak_power, errors=errors | off)


def _change(phase: Phase, begin: float, inertia: float, settling: float) -> _PhaseStart | None:
    """The change from a speed (rad/s) to the phase's regime; None if it is short, or longer than the phase."""
    scene, duration = _scene(phase), phase.duration or 0.0
    if scene.motor is None or circuit_of(scene) is not None:
        return None
    if not _FOLLOWED * duration < settling < 0.5 * duration:
        return None
    lasting = min(settling * log(_GONE) / log(_FADED), duration)
    try:
        return _start(phase, inertia, (begin, lasting))
    except SceneError:  # it stalls on the way
        return None


def _times(phase: Phase, start: _PhaseStart | None, period: float) -> tuple[float, float]:
    """Time of a phase in steady running, and its duration with its starts (s); `period` is that of its cycle."""
    starting = 0.0 if start is None else phase.starts * start.time
    steady = (phase.cycles or 0.0) * period if phase.duration is None else phase.duration - starting
    if steady < 0.0:
        defect = f"{phase.starts} starts of {starting / phase.starts:.4g} s in {phase.duration:.4g} s"
        raise SceneError([Fault(f"{phase.path}.starts", defect, "time enough for all of them", "lengthen the phase")])
    return steady, steady + starting


def _of_motor(sizing: Sizing) -> tuple[dict[str, Any], dict[str, float]]:
    """The drive's load in a steady regime, and errors of the known figures, in the same units."""
    energy, scene, cycle = sizing.energy, sizing.scene, sizing.cycle
    assert energy is not None
    rated = None if scene.motor is None else scene.motor.rated
    heat, share = energy.copper_heat, energy.copper_heat_share
    off, of_share = (energy.errors.get(name, 0.0) for name in ("copper_heat", "copper_heat_share"))
    motor, run = scene.motor, sizing.run
    if motor is not None and rated is not None and motor.heated == "rotor_heat" and cycle is not None and run is not None:
        shaft = MotorShaft(scene, cycle, run, sizing.speed, sizing.rtol)
        share, error = heat_share(motor, shaft)
        heat, off = share * motor.rated_total_heat, error / max(share, ROUNDING)
        of_share = off
    values = {
        "mean_power": energy.mean_power,
        "rms_torque": energy.rms_torque,
        "rms_torque_share": None if rated is None else energy.rms_torque / rated.torque,
        "heat": heat,
        "heat_share": share,
        "current_rms": energy.current_rms,
    }
    block = estimates(sizing)["energy"]
    relative = block if isinstance(block, float) else 0.0
    exchanged = 0.0 if cycle is None else cycle.exchanged / scene.cycle
    ratio = 1.0 if scene.drive is None else scene.shafts[scene.drive.on]
    scales = {"mean_power": exchanged * sizing.speed, "rms_torque": exchanged / ratio}
    scales["rms_torque_share"] = 0.0 if rated is None else exchanged / ratio / rated.torque
    scales |= {"heat": 0.0, "heat_share": 0.0, "current_rms": 0.0}
    own = {"heat": off, "heat_share": of_share, "current_rms": energy.errors.get("current_rms", off)}
    figures = {name: value for name, value in values.items() if value is not None}
    return values, {n: own.get(n, relative) * max(abs(value), scales[n]) for n, value in figures.items()}


def _with_starts(
    values: dict[str, Any], errors: dict[str, float], start: _PhaseStart, starts: int, steady: float, duration: float
) -> tuple[dict[str, Any], dict[str, float]]:
    """The load of a phase with its starts, from that of its steady running, a share `steady` of the time."""
    figures, off = dict(values), dict(errors)
    figures["mean_power"] = power = steady * (values["mean_power"] or 0.0) + starts * start.work / duration
    off["mean_power"] += start.error * abs(power)
    torque, share = values["rms_torque"] or 0.0, values["rms_torque_share"]
    square = steady * torque**2 + starts * start.square / duration
    figures["rms_torque"] = rms = sqrt(square)
    off["rms_torque"] += start.error * rms
    if share is not None and torque:
        figures["rms_torque_share"] = share * rms / torque
        off["rms_torque_share"] = off["rms_torque"] * share / torque
    heat, current = values["heat"], values["current_rms"]
    if heat is not None and start.heat is not None:
        figures["heat"] = whole = steady * heat + starts * start.heat / duration
        off["heat"] += start.error * whole
        for name, exponent in (("heat_share", 1.0), ("current_rms", 0.5)):  # both go with the heat
            value = values[name]
            if value is not None and heat:
                figures[name] = value * (whole / heat) ** exponent
                off[name] = off["heat"] * value / heat
    elif current is not None:
        figures["current_rms"] = None
    return figures, off


def over(phases: Iterable[Phase], sizings: Mapping[str, Sizing], inertia: float, follow: bool = True) -> Duty:
    """The figures of a duty with one flywheel (kg m² at its own shaft).

    Args:
        phases: in their order.
        sizings: of the phases that run with that flywheel, by name.
        inertia: of the flywheel.
        follow: true to follow changes of speed between the phases in time.

    Raises:
        SceneError: for starts that do not reach the regime, or that take longer than the phase.

    """
    listed, rows = list(phases), list[PhaseLoad]()
    for _again in range(2 if follow else 1):  # changes that continue to the end of a phase begin the next one
        rows, before = _rows(listed, sizings, inertia, rows, follow), rows
        if before or not any(row.change_time == row.duration for row in rows):
            break
    period = sum(row.duration for row in rows)
    cooled = sum(row.duration * row.cooling for row in rows)
    figures, errors = dict[str, float | None](), {"period": sum(row.errors.get("duration", 0.0) for row in rows) / period}
    for name in _FIGURES:
        time = [row._replace(cooling=1.0) for row in rows] if name == "mean_power" else rows
        figures[name], off = _combined(name, time)
        if off is not None:
            errors[name] = off
    work = figures["mean_power"]
    return Duty(
        type=_type(listed, rows),
        governing="",
        period=period,
        running=sum(row.duration for row in rows if not row.rest),
        cooled=cooled,
        cyclic_duration_factor=sum(row.duration for row in rows if row.loaded) / period,
        work=None if work is None else work * period,
        **figures,
        phases=tuple(rows),
        errors=errors,
    )


def _rows(
    phases: list[Phase], sizings: Mapping[str, Sizing], inertia: float, before: list[PhaseLoad], follow: bool
) -> list[PhaseLoad]:
    """The phases one after another, each from the speed at the end of the last; `before` are those of the previous round."""
    faults, rows = list[Fault](), list[PhaseLoad]()
    for k, phase in enumerate(phases):
        last = phases[k - 1]
        begin, run = None, sizings.get(last.name)
        if follow and last is not phase and run is not None and run.run is not None and run.cycle is not None:
            row = rows[-1] if rows else before[-1] if before else None
            begin = float(turning_moment.speed_over_cycle(run.cycle, run.speed, run.run, np.zeros(1))[0])
            if row is not None and row.change_time == row.duration and row.change_speed is not None:
                begin = row.change_speed
        try:
            if phase.scene is None:
                rows.append(PhaseLoad(phase.name, True, phase.duration or 0.0, phase.cooling))
            else:
                rows.append(_load(phase, sizings[phase.name], inertia, begin))
        except SceneError as error:
            faults += error.faults
    refuse(faults)
    return rows


def _combined(name: str, rows: list[PhaseLoad]) -> tuple[float | None, float | None]:
    """A figure over all phases and its relative error; None if it is unknown for a running phase."""
    values = [0.0 if row.rest else getattr(row, name) for row in rows]
    if any(value is None for value in values):
        return None, None
    power = 2 if name in _SQUARED else 1
    average = mean(Stretch(row.duration, value**power, row.cooling) for row, value in zip(rows, values, strict=True))
    cooled, off = sum(row.duration * row.cooling for row in rows), 0.0
    for row, value in zip(rows, values, strict=True):
        error, longer = row.errors.get(name, 0.0), row.errors.get("duration", 0.0)
        own = error if power == 1 else (2 * abs(value) + error) * error
        off += (own * row.duration + abs(value**power - average * row.cooling) * longer) / cooled
    relative = off / abs(average) if average else 0.0
    return (average, relative) if power == 1 else (sqrt(average), 0.5 * relative)


def _type(phases: list[Phase], rows: list[PhaseLoad]) -> str | None:
    """The duty type of IEC 60034-1: one load that alternates with standstill or idling, or loads at several speeds."""
    loads = sum(phase.loaded for phase in phases)
    rests = sum(phase.scene is None for phase in phases)
    idles, braked = len(phases) - loads - rests, any(phase.braking for phase in phases)
    starts = "S5" if braked else "S4" if any(phase.starts for phase in phases) else "S3"
    speeds = [row.speed for row in rows if row.speed]
    if loads == len(phases) > 1 and max(speeds) > (1.0 + _OTHER_SPEED) * min(speeds):
        return "S8"
    if loads != 1:
        return None
    alone = {"S5": "S7", "S4": None, "S3": "S1"}[starts]
    return {(False, False): alone, (True, False): starts, (False, True): "S6"}.get((rests > 0, idles > 0))


def _with_duty(result: Sizing, duty: Duty, scene: Scene, runs: Mapping[str, Sizing]) -> Sizing:
    """A sizing with its duty and the rise of the windings: S2 where they are as good as cold after each rest."""
    rise = _temperature(duty, scene, runs)
    if rise is not None and duty.type == "S3" and min(end for _name, end in rise.phases) <= _COLD:
        duty = duty._replace(type="S2")
    return replace(result, duty=duty, temperature=rise)


def _temperature(duty: Duty, scene: Scene, runs: Mapping[str, Sizing]) -> Temperature | None:
    """Rise of the windings over a duty, phase by phase with starts and changes of speed; None if data are missing.

    The losses are means over the cycles of a phase, and over a start or change of speed. In the error are what the rise in a
    steady cycle (of its sizing in `runs`) exceeds that of the mean by, and losses of starts that come at another instant.
    """
    data = None if scene.motor is None else scene.motor.thermal
    if data is None or scene.motor is None or any(row.heat is None and not row.rest for row in duty.phases):
        return None
    rated, sequence, ends, starts = scene.motor.rated_total_heat, list[Losses](), list[int](), dict[str, int]()
    above, late = 0.0, list[Losses]()  # with all losses of a start in its second half
    for phase, row in zip(scene.duty, duty.phases, strict=True):
        heat, count = (row.heat or 0.0) * row.duration, row.starts or int(row.change_time is not None)
        time, joules = row.start_time or row.change_time or 0.0, row.start_heat or row.change_heat or 0.0
        steady = row.duration - count * time
        after = (heat - count * joules) / steady / rated if steady > 0.0 else 0.0
        running, share = Losses(steady / max(count, 1), after, row.cooling), joules / max(time, 1e-300) / rated
        sequence += [Losses(time, share), running] * count or [running]
        late += [Losses(0.5 * time, 0.0), Losses(0.5 * time, 2.0 * share), running] * count or [running]
        ends.append(len(sequence))
        if not row.rest and (steadily := runs[row.name].temperature) is not None:
            above = max(above, steadily.greatest - data.rise * after)
        if row.starts:
            starts[row.name] = starts_an_hour(data, after, Losses(time * (1 + phase.braking), share))
    windings = course(data, sequence)
    above += abs(course(data, late).greatest - windings.greatest)
    rises = tuple((row.name, windings.ends[end]) for row, end in zip(duty.phases, ends, strict=True))
    error = duty.errors.get("heat", 0.0) + _TO_AND_FRO * above / max(windings.greatest, 1e-300)
    return Temperature(windings.greatest, windings.time, data.limit, error, rises, starts)


def _trips(runs: Mapping[str, Sizing], hardest: Phase) -> Iterator[str]:
    """Messages on an inverter that trips in phases other than the governing one."""
    for name, run in runs.items():
        if name != hardest.name and run.inverter is not None:
            for line in trip_messages(run.inverter.trips):
                yield f"{name}: {line}"


# -- what is to be said ------------------------------------------------------------------------------------------------


def _messages(duty: Duty, scene: Scene, binding: str | None) -> Iterator[str]:
    """Messages on a duty: the phase of the other figures, the assumptions, and the omissions."""
    if binding is None:
        yield f"the figures are those of {duty.governing}, which decides the flywheel; those of the duty are separate"
    else:
        yield f"{binding} over the whole duty decides the flywheel; the figures are those of {duty.governing} with it"
    for row in duty.phases:
        lasting = row.settling is not None and row.settling > _TOO_LONG * row.duration and len(duty.phases) > 1
        if lasting and row.settling is not None and row.change_time is None:
            message = (
                f"{row.name} lasts {row.duration:.4g} s, and a change of speed takes {row.settling:.4g} s to fade to 5 %"
            )
            yield f"{message}: between phases the machine runs otherwise than in a regime, which is left out"
    rests = [row for row in duty.phases if row.rest]
    if rests and scene.motor is not None:
        shares = ", ".join(dict.fromkeys(f"{row.cooling:.3g}" for row in rests))
        yield f"of the time at rest a share of {shares} counts for the motor's cooling"
        if not any(row.starts for row in duty.phases):
            yield "the heat of starts after a rest is not counted: give starts to count it"
    if (
        duty.period > LONGEST
        and duty.heat is not None
        and len(duty.phases) > 1
        and (scene.motor is None or not scene.motor.thermal)
    ):
        yield f"a duty of {duty.period / 60:.4g} min, longer than 10 min, heats the motor above its mean for a while"
