"""Induction motors: torque by Kloss's formula, current by the name plate, heat of rotor and stator.

`Plate` has the electrical data of a name plate, `line_current` gives the parts of the line current, and
`Induction` is the motor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flywheel.components.energy import Energy
from flywheel.components.motors.motor import (
    Array,
    Fact,
    Motor,
    Point,
    ShaftMotion,
    Span,
    States,
    figure_and_error,
    floats,
    rpm,
    wrong_field,
    wrong_numbers,
)
from flywheel.language import text as _
from flywheel.numerics.cells import ROUNDING, Cells
from flywheel.numerics.expressions import Expression, compiled
from flywheel.numerics.faults import POSITIVE, Fault, SceneError, number_faults, refuse

USUAL_SLIP = 0.13
"""The greatest rated slip that is usual: that of motors wound for presses (NEMA design D has 5 to 13 %)."""

MOST_SLIP = 0.3
"""The greatest rated slip that is accepted: a rotor's efficiency is at most 1 - slip, and wrong poles give more."""

PLATE_ROUNDING = 0.05
"""Tolerance of the rated power by efficiency, power factor, voltage and current: plates give two or three digits."""


class Plate(NamedTuple):
    """Electrical data of an induction motor's name plate, as far as stated.

    Args:
        voltage: U between the lines, V.
        current: I_n of a line at rated load, A.
        power_factor: cos(phi) at rated load.
        efficiency: eta at rated load.
        no_load_current: I_0 of a line without load, A.
        starting_current: of the locked rotor, over the rated one.
        starting_torque: of the locked rotor, over the rated one.
        stator_share: share of the stator's copper in the rated losses outside the rotor; a half is usual.
        locked_rotor_time: time for which the warm motor withstands its starting current, s.
        locked_rotor_time_cold: the same of the cold motor, s.

    """

    voltage: float | None = None
    current: float | None = None
    power_factor: float | None = None
    efficiency: float | None = None
    no_load_current: float | None = None
    starting_current: float | None = None
    starting_torque: float | None = None
    stator_share: float = 0.5
    locked_rotor_time: float | None = None
    locked_rotor_time_cold: float | None = None


BARE = Plate()
"""A plate without electrical data."""


class LineCurrent(NamedTuple):
    """The line current at rated load in its parts, as shares of it: those in phase with the voltage, and those lagging.

    `active` is the load's part, proportional to torque, and `losses` that of the other losses, the same at any load.
    `magnetizing` flows at rated load, `idle` without load. `rated` is the current itself, A, `efficiency` the matching rated
    one, both None if unknown; `complete` is true if the magnetizing current is known.
    """

    active: float
    losses: float
    magnetizing: float
    idle: float
    rated: float | None
    efficiency: float | None
    complete: bool


