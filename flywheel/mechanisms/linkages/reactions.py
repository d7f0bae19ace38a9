"""Kinetostatics: driving actions and reactions of every joint of a plane linkage, for a motion that is given.

The result is `Reactions`: forces and the cost of friction, as data and as a table.

Reactions by virtual power: release one constraint, let the mechanism move by it alone, and add up everyone's power.

Released, the mechanism has one more degree of freedom; with the driver held, its motion V follows from the constraints'
Jacobian, the released row set to 1 and all others to 0. The reaction is then minus the power of all other forces. The rows
are written as velocities of the joints' own points, in the velocities of the bodies' origins, and share nothing with the
equations of Newton and Euler but the places where couplings touch.

Open chains: as many driven joints as degrees of freedom, each moved as its user prescribes.

Two routes: Newton's and Euler's equations of all bodies at once (`reactions`), and virtual power with one constraint
released at a time (`virtual_power`). With the inertia left out the analysis is quasi-static.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.linkages.equations import check, solved
from flywheel.mechanisms.linkages.friction import COUPLE, FORCE, Friction, Passive, cost, ends
from flywheel.mechanisms.linkages.positions import Poses
from flywheel.mechanisms.linkages.wrenches import (
    DRIVE,
    OPEN,
    Balance,
    Component,
    Effort,
    Force,
    Load,
    Torque,
    Unknowns,
    applied,
    centres,
    contact,
    direction,
    guide,
    inertial,
    pace,
    perp,
    unknowns,
    weights,
)
from flywheel.mechanisms.linkages.wrenches import solve as balance
from flywheel.mechanisms.linkages.wrenches import (
    values as values_at,
)
from flywheel.numerics.arguments import array, known, require, shown
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import columns
from flywheel.scene.linkage import CAM, FIXED, FRAME, PIN, SLIDE, SLOT, Coupling, Joint, Linkage, Point

if TYPE_CHECKING:
    from flywheel.mechanisms.linkages.positions import Solution


Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ROUNDING = 1e-12  # of the largest force: smaller ones are none


class Extreme(NamedTuple):
    """The largest force (N) in a joint, or at an end of its shoe (`joint.front`), and where the driver stands (rad or m)."""

    joint: str
    force: float
    at: float


class Reactions(NamedTuple):
    """Forces in a linkage at n positions: what the first body of each joint does to its second.

    speed, acceleration: of the driver's coordinate, shape (n,).
    actions: driving action of each driven joint by its name (N m in a pin, N in a slide).
    components: by joint or coupling, then by component: `x`, `y`, `normal`, `moment`, `front`, `rear`, `tangential`,
        `radial`, `friction`; see `flywheel.linkage.components`. NaN where redundant constraints leave one open, or where
        friction locks; then `known` is a pin's force in the direction `known_angle` (rad), if there is one that stays known.
    units: of the components, by the same names.
    forces: the whole force of each joint or coupling in the frame's axes, friction included, shape (2, n).
    undetermined: names `joint.component` of those that redundant constraints leave open.
    others: wrenches of everything but reactions and driving actions (loads, weights, inertia, friction), (bodies, 3, n).
    residual: of Newton's and Euler's equations, as a share of the largest load, (n,).
    coordinate: name and unit of what `poses.q` holds: the driver's, or time in an open chain.
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
        each = [action * pace(self.poses, joint(name)) for name, action in self.actions.items()]
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
        found = []
        for name, size in self._sizes():
            if not np.isnan(size).all():
                worst = int(np.nanargmax(size))
                found.append(Extreme(name, float(size[worst]), float(self.poses.q[worst])))
        return tuple(found)

    def _sizes(self) -> Iterator[tuple[str, Array]]:
        for name in self.forces:
            yield name, self.resultant(name)
            parts = self.components[name]
            yield from ((f"{name}.{end}", np.abs(parts[end])) for end in ("front", "rear") if end in parts)

    def scales(self) -> tuple[float, float]:
        """The largest force (N), be it in a joint, a load, a weight or of inertia, and its moment (N m) over the whole size.

        Whatever is 1e-12 of these or less is rounding.
        """
        size = _extent(self.poses)
        by_unit = {FORCE: _largest(self.others[:, :2]), COUPLE: _largest(self.others[:, 2])}
        for _, unit, values in list(self.columns())[1:]:
            by_unit[unit] = max(by_unit.get(unit, 0.0), _largest(values))
        force = max(by_unit[FORCE], by_unit[COUPLE] / size if size else 0.0)
        return force, force * size or by_unit[COUPLE]

    def cleared(self, scales: tuple[float, float] | None = None) -> Reactions:
        """The same for reading: with 0 for forces and moments that are rounding beside `scales` (its own if None)."""
        force, moment = scales or self.scales()
        least = {FORCE: _ROUNDING * force, COUPLE: _ROUNDING * moment}
        units = {name: unit for name, unit, _ in self._drives()}
        friction = FORCE if self.poses.linkage.sliding else COUPLE
        return self._replace(
            actions={name: _without(values, least[units[name]]) for name, values in self.actions.items()},
            components={
                name: {part: _without(values, least.get(self.units[name][part], 0.0)) for part, values in parts.items()}
                for name, parts in self.components.items()
            },
            forces={name: _without(values, least[FORCE]) for name, values in self.forces.items()},
            friction=self.friction._replace(moment=_without(self.friction.moment, least[friction])),
        )

    def pulling(self) -> dict[str, Array]:
        """Positions (rad or m) of the driver at which a cam would have to pull its follower, by coupling."""
        found = {}
        for coupling in self.poses.linkage.couplings:
            if coupling.kind == CAM and np.any(self.components[coupling.name]["normal"] < 0):
                found[coupling.name] = self.poses.q[self.components[coupling.name]["normal"] < 0]
        return found

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
        """The table as comma-separated values in full precision; nothing stands where nothing is known."""
        names, units, values = zip(*self.columns(), strict=True)
        header = ",".join(f"{name} ({unit})" for name, unit in zip(names, units, strict=True))
        rows = (",".join("" if np.isnan(v) else repr(float(v)) for v in row) for row in zip(*values, strict=True))
        return "\n".join((header, *rows)) + "\n"

    def table(self, dense: Reactions | None = None) -> str:
        """A block of lines for every joint: its components and resultant at every position, then its largest force.

        dense: the same at more positions, over which the largest forces are then taken.
        """
        first = (*self.coordinate, self.poses.q)
        blocks = [_block("driving action", first, self._drives())]
        blocks += [_block(name, first, self._parts(name)) for name in self.components]
        return "\n\n".join((*blocks, *self._remarks(dense))) + "\n"

    def _remarks(self, dense: Reactions | None) -> Iterator[str]:
        unit = self.coordinate[1]
        worst = [f"  {e.joint}: {e.force:.6g} N at {e.at:.6g} {unit}" for e in (dense or self).extremes()]
        if worst:
            yield "\n".join(("largest forces" if dense else "largest forces of these positions", *worst))
        if self.undetermined:
            yield f"left open by redundant constraints: {', '.join(self.undetermined)}"
        for name, at in self.pulling().items():
            where = f"{at.size} of {self.poses.q.size} positions, from {at[0]:.6g} {unit}"
            yield f"{name} would have to pull at {where}: it lifts off"
        if self.locked.size:
            yield f"friction locks at {', '.join(f'{at:.6g}' for at in self.locked)} {unit}"


