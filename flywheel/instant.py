"""The motion's equation at one instant: acceleration, power and a motor's current, from the bond graph, for time stepping.

It is apart from the series and cells of the steady regime: it shares with them I*, M* and the laws alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.reduction import Station
from flywheel.chain import Chain, Stage
from flywheel.loads import Effort
from flywheel.moments import DRIVE, circuit_of
from flywheel.piecewise import ROUNDING, wide

Array = NDArray[np.float64]

_INSET = 1e-10  # of a piece: how far from its ends a law is read that is not defined there


class Anchor(NamedTuple):
    """Where branches are decided: a position (rad), a crank speed (rad/s) and a time (s) inside a smooth stretch of motion.

    Without a speed and a time those that depend on them are decided at every instant itself.
    `factors` are those of the meshes there (see `Instant`); None where they are to be found at every instant.
    """

    phi: Any
    omega: Any
    time: Any
    factors: tuple[Any, ...] | None = None


class Instant(NamedTuple):
    """What a machine does at one instant, at its crank: acceleration (rad/s²), moment M* less losses (N m), I* + J (kg m²).

    `loss` is what the meshes take of the moment (N m), `current_rate` the rate of a motor's current (A/s). The energy of the
    machine changes by moment * omega. `passed` is what the crank passes to every stage (N m), and `factors` what it gives
    for that: 1/efficiency where it drives, efficiency where it is driven.
    """

    acceleration: Any
    moment: Any
    inertia: Any
    loss: Any
    current_rate: Any = 0.0
    passed: tuple[Any, ...] = ()
    factors: tuple[Any, ...] = ()


class _Part(NamedTuple):
    efficiency: float
    inertia: Any
    slope: Any
    moment: Any


class Dynamics:
    """A machine with a flywheel (kg m² at the crank) and a value of its unknown, at any position, speed and time.

    `circuit` is the motor where its current is a state of its own, else None.
    """

    def __init__(self, machine: Chain, inertia: float, balance: float = 0.0) -> None:
        self.machine, self.inertia, self.balance = machine, inertia, balance
        self.circuit = circuit_of(machine.scene)
        drive = machine.scene.drive
        self.ratio = 1.0 if drive is None else machine.scene.shafts[drive.on]
        self._efforts = {effort.path: effort for effort in machine.efforts}

    def at(
        self,
        phi: float,
        middle: float,
        omega: float,
        time: float = 0.0,
        *,
        current: float = 0.0,
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
        parts = [self._part(stage, phi, place, omega, time, current) for stage in self.machine.stages]
        if ends is not None and not all(math.isfinite(part.moment) for part in parts):
            low, high = _inside(ends)
            held = min(max(phi, low), high)
            return self.at(held, middle, omega, time, current=current, anchor=anchor)
        if beyond:
            parts[0] = parts[0]._replace(inertia=parts[0].inertia + beyond * sum(part.slope for part in parts))
        return self._instant(parts, omega, current, place.factors)

    def along(
        self,
        phi: Array,
        anchor: Anchor,
        omega: Array,
        time: Array,
        current: Any = 0.0,
        ends: tuple[float, float] | None = None,
    ) -> Instant:
        """The instants at arrays of positions, speeds and times; all of `anchor` is given, as arrays or numbers.

        With the `ends` of a piece, a law that stops being defined there is read just inside, as by `at`.
        """
        phi = np.asarray(self._inside(phi)[0])
        parts = [self._part(stage, phi, anchor, omega, time, current) for stage in self.machine.stages]
        if ends is not None and not all(np.isfinite(part.moment).all() for part in parts):
            return self.along(np.clip(phi, *_inside(ends)), anchor, omega, time, current)
        factors = anchor.factors or tuple(1.0 for _ in parts)
        found = self._instant(parts, omega, current, factors)
        return found._replace(
            acceleration=wide(found.acceleration, phi.shape),
            moment=wide(found.moment, phi.shape),
            inertia=wide(found.inertia, phi.shape),
            loss=wide(found.loss, phi.shape),
            passed=tuple(wide(value, phi.shape) for value in found.passed),
        )

    def moments(self, phi: Array, anchor: Anchor, omega: Array, time: Array, current: Any = 0.0) -> dict[str, Array]:
        """The moment (N m, on the crank) of all that pushes or drags, by its part: loads, weights, springs, dampers."""
        phi = np.asarray(self._inside(phi)[0])
        found: dict[str, Any] = {}
        for stage in self.machine.stages:
            station = stage.reduction.at(phi, anchor.phi)
            rows = [*station.moments(self.balance).items()]
            rows += [(part, -value * omega) for part, value in station.resistances().items()]
            rows += self._moving(station, stage, anchor, omega, time, current)
            for part, value in rows:
                found[part] = found.get(part, 0.0) + value
        return {part: wide(value, phi.shape) for part, value in found.items()}

    def switches(self, phi: Any, anchor: Anchor, omega: Any, time: Any) -> list[Any]:
        """What decides branches by its sign and depends on speed or time, in the order of the loads."""
        phi, found = self._inside(phi)[0], []
        for stage in self.machine.stages:
            places = stage.reduction.at(phi, anchor.phi).places(omega, time, anchor.omega, anchor.time)
            for element, here, there in places:
                if not self._of_circuit(element.name):
                    found += self._efforts[element.name].speed_switches(here, there)
        return found

    def sides(self, phi: Array, anchor: Anchor, omega: Array, time: Array, current: Any = 0.0) -> list[Array]:
        """What changes its sign where a stretch of motion ends: switches, and what meshes with losses pass."""
        rows = [wide(value, phi.shape) for value in self.switches(phi, anchor, omega, time)]
        if anchor.factors is not None:
            rows += self.along(phi, anchor, omega, time, current).passed[1:]
        return rows

    @property
    def branching(self) -> bool:
        """Whether some branch depends on speed or time, or on which side of a mesh drives."""
        moving = [effort for effort in self.machine.efforts if effort.uses_speed or effort.uses_time]
        return len(self.machine.stages) > 1 or any(_branches(effort) for effort in moving)

    def _inside(self, phi: Any) -> tuple[Any, Any]:
        """The position, or the end of the stroke that it lies past, and by how much it does."""
        if self.machine.scene.stroke is None:
            return phi, 0.0
        held = np.clip(phi, 0.0, self.machine.scene.cycle)
        return held, phi - held

    def _part(self, stage: Stage, phi: Any, anchor: Anchor, omega: Any, time: Any, current: Any) -> _Part:
        station = stage.reduction.at(phi, anchor.phi)
        reduced = station.reduced
        moment = reduced.moment + self.balance * reduced.per_unknown - reduced.resistance * omega
        for _, value in self._moving(station, stage, anchor, omega, time, current):
            moment = moment + value
        inertia = reduced.inertia + (self.inertia if stage.carries_flywheel else 0.0)
        return _Part(stage.efficiency, inertia, reduced.slope, moment)

    def _moving(
        self, station: Station, stage: Stage, anchor: Anchor, omega: Any, time: Any, current: Any
    ) -> Iterator[tuple[str, Any]]:
        """Part and moment of what depends on speed, time or current."""
        if self.circuit is not None and stage.drives:
            torque = self.circuit.torque_of_current(self.ratio * omega, current)
            yield "drive", self.ratio * torque
        if stage.reduction.moves:
            for element, effort, factor in station.contributions(omega, time, anchor.omega, anchor.time):
                if not self._of_circuit(element.name):
                    yield element.part or element.name, effort + self.balance * factor

    def _of_circuit(self, name: str) -> bool:
        """Whether a source is the quasi-static law of a motor whose current is followed instead."""
        return self.circuit is not None and name.startswith(DRIVE)

    def _instant(self, parts: Sequence[_Part], omega: Any, current: Any, factors: tuple[Any, ...] | None) -> Instant:
        acceleration, loss, passed, used = _accelerated(parts, omega, factors)
        return Instant(
            acceleration=acceleration,
            moment=sum(part.moment for part in parts) - loss,
            inertia=sum(part.inertia for part in parts),
            loss=loss,
            current_rate=0.0 if self.circuit is None else self.circuit.current_rate(self.ratio * omega, current),
            passed=passed,
            factors=used,
        )


def _inside(ends: tuple[float, float]) -> tuple[float, float]:
    """The ends of a piece, drawn in to where its laws are defined."""
    inset = max(_INSET * (ends[1] - ends[0]), 64 * ROUNDING * ends[1])
    return ends[0] + inset, ends[1] - inset


def _branches(effort: Effort) -> bool:
    from flywheel.loads import moving_switches

    return bool(moving_switches(effort.load.law))  # type: ignore[arg-type]


def _accelerated(
    parts: Sequence[_Part], omega: Any, factors: tuple[Any, ...] | None
) -> tuple[Any, Any, tuple[Any, ...], tuple[Any, ...]]:
    """Acceleration, what the meshes lose, what is passed to each stage, the factors: sum k (I alpha + ½ I' omega² - M) = 0.

    k = 1/efficiency where the crank drives. The sum grows with alpha whatever the directions, so that one set of them fits.
    """
    square = 0.5 * omega * omega
    bare = [part.slope * square - part.moment for part in parts]
    if len(parts) == 1:
        total = parts[0].inertia
        return (-bare[0] / total if np.all(total) else math.inf), 0.0, (), ()
    found, given = factors or (1.0,) * len(parts), factors is not None
    for _ in range(2 + 2 ** len(parts)):
        weight = sum(k * part.inertia for k, part in zip(found, parts, strict=True))
        acceleration = -sum(k * b for k, b in zip(found, bare, strict=True)) / weight
        passed = tuple(part.inertia * acceleration + b for part, b in zip(parts, bare, strict=True))
        fitting = found if given else tuple(_factor(p, tau, omega) for p, tau in zip(parts, passed, strict=True))
        if fitting == found:
            break
        found = fitting
    loss = sum((k - 1.0) * tau for k, tau in zip(found, passed, strict=True))
    return acceleration, loss, passed, found


def _factor(part: _Part, passed: float, omega: float) -> float:
    """What the crank gives for what it passes: 1/efficiency where it drives, efficiency where it is driven."""
    return 1.0 / part.efficiency if passed * (-1.0 if omega < 0.0 else 1.0) > 0.0 else part.efficiency
