"""Proven bounds of a linkage's variables, influence coefficients and slopes over a whole stretch of its driver.

The argument is that of `flywheel.linkage.continuation`, about the middle of each stretch: where the followed assembly is
the only one near the tangent, its variables stay in a ball about that, and the Jacobian's variation bounds the rest.
Stretches that are too wide for the proof get bounds without end, which makes whoever asks cut them. Rounding is covered by
a flat share of 1e-12, not proven.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.linkage.lifts import WINDOW
from flywheel.linkage.newton import inverse
from flywheel.linkage.solution import Solution

Array = NDArray[np.float64]

_SHARED = 0.3  # units: how far a displacement may go within a stretch that can be proven
_ROUNDING = 1e-12


class Enclosure(NamedTuple):
    """Middle and reach to both sides of all (scaled) variables, rates and slopes, each of shape (n, variables)."""

    z: Array
    z_reach: Array
    rate: Array
    rate_reach: Array
    slope: Array
    slope_reach: Array


def enclosed(solution: Solution, low: Array, high: Array) -> Enclosure:
    """Bounds over stretches [low, high] of the driver's coordinate (rad or m), shape (n,)."""
    scale = solution.scale
    middle, half = 0.5 * (low + high), 0.5 * np.abs(high - low) / scale
    z, rate, slope = solution.movement(middle)
    equations = solution.equations
    if z.shape[1] == 1:
        nothing = np.zeros_like(z)
        return Enclosure(z, half[:, None] + nothing, rate, nothing, slope, nothing)
    bases = equations.bases(z)
    size = np.abs(inverse(equations.jacobian(z, bases)[:, :, 1:]))
    reach = np.abs(bases.whole) + _SHARED * equations.sliding
    ball = np.ones_like(z)
    ball[:, 0] = 0.0

    def bound(*steps: Array) -> Array:
        """Largest effect on an unknown of the equations' change along the steps, shape (n,)."""
        return np.asarray(np.einsum("nij,nj->ni", size, equations.bound(z, reach, *steps)).max(axis=1))

    t, d = half[:, None], np.abs(rate)
    radius, shrink = _ball(half, bound(d, ball), bound(ball, ball), bound(d, d))
    moved = t * d + np.where(ball > 0.0, radius[:, None], 0.0)
    proven = (moved[:, 1:].max(axis=1) <= _SHARED) & (equations.turned(moved) <= WINDOW)
    proven &= half <= _SHARED if solution.linkage.sliding else True
    moved = np.where(proven[:, None], moved, 0.0)
    drift = np.where(proven, bound(moved, d) / shrink, 0.0)[:, None] * ball
    again = np.zeros_like(z)
    again[:, 1:] = np.abs(slope[:, 1:])
    bend = bound(moved, d, d) + 2 * bound(drift, d) + bound(drift, drift) + bound(moved, again)
    moved[:, 0] = half
    reaches = [moved, drift, (bend / shrink)[:, None] * ball]
    for values, widths in zip((z, rate, slope), reaches, strict=True):
        widths[~proven, 1:] = np.inf
        widths += _ROUNDING * (1.0 + np.abs(values))
    return Enclosure(z, moved, rate, drift, slope, reaches[2])


def _ball(t: Array, along: Array, across: Array, bent: Array) -> tuple[Array, Array]:
    """Radius about the tangent that Newton's map keeps, and 1 - kappa; NaN radius made infinite where there is none."""
    room = 1.0 - t * along
    beta = 0.5 * t**2 * bent + _ROUNDING
    square = room**2 - 4.0 * across * beta
    good = (room > 0.0) & (square > 0.0)
    radius = np.where(good, 2.0 * beta / (room + np.sqrt(np.where(good, square, 1.0))), np.inf)
    shrink = np.where(good, room - np.where(good, radius, 0.0) * across, 1.0)
    return np.where(shrink > 0.0, radius, np.inf), np.where(shrink > 0.0, shrink, 1.0)
