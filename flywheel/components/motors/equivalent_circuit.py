"""The equivalent circuit of an induction motor for one phase: torque, current, breakdown by resistances and reactances.

It is what textbooks solve, and what Kloss's formula simplifies: with the stator's resistance left out, the circuit's torque
is that formula. Its breakdown torque over rated torque, and its rated slip, are what a motor of a scene asks for.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.components.motors.motor import Array
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse


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
    Valid for a balanced supply and constant parameters; iron and friction losses are outside it. Source: Chapman, Electric
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
        """Refuse values out of range."""
        may_be_none = ("stator_resistance", "stator_reactance")
        pairs = [(one.name, NOT_NEGATIVE if one.name in may_be_none else POSITIVE) for one in fields(self)]
        refuse([fault for name, expected in pairs for fault in number_faults(name, getattr(self, name), expected)])

    @property
    def _thevenin(self) -> tuple[complex, complex]:
        """Voltage (V) and impedance (ohm) that the rotor sees."""
        stator, field = complex(self.stator_resistance, self.stator_reactance), 1j * self.magnetizing_reactance
        share = field / (stator + field)
        return self.voltage / math.sqrt(3.0) * share, stator * share

    def current(self, slip: ArrayLike) -> NDArray[np.complex128]:
        """Line current (A, its root mean square, as a phasor on the voltage's) at slips, of their shape."""
        slips = np.asarray(slip, dtype=float)
        field, stator = 1j * self.magnetizing_reactance, complex(self.stator_resistance, self.stator_reactance)
        admittance = 1.0 / field + slips / (self.rotor_resistance + 1j * self.rotor_reactance * slips)
        return np.asarray(self.voltage / math.sqrt(3.0) / (stator + 1.0 / admittance))

    def torque(self, slip: ArrayLike) -> Array:
        """Torque of the air gap, N m, at slips, of their shape; what friction takes is not taken off."""
        slips, (source, inner) = np.asarray(slip, dtype=float), self._thevenin
        resistance, reactance = inner.real * slips + self.rotor_resistance, (inner.imag + self.rotor_reactance) * slips
        power = 3.0 * abs(source) ** 2 * self.rotor_resistance * slips / (resistance**2 + reactance**2)
        return np.asarray(power / self.synchronous_speed)

    @property
    def breakdown_slip(self) -> float:
        """Slip at which torque is greatest."""
        inner = self._thevenin[1]
        return self.rotor_resistance / math.hypot(inner.real, inner.imag + self.rotor_reactance)

    @property
    def breakdown_torque(self) -> float:
        """The greatest torque as a motor, N m: 3 |U_th|²/(2 omega_s (R_th + sqrt(R_th² + (X_th + X_2)²)))."""
        source, inner = self._thevenin
        most = inner.real + math.hypot(inner.real, inner.imag + self.rotor_reactance)
        return 3.0 * abs(source) ** 2 / (2.0 * self.synchronous_speed * most)

    def power_factor(self, slip: float) -> float:
        """Cosine of the angle by which the current lags, at a slip."""
        return math.cos(cmath.phase(complex(self.current(slip))))
