"""Every diagram of a scene over its cycle or stroke, made once for the picture and for the live page.

A maker gives the figures of a diagram and the way to draw them, in the form of `flywheel.pictures.forms`, or the reason why
there is nothing to draw. A new panel is one maker here and its entry in `DIAGRAMS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import language
from flywheel.language import text as _
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.families import has_joints
from flywheel.numerics.faults import SceneError
from flywheel.pictures import forms, noun, written
from flywheel.pictures.forms import (
    Band,
    Diagram,
    DiagramCurve,
    DiagramData,
    DiagramRow,
    ExtremeMark,
    Fill,
    along_motion,
    angle,
    area_work,
    extremes,
    place_of,
    scaled,
    without_noise,
    works_error,
)
from flywheel.regime import turning_moment
from flywheel.scene.scene import Scene
from flywheel.sizing.motor import drive_moment
from flywheel.sizing.results import Sizing
from flywheel.tables.power import balance_error, places, stream_name
from flywheel.tables.rows import MOST_PARTS, RPM, irregularity, largest_parts
from flywheel.tables.sizing import candidates, inertia_error

if TYPE_CHECKING:  # the door of linkages, which a flywheel's diagrams leave shut
    from flywheel.mechanisms.linkages.equations import Track
    from flywheel.motions.joint_forces import JointForces
    from flywheel.motions.motion import DriverMotion

Array = NDArray[np.float64]

QUANTITIES = ("position", "velocity", "acceleration", "reaction")
MOST_WITH_WORKS, MOST_AREAS = 12, 40  # areas whose works are written beside them, that are named at all
_CONSTANT_INERTIA = 1e-9  # of I*: a variation below it is none
_OFF_SCALE = 6.0  # times the greatest M*: curves beyond it are named, not drawn
_BRAKING = 1e-9  # of the greatest moment: the least braking that is shown
_SMALL_FLUCTUATION = 2e-3  # of the mean speed: below it the axis counts from the mean
_FAR_FROM_ZERO = 0.4  # of the largest value: a curve that comes no nearer to zero is drawn without it
_CONFIRMED = 1e-4  # of the irregularity: the error of a confirmation
_DIGITS = 5


def _no_cycle(part: DiagramData) -> str:
    """Reason why there is no steady cycle."""
    scene = part.scene
    if scene.stroke is not None:
        return _("The driver moves one way, from one end of its stroke to the other: there is no cycle and no flywheel.")
    if not scene.has_flywheel:
        return _("The scene has no flywheel: add the table flywheel, with irregularity or inertia.")
    if not scene.has_speed:
        return _("The scene has no speed: add regime.speed.")
    return _("The machine cannot run with this scene: see the faults.")


# -- turning moment and work -----------------------------------------------------------------------------------------------


def _moment(part: DiagramData, forces: JointForces | str) -> Diagram | str:
    """M* with driving and resisting moments and its areas; under it W, their sum."""
    sizing, record = part.sizing, part.samples
    if sizing is None:
        return _no_cycle(part)
    sums, ends = [0.0, *(area.accumulated for area in sizing.areas)], [0.0, *(area.end for area in sizing.areas)]
    areas = [
        {"from": area.start, "to": area.end, "work": area.work, "accumulated": area.accumulated} for area in sizing.areas
    ]
    figures: dict[str, Any] = {"areas": areas, "fluctuation": sizing.energy_fluctuation}
    for name, value in (("greatest", sizing.accumulated_max), ("least", sizing.accumulated_min)):
        k = int(np.abs(np.array(sums) - value).argmin())
        figures[name] = {"value": value, "at": ends[k], "crossing": k}
    if record is None:
        return _areas(sizing, figures)
    if not record.moment.any() and not record.driving.any():
        return _("No torque or force acts on the machine: M* is zero over the whole cycle.")
    figures |= {"net": record.moment, "driving": record.driving, "resisting": record.moment - record.driving}
    figures |= {"work": record.work, "constant_speed": sizing.constant_speed, "balance": _balance(sizing)}
    rows = _moment_row(part, figures), _work_row(part, figures)
    remarks = []
    if sizing.cyclic is not None:
        speed = written(RPM * sizing.cyclic.constant_speed, 6)
        remarks.append(_("Areas are those at a constant speed of {speed} rpm.", speed=speed))
    return Diagram(figures, rows[0].title, f"{rows[0].about} {rows[1].about}", rows, tuple(remarks))


def _moment_row(part: DiagramData, figures: dict[str, Any]) -> DiagramRow:
    """The row of M*; driving and resisting moments far above their sum, whose areas would be invisible, are only named.

    Where the sum is zero everywhere there is no visible area, and all are drawn.
    """
    sizing, record = part.sizing, part.samples
    assert sizing is not None
    assert record is not None
    top = float(np.abs(record.moment).max())
    scale = max(float(np.abs(figures[key]).max()) for key in ("driving", "resisting"))
    fit = top == 0.0 or scale <= _OFF_SCALE * top

    def curve(of: str, name: str, colour: str, dash: str, width: float, most: float) -> DiagramCurve:
        least, greatest = float(figures[of].min()), float(figures[of].max())
        if max(-least, greatest) <= _OFF_SCALE * most or (fit and of in ("driving", "resisting")):
            return DiagramCurve(of, name, colour, dash, width)
        bounds = {"least": written(least), "most": written(greatest)}
        return DiagramCurve(
            of, _("{name}: {least} to {most} N m, off the scale", name=name, **bounds), colour, dash, width, False
        )

    sides = [("driving", _("driving"), "blue", "--", 1.3), ("resisting", _("resisting"), "vermillion", "-.", 1.3)]
    curves = [DiagramCurve("net", _("M*, net"), "ink", "-", 1.7), *(curve(*side, top if fit else 0.0) for side in sides)]
    braking = [("drive", record.drive, scale)] if fit and record.drive is not None else []
    if sizing.constant is not None:
        along = along_motion(part)
        figures["along"] = along.moment
        curves.append(DiagramCurve("along", _("M* along the motion"), "green", "-", 1.2))
        if part.rest and part.scene.drive is not None:
            figures["drive_along"] = drive = _drive_along(part)
            name, most = _("drive along the motion"), max(top, float(np.abs(along.moment).max()))
            curves.append(curve("drive_along", name, "purple", ":", 1.8, most))
            braking += [("drive_along", drive, float(np.abs(along.moment).max()))] if curves[-1].drawn else []
    fills = [
        Fill("net", 1, _("area that speeds up"), "sky", "//"),
        Fill("net", -1, _("area that slows down"), "orange", "\\\\"),
    ]
    for key, drive, most in braking:
        if drive.min() < -_BRAKING * most:
            figures[key] = drive
            fills.append(Fill(key, -1, _("the drive brakes"), "blue", "---"))
    error = works_error(sizing)
    words = [area_work(area.work, error) for area in sizing.areas]
    title = _("Turning moment and its areas")
    if sizing.cyclic is not None:
        speed = written(RPM * sizing.cyclic.constant_speed, 6)
        title = _("Turning moment at a constant {speed} rpm, and its areas", speed=speed)
    notes = list(_balance_note(sizing))
    if len(words) > MOST_WITH_WORKS:
        notes.append(_("A1 to A{last} from left to right, their works in the table", last=len(words)))
    return DiagramRow(
        key="moment",
        title=title,
        label=_("reduced moment M*"),
        unit="N m",
        about=_areas_about(words),
        curves=tuple(curves),
        height=4.4,
        zero=True,
        fills=tuple(fills),
        areas=tuple(words),
        notes=tuple(notes),
    )


def _drive_along(part: DiagramData) -> Array:
    """The moment of the drive along the motion, on the axis."""
    from flywheel.numerics import cells

    sizing, machine = part.sizing, part.machine
    assert sizing is not None
    assert machine is not None
    assert sizing.cycle is not None
    values = cells.fit(drive_moment(machine, sizing.cycle, sizing.run, sizing.speed))
    cell, t = cells.located(sizing.cycle.mesh, part.axis.taken)
    return np.asarray(cells.value(values[cell], t))


def _balance(sizing: Sizing) -> dict[str, Any] | None:
    """The balance and its value where the areas are taken."""
    cycle = sizing.constant or sizing.cycle
    if sizing.balance is None or cycle is None or cycle.balance is None:
        return None
    return {"name": sizing.balance.name, "value": cycle.balance, "unit": sizing.balance_unit or ""}


def _balance_note(sizing: Sizing) -> Iterable[str]:
    """Value of the balance, with its name."""
    balance = _balance(sizing)
    if balance is None:
        return
    name, drive = balance["name"], sizing.scene.drive if balance["name"] == "drive" else None
    on = "" if drive is None or drive.on == "crank" else " " + _("on {shaft}", shaft=drive.on)
    unit = f" {balance['unit']}" if balance["unit"] else ""
    value = f"{written(balance['value'], _DIGITS, balance_error(sizing))}{unit}{on}"
    yield _("balance: {name} = {value}", name=_("drive") if name == "drive" else name, value=value)


def _work_row(part: DiagramData, figures: dict[str, Any]) -> DiagramRow:
    """W, the sum of the areas, with its greatest and its least value, and between them the fluctuation of energy.

    None of these is marked where W is zero except for rounding.
    """
    sizing = part.sizing
    assert sizing is not None
    flat = not figures["work"].any()
    cycle, error = sizing.constant or sizing.cycle, works_error(sizing)
    assert cycle is not None
    curves = [DiagramCurve("work", _("W, sum of the areas"), "ink", "-", 1.7)]
    at = ""
    if sizing.cyclic is not None:
        at = " " + _("at a constant {speed} rpm", speed=written(RPM * sizing.cyclic.constant_speed, 6))
    if sizing.constant is not None:
        figures["work_along"] = along_motion(part).work
        curves.append(DiagramCurve("work_along", _("W along the motion"), "green", "--", 1.2))
    extremes = turning_moment.combined(cycle, np.array([[1.0, 0.0]]))[0]
    marks = []
    for kind, word, place, value, colour in (
        ("greatest", _("greatest"), float(extremes.angle_greatest[0]), sizing.accumulated_max, "blue"),
        ("least", _("least"), float(extremes.angle_least[0]), sizing.accumulated_min, "vermillion"),
    ):
        work = written(value, _DIGITS, error)
        words = _("{which}: {work} J at {angle}", which=word, work=work, angle=angle(place))
        marks.append(ExtremeMark(kind, place, value, words, colour, level=True))
    return DiagramRow(
        key="work",
        title=_("Accumulated work of the net moment{at}", at=at),
        label=_("accumulated work W"),
        unit="J",
        about=_work_about(sizing),
        curves=tuple(curves),
        height=3.5,
        zero=True,
        marks=() if flat else tuple(marks),
        dots=() if flat else tuple((area.end, area.accumulated) for area in sizing.areas[:-1] if area.end is not None),
        dots_name=_("end of an area"),
        span=None if flat else _fluctuation(sizing),
    )


def _fluctuation(sizing: Sizing) -> tuple[float, float, str]:
    """The dimension between the least and the greatest accumulated work."""
    words = f"ΔW = {written(sizing.energy_fluctuation, _DIGITS, 2 * works_error(sizing))} J"
    return sizing.accumulated_min, sizing.accumulated_max, words


def _work_about(sizing: Sizing) -> str:
    error = works_error(sizing)
    return _(
        "Accumulated work: greatest {most} J, least {least} J, fluctuation of energy {between} J.",
        most=written(sizing.accumulated_max, _DIGITS, error),
        least=written(sizing.accumulated_min, _DIGITS, error),
        between=written(sizing.energy_fluctuation, _DIGITS, 2 * error),
    )


def _areas_about(works: Sequence[str]) -> str:
    each = [f"A{k} = {work}" for k, work in enumerate(works[:MOST_WITH_WORKS], 1)]
    some = ", ".join(each) + (" ..." if len(works) > MOST_WITH_WORKS else "")
    return _("Areas of the net turning moment over one cycle: {areas}.", areas=some or "0")


def _areas(sizing: Sizing, figures: dict[str, Any]) -> Diagram:
    """Bars of the areas, because a diagram of areas has nothing between them, and under them their sums."""
    works, error = np.array([area.work for area in sizing.areas]), works_error(sizing)
    sums = np.array([0.0, *(area.accumulated for area in sizing.areas)])
    figures |= {"diagram_of_areas": True, "works": works, "sums": sums}
    words = tuple(area_work(float(work), error) for work in works)
    bars = DiagramRow(
        key="moment",
        title=_("Areas of the turning moment (angles not given)"),
        label=_("work"),
        unit="J",
        about=_areas_about(words),
        curves=(DiagramCurve("works", ""),),
        height=4.4,
        zero=True,
        kind="bars",
        ticks="A",
        fills=(Fill("works", 1, _("speeds up"), "sky", "//"), Fill("works", -1, _("slows down"), "orange", "\\\\")),
        areas=words,
    )
    marks = []
    for kind, word, colour in (("greatest", _("greatest"), "blue"), ("least", _("least"), "vermillion")):
        k, value = figures[kind]["crossing"], figures[kind]["value"]
        marks.append(ExtremeMark(kind, k, value, f"{word}: S{k} = {written(value, _DIGITS, error)} J", colour, level=True))
    line = DiagramRow(
        key="work",
        title=_("Accumulated areas"),
        label=_("accumulated work W"),
        unit="J",
        about=_work_about(sizing),
        curves=(DiagramCurve("sums", "", "ink", "-", 1.2),),
        height=3.5,
        kind="points",
        ticks="S",
        marks=tuple(marks),
        span=_fluctuation(sizing),
    )
    return Diagram(figures, bars.title, f"{bars.about} {line.about}", (bars, line))


# -- reduced inertia -------------------------------------------------------------------------------------------------------

BODY_COLOURS = ("sky", "orange", "green", "yellow", "purple", "blue", "vermillion", "grey")


def _inertia(part: DiagramData, forces: JointForces | str) -> Diagram | str:
    """I* as the sum of the shares of all bodies."""
    if part.scene.areas is not None:
        return _("A diagram of areas gives no reduced inertia: all of it counts as flywheel.")
    if part.machine is None:
        return _no_cycle(part)
    own = part.axis.taken - part.scene.origin
    chain = part.machine.kinematics
    parts = chain.inertias(chain.flows(own, part.machine.anchors(own)))
    bodies = {name: np.broadcast_to(values, own.shape) for name, values in parts.items() if np.any(values)}
    if not bodies:
        return _("No body of the machine has mass or inertia: I* = 0.")
    total = np.sum(list(bodies.values()), axis=0)
    extent = part.sizing.reduced_inertia if part.sizing is not None else None
    least, greatest, mean = extent or (float(total.min()), float(total.max()), None)
    bodies_drawn = largest_parts(bodies, f"{len(bodies) - MOST_PARTS + 1} others")
    sliding = part.scene.reduction_element == "slide"
    unit, symbol = ("kg", "m*") if sliding else ("kg m²", "I*")
    cycle = None if part.sizing is None else part.sizing.cycle
    error = 0.0 if cycle is None else cycle.errors.inertia
    low, high = written(least, _DIGITS, error), written(greatest, _DIGITS, error)
    name = _("{symbol}, {inertia} {unit} at every angle", symbol=symbol, inertia=high, unit=unit)
    if low != high:
        name = _("{symbol}, from {least} to {most} {unit}", symbol=symbol, least=low, most=high, unit=unit)
    about = _("From {least} to {greatest}.", least=f"{low} {unit}", greatest=f"{high} {unit}")
    remarks = [] if mean is None else [_("Mean {value}.", value=f"{written(mean)} {unit}")]
    if mean is not None:
        bounds = {"least": written(least), "mean": written(mean), "most": written(greatest)}
        about = _("Reduced inertia over one cycle: least {least}, mean {mean}, greatest {most} kg m².", **bounds)
    title = _("Reduced inertia by body, without the flywheel")
    if sliding:
        title = _("Reduced mass by body")
    figures = {
        "bodies": [{"name": body, "values": values} for body, values in bodies_drawn.items()],
        "total": total,
        "least": least,
        "greatest": greatest,
        "mean": mean,
        "unit": unit,
    }
    stack = [
        DiagramCurve(f"bodies.{k}.values", noun(body), BODY_COLOURS[k % len(BODY_COLOURS)], drawn=False, body=body)
        for k, body in enumerate(bodies_drawn)
    ]
    row = DiagramRow(
        key="inertia",
        title=title,
        label=_("reduced mass m*") if sliding else _("reduced inertia I*"),
        unit=unit,
        about=about,
        curves=(*stack, DiagramCurve("total", name, "ink", "-", 1.8)),
        zero=True,
        kind="stack",
    )
    return Diagram(figures, title, f"{about} {', '.join(curve.name for curve in stack)}.", (row,), tuple(remarks))


# -- Wittenbauer's diagram -------------------------------------------------------------------------------------------------


def _wittenbauer(part: DiagramData, forces: JointForces | str) -> Diagram | str:
    """The loop W(I*), its tangents as energies (J), MN and P, and the visible windows."""
    sizing, title = part.sizing, _("Wittenbauer's diagram")
    if part.scene.areas is not None:
        return _("The loop needs the reduced inertia of a machine; a diagram of areas gives none.")
    if sizing is None or sizing.cycle is None or part.samples is None:
        return _no_cycle(part)
    if sizing.run is None:
        return _no_motion(sizing)
    run = sizing.run
    cycle, speed = run.cycle or sizing.cycle, run.speed or sizing.speed
    loop = forms.loop(cycle, along_motion(part), speed, run)
    extent = sizing.reduced_inertia
    assert extent is not None
    if extent.max - extent.min <= _CONSTANT_INERTIA * extent.max:
        return _constant_inertia(sizing, extent.max)
    joule = 0.5 * speed**2
    contacts, angles = (loop.contact_fast, loop.contact_slow), (loop.angle_fast, loop.angle_slow)
    speeds, signs = (run.speed_max, run.speed_min), (("ψmax", _("greatest speed")), ("ψmin", _("least speed")))
    tangents = []
    for (slope, intercept), contact, at, limit, (psi, which) in zip(
        loop.lines, contacts, angles, speeds, signs, strict=True
    ):
        inclination = float(np.degrees(np.arctan(slope)))
        words = _(
            "{which} at {angle}: tan {psi} = {tangent}, {psi} = {degrees}°, slope {slope} J/(kg m²)",
            which=which,
            angle=angle(at),
            psi=psi,
            tangent=written(slope),
            degrees=written(inclination),
            slope=written(joule * slope),
        )
        tangent = {"slope": joule * slope, "intercept": joule * intercept, "contact": [contact[0], joule * contact[1]]}
        tangent |= {"angle": at, "tangent": slope, "inclination": inclination, "speed": limit, "words": words, "psi": psi}
        tangents.append(tangent)
    cut, (x, y) = loop.intercept_fast - loop.intercept_slow, loop.far_point
    windows, seen = forms.windows(loop, joule)
    figures = {
        "inertia": loop.inertia,
        "energy": joule * loop.energy,
        "joule": joule,
        "tangents": tangents,
        "mn": joule * cut,
        "pole": [x, joule * y],
        "flywheel": run.inertia,
        "irregularity": run.irregularity,
        "windows": windows,
        "seen": seen,
    }
    mn = {
        "work": written(joule * cut),
        "cut": written(cut),
        "inertia": written(loop.flywheel),
        "eps": written(run.irregularity),
    }
    first = _("MN = {work} J = {cut} kg m², I = MN/(2 ε) = {inertia} kg m², ε = {eps}", **mn)
    place = _("I* = {x} kg m², W = {y} J", x=written(x), y=written(joule * y))
    far = _("P, where the tangents meet: {place}", place=place)
    if loop.flywheel == 0.0:
        first = _("without a flywheel the tangents meet at I* = 0: M, N and P are one point")
    notes, remarks = [first], [f"{first}.", f"{far}."]
    if seen == "MN":
        notes.append(_("P, where the tangents meet, is far to the left: {place}", place=place))
    elif seen == "loop":
        m, n = written(joule * loop.intercept_fast), written(joule * loop.intercept_slow)
        share = written(100 * (extent.max - extent.min) / extent.max, 2)
        remarks.append(_("The loop is drawn enlarged, as I* varies by {share} % only.", share=share))
        notes += [remarks[-1], _("outside the picture: M and N at I* = 0, W = {m} J and {n} J", m=m, n=n), far]
    about = f"{first}. {far}."
    row = DiagramRow(
        key="wittenbauer",
        title=title,
        label=_("work W"),
        unit="J",
        about=about,
        curves=(DiagramCurve("energy", _("W against I*"), "ink", "-", 1.6),),
        height=5.8,
        kind="loop",
        notes=tuple(notes),
    )
    return Diagram(figures, title, about, (row,), tuple(remarks), "loop")


def _no_motion(sizing: Sizing) -> str:
    """Reason why a speed never changes, or no energy is stored."""
    if sizing.energy_fluctuation:
        return _("Nothing in the machine stores energy.")
    return _("Nothing acts on the machine, or nothing in it has inertia: its speed never changes.")


def _constant_inertia(sizing: Sizing, inertia: float) -> str:
    """Reason why there is no loop, and how the flywheel follows without one."""
    scene, square = sizing.scene, sizing.speed**2
    assert sizing.cycle is not None
    assert sizing.run is not None
    extremes = turning_moment.combined(sizing.cycle, np.array([[1.0, 0.0]]))[0]
    fluctuation = float(extremes.greatest[0] - extremes.least[0])
    lines = [
        _("I* is constant, {inertia} kg m²: the loop is an upright line.", inertia=written(inertia)),
        _("The flywheel follows from the fluctuation of energy alone:"),
        f"ΔW = {written(fluctuation, _DIGITS, 2 * works_error(sizing))} J,  ω = {written(sizing.speed)} rad/s",
    ]
    eps = scene.irregularity
    if scene.inertia is not None or eps is None:
        lines.append(f"ε = ΔW/((I + I*) ω²) = {written(sizing.run.irregularity)}")
        lines.append(_("with I = {given} kg m² on the crank", given=written(sizing.run.inertia)))
        return "\n".join(lines)
    net, ratio = fluctuation / (eps * square) - inertia, scene.flywheel_ratio**2
    lines.append(f"I = ΔW/(ε ω²) − I* = {written(net, _DIGITS, inertia_error(sizing) * ratio)} kg m²")
    if net <= 0.0:
        lines.append(_("Below 0: the machine's own inertia suffices."))
    elif scene.flywheel_on != "crank":
        here = written(net / ratio, _DIGITS, inertia_error(sizing))
        lines.append(_("on the crank, {inertia} kg m² on shaft {name}", inertia=here, name=scene.flywheel_on))
    return "\n".join(lines)


# -- speed -----------------------------------------------------------------------------------------------------------------

_FLYWHEELS = {
    "exact": ("blue", "-", 2.4),
    "given": ("blue", "-", 2.4),
    "approximate": ("vermillion", "--", 1.8),
    "inertia_torque_flywheel": ("green", ":", 2.2),
}


def _speed(part: DiagramData, forces: JointForces | str) -> Diagram | str:
    """The speed over the cycle with the flywheel given or sized; at rest beside those with the approximate ones."""
    sizing = part.sizing
    if sizing is None:
        return _no_cycle(part)
    eps, mean = sizing.scene.irregularity, sizing.speed
    figures: dict[str, Any] = {
        "mean": mean,
        "band": None if eps is None else [mean * (1 - eps / 2), mean * (1 + eps / 2)],
        "asked": eps if sizing.approximated else None,
        "on": sizing.scene.flywheel_on,
        "confirmed": None,
    }
    if sizing.simulation is not None:
        simulation = sizing.simulation
        confirmation = {"irregularity": simulation.irregularity, "route": simulation.route, "error": sizing.error.simulation}
        figures["confirmed"] = confirmation
    if sizing.cycle is None:
        return _crossings(sizing, figures)
    if sizing.run is None:
        return _no_motion(sizing)
    names = {"exact": _("exact"), "approximate": _("by the areas"), "inertia_torque_flywheel": _("by the inertia torque")}
    run, q = sizing.run, part.axis.taken
    runs: list[tuple[str, float, str, turning_moment.Run | None]] = []
    if sizing.scene.inertia is not None:
        name = _("given {inertia} kg m²", inertia=written(sizing.scene.inertia))
        runs = [("given", sizing.inertia or 0.0, name, run)]
    else:
        if not part.rest:
            name = f"{names['exact']} {written(sizing.inertia or 0.0, _DIGITS, inertia_error(sizing))} kg m²"
            runs = [("exact", sizing.inertia or 0.0, name if sizing.inertia else _("no flywheel"), run)]
        for each in candidates(sizing) if part.rest else ():
            bare = each.inertia == 0.0
            if bare and any(other is run for *_rest, other in runs):
                continue
            name = f"{names[each.key]} {written(each.inertia, _DIGITS, each.error)} kg m²"
            runs.append((each.key, each.inertia, _("no flywheel") if bare else name, each.motion))
    stops = [(key, name) for key, _inertia, name, motion in runs if motion is None]
    moving = [(key, inertia, name, motion) for key, inertia, name, motion in runs if motion is not None]
    figures["stops"] = [key for key, _name in stops]
    figures["traces"] = [
        {
            "key": key,
            "inertia": inertia,
            "irregularity": motion.irregularity,
            "values": turning_moment.speed_over_cycle(sizing.cycle, mean, motion, q),
        }
        for key, inertia, _name, motion in moving
    ]
    curves = []
    for k, (key, _inertia, name, motion) in enumerate(moving):
        share = language.number(irregularity(float(f"{motion.irregularity:.4g}"), 0.0))
        curves.append(DiagramCurve(f"traces.{k}.values", f"{name}, ε = {share}", *_FLYWHEELS[key]))
    marks = []
    for kind, at, value, word in (
        ("greatest", run.angle_speed_max, run.speed_max, _("greatest")),
        ("least", run.angle_speed_min, run.speed_min, _("least")),
    ):
        figures[kind] = {"value": value, "at": at}
        off = RPM * run.error * run.irregularity * mean
        digits = max(6, min(10, 3 - floor(log10(run.irregularity or 1.0))))
        words = _("{which}: {speed} rpm at {angle}", which=word, speed=written(RPM * value, digits, off), angle=angle(at))
        marks.append(ExtremeMark(kind, at, value, words, "blue"))
    span = max(float(np.ptp(trace["values"])) for trace in figures["traces"])
    row = DiagramRow(
        key="speed",
        title=_("Speed of the crank over the cycle"),
        label=_("crank speed"),
        unit="rpm",
        about=", ".join(mark.words for mark in marks) + ".",
        curves=tuple(curves),
        factor=RPM,
        si="rad/s",
        origin=mean if span < _SMALL_FLUCTUATION * mean else 0.0,
        marks=tuple(marks),
        levels=_speed_levels(sizing),
        notes=tuple(f"{name}: " + _("no steady motion") for _key, name in stops),
    )
    remarks = tuple(_confirmation(figures["confirmed"]))
    about = " ".join((row.about, "; ".join(curve.name for curve in curves) + ".", *remarks))
    return Diagram(figures, row.title, about, (row,), remarks)


def _speed_levels(sizing: Sizing) -> tuple[Band, ...]:
    """The required band of speeds, and the mean of extremes."""
    eps, mean = sizing.scene.irregularity, sizing.speed
    middle = Band(mean, mean, _("mean of extremes, {speed} rpm", speed=written(mean * RPM, 6)))
    if eps is None:
        return (middle,)
    percent = written(50 * eps, 4)
    return Band(mean * (1 - eps / 2), mean * (1 + eps / 2), _("required band, ±{percent} %", percent=percent)), middle


def _confirmation(confirmed: Mapping[str, Any] | None) -> Iterable[str]:
    """A second route's irregularity in a sentence."""
    if confirmed is None or confirmed["error"] is None:
        return
    eps = written(confirmed["irregularity"])
    words = _("By another method the irregularity is {eps}", eps=eps)
    if confirmed["route"] == "time":
        words = _("By stepping in time the irregularity is {eps}", eps=eps)
    off = _("to within {off} %", off=written(100 * confirmed["error"], 2))
    yield f"{words}: {_('confirmed') if confirmed['error'] < _CONFIRMED else off}."


