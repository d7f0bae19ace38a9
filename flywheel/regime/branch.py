"""The branch of steady periodic motions over the inertia of a flywheel: flywheels with and without one.

For one flywheel the search ends in one of three ways, a `MotionSearch`: a motion; the proof that there is none, because the
machine followed in time stops; or neither within the allowed effort. Use one `Branch` for a search over many flywheels: each
motion is found from its nearest neighbour, so that they lie on one branch. Where that or the most direct ways fail the
machine is followed in time, which costs less than the other ways: it stops, or approaches the motion.

Motions of a machine that sets its own speed by laws of angle and speed alone do not cross: the faster one stays faster.
A machine released above every speed of a periodic motion stays above all of them; where it stops, there is none. With a
motor's own states it is released in the neighbouring motion, and if that stops the branch has ended.

Source: R. Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., Springer 2010, chapters 4 (continuation) and 7
(periodic motions and their multipliers); P. Hartman, Ordinary Differential Equations, 2nd ed., SIAM 2002, III.4
(comparison of solutions).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from enum import Enum, auto
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from flywheel.machine.dynamics import ONSET, MachineDynamics, StartState, Trail, dynamics_of
from flywheel.machine.equation import Moments, moments_on
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.budget import BudgetError, counted, limited, portion, spend
from flywheel.numerics.cells import Array
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import periodic_motion, turning_moment
from flywheel.regime.cycle_equations import Demand, NoRegimeError, exponents
from flywheel.regime.free_motion import follow, neighbours, straight
from flywheel.regime.periodic_motion import OwnMotion

COARSE = 1e-4
"""Error of a motion that a search accepts if the allowed effort gives no smaller one."""

_HIGHEST, _STEPS = 64.0, 25  # times a motion's speed: range in which a drive may still drive; speeds tried in it
_TURNS, _RETURNS = 60, 1e-5  # cycles followed; closure, as a share of the speed, of one that has returned
_RTOL = 1e-7  # of steps in time
_WORK = 20_000.0  # walks of a rotor's graph, about a second
_STOP_SPEED = 1e-6  # of the speed at the start: as good as a stop
_INERTIA_VARIATION = 1e-9  # of an inertia: that varies by less is the same at every angle
_SAMPLES = 2_000  # instants of a cycle at which a motion followed in time is taken
_AT_ONCE = 16  # positions within a walk that take as long as the walk itself
_NEAR_SHARE = 0.25  # of a search's budget: share of the attempt from a known motion
_SURE = 0.9  # of a fall of energy: what is certain of one between samples
_STOPS, _RETURNED, _LOST = "stops", "returns", "open"


@contextmanager
def _walks(work: float, each: int = 1) -> Iterator[None]:
    """Limits the number of walks of a rotor's graph; a walk of this graph counts as `each`, many positions as more."""
    solved = 0

    def walked() -> None:
        nonlocal solved
        spend(each * (1.0 + (tally.evaluations - solved) / _AT_ONCE))
        solved = tally.evaluations

    with limited(work), counted(walked) as tally:
        yield


class Existence(Enum):
    """Existence of a periodic motion with a flywheel: known, excluded or open."""

    MOTION = auto()
    NONE = auto()
    UNKNOWN = auto()


class Stop(NamedTuple):
    """Stop of a machine released at a speed: `phi` (rad) in the cycle, and the moment missing there (N m, crank).

    `speed` (rad/s) is that from which it was followed, `turns` the number of cycles before.
    """

    phi: float
    shortfall: float
    speed: float
    turns: int


class UnstableError(NoRegimeError):
    """The only known motion is unstable."""

    def __init__(self, motion: OwnMotion) -> None:
        super().__init__(f"an unstable motion: a disturbance grows {motion.solved.multiplier:.6g}-fold in a cycle")
        self.motion = motion


class OutOfStepError(NoRegimeError):
    """A synchronous motor that settles out of step: its rotor falls back by whole pole pairs in each cycle."""


class MotionSearch(NamedTuple):
    """Result of a search for the steady periodic motion with a flywheel (kg m² on the crank).

    `motion` is the motion if there is one; `stop` shows that there is none. With neither it is unknown, and `error` is
    the outcome of the search: that of the iteration, or the effort spent.
    """

    inertia: float
    motion: OwnMotion | None = None
    stop: Stop | None = None
    error: NoRegimeError | BudgetError | None = None

    @property
    def reason(self) -> str:
        """The outcome of a search that found no motion, in words."""
        return "" if self.error is None else str(self.error)

    @property
    def existence(self) -> Existence:
        """The existence of a motion: there is one, there is none, or neither is known."""
        if self.motion is not None:
            return Existence.MOTION
        return Existence.UNKNOWN if self.stop is None else Existence.NONE


