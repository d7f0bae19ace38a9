"""The motors of a table that do for a machine, each with the flywheel that it needs, the cheapest first.

Every motor takes the place of the scene's drive in turn. One that cannot set the machine going from rest, that stalls, or
that no flywheel keeps within what is asked of it is told with its reason. What is asked: the scene's irregularity or its
`[flywheel.limits]`; where these have none of the motor's, its heat and the root mean square of its torque stay within the
rated point. The flywheel is the smallest that keeps all of that.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.motors import Induction, Motor
from flywheel.designs.figures import progress_bar
from flywheel.machine.machine import Machine
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import figure, parse_quantity
from flywheel.reading.catalogue import Catalogue, CatalogueMotor, read_catalogue
from flywheel.scene.scene import Scene
from flywheel.sizing.limits import of_motor, shares
from flywheel.sizing.results import MotorShaft, Sizing
from flywheel.sizing.sizing import size

ADJUSTED, FIXED = "adjusted", "fixed"
RATIOS = (ADJUSTED, FIXED)
RATED = {"motor_heat": 1.0, "motor_rms": 1.0}
"""What is asked of a motor where the scene asks for nothing: within its rated point."""
_TIE = 1e-9
_BEST = re.compile(r"at best, (?P<where>.*), it is (?P<share>[-+.\de]+)")
_WORDS = {
    "motor_heat": "too much heat",
    "motor_rms": "too much torque (root mean square)",
    "motor_torque": "too much torque",
    "current_pulsation": "too much current pulsation",
    "irregularity": "not even enough",
}


class MotorChoice(NamedTuple):
    """A motor of the table in the machine: whether it does, or else the `reason` why not; None where that was not found out.

    `ratio` is the speed of its shaft over the crank's; `flywheel` (kg m² at its own shaft) with its relative error, None
    where none was found; `speed` (rad/s, of the crank), `irregularity`; `heat_share` and `rms_torque_share` over the rated
    point; `load_share`, the mean power over the rated one; `binding`, the limit that decides the flywheel.
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

    def as_dict(self) -> dict[str, Any]:
        """For JSON, SI: what the table says of the motor beside what was found."""
        row, rated = self.motor, self.motor.motor.rated
        own = {
            "name": row.name,
            "line": row.line,
            "price": row.price,
            "currency": row.currency or None,
            "power": None if rated is None else rated.power,
            "rated_speed": None if rated is None else rated.speed,
            "inertia": row.motor.inertia,
        }
        return own | {name: value for name, value in self._asdict().items() if name != "motor"}


@dataclass(frozen=True, repr=False)
class SuitableMotors:
    """The motors of a table for a machine: those that do, cheapest first, then the others in the order of the table.

    `on` is the flywheel's shaft; `ratio` "adjusted" where that of the motor's shaft was chosen for each, so that the crank
    turns at `crank_speed` (rad/s) at the motor's rated point, or "fixed". Those of `refused` whose `suits` is None are left
    open: no steady motion was found with them. `missing` counts the motors that an interruption
    left out, `skipped` are the faults of rows that were left out.
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
        """How many do, and the cheapest."""
        first = f", first {self.suitable[0].motor.name!r}" if self.suitable else ""
        return f"SuitableMotors({len(self.suitable)} of {len(self.suitable) + len(self.refused)}{first})"

    @property
    def on(self) -> str:
        """The flywheel's shaft."""
        return self.scene.flywheel_on

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, SI."""
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
    at: float = 0.0,
    rtol: float | None = None,
    skip_faulty: bool = False,
    progress: bool | None = False,
) -> SuitableMotors:
    """The motors of a table that do for a machine, with the flywheel that each needs.

    Args:
        scene: with a [drive], whose motor or torque the motors take the place of, and a flywheel that is asked for or given.
        catalogue: a table that was read, or its file.
        ratio: "adjusted": the ratio of the motor's shaft is chosen for each motor such that the crank turns at the scene's
            speed at the motor's rated point (without a speed, at that of the scene's own motor); "fixed": it is the
            scene's. If None adjusted where the motor has a shaft of its own and that speed is known.
        at: crank angle (rad) from which the machine is started.
        rtol: relative error asked of each flywheel; the scene's own if None.
        skip_faulty: whether rows at fault are left out.
        progress: whether to show a bar on standard error; None where that is a terminal.

    Raises:
        SceneError: for faults of the table, and a scene that has no drive or asks for no flywheel.

    """
    if not isinstance(catalogue, Catalogue):
        catalogue = read_catalogue(catalogue, skip_faulty=skip_faulty)
    crank = _crank_speed(scene)
    ratio = _checked(scene, ratio, crank)
    found: list[MotorChoice] = []
    with progress_bar(len(catalogue.motors), progress, "motors") as told:
        try:
            for motor in catalogue.motors:
                found.append(_choice(scene, motor, crank if ratio == ADJUSTED else None, at, rtol))
                told(1)
        except KeyboardInterrupt:
            pass
    suitable = sorted((choice for choice in found if choice.suits), key=_cheapest)
    return SuitableMotors(
        scene=scene,
        suitable=tuple(suitable),
        refused=tuple(choice for choice in found if not choice.suits),
        ratio=ratio,
        crank_speed=crank if ratio == ADJUSTED else None,
        notes=tuple(_notes(scene, catalogue, ratio, crank)),
        skipped=catalogue.faults,
        missing=len(catalogue.motors) - len(found),
    )


def _cheapest(choice: MotorChoice) -> tuple[float, float, float]:
    """By price, those without one last; then by power and inertia."""
    row = choice.motor
    power = 0.0 if row.motor.rated is None else row.motor.rated.power
    return inf if row.price is None else row.price, power, row.motor.inertia


def _crank_speed(scene: Scene) -> float | None:
    """The crank's speed (rad/s) that ratios are chosen for: the scene's, or that of its motor's rated point."""
    if scene.speed is not None or scene.drive is None:
        return scene.speed
    rated = None if scene.motor is None else scene.motor.rated
    return None if rated is None else rated.speed / scene.shafts[scene.drive.on]


