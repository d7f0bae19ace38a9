"""What the pictures of mechanisms share: colours, one way to make a figure and one to write it, the same every time.

Figures are objects of their own: no global state is touched, nothing is shown. Colours are those of Okabe and Ito, which
the colour-blind can tell apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bondgraph.storage.files import replacement
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.units import figure as number
from flywheel.regime import turning_moment
from flywheel.regime.steady_motion import Run
from flywheel.regime.turning_moment import Cycle
from flywheel.report.flywheels import work_error
from flywheel.sizing.results import Sizing

BLACK, GREY, PALE = "#000000", "#6E6E6E", "#DDDDDD"
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
BODIES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, "#8C6D31", "#999999")
FORMATS: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
_STYLE: Any = {"font.size": 10.0, "axes.titlesize": 11.5, "svg.hashsalt": "flywheel", "pdf.fonttype": 42}
DPI = 125


def figure(width: float, height: float, title: str) -> Figure:
    """An empty figure (inches), laid out so that nothing overlaps."""
    made = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    made.get_layout_engine().set(w_pad=0.08, h_pad=0.08)  # type: ignore[union-attr, call-arg]
    if title:
        made.suptitle(title, fontsize=13, parse_math=False)
    return made


def save(made: Figure, path: str | Path) -> None:
    """Write a figure as PNG, SVG or PDF, as the path ends; ValueError for any other ending."""
    import warnings

    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in FORMATS:
        raise ValueError(f"found {str(path)!r}, expected a file name ending in .png, .svg or .pdf")
    with replacement(path, kind) as fresh, rc_context(_STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # of a title; the picture has a box there
        made.savefig(fresh, format=kind, dpi=DPI, metadata=FORMATS[kind])


def name_axes(panel: Axes, title: str, xlabel: str, ylabel: str) -> None:
    """Title, labels and a faint grid."""
    panel.set_title(title, parse_math=False)
    panel.set_xlabel(xlabel)
    panel.set_ylabel(ylabel)
    panel.grid(color=PALE, linewidth=0.6)
    panel.set_axisbelow(True)


def shade(colour: str, light: float) -> tuple[float, float, float]:
    """A colour mixed with white (light > 0) or with black (light < 0), by that share.

    >>> shade("#0000FF", 0.5), shade("#0000FF", -0.5)
    ((0.5, 0.5, 1.0), (0.0, 0.0, 0.5))
    """
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    end, share = (1.0, light) if light > 0 else (0.0, -light)
    return tuple(part + share * (end - part) for part in (red, green, blue))  # type: ignore[return-value]


# -- labels ------------------------------------------------------------------------------------------------------------

# Labels beside points, pushed apart: no label covers another, a point, or the edge of its panel.


Array = NDArray[np.float64]

_DIRECTIONS, _RINGS = 32, 32
_GAP = 6.0  # from a point to its label (the unit of all lengths: pixels, or points)
_ROOM = 2.0  # around a label
_STEP = 8.0  # between two rings of candidates
_SWEEPS = 4
_CHUNK = 48  # places looked at together
_FAR = 40.0  # beyond which distance counts more than in proportion
_COVERED, _STRUCK, _DOTTED, _CROSSED, _UNDER = 1e6, 1e3, 300.0, 150.0, 15.0  # what a place costs beside the distance


class Placed(NamedTuple):
    """Where labels stand: lower left corners, and of each the point on its edge that its leader comes to; shape (n, 2)."""

    corners: Array
    ends: Array


def placed(points: Array, sizes: Array, frame: Sequence[float] | Array, blocks: Array, lines: Array) -> Placed:
    """Places of labels beside their points, by a greedy choice among places around each, looked over again a few times.

    The most crowded labels choose first. A place costs its distance, and more where it lies across a leader or a line.

    Args:
        points: what is labelled, shape (n, 2).
        sizes: widths and heights of the labels, shape (n, 2).
        frame: left, bottom, right, top, that labels stay within.
        blocks: rectangles (left, bottom, right, top) that no label may cover, shape (m, 4).
        lines: segments (x, y, x, y) that labels had better not cover, shape (k, 4).

    """
    count = len(points)
    offers = [_ranked(point, size, frame, blocks, points, lines) for point, size in zip(points, sizes, strict=True)]
    order = np.argsort([-_crowd(points, point) for point in points], kind="stable")
    boxes: Array = np.full((count, 4), np.nan)
    leaders: Array = np.full((count, 4), np.nan)
    for _ in range(_SWEEPS):
        before = boxes.copy()
        for k in order:
            others = ~np.isnan(boxes[:, 0]) & (np.arange(count) != k)
            boxes[k] = _cheapest(offers[k], points[k], boxes[others], leaders[others])
            leaders[k] = _leaders(boxes[k][None], points[k])[0]
        if np.array_equal(boxes, before):
            break
    return Placed(boxes[:, :2] + _ROOM, leaders[:, 2:])


def _ranked(
    point: Array, size: Array, frame: Sequence[float] | Array, blocks: Array, points: Array, lines: Array
) -> tuple[Array, Array]:
    """Places of a label and what they cost whatever other labels do, the cheapest first."""
    boxes = _offers(point, size, frame)
    cost = _base(boxes, point, blocks, points, lines)
    order = np.argsort(cost, kind="stable")
    return boxes[order], cost[order]


def _cheapest(ranked: tuple[Array, Array], point: Array, others: Array, standing: Array) -> Array:
    """The best of ranked places beside labels that stand; those that are too dear by themselves are not looked at."""
    boxes, base = ranked
    best, least = boxes[0], np.inf
    for start in range(0, len(boxes), _CHUNK):
        if base[start] >= least:
            break
        part = slice(start, start + _CHUNK)
        cost = base[part] + _cost(boxes[part], point, others, standing)
        k = int(cost.argmin())
        if cost[k] < least:
            best, least = boxes[part][k], float(cost[k])
    return np.asarray(best)


def _offers(point: Array, size: Array, frame: Sequence[float] | Array) -> Array:
    """Boxes around a point within the frame, the nearest first; one moved into the frame where none fits."""
    width, height = size + 2 * _ROOM
    turns = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    radii = _GAP + _STEP * np.arange(_RINGS) ** 1.25
    way = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    reach = way[None] * radii[:, None, None]
    # the box's edge, not its middle, goes around the point
    middle = point + reach + way * np.array([0.5 * width, 0.5 * height])
    corner = (middle - np.array([0.5 * width, 0.5 * height])).reshape(-1, 2)
    boxes = np.concatenate([corner, corner + np.array([width, height])], axis=1)
    left, bottom, right, top = frame
    inside = (boxes[:, 0] >= left) & (boxes[:, 1] >= bottom) & (boxes[:, 2] <= right) & (boxes[:, 3] <= top)
    if inside.any():
        return np.asarray(boxes[inside])
    x, y = np.clip(point, [left, bottom], [max(left, right - width), max(bottom, top - height)])
    return np.array([[x, y, x + width, y + height]])


def _base(boxes: Array, point: Array, blocks: Array, points: Array, lines: Array) -> Array:
    """What places cost whatever other labels do."""
    distance = np.hypot(*(_nearest(boxes, point) - point).T)
    cost = distance * (1.0 + distance / _FAR) + _COVERED * _overlaps(boxes, blocks).sum(axis=1)
    leaders = _leaders(boxes, point)
    apart = points[(np.abs(points - point) > _GAP).any(axis=1)]
    dots = np.concatenate([apart - 0.5 * _GAP, apart + 0.5 * _GAP], axis=1)
    cost = cost + _DOTTED * _struck(leaders, dots).sum(axis=1)
    return np.asarray(cost + _UNDER * _struck(lines, boxes).sum(axis=0))


def _cost(boxes: Array, point: Array, others: Array, standing: Array) -> Array:
    """What places cost for the labels that stand already, and their leaders."""
    leaders = _leaders(boxes, point)
    cost = _COVERED * _overlaps(boxes, others).sum(axis=1)
    cost = cost + _STRUCK * (_struck(leaders, others).sum(axis=1) + _struck(standing, boxes).sum(axis=0))
    return np.asarray(cost + _CROSSED * _crossings(leaders, standing).sum(axis=1))


def _crowd(points: Array, point: Array) -> float:
    return float((1.0 / (20.0 + np.hypot(*(points - point).T))).sum())


def _nearest(boxes: Array, point: Array) -> Array:
    """Of each box the place that is nearest to a point."""
    return np.asarray(np.clip(point, boxes[:, :2] + _ROOM, boxes[:, 2:] - _ROOM))


def _leaders(boxes: Array, point: Array) -> Array:
    ends = _nearest(boxes, point)
    return np.concatenate([np.broadcast_to(point, ends.shape), ends], axis=1)


def _overlaps(first: Array, second: Array) -> NDArray[np.bool_]:
    """Whether boxes overlap, each of the first with each of the second."""
    a, b = first[:, None, :], second[None, :, :]
    return np.asarray((a[..., :2] < b[..., 2:]).all(axis=-1) & (b[..., :2] < a[..., 2:]).all(axis=-1))


def _struck(segments: Array, boxes: Array) -> NDArray[np.bool_]:
    """Whether segments run through boxes, each through each, by the shares of the segment within a box's sides."""
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
    """Whether segments cross, each with each; those from one point do not."""
    p, q = first[:, None, :2], first[:, None, 2:]
    r, s = second[None, :, :2], second[None, :, 2:]
    return np.asarray((_side(p, q, r) * _side(p, q, s) < 0.0) & (_side(r, s, p) * _side(r, s, q) < 0.0))


