"""What becomes of a machine for which no steady motion is found: it stalls, it runs away, or neither within a while.

It is let go at the speed where a steady motion was looked for, and followed in time, as a check of what is said of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.cost import counted
from flywheel.faults import Fault, SceneError
from flywheel.following import Goal, Start, follow
from flywheel.instant import Dynamics
from flywheel.machine import Machine
from flywheel.patience import ImpatientError, patience, spend

Array = NDArray[np.float64]

_CYCLES = 20
_FASTER = 10.0  # times the speed at the start: a machine that gets there runs away
_RTOL = 1e-6
_WORK, _HURRIED = 20_000.0, 12_000.0  # walks of a rotor's graph, at most about a second: a message is worth no more
_AT_ONCE = 16  # positions within a walk that take as long as the walk itself
_LOOK = 4.0  # walks that a step takes as long as, beside those that are counted
_ELEMENTS = 8  # of a graph that take as long to walk as a rotor's


class Fate(Enum):
    """How a motion ends."""

    STALLS = "stalls"
    RUNS_AWAY = "runs away"
    UNKNOWN = "goes on"


class Ending(NamedTuple):
    """How it ends, and where: `machine stalls at crank angle 83.2 deg after 1.2 s`.

    `fault` is why it could not be followed, where that is known.
    """

    fate: Fate
    where: str = ""
    fault: Fault | None = None


def fate_of(machine: Machine, speed: float, inertia: float, balance: float, *, hurried: bool = False) -> Ending:
    """What becomes of a machine let go at phi = 0.

    Args:
        machine: the machine.
        speed: of the crank at the start, rad/s.
        inertia: of the flywheel, kg m² on the crank.
        balance: value (SI) of the scene's unknown.
        hurried: whether enough work went into the machine already.

    """
    cycle = machine.scene.cycle

    def stops(t: Array, phi: Array, omega: Array) -> Array:
        spend(_LOOK)
        return omega

    def races(t: Array, phi: Array, omega: Array) -> Array:
        return _FASTER * speed - omega

    passed = 0

    def passing(t: float, omega: float) -> str | None:
        nonlocal passed
        passed += 1
        return Fate.UNKNOWN.value if passed >= _CYCLES else None

    goals = (Goal(Fate.STALLS.value, stops), Goal(Fate.RUNS_AWAY.value, races))
    dynamics, until = Dynamics(machine, inertia, balance), 100 * _CYCLES * cycle / speed
    current = 0.0 if dynamics.circuit is None else float(dynamics.circuit.current(dynamics.ratio * speed))
    try:
        with _bearable(machine, _HURRIED if hurried else _WORK):
            trail = follow(dynamics, Start(0.0, speed, current), until, _RTOL, goals, passing)
    except ImpatientError:
        return Ending(Fate.UNKNOWN)
    except SceneError as error:
        return Ending(Fate.UNKNOWN, fault=error.faults[0])
    fate = Fate(trail.goal) if trail.goal is not None else Fate.STALLS if trail.stuck else Fate.UNKNOWN
    phi = float(trail.ends()[0, -1])
    return Ending(fate, f"at {machine.where(phi % cycle)} after {float(trail.t[-1]):.4g} s")


@contextmanager
def _bearable(machine: Machine, work: float) -> Iterator[None]:
    """Give up what takes more work inside: walks of the graph are counted, and the more the longer they take."""
    each, known = 1 + len(machine.kinematics.graph.elements) // _ELEMENTS, 0

    def walked() -> None:
        nonlocal known
        spend(each * (1.0 + (tally.evaluations - known) / _AT_ONCE))
        known = tally.evaluations

    with patience(work), counted(walked) as tally:
        yield
