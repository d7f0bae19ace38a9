"""Motors on an inverter: constant voltage over frequency, weakened field, torque limit."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flywheel.components.motors.induction import Induction
from flywheel.components.motors.motor import Array, Connection, Fact, Inverter, Motor, Point, Span, Start, Switch, floats
from flywheel.language import text as _
from flywheel.numerics.expressions import Expression, compiled, composed
from flywheel.numerics.faults import Fault, SceneError, refuse

OWN_FAN = 0.8
"""Share of the rated frequency below which a fan on the motor's own shaft cools it noticeably less."""
_HALVINGS = 60  # of the range of a slip speed


@dataclass(frozen=True, kw_only=True)
class InverterInduction(Induction):
    """An induction motor on an inverter: at the same slip speed and flux it is the motor on its mains.

    Up to the frequency f_w the voltage is proportional to the frequency f, and the flux is the rated one; beyond, the
    voltage stays constant and the flux falls, phi = min(1, f_w/f). With the slip speed u = omega_f - omega, omega_f = 2 pi
    f/(pole pairs), and T_m, I_m, Q_m of the motor on its mains, where its slip speed is u:

        T = phi² T_m(u),  I = phi I_m(u),  Q = phi² Q_m(u)

    for torque, line current and copper heats. The other losses are proportional to f phi².

    With a torque limit the inverter lowers its frequency where the motor would exceed it, and where it would break down:
    T = T_max while the flux at that speed allows it, else the breakdown torque phi² T_b at omega_f = omega + u_b. A motor
    that is driven has the same limits, braking, at a frequency that rises with it.

    Args:
        inverter: with its frequency.

    The other arguments are those of `Induction`, on the mains of the name plate. `rated` is the point at which the rotor has
    its rated heat at the set frequency.

    Raises:
        SceneError: for values out of range, a torque limit that the motor does not reach, and a field so weak that the motor
            breaks down before its rated heat.

    Valid for slow changes, and frequencies at which the stator's resistance drops little of the voltage, or the inverter
    makes up for it; harmonics are left out. Source: Fischer, Elektrische Maschinen, 14th ed., chapter 5 (speed by
    frequency, weakened field); Chapman, Electric Machinery Fundamentals, 5th ed., section 6.9; Leonhard, Control of
    Electrical Drives, 3rd ed., chapters 10 and 11.

    >>> plate = {"power": 7500.0, "speed": 1450 * math.pi / 30, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
    >>> half = InverterInduction(**plate, inverter=Inverter(25.0, 50.0, torque_limit=1.5))
    >>> round(half.no_load_speed * 30 / math.pi, 9), round(half.rated.speed * 30 / math.pi, 9), round(half.rated.torque, 4)
    (750.0, 700.0, 49.3929)
    >>> half.torque([0.0, half.rated.speed]).round(4).tolist()
    [74.0894, 49.3929]

    """

    inverter: Inverter
    title: ClassVar[str] = "induction motor on an inverter"
    formula: ClassVar[str] = "Kloss, by slip speed: T = φ² 2 Tₘ/(u/uₖ + uₖ/u), u = ω₀ − ω, ω₀ of its frequency, φ the flux."
    starts: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        """Refuses values out of range, and a torque that the motor cannot give."""
        super().__post_init__()
        own, limit = self.inverter, self.inverter.torque_limit
        refuse([fault.under("inverter") for fault in own.faults()])
        faults = []
        if limit is not None and not limit < self.breakdown_ratio:
            expected = f"below the breakdown_ratio of {self.breakdown_ratio:g}"
            faults.append(Fault("inverter.torque_limit", f"{limit:g} of the rated torque", expected))
        if not self.rated_heat < self.breakdown_torque * self._breakdown_reach:
            most = own.weakening * np.sqrt(self.mains.breakdown_torque * self._breakdown_reach / self.rated_heat)
            defect = f"{own.frequency:g} Hz, with the field weakened from {own.weakening:g} Hz on"
            advice = "at that the motor breaks down before it has its rated heat"
            faults.append(Fault("inverter.frequency", defect, f"below {most:.4g} Hz", advice))
        refuse(faults)

    @cached_property
    def mains(self) -> Induction:
        """The motor on the mains of its name plate."""
        own = {one.name: getattr(self, one.name) for one in fields(Induction)}
        return Induction(**own | {"start": None, "inverter": None})

    @property
    def field_speed(self) -> float:
        """Speed of the field at the inverter's frequency, rad/s."""
        return self.synchronous_speed * self.inverter.frequency / self.frequency

    @property
    def weakening_speed(self) -> float:
        """Speed of the field from which the flux falls, rad/s."""
        return self.synchronous_speed * self.inverter.weakening / self.frequency

    def flux(self, field: ArrayLike) -> Array:
        """Flux phi over the rated one at speeds of the field (rad/s), of their shape."""
        return np.asarray(self.weakening_speed / np.maximum(field, self.weakening_speed))

    @property
    def _breakdown_reach(self) -> float:
        """Slip speed u_b at breakdown, rad/s, which no frequency changes."""
        return self.mains.breakdown_slip * self.synchronous_speed

    @property
    def rated_heat(self) -> float:
        """Heat of the rotor at the rated point of the name plate, T_n u_n, W, independent of the limit."""
        return self.mains.rated.torque * (self.synchronous_speed - self.speed)

    @property
    def rated_total_heat(self) -> float:
        """Heat of rotor and stator at the rated point of the name plate, W."""
        return self.mains.rated_total_heat

    @property
    def torque_limit(self) -> float:
        """The greatest torque of the motor on the inverter, N m; infinite without a limit."""
        limit = self.inverter.torque_limit
        return math.inf if limit is None else limit * self.mains.rated.torque

    @property
    def breakdown_torque(self) -> float:
        """The greatest torque at the set frequency, N m."""
        return self.flux(self.field_speed).item() ** 2 * self.mains.breakdown_torque

    @cached_property
    def rated(self) -> Point:
        """The point at the set frequency at which the rotor has the heat of its rated point."""
        if self.flux(self.field_speed) == 1.0:
            return Point(self.field_speed - (self.synchronous_speed - self.speed), self.mains.rated.torque)
        heat, reach = self.rated_heat, self._breakdown_reach  # T u = heat, T = 2 T_b u u_b/(u² + u_b²)
        slip_speed = reach * np.sqrt(heat / (2.0 * self.breakdown_torque * reach - heat))
        return Point(self.field_speed - slip_speed, heat / slip_speed)

    @cached_property
    def corner(self) -> Any:
        """Slip speed (rad/s) at the set frequency beyond which the limit acts, or the motor breaks down."""
        breakdown = self.flux(self.field_speed) ** 2 * self.mains.breakdown_torque
        share = np.minimum(self.torque_limit / breakdown, 1.0)
        return self._breakdown_reach * share / (1.0 + np.sqrt((1.0 - share) * (1.0 + share)))

    @property
    def no_load_speed(self) -> float:
        """Speed of the field, rad/s."""
        return self.field_speed

    @property
    def stable(self) -> Span:
        """The range of speeds from the torque limit, or breakdown, as a motor to the same as a generator, rad/s."""
        return self.field_speed - self.corner, self.field_speed + self.corner

    @property
    def doubts(self) -> tuple[str, ...]:
        """Doubts of the plate, and cooling by a fan that turns slower than at the rated point."""
        share = self.inverter.frequency / self.frequency
        if share >= OWN_FAN:
            return self.mains.doubts
        doubt = f"at {share:.0%} of its rated frequency the motor's own fan cools it less than its rating assumes"
        return (*self.mains.doubts, f"{doubt}: ask its maker for the torque it bears there, or give it a fan of its own")

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        return self._torque_law(compiled("{field}", field=self.field_speed))

    def _torque_law(self, field: Expression) -> Expression:
        """The torque at a set speed of the field (rad/s).

        With a limit the slip speed stays within u_b: the field then exceeds the rotor's speed by no more than that.
        """
        mains, reach = self.mains, self._breakdown_reach
        slip = compiled("{field} - omega", field=field)
        if self.inverter.torque_limit is None:
            at_mains = {"omega": compiled("{mains} - {slip}", mains=self.synchronous_speed, slip=slip).tree}
            law = Expression("", composed(mains.law().tree, at_mains))
        else:
            slip = compiled("min({reach}, max(-{reach}, {slip}))", reach=reach, slip=slip)
            field = compiled("omega + {slip}", slip=slip)
            top = 2.0 * mains.breakdown_torque * reach
            law = compiled("{top}*{slip}/({slip}**2 + {square})", top=top, slip=slip, square=reach**2)
        if self.weakened:
            # a field set no faster than that is faster only with a rotor that brakes: the two are often equal
            faster = field if self.inverter.frequency > self.inverter.weakening else compiled("omega - {r}", r=reach)
            flux = compiled("{w}/max({w}, {faster})", w=self.weakening_speed, faster=faster)
            law = compiled("{flux}**2*{law}", flux=flux, law=law)
        if self.inverter.torque_limit is not None:
            law = compiled("min({most}, max(-{most}, {law}))", most=self.torque_limit, law=law)
        return Expression(f"torque of an {self.title}", law.tree)

    @property
    def weakened(self) -> bool:
        """Tests whether the field may be weakened: at the set frequency, or where a limit lets it turn faster."""
        return self.inverter.frequency > self.inverter.weakening or self.inverter.torque_limit is not None

    def slip_speed(self, omega: ArrayLike) -> Array:
        """Slip speed u (rad/s) at speeds omega (rad/s), of their shape: at the limit that of its torque."""
        speeds = floats(omega)
        if self.inverter.torque_limit is None:
            return np.asarray(self.field_speed - speeds)
        way, reach = np.where(speeds < self.field_speed, 1.0, -1.0), self._breakdown_reach
        share = self.torque_limit / self.mains.breakdown_torque

        def less(u: Array) -> Any:
            return self.flux(speeds + way * u) ** 2 * 2.0 * u * reach / (u * u + reach * reach) < share

        low, greatest = np.zeros_like(speeds), np.minimum(reach, np.abs(speeds - self.field_speed))
        high = greatest
        for _half in range(_HALVINGS):
            u = 0.5 * (low + high)
            low, high = np.where(less(u), u, low), np.where(less(u), high, u)
        within = np.where(less(greatest), greatest, high)
        limited = np.abs(speeds - self.field_speed) > self.corner
        return np.asarray(np.where(limited, way * within, self.field_speed - speeds))

    def current_share(self, omega: ArrayLike) -> Array:
        """Line current over the rated one at speeds omega (rad/s), of their shape."""
        speeds = floats(omega)
        slip_speed = self.slip_speed(speeds)
        return np.asarray(self.flux(speeds + slip_speed) * self.mains.current_share(self.synchronous_speed - slip_speed))

    def speed_at(self, torque: float) -> float | None:
        """Speed (rad/s) on the running branch at which it gives a torque (N m); None if it does not reach it."""
        return Motor.speed_at(self, torque)

    def constant_share(self, omega: ArrayLike) -> Array:
        """The losses outside the copper over those at the rated point: they are proportional to f phi²."""
        field = floats(omega) + self.slip_speed(omega)
        return np.asarray(field / self.synchronous_speed * self.flux(field) ** 2)

    def started(self) -> InverterInduction:
        """The motor with a start by its ramp of frequency, if it has one."""
        if not self.inverter.ramp:
            return self
        ramped = RampedInduction(**{one.name: getattr(self, one.name) for one in fields(InverterInduction)})
        connection = Connection(ramped, Switch(time=self.inverter.ramp))
        return replace(self, start=Start("ramp of frequency", (connection,)))

    def with_resistance(self, share: float) -> Induction:
        """Refuses resistors behind slip rings."""
        raise SceneError([Fault("type", f"an {self.title}", "a motor on its mains")])

    def facts(self) -> Iterator[Fact]:
        """The facts of the motor on its mains, and of its inverter."""
        yield from self.mains.facts()
        own, table = self.inverter, _("Inverter")
        yield Fact(_("frequency of the inverter"), "f_i", own.frequency, "Hz", table=table)
        yield Fact(_("frequency above which the field is weakened"), "f_w", own.weakening, "Hz", table=table)
        if own.torque_limit is not None:
            yield Fact(_("torque limit over rated torque"), "q_i", own.torque_limit, table=table)
        frequency, pairs = Fact("", "f_i", own.frequency, "Hz"), Fact("", "p", float(self.poles))
        yield Fact(_("Speed of the field"), "omega_f", self.field_speed, "rad/s", "omega_f = 4*pi*f_i/p", (frequency, pairs))
        flux, weakening = float(self.flux(self.field_speed)), Fact("", "f_w", own.weakening, "Hz")
        if flux < 1.0:
            yield Fact(_("Flux over the rated one"), "phi_i", flux, "", "phi_i = f_w/f_i", (weakening, frequency))
        yield Fact(_("Rated torque at that frequency, by the rotor's heat"), "T_f", self.rated.torque, "N m")
        yield Fact(_("At the same slip speed torque and heat are φ² times those on the mains, the current φ times."))


