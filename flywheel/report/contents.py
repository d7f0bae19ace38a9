"""The worked report of a scene, from its title to its check, its approximations and references, as HTML or PDF.

Its cover sheet, which a designer signs, has the contents of the summary, set as a sheet of A4 with the picture of the train
and lines for the signatures of designer and checker. Texts are inserted as text, never as markup.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bondgraph.files import replacement, write_text
from flywheel import language as languages
from flywheel.language import message
from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.motions.single_stroke import SingleStroke, single_stroke
from flywheel.numerics.faults import SceneError
from flywheel.numerics.units import QuantityError, middle_of, parse_quantity
from flywheel.report import document as documents
from flywheel.report import drive, regime, solutions, wheel
from flywheel.report.document import (
    Cell,
    Context,
    Document,
    Figure,
    Formula,
    Items,
    Listing,
    Note,
    Part,
    Section,
    Step,
    Table,
    inline_svg,
    number,
    quantity,
)
from flywheel.report.formulas import Quantity
from flywheel.report.regime import ROUNDING
from flywheel.report.solutions import PrintedSolution
from flywheel.scene.scene import Scene
from flywheel.sizing.results import PowerFlow, Sizing
from flywheel.sizing.sizing import size
from flywheel.tables.power import entries, input_power
from flywheel.tables.rows import SYSTEMS, Row, TradeUnits, few_digits, place
from flywheel.tables.sizing import candidates, limit_names, remarks
from flywheel.tables.strokes import blocks as of_stroke
from flywheel.tables.summary import Block, summary

STYLE = """
.sheet { margin: 0 0 2em; font-size: .86em; line-height: 1.3; }
.sheet h2 { font-size: 1.05em; margin: 1em 0 .2em; }
.sheet .columns { display: grid; grid-template-columns: minmax(0, 1fr) minmax(0, 1fr); column-gap: 1.8em; }
.sheet .columns > section.wide { grid-column: 1 / -1; }
.sheet table { width: 100%; min-width: 0; margin: .2em 0; font-size: 1em; }
.sheet th, .sheet td { padding: .1em .5em .1em 0; font-weight: 400; }
.sheet th[scope="row"] { color: var(--quiet); width: 30%; }
.sheet .stack { display: grid; align-content: start; }
.sheet thead th:first-child { text-align: left; }
.sheet .halves { display: grid; grid-template-columns: minmax(0, 1fr) minmax(0, 1fr); column-gap: 1.8em; }
.sheet .halves { align-items: start; }
.sheet thead th { color: var(--quiet); font-size: .9em; }
.sheet .figure { font-weight: 600; }
.sheet .verdict { font-weight: 600; margin: .25em 0; }
.sheet figure { margin: .4em 0; }
.sheet figure svg { max-height: 7.2cm; margin: auto; }
.sheet .signed { display: grid; grid-template-columns: 3fr 3fr 2fr; gap: 1.2em; margin-top: 1em; }
.sheet .signed div { border-top: 1px solid var(--ink); padding-top: .15em; margin-top: 1.6em; color: var(--quiet); }
@media (max-width: 40rem) { .sheet .columns, .sheet .halves { grid-template-columns: minmax(0, 1fr); } }
@media print {
  .sheet { break-after: page; font-size: 8.2pt; line-height: 1.22; margin: 0; }
  .sheet h2 { margin: .7em 0 .1em; }
  .sheet section, .sheet .signed { break-inside: avoid; }
  .sheet .signed { break-before: avoid; }
  .sheet figure svg { max-height: 6.4cm; }
  .sheet table { font-size: 1em; }
}
"""


def sheet(result: Sizing | SingleStroke, customary: bool = False) -> str:
    """The sheet of a sizing as HTML, in the language in use."""
    units = SYSTEMS["us" if customary else "si"]
    stroke = isinstance(result, SingleStroke)
    made_blocks = of_stroke(result, units.name) if isinstance(result, SingleStroke) else summary(result, units.name)
    blocks = {block.name: block for block in made_blocks}
    heads = {
        "machine": _("Machine"),
        "limits": _("What binds"),
        "wheel": _("The wheel"),
        "drive": _("Torque, power, motor"),
        "run": _("Speed and confirmation"),
        "notes": _("Remarks"),
    }
    main_blocks: tuple[str, ...] = ("machine", "drive", "run", "train", "limits", "flywheel", "wheel")
    if stroke:
        main_blocks = "parts", "flywheel", "machine", "stroke", "clutch"
    order = (*main_blocks, *(name for name in blocks if name not in (*main_blocks, "title", "notes")), "notes")
    made = {name: _block(block, heads.get(name, "")) for name, block in blocks.items()}
    upper, lower = ("stroke", "drive") if stroke else ("run", "limits")  # beside clutch, or drive, which has more rows
    if upper in made and lower in made:
        made[upper] = f'<div class="stack">\n{made[upper]}\n{made.pop(lower)}\n</div>'
    train = result.power_flow if isinstance(result, Sizing) else None
    if train is not None and input_power(train, entries(train)) > 0.0:
        made["train"] = _train(train, units)
    signed = "".join(f"<div>{escape(name)}</div>" for name in (_("Designed by"), _("Checked by"), _("Date")))
    body = "\n".join(made[name] for name in order if name in made)
    return f'<div class="sheet">\n<div class="columns">\n{body}\n</div>\n<div class="signed">{signed}</div>\n</div>'


def _block(block: Block, head: str) -> str:
    """A block of the summary: its rows, its table, its sentences."""
    wide = ' class="wide"' if block.table or block.name in ("machine", "notes", "shares") else ""
    title = head or block.title or block.name
    parts = [f"<section{wide}>", f"<h2>{escape(title)}</h2>"]
    if block.table:
        parts.append(_table(title, block.header, block.table))
    if block.rows and block.name == "machine":
        half = (len(block.rows) + 1) // 2
        parts += ['<div class="halves">', *map(_rows_of, (block.rows[:half], block.rows[half:])), "</div>"]
    elif block.rows:
        parts.append(_rows_of(block.rows, "figure"))
    kind = "remark" if block.name == "notes" else "verdict"
    parts += [f'<p class="{kind}">{escape(sentence)}</p>' for sentence in block.sentences]
    return "\n".join([*parts, "</section>"])


def _rows_of(rows: Iterable[Row], kind: str = "") -> str:
    """Rows as a table: name, figure with its unit, note."""
    cells = []
    for row in rows:
        figure = " ".join(filter(None, (row.value, row.unit)))
        cell_text = f'<span class="figure">{escape(figure)}</span>' if kind else escape(figure)
        note = ", ".join(filter(None, (cell_text, escape(row.note))))
        cells.append(f'<tr><th scope="row">{escape(row.label)}</th><td>{note}</td></tr>')
    return "<table><tbody>\n" + "\n".join(cells) + "\n</tbody></table>"


def _table(title: str, header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table whose first column names the rows, figures to the right; it scrolls on a narrow screen."""

    def line(cells: Iterable[str], first: str) -> str:
        name, *figures = cells
        line_cells = "".join(f'<{first} class="number">{escape(cell)}</{first}>' for cell in figures)
        scope = "col" if first == "th" else "row"
        named = f'<th scope="{scope}">{escape(name)}</th>' if name else "<td></td>"
        return f"<tr>{named}{line_cells}</tr>"

    body = "\n".join(line(row, "td") for row in rows)
    table = f"<table>\n<thead>{line(header, 'th')}</thead>\n<tbody>\n{body}\n</tbody>\n</table>"
    return f'<div class="scroll" tabindex="0" role="group" aria-label="{escape(title)}">{table}</div>'


