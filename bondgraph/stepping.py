"""Time stepping: scipy's adaptive methods and three fixed-step ones, restarted where a law changes its branch.

Every method gives the same thing, a chain of `Stretch`es with a dense output each, so that what is done with a motion does
not depend on how it was found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.faults import GraphError

Array = NDArray[np.float64]
Field = Callable[[float, Array], Array]

ADAPTIVE = ("DOP853", "RK45", "RK23", "LSODA", "Radau", "BDF")
_NEAR = 1e-12  # of a period (or of 1): closer to a break than this is on it
_MOST_STEPS = 1_000_000


class Stretch(NamedTuple):
    """One step: from when to when, and the state at any time within."""

    start: float
    end: float
    dense: Callable[[Any], Array]


class Tableau(NamedTuple):
    """An explicit Runge-Kutta method: stage times, stage weights, weights of the step."""

    nodes: tuple[float, ...]
    stages: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]


FIXED: Mapping[str, Tableau] = {
    "euler": Tableau((0.0,), ((),), (1.0,)),
    "rk2": Tableau((0.0, 1.0), ((), (1.0,)), (0.5, 0.5)),  # the trapezoidal form, Heun's
    "rk4": Tableau((0.0, 0.5, 0.5, 1.0), ((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}


class Breaks(NamedTuple):
    """Values of one state at which laws change their branch; with a period, they repeat."""

    place: int
    values: Array
    period: float | None

    def around(self, value: float, forwards: bool) -> tuple[float, float]:
        """The breaks below and above a value; on a break, the piece that is entered."""
        whole = 0.0 if self.period is None else float(np.floor(value / self.period)) * self.period
        edges = self.values
        if self.period is not None:
            edges = np.concatenate((edges - self.period, edges, edges + self.period)) + whole
        edges = np.concatenate(([-np.inf], edges, [np.inf]))
        near = _NEAR * (self.period or max(1.0, abs(value)))
        side = value + near if forwards else value - near
        place = int(np.searchsorted(edges, side, side="right"))
        return float(edges[place - 1]), float(edges[place])


def adaptive(
    method: str, field: Field, t: float, state: Array, until: float, rtol: float, scale: Array
) -> Iterator[Stretch]:
    """Steps of one of scipy's methods."""
    from scipy import integrate

    absolute: Any = rtol * scale  # one for each state, which the stubs do not know
    solver: Any = getattr(integrate, method)(field, t, state, until, rtol=max(rtol, 3e-14), atol=absolute)
    while solver.status == "running":
        message = solver.step()
        if solver.status == "failed":
            raise GraphError(f"the motion cannot be followed past t = {solver.t:.9g} s: {message}")
        yield Stretch(float(solver.t_old), float(solver.t), solver.dense_output())


def fixed(method: str, field: Field, t: float, state: Array, until: float, step: float) -> Iterator[Stretch]:
    """Equal steps of a fixed-step method, the last one cut to end at `until`; between them, Hermite's cubic."""
    tableau, rate = FIXED[method], field(t, state)
    count = max(1, int(np.ceil((until - t) / step * (1.0 - 1e-12))))
    times = np.append(t + step * np.arange(count), until)
    for start, end in pairwise(times):
        after = runge_kutta_step(tableau, field, float(start), state, float(end - start), rate)
        rate_after = field(float(end), after)
        yield Stretch(float(start), float(end), _hermite(float(start), float(end), state, after, rate, rate_after))
        state, rate = after, rate_after


def runge_kutta_step(tableau: Tableau, field: Field, t: float, state: Array, step: float, rate: Array) -> Array:
    """The state a step later: y + h sum b_i k_i, k_i = f(t + c_i h, y + h sum a_ij k_j), k_1 = `rate`.

    >>> import numpy as np
    >>> runge_kutta_step(FIXED["rk4"], lambda t, y: y, 0.0, np.ones(1), 1.0, np.ones(1))[0] == 1 + 1 + 1/2 + 1/6 + 1/24
    np.True_
    """
    slopes = [rate]
    for node, weights in zip(tableau.nodes[1:], tableau.stages[1:], strict=True):
        between = sum((w * k for w, k in zip(weights, slopes, strict=True)), start=np.zeros_like(state))
        slopes.append(field(t + node * step, state + step * between))
    total = sum((w * k for w, k in zip(tableau.weights, slopes, strict=True)), start=np.zeros_like(state))
    return np.asarray(state + step * total)


