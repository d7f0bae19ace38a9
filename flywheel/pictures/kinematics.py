"""Pictures of a motion: position, velocity and acceleration of chosen curves, stacked over the driver or over time.

Angles have a column of panels, lengths another; x of a point is solid, y dashed. Extremes are marked with value and
place; where a law switches a curve is broken, so that a jump is not joined. Courses: the machine reduced to its driver
over the driver, and a motion followed over time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from flywheel.language import message
from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.machine.reactions import close_positions
from flywheel.motions.curves import ANGLE, POINT, WAY, MotionCurve, Moving
from flywheel.motions.driver import TIME
from flywheel.motions.kinematics import Kinematics, motion
from flywheel.motions.motion import Samples, Transient, sampled
from flywheel.numerics.faults import Fault, SceneError
from flywheel.pictures import figures, noun, written
from flywheel.pictures.figures import BLACK, BLUE, BODIES, GREEN, GREY, ORANGE, PURPLE, VERMILLION
from flywheel.regime import constant_speed
from flywheel.regime.state import MachineState, at_speed, conditions, reduce
from flywheel.scene.scene import Scene
from flywheel.tables.rows import MOST_PARTS, RPM, largest_parts
from flywheel.tables.scene import part_name

Array = NDArray[np.float64]

_MOST_CURVES = 8  # curves of a column, unless they were named
_NAMED = 4  # lines in a panel whose own extremes are written beside them; of more, those of the panel alone
_DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5, 1, 1.5)), (0, (1, 1)))
_POINTS, _BESIDE = 1201, 1e-9  # places of a curve, and of the axis: how far beside a jump
_SAMPLES_APART = 8.0  # times its neighbours' steps: a change that is a jump
_VAGUE = 1e-4  # of the axis: an extreme that may lie so far aside is stated as one about there
_RESTS = 1e-12  # of the largest value of a panel: an extreme below it is none


class PlottedLine(NamedTuple):
    """One line of a panel: its curve and component, colour and dashes, its places on the axis and its values.

    They are broken by NaN if it jumps.
    """

    curve: str
    component: str
    colour: str
    dashes: Any
    x: Array
    y: Array

    @property
    def label(self) -> str:
        """Label of the curve."""
        return f"{self.curve}.{self.component}" if self.component else self.curve


def plot(kinematics: Kinematics, path: str | Path) -> None:
    """Draws a motion into a file: PNG, SVG or PDF, by its ending; always the same for the same input.

    Raises ValueError for any other ending, SceneError for fewer than two positions, OSError where it cannot be written.
    """
    figures.save(draw(kinematics), path)


def draw(kinematics: Kinematics) -> Figure:
    """The figure: three panels for angles and three for lengths, as far as there are such curves."""
    if np.unique(kinematics.axis).size < 2:
        raise SceneError([Fault("points", "a single position", "two at least, for a curve between them")])
    curves_drawn, left_out = selection(list(kinematics.curves.values()))
    columns = [[curve for curve in curves_drawn if (curve.kind == ANGLE) == turning] for turning in (True, False)]
    columns = [column for column in columns if column]
    title = ": ".join(
        part
        for part in (kinematics.scene.title or "", _("motion {condition}", condition=message(kinematics.condition)))
        if part
    )
    heading = wrap(title, 62 * len(columns)) + [_("({number} more curves can be drawn by name)", number=left_out)] * bool(
        left_out
    )
    made = figures.figure(6.8 * len(columns) + 1.2 * (len(columns) == 1), 9.6, "\n".join(heading))
    kinematics, columns = close(kinematics, columns)
    panels = made.subplots(3, len(columns), sharex=True, squeeze=False)
    scale, label = axis_of(kinematics)
    for column, curves in zip(panels.T, columns, strict=True):
        for order, panel in enumerate(column):
            draw_panel(panel, kinematics, curves, order, scale)
        column[-1].set_xlabel(label)
        legend(column[0], kinematics, curves)
    figures.lay_out(made)
    for column, curves in zip(panels.T, columns, strict=True):
        for order, panel in enumerate(column):
            _mark_extremes(panel, kinematics, curves, order, scale)
    return made


def close(kinematics: Kinematics, columns: list[list[MotionCurve]]) -> tuple[Kinematics, list[list[MotionCurve]]]:
    """The same motion between its first and last place at many places, and on both sides of every switch."""
    course = kinematics.course
    of = kinematics.t if course.variable == TIME else kinematics.q
    assert of is not None
    low, high = float(of.min()), float(of.max())
    at = kinematics.breakpoints if kinematics.over == course.variable else np.array([])
    beside = _BESIDE * (high - low)
    variable = np.unique(np.concatenate((of, np.linspace(low, high, _POINTS), at - beside, at + beside)))
    variable = np.clip(variable, low, high - beside)  # at its very end a cycle may have begun anew
    driver = course.at(np.unique(variable))
    at_states = Moving(kinematics.scene).plain(driver, [curve.name for column in columns for curve in column])

    def along(curve: MotionCurve) -> MotionCurve:
        position, velocity, acceleration = at_states[curve.name]
        return curve._replace(position=position, velocity=velocity, acceleration=acceleration)

    many = replace(kinematics, t=driver.t, q=driver.q, rate=driver.rate, acceleration=driver.acceleration)
    many.__dict__["_survey"] = kinematics.__dict__["_survey"]  # what is known of the whole motion is not found again
    return many, [[along(curve) for curve in column] for column in columns]


def selection(curves: Sequence[MotionCurve]) -> tuple[list[MotionCurve], int]:
    """The curves drawn: all that were named, else the moving bodies and slides; and the number left out."""
    if len(curves) <= _MOST_CURVES:
        return list(curves), 0
    moving = [c for c in curves if c.kind != POINT and not c.name.endswith(".angle") and np.ptp(c.velocity) > 0.0]
    chosen = [c for turning in (True, False) for c in [c for c in moving if (c.kind == ANGLE) == turning][:_MOST_CURVES]]
    chosen = chosen or list(curves[:_MOST_CURVES])
    return chosen, len(curves) - len(chosen)


def axis_of(kinematics: Kinematics) -> tuple[float, str]:
    """Factor of the axis, and its label with the unit."""
    axis = kinematics.axis
    if kinematics.over == "time" and kinematics.t is not None:
        return (1000.0, _("time, ms")) if float(np.ptp(axis)) < 0.1 else (1.0, _("time, s"))
    if kinematics.sliding:
        return (
            (1000.0, _("position of the driver, mm"))
            if float(np.abs(axis).max()) < 1.0
            else (1.0, _("position of the driver, m"))
        )
    return 180.0 / np.pi, _("driver's angle φ, deg")


def _turns(kinematics: Kinematics) -> bool:
    """Tests whether the axis counts degrees of a driver that turns."""
    return not kinematics.sliding and not (kinematics.over == "time" and kinematics.t is not None)


def scale_of(kinematics: Kinematics, curves: Sequence[MotionCurve], order: int) -> tuple[float, str]:
    """Factor of values, and the label of their panel: order 0 for positions, 1 velocities, 2 accelerations."""
    turning = curves[0].kind == ANGLE
    by = "x" if kinematics.sliding else "φ"
    if turning and order == 0:
        return 180.0 / np.pi, _("angle, deg")
    if kinematics.rate is None:
        prime = ("", "'", "''")[order]
        if turning:
            unit = ("", "rad/m", "rad/m²")[order] if kinematics.sliding else "1"
            return 1.0, f"θ{prime} = {('', 'dθ/d', 'd²θ/d')[order]}{by}{'²' * (order == 2)}, {unit}"
        largest = max(float(np.nanmax(np.abs(_figure(curve, order)))) for curve in curves)
        factor, length = (1000.0, "mm") if largest < 1.0 and not (kinematics.sliding and order) else (1.0, "m")
        if order == 0:
            return factor, _("displacement, {length}", length=length)
        unit = ("", "1", "1/m")[order] if kinematics.sliding else f"{length}/rad{'²' * (order == 2)}"
        return factor, f"s{prime} = {('', 'ds/d', 'd²s/d')[order]}{by}{'²' * (order == 2)}, {unit}"
    if turning:
        return 1.0, ("", _("angular velocity, rad/s"), _("angular acceleration, rad/s²"))[order]
    largest = max(float(np.nanmax(np.abs(_figure(curve, order)))) for curve in curves)
    factor, length = (1000.0, "mm") if largest < (1.0 if order == 0 else 0.1) else (1.0, "m")
    return factor, (
        _("displacement, {length}", length=length),
        _("velocity, {length}/s", length=length),
        _("acceleration, {length}/s²", length=length),
    )[order]


def _figure(curve: MotionCurve, order: int) -> Array:
    return (curve.position, curve.velocity, curve.acceleration)[order]


def lines(kinematics: Kinematics, curves: Sequence[MotionCurve], order: int) -> Iterator[PlottedLine]:
    """The lines of a panel, in SI: a point has two, x and y."""
    axis = kinematics.axis
    rising = np.argsort(axis, kind="stable") if kinematics.course.variable != TIME else np.arange(axis.size)
    for k, curve in enumerate(curves):
        values = _figure(curve, order)
        colour, dashes = BODIES[k % len(BODIES)], _DASHES[k // len(BODIES) % len(_DASHES)]
        for i, part in enumerate("xy" if curve.kind == POINT else ("",)):
            y = values[i] if part else values
            line = broken(axis[rising], y[rising], kinematics.breakpoints)
            yield PlottedLine(curve.name, part, colour, "--" if part == "y" else dashes, *line)


def broken(x: Array, y: Array, breakpoints: Array) -> tuple[Array, Array]:
    """A curve with NaN between two samples where it jumps: across a breakpoint, by far more than its neighbours' steps."""
    steps = np.abs(np.diff(y))
    usual = np.maximum(np.append(steps[1:], 0.0), np.append(0.0, steps[:-1]))
    low, high = np.minimum(x[:-1], x[1:]), np.maximum(x[:-1], x[1:])
    near = 1e-9 * float(np.ptp(x))
    across = np.zeros(steps.size, dtype=bool)
    for at in breakpoints:
        across |= (low - near <= at) & (at <= high + near)
    jumps = np.flatnonzero(across & (steps > _SAMPLES_APART * usual) & (steps > 1e-9 * np.abs(y).max())) + 1
    return np.insert(x, jumps, np.nan), np.insert(y, jumps, np.nan)


