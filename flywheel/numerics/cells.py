"""Functions of phi that are smooth between breakpoints, as Chebyshev series on cells.

All cells have the same order and live in one array, so that fitting, integrating, differentiating and root finding
are a few matrix products for any number of cells. Values are taken at interior nodes only: a cell never
evaluates its own ends, where a load may jump. The middle node is the cell's anchor, at which every switch is decided.

Periodic collocation: on every cell the states z obey z' = F(phi, z, p). Written as an integral, z(phi) = z_left + integral
of F, and taken at the cell's nodes, its linearisation is one small system per cell, all solved at once; small changes are
propagated through the cells of a cycle, and round it. The increment of a cell is kept separate from its left end, so that a
cycle that changes its start only little loses no digits.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM 2013, chapter 21 (integral collocation);
U. M. Ascher, R. M. M. Mattheij, R. D. Russell, Numerical Solution of Boundary Value Problems, SIAM 1995, section 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]
T = TypeVar("T")
Coarse = Callable[[float], NDArray[np.bool_]]

ORDER = 21  # nodes in a cell: odd, so that its middle is one of them
MIDDLE = ORDER // 2
ROUNDING = float(np.finfo(np.float64).eps)

NODES: Array = np.sin(np.pi * (np.arange(ORDER) - MIDDLE) / ORDER)
_MOST_STEPS, _SETTLED = 5, 1e-9  # of Halley's method towards a root; last step, whose cube is negligible
_DEGREES = np.arange(ORDER + 1)
_OF_ROUNDING = 24  # units of rounding: greatest error of the fit of a constant
MOST_CELLS = 40_000
_NARROW = 1e-12  # of the whole: no cell is halved that is narrower
SAME = 64 * ROUNDING  # of the largest: values that differ by less are as great
TIE = 1e-9  # share within which two sizes are one
_RESOLVED = 0.1  # error from which on a halving gains, or what is left is rounding
_BLOCK = 128  # rows of a product
_MANY = 200  # abscissas, at which doubling is faster than so many cosines
GRID: Array = np.cos(np.pi * np.arange(2 * ORDER, -1, -1) / (2 * ORDER))  # where signs are looked at: both ends included


def _matrices() -> tuple[Array, Array, Array]:
    """Matrices from values at nodes to coefficients, and from these to those of the integral and of the slope."""
    degrees, places = np.arange(ORDER)[:, None], np.arange(2 * ORDER - 1, 0, -2)
    quarters = (degrees * places) % (4 * ORDER)  # cos(k theta), with angles reduced before they are rounded
    fitting = 2.0 / ORDER * np.sin(0.5 * np.pi / ORDER * (ORDER - np.minimum(quarters, 4 * ORDER - quarters)))
    fitting[0] /= 2
    integrating, differentiating = np.zeros((ORDER, ORDER + 1)), np.zeros((ORDER, ORDER))
    integrating[0, 1], integrating[1, 2] = 1.0, 0.25
    for k in range(2, ORDER):
        integrating[k, k + 1], integrating[k, k - 1] = 0.5 / (k + 1), -0.5 / (k - 1)
    integrating[:, 0] = -(integrating[:, 1:] * (-1.0) ** _DEGREES[1:]).sum(axis=1)
    for k in range(ORDER):
        differentiating[k, k - 1 :: -2] = 2.0 * k if k else 0.0
    differentiating[:, 0] /= 2
    return np.ascontiguousarray(fitting.T), integrating, differentiating


_FIT, _INTEGRATE, _DIFFERENTIATE = _matrices()
# series -> itself, and those of its first and second derivative
_DERIVATIVES: Array = np.hstack((np.eye(ORDER), _DIFFERENTIATE, _DIFFERENTIATE @ _DIFFERENTIATE))
_ONES: Array = np.ones(ORDER + 1)
_ENDS: Array = np.stack(((-1.0) ** _DEGREES, _ONES), axis=1)
AT_NODES: Array = np.cos(np.outer(_DEGREES, np.arccos(NODES)))  # a series with ORDER + 1 terms -> its values at the nodes
_ON_GRID: Array = np.cos(np.outer(_DEGREES, np.arccos(GRID)))
TAIL_OF_INTEGRAL = 0.04  # of `tails`, five times the cut-off terms: each T_k, k >= 21, and its alias move an integral by 0.2
MEAN: Array = _INTEGRATE.sum(axis=1)  # series -> its integral over [-1, 1]
_WEIGHTS: Array = _FIT @ MEAN
TO_MIDDLE: Array = _INTEGRATE @ np.cos(0.5 * np.pi * _DEGREES).round()  # series -> its integral over [-1, 0]


class Cells(NamedTuple):
    """Cells between consecutive edges (rad): `middle` and `half` width as columns, `phi` (cells, ORDER) at the nodes."""

    edges: Array
    middle: Array
    half: Array
    phi: Array

    @property
    def anchor(self) -> Array:
        """The middle of every cell, as a column."""
        return self.phi[..., MIDDLE : MIDDLE + 1]


def cells(edges: Array) -> Cells:
    """Cells between ascending edges (rad)."""
    half = 0.5 * (edges[..., 1:, None] - edges[..., :-1, None])
    middle = edges[..., :-1, None] + half
    return Cells(edges, middle, half, middle + half * NODES)


def middles(edges: Array, phi: Any) -> Any:
    """The middle of the interval between edges that each angle lies in (at an edge: of the one that begins there)."""
    place = np.clip(np.searchsorted(edges, phi, side="right") - 1, 0, edges.size - 2)
    return 0.5 * (edges[place] + edges[place + 1])


def located(mesh: Cells, phi: Array) -> tuple[Index, Array]:
    """Cell and local abscissa of angles; those beyond the mesh are moved to its ends.

    Of many meshes each has angles of its own, (meshes, angles).
    """
    if mesh.edges.ndim > 1:
        cell = (phi[:, :, None] >= mesh.edges[:, None, 1:-1]).sum(axis=-1)
        middle, half = (np.take_along_axis(row[..., 0], cell, -1) for row in (mesh.middle, mesh.half))
        return cell, np.clip((phi - middle) / half, -1.0, 1.0)
    cell = mesh.edges[1:-1].searchsorted(phi, side="right")
    t = (phi - mesh.middle.take(cell)) / mesh.half.take(cell)
    return cell, np.minimum(np.maximum(t, -1.0), 1.0)


def merged(angles: Iterable[float], cycle: float) -> Array:
    """Ascending angles without those that differ only by rounding; 0 and the cycle stay exact."""
    ascending = np.sort(np.array(list(angles)))  # np.unique would import numpy.ma
    near = 2 * np.finfo(float).eps * cycle
    inner = ascending[(ascending > near) & (ascending < cycle - near)]
    apart = np.diff(inner, prepend=-1.0) > near
    return np.concatenate(([0.0], inner[apart], [cycle]))


def bisected(edges: Array, which: NDArray[np.bool_]) -> Array:
    """The edges with every chosen cell cut in two."""
    middles = 0.5 * (edges[:-1] + edges[1:])[which]
    return np.sort(np.concatenate((edges, middles)))


def above(by_cell: Array, factor: float = 1.0) -> Coarse:
    """A mask of the cells to halve, by errors that add up: those with more than `factor` times an even share."""
    return lambda share: by_cell > factor * share * by_cell.sum() / by_cell.size


def halved(edges: Array, coarse: NDArray[np.bool_], most: int = MOST_CELLS) -> Array | None:
    """The edges with coarse cells cut in two; None if there is nothing to cut, or there would be more than `most` edges."""
    chosen = coarse & (np.diff(edges) > 2 * _NARROW * abs(edges[-1]))
    return bisected(edges, chosen) if chosen.any() and edges.size + chosen.sum() <= most else None


def refined(edges: Array, evaluate: Callable[[Array], tuple[T, float, Coarse]], rtol: float, most: int = MOST_CELLS) -> T:
    """A result on cells that are halved until its error is within rtol, or until halving has no effect.

    Args:
        edges: of the cells to begin with, ascending.
        evaluate: for edges the result on the cells between them, its error, and a mask of the cells that are too coarse for
            the error to fall to a share of its present value.
        rtol: the error that is allowed.
        most: greatest number of edges.

    Halving has no further effect where two successive rounds gain less than a tenth: the rest is rounding. An error above a
    tenth is that of cells that may first have to become as narrow as the function's features, so such rounds are not
    counted.

    >>> def mean(edges):
    ...     mesh = cells(edges)
    ...     values = np.sqrt(mesh.phi)
    ...     shares = TAIL_OF_INTEGRAL * tails(fit(values)) * mesh.half[:, 0]
    ...     return float(integral(values, mesh.half).sum()), float(shares.sum()), above(shares)
    >>> abs(refined(np.array([0.0, 1.0]), mean, 1e-9) - 2 / 3) < 1e-9
    True

    """
    before, stalls = np.inf, 0
    while True:
        result, error, coarse = evaluate(edges)
        stalls = stalls + 1 if 0.9 * before < error <= _RESOLVED else 0
        if error <= rtol or stalls > 1:
            return result
        finer = halved(edges, coarse(rtol / error), most)
        if finer is None:
            return result
        before, edges = error, finer


def fit(values: Array) -> Array:
    """Chebyshev coefficients of values at the nodes, along the last axis."""
    return values @ _FIT


def product(rows: Array, matrix: Array) -> Array:
    """The product of many rows and a small matrix, or a vector.

    Libraries of linear algebra share a long product out to several threads, which wait for one another longer than they
    calculate: a block of rows stays with one.
    """
    if len(rows) <= _BLOCK:
        return np.asarray(rows @ matrix)
    blocks = np.empty((len(rows), *matrix.shape[1:]))
    for first in range(0, len(rows), _BLOCK):
        np.matmul(rows[first : first + _BLOCK], matrix, out=blocks[first : first + _BLOCK])
    return blocks


def integral(values: Array, half: Array) -> Array:
    """Integral over each cell of values at the nodes: the last axis is summed."""
    return np.asarray((values @ _WEIGHTS) * half[..., 0])


def total(values: Array, half: Array) -> Array:
    """Integral over all cells of values at the nodes (..., cells, ORDER).

    Cells are added pairwise: one dot product over thousands of nodes loses up to 15 units of rounding.
    """
    return np.asarray(integral(values, half).sum(axis=-1))


def node_weights(mesh: Cells) -> Array:
    """Weights (rad) of the nodes of all cells, one after the other, in the integral over them."""
    return np.asarray((mesh.half * _WEIGHTS).ravel())


def antiderivative(series: Array, half: Array) -> Array:
    """Series of the integral from each cell's left end; one coefficient more."""
    return (series @ _INTEGRATE) * half


