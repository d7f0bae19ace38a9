"""The motion of a machine stroke by stroke: clutch, work, brake, standstill, and the periodic one among such strokes.

While the clutch slips, its torque depends on neither speed. So the driving side and the driven side are two machines of one
freedom each, which share only that torque, until their speeds are equal; from there to the release of the clutch they
are one machine. Each is followed by `free_motion.follow`, phase by phase (`Strokes.stroke`). A stroke passes two figures to
the next one: the speed of the driving side where it begins, and the angle at which the crank stands. `periodic` solves for
those that repeat, by Newton's method.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bondgraph.motion.stepping import Step
from bondgraph.numerics import root
from flywheel.machine.dynamics import NODES, MachineDynamics, MotionStretch, StartState, Trail
from flywheel.machine.machine import Anchor, Machine
from flywheel.numerics.cells import Array, Index
from flywheel.numerics.expressions import Expression, parse
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime.free_motion import Goal, follow, neighbours, straight
from flywheel.scene.scene import TURN, Brake, Load, Scene

_RPM = 30.0 / math.pi
_SLOWEST, _FASTEST, _LOOKED_AT = 1e-3, 1e5, 400  # rad/s, and speeds between them where the torque is looked at
_BELOW_IDLE = 1.0 - 1e-9  # of the idling speed, at which no torque tells which way a mesh passes power
_HALVINGS = 6  # of a step of Newton's method whose stroke fails
_LONGEST, _LONGEST_SLIP = 200.0, 10.0  # turns at the typical speed: how long a phase, and a slip, is followed at the most
_AT_REST = 1e-6  # of the typical speed: a crank slower than that does not move
_FARTHEST_BACK = math.pi  # a crank that falls back by this before the clutch takes it along is lost
_MOST_STEPS = 25  # of Newton's method
_MOST_LEGS, _MOST_MACHINES, _MOST_PARTS = 200, 20, 40  # of a stroke; that are kept
_AFTER_LOCK = 10.0  # tolerances of a step: by which the speeds of a clutch that slips again are apart the other way
_RECOVERING = 1e3  # times the stroke: how long a recovery is followed at the most
_IDLING, _EVEN = 1e-7, 1e-3  # of the idling speed: where a recovery is its exponential; by which its rate may yet change
_REGAINED = 0.999, 0.98, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5  # of the idling speed: from which a rate is tried that is kept
_PLAIN = 2  # strokes one after the other, before the first of them
_DIFFERENCE, _TURN_STEP = 1e-4, 1e-3  # steps of the derivative of a whole stroke: relative; of the resting angle, rad
_ASTRAY = 1e-2  # of a limit: beyond it by more, a step to a flywheel that is lighter is none
_PROGRESS, _PATIENCE = 0.5, 4  # of the least that was left; steps without it after which no stroke returns
_SLOW = 0.3  # of the step before: what is left by slopes that serve no longer
_ENOUGH = 30.0  # tolerances of a step: what a stroke that returns may be off
NEAR_STOP = math.radians(10.0)  # from stop_at: where a crank may stop without a remark
_SLIPS = {"slip": 1, "overrun": -1}  # how a locked clutch begins to slip: the driving side then is faster, or slower
NAME, BRAKE = "clutch", "brake[0]"  # paths of the clutch's torque and of the brake's as loads


class Ramp(NamedTuple):
    """A torque (N m) that builds up evenly, or `falls`, from a time (s) on and for a time (s)."""

    torque: float
    begin: float
    lasting: float
    falls: bool = False


class Leg(NamedTuple):
    """A part of a stroke in which the clutch slips, or locks both sides together.

    `sense` is 1 while the driving side turns faster, -1 while it turns slower, and 0 while the clutch is locked: both
    motions are then that of the whole machine at the crank. Their times count from `clock` (s after the engagement), as
    those of `torque`, which the clutch passes while it slips.
    """

    clock: float
    driving: Trail
    driven: Trail
    sense: int
    torque: Ramp

    @property
    def begin(self) -> float:
        """The time at which it begins, s after the engagement."""
        return self.clock + self.driven.start.time

    @property
    def end(self) -> float:
        """The time at which it ends, s after the engagement."""
        return self.clock + float(self.driven.t[-1])


class Acting(NamedTuple):
    """Torques on both sides during a leg, and its end: goals, or at the latest a time (s) on its clock."""

    sense: int
    clutch: Ramp
    brake: Ramp | None
    goals: list[Goal]
    last: float


class Phases(NamedTuple):
    """The motions of one stroke, each on its own clock; times (s) count from the engagement of the clutch.

    `legs` are those until the clutch has opened, at `release_time`; they begin with a slip. From there `recovery` is that of
    the driving side, on the clutch's shaft, and the driven side is `coasting` until the brake acts (None if it acts
    already), then `braking` until it stands still, with its clock at `brake_time`. `resting` is M* where the crank then
    stands (N m). `slopes` are the derivatives of speed and angle after a stroke by those before it.
    """

    legs: tuple[Leg, ...]
    coasting: Trail | None
    braking: Trail
    recovery: Trail
    release_time: float
    brake_time: float
    stop_time: float
    period: float
    resting: float
    slopes: Array | None = None

    @property
    def begin(self) -> tuple[float, float]:
        """Speed of the clutch's shaft (rad/s) and resting angle of the crank (rad) where the stroke begins."""
        return self.legs[0].driving.start.omega, self.legs[0].driven.start.phi

    @property
    def lock_time(self) -> float:
        """The time at which the clutch first locks."""
        return self.legs[0].end

    @property
    def lock_angle(self) -> float:
        """The crank angle at which the clutch locks for the first time, rad; not reduced to a turn."""
        return _last(self.legs[0].driven)[0]

    @property
    def slips(self) -> tuple[Leg, ...]:
        """The slips of the clutch under the work, after it has locked and before it is released."""
        return tuple(leg for leg in self.legs[1:] if leg.sense and not leg.torque.falls)

    @property
    def rest(self) -> float:
        """The crank angle at which the crank comes to rest, rad; not reduced to a turn."""
        return _last(self.braking)[0]

    @property
    def speed(self) -> float:
        """Speed of the clutch's shaft at the end of the period, rad/s."""
        return _last(self.recovery)[1]