# -- one panel -------------------------------------------------------------------------------------------------------


def draw_panel(panel: Axes, kinematics: Kinematics, curves: Sequence[MotionCurve], order: int, scale: float) -> None:
    """The lines of curves, in an order of derivative, with switches and standstills."""
    factor, label = scale_of(kinematics, curves, order)
    figures.name_axes(panel, "", "", label)
    for at in kinematics.breakpoints:
        panel.axvline(scale * at, color=GREY, lw=0.7, ls=":", zorder=1.2)
    for k, curve in enumerate(curves):
        for at in kinematics.dead_centres.get(curve.name, ()):
            panel.axvline(scale * float(at), color=BODIES[k % len(BODIES)], lw=0.7, ls="-.", zorder=1.3)
    for line in lines(kinematics, curves, order):
        panel.plot(scale * line.x, factor * line.y, color=line.colour, ls=line.dashes, lw=1.6, zorder=3)
    ticks(panel, kinematics)
    if order:
        panel.axhline(0.0, color=BLACK, lw=0.6, zorder=1.5)
    panel.margins(y=0.16)


def ticks(panel: Axes, kinematics: Kinematics) -> None:
    """Limits of the axis, and ticks at parts of a turn where it counts degrees."""
    scale = axis_of(kinematics)[0]
    low, high = scale * float(np.min(kinematics.axis)), scale * float(np.max(kinematics.axis))
    panel.set_xlim(low, high + 2 * _BESIDE * (high - low))  # the whole turn has its tick
    if _turns(kinematics) and high - low >= 180.0:
        panel.xaxis.set_major_locator(MultipleLocator(45.0 * ceil((high - low) / 540.0)))