_Column = tuple[str, str, Array]
_Values = dict[str, dict[str, Array]]
_Units = dict[str, dict[str, str]]


def _block(title: str, first: _Column, others: Iterator[_Column]) -> str:
    rest = list(others)
    header = [f"{name} ({unit})" for name, unit, _ in (first, *rest)]
    rows = [
        [("none" if np.isnan(v) else f"{float(v):.6g}") for v in row]
        for row in zip(first[2], *(values for _, _, values in rest), strict=True)
    ]
    return "\n".join((title, *columns(rows, header)))


def _largest(values: Array) -> float:
    return float(np.nanmax(np.abs(values), initial=0.0))


def _extent(poses: Poses) -> float:
    """How large the linkage is (m): the ways between its bodies, or its longest body."""
    ways = np.ptp(poses.value[:, :2], axis=(0, 2)).max()
    arms = [np.hypot(point.x, point.y) for link in (poses.linkage.ground, *poses.linkage.links) for point in link.points]
    return float(max(ways, *arms, 0.0))


def _without(values: Array, least: float) -> Array:
    return np.where(np.abs(values) <= least, 0.0, values)


def collected(poses: Poses, motion: tuple[Array, Array], unknowns: Unknowns, balance: Balance) -> Reactions:
    """Results by the names of joints and components."""
    known = np.where(balance.settled.converged, balance.amounts, np.nan)
    certain = np.where(balance.loose, np.nan, balance.values)
    every: tuple[Component | Passive, ...] = (*unknowns.components, *unknowns.passives)
    amounts = [(part, amount) for part, amount in zip(every, (*certain, *known), strict=True) if part.name != DRIVE]
    forces: dict[str, Array] = {}
    for part, amount in amounts:
        if part.unit == FORCE:
            forces[part.joint] = forces.get(part.joint, 0.0) + part.pair.force * amount
    components, units = _named(poses, amounts)
    for owner, name, unit, value in _sure(unknowns, balance):
        components[owner][name], units[owner][name] = value, unit
    parted = list(zip(unknowns.components, certain, balance.loose, strict=True))
    return Reactions(
        poses,
        *motion,
        actions={part.joint: amount for part, amount, _ in parted if part.name == DRIVE},
        components=components,
        units=units,
        forces=forces,
        undetermined=tuple(f"{part.joint}.{part.name}" for part, _, loose in parted if np.any(loose)),
        friction=cost(unknowns.passives, known, balance.settled, centres(poses)),
        others=balance.others,
        residual=balance.residual,
        coordinate=(poses.linkage.driver, "m" if poses.linkage.sliding else "rad"),
    )


