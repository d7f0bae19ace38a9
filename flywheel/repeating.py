"""Cycles of a motion that come out as they went in: one is stepped, and stands for all that follow it.

Where the moment depends on position alone and its work over the cycle is zero, the speed at phi = 0 returns exactly. What
steps make of that is their own error: it is stated, and not carried on into the next cycle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import regime
from flywheel.chain import Chain
from flywheel.stepping import Step

Array = NDArray[np.float64]

FEWEST = 20  # cycles still to come, below which nothing is looked into
_ROUNDS = 8
_ROUNDING = 1e-13  # of the work exchanged: what its own quadrature leaves of a net work of zero


class Later:
    """A step's dense output, a time (s) later."""

    def __init__(self, dense: Callable[[Any], Array], time: float) -> None:
        self.dense, self.time = dense, time

    def __call__(self, t: Any) -> Array:
        """The states at times t."""
        return self.dense(t - self.time)


class Passed(NamedTuple):
    """The last cycle: its first stretch, when it began (s), and the state there."""

    first: int
    start: float
    state: Array


def source(step: Step) -> Callable[[Any], Array]:
    """The dense output that a step was taken from, its own or that of an earlier cycle."""
    return step.dense.dense if isinstance(step.dense, Later) else step.dense


def later(step: Step, time: float) -> Step:
    """The same step, a time (s) later."""
    return Step(Later(step.dense, time), step.start + time, step.end + time)


def returns(machine: Chain, balance: float) -> bool:
    """Whether the work of a cycle is zero, whatever the speed: with a value (SI) of the scene's unknown.

    True only where no load depends on speed or time, and the net work is no more than its own rounding.
    """
    scene = machine.scene
    if machine.depends_on_speed or machine.depends_on_time or scene.stroke is not None or len(machine.stages) > 1:
        return False
    cycle = regime.resolve(machine, machine.mesh)
    for _ in range(_ROUNDS):
        allowed = _ROUNDING * cycle.exchanged
        finer = None if cycle.errors.work <= allowed else regime.split(cycle, 0.0, allowed / cycle.errors.work)
        if finer is None:
            break
        cycle = regime.resolve(machine, finer)
    settled = cycle.balance is None or abs(cycle.balance - balance) <= _ROUNDING * abs(balance)
    return bool(settled and max(abs(cycle.net), cycle.errors.work) <= _ROUNDING * cycle.exchanged)
