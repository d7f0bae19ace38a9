"""A scene sized, analysed and followed, each answer beside that of the oracle: what it is, or how it fails.

Outcomes: `right`; `refused` (where the oracle finds nothing either); `undecided` (the oracle does not do it); and what is a
defect: `wrong` (further off than the answer says), `untrue` (refused, though the oracle does it), `broken` (a traceback or a
warning), `late` (no answer within 20 s of computing).
"""

from __future__ import annotations

import itertools
import math
import signal
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

import flywheel
from flywheel.motions.motion import speed_at, states_at
from tests.generated.scenes import Drawn, chance
from tests.oracle.courses import RTOL, Course, Machine, Piece, Undetermined
from tests.oracle.drive_lines import value
from tests.oracle.motors import rated as rated_point
from tests.oracle.motors import slip_heat, volts
from tests.oracle.starts import plain

LATE = 20.0  # s of computing
_UNRAISABLE = ("gc_callback", "__del__")  # functions that the collector of garbage calls
FLOOR = 2e-8  # what the oracle is good to
CYCLE = 1e-9  # what it is good to over a single cycle
_OUT_OF_STEP = "out of step"
REPEATS = 7  # of a sizing by the same machine
ACCURACY = "accuracy"
ROUTES = ("size", "rest", "down", "both", "regime", ACCURACY)
PROOF = "proof"  # a route of its own: it takes the extra of that name, and as long as all others
DEFECTS = ("wrong", "untrue", "broken", "late")
Scene = dict[str, Any]


class Verdict(NamedTuple):
    """Verdict on a scene on one route, with remarks, and the times of toolkit and oracle (s)."""

    route: str
    outcome: str
    detail: str = ""
    seconds: float = 0.0
    oracle: float = 0.0


class Late(BaseException):
    """Out of time; no `except Exception` may swallow it."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """A stretch of computing that is ended after some seconds."""

    def ring(_: int, frame: FrameType | None) -> None:
        if frame is not None and frame.f_code.co_name in _UNRAISABLE:
            signal.setitimer(signal.ITIMER_PROF, 0.01)  # what is raised there is lost
        else:
            raise Late

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


class Answer(NamedTuple):
    """Answer of the toolkit: a value, an outcome that is a defect, or the words of a refusal."""

    value: Any = None
    refusal: str = ""
    outcome: str = ""
    detail: str = ""
    seconds: float = 0.0


def answered(call: Callable[[], Any]) -> Answer:
    """A call of the toolkit, watched."""
    start = time.process_time()
    try:
        with limited(LATE), warnings.catch_warnings():
            warnings.simplefilter("error")
            value = call()
    except flywheel.SceneError as error:
        return Answer(refusal="; ".join(map(str, error.faults)) or "without a word", seconds=time.process_time() - start)
    except Late:
        return Answer(outcome="late", seconds=LATE)
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{last.filename.rpartition('/')[2]}:{last.lineno}"
        return Answer(
            outcome="broken",
            detail=f"{type(error).__name__}: {str(error)[:150]} ({where})",
            seconds=time.process_time() - start,
        )
    return Answer(value, seconds=time.process_time() - start)


class Plan(NamedTuple):
    """A motion to be followed: from a speed (rad/s), with the drive or without, for a time (s), the unknown's value."""

    omega: float
    drive: bool
    until: float
    inertia: float
    balance: float
    phi: float = 0.0


def judged(case: Drawn, routes: tuple[str, ...] = ROUTES) -> list[Verdict]:
    """All verdicts on a scene."""
    given, rng = case.scene, np.random.default_rng([case.seed, 1])
    loaded = answered(lambda: flywheel.load(given))
    if loaded.value is None:
        return [Verdict("load", loaded.outcome or "untrue", loaded.detail or loaded.refusal, loaded.seconds)]
    result: list[Verdict] = []
    scene = plain(given)
    case = case._replace(scene=scene)
    wheel = scene["flywheel"]
    inertia = wheel.get("inertia", float(f"{0.3 * case.inertia / case.speed(wheel.get('on', 'crank')) ** 2:.4g}"))
    sized: Any = None
    if {"size", "regime", ACCURACY, PROOF} & {*routes}:
        verdict, sized = _sized(case, loaded.value)
        result.append(verdict)
    balance = 0.0 if sized is None or sized.balance is None else float(f"{sized.balance.value:.4g}")
    turn = 2 * math.pi / case.pace
    start = float(f"{case.pace * rng.uniform(0.2, 1.5):.4g}")
    back = float(f"{case.pace * rng.uniform(-1.2, 1.2):.4g}") if chance(rng, 0.7) else 0.0
    plans = {
        "rest": Plan(0.0, True, 1.7 * turn, inertia, balance),
        "down": Plan(start, False, 2.3 * turn, inertia, balance),
        "both": Plan(back, True, 1.3 * turn, inertia, balance, float(f"{rng.uniform(-3, 6):.4g}")),
    }
    result += [followed(scene, loaded.value, route, plan) for route, plan in plans.items() if route in routes]
    if "regime" in routes and sized is not None:
        result.append(_kept(scene, loaded.value, sized))
    if ACCURACY in routes and sized is not None:
        result.append(_at_accuracies(loaded.value))
    if PROOF in routes and sized is not None:
        result.append(_in_intervals(loaded.value, sized))
    return result


