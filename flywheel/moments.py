"""The moment that changes a machine's energy, on a mesh of crank angles, at any speed.

Everything that depends on position alone is walked once: inertias, moments, influence coefficients. What depends on speed
is evaluated there as often as wanted, with its slope. Meshes with losses add what these take: a shaft geared to the crank
with an efficiency below 1 takes from it, or gives it, less than its own share of the moment.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph import counting
from bondgraph.reduction import Reduction, Station
from flywheel.chain import Chain
from flywheel.formulas.jets import Jet
from flywheel.motors.dc import DC
from flywheel.piecewise import MIDDLE, Cells, wide
from flywheel.scene import Scene

Array = NDArray[np.float64]

DRIVE = "drive."  # how the names of the drive's elements begin


class Rate(NamedTuple):
    """dE/dphi = F of the whole machine's kinetic energy (J/rad), at given speeds, on (cells, nodes).

    `by_speed` is dF/domega, `by_unknown` dF/du of the scene's balance, `by_inertia` dF/dJ of the flywheel's inertia (0 but
    for losses), `by_current` dF/di of a motor's current. `exchanged` is the sum of |contributions|.
    """

    moment: Array
    by_speed: Array
    by_unknown: Array
    by_inertia: Array
    by_current: Array
    exchanged: Array


class _Part(NamedTuple):
    """What hangs on the crank through one mesh, or on the crank itself (efficiency 1), reduced to the crank."""

    efficiency: float
    carries_flywheel: bool
    drives: bool
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
    by_current: Array
    exchanged: Array


class _Felt(NamedTuple):
    """What the crank feels of all parts through their meshes."""

    moment: Array
    by_unknown: Array
    exchanged: Array


class Moments:
    """A machine on a mesh, ready to tell F at any speeds, flywheels and values of its unknown.

    `inertia` and `slope` (cells, nodes) are I* and dI*/dphi without the flywheel, `steepness` the sum of the sizes of what
    makes up the latter. What a law or a mesh does at a speed is
    decided in the middle of every cell, or, where cells do not end at switches yet, at every node (`local`).
    """

    def __init__(self, machine: Chain, mesh: Cells, *, local: bool = False) -> None:
        self.machine, self.mesh, self.local = machine, mesh, local
        self.parts = [self._part(stage.reduction, stage) for stage in machine.stages]
        self.inertia: Array = np.sum([part.inertia for part in self.parts], axis=0)
        self.slope: Array = np.sum([part.slope for part in self.parts], axis=0)
        self.steepness: Array = np.sum([part.steepness for part in self.parts], axis=0)
        self.lossy = any(part.efficiency < 1.0 for part in self.parts)
        self.circuit = circuit_of(machine.scene)
        self.drive_ratio = 1.0 if machine.scene.drive is None else machine.scene.shafts[machine.scene.drive.on]

    def _part(self, reduction: Reduction, stage: Any) -> _Part:
        phi, station = self.mesh.phi, reduction.at(self.mesh.phi, self.mesh.anchor)
        reduced = station.reduced
        whole = partial(wide, shape=phi.shape)
        return _Part(
            efficiency=stage.efficiency,
            carries_flywheel=stage.carries_flywheel,
            drives=stage.drives,
            station=station,
            resistance=whole(reduced.resistance),
            inertia=whole(reduced.inertia),
            slope=whole(reduced.slope),
            moment=whole(reduced.moment),
            per_unknown=whole(reduced.per_unknown),
            exchanged=whole(reduced.exchanged),
            steepness=whole(reduced.steepness),
        )

    def rate(self, omega: Array, unknown: float, inertia: float, current: Array | None = None) -> Rate:
        """F at crank speeds omega (rad/s) on the mesh, for a value of the unknown and a flywheel (kg m², on the crank)."""
        acting = self._all_acting(omega, unknown, current)
        plain = _summed(acting)
        if not self.lossy:
            zero = np.zeros_like(omega)
            return Rate(plain.moment, plain.by_speed, plain.by_unknown, zero, plain.by_current, plain.exchanged)
        return self._with_losses(acting, plain, omega, inertia)

    def constant(self, speed: float | Array, unknown: float) -> Rate:
        """F at a constant crank speed (rad/s), or at several, shape (speeds, cells, nodes).

        Inertias that vary are driven, but nothing is accelerated.
        """
        omega = np.asarray(speed, dtype=float)[..., None, None] + np.zeros_like(self.mesh.phi)
        acting, transmitted = self._unaccelerated(omega, unknown)
        plain = _summed(acting)
        factors = [_given_for(part, tau) for part, tau in zip(self.parts, transmitted, strict=True)]
        lifted = [0.5 * part.slope * omega**2 for part in self.parts]
        felt = _felt(factors, acting, lifted)
        return Rate(felt.moment, plain.by_speed, felt.by_unknown, np.zeros_like(omega), plain.by_current, felt.exchanged)

    def constant_losses(self, speed: float, unknown: float) -> list[Array]:
        """What each lossy mesh transmits from the crank at a constant speed: its losses have a kink where that is zero."""
        if not self.lossy:
            return []
        _, transmitted = self._unaccelerated(np.full(self.mesh.phi.shape, speed), unknown)
        return self._of_lossy(transmitted)

    def _unaccelerated(self, omega: Array, unknown: float) -> tuple[list[_Acting], list[Array]]:
        """What acts on every part at a constant speed, and what the crank transmits to each."""
        current = None if self.circuit is None else self.steady_current(omega)
        acting = self._all_acting(omega, unknown, current)
        return acting, [0.5 * p.slope * omega**2 - act.moment for p, act in zip(self.parts, acting, strict=True)]

    def steady_current(self, omega: Array) -> Array:
        """The currents (A) that do not change at constant crank speeds (rad/s)."""
        assert self.circuit is not None
        return np.asarray(self.circuit.current(self.drive_ratio * omega))

    def transmitted(self, omega: Array, unknown: float, inertia: float, current: Array | None = None) -> list[Array]:
        """What each lossy mesh transmits from the crank (N m, on the crank)."""
        _, transmitted, _ = self._solved(self._all_acting(omega, unknown, current), omega, inertia)
        return self._of_lossy(transmitted)

    def _of_lossy(self, transmitted: list[Array]) -> list[Array]:
        return [tau for part, tau in zip(self.parts, transmitted, strict=True) if part.efficiency < 1.0]

    def _all_acting(self, omega: Array, unknown: float, current: Array | None) -> list[_Acting]:
        return [self._acting(part, omega, unknown, current) for part in self.parts]

    def _acting(self, part: _Part, omega: Array, unknown: float, current: Array | None) -> _Acting:
        moment = part.moment + unknown * part.per_unknown - part.resistance * omega
        by_speed, by_unknown = np.zeros_like(omega) - part.resistance, np.zeros_like(omega) + part.per_unknown
        exchanged = part.exchanged + np.abs(unknown * part.per_unknown) + part.resistance * omega
        by_current: Array = np.zeros_like(omega)
        if self.circuit is not None and part.drives and current is not None:
            ratio, circuit = self.drive_ratio, self.circuit
            driving = ratio * circuit.torque_of_current(ratio * omega, current)
            by_current = np.full_like(omega, ratio * circuit.constant)
            moment, exchanged = moment + driving, exchanged + np.abs(driving)
            by_speed = by_speed - ratio * ratio * circuit.friction
        moving = part.station.contributions(Jet(omega, 1.0), 0.0, self._deciding(omega), local=self.local)
        if moving:
            counting.count(omega)
        for element, effort, factor in moving:
            if self.circuit is not None and element.name.startswith(DRIVE):
                continue
            value, slope = _with_slope(effort, omega)
            factor_value, factor_slope = _with_slope(factor, omega)
            moment = moment + value + unknown * factor_value
            by_speed = by_speed + slope + unknown * factor_slope
            by_unknown = by_unknown + factor_value
            exchanged = exchanged + np.abs(value + unknown * factor_value)
        return _Acting(moment, by_speed, by_unknown, by_current, exchanged)

    # -- losses in meshes ----------------------------------------------------------------------------------------------

    def _solved(self, acting: list[_Acting], omega: Array, inertia: float) -> tuple[Array, list[Array], list[Array]]:
        """d(omega²/2)/dphi, the transmitted moments, and the factor k of each: 1/eta where the crank drives, else eta.

        sum k (I y' + I' y - M) = 0 over the parts, y = omega²/2: monotone in y', so that one set of directions fits. They
        are decided in the middle of every cell.
        """
        y = 0.5 * omega * omega
        inertias = [part.inertia + inertia * part.carries_flywheel for part in self.parts]
        bare = [part.slope * y - act.moment for part, act in zip(self.parts, acting, strict=True)]
        factors: list[Array] = [np.ones((*omega.shape[:-1], 1)) for _ in self.parts]
        for _ in range(2 + 2 ** len(self.parts)):
            total = np.sum([k * i for k, i in zip(factors, inertias, strict=True)], axis=0)
            bend = -np.sum([k * b for k, b in zip(factors, bare, strict=True)], axis=0) / total
            transmitted = [i * bend + b for i, b in zip(inertias, bare, strict=True)]
            found = [_given_for(part, self._deciding(tau)) for part, tau in zip(self.parts, transmitted, strict=True)]
            if all(np.array_equal(a, b) for a, b in zip(found, factors, strict=True)):
                break
            factors = found
        return bend, transmitted, factors

    def _with_losses(self, acting: list[_Acting], plain: _Acting, omega: Array, inertia: float) -> Rate:
        bend, _, factors = self._solved(acting, omega, inertia)
        inertias = [part.inertia + inertia * part.carries_flywheel for part in self.parts]
        total = np.sum([k * i for k, i in zip(factors, inertias, strict=True)], axis=0)

        def loss(changes: list[Array], extra: list[Array] | None = None) -> Array:
            """What losses take of a change of every part's I' y - M, and of its inertia times y'."""
            bare = changes if extra is None else [c + e for c, e in zip(changes, extra, strict=True)]
            bend_change = -np.sum([k * b for k, b in zip(factors, bare, strict=True)], axis=0) / total
            shares = zip(factors, inertias, bare, strict=True)
            return np.asarray(np.sum([(k - 1.0) * (i * bend_change + b) for k, i, b in shares], axis=0))

        by_speed = [part.slope * omega - act.by_speed for part, act in zip(self.parts, acting, strict=True)]
        zeros = [np.zeros_like(omega) for _ in self.parts]
        heavier = [bend * part.carries_flywheel for part in self.parts]
        moved = [i * bend + 0.5 * part.slope * omega * omega for part, i in zip(self.parts, inertias, strict=True)]
        felt = _felt(factors, acting, moved)
        return Rate(
            moment=felt.moment,
            by_speed=plain.by_speed - loss(by_speed),
            by_unknown=plain.by_unknown - loss([-act.by_unknown for act in acting]),
            by_inertia=-loss(zeros, heavier),
            by_current=plain.by_current - loss([-act.by_current for act in acting]),
            exchanged=felt.exchanged,
        )

    def drive(self, omega: Array, unknown: float, current: Array | None = None) -> Array:
        """The drive's share of F (N m, on the crank), before losses."""
        zero = np.zeros_like(omega)
        if self.circuit is not None and current is not None:
            return np.asarray(zero + self.drive_ratio * self.circuit.torque_of_current(self.drive_ratio * omega, current))
        station = next(part.station for part in self.parts if part.drives)
        still = station.moments(unknown).get("drive", 0.0)
        moving = station.contributions(omega, 0.0, self._deciding(omega), local=self.local)
        found = [effort + unknown * factor for element, effort, factor in moving if element.name.startswith(DRIVE)]
        return np.asarray(sum(found, zero + still))

    def switches(self, omega: Array) -> list[Array]:
        """What decides branches of laws by its sign and depends on speed, on (cells, nodes)."""
        found: list[Array] = []
        for part in self.parts:
            for here, anchor, effort in self._moving_laws(part, omega):
                found += [wide(switch, omega.shape) for switch in effort.speed_switches(here, anchor)]
        return found

    def _moving_laws(self, part: _Part, omega: Array) -> list[tuple[Any, Any, Any]]:
        by_path = {effort.path: effort for effort in self.machine.efforts}
        places = part.station.places(omega, 0.0, self._deciding(omega), local=self.local)
        return [(here, anchor, by_path[element.name]) for element, here, anchor in places if element.name in by_path]

    def _deciding(self, values: Array) -> Array:
        """Values where branches are decided."""
        return values if self.local else values[..., MIDDLE : MIDDLE + 1]