def line_current(plate: Plate, power: float, rated_slip: float, breakdown_slip: float) -> LineCurrent:
    """The parts of the line current that pass through the rated point of a plate exactly.

    The rotor circuit that gives Kloss's torque, R/s + jX behind a stiff voltage with s_b = R/X, takes the active current
    I_a = T omega_s/(sqrt(3) U) and, behind the voltage, I_a s/s_b. In addition the motor takes I_w for its other losses and
    the magnetizing current I_m. At the rated point I_a + I_w = I_n cos(phi) and I_a s_n/s_b + I_m = I_n sin(phi), and the
    air gap's part of the input is eta/(1 - s_n). Where the no-load current is given, I_0² = I_w² + I_m² there, and the
    magnetizing current goes from that to the rated one with the load. Without a power factor the losses are taken as zero,
    and without either the whole current is that of the rotor circuit: I/I_n = sqrt(T s/(T_n s_n)).

    Args:
        plate: its data.
        power: P at the shaft, W.
        rated_slip: s_n.
        breakdown_slip: s_b of Kloss's formula.

    Raises:
        SceneError: for a plate that contradicts itself, with the numbers.

    Valid where voltage is stiff and saturation the same at all loads. Source: Fischer, Elektrische Maschinen, 14th ed.,
    chapter 5 (circle diagram with the stator's resistance neglected); Fitzgerald et al., Electric Machinery, 6th ed.,
    chapter 6; IEC 60034-1 (data of a plate).

    >>> plate = Plate(voltage=400.0, current=15.0, power_factor=0.83)
    >>> current = line_current(plate, 7500.0, 1 / 30, 0.16)
    >>> round(current.efficiency, 4), round(current.active + current.losses, 9), round(15.0 * current.magnetizing, 3)
    (0.8695, 0.83, 6.033)

    """
    cosine, current, efficiency = _rated_triple(plate, power, rated_slip)
    tilt = rated_slip / breakdown_slip
    if plate.no_load_current is not None and current is None:
        raise SceneError(
            [
                Fault(
                    "no_load_current",
                    f"{plate.no_load_current:.6g} A",
                    "a current with it",
                    "its share of that current is part of the result",
                )
            ]
        )
    idle = None if plate.no_load_current is None or current is None else plate.no_load_current / current
    if cosine is None:
        magnetizing = idle or 0.0
        square = 1.0 + tilt * tilt
        if not magnetizing < 1:
            raise SceneError([_idle_fault(plate, current, "below the rated current")])
        active = ((square - magnetizing**2) ** 0.5 - tilt * magnetizing) / square
        return LineCurrent(active, 0.0, magnetizing, magnetizing, current, efficiency, idle is not None)
    active = cosine * (1.0 if efficiency is None else efficiency / (1.0 - rated_slip))
    losses, behind = cosine - active, ((1.0 - cosine) * (1.0 + cosine)) ** 0.5
    magnetizing = behind - tilt * active
    if magnetizing < 0:
        highest = math.cos(math.atan(tilt * active / cosine))
        expected = f"{highest:.3g} at most, as breakdown_ratio and speed have it"
        advice = (
            f"with a breakdown at a slip of {breakdown_slip:.3g} the load's reactive current alone is {tilt * active:.3g}"
        )
        raise SceneError([Fault("power_factor", f"{cosine:.4g}", expected, f"{advice} of the rated one")])
    if idle is None or current is None:
        return LineCurrent(active, losses, magnetizing, magnetizing, current, efficiency, True)
    if not losses < idle < 1:
        expected = f"between {losses * current:.4g} A, the current of the losses, and the rated current"
        raise SceneError([_idle_fault(plate, current, expected)])
    return LineCurrent(active, losses, magnetizing, ((idle - losses) * (idle + losses)) ** 0.5, current, efficiency, True)


def _idle_fault(plate: Plate, current: float | None, expected: str, advice: str = "") -> Fault:
    beside = f" with {current:.6g} A at rated load"
    return Fault("no_load_current", f"{plate.no_load_current:.6g} A{beside}", expected, advice)