def followed(scene: Scene, loaded: Any, route: str, plan: Plan) -> Verdict:
    """A motion of a scene, at its end and in its middle, and the work of every element along it."""
    answer = answered(lambda: _motion(loaded, route, plan))
    begun = time.process_time()
    try:
        with limited(2 * LATE):
            if route == "both":  # the function's motor runs as it does in its own connection
                scene = unstarted(scene)
            machine, course = course_of(scene, plan)
    except (Undetermined, ArithmeticError, ValueError, Late) as error:
        outcome = answer.outcome or "undecided"
        return Verdict(
            route, outcome, answer.detail or f"oracle: {type(error).__name__} {error}; {answer.refusal}", answer.seconds
        )
    verdict = _beside(scene, route, plan, answer, machine, course)
    if verdict.outcome == "wrong":  # the oracle's own steps are not to blame
        machine, course = course_of(scene, plan, finer=True)
        verdict = _beside(scene, route, plan, answer, machine, course)
    return verdict._replace(oracle=time.process_time() - begun)


def unstarted(scene: Scene) -> Scene:
    """A scene whose motor runs in its own connection from the first."""
    drive = scene.get("drive", {})
    if "start" not in drive.get("motor", {}):
        return scene
    return scene | {"drive": drive | {"motor": {k: v for k, v in drive["motor"].items() if k != "start"}}}


def course_of(scene: Scene, plan: Plan, finer: bool = False) -> tuple[Machine, Course]:
    """The oracle's motion."""
    machine = Machine(scene, inertia=plan.inertia, drive=plan.drive)
    machine.given(plan.balance)
    states = None
    if machine.motor is not None and plan.phi == 0.0:  # the command's motor runs steadily at a speed, the function's is off
        states = machine.motor.unfed(machine.speeds[machine.driven] * plan.omega)
    y = machine.start(plan.phi, plan.omega, states)
    return machine, machine.follow(y, plan.until, scale=plan.until, rtol=0.02 * RTOL if finer else RTOL)


class Told(NamedTuple):
    """Results of the toolkit for a motion: its end, its error, the closure of its energy, and the work of every element."""

    t: float
    phi: float
    omega: float
    error: float
    residual: float
    reason: str
    works: dict[str, float] | None


def _motion(loaded: Any, route: str, plan: Plan) -> Told:
    """A motion by the toolkit: as the command follows it, or as the function does, from any state."""
    balance = plan.balance if loaded.unknown is not None else None
    if route == "both":
        run = flywheel.simulate(loaded, plan.phi, plan.omega, plan.until, inertia=plan.inertia, balance=balance, rtol=1e-8)
        end = float(run.t[-1]), float(run.phi[-1]), float(run.omega[-1])
        return Told(*end, run.error, run.energy_residual, run.ended or "time", None)
    run = flywheel.transient(
        loaded,
        start=plan.omega or "rest",
        end=plan.until,
        drive=plan.drive,
        inertia=plan.inertia,
        balance=balance,
        rtol=1e-8,
    )
    run.as_dict()
    works = {name.split(" on ")[0]: work for name, work in run.energy.works.items()}
    works |= {"drive": run.energy.drive, "meshes": run.energy.meshes}
    residual = max(run.motion.energy_residual, run.energy.residual)
    return Told(run.time, run.phi, run.omega, run.error, residual, run.reason, works)


def _beside(scene: Scene, route: str, plan: Plan, answer: Answer, machine: Machine, course: Course) -> Verdict:
    """The verdict on a motion."""
    moved = not (course.rests and course.rests[0].start == 0.0 and math.isinf(course.rests[0].end))
    if answer.outcome:
        return Verdict(route, answer.outcome, answer.detail, answer.seconds)
    if answer.refusal:
        true = not moved
        return Verdict(route, "refused" if true else "untrue", answer.refusal, answer.seconds)
    run: Told = answer.value
    if not np.isfinite(run[:4]).all() or not run.residual < 1e-4:
        detail = f"phi {run.phi}, omega {run.omega}, error {run.error}, energy misses {run.residual}"
        return Verdict(route, "wrong", detail, answer.seconds)
    fault, said = _beyond(run, plan, course), max(run.error, FLOOR)
    if not fault and run.works is not None:
        fault = _energies(run.works, machine, course.y if run.t < plan.until else course.at(run.t), said)
    return Verdict(route, "wrong" if fault else "right", fault, answer.seconds)


