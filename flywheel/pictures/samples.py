"""Curves of a sizing, point by point: M*, W and I* over the cycle, bodies' shares of I*, Wittenbauer's loop.

Pictures, the worked report and the live page draw the same ones; nothing here draws.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run

Array = NDArray[np.float64]

_NO_WORK = 1e-3  # of what a load gives and takes in a cycle: it does no work if less is left, as a weight does
_LOOP_SHARE = 0.10  # of the width and height of Wittenbauer's diagram: a smaller loop has a window of its own
_INTERCEPT_ROUNDING = 1e-9  # of the intercepts or inertias: work, in the same unit, that is none
MOST_BODIES = 8  # in a stacked picture


class Samples(NamedTuple):
    """One cycle, point by point: phi (rad), M* (N m), W (J), I* (kg m²), and what drives.

    `driving` is M_m* (N m): the sum of the drive, unless it brakes on the whole, and of the loads that do positive work in
    the cycle; M* less it is M_r*, with losses in meshes. `drive` is the drive's own part, None without one. Two points stand
    at every edge of a cell, one for each side.
    """

    phi: Array
    moment: Array
    work: Array
    inertia: Array
    driving: Array
    drive: Array | None


def samples_at(machine: Machine, cycle: Cycle, phi: Array, speed: float | None = None) -> Samples:
    """A resolved cycle at angles (rad) that ascend; at an edge the value of the cell that begins there.

    Moments below their rounding are 0, and so is the work where no more than its error is left of it anywhere.
    """
    cell, t = cycle.where(phi)
    work, variation = cycle.at(cell, t)
    moment = cells.value(cycle.series[0, cell], t)
    driving, drive = _driving(machine, cycle, phi, machine.anchors(phi), speed)
    return Samples(
        phi=phi,
        moment=np.where(np.abs(moment) > cycle.noise[0, cell], moment, 0.0),
        work=np.where(np.abs(work).max() > cycle.errors.work, work, 0.0),
        inertia=cycle.inertia_at_start + variation,
        driving=driving,
        drive=drive,
    )


def _driving(machine: Machine, cycle: Cycle, phi: Array, anchor: Array, speed: float | None) -> tuple[Array, Array | None]:
    """M_m* (N m) at angles that ascend: of the drive, unless it brakes on the whole, and of loads that do positive work.

    Second the drive's own, None without one.
    """
    moving = speed if machine.depends_on_speed or machine.depends_on_time else None
    parts = machine.reduction.moments(phi, anchor, cycle.balance or 0.0, speed=moving)
    found, drive = np.zeros_like(phi), None
    for name, part in parts.items():
        there = part + np.zeros_like(phi)
        if name == "drive":
            drive = there
        work, size = np.trapezoid(there.ravel(), phi.ravel()), np.trapezoid(np.abs(there).ravel(), phi.ravel())
        if work > (-_NO_WORK if name == "drive" else _NO_WORK) * size:  # a drive that holds back on the whole resists
            found = found + there
    return found, drive


def most(bodies: dict[str, Array]) -> dict[str, Array]:
    """Bodies with what each adds to I*; beyond `MOST_BODIES` the smallest ones as one."""
    if len(bodies) <= MOST_BODIES:
        return bodies
    largest = sorted(bodies, key=lambda name: -float(bodies[name].max()))[: MOST_BODIES - 1]
    rest = [part for name, part in bodies.items() if name not in largest]
    shown = {name: part for name, part in bodies.items() if name in largest}
    return shown | {f"{len(rest)} others": np.sum(rest, axis=0)}


class Loop(NamedTuple):
    """Wittenbauer's loop, F = 2 W/w² against I* (both kg m²), and the two tangents that an irregularity gives it.

    A tangent is F = slope I* + intercept, slope = (1 ± eps/2)². `contact_*` are the points where it touches, as
    (I*, F), `angle_*` their crank angles (rad). The tangents meet in P at I* = -flywheel, and MN = 2 eps flywheel.
    """

    inertia: Array
    energy: Array
    slope_fast: float
    slope_slow: float
    intercept_fast: float
    intercept_slow: float
    contact_fast: tuple[float, float]
    contact_slow: tuple[float, float]
    angle_fast: float
    angle_slow: float
    flywheel: float

    @property
    def lines(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The tangents of the greatest and of the least speed, each as (slope, intercept)."""
        return (self.slope_fast, self.intercept_fast), (self.slope_slow, self.intercept_slow)

    @property
    def far_point(self) -> tuple[float, float]:
        """P, where the tangents meet: (I*, F)."""
        return -self.flywheel, self.intercept_fast - self.slope_fast * self.flywheel