def _named(poses: Poses, amounts: Iterable[tuple[Component | Passive, Array]]) -> tuple[_Values, _Units]:
    """Components and their units by joint; frictions of one joint add up, a shoe's two normals follow from N and M."""
    found: _Values = {}
    units: _Units = {}
    for part, amount in amounts:
        own = found.setdefault(part.joint, {})
        own[part.name] = own.get(part.name, 0.0) + amount
        units.setdefault(part.joint, {})[part.name] = part.unit
    for joint in poses.linkage.joints:
        own = found[joint.name]
        for end, form in ends(joint).items():
            own[end] = sum((weight * own[part] for part, weight in form.items()), np.zeros(poses.q.shape))
            units[joint.name][end] = FORCE
    return found, units


def _sure(unknowns: Unknowns, balance: Balance) -> Iterator[tuple[str, str, str, Array]]:
    """Of pins whose x and y are both open, the direction (rad) in which the force is known all the same, and its part there.

    What may be added to x and y lies in one direction; across it nothing can be.
    """
    names = [(component.joint, component.name) for component in unknowns.components]
    for k, (joint, name) in enumerate(names):
        if name == "x" and balance.loose[k : k + 2].all():
            free = balance.open[:, k : k + 2]
            spread, axes = np.linalg.eigh(free @ free.transpose(0, 2, 1))
            across = axes[:, :, 0].T * np.where(axes[:, 1, 0] < 0, -1.0, 1.0)
            known = np.sqrt(np.maximum(spread[:, 0], 0.0)) <= OPEN
            if known.any():
                force = np.einsum("in,in->n", across, balance.values[k : k + 2])
                yield joint, "known", FORCE, np.where(known, force, np.nan)
                yield joint, "known_angle", "rad", np.where(known, np.arctan2(across[1], across[0]), np.nan)


