"""Starts of a motor: star-delta, transformer, soft start, resistance steps, a stronger field; then normal running.

A `Start` has the connections of a motor, each until a time or a speed of its shaft, before its
normal connection. `Started` is the motor along a motion with known times of its switches: its torque is a law of speed
and time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flywheel.components.motors.motor import Array, Connection, Motor, Point, Span, Start, States, Switch, before
from flywheel.numerics.expressions import Expression, Node
from flywheel.numerics.faults import POSITIVE, Fault, SceneError, number_faults, refuse

_TAKEN = {
    "star-delta": ("a start by {kind} of a {motor}", "an induction motor, or a table of one"),
    "transformer": ("a start by {kind} of a {motor}", "an induction motor, or a table of one"),
    "soft": ("a soft start of a {motor}", "an induction motor, or a table of one"),
    "resistance": ("resistance steps of a {motor}", "an induction or a DC motor"),
    "field": ("field steps of a {motor}", "a DC motor"),
}
"""Each start of a motor that does not have it, and those that have."""


def check_start(motor: Motor, kind: str) -> None:
    """Refuses a start that a type of motor does not have."""
    if kind not in motor.starts:
        defect, expected = _TAKEN[kind]
        raise SceneError([Fault("type", defect.format(kind=kind, motor=motor.title), expected)])


def _checked(untils: Sequence[Switch]) -> None:
    """Refuses switches that do not follow each other: times that fall, speeds that fall."""
    for i, until in enumerate(untils):
        value, earlier = (
            until.speed or until.time,
            [one for one in untils[:i] if (one.speed is None) == (until.speed is None)],
        )
        refuse(number_faults("until", value, POSITIVE))
        if earlier and not (until.speed or until.time or 0.0) > (earlier[-1].speed or earlier[-1].time or 0.0):
            raise SceneError([Fault(f"until[{i}]", str(until), f"later than {earlier[-1]}")])


def star_delta(motor: Motor, until: Switch) -> Start:
    """A motor for delta that starts in star: voltage 1/sqrt(3), torque 1/3 and line current 1/3 of those in delta.

    Source: Fischer, Elektrische Maschinen, 14th ed., chapter 5 (star-delta starting); Chapman, Electric Machinery
    Fundamentals, 5th ed., section 6.8; IEC 60947-4-1.

    >>> from flywheel.components.motors import Induction
    >>> motor = Induction(power=7500.0, speed=151.8, poles=4, frequency=50.0, breakdown_ratio=2.5)
    >>> star = Started.of(motor, star_delta(motor, Switch(time=3.0)), (3.0,))
    >>> [round(float(star.torque_at(100.0, t) / motor.torque(100.0)), 9) for t in (2.0, 4.0)]
    [0.333333333, 1.0]
    >>> [round(float(star.current_at(100.0, t) / motor.current_share(100.0)), 9) for t in (2.0, 4.0)]
    [0.333333333, 1.0]
    """
    _checked((until,))
    root = 1.0 / math.sqrt(3.0)
    return Start("star-delta", (Connection(motor, until, voltage=root, line=root),))


def transformer(motor: Motor, voltage: float, until: Switch) -> Start:
    """A motor that starts on an autotransformer at a share v of the voltage: torque v², current in the line v².

    Source: Chapman, Electric Machinery Fundamentals, 5th ed., section 6.8; NEMA MG 1, part 1 (starting methods).
    """
    refuse(number_faults("voltage", voltage, POSITIVE))
    _checked((until,))
    if not voltage < 1:
        raise SceneError([Fault("voltage", f"{voltage:g}", "a share of the voltage below 1")])
    return Start("autotransformer", (Connection(motor, until, voltage=voltage, line=voltage),))


def soft_start(
    motor: Motor,
    until: Switch | None = None,
    voltage: float = 1.0,
    ramp: float = 0.0,
    torque_limit: float | None = None,
    current_limit: float | None = None,
) -> Start:
    """A motor with a controller of its voltage: torque is proportional to the square of the voltage, current to the voltage.

    Args:
        motor: an induction motor.
        until: time or speed at which the controller is bridged; default: end of the ramp, or with a limit the rated speed.
        voltage: share at t = 0 of a ramp.
        ramp: s, in which the voltage rises evenly to its full value.
        torque_limit: greatest torque, over the rated one.
        current_limit: greatest line current, over the rated one.

    Raises:
        SceneError: for values out of range, a start without ramp or limit, a limit of a motor without a rated point.

    Harmonics of the cut voltage are left out. Source: IEC 60947-4-2 (semiconductor motor controllers).

    """
    limits = {"voltage": voltage, "torque_limit": torque_limit, "current_limit": current_limit}
    faults = [fault for name, value in limits.items() if value is not None for fault in number_faults(name, value, POSITIVE)]
    if not faults and voltage > 1:
        faults.append(Fault("voltage", f"{voltage:g}", "a share of the voltage of 1 at most"))
    if not ramp and voltage != 1:
        faults.append(Fault("voltage", f"{voltage:g} without a ramp", 'a ramp with it, such as "5 s"'))
    elif not ramp and torque_limit is None and current_limit is None:
        faults.append(Fault("type", "a soft start that limits nothing", "a ramp, a torque_limit or a current_limit"))
    if current_limit is not None and motor.share_law() is None:
        faults.append(Fault("current_limit", f"a motor of which no current is known ({motor.title})", "an induction motor"))
    if until is None and motor.rated is None and (torque_limit is not None or current_limit is not None):
        faults.append(Fault("until", "none for a motor without a rated speed", 'a time or speed, such as "1400 rpm"'))
    elif torque_limit is not None and motor.rated is None:
        faults.append(Fault("torque_limit", "a motor without a rated torque", "an induction motor, or a ramp"))
    refuse(faults)
    if until is None:
        limited = torque_limit is not None or current_limit is not None
        until = Switch(speed=motor.rated.speed) if limited and motor.rated is not None else Switch(time=ramp)
    _checked((until,))
    limit = None if torque_limit is None or motor.rated is None else torque_limit * motor.rated.torque
    return Start("soft start", (Connection(motor, until, voltage, 1.0, ramp, limit, current_limit),))


def resistance_steps(motor: Motor, added: Sequence[float], untils: Sequence[Switch]) -> Start:
    """A motor with resistors in its rotor (slip rings) or armature (DC), which are removed step by step.

    Args:
        motor: an induction motor, or a DC motor without inductance.
        added: resistance over the winding's own, one for each step.
        untils: end of each step.

    Raises:
        SceneError: for steps that do not match, resistances that do not fall, or a motor that has no such winding.

    With a resistance a times the rotor's own added, torque and current are those of the slip s/(1 + a): the breakdown torque
    is unchanged, its slip grows. Source: Fischer, Elektrische Maschinen, 14th ed., chapter 5 (slip-ring rotor); Chapman,
    Electric Machinery Fundamentals, 5th ed., sections 6.7 and 8.8 (DC starters).

    >>> from flywheel.components.motors import Induction
    >>> motor = Induction(power=7500.0, speed=151.8, poles=4, frequency=50.0, breakdown_ratio=2.5)
    >>> start = resistance_steps(motor, [1 / motor.breakdown_slip - 1], [Switch(speed=100.0)])
    >>> round(float(start.connections[0].motor.torque(0.0)) / motor.breakdown_torque, 12)
    1.0

    """
    if len(added) != len(untils) or not added:
        defect = f"{len(added)} resistances and {len(untils)} ends"
        raise SceneError([Fault("until", defect, "an end for each resistance")])
    refuse([fault for i, share in enumerate(added) for fault in number_faults(f"added[{i}]", share, POSITIVE)])
    for i, share in enumerate(added[1:], 1):
        if not share < added[i - 1]:
            defect = f"a resistance of {share:g} after one of {added[i - 1]:g}"
            raise SceneError([Fault(f"added[{i}]", defect, "resistances that fall")])
    _checked(untils)
    check_start(motor, "resistance")
    steps = zip(added, untils, strict=True)
    return Start("resistance steps", tuple(Connection(motor.with_resistance(share), until) for share, until in steps))


def field_steps(motor: Motor, field: Sequence[float], untils: Sequence[Switch]) -> Start:
    """A DC motor that starts with another field: constant k times a share, until it is switched to its own.

    A motor that runs with a weakened field starts with the full one, a share above 1. Source: Chapman, Electric Machinery
    Fundamentals, 5th ed., section 8.4 (speed by field current).
    """
    if len(field) != len(untils) or not field:
        raise SceneError([Fault("until", f"{len(field)} fields and {len(untils)} ends", "an end for each field")])
    refuse([fault for i, share in enumerate(field) for fault in number_faults(f"field[{i}]", share, POSITIVE)])
    _checked(untils)
    check_start(motor, "field")
    steps = zip(field, untils, strict=True)
    return Start("field steps", tuple(Connection(motor.with_field(share), until) for share, until in steps))


@dataclass(frozen=True, kw_only=True)
class Started(Motor):
    """A motor along a motion, switched on at t = 0 and between its connections at `times` (s): a law of speed and time.

    `connections` are as many as `times`, or one more if a switch does not occur; then the motor itself.
    """

    own: Motor
    connections: tuple[Connection, ...]
    times: tuple[float, ...]
    title: ClassVar[str] = "motor that is started"

    @classmethod
    def of(cls, motor: Motor, start: Start, times: Sequence[float]) -> Started:
        """A motor by its start, whose first switches come at `times`; it stays in the connection after the last of them."""
        connections = start.connections[: len(times) + 1]
        return cls(own=motor, connections=connections, times=tuple(times), inertia=motor.inertia)

    def law(self) -> Expression:
        """The torque on the shaft, N m, by `omega` and `t`."""
        laws = [connection.law() for connection in self.connections]
        if len(laws) == len(self.times):
            laws.append(self.own.law().tree)
        tree = laws[-1]
        for time, law in zip(reversed(self.times), reversed(laws[:-1]), strict=True):
            tree = Node("if", (before(time), law, tree))
        return Expression(f"torque of a {self.own.title} as it is started", tree)

    @property
    def no_load_speed(self) -> float | None:
        """The no-load speed of the running motor, rad/s."""
        return self.own.no_load_speed

    @property
    def stable(self) -> Span | None:
        """The running branch of the motor as it runs, rad/s."""
        return self.own.stable

    @property
    def rated(self) -> Point | None:
        """The rated point of the motor as it runs."""
        return self.own.rated

    @property
    def covers(self) -> Span:
        """Speeds (rad/s) of the motor's data."""
        return self.own.covers

    @property
    def rated_current(self) -> float | None:
        """Rated current of the motor as it runs, A."""
        return self.own.rated_current

    def torque_at(self, omega: ArrayLike, time: ArrayLike) -> Array:
        """Torque on the shaft (N m) at speeds omega (rad/s) and times (s)."""
        speeds, times = np.broadcast_arrays(np.asarray(omega, dtype=float), np.asarray(time, dtype=float))
        torques: Array = np.zeros(speeds.shape) + self._law.evaluate({"omega": speeds, "t": times}, np)
        return torques

    def current_at(self, omega: ArrayLike, time: ArrayLike, within: ArrayLike | None = None) -> Array | None:
        """Line or armature current over the rated one at speeds (rad/s) and times (s); None if the type does not give it.

        For a DC motor without a rated current in A. `within` are times that decide the connection, on either side of a
        switch.
        """

        def line(one: Connection, speed: Array, torque: Array) -> Array | None:
            current = one.motor.windings_share(speed, torque, self.own)
            return None if current is None else current * one.line

        return self._by_connection(omega, time, within, line)

    def windings_at(self, omega: ArrayLike, time: ArrayLike, within: ArrayLike | None = None) -> Array | None:
        """Current of the windings over the rated one, which heats them, both in star and in delta."""
        return self._by_connection(omega, time, within, lambda one, *at: one.motor.windings_share(*at, self.own))

    def heat_at(self, omega: ArrayLike, time: ArrayLike, within: ArrayLike | None = None) -> Array | None:
        """Heat (W) in an induction motor's rotor or a DC motor's armature itself, without added resistors."""
        return self._by_connection(omega, time, within, lambda one, *at: one.motor.split_heat(*at, self.own)[0])

    def input_power_at(self, omega: ArrayLike, time: ArrayLike, within: ArrayLike | None = None) -> Array:
        """Power (W) that the motor takes from its inverter."""
        return np.asarray(self._by_connection(omega, time, within, lambda one, *at: one.motor.input_power(*at)))

    def added_heat_at(self, omega: ArrayLike, time: ArrayLike, within: ArrayLike | None = None) -> Array | None:
        """Heat (W) in the resistors that are added to rotor or armature."""
        return self._by_connection(omega, time, within, lambda one, *at: one.motor.split_heat(*at, self.own)[1])

    def current_along(self, omega: Array, time: Array, switched: Array) -> Array | None:
        """Line or armature current (A) along a motion; None if it is not known."""
        share, rated = self.current_at(omega, time, switched), self.rated_current
        if rated is None and self.own.current(0.0) is not None:  # of a DC motor: `current_at` is in A
            rated = 1.0
        return None if share is None or rated is None else rated * share

    def heat_along(self, omega: Array, time: Array, switched: Array, states: States) -> Array | None:
        """Heat (W) of rotor or armature along a motion."""
        return self.heat_at(omega, time, switched)

    def _by_connection(self, omega: ArrayLike, time: ArrayLike, within: ArrayLike | None, figure: Any) -> Array | None:
        """A figure of each connection by its speeds and torques, at the speeds and times of that one."""
        rows = np.broadcast_arrays(
            *(np.asarray(row, dtype=float) for row in (omega, time, time if within is None else within))
        )
        speeds, times, sides = rows
        torques = np.zeros(speeds.shape)
        connections = [*self.connections, Connection(self.own, Switch(time=math.inf))][: len(self.times) + 1]
        owner = np.searchsorted(np.asarray(self.times), sides, side="right")
        for k, one in enumerate(connections):
            here = owner == k
            connection = one._replace(motor=one.motor.at(times[here]))
            law = Expression("", connection.law())
            torque = np.zeros(speeds[here].shape) + law.evaluate({"omega": speeds[here], "t": times[here]}, np)
            value = figure(connection, speeds[here], torque)
            if value is None:
                return None
            torques[here] = value
        return torques


def as_started(motor: Motor) -> Started:
    """A motor along a motion, with its start if it has one."""
    return motor if isinstance(motor, Started) else Started(own=motor, connections=(), times=(), inertia=motor.inertia)
