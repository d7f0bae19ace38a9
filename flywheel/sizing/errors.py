"""Estimated errors of a sizing's figures: the sizing gives those of `Errors`, all others follow from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flywheel.machine.equation import moments_on
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, inertia_extent
from flywheel.sizing.motor import SPEED_STEP, drive_moment
from flywheel.sizing.results import Estimate, Sizing

_READ = 4 * ROUNDING  # of a figure that is the scene's own, or a product of a few such


class _DriveErrors(NamedTuple):
    """Absolute errors of the drive: of its work in a cycle (J), of its moment on the crank anywhere (N m)."""

    work: float
    moment: float


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def estimates(sizing: Sizing) -> dict[str, Estimate]:
    """Estimated errors by the key of the figure or of the block of figures; None for a missing figure.

    They are relative to the larger of the figure and its scale; those of angles are in rad. Scales: energy_fluctuation over
    eps w² for inertias of flywheels, the work exchanged for works, the greatest I* for the reduced inertia; in `energy` the
    work exchanged as a power or a torque. Errors of power, balance and coefficient of energy are relative to the
    figure itself, unless that is no more than its error.
    """
    error, cycle, scene, cyclic = sizing.error, sizing.cycle, sizing.scene, sizing.cyclic
    constant = sizing.constant or cycle  # the one of the areas
    of_drive, speed = _drive_errors(sizing), speed_error(sizing)
    exact = _READ if scene.inertia is not None else error.exact
    of_shafts = None if exact is None or speed is None else exact + 2 * speed + _READ
    own = _figure_errors(sizing, of_drive)
    found: dict[str, Estimate] = {
        **own,
        "areas": {
            "from": error.angles,
            "to": error.angles,
            "work": own["energy_fluctuation"],
            "accumulated": own["accumulated_max"],
        },
        "closure": error.work,
        "energy": _energy_error(sizing, of_drive, speed),
        "engine": None,
        "limits": {name: max(limit.reached_error, limit.alone_error) for name, limit in sizing.limits.items()} or None,
        "broken": max((max(each.start_error, each.end_error) for each in sizing.flywheel.broken), default=None),
        "multiplier": _multiplier_error(sizing, speed),
        "constant_speed": None if cyclic is None else _READ + (0.0 if scene.unknown else cyclic.constant_speed_error),
        "gd2": None if sizing.inertia is None else exact,
        "shafts": of_shafts if sizing.shafts else None,
        "power_flow": None if sizing.power_flow is None else sizing.power_flow.error,
        "wheel": None if sizing.built is None or of_shafts is None else _wheel_error(sizing, of_shafts),
        **_bounds_errors(sizing, constant),
    }
    if cycle is not None and sizing.engine is not None and speed is not None:
        found["engine"] = sizing.engine.error / max(cycle.exchanged, 1e-300) + speed + _READ
    # beyond the floating-point range nothing is known of an error
    return {key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in found.items()}


@np.errstate(all="ignore")
def figure_errors(sizing: Sizing) -> dict[str, float | None]:
    """The errors of `estimates` that follow from the sizing alone; for many sizings."""
    return _figure_errors(sizing, _drive_errors(sizing))


def _figure_errors(sizing: Sizing, of_drive: _DriveErrors | None) -> dict[str, float | None]:
    error, cycle = sizing.error, sizing.cycle
    constant = sizing.constant or cycle
    work, speed = error.work, speed_error(sizing)
    residue = 0.0 if sizing.constant is None else abs(sizing.constant.net) / max(sizing.constant.exchanged, 1e-300)
    areas = None if work is None else work + 2 * residue
    found: dict[str, float | None] = {
        **error._asdict(),
        "approximate_total": error.approximate,
        "speed": speed,
        "balance": None,
        "power": None,
        "accumulated_max": areas,
        "accumulated_min": areas,
        "energy_fluctuation": areas,
        "coefficient_of_energy": None,
        "angle_speed_max": error.extremes,
        "angle_speed_min": error.extremes,
        "reduced_inertia": None if constant is None else _inertia_error(constant)[1],
    }
    if cycle is None or constant is None:
        return found
    balance, exchanged = sizing.balance, max(cycle.exchanged, 1e-300)
    if balance is not None:
        found["balance"] = balance.error + _READ if balance.value else cycle.errors.work / exchanged
    if of_drive is not None:
        relative = _relative(of_drive.work, sizing.drive_work or 0.0, cycle.exchanged)
        found["power"] = None if speed is None else relative + speed + _READ
        if sizing.coefficient_of_energy is not None:
            own = (work or 0.0) * constant.exchanged
            relative = _relative(of_drive.work, sizing.drive_work or 0.0, constant.exchanged)
            found["coefficient_of_energy"] = _relative(own, sizing.energy_fluctuation, constant.exchanged) + relative
    return found


def speed_error(sizing: Sizing) -> float | None:
    """Relative error of the mean of extremes."""
    if sizing.constant is None or sizing.scene.unknown is not None:
        given = sizing.scene.speed
        return _READ + (0.0 if given is None else abs(sizing.speed / given - 1.0))
    return None if sizing.cyclic is None else sizing.cyclic.level_error + _READ


def speed_error_over_cycle(sizing: Sizing) -> float:
    """Relative error of the speed anywhere in the cycle, that of the mean of extremes included."""
    run = sizing.run
    return (speed_error(sizing) or 0.0) + (0.0 if run is None else 0.5 * run.irregularity * run.error)


def _speed(sizing: Sizing, cycle: Cycle) -> Array:
    """The crank's speed at the nodes (rad/s)."""
    assert sizing.run is not None
    return turning_moment.speed_over_cycle(cycle, sizing.speed, sizing.run, cycle.mesh.phi)


