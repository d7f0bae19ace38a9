"""Accuracy against cost on one scene, measured."""

from __future__ import annotations

import time

from flywheel.accuracy import rtol_faults
from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.regime import check_cycle
from flywheel.scene import Scene
from flywheel.tradeoffs import measuring, methods
from flywheel.tradeoffs.measuring import Progress, Run
from flywheel.tradeoffs.question import Question
from flywheel.tradeoffs.reference import Reference, verified
from flywheel.tradeoffs.result import Row, Tradeoff

_NOISE = 1.1  # two times closer than this factor are level


def tradeoff(
    machine: Machine | Scene, rtol: float | None = None, *, budget: float = 60.0, progress: Progress | None = None
) -> Tradeoff:
    """Run every method that can answer a scene, and measure what each costs and how far off it is.

    All answer the same question: the flywheel for the irregularity asked, or the irregularity of the flywheel given. Errors
    are true ones, against a reference found by two independent routes. Times hold for a machine that is built already.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        rtol: relative error that is to be kept; the scene's own if None.
        budget: seconds after which no further method is begun; one method gets at most a tenth of it. Finding the reference
            counts, but leaves half of it to methods; timing the best ones again takes up to two seconds more.
        progress: called before each method with its number, how many there are, and its name.

    Raises:
        SceneError: if the machine cannot run as the scene says, or the scene has no machine.

    >>> import flywheel
    >>> rotor = {"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...          "inertia": [{"on": "crank", "value": 1.0}], "drive": {"torque": "balance"},
    ...          "regime": {"speed": "300 rpm"}, "flywheel": {"irregularity": 0.01}}
    >>> found = flywheel.tradeoff(flywheel.load(rotor), 1e-9, budget=0.5)
    >>> found.figure, round(found.reference.value, 9), found.row("accumulated areas").meets
    ('exact flywheel', 14.915494309, True)

    """
    scene = machine.scene if isinstance(machine, Machine) else machine
    if not isinstance(scene, Scene):
        raise TypeError(f"expected a Machine or a Scene (flywheel.load makes one), found {type(machine).__name__}")
    check_cycle(scene)
    kept = scene.rtol if rtol is None else rtol
    _check(scene, kept, budget)
    machine = machine if isinstance(machine, Machine) else Machine(scene)
    begun = time.perf_counter()
    asked, reference = verified(machine)
    found = measuring.measured(methods.methods(asked), budget, progress, time.perf_counter() - begun)
    return _compared(asked, reference, found, kept, budget)


def _check(scene: Scene, rtol: float, budget: float) -> None:
    faults = rtol_faults(rtol)
    if scene.areas is not None:
        advice = "use flywheel size"
        faults.append(Fault("areas", "areas of a diagram, which one closed form answers", "a scene with a machine", advice))
    if not budget > 0.0:
        faults.append(Fault("budget", f"{budget}", "a number of seconds above 0"))
    if faults:
        raise SceneError(faults)


def _compared(asked: Question, reference: Reference, found: measuring.Measured, rtol: float, budget: float) -> Tradeoff:
    good = [run for run in found.runs if _meets(asked, reference, run, rtol)]
    anew, stopped = ([], True) if found.interrupted else measuring.decided(good)
    again = {run.method.name: run for run in anew}
    runs = [again.get(run.method.name, run) for run in found.runs]
    good = [run for run in runs if _meets(asked, reference, run, rtol)]
    level = _level(good)
    safe = _level([run for run in good if run.method.promised is not None and run.method.promised <= rtol])
    best, sure = _chosen(level, rtol), _chosen(safe, rtol)
    return Tradeoff(
        title=asked.machine.scene.title,
        figure=asked.figure,
        unit=asked.unit,
        rtol=rtol,
        reference=reference,
        scale=asked.scale,
        rows=tuple(_row(asked, reference, run, rtol) for run in runs),
        cheapest=best,
        level=tuple(run.method.name for run in level if run.method.name != best),
        cheapest_promised=sure,
        cannot=methods.obstacles(asked),
        budget=budget,
        seconds=found.seconds,
        interrupted=found.interrupted or stopped,
        messages=reference.messages,
    )


def _level(runs: list[Run]) -> list[Run]:
    """The fastest run, and those that take as long within the noise, undisturbed."""
    fastest = min((run.least for run in runs), default=0.0)
    return sorted((run for run in runs if run.least <= _NOISE * fastest), key=lambda run: run.least)


def _chosen(level: list[Run], rtol: float) -> str | None:
    """Of runs that take as long, one that promises rtol, and no more than that; else the fastest."""
    promises = [run for run in level if run.method.promised is not None and run.method.promised <= rtol]
    best = max(promises, key=lambda run: run.method.promised or 0.0, default=level[0] if level else None)
    return best and best.method.name


def _meets(asked: Question, reference: Reference, run: Run, rtol: float) -> bool | None:
    """Whether a run keeps rtol; None where it has no answer, or the reference's doubt does not let one tell."""
    if run.value is None:
        return None
    error = asked.error(run.value, reference.value)
    return True if error + reference.doubt <= rtol else False if error - reference.doubt > rtol else None


def _row(asked: Question, reference: Reference, run: Run, rtol: float) -> Row:
    method = run.method
    return Row(
        name=method.name,
        family=method.family,
        label=method.label,
        outcome=run.outcome,
        value=run.value,
        error=None if run.value is None else asked.error(run.value, reference.value),
        meets=_meets(asked, reference, run, rtol),
        seconds=run.seconds,
        fastest=min(run.times, default=None),
        slowest=max(run.times, default=None),
        repeats=len(run.times),
        evaluations=run.evaluations,
        promised=method.promised,
        leaves_out=method.leaves_out,
        reason=run.reason,
    )
