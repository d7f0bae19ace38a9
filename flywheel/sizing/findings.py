"""Figures of a sizing: one line for each, from which every output is rendered.

JSON (`as_dict`), the reference's table, columns of sweeps, the summary, the full listing and the report take the figures
of a sizing from `FINDINGS`. A new figure is a line there, and the field with its value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from flywheel.language import text as _
from flywheel.sizing.results import Sizing

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
    those of `OUTPUTS` that show the figure as a row like any other; elsewhere it stands in a row, step or table of its own.
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
    found = sizing.friction
    return None if found is None else {**found._asdict(), "constant_speed": found.constant_speed._asdict()}


def _irregularity_given(sizing: Sizing) -> float | None:
    motion = sizing.simulation
    return None if sizing.scene.inertia is None or motion is None else motion.irregularity


def _dict(name: str) -> Callable[[Sizing], Any]:
    """A record of a sizing as mappings; None without the record."""

    def value(sizing: Sizing) -> Any:
        record = getattr(sizing, name)
        return record and record.as_dict()

    return value


def _block(sizing: Sizing) -> dict[str, Any]:
    """A block whose figures have lines of their own."""
    return {}


def _block_of(name: str) -> Callable[[Sizing], dict[str, Any] | None]:
    """A block whose figures have lines of their own; None if a sizing lacks the record of that name."""
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
            column=Column("irregularity of the speed, with the flywheel that is given", "irregularity", "simulation",
                          _irregularity_given, "simulation.irregularity")),
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
            "they take nothing"),
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
    Finding("inverter.power", "W", "that the motor takes, mean over time: shaft, rotor and, if the plate has an "
            "efficiency, the other losses"),
    Finding("inverter.power_greatest", "W", "the greatest"),
    Finding("inverter.power_least", "W", "the least, below 0 if the motor returns power"),
    Finding("inverter.current", "", "greatest over the motor's rated one; null if its type gives no current"),
    Finding("inverter.trips", "", "list of causes of a trip: `kind` (overcurrent, overvoltage, chopper_power), `value`, "
            "`limit`, `angle` (rad) of the crank", lambda s: s.inverter and [trip._asdict() for trip in s.inverter.trips]),
    Finding("inverter.errors", "", "estimated errors of these: relative, but for that of the current"),
    Finding("servo", "", "a servo drive in its area of torque and speed; see below; null for other drives",
            _block_of("servo")),
    Finding("servo.mean_speed", "rad/s", "of the motor's shaft, mean over time"),
    Finding("servo.rms_torque", "N m", "of the motor's shaft, root of the mean square over time"),
    Finding("servo.continuous_torque", "N m", "of the continuous curve at that speed"),
    Finding("servo.continuous_share", "", "`rms_torque` over that"),
    Finding("servo.peak_torque", "N m", "of the motor's shaft, where it takes most of the peak curve"),
    Finding("servo.peak_speed", "rad/s", "there"),
    Finding("servo.peak_angle", "rad", "of the crank, there"),
    Finding("servo.peak_share", "", "greatest torque over the peak curve; 1 if the peak curve cuts the torque off"),
    Finding("servo.inertia_ratio", "", "mean inertia of what the rotor drives, at its shaft, over that of the rotor; null "
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
    found: dict[str, Any] = {}
    for finding in FINDINGS:
        block, _dot, name = finding.key.rpartition(".")
        figures = found[block] if block else found
        if figures is not None:
            figures[name] = finding.of(sizing)
    return found


def finding(key: str) -> Finding:
    """The line of a figure, by its key in JSON."""
    return next(one for one in FINDINGS if one.key == key)


def shown(output: str, sizing: Sizing) -> Iterator[tuple[Finding, float]]:
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