# -- released ----------------------------------------------------------------------------------------------------------


Named = tuple[tuple[str, str], Array]  # (joint, component), row of shape (bodies, 3, n)

_FOLLOWS = 1e-8  # how well a released motion must respect all other constraints


def virtual_power(reactions: Reactions) -> dict[str, dict[str, Array]]:
    """Every component of every reaction, and every driving action as `drive`, by releasing one constraint at a time.

    x_k = -(sum of F · v_G + M omega over all bodies), v and omega being the influence coefficients of the released motion
    and F, M the loads, weights, inertia and friction forces in `reactions.others`. NaN where a release sets nothing free:
    the constraint is redundant there.
    """
    require("reactions", reactions, Reactions, "Reactions, as `kinetostatics.reactions` finds them")
    poses = reactions.poses
    named = rows(poses, reactions.actions)
    jacobian = np.stack([row[1:].reshape(-1, poses.q.size) for _, row in named]).transpose(2, 0, 1)
    motions = _motions(jacobian)
    work = _by_origins(poses, reactions.others)[1:].reshape(-1, poses.q.size)
    powers = -np.einsum("nrk,rn->kn", motions, work)
    found: dict[str, dict[str, Array]] = {}
    for ((joint, name), _), power in zip(named, powers, strict=True):
        found.setdefault(joint, {})[name] = power
    return found


def _motions(jacobian: Array) -> Array:
    """Columns: the motion that each constraint, released, sets free; NaN where it frees none. Shape (n, 3 bodies, rows)."""
    count, columns = jacobian.shape[1:]
    one = np.broadcast_to(np.eye(count), (len(jacobian), count, count))
    if count == columns:
        return solved(jacobian, one)
    motions = np.linalg.pinv(jacobian)
    astray = np.abs(jacobian @ motions - one).max(axis=1, keepdims=True)
    return np.where(astray < _FOLLOWS, motions, np.nan)


def _by_origins(poses: Poses, wrenches: Array) -> Array:
    """Wrenches about centres of mass moved to the origins of the bodies' frames."""
    arms = centres(poses).value[:, :2] - poses.value[:, :2]
    found = wrenches.copy()
    found[:, 2] += arms[:, 0] * wrenches[:, 1] - arms[:, 1] * wrenches[:, 0]
    return found


def rows(poses: Poses, drivers: Iterable[str]) -> list[Named]:
    """The constraints' Jacobian in the velocities (x', y', theta') of the bodies' origins, a row a component."""
    linkage = poses.linkage
    found = [named for joint in linkage.joints for named in _of_joint(poses, joint)]
    found += [_of_coupling(poses, coupling) for coupling in linkage.couplings]
    return [*found, *(((name, DRIVE), _coordinate(poses, linkage.joint(name))) for name in drivers)]


def _of_joint(poses: Poses, joint: Joint) -> list[Named]:
    turn = _turning(poses, joint)
    if joint.kind in (PIN, FIXED):
        still = np.zeros(poses.q.shape)
        axes = (("x", np.stack((still + 1.0, still))), ("y", np.stack((still, still + 1.0))))
        found: list[Named] = [((joint.name, name), _gap(poses, joint, axis, False)) for name, axis in axes]
        return found if joint.kind == PIN else [*found, ((joint.name, "moment"), turn)]
    normal: Named = (joint.name, "normal"), _gap(poses, joint, perp(guide(poses, joint)), True)
    return [normal, ((joint.name, "moment"), turn)] if joint.kind == SLIDE else [normal]


def _gap(poses: Poses, joint: Joint, axis: Array, sliding: bool) -> Array:
    """Velocity of second's point less first's along an axis; first's is at its own point or, sliding, where second's is."""
    names = poses.linkage.names
    end = poses.point(joint.second, joint.second_at).value
    start = end if sliding else poses.point(joint.first, joint.first_at).value
    return _apart(poses, (names.index(joint.first), start), (names.index(joint.second), end), axis)