def legend(panel: Axes, kinematics: Kinematics, curves: Sequence[MotionCurve], *, beside: bool = False) -> None:
    """Names of the lines above a panel, or beside it, with the meaning of the thin lines."""
    slides = {of: f"{other} ({of})" for other, of in kinematics.other_names.items() if "." not in other and "." not in of}
    bodies = {curve.name: slides.get(curve.name) for curve in curves if curve.kind == WAY}
    handles = [
        panel.plot([], [], color=line.colour, ls=line.dashes, lw=1.6, label=bodies.get(line.curve) or line.label)[0]
        for line in lines(kinematics, curves, 0)
    ]
    if any(np.size(kinematics.dead_centres.get(curve.name, ())) for curve in curves):
        handles += panel.plot([], [], color=GREY, lw=0.9, ls="-.", label=_("dead centres (in its colour)"))
    if kinematics.breakpoints.size:
        handles += panel.plot([], [], color=GREY, lw=0.9, ls=":", label=_("something switches"))
    if beside:
        panel.legend(handles=handles, loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8.5, frameon=False)
        return
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = max(min(len(handles), int(78 / (longest + 6))), 1)
    panel.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.01), ncols=columns, fontsize=8.5, frameon=False)


# -- extremes --------------------------------------------------------------------------------------------------------