def _crossings(sizing: Sizing, figures: dict[str, Any]) -> Diagram | str:
    """The speeds at the crossings of a diagram of areas."""
    inertia = sizing.inertia or 0.0
    if not inertia:
        return _("The areas are all zero: the speed never changes.")
    sums = np.array([0.0, *(area.accumulated for area in sizing.areas)])
    eps = sizing.simulation.irregularity if sizing.simulation is not None else sizing.scene.irregularity or 0.0
    speeds = forms.crossing_speeds(sums, sizing.speed * (1 - eps / 2), inertia * sizing.scene.flywheel_ratio**2)
    figures |= {"diagram_of_areas": True, "crossings": speeds, "inertia": inertia, "irregularity": eps}
    row = DiagramRow(
        key="speed",
        title=_("Speed of the crank at the crossings"),
        label=_("crank speed"),
        unit="rpm",
        about="; ".join(f"S{k}: {written(RPM * value, 6)} rpm" for k, value in enumerate(speeds)),
        curves=(DiagramCurve("crossings", f"{written(inertia)} kg m², ε = {written(eps, 4)}", "blue", ""),),
        factor=RPM,
        si="rad/s",
        origin=sizing.speed if float(np.ptp(speeds)) < _SMALL_FLUCTUATION * sizing.speed else 0.0,
        kind="points",
        ticks="S",
        levels=_speed_levels(sizing),
    )
    return Diagram(figures, row.title, row.about, (row,))


