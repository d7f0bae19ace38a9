"""Mechanisms drawn at chosen positions, with the paths of their points.

Joints have the symbols of the field: circles for pins, hatched ground under what is fixed, blocks on guides, pins in slots,
pitch circles for gears. Every body has a colour of its own; the frame is black.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from flywheel.linkage.description import FRAME
from flywheel.linkage.poses import Poses
from flywheel.pictures import figures
from flywheel.pictures.figures import BLACK, BODIES, shade
from flywheel.scene import Scene
from flywheel.sketching import names, views
from flywheel.sketching.shapes import CLOSED, Shape, placed
from flywheel.sketching.views import View

Array = NDArray[np.float64]
Artist = Line2D | Polygon

_MARGIN = 0.05  # of the mechanism's extent, around it
_PAGE = 1.4  # width to height
_METRES = 1.0  # m: mechanisms below it are drawn in mm
_GHOSTS = frozenset({"bar", "rail", "plate", "block", "cam"})
_LISTED = 8  # positions that the title names
_WIDEST, _TALLEST, _ONE = 10.0, 9.0, 6.4  # inches: a picture, and one of several


class Pen(NamedTuple):
    """How a kind of figure is drawn: opacity of its filling, of colour or white; line width (points), dashes, layer."""

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
    """Draw the mechanisms of a scene at chosen positions, the first one bold, and the paths of their points.

    Args:
        scene: any scene with a mechanism that is a linkage.
        path: where to save the picture, ending in .png, .svg or .pdf; the same scene gives the same file every time.
        at: crank angles phi (rad), or on a stroke positions of its driver (m, or rad where it turns); a handful if empty.
        points: names of the joints and points whose paths are drawn, such as `B` or `rod.P`; all that move if empty.

    Raises:
        SceneError: for a scene that has nothing to draw, a position beyond a stroke, a point that nobody knows.
        ValueError: for any other file ending.

    """
    shown = views.views(scene, points)
    wanted = views.checked(scene, at) or views.positions(scene)
    boxes = [extent(view) for view in shown]
    columns = columns_for(boxes)
    made = figures.figure(*_figure_size(boxes, columns), views.headline(scene))
    panels = made.subplots(-(-len(shown) // columns), columns, squeeze=False).ravel().tolist()
    for panel in panels[len(shown) :]:
        panel.set_axis_off()
    for panel, view, box in zip(panels, shown, boxes, strict=False):
        poses = view.poses(wanted)
        canvas(panel, box, f"{view.mechanism.name}: {_caption(scene, wanted)}")
        trace(panel, view, box)
        ghosts(panel, view, poses, box)
        figure(panel, view, poses, box)
    made.draw_without_rendering()  # gives everything its place, so that names can go around it
    for panel, view, box in zip(panels, shown, boxes, strict=False):
        _name(panel, view, view.poses(wanted), box)
    if path is not None:
        figures.save(made, path)
    return made


def _caption(scene: Scene, wanted: Sequence[float]) -> str:
    symbol = "x" if scene.stroke is not None and scene.stroke.sliding else "φ"
    others = ", ".join(views.told(scene, q) for q in wanted[1:_LISTED]) + (", …" if len(wanted) > _LISTED else "")
    return f"{symbol} = {views.told(scene, wanted[0])}" + (f" (faint: {others})" if others else "")


def columns_for(boxes: Sequence[Array]) -> int:
    """How many panels stand beside each other: so many that the picture comes nearest to the shape of a page."""
    tallest = max(float(np.ptp(box[1]) / np.ptp(box[0])) for box in boxes)

    def off(columns: int) -> float:
        rows = -(-len(boxes) // columns)
        return abs(log(columns / (rows * max(tallest, 0.3)) / _PAGE)) + 0.3 * (rows * columns - len(boxes))

    return min(range(1, len(boxes) + 1), key=off)


def _figure_size(boxes: Sequence[Array], columns: int) -> tuple[float, float]:
    """Inches for panels of these extents: as wide as there is room, and as tall as the mechanisms need."""
    width = _WIDEST if columns == 1 else _ONE * columns
    rows = -(-len(boxes) // columns)
    tallest = max(float(np.ptp(box[1]) / np.ptp(box[0])) for box in boxes)
    return width, rows * min(max(tallest * (width / columns - 0.9), 2.2), _TALLEST / max(rows - 0.5, 1.0)) + 1.2


# -- one panel -------------------------------------------------------------------------------------------------------


def extent(view: View) -> Array:
    """The box (m) that holds everything drawn of a mechanism through its motion: x and y, least and greatest."""
    few = view.solution.poses(view.cycle.q[::6])
    outlines = [placed(shape, few).reshape(2, -1) for shape in view.sketch.shapes]
    whole = np.concatenate((*outlines, *(t.path for t in view.sketch.traces)), axis=1)
    low, high = np.nanmin(whole, axis=1), np.nanmax(whole, axis=1)
    spare = _MARGIN * float((high - low).max())
    return np.stack((low - spare, high + spare), axis=1)


def factor(box: Array) -> tuple[float, str]:
    """What lengths are multiplied by for the axes of a mechanism of this extent, and their unit there."""
    return (1000.0, "mm") if float(np.ptp(box, axis=1).max()) < _METRES else (1.0, "m")


def canvas(panel: Axes, box: Array, title: str) -> None:
    """Axes of equal scale that hold the whole motion."""
    scale, unit = factor(box)
    figures.name_axes(panel, title, f"x, {unit}", f"y, {unit}")
    panel.set_aspect("equal")
    panel.set_xlim(*(scale * box[0]))
    panel.set_ylim(*(scale * box[1]))


def colours(view: View) -> dict[str, str]:
    """A colour for every body, the frame black."""
    bodies = view.solution.linkage.names[1:]
    return {FRAME: BLACK} | {body: BODIES[k % len(BODIES)] for k, body in enumerate(bodies)}


def trace(panel: Axes, view: View, box: Array) -> None:
    """The paths of the points."""
    scale, _ = factor(box)
    for found in view.sketch.traces:
        ink = shade(colours(view)[found.body], 0.15)
        panel.plot(*(scale * found.path), color=ink, lw=1.0, ls=(0, (4, 2)), zorder=2.5, gid=f"path {found.name}")


def ghosts(panel: Axes, view: View, poses: Poses, box: Array) -> None:
    """The moving bodies at all positions but the first, faintly."""
    scale, _ = factor(box)
    for shape in view.sketch.shapes:
        if shape.kind not in _GHOSTS or shape.body == FRAME:
            continue
        ink, outline = colours(view)[shape.body], scale * placed(shape, poses)
        for k in range(1, poses.q.size):
            pen = _PENS[shape.kind]
            faint = artist(shape, ink, pen._replace(fill=0.25 * pen.fill, layer=1.6), edge=0.25)
            panel.add_artist(moved(faint, outline[:, :, k]))


def figure(panel: Axes, view: View, poses: Poses, box: Array) -> list[tuple[Shape, Artist]]:
    """The mechanism at the first of the poses; figures with what was drawn of them."""
    scale, _ = factor(box)
    drawn = []
    for shape in sorted(view.sketch.shapes, key=lambda shape: _PENS[shape.kind].layer):
        made = artist(shape, colours(view)[shape.body], _PENS[shape.kind])
        panel.add_artist(moved(made, scale * placed(shape, poses)[:, :, 0]))
        drawn.append((shape, made))
    return drawn


def artist(shape: Shape, ink: str, pen: Pen, edge: float = 1.0) -> Artist:
    """What matplotlib draws of a figure, not yet in its place."""
    gid = f"{shape.kind} {shape.body}"
    line: Any = {"lw": pen.width, "ls": pen.dashes, "zorder": pen.layer, "gid": gid}
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


# -- names -----------------------------------------------------------------------------------------------------------


def _name(panel: Axes, view: View, poses: Poses, box: Array) -> None:
    """Write the names of joints, points and bodies."""
    sketch, (scale, _) = view.sketch, factor(box)
    ink = colours(view)
    spots = np.array([scale * poses.point(*label.at).value[:, 0] for label in sketch.labels])
    texts = [
        panel.text(spot[0], spot[1], label.text, fontsize=9.0, parse_math=False, zorder=6.0)
        for label, spot in zip(sketch.labels, spots, strict=True)
    ]
    for label, text in zip(sketch.labels, texts, strict=True):
        text.set(ha="center", va="center", color=shade(ink[label.body], -0.15), in_layout=False)
        text.set_fontweight("normal" if label.body == FRAME else "bold")
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white", alpha=0.8)])
    points = 72.0 / panel.figure.dpi
    sizes = points * np.array([text.get_window_extent().size for text in texts])
    to_points = panel.transData.transform
    lines = np.concatenate([names.along(points * to_points(path.T).T, 3.0) for path in _lines(view, poses, scale)])
    centres = names.settled(points * to_points(spots), sizes, lines, points * np.array(panel.bbox.extents))
    for text, centre in zip(texts, panel.transData.inverted().transform(centres / points), strict=True):
        text.set_position(centre)


def _lines(view: View, poses: Poses, scale: float) -> list[Array]:
    """Everything that names should keep clear of: the figures of the bold position, and the paths."""
    found = [scale * t.path for t in view.sketch.traces]
    for shape in view.sketch.shapes:
        outline = scale * placed(shape, poses)[:, :, 0]
        closed = shape.kind in CLOSED
        found.append(np.concatenate((outline, outline[:, :1]), axis=1) if closed else outline)
    return found
