"""The machine as it is followed, and what ends its motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.chain import Chain
from flywheel.faults import Fault, SceneError
from flywheel.following import ONSET, Goal, Passing, Start, Trail
from flywheel.instant import Anchor, Dynamics
from flywheel.machine import Machine
from flywheel.transients.conditions import Until
from flywheel.transients.regime import Regime

Array = NDArray[np.float64]

MOST_CYCLES = 1000.0
CREEPING = 1e-12  # of the speed at the start: slower than this it stands, or never will
_MOST_TIME = 20.0  # times as long as those cycles take at the machine's pace
_LOOKED_AT = np.array([0.1, 0.35, 0.6, 0.85])  # of a piece
_SEEN = 9  # speeds, and times, at which it is seen whether a drive pushes
_OFF = 0.01  # of the greatest push of a drive: with less it is off
_SETTLED = 1e-6  # of the speed: what is still missing to the regime
_SHORT = 1e-9  # the same, before a speed counts as out of reach
_NAMES = {"regime": "regime", "stop": "steady", "speed": "settled", "share": "settled"}


class Setting(NamedTuple):
    """A machine as it is followed, and what is known of it before, with relative errors of flywheel and balance."""

    machine: Machine
    dynamics: Dynamics
    inertia: float
    balance: float
    regime: Regime | None
    no_regime: str
    inertia_error: float = 0.0
    balance_error: float = 0.0


def needed(setting: Setting) -> Regime:
    """The regime, or a SceneError that says why there is none."""
    if setting.regime is None:
        raise SceneError([Fault("regime", setting.no_regime, "a machine that has a regime", "name a speed or a time")])
    return setting.regime


def target_of(setting: Setting, goal: Until) -> float:
    """The speed (rad/s) that is to be reached."""
    return goal.value * (needed(setting).speed if goal.kind == "share" else 1.0)


def at_rest(dynamics: Dynamics, begin: Start, t: float = 0.0) -> tuple[float, float]:
    """M* as the machine sets out from rest at t (s), and how large the moments in it are, there and over the cycle.

    It is M* just ahead of the start, before losses in meshes; friction is that of a motion forwards.
    """
    machine = dynamics.machine
    cycle = machine.scene.cycle
    phi = begin.phi if machine.scene.stroke is not None else begin.phi % cycle
    middle = float(machine.anchors(phi))
    place = Anchor(middle, ONSET * machine.pace, t, tuple(1.0 for _ in machine.stages))
    parts = dynamics.moments(np.array([phi]), place, np.zeros(1), np.full(1, t), begin.current)
    around = _around(machine)
    still = np.zeros_like(around)
    over = dynamics.moments(around, place._replace(phi=machine.anchors(around)), still, still + t, begin.current)
    largest = sum(float(np.abs(part).max()) for part in over.values())
    return float(sum(part[0] for part in parts.values())), largest + float(sum(abs(part[0]) for part in parts.values()))


def pushes(dynamics: Dynamics, trail: Trail, last: float) -> bool:
    """Whether at the end (s) the drive pushes forwards anywhere in the cycle, at rest or at a speed that the motion had.

    One that does not, as time has switched it off (to a hundredth of its greatest push) or it brakes, lets the machine
    stop; any other was too weak.
    """
    machine = dynamics.machine
    speeds = np.unique(np.append(np.abs(trail.ends()[1]), 0.0))
    speeds = speeds[np.linspace(0, speeds.size - 1, min(speeds.size, _SEEN)).astype(int)]
    axes = _around(machine), speeds, np.linspace(last, 0.0, _SEEN)
    phi, omega, time = (grid.ravel() for grid in np.meshgrid(*axes, indexing="ij"))
    place = Anchor(machine.anchors(phi), np.maximum(omega, ONSET * machine.pace), time, tuple(1.0 for _ in machine.stages))
    current = 0.0 if dynamics.circuit is None else dynamics.circuit.current(dynamics.ratio * omega)
    drive = dynamics.moments(phi, place, omega, time, current).get("drive", np.zeros(phi.size))
    return bool(drive[time == last].max() > _OFF * max(float(drive.max()), 0.0))


def _around(machine: Chain) -> Array:
    """Positions all over the cycle, or the stroke, in every piece of it."""
    return np.asarray((machine.restarts[:-1, None] + np.diff(machine.restarts)[:, None] * _LOOKED_AT).ravel())


def goals_of(setting: Setting, begin: Start, goal: Until) -> list[Goal]:
    """What ends the motion, beside time; stopping always does."""
    slow = CREEPING * begin.omega
    found = [Goal("stop", lambda t, phi, omega: omega - slow)]
    way = goal.value if goal.kind == "way" else MOST_CYCLES * setting.machine.scene.cycle
    if goal.kind != "time":
        name = "way" if goal.kind == "way" else "limit"
        found.append(Goal(name, lambda t, phi, omega: begin.phi + way - phi))
    if goal.kind in ("speed", "share"):
        target = target_of(setting, goal)
        sense = 1.0 if target > begin.omega else -1.0
        found.append(Goal(goal.kind, lambda t, phi, omega: sense * (target - omega)))
    return found


def settling(setting: Setting, goal: Until, rtol: float) -> Passing | None:
    """What tells, at the end of every cycle, whether the speed there has settled.

    Three speeds in turn tell the rate at which they settle, and with it how much is still missing. Where laws depend on
    time, a speed or a stop may still come.
    """
    if goal.kind not in _NAMES or (goal.kind != "regime" and setting.machine.depends_on_time):
        return None
    name = _NAMES[goal.kind]
    missing = _SHORT if name == "settled" else _SETTLED
    speeds: list[float] = []

    def passing(t: float, omega: float) -> str | None:
        speeds.append(omega)
        if len(speeds) < 3:
            return None
        before, last = speeds[-2] - speeds[-3], speeds[-1] - speeds[-2]
        if max(abs(last), abs(before)) <= 10 * rtol * omega:  # the steps' own error tells no rate
            return name
        rate = min(abs(last / before), 1.0) if before else 0.0
        return name if abs(last) <= missing * omega * (1.0 - rate) else None

    return passing


def limit_of(setting: Setting, begin: Start, goal: Until) -> float:
    """The time (s) at which a motion is given up, or that was asked for."""
    if goal.kind == "time":
        return goal.value
    machine = setting.machine
    pace = max(machine.pace, begin.omega) if setting.regime is None else setting.regime.speed
    return _MOST_TIME * MOST_CYCLES * machine.scene.cycle / pace
