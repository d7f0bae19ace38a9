"""The equation of motion of a machine with losses in its meshes: on a mesh of crank angles, and at instants of a motion.

A machine is its crank and parts in a tree, each on the crank or on another part through a mesh of an efficiency. With I of
a part and M on it, both reduced to the crank (angle phi, speed omega), what its mesh passes to it is

    tau = I alpha + ½ dI/dphi omega² - M + sum of k tau over the parts that hang on it,

alpha = domega/dt = d(omega²/2)/dphi, where the nearer side gives k = 1/efficiency for each N m that passes outwards, and
gets k = efficiency for each that comes back. Nothing passes to the crank itself. With K of a part, the product of k over
all meshes from the crank to it, alpha follows from

    sum over the parts of K (I alpha + ½ dI/dphi omega² - M) = 0.

`Moments` walks what depends on position alone once, on a whole mesh, and evaluates what depends on speed there as often as
wanted, with its slope: series and cells of the steady regime rest on it. `Dynamics` gives the same at any position, speed
and time, for stepping.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bondgraph import reduction as counting
from bondgraph.records import NamedTuple
from bondgraph.reduction import Station
from flywheel.machine.machine import Anchor, Machine, Stage
from flywheel.numerics import cells
from flywheel.numerics.cells import MIDDLE, ROUNDING, Cells, wide
from flywheel.numerics.jets import Jet
from flywheel.scene.scene import Scene

if TYPE_CHECKING:
    from bondgraph.recording import Program
    from flywheel.components.motors.circuit import Circuit, States
    from flywheel.machine.passive_resistances import Coefficients, PassiveResistances

Array = NDArray[np.float64]

_KEPT = 4  # meshes of a machine
_IN_STEP = 1e-12  # of a synchronous speed: speeds that differ from it by less are that speed

DRIVE = "drive."  # how the names of the drive's elements begin


class Rate(NamedTuple):
    """dE/dphi = F of the whole machine's kinetic energy (J/rad), at given speeds, on (cells, nodes).

    `by_speed` is dF/domega, `by_unknown` dF/du of the scene's balance, `by_inertia` dF/dJ of the flywheel's inertia (0 but
    for losses), `by_states` that by each state of a motor's own, (states, cells, nodes). `exchanged` is the sum of
    |contributions|.
    """

    moment: Array
    by_speed: Array
    by_unknown: Array
    by_inertia: Array
    by_states: Array
    exchanged: Array


class _Part(NamedTuple):
    """What hangs on the crank through one mesh, or on the crank itself, reduced to the crank."""

    stage: Stage
    station: Station
    resistance: Array
    inertia: Array
    slope: Array
    moment: Array
    per_unknown: Array
    exchanged: Array
    steepness: Array


class _Acting(NamedTuple):
    """The moment on one part at given speeds, with its slopes."""

    moment: Array
    by_speed: Array
    by_unknown: Array
    by_states: Array
    exchanged: Array


def _solved(
    inertias: Sequence[Any],
    bare: Sequence[Any],
    factors: tuple[Any, ...],
    near: Sequence[int],
    felt: Callable[[Any, int], Any] | None,
) -> tuple[Any, tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]]:
    """The equation of motion sum K (I alpha + bare) = 0 with bare = ½ I' omega² - M, for numbers or arrays.

    What each mesh passes grows with alpha, and so does the sum, whichever way the meshes pass power: one set of directions
    fits. As a function of alpha the sum is convex (concave backwards), so that Newton's method, which this is, ends.

    Args:
        inertias: I of every part (kg m², on the crank).
        bare: ½ I' omega² - M of every part (N m).
        factors: K of every part to begin with.
        near: the part that each hangs on, which stands before it.
        felt: gives k of a part's mesh, by its place, for what it passes; None where the factors given are to be kept.

    Returns:
        The acceleration d(omega²/2)/dphi, what accelerates each part and moves it against its own load (N m), what its mesh
        passes to it, and what the crank gives for each N m of the former.

    """
    for _ in range(2 + 2 ** len(inertias)):
        weight = sum(k * i for k, i in zip(factors, inertias, strict=True))
        acceleration = -sum(k * b for k, b in zip(factors, bare, strict=True)) / weight
        own = tuple(i * acceleration + b for i, b in zip(inertias, bare, strict=True))
        passed, found = _passed(own, near, factors, felt)
        if all(
            a is b or (a == b if isinstance(a, float) else np.array_equal(a, b)) for a, b in zip(found, factors, strict=True)
        ):
            break
        factors = found
    return acceleration, own, passed, factors


def _passed(
    own: Sequence[Any], near: Sequence[int], factors: tuple[Any, ...], felt: Callable[[Any, int], Any] | None
) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """What each mesh passes (N m, on the crank), for what each part takes for itself, from the far ends inwards; and K.

    With `felt`, what the nearer side of a mesh gives follows from what that mesh passes; else it is that of the factors K.
    """
    passed, given = list(own), [factors[0]] * len(own)
    for k in range(len(own) - 1, 0, -1):
        inner = near[k]
        if felt is not None:
            given[k] = felt(passed[k], k)
        if inner:
            ratio = given[k] if felt is not None else factors[k] / factors[inner]
            passed[inner] = passed[inner] + ratio * passed[k]
    if felt is None:
        return tuple(passed), factors
    for k in range(1, len(own)):
        given[k] = given[k] * given[near[k]] if near[k] else given[k]
    return tuple(passed), tuple(given)


class Moments:
    """A machine on a mesh, ready to tell F at any speeds, flywheels and values of its unknown.

    `inertia` and `slope` (cells, nodes) are I* and dI*/dphi without the flywheel, `steepness` the sum of the sizes of what
    makes up the latter. What a law or a mesh does at a speed is decided in the middle of every cell, or, where cells do not
    end at switches yet, at every node (`local`). `swings` tells whether a motor's own states may swing with the speed.
    """

    def __init__(self, machine: Machine, mesh: Cells, *, local: bool = False) -> None:
        self.machine, self.mesh, self.local = machine, mesh, local
        self.parts: list[_Part] = []
        for stage in machine.stages:
            station = stage.reduction.at(mesh.phi, mesh.anchor)
            values = station.reduced._asdict()
            self.parts.append(_Part(stage, station, *(wide(values[name], mesh.phi.shape) for name in _Part._fields[2:])))
        self.inertia: Array = np.asarray(sum(part.inertia for part in self.parts))
        self.slope: Array = np.asarray(sum(part.slope for part in self.parts))
        self.steepness: Array = np.asarray(sum(part.steepness for part in self.parts))
        self.lossy = any(part.stage.efficiency < 1.0 for part in self.parts)
        self.near = [part.stage.near for part in self.parts]
        self.circuit = circuit_of(machine.scene)
        self.swings = machine.keeps_step or (self.circuit is not None and len(self.circuit.names) > 1)
        self.drive_ratio = 1.0 if machine.scene.drive is None else machine.scene.shafts[machine.scene.drive.on]

    @cached_property
    def locally(self) -> Moments:
        """The same, with branches decided at every node."""
        found = copy(self)
        found.local = True
        return found

    def rate(self, omega: Array, unknown: float, inertia: float, states: States = ()) -> Rate:
        """F at crank speeds omega (rad/s) on the mesh, for a value of the unknown and a flywheel (kg m², on the crank).

        `states` are those of a motor's circuit, each on the mesh.
        """
        acting = [self._acting(part, omega, unknown, states) for part in self.parts]
        plain = _together(acting)
        if not self.lossy:
            return _lossless(plain)
        bend, _, factors = self._bend(acting, omega, inertia)
        inertias = [part.inertia + inertia * part.stage.carries_flywheel for part in self.parts]
        total = np.sum([k * i for k, i in zip(factors, inertias, strict=True)], axis=0)

        def loss(bare: Sequence[Array]) -> Array:
            """Moment lost in the meshes by a change `bare` of every part's I' y - M, or of its inertia times y'."""
            change = -np.sum([k * b for k, b in zip(factors, bare, strict=True)], axis=0) / total
            shares = zip(factors, inertias, bare, strict=True)
            return np.asarray(np.sum([(k - 1.0) * (i * change + b) for k, i, b in shares], axis=0))

        moved = [i * bend + 0.5 * part.slope * omega * omega for part, i in zip(self.parts, inertias, strict=True)]
        moment, _, exchanged = _felt(factors, acting, moved)
        return Rate(
            moment=moment,
            by_speed=plain.by_speed
            - loss([part.slope * omega - act.by_speed for part, act in zip(self.parts, acting, strict=True)]),
            by_unknown=plain.by_unknown - loss([-act.by_unknown for act in acting]),
            by_inertia=-loss([bend * part.stage.carries_flywheel for part in self.parts]),
            by_states=plain.by_states - loss([-act.by_states for act in acting]),
            exchanged=exchanged,
        )

    def constant(self, speed: float | Array, unknown: float, states: States | None = None) -> Rate:
        """F at a constant crank speed (rad/s), or at several, shape (speeds, cells, nodes).

        Inertias that vary are driven, but nothing is accelerated. A motor's own states are steady, if they are not given.
        """
        omega = np.asarray(speed, dtype=float)[..., None, None] + np.zeros_like(self.mesh.phi)
        acting, _, factors = self._unaccelerated(omega, unknown, states)
        plain = _together(acting)
        if not self.lossy:
            return _lossless(plain)
        moment, by_unknown, exchanged = _felt(factors, acting, [0.5 * part.slope * omega**2 for part in self.parts])
        return Rate(moment, plain.by_speed, by_unknown, np.zeros_like(omega), plain.by_states, exchanged)

    def net_work(self, speed: float | Array, unknown: float = 0.0, states: States | None = None) -> Array:
        """Net work (J) of a cycle run at a constant crank speed (rad/s), or at each of several (n,)."""
        if self.lossy:
            return self._total(self.constant(speed, unknown, states).moment)
        still, by_unknown, resistance = self._still
        speed = np.asarray(speed, dtype=float)
        omega, found = speed[..., None, None], still + unknown * by_unknown - resistance * speed
        for part in self.parts:
            for effort, factor in self._moving(part, omega):
                found = found + self._total(effort + unknown * factor)
            if self.circuit is not None and part.stage.drives:
                turned = self.drive_ratio * speed
                torque = self.circuit.torque(turned, self.steady_states(speed) if states is None else states)
                found = found + self.drive_ratio * torque * self.mesh.edges[-1]
        return np.asarray(found)

    def _total(self, moment: Any) -> Array:
        """The work (J) over the cycle of a moment on (..., cells, nodes), or of one that is the same all over it."""
        moment = np.asarray(moment, dtype=float)
        if moment.shape[-2:] == self.mesh.phi.shape:
            return cells.total(moment, self.mesh.half)
        if np.prod(moment.shape[-2:]) == 1:
            return np.asarray(moment.reshape(moment.shape[:-2]) * self.mesh.edges[-1])
        return cells.total(np.broadcast_to(moment, (*moment.shape[:-2], *self.mesh.phi.shape)), self.mesh.half)

    @cached_property
    def _still(self) -> Array:
        """The work over the cycle of what does not depend on speed; by the unknown; and of resistance, by the speed."""
        rows = [[part.moment, part.per_unknown, part.resistance] for part in self.parts]
        return cells.total(np.sum(rows, axis=0), self.mesh.half)

    def constant_losses(self, speed: float, unknown: float) -> list[Array]:
        """What each lossy mesh transmits outwards at a constant speed: its losses have a kink where that is zero."""
        if not self.lossy:
            return []
        return self._of_lossy(self._unaccelerated(np.full(self.mesh.phi.shape, speed), unknown)[1])

    def _unaccelerated(
        self, omega: Array, unknown: float, states: States | None = None
    ) -> tuple[list[_Acting], tuple[Array, ...], tuple[Array, ...]]:
        """What acts on every part at a constant speed, what its mesh transmits, and what the crank gives for its share."""
        states = self.steady_states(omega) if states is None else states
        acting = [self._acting(part, omega, unknown, states) for part in self.parts]
        own = [0.5 * p.slope * omega**2 - act.moment for p, act in zip(self.parts, acting, strict=True)]

        def felt(passed: Array, k: int) -> Array:
            eta = self.parts[k].stage.efficiency
            return np.where(passed > 0.0, 1.0 / eta, eta)

        return acting, *_passed(own, self.near, (1.0,) * len(own), felt)

    def steady_states(self, omega: Any) -> tuple[Any, ...]:
        """The states of a motor's circuit that do not change at constant crank speeds (rad/s); none without one.

        Of a motor that keeps step at one speed alone they are there those that carry the mean load.
        """
        if self.circuit is None:
            return ()
        out_of_step = self.circuit.steady(self.drive_ratio * omega)
        if self.circuit.only_speed is None:
            return out_of_step
        in_step = np.abs(self.drive_ratio * omega / self.circuit.only_speed - 1.0) <= _IN_STEP
        if not np.any(in_step) or (carrying := self.carrying) is None:
            return out_of_step
        return tuple(np.where(in_step, own, other) for own, other in zip(carrying, out_of_step, strict=True))

    @cached_property
    def carrying(self) -> tuple[float, ...] | None:
        """The states of a synchronous motor that carries the mean load in step; None where that is beyond its pull-out."""
        circuit = self.circuit
        assert circuit is not None
        assert circuit.only_speed is not None
        speed = circuit.only_speed / self.drive_ratio
        if self.lossy:
            return circuit.carrying(lambda states: float(self.net_work(speed, states=states)))
        others = float(self.net_work(speed, states=circuit.steady(circuit.only_speed)))
        way = self.drive_ratio * self.mesh.edges[-1]
        return circuit.carrying(lambda states: others + float(way * circuit.torque(circuit.only_speed, states)))

    def transmitted(self, omega: Array, unknown: float, inertia: float, states: States = ()) -> list[Array]:
        """What each lossy mesh transmits outwards (N m, on the crank)."""
        acting = [self._acting(part, omega, unknown, states) for part in self.parts]
        return self._of_lossy(self._bend(acting, omega, inertia)[1])

    def _of_lossy(self, transmitted: Sequence[Array]) -> list[Array]:
        return [tau for part, tau in zip(self.parts, transmitted, strict=True) if part.stage.efficiency < 1.0]

    def _acting(self, part: _Part, omega: Array, unknown: float, states: States) -> _Acting:
        moment = part.moment + unknown * part.per_unknown - part.resistance * omega
        by_speed, by_unknown = np.zeros_like(omega) - part.resistance, np.zeros_like(omega) + part.per_unknown
        exchanged = part.exchanged + np.abs(unknown * part.per_unknown) + part.resistance * omega
        by_states: Array = np.zeros((len(states), *omega.shape))
        if self.circuit is not None and part.stage.drives and len(states):
            ratio, circuit = self.drive_ratio, self.circuit
            driving, slopes = ratio * circuit.torque(ratio * omega, states), circuit.slopes(ratio * omega, states)
            for k, slope in enumerate(slopes.torque_by_states):
                by_states[k] = ratio * slope
            moment, exchanged = moment + driving, exchanged + np.abs(driving)
            by_speed = by_speed + ratio * ratio * slopes.torque_by_speed
        for effort, factor in self._moving(part, Jet(omega, 1.0)):
            value, slope = _with_slope(effort, omega)
            factor_value, factor_slope = _with_slope(factor, omega)
            moment = moment + value + unknown * factor_value
            by_speed = by_speed + slope + unknown * factor_slope
            by_unknown = by_unknown + factor_value
            exchanged = exchanged + np.abs(value + unknown * factor_value)
        return _Acting(moment, by_speed, by_unknown, by_states, exchanged)

    def _moving(self, part: _Part, omega: Any) -> list[tuple[Any, Any]]:
        """What depends on speed: moments, and their factors of the unknown, without those of a motor's circuit."""
        plain = omega.value if isinstance(omega, Jet) else omega
        found = part.station.contributions(omega, 0.0, self._deciding(plain), local=self.local)
        if found:
            counting.count(plain)
        by_circuit = self.circuit is not None
        return [(effort, factor) for element, effort, factor in found if not (by_circuit and element.name.startswith(DRIVE))]

    def _bend(
        self, acting: list[_Acting], omega: Array, inertia: float
    ) -> tuple[Array, tuple[Array, ...], tuple[Array, ...]]:
        """The equation of motion at speeds on the mesh (see `_solved`); a cell's directions are decided in its middle."""
        inertias = [part.inertia + inertia * part.stage.carries_flywheel for part in self.parts]
        bare = [part.slope * (0.5 * omega * omega) - act.moment for part, act in zip(self.parts, acting, strict=True)]

        def felt(passed: Array, k: int) -> Array:
            eta = self.parts[k].stage.efficiency
            return np.where(self._deciding(passed) > 0.0, 1.0 / eta, eta)

        start = tuple(np.ones((*omega.shape[:-1], 1)) for _ in self.parts)
        acceleration, _, passed, factors = _solved(inertias, bare, start, self.near, felt)
        return acceleration, passed, factors

    def drive(self, omega: Array, unknown: float, states: States = ()) -> Array:
        """The drive's share of F (N m, on the crank), before losses."""
        zero = np.zeros_like(omega)
        if self.circuit is not None and len(states):
            return np.asarray(zero + self.drive_ratio * self.circuit.torque(self.drive_ratio * omega, states))
        station = next(part.station for part in self.parts if part.stage.drives)
        still = station.moments(unknown).get("drive", 0.0)
        moving = station.contributions(omega, 0.0, self._deciding(omega), local=self.local)
        found = [effort + unknown * factor for element, effort, factor in moving if element.name.startswith(DRIVE)]
        return np.asarray(sum(found, zero + still))

    def switches(self, omega: Array) -> list[Array]:
        """What decides branches of laws by its sign and depends on speed, on (cells, nodes)."""
        if not self.machine.switches_at_speeds:
            return []
        by_path = {effort.path: effort for effort in self.machine.efforts}
        found: list[Array] = []
        for part in self.parts:
            for element, here, anchor in part.station.places(omega, 0.0, self._deciding(omega), local=self.local):
                if element.name in by_path:
                    found += [wide(switch, omega.shape) for switch in by_path[element.name].speed_switches(here, anchor)]
        return found

    def _deciding(self, values: Array) -> Array:
        """Values where branches are decided."""
        return values if self.local or values.shape[-1] == 1 else values[..., MIDDLE : MIDDLE + 1]


