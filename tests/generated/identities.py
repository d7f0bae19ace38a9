"""Special scenes beside the oracle where it follows them, and beside themselves where it does not: a duty has no order, its
flywheel is that of its hardest phase, a motion is as good as it says, a regime is stayed in.
"""

from __future__ import annotations

import itertools
import math
import time
from typing import Any

import numpy as np

import flywheel
from flywheel.motions.motion import speed_at
from tests.generated.judging import FLOOR, LATE, Answer, Late, Plan, Scene, Told, Verdict, answered, judged, limited
from tests.generated.judging import _beside as beside
from tests.generated.judging import _figures as figures_of
from tests.generated.judging import _kept as stays
from tests.generated.judging import _motion as motion
from tests.generated.scenes import Drawn
from tests.generated.special import kind_of
from tests.oracle.courses import RTOL, Course, Machine, Undetermined
from tests.oracle.drive_lines import value
from tests.oracle.starts import started

UNTOLD = (Undetermined, ArithmeticError, ValueError, Late)


def tried(case: Drawn) -> list[Verdict]:
    """All verdicts on a special scene."""
    kind = kind_of(case.seed)
    result = JUDGES[kind](case) if kind in JUDGES else judged(case)
    return [v._replace(route=f"{kind}:{v.route}") for v in result]


def _words(route: str, answer: Answer) -> Verdict | None:
    """The verdict on a call that gave no answer at all."""
    return Verdict(route, answer.outcome, answer.detail, answer.seconds) if answer.outcome else None


# -- strokes ---------------------------------------------------------------------------------------------------------


def turning(scene: Scene) -> Scene:
    """A stroke as the turning of a shaft that comes to no end."""

    def renamed(row: Scene) -> Scene:
        if row["on"] not in ("slide", "crank"):
            return row
        return {"torque" if k == "force" else k: v for k, v in row.items()} | {"on": "crank"}

    rows = {k: [renamed(row) for row in scene[k]] for k in ("load", "inertia", "spring", "damper") if k in scene}
    torque = str(scene["drive"].get("force", scene["drive"].get("torque")))
    kept = {k: v for k, v in scene.items() if k in ("mechanism", "gravity")}
    return kept | rows | {"drive": {"torque": torque}}


def _stroke(case: Drawn) -> list[Verdict]:
    """A stroke reduced at some places, and followed from its inside and from rest at its beginning."""
    loaded = answered(lambda: flywheel.load(case.scene))
    if loaded.value is None:
        return [Verdict("load", loaded.outcome or "untrue", loaded.detail or loaded.refusal, loaded.seconds)]
    rng = np.random.default_rng([case.seed, 1])
    low, high = value(case.scene["stroke"]["from"]), value(case.scene["stroke"]["to"])
    machine = Machine(turning(case.scene), inertia=0.0)
    result = [_reduced(loaded.value, machine, low + (high - low) * rng.random(3))]
    inside, speed = low + 0.4 * (high - low) * rng.random(), case.pace * rng.uniform(-0.7, 1.3)
    until = (high - low) / case.pace
    for route, phi, omega, long in (("both", inside, speed, 0.7), ("rest", low, 0.0, 1.5)):
        plan = Plan(omega, True, long * until, 0.0, 0.0, phi)
        answer = answered(lambda route=route, plan=plan: _moved(loaded.value, route, plan))
        begun = time.process_time()
        try:
            with limited(2 * LATE):
                course = machine.follow(machine.start(phi, omega), plan.until, scale=plan.until)
        except UNTOLD as error:
            outcome, detail = answer.outcome or "undecided", f"oracle: {type(error).__name__} {error}; {answer.refusal}"
            result.append(Verdict(route, outcome, answer.detail or detail, answer.seconds))
            continue
        ended = _ended(course, low, high, phi)
        if ended < plan.until:  # the stroke is over before
            plan = plan._replace(until=ended)
        output: Told | None = answer.value
        if output is not None and abs(output.t - plan.until) < 1e-7 * plan.until:
            answer = answer._replace(value=output._replace(t=plan.until))
        verdict = beside({}, route, plan, answer, machine, course)
        if answer.refusal and route == "rest" and course.at(0.01 * plan.until)[0] < low:  # it is pushed out of its stroke
            verdict = verdict._replace(outcome="refused")
        result.append(verdict._replace(oracle=time.process_time() - begun))
    return result


