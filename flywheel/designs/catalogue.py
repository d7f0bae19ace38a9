"""The suitable motors of a table for a machine, each with the flywheel that it needs, by total price.

Every motor replaces the scene's drive. One that cannot start the machine from rest, that stalls, that exceeds its limits
with any flywheel, or that overheats during its start with that flywheel, is listed with the reason. It must keep the scene's
irregularity or its `[flywheel.limits]`; if these have no limit of the motor, its heat and the root mean square of its torque
stay within the rated point. The flywheel is the smallest that keeps all of that. It may have bounds and a price; the order
is by the price of motor and flywheel together.

A start is followed through the motor's torque map (`flywheel.motions.starting`), which takes a few hundredths of a second;
that of the first motor in the order, and those without a map, are followed in time.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.motors import Motor
from flywheel.components.motors.starting import as_started
from flywheel.designs.figures import each_of
from flywheel.machine.dynamics import dynamics_of
from flywheel.machine.machine import Machine
from flywheel.motions.motion import Transient
from flywheel.motions.starting import RunUp, load_at_rest, mapped_run_up, maps, torque_at_rest
from flywheel.motions.transients import Until, transient
from flywheel.numerics.cells import TIE
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import QuantityError, figure, parse_quantity, parse_range
from flywheel.reading.catalogue import Catalogue, CatalogueMotor, read_catalogue
from flywheel.reading.motors import MOTORS
from flywheel.regime.free_motion import neighbours
from flywheel.regime.turning_moment import refuse_strokes
from flywheel.scene.scene import TURN, Scene
from flywheel.sizing.motor import MotorShaft, of_motor, shares
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

ADJUSTED, FIXED = "adjusted", "fixed"
RATIOS = (ADJUSTED, FIXED)
RATED = {"motor_heat": 1.0, "motor_rms": 1.0}
"""Limits of a motor if the scene has none: those of its rated point."""
WORST = "worst"
"""The crank angle with the greatest load at rest."""
IN_TIME, MAPPED = "time", "map"
"""Method of a start."""
WHEEL = {"inertia": "kg m^2", "mass": "kg", "diameter": "m"}
"""Quantities of a wheel for bounds and prices, with units."""
UP_TO_SPEED = 0.98
"""Share of the steady mean speed at which a start is over, where the rated speed is not come to before."""
_MOST_TURNS = 200  # of the crank in a start that is followed in time, too
_TOLERANCE = 1e-6  # of a start in time
_NEAR_BOUND = 0.02  # share by which a start may miss a bound and its map does not decide
_IN_STEP = 0.02  # share by which the speed of a synchronous rotor may swing that has come into step
_PLACES = np.linspace(0.0, 1.0, 34)[1:-1]  # of a piece of the cycle, where the load at rest is looked at
_NO_START = ("cannot start the machine", "does not get the machine through its start")
_MOST_NAMED = 4  # motors that a note names
_BEST = re.compile(r"at best, (?P<where>.*), it is (?P<share>[-+.\de]+)")
_WORDS = {
    "motor_heat": "too much heat",
    "motor_rms": "too much torque (root mean square)",
    "motor_torque": "too much torque",
    "current_pulsation": "too much current pulsation",
    "irregularity": "not even enough",
}


class StartOfMotor(NamedTuple):
    """A motor's start with rotor and flywheel, from rest up to its rated speed, or `UP_TO_SPEED` of the steady one if less.

    That of a synchronous motor lasts until its speed has settled, in step.

    `time` (s), `turns` of the crank; `current_squared`, the integral of (I/I_n)² dt of the windings (s), None if table or
    type do not give the current; `allowed`, the permissible value for the warm motor by its locked-rotor time (s; for the
    cold one if only that is known), None without one; `share`, the ratio of the two. `route` is the method: in "time", or
    through the torque "map".
    """

    time: float
    turns: float
    current_squared: float | None
    allowed: float | None
    route: str

    @property
    def share(self) -> float | None:
        """Load of the start over the motor's limit."""
        return None if self.current_squared is None or self.allowed is None else self.current_squared / self.allowed


