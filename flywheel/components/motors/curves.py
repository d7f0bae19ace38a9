"""Motors whose torque depends on the instantaneous speed: constant, linear, by a table, engines, hydraulic motors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from flywheel.components.energy import Energy
from flywheel.components.motors.motor import EVERYWHERE, OMEGA, Fact, Motor, Point, Span, wrong_numbers, wrong_point
from flywheel.language import text as _
from flywheel.numerics.cells import monotone_slopes, table_pieces
from flywheel.numerics.expressions import Expression, Node, between, compiled, numeral
from flywheel.numerics.faults import POSITIVE, Fault, SceneError, number_faults, refuse, suggestion

MOST_ROWS = 200
"""Greatest number of rows of a curve: each evaluation goes through all of them."""
INTERPOLATIONS = ("linear", "pchip")


@dataclass(frozen=True, kw_only=True)
class Constant(Motor):
    """A torque independent of speed: T = T0.

    Args:
        value: T0, N m, above 0.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for values out of range.

    Valid if another torque limits the speed: it has no no-load speed and no running branch. By definition.

    >>> Constant(value=40.0).torque([0.0, 100.0]).tolist()
    [40.0, 40.0]

    """

    value: float
    title: ClassVar[str] = "constant torque"

    def __post_init__(self) -> None:
        """Refuses values out of range."""
        refuse(wrong_numbers(self, ("value",)))

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        return compiled("{value}", value=self.value)

    def facts(self) -> Iterator[Fact]:
        """Fact that its torque is constant."""
        yield Fact(_("Its torque is the same at every speed."))

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
    whose torque falls to zero there. The line continues beyond both, where the motor brakes. Source: Norton, Design of
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
        """Refuses values out of range."""
        refuse(wrong_numbers(self, ("at_rest", "fall")))

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        return compiled("{at_rest} - {fall}*omega", at_rest=self.at_rest, fall=self.fall)

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

    def facts(self) -> Iterator[Fact]:
        """The line."""
        yield from super().facts()
        line, formula = _("Its torque falls linearly with its speed"), "T(omega) = T_0 - c*omega"
        yield Fact(_("torque at rest"), "T_0", self.at_rest, "N m", formula, table=line)
        yield Fact(_("fall of the torque with speed"), "c", self.fall, "N m s", table=line)

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

    Valid near the rated point; for an induction motor not below its breakdown speed, where a line gives far too much torque.

    >>> motor = line_through(157.0, Point(150.0, 35.0))
    >>> motor.fall, motor.at_rest
    (5.0, 785.0)

    """
    refuse(wrong_point(rated) + wrong_point(Point(no_load_speed, rated.torque), "no_load_speed"))
    if not rated.speed < no_load_speed:
        defect, expected = f"{rated.speed:.6g} rad/s", f"a rated speed below the no-load speed of {no_load_speed:.6g} rad/s"
        raise SceneError([Fault("speed", defect, expected)])
    fall = rated.torque / (no_load_speed - rated.speed)
    return Line(at_rest=fall * no_load_speed, fall=fall, nameplate=rated, inertia=inertia)


