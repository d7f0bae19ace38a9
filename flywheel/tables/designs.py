"""Designs on a terminal of 80 columns: sweeps, sensitivities, tolerances, optima, choice of a motor; methods compared."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from math import degrees, inf, isnan, pi
from textwrap import wrap

import numpy as np

from flywheel.designs.catalogue import MotorChoice, SuitableMotors
from flywheel.designs.figures import ALONE, FIGURES, MAIN, REFINED, REFUSED, TRACED, selection
from flywheel.designs.optimum import KeptLimit, Optimum
from flywheel.designs.sweep_results import ParetoFront, Sweep, blocks, objective
from flywheel.designs.tolerance import QUANTILES, Sobol, Tolerance
from flywheel.designs.variation import Derivative, Sensitivities, change
from flywheel.numerics.units import aligned, columns, figure
from flywheel.study.tradeoff import RESTARTED, MethodRow, Tradeoff, ordered
from flywheel.tables.power import warnings
from flywheel.tables.rows import Row, encoded, paragraphs, plain, printable, sentences, short_names, wrapped
from flywheel.tables.sizing import remarks

WIDTH = 80
_DIGITS = 6
_REASONS = 4
_MOST_ALTERNATIVES = 12  # combinations of choices that are shown
_IN_TABLE = ("exact", "approximate", "irregularity", "power", "balance")
_OF_BEST = ("exact", "approximate", "inertia_torque", "irregularity", "speed", "balance", "power", "energy_fluctuation",
            "mass", "wheel.stress", "wheel.safety")  # fmt: skip
_APPROXIMATE_TIE = 1e-9  # share by which the approximate flywheel may be below the exact one


def sweep_text(sweep: Sweep, rows: int = 20) -> str:
    """The text of a sweep, with at most `rows` of the designs, evenly chosen."""
    return paragraphs(
        (_question(sweep), _best(sweep), _table(sweep, rows), [line for note in notes(sweep) for line in _hung(note, "")])
    )


def notes(sweep: Sweep) -> list[str]:
    """Notes on a sweep in sentences: refusals, dangers, accuracy."""
    said = list(sweep.messages)
    kinds = {
        re.sub(r"\d[\d.e+-]*", "#", reason): reason for reason in sweep.reasons.values()
    }  # numbers make none of their own
    refused = Counter(re.sub(r"\d[\d.e+-]*", "#", reason) for reason in sweep.reasons.values())
    if refused:
        said.append(f"{sum(refused.values())} of {_designs(len(sweep))} are refused and shown as nan:")
        said += [
            f"{count} x{'' if count == 1 else ', such as'} {kinds[kind]}" for kind, count in refused.most_common(_REASONS)
        ]
        if len(refused) > _REASONS:
            said.append(f"and {len(refused) - _REASONS} more reasons, in the last column of --csv")
    said += [f"{path} changes no figure of this scene" for path in _without_effect(sweep)]
    count, most, design = 0, 0.0, 0
    for part in blocks(len(sweep)):
        exact, approximate = sweep.values["exact"][part], sweep.values["approximate"][part]
        below = np.flatnonzero(exact - approximate > _APPROXIMATE_TIE * np.abs(exact))
        share = (exact[below] - approximate[below]) / exact[below]
        count += below.size
        if share.size and share.max() > most:
            most, design = float(share.max()), part.start + int(below[share.argmax()])
        sweep.release()
    if count:
        said.append(
            f"DANGER: the approximate flywheel is below the exact one in {_designs(count)}, "
            f"by up to {figure(100 * most, most=3)} % (design {design})"
        )
    check = sweep.check
    if check is not None and not check.failed:
        were = "was" if len(check.designs) == 1 else "were"
        said.append(
            f"{_designs(len(check.designs))} {were} sized by size as well, at random and where estimates are largest: "
            f"figures differ by {figure(check.ratio, most=2)} of the sum of both estimates at most"
        )
    return said


def _without_effect(sweep: Sweep) -> list[str]:
    """The numbers of a grid whose variation changes no figure."""
    if len(sweep.shape) != len(sweep.columns) or not np.isfinite(sweep.worst).any():
        return []
    idle = {axis: path for axis, (path, column) in enumerate(sweep.columns.items()) if np.ptp(column) > 0.0}
    for name in sweep.names if idle else ():
        row = sweep.values[name].reshape(sweep.shape)
        tie = _APPROXIMATE_TIE * np.fmax.reduce(np.abs(row), axis=None)
        for axis in list(idle):
            if (np.fmax.reduce(row, axis=axis) - np.fmin.reduce(row, axis=axis) > tie).any():
                del idle[axis]
        sweep.release()
        if not idle:
            break
    return list(idle.values())


def _designs(count: int) -> str:
    return f"{count} design{'' if count == 1 else 's'}"


def _question(sweep: Sweep) -> list[str]:
    grid = f", on a grid of {' x '.join(map(str, sweep.shape))}" if len(sweep.shape) > 1 else ""
    lines = wrap(printable(sweep.scene.title), WIDTH) if sweep.scene.title else []
    lines.append(f"A sweep of {_designs(len(sweep))}{grid}, to a relative error of {sweep.rtol:g}")
    units = sweep.units
    ranges = []
    for path, column in sweep.columns.items():
        low, high = float(np.min(column)), float(np.max(column))
        words = figure(low, most=_DIGITS) + (f" to {figure(high, most=_DIGITS)}" if high > low else "")
        ranges.append(Row(path, words, units[path]))
    lines += [line[:WIDTH].rstrip() for line in columns(ranges)]
    counts = {"many at once": (TRACED,), "refined": (REFINED,), "one by one": (ALONE,), "refused": (REFUSED,)}
    ways = {words: int(np.isin(sweep.ways, ways).sum()) for words, ways in counts.items()}
    parts = [f"{count} {words}" for words, count in ways.items() if count]
    if sweep.missing:
        parts.append(f"{sweep.missing} missing")
    worst = sweep.worst[np.isfinite(sweep.worst)]
    error = f"; errors at most {worst.max():.1e}" if worst.size else ""
    return [*lines, *_hung(f"sized: {', '.join(parts)}{error}", "  ")]


def _best(sweep: Sweep) -> list[str]:
    name = objective(sweep)
    if not np.isfinite(sweep.values[name]).any():
        return []
    k, units = sweep.argmin(name), sweep.units
    rows = [Row(path, figure(float(column[k]), most=_DIGITS), units[path]) for path, column in sweep.columns.items()]
    names = [each for each in _OF_BEST if each in sweep.names]
    rows += [Row(FIGURES[each].about.partition(",")[0], _figure(sweep, each, k), units[each]) for each in names]
    what = "flywheel" if name == "exact" else name
    among = f", of the {_designs(len(sweep) - sweep.missing)} that are not missing" if sweep.missing else ""
    return [f"The least {what}: design {k}{among}", *(line[:WIDTH].rstrip() for line in columns(rows))]


def _figure(sweep: Sweep, name: str, k: int) -> str:
    value, error = float(sweep.values[name][k]), float(sweep.error[name][k])
    if math.isnan(value):
        return ""
    return figure(value, 0.0 if math.isnan(error) else error * abs(value), _DIGITS)


def _table(sweep: Sweep, rows: int) -> list[str]:
    count = len(sweep)
    chosen = list(range(count)) if count <= rows else sorted({k * (count - 1) // (rows - 1) for k in range(rows)})
    if not chosen or rows < 2:
        return []
    units, short = sweep.units, short_names(sweep.columns)
    names = [name for name in _IN_TABLE if name in sweep.names]
    cells = {"": [str(k) for k in chosen]}
    heads = {"": ("", "")}
    for path, column in sweep.columns.items():
        cells[path] = [figure(float(column[k]), most=_DIGITS) for k in chosen]
        heads[path] = short[path], units[path]
    for name in names:
        cells[name] = [_figure(sweep, name, k) for k in chosen]
        heads[name] = name, units[name]
    if np.isfinite(sweep.worst[chosen]).any():
        heads["error"] = "error", ""
        cells["error"] = ["" if math.isnan(sweep.worst[k]) else f"{sweep.worst[k]:.0e}" for k in chosen]
    blocks: list[list[str]] = []
    width = -2
    order = [*names[:1], *sweep.columns, *names[1:2], *(["error"] if "error" in cells else []), *names[2:]]
    with_units = any(unit for _, unit in heads.values())
    for key in _fitting(order, cells, heads):
        lines = [*heads[key][: 2 if with_units else 1], *aligned(cells[key])]
        wide = max(map(len, lines))
        width += wide + 2
        blocks.append([line.rjust(wide) for line in lines])
    left_out = len(cells) - len(blocks)
    title = "Designs" if len(chosen) == count else f"{len(chosen)} of the designs, evenly chosen"
    title += f" ({left_out} more column{'s'[: left_out - 1]} in --csv)" if left_out else ""
    return [title, *("  ".join(parts).rstrip() for parts in zip(*blocks, strict=True))]


def _fitting(order: Iterable[str], cells: dict[str, list[str]], heads: dict[str, tuple[str, str]]) -> list[str]:
    """The columns that fit a line, the most important ones, in the order of the table."""
    room, chosen = WIDTH, {""}
    room -= max(len(cell) for cell in cells[""])
    for key in order:
        wide = 2 + max(map(len, [*heads[key], *aligned(cells[key])]))
        if wide <= room:
            room -= wide
            chosen.add(key)
    return [key for key in cells if key in chosen]


def _hung(sentence: str, indent: str) -> Iterator[str]:
    yield from wrap(printable(sentence), WIDTH, initial_indent=indent, subsequent_indent=f"{indent}  ")


# -- sensitivities, tolerances, optima, motors ----------------------------------------------------------------------------


_LEAST_SHARE = 5e-5
_LONG = 1e8  # from which on a number is written with a power of ten
_NO_CHANGE = 1e-12  # share by which a figure that does not change may differ
_WEAK = 1e-3  # percent: a change whose derivative's error is not printed


def unit_of(derivative_of: str, by: str) -> str:
    """The unit of a derivative.

    >>> unit_of("kg m^2", "m"), unit_of("W", "N m"), unit_of("", "s"), unit_of("W", "")
    ('kg m^2/m', 'W/(N m)', '1/s', 'W')
    """
    if not by:
        return derivative_of
    return f"{derivative_of or '1'}/{f'({by})' if ' ' in by or '/' in by else by}"


# -- sensitivities -----------------------------------------------------------------------------------------------------


def sensitivities_text(sensitivities: Sensitivities, names: Sequence[str] = ()) -> str:
    """Derivatives of some figures, those that change most first."""
    short = short_names(sensitivities.numbers)
    head = [
        *_title(sensitivities.scene.title),
        *_wrapped(
            f"Derivatives by {_numbers(len(sensitivities.numbers))}, from {sensitivities.designs} designs around this one"
        ),
    ]
    blocks, reasons, worst = [], dict[str, list[str]](), 0.0
    for name in selection(sensitivities.derivatives, names):
        rows, none = [], []
        sizes = {path: abs(change(sensitivities, name, path)) for path in sensitivities.numbers}
        for path in sorted(sizes, key=lambda path: -inf if isnan(sizes[path]) else -sizes[path]):
            derivative, unit = (
                sensitivities.derivative(name, path),
                unit_of(sensitivities.figure_units[name], sensitivities.units[path]),
            )
            share = change(sensitivities, name, path)
            if derivative.reason:
                reasons.setdefault(f"{path}: {derivative.reason}", []).append(name)
            elif abs(derivative.value) <= derivative.error:
                none.append(short[path])
                continue
            elif abs(share) > _WEAK:
                worst = max(worst, derivative.error / abs(derivative.value))
            rows.append((short[path], _slope(derivative), unit, "" if isnan(share) else f"{share:+.3g}"))
        value, about = figure(sensitivities.values[name], most=_DIGITS), FIGURES[name].about.partition(",")[0]
        title = f"{about}: {value} {sensitivities.figure_units[name]}".rstrip()
        lines = columns(rows, ("by", "derivative", "", "% for 1 % or 1 deg"))
        blocks.append([title, *_cut(lines), *(_hung(f"none by {', '.join(none)}", "  ") if none else [])])
    said = [f"Relative errors of derivatives are at most {worst:.0e}."] if worst else []
    for reason, of in reasons.items():
        said.append(f"No derivative of {', '.join(of)} by {reason}.")
    return paragraphs((head, *blocks, [line for sentence in said for line in _wrapped(sentence)]))


def _slope(derivative: Derivative) -> str:
    if not isnan(derivative.value):
        return figure(derivative.value, derivative.error, _DIGITS)
    left, right = (
        "none" if isnan(value) else figure(value, error, 4)
        for value, error in ((derivative.left, derivative.left_error), (derivative.right, derivative.right_error))
    )
    return f"{left} | {right}"


def _number_text(value: float, unit: str, most: int = _DIGITS) -> str:
    """A number with a number of digits; an angle in degrees, see `_unit`."""
    return figure(degrees(value) if unit == "rad" else value, most=most)


def _unit(unit: str) -> str:
    return "deg" if unit == "rad" else unit


# -- tolerances --------------------------------------------------------------------------------------------------------


def tolerance_text(tolerance: Tolerance, names: Sequence[str] = ()) -> str:
    """Table of varied numbers, spread of figures, and shares of the variance."""
    kept, count = selection(tolerance.spreads, names), tolerance.samples.shape[1]
    what = "intervals" if tolerance.intervals else "standard deviations"
    head = [*_title(tolerance.scene.title), *_wrapped(f"Tolerance: {what} of {_numbers(len(tolerance.numbers))}")]
    rows = []
    for path, value in tolerance.numbers.items():
        unit = tolerance.units[path]
        if tolerance.intervals:
            low, high = (_number_text(end, unit) for end in tolerance.intervals[path])
            rows.append((path, f"{low} to {high}", _unit(unit), ""))
        else:
            text = f"{_number_text(value, unit)} ± {_number_text(tolerance.deviations[path], unit, 4)}"
            ends = ["open" if end is None else _number_text(end, unit) for end in tolerance.within.get(path, ())]
            rows.append((path, text, _unit(unit), f"within {' to '.join(ends)}" if ends else ""))
    said = [f"  correlation of {' and '.join(pair)}: {value:g}" for pair, value in tolerance.correlations.items()]
    blocks = [[*head, *_cut([*columns(rows), *said])]]
    if tolerance.intervals:
        blocks.append(["Least and greatest values within the intervals", *_extremes(tolerance, kept)])
    blocks.append([f"Statistics of {count} samples, to the digits that sampling allows", *_statistics(tolerance, kept)])
    if tolerance.kept is not None:
        blocks.append(_limits_kept(tolerance))
    blocks += [_shares(tolerance, name) for name in kept if tolerance.spreads[name].shares]
    said = [f"power: {FIGURES['power'].about.removeprefix('power ')}."] if "power" in kept else []
    said += [_sentence(message) for message in tolerance.messages]
    if tolerance.refused:
        said.append(f"{tolerance.refused} of {count} samples are refused and left out, such as: {tolerance.reason}")
    return paragraphs((*blocks, [line for sentence in said for line in _wrapped(sentence)]))


def _extremes(tolerance: Tolerance, kept: Iterable[str]) -> list[str]:
    rows = []
    for name in kept:
        spread = tolerance.spreads[name]
        if spread.least is None or spread.greatest is None:
            continue
        value = spread.nominal
        ends = [spread.least.value, spread.greatest.value]
        changes = [end / value - 1 if value else 0.0 for end in ends]
        shares = [f"{100 * (change if abs(change) > _NO_CHANGE else 0.0):+.3g} %" if value else "" for change in changes]
        rows.append(
            (
                name,
                figure(value, most=_DIGITS),
                *(part for end, share in zip(ends, shares, strict=True) for part in (figure(end, most=_DIGITS), share)),
                tolerance.figure_units[name],
            )
        )
    return _cut(columns(rows, ("", "given", "least", "", "greatest", "", "")))


def _statistics(tolerance: Tolerance, kept: Iterable[str]) -> list[str]:
    levels = tolerance.quantiles
    chosen = [k for k, q in enumerate(levels) if levels != QUANTILES or q in (0.01, 0.5, 0.99)]
    rows = []
    for name in kept:
        spread = tolerance.spreads[name]
        rows.append(
            (
                name,
                figure(spread.mean, 0.5 * spread.mean_error, _DIGITS),
                figure(spread.deviation, 0.5 * spread.deviation_error, 4),
                *(_plain(spread.quantiles[k], 0.5 * spread.quantile_errors[k]) for k in chosen),
                tolerance.figure_units[name],
            )
        )
    return _cut(columns(rows, ("", "mean", "deviation", *(f"{100 * levels[k]:g} %" for k in chosen), "")))


def _limits_kept(tolerance: Tolerance) -> list[str]:
    """The probability that each limit is kept, and all of them together."""
    rows = []
    for name, spread in tolerance.spreads.items():
        if spread.kept is None:
            continue
        low, high, share, error = spread.kept
        unit = tolerance.figure_units[name]
        ends = (
            f"{_number_text(low, unit)} <= " if low is not None else "",
            f" <= {_number_text(high, unit)}" if high is not None else "",
        )
        rows.append((f"{ends[0]}{name}{ends[1]} {_unit(unit)}".rstrip(), *_share(share, error)))
    if len(rows) > 1 and tolerance.kept is not None:
        rows.append(("all together", *_share(*tolerance.kept)))
    return ["Probability that a limit is kept, in percent", *_cut(columns(rows))]


def _share(share: float, error: float) -> tuple[str, str]:
    return f"{100 * share:.4g}", f"± {100 * error:.1g}"


def _plain(value: float, error: float) -> str:
    """A number to the digits that its error leaves, without a positive power of ten."""
    written = figure(value, error, 5)
    return f"{float(written):.0f}" if "e+" in written and abs(value) < _LONG else written


def _shares(tolerance: Tolerance, name: str) -> list[str]:
    shares = sorted(tolerance.spreads[name].shares.items(), key=lambda item: -item[1].total)
    rows = [(path, *_percent(share)) for path, share in shares]
    title = f"Contributions to the variance of {name}, in percent"
    return [title, *_cut(columns(rows, ("", "by itself", "", "with others", "")))]


def _percent(share: Sobol) -> tuple[str, str, str, str]:
    parts = []
    for value, error in ((share.first, share.first_error), (share.total, share.total_error)):
        small = value < max(_LEAST_SHARE, error)
        parts += ["0" if small else f"{100 * value:.2f}".rstrip("0").rstrip("."), f"± {100 * error:.1g}"]
    return parts[0], parts[1], parts[2], parts[3]


# -- optima ------------------------------------------------------------------------------------------------------------


def optimum_text(optimum: Optimum) -> str:
    """The best design, its active constraints, and its confirmation."""
    which, unit = "greatest" if optimum.greatest else "least", optimum.unit and f" {optimum.unit}"
    value = f"{figure(optimum.value, optimum.error, 8)}{unit}"
    before = ""
    if optimum.value_before is not None:
        share = optimum.value / optimum.value_before - 1.0 if optimum.value_before else float("nan")
        was = f"{figure(optimum.value_before, most=_DIGITS)}{unit}"
        before = f", with the scene's own numbers {was}" + ("" if isnan(share) else f" ({100 * share:+.3g} %)")
    head = [*_title(optimum.scene.title), *_wrapped(f"The {which} {optimum.objective}: {value}{before}")]
    rows = [
        (
            path,
            _number_text(value, optimum.units[path], 8),
            _unit(optimum.units[path]),
            f"{_number_text(low, optimum.units[path])} to {_number_text(high, optimum.units[path])}",
            f"at the {'lower' if optimum.at_bounds[path] == 'low' else 'upper'}" if path in optimum.at_bounds else "",
        )
        for (path, value), (low, high) in zip(optimum.numbers.items(), optimum.bounds.values(), strict=True)
    ]
    limits = [(limit.name, *_limit(limit), "binds" if limit.binds else "kept") for limit in optimum.limits]
    names = selection(optimum.figures, (*MAIN, "energy_fluctuation", "wheel.stress", "wheel.safety"))
    figures = [
        (
            FIGURES[name].about.partition(",")[0],
            figure(optimum.figures[name], optimum.errors[name], 8),
            optimum.figure_units[name],
        )
        for name in names
    ]
    confirmed = (
        f"Confirmed: sizing it alone gives the same, none of {optimum.around} designs around it is better, and slopes "
        "around it, with bounds and limits, allow no improvement."
    )
    motor = optimum.sizing.scene.motor
    said = [_sentence(message) for message in optimum.messages]
    said += [f"Remark: {remark}" for remark in remarks(optimum.sizing)]
    said += [] if motor is None or optimum.sizing.energy is None else warnings(optimum.sizing, motor)
    said += [confirmed] if optimum.confirmed and optimum.numbers else []
    effort = f"{optimum.designs} designs, {len(optimum.starts)} search{'' if len(optimum.starts) == 1 else 'es'}."
    said.append(f"Of {len(optimum.alternatives)} combinations the best: {effort}" if optimum.alternatives else effort)
    return paragraphs(
        (
            [*head, *_cut(columns(rows, ("", "best", "", "bounds", ""))), *_choices(optimum)],
            ["Limits", *_cut(columns(limits))] if limits else [],
            ["The best design", *_cut(columns(figures))],
            [line for sentence in said for line in _wrapped(sentence)],
        )
    )


def front_text(result: ParetoFront) -> str:
    """The front of several figures: a row for each design, ordered by the first figure."""
    senses = ["greatest" if greatest else "least" for greatest in result.greatest]
    aims = " and ".join(f"the {sense} {name}" for sense, name in zip(senses, result.objectives, strict=True))
    numbers = {path: unit for path, unit in result.number_units.items() if path not in result.objectives}
    names = [*short_names(result.objectives).values(), *short_names(numbers).values()]
    units = [*result.units, *map(_unit, numbers.values())]
    head = [f"{name}{unit and f', {unit}'}" for name, unit in zip(names, units, strict=True)]
    rows = [
        (
            *(figure(value, most=_DIGITS) for value in point.values),
            *(_number_text(point.numbers[path], unit) for path, unit in numbers.items()),
            *point.choices.values(),
            "" if point.confirmed else "not confirmed",
        )
        for point in result.points
    ]
    choices = short_names(result.points[0].choices).values() if result.points else ()
    said = (*result.messages, f"{result.searches} searches")
    return paragraphs(
        (
            [*_title(result.scene.title), *_wrapped(f"Designs between {aims}: {len(rows)}")],
            _cut(columns(rows, (*head, *choices, ""))),
            [line for message in said for line in _wrapped(_sentence(message))],
        )
    )


def _choices(optimum: Optimum) -> list[str]:
    """The combinations of choices with the best figure of each, the first few, and the others counted by reason."""
    if not optimum.alternatives:
        return []
    named = [alternative for alternative in optimum.alternatives if alternative.value is not None]
    rows = [(*each.choices.values(), figure(each.value or 0.0, most=8)) for each in named[:_MOST_ALTERNATIVES]]
    said = [f"and {len(named) - len(rows)} more combinations"] if len(named) > len(rows) else []
    reasons = [alternative.reason for alternative in optimum.alternatives if alternative.value is None]
    kinds = {re.sub(r"\d[\d.e+-]*", "#", reason): reason for reason in reversed(reasons)}
    counts = Counter(re.sub(r"\d[\d.e+-]*", "#", reason) for reason in reasons)
    said += [f"{count} without a design: {kinds[kind]}" for kind, count in counts.most_common(_REASONS)]
    head = (*optimum.choices, f"{optimum.objective}{optimum.unit and f', {optimum.unit}'}")
    return ["", *_cut(columns(rows, head)), *(f"  {line}" for sentence in said for line in _wrapped(sentence, WIDTH - 2))]


def _limit(limit: KeptLimit) -> tuple[str, str, str]:
    """Value of a limited figure, its unit, and the limits."""
    ends = [f">= {figure(limit.low, most=_DIGITS)}"] if limit.low is not None else []
    ends += [f"<= {figure(limit.high, most=_DIGITS)}"] if limit.high is not None else []
    return figure(limit.value, most=_DIGITS), limit.unit, " and ".join(ends)


def _sentence(message: str) -> str:
    return f"{message[0].upper()}{message[1:]}."


# -- lines -------------------------------------------------------------------------------------------------------------


def _numbers(count: int) -> str:
    return f"{count} number{'' if count == 1 else 's'}"


def _title(title: str | None) -> list[str]:
    return wrap(printable(title), WIDTH) if title else []


def _wrapped(sentence: str, width: int = WIDTH) -> Iterator[str]:
    yield from wrap(printable(sentence), width, subsequent_indent="  ")


def _cut(lines: Iterable[str]) -> list[str]:
    """Lines at most as wide as the terminal; --json has the rest."""
    return [line if len(line) <= WIDTH else f"{line[: WIDTH - 1].rstrip()}…" for line in lines]


# -- the choice of a motor ---------------------------------------------------------------------------------------------

_WIDE = 20  # characters of a motor's name


def motors_text(choice: SuitableMotors, rows: int = 20) -> str:
    """The suitable motors by total price, in a limited number of rows; then the others with their reasons."""
    count = len(choice.suitable) + len(choice.refused)
    title = f"Suitable motors: {len(choice.suitable)} of {count}"
    if choice.missing:
        title += f"; INTERRUPTED, {choice.missing} more were not examined"
    lines = [title]
    if choice.suitable:
        paid = _currency(choice)
        head = ("", "kW", "rpm", "ratio", "wheel", "crank", "eps", "heat", "torque", "start", "I²t", *paid)
        units = ("", "", "rated", "", "kg m²", "rpm", "", "%", "rms, %", "s", "%", *["", "in all"][: len(paid)])
        table = [units, *(_motor_cells(choice, len(paid)) for choice in choice.suitable[:rows])]
        kept = [k for k in range(len(head)) if k == 0 or any(row[k] for row in table[1:])]
        lines += columns([[row[k] for k in kept] for row in table], [head[k] for k in kept], gap=" ")
        if len(choice.suitable) > rows:
            lines.append(f"  and {len(choice.suitable) - rows} more (--rows)")
        lines += wrap(
            f"The flywheel is on {choice.on}; {_bound(choice)}", WIDTH, initial_indent="  ", subsequent_indent="  "
        )
    refused = _reasons("Unsuitable motors", [choice for choice in choice.refused if choice.suits is False])
    left = _reasons(
        "Undecided: no steady motion was found, or no start that ends",
        [choice for choice in choice.refused if choice.suits is None],
    )
    notes = [line for note in choice.notes for line in wrap(f"Note: {note}", WIDTH)]
    return paragraphs([lines, refused, left, notes])


def _reasons(title: str, choices: Sequence[MotorChoice]) -> list[str]:
    """Unsuitable motors with their reasons, under a title."""
    named_reasons = [f"{_short(choice.motor.name)}: {printable(choice.reason)}" for choice in choices]
    lines = [line for each in named_reasons for line in wrap(each, WIDTH, initial_indent="  ", subsequent_indent="    ")]
    return [title, *lines] if lines else []


def _bound(choice: SuitableMotors) -> str:
    bound = {choice.binding for choice in choice.suitable if choice.binding not in (None, "irregularity")}
    note = "heat and torque are fractions of the rated point, I²t of a start that of its limit by the locked-rotor time."
    if not bound:
        return note
    names = ", ".join(f"{_short(c.motor.name)} by {c.binding}" for c in choice.suitable if c.binding in bound)
    return f"{note} Larger than for the irregularity alone: {names}."


def _short(name: str) -> str:
    text = printable(name)
    return text if len(text) <= _WIDE else f"{text[: _WIDE - 1]}…"


def _currency(choice: SuitableMotors) -> list[str]:
    """The headings of the prices, if there are any: of the motor, and with its flywheel if that has a price."""
    priced = [choice for choice in choice.suitable if choice.motor.price is not None]
    if not priced:
        return []
    return [priced[0].motor.currency or "price", *([""] if priced[0].wheel_price is not None else [])]


def _motor_cells(choice: MotorChoice, prices: int) -> list[str]:
    """A motor's row with its prices."""
    rated, start = choice.motor.motor.rated, choice.start
    share = None if start is None else start.share

    def cell(value: float | None, digits: int = 4) -> str:
        return "" if value is None else figure(value, 0.0, digits)

    cells = [
        _short(choice.motor.name),
        cell(None if rated is None else rated.power / 1e3),
        cell(None if rated is None else rated.speed * 30 / pi),
        cell(choice.ratio),
        cell(choice.flywheel, 5),
        cell(None if choice.speed is None else choice.speed * 30 / pi),
        cell(choice.irregularity, 3),
        *(cell(None if part is None else 100 * part, 3) for part in (choice.heat_share, choice.rms_torque_share)),
        cell(None if start is None else start.time, 3),
        cell(None if share is None else 100 * share, 3),
    ]
    return [*cells, *[cell(price, 7) for price in (choice.motor.price, choice.total_price)][:prices]]


