"""Temperature of a motor's windings from its losses: by one or two time constants, over a duty, a cycle or any motion.

`Thermal` has the data of the motor; `course` gives the temperature over a sequence of constant losses repeated
indefinitely, `greatest_rise` its peak over losses that vary along a cycle, `rise_after` that at the end of losses from the
cold motor on, `starts_an_hour` the permissible number of starts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flywheel.numerics import cells
from flywheel.numerics.cells import Array
from flywheel.numerics.faults import POSITIVE, Fault, number_faults, refuse, suggestion

HOUR = 3600.0
CLASSES = {"A": 60.0, "E": 75.0, "B": 80.0, "F": 105.0, "H": 125.0}
"""Limits of the temperature rise by thermal class, K: windings by resistance, air-cooled, below 5 MW (IEC 60034-1)."""


class Losses(NamedTuple):
    """A stretch of constant losses: its time (s), the losses over those at the rated point, the share of the cooling."""

    time: float
    share: float
    cooling: float = 1.0


class Thermal(NamedTuple):
    """Data of the heating of a motor's windings.

    With losses q over the rated ones the rise of the windings is the sum of two parts, each dx/dt = (r q - c x)/T: that of
    the whole motor, r = (1 - a) R, time constant T, c the share of its cooling; and that of the windings over the iron,
    r = a R, time constant T_w, c = 1. R is the rise in continuous running at the rated point.

    Args:
        time_constant: T, s.
        rise: R, K.
        limit: greatest allowed rise, K.
        winding_time_constant: T_w, s; None for one time constant.
        winding_share: a, 0 for one time constant.

    Valid for constant heat transfer, and losses that do not depend on the temperature. Source: IEC 60034-1 (duty types,
    table of limits of rise); IEC 60034-29 and Fischer, Elektrische Maschinen, 14th ed. (one and two bodies).

    """

    time_constant: float
    rise: float
    limit: float
    winding_time_constant: float | None = None
    winding_share: float = 0.0

    def faults(self) -> list[Fault]:
        """The faults of its numbers, by the scene's keys."""
        named = {"time_constant": self.time_constant, "rise": self.rise}
        if self.winding_time_constant is not None:
            named["winding_time_constant"] = self.winding_time_constant
        faults = [fault for name, value in named.items() for fault in number_faults(name, value, POSITIVE)]
        if (self.winding_time_constant is None) != (self.winding_share == 0.0):
            defect = f"{self.winding_share:g} without" if self.winding_time_constant is None else "nothing with"
            faults.append(Fault("winding_share", f"{defect} a winding_time_constant", "both or neither"))
        elif not 0.0 <= self.winding_share < 1.0:
            faults.append(Fault("winding_share", f"{self.winding_share:g}", "a share of the rise, below 1"))
        elif self.winding_time_constant is not None and not self.winding_time_constant < self.time_constant:
            defect = f"{self.winding_time_constant:g} s with a time_constant of {self.time_constant:g} s"
            faults.append(Fault("winding_time_constant", defect, "a shorter one"))
        return faults

    @property
    def bodies(self) -> tuple[tuple[float, float, bool], ...]:
        """Rise (K) at the rated point, time constant (s), and true if reduced cooling affects it, of each part."""
        slow = ((1.0 - self.winding_share) * self.rise, self.time_constant, True)
        if self.winding_time_constant is None:
            return (slow,)
        return slow, (self.winding_share * self.rise, self.winding_time_constant, False)

    def step(self, parts: Sequence[float], losses: Losses) -> tuple[float, ...]:
        """The parts of the rise (K) after a stretch, from those at its beginning."""
        factors = []
        for part, (rise, constant, cooled) in zip(parts, self.bodies, strict=True):
            cooling, ways = (losses.cooling if cooled else 1.0), losses.time / constant
            gain = -math.expm1(-cooling * ways) / cooling if cooling else ways
            factors.append(part * math.exp(-cooling * ways) + rise * losses.share * gain)
        return tuple(factors)

    def turn(self, parts: Sequence[float], losses: Losses) -> float | None:
        """The time (s) within a stretch at which the rise is greatest or least; None if that is at an end.

        The parts change at r_i exp(-c_i t/T_i): one against the other is 0 at ln(-r_1/r_2)/(c_1/T_1 - c_2/T_2).
        """
        if len(parts) == 1:
            return None
        rates, speeds = [], []
        for part, (rise, constant, cooled) in zip(parts, self.bodies, strict=True):
            cooling = losses.cooling if cooled else 1.0
            rates.append((rise * losses.share - cooling * part) / constant)
            speeds.append(cooling / constant)
        if not rates[0] * rates[1] < 0.0:
            return None
        time = math.log(-rates[0] / rates[1]) / (speeds[0] - speeds[1])
        return time if 0.0 < time < losses.time else None


