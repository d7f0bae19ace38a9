"""Time stepping through the smooth pieces of a machine, restarted at the end of each.

Within a piece the loads are continued smoothly past its end, so that the step which finds the end keeps its order. The
same holds for what switches at a speed: it is watched over every step, and found where it changes its sign.

Steps are explicit (Dormand and Prince, order 8), and implicit where small changes die out many times over within a piece: an
explicit step must stay within a few time constants of the fastest change, however smooth the motion is. Implicit ones take
whole pieces at once: collocation at Radau points (Radau IIA), which damps what dies out at any step, by Newton's method.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, section II.5, and II,
1996, sections IV.5 and IV.8.

`one_cycle` steps one steady cycle in scaled variables that keep their digits however little the speed varies.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev, legendre

from bondgraph.motion import runge_kutta
from bondgraph.motion.runge_kutta import DormandPrince
from bondgraph.motion.stepping import JUST_STARTED, instant, roots
from bondgraph.records import NamedTuple
from flywheel.machine.dynamics import Dynamics, PlainInstant
from flywheel.machine.machine import Anchor, Machine
from flywheel.numerics.budget import count
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.numerics.faults import Fault, SceneError

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
_OPEN = 8.0  # times that rounding: below it, what is missing of a step is left open


class RateField(NamedTuple):
    """Rates of a motion at many instants at once: `rates(t, states)` for times (n,) and states (k, n) gives (k, n).

    `sizes` are sizes of the k states by which small changes of them are measured. `stiff` is how many time constants of the
    fastest change must lie ahead for implicit steps to be the cheaper ones: 0 where instants are costly one at a time,
    infinite where nothing brakes. `plain` are rates that cost next to nothing one at a time: whether these are stiff is
    looked into once many steps were taken.
    """

    rates: Callable[[Array, Array], Array]
    sizes: Array
    stiff: float = STIFF
    plain: bool = False


def stiffness(machine: Machine) -> float:
    """How many time constants ahead make a machine's motion stiff (see `RateField`).

    Of a linkage many positions cost as much as one, so that implicit steps, which ask for many, are taken anyway.
    """
    if any(mechanism.linkage is not None for mechanism in machine.scene.mechanisms):
        return 0.0
    return STIFF if machine.depends_on_speed else np.inf


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
def slopes(along: RateField, t: Array, states: Array) -> tuple[Array, Array]:
    """Rates (k, n) at instants, and what they change with each state: (k, k, n), by differences; not finite far off."""
    count, many = states.shape
    moved = np.repeat(states[:, None, :], count + 1, axis=1)
    for k in range(count):
        moved[k, k + 1] += _TRIED * along.sizes[k]
    found = along.rates(np.tile(t, count + 1), moved.reshape(count, -1)).reshape(count, count + 1, many)
    steps = np.array([moved[k, k + 1] - states[k] for k in range(count)])
    return found[:, 0], (found[:, 1:] - found[:, :1]) / steps


def decay(along: RateField, t: float, state: Array) -> float:
    """How fast the fastest of small changes of a state dies out, 1/s; 0 where none does, or nothing can be told."""
    _, slope = slopes(along, np.array([t]), state[:, None])
    scaled = slope[:, :, 0] * along.sizes / along.sizes[:, None]
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
        return np.asarray((share * chebyshev.chebval(2.0 * share - 1.0, self.series)).T + self.state).T


class Implicit:
    """A motion stepped from (t, state), with relative and absolute errors allowed in a step as large as it can be."""

    def __init__(self, along: RateField, t: float, state: Array, relative: float, absolute: Array) -> None:
        self.along, self.relative, self.absolute = along, relative, np.maximum(absolute, 1e-300)
        self.t, self.state = t, state
        rate = decay(along, t, state)
        self.h = _FIRST / rate if rate > 0.0 else np.inf

    def step(self, longest: float, speed: float) -> Dense | None:
        """Take a step, at most as long as given; its states at a time (k,) or at times (k, n). None if none is accepted.

        `speed` is the rate of the first state, by which Newton's method starts. At its start the states are exactly those
        that it starts with, where a speed may be 0.
        """
        h = min(self.h, longest)
        for _ in range(_MOST_TRIES):
            if not h > 4 * ROUNDING * abs(self.t):
                return None
            found = self._solved(h, speed)
            change = 0.25 if found is None else self._change(*found)
            if found is not None and change >= 1.0:
                gained = found[0]
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
        """What the stages add to the states (k, stages), by Newton's method on all of them, and the rounding in it (k,).

        The gains become the integrals of the rates; None where that does not settle.
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