def _beyond(run: Told, plan: Plan, course: Course) -> str:
    """Figures of a motion with an error above its estimate; empty where all is right."""
    if run.t > plan.until * (1 + 1e-9):
        return f"ends at {run.t:.9g} s, {plan.until:.9g} s asked"
    states = [p.states(p.end) for p in course.pieces]
    way = max(float(np.ptp([plan.phi, *(y[0] for y in states)])), 1.0)
    fastest = max(abs(plan.omega), *(abs(float(y[1])) for y in states), 1e-300)
    said = max(run.error, FLOOR)
    if run.t < plan.until * (1 - 1e-9):  # it ends where it stands for good
        rests = [r for r in course.rests if abs(r.start - run.t) < 1e-3 * plan.until and r.end >= plan.until]
        if not rests or abs(run.phi - rests[-1].phi) > 10 * math.sqrt(said) * way:
            end = course.at(plan.until)
            output = f"{run.reason} at {run.t:.6g} s, {run.phi:.9g} rad; true"
            return f"{output} {end[0]:.9g} rad, {end[1]:.9g} rad/s at {plan.until:.6g} s, rests {course.rests}"
        return "" if abs(run.phi - rests[-1].phi) <= said * way else f"stops at {run.phi:.10g} for {rests[-1].phi:.10g} rad"
    end = course.at(plan.until)
    if abs(run.phi - end[0]) <= said * way and abs(run.omega - end[1]) <= said * fastest:
        return ""
    figures = f"phi {run.phi:.10g} for {end[0]:.10g}, omega {run.omega:.10g} for {end[1]:.10g}"
    return f"at {run.t:.6g} s {figures}, error {run.error:.2g}; rests {course.rests}"


def _energies(sized: dict[str, float], machine: Machine, end: Any, said: float) -> str:
    """Errors of the works of elements, each by its own law; empty where all is right."""
    works = machine.works(end)
    scale = max([machine.kinetic(end), *map(abs, works.values()), 1e-300])
    for name, work in works.items():
        other = sized.get(name, 0.0)
        if abs(other - work) > 30 * said * scale:
            return f"work of {name} {other:.10g} J for {work:.10g} J, of {scale:.4g} J"
    return ""


# -- the steady regime -----------------------------------------------------------------------------------------------


def _sized(case: Drawn, loaded: Any) -> tuple[Verdict, Any]:
    """A sizing, or an analysis, and the steady motion that it found, stepped through one cycle."""
    answer = answered(lambda: _figures(flywheel.size(loaded)))
    if answer.outcome:
        return Verdict("size", answer.outcome, answer.detail, answer.seconds), None
    begun = time.process_time()
    if answer.refusal:
        verdict = _refused(case, answer)
        return verdict._replace(oracle=time.process_time() - begun), None
    sizing = answer.value
    try:
        with limited(2 * LATE):
            outcome, detail = steady(unstarted(case.scene), sizing)
            if outcome == "right" and (other := _again(sizing)):
                outcome, detail = "wrong", other
    except (Undetermined, ArithmeticError, ValueError, Late) as error:
        outcome, detail = "undecided", f"oracle: {type(error).__name__} {error}"
    return Verdict("size", outcome, detail, answer.seconds, time.process_time() - begun), sizing


def _again(sizing: Any) -> str:
    """Figures of the same machine sized again and again that are others; machines record what is often asked of them."""
    begun = time.process_time()
    figures: list[tuple[Any, Any]] = []
    while sizing.machine is not None and len(figures) <= REPEATS:
        try:
            again = flywheel.size(sizing.machine, sizing.rtol, accuracy="normal")
        except flywheel.SceneError as error:
            return f"sized again: {error}"
        motion = again.run.irregularity if again.run is not None else None
        figures.append((again.flywheel.exact, motion))
        if time.process_time() - begun > 1.0:
            break
    allowed = 2 * max(sizing.error.exact or 0.0, sizing.error.simulation or 0.0) + 1e-14
    for first, other in zip(figures[:1] * len(figures), figures, strict=True):
        if any(a is not None and b is not None and abs(a - b) > allowed * abs(a) for a, b in zip(first, other, strict=True)):
            return f"sized again: {other} for {first}"
    return ""


def _figures(sizing: Any) -> Any:
    """A sizing with all its figures worked out."""
    sizing.as_dict()
    return sizing


class Cycle(NamedTuple):
    """A cycle from a speed at phi = 0: the states after it, its greatest and least speed, and how long it took."""

    end: Any
    top: float
    bottom: float
    period: float
    course: Course

    @property
    def irregularity(self) -> float:
        """Greatest less least speed over their mean."""
        return 2 * (self.top - self.bottom) / (self.top + self.bottom)


def cycle_from(machine: Machine, omega: float, states: Any) -> Cycle | None:
    """The cycle that follows a state; None where the machine comes to rest."""
    y = machine.start(0.0, omega, states)
    scale = machine.cycle / omega
    course = machine.follow(y, 50 * scale, way=machine.cycle, scale=scale, rest=True)
    if course.reason != "way" or course.y[0] < 0:
        return None
    return Cycle(course.y, *machine.extremes(course), course.t, course)


