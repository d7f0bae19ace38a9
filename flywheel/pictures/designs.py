"""Many designs and many methods: sensitivities, tolerances, optima, sweeps, and the error of methods over their time.

A sweep is curves over one number, a map over two, parallel coordinates of more. Exact and approximate flywheel stand
together, and a mark shows where the approximate one is too light, because that is dangerous.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import groupby, pairwise
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator
from numpy.typing import NDArray

from flywheel.designs.figures import FIGURES, selection
from flywheel.designs.optimum import Optimum
from flywheel.designs.sweep_results import ParetoFront, Sweep, objective
from flywheel.designs.tolerance import Tolerance
from flywheel.designs.variation import Sensitivities, change
from flywheel.numerics.units import figure as number
from flywheel.pictures import current_form, figures, written
from flywheel.pictures.figures import (
    BLACK,
    BLUE,
    DPI,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    PURPLE,
    SKY,
    VERMILLION,
    figure,
    name_axes,
    save,
)
from flywheel.study.tradeoff import FAMILIES, RESTARTED, MethodRow, Tradeoff, ordered
from flywheel.tables.rows import DEGREES, RPM, plain, short_names, under_title

__all__ = [
    "draw_optimum", "draw_sensitivities", "draw_sweep", "draw_tolerance", "draw_tradeoff", "placed",
    "plot_optimum", "plot_sensitivities", "plot_sweep", "plot_tolerance", "plot_tradeoff", "too_light",
]  # fmt: skip

Array = NDArray[np.float64]

# -- sensitivities, tolerances, optima ------------------------------------------------------------------
_MOST_PANELS, _MOST_BARS = 3, 14
_THIN = 2e-3  # of the longest bar: what is not drawn
_WIDE = 30.0  # ratio of values from which on an axis is logarithmic


def plot_sensitivities(result: Sensitivities, path: str | Path, names: Sequence[str] = ()) -> None:
    """Draws sensitivities into a file: PNG, SVG or PDF, by its ending; ValueError for any other."""
    save(draw_sensitivities(result, names), path)


def plot_tolerance(result: Tolerance, path: str | Path, names: Sequence[str] = ()) -> None:
    """Draws a tolerance into a file: PNG, SVG or PDF, by its ending; ValueError for any other."""
    save(draw_tolerance(result, names), path)


def plot_optimum(result: Optimum, path: str | Path) -> None:
    """Draws the course of an optimisation into a file: PNG, SVG or PDF, by its ending; ValueError for any other."""
    save(draw_optimum(result), path)


def plot_front(result: ParetoFront, path: str | Path) -> None:
    """Draws the front of several figures into a file: PNG, SVG or PDF, by its ending; ValueError for any other."""
    save(draw_front(result), path)


def draw_front(result: ParetoFront) -> Figure:
    """The designs of a front: each of the other figures over the first."""
    values = np.array([point.values for point in result.points]).T
    names = [f"{name}, {_unit(unit)}".rstrip(", ") for name, unit in zip(result.objectives, result.units, strict=True)]
    made = figure(7.5, 1.2 + 3.2 * (len(names) - 1), under_title(result.scene.title, "front of several figures"))
    panels: Any = made.subplots(len(names) - 1, 1, squeeze=False, sharex=True)
    for panel, row, name in zip(panels[:, 0], values[1:], names[1:], strict=True):
        panel.plot(values[0], row, "o-" if len(names) == 2 else "o", color=BLUE, ms=4.5, lw=1.0)
        name_axes(panel, "", "", name)
    panels[-1, 0].set_xlabel(names[0])
    return made


def draw_sensitivities(result: Sensitivities, names: Sequence[str] = ()) -> Figure:
    """Draws the change of figures in percent for one percent of a number or one degree of an angle, longest bars first.

    Where the slopes of both sides differ the bar has two parts, of the change as the number grows and as it falls.
    """
    kept = selection(result.values, names)[:_MOST_PANELS]
    short = short_names(result.numbers)
    heights = [min(max(_bars(result, name), 1), _MOST_BARS) for name in kept]
    tall = 1.3 + sum(0.32 * height + 0.75 for height in heights)
    made = figure(8.5, tall, under_title(result.scene.title, "sensitivities"))
    panels: Any = made.subplots(len(kept), 1, squeeze=False, height_ratios=[height + 1.5 for height in heights])
    for panel, name, height in zip(panels[:, 0], kept, heights, strict=True):
        _tornado(panel, result, name, short, height)
    panels[-1, 0].set_xlabel("change in % as a number grows by 1 % (an angle by 1°)")
    return made


def _bars(result: Sensitivities, name: str) -> int:
    """Number of bars of a figure that are long enough to be drawn."""
    widths = np.nan_to_num([np.nanmax(np.abs((0.0, *_sides(result, name, path)))) for path in result.numbers])
    return int((widths > _THIN * widths.max()).sum())


def _tornado(panel: Axes, result: Sensitivities, name: str, short: dict[str, str], most: int) -> None:
    """The bars of one figure."""
    sides = {path: _sides(result, name, path) for path in result.numbers}
    paths = [path for path in sides if not all(map(isnan, sides[path])) and sides[path] != (0.0, 0.0)]
    widths = {path: float(np.nanmax(np.abs(sides[path]))) for path in paths}
    order = sorted((path for path in paths if widths[path] > _THIN * max(widths.values())), key=lambda path: -widths[path])
    order = order[:most]
    name_axes(panel, f"{_about(name)}: {written(result.values[name])} {_unit(result.figure_units[name])}".rstrip(), "", "")
    widest = max((widths[path] for path in order), default=1.0)
    if len(paths) > len(order):
        panel.annotate(f"{len(paths) - len(order)} more, shorter", (0.99, 0.03), xycoords="axes fraction", ha="right",
                       fontsize=8.5, color=GREY)  # fmt: skip
    for k, path in enumerate(order):
        left, right = sides[path]
        if left == right:
            panel.barh(k, right, 0.62, color=BLUE if right > 0 else VERMILLION)
        else:
            for value, colour, at in ((right, BLUE, k - 0.16), (left, ORANGE, k + 0.16)):
                if not isnan(value):
                    panel.barh(at, value, 0.3, color=colour)
        end = max((value for value in (left, right) if not isnan(value)), key=abs)
        words = written(end, 3) if left == right else " | ".join("–" if isnan(v) else written(v, 3) for v in (left, right))
        panel.annotate(
            words, (end, k), (4 if end > 0 else -4, 0), textcoords="offset points", va="center",
            ha="left" if end > 0 else "right", fontsize=8.5,
        )  # fmt: skip
    panel.set_yticks(range(len(order)), [short[path] for path in order], fontsize=9)
    panel.set_ylim(len(order) - 0.4, -0.6)
    panel.set_xlim(-1.25 * widest, 1.25 * widest)
    panel.axvline(0.0, color=GREY, lw=0.9)
    if any(sides[path][0] != sides[path][1] for path in order):
        panel.plot([], [], "s", color=ORANGE, label="slope to the left")
        panel.plot([], [], "s", color=BLUE, label="slope to the right")
        panel.legend(fontsize=8.5, frameon=False, loc="lower right")


def _sides(result: Sensitivities, name: str, path: str) -> tuple[float, float]:
    """The changes by the slopes to the left and to the right, the same if there is a derivative."""
    derivative, whole = result.derivative(name, path), change(result, name, path)
    if not isnan(whole):
        whole = 0.0 if abs(derivative.value) <= derivative.error else whole
        return whole, whole
    one = result.values[name] and 100.0 / result.values[name]
    step = (np.pi / 180 if result.units[path] == "rad" else 0.01 * result.numbers[path]) * one
    return derivative.left * step, derivative.right * step


def draw_tolerance(result: Tolerance, names: Sequence[str] = ()) -> Figure:
    """Draws the histogram of each figure's samples with its statistics, and beside it the causes of its variance."""
    kept = [name for name in selection(result.spreads, names) if result.spreads[name].deviation > 0.0][:_MOST_PANELS]
    kept = kept or selection(result.spreads, names)[:1]
    many = "intervals" if result.intervals else "standard deviations"
    made = figure(11.0, 0.9 + 2.7 * len(kept), under_title(result.scene.title, f"tolerance: {many}"))
    panels: Any = made.subplots(len(kept), 2, squeeze=False, width_ratios=(1.5, 1.0))
    for (left, right), name in zip(panels, kept, strict=True):
        _histogram(left, result, name)
        _blame(right, result, name)
    handles = list(panels[0, 0].get_legend_handles_labels()[0])
    handles += panels[0, 1].get_legend_handles_labels()[0]
    made.legend(handles=handles, loc="outside lower center", ncols=6, fontsize=9, frameon=False)
    return made


