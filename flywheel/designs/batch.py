"""The cycles of many designs of one structure at once: the quadrature of `turning_moment` with a leading axis of designs.

Designs of one structure have the same number of cells in every smooth piece, so that one array holds the values of M*,
dI*/dphi and I* at the nodes of them all. From these follow the series, their integrals, and every root of M* - z w²
dI*/dphi/2: all lobes of all designs in one search. A cycle gives one column of `Sums`; figures and errors follow from those
alone (`flywheel.designs.batch.figures`), for any engine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from bondgraph.recording import Program
from flywheel.machine.programs import DesignValues
from flywheel.numerics import cells
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, TAIL_OF_INTEGRAL, Array, Index
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import BY_ANGLES, MOMENT_ROUNDING, SHIFT, root_of_squares

WORK, FAST, SLOW, TORQUE, INERTIA = range(5)  # functions a W + b (I* - I*(0)) whose extremes are compared
_READING_ERROR = 4 * ROUNDING  # of a figure that is the scene's own
ROOT_RANGE = 1.0 - 1e-12
NO_EFFECT = 1e-9  # of what an unknown does over the cycle: below that it balances nothing
_GREATEST_WORK = 1e150  # of works and inertias: their squares and products would leave the floating-point range
DESIGNS = 110_000 // ORDER // ORDER * 2  # of a chunk, at most: greater products are split over threads, which costs more
_NEWTON, _SETTLED = 20, 1e-14  # steps towards an irregularity, and the last one's size
TAIL_SHARE = 1e-6  # of a row's size: a series that is cut off above it is looked at on the finer grid
POINTS: Array = np.concatenate(([-1.0], NODES, [1.0]))  # of a cell, where signs are looked at
_LAST = POINTS.size - 1
_DEGREES = np.arange(ORDER)
_FIT = np.pad(cells.fit(np.eye(ORDER)), ((1, 1), (0, 0))).T  # with a place for each end of the cell beside the nodes
_WEIGHTS = np.outer((1.0, 0.0), cells.MEAN @ _FIT)  # values -> integral; with a row of zeros it is a product of matrices
_AT_ENDS = np.stack(((-1.0) ** _DEGREES, np.ones(ORDER)))  # series -> its values at the ends
_SLOPE_AT_ENDS = np.stack(((-1.0) ** (_DEGREES + 1) * _DEGREES**2, 1.0 * _DEGREES**2))
_TO_ENDS = _AT_ENDS @ _FIT
_DIFFERENTIATE = cells.derivative(np.eye(ORDER)).T
_HALF_OVER_K = 0.5 / np.arange(1.0, ORDER + 1)[:, None]
_SIGNS = (-1.0) ** np.arange(1, ORDER + 1)[:, None]

Pieces = Sequence[tuple[slice, Program]]


class Sums(NamedTuple):
    """Sums over a cycle, for every design.

    `start`: I*(0) (kg m²); `balance` with `by_unknown`, the integral of dM*/du; `net` and `exchanged` work (J). `work` (J),
    `variation` and `inertia` (kg m²) are the errors of W, of I* - I*(0) and of I*, `first` that of I*(0),
    `of_net` (J) that of the net work.

    `greatest` and `least` (5, designs) are those of W, of W - z w²(I* - I*(0))/2 with z of the fastest and the slowest
    point and 1, and of I* - I*(0); `apart` (3, designs) the errors of the differences of works, of energies at the fastest
    and the slowest point, and of those with z = 1. `fastest` and `slowest` (rad) are where the second is greatest and the
    third least, with the error `angle` of the worse one, and `moving` (2, designs) I* - I*(0) there. `extent` (4, designs)
    has the least and greatest I* with their errors, `mean` (2, designs) its mean with its error, `largest` the reference for
    them.
    """

    start: Array
    balance: Array
    by_unknown: Array
    net: Array
    exchanged: Array
    work: Array
    variation: Array
    inertia: Array
    first: Array
    of_net: Array
    greatest: Array
    least: Array
    apart: Array
    fastest: Array
    slowest: Array
    angle: Array
    moving: Array
    extent: Array
    mean: Array
    largest: Array


Engine = Callable[[Pieces, DesignValues, Array, Array], Sums]


class Cycles(NamedTuple):
    """The cycles of designs as series on cells, as `turning_moment.Cycle`; designs are the last axis, cells that before it.

    `values` (2, points, cells, designs) holds M* and dI*/dphi at the nodes and the ends of every cell, `series` (3, ORDER,
    cells, designs) M*, dI*/dphi and I*; `start` (2, cells + 1, designs), `noise` (2, cells, designs). `work` and `variation`
    are the errors of W and of I* - I*(0), `net` that of the net work, `inertias` (cells, designs) that of I*, `tails` (2,
    cells, designs) the truncation of the first two series, `by_cell`, `inside` and `left` its shares as in `CycleErrors`;
    `mean` is that of I* with its error, `inertia_at_start` (kg m²) is I*(0), `of_start` its error.
    """

    edges: Array
    middle: Array
    half: Array
    values: Array
    series: Array
    start: Array
    noise: Array
    work: Array
    variation: Array
    net: Array
    inertias: Array
    tails: Array
    by_cell: Array
    inside: Array
    left: Array
    exchanged: Array
    mean: Array
    inertia_at_start: Array
    of_start: Array

    def at(self, cell: Index, design: Index, t: Array) -> tuple[Array, Array]:
        """W (J) and I* - I*(0) (kg m²) at local abscissas of cells of designs."""
        series = self.series[:2, :, cell, design]
        rising = np.concatenate((series[:, :1], series), axis=1)  # of T_k: (c[k-1] - c[k+1])/2k, and 2 c[0] for c[0]
        rising[:, 1] += series[:, 0]
        rising[:, 1:-2] -= series[:, 2:]
        rising[:, 1:] *= _HALF_OVER_K
        local = np.einsum("ikr,kr->ir", rising[:, 1:], cells.basis(t).T[1:] - _SIGNS)
        work, variation = self.start[:, cell, design] + local * self.half[cell, design]
        return work, variation


def _times(matrix: Array, values: Array) -> Array:
    """A matrix times the second axis of (rows, points, cells, designs), in products too small to be split over threads."""
    rows, _, *rest = values.shape
    product = np.empty((rows, matrix.shape[0], *rest))
    np.matmul(matrix, values.swapaxes(1, 2), out=product.swapaxes(1, 2))
    return product


def sums(pieces: Pieces, givens: DesignValues, columns: Array, edges: Array) -> Sums:
    """The cycles of a chunk of designs on cells between edges, with everything that figures and errors follow from."""
    half = 0.5 * (edges[1:] - edges[:-1])
    phi = edges[:-1] + half + half * NODES[:, None, None]
    values = np.zeros((6, POINTS.size, *half.shape))
    for piece, program in pieces:
        inertia, slope, moment, per_unknown, exchanged, steepness = program.function()(phi[:, piece], *columns)
        for row, value in enumerate((moment, slope, inertia, exchanged, steepness, per_unknown)):
            values[row, 1:_LAST, piece] = value
    return summed_values(values, givens, edges)


def summed_values(values: Array, givens: DesignValues, edges: Array) -> Sums:
    """The same from M*, dI*/dphi, I*, the sizes of the first two and dM*/du at the nodes, as in `assembled`."""
    half = 0.5 * (edges[1:] - edges[:-1])
    count = edges.shape[1]
    balance, by_unknown, spread = np.zeros(count), np.zeros(count), (np.ones(count), np.ones(count))
    if givens.unknown:
        net, by_unknown = (_times(_WEIGHTS, values[::5])[:, 0] * half).sum(axis=1)
        size = (_times(_WEIGHTS, np.abs(values[5:]))[0, 0] * half).sum(axis=0)
        balance = np.where(np.abs(by_unknown) > NO_EFFECT * size, -net / by_unknown + 0.0, np.nan)
        values[5] *= balance
        values[0] += values[5]
        values[3] += np.abs(values[5])
        exchanged = (_times(_WEIGHTS, values[3:4])[0, 0] * half).sum(axis=0)
        share = np.abs(balance) * size / np.maximum(exchanged, 1e-300)
        spread = turning_moment.spread_of(by_unknown, size, share)
    cycle = assembled(edges, values, spread, givens.by_directions)
    square, eps = givens.speed**2, givens.irregularity
    factors = -0.5 * square * np.stack(((1 + eps / 2) ** 2, (1 - eps / 2) ** 2, np.ones(count)))
    return summed(cycle, factors, givens, balance=balance, by_unknown=by_unknown)


def assembled(edges: Array, values: Array, spread: tuple[Array, Array], by_directions: Array | float = 0.0) -> Cycles:
    """The cycles of designs from their values at the nodes; see `turning_moment.assembled`.

    Args:
        edges: of the cells, (cells + 1, designs).
        values: M* (balance included), dI*/dphi, I* and the sums of |contributions| to the first two at the nodes, with a
            place for either end of a cell, (5 at least, points, cells, designs).
        spread: see `turning_moment.spread_of_closing`.
        by_directions: see `Machine.by_directions`.

    """
    half, end = 0.5 * (edges[1:] - edges[:-1]), edges[-1]
    middle = edges[:-1] + half
    phi = middle + half * NODES[:, None, None]
    accumulated = _times(_WEIGHTS, values[:5])[:, 0] * half
    start = np.zeros((2, *edges.shape))
    np.cumsum(accumulated[:2], axis=1, out=start[:, 1:])
    exchanged, rounding = accumulated[3].sum(axis=0), MOMENT_ROUNDING * accumulated[3:].sum(axis=1)
    series = _times(_FIT, values[:3])
    tails, of_whole = cells.tail(*np.abs(series[:, -6:]).reshape(3, 3, 2, *half.shape).max(axis=2).swapaxes(0, 1))
    by_cell = TAIL_OF_INTEGRAL * tails[:2] * half
    inside = by_cell * (1.0 - of_whole[:2])
    by_chance, shifted = _by_angles(values[:2, 1:_LAST], phi)
    whole, left_inside = (by_cell - inside).sum(axis=1) + shifted, turning_moment.two_largest(inside.swapaxes(1, 2))
    slopes, sizes = np.abs(values[1:3]).max(axis=1)
    inertias = tails[2] + turning_moment.INERTIA_ROUNDING * sizes + 2 * ROUNDING * end * slopes
    net = whole[0] + root_of_squares(rounding[0], by_chance[0])
    work = spread[0] * (whole[0] + left_inside[0])
    work += root_of_squares(spread[1] * rounding[0], spread[0] ** 2 * by_chance[0])
    variation = 0.5 * (whole[1] + np.abs(start[1, -1])) + left_inside[1]
    variation += root_of_squares(0.5 * rounding[1], 0.5 * by_chance[1])
    of_start = by_cell[1, 0] + turning_moment.START_ROUNDING * sizes[0]
    of_start += (SHIFT + BY_ANGLES * edges[1]) * values[4, :, 0].max(axis=0)
    at_start = values[2, 1 + cells.MIDDLE, 0] - cells.TO_MIDDLE @ series[1, :, 0] * half[0]
    work += 0.5 * by_directions * np.sqrt(end * np.abs(accumulated[2].sum(axis=0)))
    by_cell[0] *= spread[0]
    inside[0] *= spread[0]
    left_inside[0] *= spread[0]
    steepness = np.abs(_times(_DIFFERENTIATE, series[:2])).sum(axis=1) / half
    noise = tails[:2] + 32 * ROUNDING * values[3:5].max(axis=1) + ROUNDING * edges[1:] * steepness
    noise[0] += by_directions * np.sqrt(sizes)
    values[:2, ::_LAST] = _times(_TO_ENDS, values[:2])
    mean = np.stack((accumulated[2].sum(axis=0), TAIL_OF_INTEGRAL * (inertias * half).sum(axis=0))) / end
    errors = work, variation, net, inertias, tails[:2], by_cell, inside, left_inside
    return Cycles(edges, middle, half, values[:2], series, start, noise, *errors, exchanged, mean, at_start, of_start)


def summed(cycle: Cycles, factors: Array, givens: DesignValues, *, balance: Array, by_unknown: Array) -> Sums:
    """All sums for figures and errors, with the extremes of W + factor (I* - I*(0)) for three factors."""
    count = cycle.edges.shape[1]
    return Sums(
        start=cycle.inertia_at_start,
        balance=balance,
        by_unknown=by_unknown,
        net=cycle.start[0, -1],
        exchanged=cycle.exchanged,
        work=cycle.work,
        variation=cycle.variation,
        inertia=cycle.inertias.max(axis=0),
        first=cycle.of_start,
        of_net=cycle.net,
        **extremes_of(cycle, factors, np.broadcast_to(givens.loose, count)),
        mean=cycle.mean,
        largest=np.abs(cycle.series[2]).sum(axis=0).max(axis=0),
    )


def _by_angles(values: Array, phi: Array) -> tuple[Array, Array]:
    """Errors of integrals by rounded angles, squared, and by rounded geometry, from differences of neighbouring values."""
    inside, between = values[:, 1:] - values[:, :-1], values[:, 0, 1:] - values[:, -1, :-1]
    swings = np.abs(inside).sum(axis=(1, 2)) + np.abs(between).sum(axis=1)
    inside *= phi[1:]
    inside *= inside
    between *= phi[0, 1:]
    squares = inside.sum(axis=(1, 2)) + (between * between).sum(axis=1)
    return BY_ANGLES**2 * squares, SHIFT * swings


def extremes_of(cycles: Cycles, factors: Array, loose: Array) -> dict[str, Array]:
    """Extremes of W + factor (I* - I*(0)) over every edge and every root of M* + factor dI*/dphi, and those of I* itself."""
    number, count = cycles.half.shape
    which, cell, design, t = _roots(cycles, factors, cycles.tails)
    by_inertia = np.ones((5, count))
    by_inertia[WORK], by_inertia[FAST:INERTIA] = 0.0, factors
    work, variation = cycles.at(cell, design, t)
    at_roots = np.where(which == INERTIA, 0.0, work) + by_inertia[which, design] * variation
    at_edges = by_inertia[:, None] * cycles.start[1]
    at_edges[:INERTIA] += cycles.start[0]
    greatest, least = at_edges.max(axis=1), at_edges.min(axis=1)
    np.maximum.at(greatest, (which, design), at_roots)
    np.minimum.at(least, (which, design), at_roots)
    apart = []
    for high, low, factor in ((WORK, WORK, 0.0 * factors[0]), (FAST, SLOW, -factors[0]), (TORQUE, TORQUE, -factors[2])):
        inside = cycles.inside[0] + factor * cycles.inside[1]  # a place as great but for that may be greater
        beside = np.concatenate((inside[:1], np.maximum(inside[1:], inside[:-1]), inside[-1:]))
        error = cycles.work - cycles.left[0] + factor * (cycles.variation - cycles.left[1])
        error = error + np.abs(by_inertia[high] - by_inertia[low]) * cycles.variation
        for row, best, sign in ((high, greatest[high], 1.0), (low, least[low], -1.0)):
            beyond = (sign * (at_edges[row] - best) + beside).max(axis=0)
            own = which == row
            np.maximum.at(beyond, design[own], (sign * (at_roots - best[design]) + inside[cell, design])[own])
            error = error + beyond
        apart.append(error)
    angles, moving, worst = [], [], np.zeros(count)
    for row, extreme, sign in ((FAST, greatest[FAST], 1.0), (SLOW, least[SLOW], -1.0)):
        # of those that differ only by rounding, the first by angle: an edge, or a root in a cell before it
        enough = sign * extreme - cells.SAME * np.maximum(np.abs(greatest[row]), np.abs(least[row]))
        reached = sign * at_edges[row] >= enough
        edge = np.where(reached.any(axis=0), reached.argmax(axis=0), number)
        place, local = np.minimum(edge, number - 1), np.where(edge == number, 1.0, -1.0)
        hit = np.flatnonzero((which == row) & (sign * at_roots >= enough[design]) & (cell < edge[design]))
        hit = hit[np.lexsort((-t[hit], -cell[hit]))]  # the first by angle is written last
        place[design[hit]], local[design[hit]] = cell[hit], t[hit]
        angle, error = places(cycles, -factors[row - FAST], loose, place, local)
        angles.append(angle)
        moving.append(cycles.start[1, edge, np.arange(count)])
        moving[-1][design[hit]] = variation[hit]
        worst = np.maximum(worst, error)
    turning = np.flatnonzero(which == INERTIA)
    extent = _extent(cycles.series[2], cycles.inertias, cell[turning], design[turning], t[turning])
    return {
        "greatest": greatest,
        "least": least,
        "apart": np.stack(apart),
        "fastest": angles[0],
        "slowest": angles[1],
        "angle": worst,
        "moving": np.stack(moving),
        "extent": extent,
    }


def _extent(series: Array, errors: Array, cell: Index, design: Index, t: Array) -> Array:
    """Least and greatest I* by its own series at ends of cells and roots of its slope, and their errors."""
    ends = np.tensordot(_AT_ENDS, series, 1)
    lowest, highest = ends.min(axis=0), ends.max(axis=0)
    inside = cells.value(series[:, cell, design].T, t)
    np.minimum.at(lowest, (cell, design), inside)
    np.maximum.at(highest, (cell, design), inside)
    least, greatest = lowest.min(axis=0), highest.max(axis=0)
    return np.stack((least, greatest, (least - lowest + errors).max(axis=0), (highest - greatest + errors).max(axis=0)))


def _roots(cycles: Cycles, factors: Array, tails: Array) -> tuple[Index, Index, Index, Array]:
    """Roots inside cells: function, cell, design and local abscissa of each.

    Signs are compared at the nodes and ends. Rows close to zero without a change of sign, within noise somewhere, or not
    resolved by the nodes, are searched like those of a single design.
    """
    near_rows = [_near(cycles, function, factors, tails) for function in range(5)]
    which, cell, design = (np.concatenate([each[k] for each in near_rows]) for k in range(3))
    values, quiet = (np.concatenate([each[k] for each in near_rows], axis=-1) for k in (3, 4))
    size, unresolved = np.abs(values), np.concatenate([each[5] for each in near_rows])
    for end, beside in ((0, 1), (_LAST, _LAST - 1)):  # an end that is no more than noise is an extreme's place as it is
        values[end] = np.where(size[end] <= quiet, values[beside], values[end])
    positive = values > 0.0
    changes = positive[1:] != positive[:-1]
    middle, before, after = size[1:-1], size[:-2], size[2:]
    dip = (middle < 0.5 * (np.maximum(before, after) - middle)) & (middle <= before) & (middle <= after)
    dip &= ~(changes[1:] | changes[:-1])
    doubtful = dip.any(axis=0) | (size[1:-1].min(axis=0) <= quiet) | unresolved
    changes &= ~doubtful
    gap, row = np.nonzero(changes)
    before, after, left, right = values[gap, row], values[gap + 1, row], POINTS[gap], POINTS[gap + 1]
    roots = which[row], cell[row], design[row]
    t = _polished(_series(cycles, factors, *roots), left + (right - left) * before / (before - after), left, right)
    if not doubtful.any():
        return *roots, t
    near = which[doubtful], cell[doubtful], design[doubtful]
    further = cells.crossings(_series(cycles, factors, *near).T.copy()[:, None], quiet[doubtful][:, None])
    inside = np.abs(further.t) < 1.0
    rest = (*(index[further.function[inside]] for index in near), further.t[inside])
    which, cell, design, t = (np.concatenate(pair) for pair in zip((*roots, t), rest, strict=True))
    return which, cell, design, t


def _near(cycles: Cycles, function: int, factors: Array, tails: Array) -> tuple[Index, Index, Index, Array, Array, Any]:
    """Rows of a function that come near to zero: function, cell, design; values, noise, and whether it is not resolved."""
    if function in (WORK, INERTIA):
        row = 0 if function == WORK else 1
        values, level, cut = cycles.values[row], cycles.noise[row], tails[row]
    else:
        factor = factors[function - FAST]
        values = factor * cycles.values[1]
        values += cycles.values[0]
        level, cut = (each[0] + np.abs(factor) * each[1] for each in (cycles.noise, tails))
    low, high = values.min(axis=0), values.max(axis=0)
    nearest, farthest = np.where(low > 0.0, low, np.where(high < 0.0, -high, 0.0)), np.maximum(-low, high)
    unresolved = cut > TAIL_SHARE * farthest
    cell, design = np.nonzero((nearest <= 0.5 * (farthest - nearest)) | (nearest <= level) | unresolved)
    here = cell, design
    return np.full(cell.size, function), *here, values[:, cell, design], level[here], unresolved[here]


def _polished(series: Array, t: Array, left: Array, right: Array) -> Array:
    """Roots of series (ORDER, roots) from t within [left, right] by Newton's method; as for one design if that fails."""
    slopes, step, here = np.empty_like(series), np.zeros_like(t), t
    for first in range(0, t.size, DESIGNS):
        np.matmul(_DIFFERENTIATE, series[:, first : first + DESIGNS], out=slopes[:, first : first + DESIGNS])
    for _ in range(5):
        powers = cells.basis(here, ORDER).T
        steep = np.einsum("kr,kr->r", slopes, powers)
        step = np.einsum("kr,kr->r", series, powers) / np.where(steep == 0.0, np.inf, steep)
        here = np.minimum(np.maximum(here - step, left), right)
        if not (np.abs(step) > 1e-9).any():
            break
    lost = np.abs(step) > 1e-5
    if lost.any():
        here[lost] = cells.halley(series[:, lost].T, here[lost], left[lost], right[lost])[0]
    return here