# -- power flow ------------------------------------------------------------------------------------------------------------


def _power_flow(part: DiagramData, forces: JointForces | str) -> Diagram | str:
    """Every stream of power with its mean and its course over the cycle, in W."""
    if part.scene.areas is not None:
        return _("A diagram of areas has no power flow.")
    flow = None if part.sizing is None else part.sizing.power_flow
    if flow is None:
        return _no_cycle(part)
    powers = flow.along(np.clip(part.axis.taken, 0.0, part.scene.cycle))
    streams = [
        {
            "from": stream.source,
            "to": stream.target,
            "kind": stream.kind,
            "label": stream_name(stream, flow),
            "lost": stream.lost,
            "mean": stream.mean,
            "greatest": stream.greatest,
            "least": stream.least,
            "powers": power,
        }
        for stream, power in zip(flow.streams, powers, strict=True)
    ]
    if not any(stream["mean"] or stream["greatest"] or stream["least"] for stream in streams):
        return _("Nothing acts on the machine: no power flows.")
    totals = {"input": flow.input, "output": flow.output, "losses": flow.losses, "efficiency": flow.efficiency}
    return Diagram({"streams": streams, "places": places(flow), **totals}, form="power_flow")


def forces_of(part: DiagramData) -> JointForces | str:
    """The forces in the joints of the selected mechanism, or the reason why there are none."""
    from flywheel.motions.joint_forces import joint_forces, regime_forces

    scene, machine, sizing = part.scene, part.machine, part.sizing
    drawn = [mechanism.name for mechanism in scene.mechanisms if has_joints(mechanism)]
    if machine is None or not drawn:
        return _("The machine has no joints whose reactions are computed.")
    choice = part.view.get("mechanism")
    names = drawn if part.view.get("kind") == QUANTITIES[3] else [choice if choice in drawn else drawn[0]]
    try:
        if sizing is not None:
            return regime_forces(sizing, part.axis.taken, names)
        if len(drawn) < len(scene.mechanisms):
            return _("The reactions need a flywheel and a speed where a law moves with the linkages.")
        try:
            return joint_forces(machine, part.axis.taken)
        except SceneError:
            return joint_forces(machine, part.axis.taken, inertia=False)
    except SceneError as error:
        return str(error)


