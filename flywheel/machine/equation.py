"""The equation of motion of a machine with losses in its meshes, and its moments on a mesh of crank angles.

A machine is its crank and parts in a tree, each on the crank or on another part through a mesh of an efficiency. With I of
a part and M on it, both reduced to the crank (angle phi, speed omega), the moment through its mesh is

    tau = I alpha + ½ dI/dphi omega² - M + sum of k tau over the parts connected to it,

alpha = domega/dt = d(omega²/2)/dphi, where the nearer side gives k = 1/efficiency for each N m that passes outwards, and
gets k = efficiency for each that comes back. Nothing passes to the crank itself. With K of a part, the product of k over
all meshes from the crank to it, alpha follows from

    sum over the parts of K (I alpha + ½ dI/dphi omega² - M) = 0.

`Moments` evaluates laws of position alone once, on a whole mesh, and laws of speed there as often as
needed, with slopes: series and cells of the steady regime use it. `machine.dynamics` gives the same at instants.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.numerics import count
from bondgraph.reduction import Station
from flywheel.machine.loads import at_speeds
from flywheel.machine.machine import DRIVE, Machine, MeshStage, circuit_of
from flywheel.numerics import cells
from flywheel.numerics.cells import MIDDLE, Cells, wide
from flywheel.numerics.faults import Fault
from flywheel.numerics.jets import Jet

if TYPE_CHECKING:
    from flywheel.components.motors.motor import States

Array = NDArray[np.float64]

_KEPT = 4  # meshes of a machine
_IN_STEP = 1e-12  # of a synchronous speed: speeds that differ from it by less are that speed
GREATEST_VALUE = 1e150  # of forces and inertias in SI: their squares and products would leave the floating-point range


class Rate(NamedTuple):
    """dE/dphi = F of the whole machine's kinetic energy (J/rad), at given speeds, on (cells, nodes).

    `by_speed` is dF/domega, `by_unknown` dF/du of the scene's balance, `by_inertia` dF/dJ of the flywheel's inertia (0
    without losses), `by_states` that by each state of a motor's own, (states, cells, nodes). `exchanged` is the sum of
    |contributions|. `transmitted` is the moment that each lossy mesh transmits outwards (N m, on the crank).
    """

    moment: Array
    by_speed: Array
    by_unknown: Array
    by_inertia: Array
    by_states: Array
    exchanged: Array
    transmitted: tuple[Array, ...] = ()


class _MachinePart(NamedTuple):
    """Part of the machine driven through one mesh, or by the crank itself, reduced to the crank."""

    stage: MeshStage
    station: Station
    resistance: Array
    inertia: Array
    slope: Array
    moment: Array
    per_unknown: Array
    exchanged: Array
    steepness: Array


def balanced(inertias: Sequence[Any], bare: Sequence[Any], factors: Sequence[Any]) -> tuple[Any, tuple[Any, ...]]:
    """The equation of motion: the alpha with sum K (I alpha + bare) = 0, and the residual I alpha + bare of every part.

    bare: ½ I' omega² - M of every part (N m), or its change. All may be numbers or arrays.
    """
    weight = _sum(k * i for k, i in zip(factors, inertias, strict=True))
    acceleration = -_sum(k * b for k, b in zip(factors, bare, strict=True)) / weight
    return acceleration, tuple(i * acceleration + b for i, b in zip(inertias, bare, strict=True))


def _sum(terms: Iterable[Any]) -> Any:
    """The sum of numbers or arrays, at least one; `sum` would add the first of them to 0."""
    return reduce(operator.add, terms)


def lost(factors: Sequence[Any], residuals: Sequence[Any]) -> Any:
    """The moment (N m) lost in the meshes, from the moments that accelerate each part and move it against its load."""
    return sum((k - 1.0) * own for k, own in zip(factors, residuals, strict=True))


def solved(
    inertias: Sequence[Any],
    bare: Sequence[Any],
    factors: tuple[Any, ...],
    stages: Sequence[MeshStage],
    outwards: Callable[[Any], Any] | None,
) -> tuple[Any, tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]]:
    """The equation of motion (see `balanced`) with the factors K for the directions of power in the meshes.

    The moment through each mesh grows with alpha, and so does the sum, in any directions of power: one set of directions
    fits. As a function of alpha the sum is convex (concave backwards), so that Newton's method, which this is, ends.

    Args:
        inertias: I of every part (kg m², on the crank).
        bare: ½ I' omega² - M of every part (N m).
        factors: K of every part to begin with.
        stages: of the parts, whose meshes lose.
        outwards: tests whether a mesh with some moment (N m) passes power outwards; None to keep the factors.

    Returns:
        The acceleration d(omega²/2)/dphi, the residual of each part (N m), the moment through its mesh, and the crank's
        moment for each N m of the residual.

    """
    for _ in range(2 + 2 ** len(inertias)):
        acceleration, own = balanced(inertias, bare, factors)
        passed, ratio = passed_by(own, stages, factors, outwards)
        if alike(ratio, factors):
            break
        factors = ratio
    return acceleration, own, passed, factors


def alike(ones: Sequence[Any], others: Sequence[Any]) -> bool:
    """Tests whether numbers or arrays are equal."""
    pairs = zip(ones, others, strict=True)
    return all(a is b or (a == b if isinstance(a, float) else np.array_equal(a, b)) for a, b in pairs)


def passed_by(
    own: Sequence[Any], stages: Sequence[MeshStage], factors: tuple[Any, ...], outwards: Callable[[Any], Any] | None
) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """The moment through each mesh (N m, on the crank), summed from the far ends inwards, and K.

    With `outwards`, the moment on the nearer side of a mesh follows from the moment through it; else from the factors K.
    """
    passed, outputs = list(own), [factors[0]] * len(own)
    for k in range(len(own) - 1, 0, -1):
        inner, eta = stages[k].near, stages[k].efficiency
        if outwards is not None:
            out = outwards(passed[k])
            outputs[k] = np.where(out, 1.0 / eta, eta) if isinstance(out, np.ndarray) else 1.0 / eta if out else eta
        if inner:
            ratio = outputs[k] if outwards is not None else factors[k] / factors[inner]
            passed[inner] = passed[inner] + ratio * passed[k]
    if outwards is None:
        return tuple(passed), factors
    for k in range(1, len(own)):
        outputs[k] = outputs[k] * outputs[stages[k].near] if stages[k].near else outputs[k]
    return tuple(passed), tuple(outputs)


class Moments:
    """A machine on a mesh, which gives F at any speeds, flywheels and values of its unknown.

    `inertia` and `slope` (cells, nodes) are I* and dI*/dphi without the flywheel, `steepness` the sum of the sizes of all
    contributions to the latter. Branches of laws and meshes at a speed are decided in the middle of every cell, or, if cells
    do not end at switches yet, at every node (`local`). `swings` is true if a motor's own states may swing with the speed.
    """

    _directions: tuple[Array, ...] = ()  # K of every part for the last directions of power in the meshes: often the next

    def __init__(self, machine: Machine, mesh: Cells, *, local: bool = False) -> None:
        self.machine, self.mesh, self.local = machine, mesh, local
        self.parts: list[_MachinePart] = []
        whole = machine.reduction.at(mesh.phi, mesh.anchor)
        for stage in machine.stages:
            station = whole.of(stage.reduction)
            values = station.reduced._asdict()
            self.parts.append(
                _MachinePart(stage, station, *(wide(values[name], mesh.phi.shape) for name in _MachinePart._fields[2:]))
            )
        self.inertia: Array = np.asarray(sum(part.inertia for part in self.parts))
        self.slope: Array = np.asarray(sum(part.slope for part in self.parts))
        self.steepness: Array = np.asarray(sum(part.steepness for part in self.parts))
        self.lossy = any(part.stage.efficiency < 1.0 for part in self.parts)
        self.circuit = circuit_of(machine.scene)
        self.swings = machine.keeps_step or (self.circuit is not None and len(self.circuit.names) > 1)
        self.drive_ratio = 1.0 if machine.scene.drive is None else machine.scene.shafts[machine.scene.drive.on]

    @cached_property
    def locally(self) -> Moments:
        """The same machine, with branches decided at every node."""
        moments = copy(self)
        moments.local = True
        return moments

    def rate(self, omega: Array, unknown: Any, inertia: Any, states: States = ()) -> Rate:
        """F at crank speeds omega (rad/s) on the mesh, for a value of the unknown and a flywheel (kg m², on the crank).

        `states` are those of a motor's circuit, each on the mesh.
        """
        acting = [self._acting(part, omega, unknown, states) for part in self.parts]
        if not self.lossy:
            return _together(acting)
        half_square = 0.5 * omega * omega
        pushed = [part.slope * half_square for part in self.parts]
        inertias = [part.inertia + inertia if part.stage.carries_flywheel else part.inertia for part in self.parts]
        bare = [push - act.moment for push, act in zip(pushed, acting, strict=True)]
        acceleration, passed, factors = self._acceleration(inertias, bare)
        moved = [i * acceleration + push for i, push in zip(inertias, pushed, strict=True)]
        moment, by_unknown, exchanged = _with_mesh_losses(factors, acting, moved)
        # A change `bare` of every part's I' y - M + y' I alone also changes the acceleration: F by -sum (s k - 1) bare.
        weight = np.asarray(_sum(k * i for k, i in zip(factors, inertias, strict=True)))
        share = np.asarray(_sum(inertias)) / weight
        shares = [share * k for k in factors]
        rows = list(zip(self.parts, acting, shares, strict=True))
        by_speed = _sum(k * act.by_speed for _, act, k in rows) - omega * _sum((k - 1.0) * part.slope for part, _, k in rows)
        by_inertia = _sum((1.0 - k) * acceleration for part, _, k in rows if part.stage.carries_flywheel)
        return Rate(
            moment=moment,
            by_speed=by_speed,
            by_unknown=share * by_unknown,
            by_inertia=by_inertia,
            by_states=_sum(k * act.by_states for k, act in zip(shares, acting, strict=True)),
            exchanged=exchanged,
            transmitted=self._of_lossy(passed),
        )

    def constant(self, speed: Any, unknown: Any, states: States | None = None) -> Rate:
        """F at a constant crank speed (rad/s), or at several, shape (speeds, cells, nodes).

        Inertias that vary are driven, but nothing is accelerated. A motor's own states are steady, if they are not given.
        """
        omega = np.asarray(speed, dtype=float)[..., None, None]
        states = self.steady_states(omega) if states is None else states
        acting = [self._acting(part, omega, unknown, states) for part in self.parts]
        plain = _together(acting)
        if not self.lossy:
            return plain
        moved, passed, factors = self._driven([act.moment for act in acting], omega)
        moment, by_unknown, exchanged = _with_mesh_losses(factors, acting, moved)
        return plain._replace(moment=moment, by_unknown=by_unknown, exchanged=exchanged, transmitted=self._of_lossy(passed))

    def _driven(self, moments: list[Any], omega: Array) -> tuple[list[Array], tuple[Any, ...], tuple[Any, ...]]:
        """The moments that drive the inertia of every part at a constant speed, those through their meshes, and K."""
        moved = [0.5 * part.slope * omega**2 for part in self.parts]
        own = [inert - moment for inert, moment in zip(moved, moments, strict=True)]
        return moved, *passed_by(own, self.machine.stages, (1.0,) * len(own), lambda tau: tau > 0.0)

    def net_work(
        self, speed: float | Array, unknown: float = 0.0, states: States | None = None, *, losses: bool = True
    ) -> Array:
        """Net work (J) of a cycle run at a constant crank speed (rad/s), or at each of several (n,).

        With `losses` false it is the work without those in meshes.
        """
        speed = np.asarray(speed, dtype=float)
        omega = speed[..., None, None]
        states = self.steady_states(omega) if states is None else states
        moving = [
            sum((effort + unknown * factor for effort, factor in self._moving(part, omega)), 0.0) for part in self.parts
        ]
        if self.circuit is not None:
            driven = next(k for k, part in enumerate(self.parts) if part.stage.drives)
            moving[driven] = moving[driven] + self.drive_ratio * self.circuit.torque(self.drive_ratio * omega, states)
        if not (self.lossy and losses):
            still, by_unknown, resistance = self._still
            return np.asarray(still + unknown * by_unknown - resistance * speed + self._total(sum(moving)))
        moments = [
            part.moment + unknown * part.per_unknown - part.resistance * omega + own
            for part, own in zip(self.parts, moving, strict=True)
        ]
        moved, _, factors = self._driven(moments, omega)
        rows = zip(factors, moments, moved, strict=True)
        return cells.total(_sum(k * moment - (k - 1.0) * inert for k, moment, inert in rows), self.mesh.half)

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
        """Work over the cycle of laws without speed; its derivative by the unknown; that of resistance by the speed."""
        rows = [[part.moment, part.per_unknown, part.resistance] for part in self.parts]
        return cells.total(np.sum(rows, axis=0), self.mesh.half)

    def constant_losses(self, speed: Any, unknown: Any) -> list[Array]:
        """The moments that lossy meshes transmit outwards at a constant speed: losses have a kink where these are zero."""
        return [*self.constant(speed, unknown).transmitted] if self.lossy else []

    def steady_states(self, omega: Any) -> tuple[Any, ...]:
        """The states of a motor's circuit that do not change at constant crank speeds (rad/s); none without one.

        For a motor that runs in step at one speed only, they are those that carry the mean load there.
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
        """The states of a synchronous motor that carries the mean load in step; None if that is beyond its pull-out."""
        circuit = self.circuit
        assert circuit is not None
        assert circuit.only_speed is not None
        speed = circuit.only_speed / self.drive_ratio
        if self.lossy:
            return circuit.carrying(lambda states: float(self.net_work(speed, states=states)))
        others = float(self.net_work(speed, states=circuit.steady(circuit.only_speed)))
        way = self.drive_ratio * self.mesh.edges[-1]
        return circuit.carrying(lambda states: others + float(way * circuit.torque(circuit.only_speed, states)))

    def _of_lossy(self, transmitted: Sequence[Array]) -> tuple[Array, ...]:
        return tuple(tau for part, tau in zip(self.parts, transmitted, strict=True) if part.stage.efficiency < 1.0)

    def _acting(self, part: _MachinePart, omega: Array, unknown: Any, states: States) -> Rate:
        shape = np.broadcast_shapes(omega.shape, self.mesh.phi.shape)
        if part.stage.shaft in self._of_position and shape == self.mesh.phi.shape:
            return self._of_position[part.stage.shaft]
        terms = at_speeds(part, self._moving(part, Jet(omega, 1.0)), omega, unknown)
        moment, by_speed, by_unknown, exchanged = (wide(term, shape) for term in terms)
        by_states: Array = np.zeros((len(states), *shape))
        if self.circuit is not None and part.stage.drives and len(states):
            ratio, circuit = self.drive_ratio, self.circuit
            driving, slopes = ratio * circuit.torque(ratio * omega, states), circuit.slopes(ratio * omega, states)
            for k, slope in enumerate(slopes.torque_by_states):
                by_states[k] = ratio * slope
            moment, exchanged = moment + driving, exchanged + np.abs(driving)
            by_speed = by_speed + ratio * ratio * slopes.torque_by_speed
        return Rate(moment, by_speed, by_unknown, np.zeros(shape), by_states, exchanged)

    @cached_property
    def _of_position(self) -> dict[str, Rate]:
        """The moments of every part on which neither a speed nor the unknown nor a motor's states act, by its shaft."""
        if self.machine.scene.unknown is not None or self.circuit is not None:
            return {}
        zero = np.zeros(self.mesh.phi.shape)
        return {
            part.stage.shaft: Rate(part.moment, zero, zero, zero, np.zeros((0, *zero.shape)), part.exchanged)
            for part in self.parts
            if not (part.stage.reduction.moving or part.resistance.any())
        }

    def _moving(self, part: _MachinePart, omega: Any) -> list[tuple[Any, Any]]:
        """Moments that depend on speed, and their factors of the unknown, without those of a motor's circuit."""
        plain = omega.value if isinstance(omega, Jet) else omega
        terms = part.station.contributions(omega, 0.0, self._deciding(plain), local=self.local)
        if terms:
            count(plain)
        by_circuit = self.circuit is not None
        return [(effort, factor) for element, effort, factor in terms if not (by_circuit and element.name.startswith(DRIVE))]

    def _acceleration(self, inertias: list[Array], bare: list[Array]) -> tuple[Array, tuple[Array, ...], tuple[Array, ...]]:
        """The equation of motion at speeds on the mesh (see `solved`); a cell's directions are decided in its middle."""
        *lead, nodes = bare[0].shape
        shape = (*lead, nodes if self.local else 1)
        if not self._directions or self._directions[-1].shape != shape:
            self._directions = tuple(np.ones(shape) for _ in self.parts)
        acceleration, _, passed, self._directions = solved(
            inertias, bare, self._directions, self.machine.stages, lambda tau: self._deciding(tau) > 0.0
        )
        return acceleration, passed, self._directions

    def drive(self, omega: Array, unknown: float, states: States = ()) -> Array:
        """The drive's share of F (N m, on the crank), before losses."""
        zero = np.zeros_like(omega)
        if self.circuit is not None and len(states):
            return np.asarray(zero + self.drive_ratio * self.circuit.torque(self.drive_ratio * omega, states))
        station = next(part.station for part in self.parts if part.stage.drives)
        still = station.moments(unknown).get("drive", 0.0)
        moving = station.contributions(omega, 0.0, self._deciding(omega), local=self.local)
        efforts = [effort + unknown * factor for element, effort, factor in moving if element.name.startswith(DRIVE)]
        return np.asarray(sum(efforts, zero + still))

    def switches(self, omega: Array) -> list[Array]:
        """Values on (cells, nodes) whose signs decide branches of laws and that depend on speed."""
        angles: list[Array] = []
        for part, efforts in zip(self.parts, self.machine.switching, strict=True):
            places = part.station.places(omega, 0.0, self._deciding(omega), local=self.local) if efforts else ()
            for element, here, anchor in places:
                if element.name in efforts:
                    angles += [wide(switch, omega.shape) for switch in efforts[element.name].speed_switches(here, anchor)]
        return angles

    def _deciding(self, values: Array) -> Array:
        """Values where branches are decided."""
        return values if self.local or values.shape[-1] == 1 else values[..., MIDDLE : MIDDLE + 1]


