"""What a machine does in turn: the flywheel for the hardest phase of a duty, and the motor's load over all phases.

Every phase has its own steady regime with the one flywheel. Over the duty, of period t, torque and heat are

    T_rms = sqrt(sum T_i² t_i / t_c),  P_heat = sum P_i t_i / t_c,  t_c = sum of t_i running + k sum of t_i at rest

with T_i the root of the mean square over time in a phase, P_i its mean heat, and k the share by which standstill counts for
the cooling. What passes between the regimes of two phases is left out; `settling` tells how long it takes. Starts are
counted by their own heat and torque, from rest until the regime is reached.

Valid for a duty that is short beside the minutes in which windings warm up: 10 minutes unless another time is agreed on,
as IEC 60034-1 has it for S3 to S8. Source: IEC 60034-1, duty types; Fischer, Elektrische Maschinen (Betriebsarten); Dubey,
Fundamentals of Electrical Drives, chapter 4 (ratings by the root mean square).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from math import inf, isfinite, log, sqrt
from typing import Any

import numpy as np

from bondgraph.records import NamedTuple
from flywheel.components.motors import Induction
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.scene import Phase, Scene
from flywheel.sizing import limits
from flywheel.sizing.results import Limit, MotorShaft, Sizing, estimates, heat_share

LONGEST = 600.0
"""Period (s) of a duty that the mean of its heat speaks for, unless another is agreed on: IEC 60034-1 has 10 minutes."""
_FADED = 0.05  # of a change of speed: what is left of it when it has settled
_TOO_LONG = 0.05  # of a phase: what settling may take of it
_MORE = 1e-6  # share by which a phase may exceed a limit
_SEARCHED = 1e-10  # relative error of a flywheel that a limit over the duty decides
_STEP, _STEPS = 1.5, 20  # of inertias that are tried
_FIRST, _BEYOND = 6, 4.0  # steps after which a figure that falls like 1/J is held against what is left of it: 2 of its falls
_HEAVY = 1e3  # times the last of these: as good as a constant speed
_HALVES = 12  # of a bracket at whose end a phase has no regime
_LIGHT = 0.01  # of the machine's own inertia: the lightest of these


class Stretch(NamedTuple):
    """A stretch of a duty: how long (s), its value, and the share by which its time counts for the cooling."""

    time: float
    value: float
    cooling: float = 1.0


def mean(stretches: Iterable[Stretch]) -> float:
    """The mean of a heat (or any value) over a duty: sum of value times time, over the time that cools.

    Args:
        stretches: times (s) not below 0, values of one unit, shares of cooling from 0 to 1.

    Raises:
        SceneError: for a number out of range, or no time that cools.

    Valid where the duty is short beside the motor's thermal time constant.

    >>> mean([Stretch(60.0, 300.0), Stretch(120.0, 0.0, 1 / 3)])
    180.0

    """
    found = list(stretches)
    for each in found:
        refuse(number_faults("time", each.time, NOT_NEGATIVE, "s") + number_faults("value", each.value))
        refuse(number_faults("cooling", each.cooling, NOT_NEGATIVE))
    cooled = sum(each.time * each.cooling for each in found)
    refuse(number_faults("time", cooled, POSITIVE, "s"))
    return sum(each.time * each.value for each in found) / cooled


def root_mean_square(stretches: Iterable[Stretch]) -> float:
    """The root mean square of a torque, power or current over a duty: sqrt(sum of T² t over the time that cools).

    Args:
        stretches: as in `mean`; a value is itself the root of the mean square in its stretch.

    Raises:
        SceneError: as in `mean`.

    Valid where losses grow with the square of the torque, next to the rated point at a constant flux.
    Source: Dubey, Fundamentals of Electrical Drives, chapter 4 (selection of motor power rating); Theraja and Theraja, A
    Textbook of Electrical Technology, vol. III, chapter 44 (rating and service capacity).

    >>> round(root_mean_square([Stretch(10.0, 40.0), Stretch(20.0, 10.0), Stretch(30.0, 0.0)]), 6)
    17.320508

    """
    return sqrt(mean(each._replace(value=each.value**2) for each in stretches))


def sized(scene: Scene, size: Callable[[Scene], Sizing], plain: Callable[[Scene], Sizing]) -> Sizing:
    """The sizing of the phase that decides on the flywheel, with the duty.

    Limits of irregularity, torque and current are kept in every phase, those of the motor's heat and of the root mean
    square of its torque over the whole duty.

    Args:
        scene: with a duty.
        size: sizes a scene as asked, for the phase that decides.
        plain: sizes a scene without a confirmation of its own, for the others.

    Raises:
        SceneError: with the faults of all phases that cannot run, and where no flywheel keeps a limit over the duty.

    """
    running = [phase for phase in scene.duty if phase.scene is not None]
    whole = {name: scene.limits[name] for name in WHOLE if name in scene.limits}
    if whole and len(whole) == len(scene.limits):
        alone_there = f"limits of {' and '.join(whole)} alone, which are those of the whole duty"
        raise SceneError([Fault("flywheel.limits", alone_there, "an irregularity beside them", "which every phase keeps")])
    if whole:
        running = [phase._replace(scene=_without(_scene(phase), whole)) for phase in running]
    hardest, runs = _hardest(running, plain)
    search = _Search(scene, running, plain, whole, {_inertia(runs): runs})
    lightest = _inertia(runs)
    needed = {name: search.smallest(name, lightest) for name in whole}
    inertia = max([lightest, *needed.values()])
    found = size(_scene(hardest)) if inertia == lightest else None
    if found is not None and abs((found.inertia or 0.0) - inertia) <= _MORE * inertia:
        runs[hardest.name] = found if found.simulation else runs[hardest.name]
        duty, binding = over(scene.duty, runs, inertia), found.binding
    else:
        found = _with_flywheel(_scene(hardest), size(analysed(_scene(hardest), inertia)), inertia)
        duty = search.duty(inertia)
        binding = max(needed, key=lambda name: needed[name]) if inertia > lightest else None
        runs = search.runs(inertia)
    duty = duty._replace(governing=hardest.name)
    alone = needed | {name: limit.alone for name, limit in (plain(_scene(hardest)).limits if scene.limits else {}).items()}
    kept = {name: _reached(name, asked, duty, runs, alone[name]) for name, asked in scene.limits.items()}
    told = (*found.messages, *_messages(duty, scene, binding if binding in whole else None), *search.unkept(inertia))
    return replace(found, duty=duty, limits=kept, binding=binding, messages=told)


WHOLE = {"motor_heat": "heat_share", "motor_rms": "rms_torque_share"}
"""Limits that are kept over the whole duty, and the figures of it that they are of."""


def _scene(phase: Phase) -> Scene:
    assert phase.scene is not None
    return phase.scene


def _without(scene: Scene, names: Mapping[str, float]) -> Scene:
    """The scene without some of its limits."""
    left = {name: limit for name, limit in scene.limits.items() if name not in names}
    return replace(scene, limits=left)


def analysed(scene: Scene, inertia: float) -> Scene:
    """The scene with a given flywheel (kg m² at its own shaft), in place of what is asked of it."""
    return scene if scene.inertia == inertia else scene.with_flywheel(inertia)


def _inertia(runs: Mapping[str, Sizing]) -> float:
    """The flywheel that phases run with."""
    return next(iter(runs.values())).inertia or 0.0


def _with_flywheel(scene: Scene, found: Sizing, inertia: float) -> Sizing:
    """An analysis as the sizing of a scene, whose flywheel it is."""
    wheel = found.flywheel._replace(inertia=None, exact=inertia, needed=True)
    return replace(found, scene=scene, flywheel=wheel, error=found.error._replace(exact=_SEARCHED))


def _hardest(phases: list[Phase], plain: Callable[[Scene], Sizing]) -> tuple[Phase, dict[str, Sizing]]:
    """The phase that needs the largest flywheel, or runs least evenly with a given one, and all with that flywheel.

    A phase that keeps what is asked with the flywheel of another needs no more than that.
    """
    given = _scene(phases[0]).inertia
    sizings, faults = dict[str, Sizing](), list[Fault]()
    hardest, inertia = phases[0], given
    for phase in phases:
        try:
            run = None if inertia is None else plain(analysed(_scene(phase), inertia))
            if run is None or (given is None and any(_beyond(run, _asked(_scene(phase))))):
                hardest, inertia = phase, max(plain(_scene(phase)).inertia or 0.0, inertia or 0.0)
                run = plain(analysed(_scene(phase), inertia))
            sizings[phase.name] = run
        except SceneError as error:
            faults += [fault._replace(path=f"{phase.path} ({phase.name}): {fault.path}") for fault in error.faults]
    refuse(faults)
    for phase in phases:
        if inertia is not None and sizings[phase.name].inertia != inertia:
            sizings[phase.name] = plain(analysed(_scene(phase), inertia))
    if given is not None:
        hardest = max(phases, key=lambda phase: _irregularity(sizings[phase.name]))
    return hardest, sizings


def _asked(scene: Scene) -> dict[str, float]:
    """What a phase shall keep: its limits, or its irregularity."""
    return dict(scene.limits) or ({} if scene.irregularity is None else {"irregularity": scene.irregularity})


def _figures(names: Iterable[str], run: Sizing) -> dict[str, limits.Share]:
    """The figures of a phase that are limited."""
    if run.cycle is None or run.run is None:
        return {}
    return limits.shares(names, MotorShaft(run.scene, run.cycle, run.run, run.speed, run.rtol))


def _beyond(run: Sizing, asked: Mapping[str, float]) -> Iterator[str]:
    """The limits that a phase does not keep."""
    for name, share in _figures(asked, run).items():
        if share.value > asked[name] * (1.0 + _MORE) + share.error:
            yield name


class _Search:
    """Duties with flywheels of several inertias (kg m² at their own shaft): the smallest that keeps a limit over a duty."""

    def __init__(
        self,
        scene: Scene,
        running: list[Phase],
        plain: Callable[[Scene], Sizing],
        whole: Mapping[str, float],
        known: dict[float, dict[str, Sizing]],
    ) -> None:
        self.scene, self.running, self.plain, self.asked = scene, running, plain, whole
        self.known, self.duties = known, dict[float, Duty]()

    def runs(self, inertia: float) -> dict[str, Sizing]:
        """All phases with a flywheel."""
        if inertia not in self.known:
            self.known[inertia] = {p.name: self.plain(analysed(_scene(p), inertia)) for p in self.running}
        return self.known[inertia]

    def duty(self, inertia: float) -> Duty:
        """The duty with a flywheel."""
        if inertia not in self.duties:
            self.duties[inertia] = over(self.scene.duty, self.runs(inertia), inertia)
        return self.duties[inertia]

    def off(self, name: str, inertia: float) -> float:
        """By how much a figure of the duty is beyond its limit; without end where a phase has no regime."""
        try:
            return float(getattr(self.duty(inertia), WHOLE[name])) - self.asked[name]
        except SceneError:
            return inf

    def smallest(self, name: str, start: float) -> float:
        """The smallest flywheel that keeps a limit over the duty, looked for from one with which all phases run."""
        least = _LIGHT * self._own()
        after, tried = max(start, least), {start: self.off(name, start)}
        if tried[start] > 0.0:
            before = start
            for k in range(1, _STEPS + 1):
                after = max(start, least) * _STEP**k
                tried[after] = self.off(name, after)
                if tried[after] <= 0.0:
                    return self._crossing(name, before, after)
                falls = tried[before] - tried[after]
                if k >= _FIRST and tried[after] > _BEYOND * falls:
                    break
                before = after
            tried[_HEAVY * after] = self.off(name, _HEAVY * after)
            raise SceneError([self._unreached(name, min(tried, key=lambda each: tried[each]))])
        while after > least:
            before = after / _STEP
            if self.off(name, before) > 0.0:
                return self._crossing(name, before, after)
            after = before
        return 0.0 if self.off(name, 0.0) <= 0.0 else after

    def _crossing(self, name: str, low: float, high: float) -> float:
        """The flywheel between two at which a figure of the duty is at its limit, or the lightest with which all run."""
        from scipy.optimize import brentq  # only such duties pay for it

        for _ in range(_HALVES):
            if isfinite(self.off(name, low)):
                return float(brentq(lambda each: self.off(name, each), low, high, xtol=1e-300, rtol=_SEARCHED))
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.off(name, middle) <= 0.0 else (middle, high)
        return high

    def _unreached(self, name: str, best: float) -> Fault:
        reached = 100.0 * (self.off(name, best) + self.asked[name])
        found = f"{100 * self.asked[name]:.6g} %, which no flywheel reaches over the duty: at best, with {best:.5g} kg m^2"
        advice = "give a larger motor, or allow it more"
        return Fault(f"flywheel.limits.{name}", f"{found}, it is {reached:.6g} %", "a limit above that", advice)

    def _own(self) -> float:
        """The machine's own inertia at the flywheel's shaft."""
        found = next(iter(self.known.values())).values()
        own = max(0.0 if run.reduced_inertia is None else run.reduced_inertia.greatest for run in found)
        return own / self.scene.flywheel_ratio**2

    def unkept(self, inertia: float) -> Iterator[str]:
        """What phases do not keep with the flywheel of another, where more inertia is not always better."""
        for phase in self.running if self.scene.inertia is None else ():
            for name in _beyond(self.runs(inertia)[phase.name], _asked(_scene(phase))):
                yield f"{phase.name} does not keep {name} with that flywheel"


def _reached(name: str, asked: float, duty: Duty, runs: Mapping[str, Sizing], alone: float) -> Limit:
    """A limit of the scene, with the figure of the whole duty or of the phase that is nearest to it."""
    if name in WHOLE:
        reached = float(getattr(duty, WHOLE[name]))
        return Limit(asked, reached, alone, None, duty.errors.get(WHOLE[name], 0.0), _SEARCHED)
    shares = [share[name] for run in runs.values() if (share := _figures((name,), run))]
    worst = max(shares, key=lambda each: each.value, default=limits.Share(0.0, 0.0))
    return Limit(asked, worst.value, alone, None, worst.error / max(worst.value, 1e-300), _SEARCHED)


def _irregularity(sizing: Sizing) -> float:
    return 0.0 if sizing.simulation is None else sizing.simulation.irregularity


# -- the motor over the duty -------------------------------------------------------------------------------------------

_FIGURES = ("mean_power", "rms_torque", "rms_torque_share", "heat", "heat_share", "current_rms")
_SQUARED = ("rms_torque", "rms_torque_share", "current_rms")  # what counts by its square


class PhaseLoad(NamedTuple):
    """A phase of a duty as it runs with the flywheel; all but `duration` is None at rest, or where it does not apply.

    `duration` (s) with its starts and `cycles` without;
    `speed` (rad/s, mean of extremes, of the crank), `irregularity`; `mean_power` and `peak_power` (W) of the drive,
    `rms_torque` (N m, on its shaft), `heat` (W) of what heats the motor, `current_rms` (A), those of starts included but
    for the peak; shares are over the rated point. `start_time` (s) and `start_heat` (J) are those of one start, `settling`
    (s) the time in which a change of speed fades to 5 %. `errors` are estimated errors of figures, in their units.
    """

    name: str
    rest: bool
    duration: float
    cooling: float = 1.0
    loaded: bool = False
    cycles: float | None = None
    starts: int = 0
    speed: float | None = None
    irregularity: float | None = None
    mean_power: float | None = None
    peak_power: float | None = None
    rms_torque: float | None = None
    rms_torque_share: float | None = None
    heat: float | None = None
    heat_share: float | None = None
    current_rms: float | None = None
    start_time: float | None = None
    start_heat: float | None = None
    settling: float | None = None
    errors: Mapping[str, float] = {}


class Duty(NamedTuple):
    """A duty with one flywheel, and its motor's load. `governing` is the phase that decides on the flywheel.

    `type` is that of IEC 60034-1 where it is S1, S3, S4 or S6; `period`, `running` and `cooled` (s): all of it, the part in
    which the motor is on, and what counts for cooling. `cyclic_duration_factor` is the share of the period in which the
    machine is loaded. `mean_power` (W) and `work` (J) are over the period; `rms_torque` (N m, at the drive's shaft), `heat`
    (W) and `current_rms` (A) over the time that cools, shares over the rated point. `errors` are estimated relative errors.
    """

    type: str | None
    governing: str
    period: float
    running: float
    cooled: float
    cyclic_duration_factor: float
    work: float | None
    mean_power: float | None
    rms_torque: float | None
    rms_torque_share: float | None
    heat: float | None
    heat_share: float | None
    current_rms: float | None
    phases: tuple[PhaseLoad, ...]
    errors: Mapping[str, float]

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, SI; errors stand with those of the other figures."""
        found = {name: value for name, value in self._asdict().items() if name != "errors"}
        phases = [{name: value for name, value in row._asdict().items() if name != "errors"} for row in self.phases]
        return found | {"phases": phases}


class _Start(NamedTuple):
    """A start from rest: time (s), the motor's work and heat (J), the integral of its torque squared (N² m² s), error."""

    time: float
    work: float
    heat: float | None
    square: float
    error: float


def _start(phase: Phase, inertia: float) -> _Start:
    """One start of a phase's machine, from rest to its regime."""
    import flywheel  # motions in time stand above sizings

    scene, path = _scene(phase), f"{phase.path}.starts"
    if scene.motor is None:
        raise SceneError([Fault(path, "starts of a drive that is no motor", "a motor", "leave starts out")])
    try:
        run = flywheel.run_up(analysed(scene, inertia))
    except SceneError as error:
        raise SceneError([fault._replace(path=f"{path}: {fault.path}") for fault in error.faults]) from None
    if run.reason != "regime":
        raise SceneError([Fault(path, f"a start that ends otherwise: {run.ended}", "one that comes to the regime")])
    samples, owners = run.samples
    count = int(np.bincount(owners)[0])
    _, weights = np.polynomial.legendre.leggauss(count - 2)
    columns = (samples.t, samples.drive, samples.omega)
    t, torque, omega = (np.asarray(column).reshape(-1, count) for column in columns)
    half, heat = 0.5 * (t[:, -1] - t[:, 0]), run.energy.copper
    square = float(half @ (torque[:, 1:-1] ** 2 @ weights))
    if isinstance(scene.motor, Induction) and scene.drive is not None:
        speed, begun = scene.shafts[scene.drive.on] * omega[:, 1:-1], run.start_heat
        if scene.motor.start is None or begun is None:
            heat = float(half @ (_heat(scene.motor, speed) @ weights))
        else:  # by its connections up to the rated speed in the last of them, then as it runs
            later = scene.motor.stator_heat(speed)
            later = np.zeros_like(speed) if later is None else np.where(t[:, 1:-1] > begun.time, later, 0.0)
            heat = (run.energy.rotor_heat or 0.0) + (begun.stator or 0.0) + float(half @ (later @ weights))
    return _Start(run.time, run.energy.drive, heat, square, 2 * run.error)


def _load(phase: Phase, sizing: Sizing, inertia: float) -> PhaseLoad:
    """A phase that runs, from the sizing of its machine with the flywheel (kg m²), and from one of its starts."""
    energy, motion, cyclic = sizing.energy, sizing.simulation, sizing.cyclic
    period = None if motion is None else motion.period
    if phase.duration is None and period is None:
        found = f"{phase.cycles:g} cycles of a machine that has no motion"
        raise SceneError([Fault(f"{phase.path}.cycles", found, "a duration")])
    start = _start(phase, inertia) if phase.starts else None
    starting = 0.0 if start is None else phase.starts * start.time
    steady = (phase.cycles or 0.0) * (period or 0.0) if phase.duration is None else phase.duration - starting
    if steady < 0.0:
        found = f"{phase.starts} starts of {starting / phase.starts:.4g} s in {phase.duration:.4g} s"
        raise SceneError([Fault(f"{phase.path}.starts", found, "time for all of them", "make the phase longer")])
    duration, of_period = steady + starting, sizing.error.period or ROUNDING
    errors = {"duration": steady * of_period if phase.duration is None else ROUNDING * duration}
    settling = None
    if cyclic is not None and period is not None and 0.0 < cyclic.multiplier < 1.0:
        settling = period * log(_FADED) / log(cyclic.multiplier)
    row = PhaseLoad(
        phase.name, False, duration, 1.0, phase.loaded, period and steady / period, phase.starts, sizing.speed,
        None if motion is None else motion.irregularity, settling=settling,
        start_time=start and start.time, start_heat=start and start.heat,
    )  # fmt: skip
    if energy is None:
        return row._replace(errors=errors)
    values, off = _of_motor(sizing)
    if start is not None:
        values, off = _with_starts(values, off, start, phase.starts, steady / duration, duration)
    return row._replace(**values, peak_power=energy.peak_power, errors=errors | off)


def _of_motor(sizing: Sizing) -> tuple[dict[str, Any], dict[str, float]]:
    """The drive's load in a steady regime, and the errors of what is known of it, in the same units."""
    energy, scene, cycle = sizing.energy, sizing.scene, sizing.cycle
    assert energy is not None
    rated = None if scene.motor is None else scene.motor.rated
    heat, share, off = energy.copper_heat, energy.copper_heat_share, energy.errors.get("copper_heat_share", 0.0)
    if isinstance(scene.motor, Induction) and cycle is not None and sizing.run is not None:
        shaft = MotorShaft(scene, cycle, sizing.run, sizing.speed, sizing.rtol)
        share, error = heat_share(scene.motor, shaft)
        heat, off = share * float(_heat(scene.motor, np.array(scene.motor.speed))), error / max(share, ROUNDING)
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
    own = {"heat": off, "heat_share": off, "current_rms": energy.errors.get("current_rms", off)}
    known = {name: value for name, value in values.items() if value is not None}
    return values, {n: own.get(n, relative) * max(abs(value), scales[n]) for n, value in known.items()}


def _heat(motor: Induction, speeds: Array) -> Array:
    """Heat (W) of an induction motor at speeds (rad/s): of its rotor, and of its stator's copper where that is known."""
    stator = motor.stator_heat(speeds)
    return motor.rotor_heat(speeds) if stator is None else motor.rotor_heat(speeds) + stator


def _with_starts(
    values: dict[str, Any], errors: dict[str, float], start: _Start, starts: int, steady: float, duration: float
) -> tuple[dict[str, Any], dict[str, float]]:
    """The load of a phase with its starts, from that of its steady running, a share `steady` of the time."""
    found, off = dict(values), dict(errors)
    found["mean_power"] = power = steady * (values["mean_power"] or 0.0) + starts * start.work / duration
    off["mean_power"] += start.error * abs(power)
    torque, share = values["rms_torque"] or 0.0, values["rms_torque_share"]
    square = steady * torque**2 + starts * start.square / duration
    found["rms_torque"] = rms = sqrt(square)
    off["rms_torque"] += start.error * rms
    if share is not None and torque:
        found["rms_torque_share"] = share * rms / torque
        off["rms_torque_share"] = off["rms_torque"] * share / torque
    heat, current = values["heat"], values["current_rms"]
    if heat is not None and start.heat is not None:
        found["heat"] = whole = steady * heat + starts * start.heat / duration
        off["heat"] += start.error * whole
        for name, exponent in (("heat_share", 1.0), ("current_rms", 0.5)):  # both go with the heat
            value = values[name]
            if value is not None and heat:
                found[name] = value * (whole / heat) ** exponent
                off[name] = off["heat"] * value / heat
    elif current is not None:
        found["current_rms"] = None
    return found, off


def over(phases: Iterable[Phase], sizings: Mapping[str, Sizing], inertia: float) -> Duty:
    """The figures of a duty with one flywheel (kg m² at its own shaft).

    Args:
        phases: in their order.
        sizings: of the phases that run with that flywheel, by name.
        inertia: of the flywheel.

    Raises:
        SceneError: for starts that do not come to the regime, or that take more time than there is.

    """
    listed, rows = list(phases), list[PhaseLoad]()
    faults: list[Fault] = []
    for phase in listed:
        try:
            if phase.scene is None:
                rows.append(PhaseLoad(phase.name, True, phase.duration or 0.0, phase.cooling))
            else:
                rows.append(_load(phase, sizings[phase.name], inertia))
        except SceneError as error:
            faults += error.faults
    refuse(faults)
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
        type=_type(listed),
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


def _combined(name: str, rows: list[PhaseLoad]) -> tuple[float | None, float | None]:
    """A figure over all phases and its relative error; None where it is not known of each that runs."""
    values = [0.0 if row.rest else getattr(row, name) for row in rows]
    if any(value is None for value in values):
        return None, None
    power = 2 if name in _SQUARED else 1
    found = mean(Stretch(row.duration, value**power, row.cooling) for row, value in zip(rows, values, strict=True))
    cooled, off = sum(row.duration * row.cooling for row in rows), 0.0
    for row, value in zip(rows, values, strict=True):
        error, longer = row.errors.get(name, 0.0), row.errors.get("duration", 0.0)
        own = error if power == 1 else (2 * abs(value) + error) * error
        off += (own * row.duration + abs(value**power - found * row.cooling) * longer) / cooled
    relative = off / abs(found) if found else 0.0
    return (found, relative) if power == 1 else (sqrt(found), 0.5 * relative)


def _type(phases: list[Phase]) -> str | None:
    """The duty type of IEC 60034-1, where one load takes turns with standstill or with idling."""
    loads = sum(phase.loaded for phase in phases)
    rests = sum(phase.scene is None for phase in phases)
    idles, starts = len(phases) - loads - rests, any(phase.starts for phase in phases)
    if loads != 1:
        return None
    return {(False, False): None if starts else "S1", (True, False): "S4" if starts else "S3", (False, True): "S6"}.get(
        (rests > 0, idles > 0)
    )


# -- what is to be said ------------------------------------------------------------------------------------------------


def _messages(duty: Duty, scene: Scene, binding: str | None) -> Iterator[str]:
    """What a user must know of a duty: whose figures the others are, what was taken for granted, what is left out."""
    if binding is None:
        yield f"the figures are those of {duty.governing}, which decides on the flywheel; those of the duty stand apart"
    else:
        yield f"{binding} over the whole duty decides on the flywheel; the figures are those of {duty.governing} with it"
    for row in duty.phases:
        if row.settling is not None and row.settling > _TOO_LONG * row.duration and len(duty.phases) > 1:
            told = f"{row.name} lasts {row.duration:.4g} s, and a change of speed takes {row.settling:.4g} s to fade to 5 %"
            yield f"{told}: between phases the machine runs otherwise than in a regime, which is left out"
    rests = [row for row in duty.phases if row.rest]
    if rests and scene.motor is not None:
        shares = ", ".join(dict.fromkeys(f"{row.cooling:.3g}" for row in rests))
        yield f"of the time at rest a share of {shares} counts for the motor's cooling"
        if not any(row.starts for row in duty.phases):
            yield "the heat of starts after a rest is not counted: give starts to count it"
    if duty.period > LONGEST and duty.heat is not None and len(duty.phases) > 1:
        yield f"a duty of {duty.period / 60:.4g} min, longer than 10 min, heats the motor for a while by more than its mean"