def _rated_triple(plate: Plate, power: float, rated_slip: float) -> tuple[float | None, float | None, float | None]:
    """Power factor, line current (A) and efficiency at rated load, each from the plate or from the others, if possible.

    P = sqrt(3) U I cos(phi) eta; if all four are on the plate, current and power factor decide.
    """
    cosine, current, efficiency = plate.power_factor, plate.current, plate.efficiency
    apparent = None if plate.voltage is None or current is None else math.sqrt(3.0) * plate.voltage * current
    if apparent is not None and cosine is not None and efficiency is not None:
        power_from_plate = apparent * cosine * efficiency
        if not (1.0 - PLATE_ROUNDING) * power <= power_from_plate <= (1.0 + PLATE_ROUNDING) * power:
            product = f"{power_from_plate:.5g} W of sqrt(3) voltage current power_factor efficiency"
            advice = "check the voltage (between lines) and the current (of that connection)"
            expected = f"the rated power of {power:.5g} W, but for rounding"
            raise SceneError([Fault("efficiency", product, expected, advice)])
    if apparent is not None and cosine is not None:
        efficiency = power / (apparent * cosine)
    elif apparent is not None and efficiency is not None:
        cosine = power / (apparent * efficiency)
        if not cosine < 1:
            defect, expected = f"{power / efficiency:.5g} W drawn of {apparent:.5g} V A", "less power than sqrt(3) U I"
            raise SceneError([Fault("current", defect, expected, "power_factor is below 1")])
    elif plate.voltage is not None and cosine is not None and efficiency is not None:
        current = power / (math.sqrt(3.0) * plate.voltage * cosine * efficiency)
    if efficiency is not None and not efficiency < 1.0 - rated_slip:
        defect = f"{efficiency:.4g}" if plate.efficiency is not None else f"an efficiency of {efficiency:.4g}"
        expected = f"below {1.0 - rated_slip:.4g}, the limit set by the rotor's loss at a slip of {rated_slip:.3g}"
        where = "efficiency" if plate.efficiency is not None else "current"
        raise SceneError([Fault(where, defect, expected, "check power, voltage, current and power_factor")])
    return cosine, current, efficiency