def _last(trail: Trail) -> tuple[float, float]:
    """Position and speed at a motion's end."""
    if not trail.stretches:
        return trail.start.phi, trail.start.omega
    step, offset, _ = trail.stretches[-1]
    return float(step.last[0]) + offset, float(step.last[1])


class Idling(NamedTuple):
    """The states at times (s) of a side whose speed tends to that of idling (rad/s), by `rate` (1/s); `state` at `start`."""

    state: Sequence[float]
    start: float
    idle: float
    rate: float
    inertia: float

    def __call__(self, t: Any) -> Array:
        """Position, speed, and the moment's work, J."""
        (phi, omega, work), since = self.state, np.asarray(t) - self.start
        grown = -np.expm1(-self.rate * since)
        speed = omega + (self.idle - omega) * grown
        turn = self.idle * since - (self.idle - omega) * grown / self.rate
        return np.array([phi + turn, speed, work + 0.5 * self.inertia * (speed**2 - omega**2)])


class Strokes:
    """A machine that works stroke by stroke, with a flywheel (kg m² at its own shaft), at a relative tolerance of a step.

    Parts in common with a `like` one are used again. Raises SceneError if the scene cannot be followed in this way.
    """

    def __init__(self, scene: Scene, inertia: float, rtol: float, like: Strokes | None = None) -> None:
        if scene.single_stroke is None:
            raise SceneError([Fault("single_stroke", "nothing", "a table with rate or idle")])
        check(scene)
        self.scene, self.inertia, self.rtol, self.plan = scene, inertia, rtol, scene.single_stroke
        self.clutch, self.brake = self.plan.clutch, self.plan.brake
        self.ratio = scene.shafts[self.clutch.on]
        self.wheel = scene.shafts[scene.flywheel_on] / self.ratio  # of the flywheel's speed over the clutch's shaft's
        self.end = self._coming(self.clutch.disengage)
        self.brakes_at = self._coming(self.brake.engage)
        self._machines: dict[tuple[int, Ramp, Ramp | None], tuple[MachineDynamics, MachineDynamics]] = {}
        self._parts: list[MachineDynamics] = [] if like is None else like._parts

    def _coming(self, angle: float) -> float:
        """A crank angle (rad) in the last turn of a stroke that begins at `stop_at`."""
        first = (angle - self.plan.stop_at) % TURN or TURN
        return self.plan.stop_at + first + (self.plan.continuous - 1) * TURN

    # -- the machines ----------------------------------------------------------------------------------------------------

    @cached_property
    def whole(self) -> MachineDynamics:
        """The machine with its clutch locked and its brake off."""
        return self._part(replace(self.scene, single_stroke=None), self.inertia * self.scene.flywheel_ratio**2)

    def _part(self, scene: Scene, inertia: float) -> MachineDynamics:
        """The machine of a scene with a flywheel (kg m² at its crank), or the existing one."""
        machine = None
        for part in self._parts:
            if part.machine.scene == scene:
                machine = part.machine
                if part.inertia == inertia:
                    return part
        del self._parts[:-_MOST_PARTS]
        self._parts.append(MachineDynamics(machine or Machine(scene), inertia))
        return self._parts[-1]

    @cached_property
    def driving(self) -> MachineDynamics:
        """The driving side alone, reduced to the shaft of the clutch."""
        return self._driving(None)

    @cached_property
    def driven(self) -> MachineDynamics:
        """The driven side alone, its brake off."""
        return self._driven()

    @cached_property
    def braked(self) -> MachineDynamics:
        """The driven side with its brake, which is applied at t = 0."""
        return self._driven([self._braking(Ramp(self.brake.torque, 0.0, self.brake.rise))])

    def _braking(self, brake: Ramp) -> Load:
        """The brake as a load: one that falls may hold the crank at rest, one that builds up acts until the crank rests."""
        law = f"-{ramp(brake)}"
        if brake.falls:  # the mean of the torques of both directions, by the sign of the motion, and half their difference
            share = self.brake.reverse_torque / self.brake.torque
            law += f"*({0.5 + 0.5 * share!r}*sign(omega) + {0.5 - 0.5 * share!r})" if share != 1.0 else "*sign(omega)"
        return _load(self.brake.on, law, BRAKE)

    def _engaged(self, sense: int, clutch: Ramp, brake: Ramp | None) -> tuple[MachineDynamics, MachineDynamics]:
        """Both sides with the slipping clutch (sense 1 or -1) and a brake that acts; while it is locked twice the whole."""
        key = sense, clutch if sense else Ramp(0.0, 0.0, 0.0), brake
        if key not in self._machines:
            if len(self._machines) > _MOST_MACHINES:  # a brake that builds up while the clutch lets go has a time of its own
                self._machines.clear()
            loads = [] if brake is None else [self._braking(brake)]
            if sense:
                law, back = (ramp(clutch), f"-{ramp(clutch)}")[::sense]
                driven = self._driven([_load(self.clutch.on, law, NAME), *loads])
                self._machines[key] = self._driving(back), driven
            else:
                scene = replace(self.scene, single_stroke=None, loads=(*self.scene.loads, *loads))
                whole = self._part(scene, self.whole.inertia)
                self._machines[key] = whole, whole
        return self._machines[key]

    def _driving(self, law: str | None) -> MachineDynamics:
        scene, on = self.scene, self.clutch.on
        mine = beyond(scene, on)
        names = {name: "crank" if name == on else name for name in mine}
        transmissions = {name: scene.transmissions[name] for name in mine if name != on}
        loads = [load._replace(on=names[load.on], every=TURN) for load in scene.loads if load.on in mine]
        side = replace(
            scene,
            single_stroke=None,
            speed=None,
            shafts={names[name]: scene.shafts[name] / self.ratio for name in mine},
            transmissions={name: one._replace(on=names[one.on]) for name, one in transmissions.items()},
            mechanisms=(),
            gravity=None,
            inertias=tuple(each._replace(on=names[each.on]) for each in scene.inertias if each.on in mine),
            loads=(*loads, *([] if law is None else [_load("crank", law, NAME)])),
            springs=(),
            dampers=tuple(each._replace(on=names[each.on]) for each in scene.dampers if each.on in mine),
            drive=scene.drive and scene.drive._replace(on=names[scene.drive.on], every=TURN),
            flywheel_on=names[scene.flywheel_on],
        )
        return self._part(side, self.inertia * self.wheel**2)

    def _driven(self, loads: Sequence[Load] = ()) -> MachineDynamics:
        scene, on = self.scene, self.clutch.on
        theirs = set(beyond(scene, on)) - ({on} if any(load.on == on for load in loads) else set())
        side = replace(
            scene,
            single_stroke=None,
            speed=self.typical,
            shafts={name: ratio for name, ratio in scene.shafts.items() if name not in theirs},
            transmissions={name: one for name, one in scene.transmissions.items() if name not in theirs},
            inertias=tuple(each for each in scene.inertias if each.on not in (*theirs, on)),
            loads=(*(load for load in scene.loads if load.on not in (*theirs, on)), *loads),
            dampers=tuple(each for each in scene.dampers if each.on not in (*theirs, on)),
            drive=None,
            motor=None,
            flywheel_on="crank",
            irregularity=None,
            inertia=None,
        )
        return self._part(side, 0.0)

    # -- one stroke ------------------------------------------------------------------------------------------------------

    @cached_property
    def typical(self) -> float:
        """The speed (rad/s) of the crank at which the driving side idles: the highest to which its torques return it."""
        speeds, still = np.geomspace(_SLOWEST, _FASTEST, _LOOKED_AT), np.zeros(_LOOKED_AT)

        def moment(omega: float) -> float:
            return float(self.driving.at(math.pi, math.pi, omega, 0.0).moment)

        moments = self.driving.surplus(still + math.pi, Anchor(math.pi, None, None), speeds, still, still)
        falls = np.flatnonzero((moments[:-1] > 0.0) & (moments[1:] <= 0.0))
        if not falls.size:
            defect = "a torque that is 0 at no speed, or does not fall there"
            advice = "a motor, or an expression that falls with omega"
            raise SceneError([Fault("drive", defect, "one that brings the wheel to a speed", advice)])
        k = int(falls[-1])
        return root(moment, float(speeds[k]), float(speeds[k + 1])) / self.ratio

    def _run(
        self, dynamics: MachineDynamics, start: StartState, goals: Iterable[Goal] = (), until: float | None = None
    ) -> Trail:
        """A phase, until a goal or a time (s)."""
        longest = start.time + _LONGEST * TURN / self.typical if until is None else until
        return follow(dynamics, start, longest, self.rtol, [*goals])

    def stroke(self, speed: float, rest: float, *, regains: bool = False) -> Phases:
        """One stroke, from a speed (rad/s) of the clutch's shaft and an angle (rad) at which the crank stands.

        With `regains` the clutch engages again when the driving side has regained its speed, not at the scene's rate. Raises
        SceneError for a clutch that does not lock, a crank or machine that stalls, a brake that does not stop or hold it.
        """
        legs, brake_time = self.engaged(speed, rest)
        stopping = self._stop(self._ends(legs[-1])[1], legs[-1].end, brake_time)
        return self._recovered(legs, stopping, speed if regains else None)

    def renewed(self, phases: Phases) -> Phases:
        """The stroke for another rate or `idle`, from this one: only the recovery differs."""
        stopping = phases.coasting, phases.braking, phases.brake_time, phases.resting
        return self._recovered(phases.legs, stopping, None)

    def _recovered(
        self, legs: tuple[Leg, ...], stopping: tuple[Trail | None, Trail, float, float], regained: float | None
    ) -> Phases:
        """A stroke with its recovery: over the rest of the period, or until a speed (rad/s) is regained."""
        coasting, braking, brake_time, resting = stopping
        release_time, stop_time = legs[-1].end, brake_time + float(braking.t[-1])
        start, goals = StartState(0.0, self._ends(legs[-1])[0]), [straight("stop", 1, 0.0, 1.0)]
        if regained is None:
            lasting = self.plan.continuous / self.plan.rate if self.plan.rate else stop_time + (self.plan.idle or 0.0)
        else:
            lasting = math.inf if start.omega < regained else release_time
        if lasting <= release_time:
            raise self.too_fast(stop_time, lasting)
        if regained is not None:
            goals.append(straight("speed", 1, regained, -1.0))
            lasting = _RECOVERING * stop_time
        elif (near := self._near_idling(start.omega)) is not None:
            goals.append(near)
        recovery = self._run(self.driving, start, goals, lasting - release_time)
        if recovery.goal == "idle":
            # to the end in one step, however long that is
            step, offset, anchor = recovery.stretches[-1]
            state, idle = tuple(map(float, step.last)), self.typical * self.ratio
            rate = self._acceleration(state[1]) / (idle - state[1])
            inertia = self.driving.at(math.pi, math.pi, idle, 0.0).inertia
            idling = Step(Idling(state, step.end, idle, rate, float(inertia)), step.end, lasting - release_time)
            rest = MotionStretch(idling, offset, anchor)
            recovery = recovery._replace(stretches=(*recovery.stretches, rest), goal=None)
        if regained is not None and recovery.goal != "speed":
            defect = f"a driving side that does not come back to {regained * _RPM:.5g} rpm"
            raise SceneError([Fault("drive", defect, "a motor that does", "a stronger motor")])
        if regained is not None:
            lasting = release_time + float(recovery.t[-1])
        elif recovery.goal is not None or recovery.stuck is not None:
            defect = f"a driving side that comes to rest {release_time + recovery.t[-1]:.4g} s after the clutch engaged"
            expected = "a motor that brings the flywheel back to its speed"
            raise SceneError([Fault("drive", defect, expected, "a stronger motor")])
        return Phases(legs, coasting, braking, recovery, release_time, brake_time, stop_time, lasting, resting)

    def too_fast(self, stop_time: float, lasting: float) -> SceneError:
        """The fault of a stroke that is not at its end (s) after a period (s)."""
        defect = f"a stroke that lasts {stop_time:.4g} s from engagement to standstill, every {lasting:.4g} s"
        advice = f"fewer than {self.plan.continuous / stop_time * 60:.4g} strokes a minute, or a faster drive"
        return SceneError([Fault("single_stroke.rate", defect, "a stroke that ends before the next begins", advice)])

    def _near_idling(self, omega: float) -> Goal | None:
        """The goal of a speed so near that of idling that its rest decays; None where the moment is not linear there."""
        idle = self.typical * self.ratio
        gap = math.copysign(_IDLING * idle, idle - omega)
        near, nearer = (self._acceleration(idle - share * gap) / (share * gap) for share in (1.0, 0.5))
        if abs(idle - omega) <= abs(gap) or not abs(nearer - near) <= _EVEN * near:
            return None
        sense = math.copysign(1.0, gap)
        return straight("idle", 1, sense * (idle - gap), -sense)

    def _acceleration(self, omega: float) -> float:
        return float(self.driving.at(math.pi, math.pi, omega, 0.0).acceleration)

    def engaged(self, speed: float, rest: float, touch: float | None = None) -> tuple[tuple[Leg, ...], float | None]:
        """The legs of a stroke until the clutch has opened, and the time (s) of the brake if it is applied before.

        The clutch is released at its angle, or after a touch (s). It locks where both sides have one speed, and slips where
        the passed torque would exceed its own.
        """
        legs, clock, now, brake_time = list[Leg](), 0.0, 0.0, None
        clutch = Ramp(self.clutch.torque, 0.0, self.clutch.rise)
        brake = Ramp(self.brake.torque, 0.0, self.brake.fall, True) if self.brake.fall > 0.0 else None
        side, crank, sense = speed, (rest, 0.0), 1
        while True:
            if brake is not None and brake.falls and now >= brake.lasting:
                brake = None
            last = clutch.begin + clutch.lasting if clutch.falls else math.inf if touch is None else touch
            goals = [straight("release", 0, self.end, -1.0)] * (not clutch.falls and touch is None)
            goals += [straight("brake", 0, self.brakes_at, -1.0)] * (clutch.falls and touch is None and brake_time is None)
            begin, fresh = StartState(*crank, (), now), bool(legs) and legs[-1].sense == 0
            sides, acting = self._engaged(sense, clutch, brake), Acting(sense, clutch, brake, goals, last)
            if sense:
                leg = Leg(clock, *self._slip(sides, StartState(0.0, side, (), now), begin, acting, fresh), sense, clutch)
                self._check_slip(leg, legs, rest, touch)
            else:
                leg = Leg(clock, *(self._hold(sides[0], begin, acting, clock),) * 2, 0, clutch)
            now, (side, crank) = float(leg.driven.t[-1]), self._ends(leg)
            legs += [leg] * (leg.end > leg.begin)
            if len(legs) > _MOST_LEGS:
                raise SceneError([self._fault(f"a clutch that slips {len(legs) // 2} times by {_at(crank[0])}")])
            goal = leg.driven.goal
            if goal == "lock":
                sense = 0
            elif goal in _SLIPS:
                sense = _SLIPS[goal]
            elif goal == "brake":
                brake_time, brake = clock + now, Ramp(self.brake.torque, now * (self.brake.rise > 0.0), self.brake.rise)
            elif clutch.falls and now >= last:
                return tuple(legs), brake_time
            elif goal == "release" or now >= last:
                clutch = Ramp(self.clutch.torque, self.clutch.hold, self.clutch.fall, True)
                clock, now, brake = clock + now, 0.0, None
                if touch is None and crank[0] >= self.brakes_at:
                    brake_time, brake = clock, Ramp(self.brake.torque, 0.0, self.brake.rise)
                if self.clutch.hold + self.clutch.fall == 0.0:
                    return tuple(legs), brake_time

    def _ends(self, leg: Leg) -> tuple[float, tuple[float, float]]:
        """The speed of the driving side at a leg's end, and the crank's position and speed."""
        crank = _last(leg.driven)
        return (_last(leg.driving)[1] if leg.sense else self.ratio * crank[1]), crank

    def _slip(
        self,
        dynamics: tuple[MachineDynamics, MachineDynamics],
        side: StartState,
        crank: StartState,
        acting: Acting,
        fresh: bool,
    ) -> tuple[Trail, Trail]:
        """Both sides while the clutch slips, from the end of a locked leg (`fresh`) or from any speeds."""
        ratio, begin, goals, sense, turn = self.ratio, side.time, acting.goals, acting.sense, TURN / self.typical
        longest = min(acting.last, begin + acting.clutch.lasting + _LONGEST_SLIP * self.plan.continuous * turn)
        until = min(longest, begin + turn)
        margin = _AFTER_LOCK * self.rtol * abs(side.omega) if fresh else 0.0

        def lost(t: Array, phi: Array, omega: Array) -> Array:
            """Below 0 for a crank that turns back beyond its rest, or has fallen back too far from it."""
            turns = np.maximum(omega + _AT_REST * self.typical, crank.phi - phi)
            return np.asarray(np.minimum(turns, phi - crank.phi + _FARTHEST_BACK))

        while True:  # what is followed of the driving side is no more than a few times what the slip takes
            driving = self._run(dynamics[0], side, [straight("stop", 1, 0.0, 1.0)], until)
            there = float(driving.t[-1])

            def apart(t: Array, phi: Array, omega: Array, driving: Trail = driving, there: float = there) -> Array:
                times = np.ravel(np.asarray(t, dtype=float) + np.zeros_like(omega))
                over = np.maximum(times - there, 0.0)  # a step may try a time past the end of the driving side's motion
                speeds = driving.states(np.minimum(times, there))[1].reshape(np.shape(omega))
                slower = over.reshape(np.shape(omega)) * side.omega / max(there - begin, 1e-300)
                return np.asarray(sense * (speeds - slower - ratio * omega) + margin)

            driven = self._run(dynamics[1], crank, [Goal("lock", apart), *goals, Goal("back", lost)], there)
            if driven.goal is not None or driven.stuck is not None or there < until or until >= longest:
                break
            until = min(longest, begin + 4.0 * (until - begin))
        if driven.goal == "lock" and fresh:  # it has passed the instant by the margin
            times, owners = driven.within(NODES)
            states = driven.states(times, owners)
            widest = int(np.argmax(apart(times, states[0], states[1])))

            def gap(t: float) -> float:
                state = driven.states(np.array([t]))
                return float(apart(np.array([t]), state[0], state[1])[0]) - margin

            if gap(float(times[widest])) > 0.0:
                driven = until_time(driven, root(gap, float(times[widest]), float(times[-1])))
        return until_time(driving, float(driven.t[-1])), driven

    def _fault(self, defect: str, advice: str = "a larger torque, or less inertia on the driven side") -> Fault:
        return Fault(f"shafts.{self.clutch.on}.clutch", defect, "a clutch that takes the crank along", advice)

    def _check_slip(self, leg: Leg, before: list[Leg], rest: float, touch: float | None) -> None:
        """Refuses a slip that ends neither by locking nor by release."""
        goal, (side, (phi, omega)), torque = leg.driven.goal, self._ends(leg), f"{self.clutch.torque:.5g} N m"
        moves = omega > _AT_REST * self.typical
        over = leg.torque.falls or touch is not None
        if moves and (goal in ("lock", "brake") or (goal == "release" and before) or (goal is None and over)):
            return
        where, when = _at(phi), leg.end
        there = f"at {where}, {when:.4g} s after the clutch of {torque} engaged"
        if leg.torque.falls and touch is None:
            defect = f"a brake that stops the crank {there}, while that still passes torque"
            advice = "a later engage of the brake, or an earlier release or a shorter hold and fall of the clutch"
            raise SceneError([self._fault(defect, advice)])
        if any(each.sense == 0 for each in before):
            defect = f"a crank that stalls {there}, which slips again from {_at(leg.driven.start.phi)} on"
            raise SceneError([self._fault(defect, "a larger torque, less work, or more inertia on the driven side")])
        if goal == "back" and phi > rest:
            defect = f"a crank that turns back {there}"
            advice = "a larger torque, or less load on the way"
        elif goal == "back":
            defect = (
                f"a crank that falls back by half a turn from {_at(rest)}, {when:.4g} s after the clutch of {torque} engaged"
            )
            advice = "a clutch torque that is there sooner, a brake that is released later, or a counterbalance"
        elif goal == "release":
            defect = (
                f"a clutch of {torque} that never locks: at its release at {where}, after {when:.4g} s, "
                f"{self.clutch.on} turns at {side * _RPM:.4g} rpm "
                f"and the crank as if it turned at {self.ratio * omega * _RPM:.4g} rpm"
            )
            advice = "a larger torque, a shorter rise, less inertia on the driven side, or a later release"
        elif not moves:
            defect = f"a clutch of {torque} that does not move the crank from {where} ({when:.4g} s)"
            advice = "a larger torque, or less load on the way"
        else:
            raise SceneError([self._fault(f"a clutch of {torque} that has not locked after {when:.4g} s, at {where}")])
        raise SceneError([self._fault(defect, advice)])

    def _hold(self, whole: MachineDynamics, crank: StartState, acting: Acting, clock: float) -> Trail:
        """The whole machine with its clutch locked, until it slips or something else ends it."""
        brake, longest = acting.brake, crank.time + _LONGEST * TURN / self.typical
        until = min(acting.last, longest, brake.lasting if brake is not None and brake.falls else math.inf)
        locked = self._run(whole, crank, [*acting.goals, straight("stall", 1, 0.0, 1.0)], until)
        slips = self._slips(locked, acting.clutch) if locked.stretches else None
        if slips is not None:
            return until_time(locked, slips[0])._replace(goal=slips[1], stuck=None)
        if locked.goal in (None, "stall") and (locked.goal or locked.t[-1] < until or until == longest):
            (phi, omega), when = _last(locked), clock + float(locked.t[-1])
            defect = f"a machine that stalls at {_at(phi)}, {when:.4g} s after the clutch engaged"
            if locked.stuck is None and locked.goal is None:
                defect = f"a machine that creeps at {_at(phi)} at {omega * _RPM:.3g} rpm, {when:.4g} s on"
            advice = "a larger flywheel, a stronger motor, or more time between strokes if it had not recovered"
            expected = "a flywheel that carries the crank through the work"
            raise SceneError([Fault("flywheel.inertia", defect, expected, advice)])
        return locked

    def _slips(self, locked: Trail, clutch: Ramp) -> tuple[float, str] | None:
        """The first time (s) at which the locked clutch would pass more than its torque, and the sense; else None."""
        holds = clutch._replace(torque=self.clutch.static_torque)

        def excess(times: Array, owners: Index) -> Array:
            return np.abs(self.locked_torque(locked, times, owners)) - torque_at(holds, times)

        times, owners = locked.within(NODES)
        sampled = excess(times, owners).reshape(len(locked.stretches), -1)
        bend = np.abs(np.diff(sampled, 2)).max(axis=1)  # beyond instants of a step its maximum is less than that
        if (sampled.max(axis=1) + bend).max() <= 0.0:
            return None
        when, most = locked.greatest(excess)
        if most <= 0.0:
            return None
        beyond = np.flatnonzero((excess(times, owners) > 0.0) | (times > when))  # of two sides of a jump, the latter
        k = int(beyond[0])
        low, high, which = float(times[k - 1]), min(float(times[k]), when), owners[k : k + 1]
        way = "slip" if self.locked_torque(locked, np.array([high]), which)[0] > 0.0 else "overrun"
        if k == 0 or owners[k] != owners[k - 1]:
            return float(times[k]), way

        def over(t: float) -> float:
            return float(excess(np.array([t]), which)[0])

        return (low if over(low) > 0.0 else root(over, low, high)), way

    def locked_torque(self, locked: Trail, times: Array, owners: Index) -> Array:
        """The torque (N m) of the locked clutch at times (s): what the driving side does not need for itself."""
        torques = np.zeros(times.size)
        for portion, states, here in locked.along(times, owners):
            alpha = locked.dynamics.at_many(*here).acceleration
            at = np.full(alpha.size, math.pi)
            torques[portion] = self.driving.surplus(
                at, Anchor(math.pi, None, None), self.ratio * states[1], 0.0 * at, self.ratio * alpha
            )
        return torques

    def greatest_passed(self, locked: Trail) -> float:
        """The greatest torque (N m), in size, that the locked clutch passes along a motion."""
        return locked.greatest(lambda times, owners: np.abs(self.locked_torque(locked, times, owners)))[1]

    def _stop(
        self, begin: tuple[float, float], time: float, brake_time: float | None
    ) -> tuple[Trail | None, Trail, float, float]:
        """The driven side until the crank stands still, the time (s) of the brake's application, and M* at rest (N m).

        From the time (s) at which the clutch has opened; the brake acts already, or is applied at its angle.
        """
        coasting = None
        if brake_time is None and begin[0] < self.brakes_at:
            goals = [straight("brake", 0, self.brakes_at, -1.0), straight("stop", 1, 0.0, 1.0)]
            coasting = self._run(self.driven, StartState(*begin), goals)
            begin, time = _last(coasting), time + float(coasting.t[-1])
            if coasting.goal != "brake":
                defect = f"a crank that comes to rest by itself at {_at(begin[0])}, {time:.4g} s after the clutch engaged"
                advice = "release the clutch later, or put the brake on sooner"
                expected = f"one that comes to the brake at {_at(self.brakes_at)}"
                raise SceneError([Fault(f"shafts.{self.clutch.on}.clutch.disengage", defect, expected, advice)])
        brake_time = time if brake_time is None else brake_time
        braking = self.braked_from(*begin, time - brake_time)
        rest, _ = _last(braking)
        moment, friction, _ = self.driven.stiction(rest % TURN, *neighbours(self.driven.machine, rest % TURN), 0.0)
        brake, ratio = holding(self.brake, moment), self.scene.shafts[self.brake.on]
        if abs(moment) > brake * ratio + friction:
            key = "torque" if moment > 0.0 or self.brake.reverse_torque == self.brake.torque else "reverse_torque"
            defect = f"a brake of {brake:.5g} N m that does not hold the crank at {_at(rest)}, where M* = {moment:.5g} N m"
            advice = f"at least {(abs(moment) - friction) / ratio:.4g} N m, a counterbalance, or another stop_at"
            stop = self.plan.stop_at + self.plan.continuous * TURN
            if rest - stop > NEAR_STOP and stop > begin[0]:  # it would absorb the energy of the crank on the way to there
                energy = 0.5 * float(self.driven.at(begin[0], begin[0], begin[1]).inertia) * begin[1] ** 2
                needed = energy / (stop - begin[0]) / ratio
                advice = f"about {needed:.3g} N m to stop it at stop_at, or a brake put on sooner"
            raise SceneError([Fault(f"{BRAKE}.{key}", defect, "one that holds the crank at rest", advice)])
        return coasting, braking, brake_time, moment

    def inching(self, touch: float) -> float:
        """The angle (rad) that the crank turns from rest at `stop_at` by a touch (s), the driving side idling before."""
        rest = self.plan.stop_at
        legs, _ = self.engaged(_BELOW_IDLE * self.typical * self.ratio, rest, touch)
        return _last(self.braked_from(*self._ends(legs[-1])[1]))[0] - rest

    def braked_from(self, phi: float, omega: float, since: float = 0.0) -> Trail:
        """The driven side until it stands still, from an angle (rad), a speed (rad/s), and a time (s) of its brake."""
        goals = [straight("stop", 1, 0.0, 1.0), straight("turn", 0, phi + TURN, -1.0)]
        braking = self._run(self.braked, StartState(phi, omega, (), since), goals)
        if braking.goal != "stop":
            left, brake, time = _last(braking)[1], self.brake.torque, float(braking.t[-1])
            rpm, at = left * _RPM, _at(phi)
            defect = (
                f"a brake of {brake:.5g} N m that leaves the crank at {rpm:.4g} rpm after a turn from {at}, in {time:.4g} s"
            )
            advice = "a larger torque" if left >= omega else f"more than about {brake / (1.0 - (left / omega) ** 2):.3g} N m"
            raise SceneError([Fault(f"{BRAKE}.torque", defect, "one that stops the crank", advice)])
        return braking