# -- steps through a piece ---------------------------------------------------------------------------------------------

Rates = Callable[[float, Any], Any]

TIGHTEST = 3e-14  # tolerance of a step: below it the integrator's own rounding wins
_BEYOND = 1.05  # of the way to a piece's end: how far a step may try
_NEARLY = 0.95  # of that way: a step that is longer is made to end there
_SHORT = 0.03  # of a step: by how much it may be made longer to end there
_LINEAR = 1e-8  # of a step: its square is rounding
_MOST_LANDINGS = 8
_STABLE = {5: 3.3, 8: 6.1}  # step times decay rate that explicit steps of an order bear
_MANY = 128  # explicit steps in a stretch, after which implicit ones are tried
_PARTS = 3  # in which an implicit step is told, each as smooth as an explicit step


class StepError(SceneError):
    """No step is short enough."""


class Step(NamedTuple):
    """One accepted step: its dense output, the time it covers, which watched value ended it, if any, the state after it."""

    dense: Callable[[Any], Array]
    start: float
    end: float
    crossed: int | None = None
    after: Sequence[float] | None = None

    @property
    def first(self) -> Sequence[float]:
        """The state at its start."""
        return self.dense.state if isinstance(self.dense, runge_kutta.Step) else self.at(self.start)

    @property
    def last(self) -> Sequence[float]:
        """The state at its end."""
        return self.at(self.end) if self.after is None else self.after

    def at(self, t: float) -> Sequence[float]:
        """The state at a time within it: of an explicit step that of a shorter one, which is good to the same order."""
        if isinstance(self.dense, runge_kutta.Step) and t > self.start:
            return self.dense.shortened(t - self.start).after
        return tuple(self.dense(t).tolist())

    def steepest(self, k: int) -> float:
        """The greatest rate of state k at the stages of an explicit step; infinite where it is not known."""
        if isinstance(self.dense, runge_kutta.Step):
            return max(abs(slope[k]) for slope in self.dense.slopes)
        return np.inf


class Events(NamedTuple):
    """Values that end the stepping where one of them leaves its side: `values(t, states)` for times (n,) and states (k, n).

    It gives an array (values, n); `sides` are the signs (1.0 or -1.0) that they have within the stretch. `clear` tells of an
    explicit step, without looking closer, that nothing can leave its side there. `residuals` is by how much each may still
    be on the other side where the stretch begins: the state that goes on is of a higher order than the dense output in which
    the end of the stretch before was found, and what just changed its side may be short of it there by their difference.
    """

    values: Callable[[Array, Array], Array]
    sides: Array
    clear: Callable[[runge_kutta.Step], bool] | None = None
    residuals: Array | None = None