@dataclass(frozen=True, kw_only=True)
class Curve(Motor):
    """Torque between rows of speed and torque: straight lines, or monotone cubics (pchip) that overshoot nowhere.

    Beyond its first and its last row the curve continues as a straight line with the slope at its end.

    Args:
        speeds: rad/s, ascending, 2 to 200 of them.
        torques: N m, one per speed; one at least above 0.
        interpolation: `linear` or `pchip`.
        written: both columns as a scene has them, with their units.
        inertia: of the rotor, kg m².

    Raises:
        SceneError: for rows out of order or number; the faults' paths are the scene's keys, `speed` and `torque`.

    Valid between its rows (`covers`): a run-up needs a row at rest, or the straight continuation replaces missing data.
    Pieces meet with a kink (linear) or a jump in curvature (pchip); each row is a breakpoint. Source: Fritsch and Carlson,
    Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (1980), for pchip.

    >>> motor = Curve(speeds=(0.0, 100.0, 150.0), torques=(20.0, 30.0, 5.0))
    >>> motor.torque([50.0, 125.0, 155.0]).tolist()
    [25.0, 17.5, 2.5]
    >>> motor.no_load_speed, motor.stable, motor.breakdown
    (160.0, (100.0, inf), Point(speed=100.0, torque=30.0))

    """

    speeds: tuple[float, ...]
    torques: tuple[float, ...]
    interpolation: str = "linear"
    written: tuple[tuple[str, ...], ...] = field(default=(), repr=False, compare=False)
    title: ClassVar[str] = "motor by a table"
    starts: ClassVar[tuple[str, ...]] = ("star-delta", "transformer", "soft")

    @property
    def curve(self) -> Curve:
        """Itself."""
        return self

    @property
    def points(self) -> tuple[Point, ...]:
        """The rows of the table."""
        return tuple(map(Point, self.speeds, self.torques))

    def __post_init__(self) -> None:
        """Refuses rows that form no curve."""
        faults = wrong_numbers(self)
        for name, column in (("speed", self.speeds), ("torque", self.torques)):
            faults += [fault for i, number in enumerate(column) for fault in number_faults(f"{name}[{i}]", number)]
        if len(self.speeds) != len(self.torques):
            defect = f"{len(self.speeds)} speeds and {len(self.torques)} torques"
            faults.append(Fault("torque", defect, "the same number of both"))
        if not 2 <= len(self.speeds) <= MOST_ROWS:
            faults.append(Fault("speed", f"{len(self.speeds)} rows", f"2 to {MOST_ROWS}"))
        if self.interpolation not in INTERPOLATIONS:
            advice = suggestion(str(self.interpolation), INTERPOLATIONS)
            faults.append(Fault("interpolation", f'"{self.interpolation}"', '"linear" or "pchip"', advice))
        refuse(faults)
        for i, (left, right) in enumerate(pairwise(self.speeds), 1):
            if not left < right:
                defect = f"{right:.6g} rad/s after {left:.6g} rad/s"
                faults.append(Fault(f"speed[{i}]", defect, "speeds that ascend", "at one speed a motor has one torque"))
        if max(self.torques) <= 0:
            faults.append(Fault("torque", f"{max(self.torques):.6g} N m at most", "a torque above 0 somewhere"))
        refuse(faults[:5])

    @property
    def covers(self) -> Span:
        """Speeds (rad/s) of the first and last row."""
        return self.speeds[0], self.speeds[-1]

    @property
    def no_load_speed(self) -> float | None:
        """Speed (rad/s) at which the torque has fallen to zero and remains there, between rows or beyond the last one."""
        last = max(i for i, torque in enumerate(self.torques) if torque > 0)
        if last + 1 < len(self.speeds) and self.torques[last + 1] == 0:
            return self.speeds[last + 1]
        start, *series = self._pieces[min(last + self._padded, len(self._pieces) - 1)]
        ends = (self.speeds[last], self.speeds[last + 1] if last + 1 < len(self.speeds) else math.inf)
        roots = (start + root.real for root in np.roots(series) if abs(root.imag) <= 1e-9 * abs(root))
        return next((float(root) for root in sorted(roots) if ends[0] < root < ends[1]), None)

    @property
    def stable(self) -> Span | None:
        """The stretch of falling torque that reaches no-load speed, or the last one; None if torque falls nowhere."""
        falling = [bool(right < left) for left, right in pairwise(self.torques)]
        if not any(falling):
            return None
        highest = max(i for i, torque in enumerate(self.torques) if torque > 0)
        chosen = min(highest, len(falling) - 1)
        if not falling[chosen]:
            chosen = max(i for i, falls in enumerate(falling) if falls)
        return self._start_of_fall(chosen), self._end_of_fall(chosen)

    def fall_before(self, speed: float) -> float:
        """The speed (rad/s) below a given one at which the torque begins to fall; the given one if it does not."""
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
        return curve_pieces(np.array(self.speeds), np.array(self.torques), self.interpolation)

    @property
    def _padded(self) -> bool:
        """Tests whether the straight lines beyond the ends are separate pieces."""
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


def curve_pieces(speeds: NDArray[Any], torques: NDArray[Any], interpolation: str) -> tuple[tuple[Any, ...], ...]:
    """Start and polynomial (highest power first) of every piece of a curve, those beyond a pchip's ends included."""
    starts, series = table_pieces(speeds, torques, interpolation)
    inner = tuple(zip(starts.tolist(), *series.tolist(), strict=True))
    if len(series) == 2:
        return inner
    ends = monotone_slopes(np.diff(speeds), np.diff(torques) / np.diff(speeds))
    before, after = ((speeds[i], ends[i], torques[i]) for i in (0, -1))
    return before, *inner, after


