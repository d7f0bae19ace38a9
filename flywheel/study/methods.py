"""Every method that can answer a scene, by the name of its family and its setting, with what it leaves out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from flywheel.machine.machine import Machine
from flywheel.regime import constant_speed, periodic_motion, wittenbauer
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.periodic_motion import Asked
from flywheel.sizing import speed_dependent
from flywheel.sizing.sizing import size
from flywheel.study import steppers, whole_models
from flywheel.study.question import Question, answer
from flywheel.study.steppers import Revolve, by_shooting

RESTARTED = ", restarted"
AREAS = "accumulated areas"
INERTIA_TORQUE = "inertia torque at constant speed"
GRID = "plain grid"
CLOSED_FORM = "exact, closed form"
ALONG_THE_MOTION = "exact, collocation"
COLLOCATION = "collocation"
BOND_GRAPH = "whole bond graph"
MULTIPLIERS = "Lagrange's multipliers"


def stepping(kind: str) -> str:
    """The family of a stepper.

    >>> stepping("RK4")
    'time stepping, RK4'
    """
    return f"time stepping, {kind}"


FAMILIES = (
    *(AREAS, INERTIA_TORQUE, GRID, CLOSED_FORM, ALONG_THE_MOTION, COLLOCATION),
    *map(stepping, ("Euler", "RK4", "RK45", "DOP853", "LSODA")),
    *(BOND_GRAPH, MULTIPLIERS),
)
"""Families in the order in which they are told; any other comes after them."""

_TOLERANCES = (1e-3, 1e-6, 1e-9, 1e-12)
_OVER_JUMPS = 100.0  # the same where steps run over jumps, and end in noise far above their tolerance
_ANY = 0.01
_SEARCH = 0.1  # tolerance of a search to that of the steps that it searches with
_JUMPS = "that loads jump within steps"

Plan = tuple[tuple[str, tuple[int, ...]], ...]
_FEW: Plan = (("RK4", (36, 360)), ("Euler", (360,)))
_MANY: Plan = (("Euler", (3600,)), ("RK4", (3600,)))
_FIXED = {"Euler": 1e-5, "RK4": 1e-8}  # tolerance of a search with steps of a fixed length: below what these come to


class Method(NamedTuple):
    """A way to the answer: its family and setting, a short label for pictures, and what it leaves out.

    `promised` is the relative error that it promises, None where it does not know its own error.
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
        """What it shares with its other settings, which come one after the other from rough to fine."""
        return self.family, self.setting.endswith(RESTARTED)


def methods(asked: Question) -> list[Method]:
    """All of them, in the order in which they are run: those that tell most for their time first."""
    return [
        *(*_approximate(asked), *_grids(asked), *_exact(asked)),
        *(*_adaptive(asked, True), *_bond_graph(asked), *_multipliers(asked, True), *_fixed(asked, True, _FEW)),
        *(*_adaptive(asked, False), *_fixed(asked, False, _FEW), *_multipliers(asked, False)),
        *(*_fixed(asked, True, _MANY), *_fixed(asked, False, _MANY)),
    ]


def obstacles(asked: Question) -> dict[str, str]:
    """Methods that cannot answer, with the reason."""
    found = whole_models.obstacle(asked.machine)
    return {} if found is None else {MULTIPLIERS: found}


def _approximate(asked: Question) -> Iterator[Method]:
    machine = asked.machine
    own = machine.sets_its_speed
    # an analysis asks the same fluctuations of energy as a sizing; for which irregularity does not matter to them
    sizing = machine if asked.sized else machine_of(replace(machine.scene, inertia=None, irregularity=_ANY, wheel=None))
    varying = "that I* varies over the cycle" + (", and torques with speed" if own else "")
    yield Method(AREAS, "", "areas", partial(_by_fluctuation, asked, sizing, False), varying)
    frozen = "that the speed varies, for the inertia torque" + (" and for the loads" if own else "")
    yield Method(INERTIA_TORQUE, "", "inertia torque", partial(_by_fluctuation, asked, sizing, True), frozen)