def _train(flow: PowerFlow, units: TradeUnits) -> str:
    """The train: its picture, and a row for every shaft."""
    from flywheel.pictures import power_flow as pictures  # which takes long to import

    title = _("Power flow of the drive train, mean over the cycle")
    inputs = "; ".join(f"{entry.label} {units.read(entry.power, 'power', 4)}" for entry in entries(flow))
    drawn = inline_svg(pictures.panel(flow), "sheet", title, inputs)
    of_mesh = _("shaft"), _("meshes with"), _("ratio"), _("efficiency, %"), _("slip, %")
    head = *of_mesh, _("speed, rpm"), _("rms torque"), _("greatest torque"), _("lost")
    table = _table(title, head, _rows(flow, units)) if len(flow.shafts) > 1 else ""
    return f'<section class="wide">\n<h2>{escape(title)}</h2>\n<figure>{drawn}</figure>\n{table}\n</section>'


def _rows(flow: PowerFlow, units: TradeUnits) -> Iterator[tuple[str, ...]]:
    """A row for every shaft: its mesh, ratio, efficiency and slip, speed, torques, losses of its mesh and drag."""
    scene = flow.scene
    for row in reversed(flow.shafts):  # from the motor's side in
        lost = sum(s.mean for s in flow.streams if s.lost and s.name in (f"shafts.{row.shaft}", f"shafts.{row.shaft}.drag"))
        speed = few_digits(row.speed / units.scales["speed"][0].size, 5)
        power = str(units.read(lost, "power", 3)) if lost else ""
        if row.on is None or row.torque_rms is None or row.torque_greatest is None:
            yield (place(row.shaft), "", "", "", "", speed, "", "", power)
            continue
        mesh = scene.transmissions[row.shaft]
        yield (
            place(row.shaft),
            place(row.on),
            few_digits(mesh.ratio, 5),
            few_digits(100 * mesh.efficiency, 4),
            few_digits(100 * mesh.slip, 3),
            speed,
            str(units.read(row.torque_rms, "torque", 4)),
            str(units.read(abs(row.torque_greatest), "torque", 4)),
            power,
        )


