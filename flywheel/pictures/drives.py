"""Diagrams of a drive as data: a period of a machine that works stroke by stroke, over time; the area of a servo drive."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from flywheel.language import text as _
from flywheel.pictures import written
from flywheel.pictures.forms import FINE, Axis, Band, Diagram, DiagramCurve, DiagramData, DiagramRow, ExtremeMark, peak
from flywheel.regime import turning_moment
from flywheel.scene.scene import Scene
from flywheel.tables.rows import RPM, place

if TYPE_CHECKING:
    from flywheel.motions.single_stroke import SingleStroke
    from flywheel.motions.stroke_course import Course


_MOST_CAPACITY = 4.0  # times the greatest torque: a capacity above that is named, not drawn


def part_of_stroke(
    result: SingleStroke, count: int = FINE, view: Mapping[str, Any] | None = None, *, rest: bool = True
) -> DiagramData:
    """A period of a machine that works stroke by stroke, at about that number of times."""
    from flywheel.motions.stroke_course import course  # a door: motions load linkages

    along = course(result.strokes, result.phases, count)
    axis = Axis(along.time, along.phi, "s")
    return DiagramData(result.scene, None, None, axis, view or {}, rest, stroke=result, course=along)


def stroke_diagram(part: DiagramData, forces: object = "") -> Diagram | str:
    """Speeds on both sides of the clutch with its slip shaded, torques of clutch and brake, energy of wheel and drive."""
    stroke, along = part.stroke, part.course
    if stroke is None or along is None:
        return _("The stroke is not completed: see the faults.")
    figures: dict[str, Any] = dict(along._asdict())
    figures["both"] = along.drive_work + along.wheel_work
    rows = _speeds(stroke, along), _torques(stroke, along), _energies(stroke, along)
    title = _("One stroke over time")
    return Diagram(figures, title, " ".join(row.about for row in rows), rows)


def _bands(result: SingleStroke) -> tuple[Band, ...]:
    """Slip of the clutch and braking of the crank."""
    phases = result.phases
    return (
        *(Band(leg.begin, leg.end, _("the clutch slips"), "orange") for leg in (phases.legs[0], *phases.slips)),
        Band(phases.brake_time, phases.stop_time, _("the crank is braked"), "sky"),
    )


def _speeds(result: SingleStroke, course: Course) -> DiagramRow:
    on = result.strokes.clutch.on
    least = peak(course.time, course.driving, -1.0)
    assert least is not None
    slowest = result.speed_least / result.strokes.wheel  # at the clutch's shaft
    words = {"speed": written(RPM * slowest), "time": written(least["at"], 4)}
    lowest = _("least: {speed} rpm at {time} s", **words)
    slip = {"slip": written(result.phases.lock_time, 4), "stop": written(result.phases.stop_time, 4)}
    about = _("The clutch slips for {slip} s; the crank stands after {stop} s.", **slip)
    return DiagramRow(
        key="stroke_speeds",
        title=_("Speeds on both sides of the clutch"),
        label=_("speed at shaft {name}", name=on),
        unit="rpm",
        factor=RPM,
        si="rad/s",
        about=f"{about} {lowest}.",
        curves=(
            DiagramCurve("driving", _("motor side, with the flywheel"), "blue", "-", 1.8),
            DiagramCurve("crank", _("crank, times the ratio"), "vermillion", "--", 1.6),
        ),
        height=4.4,
        zero=True,
        bands=_bands(result),
        marks=(ExtremeMark("least", least["at"], slowest, lowest, "blue"),),
    )


def _torques(result: SingleStroke, course: Course) -> DiagramRow:
    clutch, brake = result.strokes.clutch, result.strokes.brake
    top = float(np.abs(np.concatenate((course.clutch, course.brake))).max())
    capacity = _("the clutch holds {torque} N m", torque=written(clutch.static_torque))
    near = clutch.static_torque <= _MOST_CAPACITY * top
    about = _(
        "Clutch up to {clutch} N m when locked, brake {brake} N m.",
        clutch=written(result.clutch_torque, 5, result.error["clutch_torque"]),
        brake=written(brake.torque),
    )
    return DiagramRow(
        key="stroke_torques",
        title=_("Torques of clutch and brake"),
        label=_("torque"),
        unit="N m",
        about=about,
        curves=(
            DiagramCurve("clutch", _("clutch, on {shaft}", shaft=place(clutch.on)), "ink", "-", 1.7),
            DiagramCurve("brake", _("brake, on {shaft}", shaft=place(brake.on)), "purple", "-.", 1.7),
        ),
        height=4.4,
        zero=True,
        bands=_bands(result),
        levels=(Band(clutch.static_torque, clutch.static_torque, capacity),) if near else (),
        notes=() if near else (capacity,),
    )


def _energies(result: SingleStroke, course: Course) -> DiagramRow:
    spent = float(course.drive_work[-1])
    most = peak(course.time, course.wheel_work, 1.0)
    assert most is not None
    words = {"energy": written(result.wheel_energy), "time": written(most["at"], 4)}
    note = _("the wheel has given {energy} J at {time} s", **words)
    about = _("The drive gives {energy} J a period.", energy=written(spent, 5, result.error["energy"]["motor"]))
    return DiagramRow(
        key="stroke_energies",
        title=_("Energy given since the clutch engaged"),
        label=_("energy"),
        unit="J",
        about=f"{about} {note}.",
        curves=(
            DiagramCurve("wheel_work", _("by the flywheel and what turns with it"), "blue", "-", 1.8),
            DiagramCurve("drive_work", _("by the drive"), "orange", "--", 1.8),
            DiagramCurve("both", _("by both"), "ink", ":", 1.6),
        ),
        zero=True,
        bands=_bands(result),
        marks=(ExtremeMark("greatest", most["at"], result.wheel_energy, note, "blue"),),
    )


_BRAKING = 1e-9  # of the greatest torque: the least braking that is shown
_LIMITS = 241  # speeds at which the curves of a servo drive are drawn


def servo_diagram(part: DiagramData, forces: object = "") -> Diagram | str:
    """Peak and continuous curve of a servo drive over speed, the loop of the motion, the rms point and the peak point."""
    sizing, motor = part.sizing, part.scene.motor
    assert motor is not None
    assert part.scene.drive is not None
    if part.stroke is not None:
        from flywheel.motions.stroke_course import motor_ratio, servo_load  # a door: motions load linkages

        load = servo_load(part.stroke.strokes, part.stroke.phases)
        speed = motor_ratio(part.stroke.strokes) * part.course.driving
    elif sizing is None or sizing.cycle is None or sizing.servo is None or sizing.run is None:
        return _("The machine cannot run with this scene: see the faults.")
    else:
        load, cycle, run = sizing.servo, sizing.run.cycle or sizing.cycle, sizing.run
        omega = turning_moment.speed_over_cycle(cycle, run.speed or sizing.speed, run, np.clip(part.axis.taken, 0.0, None))
        speed = part.scene.shafts[part.scene.drive.on] * omega
    assert load is not None
    torque = motor.torque(speed)
    speeds = np.linspace(0.0, max(motor.covers[1], float(speed.max())), _LIMITS)
    greatest, continuous = motor.peak(speeds), motor.continuous(speeds)
    top = 1.05 * float(greatest.max())
    points = (
        ("least", load.mean_speed, load.rms_torque, load.continuous_share, "green"),
        ("greatest", load.peak_speed, load.peak_torque, load.peak_share, "vermillion"),
    )
    names = _("rms point"), _("peak point")
    marks = []
    for name, (kind, at, value, share, colour) in zip(names, points, strict=True):
        place = _("{torque} N m at {speed} rpm", torque=written(value, 4), speed=written(at * RPM, 5))
        curve = _("of the continuous curve") if kind == "least" else _("of the peak curve")
        marks.append(ExtremeMark(kind, at, value, f"{name}: {place}, {written(100 * share, 3)} % {curve}", colour))
    figures = {
        "speeds": speeds,
        "peak": greatest,
        "continuous": continuous,
        "speed": speed,
        "torque": torque,
        "names": names,
        "words": _("speed of the motor, rpm"),
        "window": [0.0, float(speeds[-1]), -top if torque.min() < -_BRAKING * top else 0.0, top],
    }
    curves = (
        DiagramCurve("peak", _("peak curve"), "vermillion", "--", 1.6),
        DiagramCurve("continuous", _("continuous curve"), "green", "-.", 1.6),
        DiagramCurve("torque", _("motion over a cycle"), "blue", "-", 2.0),
    )
    remarks = []
    if load.inertia_ratio is not None:
        ratio_words = written(load.inertia_ratio, 4)
        remarks.append(_("Inertia of what it moves over that of its rotor: {ratio}.", ratio=ratio_words))
    about = "; ".join(mark.words for mark in marks) + "."
    title = _("Area of the servo drive")
    row = DiagramRow(
        "servo", title, _("torque of the motor"), "N m", about, curves, 4.4, kind="area", across=RPM, marks=tuple(marks)
    )
    return Diagram(figures, title, about, (row,), tuple(remarks), "area")


def has_servo(scene: Scene) -> bool:
    """Tests whether a scene has a drive with such an area."""
    return scene.motor is not None and scene.motor.peak(0.0) is not None