def _by_fluctuation(asked: Question, sizing: Machine, torque: bool) -> float:
    """From the fluctuation of W, or of W - ½w²I*: over eps w² it is the flywheel with the least I*."""
    if sizing.sets_its_speed:
        speed, *_ = constant_speed.reference_point(sizing)
        figures, _ = speed_dependent.at_constant_speed(sizing, speed, sizing.scene.rtol)
    else:
        figures, _ = wittenbauer.resolved_figures(sizing, sizing.scene.rtol)
    wheel, inertia = wittenbauer.flywheel(figures, sizing.scene), wittenbauer.reduced_inertia(figures)
    if asked.sized:
        return (wheel.inertia_torque_flywheel if torque else wheel.approximate) or 0.0
    total = (wheel.inertia_torque if torque else wheel.approximate_total) or 0.0
    given = asked.machine.scene.inertia or 0.0
    return (sizing.scene.irregularity or 0.0) * total / (given + inertia.least / asked.crank)


def _grids(asked: Question) -> Iterator[Method]:
    for count in (36, 360, 3600):
        frozen = ", torques that depend on speed at a constant one" if asked.machine.sets_its_speed else ""
        missing = "what happens between angles" + frozen
        yield Method(GRID, f"{count} angles", f"grid {count}", partial(steppers.by_grid, asked, count), missing)


def _exact(asked: Question) -> Iterator[Method]:
    own = asked.machine.sets_its_speed
    for rtol in _TOLERANCES:
        family = ALONG_THE_MOTION if own else CLOSED_FORM
        yield Method(family, f"rtol {rtol:g}", f"exact {rtol:g}", partial(_sized, asked, rtol), promised=rtol)
    if not own:
        for rtol in _TOLERANCES[1:]:
            call = partial(_collocated, asked, rtol)
            yield Method(COLLOCATION, f"rtol {rtol:g}", f"collocation {rtol:g}", call, promised=rtol)


def _sized(asked: Question, rtol: float) -> float:
    return answer(size(asked.machine, rtol, accuracy="normal"))


def _collocated(asked: Question, rtol: float) -> float:
    """The periodic motion by Newton's method, as if its torques depended on speed."""
    scene, machine = asked.machine.scene, asked.machine
    speed = scene.speed or 0.0
    start = 0.0 if asked.sized else (scene.inertia or 0.0) * asked.crank
    wanted = Asked(None if asked.sized else start, scene.irregularity, speed)
    found = periodic_motion.found(machine, speed, wanted, start, 0.0, rtol)
    return max(found.inertia, 0.0) / asked.crank if asked.sized else found.run.irregularity


def _adaptive(asked: Question, restart: bool) -> Iterator[Method]:
    for kind in steppers.ADAPTIVE:
        for rtol in (1e-6, 1e-9, 1e-12)[: 3 if kind == "DOP853" else 2]:
            revolve = steppers.adaptive(asked.machine, kind, rtol, restart)
            yield _stepped(asked, kind, f"rtol {rtol:g}", f"{rtol:g}", revolve, rtol, restart)


def _fixed(asked: Question, restart: bool, plan: Plan) -> Iterator[Method]:
    for kind, counts in plan:
        for count in counts:
            revolve = steppers.fixed(asked.machine, kind, count, restart)
            yield _stepped(asked, kind, f"{count} steps", f"{count}", revolve, _FIXED[kind], restart)


def _stepped(asked: Question, kind: str, setting: str, short: str, revolve: Revolve, rtol: float, restart: bool) -> Method:
    call = partial(by_shooting, asked, revolve, (_SEARCH if restart else _OVER_JUMPS) * rtol)
    mark, missing = (RESTARTED, "") if restart else ("", _JUMPS)
    label = f"{kind} {short}{mark.replace(',', '')}"
    return Method(stepping(kind), setting + mark, label, call, missing)


def _bond_graph(asked: Question) -> Iterator[Method]:
    lossy = any(efficiency < 1.0 for efficiency in asked.machine.scene.efficiencies.values())
    missing = "losses in meshes" if lossy else ""
    for rtol in (1e-6, 1e-9):
        call = partial(by_shooting, asked, whole_models.whole(asked.machine, rtol), _SEARCH * rtol)
        yield Method(BOND_GRAPH, f"rtol {rtol:g}", f"bond graph {rtol:g}", call, missing)


def _multipliers(asked: Question, restart: bool) -> Iterator[Method]:
    if whole_models.obstacle(asked.machine) is not None:
        return
    mark, missing = (RESTARTED, "") if restart else ("", _JUMPS)
    for rtol in (1e-4, 1e-6, 1e-8)[: 3 if restart else 2]:
        call = partial(by_shooting, asked, whole_models.by_multipliers(asked.machine, rtol, restart), _SEARCH * rtol)
        label = f"multipliers {rtol:g}{mark.replace(',', '')}"
        yield Method(MULTIPLIERS, f"rtol {rtol:g}{mark}", label, call, missing)