def _series(cycles: Cycles, factors: Array, which: Index, cell: Index, design: Index) -> Array:
    """The series of functions, (ORDER, rows)."""
    moment, slope = cycles.series[:2, :, cell, design]
    factor = np.where(which == INERTIA, 1.0, np.where(which == WORK, 0.0, factors[np.clip(which - FAST, 0, 2), design]))
    return np.asarray(np.where(which == INERTIA, 0.0, 1.0) * moment + factor * slope)


def places(cycles: Cycles, factor: Array, loose: Array, cell: Index, t: Array) -> tuple[Array, Array]:
    """The angles (rad) of extremes in cells at local abscissas, and their errors as `turning_moment.error_of_extremes`."""
    number, count = cycles.half.shape
    level = cycles.noise[0] + factor * cycles.noise[1] + cycles.net / cycles.edges[-1]
    design, end = np.arange(count), cycles.edges[-1]
    half, edge = cycles.half[cell, design], cell + (t > 0.0)
    series = cycles.series[0, :, cell, design] - factor[:, None] * cycles.series[1, :, cell, design]
    angle = np.where(np.abs(t) < 1.0, cycles.middle[cell, design] + half * t, cycles.edges[edge, design])
    slope = np.maximum(np.abs(cells.slope(series, t)) / half, 1e-300)
    noise = level[cell, design] + loose * factor * np.abs(cells.value(cycles.series[1, :, cell, design], t))
    error = np.where(np.abs(t) < ROOT_RANGE, np.minimum(noise / slope, 2 * half), 0.0)
    at_end = np.flatnonzero(np.abs(t) >= ROOT_RANGE - 8 * ROUNDING * end / half)
    edge = edge[at_end]
    beside = np.stack(((edge - 1) % number, edge % number))
    moment, slope = (np.stack((row[_LAST, beside[0], at_end], row[0, beside[1], at_end])) for row in cycles.values)
    value = moment - factor[at_end] * slope
    clear = (np.abs(value) > level[beside, at_end]).all(axis=0) & (value[0] * value[1] < 0.0)
    design, edge, beside, value = at_end[~clear], edge[~clear], beside[:, ~clear], value[:, ~clear]
    if not design.size:
        return angle, error + 4 * ROUNDING * end
    series = cycles.series[0][:, beside, design] - factor[design] * cycles.series[1][:, beside, design]
    width, whole = 2 * cycles.half, cycles.series[0][:, :, design] - factor[design] * cycles.series[1][:, :, design]
    slope = np.abs(np.stack((_SLOPE_AT_ENDS[1] @ series[:, 0], _SLOPE_AT_ENDS[0] @ series[:, 1])))
    slope = np.maximum(slope / (0.5 * width[beside, design]), 1e-300)
    near = np.minimum((np.abs(value) + level[beside, design]) / slope, width[beside, design]).min(axis=0)
    quiet = np.abs(whole).sum(axis=0) <= level[:, design]
    for k in np.flatnonzero(quiet.any(axis=0)).tolist():  # whole cells in which nothing tells the extreme's place
        turned, widths = np.roll(quiet[:, k], -edge[k]), np.roll(width[:, design[k]], -edge[k])
        ahead, back = (number if row.all() else int(np.argmin(row)) for row in (turned, turned[::-1]))
        near[k] = max(near[k], min(widths[:ahead].sum() + widths[number - back :].sum(), widths.sum()))
    error[design] = np.maximum(error[design], near)
    return angle, error + 4 * ROUNDING * end


