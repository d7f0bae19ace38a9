"""Animation of a machine's motion as a GIF: its mechanisms beside a curve over them, in step with time."""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, log10
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image

from bondgraph.files import replacement
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import figure as number
from flywheel.pictures import figures, sketch
from flywheel.pictures.mechanisms import (
    Artist,
    colours,
    columns_for,
    draw_axes_and_paths,
    draw_bodies,
    extent,
    factor,
    moved,
    tallest,
)
from flywheel.pictures.sketch import Shape, View, placed
from flywheel.regime import turning_moment
from flywheel.scene.linkage import FRAME, SLIDE
from flywheel.scene.scene import Scene
from flywheel.sizing.sizing import size
from flywheel.tables.rows import RPM

Array = NDArray[np.float64]

_POINTS = 1441
_FLAT = 2e-3  # of the mean speed: a fluctuation below it is drawn about the mean


class Timing(NamedTuple):
    """Course of a machine's motion: coordinates (rad or m) in order, times (s), and a curve over them.

    `closed` is true if the motion ends where it began. If no speed is known the driver moves evenly, and its travel replaces
    the time: `timed` is False.
    """

    q: Array
    time: Array
    curve: Array
    title: str
    label: str
    closed: bool
    timed: bool = True

    def evenly(self, count: int) -> tuple[Array, Array, Array]:
        """Times (s) spread evenly over the motion, with coordinate and curve there; both ends unless it is closed."""
        t = self.time[-1] * np.linspace(0.0, 1.0, count, endpoint=not self.closed)
        return t, np.interp(t, self.time, self.q), np.interp(t, self.time, self.curve)


def timing(scene: Scene, view: View) -> Timing:
    """The timing of the steady cycle with its flywheel; that of an even motion of the driver without flywheel or speed.

    Raises:
        SceneError: if the machine does not run as the scene describes, or stands still.

    """
    if scene.stroke is not None or not (scene.has_flywheel and scene.has_speed):
        return _of_even_motion(scene, view)
    sizing = size(scene, simulate=False)
    phi = np.linspace(0.0, scene.cycle, _POINTS)
    omega = np.full_like(phi, sizing.speed)
    if sizing.run is not None and sizing.cycle is not None:
        omega = turning_moment.speed_over_cycle(sizing.cycle, sizing.speed, sizing.run, phi)
    slowness = 1.0 / np.abs(omega)
    elapsed = np.concatenate(([0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.abs(np.diff(phi)))))
    rpm, mean = RPM * omega, RPM * sizing.speed
    flat = np.ptp(rpm) < _FLAT * mean
    label = f"crank speed − {number(mean, 0.0, 6)} rpm, rpm" if flat else "crank speed, rpm"
    on = "" if scene.flywheel_on == "crank" else f" on {scene.flywheel_on}"
    eps = "" if sizing.run is None else f", ε = {number(sizing.run.irregularity, 0.0, 4)}"
    wheel = f"with a flywheel of {number(sizing.inertia or 0.0, 0.0, 5)} kg m²{on}"
    return Timing(phi, elapsed, rpm - mean * flat, f"Speed over the cycle{eps}\n{wheel}", label, True)


def _of_even_motion(scene: Scene, view: View) -> Timing:
    """A stroke or a cycle at a constant speed, with the velocity of the first slide that is driven, or of the last body.

    Without a speed the velocity is that per unit of the driver's.
    """
    stroke = scene.stroke
    own_speed, sliding = (scene.speed if stroke is None else stroke.speed), stroke is not None and stroke.sliding
    if own_speed == 0.0:
        raise SceneError([Fault("stroke.speed", "0", "a speed at which the stroke comes to an end")])
    speed = 1.0 if own_speed is None else own_speed
    ends = (0.0, scene.cycle) if stroke is None else (stroke.start, stroke.end)
    q = np.linspace(*(ends if speed > 0.0 else ends[::-1]), _POINTS)
    poses, linkage = view.poses(q), view.solution.linkage
    slides = [j for j in linkage.joints if j.kind == SLIDE and j.name != linkage.driver and FRAME in (j.first, j.second)]
    if slides:
        name = slides[0].second if slides[0].first == FRAME else slides[0].first
        gain, label = view.solution.coordinate(slides[0].name, poses).rate, f"velocity of {name}"
    else:
        name = linkage.names[-1]
        gain, label = poses.angle(name).rate, f"angular velocity of {name}"
    along, driver = ("m", "1") if slides else ("1", "1/m"), "driver" if stroke is not None else "crank"
    whole = "Stroke" if stroke is not None else "Cycle without a flywheel"
    if own_speed is None:
        title, label = f"{whole}, the {driver} moving evenly:\nno speed is given", f"{label}\nper speed of the {driver}"
        unit = along[sliding]
    else:
        at = f"{number(speed, 0.0, 5)} m/s" if sliding else f"{number(RPM * speed, 0.0, 5)} rpm"
        title, unit = f"{whole} at {at}", "m/s" if slides else "rad/s"
    time = np.abs(q - q[0]) / abs(speed)
    return Timing(q, time, view.ratio * speed * gain, title, f"{label}, {unit}", stroke is None, own_speed is not None)


# -- animation ---------------------------------------------------------------------------------------------------------

FRAMES, FPS = (2, 600), (1, 50)
"""Least and greatest number of frames, and of frames a second."""

_WIDTH, _LOWEST, _FRAME_HEIGHT = 11.0, 3.6, 6.0  # inches
_DPI = 80
_COLOURS = 255


