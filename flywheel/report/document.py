"""The document of a report: sections of steps, tables, figures and notes, their common quantities, and its HTML in one file.

A `Step` states its aim, the formula, the same with numbers and units, and the result; below it are the sources of its
numbers, with links to the step or table that gave them. So every symbol has one origin: the
`result` of a step, a `Quantity` with a symbol in a table, or a `definition`, which a step that only states a formula has.
Text is plain text in the language in use (`flywheel.language.text`); the HTML is written in that language too.

>>> from flywheel.report.formulas import Quantity
>>> n, omega = Quantity("n", 2 * 3.141592653589793, "rpm"), Quantity("omega", 6.283185307179586, "rad/s")
>>> step = Step("Speed of the crank", "omega = 2*pi*n/60", (Quantity("n", 60.0),), omega)
>>> substitution(step)[0].written, round(formulas.value(step.formula, {"n": 60.0}), 5)
('60', 6.28319)
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from html import escape
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from flywheel import language
from flywheel.language import text as _
from flywheel.numerics import cells
from flywheel.numerics.cells import Array
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle
from flywheel.report import formulas
from flywheel.report.formulas import MOST_DIGITS, Quantity
from flywheel.sizing.findings import finding
from flywheel.sizing.results import Sizing


class Formula(NamedTuple):
    """A symbol or a formula in a table's cell."""

    text: str


Cell = str | Quantity | Formula


@dataclass(frozen=True)
class Step:
    """Step of a report: a sentence, its formula, the numbers of the formula's symbols, and the result.

    Without `numbers` only the formula is shown (`definitions`: the symbols it defines, for later steps). With numbers and a
    formula that can be evaluated, the substitution is shown as well. `how` is the method of the result if the formula
    is not evaluated by hand, such as "by quadrature"; `note` is a sentence after the result. `digits` of the result are in
    the result itself.
    """

    what: str
    formula: str = ""
    numbers: tuple[Quantity, ...] = ()
    result: Quantity | None = None
    how: str = ""
    note: str = ""
    definitions: tuple[str, ...] = ()


@dataclass(frozen=True)
class Table:
    """Rows of texts and numbers under a heading; a number's unit stands in it, unless the column's head names one.

    `formula`, if there is one, is shown above and defines the columns. `numbers` are those that it takes from elsewhere.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    formula: str = ""
    numbers: tuple[Quantity, ...] = ()
    emphasis: frozenset[int] = frozenset()
    kind: str = ""


@dataclass(frozen=True)
class Figure:
    """A picture as SVG, its subject in a few words and in sentences: texts, or functions called when it is written."""

    svg: str | Callable[[], str]
    title: str
    description: str | Callable[[], str]


@dataclass(frozen=True)
class Note:
    """A paragraph; `kind`: "" for plain text, "remark" for important notes, "left out" for omissions."""

    text: str
    kind: str = ""


@dataclass(frozen=True)
class Listing:
    """Text that keeps its lines: a scene."""

    text: str
    caption: str


@dataclass(frozen=True)
class Items:
    """A list of sentences, numbered if their order counts."""

    items: tuple[str, ...]
    ordered: bool = False


@dataclass(frozen=True)
class Section:
    """A heading and the parts below it."""

    title: str
    parts: tuple[Part, ...]


Part = Step | Table | Figure | Note | Listing | Items | Section


@dataclass(frozen=True)
class Document:
    """A whole report. `subtitle` is a line under the title; `customary` has results in US units beside the SI ones.

    `sheet` is the cover sheet as HTML, before the contents, with the `style` that it needs.
    """

    title: str
    subtitle: str
    parts: tuple[Part, ...]
    customary: bool = False
    sheet: str = ""
    style: str = ""


# -- numbers ----------------------------------------------------------------------------------------------------------


def substitution(step: Step) -> tuple[Quantity, ...]:
    """A step's numbers, with enough digits for the shown formula to give the shown result; none if it has no such line.

    Six are enough unless the formula takes a small difference of large numbers.
    """
    if not step.numbers or step.result is None or not formulas.computable(step.formula):
        return ()
    if not formulas.symbols(step.formula) <= {number.symbol for number in step.numbers}:
        return ()
    for digits in range(MOST_DIGITS + 1):
        numbers = tuple(n._replace(digits=max(n.digits, digits)) for n in step.numbers)
        if agrees(step, numbers):
            return numbers
    return ()


def agrees(step: Step, numbers: Sequence[Quantity]) -> bool:
    """Tests whether a step's formula, evaluated with numbers as they are shown, gives its result to the digits shown."""
    result = step.result
    assert result is not None
    try:
        value = formulas.value(step.formula, {number.symbol: number.value_written for number in numbers})
    except (ArithmeticError, ValueError):
        return False
    if result._replace(value=value).written == result.written:
        return True
    exact = result.value / formulas.factor(result.unit)  # it may stand in the middle between two shown numbers
    written_value, off = float(result.written), value / formulas.factor(result.unit)
    most = max(numbers, key=lambda number: number.digits).digits
    return most >= MOST_DIGITS and abs(off - exact) <= 1e-9 * max(abs(exact), abs(written_value), 1e-300)


