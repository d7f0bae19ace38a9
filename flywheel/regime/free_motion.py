"""The motion of a machine in time from any start: from one smooth stretch of its laws to the next (`follow`).

A stretch ends where the crank leaves a piece, where a time comes at which a law switches (`SwitchingTimes`, found beforehand
by interval bounds as far as time decides), and where a law that depends on speed, or the direction of the power through a
mesh, changes its side. Where the moment depends on position alone and its work over the cycle is zero, the speed at phi = 0
returns exactly: one cycle is then stepped, and stands for all that are like it. What steps make of the return is their own
error: it is stated, and not carried on into the next cycle.

`outcome_of` says what becomes of a machine for which no steady motion is found: it stalls, it runs away, or neither.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from bondgraph.motion import runge_kutta
from bondgraph.motion.stepping import instant
from bondgraph.reduction import counting
from flywheel.components.motors.circuit import Circuit, States
from flywheel.machine.dynamics import ONSET, Dynamics
from flywheel.machine.machine import Anchor, Effort, Machine
from flywheel.numerics.budget import BudgetError, count, counted, limited, spend
from flywheel.numerics.cells import Array, Index
from flywheel.numerics.expressions import Expression, Node, renamed, written
from flywheel.numerics.faults import Fault, SceneError, told
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet
from flywheel.numerics.switching import SwitchingError, breakpoints, resolved
from flywheel.regime import turning_moment
from flywheel.regime.stepping import Events, RateField, Rates, Step, StepError, Tolerance, residuals, stiffness, through
from flywheel.scene.scene import Scene

# -- times at which laws switch ------------------------------------------------------------------------------------------

_WINDOW = 100.0  # turns at the machine's typical speed: how far ahead switches are looked for where no end is known


class SwitchingTimes:
    """The times (s) at which expressions of `t` and parameters change their branch, up to an end that may be infinite.

    Where one is steep, as a short pulse is, there are more, so close that no step passes it without seeing it.
    `after(t)` gives the next of them, or the end of what was looked through; time stepping starts afresh there.
    """

    def __init__(self, machine: Machine, until: float) -> None:
        self.until = until
        self._switches: list[tuple[Effort, Expression]] = []  # what decides branches by time alone, with `phi` for `t`
        self._smooth: list[tuple[Effort, Expression]] = []  # the largest parts of laws that depend on time alone, likewise
        for effort in machine.efforts:
            law = effort.load.law
            if isinstance(law, Expression) and effort.uses_time:
                parts = [part for part in (*law.switches(), *law.branch_points()) if effort.is_timed(part)]
                self._switches += [(effort, Expression(p.text, Node("sign", (renamed(p.tree, "t", "phi"),)))) for p in parts]
                self._smooth += [(effort, Expression(p.text, renamed(p.tree, "t", "phi"))) for p in _timed(effort, law.tree)]
        self._window = min(until, _WINDOW * machine.scene.cycle / machine.typical_speed)
        self._seen = 0.0
        self._times: list[float] = []

    def every(self) -> list[float]:
        """All of them, before an end that is finite; looked for in one go, so that no window's end is among them."""
        self._window = self.until
        found = [self.after(0.0)]
        while found[-1] < self.until:
            found.append(self.after(found[-1]))
        return found[:-1]

    def after(self, t: float) -> float:
        """The first time past t to stop at."""
        if not (self._switches or self._smooth):
            return self.until
        while not (later := [time for time in self._times if time > t]):
            start, end = self._seen, self._seen + self._window
            roots = _found(breakpoints, self._switches, start, end)
            edges = np.array(sorted({start, *roots, end}))
            steep = _found(resolved, self._smooth, edges[:-1], edges[1:])
            self._times = sorted({*roots, *steep, end})
            self._seen = end
        return min(later[0], self.until)


def _timed(effort: Effort, node: Node) -> Iterator[Expression]:
    """The largest parts of a law, from a node of it on, that depend on time alone."""
    part = Expression(written(node), node)
    if node.args and effort.is_timed(part):
        yield part
    elif "t" in part.names:
        for arg in node.args:
            yield from _timed(effort, arg)


def _found(search: Callable[..., Iterable[float]], laws: list[tuple[Effort, Expression]], low: Any, high: Any) -> set[float]:
    """The times between ends (s) that a search by interval bounds finds for laws of time; a fault names `t` as the scene."""
    found: set[float] = set()
    for effort, law in laws:
        try:
            found.update(map(float, search(law, low, high, *_in_time(effort.constants))))
        except SwitchingError as error:
            what = re.sub(r"\bphi\b", "t", str(error))
            expected = f"an expression that can be followed to {np.max(high):.6g} s"
            raise SceneError([Fault(effort.path, what, expected, "a shorter time")]) from error
    return found


def _in_time(constants: Mapping[str, float]) -> tuple[Callable[..., Mapping[str, Any]], Callable[..., Mapping[str, Any]]]:
    """Bounds over cells of time, and values at times."""
    return (
        lambda lo, hi, anchor: {**constants, "phi": Jet(Interval(lo, hi), 1.0)},
        lambda times, anchor: {**constants, "phi": times},
    )


# -- cycles that return ---------------------------------------------------------------------------------------------------