@dataclass(frozen=True, kw_only=True)
class Induction(Motor):
    """An induction motor on a stiff mains, by Kloss's formula: T = 2 T_b/(s/s_b + s_b/s).

    The slip is s = (omega_s - omega)/omega_s, synchronous speed omega_s = 2 pi f/(pole pairs). The breakdown slip follows
    from the rated point and lambda = T_b/T_n: s_b = s_n (lambda + sqrt(lambda² - 1)), so that the curve passes through the
    rated point exactly. The law is written in u = omega_s - omega and u_b = s_b omega_s, T = 2 T_b u_b u/(u² + u_b²), which
    is smooth through synchronous speed.

    Args:
        power: rated power at the shaft, W.
        speed: rated speed omega_n, rad/s, below synchronous.
        poles: number of poles, 2, 4, 6...
        frequency: f of the mains, Hz.
        breakdown_ratio: lambda, breakdown torque over rated torque, above 1.
        plate: electrical data of the name plate.
        added_resistance: in the circuit of a rotor with slip rings, over the rotor's own: torque and current are then those
            of the slip s/(1 + a), so that the plate's rated point holds without it.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range, for a rated speed that does not match poles and frequency, and for a plate
            that contradicts itself.

    If the plate has a starting torque or current, the curve from breakdown down to rest reaches it: Kloss's value is raised
    by x²(3 - 2x) of the difference at rest, x = (omega_b - omega)/omega_b, so that the running branch is unchanged and there
    is no kink. Both are interpolated in between.

    Valid for slow changes (electrical transients die away within some periods of the mains) and slips up to about the
    breakdown slip: stator resistance is neglected. From rest to breakdown real motors give more torque than Kloss's formula,
    by skin effect in their bars, or less in a saddle; take a `Curve` where run-up matters and the catalogue has one. Above
    synchronous speed it generates. Source: M. Kloss, Drehmoment und Schlüpfung des Drehstrommotors, Archiv für
    Elektrotechnik 5 (1916); Fischer, Elektrische Maschinen, 14th ed.; Fitzgerald et al., Electric Machinery, 6th ed.,
    chapter 6, and Chapman, Electric Machinery Fundamentals, 5th ed., chapter 6 (the circuit that it simplifies).

    >>> motor = Induction(power=7500.0, speed=1450 * math.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.5)
    >>> round(motor.rated.torque, 4), round(motor.rated_slip, 6), round(motor.breakdown_slip, 6)
    (49.3929, 0.033333, 0.15971)
    >>> round(float(motor.torque(motor.speed)), 4), round(motor.breakdown.torque, 4)
    (49.3929, 123.4823)

    """

    power: float
    speed: float
    poles: int
    frequency: float
    breakdown_ratio: float
    plate: Plate = BARE
    added_resistance: float = 0.0
    title: ClassVar[str] = "induction motor"
    formula: ClassVar[str] = "Kloss: T = 2 Tₘ/(s/sₖ + sₖ/s), Tₘ the breakdown torque, sₖ its slip, s = 1 − ω/ω₀."
    heated: ClassVar[str | None] = "rotor_heat"
    starts: ClassVar[tuple[str, ...]] = ("star-delta", "transformer", "soft", "resistance")
    takes_power: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuses values out of range, and those that contradict each other."""
        refuse(wrong_numbers(self, ("power", "speed", "frequency")) + wrong_field(self, "breakdown_ratio"))
        slip = self.rated_slip
        if not 0.0 < slip <= MOST_SLIP:  # it lies a little below synchronous speed; if not, the poles that would go with it
            field = 2 * math.pi * self.frequency  # of two poles
            pairs = math.floor(field / self.speed)
            fitting = pairs < 100 and 0.0 < 1 - self.speed * pairs / field <= MOST_SLIP
            defect = f"{rpm(self.speed)}, a slip of {slip:.3g}"
            expected = (
                f"a little less than the {rpm(self.synchronous_speed)} of {self.poles:g} poles at {self.frequency:g} Hz"
            )
            advice = f"a motor of this speed has {2 * pairs} poles" if fitting else ""
            raise SceneError([Fault("speed", defect, expected, advice)])
        self._check_plate()

    def _check_plate(self) -> None:
        """Refuses data of the plate that are out of range, or contradict the rest."""
        plate = {name: value for name, value in self.plate._asdict().items() if value is not None}
        faults = [fault for name, value in plate.items() for fault in number_faults(name, value, POSITIVE)]
        shares = ("power_factor", "efficiency", "stator_share")
        faults += [Fault(name, f"{plate[name]:g}", "a share of 1 at most") for name in shares if not plate.get(name, 0) <= 1]
        refuse(faults)
        start, current = self.plate.starting_torque, self.plate.starting_current
        if (start is not None or current is not None) and not self.own_breakdown_slip < 1:
            defect = f"with a breakdown at a slip of {self.own_breakdown_slip:.3g}, which lies beyond rest"
            name = "starting_torque" if start is not None else "starting_current"
            faults.append(Fault(name, defect, "none: rest lies on the running branch", "leave it out, or check the speed"))
        elif start is not None and start > self.breakdown_ratio:
            expected = f"the breakdown_ratio of {self.breakdown_ratio:g} at most, which is the greatest"
            faults.append(Fault("starting_torque", f"{start:g} of the rated torque", expected))
        warm, cold = self.plate.locked_rotor_time, self.plate.locked_rotor_time_cold
        if warm is not None and cold is not None and cold < warm:
            expected = f"at least the {warm:g} s of the warm one"
            faults.append(Fault("locked_rotor_time_cold", f"{cold:g} s of the cold motor", expected))
        if current is not None and not current > 1:
            faults.append(Fault("starting_current", f"{current:g} of the rated current", "more than 1; 4 to 8 is usual"))
        refuse(faults)
        _ = self.line_current

    @cached_property
    def synchronous_speed(self) -> float:
        """Speed 2 pi f/(pole pairs) of the field, rad/s."""
        return 4 * math.pi * self.frequency / self.poles

    @property
    def rated_slip(self) -> float:
        """Slip s_n at rated speed."""
        return (self.synchronous_speed - self.speed) / self.synchronous_speed

    @property
    def breakdown_slip(self) -> float:
        """Slip s_b at which torque is greatest: s_n (lambda + sqrt(lambda² - 1)), more with added resistance."""
        return self.own_breakdown_slip * (1.0 + self.added_resistance)

    @property
    def own_breakdown_slip(self) -> float:
        """Breakdown slip without added resistance."""
        ratio = self.breakdown_ratio
        slip: float = self.rated_slip * (ratio + ((ratio - 1) * (ratio + 1)) ** 0.5)
        return slip

    @property
    def breakdown_torque(self) -> float:
        """The greatest torque T_b, N m."""
        return self.breakdown_ratio * self.rated.torque

    @property
    def rated(self) -> Point:
        """The point of the name plate."""
        return Point(self.speed, self.power / self.speed)

    @property
    def doubts(self) -> tuple[str, ...]:
        """A rated slip beyond the usual, which another frequency or number of poles may explain."""
        if self.rated_slip <= USUAL_SLIP:
            return ()
        doubt = f"the motor's rated slip is {self.rated_slip:.3g}, as {self.poles:g} poles at {self.frequency:g} Hz turn at"
        return (f"{doubt} {rpm(self.synchronous_speed)} without load: check its speed, frequency and poles",)

    @property
    def no_load_speed(self) -> float:
        """Synchronous speed, rad/s: an ideal motor has no friction."""
        return self.synchronous_speed

    @property
    def stable(self) -> Span:
        """The range of speeds from breakdown as a motor to breakdown as a generator, rad/s."""
        reach = self.breakdown_slip * self.synchronous_speed
        return self.synchronous_speed - reach, self.synchronous_speed + reach

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        reach, plate = self.breakdown_slip * self.synchronous_speed, self.plate
        kloss = compiled(
            "{top}*({field} - omega)/(({field} - omega)**2 + {square})",
            top=2 * self.breakdown_torque * reach,
            field=self.synchronous_speed,
            square=reach**2,
        )
        if plate.starting_torque is None and plate.starting_current is None:
            return kloss
        start = plate.starting_torque  # a current that is corrected alone ends the pieces there, too
        missing = 0.0 if start is None else start * self.rated.torque - self._kloss(0.0).item()
        return self._down_to_rest(kloss, missing)

    def _kloss(self, omega: ArrayLike) -> Array:
        """Torque by Kloss's formula alone, N m."""
        slip = self.slip(omega)
        return np.asarray(2.0 * self.breakdown_torque * self.breakdown_slip * slip / (slip**2 + self.breakdown_slip**2))

    def slip_speed(self, omega: ArrayLike) -> Array:
        """Slip speed u = omega_s - omega (rad/s) at speeds omega (rad/s), of their shape."""
        return np.asarray(self.synchronous_speed - floats(omega))

    def constant_share(self, omega: ArrayLike) -> Array:
        """The losses outside the copper over those at the rated point, at speeds omega (rad/s), of their shape: 1."""
        return np.ones_like(floats(omega))

    def slip(self, omega: ArrayLike) -> Array:
        """Slip s = (omega_s - omega)/omega_s at speeds omega (rad/s), of their shape."""
        return np.asarray((self.synchronous_speed - floats(omega)) / self.synchronous_speed)

    @cached_property
    def line_current(self) -> LineCurrent:
        """The parts of the line current at rated load."""
        return line_current(self.plate, self.power, self.rated_slip, self.own_breakdown_slip)

    @property
    def rated_current(self) -> float | None:
        """Current of a line at rated load, A; None if the plate does not give it."""
        return self.line_current.rated

    def current_share(self, omega: ArrayLike) -> Array:
        """Line current over the rated one at speeds omega (rad/s), of their shape: its size, in either direction of power.

        The parts of `line_current`: in phase I_a T/T_n + I_w, lagging I_a T/T_n s/s_b and the magnetizing current. The
        latter rises with the load from I_0m to I_0m + (I_m - I_0m) 2 q/(1 + q), q = T s/(T_n s_n).

        >>> motor = Induction(power=7500.0, speed=1450 * math.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.5,
        ...                   plate=Plate(voltage=400.0, current=15.0, power_factor=0.83, starting_current=6.5))
        >>> motor.current_share([0.0, motor.speed, motor.synchronous_speed]).round(4).tolist()
        [6.5, 1.0, 0.4105]
        """
        speeds = floats(omega)
        shares: Array = np.zeros_like(speeds) + self._share_law.evaluate({"omega": speeds}, np)
        return shares

    @cached_property
    def _share_law(self) -> Expression:
        return self.share_law()

    def share_law(self) -> Expression:
        """The line current over the rated one as an expression of `omega`: see `current_share`."""
        without = self._share_by_circuit()
        if self.plate.starting_current is None:
            return without
        missing = self.plate.starting_current - without.evaluate({"omega": np.float64(0.0)}, np)
        return self._down_to_rest(without, missing)

    def _share_by_circuit(self) -> Expression:
        parts = self.line_current
        slip = compiled("({field} - omega)/{field}", field=self.synchronous_speed)
        square = self.breakdown_slip**2
        if parts.losses == parts.magnetizing == parts.idle == 0.0:
            reach = (1.0 + (self.own_breakdown_slip / self.rated_slip) ** 2) ** 0.5
            return compiled("{reach}*abs({slip})/sqrt({slip}**2 + {square})", reach=reach, slip=slip, square=square)
        top = 2 * self.breakdown_ratio * self.breakdown_slip  # of the torque over the rated one
        torque = compiled("{top}*{slip}/({slip}**2 + {square})", top=top, slip=slip, square=square)
        magnetizing = compiled("{idle}", idle=parts.idle)
        if parts.idle != parts.magnetizing:
            rated = self.rated_slip * (1.0 + self.added_resistance)
            heat = compiled(
                "{torque}*{slip}/{rated}", torque=torque, slip=slip, rated=rated
            )  # the rotor's, over the rated one
            rise = 2.0 * (parts.magnetizing - parts.idle)
            magnetizing = compiled("{idle} + {rise}*{heat}/(1 + {heat})", idle=parts.idle, rise=rise, heat=heat)
        return compiled(
            "sqrt(({load} + {losses})**2 + ({load}*{slip}/{breakdown} + {magnetizing})**2)",
            load=compiled("{active}*{torque}", active=parts.active, torque=torque),
            losses=parts.losses,
            slip=slip,
            breakdown=self.breakdown_slip,
            magnetizing=magnetizing,
        )

    def _down_to_rest(self, law: Expression, missing: float) -> Expression:
        """A law of omega raised by the difference at rest, from breakdown down to there: see the class."""
        return compiled(
            "{law} if omega >= {least} else "
            "({law} + {missing}*(1 - omega/{least})**2*(3 - 2*(1 - omega/{least})) if omega >= 0 else {law} + {missing})",
            law=law,
            least=self.stable[0],
            missing=missing,
        )

    def current(self, omega: ArrayLike) -> Array | None:
        """Line current (A) at speeds omega (rad/s), of their shape; None if the rated one is not known."""
        rated = self.rated_current
        return None if rated is None else np.asarray(rated * self.current_share(omega))

    @property
    def rated_stator_heat(self) -> float | None:
        """Copper heat of the stator at rated load, W: its share of P/eta - P/(1 - s_n); None without an efficiency."""
        efficiency = self.line_current.efficiency
        if efficiency is None:
            return None
        return self.plate.stator_share * self.power * (1.0 / efficiency - 1.0 / (1.0 - self.rated_slip))

    @property
    def constant_losses(self) -> float | None:
        """The rated losses outside rotor and stator copper, W: iron, ventilation, friction; None without an efficiency."""
        copper = self.rated_stator_heat
        return None if copper is None else copper * (1.0 / self.plate.stator_share - 1.0)

    def stator_heat(self, omega: ArrayLike) -> Array | None:
        """Copper heat of the stator, W, at speeds omega (rad/s): the rated one times (I/I_n)²; None without an efficiency.

        >>> motor = Induction(power=7500.0, speed=1450 * math.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.5,
        ...                   plate=Plate(power_factor=0.83, efficiency=0.87))
        >>> rated = float(motor.stator_heat(motor.speed)) + motor.constant_losses + float(motor.rotor_heat(motor.speed))
        >>> round(rated, 9), round(7500.0 / 0.87 - 7500.0, 9)
        (1120.689655172, 1120.689655172)
        """
        copper = self.rated_stator_heat
        return None if copper is None else np.asarray(copper * self.current_share(omega) ** 2)

    def rotor_heat(self, omega: ArrayLike) -> Array:
        """Heat in the rotor, W, at speeds omega (rad/s), of their shape: torque times slip speed, T (omega_s - omega).

        The field gives the rotor T omega_s, the shaft takes T omega. A generator's heat is above 0, too, because both
        factors change their sign. Kloss's formula leaves out the stator's resistance; the heat of the load's current there
        is in proportion to the rotor's, by the square of the same current. Source: Fitzgerald et al. and Chapman, as above.

        >>> motor = Induction(power=7500.0, speed=1450 * math.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.5)
        >>> round(float(motor.rotor_heat(motor.speed)), 6), round(7500.0 * motor.rated_slip / (1 - motor.rated_slip), 6)
        (258.62069, 258.62069)
        """
        speeds = floats(omega)
        return np.asarray(self.torque(speeds) * self.slip_speed(speeds))

    def heat(self, omega: Any, states: States = ()) -> Any:
        """Heat in the rotor, W."""
        return self.rotor_heat(omega)

    def split_heat(self, omega: Array, torque: Array, running: Motor) -> tuple[Array | None, Array | None]:
        """Heat (W) in the rotor's own winding, and in the resistors behind its slip rings."""
        heat, added = torque * self.slip_speed(omega), self.added_resistance
        return heat / (1.0 + added), heat * added / (1.0 + added)

    def heats(self, shaft: ShaftMotion) -> dict[str, Any]:
        """Heat of the rotor, the mean of T (omega_s - omega) over time; current and copper heat of the stator by the plate.

        The stator's heat over that at the rated point is the mean of (I/I_n)².
        """

        def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
            speed = shaft.ratio * omega
            slope = self.slope_at(speed) * self.slip_speed(speed) - self.torque(speed)
            return self.rotor_heat(speed), shaft.ratio * np.abs(slope)

        mean, error, _ = shaft.mean_over_time(heat)
        figure, relative = figure_and_error(mean, error, float(self.rotor_heat(0.0)))
        rated = self.rated_heat
        errors = {"rotor_heat": relative, "rotor_heat_share": relative + 8 * ROUNDING / self.rated_slip}
        figures: dict[str, Any] = {"rotor_heat": figure, "rotor_heat_share": figure / rated}
        if not self.line_current.complete:
            return {**figures, "errors": errors}
        mean, error, _ = shaft.mean_square(shaft.current_law)
        _, peak, off = shaft.extremes(shaft.current_law)
        figures["stator_heat_share"], errors["stator_heat_share"] = mean, error / mean
        if (rated_heat := self.rated_stator_heat) is not None:
            figures["stator_heat"], errors["stator_heat"] = mean * rated_heat, error / mean
        if (current := self.rated_current) is not None:
            figures |= {"current_rms": current * math.sqrt(mean), "current_peak": current * peak}
            errors |= {"current_rms": error / mean, "current_peak": off / peak}
        return {**figures, "errors": errors}

    def locked_rotor_limit(self, cold: bool = False) -> float | None:
        """The integral of (I/I_n)² dt (s) that the plate's time of the locked rotor allows."""
        time = self.plate.locked_rotor_time_cold if cold else self.plate.locked_rotor_time
        return None if time is None else float(self.current_share(0.0)) ** 2 * time

    def powers(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> dict[str, Array]:
        """T (omega_s - omega) ("rotor"), and with an efficiency the stator's copper and constant losses ("iron"), W."""
        stator, constant = self.stator_heat(omega), self.constant_losses
        losses = {}
        if stator is not None and constant is not None:
            losses = {"stator": stator, "iron": constant * self.constant_share(omega)}
        return losses | {"rotor": torque * self.slip_speed(omega)}

    def with_resistance(self, share: float) -> Induction:
        """The motor with resistors behind its slip rings."""
        names = [name for name in ("starting_torque", "starting_current") if getattr(self.plate, name) is not None]
        if names:
            expected = "none with resistance steps"
            advice = "it is a correction for cage rotors; a rotor with slip rings follows Kloss's formula"
            raise SceneError([Fault("type", f"a motor with {' and '.join(names)}", expected, advice)])
        return replace(self, added_resistance=share)

    def facts(self) -> Iterator[Fact]:
        """Kloss's formula with its numbers."""
        *plate, torque = super().facts()
        yield from (*plate, torque)
        rated, table = plate[1], _("Mains (Hz) and catalogue")
        frequency = Fact(_("frequency of the mains"), "f", self.frequency, table=table)
        poles = Fact(_("number of poles"), "p", float(self.poles), table=table)
        ratio = Fact(_("breakdown torque over rated torque"), "lamda", self.breakdown_ratio, table=table)
        yield from (frequency, poles, ratio)
        numbers = (frequency, poles)
        field = Fact(_("Synchronous speed"), "omega_s", self.synchronous_speed, "rad/s", "omega_s = 4*pi*f/p", numbers)
        yield field
        slip = Fact(_("Rated slip"), "s_n", self.rated_slip, "", "s_n = (omega_s - omega_n)/omega_s", (field, rated))
        yield slip
        yield Fact(_("Breakdown torque"), "T_b", self.breakdown_torque, "N m", "T_b = lamda*T_n", (ratio, torque))
        through, numbers = _("Breakdown slip, such that the curve passes through the rated point"), (slip, ratio)
        yield Fact(through, "s_b", self.breakdown_slip, "", "s_b = s_n*(lamda + sqrt(lamda**2 - 1))", numbers)
        yield Fact(_("Slip at any speed"), "s", formula="s = (omega_s - omega)/omega_s")
        yield Fact(_("Torque (Kloss)"), "T", formula="T(s) = 2*T_b/(s/s_b + s_b/s)")

    def heat_facts(self, energy: Energy) -> Iterator[Fact]:
        """Heat of its rotor, line current and heat of its stator by its name plate."""
        if energy.rotor_heat is None:
            yield from super().heat_facts(energy)
            return
        words, mean = (
            _("Mean heat of the rotor over time: torque times slip speed"),
            "Q_r = integral(T*(omega_s - omega_d), t, 0, tau)/tau",
        )
        yield Fact(words, "Q_r", energy.rotor_heat, "W", mean, share=energy.rotor_heat_share)
        if (share := energy.stator_heat_share) is None:
            return
        words = _("Heat of the stator's copper over that at the rated point, by the line current")
        copper = Fact(words, "u_s", share, "", "u_s = integral((I/I_n)**2, t, 0, tau)/tau", share=share)
        yield copper
        if self.rated_current is not None and energy.current_rms is not None:
            words, rated = (
                _("Root of the mean square of the line current over time"),
                Fact("", "I_n", self.rated_current, "A"),
            )
            yield Fact(words, "I_rms", energy.current_rms, "A", "I_rms = I_n*sqrt(u_s)", (rated, copper))

    def speed_at(self, torque: float) -> float | None:
        """Speed on the running branch at which the motor gives a torque: s = s_b q/(1 + sqrt(1 - q²)), q = T/T_b."""
        share = torque / self.breakdown_torque
        if abs(share) > 1:
            return None
        slip = self.breakdown_slip * share / (1 + math.sqrt((1 - share) * (1 + share)))
        return self.synchronous_speed * (1 - slip)