def periodic(strokes: Strokes, guess: Phases | None = None, earlier: Phases | None = None) -> Phases:
    """The periodic stroke: it ends with the speed of the driving side and the resting angle of the crank at its start.

    `guess` is a stroke of a similar machine (without one the search begins with the motor's no-load speed and `stop_at`),
    `earlier` the stroke of the machine itself from the state in which the guess begins, if it was calculated before. Raises
    SceneError for a stroke that cannot be followed (see `Strokes.stroke`) or is longer than the period; if none is periodic.
    """
    try:
        phases = fitted(strokes, guess, None, 1.0, earlier)[1]
        if phases.period < phases.stop_time:
            raise strokes.too_fast(phases.stop_time, phases.period)
    except SceneError as error:
        if not strokes.plan.rate or strokes.scene.inertia is None:  # of a wheel that is still sought no other rate is known
            raise
        raise SceneError([_beyond_rate(strokes, error.faults[0])]) from None
    return phases


def _beyond_rate(strokes: Strokes, fault: Fault) -> Fault:
    """The fault of a stroke, with the rate at which the drive brings the wheel back if that is less, from speeds tried."""
    idle, rates = strokes.typical * strokes.ratio, list[float]()
    for share in _REGAINED:
        try:
            phases = strokes.stroke(share * idle, strokes.plan.stop_at, regains=True)
        except SceneError as error:
            last = error.faults[0]
            if last.path == fault.path == "single_stroke.rate":  # the drive brings it back within the stroke
                return fault._replace(advice=last.advice)
            break
        rates.append(60.0 * strokes.plan.continuous / max(phases.period, phases.stop_time))
    if max(rates, default=math.inf) < 60.0 * (strokes.plan.rate or 0.0):
        return fault._replace(advice=f"at most about {max(rates):.3g} strokes a minute, or a stronger motor")
    return fault