def steady(scene: Scene, sizing: Any) -> tuple[str, str]:
    """Checks that the steady motion of a result repeats and has its figures, and its flywheel is the least possible."""
    figures = sizing.as_dict()
    exact, motion, errors = figures["flywheel"]["exact"], figures["simulation"], figures["error"]
    request = scene["flywheel"].get("irregularity")
    inertia = scene["flywheel"].get("inertia", exact)
    machine = Machine(scene, inertia=inertia)
    if machine.timed:
        return "undecided", "depends on time"
    balance = 0.0 if figures["balance"] is None else figures["balance"]["value"]
    machine.given(balance)
    omega, states = float(speed_at(sizing, 0.0)), states_at(sizing, 0.0)
    cycle = cycle_from(machine, omega, states or None)
    if cycle is None:
        return "wrong", f"the machine that is to run at {omega:.6g} rad/s with {inertia:.6g} kg m2 stops within the cycle"
    said = max(errors["simulation"], sizing.rtol if sizing.reached else 0.0, FLOOR)
    missed = (float(cycle.end[1]) - omega) / omega
    again = cycle_from(machine, omega * (1 + 1e-5), states or None) if not states else None
    multiplier = 0.0 if again is None else (float(again.end[1]) - float(cycle.end[1])) / (1e-5 * omega)
    balanced = figures["balance"] is not None
    off = max(abs(missed) - CYCLE, 0.0) / (1.0 if balanced or states else max(1 - multiplier, 1e-6))
    if off > said:
        output = f"(multiplier {multiplier:.4g}), estimate {errors['simulation']:.2g}"
        return "wrong", f"the cycle from {omega:.9g} rad/s misses by {missed:.3g} {output}"
    if not states and not balanced and multiplier > 1 + 1e-4:
        return "wrong", f"an unstable regime: multiplier {multiplier:.6g}"
    mean, uneven = 0.5 * (cycle.top + cycle.bottom), cycle.irregularity
    if motion is not None and abs(uneven - motion["irregularity"]) > 2 * (said + off):
        return "wrong", f"irregularity {motion['irregularity']:.9g} for {uneven:.9g}"
    if balanced and "speed" in scene.get("regime", {}) and abs(mean / figures["speed_asked"] - 1) > 2 * said:
        return "wrong", f"mean of extremes {mean:.9g} for {figures['speed_asked']:.9g}"
    if fault := _powers(scene, figures, machine, cycle):
        return "wrong", fault
    if "limits" in scene["flywheel"]:
        return _limited(scene, figures, machine, cycle, omega)
    if request is None:
        return "right", ""
    return _least(scene, sizing, figures, uneven, request, (omega, states, balance))


def _least(scene: Scene, sizing: Any, figures: Any, uneven: float, asked: float, start: Any) -> tuple[str, str]:
    """Checks that a flywheel keeps the irregularity asked, and one a hundredth smaller does not."""
    exact, slack = figures["flywheel"]["exact"], 2 * (figures["error"]["exact"] + FLOOR / asked)
    if exact == 0.0:
        return (
            ("right", "") if uneven <= asked * (1 + slack) else ("wrong", f"no flywheel: {uneven:.6g} for {asked:.6g} asked")
        )
    if abs(uneven / asked - 1) > slack:
        return "wrong", f"irregularity {uneven:.9g} with the exact flywheel {exact:.9g}, {asked:.9g} asked"
    omega, states, balance = start
    machine = Machine(scene, inertia=0.99 * exact)
    machine.given(balance)
    if states:
        return "right", ""
    result = settled(machine, omega, None)
    if result is None or figures["balance"] is not None:
        return "right", ""
    lighter = result.irregularity
    return ("right", "") if lighter > asked else ("wrong", f"0.99 of the flywheel leaves {lighter:.6g}, {asked:.6g} asked")


def _limited(scene: Scene, figures: Any, machine: Machine, cycle: Cycle, omega: float) -> tuple[str, str]:
    """Checks that a flywheel keeps all limits, and one a hundredth smaller breaks one."""
    request, exact = scene["flywheel"]["limits"], figures["flywheel"]["exact"]
    reached = kept(scene, machine, cycle)
    for name, limit in request.items():
        output = figures["flywheel"]["limits"][name]["reached"]
        if abs(output - reached[name]) > 1e-6 * reached[name] + FLOOR:
            return "wrong", f"{name} {output:.8g} for {reached[name]:.8g}"
        if reached[name] > limit * (1 + 1e-6):
            return "wrong", f"{name} {reached[name]:.8g} with {exact:.6g} kg m2, {limit:.6g} asked"
    if exact == 0.0:
        return "right", ""
    lighter = Machine(scene, inertia=0.99 * exact)
    result = settled(lighter, omega, None)
    if result is None or any(kept(scene, lighter, result)[name] > limit for name, limit in request.items()):
        return "right", ""
    return "wrong", f"0.99 of {exact:.6g} kg m2 keeps all limits: {kept(scene, lighter, result)}"


