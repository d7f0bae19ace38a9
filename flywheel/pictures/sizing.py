"""Pictures of a sizing as the books draw them: turning moment, its work, reduced inertia, Wittenbauer's loop, speed.

Diagrams are data (`flywheel.pictures.diagrams`); here their rows become panels of matplotlib. Names inside a panel are
placed when the figure has its layout: a panel's function returns the function that does it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from flywheel import pictures
from flywheel.language import text as _
from flywheel.pictures import figures, forms, written
from flywheel.pictures.diagrams import (
    DIAGRAMS,
    MOST_AREAS,
    MOST_WITH_WORKS,
    DiagramKind,
    made,
)
from flywheel.pictures.figures import BLACK, BLUE, COLOURS, GREY, PURPLE, STYLE, VERMILLION, name_axes, say
from flywheel.pictures.forms import Diagram, DiagramData, DiagramRow, ExtremeMark, part_of, roomiest
from flywheel.sizing.results import Sizing
from flywheel.tables.rows import RPM, WIDTH, printable, under_title
from flywheel.tables.sizing import inertia_error, limit_names

if TYPE_CHECKING:
    from flywheel.motions.single_stroke import SingleStroke

__all__ = [
    "PANELS", "Later", "Window", "angle_axis", "description", "draw", "draw_row", "headline", "legend", "panel",
    "plot", "stroke_svg",
]  # fmt: skip

Array = NDArray[np.float64]
Later = Callable[[], None] | None
Window = tuple[tuple[float, float], tuple[float, float]]

PANELS = ("moment", "work", "inertia", "wittenbauer", "speed")
"""The panels of a sizing, in the order in which a solution goes."""

_HEIGHTS = {"moment": 4.4, "work": 3.5, "inertia": 3.7, "wittenbauer": 5.8, "speed": 3.7}  # inches, where none is drawn
_WIDTH = 7.2  # inches of a panel alone
_HATCHES = ("//", "\\\\", "--", "xx", "||", "++", "////", "----")
_MARKERS = {"greatest": "^", "least": "v"}
_LINE_LENGTH = 60  # letters of a sentence that stands for a panel
_STEP = 30.0  # deg between two marks of the loop


def plot(result: Sizing | SingleStroke, path: str | Path) -> None:
    """Draws a sizing into a file: PNG (1600 x 1600 pixels), SVG or PDF, by its ending; always the same for the same input.

    Raises ValueError for any other ending, OSError where the file cannot be written.
    """
    figures.save(draw(result), path)


def draw(result: Sizing | SingleStroke) -> Figure:
    """The figure with its panels, not yet written anywhere."""
    with rc_context(STYLE):
        return _draw_sizing(result) if isinstance(result, Sizing) else _draw_stroke(result)


def _draw_sizing(sizing: Sizing) -> Figure:
    """The panels of a sizing in two columns."""
    sheet = figures.figure(12.8, 12.8, headline(sizing), apart=0.1)
    halves = GridSpec(1, 2, figure=sheet)
    part = part_of(sizing.scene, sizing.machine, sizing)
    rows: dict[str, tuple[Diagram | str, DiagramRow | None]] = {}
    places: dict[str, Any] = {}
    for column in (0, 1):
        kinds = {key: kind for key, kind in DIAGRAMS.items() if kind.column == column and kind.suits(sizing.scene)}
        mine = {row: pair for key, kind in kinds.items() for row, pair in _rows(part, key, kind).items()}
        heights = [_HEIGHTS.get(key, 3.7) if row is None else row.height for key, (_made, row) in mine.items()]
        grid = halves[column].subgridspec(len(mine), 1, height_ratios=heights)
        places |= {key: grid[k] for k, key in enumerate(mine)}
        rows |= mine
    order = [*PANELS, *(key for key in rows if key not in PANELS)]
    _fill(part, sheet, {key: sheet.add_subplot(places[key]) for key in order}, rows)
    return sheet


def _draw_stroke(result: SingleStroke) -> Figure:
    """The figure of a period of a machine that works stroke by stroke, its panels below one another."""
    part = forms.part_of_stroke(result)
    made = [forms.stroke_diagram(part), *([forms.servo_diagram(part)] if forms.has_servo(part.scene) else [])]
    rows = [(each, row) for each in made if isinstance(each, Diagram) for row in each.rows]
    heights = [row.height for _diagram, row in rows]
    sheet = figures.figure(10.0, sum(heights), " ".join(printable(result.scene.title or "").split()), apart=0.1)
    panels = sheet.subplots(len(heights), 1, height_ratios=heights)
    for axes, (diagram, row) in zip(panels, rows, strict=True):
        if row.kind == "area":
            _draw_area(axes, diagram, row)
            continue
        later = draw_row(axes, part, diagram, row)
        if later is not None:
            sheet.later.append(later)
    return sheet


def stroke_svg(result: SingleStroke) -> str:
    """The picture of a period of a machine that works stroke by stroke, as an SVG element."""
    with rc_context(STYLE):
        rows = forms.stroke_diagram(forms.part_of_stroke(result))
        assert isinstance(rows, Diagram)
        return figures.svg(_draw_stroke(result), "single_stroke", rows.title, rows.about)


def panel(sizing: Sizing, kind: str, *, form: str = "screen", name: str = "") -> str:
    """One panel as an SVG element with a title and a description, in the language in use.

    Args:
        sizing: result of `flywheel.size`.
        kind: one of `PANELS`.
        form: "screen", in colours, or "print", in greys, dashes and hatches.
        name: beginning of its ids, unique in the document; the kind if empty.

    """
    with rc_context(STYLE), pictures.form(form):
        part, rows = _one(sizing, kind)
        row = rows[kind][1]
        sheet = figures.figure(_WIDTH, _HEIGHTS.get(kind, 3.7) if row is None else row.height, "")
        axes = sheet.subplots()
        _fill(part, sheet, {kind: axes}, rows)
        return figures.svg(sheet, name or kind, axes.get_title(), _about(sizing, kind, rows[kind]))


def description(sizing: Sizing, kind: str) -> str:
    """Description of a panel in words, for readers who cannot see it."""
    return _about(sizing, kind, _one(sizing, kind)[1][kind])


def _one(sizing: Sizing, panel: str) -> tuple[DiagramData, dict[str, tuple[Diagram | str, DiagramRow | None]]]:
    """The diagram that has a panel."""
    by_row = {row: key for key, kind in DIAGRAMS.items() for row in kind.rows}
    if panel not in by_row:
        raise ValueError(f"found the panel {panel!r}, expected one of {', '.join(PANELS)}")
    part = part_of(sizing.scene, sizing.machine, sizing)
    return part, _rows(part, by_row[panel], DIAGRAMS[by_row[panel]])


def _rows(part: DiagramData, key: str, kind: DiagramKind) -> dict[str, tuple[Diagram | str, DiagramRow | None]]:
    """The rows of a diagram, or for each the reason why there is none."""
    diagram = made(part, key)
    if isinstance(diagram, str):
        return dict.fromkeys(kind.rows, (diagram, None))
    return {row.key: (diagram, row) for row in diagram.rows}


def _about(sizing: Sizing, kind: str, pair: tuple[Diagram | str, DiagramRow | None]) -> str:
    """The result in a line for a row with the flywheel, else the contents of the row, or the reason why it is missing."""
    if kind in ("wittenbauer", "speed"):
        return headline(sizing).rpartition("\n")[2] + "."
    diagram, row = pair
    return row.about if row is not None else f"{diagram}"


def headline(sizing: Sizing) -> str:
    """The result in a line, below the scene's title (shortened if it is too long for a picture's heading)."""
    scene, wheel = sizing.scene, sizing.flywheel
    speed, irregularity = written(sizing.speed * RPM, 6), written(scene.irregularity or 0.0, 10)
    on = _("the crank") if wheel.on == "crank" else _("shaft {name}", name=wheel.on)
    if scene.inertia is not None:
        eps = written(sizing.simulation.irregularity) if sizing.simulation is not None else "?"
        what = _(
            "given flywheel {inertia} kg m² on {shaft}, crank at {speed} rpm: irregularity {eps}",
            inertia=written(scene.inertia, 6),
            shaft=on,
            speed=speed,
            eps=eps,
        )
    elif scene.limits and wheel.needed is False:
        what = _("no flywheel needed for its limits, crank at {speed} rpm", speed=speed)
    elif scene.limits and sizing.binding is not None:
        what = _(
            "flywheel {inertia} kg m² on {shaft}, decided by {limit}, crank at {speed} rpm",
            inertia=written(wheel.exact or 0.0, 6, inertia_error(sizing)),
            shaft=on,
            limit=limit_names()[sizing.binding],
            speed=speed,
        )
    elif wheel.needed is False:
        what = _("no flywheel needed for irregularity {eps}, crank at {speed} rpm", eps=irregularity, speed=speed)
    else:
        inertia = written(wheel.exact or 0.0, 6, inertia_error(sizing))
        what = _(
            "flywheel {inertia} kg m² on {shaft} for irregularity {eps}, crank at {speed} rpm",
            inertia=inertia,
            shaft=on,
            eps=irregularity,
            speed=speed,
        )
    return under_title(scene.title, what, WIDTH)


# -- panels ------------------------------------------------------------------------------------------------------------


def _fill(
    part: DiagramData,
    sheet: figures.Picture,
    axes: Mapping[str, Axes],
    rows: Mapping[str, tuple[Diagram | str, DiagramRow | None]],
) -> None:
    """Draws panels; the names inside them get their places with the figure's layout."""
    titles = {row: kind.title for kind in DIAGRAMS.values() for row in kind.rows}
    for key, panel in axes.items():
        diagram, row = rows[key]
        if isinstance(diagram, str) or row is None:
            title = _("Accumulated work W") if key == "work" else titles[key]()
            lines = str(diagram).split("\n")
            say(panel, title, "\n".join(fill(line, _LINE_LENGTH) if len(lines) == 1 else line for line in lines))
            continue
        if row.kind == "area":
            _draw_area(panel, diagram, row)
            continue
        later = _draw_loop(panel, part, diagram, row) if row.kind == "loop" else draw_row(panel, part, diagram, row)
        if later is not None:
            sheet.later.append(later)