# -- the motion with an inertia --------------------------------------------------------------------------------------------


def moved(engine: Callable[[DesignValues], Sums], givens: DesignValues, inertia: Array) -> tuple[Sums, DesignValues, Array]:
    """The motion with an inertia J on the crank (kg m²), by Newton's method on its irregularity eps; its relative error.

    max(W - z+ w²V/2) - min(W - z- w²V/2) = eps w² (J + I*(0)), V = I* - I*(0), z± = (1 ± eps/2)²: with this irregularity
    the given flywheel is the exact one. By eps the two sides differ by -w²/2 times the sum of (1 ± eps/2) (J + I*) at the
    two points. The error is infinite where no motion is found: the machine would stop.
    """
    square, eps = givens.speed**2, 0.0 * givens.speed
    sums, error = engine(givens._replace(irregularity=eps)), np.full_like(eps, np.inf)
    for _ in range(_NEWTON):
        total = inertia + sums.start
        excess = sums.greatest[FAST] - sums.least[SLOW] - eps * square * total
        steepness = total + 0.5 * ((1 + eps / 2) * sums.moving[0] + (1 - eps / 2) * sums.moving[1])
        step = excess / (square * steepness)
        eps = np.clip(eps + step, 0.0, 2.0)
        lightest = total + sums.least[INERTIA]
        error = 2 * sums.apart[1] / (square * lightest * eps) + 2 * (sums.first / lightest + 4 * ROUNDING)
        settled = np.abs(step) <= np.maximum(_SETTLED, 0.1 * error) * eps
        givens = givens._replace(irregularity=eps, loose=2 * error * eps / (1 - eps / 2))
        sums = engine(givens)
        if (settled | ~(np.abs(step) < np.inf) | ((eps >= 2.0) & (step > 0.0))).all():
            break
    weighs = (inertia + sums.extent[0] > sums.extent[2]) & (lightest > sums.variation)
    return sums, givens, np.where(settled & weighs & (eps > 0.0) & (eps < 2.0), error, np.inf)


