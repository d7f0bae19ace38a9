"""Motors whose torque is measured: rows of speed and torque."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np

from flywheel.components.motors.motor import Motor, Span, wrong_numbers
from flywheel.numerics.arguments import number_faults, refuse
from flywheel.numerics.expressions import Expression, Node, between, numeral, variable
from flywheel.numerics.faults import Fault, suggestion

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
