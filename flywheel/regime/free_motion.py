"""The motion of a machine in time from any start: from one smooth stretch of its laws to the next (`follow`).

A stretch ends where the crank leaves a piece, at a time at which a law switches (`SwitchingTimes`, computed beforehand by
interval bounds, if time alone decides), and where a law that depends on speed, or the direction of the power through a mesh,
changes its side. Where the moment depends on position alone and its work over the cycle is zero, the speed at phi = 0
returns exactly: one cycle is then stepped and copied. The difference of the stepped return is the steps' own
error: it is reported, and not added to the next cycle.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import GraphError
from bondgraph.motion import runge_kutta, standstill
from bondgraph.motion.runge_kutta import STIFF, RateField, Rates
from bondgraph.motion.standstill import ROUNDING, Release
from bondgraph.motion.stepping import Events, Piece, Step, StepError, residuals, through
from bondgraph.numerics import counting, summit
from flywheel.components.motors.motor import States
from flywheel.machine.dynamics import ONSET, MachineDynamics, MotionStretch, StartState, Trail, later
from flywheel.machine.equation import not_finite
from flywheel.machine.loads import LoadLaw
from flywheel.machine.machine import Anchor, Machine
from flywheel.numerics.budget import count
from flywheel.numerics.cells import Array
from flywheel.numerics.expressions import Expression, Node, composed, numeral, renamed, written
from flywheel.numerics.faults import Fault, SceneError, coordinate_text
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet
from flywheel.numerics.switching import SwitchingError, breakpoints, resolved
from flywheel.regime import turning_moment
from flywheel.scene.scene import Scene

# -- times at which laws switch ------------------------------------------------------------------------------------------

_WINDOW = 100.0  # turns at the machine's typical speed: range of the search for switches where no end is known


class SwitchingTimes:
    """The times (s) at which expressions of `t` and parameters change their branch, up to an end that may be infinite.

    For a steep law, such as a short pulse, there are more, so close that no step passes over it.
    `after(t)` gives the next of them, or the end of the range searched; time stepping restarts there.
    """

    def __init__(self, machine: Machine, until: float) -> None:
        self.until = until
        self._switches: list[tuple[LoadLaw, Expression]] = []  # what decides branches by time alone, with `phi` for `t`
        self._smooth: list[tuple[LoadLaw, Expression]] = []  # the largest parts of laws of time alone, likewise
        for effort in machine.efforts:
            law = effort.load.law
            if isinstance(law, Expression) and effort.uses_time:
                at_rest = [_at_rest(part) for part in (*law.switches(), *law.branch_points())]
                parts = [part for part in at_rest if effort.is_timed(part)]
                self._switches += [(effort, Expression(p.text, Node("sign", (renamed(p.tree, "t", "phi"),)))) for p in parts]
                self._smooth += [(effort, Expression(p.text, renamed(p.tree, "t", "phi"))) for p in _timed(effort, law.tree)]
        self._window = min(until, _WINDOW * machine.scene.cycle / machine.typical_speed)
        self._seen = 0.0
        self._times: list[float] = []

    def every(self) -> list[float]:
        """All of them, before a finite end; from a single search, so that no window's end is among them."""
        self._window = self.until
        times = [self.after(0.0)]
        while times[-1] < self.until:
            times.append(self.after(times[-1]))
        return times[:-1]

    def after(self, t: float) -> float:
        """The first time after t at which to stop."""
        if not (self._switches or self._smooth):
            return self.until
        while (later := bisect_right(self._times, t)) == len(self._times):
            start, end = self._seen, self._seen + self._window
            roots = _switching_times(breakpoints, self._switches, start, end)
            edges = np.array(sorted({start, *roots, end}))
            steep = _switching_times(resolved, self._smooth, edges[:-1], edges[1:])
            self._times += sorted({*roots, *steep, end} - {start})
            self._seen = end
        return min(self._times[later], self.until)


def switching_times(machine: Machine, until: float) -> SwitchingTimes:
    """The switching times of a machine; the last ones are kept with it, for further motions up to the same end."""
    if "switching_times" not in machine.kept or machine.kept["switching_times"].until != until:
        machine.kept["switching_times"] = SwitchingTimes(machine, until)
    times: SwitchingTimes = machine.kept["switching_times"]
    return times


