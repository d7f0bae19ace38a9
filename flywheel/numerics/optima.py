"""Least values of functions with corners, under bounds and constraints: SLSQP, linear programs over a bundle, curved steps.

Figures of flywheels are greatest values less least ones, so that the best design often lies where two lobes are equal: in a
corner, at which methods for smooth functions stop short. There all known tangents nearby are used: the linear program

    min t  with  t >= f_i + grad f_i (x - x_i),  0 >= g_i + grad g_i (x - x_i),  |x - x_k| <= radius

leads to the intersection of tangents, and converges quadratically if one more of them meet than there are variables. Where
fewer meet, on a ridge that is curved (the mass of a counterweight times its distance), its straight steps leave the ridge.
There each piece of the function is taken with its Hessian,

    min t  with  t >= f_i + grad f_i (x - x_i) + (x - x_i)' H_i (x - x_i)/2,

which is Newton's method if there is only one piece. The test of a local minimum is the linear program over tangents at
points around it, from separate differences: a step of a radius r gains slope r, and nothing where no combination of
tangents, constraints and bounds leaves a descent (F. Clarke's stationary points).

Derivatives of many figures at once: central differences of steps h, h/2, h/4 and so on are a series in even powers of h
where a function is smooth; Richardson's extrapolation removes these one by one. The difference of the slopes on both sides
is extrapolated too: it is zero except where the function has a corner. Steps are made smaller until corners and poles nearby
are beyond them.

Source: D. Kraft, DFVLR-FB 88-28 (1988); R. Fletcher, E. Sainz de la Maza, Mathematical Programming 43 (1989), 235; J. Burke,
A. Lewis, M. Overton, SIAM Journal on Optimization 15 (2005), 751; R. Fletcher, Practical Methods of Optimization (1987);
C. Ridders, Advances in Engineering Software 4 (1982), 75; W. Press et al., Numerical Recipes, 5.7.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = Callable[[Array], tuple[Array, Array]]
"""Figures and their absolute errors, both of shape (figures, points), at points of shape (variables, points)."""

_LARGEST = 2.0**-6  # of a variable's scale: the largest step
_LEVELS, _GROUPS = 3, 6  # steps halved in one go, and how often
_DEPTH = 5  # of extrapolations
_CENTRAL, _SIDE, _CORNER = (2, 4, 6, 8, 10), (1, 2, 3, 4, 5), (1, 3, 5, 7, 9)  # powers of the step
_ENOUGH, _NEGLIGIBLE = 1e-9, 1e-10  # of a derivative; of a figure over the variable's scale
_CERTAIN_SLOPE, _VISIBLE = 10.0, 1e-7  # of a corner: beside its error, and beside the derivative
_STILL = 0.5  # of a change over a step: what is left of it over a quarter of that step, where the figure jumps
FINE = 2.0**-20  # of a variable's scale: the step of `gradient`


class FigureSlopes(NamedTuple):
    """Derivatives of figures and their absolute errors, each of shape (figures, variables); NaN if there is none.

    `both` holds on both sides; `left` and `right` are those of one side each, wanted if there is a `corner` in between, a
    `jump`, or points of one side that have no value.
    """

    values: Array
    both: Array
    error: Array
    left: Array
    left_error: Array
    right: Array
    right_error: Array
    corner: NDArray[np.bool_]
    jump: NDArray[np.bool_]
    step: Array


def slopes(values: Values, x: Array, scales: Array, most: int = _GROUPS) -> FigureSlopes:
    """Derivatives of figures by each variable, to about 1e-9 where errors of the figures allow it.

    D(h) = (f(x + h) - f(x - h))/2h = f' + c2 h² + c4 h⁴ + ...,   corner(h) = (f(x + h) - 2 f(x) + f(x - h))/h

    Args:
        values: the figures, with their errors; NaN if there are none.
        x: where, shape (variables,).
        scales: significant changes of the variables, above 0; the largest step is a 64th of them.
        most: number of times that three more steps may be tried, each half as long as the previous one.

    >>> def values(x):
    ...     return np.stack([np.exp(x[0]), np.maximum(x[0], 0.0)]), np.full((2, x.shape[1]), 1e-16)
    >>> slope = slopes(values, np.array([0.0]), np.array([1.0]))
    >>> bool(abs(slope.both[0, 0] - 1.0) < slope.error[0, 0] < 1e-9)
    True
    >>> slope.corner[:, 0].tolist(), [float(side[1, 0]) for side in (slope.left, slope.right)]
    ([False, True], [0.0, 1.0])

    """
    count = len(x)
    units = _LARGEST * 2.0 ** np.round(np.log2(scales))
    steps = units[:, None] * 2.0 ** -np.arange(_LEVELS * most)
    at, error = values(x[:, None])
    figures = len(at)
    centre, centre_error = at[:, 0], error[:, 0]
    shape = (figures, count, _LEVELS * most)
    plus, minus, noise = (np.full(shape, np.nan) for _ in range(3))
    best: list[tuple[Array, Array]] = []
    pending, before = np.arange(count), np.full((figures, count), np.inf)
    for group in range(most):
        levels = np.arange(_LEVELS * group, _LEVELS * (group + 1))
        _fill(values, x, steps, pending, levels, (plus, minus, noise))
        tried = _LEVELS * (group + 1)
        h = steps[None, :, :tried]
        best = _extrapolated(centre, centre_error, plus[..., :tried], minus[..., :tried], noise[..., :tried], h)
        (both, wrong), (corner, doubt) = best[0], best[3]
        base = _size(centre, plus, minus) / scales
        enough = wrong + doubt <= np.maximum(_ENOUGH * np.abs(both), _NEGLIGIBLE * base)
        smooth = np.abs(corner) <= np.maximum(_CERTAIN_SLOPE * doubt, _NEGLIGIBLE * base)
        helped = (wrong + doubt < 0.5 * before) | ~smooth
        finite = np.isfinite(centre)[:, None] & np.ones(count, dtype=bool)
        open_ = ((finite & ~(enough & smooth)) & (helped | (group < 1))).any(axis=0)
        pending, before = np.flatnonzero(open_), np.fmin(before, wrong + doubt)
        if not pending.size:
            break
    return _judged(centre, centre_error, scales, best, plus, minus, noise, steps)


def gradient(values: Values, x: Array, scales: Array, step: float = FINE) -> tuple[Array, Array]:
    """Figures, and their derivatives (figures, variables) by one small step to each side that has values.

    Accurate to about 1e-6; within a step (a share of the scales) of a corner a mean of the slopes of both pieces.
    """
    steps = step * 2.0 ** np.round(np.log2(scales))
    moved = np.diag(steps)
    points = x[:, None] + np.concatenate([np.zeros((len(x), 1)), moved, -moved], axis=1)
    figures, _ = values(points)
    centre, plus, minus = figures[:, :1], figures[:, 1 : len(x) + 1], figures[:, len(x) + 1 :]
    right, left = (plus - centre) / steps, (centre - minus) / steps
    slope = 0.5 * (right + left)
    return centre[:, 0], np.where(np.isnan(slope), np.where(np.isnan(right), left, right), slope)


def _fill(
    values: Values, x: Array, steps: Array, variables: NDArray[np.intp], levels: NDArray[np.intp], kept: Sequence[Array]
) -> None:
    """The figures on both sides at some steps of some variables."""
    plus, minus, noise = kept
    columns = np.repeat(x[:, None], 2 * variables.size * levels.size, axis=1)
    grid = np.arange(columns.shape[1]).reshape(2, variables.size, levels.size)
    for i, variable in enumerate(variables):
        h = steps[variable, levels]
        columns[variable, grid[0, i]] += h
        columns[variable, grid[1, i]] -= h
    figures, error = values(columns)
    figures, error = figures.reshape(len(figures), *grid.shape), error.reshape(len(error), *grid.shape)
    where = np.ix_(np.arange(len(figures)), variables, levels)
    plus[where], minus[where], noise[where] = figures[:, 0], figures[:, 1], np.fmax(error[:, 0], error[:, 1])


def _extrapolated(
    centre: Array, error: Array, plus: Array, minus: Array, noise: Array, h: Array
) -> list[tuple[Array, Array]]:
    """The derivative, that to the right, that to the left, and the corner between these, each with its error."""
    middle, wrong = centre[:, None, None], error[:, None, None]
    of_side = (noise + wrong) / h
    return [
        _limit((plus - minus) / (2 * h), noise / h, _CENTRAL),
        _limit((plus - middle) / h, of_side, _SIDE),
        _limit((middle - minus) / h, of_side, _SIDE),
        _limit((plus - 2 * middle + minus) / h, 2 * of_side, _CORNER),
    ]


def _limit(row: Array, noise: Array, powers: Sequence[int]) -> tuple[Array, Array]:
    """The limit of sequences over halved steps (the last axis) that are series in some powers of the step, and its error."""
    best, least = np.full(row.shape[:-1], np.nan), np.full(row.shape[:-1], np.inf)
    columns, noises = [row], [noise]
    for power in powers[:_DEPTH]:
        factor = 2.0**power - 1.0
        last, loud = columns[-1], noises[-1]
        if last.shape[-1] < 2:
            break
        fine, coarse = last[..., 1:], last[..., :-1]
        new = fine + (fine - coarse) / factor
        spread = ((factor + 1.0) * loud[..., 1:] + loud[..., :-1]) / factor
        error = np.maximum(np.abs(new - fine), np.abs(new - coarse)) + spread
        for k in range(new.shape[-1]):
            better = error[..., k] < least
            best, least = np.where(better, new[..., k], best), np.where(better, error[..., k], least)
        columns.append(new)
        noises.append(spread)
    return best, least


def _size(centre: Array, plus: Array, minus: Array) -> Array:
    """The sizes of the figures around a point, shape (figures, variables)."""
    around = np.fmax(np.fmax.reduce(np.abs(plus), axis=-1), np.fmax.reduce(np.abs(minus), axis=-1))
    return np.asarray(np.fmax(np.abs(centre)[:, None], np.nan_to_num(around)))


def _judged(
    centre: Array,
    error: Array,
    scales: Array,
    best: list[tuple[Array, Array]],
    plus: Array,
    minus: Array,
    noise: Array,
    steps: Array,
) -> FigureSlopes:
    """Derivatives where they exist: on both sides, on one, on neither."""
    (both, wrong), (right, of_right), (left, of_left), (corner, doubt) = best
    base = _size(centre, plus, minus) / scales
    size = np.fmax(np.abs(both), 1e-2 * base)
    bent = (np.abs(corner) > _CERTAIN_SLOPE * doubt) & (np.abs(corner) > _VISIBLE * size)
    jumps_right = _jumps(plus - centre[:, None, None], noise + error[:, None, None])
    jumps_left = _jumps(centre[:, None, None] - minus, noise + error[:, None, None])
    nothing = _size(centre, plus, minus) <= np.fmax(error[:, None], np.nan_to_num(np.fmax.reduce(noise, axis=-1)))
    settled = np.isfinite(both) & (nothing | (wrong + doubt <= 1e-2 * np.fmax(np.abs(both), base)))
    jump = (jumps_right | jumps_left) & ~settled
    lost = ~settled & ~bent
    right = np.where(jumps_right & lost | (of_right > np.fmax(np.abs(right), base)), np.nan, right)
    left = np.where(jumps_left & lost | (of_left > np.fmax(np.abs(left), base)), np.nan, left)
    good = settled & ~bent
    reached = np.where(np.isnan(plus) & np.isnan(minus), np.nan, steps[None])
    return FigureSlopes(
        values=centre,
        both=np.where(good, both, np.nan),
        error=np.where(good, wrong + 0.5 * (np.abs(corner) + doubt), np.nan),
        left=left,
        left_error=np.where(np.isnan(left), np.nan, of_left),
        right=right,
        right_error=np.where(np.isnan(right), np.nan, of_right),
        corner=bent & ~jump,
        jump=jump,
        step=np.nanmin(reached, axis=(0, 2), initial=np.inf),
    )


def _jumps(change: Array, noise: Array) -> NDArray[np.bool_]:
    """Tests whether a change over a step does not shrink with the step: over the smallest steps, and over those before."""
    finite = np.isfinite(change).any(axis=-1)
    result = np.zeros(finite.shape, dtype=bool)
    for index in zip(*np.nonzero(finite), strict=True):
        own, loud = np.abs(change[index]), noise[index]
        own, loud = own[np.isfinite(own)], loud[np.isfinite(own)]
        if own.size > _LEVELS:
            result[index] = own[-1] > _STILL * own[-3] and own[-1] > 10.0 * loud[-1]
    return result


Rows = Callable[[Array], Array]
"""At points (variables, points) the function and its constraints, to be 0 or below: (1 + constraints, points)."""

KEPT = 1e-9
"""Excess of a constraint, of the size of 1, over 0 with which it counts as kept."""
_PENALTY = 1e3  # of a violated constraint, relative to the function's own size
_NO_VALUE = 1e9  # value for SLSQP if there is none
_STEPS, _BUNDLE = 60, 60  # of SLSQP; of linear programs
_SLSQP_CHANGE = 1e-13  # relative change at which SLSQP stops
_RADIUS, _LEAST_RADIUS, _GREATEST_RADIUS = 0.02, 1e-10, 0.25  # of the interval between bounds
_LEAST_GAIN = 1e-13  # of the function: a smaller gain is rounding
_FINEST = 2.0**-28  # of a variable's scale, over which slopes are taken as the radius becomes small
_TANGENT_RADII, _MANY = 8.0, 40  # radii within which a tangent counts; how many do
_WEIGHT, _TANGENT_DIFFERENCE = 1e-6, 1e-3  # of a tangent that decides a step; relative difference of tangents of one piece
_CURVED = 40  # steps along ridges
_AWAY, _STEP = 1e-3, 1.25e-4  # shares of the interval: from a corner to where a piece is taken; over which it is
_NEARBY, _TANGENT_STEP, _BESIDE = 2e-5, 1e-7, 0.02  # radius of tangents around a point; their steps; radii beside corners
_CERTAIN = 0.5  # of the gain predicted by a program: least real gain that confirms it
STATIONARY = 2e-5
"""Up to which slope of `descent` a function counts as least at a point."""


class TrialPoint(NamedTuple):
    """A point (shares of the interval between its bounds), the function and the constraints there, and their slopes.

    `curvature` are their Hessians by rows, if known.
    """

    x: Array
    rows: Array
    slopes: Array
    curvature: Array | None = None

    def at(self, x: Array) -> tuple[Array, Array]:
        """Values and slopes at another point, to the second order."""
        assert self.curvature is not None
        step = x - self.x
        bend = self.curvature @ step
        return self.rows + (self.slopes + 0.5 * bend) @ step, self.slopes + bend


def merit(rows: Array, size: float) -> Array:
    """The function (the first row) plus the violations of the constraints; infinite if there is none."""
    excess = np.maximum(rows[1:] - 0.5 * KEPT, 0.0).sum(axis=0)
    return np.where(np.isnan(rows).any(axis=0), np.inf, rows[0] + _PENALTY * size * excess)


class _Terrain(NamedTuple):
    """A function and its constraints over shares of the intervals between bounds; slopes are those by shares."""

    rows: Rows
    low: Array
    high: Array
    scales: Array

    def values(self, shares: Array) -> Array:
        """The values at points (variables, points), each within the bounds."""
        low, high = self.low[:, None], self.high[:, None]
        return self.rows(np.clip(low + np.clip(shares, 0.0, 1.0) * (high - low), low, high))

    def at(self, share: Array, radius: float = 1.0) -> TrialPoint:
        """A point with slopes by differences as small as a radius requires; beyond the bounds if necessary."""
        width = self.high - self.low
        x = np.clip(self.low + share * width, self.low, self.high)
        step = min(FINE, max(_FINEST, radius * FINE / _RADIUS))
        values, slopes = gradient(lambda columns: (self.rows(columns), np.zeros(1)), x, self.scales, step)
        return TrialPoint(np.clip(share, 0.0, 1.0), values, slopes * width)

    def tangent(self, share: Array, *, in_corner: bool = True) -> TrialPoint:
        """A point with slopes by small differences within the bounds; NaN if these mix pieces, unless they may."""
        moved = np.where(share + _TANGENT_STEP <= 1.0, _TANGENT_STEP, -_TANGENT_STEP)
        # within the bounds, if need be on one side
        back = np.where((share >= _TANGENT_STEP) & (moved > 0.0), -_TANGENT_STEP, 0.5 * moved)
        figures = self.values(np.array([share, *(share + np.diag(moved)), *(share + np.diag(back))]).T)
        changes = figures[:, 1:].reshape(len(figures), 2, -1) - figures[:, :1, None]
        there, other = changes[:, 0] / moved, changes[:, 1] / back
        mixed = np.abs(there - other).max(axis=1) > _TANGENT_DIFFERENCE * np.abs(there).max(axis=1)
        return TrialPoint(share, figures[:, 0], np.where((mixed & (not in_corner))[:, None], np.nan, 0.5 * (there + other)))

    def piece(self, share: Array) -> TrialPoint | None:
        """A function's piece around a point, to the second order; None if a value is missing."""
        h, count = _STEP, len(share)
        share = np.clip(share, h, 1.0 - h)
        step = h * np.eye(count)
        pairs = [(i, j) for i in range(count) for j in range(i)]
        both = np.array([step[i] + step[j] for i, j in pairs]).reshape(-1, count)
        moved = np.concatenate([np.zeros((1, count)), step, -step, both, -both])
        figures = self.values(share[:, None] + moved.T)
        if not np.isfinite(figures).all():
            return None
        middle, plus, minus = figures[:, :1], figures[:, 1 : count + 1], figures[:, count + 1 : 2 * count + 1]
        curvature = np.zeros((len(figures), count, count))
        curvature[:, range(count), range(count)] = (plus - 2 * middle + minus) / h**2
        twice = figures[:, 2 * count + 1 :].reshape(len(figures), 2, -1).sum(axis=1)
        for k, (i, j) in enumerate(pairs):
            others = plus[:, i] + minus[:, i] + plus[:, j] + minus[:, j]
            curvature[:, i, j] = curvature[:, j, i] = (twice[:, k] + 2 * middle[:, 0] - others) / (2 * h**2)
        return TrialPoint(share, middle[:, 0], (plus - minus) / (2 * h), curvature)