FEWEST = 20  # cycles still to come, below which nothing is looked into
_ROUNDING = 1e-13  # of the work exchanged: what its own quadrature leaves of a net work of zero


class Later:
    """A step's dense output, a time (s) later."""

    def __init__(self, dense: Callable[[Any], Array], time: float) -> None:
        self.dense, self.time = dense, time

    def __call__(self, t: Any) -> Array:
        """The states at times t."""
        return self.dense(t - self.time)


def source(step: Step) -> Callable[[Any], Array]:
    """The dense output that a step was taken from, its own or that of an earlier cycle."""
    return step.dense.dense if isinstance(step.dense, Later) else step.dense


def later(step: Step, time: float) -> Step:
    """The same step, a time (s) later."""
    return Step(Later(step.dense, time), step.start + time, step.end + time)


def returns(machine: Machine, balance: float) -> bool:
    """Whether the work of a cycle is zero, whatever the speed: with a value (SI) of the scene's unknown.

    True only where no load depends on speed or time, and the net work is no more than its own rounding.
    """
    scene = machine.scene
    if machine.depends_on_speed or machine.depends_on_time or machine.resists:
        return False
    if scene.stroke is not None or len(machine.stages) > 1:
        return False
    cycle = turning_moment.balanced(machine, _ROUNDING)
    settled = cycle.balance is None or abs(cycle.balance - balance) <= _ROUNDING * abs(balance)
    return bool(settled and max(abs(cycle.net), cycle.errors.work) <= _ROUNDING * cycle.exchanged)


# -- the motion from a start ----------------------------------------------------------------------------------------------

_MOST_STEPS = 1_000_000
_SLOW = 1e-3  # of the typical speed: below this, errors of speed count as if it were this
_AHEAD = 1e-7  # of a piece: how far beyond a switch its side is looked up
_WITHIN = 1e-9  # of a piece: how near to its ends
_MOST_CROSSINGS = 500  # of switches, one after the other within a piece
_TRIES = 8  # changes of side at one instant, before the motion counts as stuck
_LIGHT, _NOTHING = 1e-7, 1e-11  # of the greatest inertia: where a zero is looked for, and what counts as one
_RETURNED, _RETURNED_AT_BEST = 1e4, 1e-8  # tolerances of a step: how far off a cycle may be that comes back to its speed
_LOOKED_AT = np.array([0.1, 0.35, 0.6, 0.85])  # of a piece: where it is seen how large its inertia is
_BALANCED = 1e-12  # of the acceleration that friction makes: a push that counts as none
_WAITED = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, 65) / 64)  # of the time to the next switch: when a machine at rest is seen
_SHORTER = 0.7  # of steps beside
_CAREFUL = 0.6  # of the longest step of the stretch before
_STILL = 1e-9  # of the typical speed: slower than this it stands


class Goal(NamedTuple):
    """What ends a motion: a value of times, positions (not reduced) and speeds that is above 0 until then.

    `line` says of a value that is a straight line of one state which one (0 position, 1 speed), and its level and slope.
    """

    name: str
    value: Callable[[Array, Array, Array], Array]
    line: tuple[int, float, float] | None = None


def straight(name: str, state: int, level: float, slope: float) -> Goal:
    """The goal whose value is level + slope * state (0: position, rad; 1: speed, rad/s).

    >>> float(straight("stop", 1, -2.0, 1.0).value(0.0, 0.0, np.float64(3.0)))
    1.0
    """
    return Goal(name, lambda t, phi, omega: level + slope * (omega if state else phi), (state, level, slope))


class Start(NamedTuple):
    """The state at t = 0: position (rad; on a stroke from its beginning), speed (rad/s), and a motor's own states."""

    phi: float
    omega: float
    states: tuple[float, ...] = ()


class Stretch(NamedTuple):
    """A step, what is to be added to its position, and where the branches of its laws are decided."""

    step: Step
    offset: float
    anchor: Anchor


_GAUSS = 10  # nodes in a step, at which a speed is looked for