def accumulated(rising: Array) -> Array:
    """Value at every edge, 0 at the first, of antiderivative series (..., cells, ORDER + 1)."""
    gained = ends(rising)[..., 1]
    total = np.zeros((*gained.shape[:-1], gained.shape[-1] + 1))
    gained.cumsum(axis=-1, out=total[..., 1:])
    return total


def basis(t: Array, terms: int = ORDER + 1) -> Array:
    """T_0..T_(terms-1) at local abscissas t in [-1, 1], along a new last axis."""
    if t.size < _MANY:
        return np.asarray(np.cos(np.arccos(t)[..., None] * _DEGREES[:terms]))
    polynomials = np.empty((terms, *t.shape))  # T_(m+n) = 2 T_m T_n - T_(m-n), from twice as many to twice as many
    polynomials[0], polynomials[1] = 1.0, t
    m = 1
    while m + 1 < terms:
        n = min(m, terms - 1 - m)
        polynomials[m + 1 : m + n + 1] = 2.0 * polynomials[m] * polynomials[1 : n + 1] - polynomials[m - n : m][::-1]
        m *= 2
    return np.moveaxis(polynomials, 0, -1)


def value(series: Array, t: Array) -> Array:
    """Each row of coefficients at its own local abscissa."""
    return np.asarray((series * basis(t, series.shape[-1])).sum(axis=-1))