Source = Sizing | SingleStroke | Machine | Scene
"""Subject of a report."""

_MOST_ROWS = 400  # of a scene's table


def html(
    source: Source,
    *,
    language: str | None = None,
    units: str = "si",
    printed: PrintedSolution | None = None,
    cover_sheet: bool = False,
) -> str:
    """The report of a sizing, or of a scene, which is then sized, as one HTML file.

    Args:
        source: a sizing; or a machine or a scene. Without a flywheel, or with a stroke, the report has the steps that apply.
        language: "en" or "es"; the language in use if None.
        units: "si", or "us": results in US customary units beside.
        printed: a printed solution to be set beside ours, as `flywheel.report.solutions.solution` reads it.
        cover_sheet: the cover sheet alone, which a designer signs.

    Raises:
        SceneError: if the machine cannot run as its scene says.
        ValueError: for another language or other units.

    """
    if units not in ("si", "us"):
        raise ValueError(f"found the units {units!r}, expected si or us")
    with nullcontext() if language is None else languages.use(language):
        return documents.html(worked(source, customary=units == "us", printed=printed, cover_sheet=cover_sheet))


def worked(
    source: Source, *, customary: bool = False, printed: PrintedSolution | None = None, cover_sheet: bool = False
) -> Document:
    """The report as a document, in the language in use; a machine without a flywheel has no cover sheet."""
    scene = source if isinstance(source, Scene) else source.scene
    result = source if isinstance(source, Sizing | SingleStroke) else sized(source)
    first = sheet(result, customary) if isinstance(result, Sizing | SingleStroke) else ""
    alone = cover_sheet and bool(first)
    parts = () if alone else tuple(_parts(scene, result, printed))
    title = " ".join((scene.title or _("Machine")).split())
    return Document(title, _subtitle(scene, result, alone), parts, customary, first, STYLE if first else "")


def sized(source: Machine | Scene, rtol: float | None = None, accuracy: str | None = None) -> Source:
    """The sizing of a machine or its stroke, or the machine itself if the data for a flywheel are missing."""
    scene = source if isinstance(source, Scene) else source.scene
    if scene.single_stroke is not None:
        return single_stroke(scene, rtol)
    return source if _missing(scene) else size(source, rtol, accuracy=accuracy)


