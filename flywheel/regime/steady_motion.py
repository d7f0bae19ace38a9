"""Speed over a steady cycle for a given inertia: from the energy, in closed form, at the mean of extremes asked for.

With it the period, and how far angles can be trusted: where the moment crosses zero, where the speed is extreme.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.machine import Machine
from flywheel.numerics import cells as piecewise
from flywheel.numerics.cells import ORDER, ROUNDING, Coarse, Crossings
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle

Array = NDArray[np.float64]
Index = NDArray[np.intp]
_LEVEL_ROUNDING = 4 * ROUNDING  # of the energy's level
_MOST_CELLS = 4_000  # that the time of a cycle is worth, beside those of the cycle itself


class Run(NamedTuple):
    """Periodic motion with a given inertia on the crank (kg m²): speeds in rad/s, angles in rad.

    `offset` is the kinetic energy at phi = 0 less ½ (J + I*(0)) w_a² (J); `error` bounds the relative error of the
    irregularity, 2 (w_max - w_min)/(w_max + w_min); `level` that of the energy as a whole, as a share of (J + I*(0)) w_a²,
    where the machine sets its own. Where torques depend on speed, `cycle` is the one along this motion and
    `speed` its own mean of extremes w_a; else they are those of the whole sizing. `drive` is then the drive's moment on the
    crank (N m) at the cycle's nodes, `current` that of a motor with inductance at phi = 0 (A).
    """

    inertia: float
    irregularity: float
    speed_max: float
    speed_min: float
    angle_speed_max: float
    angle_speed_min: float
    offset: float
    error: float
    cycle: Cycle | None = None
    speed: float | None = None
    drive: Array | None = None
    current: float | None = None
    level: float = 0.0

    @property
    def level_error(self) -> float:
        """What the doubt of the energy's level leaves of the mean of extremes, relative.

        The slower the machine, the more speed the same energy is.
        """
        mean = 0.5 * (self.speed_max + self.speed_min)
        return self.level * mean**2 / max(self.speed_max * self.speed_min, ROUNDING * mean**2) if self.level else 0.0


class NoMotionError(ValueError):
    """No periodic motion has the mean of extremes asked for: the machine would stop within the cycle."""


def run(cycle: Cycle, speed: float, inertia: float) -> Run:
    """The motion whose mean of greatest and least speed is `speed` (rad/s), by Newton's method on the energy level e.

    omega² = speed² (1 + s), s = (2 e + 2 W - speed² (I* - I*(0)))/(speed² (J + I*)): s keeps its digits however small
    the fluctuation is. Raises NoMotionError where every level that keeps turning is too fast.
    """
    least = turning_moment.combined(cycle, np.array([[1.0, 0.0], [0.0, 1.0]]))[0].least
    start = inertia + cycle.inertia_at_start
    if start + least[1] <= cycle.errors.variation:  # rounding may leave something where there is nothing
        raise NoMotionError
    lowest = -0.5 * speed**2 * start - float(least[0])
    level = _Level(cycle, speed, inertia)
    if level.swing(lowest).mean() >= 1.0:
        raise NoMotionError
    offset = 0.0 if lowest < 0.0 else 2 * lowest + abs(float(least[0]))
    for _ in range(60):
        swing = level.swing(offset)
        step = (1.0 - swing.mean()) / swing.slope(speed)
        target = offset + step
        offset = target if target > lowest else 0.5 * (offset + lowest)
        if abs(step) <= 4 * ROUNDING * (abs(offset) + 0.25 * speed**2 * swing.least_total * np.ptp(swing.s)):
            break
    return level.run(offset)


def resolved_run(machine: Machine, cycle: Cycle, speed: float, inertia: float, rtol: float) -> tuple[Cycle, Run]:
    """The same motion on cells fine enough for its own error to be within rtol, where halving them can reach that."""

    def evaluated(edges: Array) -> tuple[tuple[Cycle, Run], float, Coarse]:
        here = cycle if edges is cycle.mesh.edges else turning_moment.resolve(machine, edges)
        found = run(here, speed, inertia)
        return (here, found), found.error, turning_moment.coarse(here, found.speed_max)

    return piecewise.refined(cycle.mesh.edges, evaluated, rtol)


class _Swing(NamedTuple):
    """Fastest and slowest point at one energy level: s, J + I*, cell and local abscissa there; the least J + I*."""

    s: Array
    total: Array
    cell: Index
    t: Array
    least_total: float

    def mean(self) -> float:
        """Mean of extremes over the speed asked for."""
        return float(np.sqrt(np.maximum(1.0 + self.s, 0.0)).mean())

    def slope(self, speed: float) -> float:
        """Slope of that mean with the energy level, 1/J."""
        return float((1.0 / (speed**2 * self.total * np.sqrt(np.maximum(1.0 + self.s, 1e-30)))).mean())


class _Level:
    """A cycle run with one inertia: its speed at any energy level."""

    def __init__(self, cycle: Cycle, speed: float, inertia: float) -> None:
        self.cycle, self.speed, self.square, self.inertia = cycle, speed, speed**2, inertia
        count = cycle.mesh.phi.shape[0]
        nodes = cycle.at(np.repeat(np.arange(count), ORDER), np.tile(piecewise.NODES, count))
        self._at_nodes = tuple(values.reshape(cycle.mesh.phi.shape) for values in nodes)
        values = cycle.series[:2] @ piecewise.basis(piecewise.NODES, ORDER).T
        self._moment, self._slope = values[0], values[1]

    def fluctuation(self, offset: float, work: Array, variation: Array) -> tuple[Array, Array]:
        """S and J + I* from W and I* - I*(0)."""
        total = self.inertia + self.cycle.inertia_at_start + variation
        return (2 * offset + 2 * work - self.square * variation) / (self.square * total), total

    def swing(self, offset: float) -> _Swing:
        """Fastest and slowest point: at roots of M* - ½ omega² dI*/dphi, or at an end of a cell."""
        s, _ = self.fluctuation(offset, *self._at_nodes)
        half_square = 0.5 * self.square * (1.0 + s)
        force = piecewise.fit((self._moment - half_square * self._slope)[None])
        noise = self.cycle.noise[0] + half_square.max(axis=-1) * self.cycle.noise[1]
        found = piecewise.crossings(force, noise[None])
        cells = np.arange(s.shape[0])
        cell = np.concatenate((cells, cells, found.cell))
        t = np.concatenate((np.full(cells.size, -1.0), np.ones(cells.size), found.t))
        s, total = self.fluctuation(offset, *self.cycle.at(cell, t))
        ends = [int(s.argmax()), int(s.argmin())]
        cell, t = cell[ends], self._polished(cell[ends], t[ends], s[ends])
        extreme, heavy = self.fluctuation(offset, *self.cycle.at(cell, t))
        return _Swing(extreme, heavy, cell, t, float(total.min()))

    def run(self, offset: float) -> Run:
        """The figures of the motion at an energy level."""
        swing = self.swing(offset)
        root = np.sqrt(np.maximum(1.0 + swing.s, 0.0))
        spread = float(swing.s[0] - swing.s[1])
        errors = self.cycle.errors
        doubt = 2 * (errors.swing + self.square * errors.variation) / self.square / swing.least_total
        doubt += 2 * spread * (errors.inertia / swing.least_total + 4 * ROUNDING)
        angles = self._angles(swing)
        return Run(
            inertia=self.inertia,
            irregularity=2 * spread / float(root.sum()) ** 2,
            speed_max=self.speed * float(root[0]),
            speed_min=self.speed * float(root[1]),
            angle_speed_max=float(angles[0]),
            angle_speed_min=float(angles[1]),
            offset=offset,
            error=doubt / spread if spread > 0.0 else 0.0,
        )

    def _polished(self, cell: Index, t: Array, s: Array) -> Array:
        """Local abscissas of extremes as roots of M* - ½ omega² dI*/dphi itself, not of its interpolant; ends stay."""
        rows = self.cycle.series[0, cell] - 0.5 * self.square * (1.0 + s)[:, None] * self.cycle.series[1, cell]
        ends = np.full_like(t, -1.0), np.ones_like(t)
        return np.where(np.abs(t) < 1.0, piecewise.newton(rows, t, *ends), t)

    def _angles(self, swing: _Swing) -> Array:
        """Angles of the extremes; the ends of cells are exact."""
        mesh, t = self.cycle.mesh, self._polished(swing.cell, swing.t, swing.s)
        edge = mesh.edges[swing.cell + (swing.t > 0.0)]
        return np.where(np.abs(swing.t) < 1.0, mesh.middle[swing.cell, 0] + mesh.half[swing.cell, 0] * t, edge)


def speed_over_cycle(cycle: Cycle, speed: float, motion: Run, phi: Array) -> Array:
    """Crank speed (rad/s) of a run at angles phi (rad); `speed` is the mean of extremes that it was found for.

    A run that brings its own cycle and speed is taken by these.
    """
    cycle, speed = motion.cycle or cycle, motion.speed or speed
    cell, t = cycle.where(phi)
    work, variation = cycle.at(cell, t)
    total = motion.inertia + cycle.inertia_at_start + variation
    s = (2 * motion.offset + 2 * work - speed**2 * variation) / (speed**2 * total)
    return np.asarray(speed * np.sqrt(np.maximum(1.0 + s, 0.0)))


def period(cycle: Cycle, speed: float, motion: Run, rtol: float) -> tuple[float, float]:
    """Time of one cycle (s), the integral of dphi/omega, and its estimated relative error; cells are halved as needed.

    What the energy may be off tells the more, the slower the machine: the level, and its rounding, by (w_a/omega)²; what
    the mean of extremes pins down by w_a/omega; both on the mean over time.
    """

    def evaluated(edges: Array) -> tuple[tuple[Array, Array, float, float], float, Coarse]:
        mesh = piecewise.cells(edges)
        slowness = 1.0 / speed_over_cycle(cycle, speed, motion, mesh.phi)
        total = float(piecewise.integral(slowness, mesh.half).sum())
        shares = piecewise.TAIL_OF_INTEGRAL * piecewise.tails(piecewise.fit(slowness)) * mesh.half[:, 0] / total
        missed = float(shares.sum())
        return (slowness, mesh.half, total, missed), missed, piecewise.above(shares, 0.1)

    first = cycle.mesh.edges
    slowness, half, total, missed = piecewise.refined(first, evaluated, rtol, max(_MOST_CELLS, 2 * first.size))
    slower = (motion.speed or speed) * slowness
    once, twice = (float(piecewise.integral(slowness * slower**n, half).sum()) / total for n in (1, 2))
    pinned = max(motion.error - 4.0 * motion.level_error, 0.0) * motion.irregularity
    doubt = pinned * once + (motion.level + _LEVEL_ROUNDING) * twice
    return total, missed + doubt + 24 * ROUNDING


# -- errors of angles -------------------------------------------------------------------------------------------------

_INSIDE = 1.0 - 1e-12  # of a cell: roots beyond it lie at its end


def error_of_crossings(cycle: Cycle, found: Crossings) -> float:
    """Error (rad) of the angles where M* crosses zero.

    Each is off by the error of M* over its slope; where it is the end of a cell the moment jumps through zero, or its zeros
    end, or the cycle does, and only rounding is left. What the cycle leaves over may move it as far as that is the work of
    the moment on the way.
    """
    error = _rounding(cycle) + _root_error(cycle, found.cell, found.t, np.zeros_like(found.t), 0.0)
    if not cycle.errors.residual or not found.t.size:
        return error
    phi, work = _at_nodes(cycle)[:2]
    beyond = 0.0
    for angle, accumulated in zip(found.angles(cycle.mesh), cycle.at(found.cell, found.t)[0], strict=True):
        far = phi[np.abs(work - accumulated) > cycle.errors.residual]
        before, after = far[far < angle], far[far > angle]
        ends = before.max(initial=0.0), after.min(initial=cycle.mesh.edges[-1])
        beyond = max(beyond, angle - ends[0], ends[1] - angle)
    return error + float(beyond)


def error_of_extremes(cycle: Cycle, motion: Run, *, sized: bool) -> float:
    """Error (rad) of the angles of extreme speed, roots of M* - ½ omega² dI*/dphi.

    `sized` where the speeds there are those asked for.
    """
    along = motion.cycle or cycle
    speeds = np.array([motion.speed_max, motion.speed_min])
    cell, t = along.where(np.array([motion.angle_speed_max, motion.angle_speed_min]))
    asked = sized and motion.inertia > 0.0 and motion.cycle is None
    loose = 0.0 if asked else 2 * motion.error * motion.irregularity * speeds.mean() / np.maximum(speeds, 1e-300)
    doubts = [_root_error(along, cell, t, 0.5 * speeds**2, loose)]
    rounding = 8 * ROUNDING * along.mesh.edges[-1] / along.mesh.half[cell, 0]  # of t, in narrow cells
    at_end = np.abs(t) >= _INSIDE - rounding
    for edge, speed in zip((cell + (t > 0.0))[at_end].tolist(), speeds[at_end].tolist(), strict=True):
        doubts.append(_end_error(along, edge, 0.5 * speed**2))
    return _rounding(cycle) + max(doubts) + _left_open(cycle, motion)


def _at_nodes(cycle: Cycle) -> tuple[Array, Array, Array]:
    """Angles (rad) that ascend over the cycle, W (J) and I* - I*(0) (kg m²) there."""
    count = cycle.mesh.half.size
    t = np.concatenate(([-1.0], np.sort(piecewise.NODES)))
    cell, t = np.repeat(np.arange(count), t.size), np.tile(t, count)
    return cycle.mesh.middle[cell, 0] + cycle.mesh.half[cell, 0] * t, *cycle.at(cell, t)


def _left_open(cycle: Cycle, motion: Run) -> float:
    """How far (rad) the angles of extreme speed may lie from those found, where the cycle leaves work over.

    What is left over, N, shifts kinetic energies by no more than itself, so that the greatest speed w is reached where
    (J + I*) (w² - omega²)/2 <= (1 + r) N, r the ratio of the greatest J + I* to the least; and the least speed likewise.
    """
    if not cycle.errors.residual:
        return 0.0
    phi, work, variation = _at_nodes(cycle)
    total = motion.inertia + cycle.inertia_at_start + variation
    mean = 0.5 * (motion.speed_max + motion.speed_min)
    energy = motion.offset + work + 0.5 * mean**2 * (total - variation)
    reach = (1.0 + float(total.max() / max(total.min(), 1e-300))) * cycle.errors.residual
    found = 0.0
    for speed, angle in ((motion.speed_max, motion.angle_speed_max), (motion.speed_min, motion.angle_speed_min)):
        near = np.abs(energy - 0.5 * speed**2 * total) <= reach
        near |= np.roll(near, 1) | np.roll(near, -1)  # between two angles
        apart = np.abs(phi[near] - angle)
        found = max(found, float(np.minimum(apart, cycle.mesh.edges[-1] - apart).max(initial=0.0)))
    return found


def _rounding(cycle: Cycle) -> float:
    return 4 * ROUNDING * float(cycle.mesh.edges[-1])


def _root_error(cycle: Cycle, cell: NDArray[np.intp], t: Array, factor: Array, loose: Array | float) -> float:
    """The same for roots in cells, at local abscissas; `loose` is the relative error of the factors."""
    half = cycle.mesh.half[cell, 0]
    rows = cycle.series[0, cell] - factor[:, None] * cycle.series[1, cell]
    slope = np.maximum(np.abs(piecewise.slope(rows, t)) / half, 1e-300)
    noise = cycle.noise[0, cell] + factor * cycle.noise[1, cell] + cycle.errors.work / cycle.mesh.edges[-1]
    noise = noise + loose * factor * np.abs(piecewise.value(cycle.series[1, cell], t))
    doubt = np.where(np.abs(t) < _INSIDE, np.minimum(noise / slope, 2 * half), 0.0)
    return float(doubt.max(initial=0.0))


def _end_error(cycle: Cycle, edge: int, factor: float) -> float:
    """The same for an extreme of speed at the end of a cell.

    None where M* - factor dI*/dphi jumps through zero there. Else a root lies beside the end, so near that the speed at
    both is the same but for rounding; or the function cannot be told from zero in whole cells around: it is their width.
    """
    count, widths = cycle.mesh.half.size, 2 * cycle.mesh.half[:, 0]
    rows = cycle.series[0] - factor * cycle.series[1]
    noise = cycle.noise[0] + factor * cycle.noise[1] + cycle.errors.work / cycle.mesh.edges[-1]
    beside, ends = np.array([edge - 1, edge % count]), np.array([1.0, -1.0])
    values = piecewise.value(rows[beside], ends)
    if (np.abs(values) > noise[beside]).all() and np.sign(values).sum() == 0.0:
        return 0.0
    slope = np.maximum(np.abs(piecewise.slope(rows[beside], ends)) / (0.5 * widths[beside]), 1e-300)
    near = float(np.minimum((np.abs(values) + noise[beside]) / slope, widths[beside]).min())
    quiet, widths = (np.roll(each, -edge) for each in (np.abs(rows).sum(axis=-1) <= noise, widths))
    ahead, back = (count if row.all() else int(np.argmin(row)) for row in (quiet, quiet[::-1]))
    return max(near, min(float(widths[:ahead].sum() + widths[count - back :].sum()), float(widths.sum())))