def _reactions(part: DiagramData, forces: JointForces | str) -> Diagram | str:
    """The force in every joint of a mechanism, and its driving action."""
    if isinstance(forces, str):
        return forces
    choice = part.view.get("mechanism")
    name = str(choice) if choice in forces.mechanisms else next(iter(forces.mechanisms))
    reactions, grid = forces.mechanisms[name].cleared(), part.axis.values
    if not forces.inertia and not any(map(np.any, reactions.forces.values())):
        return _("No speed is given, and so no inertia force; nothing else acts on the joints: add regime.speed.")
    linkage = reactions.poses.linkage
    drawn = [mechanism.name for mechanism in part.scene.mechanisms if has_joints(mechanism)]
    figures = {"mechanism": name, "mechanisms": drawn, "without_inertia": not forces.inertia}
    figures |= forms.force_figures(reactions, grid)
    rows = tuple(forms.force_rows(figures, linkage, grid, cyclic=part.scene.stroke is None))
    remarks = [_("Actions of the first body of each joint on the second.")]
    if linkage.sliding:
        remarks.append(_("Numbers along the curves are positions of the driver in mm."))
    if not forces.inertia:
        remarks.append(_("Without inertia forces, because no speed is given."))
    about = "; ".join(f"{row.title}: {row.about}" for row in rows)
    return Diagram(figures, _("Reactions in the joints"), about, rows, tuple(remarks), form="reactions")


