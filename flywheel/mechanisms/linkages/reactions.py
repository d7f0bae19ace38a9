"""Kinetostatics: driving actions and reactions of every joint of a plane linkage, for a given motion.

Two routes: Newton's and Euler's equations of all bodies at once (`reactions`), and virtual power with one constraint
released at a time (`virtual_power`). With the inertia left out the analysis is quasi-static. Open chains have as many driven
joints as degrees of freedom, each moved as its user prescribes (`chain_reactions`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.linkages.equations import Poses, check, solved
from flywheel.mechanisms.linkages.statics import (
    COUPLE,
    DRIVE,
    FORCE,
    OPEN,
    Component,
    Effort,
    Force,
    Friction,
    Load,
    Passive,
    ReactionBalance,
    Torque,
    Unknowns,
    applied,
    balance,
    centres,
    contact,
    friction_power,
    guide,
    index,
    inertial,
    joint_rate,
    perp,
    shoe_ends,
    unknowns,
    values_at,
    weights,
)
from flywheel.numerics.faults import Fault, SceneError, array, brief, entry, require
from flywheel.numerics.units import columns
from flywheel.scene.linkage import CAM, FIXED, FRAME, PIN, SLIDE, SLOT, Joint, Linkage

if TYPE_CHECKING:
    from flywheel.mechanisms.linkages.positions import Solution

__all__ = [
    "Effort", "Extreme", "Force", "Friction", "Load", "Motion", "Reactions", "Torque", "chain_reactions",
    "driving_actions", "reactions", "reactions_at", "virtual_power",
]  # fmt: skip

Array = NDArray[np.float64]
Gravity = tuple[float, float] | None

_FORCE_ROUNDING = 1e-12  # of the largest force: smaller ones are none
_FOLLOWS = 1e-8  # tolerance of all other constraints in a released motion


class Extreme(NamedTuple):
    """The largest force (N) in a joint, or at an end of its shoe (`joint.front`), and the driver's position (rad or m)."""

    joint: str
    force: float
    at: float


