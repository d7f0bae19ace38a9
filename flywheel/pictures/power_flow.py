"""The power flow as a Sankey diagram: a trunk from the motor to the tool, its width to scale, from which losses bend down.

The trunk runs along the shafts from the greatest input to the greatest output. At each of its stations streams join it or
leave it: losses downwards, everything else upwards: other loads, further inputs and, at one crank angle, the power into or
out of inertias, springs and weights. The power and the losses of a side shaft leave the trunk at its connection. A stretch
in which power goes backwards, towards the motor, is drawn in that direction.

Layout: the sum of widths is constant at every fork, as M. H. Sankey drew it (Minutes of Proceedings of the Institution of
Civil Engineers 134, 1898); M. Schmidt, The Sankey diagram in energy and material flow management, Journal of Industrial
Ecology 12 (2008), 82-94 and 173-185.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline

from flywheel.language import number
from flywheel.language import text as _
from flywheel.numerics.units import figure as digits
from flywheel.pictures import current_form
from flywheel.pictures import form as in_form
from flywheel.pictures.figures import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    STYLE,
    VERMILLION,
    Picture,
    rgb,
    save,
    svg,
)
from flywheel.sizing.results import PowerFlow
from flywheel.tables.power import Entry, entries, gives, input_power, shaft_name
from flywheel.tables.rows import DEGREES, SI, five_digits, under_title

__all__ = ["draw", "panel", "plot"]

_HEIGHT = 1.5  # inches: width of the widest stream
_RADIUS, _DROP = 0.1, 0.42  # inches: of the inside of a bend, and of what is straight after it
_APART, _MARGIN = 0.1, 0.35  # inches: between two bends or names, around the picture
_HEAD = 0.09  # inches: how far an arrow's head stands out
_LEAST = 0.018  # inches: width of the thinnest stream that is drawn
_LETTER, _LINE = 0.075, 0.165  # inches: of a letter and of a line of text
_WORDS, _LONGEST = 15, 24  # letters in a line of a name, and of one whose words are long
_SEGMENT = 1.05  # inches: a stretch of the trunk that bears a name
_NO_STREAM = 1e-9  # of the widest: a stream that is none
_WIDEST = 15.0  # inches: beyond it names stand on two levels
_OF_KIND = {"load": GREEN, "stored": ORANGE}


class _Leaf(NamedTuple):
    """A stream that leaves the trunk (power > 0) or joins it, W; `down`: bent downwards."""

    entry: Entry
    power: float
    down: bool


_Stations = tuple[tuple[str, tuple[_Leaf, ...]], ...]
"""Stations of the trunk: the name of each, and the streams there."""
_Trunk = tuple[Entry, _Stations, Entry | None, float]
"""Trunk of the picture: its source, its stations, its end, and the power at its beginning (W), positive to the right."""


def plot(flow: PowerFlow, path: str | Path, *, at: float | None = None) -> None:
    """Draws the power flow over the mean, or at a crank angle (rad), into a file: PNG, SVG or PDF, by its ending.

    Raises ValueError for another ending, OSError if the file cannot be written.
    """
    save(draw(flow, at), path)


def panel(flow: PowerFlow, *, at: float | None = None, form: str = "screen", name: str = "power-flow") -> str:
    """The same as an SVG element to stand in an HTML document, in the language in use; its ids begin with `name`."""
    title = _title(flow, at)
    label = "; ".join(f"{entry.label} {_power(entry.power)}" for entry in entries(flow, at) if entry.stream.kind != "shaft")
    with in_form(form), rc_context(STYLE):
        return svg(draw(flow, at, titled=False), name, title, label)


def draw(flow: PowerFlow, at: float | None = None, *, titled: bool = True) -> Picture:
    """The Sankey diagram over the mean, or at a crank angle (rad), as a figure of matplotlib."""
    every = entries(flow, at)
    whole = input_power(flow, every)
    with rc_context(STYLE):
        if not whole > _NO_STREAM * flow.scale or not every:
            sheet = _PowerSheet()
            sheet.text(0.0, 0.0, _("No power flows."), ha="center", va="center", fontsize=11)
            return sheet.figure(_title(flow, at) if titled else "")
        return _Drawing(flow, _trunk_of(flow, every), whole).figure(_title(flow, at) if titled else "")


def _title(flow: PowerFlow, at: float | None) -> str:
    if at is None:
        label = _("Power flow, mean over a cycle of {period} s", period=number(digits(flow.period, 0.0, 4)))
    else:
        label = _("Power flow at a crank angle of {angle}°", angle=number(digits(at * DEGREES, 0.0, 5)))
    return under_title(flow.scene.title, label)


# -- which stream goes where ---------------------------------------------------------------------------------------------


def _trunk_of(flow: PowerFlow, every: Sequence[Entry]) -> _Trunk:
    """The trunk through the shafts from the greatest input to the greatest output, of the mean, and its branches."""
    ends = [entry for entry in every if entry.stream.kind in ("input", "drive", "load")]
    electric = any(entry.stream.kind == "input" for entry in ends)
    ends = [entry for entry in ends if entry.stream.kind != "drive" or not electric]
    means = {entry: entry._replace(power=entry.stream.mean) for entry in ends}
    idle = [entry for entry in ends if entry.stream.kind != "load" and not entry.stream.mean]
    inputs = [entry for entry in ends if entry in idle or gives(flow, means[entry])]
    start = max(inputs, key=lambda entry: entry.stream.mean, default=None)
    outputs = [entry for entry in ends if entry not in inputs] or [entry for entry in every if entry.stream.lost]
    end = max(outputs, key=lambda entry: entry.stream.mean, default=None)
    if start is None and end is None:
        start = next(iter(every), None)
    if start is None:
        start, end = end, None
    assert start is not None
    first = _shaft_of(flow, start)
    last = first if end is None else _shaft_of(flow, end)
    # the shafts from one to another, both included
    up, down = _near(flow, first), _near(flow, last)
    meet = next(shaft for shaft in up if shaft in down)
    way = [*up[: up.index(meet) + 1], *reversed(down[: down.index(meet)])]
    stations: list[tuple[str, tuple[_Leaf, ...]]] = []
    taken = {entry.stream for entry in (start, end) if entry is not None}
    rest = [entry for entry in every if entry.stream not in taken and entry.stream.kind != "shaft"]
    motor = [entry for entry in rest if entry.stream.source == "drive" and entry.stream.kind != "drive"]
    if electric and start.stream.kind == "input":
        stations.append((_("motor"), tuple(_leaf(flow, entry) for entry in motor)))
        rest = [entry for entry in rest if entry not in motor]
    if electric:
        rest = [entry for entry in rest if entry.stream.kind != "drive"]
    for k, shaft in enumerate(way):
        own = [entry for entry in rest if _on_trunk(flow, entry, way) == shaft and not _between(flow, entry, way)]
        stations.append((shaft_name(shaft), tuple(_leaf(flow, entry) for entry in own)))
        if k + 1 < len(way):
            pair = {shaft, way[k + 1]}
            lost = [entry for entry in rest if _between(flow, entry, way) and _pair(flow, entry) == pair]
            if lost:
                stations.append(("", tuple(_leaf(flow, entry) for entry in lost)))
    begins = start.power if gives(flow, means.get(start, start)) or start.stream.kind != "load" else -start.power
    return start, tuple(stations), end, begins


def _shaft_of(flow: PowerFlow, entry: Entry) -> str:
    """The shaft to which a stream belongs."""
    stream, scene = entry.stream, flow.scene
    for side in (stream.source, stream.target):
        if side.startswith("shafts.") and side[7:] in scene.shafts:
            return side[7:]
    return scene.drive.on if scene.drive is not None else "crank"


def _near(flow: PowerFlow, shaft: str) -> list[str]:
    """A shaft, and those between it and the crank."""
    return list(flow.scene.inwards(shaft))


def _on_trunk(flow: PowerFlow, entry: Entry, way: Sequence[str]) -> str:
    """The shaft of the trunk to which the stream's own shaft is connected."""
    shaft = _shaft_of(flow, entry)
    away = _near(flow, shaft)
    on = [other for other in away if other in way]
    return on[0] if on else next(other for other in _near(flow, way[0]) if other in way)