class MotorChoice(NamedTuple):
    """A motor of the table in the machine: `suits` is True, False with the `reason`, or None if undecided.

    `ratio` is the speed of its shaft over the crank's; `flywheel` (kg m² at its own shaft) with its relative error, None if
    there is none; `speed` (rad/s, of the crank), `irregularity`; `heat_share` and `rms_torque_share` over the rated point;
    `load_share`, the mean power over the rated one; `binding`, the limit that decides the flywheel.

    `starting_torque` is the motor's at rest, `load_at_start` the load at rest (N m, on the motor's shaft);
    `hardest_start` the crank angle (rad) of the greatest load at rest, `hardest_load` that load; `start` the start itself.
    `wheel_inertia` is that of the wheel as built, or the flywheel's (kg m²); `wheel_mass` (kg) and `wheel_diameter` (m) are
    known if the scene has a wheel's shape; `wheel_price` and `total_price` are in the table's currency.
    """

    motor: CatalogueMotor
    suits: bool | None
    reason: str = ""
    ratio: float | None = None
    flywheel: float | None = None
    error: float | None = None
    speed: float | None = None
    irregularity: float | None = None
    heat_share: float | None = None
    rms_torque_share: float | None = None
    load_share: float | None = None
    binding: str | None = None
    starting_torque: float | None = None
    load_at_start: float | None = None
    hardest_start: float | None = None
    hardest_load: float | None = None
    start: StartOfMotor | None = None
    wheel_inertia: float | None = None
    wheel_mass: float | None = None
    wheel_diameter: float | None = None
    wheel_price: float | None = None
    total_price: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """The row for JSON, SI: data of the table, and results."""
        row, rated, start = self.motor, self.motor.motor.rated, self.start
        own = {
            "name": row.name,
            "line": row.line,
            "price": row.price,
            "currency": row.currency or None,
            "power": None if rated is None else rated.power,
            "rated_speed": None if rated is None else rated.speed,
            "inertia": row.motor.inertia,
        }
        values = {name: value for name, value in self._asdict().items() if name not in ("motor", "start")}
        names = (*StartOfMotor._fields, "share")
        return own | values | {f"start_{name}": None if start is None else getattr(start, name) for name in names}

    @property
    def starts_anywhere(self) -> bool:
        """True if the motor starts the machine from every crank angle."""
        certain = self.starting_torque is not None and self.hardest_load is not None
        return certain and self.starting_torque > self.hardest_load  # type: ignore[operator]


class Terms(NamedTuple):
    """Requirements of the start and the flywheel: crank angle (rad) or "worst", longest start (s), bounds, prices."""

    at: float | str
    start_time: float | None
    wheel_limits: Mapping[str, float]
    wheel_prices: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class SuitableMotors:
    """The motors of a table for a machine: the suitable ones by total price, then the others in the table's order.

    `on` is the flywheel's shaft; `ratio` "adjusted" where that of the motor's shaft was chosen for each, so that the crank
    turns at `crank_speed` (rad/s) at the motor's rated point, or "fixed". Those of `refused` whose `suits` is None are
    undecided: no steady motion was found with them. `missing` counts the motors that an interruption left out, `skipped` are
    the faults of rows that were left out.
    """

    scene: Scene
    suitable: tuple[MotorChoice, ...]
    refused: tuple[MotorChoice, ...]
    ratio: str
    crank_speed: float | None
    notes: tuple[str, ...] = ()
    skipped: tuple[Fault, ...] = ()
    missing: int = 0

    def __repr__(self) -> str:
        """Number of suitable motors, and the cheapest."""
        first = f", first {self.suitable[0].motor.name!r}" if self.suitable else ""
        return f"SuitableMotors({len(self.suitable)} of {len(self.suitable) + len(self.refused)}{first})"

    @property
    def on(self) -> str:
        """The flywheel's shaft."""
        return self.scene.flywheel_on

    def as_dict(self) -> dict[str, Any]:
        """All results for JSON, SI."""
        return {
            "title": self.scene.title,
            "on": self.on,
            "ratio": self.ratio,
            "crank_speed": self.crank_speed,
            "motors": [choice.as_dict() for choice in (*self.suitable, *self.refused)],
            "skipped": [str(fault) for fault in self.skipped],
            "missing": self.missing,
            "notes": list(self.notes),
        }