class Branch:
    """The steady periodic motions of one machine over the inertia of its flywheel.

    Args:
        machine: the machine.
        speed: of the crank, rad/s, near that of its motions.
        unknown: a first guess of the scene's unknown (SI).
        mean: mean of extremes (rad/s) that a balance holds; None if the machine sets its own speed.

    """

    def __init__(self, machine: Machine, speed: float, unknown: float = 0.0, mean: float | None = None) -> None:
        self.machine, self.speed, self.unknown, self.mean = machine, speed, unknown, mean
        self.motions: dict[float, OwnMotion] = {}
        self.others: dict[float, Callable[[], OwnMotion]] = {}  # motions that are taken up when they are the nearest

    def at(self, inertia: float, rtol: float, near: OwnMotion | None = None) -> MotionSearch:
        """The finding with one flywheel (kg m² on the crank), at a relative error of rtol in the irregularity.

        `near` is the motion to begin with; by default the nearest known one.
        """
        near = self.nearest(inertia) if near is None else near
        # A motion from a neighbour, or by the most direct methods: both fail quickly.
        machine, demand = self.machine, Demand(inertia, None, self.mean)
        search = partial(periodic_motion.own_motion, machine, self.speed, demand, 0.0, self.unknown, rtol, directly=True)
        if near is not None:
            near_it = partial(periodic_motion.own_motion_near, machine, near, inertia, self.mean, rtol)
            search = partial(near_it, beyond=self.beside(near, inertia), intermediate=rtol >= COARSE)
        finding = self._stable(inertia, search)
        if finding.motion is None and self.mean is None and self.machine.scene.unknown is None:
            followed = self._followed(inertia, near)
            if isinstance(followed, Stop):
                return finding._replace(stop=followed)
            if followed is not None:
                later = self._stable(inertia, partial(self._along, inertia, rtol, *followed))
                finding = later if later.motion is not None or isinstance(later.error, OutOfStepError) else finding
        if finding.motion is None:
            searched = self._searched(inertia, rtol)
            finding = finding if searched.motion is None and isinstance(finding.error, OutOfStepError) else searched
        if finding.motion is not None:
            self.motions[inertia] = finding.motion
        return finding

    def sized(self, irregularity: float, lighter: float, inertia: float, rtol: float) -> OwnMotion | None:
        """The motion with an irregularity, at a relative error of rtol in its flywheel; None without one.

        It is searched for from the one nearest to an inertia, along the secant to that with a lighter flywheel.
        """
        if (near := self.nearest(inertia)) is None:
            return None
        demand = Demand(None, irregularity, self.mean)
        search = partial(periodic_motion.own_motion, self.machine, near.speed, demand, inertia, self.unknown, rtol)
        return self._stable(inertia, partial(search, near=near, beyond=self.beside(near, lighter))).motion

    def _searched(self, inertia: float, rtol: float) -> MotionSearch:
        """A motion by every method, as coarsely as the effort requires."""
        finding, demand = MotionSearch(inertia), Demand(inertia, None, self.mean)
        for error in dict.fromkeys((rtol, max(rtol, COARSE))):
            search = partial(periodic_motion.own_motion, self.machine, self.speed, demand, 0.0, self.unknown, error)
            finding = self._stable(inertia, search)
            if not isinstance(finding.error, BudgetError):
                break
        return finding

    def _stable(self, inertia: float, search: Callable[[], OwnMotion]) -> MotionSearch:
        """The result of a search within the allowed effort: only a stable motion counts."""
        try:
            with limited(periodic_motion.MOST_WORK):
                motion = search()
        except (NoRegimeError, BudgetError) as error:
            return MotionSearch(inertia, error=error)
        if self.mean is None and motion.solved.damping < -periodic_motion.UNSTABLE:
            return MotionSearch(inertia, error=UnstableError(motion))
        return MotionSearch(inertia, motion)

    def _along(self, inertia: float, rtol: float, trail: Trail, start: float) -> OwnMotion:
        """The motion reached by one followed in time, at the time `start` (s) of its last cycle.

        Raises:
            OutOfStepError: if a synchronous motor is out of step. In step its load angle returns: p (w_s T - phi_s), by
                which it grows in a cycle of T s and phi_s rad of its shaft, is 0; else a whole number of turns.

        """
        scene, period = self.machine.scene, float(trail.t[-1]) - start
        motor: Any = scene.motor
        if motor is not None and motor.keeps_step and scene.drive is not None:
            turned = scene.shafts[scene.drive.on] * scene.cycle
            slip = motor.pole_pairs * (motor.synchronous_speed * period - turned) / (2.0 * math.pi)
            if abs(slip) > 0.5:
                mean, own = turned / period, motor.synchronous_speed
                speeds = f"a mean of {mean:.6g} rad/s at its shaft for its synchronous {own:.6g} rad/s"
                raise OutOfStepError(f"{speeds}, as its load angle changes by {360 * slip:.4g} deg in each cycle")
        times = np.linspace(start, float(trail.t[-1]), _SAMPLES)
        rows = trail.states(times)
        cycle = self.machine.scene.cycle
        return periodic_motion.own_motion_along(
            self.machine,
            Demand(inertia, None, self.mean),
            rows[0] - rows[0, 0] + rows[0, 0] % cycle,
            rows[1],
            rows[3:],
            rtol,
        )

    def _followed(self, inertia: float, near: OwnMotion | None) -> Stop | tuple[Trail, float] | None:
        """The machine released above all its motions, or in the nearest one: the place of its stop, or its return.

        None if neither occurs within the allowed effort.
        """
        dynamics, machine = dynamics_of(self.machine, inertia, self.unknown), self.machine
        moments = moments_on(machine, machine.mesh, local=True)
        total = inertia + moments.inertia
        if not total.max() > 0.0:
            # The place where a machine without inertia lacks torque at every speed; None without one, or with more states.
            if moments.circuit is not None:
                return None
            speeds = np.concatenate(([0.0], self.speed * np.geomspace(_STOP_SPEED, _HIGHEST, 4 * _STEPS)))
            shape = moments.mesh.phi.shape
            best = np.max([moments.rate(np.full(shape, w), self.unknown, 0.0).moment for w in speeds.tolist()], axis=0)
            if not best.min() < 0.0:
                return None
            return Stop(float(moments.mesh.phi.ravel()[best.argmin()]), -float(best.min()), self.speed, 0)
        if not total.min() > 0.0:
            return None
        speed, phi, states = self.speed, 0.0, tuple(float(each) for each in moments.steady_states(self.speed))
        if moments.circuit is None:
            highest, gained = self._highest(moments, inertia)
            if highest is None:
                return None
            heaviest = float(moments.mesh.phi.ravel()[total.argmax()])  # none is faster there, by its energy
            phi = 0.0 if total.max() <= (1.0 + _INERTIA_VARIATION) * total.flat[0] else heaviest
            speed = math.sqrt(highest**2 + 2.0 * gained / float(total.max()))
        elif near is not None:
            edges = near.solved.state.edges[0]
            speed = float(turning_moment.speed_over_cycle(near.cycle, near.speed, near.run, np.zeros(1))[0])
            states = tuple(edges[1:].tolist())
        passes: list[tuple[float, float]] = []

        def passing(t: float, omega: float) -> str | None:
            passes.append((t, omega))
            if len(passes) > 2 and abs(omega / passes[-2][1] - 1.0) <= _RETURNS:
                return _RETURNED
            return _LOST if len(passes) >= _TURNS else None

        goals = (straight(_STOPS, 1, -_STOP_SPEED * speed, 1.0),)
        try:
            with _walks(_WORK):
                until = 100.0 * _TURNS * machine.scene.cycle / self.speed
                trail = follow(dynamics, StartState(phi, speed, states), until, _RTOL, goals, passing)
        except SceneError:
            return None
        if trail.goal == _STOPS or trail.stuck is not None:
            return self._stop(dynamics, trail, speed)
        return (trail, passes[-2][0]) if trail.goal == _RETURNED else None

    def _stop(self, dynamics: MachineDynamics, trail: Trail, speed: float) -> Stop:
        """The place where a motion followed in time has stopped, and the torque it lacks there."""
        state = trail.ends()[:, -1]
        phi = float(state[0]) % self.machine.scene.cycle
        ahead, _ = neighbours(self.machine, phi)
        moment = float(dynamics.at(phi, ahead, ONSET * speed, float(trail.t[-1]), states=tuple(state[3:].tolist())).moment)
        return Stop(phi, max(-moment, 0.0), speed, trail.cycles)

    def _highest(self, moments: Moments, inertia: float) -> tuple[float | None, float]:
        """A crank speed (rad/s) below which every motion falls within a cycle, and the work (J) that it may gain above it.

        With m(phi) the greatest moment at an angle at that speed or any higher one, the integral of m over a cycle is
        negative: no periodic motion stays above. One that rises from there gains no more than the integral of m where m is
        positive. None and 0 if there is no such speed.
        """
        speeds, shape = self.speed * np.geomspace(1.0, _HIGHEST, _STEPS), moments.mesh.phi.shape
        each = np.array([moments.rate(np.full(shape, w), self.unknown, inertia).moment for w in speeds.tolist()])
        greatest = np.maximum.accumulate(each[::-1])[::-1]
        works = cells.integral(np.stack((greatest, np.maximum(greatest, 0.0))), moments.mesh.half).sum(axis=-1)
        below = np.flatnonzero(works[0] < 0.0)
        return (float(speeds[below[0]]), float(works[1, below[0]])) if below.size else (None, 0.0)

    def distance(self, inertia: float, other: float) -> float:
        """The distance of two flywheels (kg m²): the logarithm of their ratio, both with the machine's own inertia."""
        own = float(next(iter(self.motions.values())).solved.moments.inertia.max())
        own = max(own, 1e-9 * max(self.motions), 1e-300)
        return abs(math.log((other + own) / (inertia + own)))

    def nearest(self, inertia: float) -> OwnMotion | None:
        """The known motion whose flywheel is nearest to an inertia."""
        if not self.motions:
            return None
        best = min({**self.motions, **self.others}, key=partial(self.distance, inertia))
        if best not in self.motions:
            finding = self._stable(best, self.others.pop(best))
            if finding.motion is None:
                return self.nearest(inertia)
            self.motions[best] = finding.motion
        return self.motions[best]

    def beside(self, near: OwnMotion, inertia: float) -> OwnMotion | None:
        """The known motion next to the nearest one to an inertia."""
        others = [each for each, motion in self.motions.items() if motion is not near and not motion.vanishing]
        return self.motions[min(others, key=partial(self.distance, inertia))] if others else None