# -- figures ---------------------------------------------------------------------------------------------------------------


def figures(sums: Sums, givens: DesignValues) -> tuple[dict[str, Array], dict[str, Array], Array]:
    """Figures by their names, their errors, and the error of every design that halving cells must bring within rtol.

    They are those of `wittenbauer.figures_of` and `flywheel`, with the same scales; with the required flywheel the greatest
    and the least speed are at the figure's two extremes.
    """
    square, eps, start = givens.speed**2, givens.irregularity, sums.start
    unit = np.maximum(eps * square, 5e-324)
    fluctuation, torque = ((sums.greatest[row] - sums.least[row]) / unit for row in (WORK, TORQUE))
    total = (sums.greatest[FAST] - sums.least[SLOW]) / unit
    exact, torque = total - start, np.maximum(torque, 0.0)
    error = sums.apart[1] / unit + sums.first + 4 * ROUNDING * (np.abs(total) + start)
    scale = np.maximum(exact, fluctuation)
    at_hand = np.maximum(sums.largest, sums.exchanged / unit)
    scale = np.where(scale > 4 * error, scale, np.maximum(scale, at_hand))
    error = np.where(exact < -error, 0.0, error)
    least, least_error = _least_inertia(sums), sums.extent[2]
    by_slope = np.minimum(least_error, sums.variation)
    of_areas, of_torque = sums.apart[0] / unit + 4 * ROUNDING * fluctuation, sums.apart[2] / unit + 4 * ROUNDING * torque

    def relative(error: Array, figure: Array | float) -> Array:
        size = np.maximum(figure, fluctuation)
        return np.asarray(error / np.where(size > 4 * error, size, np.maximum(size, at_hand)))

    def net(figure: Array, error: Array) -> Array:
        """The error of a total less the least I*."""
        whole = error + least_error + by_slope
        return np.where(figure - sums.extent[0] < -whole, error, whole)

    ratio = givens.ratio**2
    values, errors, missed = of_cycle(sums, givens)
    values |= {
        "exact": np.maximum(exact, 0.0) / ratio,
        "approximate": np.maximum(fluctuation - least, 0.0) / ratio,
        "approximate_total": fluctuation / ratio,
        "inertia_torque": torque / ratio,
        "inertia_torque_flywheel": np.maximum(torque - least, 0.0) / ratio,
        "needed": (exact > 0.0) + 0.0,
    }
    of_total, of_exact = relative(of_torque, torque), error / scale
    of_areas = relative(net(fluctuation, of_areas), 0.0)
    of_torque = relative(net(torque, of_torque), np.maximum(torque - sums.extent[0], 0.0))
    errors |= {
        "exact": np.where(of_exact == 0.0, of_total, of_exact),
        "approximate": of_areas,
        "approximate_total": of_areas,
        "inertia_torque": of_total,
        "inertia_torque_flywheel": of_torque,
        "needed": 0.0 * exact,
    }
    for each in (np.where(exact > 0.0, error / np.maximum(total, 1e-300), 0.0), of_exact, of_areas, of_torque):
        missed = np.maximum(missed, each)
    return values, errors, missed


