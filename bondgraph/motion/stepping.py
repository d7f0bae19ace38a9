"""Time stepping: adaptive methods and three fixed-step ones, restarted where a law changes its branch.

Every method gives the same thing, a chain of `Stretch`es with a dense output each, so that what is done with a motion does
not depend on how it was found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.laws import GraphError
from bondgraph.motion.runge_kutta import ORDER_5, ORDER_8, DormandPrince, Method
from bondgraph.records import NamedTuple

Array = NDArray[np.float64]
Field = Callable[[float, Array], Array]

PLAIN: Mapping[str, Method] = {"RK45": ORDER_5, "DOP853": ORDER_8}  # stepped without arrays
ADAPTIVE = ("DOP853", "RK45", "RK23", "LSODA", "Radau", "BDF")
_NEAR = 1e-12  # of a period (or of 1): closer to a break than this is on it
_MOST_STEPS = 1_000_000
_MOST_HALVINGS = 2000
_SPACING = float(np.finfo(float).eps)
_MOST_STALLED = 200  # steps of LSODA after which the time is the same: it gets out of 60 of them


class StepError(GraphError):
    """A step that no method can take: the motion ends there, or the laws do."""


class Stretch(NamedTuple):
    """One step: from when to when, the state after it, and the state at any time within (None where nobody asks)."""

    start: float
    end: float
    after: Array
    dense: Callable[[Any], Array] | None


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
    name: str = ""

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
    method: str,
    field: Field,
    t: float,
    state: Array,
    until: float,
    tolerance: tuple[float, Array],
    longest: float = np.inf,
    *,
    dense: bool = True,
    length: Callable[[float], float] | None = None,
) -> Iterator[Stretch]:
    """Steps of an adaptive method; `tolerance` is relative and, for every state, absolute; `longest` a step's, s.

    `length` gives a step's longest by the time that it starts at, for methods of one step. Explicit steps of order 5 and 8
    are taken in plain numbers, of a `field` that takes and gives tuples; the others are scipy's.
    """
    if method in PLAIN:
        yield from _explicit(PLAIN[method], field, t, state, until, tolerance, longest, dense, length)
        return
    from scipy import integrate

    relative, absolute = tolerance[0], tolerance[1]
    given: Any = {"max_step": longest, "rtol": max(relative, 3e-14), "atol": absolute}
    solver: Any = getattr(integrate, method)(field, t, state, until, **given)
    stalled = 0
    while solver.status == "running":
        reached = float(solver.t)
        if length is not None:
            solver.max_step = min(longest, length(reached))
        try:
            with np.errstate(all="ignore"):
                message = solver.step()
        except (ValueError, np.linalg.LinAlgError):  # the implicit methods', of a matrix that is not finite
            message = "the rates are not finite"
        if message is None and not np.all(np.isfinite(solver.y)):
            message = "it is not finite"
        stalled = stalled + 1 if solver.t == reached else 0
        if message is None and stalled > _MOST_STALLED:
            message = "its steps are shorter than the spacing of times"
        if message is not None:
            raise StepError(f"the motion cannot be followed past t = {reached:.9g} s: {message}")
        if not stalled:
            yield Stretch(float(solver.t_old), float(solver.t), solver.y, solver.dense_output() if dense else None)


def _explicit(
    method: Method,
    field: Callable[[float, Any], Any],
    t: float,
    state: Array,
    until: float,
    tolerance: tuple[float, Array],
    longest: float,
    dense: bool,
    length: Callable[[float], float] | None,
) -> Iterator[Stretch]:
    """Explicit steps, as `adaptive` gives them."""
    relative, absolute = max(tolerance[0], 3e-14), np.broadcast_to(tolerance[1], state.shape).tolist()
    runner = DormandPrince(field, t, state.tolist(), until, relative, absolute, method=method)
    while runner.t < until:
        start = runner.t
        runner.h = min(runner.h, longest, longest if length is None else length(start))
        step = runner.step()
        if step is None or not np.isfinite(sum(step.after)):
            message = "Required step size is less than spacing between numbers." if step is None else "it is not finite"
            raise StepError(f"the motion cannot be followed past t = {start:.9g} s: {message}")
        yield Stretch(start, runner.t, np.array(step.after), step if dense else None)


def fixed(method: str, field: Field, t: float, state: Array, until: float, step: float) -> Iterator[Stretch]:
    """Equal steps of a fixed-step method, the last one cut to end at `until`; between them, Hermite's cubic."""
    tableau, rate = FIXED[method], field(t, state)
    count = max(1, int(np.ceil((until - t) / step * (1.0 - 1e-12))))
    origin = t
    for k in range(count):
        start, end = origin + k * step, until if k + 1 == count else origin + (k + 1) * step
        with np.errstate(all="ignore"):
            after = runge_kutta_step(tableau, field, float(start), state, float(end - start), rate)
            rate_after = field(float(end), after)
        if not np.all(np.isfinite(rate_after)):
            raise StepError(
                f"the motion cannot be followed past t = {start:.9g} s: it is not finite; take shorter steps, or a "
                "method for stiff equations that chooses its own (LSODA, Radau)"
            )
        yield Stretch(float(start), float(end), after, hermite(float(start), float(end), state, after, rate, rate_after))
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
    steps: Callable[[float, Array, float, Mapping[int, float]], Iterator[Stretch]],
    rate: Callable[[float, Array], Array],
    breaks: Sequence[Breaks],
    times: Sequence[float],
    state: Array,
    until: float,
) -> Iterator[Stretch]:
    """Steps from t = 0 to `until`, started afresh at every time and every break that a state passes.

    `steps(t, state, stop, anchors)` makes the steps of one piece up to a time; `anchors` are the middles of the pieces.
    """
    t, taken = 0.0, 0
    for stop in [*sorted(time for time in times if 0.0 < time < until), until]:
        while t < stop:
            began = t
            pieces, anchors = {}, {}
            for b in breaks:
                now = rate(t, state)  # which way the state goes on from where it is; at rest, which way it starts off
                onward = now[b.place] if now[b.place] != 0.0 else rate(t, state + 1e-9 * now)[b.place]
                low, high = b.around(state[b.place], bool(onward > 0.0 or (onward == 0.0 and now[b.place] == 0.0)))
                middle = low + 1.0 if np.isinf(high) else 0.5 * (low + high)
                if np.isinf(low):
                    middle = high - 1.0 if np.isfinite(high) else 0.0
                pieces[b.place], anchors[b.place] = (low, high), middle
            for stretch in steps(t, state, stop, anchors):
                left = _first_passage(stretch, pieces)
                end, state = (stretch.end, stretch.after) if left is None else left
                if left is not None and end == began:
                    names = ", ".join(
                        f"{b.name} = {state[b.place]:.9g}" for b in breaks if state[b.place] in pieces[b.place]
                    )
                    raise GraphError(
                        f"the motion sticks at {names}, t = {t:.9g} s: the laws on both sides drive it back there"
                    )
                yield stretch._replace(end=end, after=state)
                t, taken = end, taken + 1
                if taken > _MOST_STEPS:
                    raise GraphError(
                        f"{_MOST_STEPS} steps reach t = {t:.6g} s only: ask for a shorter time or a larger rtol, or use a "
                        "method for stiff equations (Radau, LSODA)"
                    )
                if left is not None:
                    break


