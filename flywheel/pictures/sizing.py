"""Pictures of a sizing as the books draw them: turning moment, its work, reduced inertia, Wittenbauer's loop, speed.

A diagram of areas, which has no machine and no angles, has bars, sums and speeds at the crossings instead. Curves are
sampled piece by piece, so that a jump stays a vertical line. Names inside a panel are put in place when the figure has its
layout: a panel's function returns what is left to do then.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import floor, log10
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from flywheel import language, pictures
from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.pictures import figures
from flywheel.pictures.figures import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, VERMILLION, name_axes, say, told
from flywheel.pictures.samples import Loop, Samples, bodies, crossing_speeds, loop, roomiest, sampled
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.sizing.results import Sizing, drive_moment
from flywheel.tables.flywheels import candidates, inertia_errors, limit_names, work_error
from flywheel.tables.power import balance_error
from flywheel.tables.rows import RPM, WIDTH, irregularity, printable

Array = NDArray[np.float64]
Later = Callable[[], None] | None

PANELS = ("moment", "work", "inertia", "wittenbauer", "speed")
"""The panels of a sizing, in the order in which a solution goes."""

_SIZES = {"moment": (7.2, 4.4), "work": (7.2, 3.5), "inertia": (7.2, 3.7), "wittenbauer": (7.2, 5.8), "speed": (7.2, 3.7)}
_BODIES = (SKY, ORANGE, GREEN, "#F0E442", PURPLE, BLUE, VERMILLION, "#BBBBBB")
_HATCHES = ("//", "\\\\", "--", "xx", "||", "++", "////", "----")
_LINES = {
    "exact": (BLUE, "-", 2.4),
    "given": (BLUE, "-", 2.4),
    "approximate": (VERMILLION, "--", 1.8),
    "inertia_torque_flywheel": (GREEN, ":", 2.2),
}
_OFF_THE_SCALE = 6.0  # times the greatest M*: curves beyond it are named alone
_FIGURES = 5  # digits in pictures
_ANGLE = 1e-9  # deg: error of an angle as it is told


def plot(sizing: Sizing, path: str | Path) -> None:
    """Draw a sizing into a file: PNG (1600 x 1600 pixels), SVG or PDF, as its ending says; the same one every time.

    Raises ValueError for any other ending, OSError where the file cannot be written.
    """
    with rc_context(STYLE):
        figures.save(draw(sizing), path)


def draw(sizing: Sizing) -> Figure:
    """The figure with its five panels, not yet written anywhere."""
    made = figures.figure(12.8, 12.8, headline(sizing), apart=0.1)
    halves = GridSpec(1, 2, figure=made)
    columns = (halves[0], (23, 18, 19), ("moment", "work", "speed")), (halves[1], (23, 37), ("inertia", "wittenbauer"))
    spots: dict[str, Any] = {}
    for column, heights, kinds in columns:
        places = column.subgridspec(len(kinds), 1, height_ratios=heights)
        spots |= {kind: places[k] for k, kind in enumerate(kinds)}
    _fill(sizing, made, {kind: made.add_subplot(spots[kind]) for kind in PANELS})
    return made


def panel(sizing: Sizing, kind: str, *, form: str = "screen", name: str = "") -> str:
    """One panel as an SVG element with a title and a description, in the language in use.

    Args:
        sizing: what `flywheel.size` gives.
        kind: one of `PANELS`.
        form: "screen", in colours, or "print", in greys, dashes and hatches.
        name: what its ids begin with, unique in the page that it stands in; the kind if empty.

    """
    if kind not in PANELS:
        raise ValueError(f"found the panel {kind!r}, expected one of {', '.join(PANELS)}")
    with rc_context(STYLE), pictures.form(form):
        made = figures.figure(*_SIZES[kind], "")
        axes = made.subplots()
        _fill(sizing, made, {kind: axes})
        return figures.svg(made, name or kind, axes.get_title(), description(sizing, kind))


def headline(sizing: Sizing) -> str:
    """The result in a line, below the scene's title (cut where it is too long for a picture's heading)."""
    scene, wheel = sizing.scene, sizing.flywheel
    speed, asked = told(sizing.speed * RPM, 6), told(scene.irregularity or 0.0, 10)
    on = _("the crank") if wheel.on == "crank" else _("shaft {name}", name=wheel.on)
    if scene.inertia is not None:
        eps = told(sizing.simulation.irregularity) if sizing.simulation is not None else "?"
        what = _(
            "given flywheel {inertia} kg m² on {shaft}, crank at {speed} rpm: irregularity {eps}",
            inertia=told(scene.inertia, 6),
            shaft=on,
            speed=speed,
            eps=eps,
        )
    elif scene.limits and wheel.needed is False:
        what = _("no flywheel needed for its limits, crank at {speed} rpm", speed=speed)
    elif scene.limits and sizing.binding is not None:
        what = _(
            "flywheel {inertia} kg m² on {shaft}, which {limit} decides, crank at {speed} rpm",
            inertia=told(wheel.exact or 0.0, 6, inertia_errors(sizing).exact),
            shaft=on,
            limit=limit_names()[sizing.binding],
            speed=speed,
        )
    elif wheel.needed is False:
        what = _("no flywheel needed for irregularity {eps}, crank at {speed} rpm", eps=asked, speed=speed)
    else:
        inertia = told(wheel.exact or 0.0, 6, inertia_errors(sizing).exact)
        what = _(
            "flywheel {inertia} kg m² on {shaft} for irregularity {eps}, crank at {speed} rpm",
            inertia=inertia,
            shaft=on,
            eps=asked,
            speed=speed,
        )
    title = " ".join(printable(scene.title or "").split())
    title = title if len(title) <= WIDTH else title[: WIDTH - 1] + "…"
    return f"{title}\n{what}" if title else what


# -- what panels share ------------------------------------------------------------------------------------------------


class View(NamedTuple):
    """A sizing with its curves: those of the areas, and those along the motion where torques depend on speed."""

    sizing: Sizing
    machine: Machine
    cycle: Cycle  # of the areas
    samples: Samples
    motion: Cycle
    along: Samples

    @property
    def at_constant_speed(self) -> bool:
        """Whether the areas are those of a constant speed, and the motion has others."""
        return self.sizing.constant is not None

    @property
    def degrees(self) -> Array:
        """The crank's angle at the samples."""
        return np.degrees(self.samples.phi)