def residuals(sides: Array, start: Array) -> Array:
    """By how much values at the start of a stretch are on the other side than within it.

    >>> residuals(np.array([1.0, -1.0]), np.array([-2e-8, -5.0])).tolist()
    [2e-08, 0.0]
    """
    return np.where(sides * start < 0.0, np.abs(start), 0.0)


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
    events: Events | None = None,
    along: RateField | None = None,
    length: Callable[[float], float] | None = None,
) -> Iterator[Step]:
    """Steps from a state until phi leaves (low, high), t reaches `until`, or what is watched leaves its side.

    The last one ends exactly there. With `along`, the same rates at many instants at once, stretches in which small changes
    die out many times over are stepped implicitly, and what is left of one that takes many steps. `length` gives the longest
    of explicit steps by the time that they start at.
    """
    if along is not None and not along.plain and 0.0 < along.stiff < np.inf:  # so many time constants ahead hold steps up
        stiff = decay(along, t, state) * _rest(float(rates(t, state)[0]), t, state, ends, until) > along.stiff
    else:
        stiff = along is not None and along.stiff == 0.0 and not along.plain
    if along is not None and stiff:
        done, t, state = yield from _implicit_steps(rates, along, t, state, ends, until, tolerance, events)
        if done:
            return
        along = None
    first = min(1.1 * hint, until - t) if hint else None  # a little more, so that an equal piece takes one step too
    switching = (
        events is not None and events.clear is None
    )  # which side it goes on to asks for states of the steps' own order
    method = runge_kutta.ORDER_8 if switching else runge_kutta.method(tolerance.relative)
    solver = DormandPrince(rates, t, state.tolist(), until, tolerance.relative, tolerance.absolute.tolist(), first, method)
    taken = 0
    while solver.t < until:
        speed = solver.f[0]
        if speed:  # far past the piece's end the laws are only continued
            far = abs(((ends[1] if speed > 0.0 else ends[0]) - solver.y[0]) / speed)
            if solver.h > _NEARLY * far:
                solver.h = min(solver.h, max(far, 1e-9 * (until - solver.t) if until < np.inf else 0.0))
        if length is not None:
            solver.h = min(solver.h, length(solver.t))
        accepted = solver.step()
        if accepted is None:
            found = f"a motion that no step is short enough for, after {solver.t:.6g} s"
            raise StepError([Fault("simulation", found, "a motion that can be followed", "look for what vanishes there")])
        missing = (ends[1] if solver.f[0] > 0.0 else ends[0]) - accepted.after[0]
        inside = speed * solver.f[0] > 0.0 and abs(missing) > 2.0 * _SHORT * accepted.h * abs(solver.f[0])
        inside = inside and ends[0] < accepted.after[0] < ends[1]
        step = None if inside else _landing(accepted, ends)
        over = step is not None
        if inside:
            step = Step(accepted, accepted.t, solver.t, after=accepted.after)
        elif step is None:
            step = Step(accepted, accepted.t, solver.t, after=accepted.after)
            step, over = _cut(rates, step, speed, solver.f[0], ends)
        step = step if events is None else crossing(events, step)
        yield step
        if over or step.crossed is not None:
            return
        taken += 1
        if along is not None and taken % _MANY == 0 and _held_up(along, solver, solver.t - t, taken, ends):
            rest = along._replace(stiff=0.0, plain=False)
            yield from through(rates, solver.t, np.array(solver.y), ends, until, tolerance, None, events, rest, length)
            return


def _held_up(along: RateField, solver: DormandPrince, gone: float, taken: int, ends: tuple[float, float]) -> bool:
    """Whether implicit steps are the cheaper ones for the rest of a stretch, of which so many explicit ones were taken.

    Of plain rates only where explicit steps are as long as their stability lets them be, and many are to come.
    """
    if not along.plain:
        return True
    h, state = gone / taken, np.array(solver.y)
    left = _rest(solver.f[0], solver.t, state, ends, solver.until)
    limit = _STABLE[solver.method.order] / decay(along, solver.t, state) if left > _MANY * h else np.inf
    return h > 0.5 * limit


def _landing(step: runge_kutta.Step, ends: tuple[float, float]) -> Step | None:
    """The step made to end where phi leaves the piece, by Newton's method; None where it ends well inside, or turns back.

    What is missing at last is so little that the state changes in proportion to it.
    """
    start, speed = step.slopes[0][0], step.slopes[-1][0]
    end = ends[1] if speed > 0.0 else ends[0]
    for _ in range(_MOST_LANDINGS):
        if start * speed < 0.0 or speed == 0.0:
            return None
        missing = (end - step.after[0]) / speed
        missing *= 1.0 - 0.5 * missing * (speed - start) / (step.h * speed)
        if not -step.h < missing < _SHORT * step.h:
            return None
        if abs(missing) <= _LINEAR * step.h:
            after = [y + missing * rate for y, rate in zip(step.after, step.slopes[-1], strict=True)]
            return Step(step, step.t, step.t + step.h + missing, after=(end, *after[1:]))
        step = step.shortened(step.h + missing)
        speed = step.slopes[-1][0]
    return None


def _cut(rates: Rates, step: Step, before: float, after: float, ends: tuple[float, float]) -> tuple[Step, bool]:
    """A step cut where phi leaves the piece, and whether it does: it may leave it and turn back before the step is over."""
    dense, start, turns = step.dense, step.start, step.end
    if before * after < 0.0:
        turns = instant(lambda t: float(rates(t, step.dense(t))[0]), step.start, step.end)
    for stop in turns, step.end:
        phi = float(step.last[0] if stop == step.end else dense(stop)[0])
        if phi >= ends[1] or phi < ends[0]:
            end = ends[1] if phi >= ends[1] else ends[0]
            leaves = instant(lambda t: float(dense(t)[0]) - end, start, stop)  # noqa: B023 - called at once
            return step._replace(end=leaves, after=None), True
        start = stop
    return step, False


def _rest(speed: float, t: float, state: Array, ends: tuple[float, float], until: float) -> float:
    """About how long it takes to the piece's end, or to the last time."""
    return min(abs((ends[1] if speed > 0.0 else ends[0]) - float(state[0])) / abs(speed) if speed else np.inf, until - t)