def motors_csv(choice: SuitableMotors) -> str:
    """The same as CSV, SI throughout, a row for each motor."""
    from csv import writer
    from io import StringIO

    rows, units = [choice.as_dict() for choice in (*choice.suitable, *choice.refused)], _MOTOR_UNITS
    stream = StringIO()
    lines = writer(stream, lineterminator="\n")
    if rows:
        lines.writerow([f"{name} [{units[name]}]" if name in units else name for name in rows[0]])
    for row in rows:
        lines.writerow([("1" if value else "0") if isinstance(value, bool) else value for value in row.values()])
    return stream.getvalue()


_MOTOR_UNITS = {
    "power": "W",
    "rated_speed": "rad/s",
    "inertia": "kg m^2",
    "flywheel": "kg m^2",
    "speed": "rad/s",
    "starting_torque": "N m",
    "load_at_start": "N m",
    "hardest_start": "rad",
    "hardest_load": "N m",
    "wheel_inertia": "kg m^2",
    "wheel_mass": "kg",
    "wheel_diameter": "m",
    "start_time": "s",
    "start_current_squared": "s",
    "start_allowed": "s",
}

# -- methods beside each other -----------------------------------------------------------------------------------------


_HEADER = ("", "error", "keeps", "time, ms", "ratio", "positions", "runs", "")
_RATIO = 4  # the column left out where no method keeps rtol


