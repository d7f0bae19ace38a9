"""A cam's lift at any angle, and proven bounds of how fast its slope and curvature change, stretch by stretch."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.formulas.intervals import NAMESPACE as INTERVALS
from flywheel.formulas.intervals import Interval
from flywheel.formulas.jets import Jet, jet_namespace
from flywheel.linkage.description import Lift

Array = NDArray[np.float64]

WINDOW = 0.1
"""How far to each side (rad) a bound looks: within a step that is to be proven the cam turns no farther."""

_PARTS = 16  # of the stretch between two breakpoints of a lift, at first
_BINS = 720
_ROUNDS = 12
_TIGHT = 4.0  # times what is found by sampling: bounds that are looser are made of narrower stretches
_MOST = 4000


def at(lift: Lift, angle: Array) -> tuple[Array, Array, Array]:
    """Lift, slope and second derivative at angles (rad) of any turn, shape (n,)."""
    local = angle - lift.period * np.floor(angle / lift.period)
    jet = lift.curve.jet(local, local, np)
    value, first, second = (np.broadcast_to(np.asarray(part, dtype=float), angle.shape) for part in _parts(jet))
    return value, first, second


def _parts(jet: Any) -> tuple[Any, Any, Any]:
    return jet.value, jet.first, jet.second


class Bounds:
    """Bounds of a lift's second and third derivative near any angle."""

    def __init__(self, lift: Lift) -> None:
        self.period = lift.period
        edges, second, third = _bounded(lift)
        start = np.arange(_BINS) / _BINS * self.period
        width = self.period / _BINS
        self._table = np.stack([_near(edges, values, start, width, self.period) for values in (second, third)])

    def near(self, angle: Array, order: int) -> Array:
        """Largest |second| (order 2) or |third| (order 3) derivative within `WINDOW` of angles (n,)."""
        share = angle / self.period - np.floor(angle / self.period)
        return np.asarray(self._table[order - 2, np.minimum((share * _BINS).astype(int), _BINS - 1)])


@lru_cache(maxsize=64)
def bounds(lift: Lift) -> Bounds:
    """The bounds of a lift, found once."""
    return Bounds(lift)


def _bounded(lift: Lift) -> tuple[Array, Array, Array]:
    """Edges of stretches over a period, and bounds of both derivatives on each, cut where the first ones are loose."""
    ends = np.unique([0.0, *lift.curve.breakpoints, lift.period])
    edges = np.unique(np.concatenate([np.linspace(a, b, _PARTS + 1) for a, b in pairwise(ends)]))
    for _ in range(_ROUNDS):
        middle = 0.5 * (edges[1:] + edges[:-1])
        second, third = _derivatives(lift, edges[:-1], edges[1:], middle)
        sampled = np.abs(at(lift, middle)[2])
        loose = ~(second <= _TIGHT * np.maximum(sampled, 0.05 * sampled.max()))
        if not loose.any() or edges.size + loose.sum() > _MOST:
            break
        edges = np.sort(np.concatenate((edges, middle[loose])))
    return edges, second, third


def _derivatives(lift: Lift, low: Array, high: Array, middle: Array) -> tuple[Array, Array]:
    """Bounds of |second| and |third| derivative on stretches: jets of jets of intervals."""
    inner = Jet(Interval(low, high), 1.0, 0.0)
    with np.errstate(all="ignore"):
        found = lift.curve.jet(inner, middle, jet_namespace(INTERVALS)).second
        parts = (found.value, found.first) if isinstance(found, Jet) else (found, 0.0)
        second, third = (np.broadcast_to(_magnitude(part), middle.shape) for part in parts)
    return np.where(np.isnan(second), np.inf, second), np.where(np.isnan(third), np.inf, third)


def _magnitude(part: Any) -> Any:
    return part.magnitude if isinstance(part, Interval) else np.abs(part)


def _near(edges: Array, values: Array, start: Array, width: float, period: float) -> Array:
    """The largest value of all stretches that come within the window of a bin, whatever the turn."""
    copies = [(edges + turn * period, values) for turn in (-1.0, 0.0, 1.0)]
    low = np.concatenate([copy[:-1] for copy, _ in copies])
    high = np.concatenate([copy[1:] for copy, _ in copies])
    size = np.concatenate([copy for _, copy in copies])
    return np.array([size[(high >= a - WINDOW) & (low <= a + width + WINDOW)].max() for a in start])
