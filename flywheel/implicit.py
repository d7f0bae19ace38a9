"""Implicit steps in time, for stretches of a motion in which small changes die out fast.

An explicit step must stay within a few time constants of the fastest change, however smooth the motion is. These take
whole pieces at once: collocation at Radau points (Radau IIA), which damps what dies out at any step, by Newton's method.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Springer 1996, sections IV.5 and IV.8.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from flywheel.chain import Chain
from flywheel.piecewise import ROUNDING

Array = NDArray[np.float64]
Dense = Callable[[Any], Array]

STAGES = 16  # order 31 at the end of a step, 16 within it
STIFF = 20.0  # time constants: about the first number at which explicit steps are held up
_TRIED = 1e-7  # of a state's size: how far it is moved to see what that changes
_FIRST = 4.0  # time constants of the fastest change: what a step of this order resolves
_MOST_NEWTON, _MOST_TRIES = 12, 40  # iterations in a step, and steps tried before one is accepted
_GROWTH = 10.0  # of one step over the one before, at the most
_SETTLED = 0.1  # of the tolerance: below it Newton's method has arrived
_STALLED = 0.3  # of the change before: a change that is larger is rounding
_ROUGH = 1e-8  # of a state: more than this is no rounding, but a Newton iteration that has lost its way
_DOUBT = 8.0  # times that rounding: below it, what is missing of a step cannot be told


class Along(NamedTuple):
    """Rates of a motion at many instants at once: `rates(t, states)` for times (n,) and states (k, n) gives (k, n).

    `sizes` are sizes of the k states by which small changes of them are measured. `stiff` is how many time constants of the
    fastest change must lie ahead for implicit steps to be the cheaper ones: 0 where instants are costly one at a time,
    infinite where nothing brakes.
    """

    rates: Callable[[Array, Array], Array]
    sizes: Array
    stiff: float = STIFF


def stiffness(machine: Chain) -> float:
    """How many time constants ahead make a machine's motion stiff (see `Along`).

    Of a linkage many positions cost as much as one, so that implicit steps, which ask for many, are taken anyway; but not
    with friction in its joints, whose moment is put together of pieces that long steps stumble over.
    """
    if machine.extra is None and any(mechanism.linkage is not None for mechanism in machine.scene.mechanisms):
        return 0.0
    return STIFF if machine.depends_on_speed else np.inf


class _Solved(NamedTuple):
    """What the stages add to the states that a step starts with (k, stages), and the rounding in them (k,)."""

    gained: Array
    rounding: Array


def _radau() -> tuple[Array, Array, Array, Array]:
    """Radau's points on (0, 1]; what turns values there into gains, into the series of gains, and into their own series."""
    ends = np.zeros(STAGES + 1)
    ends[-2:] = -1.0, 1.0
    points = np.append(np.sort(legendre.legroots(ends).real)[:-1], 1.0)
    to_series = np.linalg.inv(chebyshev.chebvander(points, STAGES - 1))
    up_to = np.array([chebyshev.chebval(points, chebyshev.chebint(row, lbnd=-1.0)) for row in np.eye(STAGES)]).T
    with_start = np.linalg.inv(chebyshev.chebvander(np.append(-1.0, points), STAGES))[:, 1:]
    return 0.5 + 0.5 * points, 0.5 * up_to @ to_series, with_start, to_series


_POINTS, _GAINS, _SERIES, _QUOTIENT = _radau()


@np.errstate(all="ignore")  # an iterate that runs away is given up where it is found not to be finite
def slopes(along: Along, t: Array, states: Array) -> tuple[Array, Array]:
    """Rates (k, n) at instants, and what they change with each state: (k, k, n), by differences; not finite far off."""
    count, many = states.shape
    moved = np.repeat(states[:, None, :], count + 1, axis=1)
    for k in range(count):
        moved[k, k + 1] += _TRIED * along.sizes[k]
    found = along.rates(np.tile(t, count + 1), moved.reshape(count, -1)).reshape(count, count + 1, many)
    steps = np.array([moved[k, k + 1] - states[k] for k in range(count)])
    return found[:, 0], (found[:, 1:] - found[:, :1]) / steps


def decay(along: Along, t: float, state: Array) -> float:
    """How fast the fastest of small changes of a state dies out, 1/s; 0 where none does, or nothing can be told."""
    _, slope = slopes(along, np.array([t]), state[:, None])
    scaled = slope[:, :, 0] * along.sizes / along.sizes[:, None]
    if not np.isfinite(scaled).all():
        return 0.0
    return max(0.0, -float(np.linalg.eigvals(scaled).real.min()))