def steps(parts: Iterable[Part]) -> Iterator[Step]:
    """All steps of a document's parts, in their order."""
    for part in parts:
        if isinstance(part, Step):
            yield part
        elif isinstance(part, Section):
            yield from steps(part.parts)


def untraced(document: Document) -> list[str]:
    """Numbers of unknown origin, which no earlier step or table has, as `step: symbol`."""
    origins: set[str] = set()
    missing: list[str] = []

    def walk(parts: Iterable[Part]) -> None:
        for part in parts:
            match part:
                case Section():
                    walk(part.parts)
                case Step():
                    missing.extend(f"{part.what}: {n.symbol}" for n in part.numbers if n.symbol not in origins)
                    origins.update(part.definitions, [part.result.symbol] if part.result else [])
                case Table():
                    missing.extend(f"{part.caption}: {n.symbol}" for n in part.numbers if n.symbol not in origins)
                    origins.update(cell.symbol for row in part.rows for cell in row if isinstance(cell, Quantity))

    walk(document.parts)
    return missing


def unreproduced(document: Document) -> list[str]:
    """Steps whose formula, evaluated with the shown numbers, does not give the shown result."""
    return [
        step.what
        for step in steps(document.parts)
        if step.numbers and step.result and formulas.computable(step.formula) and not substitution(step)
    ]


# -- HTML -------------------------------------------------------------------------------------------------------------

