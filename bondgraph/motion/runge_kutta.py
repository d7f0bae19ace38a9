"""Runge-Kutta methods: the explicit ones of Dormand and Prince, of order 5 and 8, and the implicit one of Radau.

The loose tolerances are met for the least work by order 5: 6 evaluations of the rates a step, and a polynomial of order 4
within it that costs none. Order 8 takes 12; its error is an estimate of order 5 corrected by one of order 3; the motion
within a step is a polynomial of order 7, whose 3 further evaluations are made when somebody asks for it. The arithmetic of a
step is written out for the number of states, without arrays: of two or three states that is ten times as fast.

Implicit steps (`Implicit`) are collocation at Radau points (Radau IIA), which damps what dies out at any step, by Newton's
method: for motions in which small changes die out many times over within a step, to which an explicit step must keep.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, sections II.4 to II.6,
with the coefficients of their codes DOPRI5 and DOP853; II, 1996, sections IV.5 and IV.8.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, legendre

from bondgraph.numerics import Array, Indices

State = tuple[float, ...]
Rates = Callable[[float, Any], Any]

_SAFETY, _LEAST, _MOST = 0.9, 0.2, 10.0  # of one step's length over that of the one before
MANY = 24  # states from which on arrays take less time than plain numbers
_SHORTEST = 10.0  # spacings of the numbers at a step's time
_SPACING = float(np.finfo(float).eps)
_LOOSE = 3e-7  # tolerance of a step: down to it order 5 takes less work than order 8


class Method(NamedTuple):
    """Weights of a method: of its stages and of the step (whose rates are the last slope, and the next step's first).

    errors: e, or e and f, whose estimate is |e|²/sqrt(|e|² + 0.01 |f|²). within: the stages that the polynomial within a
    step asks for beside, and dense the weights of its highest terms.
    """

    order: int
    stages: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]
    errors: tuple[tuple[float, ...], ...]
    within: tuple[tuple[float, ...], ...]
    dense: tuple[tuple[float, ...], ...]


# fmt: off
ORDER_5 = Method(
    order=5,
    stages=(
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    ),
    weights=(35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    errors=((-71 / 57600, 0.0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40),),
    within=(),
    dense=(
        (-12715105075 / 11282082432, 0.0, 87487479700 / 32700410799, -10690763975 / 1880347072,
         701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423),
    ),
)
ORDER_8 = Method(
    order=8,
    stages=(
        (0.05260015195876773,),
        (0.0197250569845379, 0.0591751709536137),
        (0.02958758547680685, 0.0, 0.08876275643042054),
        (0.2413651341592667, 0.0, -0.8845494793282861, 0.924834003261792),
        (0.037037037037037035, 0.0, 0.0, 0.17082860872947386, 0.12546768756682242),
        (0.037109375, 0.0, 0.0, 0.17025221101954405, 0.06021653898045596, -0.017578125),
        (0.03709200011850479, 0.0, 0.0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402,
         0.008273789163814023),
        (0.6241109587160757, 0.0, 0.0, -3.3608926294469414, -0.868219346841726, 27.59209969944671, 20.154067550477894,
         -43.48988418106996),
        (0.47766253643826434, 0.0, 0.0, -2.4881146199716677, -0.590290826836843, 21.230051448181193, 15.279233632882423,
         -33.28821096898486, -0.020331201708508627),
        (-0.9371424300859873, 0.0, 0.0, 5.186372428844064, 1.0914373489967295, -8.149787010746927, -18.52006565999696,
         22.739487099350505, 2.4936055526796523, -3.0467644718982196),
        (2.273310147516538, 0.0, 0.0, -10.53449546673725, -2.0008720582248625, -17.9589318631188, 27.94888452941996,
         -2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636),
    ),
    weights=(
        0.054293734116568765, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
        0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259,
    ),
    errors=(
        (
            0.01312004499419488, 0.0, 0.0, 0.0, 0.0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
            -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294,
        ),
        (
            -0.18980075407240762, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
            -0.4226823213237919, -0.1521609496625161, 0.20136540080403034, 0.02265179219836082,
        ),
    ),
    within=(
        (0.056167502283047954, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25350021021662483, -0.2462390374708025, -0.12419142326381637,
         0.15329179827876568, 0.00820105229563469, 0.007567897660545699, -0.008298),
        (0.03183464816350214, 0.0, 0.0, 0.0, 0.0, 0.028300909672366776, 0.053541988307438566, -0.05492374857139099, 0.0, 0.0,
         -0.00010834732869724932, 0.0003825710908356584, -0.00034046500868740456, 0.1413124436746325),
        (-0.42889630158379194, 0.0, 0.0, 0.0, 0.0, -4.697621415361164, 7.683421196062599, 4.06898981839711,
         0.3567271874552811, 0.0, 0.0, 0.0, -0.0013990241651590145, 2.9475147891527724, -9.15095847217987),
    ),
    dense=(
        (-8.428938276109013, 0.0, 0.0, 0.0, 0.0, 0.5667149535193777, -3.0689499459498917, 2.38466765651207,
         2.117034582445028, -0.871391583777973, 2.2404374302607883, 0.6315787787694688, -0.08899033645133331,
         18.148505520854727, -9.194632392478356, -4.436036387594894),
        (10.427508642579134, 0.0, 0.0, 0.0, 0.0, 242.28349177525817, 165.20045171727028, -374.5467547226902,
         -22.113666853125306, 7.733432668472264, -30.674084731089398, -9.332130526430229, 15.697238121770845,
         -31.139403219565178, -9.35292435884448, 35.81684148639408),
        (19.985053242002433, 0.0, 0.0, 0.0, 0.0, -387.0373087493518, -189.17813819516758, 527.8081592054236,
         -11.57390253995963, 6.8812326946963, -1.0006050966910838, 0.7777137798053443, -2.778205752353508,
         -60.19669523126412, 84.32040550667716, 11.99229113618279),
        (-25.69393346270375, 0.0, 0.0, 0.0, 0.0, -154.18974869023643, -231.5293791760455, 357.6391179106141,
         93.40532418362432, -37.45832313645163, 104.0996495089623, 29.8402934266605, -43.53345659001114, 96.32455395918828,
         -39.17726167561544, -149.72683625798564),
    ),
)
# fmt: on


def method(tolerance: float) -> Method:
    """The method that takes steps of a relative tolerance for the least work.

    >>> method(1e-4).order, method(1e-10).order
    (5, 8)
    """
    return ORDER_5 if tolerance >= _LOOSE else ORDER_8


Stepping = Callable[..., tuple[float, State, tuple[State, ...]]]


@cache
def _written(method: Method, count: int) -> Stepping:
    """A step of so many states, written out: its error in terms of what is allowed, the states after it, and its slopes.

    Of rates, time, length, states, slopes at the start, relative and absolute error allowed; not a number for an error where
    the states are not.
    """
    if count >= MANY:
        return _by_arrays(method, count)

    def total(row: Sequence[float], k: int) -> str:
        return " + ".join(f"{weight!r} * s{j}_{k}" for j, weight in enumerate(row) if weight)

    def each(text: Callable[[int], str]) -> str:
        return "".join(text(k) + ", " for k in range(count))

    def named(name: str) -> str:
        return f"    {each(lambda k: f'{name}_{k}')}= {name}" if count else ""

    lines = ["def step(rates, t, h, y, s0, relative, absolute):", named("y"), named("s0"), named("absolute")]
    for j, row in enumerate(method.stages, 1):
        moved = each(lambda k: f"y_{k} + h * ({total(row, k)})")  # noqa: B023 - called at once
        lines += [f"    s{j} = rates(t + {math.fsum(row)!r} * h, ({moved}))", named(f"s{j}")]
    last = len(method.weights)
    lines += [f"    z_{k} = y_{k} + h * ({total(method.weights, k)})" for k in range(count)]
    lines += [f"    z = ({each(lambda k: f'z_{k}')})", f"    s{last} = rates(t + h, z)", named(f"s{last}")]
    for k in range(count):
        lines += [f"    a, b = abs(y_{k}), abs(z_{k})", f"    size_{k} = absolute_{k} + relative * (a if a > b else b)"]
    for name, row in zip("ef", method.errors, strict=False):
        squares = " + ".join(f"(({total(row, k)}) / size_{k}) ** 2" for k in range(count))
        lines.append(f"    {name} = {squares or 0.0}")
    error = "e / sqrt(total)" if len(method.errors) == 2 else "sqrt(e)"
    lines.append(f"    total = e{' + 0.01 * f' if len(method.errors) == 2 else ''}")
    slopes = ", ".join(f"s{j}" for j in range(last + 1))
    lines.append(f"    return (h * {error} / {math.sqrt(max(count, 1))!r} if total else 0.0), z, ({slopes})")
    names: dict[str, Any] = {"sqrt": math.sqrt}
    exec("\n".join(lines), names)  # made of the coefficients above alone
    return names["step"]  # type: ignore[no-any-return]


def _by_arrays(method: Method, count: int) -> Callable[..., Any]:
    """The same step with arrays, which take less time where states are many."""
    stages, weights = [np.array(row) for row in method.stages], np.array(method.weights)
    errors, times = [np.array(row) for row in method.errors], [math.fsum(row) for row in method.stages]
    last, size = len(weights), math.sqrt(count)

    @np.errstate(all="ignore")
    def step(
        rates: Rates, t: float, h: float, y: State, s0: State, relative: float, absolute: Sequence[float]
    ) -> tuple[float, State, tuple[State, ...]]:
        first, slopes, ends = np.array(y), np.empty((last + 1, count)), [s0]
        slopes[0] = s0
        for j, row in enumerate(stages, 1):
            ends.append(tuple(rates(t + times[j - 1] * h, tuple((first + h * (row @ slopes[:j])).tolist()))))
            slopes[j] = ends[j]
        end = first + h * (weights @ slopes[:last])
        after = tuple(end.tolist())
        ends.append(tuple(rates(t + h, after)))
        slopes[last] = ends[last]
        allowed = np.array(absolute) + relative * np.maximum(np.abs(first), np.abs(end))
        squares = [float(np.sum(((row @ slopes[: len(row)]) / allowed) ** 2)) for row in errors]
        total = squares[0] + (0.01 * squares[1] if len(squares) == 2 else 0.0)
        error = squares[0] / math.sqrt(total) if len(squares) == 2 and total else math.sqrt(squares[0])
        return h * error / size, after, tuple(ends)

    return step


class MethodStep:
    """A step: `state` (k,) at time `t`, and `after` at the end of its length `h`; `slopes` are the rates at its stages.

    As a function of a time, or of times (n,), it gives the states there, (k,) or (k, n).
    """

    __slots__ = ("_series", "after", "h", "method", "rates", "slopes", "state", "t")

    def __init__(
        self, method: Method, rates: Rates | None, t: float, h: float, state: State, after: State, slopes: Sequence[State]
    ) -> None:
        self.method, self.rates, self.t, self.h = method, rates, t, h
        self.state, self.after, self.slopes = state, after, slopes
        self._series: Array | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return MethodStep, (self.method, None, self.t, self.h, self.state, self.after, self._complete())

    def shortened(self, h: float) -> MethodStep:
        """The step from the same start over another length, whatever its error."""
        assert self.rates is not None
        nothing = (math.inf,) * len(self.state)
        stepping = _written(self.method, len(self.state))
        _, after, slopes = stepping(self.rates, self.t, h, self.state, self.slopes[0], 0.0, nothing)
        return MethodStep(self.method, self.rates, self.t, h, self.state, after, slopes)

    def __call__(self, t: Any) -> Array:
        """The states at a time within the step, or at times."""
        series = _series([self])[0]
        share = (np.asarray(t, dtype=float) - self.t) / self.h
        wide = (slice(None), *(None,) * share.ndim)
        return _evaluated(np.array(self.state)[wide], series[(..., *wide[1:])], share)

    def _complete(self) -> Sequence[State]:
        """The slopes at all stages, those of the polynomial within the step too."""
        before = len(self.slopes)
        rows = _within(self.method)[before - len(self.method.weights) - 1 :]
        if rows:
            assert self.rates is not None
            table, first = np.empty((before + len(rows), len(self.state))), np.array(self.state)
            table[:before] = self.slopes
            for k, (weights, node) in enumerate(rows, before):
                point: State = tuple((first + self.h * (weights @ table[:k])).tolist())
                table[k] = self.rates(self.t + node * self.h, point)
            self.slopes = (*self.slopes, *map(tuple, table[before:].tolist()))
        return self.slopes


@cache
def _within(method: Method) -> list[tuple[Array, float]]:
    """The weights and times of a method's stages for the polynomial within a step."""
    return [(np.array(row), math.fsum(row)) for row in method.within]


def _series(steps: Sequence[MethodStep]) -> Array:
    """Coefficients (steps, terms, k) of the states' gains in share (c0 + (1 - share) (c1 + share (c2 + ...)))."""
    method, fresh = steps[0].method, [step for step in steps if step._series is None]
    if fresh:
        slopes = np.array([step._complete() for step in fresh])
        gained = np.array([step.after for step in fresh]) - np.array([step.state for step in fresh])
        h = np.array([step.h for step in fresh])[:, None]
        first, last = slopes[:, 0], slopes[:, len(method.weights)]
        terms = [gained, h * first - gained, 2.0 * gained - h * (last + first)]
        rows = np.concatenate((np.stack(terms, axis=1), h[:, None] * np.matmul(np.array(method.dense), slopes)), axis=1)
        for step, own in zip(fresh, rows, strict=True):
            step._series = own
    return np.array([step._series for step in steps])


def _evaluated(state: Array, series: Array, share: Array) -> Array:
    """States of shape (k, ...), by their series (terms, k, ...) over shares of their steps."""
    sides, values = (share, 1.0 - share), np.zeros(np.broadcast_shapes(state.shape, share.shape))
    for j in range(series.shape[0] - 1, -1, -1):
        values = (values + series[j]) * sides[j % 2]
    return np.asarray(values + state)


def at(steps: Sequence[MethodStep], owners: Indices, times: Array) -> Array:
    """States (k, n) at times (n,), each by the step that owns it, for steps of one method."""
    used, where = np.unique(owners, return_inverse=True)
    mine = [steps[owner] for owner in used.tolist()]
    start, h = np.array([(step.t, step.h) for step in mine]).T
    states = np.array([step.state for step in mine]).T[:, where]
    return _evaluated(states, np.moveaxis(_series(mine), 0, -1)[..., where], (times - start[where]) / h[where])


def over(steps: Sequence[MethodStep], times: Array) -> Array:
    """States (k, steps, n) at times (steps, n) within each of several steps of one method."""
    states, (start, h) = np.array([step.state for step in steps]).T, np.array([(step.t, step.h) for step in steps]).T
    shares = (times - start[:, None]) / h[:, None]
    return _evaluated(states[..., None], np.moveaxis(_series(steps), 0, -1)[..., None], shares)


class DormandPrince:
    """The motion dy/dt = rates(t, y) from (t, y) on, stepped within a relative error and one of each state.

    `rates` takes a tuple of numbers and gives as many, as a tuple or an array. `f` are the rates at (t, y), and `h` is the
    length of the step to come, which may be changed before that is taken. A state whose absolute error is infinite is
    carried along, and shortens no step.
    """

    def __init__(
        self,
        rates: Rates,
        t: float,
        y: Sequence[float],
        until: float,
        relative: float,
        absolute: Sequence[float],
        h: float | None = None,
        method: Method = ORDER_8,
    ) -> None:
        self.t, self.y, self.method = float(t), tuple(map(float, y)), method
        first = rates(self.t, self.y)
        self.rates: Rates = (lambda t, y: rates(t, y).tolist()) if isinstance(first, np.ndarray) else rates
        self.f: State = tuple(map(float, first))
        self.until, self.relative, self.absolute = float(until), relative, tuple(map(float, absolute))
        self._step = _written(method, len(self.y))
        if h is None:
            # the length of the first step, by the sizes of the states, their rates, and how these change

            def size(values: Sequence[float]) -> float:
                return math.sqrt(sum((v / s) ** 2 for v, s in zip(values, sizes, strict=True)) / max(len(sizes), 1))

            sizes = [a + self.relative * abs(y) for a, y in zip(self.absolute, self.y, strict=True)]
            of_state, of_rates = size(self.y), size(self.f)
            length = min(1e-6 if of_state < 1e-5 or of_rates < 1e-5 else 0.01 * of_state / of_rates, self.until - self.t)
            ahead = self.rates(self.t + length, tuple(y + length * f for y, f in zip(self.y, self.f, strict=True)))
            bend = size([b - a for a, b in zip(self.f, ahead, strict=True)]) / length
            largest = max(of_rates, bend)
            second = max(1e-6, 1e-3 * length) if largest <= 1e-15 else (0.01 / largest) ** (1.0 / self.method.order)
            self.h = min(100.0 * length, second, self.until - self.t)
        else:
            self.h = h

    def step(self) -> MethodStep | None:
        """The next step, at most to `until`; None if none is short enough."""
        t, y, repeated, power = self.t, self.y, False, -1.0 / self.method.order
        shortest = _SHORTEST * math.ulp(t)
        h = max(self.h, shortest)
        while h >= shortest:
            last = t + h >= self.until
            if last:
                h = self.until - t
            try:
                error, after, slopes = self._step(self.rates, t, h, y, self.f, self.relative, self.absolute)
            except ArithmeticError:
                error = math.nan
            if error < 1.0:
                growth = min(_MOST, _SAFETY * error**power) if error else _MOST
                self.t, self.y, self.f = self.until if last else t + h, after, slopes[-1]
                self.h = h * (min(growth, 1.0) if repeated else growth)
                return MethodStep(self.method, self.rates, t, h, y, after, slopes)
            repeated = True
            h *= max(_LEAST, _SAFETY * error**power) if error < math.inf else _LEAST
        return None


# -- implicit steps -----------------------------------------------------------------------------------------------------

STAGES = 16  # order 31 at the end of a step, 16 within it
STIFF = 20.0  # time constants in a step: explicit steps are limited by stability from about here
_TRIED = 1e-7  # of a state's size: its change for a derivative by differences
_FIRST = 4.0  # time constants of the fastest change that a step of this order resolves
_MOST_NEWTON, _MOST_TRIES = 12, 40  # iterations in a step, and steps tried before one is accepted
_GROWTH = 10.0  # of one step over the one before, at the most
_SETTLED = 0.1  # of the tolerance: below it Newton's method has converged
_STALLED = 0.3  # of the change before: a larger change is rounding
_ROUGH = 1e-8  # of a state: a larger change is not rounding, but a diverging Newton iteration
_OPEN = 8.0  # added to the tolerance: 8 times the rounding of a step


class RateField(NamedTuple):
    """Rates of a motion at many instants at once: `rates(t, states)` for times (n,) and states (k, n) gives (k, n).

    `sizes` are sizes of the k states by which small changes of them are measured. `stiff` is how many time constants of the
    fastest change must lie ahead for implicit steps to be the cheaper ones: 0 if instants are costly one at a time,
    infinite without resistance. `plain` are rates of negligible cost one at a time: they are tested for stiffness after many
    steps.
    """

    rates: Callable[[Array, Array], Array]
    sizes: Array
    stiff: float = STIFF
    plain: bool = False

    def one(self, t: float, state: Any) -> Array:
        """The rates (k,) at one instant."""
        return self.rates(np.array([t]), np.array(state)[:, None])[:, 0]


def _radau() -> tuple[Array, Array, Array, Array]:
    """Radau's points on (0, 1]; matrices from values there to gains, to the series of gains, and to their own series."""
    ends = np.zeros(STAGES + 1)
    ends[-2:] = -1.0, 1.0
    points = np.append(np.sort(legendre.legroots(ends).real)[:-1], 1.0)
    to_series = np.linalg.inv(chebyshev.chebvander(points, STAGES - 1))
    up_to = np.array([chebyshev.chebval(points, chebyshev.chebint(row, lbnd=-1.0)) for row in np.eye(STAGES)]).T
    with_start = np.linalg.inv(chebyshev.chebvander(np.append(-1.0, points), STAGES))[:, 1:]
    return 0.5 + 0.5 * points, 0.5 * up_to @ to_series, with_start, to_series


_POINTS, _GAINS, _SERIES, _QUOTIENT = _radau()
_DEGREES = np.arange(STAGES)


@np.errstate(all="ignore")  # an iterate that runs away is given up where it is found not to be finite
def slopes(along: RateField, t: Array, states: Array) -> tuple[Array, Array]:
    """Rates (k, n) at instants, and what they change with each state: (k, k, n), by differences; not finite far off."""
    count, many = states.shape
    moved = np.repeat(states[:, None, :], count + 1, axis=1)
    for k in range(count):
        moved[k, k + 1] += _TRIED * along.sizes[k]
    rates = along.rates(np.tile(t, count + 1), moved.reshape(count, -1)).reshape(count, count + 1, many)
    steps = np.array([moved[k, k + 1] - states[k] for k in range(count)])
    return rates[:, 0], (rates[:, 1:] - rates[:, :1]) / steps


@np.errstate(all="ignore")
def decay(rates: Rates, sizes: Array, t: float, state: Sequence[float]) -> float:
    """The decay rate of the fastest small change of a state of a size, 1/s; 0 if none decays, or where it is unknown.

    >>> round(decay(lambda t, y: (y[1], -4.0 * y[1]), np.ones(2), 0.0, (0.0, 1.0)), 4)
    4.0
    """
    now, rows = np.array(rates(t, tuple(state))), []
    for k, (value, size) in enumerate(zip(state, sizes.tolist(), strict=True)):
        moved = value + _TRIED * size
        there = np.array(rates(t, (*state[:k], moved, *state[k + 1 :])))
        rows.append((there - now) / (moved - value))
    scaled = np.array(rows).T * sizes / sizes[:, None]
    if not np.isfinite(scaled).all():
        return 0.0
    return max(0.0, -float(np.linalg.eigvals(scaled).real.min()))


@dataclass(frozen=True, eq=False)
class _Polynomial:
    """The states within a step of h (s) from a time and a state, by their Chebyshev series over the share of the step."""

    time: float
    h: float
    state: Array
    series: Array

    def __call__(self, t: Any) -> Array:
        share = (np.asarray(t) - self.time) / self.h
        turned = np.arccos(np.minimum(np.maximum(2.0 * share - 1.0, -1.0), 1.0))  # rounding may pass the ends
        terms = np.cos(turned[..., None] * _DEGREES)
        return np.asarray(share[..., None] * (terms @ self.series) + self.state).T


class Implicit:
    """A motion stepped from (t, state), with relative and absolute errors allowed in a step as large as it can be."""

    def __init__(self, along: RateField, t: float, state: Array, relative: float, absolute: Array) -> None:
        self.along, self.relative, self.absolute = along, relative, np.maximum(absolute, 1e-300)
        self.t, self.state = t, state
        rate = decay(along.one, along.sizes, t, state.tolist())
        self.h = _FIRST / rate if rate > 0.0 else np.inf

    def step(self, longest: float, speed: float) -> Callable[[Any], Array] | None:
        """Takes a step, at most as long as given; its states at a time (k,) or at times (k, n). None if none is accepted.

        `speed` is the rate of the first state, by which Newton's method starts. At its start the states are exactly those
        that it starts with, where a speed may be 0.
        """
        h = min(self.h, longest)
        for _ in range(_MOST_TRIES):
            if not h > 4 * _SPACING * abs(self.t):
                return None
            result = self._solved(h, speed)
            change = 0.25 if result is None else self._change(*result)
            if result is not None and change >= 1.0:
                gained = result[0]
                dense = _Polynomial(self.t, h, self.state, ((gained / _POINTS) @ _QUOTIENT.T).T)
                self.h, self.t, self.state = h * min(change, _GROWTH), self.t + h, self.state + gained[:, -1]
                return dense
            h *= max(change, 0.2)
        return None

    def _allowed(self, states: Array) -> Array:
        return np.asarray(self.absolute + self.relative * np.abs(states).max(axis=1))

    def _change(self, gained: Array, rounding: Array) -> float:
        """Factor for the length of a step, by the decay of its Chebyshev terms; below 1 the step is repeated."""
        terms = np.abs(gained @ _SERIES.T)
        allowed = self._allowed(self.state[:, None] + gained) + _OPEN * rounding
        miss = float((terms[:, -2:].max(axis=1) / allowed).max())
        if miss > 1.0:
            return float(min(0.8 * miss ** (-1.0 / STAGES), 0.7))
        counted = np.max(np.where(terms > allowed[:, None], np.arange(1, STAGES + 2), 1), axis=1)
        share = np.minimum(allowed / np.maximum(terms.max(axis=1), 1e-300), 1.0)
        growth = 0.9 * share ** (1.0 / (STAGES - 1) - 1.0 / counted)  # as terms fall as powers of the step
        return max(1.0, float(np.where(counted > 1, growth, np.inf).min()))

    def _solved(self, h: float, speed: float) -> tuple[Array, Array] | None:
        """The increments of the states by the stages (k, stages), by Newton's method on all, and their rounding (k,).

        The gains become the integrals of the rates; None if that does not settle.
        """
        count, times = self.state.size, self.t + h * _POINTS
        gained = np.zeros((count, STAGES))
        gained[0] = h * speed * _POINTS
        before = np.inf
        for _ in range(_MOST_NEWTON):
            states = self.state[:, None] + gained
            rates, slope = slopes(self.along, times, states)
            if not (np.isfinite(rates).all() and np.isfinite(slope).all()):
                return None
            missing = h * rates @ _GAINS.T - gained
            matrix = -h * np.einsum("ij,abj->aibj", _GAINS, slope).reshape(count * STAGES, -1)
            matrix[np.diag_indices(count * STAGES)] += 1.0
            try:
                change = np.linalg.solve(matrix, missing.ravel()).reshape(count, STAGES)
            except np.linalg.LinAlgError:
                return None
            gained = gained + change
            size, allowed = np.abs(change).max(axis=1), self._allowed(states)
            now = float((size / allowed).max())
            rough = (size > _ROUGH * (np.abs(states).max(axis=1) + self.absolute)).any()
            if now <= _SETTLED or (now > _STALLED * before and not rough):
                return gained, size
            rate = now / before if before < np.inf else 1.0
            ahead = rate / (1.0 - rate) if rate < 1.0 else np.inf  # all the changes to come, of this one
            # where the step is then too long, it matters how much of them is rounding
            if now * ahead <= _SETTLED and self._change(gained, size * ahead) >= 1.0:
                return gained, size * ahead
            before = now
        return None
