"""Time stepping: adaptive methods and three fixed-step ones, restarted where a law changes its branch or an event ends them.

Every method gives the same thing, a chain of `Step`s with a dense output each, so that later steps do not depend on the
method.

`through` steps one smooth piece of a first state, of a crank's angle, to its end: laws are continued smoothly past it, so
that the step which finds the end keeps its order, and so are switches at a speed, which are watched over every step and
located where they change sign. Its steps are explicit, and implicit where small changes die out many times over within a
piece: an explicit step must stay within a few time constants of the fastest change, however smooth the motion is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from itertools import islice, pairwise
from typing import Any, NamedTuple, TypeVar

import numpy as np

from bondgraph.elements import GraphError
from bondgraph.motion import runge_kutta
from bondgraph.motion.runge_kutta import ORDER_5, ORDER_8, DormandPrince, Implicit, Method, RateField, Rates, decay
from bondgraph.numerics import JUST_STARTED, Array, Indices, chebyshev_series, first_change, root

R = TypeVar("R")
Field = Callable[[float, Array], Array]

PLAIN: Mapping[str, Method] = {"RK45": ORDER_5, "DOP853": ORDER_8}  # stepped without arrays
ADAPTIVE = ("DOP853", "RK45", "RK23", "LSODA", "Radau", "BDF")
TIGHTEST = 3e-14  # tolerance of a step: below it the integrator's own rounding wins
PILOT, FIRST = 1e-4, 0.002  # tolerance of the run that only tells how large the states become; of the next, to rtol
FINEST, SHORTER = 1e-13, 0.7  # tolerance of a run's steps, below which rounding wins; further runs' steps to those before
WITHIN = np.array([0.27, 0.61, 1.0])  # parts of a step at which two runs are compared
LEAST_STEPS = 400  # of a run whose loads vary
_MOST_RUNS = 12
_NEAR = 1e-12  # of a period (or of 1): closer to a break than this is on it
_SPACING = float(np.finfo(float).eps)
_MOST_STEPS = 1_000_000
_MOST_STALLED = 200  # steps of LSODA after which the time is the same: it gets out of 60 of them


class StepError(GraphError):
    """A step that no method can take: the motion ends there, or the laws do; its time (s)."""

    def __init__(self, text: str, time: float = math.nan) -> None:
        super().__init__(text)
        self.time = time


class Step(NamedTuple):
    """One accepted step: its dense output, the time it covers, which watched value ended it, if any, the state after it.

    dense: the states at any time within, which several steps may share; None if not required. after: None if it is that of
    the dense output.
    """

    dense: Any
    start: float
    end: float
    crossed: int | None = None
    after: Any = None

    @property
    def first(self) -> Sequence[float]:
        """The state at its start."""
        return self.dense.state if isinstance(self.dense, runge_kutta.MethodStep) else self.at(self.start)

    @property
    def last(self) -> Sequence[float]:
        """The state at its end."""
        return self.at(self.end) if self.after is None else self.after

    def at(self, t: float) -> Sequence[float]:
        """The state at a time within it: of an explicit step that of a shorter one, which is good to the same order."""
        if isinstance(self.dense, runge_kutta.MethodStep) and t > self.start:
            return self.dense.shortened(t - self.start).after
        return tuple(self.dense(t).tolist())

    def reach(self, k: int) -> float:
        """Bound of what state k may pass both its ends by: by its rates at the stages of an explicit step, else infinite."""
        if isinstance(self.dense, runge_kutta.MethodStep):
            slopes = [slope[k] for slope in self.dense.slopes]
            return 0.5 * (self.end - self.start) * max(max(slopes), -min(slopes))
        return np.inf


def over(steps: Sequence[Step], shares: Array) -> tuple[Array, Array]:
    """Times (steps, n) and states (k, steps, n) at shares of the length of each of several steps."""
    times = np.array([step.start + (step.end - step.start) * shares for step in steps])
    explicit = [step.dense for step in steps if isinstance(step.dense, runge_kutta.MethodStep)]
    if len(explicit) == len(steps):
        return times, runge_kutta.over(explicit, times)
    return times, np.stack([step.dense(row) for step, row in zip(steps, times, strict=True)], axis=1)


def owners(stretches: Sequence[Step], times: Array) -> Indices:
    """The places of the steps that times lie in."""
    ends = np.array([s.end for s in stretches])
    return np.clip(np.searchsorted(ends, times), 0, ends.size - 1)


Tableau = tuple[tuple[float, ...], tuple[tuple[float, ...], ...], tuple[float, ...]]
"""An explicit Runge-Kutta method: stage times, stage weights, weights of the step."""
FIXED: Mapping[str, Tableau] = {
    "euler": ((0.0,), ((),), (1.0,)),
    "rk2": ((0.0, 1.0), ((), (1.0,)), (0.5, 0.5)),  # the trapezoidal form, Heun's
    "rk4": ((0.0, 0.5, 0.5, 1.0), ((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
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


def field_of(rates: Rates) -> Field:
    """Rates in plain numbers as a field of arrays."""
    return lambda t, state: np.array(rates(t, state.tolist()), dtype=float)


def adaptive(
    method: str,
    rates: Rates,
    t: float,
    state: Array,
    until: float,
    tolerance: tuple[float, Array],
    longest: float = np.inf,
    *,
    dense: bool = True,
    length: Callable[[float], float] | None = None,
) -> Iterator[Step]:
    """Steps of an adaptive method; `tolerance` is relative and, for every state, absolute; `longest` a step's, s.

    `rates` takes and gives plain numbers. `length` gives a step's longest by the time that it starts at, for methods of one
    step. Explicit steps of order 5 and 8 are taken in plain numbers; the others are scipy's.
    """
    relative, absolute = max(tolerance[0], TIGHTEST), tolerance[1]
    if method in PLAIN:
        allowed = np.broadcast_to(absolute, state.shape).tolist()
        runner = DormandPrince(rates, t, state.tolist(), until, relative, allowed, method=PLAIN[method])
        while runner.t < until:
            start = runner.t
            runner.h = min(runner.h, longest, longest if length is None else length(start))
            step = runner.step()
            if step is None or not np.isfinite(sum(step.after)):
                message = "Required step size is less than spacing between numbers." if step is None else "it is not finite"
                raise StepError(f"the motion cannot be followed past t = {start:.9g} s: {message}")
            yield Step(step if dense else None, start, runner.t, after=np.array(step.after))
        return
    from scipy import integrate

    options: Any = {"max_step": longest, "rtol": relative, "atol": absolute}
    solver: Any = getattr(integrate, method)(field_of(rates), t, state, until, **options)
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
            yield Step(solver.dense_output() if dense else None, float(solver.t_old), float(solver.t), after=solver.y)


def agreement(
    run: R, tighter: Callable[[float, R], tuple[R, float]], rtol: float, tolerance: float, patience: float = math.inf
) -> tuple[R, float]:
    """A run at so tight a tolerance that one of a looser one agrees with it within rtol, or rounding wins; and its error.

    `tighter(tolerance, looser)` gives a further run, and its error by the difference to the looser one. After more runs than
    `patience` without a gain the last one stands.
    """
    before, expected, idle, error = math.inf, 0.0, 0, math.inf
    for _ in range(_MOST_RUNS):
        part = 0.2 if expected <= rtol else max(1e-3, 0.2 * rtol / expected)
        tolerance = max(part * tolerance, FINEST)
        run, error = tighter(tolerance, run)
        error = max(error, tolerance)
        idle = idle + 1 if error > 0.5 * before else 0
        if error <= rtol or (idle and tolerance <= FINEST) or idle > patience:
            break
        before, expected = error, part * error
    return run, error


def fixed(method: str, rates: Rates, t: float, state: Array, until: float, step: float) -> Iterator[Step]:
    """Equal steps of a fixed-step method, the last one cut to end at `until`; Hermite's cubic between (Euler's a line)."""
    tableau, field = FIXED[method], field_of(rates)
    rate = field(t, state)
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
        ends = ((after - state) / (end - start),) * 2 if len(tableau[0]) == 1 else (rate, rate_after)  # a line of Euler's
        yield Step(hermite(float(start), float(end), state, after, *ends), float(start), float(end), after=after)
        state, rate = after, rate_after


SERIES = 30  # terms of a Taylor series
_RADIANS, _SHARES = 5.0, 10  # of a step times the greatest |eigenvalue|; parts of a step


class Taylor(NamedTuple):
    """The states within a step of h (s) from a time: terms (k, n) of their Taylor series in the share of the step."""

    time: float
    h: float
    terms: Array

    def __call__(self, t: Any) -> Array:
        """The states at a time (n,) or at times (n, times)."""
        share = (np.asarray(t) - self.time) / self.h
        return np.asarray(np.tensordot(self.terms, share ** np.arange(SERIES + 1).reshape(-1, *[1] * share.ndim), (0, 0)))


def taylor(
    linear: tuple[Array, Array, float],
    t: float,
    state: Array,
    until: float,
    tolerance: tuple[float, Array],
    length: Callable[[float], float],
) -> Iterator[Step]:
    """Steps of y' = A y + b by its Taylor series, y(t + s h) = sum s^j d_j, d_1 = h (A y + b), d_j = h A d_(j-1) / j.

    A step is so long that its last two terms are within the tolerance, relative and, for every state, absolute, and that no
    term outgrows the states by far. `linear` holds A, b and the greatest |eigenvalue| of A, 1/s; `length` gives the longest
    part of a step by the time that it starts at.

    >>> decaying = np.array([[-2.0]]), np.ones(1), 2.0
    >>> steps = list(taylor(decaying, 0.0, np.zeros(1), 3.0, (0.0, np.full(1, 1e-12)), lambda t: np.inf))
    >>> bool(abs(steps[-1].after[0] - 0.5 * (1.0 - np.exp(-6.0))) < 1e-12)
    True
    """
    matrix, constant, fastest = linear
    while t < until:
        h = min(until - t, _SHARES * length(t), _RADIANS / fastest if fastest else np.inf)
        terms = np.empty((SERIES + 1, state.size))
        terms[0], terms[1] = state, h * (matrix @ state + constant)
        for j in range(2, SERIES + 1):
            terms[j] = (h / j) * (matrix @ terms[j - 1])
        allowed = tolerance[0] * np.abs(state) + tolerance[1]
        over = [float(np.max(np.abs(terms[j]) / allowed, initial=0.0)) ** (1.0 / j) for j in (SERIES - 1, SERIES)]
        share = min(1.0, 0.9 / max(*over, 0.9))
        if not np.isfinite(terms).all():
            raise StepError(f"the motion cannot be followed past t = {t:.9g} s: it is not finite")
        dense = Taylor(t, share * h, terms * share ** np.arange(SERIES + 1.0)[:, None])
        end = until if share == 1.0 and h == until - t else t + share * h
        edges = np.linspace(t, end, _SHARES + 1)
        for start, stop, after in zip(edges[:-1].tolist(), edges[1:].tolist(), dense(edges[1:]).T, strict=True):
            yield Step(dense, start, stop, after=after)
        t, state = end, after


def runge_kutta_step(tableau: Tableau, field: Field, t: float, state: Array, step: float, rate: Array) -> Array:
    """The state a step later: y + h sum b_i k_i, k_i = f(t + c_i h, y + h sum a_ij k_j), k_1 = `rate`.

    >>> import numpy as np
    >>> runge_kutta_step(FIXED["rk4"], lambda t, y: y, 0.0, np.ones(1), 1.0, np.ones(1))[0] == 1 + 1 + 1/2 + 1/6 + 1/24
    np.True_
    """
    (_, *nodes), (_, *stages), weights = tableau
    slopes = [rate]
    for node, before in zip(nodes, stages, strict=True):
        between = sum((w * k for w, k in zip(before, slopes, strict=True)), start=np.zeros_like(state))
        slopes.append(field(t + node * step, state + step * between))
    total = sum((w * k for w, k in zip(weights, slopes, strict=True)), start=np.zeros_like(state))
    return np.asarray(state + step * total)


def through_breaks(
    steps: Callable[[float, Array, float, Mapping[int, float]], Iterator[Step]],
    rate: Callable[[float, Array], Array],
    breaks: Sequence[Breaks],
    times: Sequence[float],
    state: Array,
    until: float,
) -> Iterator[Step]:
    """Steps from t = 0 to `until`, restarted at every time and every break that a state passes.

    `steps(t, state, stop, anchors)` makes the steps of one piece up to a time; `anchors` are the middles of the pieces.
    """
    t, taken = 0.0, 0
    for stop in [*sorted(time for time in times if 0.0 < time < until), until]:
        while t < stop:
            began = t
            pieces, anchors = {}, {}
            for b in breaks:
                now = rate(t, state)  # which way the state continues from where it is; at rest, which way it starts off
                onward = now[b.place] if now[b.place] != 0.0 else rate(t, state + 1e-9 * now)[b.place]
                low, high = b.around(state[b.place], bool(onward > 0.0 or (onward == 0.0 and now[b.place] == 0.0)))
                middle = low + 1.0 if np.isinf(high) else 0.5 * (low + high)
                if np.isinf(low):
                    middle = high - 1.0 if np.isfinite(high) else 0.0
                pieces[b.place], anchors[b.place] = (low, high), middle
            bounds = [(k, end, side) for k, piece in pieces.items() for end, side in zip(piece, (1.0, -1.0), strict=True)]
            bounds = [bound for bound in bounds if np.isfinite(bound[1])]
            places, ends, sides = (np.array([bound[k] for bound in bounds]) for k in range(3))

            def distances(times: Array, states: Array) -> Array:
                """The distances of states from the ends of their pieces."""
                return np.asarray(states[places] - ends[:, None])  # noqa: B023 - called at once

            for step in steps(t, state, stop, anchors):
                left, end, state = None, step.end, step.after
                if bounds:
                    sizes = [np.abs(ends), *(np.abs(np.asarray(at)[places]) for at in (step.first, step.after))]
                    rounding = 8 * _SPACING * np.maximum.reduce(sizes)
                    step = crossing(Events(distances, sides, rounding=rounding), step)
                    left, end = step.crossed, step.end
                if left is not None:
                    state = np.array(step.dense(end))
                    state[places[left]] = ends[left]
                if left is not None and end == began:
                    names = ", ".join(
                        f"{b.name} = {state[b.place]:.9g}" for b in breaks if state[b.place] in pieces[b.place]
                    )
                    raise GraphError(
                        f"the motion sticks at {names}, t = {t:.9g} s: the laws on both sides drive it back there"
                    )
                yield step._replace(crossed=None, after=state)
                t, taken = end, taken + 1
                if taken > _MOST_STEPS:
                    raise GraphError(
                        f"{_MOST_STEPS} steps reach t = {t:.6g} s only: ask for a shorter time or a larger rtol, or use a "
                        "method for stiff equations (Radau, LSODA)"
                    )
                if left is not None:
                    break


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


# -- one piece of one state ----------------------------------------------------------------------------------------------

_BEYOND = 1.05  # of the way to a piece's end: how far a step may try
_NEARLY = 0.95  # of that way: a step that is longer is made to end there
_SHORT = 0.03  # of a step: by how much it may be made longer to end there
_LINEAR = 1e-8  # of a step: its square is rounding
_SECOND = 0.1 * TIGHTEST  # of a state: the second term of a remainder, beside which the others are rounding
_MOST_LANDINGS = 8
_ALIKE = 0.01  # of a speed: a greater change on the way to a piece's end is not foreseen by a mean
STABLE = {5: 3.3, 8: 6.1}  # step times decay rate that explicit steps of an order bear
_MANY = 128  # explicit steps in a stretch, after which implicit ones are tried
_PARTS = 3  # in which an implicit step is divided, each as smooth as an explicit step


class Events(NamedTuple):
    """Values that end the stepping where one of them leaves its side: `values(t, states)` for times (n,) and states (k, n).

    `values` returns an array (values, n); `sides` are their signs (1.0 or -1.0) within the step. `clear` is a quick test of
    an explicit step, true if no value can leave its side there. `residuals` is the amount by which each value may still be
    on the other side at the beginning of a stretch: the previous stretch ended at an event of its dense output, and the next
    one begins with the state of the step, which is of a higher order. A value of at most its `rounding` counts as zero.
    """

    values: Callable[[Array, Array], Array]
    sides: Array
    clear: Callable[[runge_kutta.MethodStep], bool] | None = None
    residuals: Array | None = None
    rounding: Array | None = None


def residuals(sides: Array, start: Array) -> Array:
    """The amounts by which values at the start of a stretch lie on the other side than within it.

    >>> residuals(np.array([1.0, -1.0]), np.array([-2e-8, -5.0])).tolist()
    [2e-08, 0.0]
    """
    return np.where(sides * start < 0.0, np.abs(start), 0.0)


class Piece(NamedTuple):
    """A smooth piece of the range of phi, the first state, to be stepped through until phi leaves it or t reaches `until`.

    With `along`, the rates at many instants at once, stretches in which small changes die out many times over are stepped
    implicitly, and so is the rest of one that takes many steps. `length` gives the longest of explicit steps by the time
    that they start at. The tolerance of a step is relative and, for each variable, absolute.
    """

    rates: Rates
    ends: tuple[float, float]
    until: float
    tolerance: tuple[float, Array]
    along: RateField | None = None
    length: Callable[[float], float] | None = None

    def end(self, speed: float) -> float:
        """The end that phi moves to."""
        return self.ends[1] if speed > 0.0 else self.ends[0]

    def rest(self, speed: float, t: float, state: Array) -> float:
        """Approximate time to the end of phi's range, or to the last time."""
        return min(abs(self.end(speed) - float(state[0])) / abs(speed) if speed else np.inf, self.until - t)