class Trail(NamedTuple):
    """A motion as it was stepped. States are rows: position, speed, the moment's work (J), and a motor's own.

    `goal` names what it ended with, if that was not time; `stuck` says where it stands still for good; `cycles` is how often
    it came to the end of a cycle, `repeated` how many of these were taken as the one before; `drift` is the share by which
    the kinetic energy at phi = 0, which returns there, was off after the cycle that they were taken from.
    """

    dynamics: Dynamics
    start: Start
    stretches: tuple[Stretch, ...]
    goal: str | None = None
    stuck: str | None = None
    cycles: int = 0
    repeated: int = 0
    drift: float = 0.0

    @property
    def t(self) -> Array:
        """Times of the steps, s."""
        return np.array([0.0, *(stretch.step.end for stretch in self.stretches)])

    def owners(self, times: Array) -> Index:
        """The stretch that each time belongs to."""
        return np.clip(np.searchsorted(self.t[1:], times), 0, len(self.stretches) - 1)

    def states(self, times: Array, owners: Index | None = None) -> Array:
        """The states at times, by dense output: (states, times)."""
        which = self.owners(times) if owners is None else owners
        found = np.empty((3 + len(self.start.states), times.size))
        steps = [stretch.step.dense for stretch in self.stretches]
        explicit = np.array([isinstance(step, runge_kutta.Step) for step in steps])[which]
        order = np.argsort(which, kind="stable")
        if explicit.any():
            found[:, explicit] = runge_kutta.at(steps, which[explicit], times[explicit])  # type: ignore[arg-type]
            order = order[~explicit[order]]
        firsts = np.flatnonzero(np.diff(which[order], prepend=-1))
        for mine in np.split(order, firsts[1:]) if order.size else ():
            found[:, mine] = steps[which[mine[0]]](times[mine])
        found[0] += np.array([stretch.offset for stretch in self.stretches])[which]
        return found

    def anchors(self, owners: Index) -> tuple[Array, Anchor]:
        """What is to be taken off the positions in stretches of the motion, and where branches of laws are decided there."""
        used, where = np.unique(owners, return_inverse=True)
        stretches = [self.stretches[k] for k in used]
        offset = np.array([stretch.offset for stretch in stretches])[where]
        anchors = np.array([stretch.anchor[:3] for stretch in stretches])[where]
        factors: tuple[Any, ...] | None = None
        if stretches[0].anchor.factors is not None:
            factors = tuple(np.array([stretch.anchor.factors for stretch in stretches])[where].T)
        sides = None
        if stretches[0].anchor.sides is not None:
            sides = np.array([stretch.anchor.sides for stretch in stretches])[where]
        return offset, Anchor(anchors[:, 0], anchors[:, 1], anchors[:, 2], factors, sides)

    def within(self, inside: Array) -> tuple[Array, Index]:
        """Times in every stretch, at its ends and at shares (0 to 1) of it, and the stretches that they belong to."""
        shares = np.concatenate(([0.0], inside, [1.0]))
        start, end = self.t[:-1, None], self.t[1:, None]
        times = start + (end - start) * shares
        times[:, -1] = self.t[1:]
        return times.ravel(), np.repeat(np.arange(len(self.stretches)), shares.size)

    def time_to(self, speed: float) -> float | None:
        """The first time (s) at which a speed (rad/s) is reached; None if it never is."""
        points, _ = np.polynomial.legendre.leggauss(_GAUSS)
        times, owners = self.within(0.5 * (1.0 + points))
        speeds = self.states(times, owners)[1]
        above = np.flatnonzero(speeds >= speed)
        if not above.size:
            return None
        if above[0] == 0:
            return 0.0
        low, high = float(times[above[0] - 1]), float(times[above[0]])

        def faster(t: float) -> float:
            return float(self.states(np.array([t]), owners[above[:1]])[1, 0]) - speed

        return low if low == high or faster(low) >= 0.0 else instant(faster, low, high)  # equal on both sides of a switch

    def __repr__(self) -> str:
        """How many steps there are, and how they end, instead of all of them."""
        return f"Trail({len(self.stretches)} steps to t = {self.t[-1]:.6g} s, goal={self.goal!r}, cycles={self.cycles})"

    def ends(self) -> Array:
        """The states at the ends of all steps, the start included: (states, steps + 1)."""
        first = self.stretches[0]
        found = {id(source(step)): step for step, _, _ in self.stretches}
        last = {key: step.last for key, step in found.items()}
        rows = [first.step.first, *(last[id(source(step))] for step, _, _ in self.stretches)]
        ends = np.array(rows).T
        ends[0] += [first.offset, *(offset for _, offset, _ in self.stretches)]
        return ends


class _Rest(NamedTuple):
    """The states of a machine at rest from a time on: a motor's own alone go on."""

    time: float
    state: Array
    circuit: Circuit | None

    def at(self, t: Any) -> Array:
        """The states at times t."""
        times = np.asarray(t, dtype=float)
        found = np.broadcast_to(self.state.reshape(-1, *(1,) * times.ndim), (self.state.size, *times.shape)).copy()
        if self.circuit is not None:
            found[3:] = self.circuit.standing(self.state[3:].tolist(), times - self.time)
        return found


def neighbours(machine: Machine, phi: float) -> tuple[float, float]:
    """Places in the pieces ahead of a position within the cycle, and behind it."""
    edges, turn = machine.restarts, 0.0 if machine.scene.stroke is not None else machine.scene.cycle
    on, back = turn * (phi >= edges[-1]), turn * (phi <= 0.0)
    ahead = int(np.searchsorted(edges, phi - on, side="right")) - 1
    behind = int(np.searchsorted(edges, phi + back, side="left")) - 1
    found = [min(max(k, 0), edges.size - 2) for k in (ahead, behind)]
    places = [0.5 * float(edges[k] + edges[k + 1]) for k in found]
    return places[0] + on, places[1] - back


def held_by(dynamics: Dynamics, phi: float, t: float, states: States = ()) -> str:
    """Why a machine with dry friction stays at rest at a position within the cycle, in words."""
    machine = dynamics.machine
    found = dynamics.hold(phi, *neighbours(machine, phi), t, states)
    unit = "N" if machine.scene.reduction_element == "slide" else "N m"
    if abs(found.moment) <= _BALANCED * min(found.friction, 1e300):
        return f"M* = 0 {unit}, so that nothing moves it"
    where = "friction in its joints" if machine.resists else "the drag of its shafts"
    what = f"{where} holds M* = {found.moment:.6g} {unit}"
    if not machine.resists and len(machine.stages) > 1:
        return what
    if found.locking:
        return f"{what}: it locks itself, as no size of {' or '.join(found.locking)} moves it (self-locking)"
    if not math.isfinite(found.friction):
        return f"{what}: it locks itself, as no action of its driver moves it (self-locking)"
    return f"{what}, and would hold up to {found.friction:.6g} {unit}"


