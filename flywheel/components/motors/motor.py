"""What every motor can be asked: its torque at a speed, the law that is compiled for the machine, the marks of its curve.

1. A motor is frozen data. Its torque acts on the shaft that it drives, positive in the shaft's rotation; `omega` is that
   shaft's speed (rad/s). Nothing but the speed decides the torque.
2. The torque is written once, as the expression of `omega` that `law` gives. `torque` and `slope_at` evaluate it.
3. The running branch is the range of speeds in which torque falls with speed (`stable`) and which holds the no-load speed.
   There a load that asks for more finds a slower motor that gives more; anywhere else it stalls it.
4. `covers` is the range of speeds that the motor's data speak of. Outside it the law goes on, as each kind says, but it is
   a guess.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.records import NamedTuple
from flywheel.components.motors.circuit import Circuit
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.numerics.expressions import Expression, expression_of, parse
from flywheel.numerics.faults import Fault, SceneError

if TYPE_CHECKING:
    from flywheel.components.motors.starting import Start

Array = NDArray[np.float64]
Span = tuple[float, float]

EVERYWHERE: Span = (-math.inf, math.inf)
_DOUBLINGS = 200  # of a step away from the known end of a branch, until a torque is enclosed


class Point(NamedTuple):
    """A point of a torque-speed curve: speed (rad/s) and torque (N m)."""

    speed: float
    torque: float

    @property
    def power(self) -> float:
        """Mechanical power, torque times speed, W.

        >>> Point(100.0, 20.0).power
        2000.0
        """
        return self.speed * self.torque


@dataclass(frozen=True, kw_only=True)
class Motor(ABC):
    """A motor. `inertia` is that of its rotor (kg m²), which counts as an inertia on the shaft that it drives.

    `start` is how it is started; all else speaks of it as it runs, in its last connection.
    """

    inertia: float = 0.0
    start: Start | None = None
    title: ClassVar[str]
    tells_heat: ClassVar[bool] = False
    """Whether the kind tells what heats it."""

    @abstractmethod
    def law(self) -> Expression:
        """The torque on the shaft (N m) as an expression of its speed `omega` (rad/s)."""

    @property
    @abstractmethod
    def no_load_speed(self) -> float | None:
        """Speed (rad/s) at which the torque has fallen to zero; None where it never does."""

    @property
    @abstractmethod
    def stable(self) -> Span | None:
        """Ends (rad/s) of the running branch, in which dT/domega < 0; None where there is none."""

    @property
    def rated(self) -> Point | None:
        """The point of the name plate, where there is one."""
        return None

    @cached_property
    def circuit(self) -> Circuit | None:
        """States of its own, beside its shaft's; None where torque follows the speed at once."""
        return None

    @property
    def doubts(self) -> tuple[str, ...]:
        """What seems odd about its data, one sentence each."""
        return ()

    @property
    def covers(self) -> Span:
        """Lowest and highest speed (rad/s) that the motor's data speak of."""
        return EVERYWHERE

    @property
    def rated_current(self) -> float | None:
        """Current at the rated point, A, of a stator's line or an armature; None where the data do not tell."""
        return None

    def current_share(self, omega: ArrayLike) -> Array | None:
        """Current over the rated one at steady speeds omega (rad/s), of their shape; None where the kind does not tell."""
        return None

    @property
    def starting_torque(self) -> float:
        """Torque (N m) at rest."""
        return float(self.torque(0.0))

    @property
    def breakdown(self) -> Point | None:
        """The lower end of the running branch, where torque is greatest; None where the branch goes on through rest."""
        start = -math.inf if self.stable is None else self.stable[0]
        return Point(start, float(self.torque(start))) if math.isfinite(start) else None

    def torque(self, omega: ArrayLike) -> Array:
        """Torque on the shaft (N m) at speeds omega (rad/s), of their shape."""
        speeds = np.asarray(omega, dtype=float)
        found: Array = np.zeros_like(speeds) + self._law.evaluate({"omega": speeds}, np)
        return found

    def slope_at(self, omega: ArrayLike) -> Array:
        """Slope dT/domega (N m s/rad) at speeds omega (rad/s), of their shape; at a kink, that of the side that is used."""
        from flywheel.numerics.jets import Jet, jet_namespace

        speeds = np.asarray(omega, dtype=float)
        found = self._law.evaluate({"omega": Jet(speeds, np.ones_like(speeds))}, jet_namespace(np))
        return np.zeros_like(speeds) + (found.first if isinstance(found, Jet) else 0.0)

    def speed_at(self, torque: float) -> float | None:
        """Speed (rad/s) on the running branch at which the motor gives a torque (N m).

        None where the branch does not reach it: above the breakdown torque, the motor stalls.
        """
        if self.stable is None:
            return None
        low, high = (self._within(end, torque, side) for end, side in zip(self.stable, (-1.0, 1.0), strict=True))
        if not self.torque(low) >= torque >= self.torque(high):
            return None
        from scipy.optimize import brentq

        return float(
            brentq(lambda omega: float(self.torque(omega)) - torque, low, high, xtol=1e-15 * (high - low), rtol=1e-15)
        )

    def _within(self, end: float, torque: float, side: float) -> float:
        """A finite end of the running branch, beyond the place where it reaches a torque."""
        if math.isfinite(end):
            return end
        known = (*(self.stable or ()), self.no_load_speed)
        middle = next((speed for speed in known if speed is not None and math.isfinite(speed)), 0.0)
        steps = (middle + side * max(1.0, abs(middle)) * 2.0**k for k in range(_DOUBLINGS))
        return next((speed for speed in steps if side * (float(self.torque(speed)) - torque) <= 0), middle)

    @cached_property
    def _law(self) -> Expression:
        return self.law()


def wrong_numbers(motor: Motor, positive: tuple[str, ...] = (), not_negative: tuple[str, ...] = ()) -> list[Fault]:
    """The faults of a motor's own numbers, by their names."""
    asked = [(name, POSITIVE) for name in positive] + [(name, NOT_NEGATIVE) for name in (*not_negative, "inertia")]
    return [fault for name, expected in asked for fault in number_faults(name, getattr(motor, name), expected)]


def wrong_point(point: Any, speed: str = "speed", torque: str = "torque") -> list[Fault]:
    """The faults of a rated point, which must drive."""
    return number_faults(speed, point.speed, POSITIVE) + number_faults(torque, point.torque, POSITIVE)


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
        return parse(expression_of(self.value))

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
        return parse(f"{expression_of(self.at_rest)} - {expression_of(self.fall)}*omega")

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