def kept(scene: Scene, machine: Machine, cycle: Cycle) -> dict[str, float]:
    """The figures of a steady cycle that limits may be set to."""
    row, whole = scene["drive"]["motor"], 0.0
    if row["type"] == "hydraulic":
        rated = value(row["mechanical_efficiency"]) * value(row["displacement"]) * value(row["pressure"]) / (2 * math.pi)
    else:
        rated = value(row["power"]) / value(row["speed"])
        if row["type"] == "induction":
            rated, whole = rated_point(row)
    heats, ratio = heating(row), machine.speeds[machine.index[scene["drive"].get("on", "crank")]]
    root, heat, (greatest, _) = driven(scene, machine, cycle, heats)
    result = {"irregularity": cycle.irregularity, "motor_torque": greatest / rated, "motor_rms": root / rated}
    if "motor_heat" in scene["flywheel"]["limits"]:
        result["motor_heat"] = heat / (whole or heats(rated, value(row["speed"])))
    if "current_pulsation" in scene["flywheel"]["limits"]:
        _, r, k, _, current = plate(row)
        result["current_pulsation"] = k * ratio * (cycle.top - cycle.bottom) / r / current
    return result


class Along(NamedTuple):
    """A value along a cycle: its mean and its root of the mean square over time, its greatest and its least."""

    mean: float
    rms: float
    greatest: float
    least: float

    @property
    def size(self) -> float:
        """The greatest amount."""
        return max(abs(self.greatest), abs(self.least))


def along(cycle: Cycle, values: Callable[[float, Piece], Any]) -> list[Along]:
    """Values along a cycle, given at a time on a piece of it."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    whole, rows = 0.0, []
    for p in cycle.course.pieces:
        half = 0.5 * (p.end - p.start)
        times = np.array([p.start, *(p.start + half * (1 + nodes)), p.end])
        result = np.array([values(at, p) for at in times.tolist()])
        inner = result[1:-1]
        whole = whole + half * (weights @ np.stack((inner, inner**2), axis=1).reshape(len(nodes), -1))
        rows.append((result, times, p))
    means, squares = np.reshape(whole, (2, -1)) / cycle.period

    def greatest(k: int, sign: int) -> float:
        tops = sorted(rows, key=lambda row: -(sign * row[0][:, k]).max())[:3]
        result = float((sign * tops[0][0][:, k]).max())
        for seen, times, p in tops:
            top = int(np.argmax(sign * seen[:, k]))
            bounds = times[max(top - 1, 0)], times[min(top + 1, len(times) - 1)]
            if bounds[1] > bounds[0]:
                close = {"xatol": 1e-7 * (bounds[1] - bounds[0])}  # that of the values is its square
                run = minimize_scalar(lambda at, p=p: -sign * values(at, p)[k], bounds=bounds, options=close)
                result = max(result, -float(run.fun))
        return result

    ends = [(greatest(k, 1), -greatest(k, -1)) for k in range(means.size)]
    return [Along(*row) for row in zip(means.tolist(), np.sqrt(squares).tolist(), *zip(*ends, strict=True), strict=True)]


def driven(scene: Scene, machine: Machine, cycle: Cycle, heats: Callable[[float, float], float]) -> tuple[float, float, Any]:
    """Rms torque (N m) and mean heat (W) of the drive over a cycle, and its greatest torque and power, by amount."""
    ratio = machine.speeds[machine.index[scene["drive"].get("on", "crank")]]

    def values(at: float, p: Piece) -> Any:
        y = p.states(at).tolist()
        torque = machine.torques(at, y, machine.bodies(y[0]), p.mode)[-1]
        return np.array([torque, torque * ratio * y[1], heats(torque, ratio * y[1])])

    torque, power, heat = along(cycle, values)
    return torque.rms, heat.mean, (torque.size, power.size)


def streamed(machine: Machine, cycle: Cycle) -> tuple[dict[str, Along], dict[str, tuple[Along, Along]]]:
    """The power of every effort (W), and the torque on its own side (N m) and power that each shaft's mesh brings it."""

    def values(at: float, p: Piece) -> Any:
        y = p.states(at).tolist()
        _, torques, needs = machine.acceleration(at, y, p.mode)
        powers = [t * machine.speeds[e.shaft] * y[1] for t, e in zip(torques, machine.efforts, strict=True)]
        return np.array([*powers, *needs, *(t * k * y[1] for t, k in zip(needs, machine.speeds, strict=True))])

    rows, many = along(cycle, values), len(machine.efforts)
    efforts = {e.name: row for e, row in zip(machine.efforts, rows, strict=False)}
    torques, powers = rows[many : many + len(machine.shafts)], rows[many + len(machine.shafts) :]
    return efforts, {name: (torques[k], powers[k]) for name, k in machine.index.items()}