def minimum(rows: Rows, start: Array, low: Array, high: Array, scales: Array) -> Array:
    """A point nearby where a function is least: no other point that was tried is better.

    Args:
        rows: the function and its constraints.
        start: where it is known, within the bounds.
        low: least values of the variables.
        high: greatest ones.
        scales: significant changes of the variables.

    >>> def lobes(x):  # two lobes are equal on a line, on which the least value is at (0.75, 0.25)
    ...     return np.array([np.maximum(x[0], x[1] + 0.5) + (x[0] - 2 * x[1] - 0.25) ** 2, 1.0 - x.sum(axis=0)])
    >>> low, high = np.zeros(2), np.ones(2)
    >>> place = minimum(lobes, np.array([0.2, 0.9]), low, high, high)
    >>> np.round(place, 9).tolist()
    [0.75, 0.25]
    >>> def ridge(x):  # a ridge along x y = 0.3, on which it falls towards greater x: up to the bound
    ...     return (abs(x[0] * x[1] - 0.3) - 0.01 * x[0])[None]
    >>> np.round(minimum(ridge, np.array([0.5, 0.9]), low, high, high), 7).tolist()
    [1.0, 0.3]

    """
    terrain = _Terrain(rows, low, high, scales)
    first = terrain.at((start - low) / (high - low))
    size = abs(first.rows[0]) or 1.0
    best = _bundle(terrain.at, _smooth(terrain.at, first, size), size)
    best = _along_ridges(terrain, best, size)
    return np.asarray(np.clip(low + best.x * (high - low), low, high))


