"""Least values of functions with corners, under bounds and constraints: scipy's SLSQP, then linear programs over a bundle.

Figures of flywheels are greatest values less least ones, so that the best design often lies where two lobes are equal: in a
corner, at which methods for smooth functions stop short. There every tangent known nearby counts: the linear program

    min t  with  t >= f_i + grad f_i (x - x_i),  0 >= g_i + grad g_i (x - x_i),  |x - x_k| <= radius

goes to where tangents meet, and does so quadratically where as many meet as there are variables and one.

Source: D. Kraft, DFVLR-FB 88-28 (1988); R. Fletcher, E. Sainz de la Maza, Mathematical Programming 43 (1989), 235.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics.differences import FINE, gradient

Array = NDArray[np.float64]
Rows = Callable[[Array], Array]
"""At points (variables, points) the function and its constraints, to be 0 or below: (1 + constraints, points)."""

KEPT = 1e-9
"""How far a constraint, of the size of 1, may be above 0 and be kept."""
_PENALTY = 1e3  # of a constraint that is not kept, beside the function's own size
_REFUSED = 1e9  # what SLSQP sees where there is no value
_STEPS, _BUNDLE = 60, 60  # of SLSQP; of linear programs
_SMOOTH = 1e-13  # relative change at which SLSQP stops
_RADIUS, _LEAST, _MOST = 0.02, 1e-10, 0.25  # of the interval between bounds
_ENOUGH = 1e-13  # of the function: a gain that is none
_FINEST = 2.0**-28  # of a variable's scale, over which slopes are taken as the radius becomes small
_NEAR, _MANY = 8.0, 40  # radii within which a tangent counts; how many do


class Point(NamedTuple):
    """A point (shares of the interval between its bounds), the function and the constraints there, and their slopes."""

    x: Array
    rows: Array
    slopes: Array


def merit(rows: Array, size: float) -> Array:
    """The function (the first row), more by what constraints are not kept; infinite where there is none."""
    excess = np.maximum(rows[1:] - 0.5 * KEPT, 0.0).sum(axis=0)
    return np.where(np.isnan(rows).any(axis=0), np.inf, rows[0] + _PENALTY * size * excess)


def minimum(rows: Rows, start: Array, low: Array, high: Array, scales: Array) -> Array:
    """Where a function is least nearby: a point that is good beside all that were tried.

    Args:
        rows: the function and its constraints.
        start: where it is known, within the bounds.
        low: least values of the variables.
        high: greatest ones.
        scales: by what the variables change much.

    >>> def lobes(x):  # two lobes are equal on a line, on which the least value is at (0.75, 0.25)
    ...     return np.array([np.maximum(x[0], x[1] + 0.5) + (x[0] - 2 * x[1] - 0.25) ** 2, 1.0 - x.sum(axis=0)])
    >>> low, high = np.zeros(2), np.ones(2)
    >>> found = minimum(lobes, np.array([0.2, 0.9]), low, high, high)
    >>> np.round(found, 9).tolist()
    [0.75, 0.25]

    """
    width = high - low

    def at(share: Array, radius: float = 1.0) -> Point:
        x = np.clip(low + share * width, low, high)
        step = min(FINE, max(_FINEST, radius * FINE / _RADIUS))
        values, slopes = gradient(lambda columns: (rows(columns), np.zeros(1)), x, scales, step)
        return Point(np.clip(share, 0.0, 1.0), values, slopes * width)

    first = at((start - low) / width)
    size = abs(first.rows[0]) or 1.0
    best = _bundle(at, _smooth(at, first, size), size)
    return np.asarray(np.clip(low + best.x * width, low, high))


def _smooth(at: Callable[[Array], Point], first: Point, size: float) -> Point:
    """The best point that SLSQP comes to."""
    from scipy.optimize import minimize

    tried: dict[bytes, Point] = {first.x.tobytes(): first}
    best = first

    def known(x: Array) -> Point:
        nonlocal best
        key = np.clip(x, 0.0, 1.0).tobytes()
        if key not in tried:
            tried[key] = found = at(x)
            if merit(found.rows, size) < merit(best.rows, size):
                best = found
        return tried[key]

    def held(j: int) -> dict[str, Any]:
        return {
            "type": "ineq",
            "fun": lambda x: np.nan_to_num(-known(x).rows[j], nan=-_REFUSED),
            "jac": lambda x: np.nan_to_num(-known(x).slopes[j]),
        }

    wanted: Any = {
        "jac": lambda x: np.nan_to_num(known(x).slopes[0] / size),
        "bounds": [(0.0, 1.0)] * len(first.x),
        "constraints": [held(j) for j in range(1, len(first.rows))],
        "method": "SLSQP",
        "options": {"maxiter": _STEPS, "ftol": _SMOOTH},
    }

    def aim(x: Array) -> float:
        return float(np.nan_to_num(known(x).rows[0] / size, nan=_REFUSED))

    minimize(aim, first.x, **wanted)
    return best


def _bundle(at: Callable[..., Point], point: Point, size: float) -> Point:
    """The best point that linear programs over tangents come to."""
    tangents, radius = [point], _RADIUS
    for _ in range(_BUNDLE):
        near = [other for other in tangents if np.abs(other.x - point.x).max() <= _NEAR * radius][-_MANY:]
        step, gain = _program(point, near, radius, size)
        won = -1.0
        if step is not None and gain > _ENOUGH * size:
            trial = at(point.x + step, radius)
            tangents.append(trial)
            won = float(merit(point.rows, size) - merit(trial.rows, size))
        if won > 0.1 * gain:
            radius = min(2.0 * radius, _MOST) if step is not None and np.abs(step).max() > 0.9 * radius else radius
        else:
            radius *= 0.25
        if won > 0.0:
            point = trial
        else:  # slopes over a smaller step, as a corner may be within the one before
            tangents = [other for other in tangents if not np.array_equal(other.x, point.x)]
            point = at(point.x, radius)
            tangents.append(point)
        if radius < _LEAST:
            break
    return point


def _program(point: Point, near: list[Point], radius: float, size: float) -> tuple[Array | None, float]:
    """The best step as tangents have it, and by how much the merit falls on it; None where there is none."""
    from scipy.optimize import linprog

    count, many = len(point.x), len(point.rows) - 1
    matrix, right = [], []
    for other in near:
        if not np.isfinite(other.rows).all() or not np.isfinite(other.slopes).all():
            continue
        there = other.rows + other.slopes @ (point.x - other.x)
        there = np.minimum(there, point.rows)  # tangents of a function that is not convex may lie above it
        matrix.append([*other.slopes[0] / size, -1.0, *[0.0] * many])
        right.append((point.rows[0] - there[0]) / size)
        for j in range(many):
            row = [0.0] * many
            row[j] = -1.0
            matrix.append([*other.slopes[1 + j], 0.0, *row])
            right.append(-there[1 + j])
    if not matrix:
        return None, 0.0
    bounds = [(max(-radius, -x), min(radius, 1.0 - x)) for x in point.x.tolist()]
    found = linprog(
        [*[0.0] * count, 1.0, *[_PENALTY] * many],
        A_ub=np.array(matrix),
        b_ub=np.array(right),
        bounds=[*bounds, (None, None), *[(0.0, None)] * many],
        method="highs",
    )
    if found.x is None:
        return None, 0.0
    before = float(np.maximum(point.rows[1:], 0.0).sum()) * _PENALTY
    return np.asarray(found.x[:count]), (before - float(found.fun or 0.0)) * size
