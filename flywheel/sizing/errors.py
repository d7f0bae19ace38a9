"""The estimated error of every figure of a sizing, under the names that its JSON has them by.

What a sizing estimates as it goes (`results.Errors`) is about what is searched for; the rest follows from it here, and only
where it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flywheel.numerics import cells as piecewise
from flywheel.numerics.cells import ROUNDING
from flywheel.regime import steady_motion
from flywheel.regime.turning_moment import inertia_extent

if TYPE_CHECKING:
    from flywheel.regime.results import Sizing
    from flywheel.regime.turning_moment import Cycle


Estimate = float | None | dict[str, float | None]

_READ = 4 * ROUNDING  # of a figure that is the scene's own, or a product of a few such
_APART = 1e-6  # share by which a speed is changed to see what depends on it


class Drive(NamedTuple):
    """Absolute errors of what the drive does: of its work in a cycle (J), of its moment on the crank anywhere (N m)."""

    work: float
    moment: float


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def estimates(sizing: Sizing) -> dict[str, Estimate]:
    """Estimated errors by the key of the figure, or of the block of figures, that they hold for; None where there is none.

    They are relative to the larger of the figure and its scale, but those of angles, in rad. Scales: energy_fluctuation over
    eps w² for inertias of flywheels, the work exchanged for works, the greatest I* for the reduced inertia; in `energy` what
    makes the work exchanged a power or a torque. Errors of power, balance and coefficient of energy are relative to the
    figure itself, unless that is no more than its error.
    """
    error, cycle = sizing.error, sizing.constant or sizing.cycle
    work, speed, drive = error.work, speed_error(sizing), drive_error(sizing)
    exact = _READ if sizing.scene.inertia is not None else error.exact
    residue = 0.0 if sizing.constant is None else abs(sizing.constant.net) / max(sizing.constant.exchanged, 1e-300)
    areas = None if work is None else work + 2 * residue
    twice = None if areas is None else areas + (work or 0.0)
    of_shafts = None if exact is None or speed is None else exact + 2 * speed + _READ
    found: dict[str, Estimate] = {
        **error._asdict(),
        "approximate_total": error.approximate,
        "speed": speed,
        "balance": _balance_error(sizing),
        "power": _power_error(sizing, drive, speed),
        "areas": {"from": error.angles, "to": error.angles, "work": twice, "accumulated": areas},
        "accumulated_max": areas,
        "accumulated_min": areas,
        "energy_fluctuation": twice,
        "coefficient_of_energy": _coefficient_error(sizing, drive),
        "angle_speed_max": error.extremes,
        "angle_speed_min": error.extremes,
        "reduced_inertia": None if cycle is None else _inertia_error(cycle)[1],
        "closure": work,
        "energy": _energy_error(sizing, drive, speed),
        "engine": _engine_error(sizing, speed),
        "multiplier": _multiplier_error(sizing, speed),
        "constant_speed": _constant_speed_error(sizing),
        "gd2": None if sizing.inertia is None else exact,
        "shafts": of_shafts if sizing.shafts else None,
        "wheel": None if sizing.built is None or of_shafts is None else _wheel_error(sizing, of_shafts),
        **_certificate_errors(sizing, cycle),
    }
    # beyond the floating-point range nothing is known of an error
    return {key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in found.items()}


def speed_error(sizing: Sizing) -> float | None:
    """Relative error of the mean of extremes; None at the level fast where the machine sets it, which is not looked for."""
    if sizing.constant is None or sizing.scene.unknown is not None:
        asked = sizing.scene.speed
        return _READ + (0.0 if asked is None else abs(sizing.speed / asked - 1.0))
    return None if sizing.cyclic is None else sizing.cyclic.level_error + _READ


def swaying(sizing: Sizing, speed: float | None = None) -> float:
    """Relative error of the speed anywhere in the cycle, with that of the mean of extremes (`speed_error` if None)."""
    run, speed = sizing.run, speed_error(sizing) if speed is None else speed
    return (speed or 0.0) + (0.0 if run is None else 0.5 * run.irregularity * run.error)


def drive_error(sizing: Sizing) -> Drive | None:
    """The errors of what the drive does along the motion; None without a drive or a cycle."""
    cycle, machine = sizing.cycle, sizing.machine
    if cycle is None or machine is None or machine.scene.drive is None or sizing.drive_work is None:
        return None
    law, span = machine.scene.drive.law, machine.scene.cycle
    residual = cycle.errors.residual + (0.0 if machine.friction is None else 2 * machine.friction.error)
    if law is None:
        own = (sizing.balance.error if sizing.balance else 0.0) * abs(sizing.drive_work) + cycle.errors.work + residual
        return Drive(own, own / span)
    if isinstance(law, float | int):
        own = _READ * abs(sizing.drive_work) + residual
        return Drive(own, own / span)
    moment, moved = _moment(sizing, cycle)
    tails = piecewise.tails(piecewise.fit(moment)) + moved.max(axis=-1)
    work = float((piecewise.TAIL_OF_INTEGRAL * tails * cycle.mesh.half[:, 0]).sum()) + cycle.errors.work + residual
    work += float(piecewise.integral(moved, cycle.mesh.half).sum())
    return Drive(
        work, float(tails.max()) + (cycle.errors.work + residual) / span + 24 * ROUNDING * float(np.abs(moment).max())
    )


def _moment(sizing: Sizing, cycle: Cycle) -> tuple[Any, Any]:
    """The drive's moment on the crank at the nodes, and what the error of the speed moves it by."""
    from flywheel.sizing.drive import moment_of_drive

    moment = moment_of_drive(sizing)
    if sizing.cyclic is None or sizing.run is None:
        return moment, np.zeros_like(moment)
    from flywheel.machine.dynamics import Moments  # only machines that set their own speed pay for it

    assert sizing.machine is not None
    moments = Moments(sizing.machine, cycle.mesh, local=True)
    omega = _omega(sizing, cycle)
    here, beside = (
        moments.drive(w, cycle.balance or 0.0, None if moments.circuit is None else moments.steady_current(w))
        for w in (omega, omega * (1.0 + _APART))
    )
    return moment, np.abs(beside - here) / _APART * swaying(sizing)