def _pair(flow: PowerFlow, entry: Entry) -> set[str]:
    """The two shafts of a mesh's stream."""
    return {entry.stream.on, flow.scene.near(entry.stream.on)} if entry.stream.on != "crank" else {"crank"}


def _between(flow: PowerFlow, entry: Entry, way: Sequence[str]) -> bool:
    """Tests whether a stream is the loss of a mesh in the trunk."""
    return entry.stream.kind in ("mesh", "slip") and _pair(flow, entry) <= set(way)


def _leaf(flow: PowerFlow, entry: Entry) -> _Leaf:
    """A stream beside the trunk, positive where it takes power."""
    stream = entry.stream
    inwards = stream.target in {f"shafts.{name}" for name in flow.scene.shafts} or stream.kind == "input"
    return _Leaf(entry, -entry.power if inwards else entry.power, stream.lost)


# -- the drawing -------------------------------------------------------------------------------------------------------


class _TrunkStep(NamedTuple):
    """Step of the trunk at which a stream leaves or joins: powers before and after (W), edges of the trunk (inches)."""

    leaf: _Leaf
    before: float
    after: float
    edges: tuple[float, float]
    next_edges: tuple[float, float]
    station: int


class _Drawing:
    """A trunk being drawn from the left to the right, in inches."""

    def __init__(self, flow: PowerFlow, trunk: _Trunk, whole: float) -> None:
        self.flow, self.whole = flow, whole
        self.source, self.stations, self.sink, begins = trunk
        powers, leaves = [begins], []
        for k, (_name, joining) in enumerate(self.stations):
            for leaf in _ordered(joining, powers[-1]):
                leaves.append((k, leaf))
                powers.append(powers[-1] - leaf.power)
        self.widest = max(map(abs, (*powers, *(leaf.power for _k, leaf in leaves)))) or 1.0
        edges = [(0.0, self.width(powers[0]))]
        for (_k, leaf), power in zip(leaves, powers[1:], strict=True):
            low, high = edges[-1]
            edges.append((high - self.width(power), high) if leaf.down else (low, low + self.width(power)))
        rows = zip(leaves, powers[:-1], powers[1:], edges[:-1], edges[1:], strict=True)
        self.steps = [_TrunkStep(leaf, before, after, one, other, k) for (k, leaf), before, after, one, other in rows]
        self.begins, self.ends = (powers[0], edges[0]), (powers[-1], edges[-1])
        self.reach = (min(low for low, _high in edges), max(high for _low, high in edges))
        lines = [(leaf.down, 1 + self._label(leaf.entry, leaf.power).count("\n")) for _k, leaf in leaves]
        self.lines = {side: max((n for down, n in lines if down == side), default=0) for side in (True, False)}

    def width(self, power: float) -> float:
        """Width (inches) of a power; 0 for one that is negligible beside the widest."""
        return 0.0 if abs(power) <= _NO_STREAM * self.widest else _HEIGHT * abs(power) / self.widest

    def figure(self, title: str) -> Picture:
        """All of it as a figure just large enough; names stand on two levels where one would make it too wide."""
        sheet = self._sheet(1)
        if sheet.right - sheet.left > _WIDEST:
            sheet = self._sheet(2)
        return sheet.figure(title)

    def _sheet(self, levels: int) -> _PowerSheet:
        """Patches and texts, with the names of bent streams on a number of levels."""
        sheet, x, sides = _PowerSheet(), 0.0, {True: _TrunkSide(levels), False: _TrunkSide(levels)}
        bands: list[tuple[float, float, float, float, float]] = []  # of the trunk: x, x, lower and upper edge, power
        power, edges = self.begins
        for k, (name, _leaves) in enumerate(self.stations):
            steps = [step for step in self.steps if step.station == k]
            words = f"{name}\n{_power(abs(power))}"
            long = max(_SEGMENT, _LETTER * max(map(len, words.split("\n"))) + 0.3) if name else 0.0
            common = [edges, *(step.next_edges for step in steps)]
            low, high = max(one[0] for one in common), min(one[1] for one in common)
            inside = high - low >= 2.4 * _LINE
            begin, x = x, x + (0.0 if k else _APART)
            if name and not inside:  # the name stands above, before anything turns off
                sheet.text(x + 0.5 * long, edges[1] + 0.05, words, ha="center", va="bottom", fontsize=9.5)
                bands.append((begin, x + long, *edges, power))
                x += long
            else:
                bands.append((begin, x, *edges, power))
            for step in steps:
                down = step.leaf.down
                label = self._label(step.leaf.entry, step.leaf.power)
                left, right, through = self._shares(step)
                wide = max(left + right, _LEAST)
                half = max(0.5 * _LETTER * max(map(len, label.split("\n"))), 0.5 * wide + _HEAD)
                before, behind = (_RADIUS if left or not right else 0.0), (_RADIUS if right else 0.0)
                level, middle = sides[down].taken(x + before + 0.5 * wide, half, wide)
                corner = middle - 0.5 * wide
                bands.append((x, corner - before, *edges, power))
                if through:
                    band = (edges[1] - through, edges[1]) if down else (edges[0], edges[0] + through)
                    bands.append((corner - before, corner + wide + behind, *band, step.before))
                self._leaf(sheet, step, corner, left, right, level)
                self._write(sheet, step, middle, label, level)
                x = corner + wide + behind
                power, edges = step.after, step.next_edges
            if name and inside:
                end = max(x, begin + long)
                sheet.text(0.5 * (begin + end), 0.5 * (low + high), words, ha="center", va="center", fontsize=9.5)
                bands.append((x, end, *edges, power))
                x = end
        if self.width(power):
            bands.append((x, x + 0.3, *edges, power))
            x += 0.3
        self._trunk(sheet, bands)
        self._ends(sheet, x, power, edges)
        return sheet

    def _shares(self, step: _TrunkStep) -> tuple[float, float, float]:
        """Widths (inches) of the stream's share of the trunk on its left, on its right, and of the power that passes by."""
        before, after = self.width(step.before), self.width(step.after)
        if step.before * step.after < 0.0:
            return before, after, 0.0
        return max(before - after, 0.0), max(after - before, 0.0), min(before, after)

    def _leaf(self, sheet: _PowerSheet, step: _TrunkStep, corner: float, left: float, right: float, level: int) -> None:
        """A stream's bends, its straight part and its head, or the notch of its tail."""
        leaf = step.leaf
        colour, leaves = self._colour(leaf), leaf.power > 0.0
        side = -1.0 if leaf.down else 1.0
        (low, high), (next_low, next_high) = step.edges, step.next_edges
        end = self._end(leaf.down, level)
        wide = max(left + right, _LEAST)
        if left or not right:  # what is too thin to be seen is drawn as a thin line
            width = left if right else wide
            edge = (low if leaf.down else high) if left else (next_low if leaf.down else next_high)
            sheet.bend(corner, edge, width, end, side, 1.0, colour)
        if right:
            edge = next_low if leaf.down else next_high
            sheet.bend(corner + wide, edge, right if left else wide, end, side, -1.0, colour)
        sheet.tip(corner + 0.5 * wide, end, wide, side, leaves, colour)

    def _end(self, down: bool, level: int) -> float:
        """End of the straight part of a stream."""
        drop = _RADIUS + _DROP + level * (self.lines[down] + 0.6) * _LINE
        return self.reach[0] - drop if down else self.reach[1] + drop

    def _colour(self, leaf: _Leaf) -> str:
        kind = leaf.entry.stream.kind
        if leaf.down:
            return VERMILLION
        return _OF_KIND.get(kind, BLUE) if leaf.power > 0.0 or kind == "stored" else BLUE

    def _label(self, entry: Entry, power: float) -> str:
        """Name, power and share of a stream."""
        words = entry.label.replace("–", "– ")  # where a line may end
        longest = max(map(len, words.split()), default=0)
        lines = wrap(words, min(max(_WORDS, longest), _LONGEST), break_on_hyphens=False) or [""]
        lines = [line.replace("– ", "–") for line in lines]
        share = 100.0 * abs(power) / self.whole
        return "\n".join([*lines, _power(abs(power)), f"{number(digits(share, 0.0, 3))} %"])

    def _write(self, sheet: _PowerSheet, step: _TrunkStep, middle: float, label: str, level: int) -> None:
        """Name, power and share at the end of a stream."""
        down = step.leaf.down
        wide = max(self.width(step.leaf.power), _LEAST)
        away = 0.06 + (0.3 * wide + _HEAD if step.leaf.power > 0.0 else _notch(wide))
        y = self._end(down, level) + (-away if down else away)
        sheet.text(middle, y, label, ha="center", va="top" if down else "bottom", fontsize=9)

    def _trunk(self, sheet: _PowerSheet, bands: Sequence[tuple[float, float, float, float, float]]) -> None:
        """Stretches of the trunk that go one way, each as one outline."""
        run: list[tuple[float, float, float, float, float]] = []
        for band in [*bands, None]:
            if band is not None and not band[1] > band[0] and self.width(band[4]):
                continue  # of no length
            flows = band is not None and bool(self.width(band[4]))
            if band is not None and flows and (not run or run[-1][4] * band[4] > 0.0):
                run.append(band)
                continue
            if run:
                sheet.outline(run, BLUE if run[0][4] > 0.0 else PURPLE)
            run = [band] if band is not None and flows else []

    def _ends(self, sheet: _PowerSheet, x: float, power: float, edges: tuple[float, float]) -> None:
        """The two ends of the trunk with their names."""
        first, (low, high) = self.begins
        label = self._label(self.source, self.source.power)
        backwards = first < 0.0
        if self.width(first):
            sheet.end(0.0, low, high, -1.0, backwards, PURPLE if backwards else BLUE)
        away = 0.12 + (_head(high - low) if backwards else _notch(high - low))
        sheet.text(-away, 0.5 * (low + high), label, ha="right", va="center", fontsize=9.5)
        if self.sink is not None:
            low, high = edges
            label = self._label(self.sink, self.sink.power)
            colour = VERMILLION if self.sink.stream.lost else GREEN
            if self.width(power):
                sheet.end(x, low, high, 1.0, power > 0.0, colour if power > 0.0 else PURPLE)
            sheet.text(x + _head(high - low) + 0.12, 0.5 * (low + high), label, ha="left", va="center", fontsize=9.5)


