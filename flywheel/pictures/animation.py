"""Mechanisms moving through their cycle beside the curve of speed, as a GIF; no screen is needed.

What stands still is drawn once; only what moves is drawn anew for every frame. Frames are spread evenly in time.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, log10
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image

from bondgraph.files import replacement
from flywheel.pictures import figures
from flywheel.pictures.mechanisms import Artist, canvas, colours, columns_for, extent, factor, figure, moved, trace
from flywheel.pictures.paces import Pace, pace
from flywheel.scene import Scene
from flywheel.sketching import views
from flywheel.sketching.shapes import Shape, placed
from flywheel.sketching.views import View

Array = NDArray[np.float64]

FRAMES, FPS = (2, 600), (1, 50)
"""Least and greatest number of frames, and of frames a second."""

_WIDTH, _LOWEST, _TALLEST = 11.0, 3.6, 6.0  # inches
_DPI = 80
_COLOURS = 255


class Moving(NamedTuple):
    """One mechanism's figures with their artists, and their outlines (2, m, frames) in the units of the axes."""

    parts: tuple[tuple[Shape, Artist], ...]
    outlines: tuple[Array, ...]


class Stage(NamedTuple):
    """A figure ready to be moved: its mechanisms, the marker on the curve, the text with time and position."""

    figure: Figure
    mechanisms: tuple[Moving, ...]
    marker: Line2D
    clock: Any
    times: Array
    q: Array
    values: Array


def animate(scene: Scene, path: str | Path, *, frames: int = 60, fps: int = 20) -> None:
    """Write a GIF of the mechanisms of a scene through one cycle or stroke, with a marker that runs along the speed curve.

    The speed is that of the steady cycle with the scene's flywheel, given or sized. On a stroke, which has none, it is the
    velocity of the first driven slide at the stroke's constant speed. Frames follow each other evenly in time.

    Args:
        scene: any scene with a mechanism that is a linkage, and a machine that runs.
        path: a file name ending in .gif; the same scene gives the same file every time.
        frames: how many, 2 to 600.
        fps: frames a second, 1 to 50.

    Raises:
        SceneError: for a scene that has nothing to draw, or does not run.
        ValueError: for another file ending, or numbers out of range.

    """
    if Path(path).suffix.lower() != ".gif":
        raise ValueError(f"found {str(path)!r}, expected a file name ending in .gif")
    for name, value, (low, high) in (("frames", frames, FRAMES), ("fps", fps, FPS)):
        if not low <= value <= high:
            raise ValueError(f"found {name} = {value}, expected {low} to {high}")
    images = list(_images(stage(scene, frames), scene))
    palette = _palette(images)
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    with replacement(path, "gif") as fresh:
        first.save(fresh, format="GIF", save_all=True, append_images=rest, duration=round(1000 / fps), loop=0)


def stage(scene: Scene, frames: int) -> Stage:
    """The figure of an animation, and where everything in it stands at every frame."""
    shown = views.views(scene)
    run = pace(scene, shown[0])
    times, q, values = run.evenly(frames)
    boxes = [extent(view) for view in shown]
    columns = columns_for(boxes)
    rows = -(-len(boxes) // columns)
    tallest = max(float(np.ptp(box[1]) / np.ptp(box[0])) for box in boxes)
    height = float(np.clip(rows * (0.52 * _WIDTH / columns * tallest + 0.9), _LOWEST, _TALLEST))
    made = figures.figure(_WIDTH, height, views.headline(scene))
    made.set_dpi(_DPI)
    left, right = made.subfigures(1, 2, squeeze=False, width_ratios=(1.15, 1.0))[0]
    panels = left.subplots(rows, columns, squeeze=False).ravel()
    for panel in panels[len(shown) :]:
        panel.set_axis_off()
    mechanisms = tuple(_moving(panel, view, box, q) for panel, view, box in zip(panels, shown, boxes, strict=False))
    named = dict.fromkeys(pair for view in shown for pair in list(colours(view).items())[1:])
    handles = [Patch(color=colour, label=body) for body, colour in named]
    left.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False, fontsize=8.5)
    marker, clock = _curve(right.subplots(), run, scene)
    return Stage(made, mechanisms, marker, clock, times, q, values)


