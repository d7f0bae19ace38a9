"""Passive resistances: friction in the joints of linkages at the actual speed, with the reactions of the same instant.

The law is that of `mechanisms.linkages.statics`: Coulomb's, mu N or r R mu/sqrt(1 + mu²), against the motion of the joint.
In the direct problem the acceleration alpha is not known, and reactions and friction depend on it as it does on them. The
forces z_j that friction follows are linear in all that acts: with p the friction of all joints,

    z = z_0 + z_w omega + z_ww omega² + z_a alpha + z_L loads + Z p,     p_j = -c_j sign(g_j omega) |z_j|,
    sum over the parts of k (I alpha + ½ dI/dphi omega² - M) = sum k g_j p_j,

with g_j the rate of joint j by the crank's. Put into the first line, the second leaves |z| = |a + Q |z||, piecewise linear
(a pin's resultant aside), which is solved as in kinetostatics. All coefficients are functions of the driver's coordinate
alone: they are fitted once by series on cells, and evaluated together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Here
from flywheel.machine.machine import Anchor, Effort, Machine, spring_effort
from flywheel.machine.reactions import port_load, poses_of
from flywheel.mechanisms.linkage import followed
from flywheel.mechanisms.linkages.positions import Poses
from flywheel.mechanisms.linkages.statics import FRICTION, Passive, friction_sizes, response, size_forms, unknowns
from flywheel.mechanisms.linkages.wrenches import applied, centres, inertial, weights
from flywheel.numerics import cells
from flywheel.numerics.cells import Cells
from flywheel.scene.scene import Mechanism

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


Array = NDArray[np.float64]

BY_ONE, BY_SPEED, BY_SQUARE, BY_ACCELERATION = range(4)  # the first columns of a table of coefficients

_FINE = 1e-13  # of the largest coefficient of a column: error of a cell that is left as it is
_MOST_CELLS = 4000
_WIDEST = np.pi / 4  # of a cell to begin with, rad; of a stroke an eighth
_NOTHING = 1e-12  # of the largest: what is smaller is rounding
_SETTLED = 1e-15  # of the largest force: a change after which Newton's iteration stops
_SQUARED = 1e-9  # change after which one more step is the last
_LOST = 1e-9  # and what it must have come to
_LIMIT = 30
_NO_LENGTH = float(np.finfo(float).tiny)  # N, of a force that has no direction
_MOST_TRIED = 10  # forces with a sign, up to which all combinations of signs are tried
_PARALLEL = 1e-10  # sine of the angle between forces on one line
_APART = 1e-6  # of the largest force: solutions that differ by less are one
_SURE = 0.99  # norm of a map that certainly contracts


class Coefficients(NamedTuple):
    """What a mechanism's table gives at n positions.

    rows: of the forces that friction follows, by every input and every passive action, (n, forces, 2, inputs + forces);
    powers: of the inputs themselves by the crank's speed, (n, inputs); ways: rates of joints by the crank's, (n, forces).
    """

    rows: Array
    powers: Array
    ways: Array


class Acting(NamedTuple):
    """Inertia, its slope and the moment on the crank for each stage (n,), and the efforts of all loads by their paths."""

    inertia: list[Any]
    slope: list[Any]
    moment: list[Any]
    efforts: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Terms:
    """The forces z that friction follows at n instants, each (x, y) of a pin or (normal, 0), but for their signs.

    free: without friction and acceleration, (n, forces, 2); by_acceleration: for a unit of the crank's, (n, forces, 2);
    pull: for a unit of each passive action, (n, forces, 2, forces); ways: rate of the friction's joint by the crank's,
    (n, forces); known: of each mechanism its coefficients (n, forces, 2, inputs), its inputs (n, inputs), and which of its
    forces are resultants, (forces,).
    """

    free: Array
    by_acceleration: Array
    pull: Array
    ways: Array
    known: tuple[tuple[Array, Array, NDArray[np.bool_]], ...]

    @cached_property
    def scale(self) -> Array:
        """The largest of what adds up, N, (n,)."""
        largest = [np.abs(rows * inputs[:, None, None, :]).max(axis=(1, 2, 3)) for rows, inputs, _ in self.known]
        return np.asarray(np.max(largest, axis=0))

    @cached_property
    def lined(self) -> NDArray[np.bool_]:
        """Pins whose force keeps to a line whatever acts, so that it may pass zero (a rod without mass), (n, forces)."""
        return np.concatenate([_lined(rows) & curved for rows, _, curved in self.known], axis=1)


class Resisted(NamedTuple):
    """Passive actions (n, forces), the forces that they follow, with their signs, and 1 - Q on their branch.

    directions: of resultants in pins (rad), (n, forces).
    """

    amounts: Array
    sizes: Array
    matrix: Array
    directions: Array

    @property
    def determinant(self) -> Array:
        """det(1 - Q), (n,)."""
        return np.asarray(np.linalg.det(self.matrix))


class _Table(NamedTuple):
    """Coefficients of one mechanism's forces, by series on cells of the driver's coordinate: (cells, entries, order)."""

    mechanism: Mechanism
    ratio: float
    period: float | None
    mesh: Cells
    series: Array
    inputs: int
    passives: tuple[Passive, ...]
    strengths: Array
    curved: NDArray[np.bool_]
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


class PassiveResistances:
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

    @cached_property
    def rubbing(self) -> NDArray[np.bool_]:
        """Which passive actions are friction; the others are what inclined teeth add."""
        return np.array([one.name == FRICTION for table in self.tables for one in table.passives])

    def at(self, phi: Array) -> tuple[Coefficients, ...]:
        """The coefficients of every rough mechanism at crank angles (n,)."""
        return tuple(table.at(phi) for table in self.tables)

    @cached_property
    def complete(self) -> bool:
        """Whether the tables hold all mechanisms, so that they give the machine's inertia and moment as well."""
        scene = self.machine.scene
        loaded = [item for item in scene.springs if item.on in scene.shafts]
        return len(self.tables) == len(scene.mechanisms) and not loaded

    def acting(
        self,
        found: tuple[Coefficients, ...],
        phi: Array,
        anchor: Anchor,
        omega: Any,
        time: Any,
        unknown: float,
        left_out: Callable[[str], bool],
    ) -> Acting:
        """The equation of motion but for friction, where the tables are complete; without the loads `left_out`, by path."""
        scene, machine = self.machine.scene, self.machine
        stages = [stage.shaft for stage in machine.stages]
        inertia: list[Any] = [0.0] * len(stages)
        slope, moment = inertia.copy(), inertia.copy()
        efforts: dict[str, Any] = {}
        gains: dict[str, tuple[int, Any]] = {}
        for table, paths, own in zip(self.tables, self.paths, found, strict=True):
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
        for effort in machine.efforts:
            if left_out(effort.path):
                continue
            k, gain = gains.get(effort.path) or (self._stage(effort.load.on), scene.shafts[effort.load.on])
            motion = machine.motion_of(effort.load.on)
            rate = scene.shafts.get(motion.of, 1.0)
            q, q_anchor = rate * phi, rate * anchor.phi
            here = Here(q, motion.position(q, np, q_anchor), np, rate * omega, gain * omega, time)
            middle = Here(q_anchor, motion.position(q_anchor, np, q_anchor), np, rate * at_anchor, None, then)
            if "flow" in effort.sees or effort.uses_speed:
                middle = middle._replace(flow=self._gain(effort, anchor.phi) * at_anchor)
            value = effort(here, middle)
            if effort.depends_on_unknown:
                value = value + unknown * effort.per_unknown(here, middle)
            efforts[effort.path] = value
            moment[k] = moment[k] + gain * value
        return Acting(inertia, slope, moment, efforts)

    def _stage(self, shaft: str) -> int:
        """The number of the stage that a shaft belongs to."""
        names = [stage.shaft for stage in self.machine.stages]
        return names.index(self.machine.stage_of(shaft))

    def _gain(self, effort: Effort, phi: Any) -> Any:
        """Rate of a load's place by the crank's, at crank angles."""
        for table, paths in zip(self.tables, self.paths, strict=True):
            if effort.path in paths:
                powers = table.at(np.atleast_1d(np.asarray(phi, dtype=float))).powers
                return powers[:, BY_ACCELERATION + 1 + paths.index(effort.path)]
        return self.machine.scene.shafts[effort.load.on]

    def terms(self, found: tuple[Coefficients, ...], omega: Any, efforts: Mapping[str, Any], always: float = 1.0) -> Terms:
        """What the forces come to at positions (n,) and speeds, under efforts on ports by the paths of their loads.

        always: share of weights and springs.
        """
        parts, count = [], len(found[0].ways)
        for table, paths, own in zip(self.tables, self.paths, found, strict=True):
            inputs = np.zeros((count, table.inputs))
            inputs[:, BY_ONE], inputs[:, BY_SPEED], inputs[:, BY_SQUARE] = always, omega, omega * omega
            for k, path in enumerate(paths, start=BY_ACCELERATION + 1):
                inputs[:, k] = efforts.get(path, 0.0)
            known = own.rows[..., : table.inputs]
            free = np.einsum("npkc,nc->npk", known, inputs)
            all_known = ((known, inputs, table.curved),)
            parts.append(Terms(free, known[..., BY_ACCELERATION], own.rows[..., table.inputs :], own.ways, all_known))
        if len(parts) == 1:
            return parts[0]
        pull = np.zeros((count, self.curved.size, 2, self.curved.size))
        first = 0
        for part in parts:
            last = first + part.ways.shape[1]
            pull[:, first:last, :, first:last] = part.pull
            first = last
        names = ("free", "by_acceleration", "ways")
        free, by, ways = (np.concatenate([getattr(part, name) for part in parts], axis=1) for name in names)
        return Terms(free, by, pull, ways, tuple(one for part in parts for one in part.known))

    def sliding(self, ways: Array, sense: Any) -> Array:
        """Sign (n, forces) of each joint's motion where the crank moves in a sense (1, -1); 0 where it is at rest."""
        moving = np.abs(ways) > _NOTHING * self.rates
        return np.asarray(np.where(moving, np.sign(ways), 0.0) * np.asarray(sense)[..., None])

    def factors(self, sliding: Array) -> Array:
        """Passive action (n, forces) for a unit of the force that it follows."""
        return np.asarray(np.where(self.rubbing, -sliding, 1.0) * self.strengths)

    def resisted(
        self,
        terms: Terms,
        acceleration: Any,
        gains: Array,
        factors: Array,
        signs: Array | None = None,
        directions: Array | None = None,
    ) -> Resisted:
        """All passive actions, where the acceleration is `acceleration` without them and `gains` (n, forces) for each unit.

        signs, directions: of the forces with a sign, and of those in pins that keep to a line (rad, else NaN), (n, forces),
        as they are continued from an anchor; None where they are to be found: then NaN stands where friction leaves no
        motion.
        """
        alpha = np.asarray(acceleration, dtype=float).reshape(-1, 1, 1)
        free = terms.free + terms.by_acceleration * alpha
        pull = (terms.pull + terms.by_acceleration[..., None] * gains[:, None, None, :]) * factors[:, None, None, :]
        if signs is None or directions is None:
            return self._found(free, pull, factors)
        return self._continued(free, pull, factors, signs, directions)

    def _continued(self, free: Array, pull: Array, factors: Array, signs: Array, directions: Array) -> Resisted:
        """Linear where forces keep their signs; Newton's iteration for resultants, whose errors are squared each time."""
        one, bends, curved = np.eye(free.shape[1]), bool(self.curved.any()), self.curved
        along, across, pull_along, pull_across = free[..., 0], free[..., 1], pull[:, :, 0], pull[:, :, 1]
        x, y, length = along, across, np.hypot(along, across) if bends else across
        lined = bends and bool(np.isfinite(directions).any())
        cosine, sine = (np.cos(directions), np.sin(directions)) if lined else (directions, directions)
        unit, normal = signs, np.zeros_like(signs)
        gap, most = np.inf, 0.0
        for _ in range(_LIMIT):
            if bends:
                back = np.where(x * cosine + y * sine < 0.0, -1.0, 1.0) if lined else 1.0  # 1 where there is no line
                share = back / np.maximum(length, _NO_LENGTH)
                unit, normal = np.where(curved, x * share, signs), np.where(curved, y * share, 0.0)
            matrix = one - (unit[:, :, None] * pull_along + normal[:, :, None] * pull_across)
            size = _solution(matrix, unit * along + normal * across)
            if gap <= _SQUARED * most or not bends:
                gap = 0.0
                break
            x = along + (pull_along @ size[:, :, None])[..., 0]
            y = across + (pull_across @ size[:, :, None])[..., 0]
            length, sizes = np.hypot(x, y), np.abs(size)
            gap, most = float((np.abs(length - sizes) * curved).max()), float(sizes.max())
            if gap <= _SETTLED * most:
                break
        size = size if gap <= _LOST * most else np.full_like(size, np.nan)
        return Resisted(factors * size, np.where(curved, size, signs * size), matrix, directions)

    def _found(self, free: Array, pull: Array, factors: Array) -> Resisted:
        """The solution that grows out of the one without friction."""
        count, forces = free.shape[:2]
        forms = np.zeros((forces, 2, forces, 2))
        for k in range(2):
            forms[np.arange(forces), k, np.arange(forces), k] = 1.0
        flat = free.reshape(count, -1), pull.reshape(count, 2 * forces, forces)
        found = friction_sizes(*flat, np.ones_like(factors), forms.reshape(forces, 2, -1))
        sizes = np.where(found.converged[:, None], found.sizes, np.nan)
        parts = free + np.einsum("npkj,nj->npk", pull, sizes)
        signed = np.where(self.curved, sizes, parts[..., 0])
        directions = np.arctan2(parts[..., 1], parts[..., 0])
        matrix = np.where(found.converged, 1.0, np.nan)[:, None, None]
        return Resisted(factors * sizes, signed, matrix, directions)

    def solutions(self, terms: Terms, acceleration: Any, gains: Array, factors: Array) -> tuple[int, str]:
        """How many motions there are at one instant, and which joint makes it so that there is none, or more than one.

        Friction leaves none or several where it is large (Painlevé's paradox).
        """
        free = terms.free + terms.by_acceleration * acceleration
        pull = (terms.pull + terms.by_acceleration[..., None] * gains[:, None, None, :]) * factors[:, None, None, :]
        bound = np.hypot(pull[0, :, 0], pull[0, :, 1])
        if not np.isfinite(bound).all():
            return 0, self.labels[0]
        values, vectors = np.linalg.eig(bound)
        if np.abs(values).max(initial=0.0) < _SURE:  # a contraction in some norm
            return 1, ""
        joint = self.labels[int((np.abs(vectors[:, np.abs(values).argmax()]) * self.rubbing).argmax())]
        flat = np.flatnonzero(~self.curved & (np.abs(bound).max(axis=1) > 0.0))
        if flat.size > _MOST_TRIED:
            return 1, joint
        found: list[Array] = []
        for tried in product((1.0, -1.0), repeat=flat.size):
            signs = np.ones((1, self.curved.size))
            signs[0, flat] = tried
            sizes = self._continued(free, pull, np.ones_like(factors), signs, np.full_like(signs, np.nan)).amounts[0]
            most = np.abs(sizes).max()
            holds = bool(np.isfinite(most) and (sizes >= -_NOTHING * most).all())
            if holds and all(np.abs(sizes - other).max() > _APART * most for other in found):
                found.append(sizes)
        return len(found), joint


