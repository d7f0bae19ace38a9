"""The equivalent circuit of induction motors, and motors with their electrical transients by it (two-axis model).

`EquivalentCircuit` is that of textbooks, which Kloss's formula simplifies: with the stator's resistance left out, the
circuit's torque is that formula. `TwoAxisInduction` is a motor by its `Impedances` whose four fluxes, in the frame that
turns with the field, are its states.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.components.motors.induction import BARE, MOST_SLIP, Induction
from flywheel.components.motors.motor import Array, Circuit, Inverter, Motor, ShaftMotion, Slopes, StateName, States
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Cells
from flywheel.numerics.expressions import Expression, compiled, expression_of, parse
from flywheel.numerics.faults import NOT_NEGATIVE, POSITIVE, Fault, SceneError, number_faults, refuse

ALIKE = 0.2
"""Tolerance of the circuit's torques relative to those of the name plate."""


class Impedances(NamedTuple):
    """The equivalent circuit of a phase in star, ohm: resistances, and reactances at the frequency of the mains.

    Those of the rotor are referred to the stator.
    """

    stator_resistance: float
    stator_reactance: float
    magnetizing_reactance: float
    rotor_resistance: float
    rotor_reactance: float


@dataclass(frozen=True, kw_only=True)
class EquivalentCircuit:
    """Stator R_1 + jX_1, and magnetizing jX_m beside the rotor R_2/s + jX_2: one phase of a star, referred to the stator.

    Args:
        voltage: between the lines, V.
        synchronous_speed: of the field, rad/s.
        stator_resistance: R_1, ohm, 0 or above.
        stator_reactance: X_1, ohm, 0 or above.
        rotor_resistance: R_2, ohm.
        rotor_reactance: X_2, ohm.
        magnetizing_reactance: X_m, ohm.

    Raises:
        SceneError: for values out of range.

    With Thevenin's voltage U_th = U jX_m/(R_1 + j(X_1 + X_m)) and impedance R_th + jX_th behind the stator,
    T = 3 |U_th|² R_2 s/(omega_s ((R_th s + R_2)² + s² (X_th + X_2)²)), greatest at s_b = R_2/sqrt(R_th² + (X_th + X_2)²).
    Valid for a balanced supply and constant parameters; iron and friction losses are left out. Source: Chapman, Electric
    Machinery Fundamentals, 5th ed., sections 6.4 and 6.5; Fitzgerald et al., Electric Machinery, 6th ed., sections 6.4 and
    6.5; IEEE 112.

    Chapman's example 6-3 (460 V, 60 Hz, 4 poles, slip 2.2 %) prints 18.88 A at 33.6 degrees behind and 62.8 N m:

    >>> motor = EquivalentCircuit(voltage=460.0, synchronous_speed=60 * math.pi, stator_resistance=0.641,
    ...                           rotor_resistance=0.332, stator_reactance=1.106, rotor_reactance=0.464,
    ...                           magnetizing_reactance=26.3)
    >>> current = complex(motor.current(0.022))
    >>> round(abs(current), 2), round(math.degrees(cmath.phase(current)), 1), round(float(motor.torque(0.022)), 1)
    (18.89, -33.7, 62.8)

    """

    voltage: float
    synchronous_speed: float
    stator_resistance: float
    stator_reactance: float
    rotor_resistance: float
    rotor_reactance: float
    magnetizing_reactance: float

    def __post_init__(self) -> None:
        """Refuses values out of range."""
        may_be_none = ("stator_resistance", "stator_reactance")
        pairs = [(one.name, NOT_NEGATIVE if one.name in may_be_none else POSITIVE) for one in fields(self)]
        refuse([fault for name, expected in pairs for fault in number_faults(name, getattr(self, name), expected)])

    @property
    def thevenin(self) -> tuple[complex, complex]:
        """Voltage (V) and impedance (ohm) at the rotor."""
        stator, field = complex(self.stator_resistance, self.stator_reactance), 1j * self.magnetizing_reactance
        share = field / (stator + field)
        return self.voltage / math.sqrt(3.0) * share, stator * share

    def current(self, slip: ArrayLike) -> NDArray[np.complex128]:
        """Line current (A, its root mean square, as a phasor relative to the voltage's) at slips, of their shape."""
        slips = np.asarray(slip, dtype=float)
        field, stator = 1j * self.magnetizing_reactance, complex(self.stator_resistance, self.stator_reactance)
        admittance = 1.0 / field + slips / (self.rotor_resistance + 1j * self.rotor_reactance * slips)
        return np.asarray(self.voltage / math.sqrt(3.0) / (stator + 1.0 / admittance))

    def torque(self, slip: ArrayLike) -> Array:
        """Torque of the air gap, N m, at slips, of their shape; friction is not subtracted."""
        slips, (source, inner) = np.asarray(slip, dtype=float), self.thevenin
        resistance, reactance = inner.real * slips + self.rotor_resistance, (inner.imag + self.rotor_reactance) * slips
        power = 3.0 * abs(source) ** 2 * self.rotor_resistance * slips / (resistance**2 + reactance**2)
        return np.asarray(power / self.synchronous_speed)

    @property
    def breakdown_slip(self) -> float:
        """Slip at which torque is greatest."""
        inner = self.thevenin[1]
        return self.rotor_resistance / math.hypot(inner.real, inner.imag + self.rotor_reactance)

    @property
    def breakdown_torque(self) -> float:
        """The greatest torque as a motor, N m: 3 |U_th|²/(2 omega_s (R_th + sqrt(R_th² + (X_th + X_2)²)))."""
        source, inner = self.thevenin
        most = inner.real + math.hypot(inner.real, inner.imag + self.rotor_reactance)
        return 3.0 * abs(source) ** 2 / (2.0 * self.synchronous_speed * most)

    def power_factor(self, slip: float) -> float:
        """Cosine of the angle by which the current lags, at a slip."""
        return math.cos(cmath.phase(complex(self.current(slip))))