_NODES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(14) + 0.5) / 14)  # a step's dense output is a polynomial: 14 values fix it
_TO_COEFFICIENTS = np.linalg.inv(np.polynomial.chebyshev.chebvander(2.0 * _NODES - 1.0, 13))
JUST_STARTED = 1e-9  # of a step


def _first_passage(stretch: Stretch, pieces: Mapping[int, tuple[float, float]]) -> tuple[float, Array] | None:
    """When a state first leaves its piece within a step, and the state then, put exactly on the break.

    That is the step's start where the state leaves at once, on the side that it does not belong to.
    """
    if not pieces or stretch.dense is None:
        return None
    width = stretch.end - stretch.start
    values = stretch.dense(stretch.start + width * _NODES)
    found: tuple[float, int, float] | None = None
    for index, piece in pieces.items():
        coefficients = _TO_COEFFICIENTS @ values[index]
        reach = np.abs(coefficients[1:]).sum()
        for edge in piece:
            if np.isfinite(edge) and abs(coefficients[0] - edge) <= reach * (1.0 + 1e-9) + 1e-15 * abs(edge):
                outwards = 1.0 if edge == piece[1] else -1.0
                part = _leaving(stretch, index, coefficients, edge, outwards)
                if part is not None and (found is None or part < found[0]):
                    found = part, index, edge
    if found is None:
        return None
    when = stretch.end if found[0] == 1.0 else stretch.start + found[0] * width
    state = np.array(stretch.dense(when))
    state[found[1]] = found[2]
    return when, state