STYLE = """
:root { --ink: #1a1a1a; --quiet: #555; --line: #bbb; --tint: #f3f5f8; --mark: #8a3b00; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1rem 3rem; max-width: 46rem; color: var(--ink); background: #fff;
  font: 11pt/1.45 "Source Serif 4", "Noto Serif", Georgia, "Times New Roman", serif; }
h1 { font-size: 1.7em; line-height: 1.2; margin: 0 0 .3em; }
h2 { font-size: 1.3em; margin: 2em 0 .5em; border-bottom: 1px solid var(--line); padding-bottom: .15em; }
main { counter-reset: section; }
h2[id^="section-"]::before { counter-increment: section; content: counter(section) ". "; }
h3 { font-size: 1.08em; margin: 1.4em 0 .4em; }
h4 { font-size: 1em; font-style: italic; margin: 1.2em 0 .3em; }
p { margin: .5em 0; }
a { color: #0b4a8f; }
.subtitle, .from, .how { color: var(--quiet); }
.from, .how { font-size: .85em; margin: .1em 0 0; }
.step { margin: .9em 0 1.1em; padding-left: 2.6em; position: relative; }
.step > .what { margin: 0; }
.step > .what > .number { position: absolute; left: 0; color: var(--quiet); }
math {
  font-family: "Flywheel Math", "STIX Two Math", "Latin Modern Math", "DejaVu Math TeX Gyre", "Cambria Math", math;
  font-size: 1.08em;
}
.formula { margin: .35em 0; overflow-x: auto; overflow-y: hidden; }
.formula:has(math + math) { padding-left: 2em; text-indent: -2em; }
.formula math { text-indent: 0; }
.formula.substitution { font-size: .95em; }
mfrac mtd { text-align: left; padding: .1em 0; }
.result math { font-weight: 600; }
.customary { color: var(--quiet); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .8em 0; font-size: .92em; min-width: min(100%, 30rem); }
caption { text-align: left; font-style: italic; padding-bottom: .3em; }
th, td { text-align: left; vertical-align: top; padding: .16em .7em .16em 0; border-bottom: 1px solid #e3e3e3; }
thead th { border-bottom: 1px solid #777; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.emphasis td, tr.emphasis th { font-weight: 700; background: var(--tint); }
table.printed { border: 2px solid #444; }
table.printed caption { padding: .3em 0; font-style: normal; font-weight: 700; }
table.printed th, table.printed td { padding-left: .6em; }
figure { margin: 1em 0; }
figure svg { display: block; width: 100%; height: auto; max-height: 24cm; stroke-linejoin: round; stroke-linecap: butt; }
figcaption { font-size: .9em; margin-top: .3em; }
.remark { border-left: 4px solid var(--mark); background: #fdf6ef; padding: .4em .8em; }
.left-out { border-left: 4px solid #666; background: var(--tint); padding: .4em .8em; }
pre { font: .78em/1.35 "DejaVu Sans Mono", Consolas, monospace; white-space: pre-wrap; overflow-wrap: anywhere;
  background: var(--tint); padding: .7em; margin: .4em 0; }
nav ol { columns: 2; padding-left: 2em; margin: .4em 0 1em; }
@media (max-width: 40rem) { nav ol { columns: 1; } }
.row { display: flex; flex-wrap: wrap; align-items: center; column-gap: 2.4em; }
.row .formula { max-width: 100%; }
.row math { text-align: left; }
@page { size: A4; margin: 15mm 16mm 16mm; @bottom-center { content: counter(page) " / " counter(pages); font: 9pt serif; } }
@page large { size: A3; margin: 10mm; }
@page wide { size: A4 landscape; margin: 10mm; }
@media print {
  body { max-width: none; padding: 0; font-size: 9.5pt; line-height: 1.32; }
  a { color: inherit; text-decoration: none; }
  h2 { margin: 1.2em 0 .35em; }
  h3, h4 { margin: .8em 0 .25em; }
  h1, h2, h3, h4, caption { break-after: avoid; }
  figure, .step, tr, .remark, .formula { break-inside: avoid; }
  table.short, table.printed { break-inside: avoid; }
  thead { display: table-header-group; }
  p, li { orphans: 3; widows: 3; }
  p { margin: .3em 0; }
  .step { margin: .45em 0 .6em; }
  .formula { margin: .15em 0; }
  .from, .how { font-size: .8em; }
  table { margin: .4em 0; font-size: .86em; min-width: 0; width: 100%; }
  th, td { padding: .08em .6em .08em 0; }
  .narrow { display: inline-block; vertical-align: top; width: 48%; margin-right: 1.6%; }
  .tall .scroll { columns: 2; column-gap: 2em; }
  .tall table { margin-top: 0; }
  .whole { break-inside: avoid; }
  figure { margin: .5em 0; }
  figure svg { max-height: min(23cm, max(7cm, var(--legible, 0cm))); }
  figure.high svg { max-height: min(23cm, max(11cm, var(--legible, 0cm))); }
  figure.large { page: large; }
  figure.wide { page: wide; }
  figure.wide svg { max-height: 16cm; }
  figure.large svg { max-height: 37cm; }
  figure:has(pre) { break-inside: auto; }
  figcaption { font-size: .85em; }
  pre { font-size: 6.6pt; line-height: 1.25; padding: .4em .6em; }
  nav ol { margin: .2em 0; font-size: .9em; }
  .formula, .scroll { overflow: visible; }
}
"""

_FONT_SIZE = re.compile(r"font(?:-size)?: ?(?:[a-z]+ )*([0-9.]+)px")
_LEGIBLE, _SUBSCRIPT = 6.4, 6.5  # points: texts of a figure on paper; in a drawing, what is smaller stands at a text
_PAPER = 504.0  # points: width of an A4 sheet within its margins
_WHOLE = 14  # rows of a table that is not split between pages

FIRST_LINE = "<!DOCTYPE html><!-- flywheel report -->"
"""By which a report is distinguished from other HTML files, which it never replaces."""
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; font-src data:"
"""Sources that a browser may load for the file: none. It asks no network and runs no script."""


@cache
def _font() -> str:
    """CSS with the font of the formulas: roots and brackets grow only with a font that has a MATH table."""
    font = b64encode((files(__package__) / "math.woff").read_bytes()).decode()
    return f'@font-face {{ font-family: "Flywheel Math"; src: url(data:font/woff;base64,{font}) format("woff"); }}\n'