def _missing(scene: Scene) -> str:
    """Reason why there can be no steady regime with a flywheel; empty if there can."""
    if scene.stroke is not None:
        return _("The machine moves one way, from one end of its stroke to the other: it has no cycle and no flywheel.")
    if not scene.has_flywheel:
        return _("The scene has no [flywheel], neither an irregularity to size it for nor an inertia.")
    if not scene.has_speed:
        return _("The scene gives no speed, and no torque sets one.")
    return ""


def panel(sizing: Sizing, kind: str) -> Figure:
    """A panel of the sizing's picture, in colours, with dashes and hatches that remain distinct in grey."""
    titles = {
        "moment": _("Turning moment and its areas"),
        "work": _("Accumulated work of the net moment"),
        "inertia": _("Reduced inertia by body, without the flywheel"),
        "wittenbauer": _("Wittenbauer's diagram"),
        "speed": _("Speed of the crank over the cycle"),
        "servo": _("Area of the servo drive"),
    }

    def drawn() -> str:
        from flywheel.pictures import sizing as pictures  # which takes long to import

        return pictures.panel(sizing, kind)

    def about() -> str:
        from flywheel.pictures import sizing as pictures

        return pictures.description(sizing, kind)

    return Figure(drawn, titles[kind], about)


def context(sizing: Sizing) -> Context:
    """Common quantities of the steps of a sizing's report."""
    return Context(sizing, partial(panel, sizing))


def _subtitle(scene: Scene, sizing: Source, alone: bool) -> str:
    """Subtitle of the report, or a note that it is the cover sheet alone."""
    if isinstance(sizing, SingleStroke):
        inertia, rate = quantity(sizing.inertia, "kg m²", 5), few_digits(60.0 * sizing.rate, 5)
        wheel = _("flywheel of {inertia} on {place}", inertia=inertia, place=place(sizing.on, article=True))
        return f"{_('{rate} strokes a minute', rate=rate)}, {wheel}"
    if not isinstance(sizing, Sizing):
        return _("Worked report")
    speed = quantity(sizing.speed, "rpm", 5)
    if alone:
        return _("Cover sheet, crank at {speed}", speed=speed)
    on = place(sizing.flywheel.on, article=True)
    if scene.inertia is not None:
        inertia = quantity(scene.inertia, "kg m²", 5)
        return _("Worked report: the given flywheel of {given} on {on}, crank at {speed}", given=inertia, on=on, speed=speed)
    if sizing.limits:
        exact = quantity(sizing.flywheel.exact or 0.0, "kg m²", 5)
        subtitle = _("Worked report: the smallest flywheel that keeps its limits, {exact} on {on}", exact=exact, on=on)
        return subtitle + _(", crank at {speed}", speed=speed)
    eps = number(scene.irregularity or 0.0)
    if sizing.flywheel.needed is False:
        return _("Worked report: no flywheel is needed for irregularity {eps}, crank at {speed}", eps=eps, speed=speed)
    exact = quantity(sizing.flywheel.exact or 0.0, "kg m²", 5)
    return _(
        "Worked report: flywheel of {exact} on {on} for irregularity {eps}, crank at {speed}",
        exact=exact,
        on=on,
        eps=eps,
        speed=speed,
    )


def _figure_of_stroke(result: SingleStroke) -> Figure:
    """The picture of a period."""

    def drawn() -> str:
        from flywheel.pictures import sizing as pictures  # which takes long to import

        return pictures.stroke_svg(result)

    about = _("The clutch slips, the machine works, the brake stops the crank, and the drive brings the wheel back.")
    return Figure(drawn, _("One stroke over time"), about)