def _powers(scene: Scene, figures: Any, machine: Machine, cycle: Cycle) -> str:
    """Figures of the drive's power along a cycle, and of losses in meshes, that are off; empty where all is right."""
    output, flow = figures["energy"], figures["power_flow"]
    if output is None or flow is None or "drive" not in scene:
        return ""
    motor = scene["drive"].get("motor", {})
    plain_slip = motor.get("type") == "induction" and not {"electrical", "inverter"} & motor.keys()
    heats = slip_heat(motor) if plain_slip else heating({"type": "none"})
    rms, heat, (_, peak) = driven(scene, machine, cycle, heats)
    works = machine.works(cycle.end)
    scale = max(sum(map(abs, works.values())), 1e-6 * machine.kinetic(cycle.end)) / cycle.period
    lost = sum(stream["mean"] for stream in flow["streams"] if stream["kind"] in ("mesh", "slip"))
    ratio = machine.speeds[machine.index[scene["drive"].get("on", "crank")]]
    first = cycle.course.pieces[0]
    y = first.states(first.start).tolist()
    faster = [y[0], y[1] * (1 + 1e-6), *y[2:]]  # what the speed's own error changes, at once, of a steep torque
    slower, now = (float(machine.torques(first.start, row, machine.bodies(y[0]), first.mode)[-1]) for row in (y, faster))
    steep = 1e6 * abs(now - slower) * ratio * y[1]
    efforts, meshes = streamed(machine, cycle)
    passed = max(scale, *(true.size for true in efforts.values()))  # what a mean is the rest of
    rows = [
        ("mean power", output["mean_power"], works["drive"] / cycle.period, passed),
        ("peak power", abs(output["peak_power"]), peak, max(scale, peak, steep)),
        ("rms torque", output["rms_torque"], rms, max(rms, scale / ratio / cycle.bottom)),
        ("loss in meshes", lost, works["meshes"] / cycle.period, scale),
    ]
    if plain_slip:
        rows.append(("heat of the rotor", output["rotor_heat"], heat, max(heat, scale)))
    of_energy, of_flow = (10 * max(figures["error"][name] or 0.0, FLOOR) for name in ("energy", "power_flow"))
    off = [f"{name} {one:.9g} for {true:.9g}" for name, one, true, size in rows if abs(one - true) > of_energy * size]
    flows = _flows(flow, machine, cycle, efforts, meshes, max(scale, flow["scale"]), steep)
    off += [f"{name} {one:.9g} for {true:.9g}" for name, one, true, size in flows if abs(one - true) > of_flow * size]
    return ", ".join(off)


def _flows(
    flow: Any,
    machine: Machine,
    cycle: Cycle,
    efforts: dict[str, Along],
    meshes: dict[str, tuple[Along, Along]],
    scale: float,
    steep: float,
) -> Iterator[tuple[str, float, float, float]]:
    """Figures of the power through meshes, and of loads, with the true ones and what their errors are relative to."""
    for shaft in flow["shafts"]:
        if shaft["on"] is None:
            continue
        name, slowest = shaft["shaft"], abs(machine.speeds[machine.index[shaft["shaft"]]]) * cycle.bottom
        for kind, size, true in zip(("torque", "power"), (scale / slowest, scale), meshes[name], strict=True):
            of_size = max(size, true.size) + steep * size / scale
            yield f"mean {kind} of {name}", abs(shaft[f"{kind}_mean"]), abs(true.mean), of_size
            yield f"rms {kind} of {name}", shaft[f"{kind}_rms"], true.rms, of_size
            yield f"greatest {kind} of {name}", abs(shaft[f"{kind}_greatest"]), true.size, of_size
    for stream in flow["streams"]:
        true = efforts.get(stream["name"])
        if true is None or stream["kind"] not in ("load", "drive", "drag", "resistance"):
            continue
        outwards = stream["to"].startswith("shafts.")
        high, low = (true.greatest, true.least) if outwards else (-true.least, -true.greatest)
        of_size = max(scale, true.size) + steep
        yield f"greatest of {stream['name']}", stream["greatest"], high, of_size
        yield f"least of {stream['name']}", stream["least"], low, of_size


def plate(row: Scene) -> tuple[float, float, float, float, float]:
    """Voltage, resistance, constant, friction and rated current of a DC motor by its name plate."""
    u, power, omega = volts(row["voltage"]), value(row["power"]), value(row["speed"])
    current = power / (value(row["efficiency"]) * u)
    lost = u * current - power
    r = 0.5 * lost / current**2
    return u, r, (u - r * current) / omega, 0.5 * lost / omega**2, current


def heating(row: Scene) -> Callable[[float, float], float]:
    """Heat of a motor (W) over its torque and its speed: by its slip or its armature's resistance."""
    if row["type"] == "induction":
        return slip_heat(row)
    if row["type"] != "dc" or "power" not in row:
        return lambda torque, speed: 0.0
    u, r, k, _, _ = plate(row)
    return lambda torque, speed: r * ((u - k * speed) / r) ** 2


def settled(machine: Machine, omega: float, states: Any, rounds: int = 8) -> Cycle | None:
    """The cycle that repeats near a speed at phi = 0, by secants; None where none is found."""
    a, result = omega, cycle_from(machine, omega, states)
    if result is None:
        return None
    fa = float(result.end[1]) - a
    b = float(result.end[1]) if abs(fa) > 1e-9 * a else a * (1 + 1e-6)
    for _ in range(rounds):
        result = cycle_from(machine, b, states)
        if result is None:
            return None
        fb = float(result.end[1]) - b
        if abs(fb) < 1e-9 * b or fb == fa:
            return result
        step = -fb * (b - a) / (fb - fa)
        a, fa, b = b, fb, b + float(np.clip(step, -0.3 * b, 0.3 * b))
    return None