def fitted(
    strokes: Strokes,
    guess: Phases | None,
    excess: Callable[[Strokes, Phases], float] | None,
    closest: float,
    earlier: Phases | None = None,
) -> tuple[Strokes, Phases]:
    """The periodic stroke and its machine, with an excess that with the flywheel at which that is 0.

    By Newton's method on the whole stroke. Its derivatives are at first differences of neighbouring strokes, then Broyden's.
    With an excess the flywheel's inertia is a third unknown.

    Args:
        strokes: of the machine, or of one with nearly that flywheel.
        guess: as for `periodic`.
        excess: relative, of a machine and its stroke; solved to within `closest`; None for the machine as it is.
        closest: of the excess.
        earlier: as for `periodic`.

    Raises:
        SceneError: as `periodic`.

    """
    turns, enough = strokes.plan.continuous * TURN, _ENOUGH * strokes.rtol

    def image_of(tried: Strokes, phases: Phases) -> Array:
        kept = [] if excess is None else [tried.inertia * (1.0 + excess(tried, phases))]
        return np.array([phases.speed, phases.rest - turns, *kept])

    def after(begin: Array) -> tuple[Array, Strokes, Phases]:
        tried = strokes if excess is None else Strokes(strokes.scene, float(begin[2]), strokes.rtol, strokes)
        phases = tried.stroke(float(begin[0]), float(begin[1]))
        return image_of(tried, phases), tried, phases

    own = [] if excess is None else [strokes.inertia]
    state: Array = np.array([_BELOW_IDLE * strokes.typical * strokes.ratio, strokes.plan.stop_at, *own])
    slopes: Array | None = None
    if guess is not None:
        state, slopes = np.array([*guess.begin, *own]), guess.slopes
    if slopes is not None:
        slopes = slopes[: state.size, : state.size] if len(slopes) >= state.size else None
    for _ in range(0 if guess else _PLAIN):
        state = after(state)[0]
    scale = np.array([abs(state[0]), TURN, *(inertia * closest / enough for inertia in own)])
    change, before, tries, best, since = np.zeros(state.size), math.inf, 0, math.inf, 0
    last: Array | None = None
    for step in range(_MOST_STEPS):
        try:
            first = earlier if step == 0 else None
            image, tried, phases = after(state) if first is None else (image_of(strokes, first), strokes, first)
        except SceneError:
            if not 0 < tries < _HALVINGS:
                raise
            change, before, tries, last = 0.5 * change, math.inf, tries + 1, None  # back towards the last that went through
            state = state - change
            continue
        off = float(np.max(np.abs(image - state) / scale))
        best, since = (off, 0) if off < _PROGRESS * best else (best, since + 1)
        if since > _PATIENCE:
            break
        # never the guess itself, which another tolerance may have found; beside it, what returns within a step's tolerance
        if step and off <= (enough if guess is None or step > 1 else strokes.rtol):
            return tried, phases._replace(slopes=slopes)
        if slopes is None or (off > _SLOW * before and last is None):
            moves = np.diag([_DIFFERENCE * state[0], _TURN_STEP, *(_DIFFERENCE * inertia for inertia in own)])
            slopes = np.array([(image - after(state - move)[0]) / move.sum() for move in moves]).T
        elif last is not None:
            along = change / scale**2
            slopes = slopes + np.outer(image - last - slopes @ change, along) / (change @ along)
        last = None if off > _SLOW * before else image
        change = np.asarray(np.linalg.solve(slopes - np.eye(state.size), state - image), dtype=np.float64)
        if not np.isfinite(change).all():
            break
        longest = 0.5 * np.delete(state, 1) / np.maximum(np.abs(np.delete(change, 1)), 1e-300)
        change = change * min(1.0, float(longest.min()))
        over = float((image - state)[-1] / state[-1]) if own else 0.0
        if over * change[-1] < 0.0 and abs(over) > _ASTRAY:
            change[-1] = state[-1] * (1.0 if over > 0.0 else -0.5)  # a heavier flywheel keeps a limit better
        state, before, tries = state + change, off, 1
    defect = "no stroke after which the driving side has the speed that it began with"
    advice = "a motor whose torque falls with speed, with power enough for this rate"
    raise SceneError([Fault("single_stroke", defect, "a rate that the drive can keep", advice)])


