"""Reactions of joints over the motion: as curves over the driver or the time, or as hodographs.

A hodograph is drawn in the frame's own directions, with equal scales; numbers along it tell where the driver stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, sqrt
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.positions import Poses
from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.motions.joint_forces import Axis, ForceCurve
from flywheel.numerics.faults import Fault, SceneError, nearest
from flywheel.numerics.units import figure as number
from flywheel.pictures import figures
from flywheel.pictures.figures import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION
from flywheel.scene.linkage import SLIDE
from flywheel.scene.scene import TURN

Array = NDArray[np.float64]

_PANEL = 4.4  # inches
_KILO = 1e4  # N: larger forces are given in kN
_STEP = 30.0  # deg between two marks
_ALONG = 11  # marks along a stroke
_FEWEST = 12  # positions of a curve that is closed
_WIDER = 1.01  # times the widest step: what the step that closes it may be
_NOTHING = 1e-9  # of the largest value: smaller ones are none


def polar(found: Reactions, path: str | Path | None = None, joints: Sequence[str] | None = None) -> Figure:
    """Draw the reactions of joints over the motion, and save the picture if a file is named.

    Pins, slots, fixed joints and couplings are drawn as hodographs: the tip of the force that the first body exerts on the
    second, marked every 30 deg of the crank. Slides are drawn as normal force (and moment) over the driver's coordinate.
    Where the positions go once round, up to the one before the first, the curves are closed; rounding is drawn as 0.

    Args:
        found: what `flywheel.kinetostatics.reactions` gives, at positions in ascending order.
        path: where to save the picture, ending in .png, .svg or .pdf; the same reactions give the same file every time.
        joints: names of joints and couplings; all if None.

    Raises:
        SceneError: for a name that the mechanism does not have, for fewer than two positions.
        ValueError: for any other file ending.

    """
    wanted = list(found.forces) if joints is None else list(joints)
    unknown = [name for name in wanted if name not in found.forces]
    if unknown:
        near = {name: nearest(name, list(found.forces)) for name in unknown}
        known = "one of " + ", ".join(found.forces)
        raise SceneError([Fault("joints", repr(n), known, f"did you mean {near[n]!r}?" if near[n] else "") for n in unknown])
    if np.unique(found.poses.q).size < 2:
        raise SceneError([Fault("positions", "a single one", "two at least, for a curve between them")])
    linkage, found = found.poses.linkage, found.cleared()
    slides = {joint.name for joint in linkage.joints if joint.kind == SLIDE}
    columns = ceil(sqrt(len(wanted)))
    rows = -(-len(wanted) // max(columns, 1))
    title = "Reactions: what the first body of each joint does to the second"
    made = figures.figure(_PANEL * columns, _PANEL * rows, title if columns > 1 else title.replace("body ", "body\n"))
    panels = made.subplots(rows, columns, squeeze=False).ravel().tolist()
    for panel in panels[len(wanted) :]:
        panel.set_axis_off()
    round_ = _whole_round(found.poses)
    x = np.asarray(1000.0 * found.poses.q if linkage.sliding else np.degrees(found.poses.q))  # mm, or degrees
    if round_:
        x = np.append(x, x[0] + round_)
    forces = {name: _ended(values, x.size) for name, values in found.forces.items()}
    for panel, name in zip(panels, wanted, strict=False):
        if not np.isfinite(forces[name]).any():
            why = "Nothing is known of this force:\nredundant constraints leave it open,\nor friction locks everywhere."
            panel.set_title(name, parse_math=False)
            panel.set_axis_off()
            panel.text(0.5, 0.5, why, ha="center", va="center", transform=panel.transAxes, color=GREY)
        elif name in slides:
            parts = {part: _ended(values, x.size) for part, values in found.components[name].items()}
            over_motion(panel, name, x, parts, linkage.sliding)
        else:
            hodograph(panel, name, x, forces[name], linkage.sliding)
    made.draw_without_rendering()
    for panel, name in zip(panels, wanted, strict=False):
        if panel.axison and name not in slides:
            _mark(panel, x, forces[name], linkage.sliding)
    if path is not None:
        figures.save(made, path)
    return made


def _whole_round(poses: Poses) -> float:
    """Turns (deg) after which positions go on with the first one; 0 where they do not, or end there already.

    They do where that lies no further from the last than others from one another, in the crank's angle and in the bodies'
    places: some mechanisms need more than one turn to come round.
    """
    q = poses.q
    if poses.linkage.sliding or q.size < _FEWEST or np.any(np.diff(q) <= 0.0):
        return 0.0
    turns = ceil((q[-1] - q[0]) / TURN - 1e-12)
    places = np.concatenate((poses.value[:, :2], np.cos(poses.value[:, 2:]), np.sin(poses.value[:, 2:])), axis=1)
    steps = np.abs(np.diff(places, axis=2)).max(axis=(0, 1))
    left, gap = q[0] + turns * TURN - q[-1], np.abs(places[..., 0] - places[..., -1]).max()
    near = left <= _WIDER * np.diff(q).max() and gap <= _WIDER * steps.max()
    return float(360.0 * turns) if near and left > 1e-12 else 0.0


def _ended(values: Array, size: int) -> Array:
    """Values with the first one again at the end, where there is to be one more."""
    return values if values.shape[-1] == size else np.concatenate((values, values[..., :1]), axis=-1)


def _unit(force: Array) -> tuple[float, str]:
    """What forces are multiplied by, and the unit that they then have."""
    return (1e-3, "kN") if float(np.nanmax(np.abs(force))) >= _KILO else (1.0, "N")


def _title(name: str, x: Array, size: Array, sliding: bool) -> str:
    """The joint's name and its largest force, with its place."""
    scale, unit = _unit(size)
    worst = int(np.nanargmax(size))
    place = f"{x[worst]:.4g}".replace("-", "−") + (" mm" if sliding else "°")
    return f"{name}: at most {number(scale * float(size[worst]), 0.0, 4)} {unit}, at {place}"


