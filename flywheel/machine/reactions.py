"""Forces on a scene's mechanisms as linkages: loads on their ports, the reactions in their joints, and friction there.

Passive resistances are friction in the joints of linkages at the actual speed, with the reactions of the same instant.
The law is that of `mechanisms.linkages.statics`: Coulomb's, mu N or r R mu/sqrt(1 + mu²), against the motion of the joint.
In the direct problem the acceleration alpha is unknown, and depends on reactions and friction as they depend on it. The
forces z_j that friction follows are linear in all that acts: with p the friction of all joints,

    z = z_0 + z_w omega + z_ww omega² + z_a alpha + z_L loads + Z p,     p_j = -c_j sign(g_j omega) |z_j|,
    sum over the parts of k (I alpha + ½ dI/dphi omega² - M) = sum k g_j p_j,

with g_j the rate of joint j by the crank's. Put into the first line, the second leaves |z| = |a + Q |z||, piecewise linear
(a pin's resultant aside), which is solved as in kinetostatics. All coefficients are functions of the driver's coordinate
alone: they are fitted once by series on cells, and evaluated together.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.elements import Here
from flywheel.machine.loads import LoadLaw, spring_effort
from flywheel.machine.machine import Anchor, Machine
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.linkage import followed, linkage_of
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.mechanisms.linkages.reactions import Reactions, reactions_at
from flywheel.mechanisms.linkages.statics import (
    FRICTION,
    Force,
    Load,
    Passive,
    Torque,
    applied,
    centres,
    continued_sizes,
    friction_sizes,
    inertial,
    masses,
    response,
    size_forms,
    unknowns,
    weights,
)
from flywheel.mechanisms.linkages.statics import Effort as JointEffort
from flywheel.numerics import cells
from flywheel.numerics.cells import Cells, wide
from flywheel.scene.scene import TURN, Mechanism

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

BY_ONE, BY_SPEED, BY_SQUARE, BY_ACCELERATION = range(4)  # the first columns of a table of coefficients

_CELL_ERROR = 1e-13  # of the largest coefficient of a column: error of a cell that is left as it is
_MOST_CELLS = 4000
_WIDEST = np.pi / 4  # of a cell to begin with, rad; of a stroke an eighth
_COMING = 1e-9  # rad, or m of a stroke: how far on a joint that reverses has reversed
_SIZE_ROUNDING = 1e-12  # of the largest: what is smaller is rounding
_FORCE_ROUNDING = 1e-12  # of the largest force, or rate: what is smaller has no sign
_MOST_TRIED = 10  # forces with a sign, up to which all combinations of signs are tried
_PARALLEL = 1e-10  # sine of the angle between forces on one line
_SOLUTION_DISTANCE = 1e-6  # of the largest force: solutions that differ by less are one
_CONTRACTION = 0.99  # norm of a map that certainly contracts
_LEAST_SPEED = 1e-150  # rad/s: a speed that has a sense, and nothing else
_BESIDE = 1e-9  # of the cycle: how near to an edge its two sides are looked at


# -- loads and reactions -----------------------------------------------------------------------------------------------


class MachineMotion(NamedTuple):
    """The motion of the forces: crank angle (rad; m on a sliding stroke), its rate and its acceleration, (n,).

    `time` (s) is given for a motion in time; `gone` is the part of the angle in complete cycles. Branches of laws are
    decided at `anchor`: if None in the smooth piece of each angle (`Machine.anchors`), at the speed and time there.
    `creeps`: it moves forwards so slowly that its speed matters only for the direction of friction.
    """

    phi: Array
    omega: Array
    alpha: Array
    time: Array | None = None
    gone: Array | float = 0.0
    anchor: Anchor | None = None
    creeps: bool = False

    def own(self, machine: Machine) -> Array:
        """The machine's coordinate from 0 to the cycle."""
        return np.clip(self.phi - machine.scene.origin - self.gone, 0.0, machine.scene.cycle)

    @property
    def sense(self) -> Array:
        """The direction of motion, 1 or -1, at an instant of rest the one before or after it; 0 if it rests."""
        if self.creeps:
            return np.ones_like(self.phi)
        coming = 0.0 if self.anchor is None else self.anchor.omega
        return np.sign(np.where(self.omega == 0.0, coming, self.omega))