def _at_rest(part: Expression) -> Expression:
    """An expression at a speed of 0, if it then depends on time: its switch may release a machine at rest."""
    return Expression(part.text, composed(part.tree, {"omega": numeral(0.0)})) if part.names >= {"omega", "t"} else part


def _timed(effort: LoadLaw, node: Node) -> Iterator[Expression]:
    """The largest parts of a law, from a node of it on, that depend on time alone."""
    part = Expression(written(node), node)
    if node.args and effort.is_timed(part):
        yield part
    elif "t" in part.names:
        for arg in node.args:
            yield from _timed(effort, arg)


def _switching_times(
    search: Callable[..., Iterable[float]], laws: list[tuple[LoadLaw, Expression]], low: Any, high: Any
) -> set[float]:
    """The switching times (s) of laws of time between ends, by interval bounds; a fault names `t` as in the scene."""
    times: set[float] = set()
    for effort, law in laws:
        try:
            times.update(map(float, search(law, low, high, *_in_time(effort.constants))))
        except SwitchingError as error:
            what = re.sub(r"\bphi\b", "t", str(error))
            expected = f"an expression that can be followed to {np.max(high):.6g} s"
            raise SceneError([Fault(effort.path, what, expected, "a shorter time")]) from error
    return times


def _in_time(constants: Mapping[str, float]) -> tuple[Callable[..., Mapping[str, Any]], Callable[..., Mapping[str, Any]]]:
    """Bounds over cells of time, and values at times."""
    return (
        lambda lo, hi, anchor: {**constants, "phi": Jet(Interval(lo, hi), 1.0)},
        lambda times, anchor: {**constants, "phi": times},
    )


# -- what ends a motion ---------------------------------------------------------------------------------------------------


class Goal(NamedTuple):
    """End condition of a motion: a value of times, positions (not reduced) and speeds that is above 0 until then.

    `line`, for a value linear in one state, is that state (0 position, 1 speed), its level and slope.
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


# -- cycles that return ---------------------------------------------------------------------------------------------------

FEWEST = 20  # cycles still to come, below which no repetition is sought
_NET_ROUNDING = 1e-13  # of the work exchanged: error by quadrature of a net work of zero


def returns(machine: Machine, balance: float) -> bool:
    """Tests whether the work of a cycle is zero, whatever the speed: with a value (SI) of the scene's unknown.

    True only where no load depends on speed or time, and the net work is no more than its own rounding.
    """
    scene = machine.scene
    if machine.depends_on_speed or machine.depends_on_time or machine.has_joint_friction:
        return False
    if scene.stroke is not None or len(machine.stages) > 1:
        return False
    cycle = turning_moment.balanced(machine, _NET_ROUNDING)
    settled = cycle.balance is None or abs(cycle.balance - balance) <= _NET_ROUNDING * abs(balance)
    return bool(settled and max(abs(cycle.net), cycle.errors.work) <= _NET_ROUNDING * cycle.exchanged)


def copies(
    cycle: Sequence[MotionStretch], period: float, way: float, count: int, goals: Sequence[Goal]
) -> Iterator[list[MotionStretch]]:
    """Repetitions of a cycle, each a period (s) and an angle (rad) later, up to a count and until a goal is near.

    Goals are searched for at a few instants of every step.
    """
    shares = np.array([0.25, 0.5, 0.75, 1.0])
    rows = [step.start + shares * (step.end - step.start) for step, _, _ in cycle]
    t = np.concatenate(rows)
    states = np.concatenate([step.dense(row)[:2] for row, (step, _, _) in zip(rows, cycle, strict=True)], axis=1)
    phi, omega = states[0] + np.repeat([offset for _, offset, _ in cycle], shares.size), states[1]
    for k in range(1, count + 1):
        if any(bool((goal.value(t + k * period, phi + k * way, omega) <= 0.0).any()) for goal in goals):
            return
        yield [MotionStretch(later(step, k * period), offset + k * way, anchor) for step, offset, anchor in cycle]


# -- at rest --------------------------------------------------------------------------------------------------------------


class Rest(NamedTuple):
    """A machine at rest from a time on, at a position within the cycle: only the motor's own states vary."""

    dynamics: MachineDynamics
    time: float
    state: Array

    def at(self, t: Any) -> Array:
        """The states at times t."""
        times = np.asarray(t, dtype=float)
        states = np.broadcast_to(self.state.reshape(-1, *(1,) * times.ndim), (self.state.size, *times.shape)).copy()
        if self.dynamics.circuit is not None:
            states[3:] = self.dynamics.circuit.standing(self.state[3:].tolist(), times - self.time)
        return states

    def release(self, stop: float) -> Release | None:
        """Time and sense of its release, at the latest at a time with direction 0; None if it stays at rest.

        It stays if nothing that depends on time acts on it. Forwards, if both directions are possible.
        """
        machine, phi, decided = self.dynamics.machine, float(self.state[0]), 0.5 * (self.time + stop)
        sides = neighbours(machine, phi)

        def accelerations(times: Array) -> Array:
            return self.dynamics.from_rest(phi, *sides, times, self.at(times)[3:], decided)

        try:
            if machine.depends_on_time or self.dynamics.circuit is not None:
                return standstill.release(accelerations, self.time, stop)
            direction = standstill.direction(*accelerations(np.array([self.time]))[:, 0].tolist())
            return (self.time, direction) if direction else None
        except standstill.EitherWayError:
            if rough_joints(self.dynamics):
                what = "friction in its joints permits a start in either direction"
                raise SceneError([undecided(machine, phi, self.time, what)]) from None
            return self.time, 1.0
        except GraphError as error:
            defect, expected = f"a machine at rest at {machine.where(phi)}: {error}", "laws that can be followed"
            raise SceneError([Fault("until", defect, expected, "a shorter time")]) from None


