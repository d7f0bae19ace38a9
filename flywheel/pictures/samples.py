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

_POINTS = 3000
_NOTHING = 1e-3  # of what a load gives and takes in a cycle: it does no work if less is left, as a weight does
_FEWEST, _MOST = 3, 129  # points in one cell, both ends included
MOST_BODIES = 8  # in a stacked picture


class Samples(NamedTuple):
    """One cycle, point by point: phi (rad), M* (N m), W (J), I* (kg m²), the share of the balance in M*, and what drives.

    `driving` is M_m* (N m): the sum of the drive, unless it brakes on the whole, and of the loads that do positive work in
    the cycle; M* less it is M_r*, with losses in meshes. `drive` is the drive's own part, None without one. Two points stand
    at every edge of a cell, one for each side.
    """

    phi: Array
    moment: Array
    work: Array
    inertia: Array
    balance: Array | None
    driving: Array
    drive: Array | None


def sampled(machine: Machine, cycle: Cycle, speed: float | None = None, points: int = _POINTS) -> Samples:
    """A resolved cycle on evenly spread points in every cell, ends included: about as many as are asked for, or 3 a cell.

    With a constant speed (rad/s) the share of a balance is told even where it depends on speed.
    """
    mesh = cycle.mesh
    count = mesh.phi.shape[0]
    t = np.linspace(-1.0, 1.0, int(np.clip(points // count, _FEWEST, _MOST)))
    phi = mesh.middle + mesh.half * t
    phi[:, 0], phi[:, -1] = mesh.edges[:-1], mesh.edges[1:]  # the same float on both sides of an edge
    cell, local = np.repeat(np.arange(count), t.size), np.tile(t, count)
    work, variation = cycle.at(cell, local)
    share = None
    if cycle.balance is not None:
        station = machine.reduction.at(phi, mesh.anchor)
        moving = [] if speed is None else station.contributions(speed)
        factor = station.reduced.per_unknown + np.zeros_like(phi)
        share = np.asarray(cycle.balance * (factor + sum(part for _, _, part in moving))).ravel()
    driving, drive = _driving(machine, cycle, phi, mesh.anchor, speed)
    return Samples(
        phi=phi.ravel(),
        moment=(cycle.series[0] @ cells.basis(t, cells.ORDER).T).ravel(),
        work=work,
        inertia=cycle.inertia_at_start + variation,
        balance=share,
        driving=driving.ravel(),
        drive=None if drive is None else drive.ravel(),
    )


def samples_at(machine: Machine, cycle: Cycle, phi: Array, speed: float | None = None) -> Samples:
    """A resolved cycle at angles (rad) that ascend; at an edge the value of the cell that begins there."""
    cell, t = cycle.where(phi)
    work, variation = cycle.at(cell, t)
    driving, drive = _driving(machine, cycle, phi, machine.anchors(phi), speed)
    return Samples(
        phi=phi,
        moment=cells.value(cycle.series[0, cell], t),
        work=work,
        inertia=cycle.inertia_at_start + variation,
        balance=None,
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
        if work > (-_NOTHING if name == "drive" else _NOTHING) * size:  # a drive that holds back on the whole resists
            found = found + there
    return found, drive


def bodies(machine: Machine, samples: Samples) -> dict[str, Array]:
    """What each body adds to I* (kg m²) at the samples; bodies that add nothing are left out."""
    phi = samples.phi % machine.scene.cycle
    parts = machine.kinematics.inertias(machine.kinematics.flows(phi, machine.anchors(phi)))
    return most({name: np.broadcast_to(part, phi.shape) for name, part in parts.items() if np.any(part)})


def most(found: dict[str, Array]) -> dict[str, Array]:
    """Bodies with what each adds to I*; beyond `MOST_BODIES` the smallest ones as one."""
    if len(found) <= MOST_BODIES:
        return found
    largest = sorted(found, key=lambda name: -float(found[name].max()))[: MOST_BODIES - 1]
    rest = [part for name, part in found.items() if name not in largest]
    shown = {name: part for name, part in found.items() if name in largest}
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


def crossing_speeds(sums: Array, least: float, inertia: float) -> Array:
    """Crank speeds (rad/s) at the crossings of a diagram of areas, from ½ J (w² - w_min²) = S - S_min.

    `sums` are the accumulated areas S (J), `least` is w_min (rad/s), `inertia` the flywheel J on the crank (kg m²).

    >>> crossing_speeds(np.array([0.0, 3.5, -1.0]), 1.0, 1.0).round(6).tolist()
    [1.732051, 3.162278, 1.0]
    """
    return np.asarray(np.sqrt(least**2 + 2 * (sums - sums.min()) / inertia))


def roomiest(samples: Samples, start: float, end: float, side: float, width: float) -> tuple[float, float]:
    """Where a text of some width (rad) has most room under the curve between two angles, and |M*| that is free there.

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