def descent(rows: Rows, x: Array, low: Array, high: Array, seed: int = 0) -> float:
    """The steepest descent of a function from a point: 0 except for errors of differences at a local minimum.

    Args:
        rows: the function and its constraints.
        x: where.
        low: least values of the variables.
        high: greatest ones.
        seed: of the points around it.

    Returns: gain per share of the intervals between bounds, over the function's size and slopes there.

    >>> def ridge(x):
    ...     return (abs(x[0] * x[1] - 0.3) - 0.01 * x[0])[None]
    >>> low, high = np.zeros(2), np.ones(2)
    >>> descent(ridge, np.array([0.5, 0.6]), low, high) > STATIONARY
    True
    >>> descent(ridge, np.array([1.0, 0.3]), low, high) > STATIONARY
    False

    """
    own = rows(x[:, None])
    kept = np.where(np.arange(len(own))[:, None] > 0, np.clip(own, 0.0, KEPT), 0.0)  # a constraint may be above 0 by that
    terrain = _Terrain(lambda columns: rows(columns) - kept, low, high, high - low)
    share = (x - low) / (high - low)
    point, random = terrain.tangent(share), np.random.default_rng([seed, 2])
    size = abs(point.rows[0]) or 1.0
    wide, close = (_descent(terrain, point, radius, size, random)[0] for radius in (_NEARBY, 0.25 * _NEARBY))
    falls = close if close > 0.5 * wide else (4.0 * close - wide) / 3.0  # with the radius, as far as it comes from curvature
    return float(max(falls, 0.0))