def through(piece: Piece, t: float, state: Array, hint: float | None, events: Events | None = None) -> Iterator[Step]:
    """Steps from a state until phi leaves a piece, t reaches its last time, or a watched value leaves its side.

    The last one ends exactly there. `hint` is the length of the first step. Events are searched for in several steps at
    once.
    """
    # which side of a switch the motion continues to asks for states of the steps' own order
    switching = events is not None and events.clear is None
    steps = _onwards(piece, t, state, hint, ORDER_8 if switching else runge_kutta.method(piece.tolerance[0]))
    if events is None:
        yield from steps
        return
    count, ended = _FIRST_WATCHED if switching else 1, False
    beyond: Exception | None = None  # beyond an event laws are only continued
    while not ended and beyond is None:
        several = list[Step]()
        try:
            for step in islice(steps, count):
                several.append(step)
        except (ValueError, ArithmeticError) as error:
            beyond = error
        may_cross, ended = _may_cross(events, several), len(several) < count
        for step, doubtful in zip(several, may_cross, strict=True):
            step = crossing(events, step) if doubtful else step
            yield step
            if step.crossed is not None:
                return
        count = min(2 * count, _MOST_WATCHED) if switching else 1
    if beyond is not None:
        raise beyond


def _onwards(piece: Piece, t: float, state: Array, hint: float | None, method: Method) -> Iterator[Step]:
    """The same without watched values, explicit steps by a method."""
    rates, _, until, (relative, absolute), along, length = piece
    if along is not None and not along.plain and 0.0 < along.stiff < np.inf:  # so many time constants ahead hold steps up
        fastest = decay(rates, along.sizes, t, state.tolist())
        stiff = fastest * piece.rest(float(rates(t, state)[0]), t, state) > along.stiff
    else:
        stiff = along is not None and along.stiff == 0.0 and not along.plain
    if along is not None and stiff:
        done, t, state = yield from _implicit_steps(piece, along, t, state)
        if done:
            return
        along = None
    first = min(1.1 * hint, until - t) if hint else None  # a little more, so that an equal piece takes one step too
    solver = DormandPrince(rates, t, state.tolist(), until, relative, absolute.tolist(), first, method)
    taken = 0
    while solver.t < until:
        speed = solver.f[0]
        if speed:  # far past the piece's end the laws are only continued
            far = abs((piece.end(speed) - solver.y[0]) / speed)
            if solver.h > _NEARLY * far:  # by the mean of the speeds now and there, where they are alike
                try:
                    there = tuple(y + far * rate for y, rate in zip(solver.y, solver.f, strict=True))
                    ahead = float(rates(solver.t + far, there)[0])
                except (ValueError, ArithmeticError):
                    ahead = speed
                slower = 2.0 * speed / (speed + ahead) if speed * ahead > 0.0 else 1.0
                far *= slower if abs(slower - 1.0) < _ALIKE else 1.0
                solver.h = min(solver.h, max(far, 1e-9 * (until - solver.t) if until < np.inf else 0.0))
        if length is not None:
            solver.h = min(solver.h, length(solver.t))
        accepted = solver.step()
        if accepted is None:
            raise StepError(f"no step is short enough past t = {solver.t:.9g} s", solver.t)
        missing = piece.end(solver.f[0]) - accepted.after[0]
        inside = speed * solver.f[0] > 0.0 and abs(missing) > 2.0 * _SHORT * accepted.h * abs(solver.f[0])
        inside = inside and piece.ends[0] < accepted.after[0] < piece.ends[1]
        step = None if inside else _landing(piece, accepted)
        over = step is not None
        if step is None:
            step = Step(accepted, accepted.t, solver.t, after=accepted.after)
            if not inside:
                step, over = _cut(piece, step, speed, solver.f[0])
        yield step
        if over:
            return
        taken += 1
        if along is not None and taken % _MANY == 0:
            cheaper, mean, now = not along.plain, (solver.t - t) / taken, np.array(solver.y)
            if along.plain and piece.rest(solver.f[0], solver.t, now) > _MANY * mean:  # where stability limits many steps
                cheaper = mean * decay(rates, along.sizes, solver.t, solver.y) > 0.5 * STABLE[solver.method.order]
            if cheaper:
                rest = piece._replace(along=along._replace(stiff=0.0, plain=False))
                yield from _onwards(rest, solver.t, now, None, method)
                return