def _implicit_steps(
    rates: Rates,
    along: RateField,
    t: float,
    state: Array,
    ends: tuple[float, float],
    until: float,
    tolerance: Tolerance,
    events: Events | None,
) -> Generator[Step, None, tuple[bool, float, Array]]:
    """Implicit steps, each told in parts; whether the stretch came to its end, or where no step was accepted."""
    solver = Implicit(along, t, state, tolerance.relative, tolerance.absolute)
    speed = float(rates(t, state)[0])
    while solver.t < until:
        start, rest = solver.t, _rest(speed, solver.t, solver.state, ends, until)
        dense = solver.step(min(_BEYOND * rest, until - start), speed)
        if dense is None:
            return False, solver.t, solver.state
        edges = np.linspace(start, solver.t, _PARTS + 1)
        speeds = along.rates(edges, dense(edges))[0].tolist()
        for (low, before), (high, speed) in pairwise(zip(edges.tolist(), speeds, strict=True)):
            step, over = _cut(rates, Step(dense, low, high), before, speed, ends)
            step = step if events is None else crossing(events, step)
            yield step
            if over or step.crossed is not None:
                return True, solver.t, solver.state
    return True, solver.t, solver.state


_SHARES = 0.5 - 0.5 * np.cos(np.pi * np.arange(10) / 9)  # of a step: where what is watched is looked at
_NEAR_ROOT = 1e-5  # of a step: how far beside the root of a polynomial that of the motion is looked for
_TO_SERIES = np.linalg.inv(chebyshev.chebvander(2.0 * _SHARES - 1.0, 9))


def crossing(events: Events, step: Step) -> Step:
    """The step, cut where the first of the watched values leaves its side; at its start where one does so at once.

    The share of a step after which a value is first below 0 is told by its values and by the roots of its polynomial.
    """
    width = step.end - step.start
    if not (events.sides.size and width > 0.0):
        return step
    if events.clear is not None and isinstance(step.dense, runge_kutta.Step) and events.clear(step.dense):
        return step

    def inside(shares: Array) -> Array:
        times = step.start + width * shares
        found = events.sides[:, None] * events.values(times, step.dense(times))
        return found if events.residuals is None else found + events.residuals[:, None]

    values = inside(_SHARES)
    series = values @ _TO_SERIES.T
    first: tuple[float, int] | None = None
    for k in np.flatnonzero(~(series[:, 0] > np.abs(series[:, 1:]).sum(axis=1))).tolist():
        found = roots(series[k])
        between = np.concatenate(([JUST_STARTED], 0.5 * (found[1:] + found[:-1])))  # sooner: at its start
        shares = np.concatenate((_SHARES[1:], between))
        order = np.argsort(shares)
        shares, heights = shares[order], np.concatenate((values[k, 1:], inside(between)[k]))[order]
        below = np.flatnonzero(heights < 0.0)
        if not below.size:
            continue
        at = int(below[0])
        if at == 0:
            share = 0.0
        elif heights[at - 1] == 0.0:
            share = float(shares[at - 1])
        else:
            ends = _closer(inside, k, float(shares[at - 1]), float(shares[at]), found)
            share = instant(lambda share: float(inside(np.array([share]))[k, 0]), *ends)  # noqa: B023 - called at once
        if first is None or share < first[0]:
            first = share, k
    return step if first is None else step._replace(end=step.start + width * first[0], crossed=first[1], after=None)


def _closer(inside: Callable[[Array], Array], k: int, low: float, high: float, found: Array) -> tuple[float, float]:
    """Shares between which value k passes zero: close about a root of its polynomial, where that is one of its own."""
    near = found[(found > low) & (found < high)]
    if near.size:
        tried = np.clip(near[0] + np.array([-_NEAR_ROOT, _NEAR_ROOT]), low, high)
        before, after = inside(tried)[k]
        if before > 0.0 > after:
            return float(tried[0]), float(tried[1])
    return low, high


# -- one steady cycle --------------------------------------------------------------------------------------------------

_CHECKED = 0.3  # of a piece: where a recorded walk is compared with the walk
_ALIKE = 1e-10  # of a moment: by how much they may differ
_COUNTED = 12  # evaluations that are counted at once: those of a step
_AHEAD = 1e-7  # of a piece: how far beyond a switch its side is looked up
_MOST_STEPS, _MOST_CROSSINGS = 4_000, 500  # in a stretch, and in a cycle
_FEW_STEPS = 1000  # in a stretch where switches are no longer looked for
_TRIES = 8  # changes of side at one place, before they are no longer looked for
_SLIGHT = 1e-3  # of the size of a motor's states: what is smaller need not be as exact