def rough_joints(dynamics: MachineDynamics) -> int:
    """The number of passive actions of joints that dry friction follows."""
    return 0 if dynamics.joint_friction is None else int(dynamics.joint_friction.curved.size)


def undecided(machine: Machine, phi: float, t: float, what: str) -> Fault:
    """The fault of friction that leaves no motion, or several."""
    defect = f"friction that leaves no one motion at {machine.where(phi)} after {t:.6g} s: {what} (Painlevé's paradox)"
    return Fault("simulation", defect, "one motion", "less friction, longer shoes, or smaller pins")


def neighbours(machine: Machine, phi: float) -> tuple[float, float]:
    """Points in the pieces ahead of a position within the cycle, and behind it."""
    edges, turn = machine.restarts, 0.0 if machine.scene.stroke is not None else machine.scene.cycle
    on, back = turn * (phi >= edges[-1]), turn * (phi <= 0.0)
    ahead = int(np.searchsorted(edges, phi - on, side="right")) - 1
    behind = int(np.searchsorted(edges, phi + back, side="left")) - 1
    pieces = [min(max(k, 0), edges.size - 2) for k in (ahead, behind)]
    places = [0.5 * float(edges[k] + edges[k + 1]) for k in pieces]
    return places[0] + on, places[1] - back


def rest_cause(dynamics: MachineDynamics, phi: float, t: float, states: States = ()) -> str:
    """Reason why a machine stays at rest at a position within the cycle, in words."""
    machine = dynamics.machine
    moment, most, locking = dynamics.stiction(phi, *neighbours(machine, phi), t, states)
    effort, unit = effort_of(machine.scene)
    if abs(moment) <= ROUNDING * min(most, 1e300):
        return f"{effort} = 0 {unit}, so that nothing moves it"
    if not dynamics.holds:
        return f"{effort} drives it back on either side"
    what = f"{friction_of(machine)} holds {effort} = {moment:.6g} {unit}"
    if not machine.has_joint_friction and len(machine.stages) > 1:
        return what
    if locking:
        return f"{what}: it locks itself, as no size of {' or '.join(locking)} moves it (self-locking)"
    if not math.isfinite(most):
        return f"{what}: it locks itself, as no action of its driver moves it (self-locking)"
    return f"{what}, and would hold up to {most:.6g} {unit}"


def effort_of(scene: Scene) -> tuple[str, str]:
    """Symbol and unit of the reduced moment, or of the reduced force where the driver slides."""
    return ("F*", "N") if scene.sliding else ("M*", "N m")


