"""Cost of accuracy on a scene: every method that applies, each with its true error and its time.

The result is plain data: a row for each method, and the fastest one with the required accuracy.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics import notebook
from flywheel.numerics.budget import Tally, counted
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import constant_speed, periodic_motion, wittenbauer
from flywheel.regime.cycle_equations import Demand
from flywheel.scene.scene import Scene, rtol_faults
from flywheel.sizing import speed_dependent
from flywheel.sizing.results import WIDTH
from flywheel.sizing.sizing import check_complete, size
from flywheel.study import answers
from flywheel.study.answers import NoAnswerError, Question, Reference, Revolve, answer, verified


class MethodRow(NamedTuple):
    """One method on one scene.

    `error` is the true relative error of its `value`, None without an answer; `meets` is True if that is within rtol, None
    if the reference's own error leaves it undetermined. `seconds` is the median of `repeats`, `fastest` and `slowest` their
    extremes. `evaluations`: positions of the crank at which the machine was evaluated. `promised` is its own error estimate,
    None if it has none. `outcome` is done, no answer, out of time or not run.
    """

    name: str
    family: str
    label: str
    outcome: str
    value: float | None
    error: float | None
    meets: bool | None
    seconds: float | None
    fastest: float | None
    slowest: float | None
    repeats: int
    evaluations: int | None
    promised: float | None
    leaves_out: str
    reason: str


@dataclass(frozen=True)
class Tradeoff:
    """Every method on one scene, against a verified reference (kg m² on the flywheel's shaft, or an irregularity).

    Errors are relative to the figure, or to `scale` where that is larger. `cheapest` names the fastest row that keeps rtol,
    `level` those that took as long within the noise, `cheapest_promised` the fastest of those with an own estimate within
    rtol. `messages` are those of the sizing itself. `cannot` lists methods that do not apply to the scene, with the reason.
    """

    title: str | None
    figure: str
    unit: str
    rtol: float
    reference: Reference
    scale: float
    rows: tuple[MethodRow, ...]
    cheapest: str | None
    level: tuple[str, ...]
    cheapest_promised: str | None
    cannot: dict[str, str]
    budget: float
    seconds: float
    interrupted: bool
    messages: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Scene, number of methods, and the cheapest."""
        best = f"cheapest {self.cheapest!r} at rtol {self.rtol:g}"
        return f"Tradeoff({notebook.quoted(self.title)}{len(self.rows)} methods, {best})"

    _repr_html_ = notebook.html

    def row(self, name: str) -> MethodRow:
        """The row of that name."""
        return next(row for row in self.rows if row.name == name)

    @property
    def complete(self) -> bool:
        """True if every method was run to completion."""
        return not self.interrupted and all(row.outcome in ("done", "no answer") for row in self.rows)

    @property
    def sentence(self) -> str:
        """Conclusion for the user, in plain words."""
        if self.cheapest is None and any(row.value is not None and row.meets is None for row in self.rows):
            doubt = f"the error of the reference itself is {self.reference.doubt:.1e}"
            return f"Which method keeps the relative error of {self.rtol:g} cannot be determined on this scene: {doubt}."
        if self.cheapest is None:
            return f"No method that was run keeps the relative error of {self.rtol:g} on this scene."
        best = self.row(self.cheapest)
        words = f"Cheapest that keeps a relative error of {self.rtol:g} on this scene: {self._priced(best)}"
        if self.level:
            words += f"; level with it within the noise: {'; '.join(self.level)}"
        words += "."
        if best.promised is not None and best.promised <= self.rtol:
            return words
        if self.cheapest_promised is None:
            return words + " It has no error estimate that promises this; no method that has one was run to completion."
        sure = self._priced(self.row(self.cheapest_promised))
        return words + f" It has no error estimate that promises this; the cheapest method that has one is {sure}."

    def _priced(self, row: MethodRow) -> str:
        certain = row.error is not None and row.error > self.reference.doubt
        error = f"{row.error:.1e}" if certain else f"below {self.reference.doubt:.1e}"
        return f"{row.name} ({duration(row.seconds or 0.0)}, error {error})"

    def as_dict(self) -> dict[str, Any]:
        """The record for JSON."""
        return {
            **{item.name: getattr(self, item.name) for item in fields(self)},
            "level": list(self.level),
            "messages": list(self.messages),
            "complete": self.complete,
            "sentence": self.sentence,
            "reference": {name: value for name, value in self.reference._asdict().items() if name != "messages"},
            "rows": [row._asdict() for row in self.rows],
            "cannot": dict(self.cannot),
        }


def duration(seconds: float) -> str:
    """A time with a unit that suits it.

    >>> duration(0.00042), duration(3.14159)
    ('0.42 ms', '3.1 s')
    """
    return (
        f"{seconds:.2g} s" if seconds >= 1.0 else f"{1e3 * seconds:.3g} ms" if seconds >= 0.1 else f"{1e3 * seconds:.2g} ms"
    )


# -- methods -----------------------------------------------------------------------------------------------------------

RESTARTED = ", restarted"
AREAS = "accumulated areas"
INERTIA_TORQUE = "inertia torque at constant speed"
GRID = "plain grid"
CLOSED_FORM = "exact, closed form"
ALONG_THE_MOTION = "exact, collocation"
COLLOCATION = "collocation"
STEPPING = "time stepping, "
BOND_GRAPH = "whole bond graph"
MULTIPLIERS = "Lagrange's multipliers"
PROOF = "proven interval"

FAMILIES = (
    *(AREAS, INERTIA_TORQUE, GRID, CLOSED_FORM, ALONG_THE_MOTION, COLLOCATION),
    *(STEPPING + kind for kind in ("Euler", "RK4", "RK45", "DOP853", "LSODA")),
    *(BOND_GRAPH, MULTIPLIERS, PROOF),
)
"""Families in the order in which they are listed; any other comes after them."""

_TOLERANCES = (1e-3, 1e-6, 1e-9, 1e-12)
_ANY = 0.01  # an irregularity, where its value does not matter
_SEARCH = 0.1  # tolerance of a search to that of the steps that it searches with
_OVER_JUMPS = 100.0  # the same where steps run over jumps, and end in noise far above their tolerance
_JUMPS = "that loads jump within steps"
_FEW = (("RK4", (36, 360)), ("Euler", (360,)))  # steps a cycle
_MANY = (("Euler", (3600,)), ("RK4", (3600,)))
_FIXED = {"Euler": 1e-5, "RK4": 1e-8}  # tolerance of a search with steps of a fixed length: below their error


class StudyMethod(NamedTuple):
    """A way to the answer: its family and setting, a short label for pictures, and its omissions.

    `promised` is its own estimate of the relative error, None if it has none.
    """

    family: str
    setting: str
    label: str
    answer: Callable[[], float]
    leaves_out: str = ""
    promised: float | None = None

    @property
    def name(self) -> str:
        """Family and setting."""
        return f"{self.family}, {self.setting}" if self.setting else self.family

    @property
    def group(self) -> tuple[str, bool]:
        """Common key of the settings of one family, ordered from coarse to fine."""
        return self.family, self.setting.endswith(RESTARTED)


def ordered(rows: Iterable[MethodRow]) -> list[MethodRow]:
    """Rows by family, in each those with a restart before those without."""
    places = {name: k for k, name in enumerate(FAMILIES)}
    return sorted(rows, key=lambda row: (places.get(row.family, len(places)), row.family, not row.name.endswith(RESTARTED)))


def methods(question: Question) -> list[StudyMethod]:
    """Every method that can answer, in the order of their runs: the most informative for their time first."""
    machine, own = question.machine, question.machine.sets_its_speed
    varying = "that I* varies over the cycle" + (", and torques with speed" if own else "")
    frozen = "that the speed varies, for the inertia torque" + (" and for the loads" if own else "")
    between = "what happens between angles" + (", torques that depend on speed at a constant one" if own else "")
    exact = ALONG_THE_MOTION if own else CLOSED_FORM
    # an analysis takes the same fluctuations of energy as a sizing; for which irregularity does not matter to them
    scene = machine.scene if question.sized else replace(machine.scene, inertia=None, irregularity=_ANY, wheel=None)
    sizing = machine if question.sized else Machine(scene, machine.friction)
    first = [
        StudyMethod(AREAS, "", "areas", partial(_by_fluctuation, question, sizing, False), varying),
        StudyMethod(INERTIA_TORQUE, "", "inertia torque", partial(_by_fluctuation, question, sizing, True), frozen),
    ]
    for count in (36, 360, 3600):
        by_grid = partial(answers.by_grid, question, count)
        first.append(StudyMethod(GRID, f"{count} angles", f"grid {count}", by_grid, between))
    for rtol in _TOLERANCES:
        call = partial(_sized, question, rtol)
        first.append(StudyMethod(exact, f"rtol {rtol:g}", f"exact {rtol:g}", call, promised=rtol))
    for rtol in () if own else _TOLERANCES[1:]:
        call = partial(_collocated, question, rtol)
        first.append(StudyMethod(COLLOCATION, f"rtol {rtol:g}", f"collocation {rtol:g}", call, promised=rtol))
    if find_spec("flint") is not None:
        import_module("flywheel.sizing.proof")  # before its time is taken
    first.append(StudyMethod(PROOF, "", "proof", partial(_proven, question), promised=WIDTH))

    def stepped(
        family: str, setting: str, short: str, revolve: Revolve, tolerance: float, restart: bool, missing: str = _JUMPS
    ) -> StudyMethod:
        call = partial(answers.by_shooting, question, revolve, tolerance)
        mark, missing = (RESTARTED, "") if restart else ("", missing)
        return StudyMethod(family, setting + mark, short + mark.replace(",", ""), call, missing)

    def adaptive(restart: bool) -> Iterator[StudyMethod]:
        for kind in answers.ADAPTIVE:
            for rtol in (1e-6, 1e-9, 1e-12)[: 3 if kind == "DOP853" else 2]:
                revolve = answers.adaptive(machine, kind, rtol, restart)
                tolerance = (_SEARCH if restart else _OVER_JUMPS) * rtol
                yield stepped(STEPPING + kind, f"rtol {rtol:g}", f"{kind} {rtol:g}", revolve, tolerance, restart)

    def fixed(restart: bool, plan: tuple[tuple[str, tuple[int, ...]], ...]) -> Iterator[StudyMethod]:
        for kind, counts in plan:
            for count in counts:
                revolve = answers.fixed(machine, kind, count, restart)
                tolerance = (_SEARCH if restart else _OVER_JUMPS) * _FIXED[kind]
                yield stepped(STEPPING + kind, f"{count} steps", f"{kind} {count}", revolve, tolerance, restart)

    def multipliers(restart: bool) -> Iterator[StudyMethod]:
        for rtol in (1e-4, 1e-6, 1e-8)[: 3 if restart else 2]:
            revolve = answers.by_multipliers(machine, rtol, restart)
            yield stepped(MULTIPLIERS, f"rtol {rtol:g}", f"multipliers {rtol:g}", revolve, _SEARCH * rtol, restart)

    def graphs() -> Iterator[StudyMethod]:
        lossy = any(efficiency < 1.0 for efficiency in machine.scene.efficiencies.values())
        for rtol in (1e-6, 1e-9):
            revolve, missing = answers.by_bond_graph(machine, rtol), "losses in meshes" if lossy else ""
            yield stepped(BOND_GRAPH, f"rtol {rtol:g}", f"bond graph {rtol:g}", revolve, _SEARCH * rtol, False, missing)

    jointed = answers.obstacle(machine) is None
    return [
        *(*first, *adaptive(True), *graphs(), *(multipliers(True) if jointed else ()), *fixed(True, _FEW)),
        *(*adaptive(False), *fixed(False, _FEW), *(multipliers(False) if jointed else ())),
        *(*fixed(True, _MANY), *fixed(False, _MANY)),
    ]


def _by_fluctuation(question: Question, sizing: Machine, torque: bool) -> float:
    """The flywheel from the fluctuation of W, or of W - ½w²I*: over eps w² it includes the least I*."""
    if sizing.sets_its_speed:
        speed, *_ = constant_speed.reference_point(sizing)
        figures, _ = speed_dependent.at_constant_speed(sizing, speed, sizing.scene.rtol)
    else:
        figures, _ = wittenbauer.resolved_figures(sizing, sizing.scene.rtol)
    wheel, inertia = wittenbauer.flywheel(figures, sizing.scene), figures.reduced_inertia
    if question.sized:
        return (wheel.inertia_torque_flywheel if torque else wheel.approximate) or 0.0
    total = (wheel.inertia_torque if torque else wheel.approximate_total) or 0.0
    own_inertia = question.machine.scene.inertia or 0.0
    return (sizing.scene.irregularity or 0.0) * total / (own_inertia + inertia.min / question.crank)


def _sized(question: Question, rtol: float) -> float:
    question.machine.kept.pop("moments", None)  # what another method evaluated is no help to this one
    return answer(size(question.machine, rtol, accuracy="normal"))


def _proven(question: Question) -> float:
    """The middle of the interval in which the figure is proven to lie."""
    proof = size(question.machine, accuracy="proof").proof
    assert proof is not None
    if proof.reason:
        raise NoAnswerError(f"not provable: {proof.reason}")
    if proof.ranges:
        raise NoAnswerError("proven over ranges of numbers: no single figure")
    low, high = proof.figures["flywheel.exact" if question.sized else "simulation.irregularity"]
    return 0.5 * (low + high)


def _collocated(question: Question, rtol: float) -> float:
    """The periodic motion by Newton's method, as if its torques depended on speed."""
    scene, speed, start = question.machine.scene, question.machine.scene.speed or 0.0, question.flywheel
    demand = Demand(None if question.sized else start, scene.irregularity, speed)
    question.machine.kept.pop("moments", None)
    motion = periodic_motion.own_motion(question.machine, speed, demand, start, 0.0, rtol)
    return max(motion.inertia, 0.0) / question.crank if question.sized else motion.run.irregularity


# -- measuring: methods one after the other within a budget of time, each with its time and its evaluations ------------

_REPEATS = 7
_ENOUGH = 0.25  # seconds of repeating after which no more is repeated
_LONGEST = 0.1  # of the budget, for one method
_LEAST = 0.05  # seconds that any method gets
_ROUNDS, _CLOSE = 25, 1.6  # of the deciding round, for all whose time is within this factor of the least
_AT_MOST = 2.0  # seconds that the deciding round takes

DONE, FAILED, OUT_OF_TIME, LEFT = "done", "no answer", "out of time", "not run"

Progress = Callable[[int, int, str], None]


class MethodRun(NamedTuple):
    """Outcome of a method: its answer, times of its repeats (s), evaluations, or the reason why there is none."""

    method: StudyMethod
    outcome: str
    value: float | None = None
    times: tuple[float, ...] = ()
    evaluations: int | None = None
    reason: str = ""

    @property
    def seconds(self) -> float | None:
        """Median of its times."""
        return statistics.median(self.times) if self.times else None

    @property
    def least(self) -> float:
        """The least of its times (s): its time without disturbance."""
        return min(self.times, default=float("inf"))


class OutOfTimeError(BaseException):
    """A method that did not finish in time: nothing on the way may take that for a fault of a scene."""


@contextmanager
def limited(end: float) -> Iterator[Tally]:
    """Counts evaluations in the block; once `time.perf_counter()` is past `end` (s), OutOfTimeError ends it."""

    def check() -> None:
        if time.perf_counter() > end:
            raise OutOfTimeError

    with counted(check) as tally:
        yield tally


def measured(
    methods: Sequence[StudyMethod], budget: float, progress: Progress | None = None, spent: float = 0.0
) -> tuple[list[MethodRun], bool, float]:
    """Runs methods until all are done, the budget (s) is spent, or the user interrupts.

    Returns every method's run, True if the user stopped it, and the total time (s).

    The time `spent` before counts, but half of the budget is always reserved for methods. A method is left out if a coarser
    setting of it has already taken too long.
    """
    begun = time.perf_counter() - spent
    over = begun + max(budget, spent + 0.5 * budget)
    runs: list[MethodRun] = []
    interrupted = False
    try:
        for k, method in enumerate(methods):
            if progress is not None:
                progress(k, len(methods), method.name)
            left = over - time.perf_counter()
            if left <= 0.0:
                runs.append(MethodRun(method, LEFT, reason="the budget was spent"))
            elif any(run.method.group == method.group and run.outcome in (OUT_OF_TIME, LEFT) for run in runs):
                runs.append(MethodRun(method, LEFT, reason="a rougher setting took too long already"))
            else:
                runs.append(_run(method, min(left, max(_LONGEST * budget, _LEAST))))
    except KeyboardInterrupt:
        interrupted = True
    runs += [MethodRun(method, LEFT, reason="interrupted") for method in methods[len(runs) :]]
    return runs, interrupted, time.perf_counter() - begun


def _run(method: StudyMethod, limit: float) -> MethodRun:
    """One method, repeated while that costs little; the first of several repeats only warms up."""
    try:
        with np.errstate(all="ignore"):
            with limited(time.perf_counter() + limit) as tally:
                seconds, value = _timed(method)
            times = [seconds]
            while len(times) <= _REPEATS and sum(times) < min(_ENOUGH, limit):
                times.append(_timed(method)[0])
    except OutOfTimeError:
        return MethodRun(method, OUT_OF_TIME, reason=f"stopped after {limit:.2g} s")
    except (SceneError, NoAnswerError, ArithmeticError, ValueError, RuntimeError) as error:
        return MethodRun(method, FAILED, reason=next(iter(str(error).splitlines()), type(error).__name__))
    if not np.isfinite(value):
        return MethodRun(method, FAILED, reason="no finite answer")
    return MethodRun(method, DONE, float(value), tuple(times[1:] or times), tally.evaluations)


def _timed(method: StudyMethod) -> tuple[float, float]:
    start = time.perf_counter()
    value = method.answer()
    return time.perf_counter() - start, value


def decided(runs: Iterable[MethodRun]) -> tuple[list[MethodRun], bool]:
    """The runs that are close to the fastest of them, timed again in turns so that a disturbance affects all.

    Also returns True if the user stopped that.
    """
    timed = [run for run in runs if run.times]
    fastest = min((run.least for run in timed), default=0.0)
    close = [run for run in timed if run.least <= _CLOSE * fastest]
    if len(close) < 2:
        return close, False
    rounds = int(min(_ROUNDS, max(_AT_MOST / sum(run.least for run in close), 1.0)))
    times: list[list[float]] = [[] for _ in close]
    try:
        with np.errstate(all="ignore"):
            for _ in range(rounds):
                for own, run in zip(times, close, strict=True):
                    own.append(_timed(run.method)[0])
    except KeyboardInterrupt:
        return close, True
    return [run._replace(times=tuple(own)) for run, own in zip(close, times, strict=True)], False


# -- comparison --------------------------------------------------------------------------------------------------------

_NOISE = 1.1  # two times closer than this factor are level


def tradeoff(
    machine: Machine | Scene, rtol: float | None = None, *, budget: float = 60.0, progress: Progress | None = None
) -> Tradeoff:
    """Runs every method that can answer a scene, and measures the cost and error of each.

    All answer the same question: the flywheel for the required irregularity, or the irregularity with the given flywheel.
    Errors are true ones, against a reference found by two independent routes. Times are for a machine that is already built.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        rtol: required relative error; the scene's own if None.
        budget: seconds after which no further method is begun; one method gets at most a tenth of it. The time for the
            reference counts, but half of the budget is reserved for methods; timing the fastest ones again takes up to two
            seconds more.
        progress: called before each method with its number, their number, and its name.

    Raises:
        SceneError: if the machine cannot run as the scene describes, or the scene has no machine.

    >>> import flywheel
    >>> rotor = {"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...          "inertia": [{"on": "crank", "value": 1.0}], "drive": {"torque": "balance"},
    ...          "regime": {"speed": "300 rpm"}, "flywheel": {"irregularity": 0.01}}
    >>> found = flywheel.tradeoff(flywheel.load(rotor), 1e-9, budget=0.5)
    >>> found.figure, round(found.reference.value, 9), found.row("accumulated areas").meets
    ('exact flywheel', 14.915494309, True)

    """
    scene = scene_of(machine)
    check_complete(scene)
    kept = scene.rtol if rtol is None else rtol
    faults = rtol_faults(kept)
    if scene.areas is not None:
        advice = "use flywheel size"
        faults.append(Fault("areas", "areas of a diagram, which a closed form solves", "a scene with a machine", advice))
    if of_motor := [name for name in scene.limits if name != "irregularity"]:
        expected, advice = "an irregularity, or an inertia", "use flywheel size"
        faults.append(Fault(f"flywheel.limits.{of_motor[0]}", "a limit of the motor", expected, advice))
    if not budget > 0.0:
        faults.append(Fault("budget", f"{budget}", "a number of seconds above 0"))
    if faults:
        raise SceneError(faults)
    machine = machine if isinstance(machine, Machine) else Machine(machine)
    if machine.has_joint_friction:  # with friction in joints as it is in the steady regime
        machine = size(machine, accuracy="normal").machine or machine
    begun = time.perf_counter()
    question, reference = verified(machine)
    runs, interrupted, seconds = measured(methods(question), budget, progress, time.perf_counter() - begun)

    def meets(run: MethodRun) -> bool | None:
        """Tests whether a run keeps the error; None if it has no answer, or the reference is not accurate enough."""
        if run.value is None:
            return None
        error = question.error(run.value, reference.value)
        return True if error + reference.doubt <= kept else False if error - reference.doubt > kept else None

    again, stopped = ([], True) if interrupted else decided(run for run in runs if meets(run))
    anew = {run.method.name: run for run in again}
    runs = [anew.get(run.method.name, run) for run in runs]
    good = [run for run in runs if meets(run)]
    level = _level(good)
    best = _chosen(level, kept)
    return Tradeoff(
        title=scene.title,
        figure=question.figure,
        unit=question.unit,
        rtol=kept,
        reference=reference,
        scale=question.scale,
        rows=tuple(_row(question, reference, run, meets(run)) for run in runs),
        cheapest=best,
        level=tuple(run.method.name for run in level if run.method.name != best),
        cheapest_promised=_chosen(_level([run for run in good if _promises(run, kept)]), kept),
        cannot={} if (reason := answers.obstacle(machine)) is None else {MULTIPLIERS: reason},
        budget=budget,
        seconds=seconds,
        interrupted=interrupted or stopped,
        messages=reference.messages,
    )


def _level(runs: list[MethodRun]) -> list[MethodRun]:
    """The fastest run, and those that take as long within the noise, undisturbed."""
    fastest = min((run.least for run in runs), default=0.0)
    return sorted((run for run in runs if run.least <= _NOISE * fastest), key=lambda run: run.least)


def _promises(run: MethodRun, rtol: float) -> bool:
    return run.method.promised is not None and run.method.promised <= rtol


def _chosen(level: list[MethodRun], rtol: float) -> str | None:
    """The run with the greatest estimate within rtol among those that take as long; else the fastest."""
    promises = [run for run in level if _promises(run, rtol)]
    best = max(promises, key=lambda run: run.method.promised or 0.0, default=level[0] if level else None)
    return best and best.method.name


def _row(question: Question, reference: Reference, run: MethodRun, meets: bool | None) -> MethodRow:
    method = run.method
    return MethodRow(
        name=method.name,
        family=method.family,
        label=method.label,
        outcome=run.outcome,
        value=run.value,
        error=None if run.value is None else question.error(run.value, reference.value),
        meets=meets,
        seconds=run.seconds,
        fastest=min(run.times, default=None),
        slowest=max(run.times, default=None),
        repeats=len(run.times),
        evaluations=run.evaluations,
        promised=method.promised,
        leaves_out=method.leaves_out,
        reason=run.reason,
    )