Passing = Callable[[float, float], str | None]
Watching = Callable[[float, float], None]


def follow(
    dynamics: Dynamics,
    start: Start,
    until: float,
    rtol: float,
    goals: Sequence[Goal] = (),
    passing: Passing | None = None,
    watching: Watching | None = None,
    beside: Trail | None = None,
) -> Trail:
    """The motion from a start until a time (s), or until a goal is reached.

    `rtol` is the tolerance of a step. `passing(t, omega)` is asked at the end of every cycle;
    what it answers ends the motion. `watching(t, phi)` is told of the start, and of the end of every stretch.
    Steps are shorter than those of the motion `beside` everywhere, so that what they pass over is not the same.

    Raises SceneError where the motion is not determined, or sticks at a switch that both sides drive it back to.
    """
    return _Motion(dynamics, start, until, rtol, goals, passing or (lambda t, omega: None), watching, beside).trail()


class _Motion:
    """The state of a motion on its way: `state` has phi reduced to one cycle, `offset` is what was taken off it."""

    def __init__(
        self,
        dynamics: Dynamics,
        start: Start,
        until: float,
        rtol: float,
        goals: Sequence[Goal],
        passing: Passing,
        watching: Watching | None,
        beside: Trail | None,
    ) -> None:
        self.dynamics, self.machine, self.start, self.until = dynamics, dynamics.machine, start, until
        self.goals, self.passing, self.watching = goals, passing, watching
        self.once, self.cycle = self.machine.scene.stroke is not None, self.machine.scene.cycle
        self.offset = 0.0 if self.once else float(np.floor(start.phi / self.cycle)) * self.cycle
        self.typical = max(abs(start.omega), self.machine.typical_speed)
        # of position, speed, work (which the steps do not have to follow) and a motor's own states
        absolute, self.sizes = [rtol * self.cycle, rtol * _SLOW * self.typical, np.inf], [self.cycle, self.typical, 1.0]
        if (circuit := dynamics.circuit) is not None:
            self.sizes += circuit.scales
            absolute += [rtol * _SLOW * scale for scale in circuit.scales]
        self.tolerance = Tolerance(rtol, np.array(absolute))
        self.state = np.array([start.phi - self.offset, start.omega, 0.0, *start.states])
        self.t, self.stretches = 0.0, list[Stretch]()
        self.branching = dynamics.branching
        self.rough = 0 if dynamics.resistances is None else dynamics.resistances.curved.size  # passive actions in joints
        self.held = dynamics.holds  # by friction in joints, or drag of shafts, where it comes to rest
        self.sense = 1.0  # of a machine with dry friction that leaves its rest
        edges = self.machine.restarts  # a piece may be the whole cycle, with a dead centre in its middle
        places = (edges[:-1, None] + np.diff(edges)[:, None] * _LOOKED_AT).ravel()
        self.light = _LIGHT * (float(np.max(self.machine.reduce(places).inertia)) + dynamics.inertia)
        self.undefined: tuple[float, float, float] | None = None  # the last state in which a law had no value
        self.times = SwitchingTimes(self.machine, until)
        self.cycles, self.repeated, self.drift = 0, 0, 0.0
        self.passed: tuple[int, float, Array] | None = None  # the last cycle: its first stretch, its start and state then
        self.returns: bool | None = None  # not looked into yet
        self.length = None if beside is None or not beside.stretches else _shorter(beside.t)

    def trail(self) -> Trail:
        """Stretch after stretch in either direction."""
        goal = stuck = None
        hint: float | None = None
        stops = crossings = 0  # at one instant; of switches, one after the other
        self._add([])
        while self.t < self.until and goal is None:
            self._check_friction()
            if self.held and self.state[1] == 0.0 and not self._sets_out():
                if self._rests():
                    continue
                stuck = self._stuck()
                break
            if self.once and self._leaves():
                break
            piece = self._piece()
            ends = float(self.machine.restarts[piece]), float(self.machine.restarts[piece + 1])
            width, stop = ends[1] - ends[0], self.times.after(self.t)
            anchor, own = self._anchor(ends, stop)
            rates, along, events = self._rates(ends, anchor), self._along(ends, anchor), self._events(anchor, own)
            try:
                steps = [*through(rates, self.t, self.state, ends, stop, self.tolerance, hint, events, along, self.length)]
            except StepError as error:
                raise SceneError([self._undefined(anchor) or error.faults[0]]) from None
            self.t, crossed = steps[-1].end, steps[-1].crossed
            self.state = np.array(steps[-1].last, dtype=float)
            stopped = self.held and events is not None and crossed == events.sides.size - 1  # the speed is the last
            if stopped:
                self.state[1] = 0.0
            self._add([Stretch(step, self.offset, anchor) for step in steps if step.end > step.start])
            stops = stops + 1 if crossed is not None and self.t == steps[-1].start else 0
            crossings = crossings + 1 if crossed is not None else 0
            # a switch may lie where the piece ends, so near that the motion goes on in the next one
            near = ends[1] if self.state[1] > 0.0 else ends[0]
            at_end = crossed is None or (not stopped and abs(float(self.state[0]) - near) <= 2 * _AHEAD * width)
            if crossed is not None and crossed < len(self.goals):
                goal = self.goals[crossed].name
            elif at_end and self.t < stop:  # the state is put there exactly
                self.state[0] = min(ends, key=lambda end: abs(float(self.state[0]) - end))
                if not self.once and self.state[0] == self.cycle:
                    self.cycles += 1
                    goal = self.passing(self.t, float(self.state[1]))
            goal = goal or self._again()
            if stops > _TRIES or crossings > _MOST_CROSSINGS:
                stuck = self._stuck()
                break
            taken = [step.end - step.start for step in steps if step.end > step.start]
            if taken:  # the estimate of a step that begins a piece may be wrong: it is no long one, but where one is enough
                hint = max(taken) * (1.0 if len(taken) == 1 else _CAREFUL)
        stretches = tuple(self.stretches)
        return Trail(self.dynamics, self.start, stretches, goal, stuck, self.cycles, self.repeated, self.drift)

    def _add(self, stretches: list[Stretch]) -> None:
        """Keep stretches that end now."""
        self.stretches += stretches
        if self.watching is not None:
            self.watching(self.t, float(self.state[0]) + self.offset)
        if len(self.stretches) > _MOST_STEPS:
            expected = f"a shorter time: {_MOST_STEPS} steps reach {self.t:g} s"
            raise SceneError([Fault("until", f"{self.until:g} s", expected)])

    def _check_friction(self) -> None:
        """Refuse to follow a motion that turns back where friction is a moment of position, known for one sense alone."""
        stroke = self.machine.scene.stroke
        sense = 1.0 if stroke is None or (stroke.speed or 1.0) > 0.0 else -1.0
        if self.machine.friction is not None and float(self.state[1]) * sense < 0.0:
            found = f"a motion that turns back by {self.t:.6g} s, with friction in joints"
            expected = "one that keeps the sense for which that friction was found"
            raise SceneError([Fault("until", found, expected, "a shorter time, or leave friction out")])

    # -- rough joints at rest --------------------------------------------------------------------------------------------

    def _pushes(self, times: Array, states: States) -> Array:
        """Accelerations (2, n) with which a machine with dry friction would leave its rest, forwards and backwards.

        Less what counts as none: it leaves where the first is above 0, or the second below.
        """
        phi = float(self.state[0])
        found = np.array(self.dynamics.from_rest(phi, *neighbours(self.machine, phi), times, states))
        least = _BALANCED * np.abs(found).max(axis=0)
        return np.asarray(found - np.array([[1.0], [-1.0]]) * least)

    def _sets_out(self) -> bool:
        """Whether a machine at rest moves on, one way or the other: `sense` is which."""
        (forwards,), (backwards,) = self._pushes(np.array([self.t]), self.state[3:, None])
        if forwards > 0.0 and backwards < 0.0:
            raise SceneError([self._undecided("friction in its joints lets it start either way")])
        self.sense = 1.0 if forwards > 0.0 else -1.0 if backwards < 0.0 else 0.0
        return self.sense != 0.0

    def _rests(self) -> bool:
        """Whether time goes on while dry friction holds the machine: until it breaks away, or a law switches.

        False where nothing that time changes acts on it: it then stands for good.
        """
        circuit, stop = self.dynamics.circuit, min(self.times.after(self.t), self.until)
        if not (self.machine.depends_on_time or circuit is not None) or not np.isfinite(stop):
            return False
        rest = _Rest(self.t, self.state.copy(), circuit)

        def pushes(times: Array) -> Array:
            """The accelerations less twice what counts as none, above 0 where it leaves: forwards, backwards."""
            found = self._pushes(times, rest.at(times)[3:])
            return np.asarray(found * np.array([[1.0], [-1.0]]))

        times = np.append(self.t, self.t + (stop - self.t) * _WAITED)
        leaves = np.argwhere(pushes(times).T > 0.0)
        end = stop
        if leaves.size:
            k, side = leaves[0]
            least = _BALANCED * float(np.abs(pushes(times)).max())

            def push(t: float) -> float:
                return float(pushes(np.array([t]))[side, 0]) - least

            end = instant(push, float(times[max(k - 1, 0)]), float(times[k]))
        sides = np.zeros(3 * self.rough) if self.rough else None
        anchor = Anchor(float(self.state[0]), 0.0, 0.5 * (self.t + end), sides=sides)
        anchor = anchor._replace(factors=None if len(self.machine.stages) == 1 else (1.0,) * len(self.machine.stages))
        self._add([Stretch(Step(rest.at, self.t, end), self.offset, anchor)] if end > self.t else [])
        self.t, self.state = end, rest.at(end)
        return True

    def _undecided(self, what: str) -> Fault:
        """The fault of friction that leaves no motion, or several."""
        where = self.machine.where(float(self.state[0]))
        found = f"friction that leaves no one motion at {where} after {self.t:.6g} s: {what} (Painlevé's paradox)"
        return Fault("simulation", found, "one motion", "less friction, longer shoes, or smaller pins")

    def _stuck(self) -> str:
        """Where the machine stands still for good; a SceneError where it sticks to a switch while running."""
        where = self.machine.where(float(self.state[0]))
        if abs(self.state[1]) <= _STILL * self.typical:
            stands = f"stands still at {where} after {self.t:.6g} s"
            own = self.state[3:].tolist()
            return f"{stands}: {held_by(self.dynamics, float(self.state[0]), self.t, own)}" if self.held else stands
        unit = "m/s" if self.machine.scene.reduction_element == "slide" else "rad/s"
        found = f"a motion that sticks at {where}, {self.state[1]:.6g} {unit}, {self.t:.6g} s: two laws drive it back"
        advice = "let the law pass over within a band, such as min(40, max(0, 4*(110 - omega)))"
        raise SceneError([Fault("simulation", found, "laws that let the motion pass", advice)])

    def _undefined(self, anchor: Anchor) -> Fault | None:
        """The fault of a law without a finite value in the last state that a step tried, if it is one."""
        if self.undefined is None:
            return None
        phi, omega, t = self.undefined
        fault = turning_moment.not_finite(self.machine, phi, anchor.phi, omega, t)
        return None if fault.path == "mechanism" else fault._replace(found=f"{fault.found} after {t:.6g} s")

    # -- cycles that are like the one before -----------------------------------------------------------------------------

    def _again(self) -> str | None:
        """Where a cycle has come back to the speed it began with, as it must: the ones to come, and the goal in them.

        As many are taken like the last one as there is time for, and no goal in sight; goals are looked for at a few
        instants of every step.
        """
        if self.once or self.state[0] != self.cycle or self.state[1] <= 0.0 or self.state.size > 3:
            return None
        last, self.passed = self.passed, (len(self.stretches), self.t, self.state.copy())
        if last is None or self.returns is False:
            return None
        first, start, before = last
        period = self.t - start
        count = int(min((self.until - self.t) / period, _MOST_STEPS))  # a motion may be followed without a last time
        off = abs(self.state[1] / before[1] - 1.0)
        if count < FEWEST or not off <= max(_RETURNED * self.tolerance.relative, _RETURNED_AT_BEST):
            return None
        if self.returns is None:
            self.returns = returns(self.machine, self.dynamics.balance)
        if not self.returns:
            return None
        cycle, shares = self.stretches[first:], np.array([0.25, 0.5, 0.75, 1.0])
        rows = [step.start + shares * (step.end - step.start) for step, _, _ in cycle]
        t = np.concatenate(rows)
        states = np.concatenate([step.dense(row)[:2] for row, (step, _, _) in zip(rows, cycle, strict=True)], axis=1)
        phi, omega = states[0] + np.repeat([offset for _, offset, _ in cycle], shares.size), states[1]
        self.drift = max(self.drift, abs((self.state[1] / before[1]) ** 2 - 1.0))
        self.state[1:] = before[1:]
        for k in range(1, count + 1):
            time, way = k * period, k * self.cycle
            if any(bool((goal.value(t + time, phi + way, omega) <= 0.0).any()) for goal in self.goals):
                break
            like = [Stretch(later(step, time), offset + way, anchor) for step, offset, anchor in cycle]
            self.repeated, self.cycles, self.t = self.repeated + 1, self.cycles + 1, like[-1].step.end
            self.offset += self.cycle
            self._add(like)
            goal = self.passing(self.t, float(self.state[1]))
            if goal is not None:
                return goal
        self.passed, self.returns = None, not self.goals
        return None

    # -- one stretch -----------------------------------------------------------------------------------------------------

    def _along(self, ends: tuple[float, float], anchor: Anchor) -> RateField:
        """The same rates at many instants at once."""
        dynamics = self.dynamics

        def rates(t: Array, states: Array) -> Array:
            omega = states[1]
            now = dynamics.along(states[0], anchor, omega, t, states[3:], ends)
            if (now.inertia < self.light).any():
                self._check_weighs(ends, anchor)
            acceleration = np.where(now.inertia > 0.0, now.acceleration, np.nan)
            return np.array([omega, acceleration, now.moment * omega, *now.rates])

        return RateField(rates, np.array(self.sizes), stiffness(self.machine), dynamics.plainly(anchor) is not None)

    def _rates(self, ends: tuple[float, float] | None, anchor: Anchor) -> Rates:
        """d(phi, omega, work, a motor's states)/dt within a stretch."""
        dynamics, size = self.dynamics, self.state.size

        def walked(t: float, state: Sequence[float]) -> tuple[float, ...]:
            phi, omega, _, *own = state
            now = dynamics.at(phi, anchor.phi, omega, t, states=own, ends=ends, anchor=anchor)
            if not now.inertia > 0.0 and self.once and ends is not None and not ends[0] <= phi <= ends[1]:
                return (math.nan,) * size  # a step that tries beyond the stroke is too long
            if not now.inertia > 0.0:
                raise SceneError([turning_moment.weightless(self.machine, phi, now.inertia)])
            if now.inertia < self.light and ends is not None:
                self._check_weighs(ends, anchor)
            if math.isfinite(phi * omega) and not math.isfinite(now.moment):
                self.undefined = phi, omega, t
            return (omega, now.acceleration, now.moment * omega, *now.rates)

        equation, tallied = dynamics.plainly(anchor), counting()
        if equation is None:
            return walked

        def plain(t: float, state: Sequence[float]) -> tuple[float, ...]:
            phi, omega = state[0], state[1]
            try:
                acceleration, moment, inertia, rates = equation(phi, omega, t, state[3:])
            except (ValueError, ArithmeticError):
                return walked(t, state)
            work = moment * omega
            if not (inertia >= self.light and work - work == 0.0):
                return walked(t, state)
            if tallied:
                count(1)
            return (omega, acceleration, work) if size == 3 else (omega, acceleration, work, *rates)

        return plain

    def _check_weighs(self, ends: tuple[float, float], anchor: Anchor) -> None:
        """Refuse to run into a place where nothing weighs: the driver moves there while all masses stand."""
        from scipy.optimize import minimize_scalar

        def inertia(phi: float) -> float:
            return float(self.dynamics.at(phi, anchor.phi, 0.0, self.t, anchor=anchor).inertia)

        least = minimize_scalar(inertia, bounds=ends, method="bounded", options={"xatol": 1e-9 * (ends[1] - ends[0])})
        if least.fun < _NOTHING / _LIGHT * self.light:
            raise SceneError([turning_moment.weightless(self.machine, float(least.x), 0.0)])
        self.light = 0.0

    def _anchor(self, ends: tuple[float, float], stop: float) -> tuple[Anchor, Array]:
        """Where branches are decided in the coming stretch: a little ahead, where there are any but those of position.

        And a motor's own states there.
        """
        low, high = ends
        middle, width = 0.5 * (low + high), high - low
        phi, omega = float(self.state[0]), float(self.state[1])
        here = Anchor(middle, omega, self.t)
        if not self.branching:
            return here, self.state[3:]
        if self.held and omega == 0.0:
            here = here._replace(omega=self.sense * ONSET * self.typical)
        rate = self._rates(ends, here)(self.t, self.state)
        acceleration = float(rate[1]) if np.isfinite(rate[1]) or not self.rough else 0.0  # friction may leave none
        ahead = _AHEAD * min(width / max(abs(omega), 1e-3 * self.typical), stop - self.t)
        ahead = max(ahead, 64 * np.finfo(float).eps * self.t)
        soon = phi + ahead * (omega + 0.5 * ahead * acceleration)
        held = min(max(soon, low + _WITHIN * width), high - _WITHIN * width)
        coming = omega + ahead * acceleration or ONSET * self.typical  # from rest without a push yet: forwards
        anchor = Anchor(held, coming, self.t + ahead)
        own = [float(value + ahead * change) for value, change in zip(self.state[3:], rate[3:], strict=True)]
        now = self.dynamics.at(held, held, anchor.omega, anchor.time, states=own, ends=ends, anchor=anchor)
        if now.friction is None:
            return anchor._replace(factors=now.factors or None), np.array(own)
        if now.friction.solutions > 1:
            raise SceneError([self._undecided(f"{now.friction.solutions} accelerations fit {now.friction.joint}")])
        if not np.isfinite(now.friction.moments).all():
            raise SceneError([self._undecided(f"{now.friction.joint} jams the machine, as no acceleration fits it")])
        return anchor._replace(factors=now.factors or None, sides=now.friction.sides[0]), np.array(own)

    def _events(self, anchor: Anchor, coming: Array) -> Events | None:
        """Goals, and what changes its sign where the stretch ends; meshes with losses also watch the speed's own sign.

        coming: a motor's own states at the anchor.
        """
        goals, offset = self.goals, self.offset

        def sides(phi: Array, omega: Array, t: Array, own: States) -> list[Array]:
            rows = self.dynamics.sides(phi, anchor, omega, t, own) if self.branching else []
            return rows if anchor.factors is None and not self.held else [*rows, omega]

        def values(t: Array, states: Array) -> Array:
            phi, omega = states[0], states[1]
            return np.array(
                [goal.value(t, phi + offset, omega) for goal in goals] + sides(phi, omega, t, states[3:]), dtype=float
            )

        def clear(step: runge_kutta.Step) -> bool:
            for goal in goals:
                assert goal.line is not None
                k, level, slope = goal.line
                middle = 0.5 * (step.state[k] + step.after[k]) + (0.0 if k else offset)
                if not level + slope * middle > abs(slope) * step.h * max(abs(rate[k]) for rate in step.slopes):
                    return False
            return True

        if not (self.branching or goals):
            return None
        straight = not self.branching and all(goal.line is not None for goal in goals)
        here = np.array([anchor.phi]), np.array([anchor.omega]), np.array([anchor.time]), coming[:, None]
        found = np.array([1.0] * len(goals) + [1.0 if side[0] >= 0.0 else -1.0 for side in sides(*here)])
        if straight:
            return Events(values, found, clear)
        short = residuals(found, values(np.array([self.t]), self.state[:, None])[:, 0])
        short[: len(goals)] = 0.0  # a goal that is reached is reached
        return Events(values, found, residuals=short)

    # -- from piece to piece ---------------------------------------------------------------------------------------------

    def _push(self, low: float, high: float) -> float:
        """The acceleration at rest in a piece; with dry friction, which was asked before, the sense alone."""
        if self.held:
            return self.sense
        anchor = Anchor(0.5 * (low + high), float(self.state[1]), self.t)
        return float(self._rates(None, anchor)(self.t, self.state)[1])

    def _leaves(self) -> bool:
        """Whether a machine stands at an end of its stroke and is about to leave it."""
        phi, omega = float(self.state[0]), float(self.state[1])
        outwards = {0.0: -1.0, self.cycle: 1.0}.get(phi)
        if outwards is None:
            return False
        if omega == 0.0:
            omega = self._push(*(self.machine.restarts[:2] if phi == 0.0 else self.machine.restarts[-2:]).tolist())
        return omega * outwards > 0.0

    def _piece(self) -> int:
        """The piece that the motion goes on in; the angle within the cycle changes over to it."""
        ends, phi, omega = self.machine.restarts, float(self.state[0]), float(self.state[1])
        turn = 0.0 if self.once else self.cycle  # nothing comes round again on a stroke
        forwards = omega > 0.0
        if omega == 0.0:
            ahead = min(max(int(np.searchsorted(ends, phi, side="right")) - 1, 0), ends.size - 2)
            forwards = self._push(*ends[ahead : ahead + 2].tolist()) >= 0.0
        shift = turn * ((forwards and phi >= self.cycle) - (not forwards and phi <= 0.0))
        self.state[0], self.offset = phi - shift, self.offset + shift
        if forwards:
            return min(int(np.searchsorted(ends, phi - shift, side="right")) - 1, ends.size - 2)
        return max(int(np.searchsorted(ends, phi - shift, side="left")) - 1, 0)


