"""DC motors: armature circuit, constants from the name plate. Servo drives: a speed held by a controller.

A servo drive works within its area of torque and speed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.elements import GY, I, R, Se
from bondgraph.graph import Builder, Part
from flywheel.components.energy import Energy
from flywheel.components.motors.curves import Line
from flywheel.components.motors.motor import (
    EVERYWHERE,
    Array,
    Circuit,
    Fact,
    Motor,
    Point,
    ShaftMotion,
    Slopes,
    Span,
    StateName,
    States,
    figure_and_error,
    floats,
    rpm,
    wrong_numbers,
    wrong_point,
)
from flywheel.language import text as _
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Cells
from flywheel.numerics.expressions import Expression, compiled
from flywheel.numerics.faults import NOT_NEGATIVE, POSITIVE, Fault, SceneError, number_faults, refuse


@dataclass(frozen=True, kw_only=True)
class DC(Motor):
    """A DC motor with constant field: L di/dt = U - R i - k omega, shaft torque T = k i - b omega.

    Without inductance, or where speed changes slowly against the time constant L/R, the current follows the speed,
    i = (U - k omega)/R, and torque is the straight line T = k U/R - (k²/R + b) omega; that is what `law` gives. With
    inductance the current is a state of its `circuit` and its `graph`.

    Args:
        voltage: U at the armature, V, above 0.
        resistance: R of the armature with brushes, ohm, above 0.
        constant: k, V s/rad = N m/A, above 0.
        inductance: L of the armature, H.
        friction: b, N m s/rad.
        nameplate: the rated point, where the constants were derived from one.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range.

    Valid for permanent magnets or separate excitation at constant voltage (a shunt motor on a stiff supply too), without
    saturation and armature reaction; for both directions of speed and of power. Source: Fitzgerald et al., Electric
    Machinery, 6th ed., chapter 7; Chapman, Electric Machinery Fundamentals, 5th ed., chapter 8; Karnopp, Margolis and
    Rosenberg, System Dynamics, 5th ed., chapter 4 (as a bond graph).

    >>> motor = DC(voltage=48.0, resistance=0.4, constant=0.25, friction=0.002)
    >>> round(motor.starting_torque, 9), round(motor.no_load_speed, 6)
    (30.0, 189.57346)
    >>> float(motor.current(96.0)), round(float(motor.torque(96.0)), 9)
    (60.0, 14.808)

    """

    voltage: float
    resistance: float
    constant: float
    inductance: float = 0.0
    friction: float = 0.0
    nameplate: Point | None = None
    title: ClassVar[str] = "DC motor"
    formula: ClassVar[str] = "T = k (U − k ω)/R − b ω, b its friction: a straight line that falls with speed."
    heated: ClassVar[str | None] = "copper_heat"
    whole_heat: ClassVar[str | None] = "copper_heat_share"
    starts: ClassVar[tuple[str, ...]] = ("resistance", "field")
    takes_power: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuses values out of range."""
        refuse(wrong_numbers(self, ("voltage", "resistance", "constant"), ("inductance", "friction")))

    @cached_property
    def quasi_static(self) -> Line:
        """The straight line that torque follows where the current has no inertia."""
        k = self.constant
        return Line(at_rest=k * self.voltage / self.resistance, fall=k * k / self.resistance + self.friction)

    def law(self) -> Expression:
        """The torque on the shaft where the current follows the speed, N m."""
        return self.quasi_static.law()

    @property
    def no_load_speed(self) -> float:
        """Speed k U/(k² + b R), rad/s, at which the shaft torque is zero."""
        return self.quasi_static.no_load_speed

    @property
    def stable(self) -> Span:
        """Every speed."""
        return EVERYWHERE

    @property
    def rated(self) -> Point | None:
        """The point of the name plate, where the constants were derived from one."""
        return self.nameplate

    def speed_at(self, torque: float) -> float:
        """Steady speed at which the shaft gives a torque, rad/s."""
        return self.quasi_static.speed_at(torque)

    @property
    def time_constant(self) -> float:
        """Electrical time constant L/R, s."""
        return self.inductance / self.resistance

    def current(self, omega: Any) -> Any:
        """Steady armature current (U - k omega)/R, A, at speeds omega (rad/s)."""
        return (self.voltage - self.constant * omega) / self.resistance

    def current_of_torque(self, omega: Any, torque: Any) -> Any:
        """Current (T + b omega)/k, A, at speeds (rad/s) and torques on the shaft (N m), whether it is steady or not."""
        return (torque + self.friction * omega) / self.constant

    def copper_heat(self, current: Any) -> Any:
        """Heat R i² in the armature, W, at currents (A)."""
        return self.resistance * current * current

    def heat(self, omega: Any, states: States = ()) -> Any:
        """Copper heat of the armature, W, by its current if that is a state."""
        return np.asarray(self.copper_heat(states[0] if len(states) else self.current(omega)))

    def windings_share(self, omega: Array, torque: Array, running: Motor) -> Array | None:
        """Current of the armature over the rated one, or in A, from torques as connected."""
        return np.asarray(self.current_of_torque(omega, torque) / (running.rated_current or 1.0))

    def split_heat(self, omega: Array, torque: Array, running: Motor) -> tuple[Array | None, Array | None]:
        """Copper heat (W) of the armature itself, and of added resistance."""
        current = self.current_of_torque(omega, torque)
        own = running.resistance if isinstance(running, DC) else self.resistance
        return own * current * current, (self.resistance - own) * current * current

    def heats(self, shaft: ShaftMotion) -> dict[str, Any]:
        """Current and heat of the armature: the mean of R i²."""

        def current(mesh: Cells, omega: Array) -> Array:
            return np.asarray(self.current_of_torque(shaft.ratio * omega, shaft.torque(mesh, omega)))

        def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
            flowing = current(mesh, omega)
            return self.copper_heat(flowing), 2 * shaft.ratio * self.constant * np.abs(flowing)

        mean, error, mesh = shaft.mean_over_time(heat)
        omega = shaft.omega(mesh)
        series = cells.fit(current(mesh, omega))
        locked = self.voltage / self.resistance
        off = float(cells.tails(series).max()) + 24 * ROUNDING * locked
        off += shaft.ratio * self.constant / self.resistance * float(shaft.speed_error(omega).max())
        if self.inductance:  # the current follows the speed behind its own equation, which the cells may cut off as well
            error += 2 * self.resistance * float(np.sqrt(mean / self.resistance)) * float(cells.tails(series).max())
        figure, relative = figure_and_error(mean, error, self.copper_heat(locked))
        peak, of_peak = figure_and_error(cells.largest(series), off, locked)
        errors = {"copper_heat": relative, "current_rms": relative, "current_peak": of_peak}
        share, rated = None, self.rated_current
        if rated is not None:
            share = figure / self.copper_heat(rated)
            errors["copper_heat_share"] = relative + 8 * ROUNDING * locked / rated
        return {
            "current_rms": float(np.sqrt(figure / self.resistance)),
            "current_peak": peak,
            "copper_heat": figure,
            "copper_heat_share": share,
            "errors": errors,
        }

    def powers(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> dict[str, Array]:
        """R i² in the armature ("copper"), b omega² ("windage") and L i di/dt ("inductance"), W."""
        current = self.current_of_torque(omega, torque)
        losses = {"copper": self.copper_heat(current)}
        if self.friction:
            losses["windage"] = self.friction * omega * omega
        if self.inductance:
            losses["inductance"] = self.inductance * current * self.current_rate(omega, current)
        return losses

    def with_resistance(self, share: float) -> DC:
        """The motor with a resistance before its armature, over the armature's own."""
        self._check_inductance()
        return replace(self, resistance=self.resistance * (1.0 + share))

    def with_field(self, share: float) -> DC:
        """The motor with another field, over its own."""
        self._check_inductance()
        return replace(self, constant=self.constant * share)

    def _check_inductance(self) -> None:
        if self.inductance:
            defect = f"an armature with an inductance of {self.inductance:g} H"
            advice = "over a start the current follows the speed at once: leave the inductance out"
            raise SceneError([Fault("type", defect, "a motor without inductance together with a start by steps", advice)])

    def facts(self) -> Iterator[Fact]:
        """The motor's constants, and the straight line that follows from them."""
        yield from super().facts()
        table, line = _("Constants of the motor"), self.quasi_static
        voltage = Fact(_("voltage at the armature"), "U", self.voltage, "V", table=table)
        resistance = Fact(_("resistance of the armature"), "R_a", self.resistance, "Ω", table=table)
        constant = Fact(_("motor constant"), "k_m", self.constant, "N m/A", table=table)
        friction = Fact(_("friction"), "b", self.friction, "N m s", table=table)
        yield from (voltage, resistance, constant, friction)
        if self.inductance:
            yield Fact(_("inductance of the armature"), "L_a", self.inductance, "H", table=table)
        yield Fact(_("Current at any speed, when it is steady"), "i", formula="i = (U - k_m*omega)/R_a")
        at_rest = (constant, voltage, resistance)
        yield Fact(_("Torque at rest"), "T_0", line.at_rest, "N m", "T_0 = k_m*U/R_a", at_rest)
        fall = (constant, resistance, friction)
        yield Fact(_("Fall of the torque with speed"), "c", line.fall, "N m s", "c = k_m**2/R_a + b", fall)
        yield Fact(_("Torque at any speed"), "T", formula="T(omega) = T_0 - c*omega")
        if self.inductance:
            yield Fact(
                _("The current has an inertia of its own: along the motion L di/dt = U − R i − k ω is solved with it.")
            )

    def heat_facts(self, energy: Energy) -> Iterator[Fact]:
        """Current and copper heat of its armature."""
        if energy.copper_heat is None or energy.current_rms is None:
            yield from super().heat_facts(energy)
            return
        words, mean = (
            _("Root of the mean square of the armature's current over time"),
            "i_rms = sqrt(integral(i**2, t, 0, tau)/tau)",
        )
        current = Fact(words, "i_rms", energy.current_rms, "A", mean)
        yield current
        numbers, share = (Fact("", "R_a", self.resistance, "Ω"), current), energy.copper_heat_share
        share = float("nan") if share is None else share
        heat = _("Copper heat of the armature")
        yield Fact(heat, "Q_c", energy.copper_heat, "W", "Q_c = R_a*i_rms**2", numbers, share=share)

    @property
    def rated_current(self) -> float | None:
        """Current at the rated point, A; None if the constants were not derived from one."""
        return None if self.nameplate is None else self.current(self.nameplate.speed)

    def current_share(self, omega: ArrayLike) -> Array | None:
        """Steady armature current over the rated one, with its sign, at speeds omega (rad/s); None without a rated point."""
        rated = self.rated_current
        return None if rated is None else np.asarray(self.current(floats(omega)) / rated)

    def current_rate(self, omega: Any, current: Any) -> Any:
        """Rate of change of the current di/dt = (U - R i - k omega)/L, A/s, at speeds (rad/s) and currents (A).

        Raises SceneError for a motor without inductance, whose current is no state.

        >>> DC(voltage=48.0, resistance=0.4, constant=0.25, inductance=0.002).current_rate(96.0, 50.0)
        2000.0
        """
        if self.inductance == 0:
            raise SceneError([Fault("inductance", "0 H", "a value above 0", "without it the current follows the speed")])
        return ArmatureCircuit(self).rates(omega, (current,))[0]

    @cached_property
    def circuit(self) -> ArmatureCircuit | None:
        """The armature's current as a state, if it has inductance."""
        return ArmatureCircuit(self) if self.inductance > 0.0 else None

    def graph(self) -> Part:
        """The motor as a part of a bond graph, open at the 1-junction `rotor` of its shaft.

        Voltage Se, armature R, and I if there is inductance; gyrator GY; rotor I and friction R if there are any.

        >>> print(*DC(voltage=48.0, resistance=0.4, constant=0.25, inertia=0.004).graph().elements)
        armature rotor voltage resistance constant inertia
        """
        b = Builder().one("armature", "electric").one("rotor", "rotation")
        b.on("armature", Se("voltage", self.voltage), R("resistance", self.resistance))
        if self.inductance:
            b.port("armature", I("inductance", self.inductance))
        b.add(GY("constant", self.constant))
        b.bond("armature", "constant").bond("constant", "rotor")
        if self.inertia:
            b.port("rotor", I("inertia", self.inertia))
        if self.friction:
            b.port("rotor", R("friction", self.friction))
        return b.part("rotor")


class ArmatureCircuit(Circuit):
    """The current of a DC motor with inductance: T = k i - b omega, L di/dt = U - R i - k omega.

    Source: as `DC`.

    >>> circuit = DC(voltage=48.0, resistance=0.4, constant=0.25, inductance=0.002).circuit
    >>> circuit.torque(96.0, (50.0,)), circuit.rates(96.0, (50.0,)), circuit.steady(96.0)
    (12.5, (2000.0,), (60.0,))
    """

    names = (StateName("current", "A", in_graph=("f", "armature", 1.0)),)

    def __init__(self, motor: DC) -> None:
        self.motor, self.scales = motor, (abs(motor.voltage / motor.resistance),)

    def torque(self, omega: Any, states: States) -> Any:
        """Torque on the shaft k i - b omega, N m."""
        motor = self.motor
        return motor.constant * states[0] - motor.friction * omega

    def rates(self, omega: Any, states: States) -> tuple[Any]:
        """Rate of the current, A/s."""
        motor = self.motor
        return ((motor.voltage - motor.resistance * states[0] - motor.constant * omega) / motor.inductance,)

    def slopes(self, omega: Any, states: States) -> Slopes:
        """Derivatives, all of them constant."""
        motor = self.motor
        by_speed, by_current = -motor.constant / motor.inductance, -motor.resistance / motor.inductance
        return Slopes(-motor.friction, (motor.constant,), (by_speed,), ((by_current,),))

    def steady(self, omega: Any) -> tuple[Any]:
        """The current (U - k omega)/R, A."""
        return (self.motor.current(omega),)

    def current(self, omega: Any, states: States) -> Any:
        """The current of the armature, A."""
        return states[0]

    def standing(self, states: States, time: Any) -> tuple[Any]:
        """The current of a locked rotor, which approaches U/R with the time constant L/R."""
        motor = self.motor
        final, rate = motor.voltage / motor.resistance, motor.resistance / motor.inductance
        return (final + (states[0] - final) * np.exp(-rate * time),)


def dc_from_plate(
    voltage: float,
    rated: Point,
    current: float,
    armature_share: float = 0.5,
    inductance: float = 0.0,
    inertia: float = 0.0,
) -> DC:
    """The constants of a DC motor from its name plate; it passes through the rated point at the rated current exactly.

    The losses U I - P divide into those of the armature, a share a of them, R = a (U I - P)/I², and the rest, which is
    assumed to be friction proportional to speed, b = (1 - a)(U I - P)/omega². Then k = (U - R I)/omega. At the load where
    efficiency is greatest the losses that grow with the current squared equal those that do not, hence a = 1/2 unless more
    is known.

    Args:
        voltage: U, V, above 0.
        rated: speed omega (rad/s) and torque P/omega (N m), above 0.
        current: I of the armature, A; from an efficiency eta, I = P/(eta U).
        armature_share: a, above 0 and at most 1.
        inductance: L, H.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range, or a shaft power that is not below the electric one.

    Valid where excitation takes no part of the current (permanent magnets, or field current left out). R of a real armature
    grows with its temperature. Source: power balance; Fitzgerald et al., Electric Machinery, 6th ed., chapter 7; Chapman,
    Electric Machinery Fundamentals, 5th ed., chapter 8 (losses; maximum efficiency).

    >>> motor = dc_from_plate(220.0, Point(150.0, 60.0), 45.0)
    >>> motor.resistance, round(motor.constant, 6), motor.friction
    (0.2222222222222222, 1.4, 0.02)
    >>> round(float(motor.torque(150.0)), 9), round(motor.current(150.0), 9)
    (60.0, 45.0)

    """
    share = number_faults("armature_share", armature_share, "a finite number above 0")
    if not share and armature_share > 1:
        share = [Fault("armature_share", f"{armature_share:g}", "a share of 1 at most")]
    refuse(number_faults("voltage", voltage, "a finite number above 0") + wrong_point(rated) + share)
    refuse(number_faults("current", current, "a finite number above 0"))
    losses = voltage * current - rated.power
    if losses <= 0:
        defect = f"{rated.power:.6g} W at the shaft of {voltage * current:.6g} W at the terminals"
        raise SceneError([Fault("power", defect, "less than voltage times current", "efficiency is below 1")])
    resistance = armature_share * losses / current**2
    return DC(
        voltage=voltage,
        resistance=resistance,
        constant=(voltage - resistance * current) / rated.speed,
        inductance=inductance,
        friction=(1 - armature_share) * losses / rated.speed**2,
        nameplate=rated,
        inertia=inertia,
    )


@dataclass(frozen=True, kw_only=True)
class Servo(Motor):
    """A servo drive with a speed controller without integral part, within the peak curve of motor and amplifier.

    With the set speed w_0 and the gain K = T_n/(d w_0) the torque is K (w_0 - w), as far as the peak curve allows it:

        T = max(-P, min(P, K (w_0 - w))),  P(w) = T_p min(1, (w_m - |w|)/(w_m - w_c)), at least 0.

    The continuous curve goes straight from T_0 at rest through the rated point, C(w) = T_0 - (T_0 - T_n) |w|/w_n. On it the
    losses have their permanent limit Q_n. With copper losses proportional to T² the others follow from it, Q = Q_n (T² +
    T_0² - C²)/T_0², so that Q = Q_n on the curve.

    Args:
        speed: w_n, rated, rad/s, above 0.
        continuous_torque: T_n at rated speed, N m, above 0.
        set_speed: w_0, rad/s, above 0 and below w_m.
        peak_torque: T_p, N m, at least T_0.
        corner_speed: w_c, up to which the peak torque is available, rad/s, below w_m.
        maximum_speed: w_m, at which the peak curve has fallen to 0, rad/s.
        losses: Q_n, W, above 0.
        droop: d, drop of speed at rated torque as a share of w_0, above 0.
        standstill_torque: T_0, N m, at least T_n; None for T_n.
        torque_constant: torque over current (root of its mean square in a line), N m/A; None if it is not known.
        inertia: of the rotor, kg m².
        inverter: the amplifier, with its use of returned power.

    Raises:
        SceneError: for values out of range.

    Valid for changes slower than the current controller (about 1 ms), torque in proportion to current, and other losses than
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
        most = f"below the maximum_speed of {rpm(self.maximum_speed)}"
        for name in ("corner_speed", "set_speed"):
            if not getattr(self, name) < self.maximum_speed:
                faults.append(Fault(name, rpm(getattr(self, name)), most, "there the peak curve has fallen to zero"))
        if self.at_rest < self.continuous_torque:
            least = f"the torque of {self.continuous_torque:g} N m at rated speed or more"
            faults.append(Fault("standstill_torque", f"{self.at_rest:g} N m", least))
        refuse(faults)
        for name, at, torque in (("standstill torque", 0.0, self.at_rest), ("rated torque", *self.rated)):
            if (peak := self._peak_law.evaluate({"omega": at}, np)) < torque:
                defect = f"a peak curve with {peak:.6g} N m at {rpm(at)}"
                advice = "the continuous curve lies within the peak curve"
                faults.append(Fault("peak_torque", defect, f"at least the {name} of {torque:g} N m", advice))
        refuse(faults[:1] + ([] if self.inverter is None else self.inverter.faults()))

    @property
    def at_rest(self) -> float:
        """The continuous torque at rest T_0, N m."""
        return self.continuous_torque if self.standstill_torque is None else self.standstill_torque

    @property
    def gain(self) -> float:
        """Torque over the drop of speed, K, N m s/rad."""
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
        return np.asarray(self._peak_law.evaluate({"omega": floats(omega)}, np))

    @cached_property
    def _peak_law(self) -> Expression:
        numbers = {"peak": self.peak_torque, "fall": self._fall, "most": self.maximum_speed}
        return compiled("max(0, min({peak}, {fall}*({most} - abs(omega))))", **numbers)

    def continuous(self, omega: ArrayLike) -> Array:
        """The continuous curve C, N m, at speeds omega (rad/s), of their shape; within the peak curve."""
        return np.minimum(self._unlimited(omega), self.peak(omega))

    def _unlimited(self, omega: ArrayLike) -> Array:
        """The continuous curve by its losses alone, N m."""
        share = np.abs(floats(omega)) / self.speed
        return np.asarray(np.maximum(self.at_rest - (self.at_rest - self.continuous_torque) * share, 0.0))

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        within = "max(-{peak}, min({peak}, {gain}*({speed} - omega)))"
        law = compiled(within, peak=self._peak_law, gain=self.gain, speed=self.set_speed)
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
        square = floats(torque) ** 2 + self.at_rest**2 - self._unlimited(omega) ** 2
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

    def heats(self, shaft: ShaftMotion) -> dict[str, Any]:
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
        figure, relative = figure_and_error(mean, error, self.losses)
        errors = {"copper_heat": relative, "copper_heat_share": relative + 8 * ROUNDING}
        figures: dict[str, Any] = {"copper_heat": figure, "copper_heat_share": figure / self.losses}
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
        losses = {"copper": copper}
        if self.at_rest > self.continuous_torque:
            losses["iron"] = self.losses_at(omega, torque) - copper
        return losses

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