def equivalent_circuit(impedances: Impedances, voltage: float, synchronous_speed: float) -> EquivalentCircuit:
    """The circuit of impedances at a voltage (V, between the lines), with the speed (rad/s) of the field."""
    return EquivalentCircuit(voltage=voltage, synchronous_speed=synchronous_speed, **impedances._asdict())


@dataclass(frozen=True, kw_only=True)
class TwoAxisInduction(Induction):
    """An induction motor whose fluxes are states; where they follow the speed, torque is the circuit's.

    T(s) = (3 V²/omega_s) r s/((R s + r)² + X² s²), with V, R + j X_1 the circuit of Thévenin of stator and magnetizing
    reactance at a phase, X = X_1 + x_r, r the rotor's resistance.

    Args:
        voltage: U between the lines, V.
        impedances: of the equivalent circuit.
        on_mains: for a motor on an inverter, that of the name plate.
        at_once: true of fluxes that follow the speed at once, which are no states.

    Raises:
        SceneError: for values out of range, and for a circuit whose torque at rated speed, or whose breakdown torque, is not
            that of the name plate.

    Valid for symmetric windings without saturation, skin effect and iron losses, on a stiff mains. Source: Krause,
    Wasynczuk and Sudhoff, Analysis of Electric Machinery and Drive Systems, 2nd ed., chapter 4 (eqs. 4.5-13 ff., 4.9-14);
    Fitzgerald et al., Electric Machinery, 6th ed., chapter 6 (circuit, Thévenin).

    >>> motor = TwoAxisInduction(power=2238.0, speed=1710 * math.pi / 30, poles=4, frequency=60.0, breakdown_ratio=4.5,
    ...                          voltage=220.0, impedances=Impedances(0.435, 0.754, 26.13, 0.816, 0.754), inertia=0.089)
    >>> round(float(motor.torque(motor.speed)), 2), round(motor.breakdown_slip, 4)
    (14.03, 0.5268)

    """

    voltage: float
    impedances: Impedances
    on_mains: TwoAxisInduction | None = None
    at_once: bool = False

    def __post_init__(self) -> None:
        """Refuses values out of range, and a circuit that is not that of the plate."""
        super().__post_init__()
        faults = number_faults("voltage", self.voltage)
        faults += [f for name, value in self.impedances._asdict().items() for f in number_faults(name, value)]
        refuse(faults)
        torque, greatest = float(self.torque(self.speed)), self.breakdown_torque
        rated = self.power / self.speed
        if abs(torque / rated - 1.0) > ALIKE:
            defect = f"{torque:.5g} N m of the circuit at rated speed"
            expected = f"about {rated:.5g} N m, rated power over speed"
            faults.append(Fault("rotor_resistance", defect, expected, "give those of a phase in star, in ohm"))
        elif abs(greatest / (self.breakdown_ratio * rated) - 1.0) > ALIKE:
            defect = f"{self.breakdown_ratio:g}, with a breakdown torque of {greatest:.5g} N m of the circuit"
            faults.append(Fault("breakdown_ratio", defect, f"about {greatest / rated:.4g}"))
        refuse(faults)

    def fed(self, inverter: Inverter) -> TwoAxisInduction:
        """The motor on an inverter: voltage and reactances in proportion to the frequency, its fluxes by the circuit.

        Below the weakening frequency U/f is that of the mains, and the drop at the stator's resistance is not compensated.
        The rated point is that of the same slip speed; rated heat and current are those of the name plate.

        Raises:
            SceneError: for a torque limit, and a frequency at which that slip speed is no running branch.

        >>> plate = {"power": 2238.0, "speed": 1710 * math.pi / 30, "poles": 4, "frequency": 60.0, "breakdown_ratio": 4.5}
        >>> motor = TwoAxisInduction(**plate, voltage=220.0, impedances=Impedances(0.435, 0.754, 26.13, 0.816, 0.754))
        >>> half = motor.fed(Inverter(30.0, 60.0))
        >>> half.voltage, half.impedances.magnetizing_reactance, round(half.speed * 30 / math.pi, 9)
        (110.0, 13.065, 810.0)

        """
        faults = [fault.under("inverter") for fault in inverter.faults()]
        if inverter.torque_limit is not None:
            advice = "an inverter that limits the torque controls the currents, which the circuit does not tell of"
            defect = f"{inverter.torque_limit:g} with electrical two-axis"
            faults.append(Fault("inverter.torque_limit", defect, "none, or electrical static", advice))
        refuse(faults)
        share, slip_speed = inverter.frequency / self.frequency, self.synchronous_speed - self.speed
        field = self.synchronous_speed * share
        least = self.frequency * self.rated_slip / MOST_SLIP
        if not inverter.frequency > least:
            defect, expected = f"{inverter.frequency:g} Hz with electrical two-axis", f"more than {least:.4g} Hz"
            raise SceneError(
                [Fault("inverter.frequency", defect, expected, "the rated slip speed is too near to the field's")]
            )
        volts = self.voltage * min(inverter.frequency, inverter.weakening) / self.frequency
        scaled = {name: share * value for name, value in self.impedances._asdict().items() if name.endswith("reactance")}
        circuit = self.impedances._replace(**scaled)
        own = equivalent_circuit(circuit, volts, field)
        torque = float(own.torque(slip_speed / field))
        if not own.breakdown_torque > torque or not slip_speed / field < own.breakdown_slip:
            defect = f"{inverter.frequency:g} Hz, with the field weakened from {inverter.weakening:g} Hz on"
            advice = "at that the motor breaks down before its rated slip"
            raise SceneError([Fault("inverter.frequency", defect, "a lower one", advice)])
        return replace(
            self,
            power=torque * (field - slip_speed),
            speed=field - slip_speed,
            frequency=inverter.frequency,
            breakdown_ratio=own.breakdown_torque / torque,
            plate=BARE,
            voltage=volts,
            impedances=circuit,
            inverter=inverter,
            on_mains=self,
        )

    @property
    def rated_heat(self) -> float:
        """Heat of the rotor at the rated point of the name plate, W."""
        return super().rated_heat if self.on_mains is None else self.on_mains.rated_heat

    @property
    def rated_total_heat(self) -> float:
        """Heat of rotor and stator at the rated point of the name plate, W."""
        return super().rated_total_heat if self.on_mains is None else self.on_mains.rated_total_heat

    def input_power(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> Array:
        """Power from the inverter, W, by the fluxes; without them that of stationary fluxes."""
        circuit = Fluxes(self) if self.circuit is None else self.circuit
        return np.asarray(circuit.power(states if len(states) else circuit.steady(omega)))

    @cached_property
    def equivalent(self) -> EquivalentCircuit:
        """The circuit of a phase."""
        return equivalent_circuit(self.impedances, self.voltage, self.synchronous_speed)

    @property
    def breakdown_slip(self) -> float:
        """Slip r/sqrt(R² + X²) at which torque is greatest."""
        return self.equivalent.breakdown_slip

    @property
    def breakdown_torque(self) -> float:
        """The greatest torque as a motor, N m."""
        return float(self.torque(self.synchronous_speed * (1.0 - self.breakdown_slip)))

    def law(self) -> Expression:
        """The torque on the shaft where the fluxes follow the speed, N m."""
        voltage, seen = self.equivalent.thevenin
        r, x = self.impedances.rotor_resistance, seen.imag + self.impedances.rotor_reactance
        field = self.synchronous_speed
        u = f"({expression_of(field)} - omega)"
        factor = 3.0 * abs(voltage) ** 2 * r  # in u = s omega_s
        base = f"({expression_of(seen.real)}*{u} + {expression_of(r * field)})**2"
        return parse(f"{expression_of(factor)}*{u}/({base} + {expression_of(x * x)}*{u}**2)")

    @property
    def rated_current(self) -> float:
        """Current of a line at rated load, A: that of the plate, or without it that of the circuit."""
        if self.on_mains is not None:
            return self.on_mains.rated_current
        return self.line_current.rated or float(self._line_law.evaluate({"omega": np.float64(self.speed)}, np))

    def share_law(self) -> Expression:
        """The line current over the rated one as an expression of `omega`, where the fluxes follow the speed."""
        return compiled("{current}/{rated}", current=self._line_law, rated=self.rated_current)

    @cached_property
    def _line_law(self) -> Expression:
        """The line current, A: U/(sqrt(3) |Z|) with Z = R + jX + jX_m (r/s + jx)/(r/s + j(x + X_m)), s the slip."""
        z = self.impedances
        stator, rotor = z.stator_reactance + z.magnetizing_reactance, z.rotor_reactance + z.magnetizing_reactance
        return compiled(
            "{voltage}*sqrt(({r}**2 + ({rotor}*{slip})**2)/(({one} - {two}*{slip})**2 + ({three} + {four}*{slip})**2))",
            voltage=self.voltage / math.sqrt(3.0),
            r=z.rotor_resistance,
            rotor=rotor,
            slip=compiled("({field} - omega)/{field}", field=self.synchronous_speed),
            one=z.stator_resistance * z.rotor_resistance,
            two=z.stator_reactance * rotor + z.magnetizing_reactance * z.rotor_reactance,
            three=z.rotor_resistance * stator,
            four=z.stator_resistance * rotor,
        )

    def speed_at(self, torque: float) -> float | None:
        """Speed (rad/s) on the running branch at which it gives a torque (N m); None above the breakdown torque."""
        return Motor.speed_at(self, torque)

    @cached_property
    def circuit(self) -> Fluxes | None:
        """The fluxes of stator and rotor; on a ramp of an inverter the frequency too; None if they follow at once."""
        if self.at_once:
            return None
        return RampedFluxes(self) if self.inverter is not None and self.inverter.ramp else Fluxes(self)

    def heat(self, omega: Any, states: States = ()) -> Any:
        """Heat in the rotor, W, by the fluxes where they are given."""
        return self.rotor_heat(omega) if self.circuit is None or not len(states) else self.circuit.rotor_heat(states)

    def total_heat(self, omega: Any, states: States = ()) -> Any:
        """Heat of rotor and stator, W, by the fluxes, the stationary ones if none are given."""
        if self.circuit is None:
            return super().total_heat(omega)
        own = states if len(states) else self.circuit.steady(omega)
        return self.circuit.rotor_heat(own) + self.circuit.stator_heat(own)

    def heats(self, shaft: ShaftMotion) -> dict[str, Any]:
        """Line current and heats of rotor and stator by the fluxes where these are states of the motion.

        Errors of the fluxes of at most e each change a heat Q by 2 sqrt(3/2 r Q) k e, with k e the error of a current.
        """
        circuit = self.circuit
        if circuit is None or not shaft.has_states:
            return super().heats(shaft)

        def of_rotor(mesh: Cells, omega: Array) -> tuple[Array, Array]:
            return np.asarray(circuit.rotor_heat(shaft.states(mesh))), np.zeros_like(omega)

        def of_stator(mesh: Cells, omega: Array) -> tuple[Array, Array]:
            return np.asarray(circuit.stator_heat(shaft.states(mesh))), np.zeros_like(omega)

        off = 2.0 * (shaft.states_error + 8 * ROUNDING * circuit.scales[0])
        by_flux = (circuit.of_rotor + circuit.of_shared, circuit.of_stator + circuit.of_shared)
        figures, errors = dict[str, Any](), dict[str, float]()
        rows = zip((of_rotor, of_stator), (circuit.rotor_resistance, circuit.stator_resistance), by_flux, strict=True)
        for name, (heat, resistance, gain) in zip(("rotor_heat", "stator_heat"), rows, strict=True):
            mean, error, mesh = shaft.mean_over_time(heat)
            own = 2.0 * float(np.sqrt(1.5 * resistance * mean)) * gain * off
            figures[name], errors[name] = mean, (error + own) / max(mean, 1e-300)
        rated = self.rated_heat
        figures["rotor_heat_share"] = figures["rotor_heat"] / rated
        errors["rotor_heat_share"] = errors["rotor_heat"] + 8 * ROUNDING / self.rated_slip
        current = cells.fit(np.asarray(circuit.current(0.0, shaft.states(mesh))))
        figures["current_rms"] = float(np.sqrt(figures["stator_heat"] / (3.0 * circuit.stator_resistance)))
        figures["current_peak"] = cells.greatest(current)
        errors["current_rms"] = errors["stator_heat"]
        peak = max(figures["current_peak"], 1e-300)
        errors["current_peak"] = (float(cells.tails(current).max()) + by_flux[1] * off) / peak
        return {**figures, "errors": errors}

    def powers(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> dict[str, Array]:
        """Copper heats ("stator", "rotor"), and the power stored in the fluxes ("field"), W."""
        if self.circuit is None:
            return super().powers(omega, torque)
        stator, rotor = self.circuit.stator_heat(states), self.circuit.rotor_heat(states)
        return {"stator": stator, "rotor": rotor, "field": self.circuit.power(states) - torque * omega - stator - rotor}

    @property
    def static(self) -> Motor | None:
        """The same motor with fluxes that follow the speed at once; None of such a one."""
        return None if self.at_once else replace(self, at_once=True)


class Fluxes(Circuit):
    """Flux linkages (V s) of stator and rotor on two axes that turn with the field; the voltage lies on the axis q.

    With the complex flux l = l_q - j l_d of each winding: dl_s/dt = V - (a + j omega_e) l_s + b l_r,
    dl_r/dt = c l_s - (d + j (omega_e - p omega)) l_r; T = 3/2 p (L_m/D)(l_sq l_rd - l_sd l_rq); D = L_s L_r - L_m², a = r_s
    L_r/D, b = r_s L_m/D, c = r_r L_m/D, d = r_r L_s/D. Source: as `TwoAxisInduction`.
    """

    names: tuple[StateName, ...] = (
        StateName("stator_flux_q", "V s"),
        StateName("stator_flux_d", "V s"),
        StateName("rotor_flux_q", "V s"),
        StateName("rotor_flux_d", "V s"),
    )

    def __init__(self, motor: TwoAxisInduction) -> None:
        z, self.mains = motor.impedances, 2.0 * math.pi * motor.frequency
        self.pairs, self.voltage = motor.poles / 2, motor.voltage * math.sqrt(2.0 / 3.0)
        stator, rotor = z.stator_reactance + z.magnetizing_reactance, z.rotor_reactance + z.magnetizing_reactance
        shared = stator * rotor - z.magnetizing_reactance**2  # omega_e² D
        self.a, self.b = (z.stator_resistance * self.mains * x / shared for x in (rotor, z.magnetizing_reactance))
        self.c, self.d = (z.rotor_resistance * self.mains * x / shared for x in (z.magnetizing_reactance, stator))
        self.of_rotor, self.of_shared = (self.mains * x / shared for x in (stator, z.magnetizing_reactance))
        self.of_stator = self.mains * rotor / shared
        self.rotor_resistance, self.stator_resistance = z.rotor_resistance, z.stator_resistance
        self.factor = 1.5 * self.pairs * self.of_shared
        self.scales = (self.voltage / self.mains,) * 4

    def torque(self, omega: Any, states: States) -> Any:
        """Torque on the shaft 3/2 p (L_m/D)(l_sq l_rd - l_sd l_rq), N m."""
        sq, sd, rq, rd = states[:4]
        return self.factor * (sq * rd - sd * rq)

    def rates(self, omega: Any, states: States) -> tuple[Any, ...]:
        """Rates of the fluxes, V."""
        return self.rates_at(omega, states, self.mains, self.voltage)

    def rates_at(self, omega: Any, states: States, mains: Any, voltage: Any) -> tuple[Any, ...]:
        """Rates of the fluxes, V, at an angular frequency (rad/s) and a voltage (V)."""
        sq, sd, rq, rd = states[:4]
        slip = mains - self.pairs * omega
        return (
            voltage - self.a * sq - mains * sd + self.b * rq,
            -self.a * sd + mains * sq + self.b * rd,
            self.c * sq - self.d * rq - slip * rd,
            self.c * sd - self.d * rd + slip * rq,
        )

    def slopes(self, omega: Any, states: States) -> Slopes:
        """Derivatives of torque and rates."""
        sq, sd, rq, rd = states[:4]
        slip, k = self.mains - self.pairs * omega, self.factor
        return Slopes(
            0.0,
            (k * rd, -k * rq, -k * sd, k * sq),
            (0.0, 0.0, self.pairs * rd, -self.pairs * rq),
            (
                (-self.a, -self.mains, self.b, 0.0),
                (self.mains, -self.a, 0.0, self.b),
                (self.c, 0.0, -self.d, -slip),
                (0.0, self.c, slip, -self.d),
            ),
        )

    def _settled(self, omega: Any) -> tuple[Any, Any]:
        """The stationary complex fluxes at constant speeds."""
        turned = 1j * (self.mains - self.pairs * omega) + self.d
        share = self.voltage / ((1j * self.mains + self.a) * turned - self.b * self.c)
        return share * turned, share * self.c

    def steady(self, omega: Any) -> tuple[Any, ...]:
        """The stationary fluxes at constant speeds."""
        stator, rotor = self._settled(omega)
        return stator.real, -stator.imag, rotor.real, -rotor.imag

    def standing(self, states: States, time: Any) -> tuple[Any, ...]:
        """The fluxes of a locked rotor: linear, by the eigenvalues of their equations."""
        matrix = np.array([[-(self.a + 1j * self.mains), self.b], [self.c, -(self.d + 1j * self.mains)]])
        settled = np.array(self._settled(0.0))
        sq, sd, rq, rd = states[:4]
        values, vectors = np.linalg.eig(matrix)
        shares = np.linalg.solve(vectors, np.array([sq - 1j * sd, rq - 1j * rd]) - settled)
        t = np.asarray(time, dtype=float)
        stator, rotor = (
            settled[k] + sum(vectors[k, j] * shares[j] * np.exp(values[j] * t) for j in range(2)) for k in range(2)
        )
        return stator.real, -stator.imag, rotor.real, -rotor.imag

    def current(self, omega: Any, states: States) -> Any:
        """Current of a line, A: the root mean square at constant fluxes."""
        sq, sd, rq, rd = states[:4]
        q, d = (self.of_stator * s - self.of_shared * r for s, r in ((sq, rq), (sd, rd)))
        return np.sqrt(0.5 * (q * q + d * d))

    def power(self, states: States) -> Any:
        """Power from the mains 3/2 V i_q, W."""
        return 1.5 * self.voltage * (self.of_stator * states[0] - self.of_shared * states[2])

    def rotor_heat(self, states: States) -> Any:
        """Heat in the rotor 3/2 r (i_q² + i_d²), W."""
        sq, sd, rq, rd = states[:4]
        q, d = (self.of_rotor * r - self.of_shared * s for s, r in ((sq, rq), (sd, rd)))
        return 1.5 * self.rotor_resistance * (q * q + d * d)

    def stator_heat(self, states: States) -> Any:
        """Copper heat in the stator 3/2 R (i_q² + i_d²), W."""
        return 3.0 * self.stator_resistance * self.current(0.0, states) ** 2


class RampedFluxes(Fluxes):
    """The fluxes while the frequency rises to that of the steady regime: its share x is a state too (`FrequencyRamp`)."""

    names = (*Fluxes.names, StateName("frequency_share", "1"))

    def __init__(self, motor: TwoAxisInduction) -> None:
        super().__init__(motor)
        assert motor.inverter is not None
        self.ramp, self.scales = motor.inverter.rising, (*self.scales, 1.0)

    def rates(self, omega: Any, states: States) -> tuple[Any, ...]:
        """Rates of the fluxes, V, and of the share of the frequency, 1/s."""
        share, voltage = states[4], self.voltage * self.ramp.voltage(states[4])
        return *self.rates_at(omega, states, share * self.mains, voltage), self.ramp.rate(share)

    def slopes(self, omega: Any, states: States) -> Slopes:
        """Derivatives of torque and rates."""
        sq, sd, rq, rd, share = states
        base, mains = super().slopes(omega, states), share * self.mains
        slip, zero = mains - self.pairs * omega, 0.0 * share
        rising = np.where(share < self.ramp.weakening, self.voltage / self.ramp.weakening, 0.0)
        settling = self.ramp.slope(share)
        rows = base.rates_by_states
        return Slopes(
            0.0,
            (*base.torque_by_states, zero),
            (*base.rates_by_speed, zero),
            (
                (rows[0][0], -mains, rows[0][2], 0.0, rising - self.mains * sd),
                (mains, rows[1][1], 0.0, rows[1][3], self.mains * sq),
                (rows[2][0], 0.0, rows[2][2], -slip, -self.mains * rd),
                (0.0, rows[3][1], slip, rows[3][3], self.mains * rq),
                (0.0, 0.0, 0.0, 0.0, settling),
            ),
        )

    def steady(self, omega: Any) -> tuple[Any, ...]:
        """The stationary fluxes at constant speeds, at the full frequency."""
        return *super().steady(omega), 1.0 + 0.0 * omega

    def standing(self, states: States, time: Any) -> tuple[Any, ...]:
        """The fluxes of a locked rotor on the ramp, followed in time."""
        from scipy.integrate import solve_ivp

        times = np.asarray(time, dtype=float)
        if not times.size or not times.max() > 0.0:
            return tuple(value + 0.0 * times for value in states)
        begin = [float(value) for value in states]
        run: Any = solve_ivp(
            lambda _t, y: self.rates(0.0, y), (0.0, float(times.max())), begin, "DOP853",
            dense_output=True, rtol=1e-12, atol=1e-13 * np.array(self.scales),
        )  # fmt: skip
        return tuple(np.asarray(row).reshape(times.shape) for row in run.sol(times.ravel()))

    def power(self, states: States) -> Any:
        """Power from the inverter 3/2 V i_q, W."""
        return super().power(states) * self.ramp.voltage(states[4])


def impedances_of(motor: Induction) -> Impedances:
    """The equivalent circuit of a name plate: it has the rated torque, the breakdown torque and the rated line current.

    The stator's resistance follows from its share of the rated losses, R = Q/(3 I²); leakage is divided evenly. The other
    three are solved for, from those of Kloss's formula on.

    Raises:
        SceneError: if the plate has no voltage, current and power factor (or efficiency), and where no circuit fits.

    Source: Fitzgerald et al., Electric Machinery, 6th ed., chapter 6 (circuit); IEC 60034-28 (its parts).

    >>> from flywheel.components.motors import Plate
    >>> plate = Plate(voltage=400.0, current=15.0, power_factor=0.83)
    >>> motor = Induction(power=7500.0, speed=1450 * math.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.5, plate=plate)
    >>> [round(value, 4) for value in impedances_of(motor)]
    [0.6422, 1.5713, 28.5043, 0.5593, 1.5713]

    """
    from scipy.optimize import root

    plate, current, heat = motor.plate, motor.rated_current, motor.rated_stator_heat
    if plate.voltage is None or current is None or heat is None:
        defect = "a name plate without voltage, current and power factor"
        expected = "all three (of the last two and efficiency any two), or the resistances and reactances of its circuit"
        raise SceneError([Fault("electrical", defect, expected)])
    phase, resistance = plate.voltage / math.sqrt(3.0), heat / (3.0 * current**2)
    leakage = 3.0 * phase**2 / (2.0 * motor.synchronous_speed * motor.breakdown_torque)
    slip, rated, greatest = motor.rated_slip, motor.rated.torque, motor.breakdown_torque

    def made(x: Any) -> Impedances:
        half, magnetizing, rotor = (leakage * math.exp(min(max(one, -20.0), 20.0)) for one in x)
        return Impedances(resistance, half, magnetizing, rotor, half)

    def lacking(x: Any) -> list[float]:
        circuit = equivalent_circuit(made(x), plate.voltage or 0.0, motor.synchronous_speed)
        pairs = (circuit.torque(slip), rated), (circuit.breakdown_torque, greatest), (abs(circuit.current(slip)), current)
        return [math.log(float(value) / target) for value, target in pairs]

    start = [math.log(0.5), math.log(phase / (0.5 * current * leakage)), math.log(motor.breakdown_slip)]
    solution: Any = root(lacking, start, method="hybr", options={"xtol": 1e-14})
    if not np.abs(solution.fun).max() <= 1e-9:
        defect = "a name plate that no equivalent circuit has"
        advice = "check current and power factor, or give the resistances and reactances"
        raise SceneError([Fault("electrical", defect, "torques and current that go together", advice)])
    return made(solution.x)