def _relative(error: float, figure: float, scale: float) -> float:
    """An error relative to a figure, or if the figure is no more than its error, to the larger of it and a scale."""
    return error / (abs(figure) if abs(figure) > error else max(abs(figure), scale, 1e-300))


def _drive_errors(sizing: Sizing) -> _DriveErrors | None:
    """The errors of the drive along the motion; None without a drive or a cycle."""
    cycle, machine = sizing.cycle, sizing.machine
    if cycle is None or machine is None or machine.scene.drive is None or sizing.drive_work is None:
        return None
    law, span = machine.scene.drive.law, machine.scene.cycle
    residual = cycle.errors.residual + (0.0 if machine.friction is None else 2 * machine.friction.error)
    if law is None:
        own = (sizing.balance.error if sizing.balance else 0.0) * abs(sizing.drive_work) + cycle.errors.work + residual
        return _DriveErrors(own, own / span)
    if isinstance(law, float | int):
        own = _READ * abs(sizing.drive_work) + residual
        return _DriveErrors(own, own / span)
    moment = drive_moment(machine, cycle, sizing.run, sizing.speed)
    by_speed = np.zeros_like(moment)  # what the error of the speed moves it by
    if sizing.cyclic is not None and sizing.run is not None:
        moments, omega = moments_on(machine, cycle.mesh.edges, local=True), _speed(sizing, cycle)
        here, beside = (
            moments.drive(w, cycle.balance or 0.0, moments.steady_states(w)) for w in (omega, omega * (1.0 + SPEED_STEP))
        )
        by_speed = np.abs(beside - here) / SPEED_STEP * speed_error_over_cycle(sizing)
    tails = cells.tails(cells.fit(moment)) + by_speed.max(axis=-1)
    work = float((cells.TAIL_OF_INTEGRAL * tails * cycle.mesh.half[:, 0]).sum()) + cycle.errors.work + residual
    work += float(cells.integral(by_speed, cycle.mesh.half).sum())
    rounding = 24 * ROUNDING * float(np.abs(moment).max())
    return _DriveErrors(work, float(tails.max()) + (cycle.errors.work + residual) / span + rounding)


def _inertia_error(cycle: Cycle) -> tuple[float, float]:
    """Error of the least, greatest and mean I*: in kg m², and relative to the greatest."""
    errors, extent = cycle.errors, inertia_extent(cycle)
    by_slope = errors.variation + float(errors.inertias[0])  # as `wittenbauer.reduced_inertia` has them
    own = (extent.error, extent.greatest_error)
    mean = cells.TAIL_OF_INTEGRAL * float(errors.inertias @ cycle.mesh.half[:, 0]) / float(cycle.mesh.edges[-1])
    mean += 32 * ROUNDING * extent.greatest
    error = max(mean, *(by_slope if errors.variation <= error else error for error in own))
    return error, error / extent.greatest if extent.greatest > 0.0 else 0.0