def interpolated(values: Array, mesh: Cells, phi: Array) -> Array:
    """Interpolates values at the nodes of a mesh (cells, nodes) to any angles, in their shape."""
    cell, t = located(mesh, phi)
    return value(fit(values)[cell], t)


def weights(t: Array) -> Array:
    """Weights of the values at a cell's nodes that give the value at local abscissas (n,), (n, ORDER)."""
    return basis(t, ORDER) @ _FIT.T


def slope(series: Array, t: Array) -> Array:
    """Derivative by t of each row of coefficients at its own local abscissa."""
    return value(series @ _DIFFERENTIATE, t)


def derivative(series: Array) -> Array:
    """Series of the derivative by t of each row of coefficients."""
    return series @ _DIFFERENTIATE


def derivatives(series: Array, t: Array) -> Array:
    """Value, first and second derivative by t of each row of coefficients at its own local abscissa, (3, rows)."""
    rows = (series @ _DERIVATIVES).reshape(-1, 3, ORDER)
    return np.asarray((rows @ basis(t, ORDER)[:, :, None])[..., 0].T)


def greatest(series: Array) -> float:
    """The greatest value of a function given by its series on cells, (cells, ORDER)."""
    return float(extents(series)[1].max())


def largest(series: Array) -> float:
    """The value of a function that is largest in size, with its sign; the positive one if both are equal."""
    high, low = greatest(series), -greatest(-series)
    return high if high >= -low * (1.0 - TIE) else low


def ends(series: Array) -> Array:
    """Values at the left and the right end of every cell, along a new last axis."""
    return np.asarray(series @ _ENDS[: series.shape[-1]])


def extents(series: Array) -> tuple[Array, Array]:
    """The least and the greatest value on each cell of a function by its series: at the ends or where its slope is zero."""
    slopes, size = product(series, _DIFFERENTIATE), np.abs(series)
    slope_size = np.abs(slopes)
    # the slope keeps its sign where its first coefficient outweighs all; rounding has roots of its own in every cell
    steady = slope_size[:, 0] > slope_size[:, 1:].sum(axis=-1)
    constant = size[:, 1:].sum(axis=-1) <= _OF_ROUNDING * ROUNDING * size[:, 0]
    turning = np.flatnonzero(~(steady | constant))
    noise = 64 * ROUNDING * slope_size[turning].sum(axis=-1)
    roots = crossings(slopes[None, turning], noise[None])
    cell = turning[roots.cell]
    inside, at_ends = value(series[cell], roots.t), ends(series)
    least, most = np.minimum(*at_ends.T), np.maximum(*at_ends.T)
    np.minimum.at(least, cell, inside)
    np.maximum.at(most, cell, inside)
    return least, most