def _smooth(at: Callable[[Array], TrialPoint], first: TrialPoint, size: float) -> TrialPoint:
    """The best point of SLSQP."""
    from scipy.optimize import minimize

    tried: dict[bytes, TrialPoint] = {first.x.tobytes(): first}
    best = first

    def point_at(x: Array) -> TrialPoint:
        nonlocal best
        key = np.clip(x, 0.0, 1.0).tobytes()
        if key not in tried:
            tried[key] = point = at(x)
            if merit(point.rows, size) < merit(best.rows, size):
                best = point
        return tried[key]

    def limit(j: int) -> dict[str, Any]:
        return {
            "type": "ineq",
            "fun": lambda x: np.nan_to_num(-point_at(x).rows[j], nan=-_NO_VALUE),
            "jac": lambda x: np.nan_to_num(-point_at(x).slopes[j]),
        }

    options: Any = {
        "jac": lambda x: np.nan_to_num(point_at(x).slopes[0] / size),
        "bounds": [(0.0, 1.0)] * len(first.x),
        "constraints": [limit(j) for j in range(1, len(first.rows))],
        "method": "SLSQP",
        "options": {"maxiter": _STEPS, "ftol": _SLSQP_CHANGE},
    }

    def aim(x: Array) -> float:
        return float(np.nan_to_num(point_at(x).rows[0] / size, nan=_NO_VALUE))

    minimize(aim, first.x, **options)
    return best


