"""What a sizing returns: frozen records in SI, the estimated error of every figure, and the dictionary for JSON.

What a sizing estimates on its way (`Errors`) is about what is searched for; the errors of all other figures follow from it,
and are worked out for JSON alone, as are the drive's energy, the engine and the other shafts for who asks for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.records import NamedTuple
from flywheel.components.energy import Energy
from flywheel.components.gear_trains import OnShaft, on_every_shaft
from flywheel.machine.dynamics import moments_on
from flywheel.machine.machine import Machine, balance_unit
from flywheel.mechanisms.families import ends_of
from flywheel.numerics import cells, notebook
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.numerics.budget import FREE, Cost
from flywheel.numerics.cells import ROUNDING, Array, Cells, Coarse
from flywheel.numerics.faults import SceneError
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run, inertia_extent
from flywheel.regime.wittenbauer import Area, Figures, Flywheel, ReducedInertia
from flywheel.scene.accuracy import AUDIT
from flywheel.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flywheel.components.motors import DC, Induction, Motor
    from flywheel.components.wheels import Wheel
    from flywheel.sizing.duty import Duty
    from flywheel.sizing.electrical_transients import ElectricalTransients
    from flywheel.sizing.power_flow import PowerFlow
    from flywheel.sizing.synchronism import Synchronism

__all__ = [
    "Area",
    "Balance",
    "Built",
    "Confirmation",
    "Cyclic",
    "Errors",
    "Flywheel",
    "Limit",
    "ReducedInertia",
    "Sizing",
    "Sizings",
]

Estimate = float | None | dict[str, float | None]

_READ = 4 * ROUNDING  # of a figure that is the scene's own, or a product of a few such
_MOST_COLUMNS = 8  # of a table of sizings
_TIE = 1e-9  # share within which two sizes are one
_LEVEL_ROUNDING = 4 * ROUNDING  # of the energy's level
_MOST_CELLS = 4_000  # that a mean over time is worth, beside those of the cycle itself
_LOSSES = "losses"  # how the model of a load begins that nothing is gained by
_APART = 1e-6  # share by which a speed is changed to see what depends on it
_HEATING = (
    *("current_rms", "current_peak", "copper_heat", "copper_heat_share"),
    *("rotor_heat", "rotor_heat_share", "stator_heat", "stator_heat_share"),
)


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


class Limit(NamedTuple):
    """A limit of `[flywheel.limits]`, and what became of it; shares of the motor's rated figures, but for irregularity.

    `asked`; `reached` with the exact flywheel; `alone` (kg m² at its own shaft) that it alone would need. `simulated` is
    what the confirmation in time finds instead of `reached`, None without one. The errors are those of `reached`, relative
    to it, and of `alone`, relative to it too, or where that is 0, to what decides that it is.
    """

    asked: float
    reached: float
    alone: float
    simulated: float | None = None
    reached_error: float = 0.0
    alone_error: float = 0.0

    def as_dict(self) -> dict[str, float | None]:
        """For JSON; the errors stand with those of the other figures."""
        return {name: value for name, value in self._asdict().items() if not name.endswith("_error")}


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


class ConstantSpeed(NamedTuple):
    """What friction in joints would make of a machine if it were that of a constant crank speed (rad/s).

    The exact flywheel (kg m² at its own shaft; None in an analysis), the irregularity with it or with the given one, the
    scene's balance (SI), and the fluctuation of energy (J).
    """

    speed: float
    exact: float | None
    irregularity: float | None
    balance: float | None
    energy_fluctuation: float


class JointFriction(NamedTuple):
    """How friction in joints was found along the steady motion, whose speeds and accelerations depend on it in turn.

    `rounds`: how often one was found from the other; `left`: what they may still be off by (J in a cycle).
    """

    rounds: int
    left: float
    constant_speed: ConstantSpeed


class Confirmed(NamedTuple):
    """A motion that was found, its error relative to what it confirms, that of its period, and what is to be said of it.

    `limited` are the figures that the scene limits, by their names, as a route of its own finds them.
    """

    motion: Confirmation | None = None
    error: float | None = None
    period_error: float | None = None
    messages: tuple[str, ...] = ()
    limited: Mapping[str, float] = {}


class Regime(NamedTuple):
    """The steady regime of a machine with its given, its exact or no flywheel: what is confirmed, and what a wheel runs in.

    `figures` are those of the areas, at a constant speed where torques depend on it; `motion` is the one that they give, or
    that was solved for; `run` is the same, but None where nothing stores energy, and even where nothing varies the speed.
    `cycle` is the one along the motion, `speed` its mean of extremes (rad/s), `exact` the inertia on the crank (kg m²) that
    its irregularity asks for, or its limits, with its relative error, where torques depend on speed. `limits` are those of
    the flywheel, and `binding` the one that decides it, where a motor's are among them. `confirmed` is the motion of a
    machine without inertia, `extremes_error` (rad) what the places of switches add to the error of the angles of extreme
    speed.
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
    limits: Mapping[str, Limit] = {}
    binding: str | None = None
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

    `duty` is what the machine does in turn, where the scene has a duty: the other figures are those of its hardest phase.
    `limits` are those that the flywheel was sized for, by their names in `[flywheel.limits]`, and `binding` is the one that
    decides it, None where none does; both are empty where an irregularity is asked for, or a flywheel given.
    `friction` tells of friction in joints, where there is any: it is that of the motion's own speeds and accelerations.
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
    friction: JointFriction | None = None
    duty: Duty | None = None
    limits: Mapping[str, Limit] = field(default_factory=dict)
    binding: str | None = None
    accuracy: str = AUDIT
    left_out: tuple[str, ...] = ()
    cost: Cost = FREE

    def __repr__(self) -> str:
        """The flywheel and what it gives; `figures` has all of them."""
        wheel, title = self.flywheel, notebook.quoted(self.scene.title)
        what = f"inertia={wheel.inertia}" if self.scene.inertia is not None else f"exact={wheel.exact}"
        motion = "" if self.simulation is None else f", irregularity={self.simulation.irregularity}"
        return f"Sizing({title}on={wheel.on!r}, {what}, speed={self.speed}{motion})"

    def _repr_html_(self) -> str | None:
        """What a notebook shows."""
        return notebook.html(self)

    @property
    def figures(self) -> dict[str, float | str | bool | None]:
        """Every figure by its name in the JSON contract, SI, parts after a dot: `flywheel.exact`, `error.flywheel.exact`.

        Made for tables of many sizings: `pandas.DataFrame([sizing.figures for sizing in sweep])`. Lists are left out, and
        what a computation cost.

        >>> import flywheel
        >>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": 10},
        ...                        "flywheel": {"irregularity": 0.02}})
        >>> figures = flywheel.size(scene).figures
        >>> figures["flywheel.exact"], figures["error.exact"] < 1e-12
        (50.0, True)
        """
        return dict(_flat("", {key: value for key, value in self.as_dict().items() if key not in ("cost", "explanation")}))

    def report(
        self, path: str | Path | None = None, *, language: str | None = None, units: str = "si", page: str = "all"
    ) -> HtmlPage | None:
        """The worked report: written into a file, HTML or PDF as its ending says, or else as a page that a notebook shows.

        Args:
            path: ends in .html or .pdf; None to have the page itself.
            language: "en" or "es"; the language in use if None.
            units: "si" or "us".
            page: "all", or "summary" for the first page alone, which a designer signs.

        Raises:
            ValueError: for another ending, or another page.
            OSError: if the file cannot be written.

        """
        import flywheel

        if path is None:
            return HtmlPage(flywheel.report.html(self, language=language, units=units, page=page))
        flywheel.report.write(self, path, language=language, units=units, page=page)
        return None

    def plot(self, path: str | Path | None = None) -> Figure | None:
        """The picture of `flywheel size --plot`: written into a file (PNG, SVG or PDF), or else as a figure of matplotlib.

        Raises ValueError for another ending, OSError where the file cannot be written.
        """
        import flywheel

        if path is None:
            return flywheel.notebooks.picture(self)
        flywheel.notebooks.save_picture(self, path)
        return None

    @cached_property
    def energy(self) -> Energy | None:
        """Power and energy of the drive with the flywheel and without it; None without a drive or a motion."""
        return None if self.scene.drive is None else energy(self)

    @cached_property
    def engine(self) -> EngineCycle | None:
        """What the gas of an engine's cylinders does, and what the machine's loads take of it; None without an engine."""
        return engine(self)

    @cached_property
    def power_flow(self) -> PowerFlow | None:
        """Every power from the drive's input to the loads, with all that is lost and stored; None for a scene of areas."""
        from flywheel.sizing.power_flow import power_flow  # for who asks for it

        return power_flow(self)

    @cached_property
    def electrical_transients(self) -> ElectricalTransients | None:
        """What the fluxes of a two-axis induction motor change beside its static curve; None for other drives."""
        from flywheel.sizing.electrical_transients import electrical_transients  # for who asks for it

        return electrical_transients(self)

    @cached_property
    def synchronism(self) -> Synchronism | None:
        """How a synchronous motor keeps step: load angle, pull-out, natural frequency; None for other drives."""
        from flywheel.sizing.synchronism import synchronism  # for who asks for it

        return synchronism(self)

    @cached_property
    def shafts(self) -> tuple[OnShaft, ...]:
        """The flywheel given or sized, and those that do the same on every other shaft, at the means of extremes.

        Where a wheel is built, it counts as built, rounded up or not. The others are that wheel made as wide as they need to
        be: at its radii mass and inertia grow with the width alike. Their rims run at the speed that the built wheel was
        chosen for, as the shafts are geared.
        """
        if self.inertia is None:
            return ()
        scene, wheel = self.scene, None if self.built is None else self.built.wheel
        inertia = self.inertia if wheel is None else wheel.inertia
        rows = on_every_shaft(inertia, scene.shafts, self.speed, on=scene.flywheel_on)
        if wheel is None:
            return rows
        return tuple(
            row._replace(
                radius=wheel.body.running,
                mass=wheel.mass * row.inertia / wheel.inertia,
                rim_speed=wheel.rim_speed * (row.ratio / scene.flywheel_ratio),
            )
            for row in rows
        )

    @property
    def balance_unit(self) -> str | None:
        """The unit (SI) of the balance; None without one, or where the expressions that it stands in leave it open."""
        return None if self.machine is None else balance_unit(self.machine.efforts, self.scene)

    @property
    def inertia(self) -> float | None:
        """The flywheel given, or the exact one, kg m² at its own shaft."""
        return self.flywheel.exact if self.scene.inertia is None else self.scene.inertia

    @property
    def approximated(self) -> bool:
        """Whether the approximate flywheels are for what decides the exact one: an irregularity, and no other limit."""
        return not self.scene.limits or (self.scene.irregularity is not None and self.binding == "irregularity")

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
            "flywheel": {
                **{k: v for k, v in self.flywheel._asdict().items() if "bracket" not in k},
                "limits": {name: limit.as_dict() for name, limit in self.limits.items()} or None,
                "binding": self.binding,
            },
            "simulation": self.simulation and self.simulation._asdict(),
            "error": {
                **estimates(self),
                **{key: energy and energy.errors.get(key) for key in _HEATING},
                "duty": self.duty and dict(self.duty.errors),
            },
            "closure": self.closure,
            "energy": energy and energy.as_dict(),
            "engine": self.engine and self.engine.as_dict(),
            "multiplier": self.cyclic and self.cyclic.multiplier,
            "constant_speed": self.constant_speed,
            "friction": self.friction
            and {**self.friction._asdict(), "constant_speed": self.friction.constant_speed._asdict()},
            "duty": self.duty and self.duty.as_dict(),
            "gd2": None if self.inertia is None else 4.0 * self.inertia,
            "shafts": [row.as_dict() for row in self.shafts],
            "power_flow": self.power_flow and self.power_flow.as_dict(),
            "synchronism": self.synchronism and self.synchronism.as_dict(),
            "electrical_transients": self.electrical_transients and self.electrical_transients.as_dict(),
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


