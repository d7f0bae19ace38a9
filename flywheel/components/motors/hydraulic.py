"""Hydraulic motors: a pump of constant flow, a relief valve, and what leaks past the motor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from flywheel.components.motors.motor import Motor, Point, Span, wrong_numbers
from flywheel.numerics.arguments import number_faults, refuse
from flywheel.numerics.expressions import Expression, expression_of, parse
from flywheel.numerics.faults import Fault


@dataclass(frozen=True, kw_only=True)
class Hydraulic(Motor):
    """A hydraulic motor behind a pump of constant flow Q and a relief valve that opens at a pressure p_r.

    With D = V/(2 pi) the flow balance Q = D omega + G p below p_r gives p = (Q - D omega)/G; leakage is laminar,
    G = (1 - eta_v) Q/p_r by the volumetric efficiency at that pressure. Slower than omega_r = eta_v Q/D the valve opens, and
    its pressure rises by a share o (override) when all of the flow goes through it:

        p = p_r (1 + o (1 - omega/omega_0))/(1 + o (1 - eta_v)),  omega_0 = Q/D.

    Torque is T = eta_hm D p; where it brakes, faster than omega_0, T = D p/eta_hm, down to -p_r, at which the valve of the
    other side opens.

    Args:
        displacement: V of a turn, m³, above 0.
        flow: Q of the pump, m³/s, above 0.
        pressure: p_r, difference over the motor at which the relief valve opens, Pa, above 0.
        volumetric_efficiency: eta_v of the motor at that pressure, below 1.
        mechanical_efficiency: eta_hm of the motor, hydraulic and mechanical, at most 1.
        override: o, rise of the valve's pressure at full flow, over p_r.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range.

    Valid for changes that are slow beside the filling of the lines (oil's compressibility left out), a closed circuit with
    valves on either side, and efficiencies that do not change with speed: at rest real motors give less. Source: Merritt,
    Hydraulic Control Systems, chapter 4 (ideal flow, laminar leakage); Esposito, Fluid Power with Applications, 7th ed.,
    chapter 7 (efficiencies), and chapter 8 (relief valves); ISO 4391.

    >>> motor = Hydraulic(displacement=164e-6, flow=0.006, pressure=70e5, volumetric_efficiency=0.911,
    ...                   mechanical_efficiency=0.9305)
    >>> round(motor.rated.torque, 1), round(motor.rated.speed * 30 / math.pi, 1), round(motor.rated.power / 1e3, 2)
    (170.0, 1999.8, 35.6)
    >>> motor.torque([0.0, motor.no_load_speed]).round(1).tolist()
    [170.0, 0.0]

    """

    displacement: float
    flow: float
    pressure: float
    volumetric_efficiency: float
    mechanical_efficiency: float
    override: float = 0.0
    title: ClassVar[str] = "hydraulic motor"

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        shares = ("volumetric_efficiency", "mechanical_efficiency")
        faults = wrong_numbers(self, ("displacement", "flow", "pressure", *shares), ("override",))
        refuse(faults)
        if not self.volumetric_efficiency < 1:
            found = f"{self.volumetric_efficiency:g}"
            faults.append(
                Fault("volumetric_efficiency", found, "a share below 1", "without leakage torque is no law of speed")
            )
        if not self.mechanical_efficiency <= 1:
            faults.append(Fault("mechanical_efficiency", f"{self.mechanical_efficiency:g}", "a share of 1 at most"))
        refuse(faults + number_faults("flow", self.flow / self.displacement, "a finite number above 0"))

    @property
    def no_load_speed(self) -> float:
        """Speed Q/D at which nothing is left to leak, rad/s."""
        return 2 * math.pi * self.flow / self.displacement

    @property
    def rated(self) -> Point:
        """Where the relief valve begins to open: the greatest power."""
        torque = self.mechanical_efficiency * self.pressure * self.displacement / (2 * math.pi)
        return Point(self.volumetric_efficiency * self.no_load_speed, torque)

    @property
    def stable(self) -> Span:
        """From where the relief valve opens (any speed, where its pressure rises) to where that of the other side does."""
        reach = (1.0 - self.volumetric_efficiency) * self.no_load_speed
        return -math.inf if self.override else self.rated.speed, self.no_load_speed + reach

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        leak, idle = 1.0 - self.volumetric_efficiency, expression_of(self.no_load_speed)
        steepness = expression_of(self.rated.torque / (leak * self.no_load_speed))
        relief = expression_of(self.rated.torque / (1.0 + self.override * leak))
        if self.override:
            relief = f"{relief}*(1 + {expression_of(self.override)}*(1 - omega/{idle}))"
        most, ratio = expression_of(-self.rated.torque / self.mechanical_efficiency**2), self.mechanical_efficiency**2
        braking = f"max({steepness}*({idle} - omega)/{expression_of(ratio)}, {most})"
        return parse(f"min({relief}, {steepness}*({idle} - omega)) if omega <= {idle} else {braking}")