def suitable_motors(
    scene: Scene,
    catalogue: Catalogue | str | Path,
    *,
    ratio: str | None = None,
    at: float | str = 0.0,
    start_time: float | None = None,
    wheel_limits: Mapping[str, float] | None = None,
    wheel_prices: Mapping[str, float] | None = None,
    rtol: float | None = None,
    skip_faulty: bool = False,
    jobs: int = 1,
    progress: bool | None = False,
) -> SuitableMotors:
    """Finds the suitable motors of a table for a machine, with the flywheel that each needs and its start.

    Args:
        scene: with a [drive], whose motor or torque the motors replace, and a flywheel with requirements or given.
            The start of its motor applies to theirs, too.
        catalogue: a table that was read, or its file.
        ratio: "adjusted": the ratio of the motor's shaft is chosen for each motor such that the crank turns at the scene's
            speed at the motor's rated point (without a speed, at that of the scene's own motor); "fixed": it is the
            scene's. If None adjusted if the motor has its own shaft and that speed is known.
        at: crank angle (rad) from which the machine is started, or "worst": the one with the greatest load at rest.
        start_time: longest time that a start may take, s; any if None.
        wheel_limits: greatest "inertia" (kg m², on its own shaft), "mass" (kg) and "diameter" (m) of the flywheel; the last
            two only if the scene has a wheel's `shape`.
        wheel_prices: price of the flywheel in the table's currency, for each kg m² of its inertia, kg of its mass and m of
            its diameter, by the same names.
        rtol: required relative error of each flywheel; the scene's own if None.
        skip_faulty: true to leave faulty rows out.
        jobs: number of worker processes; with 1 the motors are examined in this process.
        progress: true to show a bar on standard error; default: if that is a terminal.

    Raises:
        SceneError: for faults of the table, and a scene without a drive or a flywheel.

    """
    refuse_strokes(scene)
    if not isinstance(catalogue, Catalogue):
        catalogue = read_catalogue(catalogue, skip_faulty=skip_faulty)
    terms = Terms(at, start_time, dict(wheel_limits or {}), dict(wheel_prices or {}))
    # the crank's speed (rad/s) for the choice of ratios: the scene's, or that of its motor's rated point
    if scene.speed is not None or scene.drive is None:
        crank = scene.speed
    else:
        rated = None if scene.motor is None else scene.motor.rated
        crank = None if rated is None else rated.speed / scene.shafts[scene.drive.on]
    ratio = _checked(scene, ratio, crank, terms)
    adjusted = crank if ratio == ADJUSTED else None
    choice_of = partial(_choice, scene, adjusted, terms, rtol)
    choices = each_of(choice_of, catalogue.motors, jobs, progress, "motors")
    ordered = sorted((choice for choice in choices if choice.suits), key=_cheapest)
    suitable, failed = ordered, dict[str, MotorChoice]()
    with suppress(KeyboardInterrupt):
        suitable, failed = _confirmed(scene, ordered, adjusted, terms)
    refused = [failed.get(choice.motor.name, choice) for choice in choices]
    return SuitableMotors(
        scene=scene,
        suitable=tuple(suitable),
        refused=tuple(choice for choice in refused if not choice.suits),
        ratio=ratio,
        crank_speed=adjusted,
        notes=(*_notes(scene, catalogue, ratio, crank), *_start_notes(suitable, refused, terms)),
        skipped=catalogue.faults,
        missing=len(catalogue.motors) - len(choices),
    )


def _cheapest(choice: MotorChoice) -> tuple[float, float, float]:
    """The key of the order: by total price, motors without a price last; then by power and inertia."""
    row = choice.motor
    power = 0.0 if row.motor.rated is None else row.motor.rated.power
    return inf if choice.total_price is None else choice.total_price, power, row.motor.inertia


def _checked(scene: Scene, ratio: str | None, crank: float | None, terms: Terms) -> str:
    """Treatment of ratios; SceneError for a scene without a choice of motors."""
    faults = []
    if scene.drive is None:
        faults.append(Fault("drive", "nothing", 'where the motor sits, such as [drive] on = "motor", torque = "balance"'))
    if scene.areas is not None or scene.stroke is not None or not scene.has_flywheel:
        faults.append(Fault("flywheel", "no flywheel that is asked for or given", "a table with irregularity or limits"))
    if scene.unknown not in (None, "drive"):
        advice = "give it a value: a motor decides its own torque"
        faults.append(Fault(f"parameters.{scene.unknown}", '"balance"', "a value, when there is a motor", advice))
    if ratio not in (None, *RATIOS):
        faults.append(Fault("ratio", f'"{ratio}"', '"adjusted" or "fixed"'))
    own = scene.drive is not None and scene.drive.on != "crank"
    if ratio == ADJUSTED and not own:
        faults.append(
            Fault("ratio", '"adjusted", with a drive on the crank', "a shaft of the motor's own", "name it in [drive] on")
        )
    elif ratio == ADJUSTED and crank is None:
        faults.append(Fault("regime.speed", "nothing", "the crank's speed, for which a ratio is chosen"))
    faults += _faults_of(terms, scene)
    if faults:
        raise SceneError(faults)
    return ratio or (ADJUSTED if own and crank is not None else FIXED)