def _landing(piece: Piece, step: runge_kutta.MethodStep) -> Step | None:
    """The step made to end where phi leaves the piece, by Newton's method; None if it ends well inside, or reverses.

    None, too, where phi leaves the piece after its last time. Over the final remainder every state changes by two terms of
    its series, of which the second is hardly above rounding.
    """
    start, speed, (relative, absolute) = step.slopes[0][0], step.slopes[-1][0], piece.tolerance
    end = piece.end(speed)
    for _ in range(_MOST_LANDINGS):
        if start * speed < 0.0 or speed == 0.0:
            return None
        missing = (end - step.after[0]) / speed
        missing *= 1.0 - 0.5 * missing * (speed - start) / (step.h * speed)
        if not -step.h < missing < _SHORT * step.h:
            return None
        curved = 0.5 * missing * missing / step.h
        bent = [curved * (last - first) for first, last in zip(step.slopes[0], step.slopes[-1], strict=True)]
        close = abs(missing) <= _LINEAR * step.h
        if not close:
            sizes = (absolute / relative).tolist()
            close = all(abs(b) <= _SECOND * (size + abs(y)) for b, size, y in zip(bent, sizes, step.after, strict=True))
        if close:
            rows = zip(step.after, step.slopes[-1], bent, strict=True)
            after = [y + missing * rate + b for y, rate, b in rows]
            last = step.t + step.h + missing
            return Step(step, step.t, last, after=(end, *after[1:])) if last <= piece.until else None
        step = step.shortened(step.h + missing)
        speed = step.slopes[-1][0]
    return None


