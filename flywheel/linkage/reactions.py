"""Forces in a mechanism as a result: driving action, reaction of every joint, cost of friction, as data and as a table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.linkage.components import COUPLE, DRIVE, FORCE, FRICTION, Component, Passive, Unknowns, ends
from flywheel.linkage.description import CAM, PIN
from flywheel.linkage.poses import Poses
from flywheel.linkage.statics import OPEN, Balance
from flywheel.linkage.wrenches import centres, pace
from flywheel.writing.digits import columns

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ROUNDING = 1e-12  # of the largest force: smaller ones are none


class Friction(NamedTuple):
    """How friction was found, and what it costs.

    moment: its share of the reduced moment M* (N m; N where the driver slides): the driving action grows by -moment.
    iterations: Newton steps of the slowest position, 0 where nothing had to be iterated; gap: relative change that the
    last one left, (n,); converged: False where friction locks the mechanism, (n,): nothing is reported there.
    lever: what the moment comes to at most if every joint is pressed with 1 N, (n,), in m (1 where the driver slides).
    """

    moment: Array
    iterations: int
    gap: Array
    converged: Flags
    lever: Array


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
    rows = [[_cell(v) for v in row] for row in zip(first[2], *(values for _, _, values in rest), strict=True)]
    return "\n".join((title, *columns(rows, header)))


def _cell(value: float) -> str:
    return "none" if np.isnan(value) else f"{float(value):.6g}"


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
        friction=_friction(poses, unknowns, known, balance),
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


def _friction(poses: Poses, unknowns: Unknowns, known: Array, balance: Balance) -> Friction:
    """Friction's power by unit speed of the driver, and how the iteration went."""
    middle = centres(poses)
    moment, lever = np.zeros(poses.q.shape), np.zeros(poses.q.shape)
    for passive, amount in zip(unknowns.passives, known, strict=True):
        if passive.name == FRICTION:
            way = np.einsum("bin,bin->n", passive.pair.on_bodies(middle.value), middle.rate)
            moment, lever = moment + amount * way, lever + np.abs(passive.factor * way)
    settled = balance.settled
    return Friction(moment, settled.iterations, settled.gap, settled.converged, lever)