def _faults_of(terms: Terms, scene: Scene) -> Iterator[Fault]:
    """Faults of bounds, prices and the angle of the start."""
    if isinstance(terms.at, str) and terms.at != WORST:
        yield Fault("at", f'"{terms.at}"', f'an angle or "{WORST}"')
    if terms.start_time is not None and not 0.0 < terms.start_time < inf:
        yield Fault("start_time", f"{terms.start_time:g} s", "a time above 0")
    for name, numbers in (("wheel_limits", terms.wheel_limits), ("wheel_prices", terms.wheel_prices)):
        for what, value in numbers.items():
            if what not in WHEEL:
                yield Fault(name, f'"{what}"', " or ".join(f'"{each}"' for each in WHEEL))
            elif not 0.0 <= value < inf:
                yield Fault(f"{name}.{what}", f"{value:g}", "a number, at least 0")
            elif what != "inertia" and scene.wheel is None:
                yield Fault("flywheel.shape", "nothing", f"the shape of a wheel, of which the {what} is asked for")


def _notes(scene: Scene, catalogue: Catalogue, ratio: str, crank: float | None) -> Iterator[str]:
    """Notes on the assumptions made."""
    assert scene.drive is not None
    if ratio == ADJUSTED and crank is not None:
        rpm = figure(crank * 30 / np.pi, most=5)
        yield f"the ratio of {scene.drive.on} is chosen for each motor: at its rated point the crank turns at {rpm} rpm"
    elif scene.drive.on != "crank":
        yield f"the ratio of {scene.drive.on} is the scene's for every motor: each sets its own speed of the crank"
    if scene.motor is not None and scene.motor.start is not None and scene.motor.inverter is None:
        own = "switched at the same share of its rated speed" if scene.motor.rated is not None else "as the scene's"
        yield f"each motor that can be is started as the scene's own ({scene.motor.start.title}), {own}"
    if scene.motor is not None and scene.motor.inverter is not None and scene.motor.peak(0.0) is None:
        yield f"each motor that may have one is on the scene's inverter, at {scene.motor.inverter.frequency:g} Hz"
    if not of_motor(scene):
        yield "each motor stays within its rated heat and rms torque, as the scene limits none of them"
    if scene.mechanisms and any(m.shaft == scene.drive.on and m.shaft != "crank" for m in scene.mechanisms):
        yield f"mechanisms on {scene.drive.on} turn with the motor"
    if catalogue.unused:
        yield f"columns that do not apply here: {', '.join(catalogue.unused)}"


# -- one motor ---------------------------------------------------------------------------------------------------------


def with_motor(scene: Scene, motor: CatalogueMotor, crank_speed: float | None = None) -> Scene:
    """The scene with a motor of a table in place of its drive.

    Args:
        scene: one that was read, with a drive.
        motor: the row.
        crank_speed: at which the crank turns at the motor's rated point (rad/s), for which the ratio of its shaft is
            chosen; None to keep that.

    """
    assert scene.drive is not None
    assert scene.document is not None
    tables, on = scene.document.tables, scene.drive.on
    changes: dict[str, Any] = {f"drive.{key}": None for key in ("torque", "motor") if key in tables["drive"]}
    changes["drive.motor"] = {**motor.table, **_inverter_of(scene, motor), **_start_of(scene, motor)}
    if crank_speed is not None:
        kind: Motor = motor.motor
        if "inverter" in changes["drive.motor"]:  # whose frequency sets the speed
            kind = scene.with_(changes).motor or kind
        rated = kind.rated
        if rated is None:
            advice = "give it speed with torque or power, or take --ratio fixed"
            expected = "one, for which the ratio of its shaft is chosen"
            raise SceneError([Fault(f"shafts.{on}.ratio", f"a {motor.motor.title} without a rated point", expected, advice)])
        own = parse_range(tables["shafts"][on]["ratio"], "number")
        speed = rated.speed if kind.peak(0.0) is None else kind.no_load_speed or rated.speed  # of a servo, that it holds
        changes[f"shafts.{on}.ratio"] = own * speed / crank_speed / scene.shafts[on]
    return scene.with_(changes)


def _inverter_of(scene: Scene, row: CatalogueMotor) -> dict[str, Any]:
    """Inverter of a motor of the table: the scene's own, where its type may have one."""
    assert scene.document is not None
    motor = scene.document.tables["drive"].get("motor")
    table = motor.get("inverter") if isinstance(motor, Mapping) else None
    if not isinstance(table, Mapping) or (row.motor.circuit is not None and not row.motor.keeps_step):
        return {}
    kind = str(row.table.get("type", "induction"))
    return {"inverter": dict(table)} if "inverter" in {key.name for key in MOTORS[kind].keys} else {}