def regaining(strokes: Strokes, speed: float, guess: Phases) -> Phases:
    """The periodic stroke that begins at a speed (rad/s) of the driving side, whatever its period.

    By Newton's method on the angle alone. `guess`: a periodic stroke, with its slopes. Raises SceneError for a stroke that
    cannot be followed, or after which that speed is not reached again.
    """
    turns, rest = strokes.plan.continuous * TURN, guess.begin[1]
    slope = 0.0 if guess.slopes is None else float(guess.slopes[1, 1])
    for _ in range(_MOST_STEPS):
        phases = strokes.stroke(speed, rest, regains=True)
        off = phases.rest - turns - rest
        if abs(off) <= _ENOUGH * strokes.rtol * TURN:
            break
        rest += off / (1.0 - slope)
    return phases._replace(slopes=guess.slopes)


def holding(brake: Brake, moment: float) -> float:
    """The greatest torque (N m) of a brake at rest, against a moment that would turn it forwards (above 0) or backwards."""
    return brake.torque if moment > 0.0 else brake.reverse_torque


def beyond(scene: Scene, shaft: str) -> list[str]:
    """A shaft and those connected to it beyond it, nearer ones first."""
    return [name for name in scene.shafts if shaft in scene.inwards(name)]


def ramp(torque: Ramp) -> str:
    """A torque over time as an expression.

    >>> ramp(Ramp(900.0, 0.0, 0.0)), ramp(Ramp(900.0, 0.0, 0.05))
    ('900.0', '900.0*min(1, t/0.05)')
    """
    size, begin, lasting, falls = torque
    if lasting == 0.0:
        return f"{size!r}"
    since = "t" if begin == 0.0 else f"(t - {begin!r})"
    if falls and begin == 0.0:
        return f"{size!r}*(1 - {since}/{lasting!r} if t < {lasting!r} else 0)"
    if falls:
        return f"{size!r}*max(0, min(1, 1 - {since}/{lasting!r}))"
    return f"{size!r}*min(1, {since}/{lasting!r})"