def peak(values: Array, places: Array) -> Index:
    """The index of the greatest value along the last axis: of values that differ by rounding alone, the first.

    >>> int(peak(np.array([1.0, 3.0, 3.0 - 1e-15]), np.array([2.0, 1.0, 0.0])))
    2
    """
    same = SAME * np.abs(values).max(axis=-1, keepdims=True)
    return np.asarray(np.where(values >= values.max(axis=-1, keepdims=True) - same, places, np.inf).argmin(axis=-1))


def tails(series: Array) -> Array:
    """Estimated error of each cell's interpolant: five times the sum of the coefficients that were cut off.

    That sum is a geometric one, continued from the last six coefficients at the slower of their two decays. They are
    taken in pairs, so that even and odd functions count alike. Two of the five are due to aliasing, the rest covers
    coefficients that vary in sign and size. It is no less than the last pair, as the decay may slow down there. A series
    that does not decay gets at least 90 times its last pair.
    """
    return truncation(series)[0]


def truncation(series: Array) -> tuple[Array, Array]:
    """The same, and the share of an integral's error that the integral over a whole cell has; see `tail`."""
    size = np.abs(series[..., -6:])
    pairs = np.maximum(size[..., ::2], size[..., 1::2])
    error, share = tail(pairs[..., 0], pairs[..., 1], pairs[..., 2])
    return np.asarray(error), np.asarray(share)


def tail(first: Any, middle: Any, last: Any) -> tuple[Any, Any]:
    """Estimated error by the last three pairs of coefficients, the greater size of each, and its share in whole cells.

    See `tails`. Of what is cut off, the integral over a whole cell keeps T_k of even k alone, with their aliases: a fortieth
    of what is allowed for places inside, if half or less of a pair is left in the next one; measured in 900 random machines,
    a sixtieth at most. So a thirtieth is allowed.
    """
    decay = np.maximum(last / np.maximum(middle, 1e-300), middle / np.maximum(first, 1e-300))
    decay = np.minimum(decay, 0.9)
    error = np.maximum(10.0 * decay * np.maximum(last, middle * decay) / (1.0 - decay), last)
    return error, (1.0 + 29.0 * (decay > 0.5)) / 30.0


def by_rounded_angles(series: Array, mesh: Cells) -> Array:
    """The greatest change of series (..., cells, ORDER) in each cell by rounding of the angles: large in steep cells."""
    steepness = np.abs(series @ _DIFFERENTIATE) @ _ONES[: series.shape[-1]]
    return np.asarray(ROUNDING * mesh.edges[..., 1:] / mesh.half[..., 0] * steepness)


def number(values: Any) -> Any:
    """A number of one function as a float; an array of those of many."""
    return float(values) if np.ndim(values) == 0 else values


def wide(values: Any, shape: tuple[int, ...]) -> Array:
    """A number or array, broadcast to a shape as floats; one that has the shape is returned as it is."""
    own = np.asarray(values, dtype=float)
    return own if own.shape == shape else np.broadcast_to(own, shape) if own.ndim else np.full(shape, own)


class Crossings(NamedTuple):
    """Sign changes of several functions, ordered by function and angle: which one, in which cell, at which local t.

    `slope` is that of the function by t there.
    """

    function: Index
    cell: Index
    t: Array
    slope: Array

    def angles(self, mesh: Cells) -> Array:
        """Angles (rad) of the crossings; exactly an edge where the function jumps there."""
        inside = mesh.middle.take(self.cell) + mesh.half.take(self.cell) * self.t
        return np.where(self.t == 1.0, mesh.edges.take(self.cell + 1), inside)


def crossings(series: Array, noise: Array) -> Crossings:
    """Every sign change of the functions with series (functions, cells, ORDER).

    Values within `noise` (functions, cells) count as zero; a stretch of zeros takes the sign before it, so that a sign
    change after it is at the end of the zeros. Jumps between cells give t = 1 of the cell before. Where the first
    coefficient exceeds the sum of all others and the noise, its sign is the cell's, and no grid is needed.
    """
    count, number, order = series.shape
    rows, level = series.reshape(count * number, order), (noise + np.zeros((1, number))).reshape(-1)
    size = np.abs(rows)
    wavy = ~(2.0 * size[:, 0] > product(size, _ONES[:order]) + level)
    looked = wavy.nonzero()[0]
    grid = product(rows.take(looked, axis=0), _ON_GRID[:order])
    # all values in one line, row after row: those on the grid, or the one of a row without
    lengths = np.where(wavy, GRID.size, 1)
    past = lengths.cumsum()
    starts = past[number - 1 : -1 : number] if count > 1 else past[:0]  # of the functions but the first
    values = rows[:, 0].repeat(lengths)
    values[wavy.repeat(lengths)] = grid.reshape(-1)
    signs = np.sign(values) * (np.abs(values) > level.repeat(lengths))
    if not signs.all():
        last = np.where(signs != 0.0, np.arange(signs.size), 0)
        last[starts] = starts
        signs = signs.take(np.maximum.accumulate(last))
    changes = signs[1:] * signs[:-1]
    changes[starts - 1] = 0.0
    at = (changes < 0.0).nonzero()[0]
    # from the secant's root, kept inside the gap; jumps stay at t = 1
    row = past.searchsorted(at, side="right")
    gap = GRID.size + at - past.take(row)
    low, left, right = values.take(at), GRID.take(gap), GRID.take(gap + 1, mode="clip")
    span = low - values.take(at + 1)
    share = low / np.where(span == 0.0, np.inf, span)
    t, slope = halley(rows.take(row, axis=0), left + (right - left) * np.minimum(np.maximum(share, 0.0), 1.0), left, right)
    function, cell = np.divmod(row, number)
    roots = Crossings(function, cell, t, slope)
    hidden = _hidden(grid, level.take(looked))
    if hidden is None:
        return roots
    both = zip(roots, _inside_gaps(rows, looked[hidden[0]], hidden[1], number), strict=True)
    every = Crossings(*(np.concatenate(pair) for pair in both))
    order = np.lexsort((every.t, every.cell, every.function))
    return Crossings._make(row[order] for row in every)


