"""Where expressions switch: every root of a function in a range, proven by interval subdivision.

A cell whose enclosure leaves out zero holds no root; a cell whose derivative keeps its sign holds at most one. What is
neither is halved, so no root can hide between sample points.

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapters 6 and 8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.formulas import intervals
from flywheel.formulas.expressions import Expression
from flywheel.formulas.intervals import Interval, interval
from flywheel.formulas.jets import Jet, jet_namespace

Array = NDArray[np.float64]
Enclosures = Callable[[Array, Array, Array], Mapping[str, Any]]
Values = Callable[[Array, Array], Mapping[str, Any]]

CELL_CAP = 200_000
FINEST = 1e-9  # of the range: cells that are still open then are taken for one touching point
_START = 32
_EPS = float(np.finfo(float).eps)
_JETS = jet_namespace(intervals.NAMESPACE)


class SwitchingError(ValueError):
    """A function that cannot be followed over a range of angles; `{near}` in its text stands for the angle near which."""

    def __init__(self, text: str, near: float = 0.0) -> None:
        super().__init__(text.replace("{near}", f"{near:.6g}"))
        self.text, self.near = text, near


class _Search(NamedTuple):
    """A function that is smooth between edges: bounds of it and of its slope over cells, and its values.

    Both are also told the anchor of each cell: the middle of the piece between edges in which it lies.
    """

    enclose: Callable[[Array, Array, Array], tuple[Any, Any]]
    value: Callable[[Array, Array], Any]


class _Cells(NamedTuple):
    lo: Array
    hi: Array
    anchor: Array

    def where(self, chosen: NDArray[np.bool_]) -> _Cells:
        return _Cells(self.lo[chosen], self.hi[chosen], self.anchor[chosen])


def roots(
    enclose: Callable[[Array, Array], tuple[Any, Any]],
    value: Callable[[Array], Any],
    a: float,
    b: float,
    most: int = CELL_CAP,
) -> list[float]:
    """Every angle in (a, b) where a function changes sign or touches zero, ascending.

    `enclose(lo, hi)` gives enclosures of the function and of its derivative over arrays of cells, `value(phi)` its
    values. A stretch where the enclosure is exactly 0 has no roots; one where the function cannot be told from zero
    has a single, harmless one. Raises SwitchingError where there are too many to be found, in `most` cells.

    >>> from flywheel.formulas.intervals import NAMESPACE as ns
    >>> found = roots(lambda lo, hi: (ns.sin(Interval(lo, hi)), ns.cos(Interval(lo, hi))), np.sin, 1.0, 7.0)
    >>> [round(angle, 14) for angle in found]
    [3.14159265358979, 6.28318530717959]
    """
    edges = np.array([a, b], dtype=float)
    found = roots_in_pieces(lambda lo, hi, _: enclose(lo, hi), lambda phi, _: value(phi), edges, most)
    return [float(root) for root in found[1:-1]]


def roots_in_pieces(
    enclose: Callable[[Array, Array, Array], tuple[Any, Any]],
    value: Callable[[Array, Array], Any],
    edges: Array,
    most: int = CELL_CAP,
) -> Array:
    """The ascending edges, and between them every root of a function that is smooth in each piece, all at once.

    As `roots`, but for a third argument of `enclose` and a second of `value`: the middle of the piece that a cell lies in.
    """
    return _apart(edges, _roots_between(_Search(enclose, value), edges, most))


def breakpoints(
    expression: Expression, a: float, b: float, env: Enclosures, env_value: Values, known: Iterable[float] = ()
) -> list[float]:
    """Every angle in (a, b) where a switch of the expression changes, or a root, asin or acos has a branch point.

    What depends on speed or time is left out: position does not tell where that switches.

    `env(lo, hi, anchor)` gives, for arrays of cells, the names as jets of intervals (constants as floats),
    `env_value(phi, anchor)` their values; the anchor is the middle of the piece, which tells an angle at its end from the
    next piece's beginning. Between `known` angles the names must be smooth and `v`, given by its sign, constant.

    >>> phi_cells = lambda lo, hi, anchor: {"phi": Jet(Interval(lo, hi), 1.0)}
    >>> from flywheel.formulas.expressions import parse
    >>> found = breakpoints(parse("max(sin(phi), 0.5)*(phi < 2)"), 0, 6, phi_cells, lambda phi, _: {"phi": phi})
    >>> [round(angle, 14) for angle in found]
    [0.5235987755983, 2.0, 2.61799387799149]
    """
    start = np.array(sorted({float(a), *map(float, known), float(b)}))
    edges = start
    for part in (*expression.switches(), *expression.branch_points()):
        if part.uses_speed or part.uses_time:
            continue
        try:
            found = _roots_between(_search_of(part, env, env_value), edges)
        except SwitchingError as error:
            raise SwitchingError(f"{part.shown}: {error.text}", error.near) from None
        edges = _apart(edges, found)
    return [float(angle) for angle in edges[_distance(edges, start) > 0]]


def _search_of(part: Expression, env: Enclosures, env_value: Values) -> _Search:
    def enclose(lo: Array, hi: Array, anchor: Array) -> tuple[Any, Any]:
        jet = part.evaluate(env(lo, hi, anchor), _JETS, env_value(anchor, anchor))
        return (jet.value, jet.first) if isinstance(jet, Jet) else (jet, 0.0)

    def value(phi: Array, anchor: Array) -> Any:
        return part.evaluate(env_value(phi, anchor), np, env_value(anchor, anchor))

    return _Search(enclose, value)


def _apart(edges: Array, found: Array) -> Array:
    """The edges with the found angles put in, but for those that only rounding tells from an edge or each other."""
    near = 16 * _EPS * max(abs(edges[0]), abs(edges[-1]))
    angles = np.sort(found)
    angles = angles[_distance(angles, edges) > near]
    return np.sort(np.concatenate((edges, angles[np.diff(angles, prepend=-np.inf) > near])))


def _distance(angles: Array, edges: Array) -> Array:
    """Distance of each angle from the nearest of ascending edges."""
    above = np.searchsorted(edges, angles)
    after, before = edges[np.minimum(above, edges.size - 1)], edges[np.maximum(above - 1, 0)]
    return np.minimum(np.abs(after - angles), np.abs(angles - before))


def _roots_between(search: _Search, edges: Array, most: int = CELL_CAP) -> Array:
    """Roots of all pieces between edges at once, unordered; some may repeat an edge or each other."""
    with np.errstate(all="ignore"):
        monotone, flat = _isolated(search, edges, most)
        crossings, doubtful = _crossings(search, monotone)
        return np.concatenate((crossings, _touching_points(search, _joined([flat, doubtful]), edges)))


def _isolated(search: _Search, edges: Array, most: int) -> tuple[_Cells, _Cells]:
    """Cells that hold at most one root, and cells that cannot be split with profit."""
    cells, seen = _first_cells(edges), 0
    finest = FINEST * (edges[-1] - edges[0])
    monotone, touching = [], []
    while cells.lo.size:
        seen += cells.lo.size
        if seen > most:
            text = f"changes sign too often: its zeros are not told apart in {most} cells (first near phi = {{near}})"
            raise SwitchingError(text, float(cells.lo[0]))
        bounds, slope, noise = _bounds(search, cells)
        is_open = ~((bounds.lo > 0) | (bounds.hi < 0) | ((bounds.lo == 0) & (bounds.hi == 0)))
        is_monotone = is_open & ((slope.lo > 0) | (slope.hi < 0))
        too_fine = (cells.hi - cells.lo <= finest) | (bounds.width <= 4 * noise)
        monotone.append(cells.where(is_monotone))
        touching.append(cells.where(is_open & ~is_monotone & too_fine))
        cells = _halved(cells.where(is_open & ~is_monotone & ~too_fine))
    return _joined(monotone), _joined(touching)


def _first_cells(edges: Array) -> _Cells:
    share = -(-_START // (edges.size - 1))
    steps = np.linspace(0.0, 1.0, share + 1)
    left, right = edges[:-1, None], edges[1:, None]
    grid = left * (1 - steps) + right * steps
    grid[:, -1] = edges[1:]
    anchor = np.repeat(0.5 * (edges[:-1] + edges[1:]), share)
    return _Cells(grid[:, :-1].ravel(), grid[:, 1:].ravel(), anchor)


def _bounds(search: _Search, cells: _Cells) -> tuple[Interval, Interval, Array]:
    """Bounds of value and slope over each cell, and the width that rounding alone gives the value at its middle.

    The value is the intersection of its plain enclosure with f(middle) + f'(cell) (cell - middle).
    """
    count, middle = cells.lo.size, 0.5 * (cells.lo + cells.hi)
    lo, hi = np.concatenate((cells.lo, middle)), np.concatenate((cells.hi, middle))
    value, slope = search.enclose(lo, hi, np.tile(cells.anchor, 2))
    plain, centre = _halves(value, count)
    slope = _halves(slope, count)[0]
    mean = centre + slope * Interval(cells.lo - middle, cells.hi - middle)
    return Interval(np.fmax(plain.lo, mean.lo), np.fmin(plain.hi, mean.hi)), slope, centre.width


def _halves(u: Any, count: int) -> tuple[Interval, Interval]:
    lo, hi = (np.broadcast_to(end, 2 * count) for end in (interval(u).lo, interval(u).hi))
    return Interval(lo[:count], hi[:count]), Interval(lo[count:], hi[count:])


def _halved(cells: _Cells) -> _Cells:
    middle = 0.5 * (cells.lo + cells.hi)
    return _joined([_Cells(cells.lo, middle, cells.anchor), _Cells(middle, cells.hi, cells.anchor)])


def _joined(parts: list[_Cells]) -> _Cells:
    return _Cells(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _crossings(search: _Search, cells: _Cells) -> tuple[Array, _Cells]:
    """Sign changes of cells where the function is monotone.

    Also, as cells without width, the ends of other such cells where rounding cannot tell the value from zero.
    """
    inside, others = _split_by_sign(search, cells)
    ends = _joined([_Cells(end, end, others.anchor) for end in (others.lo, others.hi)])
    if not ends.lo.size:
        return inside, ends
    at_ends = interval(search.enclose(*ends)[0])
    return inside, ends.where(np.broadcast_to(at_ends.contains(0.0), ends.lo.shape))


def _touching_points(search: _Search, cells: _Cells, edges: Array) -> Array:
    """One angle for every run of neighbouring cells: the sign change in it, else the extreme, else its middle.

    A run without sign change that ends at an edge touches zero there, and needs nothing.
    """
    if not cells.lo.size:
        return cells.lo
    runs = _runs(cells)
    crossing, rest = _split_by_sign(search, runs)
    rest = rest.where((_distance(rest.lo, edges) > 0) & (_distance(rest.hi, edges) > 0))
    extreme, rest = _split_by_sign(_Search(search.enclose, _slopes(search)), rest)
    return np.concatenate((crossing, extreme, 0.5 * (rest.lo + rest.hi)))


def _slopes(search: _Search) -> Callable[[Array, Array], Array]:
    def slope(phi: Array, anchor: Array) -> Array:
        bounds = interval(search.enclose(phi, phi, anchor)[1])
        return np.asarray(0.5 * (bounds.lo + bounds.hi))

    return slope


def _split_by_sign(search: _Search, cells: _Cells) -> tuple[Array, _Cells]:
    """The roots of cells at whose ends the signs differ, and the other cells."""
    if not cells.lo.size:
        return cells.lo, cells
    low, high = _values(search, cells.lo, cells.anchor), _values(search, cells.hi, cells.anchor)
    change = np.sign(low) * np.sign(high) < 0
    if not change.any():
        return low[change], cells
    return _polished(search, cells.where(change), low[change], high[change]), cells.where(~change)


def _runs(cells: _Cells) -> _Cells:
    order = np.lexsort((cells.hi, cells.lo))
    lo, hi, anchor = cells.lo[order], cells.hi[order], cells.anchor[order]
    starts = np.concatenate(([True], (lo[1:] != hi[:-1]) | (anchor[1:] != anchor[:-1])))
    last = np.concatenate((starts[1:], [True]))
    return _Cells(lo[starts], hi[last], anchor[starts])


def _values(search: _Search, phi: Array, anchor: Array) -> Array:
    return np.broadcast_to(np.asarray(search.value(phi, anchor), dtype=float), phi.shape)


def _polished(search: _Search, cells: _Cells, low: Array, high: Array) -> Array:
    """Roots in cells with a sign change, to the last unit or two, by Chandrupatla's method on all cells at once.

    Inverse quadratic interpolation where it is safe, bisection elsewhere. Source: T. R. Chandrupatla, Advances in
    Engineering Software 28 (1997) 145-149.
    """
    a, b, fa, fb = cells.hi, cells.lo, high, low
    share = np.full_like(a, 0.5)
    best = a
    for _ in range(200):
        x = a + share * (b - a)
        fx = _values(search, x, cells.anchor)
        same = np.sign(fx) == np.sign(fa)
        c, fc = np.where(same, a, b), np.where(same, fa, fb)
        b, fb = np.where(same, b, a), np.where(same, fb, fa)
        a, fa = x, fx
        best = np.where(np.abs(fa) < np.abs(fb), a, b)
        least = _EPS * np.abs(best) / np.abs(b - a)
        if np.all((least > 0.5) | (fa == 0) | (fb == 0)):
            break
        share = np.clip(_inverse_quadratic(a, b, c, fa, fb, fc), least, 1 - least)
        share = np.where(np.isfinite(share), share, 0.5)
    return best


def _inverse_quadratic(a: Array, b: Array, c: Array, fa: Array, fb: Array, fc: Array) -> Array:
    place, height = (a - b) / (c - b), (fa - fb) / (fc - fb)
    safe = (height**2 < place) & ((1 - height) ** 2 < 1 - place)
    share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    return np.where(safe, share, 0.5)