def _refused(case: Drawn, answer: Answer) -> Verdict:
    """Checks whether a machine that was refused runs: the oracle iterates its cycle, from a heavy flywheel on."""
    try:
        with limited(2 * LATE):
            result = steady_without_help(case)
    except (Undetermined, ArithmeticError, ValueError, Late) as error:
        return Verdict("size", "undecided", f"oracle: {type(error).__name__} {error}; {answer.refusal}", answer.seconds)
    if result is None:
        return Verdict("size", "refused", answer.refusal, answer.seconds)
    if _OUT_OF_STEP in result and _OUT_OF_STEP in answer.refusal:
        return Verdict("size", "refused", answer.refusal, answer.seconds)
    return Verdict("size", "untrue", f"{result}; said: {answer.refusal}", answer.seconds)


def steady_without_help(case: Drawn) -> str | None:
    """Words on the steady motion that the oracle finds of a scene; None where it finds none."""
    scene = unstarted(case.scene)
    if scene.get("drive", {}).get("torque") == "balance" or "balance" in scene.get("parameters", {}).values():
        return None
    inertia = scene["flywheel"].get("inertia", 50 * case.inertia / case.speed(scene["flywheel"].get("on", "crank")) ** 2)
    machine = Machine(scene, inertia=inertia)
    if machine.timed:
        return None
    if "limits" in scene["flywheel"]:
        return _some_wheel(case)
    nets = [(w, _net(machine, w)) for w in case.pace * np.geomspace(6, 0.05, 60)]
    speeds = [float(math.sqrt(a * b)) for (a, fa), (b, fb) in itertools.pairwise(nets) if fa < 0 <= fb]
    for speed in speeds:
        states = None if machine.motor is None else machine.motor.unfed(machine.speeds[machine.driven] * speed)
        if states is not None:
            return _iterated(machine, speed, states, synchronous=scene["drive"]["motor"]["type"] == "synchronous")
        result = settled(machine, speed, states)
        if result is not None:
            uneven = result.irregularity
            ahead = cycle_from(machine, float(result.end[1]) * 1.00001, None)
            stable = ahead is not None and float(ahead.end[1]) < float(result.end[1]) * 1.00001
            if stable:
                return f"runs at {result.end[1]:.6g} rad/s at phi = 0 with {inertia:.6g} kg m2, irregularity {uneven:.6g}"
    return None


def _some_wheel(case: Drawn) -> str | None:
    """Words on a flywheel that keeps all limits, of those that are tried from heavy to light; None where none does."""
    scene, speed = unstarted(case.scene), case.pace
    request, own = scene["flywheel"]["limits"], case.inertia / case.speed(scene["flywheel"].get("on", "crank")) ** 2
    for inertia in (*(own * np.geomspace(100, 0.01, 9)), 0.0):
        machine = Machine(scene, inertia=float(inertia))
        result = settled(machine, speed, None, 12)
        if result is not None:
            speed, figures = float(result.end[1]), kept(scene, machine, result)
            if all(figures[name] < limit for name, limit in request.items()):
                return f"{inertia:.6g} kg m2 keeps all limits: {figures}"
    return None


def _iterated(machine: Machine, speed: float, states: Any, *, synchronous: bool) -> str | None:
    """A motor with states, run cycle by cycle; of a synchronous one the first is its load angle."""
    y = list(states)
    for _ in range(60):
        cycle = cycle_from(machine, speed, y)
        if cycle is None:
            return None
        before, angle, speed, y = speed, y[0], float(cycle.end[1]), cycle.end[2 : 2 + machine.states]
        if abs(speed - before) < 1e-8 * speed:
            if cycle.irregularity >= 2.0:  # it turns back within the cycle, which is no steady running
                return None
            how = f"{_OUT_OF_STEP}, it " if synchronous and abs(y[0] - angle) > math.pi else ""
            return f"{how}settles to {speed:.6g} rad/s at phi = 0, irregularity {cycle.irregularity:.6g}"
    return None


def _net(machine: Machine, speed: float) -> float:
    """The mean moment that is left at a constant speed (N m)."""
    result = []
    for phi in np.linspace(0, machine.cycle, 25)[:-1] + 0.0123:
        states = [] if machine.motor is None else machine.motor.steady(machine.speeds[machine.driven] * speed)
        y = [float(phi), speed, *states]
        mode = machine.held(1e9, y, 1, (1e9, float(phi), speed))
        here = machine.bodies(float(phi))
        result.append(machine.remainder(machine.needs(speed, here, machine.torques(1e9, y, here, mode))[1], 1))
    return -float(np.mean(result))


