"""A machine followed in time from a start to an end: run-up, run-down, load step, stall.

In order: what ends a motion (`until`), `transient` itself with its start, its goals and how it ended, the record of the
motion (`Transient`), what the machine does along it (`sampled`, `energy_of`, `peak`), its errors, and the steady regime that
it comes to (`regime_of`, `time_along`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.components.motors import DC, Induction, Motor, Started, TwoAxisInduction
from flywheel.machine.dynamics import ONSET, Dynamics
from flywheel.machine.machine import Anchor, Machine
from flywheel.motions.simulation import Motion, actual, motion_from
from flywheel.numerics import cells, notebook
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError, show, told
from flywheel.numerics.units import QuantityError, parse_quantity
from flywheel.regime import turning_moment
from flywheel.regime.free_motion import Goal, Passing, Start, Trail, Watching, end_of_stroke, held_by, neighbours, straight
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import own_coordinate
from flywheel.scene.scene import TURN, Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

if TYPE_CHECKING:
    from flywheel.motions.starting import StartHeat

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

# -- what ends a motion -----------------------------------------------------------------------------------------------

Kind = Literal["time", "way", "speed", "share", "regime", "stop"]
_DIMENSIONS: tuple[tuple[Kind, str, bool | None], ...] = (
    ("time", "time", None),
    ("way", "angle", False),
    ("way", "length", True),
    ("speed", "speed", False),
    ("speed", "velocity", True),
)
"""What ends a motion, by its dimension, and whether the driver then slides."""
_TURNS = re.compile(r"\s*([-+.\deE]+)\s*turns?\s*")
_SHARE = re.compile(r"\s*([-+.\deE]+)\s*%\s*")
_EXPECTED = '"regime", "stop", or a time, a way, a speed or a share of the regime\'s, such as "5 s", "90 deg" or "95 %"'


class Until(NamedTuple):
    """The end of a motion: time (s), way (rad), speed (rad/s), share of the regime's speed; m and m/s where a driver slides.

    `sliding` tells a way or a speed of a driver that slides from one of a crank; None where a number says neither.
    """

    kind: Kind
    value: float = 0.0
    sliding: bool | None = None

    def told(self, sliding: bool) -> str:
        """The end in words, with its unit."""
        way, speed = ("m", "m/s") if sliding else ("rad", "rad/s")
        if self.kind == "way" and not sliding:
            return f"{self.value:.6g} rad ({self.value / TURN:.6g} turns) on"
        return {
            "time": f"{self.value:.6g} s",
            "way": f"{self.value:.6g} {way} on",
            "speed": f"{self.value:.6g} {speed}",
        }.get(self.kind, f"{100 * self.value:.6g} % of its regime's speed")


def until(text: str) -> Until:
    """What a text says of the end of a motion; a SceneError where it says nothing that is known.

    >>> until("5 s"), until("2 turns").kind, until("95 %"), until("regime").kind
    (Until(kind='time', value=5.0, sliding=None), 'way', Until(kind='share', value=0.95, sliding=None), 'regime')
    """
    word = text.strip()
    if word == "regime":
        return Until("regime")
    if word == "stop":
        return Until("stop")
    found = None
    with suppress(ValueError):
        if match := _TURNS.fullmatch(text):
            found = Until("way", float(match[1]) * TURN, False)
        elif match := _SHARE.fullmatch(text):
            found = Until("share", float(match[1]) / 100)
    try:
        float(text)  # a number without a unit could be anything
    except ValueError:
        for kind, dimension, sliding in _DIMENSIONS:
            with suppress(QuantityError):
                found = found or Until(kind, parse_quantity(text, dimension), sliding)
    if found is None or not 0.0 < found.value < float("inf"):
        raise SceneError([Fault("until", show(text), _EXPECTED)])
    return found


# -- the motion -------------------------------------------------------------------------------------------------------

MOST_CYCLES = 1000.0
SHARE = 0.95
_MOST_TIME = 20.0  # times as long as those cycles take at the machine's own speed
_CREEPING = 1e-12  # of the speed at the start: slower than this it stands, or never will
_SUDDEN = 1e-6  # of the time gone: a machine that would stop within this has stopped
_SETTLED = 1e-6  # of the speed: what is still missing to the regime
_SHORT = 1e-9  # the same, before a speed counts as out of reach
_SHORT_OF_IT = ("stop", "stall", "creep", "stroke")
_NAMES = {"regime": "regime", "stop": "steady", "speed": "settled", "share": "settled"}
_BALANCED = 64 * ROUNDING
_MORE = 1e-9  # current than balances the load: so that the machine moves on, and not back
_ONSET = 1e-15  # of a locked motor's states, with which it starts what no load holds
_LOOKED_AT = np.array([0.1, 0.35, 0.6, 0.85])  # of a piece
_SEEN = 9  # speeds, and times, at which it is seen whether a drive pushes
_OFF = 0.01  # of the greatest push of a drive: with less it is off


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
    """Follow a machine from a start to an end: (J + I*) alpha + ½ dI*/dphi omega² = M*(phi, omega, t).

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        start: "rest", "regime" (its steady speed at the position), or a speed of the crank, rad/s (m/s of a slide).
        at: the position at the start, rad (m where a driver slides); 0, or where a stroke begins, if None.
        end: a time (s), or what `until` reads: "5 s", "10 turns", "90 deg" (or "50 mm") of the driver's way, "200 rpm",
            "95 %" (of the regime's mean speed), "regime" (its speed at phi = 0 repeats to 1e-6), "stop". A machine that
            settles before it comes to a speed ends with that: `reason` is "limit". If None the regime; without a drive, or
            on a stroke, a stop.
        drive: whether the drive drives; without it the machine runs down.
        inertia: the flywheel's, kg m² at its own shaft; if None the scene's own, or the one that it is sized to; 0 where the
            scene has no flywheel.
        balance: value (SI) of the scene's unknown; if None the one that balances the regime.
        rtol: error allowed of position and speed.
        watching: is told time (s) and position (rad) as the motion goes on; a motion is followed twice at least, so that
            both begin again.

    Raises:
        SceneError: where the machine does not start, has no regime where one is asked for, or cannot be followed.

    A motion ends early where the machine stops, with its angle: `stall` where the drive pushes but is too weak, `stop`
    without one, or where it is off by then or brakes. For a time, what has neither drive nor loads is let go and swings both
    ways, as a pendulum does; so does what has friction in its joints. At a step of load or drive (an expression of `t`)
    stepping starts afresh.

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
    asked = goal.kind in ("regime", "share") or start == "regime" or (machine.scene.unknown is not None and balance is None)
    setting = _setting(machine, drive, inertia, balance, asked or not machine.resists)
    if goal.kind == "stop" and machine.resists and not _is_pressed(setting.machine):
        found = (
            "a stop of a machine whose joints nothing presses but its own inertia: friction falls with the speed, for ever"
        )
        raise SceneError([Fault("until", found, "a time, a way or a speed", 'such as --until "5 s", or give it [gravity]')])
    let_go = setting.machine.scene.drive is None and not setting.machine.scene.loads  # weights and springs alone move it
    goes_on = goal.kind == "time" and (let_go or setting.dynamics.holds)
    starting = None if setting.motor is None or start == "regime" else setting.motor.start
    if starting is not None:
        setting = setting.started(())
    begin = _start(setting, start, at, goes_on)
    held = ""
    if starting is not None:
        setting, held = _switched(setting, begin, goal, rtol, watching)
    goals, limit = _goals(setting, begin, goal)
    goals = goals[goes_on:]
    motion = motion_from(setting.dynamics, begin, limit, rtol, goals, _settling(setting, goal, rtol), watching)
    trail = motion.trail
    assert trail is not None
    reason, ended = _ending(setting, trail, motion, goal, limit)
    regime, scene = setting.regime, setting.machine.scene
    if reason in _SHORT_OF_IT and goal.kind not in ("regime", "stop"):
        ended += f"; it did not come to {goal.told(scene.reduction_element == 'slide')}"
    messages = []
    if motion.error > rtol:
        messages.append(f"rtol {rtol:.1g} not reached: the motion is good to {motion.error:.2g} (estimated, relative)")
    messages += _held_at_rest(setting.dynamics, begin)
    if held:
        messages.append(held)
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
        given_errors={
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
    given: Any = {"at": at, "inertia": inertia, "balance": balance, "rtol": rtol}
    return transient(machine, start=start, end=end, drive=False, **given)


def _held_at_rest(dynamics: Dynamics, begin: Start) -> list[str]:
    """What is to be said of a motor whose states are not those of one just switched on, where it starts from rest."""
    circuit = dynamics.circuit
    if circuit is None or begin.omega:
        return []
    if all(abs(state) <= 2 * _MORE * size for state, size in zip(begin.states, circuit.scales, strict=True)):
        return []
    if len(begin.states) == 1:
        held = f"{begin.states[0]:.6g} {circuit.names[0].unit}, with which its motor carries the load at rest"
        return [f"held at rest until the {circuit.names[0].name} has risen to {held}; time counts from then on"]
    return ["held at rest until its motor's own states have settled: before, the load would turn it back; time counts then"]


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
    if goal.sliding is not None and goal.sliding != (scene.reduction_element == "slide"):
        what, other = ("slides", "turns")[:: 1 if goal.sliding else -1]
        found = f"a {goal.kind} of a driver that {what}, where it {other}"
        faults.append(Fault("until", found, f'a {goal.kind} such as "{_EXAMPLES[goal.kind, not goal.sliding]}"'))
    if goal.kind == "regime" and _is_driven_freely(scene):
        found = f"a regime, to which nothing holds this machine: {_FREELY}"
        expected = 'a way, a speed or a time, such as --until "2 turns", "90 deg", "20 rad/s" or "5 s"'
        faults.append(Fault("until", found, expected))
    elif goal.kind == "regime" and machine.depends_on_time:
        found = "a regime of a machine whose loads or drive depend on time"
        faults.append(Fault("until", found, "a time, a way or a speed", 'such as --until "5 s"'))
    if isinstance(start, str) and start not in ("rest", "regime"):
        faults.append(Fault("from", f'"{start}"', '"rest", "regime", or a speed'))
    elif not isinstance(start, str) and not 0.0 <= start < np.inf:
        faults.append(Fault("from", f"{start}", "a finite speed, at least 0"))
    if faults:
        raise SceneError(faults)


_EXAMPLES = {("way", False): "90 deg", ("way", True): "50 mm", ("speed", False): "200 rpm", ("speed", True): "0.3 m/s"}
_FREELY = "neither regime.speed nor a torque that depends on speed"


def _is_pressed(machine: Machine) -> bool:
    """Whether anything but inertia acts on a machine: weights, loads, a drive, springs, dampers."""
    scene = machine.scene
    return bool(scene.gravity or machine.efforts or scene.springs or scene.dampers)


def _is_driven_freely(scene: Scene) -> bool:
    """Whether a machine that turns in cycles has no speed of its own, nor one that it is to have: it has no regime."""
    return scene.stroke is None and not scene.has_speed and scene.unknown is None


class Setting(NamedTuple):
    """A machine as it is followed, and what is known of it before, with relative errors of flywheel and balance."""

    machine: Machine
    dynamics: Dynamics
    inertia: float
    balance: float
    regime: Regime | None
    no_regime: str
    inertia_error: float
    balance_error: float

    def needed(self) -> Regime:
        """The regime, or a SceneError that says why there is none."""
        if self.regime is None:
            raise SceneError([Fault("regime", self.no_regime, "a machine that has a regime", "name a speed or a time")])
        return self.regime

    @property
    def motor(self) -> Motor | None:
        """The drive's motor, as it runs."""
        motor = self.machine.scene.motor
        return motor.own if isinstance(motor, Started) else motor

    def started(self, times: Sequence[float]) -> Setting:
        """The same with its motor as it is started, switched at `times` (s) so far."""
        scene, motor = self.machine.scene, self.motor
        assert motor is not None
        assert motor.start is not None
        assert scene.drive is not None
        found = Started.of(motor, motor.start, times)
        machine = Machine(replace(scene, drive=scene.drive._replace(law=found.law()), motor=found))
        return self._replace(machine=machine, dynamics=Dynamics(machine, self.dynamics.inertia, self.dynamics.balance))

    def target(self, goal: Until) -> float:
        """The speed (rad/s) that is to be reached."""
        return goal.value * (self.needed().speed if goal.kind == "share" else 1.0)


def _setting(machine: Machine, drive: bool, inertia: float | None, balance: float | None, regimes: bool) -> Setting:
    """The flywheel that is given, the scene's or the one that it is sized to; the regime with it; the unknown's value.

    regimes: whether the regime is looked for.
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
            found = f"an irregularity, to which no flywheel can be sized ({why})"
            if scene.limits:
                found = f"limits, for which no flywheel can be sized ({why})"
            advice = 'give its inertia: --flywheel "0.3 kg m^2" (in Python inertia=0.3)'
            raise SceneError([Fault("flywheel", found, "a flywheel to follow the machine with", advice)]) from error
    regime, no_regime = None, ""
    if scene.stroke is not None:
        no_regime = "a stroke has no regime"
    elif _is_driven_freely(scene):
        no_regime = _FREELY
    elif machine.depends_on_time:
        no_regime = "loads or drive that depend on time have no regime"
    elif not regimes:
        no_regime = "not looked for, as with friction in joints it takes long; --until regime finds it"
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
            found = '"balance" with torques that depend on speed or time, and without a regime to balance'
            raise SceneError([Fault("balance", found, "a value", "give the unknown its value")])
        cycle = turning_moment.balanced(machine_of(machine))
        balance, balance_error = cycle.balance or 0.0, cycle.balance_error
    if not drive:
        unknown = None if scene.unknown == "drive" else scene.unknown
        machine = Machine(replace(scene, drive=None, motor=None, unknown=unknown))
    dynamics = Dynamics(machine, inertia * scene.flywheel_ratio**2, balance)
    return Setting(machine, dynamics, inertia, balance, regime, no_regime, inertia_error, balance_error)


def _switched(setting: Setting, begin: Start, goal: Until, rtol: float, watching: Watching | None) -> tuple[Setting, str]:
    """A machine whose motor goes through its connections at known times, and what is to be said where one does not end.

    A switch at a speed is found by following the motion up to it, by all that it takes: its time is as good as rtol.
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


def _start(setting: Setting, start: float | str, at: float | None, goes_on: bool) -> Start:
    """The start; a SceneError for a machine that stays at rest, or goes back, when it is let go.

    A motor with inductance has no torque at first. Where the load would turn it back until then, it is held until the
    current is strong enough, and starts with that.
    """
    machine, dynamics, circuit = setting.machine, setting.dynamics, setting.dynamics.circuit
    scene = machine.scene
    origin = scene.origin if at is None else at
    phi = origin if scene.stroke is None else float(own_coordinate(scene, np.asarray(origin, dtype=float)))
    if start == "regime":
        omega = float(speed_at(setting.needed().sizing, phi))
    else:
        omega = 0.0 if isinstance(start, str) else float(start)
    begin = Start(phi, omega, _own_states(setting, phi, omega, start == "regime"))
    if omega > 0.0:
        return begin
    if dynamics.holds:
        return _rough_start(setting, begin, goes_on)
    locked = begin if circuit is None else begin._replace(states=circuit.steady(0.0))
    moment, scale = _moment_at_rest(dynamics, locked)
    if moment > _BALANCED * scale:
        unfed = moment if circuit is None else _moment_at_rest(dynamics, begin)[0]
        return begin if unfed > 0.0 else _carrying(begin, locked, unfed / (unfed - moment))
    balanced = abs(moment) <= _BALANCED * scale
    if machine.depends_on_time and balanced:
        return begin
    if goes_on and not balanced:
        return begin
    share = "M* = 0, so that nothing moves it" if balanced else f"M* = {moment:.6g} N m, which holds it or turns it back"
    found = f"a machine that does not start: at rest at {machine.where(begin.phi)} it has {share}"
    advice = (
        "start at another angle" if balanced else "the drive stalls there: start at another angle, or with a larger drive"
    )
    if scene.drive is None:
        speed = "0.1 m/s" if scene.reduction_element == "slide" else "200 rpm"
        regime = "" if scene.stroke is not None or _is_driven_freely(scene) else "--from regime, or "
        advice = f'nothing drives it: start at a speed, {regime}--from "{speed}"'
    raise SceneError([Fault("from", found, "a moment that sets it going", advice)])


def _own_states(setting: Setting, phi: float, omega: float, of_regime: bool) -> tuple[float, ...]:
    """A motor's own states at the start: of one just switched on, or as steady as the speed (rad/s) is; the regime's own."""
    dynamics, circuit = setting.dynamics, setting.dynamics.circuit
    if circuit is None:
        return ()
    if of_regime and circuit.only_speed is not None:
        return states_at(setting.needed().sizing, phi)
    return tuple(float(state) for state in circuit.steady(dynamics.ratio * omega)) if omega else circuit.unfed


def _carrying(begin: Start, locked: Start, share: float) -> Start:
    """The start with a little more of the states of a locked motor than carries the load at rest.

    share: of those states which does so where torque grows with them evenly; with another torque, all of them.
    """
    if len(begin.states) > 1 and share:
        return locked
    return begin._replace(states=tuple((1 + _MORE) * share * state or _ONSET * state for state in locked.states))


def _rough_start(setting: Setting, begin: Start, goes_on: bool) -> Start:
    """The start of a machine with dry friction, which may hold it until loads or its motor's current move it.

    goes_on: whether it is followed backwards too.
    """
    machine, dynamics, circuit = setting.machine, setting.dynamics, setting.dynamics.circuit
    phi = begin.phi if machine.scene.stroke is not None else begin.phi % machine.scene.cycle
    sides, now = neighbours(machine, phi), np.zeros(1)
    forwards, backwards = (float(one[0]) for one in dynamics.from_rest(phi, *sides, now))
    least = _BALANCED * max(abs(forwards), abs(backwards))
    if forwards > least or machine.depends_on_time or (goes_on and backwards < -least):
        return begin
    if circuit is not None and float(dynamics.from_rest(phi, *sides, now, circuit.steady(0.0))[0][0]) > least:
        return begin
    where = machine.where(phi)
    if backwards < -least:
        found = f"a machine that goes back: at rest at {where} {_friction(machine)} does not hold it"
        advice = 'start at another angle, with a larger drive, or follow it for a time: --until "5 s"'
    else:
        found = f"a machine that does not start: at rest at {where} {held_by(dynamics, phi, 0.0, begin.states)}"
        advice = "a larger drive, less friction, or a start at a speed"
    raise SceneError([Fault("from", found, "a moment that sets it going", advice)])


def _friction(machine: Machine) -> str:
    return "friction in its joints" if machine.resists else "the drag of its shafts"


def _moment_at_rest(dynamics: Dynamics, begin: Start, t: float = 0.0) -> tuple[float, float]:
    """M* as the machine sets out from rest at t (s), and how large the moments in it are, there and over the cycle.

    It is M* just ahead of the start, before losses in meshes; friction is that of a motion forwards.
    """
    machine = dynamics.machine
    phi = begin.phi if machine.scene.stroke is not None else begin.phi % machine.scene.cycle
    place = Anchor(float(machine.anchors(phi)), ONSET * machine.typical_speed, t, tuple(1.0 for _ in machine.stages))
    parts = dynamics.moments(np.array([phi]), place, np.zeros(1), np.full(1, t), begin.states)
    around = _around(machine)
    still = np.zeros_like(around)
    over = dynamics.moments(around, place._replace(phi=machine.anchors(around)), still, still + t, begin.states)
    largest = sum(float(np.abs(part).max()) for part in over.values())
    return float(sum(part[0] for part in parts.values())), largest + float(sum(abs(part[0]) for part in parts.values()))


def _around(machine: Machine) -> Array:
    """Positions all over the cycle, or the stroke, in every piece of it."""
    return np.asarray((machine.restarts[:-1, None] + np.diff(machine.restarts)[:, None] * _LOOKED_AT).ravel())


def _goals(setting: Setting, begin: Start, goal: Until) -> tuple[list[Goal], float]:
    """What ends the motion, stopping always; and the time (s) that was wanted, or at which it is given up."""
    slow = _CREEPING * begin.omega
    found = [straight("stop", 1, -slow, 1.0)]
    if goal.kind == "time":
        return found, goal.value
    machine = setting.machine
    way = goal.value if goal.kind == "way" else MOST_CYCLES * machine.scene.cycle
    found.append(straight("way" if goal.kind == "way" else "limit", 0, begin.phi + way, -1.0))
    if goal.kind in ("speed", "share"):
        target = setting.target(goal)
        sense = 1.0 if target > begin.omega else -1.0
        found.append(straight(goal.kind, 1, sense * target, -sense))
    speed = max(machine.typical_speed, begin.omega) if setting.regime is None else setting.regime.speed
    return found, _MOST_TIME * MOST_CYCLES * machine.scene.cycle / speed


def _settling(setting: Setting, goal: Until, rtol: float) -> Passing | None:
    """What tells, at the end of every cycle, whether the speed there has settled.

    Three speeds in turn tell the rate at which they settle, and with it how much is still missing. Where laws depend on
    time, a speed or a stop may still come.
    """
    motor = setting.machine.scene.motor
    switched = motor.times[-1] if isinstance(motor, Started) and motor.times else 0.0
    timed = setting.machine.depends_on_time and not isinstance(motor, Started)
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


def _ending(setting: Setting, trail: Trail, motion: Motion, goal: Until, limit: float) -> tuple[str, str]:
    """How a motion ended: in one word, and in a sentence."""
    machine, scene = setting.machine, setting.machine.scene
    last, phi, omega = float(trail.t[-1]), float(motion.phi[-1]), float(motion.omega[-1])
    stroke = scene.stroke
    place = machine.where(phi % scene.cycle) if stroke is None else told(phi + scene.origin, stroke.sliding)
    at, turns = f"at {place} after {last:.6g} s", (phi - trail.start.phi) / TURN

    sliding = scene.reduction_element == "slide"
    unit, effort, unit_of_effort = ("m/s", "F*", "N") if sliding else ("rad/s", "M*", "N m")

    def speed(omega: float) -> str:
        return f"{omega:.6g} {unit}" + ("" if sliding else f" ({omega * 60 / TURN:.6g} rpm)")

    if trail.stuck or trail.goal == "stop":
        acceleration = abs(float(sampled(trail, np.array([last])).acceleration[0]))
        if trail.start.omega > 0.0 and omega > 0.0 and omega > _SUDDEN * last * acceleration:
            return "creep", f"slows down for ever, as only what grows with speed brakes it: {omega:.3g} {unit} {at}"
        states = trail.states(np.array([last]))
        why = ""
        if setting.dynamics.holds:
            why = f": {_rough_rest(setting.dynamics, trail, states[:, 0], last)}"
        if scene.drive is None:
            return "stop", f"stopped {at}{why}"
        if not _drive_acts(setting.dynamics, trail, last):
            return "stop", f"stopped {at}, where its drive no longer pushes it on{why}"
        if why:
            return "stall", f"stalled {at}{why}"
        stall = Start(float(states[0, 0]), 0.0, tuple(states[3:, 0].tolist()))
        moment, _ = _moment_at_rest(setting.dynamics, stall, last)
        lossy = any(stage.efficiency < 1.0 for stage in machine.stages)
        left = f"{effort} at rest is {moment:.6g} {unit_of_effort}"
        return "stall", f"stalled {at}: {left}{', before losses in meshes' if lossy else ''}"
    if stroke is not None and trail.goal is None and last < limit:
        return "stroke", end_of_stroke(scene, phi + scene.origin, last)
    if trail.goal == "settled":
        return "limit", f"settled to its regime without reaching {speed(setting.target(goal))}: {speed(omega)} {at}"
    if trail.goal == "limit" or (trail.goal is None and goal.kind != "time"):
        wanted = {"regime": "its regime", "stop": "a stop"}.get(goal.kind, "what was asked for")
        return "limit", f"did not come to {wanted} within {turns:.6g} turns and {last:.6g} s"
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


def _rough_rest(dynamics: Dynamics, trail: Trail, state: Array, last: float) -> str:
    """What a machine with rough joints does at the end of its motion: friction holds it, or it would move."""
    machine, own = dynamics.machine, state[3:].tolist()
    phi = float(state[0]) if machine.scene.stroke is not None else float(state[0]) % machine.scene.cycle
    sides = neighbours(machine, phi)
    forwards, backwards = (float(one[0]) for one in dynamics.from_rest(phi, *sides, np.array([last]), own))
    if trail.stuck or not (forwards > 0.0 or backwards < 0.0):
        return held_by(dynamics, phi, last, own)
    return f"{_friction(machine)} does not hold it there, and it would {'move on' if forwards > 0.0 else 'turn back'}"


def _drive_acts(dynamics: Dynamics, trail: Trail, last: float) -> bool:
    """Whether at the end (s) the drive pushes forwards anywhere in the cycle, at rest or at a speed that the motion had.

    One that does not, as time has switched it off (to a hundredth of its greatest push) or it brakes, lets the machine
    stop; any other was too weak.
    """
    machine = dynamics.machine
    speeds = np.unique(np.append(np.abs(trail.ends()[1]), 0.0))
    speeds = speeds[np.linspace(0, speeds.size - 1, min(speeds.size, _SEEN)).astype(int)]
    axes = _around(machine), speeds, np.linspace(last, 0.0, _SEEN)
    phi, omega, time = (grid.ravel() for grid in np.meshgrid(*axes, indexing="ij"))
    onset = np.maximum(omega, ONSET * machine.typical_speed)
    place = Anchor(machine.anchors(phi), onset, time, tuple(1.0 for _ in machine.stages))
    states = () if dynamics.circuit is None else dynamics.circuit.steady(dynamics.ratio * omega)
    drive = dynamics.moments(phi, place, omega, time, states).get(DRIVE, np.zeros(phi.size))
    return bool(drive[time == last].max() > _OFF * max(float(drive.max()), 0.0))


# -- the record -------------------------------------------------------------------------------------------------------


class Peak(NamedTuple):
    """A greatest value and the time (s) at which it is reached."""

    value: float
    time: float


class Energy(NamedTuple):
    """Where the energy of a motion came from and went (J): works of drive and loads, heat, and kinetic energy gained.

    `works` are by part, those of dampers and friction below 0; `meshes` is what meshes lost. What drive, loads and meshes
    leave is the kinetic energy gained, but for `residual`, a share of the largest of them or of the greatest kinetic energy.
    `copper` is the heat in a DC motor's armature, `rotor_heat` that in an induction motor's rotor, torque times slip speed.
    Neither is part of that balance: the drive's work is what its shaft gives.
    """

    drive: float
    works: dict[str, float]
    meshes: float
    kinetic_gained: float
    residual: float
    copper: float | None
    rotor_heat: float | None = None


class Peaks(NamedTuple):
    """Greatest speed of the crank (rad/s), torque of the drive (N m, at its shaft), its power (W), a motor's current (A)."""

    speed: Peak
    torque: Peak | None
    power: Peak | None
    current: Peak | None


@dataclass(frozen=True, repr=False)
class Transient:
    """A machine followed from a start to an end.

    `ended` says in words how, `reason` in one: `time`, `way`, `speed`, `share`, `regime`, `stop`, `stall` (its drive pushes,
    and is too weak), `creep` (it slows down for ever), `limit` (what was asked for does not come), `stroke`.
    `time` (s), `phi` (rad) and `omega` (rad/s) are those of the end; `way` (rad) is how far it went, `turns` the same in
    turns. On a stroke whose driver slides, m.

    `regime_speed` is the mean over time of the steady cycle that the machine has with its drive (rad/s), None where there is
    none; `time_to_regime` the first time (s) at which the crank is as fast as 95 % of that. `inertia` is the flywheel's, at
    its own shaft (kg m²). `given_errors` are those of inertia, balance and regime speed, in their units.
    """

    scene: Scene
    motion: Motion
    ended: str
    reason: str
    inertia: float
    balance: float
    regime_speed: float | None
    time_to_regime: float | None
    rtol: float
    messages: tuple[str, ...] = ()
    given_errors: Mapping[str, float | None] = field(default_factory=dict)
    from_regime: bool = False

    @cached_property
    def samples(self) -> tuple[Samples, Indices]:
        """The motion in every stretch, and the stretches that samples belong to."""
        assert self.motion.trail is not None
        return samples_of(self.motion.trail)

    @cached_property
    def peaks(self) -> Peaks:
        """Greatest speed, and of a driven machine torque, power and current."""
        assert self.motion.trail is not None
        with np.errstate(all="ignore"):
            return peaks_of(self.motion.trail, *self.samples)

    @cached_property
    def energy(self) -> Energy:
        """Works and heats from start to end, and how far they close."""
        assert self.motion.trail is not None
        with np.errstate(all="ignore"):
            return energy_of(self.motion.trail, self.samples[0].kinetic)

    @cached_property
    def start_heat(self) -> StartHeat | None:
        """Heat of the motor's start, against what it bears; None where it is not started, or its kind does not tell."""
        from flywheel.motions.starting import start_heat  # only motions that a motor drives pay for it

        assert self.motion.trail is not None
        return None if self.from_regime else start_heat(self.motion.trail)

    def __repr__(self) -> str:
        """How it ended, instead of the motion."""
        figures = f"time={self.time:.6g}, turns={self.turns:.6g}, omega={self.omega:.6g}"
        return f"Transient({self.reason}: {self.ended}; {figures})"

    def _repr_html_(self) -> str | None:
        """What a notebook shows."""
        return notebook.html(self)

    @property
    def time(self) -> float:
        """When it ended, s."""
        return float(self.motion.t[-1])

    @property
    def phi(self) -> float:
        """Where it ended, rad."""
        return float(self.motion.phi[-1])

    @property
    def omega(self) -> float:
        """The speed at the end, rad/s: 0 of a machine that stopped, whose motion ends there to rounding."""
        return 0.0 if self.reason in ("stop", "stall") else float(self.motion.omega[-1])

    @property
    def way(self) -> float:
        """How far it went, rad."""
        return float(self.motion.phi[-1] - self.motion.phi[0])

    @property
    def turns(self) -> float:
        """How far it went, in turns of the crank."""
        return self.way / TURN

    @property
    def error(self) -> float:
        """Estimated error of position and speed, relative to the way gone and to the greatest speed."""
        return self.motion.error

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, SI throughout."""
        return {
            "title": self.scene.title,
            "reduction": self.scene.reduction_element,
            "reason": self.reason,
            "ended": self.ended,
            "start": {"phi": float(self.motion.phi[0]), "omega": float(self.motion.omega[0])},
            "end": {"t": self.time, "phi": self.phi, "omega": self.omega},
            "way": self.way,
            "turns": self.turns,
            "flywheel": {"on": self.scene.flywheel_on, "inertia": self.inertia},
            "balance": self.scene.unknown and {"name": self.scene.unknown, "value": self.balance},
            "regime_speed": self.regime_speed,
            "time_to_95_percent": self.time_to_regime,
            "peaks": {name: found and found._asdict() for name, found in self.peaks._asdict().items()},
            "energy": self.energy._asdict(),
            "motor_start": None if self.start_heat is None else self.start_heat.as_dict(),
            "error": self.error,
            "energy_residual": self.motion.energy_residual,
            "drift": self.motion.drift,
            "rtol": self.rtol,
            "messages": list(self.messages),
        }


# -- what the machine does along a motion -----------------------------------------------------------------------------

DRIVE = "drive"
_TOGETHER = 20_000  # times that are looked at in one go
_GAUSS = 10  # nodes in a step
_TOPS = 64  # how many of the highest samples are looked at more closely
_FINER, _ROUNDS = 33, 4  # times between the neighbours of a top, and how often they are laid closer


class Samples(NamedTuple):
    """A motion at times t (s): phi (rad, not reduced), omega (rad/s), acceleration (rad/s²), moment M* less losses (N m).

    `drive` is the drive's torque at its own shaft (N m), `power` what it gives (W), `loss` what meshes lose (W), `kinetic`
    the kinetic energy (J), `current` a motor's (A; None where its kind does not tell it), `states` a motor's own by
    name, None without any. On a stroke whose driver slides: m, m/s, N.
    """

    t: Array
    phi: Array
    omega: Array
    acceleration: Array
    moment: Array
    drive: Array
    power: Array
    loss: Array
    kinetic: Array
    current: Array | None
    states: dict[str, Array] | None = None


class _Here(NamedTuple):
    """States at some times, with what the machine's laws need to know there."""

    phi: Array
    anchor: Anchor
    omega: Array
    time: Array
    states: Array


def _along(trail: Trail, times: Array, owners: Indices) -> Iterator[tuple[slice, Array, _Here, Array | None]]:
    """Times in portions: which, their states, what laws need there, and a motor's current (A).

    That current follows from states of the motor's own, or from its speed.
    """
    motor, ratio = trail.dynamics.machine.scene.motor, trail.dynamics.ratio
    for k in range(0, times.size, _TOGETHER):
        portion = slice(k, k + _TOGETHER)
        states = trail.states(times[portion], owners[portion])
        offset, anchor = trail.anchors(owners[portion])
        here = _Here(states[0] - offset, anchor, states[1], times[portion], states[3:])
        circuit = trail.dynamics.circuit
        stepped = None if circuit is None else circuit.current(ratio * states[1], states[3:])
        yield portion, states, here, _current(motor, ratio, here) if circuit is None else stepped


def _current(motor: Motor | None, ratio: float, here: _Here) -> Array | None:
    """The current (A) of a motor whose speed tells it: an armature's, or a line's by its name plate."""
    if isinstance(motor, Started):
        share = motor.current_at(ratio * here.omega, here.time, here.anchor.time)
        rated = motor.rated_current or (1.0 if isinstance(motor.own, DC) else None)
        return None if share is None or rated is None else rated * share
    if isinstance(motor, (DC, Induction)):
        found = motor.current(ratio * here.omega)
        return None if found is None else np.asarray(found)
    return None


def _heat(motor: Motor | None, ratio: float, here: _Here, current: Array | None) -> Array | None:
    """The heat (W) of a motor's armature or rotor; None where its kind does not tell it."""
    if isinstance(motor, Started):
        return motor.heat_at(ratio * here.omega, here.time, here.anchor.time)
    if isinstance(motor, DC) and current is not None:
        return np.asarray(motor.copper_heat(current))
    if isinstance(motor, TwoAxisInduction) and motor.circuit is not None:
        return np.asarray(motor.circuit.rotor_heat(here.states))
    return motor.rotor_heat(ratio * here.omega) if isinstance(motor, Induction) else None


def sampled(trail: Trail, times: Array, owners: Indices | None = None) -> Samples:
    """The motion at times within it; at an end of a stretch `owners` tell the side (the one before, where they are None)."""
    dynamics, parts, own = trail.dynamics, list[Any](), list[Array]()
    for portion, states, here, current in _along(trail, times, trail.owners(times) if owners is None else owners):
        now, omega = dynamics.along(*here), states[1]
        drive = dynamics.moments(*here, now).get(DRIVE, np.zeros_like(omega))
        kinetic, shaft = 0.5 * now.inertia * omega**2, drive / dynamics.ratio
        figures = now.acceleration, now.moment, shaft, drive * omega, now.loss * omega, kinetic, current
        parts.append((times[portion], states[0], omega, *figures))
        own.append(states[3:])
    joined: list[Any] = [None if column[0] is None else np.concatenate(column) for column in zip(*parts, strict=True)]
    found = Samples._make([*joined, None])
    if dynamics.circuit is None:
        return found
    rows = zip(dynamics.circuit.names, np.concatenate(own, axis=1), strict=True)
    return found._replace(states={one.name: row for one, row in rows})


def switching(trail: Trail) -> tuple[Array, Indices]:
    """Times at which a law switches or a piece ends, each twice, and the stretches on either side."""
    stretches = trail.stretches
    last = np.array(
        [k for k in range(len(stretches) - 1) if stretches[k].anchor is not stretches[k + 1].anchor], dtype=np.intp
    )
    return np.repeat(trail.t[last + 1], 2), np.column_stack((last, last + 1)).ravel()


def evenly(trail: Trail, points: int, breaks: bool = False) -> tuple[Array, Indices]:
    """So many times from start to end, and their stretches; with `breaks` also where laws switch, once for each side."""
    times = np.linspace(0.0, float(trail.t[-1]), points)
    owners = trail.owners(times)
    if not breaks:
        return times, owners
    more, sides = switching(trail)
    rows = np.unique(np.column_stack((np.append(owners, sides), np.append(times, more))), axis=0)
    return np.asarray(rows[:, 1], dtype=float), rows[:, 0].astype(np.intp)


def samples_of(trail: Trail) -> tuple[Samples, Indices]:
    """The motion in every stretch, at both its ends and at ten times between, and the stretches that these belong to."""
    points, _ = np.polynomial.legendre.leggauss(_GAUSS)
    times, owners = trail.within(0.5 * (1.0 + points))
    return sampled(trail, times, owners), owners


def energy_of(trail: Trail, kinetic: Array) -> Energy:
    """Works and heats of a motion with its kinetic energy (J) at times from start to end, and how far they close.

    Work is the integral of moment times speed over every step, by Gauss quadrature. It follows from the motion by dense
    output, apart from the work that time stepping itself adds up.
    """
    points, weights = np.polynomial.legendre.leggauss(_GAUSS)
    start, end = np.array([(stretch.step.start, stretch.step.end) for stretch in trail.stretches]).T
    half = 0.5 * (end - start)[:, None]
    times = (start[:, None] + half * (1.0 + points)).ravel()
    lasting, owners = (half * weights).ravel(), np.repeat(np.arange(half.size), _GAUSS)
    motor, ratio = trail.dynamics.machine.scene.motor, trail.dynamics.ratio
    own = motor.own if isinstance(motor, Started) else motor
    heated = 0.0
    works: dict[str, float] = {}
    meshes = 0.0
    for portion, states, here, current in _along(trail, times, owners):
        way = lasting[portion] * states[1]
        now = trail.dynamics.along(*here)
        for part, moment in trail.dynamics.moments(*here, now).items():
            works[part] = works.get(part, 0.0) + float(way @ moment)
        meshes += float(way @ now.loss)
        heat = _heat(motor, ratio, here, current)
        heated += 0.0 if heat is None else float(lasting[portion] @ heat)
    gained, drive = float(kinetic[-1] - kinetic[0]), works.pop(DRIVE, 0.0)
    total = drive + sum(works.values()) - meshes
    scale = max([float(kinetic.max()), abs(drive), *map(abs, works.values()), 1e-300])
    copper, rotor = (heated if isinstance(own, kind) else None for kind in (DC, Induction))
    return Energy(drive, works, meshes, gained, abs(total - gained) / scale, copper, rotor)


def peaks_of(trail: Trail, samples: Samples, owners: Indices) -> Peaks:
    """Greatest speed, and of a driven machine torque, power and current."""
    drives = trail.dynamics.machine.scene.drive is not None
    others = {"drive": drives, "power": drives, "current": samples.current is not None}
    tops = [peak(trail, name, samples, owners) if wanted else None for name, wanted in others.items()]
    return Peaks(peak(trail, "omega", samples, owners), *tops)


def peak(trail: Trail, name: str, samples: Samples, owners: Indices) -> Peak:
    """The greatest value of a column of `samples_of`: on either side of a jump, or between two samples of a stretch."""
    return max(summits(trail, name, samples, owners), key=lambda one: one.value)


def _column(samples: Samples, name: str) -> Array:
    """A column of samples; of the speed its size, as a machine that swings back is fastest either way."""
    return np.asarray(np.abs(samples.omega) if name == "omega" else getattr(samples, name))


def _figure(trail: Trail, name: str, times: Array, owners: Indices) -> Array:
    """A column of samples, by no more than it takes: a speed needs no laws, and what drives no friction in joints."""
    dynamics = trail.dynamics
    if name == "omega":
        return np.asarray(np.abs(trail.states(times, owners)[1]))
    if name not in ("drive", "power"):
        return _column(sampled(trail, times, owners), name)
    parts = [np.zeros(0)]
    for _, states, here, _ in _along(trail, times, owners):
        drive = dynamics.moments(*here, rubbing=False).get(DRIVE, np.zeros_like(states[1]))
        parts.append(drive / dynamics.ratio if name == "drive" else drive * states[1])
    return np.concatenate(parts)


def summits(trail: Trail, name: str, samples: Samples, owners: Indices) -> list[Peak]:
    """The greatest values about each of the highest samples; the very greatest sample first.

    The highest are those that no neighbour in their stretch exceeds. Each is then refined on times ever closer.
    """
    times, values = samples.t, _column(samples, name)

    def beside(which: Indices, side: int) -> Indices:
        """The neighbours of samples, or they themselves where their stretch ends."""
        other = np.clip(which + side, 0, owners.size - 1)
        return np.where(owners[other] == owners[which], other, which)

    every, best = np.arange(values.size), int(values.argmax())
    top = np.flatnonzero((values >= values[beside(every, -1)]) & (values >= values[beside(every, 1)]))
    tops = top[np.argsort(values[top], kind="stable")[-_TOPS:]]
    summit = [Peak(float(values[best]), float(times[best])), *(Peak(float(values[k]), float(times[k])) for k in tops)]
    low, high = times[beside(tops, -1)], times[beside(tops, 1)]
    for _ in range(_ROUNDS):
        grid = np.linspace(low, high, _FINER, axis=1)
        finer = _figure(trail, name, grid.ravel(), np.repeat(owners[tops], _FINER)).reshape(grid.shape)
        rows, column = np.arange(tops.size), finer.argmax(axis=1)
        here = map(Peak, finer[rows, column].tolist(), grid[rows, column].tolist())
        summit[1:] = [max(pair, key=lambda one: one.value) for pair in zip(summit[1:], here, strict=True)]
        low, high = grid[rows, np.maximum(column - 1, 0)], grid[rows, np.minimum(column + 1, _FINER - 1)]
    return summit


# -- errors -----------------------------------------------------------------------------------------------------------

_COLUMNS = {"speed": "omega", "torque": "drive", "power": "power", "current": "current"}


@np.errstate(all="ignore")  # of a figure without a scale nothing is known
def estimates(transient: Transient) -> dict[str, Any]:
    """Errors in the figures' own units, by the names of the JSON; None without a figure, or where nothing is known of it.

    They compare the motion with the run before it, of wider tolerance, and add what the error of position and speed makes of
    them. They hold for the flywheel and the balance as printed, whose own errors stand beside them.
    """
    motion, energy = transient.motion, transient.energy
    fine, other, share = motion.trail, _rough(motion), motion.share
    assert fine is not None
    (samples, owners), (before, sides) = transient.samples, samples_of(other)
    way = max(float(np.ptp(samples.phi)), fine.dynamics.machine.scene.cycle / (2 * np.pi))
    fastest = float(np.abs(samples.omega).max())
    position, speed, time = motion.error * way, motion.error * fastest, motion.error * transient.time
    peaks: dict[str, Any] = dict.fromkeys(_COLUMNS)
    old = peaks_of(other, before, sides)
    for name, column in _COLUMNS.items():
        now, then = getattr(transient.peaks, name), getattr(old, name)
        if now is not None and then is not None:
            value = share * abs(now.value - then.value) + motion.error * float(np.abs(getattr(samples, column)).max())
            peaks[name] = {"value": value, "time": time + _peak_width(fine, column, samples, owners, now, value)}
    late, when, steady_speed = None, transient.time_to_regime, transient.regime_speed
    if when == 0.0:
        late = 0.0
    elif when is not None and steady_speed is not None:  # what speed and regime are off by, over the acceleration there
        then = other.time_to(SHARE * steady_speed)
        acceleration = abs(float(sampled(fine, np.array([when])).acceleration[0]))
        off = (speed + SHARE * (transient.given_errors["regime_speed"] or 0.0)) / acceleration
        late = None if then is None else share * abs(when - then) + off + time
    works = energy_of(other, before.kinetic)
    scale = max(float(samples.kinetic.max()), abs(energy.drive), energy.meshes, *map(abs, energy.works.values()), 1e-300)

    def of_energy(now: float | None, then: float | None) -> float | None:
        if now is None or then is None:
            return None
        return share * abs(now - then) + (2 * motion.error + energy.residual) * max(scale, abs(now))

    heats = [name for name in Energy._fields if name not in ("works", "residual")]
    energies: dict[str, Any] = {name: of_energy(getattr(energy, name), getattr(works, name)) for name in heats}
    return {
        **transient.given_errors,
        "end": {"t": time, "phi": position, "omega": 0.0 if transient.omega == 0.0 else speed},
        "way": position,
        "turns": position / (2 * np.pi),
        "time_to_95_percent": late,
        "peaks": peaks,
        "energy": energies | {"works": {name: of_energy(it, works.works.get(name)) for name, it in energy.works.items()}},
        "motor_start": _start_errors(transient, other),
    }


def _start_errors(transient: Transient, rough: Trail) -> dict[str, float | None] | None:
    """Errors of the heat of a motor's start, by comparison with the run before."""
    from flywheel.motions.starting import start_heat  # only motions that a motor drives pay for it

    found, before = transient.start_heat, start_heat(rough)
    return None if found is None else found.errors(before, transient.motion.share, 2 * transient.motion.error)


def of_samples(transient: Transient, points: int) -> dict[str, float | None]:
    """The greatest error of each column of the motion over so many times, evenly."""
    motion = transient.motion
    assert motion.trail is not None
    rough = _rough(motion)
    times = np.linspace(0.0, min(motion.trail.t[-1], rough.t[-1]), points)
    fine, before = sampled(motion.trail, times), sampled(rough, times)
    found: dict[str, float | None] = {"t": ROUNDING * float(times[-1])}
    columns = zip(Samples._fields[1:-1], fine[1:-1], before[1:-1], strict=True)
    own = ((name, row, (before.states or {})[name]) for name, row in (fine.states or {}).items())
    for name, now, then in (*columns, *own):
        found[name] = None
        if now is not None and then is not None:
            found[name] = motion.share * float(np.abs(now - then).max()) + 2 * motion.error * float(np.abs(now).max())
    return found


def _rough(motion: Motion) -> Trail:
    """The run before, of wider tolerance, or the motion itself where that has no step."""
    rough = motion.trail if motion.rough is None or not motion.rough.stretches else motion.rough
    assert rough is not None
    return rough


def _peak_width(trail: Trail, name: str, samples: Samples, owners: Indices, top: Peak, off: float) -> float:
    """How far (s) from a peak's time its column may be as great, as far as its values are known.

    The column falls from a peak at least as a parabola does, or evenly, to its samples on either side; other summits count
    where they may be as great.
    """
    values = _column(samples, name)
    near = [one for one in summits(trail, name, samples, owners) if one.value >= top.value - 2 * off]
    far = max(abs(one.time - top.time) for one in near)
    lower = np.flatnonzero(values < top.value - 2 * off)
    wide = 0.0
    for beside in (lower[samples.t[lower] <= top.time][-1:], lower[samples.t[lower] >= top.time][:1]):
        for k in beside:
            share = min(2 * off / (top.value - float(values[k])), 1.0)
            wide = max(wide, abs(float(samples.t[k]) - top.time) * float(np.sqrt(share)))
    return far + wide


# -- the steady regime ------------------------------------------------------------------------------------------------


class Regime(NamedTuple):
    """A steady cycle: its mean speed over time (rad/s), its period (s), and the analysis that it comes from."""

    speed: float
    period: float
    sizing: Sizing


def regime_of(machine: Machine, inertia: float) -> Regime:
    """The steady regime of a machine with a flywheel of some inertia (kg m² at its own shaft).

    Raises SceneError where there is none.
    """
    scene = machine.scene
    same = scene.inertia == inertia and machine.friction is None
    sizing = size(machine if same else scene.with_flywheel(inertia), simulate=False)
    found = sizing.simulation
    if found is None or found.period is None or found.speed_time_mean is None:
        raise SceneError([Fault("regime", "a machine whose steady motion has no period", "one that has inertia")])
    return Regime(found.speed_time_mean, found.period, sizing)


def speed_at(sizing: Sizing, phi: ArrayLike) -> Array:
    """Crank speed (rad/s) of the steady cycle at crank angles phi (rad)."""
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None:
        raise SceneError([Fault("regime", "a sizing without a steady motion", "a machine that has inertia")])
    return turning_moment.speed_over_cycle(cycle, sizing.speed, run, np.asarray(phi, dtype=float) % sizing.scene.cycle)


def states_at(sizing: Sizing, phi: float) -> tuple[float, ...]:
    """A motor's own states in the steady cycle at a crank angle (rad); none where it has none."""
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None or run.along is None:
        return ()
    cell, t = cells.located(cycle.mesh, np.array([phi % sizing.scene.cycle]))
    return tuple(float(cells.value(cells.fit(row)[cell], t)[0]) for row in run.along)


def time_along(sizing: Sizing, phi: ArrayLike) -> Array:
    """Time (s) since phi = 0 along the steady cycle: t = integral of dphi/omega from 0 to phi.

    Args:
        sizing: of a scene, with its steady motion.
        phi: crank angles, rad, any shape; beyond a cycle, whole periods are added.

    Raises:
        SceneError: for a sizing that has no steady motion.

    Quadrature on the cells of the sizing, with 1/omega as a Chebyshev series on each, halved where that is not enough.
    Source: the course's time along the cycle, t = t0 + integral of dphi/omega.

    >>> import flywheel
    >>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": 10}, "flywheel": {"inertia": 50}})
    >>> sizing = flywheel.size(scene, simulate=False)
    >>> half = float(time_along(sizing, np.pi))  # a speed that falls evenly: from w + d to w - d, and back
    >>> abs(half / sizing.simulation.period - 0.5) < 1e-12
    True

    """
    angles = np.asarray(phi, dtype=float)
    speed_at(sizing, 0.0)
    assert sizing.cycle is not None

    def evaluated(edges: Array) -> tuple[tuple[cells.Cells, Array], float, cells.Coarse]:
        mesh = cells.cells(edges)
        slowness = 1.0 / speed_at(sizing, mesh.phi)
        series = cells.fit(slowness)
        shares = cells.tails(series) * mesh.half[:, 0] / float(cells.integral(slowness, mesh.half).sum())
        return (mesh, series), float(shares.sum()), cells.above(shares)

    mesh, series = cells.refined(sizing.cycle.mesh.edges, evaluated, 0.1 * sizing.rtol)
    rising = cells.antiderivative(series, mesh.half)
    start = cells.accumulated(rising)
    turns = np.floor(angles / sizing.scene.cycle)
    cell, t = cells.located(mesh, angles - turns * sizing.scene.cycle)
    return np.asarray(turns * start[-1] + start[cell] + (rising[cell] * cells.basis(t)).sum(axis=-1))
