"""What becomes of a machine for which no steady motion is found: it stalls, it runs away, or neither within a while.

It is let go at the speed where a steady motion was looked for, and followed in time, as a check of what is said of it.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import SceneError
from flywheel.following import Goal, Start, follow
from flywheel.instant import Dynamics
from flywheel.machine import Machine

Array = NDArray[np.float64]

_CYCLES = 20
_FASTER = 10.0  # times the speed at the start: a machine that gets there runs away
_RTOL = 1e-6
_MOST_LOOKS = 2000  # at steps: a machine that takes more is too stiff to be followed for a message


class Fate(Enum):
    """How a motion ends."""

    STALLS = "stalls"
    RUNS_AWAY = "runs away"
    UNKNOWN = "goes on"


class _TooLongError(Exception):
    """Following the machine takes too long."""


class Ending(NamedTuple):
    """How it ends, and where: `machine stalls at crank angle 83.2 deg after 1.2 s`."""

    fate: Fate
    where: str = ""


def fate_of(machine: Machine, speed: float, inertia: float, balance: float) -> Ending:
    """What becomes of a machine let go at phi = 0.

    Args:
        machine: the machine.
        speed: of the crank at the start, rad/s.
        inertia: of the flywheel, kg m² on the crank.
        balance: value (SI) of the scene's unknown.

    """
    cycle = machine.scene.cycle

    looks = 0

    def stops(t: Array, phi: Array, omega: Array) -> Array:
        nonlocal looks
        looks += 1
        if looks > _MOST_LOOKS:
            raise _TooLongError
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
        trail = follow(dynamics, Start(0.0, speed, current), until, _RTOL, goals, passing)
    except (SceneError, _TooLongError):
        return Ending(Fate.UNKNOWN)
    fate = Fate(trail.goal) if trail.goal is not None else Fate.STALLS if trail.stuck else Fate.UNKNOWN
    phi = float(trail.ends()[0, -1])
    return Ending(fate, f"at {machine.where(phi % cycle)} after {float(trail.t[-1]):.4g} s")
