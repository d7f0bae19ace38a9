"""A confirmation without time stepping: the motion by periodic collocation, on cells that nothing else uses.

The energy along the cycle is solved for by Newton's method (`flywheel.periodic`), its level and the balance with it. With
loads that depend on position alone it shares I* and M* with the closed form, but no cell, no node and no formula for the
flywheel; with torques that depend on speed it repeats the collocation that the figures come from at other places.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flywheel import own_motion, steady
from flywheel.agreement import Found, confirmation, disagreement
from flywheel.machine import Machine
from flywheel.own_motion import OwnMotion
from flywheel.patience import ImpatientError, patience
from flywheel.periodic import Asked, NoRegimeError
from flywheel.piecewise import ROUNDING
from flywheel.results import Sizing
from flywheel.steady import Run

Array = NDArray[np.float64]

_PATIENCE = 300_000  # nodes in Newton steps of one motion, some seconds; a textbook machine takes 3 000
_HOPELESS = 0.5  # relative error past which a figure says nothing


def collocated(sizing: Sizing) -> Sizing:
    """The sizing with one steady cycle found again by collocation: with the exact (or given) and the approximate flywheel.

    Raises:
        NoRegimeError: where the iteration finds no motion on these cells.
        ImpatientError: where it takes too long.

    """
    if sizing.machine is None or sizing.cycle is None:
        return sizing
    if sizing.run is None:
        return replace(sizing, messages=(*sizing.messages, "nothing to solve for: the machine has no inertia"))
    machine = on_thirds(sizing.machine)
    motion = _motion(sizing, machine, sizing.run.inertia)
    found = _found(motion, sizing)
    error, of_period = disagreement(found, sizing.cycle, sizing.speed, sizing.run, sizing.rtol)
    if not error <= _HOPELESS:
        raise NoRegimeError("what collocation finds is lost in its own error")
    approximate, doubt, messages = _with_approximate(sizing, machine)
    errors = sizing.error._replace(simulation=max(error, doubt), period=of_period)
    told = confirmation(sizing, found, approximate, "collocation")
    return replace(sizing, simulation=told, error=errors, messages=(*sizing.messages, *messages))


def on_thirds(machine: Machine) -> Machine:
    """The machine with other first cells: a wide stretch cut into one more than before, a single cell into three.

    A stretch has n cells there and n + 1 (or three) here: however often either are halved, no cell is one of the sizing's.
    """
    found = copy(machine)
    marks, first = machine.landmarks, machine.mesh
    place = np.searchsorted(first, marks)
    counts = np.diff(place)
    pieces = [
        np.linspace(a, b, 3 if n == 1 else n + 1, endpoint=False)
        for a, b, n in zip(marks[:-1], marks[1:], counts, strict=True)
    ]
    found.mesh = np.concatenate([*pieces, marks[-1:]])
    return found


def _motion(sizing: Sizing, machine: Machine, inertia: float) -> OwnMotion:
    """The steady motion with a flywheel (kg m² on the crank); the sizing's own speed is held where nothing else sets one."""
    scene, constant = sizing.scene, sizing.constant or sizing.cycle
    free = scene.unknown is None and machine.sets_its_speed
    held = None if free else (scene.speed or sizing.speed)
    unknown = 0.0 if constant is None else constant.balance or 0.0
    asked = Asked(inertia, None, held)
    with patience(_PATIENCE):
        return own_motion.found(machine, held or sizing.speed, asked, 0.0, unknown, 0.5 * sizing.rtol)


def _found(motion: OwnMotion, sizing: Sizing) -> Found:
    run, cycle, edges = motion.run, motion.cycle, motion.solved.state.edges
    period, _ = steady.period(cycle, motion.speed, run, sizing.rtol)
    gained = float(edges[-1, 0] - edges[0, 0])
    start = float(steady.speed_over_cycle(cycle, motion.speed, run, np.zeros(1))[0])
    share = 2.0 * gained / ((run.inertia + cycle.inertia_at_start) * start**2)
    closure = share / (1.0 + float(np.sqrt(1.0 + share)))
    return Found(run.irregularity, run.speed_max, run.speed_min, period, closure)


def _with_approximate(sizing: Sizing, machine: Machine) -> tuple[float | None, float, tuple[str, ...]]:
    """The irregularity with the approximate flywheel, its relative error, and what is to be said of it."""
    figure = sizing.flywheel.approximate
    if figure is None:
        return None, 0.0, ()
    try:
        run = _motion(sizing, machine, figure * sizing.scene.flywheel_ratio**2).run
    except ImpatientError:
        return None, 0.0, ("the motion with the approximate flywheel takes too long to find",)
    except NoRegimeError:
        return None, 0.0, ("no steady motion with the approximate flywheel has the mean of extremes asked for",)
    doubt = 8 * ROUNDING + run.error + _difference(run, sizing)
    if doubt > _HOPELESS:
        return None, 0.0, ("rounding leaves nothing to tell of the irregularity that the approximate flywheel gives",)
    return run.irregularity, doubt, ()


def _difference(run: Run, sizing: Sizing) -> float:
    """How far the irregularity is off that of the sizing's own route with the same flywheel, as a share."""
    if sizing.cycle is None or sizing.cyclic is not None or run.irregularity <= 0.0:
        return 0.0
    try:
        return abs(steady.run(sizing.cycle, sizing.speed, run.inertia).irregularity / run.irregularity - 1.0)
    except steady.NoMotionError:
        return _HOPELESS