def _start_of(scene: Scene, row: CatalogueMotor) -> dict[str, Any]:
    """Start of a motor of the table: as the scene's own, with switches at the same shares of the rated speed."""
    assert scene.document is not None
    motor = scene.document.tables["drive"].get("motor")
    start = motor.get("start") if isinstance(motor, Mapping) else None
    if scene.motor is None or not isinstance(start, Mapping):
        return {}
    if str(start["type"]) not in row.motor.starts or row.motor.circuit is not None:
        return {}
    before, now = scene.motor.rated, row.motor.rated
    factor = 1.0 if before is None or now is None else now.speed / before.speed

    def switch(until: Any) -> Any:
        try:
            return f"{factor * parse_quantity(until, 'speed')!r} rad/s"
        except QuantityError:
            return until

    untils = start.get("until")
    if untils is None:
        return {"start": dict(start)}
    return {"start": {**start, "until": [*map(switch, untils)] if isinstance(untils, list) else switch(untils)}}


def _choice(scene: Scene, crank: float | None, terms: Terms, rtol: float | None, row: CatalogueMotor) -> MotorChoice:
    """Result for a machine with a motor of the table."""
    try:
        machine = Machine(with_motor(scene, row, crank))
    except SceneError as error:
        return MotorChoice(row, False, "; ".join(map(str, error.faults[:2])))
    choice = MotorChoice(row, None, ratio=_ratio(machine.scene))
    try:
        choice = _at_rest(choice, machine, terms)
        if choice.reason:
            return choice
        sizing = _sized(machine, rtol)
    except SceneError as error:
        reasons = [_reason(fault) for fault in error.faults]
        decided = [reason for reason, certain in reasons if certain]
        return choice._replace(suits=False if decided else None, reason="; ".join(decided[:2]) or reasons[0][0])
    choice = _figures(choice, sizing, terms)
    if reason := _beyond(choice, sizing, terms):
        return choice._replace(suits=False, reason=reason)
    motor = machine.scene.motor
    assert motor is not None
    if not maps(motor) or motor.keeps_step:
        return _in_time(choice, machine, terms)
    inertia = _wheel_inertia(sizing) * machine.scene.flywheel_ratio**2
    at = _place(choice, terms)
    rough = sizing.machine if machine.has_joint_friction and sizing.machine is not None else machine
    with np.errstate(all="ignore"):
        run = mapped_run_up(rough, inertia, at, _full_speed(motor, choice))
    if not run.reached:
        return choice._replace(suits=None if run.reached is None else False, reason=_short_of_it(run, choice))
    limit = motor.locked_rotor_limit() or motor.locked_rotor_limit(cold=True)
    start = StartOfMotor(run.time, run.turns, run.current_squared, limit, MAPPED)
    choice = choice._replace(start=start)
    shares = start.share, None if terms.start_time is None else start.time / terms.start_time
    close = any(share is not None and abs(share - 1.0) < _NEAR_BOUND for share in shares)
    timed = _in_time(choice, machine, terms) if close and start.turns <= _MOST_TURNS else choice
    return _judged(choice, terms) if timed.start is start else timed


def _ratio(scene: Scene) -> float:
    assert scene.drive is not None
    return scene.shafts[scene.drive.on]


# -- its start ---------------------------------------------------------------------------------------------------------


def starting_torque(motor: Motor) -> float:
    """A motor's greatest torque at rest (N m), with its start: from its plate if given, else from its curve."""
    return torque_at_rest(motor)


def _at_rest(choice: MotorChoice, machine: Machine, terms: Terms) -> MotorChoice:
    """Choice with the check of the breakaway from rest, and of the angle with the greatest load."""
    motor, edges = machine.scene.motor, machine.restarts
    assert motor is not None
    around = np.concatenate([(edges[:-1, None] + np.diff(edges)[:, None] * _PLACES).ravel(), edges[:-1]])
    with np.errstate(all="ignore"):
        loads = load_at_rest(machine, around)
        worst = int(np.nanargmax(loads))
        at = float(around[worst]) if isinstance(terms.at, str) else terms.at % machine.scene.cycle
        load = float(loads[worst] if isinstance(terms.at, str) else load_at_rest(machine, np.array([at]))[0])
    torque = starting_torque(motor)
    choice = choice._replace(
        starting_torque=torque, load_at_start=load, hardest_start=float(around[worst]), hardest_load=float(loads[worst])
    )
    angle = figure(np.degrees(at), most=4)
    reason = f"starting torque {figure(torque, most=4)} N m, the load at rest at {angle} deg is {figure(load, most=4)} N m"
    reason = f"{_NO_START[0]}: {reason} on its shaft"
    if torque > load and machine.has_joint_friction and not _breaks_away(machine, at):
        reason += ", and friction in its joints holds it"
    elif torque > load:
        return choice
    return choice._replace(suits=False, reason=reason)