def _mark_extremes(panel: Axes, kinematics: Kinematics, curves: Sequence[MotionCurve], order: int, scale: float) -> None:
    """Dots at extremes, with value and place if there are few lines; else those of the panel alone."""
    factor = scale_of(kinematics, curves, order)[0]
    label = axis_of(kinematics)[1]
    unit = "°" if _turns(kinematics) else f" {label.rpartition(', ')[2]}"
    drawn = list(lines(kinematics, curves, order))
    largest = max(float(np.nanmax(np.abs(line.y))) for line in drawn)
    low, high = float(np.min(kinematics.axis)), float(np.max(kinematics.axis))
    quantity = ("position", "velocity", "acceleration")[order]
    marks = []
    for line in drawn:
        if np.nanmax(line.y) - np.nanmin(line.y) > _RESTS * largest:
            mine = [e for e in kinematics.extremes[line.curve] if (e.quantity, e.component) == (quantity, line.component)]
            marks += [(extreme, line.colour) for extreme in mine if low <= extreme.at <= high]
    if len(drawn) > _NAMED and marks:
        ordered = sorted(marks, key=lambda mark: mark[0].value)
        marks = [ordered[0], ordered[-1]]
    texts, spots = [], np.array([(scale * mark.at, factor * mark.value) for mark, colour in marks]).reshape(-1, 2)
    for (x, y), (mark, colour) in zip(spots, marks, strict=True):
        panel.plot(x, y, "o", color=colour, ms=4.5, zorder=4)
        rest = max(factor * mark.error, _RESTS * factor * largest)
        value = written(0.0 if abs(y) <= rest else y, 5, rest)
        vague = _("about") + " " if mark.at_error > _VAGUE * (high - low) else ""
        at = 0.0 if abs(mark.at) <= min(mark.at_error, _VAGUE * (high - low)) else x
        place = vague + (written(round(at, 1), 5) if _turns(kinematics) else written(at, 4))
        texts.append(
            panel.text(0.0, 0.0, _("{value} at {place}", value=value, place=f"{place}{unit}"), fontsize=8.0, zorder=5)
        )
        texts[-1].set_color(figures.shade(colour, -0.2))
    figures.settle(panel, texts, spots, [np.stack((scale * line.x, factor * line.y)) for line in drawn])


# -- the reduced machine ------------------------------------------------------------------
_COURSE_POINTS = 721
_SHARES = np.arange(1, 16) / 16  # of the way between two landmarks
_JUMP, _CORNER, _DOZEN = 1e-6, 8.0, 12
_NO_PART = 1e-12  # of the largest: parts below it are none
_ROUNDED = 1e-14  # N m, N, kg m² or kg: rounding makes as much of nothing


def plot_reduction(scene: Scene, path: str | Path, *, of: Sequence[str] = (), speed: float | None = None) -> None:
    """Draws the machine of a scene, reduced to its driver, over its cycle or stroke: PNG, SVG or PDF.

    Args:
        scene: any with a machine.
        path: the picture's file; the same scene gives the same file every time.
        of: bodies, slides, joints or points whose influence coefficients are drawn; those of bodies and slides if empty.
        speed: rad/s or m/s, for laws that depend on it; the scene's, or the machine's own, if None.

    Raises:
        SceneError: for a scene without a machine, a name that does not exist, an unknown speed.
        ValueError: for any other file ending.

    """
    figures.save(draw_reduction(scene, of=of, speed=speed), path)