def _energy_error(sizing: Sizing, of_drive: _DriveErrors | None, speed: float | None) -> float | None:
    """One error for the whole block: of works, moments, speeds and the time, and between the nodes."""
    energy, cycle, run, machine = sizing.energy, sizing.cycle, sizing.run, sizing.machine
    if energy is None or of_drive is None or cycle is None or run is None or machine is None:
        return None
    exchanged = max(cycle.exchanged, 1e-300)
    torque = exchanged / sizing.scene.cycle
    power = cells.fit(drive_moment(machine, cycle, run, sizing.speed) * _speed(sizing, cycle))
    between = float(cells.tails(power).max()) / sizing.speed + float(cycle.noise[0].max())
    _, period = turning_moment.period(cycle, sizing.speed, run, sizing.rtol)
    ratios = [abs(ratio) for ratio in (energy.peak_to_mean, energy.peak_to_mean_alone) if ratio]
    ratio = max(1.0, min(max(ratios), exchanged / abs(energy.work))) if ratios else 1.0
    works = (of_drive.work + cycle.errors.work) / exchanged
    of_speed = (speed or 0.0) + 0.5 * run.irregularity * run.error
    return ratio * works + (of_drive.moment + between) / torque + period + 2 * of_speed + _READ


def _multiplier_error(sizing: Sizing, speed: float | None) -> float | None:
    """Error of exp(integral of dF/dE), relative to the larger of it and 1, by the speed's error and the cells."""
    cyclic, cycle, run, machine = sizing.cyclic, sizing.cycle, sizing.run, sizing.machine
    if cyclic is None or cycle is None or run is None or machine is None:
        return None
    moments, omega = moments_on(machine, cycle.mesh.edges), _speed(sizing, cycle)

    def growth(w: Array) -> Array:
        """dF/dE (1/rad) at speeds w."""
        states = moments.steady_states(w)
        found = moments.rate(w, cycle.balance or 0.0, run.inertia, states).by_speed
        if moments.circuit is not None:  # its states follow the speed
            further = moments.drive(w * (1.0 + SPEED_STEP), 0.0, moments.steady_states(w * (1.0 + SPEED_STEP)))
            found = found + (further - moments.drive(w, 0.0, states)) / (SPEED_STEP * w)
        return np.asarray(found / ((run.inertia + moments.inertia) * w))

    here = growth(omega)
    of_speed = (speed or 0.0) + 0.5 * run.irregularity * run.error
    moved = np.abs(growth(omega * (1.0 + SPEED_STEP)) - here) / SPEED_STEP * of_speed
    exponent = float(cells.integral(np.abs(here) * 24 * ROUNDING + moved, cycle.mesh.half).sum())
    exponent += float((cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(here)) * cycle.mesh.half[:, 0]).sum())
    size = abs(cyclic.multiplier)
    return size * exponent / max(size, 1.0) + 8 * ROUNDING * cycle.mesh.half.size


def _wheel_error(sizing: Sizing, of_shafts: float) -> float:
    """Error of a wheel's dimensions and stresses by those of inertia, speed and torque."""
    run, cycle = sizing.run, sizing.cycle
    of_speed = speed_error_over_cycle(sizing)
    if sizing.built is None or sizing.built.torque is None or run is None or cycle is None:
        return of_shafts + 4 * of_speed
    torque = float(cycle.noise[0].max()) + 0.5 * sizing.speed**2 * float(cycle.noise[1].max())
    return of_shafts + 4 * of_speed + torque / max(sizing.built.torque * sizing.scene.flywheel_ratio, 1e-300)


def _bounds_errors(sizing: Sizing, cycle: Cycle | None) -> dict[str, float | None]:
    """Errors of the proven bounds, relative to the larger of the total by the areas and the bounds themselves."""
    wheel, error, eps = sizing.flywheel, sizing.error, sizing.scene.irregularity
    if wheel.proven_bounds is None or wheel.proven_bounds_torque is None or cycle is None or eps is None:
        return {"proven_bounds": None, "proven_bounds_torque": None}
    total = max(wheel.approximate_total or 0.0, *map(abs, wheel.proven_bounds)) * sizing.scene.flywheel_ratio**2
    of_inertia = _inertia_error(cycle)[0] / max(total, 1e-300)
    return {
        "proven_bounds": (error.approximate or 0.0) + of_inertia * (1.0 + (1.0 + eps**2 / 4) / eps) + _READ,
        "proven_bounds_torque": (error.inertia_torque or 0.0) + of_inertia + _READ,
    }