def _bundle(
    at: Callable[..., TrialPoint], point: TrialPoint, size: float, radius: float = _RADIUS, least: float = _LEAST_RADIUS
) -> TrialPoint:
    """The best point that linear programs over tangents reach, from a first radius down to a least one."""
    tangents = [point]
    for _ in range(_BUNDLE):
        near = [other for other in tangents if np.abs(other.x - point.x).max() <= _TANGENT_RADII * radius][-_MANY:]
        step, gain, _ = _program(point, near, radius, size)
        won = -1.0
        if step is not None and gain > _LEAST_GAIN * size:
            trial = at(point.x + step, radius)
            tangents.append(trial)
            won = float(merit(point.rows, size) - merit(trial.rows, size))
        if won > 0.1 * gain:
            radius = (
                min(2.0 * radius, _GREATEST_RADIUS) if step is not None and np.abs(step).max() > 0.9 * radius else radius
            )
        else:
            radius *= 0.25
        if won > 0.0:
            point = trial
        else:  # slopes over a smaller step, as a corner may be within the one before
            tangents = [other for other in tangents if not np.array_equal(other.x, point.x)]
            point = at(point.x, radius)
            tangents.append(point)
        if radius < least:
            break
    return point


def _program(
    point: TrialPoint, near: list[TrialPoint], radius: float, size: float
) -> tuple[Array | None, float, list[TrialPoint]]:
    """The best step by the tangents, the decrease of the merit by it, and the tangents that decide it.

    The step is None if there is none.
    """
    from scipy.optimize import linprog

    count, many = len(point.x), len(point.rows) - 1
    matrix, right, used = [], [], []
    for other in near:
        if not np.isfinite(other.rows).all() or not np.isfinite(other.slopes).all():
            continue
        used.append(other)
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
        return None, 0.0, []
    bounds = [(max(-radius, -x), min(radius, 1.0 - x)) for x in point.x.tolist()]
    optimum = linprog(
        [*[0.0] * count, 1.0, *[_PENALTY] * many],
        A_ub=np.array(matrix),
        b_ub=np.array(right),
        bounds=[*bounds, (None, None), *[(0.0, None)] * many],
        method="highs",
    )
    if optimum.x is None:
        return None, 0.0, []
    before = float(np.maximum(point.rows[1:], 0.0).sum()) * _PENALTY
    weights = -optimum.ineqlin.marginals.reshape(len(used), 1 + many)
    active = [other for other, own in zip(used, weights, strict=True) if own.max() > _WEIGHT]
    return np.asarray(optimum.x[:count]), (before - float(optimum.fun or 0.0)) * size, active


