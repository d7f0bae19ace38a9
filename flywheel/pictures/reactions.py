"""Reactions of joints over the motion: as curves over the driver or the time, or as hodographs.

A hodograph is drawn in the frame's own directions, with equal scales; numbers along it give the driver's position. Where a
force jumps, its curve is broken, and a dotted line marks the gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, sqrt
from pathlib import Path
from textwrap import fill, wrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from flywheel.language import text as _
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.motions.joint_forces import CurveAxis, ForceCurve
from flywheel.numerics.faults import Fault, SceneError, nearest
from flywheel.pictures import figures, forms, written
from flywheel.pictures.figures import BLACK, BLUE, COLOURS, GREEN, GREY, ORANGE, PURPLE, VERMILLION
from flywheel.pictures.forms import Diagram, DiagramRow
from flywheel.scene.scene import TURN

Array = NDArray[np.float64]

_PANEL = 4.4  # inches
_LINE_LENGTH = 34  # letters of a sentence that stands for a panel
_KILO = 1e4  # N: larger forces are given in kN
_FEWEST = 12  # positions of a curve that is closed
_WIDER = 1.01  # times the widest step: what the step that closes it may be


def polar(reactions: Reactions, path: str | Path | None = None, joints: Sequence[str] | None = None) -> Figure:
    """Draws the reactions of joints over the motion, and saves the picture if a file is named.

    Pins, slots, fixed joints and couplings are drawn as hodographs: the tip of the force that the first body exerts on the
    second, marked every 30 deg of the crank. Slides are drawn as normal force (and moment) over the driver's coordinate;
    so is the driving action, in a separate panel. If the positions cover a whole turn except its end, the curves are closed;
    rounding is drawn as 0.

    Args:
        reactions: result of `flywheel.kinetostatics.reactions`, at positions in ascending order.
        path: where to save the picture, ending in .png, .svg or .pdf; the same reactions give the same file every time.
        joints: names of joints and couplings; all if None.

    Raises:
        SceneError: for a name that the mechanism does not have, for fewer than two positions.
        ValueError: for any other file ending.

    """
    names = list(reactions.forces) if joints is None else list(joints)
    unknown = [name for name in names if name not in reactions.forces]
    if unknown:
        near = {name: nearest(name, list(reactions.forces)) for name in unknown}
        expected = "one of " + ", ".join(reactions.forces)
        raise SceneError(
            [Fault("joints", repr(n), expected, f"did you mean {near[n]!r}?" if near[n] else "") for n in unknown]
        )
    if np.unique(reactions.poses.q).size < 2:
        raise SceneError([Fault("positions", "a single one", "two at least, for a curve between them")])
    columns = ceil(sqrt(len(names) + 1))
    rows = -(-(len(names) + 1) // columns)
    title = _("Reactions: actions of the first body of each joint on the second")
    made = figures.figure(_PANEL * columns, _PANEL * rows, "\n".join(wrap(title, 30 * columns)))
    panels = made.subplots(rows, columns, squeeze=False).ravel().tolist()
    for panel in panels[len(names) + 1 :]:
        panel.set_axis_off()
    _fill(reactions, made, names, panels)
    if path is not None:
        figures.save(made, path)
    return made


def _fill(reactions: Reactions, made: Figure, names: Sequence[str], panels: Sequence[Axes]) -> None:
    """Draws the reaction of each joint and the driving action of the driver into their panels."""
    linkage, reactions = reactions.poses.linkage, reactions.cleared()
    reactions = reactions._replace(actions={linkage.driver: reactions.action})
    q = reactions.poses.q
    if turn := _whole_round(reactions.poses):
        q = np.append(q, q[0] + turn)
    diagram = Diagram(forms.force_figures(reactions, q, names))
    places = dict(zip([*(f"joints.{k}" for k in range(len(names))), "driving.0"], panels, strict=False))
    x = np.asarray(1000.0 * q if linkage.sliding else np.degrees(q))  # mm, or degrees
    plane, done = [], set()
    for row in forms.force_rows(diagram.figures, linkage, q):
        panel = places[row.key]
        curves = [row.factor * diagram.values(curve.of) for curve in row.curves]
        if not curves:
            figures.say(panel, row.title, fill(row.about, _LINE_LENGTH))
        elif row.kind == "plane":
            path = np.stack(curves)
            # the tip of a force over the motion, with the largest one
            figures.name_axes(panel, f"{row.title}\n{row.about}", *(f"{curve.name}, {row.unit}" for curve in row.curves))
            _draw_path(panel, row, path)
            worst = path[:, int(np.nanargmax(np.hypot(*path)))]
            panel.plot([0.0, worst[0]], [0.0, worst[1]], color=VERMILLION, ls="--", lw=1.2, zorder=2.5)
            panel.set_aspect("equal", adjustable="datalim")
            panel.margins(0.14)
            panel.locator_params(nbins=5)
            plane.append((panel, row, q, path))
        elif row.key in done:
            # the moment of a slide on a separate scale
            other, (of_moment,) = panel.twinx(), row.curves
            _broken(other, x, curves[0], row.breaks, color=COLOURS[of_moment.colour], ls=of_moment.dash, lw=of_moment.width)
            other.set_ylabel(_("moment, N m (dotted)"), color=COLOURS[of_moment.colour])
        else:
            _over_driver(panel, row, x, curves, linkage.sliding)
        done.add(row.key)
    figures.lay_out(made)
    for panel, row, at, path in plane:
        panel.autoscale(enable=False)  # its limits are those that make scales equal
        panel.set_adjustable("box")
        _mark(panel, row, at, path, linkage.sliding)


def _whole_round(poses: Poses) -> float:
    """Turns (rad) after which positions continue with the first one; 0 if they do not, or end there already.

    They continue if the distance from the last to the first is no greater than between others, in the crank's angle and in
    the bodies' places: some mechanisms need more than one turn to return.
    """
    q = poses.q
    if poses.linkage.sliding or q.size < _FEWEST or np.any(np.diff(q) <= 0.0):
        return 0.0
    turns = ceil((q[-1] - q[0]) / TURN - 1e-12)
    places = np.concatenate((poses.value[:, :2], np.cos(poses.value[:, 2:]), np.sin(poses.value[:, 2:])), axis=1)
    steps = np.abs(np.diff(places, axis=2)).max(axis=(0, 1))
    left, gap = q[0] + turns * TURN - q[-1], np.abs(places[..., 0] - places[..., -1]).max()
    near = left <= _WIDER * np.diff(q).max() and gap <= _WIDER * steps.max()
    return TURN * turns if near and left > 1e-12 else 0.0


# -- hodographs ------------------------------------------------------------------------------------------------------

_NEAR, _MANY = 0.14, 4  # of the largest force, marks within it: what is enlarged in a corner
_CORNERS = ((0.6, 0.61), (0.12, 0.61), (0.6, 0.09), (0.12, 0.09))
_WIDE, _TALL_CORNER = 0.37, 0.31  # of a panel's width and height: what is enlarged in a corner


def _draw_path(panel: Axes, row: DiagramRow, path: Array) -> None:
    """A hodograph, broken where the force jumps, with dotted lines over the gaps; and the origin."""
    panel.plot(*np.insert(path, [k for k in row.breaks if k], np.nan, axis=1), color=BLUE, lw=1.6, zorder=3)
    for k in row.breaks:
        panel.plot(*path[:, [k - 1, k]], color=GREY, ls=":", lw=1.2, zorder=2.8)
    panel.plot(0.0, 0.0, "+", color=BLACK, ms=9, zorder=4)


def _mark(panel: Axes, row: DiagramRow, positions: Array, path: Array, sliding: bool) -> None:
    """Dots with the driver's coordinate beside them; those crowded around the origin are enlarged in a corner."""
    spots = np.stack([np.interp(row.along, positions, part) for part in path], axis=1)
    places = (1000.0 if sliding else 180.0 / np.pi) * np.array(row.along)
    most, unit_of_place = float(np.nanmax(np.hypot(*path))), "" if sliding else "°"
    crowd = np.hypot(*spots.T) <= _NEAR * most
    panel.plot(*spots.T, "o", color=BLUE, ms=4, zorder=4)
    cut = np.insert(path, [k for k in row.breaks if k], np.nan, axis=1)
    corner = _free_corner(panel, cut) if np.count_nonzero(crowd) >= _MANY else None
    gaps = [path[:, [k - 1, k]] for k in row.breaks]
    jumps = [ends for ends in gaps if _NEAR * most < np.hypot(*np.diff(ends)[:, 0])]
    words = [(panel, places[~crowd], spots[~crowd], jumps)]
    if corner is not None and (radius := float(np.hypot(*spots[crowd].T).max())) > 0.0:
        near = panel.inset_axes((*corner, _WIDE, _TALL_CORNER))
        _draw_path(near, row, path)
        near.plot(*spots[crowd].T, "o", color=BLUE, ms=3.5, zorder=4)
        middle = 0.5 * (spots[crowd].max(axis=0) + spots[crowd].min(axis=0))
        half = 0.6 * np.maximum(np.ptp(spots[crowd], axis=0), 0.2 * radius) + 0.12 * radius
        box = np.array(panel.bbox.size) * (_WIDE, _TALL_CORNER)
        half = float((half / box).max()) * box  # equal scales
        near.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
        near.tick_params(labelsize=7)
        near.locator_params(nbins=3)
        near.set_title(_("enlarged, {unit}", unit=row.unit), fontsize=8, pad=3)
        near.apply_aspect(near.get_axes_locator()(near, None))  # type: ignore[arg-type]  # a place needs no renderer
        words.append((near, places[crowd], spots[crowd], []))
    elif corner is None:
        words = [(panel, places, spots, jumps)]
    for where, at, dots, leaps in words:
        names = [figures.name(where, _("jump"), fontsize=8.0, color=GREY, zorder=5) for ends in leaps[:1]]
        anchors = [ends[:, np.argsort(np.hypot(*ends))] @ (0.3, 0.7) for ends in leaps[:1]]
        names += [
            figures.name(
                where, written(float(place), 4) + unit_of_place, fontsize=7.0 if where is not panel else 8.0, zorder=5
            )
            for place in at
        ]
        away = (1.0, 1.0 if corner is None or corner[1] < 0.5 else -1.0)
        outwards = np.concatenate([np.tile(away, (len(anchors), 1)), dots - np.nanmean(path, axis=1)])
        spread = np.array([*anchors, *dots]).reshape(-1, 2)
        lines = [path]
        if where is panel and corner is not None and len(words) > 1:
            lines.append(_rows_of_corner(panel, corner))
        figures.settle(where, names, spread, lines, outwards, keep=len(anchors))