def draw_row(panel: Axes, part: DiagramData, diagram: Diagram, row: DiagramRow) -> Later:
    """Draws a row of any diagram: its fills, curves, bars or points, levels, marks and notes."""
    turns = part.axis.unit == "rad"
    along = _("crank angle φ, deg") if turns else _("time t, s")
    across = {"A": _("area"), "S": _("crossing")}.get(row.ticks, along)
    less = f" − {written(row.factor * row.origin, 6)} {row.unit}" if row.origin else ""
    name_axes(panel, row.title, across, f"{row.label}{less}, {row.unit}")
    x = np.degrees(part.axis.values) if turns else part.axis.values
    curves = {curve.of: row.factor * (diagram.values(curve.of) - row.origin) for curve in row.curves}
    for level in row.levels:
        low, high = (row.factor * (value - row.origin) for value in (level.low, level.high))
        if low == high:
            panel.axhline(low, color=GREY, lw=0.9, ls="-.", label=level.name)
        else:
            panel.axhspan(low, high, color="#E8E8E8", zorder=0.5, label=level.name)
    for band in row.bands:
        panel.axvspan(band.low, band.high, color=COLOURS[band.colour], alpha=0.25, lw=0, zorder=0.6, label=band.name)
    if row.ticks:
        _draw_numbered(panel, diagram, row, curves)
    else:
        _draw_curves(panel, diagram, row, x, curves)
        if turns:
            angle_axis(panel, float(np.degrees(part.scene.cycle)))
        else:
            panel.set_xlim(x[0], x[-1])
    later = _draw_marks(panel, row, x, curves, turns=turns)
    for note in row.notes:
        panel.plot([], [], " ", label=note)
    if row.span is not None:
        _dimension(panel, *row.span)
    legend(panel)
    if row.areas and not row.ticks:
        return lambda: _name_areas(panel, part, diagram, row, [np.stack((x, curves[c.of])) for c in row.curves if c.drawn])
    return later