def _histogram(panel: Axes, result: Tolerance, name: str) -> None:
    spread, values = result.spreads[name], result.figures[name]
    finite = values[np.isfinite(values)]
    name_axes(panel, "", f"{_about(name)}, {_unit(result.figure_units[name])}".rstrip(", "), "samples")
    panel.hist(finite, bins=min(40, max(8, finite.size // 25)), color=BLUE, alpha=0.55, lw=0)
    panel.axvline(spread.nominal, color="black", lw=1.4, label="as given")
    panel.axvline(spread.mean, color=GREEN, ls="--", lw=1.4, label="mean")
    if spread.least is not None and spread.greatest is not None:
        for end, label in ((spread.least, "least and greatest"), (spread.greatest, None)):
            panel.axvline(end.value, color=VERMILLION, lw=1.6, label=label)
    else:
        least, most = min(result.quantiles, default=0.0), max(result.quantiles, default=0.0)
        ends = [
            (result.quantiles.index(q), label)
            for q, label in ((least, f"{100 * least:g} and {100 * most:g} %"), (most, None))
            if q
        ]
        for k, label in ends:
            panel.axvline(spread.quantiles[k], color=VERMILLION, ls=":", lw=1.8, label=label)


def _blame(panel: Axes, result: Tolerance, name: str) -> None:
    shares = sorted(result.spreads[name].shares.items(), key=lambda item: -item[1].total)[:_MOST_BARS]
    short = short_names(result.numbers)
    name_axes(panel, "", "% of its variance", "")
    for k, (_, share) in enumerate(shares):
        panel.barh(k, 100 * share.total, 0.62, color=PALE, label="with others" if not k else None)
        panel.barh(k, 100 * share.first, 0.34, color=ORANGE, label="by itself" if not k else None)
        words = f"{100 * share.total:.2g}" if share.total < 0.995 else "100"
        panel.annotate(words, (100 * share.total, k), (4, 0), textcoords="offset points", va="center", fontsize=8.5)
    panel.set_yticks(range(len(shares)), [short[path] for path, _ in shares], fontsize=9)
    panel.set_ylim(len(shares) - 0.4, -0.6)
    panel.set_xlim(0.0, 112.0)


def draw_optimum(result: Optimum) -> Figure:
    """The figure at every design that was tried, the best so far, and below the numbers of that one within their bounds."""
    course, sign = result.course, 1.0 if result.greatest else -1.0
    count, short = course.values.size, short_names(result.numbers)
    aim = f"{'greatest' if result.greatest else 'least'} {result.objective}"
    made = figure(9.0, 6.4, under_title(result.scene.title, aim))
    above, below = made.subplots(2, 1, sharex=True, height_ratios=(1.4, 1.0))
    x = np.arange(1, count + 1)
    best = np.maximum.accumulate(np.where(course.kept, sign * course.values, -np.inf))
    leader = np.array([int(np.flatnonzero(best[: k + 1] == best[k])[0]) for k in range(count)])
    name_axes(above, "", "", f"{result.objective}, {_unit(result.unit)}".rstrip(", "))
    lost = ~course.kept & np.isfinite(course.values)
    above.plot(x[course.kept], course.values[course.kept], ".", color=GREY, ms=3.5, label="a design")
    if lost.any():
        above.plot(x[lost], course.values[lost], "x", color=PALE, ms=4, label="one that breaks a limit", zorder=1)
    finite = np.isfinite(best)
    above.step(x[finite], sign * best[finite], where="post", color=BLUE, lw=1.8, label="the best so far")
    if result.value_before is not None:
        above.axhline(result.value_before, color="black", lw=0.9, ls="--", label="the scene's own numbers")
    kept = course.values[course.kept]
    if kept.size and kept.min() > 0.0 and kept.max() > _WIDE * kept.min():  # so that the best designs are distinguished
        above.set_yscale("log")
    above.legend(fontsize=9, frameon=False, ncols=4, loc="upper right")
    colours = (BLUE, VERMILLION, GREEN, ORANGE, GREY)
    for k, (path, (low, high)) in enumerate(result.bounds.items()):
        share = 100.0 * (course.numbers[k] - low) / (high - low)
        value = result.numbers[path]
        factor, unit = _AXIS_UNITS.get(result.units[path], (1.0, _unit(result.units[path])))
        quantity = f"{written(factor * value)}{'' if unit == '°' else ' '}{unit}"
        below.step(x[finite], share[leader][finite], where="post", color=colours[k % len(colours)], lw=1.6,
                   label=f"{short[path]} = {quantity}".rstrip())  # fmt: skip
    name_axes(below, "", "designs in the order in which they were tried", "numbers of the best,\n% of their bounds")
    below.set_ylim(-4.0, 104.0)
    below.legend(fontsize=9, frameon=False, ncols=2)
    for search in range(1, int(course.search.max(initial=0)) + 1):
        first = int(np.argmax(course.search == search)) + 1
        for panel in (above, below):
            panel.axvline(first, color=PALE, lw=1.0, zorder=0)
    return made


def _about(name: str) -> str:
    return FIGURES[name].about.partition(",")[0]


def _unit(unit: str) -> str:
    return unit.replace("^2", "²").replace("N m", "N·m")


# -- sweeps ------------------------------------------------------------------

_WIDE_SWEEP = 100.0  # ratio from which on an axis is logarithmic
_LIGHTER = 1e-9
_LINES = 600  # of designs in parallel coordinates
_LEVELS = 12
_MANIFOLD = 10.0  # ratio of values from which on their contours are logarithmic
_FEW, _FINER = 3000, 3  # designs between which contours are drawn more finely, and how often triangles are halved for it
_DANGER = "approximate below exact: too light, danger"
_COLOURS = "cividis"
_AXIS_UNITS = {"rad/s": (RPM, "rpm"), "rad": (DEGREES, "°")}  # of a number in SI: factor and unit of its axis


def plot_sweep(result: Sweep, path: str | Path) -> None:
    """Draws a sweep into a file: PNG, SVG or PDF, by its ending; ValueError for any other."""
    save(draw_sweep(result), path)


def draw_sweep(result: Sweep) -> Figure:
    """The picture, not yet written anywhere."""
    columns = {path: _AXIS_UNITS.get(result.units[path], (1.0,))[0] * column for path, column in result.columns.items()}
    result = replace(result, columns=columns)
    varied = [path for path, column in result.columns.items() if np.ptp(column) > 0.0]
    finite = np.isfinite(result.values[objective(result)])
    if len(varied) == 1 and finite.any():
        return _curves(result, varied[0])
    if len(varied) == 2 and finite.any() and (ground := _ground(result, varied, finite)) is not None:
        return _map(result, varied, ground)
    return _parallel(result, varied, finite)


def _label(result: Sweep, name: str) -> str:
    words = FIGURES[name].about.partition(",")[0] if name in FIGURES else short_names(result.columns)[name]
    unit = result.units.get(name, "").replace("^2", "²")
    unit = unit if name in FIGURES or unit not in _AXIS_UNITS else _AXIS_UNITS[unit][1]
    return f"{words}, {unit}" if unit else words


def too_light(result: Sweep) -> NDArray[np.bool_]:
    """Mask of the designs whose approximate flywheel is below the exact one."""
    exact, approximate = result.values["exact"], result.values["approximate"]
    return np.asarray(exact - approximate > _LIGHTER * np.abs(exact))


# -- one number --------------------------------------------------------------------------------------------------------


def _curves(result: Sweep, path: str) -> Figure:
    """Exact and approximate flywheel over one number, and below the difference of the second from the first."""
    order = np.argsort(result.columns[path], kind="stable")
    x, name = result.columns[path][order], objective(result)
    sizes = name == "exact"
    made = figure(9.0, 6.8 if sizes else 4.6, under_title(result.scene.title, f"{len(result)} designs"))
    panels: Any = made.subplots(2 if sizes else 1, 1, sharex=True, squeeze=False, height_ratios=(2, 1) if sizes else (1,))
    above, marks = panels[0, 0], {"marker": "o", "ms": 3.5} if len(result) <= 60 else {}
    name_axes(above, "", "", _label(result, name) if not sizes else "flywheel at its shaft, kg m²")
    exact = result.values[name][order]
    above.plot(x, exact, color=BLUE, label="exact" if sizes else FIGURES[name].about, **marks)
    if sizes:
        approximate, light = result.values["approximate"][order], too_light(result)[order]
        above.plot(x, approximate, color=ORANGE, ls="--", label="approximate", **marks)
        above.fill_between(x, exact, approximate, where=light, interpolate=True, color=VERMILLION, alpha=0.25, lw=0)
        _deviation(panels[1, 0], result, x, exact, approximate, light)
    # bands over the numbers at which designs are refused
    middle = np.concatenate(([x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]))
    for k in np.flatnonzero(np.isnan(exact)):
        for panel in panels[:, 0]:
            panel.axvspan(middle[k], middle[k + 1], facecolor=PALE, hatch="///", edgecolor=GREY, lw=0, zorder=0)
    positive = exact[exact > 0.0]
    if positive.size and positive.size == np.isfinite(exact).sum() and positive.max() > _WIDE_SWEEP * positive.min():
        above.set_yscale("log")
    if x[0] > 0.0 and x[-1] > _WIDE_SWEEP * x[0]:
        above.set_xscale("log")
    panels[-1, 0].set_xlabel(_label(result, path))
    handles, _ = above.get_legend_handles_labels()
    if sizes and too_light(result).any():
        handles.append(Patch(color=VERMILLION, alpha=0.25, lw=0, label=_DANGER))
    if np.isnan(exact).any():
        handles.append(Patch(facecolor=PALE, hatch="///", edgecolor=GREY, lw=0, label="refused"))
    made.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=9, frameon=False)
    return made


def _deviation(panel: Axes, result: Sweep, x: Array, exact: Array, approximate: Array, light: NDArray[np.bool_]) -> None:
    """Draws the difference between approximate and exact flywheel, in percent, and marks the greatest."""
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
            f"{written(float(share[k]), most=3)} %",
            (x[k], share[k]),
            (0, -13 if share[k] > 0.0 else 7),
            textcoords="offset points",
            ha="right" if k > len(x) / 2 else "left",
            fontsize=9,
        )


# -- two numbers -------------------------------------------------------------------------------------------------------


_Ground = tuple[Any, Callable[[Array], Array]]  # triangles between designs, and an interpolation to their corners


def _ground(result: Sweep, varied: list[str], finite: NDArray[np.bool_]) -> _Ground | None:
    """The ground of a map of two numbers, logarithmic ones by their logarithms; None if the designs lie on a line."""
    from matplotlib.tri import LinearTriInterpolator, Triangulation, UniformTriRefiner

    wide = [_wide(result.columns[path][finite]) for path in varied]
    every = np.stack([result.columns[path] for path in varied])
    with np.errstate(invalid="ignore", divide="ignore"):
        every = np.stack([np.log(row) if log else row for row, log in zip(every, wide, strict=True)])
    low, span = every[:, finite].min(axis=1), np.ptp(every[:, finite], axis=1)
    if finite.sum() < 4 or not (span > 0.0).all():
        return None
    every = (every - low[:, None]) / span[:, None]
    points = every[:, finite]
    if np.linalg.svd(points - points.mean(axis=1)[:, None], compute_uv=False)[-1] < 1e-6:
        return None
    ground = Triangulation(*points)
    lost = every[:, ~finite & np.isfinite(every).all(axis=0)]
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
    return Triangulation(x, y, triangles=corners.triangles, mask=corners.mask), values


def _holes(corners: Array, lost: Array) -> NDArray[np.bool_]:
    """Mask of triangles (2, triangles, 3) over refused designs: those whose centre is nearer to one than to a corner."""
    centres = corners.mean(axis=2)
    nearest = np.full(centres.shape[1], np.inf)
    for start in range(0, lost.shape[1], 256):
        part = lost[:, None, start : start + 256]
        nearest = np.minimum(nearest, np.hypot(*(centres[:, :, None] - part)).min(axis=1))
    return np.asarray(nearest < np.hypot(*(corners - centres[:, :, None])).min(axis=1))


def _wide(column: Array) -> bool:
    """Tests whether numbers are better shown by their logarithms."""
    return bool(column.min() > 0.0 and column.max() > _WIDE_SWEEP * column.min())


def _map(result: Sweep, varied: list[str], ground: _Ground) -> Figure:
    """Contours of the exact flywheel over two numbers, its minimum, and where the approximate one is too light."""
    name = objective(result)
    finite = np.isfinite(result.values[name])
    values = result.values[name][finite]
    made = figure(9.0, 6.8, under_title(result.scene.title, f"{_label(result, name)}: {len(result)} designs"))
    panel = made.subplots()
    name_axes(panel, "", _label(result, varied[0]), _label(result, varied[1]))
    panel.grid(visible=False)
    handles: list[Any] = []
    if np.ptp(values) > 0.0:
        _draw_contours(panel, ground, values, _label(result, name))
    if name == "exact" and (light := too_light(result)[finite]).any():
        share = (result.values["approximate"][finite] - values) / np.maximum(values, 1e-300)
        triangles, interpolated = ground
        fine = interpolated(share)
        least = min(2.0 * float(fine.min()), -1.0)
        area = panel.tricontourf(triangles, fine, levels=[least, -_LIGHTER], colors="none", hatches=["//"], zorder=3)
        area.set_edgecolor(VERMILLION)
        if not light.all():
            panel.tricontour(triangles, fine, levels=[-_LIGHTER], colors=VERMILLION, linewidths=1.6, zorder=4)
        handles.append(Patch(facecolor="none", edgecolor=VERMILLION, hatch="//", lw=1.2, label=_DANGER))
    if not finite.all():
        lost = [result.columns[path][~finite] for path in varied]
        (mark,) = panel.plot(*lost, "x", color=GREY, ms=4, label="refused", zorder=2)
        handles.append(mark)
    best = result.argmin(name)
    place = [result.columns[path][best] for path in varied]
    words = f"least: {written(float(result.values[name][best]), most=4)} {_unit(result.units.get(name, ''))}".rstrip()
    (star,) = panel.plot(*place, "*", color=VERMILLION, mec="white", ms=16, label=words, zorder=6, clip_on=False)
    made.legend(handles=[star, *handles], loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    for axis, path in (("x", varied[0]), ("y", varied[1])):
        if _wide(result.columns[path][finite]):
            getattr(panel, f"set_{axis}scale")("log")
    return made


def _draw_contours(panel: Axes, ground: _Ground, values: Array, label: str) -> None:
    """Filled contours with lines between them and their numbers, logarithmic where values differ much, and a bar beside."""
    log = values.min() > 0.0 and values.max() > _MANIFOLD * values.min()
    level = np.log(values) if log else values
    triangles, interpolated = ground
    fine = interpolated(level)
    levels = np.linspace(level.min(), level.max(), _LEVELS)
    colours = "Greys_r" if current_form() == "print" else _COLOURS

    def number(height: float, place: object = None) -> str:
        return written(float(np.exp(height) if log else height), most=3)

    filled = panel.tricontourf(triangles, fine, levels=levels, cmap=colours, zorder=0, extend="neither")
    lines = panel.tricontour(triangles, fine, levels=levels, colors="white", linewidths=0.7, linestyles="-")
    panel.clabel(lines, levels=levels[1:-1:2], fmt=number, fontsize=8.5)
    bar = panel.figure.colorbar(filled, ax=panel, ticks=levels[::2], format=number)
    bar.set_label(label)


# -- more --------------------------------------------------------------------------------------------------------------


def _parallel(result: Sweep, varied: list[str], finite: NDArray[np.bool_]) -> Figure:
    """Every design as a line over its numbers and figures; those of the front, and those that are dangerous, stand out."""
    name = objective(result)
    axes = [*(varied or list(result.columns)), *(each for each in (name, "approximate", "power") if each in result.names)]
    made = figure(max(9.0, 1.5 * len(axes)), 6.0, under_title(result.scene.title, f"{len(result)} designs"))
    made.set_dpi(DPI)
    panel = made.subplots()
    index = np.flatnonzero(finite)
    if not index.size:
        panel.set_axis_off()
        panel.text(0.5, 0.5, "every design is refused", ha="center", transform=panel.transAxes)
        return made
    aims = [name] + [other for other in ("power",) if other in result.names and np.ptp(np.abs(result[other][finite])) > 0.0]
    front = result.pareto(*(np.abs(result[aim]) for aim in aims))
    rows = np.stack([np.asarray(result[key], float)[index] for key in axes], axis=1)
    low, span = rows.min(axis=0), np.ptp(rows, axis=0)
    wide = (low > 0.0) & (low + span > _WIDE_SWEEP * low)
    level = np.where(wide, np.log(np.where(wide, rows, 1.0)), rows)
    bottom, height = level.min(axis=0), np.ptp(level, axis=0)
    scaled = np.where(height > 0.0, (level - bottom) / np.where(height > 0.0, height, 1.0), 0.5)
    place = {int(k): i for i, k in enumerate(index)}
    ahead = np.array([place[int(k)] for k in front])
    some = np.unique(np.linspace(0, index.size - 1, min(_LINES, index.size)).astype(int))
    light = too_light(result)[index]
    across = np.arange(len(axes))
    pale, faint = [some[~light[some]], some[light[some]]], 0.5 if some.size < 100 else 0.25
    for which, colour in zip(pale, (GREY, VERMILLION), strict=True):
        lines = [np.stack([across, scaled[k]], axis=1) for k in which]
        panel.add_collection(LineCollection(lines, colors=colour, linewidths=0.6, alpha=faint, zorder=1))
    best = [np.stack([across, scaled[k]], axis=1) for k in ahead]
    panel.add_collection(LineCollection(best, colors=BLUE, linewidths=1.6 if len(best) < 40 else 0.9, zorder=3))
    panel.set_xlim(-0.25, len(axes) - 0.75)
    panel.set_ylim(-0.09, 1.09)
    panel.set_yticks([])
    panel.set_xticks(
        across,
        [
            _label(result, key).replace(", ", ",\n") + "\n(logarithmic)" * bool(log)
            for key, log in zip(axes, wide, strict=True)
        ],
        fontsize=8.5,
    )
    for side in panel.spines.values():
        side.set_visible(False)
    for k, (least, range_of) in enumerate(zip(low, span, strict=True)):
        panel.axvline(k, color=GREY, lw=1.0, zorder=2)
        for height_of, value in ((1.03, least + range_of), (-0.06, least)):
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
            panel.text(k, height_of, written(float(value), most=4), ha="center", fontsize=8.5, bbox=box, zorder=5)
    words = " and ".join(f"less {FIGURES[aim].about.partition(',')[0]}" for aim in aims)
    words = f"both {words}" if len(aims) > 1 else words
    handles = [Line2D([], [], color=BLUE, lw=1.6, label=f"front: no design has {words} ({len(front)})")]
    handles.append(Line2D([], [], color=GREY, lw=0.8, label="other designs" if some.size == index.size else "some others"))
    if light.any():
        handles.append(Line2D([], [], color=VERMILLION, lw=0.8, label=_DANGER))
    made.legend(handles=handles, loc="outside lower center", ncols=1, fontsize=9, frameon=False)
    return made


# -- methods: work and precision ------------------------------------------------------------------

_SIZE = (11.0, 7.5)
_FONT = 7.5  # of labels
_LEAST = 1e-17  # what an error bound of 0 is drawn at
_ROOM = 2.5  # factor beyond the outermost points
_MARK, _RINGED, _LEADER = 5.0, 10.0, 8.0  # half a mark's width, ringed; distance from which a label gets a leader
_LOOKS = (
    *((VERMILLION, "s"), (ORANGE, "D"), (GREY, "X"), (BLUE, "o"), (BLUE, "o"), (SKY, "p")),
    *(("#8C6D31", "v"), (GREEN, "^"), (PURPLE, "<"), ("#882255", ">"), ("#44AA99", "d")),
    *((BLACK, "P"), ("#C0A000", "*"), (VERMILLION, "H")),
)
_LOOK = dict(zip(FAMILIES, _LOOKS, strict=True))
_OTHER = (BLACK, "h")


def plot_tradeoff(result: Tradeoff, path: str | Path) -> None:
    """Draws a comparison into a file: PNG, SVG or PDF, by its ending; ValueError for any other."""
    save(draw_tradeoff(result), path)


def draw_tradeoff(result: Tradeoff) -> Figure:
    """The picture, not yet written anywhere.

    Errors below the reference's own error bound stand on the upper edge of a shaded floor. Methods that restart where loads
    jump are filled, those that do not are hollow. Colour and marker show the family, a line joins its settings.
    """
    rows = [row for row in ordered(result.rows) if row.error is not None and row.seconds]
    made = figure(*_SIZE, under_title(result.title, f"{result.figure}: error against time"))
    made.set_dpi(DPI)  # sizes of texts are those of the picture that is written
    panel = made.subplots()
    name_axes(panel, _subtitle(result, len(rows)), "median time, ms", "true relative error")
    panel.title.set_fontsize(10.5)

    floor = max(result.reference.doubt, _LEAST)
    points = np.array([(1e3 * (row.seconds or 0.0), max(row.error or 0.0, floor)) for row in rows]).reshape(-1, 2)
    panel.set_xscale("log")
    panel.set_yscale("log")
    low, high = (points[:, 0].min(), points[:, 0].max()) if len(points) else (0.1, 1e3)
    panel.set_xlim(low / _ROOM, high * _ROOM**2)
    errors = np.append(points[:, 1], [floor, result.rtol])
    panel.set_ylim(errors.min() / _ROOM**3, errors.max() * _ROOM**2)
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value, most=6)))
    panel.yaxis.set_major_locator(LogLocator(numticks=20))
    panel.yaxis.set_minor_locator(LogLocator(subs=()))
    panel.axhline(result.rtol, color=VERMILLION, lw=1.2, ls="--", zorder=1, label=f"asked: {result.rtol:g}")
    label = f"the reference's doubt: {floor:.1e}"
    panel.axhspan(panel.get_ylim()[0], floor, color=GREY, alpha=0.18, lw=0, zorder=0, label=label)

    left, right = panel.get_xlim()
    lines = [((left, result.rtol), (right, result.rtol)), *_draw_series(panel, rows, points)]
    marks = np.full(len(rows), _MARK)
    for k, row in enumerate(rows):
        if row.name == result.cheapest:
            panel.plot(*points[k], "o", ms=17, mfc="none", mec=VERMILLION, mew=2.0, zorder=4, label="cheapest that keeps it")
            marks[k] = _RINGED
    if any(_hollow(row, rows) for row in rows):
        panel.plot([], [], ls=":", marker="o", color=GREY, mfc="white", ms=7, label="hollow: without restart")
    made.legend(loc="outside lower center", ncols=4, fontsize=8.5, frameon=False)
    figures.lay_out(made)
    texts = [made.text(0.0, 0.0, row.label, fontsize=_FONT, va="bottom", parse_math=False) for row in rows]
    if texts:
        _arrange(made, panel, points, marks, texts, lines)
    return made