def _checked(scene: Scene, ratio: str | None, crank: float | None) -> str:
    """How ratios are taken; faults of a scene that no motor can be chosen for."""
    faults = []
    if scene.drive is None:
        faults.append(Fault("drive", "nothing", 'where the motor sits, such as [drive] on = "motor", torque = "balance"'))
    if scene.areas is not None or scene.stroke is not None or not scene.has_flywheel:
        faults.append(Fault("flywheel", "no flywheel that is asked for or given", "a table with irregularity or limits"))
    if scene.unknown not in (None, "drive"):
        advice = "give it a value: a motor decides its own torque"
        faults.append(Fault(f"parameters.{scene.unknown}", '"balance"', "a value, beside a motor", advice))
    if ratio not in (None, *RATIOS):
        faults.append(Fault("ratio", f'"{ratio}"', '"adjusted" or "fixed"'))
    own = scene.drive is not None and scene.drive.on != "crank"
    if ratio == ADJUSTED and not own:
        faults.append(
            Fault("ratio", '"adjusted", with a drive on the crank', "a shaft of the motor's own", "name it in [drive] on")
        )
    elif ratio == ADJUSTED and crank is None:
        faults.append(Fault("regime.speed", "nothing", "the crank's speed, for which a ratio is chosen"))
    if faults:
        raise SceneError(faults)
    return ratio or (ADJUSTED if own and crank is not None else FIXED)


def _notes(scene: Scene, catalogue: Catalogue, ratio: str, crank: float | None) -> Iterator[str]:
    """What was taken for granted."""
    assert scene.drive is not None
    if ratio == ADJUSTED and crank is not None:
        rpm = figure(crank * 30 / np.pi, most=5)
        yield f"the ratio of {scene.drive.on} is chosen for each motor: at its rated point the crank turns at {rpm} rpm"
    elif scene.drive.on != "crank":
        yield f"the ratio of {scene.drive.on} is the scene's for every motor: each sets its own speed of the crank"
    if not of_motor(scene):
        yield "each motor stays within its rated heat and rms torque, as the scene limits none of them"
    if scene.mechanisms and any(m.shaft == scene.drive.on and m.shaft != "crank" for m in scene.mechanisms):
        yield f"mechanisms on {scene.drive.on} turn with the motor"
    if catalogue.unused:
        yield f"columns that mean nothing here: {', '.join(catalogue.unused)}"


# -- one motor ---------------------------------------------------------------------------------------------------------


def with_motor(scene: Scene, motor: CatalogueMotor, crank_speed: float | None = None) -> Scene:
    """The scene with a motor of a table in place of its drive.

    Args:
        scene: one that was read, with a drive.
        motor: the row.
        crank_speed: at which the crank turns at the motor's rated point (rad/s), for which the ratio of its shaft is
            chosen; None to leave that as it is.

    """
    assert scene.drive is not None
    assert scene.document is not None
    tables, on = scene.document.tables, scene.drive.on
    changes: dict[str, Any] = {f"drive.{key}": None for key in ("torque", "motor") if key in tables["drive"]}
    changes["drive.motor"] = dict(motor.table)
    rated = motor.motor.rated
    if crank_speed is not None and rated is not None:
        own = parse_quantity(tables["shafts"][on]["ratio"], "number")
        changes[f"shafts.{on}.ratio"] = own * rated.speed / crank_speed / scene.shafts[on]
    return scene.with_(changes)