def friction_of(machine: Machine) -> str:
    """The friction that may hold a machine at rest, in words."""
    if machine.has_joint_friction:
        return "friction in its joints"
    dry = [effort for effort in machine.efforts if effort.is_dry]
    if not dry:
        return "the loss in its meshes"
    return "the drag of its shafts" if all(effort.load.drag for effort in dry) else "dry friction"


# -- the motion from a start ----------------------------------------------------------------------------------------------


def stiffness(machine: Machine, *, plain: bool = False) -> float:
    """The number of time constants ahead that makes a machine's motion stiff (see `RateField`).

    For a linkage many positions cost as much as one, so implicit steps, which need many, are always taken, unless its laws
    are known in plain numbers.
    """
    if not plain and any(mechanism.linkage is not None for mechanism in machine.scene.mechanisms):
        return 0.0
    return STIFF if machine.depends_on_speed else np.inf


def too_short(error: StepError) -> Fault:
    """The fault of a motion that the smallest step cannot follow."""
    defect = f"a motion that the smallest step cannot follow, after {error.time:.6g} s"
    return Fault(
        "simulation", defect, "a motion that can be followed", "look for a mass, length or resistance that is zero there"
    )


_MOST_STEPS = 1_000_000
_LEAST_SPEED = 1e-3  # of the typical speed: below this, errors of speed count as if it were this
_AHEAD = 1e-7  # of a piece: distance beyond a switch at which its side is evaluated
_FARTHER, _FARTHEST = 10.0, 1e-3  # factor on that distance for each change of side at one instant; its limit, of a piece
_WITHIN = 1e-9  # of a piece: how near to its ends
_MOST_CROSSINGS = 500  # of switches, one after the other within a piece
_TRIES = 8  # changes of side at one instant, before the motion counts as stuck
_SMALL_INERTIA, _ZERO_INERTIA = 1e-7, 1e-11  # of the greatest inertia: where a zero is searched for, and what counts as one
_RETURNED, _RETURNED_AT_BEST = 1e4, 1e-8  # tolerances of a step: closure of a cycle that returns to its speed
_LOOKED_AT = np.array([0.1, 0.35, 0.6, 0.85])  # of a piece: places at which its inertia is evaluated
_SHORTER = 0.7  # of steps beside
_CAREFUL = 0.6  # of the longest step of the stretch before
_REST_SPEED = 1e-9  # of the typical speed: slower than this it stands
_MOST_SWINGS = 2_000  # about one place, after which a machine that is driven back to it on both sides counts as at rest


Passing = Callable[[float, float], str | None]
Watching = Callable[[float, float], None]


def follow(
    dynamics: MachineDynamics,
    start: StartState,
    until: float,
    rtol: float,
    goals: Sequence[Goal] = (),
    passing: Passing | None = None,
    watching: Watching | None = None,
    beside: Trail | None = None,
) -> Trail:
    """The motion from a start until a time (s), or until a goal is reached.

    `rtol` is the tolerance of a step. `passing(t, omega)` is called at the end of every cycle;
    a true result ends the motion. `watching(t, phi)` is called at the start, and at the end of every stretch. Steps are
    shorter than those of the motion `beside` everywhere, so that the two do not pass over the same events.

    Raises SceneError if the motion is not determined, or sticks at a switch to which both sides drive it back.
    """
    return _FreeMotion(dynamics, start, until, rtol, goals, passing or (lambda t, omega: None), watching, beside).trail()