def _reduced(loaded: Any, machine: Machine, places: Any) -> Verdict:
    """Reduced inertia at some places, and positions of ports."""
    answer = answered(lambda: [flywheel.reduce(loaded, float(x)) for x in places])
    if answer.value is None:
        return Verdict("reduce", answer.outcome or "untrue", answer.detail or answer.refusal, answer.seconds)
    own = sum(o * s * s for o, s in zip(machine.own, machine.speeds, strict=True))
    for x, output in zip(places, answer.value, strict=True):
        true = own + sum(h.inertia for h in machine.bodies(float(x)))
        if abs(float(np.squeeze(output.inertia)) - true) > 1e-9 * true:
            return Verdict("reduce", "wrong", f"at {x:.9g}: {output.inertia} for {true:.12g}", answer.seconds)
    return Verdict("reduce", "right", "", answer.seconds)


def _moved(loaded: Any, route: str, plan: Plan) -> Told:
    """The motion of a stroke by the function from any state, by the command from rest."""
    if route == "both":
        run = flywheel.simulate(loaded, plan.phi, plan.omega, plan.until, rtol=1e-8)
        end = float(run.t[-1]), float(run.phi[-1]), float(run.omega[-1])
        return Told(*end, run.error, run.energy_residual, run.ended or "time", None)
    run = flywheel.transient(loaded, start="rest", end=plan.until, rtol=1e-8)
    run.as_dict()
    works = {name.split(" on ")[0]: work for name, work in run.energy.works.items()}
    works |= {"drive": run.energy.drive, "meshes": run.energy.meshes}
    end = float(run.motion.t[-1]), float(run.motion.phi[-1]), float(run.motion.omega[-1])
    return Told(*end, run.error, run.energy.residual, run.reason, works)


def _ended(course: Course, low: float, high: float, phi: float) -> float:
    """Time at which a motion reaches an end of its stroke; infinite if it does not."""
    for p in course.pieces:
        grid = np.linspace(p.start, p.end, 17)
        for a, b in itertools.pairwise(grid):
            for edge in (low, high):
                fa, fb = float(p.states(a)[0]) - edge, float(p.states(b)[0]) - edge
                if fb != 0 and fa * fb <= 0 and (fa != 0 or abs(phi - edge) > 0) and abs(fb) > 1e-12:
                    return Machine._root(
                        lambda t, p=p, e=edge, s=fa: math.copysign(1, s) * (float(p.states(t)[0]) - e), a, b
                    )
    return math.inf


# -- starts ----------------------------------------------------------------------------------------------------------


def _starts(case: Drawn) -> list[Verdict]:
    """A start through its connections, and up to the regime."""
    loaded = answered(lambda: flywheel.load(case.scene))
    if loaded.value is None:
        return [Verdict("load", loaded.outcome or "untrue", loaded.detail or loaded.refusal, loaded.seconds)]
    turn = 2 * math.pi / case.pace
    plan = Plan(0.0, True, 2 * turn, case.scene["flywheel"]["inertia"], 0.0)
    answer = answered(lambda: motion(loaded.value, "rest", plan))
    begun = time.process_time()
    try:
        with limited(2 * LATE):
            machine, course = started(case.scene, plan.inertia, plan.until, RTOL)
            verdict = beside(case.scene, "rest", plan, answer, machine, course)
    except UNTOLD as error:
        outcome, detail = answer.outcome or "undecided", f"oracle: {type(error).__name__} {error}; {answer.refusal}"
        verdict = Verdict("rest", outcome, answer.detail or detail, answer.seconds)
    return [verdict._replace(oracle=time.process_time() - begun), _settled(loaded.value)]


def _settled(loaded: Any) -> Verdict:
    """A start that settles ends in the regime of `size`."""
    run = answered(lambda: flywheel.transient(loaded, start="rest", end="regime", rtol=1e-8))
    if run.outcome or run.refusal or run.value.reason != "regime":
        said = run.refusal or (run.value.ended if run.value else "")
        return _words("regime", run) or Verdict("regime", "undecided", said, run.seconds)
    sizing = answered(lambda: figures_of(flywheel.size(loaded)))
    if sizing.value is None:
        lost = f"settles at {run.value.omega:.6g} rad/s; said: {sizing.refusal}"
        return _words("regime", sizing) or Verdict("regime", "untrue", lost, sizing.seconds)
    true = float(speed_at(sizing.value, run.value.phi))
    fits = abs(run.value.omega / true - 1) < 1e-5
    detail = "" if fits else f"settles at {run.value.omega:.9g} rad/s, the regime has {true:.9g} at {run.value.phi:.6g} rad"
    return Verdict("regime", "right" if fits else "wrong", detail, run.seconds + sizing.seconds)