class SlidingError(ValueError):
    """A motion that does not get on: it slides along a law that drives it back from both sides."""


def one_cycle(dynamics: Dynamics, speed: float, scale: float, first: Array, tight: float) -> list[Step]:
    """The steps of a cycle from a state at phi = 0: phi (rad), u, and a motor's own states, such as its current.

    tau = w t and omega = w (1 + scale u). Stepping starts afresh at every breakpoint of position, and where a law switches
    at a speed or a mesh changes the side that drives.

    Args:
        dynamics: the machine with its flywheel and balance.
        speed: w, rad/s.
        scale: of the speed's variation, about the irregularity.
        first: the state at phi = 0.
        tight: tolerance of a step.

    Raises:
        SlidingError: where the motion keeps changing sides, as it does along a torque that jumps at a speed.

    Where it changes sides again and again at one place, the rest of that piece is stepped without looking for switches.

    """
    equations = _Scaled(dynamics, speed, scale)
    edges = dynamics.machine.restarts
    own = () if dynamics.circuit is None else np.maximum(np.abs(first[2:]), _SLIGHT * np.array(dynamics.circuit.scales))
    tolerance = Tolerance(tight, tight * np.array([1.0, 1.0, *own]))
    state, tau, found = first, 0.0, list[Step]()
    hint: float | None = None
    crossings = 0
    for low, high in pairwise(edges.tolist()):
        tries = 0
        while True:
            anchor, own = equations.anchor(state, (low, high)) if tries <= _TRIES else (None, state[2:])
            events = None if anchor is None else equations.events(anchor, own, tau, state)
            rates, along = equations.rates((low, high), anchor), equations.along((low, high), anchor, state)
            stepping = through(rates, tau, state, (low, high), np.inf, tolerance, hint, events, along)
            most = _MOST_STEPS if events is not None or tries == 0 else _FEW_STEPS
            passed = [*islice(stepping, most)]
            last, crossings = passed[-1], crossings + (passed[-1].crossed is not None)
            found += [step for step in passed if step.end > step.start]
            if len(passed) == most or crossings > _MOST_CROSSINGS:
                raise SlidingError
            tries = tries + 1 if last.end == tau else 0
            state, tau = np.array(last.last), last.end
            if last.crossed is None or high - state[0] <= 2 * _AHEAD * (high - low):
                break
        hint = max((step.end - step.start for step in passed if step.end > step.start), default=hint)
        state[0] = high
    return found