def _polynomial(start: float, series: list[float]) -> Node:
    """A polynomial of omega - start, highest power first, by Horner's rule."""
    step = Node("sum", (OMEGA, numeral(start)), signs=("+", "-"))
    total = numeral(series[0])
    for coefficient in series[1:]:
        total = Node("sum", (Node("product", (total, step), signs=("*", "*")), numeral(coefficient)), signs=("+", "+"))
    return total


@dataclass(frozen=True, kw_only=True)
class Engine(Motor):
    """An engine under a governor: full load T_full(omega) up to rated speed, then a straight line down to no load.

    Above rated speed omega_n it is T = T_n (omega_0 - omega)/(omega_0 - omega_n), with the no-load speed
    omega_0 = omega_n (1 + droop). Beyond that the engine brakes: the line continues down to -T_brake, then
    the torque is constant.

    Args:
        speed: omega_n, rad/s, above 0.
        full_load: T_full, N m above 0: a number, or a `Curve` that reaches rated speed.
        droop: (omega_0 - omega_n)/omega_n, above 0; 3 to 10 % is usual; an isochronous governor (0) is no law of speed.
        idle: lowest speed of self-sustained running, rad/s, below rated. Below it the curve is an extrapolation,
            for a starter or a clutch.
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
    governed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuses values out of range."""
        faults = wrong_numbers(self, ("speed", "droop"), ("idle", "braking_torque"))
        if self.curve is None:
            faults += number_faults("torque", self.full_load, POSITIVE)
        refuse(faults)
        rated = f"the rated speed of {self.speed:.6g} rad/s"
        if not self.idle < self.speed:
            faults.append(Fault("idle", f"{self.idle:.6g} rad/s", f"a speed below {rated}"))
        first, last = EVERYWHERE if self.curve is None else self.curve.covers
        if not first < self.speed <= last:
            faults.append(Fault("full_load", f"speeds from {first:.6g} to {last:.6g} rad/s", f"speeds that include {rated}"))
        elif self.rated.torque <= 0:
            faults.append(Fault("full_load", f"{self.rated.torque:.6g} N m", f"a torque above 0 at {rated}"))
        refuse(faults)

    @property
    def curve(self) -> Curve | None:
        """The curve of full load, if it is one."""
        return self.full_load if isinstance(self.full_load, Curve) else None

    @property
    def rated(self) -> Point:
        """Full load at rated speed, where the governor begins to act."""
        if isinstance(self.full_load, Curve):
            return Point(self.speed, self.full_load.law().evaluate({"omega": self.speed}, np))
        return Point(self.speed, self.full_load)

    def facts(self) -> Iterator[Fact]:
        """Full load and governor."""
        table = _("Engine and governor")
        yield Fact(_("greatest speed at full load"), "", self.speed, "rad/s", table=table)
        yield Fact(_("torque at full load there"), "", self.rated.torque, "N m", table=table)
        yield Fact(_("droop of the governor, as a share of that speed"), "", self.droop, table=table)
        yield Fact(_("speed without load"), "", self.no_load_speed, "rad/s", table=table)

    def heat_facts(self, energy: Energy) -> Iterator[Fact]:
        """An empty iterator, as an engine has no windings."""
        return iter(())

    @property
    def no_load_speed(self) -> float:
        """Speed omega_n (1 + droop) at which the governor has cut off all fuel, rad/s."""
        return self.speed * (1 + self.droop)

    @property
    def covers(self) -> Span:
        """The range of speeds from idle, or the first row of the full-load curve, upwards, rad/s."""
        return max(self.idle, -math.inf if self.curve is None else self.curve.covers[0]), math.inf

    @property
    def stable(self) -> Span:
        """The range from the speed where full load begins to fall (else rated speed) to full engine braking, rad/s."""
        begin = self.speed if self.curve is None else self.curve.fall_before(self.speed)
        return begin, self.no_load_speed + self.braking_torque / self._steepness

    @property
    def _steepness(self) -> float:
        return self.rated.torque / (self.no_load_speed - self.speed)

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        line = {"steepness": self._steepness, "idle": self.no_load_speed, "least": -self.braking_torque}
        governed = compiled("max({steepness}*({idle} - omega), {least})", **line)
        if self.curve is None:
            full, rated = self.rated.torque, self.speed
            return compiled("{full} if omega <= {rated} else {governed}", full=full, rated=rated, governed=governed)
        below = Node("compare", (OMEGA, numeral(self.speed)), signs=("<=",))
        text = f"{self.curve.law().text}, governed from {self.speed:.6g} rad/s"
        return Expression(text, Node("if", (below, self.curve.tree(), governed.tree)))