# -- hodographs ------------------------------------------------------------------------------------------------------


def hodograph(panel: Axes, name: str, x: Array, force: Array, sliding: bool = False) -> None:
    """The tip of a force (2, n) in N over the motion; x is the driver's coordinate in deg (mm where it slides)."""
    scale, unit = _unit(force)
    figures.name_axes(panel, _title(name, x, np.hypot(*force), sliding), f"$F_x$, {unit}", f"$F_y$, {unit}")
    panel.plot(*(scale * force), color=BLUE, lw=1.6, zorder=3)
    worst = scale * force[:, int(np.nanargmax(np.hypot(*force)))]
    panel.plot([0.0, worst[0]], [0.0, worst[1]], color=VERMILLION, lw=1.2, zorder=2.5)
    panel.plot(0.0, 0.0, "+", color=BLACK, ms=9, zorder=4)
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.14)
    panel.locator_params(nbins=5)


def marks(x: Array, sliding: bool) -> Array:
    """Where along the motion a hodograph is marked: every 30 deg (wider where that crowds), or evenly along a stroke."""
    low, high = float(np.min(x)), float(np.max(x))
    if sliding:
        return np.linspace(low, high, _ALONG)
    step = _STEP * max(ceil((high - low) / 360.0 - 1e-9), 1)
    places = np.asarray(step * np.arange(ceil(low / step - 1e-9), int(high / step + 1e-9) + 1), dtype=float)
    return places[:-1] if places.size > 1 and abs(places[-1] - places[0] - 360.0) < 1e-6 else places


def _mark(panel: Axes, x: Array, force: Array, sliding: bool) -> None:
    """Dots with the driver's coordinate beside them, clear of the curve."""
    scale, _ = _unit(force)
    places = marks(x, sliding)
    spots = scale * np.stack([np.interp(places, x, part) for part in force], axis=1)
    places, spots = places[np.isfinite(spots).all(axis=1)], spots[np.isfinite(spots).all(axis=1)]
    if len(places) > 1 and (places[-1] - places[0]) % 360.0 == 0.0 and not sliding and np.allclose(spots[0], spots[-1]):
        places, spots = places[:-1], spots[:-1]  # a curve that is closed ends where it begins
    panel.plot(*spots.T, "o", color=BLUE, ms=4, zorder=4)
    texts = [panel.text(0.0, 0.0, f"{place:.4g}".replace("-", "−"), fontsize=8.0, zorder=5) for place in places]
    outwards = spots - scale * np.nanmean(force, axis=1)
    figures.settle(panel, texts, spots, [scale * force], outwards)


# -- slides ----------------------------------------------------------------------------------------------------------