class _Writer:
    """Writes a document's parts, numbers its steps, tables and figures, and records the origin of each symbol."""

    def __init__(self, customary: bool) -> None:
        self.customary = customary
        self.origins: dict[str, tuple[str, str]] = {}  # symbol -> (address, name of the place)
        self.counts = {"section": 0, "step": 0, "table": 0, "figure": 0, "formula": 0}

    def next(self, kind: str) -> int:
        """The number of the next section, step, table or figure."""
        self.counts[kind] += 1
        return self.counts[kind]

    def parts(self, parts: Iterable[Part], level: int) -> str:
        """Parts one after the other, whose sections have headings of a level."""
        return "\n".join(self.part(part, level) for part in parts)

    def part(self, part: Part, level: int) -> str:
        """One part as HTML."""
        match part:
            case Section():
                return self.section(part, level)
            case Step():
                return self.step(part)
            case Table():
                return self.table(part)
            case Figure():
                return self.figure(part)
            case Note():
                kind = f' class="{part.kind.replace(" ", "-")}"' if part.kind else ""
                return f"<p{kind}>{escape(part.text)}</p>"
            case Listing():
                lines = f"<figcaption>{escape(part.caption)}</figcaption>"
                return f"<figure>\n{lines}\n<pre>{escape(part.text)}</pre>\n</figure>"
            case Items():
                kind = "ol" if part.ordered else "ul"
                return f"<{kind}>\n" + "\n".join(f"<li>{escape(item)}</li>" for item in part.items) + f"\n</{kind}>"

    def section(self, section: Section, level: int) -> str:
        """A heading and the parts below it."""
        n = self.next("section")
        head = f'<h{level} id="section-{n}-title">{escape(section.title)}</h{level}>'
        inner = self.parts(section.parts, min(level + 1, 6))
        return f'<section id="section-{n}" aria-labelledby="section-{n}-title">\n{head}\n{inner}\n</section>'

    def step(self, step: Step) -> str:
        """Formula, substitution and result in a row, and the sources of the numbers."""
        n = self.next("step")
        place = f"step-{n}"
        lines = [f'<p class="what"><span class="number">({n})</span> {escape(step.what)}</p>']
        row = [_line(formulas.mathml(step.formula), "formula")] if step.formula else []
        numbers = substitution(step)
        if numbers:
            formula = formulas.mathml(step.formula, {number.symbol: number for number in numbers})
            row.append(_line(formula, "formula substitution"))
        if step.result is not None:
            beside = self.in_customary_units(step.result)
            row.append(_line(formulas.equation(step.result) + beside, "formula result"))
        if row:
            lines.append('<div class="row">\n' + "\n".join(row) + "\n</div>")
        how = step.how
        if not how and not numbers and step.numbers and step.result is not None and formulas.computable(step.formula):
            how = _("this is a small difference of large numbers: hand calculation does not have enough digits")
        if how:
            lines.append(f'<p class="how">{escape(how)}</p>')
        if step.note:
            lines.append(f"<p>{escape(step.note)}</p>")
        lines.append(self.sources(numbers or step.numbers))
        for symbol in (*step.definitions, *([step.result.symbol] if step.result is not None else ())):
            self.origins[symbol] = (place, f"({n})")
        return f'<div class="step" id="{place}">\n' + "\n".join(filter(None, lines)) + "\n</div>"

    def sources(self, numbers: Sequence[Quantity]) -> str:
        """Sources of a step's numbers, with links."""
        named = dict.fromkeys(number.symbol for number in numbers if number.symbol in self.origins)
        lines = []
        for symbol in named:
            place, name = self.origins[symbol]
            lines.append(f'{formulas.symbol_element(symbol)} <a href="#{place}">{escape(name)}</a>')
        return f'<p class="from">{escape(_("The numbers come from"))} {"; ".join(lines)}</p>' if lines else ""

    def in_customary_units(self, quantity: Quantity) -> str:
        """A result in US units, after the SI one."""
        converted = customary(quantity) if self.customary else None
        if converted is None:
            return ""
        number = formulas.numeral(converted)
        return f' <span class="customary">{formulas.element(f"<mo>(</mo>{number.math}<mo>)</mo>", number.text)}</span>'

    def table(self, table: Table) -> str:
        """A table with its caption, numbers to the right."""
        n = self.next("table")
        place, name = f"table-{n}", _("table {n}", n=n)
        numeric = [any(isinstance(row[k], Quantity) for row in table.rows if k < len(row)) for k in range(len(table.head))]

        of_number, emphasis = ' class="number"', ' class="emphasis"'

        def cell(value: Cell, k: int) -> str:
            match value:
                case Quantity():
                    cell_text = in_cell(value, table.head[k])
                case Formula():
                    cell_text = formulas.mathml(value.text, display=False)
                case _:
                    cell_text = escape(value)
            if k == 0 and isinstance(value, str) and value:  # a place in the scene is broken behind its dots
                return f'<th scope="row">{re.sub("(?<=[a-z])[.]", ".<wbr>", cell_text)}</th>'
            return f"<td{of_number if numeric[k] else ''}>{cell_text}</td>"

        for row in table.rows:
            self.origins |= {c.symbol: (place, name) for c in row if isinstance(c, Quantity) and c.symbol}
        columns = "".join(
            f'<th scope="col"{of_number if number else ""}>{escape(head)}</th>' if head else "<td></td>"
            for head, number in zip(table.head, numeric, strict=True)
        )
        rows = "\n".join(
            f"<tr{emphasis if r in table.emphasis else ''}>{''.join(cell(value, k) for k, value in enumerate(row))}</tr>"
            for r, row in enumerate(table.rows)
        )
        shape = _shape(table)
        names = " ".join(filter(None, [table.kind, "short" if len(table.rows) <= _WHOLE and "tall" not in shape else ""]))
        kind = f' class="{names}"' if names else ""
        above = _line(formulas.mathml(table.formula), "formula") + "\n" if table.formula else ""
        caption = f"<caption>{escape(_('Table {n}', n=n))}. {escape(table.caption)}</caption>"
        body = f"<table{kind}>\n{caption}\n<thead><tr>{columns}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table>"
        reached = f' tabindex="0" role="group" aria-label="{escape(table.caption)}"'
        attribute = f' class="{shape}"' if shape else ""
        scrolled = f'<div class="scroll"{reached}>{body}</div>'
        return f'<div id="{place}"{attribute}>\n{above}{scrolled}\n{self.sources(table.numbers)}\n</div>'

    def figure(self, figure: Figure) -> str:
        """A picture with its caption, high ones marked."""
        n = self.next("figure")
        svg, about = (one if isinstance(one, str) else one() for one in (figure.svg, figure.description))
        drawn = inline_svg(svg, f"figure-{n}", figure.title, about)
        caption = f"{_('Figure {n}', n=n)}. {figure.title}. {about[:1].upper()}{about[1:]}"
        sides = re.search(r'viewBox="[^ "]+ [^ "]+ ([0-9.]+) ([0-9.]+)"', drawn)
        form = ""
        if sides is not None:
            width, height = float(sides[1]), float(sides[2])
            sizes = [float(size) for size in _FONT_SIZE.findall(drawn)]
            scale = _LEGIBLE / min((size for size in sizes if size > _SUBSCRIPT), default=_LEGIBLE)
            kind = "high" if height > 0.7 * width else ""
            if 0.92 * scale * width > _PAPER:
                kind = "large" if height > 0.6 * width else "wide"
            form = (f' class="{kind}"' if kind else "") + f' style="--legible: {scale * height:.0f}pt"'
        return f'<figure id="figure-{n}"{form}>\n{drawn}\n<figcaption>{escape(caption)}</figcaption>\n</figure>'


