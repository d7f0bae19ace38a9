"""Speed over a steady cycle for a given inertia: from the energy, in closed form, at the mean of extremes asked for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import piecewise, regime
from flywheel.machine import Machine
from flywheel.piecewise import ORDER, ROUNDING
from flywheel.regime import Cycle

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
    least = regime.combined(cycle, np.array([[1.0, 0.0], [0.0, 1.0]]))[0].least
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
    found = run(cycle, speed, inertia)
    for _ in range(10):
        finer = None if found.error <= rtol else regime.split(cycle, found.speed_max, rtol / found.error)
        if finer is None:
            break
        cycle = regime.resolve(machine, finer)
        found = run(cycle, speed, inertia)
    return cycle, found


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
    mesh = cycle.mesh
    most = max(_MOST_CELLS, mesh.edges.size)
    for _ in range(40):
        pace = 1.0 / speed_over_cycle(cycle, speed, motion, mesh.phi)
        total = float(piecewise.integral(pace, mesh.half).sum())
        shares = piecewise.TAIL_OF_INTEGRAL * piecewise.tails(piecewise.fit(pace)) * mesh.half[:, 0] / total
        chosen = shares > 0.1 * rtol / shares.size
        if shares.sum() <= rtol or not chosen.any() or mesh.edges.size > most:
            break
        mesh = piecewise.cells(piecewise.bisected(mesh.edges, chosen))
    slower = (motion.speed or speed) * pace
    once, twice = (float(piecewise.integral(pace * slower**n, mesh.half).sum()) / total for n in (1, 2))
    pinned = max(motion.error - 4.0 * motion.level_error, 0.0) * motion.irregularity
    doubt = pinned * once + (motion.level + _LEVEL_ROUNDING) * twice
    return total, float(shares.sum()) + doubt + 24 * ROUNDING