def _apart(poses: Poses, first: tuple[int, Array], second: tuple[int, Array], axis: Array) -> Array:
    """Velocity along an axis at a place of the second body less that at a place of the first."""
    found = np.zeros_like(poses.value)
    for sign, (body, place) in ((-1.0, first), (1.0, second)):
        arm = perp(place - poses.value[body, :2])
        found[body, :2] += sign * axis
        found[body, 2] += sign * (arm * axis).sum(axis=0)
    return found


def _turning(poses: Poses, joint: Joint) -> Array:
    found = np.zeros_like(poses.value)
    found[poses.linkage.names.index(joint.first), 2] -= 1.0
    found[poses.linkage.names.index(joint.second), 2] += 1.0
    return found


def _coordinate(poses: Poses, joint: Joint) -> Array:
    """Rate of a joint's own coordinate."""
    return _turning(poses, joint) if joint.kind == PIN else _gap(poses, joint, guide(poses, joint), True)


def _of_coupling(poses: Poses, coupling: Coupling) -> Named:
    """How fast the two surfaces part at their contact, along the force between them."""
    touch = contact(poses, coupling)
    name = "normal" if coupling.kind == CAM else "tangential"
    return (coupling.name, name), _apart(poses, (touch.first, touch.at), (touch.second, touch.at), touch.push)


# -- chain -------------------------------------------------------------------------------------------------------------


class Motion(NamedTuple):
    """A joint's coordinate over time (rad or m): value, speed, acceleration; numbers, or arrays of shape (n,)."""

    value: ArrayLike
    speed: ArrayLike = 0.0
    acceleration: ArrayLike = 0.0


_State = tuple[Array, Array, Array]  # x, y, angle of a body's frame, shape (3, n): value, velocity, acceleration


def chain_poses(linkage: Linkage, motions: Mapping[str, Motion], time: ArrayLike) -> Poses:
    """Poses of an open chain whose joints all move as prescribed, with q = time (s): g is velocity, g' acceleration.

    Args:
        linkage: bodies and joints without closed loops or couplings; its `driver` is one of the driven joints.
        motions: the motion of every pin and slide, by its name.
        time: instants (s) that the motions' arrays belong to, shape (n,).

    Raises:
        SceneError: for a loop, a coupling, a joint without motion or a motion without joint.

    >>> from flywheel.scene.linkage import Link
    >>> o = Point("o")
    >>> mast = Linkage(Link("frame", (o,)), (Link("mast", (o,)),), (Joint("foot", PIN, "frame", "mast", o, o),), "foot")
    >>> poses = chain_poses(mast, {"foot": Motion(0.0, 2.0)}, 0.0)
    >>> poses.point("mast", (3.0, 0.0)).slope.tolist()
    [[-12.0], [0.0]]

    """
    instants = np.atleast_1d(np.asarray(time, dtype=float)).ravel()
    _check(linkage, motions)
    still = np.zeros((3, instants.size))
    states: dict[str, _State] = {FRAME: (still, still, still)}
    left = list(linkage.joints)
    while left:
        reached = [joint for joint in left if (joint.first in states) != (joint.second in states)]
        if not reached:
            raise SceneError([Fault(linkage.path, f"a loop or loose bodies at joint {left[0].name}", "an open chain")])
        joint = reached[0]
        left.remove(joint)
        motion = motions.get(joint.name, Motion(0.0))
        given = [values_at(part, instants, f"motions.{joint.name}.{name}") for name, part in motion._asdict().items()]
        _step(joint, states, given)
    found = [np.stack([states[name][k] for name in linkage.names]) for k in range(3)]
    return Poses(linkage, instants, found[0], found[1], found[2])


