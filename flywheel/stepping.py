"""Time stepping through the smooth pieces of a machine, restarted at the end of each.

Within a piece the loads are continued smoothly past its end, so that the step which finds the end keeps its order. The same
holds for what switches at a speed: it is watched over every step, and found where it changes its sign. Steps are explicit,
and implicit where small changes die out many times over within a piece.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

from flywheel.faults import Fault, SceneError
from flywheel.implicit import Along, Implicit, decay
from flywheel.piecewise import ROUNDING

Array = NDArray[np.float64]
Rates = Callable[[float, Array], Array]

TIGHTEST = 3e-14  # tolerance of a step: below it the integrator's own rounding wins
_BEYOND = 1.05  # of the way to a piece's end: how far a step may try
_MANY = 128  # explicit steps in a stretch, after which implicit ones are tried
_PARTS = 3  # in which an implicit step is told, each as smooth as an explicit step


class StepError(SceneError):
    """No step is short enough."""


class Step(NamedTuple):
    """One accepted step: its dense output, the time it covers, and which watched value ended it, if one did."""

    dense: Callable[[Any], Array]
    start: float
    end: float
    crossed: int | None = None


class Watch(NamedTuple):
    """Values that end the stepping where one of them leaves its side: `values(t, states)` for times (n,) and states (k, n).

    It gives an array (values, n); `sides` are the signs (1.0 or -1.0) that they have within the stretch.
    """

    values: Callable[[Array, Array], Array]
    sides: Array


class Tolerance(NamedTuple):
    """Error allowed in a step: relative, and absolute for each variable."""

    relative: float
    absolute: Array


def through(
    rates: Rates,
    t: float,
    state: Array,
    ends: tuple[float, float],
    until: float,
    tolerance: Tolerance,
    hint: float | None,
    watch: Watch | None = None,
    along: Along | None = None,
) -> Iterator[Step]:
    """Steps from a state until phi leaves (low, high), t reaches `until`, or what is watched leaves its side.

    The last one ends exactly there. With `along`, the same rates at many instants at once, stretches in which small changes
    die out many times over are stepped implicitly, and what is left of one that takes many steps.
    """
    if along is not None and _stiff(along, t, state, float(rates(t, state)[0]), ends, until):
        done, t, state = yield from _implicitly(rates, along, t, state, ends, until, tolerance, watch)
        if done:
            return
        along = None
    first = min(1.1 * hint, until - t) if hint else None  # a little more, so that an equal piece takes one step too
    absolute: Any = tolerance.absolute  # one for each variable, which the stubs do not know
    solver: Any = DOP853(rates, t, state, until, rtol=tolerance.relative, atol=absolute, first_step=first)
    taken = 0
    while solver.status == "running":
        pace = float(solver.f[0])
        _hold_back(solver, _ahead(ends, pace))
        message = solver.step()
        if solver.status == "failed":
            found = f"a motion that no step is short enough for, after {solver.t:.6g} s ({message})"
            raise StepError([Fault("simulation", found, "a motion that can be followed", "look for what vanishes there")])
        step = Step(solver.dense_output(), float(solver.t_old), float(solver.t))
        step, over = _ended(rates, step, pace, float(solver.f[0]), ends, watch)
        yield step
        if over:
            return
        taken += 1
        if along is not None and taken == _MANY:
            rest = along._replace(stiff=0.0)
            yield from through(rates, solver.t, solver.y, ends, until, tolerance, None, watch, rest)
            return


def _ended(
    rates: Rates, step: Step, before: float, after: float, ends: tuple[float, float], watch: Watch | None
) -> tuple[Step, bool]:
    """A step cut where phi leaves the piece or something watched leaves its side, and whether it was."""
    left = _left(rates, step, before, after, ends)
    step = step if left is None else step._replace(end=left)
    step = step if watch is None else crossing(watch, step)
    return step, left is not None or step.crossed is not None


def _ahead(ends: tuple[float, float], pace: float) -> float:
    return ends[1] if pace >= 0.0 else ends[0]


def _rest(pace: float, t: float, state: Array, ends: tuple[float, float], until: float) -> float:
    """About how long it takes to the piece's end, or to the last time."""
    return min(abs(_ahead(ends, pace) - float(state[0])) / abs(pace) if pace else np.inf, until - t)


def _stiff(along: Along, t: float, state: Array, pace: float, ends: tuple[float, float], until: float) -> bool:
    """Whether so many time constants lie ahead that explicit steps would be held up by them."""
    if along.stiff in (0.0, np.inf):
        return along.stiff == 0.0
    return decay(along, t, state) * _rest(pace, t, state, ends, until) > along.stiff