def _draw_curves(panel: Axes, diagram: Diagram, row: DiagramRow, x: Array, curves: Mapping[str, Array]) -> None:
    """Curves over the driver, and the areas below them; in a stack the share of each body on top of the others."""
    for area in row.fills:
        values = diagram.values(area.of)
        at, filled = figures.thinned(x, np.where(area.side * values > 0.0, values, 0.0))
        style: dict[str, Any] = {"facecolor": COLOURS[area.colour], "alpha": 0.4, "edgecolor": "none", "lw": 0}
        if area.hatch == "---":
            style = {"facecolor": "none", "edgecolor": COLOURS[area.colour], "lw": 0.6, "zorder": 2.1}
        panel.fill_between(at, filled, label=area.name, hatch=area.hatch, **style)
    floor = np.zeros_like(x)
    for k, curve in enumerate(row.curves):
        colour = COLOURS[curve.colour]
        if row.kind == "stack" and not curve.drawn:
            at, below, above = figures.thinned(x, floor, floor + curves[curve.of])
            style = {
                "facecolor": colour,
                "alpha": 0.45,
                "hatch": _HATCHES[k % len(_HATCHES)],
                "edgecolor": "white",
                "lw": 0.4,
            }
            panel.fill_between(at, below, above, label=curve.name, **style)
            floor = floor + curves[curve.of]
        elif curve.drawn:
            panel.plot(x, curves[curve.of], color=colour, ls=curve.dash, lw=curve.width, label=curve.name)
        else:
            panel.plot([], [], " ", label=curve.name)
    if row.dots:
        places = np.array(row.dots)
        panel.plot(np.degrees(places[:, 0]), places[:, 1], "o", color=BLACK, ms=3.5, label=row.dots_name)
    if row.kind == "stack":
        panel.set_ylim(0.0, 1.08 * float(curves[row.curves[-1].of].max()))
    elif row.zero:
        panel.axhline(0.0, color=BLACK, lw=0.8)
    if row.areas:
        low, high = panel.get_ylim()
        panel.set_ylim(low - 0.14 * (high - low), high + 0.14 * (high - low))