def _check(linkage: Linkage, motions: Mapping[str, Motion]) -> None:
    path = linkage.path
    free = {joint.name for joint in linkage.joints if joint.kind != FIXED}
    faults = [
        Fault(f"{path}.joints.{joint.name}", "a pin in a slot", "pins and slides")
        for joint in linkage.joints
        if joint.kind == SLOT
    ]
    faults += [
        Fault(f"{path}.joints.{name}", "no motion", "one for every pin and slide") for name in sorted(free - set(motions))
    ]
    faults += [Fault(f"motions.{name}", "no pin or slide of that name", "a joint") for name in sorted(set(motions) - free)]
    faults += [Fault(f"{path}.couplings", coupling.name, "none in an open chain") for coupling in linkage.couplings]
    if len(linkage.joints) != len(linkage.links):
        found = f"{len(linkage.joints)} joints of {len(linkage.links)} bodies"
        faults.append(Fault(f"{path}.joints", found, "one joint a body", "another joint closes a loop"))
    if faults:
        raise SceneError(faults)


def _step(joint: Joint, states: dict[str, _State], motion: list[Array]) -> None:
    """Place the body beyond a joint, whichever of the joint's two bodies it is."""
    outward = joint.first in states
    known, beyond = (joint.first, joint.second) if outward else (joint.second, joint.first)
    sense, still = (1.0 if outward else -1.0), np.zeros_like(motion[0])
    turns = motion if joint.kind == PIN else [still + joint.angle, still, still]
    angles = [part[2] + sense * turn for part, turn in zip(states[known], turns, strict=True)]
    loose = tuple(np.stack((still, still, angle)) for angle in angles)
    first, second = _local(joint.first_at, still), _local(joint.second_at, still)
    if joint.kind not in (PIN, FIXED):
        guide = np.array([np.cos(joint.direction), np.sin(joint.direction)])[:, None]
        first = [place + guide * part for place, part in zip(first, motion, strict=True)]
    near, far = (first, second) if outward else (second, first)
    spots, arms = _carried(states[known], near), _carried((loose[0], loose[1], loose[2]), far)
    placed = [np.vstack((spot - arm, angle)) for spot, arm, angle in zip(spots, arms, angles, strict=True)]
    states[beyond] = placed[0], placed[1], placed[2]


def _local(at: Point, still: Array) -> list[Array]:
    """A point at rest in its body's frame: place, velocity, acceleration there, each (2, n)."""
    return [np.stack((still + at.x, still + at.y)), np.stack((still, still)), np.stack((still, still))]


def _carried(body: _State, local: list[Array]) -> list[Array]:
    """Place, velocity, acceleration (2, n) of a point that moves in a moving body: with Coriolis' term 2 omega k × v."""
    unit = direction(body[0][2])
    arm, speed, bend = (part[0] * unit + part[1] * perp(unit) for part in local)
    omega, alpha = body[1][2], body[2][2]
    return [
        body[0][:2] + arm,
        body[1][:2] + omega * perp(arm) + speed,
        body[2][:2] + alpha * perp(arm) - omega**2 * arm + 2 * omega * perp(speed) + bend,
    ]


# -- kinetostatics -----------------------------------------------------------------------------------------------------


__all__ = [
    "Effort",
    "Extreme",
    "Force",
    "Friction",
    "Load",
    "Motion",
    "Reactions",
    "Torque",
    "chain_reactions",
    "driving_actions",
    "reactions",
    "reactions_at",
    "virtual_power",
]

