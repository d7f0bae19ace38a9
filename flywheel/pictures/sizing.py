"""One picture of a sizing: turning moment, reduced inertia, Wittenbauer's loop, speed over the cycle.

A diagram of areas, which has no machine and no angles, has bars, sums and speeds at the crossings instead. Curves are
sampled piece by piece, so that a jump stays a vertical line.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from flywheel.numerics.units import figure as number
from flywheel.pictures.figures import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    STYLE,
    VERMILLION,
    figure,
    name_axes,
    save,
    say,
    told,
)
from flywheel.pictures.samples import Loop, Samples, bodies, crossing_speeds, loop, roomiest, sampled
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.sizing.results import Sizing
from flywheel.tables.flywheels import candidates, work_error
from flywheel.tables.power import balance_error
from flywheel.tables.rows import RPM
from flywheel.tables.sizing import headline

Array = NDArray[np.float64]

_BODIES = (SKY, ORANGE, GREEN, "#F0E442", PURPLE, BLUE, VERMILLION, "#BBBBBB")
_HATCHES = ("", "//", "..", "xx")
_LINES = {
    "exact": (BLUE, "-", 2.4),
    "given": (BLUE, "-", 2.4),
    "approximate": (VERMILLION, "--", 1.8),
    "inertia_torque_flywheel": (GREEN, ":", 2.2),
}
_OFF_THE_SCALE = 6.0  # times the greatest M*: curves beyond it are named alone
_MOST_NUMBERED = 40  # areas that get their numbers written in


def plot(sizing: Sizing, path: str | Path) -> None:
    """Draw a sizing into a file: PNG (1600 x 1200 pixels), SVG or PDF, as its ending says; the same one every time.

    Raises ValueError for any other ending, OSError where the file cannot be written.
    """
    with rc_context(STYLE):
        save(draw(sizing), path)


def draw(sizing: Sizing) -> Figure:
    """The figure with its four panels, not yet written anywhere."""
    made = figure(12.8, 9.6, headline(sizing), apart=0.12)
    axes = made.subplots(2, 2).ravel()
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        _draw_areas(axes, sizing)
        return made
    samples = sampled(machine, cycle)
    if sizing.cyclic is None or sizing.constant is None:
        _moment(axes[0], sizing, samples)
    else:
        _moment(axes[0], sizing, sampled(machine, sizing.constant, sizing.cyclic.constant_speed), samples)
    _inertia(axes[1], bodies(machine, samples), samples)
    if sizing.run is None:
        why = "Nothing acts on the machine and nothing in it has inertia:\nits speed never changes."
        say(axes[2], "Wittenbauer's loop", why)
        say(axes[3], "Speed of the crank", why)
    else:
        _loop(axes[2], loop(cycle, samples, sizing.speed, sizing.run))
        _speed(axes[3], sizing, cycle, samples)
    degrees, turns = float(np.degrees(sizing.scene.cycle)), float(np.degrees(sizing.scene.cycle)) / 360
    for panel in (axes[0], axes[1], axes[3]):
        if panel.axison:  # it has an axis of angles: ticks at whole parts of a turn
            panel.set_xlim(0.0, degrees)
            if abs(turns - round(turns)) < 1e-9 and round(turns) <= 8:
                panel.xaxis.set_major_locator(MultipleLocator(45 * round(turns)))
    return made


# -- what panels share ------------------------------------------------------------------------------------------------

_WIDE = 350.0  # points that a legend may be wide


def legend(panel: Axes) -> None:
    """The legend along the top, in as many columns as fit, with room made for it above the curves."""
    handles, labels = panel.get_legend_handles_labels()

    def width(ncols: int) -> float:
        """About how wide (points) it becomes: filled column by column, the first ones with one more if need be."""
        chunks = np.array_split(np.array([len(label) for label in labels]), ncols)
        return sum(4.6 * float(chunk.max()) + 28.0 for chunk in chunks)

    widest = next(n for n in range(len(labels), 0, -1) if n == 1 or width(n) <= _WIDE)
    rows = -(-len(labels) // widest)
    ncols = -(-len(labels) // rows)  # as few columns as these rows need
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + (high - low) * (0.04 + 0.065 * rows))
    style: dict[str, Any] = {"fontsize": 8.5, "handlelength": 1.7, "columnspacing": 1.2, "framealpha": 1.0}
    panel.legend(handles, labels, loc="upper center", ncols=ncols, borderaxespad=0.4, **style)


def origin_of(mean: float, traces: list[tuple[str, str, Array]]) -> float:
    """The mean, taken off where the fluctuation is too small for tick labels that count from zero."""
    fluctuation = max((float(np.ptp(values)) for _, _, values in traces), default=0.0)
    return mean if fluctuation < 2e-3 * mean else 0.0


def speed_label(sizing: Sizing, origin: float) -> str:
    """The label of an axis of speeds (rpm), from an origin on."""
    return f"crank speed − {told(sizing.speed * RPM, 6)} rpm, rpm" if origin else "crank speed, rpm"


def band(panel: Axes, sizing: Sizing, origin: float) -> None:
    """The band of speeds (rpm) that was asked for, and the mean of extremes."""
    eps, mean = sizing.scene.irregularity, sizing.speed * RPM
    if eps is not None:
        low, high = mean * (1 - eps / 2) - origin, mean * (1 + eps / 2) - origin
        panel.axhspan(low, high, color="#E4E4E4", zorder=0.5, label=f"band asked, ±{number(50 * eps, 0.0, 4)} %")
    panel.axhline(mean - origin, color=GREY, lw=0.9, ls="-.")


# -- turning moment --------------------------------------------------------------------------------------------------


def _moment(panel: Axes, sizing: Sizing, samples: Samples, along: Samples | None = None) -> None:
    """The moment with its areas; where they hold for a constant speed, the moment along the motion as a thin line."""
    if not np.any(samples.moment):
        say(panel, "Turning moment", "No torque or force acts on the machine:\nM* is zero over the whole cycle.")
        return
    phi, moment = np.degrees(samples.phi), samples.moment
    at = "the crank" if sizing.cyclic is None else f"a constant {told(RPM * sizing.cyclic.constant_speed, 6)} rpm"
    name_axes(panel, f"Turning moment at {at}, and its areas", "crank angle φ, deg", "M*, N m")
    for side, colour, label in ((1, SKY, "speeds up"), (-1, ORANGE, "slows down")):
        panel.fill_between(phi, np.where(side * moment > 0, moment, 0.0), color=colour, alpha=0.75, lw=0, label=label)
    panel.plot(phi, moment, color=BLACK, lw=1.4, label="M*")
    _sides(panel, phi, samples)
    if along is not None:
        panel.plot(np.degrees(along.phi), along.moment, color=GREEN, lw=1.0, label="M* along the motion")
    _balance(panel, sizing, samples)
    panel.axhline(0.0, color=BLACK, lw=0.8)
    _number_areas(panel, sizing, samples)
    legend(panel)


def _sides(panel: Axes, phi: Array, samples: Samples) -> None:
    """What drives and what resists; a note where both are so far above their sum that its areas could not be seen."""
    driving, resisting, fit = samples.driving, samples.moment - samples.driving, _sides_fit(samples)
    for values, colour, label in ((driving, BLUE, "$M_m^*$, drives"), (resisting, VERMILLION, "$M_r^*$, resists")):
        if fit:
            panel.plot(phi, values, color=colour, lw=1.0, label=label)
        else:
            panel.plot([], [], " ", label=f"{label} (off the scale)")


def _sides_fit(samples: Samples) -> bool:
    """Whether what drives and what resists leave the areas of their sum to be seen."""
    largest = max(np.abs(samples.driving).max(), np.abs(samples.moment - samples.driving).max())
    return bool(largest <= _OFF_THE_SCALE * np.abs(samples.moment).max())


def _balance(panel: Axes, sizing: Sizing, samples: Samples) -> None:
    """What the balance gives, named with its value."""
    cycle = sizing.constant or sizing.cycle
    if samples.balance is None or sizing.balance is None or cycle is None or cycle.balance is None:
        return
    value = told(cycle.balance, 5, balance_error(sizing))
    drive = sizing.scene.drive if sizing.balance.name == "drive" else None
    unit = "" if sizing.balance_unit is None else f" {sizing.balance_unit}"
    unit += "" if drive is None or drive.on == "crank" else f" on {drive.on}"
    label = f"balance: {sizing.balance.name} = {value}{unit}"
    if np.abs(samples.balance).max() > max(1.5, _OFF_THE_SCALE * _sides_fit(samples)) * np.abs(samples.moment).max():
        panel.plot([], [], " ", label=f"{label} (off the scale)")
    else:
        panel.plot(np.degrees(samples.phi), samples.balance, color=PURPLE, lw=1.6, ls="--", label=label)


def _number_areas(panel: Axes, sizing: Sizing, samples: Samples) -> None:
    """A1, A2... inside each area, or just beyond its curve where the area is too slim for the text."""
    if len(sizing.areas) > _MOST_NUMBERED:
        panel.plot([], [], " ", label=f"A1 to A{len(sizing.areas)} from left to right")
        return
    low, high = panel.get_ylim()
    cycle, step = sizing.scene.cycle, 0.05 * (high - low)
    size = 10.0 if len(sizing.areas) <= 12 else 7.5
    last, taken, reach = {1.0: -cycle, -1.0: -cycle}, {1.0: 0.0, -1.0: 0.0}, {1.0: high, -1.0: -low}
    for k, area in enumerate(sizing.areas, 1):
        if area.start is None or area.end is None or not area.work:
            continue
        side = 1.0 if area.work > 0 else -1.0
        centre, room = roomiest(samples, area.start, area.end, side, 0.06 * cycle)
        y = room / 2
        if room < 1.2 * step:
            centre = float(np.clip(centre, 0.025 * cycle, 0.975 * cycle))
            near = np.abs(samples.phi - centre) < 0.03 * cycle
            y = max(float((side * samples.moment[near]).max()), 0.0) + 0.8 * step
            if centre - last[side] < 0.05 * cycle:
                y = max(y, taken[side] + step)
            last[side], taken[side], reach[side] = centre, y, max(reach[side], y + step)
        text = panel.text(np.degrees(centre), side * y, f"A{k}", ha="center", va="center")
        text.set(fontsize=size, fontweight="bold")
        if room < 1.2 * step:
            text.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0})
    panel.set_ylim(-reach[-1.0], reach[1.0])


# -- reduced inertia -------------------------------------------------------------------------------------------------


def _inertia(panel: Axes, parts: dict[str, Array], samples: Samples) -> None:
    if not parts:
        say(panel, "Reduced inertia", "No body of the machine has mass or inertia:\nI* = 0, the flywheel is alone.")
        return
    phi, title = np.degrees(samples.phi), "Reduced inertia at the crank, by body (without the flywheel)"
    name_axes(panel, title, "crank angle φ, deg", "I*, kg m²")
    floor = np.zeros_like(phi)
    for k, (name, part) in enumerate(parts.items()):
        colour, hatch = _BODIES[k % len(_BODIES)], _HATCHES[k // len(_BODIES) % len(_HATCHES)]
        panel.fill_between(phi, floor, floor + part, facecolor=colour, hatch=hatch, edgecolor="white", lw=0.4, label=name)
        floor = floor + part
    panel.plot(phi, samples.inertia, color=BLACK, lw=1.8, label="I* total")
    panel.set_ylim(0.0, 1.05 * float(samples.inertia.max()))
    legend(panel)


# -- Wittenbauer's loop ----------------------------------------------------------------------------------------------


def _loop(panel: Axes, loop: Loop) -> None:
    name_axes(panel, "Wittenbauer's loop and its tangents", "I*, kg m²", "F = 2 W / ω², kg m²")
    height = float(np.ptp(loop.energy))
    right = float(loop.inertia.max()) or height or 1.0
    _tangents(panel, loop, 0.0, 1.04 * right)
    panel.axvline(0.0, color=BLACK, lw=0.9)
    low, high = panel.get_ylim()
    close = abs(loop.intercept_fast - loop.intercept_slow) < 0.05 * (high - low)
    marks = [("M", loop.intercept_fast, "bottom"), ("N", loop.intercept_slow, "top")]
    if close:
        marks = [("M, N", 0.5 * (loop.intercept_fast + loop.intercept_slow), "center")]
    for name, y, anchor in marks:
        panel.text(-0.02 * right, y, name, ha="right", va=anchor, fontweight="bold")
    panel.plot([0.0, 0.0], [loop.intercept_slow, loop.intercept_fast], color=PURPLE, lw=3.0, solid_capstyle="butt")
    panel.set_xlim(-0.17 * right, 1.04 * right / 0.56)
    panel.set_xticks([tick for tick in panel.get_xticks() if -1e-9 <= tick <= 1.05 * right])
    legend(panel)
    _inset(panel, loop)


def _tangents(panel: Axes, loop: Loop, left: float, right: float, shear: float = 0.0) -> None:
    """Loop, tangents and contact points; `shear` is taken off every slope."""
    panel.plot(loop.inertia, loop.energy - shear * loop.inertia, color=BLACK, lw=1.2, label="loop F(I*)")
    ends = np.array([left, right])
    for slope, intercept, contact, angle, colour, style in (
        (loop.slope_fast, loop.intercept_fast, loop.contact_fast, loop.angle_fast, BLUE, "-"),
        (loop.slope_slow, loop.intercept_slow, loop.contact_slow, loop.angle_slow, VERMILLION, "--"),
    ):
        which = "fastest" if colour == BLUE else "slowest"
        label = f"{which}, φ = {number(np.degrees(angle), 1e-9, 4)}°"
        panel.plot(ends, (slope - shear) * ends + intercept, color=colour, ls=style, lw=1.5, label=label)
        panel.plot(contact[0], contact[1] - shear * contact[0], "o", color=colour, ms=6, zorder=5)


def _inset(panel: Axes, loop: Loop) -> None:
    """The whole triangle from P, with F - I* upwards: slopes near 1 then open as ±eps, however small eps is."""
    inset = panel.inset_axes((0.67, 0.12, 0.31, 0.58))
    x, y = loop.far_point
    right = float(loop.inertia.max())
    span = right - x or float(np.ptp(loop.energy)) or 1.0
    _tangents(inset, loop, x, right + 0.05 * span, shear=1.0)
    inset.plot([0.0, 0.0], [loop.intercept_slow, loop.intercept_fast], color=PURPLE, lw=2.5, solid_capstyle="butt")
    inset.plot(x, y - x, "s", color=PURPLE, ms=6, zorder=6)
    inset.annotate("P", (x, y - x), xytext=(-2, 7), textcoords="offset points", ha="center", fontweight="bold")
    inset.margins(x=0.12, y=0.12)
    inset.set_title(f"F − I* against I*:\nfar point P at I* = {told(x, 4)}", fontsize=8.5)
    inset.tick_params(labelsize=8)
    inset.locator_params(nbins=3)


# -- speed -----------------------------------------------------------------------------------------------------------


def _speed(panel: Axes, sizing: Sizing, cycle: Cycle, samples: Samples) -> None:
    """The speed with every flywheel; those of no inertia are the bare machine, which is drawn once."""
    runs: list[tuple[str, str, Run | None]] = []
    if sizing.scene.inertia is not None:
        runs = [("given", f"given {number(sizing.scene.inertia, 0.0, 5)} kg m²{_eps(sizing.run)}", sizing.run)]
    names = {"exact": "exact", "approximate": "areas", "inertia_torque_flywheel": "inertia torque"}
    for candidate in () if runs else candidates(sizing):
        bare = candidate.inertia == 0.0
        if bare and any(run is sizing.run for _, _, run in runs):
            continue
        name = "no flywheel" if bare else f"{names[candidate.key]} {number(candidate.inertia, candidate.error, 5)} kg m²"
        runs.append((candidate.key, name + _eps(candidate.motion), candidate.motion))
    traces = [
        (key, label, RPM * turning_moment.speed_over_cycle(cycle, sizing.speed, run, samples.phi))
        for key, label, run in runs
        if run is not None
    ]
    origin = origin_of(sizing.speed * RPM, traces)
    name_axes(panel, "Speed of the crank over the cycle", "crank angle φ, deg", speed_label(sizing, origin))
    band(panel, sizing, origin)
    for key, label, values in traces:
        colour, style, width = _LINES[key]
        panel.plot(np.degrees(samples.phi), values - origin, color=colour, ls=style, lw=width, label=label)
    for _, label, run in runs:
        if run is None:
            panel.plot([], [], " ", label=label)
    legend(panel)


def _eps(run: Run | None) -> str:
    return ": no steady motion" if run is None else f", ε = {number(run.irregularity, run.error * run.irregularity, 4)}"


# -- a diagram of areas ------------------------------------------------------------------------------------------------


def _draw_areas(axes: NDArray[Any], sizing: Sizing) -> None:
    """Bars of the areas, their sums, and the speed at the crossings: between them a diagram of areas tells nothing."""
    works = np.array([area.work for area in sizing.areas])
    sums = np.array([0.0, *(area.accumulated for area in sizing.areas)])
    bars, panel, empty, speed = axes
    name_axes(bars, "Areas of the turning moment (angles not given)", "area", "work, J")
    places = np.arange(1, works.size + 1)
    for side, colour, label in ((1, SKY, "speeds up"), (-1, ORANGE, "slows down")):
        mine = side * works > 0
        if mine.any():
            bars.bar(places[mine], works[mine], color=colour, edgecolor=BLACK, lw=0.6, label=label)
    bars.axhline(0.0, color=BLACK, lw=0.8)
    _ticks(bars, "A", places)
    if works.any():
        legend(bars)

    name_axes(panel, "Accumulated areas", "crossing", "sum, J")
    places = np.arange(sums.size)
    panel.plot(places, sums, "o-", color=BLACK, lw=1.2, ms=4)
    for colour, marker, value, name in (
        (BLUE, "^", sizing.accumulated_max, "greatest"),
        (VERMILLION, "v", sizing.accumulated_min, "least"),
    ):
        at = int(np.abs(sums - value).argmin())
        label = f"{name}: S{at} = {told(value, 5, work_error(sizing))} J"
        panel.plot(at, value, marker, color=colour, ms=9, label=label)
        panel.axhline(value, color=colour, lw=0.9, ls=":")
    _ticks(panel, "S", places)
    legend(panel)

    why = "The loop needs the reduced inertia of a machine.\nA diagram of areas gives none, and counts all as flywheel."
    say(empty, "Wittenbauer's loop", why)

    inertia = sizing.scene.inertia or sizing.flywheel.exact or 0.0
    if inertia == 0.0:
        say(speed, "Speed of the crank", "The areas are all zero:\nthe speed never changes.")
        return
    eps = sizing.simulation.irregularity if sizing.simulation is not None else sizing.scene.irregularity or 0.0
    on_crank = inertia * sizing.scene.flywheel_ratio**2
    speeds = RPM * crossing_speeds(sums, sizing.speed * (1 - eps / 2), on_crank)
    origin = origin_of(sizing.speed * RPM, [("", "", speeds)])
    name_axes(speed, "Speed of the crank at the crossings", "crossing", speed_label(sizing, origin))
    band(speed, sizing, origin)
    speed.plot(places, speeds - origin, "o", color=BLUE, ms=6, label=f"{told(inertia)} kg m², ε = {told(eps, 4)}")
    _ticks(speed, "S", places)
    legend(speed)


def _ticks(panel: Axes, name: str, places: NDArray[np.intp]) -> None:
    """A tick at every place, at most two dozen of them."""
    shown = [int(k) for k in places[:: -(-places.size // 24)]]
    panel.set_xticks(shown, [f"{name}{k}" for k in shown])