def _breaks_away(machine: Machine, at: float) -> bool:
    """Tests whether a machine with friction in its joints moves forwards from rest at a crank angle (rad)."""
    dynamics = dynamics_of(machine, 0.0)
    states = () if dynamics.circuit is None else dynamics.circuit.steady(0.0)
    with np.errstate(all="ignore"):
        return bool(dynamics.from_rest(at, *neighbours(machine, at), np.zeros(1), states)[0][0] > 0.0)


def _place(choice: MotorChoice, terms: Terms) -> float:
    """The crank angle (rad) of the start."""
    assert choice.hardest_start is not None
    return choice.hardest_start if isinstance(terms.at, str) else terms.at


def _full_speed(motor: Motor, choice: MotorChoice) -> float:
    """The crank's speed (rad/s) at the end of a start."""
    assert choice.speed is not None
    assert choice.ratio is not None
    steady = UP_TO_SPEED * choice.speed
    return steady if motor.rated is None else min(motor.rated.speed / choice.ratio, steady)


def _wheel_inertia(sizing: Sizing) -> float:
    """Inertia (kg m², on its own shaft) of the flywheel as it is built."""
    return sizing.built.wheel.inertia if sizing.built is not None else sizing.inertia or 0.0


def _short_of_it(run: RunUp, choice: MotorChoice) -> str:
    """Reason why a start fails, or was not followed to its end."""
    wheel = f"with its flywheel of {figure(choice.flywheel or 0.0, most=4)} kg m^2"
    count = f"{figure(run.turns, most=3)} turns"
    if run.stop is not None:
        return f"{_NO_START[1]} {wheel}: it stops at {figure(np.degrees(run.stop), most=4)} deg, after {count}"
    speed = f"{figure(run.speed * 60 / TURN, most=4)} rpm of the crank"
    if run.reached is None:
        return f"its start {wheel} was not followed to its end: {speed} after {count}, {figure(run.time, most=3)} s"
    return f"does not come up to speed {wheel}: it stays at {speed}"


def _judged(choice: MotorChoice, terms: Terms) -> MotorChoice:
    """The motor, refused if its start overheats it or takes too long."""
    start = choice.start
    assert start is not None
    wheel = f"with its flywheel of {figure(choice.flywheel or 0.0, most=4)} kg m^2"
    reason = f"the start {wheel} takes {figure(start.time, most=3)} s"
    if start.share is not None and start.share > 1.0 + TIE:
        share = f"{figure(100 * start.share, most=3)} % of what its locked-rotor time bears (I² t)"
        return choice._replace(suits=False, reason=f"too hot a start: {reason} and {share}")
    if terms.start_time is not None and start.time > terms.start_time * (1.0 + TIE):
        reason = f"{reason}, {figure(terms.start_time, most=4)} s at most are allowed"
        return choice._replace(suits=False, reason=f"too slow a start: {reason}")
    return choice._replace(suits=True)


def _in_time(choice: MotorChoice, machine: Machine, terms: Terms) -> MotorChoice:
    """The motor with its start followed in time, up to its speed and through all of its switches."""
    motor = machine.scene.motor
    assert motor is not None
    switches = () if motor.start is None else motor.start.connections
    speeds = [connection.until.speed for connection in switches if connection.until.speed is not None]
    full = max([_full_speed(motor, choice), *((1.0 + TIE) * speed / _ratio(machine.scene) for speed in speeds)])
    options: dict[str, Any] = {"at": _place(choice, terms), "inertia": choice.wheel_inertia or 0.0, "rtol": _TOLERANCE}
    try:
        run = transient(machine, end="regime" if motor.keeps_step else Until("speed", full, False), **options)
        last = max(as_started(run.scene.motor or motor).times, default=0.0)
        if run.reason == "speed" and last > run.time:
            run = transient(machine, end=1.0000001 * last, **options)
    except SceneError as error:
        if choice.start is not None:  # of the map: that no other route confirms it is no reason against it
            return choice
        return choice._replace(suits=None, reason=f"its start could not be followed: {error.faults[0]}")
    return _along(choice, run, motor, terms)