def of_cycle(sums: Sums, givens: DesignValues) -> tuple[dict[str, Array], dict[str, Array], Array]:
    """Figures of the cycle itself, without the required flywheel; their errors, and the one to bring within rtol.

    That is infinite if only rounding varies the speed, if net work remains, and for excessive values.
    """
    of_work = np.maximum(sums.work, sums.of_net) / np.maximum(sums.exchanged, 1e-300)
    least, greatest, least_error, greatest_error = sums.extent
    by_slope = sums.variation + sums.first
    own = (np.where(sums.variation <= each, by_slope, each) for each in (least_error, greatest_error))
    of_inertia = np.maximum(np.maximum(*own), sums.mean[1] + 32 * ROUNDING * greatest)
    of_inertia = np.divide(of_inertia, greatest, out=np.zeros_like(greatest), where=greatest > 0.0)
    fluctuation = sums.greatest[WORK] - sums.least[WORK]
    values = {
        "speed": givens.speed,
        "energy_fluctuation": fluctuation,
        "accumulated_max": sums.greatest[WORK],
        "accumulated_min": sums.least[WORK],
        "angle_speed_max": sums.fastest,
        "angle_speed_min": sums.slowest,
        "reduced_inertia_least": _least_inertia(sums),
        "reduced_inertia_greatest": np.where(
            sums.variation <= greatest_error, sums.start + sums.greatest[INERTIA], greatest
        ),
        "reduced_inertia_mean": sums.mean[0],
    }
    errors = {
        "speed": 0.0 * givens.speed + _READING_ERROR,
        "energy_fluctuation": of_work,
        "accumulated_max": of_work,
        "accumulated_min": of_work,
        "angle_speed_max": sums.angle,
        "angle_speed_min": sums.angle,
        **{f"reduced_inertia_{name}": of_inertia for name in ("least", "greatest", "mean")},
    }
    _add_drive(values, errors, sums, givens)
    missed = np.maximum(of_work, np.minimum(sums.inertia, sums.variation) / np.maximum(sums.largest, 1e-300))
    even = (fluctuation <= 4 * sums.work) & (greatest - least <= np.maximum(4 * sums.variation, sums.inertia))
    left_over = (not givens.unknown) & (np.abs(sums.net) > sums.work)
    enormous = ~((sums.exchanged <= _GREATEST_WORK) & (sums.largest <= _GREATEST_WORK))
    return values, errors, np.where(even | left_over | enormous, np.inf, missed)


