"""Mechanisms drawn at chosen positions, with the paths of their points.

Joints have the symbols of the field: circles for pins, hatched ground under fixed parts, blocks on guides, pins in slots,
pitch circles for gears. Every body has a colour of its own; the frame is black.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import log
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.equations import Poses
from flywheel.motions.velocities import FINITE, INFINITE, Centres, InstantCentre, InstantCentres
from flywheel.numerics.units import figure as number
from flywheel.pictures import figures, sketch
from flywheel.pictures.figures import BLACK, BODIES, shade
from flywheel.pictures.sketch import CLOSED, Shape, View, placed
from flywheel.scene.linkage import FRAME
from flywheel.scene.scene import Scene
from flywheel.tables.rows import wrapped

Array = NDArray[np.float64]
Artist = Line2D | Polygon

_MARGIN = 0.05  # of the mechanism's extent, around it
_PAGE = 1.4  # width to height
_METRES = 1.0  # m: mechanisms below it are drawn in mm
_GHOSTS = frozenset({"bar", "rail", "plate", "block", "cam"})
_LISTED = 8  # positions that the title names
_WIDEST, _TALLEST, _ONE = 10.0, 9.0, 6.4  # inches: a picture, and one of several


class Pen(NamedTuple):
    """Style of a kind of figure: opacity of its filling, of colour or white; line width (points), dashes, layer."""

    fill: float
    width: float
    layer: float
    dashes: str = "-"
    white: bool = False


_PENS = {
    "ground": Pen(0.0, 1.0, 1.0),
    "wheel": Pen(0.10, 1.2, 2.0, "-."),
    "mark": Pen(0.0, 1.2, 2.1, "-."),
    "cam": Pen(0.30, 1.4, 2.0),
    "track": Pen(0.0, 1.8, 2.2),
    "support": Pen(1.0, 1.0, 2.6, white=True),
    "plate": Pen(0.35, 1.2, 3.0),
    "rail": Pen(0.80, 0.8, 3.1),
    "slot": Pen(1.0, 1.2, 3.2, white=True),
    "bar": Pen(0.80, 0.8, 3.3),
    "fixed block": Pen(0.55, 1.2, 3.6),
    "block": Pen(0.55, 1.2, 3.6),
    "dot": Pen(1.0, 0.8, 3.8),
    "weld": Pen(1.0, 1.0, 3.9),
    "pin": Pen(1.0, 1.2, 4.0, white=True),
    "arrow": Pen(0.0, 1.4, 4.5),
}


def draw(scene: Scene, path: str | Path | None = None, *, at: Sequence[float] = (), points: Sequence[str] = ()) -> Figure:
    """Draws the mechanisms of a scene at chosen positions, the first one bold, and the paths of their points.

    Args:
        scene: any scene with a mechanism that is a linkage.
        path: where to save the picture, ending in .png, .svg or .pdf; the same scene gives the same file every time.
        at: crank angles phi (rad), or on a stroke positions of its driver (m, or rad where it turns); a handful if empty.
        points: names of the joints and points whose paths are drawn, such as `B` or `rod.P`; all that move if empty.

    Raises:
        SceneError: for a scene that has nothing to draw, a position beyond a stroke, an unknown point.
        ValueError: for any other file ending.

    """
    views = sketch.views(scene, points)
    coordinates = sketch.checked(scene, at) or sketch.positions(scene)
    boxes = [extent(view) for view in views]
    made, panels = _panels(boxes, sketch.headline(scene), 2.2, 1.2)
    symbol = "x" if scene.stroke is not None and scene.stroke.sliding else "φ"
    others = ", ".join(sketch.coordinate_text(scene, q) for q in coordinates[1:_LISTED]) + (
        ", …" if len(coordinates) > _LISTED else ""
    )
    caption = f"{symbol} = {sketch.coordinate_text(scene, coordinates[0])}" + (f" (faint: {others})" if others else "")
    for panel, view, box in zip(panels, views, boxes, strict=False):
        draw_axes_and_paths(panel, view, box, f"{view.mechanism.name}: {caption}")
        draw_bodies(panel, view, view.poses(coordinates), box, faint=True)
    figures.lay_out(made)  # gives everything its place, so that names can go around it
    for panel, view, box in zip(panels, views, boxes, strict=False):
        write_names(panel, view, view.poses(coordinates), factor(box)[0])
    if path is not None:
        figures.save(made, path)
    return made


def tallest(boxes: Sequence[Array]) -> float:
    """The greatest height to width of any box."""
    return max(float(np.ptp(box[1]) / np.ptp(box[0])) for box in boxes)


def columns_for(boxes: Sequence[Array]) -> int:
    """Number of panels side by side for which the picture is closest to the shape of a sheet of paper."""

    def off(columns: int) -> float:
        rows = -(-len(boxes) // columns)
        return abs(log(columns / (rows * max(tallest(boxes), 0.3)) / _PAGE)) + 0.3 * (rows * columns - len(boxes))

    return min(range(1, len(boxes) + 1), key=off)


# -- one panel -------------------------------------------------------------------------------------------------------


def extent(view: View) -> Array:
    """The box (m) of a mechanism with a margin around it: x and y, least and greatest."""
    spare = _MARGIN * float(np.ptp(view.box, axis=1).max())
    return np.asarray(view.box + np.array((-spare, spare)))


def factor(box: Array) -> tuple[float, str]:
    """Factor of lengths on the axes of a mechanism of this extent, and their unit there."""
    return (1000.0, "mm") if float(np.ptp(box, axis=1).max()) < _METRES else (1.0, "m")


def colours(view: View) -> dict[str, str]:
    """A colour for every body, the frame black."""
    bodies = view.solution.linkage.names[1:]
    return {FRAME: BLACK} | {body: BODIES[k % len(BODIES)] for k, body in enumerate(bodies)}


def draw_axes_and_paths(panel: Axes, view: View, box: Array, title: str) -> None:
    """Axes of equal scale that contain the whole motion, and the paths of the points."""
    scale, unit = factor(box)
    figures.name_axes(panel, title, f"x, {unit}", f"y, {unit}")
    panel.set_aspect("equal")
    panel.set_xlim(*(scale * box[0]))
    panel.set_ylim(*(scale * box[1]))
    for trace in view.sketch.traces:
        ink = shade(colours(view)[trace.body], 0.15)
        panel.plot(*(scale * trace.path), color=ink, lw=1.0, ls=(0, (4, 2)), zorder=2.5, gid=f"path {trace.name}")


def draw_bodies(panel: Axes, view: View, poses: Poses, box: Array, *, faint: bool = False) -> list[tuple[Shape, Artist]]:
    """The mechanism at the first of the poses, each figure with its artists; its bodies at all others faintly."""
    (scale, _), ink = factor(box), colours(view)
    for shape in view.sketch.shapes if faint else ():
        if shape.kind in _GHOSTS and shape.body != FRAME:
            pen = _PENS[shape.kind]
            pen = pen._replace(fill=0.25 * pen.fill, layer=1.6)
            outline = scale * placed(shape, poses)
            for k in range(1, poses.q.size):
                panel.add_artist(moved(_artist(shape, ink[shape.body], pen, edge=0.25), outline[:, :, k]))
    drawn = []
    for shape in sorted(view.sketch.shapes, key=lambda shape: _PENS[shape.kind].layer):
        made = _artist(shape, ink[shape.body], _PENS[shape.kind])
        panel.add_artist(moved(made, scale * placed(shape, poses)[:, :, 0]))
        drawn.append((shape, made))
    return drawn


def _artist(shape: Shape, ink: str, pen: Pen, edge: float = 1.0) -> Artist:
    """Artist of matplotlib for a figure, not yet in its place."""
    line: Any = {"lw": pen.width, "ls": pen.dashes, "zorder": pen.layer, "gid": f"{shape.kind} {shape.body}"}
    dark = (*shade(ink, -0.25), edge)
    if shape.kind not in CLOSED:
        return Line2D([], [], color=dark, solid_capstyle="round", solid_joinstyle="round", **line)
    face = (1.0, 1.0, 1.0, 1.0) if pen.white else (*shade(ink, 0.0001), pen.fill)
    return Polygon(np.zeros((1, 2)), closed=True, facecolor=face, edgecolor=dark, joinstyle="round", **line)


def moved(made: Artist, outline: Array) -> Artist:
    """The same artist at another place; outline (2, m) in the units of the axes."""
    if isinstance(made, Line2D):
        made.set_data(outline[0], outline[1])
    else:
        made.set_xy(outline.T)
    return made


def write_names(
    panel: Axes,
    view: View,
    poses: Poses,
    scale: float,
    more: Sequence[tuple[str, str, tuple[float, float]]] = (),
    rays: Sequence[Array] = (),
) -> None:
    """The names of joints, points and bodies, clear of the figures of the bold position and of the paths.

    more: further names with their colours and places; rays: lines that are drawn beside the paths.
    """
    labels, ink = view.sketch.labels, colours(view)
    spots = np.array([scale * poses.point(*label.at).value[:, 0] for label in labels] + [spot for _, _, spot in more])
    words = [label.text for label in labels] + [text for text, _, _ in more]
    texts = [panel.text(0.0, 0.0, word, fontsize=9.0, parse_math=False, zorder=6.0) for word in words]
    for label, text in zip(labels, texts, strict=False):
        text.set_color(shade(ink[label.body], -0.15))
        text.set_fontweight("normal" if label.body == FRAME else "bold")
    for (_, colour, _), text in zip(more, texts[len(labels) :], strict=True):
        text.set_color(shade(colour, -0.15))
    lines = [*rays, *(scale * trace.path for trace in view.sketch.traces)]
    for shape in view.sketch.shapes:
        outline = scale * placed(shape, poses)[:, :, 0]
        lines.append(np.concatenate((outline, outline[:, :1]), axis=1) if shape.kind in CLOSED else outline)
    figures.settle(panel, texts, spots, lines)


def _panels(boxes: Sequence[Array], title: str, least: float, margin: float) -> tuple[Figure, list[Axes]]:
    """A sheet with a panel for every box, as wide as there is room and as tall as the mechanisms need.

    least: height of a row (inches); margin: of the sheet above and below.
    """
    columns = columns_for(boxes)
    rows = -(-len(boxes) // columns)
    width = _WIDEST if columns == 1 else _ONE * columns
    height = rows * min(max(tallest(boxes) * (width / columns - 0.9), least), _TALLEST / max(rows - 0.5, 1.0)) + margin
    sheet = figures.figure(width, height, title)
    panels = sheet.subplots(rows, columns, squeeze=False).ravel().tolist()
    for panel in panels[len(boxes) :]:
        panel.set_axis_off()
    return sheet, panels


# -- instant centres ---------------------------------------------------------------------------------------------------

_MOST_DRAWN = 4  # positions that are drawn of many
_TOGETHER = 2e-3  # of the picture: centres that lie closer together than that are drawn as one
_BEYOND = 1.2  # extents of the mechanism, to every side: how far away a centre is still drawn


def draw_centres(result: InstantCentres, path: str | Path | None = None) -> Figure:
    """Draws mechanisms at positions with their instant centres: P(rod) of a body, P(crank, slider) of two.

    Permanent centres at joints have no label: a pin's is the pin. From the centre of a body rays go to
    its points, across which these move. A line above the picture lists centres far away or at infinity.

    Args:
        result: that of `flywheel.instant_centres`; of more than four positions four are drawn.
        path: where to save the picture, ending in .png, .svg or .pdf.

    Raises:
        ValueError: for any other file ending.

    """
    views = {view.mechanism.name: view for view in sketch.views(result.scene)}
    picked = np.unique(np.linspace(0, result.q.size - 1, min(result.q.size, _MOST_DRAWN)).round().astype(int)).tolist()
    jobs = [(views[name], centres, k) for k in picked for name, centres in result.mechanisms.items()]
    boxes = [_box_with_centres(extent(view), centres, k) for view, centres, k in jobs]
    made, panels = _panels(boxes, f"{sketch.headline(result.scene)}: instant centres", 2.6, 1.6)
    symbol = "x" if result.scene.stroke is not None and result.scene.stroke.sliding else "φ"
    for panel, (view, centres, k), box in zip(panels, jobs, boxes, strict=False):
        title = f"{view.mechanism.name}: {symbol} = {sketch.coordinate_text(result.scene, float(result.q[k]))}"
        draw_axes_and_paths(panel, view, box, "\n".join((title, *_not_drawn(centres, k, box))))
        panel.title.set_fontsize(9.5)
        draw_bodies(panel, view, view.poses(result.q[k]), box)
    figures.lay_out(made)
    for panel, (view, centres, k), box in zip(panels, jobs, boxes, strict=False):
        _mark_centres(panel, view, view.poses(result.q[k]), centres, k, box)
    if path is not None:
        figures.save(made, path)
    return made


def _name(centre: InstantCentre) -> str:
    return f"P({centre.second})" if centre.absolute else f"P({centre.first}, {centre.second})"


def _box_with_centres(box: Array, centres: Centres, k: int) -> Array:
    """The box of a mechanism, widened to include the centres nearby."""
    size = float(np.ptp(box, axis=1).max())
    places = np.array([c.place[:, k] for c in centres.centres.values() if c.kind[k] == FINITE]).reshape(-1, 2).T
    low, high = box[:, :1] - _BEYOND * size, box[:, 1:] + _BEYOND * size
    near = places[:, ((places >= low) & (places <= high)).all(axis=0)]
    spare = 0.5 * _MARGIN * size
    least, most = near.min(axis=1, initial=np.inf) - spare, near.max(axis=1, initial=-np.inf) + spare
    return np.stack((np.minimum(box[:, 0], least), np.maximum(box[:, 1], most)), axis=1)


def _not_drawn(centres: Centres, k: int, box: Array) -> Iterator[str]:
    """Lines on the centres beyond the picture, and on those at infinity."""
    scale, unit = factor(box)
    away, infinite = [], []
    for centre in centres.centres.values():
        x, y = centre.place[:, k]
        if centre.kind[k] == INFINITE:
            infinite.append(f"{_name(centre)} along {number(np.degrees(centre.direction[k]), 1e-9, 4)}°".replace("-", "−"))
        elif centre.kind[k] == FINITE and not (box[0, 0] <= x <= box[0, 1] and box[1, 0] <= y <= box[1, 1]):
            place = "; ".join(number(scale * float(value), scale * float(centre.error[k]), 4) for value in (x, y))
            away.append(f"{_name(centre)} at ({place}) {unit}".replace("-", "−"))
    for what, names in (("far away", away), ("at infinity", infinite)):
        if names:
            yield from wrapped(f"{what}: {', '.join(names)}", "   ", "")


def _mark_centres(panel: Axes, view: View, poses: Poses, centres: Centres, k: int, box: Array) -> None:
    """Centres as crosses with their names, and rays from those of bodies to the bodies' points."""
    (scale, _), ink, linkage = factor(box), colours(view), view.solution.linkage
    names: list[tuple[str, Any, tuple[float, float]]] = []
    rays = []
    for centre in centres.centres.values():
        x, y = scale * centre.place[:, k]
        inside = centre.kind[k] == FINITE and bool(
            (scale * box[:, 0] <= (x, y)).all() and ((x, y) <= scale * box[:, 1]).all()
        )
        if not inside or centre.permanent:
            continue
        colour = ink[centre.second] if centre.absolute else BLACK
        for point in linkage.link(centre.second).points if centre.absolute else ():
            end = scale * centres.poses.point(centre.second, point).value[:, k]
            rays.append(np.stack(((x, y), end), axis=1))
            panel.plot(*rays[-1], color=colour, lw=0.8, ls=(0, (6, 3)), zorder=2.4)
        panel.plot(x, y, "x" if centre.absolute else "+", color=colour, ms=9, mew=2.0, zorder=5.0)
        near = [i for i, (_, _, at) in enumerate(names) if np.hypot(x - at[0], y - at[1]) < _TOGETHER * scale * np.ptp(box)]
        if near:  # centres at one point have one name
            others, ink_there, at = names[near[0]]
            names[near[0]] = f"{others}, {_name(centre)}", ink_there, at
        else:
            names.append((_name(centre), colour, (x, y)))
    write_names(panel, view, poses, scale, names, rays)