def moments_on(machine: Machine, edges: Array, *, local: bool = False) -> Moments:
    """The machine on cells between edges (rad): the last few are kept, because a search needs the same ones repeatedly."""
    kept, key = machine.kept.setdefault("moments", {}), edges.tobytes()
    if key not in kept:
        if len(kept) >= _KEPT:
            kept.pop(next(iter(kept)))
        kept[key] = Moments(machine, cells.cells(edges))
    moments: Moments = kept[key]
    return moments.locally if local else moments


def _together(acting: list[Rate]) -> Rate:
    """The sum of the rates of all parts."""
    if len(acting) == 1:
        return acting[0]
    columns: list[Any] = [_sum(column) for column in zip(*(act[:-1] for act in acting), strict=True)]
    return Rate(*columns)


def _with_mesh_losses(factors: Sequence[Array], acting: list[Rate], moved: list[Array]) -> tuple[Array, Array, Array]:
    """The moment of all parts on the crank through their meshes, its slope by the unknown, and the sum of sizes.

    M - sum (k - 1) tau with tau = `moved` - M of each part, as sum k M - (k - 1) `moved`: so a small k, of a very low
    efficiency, keeps its digits.
    """
    lost_moved = [(k - 1.0) * inert for k, inert in zip(factors, moved, strict=True)]
    rows = list(zip(factors, acting, lost_moved, strict=True))
    return (
        np.asarray(_sum(k * act.moment - inert for k, act, inert in rows)),
        np.asarray(_sum(k * act.by_unknown for k, act, _ in rows)),
        np.asarray(_sum(k * act.exchanged + np.abs(inert) for k, act, inert in rows)),
    )