def tradeoff_text(comparison: Tradeoff) -> str:
    """The text of a comparison, at most 100 columns wide.

    >>> from flywheel.study.answers import Reference
    >>> reference = Reference(2.0, 1e-15, "Gauss' rule", "the closed form is 1e-16 apart")
    >>> rotor = Tradeoff("Rotor", "exact flywheel", "kg m²", 1e-6, reference, 2.0, (), None, (), None, {}, 60.0, 0.1, False)
    >>> print(tradeoff_text(rotor).splitlines()[1])
    Accuracy against time: the exact flywheel, to a relative error of 1e-06
    """
    reference, unit = comparison.reference, comparison.unit and f" {comparison.unit}"
    value = figure(reference.value, reference.doubt * max(abs(reference.value), comparison.scale), 17)
    question = wrapped(comparison.title, "") if comparison.title else []
    question.append(f"Accuracy against time: the {comparison.figure}, to a relative error of {comparison.rtol:g}")
    question.append(f"  reference  {value}{unit}, with an error of {reference.doubt:.1e} (relative)")
    question += sentences([f"It comes from {reference.route}.", f"Second route: {reference.verified}."])
    if comparison.scale > abs(reference.value):
        scale = f"{figure(comparison.scale, most=6)}{unit}"
        question += sentences([f"Errors are relative to {scale}, the scale set by the work exchanged."])
    question += sentences(comparison.messages)

    reasons: dict[str, list[MethodRow]] = {}
    missing: dict[str, list[MethodRow]] = {}
    for row in ordered(comparison.rows):
        if row.error is None:
            reasons.setdefault(f"{row.outcome} ({row.reason})" if row.reason else row.outcome, []).append(row)
        if row.leaves_out:
            missing.setdefault(row.leaves_out, []).append(row)
    without = [f"{reason}: {_names(rows, comparison)}" for reason, rows in reasons.items()]
    without += [f"not for this scene: {name}: {reason}" for name, reason in comparison.cannot.items()]
    left_out = [f"{_names(rows, comparison)}: {what}" for what, rows in missing.items()]
    return paragraphs(
        (
            question,
            _methods(comparison),
            ["Without an answer", *sentences(without)] if without else [],
            ["What methods leave out", *sentences(left_out)] if left_out else [],
            sentences([comparison.sentence, *unfinished(comparison)], ""),
        )
    )