def moments_on(machine: Machine, edges: Array, *, local: bool = False) -> Moments:
    """The machine on cells between edges (rad): the last few are kept, as one search asks for the same again and again."""
    kept, key = machine.on_meshes, edges.tobytes()
    if key not in kept:
        if len(kept) >= _KEPT:
            kept.pop(next(iter(kept)))
        kept[key] = Moments(machine, cells.cells(edges))
    found: Moments = kept[key]
    return found.locally if local else found


def circuit_of(scene: Scene) -> Circuit | None:
    """The circuit of the drive's motor, where it has states of its own."""
    return None if scene.motor is None else scene.motor.circuit


def _together(acting: list[_Acting]) -> _Acting:
    """What acts on all parts."""
    return acting[0] if len(acting) == 1 else _Acting(*(sum(columns) for columns in zip(*acting, strict=True)))


def _lossless(plain: _Acting) -> Rate:
    zero = np.zeros_like(plain.moment)
    return Rate(plain.moment, plain.by_speed, plain.by_unknown, zero, plain.by_states, plain.exchanged)


def _felt(factors: Sequence[Array], acting: list[_Acting], moved: list[Array]) -> tuple[Array, Array, Array]:
    """What the crank feels of all parts through their meshes: the moment, its slope by the unknown, the sum of sizes.

    M - sum (k - 1) tau with tau = `moved` - M of each part, as sum k M - (k - 1) `moved`: so a small k, an efficiency of
    next to nothing, keeps its digits.
    """
    rows = list(zip(factors, acting, moved, strict=True))
    return (
        np.asarray(sum(k * act.moment - (k - 1.0) * inert for k, act, inert in rows)),
        np.asarray(sum(k * act.by_unknown for k, act, _ in rows)),
        np.asarray(sum(k * act.exchanged + np.abs((k - 1.0) * inert) for k, act, inert in rows)),
    )