class Implicit:
    """A motion stepped from (t, state), with relative and absolute errors allowed in a step as large as it can be."""

    def __init__(self, along: Along, t: float, state: Array, relative: float, absolute: Array) -> None:
        self.along, self.relative, self.absolute = along, relative, np.maximum(absolute, 1e-300)
        self.t, self.state = t, state
        rate = decay(along, t, state)
        self.h = _FIRST / rate if rate > 0.0 else np.inf

    def step(self, longest: float, pace: float) -> Dense | None:
        """Take a step, at most as long as given; its states at a time (k,) or at times (k, n). None if none is accepted.

        `pace` is the rate of the first state, by which Newton's method starts.
        """
        h = min(self.h, longest)
        for _ in range(_MOST_TRIES):
            if not h > 4 * ROUNDING * abs(self.t):
                return None
            found = self._solved(h, pace)
            change = 0.25 if found is None else self._change(found)
            if found is not None and change >= 1.0:
                self.h = h * min(change, _GROWTH)
                return self._taken(h, found.gained)
            h *= max(change, 0.2)
        return None

    def _taken(self, h: float, gained: Array) -> Dense:
        """The states within a step: exactly those that it starts with at its start, where a pace may be 0."""
        start, before, series = self.state, self.t, ((gained / _POINTS) @ _QUOTIENT.T).T

        def dense(t: Array | float) -> Array:
            share = (np.asarray(t) - before) / h
            return np.asarray((share * chebyshev.chebval(2.0 * share - 1.0, series)).T + start).T

        self.t, self.state = before + h, start + gained[:, -1]
        return dense

    def _allowed(self, states: Array) -> Array:
        return np.asarray(self.absolute + self.relative * np.abs(states).max(axis=1))

    def _change(self, found: _Solved) -> float:
        """What a step is to be multiplied by, told by the terms of its polynomial; below 1 where the last ones count."""
        terms = np.abs(found.gained @ _SERIES.T)
        allowed = self._allowed(self.state[:, None] + found.gained) + _DOUBT * found.rounding
        miss = float((terms[:, -2:].max(axis=1) / allowed).max())
        if miss > 1.0:
            return float(min(0.8 * miss ** (-1.0 / STAGES), 0.7))
        counted = np.max(np.where(terms > allowed[:, None], np.arange(1, STAGES + 2), 1), axis=1)
        share = np.minimum(allowed / np.maximum(terms.max(axis=1), 1e-300), 1.0)
        growth = 0.9 * share ** (1.0 / (STAGES - 1) - 1.0 / counted)  # as terms fall as powers of the step
        return max(1.0, float(np.where(counted > 1, growth, np.inf).min()))

    def _solved(self, h: float, pace: float) -> _Solved | None:
        """Newton's method on all stages of a step; None where it does not settle."""
        count, times = self.state.size, self.t + h * _POINTS
        gained = np.zeros((count, STAGES))
        gained[0] = h * pace * _POINTS
        before = np.inf
        for _ in range(_MOST_NEWTON):
            states = self.state[:, None] + gained
            change = self._newton(h, times, states, gained)
            if change is None:
                return None
            gained = gained + change
            size, allowed = np.abs(change).max(axis=1), self._allowed(states)
            now = float((size / allowed).max())
            rough = (size > _ROUGH * (np.abs(states).max(axis=1) + self.absolute)).any()
            if now <= _SETTLED or (now > _STALLED * before and not rough):
                return _Solved(gained, size)
            before = now
        return None

    def _newton(self, h: float, times: Array, states: Array, gained: Array) -> Array | None:
        """The change of the gains that makes them the integrals of the rates, to first order."""
        count = gained.shape[0]
        rates, slope = slopes(self.along, times, states)
        if not (np.isfinite(rates).all() and np.isfinite(slope).all()):
            return None
        missing = h * rates @ _GAINS.T - gained
        matrix = -h * np.einsum("ij,abj->aibj", _GAINS, slope).reshape(count * STAGES, -1)
        matrix[np.diag_indices(count * STAGES)] += 1.0
        try:
            return np.linalg.solve(matrix, missing.ravel()).reshape(count, STAGES)
        except np.linalg.LinAlgError:
            return None
