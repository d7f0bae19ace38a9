"""How far the angles of a cycle can be trusted: where the moment crosses zero, where the speed is greatest and least."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flywheel import piecewise
from flywheel.piecewise import ROUNDING, Crossings
from flywheel.regime import Cycle
from flywheel.steady import Run

Array = NDArray[np.float64]

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
    at_end = np.abs(t) >= _INSIDE
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
