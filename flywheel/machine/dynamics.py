"""A machine at instants of a motion: its equation (see `machine.equation`) at any position, speed and time, for stepping.

The record of such a motion (`Trail`) is a sequence of stretches with smooth laws, each a step with its dense output.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.motion import runge_kutta
from bondgraph.motion.stepping import Step
from bondgraph.numerics import count, root, summits
from bondgraph.recording import Recorder
from bondgraph.reduction import Station
from flywheel.machine.equation import alike, balanced, lost, passed_by, solved
from flywheel.machine.machine import DRIVE, Anchor, Machine, MeshStage, circuit_of
from flywheel.machine.programs import programs_of
from flywheel.numerics.cells import ROUNDING, Index, wide

if TYPE_CHECKING:
    from flywheel.components.motors.motor import States
    from flywheel.machine.reactions import Coefficients, JointFriction, Rubbing

Array = NDArray[np.float64]

ONSET = 1e-12  # of the typical speed: the speed by which branches are decided at rest
_FORCE_ROUNDING = 1e-12  # of the largest force, or rate: what is smaller has no sign
_FACTOR_ROUNDS = 8  # rounds in which the sides of meshes and friction settle
_NEAR_TOP = 0.02  # of the range of values: how far below the greatest instant another may be that is refined
_INSET = 1e-10  # of a piece: how far from its ends a law is read that is not defined there


class Instant(NamedTuple):
    """State of a machine at one instant, at its crank: acceleration (rad/s²), M* less losses (N m), I* + J (kg m²).

    `loss` is the moment lost in the meshes (N m), `rates` those of a motor's own states (per second). The energy of the
    machine changes by moment * omega. `passed` is the moment through the mesh of every stage, outwards (N m), `factors` the
    moment of the crank for each N m of a stage: for each mesh on the way 1/efficiency where power flows outwards, efficiency
    where it flows back. `friction` is that of rough joints: it is part of
    the moment; NaN if it leaves no motion.
    """

    acceleration: Any
    moment: Any
    inertia: Any
    loss: Any
    rates: tuple[Any, ...] = ()
    passed: tuple[Any, ...] = ()
    factors: tuple[Any, ...] = ()
    friction: Rubbing | None = None


PlainInstant = Callable[[float, float, float, Any], tuple[float, float, float, tuple[float, ...]]]


_Row = tuple[Any, Any, Any, dict[str, Any] | None]
"""Inertia, its slope and moment of a stage without flywheel and circuit; efforts of loads by path with joint friction."""


class _Contribution(NamedTuple):
    inertia: Any
    slope: Any
    moment: Any
    efforts: dict[str, Any] | None = None  # of loads, by path, where joints have friction


def _interior(ends: tuple[float, float]) -> tuple[float, float]:
    """The ends of a piece, moved to where its laws are defined."""
    inset = max(_INSET * (ends[1] - ends[0]), 64 * ROUNDING * ends[1])
    return ends[0] + inset, ends[1] - inset


def _resting(instant: Instant, direction: Any) -> Instant:
    """The instants, without an acceleration for those that have no direction."""
    if direction is None or not np.any(rests := np.equal(direction, 0.0)):
        return instant
    acceleration, moment, loss = (np.where(rests, 0.0, row) for row in (instant.acceleration, instant.moment, instant.loss))
    return instant._replace(acceleration=acceleration, moment=moment, loss=loss)


@lru_cache(maxsize=64)
def _equation(factors: tuple[float, ...], carrying: int, driven: int) -> Callable[..., tuple[float, float, float]]:
    """The equation of motion in plain numbers, recorded from `balanced`: acceleration, moment less losses, inertia.

    By the speed, the flywheel on one stage and the torque of a motor's circuit on another, and the inertia, its slope and
    the moment of every stage, whose factors K are given.
    """
    recorder = Recorder()
    inputs = omega, flywheel, torque, *rows = [recorder.input(str(k)) for k in range(3 + 3 * len(factors))]
    inertias, moments, square = rows[::3], rows[2::3], 0.5 * omega * omega
    inertias[carrying], moments[driven] = inertias[carrying] + flywheel, moments[driven] + torque
    bare = [slope * square - moment for slope, moment in zip(rows[1::3], moments, strict=True)]
    acceleration, own = balanced(inertias, bare, factors)
    outputs = [acceleration, sum(moments) - lost(factors, own), sum(inertias)]
    function: Callable[..., Any] = recorder.program(outputs, inputs).function("math")
    return function


def _one(value: Any) -> float:
    """The only number of an array."""
    return float(np.ravel(value)[0])


class MachineDynamics:
    """A machine with a flywheel (kg m² at the crank) and a value of its unknown, at any position, speed and time.

    `joint_friction` is the friction in its joints at the actual motion, None if nothing rubs or its moment is given;
    `circuit` is that of its motor if this has states, such as a current, else None.
    """

    def __init__(
        self, machine: Machine, inertia: float, balance: float = 0.0, joint_friction: JointFriction | None = None
    ) -> None:
        if machine.has_joint_friction and joint_friction is None:
            raise TypeError("the joints of the machine rub: expected their friction")
        self.machine, self.inertia, self.balance, self.joint_friction = machine, inertia, balance, joint_friction
        self.circuit = circuit_of(machine.scene)
        drive = machine.scene.drive
        self.ratio = 1.0 if drive is None else machine.scene.shafts[drive.on]

    @property
    def holds(self) -> bool:
        """Tests whether laws that change with the direction of motion may hold the machine at rest."""
        return self.machine.is_dry

    def _by_direction(self, anchor: Anchor, omega: Any) -> list[tuple[Machine, Any]]:
        """The machine with its laws in each direction of the motion, and the instants with that direction."""
        machine, back = self.machine, anchor.sense(omega) < 0.0
        if not back.any() if isinstance(back, np.ndarray) else not back:
            return [(machine, True)]
        if np.all(back) or machine.backwards is machine:
            return [(machine.backwards, True)]
        return [(machine, ~back), (machine.backwards, back)]

    def __reduce__(self) -> tuple[Any, ...]:
        return MachineDynamics, (self.machine, self.inertia, self.balance, self.joint_friction)

    def at(
        self,
        phi: float,
        middle: float,
        omega: float,
        time: float = 0.0,
        *,
        states: States = (),
        ends: tuple[float, float] | None = None,
        anchor: Anchor | None = None,
    ) -> Instant:
        """The instant at a position within the smooth piece around `middle`; `ends` are that piece's.

        Branches that depend on speed or time are decided at `anchor` if there is one, else here. Where a law stops being
        defined at a piece's end, it is read just inside. Beyond the end of a stroke, where a trial step may lie, the
        mechanism has no position: I* continues along its tangent.
        """
        place = anchor or Anchor(middle, None, None)
        phi, beyond = self._inside(phi)
        parts, table = self._parts(phi, place, omega, time, states)
        if ends is not None and not all(np.all(np.isfinite(part.moment)) for part in parts):
            low, high = _interior(ends)
            inside = min(max(phi, low), high)
            return self.at(inside, middle, omega, time, states=states, anchor=anchor)
        if beyond:
            parts[0] = parts[0]._replace(inertia=parts[0].inertia + beyond * sum(part.slope for part in parts))
        if self.joint_friction is not None:
            resisted = self._resisted(parts, table, np.array([phi]), place, np.array([omega]), states)
            return resisted._replace(
                acceleration=_one(resisted.acceleration),
                moment=_one(resisted.moment),
                inertia=_one(resisted.inertia),
                loss=_one(resisted.loss),
                rates=tuple(map(_one, resisted.rates)),
                passed=tuple(map(_one, resisted.passed)),
                factors=tuple(map(_one, resisted.factors)),
            )
        sense = None if len(parts) == 1 else place.sense(omega)
        return _resting(self._instant(parts, omega, states, place.factors, sense), place.direction)

    def plainly(self, anchor: Anchor) -> PlainInstant | None:
        """The result of `at` in the piece of an anchor as a function of plain numbers.

        From phi, omega, t and a motor's states to acceleration, moment, inertia and their rates (see `Instant`). Where a law
        is not defined it raises ValueError or ArithmeticError, or returns values that are not finite. None if joints have
        friction, on a stroke, where the anchor does not give the sides of meshes, or where the walk cannot be recorded.
        """
        machine, circuit, ratio = self.machine, self.circuit, self.ratio
        if machine.has_joint_friction or machine.scene.stroke is not None:
            return None
        programs = programs_of(machine.backwards if anchor.direction == -1.0 else machine)
        program = programs.motion(anchor)  # which serves `at`, too, until the anchor gives the sides of meshes
        if program is None or anchor.direction == 0.0 or (len(machine.stages) > 1 and not anchor.factors):
            return None
        law, unknown, flywheel = programs.function(program, "math"), self.balance, self.inertia
        equation = _equation(anchor.factors or (1.0,), *self._places)

        def instant(phi: float, omega: float, t: float, states: States) -> tuple[float, float, float, tuple[float, ...]]:
            if circuit is None:
                return (*equation(omega, flywheel, 0.0, *law(phi, omega, t, unknown)), ())
            torque = ratio * circuit.torque(ratio * omega, states)
            terms = equation(omega, flywheel, torque, *law(phi, omega, t, unknown))
            return (*terms, circuit.rates(ratio * omega, states))

        return instant

    @cached_property
    def _places(self) -> tuple[int, int]:
        """The stage that carries the flywheel, and the one that is driven."""
        stages = self.machine.stages
        carrying = next((k for k, stage in enumerate(stages) if stage.carries_flywheel), 0)
        return carrying, next((k for k, stage in enumerate(stages) if stage.drives), 0)

    def at_many(
        self,
        phi: Array,
        anchor: Anchor,
        omega: Array,
        time: Array,
        states: States = (),
        ends: tuple[float, float] | None = None,
        *,
        watched: bool = False,
    ) -> Instant:
        """The instants at arrays of positions, speeds and times; all of `anchor` is given, as arrays or numbers.

        With the `ends` of a piece, a law that is not defined there is read just inside, as by `at`. The signs that decide
        branches of friction are included if it is `watched`.
        """
        phi = np.asarray(self._inside(phi)[0])
        parts, table = self._parts(phi, anchor, omega, time, states)
        if ends is not None and not all(np.isfinite(part.moment).all() for part in parts):
            return self.at_many(np.clip(phi, *_interior(ends)), anchor, omega, time, states, watched=watched)
        factors = anchor.factors or tuple(1.0 for _ in parts)
        if self.joint_friction is not None:
            resisted = self._resisted(parts, table, phi, anchor._replace(factors=factors), omega, states, watched)
        else:
            resisted = _resting(self._instant(parts, omega, states, factors), anchor.direction)
        whole = partial(wide, shape=phi.shape)
        return resisted._replace(
            acceleration=whole(resisted.acceleration),
            moment=whole(resisted.moment),
            inertia=whole(resisted.inertia),
            loss=whole(resisted.loss),
            passed=tuple(map(whole, resisted.passed)),
        )

    def surplus(self, phi: Array, anchor: Anchor, omega: Array, time: Array, acceleration: Array) -> Array:
        """The remaining moment (N m, on the crank) of a machine, after losses, at accelerations of a motion forwards."""
        own, factors = self._driven(phi, anchor, omega, time, acceleration)
        return -np.asarray(sum(k * residual for k, residual in zip(factors, own, strict=True)))

    def losses(self, phi: Array, anchor: Anchor, omega: Array, time: Array, states: States, acceleration: Array) -> Array:
        """The moment lost in the meshes (N m, on the crank) at accelerations, by the sides that drive at each instant."""
        own, factors = self._driven(phi, anchor, omega, time, acceleration, states)
        return wide(lost(factors, own), phi.shape)

    def _driven(
        self, phi: Array, anchor: Anchor, omega: Array, time: Array, acceleration: Array, states: States = ()
    ) -> tuple[list[Any], tuple[Any, ...]]:
        """The moment that each stage takes at accelerations (N m), and its factors for the sides that then drive."""
        parts = self._parts(phi, anchor, omega, time, states)[0]
        own = [part.inertia * acceleration + part.slope * (0.5 * omega * omega) - part.moment for part in parts]
        one: tuple[Any, ...] = tuple(np.ones(phi.shape) for _ in own)
        sense = np.where(omega < 0.0, -1.0, 1.0)
        return own, passed_by(own, self.machine.stages, one, lambda tau: np.asarray(tau * sense > 0.0))[1]

    def moments(
        self,
        phi: Array,
        anchor: Anchor,
        omega: Array,
        time: Array,
        states: States = (),
        now: Instant | None = None,
        *,
        rubbing: bool = True,
    ) -> dict[str, Array]:
        """The moments (N m, on the crank) by part: loads, weights, springs, dampers.

        now: the instants there, as `at_many` gives them, if they are known; rubbing: with friction in joints.
        """
        phi = np.asarray(self._inside(phi)[0])
        options: dict[str, Any] = {}
        for machine, there in self._by_direction(anchor, omega):
            for stage in machine.stages:
                station = stage.reduction.at(phi, anchor.phi)
                rows = [*station.moments(self.balance).items()]
                rows += [(part, -value * omega) for part, value in station.resistances().items()]
                if self.circuit is not None and stage.drives:
                    rows.append(("drive", self.ratio * self.circuit.torque(self.ratio * omega, states)))
                rows += self._moving(station, stage, anchor, omega, time)
                for part, value in rows:
                    options[part] = options.get(part, 0.0) + (value if there is True else np.where(there, value, 0.0))
        if self.joint_friction is not None and rubbing:
            friction = (now or self.at_many(phi, anchor, omega, time, states)).friction
            assert friction is not None
            for k in np.flatnonzero(self.joint_friction.rubbing_joints):
                label = self.joint_friction.labels[k]
                options[label] = options.get(label, 0.0) + friction.moments[:, k]
        return {part: wide(value, phi.shape) for part, value in options.items()}

    def switches(self, phi: Any, anchor: Anchor, omega: Any, time: Any) -> list[Any]:
        """Values whose signs decide branches and that depend on speed or time, in the order of the loads."""
        phi, events = self._inside(phi)[0], list[Any]()
        machine = self._by_direction(anchor, omega)[0][0]  # a stretch with laws that differ backwards has one direction
        for stage, efforts in zip(machine.stages, machine.switching, strict=True):
            places = stage.reduction.at(phi, anchor.phi).places(omega, time, anchor.omega, anchor.time) if efforts else ()
            for element, here, there in places:
                if element.name in efforts and not self._of_circuit(element.name):
                    events += efforts[element.name].speed_switches(here, there)
        return events

    def sides(
        self, phi: Array, anchor: Anchor, omega: Array, time: Array, states: States = (), *, there: bool = False
    ) -> list[Array]:
        """Values that change their signs where a stretch of motion ends: switches, and the moments of meshes with losses.

        there: at the anchor itself, where each mesh has the sign of its side, even if nothing passes it yet.
        """
        rows = [wide(value, phi.shape) for value in self.switches(phi, anchor, omega, time)]
        if there and anchor.factors is not None:
            near = [anchor.factors[stage.near] for stage in self.machine.stages]
            outwards = [1.0 if own > nearer else -1.0 for own, nearer in zip(anchor.factors[1:], near[1:], strict=True)]
            rows += [wide(anchor.sense(omega) * way, phi.shape) for way in outwards]
        if self.joint_friction is not None or (anchor.factors is not None and not there):
            now = self.at_many(phi, anchor, omega, time, states, watched=True)
            if not there:
                inert = now.inertia * (np.abs(now.acceleration) + omega * omega)
                level = _FORCE_ROUNDING * (np.abs(now.moment) + inert + np.sum(np.abs(now.passed), axis=0))
                rows += [np.where(np.abs(tau) > level, tau, 0.0) for tau in now.passed[1:]]
            elif anchor.factors is None:
                rows += now.passed[1:]
            if now.friction is not None:
                rows += list(now.friction.decisive)
        return rows

    @cached_property
    def branching(self) -> bool:
        """Tests whether branches depend on speed, time, the driving side of a mesh, or friction of joints or shafts."""
        return self.holds or len(self.machine.stages) > 1 or self.machine.switches_at_speeds

    def _inside(self, phi: Any) -> tuple[Any, Any]:
        """The position, or the end of the stroke that it has passed, and the distance beyond it."""
        if self.machine.scene.stroke is None:
            return phi, 0.0
        inside = np.clip(phi, 0.0, self.machine.scene.cycle)
        return inside, phi - inside

    def _parts(
        self, phi: Any, anchor: Anchor, omega: Any, time: Any, states: States
    ) -> tuple[list[_Contribution], tuple[Coefficients, ...]]:
        """All parts of the machine, as its laws are in the direction of the motion; with rough joints also their tables."""
        (machine, _), *others = self._by_direction(anchor, omega)
        parts, table = self._parts_of(machine, phi, anchor, omega, time, states)
        for other, back in others:
            turned = self._parts_of(other, phi, anchor, omega, time, states)[0]
            for k, (part, new) in enumerate(zip(parts, turned, strict=True)):
                efforts = part.efforts and {
                    path: np.where(back, (new.efforts or {})[path], v) for path, v in part.efforts.items()
                }
                parts[k] = part._replace(moment=np.where(back, new.moment, part.moment), efforts=efforts)
        return parts, table

    def _parts_of(
        self, machine: Machine, phi: Any, anchor: Anchor, omega: Any, time: Any, states: States
    ) -> tuple[list[_Contribution], tuple[Coefficients, ...]]:
        """The parts of the machine in one direction, with the flywheel; with rough joints from their tables if possible."""
        friction, rows = self.joint_friction, None
        table: tuple[Coefficients, ...] = ()
        if friction is None:
            rows = self._recorded_parts(machine, phi, anchor, omega, time)
        else:
            table = friction.at(np.atleast_1d(phi))
            if friction.complete:
                count(phi)
                efforts = [effort for effort in machine.efforts if not self._of_circuit(effort.path)]
                rows = friction.acting(table, np.atleast_1d(phi), anchor, omega, time, self.balance, efforts)
        rows = rows or [self._part(stage, phi, anchor, omega, time) for stage in machine.stages]
        parts = []
        for stage, (inertia, slope, moment, pressing) in zip(machine.stages, rows, strict=True):
            if self.circuit is not None and stage.drives:
                moment = moment + self.ratio * self.circuit.torque(self.ratio * omega, states)
            whole = inertia + self.inertia if stage.carries_flywheel else inertia
            parts.append(_Contribution(whole, slope, moment, pressing))
        return parts, table

    def _recorded_parts(self, machine: Machine, phi: Any, anchor: Anchor, omega: Any, time: Any) -> list[_Row] | None:
        """All parts by the recorded walk, in a piece that is evaluated often enough; None if the walk itself is used."""
        if not (isinstance(anchor.phi, float) and isinstance(anchor.omega, float | None)):
            return None
        programs = programs_of(machine)
        program = programs.motion(anchor) if programs.pays(anchor) else None
        if program is None:
            return None
        plain = isinstance(phi, float) and isinstance(omega, float)
        try:
            outputs = programs.function(program, "math" if plain else "numpy")(phi, omega, time, self.balance)
        except (ValueError, ArithmeticError):
            return None
        if not (math.isfinite(sum(outputs)) if plain else np.isfinite(sum(outputs)).all()):
            return None
        count(phi)
        return [(*outputs[k : k + 3], None) for k in range(0, len(outputs), 3)]

    def _part(self, stage: MeshStage, phi: Any, anchor: Anchor, omega: Any, time: Any) -> _Row:
        station = stage.reduction.at(phi, anchor.phi)
        reduced = station.reduced
        moment = reduced.moment + self.balance * reduced.per_unknown - reduced.resistance * omega
        for _, value in self._moving(station, stage, anchor, omega, time):
            moment = moment + value
        pressing = None
        if self.joint_friction is not None:
            pressing = station.efforts(omega, time, anchor.omega, anchor.time, self.balance)
        return reduced.inertia, reduced.slope, moment, pressing

    def _moving(
        self, station: Station, stage: MeshStage, anchor: Anchor, omega: Any, time: Any
    ) -> Iterator[tuple[str, Any]]:
        """Part and moment of the laws that depend on speed or on time."""
        if stage.reduction.moving:
            for element, effort, factor in station.contributions(omega, time, anchor.omega, anchor.time):
                if not self._of_circuit(element.name):
                    yield element.part or element.name, effort + self.balance * factor

    def _of_circuit(self, name: str) -> bool:
        """Tests whether a source is the quasi-static law of a motor whose own states are followed instead."""
        return self.circuit is not None and name.startswith(DRIVE)

    def _resisted(
        self,
        parts: Sequence[_Contribution],
        table: tuple[Coefficients, ...],
        phi: Array,
        anchor: Anchor,
        omega: Array,
        states: States,
        watched: bool = True,
    ) -> Instant:
        """The instants with friction in joints, at positions and speeds (n,): one linear system for each (see `Rubbing`).

        Directions of power in the meshes and sides of friction are found by iteration if the anchor does not give them.
        """
        friction = self.joint_friction
        assert friction is not None
        sense = anchor.sense(omega) + np.zeros(phi.shape)
        efforts = {path: value for part in parts for path, value in (part.efforts or {}).items()}
        pressed = friction.pressed(table, phi, omega, efforts, sense, anchor.sides)
        inertias = [part.inertia for part in parts]
        bare = [part.slope * (0.5 * omega * omega) - part.moment for part in parts]
        used = anchor.factors or tuple(np.ones(phi.shape) for _ in parts)
        for _ in range(_FACTOR_ROUNDS):
            alone = balanced(inertias, bare, used)[0]
            total = sum(k * i for k, i in zip(used, inertias, strict=True))
            shares = np.stack([np.broadcast_to(k / total, phi.shape) for k in used], axis=1)
            resisted = friction.resisted(pressed, alone, shares)
            rubbed = [
                part._replace(moment=part.moment + resisted.moments[:, friction.stages == k].sum(axis=1))
                for k, part in enumerate(parts)
            ]
            instant = self._instant(rubbed, omega, states, anchor.factors, sense)
            if len(parts) == 1 or anchor.factors is not None or alike(instant.factors, used):
                break
            used = instant.factors
        rubbing = friction.rubbing(pressed, resisted, alone, shares, watched=watched)
        return _resting(instant, sense)._replace(friction=rubbing)  # what each joint then holds is not determined

    def from_rest(
        self, phi: float, ahead: float, behind: float, times: Array, states: States = (), decided: float | None = None
    ) -> Array:
        """The accelerations (rad/s²) with which a machine at rest would move forwards, and with which backwards: (2, n).

        At times (n,) it starts forwards where the first is above 0, backwards where the second is below; `ahead` and
        `behind` lie in the pieces on either side of the position, and branches by time are decided at `decided` (s), or at
        every time itself. 0 if friction leaves no motion.
        """
        onset, residuals = ONSET * self.machine.typical_speed, list[Array]()
        deciding = times if decided is None else np.full(times.shape, decided)
        for place, sense in ((ahead, 1.0), (behind, -1.0)):
            omega = sense * onset
            if len(self.machine.stages) == 1:
                anchor = Anchor(place, np.full(times.shape, omega), deciding, direction=sense)
                one = self.at_many(np.full(times.shape, phi), anchor, np.zeros(times.shape), times, states).acceleration
            else:  # the sides of meshes are found one instant at a time
                rows = np.array([np.broadcast_to(state, times.shape) for state in states]).reshape(len(states), times.size).T
                anchors = [Anchor(place, omega, float(t), direction=sense) for t in deciding]
                each = [
                    self.at(phi, place, 0.0, float(t), states=row.tolist(), anchor=anchor)
                    for t, row, anchor in zip(times, rows, anchors, strict=True)
                ]
                one = np.array([now.acceleration for now in each])
            residuals.append(np.where(np.isfinite(one), one, 0.0))
        return np.array(residuals)

    def stiction(
        self, phi: float, ahead: float, behind: float, time: float, states: States = ()
    ) -> tuple[float, float, Sequence[str]]:
        """The stiction of a machine at rest, at a position between places ahead of it and behind.

        Returns: M* without it (N m); the friction against a motion from there, infinite where no driving action would move
        the mechanism; the loads, by path, that cannot move it however large they are, as each alone causes friction as large
        as its push.
        """
        friction = self.joint_friction
        at = np.array([float(self._inside(phi)[0])])
        if friction is None:
            sides = []
            for sense, place in ((1.0, ahead), (-1.0, behind)):
                anchor = Anchor(place, sense * ONSET * self.machine.typical_speed, time, direction=sense)
                sides.append(_one(sum(part.moment for part in self._parts(float(at[0]), anchor, 0.0, time, states)[0])))
            return 0.5 * (sides[0] + sides[1]), 0.5 * (sides[1] - sides[0]), ()
        for sense, place in ((1.0, ahead), (-1.0, behind)):
            omega = sense * ONSET * self.machine.typical_speed
            anchor = Anchor(place, omega, time, direction=sense)
            parts, table = self._parts(float(at[0]), anchor, omega, time, states)
            moment = float(np.ravel(sum(part.moment for part in parts))[0])
            if sense * moment >= 0.0:
                break
        shares: dict[str, float] = {}  # of M*, by the paths of loads
        for stage in self.machine.stages:
            station = stage.reduction.at(float(at[0]), anchor.phi)
            shares |= station.moments(self.balance, by_name=True)
            moving = station.contributions(omega, time, anchor.omega, anchor.time) if stage.reduction.moving else []
            shares |= {element.name: effort + self.balance * factor for element, effort, factor in moving}
        efforts = {path: value for part in parts for path, value in (part.efforts or {}).items()}
        pushing = {path: float(share) for path, share in shares.items() if path in efforts and sense * share > 0.0}
        total = np.ravel(sum(part.inertia for part in parts))
        return moment, *friction.stiction(table, at, sense, total, efforts, pushing)

    def _instant(
        self,
        parts: Sequence[_Contribution],
        omega: Any,
        states: States,
        factors: tuple[Any, ...] | None,
        sense: Any = None,
    ) -> Instant:
        square = 0.5 * omega * omega
        bare = [part.slope * square - part.moment for part in parts]
        loss: Any = 0.0
        passed: tuple[Any, ...] = ()
        used: tuple[Any, ...] = ()
        if len(parts) == 1:
            acceleration = -bare[0] / parts[0].inertia if np.all(parts[0].inertia) else math.inf
        else:
            forwards = 1.0 if factors is not None or np.all((omega if sense is None else sense) >= 0.0) else -1.0
            outwards = None if factors else lambda tau: forwards * tau > 0.0
            shares, inertias = factors or (1.0,) * len(parts), [part.inertia for part in parts]
            acceleration, own, passed, used = solved(inertias, bare, shares, self.machine.stages, outwards)
            loss = lost(used, own)
        return Instant(
            acceleration=acceleration,
            moment=sum(part.moment for part in parts) - loss,
            inertia=sum(part.inertia for part in parts),
            loss=loss,
            rates=() if self.circuit is None else self.circuit.rates(self.ratio * omega, states),
            passed=passed,
            factors=used,
        )


def dynamics_of(machine: Machine, inertia: float, balance: float = 0.0) -> MachineDynamics:
    """The dynamics of a machine with a flywheel (kg m² at the crank), with the friction of its joints where they rub."""
    if not machine.has_joint_friction:
        return MachineDynamics(machine, inertia, balance)
    from flywheel.machine.reactions import joint_friction_of

    return MachineDynamics(machine, inertia, balance, joint_friction_of(machine))


# -- the record of a motion in time --------------------------------------------------------------------------------------


class StartState(NamedTuple):
    """The state at a time (s): position (rad; on a stroke from its beginning), speed (rad/s), and a motor's own states."""

    phi: float
    omega: float
    states: tuple[float, ...] = ()
    time: float = 0.0