# -- motion ----------------------------------------------------------------------------------------------------------------

_PARTS = {"": ("blue", "-", 2.0), "x": ("blue", "-", 2.0), "y": ("vermillion", "--", 2.0), "amount": ("ink", ":", 1.8)}


def _motion(part: DiagramData, forces: JointForces | str) -> Diagram | str:
    """Position, velocity or acceleration of the selected part, or the reaction of a joint, against the driver."""
    from flywheel.motions.curves import POINT, Moving

    scene = part.scene
    if scene.areas is not None:
        return _("A diagram of areas does not describe the motion.")
    moving = Moving(scene)
    driver, condition = _driver_motion(part, forces)
    curves = moving.places(part.axis.taken)[0]
    joints = {} if isinstance(forces, str) else _joints(forces)
    kinds = QUANTITIES if joints else QUANTITIES[:3]
    quantity = part.view.get("kind")
    quantity = quantity if quantity in kinds else QUANTITIES[1]
    choices = list(joints) if quantity == QUANTITIES[3] else list(curves)
    if not choices:
        return _("Nothing moves.")
    of = str(part.view.get("of"))
    of = of if of in choices else _first(scene, choices)
    reacts = bool(joints) or (not forces and any(map(has_joints, scene.mechanisms)))
    figures: dict[str, Any] = {"of": of, "quantity": quantity, "choices": choices, "reacts": reacts, "condition": condition}
    if quantity == QUANTITIES[3] and not isinstance(forces, str):
        force, unit = joints[of], "N"
        condition["without_inertia"] = not forces.inertia
        rows = {"x": force[0], "y": force[1], "amount": np.hypot(*force)}
    else:
        order = QUANTITIES.index(quantity)
        values = _derivative(curves[of].track, driver, order)
        figures["kind"] = kind = curves[of].kind
        rows = {"": values}
        if kind == POINT:
            rows = {"x": values[0], "y": values[1]} | ({"amount": np.hypot(*values)} if order else {})
        unit = _unit("rad" if kind == "angle" else "m", order, driver, scene)
    grid = part.axis.values
    figures["unit"] = unit
    figures["curves"] = [{"part": name, "values": values, **extremes(grid, values)} for name, values in rows.items()]
    return _motion_drawing(part, figures)