def loop(cycle: Cycle, samples: Samples, speed: float, run: Run) -> Loop:
    """The loop with the tangents for the irregularity of a run, found from extremes, not from the samples.

    `speed` is w, the mean of extremes (rad/s). Source: F. Wittenbauer, Graphische Dynamik (1923).
    """
    unit, start = 2.0 / speed**2, cycle.inertia_at_start
    fast, slow = (1 + run.irregularity / 2) ** 2, (1 - run.irregularity / 2) ** 2
    extremes, _ = turning_moment.combined(cycle, np.array([[1.0, -fast / unit], [1.0, -slow / unit]]))
    over, under = float(extremes.greatest[0]), float(extremes.least[1])
    angles = float(extremes.angle_greatest[0]), float(extremes.angle_least[1])
    work, variation = cycle.at(*cycle.where(np.array(angles)))
    points = [(start + float(v), unit * float(w)) for w, v in zip(work, variation, strict=True)]
    return Loop(
        inertia=samples.inertia,
        energy=unit * samples.work,
        slope_fast=fast,
        slope_slow=slow,
        intercept_fast=unit * over - fast * start,
        intercept_slow=unit * under - slow * start,
        contact_fast=points[0],
        contact_slow=points[1],
        angle_fast=angles[0],
        angle_slow=angles[1],
        flywheel=run.inertia,
    )


def windows(loop: Loop, joule: float) -> tuple[list[list[float]], str]:
    """The parts of the diagram that are shown, [left, right, low, high] in kg m² and J, and what the last one shows.

    The whole triangle ("P"), or without P where the loop would be too small in it ("MN"); where it would be even there,
    the loop follows by itself ("loop"). A loop whose work is nothing but rounding is a line, which has no height to be seen.
    """
    corners = np.array([[loop.inertia.min(), loop.inertia.max()], [loop.energy.min(), loop.energy.max()]])
    axis = np.array([[0.0, 0.0], [loop.intercept_slow, loop.intercept_fast]])
    at_right = [slope * corners[0, 1] + cut for slope, cut in loop.lines]
    far = np.array(loop.far_point)[:, None]
    windows, extents = list[list[float]](), np.ptp(corners, axis=1)
    line = extents[1] <= _INTERCEPT_ROUNDING * max(np.abs(axis).max(), corners[0, 1])
    for name, parts in {"P": [corners, axis, far], "MN": [corners, axis], "loop": [corners]}.items():
        points = np.concatenate(parts, axis=1)
        low, high = points.min(axis=1), points.max(axis=1)
        if name != "loop":
            low[1], high[1] = min(low[1], *at_right), max(high[1], *at_right)
        spans = np.maximum(high - low, 1e-300)
        margin = np.array([0.12, 0.1]) * spans
        (left, bottom), (right, top) = low - margin, high + margin
        large = bool((extents >= _LOOP_SHARE * spans)[: 1 if line else 2].all())
        if name != "P" or large:
            windows.append([float(left), float(right), float(joule * bottom), float(joule * top)])
        if large:
            return windows, name
    return windows, "loop"


def crossing_speeds(sums: Array, least: float, inertia: float) -> Array:
    """Crank speeds (rad/s) at the crossings of a diagram of areas, from ½ J (w² - w_min²) = S - S_min.

    `sums` are the accumulated areas S (J), `least` is w_min (rad/s), `inertia` the flywheel J on the crank (kg m²).

    >>> crossing_speeds(np.array([0.0, 3.5, -1.0]), 1.0, 1.0).round(6).tolist()
    [1.732051, 3.162278, 1.0]
    """
    return np.asarray(np.sqrt(least**2 + 2 * (sums - sums.min()) / inertia))


def roomiest(samples: Samples, start: float, end: float, side: float, width: float) -> tuple[float, float]:
    """Angle at which a text of some width (rad) has most room under the curve between two angles, and the free |M*|.

    Of equally good places the one nearest to the centroid is taken; without room anywhere, the centroid.
    """
    phi = np.linspace(start, end, 201)
    size = np.maximum(side * np.interp(phi, samples.phi, samples.moment), 0.0)
    centroid = float((phi * size).sum() / size.sum()) if size.any() else 0.5 * (start + end)
    window = int(np.ceil(width / (phi[1] - phi[0]))) + 1
    if window >= phi.size:
        return centroid, 0.0
    free = np.lib.stride_tricks.sliding_window_view(size, window).min(axis=1)
    middles = phi[: free.size] + 0.5 * (window - 1) * (phi[1] - phi[0])
    good = np.flatnonzero(free >= 0.9 * free.max())
    best = good[np.abs(middles[good] - centroid).argmin()]
    return float(middles[best]), float(free[best])