# -- ridges that are curved --------------------------------------------------------------------------------------------


def _descent(
    terrain: _Terrain, point: TrialPoint, radius: float, size: float, random: np.random.Generator
) -> tuple[float, list[TrialPoint]]:
    """The steepest descent of a function within a radius, by tangents at points around, and those that meet at the point.

    A slope is the decrease per share of the intervals between bounds, over the function's own size there.
    Tangents are taken a little beside the points that programs give: these lie in corners, where differences mix pieces.
    """
    count = len(point.x)
    shares = point.x + radius * random.uniform(-1.0, 1.0, (2 * count + 2, count))
    near = [terrain.tangent(share) for share in np.clip(shares, 0.0, 1.0)]
    slopes = [np.abs(other.slopes[0]).max() for other in near if np.isfinite(other.slopes).all()]
    own = max([size, *slopes])
    active, gain, most = list[TrialPoint](), 0.0, 0.0
    for _ in range(4 * count + 8):
        step, gain, active = _program(point, near, radius, size)
        if step is None or gain <= 0.5 * STATIONARY * radius * own:
            break
        trial = point.x + step + _BESIDE * radius * random.uniform(-1.0, 1.0, count)
        near.append(terrain.tangent(np.clip(trial, 0.0, 1.0), in_corner=False))
        if np.isnan(near[-1].rows).any():
            break
        most = max(most, float(merit(point.rows, size) - merit(near[-1].rows, size)))
        if most > _CERTAIN * gain:
            break
    return max(gain, most) / radius / own, active