def _motion_drawing(part: DiagramData, figures: dict[str, Any]) -> Diagram:
    """The row of a motion, with the extremes of its curves."""
    of, quantity, unit = figures["of"], figures["quantity"], figures["unit"]
    titles = {
        "position": _("Position of {name}", name=of),
        "velocity": _("Velocity of {name}", name=of),
        "acceleration": _("Acceleration of {name}", name=of),
        "reaction": _("Reaction in {name}", name=of),
    }
    names = {"": of, "x": f"{of} x", "y": f"{of} y", "amount": _("amount")}
    curves, marks = [], []
    extremes = [curve[kind]["value"] for curve in figures["curves"] for kind in ("greatest", "least") if curve[kind]]
    largest = max(map(abs, extremes), default=0.0)
    far = bool(extremes) and (min(extremes) > _FAR_FROM_ZERO * largest or max(extremes) < -_FAR_FROM_ZERO * largest)
    factor, unit_drawn = scaled(unit, largest)
    sliding = part.scene.reduction_element == "slide"
    for k, curve in enumerate(figures["curves"]):
        curves.append(DiagramCurve(f"curves.{k}.values", names[curve["part"]], *_PARTS[curve["part"]]))
        for kind in ("greatest", "least"):
            extreme = curve[kind]
            if extreme is None:
                continue
            if curve["greatest"]["value"] != curve["least"]["value"]:
                words = f"{written(factor * extreme['value'], 4)} {unit_drawn}, {place_of(sliding, extreme['at'])}"
                marks.append(ExtremeMark(kind, extreme["at"], extreme["value"], words, curves[-1].colour))
    condition = _condition(part.scene, figures["condition"])
    row = DiagramRow(
        key="motion",
        title=titles[quantity],
        label=titles[quantity],
        unit=unit_drawn,
        factor=factor,
        si=unit,
        about="; ".join(f"{mark.words}" for mark in marks),
        curves=tuple(curves),
        height=4.4,
        zero=quantity != "position" and not far,
        marks=tuple(marks),
    )
    return Diagram(figures, row.title, f"{condition} {row.about}.", (row,), (condition,))