def _lined(known: Array) -> NDArray[np.bool_]:
    """Whether forces keep to one line (n, forces) whatever acts: their coefficients (n, forces, 2, inputs) are parallel."""
    largest = np.abs(known).max(axis=(1, 2), keepdims=True)
    shares = np.divide(known, largest, out=np.zeros_like(known), where=largest > 0.0)
    length = np.hypot(shares[:, :, 0], shares[:, :, 1])
    first = np.take_along_axis(shares, length.argmax(axis=2)[:, :, None, None], axis=3)
    across = np.abs(shares[:, :, 0] * first[:, :, 1] - shares[:, :, 1] * first[:, :, 0])
    return np.asarray((across <= _PARALLEL * length.max(axis=2, keepdims=True) ** 2).all(axis=2))


def _solution(matrix: Array, right: Array) -> Array:
    """Solutions of n systems; NaN where they are singular."""
    try:
        return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0])
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)


# -- coefficients ------------------------------------------------------------------------------------------------------


def _fitted(machine: Machine, mechanism: Mechanism) -> _Table:
    """The table of one mechanism, on cells that are halved until its series follow it."""
    ratio = machine.scene.shafts[mechanism.shaft]
    cycle = followed(mechanism)
    low, high = (0.0, cycle.period) if cycle.period is not None else (cycle.solution.low, cycle.solution.high)
    widest = _WIDEST if cycle.period is not None else (high - low) / 8
    inner = [at for at in machine.corners_of(mechanism) if low < at < high]
    edges = np.unique(np.concatenate((np.linspace(low, high, int(np.ceil((high - low) / widest)) + 1), inner)))
    first, passives = _coefficients(machine, mechanism, 0.5 * (edges[1:] + edges[:-1]))  # where joints move
    inputs = first.powers.shape[1]

    def values(psi: Array) -> tuple[Array, Array]:
        """All entries (entries, n), and the size of each one's column, (entries,)."""
        found, _ = _coefficients(machine, mechanism, psi)
        largest = np.abs(found.rows).max(axis=(0, 1, 2))
        scale = np.broadcast_to(largest, found.rows.shape[1:]).ravel()
        rates = np.abs(found.ways).max(axis=0, initial=0.0)
        kinds = np.array([one.unit for one in passives])
        speeds = np.array([rates[kinds == unit].max() for unit in kinds])
        entries = np.concatenate((found.rows.reshape(psi.size, -1), found.powers, found.ways), axis=1).T
        powers = np.abs(found.powers).max(axis=0)
        return entries, np.concatenate((scale, powers, speeds))

    def evaluated(edges: Array) -> tuple[tuple[Cells, Array, Array], float, cells.Coarse]:
        mesh = cells.cells(edges)
        entries, sizes = values(mesh.phi.ravel())
        series = cells.fit(entries.reshape(-1, *mesh.phi.shape))
        share = np.divide(cells.tails(series), sizes[:, None], out=np.zeros(series.shape[:2]), where=sizes[:, None] > 0.0)
        worst = share.max(axis=0)
        return (mesh, series, sizes), float(worst.max()), lambda _: worst > _FINE

    mesh, series, sizes = cells.refined(edges, evaluated, _FINE, _MOST_CELLS)
    series[np.abs(series).sum(axis=2).max(axis=1) <= _NOTHING * sizes] = 0.0  # what is nothing but rounding
    error = float(np.divide(cells.tails(series).max(axis=1), sizes, out=np.zeros_like(sizes), where=sizes > 0.0).max())
    rates = ratio * sizes[-len(passives) :]
    still = np.abs(series[-len(passives) :]).sum(axis=(1, 2)) == 0.0
    rubs = np.array([one.name == FRICTION for one in passives])
    strengths = np.array([float(np.abs(one.factor).max()) for one in passives])
    return _Table(
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


def _coefficients(machine: Machine, mechanism: Mechanism, psi: Array) -> tuple[Coefficients, tuple[Passive, ...]]:
    """Coefficients at n positions of the driver, by Newton's and Euler's equations of all bodies with one load alone.

    Powers and ways are by the driver's coordinate.
    """
    poses = poses_of(mechanism, psi)
    parts = unknowns(poses, (poses.linkage.driver,), np.ones(psi.size), friction=True)
    loads = np.stack(list(_loads(machine, mechanism, poses, psi)))
    found = response(poses, parts, loads)
    rows = np.einsum("pkm,nmc->npkc", size_forms(poses, parts, found.loose), found.values)
    middle = centres(poses)
    powers = np.einsum("cbin,bin->nc", loads, middle.rate)
    wrenches = [one.pair.on_bodies(middle.value) * (one.name == FRICTION) for one in parts.passives]
    return Coefficients(rows, powers, np.einsum("pbin,bin->np", np.stack(wrenches), middle.rate)), parts.passives


def _loads(machine: Machine, mechanism: Mechanism, poses: Poses, psi: Array) -> Iterator[Array]:
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