def draw_reduction(scene: Scene, *, of: Sequence[str] = (), speed: float | None = None) -> Figure:
    """The figure, not yet written anywhere."""
    machine = at_speed(scene, speed)
    marks = machine.landmarks
    fine = marks[:-1, None] + np.diff(marks)[:, None] * _SHARES  # a narrow feature lies between its own landmarks
    phi = np.unique(np.concatenate((close_positions(machine, _COURSE_POINTS), machine.scene.origin + fine.ravel())))
    pace, balance = constant_speed.operating_point(machine, speed)
    state = reduce(machine, phi, balance=balance, speed=pace)
    gains = motion(machine.scene, of=of)
    curves, left_out = selection(list(gains.curves.values()))
    columns = [[curve for curve in curves if (curve.kind == ANGLE) == turning] for turning in (True, False)]
    columns = [column for column in columns if column and any(np.any(curve.velocity) for curve in column)]
    subtitle = message(conditions(machine, pace if machine.depends_on_speed else None))
    reduced = _("reduced to the slide") if scene.reduction_element == "slide" else _("reduced to the crank")
    title = ": ".join(part for part in (machine.scene.title or "", reduced) if part)
    made = figures.figure(9.6, 2.9 * (2 + len(columns)) + 0.6, "\n".join((title, *wrap(subtitle, 90))))
    panels = made.subplots(2 + len(columns), 1, sharex=True)
    scale, label = axis_of(gains)
    inner = switches(machine, phi, (state.moment, *state.moment_parts.values(), state.inertia, state.slope))
    sliding = gains.sliding
    names = ("m*, kg", "F*, N") if sliding else ("I*, kg m²", "M*, N m")
    _draw_parts(panels[0], machine, phi, state, state.inertia, state.inertia_parts, names[0], scale)
    _draw_parts(panels[1], machine, phi, state, state.moment, state.moment_parts, names[1], scale)
    for panel, column in zip(panels[2:], columns, strict=True):
        draw_panel(panel, gains, column, 1, scale)
        legend(panel, gains, column, beside=True)
    for panel in panels:
        for at in inner:
            panel.axvline(scale * at, color=GREY, lw=0.7, ls=":", zorder=1.2)
        ticks(panel, gains)
    if inner.size:
        panels[1].plot([], [], color=GREY, lw=0.9, ls=":", label=_("a load or a law switches"))
    if panels[1].get_legend_handles_labels()[1]:
        panels[1].legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8.5, frameon=False)
    further = " " + _("({number} more coefficients can be drawn by name)", number=left_out)
    panels[-1].set_xlabel(label + (further if left_out else ""))
    return made


def switches(machine: Machine, phi: Array, values: Iterable[Array]) -> Array:
    """Breakpoints (rad or m) at which a figure jumps or has a corner; of more than a dozen those at which one jumps."""
    edges = machine.scene.origin + machine.switches[1:-1]
    at = np.searchsorted(phi, edges)  # of three neighbours, before, at and beyond an edge, the middle one
    jumps, corners = np.zeros(edges.size, dtype=bool), np.zeros(edges.size, dtype=bool)
    for y in values if edges.size else ():
        size = float(np.abs(y).max())
        jumps |= np.abs(y[at] - y[at - 1]) > _JUMP * size
        steep = np.diff(y) / np.diff(phi)
        before, after = steep[np.maximum(at - 2, 0)], steep[np.minimum(at + 1, steep.size - 1)]
        bends = np.abs(before - steep[np.maximum(at - 3, 0)]) + np.abs(steep[np.minimum(at + 2, steep.size - 1)] - after)
        corners |= np.abs(after - before) > _CORNER * bends + _JUMP * size / float(np.ptp(phi))
    corners |= jumps
    return edges[corners if np.count_nonzero(corners) <= _DOZEN else jumps]


def _draw_parts(
    panel: Axes,
    machine: Machine,
    phi: Array,
    state: MachineState,
    total: Array,
    parts: Mapping[str, Array],
    label: str,
    scale: float,
) -> None:
    """The sum in black with its extremes in the legend, and the share of every body or load."""
    figures.name_axes(panel, "", "", label)
    edges = machine.scene.origin + machine.switches
    size = max((float(np.abs(part).max()) for part in parts.values()), default=0.0)
    if size <= _ROUNDED:
        symbol = label.partition(",")[0]
        why = _("{symbol} = 0: no load, weight or drive acts here.", symbol=symbol)
        if symbol in ("I*", "m*"):
            why = _("{symbol} = 0: nothing has mass or inertia.", symbol=symbol)
        panel.text(0.5, 0.5, why, ha="center", va="center", transform=panel.transAxes, color=GREY)
        panel.set_yticks([])
        return
    some = {name: part for name, part in parts.items() if float(np.abs(part).max()) > _NO_PART * size}
    some = largest_parts(some, f"{len(some) - MOST_PARTS + 1} others")
    alone = len(some) == 1 and all(np.array_equal(total, part) for part in some.values())
    for k, (name, part) in enumerate(() if alone else some.items()):
        x, y = broken(phi, part, edges)
        words = part_name(machine.scene, name)
        panel.plot(scale * x, y, color=BODIES[k % len(BODIES)], lw=1.3, label=words if words != name else noun(name))
    x, y = broken(phi, total, edges)
    symbol = label.partition(",")[0]
    least, most = (written(value, 4) for value in (float(total.min()), float(total.max())))
    whole = _("{symbol}, from {least} to {most}", symbol=symbol, least=least, most=most)
    panel.plot(scale * x, y, color=BLACK, lw=1.8, label=whole)
    panel.axhline(0.0, color=BLACK, lw=0.6, zorder=1.5)
    panel.margins(y=0.1)
    panel.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8.5, frameon=False)


