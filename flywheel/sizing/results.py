"""What a sizing returns: frozen records in SI, the estimated error of every figure, and the dictionary for JSON.

What a sizing estimates on its way (`Errors`) is about what is searched for; the errors of all other figures follow from it,
and are worked out for JSON alone, as are power, engine and the other shafts for who asks for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.energy import Energy
from flywheel.components.gear_trains import OnShaft
from flywheel.components.wheels import Wheel
from flywheel.machine.dynamics import Moments
from flywheel.machine.machine import Machine, balance_unit
from flywheel.numerics import cells
from flywheel.numerics.budget import FREE, Cost
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run, inertia_extent
from flywheel.regime.wittenbauer import Area, Figures, Flywheel, ReducedInertia
from flywheel.scene.accuracy import AUDIT
from flywheel.scene.scene import Scene
from flywheel.sizing import drive
from flywheel.sizing.drive import EngineCycle

__all__ = ["Area", "Balance", "Built", "Confirmation", "Cyclic", "Errors", "Flywheel", "ReducedInertia", "Sizing"]

Estimate = float | None | dict[str, float | None]

_READ = 4 * ROUNDING  # of a figure that is the scene's own, or a product of a few such
_APART = 1e-6  # share by which a speed is changed to see what depends on it
_HEATING = ("current_rms", "current_peak", "copper_heat", "copper_heat_share", "rotor_heat", "rotor_heat_share")


class Balance(NamedTuple):
    """The unknown that makes the cycle's net work zero: its name, its value (SI) and that value's relative error."""

    name: str
    value: float
    error: float


class Confirmation(NamedTuple):
    """Motion over one steady cycle: rad/s and s. `closure` is omega(T)/omega(0) - 1; `route` says how it was found.

    That is "time" (stepping), "collocation", "quadrature", or "areas", which leave the machine's own inertia out.
    """

    irregularity: float
    irregularity_approximate: float | None
    speed_max: float | None
    speed_min: float | None
    speed_time_mean: float | None
    period: float | None
    closure: float | None = None
    route: str = "time"


class Cyclic(NamedTuple):
    """How a motion whose torques depend on speed holds itself.

    `multiplier`: what a cycle leaves of a small change of the state at its start; `damping` is 1 less it. `steps`: Newton
    steps that the motion took. `level_error`: relative error of its mean speed. `constant_speed` (rad/s): at which areas
    and approximate figures take the torques, with its own relative error where the machine takes it by itself.
    """

    multiplier: float
    damping: float
    steps: int
    level_error: float
    constant_speed: float
    constant_speed_error: float = 0.0


class Confirmed(NamedTuple):
    """A motion that was found, its error relative to what it confirms, that of its period, and what is to be said of it."""

    motion: Confirmation | None = None
    error: float | None = None
    period_error: float | None = None
    messages: tuple[str, ...] = ()


class Regime(NamedTuple):
    """The steady regime of a machine with its given, its exact or no flywheel: what is confirmed, and what a wheel runs in.

    `figures` are those of the areas, at a constant speed where torques depend on it; `motion` is the one that they give, or
    that was solved for; `run` is the same, but None where nothing stores energy, and even where nothing varies the speed.
    `cycle` is the one along the motion, `speed` its mean of extremes (rad/s), `exact` the inertia on the crank (kg m²) that
    its irregularity asks for, with its relative error, where torques depend on speed. `confirmed` is the motion of a machine
    without inertia, `extremes_error` (rad) what the places of switches add to the error of the angles of extreme speed.
    """

    machine: Machine
    rtol: float
    figures: Figures
    motion: Run | None
    run: Run | None
    cycle: Cycle
    speed: float
    cyclic: Cyclic | None = None
    exact: tuple[float, float] | None = None
    confirmed: Confirmed | None = None
    extremes_error: float = 0.0
    messages: tuple[str, ...] = ()

    @property
    def constant(self) -> Cycle | None:
        """The cycle at a constant speed, where that is another than the one along the motion."""
        return None if self.cyclic is None else self.figures.cycle


class Built(NamedTuple):
    """The wheel to be built, and the irregularity that the machine has with it, with its relative error.

    `torque` is the greatest between hub and rim (N m, on the wheel's shaft) that its arms were checked for, None without.
    """

    wheel: Wheel
    irregularity: float | None
    error: float
    torque: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """For JSON: the wheel's own figures, and those of the machine with it."""
        found = {"torque": self.torque, "irregularity": self.irregularity, "irregularity_error": self.error}
        return {**self.wheel.as_dict(), **found}


class Errors(NamedTuple):
    """Estimated errors: relative ones as the figures' scale asks; None where there is no figure.

    In rad those of angles: `angles` of the ends of areas, `extremes` of the angles of greatest and least speed.
    """

    exact: float | None = None
    simulation: float | None = None
    approximate: float | None = None
    inertia_torque: float | None = None
    inertia_torque_flywheel: float | None = None
    work: float | None = None
    angles: float | None = None
    period: float | None = None
    extremes: float | None = None


@dataclass(frozen=True, repr=False)
class Sizing:
    """Everything that sizing or analysing one scene gives. Field names are those of the JSON contract where it has them.

    `messages` are sentences that a user must not miss (rtol not reached, no motion with the approximate flywheel...).
    `machine`, `cycle` and `run` are what the figures came from: None for a scene of areas. Where torques depend on speed
    `cycle` is the one along the motion, `constant` the one at a constant speed that areas and approximate figures are taken
    from, and `cyclic` tells how the motion holds itself; both are None elsewhere. `built` is the wheel, if asked for.

    `accuracy` is the level of accuracy, `left_out` what the sizing did not do there, `cost` what all this took.
    """

    scene: Scene
    speed: float
    balance: Balance | None
    power: float | None
    drive_work: float | None
    areas: tuple[Area, ...]
    accumulated_max: float
    accumulated_min: float
    energy_fluctuation: float
    coefficient_of_energy: float | None
    angle_speed_max: float | None
    angle_speed_min: float | None
    reduced_inertia: ReducedInertia | None
    flywheel: Flywheel
    simulation: Confirmation | None
    error: Errors
    closure: float
    rtol: float
    messages: tuple[str, ...] = ()
    machine: Machine | None = None
    cycle: Cycle | None = None
    run: Run | None = None
    constant: Cycle | None = None
    cyclic: Cyclic | None = None
    built: Built | None = None
    accuracy: str = AUDIT
    left_out: tuple[str, ...] = ()
    cost: Cost = FREE

    def __repr__(self) -> str:
        wheel = self.flywheel
        what = f"inertia={wheel.inertia}" if self.scene.inertia is not None else f"exact={wheel.exact}"
        motion = "" if self.simulation is None else f", irregularity={self.simulation.irregularity}"
        return f"Sizing(title={self.scene.title!r}, on={wheel.on!r}, {what}, speed={self.speed}{motion})"

    @cached_property
    def energy(self) -> Energy | None:
        """Power and energy of the drive with the flywheel and without it; None without a drive or a motion."""
        if self.machine is None or self.cycle is None or self.run is None or self.scene.drive is None:
            return None
        return drive.energy(self.machine, self.cycle, self.run, self.speed, self.rtol)

    @cached_property
    def engine(self) -> EngineCycle | None:
        """What the gas of an engine's cylinders does, and what the machine's loads take of it; None without an engine."""
        if self.machine is None or self.cycle is None:
            return None
        return drive.engine(self.machine, self.cycle, self.run, self.speed, self.drive_work)

    @cached_property
    def shafts(self) -> tuple[OnShaft, ...]:
        """The flywheel given or sized, and those that do the same on every other shaft."""
        if self.inertia is None:
            return ()
        return drive.on_shafts(self.scene, self.inertia, self.speed, None if self.built is None else self.built.wheel)

    @property
    def balance_unit(self) -> str | None:
        """The unit (SI) of the balance; None without one, or where the expressions that it stands in leave it open."""
        return None if self.machine is None else balance_unit(self.machine.efforts, self.scene)

    @property
    def inertia(self) -> float | None:
        """The flywheel given, or the exact one, kg m² at its own shaft."""
        return self.flywheel.exact if self.scene.inertia is None else self.scene.inertia

    @property
    def constant_speed(self) -> float | None:
        """The speed (rad/s) that areas and approximate figures take torques at that depend on it; None where none does."""
        return None if self.cyclic is None else self.cyclic.constant_speed

    @property
    def reached(self) -> bool:
        """Whether every estimated relative error is within rtol."""
        error = self.error
        flywheels = (error.exact, error.approximate, error.inertia_torque, error.inertia_torque_flywheel)
        return all(error is None or error <= self.rtol for error in (*flywheels, error.simulation, error.work))

    def as_dict(self) -> dict[str, Any]:
        """The JSON contract of `flywheel size`, SI throughout, plus the keys that this version adds."""
        scene, energy, (least, greatest, mean) = self.scene, self.energy, self.reduced_inertia or (None, None, None)
        return {
            "title": scene.title,
            "reduction": "crank",
            "cycle": None if scene.areas else scene.cycle,
            "speed": self.speed,
            "speed_asked": scene.speed,
            "irregularity": scene.irregularity,
            "balance": self.balance and {"name": self.balance.name, "value": self.balance.value},
            "balance_unit": self.balance_unit,
            "power": self.power,
            "areas": [{"from": a.start, "to": a.end, "work": a.work, "accumulated": a.accumulated} for a in self.areas],
            "accumulated_max": self.accumulated_max,
            "accumulated_min": self.accumulated_min,
            "energy_fluctuation": self.energy_fluctuation,
            "coefficient_of_energy": self.coefficient_of_energy,
            "angle_speed_max": self.angle_speed_max,
            "angle_speed_min": self.angle_speed_min,
            "reduced_inertia": {"min": least, "max": greatest, "mean": mean},
            "flywheel": {k: v for k, v in self.flywheel._asdict().items() if "bracket" not in k},
            "simulation": self.simulation and self.simulation._asdict(),
            "error": {**estimates(self), **{key: energy and energy.errors.get(key) for key in _HEATING}},
            "closure": self.closure,
            "energy": energy and energy.as_dict(),
            "engine": self.engine and self.engine.as_dict(),
            "multiplier": self.cyclic and self.cyclic.multiplier,
            "constant_speed": self.constant_speed,
            "gd2": None if self.inertia is None else 4.0 * self.inertia,
            "shafts": [row.as_dict() for row in self.shafts],
            "wheel": self.built and self.built.as_dict(),
            "certificate": self.flywheel.bracket and list(self.flywheel.bracket),
            "certificate_torque": self.flywheel.torque_bracket and list(self.flywheel.torque_bracket),
            "rtol": self.rtol,
            "reached": self.reached,
            "messages": list(self.messages),
            "accuracy": self.accuracy,
            "left_out": list(self.left_out),
            "bounds": None,  # those of an exact figure that was left out: none is
            "cost": self.cost.as_dict(),
        }


# -- the errors of all figures -----------------------------------------------------------------------------------------


class _DriveErrors(NamedTuple):
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
    error, cycle, scene = sizing.error, sizing.cycle, sizing.scene
    constant = sizing.constant or cycle  # the one of the areas
    work, speed, of_drive = error.work, speed_error(sizing), _drive_errors(sizing)
    exact = _READ if scene.inertia is not None else error.exact
    residue = 0.0 if sizing.constant is None else abs(sizing.constant.net) / max(sizing.constant.exchanged, 1e-300)
    areas = None if work is None else work + 2 * residue
    twice = None if areas is None else areas + (work or 0.0)
    of_shafts = None if exact is None or speed is None else exact + 2 * speed + _READ
    found: dict[str, Estimate] = {
        **error._asdict(),
        "approximate_total": error.approximate,
        "speed": speed,
        "balance": None,
        "power": None,
        "areas": {"from": error.angles, "to": error.angles, "work": twice, "accumulated": areas},
        "accumulated_max": areas,
        "accumulated_min": areas,
        "energy_fluctuation": twice,
        "coefficient_of_energy": None,
        "angle_speed_max": error.extremes,
        "angle_speed_min": error.extremes,
        "reduced_inertia": None if constant is None else _inertia_error(constant)[1],
        "closure": work,
        "energy": _energy_error(sizing, of_drive, speed),
        "engine": None,
        "multiplier": _multiplier_error(sizing, speed),
        "constant_speed": _constant_speed_error(sizing),
        "gd2": None if sizing.inertia is None else exact,
        "shafts": of_shafts if sizing.shafts else None,
        "wheel": None if sizing.built is None or of_shafts is None else _wheel_error(sizing, of_shafts),
        **_certificate_errors(sizing, constant),
    }
    if cycle is not None and constant is not None:
        balance, exchanged = sizing.balance, max(cycle.exchanged, 1e-300)
        if balance is not None:
            found["balance"] = balance.error + _READ if balance.value else cycle.errors.work / exchanged
        if of_drive is not None:
            relative = _relative(of_drive.work, sizing.drive_work or 0.0, cycle.exchanged)
            found["power"] = None if speed is None else relative + speed + _READ
            if sizing.coefficient_of_energy is not None:
                own = 2 * (work or 0.0) * constant.exchanged
                relative = _relative(of_drive.work, sizing.drive_work or 0.0, constant.exchanged)
                found["coefficient_of_energy"] = _relative(own, sizing.energy_fluctuation, constant.exchanged) + relative
        if sizing.engine is not None and speed is not None:
            found["engine"] = sizing.engine.error / exchanged + speed + _READ
    # beyond the floating-point range nothing is known of an error
    return {key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in found.items()}


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


def _relative(error: float, figure: float, scale: float) -> float:
    """An error relative to a figure, or where that is no more than its error, to the larger of it and a scale."""
    return error / (abs(figure) if abs(figure) > error else max(abs(figure), scale, 1e-300))


def _omega(sizing: Sizing, cycle: Cycle) -> Array:
    """The speed at the nodes (rad/s)."""
    assert sizing.run is not None
    phi = cycle.mesh.phi
    return turning_moment.speed_over_cycle(cycle, sizing.speed, sizing.run, phi.ravel()).reshape(phi.shape)


def _drive_errors(sizing: Sizing) -> _DriveErrors | None:
    """The errors of what the drive does along the motion; None without a drive or a cycle."""
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
    moment = drive.drive_moment(machine, cycle, sizing.run, sizing.speed)
    by_speed = np.zeros_like(moment)  # what the error of the speed moves it by
    if sizing.cyclic is not None and sizing.run is not None:
        moments, omega = Moments(machine, cycle.mesh, local=True), _omega(sizing, cycle)
        here, beside = (
            moments.drive(w, cycle.balance or 0.0, None if moments.circuit is None else moments.steady_current(w))
            for w in (omega, omega * (1.0 + _APART))
        )
        by_speed = np.abs(beside - here) / _APART * speed_error_over_cycle(sizing)
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
    """One for the whole block: what is off in works, moments, speeds and the time, and between the nodes."""
    energy, cycle, run, machine = sizing.energy, sizing.cycle, sizing.run, sizing.machine
    if energy is None or of_drive is None or cycle is None or run is None or machine is None:
        return None
    exchanged = max(cycle.exchanged, 1e-300)
    torque = exchanged / sizing.scene.cycle
    power = cells.fit(drive.drive_moment(machine, cycle, run, sizing.speed) * _omega(sizing, cycle))
    between = float(cells.tails(power).max()) / sizing.speed + float(cycle.noise[0].max())
    _, period = turning_moment.period(cycle, sizing.speed, run, sizing.rtol)
    ratios = [abs(ratio) for ratio in (energy.peak_to_mean, energy.peak_to_mean_alone) if ratio]
    ratio = max(1.0, min(max(ratios), exchanged / abs(energy.work))) if ratios else 1.0
    works = (of_drive.work + cycle.errors.work) / exchanged
    of_speed = (speed or 0.0) + 0.5 * run.irregularity * run.error
    return ratio * works + (of_drive.moment + between) / torque + period + 2 * of_speed + _READ


def _multiplier_error(sizing: Sizing, speed: float | None) -> float | None:
    """Of exp(integral of dF/dE), relative to the larger of it and 1: what the speed's error and the cells change of it."""
    cyclic, cycle, run, machine = sizing.cyclic, sizing.cycle, sizing.run, sizing.machine
    if cyclic is None or cycle is None or run is None or machine is None:
        return None
    moments, omega = Moments(machine, cycle.mesh), _omega(sizing, cycle)

    def growth(w: Array) -> Array:
        """dF/dE (1/rad) at speeds w."""
        current = None if moments.circuit is None else moments.steady_current(w)
        found = moments.rate(w, cycle.balance or 0.0, run.inertia, current).by_speed
        if moments.circuit is not None:  # the current follows the speed
            further = moments.drive(w * (1.0 + _APART), 0.0, moments.steady_current(w * (1.0 + _APART)))
            found = found + (further - moments.drive(w, 0.0, current)) / (_APART * w)
        return np.asarray(found / ((run.inertia + moments.inertia) * w))

    here = growth(omega)
    of_speed = (speed or 0.0) + 0.5 * run.irregularity * run.error
    moved = np.abs(growth(omega * (1.0 + _APART)) - here) / _APART * of_speed
    exponent = float(cells.integral(np.abs(here) * 24 * ROUNDING + moved, cycle.mesh.half).sum())
    exponent += float((cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(here)) * cycle.mesh.half[:, 0]).sum())
    size = abs(cyclic.multiplier)
    return size * exponent / max(size, 1.0) + 8 * ROUNDING * cycle.mesh.half.size