def torque_at(torque: Ramp, times: Array) -> Array:
    """A torque (N m) at times (s).

    >>> torque_at(Ramp(900.0, 0.02, 0.04, True), np.array([0.0, 0.03, 0.05])).tolist()
    [900.0, 675.0, 225.0]
    """
    if torque.lasting == 0.0:
        return np.full(times.shape, torque.torque)
    share = np.clip((times - torque.begin) / torque.lasting, 0.0, 1.0)
    return torque.torque * (1.0 - share if torque.falls else share)


def until_time(trail: Trail, end: float) -> Trail:
    """A motion as far as a time (s)."""
    kept = [stretch for stretch in trail.stretches if stretch.step.start < end]
    if kept:
        step = kept[-1].step  # with the same dense output, to its new end
        kept[-1] = kept[-1]._replace(step=type(step)(step.dense, step.start, min(step.end, end)))
    return trail._replace(stretches=tuple(kept))


def _load(on: str, law: str, path: str) -> Load:
    """A torque on a shaft by its expression."""
    return Load(on, parse(law), TURN, path=path)


def _at(phi: float) -> str:
    return f"crank angle {math.degrees(phi % TURN):.4g} deg"


def check(scene: Scene) -> None:
    """Refuses parts of the scene with which strokes cannot be followed, each with its reason."""
    plan = scene.single_stroke
    assert plan is not None
    clutch, faults = plan.clutch, list[Fault]()
    mine = set(beyond(scene, clutch.on))

    def add(path: str, defect: str, expected: str, advice: str = "") -> None:
        faults.append(Fault(path, defect, expected, advice))

    if abs(scene.cycle - TURN) > 1e-9:
        add("regime.cycle", f"a cycle of {math.degrees(scene.cycle):.6g} deg", "one turn of the crank, which is a stroke")
    if scene.drive is None or scene.drive.on not in mine:
        on = "no drive" if scene.drive is None else f"a drive on {scene.drive.on}"
        add("drive.on", on, f"one on {clutch.on} or beyond it, before the clutch")
    if scene.has_flywheel and scene.flywheel_on not in mine:
        defect = f"a flywheel on {scene.flywheel_on}, behind the clutch"
        add("flywheel.on", defect, f"one on {clutch.on} or beyond it, which runs on between strokes")
    if scene.unknown is not None:
        path = "drive.torque" if scene.unknown == "drive" else f"parameters.{scene.unknown}"
        add(path, '"balance"', "a value, or a motor")
    if scene.drive is not None and not (isinstance(scene.drive.law, Expression) and scene.drive.law.uses_speed):
        add("drive", "a torque that does not depend on speed", "a motor, which brings the flywheel back to its speed")
    if scene.motor is not None and scene.motor.circuit is not None:
        add("drive.motor", "a motor with states of its own", "one by its torque over speed", "leave those out")
    if "current_pulsation" in scene.limits:
        defect = "a limit on the pulsation of the current together with [single_stroke]"
        add("flywheel.limits.current_pulsation", defect, "limits of torque, heat and irregularity", "leave it out")
    if scene.wheel is not None:
        defect, advice = "a wheel together with [single_stroke]", "flywheel.wheel.choose gives it"
        add("flywheel.shape", defect, "inertia or irregularity alone", advice)
    if scene.compliances:
        add(f"shafts.{next(iter(scene.compliances))}.stiffness", "a compliant shaft together with a clutch", "rigid shafts")
    if plan.brake.on in mine:
        defect = f"a brake on {plan.brake.on}, before the clutch"
        add(f"{BRAKE}.on", defect, "one on the crank, or geared to it behind the clutch")
    hung = [(each.shaft, each.path) for each in scene.mechanisms] + [(each.on, each.path) for each in scene.springs]
    for on, path in hung:
        if on in mine:
            add(path, f"on {on}, before the clutch", "mechanisms and springs behind the clutch")
    for load in scene.loads:
        law = load.law
        if isinstance(law, Expression) and law.uses_time:
            add(load.path, "a load that depends on time", "one of position and speed")
        free = isinstance(law, (int, float)) or (isinstance(law, Expression) and not law.names & {"phi", "x"})
        if load.on in mine and not (free and load.start is None and load.sense == 0):
            add(load.path, f"a load on {load.on} that depends on an angle", "one that does not, before the clutch")
    if any(mechanism.linkage is not None for mechanism in scene.mechanisms) and Machine(scene).has_joint_friction:
        add("mechanism", "friction in joints together with a clutch", "joints without", "leave friction out")
    if (clutch.disengage - plan.brake.engage) % TURN != 0.0:
        first, then = ((angle - plan.stop_at) % TURN or TURN for angle in (clutch.disengage, plan.brake.engage))
        if then < first:
            defect = f"a brake put on at {math.degrees(plan.brake.engage):.4g} deg, before the clutch lets go"
            add(f"{BRAKE}.engage", defect, f"at {math.degrees(clutch.disengage):.4g} deg or later")
    if faults:
        raise SceneError(faults)