def thermal(
    time_constant: float, rise: float | None, kind: str, winding: float | None = None, share: float = 0.0
) -> Thermal:
    """A motor's thermal data by its class; without a rise at the rated point that of the class's limit is used.

    Raises:
        SceneError: for values out of range, and an unknown class.

    >>> thermal(1200.0, 80.0, "F").limit
    105.0

    """
    if kind not in CLASSES:
        refuse([Fault("class", f'"{kind}"', f"one of {', '.join(CLASSES)}", suggestion(kind, tuple(CLASSES)))])
    model = Thermal(time_constant, CLASSES[kind] if rise is None else rise, CLASSES[kind], winding, share)
    refuse(model.faults())
    return model


class TemperatureCourse(NamedTuple):
    """The rise over a sequence repeated indefinitely: K at the ends of its stretches, the greatest and its time (s).

    `ends` begins with the rise at the sequence's beginning.
    """

    ends: tuple[float, ...]
    greatest: float
    time: float


def course(data: Thermal, sequence: Iterable[Losses]) -> TemperatureCourse:
    """The rise over a sequence of losses repeated indefinitely.

    Each part is linear in its initial value, x_1 = D x_0 + E, so that x_0 = E/(1 - D) repeats.

    >>> data = thermal(600.0, 100.0, "H")
    >>> rises = course(data, [Losses(300.0, 1.0), Losses(300.0, 0.0)])
    >>> [round(rise, 6) for rise in rises.ends], round(100 * (1 - math.exp(-0.5)) / (1 - math.exp(-1.0)), 6)
    ([37.754067, 62.245933, 37.754067], 62.245933)

    """
    listed = list(sequence)
    zero = tuple(0.0 for _ in data.bodies)
    parts = zero
    for losses in listed:
        parts = data.step(parts, losses)
    begun = []
    for part, (_rise, constant, cooled) in zip(parts, data.bodies, strict=True):
        ways = sum((each.cooling if cooled else 1.0) * each.time for each in listed) / constant
        begun.append(part / -math.expm1(-ways) if ways else math.inf)
    parts, clock = tuple(begun), 0.0
    ends, greatest, at = [sum(parts)], sum(parts), 0.0
    for losses in listed:
        if (turn := data.turn(parts, losses)) is not None:
            inner = sum(data.step(parts, losses._replace(time=turn)))
            if inner > greatest:
                greatest, at = inner, clock + turn
        parts, clock = data.step(parts, losses), clock + losses.time
        ends.append(sum(parts))
        if ends[-1] > greatest:
            greatest, at = ends[-1], clock
    return TemperatureCourse(tuple(ends), greatest, at)


class Temperature(NamedTuple):
    """Rise of the windings' temperature (K) in a cycle or a duty repeated indefinitely; `limit` is that of their class.

    `greatest` is reached after `time` (s) of it. Of a duty `phases` has each phase with the rise at its end, and `starts`
    the greatest number of starts an hour of each phase with starts, with its load between them. `error` is relative.
    """

    greatest: float
    time: float
    limit: float
    error: float
    phases: tuple[tuple[str, float], ...] = ()
    starts: Mapping[str, int] = {}

    @property
    def within(self) -> bool:
        """True if the windings stay within the limit."""
        return bool(self.greatest <= self.limit * (1.0 + self.error))

    def as_dict(self) -> dict[str, Any]:
        """The record for JSON, SI throughout."""
        phases = [{"name": name, "rise": rise} for name, rise in self.phases]
        return {**self._asdict(), "phases": phases, "starts": dict(self.starts), "within": self.within}