def _flat(prefix: str, data: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """The figures of nested dictionaries, each under its keys with dots between."""
    for key, value in data.items():
        name = f"{prefix}.{key}" if prefix else key
        if isinstance(value, dict):
            yield from _flat(name, value)
        elif value is None or isinstance(value, (float, int, str, bool, np.floating)):
            yield name, float(value) if isinstance(value, np.floating) else value


class HtmlPage(str):
    """A page of HTML, which a notebook shows in a frame of its own."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"HtmlPage({len(self)} characters)"

    def _repr_html_(self) -> str:
        """The page in a frame, so that its styles stay its own."""
        from html import escape  # notebooks alone show it so

        return (
            f'<iframe title="report" style="width:100%;height:40em;border:1px solid #8886" srcdoc="{escape(self)}"></iframe>'
        )


class Sizings(tuple[Sizing, ...]):
    """Several sizings, a sweep: shown as a table of what differs between them.

    >>> import flywheel
    >>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": 10},
    ...                        "flywheel": {"irregularity": 0.02}})
    >>> sweep = Sizings(flywheel.size(scene.with_({"flywheel.irregularity": eps})) for eps in (0.02, 0.04))
    >>> sweep, [row["flywheel.exact"] for row in sweep.figures]
    (Sizings(2 sizings), [50.0, 25.0])
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return f"Sizings({len(self)} sizings)"

    def _repr_html_(self) -> str | None:
        """What a notebook shows."""
        return notebook.html(self)

    @property
    def figures(self) -> list[dict[str, float | str | bool | None]]:
        """The figures of each, for `pandas.DataFrame`."""
        return [sizing.figures for sizing in self]

    @property
    def columns(self) -> list[str]:
        """The names of the figures that differ and that are no errors, those that matter most first."""
        rows = self.figures
        names = dict.fromkeys(name for row in rows for name in row)
        differ = [n for n in names if not n.startswith("error.") and len({repr(row.get(n)) for row in rows}) > 1]
        first = ("irregularity", "flywheel.inertia", "flywheel.exact", "flywheel.approximate", "simulation.irregularity")
        return [*(name for name in first if name in differ), *(name for name in differ if name not in first)][:_MOST_COLUMNS]