def _shorter(t: Array) -> Callable[[float], float]:
    """The longest of steps beside those between times (s), by the time that they start at."""
    ends, widths = t[1:].tolist(), (_SHORTER * np.diff(t)).tolist()
    last = len(widths) - 1
    return lambda t: float(widths[min(bisect_right(ends, t), last)])


def end_of_stroke(scene: Scene, phi: float, last: float) -> str:
    """The word on a motion that ended with its stroke; phi is the driver's own coordinate."""
    assert scene.stroke is not None
    return f"the driver reached the stroke's end at {told(phi, scene.stroke.sliding)} after {last:.6g} s"


# -- what becomes of a machine without a steady motion --------------------------------------------------------------------

_CYCLES = 20
_FASTER = 10.0  # times the speed at the start: a machine that gets there runs away
_RTOL = 1e-6
_WORK, _HURRIED = 20_000.0, 12_000.0  # walks of a rotor's graph, at most about a second: a message is worth no more
_AT_ONCE = 16  # positions within a walk that take as long as the walk itself
_ELEMENTS = 8  # of a graph that take as long to walk as a rotor's


class Outcome(Enum):
    """How a motion ends."""

    STALLS = "stalls"
    RUNS_AWAY = "runs away"
    UNKNOWN = "goes on"


class Ending(NamedTuple):
    """How it ends, and where: `machine stalls at crank angle 83.2 deg after 1.2 s`.

    `fault` is why it could not be followed, where that is known.
    """

    outcome: Outcome
    where: str = ""
    fault: Fault | None = None