def _along(choice: MotorChoice, run: Transient, motor: Motor, terms: Terms) -> MotorChoice:
    """The motor with its start from a motion in time."""
    if run.reason not in ("speed", "regime", "time"):
        wheel = f"with its flywheel of {figure(choice.flywheel or 0.0, most=4)} kg m^2"
        return choice._replace(suits=False, reason=f"does not come up to speed {wheel}: {run.ended}")
    speed = run.omega * (choice.ratio or 1.0)
    if motor.keeps_step and abs(speed / (motor.no_load_speed or speed) - 1.0) > _IN_STEP:
        reason = f"it stays at {figure(speed * 60 / TURN, most=4)} rpm on its shaft, after {figure(run.time, most=3)} s"
        return choice._replace(suits=False, reason=f"does not pull into step on starting: {reason}")
    heat = run.start_heat
    squared = None if choice.start is None else choice.start.current_squared  # of the map, for a motor with states
    squared = squared if heat is None else heat.current_squared
    limit = motor.locked_rotor_limit() or motor.locked_rotor_limit(cold=True)
    return _judged(choice._replace(start=StartOfMotor(run.time, run.turns, squared, limit, IN_TIME)), terms)


def _confirmed(
    scene: Scene, ordered: list[MotorChoice], crank: float | None, terms: Terms
) -> tuple[list[MotorChoice], dict[str, MotorChoice]]:
    """The motors in order, the first with its start followed in time; and those refused thereby, by name."""
    failed: dict[str, MotorChoice] = {}
    for k, choice in enumerate(ordered):
        assert choice.start is not None
        if choice.start.route == MAPPED and choice.start.turns <= _MOST_TURNS:
            choice = _in_time(choice, Machine(with_motor(scene, choice.motor, crank)), terms)
        if choice.suits:
            return [choice, *ordered[k + 1 :]], failed
        failed[choice.motor.name] = choice
    return [], failed


def _start_notes(suitable: list[MotorChoice], choices: list[MotorChoice], terms: Terms) -> Iterator[str]:
    """Notes on starts: their beginning, the method, and unknown or limited results."""
    if any(choice.reason.startswith(_NO_START) for choice in choices) and not isinstance(terms.at, str):
        yield f"starts begin at crank angle {figure(np.degrees(terms.at), most=4)} deg (--at names another)"
    timed = [choice for choice in suitable if choice.start is not None and choice.start.route == IN_TIME]
    if suitable:
        rest = "" if len(timed) == len(suitable) else "the others' through their torque maps, to about a thousandth"
        followed = f"starts of {_named(timed)} were simulated in time" if timed else ""
        yield ", ".join(filter(None, (followed, rest)))
    unknown = [choice for choice in suitable if choice.start is not None and choice.start.share is None]
    if unknown:
        yield (
            f"whether {_named(unknown)} bear the heat of their starts is not known: the table has no locked_rotor_time "
            "for them, or their type tells no current"
        )
    engines = [choice for choice in suitable if choice.motor.motor.governed and choice.motor.motor.covers[0] > 0.0]
    if engines:
        yield f"{_named(engines)} run by themselves from idle on: below it their curves stand for a starter and a clutch"
    elsewhere = [choice for choice in suitable if not choice.starts_anywhere]
    if elsewhere and terms.at != WORST:
        yield f"the machine does not start from every crank angle with {_named(elsewhere)} (--at worst checks that)"
    if terms.wheel_prices and suitable and all(choice.total_price is None for choice in suitable):
        yield "the table has no prices, so that the order is by power"
    elif terms.wheel_prices and suitable:
        yield "the order is by the price of motor and flywheel together"


def _named(choices: list[MotorChoice]) -> str:
    """The names of motors, the first few."""
    names = [choice.motor.name for choice in choices[:_MOST_NAMED]]
    more = len(choices) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


# -- its flywheel ------------------------------------------------------------------------------------------------------


def _sized(machine: Machine, rtol: float | None) -> Sizing:
    """The sizing for the scene's requirements, and within the rated point if there is no limit of the motor."""
    scene = machine.scene
    sizing = size(machine, rtol, simulate=False)
    if scene.inertia is not None or of_motor(scene):
        return sizing
    loads = _loads(sizing)
    if all(share <= RATED[name] for name, share in loads.items()):
        return sizing  # no smaller one keeps the irregularity
    limits = {name: RATED[name] for name in loads} | dict(scene.limits)
    if scene.irregularity is not None:
        limits["irregularity"] = scene.irregularity
    duty = tuple(
        phase if phase.scene is None else phase._replace(scene=replace(phase.scene, limits=limits)) for phase in scene.duty
    )
    limited = replace(scene, limits=limits, duty=duty)
    if duty:
        return size(limited, rtol, simulate=False)
    return size(machine.with_requirements(limited), rtol, simulate=False)