def _cut(piece: Piece, step: Step, before: float, after: float) -> tuple[Step, bool]:
    """A step cut where phi leaves the piece, True if it does: it may leave it and reverse before the step is over."""
    dense, start, turns, ends = step.dense, step.start, step.end, piece.ends
    if before * after < 0.0:
        turns = root(lambda t: float(piece.rates(t, step.dense(t))[0]), step.start, step.end)
    for stop in turns, step.end:
        phi = float(step.last[0] if stop == step.end else dense(stop)[0])
        if phi >= ends[1] or phi < ends[0]:
            end = ends[1] if phi >= ends[1] else ends[0]
            leaves = root(lambda t: float(dense(t)[0]) - end, start, stop)  # noqa: B023 - called at once
            return step._replace(end=leaves, after=None), True
        start = stop
    return step, False


def _implicit_steps(
    piece: Piece, along: RateField, t: float, state: Array
) -> Generator[Step, None, tuple[bool, float, Array]]:
    """Implicit steps, each in parts; whether the stretch came to its end, or where no step was accepted."""
    until = piece.until
    solver = Implicit(along, t, state, *piece.tolerance)
    speed = float(piece.rates(t, state)[0])
    while solver.t < until:
        start, rest = solver.t, piece.rest(speed, solver.t, solver.state)
        dense = solver.step(min(_BEYOND * rest, until - start), speed)
        if dense is None:
            return False, solver.t, solver.state
        edges = np.linspace(start, solver.t, _PARTS + 1)
        speeds = along.rates(edges, dense(edges))[0].tolist()
        for (low, before), (high, speed) in pairwise(zip(edges.tolist(), speeds, strict=True)):
            step, over = _cut(piece, Step(dense, low, high), before, speed)
            yield step
            if over:
                return True, solver.t, solver.state
    return True, solver.t, solver.state