class Reactions(NamedTuple):
    """Forces in a linkage at n positions: the action of the first body of each joint on its second.

    speed, acceleration: of the driver's coordinate, shape (n,).
    actions: driving action of each driven joint by its name (N m in a pin, N in a slide).
    components: by joint or coupling, then by component: `x`, `y`, `normal`, `moment`, `front`, `rear`, `tangential`,
        `radial`, `friction`; as in the table of `flywheel.mechanisms.linkages.statics`. NaN if redundant constraints
        leave one open, or where friction locks; then `known` is a pin's force in the direction `known_angle` (rad), if
        there is one that stays known.
    units: of the components, by the same names.
    forces: the whole force of each joint or coupling in the frame's axes, friction included, shape (2, n).
    undetermined: names `joint.component` of those that redundant constraints leave open.
    others: wrenches of everything but reactions and driving actions (loads, weights, inertia, friction), (bodies, 3, n).
    residual: of Newton's and Euler's equations, as a share of the largest load, (n,).
    coordinate: name and unit of `poses.q`: the driver's coordinate, or time in an open chain.
    """

    poses: Poses
    speed: Array
    acceleration: Array
    actions: Mapping[str, Array]
    components: Mapping[str, Mapping[str, Array]]
    units: Mapping[str, Mapping[str, str]]
    forces: Mapping[str, Array]
    undetermined: tuple[str, ...]
    friction: Friction
    others: Array
    residual: Array
    coordinate: tuple[str, str]

    @property
    def action(self) -> Array:
        """Driving action (N m, or N) of the linkage's driver, shape (n,)."""
        return self.actions[self.poses.linkage.driver]

    @property
    def power(self) -> Array:
        """Power (W) of all driving actions, shape (n,)."""
        joint = self.poses.linkage.joint
        each = [action * joint_rate(self.poses, joint(name)) for name, action in self.actions.items()]
        return np.asarray(np.sum(each, axis=0) * self.speed)

    @property
    def locked(self) -> Array:
        """Positions (rad or m) of the driver at which friction locks the mechanism."""
        return self.poses.q[~self.friction.converged]

    def resultant(self, joint: str) -> Array:
        """Size (N) of the whole force in a joint or coupling, shape (n,)."""
        return np.asarray(np.hypot(*self.forces[joint]))

    def extremes(self) -> tuple[Extreme, ...]:
        """The largest force of every joint whose force is known somewhere, and of both ends of a shoe, at the positions."""
        sizes: dict[str, Array] = {}
        for name, parts in self.components.items():
            if FORCE in self.units[name].values():
                sizes[name] = self.resultant(name)
            sizes |= {f"{name}.{end}": np.abs(parts[end]) for end in ("front", "rear") if end in parts}
        largest = []
        for name, size in sizes.items():
            if not np.isnan(size).all():
                worst = int(np.nanargmax(size))
                largest.append(Extreme(name, float(size[worst]), float(self.poses.q[worst])))
        return tuple(largest)

    def scales(self) -> tuple[float, float]:
        """The largest force (N), be it in a joint, a load, a weight or of inertia, and its moment (N m) over the whole size.

        Whatever is 1e-12 of these or less is rounding. The size (m) is that of the ways between bodies, or of the longest.
        """
        linkage, ways = self.poses.linkage, np.ptp(self.poses.value[:, :2], axis=(0, 2)).max()
        points = [point for link in (linkage.ground, *linkage.links) for point in link.points]
        size = float(max(ways, *(np.hypot(point.x, point.y) for point in points), 0.0))
        largest: dict[str, float] = {}
        parts = [("", FORCE, self.others[:, :2]), ("", COUPLE, self.others[:, 2]), *list(self.columns())[1:]]
        for _, unit, values in parts:
            largest[unit] = max(largest.get(unit, 0.0), float(np.nanmax(np.abs(values), initial=0.0)))
        force = max(largest[FORCE], largest[COUPLE] / size if size else 0.0)
        return force, force * size or largest[COUPLE]

    def cleared(self, scales: tuple[float, float] | None = None) -> Reactions:
        """The same for reading: with 0 for forces and moments that are rounding beside `scales` (its own if None)."""
        force, moment = scales or self.scales()
        least = {FORCE: _FORCE_ROUNDING * force, COUPLE: _FORCE_ROUNDING * moment}

        def clear(values: Array, unit: str) -> Array:
            return np.where(np.abs(values) <= least.get(unit, 0.0), 0.0, values)

        friction = clear(self.friction.moment, FORCE if self.poses.linkage.sliding else COUPLE)
        return self._replace(
            actions={name: clear(values, unit) for name, unit, values in self._drives()},
            components={
                name: {part: clear(values, self.units[name][part]) for part, values in parts.items()}
                for name, parts in self.components.items()
            },
            forces={name: clear(values, FORCE) for name, values in self.forces.items()},
            friction=self.friction._replace(moment=friction),
        )

    def pulling(self) -> dict[str, Array]:
        """Positions (rad or m) of the driver at which a cam would have to pull its follower, by coupling."""
        cams = [coupling.name for coupling in self.poses.linkage.couplings if coupling.kind == CAM]
        pulled = {name: self.poses.q[self.components[name]["normal"] < 0] for name in cams}
        return {name: at for name, at in pulled.items() if at.size}

    def columns(self) -> Iterator[tuple[str, str, Array]]:
        """Name, unit and values of every column of the table: the driver's coordinate, driving actions, joints."""
        yield (*self.coordinate, self.poses.q)
        for name, unit, action in self._drives():
            yield f"{name}.{DRIVE}", unit, action
        for name in self.components:
            for part, unit, values in self._parts(name):
                yield f"{name}.{part}", unit, values

    def _drives(self) -> Iterator[tuple[str, str, Array]]:
        for name, action in self.actions.items():
            yield name, COUPLE if self.poses.linkage.joint(name).kind == PIN else FORCE, action

    def _parts(self, joint: str) -> Iterator[tuple[str, str, Array]]:
        for part, values in self.components[joint].items():
            yield part, self.units[joint][part], values
        yield "resultant", FORCE, self.resultant(joint)

    def csv(self) -> str:
        """The table as comma-separated values in full precision; unknown values are empty."""
        names, units, values = zip(*self.columns(), strict=True)
        header = ",".join(f"{name} ({unit})" for name, unit in zip(names, units, strict=True))
        rows = (",".join("" if np.isnan(v) else repr(float(v)) for v in row) for row in zip(*values, strict=True))
        return "\n".join((header, *rows)) + "\n"

    def table(self, dense: Reactions | None = None) -> str:
        """A block of lines for every joint: its components and resultant at every position, then its largest force.

        dense: the same at more positions, over which the largest forces are then taken.
        """
        blocks, position = [], (*self.coordinate, self.poses.q)
        parts = [("driving action", self._drives()), *((name, self._parts(name)) for name in self.components)]
        for title, others in parts:
            names, units, values = zip(position, *others, strict=True)
            header = [f"{name} ({unit})" for name, unit in zip(names, units, strict=True)]
            rows = [["none" if np.isnan(v) else f"{float(v):.6g}" for v in row] for row in zip(*values, strict=True)]
            blocks.append("\n".join((title, *columns(rows, header))))
        unit = self.coordinate[1]
        worst = [f"  {e.joint}: {e.force:.6g} N at {e.at:.6g} {unit}" for e in (dense or self).extremes()]
        if worst:
            blocks.append("\n".join(("largest forces" if dense else "largest forces of these positions", *worst)))
        if self.undetermined:
            blocks.append(f"left open by redundant constraints: {', '.join(self.undetermined)}")
        return "\n\n".join((*blocks, *self.findings())) + "\n"

    def findings(self) -> Iterator[str]:
        """Sentences on the positions at which a cam lifts off, and at which friction locks."""
        unit = self.coordinate[1]
        for name, at in self.pulling().items():
            where = f"{at.size} of {self.poses.q.size} positions, from {at[0]:.6g} {unit}"
            yield f"{name} would have to pull at {where}: it lifts off"
        if self.locked.size:
            yield f"friction locks at {', '.join(f'{at:.6g}' for at in self.locked)} {unit}"


