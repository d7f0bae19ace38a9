"""Results of a sizing: frozen records in SI, the estimated error of every figure, and the dictionary for JSON.

These are records: results that follow from a sizing, such as the drive's energy, the engine and the errors of all figures,
are computed on request, by the functions in the sizing's `Derivations`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flywheel.components.energy import Energy, ServoLoad
from flywheel.components.gear_trains import OnShaft, on_every_shaft
from flywheel.machine.loads import balance_unit
from flywheel.machine.machine import Machine
from flywheel.numerics import cells, notebook
from flywheel.numerics.budget import FREE, Cost
from flywheel.numerics.cells import Array, Cells
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.regime.wittenbauer import Area, Broken, Figures, Flywheel, ReducedInertia
from flywheel.scene.scene import AUDIT, Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flywheel.components.motors.thermal import Temperature
    from flywheel.components.wheels import Wheel
    from flywheel.regime.periodic_motion import OwnMotion

__all__ = [
    "Area", "Balance", "Confirmation", "Errors", "Flywheel", "Limit", "ReducedInertia", "SelectedWheel", "Sizing",
    "Sizings", "Stability",
]  # fmt: skip

Estimate = float | None | dict[str, float | None]

_MOST_COLUMNS = 8  # of a table of sizings


class Balance(NamedTuple):
    """The unknown that makes the cycle's net work zero: its name, its value (SI) and that value's relative error."""

    name: str
    value: float
    error: float


WIDTH = 1e-12
"""The relative width that proven intervals reach, or else are refused with the width reached."""


class Proof(NamedTuple):
    """Proven intervals of figures, (low, high) in SI by their keys in JSON, for a scene's numbers as written in decimals.

    `reason` states why nothing is proven, or is empty. `statement` describes what is proven and what is not,
    and `seconds` is the processor's time that it took. `ranges` is true if the intervals hold for all numbers in the
    ranges that the scene gives.
    """

    figures: Mapping[str, tuple[float, float]]
    reason: str
    statement: str
    seconds: float
    ranges: bool = False


class Confirmation(NamedTuple):
    """Motion over one steady cycle: rad/s and s. `closure` is omega(T)/omega(0) - 1; `route` is its method.

    That is "time" (stepping), "collocation", "quadrature", or "areas", which leave the machine's own inertia out.
    """

    irregularity: float
    speed_max: float
    speed_min: float
    period: float | None = None
    speed_time_mean: float | None = None
    closure: float | None = None
    route: str = "time"
    irregularity_approximate: float | None = None


class Limit(NamedTuple):
    """A limit of `[flywheel.limits]`, and its result; shares of the motor's rated figures, except for irregularity.

    `requirement`; `reached` with the exact flywheel; `alone` (kg m² at its own shaft) the flywheel for it alone. `simulated`
    is the value of the confirmation in time, None without one. The errors are those of `reached`, relative to it, and of
    `alone`, relative to it too, or if that is 0, to the inertia that decides it.
    """

    requirement: float
    reached: float
    alone: float
    simulated: float | None = None
    reached_error: float = 0.0
    alone_error: float = 0.0

    def as_dict(self) -> dict[str, float | None]:
        """The figures for JSON; the errors are among those of the other figures."""
        figures = {name: value for name, value in self._asdict().items() if not name.endswith("_error")}
        return {"asked": figures.pop("requirement"), **figures}


class Stability(NamedTuple):
    """Stability of a motion whose torques depend on speed.

    `multiplier`: share of a small change of the state at the start that remains after a cycle; `damping` is 1 minus it.
    `steps`: Newton steps that the motion took. `level_error`: relative error of its mean speed. `constant_speed` (rad/s): at
    which areas and approximate figures take the torques, with its own relative error if the machine sets it.
    """

    multiplier: float
    damping: float
    steps: int
    level_error: float
    constant_speed: float
    constant_speed_error: float = 0.0


class ConstantSpeed(NamedTuple):
    """Figures of a machine whose friction in joints is taken at a constant crank speed (rad/s).

    The exact flywheel (kg m² at its own shaft; None in an analysis), the irregularity with it or with the given one, the
    scene's balance (SI), and the fluctuation of energy (J).
    """

    speed: float
    exact: float | None
    irregularity: float | None
    balance: float | None
    energy_fluctuation: float


class FrictionIteration(NamedTuple):
    """Iteration of friction in joints and the steady motion, each of which depends on the other.

    `rounds`: number of rounds; `left`: remaining error (J in a cycle).
    """

    rounds: int
    left: float
    constant_speed: ConstantSpeed


class Confirmed(NamedTuple):
    """A motion that was found, its error relative to the figures it confirms, that of its period, and remarks.

    `speeds_error` is that of its extreme speeds if their mean is exact.
    `limited` are the figures that the scene limits, by their names, by a separate route.
    """

    motion: Confirmation | None = None
    error: float | None = None
    period_error: float | None = None
    speeds_error: float | None = None
    messages: tuple[str, ...] = ()
    limited: Mapping[str, float] = {}


class Regime(NamedTuple):
    """The steady regime of a machine with its given, its exact or no flywheel: the basis of confirmation and wheel.

    `figures` are those of the areas, at a constant speed where torques depend on it; `motion` is the one that they give, or
    that was solved for; `run` is the same, but None if nothing stores energy, and at constant speed if nothing varies it.
    `cycle` is the one along the motion, `speed` its mean of extremes (rad/s), `exact` the inertia on the crank (kg m²) for
    its irregularity or its limits, with its relative error, where torques depend on speed; `broken` are heavier flywheels,
    at their own shaft, that break a requirement. `limits` are those of the flywheel, and `binding` the one that decides it,
    where a motor's are among them. `confirmed` is the motion of a machine without inertia, `extremes_error` (rad) the share
    of the places of switches in the error of the angles of extreme speed; `solved` is the motion by Newton's method, where
    torques depend on speed.
    """

    machine: Machine
    rtol: float
    figures: Figures
    motion: Run | None
    run: Run | None
    cycle: Cycle
    speed: float
    cyclic: Stability | None = None
    exact: tuple[float, float] | None = None
    broken: tuple[Broken, ...] = ()
    confirmed: Confirmed | None = None
    extremes_error: float = 0.0
    limits: Mapping[str, Limit] = {}
    binding: str | None = None
    messages: tuple[str, ...] = ()
    solved: OwnMotion | None = None

    @property
    def constant(self) -> Cycle | None:
        """The cycle at a constant speed, if that differs from the one along the motion."""
        return None if self.cyclic is None else self.figures.cycle


class SelectedWheel(NamedTuple):
    """The wheel to be built, and the irregularity that the machine has with it, with its relative error.

    `torque` is the greatest between hub and rim (N m, on the wheel's shaft) for which its arms were checked, None without.
    """

    wheel: Wheel
    irregularity: float | None
    error: float
    torque: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """The figures for JSON: those of the wheel, and those of the machine with it."""
        figures = {"torque": self.torque, "irregularity": self.irregularity, "irregularity_error": self.error}
        return {**self.wheel.as_dict(), **figures}


class Errors(NamedTuple):
    """Estimated errors, relative to the figures' scales; None for a missing figure.

    `simulation` is that of the irregularities and of what confirms them. Those of angles are in rad: `angles` of the ends of
    areas, `extremes` of the angles of greatest and least speed.
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
    extreme_speeds: float | None = None


class EngineCycle(NamedTuple):
    """Figures of an engine in a steady cycle; powers are works over its angle, times the mean of extremes.

    `indicated_work` (J) and `indicated_power` (W) of the gas on its pistons; `swept_volume` (m³) of all cylinders, as often
    as their gas works in the cycle, and `mean_effective_pressure` (Pa) over it, None if a bore is not known;
    `brake_work` and `brake_power` of the loads, and `mechanical_efficiency`, their share of the indicated work, None if they
    take no work. `error` (J) is that of the works.
    """

    indicated_work: float
    indicated_power: float
    swept_volume: float | None
    mean_effective_pressure: float | None
    brake_work: float | None
    brake_power: float | None
    mechanical_efficiency: float | None
    error: float


HEATS = ("copper", "stator", "rotor", "iron", "windage")  # kinds of what a motor itself loses
LOSSES = (*HEATS, "mesh", "slip", "drag", "damper", "friction", "resistance")  # kinds of all that is lost


class Stream(NamedTuple):
    """Power from one place to another over a steady cycle, positive from `source` to `target`.

    kind: "input" (of the mains), "drive" (of the motor's shaft), "shaft" (through a mesh), "load", "stored" (by
    inertias, springs, weights: mean 0), or one of `LOSSES`, whose target is "heat". Places are "mains", "drive",
    "shafts.NAME", "heat", and paths of the scene ("load[0]", "spring", "flywheel", "gravity"); `name` is the path of the
    part whose power it is, and `on` the place in the machine where it acts. `mean` (W) is over time,
    `work` (J) of a cycle, `greatest` and `least` (W) the extremes within it.
    """

    source: str
    target: str
    kind: str
    name: str
    on: str
    mean: float
    work: float
    greatest: float
    least: float

    @property
    def lost(self) -> bool:
        """True if it is a loss."""
        return self.kind in LOSSES


class ShaftFlow(NamedTuple):
    """A shaft in the steady cycle, and the load of its mesh with the shaft `on`; None for the crank, which has no mesh.

    `speed` is the mean of extremes, `speed_time_mean` that over time (rad/s). Torque (N m, on this shaft's side of the mesh)
    and power (W) are positive towards `to`, the one of the two shafts that receives power on average.
    """

    shaft: str
    on: str | None
    to: str | None
    ratio: float
    speed: float
    speed_time_mean: float
    irregularity: float
    torque_mean: float | None = None
    torque_greatest: float | None = None
    torque_rms: float | None = None
    power_mean: float | None = None
    power_greatest: float | None = None
    power_rms: float | None = None


@dataclass(frozen=True, repr=False)
class PowerFlow:
    """The power flow of a steady cycle: its streams, its shafts, and their balance (W, mean over time).

    `input` is the power from outside: from the mains if the motor's type gives it, else at its shaft, and from loads that
    drive; `output` the power to loads, and to a drive that brakes; `left` is input - output - losses. `error` is relative:
    of a stream to the larger of its greatest power in size and `scale`, the work exchanged over the period.
    """

    scene: Scene
    streams: tuple[Stream, ...]
    shafts: tuple[ShaftFlow, ...]
    period: float
    input: float
    output: float
    losses: float
    left: float
    scale: float
    error: float
    mesh: Cells
    series: Array

    def __repr__(self) -> str:
        """The balance, instead of every stream."""
        title = notebook.quoted(self.scene.title)
        return f"PowerFlow({title}{self.input:.6g} W in, {self.output:.6g} W out, {self.losses:.6g} W lost)"

    @property
    def efficiency(self) -> float | None:
        """Output over input; None without an input."""
        return self.output / self.input if self.input > self.error * self.scale else None

    def at(self, phi: float) -> tuple[float, ...]:
        """The power (W) of every stream, in their order, at a crank angle (rad); a cycle repeats.

        If powers jump at the angle, those just after it.
        """
        end = float(self.mesh.edges[-1])
        cell, t = cells.located(self.mesh, np.array([phi - end * np.floor(phi / end)]))
        return tuple(cells.value(self.series[:, cell[0]], np.full(len(self.streams), t[0])).tolist())

    def along(self, phi: Array) -> Array:
        """The powers (streams, n) at crank angles (n,) within the cycle, rad."""
        cell, t = cells.located(self.mesh, np.asarray(phi, dtype=float))
        return np.asarray((self.series[:, cell] * cells.basis(t, cells.ORDER)).sum(axis=-1))

    def as_dict(self, at: float | None = None) -> dict[str, Any]:
        """The flow for JSON, SI; with a crank angle (rad) also the `power` of every stream there."""
        powers = (None,) * len(self.streams) if at is None else self.at(at)
        figures: dict[str, Any] = {
            "period": self.period,
            "input": self.input,
            "output": self.output,
            "losses": self.losses,
            "efficiency": self.efficiency,
            "left": self.left,
            "scale": self.scale,
        }
        if at is not None:
            figures["at"] = at
        figures["streams"] = [
            {
                "from": stream.source,
                "to": stream.target,
                **{key: value for key, value in stream._asdict().items() if key not in ("source", "target")},
                **({} if power is None else {"power": power}),
            }
            for stream, power in zip(self.streams, powers, strict=True)
        ]
        figures["shafts"] = [row._asdict() for row in self.shafts]
        return figures

    def plot(self, path: str | Path | None = None, *, at: float | None = None) -> Figure | None:
        """The Sankey diagram, over the mean or at a crank angle (rad): into a file (PNG, SVG or PDF), or as a figure.

        Raises ValueError for another ending, OSError if the file cannot be written.
        """
        import flywheel

        if path is None:
            return flywheel.notebooks.power_picture(self, at)
        flywheel.notebooks.save_picture(self, path, at)
        return None


NEAR = 0.2
"""A harmonic whose frequency is less than this share off the natural frequency is near resonance."""

COUNTS = 0.05
"""Share of the greatest swing from which a harmonic counts."""


class Harmonic(NamedTuple):
    """A harmonic of the moment at a constant speed: its order by the cycle, frequency (Hz), moment on the crank (N m).

    `swing` is the amplitude of speed (rad/s, crank) of a free rotor, `magnification` the factor on it by the
    synchronizing torque and the damper winding, for the linear swing about the mean load angle.
    """

    order: int
    frequency: float
    moment: float
    swing: float
    magnification: float


class Synchronism(NamedTuple):
    """Load angles (rad, electrical) over the steady cycle, and the swing about them.

    `load_angle` is the mean over time. `pull_out_share` is the greatest torque of the load angle over the pull-out torque.
    `natural_frequency` (Hz) and `damping_ratio` are those of small swings about the mean, with the mean inertia and the
    damper winding alone. `errors` are absolute for angles and relative for the others: "harmonics" is that of their moments,
    relative to the greatest, "magnification" the largest of any.
    """

    load_angle: float
    load_angle_greatest: float
    load_angle_least: float
    pull_out_angle: float
    pull_out_share: float
    natural_frequency: float
    damping_ratio: float
    harmonics: tuple[Harmonic, ...]
    errors: dict[str, float]

    @property
    def counting(self) -> tuple[Harmonic, ...]:
        """The significant harmonics."""
        greatest = max((one.swing * one.magnification for one in self.harmonics), default=0.0)
        return tuple(one for one in self.harmonics if one.swing * one.magnification > COUNTS * greatest)

    @property
    def near_resonance(self) -> Harmonic | None:
        """The significant harmonic nearest to the natural frequency, if it is near; else None."""
        near = min(self.counting, key=lambda one: abs(one.frequency / self.natural_frequency - 1.0), default=None)
        return near if near is not None and abs(near.frequency / self.natural_frequency - 1.0) < NEAR else None

    @property
    def heavier_is_nearer(self) -> Harmonic | None:
        """The highest significant harmonic below the natural frequency, which a heavier flywheel lowers; else None."""
        below = [one for one in self.counting if one.frequency < self.natural_frequency]
        return max(below, key=lambda one: one.frequency, default=None)


class Trip(NamedTuple):
    """Cause of a trip of an inverter: "overcurrent" (over the rated current), "overvoltage" or "chopper_power" (W returned).

    `value` is the greatest along the motion, `limit` the permitted value, `angle` that of the crank where it is greatest
    (rad). For a motion in time `time` (s) is that of the first trip, and `angle` the one there; None for a cycle.
    """

    kind: str
    value: float
    limit: float
    angle: float
    time: float | None = None


class InverterLoad(NamedTuple):
    """Power (W) that a motor takes from its inverter: the mean over time, the greatest, the least (below 0: returned).

    `current` is the greatest over the motor's rated one, None if its type does not give it; `errors` are relative except for
    that of the current.
    """

    power: float
    power_greatest: float
    power_least: float
    current: float | None
    trips: tuple[Trip, ...]
    errors: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """All figures for JSON, SI throughout."""
        return {**self._asdict(), "trips": [trip._asdict() for trip in self.trips]}


MATTERS = 0.01
"""Relative difference from the static curve above which the summary says that the fluxes matter."""


class Beside(NamedTuple):
    """A figure by the fluxes, and by the static curve of the same circuit; `error` is the greater relative one."""

    two_axis: float
    static: float
    error: float

    @property
    def difference(self) -> float:
        """Relative difference of the first from the second."""
        return self.two_axis / self.static - 1.0 if self.static else 0.0


class ElectricalTransients(NamedTuple):
    """Figures with the fluxes as states and those of the static curve, with the same flywheel.

    `greatest_torque` is the motor's (N m, on its shaft), `rotor_heat` the mean over time (W).
    """

    irregularity: Beside
    greatest_torque: Beside
    rotor_heat: Beside

    @property
    def matters(self) -> bool:
        """True if a figure differs by more than a hundredth."""
        return any(abs(one.difference) > MATTERS for one in self)

    def as_dict(self) -> dict[str, Any]:
        """The record for JSON."""
        return {name: {**one._asdict(), "difference": one.difference} for name, one in self._asdict().items()}


class PhaseLoad(NamedTuple):
    """A phase of a duty with the flywheel; all fields except `duration` are None at rest, or if they do not apply.

    `duration` (s) with its starts and `cycles` without;
    `speed` (rad/s, mean of extremes, of the crank), `irregularity`; `mean_power` and `peak_power` (W) of the drive,
    `rms_torque` (N m, on its shaft), `heat` (W) of the motor, `current_rms` (A), those of starts included except
    for the peak; shares are over the rated point. `start_time` (s) and `start_heat` (J) are those of one start,
    `change_time` and `change_heat` those of the change of speed from the previous phase, if it is followed, up to
    `change_speed` (rad/s). `settling` (s) is the time in which a change of speed decays to 5 %. `errors` are estimated
    errors of figures, in their units.
    """

    name: str
    rest: bool
    duration: float
    cooling: float = 1.0
    loaded: bool = False
    cycles: float | None = None
    starts: int = 0
    speed: float | None = None
    irregularity: float | None = None
    mean_power: float | None = None
    peak_power: float | None = None
    rms_torque: float | None = None
    rms_torque_share: float | None = None
    heat: float | None = None
    heat_share: float | None = None
    current_rms: float | None = None
    start_time: float | None = None
    start_heat: float | None = None
    change_time: float | None = None
    change_heat: float | None = None
    change_speed: float | None = None
    settling: float | None = None
    errors: Mapping[str, float] = {}


class Duty(NamedTuple):
    """A duty with one flywheel, and its motor's load. `governing` is the phase that decides the flywheel.

    `type` is that of IEC 60034-1 if it is one of S1 to S8; `period`, `running` and `cooled` (s): the whole, the
    part in which the motor is on, and the time that counts for cooling. `cyclic_duration_factor` is the share of the period
    in which the machine is loaded. `mean_power` (W) and `work` (J) are over the period; `rms_torque` (N m, at the drive's
    shaft), `heat` (W) and `current_rms` (A) over the time that cools, shares over the rated point. `errors` are relative.
    """

    type: str | None
    governing: str
    period: float
    running: float
    cooled: float
    cyclic_duration_factor: float
    work: float | None
    mean_power: float | None
    rms_torque: float | None
    rms_torque_share: float | None
    heat: float | None
    heat_share: float | None
    current_rms: float | None
    phases: tuple[PhaseLoad, ...]
    errors: Mapping[str, float]

    def as_dict(self) -> dict[str, Any]:
        """All figures for JSON, SI; errors stand with those of the other figures."""
        figures = {name: value for name, value in self._asdict().items() if name != "errors"}
        phases = [{name: value for name, value in row._asdict().items() if name != "errors"} for row in self.phases]
        return figures | {"phases": phases}


class Derivations(NamedTuple):
    """Functions of figures derived from a sizing on request, so that the record computes nothing."""

    as_dict: Callable[[Sizing], dict[str, Any]]
    errors: Callable[[Sizing], dict[str, Estimate]]
    energy: Callable[[Sizing], Energy | None]
    engine: Callable[[Sizing], EngineCycle | None]
    power_flow: Callable[[Sizing], PowerFlow | None]
    electrical_transients: Callable[[Sizing], ElectricalTransients | None]
    synchronism: Callable[[Sizing], Synchronism | None]


@dataclass(frozen=True, repr=False)
class Sizing:
    """Result of sizing or analysing one scene. Field names are those of the JSON contract, if it has them.

    `messages` are important sentences for the user (rtol not reached, no motion with the approximate flywheel...).
    `machine`, `cycle` and `run` are the sources of the figures: None for a scene of areas. If torques depend on speed,
    `cycle` is the one along the motion, `constant` the one at a constant speed for areas and approximate figures,
    and `cyclic` has the stability of the motion; both are None otherwise. `built` is the wheel, if the scene has a shape.

    `duty` has the phases of a duty, if the scene has one: the other figures are those of its hardest phase.
    `limits` are those that the flywheel was sized for, by their names in `[flywheel.limits]`, and `binding` is the one that
    decides it, None if none does; both are empty if the scene has an irregularity, or a given flywheel.
    `friction` has the result for friction in joints, if there is any: friction at the motion's own speeds and accelerations.
    `accuracy` is the level of accuracy, `left_out` the omissions at that level, `cost` the cost of the calculation.
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
    derived: Derivations
    messages: tuple[str, ...] = ()
    machine: Machine | None = None
    cycle: Cycle | None = None
    run: Run | None = None
    constant: Cycle | None = None
    cyclic: Stability | None = None
    built: SelectedWheel | None = None
    friction: FrictionIteration | None = None
    inverter: InverterLoad | None = None
    servo: ServoLoad | None = None
    temperature: Temperature | None = None
    duty: Duty | None = None
    limits: Mapping[str, Limit] = field(default_factory=dict)
    binding: str | None = None
    accuracy: str = AUDIT
    left_out: tuple[str, ...] = ()
    cost: Cost = FREE
    proof: Proof | None = None

    def __repr__(self) -> str:
        """The flywheel and its result; `figures` has all of them."""
        wheel, title = self.flywheel, notebook.quoted(self.scene.title)
        what = f"inertia={wheel.inertia}" if self.scene.inertia is not None else f"exact={wheel.exact}"
        motion = "" if self.simulation is None else f", irregularity={self.simulation.irregularity}"
        return f"Sizing({title}on={wheel.on!r}, {what}, speed={self.speed}{motion})"

    _repr_html_ = notebook.html

    @property
    def figures(self) -> dict[str, float | str | bool | None]:
        """Every figure by its name in the JSON contract, SI, parts after a dot: `flywheel.exact`, `error.flywheel.exact`.

        Made for tables of many sizings: `pandas.DataFrame([sizing.figures for sizing in sweep])`. Lists are left out, and
        costs of computation.

        >>> import flywheel
        >>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": 10},
        ...                        "flywheel": {"irregularity": 0.02}})
        >>> figures = flywheel.size(scene).figures
        >>> figures["flywheel.exact"], figures["error.exact"] < 1e-12
        (50.0, True)
        """
        return dict(
            _flat("", {key: value for key, value in self.as_dict().items() if key not in ("cost", "explanation", "proof")})
        )

    def report(
        self, path: str | Path | None = None, *, language: str | None = None, units: str = "si", cover_sheet: bool = False
    ) -> HtmlReport | None:
        """The worked report: written into a file, HTML or PDF by its ending, or returned as HTML that a notebook shows.

        Args:
            path: ends in .html or .pdf; None to have the HTML itself.
            language: "en" or "es"; the language in use if None.
            units: "si" or "us".
            cover_sheet: the cover sheet alone, which a designer signs.

        Raises:
            ValueError: for another ending.
            OSError: if the file cannot be written.

        """
        import flywheel

        if path is None:
            return HtmlReport(flywheel.report.html(self, language=language, units=units, cover_sheet=cover_sheet))
        flywheel.report.write(self, path, language=language, units=units, cover_sheet=cover_sheet)
        return None

    def plot(self, path: str | Path | None = None) -> Figure | None:
        """The picture of `flywheel size --plot`: written into a file (PNG, SVG or PDF), or returned as a matplotlib figure.

        Raises ValueError for another ending, OSError if the file cannot be written.
        """
        import flywheel

        if path is None:
            return flywheel.notebooks.picture(self)
        flywheel.notebooks.save_picture(self, path)
        return None

    @cached_property
    def errors(self) -> dict[str, Estimate]:
        """Estimated errors by the key of the figure or of the block of figures."""
        return self.derived.errors(self)

    @cached_property
    def energy(self) -> Energy | None:
        """Power and energy of the drive with the flywheel and without it; None without a drive or a motion."""
        return self.derived.energy(self)

    @cached_property
    def engine(self) -> EngineCycle | None:
        """Work of the gas in an engine's cylinders, and the loads' share of it; None without an engine."""
        return self.derived.engine(self)

    @cached_property
    def power_flow(self) -> PowerFlow | None:
        """Every power from the drive's input to the loads, with all losses and stores; None for a scene of areas."""
        return self.derived.power_flow(self)

    @cached_property
    def electrical_transients(self) -> ElectricalTransients | None:
        """Effect of the fluxes of a two-axis induction motor compared with its static curve; None for other drives."""
        return self.derived.electrical_transients(self)

    @cached_property
    def synchronism(self) -> Synchronism | None:
        """Synchronism of a synchronous motor: load angle, pull-out, natural frequency; None for other drives."""
        return self.derived.synchronism(self)

    @cached_property
    def shafts(self) -> tuple[OnShaft, ...]:
        """The flywheel given or sized, and the equivalent ones on every other shaft, at the means of extremes.

        A wheel counts as built, rounded up or not. The others are that wheel with the necessary width:
        at its radii mass and inertia are proportional to the width. Their rims run at the speed for which the built wheel
        was chosen, times the gear ratio.
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
        """The unit (SI) of the balance; None without one, or if its expressions leave it undetermined."""
        return None if self.machine is None else balance_unit(self.machine.efforts, self.scene)

    @property
    def inertia(self) -> float | None:
        """The flywheel given, or the exact one, kg m² at its own shaft."""
        return self.flywheel.exact if self.scene.inertia is None else self.scene.inertia

    @property
    def approximated(self) -> bool:
        """True if the approximate flywheels are for the limit of the exact one: an irregularity, and no other."""
        return not self.scene.limits or (self.scene.irregularity is not None and self.binding == "irregularity")

    @property
    def constant_speed(self) -> float | None:
        """The speed (rad/s) at which areas and approximate figures take torques; None if no torque depends on speed."""
        return None if self.cyclic is None else self.cyclic.constant_speed

    @property
    def reached(self) -> bool:
        """True if every estimated relative error is within rtol."""
        error = self.error
        flywheels = (error.exact, error.approximate, error.inertia_torque, error.inertia_torque_flywheel)
        of_speed = None if self.cyclic is None else self.cyclic.level_error
        of_motion = error.simulation, error.period, of_speed
        return all(error is None or error <= self.rtol for error in (*flywheels, *of_motion, error.work))

    def as_dict(self) -> dict[str, Any]:
        """The JSON contract of `flywheel size`, SI throughout, plus the keys that this version adds."""
        return self.derived.as_dict(self)


def _flat(prefix: str, data: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """The figures of nested dictionaries, each under its keys with dots between."""
    for key, value in data.items():
        name = f"{prefix}.{key}" if prefix else key
        if isinstance(value, dict):
            yield from _flat(name, value)
        elif value is None or isinstance(value, (float, int, str, bool, np.floating)):
            yield name, float(value) if isinstance(value, np.floating) else value


class HtmlReport(str):
    """A report as HTML, which a notebook shows in a separate frame."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"HtmlReport({len(self)} characters)"

    def _repr_html_(self) -> str:
        """The report in a frame, so that its styles affect nothing else."""
        from html import escape  # notebooks alone show it so

        return (
            f'<iframe title="report" style="width:100%;height:40em;border:1px solid #8886" srcdoc="{escape(self)}"></iframe>'
        )


class Sizings(tuple[Sizing, ...]):
    """Several sizings, shown as a table of their differences.

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

    _repr_html_ = notebook.html

    @property
    def figures(self) -> list[dict[str, float | str | bool | None]]:
        """The figures of each, for `pandas.DataFrame`."""
        return [sizing.figures for sizing in self]

    @property
    def columns(self) -> list[str]:
        """The names of the figures that differ and are no errors, the most important first."""
        rows = self.figures
        names = dict.fromkeys(name for row in rows for name in row)
        differ = [n for n in names if not n.startswith("error.") and len({repr(row.get(n)) for row in rows}) > 1]
        first = ("irregularity", "flywheel.inertia", "flywheel.exact", "flywheel.approximate", "simulation.irregularity")
        return [*(name for name in first if name in differ), *(name for name in differ if name not in first)][:_MOST_COLUMNS]
