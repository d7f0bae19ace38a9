"""Servo drives: a speed held by a controller, within the drive's area of torque and speed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flywheel.components.energy import Energy
from flywheel.components.motors.motor import (
    Array,
    Fact,
    Motor,
    Point,
    Shaft,
    Span,
    States,
    figure_and_error,
    wrong_numbers,
)
from flywheel.language import text as _
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.numerics.cells import ROUNDING, Cells
from flywheel.numerics.expressions import Expression, compiled
from flywheel.numerics.faults import Fault


def _rpm(speed: float) -> str:
    return f"{speed * 30 / math.pi:.6g} rpm"


@dataclass(frozen=True, kw_only=True)
class Servo(Motor):
    """A servo drive with a speed controller without integral part, within the peak curve of motor and amplifier.

    With the set speed w_0 and the gain K = T_n/(d w_0) the torque is K (w_0 - w), as far as the peak curve allows it:

        T = max(-P, min(P, K (w_0 - w))),  P(w) = T_p min(1, (w_m - |w|)/(w_m - w_c)), at least 0.

    The continuous curve goes straight from T_0 at rest through the rated point, C(w) = T_0 - (T_0 - T_n) |w|/w_n. It is
    where the losses are those that the motor bears for ever, Q_n. With copper losses that go with T² the others follow from
    it, Q = Q_n (T² + T_0² - C²)/T_0², so that Q = Q_n on the curve.

    Args:
        speed: w_n, rated, rad/s, above 0.
        continuous_torque: T_n at rated speed, N m, above 0.
        set_speed: w_0, rad/s, above 0 and below w_m.
        peak_torque: T_p, N m, at least T_0.
        corner_speed: w_c, up to which the peak torque is there, rad/s, below w_m.
        maximum_speed: w_m, at which the peak curve has fallen to 0, rad/s.
        losses: Q_n, W, above 0.
        droop: d, by which share of w_0 the speed is below it at rated torque, above 0.
        standstill_torque: T_0, N m, at least T_n; None for T_n.
        torque_constant: torque over current (root of its mean square in a line), N m/A; None if it is not known.
        inertia: of the rotor, kg m².
        inverter: the amplifier, by what it does with power that the motor returns.

    Raises:
        SceneError: for values out of range.

    Valid for changes slower than the current controller (about 1 ms), torque in proportion to current, and losses beside
    the copper's that depend on speed alone. Source: Gross, Hamann and Wiegärtner, Electrical Feed Drives in Automation,
    chapters 4 (motor characteristics, S1 and peak curve) and 8 (choice of a drive); IEC 60034-1 (S1).

    >>> servo = Servo(speed=300.0, continuous_torque=8.0, set_speed=250.0, peak_torque=30.0, corner_speed=200.0,
    ...               maximum_speed=400.0, losses=400.0, standstill_torque=10.0)
    >>> servo.torque([0.0, 249.0, 250.0, 251.0]).tolist(), servo.peak([0.0, 200.0, 300.0]).tolist()
    ([30.0, 3.2, 0.0, -3.2], [30.0, 30.0, 15.0])
    >>> servo.continuous([0.0, 150.0, 300.0]).tolist(), float(servo.losses_at(300.0, 8.0)).__round__(9)
    ([10.0, 9.0, 8.0], 400.0)

    """

    speed: float
    continuous_torque: float
    set_speed: float
    peak_torque: float
    corner_speed: float
    maximum_speed: float
    losses: float
    droop: float = 0.01
    standstill_torque: float | None = None
    torque_constant: float | None = None
    title: ClassVar[str] = "servo drive"
    formula: ClassVar[str] = "T = K (ω₀ − ω) within ± its peak curve, K the rated torque over its droop of speed."
    heated: ClassVar[str | None] = "copper_heat"
    whole_heat: ClassVar[str | None] = "copper_heat_share"
    takes_power: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuses values out of range, and curves that contradict each other."""
        positive = ("speed", "continuous_torque", "set_speed", "peak_torque", "maximum_speed", "losses", "droop")
        faults = wrong_numbers(self, positive) + number_faults("corner_speed", self.corner_speed, NOT_NEGATIVE)
        for name in ("standstill_torque", "torque_constant"):
            if (value := getattr(self, name)) is not None:
                faults += number_faults(name, value, POSITIVE)
        refuse(faults)
        most = f"below the maximum_speed of {_rpm(self.maximum_speed)}"
        for name in ("corner_speed", "set_speed"):
            if not getattr(self, name) < self.maximum_speed:
                faults.append(Fault(name, _rpm(getattr(self, name)), most, "there the peak curve has fallen to zero"))
        if self.at_rest < self.continuous_torque:
            least = f"the torque of {self.continuous_torque:g} N m at rated speed or more"
            faults.append(Fault("standstill_torque", f"{self.at_rest:g} N m", least))
        refuse(faults)
        for name, at, torque in (("standstill torque", 0.0, self.at_rest), ("rated torque", *self.rated)):
            if float(self.peak(at)) < torque:
                found = f"a peak curve with {float(self.peak(at)):.6g} N m at {_rpm(at)}"
                advice = "the continuous curve lies within the peak curve"
                faults.append(Fault("peak_torque", found, f"at least the {name} of {torque:g} N m", advice))
        refuse(faults[:1] + ([] if self.inverter is None else self.inverter.faults()))

    @property
    def at_rest(self) -> float:
        """The continuous torque at rest T_0, N m."""
        return self.continuous_torque if self.standstill_torque is None else self.standstill_torque

    @property
    def gain(self) -> float:
        """Torque over a lack of speed K, N m s/rad."""
        return self.continuous_torque / (self.droop * self.set_speed)

    @property
    def rated(self) -> Point:
        """The continuous torque at rated speed."""
        return Point(self.speed, self.continuous_torque)

    @property
    def no_load_speed(self) -> float:
        """The set speed, rad/s."""
        return self.set_speed

    @property
    def covers(self) -> Span:
        """Speeds up to the greatest, both ways, rad/s."""
        return -self.maximum_speed, self.maximum_speed

    @property
    def _fall(self) -> float:
        """Slope of the peak curve beyond its corner, N m s/rad."""
        return self.peak_torque / (self.maximum_speed - self.corner_speed)

    @property
    def stable(self) -> Span:
        """The range of speeds in which the torque falls with speed: from the peak torque to that of braking, rad/s."""
        slower, faster = (self.set_speed + way * self.peak_torque / self.gain for way in (-1.0, 1.0))
        if faster > self.corner_speed:
            faster = (self.gain * self.set_speed + self._fall * self.maximum_speed) / (self.gain + self._fall)
        return min(max(slower, -self.corner_speed), self.corner_speed), faster

    def peak(self, omega: ArrayLike) -> Array:
        """The peak curve P, N m, at speeds omega (rad/s), of their shape."""
        beyond = self._fall * (self.maximum_speed - np.abs(np.asarray(omega, dtype=float)))
        return np.asarray(np.clip(beyond, 0.0, self.peak_torque))

    def continuous(self, omega: ArrayLike) -> Array:
        """The continuous curve C, N m, at speeds omega (rad/s), of their shape; within the peak curve."""
        return np.minimum(self._unlimited(omega), self.peak(omega))

    def _unlimited(self, omega: ArrayLike) -> Array:
        """The continuous curve by its losses alone, N m."""
        share = np.abs(np.asarray(omega, dtype=float)) / self.speed
        return np.asarray(np.maximum(self.at_rest - (self.at_rest - self.continuous_torque) * share, 0.0))

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        peak = compiled(
            "max(0, min({peak}, {fall}*({most} - abs(omega))))",
            peak=self.peak_torque,
            fall=self._fall,
            most=self.maximum_speed,
        )
        law = compiled(
            "max(-{peak}, min({peak}, {gain}*({speed} - omega)))", peak=peak, gain=self.gain, speed=self.set_speed
        )
        return Expression("torque of a servo drive", law.tree)

    @property
    def rated_current(self) -> float | None:
        """Current at the rated point, A; None without a torque constant."""
        return None if self.torque_constant is None else self.continuous_torque / self.torque_constant

    def current_share(self, omega: ArrayLike) -> Array:
        """Current over the rated one at speeds omega (rad/s), of their shape: |T|/T_n."""
        return np.abs(self.torque(omega)) / self.continuous_torque

    def current(self, omega: ArrayLike) -> Array | None:
        """Current (A) at speeds omega (rad/s), of their shape; None without a torque constant."""
        return None if self.torque_constant is None else np.abs(self.torque(omega)) / self.torque_constant

    def losses_at(self, omega: ArrayLike, torque: ArrayLike) -> Array:
        """Losses Q of the motor, W, at speeds (rad/s) and torques (N m)."""
        square = np.asarray(torque, dtype=float) ** 2 + self.at_rest**2 - self._unlimited(omega) ** 2
        return np.asarray(self.losses * square / self.at_rest**2)

    def heat(self, omega: Any, states: States = ()) -> Any:
        """Losses of the motor, W."""
        return self.losses_at(omega, self.torque(omega))

    @property
    def rated_heat(self) -> float:
        """Losses on the continuous curve, W."""
        return self.losses

    @property
    def rated_total_heat(self) -> float:
        """Losses on the continuous curve, W."""
        return self.losses

    def heats(self, shaft: Shaft) -> dict[str, Any]:
        """The mean of the losses over time; the current by its torque where the torque constant is known."""

        def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
            speed = shaft.ratio * omega
            torque, slope = self.torque(speed), self.slope_at(speed)
            by_curve = self._unlimited(speed) * (self.at_rest - self.continuous_torque) / self.speed
            steep = np.abs(2.0 * torque * slope) + np.abs(2.0 * by_curve)
            return self.losses_at(speed, torque), shaft.ratio * self.losses / self.at_rest**2 * steep

        def torque(mesh: Cells, omega: Array) -> tuple[Array, Array]:
            return self.torque(shaft.ratio * omega), shaft.ratio * np.abs(self.slope_at(shaft.ratio * omega))

        mean, error, _ = shaft.mean_over_time(heat)
        found, relative = figure_and_error(mean, error, self.losses)
        errors = {"copper_heat": relative, "copper_heat_share": relative + 8 * ROUNDING}
        figures: dict[str, Any] = {"copper_heat": found, "copper_heat_share": found / self.losses}
        if self.torque_constant is not None:
            square, off, _ = shaft.mean_square(torque)
            least, most, of_peak = shaft.extremes(torque)
            square, errors["current_rms"] = figure_and_error(square, off, self.continuous_torque**2)
            peak = max(most, -least)
            figures |= {
                "current_rms": math.sqrt(square) / self.torque_constant,
                "current_peak": peak / self.torque_constant,
            }
            errors["current_peak"] = of_peak / (peak or self.continuous_torque)
        return {**figures, "errors": errors}

    def powers(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> dict[str, Array]:
        """Copper losses ("copper"), and those that depend on speed ("iron"), W."""
        copper = self.losses * (torque / self.at_rest) ** 2
        found = {"copper": copper}
        if self.at_rest > self.continuous_torque:
            found["iron"] = self.losses_at(omega, torque) - copper
        return found

    def input_power(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> Array:
        """T omega and the losses, W."""
        return np.asarray(torque * omega + self.losses_at(omega, torque))

    def facts(self) -> Iterator[Fact]:
        """Area of torque and speed, and controller."""
        *plate, torque = super().facts()
        yield from (*plate, torque)
        table = _("Area of torque and speed")
        yield Fact(_("continuous torque at rest"), "T_0", self.at_rest, "N m", table=table)
        yield Fact(_("peak torque"), "T_p", self.peak_torque, "N m", table=table)
        yield Fact(_("speed up to which it has its peak torque"), "omega_p", self.corner_speed, "rad/s", table=table)
        yield Fact(
            _("speed at which the peak curve has fallen to zero"), "omega_m", self.maximum_speed, "rad/s", table=table
        )
        yield Fact(_("losses that it bears in continuous running"), "Q_n", self.losses, "W", table=table)
        speed, droop = Fact("", "omega_0", self.set_speed, "rad/s"), Fact("", "d", self.droop)
        yield speed._replace(words=_("Set speed"))
        gain = _("Gain of the speed controller")
        yield Fact(gain, "K", self.gain, "N m s", "K = T_n/(d*omega_0)", (torque, droop, speed))
        yield Fact(_("Torque within the peak curve"), "T", formula="T(omega) = K*(omega_0 - omega)")

    def heat_facts(self, energy: Energy) -> Iterator[Fact]:
        """The mean of its losses."""
        if energy.copper_heat is None or energy.copper_heat_share is None:
            yield from super().heat_facts(energy)
            return
        words = _("Mean losses of the motor over time, C the continuous curve")
        mean = "Q_v = Q_n*integral((T**2 + T_0**2 - C**2)/T_0**2, t, 0, tau)/tau"
        yield Fact(words, "Q_v", energy.copper_heat, "W", mean, share=energy.copper_heat_share)