def _choice(scene: Scene, row: CatalogueMotor, crank: float | None, at: float, rtol: float | None) -> MotorChoice:
    """What becomes of a machine with a motor."""
    try:
        driven = with_motor(scene, row, crank)
        if reason := _held(driven, at):
            return MotorChoice(row, False, reason, _ratio(driven))
        found = _sized(driven, rtol)
    except SceneError as error:
        told = [_told(fault) for fault in error.faults]
        decided = [reason for reason, known in told if known]
        if decided:
            return MotorChoice(row, False, "; ".join(decided[:2]))
        return MotorChoice(row, None, told[0][0])
    choice = _figures(row, found)
    if scene.inertia is not None:  # a given flywheel: it is looked at alone
        over = [name for name, share in _loads(found).items() if share > RATED[name] + _TIE]
        if over:
            why = "; ".join(f"{_WORDS[name]}: {figure(100 * _loads(found)[name], most=4)} % of its rating" for name in over)
            return choice._replace(suits=False, reason=why)
    return choice


def _ratio(scene: Scene) -> float:
    assert scene.drive is not None
    return scene.shafts[scene.drive.on]


def _held(scene: Scene, at: float) -> str:
    """Why the machine does not start from rest at a crank angle (rad); nothing where it does."""
    assert scene.motor is not None
    assert scene.drive is not None
    machine = Machine(scene)
    phi = np.array([at % scene.cycle])
    with np.errstate(all="ignore"):
        parts = machine.reduction.moments(phi, machine.anchors(phi), 0.0, speed=np.zeros(1))
    load = -float(sum(np.sum(part) for name, part in parts.items() if name != "drive"))
    asked = load / _ratio(scene) / scene.efficiencies.get(scene.drive.on, 1.0)
    torque = starting_torque(scene.motor)
    if torque > asked:
        return ""
    angle = figure(np.degrees(at), most=4)
    told = f"starting torque {figure(torque, most=4)} N m, the load at rest at {angle} deg is {figure(asked, most=4)} N m"
    return f"cannot start the machine: {told} on its shaft"


def starting_torque(motor: Motor) -> float:
    """A motor's torque at rest (N m): that of its plate where it tells, else that of its curve."""
    if isinstance(motor, Induction) and motor.plate.starting_torque is not None:
        return motor.plate.starting_torque * motor.rated.torque
    return motor.starting_torque


def _sized(scene: Scene, rtol: float | None) -> Sizing:
    """The sizing for what the scene asks, and within the rated point where it asks nothing of its motor."""
    found = size(scene, rtol, simulate=False)
    if scene.inertia is not None or of_motor(scene):
        return found
    if all(share <= RATED[name] for name, share in _loads(found).items()):
        return found  # no smaller one keeps the irregularity
    limits = RATED | dict(scene.limits)
    if scene.irregularity is not None:
        limits["irregularity"] = scene.irregularity
    duty = tuple(
        phase if phase.scene is None else phase._replace(scene=replace(phase.scene, limits=limits)) for phase in scene.duty
    )
    return size(replace(scene, limits=limits, duty=duty), rtol, simulate=False)


def _loads(sizing: Sizing) -> dict[str, float]:
    """Heat and torque of a motor over those of its rated point, over the duty where there is one."""
    if sizing.duty is not None:
        known = {"motor_heat": sizing.duty.heat_share, "motor_rms": sizing.duty.rms_torque_share}
        return {name: share for name, share in known.items() if share is not None}
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None:
        return {}
    shaft = MotorShaft(sizing.scene, cycle, run, sizing.speed, sizing.rtol)
    return {name: share.value for name, share in shares(RATED, shaft).items()}


def _figures(row: CatalogueMotor, found: Sizing) -> MotorChoice:
    """A motor that does, with what its machine's sizing says."""
    loads, energy, rated = _loads(found), found.energy, row.motor.rated
    power = None if energy is None else energy.mean_power
    if found.duty is not None:
        power = found.duty.mean_power
    return MotorChoice(
        motor=row,
        suits=True,
        ratio=_ratio(found.scene),
        flywheel=found.inertia,
        error=found.error.exact,
        speed=found.speed,
        irregularity=None if found.run is None else found.run.irregularity,
        heat_share=loads.get("motor_heat"),
        rms_torque_share=loads.get("motor_rms"),
        load_share=None if power is None or rated is None else power / rated.power,
        binding=found.binding
        or ("irregularity" if found.scene.irregularity is not None and found.flywheel.needed else None),
    )


def _told(fault: Fault) -> tuple[str, bool]:
    """Why a motor does not do, from a fault of the machine with it; and whether that is known, or could not be computed."""
    name = fault.path.removeprefix("flywheel.limits.")
    if name in _WORDS and (best := _BEST.search(fault.found)):
        return f"{_WORDS[name]}: at best {float(best['share']):.4g} % of its rating, {best['where']}", True
    if "stalls" in fault.advice:
        return f"stalls: {fault.found}", True
    return f"{fault.path}: {fault.found}, expected {fault.expected}", fault.path == "flywheel.limits"