def _omega(sizing: Sizing, cycle: Cycle) -> Any:
    """The speed at the nodes (rad/s)."""
    assert sizing.run is not None
    return steady_motion.speed_over_cycle(cycle, sizing.speed, sizing.run, cycle.mesh.phi.ravel()).reshape(
        cycle.mesh.phi.shape
    )


def _relative(error: float, figure: float, scale: float) -> float:
    """An error relative to a figure, or where that is no more than its error, to the larger of it and a scale."""
    return error / (abs(figure) if abs(figure) > error else max(abs(figure), scale, 1e-300))


def _balance_error(sizing: Sizing) -> float | None:
    balance, cycle = sizing.balance, sizing.cycle
    if balance is None or cycle is None:
        return None
    return balance.error + _READ if balance.value else cycle.errors.work / max(cycle.exchanged, 1e-300)


def _power_error(sizing: Sizing, drive: Drive | None, speed: float | None) -> float | None:
    if drive is None or speed is None or sizing.cycle is None:
        return None
    return _relative(drive.work, sizing.drive_work or 0.0, sizing.cycle.exchanged) + speed + _READ


def _coefficient_error(sizing: Sizing, drive: Drive | None) -> float | None:
    """The fluctuation's error and that of the drive's work, each relative to its own."""
    if drive is None or sizing.coefficient_of_energy is None or sizing.cycle is None:
        return None
    cycle, work = sizing.constant or sizing.cycle, sizing.drive_work or 0.0
    fluctuation = 2 * (sizing.error.work or 0.0) * cycle.exchanged
    return _relative(fluctuation, sizing.energy_fluctuation, cycle.exchanged) + _relative(drive.work, work, cycle.exchanged)


def _inertia_error(cycle: Cycle) -> tuple[float, float]:
    """Error of the least, greatest and mean I*: in kg m², and relative to the greatest."""
    errors, extent = cycle.errors, inertia_extent(cycle)
    by_slope = errors.variation + float(errors.inertias[0])  # as `wittenbauer.reduced_inertia` has them
    own = (extent.error, extent.greatest_error)
    mean = piecewise.TAIL_OF_INTEGRAL * float(errors.inertias @ cycle.mesh.half[:, 0]) / float(cycle.mesh.edges[-1])
    mean += 32 * ROUNDING * extent.greatest
    error = max(mean, *(by_slope if errors.variation <= error else error for error in own))
    return error, error / extent.greatest if extent.greatest > 0.0 else 0.0


def _energy_error(sizing: Sizing, drive: Drive | None, speed: float | None) -> float | None:
    """One for the whole block: what is off in works, moments, speeds and the time, and between the nodes."""
    energy, cycle, run = sizing.energy, sizing.cycle, sizing.run
    if energy is None or drive is None or cycle is None or run is None or sizing.scene.drive is None:
        return None
    exchanged = max(cycle.exchanged, 1e-300)
    torque = exchanged / sizing.scene.cycle
    power = piecewise.fit(_moment(sizing, cycle)[0] * _omega(sizing, cycle))
    between = float(piecewise.tails(power).max()) / sizing.speed + float(cycle.noise[0].max())
    _, period = steady_motion.period(cycle, sizing.speed, run, sizing.rtol)
    ratios = [abs(ratio) for ratio in (energy.peak_to_mean, energy.peak_to_mean_alone) if ratio]
    ratio = max(1.0, min(max(ratios), exchanged / abs(energy.work))) if ratios else 1.0
    works = (drive.work + cycle.errors.work) / exchanged
    return ratio * works + (drive.moment + between) / torque + period + 2 * swaying(sizing, speed) + _READ


