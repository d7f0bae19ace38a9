"""A sweep as a picture: curves over one number, a map over two, parallel coordinates of more.

Exact and approximate flywheel stand together, and where the approximate one is too light that is marked: it is the danger.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from flywheel.designs.figures import FIGURES
from flywheel.designs.sweep import Sweep
from flywheel.pictures import current_form
from flywheel.pictures.figures import BLUE, DPI, GREY, ORANGE, PALE, VERMILLION, figure, name_axes, save, told
from flywheel.tables.rows import printable
from flywheel.tables.sweeps import objective, short_names

Array = NDArray[np.float64]

_LONGEST_TITLE = 90
_WIDE = 100.0  # ratio from which on an axis is logarithmic
_NEAR = 1e-9
_LINES = 600  # of designs in parallel coordinates
_LEVELS = 12
_MANIFOLD = 10.0  # ratio of values from which on their contours are logarithmic
_FEW, _FINER = 3000, 3  # designs between which contours are drawn more finely, and how often triangles are halved for it
_DANGER = "approximate below exact: too light, danger"
_COLOURS = "cividis"


def plot(found: Sweep, path: str | Path) -> None:
    """Draw a sweep into a file: PNG, SVG or PDF, as its ending says; ValueError for any other."""
    save(draw(found), path)


def draw(found: Sweep) -> Figure:
    """The picture, not yet written anywhere."""
    varied = [path for path, column in found.columns.items() if np.ptp(column) > 0.0]
    known = np.isfinite(found.values[objective(found)])
    if len(varied) == 1 and known.any():
        return _curves(found, varied[0])
    if len(varied) == 2 and known.any() and (ground := _ground(found, varied, known)) is not None:
        return _map(found, varied, ground)
    return _parallel(found, varied, known)


def _heading(found: Sweep, what: str) -> str:
    title = " ".join(printable(found.scene.title or "").split())
    title = title if len(title) <= _LONGEST_TITLE else title[: _LONGEST_TITLE - 1] + "…"
    return f"{title}\n{what}" if title else what


def _label(found: Sweep, name: str) -> str:
    words = FIGURES[name].about.partition(",")[0] if name in FIGURES else short_names(found.columns)[name]
    unit = found.units.get(name, "").replace("^2", "²")
    return f"{words}, {unit}" if unit else words


def too_light(found: Sweep) -> NDArray[np.bool_]:
    """Where the approximate flywheel is below the exact one."""
    exact, approximate = found.values["exact"], found.values["approximate"]
    return np.asarray(exact - approximate > _NEAR * np.abs(exact))


# -- one number --------------------------------------------------------------------------------------------------------


def _curves(found: Sweep, path: str) -> Figure:
    """Exact and approximate flywheel over one number, and below how far the second is from the first."""
    order = np.argsort(found.columns[path], kind="stable")
    x, name = found.columns[path][order], objective(found)
    sizes = name == "exact"
    made = figure(9.0, 6.8 if sizes else 4.6, _heading(found, f"{len(found)} designs"))
    panels: Any = made.subplots(2 if sizes else 1, 1, sharex=True, squeeze=False, height_ratios=(2, 1) if sizes else (1,))
    above, marks = panels[0, 0], {"marker": "o", "ms": 3.5} if len(found) <= 60 else {}
    name_axes(above, "", "", _label(found, name) if not sizes else "flywheel at its shaft, kg m²")
    exact = found.values[name][order]
    above.plot(x, exact, color=BLUE, label="exact" if sizes else FIGURES[name].about, **marks)
    if sizes:
        approximate, light = found.values["approximate"][order], too_light(found)[order]
        above.plot(x, approximate, color=ORANGE, ls="--", label="approximate", **marks)
        above.fill_between(x, exact, approximate, where=light, interpolate=True, color=VERMILLION, alpha=0.25, lw=0)
        _deviation(panels[1, 0], found, x, exact, approximate, light)
    _shade_refused(panels[:, 0], x, np.isnan(exact))
    positive = exact[exact > 0.0]
    if positive.size and positive.size == np.isfinite(exact).sum() and positive.max() > _WIDE * positive.min():
        above.set_yscale("log")
    if x[0] > 0.0 and x[-1] > _WIDE * x[0]:
        above.set_xscale("log")
    panels[-1, 0].set_xlabel(_label(found, path))
    handles, _ = above.get_legend_handles_labels()
    if sizes and too_light(found).any():
        handles.append(Patch(color=VERMILLION, alpha=0.25, lw=0, label=_DANGER))
    if np.isnan(exact).any():
        handles.append(Patch(facecolor=PALE, hatch="///", edgecolor=GREY, lw=0, label="refused"))
    made.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=9, frameon=False)
    return made


def _deviation(panel: Axes, found: Sweep, x: Array, exact: Array, approximate: Array, light: NDArray[np.bool_]) -> None:
    """By how many per cent the approximate flywheel differs from the exact one, and where they part most."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = 100.0 * (approximate / np.where(exact > 0.0, exact, np.nan) - 1.0)
    name_axes(panel, "", "", "approximate\nless exact, %")
    panel.axhline(0.0, color=GREY, lw=0.8)
    panel.plot(x, share, color=ORANGE, ls="--")
    panel.fill_between(x, share, 0.0, where=light, interpolate=True, color=VERMILLION, alpha=0.25, lw=0)
    if np.isfinite(share).any():
        k = int(np.nanargmax(np.abs(share)))
        panel.plot(x[k], share[k], "o", color=VERMILLION if share[k] < 0.0 else ORANGE, ms=6)
        panel.annotate(
            f"{told(float(share[k]), most=3)} %",
            (x[k], share[k]),
            (0, -13 if share[k] > 0.0 else 7),
            textcoords="offset points",
            ha="right" if k > len(x) / 2 else "left",
            fontsize=9,
        )