def tradeoff_json(comparison: Tradeoff) -> str:
    """JSON that `flywheel tradeoff --json` prints, SI throughout."""
    return encoded(comparison.as_dict(), indent=2)


def _methods(comparison: Tradeoff) -> list[str]:
    """A line for each answer, under its family's name."""
    done = ordered(row for row in comparison.rows if row.error is not None)
    if not done:
        return []
    least = 1.0 if comparison.cheapest is None else comparison.row(comparison.cheapest).seconds or 1.0
    marks = dict.fromkeys(comparison.level, "level") | {
        comparison.cheapest_promised: "promised",
        comparison.cheapest: "cheapest",
    }
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
                    error(comparison, row).rjust(len("< 1.0e-15")),
                    "?" if row.meets is None else "yes" if row.meets else "no",
                    plain(1e3 * seconds, 3),
                    plain(seconds / least, 2),
                    "" if row.evaluations is None else str(row.evaluations),
                    str(row.repeats),
                    marks.get(row.name, ""),
                )
            )
    kept = [k for k in range(len(_HEADER)) if k != _RATIO or comparison.cheapest is not None]
    lines = columns([[line[k] for k in kept] for line in cells], [_HEADER[k] for k in kept])
    return ["Methods: true relative error, whether it meets the tolerance, median time on this machine", *lines]