class MovingFigure(NamedTuple):
    """A figure ready to be moved: the shapes of its bodies, the marker on the curve, the text with time and position.

    Each shape comes with its artist, and its outline (2, m, frames) in the units of the axes.
    """

    figure: Figure
    bodies: tuple[tuple[Shape, Artist, Array], ...]
    marker: Line2D
    clock: Any
    times: Array
    q: Array
    values: Array
    timed: bool = True


def animate(scene: Scene, path: str | Path, *, frames: int = 60, fps: int = 20) -> None:
    """Writes a GIF of the mechanisms of a scene through one cycle or stroke, with a marker that runs along the speed curve.

    The speed is that of the steady cycle with the scene's flywheel, given or sized. On a stroke, and without a flywheel, it
    is the velocity of the first driven slide at a constant speed of the driver; if none is given, per unit of that.
    Frames follow each other evenly in time.

    Args:
        scene: any scene with a mechanism that is a linkage, and a machine that runs.
        path: a file name ending in .gif; the same scene gives the same file every time.
        frames: number of frames, 2 to 600.
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
    few = images[:: max(len(images) // 4, 1)]  # side by side: colours that serve all frames, small figures keep theirs
    width, height = few[0].size
    strip = Image.new("RGB", (width, height * len(few)))
    for k, image in enumerate(few):
        strip.paste(image, (0, k * height))
    palette = strip.quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE)
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    with replacement(path, "gif") as fresh:
        first.save(fresh, format="GIF", save_all=True, append_images=rest, duration=round(1000 / fps), loop=0)


def stage(scene: Scene, frames: int) -> MovingFigure:
    """The figure of an animation, and the place of everything in it at every frame."""
    views = sketch.views(scene)
    run = timing(scene, views[0])
    times, q, values = run.evenly(frames)
    boxes = [extent(view) for view in views]
    columns = columns_for(boxes)
    rows = -(-len(boxes) // columns)
    height = float(np.clip(rows * (0.52 * _WIDTH / columns * tallest(boxes) + 0.9), _LOWEST, _FRAME_HEIGHT))
    made = figures.figure(_WIDTH, height, sketch.headline(scene))
    made.set_dpi(_DPI)
    left, right = made.subfigures(1, 2, squeeze=False, width_ratios=(1.15, 1.0))[0]
    panels = left.subplots(rows, columns, squeeze=False).ravel()
    for panel in panels[len(views) :]:
        panel.set_axis_off()
    bodies = list[tuple[Shape, Artist, Array]]()
    for panel, view, box in zip(panels, views, boxes, strict=False):
        poses = view.poses(q)
        draw_axes_and_paths(panel, view, box, view.mechanism.name)
        for shape, artist in draw_bodies(panel, view, poses, box):
            artist.set_animated(True)
            bodies.append((shape, artist, factor(box)[0] * placed(shape, poses)))
    named = dict.fromkeys(pair for view in views for pair in list(colours(view).items())[1:])
    handles = [Patch(color=colour, label=body) for body, colour in named]
    left.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False, fontsize=8.5)

    panel, sliding = right.subplots(), scene.sliding
    figures.name_axes(panel, run.title, "position x of the driver, mm" if sliding else "crank angle φ, deg", run.label)
    x = _on_axis(run.q, sliding)
    panel.plot(x, run.curve, color=figures.BLUE, lw=1.8)
    panel.set_xlim(float(x.min()), float(x.max()))
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.1 * (high - low))
    (marker,) = panel.plot([], [], "o", color=figures.VERMILLION, ms=9, animated=True, zorder=5)
    marker.set_gid("sliding" if sliding else "turning")
    clock = panel.text(0.02, 0.975, "", transform=panel.transAxes, va="top", animated=True, family="monospace", fontsize=9.5)
    return MovingFigure(made, tuple(bodies), marker, clock, times, q, values, run.timed)


def _on_axis(q: Any, sliding: bool) -> Array:
    """A coordinate as on the axis: mm, or degrees."""
    return np.asarray(1000.0 * np.asarray(q) if sliding else np.degrees(q))


def show(made: MovingFigure, k: int, scene: Scene) -> None:
    """Moves everything to its place at frame k."""
    for _, artist, outline in made.bodies:
        moved(artist, outline[:, :, k])
    sliding = scene.sliding
    made.marker.set_data(_on_axis(made.q[k : k + 1], sliding), made.values[k : k + 1])
    unit, symbol = ("mm", "x") if sliding else ("deg", "φ")
    digits = max(3 - floor(log10(made.times[-1])), 0)
    place = float(_on_axis(made.q[k], sliding))
    time = f"t = {made.times[k]:.{digits}f} s   " if made.timed else ""
    made.clock.set_text(f"{time}{symbol} = {place:5.1f} {unit}".replace("-", "−"))


def _images(made: MovingFigure, scene: Scene) -> Iterator[Image.Image]:
    """Images of the frames: static parts are drawn once, moving parts in every frame."""
    picture = made.figure.canvas
    assert isinstance(picture, FigureCanvasAgg)
    picture.draw()  # type: ignore[no-untyped-call]
    still = picture.copy_from_bbox(made.figure.bbox)  # type: ignore[no-untyped-call]
    renderer = picture.get_renderer()  # type: ignore[no-untyped-call]
    for k in range(made.q.size):
        picture.restore_region(still)  # type: ignore[no-untyped-call]
        show(made, k, scene)
        for _, artist, _ in made.bodies:
            artist.draw(renderer)
        made.marker.draw(renderer)
        made.clock.draw(renderer)
        pixels = np.asarray(picture.buffer_rgba())  # type: ignore[no-untyped-call]
        yield Image.fromarray(pixels[:, :, :3].copy())