_TALL, _NARROW, _WORDS = 8, 3, 44


def _shape(table: Table) -> str:
    """Layout of a table on paper: "tall" in two columns ("whole": on one page), "narrow" next to another, or unchanged."""
    if table.formula or table.numbers or table.kind:
        return ""
    columns = len(table.head)
    longest = max((len(cell) for row in table.rows for cell in row if isinstance(cell, str)), default=0)
    if len(table.rows) > _TALL and columns <= _NARROW + 1 and longest <= _WORDS:
        return "tall whole" if len(table.rows) <= 2 * _WHOLE else "tall"
    return "narrow" if columns <= _NARROW and longest <= _WORDS and len(table.rows) <= _WHOLE else ""


_SCROLLED = 30  # characters of a formula read out that a telephone may not hold


def _line(markup: str, kind: str) -> str:
    """A formula in lines of its own; one that may scroll on a narrow screen can be focused by keys."""
    longest = max(map(len, re.findall(r'alttext="([^"]*)"', markup)), default=0)
    reached = ' tabindex="0"' if longest > _SCROLLED else ""
    return f'<div class="{kind}"{reached}>{markup}</div>'


def html(document: Document) -> str:
    """A document as one HTML file in the language in use, which loads no other file."""
    writer = _Writer(document.customary)
    body = writer.parts(document.parts, 2)
    top = [part.title for part in document.parts if isinstance(part, Section)]
    numbers = re.findall(r'^<h2 id="(section-\d+)-title">', body, re.MULTILINE)
    entries = "\n".join(
        f'<li><a href="#{place}">{escape(title)}</a></li>' for place, title in zip(numbers, top, strict=True)
    )
    contents = f'<nav aria-label="{escape(_("Contents"))}">\n<ol>\n{entries}\n</ol>\n</nav>' if entries else ""
    font = _font() if "<math" in body else ""
    subtitle = f'<p class="subtitle">{escape(document.subtitle)}</p>' if document.subtitle else ""
    return (
        f'{FIRST_LINE}\n<html lang="{language.current()}">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(document.title)}</title>\n'
        f"<style>{font}{STYLE}{document.style}</style>\n</head>\n<body>\n"
        f"<header>\n<h1>{escape(document.title)}</h1>\n{subtitle}\n</header>\n"
        f"<main>\n{document.sheet}\n{contents}\n{body}\n</main>\n</body>\n</html>\n"
    )