def stable_motion(
    machine: Machine, other: OwnMotion | None, reference: float, demand: Demand, unknown: float, rtol: float
) -> OwnMotion:
    """The steady motion with a given flywheel: from a stable one with another flywheel, else from nothing.

    Args:
        machine: the machine.
        other: the motion to begin with, if one is known.
        reference: speed (rad/s) near that of the motion; the required one if there is one.
        demand: requirements of the motion.
        unknown: a first guess of the scene's unknown.
        rtol: relative error allowed in the irregularity.

    Raises:
        NoRegimeError: if there is no such motion, or none that can be resolved.

    """
    if other is not None:
        with suppress(NoRegimeError, BudgetError), portion(_NEAR_SHARE):
            motion = periodic_motion.own_motion_near(machine, other, demand.inertia, demand.speed, rtol)
            if machine.scene.unknown is not None or motion.solved.damping >= -periodic_motion.UNSTABLE:
                return motion
    return periodic_motion.own_motion(machine, reference, demand, 0.0, unknown, rtol)


def resonates(machine: Machine, reference: float, inertias: Sequence[float], unknown: float) -> bool:
    """Tests whether with any of some flywheels a motor's states and the speed swing so that a load may resonate.

    Args:
        machine: the machine.
        reference: speed (rad/s) near that of its motions.
        inertias: of the flywheels, kg m² on the crank.
        unknown: a value of the scene's unknown.

    """
    moments = moments_on(machine, machine.mesh)
    if not min(inertias) + float(moments.inertia.min()) > 0.0:
        return True
    swings = exponents(moments, reference, inertias, unknown)
    return bool((np.abs(swings.imag) > np.abs(swings.real)).any())