class _FreeMotion:
    """The present state of a motion: `state` has phi reduced to one cycle, `offset` is the part taken off."""

    def __init__(
        self,
        dynamics: MachineDynamics,
        start: StartState,
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
        absolute, self.sizes = (
            [rtol * self.cycle, rtol * _LEAST_SPEED * self.typical, np.inf],
            [self.cycle, self.typical, 1.0],
        )
        if (circuit := dynamics.circuit) is not None:
            self.sizes += circuit.scales
            absolute += [rtol * _LEAST_SPEED * scale for scale in circuit.scales]
        self.tolerance = rtol, np.array(absolute)
        self.state = np.array([start.phi - self.offset, start.omega, 0.0, *start.states])
        self.t, self.stretches = start.time, list[MotionStretch]()
        self.branching = dynamics.branching
        self.rough = rough_joints(dynamics)
        # of the motion, 0 at rest; None if no law knows it
        self.direction = float(np.sign(start.omega)) if dynamics.holds else None
        edges = self.machine.restarts  # a piece may be the whole cycle, with a dead centre in its middle
        places = (edges[:-1, None] + np.diff(edges)[:, None] * _LOOKED_AT).ravel()
        self.light = _SMALL_INERTIA * (float(np.max(self.machine.reduce(places).inertia)) + dynamics.inertia)
        self.undefined: tuple[float, float, float] | None = None  # the last state in which a law had no value
        self.times = switching_times(self.machine, until)
        self.cycles, self.repeated, self.drift = 0, 0, 0.0
        self.passed: tuple[int, float, Array] | None = None  # the last cycle: its first stretch, its start and state then
        self.returns: bool | None = None  # not looked into yet
        self.swings, self.left = (math.nan, 0), 0.0  # how often it came back to the end of a piece, which one; see `Trail`
        self.length = None if beside is None or not beside.stretches else _shorter(beside.t)

    def trail(self) -> Trail:
        """Stretch after stretch in either direction."""
        goal = stuck = None
        hint: float | None = None
        stops = crossings = 0  # at one instant; of switches, one after the other
        self._add([])
        while self.t < self.until and goal is None:
            self._check_friction()
            if self.state[1] == 0.0 and self.direction is None and self._settles():  # it starts where it is driven back to
                self.direction = 0.0
            if self.direction == 0.0:
                if self._rests():
                    continue
                stuck = self._stuck()
                break
            if self.once and self._leaves():
                break
            piece = self._piece()
            ends = float(self.machine.restarts[piece]), float(self.machine.restarts[piece + 1])
            width, stop = ends[1] - ends[0], self.times.after(self.t)
            anchor, own = self._anchor(ends, stop, min(_AHEAD * _FARTHER**stops, _FARTHEST))
            rates, along, events = self._rates(ends, anchor), self._along(ends, anchor), self._events(anchor, own)
            try:
                whole = Piece(rates, ends, stop, self.tolerance, along, self.length)
                steps = [*through(whole, self.t, self.state, hint, events)]
            except StepError as error:
                raise SceneError([self._undefined(anchor) or too_short(error)]) from None
            self.t, crossed = steps[-1].end, steps[-1].crossed
            self.state = np.array(steps[-1].last, dtype=float)
            # the speed is the last that is watched
            stopped = self.direction is not None and events is not None and crossed == events.sides.size - 1
            if stopped:
                self.state[1] = self.direction = 0.0
            self._add([MotionStretch(step, self.offset, anchor) for step in steps if step.end > step.start])
            stops = stops + 1 if crossed is not None and self.t == steps[-1].start else 0
            crossings = crossings + 1 if crossed is not None else 0
            if stops and self.direction and 0.0 < abs(self.state[1]) <= _REST_SPEED * self.typical:  # it stops with that
                self.state[1] = self.direction = 0.0
            # a switch may lie where the piece ends, so near that the motion continues in the next one
            near = ends[1] if self.state[1] > 0.0 else ends[0]
            at_end = crossed is None or (not stopped and abs(float(self.state[0]) - near) <= 2 * _AHEAD * width)
            if crossed is not None and crossed < len(self.goals):
                goal = self.goals[crossed].name
            elif at_end and self.t < stop:  # the state is put there exactly
                self.state[0] = min(ends, key=lambda end: abs(float(self.state[0]) - end))
                if not self.once and self.state[0] == self.cycle:
                    self.cycles += 1
                    goal = self.passing(self.t, float(self.state[1]))
            if at_end and self._settles():
                self.state[1] = self.direction = 0.0
            goal = goal or self._again()
            if stops > _TRIES or crossings > _MOST_CROSSINGS:
                stuck = self._stuck()
                break
            taken = [step.end - step.start for step in steps if step.end > step.start]
            if taken:  # the estimate of a step that begins a piece may be wrong: it is no long one, but where one is enough
                hint = max(taken) * (1.0 if len(taken) == 1 else _CAREFUL)
        stretches = tuple(self.stretches)
        counts = self.cycles, self.repeated, self.drift, self.left
        return Trail(self.dynamics, self.start, stretches, goal, stuck, *counts)

    def _add(self, stretches: list[MotionStretch]) -> None:
        """Keeps stretches that end now; in none of them does the speed oppose the direction of its laws.

        So no dry law supplies energy: its moment is against that direction.
        """
        for step, _, anchor in stretches if self.direction is not None else ():
            against = 0.0 if step.after is None else -anchor.direction * step.after[1]
            assert against <= self.tolerance[1][1] / _LEAST_SPEED, against
        self.stretches += stretches
        if self.watching is not None:
            self.watching(self.t, float(self.state[0]) + self.offset)
        if len(self.stretches) > _MOST_STEPS:
            expected = f"a shorter time: {_MOST_STEPS} steps reach {self.t:g} s"
            raise SceneError([Fault("until", f"{self.until:g} s", expected)])

    def _check_friction(self) -> None:
        """Refuses a reversal if friction is a moment of position, known only for one direction."""
        stroke = self.machine.scene.stroke
        sense = 1.0 if stroke is None or (stroke.speed or 1.0) > 0.0 else -1.0
        if self.machine.friction is not None and float(self.state[1]) * sense < 0.0:
            defect = f"a motion that turns back by {self.t:.6g} s, with friction in joints"
            expected = "one that keeps the sense for which that friction was found"
            raise SceneError([Fault("until", defect, expected, "a shorter time, or leave friction out")])

    # -- at rest ----------------------------------------------------------------------------------------------------------

    def _settles(self) -> bool:
        """Tests whether it comes to rest at the end of a piece: a decaying swing about the place, driven back on both sides.

        Its speed is then negligible, or it has swung so often that the remaining swing is reported instead.
        """
        phi, speed = float(self.state[0]), abs(float(self.state[1]))
        self.swings = (phi, self.swings[1] + 1 if self.swings[0] == phi else 0)
        if self.once or (speed > self.tolerance[0] * self.typical and self.swings[1] < _MOST_SWINGS):
            return False
        there = self.dynamics.from_rest(phi, *neighbours(self.machine, phi), np.array([self.t]), self.state[3:, None])
        if not there[0, 0] < 0.0 < there[1, 0]:
            return False
        self.left = max(self.left, speed / self.typical)
        return True

    def _rests(self) -> bool:
        """Tests whether the machine leaves its rest (in `direction`), or time continues until a law switches.

        False if no law that depends on time acts on it: it then stands permanently.
        """
        stop = min(self.times.after(self.t), self.until)
        rest, phi = Rest(self.dynamics, self.t, self.state.copy()), float(self.state[0])
        release = rest.release(stop)
        if release is None:
            return False
        end, self.direction = release
        joints = np.zeros(3 * self.rough) if self.rough else None
        factors = None if len(self.machine.stages) == 1 else (1.0,) * len(self.machine.stages)
        anchor = Anchor(phi, 0.0, 0.5 * (self.t + stop), factors, joints, 0.0)
        self._add([MotionStretch(Step(rest.at, self.t, end), self.offset, anchor)] if end > self.t else [])
        self.t, self.state = end, rest.at(end)
        if self.direction and not self.dynamics.holds:
            self.direction = None
        return True

    def _stuck(self) -> str:
        """The reason why the machine stands still permanently; a SceneError where it sticks to a switch while running."""
        where = self.machine.where(float(self.state[0]))
        if abs(self.state[1]) <= _REST_SPEED * self.typical:
            stands = f"stands still at {where} after {self.t:.6g} s"
            own = self.state[3:].tolist()
            return f"{stands}: {rest_cause(self.dynamics, float(self.state[0]), self.t, own)}"
        unit = "m/s" if self.machine.scene.reduction_element == "slide" else "rad/s"
        defect = f"a motion that sticks at {where}, {self.state[1]:.6g} {unit}, {self.t:.6g} s: two laws drive it back"
        advice = "let the law pass over within a band, such as min(40, max(0, 4*(110 - omega)))"
        raise SceneError([Fault("simulation", defect, "laws that let the motion pass", advice)])

    def _undefined(self, anchor: Anchor) -> Fault | None:
        """The fault of a law without a finite value in the last state that a step tried, if it is one."""
        if self.undefined is None:
            return None
        phi, omega, t = self.undefined
        fault = not_finite(self.machine, phi, anchor.phi, omega, t)
        return None if fault.path == "mechanism" else fault._replace(defect=f"{fault.defect} after {t:.6g} s")

    # -- cycles that are like the one before -----------------------------------------------------------------------------

    def _again(self) -> str | None:
        """Adds the remaining cycles if one has returned to its first speed, as it must; returns the goal reached in them.

        As many copies of the last one are added as fit before the end and before a goal; goals are searched for at a few
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
        count -= self.t + count * period > self.until
        off = abs(self.state[1] / before[1] - 1.0)
        if count < FEWEST or not off <= max(_RETURNED * self.tolerance[0], _RETURNED_AT_BEST):
            return None
        if self.returns is None:
            self.returns = returns(self.machine, self.dynamics.balance)
        if not self.returns:
            return None
        self.drift = max(self.drift, abs((self.state[1] / before[1]) ** 2 - 1.0))
        self.state[1:] = before[1:]
        for like in copies(self.stretches[first:], period, self.cycle, count, self.goals):
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
            now = dynamics.at_many(states[0], anchor, omega, t, states[3:], ends)
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
            if not math.isfinite(phi * omega):
                return (math.nan,) * size  # a step that tries too much is too long
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
        """Refuses a motion into a position without inertia: the driver moves there while all masses are at rest."""
        own = self.state[3:].tolist()

        def lightness(phi: float) -> float:
            return -float(self.dynamics.at(phi, anchor.phi, 0.0, self.t, states=own, anchor=anchor).inertia)

        phi, least = summit(lightness, *ends, 1e-9 * (ends[1] - ends[0]))
        if -least < _ZERO_INERTIA / _SMALL_INERTIA * self.light:
            raise SceneError([turning_moment.weightless(self.machine, phi, 0.0)])
        self.light = 0.0

    def _anchor(self, ends: tuple[float, float], stop: float, share: float) -> tuple[Anchor, Array]:
        """The anchor of the next stretch: a share of it ahead, if there are branches that position does not decide.

        It includes a motor's own states.
        """
        low, high = ends
        middle, width = 0.5 * (low + high), high - low
        phi, omega = float(self.state[0]), float(self.state[1])
        least = ONSET * self.typical
        here = Anchor(middle, omega, self.t, direction=self.direction)
        if not self.branching:
            return here, self.state[3:]
        if self.direction is not None:
            here = here._replace(omega=self.direction * max(self.direction * omega, least))
        rate = self._rates(ends, here)(self.t, self.state)
        acceleration = float(rate[1]) if np.isfinite(rate[1]) or not self.rough else 0.0  # friction may leave none
        ahead = share * min(width / max(abs(omega), 1e-3 * self.typical), stop - self.t)
        ahead = min(ahead, share * self.typical / max(abs(acceleration), 1e-300))
        ahead = max(ahead, 64 * np.finfo(float).eps * self.t)
        soon = phi + ahead * (omega + 0.5 * ahead * acceleration)
        place = min(max(soon, low + _WITHIN * width), high - _WITHIN * width)
        coming = omega + ahead * acceleration or least  # from rest without a push yet: forwards
        if self.direction is not None:
            coming = self.direction * max(self.direction * coming, least)
        anchor = Anchor(place, coming, self.t + ahead, direction=self.direction)
        own = [float(value + ahead * change) for value, change in zip(self.state[3:], rate[3:], strict=True)]
        now = self.dynamics.at(place, place, anchor.omega, anchor.time, states=own, ends=ends, anchor=anchor)
        if now.friction is None:
            return anchor._replace(factors=now.factors or None), np.array(own)
        what = f"{now.friction.joint} jams the machine, as no acceleration fits it"
        if now.friction.solutions > 1:
            what = f"{now.friction.solutions} accelerations fit {now.friction.joint}"
        if now.friction.solutions > 1 or not np.isfinite(now.friction.moments).all():
            raise SceneError([undecided(self.machine, phi, self.t, what)])
        return anchor._replace(factors=now.factors or None, sides=now.friction.sides[0]), np.array(own)

    def _events(self, anchor: Anchor, coming: Array) -> Events | None:
        """Goals, functions that change sign at the end of the stretch, and last the speed, if it may be held at rest.

        coming: a motor's own states at the anchor.
        """
        goals, offset = self.goals, self.offset
        lines = [goal.line for goal in goals]
        if self.direction is not None:
            lines.append((1, 0.0, self.direction))

        def sides(phi: Array, omega: Array, t: Array, own: States, there: bool = False) -> list[Array]:
            rows = self.dynamics.sides(phi, anchor, omega, t, own, there=there) if self.branching else []
            return rows if self.direction is None else [*rows, self.direction * omega]

        def values(t: Array, states: Array) -> Array:
            phi, omega = states[0], states[1]
            rows = [goal.value(t, phi + offset, omega) for goal in goals] + sides(phi, omega, t, states[3:])
            return np.array(rows, dtype=float).reshape(len(rows), t.size)  # none if no load switches in this piece

        def clear(step: runge_kutta.MethodStep) -> bool:
            for line in lines:
                assert line is not None
                k, level, slope = line
                middle = 0.5 * (step.state[k] + step.after[k]) + (0.0 if k else offset)
                if not level + slope * middle > abs(slope) * step.h * max(abs(rate[k]) for rate in step.slopes):
                    return False
            return True

        if not (self.branching or lines):
            return None
        straight = not self.branching and all(line is not None for line in lines)
        here = np.array([anchor.phi]), np.array([anchor.omega]), np.array([anchor.time]), coming[:, None]
        signs = np.array([1.0] * len(goals) + [1.0 if side[0] >= 0.0 else -1.0 for side in sides(*here, there=True)])
        if straight:
            return Events(values, signs, clear)
        rounding = np.zeros(signs.size)
        if len(self.machine.stages) > 1:
            first = len(goals) + len(self.dynamics.switches(*here[:1], anchor, *here[1:3]))
            rounding[first : first + len(self.machine.stages) - 1] = self._mesh_error(anchor, coming)
        short = residuals(signs, values(np.array([self.t]), self.state[:, None])[:, 0])
        short[: len(goals)] = 0.0  # a goal that is reached is reached
        return Events(values, signs, residuals=short, rounding=rounding)

    def _mesh_error(self, anchor: Anchor, coming: Array) -> Array:
        """The change of the moment through each mesh (N m, on the crank) by an error of speed of one step's tolerance.

        A mesh with a smaller moment has no side: in steady running a wheel behind a mesh takes only these errors.
        """
        assert anchor.omega is not None
        allowed = self.tolerance[0] * abs(anchor.omega) + float(self.tolerance[1][1])
        omega = np.array([anchor.omega, anchor.omega + allowed])
        at, own = np.full(2, anchor.phi), np.repeat(coming[:, None], 2, axis=1)
        passed = self.dynamics.at_many(at, anchor, omega, np.full(2, anchor.time), own).passed[1:]
        return np.array([abs(float(tau[1] - tau[0])) for tau in passed])

    # -- from piece to piece ---------------------------------------------------------------------------------------------

    def _push(self, low: float, high: float) -> float:
        """The acceleration at rest in a piece; only its direction if the machine is held."""
        if self.direction is not None:
            return self.direction
        anchor = Anchor(0.5 * (low + high), float(self.state[1]), self.t)
        return float(self._rates(None, anchor)(self.t, self.state)[1])

    def _leaves(self) -> bool:
        """Tests whether a machine at rest at an end of its stroke is about to leave it."""
        phi, omega = float(self.state[0]), float(self.state[1])
        outwards = {0.0: -1.0, self.cycle: 1.0}.get(phi)
        if outwards is None:
            return False
        if omega == 0.0:
            omega = self._push(*(self.machine.restarts[:2] if phi == 0.0 else self.machine.restarts[-2:]).tolist())
        return omega * outwards > 0.0

    def _piece(self) -> int:
        """The piece that the motion continues in; the angle within the cycle changes over to it."""
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
    """The longest of the other motion's steps between times (s), by their starting times."""
    ends, widths = t[1:].tolist(), (_SHORTER * np.diff(t)).tolist()
    last = len(widths) - 1
    return lambda t: float(widths[min(bisect_right(ends, t), last)])


def end_of_stroke(scene: Scene, phi: float, last: float) -> str:
    """Message on a motion that ended with its stroke; phi is the driver's own coordinate."""
    assert scene.stroke is not None
    return f"the driver reached the stroke's end at {coordinate_text(phi, scene.stroke.sliding)} after {last:.6g} s"