def in_cell(quantity: Quantity, head: str) -> str:
    """A number of a table as HTML, with its unit where the column's head does not name it."""
    bare = bool(quantity.unit) and head.endswith((f", {quantity.unit}", f"({quantity.unit})"))
    return escape(formulas.bare(quantity) if bare else formulas.numeral(quantity).text)


# -- SVG --------------------------------------------------------------------------------------------------------------

_ID = re.compile(r'\sid="([^"]*)"')
_REFERENCE = re.compile(r'(url\(#|href="#)([^)"]+)')


def inline_svg(svg: str, prefix: str, title: str, description: str) -> str:
    """A drawing as an element of a document: with a title and a description, and ids unique in the document.

    Ids without a reference in the drawing are left out.

    >>> drawn = '<?xml version="1.0"?><svg width="2" height="1"><path id="a"/><use href="#a"/></svg>'
    >>> inline_svg(drawn, "f", "A path", "One line.").replace("<desc", chr(10) + "<desc").splitlines()[1]
    '<desc id="f-about">One line.</desc><path id="f-1"/><use href="#f-1"/></svg>'
    """
    drawn = svg[svg.index("<svg") :].strip()
    drawn = re.sub(r"<metadata>.*?</metadata>|<style[^>]*>.*?</style>|<!--.*?-->", "", drawn, flags=re.DOTALL)
    names = {name: f"{prefix}-{k}" for k, name in enumerate(dict.fromkeys(m[2] for m in _REFERENCE.finditer(drawn)), 1)}
    drawn = _ID.sub(lambda m: f' id="{names[m[1]]}"' if m[1] in names else "", drawn)
    drawn = _REFERENCE.sub(lambda m: m[1] + names[m[2]], drawn).replace("xlink:href=", "href=")
    head, inner = drawn[: drawn.index(">") + 1], drawn[drawn.index(">") + 1 :]
    box = re.search(r'viewBox="([^"]+)"', head)
    if box is None:
        sizes = [re.search(rf'\b{side}="([0-9.]+)', head) for side in ("width", "height")]
        view = " ".join(["0 0", *(size[1] for size in sizes if size is not None)])
    else:
        view = box[1]
    inner = re.sub(r"^\s*<title[^>]*>.*?</title>(\s*<desc[^>]*>.*?</desc>)?|<defs>\s*</defs>", "", inner, flags=re.DOTALL)
    inner = inner.strip()
    named = f'role="img" aria-labelledby="{prefix}-title {prefix}-about" viewBox="{view}"'
    labels = f'<title id="{prefix}-title">{escape(title)}</title><desc id="{prefix}-about">{escape(description)}</desc>'
    return f"<svg {named}>{labels}{inner}"