def _shade_refused(panels: Any, x: Array, refused: NDArray[np.bool_]) -> None:
    """Bands over the numbers at which designs are refused."""
    middle = np.concatenate(([x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]))
    for k in np.flatnonzero(refused):
        for panel in panels:
            panel.axvspan(middle[k], middle[k + 1], facecolor=PALE, hatch="///", edgecolor=GREY, lw=0, zorder=0)


# -- two numbers -------------------------------------------------------------------------------------------------------


class _Ground(NamedTuple):
    """What a map is drawn on: triangles between designs in their own coordinates, and what puts values on their corners."""

    triangles: Any
    values: Callable[[Array], Array]


def _ground(found: Sweep, varied: list[str], known: NDArray[np.bool_]) -> _Ground | None:
    """The ground of a map of two numbers, logarithmic ones by their logarithms; None where the designs lie on a line."""
    from matplotlib.tri import LinearTriInterpolator, Triangulation, UniformTriRefiner

    wide = [_wide(found.columns[path][known]) for path in varied]
    every = np.stack([found.columns[path] for path in varied])
    with np.errstate(invalid="ignore", divide="ignore"):
        every = np.stack([np.log(row) if log else row for row, log in zip(every, wide, strict=True)])
    low, span = every[:, known].min(axis=1), np.ptp(every[:, known], axis=1)
    if known.sum() < 4 or not (span > 0.0).all():
        return None
    every = (every - low[:, None]) / span[:, None]
    points = every[:, known]
    if np.linalg.svd(points - points.mean(axis=1)[:, None], compute_uv=False)[-1] < 1e-6:
        return None
    ground = Triangulation(*points)
    lost = every[:, ~known & np.isfinite(every).all(axis=0)]
    if lost.size:
        ground.set_mask(_holes(points[:, ground.triangles], lost))
    corners = ground
    finer = any(wide) and points.shape[1] <= _FEW
    if finer:  # a straight line in logarithms bends between the corners
        corners, _ = UniformTriRefiner(ground).refine_triangulation(return_tri_index=True, subdiv=_FINER)

    def values(column: Array) -> Array:
        if not finer:
            return column
        return np.ma.filled(LinearTriInterpolator(ground, column)(corners.x, corners.y), float(column.min()))

    places = np.stack([corners.x, corners.y]) * span[:, None] + low[:, None]
    x, y = (np.exp(row) if log else row for row, log in zip(places, wide, strict=True))
    return _Ground(Triangulation(x, y, triangles=corners.triangles, mask=corners.mask), values)


