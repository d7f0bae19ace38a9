"""The area of a servo drive, torque over speed, as data: its curves, the motion in it, the rms point and the peak point."""

from __future__ import annotations

import numpy as np

from flywheel.language import text as _
from flywheel.pictures import written
from flywheel.pictures.forms import Curve, Diagram, Mark, Part, Row
from flywheel.regime import turning_moment
from flywheel.scene.scene import Scene
from flywheel.tables.rows import RPM

_BRAKING = 1e-9  # of the greatest torque: the least braking that is shown
_LIMITS = 241  # speeds at which the curves of a servo drive are drawn


def diagram(part: Part, forces: object = "") -> Diagram | str:
    """Peak and continuous curve of a servo drive over speed, the loop of the motion, the rms point and the peak point."""
    sizing, motor = part.sizing, part.scene.motor
    if sizing is None or sizing.cycle is None or sizing.servo is None or sizing.run is None:
        return _("The machine cannot run with this scene: see the faults.")
    assert motor is not None
    assert part.scene.drive is not None
    found, cycle, run = sizing.servo, sizing.run.cycle or sizing.cycle, sizing.run
    ratio = part.scene.shafts[part.scene.drive.on]
    omega = turning_moment.speed_over_cycle(cycle, run.speed or sizing.speed, run, np.clip(part.axis.taken, 0.0, None))
    speed, torque = ratio * omega, motor.torque(ratio * omega)
    speeds = np.linspace(0.0, max(motor.covers[1], float(speed.max())), _LIMITS)
    peak, continuous = motor.peak(speeds), motor.continuous(speeds)
    top = 1.05 * float(peak.max())
    points = (
        ("least", found.mean_speed, found.rms_torque, found.continuous_share, "green"),
        ("greatest", found.peak_speed, found.peak_torque, found.peak_share, "vermillion"),
    )
    names = _("rms point"), _("peak point")
    marks = []
    for name, (kind, at, value, share, colour) in zip(names, points, strict=True):
        place = _("{torque} N m at {speed} rpm", torque=written(value, 4), speed=written(at * RPM, 5))
        curve = _("of the continuous curve") if kind == "least" else _("of the peak curve")
        marks.append(Mark(kind, at, value, f"{name}: {place}, {written(100 * share, 3)} % {curve}", colour))
    figures = {
        "speeds": speeds,
        "peak": peak,
        "continuous": continuous,
        "speed": speed,
        "torque": torque,
        "names": names,
        "words": _("speed of the motor, rpm"),
        "window": [0.0, float(speeds[-1]), -top if torque.min() < -_BRAKING * top else 0.0, top],
    }
    curves = (
        Curve("peak", _("peak curve"), "vermillion", "--", 1.6),
        Curve("continuous", _("continuous curve"), "green", "-.", 1.6),
        Curve("torque", _("motion over a cycle"), "blue", "-", 2.0),
    )
    remarks = []
    if found.inertia_ratio is not None:
        ratio_words = written(found.inertia_ratio, 4)
        remarks.append(_("Inertia of what it moves over that of its rotor: {ratio}.", ratio=ratio_words))
    about = "; ".join(mark.words for mark in marks) + "."
    title = _("Area of the servo drive")
    row = Row(
        "servo", title, _("torque of the motor"), "N m", about, curves, 4.4, kind="area", across=RPM, marks=tuple(marks)
    )
    return Diagram(figures, title, about, (row,), tuple(remarks), "area")


def suits(scene: Scene) -> bool:
    """Tests whether a scene has a drive with such an area."""
    return scene.motor is not None and scene.motor.peak(0.0) is not None