# -- the drive ---------------------------------------------------------------------------------------------------------


def drive_moment(machine: Machine, cycle: Cycle, run: Run | None, speed: float) -> Array:
    """The drive's moment on the crank (N m) along the motion, at the cycle's nodes (cells, nodes).

    Args:
        machine: with a drive.
        cycle: along the motion.
        run: the motion, where there is one.
        speed: mean of extremes, rad/s.

    """
    if run is not None and run.drive is not None:
        return run.drive
    at = speed if machine.depends_on_speed else None
    moments = machine.reduction.moments(cycle.mesh.phi, cycle.mesh.anchor, cycle.balance or 0.0, speed=at)
    return np.asarray(moments["drive"] + np.zeros_like(cycle.mesh.phi))


def drive_work(machine: Machine, cycle: Cycle, run: Run | None, speed: float) -> float | None:
    """Work (J) of the drive over the cycle, 0 where that is no more than its error; None without a drive."""
    drive = machine.scene.drive
    if drive is None:
        return None
    if drive.law is None or isinstance(drive.law, float | int):
        torque = (cycle.balance or 0.0) if drive.law is None else drive.law
        work = torque * machine.scene.shafts[drive.on] * machine.scene.cycle
    else:
        work = float(cells.integral(drive_moment(machine, cycle, run, speed), cycle.mesh.half).sum())
    return _above(work, cycle.errors.work)


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def energy(sizing: Sizing) -> Energy | None:
    """Mean and peak power and rms torque with the flywheel; powers of a motor that follows the loads without one.

    Peaks are found where the slope of power is zero, and at the ends of smooth pieces. None without a motion, and where
    rounding of enormous torques has stopped the machine.
    """
    machine, cycle, run, speed, scene = sizing.machine, sizing.cycle, sizing.run, sizing.speed, sizing.scene
    if machine is None or cycle is None or run is None or scene.drive is None:
        return None
    half, omega = cycle.mesh.half, _omega(sizing, cycle)
    if not omega.min() > 0.0:
        return None
    drive = drive_moment(machine, cycle, run, speed)
    period, _ = turning_moment.period(cycle, speed, run, sizing.rtol)
    work = _above(float(cells.integral(drive, half).sum()), cycle.errors.work)
    moment = cycle.series[0] @ cells.basis(cells.NODES, cells.ORDER).T
    load = drive - moment  # what the loads and losses take, and a motor without a flywheel would have to give
    alone = _above(float(cells.integral(load, half).sum()), cycle.errors.work) / scene.cycle * speed
    noise = cycle.errors.work / scene.cycle  # of a moment
    greatest = float(np.abs(drive).max()) or 1.0  # squares of enormous moments leave the floating-point range
    square, time = (float(cells.integral(row, half).sum()) for row in ((drive / greatest) ** 2 / omega, 1.0 / omega))
    found = Energy(
        period=period,
        work=work,
        mean_power=work / period,
        peak_power=_above(_peak(cells.fit(drive * omega)), noise * speed),
        mean_power_alone=alone,
        peak_power_alone=_above(_peak(cells.fit(load * speed)), noise * speed),
        rms_torque=_above(greatest * float(np.sqrt(square / time)), noise) / scene.shafts[scene.drive.on],
    )
    if scene.motor is None:
        return found
    from flywheel.components.motors import DC, Induction, TwoAxisInduction  # only machines with a motor pay for it

    shaft = MotorShaft(scene, cycle, run, speed, sizing.rtol)
    if isinstance(scene.motor, DC):
        return found._replace(**_copper_heat(scene.motor, shaft))
    if isinstance(scene.motor, TwoAxisInduction) and run.states:
        from flywheel.sizing.electrical_transients import heats_by_fluxes  # for who has them

        return found._replace(**heats_by_fluxes(scene.motor, shaft))
    if isinstance(scene.motor, Induction):
        return found._replace(**_rotor_heat(scene.motor, shaft))
    return found