def undefined(machine: Machine, mesh: Cells, values: Array, omega: Array | None = None) -> Fault:
    """The fault of the load without a finite value where values on a mesh have none, at crank speeds (rad/s) there."""
    cell, node = np.argwhere(~(np.abs(values) <= GREATEST_VALUE))[0]
    speed = None if omega is None else float(omega[cell, node])
    return not_finite(machine, float(mesh.phi[cell, node]), float(mesh.anchor[cell, 0]), speed)


def not_finite(machine: Machine, phi: float, anchor: float, speed: float | None = None, time: float = 0.0) -> Fault:
    """The fault of a load, or else the mechanism, that has no finite value at a position, or too large a one.

    Args:
        machine: the machine.
        phi: the position, rad.
        anchor: a position in the middle of the smooth piece that it lies in, rad.
        speed: of the crank, rad/s, where loads that depend on it count.
        time: s, for those that depend on it.

    """
    parts = machine.reduction.moments(phi, anchor, by_name=True, speed=speed, time=time)
    culprit, moment = next(
        ((name, part) for name, part in parts.items() if not abs(part) <= GREATEST_VALUE), ("mechanism", None)
    )
    at, sliding = machine.where(phi), machine.scene.stroke is not None and machine.scene.stroke.sliding
    if speed is not None and any(effort.path == culprit and effort.uses_speed for effort in machine.efforts):
        at += f" and {speed:.6g} {'m/s' if sliding else 'rad/s'}"
    if moment is not None and math.isfinite(moment):
        unit = "N on the slide" if sliding else "N m on the crank"
        defect = f"a value that reaches {moment:.4g} {unit} at {at}, beyond {GREATEST_VALUE:g}"
    else:
        reason = machine.undefined(culprit, phi, anchor, speed, time)
        defect = f"a value that is not finite at {at}" + (f" ({reason})" if reason else "")
    return Fault(
        culprit,
        defect,
        f"finite forces and torques over the whole {'cycle' if machine.scene.stroke is None else 'stroke'}",
        "correct the expression or table, or give the load a window that leaves the angle out",
    )


class NoMotionError(ValueError):
    """No periodic motion has the required mean of the extreme speeds: the machine would stop within the cycle."""
