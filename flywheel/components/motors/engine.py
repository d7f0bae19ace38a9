"""Engines under a governor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from flywheel.components.motors.curve import OMEGA, Curve
from flywheel.components.motors.motor import Motor, Point, Span, wrong_numbers
from flywheel.numerics.arguments import POSITIVE, number_faults, refuse
from flywheel.numerics.expressions import Expression, Node, expression_of, numeral, parse
from flywheel.numerics.faults import Fault


@dataclass(frozen=True, kw_only=True)
class Engine(Motor):
    """An engine under a governor: full load T_full(omega) up to rated speed, then a straight line down to no load.

    Above rated speed omega_n it is T = T_n (omega_0 - omega)/(omega_0 - omega_n), with the no-load speed
    omega_0 = omega_n (1 + droop). Beyond that the engine brakes: the line goes on down to -T_brake, and stays there.

    Args:
        speed: omega_n, rad/s, above 0.
        full_load: T_full, N m above 0: a number, or a `Curve` that reaches rated speed.
        droop: (omega_0 - omega_n)/omega_n, above 0; 3 to 10 % is usual, the isochronous governor with 0 is no law of speed.
        idle: lowest speed at which the engine runs by itself, rad/s, below rated. Below it the curve goes on, for a
            starter or a clutch, but is a guess.
        braking_torque: T_brake, N m, of the unfired engine.
        inertia: of crankshaft and flywheel, kg m².

    Raises:
        SceneError: for values out of range, and a full-load curve that does not reach rated speed.

    Valid for the torque averaged over a cycle of the engine, and for changes slower than governor and filling. Source: ISO
    8528-5 and ISO 3046-4 (speed droop, as a share of rated speed); Heywood, Internal Combustion Engine Fundamentals,
    chapters 13 (friction) and 15 (full-load curves).

    >>> motor = Engine(speed=150.0, full_load=200.0, droop=0.08, braking_torque=30.0)
    >>> round(motor.no_load_speed, 9), motor.torque([100.0, 156.0, 170.0]).round(9).tolist()
    (162.0, [200.0, 100.0, -30.0])

    """

    speed: float
    full_load: float | Curve
    droop: float
    idle: float = 0.0
    braking_torque: float = 0.0
    title: ClassVar[str] = "governed engine"

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        faults = wrong_numbers(self, ("speed", "droop"), ("idle", "braking_torque"))
        if not isinstance(self.full_load, Curve):
            faults += number_faults("torque", self.full_load, POSITIVE)
        refuse(faults)
        rated = f"the rated speed of {self.speed:.6g} rad/s"
        if not self.idle < self.speed:
            faults.append(Fault("idle", f"{self.idle:.6g} rad/s", f"a speed below {rated}"))
        if isinstance(self.full_load, Curve) and not self.full_load.covers[0] < self.speed <= self.full_load.covers[1]:
            first, last = self.full_load.covers
            faults.append(Fault("full_load", f"speeds from {first:.6g} to {last:.6g} rad/s", f"speeds that hold {rated}"))
        elif self._full(self.speed) <= 0:
            faults.append(Fault("full_load", f"{self._full(self.speed):.6g} N m", f"a torque above 0 at {rated}"))
        refuse(faults)

    def _full(self, omega: float) -> float:
        return float(self.full_load.torque(omega)) if isinstance(self.full_load, Curve) else self.full_load

    @property
    def rated(self) -> Point:
        """Full load at rated speed, where the governor sets in."""
        return Point(self.speed, self._full(self.speed))

    @property
    def no_load_speed(self) -> float:
        """Speed omega_n (1 + droop) at which the governor has taken all fuel away, rad/s."""
        return self.speed * (1 + self.droop)

    @property
    def covers(self) -> Span:
        """From idle speed, or the first row of the full-load curve, upwards, rad/s."""
        first = self.full_load.covers[0] if isinstance(self.full_load, Curve) else self.idle
        return max(self.idle, first), float("inf")

    @property
    def stable(self) -> Span:
        """From where full load begins to fall (rated speed, if it does not) to where the engine brakes in full, rad/s."""
        begin = self.full_load.fall_before(self.speed) if isinstance(self.full_load, Curve) else self.speed
        return begin, self.no_load_speed + self.braking_torque / self._steepness

    @property
    def _steepness(self) -> float:
        return self.rated.torque / (self.no_load_speed - self.speed)

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        line = f"{expression_of(self._steepness)}*({expression_of(self.no_load_speed)} - omega)"
        governed = parse(f"max({line}, {expression_of(-self.braking_torque)})")
        if not isinstance(self.full_load, Curve):
            return parse(f"{expression_of(self.full_load)} if omega <= {expression_of(self.speed)} else {governed.text}")
        below = Node("compare", (OMEGA, numeral(self.speed)), signs=("<=",))
        text = f"{self.full_load.law().text}, governed from {self.speed:.6g} rad/s"
        return Expression(text, Node("if", (below, self.full_load.tree(), governed.tree)))