def _above(value: float, error: float) -> float:
    """A figure, or 0 where rounding leaves nothing of it: ratios to it would be noise."""
    return 0.0 if abs(value) <= error else value


def _peak(series: Array) -> float:
    """The value of a function that is largest in size, with its sign; where both signs are as large, the positive one."""
    high, low = cells.greatest(series), -cells.greatest(-series)
    return high if high >= -low * (1 - _TIE) else low


class MotorShaft:
    """A motor's shaft along the steady motion: its speed, torque and current on any mesh, with the error of the speed.

    `speed` (rad/s) is the mean of extremes of the crank, where the run does not bring its own; `rtol` what integrals and
    extremes are found to. `along` is the crank's speed at the nodes of the run's cycle where no inertia determines it.
    """

    def __init__(self, scene: Scene, cycle: Cycle, run: Run, speed: float, rtol: float, along: Array | None = None) -> None:
        self.motor, self.cycle, self.run, self.rtol = scene.motor, run.cycle or cycle, run, rtol
        self.mean, self.along = run.speed or speed, along
        self.ratio = 1.0 if scene.drive is None else scene.shafts[scene.drive.on]

    def omega(self, mesh: Cells) -> Array:
        """Speed of the crank, rad/s."""
        if self.along is not None:
            cell, t = cells.located(self.cycle.mesh, mesh.phi.ravel())
            return cells.value(cells.fit(self.along)[cell], t).reshape(mesh.phi.shape)
        return turning_moment.speed_over_cycle(self.cycle, self.mean, self.run, mesh.phi.ravel()).reshape(mesh.phi.shape)

    def torque(self, mesh: Cells, omega: Array) -> Array:
        """Torque of the motor on its shaft, N m: by its law, or that of its own states where it has any."""
        assert self.motor is not None
        if not self.run.states or self.run.drive is None:
            return self.motor.torque(self.ratio * omega)
        cell, t = cells.located(self.cycle.mesh, mesh.phi.ravel())
        return cells.value(cells.fit(self.run.drive)[cell], t).reshape(mesh.phi.shape) / self.ratio

    @property
    def torque_error(self) -> float:
        """What the cells leave open of the torque (N m on the motor's shaft) where it follows states of its own."""
        if not self.run.states or self.run.drive is None:
            return 0.0
        return float(cells.tails(cells.fit(self.run.drive)).max()) / self.ratio

    def torque_law(self, mesh: Cells, omega: Array) -> tuple[Array, Array]:
        """Torque of the motor on its shaft (N m), and the size of its slope by the crank's speed."""
        assert self.motor is not None
        return self.torque(mesh, omega), self.ratio * np.abs(self.motor.slope_at(self.ratio * omega))

    def current_law(self, mesh: Cells, omega: Array) -> tuple[Array, Array]:
        """Current of the motor over the rated one, by its own states where it has any; size of its slope by the speed."""
        motor, speed, run = self.motor, self.ratio * omega, self.run
        assert motor is not None
        here, beside = motor.current_share(speed), motor.current_share(speed * (1.0 + _APART))
        slope = np.zeros_like(omega)
        if here is not None and beside is not None:
            slope = np.abs(beside - here) / (_APART * omega)
        if motor.circuit is not None and run.along is not None and motor.rated_current is not None:
            own = self.cycle.mesh
            flowing = motor.circuit.current(self.ratio * self.omega(own), tuple(run.along))
            cell, t = cells.located(own, mesh.phi.ravel())
            here = cells.value(cells.fit(flowing)[cell], t).reshape(mesh.phi.shape) / motor.rated_current
        assert here is not None
        return here, slope

    def extremes(self, law: Callable[[Cells, Array], tuple[Array, Array]]) -> tuple[float, float, float]:
        """The least and the greatest value along the motion, and the error of either; `law` as in `mean_over_time`."""

        def evaluated(edges: Array) -> tuple[tuple[float, float, float], float, Coarse]:
            mesh = cells.cells(edges)
            omega = self.omega(mesh)
            value, slope = law(mesh, omega)
            series = cells.fit(value)
            least, most = cells.extents(series)
            tails, size = cells.tails(series), float(np.abs(value).max()) or 1.0
            off = float((slope * self.speed_error(omega)).max()) + 24 * ROUNDING * size
            found = float(least.min()), float(most.max()), float(tails.max()) + off
            # cells that hold neither extreme need not be fine
            near = (most + tails >= most.max() - tails.max()) | (least - tails <= least.min() + tails.max())
            worst = float(tails[near].max())
            return (*found[:2], worst + off), worst / size, lambda share: near & (tails > share * worst)

        first = self.cycle.mesh.edges
        return cells.refined(first, evaluated, 0.1 * self.rtol, max(_MOST_CELLS, 2 * first.size))

    def speed_error(self, omega: Array) -> Array:
        """Error of the crank's speed, rad/s: of the level of energy, the more the slower it is, and of what varies."""
        run = self.run
        if self.along is not None:
            return np.full(omega.shape, run.error * run.irregularity * run.speed_max)
        pinned = max(run.error - 4.0 * run.level_error, 0.0) * run.irregularity
        return self.mean * (pinned + (run.level + _LEVEL_ROUNDING) * self.mean / omega)

    def mean_over_time(self, law: Callable[[Cells, Array], tuple[Array, Array]]) -> tuple[float, float, Cells]:
        """The mean over time of a value along the motion, its error, and cells that are fine enough for it.

        integral of h/omega dphi over integral of dphi/omega; `law` gives h and |dh/domega| on a mesh. An error d(omega)
        makes (|dh/domega| + |h - mean|/omega) d(omega) of h.
        """

        def evaluated(edges: Array) -> tuple[tuple[Cells, Array, Array, Array, float, float, float], float, Coarse]:
            mesh = cells.cells(edges)
            omega = self.omega(mesh)
            value, slope = law(mesh, omega)
            rows = np.stack((value / omega, 1.0 / omega))
            total, time = cells.integral(rows, mesh.half).sum(axis=-1).tolist()
            mean = total / time
            tails = cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(rows)) * mesh.half[:, 0]
            shares = (tails[0] + abs(mean) * tails[1]) / time
            missed = float(shares.sum())
            error = missed / max(abs(mean), 1e-300) if missed else 0.0
            return (mesh, omega, value, slope, time, mean, missed), error, cells.above(shares, 0.1)

        first = self.cycle.mesh.edges
        mesh, omega, value, slope, time, mean, missed = cells.refined(
            first, evaluated, self.rtol, max(_MOST_CELLS, 2 * first.size)
        )
        by_speed = (slope + np.abs(value - mean) / omega) * self.speed_error(omega) / omega
        error = float(cells.integral(by_speed, mesh.half).sum()) / time + missed
        return mean, error + 24 * ROUNDING * abs(mean), mesh