def _moving(panel: Axes, view: View, box: Array, q: Array) -> Moving:
    """One mechanism with the paths of its points."""
    scale, _ = factor(box)
    poses = view.poses(q)
    canvas(panel, box, view.mechanism.name)
    trace(panel, view, box)
    parts = tuple(figure(panel, view, poses, box))
    for _, artist in parts:
        artist.set_animated(True)
    return Moving(parts, tuple(scale * placed(shape, poses) for shape, _ in parts))


def _curve(panel: Axes, run: Pace, scene: Scene) -> tuple[Line2D, Any]:
    """The curve over the motion, with the marker and the clock."""
    sliding = scene.stroke is not None and scene.stroke.sliding
    label = "position x of the driver, mm" if sliding else "crank angle φ, deg"
    figures.name_axes(panel, run.title, label, run.label)
    x = _shown(run.q, sliding)
    panel.plot(x, run.curve, color=figures.BLUE, lw=1.8)
    panel.set_xlim(float(x.min()), float(x.max()))
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.1 * (high - low))
    (marker,) = panel.plot([], [], "o", color=figures.VERMILLION, ms=9, animated=True, zorder=5)
    marker.set_gid("sliding" if sliding else "turning")
    clock = panel.text(0.02, 0.975, "", transform=panel.transAxes, va="top", animated=True, family="monospace", fontsize=9.5)
    return marker, clock


def _shown(q: Any, sliding: bool) -> Array:
    """A coordinate as on the axis: mm, or degrees."""
    return np.asarray(1000.0 * np.asarray(q) if sliding else np.degrees(q))


# -- frames ----------------------------------------------------------------------------------------------------------


def show(made: Stage, k: int, scene: Scene) -> None:
    """Put everything where it stands at frame k."""
    for mechanism in made.mechanisms:
        for (_, artist), outline in zip(mechanism.parts, mechanism.outlines, strict=True):
            moved(artist, outline[:, :, k])
    sliding = scene.stroke is not None and scene.stroke.sliding
    made.marker.set_data(_shown(made.q[k : k + 1], sliding), made.values[k : k + 1])
    unit, symbol = ("mm", "x") if sliding else ("deg", "φ")
    digits = max(3 - floor(log10(made.times[-1])), 0)
    place = float(_shown(made.q[k], sliding))
    made.clock.set_text(f"t = {made.times[k]:.{digits}f} s   {symbol} = {place:5.1f} {unit}".replace("-", "−"))


def _images(made: Stage, scene: Scene) -> Iterator[Image.Image]:
    picture = made.figure.canvas
    assert isinstance(picture, FigureCanvasAgg)
    picture.draw()  # type: ignore[no-untyped-call]
    still = picture.copy_from_bbox(made.figure.bbox)  # type: ignore[no-untyped-call]
    renderer = picture.get_renderer()  # type: ignore[no-untyped-call]
    for k in range(made.q.size):
        picture.restore_region(still)  # type: ignore[no-untyped-call]
        show(made, k, scene)
        for mechanism in made.mechanisms:
            for _, artist in mechanism.parts:
                artist.draw(renderer)
        made.marker.draw(renderer)
        made.clock.draw(renderer)
        pixels = np.asarray(picture.buffer_rgba())  # type: ignore[no-untyped-call]
        yield Image.fromarray(pixels[:, :, :3].copy())


def _palette(images: list[Image.Image]) -> Image.Image:
    """Colours that serve all frames, from a few of them side by side; small figures keep theirs."""
    few = images[:: max(len(images) // 4, 1)]
    width, height = few[0].size
    strip = Image.new("RGB", (width, height * len(few)))
    for k, image in enumerate(few):
        strip.paste(image, (0, k * height))
    return strip.quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE)