def halley(rows: Array, t: Array, left: Array, right: Array) -> tuple[Array, Array]:
    """Roots of series, one a row, from t within [left, right], and the slopes there.

    Halley's method, which trebles the digits with every evaluation of a series and its derivatives; bisection if that fails.
    """
    if not t.size:
        return t, t
    each = product(rows, _DERIVATIVES).reshape(-1, 3, ORDER)
    step = right - left
    for _ in range(_MOST_STEPS):
        here, slope, bend = (each @ basis(t, ORDER)[:, :, None])[..., 0].T
        steep = slope - 0.5 * bend * (here / np.where(slope == 0.0, np.inf, slope))  # a product may leave the floating range
        earlier, step = step, here / np.where(steep == 0.0, np.inf, steep)
        before, t = t, np.minimum(np.maximum(t - step, left), right)
        if not np.abs(t - before).max(initial=0.0) > _SETTLED:
            break
    lost = (right > left) & (np.abs(step) > _SETTLED)
    if lost.any():
        lost &= np.abs(step) > np.minimum(1e-5, 0.1 * np.abs(earlier))  # not near it yet, or steps that halve only
    if lost.any():  # bisection, for rows that change sign between left and right
        rows, low, high = rows[lost], left[lost], right[lost]
        rising = np.sign(value(rows, high))
        bracketed = rising * value(rows, low) < 0.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            above = rising * value(rows, middle) > 0.0
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        # without a change of sign a root lies at an end whose value is nearer 0, as where a double one begins a cell
        ends = np.stack([t[lost], left[lost], right[lost]])
        nearest = np.argmin([np.abs(value(rows, end)) for end in ends], axis=0)
        t[lost] = np.where(bracketed, 0.5 * (low + high), np.take_along_axis(ends, nearest[None], axis=0)[0])
        slope[lost] = value(rows @ _DIFFERENTIATE, t[lost])
    return t, slope


def _hidden(grid: Array, noise: Array) -> tuple[Index, Index] | None:
    """Rows and points of the grid where a function dips towards zero so fast that it may cross twice between two of them."""
    middle = grid[:, 1:-1]
    sign, size = np.sign(middle), np.abs(middle)  # products of the values might leave the floating-point range
    before, after = sign * grid[:, :-2], sign * grid[:, 2:]
    lowest = (np.minimum(before, after) >= size) & (size > noise[:, None])
    suspect = lowest & (3.0 * size < np.maximum(before, after))
    if not suspect.any():
        return None
    row, point = np.nonzero(suspect)
    return row, point + 1