def error(comparison: Tradeoff, row: MethodRow) -> str:
    """A row's true error; below the reference's own error bound, that bound with "<"."""
    bound, value = comparison.reference.doubt, row.error or 0.0
    return f"< {bound:.1e}" if value < bound else f"{value:.1e}"


def _setting(row: MethodRow) -> str:
    """Setting of a row within its family; empty if the family has one row."""
    return row.name.removeprefix(row.family).removeprefix(", ")


def _names(rows: list[MethodRow], comparison: Tradeoff) -> str:
    """Rows by family, with their differences if they are not the whole family; families of one kind together."""
    named = []
    for family, group in groupby(rows, lambda row: row.family):
        kind, _, which = family.partition(", ")
        own, everyone = list(group), ordered(row for row in comparison.rows if row.family == family)
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
    parts = []
    for (kind, mark), alike in groupby(named, lambda name: (name[0], name[2])):
        every = ", ".join(which for _, which, _ in alike if which)
        parts.append(", ".join(part for part in (kind, every) if part) + mark)
    return "; ".join(parts)


def unfinished(comparison: Tradeoff) -> list[str]:
    """Reason why a table is incomplete, in a sentence; empty if it is complete.

    >>> from flywheel.study.answers import Reference
    >>> nothing = ("irregularity", "", 1e-6, Reference(1.0, 1e-15, "", ""), 0.0, (), None, (), None, {}, 60.0, 0.1)
    >>> unfinished(Tradeoff(None, *nothing, True))
    ['INCOMPLETE: interrupted; 0 of 0 methods were run to completion.']
    """
    if comparison.complete:
        return []
    ended = sum(row.outcome in ("done", "no answer") for row in comparison.rows)
    count = f"{ended} of {len(comparison.rows)} methods were run to completion"
    if comparison.interrupted:
        return [f"INCOMPLETE: interrupted; {count}."]
    return [f"INCOMPLETE: {count} within {comparison.budget:g} s; --budget {2 * comparison.budget:g} runs more."]