@dataclass(frozen=True, kw_only=True)
class Hydraulic(Motor):
    """A hydraulic motor behind a pump of constant flow Q and a relief valve that opens at a pressure p_r.

    With D = V/(2 pi) the flow balance Q = D omega + G p below p_r gives p = (Q - D omega)/G; leakage is laminar,
    G = (1 - eta_v) Q/p_r by the volumetric efficiency at that pressure. Slower than omega_r = eta_v Q/D the valve opens, and
    its pressure rises by a share o (override) when the whole flow goes through it:

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

    Valid for changes that are slow compared with the filling of the lines (oil's compressibility left out), a closed circuit
    with valves on either side, and efficiencies that do not change with speed: at rest real motors give less. Source:
    Merritt, Hydraulic Control Systems, chapter 4 (ideal flow, laminar leakage); Esposito, Fluid Power with Applications, 7th
    ed., chapter 7 (efficiencies), and chapter 8 (relief valves); ISO 4391.

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
        """Refuses values out of range."""
        shares = ("volumetric_efficiency", "mechanical_efficiency")
        faults = wrong_numbers(self, ("displacement", "flow", "pressure", *shares), ("override",))
        refuse(faults)
        if not self.volumetric_efficiency < 1:
            defect = f"{self.volumetric_efficiency:g}"
            faults.append(
                Fault("volumetric_efficiency", defect, "a share below 1", "without leakage torque is no law of speed")
            )
        if not self.mechanical_efficiency <= 1:
            faults.append(Fault("mechanical_efficiency", f"{self.mechanical_efficiency:g}", "a share of 1 at most"))
        refuse(faults + number_faults("flow", self.flow / self.displacement, "a finite number above 0"))

    @property
    def no_load_speed(self) -> float:
        """Speed Q/D without leakage, rad/s."""
        return 2 * math.pi * self.flow / self.displacement

    @property
    def rated(self) -> Point:
        """The point at which the relief valve begins to open: the greatest power."""
        torque = self.mechanical_efficiency * self.pressure * self.displacement / (2 * math.pi)
        return Point(self.volumetric_efficiency * self.no_load_speed, torque)

    def facts(self) -> Iterator[Fact]:
        """The torque from displacement, flow and pressure."""
        yield from super().facts()
        volume, flow = Fact("", "V", self.displacement, "m^3"), Fact("", "Q", self.flow, "m^3/s")
        pressure, share = Fact("", "p_r", self.pressure, "Pa"), Fact("", "eta_v", self.volumetric_efficiency)
        efficiency, idle = Fact("", "eta_hm", self.mechanical_efficiency), Fact("", "omega_0", self.no_load_speed, "rad/s")
        yield idle._replace(words=_("Speed without load"), formula="omega_0 = 2*pi*Q/V", numbers=(flow, volume))
        valve, opening = _("Speed below which the relief valve is open"), "omega_r = eta_v*omega_0"
        yield Fact(valve, "omega_r", self.rated.speed, "rad/s", opening, (share, idle))
        numbers = (efficiency, pressure, volume)
        yield Fact(_("Torque there"), "T_r", self.rated.torque, "N m", "T_r = eta_hm*p_r*V/(2*pi)", numbers)

    @property
    def stable(self) -> Span:
        """The range of speeds between the openings of both relief valves; unlimited on the side of rising pressure."""
        reach = (1.0 - self.volumetric_efficiency) * self.no_load_speed
        return -math.inf if self.override else self.rated.speed, self.no_load_speed + reach

    def law(self) -> Expression:
        """The torque on the shaft, N m."""
        leak, idle, ratio = 1.0 - self.volumetric_efficiency, self.no_load_speed, self.mechanical_efficiency**2
        opened = self.rated.torque / (1.0 + self.override * leak)
        rise = "{opened}*(1 + {override}*(1 - omega/{idle}))" if self.override else "{opened}"
        relief = compiled(rise, opened=opened, override=self.override, idle=idle)
        line = compiled("{steepness}*({idle} - omega)", steepness=self.rated.torque / (leak * idle), idle=idle)
        # without a jump where it begins to brake: of the line and of the braking one, the lower acts on either side
        within = compiled("min({relief}, min({line}, {line}/{ratio}))", relief=relief, line=line, ratio=ratio)
        return compiled("max({within}, {most})", within=within, most=-self.rated.torque / ratio)