def _with_slope(value: Any, omega: Array) -> tuple[Array, Array]:
    """Value and slope of a jet, or of a number that does not depend on speed."""
    if isinstance(value, Jet):
        return value.value + np.zeros_like(omega), value.first + np.zeros_like(omega)
    return value + np.zeros_like(omega), np.zeros_like(omega)


# -- at instants ------------------------------------------------------------------------------------------------------

ONSET = 1e-12  # of the typical speed: the speed by which branches are decided at rest
_NO_FORCE = 1e-12  # of the largest force, or rate: what is smaller has no sign
_SELDOM = 8  # instants of a piece for which a recording does not pay
_MOST_FACTORS = 8  # rounds in which the sides of meshes and friction settle
_INSET = 1e-10  # of a piece: how far from its ends a law is read that is not defined there


class Instant(NamedTuple):
    """What a machine does at one instant, at its crank: acceleration (rad/s²), moment M* less losses (N m), I* + J (kg m²).

    `loss` is what the meshes take of the moment (N m), `rates` those of a motor's own states (per second). The energy of the
    machine changes by moment * omega. `passed` is what the mesh of every stage passes outwards (N m), and `factors` what the
    crank gives for what a stage takes for itself: of each mesh on the way 1/efficiency where power goes outwards, efficiency
    where it comes back. `friction` is that of rough joints: it is part of
    the moment; NaN where it leaves no motion.
    """

    acceleration: Any
    moment: Any
    inertia: Any
    loss: Any
    rates: tuple[Any, ...] = ()
    passed: tuple[Any, ...] = ()
    factors: tuple[Any, ...] = ()
    friction: Rubbing | None = None