def _subtitle(result: Tradeoff, count: int) -> str:
    best = "No method that was run meets the tolerance"
    if result.cheapest is not None:
        row = result.row(result.cheapest)
        best = f"Cheapest that keeps {result.rtol:g}: {row.name}, {plain(1e3 * (row.seconds or 0.0), 3)} ms"
    if not result.complete:
        return f"{best}\nINCOMPLETE: {len(result.rows) - count} of {len(result.rows)} methods are missing"
    return f"{best}; {len(result.rows) - count} methods have no answer" if count < len(result.rows) else best


def _draw_series(panel: Axes, rows: list[MethodRow], points: Array) -> list[tuple[Array, Array]]:
    """Markers of each family, and lines through its settings, those with a restart apart from those without."""
    lines: list[tuple[Array, Array]] = []
    labelled = set[str]()
    for (family, _), group in groupby(range(len(rows)), lambda k: (rows[k].family, rows[k].name.endswith(RESTARTED))):
        places = list(group)
        own = points[places]
        colour, marker = _LOOK.get(family, _OTHER)
        style: Any = {"color": colour, "marker": marker, "ms": 7, "mew": 1.3, "lw": 1.0, "alpha": 0.95}
        hollow = _hollow(rows[places[0]], rows)
        label = None if family in labelled else family
        panel.plot(*own.T, mfc="white" if hollow else colour, ls=":" if hollow else "-", label=label, zorder=3, **style)
        labelled.add(family)
        lines += pairwise(own)
    return lines