class _TrunkSide:
    """Space taken on one side of the trunk: ends of columns, and the names behind them on each level (inches)."""

    def __init__(self, levels: int) -> None:
        self.column = self.long = -np.inf
        self.names = [-np.inf] * levels

    def taken(self, least: float, half: float, wide: float) -> tuple[int, float]:
        """The level and the middle of the next column of a width, at `least` or behind it; its name is twice `half` wide.

        Columns to the second level pass between the names on the first.
        """
        levels = []
        for level, end in enumerate(self.names):
            middle = max(least, end + half + _APART, self.column + 0.5 * wide + _APART)
            other = self.names[0] + 0.5 * wide + _APART if level else self.long + half + _APART
            levels.append((max(middle, other), level))
        middle, level = min(levels)
        self.column, self.names[level] = middle + 0.5 * wide, middle + half
        if level:
            self.long = self.column
        return level, middle


def _ordered(leaves: Sequence[_Leaf], power: float) -> list[_Leaf]:
    """The streams at a station from left to right: those that join come first where the trunk goes to the right."""
    joining = [leaf for leaf in leaves if leaf.power < 0.0]
    leaving = sorted((leaf for leaf in leaves if leaf.power > 0.0), key=lambda leaf: leaf.down)
    return [*joining, *leaving] if power >= 0.0 else [*leaving, *joining]