class Rubbing(NamedTuple):
    """Friction in joints at instants: what each passive action gives (N m, on the crank), by the order of their labels.

    moments: shape (n, actions); sides: see `Anchor`; decisive: what changes its sign where a smooth stretch of it ends,
    (rows, n): rates, forces, and the determinant on whose root friction leaves no motion; none where it is not watched.
    Of a single instant without sides to begin with, `solutions` is how many motions there are, and `joint` what makes it so
    that there is not one.
    """

    moments: Array
    sides: Array
    decisive: Array
    solutions: int = 1
    joint: str = ""


PlainInstant = Callable[[float, float, float, Any], tuple[float, float, float, tuple[float, ...]]]


class Hold(NamedTuple):
    """Friction that holds a machine at rest: M* without it (N m), and how much friction a motion from there would meet.

    The latter is infinite where no driving action would move the mechanism. `locking` are the loads, by path, that push but
    do not move it however large they are: the friction that follows each alone is as large as what it pushes with.
    """

    moment: float
    friction: float
    locking: tuple[str, ...]


class _Contribution(NamedTuple):
    efficiency: float
    inertia: Any
    slope: Any
    moment: Any
    efforts: dict[str, Any] | None = None  # of loads, by path, where joints rub


def _interior(ends: tuple[float, float]) -> tuple[float, float]:
    """The ends of a piece, drawn in to where its laws are defined."""
    inset = max(_INSET * (ends[1] - ends[0]), 64 * ROUNDING * ends[1])
    return ends[0] + inset, ends[1] - inset