# -- US units ---------------------------------------------------------------------------------------------------------


_US: Mapping[str, str] = {
    "kg m²": "lb ft²",
    "kg": "lb",
    "N": "lbf",
    "kN": "lbf",
    "N m": "lbf ft",
    "J": "lbf ft",
    "kJ": "lbf ft",
    "W": "hp",
    "kW": "hp",
    "rad/s": "rpm",
    "m": "in",
    "mm": "in",
    "m/s": "ft/s",
    "MPa": "psi",
    "Pa": "psi",
}


def customary(quantity: Quantity) -> Quantity | None:
    """A result in US customary units; None if it has none, or is a ratio."""
    unit = _US.get(quantity.unit)
    return None if unit is None else quantity._replace(unit=unit, digits=min(quantity.digits, 6))


_NO_WORK = 1e-9  # of the work exchanged: what is no more than that does no work over the cycle


def number(value: float, digits: int = formulas.DIGITS) -> str:
    """A number within a sentence, with the decimal mark of the language in use."""
    return formulas.numeral(Quantity("", value, "", digits)).text


def quantity(value: float, unit: str, digits: int = formulas.DIGITS) -> str:
    """A number with its unit within a sentence."""
    return formulas.numeral(Quantity("", value, unit, digits)).text


class Context:
    """A sizing with the common data of its steps: the quantities of its regime by their symbols.

    `cycle` is the one along the motion, `constant` that at the constant speed of the areas (the same where no torque
    depends on speed). `panel` draws a panel of the sizing's picture by its kind.
    """

    def __init__(self, sizing: Sizing, panel: Callable[[str], Figure]) -> None:
        self.sizing, self.panel = sizing, panel
        self.scene = sizing.scene
        self.cycle = sizing.cycle
        self.constant = sizing.constant or sizing.cycle
        self.ratio = sizing.scene.flywheel_ratio
        self.eps = sizing.scene.irregularity
        self.speed, self.epsilon = self.of("speed"), self.of("irregularity")
        self.turn = Quantity("Phi", sizing.scene.cycle, "rad")
        self.at_flywheel = Quantity("i_f", self.ratio)
        self.area_speed = self.speed if sizing.cyclic is None else self.of("constant_speed")

    def of(self, key: str) -> Quantity:
        """A figure of the sizing by its key, under its own symbol."""
        one = finding(key)
        return Quantity(one.symbol, one.of(self.sizing) or 0.0, one.unit)

    @property
    def otherwise(self) -> bool:
        """True if another limit than the irregularity decides the flywheel."""
        return self.sizing.binding not in (None, "irregularity")

    def at(self, phi: float, cycle: Cycle | None = None) -> tuple[float, float, float]:
        """A crank angle (rad), W (J) and I* (kg m²) there, from the cycle itself."""
        cycle = cycle or self.cycle
        assert cycle is not None
        work, variation = cycle.at(*cells.located(cycle.mesh, np.array([phi])))
        return phi, float(work[0]), float(cycle.inertia_at_start + variation[0])

    @cached_property
    def works(self) -> Mapping[str, float]:
        """The work (J) over the cycle along the motion of every contribution to M*, by its name."""
        machine, cycle = self.sizing.machine, self.cycle
        assert machine is not None
        assert cycle is not None
        works = {name: float(cells.integral(part, cycle.mesh.half).sum()) for name, part in moments(self.sizing).items()}
        least = _NO_WORK * cycle.exchanged  # a weight that comes back does no work
        return {name: work if abs(work) > least else 0.0 for name, work in works.items()}


def moments(sizing: Sizing) -> dict[str, Array]:
    """Contributions to M* (N m) at the nodes of the cycle along the motion, by name."""
    machine, cycle = sizing.machine, sizing.cycle
    assert machine is not None
    assert cycle is not None
    mesh, omega = cycle.mesh, None
    if machine.depends_on_speed:
        omega = np.full(mesh.phi.shape, sizing.speed)
        if sizing.run is not None:
            omega = turning_moment.speed_over_cycle(cycle, sizing.speed, sizing.run, mesh.phi)
    parts = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0, speed=omega)
    return {name: np.asarray(part + np.zeros_like(mesh.phi)) for name, part in parts.items()}