def outcome_of(machine: Machine, speed: float, inertia: float, balance: float, *, hurried: bool = False) -> Ending:
    """What becomes of a machine let go at phi = 0: it is followed in time, as a check of what is said of it.

    Args:
        machine: the machine.
        speed: of the crank at the start, rad/s.
        inertia: of the flywheel, kg m² on the crank.
        balance: value (SI) of the scene's unknown.
        hurried: whether enough work went into the machine already.

    """
    cycle = machine.scene.cycle

    passed = 0

    def passing(t: float, omega: float) -> str | None:
        nonlocal passed
        passed += 1
        return Outcome.UNKNOWN.value if passed >= _CYCLES else None

    goals = (straight(Outcome.STALLS.value, 1, 0.0, 1.0), straight(Outcome.RUNS_AWAY.value, 1, _FASTER * speed, -1.0))
    dynamics, until = Dynamics(machine, inertia, balance), 100 * _CYCLES * cycle / speed
    states = () if dynamics.circuit is None else dynamics.circuit.steady(dynamics.ratio * speed)
    each, known = 1 + len(machine.kinematics.graph.elements) // _ELEMENTS, 0

    def walked() -> None:
        """Count walks of the graph, the more the longer they take."""
        nonlocal known
        spend(each * (1.0 + (tally.evaluations - known) / _AT_ONCE))
        known = tally.evaluations

    try:
        with limited(_HURRIED if hurried else _WORK), counted(walked) as tally:
            trail = follow(dynamics, Start(0.0, speed, states), until, _RTOL, goals, passing)
    except BudgetError:
        return Ending(Outcome.UNKNOWN)
    except SceneError as error:
        return Ending(Outcome.UNKNOWN, fault=error.faults[0])
    outcome = Outcome(trail.goal) if trail.goal is not None else Outcome.STALLS if trail.stuck else Outcome.UNKNOWN
    phi = float(trail.ends()[0, -1])
    return Ending(outcome, f"at {machine.where(phi % cycle)} after {float(trail.t[-1]):.4g} s")
