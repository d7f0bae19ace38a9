"""Motors whose torque is a constant, or a straight line over speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from flywheel.arguments import refuse
from flywheel.faults import Fault, SceneError
from flywheel.formulas.building import written
from flywheel.formulas.expressions import Expression, parse
from flywheel.motors.base import EVERYWHERE, Motor, Point, Span, wrong_numbers, wrong_point


@dataclass(frozen=True, kw_only=True)
class Constant(Motor):
    """A torque that no speed changes: T = T0.

    Args:
        value: T0, N m, above 0.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range.

    Valid where something else limits the speed: it has no no-load speed and no running branch. By definition.

    >>> Constant(value=40.0).torque([0.0, 100.0]).tolist()
    [40.0, 40.0]

    """

    value: float
    title: ClassVar[str] = "constant torque"

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        refuse(wrong_numbers(self, ("value",)))

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        return parse(written(self.value))

    @property
    def no_load_speed(self) -> float | None:
        """None: the torque never falls to zero."""
        return None

    @property
    def stable(self) -> Span | None:
        """None: the torque never falls."""
        return None


@dataclass(frozen=True, kw_only=True)
class Line(Motor):
    """A torque that falls in a straight line: T = T0 - c omega.

    Args:
        at_rest: T0, N m, above 0.
        fall: c, N m s/rad, above 0.
        nameplate: the rated point, where the line was drawn through one.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range.

    Valid between rest and no-load speed for a shunt or permanent-magnet DC motor, and near the no-load speed for any motor
    whose torque falls to zero there. The line goes on beyond both, where the motor brakes. Source: Norton, Design of
    Machinery, chapter 2 (motors and drivers); the course's machine has T = 10 - 2.387 omega.

    >>> motor = Line(at_rest=10.0, fall=2.387)
    >>> motor.law().text, round(motor.no_load_speed, 4), motor.speed_at(5.226)
    ('10.0 - 2.387*omega', 4.1894, 2.0)

    """

    at_rest: float
    fall: float
    nameplate: Point | None = None
    title: ClassVar[str] = "motor with a straight line"

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        refuse(wrong_numbers(self, ("at_rest", "fall")))

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        return parse(f"{written(self.at_rest)} - {written(self.fall)}*omega")

    @property
    def no_load_speed(self) -> float:
        """Speed T0/c at which the torque has fallen to zero, rad/s."""
        return self.at_rest / self.fall

    @property
    def stable(self) -> Span:
        """Every speed."""
        return EVERYWHERE

    @property
    def rated(self) -> Point | None:
        """The point of the name plate, where the line was drawn through one."""
        return self.nameplate

    def speed_at(self, torque: float) -> float:
        """Speed (T0 - T)/c at which the motor gives a torque, rad/s."""
        return (self.at_rest - torque) / self.fall


def line_from_no_load(no_load_speed: float, starting_torque: float, inertia: float = 0.0) -> Line:
    """The line through rest and no-load speed: c = T0/omega_0.

    Args:
        no_load_speed: omega_0, rad/s, above 0.
        starting_torque: T0, N m, above 0.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range.

    >>> line_from_no_load(150.0, 30.0).fall
    0.2

    """
    refuse(wrong_point(Point(no_load_speed, starting_torque), "no_load_speed", "starting_torque"))
    return Line(at_rest=starting_torque, fall=starting_torque / no_load_speed, inertia=inertia)


def line_through(no_load_speed: float, rated: Point, inertia: float = 0.0) -> Line:
    """The line through a rated point and no-load speed: c = T_n/(omega_0 - omega_n), T0 = c omega_0.

    Args:
        no_load_speed: omega_0, rad/s, above the rated speed.
        rated: omega_n (rad/s) and T_n (N m), above 0.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range, or a rated speed that is not below the no-load speed.

    Valid near the rated point; for an induction motor not below its breakdown speed, where a line promises far too much.

    >>> motor = line_through(157.0, Point(150.0, 35.0))
    >>> motor.fall, motor.at_rest
    (5.0, 785.0)

    """
    refuse(wrong_point(rated) + wrong_point(Point(no_load_speed, rated.torque), "no_load_speed"))
    if not rated.speed < no_load_speed:
        found, expected = f"{rated.speed:.6g} rad/s", f"a rated speed below the no-load speed of {no_load_speed:.6g} rad/s"
        raise SceneError([Fault("speed", found, expected)])
    fall = rated.torque / (no_load_speed - rated.speed)
    return Line(at_rest=fall * no_load_speed, fall=fall, nameplate=rated, inertia=inertia)