# -- friction in joints ----------------------------------------------------------------------------------------------


def _friction(case: Drawn) -> list[Verdict]:
    """A linkage that rubs, in time and in its regime."""
    loaded = answered(lambda: flywheel.load(case.scene))
    if loaded.value is None:
        return [Verdict("load", loaded.outcome or "untrue", loaded.detail or loaded.refusal, loaded.seconds)]
    turn, rng = 2 * math.pi / case.pace, np.random.default_rng([case.seed, 1])
    wheel = case.scene["flywheel"]
    inertia = wheel.get("inertia", float(f"{0.3 * case.inertia / case.speed(wheel.get('on', 'crank')) ** 2:.4g}"))
    if "balance" in str(case.scene["drive"]):
        return _uneven(case, loaded.value)
    start = float(f"{case.pace * rng.uniform(0.2, 1.5):.4g}")
    plans = [("rest", Plan(0.0, True, 1.2 * turn, inertia, 0.0)), ("down", Plan(start, False, 1.5 * turn, inertia, 0.0))]
    return [_converged(loaded.value, route, plan) for route, plan in plans] + _uneven(case, loaded.value)


def _converged(loaded: Any, route: str, plan: Plan) -> Verdict:
    """Two motions, a loose one and a tight one, no further apart than they say; friction gives no energy."""
    rows: list[Any] = []
    seconds = 0.0
    for rtol in (1e-6, 1e-10):
        given = {"inertia": plan.inertia, "end": plan.until, "drive": plan.drive, "rtol": rtol}
        answer = answered(lambda given=given: flywheel.transient(loaded, start=plan.omega or "rest", **given))
        seconds += answer.seconds
        if (verdict := _words(route, answer)) is not None:
            return verdict._replace(detail=f"rtol {rtol}: {verdict.detail}")
        rows.append(answer)
    if rows[0].refusal or rows[1].refusal:
        one, two = (row.refusal for row in rows)
        same = bool(one) == bool(two)
        return Verdict(route, "refused" if same else "wrong", one if same else f"1e-6: {one}; 1e-10: {two}", seconds)
    loose, tight = (row.value for row in rows)
    if loose.reason != tight.reason:
        return Verdict(
            route, "wrong", f"{loose.reason} at {loose.time:.9g} s, {tight.reason} at {tight.time:.9g} s", seconds
        )
    said = loose.error + tight.error + FLOOR
    ways = [run.motion.phi for run in (loose, tight)]
    way = max(float(np.ptp(ways[1])), 1.0)
    fastest = max(float(np.abs(tight.motion.omega).max()), abs(plan.omega))
    if abs(loose.phi - tight.phi) > said * way or abs(loose.omega - tight.omega) > said * fastest:
        ends = f"phi {loose.phi:.10g}, {tight.phi:.10g}; omega {loose.omega:.10g}, {tight.omega:.10g}"
        return Verdict(route, "wrong", f"{ends}; errors {loose.error:.2g}, {tight.error:.2g}", seconds)
    residual = max(tight.motion.energy_residual, tight.energy.residual)
    if not residual < 1e-6:
        return Verdict(route, "wrong", f"energy misses {residual:.3g}", seconds)
    given = {name: work for name, work in tight.energy.works.items() if name.startswith("friction") and work > 0}
    size = max(map(abs, tight.energy.works.values()), default=0.0)
    if any(work > 1e-8 * size for work in given.values()):
        return Verdict(route, "wrong", f"friction gives {given}", seconds)
    return Verdict(route, "right", "", seconds)