@dataclass(frozen=True, kw_only=True)
class RampedInduction(InverterInduction):
    """The motor while the frequency rises: at t it is f t/ramp, and the rest is as at a set frequency.

    Args:
        time: t of the figures, s, one for each speed.

    >>> plate = {"power": 7500.0, "speed": 1450 * math.pi / 30, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
    >>> motor = InverterInduction(**plate, inverter=Inverter(50.0, 50.0, ramp=10.0)).started()
    >>> ramped = motor.start.connections[0].motor.at(np.array([5.0]))
    >>> ramped.rotor_heat([700 * math.pi / 30]).round(4).tolist(), round(motor.rated_heat, 4)
    ([258.6207], 258.6207)

    """

    time: Any = 0.0

    def __post_init__(self) -> None:
        """Does nothing: the motor at its set frequency was checked."""

    def at(self, time: Array) -> RampedInduction:
        """The motor at times, s."""
        return replace(self, time=time)

    @property
    def field_speed(self) -> Any:
        """Speed of the field at the times, rad/s."""
        return super().field_speed * np.minimum(1.0, np.asarray(self.time) / self.inverter.ramp)

    @cached_property
    def rated(self) -> Point:
        """The rated point on the mains: it has no separate one."""
        return self.mains.rated

    def law(self) -> Expression:
        """The torque on the shaft, N m, by `omega` and `t`."""
        return self._torque_law(compiled("{rate}*t", rate=super().field_speed / self.inverter.ramp))

    def torque(self, omega: ArrayLike) -> Array:
        """Torque on the shaft (N m) at speeds omega (rad/s) and the times."""
        speeds = floats(omega)
        return np.asarray(np.zeros_like(speeds) + self._law.evaluate({"omega": speeds, "t": np.asarray(self.time)}, np))

    def windings_share(self, omega: Array, torque: Array, running: Motor) -> Array | None:
        """Line current over the rated one."""
        return self.current_share(omega)
