"""A machine followed from a start to an end: run-up, run-down, load step, stall."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from flywheel import regime as cycles
from flywheel.faults import Fault, SceneError
from flywheel.following import Start, Watching
from flywheel.instant import Dynamics
from flywheel.machine import Machine
from flywheel.piecewise import ROUNDING
from flywheel.scene import Scene
from flywheel.simulation import moved
from flywheel.sizing import size
from flywheel.state import own_coordinate
from flywheel.transients.conditions import Until, until
from flywheel.transients.goals import Setting, at_rest, goals_of, limit_of, needed, settling
from flywheel.transients.record import Transient
from flywheel.transients.regime import Regime, regime_of, speed_at
from flywheel.transients.telling import told_of

_BALANCED = 64 * ROUNDING
_MORE = 1e-9  # current than balances the load: so that the machine moves on, and not back


@np.errstate(all="ignore")  # as in `flywheel.simulate`
def transient(
    machine: Machine | Scene,
    *,
    start: float | str = "rest",
    at: float | None = None,
    end: Until | str | float = "regime",
    drive: bool = True,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-9,
    watching: Watching | None = None,
) -> Transient:
    """Follow a machine from a start to an end: (J + I*) alpha + ½ dI*/dphi omega² = M*(phi, omega, t).

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        start: "rest", "regime" (its steady speed at the position), or a speed of the crank, rad/s (m/s of a slide).
        at: the position at the start, rad (m where a driver slides); 0, or where a stroke begins, if None.
        end: a time (s), or what `until` reads: "5 s", "10 turns", "200 rpm", "95 %" (of the regime's mean speed),
            "regime" (its speed at phi = 0 repeats to 1e-6), "stop". A machine that settles before it comes to a speed ends
            with that: `reason` is "limit".
        drive: whether the drive drives; without it the machine runs down.
        inertia: the flywheel's, kg m² at its own shaft; if None the scene's own, or the one that it is sized to.
        balance: value (SI) of the scene's unknown; if None the one that balances the regime.
        rtol: error allowed of position and speed.
        watching: is told time (s) and position (rad) as the motion goes on; a motion is followed twice at least, so that
            both begin again.

    Raises:
        SceneError: where the machine does not start, has no regime where one is asked for, or cannot be followed.

    A motion ends early where the machine stops, with its angle: `stall` where the drive pushes but is too weak, `stop`
    without one, or where it is off by then or brakes. At a step of load or drive (an expression of `t`) stepping starts
    afresh.

    >>> import math, flywheel
    >>> fan = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": "10 - omega"}, "flywheel": {"inertia": 0}}
    >>> run = transient(flywheel.load(fan), end="95 %")
    >>> run.reason, round(run.time, 7), round(2 * math.log(20), 7)
    ('share', 5.9914645, 5.9914645)

    """
    machine = machine if isinstance(machine, Machine) else Machine(machine)
    goal = end if isinstance(end, Until) else until(end) if isinstance(end, str) else Until("time", float(end))
    _check(machine, goal, start, rtol)
    setting = _setting(machine, drive, inertia, balance)
    begin = _started(setting, _start(setting, start, at))
    goals = list(goals_of(setting, begin, goal))
    settled = settling(setting, goal, rtol)
    motion = moved(setting.dynamics, begin, limit_of(setting, begin, goal), rtol, goals, settled, watching)
    return told_of(setting, motion, goal, rtol)


def run_up(
    machine: Machine | Scene,
    end: Until | str | float = "regime",
    *,
    at: float | None = None,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-9,
) -> Transient:
    """A machine from rest to its regime, or to another end.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        end: a time (s), or "5 s", "10 turns", "200 rpm", "95 %" (of the regime's mean speed), "regime".
        at: the position at the start, rad (m where a driver slides); 0, or where a stroke begins, if None.
        inertia: the flywheel's, kg m² at its own shaft; if None the scene's own, or the one that it is sized to.
        balance: value (SI) of the scene's unknown; if None the one that balances the regime.
        rtol: error allowed of position and speed.

    Raises:
        SceneError: where the machine does not start, or cannot be followed; see `transient`.

    """
    return transient(machine, start="rest", end=end, at=at, inertia=inertia, balance=balance, rtol=rtol)


def run_down(
    machine: Machine | Scene,
    end: Until | str | float = "stop",
    *,
    start: float | str = "regime",
    at: float | None = None,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-9,
) -> Transient:
    """A machine with its drive off, from its regime to its stop, or to another end.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        end: "stop", or a time (s), or "5 s", "10 turns", "200 rpm", "50 %" (of the regime's mean speed).
        start: "regime" (its steady speed at the position), or a speed of the crank, rad/s.
        at: the position at the start, rad; 0 if None.
        inertia: the flywheel's, kg m² at its own shaft; if None the scene's own, or the one that it is sized to.
        balance: value (SI) of the scene's unknown, where that is a load; if None the one that balances the regime.
        rtol: error allowed of position and speed.

    Raises:
        SceneError: where the machine has no regime to start from, or cannot be followed; see `transient`.

    """
    given: Any = {"at": at, "inertia": inertia, "balance": balance, "rtol": rtol}
    return transient(machine, start=start, end=end, drive=False, **given)


# -- before ----------------------------------------------------------------------------------------------------------


def _check(machine: Machine, goal: Until, start: float | str, rtol: float) -> None:
    faults, scene = [], machine.scene
    if scene.areas is not None:
        faults.append(Fault("areas", "a diagram of areas", "a machine to follow", "give mechanism, inertia or load instead"))
    if not 1e-13 <= rtol <= 0.1:
        faults.append(Fault("rtol", f"{rtol}", "a number from 1e-13 to 0.1"))
    if not 0.0 < goal.value < np.inf and goal.kind not in ("regime", "stop"):
        faults.append(Fault("until", f"{goal.value}", "a finite number above 0"))
    wanted = [goal.kind in ("regime", "share"), start == "regime"]
    if scene.stroke is not None and any(wanted):
        faults.append(Fault("until" if wanted[0] else "from", "a regime", "a time, a speed or the end of the stroke"))
    if goal.kind == "regime" and machine.depends_on_time:
        found = "a regime of a machine whose loads or drive depend on time"
        faults.append(Fault("until", found, "a time, a way or a speed", 'such as --until "5 s"'))
    if isinstance(start, str) and start not in ("rest", "regime"):
        faults.append(Fault("from", f'"{start}"', '"rest", "regime", or a speed'))
    elif not isinstance(start, str) and not 0.0 <= start < np.inf:
        faults.append(Fault("from", f"{start}", "a finite speed, at least 0"))
    if faults:
        raise SceneError(faults)


def _setting(machine: Machine, drive: bool, inertia: float | None, balance: float | None) -> Setting:
    scene = machine.scene
    own, doubt = _flywheel(scene) if inertia is None else (inertia, 0.0)
    steady, why = _regime(machine, own)
    balance, off = _balance(machine, steady) if balance is None else (balance, 0.0)
    if not drive:
        unknown = None if scene.unknown == "drive" else scene.unknown
        machine = Machine(replace(scene, drive=None, motor=None, unknown=unknown))
    return Setting(machine, Dynamics(machine, own * scene.flywheel_ratio**2, balance), own, balance, steady, why, doubt, off)


def _flywheel(scene: Scene) -> tuple[float, float]:
    """The flywheel that the scene gives, or is sized to, and its relative error."""
    if scene.irregularity is None:
        return scene.inertia or 0.0, 0.0
    try:
        sizing = size(scene, simulate=False)
        return sizing.flywheel.exact or 0.0, sizing.error.exact or 0.0
    except SceneError as error:
        found = f"an irregularity, to which no flywheel can be sized: {'; '.join(fault.found for fault in error.faults)}"
        advice = 'give its inertia: --flywheel "0.3 kg m^2" (in Python inertia=0.3)'
        raise SceneError([Fault("flywheel", found, "a flywheel to follow the machine with", advice)]) from error


def _regime(machine: Machine, inertia: float) -> tuple[Regime | None, str]:
    if machine.scene.stroke is not None:
        return None, "a stroke has no regime"
    if machine.depends_on_time:
        return None, "loads or drive that depend on time have no regime"
    try:
        return regime_of(machine, inertia), ""
    except SceneError as error:
        return None, "; ".join(str(fault) for fault in error.faults)


def _balance(machine: Machine, steady: Regime | None) -> tuple[float, float]:
    """The unknown's value, and its relative error."""
    if machine.scene.unknown is None:
        return 0.0, 0.0
    if steady is not None and steady.sizing.balance is not None:
        return steady.sizing.balance.value, steady.sizing.balance.error
    if machine.depends_on_speed or machine.depends_on_time:
        found = '"balance" with torques that depend on speed or time, and without a regime to balance'
        raise SceneError([Fault("balance", found, "a value", "give the unknown its value")])
    cycle = cycles.balanced(machine)
    return cycle.balance or 0.0, cycle.balance_error


def _start(setting: Setting, start: float | str, at: float | None) -> Start:
    scene = setting.machine.scene
    origin = scene.origin if at is None else at
    phi = origin if scene.stroke is None else float(own_coordinate(scene, np.asarray(origin, dtype=float)))
    if start == "regime":
        omega = float(speed_at(needed(setting).sizing, phi))
    else:
        omega = 0.0 if isinstance(start, str) else float(start)
    circuit = setting.dynamics.circuit
    current = circuit.current(setting.dynamics.ratio * omega) if circuit is not None and omega else 0.0
    return Start(phi, omega, float(current))


def _started(setting: Setting, begin: Start) -> Start:
    """The start; a SceneError for a machine that stays at rest, or goes back, when it is let go.

    A motor with inductance has no torque at first. Where the load would turn it back until then, it is held until the
    current is strong enough, and starts with that.
    """
    machine, dynamics = setting.machine, setting.dynamics
    if begin.omega > 0.0:
        return begin
    circuit = dynamics.circuit
    locked = begin if circuit is None else begin._replace(current=float(circuit.current(0.0)))
    moment, size_of = at_rest(dynamics, locked)
    if moment > _BALANCED * size_of:
        unfed = moment if circuit is None else at_rest(dynamics, begin)[0]
        return begin if unfed >= 0.0 else begin._replace(current=locked.current * (1 + _MORE) * unfed / (unfed - moment))
    if machine.depends_on_time and abs(moment) <= _BALANCED * size_of:
        return begin
    balanced = abs(moment) <= _BALANCED * size_of
    share = "M* = 0, so that nothing moves it" if balanced else f"M* = {moment:.6g} N m, which holds it or turns it back"
    found = f"a machine that does not start: at rest at {machine.where(begin.phi)} it has {share}"
    raise SceneError([Fault("from", found, "a moment that sets it going", _to_start(machine.scene, balanced))])


def _to_start(scene: Scene, balanced: bool) -> str:
    """What makes a machine start that does not."""
    if scene.drive is None:
        sliding = scene.reduction_element == "slide"
        speed = "0.1 m/s" if sliding else "200 rpm"
        regime = "" if scene.stroke is not None else "--from regime, or "
        return f'nothing drives it: start at a speed, {regime}--from "{speed}"'
    if balanced:
        return "start at another angle"
    return "the drive stalls there: start at another angle, or with a larger drive"