def circuit_of(scene: Scene) -> DC | None:
    """The drive's motor where its current is a state of its own."""
    motor = scene.motor
    return motor if isinstance(motor, DC) and motor.inductance > 0.0 else None


def _summed(acting: list[_Acting]) -> _Acting:
    """What acts on all parts together."""
    return _Acting(*(np.sum(columns, axis=0) for columns in zip(*acting, strict=True)))


def _felt(factors: list[Array], acting: list[_Acting], moved: list[Array]) -> _Felt:
    """M - sum (k - 1) tau with tau = `moved` - M of each part, as sum k M - (k - 1) `moved`.

    So a small k, an efficiency of next to nothing, keeps its digits.
    """
    rows = list(zip(factors, acting, moved, strict=True))
    return _Felt(
        np.asarray(sum(k * act.moment - (k - 1.0) * inert for k, act, inert in rows)),
        np.asarray(sum(k * act.by_unknown for k, act, _ in rows)),
        np.asarray(sum(k * act.exchanged + np.abs((k - 1.0) * inert) for k, act, inert in rows)),
    )


def _given_for(part: _Part, tau: Array) -> Array:
    """What the crank gives for each N m that it transmits: 1/efficiency where it drives, efficiency where it is driven."""
    return np.where(tau > 0.0, 1.0 / part.efficiency, part.efficiency)


def _with_slope(value: Any, omega: Array) -> tuple[Array, Array]:
    """Value and slope of a jet, or of a number that does not depend on speed."""
    if isinstance(value, Jet):
        return value.value + np.zeros_like(omega), value.first + np.zeros_like(omega)
    return value + np.zeros_like(omega), np.zeros_like(omega)