def _along_ridges(terrain: _Terrain, point: TrialPoint, size: float) -> TrialPoint:
    """The best point that steps over pieces of the second order reach, each followed by tangents back to the ridge."""
    radius, random, first = _RADIUS, np.random.default_rng(0), point
    for _ in range(_CURVED):
        slope, active = _descent(terrain, point, _NEARBY, size, random)
        if slope <= STATIONARY:
            break
        pieces = _pieces(terrain, point, active)
        won = 0.0
        while pieces and won <= 0.0 and radius > _NEARBY:
            step, gain = _curved(point, pieces, radius, size)
            moved = float(np.abs(step).max())
            trial = _bundle(terrain.at, terrain.at(point.x + step, _NEARBY), size, 0.1 * radius, 0.1 * _NEARBY)
            won = float(merit(point.rows, size) - merit(trial.rows, size))
            if won <= max(0.1 * gain, 0.0):
                radius *= 0.25
            elif moved > 0.9 * radius:
                radius = min(3.0 * radius, 1.0)
        if won <= _LEAST_GAIN * size:
            break
        point = trial
    return point if point is first else _bundle(terrain.at, point, size, _NEARBY)


def _pieces(terrain: _Terrain, point: TrialPoint, active: list[TrialPoint]) -> list[TrialPoint]:
    """The pieces of all distinct tangents, each where it is greater than the others."""
    from scipy.optimize import linprog

    distinct: list[Array] = []
    for other in active:
        slope = other.slopes[0]
        if all(np.abs(slope - other).max() > _TANGENT_DIFFERENCE * np.abs(slope).max() for other in distinct):
            distinct.append(slope)
    pieces = []
    for i, slope in enumerate(distinct):
        ways = [slope - other for k, other in enumerate(distinct) if k != i]
        way = np.zeros(len(point.x))
        if ways:  # along which it rises above all others
            matrix = np.array([[*(-way / np.linalg.norm(way)), 1.0] for way in ways])
            bounds = [*[(-1.0, 1.0)] * len(way), (None, None)]
            program = linprog([*way, -1.0], A_ub=matrix, b_ub=np.zeros(len(ways)), bounds=bounds, method="highs")
            way = way if program.x is None else np.asarray(program.x[:-1])
        piece = terrain.piece(point.x + _AWAY * way)
        if piece is not None:
            pieces.append(piece)
    return pieces