def _constant_speed_error(sizing: Sizing) -> float | None:
    """Relative error of the speed that areas take torques at: none of its own where it is the one asked for."""
    if sizing.cyclic is None:
        return None
    return _READ + (0.0 if sizing.scene.unknown is not None else sizing.cyclic.constant_speed_error)


def _wheel_error(sizing: Sizing, of_shafts: float) -> float:
    """What the inertia, the speed and the torque that a wheel is made for leave open of its dimensions and stresses."""
    run, cycle = sizing.run, sizing.cycle
    of_speed = speed_error_over_cycle(sizing)
    if sizing.built is None or sizing.built.torque is None or run is None or cycle is None:
        return of_shafts + 4 * of_speed
    torque = float(cycle.noise[0].max()) + 0.5 * sizing.speed**2 * float(cycle.noise[1].max())
    return of_shafts + 4 * of_speed + torque / max(sizing.built.torque * sizing.scene.flywheel_ratio, 1e-300)


def _certificate_errors(sizing: Sizing, cycle: Cycle | None) -> dict[str, float | None]:
    """Of the bounds of the exact figure, relative to the larger of the total by the areas and themselves."""
    wheel, error, eps = sizing.flywheel, sizing.error, sizing.scene.irregularity
    if wheel.bracket is None or wheel.torque_bracket is None or cycle is None or eps is None:
        return {"certificate": None, "certificate_torque": None}
    total = max(wheel.approximate_total or 0.0, *map(abs, wheel.bracket)) * sizing.scene.flywheel_ratio**2
    of_inertia = _inertia_error(cycle)[0] / max(total, 1e-300)
    return {
        "certificate": (error.approximate or 0.0) + of_inertia * (1.0 + (1.0 + eps**2 / 4) / eps) + _READ,
        "certificate_torque": (error.inertia_torque or 0.0) + of_inertia + _READ,
    }
