"""Induction motors: Kloss's formula, heat of the rotor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flywheel.components.motors.motor import Array, Motor, Point, Span, wrong_numbers
from flywheel.numerics.arguments import number_faults, refuse
from flywheel.numerics.expressions import Expression, expression_of, parse
from flywheel.numerics.faults import Fault, SceneError

USUAL_SLIP = 0.13
"""The greatest rated slip that is usual: that of motors wound for presses (NEMA design D has 5 to 13 %)."""

MOST_SLIP = 0.3
"""The greatest rated slip that is believed: a rotor's efficiency is at most 1 - slip, and wrong poles give more."""


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
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range, and for a rated speed that does not go with poles and frequency.

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
    title: ClassVar[str] = "induction motor"

    def __post_init__(self) -> None:
        """Refuse values out of range, and those that contradict each other."""
        poles, ratio = number_faults("poles", self.poles), number_faults("breakdown_ratio", self.breakdown_ratio)
        if not poles and (self.poles < 2 or self.poles % 2):
            poles = [Fault("poles", f"{self.poles:g}", "an even number, 2 or more")]
        if not ratio and self.breakdown_ratio <= 1:
            ratio = [Fault("breakdown_ratio", f"{self.breakdown_ratio:g}", "a number above 1")]
        refuse(wrong_numbers(self, ("power", "speed", "frequency")) + poles + ratio)
        slip = self.rated_slip
        if not 0.0 < slip <= MOST_SLIP:  # it lies a little below synchronous speed; if not, the poles that would go with it
            field = 2 * math.pi * self.frequency  # of two poles
            pairs = math.floor(field / self.speed)
            fitting = pairs < 100 and 0.0 < 1 - self.speed * pairs / field <= MOST_SLIP
            found = f"{_rpm(self.speed)}, a slip of {slip:.3g}"
            wanted = (
                f"a little less than the {_rpm(self.synchronous_speed)} of {self.poles:g} poles at {self.frequency:g} Hz"
            )
            advice = f"a motor of this speed has {2 * pairs} poles" if fitting else ""
            raise SceneError([Fault("speed", found, wanted, advice)])

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
        """Slip s_b at which torque is greatest: s_n (lambda + sqrt(lambda² - 1))."""
        ratio = self.breakdown_ratio
        return self.rated_slip * (ratio + math.sqrt((ratio - 1) * (ratio + 1)))

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
        told = f"the motor's rated slip is {self.rated_slip:.3g}, as {self.poles:g} poles at {self.frequency:g} Hz turn at"
        return (f"{told} {_rpm(self.synchronous_speed)} without load: check its speed, frequency and poles",)

    @property
    def no_load_speed(self) -> float:
        """Synchronous speed, rad/s: an ideal motor has no friction of its own."""
        return self.synchronous_speed

    @property
    def stable(self) -> Span:
        """From breakdown as a motor to breakdown as a generator, rad/s."""
        reach = self.breakdown_slip * self.synchronous_speed
        return self.synchronous_speed - reach, self.synchronous_speed + reach

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        reach = self.breakdown_slip * self.synchronous_speed
        u = f"({expression_of(self.synchronous_speed)} - omega)"
        return parse(f"{expression_of(2 * self.breakdown_torque * reach)}*{u}/({u}**2 + {expression_of(reach**2)})")

    def rotor_heat(self, omega: ArrayLike) -> Array:
        """Heat in the rotor, W, at speeds omega (rad/s), of their shape: torque times slip speed, T (omega_s - omega).

        The field gives the rotor T omega_s, the shaft takes T omega. A generator's heat is above 0, too, as both factors
        change their sign. Kloss's formula leaves out the stator's resistance; what the load's current heats there goes along
        with the rotor's heat, by the square of the same current. Source: Fitzgerald et al. and Chapman, as above.

        >>> motor = Induction(power=7500.0, speed=1450 * math.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.5)
        >>> round(float(motor.rotor_heat(motor.speed)), 6), round(7500.0 * motor.rated_slip / (1 - motor.rated_slip), 6)
        (258.62069, 258.62069)
        """
        speeds = np.asarray(omega, dtype=float)
        return np.asarray(self.torque(speeds) * (self.synchronous_speed - speeds))

    def speed_at(self, torque: float) -> float | None:
        """Speed on the running branch at which the motor gives a torque: s = s_b q/(1 + sqrt(1 - q²)), q = T/T_b."""
        share = torque / self.breakdown_torque
        if abs(share) > 1:
            return None
        slip = self.breakdown_slip * share / (1 + math.sqrt((1 - share) * (1 + share)))
        return self.synchronous_speed * (1 - slip)


def _rpm(speed: float) -> str:
    return f"{speed * 30 / math.pi:.6g} rpm"
