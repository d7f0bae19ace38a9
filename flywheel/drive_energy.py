"""Power and energy of a sized machine's drive over its steady cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flywheel import piecewise, steady
from flywheel.energy import Energy

if TYPE_CHECKING:
    from flywheel.regime import Cycle
    from flywheel.results import Sizing


def energy_of(sizing: Sizing) -> Energy | None:
    """Mean and peak power with the flywheel, and of a motor that follows the loads without one at the constant speed.

    None for a machine without a drive, a motion or a cycle (a diagram of areas). Peaks are found where the slope of power is
    zero, and at the ends of smooth pieces.
    """
    cycle, run, machine = sizing.cycle, sizing.run, sizing.machine
    if cycle is None or run is None or machine is None or machine.scene.drive is None:
        return None
    mesh, speed = cycle.mesh, sizing.speed
    omega = steady.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    drive = run.drive
    if drive is None:
        moments = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0)
        drive = moments["drive"] + np.zeros_like(mesh.phi)
    period, _ = steady.period(cycle, speed, run, sizing.rtol)
    work = _told(float(piecewise.integral(drive, mesh.half).sum()), cycle)
    moment = cycle.series[0] @ piecewise.basis(piecewise.NODES, piecewise.ORDER).T
    follows = drive - moment  # what the loads and losses take, and a motor without a flywheel would have to give
    alone = _told(float(piecewise.integral(follows, mesh.half).sum()), cycle) / machine.scene.cycle * speed
    return Energy(
        period=period,
        work=work,
        mean_power=work / period,
        peak_power=_peak(drive * omega),
        mean_power_alone=alone,
        peak_power_alone=_peak(follows * speed),
    )


def _told(work: float, cycle: Cycle) -> float:
    """A work (J), or 0 where rounding leaves nothing of it: ratios to it would be noise."""
    return 0.0 if abs(work) <= cycle.errors.work else work


def _peak(power: piecewise.Array) -> float:
    """The power that is largest in size, with its sign (W)."""
    series = piecewise.fit(power)
    high, low = piecewise.greatest(series), -piecewise.greatest(-series)
    return high if high >= -low else low