def _draw_numbered(panel: Axes, diagram: Diagram, row: DiagramRow, curves: Mapping[str, Array]) -> None:
    """Bars of areas, or points at crossings, with their numbers along the axis."""
    (curve,) = row.curves
    values = curves[curve.of]
    places = np.arange(values.size) + (row.ticks == "A")
    if row.kind == "bars":
        for area in row.fills:
            mine = area.side * values > 0
            if mine.any():
                face = (*figures.rgb(COLOURS[area.colour]), 0.4)
                style: dict[str, Any] = {"facecolor": face, "edgecolor": BLACK, "lw": 0.6, "hatch": area.hatch}
                panel.bar(places[mine], values[mine], label=area.name, **style)
        panel.axhline(0.0, color=BLACK, lw=0.8)
        panel.margins(y=0.15)
        for place, value, words in zip(places, values, row.areas, strict=True) if values.size <= MOST_WITH_WORKS else ():
            style = {"ha": "center", "va": "top" if value < 0 else "bottom", "fontsize": 8.5}
            panel.annotate(words, (place, value), (0, -2 if value < 0 else 2), textcoords="offset points", **style)
    else:
        lines: dict[str, Any] = {"lw": curve.width, "ms": 4} if curve.dash else {"ls": "", "ms": 6}
        label: dict[str, Any] = {"label": curve.name} if curve.name else {}
        panel.plot(places, values, marker="o", color=COLOURS[curve.colour], **lines, **label)
    if row.span is not None:
        panel.set_xlim(-0.2, places[-1] + 0.2)
    indices = [int(k) for k in places[:: -(-places.size // 24)]]
    panel.set_xticks(indices, [f"{row.ticks}{k}" for k in indices])


def _draw_marks(panel: Axes, row: DiagramRow, x: Array, curves: Mapping[str, Array], *, turns: bool) -> Later:
    """Triangles at extremes, their words beside them, or in the legend where places are numbers."""

    def spot(mark: ExtremeMark) -> tuple[float, float]:
        at = float(np.degrees(mark.at)) if turns and not row.ticks else mark.at
        return at, row.factor * (mark.value - row.origin)

    end = next(iter(curves.values())).size - 1 if row.ticks else float(x[-1])
    for mark in row.marks:
        colour, (at, value) = COLOURS[mark.colour], spot(mark)
        label: dict[str, Any] = {"label": mark.words} if row.ticks else {}
        style: dict[str, Any] = {"ms": 9 if row.ticks else 8, "ls": "", "zorder": 5, "clip_on": False}
        panel.plot(at, value, marker=_MARKERS[mark.kind], color=colour, **style, **label)
        if mark.level:
            panel.plot([at, end], [value, value], color=GREY, lw=0.8, ls=":")
    if row.ticks or not row.marks:
        return None
    texts = [figures.name(panel, mark.words, fontsize=9, zorder=6) for mark in row.marks]
    spots = np.array([spot(mark) for mark in row.marks])
    ways = np.array([(-0.3, 1.0 if mark.kind == "greatest" else -1.0) for mark in row.marks])
    panel.margins(y=0.16)
    lines = [np.stack((x, curves[curve.of])) for curve in row.curves if curve.drawn]
    return lambda: figures.settle(panel, texts, spots, lines, ways)


def _name_areas(panel: Axes, part: DiagramData, diagram: Diagram, row: DiagramRow, drawn: list[Array]) -> None:
    """A1, A2... with their joules inside each area, or beside its curve if it is too narrow; the largest come first."""
    areas, samples = diagram.figures["areas"], part.samples
    assert samples is not None
    named = [(k, area) for k, area in enumerate(areas, 1) if area["from"] is not None and area["work"]]
    named = sorted(named, key=lambda pair: -abs(pair[1]["work"]))[:MOST_AREAS]
    texts, spots, ways, lines = [], [], [], [*drawn, np.array([[0.0, samples.phi[-1] * 57.3], [0.0, 0.0]])]
    per_degree, per_moment = figures.scale(panel)
    crowded = len(named) > MOST_WITH_WORKS
    for k, area in named:
        words = f"A{k}" if crowded else f"A{k}\n{row.areas[k - 1]}"
        text = figures.name(panel, words, fontsize=7.0 if crowded else 8.5, linespacing=1.05, zorder=6)
        wide, tall = figures.size(panel, text)
        side = 1.0 if area["work"] > 0 else -1.0
        centre, room = roomiest(samples, area["from"], area["to"], side, np.radians((wide + 4.0) / per_degree))
        spot = np.array([np.degrees(centre), 0.5 * side * room])
        if room * per_moment > tall + 4.0:
            text.set_position(tuple(spot))
            half = 0.5 * np.array([wide / per_degree, tall / per_moment])
            corners = spot[:, None] + half[:, None] * np.array([[-1, 1, 1, -1, -1], [-1, -1, 1, 1, -1]])
            lines += [corners, spot[:, None] + half[:, None] * np.array([[-1, 1], [0, 0]])]
            continue
        texts.append(text)
        height = float(np.interp(centre, samples.phi, samples.moment))
        spots.append((np.degrees(centre), 0.7 * height))
        ways.append((0.0, side))
    figures.settle(panel, texts, np.array(spots), lines, np.array(ways), keep=0 if crowded else None, leaders=True)


def _dimension(panel: Axes, low: float, high: float, words: str) -> None:
    """A dimension to the right of a panel, between two of its heights."""
    place = panel.get_yaxis_transform()
    style = {"arrowstyle": "<|-|>", "color": BLACK, "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 9.0}
    for y in (low, high):
        panel.plot([1.0, 1.045], [y, y], color=BLACK, lw=0.7, transform=place, clip_on=False)
    panel.annotate("", (1.03, low), (1.03, high), xycoords=place, textcoords=place, arrowprops=style, annotation_clip=False)
    panel.text(1.06, 0.5, words, transform=panel.transAxes, rotation=90, ha="left", va="center", fontsize=9.5)


def angle_axis(panel: Axes, degrees: float) -> None:
    """An axis of angles over a cycle: ticks at whole parts of a turn."""
    panel.set_xlim(0.0, degrees)
    turns = degrees / 360.0
    if abs(turns - round(turns)) < 1e-9 and round(turns) <= 8:
        panel.xaxis.set_major_locator(MultipleLocator(30 * round(turns) if turns <= 2.5 else 45 * round(turns)))


def legend(panel: Axes, wide: float = 430.0) -> None:
    """The legend below the axis, clear of all curves, in as many columns as fit (`wide`: points)."""
    handles, labels = panel.get_legend_handles_labels()
    if not labels:
        return

    def width(ncols: int) -> float:
        """Approximate width (points): filled column by column, the first ones with one more if necessary."""
        chunks = np.array_split(np.array([len(label) for label in labels]), ncols)
        return sum(4.9 * float(chunk.max()) + 30.0 for chunk in chunks)

    widest = next(n for n in range(len(labels), 0, -1) if n == 1 or width(n) <= wide)
    rows = -(-len(labels) // widest)
    ncols = -(-len(labels) // rows)  # as few columns as these rows need
    style: dict[str, Any] = {"fontsize": 8.5, "handlelength": 2.2, "columnspacing": 1.2, "frameon": False}
    panel.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=ncols, borderaxespad=4.2, **style)


def _draw_area(panel: Axes, diagram: Diagram, row: DiagramRow) -> None:
    """Curves of a servo drive over its speed, the loop of the motion, and two points of it."""
    data = diagram.figures
    name_axes(panel, row.title, data["words"], f"{row.label}, {row.unit}")
    left, right, low, high = data["window"]
    for curve in row.curves:
        style: dict[str, Any] = {"color": COLOURS[curve.colour], "ls": curve.dash, "lw": curve.width}
        if curve.of == "torque":
            panel.plot(row.across * data["speed"], data["torque"], label=curve.name, zorder=3, **style)
            continue
        panel.plot(row.across * data["speeds"], data[curve.of], label=curve.name, **style)
        if low < 0.0:
            panel.plot(row.across * data["speeds"], -data[curve.of], **style)
    for mark in row.marks:
        shape = {"least": "o", "greatest": "^"}[mark.kind]
        colour = COLOURS[mark.colour]
        panel.plot(row.across * mark.at, mark.value, shape, color=colour, ms=8, zorder=5, label=mark.words)
    for note in (*row.notes, *diagram.remarks):
        panel.plot([], [], " ", label=note)
    panel.set_xlim(row.across * left, row.across * right)
    panel.set_ylim(low, high)
    if low < 0.0:
        panel.axhline(0.0, color=BLACK, lw=0.8)
    legend(panel, 330.0)


# -- Wittenbauer's loop ----------------------------------------------------------------------------------------------


def _draw_loop(panel: Axes, part: DiagramData, diagram: Diagram, row: DiagramRow) -> Later:
    """The loop W(I*) with its two tangents, in the last of its windows."""
    data = diagram.figures
    name_axes(panel, row.title, _("reduced inertia I*, kg m²"), f"{row.label}, {row.unit}")
    joule = data["joule"]  # J for each kg m² of F
    other = panel.secondary_yaxis("right", functions=(partial(np.multiply, 1.0 / joule), partial(np.multiply, joule)))
    other.set_ylabel("F = 2 W/ω², kg m²")
    (curve,) = row.curves
    panel.plot(data["inertia"], data["energy"], color=BLACK, lw=curve.width, label=curve.name, zorder=3)
    left, right, low, high = data["windows"][-1]
    panel.set_xlim(left, right)
    panel.set_ylim(low, high)
    start = {"P": data["pole"][0], "MN": 0.0}.get(data["seen"], left)
    ends = np.array([start, right])
    for tangent, colour, style, marker in zip(data["tangents"], (BLUE, VERMILLION), ("-", "--"), ("^", "v"), strict=True):
        panel.plot(ends, _line(tangent, ends), color=colour, ls=style, lw=1.5, label=tangent["words"])
        panel.plot(*tangent["contact"], marker, color=colour, ms=8, zorder=5)
    for note in row.notes:
        panel.plot([], [], " ", label=note)
    if left <= 0.0 <= right:
        panel.axvline(0.0, color=BLACK, lw=0.9)
    legend(panel, 330.0)
    return lambda: _mark_loop(panel, part, data)


def _line(tangent: Mapping[str, float], x: Any) -> Any:
    """The energy (J) of a tangent over inertias."""
    return tangent["slope"] * x + tangent["intercept"]


def _mark_loop(panel: Axes, part: DiagramData, data: Mapping[str, Any]) -> None:
    """Angles along the loop, arrows in its direction, and the names of M, N and P."""
    phi, path, seen = np.degrees(part.axis.values), np.stack((data["inertia"], data["energy"])), data["seen"]
    lines, names, spots, ways = [path], [], [], []
    (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
    m, n = (tangent["intercept"] for tangent in data["tangents"])
    x, y = data["pole"]
    if seen != "loop":
        panel.plot([0.0, 0.0], [n, m], color=PURPLE, lw=3.5, solid_capstyle="butt", zorder=4)
        lines.append(np.array([[0.0, 0.0], [n, m]]))
        points = [("M", (0.0, m), (-1, 1)), ("N", (0.0, n), (-1, -1))]
        if data["flywheel"] == 0.0:
            points = [("M, N, P", (0.0, m), (-1, 0))]
        elif seen == "P":
            points.append(("P", (x, y), (-1, 0)))
            panel.plot(x, y, "s", color=PURPLE, ms=6, zorder=6)
        for name, place, way in points:
            names.append(figures.name(panel, name, fontweight="bold", fontsize=10.5, zorder=7))
            spots.append(place)
            ways.append(way)
    for tangent, way in zip(data["tangents"], ((0, 1), (0, -1)), strict=True):
        ends = np.array([x if seen == "P" else left, right])
        lines.append(np.stack((ends, _line(tangent, ends))))
        inside = np.linspace(ends[0], ends[1], 400)
        inside = inside[(_line(tangent, inside) > low) & (_line(tangent, inside) < high)]
        at = 0.5 * (max(x, 0.0) + float(path[0].min()))
        if seen == "loop" or not inside.size:
            at = float(inside[inside.size // 10]) if inside.size else float(ends[0])
        names.append(figures.name(panel, tangent["psi"], fontsize=9, style="italic", zorder=7))
        spots.append((at, _line(tangent, at)))
        ways.append(way)
    places = np.arange(0.0, phi[-1] - 1e-6, _STEP)
    dots = np.stack([np.interp(places, phi, values) for values in path], axis=1)
    panel.plot(*dots.T, "o", color=BLACK, ms=3.2, zorder=4)
    _arrows(panel, path)
    inner = (dots - 0.5 * (path.max(axis=1) + path.min(axis=1))) * np.array(figures.scale(panel))
    for place, dot, way in zip(places, dots, inner, strict=True):
        names.append(figures.name(panel, f"{place:.0f}°", fontsize=7.5, zorder=6))
        spots.append(tuple(dot))
        ways.append(tuple(way))
    figures.settle(panel, names, np.array(spots), lines, np.array(ways, dtype=float), keep=len(names) - places.size)


def _arrows(panel: Axes, path: Array) -> None:
    """Arrowheads along a path (2, m), in its direction."""
    scale = np.array(figures.scale(panel))[:, None]
    steps = np.hypot(*(np.diff(path, axis=1) * scale))
    lengths = np.concatenate(([0.0], np.cumsum(steps)))
    for share in (0.13, 0.38, 0.63, 0.88):
        k = int(np.searchsorted(lengths, share * lengths[-1]))
        j = max(k - 1, 0)
        while j > 0 and lengths[k] - lengths[j] < 3.0:
            j -= 1
        style = {"arrowstyle": "-|>", "color": BLACK, "lw": 0.0, "mutation_scale": 13.0, "shrinkA": 0.0, "shrinkB": 0.0}
        panel.annotate("", tuple(path[:, k]), tuple(path[:, j]), arrowprops=style, zorder=4)