def _loads(sizing: Sizing) -> dict[str, float]:
    """Heat and torque of a motor over those of its rated point, if known; over the duty if there is one."""
    if sizing.duty is not None:
        loads = {"motor_heat": sizing.duty.heat_share, "motor_rms": sizing.duty.rms_torque_share}
        return {name: share for name, share in loads.items() if share is not None}
    cycle, run, motor = sizing.cycle, sizing.run, sizing.scene.motor
    if cycle is None or run is None or motor is None or motor.rated is None:
        return {}
    shaft = MotorShaft(sizing.scene, cycle, run, sizing.speed, sizing.rtol)
    names = [name for name in RATED if name != "motor_heat" or motor.heated is not None]
    return {name: share.value for name, share in shares(names, shaft).items()}


def _figures(choice: MotorChoice, sizing: Sizing, terms: Terms) -> MotorChoice:
    """A motor suitable so far, with the figures of its machine's sizing."""
    row = choice.motor
    loads, energy, rated = _loads(sizing), sizing.energy, row.motor.rated
    power = None if energy is None else energy.mean_power
    if sizing.duty is not None:
        power = sizing.duty.mean_power
    wheel = None if sizing.built is None else sizing.built.wheel
    without = not sizing.inertia
    own = {
        "inertia": _wheel_inertia(sizing),
        "mass": 0.0 if without else None if wheel is None else wheel.mass,
        "diameter": 0.0 if without else None if wheel is None else 2.0 * wheel.body.outer,
    }
    paid = sum(price * (own[name] or 0.0) for name, price in terms.wheel_prices.items()) if terms.wheel_prices else None
    return choice._replace(
        suits=True,
        flywheel=sizing.inertia,
        error=sizing.error.exact,
        speed=sizing.speed,
        irregularity=None if sizing.run is None else sizing.run.irregularity,
        heat_share=loads.get("motor_heat"),
        rms_torque_share=loads.get("motor_rms"),
        load_share=None if power is None or rated is None else power / rated.power,
        binding=sizing.binding
        or ("irregularity" if sizing.scene.irregularity is not None and sizing.flywheel.needed else None),
        wheel_inertia=own["inertia"],
        wheel_mass=own["mass"],
        wheel_diameter=own["diameter"],
        wheel_price=paid,
        total_price=None if row.price is None else row.price + (paid or 0.0),
    )


def _beyond(choice: MotorChoice, sizing: Sizing, terms: Terms) -> str:
    """Reason why a motor is unsuitable with its flywheel: its rating, the bounds or stresses of the wheel."""
    if sizing.scene.inertia is not None:  # a given flywheel: it is looked at alone
        over = {name: figure(100 * share, most=4) for name, share in _loads(sizing).items() if share > RATED[name] + TIE}
        if over:
            return "; ".join(f"{_WORDS[name]}: {share} % of its rating" for name, share in over.items())
    wheel = {"inertia": choice.wheel_inertia, "mass": choice.wheel_mass, "diameter": choice.wheel_diameter}
    for name, most in terms.wheel_limits.items():
        value = wheel[name]
        if value is not None and value > most * (1.0 + TIE):
            sizes = f"{figure(value, most=4)} {WHEEL[name]}, {figure(most, most=4)} {WHEEL[name]} at most are allowed"
            return f"too large a flywheel: its {name} is {sizes}"
    built = None if sizing.built is None else sizing.built.wheel
    if built is not None and (built.utilisation or 0.0) > 1.0 + TIE:
        allowed = figure((built.material.allowable or 0.0) / 1e6, most=4)
        stress = figure(built.greatest_stress / 1e6, most=4)
        return f"too weak a flywheel: {stress} MPa ({built.place}), {allowed} MPa allowed"
    return ""


def _reason(fault: Fault) -> tuple[str, bool]:
    """Reason why a motor is unsuitable, by a fault of the machine with it; and whether it could be computed."""
    name = fault.path.removeprefix("flywheel.limits.")
    if name in _WORDS and (best := _BEST.search(fault.defect)):
        return f"{_WORDS[name]}: at best {float(best['share']):.4g} % of its rating, {best['where']}", True
    if fault.path.endswith(".starts"):  # of a phase of its duty
        return f"{_NO_START[1]}: {fault.defect}", True
    if "stalls" in fault.advice:
        return f"stalls: {fault.defect}", True
    return f"{fault.path}: {fault.defect}, expected {fault.expected}", fault.path == "flywheel.limits"
