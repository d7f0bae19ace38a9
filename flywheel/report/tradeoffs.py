"""What accuracy costs on a scene, told: the question, the reference, a table of methods, and what follows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from flywheel.numerics.units import columns, figure
from flywheel.report.rows import encoded, page, sentences, wrapped
from flywheel.study.methods import FAMILIES, RESTARTED
from flywheel.study.tradeoff import Row, Tradeoff

_HEADER = ("", "error", "keeps", "time, ms", "ratio", "positions", "runs", "")
_RATIO = 4  # the column that is left out where nothing keeps rtol


def text(found: Tradeoff) -> str:
    """All of it, at most 100 columns wide.

    >>> from flywheel.study.reference import Reference
    >>> reference = Reference(2.0, 1e-15, "Gauss' rule", "the closed form is 1e-16 apart")
    >>> found = Tradeoff("Rotor", "exact flywheel", "kg m²", 1e-6, reference, 2.0, (), None, (), None, {}, 60.0, 0.1, False)
    >>> print(text(found).splitlines()[1])
    Accuracy against time: the exact flywheel, to a relative error of 1e-06
    """
    blocks = (_question, _table, _without, _left_out, _conclusion)
    return page(block(found) for block in blocks)


def json(found: Tradeoff) -> str:
    """What `flywheel tradeoff --json` prints, SI throughout."""
    return encoded(found.as_dict(), indent=2)


def ordered(rows: Iterable[Row]) -> list[Row]:
    """Rows by family, in each those with a restart before those without."""
    places = {name: k for k, name in enumerate(FAMILIES)}
    return sorted(rows, key=lambda row: (places.get(row.family, len(places)), row.family, not row.name.endswith(RESTARTED)))


def setting(row: Row) -> str:
    """What a row has beside its family; nothing where that says all."""
    return row.name.removeprefix(row.family).removeprefix(", ")


def _question(found: Tradeoff) -> list[str]:
    reference, unit = found.reference, found.unit and f" {found.unit}"
    value = figure(reference.value, reference.doubt * max(abs(reference.value), found.scale), 17)
    lines = wrapped(found.title, "") if found.title else []
    lines.append(f"Accuracy against time: the {found.figure}, to a relative error of {found.rtol:g}")
    lines.append(f"  reference  {value}{unit}, itself in doubt by {reference.doubt:.1e} (relative)")
    lines += sentences([f"It comes from {reference.route}.", f"Second route: {reference.verified}."])
    if found.scale > abs(reference.value):
        lines += sentences([f"Errors are relative to {figure(found.scale, most=6)}{unit}, which the work exchanged makes."])
    return lines + sentences(list(found.messages))


# -- the table -------------------------------------------------------------------------------------------------------


def _table(found: Tradeoff) -> list[str]:
    """A line for each answer, under its family's name."""
    done = ordered(row for row in found.rows if row.error is not None)
    if not done:
        return []
    cells: list[tuple[str, ...]] = []
    for _, group in groupby(done, lambda row: row.family):
        rows = list(group)
        if setting(rows[0]):
            cells.append((rows[0].family, *[""] * (len(_HEADER) - 1)))
        cells += [(f"  {setting(row)}" if setting(row) else row.name, *_cells(found, row)) for row in rows]
    kept = [k for k in range(len(_HEADER)) if k != _RATIO or found.cheapest is not None]
    lines = columns([[line[k] for k in kept] for line in cells], [_HEADER[k] for k in kept])
    return ["Methods: true relative error, whether it keeps what is asked, median time on this machine", *lines]


def _cells(found: Tradeoff, row: Row) -> Iterator[str]:
    yield error(found, row).rjust(len("< 1.0e-15"))
    yield "?" if row.meets is None else "yes" if row.meets else "no"
    yield plain(1e3 * (row.seconds or 0.0), 3)
    yield plain((row.seconds or 0.0) / _least(found), 2)
    yield "" if row.evaluations is None else str(row.evaluations)
    yield str(row.repeats)
    yield _mark(found, row)


def error(found: Tradeoff, row: Row) -> str:
    """A row's true error; where it is below the reference's doubt, that much is known only."""
    doubt = found.reference.doubt
    value = row.error or 0.0
    return f"< {doubt:.1e}" if value < doubt else f"{value:.1e}"