_EXPLICIT_SERIES, _IMPLICIT_SERIES = chebyshev_series(9), chebyshev_series(13)  # LSODA's dense output has degree 12
_FIRST_WATCHED, _MOST_WATCHED = 4, 16  # steps in which events are searched for at once: one search takes as long as several
_NEAR_ROOT = 1e-5  # of a step: how far beside the root of a polynomial that of the motion is searched for


def _may_cross(events: Events, steps: Sequence[Step]) -> list[bool]:
    """Tests which steps a watched value may leave its side in: all but those where its series cannot reach 0.

    A value that is 0 all over a step stays on its side, such as the moment through a mesh with nothing behind it.
    """
    if len(steps) < 2 or not events.sides.size:
        return [True] * len(steps)
    nodes, to_series = _IMPLICIT_SERIES
    times, states = over(steps, nodes)
    with np.errstate(all="ignore"):  # as beyond an event
        values = events.sides[:, None] * events.values(times.ravel(), states.reshape(len(states), -1))
    values = values.reshape(-1, *times.shape)
    series = values @ to_series.T
    least = series[..., 0] - np.abs(series[..., 1:]).sum(axis=-1)
    if events.rounding is not None:
        least -= events.rounding[:, None]
    clear = (least > 0.0) | (values == 0.0).all(axis=-1)
    return [not one for one in clear.all(axis=0).tolist()]