Gravity = tuple[float, float] | None


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
        source: a linkage, or one that was followed (`flywheel.linkage.solution.solve`).
        q: driver's coordinates, rad (m where it slides), shape (n,).
        speed: its rate, rad/s or m/s: a number or shape (n,). Friction opposes the motion that its sign makes; none at rest.
        acceleration: rad/s² or m/s²: a number or shape (n,).
        gravity: (gx, gy) in m/s²; no weights if None.
        loads: forces and torques on bodies, efforts along joints; numbers or arrays of shape (n,).
        inertia: False leaves the inertia forces out (quasi-static analysis).
        friction: False leaves Coulomb's friction out.

    Raises:
        SceneError: for what a linkage is refused for, for loads that do not fit it, for friction that follows a reaction
            which redundant constraints leave open, for a position where the driver has no hold on the others.

    Valid for rigid bodies and joints without play. A joint's reaction is what its first body does to its second.

    >>> from flywheel.scene.linkage import Joint, Link, Linkage, Point
    >>> o, tip, end = Point("o"), Point("tip", 3.0), Point("end", 5.0)
    >>> links = Link("crank", (o, tip)), Link("rod", (o, end), guess=-0.6), Link("slider", (o,))
    >>> joints = (Joint("pivot", "pin", "frame", "crank", o, o), Joint("crank_pin", "pin", "crank", "rod", tip, o),
    ...           Joint("slider_pin", "pin", "rod", "slider", end, o), Joint("guide", "slide", "frame", "slider", o, o))
    >>> machine = Linkage(Link("frame", (o,)), links, joints, "pivot", start=1.5707963267948966)
    >>> found = reactions(machine, [1.5707963267948966], 10.0, loads=[Force("slider", "o", x=-100.0)])
    >>> found.action.round(9).tolist(), found.components["guide"]["normal"].round(9).tolist()
    ([-300.0], [75.0])

    """
    from flywheel.mechanisms.linkages.positions import Solution, solve_over

    require("source", source, (Linkage, Solution), "a Linkage, or a Solution")
    wanted = _row("q", q)
    solution = solve_over(source, wanted) if isinstance(source, Linkage) else source
    poses = solution.poses(wanted)
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
    """As `reactions`, for poses that are known.

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
        raise SceneError([Fault("drivers", shown(drivers), "a list of joints' names")])
    for k, name in enumerate(driven):
        known(f"drivers[{k}]", name, {joint.name: joint for joint in poses.linkage.joints})
    parts = unknowns(poses, driven, np.sign(motion[0]), friction)
    return collected(poses, motion, parts, balance(poses, parts, outer))


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
    """As many driving actions as degrees of freedom: an open chain in which every joint is driven, and moves as prescribed.

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
    >>> found = chain_reactions(arm, {"shoulder": Motion(0.0), "elbow": Motion(0.0)}, gravity=(0.0, -10.0))
    >>> {name: round(float(action[0]), 12) for name, action in found.actions.items()}
    {'shoulder': 10.0, 'elbow': 2.5}

    """
    check(linkage)
    require("motions", motions, Mapping, "a table of Motion by joint")
    for name, motion in motions.items():
        require(f"motions.{name}", motion, Motion, "a Motion")
    poses = chain_poses(linkage, motions, _row("time", time))
    drivers = [joint.name for joint in linkage.joints if joint.name in motions]
    options = {"inertia": inertia, "friction": friction}
    found = reactions_at(poses, 1.0, drivers=drivers, gravity=gravity, loads=loads, **options)
    return found._replace(coordinate=("time", "s"))


def _row(path: str, given: ArrayLike) -> Array:
    """A number or a row of them, as an array (n,)."""
    found = np.atleast_1d(array(path, given))
    if found.ndim > 1 or not found.size:
        what = f"an array of shape {found.shape}" if found.size else "no position"
        raise SceneError([Fault(path, what, "a number or an array of shape (n,)")])
    return found


def driving_actions(coefficients: Iterable[Poses], others: Array) -> tuple[Array, ...]:
    """Driving actions of g degrees of freedom by virtual power, from the influence coefficients of each.

    Q_i = -(sum of F · dv_G/dqdot_i + M domega/dqdot_i) over all bodies.

    Args:
        coefficients: for every degree of freedom, poses whose `rate` is what all bodies do at unit speed of its
            coordinate with all others held.
        others: wrenches of all loads, weights, inertia and friction forces, shape (bodies, 3, n), as in `Reactions.others`.

    Returns:
        an action for every coordinate, N m or N, shape (n,) each.

    """
    return tuple(np.asarray(-np.einsum("bin,bin->n", centres(poses).rate, others)) for poses in coefficients)