def _uneven(case: Drawn, loaded: Any) -> list[Verdict]:
    """The flywheel of an irregularity leaves it, 0.99 of it more; the motion stays in the regime."""
    answer = answered(lambda: figures_of(flywheel.size(loaded)))
    if answer.outcome:
        return [Verdict("size", answer.outcome, answer.detail, answer.seconds)]
    wheel = case.scene["flywheel"]
    if answer.refusal:
        return [_neighbours(case.scene, answer)]
    verdict = Verdict("size", "right", "", answer.seconds)
    if "irregularity" in wheel and "balance" not in str(case.scene["drive"]):
        exact = answer.value.as_dict()["flywheel"]["exact"]
        request, at = wheel["irregularity"], {k: v for k, v in wheel.items() if k == "on"}
        reached = _irregularity(case.scene | {"flywheel": at | {"inertia": exact}})
        if reached is None or reached > request * (1 + 1e-5):
            verdict = verdict._replace(outcome="wrong", detail=f"{exact:.9g} kg m2 leaves {reached}, {request} asked")
        lighter = None if exact == 0 else _irregularity(case.scene | {"flywheel": at | {"inertia": 0.99 * exact}})
        if lighter is not None and lighter < request * (1 - 1e-6):
            verdict = verdict._replace(
                outcome="wrong", detail=f"0.99 of {exact:.9g} kg m2 leaves {lighter}, {request} asked"
            )
    return [verdict, stays(case.scene, loaded, answer.value)]


def _irregularity(scene: Scene) -> float | None:
    """Irregularity with a flywheel of some inertia."""
    answer = answered(lambda: flywheel.size(flywheel.load(scene)))
    return None if answer.value is None else float(answer.value.as_dict()["simulation"]["irregularity"])


def _neighbours(scene: Scene, answer: Answer) -> Verdict:
    """A refusal, beside those of what is asked a tenth more and less."""
    wheel = scene["flywheel"]
    name = next((n for n in ("irregularity", "inertia") if n in wheel), None)
    if name is not None:
        others = [scene | {"flywheel": wheel | {name: wheel[name] * factor}} for factor in (0.9, 1.1)]
        rows = [answered(lambda s=s: flywheel.size(flywheel.load(s))) for s in others]
        if all(row.value is not None for row in rows):
            return Verdict("size", "untrue", f"found at 0.9 and 1.1 of {name}; said: {answer.refusal}", answer.seconds)
    return Verdict("size", "refused", answer.refusal, answer.seconds)


# -- duties ----------------------------------------------------------------------------------------------------------


def _duty(case: Drawn) -> list[Verdict]:
    """A duty has no order, its flywheel is that of its hardest phase, and keeps in each what is asked."""
    scene = case.scene
    answer = answered(lambda: figures_of(flywheel.size(flywheel.load(scene))))
    turned = answered(lambda: figures_of(flywheel.size(flywheel.load(scene | {"duty": scene["duty"][::-1]}))))
    seconds = answer.seconds + turned.seconds
    for row in (answer, turned):
        if row.outcome:
            return [Verdict("size", row.outcome, row.detail, row.seconds)]
    running = [phase for phase in scene["duty"] if "rest" not in phase]
    wheel = scene["flywheel"]
    whole = {"motor_heat", "motor_rms"} & set(wheel.get("limits", {}))
    singles = {} if whole else {p["name"]: _single(scene, p) for p in running}
    if answer.refusal or turned.refusal:
        if bool(answer.refusal) != bool(turned.refusal):
            return [Verdict("size", "untrue", f"in one order: {answer.refusal or turned.refusal}", seconds)]
        if singles and all(s.value is not None for s in singles.values()):
            return [Verdict("size", "untrue", f"each phase is found; said: {answer.refusal}", seconds)]
        if (keeps := _some(case)) is not None:
            return [Verdict("size", "untrue", f"{keeps}; said: {answer.refusal}", seconds)]
        return [Verdict("size", "refused", answer.refusal, seconds)]
    one, two = (row.value.as_dict() for row in (answer, turned))
    exact, said = one["flywheel"]["exact"], 10 * (one["error"]["exact"] or 0.0) + 1e-6
    others = {"turned": two["flywheel"]["exact"]}
    if singles:
        if lost := [f"{n}: {s.detail or s.refusal}" for n, s in singles.items() if s.value is None]:
            return [Verdict("size", "untrue", f"a phase of a duty that is found: {lost}", seconds)]
        others["hardest"] = max(s.value.as_dict()["flywheel"]["exact"] for s in singles.values())
    for name, other in others.items():
        if abs(other - exact) > said * max(exact, 1e-9 * case.inertia):
            return [Verdict("size", "wrong", f"{exact:.9g} kg m2, {name} {other:.9g}", seconds)]
    if (lost := _means(one["duty"])) is not None:
        return [Verdict("size", "wrong", lost, seconds)]
    return [Verdict("size", "right", "", seconds), _leaves(scene, one)]