def _inside_gaps(rows: Array, row: Index, point: Index, number: int) -> Crossings:
    """Crossings around suspected grid points of rows, `number` to a function, searched for on a grid fifty times finer."""
    gaps = []
    for k, p in zip(row, point, strict=True):
        fine = np.linspace(GRID[p - 1], GRID[p + 1], 101)
        values = basis(fine, ORDER) @ rows[k]
        at = np.nonzero(values[1:] * values[:-1] < 0.0)[0]
        if at.size == 2:  # an odd one is already known from the signs of the grid
            left, right = fine[at], fine[at + 1]
            start = left + values[at] / (values[at] - values[at + 1]) * (right - left)
            roots = zip(*halley(rows[[k, k]], start, left, right), strict=True)
            gaps += [(k // number, k % number, t, slope) for t, slope in roots]
    columns = np.array(gaps, dtype=float).reshape(-1, 4)
    return Crossings(columns[:, 0].astype(np.intp), columns[:, 1].astype(np.intp), columns[:, 2], columns[:, 3])


# columns of values at the nodes -> their integral from the left end up to each node, and over the whole cell (half = 1)
_UP_TO_NODES: Array = np.ascontiguousarray(basis(NODES) @ antiderivative(_FIT, np.ones((1, 1))).T)
_WHOLE: Array = integral(np.eye(ORDER), np.ones((ORDER, 1)))
_UP_TO_EACH: Array = np.column_stack((_UP_TO_NODES.T, _WHOLE))

_MILD = 4.0  # exponent: what changes grow or decay by within a cell whose nodes resolve it to rounding
_STEEP = 5.0  # exponent: changes that grow or decay by more than exp of it are followed from where they only decay
_MOST_GROWTH = 700.0  # exponent that a float still holds
_THREADED = 100  # unknowns of a dense system from which several threads solve it


class Changes(NamedTuple):
    """Changes of the states as functions of those of z at phi = 0 and of the parameters: dz = start dz0 + by dp + rest.

    At the nodes: `start` (cells, states, nodes, states), `by` (cells, states, nodes, parameters), `rest` (cells, states,
    nodes); at the edges: the same with edges (cells + 1) in place of cells, and no nodes; `start` less the identity there.

    `around` (states, states + parameters + 1) is the gain round the cycle, in addition to dz0: it closes if that is 0.
    Where changes grow by orders of magnitude, dz0 is that at the edge from which none does: backwards if they grow over the
    whole cycle, by exp(`growth`).
    """

    start: Array
    by: Array
    rest: Array
    edge_start: Array
    edge_by: Array
    edge_rest: Array
    around: Array | None = None
    growth: float = 0.0

    @property
    def reach(self) -> Array:
        """The greatest effect of an error made anywhere in the cycle, (states, states): on each state, by an error of each.

        An error r of a state at phi = 0 in every cycle becomes Y(phi) (I - M)^-1 r, where M is the effect of a cycle on
        a change and Y the effect up to phi; the largest over the edges, in size.
        """
        through = self.edge_start + np.eye(self.edge_start.shape[-1])
        return np.asarray(np.abs(through @ np.linalg.inv(-self.gained)).max(axis=0))

    @property
    def gained(self) -> Array:
        """The gain over the cycle of a change at its start, (states, states)."""
        edge: Array = self.edge_start[..., -1, :, :]
        return edge if self.around is None else self.around[..., : self.around.shape[-2]]


def round_cycle(half: Array, jacobian: Array, by_parameter: Array, at_nodes: Array, at_edges: Array, gap: Array) -> Changes:
    """The linearised motion round a cycle whose end exceeds its start by a gap (..., states); the changes close it.

    One state is followed from the edge, and in the sense, in which changes only decay: growth by G on the way would lose as
    many digits as G has. Among many motions at once, those that need that become NaN. The other arguments are those of
    `changes`.
    """
    growth = np.zeros((*half.shape[:-1], half.shape[-1] + 1))
    (half * (jacobian[..., 0, 0, :] @ _WHOLE)).cumsum(axis=-1, out=growth[..., 1:])
    ended = at_edges.copy()
    ended[..., -1, :] += gap
    turned = np.zeros(half.shape[:-1], bool)
    if jacobian.shape[-2] == 1:
        steep = growth.max(axis=-1) - growth.min(axis=-1) > _STEEP
        turned = steep & ((growth[..., -1] > 0.0) | (growth.argmax(axis=-1) % half.shape[-1] != 0))
    first, backwards = 0, False
    if half.ndim > 1:
        at_nodes = np.where(turned[..., None, None, None], np.nan, at_nodes)
    elif turned:
        first, backwards = int(growth.argmax()) % half.size, bool(growth[-1] > 0.0)
    rows = half, jacobian, by_parameter, at_nodes, ended
    rolled = [np.roll(each, -first, axis=0) for each in rows] if first else rows
    motion = _backwards(*rolled) if backwards else changes(*rolled)
    base = 0 if backwards else -1
    ends = motion.edge_start, motion.edge_by, motion.edge_rest[..., None]
    around = np.concatenate([rows[..., base, :, :] for rows in ends], axis=-1)
    if first:
        # from phi = 0 on
        start, by, rest = (np.roll(rows, first, axis=0) for rows in motion[:3])
        edge_start, edge_by, edge_rest = (
            np.concatenate((np.roll(rows[:-1], first, axis=0), rows[[-1 - first]])) for rows in motion[3:6]
        )
        motion = Changes(start, by, rest, edge_start, edge_by, edge_rest)
    motion.edge_rest[..., -1, :] -= gap
    return motion._replace(around=around, growth=float(growth[-1]) if backwards else 0.0)


def _backwards(half: Array, jacobian: Array, by_parameter: Array, at_nodes: Array, at_edges: Array) -> Changes:
    """The same as `changes`, as functions of dz where the last cell ends."""
    from_right = at_nodes - at_edges[:, :, None]
    motion = changes(
        half[::-1], -jacobian[::-1, ..., ::-1], -by_parameter[::-1, ..., ::-1], from_right[::-1, ..., ::-1], -at_edges[::-1]
    )
    nodes = motion.start[::-1, :, ::-1], motion.by[::-1, :, ::-1], motion.rest[::-1, :, ::-1]
    return Changes(*nodes, motion.edge_start[::-1], motion.edge_by[::-1], motion.edge_rest[::-1])


def changes(half: Array, jacobian: Array, by_parameter: Array, at_nodes: Array, at_edges: Array) -> Changes:
    """The linearised motion through all cells; axes before those that are named are those of many motions at once.

    Args:
        half: half widths of the cells (..., cells).
        jacobian: dF/dz, (..., cells, states, states, nodes).
        by_parameter: dF/dp, (..., cells, states, parameters, nodes).
        at_nodes: excess of z_left + integral of F over z, (..., cells, states, nodes).
        at_edges: the same at the right ends, (..., cells, states).

    """
    if jacobian.shape[-2] > 1:
        return _chained(*_eliminated(half, jacobian, by_parameter, at_nodes, at_edges))
    slope = jacobian[..., 0, 0, :]
    exponents = half[..., None] * (slope @ _UP_TO_EACH)
    solved, gained = _faded(half, exponents, slope, by_parameter[..., 0, :, :], at_nodes, at_edges)
    steep = np.abs(exponents).max(axis=-1) > _MILD
    if steep.any():
        rows = (each[steep] for each in (half, jacobian, by_parameter, at_nodes, at_edges))
        solved[steep], gained[steep] = _eliminated(*rows)
    return _chained(solved, gained)


def _faded(
    half: Array, exponents: Array, slope: Array, by_parameter: Array, at_nodes: Array, at_edges: Array
) -> tuple[Array, Array]:
    """Values of one state in each cell for a unit at its left end, for units of the parameters, beside these; and its gains.

    A change y beside the excess r obeys y' = a y + (a r + b dp), so that with G = exp(integral of a) it is
    G (y_left + integral of (a r + b dp)/G). The next step corrects the part that the cell's nodes do not resolve.
    """
    exponents = np.minimum(np.maximum(exponents, -_MILD), _MILD)  # beyond that `_eliminated` is asked
    growth = np.exp(exponents[..., :-1])
    pushed = np.concatenate((by_parameter, slope[..., None, :] * at_nodes), axis=-2) / growth[..., None, :]
    width = half[..., None, None]
    solved = np.empty((*growth.shape[:-1], 1, growth.shape[-1], pushed.shape[-2] + 1))
    solved[..., 0, :, 0] = growth
    solved[..., 0, :, 1:] = np.swapaxes(growth[..., None, :] * (width * (pushed @ _UP_TO_NODES.T)), -2, -1)
    solved[..., 0, :, -1] += at_nodes[..., 0, :]
    gained = np.empty((*half.shape, 1, pushed.shape[-2] + 1))
    gained[..., 0, 0] = np.expm1(exponents[..., -1])
    gained[..., 0, 1:] = np.exp(exponents[..., -1:]) * (half[..., None] * (pushed @ _WHOLE))
    gained[..., 0, -1] += at_edges[..., 0]
    return solved, gained


def _eliminated(half: Array, jacobian: Array, by_parameter: Array, at_nodes: Array, at_edges: Array) -> tuple[Array, Array]:
    """The same of any number of states, by elimination: (I - h S D) dz = 1 dz_left + h S (dF/dp) dp + r."""
    *lead, states, _, nodes = jacobian.shape
    parameters = by_parameter.shape[-2]
    reach = half[..., None, None] * _UP_TO_NODES
    matrix = -reach[..., None, :, None, :] * jacobian[..., :, None, :, :]
    matrix = matrix.reshape(*lead, states * nodes, states * nodes)
    matrix[..., np.arange(states * nodes), np.arange(states * nodes)] += 1.0
    right = np.zeros((*lead, states, nodes, states + parameters + 1))
    for k in range(states):
        right[..., k, :, k] = 1.0
    right[..., states:-1] = reach[..., None, :, :] @ np.swapaxes(by_parameter, -2, -1)
    right[..., -1] = at_nodes
    solved = _solved(matrix, right.reshape(*lead, states * nodes, -1)).reshape(right.shape)
    rates = np.einsum("...abj,...bjk->...ajk", jacobian, solved)
    rates[..., states:-1] += np.swapaxes(by_parameter, -2, -1)
    gained = half[..., None, None] * (_WHOLE @ rates)  # over a cell, beside what it starts with
    gained[..., -1] += at_edges
    return solved, gained


def _solved(matrix: Array, right: Array) -> Array:
    """The solutions of dense systems, larger ones by elimination of their first half.

    Libraries of linear algebra solve systems of 100 unknowns or more by several threads, which wait for one another longer
    than they calculate: at 105 unknowns 5 times as long on two idle processors, 100 times as long on busy ones.
    """
    size = matrix.shape[-1]
    if size < _THREADED:
        return np.asarray(np.linalg.solve(matrix, right))
    upper, lower = slice(size // 2), slice(size // 2, size)
    beside = np.concatenate((matrix[..., upper, lower], right[..., upper, :]), axis=-1)
    through = _solved(matrix[..., upper, upper], beside)
    left = np.concatenate((matrix[..., lower, lower], right[..., lower, :]), axis=-1) - matrix[..., lower, upper] @ through
    rest = size - size // 2
    late = _solved(left[..., :rest], left[..., rest:])
    return np.concatenate((through[..., rest:] - through[..., :rest] @ late, late), axis=-2)


def _chained(solved: Array, gained: Array) -> Changes:
    """Cell after cell: each starts with the end of the one before."""
    *lead, count, states, columns = gained.shape
    edges = np.zeros((count + 1, *lead, states, columns))
    times = np.multiply if states == 1 else np.matmul if lead else np.dot  # the quickest of small matrices
    gains, edge = np.moveaxis(gained, -3, 0), edges[0]
    for k, (own, gain) in enumerate(zip(gains[..., :states], gains, strict=True), 1):
        edges[k] = edge = edge + times(own, edge) + gain
    edge = np.moveaxis(edges, 0, -3) if lead else edges
    left = edge[..., :-1, :, :].copy()
    left[..., :states] += np.eye(states)
    at_nodes = solved[..., :states] @ left[..., None, :, :]
    at_nodes[..., states:] += solved[..., states:]
    return Changes(
        at_nodes[..., :states],
        at_nodes[..., states:-1],
        at_nodes[..., -1],
        edge[..., :states],
        edge[..., states:-1],
        edge[..., -1],
    )


def multiplier(change: Changes) -> tuple[Any, Any]:
    """The multiplier of a small change over a cycle (the largest in size), and 1 minus it, without cancellation.

    Those of many motions at once are arrays.
    """
    if change.growth:
        return float(np.exp(min(change.growth, _MOST_GROWTH))), -float(np.expm1(min(change.growth, _MOST_GROWTH)))
    grown = change.gained
    if grown.shape[-2:] == (1, 1):
        alone = grown[..., 0, 0]
        return 1.0 + alone, -alone
    eigenvalues = np.linalg.eigvals(grown)
    largest = eigenvalues[np.argmax(np.abs(1.0 + eigenvalues))]
    size = float(np.abs(1.0 + largest))
    return size, float(-largest.real) if largest.imag == 0.0 and largest.real > -1.0 else 1.0 - size


# -- tables --------------------------------------------------------------------------------------------------------------


def table_pieces(place: NDArray[Any], value: NDArray[Any], interpolation: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """The polynomials of a table: their left ends (pieces,) and their coefficients (powers, pieces), highest power first.

    Args:
        place: the rows' places (rows,), such as angles, ascending, two equal ones for a jump: floats, or other numbers as
            objects.
        value: the rows' values (rows,).
        interpolation: "linear", "step", or "pchip": cubics between jumps that overshoot nowhere.

    Source: F. N. Fritsch and J. Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM J. Sci.
    Stat. Comput. 5 (1984), for the slopes of pchip.

    >>> table_pieces(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 0.0]), "linear")
    (array([0., 1.]), array([[ 2., -1.],
           [ 0.,  2.]]))

    """
    starts, polynomials = [], []
    jumps = np.flatnonzero(np.diff(place) == 0) + 1
    for x, y in zip(np.split(place, jumps), np.split(value, jumps), strict=True):
        if x.size == 1:
            continue
        starts.append(x[:-1])
        step, rise = np.diff(x), np.diff(y)
        rows = [0 * rise if interpolation == "step" else rise / step, y[:-1]]
        if interpolation == "pchip" and x.size > 2:
            slope, ends = rows[0], monotone_slopes(step, rows[0])
            bend = ends[:-1] + ends[1:] - 2 * slope
            rows = [bend / step**2, (slope - ends[:-1] - bend) / step, ends[:-1], y[:-1]]
        polynomials.append(np.stack(rows))
    most = max(map(len, polynomials))
    padded = [np.concatenate((np.zeros((most - len(rows), rows.shape[1]), int), rows)) for rows in polynomials]
    return np.concatenate(starts), np.concatenate(padded, axis=1)


def monotone_slopes(step: NDArray[Any], slope: NDArray[Any]) -> NDArray[Any]:
    """The slopes of pchip at the rows, from the widths of the pieces and the slopes of their chords: two at least."""
    alike = _sign(slope[1:]) * _sign(slope[:-1]) > 0
    early, late = (np.where(alike, each, 1) for each in (slope[:-1], slope[1:]))
    first, last = 2 * step[1:] + step[:-1], step[1:] + 2 * step[:-1]
    inner = np.where(alike, (first + last) / (first / early + last / late), 0 * early)
    ends = []
    for near, far, own, other in ((*step[:2], *slope[:2]), (*step[:-3:-1], *slope[:-3:-1])):
        end = ((2 * near + far) * own - near * other) / (near + far)
        if _sign(end) != _sign(own):
            end = 0 * own
        elif _sign(own) != _sign(other) and abs(end) > 3 * abs(own):
            end = 3 * own
        ends.append(end)
    return np.concatenate((ends[:1], inner, ends[1:]))


def _sign(number: Any) -> Any:
    return 1 * (number > 0) - (number < 0)
