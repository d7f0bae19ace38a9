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
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.records import NamedTuple
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.numerics.expressions import Expression, Node, between, expression_of, numeral, parse, variable
from flywheel.numerics.faults import Fault, SceneError, suggestion

__all__ = [
    "DC",
    "Constant",
    "Curve",
    "Engine",
    "Induction",
    "Line",
    "Motor",
    "Point",
    "dc_from_plate",
    "line_from_no_load",
    "line_through",
]

if TYPE_CHECKING:
    from bondgraph import Part


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
    """A motor. `inertia` is that of its rotor (kg m²), which counts as an inertia on the shaft that it drives."""

    inertia: float = 0.0
    title: ClassVar[str]

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

    @property
    def doubts(self) -> tuple[str, ...]:
        """What seems odd about its data, one sentence each."""
        return ()

    @property
    def covers(self) -> Span:
        """Lowest and highest speed (rad/s) that the motor's data speak of."""
        return EVERYWHERE

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


MOST_ROWS = 200
"""How many rows a curve may have: each evaluation goes through all of them."""
INTERPOLATIONS = ("linear", "pchip")
OMEGA = variable("omega")


@dataclass(frozen=True, kw_only=True)
class Curve(Motor):
    """Torque between rows of speed and torque: straight lines, or monotone cubics (pchip) that overshoot nowhere.

    Beyond its first and its last row the curve goes on straight, with the slope it has there.

    Args:
        speeds: rad/s, ascending, 2 to 200 of them.
        torques: N m, one per speed; one at least above 0.
        interpolation: `linear` or `pchip`.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for rows out of order or number; the faults' paths are the scene's keys, `speed` and `torque`.

    Valid between its rows (`covers`): a run-up needs a row at rest, or the straight continuation stands for what was not
    measured. Pieces meet with a kink (linear) or a jump in curvature (pchip); each row is a breakpoint. Source: Fritsch and
    Carlson, Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (1980), for pchip.

    >>> motor = Curve(speeds=(0.0, 100.0, 150.0), torques=(20.0, 30.0, 5.0))
    >>> motor.torque([50.0, 125.0, 155.0]).tolist()
    [25.0, 17.5, 2.5]
    >>> motor.no_load_speed, motor.stable, motor.breakdown
    (160.0, (100.0, inf), Point(speed=100.0, torque=30.0))

    """

    speeds: tuple[float, ...]
    torques: tuple[float, ...]
    interpolation: str = "linear"
    title: ClassVar[str] = "motor by a table"

    def __post_init__(self) -> None:
        """Refuse rows that make no curve."""
        faults = wrong_numbers(self)
        for name, column in (("speed", self.speeds), ("torque", self.torques)):
            faults += [fault for i, number in enumerate(column) for fault in number_faults(f"{name}[{i}]", number)]
        if len(self.speeds) != len(self.torques):
            found = f"{len(self.speeds)} speeds and {len(self.torques)} torques"
            faults.append(Fault("torque", found, "as many of the one as of the other"))
        if not 2 <= len(self.speeds) <= MOST_ROWS:
            faults.append(Fault("speed", f"{len(self.speeds)} rows", f"2 to {MOST_ROWS}"))
        if self.interpolation not in INTERPOLATIONS:
            advice = suggestion(str(self.interpolation), INTERPOLATIONS)
            faults.append(Fault("interpolation", f'"{self.interpolation}"', '"linear" or "pchip"', advice))
        refuse(faults)
        for i, (left, right) in enumerate(pairwise(self.speeds), 1):
            if not left < right:
                found = f"{right:.6g} rad/s after {left:.6g} rad/s"
                faults.append(Fault(f"speed[{i}]", found, "speeds that ascend", "at one speed a motor has one torque"))
        if max(self.torques) <= 0:
            faults.append(Fault("torque", f"{max(self.torques):.6g} N m at most", "a torque above 0 somewhere"))
        refuse(faults[:5])

    @property
    def covers(self) -> Span:
        """Speeds (rad/s) of the first and last row."""
        return self.speeds[0], self.speeds[-1]

    @property
    def no_load_speed(self) -> float | None:
        """Speed (rad/s) at which the torque has fallen to zero for good, between rows or beyond the last one."""
        last = max(i for i, torque in enumerate(self.torques) if torque > 0)
        if last + 1 < len(self.speeds) and self.torques[last + 1] == 0:
            return self.speeds[last + 1]
        start, *series = self._pieces[min(last + self._padded, len(self._pieces) - 1)]
        ends = (self.speeds[last], self.speeds[last + 1] if last + 1 < len(self.speeds) else math.inf)
        roots = (start + root.real for root in np.roots(series) if abs(root.imag) <= 1e-9 * abs(root))
        return next((float(root) for root in sorted(roots) if ends[0] < root < ends[1]), None)

    @property
    def stable(self) -> Span | None:
        """The stretch of falling torque that reaches no-load speed, or the last one; None where torque falls nowhere."""
        falling = [bool(right < left) for left, right in pairwise(self.torques)]
        if not any(falling):
            return None
        highest = max(i for i, torque in enumerate(self.torques) if torque > 0)
        chosen = min(highest, len(falling) - 1)
        if not falling[chosen]:
            chosen = max(i for i, falls in enumerate(falling) if falls)
        return self._start_of_fall(chosen), self._end_of_fall(chosen)

    def fall_before(self, speed: float) -> float:
        """Where the torque begins to fall, coming from below to a speed (rad/s); that speed where it does not fall there."""
        piece = max(i for i, start in enumerate((-math.inf, *self.speeds[1:-1])) if start < speed)
        return self._start_of_fall(piece) if self.torques[piece + 1] < self.torques[piece] else speed

    def _start_of_fall(self, piece: int) -> float:
        while piece and self.torques[piece] < self.torques[piece - 1]:
            piece -= 1
        return self.speeds[piece] if piece or not self._end_slopes[0] < 0 else -math.inf

    def _end_of_fall(self, piece: int) -> float:
        last = len(self.speeds) - 2
        while piece < last and self.torques[piece + 2] < self.torques[piece + 1]:
            piece += 1
        return self.speeds[piece + 1] if piece < last or not self._end_slopes[1] < 0 else math.inf

    @cached_property
    def _pieces(self) -> tuple[tuple[float, ...], ...]:
        """Start and polynomial (highest power first) of every piece, those beyond a pchip's ends included."""
        speeds, torques = np.array(self.speeds), np.array(self.torques)
        if self.interpolation == "linear" or len(speeds) == 2:
            series = np.stack((np.diff(torques) / np.diff(speeds), torques[:-1]))
            return tuple(zip(speeds[:-1].tolist(), *series.tolist(), strict=True))
        from scipy.interpolate import PchipInterpolator  # only such curves pay for it

        curve = PchipInterpolator(speeds, torques)
        slopes = curve(speeds[[0, -1]], 1)
        inner = tuple(zip(speeds[:-1].tolist(), *np.asarray(curve.c).tolist(), strict=True))
        before, after = ((self.speeds[i], float(slopes[i]), self.torques[i]) for i in (0, -1))
        return before, *inner, after

    @property
    def _padded(self) -> bool:
        """Whether the straight lines beyond the ends are pieces of their own."""
        return len(self._pieces) > len(self.speeds)

    @property
    def _end_slopes(self) -> tuple[float, float]:
        """Slopes (N m s/rad) of the straight lines before the first and after the last row."""
        return self._pieces[0][1], self._pieces[-1][1]

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        first, last = self.covers
        text = f"torque of {len(self.speeds)} rows from {first:.6g} to {last:.6g} rad/s"
        return Expression(text, self.tree())

    def tree(self) -> Node:
        """The law as a tree: its pieces at the leaves of a balanced tree of comparisons of omega."""
        knots = self.speeds if self._padded else self.speeds[1:-1]
        return between(OMEGA, knots, [_polynomial(start, series) for start, *series in self._pieces])