def _implicitly(
    rates: Rates,
    along: Along,
    t: float,
    state: Array,
    ends: tuple[float, float],
    until: float,
    tolerance: Tolerance,
    watch: Watch | None,
) -> Generator[Step, None, tuple[bool, float, Array]]:
    """Implicit steps, each told in parts; whether the stretch came to its end, or where no step was accepted."""
    solver = Implicit(along, t, state, tolerance.relative, tolerance.absolute)
    pace = float(rates(t, state)[0])
    while solver.t < until:
        start, rest = solver.t, _rest(pace, solver.t, solver.state, ends, until)
        dense = solver.step(min(_BEYOND * rest, until - start), pace)
        if dense is None:
            return False, solver.t, solver.state
        edges = np.linspace(start, solver.t, _PARTS + 1)
        paces = along.rates(edges, dense(edges))[0].tolist()
        for (low, before), (high, pace) in pairwise(zip(edges.tolist(), paces, strict=True)):
            step, over = _ended(rates, Step(dense, low, high), before, pace, ends, watch)
            yield step
            if over:
                return True, solver.t, solver.state
    return True, solver.t, solver.state


def _left(rates: Rates, step: Step, before: float, after: float, ends: tuple[float, float]) -> float | None:
    """When phi leaves the piece within a step; also where it would turn back, past the end, before the step is over."""
    start = step.start
    for stop in _turning(rates, step, before, after), step.end:
        phi = float(step.dense(stop)[0])
        if phi >= ends[1] or phi < ends[0]:
            return _passage(step.dense, start, stop, ends[1] if phi >= ends[1] else ends[0])
        start = stop
    return None


def _turning(rates: Rates, step: Step, before: float, after: float) -> float:
    """When phi turns back within a step; the step's end if it does not."""
    if before * after >= 0.0:
        return step.end
    return float(brentq(lambda t: rates(t, step.dense(t))[0], step.start, step.end))


def _hold_back(solver: Any, end: float) -> None:
    """Keep the next step from running far past the piece's end, where the laws are only continued."""
    pace = abs(solver.f[0])
    if pace > 0.0:
        solver.h_abs = min(solver.h_abs, max(_BEYOND * abs(end - solver.y[0]) / pace, 1e-9 * abs(solver.t - solver.t_bound)))


def _passage(dense: Callable[[Any], Array], start: float, stop: float, end: float) -> float:
    """When phi passes `end` within a step."""

    def beyond(t: float) -> float:
        return float(dense(t)[0]) - end

    if beyond(start) * beyond(stop) >= 0.0:
        return stop
    return float(brentq(beyond, start, stop, xtol=4 * ROUNDING * max(abs(stop), 1e-300), rtol=4 * ROUNDING))


_SHARES = 0.5 - 0.5 * np.cos(np.pi * np.arange(10) / 9)  # of a step: where what is watched is looked at
_TO_SERIES = np.linalg.inv(np.polynomial.chebyshev.chebvander(2.0 * _SHARES - 1.0, 9))
_INSIDE = 1e-9  # of a step: what crosses sooner does so at its start


def crossing(watch: Watch, step: Step) -> Step:
    """The step, cut where the first of the watched values leaves its side; at its start where one does so at once."""
    width = step.end - step.start
    if not (watch.sides.size and width > 0.0):
        return step

    def look(shares: Array) -> Array:
        times = step.start + width * shares
        return watch.sides[:, None] * watch.values(times, step.dense(times))

    values = look(_SHARES)
    series = values @ _TO_SERIES.T
    reach = np.abs(series[:, 1:]).sum(axis=1)
    first: tuple[float, int] | None = None
    for k in np.flatnonzero(~(series[:, 0] > reach)):
        share = _first_below(partial(_row, look, int(k)), values[k], series[k])
        if share is not None and (first is None or share < first[0]):
            first = share, int(k)
    return step if first is None else step._replace(end=step.start + width * first[0], crossed=first[1])


def _row(look: Callable[[Array], Array], row: int, shares: Array) -> Array:
    return np.asarray(look(shares)[row])


def _first_below(look: Callable[[Array], Array], values: Array, series: Array) -> float | None:
    """The share of a step after which a value is first below 0, told by its values and by the roots of its polynomial."""
    roots = _roots(series)
    between = np.concatenate(([_INSIDE], 0.5 * (roots[1:] + roots[:-1])))
    shares = np.concatenate((_SHARES[1:], between))
    order = np.argsort(shares)
    shares, heights = shares[order], np.concatenate((values[1:], look(between)))[order]
    below = np.flatnonzero(heights < 0.0)
    if not below.size:
        return None
    if below[0] == 0:
        return 0.0
    low, high = float(shares[below[0] - 1]), float(shares[below[0]])
    if heights[below[0] - 1] == 0.0:
        return low
    return float(brentq(lambda share: float(look(np.array([share]))[0]), low, high, xtol=4 * ROUNDING, rtol=4 * ROUNDING))


def _roots(series: Array) -> Array:
    """Real roots of a Chebyshev series in shares of the step."""
    chebyshev = np.polynomial.chebyshev
    if not np.isfinite(series).all():
        return np.empty(0)
    found = 0.5 + 0.5 * chebyshev.chebroots(chebyshev.chebtrim(series, 1e-14 * np.abs(series).max()))
    real = found.real[np.abs(found.imag) < 1e-6]
    return np.sort(real[(real > _INSIDE) & (real < 1.0)])
