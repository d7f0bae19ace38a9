"""The cover sheet of a report, which a designer signs. Machine, motor, train, flywheel, binding limits, speed, remarks.

It has the contents of the summary, set as a sheet of A4 with the picture of the train and lines for the signatures of
designer and checker. Texts are inserted as text, never as markup.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from html import escape

from flywheel.language import text as _
from flywheel.report.document import inline_svg
from flywheel.sizing.results import PowerFlow, Sizing
from flywheel.tables.power import entries, given
from flywheel.tables.rows import SYSTEMS, TradeUnits, few_digits, place
from flywheel.tables.summary import Block, Row, summary

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


def sheet(sizing: Sizing, customary: bool = False) -> str:
    """The sheet of a sizing as HTML, in the language in use."""
    units = SYSTEMS["us" if customary else "si"]
    blocks = {block.name: block for block in summary(sizing, units.name)}
    heads = {
        "machine": _("Machine"),
        "limits": _("What binds"),
        "wheel": _("The wheel"),
        "drive": _("Torque, power, motor"),
        "run": _("Speed and confirmation"),
        "notes": _("Remarks"),
    }
    known = ("machine", "drive", "run", "train", "limits", "flywheel", "wheel")
    order = (*known, *(name for name in blocks if name not in (*known, "title", "notes")), "notes")
    made = {name: _block(block, heads.get(name, "")) for name, block in blocks.items()}
    if "run" in made and "limits" in made:  # one below the other beside the drive, which has more rows
        made["run"] = f'<div class="stack">\n{made["run"]}\n{made.pop("limits")}\n</div>'
    train = sizing.power_flow
    if train is not None and given(train, entries(train)) > 0.0:
        made["train"] = _train(train, units)
    signed = "".join(f"<div>{escape(name)}</div>" for name in (_("Designed by"), _("Checked by"), _("Date")))
    body = "\n".join(made[name] for name in order if name in made)
    return f'<div class="sheet">\n<div class="columns">\n{body}\n</div>\n<div class="signed">{signed}</div>\n</div>'


def _block(block: Block, head: str) -> str:
    """A block of the summary: its rows, its table, its sentences."""
    wide = ' class="wide"' if block.name in ("machine", "flywheel", "notes") else ""
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
        told = f'<span class="figure">{escape(figure)}</span>' if kind else escape(figure)
        note = ", ".join(filter(None, (told, escape(row.note))))
        cells.append(f'<tr><th scope="row">{escape(row.label)}</th><td>{note}</td></tr>')
    return "<table><tbody>\n" + "\n".join(cells) + "\n</tbody></table>"


def _table(title: str, header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table whose first column names the rows, figures to the right; a telephone scrolls it."""

    def line(cells: Iterable[str], first: str) -> str:
        name, *figures = cells
        told = "".join(f'<{first} class="number">{escape(cell)}</{first}>' for cell in figures)
        scope = "col" if first == "th" else "row"
        named = f'<th scope="{scope}">{escape(name)}</th>' if name else "<td></td>"
        return f"<tr>{named}{told}</tr>"

    body = "\n".join(line(row, "td") for row in rows)
    table = f"<table>\n<thead>{line(header, 'th')}</thead>\n<tbody>\n{body}\n</tbody>\n</table>"
    return f'<div class="scroll" tabindex="0" role="group" aria-label="{escape(title)}">{table}</div>'


def _train(flow: PowerFlow, units: TradeUnits) -> str:
    """The train: its picture, and a row for every shaft."""
    from flywheel.pictures import power_flow as pictures  # which takes long to import

    title = _("Power flow of the drive train, mean over the cycle")
    told = "; ".join(f"{entry.label} {units.read(entry.power, 'power', 4)}" for entry in entries(flow))
    drawn = inline_svg(pictures.panel(flow), "sheet", title, told)
    table = _table(title, _head(units), _rows(flow, units)) if len(flow.shafts) > 1 else ""
    return f'<section class="wide">\n<h2>{escape(title)}</h2>\n<figure>{drawn}</figure>\n{table}\n</section>'


def _head(units: TradeUnits) -> tuple[str, ...]:
    return (
        _("shaft"),
        _("meshes with"),
        _("ratio"),
        _("efficiency, %"),
        _("slip, %"),
        _("speed, rpm"),
        _("rms torque"),
        _("greatest torque"),
        _("lost"),
    )


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