def _hollow(row: MethodRow, rows: list[MethodRow]) -> bool:
    """Tests whether a row has no restart where others of its family have one."""
    family = [other for other in rows if other.family == row.family]
    return not row.name.endswith(RESTARTED) and any(other.name.endswith(RESTARTED) for other in family)


def _arrange(made: Figure, panel: Axes, points: Array, marks: Array, texts: list[Any], lines: Sequence[Any]) -> None:
    """Puts labels beside their points, and draws thin leaders to them; lengths are in points (1/72 inch).

    `marks` is half of every mark's width, `lines` the ends of lines in the panel's units.
    """
    dots = 72.0 / made.dpi
    sizes = dots * np.array([[box.width, box.height] for box in (text.get_window_extent() for text in texts)])
    pixels = panel.transData.transform
    segments = np.array([[pixels(start), pixels(end)] for start, end in lines]).reshape(-1, 4)
    anchors = dots * np.array([pixels(point) for point in points])
    blocks = np.concatenate([anchors - marks[:, None], anchors + marks[:, None]], axis=1)
    corners, ends = placed(anchors, sizes, dots * np.array(panel.get_window_extent().extents), blocks, dots * segments)
    whole = np.array(_SIZE) * 72.0
    for text, corner, end, point in zip(texts, corners, ends, anchors, strict=True):
        text.set_position(corner / whole)
        if np.hypot(*(end - point)) > _LEADER:
            made.add_artist(Line2D(*np.stack([point, end], axis=1) / whole[:, None], color=GREY, lw=0.5, zorder=2))


