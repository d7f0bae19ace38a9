"""Sensitivities as a tornado, tolerances as histograms with shares, an optimisation as its course."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, isnan
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flywheel.designs.figures import FIGURES
from flywheel.designs.optimum import Optimum
from flywheel.designs.sensitivities import Sensitivities
from flywheel.designs.tolerance import QUANTILES, Tolerance
from flywheel.pictures.figures import BLUE, GREEN, GREY, ORANGE, PALE, VERMILLION, figure, name_axes, save, told
from flywheel.tables.designs import change, shown
from flywheel.tables.rows import printable
from flywheel.tables.sweeps import short_names

Array = NDArray[np.float64]

_LONGEST_TITLE = 90
_MOST_PANELS, _MOST_BARS = 3, 14
_THIN = 2e-3  # of the longest bar: what is not drawn
_WIDE = 30.0  # ratio of values from which on an axis is logarithmic


def plot_sensitivities(found: Sensitivities, path: str | Path, names: Sequence[str] = ()) -> None:
    """Draw them into a file: PNG, SVG or PDF, as its ending says; ValueError for any other."""
    save(draw_sensitivities(found, names), path)


def plot_tolerance(found: Tolerance, path: str | Path, names: Sequence[str] = ()) -> None:
    """Draw a tolerance into a file: PNG, SVG or PDF, as its ending says; ValueError for any other."""
    save(draw_tolerance(found, names), path)


def plot_optimum(found: Optimum, path: str | Path) -> None:
    """Draw the course of an optimisation into a file: PNG, SVG or PDF, as its ending says; ValueError for any other."""
    save(draw_optimum(found), path)


def draw_sensitivities(found: Sensitivities, names: Sequence[str] = ()) -> Figure:
    """By how many per cent figures change for one per cent of a number, or a degree of an angle, the longest bars first.

    Where the slopes of both sides differ the bar has two parts, of the change as the number grows and as it falls.
    """
    kept = shown(found.values, names)[:_MOST_PANELS]
    short = short_names(found.numbers)
    heights = [min(max(_bars(found, name), 1), _MOST_BARS) for name in kept]
    made = figure(8.5, 1.3 + sum(0.32 * height + 0.75 for height in heights), _heading(found.scene.title, "sensitivities"))
    panels: Any = made.subplots(len(kept), 1, squeeze=False, height_ratios=[height + 1.5 for height in heights])
    for panel, name, height in zip(panels[:, 0], kept, heights, strict=True):
        _tornado(panel, found, name, short, height)
    panels[-1, 0].set_xlabel("change in % as a number grows by 1 % (an angle by 1°)")
    return made


def _bars(found: Sensitivities, name: str) -> int:
    """How many bars of a figure are long enough to be drawn."""
    widths = np.nan_to_num([np.nanmax(np.abs((0.0, *_sides(found, name, path)))) for path in found.numbers])
    return int((widths > _THIN * widths.max()).sum())


def _tornado(panel: Axes, found: Sensitivities, name: str, short: dict[str, str], most: int) -> None:
    """The bars of one figure."""
    sides = {path: _sides(found, name, path) for path in found.numbers}
    known = [path for path in sides if not all(map(isnan, sides[path])) and sides[path] != (0.0, 0.0)]
    widths = {path: float(np.nanmax(np.abs(sides[path]))) for path in known}
    order = sorted((path for path in known if widths[path] > _THIN * max(widths.values())), key=lambda path: -widths[path])
    order = order[:most]
    name_axes(panel, f"{_about(name)}: {told(found.values[name])} {_unit(found.figure_units[name])}".rstrip(), "", "")
    widest = max((widths[path] for path in order), default=1.0)
    if len(known) > len(order):
        panel.annotate(f"{len(known) - len(order)} more, shorter", (0.99, 0.03), xycoords="axes fraction", ha="right",
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
        words = told(end, 3) if left == right else " | ".join("–" if isnan(v) else told(v, 3) for v in (left, right))
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


def _sides(found: Sensitivities, name: str, path: str) -> tuple[float, float]:
    """The changes by the slopes to the left and to the right, the same where there is a derivative."""
    derivative, whole = found.derivative(name, path), change(found, name, path)
    if not isnan(whole):
        whole = 0.0 if abs(derivative.value) <= derivative.error else whole
        return whole, whole
    one = found.values[name] and 100.0 / found.values[name]
    step = (np.pi / 180 if found.units[path] == "rad" else 0.01 * found.numbers[path]) * one
    return derivative.left * step, derivative.right * step


def draw_tolerance(found: Tolerance, names: Sequence[str] = ()) -> Figure:
    """Of each figure the histogram of its samples, with what is said of it, and beside it who causes its variance."""
    kept = [name for name in shown(found.spreads, names) if found.spreads[name].shares][:_MOST_PANELS]
    kept = kept or shown(found.spreads, names)[:1]
    many = "intervals" if found.intervals else "standard deviations"
    made = figure(11.0, 0.9 + 2.7 * len(kept), _heading(found.scene.title, f"tolerance: {many}"))
    panels: Any = made.subplots(len(kept), 2, squeeze=False, width_ratios=(1.5, 1.0))
    for (left, right), name in zip(panels, kept, strict=True):
        _histogram(left, found, name)
        _blame(right, found, name)
    handles = list(panels[0, 0].get_legend_handles_labels()[0])
    handles += panels[0, 1].get_legend_handles_labels()[0]
    made.legend(handles=handles, loc="outside lower center", ncols=6, fontsize=9, frameon=False)
    return made


def _histogram(panel: Axes, found: Tolerance, name: str) -> None:
    spread, values = found.spreads[name], found.figures[name]
    known = values[np.isfinite(values)]
    name_axes(panel, "", f"{_about(name)}, {_unit(found.figure_units[name])}".rstrip(", "), "samples")
    panel.hist(known, bins=min(40, max(8, known.size // 25)), color=BLUE, alpha=0.55, lw=0)
    panel.axvline(spread.nominal, color="black", lw=1.4, label="as given")
    panel.axvline(spread.mean, color=GREEN, ls="--", lw=1.4, label="mean")
    if spread.least is not None and spread.greatest is not None:
        for end, label in ((spread.least, "least and greatest"), (spread.greatest, None)):
            panel.axvline(end.value, color=VERMILLION, lw=1.6, label=label)
    else:
        for k, label in ((0, f"{100 * QUANTILES[0]:g} and {100 * QUANTILES[-1]:g} %"), (-1, None)):
            panel.axvline(spread.quantiles[k], color=VERMILLION, ls=":", lw=1.8, label=label)


def _blame(panel: Axes, found: Tolerance, name: str) -> None:
    shares = sorted(found.spreads[name].shares.items(), key=lambda item: -item[1].total)[:_MOST_BARS]
    short = short_names(found.numbers)
    name_axes(panel, "", "% of its variance", "")
    for k, (_, share) in enumerate(shares):
        panel.barh(k, 100 * share.total, 0.62, color=PALE, label="with others" if not k else None)
        panel.barh(k, 100 * share.first, 0.34, color=ORANGE, label="by itself" if not k else None)
        words = f"{100 * share.total:.2g}" if share.total < 0.995 else "100"
        panel.annotate(words, (100 * share.total, k), (4, 0), textcoords="offset points", va="center", fontsize=8.5)
    panel.set_yticks(range(len(shares)), [short[path] for path, _ in shares], fontsize=9)
    panel.set_ylim(len(shares) - 0.4, -0.6)
    panel.set_xlim(0.0, 112.0)


def draw_optimum(found: Optimum) -> Figure:
    """The figure at every design that was tried, the best so far, and below the numbers of that one within their bounds."""
    course, sign = found.course, 1.0 if found.greatest else -1.0
    count, short = course.values.size, short_names(found.numbers)
    made = figure(9.0, 6.4, _heading(found.scene.title, f"{'greatest' if found.greatest else 'least'} {found.objective}"))
    above, below = made.subplots(2, 1, sharex=True, height_ratios=(1.4, 1.0))
    x = np.arange(1, count + 1)
    best = np.maximum.accumulate(np.where(course.kept, sign * course.values, -np.inf))
    leader = np.array([int(np.flatnonzero(best[: k + 1] == best[k])[0]) for k in range(count)])
    name_axes(above, "", "", f"{found.objective}, {_unit(found.unit)}".rstrip(", "))
    lost = ~course.kept & np.isfinite(course.values)
    above.plot(x[course.kept], course.values[course.kept], ".", color=GREY, ms=3.5, label="a design")
    if lost.any():
        above.plot(x[lost], course.values[lost], "x", color=PALE, ms=4, label="one that breaks a limit", zorder=1)
    known = np.isfinite(best)
    above.step(x[known], sign * best[known], where="post", color=BLUE, lw=1.8, label="the best so far")
    if found.value_before is not None:
        above.axhline(found.value_before, color="black", lw=0.9, ls="--", label="the scene's own numbers")
    _zoom(above, course.values[course.kept])
    above.legend(fontsize=9, frameon=False, ncols=4, loc="upper right")
    colours = (BLUE, VERMILLION, GREEN, ORANGE, GREY)
    for k, (path, (low, high)) in enumerate(found.bounds.items()):
        share = 100.0 * (course.numbers[k] - low) / (high - low)
        value = found.numbers[path]
        told_value = (
            f"{told(degrees(value))}°" if found.units[path] == "rad" else f"{told(value)} {_unit(found.units[path])}"
        )
        below.step(x[known], share[leader][known], where="post", color=colours[k % len(colours)], lw=1.6,
                   label=f"{short[path]} = {told_value}".rstrip())  # fmt: skip
    name_axes(below, "", "designs in the order in which they were tried", "numbers of the best,\n% of their bounds")
    below.set_ylim(-4.0, 104.0)
    below.legend(fontsize=9, frameon=False, ncols=2)
    for search in range(1, int(course.search.max(initial=0)) + 1):
        first = int(np.argmax(course.search == search)) + 1
        for panel in (above, below):
            panel.axvline(first, color=PALE, lw=1.0, zorder=0)
    return made


def _zoom(panel: Axes, values: Array) -> None:
    """An axis on which the best designs are told apart: logarithmic where values differ much."""
    if values.size and values.min() > 0.0 and values.max() > _WIDE * values.min():
        panel.set_yscale("log")


def _about(name: str) -> str:
    return FIGURES[name].about.partition(",")[0]


def _unit(unit: str) -> str:
    return unit.replace("^2", "²").replace("N m", "N·m")


def _heading(title: str | None, what: str) -> str:
    words = " ".join(printable(title or "").split())
    words = words if len(words) <= _LONGEST_TITLE else words[: _LONGEST_TITLE - 1] + "…"
    return f"{words}\n{what}" if words else what