def _kept(scene: Scene, loaded: Any, sizing: Any) -> Verdict:
    """A start from the regime stays in it: two cycles on, the machine is where one more cycle of the oracle brings it."""
    figures = sizing.as_dict()
    inertia = scene["flywheel"].get("inertia", figures["flywheel"]["exact"])
    balance = None if figures["balance"] is None else figures["balance"]["value"]
    cycle = loaded.cycle
    answer = answered(
        lambda: flywheel.transient(
            loaded, start="regime", end=f"{2 * cycle!r} rad", inertia=inertia, balance=balance, rtol=1e-8
        )
    )
    limit = any("the limit for ever lighter flywheels" in message for message in sizing.messages)  # none to start with
    if answer.outcome or answer.refusal:
        outcome = answer.outcome or ("refused" if limit else "untrue")
        return Verdict("regime", outcome, answer.detail or answer.refusal, answer.seconds)
    run, omega = answer.value, float(speed_at(sizing, 0.0))
    growth = max(1.0, abs(figures.get("multiplier") or 1.0)) ** 2
    said = 10 * max(run.error, figures["error"]["simulation"] or 0.0, FLOOR) * growth
    if run.reason != "way" or abs(run.omega / omega - 1) > said:
        return Verdict(
            "regime",
            "wrong",
            f"{run.reason}: {run.omega:.9g} rad/s after two cycles, from {omega:.9g} (allowed {said:.2g})",
            answer.seconds,
        )
    return Verdict("regime", "right", "", answer.seconds)


_OF_ERRORS = {
    **dict.fromkeys(("reduced_inertia.min", "reduced_inertia.max"), "reduced_inertia"),
    **dict.fromkeys(("simulation.speed_max", "simulation.speed_min"), "extreme_speeds"),
    "balance.value": "balance",
}
_OF_A_SIZING = (
    *("accumulated_max", "accumulated_min", "energy_fluctuation", "reduced_inertia.min", "reduced_inertia.max", "speed"),
    *(f"flywheel.{name}" for name in ("exact", "approximate", "approximate_total", "inertia_torque")),
    *(f"energy.{name}" for name in ("current_rms", "current_peak", "copper_heat", "rotor_heat", "stator_heat")),
    "balance.value",
)


def _with_errors(sizing: Any, keys: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Figures of a sizing that it has, with their absolute errors."""
    figures, cycle = sizing.as_dict(), sizing.constant or sizing.cycle
    scales = {"accumulated_max": cycle.exchanged, "accumulated_min": cycle.exchanged, "energy_fluctuation": cycle.exchanged}
    scales |= {"reduced_inertia.min": figures["reduced_inertia"]["max"]}
    scales |= {} if sizing.run is None or sizing.run.irregularity else {"simulation.irregularity": 1.0}
    swings = [figures["flywheel"].get(name) or 0.0 for name in ("approximate_total", "inertia_torque")]
    if sizing.scene.irregularity is not None:  # of a wheel of limits or of losses, which may be close to 0
        square = (sizing.speed * sizing.scene.flywheel_ratio) ** 2
        swings.append(figures["energy_fluctuation"] / (sizing.scene.irregularity * square))
    result = dict[str, tuple[float, float]]()
    for key in keys:
        block, _, name = key.rpartition(".")
        figure = (figures[block] or {}).get(name) if block else figures[name]
        error = figures["error"][_OF_ERRORS.get(key, name)]
        if figure is not None and error is not None:
            scale = max(swings) if block == "flywheel" else scales.get(key, 0.0)
            result[key] = figure, (error + 4e-16) * max(abs(figure), scale)
    return result


def _outside(sizing: Any, intervals: dict[str, tuple[float, float]]) -> str:
    """Figures of a sizing that lie farther from intervals than their errors; empty where none does."""
    return "; ".join(
        f"{key} {figure:.17g}, error {error:.1e}, lies in [{intervals[key][0]:.17g}, {intervals[key][1]:.17g}]"
        for key, (figure, error) in _with_errors(sizing, intervals).items()
        if not intervals[key][0] - error <= figure <= intervals[key][1] + error
    )


def _in_intervals(loaded: Any, sizing: Any) -> Verdict:
    """Proven intervals, calculated over balls, meet the figures of the sizing, each within its error."""
    answer = answered(lambda: flywheel.size(loaded, accuracy="proof").proof)
    if answer.value is None:
        return Verdict(PROOF, answer.outcome or "untrue", answer.detail or answer.refusal, answer.seconds)
    off = _outside(sizing, answer.value.figures)
    outcome = "wrong" if off else "right" if answer.value.figures else "refused"
    return Verdict(PROOF, outcome, off or answer.value.reason, answer.seconds)


def _at_accuracies(loaded: Any) -> Verdict:
    """Figures at a loose accuracy meet those at a close one, each within its error."""
    close, loose = (answered(partial(flywheel.size, loaded, rtol, accuracy="normal")) for rtol in (1e-12, 1e-3))
    seconds = close.seconds + loose.seconds
    for answer in (close, loose):
        if answer.value is None:
            return Verdict(ACCURACY, answer.outcome or "refused", answer.detail or answer.refusal, seconds)
    close_figures = _with_errors(close.value, _OF_A_SIZING)
    off = _outside(loose.value, {key: (one - error, one + error) for key, (one, error) in close_figures.items()})
    return Verdict(ACCURACY, "wrong" if off else "right", off, seconds)