def _parts(scene: Scene, source: Source, printed: PrintedSolution | None) -> Iterator[Part]:
    """The sections in their order."""
    if isinstance(source, SingleStroke):
        yield _scene(scene, [str(remark) for remark in scene.remarks])
        yield from _mechanisms(None, replace(scene, single_stroke=None))
        yield from drive.sections(source, _figure_of_stroke(source))
        yield references(None, [scene.source] if scene.source else [])
        return
    sizing = source if isinstance(source, Sizing) else None
    yield _scene(scene, [str(remark) for remark in (scene.remarks if sizing is None else remarks(sizing))])
    sizing_context = None if sizing is None else context(sizing)
    yield from _mechanisms(sizing_context, source)
    sources = [scene.source] if scene.source else []
    if sizing is None or sizing_context is None:
        why = _("{why} There are therefore no steps of a steady regime.", why=_missing(scene))
        yield Section(_("Omissions"), (Note(why, "left out"),))
        yield references(None, sources)
        return
    order = (
        regime.requirements,
        drive.motor,
        regime.balance,
        drive.engine,
        regime.areas,
        regime.approximate,
        regime.inertia_torque,
        regime.exact,
        drive.limits,
        wheel.every_shaft,
        regime.speeds,
        drive.power,
        drive.train,
        drive.duty,
        regime.holding,
        wheel.wheel,
        check,
    )
    for section in order:
        if (made := section(sizing_context)) is not None:
            yield made
    if printed is not None:
        yield solutions.section(sizing, printed)
    yield accuracy(sizing_context, [str(remark) for remark in remarks(sizing)])
    yield references(sizing_context, sources)


def _mechanisms(sizing_context: Context | None, source: Sizing | Machine | Scene) -> Iterator[Section]:
    """Mechanism, bond graph, positions and coefficients, I* and M*: drawn if the steps of the regime do not."""
    try:
        from flywheel.report import mechanisms  # type: ignore[attr-defined, unused-ignore]
    except ImportError:
        return
    if sizing_context is None:
        yield from mechanisms.sections(source)
    else:
        extremes = tuple(regime.inertia_extremes(sizing_context))
        yield from mechanisms.sections(
            sizing_context.sizing, extremes=extremes, moment_drawn=not sizing_context.sizing.areas
        )


# -- the scene --------------------------------------------------------------------------------------------------------


def _scene(scene: Scene, lines: list[str]) -> Section:
    """The scene as a table of its values in SI, as text, and remarks on its numbers."""
    parts: list[Part] = []
    rows = [] if scene.document is None else list(_values(scene.document.tables, ""))
    if rows:
        head = (_("place in the scene"), _("as given"), _("in SI"))
        parts.append(Table(_("The scene: input"), head, tuple(rows[:_MOST_ROWS])))
    if len(rows) > _MOST_ROWS:
        parts.append(Note(_("{n} further values are not shown.", n=len(rows) - _MOST_ROWS), "left out"))
    if scene.file is not None and scene.file.is_file():
        text = scene.file.read_text("utf-8").strip("\n")
        parts.append(Listing(text, _("The scene as text, {name}", name=scene.file.name)))
    parts += [Note(_("Remark: {text}", text=text), "remark") for text in lines]
    return Section(_("Scene"), tuple(parts))