def heat_share(motor: Motor, shaft: MotorShaft) -> tuple[float, float]:
    """The mean heat of a motor over time, over that at its rated point (see `motor_heat`), and its absolute error."""
    from flywheel.components.motors import DC  # only machines with a motor pay for it

    if isinstance(motor, DC):
        found = _copper_heat(motor, shaft)
        share = found["copper_heat_share"]
        return share, found["errors"]["copper_heat_share"] * max(share, ROUNDING)

    def law(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        here, beside = (motor_heat(motor, shaft.ratio * w) for w in (omega, omega * (1.0 + _APART)))
        slope, along, own = np.abs(beside - here) / (_APART * omega), shaft.run.along, shaft.cycle.mesh
        if along is None:
            return here, slope
        cell, t = cells.located(own, mesh.phi.ravel())
        series = cells.fit(motor_heat(motor, shaft.ratio * shaft.omega(own), tuple(along)))
        return cells.value(series[cell], t).reshape(mesh.phi.shape), slope

    mean, error, _ = shaft.mean_over_time(law)
    even, rated = motor.no_load_speed or 0.0, 0.0 if motor.rated is None else motor.rated.speed
    return mean, error + 8 * ROUNDING * mean * even / max(even - rated, ROUNDING * even)  # of what slips at the rated point


def motor_heat(motor: Motor, omega: Array, states: tuple[Array, ...] = ()) -> Array:
    """Heat of a motor at speeds of its shaft (rad/s), over that at its rated point; with its own states, where it has any.

    Of a DC motor that of its armature; of an induction motor that of rotor and stator copper, or of the rotor alone where
    its plate does not tell the stator's.
    """
    from flywheel.components.motors import DC, Induction  # only machines with a motor pay for it
    from flywheel.components.motors.two_axis import TwoAxisInduction

    if isinstance(motor, DC):
        assert motor.rated_current is not None
        flowing = states[0] if states else motor.current(omega)
        return np.asarray((flowing / motor.rated_current) ** 2)
    assert isinstance(motor, Induction)
    if isinstance(motor, TwoAxisInduction) and (circuit := motor.circuit) is not None:
        here, rated = states or circuit.steady(omega), circuit.steady(np.array(motor.speed))
        found, there = (circuit.rotor_heat(each) + circuit.stator_heat(each) for each in (here, rated))
        return np.asarray(found / there)

    def heat(speed: Array) -> Array:
        stator = motor.stator_heat(speed)
        return motor.rotor_heat(speed) if stator is None else motor.rotor_heat(speed) + stator

    return heat(omega) / heat(np.array(motor.speed))


def _rotor_heat(motor: Induction, shaft: MotorShaft) -> dict[str, Any]:
    """Heat of an induction motor's rotor, the mean of T (omega_s - omega); current and heat of its stator by the plate."""

    def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        speed = shaft.ratio * omega
        slope = motor.slope_at(speed) * (motor.synchronous_speed - speed) - motor.torque(speed)
        return motor.rotor_heat(speed), shaft.ratio * np.abs(slope)

    mean, error, _ = shaft.mean_over_time(heat)
    found, relative = _figure_and_error(mean, error, float(motor.rotor_heat(0.0)))
    rated = float(motor.rotor_heat(motor.speed))
    errors = {"rotor_heat": relative, "rotor_heat_share": relative + 8 * ROUNDING / motor.rated_slip}
    figures: dict[str, Any] = {"rotor_heat": found, "rotor_heat_share": found / rated}
    if motor.line_current.complete:
        of_stator, of_errors = _stator_heat(motor, shaft)
        figures, errors = figures | of_stator, errors | of_errors
    return {**figures, "errors": errors}


def _stator_heat(motor: Induction, shaft: MotorShaft) -> tuple[dict[str, float], dict[str, float]]:
    """Line current of an induction motor and copper heat of its stator, the mean of (I/I_n)², with relative errors."""

    def square(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        share, slope = shaft.current_law(mesh, omega)
        return share * share, 2 * share * slope

    mean, error, _ = shaft.mean_over_time(square)
    _, peak, off = shaft.extremes(shaft.current_law)
    relative = error / mean
    figures, errors = {"stator_heat_share": mean}, {"stator_heat_share": relative}
    if (rated_heat := motor.rated_stator_heat) is not None:
        figures["stator_heat"], errors["stator_heat"] = mean * rated_heat, relative
    if (rated := motor.rated_current) is not None:
        figures |= {"current_rms": rated * math.sqrt(mean), "current_peak": rated * peak}
        errors |= {"current_rms": relative, "current_peak": off / peak}
    return figures, errors


def _copper_heat(motor: DC, shaft: MotorShaft) -> dict[str, Any]:
    """Current and heat of a DC motor's armature: the mean of R i²."""

    def current(mesh: Cells, omega: Array) -> Array:
        return np.asarray(motor.current_of_torque(shaft.ratio * omega, shaft.torque(mesh, omega)))

    def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        flowing = current(mesh, omega)
        return motor.copper_heat(flowing), 2 * shaft.ratio * motor.constant * np.abs(flowing)

    mean, error, mesh = shaft.mean_over_time(heat)
    omega = shaft.omega(mesh)
    series = cells.fit(current(mesh, omega))
    locked = motor.voltage / motor.resistance
    off = float(cells.tails(series).max()) + 24 * ROUNDING * locked
    off += shaft.ratio * motor.constant / motor.resistance * float(shaft.speed_error(omega).max())
    if motor.inductance:  # the current follows the speed behind its own equation, which the cells may cut off as well
        error += 2 * motor.resistance * float(np.sqrt(mean / motor.resistance)) * float(cells.tails(series).max())
    found, relative = _figure_and_error(mean, error, motor.copper_heat(locked))
    peak, of_peak = _figure_and_error(_peak(series), off, locked)
    errors = {"copper_heat": relative, "current_rms": relative, "current_peak": of_peak}
    share, rated = None, motor.rated_current
    if rated is not None:
        share = found / motor.copper_heat(rated)
        errors["copper_heat_share"] = relative + 8 * ROUNDING * locked / rated
    return {
        "current_rms": float(np.sqrt(found / motor.resistance)),
        "current_peak": peak,
        "copper_heat": found,
        "copper_heat_share": share,
        "errors": errors,
    }


def _figure_and_error(value: float, error: float, scale: float) -> tuple[float, float]:
    """A figure and its relative error; 0, and the error as a share of its scale, where nothing of it is left."""
    found = _above(value, error)
    return found, error / (abs(found) or scale)


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
def engine(sizing: Sizing) -> EngineCycle | None:
    """The engine of a machine: None where no gas drives it.

    The gas is that of the loads with a bore; without any, in a machine without a drive or with one that brakes, the forces
    on those ports that they drive over the cycle. The brake is what all other loads and the drive take, but for models of
    losses.
    """
    machine, cycle, drive_work = sizing.machine, sizing.cycle, sizing.drive_work
    if machine is None or cycle is None:
        return None
    loads = machine.scene.loads
    gas = [load for load in loads if load.piston is not None]
    bored = bool(gas)
    if not bored and not ((drive_work or 0.0) >= 0.0 and machine.scene.drive is not None):
        gas = [load for load in loads if not machine.places[load.on].rotating]
    if not gas:
        return None
    works, error = _works(machine, cycle, sizing.run, sizing.speed)
    if not bored:  # that on the ports that it drives
        gas = [load for load in gas if sum(works[other.path] for other in gas if other.on == load.on) > 0.0]
    indicated = sum(works[load.path] for load in gas)
    if not gas or indicated <= error:
        return None
    ports = {load.on for load in gas}
    others = [load for load in loads if load.on not in ports and not load.model.startswith(_LOSSES)]
    taken = -sum(works[load.path] for load in others) - works.get("drive", 0.0)
    brake = taken if taken > error else None
    pistons: dict[Any, float] = {}  # m³ swept in one stroke, as often as the gas in front of each works in the cycle
    known = all(load.piston is not None for load in gas)
    for load in gas if known else ():
        name, _, port = load.on.rpartition(".")
        mechanism = next(m for m in machine.scene.mechanisms if m.name == name)
        try:
            ends = ends_of(mechanism, port, machine.scene.parameters)
        except SceneError:  # a port whose turning points cannot be told
            known = False
            break
        times = machine.scene.shafts[mechanism.shaft] * machine.scene.cycle / load.every
        space = load.path if load.model else ""  # the model's own; loads with a bore on one port share the cylinder
        pistons[load.on, space] = (load.piston or 0.0) * (ends.high - ends.low) * round(times)
    volume = sum(pistons.values()) if known else None
    cycles = sizing.speed / machine.scene.cycle  # a second
    return EngineCycle(
        indicated_work=indicated,
        indicated_power=indicated * cycles,
        swept_volume=volume,
        mean_effective_pressure=None if volume is None else mean_effective_pressure(indicated, volume),
        brake_work=brake,
        brake_power=None if brake is None else brake * cycles,
        mechanical_efficiency=None if brake is None else mechanical_efficiency(brake, indicated),
        error=error,
    )


def _works(machine: Machine, cycle: Cycle, run: Run | None, speed: float) -> tuple[dict[str, float], float]:
    """The work (J) of every load and of the drive in the cycle, by their paths, and the error of them all."""
    mesh, omega = cycle.mesh, None
    if machine.depends_on_speed:
        omega = np.full(mesh.phi.shape, speed)
        if run is not None:
            omega = turning_moment.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    moments = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0, by_name=True, speed=omega)
    names = {effort.path: effort.load.path for effort in machine.efforts}
    values = {names[name]: value + np.zeros_like(mesh.phi) for name, value in moments.items() if name in names}
    works = dict.fromkeys([load.path for load in machine.scene.loads], 0.0)
    works |= {path: float(cells.integral(value, mesh.half).sum()) for path, value in values.items()}
    error = cycle.errors.work + cycle.errors.residual
    error += sum(
        float((cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(value)) * mesh.half[:, 0]).sum())
        + 24 * ROUNDING * float(cells.integral(np.abs(value), mesh.half).sum())
        for value in values.values()
    )
    if omega is not None and run is not None:  # and what the error of the speed may change of what depends on it
        error += 2 * (0.5 * run.irregularity * run.error + run.level_error) * cycle.exchanged
    return works, error


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
        "multiplier": _multiplier_error(sizing, speed),
        "constant_speed": None if cyclic is None else _READ + (0.0 if scene.unknown else cyclic.constant_speed_error),
        "gd2": None if sizing.inertia is None else exact,
        "shafts": of_shafts if sizing.shafts else None,
        "power_flow": None if sizing.power_flow is None else sizing.power_flow.error,
        "wheel": None if sizing.built is None or of_shafts is None else _wheel_error(sizing, of_shafts),
        **_certificate_errors(sizing, constant),
    }
    if cycle is not None and sizing.engine is not None and speed is not None:
        found["engine"] = sizing.engine.error / max(cycle.exchanged, 1e-300) + speed + _READ
    # beyond the floating-point range nothing is known of an error
    return {key: None if isinstance(value, float) and not np.isfinite(value) else value for key, value in found.items()}