def _rows_of_corner(panel: Axes, corner: tuple[float, float]) -> Array:
    """A line (2, m) back and forth over an enlarged corner with its numbers and title: no name fits between its rows."""
    low, high = np.subtract(corner, (0.08, 0.1)), np.add(corner, (_WIDE, _TALL_CORNER + 0.08))
    heights = np.repeat(np.linspace(low[1], high[1], 25), 2)
    across = np.resize([low[0], high[0], high[0], low[0]], heights.size)
    return np.asarray(panel.transData.inverted().transform(panel.transAxes.transform(np.stack((across, heights), axis=1))).T)


def _free_corner(panel: Axes, path: Array) -> tuple[float, float] | None:
    """A corner of a panel (a share of its width and height) that no part of a path enters, None if there is none."""
    drawn = figures.along(panel.transAxes.inverted().transform(panel.transData.transform(path.T)).T, 0.01)
    for corner in _CORNERS:
        low = np.array(corner) - 0.06
        high = low + np.array([_WIDE + 0.08, _TALL_CORNER + 0.12])
        if not ((drawn >= low) & (drawn <= high)).all(axis=1).any():
            return corner
    return None


# -- over the driver -------------------------------------------------------------------------------------------------


def _over_driver(panel: Axes, row: DiagramRow, x: Array, curves: Sequence[Array], sliding: bool) -> None:
    """The normal forces of a slide, or a driving action, over the driver's coordinate."""
    position = _("position x of the driver, mm") if sliding else _("crank angle φ, deg")
    figures.name_axes(panel, f"{row.title}\n{row.about}", position, f"{row.label}, {row.unit}")
    for curve, values in zip(row.curves, curves, strict=True):
        _broken(panel, x, values, row.breaks, color=COLOURS[curve.colour], ls=curve.dash, lw=curve.width, label=curve.name)
    panel.axhline(0.0, color=BLACK, lw=0.8)
    panel.set_xlim(float(np.min(x)), float(np.max(x)))
    if not sliding and np.ptp(x) > 180.0:
        panel.xaxis.set_major_locator(MultipleLocator(90.0 * ceil(np.ptp(x) / 720.0)))
    if len(curves) > 1:
        panel.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=4.2, ncols=3, fontsize=8.5, frameon=False)