def _leaving(stretch: Stretch, index: int, coefficients: Array, edge: float, outwards: float) -> float | None:
    """The part of a step after which a state is first beyond an edge."""
    dense = stretch.dense
    assert dense is not None

    def beyond(part: float) -> float:
        time = stretch.start + part * (stretch.end - stretch.start)
        return outwards * float(dense(time)[index] - edge)

    crossings = roots(coefficients - edge * np.eye(coefficients.size)[0])
    rounding = 8 * np.finfo(float).eps * max(abs(edge), float(np.abs(coefficients).max()))
    while crossings.size and abs(beyond(0.5 * crossings[0])) <= rounding:  # a start at rest on the edge is a double root
        crossings = crossings[1:]
    if beyond(0.5 * (crossings[0] if crossings.size else 1.0)) > 0.0:
        return 0.0
    for low, high in pairwise([JUST_STARTED, *(0.5 * (crossings[1:] + crossings[:-1])), 1.0]):
        if beyond(high) >= 0.0:
            return instant(beyond, low, high)
    return None


def roots(series: Array) -> Array:
    """Real roots of a Chebyshev series over a step, in parts of the step; none at its very start, none that is not finite.

    >>> import numpy as np
    >>> roots(np.array([0.0, 1.0]))
    array([0.5])
    """
    chebyshev = np.polynomial.chebyshev
    if not np.isfinite(series).all():
        return np.empty(0)
    found = 0.5 + 0.5 * chebyshev.chebroots(chebyshev.chebtrim(series, 1e-15 * np.abs(series).max()))
    real = found.real[np.abs(found.imag) < 1e-6]
    return np.unique(real[(real > JUST_STARTED) & (real < 1.0)])


def instant(value: Callable[[float], float], low: float, high: float) -> float:
    """When a value changes its sign between two instants, to the last digit; `high` where it does not.

    By inverse quadratic interpolation where that is safe, else by halves.
    Source: T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149.

    An instant next to zero is found to 1e-25 of the interval.

    >>> abs(instant(lambda t: t * t - 2.0, 0.0, 2.0) - 2.0**0.5) < 1e-15
    True
    >>> instant(lambda t: t**3 - 1e-100, 0.0, 1.0) < 1e-24
    True
    """
    a, b = float(low), float(high)
    of_a, of_b = float(value(a)), float(value(b))
    if not of_a * of_b < 0.0:
        return high
    close = max(1e-25 * (b - a), 1e-300)
    share = 0.5
    for _ in range(_MOST_HALVINGS):
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


def hermite(a: float, b: float, ya: Array, yb: Array, fa: Array, fb: Array) -> Callable[[Any], Array]:
    """Hermite's cubic over a step from a to b, by the states and their rates at its ends."""
    step = b - a

    def dense(times: Any) -> Array:
        s = (np.asarray(times) - a) / step
        s = s[None, :] if s.ndim else s
        y0, y1, f0, f1 = (v[:, None] if np.ndim(s) else v for v in (ya, yb, step * fa, step * fb))
        return np.asarray(
            (1 + 2 * s) * (1 - s) ** 2 * y0 + s**2 * (3 - 2 * s) * y1 + s * (1 - s) ** 2 * f0 + s**2 * (s - 1) * f1
        )

    return dense