def greatest_rise(data: Thermal, half: Array, slowness: Array, shares: Array) -> Temperature:
    """The greatest rise over losses that vary along a cycle repeated indefinitely, dx/dt = (r q - x)/T for each part.

    The equations are solved by collocation in each cell of a variable, an angle or time itself; the solution is that which
    returns to its beginning. The error, relative, is that of the interpolation in cells.

    Args:
        data: of the motor; its cooling is not reduced.
        half: half widths of the cells, shape (cells,).
        slowness: time for a unit of the variable at the nodes of cells, shape (cells, ORDER).
        shares: q, losses over the rated ones at the nodes, likewise.

    >>> times = 5.0 * (cells.NODES + 1.0) + np.array([[0.0], [10.0]])
    >>> losses = 1.0 + np.sin(2 * np.pi * times / 20.0)
    >>> peak = greatest_rise(thermal(10.0, 100.0, "H"), np.full(2, 5.0), np.ones((2, cells.ORDER)), losses)
    >>> round(peak.greatest, 9), round(100.0 * (1.0 + 1.0 / math.hypot(1.0, math.pi)), 9)
    (130.331447105, 130.331447105)

    """
    clock = cells.antiderivative(cells.fit(slowness), half[:, None])
    begin = cells.accumulated(clock)
    to_nodes, none = cells.basis(cells.NODES, clock.shape[-1]).T, np.zeros((half.size, 1, 0, cells.ORDER))
    rises, edges, error = np.zeros_like(shares), np.zeros(half.size + 1), 0.0
    for rise, constant, _ in data.bodies:
        decay = slowness / constant
        heating = cells.fit(rise * shares * decay)
        gained = cells.antiderivative(heating, half[:, None])
        motion = cells.changes(
            half, -decay[:, None, None], none, (gained @ to_nodes)[:, None], cells.ends(gained)[:, None, 1]
        )
        first = motion.edge_rest[-1, 0] / -motion.edge_start[-1, 0, 0]
        rises += motion.start[:, 0, :, 0] * first + motion.rest[:, 0]
        edges += (1.0 + motion.edge_start[:, 0, 0]) * first + motion.edge_rest[:, 0]
        missed = cells.TAIL_OF_INTEGRAL * float(cells.tails(heating) @ half)
        error += missed / -float(motion.edge_start[-1, 0, 0])
    series = cells.fit(rises)
    slopes = cells.derivative(series)
    turns = cells.crossings(slopes[None], 64 * cells.ROUNDING * np.abs(slopes).sum(axis=-1)[None])
    inside = cells.value(series[turns.cell], turns.t)
    times = begin[turns.cell] + cells.value(clock[turns.cell], turns.t)
    values, places = np.append(edges, inside), np.append(begin, times)
    k = int(cells.peak(values, places))
    greatest, error = float(values[k]), error + float(cells.tails(series).max())
    return Temperature(greatest, float(places[k]), data.limit, error / max(greatest, 1e-300))


def rise_after(data: Thermal, times: ArrayLike, weights: ArrayLike, shares: ArrayLike, end: float) -> float:
    """The rise (K) of the windings at a time, from the cold motor on: the sum of r integral of q exp(-(t - s)/T)/T ds.

    Args:
        data: of the motor.
        times: s of the integral, s, shape (n,).
        weights: of these in an integral over time, s, shape (n,).
        shares: q, losses over the rated ones, shape (n,).
        end: t, s.

    >>> data = thermal(10.0, 100.0, "H")
    >>> nodes, weights = np.polynomial.legendre.leggauss(20)
    >>> round(rise_after(data, 2.5 * (nodes + 1), 2.5 * weights, np.ones(20), 5.0), 9), round(100 * (1 - math.exp(-0.5)), 9)
    (39.346934029, 39.346934029)

    """
    before, weighted = (
        end - np.asarray(times, dtype=float),
        np.asarray(weights, dtype=float) * np.asarray(shares, dtype=float),
    )
    return float(sum(rise / constant * (weighted @ np.exp(-before / constant)) for rise, constant, _ in data.bodies))


def starts_an_hour(data: Thermal, running: float, start: Losses) -> int:
    """The most starts in an hour, evenly spread over running, with which the windings stay within their limit.

    Args:
        data: of the motor.
        running: losses between the starts, over the rated ones.
        start: time and losses of a start.

    >>> starts_an_hour(thermal(1200.0, 80.0, "B"), 0.5, Losses(2.0, 30.0))
    29

    """

    def kept(count: int) -> bool:
        rest = HOUR / count - start.time
        return course(data, [start, Losses(rest, running)]).greatest <= data.limit * (1.0 + 1e-12)

    low, high = 0, int(HOUR / start.time)
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if kept(middle) else (low, middle - 1)
    return low