def through_breaks(
    steps: Callable[[float, Array, Mapping[int, float]], Iterator[Stretch]],
    rate: Callable[[float, Array], Array],
    breaks: Sequence[Breaks],
    times: Sequence[float],
    state: Array,
    until: float,
) -> Iterator[Stretch]:
    """Steps from t = 0 to `until`, started afresh at every time and every break that a state passes.

    `steps(t, state, anchors)` makes the steps of one piece up to a time beyond it; `anchors` are the middles of the pieces.
    """
    t, taken = 0.0, 0
    for stop in [*sorted(time for time in times if 0.0 < time < until), until]:
        while t < stop:
            pieces = {b.place: b.around(state[b.place], _forwards(rate, t, state, b.place)) for b in breaks}
            for stretch in _until(steps(t, state, {k: _middle(*piece) for k, piece in pieces.items()}), stop):
                left = _first_passage(stretch, pieces)
                end, state = (stretch.end, stretch.dense(stretch.end)) if left is None else left
                yield stretch._replace(end=end)
                t, taken = end, taken + 1
                if taken > _MOST_STEPS:
                    raise GraphError(
                        f"{_MOST_STEPS} steps reach t = {t:.6g} s only: ask for a shorter time or a larger rtol"
                    )
                if left is not None:
                    break


def _until(stretches: Iterator[Stretch], stop: float) -> Iterator[Stretch]:
    for stretch in stretches:
        yield stretch._replace(end=min(stretch.end, stop))
        if stretch.end >= stop:
            return


def _forwards(rate: Callable[[float, Array], Array], t: float, state: Array, index: int) -> bool:
    """Which way a state goes on from where it is; at rest, which way it starts off."""
    now = rate(t, state)
    if now[index] != 0.0:
        return bool(now[index] > 0.0)
    soon = 1e-9
    return bool(rate(t, state + soon * now)[index] >= 0.0)


def _middle(low: float, high: float) -> float:
    if np.isinf(low):
        return high - 1.0 if np.isfinite(high) else 0.0
    return low + 1.0 if np.isinf(high) else 0.5 * (low + high)


def _first_passage(stretch: Stretch, pieces: Mapping[int, tuple[float, float]]) -> tuple[float, Array] | None:
    """When a state first leaves its piece within a step, and the state then, put exactly on the break."""
    from scipy.optimize import brentq

    samples = np.linspace(stretch.start, stretch.end, 9)
    values = np.array([stretch.dense(time) for time in samples[1:]])
    found: tuple[float, int, float] | None = None
    for index, (low, high) in pieces.items():
        outside = np.flatnonzero((values[:, index] >= high) | (values[:, index] <= low))
        if not outside.size:
            continue
        first = int(outside[0])
        edge = high if values[first, index] >= high else low

        def beyond(time: float, index: int = index, edge: float = edge) -> float:
            return float(stretch.dense(time)[index] - edge)

        inside, out = float(samples[first]), float(samples[first + 1])
        same = beyond(inside) * beyond(out) >= 0.0
        when = out if same else float(brentq(beyond, inside, out, xtol=4e-16 * max(out, 1e-300), rtol=1e-15))
        if found is None or when < found[0]:
            found = when, index, edge
    if found is None:
        return None
    state = np.array(stretch.dense(found[0]))
    state[found[1]] = found[2]
    return found[0], state


def _hermite(a: float, b: float, ya: Array, yb: Array, fa: Array, fb: Array) -> Callable[[Any], Array]:
    step = b - a

    def dense(times: Any) -> Array:
        s = (np.asarray(times) - a) / step
        s = s[None, :] if s.ndim else s
        y0, y1, f0, f1 = (v[:, None] if np.ndim(s) else v for v in (ya, yb, step * fa, step * fb))
        return np.asarray(
            (1 + 2 * s) * (1 - s) ** 2 * y0 + s**2 * (3 - 2 * s) * y1 + s * (1 - s) ** 2 * f0 + s**2 * (s - 1) * f1
        )

    return dense