def _polynomial(start: float, series: list[float]) -> Node:
    """A polynomial of omega - start, highest power first, by Horner's rule."""
    step = Node("sum", (OMEGA, numeral(start)), signs=("+", "-"))
    total = numeral(series[0])
    for coefficient in series[1:]:
        total = Node("sum", (Node("product", (total, step), signs=("*", "*")), numeral(coefficient)), signs=("+", "+"))
    return total


@dataclass(frozen=True, kw_only=True)
class DC(Motor):
    """A DC motor with constant field: L di/dt = U - R i - k omega, shaft torque T = k i - b omega.

    Without inductance, or where speed changes slowly against the time constant L/R, the current follows the speed,
    i = (U - k omega)/R, and torque is the straight line T = k U/R - (k²/R + b) omega; that is what `law` gives. With
    inductance the current is a state of its own: `current_rate`, `torque_of_current` and `graph` have it.

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

    def __post_init__(self) -> None:
        """Refuse values out of range."""
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
        """Speed k U/(k² + b R), rad/s, at which the shaft gives nothing away."""
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

    @property
    def rated_current(self) -> float | None:
        """Current at the rated point, A; None where the constants were not derived from one."""
        return None if self.nameplate is None else float(self.current(self.nameplate.speed))

    def current_rate(self, omega: Any, current: Any) -> Any:
        """Rate of change of the current di/dt = (U - R i - k omega)/L, A/s, at speeds (rad/s) and currents (A).

        Raises SceneError for a motor without inductance, whose current is no state.

        >>> DC(voltage=48.0, resistance=0.4, constant=0.25, inductance=0.002).current_rate(96.0, 50.0)
        2000.0
        """
        if self.inductance == 0:
            raise SceneError([Fault("inductance", "0 H", "a value above 0", "without it the current follows the speed")])
        return (self.voltage - self.resistance * current - self.constant * omega) / self.inductance

    def torque_of_current(self, omega: Any, current: Any) -> Any:
        """Torque on the shaft k i - b omega, N m, at speeds (rad/s) and currents (A)."""
        return self.constant * current - self.friction * omega

    def graph(self) -> Part:
        """The motor as a part of a bond graph, open at the 1-junction `rotor` of its shaft.

        Voltage Se, armature R, and I where there is inductance; gyrator GY; rotor I and friction R where there are any.

        >>> print(*DC(voltage=48.0, resistance=0.4, constant=0.25, inertia=0.004).graph().elements)
        armature rotor voltage resistance constant inertia
        """
        from bondgraph import GY, Builder, I, R, Se

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
    taken for friction proportional to speed, b = (1 - a)(U I - P)/omega². Then k = (U - R I)/omega. At the load where
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

    Valid where excitation takes nothing of the current (permanent magnets, or field current left out). R of a real armature
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
        found = f"{rated.power:.6g} W at the shaft of {voltage * current:.6g} W at the terminals"
        raise SceneError([Fault("power", found, "less than voltage times current", "efficiency is below 1")])
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