def _least_inertia(sums: Sums) -> Array:
    """The least I* (kg m²): by the integral of its slope or by its own series, the more accurate."""
    least, _, error, _ = sums.extent
    return np.asarray(np.maximum(np.where(sums.variation <= error, sums.start + sums.least[INERTIA], least), 0.0))


def _add_drive(values: dict[str, Array], errors: dict[str, Array], sums: Sums, givens: DesignValues) -> None:
    """Adds the balance and the drive's power at the mean of the extreme speeds, with their errors."""
    exchanged = np.maximum(sums.exchanged, 1e-300)
    by_balance = np.abs(sums.balance * sums.by_unknown)
    of_balance = np.divide(sums.of_net, by_balance, out=np.zeros_like(by_balance), where=by_balance > 0.0)
    torque = givens.torque
    if givens.unknown:
        values["balance"] = sums.balance
        errors["balance"] = np.where(sums.balance != 0.0, of_balance + _READING_ERROR, sums.of_net / exchanged)
    if givens.drive is None:
        return
    work = (sums.balance if torque is None else torque) * givens.drive * givens.span
    error = of_balance * np.abs(work) + sums.of_net if torque is None else _READING_ERROR * np.abs(work)
    work = np.where(np.abs(work) <= sums.of_net, 0.0, work)
    size = np.abs(work)
    values["power"] = work * givens.speed / givens.span
    errors["power"] = error / np.where(size > error, size, np.maximum(size, exchanged)) + 2 * _READING_ERROR
