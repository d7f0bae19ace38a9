"""Synchronous motors: torque by the load angle, the damper winding's torque by slip, run-up before the field is on."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.elements import C, I, R, Sf
from bondgraph.graph import Builder, Part
from bondgraph.numerics import root
from flywheel.components.energy import Energy
from flywheel.components.motors.motor import (
    Array,
    Circuit,
    Fact,
    Inverter,
    Motor,
    Point,
    Slopes,
    Span,
    StateName,
    States,
    wrong_field,
    wrong_numbers,
)
from flywheel.language import text as _
from flywheel.numerics.expressions import Expression, expression_of, parse
from flywheel.numerics.faults import Fault, SceneError, number_faults, refuse

MOST_SALIENCY = 2.0
"""The greatest reluctance torque over that of the field that is accepted: a machine of salient poles has 0.1 to 0.5."""

FIELD_BAND = 0.01
"""Share of synchronous speed over which the field is given, from `field_at` on."""


def pull_out(saliency: float) -> tuple[float, float]:
    """The load angle (rad, electrical) at which sin(d) + r sin(2 d) is greatest, and that greatest value.

    From cos(d) + 2 r cos(2 d) = 0: cos(d) = (-1 + sqrt(1 + 32 r²))/(8 r), written without cancellation.

    Args:
        saliency: r, reluctance torque over that of the field, at least 0.

    >>> [round(value, 9) for value in (*pull_out(0.0), *pull_out(0.25))]
    [1.570796327, 1.0, 1.196061894, 1.100917369]

    """
    cosine = 4.0 * saliency / (1.0 + math.sqrt(1.0 + 32.0 * saliency * saliency))
    angle = math.acos(cosine)
    return angle, math.sin(angle) + saliency * math.sin(2.0 * angle)


def saliency_of(load_angle: float, pull_out_ratio: float) -> float | None:
    """The saliency r with which the rated torque stands at a load angle; None if none up to `MOST_SALIENCY` does.

    (sin d_n + r sin 2 d_n)/max(sin d + r sin 2 d) = 1/lambda.

    Args:
        load_angle: d_n, rad, electrical, above 0.
        pull_out_ratio: lambda, pull-out torque over rated torque.

    >>> round(saliency_of(math.asin(0.5), 2.0), 9), round(saliency_of(0.4, 2.0), 6)
    (0.0, 0.203516)

    """

    def share(r: float) -> float:
        return (math.sin(load_angle) + r * math.sin(2.0 * load_angle)) / pull_out(r)[1] - 1.0 / pull_out_ratio

    if abs(share(0.0)) <= 4e-16:
        return 0.0
    return None if share(0.0) * share(MOST_SALIENCY) > 0.0 else root(share, 0.0, MOST_SALIENCY)


def damper_slope(greatest: float | None, slip_speed: float) -> float:
    """The slope c of a damper winding's torque at synchronous speed, over rated torque (s/rad), by its greatest torque.

    c u/(1 + (c u/(2 b))²) = 1 at the slip speed u: c = 2 b (b - sqrt(b² - 1))/u, on the running branch.

    Args:
        greatest: b, greatest over rated torque, above 1; None if it grows without limit: c = 1/u.
        slip_speed: u at which it gives rated torque, rad/s.

    >>> c = damper_slope(1.5, 2.0)
    >>> round(c * 2.0 / (1.0 + (c * 2.0 / 3.0) ** 2), 12)
    1.0

    """
    if greatest is None:
        return 1.0 / slip_speed
    slope: float = 2.0 * greatest / (greatest + ((greatest - 1.0) * (greatest + 1.0)) ** 0.5) / slip_speed
    return slope


@dataclass(frozen=True, kw_only=True)
class Synchronous(Motor):
    """A synchronous motor on a stiff mains: torque by the angle d by which its rotor lags the field.

    T = T_p sin(d) + T_r sin(2 d) + T_a(omega_s - omega), dd/dt = p (omega_s - omega): d in electrical radians, p pole
    pairs, omega_s = 2 pi f/p. T_r = r T_p is the reluctance torque of salient poles. The damper winding gives
    T_a(u) = c u, or where its greatest torque T_b is known, Kloss's c u/(1 + (u/u_b)²) with u_b = 2 T_b/c. The pull-out
    torque lambda T_n is the greatest of the first two.

    Args:
        power: rated power at the shaft, W.
        poles: number of poles, 2, 4, 6...
        frequency: f of the mains, Hz.
        pull_out_ratio: lambda, pull-out torque over rated torque, above 1.
        saliency: r, at least 0.
        damping: c, N m s/rad, at least 0.
        asynchronous_ratio: T_b over rated torque; None for a damper winding whose torque grows without limit.
        field_at: speed (rad/s) from which the field is on, below synchronous; None if it always is.
        field_time: time constant of the field, s; with `field_at`.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range.

    With `field_at` the field's share g of T_p is a state, dg/dt = (target - g)/tau, whose target rises from 0 to
    1 over the next hundredth of synchronous speed.

    Valid for swings slower than the transients of windings, at constant voltage and excitation; resistances neglected. The
    transient reactance, which makes fast swings somewhat stiffer, is left out. Source: Fitzgerald et al., Electric
    Machinery, 6th ed., chapter 5 (load angle, salient poles: eqs. 5-40, 5-65) ; Kundur, Power System Stability and Control
    (1994), sections 3.9, 12.3 (swing equation, damping torque); Chapman, Electric Machinery Fundamentals, 5th ed., chapter
    5 (start by damper windings).

    >>> motor = Synchronous(power=150e3, poles=20, frequency=50.0, pull_out_ratio=2.0, damping=400.0)
    >>> round(motor.synchronous_speed, 6), round(motor.rated.torque, 3), round(motor.field_torque, 3)
    (31.415927, 4774.648, 9549.297)
    >>> round(math.degrees(motor.load_angle(motor.rated.torque)), 9), motor.load_angle(1e4)
    (30.0, None)

    """

    power: float
    poles: int
    frequency: float
    pull_out_ratio: float
    damping: float
    saliency: float = 0.0
    asynchronous_ratio: float | None = None
    field_at: float | None = None
    field_time: float = 0.0
    title: ClassVar[str] = "synchronous motor"
    formula: ClassVar[str] = "T = Tₚ sin δ + Tᵣ sin 2δ + c (ω₀ − ω), dδ/dt = p (ω₀ − ω), δ the load angle."
    keeps_step: ClassVar[bool] = True
    takes_power: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuses values out of range."""
        faults = wrong_numbers(self, ("power", "frequency"), ("damping", "saliency", "field_time"))
        refuse(faults + wrong_field(self, "pull_out_ratio"))
        if self.saliency > MOST_SALIENCY:
            faults.append(Fault("saliency", f"{self.saliency:g}", f"{MOST_SALIENCY:g} at most; 0.1 to 0.5 is usual"))
        if self.asynchronous_ratio is not None:
            faults += number_faults("asynchronous_ratio", self.asynchronous_ratio, "a finite number above 0")
            if not self.damping:
                faults.append(Fault("damping", "0", "a value above 0", "the damper winding has a greatest torque"))
        if self.field_at is not None and not 0.0 < self.field_at <= (1.0 - FIELD_BAND) * self.synchronous_speed:
            highest = (1.0 - FIELD_BAND) * self.synchronous_speed
            defect, expected = f"{self.field_at:.6g} rad/s", f"a speed above 0, {highest:.6g} rad/s at most"
            faults.append(Fault("field_at", defect, expected, "the field is to pull the rotor in from there"))
        if (self.field_at is None) != (self.field_time == 0.0):
            defect = "without field_at" if self.field_at is None else "with field_at"
            expected = "no field_time, as the field is always given" if self.field_at is None else "a time above 0"
            faults.append(Fault("field_time", f"{self.field_time:g} s {defect}", expected))
        refuse(faults)

    @cached_property
    def synchronous_speed(self) -> float:
        """Speed 2 pi f/(pole pairs) of the field, rad/s."""
        return 4 * math.pi * self.frequency / self.poles

    @property
    def pole_pairs(self) -> float:
        """Pole pairs p: electrical over mechanical angle."""
        return self.poles / 2

    @cached_property
    def rated(self) -> Point:
        """The rated power at synchronous speed."""
        return Point(self.synchronous_speed, self.power / self.synchronous_speed)

    @property
    def pull_out_torque(self) -> float:
        """The greatest torque in step, N m."""
        return self.pull_out_ratio * self.rated.torque

    @property
    def pull_out_angle(self) -> float:
        """Load angle of the pull-out torque, rad."""
        return pull_out(self.saliency)[0]

    @cached_property
    def field_torque(self) -> float:
        """T_p, N m."""
        return self.pull_out_torque / pull_out(self.saliency)[1]

    @property
    def reluctance_torque(self) -> float:
        """T_r, N m."""
        return self.saliency * self.field_torque

    @cached_property
    def damper_reach(self) -> float:
        """Slip speed u_b at which the damper winding's torque is greatest, rad/s; infinite if it grows without limit."""
        if self.asynchronous_ratio is None:
            return math.inf
        return 2.0 * self.asynchronous_ratio * self.rated.torque / self.damping

    @property
    def no_load_speed(self) -> float:
        """Synchronous speed, rad/s."""
        return self.synchronous_speed

    @property
    def stable(self) -> Span | None:
        """The running branch of the damper winding's torque, rad/s; None without damping."""
        if not self.damping:
            return None
        return self.synchronous_speed - self.damper_reach, self.synchronous_speed + self.damper_reach

    def law(self) -> Expression:
        """The torque out of step, N m: that of the damper winding, which is the mean as the rotor slips past the poles."""
        u = f"({expression_of(self.synchronous_speed)} - omega)"
        linear = f"{expression_of(self.damping)}*{u}"
        if math.isinf(self.damper_reach):
            return parse(linear)
        return parse(f"{linear}/(1 + {u}**2/{expression_of(self.damper_reach**2)})")

    def synchronizing_torque(self, angle: ArrayLike) -> Array:
        """T_p sin(d) + T_r sin(2 d), N m, at load angles (rad), of their shape."""
        d = np.asarray(angle, dtype=float)
        return np.asarray(self.field_torque * np.sin(d) + self.reluctance_torque * np.sin(2.0 * d))

    def stiffness(self, angle: ArrayLike) -> Array:
        """T_p cos(d) + 2 T_r cos(2 d), N m per electrical radian: slope of torque over the load angle."""
        d = np.asarray(angle, dtype=float)
        return np.asarray(self.field_torque * np.cos(d) + 2.0 * self.reluctance_torque * np.cos(2.0 * d))

    def load_angle(self, torque: float) -> float | None:
        """The load angle (rad) below pull-out at which it gives a torque (N m) in step; None above the pull-out torque."""
        if abs(torque) > self.pull_out_torque:
            return None
        if not self.saliency:
            return math.asin(torque / self.field_torque)
        states_at_load = self.circuit.carrying(lambda states: float(self.synchronizing_torque(states[0])) - torque)
        return None if states_at_load is None else float(states_at_load[0])

    def swing_frequency(self, angle: float, inertia: float) -> float:
        """Angular frequency sqrt(p (dT/dd)/J) of small swings about a load angle (rad), J at the motor's shaft (kg m²).

        Source: Kundur, section 12.3; Fitzgerald et al., chapter 5; 0 at the pull-out angle and beyond.
        """
        return math.sqrt(max(self.pole_pairs * float(self.stiffness(angle)), 0.0) / inertia)

    def damper_torque(self, slip_speed: Any) -> Any:
        """Torque of the damper winding, N m, at slip speeds u = omega_s - omega (rad/s)."""
        if math.isinf(self.damper_reach):
            return self.damping * slip_speed
        return self.damping * slip_speed / (1.0 + (slip_speed / self.damper_reach) ** 2)

    def powers(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> dict[str, Array]:
        """Heat of the damper winding ("rotor"), and the rest of T (omega_s - omega), which the field stores ("field"), W."""
        field, damper = self.circuit.turning(omega, states)
        heat = damper * (field - omega)
        return {"rotor": heat, "field": torque * (field - omega) - heat}

    def fed(self, inverter: Inverter) -> Synchronous:
        """The motor on an inverter at a set frequency, constant voltage over frequency, its field current unchanged.

        With phi = min(1, f_w/f) the torque of the field is proportional to V E/(X omega) ~ phi, the reluctance torque to
        V²/(X omega) ~ phi², and that of the damper winding at the same slip speed to phi². The rated torque is proportional
        to phi.

        Raises:
            SceneError: for a torque limit, or a switched field, which the load angle does not describe.

        >>> motor = Synchronous(power=15e3, poles=4, frequency=50.0, pull_out_ratio=2.0, damping=4.0)
        >>> fast = motor.fed(Inverter(100.0, 50.0))
        >>> round(fast.pull_out_torque / motor.pull_out_torque, 9), round(fast.power, 3), round(fast.damping, 9)
        (0.5, 15000.0, 1.0)

        """
        faults = [fault.under("inverter") for fault in inverter.faults()]
        if inverter.torque_limit is not None:
            defect = f"{inverter.torque_limit:g} of a {self.title} that keeps step with a set frequency"
            advice = (
                'the load sets its load angle; a drive that limits torque turns the field with the rotor: type = "servo"'
            )
            faults.append(Fault("inverter.torque_limit", defect, "none", advice))
        if self.field_at is not None:
            faults.append(Fault("field_at", "a field that is switched, on an inverter", "a field always on"))
        refuse(faults)
        flux, share = min(1.0, inverter.weakening / inverter.frequency), inverter.frequency / self.frequency
        saliency = self.saliency * flux
        pull_out_torque = self.field_torque * flux * pull_out(saliency)[1]
        ratio = pull_out_torque / (self.rated.torque * flux)
        return replace(
            self,
            power=self.power * share * flux,
            frequency=inverter.frequency,
            pull_out_ratio=ratio,
            saliency=saliency,
            damping=self.damping * flux**2,
            asynchronous_ratio=None if self.asynchronous_ratio is None else self.asynchronous_ratio * flux,
            inverter=inverter,
        )

    def facts(self) -> Iterator[Fact]:
        """The torque by its load angle."""
        yield from super().facts()
        if self.inverter is not None:
            yield Fact(_("On its inverter these are the values at the set frequency."))
        field, reluctance = Fact("", "T_p", self.field_torque, "N m"), Fact("", "T_r", self.reluctance_torque, "N m")
        words, law = (
            _("Greatest torque in synchronism, by its load angle"),
            "T_po = T_p*sin(delta) + T_r*sin(2*delta)",
        )
        numbers = (field, reluctance, Fact("", "delta", self.pull_out_angle, "rad"))
        yield Fact(words, "T_po", self.pull_out_torque, "N m", law, numbers)
        yield Fact(_("The load angle turns on with the slip: along the motion dδ/dt = p (ω_s − ω) is solved with it."))

    def heat_facts(self, energy: Energy) -> Iterator[Fact]:
        """Fact that its load angle decides."""
        yield Fact(_("A synchronous motor is checked by its load angle; its heat depends on its windings."))

    @cached_property
    def circuit(self) -> LoadAngle:
        """The load angle, and a switched field, or the rising frequency of an inverter."""
        return RampedLoadAngle(self) if self.inverter is not None and self.inverter.ramp else LoadAngle(self)

    def graph(self) -> Part:
        """The motor as a part of a bond graph, open at the 1-junction `rotor` of its shaft.

        A rotating source of flow Sf holds a 0-junction at synchronous speed; through the 1-junction `slip` between it and
        the rotor a spring C, with the law of the load angle, and the damper winding R give the torque.

        Raises:
            SceneError: with a switched field, or a rising frequency.

        >>> print(*Synchronous(power=15e3, poles=4, frequency=50.0, pull_out_ratio=2.0, damping=4.0).graph().elements)
        rotor field mains slip slip.rate load_angle damper

        """
        if self.field_at is not None:
            raise SceneError([Fault("field_at", "a field that is switched", "a field always on, as in a bond graph")])
        if isinstance(self.circuit, RampedLoadAngle):
            raise SceneError([Fault("inverter.ramp", "a frequency that rises", "a set one, as in a bond graph")])
        p, d = self.pole_pairs, self.field_torque

        def torque(q: Any, ns: Any = np) -> Any:
            return d * ns.sin(p * q) + self.reluctance_torque * ns.sin(2.0 * p * q)

        def damper(f: Any) -> Any:
            return self.damper_torque(f)

        b = Builder().one("rotor", "rotation").zero("field", "rotation")
        b.port("field", Sf("mains", self.synchronous_speed))
        parts = [C("load_angle", torque)]
        if self.damping:
            parts.append(R("damper", damper if math.isfinite(self.damper_reach) else self.damping))
        b.between("field", "rotor", *parts, name="slip")
        if self.inertia:
            b.port("rotor", I("inertia", self.inertia))
        return b.part("rotor")


class LoadAngle(Circuit):
    """The load angle d of a synchronous motor (rad, electrical), and the share g of a switched field.

    T = g T_p sin(d) + T_r sin(2 d) + T_a(u), dd/dt = p u, u = omega_s - omega; dg/dt = (target(omega) - g)/tau.
    Source: as `Synchronous`.

    >>> motor = Synchronous(power=15e3, poles=4, frequency=50.0, pull_out_ratio=2.0, damping=4.0)
    >>> circuit, speed = motor.circuit, motor.synchronous_speed
    >>> round(circuit.torque(speed, (0.5235987755982989,)), 6), round(motor.rated.torque, 6)
    (95.492966, 95.492966)
    >>> [round(rate, 9) for rate in circuit.rates(speed - 1.0, (0.5,))]
    [2.0]
    """

    def __init__(self, motor: Synchronous) -> None:
        self.motor, self.only_speed, self.greatest_torque = motor, motor.synchronous_speed, motor.pull_out_torque
        spring = "q", "load_angle", float(motor.pole_pairs)
        self.names, self.scales = (StateName("load_angle", "rad", turns=True, in_graph=spring),), (1.0,)
        if motor.field_at is not None:
            self.names, self.scales = (*self.names, StateName("field", "1")), (1.0, 1.0)

    def turning(self, omega: Any, states: States) -> tuple[Any, Any]:
        """The speed of the field, rad/s, and the torque of the damper winding, N m."""
        return self.motor.synchronous_speed, self.motor.damper_torque(self.motor.synchronous_speed - omega)

    def torque(self, omega: Any, states: States) -> Any:
        """Torque on the shaft, N m."""
        motor, d = self.motor, states[0]
        if isinstance(d, float) and not math.isfinite(d):  # a step tried too far
            return math.nan
        sin = math.sin if isinstance(d, float) else np.sin
        field = motor.field_torque if motor.field_at is None else motor.field_torque * states[1]
        torque = field * sin(d) + motor.damper_torque(motor.synchronous_speed - omega)
        return torque + motor.reluctance_torque * sin(2.0 * d) if motor.saliency else torque

    def rates(self, omega: Any, states: States) -> tuple[Any, ...]:
        """Rate of the load angle, rad/s, and of the field's share, 1/s."""
        motor = self.motor
        turning = motor.pole_pairs * (motor.synchronous_speed - omega)
        if motor.field_at is None:
            return (turning,)
        return turning, (self._field_share(omega)[0] - states[1]) / motor.field_time

    def _field_share(self, omega: Any) -> tuple[Any, Any]:
        """The share of the field at a speed, and its slope (s/rad): 6 x^5 - 15 x^4 + 10 x^3 over the band."""
        motor = self.motor
        assert motor.field_at is not None
        width = FIELD_BAND * motor.synchronous_speed
        plain = isinstance(omega, float)
        x = (omega - motor.field_at) / width
        x = min(max(x, 0.0), 1.0) if plain else np.clip(x, 0.0, 1.0)
        return x * x * x * (10.0 + x * (6.0 * x - 15.0)), 30.0 * (x * (1.0 - x)) ** 2 / width

    def slopes(self, omega: Any, states: States) -> Slopes:
        """Derivatives of torque and rates."""
        motor, d = self.motor, states[0]
        u, reach = motor.synchronous_speed - omega, motor.damper_reach
        square = (u / reach) ** 2  # 0 if the reach is infinite
        by_speed = -motor.damping * (1.0 - square) / (1.0 + square) ** 2
        share = 1.0 if motor.field_at is None else states[1]
        by_angle = share * motor.field_torque * np.cos(d) + 2.0 * motor.reluctance_torque * np.cos(2.0 * d)
        if motor.field_at is None:
            return Slopes(by_speed, (by_angle,), (-motor.pole_pairs,), ((0.0,),))
        by_field, slope = motor.field_torque * np.sin(d), self._field_share(omega)[1] / motor.field_time
        return Slopes(
            by_speed, (by_angle, by_field), (-motor.pole_pairs, slope), ((0.0, 0.0), (0.0, -1.0 / motor.field_time))
        )

    def steady(self, omega: Any) -> tuple[Any, ...]:
        """Load angle 0, and the field at the speed: out of step the torque of the angle is 0 on average."""
        zero = 0.0 * omega
        return (zero,) if self.motor.field_at is None else (zero, self._field_share(omega)[0])

    def carrying(self, net: Callable[[tuple[float, ...]], float]) -> tuple[float, ...] | None:
        """The states in step at which a net work (or torque), which grows with the load angle up to pull-out, is 0.

        None if there is no such angle below pull-out: the motor cannot carry that.
        """
        field = () if self.motor.field_at is None else (1.0,)
        most = self.motor.pull_out_angle

        def at(angle: float) -> float:
            return net((angle, *field))

        return (root(at, -most, most), *field) if at(-most) <= 0.0 <= at(most) else None

    def standing(self, states: States, time: Any) -> tuple[Any, ...]:
        """The load angle of a rotor at rest, which the field's poles pass; its field decays."""
        motor = self.motor
        angle = states[0] + motor.pole_pairs * motor.synchronous_speed * time
        if motor.field_at is None:
            return (angle,)
        return angle, states[1] * np.exp(-np.asarray(time) / motor.field_time)


class RampedLoadAngle(LoadAngle):
    """The load angle while the frequency of an inverter rises, and its share x of the set one (`FrequencyRamp`).

    With the flux f over that at the set frequency T = f T_p sin(d) + f² (T_r sin(2 d) + T_a(u)), u = x omega_s - omega,
    dd/dt = p u. Source: as `Synchronous.fed`, at the instantaneous frequency.

    >>> motor = Synchronous(power=15e3, poles=4, frequency=50.0, pull_out_ratio=2.0, damping=4.0)
    >>> circuit = motor.fed(Inverter(100.0, 50.0, ramp=2.0)).circuit
    >>> beside = [circuit.torque(0.0, (math.pi / 2, x)) - circuit.turning(0.0, (0.0, x))[1] for x in (0.25, 0.5, 1.0)]
    >>> [round(float(torque), 6) for torque in beside]
    [190.985932, 190.985932, 95.492966]

    """

    def __init__(self, motor: Synchronous) -> None:
        super().__init__(motor)
        assert motor.inverter is not None
        self.ramp = motor.inverter.rising
        self.names, self.scales = (*self.names, StateName("frequency_share", "1")), (1.0, 1.0)

    def turning(self, omega: Any, states: States) -> tuple[Any, Any]:
        """The speed of the field, rad/s, and the torque of the damper winding, N m."""
        share = states[1] if len(states) else 1.0
        field = self.motor.synchronous_speed * share
        return field, self.ramp.flux(share) ** 2 * self.motor.damper_torque(field - omega)

    def torque(self, omega: Any, states: States) -> Any:
        """Torque on the shaft, N m."""
        motor, d, flux = self.motor, states[0], self.ramp.flux(states[1])
        if isinstance(d, float) and not math.isfinite(d):  # a step tried too far
            return math.nan
        torque = flux * motor.field_torque * np.sin(d) + self.turning(omega, states)[1]
        return torque + flux**2 * motor.reluctance_torque * np.sin(2.0 * d)

    def rates(self, omega: Any, states: States) -> tuple[Any, ...]:
        """Rate of the load angle, rad/s, and of the frequency's share, 1/s."""
        turning = self.motor.pole_pairs * (self.motor.synchronous_speed * states[1] - omega)
        return turning, self.ramp.rate(states[1])

    def slopes(self, omega: Any, states: States) -> Slopes:
        """Derivatives of torque and rates."""
        motor, (d, share) = self.motor, states
        flux, field = self.ramp.flux(share), motor.synchronous_speed
        fading = np.where(share > self.ramp.weakening, -(flux**2), 0.0)
        square = ((field * share - omega) / motor.damper_reach) ** 2  # 0 if the reach is infinite
        by_slip = flux**2 * motor.damping * (1.0 - square) / (1.0 + square) ** 2
        by_angle = flux * motor.field_torque * np.cos(d) + 2.0 * flux**2 * motor.reluctance_torque * np.cos(2.0 * d)
        squared = motor.reluctance_torque * np.sin(2.0 * d) + motor.damper_torque(field * share - omega)
        by_share = fading * (motor.field_torque * np.sin(d) + 2.0 * flux * squared) + by_slip * field
        pairs = motor.pole_pairs
        return Slopes(-by_slip, (by_angle, by_share), (-pairs, 0.0), ((0.0, pairs * field), (0.0, self.ramp.slope(share))))

    def steady(self, omega: Any) -> tuple[Any, ...]:
        """Load angle 0 at the full frequency: out of step the torque of the angle is 0 on average."""
        return 0.0 * omega, 1.0 + 0.0 * omega

    def carrying(self, net: Callable[[tuple[float, ...]], float]) -> tuple[float, ...] | None:
        """The states in step, at the full frequency."""
        states_at_load = super().carrying(lambda states: net((*states, 1.0)))
        return None if states_at_load is None else (*states_at_load, 1.0)

    def standing(self, states: States, time: Any) -> tuple[Any, ...]:
        """The load angle of a rotor at rest, which the field's poles pass ever faster, and the frequency's share."""
        share, turned = self.ramp.after(float(states[1]), np.asarray(time, dtype=float))
        return states[0] + self.motor.pole_pairs * self.motor.synchronous_speed * turned, share
