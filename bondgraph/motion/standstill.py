"""A body at rest under dry laws: each of them takes the required effort, up to its limit, in either direction.

Together they hold the body as long as a motion forwards would begin with no acceleration above 0, and one backwards with
none below 0. No other property of the laws is needed: friction of one joint or of many, meshes that lose power, a clutch.
The body leaves at the instant at which one of the two accelerations passes 0,
whatever the cause: an effort over time, a current, a ramp. The direction that it leaves in is data from then on, until the
speed comes back to 0: no law takes it from the sign of a negligible speed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bondgraph.elements import GraphError
from bondgraph.numerics import Array, chebyshev_series, first_change, root

Accelerations = Callable[[Array], Array]
"""The accelerations (2, n) at times (n,) with which a body at rest would begin to move: forwards, and backwards."""

ROUNDING = 1e-12  # of the larger of both accelerations: what counts as none
_LITTLE = 1e-9  # of the largest in a stretch of time: a push from nothing that is less moves negligible
_SHARES, _TO_SERIES = chebyshev_series(16)  # of a stretch of time
_RESOLVED = 1e-9  # of the accelerations: last terms of their series in a stretch that is looked through
_MOST = 20_000  # stretches of one rest


class EitherWayError(GraphError):
    """A body at rest that its laws drive away in both directions."""


Release = tuple[float, float]
"""The end of a rest: its time (s), and the direction of the motion after it: 1, -1, or 0 if the body is still held."""


def direction(forwards: float, backwards: float) -> float:
    """The direction in which a body leaves its rest: 1, -1, or 0 if it stays.

    Args:
        forwards: acceleration with which a motion forwards would begin.
        backwards: acceleration with which a motion backwards would begin.

    Raises:
        EitherWayError: if both motions would begin.

    >>> direction(0.5, 3.0), direction(-2.0, 1.0), direction(-3.0, -0.5)
    (1.0, 0.0, -1.0)

    """
    least = ROUNDING * max(abs(forwards), abs(backwards))
    if forwards > least and backwards < -least:
        raise EitherWayError("the laws of a body at rest drive it away in both directions")
    return 1.0 if forwards > least else -1.0 if backwards < -least else 0.0


def release(accelerations: Accelerations, start: float, end: float) -> Release:
    """The time at which dry laws release a body at rest, within a stretch of time (s) in which all laws are smooth.

    The accelerations are resolved by Chebyshev series on stretches of time as short as necessary, and the first root of
    each is searched for in one stretch after the other: a temporary push is not missed.

    Args:
        accelerations: gives those with which either motion would begin.
        start: time at which the body rests.
        end: last time of the search.

    Raises:
        GraphError: if the accelerations change too fast for the greatest number of stretches.
        EitherWayError: if both motions would begin at once.

    >>> ramp = lambda t: np.array([30.0 * t - 12.0, 30.0 * t + 12.0])
    >>> time, direction = release(ramp, 0.0, 5.0)
    >>> round(time, 9), direction
    (0.4, 1.0)

    """
    low, width, least = start, end - start, 1e-300

    def margins(times: Array) -> Array:
        """Both accelerations less the threshold of zero in the present stretch, above 0 if the motion begins."""
        return np.asarray(accelerations(times) * np.array([[1.0], [-1.0]]) - least)

    for _ in range(_MOST):
        high = end if low + width >= end else low + width
        times = low + (high - low) * _SHARES
        times[-1] = high
        both = accelerations(times)
        least = max(_LITTLE * float(np.abs(both).max()), 1e-300)
        values = both * np.array([[1.0], [-1.0]]) - least
        series = values @ _TO_SERIES.T
        rough = np.abs(series[:, -2:]).max() > _RESOLVED * np.abs(values).max()
        if rough and high - low > 1e-12 * (end - start):
            width = 0.5 * (high - low)
            continue
        releases = [_first(accelerations, margins, side, times, values[side], series[side]) for side in (0, 1)]
        sides = [side for side in (0, 1) if releases[side] is not None]
        if sides:
            if len(sides) == 2 and releases[0] == releases[1]:
                direction(*accelerations(np.array([releases[0]]))[:, 0].tolist())
            side = min(sides, key=lambda k: releases[k] or 0.0)
            return float(releases[side] or 0.0), 1.0 - 2.0 * side
        if high >= end:
            return end, 0.0
        low, width = high, 2.0 * width
    raise GraphError(f"the forces on a body at rest change too fast to be followed from {low:.6g} s to {end:.6g} s")


def _first(
    accelerations: Accelerations, margins: Accelerations, side: int, times: Array, values: Array, series: Array
) -> float | None:
    """The root of one of both accelerations before its margin is first above 0; None if it nowhere is."""
    if values[0] > 0.0:
        return float(times[0])
    start, width, sense = times[0], times[-1] - times[0], 1.0 - 2.0 * side
    share = first_change(lambda shares: -margins(start + width * shares)[side], _SHARES, -values, -series)
    if share is None:
        return None
    low, high = (float(start + width * share) for share in share[:2])
    begins = sense * float(accelerations(np.array([low]))[side, 0]) >= 0.0  # with what counts as none
    of = margins if begins else lambda t: sense * accelerations(t)
    return root(lambda t: float(of(np.array([t]))[side, 0]), low, high)
