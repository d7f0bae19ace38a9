"""What accuracy costs on a scene, told: the question, the reference, a table of methods, and what follows."""

from __future__ import annotations

from itertools import groupby

from flywheel.numerics.units import columns, figure
from flywheel.study.tradeoff import RESTARTED, Row, Tradeoff, ordered
from flywheel.tables.rows import encoded, page, plain, sentences, wrapped

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
    reference, unit = found.reference, found.unit and f" {found.unit}"
    value = figure(reference.value, reference.doubt * max(abs(reference.value), found.scale), 17)
    question = wrapped(found.title, "") if found.title else []
    question.append(f"Accuracy against time: the {found.figure}, to a relative error of {found.rtol:g}")
    question.append(f"  reference  {value}{unit}, itself in doubt by {reference.doubt:.1e} (relative)")
    question += sentences([f"It comes from {reference.route}.", f"Second route: {reference.verified}."])
    if found.scale > abs(reference.value):
        scale = f"{figure(found.scale, most=6)}{unit}"
        question += sentences([f"Errors are relative to {scale}, which the work exchanged makes."])
    question += sentences(found.messages)

    reasons: dict[str, list[Row]] = {}
    missing: dict[str, list[Row]] = {}
    for row in ordered(found.rows):
        if row.error is None:
            reasons.setdefault(f"{row.outcome} ({row.reason})" if row.reason else row.outcome, []).append(row)
        if row.leaves_out:
            missing.setdefault(row.leaves_out, []).append(row)
    without = [f"{reason}: {_names(rows, found)}" for reason, rows in reasons.items()]
    without += [f"not for this scene: {name}: {reason}" for name, reason in found.cannot.items()]
    left_out = [f"{_names(rows, found)}: {what}" for what, rows in missing.items()]
    return page(
        (
            question,
            _table(found),
            ["Without an answer", *sentences(without)] if without else [],
            ["What methods leave out", *sentences(left_out)] if left_out else [],
            sentences([found.sentence, *unfinished(found)], ""),
        )
    )


def json(found: Tradeoff) -> str:
    """What `flywheel tradeoff --json` prints, SI throughout."""
    return encoded(found.as_dict(), indent=2)


def _table(found: Tradeoff) -> list[str]:
    """A line for each answer, under its family's name."""
    done = ordered(row for row in found.rows if row.error is not None)
    if not done:
        return []
    least = 1.0 if found.cheapest is None else found.row(found.cheapest).seconds or 1.0
    marks = dict.fromkeys(found.level, "level") | {found.cheapest_promised: "promised", found.cheapest: "cheapest"}
    cells: list[tuple[str, ...]] = []
    for family, group in groupby(done, lambda row: row.family):
        rows = list(group)
        if _setting(rows[0]):
            cells.append((family, *[""] * (len(_HEADER) - 1)))
        for row in rows:
            seconds = row.seconds or 0.0
            cells.append(
                (
                    f"  {_setting(row)}" if _setting(row) else row.name,
                    error(found, row).rjust(len("< 1.0e-15")),
                    "?" if row.meets is None else "yes" if row.meets else "no",
                    plain(1e3 * seconds, 3),
                    plain(seconds / least, 2),
                    "" if row.evaluations is None else str(row.evaluations),
                    str(row.repeats),
                    marks.get(row.name, ""),
                )
            )
    kept = [k for k in range(len(_HEADER)) if k != _RATIO or found.cheapest is not None]
    lines = columns([[line[k] for k in kept] for line in cells], [_HEADER[k] for k in kept])
    return ["Methods: true relative error, whether it keeps what is asked, median time on this machine", *lines]


def error(found: Tradeoff, row: Row) -> str:
    """A row's true error; where it is below the reference's own error bound, that much is known only."""
    bound, value = found.reference.doubt, row.error or 0.0
    return f"< {bound:.1e}" if value < bound else f"{value:.1e}"


def _setting(row: Row) -> str:
    """What a row has beside its family; nothing where that says all."""
    return row.name.removeprefix(row.family).removeprefix(", ")


def _names(rows: list[Row], found: Tradeoff) -> str:
    """Rows by family, with what tells them apart where they are not the whole of it; families of one kind together."""
    named = []
    for family, group in groupby(rows, lambda row: row.family):
        kind, _, which = family.partition(", ")
        own, everyone = list(group), ordered(row for row in found.rows if row.family == family)
        restarted = [row for row in everyone if row.name.endswith(RESTARTED)]
        if own == everyone:
            mark = ""
        elif own == restarted:
            mark = ", restarted"
        elif own == everyone[len(restarted) :]:
            mark = ", without restart"
        else:
            mark = f" ({'; '.join(map(_setting, own))})"
        named.append((kind, which, mark))
    told = []
    for (kind, mark), alike in groupby(named, lambda name: (name[0], name[2])):
        every = ", ".join(which for _, which, _ in alike if which)
        told.append(", ".join(part for part in (kind, every) if part) + mark)
    return "; ".join(told)


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