def stopped_flywheel(moments: Array, speeds: Array, widths: Array, inertia: Array) -> Any:
    """The flywheel (kg m² on the crank) with which, as with any lighter one, a machine certainly stops within the cycle.

    With m the greatest F at an angle, and n that at speeds from w up: if n does net work below zero over a cycle, a periodic
    motion is slower than w somewhere, and from there gains no more than G, the work of n where it is positive. Its energy is
    at most ½ (J + I*) w² + G, and from one angle to another it gains no more than the work of m. If that falls by D, then

        J < 2 (D - G)/w² - I*        (I* the greatest)

    leaves too little energy. Losses in meshes only take, and may be left out of F.

    Args:
        moments: F at some speeds (N m), (speeds, ..., cells, nodes).
        speeds: ascending, from far below to far above those of the machine, with its motor's characteristic ones, rad/s,
            (speeds, ...).
        widths: of the nodes in an integral over the cycle, rad, (..., cells, nodes).
        inertia: I* (kg m²), (..., cells, nodes).

    Returns:
        The inertia, by `_SURE` of D - G, as F is sampled; minus infinity where nothing is certain. With a load of 50 N m
        over half a turn, and a drive of 30 N m below 2 rad/s, the machine lacks 20 N m over half a turn:

    >>> widths, load, drive = np.full((1, 4), 0.5 * np.pi), np.array([-50.0, -50.0, 0.0, 0.0]), np.array([30.0, 30.0, 0.0])
    >>> round(float(stopped_flywheel(load + drive[:, None, None], np.array([0.1, 1.0, 2.0]), widths, 0.0 * widths)), 3)
    28.274
    >>> round(0.9 * 2.0 * 20.0 * np.pi / 2.0**2, 3)
    28.274

    """
    *lead, cells_of, nodes = inertia.shape
    above = np.maximum.accumulate(moments[::-1], axis=0)[::-1]
    works = above * widths
    row = (works.sum(axis=(-2, -1)) < 0.0).argmax(axis=0)[None]
    beside = row[..., None, None]
    work, w = np.take_along_axis(works, beside, 0)[0], np.take_along_axis(speeds, row, 0)[0]
    gained = np.maximum(work, 0.0).sum(axis=(-2, -1))
    course = np.tile(works[0].reshape(*lead, cells_of * nodes), 2).cumsum(axis=-1)
    fall = (np.maximum.accumulate(course, axis=-1) - course).max(axis=-1)
    least = _SURE * 2.0 * (fall - gained) / w**2 - inertia.max(axis=(-2, -1))
    return np.where(np.isfinite(least) & (work.sum(axis=(-2, -1)) < 0.0), least, -np.inf)