def _some(case: Drawn) -> str | None:
    """Words on a flywheel that keeps the limits of a duty, of a few that are tried; None where none does."""
    wheel = case.scene["flywheel"]
    limits = wheel.get("limits", {"irregularity": wheel.get("irregularity")})
    at = {k: v for k, v in wheel.items() if k == "on"}
    for share in (0.0, 0.3, 3.0, 100.0):
        inertia = share * case.inertia / case.speed(wheel.get("on", "crank")) ** 2
        given = case.scene | {"flywheel": at | {"inertia": inertia}}
        answer = answered(lambda given=given: flywheel.size(flywheel.load(given)).as_dict())
        if answer.value is None:
            continue
        duty = answer.value["duty"]
        uneven = max(p["irregularity"] for p in duty["phases"] if p["irregularity"] is not None)
        reached = {"irregularity": uneven, "motor_heat": duty["heat_share"], "motor_rms": duty["rms_torque_share"]}
        if all(reached[name] < limit for name, limit in limits.items()):
            return f"{inertia:.6g} kg m2 keeps all limits: { {name: reached[name] for name in limits} }"
    return None


def _means(duty: Any) -> str | None:
    """Figures of a duty that are not the mean of its phases over the time that cools; None where all are."""
    sums = {"rms_torque": 2, "current_rms": 2, "heat": 1}
    running = [p for p in duty["phases"] if not p["rest"]]
    for name, power in sums.items():
        if duty[name] is None:
            continue
        whole = sum(p[name] ** power * p["duration"] for p in running) / duty["cooled"]
        if abs(whole - duty[name] ** power) > 1e-9 * abs(whole):
            return f"{name} {duty[name]:.9g} for {whole ** (1 / power):.9g}"
    return None


def _single(scene: Scene, phase: Scene) -> Answer:
    """A phase by itself, its loads and changes written into the scene."""
    alone = {k: v for k, v in scene.items() if k != "duty"}
    loads = [dict(row) for row in scene["load"]]
    if "changes" in phase:
        loads[0]["factor"] = phase["changes"]["load.0.factor"]
    if "loads" in phase:
        for row in loads:
            if row.get("model", {}).get("type") != "losses":
                row["factor"] = value(row.get("factor"), 1.0) * phase["loads"]
    return answered(lambda: figures_of(flywheel.size(flywheel.load(alone | {"load": loads}))))


def _leaves(scene: Scene, figures: Any) -> Verdict:
    """The flywheel as given: every phase keeps the irregularity, and one of them does not with 0.99 of it."""
    wheel, exact = scene["flywheel"], figures["flywheel"]["exact"]
    request = wheel.get("irregularity", wheel.get("limits", {}).get("irregularity"))
    if request is None:
        return Verdict("keeps", "undecided", "no irregularity")
    at = {k: v for k, v in wheel.items() if k == "on"}
    worst, seconds = [], 0.0
    for share in (1.0, 0.99):
        given = scene | {"flywheel": at | {"inertia": share * exact}}
        answer = answered(lambda given=given: flywheel.size(flywheel.load(given)).as_dict())
        seconds += answer.seconds
        if answer.value is None and share == 1.0:
            return Verdict(
                "keeps", answer.outcome or "untrue", f"{exact:.9g} kg m2: {answer.detail or answer.refusal}", seconds
            )
        if answer.value is not None:
            phases = answer.value["duty"]["phases"]
            worst.append(max(p["irregularity"] for p in phases if p["irregularity"] is not None))
    if worst[0] > request * (1 + 1e-5):
        return Verdict("keeps", "wrong", f"{worst[0]:.8g} with {exact:.8g} kg m2, {request} asked", seconds)
    only = "irregularity" in wheel
    if only and exact > 0 and len(worst) > 1 and worst[1] < request * (1 - 1e-6):
        return Verdict("keeps", "wrong", f"{worst[1]:.8g} with 0.99 of {exact:.8g} kg m2, {request} asked", seconds)
    return Verdict("keeps", "right", "", seconds)


JUDGES = {"duty": _duty, "stroke": _stroke, "starts": _starts, "friction": _friction}