def _values(value: Any, path: str) -> Iterator[tuple[Cell, ...]]:
    """The values of a scene's tables by their paths, in their order."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if not path and key in ("title", "source"):
                continue
            yield from _values(inner, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list | tuple) and any(isinstance(inner, Mapping) for inner in value):
        for k, inner in enumerate(value):
            yield from _values(inner, f"{path}[{k}]")
    elif isinstance(value, list | tuple):
        values = ", ".join(str(inner) for inner in value[:12]) + (", …" if len(value) > 12 else "")
        yield path, values, ""
    else:
        yield path, str(value).lower() if isinstance(value, bool) else str(value), _in_si(value, path.rpartition(".")[2])


def _in_si(value: Any, key: str) -> str:
    """A quantity in SI; empty for other values. The key or the unit names a dimension whose units others have, too."""
    if not isinstance(value, str):
        return ""
    from flywheel.numerics.units import DIMENSIONS, parse_unit, split_quantity

    parts = split_quantity(middle := str(middle_of(value)))
    if parts is None or not parts[1]:
        return ""
    named = "rate" if key == "rate" else "energy" if parts[1].endswith("J") else None
    try:
        unit, si_value = parse_unit(parts[1], named), parse_quantity(middle, named)
    except (QuantityError, SceneError):
        return ""
    for dimension in DIMENSIONS.values() if named is None else (DIMENSIONS[named],):
        if dimension.fits(unit) and dimension.name != "moment of weight":
            si = dimension.si.replace("^2", "²").replace("^3", "³")
            return quantity(si_value, si) if si else number(si_value)
    return ""


# -- the check --------------------------------------------------------------------------------------------------------


def check(context: Context) -> Section | None:
    """Section on the motion by an independent method, compared with the requirement."""
    sizing = context.sizing
    motion = sizing.simulation
    if motion is None:
        return None
    if motion.route == "areas":
        return None
    comparison = {
        "time": _(
            "One cycle was stepped in time from the equation of motion, by a method that shares only I* and M* with the "
            "steps above and restarts at every switch of a law; root finding gives the extremes of its speed."
        ),
        "collocation": _("The periodic motion was computed again by collocation, on separate cells."),
        "quadrature": _("The motion is that of the energy equation, by quadrature, without a second method."),
    }
    parts: list[Part] = [
        Step(
            _("Equation of motion of the machine with its flywheel"),
            "(J + I_star)*derivative(omega, t) + omega**2/2*derivative(I_star, phi) = M_star",
        ),
        Note(comparison.get(motion.route, comparison["quadrature"])),
    ]
    high = Quantity("omega_max_sim", motion.speed_max, "rad/s", 8)
    low = Quantity("omega_min_sim", motion.speed_min, "rad/s", 8)
    rows = (
        (_("greatest speed"), Formula(high.symbol), high),
        (_("least speed"), Formula(low.symbol), low),
    )
    parts.append(Table(_("Speeds found"), (_("quantity"), _("symbol"), _("value")), rows))
    parts.append(
        Step(
            _("Irregularity found"),
            "epsilon_sim = 2*(omega_max_sim - omega_min_sim)/(omega_max_sim + omega_min_sim)",
            (high, low),
            Quantity("epsilon_sim", motion.irregularity),
        )
    )
    error = sizing.error.simulation
    names = limit_names()
    compared = tuple(
        (names[name], Quantity("", limit.reached), Quantity("", limit.simulated))
        for name, limit in sizing.limits.items()
        if limit.simulated is not None
    )
    if compared:
        parts.append(
            Table(_("Limits by both methods"), (_("limit"), _("along the motion above"), _("by this route")), compared)
        )
    elif context.eps is not None and sizing.flywheel.needed and not sizing.limits:
        off, allowed = abs(motion.irregularity / context.eps - 1.0), number(context.eps)
        if off <= ROUNDING:
            verdict = _("{asked} is required; the two methods agree within rounding.", asked=allowed)
        else:
            share = number(off, 2)
            verdict = _("{asked} is required; the two methods differ by {share} of it.", asked=allowed, share=share)
        parts.append(Note(verdict))
    if error is not None:
        parts.append(Note(_("Estimated relative error of this irregularity: {error}.", error=number(error, 2))))
    if motion.closure is not None and abs(motion.closure) <= ROUNDING:
        parts.append(Note(_("The speed at the end of the cycle is that at its start, within rounding.")))
    elif motion.closure is not None:
        left = number(abs(motion.closure), 2)
        parts.append(
            Note(_("The speed at the end of the cycle differs from that at its start by {share} of it.", share=left))
        )
    return Section(_("Check by an independent method"), tuple(parts))


def accuracy(context: Context, remarks: Iterable[str]) -> Section:
    """Section on approximations and their errors: approximate flywheels, estimated errors, omissions."""
    sizing, wheel = context.sizing, context.sizing.flywheel
    parts: list[Part] = []
    if context.eps is not None and wheel.exact is not None and context.scene.areas is None and wheel.exact > 0.0:
        names = {
            "exact": _("exact (Wittenbauer)"),
            "approximate": _("accumulated areas"),
            "inertia_torque_flywheel": _("inertia torque"),
        }
        rows: list[tuple[Cell, ...]] = []
        for candidate in candidates(sizing):
            gives: Cell = _("no steady motion") if candidate.gives is None else Quantity("", candidate.gives[0])
            off: Cell = "" if candidate.off is None else Quantity("", candidate.off, "%", 4)
            rows.append((names[candidate.key], Quantity("", candidate.inertia, "kg m²"), off, gives))
        head = (_("figure"), _("inertia, kg m²"), _("difference from the exact one, %"), _("resulting irregularity"))
        parts.append(Table(_("Error of each figure, and the irregularity with it"), head, tuple(rows)))
        parts += _bounds(context)
    titles = {
        "exact": _("exact flywheel"),
        "approximate": _("flywheel by the areas"),
        "inertia_torque": _("flywheel by the inertia torque"),
        "work": _("works, as a share of the work exchanged"),
        "simulation": _("irregularity of the check"),
    }
    errors = {title: getattr(sizing.error, key) for key, title in titles.items()}
    errors_with_words = tuple((title, Quantity("", error, "", 2)) for title, error in errors.items() if error is not None)
    if errors_with_words:
        parts.append(Table(_("Estimated relative errors"), (_("figure"), _("relative error")), errors_with_words))
    reached = _("This was reached.") if sizing.reached else _("This was NOT reached.")
    requirement = _("The relative error required is {rtol}.", rtol=number(sizing.rtol, 2))
    parts.append(Note(f"{requirement} {reached}", "" if sizing.reached else "remark"))
    parts += [Note(_("Remark: {text}", text=text), "remark") for text in (*sizing.messages, *remarks)]
    if sizing.left_out:
        parts.append(
            Note(
                _(
                    "Left out at this level of accuracy ({level}): {what}.",
                    level=sizing.accuracy,
                    what="; ".join(sizing.left_out),
                ),
                "left out",
            )
        )
    if (proof := sizing.proof) is not None and proof.reason:
        parts.append(Note(_("NOT proven: {reason}.", reason=message(proof.reason)), "remark"))
    elif proof is not None:
        ends = tuple((name, f"{low!r}", f"{high!r}") for name, (low, high) in proof.figures.items())
        parts.append(Table(_("Proven intervals, SI"), (_("figure"), _("from"), _("to")), ends))
        of_ranges = _("Each interval holds the figure for all numbers in the scene's ranges; the model is not proven.")
        as_written = _("Each interval holds the figure for the scene's numbers as written; the model is not proven.")
        parts.append(Note(of_ranges if proof.ranges else as_written))
    return Section(_("What is approximate, and by how much"), tuple(parts))


def _bounds(context: Context) -> Iterator[Part]:
    """The proven bounds of the exact flywheel."""
    wheel = context.sizing.flywheel
    if wheel.proven_bounds is None or wheel.proven_bounds_torque is None:
        return
    rows = tuple(
        (name, Quantity("", max(pair[0], 0.0), "kg m²"), Quantity("", max(pair[1], 0.0), "kg m²"))
        for name, pair in (
            (_("by the areas"), wheel.proven_bounds),
            (_("by the inertia torque"), wheel.proven_bounds_torque),
        )
    )
    head = (_("given"), _("not below, kg m²"), _("not above, kg m²"))
    yield Table(_("Proven bounds of the exact flywheel, whatever I* does between its extremes"), head, rows)


def references(context: Context | None, sources: Iterable[str]) -> Section:
    """Sources of the methods and of the scene."""
    items = [
        *sources,
        _("F. Wittenbauer, Graphische Dynamik, Springer, Berlin 1923: the diagram of energy over inertia and its tangents."),
        _(
            "H. M. Paynter, Analysis and Design of Engineering Systems, MIT Press 1961; D. C. Karnopp, D. L. Margolis, "
            "R. C. Rosenberg, System Dynamics: bond graphs."
        ),
    ]
    if context is not None and context.sizing.built is not None:
        items.append(_("S. Timoshenko, Strength of Materials, part II: rotating discs, and rims on spokes."))
    return Section(_("References"), (Items(tuple(items)),))


FORMATS = (".html", ".htm", ".pdf")
"""The endings of a report's file."""

_NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "microsoft-edge-stable",
    "msedge",
    "brave-browser",
    "brave",
    "headless_shell",
)
_PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "/Applications/Brave Browser.app/Contents/MacOS/Brave Browser",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
    r"C:\Program Files\Microsoft\Edge\Application\msedge.exe",
)
_SECONDS = 120.0  # that a browser may take for a print
_CHOICE = "FLYWHEEL_BROWSER"


class PrintError(RuntimeError):
    """A report that cannot be printed: no browser, or one that fails."""


def browsers() -> Iterator[str]:
    """The browsers that can print without a window: the one in FLYWHEEL_BROWSER, then installed ones."""
    if named := os.environ.get(_CHOICE):
        yield named
    for name in _NAMES:
        if path := shutil.which(name):
            yield path
    yield from (place for place in _PLACES if Path(place).is_file())


def browser() -> str:
    """The first browser that is installed.

    Raises:
        PrintError: if there is none.

    """
    path = next(browsers(), None)
    if path is None:
        raise PrintError(
            "a PDF needs a browser: none of chromium, chrome, edge, brave was found; install one, name it in "
            f"{_CHOICE}, or write .html and print that"
        )
    return path


def pdf(text: str) -> bytes:
    """A report's HTML as PDF, printed by a browser without a window or network access.

    Raises:
        PrintError: if there is no browser, or it prints nothing.

    """
    program = browser()
    with TemporaryDirectory(prefix="flywheel-report-") as folder:
        source, made = Path(folder) / "report.html", Path(folder) / "report.pdf"
        source.write_text(text, encoding="utf-8")
        options = [
            "--headless",
            "--disable-gpu",
            "--disable-background-networking",
            "--disable-extensions",
            "--no-first-run",
            "--no-pdf-header-footer",
            "--proxy-server=127.0.0.1:9",
            f"--user-data-dir={folder}/profile",
            f"--print-to-pdf={made}",
        ]
        if sys.platform == "linux" and hasattr(os, "geteuid") and os.geteuid() == 0:
            options.append("--no-sandbox")  # which the administrator's account does not have
        try:
            done = subprocess.run(
                [program, *options, source.as_uri()], capture_output=True, timeout=_SECONDS, check=False, text=True
            )
        except subprocess.TimeoutExpired:
            raise PrintError(f"{program} did not finish the print within {_SECONDS:.0f} s") from None
        except OSError as error:
            raise PrintError(f"{program} cannot be run ({error.strerror})") from None
        if not made.is_file() or not made.read_bytes().startswith(b"%PDF-"):
            last = next((line for line in reversed(done.stderr.splitlines()) if line.strip()), "no word why")
            raise PrintError(f"{program} printed nothing: {last}")
        return made.read_bytes()