# -- what becomes of a machine without a steady motion --------------------------------------------------------------------

_CYCLES = 20
_FASTER = 10.0  # times the speed at the start: a machine that gets there runs away
_RTOL_OF_ENDING = 1e-6
_HURRIED = 12_000.0  # walks of a rotor's graph: limit for a message
_ELEMENTS = 8  # of a graph that take as long to walk as a rotor's


class Outcome(Enum):
    """Outcome of a motion."""

    STALLS = "stalls"
    RUNS_AWAY = "runs away"
    UNKNOWN = "goes on"


class Ending(NamedTuple):
    """Outcome and place of a motion's end: `machine stalls at crank angle 83.2 deg after 1.2 s`.

    `fault` is the reason why it could not be followed, if known.
    """

    outcome: Outcome
    where: str = ""
    fault: Fault | None = None


def outcome_of(machine: Machine, speed: float, inertia: float, balance: float, *, hurried: bool = False) -> Ending:
    """The outcome of a machine released at phi = 0, followed in time to check the result of the search.

    Args:
        machine: the machine.
        speed: of the crank at the start, rad/s.
        inertia: of the flywheel, kg m² on the crank.
        balance: value (SI) of the scene's unknown.
        hurried: True if the machine has already had a large share of the effort.

    """
    cycle = machine.scene.cycle

    passed = 0

    def passing(t: float, omega: float) -> str | None:
        nonlocal passed
        passed += 1
        return Outcome.UNKNOWN.value if passed >= _CYCLES else None

    goals = (straight(Outcome.STALLS.value, 1, 0.0, 1.0), straight(Outcome.RUNS_AWAY.value, 1, _FASTER * speed, -1.0))
    dynamics, until = dynamics_of(machine, inertia, balance), 100 * _CYCLES * cycle / speed
    states = () if dynamics.circuit is None else dynamics.circuit.steady(dynamics.ratio * speed)
    each = 1 + len(machine.kinematics.graph.elements) // _ELEMENTS
    try:
        with _walks(_HURRIED if hurried else _WORK, each):
            trail = follow(dynamics, StartState(0.0, speed, states), until, _RTOL_OF_ENDING, goals, passing)
    except BudgetError:
        return Ending(Outcome.UNKNOWN)
    except SceneError as error:
        return Ending(Outcome.UNKNOWN, fault=error.faults[0])
    outcome = Outcome(trail.goal) if trail.goal is not None else Outcome.STALLS if trail.stuck else Outcome.UNKNOWN
    phi = float(trail.ends()[0, -1])
    return Ending(outcome, f"at {machine.where(phi % cycle)} after {float(trail.t[-1]):.4g} s")
