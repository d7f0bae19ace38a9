"""Derivatives of many figures at once by differences that are extrapolated to a step of zero, and whether they have any.

Central differences of steps h, h/2, h/4 and so on are a series in even powers of h where a function is smooth; Richardson's
extrapolation takes these away one by one. The difference of the slopes on both sides is extrapolated alike: it is zero but
where the function has a corner. Steps are made smaller until corners and poles nearby are beyond them.

Source: C. Ridders, Advances in Engineering Software 4 (1982), 75; W. Press et al., Numerical Recipes, 5.7.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

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
_CERTAIN, _VISIBLE = 10.0, 1e-7  # of a corner: beside its error, and beside the derivative
_STILL = 0.5  # of a change over a step: what is left of it over a quarter of that step, where the figure jumps
FINE = 2.0**-20  # of a variable's scale: the step of `gradient`


class Slopes(NamedTuple):
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


def slopes(values: Values, x: Array, scales: Array, most: int = _GROUPS) -> Slopes:
    """Derivatives of figures by each variable, to about 1e-9 where errors of the figures allow it.

    D(h) = (f(x + h) - f(x - h))/2h = f' + c2 h² + c4 h⁴ + ...,   corner(h) = (f(x + h) - 2 f(x) + f(x - h))/h

    Args:
        values: the figures, with their errors; NaN if there are none.
        x: where, shape (variables,).
        scales: by what the variables change much, above 0; the largest step is a 64th of it.
        most: how often three more steps may be tried, each half as long as the one before.

    >>> def values(x):
    ...     return np.stack([np.exp(x[0]), np.maximum(x[0], 0.0)]), np.full((2, x.shape[1]), 1e-16)
    >>> found = slopes(values, np.array([0.0]), np.array([1.0]))
    >>> bool(abs(found.both[0, 0] - 1.0) < found.error[0, 0] < 1e-9)
    True
    >>> found.corner[:, 0].tolist(), [float(side[1, 0]) for side in (found.left, found.right)]
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
        smooth = np.abs(corner) <= np.maximum(_CERTAIN * doubt, _NEGLIGIBLE * base)
        helped = (wrong + doubt < 0.5 * before) | ~smooth
        known = np.isfinite(centre)[:, None] & np.ones(count, dtype=bool)
        open_ = ((known & ~(enough & smooth)) & (helped | (group < 1))).any(axis=0)
        pending, before = np.flatnonzero(open_), np.fmin(before, wrong + doubt)
        if not pending.size:
            break
    return _judged(centre, centre_error, scales, best, plus, minus, noise, steps)


def gradient(values: Values, x: Array, scales: Array, step: float = FINE) -> tuple[Array, Array]:
    """Figures, and their derivatives (figures, variables) by one small step to either side; a side without a value is left.

    Good to about 1e-6, and as near as the step (a share of the scales) to a corner a mean of those of both pieces.
    """
    steps = step * 2.0 ** np.round(np.log2(scales))
    moved = np.diag(steps)
    points = x[:, None] + np.concatenate([np.zeros((len(x), 1)), moved, -moved], axis=1)
    found, _ = values(points)
    centre, plus, minus = found[:, :1], found[:, 1 : len(x) + 1], found[:, len(x) + 1 :]
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
    found, error = values(columns)
    found, error = found.reshape(len(found), *grid.shape), error.reshape(len(error), *grid.shape)
    where = np.ix_(np.arange(len(found)), variables, levels)
    plus[where], minus[where], noise[where] = found[:, 0], found[:, 1], np.fmax(error[:, 0], error[:, 1])


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
) -> Slopes:
    """Derivatives where they exist: on both sides, on one, on neither."""
    (both, wrong), (right, of_right), (left, of_left), (corner, doubt) = best
    base = _size(centre, plus, minus) / scales
    size = np.fmax(np.abs(both), 1e-2 * base)
    bent = (np.abs(corner) > _CERTAIN * doubt) & (np.abs(corner) > _VISIBLE * size)
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
    return Slopes(
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
    known = np.isfinite(change).any(axis=-1)
    result = np.zeros(known.shape, dtype=bool)
    for index in zip(*np.nonzero(known), strict=True):
        own, loud = np.abs(change[index]), noise[index]
        own, loud = own[np.isfinite(own)], loud[np.isfinite(own)]
        if own.size > _LEVELS:
            result[index] = own[-1] > _STILL * own[-3] and own[-1] > 10.0 * loud[-1]
    return result
