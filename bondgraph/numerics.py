"""Tools of graphs and machines: counts of evaluations, connected components, roots, thresholds and maxima of functions.

Roots are found between two places of opposite signs, to the last digit; those of a polynomial by its Chebyshev series over a
share of a range from 0 to 1, in which the first place is found at which a value leaves its side (`first_change`).

Sources: T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149 (inverse quadratic interpolation where that
is safe, else bisection); R. P. Brent, Algorithms for Minimization without Derivatives, Prentice-Hall 1973, ch. 5 (parabolas
and golden sections).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
F = TypeVar("F", bound=np.floating[Any])
T = TypeVar("T", bound=Hashable)

JUST_STARTED = 1e-9  # of a range: sooner is at its start
_MOST_STEPS = 2000
_SPACING = float(np.finfo(float).eps)
_GOLDEN = 0.381966011250105  # (3 - sqrt(5))/2


# -- evaluations -------------------------------------------------------------------------------------------------------


@dataclass
class Tally:
    """Positions counted so far. A tally inside another one counts for both.

    `watch` is called at each count; an exception from it ends the work.

    >>> with counted() as tally:
    ...     count(17)
    >>> tally.evaluations
    17
    """

    outer: Tally | None = None
    watch: Callable[[], None] | None = None
    evaluations: int = 0


_TALLY: ContextVar[Tally | None] = ContextVar("tally", default=None)


@contextmanager
def counted(watch: Callable[[], None] | None = None) -> Iterator[Tally]:
    """Counts evaluations in the block, in this thread: `tally.evaluations`, also while it continues.

    `watch` is called with every evaluation, and may raise to end the block.
    """
    tally = Tally(_TALLY.get(), watch)
    token = _TALLY.set(tally)
    try:
        yield tally
    finally:
        _TALLY.reset(token)


@contextmanager
def uncounted() -> Iterator[None]:
    """Counts nothing in the block: what is kept for later costs the same, whoever needs it first.

    >>> with counted() as tally, uncounted():
    ...     count(5)
    >>> tally.evaluations
    0
    """
    token = _TALLY.set(None)
    try:
        yield
    finally:
        _TALLY.reset(token)


def count(positions: Any) -> None:
    """Counts positions, given as their number or as themselves: an array, a number, an interval of arrays."""
    tally = _TALLY.get()
    if tally is not None:
        size = positions if isinstance(positions, int) else getattr(getattr(positions, "lo", positions), "size", 1)
    while tally is not None:
        tally.evaluations += size if isinstance(size, int) else 1
        if tally.watch is not None:
            tally.watch()
        tally = tally.outer


def counting() -> bool:
    """True if evaluations are counted in this thread."""
    return _TALLY.get() is not None


# -- what hangs together -------------------------------------------------------------------------------------------------


def reached_from(start: T, near: Mapping[T, Iterable[T]]) -> set[T]:
    """All nodes that a walk from `start` reaches, given the neighbours of each.

    >>> sorted(reached_from("a", {"a": ["b"], "b": ["a", "c"], "c": ["b"], "d": []}))
    ['a', 'b', 'c']
    """
    seen, todo = {start}, [start]
    while todo:
        fresh = [other for other in near[todo.pop()] if other not in seen]
        seen.update(fresh)
        todo.extend(fresh)
    return seen


def representatives(things: Iterable[T], ties: Iterable[Sequence[T]]) -> dict[T, T]:
    """The representative of each node among all that it is tied to: that of the first of a tie serves for the rest too.

    >>> representatives([1, 2, 3, 4], [(2, 3), (3, 1)])
    {1: 2, 2: 2, 3: 2, 4: 4}
    """
    chief = {thing: thing for thing in things}
    led = {thing: [thing] for thing in chief}
    for tie in ties:
        first = chief[tie[0]]
        for other in {chief[thing] for thing in tie} - {first}:
            led[first] += led[other]
            chief |= dict.fromkeys(led.pop(other), first)
    return chief


def components(needs: Mapping[T, Iterable[T]]) -> list[list[T]]:
    """Groups of items that depend on each other, each after those that it depends on; others have no dependencies.

    >>> components({0: [1], 1: [2], 2: [1], 3: []})
    [[3], [1, 2], [0]]
    """
    groups: list[list[T]] = []
    left = dict(needs)
    while left:
        near = {one: [other for other in others if other in left and other != one] for one, others in left.items()}
        fresh = [[one] for one, others in near.items() if not others]
        if not fresh:  # what reaches the fewest reaches nothing but its own group
            least = min((reached_from(one, near) for one in near), key=len)
            fresh = [[one for one in near if one in least]]
        groups += fresh
        done = {one for group in fresh for one in group}
        left = {one: others for one, others in near.items() if one not in done}
    return groups


# -- roots ------------------------------------------------------------------------------------------------------------


def root(value: Callable[[float], float], low: float, high: float, ends: tuple[float, float] | None = None) -> float:
    """The place between two at which a value changes its sign, to the last digit; `high` where it does not.

    A root next to zero is found to 1e-25 of the range. `ends` are the values at both places, where they are known.

    >>> abs(root(lambda t: t * t - 2.0, 0.0, 2.0) - 2.0**0.5) < 1e-15
    True
    >>> root(lambda t: t**3 - 1e-100, 0.0, 1.0) < 1e-24
    True
    """
    a, b = float(low), float(high)
    of_a, of_b = (float(value(a)), float(value(b))) if ends is None else ends
    if not of_a * of_b < 0.0:
        return a if of_a == 0.0 else b
    close = max(1e-25 * abs(b - a), 1e-300)
    share = 0.5
    for _ in range(_MOST_STEPS):
        x = a + share * (b - a)
        of_x = float(value(x))
        if (of_x > 0.0) == (of_a > 0.0):
            c, of_c = a, of_a
        else:
            c, of_c, b, of_b = b, of_b, a, of_a
        a, of_a = x, of_x
        best = a if abs(of_a) < abs(of_b) else b
        least = 0.5 * (4 * _SPACING * abs(best) + close) / abs(b - a)
        if least > 0.5 or 0.0 in (of_a, of_b):
            return best
        place, height = (a - b) / (c - b), (of_a - of_b) / (of_c - of_b)
        share = 0.5
        if height**2 < place and (1.0 - height) ** 2 < 1.0 - place:  # the parabola x(value) through the three is monotonic
            share = of_a / (of_b - of_a) * of_c / (of_b - of_c)
            share += (c - a) / (b - a) * of_a / (of_c - of_a) * of_b / (of_c - of_b)
        share = min(max(share, least), 1.0 - least)
    return best


@np.errstate(all="ignore")  # of what is settled while others are not
def roots_between(
    value: Callable[[NDArray[F]], NDArray[F]], low: NDArray[F], high: NDArray[F], width: float = 0.0
) -> NDArray[F]:
    """The same for many values at once, (n,), each of which changes its sign between its own places.

    To the last digit of the places' floats, or to a width. A value that is only a sign is solved by bisection.

    >>> roots_between(lambda x: x * x - np.array([4.0, 9.0]), np.zeros(2), np.full(2, 5.0))
    array([2., 3.])
    """
    b, a = low, high
    best, spacing = a, np.finfo(a.dtype).eps
    if not a.size:
        return best
    of_b, of_a = value(b), value(a)
    share = np.full_like(a, 0.5)
    for _ in range(200):
        x = a + share * (b - a)
        of_x = value(x)
        same = np.sign(of_x) == np.sign(of_a)
        c, of_c = np.where(same, a, b), np.where(same, of_a, of_b)
        b, of_b = np.where(same, b, a), np.where(same, of_b, of_a)
        a, of_a = x, of_x
        best = np.where(np.abs(of_a) < np.abs(of_b), a, b)
        least = np.maximum(spacing * np.abs(best), 0.5 * width) / np.abs(b - a)
        if np.all((least > 0.5) | (of_a == 0) | (of_b == 0)):
            break
        place, height = (a - b) / (c - b), (of_a - of_b) / (of_c - of_b)
        safe = (height**2 < place) & ((1 - height) ** 2 < 1 - place)
        share = of_a / (of_b - of_a) * of_c / (of_b - of_c)
        share += (c - a) / (b - a) * of_a / (of_c - of_a) * of_b / (of_c - of_b)
        share = np.clip(np.where(safe, share, 0.5), least, 1 - least)
        share = np.where(np.isfinite(share), share, 0.5)
    return best


def threshold(holds: Callable[[float], bool], low: float, high: float, width: float = 0.0) -> float:
    """The place where a condition begins to hold between `low`, where it fails, and `high` (on either side), by bisection.

    The place found is one at which it holds, the next number or `width` beside one at which it does not.

    >>> threshold(lambda x: x * x >= 2.0, 0.0, 2.0), threshold(lambda x: x <= 3.0, 5.0, 1.0)
    (1.4142135623730951, 3.0)
    """
    while (middle := 0.5 * (low + high)) not in (low, high) and abs(high - low) > width:
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


# -- polynomials -------------------------------------------------------------------------------------------------------


def chebyshev_series(order: int) -> tuple[Array, Array]:
    """Shares from 0 to 1, both ends among them, and the matrix from values there to a Chebyshev series of an order."""
    shares = 0.5 - 0.5 * np.cos(np.pi * np.arange(order + 1) / order)
    return shares, np.asarray(np.linalg.inv(chebyshev.chebvander(2.0 * shares - 1.0, order)), dtype=float)


def series_roots(series: Array) -> Array:
    """Real roots of a Chebyshev series, in shares of its range; except one at its start; finite ones only.

    >>> series_roots(np.array([0.0, 1.0]))
    array([0.5])
    """
    if not np.isfinite(series).all():
        return np.empty(0)
    roots = 0.5 + 0.5 * chebyshev.chebroots(chebyshev.chebtrim(series, 1e-15 * np.abs(series).max()))
    real = roots.real[np.abs(roots.imag) < 1e-6]
    return np.unique(real[(real > JUST_STARTED) & (real < 1.0)])


def first_change(
    value: Callable[[Array], Array], shares: Array, values: Array, series: Array, soonest: float | None = None
) -> tuple[float, float, Array] | None:
    """The first place where a value is below 0, by samples at shares and by the roots of its series; None without one.

    Args:
        value: at shares, (n,).
        shares: ascending, from 0 to 1.
        values: the value there.
        series: the Chebyshev series through them.
        soonest: a share that replaces the first of the samples.

    Returns:
        The shares between which the value changes, at the first of which it is 0 or above, and the roots of the series.

    """
    if series[0] > np.abs(series[1:]).sum():
        return None
    roots = series_roots(series)
    first = 0 if soonest is None else 1
    between = np.concatenate(([] if soonest is None else [soonest], 0.5 * (roots[1:] + roots[:-1])))
    at = np.concatenate((shares[first:], between))
    heights = np.concatenate((values[first:], value(between))) if between.size else values[first:]
    order = np.argsort(at, kind="stable")
    at, heights = at[order], heights[order]
    below = np.flatnonzero(heights < 0.0)
    if not below.size:
        return None
    k = int(below[0])
    if k and heights[k - 1] != 0.0:
        return float(at[k - 1]), float(at[k]), roots
    share = float(at[k - 1]) if k > (0 if soonest is None else 1) else 0.0  # zero at the soonest share: at once
    return share, share, roots


# -- summits -----------------------------------------------------------------------------------------------------------


def summit(
    value: Callable[[float], float],
    low: float,
    high: float,
    width: float,
    *,
    enough: float = np.inf,
    above: float = np.inf,
) -> tuple[float, float]:
    """The place between two, to a width, at which a value is greatest, and that value; the first at which it is `enough`.

    The best place so far is returned where `above` times the steepest chord from it to the places tried on both sides, all
    over the range that is left, does not reach `enough`.

    >>> place, height = summit(lambda x: 3.0 - (x - 1.0) ** 2, 0.0, 5.0, 1e-8)
    >>> round(place, 7), round(height, 12)
    (1.0, 3.0)
    """
    x = w = v = low + _GOLDEN * (high - low)
    at_x = at_w = at_v = -float(value(x))
    step = before = 0.0
    chords: dict[bool, tuple[float, float]] = {}  # of each side that was tried, below and above: place and value
    while at_x > -enough and max(high - x, x - low) > width:
        steepest = max(((at - at_x) / abs(place - x) for place, at in chords.values()), default=np.inf)
        if above * steepest * (high - low) < at_x + enough:
            break
        least, middle = 0.25 * width, 0.5 * (low + high)
        r, q = (x - w) * (at_x - at_v), (x - v) * (at_x - at_w)
        p, q = (x - v) * q - (x - w) * r, 2.0 * (q - r)
        p, q = (-p if q > 0.0 else p), abs(q)
        last, before = before, step
        if abs(p) < abs(0.5 * q * last) and q * (low - x) < p < q * (high - x):
            step = p / q
        else:
            before = (high if x < middle else low) - x
            step = _GOLDEN * before
        if not low + least < x + step < high - least:
            step = least if x < middle else -least
        u = x + (step if abs(step) >= least else float(np.copysign(least, step)))
        at_u = -float(value(u))
        if at_u <= at_x:
            low, high = (x, high) if u >= x else (low, x)
            chords[u < x] = x, at_x
            v, at_v, w, at_w, x, at_x = w, at_w, x, at_x, u, at_u
        else:
            low, high = (u, high) if u < x else (low, u)
            chords[u > x] = u, at_u
            if at_u <= at_w or w == x:
                v, at_v, w, at_w = w, at_w, u, at_u
            elif at_u <= at_v or v in (x, w):
                v, at_v = u, at_u
    return x, -at_x


class Summits(NamedTuple):
    """Places (n,) of greatest values, those values, and the places on both sides that bracket them."""

    place: Array
    value: Array
    low: Array
    high: Array


_SMOOTH = 1e-11  # of a value: a summit is smooth if its parabola differs by less, a quarter of a step beside the top too


def summits(value: Callable[[Array, Indices], Array], low: Array, high: Array, points: int, rounds: int) -> Summits:
    """The greatest values between places (n,), by values (m, points) at places evenly between m of them, ever closer.

    `value` has the numbers of those m with the places. A smooth summit is the top of its parabola.

    >>> tops = np.array([[1.0], [2.0]])
    >>> summit = summits(lambda x, which: -np.abs(x - tops[which]) ** 1.5, np.zeros(2), np.full(2, 5.0), 33, 6)
    >>> summit.place.round(6)
    array([1., 2.])
    """
    which, low, high = np.arange(low.size), low.astype(float), high.astype(float)
    best, height = low.copy(), np.full(low.size, -np.inf)
    for _ in range(rounds):
        if not which.size:
            break
        many, grid = np.arange(which.size), np.linspace(low[which], high[which], points, axis=1)
        there = value(grid, which)
        column = there.argmax(axis=1)
        middle = np.clip(column, 1, points - 2)
        before, here, after = (there[many, middle + side] for side in (-1, 0, 1))
        with np.errstate(invalid="ignore"):  # of values that are not known, -inf
            bend, rise = np.minimum(before - 2 * here + after, -1e-300), 0.5 * (after - before)
            vertex = np.nan_to_num(-rise / bend)
            share = np.clip(vertex, -0.7, 0.7)[:, None] + (-0.25, 0.0, 0.25)
            top = grid[many, middle][:, None] + share * (grid[:, 1] - grid[:, 0])[:, None]
            near, size = value(top, which), np.maximum(np.maximum(abs(before), abs(after)), abs(here))
            parabola = here[:, None] + share * (rise[:, None] + 0.5 * share * bend[:, None])
            smooth = (np.abs(near - parabola) <= _SMOOTH * size[:, None]).all(axis=1) & np.isfinite(size)
        smooth &= np.abs(vertex) <= 0.7  # the top lies between three places, none of which is tried twice
        grid, there = np.concatenate((grid, top), axis=1), np.concatenate((there, near), axis=1)
        order = np.argsort(grid, axis=1, kind="stable")
        grid, there = np.take_along_axis(grid, order, axis=1), np.take_along_axis(there, order, axis=1)
        column = there.argmax(axis=1)
        beyond = points + 3 - there[:, ::-1].argmax(axis=1)  # the same value may stand there twice
        low[which], high[which] = grid[many, np.maximum(column - 1, 0)], grid[many, np.minimum(beyond, points + 2)]
        better = there[many, column] > height[which]
        best[which[better]], height[which[better]] = grid[many, column][better], there[many, column][better]
        which = which[~smooth]
    return Summits(best, height, np.minimum(low, best), np.maximum(high, best))