def _curved(point: TrialPoint, pieces: list[TrialPoint], radius: float, size: float) -> tuple[Array, float]:
    """The best step by the pieces of the second order, and the decrease of the merit by it."""
    from scipy.optimize import minimize

    count, many = len(point.x), len(point.rows) - 1
    units = np.array([size, *[1.0] * many])

    def rows(x: Array) -> tuple[Array, Array]:
        """The rows of every piece over their units, and their slopes."""
        each = [piece.at(point.x + x) for piece in pieces]
        return np.array([row / units for row, _ in each]), np.array([slope / units[:, None] for _, slope in each])

    def aim(z: Array) -> float:
        return float(weights @ z)

    def of_aim(z: Array) -> Array:
        return weights

    above = np.hstack([np.zeros((1 + many, count)), np.eye(1 + many)])  # t, and by how much constraints are not kept

    def room(z: Array) -> Array:
        return np.asarray((above @ z - rows(z[:count])[0] + base).ravel())

    def of_room(z: Array) -> Array:
        slopes = np.tile(above, (len(pieces), 1, 1))
        slopes[:, :, :count] -= rows(z[:count])[1]
        return slopes.reshape(-1, count + 1 + many)

    base = np.array([point.rows[0] / size, *[0.0] * many])
    before = rows(np.zeros(count))[0].max(axis=0) - base
    weights = np.array([*[0.0] * count, 1.0, *[_PENALTY] * many])
    ends = list(zip(np.maximum(-radius, -point.x), np.minimum(radius, 1.0 - point.x), strict=True))
    start = np.array([*[0.0] * count, before[0], *np.maximum(before[1:], 0.0)])
    options: Any = {
        "jac": of_aim,
        "bounds": [*ends, (None, None), *[(0.0, None)] * many],
        "constraints": [{"type": "ineq", "fun": room, "jac": of_room}],
        "method": "SLSQP",
        "options": {"maxiter": _STEPS, "ftol": _SLSQP_CHANGE},
    }
    optimum = minimize(aim, start, **options)
    low, high = np.array(ends).T
    step = np.clip(optimum.x[:count], low, high)
    after = rows(step)[0].max(axis=0) - base
    unkept = np.maximum(point.rows[1:], 0.0).sum() - np.maximum(after[1:], 0.0).sum()
    return step, float(-after[0] + _PENALTY * unkept) * size


METHODS = ("latin", "sobol", "random")
"""Ways to spread points: a Latin hypercube, a scrambled sequence of Sobol, independent random numbers."""


def unit_points(method: str, count: int, variables: int, seed: list[int]) -> Array:
    """Points spread over the unit cube, shape (variables, count), by one of `METHODS`.

    Sobol sequences are scrambled: sets with different seeds give the error of a mean.

    Source: A. Owen, Scrambled net variance for integrals of smooth functions, Ann. Statist. 25 (1997), 1541-1562.

    >>> points = unit_points("sobol", 64, 3, [0])
    >>> points.shape, bool(abs(points.mean() - 0.5) < 0.01), bool((0.0 <= points).all() and (points < 1.0).all())
    ((3, 64), True, True)
    """
    random = np.random.default_rng(seed)
    if method == "random":
        return random.random((variables, count))
    from scipy.stats import qmc

    if method == "latin":
        return np.asarray(qmc.LatinHypercube(variables, seed=random).random(count).T)
    return np.asarray(qmc.Sobol(variables, seed=random).random_base2(max(count - 1, 0).bit_length())[:count].T)