# -- over time ------------------------------------------------------------------

_TIMES, _FEWEST, _MOST_WITHIN = 4000, 3, 200  # in all, and within a step of the motion


def plot_transient(transient: Transient, path: str | Path) -> None:
    """Draws a motion into a file: PNG, SVG or PDF, by its ending; always the same for the same input.

    Raises ValueError for any other ending, OSError where the file cannot be written.
    """
    figures.save(draw_transient(transient), path)


def draw_transient(transient: Transient) -> Figure:
    """The figure with its panels, not yet written anywhere."""
    samples = drawn(transient)
    panels = [_draw_speed, _draw_torque, _draw_energy] + ([_draw_current] if samples.current is not None else [])
    made = figures.figure(10.0, 2.9 * len(panels), transient.scene.title or "")
    axes = made.subplots(len(panels), 1, sharex=True)
    for axis, panel in zip(axes, panels, strict=True):
        panel(axis, transient, samples)
        axis.grid(visible=True, color="#E5E5E5")
        axis.margins(x=0.01)
    words = message(transient.ended)
    axes[0].set_title("\n".join(wrap(words[0].upper() + words[1:], 100)), parse_math=False)
    axes[-1].set_xlabel(_("time, s"))
    return made


def drawn(transient: Transient) -> Samples:
    """The motion in every step, at both its ends and between, so that a jump stays a vertical line."""
    trail = transient.motion.trail
    assert trail is not None
    count = int(np.clip(_TIMES // len(trail.stretches), _FEWEST, _MOST_WITHIN))
    return sampled(trail, *trail.within(np.arange(1, count + 1) / (count + 1)))


def _draw_speed(axis: Axes, transient: Transient, samples: Samples) -> None:
    sliding = transient.scene.reduction_element == "slide"
    axis.plot(samples.t, samples.omega, color=BLUE, lw=1.6)
    axis.set_ylabel(_("speed, m/s") if sliding else _("crank speed, rad/s"))
    if not sliding:
        there_and_back = (lambda speed: np.multiply(speed, RPM), lambda turns: np.divide(turns, RPM))
        axis.secondary_yaxis("right", functions=there_and_back).set_ylabel(_("crank speed, rpm"))
    steady, when = transient.regime_speed, transient.time_to_regime
    if steady is None:
        return
    speed, unit = (steady, "m/s") if sliding else (RPM * steady, "rpm")
    label = _("regime, mean over time: {speed} {unit}", speed=written(speed), unit=unit)
    axis.axhline(steady, color=GREY, lw=1.0, ls="--", label=label)
    if when is not None and when > 0.0:
        axis.plot(
            [when], [0.95 * steady], "o", color=VERMILLION, ms=6, label=_("95 % of it after {time} s", time=written(when, 4))
        )
    axis.legend(loc="best", fontsize=9)


def _draw_torque(axis: Axes, transient: Transient, samples: Samples) -> None:
    sliding = transient.scene.reduction_element == "slide"
    ratio = 1.0 if transient.scene.drive is None else transient.scene.shafts.get(transient.scene.drive.on, 1.0)
    name = _("F* on the driver") if sliding else _("M* on the crank")
    name += ", " + _("after losses") if np.any(samples.loss) else ""
    axis.plot(samples.t, samples.moment, color=BLACK, lw=1.0, label=name)
    if transient.scene.drive is not None:
        drive = _("drive") if ratio == 1.0 else _("drive, on the crank")
        axis.plot(samples.t, samples.drive * ratio, color=ORANGE, ls="--", lw=1.6, label=drive)
    axis.axhline(0.0, color=GREY, lw=0.8)
    axis.set_ylabel(_("force, N") if sliding else _("torque, N m"))
    axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=9, frameon=False)


def _draw_energy(axis: Axes, transient: Transient, samples: Samples) -> None:
    axis.plot(samples.t, samples.kinetic, color=GREEN, lw=1.6)
    axis.set_ylabel(_("kinetic energy, J"))


def _draw_current(axis: Axes, transient: Transient, samples: Samples) -> None:
    assert samples.current is not None
    axis.plot(samples.t, samples.current, color=PURPLE, lw=1.4)
    axis.set_ylabel(_("current, A"))