class _Scaled(NamedTuple):
    """The equation of motion in tau and u; branches are decided at an anchor, or without one at every instant."""

    dynamics: Dynamics
    speed: float
    scale: float

    def rates(self, ends: tuple[float, float], anchor: Anchor | None) -> Rates:
        """d(phi, u, a motor's states)/dtau within a stretch."""
        dynamics, speed, scale = self
        middle = 0.5 * (ends[0] + ends[1]) if anchor is None else anchor.phi

        def rates(tau: float, state: Sequence[float]) -> Sequence[float]:
            phi, u, *own = state
            ratio = 1.0 + scale * u
            at = dynamics.at(phi, middle, speed * ratio, states=own, ends=ends, anchor=anchor)
            found = ratio, float(at.acceleration) / (speed * speed * scale)
            return (*found, *(float(rate) / speed for rate in at.rates)) if own else found

        law = dynamics.plainly(anchor or Anchor(middle, None, None))
        if law is None:
            return rates
        self._check(law, ends, middle, anchor)
        return self._recorded(law, rates)

    def _check(self, law: PlainInstant, ends: tuple[float, float], middle: float, anchor: Anchor | None) -> None:
        """Refuse a recorded walk that is not the walk itself: the figures may rest on the recording too."""
        phi, omega = ends[0] + _CHECKED * (ends[1] - ends[0]), self.speed
        compared = self.dynamics.machine.traced.compared
        place = phi, None if anchor is None else (anchor.omega, anchor.factors)
        if place in compared:
            return
        own = () if (circuit := self.dynamics.circuit) is None else circuit.scales
        now = self.dynamics.at(phi, middle, omega, states=own, ends=ends, anchor=anchor)
        try:
            acceleration, moment, inertia, _ = law(phi, omega, 0.0, own)
        except (ValueError, ArithmeticError):
            return  # the walk itself is taken where a law is not defined
        allowed = _ALIKE * (abs(moment) + 0.01 * inertia * omega * omega)
        apart = (
            abs(moment - now.moment),
            abs(inertia - now.inertia) * omega * omega,
            abs(acceleration - now.acceleration) * inertia,
        )
        if max(apart) > allowed:
            found = f"a recording that is not the machine at {phi:.6g} rad"
            raise StepError([Fault("simulation", found, "the walk of its bond graph", "report this")])
        compared.add(place)

    def _recorded(self, law: PlainInstant, walked: Rates) -> Rates:
        """The same rates by the recorded walk; where a law is not defined, as the walk reads it."""
        speed, scale = self.speed, self.scale
        unit, calls = 1.0 / (speed * speed * scale), 0

        def rates(tau: float, state: Sequence[float]) -> Sequence[float]:
            nonlocal calls
            calls += 1
            if calls == _COUNTED:
                count(calls)
                calls = 0
            phi, u, *own = state
            ratio = 1.0 + scale * u
            try:
                acceleration, _, _, changes = law(phi, speed * ratio, 0.0, own)
            except (ValueError, ArithmeticError):
                acceleration = math.nan
            if acceleration - acceleration != 0.0:
                found: Sequence[float] = walked(tau, state)
                return found
            return (ratio, acceleration * unit, *(rate / speed for rate in changes)) if own else (ratio, acceleration * unit)

        return rates

    def along(self, ends: tuple[float, float], anchor: Anchor | None, state: Array) -> RateField | None:
        """The same rates at many instants at once; None where branches are decided at every instant."""
        dynamics, speed, scale = self
        if anchor is None and dynamics.branching:
            return None
        place, circuit = anchor or Anchor(0.5 * (ends[0] + ends[1]), None, None), dynamics.circuit
        sizes = [1.0, 1.0 / scale]
        if circuit is not None:
            sizes += [max(abs(float(value)), size) for value, size in zip(state[2:], circuit.scales, strict=True)]

        def rates(tau: Array, states: Array) -> Array:
            ratio = 1.0 + scale * states[1]
            at = dynamics.along(states[0], place, speed * ratio, np.zeros_like(tau), states[2:], ends)
            return np.array([ratio, at.acceleration / (speed * speed * scale), *(rate / speed for rate in at.rates)])

        return RateField(rates, np.array(sizes), stiffness(dynamics.machine))

    def anchor(self, state: Array, ends: tuple[float, float]) -> tuple[Anchor | None, Array]:
        """Where branches are decided in the coming stretch, a little ahead; None where position alone decides them.

        And a motor's own states there.
        """
        if not self.dynamics.branching:
            return None, state[2:]
        phi, width = float(state[0]), ends[1] - ends[0]
        rate = self.rates(ends, None)(0.0, state)
        ahead = _AHEAD * width / float(rate[0])
        held = min(max(phi + ahead * float(rate[0]), ends[0] + _AHEAD * width), ends[1] - 0.01 * _AHEAD * width)
        omega = self.speed * (1.0 + self.scale * float(state[1] + ahead * rate[1]))
        anchor = Anchor(held, omega, 0.0)
        own = [float(value + ahead * change) for value, change in zip(state[2:], rate[2:], strict=True)]
        now = self.dynamics.at(held, held, omega, states=own, ends=ends, anchor=anchor)
        return anchor._replace(factors=now.factors or None), np.array(own)

    def events(self, anchor: Anchor, own: Array, start: float, state: Array) -> Events:
        """What ends the coming stretch, with the sides that it is on at the anchor, where a motor has states of its own.

        start: tau where the stretch begins, from the state.
        """
        dynamics, speed, scale = self

        def values(tau: Array, states: Array) -> Array:
            omega = np.asarray(speed * (1.0 + scale * states[1]))
            found = dynamics.sides(states[0], anchor, omega, np.zeros_like(tau), states[2:])
            return np.array(found, dtype=float).reshape(len(found), tau.size)  # none where no load switches in this piece

        here = np.array([anchor.phi]), anchor, np.array([anchor.omega]), np.zeros(1), own[:, None]
        sides = np.array([1.0 if side[0] >= 0.0 else -1.0 for side in dynamics.sides(*here)])
        return Events(values, sides, residuals=residuals(sides, values(np.array([start]), state[:, None])[:, 0]))