def view(sizing: Sizing) -> View | None:
    """The curves of a sizing; None for a diagram of areas."""
    machine, motion = sizing.machine, sizing.cycle
    if machine is None or motion is None:
        return None
    along = sampled(machine, motion)
    if sizing.cyclic is None or sizing.constant is None:
        return View(sizing, machine, motion, along, motion, along)
    samples = sampled(machine, sizing.constant, sizing.cyclic.constant_speed)
    return View(sizing, machine, sizing.constant, samples, motion, along)


def _fill(sizing: Sizing, made: figures.Picture, axes: dict[str, Axes]) -> None:
    """Draw panels; the names inside them get their places with the figure's layout."""
    seen = view(sizing)
    if seen is None:
        later = [_OF_AREAS[kind](panel, sizing) for kind, panel in axes.items()]
    else:
        later = [_OF_MACHINES[kind](panel, seen) for kind, panel in axes.items()]
        degrees = float(np.degrees(sizing.scene.cycle))
        for kind, panel in axes.items():
            if panel.axison and kind != "wittenbauer":
                angle_axis(panel, degrees)
    made.later = [rest for rest in later if rest is not None]


def angle_axis(panel: Axes, degrees: float) -> None:
    """An axis of angles over a cycle: ticks at whole parts of a turn."""
    panel.set_xlim(0.0, degrees)
    turns = degrees / 360.0
    if abs(turns - round(turns)) < 1e-9 and round(turns) <= 8:
        panel.xaxis.set_major_locator(MultipleLocator(30 * round(turns) if turns <= 2.5 else 45 * round(turns)))