def crossing(events: Events, step: Step) -> Step:
    """The step, cut where the first of the watched values leaves its side; at its start where one does so at once.

    The share of a step after which a value is first below 0 follows from its values and the roots of its polynomial.
    """
    width = step.end - step.start
    if not (events.sides.size and width > 0.0):
        return step
    if events.clear is not None and isinstance(step.dense, runge_kutta.MethodStep) and events.clear(step.dense):
        return step

    def inside(shares: Array) -> Array:
        times = step.start + width * shares
        values_there = events.sides[:, None] * events.values(times, step.dense(times))
        values_there = values_there if events.residuals is None else values_there + events.residuals[:, None]
        return (
            values_there
            if events.rounding is None
            else np.where(np.abs(values_there) > events.rounding[:, None], values_there, 0.0)
        )

    nodes, to_series = _EXPLICIT_SERIES if isinstance(step.dense, runge_kutta.MethodStep) else _IMPLICIT_SERIES
    values = inside(nodes)
    first: tuple[float, int] | None = None
    for k, series in enumerate(values @ to_series.T):

        def one(shares: Array, k: int = k) -> Array:
            return np.asarray(inside(shares)[k])

        change = first_change(one, nodes, values[k], series, JUST_STARTED)
        if change is None or (first is not None and change[0] >= first[0]):
            continue
        low, high, roots = change
        near = roots[(roots > low) & (roots < high)]
        ends: tuple[float, float] | None = None
        if near.size:  # close about a root of its polynomial, where that is one of its own
            tried = np.clip(near[0] + np.array([-_NEAR_ROOT, _NEAR_ROOT]), low, high)
            before, after = one(tried).tolist()
            if before > 0.0 > after:
                (low, high), ends = tried.tolist(), (before, after)
        share = low if low == high else root(lambda share: float(one(np.array([share]))[0]), low, high, ends)
        if first is None or share < first[0]:
            first = share, k
    return step if first is None else step._replace(end=step.start + width * first[0], crossed=first[1], after=None)