def _head(wide: float) -> float:
    """Length (inches) of the head of an arrow of a width."""
    return min(0.3 * wide, 0.35) + _HEAD


def _notch(wide: float) -> float:
    """Depth (inches) of the notch in the tail of an arrow of a width."""
    return min(0.3 * wide + 0.02, 0.3)


def _power(power: float) -> str:
    scale = [scale for scale in SI.scales["power"] if abs(power) >= scale.least][-1]
    return f"{five_digits(power / scale.size, most=3)} {scale.name}"


class _PowerSheet:
    """Outlines and texts of a drawing, in inches."""

    def __init__(self) -> None:
        self.patches: list[tuple[Outline, str, float]] = []
        self.texts: list[tuple[float, float, str, dict[str, Any]]] = []

    def text(self, x: float, y: float, words: str, **style: Any) -> None:
        """Words at a place."""
        self.texts.append((x, y, words, style))

    def bend(self, corner: float, edge: float, wide: float, end: float, side: float, way: float, colour: str) -> None:
        """A quarter turn out of the trunk and the straight part behind it.

        corner: the column's side towards the trunk that it turns out of; edge: of the trunk, on the side that it turns to;
        side: -1 downwards, 1 upwards; way: 1 out of the trunk on the left, -1 out of that on the right.
        """
        across = corner - way * _RADIUS  # of the middle of the turn
        up = edge + side * _RADIUS
        inner = _arc(across, up, _RADIUS, side, way)
        outer = _arc(across, up, _RADIUS + wide, side, way)
        points = [*inner, (corner, end), (corner + way * wide, end), *outer[::-1]]
        codes = [Outline.MOVETO, *[Outline.CURVE4] * 3, Outline.LINETO, Outline.LINETO]
        codes += [Outline.LINETO, *[Outline.CURVE4] * 3, Outline.CLOSEPOLY]
        self.patches.append((Outline([*points, points[0]], codes), colour, 3.0))

    def tip(self, x: float, end: float, wide: float, side: float, leaves: bool, colour: str) -> None:
        """The head of a stream that leaves, or the tail of one that joins."""
        half = 0.5 * wide
        if leaves:
            out = end + side * (0.3 * wide + _HEAD)
            self.polygon([(x - half - _HEAD, end), (x, out), (x + half + _HEAD, end)], colour)
            return
        deep = _notch(wide)
        points = [(x - half, end), (x - half, end + side * deep), (x, end), (x + half, end + side * deep), (x + half, end)]
        self.polygon(points, colour)

    def end(self, x: float, low: float, high: float, way: float, leaves: bool, colour: str) -> None:
        """The same at an end of the trunk, which points to the left (way -1) or to the right (1)."""
        middle, long = 0.5 * (low + high), _head(high - low)
        if leaves:
            self.polygon([(x, low - _HEAD), (x + way * long, middle), (x, high + _HEAD)], colour)
            return
        deep = way * _notch(high - low)
        self.polygon([(x, low), (x + deep, low), (x, middle), (x + deep, high), (x, high)], colour)

    def polygon(self, points: Sequence[tuple[float, float]], colour: str, order: float = 3.0) -> None:
        """A patch with straight sides."""
        codes = [Outline.MOVETO, *[Outline.LINETO] * (len(points) - 1), Outline.CLOSEPOLY]
        self.patches.append((Outline([*points, points[0]], codes), colour, order))

    def outline(self, run: Sequence[tuple[float, float, float, float, float]], colour: str) -> None:
        """Bands (x, x, lower, upper, power) side by side as one patch."""
        upper = [(x, high) for a, b, _low, high, _power in run for x in (a, b)]
        lower = [(x, low) for a, b, low, _high, _power in run for x in (a, b)]
        self.polygon([*upper, *lower[::-1]], colour, 2.0)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, lower, right and upper end of all of it."""
        boxes = [_box(*text) for text in self.texts]
        for outline, _colour, _level in self.patches:
            low, high = outline.vertices.min(axis=0), outline.vertices.max(axis=0)  # type: ignore[union-attr]
            boxes.append((low[0], low[1], high[0], high[1]))
        columns = list(zip(*boxes, strict=True))
        return min(columns[0]), min(columns[1]), max(columns[2]), max(columns[3])

    @property
    def left(self) -> float:
        """The left end of the band."""
        return self.extent[0]

    @property
    def right(self) -> float:
        """The right end of the band."""
        return self.extent[2]

    def figure(self, title: str) -> Picture:
        """All of it as a figure just large enough."""
        left, low, right, high = self.extent
        lines = title.split("\n") if title else []
        wide = max(right - left, 0.105 * max(map(len, lines), default=0))
        left -= 0.5 * (wide - (right - left)) + _MARGIN
        right = left + wide + 2 * _MARGIN
        low, high = low - _MARGIN, high + _MARGIN + 0.24 * len(lines)
        made = Picture(figsize=(right - left, high - low))
        FigureCanvasAgg(made)
        made.text(0.5, 1.0 - 0.12 / (high - low), title, ha="center", va="top", fontsize=13, parse_math=False)
        panel: Axes = made.add_axes((0.0, 0.0, 1.0, 1.0))
        panel.set(xlim=(left, right), ylim=(low, high))
        panel.set_axis_off()
        for outline, colour, level in self.patches:
            face: Any = (*rgb(colour), 0.85 if colour == VERMILLION else 0.6)
            panel.add_patch(PathPatch(outline, facecolor=face, edgecolor=colour, lw=0.4, zorder=level))
        for x, y, words, style in self.texts:
            text = panel.text(x, y, words, parse_math=False, zorder=9, color=BLACK, linespacing=1.15, **style)
            if current_form() == "print":  # clear of hatches
                text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1.0})
        return made


def _arc(x: float, y: float, radius: float, side: float, way: float) -> list[tuple[float, float]]:
    """A quarter of a circle about (x, y) as one cubic: from where it touches the trunk to where it is upright."""
    k = 0.5522847498307936 * radius  # Bézier's circle: 4/3 (sqrt 2 - 1)
    start, end = (x, y - side * radius), (x + way * radius, y)
    return [start, (start[0] + way * k, start[1]), (end[0], end[1] - side * k), end]


def _box(x: float, y: float, words: str, style: dict[str, Any]) -> tuple[float, float, float, float]:
    """Approximate extent of a text (inches)."""
    lines = words.split("\n")
    wide, high = _LETTER * max(map(len, lines)) * style["fontsize"] / 9.0, _LINE * len(lines)
    left = x - wide * {"left": 0.0, "center": 0.5, "right": 1.0}[style["ha"]]
    low = y - high * {"bottom": 0.0, "center": 0.5, "top": 1.0}[style["va"]]
    return left, low, left + wide, low + high