def legend(panel: Axes, wide: float = 430.0) -> None:
    """The legend below the axis, clear of all curves, in as many columns as fit (`wide`: points)."""
    handles, labels = panel.get_legend_handles_labels()
    if not labels:
        return

    def width(ncols: int) -> float:
        """About how wide (points) it becomes: filled column by column, the first ones with one more if need be."""
        chunks = np.array_split(np.array([len(label) for label in labels]), ncols)
        return sum(4.9 * float(chunk.max()) + 30.0 for chunk in chunks)

    widest = next(n for n in range(len(labels), 0, -1) if n == 1 or width(n) <= wide)
    rows = -(-len(labels) // widest)
    ncols = -(-len(labels) // rows)  # as few columns as these rows need
    style: dict[str, Any] = {"fontsize": 8.5, "handlelength": 2.2, "columnspacing": 1.2, "frameon": False}
    panel.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=ncols, borderaxespad=4.2, **style)


def angle(radians: float) -> str:
    """An angle of the crank in degrees."""
    return f"{told(float(np.degrees(radians)), _FIGURES, _ANGLE)}°"


def _works(sizing: Sizing) -> float:
    """Absolute error (J) of an accumulated work, with what a constant speed found as a root leaves over."""
    return work_error(sizing) + 2 * (0.0 if sizing.constant is None else abs(sizing.constant.net))


# -- turning moment --------------------------------------------------------------------------------------------------


def _moment(panel: Axes, seen: View) -> Later:
    """What drives, what resists and their sum with its areas; where these hold for a constant speed, the motion's too."""
    sizing, samples = seen.sizing, seen.samples
    at = _("Turning moment and its areas")
    if sizing.cyclic is not None:
        at = _("Turning moment at a constant {speed} rpm, and its areas", speed=told(RPM * sizing.cyclic.constant_speed, 6))
    if not np.any(samples.moment) and not np.any(samples.driving):
        say(panel, at, _("No torque or force acts on the machine:\nM* is zero over the whole cycle."))
        return None
    name_axes(panel, at, _("crank angle φ, deg"), _("reduced moment M*, N m"))
    phi, moment = seen.degrees, samples.moment
    for side, colour, hatch, label in (
        (1, SKY, "//", _("area that speeds up")),
        (-1, ORANGE, "\\\\", _("area that slows down")),
    ):
        x, shown = figures.thinned(phi, np.where(side * moment > 0, moment, 0.0))
        panel.fill_between(x, shown, facecolor=colour, alpha=0.4, edgecolor="none", lw=0, label=label, hatch=hatch)
    drawn = [np.stack((phi, moment)), *_sides(panel, seen)]
    panel.plot(phi, moment, color=BLACK, lw=1.7, label=_("M*, net"))
    if seen.at_constant_speed:
        drawn += _along_motion(panel, seen)
    _balance(panel, seen)
    panel.axhline(0.0, color=BLACK, lw=0.8)
    low, high = panel.get_ylim()
    panel.set_ylim(low - 0.14 * (high - low), high + 0.14 * (high - low))
    if len(sizing.areas) > _MOST_WITH_WORKS:
        panel.plot(
            [], [], " ", label=_("A1 to A{last} from left to right, their works in the table", last=len(sizing.areas))
        )
    legend(panel)
    return lambda: _name_areas(panel, seen, drawn)


def _sides(panel: Axes, seen: View) -> list[Array]:
    """What drives and what resists; a note where both are so far above their sum that its areas could not be seen."""
    samples, phi = seen.samples, seen.degrees
    driving, resisting = samples.driving, samples.moment - samples.driving
    largest = max(float(np.abs(driving).max()), float(np.abs(resisting).max()))
    fit = largest <= _OFF_THE_SCALE * float(np.abs(samples.moment).max())
    drawn = []
    for values, colour, dash, label in (
        (driving, BLUE, "--", _("driving")),
        (resisting, VERMILLION, "-.", _("resisting")),
    ):
        if fit:
            panel.plot(phi, values, color=colour, ls=dash, lw=1.3, label=label)
            drawn.append(np.stack((phi, values)))
        else:
            least, most = told(float(values.min())), told(float(values.max()))
            beyond = _("{name}: {least} to {most} N m, off the scale", name=label, least=least, most=most)
            panel.plot([], [], " ", label=beyond)
    if fit and samples.drive is not None:
        _brakes(panel, phi, samples.drive, largest)
    return drawn


def _brakes(panel: Axes, phi: Array, drive: Array, scale: float) -> None:
    """Where the drive brakes: its own moment below zero, by more than what is nothing beside the scale."""
    if drive.min() < -1e-9 * scale:
        x, shown = figures.thinned(phi, np.where(drive < 0.0, drive, 0.0))
        label = _("the drive brakes")
        panel.fill_between(x, shown, facecolor="none", edgecolor=BLUE, hatch="---", lw=0.6, label=label, zorder=2.1)


def _along_motion(panel: Axes, seen: View) -> list[Array]:
    """The net moment and the drive's along the motion, where they differ from those at a constant speed."""
    phi = np.degrees(seen.along.phi)
    panel.plot(phi, seen.along.moment, color=GREEN, lw=1.2, label=_("M* along the motion"))
    drawn = [np.stack((phi, seen.along.moment))]
    machine, cycle, sizing = seen.machine, seen.motion, seen.sizing
    if machine.scene.drive is not None:
        values = drive_moment(machine, cycle, sizing.run, sizing.speed)
        local = (phi.size // cycle.mesh.phi.shape[0], cycle.mesh.phi.shape[0])
        drive = (cells.fit(values) @ cells.basis(np.linspace(-1.0, 1.0, local[0]), cells.ORDER).T).ravel()
        if np.abs(drive).max() <= _OFF_THE_SCALE * max(np.abs(seen.along.moment).max(), np.abs(seen.samples.moment).max()):
            panel.plot(phi, drive, color=PURPLE, ls=":", lw=1.8, label=_("drive along the motion"))
            _brakes(panel, phi, drive, float(np.abs(seen.along.moment).max()))
            drawn.append(np.stack((phi, drive)))
        else:
            least, most = told(float(drive.min())), told(float(drive.max()))
            label = _("drive along the motion")
            beyond = _("{name}: {least} to {most} N m, off the scale", name=label, least=least, most=most)
            panel.plot([], [], " ", label=beyond)
    return drawn


def _balance(panel: Axes, seen: View) -> None:
    """What the balance gives, named with its value."""
    sizing, cycle = seen.sizing, seen.cycle
    if sizing.balance is None or cycle.balance is None:
        return
    value = told(cycle.balance, _FIGURES, balance_error(sizing))
    drive = sizing.scene.drive if sizing.balance.name == "drive" else None
    unit = "" if sizing.balance_unit is None else f" {sizing.balance_unit}"
    on = "" if drive is None or drive.on == "crank" else " " + _("on {shaft}", shaft=drive.on)
    panel.plot([], [], " ", label=_("balance: {name} = {value}", name=_balanced(sizing), value=f"{value}{unit}{on}"))


def _balanced(sizing: Sizing) -> str:
    """The name of what balances the cycle."""
    assert sizing.balance is not None
    return _("drive") if sizing.balance.name == "drive" else sizing.balance.name


_MOST_WITH_WORKS, _MOST_NAMED = 12, 40  # areas whose works are written beside them, that are named at all


def _name_areas(panel: Axes, seen: View, drawn: list[Array]) -> None:
    """A1, A2... with their joules inside each area, or beside its curve where it is too slim; the largest choose first."""
    sizing, samples = seen.sizing, seen.samples
    named = [(k, area) for k, area in enumerate(sizing.areas, 1) if area.start is not None and area.work]
    named = sorted(named, key=lambda pair: -abs(pair[1].work))[:_MOST_NAMED]
    texts, spots, ways, lines = [], [], [], [*drawn, np.array([[0.0, samples.phi[-1] * 57.3], [0.0, 0.0]])]
    error = _works(sizing)
    per_degree, per_moment = figures.scale(panel)
    crowded = len(named) > _MOST_WITH_WORKS
    for k, area in named:
        assert area.start is not None
        assert area.end is not None
        words = f"A{k}" if crowded else f"A{k}\n{area_work(area.work, error)}"
        text = figures.name(panel, words, fontsize=7.0 if crowded else 8.5, linespacing=1.05, zorder=6)
        wide, tall = figures.size(panel, text)
        side = 1.0 if area.work > 0 else -1.0
        centre, room = roomiest(samples, area.start, area.end, side, np.radians((wide + 4.0) / per_degree))
        spot = np.array([np.degrees(centre), 0.5 * side * room])
        if room * per_moment > tall + 4.0:
            text.set_position(tuple(spot))
            half = 0.5 * np.array([wide / per_degree, tall / per_moment])
            corners = spot[:, None] + half[:, None] * np.array([[-1, 1, 1, -1, -1], [-1, -1, 1, 1, -1]])
            lines += [corners, spot[:, None] + half[:, None] * np.array([[-1, 1], [0, 0]])]
            continue
        texts.append(text)
        height = float(np.interp(centre, samples.phi, samples.moment))
        spots.append((np.degrees(centre), 0.7 * height))
        ways.append((0.0, side))
    figures.settle(panel, texts, np.array(spots), lines, np.array(ways), keep=0 if crowded else None, leaders=True)


def area_work(work: float, error: float) -> str:
    """The work of an area (J) with its sign."""
    written = told(work, _FIGURES, 2 * error)
    return f"{'+' if work > 0 and written != '0' else ''}{written} J"


# -- work --------------------------------------------------------------------------------------------------------------


def _work(panel: Axes, seen: View) -> Later:
    """W, the sum of the areas, with its greatest and its least value, and between them the fluctuation of energy."""
    sizing, samples, cycle = seen.sizing, seen.samples, seen.cycle
    if not np.any(samples.moment):
        say(panel, _("Accumulated work W"), _("Nothing acts on the machine:\nno work is done."))
        return None
    at = ""
    if sizing.cyclic is not None:
        at = " " + _("at a constant {speed} rpm", speed=told(RPM * sizing.cyclic.constant_speed, 6))
    title = _("Accumulated work of the net moment{at}", at=at)
    name_axes(panel, title, _("crank angle φ, deg"), _("accumulated work W, J"))
    panel.plot(seen.degrees, samples.work, color=BLACK, lw=1.7, label=_("W, sum of the areas"))
    if seen.at_constant_speed:
        panel.plot(np.degrees(seen.along.phi), seen.along.work, color=GREEN, ls="--", lw=1.2, label=_("W along the motion"))
    ends = [(area.end, area.accumulated) for area in sizing.areas[:-1] if area.end is not None]
    if ends:
        places = np.array(ends)
        panel.plot(np.degrees(places[:, 0]), places[:, 1], "o", color=BLACK, ms=3.5, label=_("end of an area"))
    panel.axhline(0.0, color=BLACK, lw=0.8)
    extremes = turning_moment.combined(cycle, np.array([[1.0, 0.0]]))[0]
    error = _works(sizing)
    marks = [
        (float(extremes.angle_greatest[0]), sizing.accumulated_max, BLUE, "^", _("greatest")),
        (float(extremes.angle_least[0]), sizing.accumulated_min, VERMILLION, "v", _("least")),
    ]
    texts, spots = [], []
    for at_angle, value, colour, marker, word in marks:
        panel.plot(np.degrees(at_angle), value, marker, color=colour, ms=8, zorder=5, clip_on=False)
        panel.plot([np.degrees(at_angle), np.degrees(sizing.scene.cycle)], [value, value], color=GREY, lw=0.8, ls=":")
        words = _("{which}: {work} J at {angle}", which=word, work=told(value, _FIGURES, error), angle=angle(at_angle))
        texts.append(figures.name(panel, words, fontsize=9, zorder=6))
        spots.append((np.degrees(at_angle), value))
    panel.margins(y=0.16)
    fluctuation = told(sizing.energy_fluctuation, _FIGURES, 2 * error)
    _dimension(panel, sizing.accumulated_min, sizing.accumulated_max, f"ΔW = {fluctuation} J")
    legend(panel)
    drawn = [np.stack((seen.degrees, samples.work))]
    if seen.at_constant_speed:
        drawn.append(np.stack((np.degrees(seen.along.phi), seen.along.work)))
    return lambda: figures.settle(panel, texts, np.array(spots), drawn, np.array([(-0.3, 1.0), (-0.3, -1.0)]))


def _dimension(panel: Axes, low: float, high: float, words: str) -> None:
    """A dimension to the right of a panel, between two of its heights."""
    place = panel.get_yaxis_transform()
    style = {"arrowstyle": "<|-|>", "color": BLACK, "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 9.0}
    for y in (low, high):
        panel.plot([1.0, 1.045], [y, y], color=BLACK, lw=0.7, transform=place, clip_on=False)
    panel.annotate("", (1.03, low), (1.03, high), xycoords=place, textcoords=place, arrowprops=style, annotation_clip=False)
    panel.text(1.06, 0.5, words, transform=panel.transAxes, rotation=90, ha="left", va="center", fontsize=9.5)


# -- reduced inertia -------------------------------------------------------------------------------------------------


def _inertia(panel: Axes, seen: View) -> Later:
    """I* as the sum of what every body adds."""
    sizing, samples, parts = seen.sizing, seen.along, bodies(seen.machine, seen.along)
    title = _("Reduced inertia by body, without the flywheel")
    if not parts or sizing.reduced_inertia is None:
        say(panel, title, _("No body of the machine has mass or inertia:\nI* = 0, the flywheel is alone."))
        return None
    phi = np.degrees(samples.phi)
    name_axes(panel, title, _("crank angle φ, deg"), _("reduced inertia I*, kg m²"))
    floor = np.zeros_like(phi)
    for k, (name, part) in enumerate(parts.items()):
        colour, hatch = _BODIES[k % len(_BODIES)], _HATCHES[k % len(_HATCHES)]
        shown: dict[str, Any] = {"facecolor": colour, "alpha": 0.45, "hatch": hatch, "edgecolor": "white", "lw": 0.4}
        x, below, above = figures.thinned(phi, floor, floor + part)
        panel.fill_between(x, below, above, label=figures.noun(name), **shown)
        floor = floor + part
    error = 0.0 if sizing.cycle is None else sizing.cycle.errors.inertia
    least, most = (told(value, _FIGURES, error) for value in (sizing.reduced_inertia.least, sizing.reduced_inertia.greatest))
    total = _("I*, {inertia} kg m² at every angle", inertia=most)
    if least != most:
        total = _("I*, from {least} to {most} kg m²", least=least, most=most)
    panel.plot(phi, samples.inertia, color=BLACK, lw=1.8, label=total)
    panel.set_ylim(0.0, 1.08 * float(samples.inertia.max()))
    legend(panel)
    return None


# -- Wittenbauer's loop ----------------------------------------------------------------------------------------------

_FLAT = 1e-9  # of the greatest I*: what varies less is constant
_SEEN = 0.10  # of a panel's width and height: a loop that takes less is looked at more closely
_STEP = 30.0  # deg between two marks


def _wittenbauer(panel: Axes, seen: View) -> Later:
    """The loop W(I*) with its two tangents, as much of the triangle P M N as leaves the loop to be seen."""
    sizing, title = seen.sizing, _("Wittenbauer's diagram")
    if sizing.run is None:
        why = _("Nothing acts on the machine and nothing in it has inertia:\nits speed never changes.")
        say(panel, title, why if not sizing.energy_fluctuation else _("Nothing in the machine stores energy."))
        return None
    found = loop(seen.motion, seen.along, sizing.speed, sizing.run)
    if np.ptp(found.inertia) <= _FLAT * float(found.inertia.max()):
        say(panel, title, _constant_inertia(seen, found))
        return None
    name_axes(panel, title, _("reduced inertia I*, kg m²"), _("work W, J"))
    half = 0.5 * sizing.speed**2  # J for each kg m² of F
    other = panel.secondary_yaxis("right", functions=(partial(np.multiply, 1.0 / half), partial(np.multiply, half)))
    other.set_ylabel("F = 2 W/ω², kg m²")
    energy = half * found.energy
    panel.plot(found.inertia, energy, color=BLACK, lw=1.6, label=_("W against I*"), zorder=3)
    window, shown = _window(found)
    low, high = window[:, 0] * (1.0, half), window[:, 1] * (1.0, half)
    panel.set_xlim(low[0], high[0])
    panel.set_ylim(low[1], high[1])
    _tangents(panel, found, half, shown)
    for note in _notes(found, half, shown, sizing):
        panel.plot([], [], " ", label=note)
    if low[0] <= 0.0 <= high[0]:
        panel.axvline(0.0, color=BLACK, lw=0.9)
    legend(panel, 330.0)
    return lambda: _mark_loop(panel, seen, found, half, shown)


def _constant_inertia(seen: View, found: Loop) -> str:
    """Why there is no loop, and how the flywheel follows without one."""
    sizing, scene = seen.sizing, seen.sizing.scene
    inertia, square = float(found.inertia.max()), sizing.speed**2
    extremes = turning_moment.combined(seen.motion, np.array([[1.0, 0.0]]))[0]
    fluctuation = float(extremes.greatest[0] - extremes.least[0])
    lines = [
        _("I* is constant, {inertia} kg m²: the loop is an upright line.", inertia=told(inertia)),
        _("The flywheel follows from the fluctuation of energy alone:"),
        f"ΔW = {told(fluctuation, _FIGURES, 2 * _works(sizing))} J,  ω = {told(sizing.speed)} rad/s",
    ]
    eps = scene.irregularity
    if scene.inertia is not None or eps is None:
        given = told(found.flywheel)
        assert sizing.run is not None
        lines.append(f"ε = ΔW/((I + I*) ω²) = {told(sizing.run.irregularity)}")
        lines.append(_("with I = {given} kg m² on the crank", given=given))
    else:
        net = fluctuation / (eps * square) - inertia
        written = told(net, _FIGURES, inertia_errors(sizing).exact * scene.flywheel_ratio**2)
        lines.append(f"I = ΔW/(ε ω²) − I* = {written} kg m²")
        if net <= 0.0:
            lines.append(_("Below 0: the machine's own inertia suffices."))
        elif scene.flywheel_on != "crank":
            here = told(net / scene.flywheel_ratio**2, _FIGURES, inertia_errors(sizing).exact)
            lines.append(_("on the crank, {inertia} kg m² on shaft {name}", inertia=here, name=scene.flywheel_on))
    return "\n".join(lines)


def _window(found: Loop) -> tuple[Array, str]:
    """What of the diagram is shown, ((left, right), (low, high)) in kg m²: the whole triangle, without P, or the loop.

    Second "P", "MN" or "loop".
    """
    corners = np.array([[found.inertia.min(), found.inertia.max()], [found.energy.min(), found.energy.max()]])
    axis = np.array([[0.0, 0.0], [found.intercept_slow, found.intercept_fast]])
    at_right = [slope * corners[0, 1] + cut for slope, cut in found.lines]
    far = np.array(found.far_point)[:, None]
    choices = {"P": [corners, axis, far], "MN": [corners, axis], "loop": [corners]}
    for name, parts in choices.items():
        points = np.concatenate(parts, axis=1)
        low, high = points.min(axis=1), points.max(axis=1)
        if name != "loop":
            low[1], high[1] = min(low[1], *at_right), max(high[1], *at_right)
        spans = np.maximum(high - low, 1e-300)
        if name == "loop" or (np.ptp(corners, axis=1) >= _SEEN * spans).all():
            margin = np.array([0.12, 0.1]) * spans
            return np.stack((low - margin, high + margin), axis=1), name
    raise AssertionError


def _tangents(panel: Axes, found: Loop, half: float, shown: str) -> None:
    """Both tangents with their angles and slopes, and the points where they touch."""
    left, right = panel.get_xlim()
    start = found.far_point[0] if shown == "P" else 0.0 if shown == "MN" else left
    ends = np.array([start, right])
    for (slope, cut), contact, at, colour, style, marker, words in (
        (found.lines[0], found.contact_fast, found.angle_fast, BLUE, "-", "^", (_("greatest speed"), "ψmax")),
        (found.lines[1], found.contact_slow, found.angle_slow, VERMILLION, "--", "v", (_("least speed"), "ψmin")),
    ):
        label = _(
            "{which} at {angle}: tan {psi} = {tangent}, {psi} = {degrees}°, slope {slope} J/(kg m²)",
            which=words[0],
            angle=angle(at),
            psi=words[1],
            tangent=told(slope),
            degrees=told(float(np.degrees(np.arctan(slope)))),
            slope=told(half * slope),
        )
        panel.plot(ends, half * (slope * ends + cut), color=colour, ls=style, lw=1.5, label=label)
        panel.plot(contact[0], half * contact[1], marker, color=colour, ms=8, zorder=5)


def _notes(found: Loop, half: float, shown: str, sizing: Sizing) -> list[str]:
    """MN with its value, and where M, N and P are if they are outside the picture."""
    x, y = found.far_point
    cut = found.intercept_fast - found.intercept_slow
    eps = told(sizing.run.irregularity if sizing.run is not None else 0.0)
    place = _("I* = {x} kg m², W = {y} J", x=told(x), y=told(half * y))
    notes = [
        _(
            "MN = {work} J = {cut} kg m², I = MN/(2 ε) = {inertia} kg m², ε = {eps}",
            work=told(half * cut),
            cut=told(cut),
            inertia=told(found.flywheel),
            eps=eps,
        )
    ]
    if found.flywheel == 0.0:
        notes = [_("without a flywheel the tangents meet at I* = 0: M, N and P are one point")]
    if shown == "MN":
        notes.append(_("P, where the tangents meet, is far to the left: {place}", place=place))
    elif shown == "loop":
        m, n = told(half * found.intercept_fast), told(half * found.intercept_slow)
        notes.append(_("outside the picture: M and N at I* = 0, W = {m} J and {n} J", m=m, n=n))
        notes.append(_("P, where the tangents meet: {place}", place=place))
    return notes


def _mark_loop(panel: Axes, seen: View, found: Loop, half: float, shown: str) -> None:
    """Angles along the loop, arrows in its direction, and the names of M, N and P."""
    phi, path = np.degrees(seen.along.phi), np.stack((found.inertia, half * found.energy))
    lines, names, spots, ways = [path], [], [], []
    right = panel.get_xlim()[1]
    m, n = half * found.intercept_fast, half * found.intercept_slow
    x, y = found.far_point[0], half * found.far_point[1]
    if shown != "loop":
        panel.plot([0.0, 0.0], [n, m], color=PURPLE, lw=3.5, solid_capstyle="butt", zorder=4)
        lines.append(np.array([[0.0, 0.0], [n, m]]))
        together = found.flywheel == 0.0
        for name, place, way in (
            (("M, N, P", (0.0, m), (-1, 0)),)
            if together
            else (
                ("M", (0.0, m), (-1, 1)),
                ("N", (0.0, n), (-1, -1)),
                *((("P", (x, y), (-1, 0)),) if shown == "P" else ()),
            )
        ):
            names.append(figures.name(panel, name, fontweight="bold", fontsize=10.5, zorder=7))
            spots.append(place)
            ways.append(way)
        if not together and shown == "P":
            panel.plot(x, y, "s", color=PURPLE, ms=6, zorder=6)
    low, high = panel.get_ylim()
    for (slope, cut), words, way in zip(found.lines, ("ψmax", "ψmin"), ((0, 1), (0, -1)), strict=True):
        ends = np.array([x if shown == "P" else panel.get_xlim()[0], right])
        lines.append(np.stack((ends, half * (slope * ends + cut))))
        inside = np.linspace(ends[0], ends[1], 400)
        inside = inside[(half * (slope * inside + cut) > low) & (half * (slope * inside + cut) < high)]
        at = 0.5 * (max(x, 0.0) + float(found.inertia.min()))
        if shown == "loop" or not inside.size:
            at = float(inside[inside.size // 10]) if inside.size else float(ends[0])
        names.append(figures.name(panel, words, fontsize=9, style="italic", zorder=7))
        spots.append((at, half * (slope * at + cut)))
        ways.append(way)
    places = np.arange(0.0, phi[-1] - 1e-6, _STEP)
    dots = np.stack([np.interp(places, phi, part) for part in path], axis=1)
    panel.plot(*dots.T, "o", color=BLACK, ms=3.2, zorder=4)
    _arrows(panel, path)
    inner = dots - 0.5 * (path.max(axis=1) + path.min(axis=1))
    scale = np.array(figures.scale(panel))
    for place, dot, way in zip(places, dots, inner * scale, strict=True):
        names.append(figures.name(panel, f"{place:.0f}°", fontsize=7.5, zorder=6))
        spots.append(tuple(dot))
        ways.append(tuple(way / scale * scale))
    figures.settle(panel, names, np.array(spots), lines, np.array(ways, dtype=float), keep=len(names) - places.size)


def _arrows(panel: Axes, path: Array) -> None:
    """Arrowheads along a path (2, m), in the direction in which it is gone."""
    scale = np.array(figures.scale(panel))[:, None]
    steps = np.hypot(*(np.diff(path, axis=1) * scale))
    gone = np.concatenate(([0.0], np.cumsum(steps)))
    for share in (0.13, 0.38, 0.63, 0.88):
        k = int(np.searchsorted(gone, share * gone[-1]))
        j = max(k - 1, 0)
        while j > 0 and gone[k] - gone[j] < 3.0:
            j -= 1
        style = {"arrowstyle": "-|>", "color": BLACK, "lw": 0.0, "mutation_scale": 13.0, "shrinkA": 0.0, "shrinkB": 0.0}
        panel.annotate("", tuple(path[:, k]), tuple(path[:, j]), arrowprops=style, zorder=4)


# -- speed -----------------------------------------------------------------------------------------------------------


def origin_of(mean: float, traces: list[tuple[str, str, Array]]) -> float:
    """The mean, taken off where the fluctuation is too small for tick labels that count from zero."""
    fluctuation = max((float(np.ptp(values)) for key, label, values in traces), default=0.0)
    return mean if fluctuation < 2e-3 * mean else 0.0


def speed_label(sizing: Sizing, origin: float) -> str:
    """The label of an axis of speeds (rpm), from an origin on."""
    if origin:
        return _("crank speed − {speed} rpm, rpm", speed=told(sizing.speed * RPM, 6))
    return _("crank speed, rpm")


def band(panel: Axes, sizing: Sizing, origin: float) -> None:
    """The band of speeds (rpm) that was asked for, and the mean of extremes."""
    eps, mean = sizing.scene.irregularity, sizing.speed * RPM
    if eps is not None:
        low, high = mean * (1 - eps / 2) - origin, mean * (1 + eps / 2) - origin
        label = _("band asked, ±{percent} %", percent=told(50 * eps, 4))
        panel.axhspan(low, high, color="#E8E8E8", zorder=0.5, label=label)
    panel.axhline(mean - origin, color=GREY, lw=0.9, ls="-.", label=_("mean of extremes, {speed} rpm", speed=told(mean, 6)))


def _speed(panel: Axes, seen: View) -> Later:
    """The speed with every flywheel; those of no inertia are the bare machine, which is drawn once."""
    sizing, cycle, samples, title = seen.sizing, seen.motion, seen.along, _("Speed of the crank over the cycle")
    if sizing.run is None:
        why = _("Nothing acts on the machine and nothing in it has inertia:\nits speed never changes.")
        say(panel, title, why if not sizing.energy_fluctuation else _("Nothing in the machine stores energy."))
        return None
    runs: list[tuple[str, str, Run | None]] = []
    if sizing.scene.inertia is not None:
        given = _("given {inertia} kg m²", inertia=told(sizing.scene.inertia))
        runs = [("given", given + _eps(sizing.run), sizing.run)]
    names = {"exact": _("exact"), "approximate": _("by the areas"), "inertia_torque_flywheel": _("by the inertia torque")}
    for candidate in () if runs else candidates(sizing):
        bare = candidate.inertia == 0.0
        if bare and any(run is sizing.run for key, label, run in runs):
            continue
        name = f"{names[candidate.key]} {told(candidate.inertia, _FIGURES, candidate.error)} kg m²"
        runs.append((candidate.key, (_("no flywheel") if bare else name) + _eps(candidate.motion), candidate.motion))
    traces = [
        (key, label, RPM * turning_moment.speed_over_cycle(cycle, sizing.speed, run, samples.phi))
        for key, label, run in runs
        if run is not None
    ]
    origin = origin_of(sizing.speed * RPM, traces)
    name_axes(panel, title, _("crank angle φ, deg"), speed_label(sizing, origin))
    band(panel, sizing, origin)
    phi = np.degrees(samples.phi)
    for key, label, values in traces:
        colour, style, width = _LINES[key]
        panel.plot(phi, values - origin, color=colour, ls=style, lw=width, label=label)
    for label in (label for key, label, run in runs if run is None):
        panel.plot([], [], " ", label=label)
    texts, spots = [], []
    for at, speed, marker, word in (
        (sizing.run.angle_speed_max, sizing.run.speed_max, "^", _("greatest")),
        (sizing.run.angle_speed_min, sizing.run.speed_min, "v", _("least")),
    ):
        panel.plot(np.degrees(at), RPM * speed - origin, marker, color=BLUE, ms=8, zorder=5, clip_on=False)
        off = RPM * sizing.run.error * sizing.run.irregularity * sizing.speed
        digits = max(6, min(10, 3 - floor(log10(sizing.run.irregularity or 1.0))))
        words = _("{which}: {speed} rpm at {angle}", which=word, speed=told(RPM * speed, digits, off), angle=angle(at))
        texts.append(figures.name(panel, words, fontsize=9, zorder=6))
        spots.append((np.degrees(at), RPM * speed - origin))
    panel.margins(y=0.16)
    legend(panel)
    drawn = [np.stack((phi, values - origin)) for key, label, values in traces]
    return lambda: figures.settle(panel, texts, np.array(spots), drawn, np.array([(-0.3, 1.0), (-0.3, -1.0)]))


def _eps(run: Run | None) -> str:
    if run is None:
        return ": " + _("no steady motion")
    return f", ε = {language.number(irregularity(float(f'{run.irregularity:.4g}'), 0.0))}"


# -- a diagram of areas ------------------------------------------------------------------------------------------------


def _bars(panel: Axes, sizing: Sizing) -> Later:
    """Bars of the areas: between them a diagram of areas tells nothing."""
    works = np.array([area.work for area in sizing.areas])
    name_axes(panel, _("Areas of the turning moment (angles not given)"), _("area"), _("work, J"))
    places = np.arange(1, works.size + 1)
    for side, colour, hatch, label in ((1, SKY, "//", _("speeds up")), (-1, ORANGE, "\\\\", _("slows down"))):
        mine = side * works > 0
        if mine.any():
            style: dict[str, Any] = {"facecolor": (*figures.rgb(colour), 0.4), "edgecolor": BLACK, "lw": 0.6, "hatch": hatch}
            panel.bar(places[mine], works[mine], label=label, **style)
    panel.axhline(0.0, color=BLACK, lw=0.8)
    panel.margins(y=0.15)
    for place, work in zip(places, works, strict=True) if works.size <= _MOST_WITH_WORKS else ():
        below = work < 0
        style = {"ha": "center", "va": "top" if below else "bottom", "fontsize": 8.5}
        words = area_work(float(work), work_error(sizing))
        panel.annotate(words, (place, work), (0, -2 if below else 2), textcoords="offset points", **style)
    _ticks(panel, "A", places)
    if works.any():
        legend(panel)
    return None


def _sums(panel: Axes, sizing: Sizing) -> Later:
    """The accumulated areas, with the greatest and the least, and between them the fluctuation of energy."""
    sums = np.array([0.0, *(area.accumulated for area in sizing.areas)])
    name_axes(panel, _("Accumulated areas"), _("crossing"), _("accumulated work W, J"))
    places, error = np.arange(sums.size), work_error(sizing)
    panel.plot(places, sums, "o-", color=BLACK, lw=1.2, ms=4)
    for colour, marker, value, name in (
        (BLUE, "^", sizing.accumulated_max, _("greatest")),
        (VERMILLION, "v", sizing.accumulated_min, _("least")),
    ):
        at = int(np.abs(sums - value).argmin())
        label = f"{name}: S{at} = {told(value, _FIGURES, error)} J"
        panel.plot(at, value, marker, color=colour, ms=9, ls="", label=label)
        panel.plot([at, places[-1]], [value, value], color=GREY, lw=0.8, ls=":")
    panel.set_xlim(-0.2, places[-1] + 0.2)
    fluctuation = told(sizing.energy_fluctuation, _FIGURES, 2 * error)
    _dimension(panel, sizing.accumulated_min, sizing.accumulated_max, f"ΔW = {fluctuation} J")
    _ticks(panel, "S", places)
    legend(panel)
    return None


def _no_inertia(panel: Axes, sizing: Sizing) -> Later:
    say(panel, _("Reduced inertia"), _("A diagram of areas tells nothing of the machine's own inertia."))
    return None


def _no_loop(panel: Axes, sizing: Sizing) -> Later:
    why = _("The loop needs the reduced inertia of a machine.\nA diagram of areas gives none, and counts all as flywheel.")
    say(panel, _("Wittenbauer's diagram"), why)
    return None


def _speeds_at_crossings(panel: Axes, sizing: Sizing) -> Later:
    """The speeds at the crossings, with the flywheel."""
    inertia = sizing.scene.inertia or sizing.flywheel.exact or 0.0
    if inertia == 0.0:
        say(panel, _("Speed of the crank"), _("The areas are all zero:\nthe speed never changes."))
        return None
    sums = np.array([0.0, *(area.accumulated for area in sizing.areas)])
    eps = sizing.simulation.irregularity if sizing.simulation is not None else sizing.scene.irregularity or 0.0
    on_crank = inertia * sizing.scene.flywheel_ratio**2
    speeds = RPM * crossing_speeds(sums, sizing.speed * (1 - eps / 2), on_crank)
    origin = origin_of(sizing.speed * RPM, [("", "", speeds)])
    title = _("Speed of the crank at the crossings")
    name_axes(panel, title, _("crossing"), speed_label(sizing, origin))
    band(panel, sizing, origin)
    places = np.arange(sums.size)
    panel.plot(places, speeds - origin, "o", color=BLUE, ms=6, label=f"{told(inertia)} kg m², ε = {told(eps, 4)}")
    _ticks(panel, "S", places)
    legend(panel)
    return None


def _ticks(panel: Axes, name: str, places: NDArray[np.intp]) -> None:
    """A tick at every place, at most two dozen of them."""
    shown = [int(k) for k in places[:: -(-places.size // 24)]]
    panel.set_xticks(shown, [f"{name}{k}" for k in shown])


_OF_MACHINES: dict[str, Callable[[Axes, View], Later]] = {
    "moment": _moment,
    "work": _work,
    "inertia": _inertia,
    "wittenbauer": _wittenbauer,
    "speed": _speed,
}
_OF_AREAS: dict[str, Callable[[Axes, Sizing], Later]] = {
    "moment": _bars,
    "work": _sums,
    "inertia": _no_inertia,
    "wittenbauer": _no_loop,
    "speed": _speeds_at_crossings,
}


# -- in words ----------------------------------------------------------------------------------------------------------


def description(sizing: Sizing, kind: str) -> str:
    """What a panel shows, in words for who does not see it."""
    error = _works(sizing)
    if kind == "moment":
        each = [f"A{k} = {area_work(area.work, error)}" for k, area in enumerate(sizing.areas, 1)]
        some = ", ".join(each[:_MOST_WITH_WORKS]) + (" ..." if len(each) > _MOST_WITH_WORKS else "")
        return _("Areas of the net turning moment over one cycle: {areas}.", areas=some or "0")
    if kind == "work":
        return _(
            "Accumulated work: greatest {most} J, least {least} J, fluctuation of energy {between} J.",
            most=told(sizing.accumulated_max, _FIGURES, error),
            least=told(sizing.accumulated_min, _FIGURES, error),
            between=told(sizing.energy_fluctuation, _FIGURES, 2 * error),
        )
    if kind == "inertia":
        if sizing.reduced_inertia is None:
            return _("No reduced inertia is known.")
        own = sizing.reduced_inertia
        return _(
            "Reduced inertia over one cycle: least {least}, mean {mean}, greatest {most} kg m².",
            least=told(own.least),
            mean=told(own.mean),
            most=told(own.greatest),
        )
    return headline(sizing).rpartition("\n")[2] + "."
