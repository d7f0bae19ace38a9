"""Figures of a sizing, one line for each, from which every output is rendered; and their estimated errors.

JSON (`as_dict`), the reference's table, columns of sweeps, the summary, the full listing and the report take the figures
of a sizing from `FINDINGS`. A new figure is a line there, and the field with its value. The sizing gives the errors of
`Errors`; all others follow from them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from flywheel.language import text as _
from flywheel.machine.equation import moments_on
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, inertia_extent
from flywheel.sizing.motor import SPEED_STEP, drive_moment
from flywheel.sizing.results import Estimate, Sizing

KINDS = {"J": "energy", "W": "power", "N m": "torque", "N": "force", "kg m²": "inertia", "rad/s": "speed"}
"""The kinds of quantities, of which systems of customary units have scales, by their SI units."""
_HEATING = (
    *("current_rms", "current_peak", "copper_heat", "copper_heat_share"),
    *("rotor_heat", "rotor_heat_share", "stator_heat", "stator_heat_share"),
)


class Column(NamedTuple):
    """A figure as a column of sweeps: its words, its name if not the figure's key, the key of its error if not its name.

    `value` is that of the column if it is not the figure's, and `key` then its key in JSON.
    """

    about: str
    name: str = ""
    error: str = ""
    value: Callable[[Sizing], Any] | None = None
    key: str = ""


class Finding(NamedTuple):
    """A figure of a sizing, or a block of figures.

    `key` is that in JSON, with a dot before a figure of a block; `unit` is SI; `about` the text of the reference;
    `value` that of a sizing, or the path of the field if that is not the key. Figures that people read have `words`,
    marked for translation, the absolute error (SI) that limits their digits, and the `symbol` of the report. `outputs` are
    those of `OUTPUTS` that show the figure as a row like any other; elsewhere it has a separate row, step or table.
    `beside` is the note after it in the full listing if not its unit, `column` its column in sweeps.
    """

    key: str
    unit: str
    about: str
    value: str | Callable[[Sizing], Any] = ""
    words: Callable[[], str] | None = None
    error: Callable[[Sizing], float] = lambda sizing: 0.0
    symbol: str = ""
    outputs: tuple[str, ...] = ()
    beside: str = ""
    column: Column | None = None

    @property
    def name(self) -> str:
        """Name of the figure, in the language in use; the key of a figure without words."""
        return self.key if self.words is None else self.words()

    def of(self, sizing: Sizing) -> Any:
        """The value of a sizing; None if a record on the path of the field is missing."""
        if callable(self.value):
            return self.value(sizing)
        value: Any = sizing
        for name in (self.value or self.key).split("."):
            value = None if value is None else getattr(value, name)
        return value


SUMMARY, FULL, REPORT = OUTPUTS = ("summary", "full", "report")
"""The summary of `flywheel size`, its full listing, the worked report."""


def work_error(sizing: Sizing) -> float:
    """Absolute error (J) of an accumulated work."""
    exchanged = sizing.energy_fluctuation if sizing.cycle is None else sizing.cycle.exchanged
    return (sizing.error.work or 0.0) * exchanged


def _errors(sizing: Sizing) -> dict[str, Any]:
    energy, duty = sizing.energy, sizing.duty
    heating = {key: energy and energy.errors.get(key) for key in _HEATING}
    return {**sizing.errors, **heating, "duty": duty and dict(duty.errors)}


def _areas(sizing: Sizing) -> list[dict[str, Any]]:
    return [{"from": a.start, "to": a.end, "work": a.work, "accumulated": a.accumulated} for a in sizing.areas]


def _broken(sizing: Sizing) -> list[dict[str, Any]] | None:
    return None if sizing.flywheel.exact is None else [each.as_dict() for each in sizing.flywheel.broken]


def _friction(sizing: Sizing) -> dict[str, Any] | None:
    friction = sizing.friction
    return None if friction is None else {**friction._asdict(), "constant_speed": friction.constant_speed._asdict()}


def _irregularity_of_analysis(sizing: Sizing) -> float | None:
    motion = sizing.simulation
    return None if sizing.scene.inertia is None or motion is None else motion.irregularity


def _dict(name: str) -> Callable[[Sizing], Any]:
    """A record of a sizing as mappings; None without the record."""

    def value(sizing: Sizing) -> Any:
        record = getattr(sizing, name)
        return record and record.as_dict()

    return value


def _block(sizing: Sizing) -> dict[str, Any]:
    """A block whose figures have separate lines."""
    return {}


def _block_of(name: str) -> Callable[[Sizing], dict[str, Any] | None]:
    """A block whose figures have separate lines; None if a sizing lacks the record of that name."""
    return lambda sizing: None if getattr(sizing, name) is None else {}


_EXTREMES = "extremes of the accumulated work W, W(0) = 0 included"
_POWERS = "of the drive, with the exact or given flywheel"
_POWERS_ALONE = "of a motor that follows the loads without a flywheel, at constant speed"
_CURRENTS = "of an armature or a line of a motor: root of the mean square over time; greatest in size, signed"
_RATIOS = "peak over mean; null where the mean is 0"
_ANGLES = "crank angle of the greatest and the least speed, with the exact or given flywheel"

# fmt: off
FINDINGS: tuple[Finding, ...] = (
    Finding("title", "", "the scene's", "scene.title"),
    Finding("reduction", "", '`"crank"`: the shaft of reduction', lambda s: "crank"),
    Finding("cycle", "rad", "crank angle of a cycle", lambda s: None if s.scene.areas else s.scene.cycle),
    Finding("speed", "rad/s", "of the crank, mean of the extremes, as the machine runs", symbol="omega",
            column=Column("mean of the crank's greatest and least speed")),
    Finding("speed_asked", "rad/s", "the scene's, at the crank; null without one", "scene.speed"),
    Finding("irregularity", "", "required; null in an analysis", "scene.irregularity", symbol="epsilon"),
    Finding("balance", "", '`name` ("drive" or the parameter) and `value` (SI; a torque at its own shaft)',
            lambda s: s.balance and {"name": s.balance.name, "value": s.balance.value},
            column=Column("the unknown that makes the net work zero", value=lambda s: s.balance and s.balance.value,
                          key="balance.value")),
    Finding("balance_unit", "", "of that value, by its use in the scene; null if its expressions leave it undetermined"),
    Finding("power", "W", "work of the drive in a cycle, times the mean of the extreme speeds, over cycle", symbol="P_d",
            column=Column("power of the drive at the mean of the extreme speeds")),
    Finding("areas", "", "list of areas of the reduced moment: `from`, `to` (rad), `work`, `accumulated` (J, at `to`)",
            _areas),
    Finding("accumulated_max", "J", _EXTREMES, symbol="W_max", column=Column("greatest accumulated area")),
    Finding("accumulated_min", "J", _EXTREMES, symbol="W_min", column=Column("least accumulated area")),
    Finding("energy_fluctuation", "J", "their difference", "", lambda: _("energy fluctuation"), lambda s: 2 * work_error(s),
            "DeltaW", (FULL,), column=Column("fluctuation of energy")),
    Finding("coefficient_of_energy", "", "energy_fluctuation over the drive's work in a cycle", "",
            lambda: _("coefficient of energy"), lambda s: 2 * work_error(s) / abs(s.drive_work or 1.0), "k_e", (FULL,),
            "of the drive's work"),
    Finding("angle_speed_max", "rad", _ANGLES, column=Column("crank angle of the greatest speed")),
    Finding("angle_speed_min", "rad", _ANGLES, column=Column("crank angle of the least speed")),
    Finding("reduced_inertia", "kg m²", "`min`, `max`, `mean` over phi, without the flywheel", _block),
    Finding("reduced_inertia.min", "kg m²", "", lambda s: s.reduced_inertia and s.reduced_inertia.min, symbol="I_min",
            column=Column("least I* of the machine without flywheel", "reduced_inertia_least", "reduced_inertia")),
    Finding("reduced_inertia.max", "kg m²", "", lambda s: s.reduced_inertia and s.reduced_inertia.max, symbol="I_max",
            column=Column("greatest I*", "reduced_inertia_greatest", "reduced_inertia")),
    Finding("reduced_inertia.mean", "kg m²", "", lambda s: s.reduced_inertia and s.reduced_inertia.mean, symbol="I_mean",
            column=Column("mean I* over the cycle", "reduced_inertia_mean", "reduced_inertia")),
    Finding("flywheel", "kg m²", "at its own shaft; see below", _block),
    Finding("flywheel.on", "", "its shaft"),
    Finding("flywheel.inertia", "kg m²", "the given one; null when sizing"),
    Finding("flywheel.exact", "kg m²", "the smallest that keeps the irregularity or all limits, with the varying inertia of "
            "the machine (Wittenbauer)", column=Column("exact flywheel, at its own shaft", "exact")),
    Finding("flywheel.approximate", "kg m²", "from the accumulated areas alone: `approximate_total` less the machine's "
            "least inertia, at least 0",
            column=Column("approximate flywheel, without the machine's least inertia", "approximate")),
    Finding("flywheel.approximate_total", "kg m²", "energy_fluctuation / (irregularity speed²)",
            column=Column("approximate flywheel, the machine's least inertia included", "approximate_total")),
    Finding("flywheel.inertia_torque", "kg m²", "from the turning moment with the inertia torque at constant speed: a "
            "total, for small eps", column=Column("total by the inertia torque at constant speed", "inertia_torque")),
    Finding("flywheel.inertia_torque_flywheel", "kg m²", "that less the machine's least inertia, at least 0: comparable "
            "with `exact`", column=Column("the flywheel's share of that", "inertia_torque_flywheel")),
    Finding("flywheel.needed", "", "false if the machine's own inertia suffices; `exact` is then 0",
            column=Column("1 where a flywheel is needed, 0 where the machine's own inertia suffices", "needed", "-")),
    Finding("flywheel.broken", "kg m²", "heavier flywheels that break the limits: list of {`from`, `to`}, kg m², `to` "
            "null without an end; null with a given flywheel", _broken),
    Finding("flywheel.limits", "", "result for each limit of `[flywheel.limits]` (topic flywheel); null without",
            lambda s: {name: limit.as_dict() for name, limit in s.limits.items()} or None),
    Finding("flywheel.binding", "", "the limit that determines `exact`; null if none does", "binding"),
    Finding("simulation", "", "the confirmation; see below", _block_of("simulation"),
            column=Column("irregularity of the speed, with the flywheel that is given", "irregularity", "irregularity",
                          _irregularity_of_analysis, "simulation.irregularity")),
    Finding("simulation.irregularity", "", "of the motion with the exact or given flywheel"),
    Finding("simulation.irregularity_approximate", "", "with the approximate flywheel at the same mean of extremes"),
    Finding("simulation.speed_max", "rad/s", "extremes"),
    Finding("simulation.speed_min", "rad/s", "extremes"),
    Finding("simulation.speed_time_mean", "rad/s", "mean over time"),
    Finding("simulation.period", "s", "of a cycle"),
    Finding("simulation.closure", "", "speed at the end of the cycle over that at its beginning, less 1"),
    Finding("simulation.route", "", 'route: "time" (stepping), "collocation", "quadrature", or "areas"'),
    Finding("error", "", "estimated errors; see below", _errors),
    Finding("closure", "", "net work left in a cycle, as a share of the work exchanged (of areas: of the swing)"),
    Finding("energy", "", "power and energy of the drive; see below; null without a drive", _block_of("energy")),
    Finding("energy.period", "s", "of a cycle"),
    Finding("energy.work", "J", "of the drive in a cycle"),
    Finding("energy.mean_power", "W", _POWERS),
    Finding("energy.peak_power", "W", _POWERS),
    Finding("energy.mean_power_alone", "W", _POWERS_ALONE),
    Finding("energy.peak_power_alone", "W", _POWERS_ALONE),
    Finding("energy.rms_torque", "N m", "of the drive on its own shaft, root of the mean square over time"),
    Finding("energy.current_rms", "A", _CURRENTS),
    Finding("energy.current_peak", "A", _CURRENTS),
    Finding("energy.copper_heat", "W", "of a DC motor's armature, R i²; of a servo drive its losses; mean over time"),
    Finding("energy.copper_heat_share", "", "the same over that at the rated point; null without one"),
    Finding("energy.rotor_heat", "W", "of an induction motor's rotor, torque times slip speed, mean over time"),
    Finding("energy.rotor_heat_share", "", "the same over that at the rated point"),
    Finding("energy.stator_heat", "W", "of an induction motor's stator, mean copper heat over time; null without "
            "the data on the name plate"),
    Finding("energy.stator_heat_share", "", "the same over that at the rated point: the mean of (I/I_n)²; null if the "
            "magnetizing current is unknown"),
    Finding("energy.peak_to_mean", "", _RATIOS),
    Finding("energy.peak_to_mean_alone", "", _RATIOS),
    Finding("energy.energy_per_hour", "J", "energy in an hour", "energy.per_hour"),
    Finding("energy.kilowatt_hours", "kWh", "energy in an hour"),
    Finding("energy.kilocalories", "kcal", "energy in an hour"),
    Finding("engine", "", "indicated and brake work and power of an engine; see below; null without one",
            _block_of("engine")),
    Finding("engine.indicated_work", "J", "of the gas on the pistons, in a cycle"),
    Finding("engine.indicated_power", "W", "indicated work times the mean of the extreme speeds, over cycle"),
    Finding("engine.swept_volume", "m³", "of all pistons, times the working strokes of their gas in a cycle; null if a bore "
            "is unknown"),
    Finding("engine.mean_effective_pressure", "Pa", "indicated work over swept volume"),
    Finding("engine.brake_work", "J", "of all other loads and the drive (without models of losses) in a cycle; null if "
            "they take no work"),
    Finding("engine.brake_power", "W", "brake work times the mean of the extreme speeds, over cycle"),
    Finding("engine.mechanical_efficiency", "", "brake work over indicated work"),
    Finding("multiplier", "", "fraction of a small change of speed left after a cycle, below 1 if the motion is stable; "
            "null if no torque depends on speed", lambda s: s.cyclic and s.cyclic.multiplier, symbol="lamda"),
    Finding("constant_speed", "rad/s", "crank speed at which areas and approximate figures then take torques; else "
            "null",            symbol="omega_c"),
    Finding("friction", "", "of joints with friction, else null: the result at a constant crank speed; see below",
            _friction),
    Finding("duty", "", "phases of operation, and the motor's load over all of them (topic duty); null without "
            "`[[duty]]`", _dict("duty")),
    Finding("gd2", "kg m²", "GD² of the exact or given flywheel, four times its inertia",
            lambda s: None if s.inertia is None else 4.0 * s.inertia),
    Finding("shafts", "", "the same flywheel on every shaft, as built if there is a wheel; see below",
            lambda s: [row.as_dict() for row in s.shafts]),
    Finding("power_flow", "", "from the input through every mesh to the loads, with every loss; see below; null for areas",
            _dict("power_flow")),
    Finding("synchronism", "", "load angle and swing of a synchronous motor; see below; null for other drives",
            _block_of("synchronism")),
    Finding("synchronism.load_angle", "rad", "electrical, mean over time"),
    Finding("synchronism.load_angle_greatest", "rad", "over the cycle"),
    Finding("synchronism.load_angle_least", "rad", "over the cycle"),
    Finding("synchronism.pull_out_angle", "rad", "at which the torque of the load angle is greatest"),
    Finding("synchronism.pull_out_share", "", "greatest torque of the load angle in the cycle, over the pull-out torque"),
    Finding("synchronism.natural_frequency", "Hz", "of small swings about the mean load angle"),
    Finding("synchronism.damping_ratio", "", "of them, by the damper winding alone"),
    Finding("synchronism.harmonics", "", "list of `order`, `frequency` (Hz), `moment` (N m), free `swing` (rad/s), "
            "`magnification` by the motor", lambda s: s.synchronism and [one._asdict() for one in s.synchronism.harmonics]),
    Finding("synchronism.errors", "", "estimated errors of these: of angles in rad, of the others relative"),
    Finding("inverter", "", "the load of a motor's inverter; see below; null for other drives", _block_of("inverter")),
    Finding("inverter.power", "W", "into the motor, mean over time: shaft, rotor and, if the plate has an "
            "efficiency, the other losses"),
    Finding("inverter.power_greatest", "W", "the greatest"),
    Finding("inverter.power_least", "W", "the least, below 0 if the motor returns power"),
    Finding("inverter.current", "", "greatest over the motor's rated one; null if its type gives no current"),
    Finding("inverter.trips", "", "list of causes of a trip: `kind` (overcurrent, overvoltage, chopper_power), `value`, "
            "`limit`, `angle` (rad) of the crank", lambda s: s.inverter and [trip._asdict() for trip in s.inverter.trips]),
    Finding("inverter.errors", "", "estimated errors of these: relative, except for the current's"),
    Finding("servo", "", "a servo drive in its area of torque and speed; see below; null for other drives",
            _block_of("servo")),
    Finding("servo.mean_speed", "rad/s", "of the motor's shaft, mean over time"),
    Finding("servo.rms_torque", "N m", "of the motor's shaft, root of the mean square over time"),
    Finding("servo.continuous_torque", "N m", "of the continuous curve at that speed"),
    Finding("servo.continuous_share", "", "`rms_torque` over that"),
    Finding("servo.peak_torque", "N m", "of the motor's shaft, where it is the largest share of the peak curve"),
    Finding("servo.peak_speed", "rad/s", "there"),
    Finding("servo.peak_angle", "rad", "of the crank, there"),
    Finding("servo.peak_share", "", "greatest torque over the peak curve; 1 if the peak curve limits the torque"),
    Finding("servo.inertia_ratio", "", "mean inertia of the driven parts, at the rotor's shaft, over the rotor's; null "
            "without `inertia` of the motor"),
    Finding("servo.errors", "", "estimated errors of these: relative, of shares and the angle absolute"),
    Finding("temperature", "K", "of the motor's windings: see below; null without `thermal`", _dict("temperature")),
    Finding("electrical_transients", "", "an induction motor with two axes and its static curve; see below; null for "
            "other drives", _dict("electrical_transients")),
    Finding("wheel", "", "dimensions, stresses, `irregularity` with it (topic wheel); null without a `shape`",
            _dict("built")),
    Finding("proven_bounds", "kg m²", "two proven bounds of the exact inertia, which follow from the approximate one",
            lambda s: s.flywheel.proven_bounds and list(s.flywheel.proven_bounds)),
    Finding("proven_bounds_torque", "kg m²", "two more, which follow from the inertia torque",
            lambda s: s.flywheel.proven_bounds_torque and list(s.flywheel.proven_bounds_torque)),
    Finding("rtol", "", "required relative error"),
    Finding("reached", "", "true if every estimate is within rtol"),
    Finding("messages", "", "remarks for the user", lambda s: list(s.messages)),
    Finding("accuracy", "", "the level of accuracy: normal, confirm, audit or proof (topic accuracy)"),
    Finding("left_out", "", "omissions at that level: a list of sentences",
            lambda s: list(s.left_out)),
    Finding("bounds", "", "null: no level leaves the exact figure out", lambda s: None),
    Finding("proof", "", "proven intervals of figures, at accuracy proof; see below; null at other levels",
            lambda s: s.proof and {**s.proof._asdict(), "figures": {k: [*v] for k, v in s.proof.figures.items()}}),
    Finding("cost", "", "cost of the calculation; see below", _dict("cost")),
)
# fmt: on


def as_dict(sizing: Sizing) -> dict[str, Any]:
    """The JSON contract of `flywheel size`, SI throughout."""
    contract: dict[str, Any] = {}
    for finding in FINDINGS:
        block, _dot, name = finding.key.rpartition(".")
        figures = contract[block] if block else contract
        if figures is not None:
            figures[name] = finding.of(sizing)
    return contract


def finding(key: str) -> Finding:
    """The line of a figure, by its key in JSON."""
    return next(one for one in FINDINGS if one.key == key)


def rows_of(output: str, sizing: Sizing) -> Iterator[tuple[Finding, float]]:
    """The figures of a sizing shown as ordinary rows, with their values."""
    for one in FINDINGS:
        if output in one.outputs and (value := one.of(sizing)) is not None:
            yield one, float(value)


def reference(block: str = "") -> list[str]:
    """The rows of the reference's table of results, or of one of its blocks; figures that share their words share a row.

    A block whose own line has the unit of its figures leaves the units out.
    """
    rows: dict[tuple[str, str], list[str]] = {}
    for one in FINDINGS:
        of, _dot, name = one.key.rpartition(".")
        if of == block and one.about:
            rows.setdefault((one.about, one.unit), []).append(f"`{name}`")
    if block and finding(block).unit:
        return [f"| {', '.join(names)} | {about} |" for (about, _unit), names in rows.items()]
    return [f"| {', '.join(names)} | {unit}{' ' * bool(unit)}| {about} |" for (about, unit), names in rows.items()]


_READ = 4 * ROUNDING  # of a figure that is the scene's own, or a product of a few such


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def estimates(sizing: Sizing) -> dict[str, Estimate]:
    """Estimated errors by the key of the figure or of the block of figures; None for a missing figure.

    They are relative to the larger of the figure and its scale; those of angles are in rad. Scales: energy_fluctuation over
    eps w² for inertias of flywheels, the work exchanged for works, the greatest I* for the reduced inertia, 1 for the
    irregularity of a motion that does not vary; in `energy` the work exchanged as a power or a torque. Errors of power,
    balance and coefficient of energy are relative to the figure itself, unless that is no more than its error.
    """
    error, cycle, scene, cyclic = sizing.error, sizing.cycle, sizing.scene, sizing.cyclic
    constant = sizing.constant or cycle  # the one of the areas
    of_drive, speed = _drive_errors(sizing), speed_error(sizing)
    exact = _READ if scene.inertia is not None else error.exact
    of_shafts = None if exact is None or speed is None else exact + 2 * speed + _READ
    own = _figure_errors(sizing, of_drive)
    errors: dict[str, Estimate] = {
        **own,
        "areas": {
            "from": error.angles,
            "to": error.angles,
            "work": own["energy_fluctuation"],
            "accumulated": own["accumulated_max"],
        },
        "closure": error.work,
        "energy": _energy_error(sizing, of_drive),
        "engine": None,
        "limits": {name: _known(max(each.reached_error, each.alone_error)) for name, each in sizing.limits.items()} or None,
        "broken": max((max(each.start_error, each.end_error) for each in sizing.flywheel.broken), default=None),
        "multiplier": _multiplier_error(sizing),
        "constant_speed": None if cyclic is None else _READ + (0.0 if scene.unknown else cyclic.constant_speed_error),
        "gd2": None if sizing.inertia is None else exact,
        "shafts": of_shafts if sizing.shafts else None,
        "power_flow": None if sizing.power_flow is None else sizing.power_flow.error,
        "wheel": None if sizing.built is None or of_shafts is None else _wheel_error(sizing, of_shafts),
        **_bounds_errors(sizing, constant),
    }
    if cycle is not None and sizing.engine is not None and speed is not None:
        errors["engine"] = sizing.engine.error / max(cycle.exchanged, 1e-300) + speed + _READ
    return {key: _known(value) for key, value in errors.items()}


def _known(error: Any) -> Any:
    """An error, or None: beyond the floating-point range nothing is known of it."""
    return None if isinstance(error, float) and not np.isfinite(error) else error


@np.errstate(all="ignore")
def figure_errors(sizing: Sizing) -> dict[str, float | None]:
    """The errors of `estimates` that follow from the sizing alone; for many sizings."""
    return _figure_errors(sizing, _drive_errors(sizing))


def _figure_errors(sizing: Sizing, of_drive: tuple[float, float] | None) -> dict[str, float | None]:
    error, cycle = sizing.error, sizing.cycle
    constant = sizing.constant or cycle
    work, speed = error.work, speed_error(sizing)
    residue = 0.0 if sizing.constant is None else abs(sizing.constant.net) / max(sizing.constant.exchanged, 1e-300)
    areas = None if work is None else work + 2 * residue
    errors: dict[str, float | None] = {
        **error._asdict(),
        "simulation": None if error.simulation is None else max(error.simulation, error.period or 0.0),
        "irregularity": error.simulation,
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
        return errors
    balance, exchanged = sizing.balance, max(cycle.exchanged, 1e-300)
    if balance is not None:
        errors["balance"] = balance.error + _READ if balance.value else cycle.errors.net / exchanged
    if of_drive is not None:
        relative = _relative(of_drive[0], sizing.drive_work or 0.0, cycle.exchanged)
        errors["power"] = None if speed is None else relative + speed + _READ
        if sizing.coefficient_of_energy is not None:
            own = (work or 0.0) * constant.exchanged
            relative = _relative(of_drive[0], sizing.drive_work or 0.0, constant.exchanged)
            errors["coefficient_of_energy"] = _relative(own, sizing.energy_fluctuation, constant.exchanged) + relative
    return errors


def speed_error(sizing: Sizing) -> float | None:
    """Relative error of the mean of extremes."""
    if sizing.constant is None or sizing.scene.unknown is not None:
        setting = sizing.scene.speed
        return _READ + (0.0 if setting is None else abs(sizing.speed / setting - 1.0))
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


def _drive_errors(sizing: Sizing) -> tuple[float, float] | None:
    """Absolute errors of the drive: of its work in a cycle (J), of its moment on the crank anywhere (N m).

    None without a drive or a cycle.
    """
    cycle, machine = sizing.cycle, sizing.machine
    if cycle is None or machine is None or machine.scene.drive is None or sizing.drive_work is None:
        return None
    law, span = machine.scene.drive.law, machine.scene.cycle
    residual = cycle.errors.residual + (0.0 if machine.friction is None else 2 * machine.friction.error)
    if law is None:
        own = (sizing.balance.error if sizing.balance else 0.0) * abs(sizing.drive_work) + cycle.errors.net + residual
        return own, own / span
    if isinstance(law, float | int):
        own = _READ * abs(sizing.drive_work) + residual
        return own, own / span
    moment = drive_moment(machine, cycle, sizing.run, sizing.speed)
    by_speed = np.zeros_like(moment)  # what the error of the speed moves it by
    if sizing.cyclic is not None and sizing.run is not None:
        moments, omega = moments_on(machine, cycle.mesh.edges, local=True), _speed(sizing, cycle)
        here, beside = (
            moments.drive(w, cycle.balance or 0.0, moments.steady_states(w)) for w in (omega, omega * (1.0 + SPEED_STEP))
        )
        by_speed = np.abs(beside - here) / SPEED_STEP * speed_error_over_cycle(sizing)
    tails = cells.tails(cells.fit(moment)) + by_speed.max(axis=-1)
    work = float((cells.TAIL_OF_INTEGRAL * tails * cycle.mesh.half[:, 0]).sum()) + cycle.errors.net + residual
    work += float(cells.integral(by_speed, cycle.mesh.half).sum())
    rounding = 24 * ROUNDING * float(np.abs(moment).max())
    return work, float(tails.max()) + (cycle.errors.work + residual) / span + rounding


def _inertia_error(cycle: Cycle) -> tuple[float, float]:
    """Error of the least, greatest and mean I*: in kg m², and relative to the greatest."""
    errors, extent = cycle.errors, inertia_extent(cycle)
    by_slope = errors.variation + errors.start  # as `wittenbauer.reduced_inertia` has them
    own = (extent.error, extent.greatest_error)
    mean = cells.TAIL_OF_INTEGRAL * float(errors.inertias @ cycle.mesh.half[:, 0]) / float(cycle.mesh.edges[-1])
    mean += 32 * ROUNDING * extent.greatest
    error = max(mean, *(by_slope if errors.variation <= error else error for error in own))
    return error, error / extent.greatest if extent.greatest > 0.0 else 0.0


def _energy_error(sizing: Sizing, of_drive: tuple[float, float] | None) -> float | None:
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
    works = (of_drive[0] + cycle.errors.net) / exchanged
    return ratio * works + (of_drive[1] + between) / torque + period + 2 * speed_error_over_cycle(sizing) + _READ


def _multiplier_error(sizing: Sizing) -> float | None:
    """Error of exp(integral of dF/dE), relative to the larger of it and 1, by errors of speed and flywheel and the cells."""
    cyclic, cycle, run, machine = sizing.cyclic, sizing.cycle, sizing.run, sizing.machine
    if cyclic is None or cycle is None or run is None or machine is None:
        return None
    moments, omega = moments_on(machine, cycle.mesh.edges), _speed(sizing, cycle)

    def growth(w: Array) -> Array:
        """dF/dE (1/rad) at speeds w."""
        states = moments.steady_states(w)
        slope = moments.rate(w, cycle.balance or 0.0, run.inertia, states).by_speed
        if moments.circuit is not None:  # its states follow the speed
            further = moments.drive(w * (1.0 + SPEED_STEP), 0.0, moments.steady_states(w * (1.0 + SPEED_STEP)))
            slope = slope + (further - moments.drive(w, 0.0, states)) / (SPEED_STEP * w)
        return np.asarray(slope / ((run.inertia + moments.inertia) * w))

    here = growth(omega)
    moved = np.abs(growth(omega * (1.0 + SPEED_STEP)) - here) / SPEED_STEP * speed_error_over_cycle(sizing)
    own = 24 * ROUNDING + (sizing.error.exact or 0.0)
    exponent = float(cells.integral(np.abs(here) * own + moved, cycle.mesh.half).sum())
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
