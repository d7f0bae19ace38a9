"""A machine followed in time from a start to an end: run-up, run-down, load step, stall.

In order: the end of a motion (`until`), `transient` itself with its start, its goals and how it ended, the record of the
motion (`Transient`) and the errors of its figures.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.numerics import root
from flywheel.components.motors import Motor, Started
from flywheel.components.motors.starting import as_started
from flywheel.machine.dynamics import MachineDynamics, StartState, Trail, dynamics_of
from flywheel.machine.machine import Machine, circuit_of
from flywheel.motions.motion import (
    Energy,
    Indices,
    Motion,
    Peak,
    Samples,
    Transient,
    column,
    energy_of,
    highest,
    peaks_of,
    sampled,
    samples_of,
    scales_of,
    speed_at,
    states_at,
)
from flywheel.motions.simulation import Regime, actual, motion_from, regime_of
from flywheel.motions.starting import drive_acts, inverter_trips, moment_at_rest, start_heat, within
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError, coordinate_text, show
from flywheel.numerics.units import QuantityError, parse_quantity
from flywheel.regime import turning_moment
from flywheel.regime.free_motion import (
    Goal,
    Passing,
    Watching,
    effort_of,
    end_of_stroke,
    friction_of,
    neighbours,
    rest_cause,
    straight,
)
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import own_coordinate
from flywheel.scene.scene import TURN, Scene
from flywheel.sizing.drive import trip_messages
from flywheel.sizing.sizing import size

Array = NDArray[np.float64]

# -- what ends a motion -----------------------------------------------------------------------------------------------

Kind = Literal["time", "way", "speed", "share", "regime", "stop"]
_DIMENSIONS: tuple[tuple[Kind, str, bool | None], ...] = (
    ("time", "time", None),
    ("way", "angle", False),
    ("way", "length", True),
    ("speed", "speed", False),
    ("speed", "velocity", True),
)
"""Kinds of ends of a motion by their dimension, and true if the driver then slides."""
_TURNS = re.compile(r"\s*([-+.\deE]+)\s*turns?\s*")
_SHARE = re.compile(r"\s*([-+.\deE]+)\s*%\s*")
_EXPECTED = '"regime", "stop", or a time, a way, a speed or a share of the regime\'s, such as "5 s", "90 deg" or "95 %"'


class Until(NamedTuple):
    """The end of a motion: time (s), way (rad), speed (rad/s), share of the regime's speed; m and m/s where a driver slides.

    `sliding` is true for a travel or a speed of a driver that slides, false of a crank; None if a number leaves it open.
    """

    kind: Kind
    value: float = 0.0
    sliding: bool | None = None

    def words(self, sliding: bool) -> str:
        """The end in words, with its unit."""
        way, speed = ("m", "m/s") if sliding else ("rad", "rad/s")
        if self.kind == "way" and not sliding:
            return f"a travel of {self.value:.6g} rad ({self.value / TURN:.6g} turns)"
        return {
            "time": f"{self.value:.6g} s",
            "way": f"a travel of {self.value:.6g} {way}",
            "speed": f"{self.value:.6g} {speed}",
        }.get(self.kind, f"{100 * self.value:.6g} % of its regime's speed")


def until(text: str) -> Until:
    """End of a motion by its text; a SceneError where the text is not understood.

    >>> until("5 s"), until("2 turns").kind, until("95 %"), until("regime").kind
    (Until(kind='time', value=5.0, sliding=None), 'way', Until(kind='share', value=0.95, sliding=None), 'regime')
    """
    word = text.strip()
    if word == "regime":
        return Until("regime")
    if word == "stop":
        return Until("stop")
    goal = None
    with suppress(ValueError):
        if match := _TURNS.fullmatch(text):
            goal = Until("way", float(match[1]) * TURN, False)
        elif match := _SHARE.fullmatch(text):
            goal = Until("share", float(match[1]) / 100)
    try:
        float(text)  # a number without a unit could be anything
    except ValueError:
        for kind, dimension, sliding in _DIMENSIONS:
            with suppress(QuantityError):
                goal = goal or Until(kind, parse_quantity(text, dimension), sliding)
    if goal is None or not 0.0 < goal.value < float("inf"):
        raise SceneError([Fault("until", show(text), _EXPECTED)])
    return goal


# -- the motion -------------------------------------------------------------------------------------------------------

MOST_CYCLES = 1000.0
SHARE = 0.95
_MOST_TIME = 20.0  # times the duration of those cycles at the machine's own speed
_CREEPING = 1e-12  # of the speed at the start: a slower machine counts as at rest
_SUDDEN = 1e-6  # of the time elapsed: a machine that would stop within this has stopped
_SETTLED = 1e-6  # of the speed: distance from the regime
_SHORT = 1e-9  # the same, for a speed to count as out of reach
_SHORT_OF_IT = ("stop", "stall", "creep", "stroke")
_NAMES = {"regime": "regime", "stop": "steady", "speed": "settled", "share": "settled"}
_BALANCED = 64 * ROUNDING


@np.errstate(all="ignore")  # as in `flywheel.simulate`
def transient(
    machine: Machine | Scene,
    *,
    start: float | str = "rest",
    at: float | None = None,
    end: Until | str | float | None = None,
    drive: bool = True,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-9,
    watching: Watching | None = None,
) -> Transient:
    """Follows a machine from a start to an end: (J + I*) alpha + ½ dI*/dphi omega² = M*(phi, omega, t).

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        start: "rest", "regime" (its steady speed at the position), or a speed of the crank, rad/s (m/s of a slide).
        at: the position at the start, rad (m where a driver slides); 0, or where a stroke begins, if None.
        end: a time (s), or a text for `until`: "5 s", "10 turns", "90 deg" (or "50 mm") of the driver's way, "200 rpm",
            "95 %" (of the regime's mean speed), "regime" (its speed at phi = 0 repeats to 1e-6), "stop". If the machine
            settles before it reaches the speed, the motion ends there: `reason` is "limit". If None the regime; without a
            drive, or on a stroke, a stop.
        drive: False for a run-down without the drive.
        inertia: the flywheel's, kg m² at its own shaft; if None the scene's own, or the one that it is sized to; 0 if the
            scene has no flywheel.
        balance: value (SI) of the scene's unknown; if None the one that balances the regime.
        rtol: error allowed of position and speed.
        watching: called with time (s) and position (rad) as the motion continues; a motion is followed at least twice, so
            that both begin again.

    Raises:
        SceneError: if the machine does not start, has no regime although one is required, or cannot be followed.

    For a time, the machine is followed through rests and reversals; at rest dry laws hold it until
    a load drives it away (forwards, if both directions are possible). With any other end the motion ends early if the
    machine stops, with its angle: `stall` if the drive pushes but is too weak, `stop` without a drive, or if the drive is
    off by then or brakes. Stepping restarts at a step of load or drive (an expression of `t`).

    >>> import math, flywheel
    >>> fan = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": "10 - omega"}, "flywheel": {"inertia": 0}}
    >>> run = transient(flywheel.load(fan), end="95 %")
    >>> run.reason, round(run.time, 7), round(2 * math.log(20), 7)
    ('share', 5.9914645, 5.9914645)

    """
    machine = actual(machine)
    if end is None:
        end = "regime" if drive and machine.scene.stroke is None else "stop"
    goal = end if isinstance(end, Until) else until(end) if isinstance(end, str) else Until("time", float(end))
    _check(machine, goal, start, rtol)
    sized = goal.kind in ("regime", "share") or start == "regime" or (machine.scene.unknown is not None and balance is None)
    circuit = circuit_of(machine.scene)
    dear = machine.has_joint_friction or (circuit is not None and len(circuit.names) > 1)
    setting = _setting(machine, drive, inertia, balance, sized or not dear)
    if goal.kind == "stop" and machine.has_joint_friction and not _is_pressed(setting.machine):
        defect = (
            "a stop of a machine whose joints carry inertia forces alone: friction that falls with the speed never stops it"
        )
        raise SceneError([Fault("until", defect, "a time, a way or a speed", 'such as --until "5 s", or give it [gravity]')])
    goes_on = goal.kind == "time"  # through rests, back and forth
    starting = None if setting.motor is None or start == "regime" else setting.motor.start
    if starting is not None:
        setting = setting.started(())
    begin = _start(setting, start, at, goes_on)
    obstacle = ""
    if starting is not None:
        setting, obstacle = _switched(setting, begin, goal, rtol, watching)
    goals, limit = _goals(setting, begin, goal)
    motion = motion_from(setting.dynamics, begin, limit, rtol, goals, _settling(setting, goal, rtol), watching)
    trail = motion.trail
    assert trail is not None
    if not goes_on and all(stretch.anchor.direction == 0.0 for stretch in trail.stretches):
        raise SceneError([_never_started(setting, trail)])
    reason, ended = _ending(setting, trail, motion, goal, limit)
    regime, scene = setting.regime, setting.machine.scene
    if reason in _SHORT_OF_IT and goal.kind not in ("regime", "stop"):
        ended = f"{ended}; it did not reach {goal.words(scene.reduction_element == 'slide')}"
    messages = []
    if motion.error > rtol:
        messages.append(f"rtol {rtol:.1g} not reached: the motion is good to {motion.error:.2g} (estimated, relative)")
    if begin.omega == 0.0 and trail.stretches[0].anchor.direction == 0.0 and not trail.stuck:
        rest = next((k for k, stretch in enumerate(trail.stretches) if stretch.anchor.direction), len(trail.stretches))
        messages.append(f"held at rest by {friction_of(setting.machine)} for {trail.t[rest]:.6g} s")
    messages += _reversal(setting, trail, goes_on)
    if obstacle:
        messages.append(obstacle)
    messages += trip_messages(inverter_trips(trail), ramped=True)
    expected = scene.has_flywheel or goal.kind == "regime"
    if regime is None and scene.stroke is None and expected and not _is_driven_freely(scene):
        messages.append(f"no regime: {setting.no_regime}")
    return Transient(
        scene=scene,
        motion=motion._replace(phi=motion.phi + scene.origin) if scene.origin else motion,
        ended=ended,
        reason=reason,
        inertia=setting.inertia,
        balance=setting.balance,
        regime_speed=None if regime is None else regime.speed,
        time_to_regime=None if regime is None else trail.time_to(SHARE * regime.speed),
        rtol=rtol,
        messages=tuple(messages),
        setting_errors={
            "flywheel": setting.inertia * setting.inertia_error,
            "balance": None if scene.unknown is None else abs(setting.balance) * setting.balance_error,
            "regime_speed": None if regime is None else regime.speed * (regime.sizing.error.simulation or 0.0),
        },
        from_regime=start == "regime",
    )


def run_up(
    machine: Machine | Scene,
    end: Until | str | float | None = None,
    *,
    at: float | None = None,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-9,
) -> Transient:
    """A machine from rest to its regime, or to another end; all arguments and faults are those of `transient`."""
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
    """A machine with its drive off, from its regime to its stop, or to another end; as `transient` with `drive=False`."""
    options: Any = {"at": at, "inertia": inertia, "balance": balance, "rtol": rtol}
    return transient(machine, start=start, end=end, drive=False, **options)


def _reversal(setting: TransientSetting, trail: Trail, goes_on: bool) -> list[str]:
    """Messages on a driven machine that reverses: the place, and the opposing moment."""
    states, machine = trail.ends(), setting.machine
    back = np.flatnonzero(states[1] < -_CREEPING * np.abs(states[1]).max())
    if not goes_on or machine.scene.drive is None or not back.size:
        return []
    k, last = int(back[0]) - 1, np.zeros(1)
    before = np.flatnonzero(states[1, : k + 1] > 0.0)
    if before.size:
        step = trail.stretches[k].step
        last = np.array([root(lambda t: float(step.dense(t)[1]), step.start, step.end)])
    at = trail.states(last, np.array([k]))[:, 0]
    stands = StartState(float(at[0]), 0.0, tuple(at[3:].tolist()))
    effort, unit = effort_of(machine.scene)
    moment = f"{moment_at_rest(setting.dynamics, stands, float(last[0]))[0]:.6g} {unit}"
    if not before.size:
        return [f"goes back from its start, where {effort} is {moment}"]
    phi = within(machine, float(at[0]))
    return [f"stalled at {machine.where(phi)} after {last[0]:.6g} s and turned back: {effort} at rest there is {moment}"]


def _check(machine: Machine, goal: Until, start: float | str, rtol: float) -> None:
    faults, scene = [], machine.scene
    if scene.areas is not None:
        faults.append(Fault("areas", "a diagram of areas", "a machine to follow", "give mechanism, inertia or load instead"))
    if not 1e-13 <= rtol <= 0.1:
        faults.append(Fault("rtol", f"{rtol}", "a number from 1e-13 to 0.1"))
    if not 0.0 < goal.value < np.inf and goal.kind not in ("regime", "stop"):
        faults.append(Fault("until", f"{goal.value}", "a finite number above 0"))
    demands = [goal.kind in ("regime", "share"), start == "regime"]
    if scene.stroke is not None and any(demands):
        faults.append(Fault("until" if demands[0] else "from", "a regime", "a time, a speed or the end of the stroke"))
    if goal.sliding is not None and goal.sliding != (scene.sliding):
        kind = "a way" if goal.kind == "way" else "a speed"
        defect = f"{kind} of a driver that turns, where it slides"
        if goal.sliding:
            defect = f"{kind} of a driver that slides, where it turns"
        faults.append(Fault("until", defect, _EXAMPLES[goal.kind, not goal.sliding]))
    if goal.kind == "regime" and _is_driven_freely(scene):
        defect = f"a regime, although no torque fixes the speed of this machine: {_FREELY}"
        expected = 'a way, a speed or a time, such as --until "2 turns", "90 deg", "20 rad/s" or "5 s"'
        faults.append(Fault("until", defect, expected))
    elif goal.kind == "regime" and machine.depends_on_time:
        defect = "a regime of a machine whose loads or drive depend on time"
        faults.append(Fault("until", defect, "a time, a way or a speed", 'such as --until "5 s"'))
    if isinstance(start, str) and start not in ("rest", "regime"):
        faults.append(Fault("from", f'"{start}"', '"rest", "regime", or a speed'))
    elif not isinstance(start, str) and not 0.0 <= start < np.inf:
        faults.append(Fault("from", f"{start}", "a finite speed, at least 0"))
    if faults:
        raise SceneError(faults)


_EXAMPLES = {
    ("way", False): 'a way such as "90 deg"',
    ("way", True): 'a way such as "50 mm"',
    ("speed", False): 'a speed such as "200 rpm"',
    ("speed", True): 'a speed such as "0.3 m/s"',
}
_FREELY = "neither regime.speed nor a torque that depends on speed"


def _is_pressed(machine: Machine) -> bool:
    """Tests whether anything but inertia acts on a machine: weights, loads, a drive, springs, dampers."""
    scene = machine.scene
    return bool(scene.gravity or machine.efforts or scene.springs or scene.dampers)


def _is_driven_freely(scene: Scene) -> bool:
    """Tests whether a machine that turns in cycles has neither a speed of its own nor a required one: it has no regime."""
    return scene.stroke is None and not scene.has_speed and scene.unknown is None


class TransientSetting(NamedTuple):
    """A machine to follow with its regime, and relative errors of flywheel and balance."""

    machine: Machine
    dynamics: MachineDynamics
    inertia: float
    balance: float
    regime: Regime | None
    no_regime: str
    inertia_error: float
    balance_error: float

    def needed(self) -> Regime:
        """The regime, or a SceneError with the reason why there is none."""
        if self.regime is None:
            raise SceneError([Fault("regime", self.no_regime, "a machine that has a regime", "name a speed or a time")])
        return self.regime

    @property
    def motor(self) -> Motor | None:
        """The drive's motor in its normal connection."""
        motor = self.machine.scene.motor
        return None if motor is None else as_started(motor).own

    def started(self, times: Sequence[float]) -> TransientSetting:
        """The same with its motor in its starting connections, switched at `times` (s) so far."""
        scene, motor = self.machine.scene, self.motor
        assert motor is not None
        assert motor.start is not None
        assert scene.drive is not None
        start = Started.of(motor, motor.start, times)
        machine = Machine(replace(scene, drive=scene.drive._replace(law=start.law()), motor=start))
        return self._replace(machine=machine, dynamics=dynamics_of(machine, self.dynamics.inertia, self.dynamics.balance))

    def target(self, goal: Until) -> float:
        """The speed (rad/s) that is to be reached."""
        return goal.value * (self.needed().speed if goal.kind == "share" else 1.0)


def _setting(machine: Machine, drive: bool, inertia: float | None, balance: float | None, regimes: bool) -> TransientSetting:
    """The given flywheel, the scene's or the sized one; the regime with it; the unknown's value.

    regimes: true to search for the regime.
    """
    scene = machine.scene
    inertia_error = balance_error = 0.0
    if inertia is None and scene.irregularity is None and not scene.limits:
        inertia = scene.inertia or 0.0
    elif inertia is None:
        try:
            sizing = size(scene, simulate=False)
            inertia, inertia_error = sizing.flywheel.exact or 0.0, sizing.error.exact or 0.0
        except SceneError as error:
            why = "; ".join(map(str, error.faults))
            defect = f"an irregularity, to which no flywheel can be sized ({why})"
            if scene.limits:
                defect = f"limits, for which no flywheel can be sized ({why})"
            advice = 'give its inertia: --flywheel "0.3 kg m^2" (in Python inertia=0.3)'
            raise SceneError([Fault("flywheel", defect, "a flywheel to follow the machine with", advice)]) from error
    regime, no_regime = None, ""
    if scene.stroke is not None:
        no_regime = "a stroke has no regime"
    elif _is_driven_freely(scene):
        no_regime = _FREELY
    elif machine.depends_on_time:
        no_regime = "loads or drive that depend on time have no regime"
    elif not regimes:
        what = "friction in joints" if machine.has_joint_friction else "the fluxes of its motor"
        no_regime = f"not sought, as it takes long with {what}; --until regime finds it"
    else:
        try:
            regime = regime_of(machine, inertia)
        except SceneError as error:
            no_regime = "; ".join(str(fault) for fault in error.faults)
    if balance is None and scene.unknown is None:
        balance = 0.0
    elif balance is None and regime is not None and regime.sizing.balance is not None:
        balance, balance_error = regime.sizing.balance.value, regime.sizing.balance.error
    elif balance is None:
        if machine.depends_on_speed or machine.depends_on_time:
            defect = '"balance" with torques that depend on speed or time, and without a regime to balance'
            raise SceneError([Fault("balance", defect, "a value", "give the unknown its value")])
        cycle = turning_moment.balanced(machine_of(machine))
        balance, balance_error = cycle.balance or 0.0, cycle.balance_error
    if not drive:
        unknown = None if scene.unknown == "drive" else scene.unknown
        machine = Machine(replace(scene, drive=None, motor=None, unknown=unknown))
    dynamics = dynamics_of(machine, inertia * scene.flywheel_ratio**2, balance)
    return TransientSetting(machine, dynamics, inertia, balance, regime, no_regime, inertia_error, balance_error)


def _switched(
    setting: TransientSetting, begin: StartState, goal: Until, rtol: float, watching: Watching | None
) -> tuple[TransientSetting, str]:
    """A machine whose motor goes through its connections at known times, and a message if one does not end.

    A switch at a speed is located by following the motion up to it: its time has an error of rtol.
    """
    motor, times = setting.motor, list[float]()
    assert motor is not None
    assert motor.start is not None
    for k, connection in enumerate(motor.start.connections):
        last, until = times[-1] if times else 0.0, connection.until
        if until.time is not None:
            times.append(max(until.time, last))
            continue
        assert until.speed is not None
        level = until.speed / setting.dynamics.ratio
        if begin.omega < level:
            here = setting.started(times)
            goals, limit = _goals(here, begin, goal)
            run = motion_from(
                here.dynamics,
                begin,
                limit,
                rtol,
                [straight("switch", 1, level, -1.0), *goals],
                _settling(here, goal, rtol),
                watching,
            )
            if run.trail is None or run.trail.goal != "switch":
                where = f"connection {k + 1} of {len(motor.start.connections)} of its start ({motor.start.title})"
                return here, f"the motor stays in {where}: its shaft does not come to {until} in this motion"
            last = max(last, float(run.t[-1]))
        times.append(last)
    return setting.started(times), ""


def _start(setting: TransientSetting, start: float | str, at: float | None, goes_on: bool) -> StartState:
    """The start; a SceneError for a released machine that stays at rest, or moves backwards without end.

    goes_on: true if it is followed through rests and reversals.
    """
    machine, dynamics, circuit = setting.machine, setting.dynamics, setting.dynamics.circuit
    scene = machine.scene
    origin = scene.origin if at is None else at
    phi = origin if scene.stroke is None else float(own_coordinate(scene, np.asarray(origin, dtype=float)))
    if start == "regime":
        omega = float(speed_at(setting.needed().sizing, phi))
    else:
        omega = 0.0 if isinstance(start, str) else float(start)
    begin = StartState(phi, omega, _own_states(setting, phi, omega, start == "regime"))
    start_of_motor = None if setting.motor is None else setting.motor.start
    later = start_of_motor is not None and any(one.until.time is not None for one in start_of_motor.connections)
    if omega > 0.0 or machine.depends_on_time or later or (circuit is not None and dynamics.holds):
        return begin
    if dynamics.holds:
        return _start_at_rest(setting, begin, goes_on)
    locked = begin if circuit is None else begin._replace(states=circuit.steady(0.0))
    moment, scale = moment_at_rest(dynamics, locked)
    balanced = abs(moment) <= _BALANCED * scale
    if (moment > 0.0 or goes_on) and not balanced:
        return begin
    effort, unit = effort_of(scene)
    share = f"{effort} = {moment:.6g} {unit}, which holds it or turns it back"
    if balanced:
        share = f"{effort} = 0 {unit}, so that nothing moves it"
    defect = f"a machine that does not start: at rest at {machine.where(begin.phi)} it has {share}"
    advice = (
        "start at another angle" if balanced else "the drive stalls there: start at another angle, or with a larger drive"
    )
    raise SceneError([_unmoved(scene, defect, advice)])


def _unmoved(scene: Scene, defect: str, advice: str) -> Fault:
    """The fault of a machine that no moment starts."""
    if scene.drive is None:
        speed = "0.1 m/s" if scene.sliding else "200 rpm"
        advice = f'nothing drives it: start at a speed, --from regime, or --from "{speed}"'
        if scene.stroke is not None or _is_driven_freely(scene):
            advice = f'nothing drives it: start at a speed, --from "{speed}"'
    return Fault("from", defect, "a moment that sets it going", advice)


def _own_states(setting: TransientSetting, phi: float, omega: float, of_regime: bool) -> tuple[float, ...]:
    """A motor's own states at the start: those of the regime, steady at the speed (rad/s), or just switched on."""
    dynamics, circuit = setting.dynamics, setting.dynamics.circuit
    if circuit is None:
        return ()
    if of_regime:
        return states_at(setting.needed().sizing, phi)
    return tuple(float(state) for state in circuit.steady(dynamics.ratio * omega)) if omega else circuit.unfed


def _start_at_rest(setting: TransientSetting, begin: StartState, goes_on: bool) -> StartState:
    """The start of a machine that dry friction may hold, where nothing changes with time; goes_on: as for `_start`."""
    machine, dynamics = setting.machine, setting.dynamics
    phi = within(machine, begin.phi)
    forwards, backwards = dynamics.from_rest(phi, *neighbours(machine, phi), np.zeros(1))[:, 0].tolist()
    least = _BALANCED * max(abs(forwards), abs(backwards))
    if forwards > least or (goes_on and backwards < -least):
        return begin
    where, friction = machine.where(phi), friction_of(machine)
    if backwards < -least:
        defect = f"a machine that moves backwards: at {where} it is at rest, and {friction} does not hold it"
        advice = 'start at another angle, with a larger drive, or follow it for a time: --until "5 s"'
    else:
        defect = f"a machine that does not start: at rest at {where} {rest_cause(dynamics, phi, 0.0, begin.states)}"
        advice = "a larger drive, less friction, or a start at a speed"
    raise SceneError([_unmoved(machine.scene, defect, advice)])


def _never_started(setting: TransientSetting, trail: Trail) -> Fault:
    """The fault of a machine that dry friction holds at rest to the end of the time followed."""
    machine, last = setting.machine, trail.ends()[:, -1]
    phi = within(machine, float(last[0]))
    cause = rest_cause(setting.dynamics, phi, float(trail.t[-1]), last[3:].tolist())
    defect = f"a machine that does not start within {trail.t[-1]:.6g} s: at rest at {machine.where(phi)} {cause}"
    return _unmoved(machine.scene, defect, "a larger drive, less friction, or a start at a speed")


def _goals(setting: TransientSetting, begin: StartState, goal: Until) -> tuple[list[Goal], float]:
    """End conditions of the motion, with a stop unless a time is given; and that time (s), or the limit of the search.

    A machine that starts from rest may go back at first: a stop is then one beyond the start.
    """
    if goal.kind == "time":
        return [], goal.value
    machine, slow = setting.machine, _CREEPING * begin.omega
    events = [straight("stop", 1, -slow, 1.0)]
    if begin.omega == 0.0 and (machine.depends_on_time or setting.dynamics.circuit is not None):
        events = [
            Goal("stop", lambda t, phi, omega: np.where(phi > begin.phi, omega, 1.0)),
            straight("back", 0, machine.scene.cycle - begin.phi, 1.0),
        ]
    way = goal.value if goal.kind == "way" else MOST_CYCLES * machine.scene.cycle
    events.append(straight("way" if goal.kind == "way" else "limit", 0, begin.phi + way, -1.0))
    if goal.kind in ("speed", "share"):
        target = setting.target(goal)
        sense = 1.0 if target > begin.omega else -1.0
        events.append(straight(goal.kind, 1, sense * target, -sense))
    speed = max(machine.typical_speed, begin.omega) if setting.regime is None else setting.regime.speed
    return events, _MOST_TIME * MOST_CYCLES * machine.scene.cycle / speed


def _settling(setting: TransientSetting, goal: Until, rtol: float) -> Passing | None:
    """Check, at the end of every cycle, whether the speed there has settled.

    Three successive speeds give the rate at which they settle, and with it the remaining change. Where laws depend on time,
    a speed or a stop may still come.
    """
    motor = setting.machine.scene.motor
    switched = max(() if motor is None else as_started(motor).times, default=0.0)
    timed = setting.machine.depends_on_time and (motor is None or not as_started(motor).connections)
    if goal.kind not in _NAMES or (goal.kind != "regime" and timed):
        return None
    name = _NAMES[goal.kind]
    missing = _SHORT if name == "settled" else _SETTLED
    speeds: list[float] = []

    def passing(t: float, omega: float) -> str | None:
        if t < switched:  # a motor's next connection is still to come
            return None
        speeds.append(omega)
        if len(speeds) < 3:
            return None
        before, last = speeds[-2] - speeds[-3], speeds[-1] - speeds[-2]
        if max(abs(last), abs(before)) <= 10 * rtol * omega:  # the steps' own error tells no rate
            return name
        rate = min(abs(last / before), 1.0) if before else 0.0
        return name if abs(last) <= missing * omega * (1.0 - rate) else None

    return passing


def _ending(setting: TransientSetting, trail: Trail, motion: Motion, goal: Until, limit: float) -> tuple[str, str]:
    """Description of a motion's end: in one word, and in a sentence."""
    machine, scene = setting.machine, setting.machine.scene
    last, phi, omega = float(trail.t[-1]), float(motion.phi[-1]), float(motion.omega[-1])
    stroke = scene.stroke
    place = machine.where(phi % scene.cycle) if stroke is None else coordinate_text(phi + scene.origin, stroke.sliding)
    at, turns = f"at {place} after {last:.6g} s", (phi - trail.start.phi) / TURN

    sliding = scene.sliding
    unit, (effort, unit_of_effort) = "m/s" if sliding else "rad/s", effort_of(scene)

    def speed(omega: float) -> str:
        return f"{omega:.6g} {unit}" + ("" if sliding else f" ({omega * 60 / TURN:.6g} rpm)")

    if trail.goal == "back":
        return "stall", f"turned back by its load: {turns:.6g} turns {at}, at {speed(omega)}"
    at_rest = trail.stretches[-1].anchor.direction == 0.0 and not np.all(
        [stretch.anchor.direction == 0.0 for stretch in trail.stretches]
    )
    if at_rest:
        began = max(k for k, stretch in enumerate(trail.stretches) if stretch.anchor.direction != 0.0)
        last = float(trail.t[began + 1])
        at = f"at {place} after {last:.6g} s"
    if trail.stuck or at_rest or trail.goal == "stop":
        acceleration = abs(float(sampled(trail, np.array([last])).acceleration[0]))
        if trail.start.omega > 0.0 and omega > 0.0 and omega > _SUDDEN * last * acceleration:
            return (
                "creep",
                f"never stops, because it is braked only by torques that grow with speed: {omega:.3g} {unit} {at}",
            )
        states = trail.states(np.array([last]))
        why = ""
        if trail.stuck or setting.dynamics.holds:
            why = f": {_rough_rest(setting.dynamics, trail, states[:, 0], last)}"
        if scene.drive is None:
            return "stop", f"stopped {at}{why}"
        if not drive_acts(setting.dynamics, trail, last):
            return "stop", f"stopped {at}, where its drive no longer pushes it on{why}"
        if why:
            return "stall", f"stalled {at}{why}"
        stall = StartState(float(states[0, 0]), 0.0, tuple(states[3:, 0].tolist()))
        moment, _ = moment_at_rest(setting.dynamics, stall, last)
        left = f"{effort} at rest is {moment:.6g} {unit_of_effort}"
        if any(stage.efficiency < 1.0 for stage in machine.stages):
            left = f"{effort} at rest is {moment:.6g} {unit_of_effort}, before losses in meshes"
        return "stall", f"stalled {at}: {left}"
    if stroke is not None and trail.goal is None and last < limit:
        return "stroke", end_of_stroke(scene, phi + scene.origin, last)
    if trail.goal == "settled":
        return "limit", f"settled to its regime without reaching {speed(setting.target(goal))}: {speed(omega)} {at}"
    if trail.goal == "limit" or (trail.goal is None and goal.kind != "time"):
        end = {"regime": "its regime", "stop": "a stop"}.get(goal.kind, "its end")
        return "limit", f"did not reach {end} within {turns:.6g} turns and {last:.6g} s"
    if trail.goal == "steady":
        return "limit", f"does not slow down to a stop: {omega:.6g} {unit} {at}, as a cycle before"
    if trail.goal == "regime":
        return "regime", f"settled to its regime after {last:.6g} s, {turns:.6g} turns"
    if trail.goal in ("speed", "share"):
        return trail.goal, f"reached {speed(omega)} {at}"
    if setting.dynamics.holds and omega == 0.0 and trail.goal is None:
        state = trail.states(np.array([last]))[:, 0]
        return "time", f"ended {at}, at rest: {_rough_rest(setting.dynamics, trail, state, last)}"
    return trail.goal or "time", f"ended {at}, at {omega:.6g} {unit}"


def _rough_rest(dynamics: MachineDynamics, trail: Trail, state: Array, last: float) -> str:
    """Description of a machine with rough joints at the end of its motion: at rest by friction, or about to move."""
    machine, own = dynamics.machine, state[3:].tolist()
    phi = within(machine, float(state[0]))
    forwards, backwards = dynamics.from_rest(phi, *neighbours(machine, phi), np.array([last]), own)[:, 0].tolist()
    if trail.stuck or not (forwards > 0.0 or backwards < 0.0):
        return rest_cause(dynamics, phi, last, own)
    if forwards > 0.0:
        return f"{friction_of(machine)} does not hold it there, and it would move on"
    return f"{friction_of(machine)} does not hold it there, and it would turn back"


# -- the record -------------------------------------------------------------------------------------------------------


# -- errors -----------------------------------------------------------------------------------------------------------

_COLUMNS = {"speed": "omega", "torque": "drive", "power": "power", "current": "current"}


@np.errstate(all="ignore")  # of a figure without a scale nothing is known
def estimates(transient: Transient) -> dict[str, Any]:
    """Errors in the figures' own units, by the names of the JSON; None without a figure, or where its error is unknown.

    They compare the motion with the previous run, of greater tolerance, and add the effect of the error of position and
    speed. They hold for the flywheel and the balance as printed, whose own errors are given with them.
    """
    motion, energy = transient.motion, transient.energy
    fine, other, share = motion.trail, _rough(motion), motion.share
    assert fine is not None
    (samples, owners), (before, sides) = transient.samples, samples_of(other)
    way, fastest = scales_of(samples.phi, samples.omega, fine.dynamics.machine.scene)
    position, speed, time = motion.error * way, motion.error * fastest, motion.error * transient.time
    peaks: dict[str, Any] = dict.fromkeys(_COLUMNS)
    old = peaks_of(other, before, sides)
    for name, key in _COLUMNS.items():
        now, then = getattr(transient.peaks, name), getattr(old, name)
        if now is not None and then is not None:
            value = share * abs(now.value - then.value) + motion.error * float(np.abs(getattr(samples, key)).max())
            peaks[name] = {"value": value, "time": time + _peak_width(fine, key, samples, owners, now, value)}
    late, when, steady_speed = None, transient.time_to_regime, transient.regime_speed
    if when == 0.0:
        late = 0.0
    elif when is not None and steady_speed is not None:  # what speed and regime are off by, over the acceleration there
        then = other.time_to(SHARE * steady_speed)
        acceleration = abs(float(sampled(fine, np.array([when])).acceleration[0]))
        off = (speed + SHARE * (transient.setting_errors["regime_speed"] or 0.0)) / acceleration
        late = None if then is None else share * abs(when - then) + off + time
    works, heat = energy_of(other, before.kinetic), transient.start_heat
    scale = max(float(samples.kinetic.max()), abs(energy.drive), energy.meshes, *map(abs, energy.works.values()), 1e-300)

    def of_energy(now: float | None, then: float | None) -> float | None:
        if now is None or then is None:
            return None
        return share * abs(now - then) + (2 * motion.error + energy.residual) * max(scale, abs(now))

    heats = [name for name in Energy._fields if name not in ("works", "residual")]
    energies: dict[str, Any] = {name: of_energy(getattr(energy, name), getattr(works, name)) for name in heats}
    return {
        **transient.setting_errors,
        "end": {"t": time, "phi": position, "omega": 0.0 if transient.omega == 0.0 else speed},
        "way": position,
        "turns": position / (2 * np.pi),
        "time_to_95_percent": late,
        "peaks": peaks,
        "energy": energies | {"works": {name: of_energy(it, works.works.get(name)) for name, it in energy.works.items()}},
        "motor_start": heat and heat.errors(start_heat(other), share, 2 * motion.error),
    }


def of_samples(transient: Transient, points: int) -> dict[str, float | None]:
    """The greatest error of each column of the motion over that number of evenly spaced times."""
    motion = transient.motion
    assert motion.trail is not None
    rough = _rough(motion)
    times = np.linspace(0.0, min(motion.trail.t[-1], rough.t[-1]), points)
    fine, before = sampled(motion.trail, times), sampled(rough, times)
    errors: dict[str, float | None] = {"t": ROUNDING * float(times[-1])}
    columns = zip(Samples._fields[1:-1], fine[1:-1], before[1:-1], strict=True)
    own = ((name, row, (before.states or {})[name]) for name, row in (fine.states or {}).items())
    for name, now, then in (*columns, *own):
        errors[name] = None
        if now is not None and then is not None:
            errors[name] = motion.share * float(np.abs(now - then).max()) + 2 * motion.error * float(np.abs(now).max())
    return errors


def _rough(motion: Motion) -> Trail:
    """The previous run, of greater tolerance, or the motion itself if that has no step."""
    rough = motion.trail if motion.rough is None or not motion.rough.stretches else motion.rough
    assert rough is not None
    return rough


def _peak_width(trail: Trail, name: str, samples: Samples, owners: Indices, top: Peak, off: float) -> float:
    """Distance (s) from a peak's time within which its column may be as great, by the errors of its values.

    The column falls from a peak at least as a parabola does, or evenly, to its samples on either side; other summits count
    where they may be as great.
    """
    values = column(samples, name)
    near = [one for one in highest(trail, name, samples, owners) if one.value >= top.value - 2 * off]
    far = max(abs(one.time - top.time) for one in near)
    lower = np.flatnonzero(values < top.value - 2 * off)
    wide = 0.0
    for beside in (lower[samples.t[lower] <= top.time][-1:], lower[samples.t[lower] >= top.time][:1]):
        for k in beside:
            share = min(2 * off / (top.value - float(values[k])), 1.0)
            wide = max(wide, abs(float(samples.t[k]) - top.time) * float(np.sqrt(share)))
    return far + wide