def plain(value: float, decimals: int) -> str:
    """A positive number to three digits without an exponent, to two where it takes more decimals.

    >>> plain(0.08581, 3), plain(7104.2, 3), plain(0.63, 2)
    ('0.086', '7100', '0.63')
    """
    from decimal import Decimal

    three = Decimal(f"{value:.3g}")
    exponent = three.as_tuple().exponent
    fine = isinstance(exponent, int) and exponent < -decimals
    return f"{Decimal(f'{value:.2g}') if fine else three:f}"


def _least(found: Tradeoff) -> float:
    return 1.0 if found.cheapest is None else found.row(found.cheapest).seconds or 1.0


def _mark(found: Tradeoff, row: Row) -> str:
    marks = {found.cheapest_promised: "promised", found.cheapest: "cheapest"}
    return marks.get(row.name, "level" if row.name in found.level else "")


# -- what is not in it -----------------------------------------------------------------------------------------------


def _without(found: Tradeoff) -> list[str]:
    """Methods without an answer, those with the same reason together."""
    reasons: dict[str, list[Row]] = {}
    for row in ordered(row for row in found.rows if row.error is None):
        reasons.setdefault(f"{row.outcome} ({row.reason})" if row.reason else row.outcome, []).append(row)
    told = [f"{reason}: {_names(rows, found)}" for reason, rows in reasons.items()]
    told += [f"not for this scene: {name}: {reason}" for name, reason in found.cannot.items()]
    return ["Without an answer", *sentences(told)] if told else []


def _left_out(found: Tradeoff) -> list[str]:
    """What approximate methods do not see."""
    missing: dict[str, list[Row]] = {}
    for row in ordered(row for row in found.rows if row.leaves_out):
        missing.setdefault(row.leaves_out, []).append(row)
    told = [f"{_names(rows, found)}: {what}" for what, rows in missing.items()]
    return ["What methods leave out", *sentences(told)] if told else []


def _names(rows: list[Row], found: Tradeoff) -> str:
    """Rows by family, with what tells them apart where they are not the whole of it; families of one kind together."""
    named = [_named(list(group), found) for _, group in groupby(rows, lambda row: row.family)]
    told = []
    for (kind, mark), group in groupby(named, lambda name: (name[0], name[2])):
        which = ", ".join(own for _, own, _ in group if own)
        told.append(", ".join(part for part in (kind, which) if part) + mark)
    return "; ".join(told)


def _named(rows: list[Row], found: Tradeoff) -> tuple[str, str, str]:
    """A family's kind, which of that kind it is, and which of its rows are meant: nothing for all of them."""
    family = rows[0].family
    kind, _, which = family.partition(", ")
    everyone = ordered(row for row in found.rows if row.family == family)
    restarted = [row for row in everyone if row.name.endswith(RESTARTED)]
    if rows == everyone:
        return kind, which, ""
    if rows == restarted:
        return kind, which, ", restarted"
    if rows == everyone[len(restarted) :]:
        return kind, which, ", without restart"
    return kind, which, f" ({'; '.join(map(setting, rows))})"


def _conclusion(found: Tradeoff) -> list[str]:
    return sentences([found.sentence, *unfinished(found)], "")


def unfinished(found: Tradeoff) -> list[str]:
    """Why a table is not whole, in a sentence; nothing where it is.

    >>> from flywheel.study.reference import Reference
    >>> nothing = ("irregularity", "", 1e-6, Reference(1.0, 1e-15, "", ""), 0.0, (), None, (), None, {}, 60.0, 0.1)
    >>> unfinished(Tradeoff(None, *nothing, True))
    ['NOT WHOLE: interrupted; 0 of 0 methods were run to their end.']
    """
    if found.complete:
        return []
    ended = sum(row.outcome in ("done", "no answer") for row in found.rows)
    count = f"{ended} of {len(found.rows)} methods were run to their end"
    if found.interrupted:
        return [f"NOT WHOLE: interrupted; {count}."]
    return [f"NOT WHOLE: {count} within {found.budget:g} s; --budget {2 * found.budget:g} runs more."]