class MotionStretch(NamedTuple):
    """A step, the offset of its position, and the anchor that decides the branches of its laws."""

    step: Step
    offset: float
    anchor: Anchor


NODES, _WEIGHTS = (0.5 * part for part in np.polynomial.legendre.leggauss(10))

NODES = 0.5 + NODES
"""Shares of a step at which a speed is searched for, and works are summed."""

_TOGETHER = 20_000  # times that are looked at in one go


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


class Along(NamedTuple):
    """States at some times of a motion, with the arguments of its laws: positions are those within the cycle."""

    phi: Array
    anchor: Anchor
    omega: Array
    time: Array
    states: Array


class Trail(NamedTuple):
    """A motion as it was stepped. States are rows: position, speed, the moment's work (J), and a motor's own.

    `goal` is the kind of event that ended it, if it was not time; `stuck` says where it stands still for good; `cycles` is
    the number of complete cycles, `repeated` the number of these copied from the one before; `drift` is the relative change
    of the kinetic energy at phi = 0 over the copied cycle. `left` is the share of the typical speed left in a decaying swing
    that counts as rest.
    """

    dynamics: MachineDynamics
    start: StartState
    stretches: tuple[MotionStretch, ...]
    goal: str | None = None
    stuck: str | None = None
    cycles: int = 0
    repeated: int = 0
    drift: float = 0.0
    left: float = 0.0

    @property
    def t(self) -> Array:
        """Times of the steps, s."""
        return np.array([self.start.time, *(stretch.step.end for stretch in self.stretches)])

    def owners(self, times: Array) -> Index:
        """The stretch that each time belongs to."""
        return np.clip(np.searchsorted(self.t[1:], times), 0, len(self.stretches) - 1)

    def states(self, times: Array, owners: Index | None = None) -> Array:
        """The states at times, by dense output: (states, times)."""
        which = self.owners(times) if owners is None else owners
        states = np.empty((3 + len(self.start.states), times.size))
        steps = [stretch.step.dense for stretch in self.stretches]
        explicit = np.array([isinstance(step, runge_kutta.MethodStep) for step in steps])[which]
        if explicit.any():
            states[:, explicit] = runge_kutta.at(steps, which[explicit], times[explicit])
        rest = np.flatnonzero(~explicit)
        order = rest[np.argsort(which[rest], kind="stable")]
        firsts = np.flatnonzero(np.diff(which[order], prepend=-1))
        for mine in np.split(order, firsts[1:]) if order.size else ():
            states[:, mine] = steps[which[mine[0]]](times[mine])
        states[0] += np.array([stretch.offset for stretch in self.stretches])[which]
        return states

    def anchors(self, owners: Index) -> tuple[Array, Anchor]:
        """The offsets of positions in stretches of the motion, and the anchors that decide the branches of laws there."""
        used, where = np.unique(owners, return_inverse=True)
        stretches = [self.stretches[k] for k in used]
        offset = np.array([stretch.offset for stretch in stretches])[where]
        anchors = np.array([stretch.anchor[:3] for stretch in stretches])[where]
        senses = np.array([stretch.anchor.direction for stretch in stretches], dtype=float)  # not a number if none is known
        direction = None if np.isnan(senses).all() else senses[where]
        factors: tuple[Any, ...] | None = None
        if stretches[0].anchor.factors is not None:
            factors = tuple(np.array([stretch.anchor.factors for stretch in stretches])[where].T)
        sides = None
        if stretches[0].anchor.sides is not None:
            sides = np.array([stretch.anchor.sides for stretch in stretches])[where]
        return offset, Anchor(anchors[:, 0], anchors[:, 1], anchors[:, 2], factors, sides, direction)

    def along(self, times: Array, owners: Index) -> Iterator[tuple[slice, Array, Along]]:
        """Times in portions: their indices, states, and arguments of laws; `owners` are the stretches they belong to."""
        for k in range(0, times.size, _TOGETHER):
            portion = slice(k, k + _TOGETHER)
            states = self.states(times[portion], owners[portion])
            offset, anchor = self.anchors(owners[portion])
            yield portion, states, Along(states[0] - offset, anchor, states[1], times[portion], states[3:])

    def within(self, inside: Array) -> tuple[Array, Index]:
        """Times in every stretch, at its ends and at shares (0 to 1) of it, and the stretches that they belong to."""
        shares = np.concatenate(([0.0], inside, [1.0]))
        start, end = self.t[:-1, None], self.t[1:, None]
        times = start + (end - start) * shares
        times[:, -1] = self.t[1:]
        return times.ravel(), np.repeat(np.arange(len(self.stretches)), shares.size)

    def greatest(self, value: Callable[[Array, Index], Array]) -> tuple[float, float]:
        """Time (s) and size of the greatest value along the motion, by its dense output.

        `value` is that at times (s) and the stretches that they lie in. All maxima among instants within each step are
        refined, each between its neighbours of the same step.
        """
        times, owners = self.within(NODES)
        values = value(times, owners).reshape(len(self.stretches), -1)
        times = times.reshape(values.shape)
        walled = np.pad(values, ((0, 0), (1, 1)), constant_values=-np.inf)
        tops = (values >= walled[:, :-2]) & (values >= walled[:, 2:])
        tops &= values >= values.max() - _NEAR_TOP * (values.max() - values.min())
        step, k = np.nonzero(tops)
        low, high = times[step, np.maximum(k - 1, 0)], times[step, np.minimum(k + 1, times.shape[1] - 1)]

        def along(grid: Array, which: Index) -> Array:
            return value(grid.ravel(), np.repeat(step[which], grid.shape[1])).reshape(grid.shape)

        finer = summits(along, low, high, 33, 6)
        best, sample = int(finer.value.argmax()), int(values.argmax())
        if values.flat[sample] >= finer.value[best]:
            return float(times.flat[sample]), float(values.flat[sample])
        return float(finer.place[best]), float(finer.value[best])

    def gauss(self, end: float = np.inf) -> tuple[Array, Index, Array]:
        """Nodes (s) of Gauss' rule in every stretch up to a time, the stretches they belong to, and their weights (s)."""
        first, last = self.t[:-1], np.minimum(self.t[1:], end)
        used = np.flatnonzero(last > first)
        width = (last - first)[used, None]
        return (first[used, None] + width * NODES).ravel(), np.repeat(used, NODES.size), (width * _WEIGHTS).ravel()

    def time_to(self, speed: float) -> float | None:
        """The first time (s) at which a speed (rad/s) is reached; None if it never is."""
        times, owners = self.within(NODES)
        speeds = self.states(times, owners)[1]
        above = np.flatnonzero(speeds >= speed)
        if not above.size:
            return None
        if above[0] == 0:
            return 0.0
        low, high = float(times[above[0] - 1]), float(times[above[0]])

        def faster(t: float) -> float:
            return float(self.states(np.array([t]), owners[above[:1]])[1, 0]) - speed

        return low if low == high or faster(low) >= 0.0 else root(faster, low, high)  # equal on both sides of a switch

    def __repr__(self) -> str:
        """The number of steps and their end, instead of all of them."""
        return f"Trail({len(self.stretches)} steps to t = {self.t[-1]:.6g} s, goal={self.goal!r}, cycles={self.cycles})"

    def ends(self) -> Array:
        """The states at the ends of all steps, the start included: (states, steps + 1)."""
        first, last = self.stretches[0], dict[int, Sequence[float]]()
        rows = [first.step.first]
        for step, _, _ in self.stretches:
            taken, key = source(step), id(source(step))
            if not isinstance(taken, runge_kutta.MethodStep):  # of which several steps may be parts
                rows.append(step.last)
                continue
            if key not in last:
                last[key] = step.last
            rows.append(last[key])
        ends = np.array(rows).T
        ends[0] += [first.offset, *(offset for _, offset, _ in self.stretches)]
        return ends