def _one(value: Any) -> float:
    """The only number of an array."""
    return float(np.ravel(value)[0])


class Dynamics:
    """A machine with a flywheel (kg m² at the crank) and a value of its unknown, at any position, speed and time.

    `circuit` is that of its motor where this has states of its own, such as a current, else None.
    """

    def __init__(self, machine: Machine, inertia: float, balance: float = 0.0) -> None:
        self.machine, self.inertia, self.balance = machine, inertia, balance
        self.circuit = circuit_of(machine.scene)
        drive = machine.scene.drive
        self.ratio = 1.0 if drive is None else machine.scene.shafts[drive.on]
        self._efforts = {effort.path: effort for effort in machine.efforts}
        self._laws: dict[tuple[int, str], tuple[Program, Callable[..., tuple[Any, ...]]]] = {}  # with it, so that ids stay
        self._asked: dict[float, int] = {}

    @cached_property
    def resistances(self) -> PassiveResistances | None:
        """Friction in the joints at the actual motion; None where nothing rubs, or its moment is given."""
        if not self.machine.resists:
            return None
        from flywheel.machine.passive_resistances import PassiveResistances  # only linkages have friction

        return PassiveResistances(self.machine)

    @cached_property
    def _near(self) -> list[int]:
        """The stage that each meshes with."""
        return [stage.near for stage in self.machine.stages]

    @cached_property
    def drags(self) -> tuple[float, ...]:
        """The drag of shafts (N m, on the crank) of every stage; nothing where no shaft has any.

        As loads they act against a motion forwards; here they turn round with it, and hold a machine at rest.
        """
        machine, found = self.machine, [0.0] * len(self.machine.stages)
        order = [stage.shaft for stage in machine.stages]
        for load in machine.scene.loads:
            if load.drag and isinstance(load.law, float):
                found[order.index(machine.stage_of(load.on))] -= load.law * machine.scene.shafts[load.on]
        return tuple(found) if any(found) else ()

    @property
    def holds(self) -> bool:
        """Whether dry friction, in joints or as drag of shafts, may hold the machine at rest."""
        return self.machine.resists or (any(load.drag for load in self.machine.scene.loads) and bool(self.drags))

    def __reduce__(self) -> tuple[Any, ...]:
        return Dynamics, (self.machine, self.inertia, self.balance)

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

        Branches that depend on speed or time are decided at `anchor` where there is one, else here. Where a law stops being
        defined at a piece's end, it is read just inside. Past the end of a stroke, where a step that finds the end may try,
        there is no mechanism: I* goes on along its tangent.
        """
        place = anchor or Anchor(middle, None, None)
        phi, beyond = self._inside(phi)
        parts, table = self._parts(phi, place, omega, time, states)
        if ends is not None and not all(np.all(np.isfinite(part.moment)) for part in parts):
            low, high = _interior(ends)
            held = min(max(phi, low), high)
            return self.at(held, middle, omega, time, states=states, anchor=anchor)
        if beyond:
            parts[0] = parts[0]._replace(inertia=parts[0].inertia + beyond * sum(part.slope for part in parts))
        if self.resistances is not None:
            found = self._resisted(
                self._turned(parts, place, omega), table, np.array([phi]), place, np.array([omega]), states
            )
            return found._replace(
                acceleration=_one(found.acceleration),
                moment=_one(found.moment),
                inertia=_one(found.inertia),
                loss=_one(found.loss),
                rates=tuple(map(_one, found.rates)),
                passed=tuple(map(_one, found.passed)),
                factors=tuple(map(_one, found.factors)),
            )
        return self._resting(self._instant(self._turned(parts, place, omega), omega, states, place.factors), place)

    def _turned(self, parts: list[_Contribution], anchor: Anchor, omega: Any) -> list[_Contribution]:
        """The parts, with the drag of shafts against the motion where this goes backwards."""
        if not (self.holds and self.drags):
            return parts
        back = (omega if anchor.omega is None else anchor.omega) < 0.0
        if not np.any(back):
            return parts
        return [part._replace(moment=part.moment + 2.0 * back * drag) for part, drag in zip(parts, self.drags, strict=True)]

    def _resting(self, found: Instant, anchor: Anchor) -> Instant:
        """The instants, where drag holds the machine without an acceleration."""
        if anchor.omega is None or not self.holds or not np.any(rests := np.equal(anchor.omega, 0.0)):
            return found
        acceleration, moment, loss = (np.where(rests, 0.0, row) for row in (found.acceleration, found.moment, found.loss))
        return found._replace(acceleration=acceleration, moment=moment, loss=loss)

    def plainly(self, anchor: Anchor) -> PlainInstant | None:
        """What `at` gives in the piece of an anchor, in plain numbers.

        From phi, omega, t and a motor's states to acceleration, moment, inertia and their rates (see `Instant`). Where a law
        is not defined it raises ValueError or ArithmeticError, or gives what is not finite. None where joints rub, on a
        stroke, where the anchor does not tell the sides of meshes, or where the walk cannot be recorded.
        """
        machine, circuit, ratio = self.machine, self.circuit, self.ratio
        if machine.resists or machine.scene.stroke is not None or (len(machine.stages) > 1 and not anchor.factors):
            return None
        program = machine.traced.motion(anchor)
        if program is None:
            return None
        law, unknown, flywheel = self._compiled(program, "math"), self.balance, self.inertia
        if self.holds and anchor.omega is not None and not anchor.omega > 0.0:
            return None
        driving = next((k for k, stage in enumerate(machine.stages) if stage.drives), 0)

        def single(phi: float, omega: float, t: float, states: States) -> tuple[float, float, float, tuple[float, ...]]:
            inertia, slope, moment = law(phi, omega, t, unknown)
            inertia += flywheel
            rates: tuple[float, ...] = ()
            if circuit is not None:
                moment += ratio * circuit.torque(ratio * omega, states)
                rates = circuit.rates(ratio * omega, states)
            return (moment - slope * (0.5 * omega * omega)) / inertia, moment, inertia, rates

        def several(phi: float, omega: float, t: float, states: States) -> tuple[float, float, float, tuple[float, ...]]:
            found, square = law(phi, omega, t, unknown), 0.5 * omega * omega
            rates: tuple[float, ...] = ()
            assert anchor.factors is not None
            total = weight = bare = moment = 0.0
            rows = []
            for k, (stage, factor) in enumerate(zip(machine.stages, anchor.factors, strict=True)):
                inertia, slope, acting = found[3 * k : 3 * k + 3]
                inertia += flywheel * stage.carries_flywheel
                if circuit is not None and k == driving:
                    acting += ratio * circuit.torque(ratio * omega, states)
                    rates = circuit.rates(ratio * omega, states)
                left = slope * square - acting
                rows.append((factor, inertia, left))
                total, moment = total + inertia, moment + acting
                weight, bare = weight + factor * inertia, bare + factor * left
            acceleration = -bare / weight
            loss = sum((factor - 1.0) * (inertia * acceleration + left) for factor, inertia, left in rows)
            return acceleration, moment - loss, total, rates

        return single if len(machine.stages) == 1 else several

    def along(
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

        With the `ends` of a piece, a law that stops being defined there is read just inside, as by `at`. What decides the
        branches of friction is told where it is `watched`.
        """
        phi = np.asarray(self._inside(phi)[0])
        parts, table = self._parts(phi, anchor, omega, time, states)
        if ends is not None and not all(np.isfinite(part.moment).all() for part in parts):
            return self.along(np.clip(phi, *_interior(ends)), anchor, omega, time, states, watched=watched)
        factors = anchor.factors or tuple(1.0 for _ in parts)
        parts = self._turned(parts, anchor, omega)
        if self.resistances is not None:
            found = self._resisted(parts, table, phi, anchor._replace(factors=factors), omega, states, watched)
        else:
            found = self._resting(self._instant(parts, omega, states, factors), anchor)
        whole = partial(wide, shape=phi.shape)
        return found._replace(
            acceleration=whole(found.acceleration),
            moment=whole(found.moment),
            inertia=whole(found.inertia),
            loss=whole(found.loss),
            passed=tuple(map(whole, found.passed)),
        )

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
        """The moment (N m, on the crank) of all that pushes or drags, by its part: loads, weights, springs, dampers.

        now: the instants there, as `along` gives them, if they are known; rubbing: with friction in joints.
        """
        phi = np.asarray(self._inside(phi)[0])
        found: dict[str, Any] = {}
        for stage in self.machine.stages:
            station = stage.reduction.at(phi, anchor.phi)
            rows = [*station.moments(self.balance).items()]
            rows += [(part, -value * omega) for part, value in station.resistances().items()]
            rows += self._moving(station, stage, anchor, omega, time, states)
            for part, value in rows:
                found[part] = found.get(part, 0.0) + value
        back = (omega if anchor.omega is None else anchor.omega) < 0.0
        for load in self.machine.scene.loads if self.holds and np.any(back) else ():
            if load.drag and isinstance(load.law, float):  # against a motion backwards
                found[load.path] = found[load.path] - 2.0 * back * load.law * self.machine.scene.shafts[load.on]
        if self.resistances is not None and rubbing:
            friction = (now or self.along(phi, anchor, omega, time, states)).friction
            assert friction is not None
            for k in np.flatnonzero(self.resistances.rubbing):
                label = self.resistances.labels[k]
                found[label] = found.get(label, 0.0) + friction.moments[:, k]
        return {part: wide(value, phi.shape) for part, value in found.items()}

    def switches(self, phi: Any, anchor: Anchor, omega: Any, time: Any) -> list[Any]:
        """What decides branches by its sign and depends on speed or time, in the order of the loads."""
        phi, found = self._inside(phi)[0], list[Any]()
        if not self.machine.switches_at_speeds:
            return found
        for stage in self.machine.stages:
            places = stage.reduction.at(phi, anchor.phi).places(omega, time, anchor.omega, anchor.time)
            for element, here, there in places:
                if not self._of_circuit(element.name):
                    found += self._efforts[element.name].speed_switches(here, there)
        return found

    def sides(self, phi: Array, anchor: Anchor, omega: Array, time: Array, states: States = ()) -> list[Array]:
        """What changes its sign where a stretch of motion ends: switches, and what meshes with losses pass."""
        rows = [wide(value, phi.shape) for value in self.switches(phi, anchor, omega, time)]
        if anchor.factors is not None or self.resistances is not None:
            now = self.along(phi, anchor, omega, time, states, watched=True)
            level = _NO_FORCE * (np.abs(now.moment) + np.sum(np.abs(now.passed), axis=0))
            rows += [np.where(np.abs(tau) > level, tau, 0.0) for tau in now.passed[1:]]
            if now.friction is not None:
                rows += list(now.friction.decisive)
        return rows

    @property
    def branching(self) -> bool:
        """Whether some branch depends on speed or time, on which side of a mesh drives, or on how joints and shafts rub."""
        return self.holds or len(self.machine.stages) > 1 or self.machine.switches_at_speeds

    def _inside(self, phi: Any) -> tuple[Any, Any]:
        """The position, or the end of the stroke that it lies past, and by how much it does."""
        if self.machine.scene.stroke is None:
            return phi, 0.0
        held = np.clip(phi, 0.0, self.machine.scene.cycle)
        return held, phi - held

    def _parts(
        self, phi: Any, anchor: Anchor, omega: Any, time: Any, states: States
    ) -> tuple[list[_Contribution], tuple[Coefficients, ...]]:
        """All parts of the machine; with rough joints also what their tables give, and the parts from these if they can."""
        resistances, stages = self.resistances, self.machine.stages
        if resistances is None:
            recorded = self._recorded_parts(phi, anchor, omega, time, states)
            return recorded or [self._part(stage, phi, anchor, omega, time, states) for stage in stages], ()
        table = resistances.at(np.atleast_1d(phi))
        if not resistances.complete:
            return [self._part(stage, phi, anchor, omega, time, states) for stage in stages], table
        counting.count(phi)
        acting = resistances.acting(table, np.atleast_1d(phi), anchor, omega, time, self.balance, self._of_circuit)
        rows = zip(stages, acting.inertia, acting.slope, acting.moment, strict=True)
        parts = [
            _Contribution(stage.efficiency, inertia + self.inertia * stage.carries_flywheel, slope, moment, acting.efforts)
            for stage, inertia, slope, moment in rows
        ]
        if self.circuit is not None:
            k = next(k for k, stage in enumerate(stages) if stage.drives)
            torque = self.ratio * self.circuit.torque(self.ratio * omega, states)
            parts[k] = parts[k]._replace(moment=parts[k].moment + torque)
        return parts, table

    def _recorded_parts(self, phi: Any, anchor: Anchor, omega: Any, time: Any, states: States) -> list[_Contribution] | None:
        """All parts by the recorded walk, in a piece that is asked for often enough; None where the walk itself serves."""
        if not (isinstance(anchor.phi, float) and isinstance(anchor.omega, float | None)):
            return None
        asked = self._asked[anchor.phi] = self._asked.get(anchor.phi, 0) + 1
        program = self.machine.traced.motion(anchor) if asked > _SELDOM else None
        if program is None:
            return None
        plain = isinstance(phi, float) and isinstance(omega, float)
        try:
            found = self._compiled(program, "math" if plain else "numpy")(phi, omega, time, self.balance)
        except (ValueError, ArithmeticError):
            return None
        if not (math.isfinite(sum(found)) if plain else all(np.isfinite(value).all() for value in found)):
            return None
        counting.count(phi)
        parts = []
        for k, stage in enumerate(self.machine.stages):
            inertia, slope, moment = found[3 * k : 3 * k + 3]
            if self.circuit is not None and stage.drives:
                moment = moment + self.ratio * self.circuit.torque(self.ratio * omega, states)
            parts.append(_Contribution(stage.efficiency, inertia + self.inertia * stage.carries_flywheel, slope, moment))
        return parts

    def _compiled(self, program: Program, kind: str) -> Callable[..., tuple[Any, ...]]:
        """A program as a function, made once."""
        key = id(program), kind
        if key not in self._laws:
            self._laws[key] = program, program.function(kind)
        return self._laws[key][1]

    def _part(self, stage: Stage, phi: Any, anchor: Anchor, omega: Any, time: Any, states: States) -> _Contribution:
        station = stage.reduction.at(phi, anchor.phi)
        reduced = station.reduced
        moment = reduced.moment + self.balance * reduced.per_unknown - reduced.resistance * omega
        for _, value in self._moving(station, stage, anchor, omega, time, states):
            moment = moment + value
        inertia = reduced.inertia + (self.inertia if stage.carries_flywheel else 0.0)
        pressing = None
        if self.resistances is not None:
            pressing = station.efforts(omega, time, anchor.omega, anchor.time, self.balance)
        return _Contribution(stage.efficiency, inertia, reduced.slope, moment, pressing)

    def _moving(
        self, station: Station, stage: Stage, anchor: Anchor, omega: Any, time: Any, states: States
    ) -> Iterator[tuple[str, Any]]:
        """Part and moment of what depends on speed, on time, or on a motor's own states."""
        if self.circuit is not None and stage.drives:
            torque = self.circuit.torque(self.ratio * omega, states)
            yield "drive", self.ratio * torque
        if stage.reduction.moves:
            for element, effort, factor in station.contributions(omega, time, anchor.omega, anchor.time):
                if not self._of_circuit(element.name):
                    yield element.part or element.name, effort + self.balance * factor

    def _of_circuit(self, name: str) -> bool:
        """Whether a source is the quasi-static law of a motor whose own states are followed instead."""
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

        Which way the meshes pass power, and how friction acts, is found in turn where the anchor does not tell.
        """
        resistances = self.resistances
        assert resistances is not None
        sense = np.sign(omega if anchor.omega is None else anchor.omega) + np.zeros(phi.shape)
        efforts = {path: value for part in parts for path, value in (part.efforts or {}).items()}
        terms = resistances.terms(table, omega, efforts)
        count = resistances.curved.size
        if anchor.sides is None:
            sliding, signs, lines = resistances.sliding(terms.ways, sense), None, None
        else:
            sliding, signs, lines = np.split(np.broadcast_to(anchor.sides, (phi.size, 3 * count)), 3, axis=1)
        factors = resistances.factors(sliding)
        moments = [part.moment for part in parts]
        used = anchor.factors or tuple(np.ones(phi.shape) for _ in parts)
        for _ in range(_MOST_FACTORS):
            total = sum(k * part.inertia for k, part in zip(used, parts, strict=True)) + np.zeros(phi.shape)
            bare = [part.slope * (0.5 * omega * omega) - moment for part, moment in zip(parts, moments, strict=True)]
            alone = -sum(k * b for k, b in zip(used, bare, strict=True)) / total
            shares = np.stack([np.broadcast_to(k / total, phi.shape) for k in used], axis=1)
            gains = shares[:, resistances.stages] * terms.ways
            found = resistances.resisted(terms, alone, gains, factors, signs, lines)
            moved = terms.ways * found.amounts
            rubbed = [
                part._replace(moment=moment + moved[:, resistances.stages == k].sum(axis=1))
                for k, (part, moment) in enumerate(zip(parts, moments, strict=True))
            ]
            instant = self._instant(rubbed, omega, states, anchor.factors, sense)
            if (
                len(parts) == 1
                or anchor.factors is not None
                or all(np.array_equal(a, b) for a, b in zip(instant.factors, used, strict=True))
            ):
                break
            used = instant.factors
        solutions, decisive = (1, ""), np.empty((0, phi.size))
        if watched or signs is None or lines is None:
            level = _NO_FORCE * np.maximum(terms.scale, np.abs(found.sizes).max(axis=1))
            forces = np.where(np.abs(found.sizes) > level[:, None], found.sizes, 0.0)
            rates = np.where(np.abs(terms.ways) > _NO_FORCE * resistances.rates, terms.ways, 0.0)
            if signs is None or lines is None:
                if phi.size == 1:
                    solutions = resistances.solutions(terms, alone, gains, factors)
                signs = np.where(resistances.curved, 0.0, np.where(forces < 0.0, -1.0, 1.0))
                lines = np.where(terms.lined, found.directions, np.nan)
            rubs = resistances.rubbing & (resistances.strengths > 0.0)
            forces = np.where(resistances.curved & np.isnan(lines), 1.0, forces)  # a resultant that turns has no sign
            decisive = np.concatenate((rates[:, rubs], forces, found.determinant[:, None]), axis=1).T
        rests = sense == 0.0  # what each joint then holds is not determined
        return instant._replace(
            acceleration=np.where(rests, 0.0, instant.acceleration),
            moment=np.where(rests, 0.0, instant.moment),
            loss=np.where(rests, 0.0, instant.loss),
            friction=Rubbing(moved, np.concatenate((sliding, signs, lines), axis=1), decisive, *solutions),
        )

    def from_rest(self, phi: float, ahead: float, behind: float, times: Array, states: States = ()) -> tuple[Array, Array]:
        """The acceleration (rad/s²) of a machine with dry friction at rest if it moved forwards, and if it moved backwards.

        At times (n,) it does the one where that is above 0, the other where that is below; `ahead` and `behind` lie in the
        pieces on either side of the position. 0 stands where friction leaves no motion.
        """
        onset, found = ONSET * self.machine.typical_speed, list[Array]()
        for place, omega in ((ahead, onset), (behind, -onset)):
            if len(self.machine.stages) == 1:
                anchor = Anchor(place, np.full(times.shape, omega), times)
                one = self.along(np.full(times.shape, phi), anchor, anchor.omega, times, states).acceleration
            else:  # the sides of meshes are found one instant at a time
                rows = np.array([np.broadcast_to(state, times.shape) for state in states]).reshape(len(states), times.size).T
                each = [
                    self.at(phi, place, omega, float(t), states=row.tolist(), anchor=Anchor(place, omega, float(t)))
                    for t, row in zip(times, rows, strict=True)
                ]
                one = np.array([now.acceleration for now in each])
            found.append(np.where(np.isfinite(one), one, 0.0))
        return found[0], found[1]

    def hold(self, phi: float, ahead: float, behind: float, time: float, states: States = ()) -> Hold:
        """What keeps a machine with dry friction at rest, at a position between places ahead of it and behind."""
        resistances = self.resistances
        if resistances is None:
            onset, most = ONSET * self.machine.typical_speed, sum(self.drags)
            parts, _ = self._parts(float(self._inside(phi)[0]), Anchor(ahead, onset, time), onset, time, states)
            return Hold(_one(sum(part.moment for part in parts)) + most, most, ())
        at = np.array([float(self._inside(phi)[0])])
        for sense, place in ((1.0, ahead), (-1.0, behind)):
            omega = sense * ONSET * self.machine.typical_speed
            anchor = Anchor(place, omega, time)
            parts, table = self._parts(float(at[0]), anchor, omega, time, states)
            parts = self._turned(parts, anchor, omega)
            moment = float(np.ravel(sum(part.moment for part in parts))[0])
            if sense * moment >= 0.0:
                break
        total = sum(part.inertia for part in parts)
        shares: dict[str, float] = {}  # of M*, by the paths of loads
        for stage in self.machine.stages:
            station = stage.reduction.at(float(at[0]), anchor.phi)
            shares |= station.moments(self.balance, by_name=True)
            moving = station.contributions(omega, time, anchor.omega, anchor.time) if stage.reduction.moves else []
            shares |= {element.name: effort + self.balance * factor for element, effort, factor in moving}

        def resisted(efforts: dict[str, Any], always: float, moment: float | None) -> tuple[float, float]:
            """Friction against the motion; with a moment, what it leaves of that when the crank is accelerated by it."""
            terms = resistances.terms(table, np.zeros(1), efforts, always)
            factors = resistances.factors(resistances.sliding(terms.ways, np.array([sense])))
            gains = terms.ways / total if moment is not None else np.zeros_like(terms.ways)
            found = resistances.resisted(terms, (moment or 0.0) / total, gains, factors)
            against = -sense * float((terms.ways * found.amounts).sum())
            return (against if math.isfinite(against) else math.inf), sense * (moment or 0.0) - against

        efforts = {path: value for part in parts for path, value in (part.efforts or {}).items()}
        locking = [
            path
            for path, share in shares.items()
            if path in self._efforts and sense * share > 0.0
            if not resisted({path: efforts[path]}, 0.0, float(share))[1] > 0.0
        ]
        return Hold(moment, resisted(efforts, 1.0, None)[0], tuple(locking))

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

            def felt(passed: Any, k: int) -> float:
                return 1.0 / parts[k].efficiency if forwards * passed > 0.0 else parts[k].efficiency

            given, by_mesh = (factors, None) if factors else ((1.0,) * len(parts), felt if factors is None else None)
            found = _solved([p.inertia for p in parts], bare, given, self._near, by_mesh)
            acceleration, own, passed, used = found
            loss = sum((k - 1.0) * tau for k, tau in zip(used, own, strict=True))
        return Instant(
            acceleration=acceleration,
            moment=sum(part.moment for part in parts) - loss,
            inertia=sum(part.inertia for part in parts),
            loss=loss,
            rates=() if self.circuit is None else self.circuit.rates(self.ratio * omega, states),
            passed=passed,
            factors=used,
        )