def _engine_error(sizing: Sizing, speed: float | None) -> float | None:
    """One for the whole block: of its works as shares of the work exchanged, and of the speed."""
    cycle = sizing.cycle
    if sizing.engine is None or cycle is None or speed is None:
        return None
    return sizing.engine.error / max(cycle.exchanged, 1e-300) + speed + _READ


def _multiplier_error(sizing: Sizing, speed: float | None) -> float | None:
    """Of exp(integral of dF/dE), relative to the larger of it and 1: what the speed's error and the cells change of it."""
    cyclic, cycle, run, machine = sizing.cyclic, sizing.cycle, sizing.run, sizing.machine
    if cyclic is None or cycle is None or run is None or machine is None:
        return None
    from flywheel.machine.dynamics import Moments  # only machines that set their own speed pay for it

    moments, omega = Moments(machine, cycle.mesh), _omega(sizing, cycle)

    def pull(w: Any) -> Any:
        current = None if moments.circuit is None else moments.steady_current(w)
        found = moments.rate(w, cycle.balance or 0.0, run.inertia, current).by_speed
        if moments.circuit is not None:  # the current follows the speed
            further = moments.drive(w * (1.0 + _APART), 0.0, moments.steady_current(w * (1.0 + _APART)))
            found = found + (further - moments.drive(w, 0.0, current)) / (_APART * w)
        return found / ((run.inertia + moments.inertia) * w)

    here = pull(omega)
    moved = np.abs(pull(omega * (1.0 + _APART)) - here) / _APART * swaying(sizing, speed)
    exponent = float(piecewise.integral(np.abs(here) * 24 * ROUNDING + moved, cycle.mesh.half).sum())
    exponent += float((piecewise.TAIL_OF_INTEGRAL * piecewise.tails(piecewise.fit(here)) * cycle.mesh.half[:, 0]).sum())
    cells = 8 * ROUNDING * cycle.mesh.half.size
    return abs(cyclic.multiplier) * exponent / max(abs(cyclic.multiplier), 1.0) + cells


def _constant_speed_error(sizing: Sizing) -> float | None:
    """Relative error of the speed that areas take torques at: none of its own where it is the one asked for."""
    if sizing.constant_speed is None or sizing.machine is None or sizing.constant is None:
        return None
    if sizing.scene.unknown is not None:
        return _READ
    if sizing.cyclic is not None:
        return sizing.cyclic.constant_speed_error + _READ
    from flywheel.regime.constant_speed import closed

    closer, loose = closed(sizing.machine, sizing.constant.mesh.edges, sizing.constant_speed)
    return loose + abs(closer / sizing.constant_speed - 1.0) + _READ


def _wheel_error(sizing: Sizing, of_shafts: float) -> float:
    """What the inertia, the speed and the torque that a wheel is made for leave open of its dimensions and stresses."""
    run, cycle = sizing.run, sizing.cycle
    greatest = swaying(sizing)
    if sizing.built is None or sizing.built.torque is None or run is None or cycle is None:
        return of_shafts + 4 * greatest
    torque = float(cycle.noise[0].max()) + 0.5 * sizing.speed**2 * float(cycle.noise[1].max())
    return of_shafts + 4 * greatest + torque / max(sizing.built.torque * sizing.scene.flywheel_ratio, 1e-300)


def _certificate_errors(sizing: Sizing, cycle: Cycle | None) -> dict[str, float | None]:
    """Of the bounds of the exact figure, relative to the larger of the total by the areas and themselves."""
    wheel, error, eps = sizing.flywheel, sizing.error, sizing.scene.irregularity
    if wheel.bracket is None or wheel.torque_bracket is None or cycle is None or eps is None:
        return {"certificate": None, "certificate_torque": None}
    total = max(wheel.approximate_total or 0.0, *map(abs, wheel.bracket)) * sizing.scene.flywheel_ratio**2
    doubt = _inertia_error(cycle)[0] / max(total, 1e-300)
    return {
        "certificate": (error.approximate or 0.0) + doubt * (1.0 + (1.0 + eps**2 / 4) / eps) + _READ,
        "certificate_torque": (error.inertia_torque or 0.0) + doubt + _READ,
    }