def _condition(scene: Scene, condition: Mapping[str, Any]) -> str:
    """Motion of the driver, in words."""
    speed = condition["speed"]
    if condition.get("without_inertia"):
        return _("Without inertia forces, because no speed is given.")
    if condition["kind"] == "steady":
        return _("In the steady regime, at {speed} rpm in the mean of extremes.", speed=written(speed * RPM))
    if condition["kind"] == "unit":
        return _("Per unit of the driver, because no speed is given.")
    sliding = scene.reduction_element == "slide"
    pace = f"{written(speed)} m/s" if sliding else f"{written(speed * RPM)} rpm"
    if condition["acceleration"]:
        rate = f"{written(condition['acceleration'])} {'m/s²' if sliding else 'rad/s²'}"
        return _("At {speed}, with an acceleration of {acceleration}.", speed=pace, acceleration=rate)
    return _("At a constant {speed}.", speed=pace)


def _derivative(track: Track, driver: DriverMotion, order: int) -> Array:
    """The place itself, its velocity g q̇ or its acceleration g q̈ + g' q̇²; g or g' where the driver has no speed."""
    if driver.rate is None or driver.acceleration is None or not order:
        return track[order]
    return track.rate * driver.rate if order == 1 else track.rate * driver.acceleration + track.slope * driver.rate**2