@np.errstate(all="ignore")
def figure_errors(sizing: Sizing) -> dict[str, float | None]:
    """Those of `estimates` that need no more than the sizing has found; for many sizings."""
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
        "energy_fluctuation": None if areas is None else areas + (work or 0.0),
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
            own = 2 * (work or 0.0) * constant.exchanged
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
    moment = drive_moment(machine, cycle, sizing.run, sizing.speed)
    by_speed = np.zeros_like(moment)  # what the error of the speed moves it by
    if sizing.cyclic is not None and sizing.run is not None:
        moments, omega = moments_on(machine, cycle.mesh.edges, local=True), _omega(sizing, cycle)
        here, beside = (
            moments.drive(w, cycle.balance or 0.0, moments.steady_states(w)) for w in (omega, omega * (1.0 + _APART))
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
    power = cells.fit(drive_moment(machine, cycle, run, sizing.speed) * _omega(sizing, cycle))
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
    moments, omega = moments_on(machine, cycle.mesh.edges), _omega(sizing, cycle)

    def growth(w: Array) -> Array:
        """dF/dE (1/rad) at speeds w."""
        states = moments.steady_states(w)
        found = moments.rate(w, cycle.balance or 0.0, run.inertia, states).by_speed
        if moments.circuit is not None:  # its states follow the speed
            further = moments.drive(w * (1.0 + _APART), 0.0, moments.steady_states(w * (1.0 + _APART)))
            found = found + (further - moments.drive(w, 0.0, states)) / (_APART * w)
        return np.asarray(found / ((run.inertia + moments.inertia) * w))

    here = growth(omega)
    of_speed = (speed or 0.0) + 0.5 * run.irregularity * run.error
    moved = np.abs(growth(omega * (1.0 + _APART)) - here) / _APART * of_speed
    exponent = float(cells.integral(np.abs(here) * 24 * ROUNDING + moved, cycle.mesh.half).sum())
    exponent += float((cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(here)) * cycle.mesh.half[:, 0]).sum())
    size = abs(cyclic.multiplier)
    return size * exponent / max(size, 1.0) + 8 * ROUNDING * cycle.mesh.half.size


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