# -- places of labels --------------------------------------------------------------------------------------------------

_DIRECTIONS, _RINGS = 32, 32
_GAP = 6.0  # from a point to its label (the unit of all lengths: pixels, or points)
_AROUND = 2.0  # around a label
_STEP = 8.0  # between two rings of candidates
_SWEEPS = 4
_CHUNK = 48  # places looked at together
_FAR = 40.0  # beyond which distance counts more than in proportion
_COVERED, _STRUCK, _DOTTED, _CROSSED, _UNDER = 1e6, 1e3, 300.0, 150.0, 15.0  # what a place costs beside the distance


def placed(points: Array, sizes: Array, frame: Sequence[float] | Array, blocks: Array, lines: Array) -> tuple[Array, Array]:
    """Places of labels beside their points, by a greedy choice among places around each, repeated a few times.

    They are lower left corners, and for each label the point on its edge where its leader ends; shape (n, 2).
    The most crowded labels choose first. A place costs its distance, and more where it lies across a leader or a line.

    Args:
        points: labelled points, shape (n, 2).
        sizes: widths and heights of the labels, shape (n, 2).
        frame: left, bottom, right, top, that labels stay within.
        blocks: rectangles (left, bottom, right, top) that no label may cover, shape (m, 4).
        lines: segments (x, y, x, y) that labels should not cover, shape (k, 4).

    """
    offers = []  # of each label its places and what they cost whatever other labels do, the cheapest first
    for point, size in zip(points, sizes, strict=True):
        boxes = _offers(point, size, frame)
        distance = np.hypot(*(_leaders(boxes, point)[:, 2:] - point).T)
        apart = points[(np.abs(points - point) > _GAP).any(axis=1)]
        dots = np.concatenate([apart - 0.5 * _GAP, apart + 0.5 * _GAP], axis=1)
        cost = distance * (1.0 + distance / _FAR) + _COVERED * _overlaps(boxes, blocks).sum(axis=1)
        cost = cost + _DOTTED * _struck(_leaders(boxes, point), dots).sum(axis=1)
        cost = cost + _UNDER * _struck(lines, boxes).sum(axis=0)
        order = np.argsort(cost, kind="stable")
        offers.append((boxes[order], cost[order]))
    count = len(points)
    order = np.argsort([-float((1.0 / (20.0 + np.hypot(*(points - point).T))).sum()) for point in points], kind="stable")
    boxes, leaders = np.full((count, 4), np.nan), np.full((count, 4), np.nan)
    for _ in range(_SWEEPS):
        before = boxes.copy()
        for k in order:
            others = ~np.isnan(boxes[:, 0]) & (np.arange(count) != k)
            own, costs = offers[k]
            boxes[k] = _cheapest(own, costs, points[k], boxes[others], leaders[others])
            leaders[k] = _leaders(boxes[k][None], points[k])[0]
        if np.array_equal(boxes, before):
            break
    return boxes[:, :2] + _AROUND, leaders[:, 2:]