def port_forces(
    machine: Machine,
    motion: MachineMotion,
    balance: float,
    mechanism: Mechanism,
    *,
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """Forces in one mechanism's joints in a motion of the machine, with a value (SI) for the scene's unknown.

    inertia, friction: False leaves them out.
    """
    scene = machine.scene
    ratio = scene.shafts[mechanism.shaft]
    poses = poses_of(mechanism, ratio * motion.own(machine) + mechanism.phase)
    return reactions_at(
        poses,
        np.where(motion.omega == 0.0, _LEAST_SPEED * motion.sense, ratio * motion.omega),
        ratio * motion.alpha,
        gravity=scene.gravity,
        loads=tuple(_port_loads(machine, motion, balance, mechanism, inertia)),
        inertia=inertia,
        friction=friction,
    )


def close_positions(machine: Machine, count: int) -> Array:
    """Coordinates dense enough for the largest forces: `count` evenly spaced, and both sides of every edge of a load.

    Angles in rad or positions in m, ascending, from the first to the last of the cycle or the stroke.
    """
    cycle, ends = machine.scene.cycle, machine.scene.stroke is not None
    beside = _BESIDE * cycle
    edges = np.asarray(machine.switches if machine.switches_at_ends else machine.switches[1:-1])
    every = np.concatenate((np.linspace(0.0, cycle, count, endpoint=ends), edges, edges - beside, edges + beside))
    inside = (every >= 0.0) & ((every <= cycle) if ends else (every < cycle))
    return np.asarray(machine.scene.origin + np.unique(every[inside]))


def solution_of(mechanism: Mechanism) -> tuple[Solution, float | None]:
    """Any mechanism but a law followed as a linkage, and its period in its own coordinate (rad; None on a stroke)."""
    if mechanism.linkage is not None:
        cyclic = followed(mechanism)
        return cyclic.solution, cyclic.period
    period = TURN if mechanism.stroke is None else None
    return solve(linkage_of(mechanism), *sorted(mechanism.stroke or (0.0, TURN))), period


def poses_of(mechanism: Mechanism, psi: Array) -> Poses:
    """Poses of any mechanism but a law, as a linkage, at its own coordinates psi (rad, of any turn; m)."""
    solution, period = solution_of(mechanism)
    if period is None:
        return solution.poses(np.clip(psi, solution.low, solution.high))
    return solution.poses(psi - period * np.floor(psi / period))


def _port_loads(
    machine: Machine, motion: MachineMotion, balance: float, mechanism: Mechanism, inertia: bool
) -> Iterator[Load]:
    """Actions on a mechanism's ports at given positions: loads, springs, dampers, and the inertia of bodies fixed there.

    The last are forces -m (g alpha + g' omega²) by the influence coefficient g of the port's velocity.
    """
    scene, kinematics, prefix = machine.scene, machine.kinematics, f"{mechanism.name}."
    phi, time = motion.own(machine), 0.0 if motion.time is None else motion.time
    decided = motion.anchor or Anchor(machine.anchors(phi), motion.omega, time)
    anchor = decided.phi
    own = machine.motion_of(prefix)
    ratio = scene.shafts[mechanism.shaft]

    def of_velocity(place: str, at: Array) -> tuple[Any, Any]:
        """The influence coefficient of a place's velocity and its slope, in the pieces of this motion."""
        flows, k = kinematics.flows(at, anchor), kinematics.variable[machine.places[place].junction]
        return flows.gain[k], flows.slope[k]

    def seen(place: str) -> tuple[Here, Here]:
        """Positions for a law at a place, and in the middles of their pieces."""
        loads = []
        for at, omega, then in ((phi, motion.omega, time), (anchor, decided.omega, decided.time)):
            here = Here(ratio * at, own.position(ratio * at, np, ratio * anchor), np)
            if machine.depends_on_speed or machine.depends_on_time:
                here = here._replace(speed=ratio * omega, flow=of_velocity(place, at)[0] * omega, time=then)
            loads.append(here)
        return loads[0], loads[1]

    def acting(place: str, value: Any) -> Load:
        return port_load(mechanism, place.removeprefix(prefix), wide(value, phi.shape))

    for effort in machine.efforts:
        if effort.load.on.startswith(prefix):
            here = seen(effort.load.on)
            unknown = balance * effort.per_unknown(*here) if effort.depends_on_unknown else 0.0
            yield acting(effort.load.on, effort(*here) + unknown)
    for spring in scene.springs:
        if spring.on.startswith(prefix):
            yield acting(spring.on, -spring_effort(spring, machine.places[spring.on])(*seen(spring.on)))
    for damper in scene.dampers:
        if damper.on.startswith(prefix):
            yield acting(damper.on, -damper.coefficient * of_velocity(damper.on, phi)[0] * motion.omega)
    for item in scene.inertias if inertia else ():
        if item.on.startswith(prefix):
            gain, slope = of_velocity(item.on, phi)
            yield acting(item.on, -item.value * (gain * motion.alpha + slope * motion.omega**2))


def port_load(mechanism: Mechanism, port: str, value: ArrayLike) -> Load:
    """A force (N) or torque (N m) on a mechanism's port, as a load on its bodies; a number or shape (n,)."""
    guide = KINDS[mechanism.type].guides.get(port)
    if guide is not None:
        return JointEffort(guide, value)
    point = next((point for point in mechanism.points if point.name == port), None)
    if point is not None:
        along = np.asarray(value, dtype=float)
        return Force(point.body, point.point, np.cos(point.direction) * along, np.sin(point.direction) * along)
    if mechanism.linkage is not None and any(joint.name == port for joint in mechanism.linkage.joints):
        return JointEffort(port, value)
    return Torque(port, value)


# -- friction at the actual motion -------------------------------------------------------------------------------------


class Coefficients(NamedTuple):
    """Coefficients of a mechanism's table at n positions.

    rows: of the forces that friction follows, by every input and every passive action, (n, forces, 2, inputs + forces);
    powers: of the inputs themselves by the crank's speed, (n, inputs); ways: rates of joints by the crank's, (n, forces).
    """

    rows: Array
    powers: Array
    ways: Array


@dataclass(frozen=True, eq=False)
class Pressed:
    """The forces z that friction follows at n instants, each (x, y) of a pin or (normal, 0), and the slip of their joints.

    free: without friction and acceleration, (n, forces, 2); by_acceleration: for a unit of the crank's, (n, forces, 2);
    pull: for a unit of each passive action, (n, forces, 2, forces); ways: rate of the friction's joint by the crank's,
    (n, forces); known: of each mechanism its coefficients (n, forces, 2, inputs), its inputs (n, inputs), and which of its
    forces are resultants, (forces,). sense: direction of the motion, (n,); sliding: sign of each joint's, (n, forces);
    factors: passive action for a unit of the force that it follows. signs, directions: of the forces with a sign, and of
    those in pins that keep to a line (rad, else NaN), (n, forces), as continued from an anchor; None if they are open.
    """

    free: Array
    by_acceleration: Array
    pull: Array
    ways: Array
    constants: tuple[tuple[Array, Array, Flags], ...]
    sense: Array
    sliding: Array
    factors: Array
    signs: Array | None
    directions: Array | None

    @cached_property
    def scale(self) -> Array:
        """The largest term of the sums, N, (n,)."""
        largest = [np.abs(rows * inputs[:, None, None, :]).max(axis=(1, 2, 3)) for rows, inputs, _ in self.constants]
        return np.asarray(np.max(largest, axis=0))

    @cached_property
    def lined(self) -> Flags:
        """Pins whose force keeps to a line whatever acts, so that it may pass zero (a rod without mass), (n, forces)."""
        return np.concatenate([_lined(rows) & curved for rows, _, curved in self.constants], axis=1)


class Resisted(NamedTuple):
    """Moments of passive actions on the crank (n, forces), the forces that they follow, with their signs, and 1 - Q.

    directions: of resultants in pins (rad), (n, forces);
    """

    moments: Array
    sizes: Array
    matrix: Array
    directions: Array

    @property
    def determinant(self) -> Array:
        """det(1 - Q), (n,)."""
        return np.asarray(np.linalg.det(self.matrix))


class Rubbing(NamedTuple):
    """Friction in joints at instants: moment of each passive action (N m, on the crank), in the order of their labels.

    moments: shape (n, actions); sides: see `Anchor`; decisive: values that change sign where a smooth stretch of it ends,
    (rows, n): rates, forces, and the determinant on whose root friction leaves no motion; none if it is not watched.
    Of a single instant without initial sides, `solutions` is the number of motions, and `joint` the joint for which there is
    none, or more than one.
    """

    moments: Array
    sides: Array
    decisive: Array
    solutions: int = 1
    joint: str = ""


class _ForceTable(NamedTuple):
    """Coefficients of one mechanism's forces, by series on cells of the driver's coordinate: (cells, entries, order)."""

    mechanism: Mechanism
    ratio: float
    period: float | None
    mesh: Cells
    series: Array
    inputs: int
    passives: tuple[Passive, ...]
    strengths: Array
    curved: Flags
    rates: Array
    error: float

    def at(self, phi: Array) -> Coefficients:
        """The coefficients at crank angles (n,)."""
        psi = self.ratio * phi + self.mechanism.phase
        if self.period is not None:
            psi = psi - self.period * np.floor(psi / self.period)
        cell, t = cells.located(self.mesh, psi)
        basis, values = cells.basis(t, cells.ORDER), np.empty((t.size, self.series.shape[1]))
        used = {*cell.tolist()}
        for k in used:  # few, as a stretch of motion lies in one or two
            mine = cell == k if len(used) > 1 else slice(None)
            values[mine] = basis[mine] @ self.series[k].T
        count = len(self.passives)
        rows, powers, ways = values[:, : -self.inputs - count], values[:, -self.inputs - count : -count], values[:, -count:]
        return Coefficients(rows.reshape(-1, count, 2, self.inputs + count), self.ratio * powers, self.ratio * ways)


class JointFriction:
    """Friction in all joints of a machine's linkages, at any position, speed, acceleration and loads.

    `labels` name every passive action for the energy's table, `paths` are those of the loads that press on the joints.
    """

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        rough = [m for m in machine.scene.mechanisms if m.linkage is not None and m.linkage.rubs]
        self.paths = [[e.path for e in machine.efforts if e.load.on.startswith(f"{m.name}.")] for m in rough]
        self.tables = [_fitted(machine, mechanism) for mechanism in rough]
        self.labels = [f"friction in {t.mechanism.name}.{one.joint}" for t in self.tables for one in t.passives]
        self.strengths = np.concatenate([table.strengths for table in self.tables])
        self.curved = np.concatenate([table.curved for table in self.tables])
        self.rates = np.concatenate([table.rates for table in self.tables])
        self.error = max(table.error for table in self.tables)
        counts = [len(table.passives) for table in self.tables]
        self.stages = np.repeat([self._stage(table.mechanism.shaft) for table in self.tables], counts)

    def __reduce__(self) -> tuple[Any, ...]:
        return joint_friction_of, (self.machine,)

    @cached_property
    def rubbing_joints(self) -> Flags:
        """A mask of the passive actions that are friction; the others come from inclined teeth."""
        return np.array([one.name == FRICTION for table in self.tables for one in table.passives])

    def at(self, phi: Array) -> tuple[Coefficients, ...]:
        """The coefficients of every rough mechanism at crank angles (n,)."""
        return tuple(table.at(phi) for table in self.tables)

    @cached_property
    def complete(self) -> bool:
        """Tests whether the tables hold all mechanisms, so that they give the machine's inertia and moment as well."""
        scene = self.machine.scene
        loaded = [item for item in scene.springs if item.on in scene.shafts]
        return len(self.tables) == len(scene.mechanisms) and not loaded

    def acting(
        self,
        coefficients: tuple[Coefficients, ...],
        phi: Array,
        anchor: Anchor,
        omega: Any,
        time: Any,
        unknown: float,
        loads: Iterable[LoadLaw],
    ) -> list[tuple[Any, Any, Any, dict[str, Any] | None]]:
        """The equation of motion except for friction, where the tables are complete, under loads and drive.

        Inertia, its slope and the moment on the crank for each stage (n,), and the efforts of all loads by their paths.
        """
        scene, machine = self.machine.scene, self.machine
        stages = [stage.shaft for stage in machine.stages]
        inertia: list[Any] = [0.0] * len(stages)
        slope, moment = inertia.copy(), inertia.copy()
        efforts: dict[str, Any] = {}
        gains: dict[str, tuple[int, Any]] = {}
        for table, paths, own in zip(self.tables, self.paths, coefficients, strict=True):
            k = self._stage(table.mechanism.shaft)
            always, by_speed, by_square, by_acceleration, *each = own.powers.T
            inertia[k], slope[k] = inertia[k] - by_acceleration, slope[k] - 2.0 * by_square
            moment[k] = moment[k] + always + by_speed * omega
            gains |= {path: (k, gain) for path, gain in zip(paths, each, strict=True)}
        for mass in scene.inertias:
            if mass.on in scene.shafts:
                k = self._stage(mass.on)
                inertia[k] = inertia[k] + mass.value * scene.shafts[mass.on] ** 2
        for damper in scene.dampers:
            if damper.on in scene.shafts:
                k = self._stage(damper.on)
                moment[k] = moment[k] - damper.coefficient * scene.shafts[damper.on] ** 2 * omega
        at_anchor = anchor.omega if anchor.omega is not None else omega
        then = time if anchor.time is None else anchor.time
        for effort in loads:
            k, gain = gains.get(effort.path) or (self._stage(effort.load.on), scene.shafts[effort.load.on])
            motion = machine.motion_of(effort.load.on)
            rate = scene.shafts.get(motion.of, 1.0)
            q, q_anchor = rate * phi, rate * anchor.phi
            here = Here(q, motion.position(q, np, q_anchor), np, rate * omega, gain * omega, time)
            middle = Here(q_anchor, motion.position(q_anchor, np, q_anchor), np, rate * at_anchor, None, then)
            if "flow" in effort.dependencies or effort.uses_speed:
                middle = middle._replace(flow=self._gain(effort, anchor.phi) * at_anchor)
            value = effort(here, middle)
            if effort.depends_on_unknown:
                value = value + unknown * effort.per_unknown(here, middle)
            efforts[effort.path] = value
            moment[k] = moment[k] + gain * value
        return [(*row, efforts) for row in zip(inertia, slope, moment, strict=True)]

    def _stage(self, shaft: str) -> int:
        """The number of the stage that a shaft belongs to."""
        names = [stage.shaft for stage in self.machine.stages]
        return names.index(self.machine.stage_of(shaft))

    def _gain(self, effort: LoadLaw, phi: Any) -> Any:
        """Rate of a load's place by the crank's, at crank angles."""
        for table, paths in zip(self.tables, self.paths, strict=True):
            if effort.path in paths:
                powers = table.at(np.atleast_1d(np.asarray(phi, dtype=float))).powers
                return powers[:, BY_ACCELERATION + 1 + paths.index(effort.path)]
        return self.machine.scene.shafts[effort.load.on]

    def pressed(
        self,
        coefficients: tuple[Coefficients, ...],
        phi: Array,
        omega: Array,
        efforts: Mapping[str, Any],
        sense: Array,
        sides: Array | None = None,
        always: float = 1.0,
    ) -> Pressed:
        """The forces at positions (n,) and speeds, under efforts on ports by the paths of their loads.

        sides: see `Anchor`; always: share of weights and springs.
        """
        free, by_acceleration, constant = [], [], []
        pull, first = np.zeros((phi.size, self.curved.size, 2, self.curved.size)), 0
        for table, paths, own in zip(self.tables, self.paths, coefficients, strict=True):
            inputs = np.zeros((phi.size, table.inputs))
            inputs[:, BY_ONE], inputs[:, BY_SPEED], inputs[:, BY_SQUARE] = always, omega, omega * omega
            for k, path in enumerate(paths, start=BY_ACCELERATION + 1):
                inputs[:, k] = efforts.get(path, 0.0)
            rows, last = own.rows[..., : table.inputs], first + own.ways.shape[1]
            free.append(np.einsum("npkc,nc->npk", rows, inputs))
            by_acceleration.append(rows[..., BY_ACCELERATION])
            constant.append((rows, inputs, table.curved))
            pull[:, first:last, :, first:last] = own.rows[..., table.inputs :]
            first = last
        ways = np.concatenate([own.ways for own in coefficients], axis=1)
        signs = directions = None
        if sides is None:
            sliding = self._sliding(phi, ways, sense)
        else:
            sliding, signs, directions = np.split(np.broadcast_to(sides, (phi.size, 3 * self.curved.size)), 3, axis=1)
        return Pressed(
            free=np.concatenate(free, axis=1),
            by_acceleration=np.concatenate(by_acceleration, axis=1),
            pull=pull,
            ways=ways,
            constants=tuple(constant),
            sense=sense,
            sliding=sliding,
            factors=np.where(self.rubbing_joints, -sliding, 1.0) * self.strengths,
            signs=signs,
            directions=directions,
        )

    def _sliding(self, phi: Array, ways: Array, sense: Any) -> Array:
        """Sign (n, forces) of each joint's motion where the crank, at angles (n,), moves in a sense (1, -1).

        For a joint that reverses there it is the sign afterwards; 0 if the crank is at rest, and of joints that never move.
        """
        moving = np.abs(ways) > _SIZE_ROUNDING * self.rates
        if (turning := (~moving & (self.strengths > 0.0)).any(axis=1)).any():
            ways, near = ways.copy(), np.broadcast_to(phi + _COMING * np.asarray(sense), turning.shape)[turning]
            coming = np.concatenate([own.ways for own in self.at(near)], axis=1)
            ways[turning] = np.where(moving[turning], ways[turning], coming)
            moving = np.abs(ways) > _SIZE_ROUNDING * self.rates
        return np.asarray(np.where(moving, np.sign(ways), 0.0) * np.asarray(sense)[..., None])

    def _by_sizes(self, pressed: Pressed, acceleration: Any, shares: Array) -> tuple[Array, Array]:
        """The forces without friction (n, forces, 2), and by the size of each force (n, forces, 2, forces)."""
        gains, alpha = shares[:, self.stages] * pressed.ways, np.asarray(acceleration, dtype=float).reshape(-1, 1, 1)
        pull = pressed.pull + pressed.by_acceleration[..., None] * gains[:, None, None, :]
        return pressed.free + pressed.by_acceleration * alpha, pull * pressed.factors[:, None, None, :]

    def resisted(self, pressed: Pressed, acceleration: Any, shares: Array) -> Resisted:
        """All passive actions, where the acceleration is `acceleration` without them and `shares` (n, stages) for 1 N m.

        NaN stands where friction leaves no motion.
        """
        free, pull = self._by_sizes(pressed, acceleration, shares)
        if pressed.signs is not None and pressed.directions is not None:
            sizes, matrix = continued_sizes(free, pull, self.curved, pressed.signs, pressed.directions)
            signed, directions = np.where(self.curved, sizes, pressed.signs * sizes), pressed.directions
        else:
            friction = friction_sizes(free, pull)
            sizes = np.where(friction.converged[:, None], friction.sizes, np.nan)
            parts = free + np.einsum("npkj,nj->npk", pull, sizes)
            signed, directions = np.where(self.curved, sizes, parts[..., 0]), np.arctan2(parts[..., 1], parts[..., 0])
            matrix = np.where(friction.converged, 1.0, np.nan)[:, None, None]
        return Resisted(pressed.ways * pressed.factors * sizes, signed, matrix, directions)

    def rubbing(self, pressed: Pressed, resisted: Resisted, acceleration: Any, shares: Array, *, watched: bool) -> Rubbing:
        """Friction at instants; where it is watched or undecided, also the values whose change of sign ends a stretch."""
        signs, directions, sliding = pressed.signs, pressed.directions, pressed.sliding
        solutions, decisive = (1, ""), np.empty((0, len(sliding)))
        if watched or signs is None or directions is None:
            level = _FORCE_ROUNDING * np.maximum(pressed.scale, np.abs(resisted.sizes).max(axis=1))
            forces = np.where(np.abs(resisted.sizes) > level[:, None], resisted.sizes, 0.0)
            none = _FORCE_ROUNDING * self.rates
            rates = np.where(np.abs(pressed.ways) > none, pressed.ways, none * sliding * pressed.sense[:, None])
            if signs is None or directions is None:
                if len(sliding) == 1:
                    solutions = self._solutions(pressed, acceleration, shares)
                signs = np.where(self.curved, 0.0, np.where(forces < 0.0, -1.0, 1.0))
                directions = np.where(pressed.lined, resisted.directions, np.nan)
            rubs = self.rubbing_joints & (self.strengths > 0.0)
            forces = np.where(self.curved & np.isnan(directions), 1.0, forces)  # a resultant that turns has no sign
            decisive = np.concatenate((rates[:, rubs], forces, resisted.determinant[:, None]), axis=1).T
        return Rubbing(resisted.moments, np.concatenate((sliding, signs, directions), axis=1), decisive, *solutions)

    def stiction(
        self,
        table: tuple[Coefficients, ...],
        phi: Array,
        sense: float,
        inertia: Array,
        efforts: Mapping[str, Any],
        pushing: Mapping[str, float],
    ) -> tuple[float, tuple[str, ...]]:
        """The friction (N m) on a machine that starts in a sense from rest at a position (1,), and the loads that lock it.

        inertia: of the whole machine (kg m²), (1,); efforts: of all loads, by path; pushing: the share of M* (N m) of each
        load that pushes in that sense. A load locks if its own friction is as large as its push.
        """

        def against(efforts: Mapping[str, Any], always: float, moment: float, share: Array) -> float:
            pressed = self.pressed(table, phi, np.zeros(1), efforts, np.array([sense]), always=always)
            shares = np.repeat(share[:, None], int(self.stages.max()) + 1, axis=1)
            moment_of_friction = -sense * float(self.resisted(pressed, moment * share, shares).moments.sum())
            return moment_of_friction if math.isfinite(moment_of_friction) else math.inf

        locking = [
            path
            for path, moment in pushing.items()
            if not sense * moment - against({path: efforts[path]}, 0.0, moment, 1.0 / inertia) > 0.0
        ]
        return against(efforts, 1.0, 0.0, 0.0 * inertia), tuple(locking)

    def _solutions(self, pressed: Pressed, acceleration: Any, shares: Array) -> tuple[int, str]:
        """The number of possible motions at one instant, and the joint for which there is none, or more than one.

        Friction leaves none or several where it is large (Painlevé's paradox).
        """
        free, pull = self._by_sizes(pressed, acceleration, shares)
        bound = np.hypot(pull[0, :, 0], pull[0, :, 1])
        if not np.isfinite(bound).all():
            return 0, self.labels[0]
        values, vectors = np.linalg.eig(bound)
        if np.abs(values).max(initial=0.0) < _CONTRACTION:  # a contraction in some norm
            return 1, ""
        joint = self.labels[int((np.abs(vectors[:, np.abs(values).argmax()]) * self.rubbing_joints).argmax())]
        flat = np.flatnonzero(~self.curved & (np.abs(bound).max(axis=1) > 0.0))
        if flat.size > _MOST_TRIED:
            return 1, joint
        solutions: list[Array] = []
        for tried in product((1.0, -1.0), repeat=flat.size):
            signs = np.ones((1, self.curved.size))
            signs[0, flat] = tried
            sizes = continued_sizes(free, pull, self.curved, signs)[0][0]
            most = np.abs(sizes).max()
            holds = bool(np.isfinite(most) and (sizes >= -_SIZE_ROUNDING * most).all())
            if holds and all(np.abs(sizes - other).max() > _SOLUTION_DISTANCE * most for other in solutions):
                solutions.append(sizes)
        return len(solutions), joint


def _lined(sizes: Array) -> Flags:
    """A mask of forces (n, forces) on one line whatever acts: their coefficients (n, forces, 2, inputs) are parallel."""
    largest = np.abs(sizes).max(axis=(1, 2), keepdims=True)
    shares = np.divide(sizes, largest, out=np.zeros_like(sizes), where=largest > 0.0)
    length = np.hypot(shares[:, :, 0], shares[:, :, 1])
    first = np.take_along_axis(shares, length.argmax(axis=2)[:, :, None, None], axis=3)
    across = np.abs(shares[:, :, 0] * first[:, :, 1] - shares[:, :, 1] * first[:, :, 0])
    return np.asarray((across <= _PARALLEL * length.max(axis=2, keepdims=True) ** 2).all(axis=2))


def joint_friction_of(machine: Machine) -> JointFriction:
    """Friction in a machine's joints: it is kept with it."""
    if "joint_friction" not in machine.kept:
        machine.kept["joint_friction"] = JointFriction(machine)
    friction: JointFriction = machine.kept["joint_friction"]
    return friction


# -- coefficients ------------------------------------------------------------------------------------------------------


def _fitted(machine: Machine, mechanism: Mechanism) -> _ForceTable:
    """The table of one mechanism, on cells that are halved until its series follow it."""
    ratio = machine.scene.shafts[mechanism.shaft]
    cycle = followed(mechanism)
    low, high = (0.0, cycle.period) if cycle.period is not None else (cycle.solution.low, cycle.solution.high)
    widest = _WIDEST if cycle.period is not None else (high - low) / 8
    inner = [at for at in machine.corners_of(mechanism) if low < at < high]
    edges = np.unique(np.concatenate((np.linspace(low, high, int(np.ceil((high - low) / widest)) + 1), inner)))
    first, passives, *_ = _coefficients(machine, mechanism, 0.5 * (edges[1:] + edges[:-1]))  # where joints move
    inputs = first.powers.shape[1]

    def values(psi: Array) -> tuple[Array, Array]:
        """All entries (entries, n), and the size of each one's column, (entries,): 0 if that is rounding alone."""
        coefficients, _, reactions, shares = _coefficients(machine, mechanism, psi)
        largest = _beyond_rounding(np.abs(coefficients.rows).max(axis=(0, 1, 2)), reactions)
        scale = np.broadcast_to(largest, coefficients.rows.shape[1:]).ravel()
        rates = np.abs(coefficients.ways).max(axis=0, initial=0.0)
        kinds = np.array([one.unit for one in passives])
        speeds = np.array([rates[kinds == unit].max() for unit in kinds])
        entries = np.concatenate((coefficients.rows.reshape(psi.size, -1), coefficients.powers, coefficients.ways), axis=1).T
        powers = _beyond_rounding(np.abs(coefficients.powers).max(axis=0), shares)
        return entries, np.concatenate((scale, powers, speeds))

    def evaluated(edges: Array) -> tuple[tuple[Cells, Array, Array], float, cells.Coarse]:
        mesh = cells.cells(edges)
        entries, sizes = values(mesh.phi.ravel())
        series = cells.fit(entries.reshape(-1, *mesh.phi.shape))
        share = np.divide(cells.tails(series), sizes[:, None], out=np.zeros(series.shape[:2]), where=sizes[:, None] > 0.0)
        worst = share.max(axis=0)
        return (mesh, series, sizes), float(worst.max()), lambda _: worst > _CELL_ERROR

    mesh, series, sizes = cells.refined(edges, evaluated, _CELL_ERROR, _MOST_CELLS)
    largest = np.abs(series).sum(axis=2).max(axis=1)
    series[(largest <= _SIZE_ROUNDING * sizes) | (sizes == 0.0)] = 0.0  # what is nothing but rounding
    error = float(np.divide(cells.tails(series).max(axis=1), sizes, out=np.zeros_like(sizes), where=sizes > 0.0).max())
    rates = ratio * sizes[-len(passives) :]
    still = np.abs(series[-len(passives) :]).sum(axis=(1, 2)) == 0.0
    rubs = np.array([one.name == FRICTION for one in passives])
    strengths = np.array([float(np.abs(one.factor).max()) for one in passives])
    return _ForceTable(
        mechanism,
        ratio,
        cycle.period,
        mesh,
        np.ascontiguousarray(series.transpose(1, 0, 2)),
        inputs,
        passives,
        np.where(rubs & still, 0.0, strengths),
        np.array([len(one.forms) > 1 for one in passives]),
        rates,
        error,
    )


def _beyond_rounding(largest: Array, whole: Array) -> Array:
    """The largest entries of columns (entries,), 0 if they are rounding compared with the terms of the column."""
    return np.where(largest > _SIZE_ROUNDING * whole, largest, 0.0)


def _coefficients(
    machine: Machine, mechanism: Mechanism, psi: Array
) -> tuple[Coefficients, tuple[Passive, ...], Array, Array]:
    """Coefficients at n positions of the driver, by Newton's and Euler's equations of all bodies with one load alone.

    Powers and ways are by the driver's coordinate. Beside the coefficients and the passive actions: the largest reaction in
    any joint under each input alone, (inputs + forces,), and the largest term of each input's power, (inputs,).
    Much smaller values in that input's column are rounding.
    """
    poses, solution, ratio = poses_of(mechanism, psi), followed(mechanism).solution, machine.scene.shafts[mechanism.shaft]
    parts = unknowns(poses, (poses.linkage.driver,), np.ones(psi.size), friction=True)
    loads = np.stack(list(_unit_loads(machine, mechanism, poses, psi)))
    responses = response(poses, parts, loads)
    rows = np.einsum("pkm,nmc->npkc", size_forms(poses, parts, responses.loose), responses.values)
    middle = centres(poses)
    powers = np.einsum("cbin,bin->nc", loads, middle.rate)
    wrenches = [one.pair.on_bodies(middle.value) * (one.name == FRICTION) for one in parts.passives]
    ways = np.einsum("pbin,bin->np", np.stack(wrenches), middle.rate)
    sizes, reactions = np.abs(loads), np.abs(responses.values).max(axis=(0, 1))
    unit, scale = solution.unit, ratio / solution.scale
    weighing = masses(poses) * np.array([unit, unit, 1.0])[:, None] * scale  # what no cancelling of arms makes smaller
    for k, share in ((BY_SQUARE, scale), (BY_ACCELERATION, 1.0)):
        sizes[k] = np.maximum(sizes[k], share * weighing)
        reactions[k] = max(reactions[k], share * float(weighing[:, 0].max()))
    shares = np.einsum("cbin,bin->nc", sizes, np.abs(middle.rate)).max(axis=0)
    return Coefficients(rows, powers, ways), parts.passives, reactions, shares


def _unit_loads(machine: Machine, mechanism: Mechanism, poses: Poses, psi: Array) -> Iterator[Array]:
    """Wrenches (bodies, 3, n): of what acts always, by the crank's speed, its square, its acceleration, by each load."""
    scene, prefix, ratio = machine.scene, f"{mechanism.name}.", machine.scene.shafts[mechanism.shaft]
    phi = (psi - mechanism.phase) / ratio
    if mechanism.stroke is None:
        phi = phi - scene.cycle * np.floor(phi / scene.cycle)
    one, none = np.ones(psi.size), np.zeros_like(poses.value)

    def on(place: str, value: Any) -> Array:
        return applied(poses, [port_load(mechanism, place.removeprefix(prefix), value * one)])

    def mine(items: Sequence[Any]) -> list[Any]:
        return [item for item in items if item.on.startswith(prefix)]

    always = none if scene.gravity is None else weights(poses, scene.gravity)
    for spring in mine(scene.springs):
        motion = machine.motion_of(prefix)
        here = Here(ratio * phi, motion.position(ratio * phi, np, ratio * phi), np)
        always = always - on(spring.on, spring_effort(spring, machine.places[spring.on])(here, here))
    by_speed = none
    by_square = ratio * ratio * inertial(poses, one, 0.0 * one)
    by_acceleration = ratio * inertial(poses, 0.0 * one, one)
    moved = [*mine(scene.dampers), *mine(scene.inertias)]
    flows = machine.kinematics.flows(phi, phi) if moved else None
    for item in moved:
        assert flows is not None
        k = machine.kinematics.variable[machine.places[item.on].junction]
        if item in scene.dampers:
            by_speed = by_speed - on(item.on, item.coefficient * flows.gain[k])
        else:
            by_square = by_square - on(item.on, item.value * flows.slope[k])
            by_acceleration = by_acceleration - on(item.on, item.value * flows.gain[k])
    yield from (always, by_speed, by_square, by_acceleration)
    for effort in machine.efforts:
        if effort.load.on.startswith(prefix):
            yield on(effort.load.on, 1.0)
