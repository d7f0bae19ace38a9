"""One figure of a sizing: turning moment, reduced inertia, Wittenbauer's loop, speed over the cycle.

Figures are objects of their own: no global state is touched, nothing is shown. Colours are those of Okabe and Ito, which
the colour-blind can tell apart; lines differ in their dashes as well.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from bondgraph.storage.files import replacement
from flywheel.numerics.units import figure as number
from flywheel.pictures import figures
from flywheel.pictures.figures import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RPM,
    SKY,
    VERMILLION,
    Loop,
    Samples,
    band,
    legend,
    name_axes,
    origin_of,
    say,
    speed_label,
    told,
)
from flywheel.regime import steady_motion
from flywheel.regime.steady_motion import Run
from flywheel.report.flywheels import candidates
from flywheel.report.power import balance_error
from flywheel.report.sizing import headline
from flywheel.sizing.results import Sizing

Array = NDArray[np.float64]

_BODIES = (SKY, ORANGE, GREEN, "#F0E442", PURPLE, BLUE, VERMILLION, "#BBBBBB")
_HATCHES = ("", "//", "..", "xx")
_LINES = {
    "exact": (BLUE, "-", 2.4),
    "given": (BLUE, "-", 2.4),
    "approximate": (VERMILLION, "--", 1.8),
    "inertia_torque_flywheel": (GREEN, ":", 2.2),
}
_SIZE, _DPI = (12.8, 9.6), 125
_MOST_NUMBERED = 40  # areas that get their numbers written in
_STYLE: Any = {"font.size": 10.0, "axes.titlesize": 11.5, "svg.hashsalt": "flywheel", "pdf.fonttype": 42}
_DATES: dict[str, dict[str, Any]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}


def plot(sizing: Sizing, path: str | Path) -> None:
    """Draw a sizing into a file: PNG (1600 x 1200 pixels), SVG or PDF, as its ending says; the same one every time.

    Raises ValueError for any other ending, OSError where the file cannot be written.
    """
    import warnings

    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in _DATES:
        raise ValueError(f"found {str(path)!r}, expected a file name ending in .png, .svg or .pdf")
    with replacement(path, kind) as fresh, rc_context(_STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # of a title; the picture has a box there
        draw(sizing).savefig(fresh, format=kind, dpi=_DPI, metadata=_DATES[kind])


def draw(sizing: Sizing) -> Figure:
    """The figure with its four panels, not yet written anywhere."""
    figure = Figure(figsize=_SIZE, layout="constrained")
    FigureCanvasAgg(figure)
    figure.get_layout_engine().set(w_pad=0.12, h_pad=0.12)  # type: ignore[union-attr, call-arg]
    figure.suptitle(headline(sizing), fontsize=13, parse_math=False)
    axes = figure.subplots(2, 2).ravel()
    if sizing.machine is None or sizing.cycle is None:
        figures.draw(axes, sizing)
    else:
        _draw_machine(axes, sizing)
    return figure


def _draw_machine(axes: NDArray[Any], sizing: Sizing) -> None:
    machine, cycle = sizing.machine, sizing.cycle
    assert machine is not None
    assert cycle is not None
    samples = figures.sampled(machine, cycle)
    if sizing.cyclic is None or sizing.constant is None:
        _moment(axes[0], sizing, samples)
    else:
        _moment(axes[0], sizing, figures.sampled(machine, sizing.constant, sizing.cyclic.constant_speed), samples)
    _inertia(axes[1], figures.bodies(machine, samples), samples)
    if sizing.run is None:
        for panel, title in ((axes[2], "Wittenbauer's loop"), (axes[3], "Speed of the crank")):
            say(
                panel,
                title,
                "Nothing acts on the machine and nothing in it has inertia:\nits speed never changes.",
            )
    else:
        _loop(axes[2], figures.loop(cycle, samples, sizing.speed, sizing.run))
        _speed(axes[3], sizing, samples)
    for panel in (axes[0], axes[1], axes[3]):
        _degrees(panel, sizing.scene.cycle)


# -- what every panel shares -----------------------------------------------------------------------------------------


def _degrees(panel: Axes, cycle: float) -> None:
    """Ticks at whole parts of a turn, where the panel has an axis of angles."""
    if not panel.axison:
        return
    degrees = float(np.degrees(cycle))
    panel.set_xlim(0.0, degrees)
    turns = degrees / 360
    if abs(turns - round(turns)) < 1e-9 and round(turns) <= 8:
        panel.xaxis.set_major_locator(MultipleLocator(45 * round(turns)))


# -- turning moment --------------------------------------------------------------------------------------------------


def _moment(panel: Axes, sizing: Sizing, samples: Samples, along: Samples | None = None) -> None:
    """The moment with its areas; where they hold for a constant speed, the moment along the motion as a thin line."""
    if not np.any(samples.moment):
        say(panel, "Turning moment", "No torque or force acts on the machine:\nM* is zero over the whole cycle.")
        return
    phi, moment = np.degrees(samples.phi), samples.moment
    name_axes(panel, _moment_title(sizing), "crank angle φ, deg", "M*, N m")
    for side, colour, label in ((1, SKY, "speeds up"), (-1, ORANGE, "slows down")):
        panel.fill_between(phi, np.where(side * moment > 0, moment, 0.0), color=colour, alpha=0.75, lw=0, label=label)
    panel.plot(phi, moment, color=BLACK, lw=1.4, label="M*")
    if along is not None:
        panel.plot(np.degrees(along.phi), along.moment, color=GREEN, lw=1.0, label="M* along the motion")
    _balance(panel, sizing, samples)
    panel.axhline(0.0, color=BLACK, lw=0.8)
    _number_areas(panel, sizing, samples)
    legend(panel)


def _moment_title(sizing: Sizing) -> str:
    if sizing.cyclic is None:
        return "Turning moment at the crank, and its areas"
    return f"Turning moment at a constant {told(RPM * sizing.cyclic.constant_speed, 6)} rpm, and its areas"


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
    if np.abs(samples.balance).max() > 1.5 * np.abs(samples.moment).max():
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
        centre, room = figures.roomiest(samples, area.start, area.end, side, 0.06 * cycle)
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
        say(
            panel,
            "Reduced inertia",
            "No body of the machine has mass or inertia:\nI* = 0, the flywheel is alone.",
        )
        return
    phi = np.degrees(samples.phi)
    name_axes(
        panel,
        "Reduced inertia at the crank, by body (without the flywheel)",
        "crank angle φ, deg",
        "I*, kg m²",
    )
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


def _speed(panel: Axes, sizing: Sizing, samples: Samples) -> None:
    runs = _runs(sizing)
    phi = np.degrees(samples.phi)
    assert sizing.cycle is not None
    traces = [
        (key, label, RPM * steady_motion.speed_over_cycle(sizing.cycle, sizing.speed, run, samples.phi))
        for key, label, run in runs
        if run is not None
    ]
    origin = origin_of(sizing.speed * RPM, traces)
    name_axes(panel, "Speed of the crank over the cycle", "crank angle φ, deg", speed_label(sizing, origin))
    band(panel, sizing, origin)
    for key, label, values in traces:
        colour, style, width = _LINES[key]
        panel.plot(phi, values - origin, color=colour, ls=style, lw=width, label=label)
    for _, label, run in runs:
        if run is None:
            panel.plot([], [], " ", label=label)
    legend(panel)


def _runs(sizing: Sizing) -> list[tuple[str, str, Run | None]]:
    """Every flywheel's key, label and motion; those of no inertia are the bare machine, which is drawn once."""
    if sizing.scene.inertia is not None:
        return [("given", f"given {number(sizing.scene.inertia, 0.0, 5)} kg m²{_eps(sizing.run)}", sizing.run)]
    names = {"exact": "exact", "approximate": "areas", "inertia_torque_flywheel": "inertia torque"}
    found: list[tuple[str, str, Run | None]] = []
    for candidate in candidates(sizing):
        bare = candidate.inertia == 0.0
        if bare and any(run is sizing.run for _, _, run in found):
            continue
        name = "no flywheel" if bare else f"{names[candidate.key]} {number(candidate.inertia, candidate.error, 5)} kg m²"
        found.append((candidate.key, name + _eps(candidate.motion), candidate.motion))
    return found


def _eps(run: Run | None) -> str:
    return ": no steady motion" if run is None else f", ε = {number(run.irregularity, run.error * run.irregularity, 4)}"