def reactions(
    source: Linkage | Solution,
    q: ArrayLike,
    speed: ArrayLike,
    acceleration: ArrayLike = 0.0,
    *,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """Driving action and all reactions of a linkage where its driver stands at q and moves at a given speed.

    For every body sum F = m a_G and sum M_G = J alpha, with a = g qddot + g' qdot²; all reactions and the driving action are
    the unknowns of one linear system a position. Friction and inclined teeth, which follow the reactions' own sizes, are
    iterated.

    Args:
        source: a linkage, or one that was followed (`flywheel.linkage.solve`).
        q: driver's coordinates, rad (m where it slides), shape (n,).
        speed: its rate, rad/s or m/s: a number or shape (n,). Friction opposes the motion of this sign; none at rest.
        acceleration: rad/s² or m/s²: a number or shape (n,).
        gravity: (gx, gy) in m/s²; no weights if None.
        loads: forces and torques on bodies, efforts along joints; numbers or arrays of shape (n,).
        inertia: False leaves the inertia forces out (quasi-static analysis).
        friction: False leaves Coulomb's friction out.

    Raises:
        SceneError: if the linkage is not valid, for loads that do not fit it, for friction that follows a reaction which
            redundant constraints leave open, for a position where the driver cannot move the other bodies.

    Valid for rigid bodies and joints without play. A joint's reaction acts from its first body on its second.

    >>> from flywheel.scene.linkage import Joint, Link, Linkage, Point
    >>> o, tip, end = Point("o"), Point("tip", 3.0), Point("end", 5.0)
    >>> links = Link("crank", (o, tip)), Link("rod", (o, end), guess=-0.6), Link("slider", (o,))
    >>> joints = (Joint("pivot", "pin", "frame", "crank", o, o), Joint("crank_pin", "pin", "crank", "rod", tip, o),
    ...           Joint("slider_pin", "pin", "rod", "slider", end, o), Joint("guide", "slide", "frame", "slider", o, o))
    >>> machine = Linkage(Link("frame", (o,)), links, joints, "pivot", start=1.5707963267948966)
    >>> forces = reactions(machine, [1.5707963267948966], 10.0, loads=[Force("slider", "o", x=-100.0)])
    >>> forces.action.round(9).tolist(), forces.components["guide"]["normal"].round(9).tolist()
    ([-300.0], [75.0])

    """
    from flywheel.mechanisms.linkages.positions import Solution, solve_over

    require("source", source, (Linkage, Solution), "a Linkage, or a Solution")
    coordinates = _row("q", q)
    solution = solve_over(source, coordinates) if isinstance(source, Linkage) else source
    poses = solution.poses(coordinates)
    return reactions_at(poses, speed, acceleration, gravity=gravity, loads=loads, inertia=inertia, friction=friction)


def reactions_at(
    poses: Poses,
    speed: ArrayLike,
    acceleration: ArrayLike = 0.0,
    *,
    drivers: Iterable[str] = (),
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """Reactions as `reactions` gives them, for known poses.

    drivers: names of the driven joints, where they are not the linkage's one driver.
    """
    require("poses", poses, Poses, "Poses")
    motion = values_at(speed, poses.q, "speed"), values_at(acceleration, poses.q, "acceleration")
    outer = applied(poses, loads)
    if gravity is not None:
        outer = outer + weights(poses, gravity)
    if inertia:
        outer = outer + inertial(poses, *motion)
    driven = tuple(drivers) or (poses.linkage.driver,)
    if isinstance(drivers, str):
        raise SceneError([Fault("drivers", brief(drivers), "a list of joints' names")])
    for k, name in enumerate(driven):
        entry(f"drivers[{k}]", name, {joint.name: joint for joint in poses.linkage.joints})
    parts = unknowns(poses, driven, np.sign(motion[0]), friction)
    return _named(poses, motion, parts, balance(poses, parts, outer))


def _named(poses: Poses, motion: tuple[Array, Array], unknowns: Unknowns, balance: ReactionBalance) -> Reactions:
    """Results by the names of joints and components; frictions of a joint add up, a shoe's normals follow from N and M."""
    amounts = np.where(balance.sizes.converged, balance.amounts, np.nan)
    certain = np.where(balance.loose, np.nan, balance.values)
    every: tuple[Component | Passive, ...] = (*unknowns.components, *unknowns.passives)
    actions: dict[str, Array] = {}
    forces: dict[str, Array] = {}
    components: dict[str, dict[str, Array]] = {}
    units: dict[str, dict[str, str]] = {}
    for part, amount in zip(every, (*certain, *amounts), strict=True):
        if part.name == DRIVE:
            actions[part.joint] = amount
            continue
        own = components.setdefault(part.joint, {})
        own[part.name] = own.get(part.name, 0.0) + amount
        units.setdefault(part.joint, {})[part.name] = part.unit
        if part.unit == FORCE or part.joint not in forces:  # a belt's couple has no force
            forces[part.joint] = forces.get(part.joint, 0.0) + part.pair.force * amount
    for joint in poses.linkage.joints:
        own = components[joint.name]
        for end, form in shoe_ends(joint).items():
            own[end] = sum((weight * own[part] for part, weight in form.items()), np.zeros(poses.q.shape))
            units[joint.name][end] = FORCE
    names = [(component.joint, component.name) for component in unknowns.components]
    for k, (owner, name) in enumerate(names):
        if name == "x" and balance.loose[k : k + 2].all():  # what may be added to x and y lies in one direction, or in both
            free = balance.open[:, k : k + 2]
            spread, axes = np.linalg.eigh(free @ free.transpose(0, 2, 1))
            across = axes[:, :, 0].T * np.where(axes[:, 1, 0] < 0, -1.0, 1.0)
            determinate = np.sqrt(np.maximum(spread[:, 0], 0.0)) <= OPEN
            if determinate.any():
                force = np.einsum("in,in->n", across, balance.values[k : k + 2])
                components[owner]["known"] = np.where(determinate, force, np.nan)
                components[owner]["known_angle"] = np.where(determinate, np.arctan2(across[1], across[0]), np.nan)
                units[owner] |= {"known": FORCE, "known_angle": "rad"}
    return Reactions(
        poses,
        *motion,
        actions=actions,
        components=components,
        units=units,
        forces=forces,
        undetermined=tuple(f"{owner}.{name}" for (owner, name), at in zip(names, balance.loose, strict=True) if at.any()),
        friction=friction_power(poses, unknowns.passives, amounts, balance.sizes),
        others=balance.others,
        residual=balance.residual,
        coordinate=(poses.linkage.driver, "m" if poses.linkage.sliding else "rad"),
    )


def _row(path: str, values: ArrayLike) -> Array:
    """A number or a row of them, as an array (n,)."""
    row = np.atleast_1d(array(path, values))
    if row.ndim > 1 or not row.size:
        what = f"an array of shape {row.shape}" if row.size else "no position"
        raise SceneError([Fault(path, what, "a number or an array of shape (n,)")])
    return row


# -- virtual power: one constraint released at a time ------------------------------------------------------------------


def virtual_power(reactions: Reactions) -> dict[str, dict[str, Array]]:
    """Every component of every reaction, and every driving action as `drive`, by the release of one constraint at a time.

    x_k = -(sum of F · v_G + M omega over all bodies), v and omega being the influence coefficients of the released motion
    and F, M the loads, weights, inertia and friction forces in `reactions.others`. NaN if a release sets nothing free:
    the constraint is redundant there.

    Released, the mechanism has one more degree of freedom; with the driver held, its motion follows from the constraints'
    Jacobian, the released row set to 1 and all others to 0. The rows share nothing with the equations of Newton and Euler
    but the places where couplings touch.
    """
    require("reactions", reactions, Reactions, "Reactions, as `kinetostatics.reactions` finds them")
    poses, others = reactions.poses, reactions.others
    rows = constraints(poses, reactions.actions)
    jacobian = np.stack([row[1:].reshape(-1, poses.q.size) for row in rows.values()]).transpose(2, 0, 1)
    one = np.broadcast_to(np.eye(len(rows)), (len(jacobian), len(rows), len(rows)))
    if jacobian.shape[1] == jacobian.shape[2]:
        motions = solved(jacobian, one)
    else:
        motions = np.asarray(np.linalg.pinv(jacobian), dtype=float)
        astray = np.abs(jacobian @ motions - one).max(axis=1, keepdims=True)
        motions = np.where(astray < _FOLLOWS, motions, np.nan)
    arms = centres(poses).value[:, :2] - poses.value[:, :2]  # of the wrenches about the origins of the bodies' frames
    moments = others[:, 2] + arms[:, 0] * others[:, 1] - arms[:, 1] * others[:, 0]
    work = np.stack((others[:, 0], others[:, 1], moments), axis=1)[1:].reshape(-1, poses.q.size)
    powers = -np.einsum("nrk,rn->kn", motions, work)
    components: dict[str, dict[str, Array]] = {}
    for (joint, name), power in zip(rows, powers, strict=True):
        components.setdefault(joint, {})[name] = power
    return components


def constraints(poses: Poses, drivers: Iterable[str]) -> dict[tuple[str, str], Array]:
    """The constraints' Jacobian in the velocities (x', y', theta') of the bodies' origins, by joint and component.

    Each row has shape (bodies, 3, n). A joint's are velocities of second's point less first's, which is its own point or,
    sliding, where second's is; a coupling's is the speed at which the two surfaces separate at their contact, along the
    force there.
    """
    linkage = poses.linkage
    still, unit = np.zeros(poses.q.shape), np.ones(poses.q.shape)

    def apart(first: int, start: Array, second: int, end: Array, axis: Array) -> Array:
        """Velocity along an axis at a place of the second body less that at a place of the first."""
        row = np.zeros_like(poses.value)
        for sign, body, place in ((-1.0, first, start), (1.0, second, end)):
            row[body, :2] += sign * axis
            row[body, 2] += sign * (perp(place - poses.value[body, :2]) * axis).sum(axis=0)
        return row

    def turned(first: int, second: int) -> Array:
        """Rate at which a body turns against another."""
        row = np.zeros_like(poses.value)
        row[first, 2], row[second, 2] = -1.0, 1.0
        return row

    def parts(joint: Joint) -> dict[str, Array]:
        """All that a joint may keep or drive, its coordinate's rate as `drive`."""
        first, second = index(poses, joint.first), index(poses, joint.second)
        start, end = poses.point(joint.first, joint.first_at).value, poses.point(joint.second, joint.second_at).value
        turn = turned(first, second)
        components = {"moment": turn, DRIVE: turn}
        if joint.kind in (PIN, FIXED):
            axes = {"x": np.stack((unit, still)), "y": np.stack((still, unit))}
            return {name: apart(first, start, second, end, axis) for name, axis in axes.items()} | components
        way = guide(poses, joint)
        components[DRIVE] = apart(first, end, second, end, way)
        return {"normal": apart(first, end, second, end, perp(way))} | components

    kept = {PIN: ("x", "y"), SLIDE: ("normal", "moment"), SLOT: ("normal",), FIXED: ("x", "y", "moment")}
    jacobian: dict[tuple[str, str], Array] = {}
    for joint in linkage.joints:
        rows = parts(joint)
        jacobian |= {(joint.name, name): rows[name] for name in kept[joint.kind]}
    for coupling in linkage.couplings:
        touch = contact(poses, coupling)
        if touch.couple is not None:
            jacobian[coupling.name, "moment"] = turned(touch.first, touch.second)
            continue
        name = "normal" if coupling.kind == CAM else "tangential"
        jacobian[coupling.name, name] = apart(touch.first, touch.at, touch.second, touch.at, touch.push)
    return jacobian | {(name, DRIVE): parts(linkage.joint(name))[DRIVE] for name in drivers}


# -- open chains ------------------------------------------------------------------------------------------------------


class Motion(NamedTuple):
    """A joint's coordinate over time (rad or m): value, speed, acceleration; numbers, or arrays of shape (n,)."""

    value: ArrayLike
    speed: ArrayLike = 0.0
    acceleration: ArrayLike = 0.0


def chain_poses(linkage: Linkage, motions: Mapping[str, Motion], time: ArrayLike) -> Poses:
    """Poses of an open chain whose joints all move as prescribed, with q = time (s): g is velocity, g' acceleration.

    Args:
        linkage: bodies and joints without closed loops or couplings; its `driver` is one of the driven joints.
        motions: the motion of every pin and slide, by its name.
        time: instants (s) that the motions' arrays belong to, shape (n,).

    Raises:
        SceneError: for a loop, a coupling, a joint without motion or a motion without joint.

    >>> from flywheel.scene.linkage import Link, Point
    >>> o = Point("o")
    >>> mast = Linkage(Link("frame", (o,)), (Link("mast", (o,)),), (Joint("foot", PIN, "frame", "mast", o, o),), "foot")
    >>> poses = chain_poses(mast, {"foot": Motion(0.0, 2.0)}, 0.0)
    >>> poses.point("mast", (3.0, 0.0)).slope.tolist()
    [[-12.0], [0.0]]

    """
    instants = np.atleast_1d(np.asarray(time, dtype=float)).ravel()
    path, driven = linkage.path, [joint.name for joint in linkage.joints if joint.kind != FIXED]
    slots = [joint.name for joint in linkage.joints if joint.kind == SLOT]
    faults = [Fault(f"{path}.joints.{name}", "a pin in a slot", "pins and slides") for name in slots]
    missing, unknown = sorted(set(driven) - set(motions)), sorted(set(motions) - set(driven))
    faults += [Fault(f"{path}.joints.{name}", "no motion", "one for every pin and slide") for name in missing]
    faults += [Fault(f"motions.{name}", "no pin or slide of that name", "a joint") for name in unknown]
    faults += [Fault(f"{path}.couplings", coupling.name, "none in an open chain") for coupling in linkage.couplings]
    if len(linkage.joints) != len(linkage.links):
        defect = f"{len(linkage.joints)} joints of {len(linkage.links)} bodies"
        faults.append(Fault(f"{path}.joints", defect, "one joint a body", "another joint closes a loop"))
    if faults:
        raise SceneError(faults)
    still = np.zeros(instants.size, dtype=complex)
    states = {FRAME: (np.array([still] * 3), np.zeros((3, instants.size)))}  # origin x + i y, angle: each with two rates
    left = list(linkage.joints)
    while left:
        reached = [joint for joint in left if (joint.first in states) != (joint.second in states)]
        if not reached:
            raise SceneError([Fault(path, f"a loop or loose bodies at joint {left[0].name}", "an open chain")])
        joint = reached[0]
        left.remove(joint)
        motion = motions.get(joint.name, Motion(0.0))
        coordinates = np.array(
            [values_at(part, instants, f"motions.{joint.name}.{name}") for name, part in motion._asdict().items()]
        )
        outward = joint.first in states
        near, beyond = (joint.first, joint.second) if outward else (joint.second, joint.first)
        turn = coordinates if joint.kind == PIN else np.array([still.real + joint.angle, still.real, still.real])
        first = np.array([still + complex(joint.first_at.x, joint.first_at.y), still, still])
        second = np.array([still + complex(joint.second_at.x, joint.second_at.y), still, still])
        if joint.kind not in (PIN, FIXED):
            first = first + np.exp(1j * joint.direction) * coordinates
        origin, angle = states[near]
        ahead = angle + turn if outward else angle - turn
        here, there = (first, second) if outward else (second, first)
        states[beyond] = origin + _swept(angle, here) - _swept(ahead, there), ahead
    placed = [states[name] for name in linkage.names]
    value, rate, slope = np.stack([np.stack((origin.real, origin.imag, angle), axis=1) for origin, angle in placed], axis=1)
    return Poses(linkage, instants, value, rate, slope)


def _swept(angle: Array, local: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Place, velocity, acceleration of a point that moves in a body that turns, from the body's origin, (3, n).

    As complex numbers: z = u s with u = exp(i theta), z' = u (s' + i omega s), z'' = u (s'' + 2 i omega s' + (i alpha -
    omega²) s), the middle term being Coriolis'.
    """
    unit, omega, alpha = np.exp(1j * angle[0]), angle[1], angle[2]
    place, speed, bend = local
    second = bend + 2j * omega * speed + (1j * alpha - omega**2) * place
    return np.asarray(unit * np.array([place, speed + 1j * omega * place, second]))


def chain_reactions(
    linkage: Linkage,
    motions: Mapping[str, Motion],
    time: ArrayLike = 0.0,
    *,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """Reactions of an open chain in which every joint is driven: as many driving actions as degrees of freedom.

    Args:
        linkage: bodies and joints without loops; its own `driver` may be any of the joints.
        motions: by joint, its coordinate with speed and acceleration, numbers or shape (n,).
        time: instants (s), shape (n,).
        gravity: as in `reactions`.
        loads: as in `reactions`.
        inertia: as in `reactions`.
        friction: as in `reactions`.

    The driving actions stand in `actions`, by joint. Positions are by time: `poses.rate` holds velocities.

    >>> from flywheel.scene.linkage import Joint, Link, Linkage, Point
    >>> o, tip = Point("o"), Point("tip", 0.5)
    >>> bars = [Link(name, (o, tip), mass=1.0, inertia=0.02, com=(0.25, 0.0)) for name in ("upper", "lower")]
    >>> pins = (Joint("shoulder", "pin", "frame", "upper", o, o), Joint("elbow", "pin", "upper", "lower", tip, o))
    >>> arm = Linkage(Link("frame", (o,)), tuple(bars), pins, "shoulder")
    >>> forces = chain_reactions(arm, {"shoulder": Motion(0.0), "elbow": Motion(0.0)}, gravity=(0.0, -10.0))
    >>> {name: round(float(action[0]), 12) for name, action in forces.actions.items()}
    {'shoulder': 10.0, 'elbow': 2.5}

    """
    check(linkage)
    require("motions", motions, Mapping, "a table of Motion by joint")
    for name, motion in motions.items():
        require(f"motions.{name}", motion, Motion, "a Motion")
    poses = chain_poses(linkage, motions, _row("time", time))
    drivers = [joint.name for joint in linkage.joints if joint.name in motions]
    options = {"inertia": inertia, "friction": friction}
    forces = reactions_at(poses, 1.0, drivers=drivers, gravity=gravity, loads=loads, **options)
    return forces._replace(coordinate=("time", "s"))


def driving_actions(coefficients: Iterable[Poses], others: Array) -> tuple[Array, ...]:
    """Driving actions of g degrees of freedom by virtual power, from the influence coefficients of each.

    Q_i = -(sum of F · dv_G/dqdot_i + M domega/dqdot_i) over all bodies.

    Args:
        coefficients: for every degree of freedom, poses whose `rate` is the velocity of all bodies at unit speed of its
            coordinate, with all others fixed.
        others: wrenches of all loads, weights, inertia and friction forces, shape (bodies, 3, n), as in `Reactions.others`.

    Returns:
        an action for every coordinate, N m or N, shape (n,) each.

    """
    return tuple(np.asarray(-np.einsum("bin,bin->n", centres(poses).rate, others)) for poses in coefficients)