def _unit(length: str, order: int, driver: DriverMotion, scene: Scene) -> str:
    """The unit of a derivative of an angle or a length: by time, or by the driver's coordinate."""
    if not order:
        return length
    if driver.rate is not None:
        return f"{length}/s" + "²" * (order == 2)
    if scene.reduction_element == "slide":
        return {("m", 1): "1", ("m", 2): "1/m", ("rad", 1): "rad/m", ("rad", 2): "rad/m²"}[length, order]
    return f"{length}/rad" + "²" * (order == 2)


def _driver_motion(part: DiagramData, forces: JointForces | str) -> tuple[DriverMotion, dict[str, Any]]:
    """Motion of the driver: that of the forces; the steady regime; the scene's speed; or per unit."""
    from flywheel.motions import driver as courses
    from flywheel.motions.motion import DriverMotion, regime_motion

    scene, q = part.scene, part.axis.taken
    if part.sizing is not None and part.machine is not None:
        motion = regime_motion(part.sizing, q) if isinstance(forces, str) else forces.motion
        return DriverMotion(q, None, motion.omega, motion.alpha), {"kind": "steady", "speed": part.sizing.speed}
    speed = scene.speed if scene.stroke is None else scene.stroke.speed
    if speed:
        course = courses.constant_speed(scene, "scene", courses.DRIVER)
        acceleration = 0.0 if scene.stroke is None else scene.stroke.acceleration
        return course.at(q), {"kind": "constant", "speed": speed, "acceleration": acceleration}
    return DriverMotion(q), {"kind": "unit", "speed": None}


def _joints(forces: JointForces) -> dict[str, Array]:
    """The whole force of every joint (2, n), by its name; of several mechanisms with the mechanism's before it."""
    several = len(forces.mechanisms) > 1
    return {
        f"{mechanism}.{joint}" if several else joint: force
        for mechanism, reactions in forces.mechanisms.items()
        for joint, force in without_noise(reactions.forces).items()
    }


def _first(scene: Scene, offers: Iterable[str]) -> str:
    """Default curve where nothing is chosen: the first of the mechanisms', else the last that is no point."""
    names = list(offers)
    usual = {name for mechanism in scene.mechanisms for name in KINDS[mechanism.type].default_curves}
    first = [name for name in names if name.rpartition(".")[2] in usual]
    bodies = [name for name in names if "." not in name]
    return (first or bodies[::-1] or names)[0]


# -- all of them -----------------------------------------------------------------------------------------------------------


class DiagramKind(NamedTuple):
    """An existing diagram: its title in the language in use, its maker, and its column in the picture of a sizing."""

    title: Callable[[], str]
    make: Callable[[DiagramData, JointForces | str], Diagram | str]
    column: int | None = None
    rows: tuple[str, ...] = ()  # keys of its rows
    suits: Callable[[Scene], bool] = lambda scene: scene.single_stroke is None  # whether a scene has what it is of


DIAGRAMS: dict[str, DiagramKind] = {
    "moment": DiagramKind(lambda: _("Turning moment"), _moment, 0, ("moment", "work")),
    "inertia": DiagramKind(lambda: _("Reduced inertia by body"), _inertia, 1, ("inertia",)),
    "wittenbauer": DiagramKind(lambda: _("Wittenbauer's diagram"), _wittenbauer, 1, ("wittenbauer",)),
    "speed": DiagramKind(lambda: _("Speed over the cycle"), _speed, 0, ("speed",)),
    "single_stroke": DiagramKind(lambda: _("One stroke over time"), forms.stroke_diagram, suits=forms.has_stroke),
    "servo": DiagramKind(lambda: _("Area of the servo drive"), forms.servo_diagram, 0, ("servo",), forms.has_servo),
    "power_flow": DiagramKind(lambda: _("Power flow"), _power_flow),
    "motion": DiagramKind(lambda: _("Motion"), _motion),
    "reactions": DiagramKind(lambda: _("Reactions in the joints"), _reactions),
}
"""Every diagram of a scene, in the order of the live page."""


def made(part: DiagramData, key: str, forces: JointForces | str = "") -> Diagram | str:
    """A diagram, or why there is none."""
    try:
        return DIAGRAMS[key].make(part, forces)
    except SceneError as error:
        return str(error)
