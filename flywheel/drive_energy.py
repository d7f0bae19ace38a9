"""Power and energy of a sized machine's drive over its steady cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flywheel import piecewise, steady
from flywheel.energy import Energy

if TYPE_CHECKING:
    from flywheel.results import Sizing

_TIE = 1e-9  # share within which two sizes are one


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def energy_of(sizing: Sizing) -> Energy | None:
    """Mean and peak power and rms torque with the flywheel; powers of a motor that follows the loads without one.

    None for a machine without a drive, a motion that runs on or a cycle (a diagram of areas). Peaks are found where the
    slope of power is zero, and at the ends of smooth pieces.
    """
    cycle, run, machine = sizing.cycle, sizing.run, sizing.machine
    if cycle is None or run is None or machine is None or machine.scene.drive is None:
        return None
    mesh, speed = cycle.mesh, sizing.speed
    omega = steady.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    if not omega.min() > 0.0:  # rounding of enormous torques has stopped it
        return None
    drive = run.drive
    if drive is None:
        moments = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0)
        drive = moments["drive"] + np.zeros_like(mesh.phi)
    period, _ = steady.period(cycle, speed, run, sizing.rtol)
    work = _told(float(piecewise.integral(drive, mesh.half).sum()), cycle.errors.work)
    moment = cycle.series[0] @ piecewise.basis(piecewise.NODES, piecewise.ORDER).T
    follows = drive - moment  # what the loads and losses take, and a motor without a flywheel would have to give
    alone = _told(float(piecewise.integral(follows, mesh.half).sum()), cycle.errors.work) / machine.scene.cycle * speed
    noise = cycle.errors.work / machine.scene.cycle  # of a moment
    return Energy(
        period=period,
        work=work,
        mean_power=work / period,
        peak_power=_told(_peak(drive * omega), noise * speed),
        mean_power_alone=alone,
        peak_power_alone=_told(_peak(follows * speed), noise * speed),
        rms_torque=_told(_rms(drive, omega, mesh.half), noise) / machine.scene.shafts[machine.scene.drive.on],
    )


def _rms(moment: piecewise.Array, omega: piecewise.Array, half: piecewise.Array) -> float:
    """Root of the mean square of a moment (N m) over time: sqrt(integral of M²/omega dphi / integral of 1/omega dphi)."""
    greatest = float(np.abs(moment).max()) or 1.0  # squares of enormous moments leave the floating-point range
    share = moment / greatest
    square, time = (float(piecewise.integral(values, half).sum()) for values in (share**2 / omega, 1.0 / omega))
    return greatest * float(np.sqrt(square / time))


def _told(value: float, error: float) -> float:
    """A figure, or 0 where rounding leaves nothing of it: ratios to it would be noise."""
    return 0.0 if abs(value) <= error else value


def _peak(power: piecewise.Array) -> float:
    """The power that is largest in size, with its sign (W); where both signs are as large, the positive one."""
    series = piecewise.fit(power)
    high, low = piecewise.greatest(series), -piecewise.greatest(-series)
    return high if high >= -low * (1 - _TIE) else low