def write(
    source: Source,
    path: str | Path,
    *,
    language: str | None = None,
    units: str = "si",
    printed: PrintedSolution | None = None,
    cover_sheet: bool = False,
    inputs: Iterable[str | Path] = (),
) -> None:
    """Writes a report into a file, HTML or PDF by its ending, completely or not at all.

    Args:
        source: as in `html`, as are language, units and printed.
        path: ends in .html, .htm or .pdf. A file there is replaced only if it is of that kind.
        language: "en" or "es"; the language in use if None.
        units: "si" or "us".
        printed: a printed solution to be set beside.
        cover_sheet: the cover sheet alone.
        inputs: files that were read, which are never replaced.

    Raises:
        ValueError: for another ending.
        OSError: if the file cannot be written.
        PrintError: if a PDF cannot be printed.
        SceneError: if the machine cannot run as its scene says.

    """
    kind = Path(path).suffix.lower()
    if kind not in FORMATS:
        raise ValueError(f"found {str(path)!r}, expected a file name ending in .html, .htm or .pdf")
    written = html(source, language=language, units=units, printed=printed, cover_sheet=cover_sheet)
    if kind != ".pdf":
        write_text(path, written, inputs)
        return
    with replacement(path, "pdf", inputs) as fresh:
        fresh.write_bytes(pdf(written))
