"""Variables of a linkage at positions of its driver, and the places that arms make of them."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.formulas.intervals import Interval
from flywheel.linkage.enclosure import enclosed
from flywheel.linkage.solution import Solution

Array = NDArray[np.float64]

_KEPT = 4


class Kept(NamedTuple):
    """A variable at psi: its value and its derivatives by psi, as arrays or intervals."""

    value: Any
    rate: Any
    slope: Any


class Angle(NamedTuple):
    """An angle (rad) as a sum of variables, by number and weight, and a constant."""

    terms: tuple[tuple[int, float], ...]
    constant: float


def angle_of(weights: Array, constant: float) -> Angle:
    """The angle of a form's weights over all variables."""
    return Angle(tuple((int(k), float(weights[k])) for k in np.flatnonzero(weights)), constant)


class LinkagePosition:
    """All variables of a linkage at the driver's coordinate psi, found together when the first is read.

    psi is reduced to one period by the turn that the anchor lies in; `winding` is what each variable gains in a period.
    With intervals every variable is a proven enclosure.
    """

    def __init__(
        self, solution: Solution, period: float | None, winding: Array, psi: Any, ns: Any, anchor: Any = None
    ) -> None:
        self.solution, self.psi, self.ns = solution, psi, ns
        self.winding = winding
        middle = psi if anchor is None else anchor
        self.turns = 0.0 if period is None else np.floor(np.asarray(middle, dtype=float) / period)
        self.local = psi - self.turns * period if period is not None else psi

    @cached_property
    def _all(self) -> tuple[Kept, ...]:
        if isinstance(self.local, Interval):
            return self._enclosed(self.local)
        q = np.asarray(self.local, dtype=float)
        movement = self.solution.movement(np.atleast_1d(q).ravel())
        return self._unscaled([_shaped(part, q.shape) for part in movement])

    def _enclosed(self, cell: Interval) -> tuple[Kept, ...]:
        low, high = np.broadcast_arrays(np.asarray(cell.lo, dtype=float), np.asarray(cell.hi, dtype=float))
        found = enclosed(self.solution, np.atleast_1d(low).ravel(), np.atleast_1d(high).ravel())
        parts = []
        for middle, reach in zip(found[::2], found[1::2], strict=True):
            with np.errstate(all="ignore"):
                ends = [_shaped(middle + sign * reach, low.shape) for sign in (-1.0, 1.0)]
            parts.append([Interval(a, b) for a, b in zip(*ends, strict=True)])
        return self._unscaled(parts)

    def _unscaled(self, parts: list[Any]) -> tuple[Kept, ...]:
        """In rad and m, derivatives by psi."""
        unit, by = self.solution.unit, self.solution.scale
        sizes = [unit if sliding else 1.0 for sliding in are_slides(self.solution)]
        return tuple(
            Kept(parts[0][k] * size, parts[1][k] * (size / by), parts[2][k] * (size / by**2)) for k, size in enumerate(sizes)
        )

    def kept(self, variable: int) -> Kept:
        """A variable with its rate and slope; its value with what it gained in the turns before."""
        found = self._all[variable]
        gain = self.winding[variable]
        return found if gain == 0.0 else found._replace(value=found.value + gain * self.turns)

    def angle(self, angle: Angle) -> Any:
        """An angle that is a form of the variables (rad)."""
        total: Any = angle.constant
        for variable, weight in angle.terms:
            total = total + weight * self.kept(variable).value
        return total

    def turning(self, angle: Angle) -> Any:
        """The rate of such an angle."""
        total: Any = 0.0
        for variable, weight in angle.terms:
            total = total + weight * self.kept(variable).rate
        return total


class Positions:
    """Positions of a linkage at any psi. The last few single ones are kept: every modulus of a graph asks for them again."""

    def __init__(self, solution: Solution, period: float | None, winding: Array) -> None:
        self._of = solution, period, winding
        self._last: dict[tuple[float, float | None], LinkagePosition] = {}

    def __call__(self, psi: Any, ns: Any, anchor: Any = None) -> LinkagePosition:
        """The position at psi; `anchor` lies in the turn that psi belongs to."""
        if not (isinstance(psi, float) and isinstance(anchor, float | None)):
            return LinkagePosition(*self._of, psi, ns, anchor)
        key = psi, anchor
        found = self._last.get(key)
        if found is None:
            if len(self._last) >= _KEPT:
                del self._last[next(iter(self._last))]
            found = self._last[key] = LinkagePosition(*self._of, psi, ns, anchor)
        return found


def _shaped(table: Array, shape: tuple[int, ...]) -> Array:
    """A row for every variable, each of the shape that was asked for."""
    return table.T.reshape(table.shape[1], *shape)


def are_slides(solution: Solution) -> list[bool]:
    """Which variables are displacements."""
    names = solution.equations.loops.names
    return [solution.linkage.sliding, *(name.startswith("slide") for name in names[1:])]


class Arm(NamedTuple):
    """One term of a place: `length` (m, or 1 in front of a displacement) along `angle`, times variable `slide`."""

    length: float
    angle: Angle
    slide: int


def _stretch(p: LinkagePosition, arm: Arm) -> tuple[Any, Any]:
    """Length of an arm, and its rate."""
    if arm.slide < 0:
        return arm.length, 0.0
    kept = p.kept(arm.slide)
    return arm.length * kept.value, arm.length * kept.rate


def swing(p: LinkagePosition, arm: Arm, angle: Angle) -> Any:
    """Rate of an arm's end along an axis by the arm's turning: -L sin(angle)."""
    return -_stretch(p, arm)[0] * p.ns.sin(p.angle(angle))


def swing_slope(p: LinkagePosition, arm: Arm, angle: Angle) -> Any:
    """Slope of that by psi."""
    length, rate = _stretch(p, arm)
    at = p.angle(angle)
    return -(rate * p.ns.sin(at)) - length * p.ns.cos(at) * p.turning(angle)


def push(p: LinkagePosition, arm: Arm, angle: Angle) -> Any:
    """Rate of an arm's end along an axis by its displacement: cos(angle)."""
    return arm.length * p.ns.cos(p.angle(angle))


def push_slope(p: LinkagePosition, arm: Arm, angle: Angle) -> Any:
    """Slope of that by psi."""
    return -arm.length * p.ns.sin(p.angle(angle)) * p.turning(angle)


def place(p: LinkagePosition, arms: list[Arm], direction: float) -> Any:
    """Where a sum of arms ends, along a direction (rad)."""
    total: Any = 0.0
    for arm in arms:
        angle = arm.angle._replace(constant=arm.angle.constant - direction)
        total = total + _stretch(p, arm)[0] * p.ns.cos(p.angle(angle))
    return total