def over_motion(panel: Axes, name: str, x: Array, parts: Mapping[str, Array], sliding: bool = False) -> None:
    """The normal forces (N) of a slide over the driver's coordinate, and its moment (N m) on a scale of its own."""
    forces = {part: values for part, values in parts.items() if part in ("normal", "front", "rear")}
    size = np.max([np.abs(values) for values in forces.values()], axis=0)
    scale, unit = _unit(size)
    xlabel = "position x of the driver, mm" if sliding else "crank angle φ, deg"
    figures.name_axes(panel, _title(name, x, size, sliding), xlabel, f"normal force, {unit}")
    for (part, values), colour, dashes in zip(forces.items(), (BLUE, VERMILLION), ("-", "--"), strict=False):
        panel.plot(x, scale * values, color=colour, ls=dashes, lw=1.6, label=part)
    panel.axhline(0.0, color=BLACK, lw=0.8)
    panel.set_xlim(float(np.min(x)), float(np.max(x)))
    if not sliding and np.ptp(x) > 180.0:
        panel.xaxis.set_major_locator(MultipleLocator(90.0 * ceil(np.ptp(x) / 720.0)))
    moment = parts.get("moment")
    if moment is not None and float(np.nanmax(np.abs(moment))) > _NOTHING * float(np.nanmax(size)):
        other = panel.twinx()
        other.plot(x, moment, color=PURPLE, ls=":", lw=1.6)
        other.set_ylabel("moment, N m (dotted)", color=PURPLE)
    if len(forces) > 1:
        panel.legend(loc="best", fontsize=8.5)


# -- curves over the driver or the time ------------------------------------------------------------------------------

_WIDTH, _ROW, _TALL = 11.0, 2.9, 4.2  # inches: of a picture, of a panel, and of one with the curves of several joints
_DASHES = ("-", "--", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)))
_STYLES = {
    "x": (BLUE, "-"),
    "y": (VERMILLION, "--"),
    "normal": (BLUE, "-"),
    "tangential": (BLUE, "-"),
    "radial": (VERMILLION, "--"),
    "front": (GREEN, "-."),
    "rear": (ORANGE, (0, (3, 1))),
    "friction": (ORANGE, "-."),
    "moment": (PURPLE, ":"),
    "driving": (GREEN, "-"),
    "resultant": (BLACK, "-"),
}
_SYMBOLS = {"x": "$F_x$", "y": "$F_y$"}
_MOST_EDGES = 40  # breakpoints that are drawn
_MOST_TURNS = 8.0  # from which on the crank's way is told in turns
_SEAM = 1e-4  # deg: how near to the cycle's end its last value stands
_POSITIONS = {"phi": "crank angle φ", "x": "position x of the driver"}


def curves(found: Sequence[ForceCurve], over: Axis, title: str, path: str | Path | None = None, *, together: bool) -> Figure:
    """Draw reactions and driving actions over the driver or the time, and save the picture if a file is named.

    Every curve's least and greatest value are marked, and told beside its name.

    Args:
        found: what `flywheel.motions.joint_forces.force_curves` gives, at positions as close as the picture needs, both
            sides of every jump among them.
        over: the axis.
        title: of the picture.
        path: where to save the picture, ending in .png, .svg or .pdf.
        together: one panel for each component with the curves of all joints, instead of one for each joint.

    """
    scale, unit = {"m": (1000.0, "mm")}.get(over.unit, (1.0, over.unit))
    if unit == "deg" and np.ptp(over.values) > _MOST_TURNS * 360.0:
        scale, unit = 1.0 / 360.0, "turns"
    x, edges = scale * over.values, scale * over.edges
    groups: dict[str, list[ForceCurve]] = {}
    for curve in found:
        joint = curve.name.removesuffix(f".{curve.component}")
        driving = f"{joint}: driving action" if curve.component == "driving" else joint
        groups.setdefault(f"{curve.component}|{curve.unit}" if together else driving, []).append(curve)
    height = (_TALL if together else _ROW) * len(groups) + 0.8
    made = figures.figure(_WIDTH, height, "\n".join(wrap(title.replace(" kg m^2", "\u00a0kg\u00a0m²"), 100)))
    panels = made.subplots(len(groups), 1, squeeze=False, sharex=True).ravel().tolist()
    for panel, (name, group) in zip(panels, groups.items(), strict=True):
        (_together if together else _singly)(panel, name, group, x)
        for edge in edges if edges.size <= _MOST_EDGES else ():
            panel.axvline(edge, color=GREY, lw=0.6, ls=(0, (1, 3)), zorder=0.5)
        panel.axhline(0.0, color=GREY, lw=0.8, zorder=1)
        panel.grid(color=figures.PALE, linewidth=0.6)
        panel.set_axisbelow(True)
    low, high = float(np.min(x)), float(np.max(x))
    if unit == "deg" and abs(high - round(high)) < _SEAM:
        high = round(high)
    panels[-1].set_xlim(low, high)
    if unit == "deg" and 180.0 < high - low <= 1440.0:
        panels[-1].xaxis.set_major_locator(MultipleLocator(45.0 * ceil((high - low) / 360.0 - 1e-9)))
    panels[-1].set_xlabel(f"{_POSITIONS.get(over.name, 'time')}, {unit}")
    if path is not None:
        figures.save(made, path)
    return made