def _side(a: Array, b: Array, c: Array) -> Array:
    return np.asarray((b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0]))


# -- panels ------------------------------------------------------------------------------------------------------------

# What the panels of a sizing share: numbers, a legend with room above the curves, a band of speeds.


RPM = 30 / np.pi
_WIDE = 350.0  # points that a legend may be wide


def told(value: float, most: int = 5, error: float = 0.0) -> str:
    """A number with a true minus sign."""
    return number(value, error, most).replace("-", "−")


def legend(panel: Axes) -> None:
    """The legend along the top, in as many columns as fit, with room made for it above the curves."""
    handles, labels = panel.get_legend_handles_labels()
    widest = next(n for n in range(len(labels), 0, -1) if n == 1 or _legend_width(labels, n) <= _WIDE)
    rows = -(-len(labels) // widest)
    ncols = -(-len(labels) // rows)  # as few columns as these rows need
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + (high - low) * (0.04 + 0.065 * rows))
    style: dict[str, Any] = {"fontsize": 8.5, "handlelength": 1.7, "columnspacing": 1.2, "framealpha": 1.0}
    panel.legend(handles, labels, loc="upper center", ncols=ncols, borderaxespad=0.4, **style)


def _legend_width(labels: list[str], ncols: int) -> float:
    """About how wide (points) a legend becomes: filled column by column, the first ones with one more if need be."""
    chunks = np.array_split(np.array([len(label) for label in labels]), ncols)
    return sum(4.6 * float(chunk.max()) + 28.0 for chunk in chunks)


def say(panel: Axes, title: str, why: str) -> None:
    """A panel that has nothing to draw says why."""
    panel.set_title(title)
    panel.set_axis_off()
    panel.text(0.5, 0.5, why, ha="center", va="center", transform=panel.transAxes, fontsize=11, color=GREY)


def origin_of(mean: float, traces: list[tuple[str, str, Array]]) -> float:
    """The mean, taken off where the fluctuation is too small for tick labels that count from zero."""
    swing = max((float(np.ptp(values)) for _, _, values in traces), default=0.0)
    return mean if swing < 2e-3 * mean else 0.0


def speed_label(sizing: Sizing, origin: float) -> str:
    """The label of an axis of speeds (rpm), from an origin on."""
    return f"crank speed − {told(sizing.speed * RPM, 6)} rpm, rpm" if origin else "crank speed, rpm"


def band(panel: Axes, sizing: Sizing, origin: float) -> None:
    """The band of speeds (rpm) that was asked for, and the mean of extremes."""
    eps, mean = sizing.scene.irregularity, sizing.speed * RPM
    if eps is not None:
        low, high = mean * (1 - eps / 2) - origin, mean * (1 + eps / 2) - origin
        panel.axhspan(low, high, color="#E4E4E4", zorder=0.5, label=f"band asked, ±{number(50 * eps, 0.0, 4)} %")
    panel.axhline(mean - origin, color=GREY, lw=0.9, ls="-.")


# -- curves ------------------------------------------------------------------------------------------------------------

# Curves of a sizing for drawing: sampled piece by piece, so that a jump stays a vertical line.
#
# No picture is drawn here, and nothing is imported but numpy.


_POINTS = 3000
_FEWEST, _MOST = 3, 65  # points in one cell, both ends included
MOST_BODIES = 8  # in a stacked picture


class Samples(NamedTuple):
    """One cycle, point by point: phi (rad), M* (N m), W (J), I* (kg m²), and the share of the balance in M* (N m).

    Two points stand at every edge of a cell, one for each side.
    """

    phi: Array
    moment: Array
    work: Array
    inertia: Array
    balance: Array | None


def sampled(machine: Machine, cycle: Cycle, speed: float | None = None) -> Samples:
    """A resolved cycle on evenly spread points in every cell, ends included.

    With a constant speed (rad/s) the share of a balance is told even where it depends on speed.
    """
    mesh = cycle.mesh
    count = mesh.phi.shape[0]
    t = np.linspace(-1.0, 1.0, int(np.clip(_POINTS // count, _FEWEST, _MOST)))
    phi = mesh.middle + mesh.half * t
    phi[:, 0], phi[:, -1] = mesh.edges[:-1], mesh.edges[1:]  # the same float on both sides of an edge
    cell, local = np.repeat(np.arange(count), t.size), np.tile(t, count)
    work, variation = cycle.at(cell, local)
    return Samples(
        phi=phi.ravel(),
        moment=(cycle.series[0] @ cells.basis(t, cells.ORDER).T).ravel(),
        work=work,
        inertia=cycle.inertia_at_start + variation,
        balance=None if cycle.balance is None else _share(machine, phi, mesh.anchor, cycle.balance, speed).ravel(),
    )


def _share(machine: Machine, phi: Array, anchor: Array, balance: float, speed: float | None) -> Array:
    """What the balance adds to M* (N m)."""
    station = machine.reduction.at(phi, anchor)
    factor = station.reduced.per_unknown + np.zeros_like(phi)
    moving = [] if speed is None else station.contributions(speed)
    return np.asarray(balance * (factor + sum(part for _, _, part in moving)))


def bodies(machine: Machine, samples: Samples) -> dict[str, Array]:
    """What each body adds to I* (kg m²) at the samples; bodies that add nothing are left out.

    Beyond `MOST_BODIES` the smallest ones are shown as one.
    """
    phi = samples.phi % machine.scene.cycle
    parts = machine.kinematics.inertias(machine.kinematics.flows(phi, machine.anchors(phi)))
    found = {name: np.broadcast_to(part, phi.shape) for name, part in parts.items() if np.any(part)}
    if len(found) <= MOST_BODIES:
        return found
    largest = sorted(found, key=lambda name: -float(found[name].max()))[: MOST_BODIES - 1]
    rest = [part for name, part in found.items() if name not in largest]
    shown = {name: part for name, part in found.items() if name in largest}
    return shown | {f"{len(rest)} others": np.sum(rest, axis=0)}


class Loop(NamedTuple):
    """Wittenbauer's loop, F = 2 W/w² against I* (both kg m²), and the two tangents that an irregularity gives it.

    A tangent is F = slope I* + intercept, slope = (1 ± eps/2)². `contact_*` are the points where it touches, as
    (I*, F), `angle_*` their crank angles (rad). The tangents meet in P at I* = -flywheel, and MN = 2 eps flywheel.
    """

    inertia: Array
    energy: Array
    slope_fast: float
    slope_slow: float
    intercept_fast: float
    intercept_slow: float
    contact_fast: tuple[float, float]
    contact_slow: tuple[float, float]
    angle_fast: float
    angle_slow: float
    flywheel: float

    @property
    def far_point(self) -> tuple[float, float]:
        """P, where the tangents meet: (I*, F)."""
        return -self.flywheel, self.intercept_fast - self.slope_fast * self.flywheel


def loop(cycle: Cycle, samples: Samples, speed: float, run: Run) -> Loop:
    """The loop with the tangents for the irregularity of a run, found from extremes, not from the samples.

    `speed` is w, the mean of extremes (rad/s). Source: F. Wittenbauer, Graphische Dynamik (1923).
    """
    unit, start = 2.0 / speed**2, cycle.inertia_at_start
    fast, slow = (1 + run.irregularity / 2) ** 2, (1 - run.irregularity / 2) ** 2
    extremes, _ = turning_moment.combined(cycle, np.array([[1.0, -fast / unit], [1.0, -slow / unit]]))
    over, under = float(extremes.greatest[0]), float(extremes.least[1])
    angles = float(extremes.angle_greatest[0]), float(extremes.angle_least[1])
    work, variation = cycle.at(*cycle.where(np.array(angles)))
    points = [(start + float(v), unit * float(w)) for w, v in zip(work, variation, strict=True)]
    return Loop(
        inertia=samples.inertia,
        energy=unit * samples.work,
        slope_fast=fast,
        slope_slow=slow,
        intercept_fast=unit * over - fast * start,
        intercept_slow=unit * under - slow * start,
        contact_fast=points[0],
        contact_slow=points[1],
        angle_fast=angles[0],
        angle_slow=angles[1],
        flywheel=run.inertia,
    )


def crossing_speeds(sums: Array, least: float, inertia: float) -> Array:
    """Crank speeds (rad/s) at the crossings of a diagram of areas, from ½ J (w² - w_min²) = S - S_min.

    `sums` are the accumulated areas S (J), `least` is w_min (rad/s), `inertia` the flywheel J on the crank (kg m²).

    >>> crossing_speeds(np.array([0.0, 3.5, -1.0]), 1.0, 1.0).round(6).tolist()
    [1.732051, 3.162278, 1.0]
    """
    return np.asarray(np.sqrt(least**2 + 2 * (sums - sums.min()) / inertia))


def roomiest(samples: Samples, start: float, end: float, side: float, width: float) -> tuple[float, float]:
    """Where a text of some width (rad) has most room under the curve between two angles, and |M*| that is free there.

    Of equally good places the one nearest to the centroid is taken; without room anywhere, the centroid.
    """
    phi = np.linspace(start, end, 201)
    size = np.maximum(side * np.interp(phi, samples.phi, samples.moment), 0.0)
    centroid = float((phi * size).sum() / size.sum()) if size.any() else 0.5 * (start + end)
    window = int(np.ceil(width / (phi[1] - phi[0]))) + 1
    if window >= phi.size:
        return centroid, 0.0
    free = np.lib.stride_tricks.sliding_window_view(size, window).min(axis=1)
    middles = phi[: free.size] + 0.5 * (window - 1) * (phi[1] - phi[0])
    good = np.flatnonzero(free >= 0.9 * free.max())
    best = good[np.abs(middles[good] - centroid).argmin()]
    return float(middles[best]), float(free[best])


# -- areas -------------------------------------------------------------------------------------------------------------

# The panels for a diagram of areas, which has no machine and no angles.


def draw(axes: NDArray[Any], sizing: Sizing) -> None:
    """Bars of the areas, their sums, and the speed at the crossings, in four panels."""
    works = np.array([area.work for area in sizing.areas])
    sums = np.array([0.0, *(area.accumulated for area in sizing.areas)])
    _area_bars(axes[0], works)
    _sums(axes[1], sizing, sums)
    why = "The loop needs the reduced inertia of a machine.\nA diagram of areas gives none, and counts all as flywheel."
    say(axes[2], "Wittenbauer's loop", why)
    _crossing_speeds(axes[3], sizing, sums)


def _area_bars(panel: Axes, works: Array) -> None:
    name_axes(panel, "Areas of the turning moment (angles not given)", "area", "work, J")
    places = np.arange(1, works.size + 1)
    for side, colour, label in ((1, SKY, "speeds up"), (-1, ORANGE, "slows down")):
        mine = side * works > 0
        if mine.any():
            panel.bar(places[mine], works[mine], color=colour, edgecolor=BLACK, lw=0.6, label=label)
    panel.axhline(0.0, color=BLACK, lw=0.8)
    panel.set_xticks(_spread(places), [f"A{k}" for k in _spread(places)])
    if works.any():
        legend(panel)


def _spread(places: NDArray[np.intp]) -> list[int]:
    """At most two dozen of the places, for ticks."""
    return [int(k) for k in places[:: -(-places.size // 24)]]


def _sums(panel: Axes, sizing: Sizing, sums: Array) -> None:
    name_axes(panel, "Accumulated areas", "crossing", "sum, J")
    places = np.arange(sums.size)
    panel.plot(places, sums, "o-", color=BLACK, lw=1.2, ms=4)
    for colour, marker, value, name in (
        (BLUE, "^", sizing.accumulated_max, "greatest"),
        (VERMILLION, "v", sizing.accumulated_min, "least"),
    ):
        at = int(np.abs(sums - value).argmin())
        label = f"{name}: S{at} = {told(value, 5, work_error(sizing))} J"
        panel.plot(at, value, marker, color=colour, ms=9, label=label)
        panel.axhline(value, color=colour, lw=0.9, ls=":")
    panel.set_xticks(_spread(places), [f"S{k}" for k in _spread(places)])
    legend(panel)


def _crossing_speeds(panel: Axes, sizing: Sizing, sums: Array) -> None:
    """Speed at the crossings: between them a diagram of areas tells nothing."""
    inertia = sizing.scene.inertia or sizing.flywheel.exact or 0.0
    if inertia == 0.0:
        say(panel, "Speed of the crank", "The areas are all zero:\nthe speed never changes.")
        return
    eps = sizing.simulation.irregularity if sizing.simulation is not None else sizing.scene.irregularity or 0.0
    on_crank = inertia * sizing.scene.flywheel_ratio**2
    speeds = RPM * crossing_speeds(sums, sizing.speed * (1 - eps / 2), on_crank)
    origin = origin_of(sizing.speed * RPM, [("", "", speeds)])
    name_axes(panel, "Speed of the crank at the crossings", "crossing", speed_label(sizing, origin))
    band(panel, sizing, origin)
    places = np.arange(sums.size)
    panel.plot(places, speeds - origin, "o", color=BLUE, ms=6, label=f"{told(inertia)} kg m², ε = {told(eps, 4)}")
    panel.set_xticks(_spread(places), [f"S{k}" for k in _spread(places)])
    legend(panel)
