"""Engines: what the gas in their cylinders does in a cycle, and what of it reaches the loads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flywheel import piecewise, steady
from flywheel.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.faults import SceneError
from flywheel.piecewise import ROUNDING, Array
from flywheel.scene import Load

if TYPE_CHECKING:
    from flywheel.machine import Machine
    from flywheel.results import Sizing

_LOST = "losses"  # how the model of a load begins that nothing is gained by


class EngineCycle(NamedTuple):
    """What an engine does in a steady cycle; powers are works over its angle, times the mean of extremes.

    `indicated_work` (J) and `indicated_power` (W) of the gas on its pistons; `swept_volume` (m³) of all cylinders, as often
    as their gas works in the cycle, and `mean_effective_pressure` (Pa) over it, None where a bore is not known;
    `brake_work` and `brake_power` that the loads take, and `mechanical_efficiency`, their share in what is indicated, None
    where they take nothing. `error` (J) is that of the works.
    """

    indicated_work: float
    indicated_power: float
    swept_volume: float | None
    mean_effective_pressure: float | None
    brake_work: float | None
    brake_power: float | None
    mechanical_efficiency: float | None
    error: float

    def as_dict(self) -> dict[str, float | None]:
        """Everything for JSON, SI; the error stands with those of the other figures."""
        return {name: value for name, value in self._asdict().items() if name != "error"}


def mean_effective_pressure(work: float, swept_volume: float) -> float:
    """Mean effective pressure (Pa): the constant one that would do the same work in one stroke, p = W/V.

    Args:
        work: W of the gas in a cycle of the engine (two strokes or four), J; the brake's work for the brake's pressure.
        swept_volume: V of the pistons, m³.

    Raises:
        SceneError: if the volume is not above 0, or a number is not finite.

    Source: Khurmi and Gupta, Theory of Machines, chapter 15.

    >>> round(mean_effective_pressure(400.0, 500e-6) / 1e5, 12)  # bar
    8.0

    """
    refuse(number_faults("work", work, unit="J") + number_faults("swept_volume", swept_volume, POSITIVE, "m³"))
    return work / swept_volume


def mechanical_efficiency(brake: float, indicated: float) -> float:
    """Mechanical efficiency: the brake's work (or power) over the indicated one.

    Args:
        brake: what the engine gives, J or W.
        indicated: what its gas gives, J or W.

    Raises:
        SceneError: if a number is below 0, or the second 0.

    Source: Khurmi and Gupta, Theory of Machines, chapter 15.

    >>> mechanical_efficiency(300.0, 400.0)
    0.75

    """
    refuse(number_faults("brake", brake, NOT_NEGATIVE) + number_faults("indicated", indicated, POSITIVE))
    return brake / indicated


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def engine_of(sizing: Sizing) -> EngineCycle | None:
    """The engine of a sized machine: None where no gas drives it.

    The gas is that of the loads with a bore; without any, in a machine without a drive or with one that brakes, the forces
    on those ports that they drive over the cycle. The brake is what all other loads and the drive take, but for models of
    losses.
    """
    cycle, machine = sizing.cycle, sizing.machine
    if cycle is None or machine is None:
        return None
    gas = _gas(machine, driven=(sizing.drive_work or 0.0) >= 0.0 and machine.scene.drive is not None)
    if not gas:
        return None
    works, error = _works(sizing, machine)
    pistons = _driving(gas, works)
    indicated = sum(works[load.path] for load in pistons)
    if not pistons or indicated <= error:
        return None
    ports = {load.on for load in pistons}
    others = [load for load in machine.scene.loads if load.on not in ports and not load.model.startswith(_LOST)]
    taken = -sum(works[load.path] for load in others) - works.get("drive", 0.0)
    brake = taken if taken > error else None
    volume = _swept(machine, pistons)
    pace = sizing.speed / machine.scene.cycle
    return EngineCycle(
        indicated_work=indicated,
        indicated_power=indicated * pace,
        swept_volume=volume,
        mean_effective_pressure=None if volume is None else mean_effective_pressure(indicated, volume),
        brake_work=brake,
        brake_power=None if brake is None else brake * pace,
        mechanical_efficiency=None if brake is None else mechanical_efficiency(brake, indicated),
        error=error,
    )


def _gas(machine: Machine, *, driven: bool) -> list[Load]:
    """The loads that are gas, or may be in a machine that is not driven otherwise."""
    loads = machine.scene.loads
    known = [load for load in loads if load.piston is not None]
    if known or driven:
        return known
    return [load for load in loads if not machine.places[load.on].rotating]


def _driving(gas: list[Load], works: dict[str, float]) -> list[Load]:
    """Gas with a known piston; else that on the ports that it drives."""
    if gas[0].piston is not None:
        return gas
    driven = {port for port in {load.on for load in gas} if sum(works[load.path] for load in gas if load.on == port) > 0.0}
    return [load for load in gas if load.on in driven]


def _works(sizing: Sizing, machine: Machine) -> tuple[dict[str, float], float]:
    """The work (J) of every load and of the drive in the cycle, by their paths, and the error of them all."""
    cycle = sizing.cycle
    assert cycle is not None
    mesh, pace = cycle.mesh, None
    if machine.depends_on_speed:
        omega = np.full(mesh.phi.shape, sizing.speed)
        if sizing.run is not None:
            omega = steady.speed_over_cycle(cycle, sizing.speed, sizing.run, mesh.phi.ravel()).reshape(mesh.phi.shape)
        pace = omega
    moments = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0, by_name=True, speed=pace)
    names = {effort.path: effort.load.path for effort in machine.efforts}
    values = {names[name]: value + np.zeros_like(mesh.phi) for name, value in moments.items() if name in names}
    works = dict.fromkeys([load.path for load in machine.scene.loads], 0.0)
    works |= {path: float(piecewise.integral(value, mesh.half).sum()) for path, value in values.items()}
    error = cycle.errors.work + cycle.errors.residual + sum(_tail(value, mesh.half) for value in values.values())
    run = sizing.run
    if pace is not None and run is not None:  # and what the error of the speed may change of what depends on it
        error += 2 * (0.5 * run.irregularity * run.error + run.level_error) * cycle.exchanged
    return works, error


def _tail(values: Array, half: Array) -> float:
    tails = piecewise.tails(piecewise.fit(values))
    exchanged = float(piecewise.integral(np.abs(values), half).sum())
    return float((piecewise.TAIL_OF_INTEGRAL * tails * half[:, 0]).sum()) + 24 * ROUNDING * exchanged


def _swept(machine: Machine, pistons: list[Load]) -> float | None:
    """The volume (m³) that pistons sweep in one stroke, as often as the gas in front of each works in the cycle."""
    from flywheel.mechanisms.ends import ends_of  # only engines pay for it

    found: dict[Any, float] = {}
    for load in pistons:
        if load.piston is None:
            return None
        name, _, port = load.on.rpartition(".")
        mechanism = next(m for m in machine.scene.mechanisms if m.name == name)
        try:
            ends = ends_of(mechanism, port, machine.scene.parameters)
        except SceneError:  # a port whose turning points cannot be told
            return None
        times = machine.scene.shafts[mechanism.shaft] * machine.scene.cycle / load.every
        space = load.path if load.model else ""  # the model's own; loads with a bore on one port share the cylinder
        found[load.on, space] = load.piston * (ends.high - ends.low) * round(times)
    return sum(found.values())