def _offers(point: Array, size: Array, frame: Sequence[float] | Array) -> Array:
    """Boxes around a point within the frame, the nearest first; one moved into the frame where none fits."""
    width, height = size + 2 * _AROUND
    turns = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    radii = _GAP + _STEP * np.arange(_RINGS) ** 1.25
    way = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    half = np.array([0.5 * width, 0.5 * height])
    # the box's edge, not its middle, goes around the point
    corner = (point + way[None] * radii[:, None, None] + way * half - half).reshape(-1, 2)
    boxes = np.concatenate([corner, corner + np.array([width, height])], axis=1)
    left, bottom, right, top = frame
    inside = (boxes[:, 0] >= left) & (boxes[:, 1] >= bottom) & (boxes[:, 2] <= right) & (boxes[:, 3] <= top)
    if inside.any():
        return np.asarray(boxes[inside])
    x, y = np.clip(point, [left, bottom], [max(left, right - width), max(bottom, top - height)])
    return np.array([[x, y, x + width, y + height]])


def _cheapest(boxes: Array, base: Array, point: Array, others: Array, standing: Array) -> Array:
    """The cheapest place beside fixed labels and leaders; places that already cost too much are not examined."""
    best, least = boxes[0], np.inf
    for start in range(0, len(boxes), _CHUNK):
        if base[start] >= least:
            break
        part = boxes[start : start + _CHUNK]
        leaders = _leaders(part, point)
        cost = _COVERED * _overlaps(part, others).sum(axis=1)
        cost = cost + _STRUCK * (_struck(leaders, others).sum(axis=1) + _struck(standing, part).sum(axis=0))
        cost = base[start : start + _CHUNK] + (cost + _CROSSED * _crossings(leaders, standing).sum(axis=1))
        k = int(cost.argmin())
        if cost[k] < least:
            best, least = part[k], float(cost[k])
    return np.asarray(best)


