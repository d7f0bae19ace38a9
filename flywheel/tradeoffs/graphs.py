"""One cycle by the whole bond graph: every element with its own law, nothing reduced to the crank beforehand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bondgraph.motion.simulation import Run
from flywheel.machine import Machine
from flywheel.moments import circuit_of
from flywheel.tradeoffs.shooting import NoAnswerError, Revolution, Revolve, Trial, summit
from flywheel.whole import followed

Array = NDArray[np.float64]

_LONGER = (1.02, 1.3, 3.0, 10.0)  # than the period expected: how long the motion is followed, until the cycle is over
_ARMATURE = "drive.motor.armature"


def whole(machine: Machine, rtol: float) -> Revolve:
    """Runs cycles by `bondgraph.simulate` on the machine's own graph."""
    scene = machine.scene
    cycle = scene.cycle

    def revolve(trial: Trial) -> Revolution:
        start = (0.0, trial.speed, trial.current)
        for longer in _LONGER:
            inertia = trial.inertia / scene.flywheel_ratio**2
            run = followed(machine, start, longer * trial.period, inertia, trial.balance, rtol)
            last = float(run.t[-1])
            if float(run.displacement("phi", np.array([last]))[0]) >= cycle:
                return _ended(run, cycle, circuit_of(scene) is not None)
        raise NoAnswerError("the machine does not get through its cycle")

    return revolve


def _ended(run: Run, cycle: float, with_current: bool) -> Revolution:
    def beyond(t: float) -> float:
        return float(run.displacement("phi", np.array([t]))[0]) - cycle

    def omega(times: Array) -> Array:
        return np.asarray(run.flow("crank", times))

    end = float(brentq(beyond, 0.0, float(run.t[-1]), xtol=1e-15 * float(run.t[-1]), rtol=1e-15))
    current = float(run.flow(_ARMATURE, np.array([end]))[0]) if with_current else 0.0
    times = np.append(run.t[run.t < end], end)
    greatest, least = (summit(omega, times, sign) for sign in (1.0, -1.0))
    return Revolution(float(omega(np.array([end]))[0]), current, greatest, least)