def _holes(corners: Array, lost: Array) -> NDArray[np.bool_]:
    """Which triangles (2, triangles, 3) lie over refused designs: those whose centre is nearer to one than to a corner."""
    centres = corners.mean(axis=2)
    nearest = np.full(centres.shape[1], np.inf)
    for start in range(0, lost.shape[1], 256):
        part = lost[:, None, start : start + 256]
        nearest = np.minimum(nearest, np.hypot(*(centres[:, :, None] - part)).min(axis=1))
    return np.asarray(nearest < np.hypot(*(corners - centres[:, :, None])).min(axis=1))


def _wide(column: Array) -> bool:
    """Whether numbers are better shown by their logarithms."""
    return bool(column.min() > 0.0 and column.max() > _WIDE * column.min())


def _map(found: Sweep, varied: list[str], ground: _Ground) -> Figure:
    """Contours of the exact flywheel over two numbers, its least place, and where the approximate one is too light."""
    name = objective(found)
    known = np.isfinite(found.values[name])
    values = found.values[name][known]
    made = figure(9.0, 6.8, _heading(found, f"{_label(found, name)}: {len(found)} designs"))
    panel = made.subplots()
    name_axes(panel, "", _label(found, varied[0]), _label(found, varied[1]))
    panel.grid(visible=False)
    handles: list[Any] = []
    if np.ptp(values) > 0.0:
        _draw_contours(panel, ground, values, _label(found, name))
    if name == "exact" and (light := too_light(found)[known]).any():
        share = (found.values["approximate"][known] - values) / np.maximum(values, 1e-300)
        fine = ground.values(share)
        least = min(2.0 * float(fine.min()), -1.0)
        area = panel.tricontourf(ground.triangles, fine, levels=[least, -_NEAR], colors="none", hatches=["xxx"], zorder=3)
        area.set_edgecolor(VERMILLION)
        if not light.all():
            panel.tricontour(ground.triangles, fine, levels=[-_NEAR], colors=VERMILLION, linewidths=1.6, zorder=4)
        handles.append(Patch(facecolor="none", edgecolor=VERMILLION, hatch="xxx", lw=1.2, label=_DANGER))
    if not known.all():
        lost = [found.columns[path][~known] for path in varied]
        (mark,) = panel.plot(*lost, "x", color=GREY, ms=4, label="refused", zorder=2)
        handles.append(mark)
    best = found.argmin(name)
    place = [found.columns[path][best] for path in varied]
    words = f"least: {told(float(found.values[name][best]), most=4)}"
    (star,) = panel.plot(*place, "*", color=VERMILLION, mec="white", ms=16, label=words, zorder=6, clip_on=False)
    made.legend(handles=[star, *handles], loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    for axis, path in (("x", varied[0]), ("y", varied[1])):
        if _wide(found.columns[path][known]):
            getattr(panel, f"set_{axis}scale")("log")
    return made


def _draw_contours(panel: Axes, ground: _Ground, values: Array, label: str) -> None:
    """Filled contours with lines between them and their numbers, logarithmic where values differ much, and a bar beside."""
    log = values.min() > 0.0 and values.max() > _MANIFOLD * values.min()
    level = np.log(values) if log else values
    fine = ground.values(level)
    levels = np.linspace(level.min(), level.max(), _LEVELS)
    colours = "Greys_r" if current_form() == "print" else _COLOURS

    def number(height: float, place: object = None) -> str:
        return told(float(np.exp(height) if log else height), most=3)

    filled = panel.tricontourf(ground.triangles, fine, levels=levels, cmap=colours, zorder=0, extend="neither")
    lines = panel.tricontour(ground.triangles, fine, levels=levels, colors="white", linewidths=0.7, linestyles="-")
    panel.clabel(lines, levels=levels[1:-1:2], fmt=number, fontsize=8.5)
    bar = panel.figure.colorbar(filled, ax=panel, ticks=levels[::2], format=number)
    bar.set_label(label)


# -- more --------------------------------------------------------------------------------------------------------------


def _parallel(found: Sweep, varied: list[str], known: NDArray[np.bool_]) -> Figure:
    """Every design as a line over its numbers and figures; those of the front, and those that are dangerous, stand out."""
    name = objective(found)
    shown = [*(varied or list(found.columns)), *(each for each in (name, "approximate", "power") if each in found.names)]
    made = figure(max(9.0, 1.5 * len(shown)), 6.0, _heading(found, f"{len(found)} designs"))
    made.set_dpi(DPI)
    panel = made.subplots()
    index = np.flatnonzero(known)
    if not index.size:
        panel.set_axis_off()
        panel.text(0.5, 0.5, "every design is refused", ha="center", transform=panel.transAxes)
        return made
    aims = [name] + [other for other in ("power",) if other in found.names and np.ptp(np.abs(found[other][known])) > 0.0]
    front = found.pareto(*(np.abs(found[aim]) for aim in aims))
    rows = np.stack([np.asarray(found[key], float)[index] for key in shown], axis=1)
    low, span = rows.min(axis=0), np.ptp(rows, axis=0)
    wide = (low > 0.0) & (low + span > _WIDE * low)
    level = np.where(wide, np.log(np.where(wide, rows, 1.0)), rows)
    bottom, height = level.min(axis=0), np.ptp(level, axis=0)
    scaled = np.where(height > 0.0, (level - bottom) / np.where(height > 0.0, height, 1.0), 0.5)
    place = {int(k): i for i, k in enumerate(index)}
    ahead = np.array([place[int(k)] for k in front])
    some = np.unique(np.linspace(0, index.size - 1, min(_LINES, index.size)).astype(int))
    light = too_light(found)[index]
    across = np.arange(len(shown))
    pale, faint = [some[~light[some]], some[light[some]]], 0.5 if some.size < 100 else 0.25
    for which, colour in zip(pale, (GREY, VERMILLION), strict=True):
        lines = [np.stack([across, scaled[k]], axis=1) for k in which]
        panel.add_collection(LineCollection(lines, colors=colour, linewidths=0.6, alpha=faint, zorder=1))
    best = [np.stack([across, scaled[k]], axis=1) for k in ahead]
    panel.add_collection(LineCollection(best, colors=BLUE, linewidths=1.6 if len(best) < 40 else 0.9, zorder=3))
    panel.set_xlim(-0.25, len(shown) - 0.75)
    panel.set_ylim(-0.09, 1.09)
    panel.set_yticks([])
    panel.set_xticks(
        across,
        [
            _label(found, key).replace(", ", ",\n") + "\n(logarithmic)" * bool(log)
            for key, log in zip(shown, wide, strict=True)
        ],
        fontsize=8.5,
    )
    for side in panel.spines.values():
        side.set_visible(False)
    for k, (least, range_of) in enumerate(zip(low, span, strict=True)):
        panel.axvline(k, color=GREY, lw=1.0, zorder=2)
        for height_of, value in ((1.03, least + range_of), (-0.06, least)):
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
            panel.text(k, height_of, told(float(value), most=4), ha="center", fontsize=8.5, bbox=box, zorder=5)
    words = " and ".join(f"less {FIGURES[aim].about.partition(',')[0]}" for aim in aims)
    words = f"both {words}" if len(aims) > 1 else words
    handles = [Line2D([], [], color=BLUE, lw=1.6, label=f"front: no design has {words} ({len(front)})")]
    handles.append(Line2D([], [], color=GREY, lw=0.8, label="other designs" if some.size == index.size else "some others"))
    if light.any():
        handles.append(Line2D([], [], color=VERMILLION, lw=0.8, label=_DANGER))
    made.legend(handles=handles, loc="outside lower center", ncols=1, fontsize=9, frameon=False)
    return made
