"""The diagram of a period of a machine that works stroke by stroke, over time: speeds, torques, energy, as data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from flywheel.language import text as _
from flywheel.pictures import written
from flywheel.pictures.forms import FINE, Axis, Band, Curve, Diagram, Level, Mark, Part, Row
from flywheel.tables.rows import RPM

if TYPE_CHECKING:
    from flywheel.motions.single_stroke import Course, SingleStroke

_CAPACITY_SHOWN = 4.0  # times the greatest torque: a capacity above that is named, not drawn


def part_of_stroke(
    found: SingleStroke, count: int = FINE, view: Mapping[str, Any] | None = None, *, rest: bool = True
) -> Part:
    """A period of a machine that works stroke by stroke, at about so many times."""
    from flywheel.motions.single_stroke import course  # a door: motions load linkages

    along = course(found, count)
    axis = Axis(along.time, along.phi, "s")
    return Part(found.scene, None, None, axis, view or {}, rest, stroke=found, course=along)


def diagram(part: Part, forces: object = "") -> Diagram | str:
    """Speeds on both sides of the clutch with its slip shaded, torques of clutch and brake, energy of wheel and drive."""
    found, along = part.stroke, part.course
    if found is None or along is None:
        return _("The stroke is not completed: see the faults.")
    figures: dict[str, Any] = dict(along._asdict())
    figures["both"] = along.drive_work + along.wheel_work
    rows = _speeds(found, along), _torques(found, along), _energies(found, along)
    title = _("One stroke over time")
    return Diagram(figures, title, " ".join(row.about for row in rows), rows)


def _bands(found: SingleStroke) -> tuple[Band, ...]:
    """Slip of the clutch and braking of the crank."""
    phases = found.phases
    return (
        *(Band(leg.begin, leg.end, _("the clutch slips"), "orange") for leg in (phases.legs[0], *phases.slips)),
        Band(phases.brake_time, phases.stop_time, _("the crank is braked"), "sky"),
    )


def _speeds(found: SingleStroke, course: Course) -> Row:
    on = found.strokes.clutch.on
    least = int(course.driving.argmin())
    slowest = found.speed_least / found.strokes.wheel  # at the clutch's shaft
    words = {"speed": written(RPM * slowest), "time": written(float(course.time[least]), 4)}
    lowest = _("least: {speed} rpm at {time} s", **words)
    slip = {"slip": written(found.phases.lock_time, 4), "stop": written(found.phases.stop_time, 4)}
    about = _("The clutch slips for {slip} s; the crank stands after {stop} s.", **slip)
    return Row(
        key="stroke_speeds",
        title=_("Speeds on both sides of the clutch"),
        label=_("speed at shaft {name}", name=on),
        unit="rpm",
        factor=RPM,
        si="rad/s",
        about=f"{about} {lowest}.",
        curves=(
            Curve("driving", _("motor side, with the flywheel"), "blue", "-", 1.8),
            Curve("crank", _("crank, times the ratio"), "vermillion", "--", 1.6),
        ),
        height=4.4,
        zero=True,
        bands=_bands(found),
        marks=(Mark("least", float(course.time[least]), slowest, lowest, "blue"),),
    )


def _torques(found: SingleStroke, course: Course) -> Row:
    clutch, brake = found.strokes.clutch, found.strokes.brake
    top = float(np.abs(np.concatenate((course.clutch, course.brake))).max())
    capacity = _("the clutch holds {torque} N m", torque=written(clutch.static_torque))
    near = clutch.static_torque <= _CAPACITY_SHOWN * top
    about = _(
        "Clutch up to {clutch} N m when locked, brake {brake} N m.",
        clutch=written(found.clutch_torque, 5, found.error["clutch_torque"]),
        brake=written(brake.torque),
    )
    return Row(
        key="stroke_torques",
        title=_("Torques of clutch and brake"),
        label=_("torque"),
        unit="N m",
        about=about,
        curves=(
            Curve("clutch", _("clutch, on {shaft}", shaft=clutch.on), "ink", "-", 1.7),
            Curve("brake", _("brake, on {shaft}", shaft=brake.on), "purple", "-.", 1.7),
        ),
        height=4.4,
        zero=True,
        bands=_bands(found),
        levels=(Level(clutch.static_torque, clutch.static_torque, capacity),) if near else (),
        notes=() if near else (capacity,),
    )


def _energies(found: SingleStroke, course: Course) -> Row:
    spent = float(course.drive_work[-1])
    most = int(course.wheel_work.argmax())
    words = {"energy": written(found.wheel_energy), "time": written(float(course.time[most]), 4)}
    given = _("the wheel has given {energy} J at {time} s", **words)
    about = _("The drive gives {energy} J a period.", energy=written(spent, 5, found.error["energy"]["motor"]))
    return Row(
        key="stroke_energies",
        title=_("Energy given since the clutch engaged"),
        label=_("energy"),
        unit="J",
        about=f"{about} {given}.",
        curves=(
            Curve("wheel_work", _("by the flywheel and what turns with it"), "blue", "-", 1.8),
            Curve("drive_work", _("by the drive"), "orange", "--", 1.8),
            Curve("both", _("by both"), "ink", ":", 1.6),
        ),
        zero=True,
        bands=_bands(found),
        marks=(Mark("greatest", float(course.time[most]), found.wheel_energy, given, "blue"),),
    )