def _leaders(boxes: Array, point: Array) -> Array:
    """Segments from a point to the nearest place of each box."""
    ends = np.clip(point, boxes[:, :2] + _AROUND, boxes[:, 2:] - _AROUND)
    return np.concatenate([np.broadcast_to(point, ends.shape), ends], axis=1)


def _overlaps(first: Array, second: Array) -> NDArray[np.bool_]:
    """Tests whether boxes overlap, each of the first with each of the second."""
    a, b = first[:, None, :], second[None, :, :]
    return np.asarray((a[..., :2] < b[..., 2:]).all(axis=-1) & (b[..., :2] < a[..., 2:]).all(axis=-1))


def _struck(segments: Array, boxes: Array) -> NDArray[np.bool_]:
    """Tests whether segments cross boxes, each with each, by the shares of the segment within a box's sides."""
    start, way = segments[:, None, :2], segments[:, None, 2:] - segments[:, None, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (boxes[None, :, :2] - start) / way, (boxes[None, :, 2:] - start) / way
    near, far = np.fmin(low, high), np.fmax(low, high)
    still = way == 0.0
    within = (start > boxes[None, :, :2]) & (start < boxes[None, :, 2:])
    near = np.where(still, np.where(within, -np.inf, np.inf), near).max(axis=-1)
    far = np.where(still, np.where(within, np.inf, -np.inf), far).min(axis=-1)
    return np.asarray(np.maximum(near, 0.0) < np.minimum(far, 1.0))


def _crossings(first: Array, second: Array) -> NDArray[np.bool_]:
    """Tests whether segments cross, each with each; those from one point do not."""
    p, q = first[:, None, :2], first[:, None, 2:]
    r, s = second[None, :, :2], second[None, :, 2:]
    return np.asarray((_side(p, q, r) * _side(p, q, s) < 0.0) & (_side(r, s, p) * _side(r, s, q) < 0.0))


def _side(a: Array, b: Array, c: Array) -> Array:
    return np.asarray((b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0]))