def _part(component: str) -> str:
    """A component of a force in words."""
    words = {
        "x": "Fx",
        "y": "Fy",
        "normal": _("normal"),
        "tangential": _("tangential"),
        "radial": _("radial"),
        "front": _("front"),
        "rear": _("rear"),
        "friction": _("friction"),
        "moment": _("moment"),
        "driving": _("driving action"),
        "resultant": _("resultant"),
    }
    return words.get(component, component)


def _broken(panel: Axes, x: Array, values: Array, breaks: Sequence[int], **style: Any) -> None:
    """A curve over the driver that is broken where it jumps, with a dotted line there."""
    panel.plot(np.insert(x, breaks, np.nan), np.insert(values, breaks, np.nan), **style)
    for k in breaks:
        panel.plot(x[[k - 1, k]], values[[k - 1, k]], color=GREY, ls=":", lw=1.0, zorder=2.5)


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
_MOST_EDGES = 40  # breakpoints that are drawn
_MOST_TURNS = 8.0  # from which on the crank's way is stated in turns
_SEAM = 1e-4  # deg: how near to the cycle's end its last value stands


def curves(
    force_curves: Sequence[ForceCurve], over: CurveAxis, title: str, path: str | Path | None = None, *, together: bool
) -> Figure:
    """Draws reactions and driving actions over the driver or the time, and saves the picture if a file is named.

    The least and greatest value of every curve are marked, and listed with its name.

    Args:
        force_curves: result of `flywheel.motions.joint_forces.force_curves`, at positions as close as the picture needs,
            with both sides of every jump.
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
    for curve in force_curves:
        joint = curve.name.removesuffix(f".{curve.component}")
        driving = _("{joint}: driving action", joint=joint) if curve.component == "driving" else joint
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
    names = {"phi": _("crank angle φ"), "x": _("position x of the driver")}
    units = {"deg": _("deg"), "turns": _("turns")}
    panels[-1].set_xlabel(f"{names.get(over.name, _('time'))}, {units.get(unit, unit)}")
    if path is not None:
        figures.save(made, path)
    return made


def _singly(panel: Axes, name: str, group: Sequence[ForceCurve], x: Array) -> None:
    """The components of one joint: forces on the left, couples on a separate scale on the right."""
    forces = [curve for curve in group if curve.unit == "N"]
    couples = [curve for curve in group if curve.unit != "N"]
    right = bool(forces) and any(np.nanmax(np.abs(curve.values), initial=0.0) > 0.0 for curve in couples)
    for mine, axes in ((forces, panel), (couples, panel.twinx() if right else panel)):
        if not mine:
            continue
        scale, unit = _scaled(mine)
        for curve in mine:
            words = "" if curve.component == "driving" else _part(curve.component), unit
            _line(axes, panel, x, scale * curve.values, words, *_STYLES.get(curve.component, (GREY, "-")))
        if mine is forces or right or not forces:
            rotating = ", ".join(_part(curve.component) for curve in couples)
            rotating = _("moment") if group[0].component == "driving" else rotating
            axes.set_ylabel(f"{_('force') if mine is forces else rotating}, {unit}")
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
    panel.set_ylabel(f"{_part(component)}, {unit}")
    _beside(panel, right=False)


def _line(axes: Axes, legend: Axes, x: Array, values: Array, words: tuple[str, str], colour: str, dashes: Any) -> None:
    """A curve with its least and greatest value marked, and listed in the legend of a panel."""
    name, unit = words
    if np.isnan(values).all():
        legend.plot([], [], color=colour, ls=dashes, label=_("{name}: not known", name=name))
        return
    low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
    least, most = (written(float(values[k]), 4) for k in (low, high))
    _broken(axes, x, values, forms.breaks(x, values), color=colour, ls=dashes, lw=1.6, zorder=3)
    extent = _("{least} to {most} {unit}", least=least, most=most, unit=unit)
    extent = f"{least} {unit}" if values[low] == values[high] else extent
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
    """Factor of the values of curves of one unit, and the resulting unit."""
    largest = max(
        (float(np.nanmax(np.abs(c.values), initial=0.0)) for c in group if not np.isnan(c.values).all()), default=0.0
    )
    return (1e-3, f"k{group[0].unit}") if largest >= _KILO else (1.0, group[0].unit)
