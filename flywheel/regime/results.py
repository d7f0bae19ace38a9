"""What a sizing returns: plain frozen records in SI, and the dictionary that `--json` prints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from flywheel.numerics.budget import FREE, Cost
from flywheel.scene.accuracy import AUDIT

if TYPE_CHECKING:
    from flywheel.components.energy import Energy
    from flywheel.components.gear_trains import OnShaft
    from flywheel.components.wheels import Wheel
    from flywheel.machine.machine import Machine
    from flywheel.regime.steady_motion import Run
    from flywheel.regime.turning_moment import Cycle
    from flywheel.scene.scene import Scene
    from flywheel.sizing.drive import EngineCycle


class Area(NamedTuple):
    """An area of the turning-moment diagram: the work (J) of M* between two sign changes (rad), and W at its end.

    The angles are None for areas read off a diagram.
    """

    start: float | None
    end: float | None
    work: float
    accumulated: float


class Balance(NamedTuple):
    """The unknown that makes the cycle's net work zero: its name, its value (SI) and that value's relative error."""

    name: str
    value: float
    error: float


class ReducedInertia(NamedTuple):
    """I* without the flywheel over a cycle, kg m²: least, greatest, mean over phi."""

    least: float
    greatest: float
    mean: float


class Flywheel(NamedTuple):
    """Flywheel figures in kg m² at the flywheel's own shaft `on`.

    `bracket` and `torque_bracket` are certificates: bounds between which the exact figure (before its floor at 0) is
    proven to lie, the first given the accumulated areas, the second given the inertia torque. `inertia_torque` is a total,
    `inertia_torque_flywheel` what of it is the flywheel's: without the machine's least inertia, as in `approximate`.
    """

    on: str
    inertia: float | None
    exact: float | None
    approximate: float | None
    approximate_total: float | None
    inertia_torque: float | None
    inertia_torque_flywheel: float | None
    needed: bool | None
    bracket: tuple[float, float] | None = None
    torque_bracket: tuple[float, float] | None = None


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


class Built(NamedTuple):
    """The wheel to be built, and the irregularity that the machine has with it, with its relative error.

    `torque` is the greatest between hub and rim (N m, on the wheel's shaft) that its arms were checked for, None without.
    """

    wheel: Wheel
    irregularity: float | None
    error: float
    torque: float | None = None


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
        from flywheel.sizing.drive import energy_of

        return energy_of(self)

    @cached_property
    def engine(self) -> EngineCycle | None:
        """What the gas of an engine's cylinders does, and what the machine's loads take of it; None without an engine."""
        from flywheel.sizing.drive import engine_of

        return engine_of(self)

    @cached_property
    def shafts(self) -> tuple[OnShaft, ...]:
        """The flywheel given or sized, and those that do the same on every other shaft."""
        from flywheel.sizing.drive import compared

        return compared(self)

    @property
    def balance_unit(self) -> str | None:
        """The unit (SI) of the balance; None without one, or where the expressions that it stands in leave it open."""
        from flywheel.machine.loads import balance_unit

        return None if self.machine is None else balance_unit(self.machine.efforts, self.scene)

    @property
    def inertia(self) -> float | None:
        """The flywheel given, or the exact one, kg m² at its own shaft."""
        return self.flywheel.exact if self.scene.inertia is None else self.scene.inertia

    @property
    def constant_speed(self) -> float | None:
        """The speed (rad/s) that areas and approximate figures take torques at that depend on it; None where none does."""
        if self.cyclic is not None:
            return self.cyclic.constant_speed
        return None if self.constant is None else self.speed

    @property
    def reached(self) -> bool:
        """Whether every estimated relative error is within rtol."""
        error = self.error
        flywheels = (error.exact, error.approximate, error.inertia_torque, error.inertia_torque_flywheel)
        return all(error is None or error <= self.rtol for error in (*flywheels, error.simulation, error.work))

    def as_dict(self) -> dict[str, Any]:
        """The JSON contract of `flywheel size`, SI throughout, plus the keys that this version adds."""
        from flywheel.sizing.errors import estimates

        scene = self.scene
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
            "reduced_inertia": _inertia_dict(self.reduced_inertia),
            "flywheel": {k: v for k, v in self.flywheel._asdict().items() if "bracket" not in k},
            "simulation": self.simulation and _confirmation_dict(self.simulation),
            "error": {**estimates(self), **_heat_errors(self.energy)},
            "closure": self.closure,
            "energy": self.energy and self.energy.as_dict(),
            "engine": self.engine and self.engine.as_dict(),
            "multiplier": self.cyclic and self.cyclic.multiplier,
            "constant_speed": self.constant_speed,
            "gd2": None if self.inertia is None else 4.0 * self.inertia,
            "shafts": [row.as_dict() for row in self.shafts],
            "wheel": self.built and _built_dict(self.built),
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


_HEATING = ("current_rms", "current_peak", "copper_heat", "copper_heat_share", "rotor_heat", "rotor_heat_share")


def _heat_errors(energy: Energy | None) -> dict[str, float | None]:
    """Errors of what heats a motor; None where there is no such figure."""
    return {name: None if energy is None else energy.errors.get(name) for name in _HEATING}


def _inertia_dict(inertia: ReducedInertia | None) -> dict[str, float | None]:
    least, greatest, mean = inertia or (None, None, None)
    return {"min": least, "max": greatest, "mean": mean}


def _built_dict(built: Built) -> dict[str, Any]:
    found = {"torque": built.torque, "irregularity": built.irregularity, "irregularity_error": built.error}
    return {**built.wheel.as_dict(), **found}


def _confirmation_dict(confirmation: Confirmation) -> dict[str, Any]:
    return confirmation._asdict()