def _singly(panel: Axes, name: str, group: Sequence[ForceCurve], x: Array) -> None:
    """The components of one joint: forces on the left, couples on a scale of their own on the right."""
    forces = [curve for curve in group if curve.unit == "N"]
    couples = [curve for curve in group if curve.unit != "N"]
    right = bool(forces) and any(np.nanmax(np.abs(curve.values), initial=0.0) > 0.0 for curve in couples)
    for mine, axes in ((forces, panel), (couples, panel.twinx() if right else panel)):
        if not mine:
            continue
        scale, unit = _scaled(mine)
        for curve in mine:
            words = _SYMBOLS.get(curve.component, "" if curve.component == "driving" else curve.component), unit
            _line(axes, panel, x, scale * curve.values, words, *_STYLES.get(curve.component, (GREY, "-")))
        if mine is forces or right or not forces:
            rotating = "moment" if group[0].component == "driving" else ", ".join(curve.component for curve in couples)
            axes.set_ylabel(f"{'force' if mine is forces else rotating}, {unit}")
    panel.set_title(name, parse_math=False, loc="left")
    _beside(panel, right=right)


def _together(panel: Axes, name: str, group: Sequence[ForceCurve], x: Array) -> None:
    """One component of several joints."""
    scale, unit = _scaled(group)
    for k, curve in enumerate(group):
        dashes = _DASHES[k % len(_DASHES)]
        joint = curve.name.removesuffix(f".{curve.component}")
        _line(panel, panel, x, scale * curve.values, (joint, unit), figures.BODIES[k % len(figures.BODIES)], dashes)
    component = name.partition("|")[0]
    words = {"driving": "driving action"}.get(component, _SYMBOLS.get(component, component))
    panel.set_ylabel(f"{words}, {unit}")
    _beside(panel, right=False)


def _line(axes: Axes, legend: Axes, x: Array, values: Array, words: tuple[str, str], colour: str, dashes: Any) -> None:
    """A curve with its least and greatest value marked, and told in the legend of a panel."""
    name, unit = words
    if np.isnan(values).all():
        legend.plot([], [], color=colour, ls=dashes, label=f"{name}: not known")
        return
    low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
    least, greatest = (number(float(values[k]), 0.0, 4).replace("-", "−") for k in (low, high))
    axes.plot(x, values, color=colour, ls=dashes, lw=1.6, zorder=3)
    extent = f"{least} {unit}" if values[low] == values[high] else f"{least} to {greatest} {unit}"
    label = f"{name}: {extent}" if name else extent
    legend.plot([], [], color=colour, ls=dashes, lw=1.6, label=label)
    if values[low] < values[high]:
        axes.plot(x[low], values[low], "v", x[high], values[high], "^", color=colour, ms=5.5, zorder=4, clip_on=False)


def _beside(panel: Axes, *, right: bool) -> None:
    """The legend to the right of a panel, clear of its curves and of a scale there."""
    panel.legend(
        loc="upper left", bbox_to_anchor=(1.09 if right else 1.01, 1.02), fontsize=8.5, frameon=False, handlelength=2.6
    )


def _scaled(group: Sequence[ForceCurve]) -> tuple[float, str]:
    """What the values of curves of one unit are multiplied by, and the unit that they then have."""
    largest = max(
        (float(np.nanmax(np.abs(c.values), initial=0.0)) for c in group if not np.isnan(c.values).all()), default=0.0
    )
    return (1e-3, f"k{group[0].unit}") if largest >= _KILO else (1.0, group[0].unit)
