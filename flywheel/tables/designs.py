"""Sensitivities, tolerances, optima and the choice of a motor, told on a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import degrees, isnan, pi
from textwrap import wrap

from flywheel.designs.catalogue import MotorChoice, SuitableMotors
from flywheel.designs.figures import FIGURES
from flywheel.designs.optimum import Limit, Optimum
from flywheel.designs.sensitivities import Derivative, Sensitivities
from flywheel.designs.tolerance import QUANTILES, Share, Tolerance
from flywheel.numerics.units import columns, figure
from flywheel.tables.rows import page, printable
from flywheel.tables.sweeps import WIDTH, short_names

MAIN = ("mass", "exact", "irregularity", "power")
"""The figures that are shown unless others are named."""
_DIGITS = 6
_DEGREE = pi / 180
_LEAST_SHARE = 5e-5
_LONG = 1e8  # from which on a number is written with a power of ten
_ROUNDING = 1e-12  # share by which a figure that does not change may differ
_WEAK = 1e-3  # per cent: a change whose derivative's error is not told


def shown(there: Iterable[str], names: Sequence[str] = ()) -> list[str]:
    """The figures to be shown: those that are named, or the main ones."""
    own = list(there)
    return [name for name in names or MAIN if name in own] or own[:1]


def change(found: Sensitivities, name: str, path: str) -> float:
    """By how many per cent a figure changes for one per cent of a number, or for a degree of an angle; NaN if unknown."""
    value, derivative = found.values[name], found.derivative(name, path).value
    step = _DEGREE if found.units[path] == "rad" else 0.01 * found.numbers[path]
    return 100.0 * derivative * step / value if value else float("nan")


def per(found: Sensitivities, path: str) -> str:
    """What `change` is for."""
    return "1 deg" if found.units[path] == "rad" else "1 %"


def unit_of(derivative_of: str, by: str) -> str:
    """The unit of a derivative.

    >>> unit_of("kg m^2", "m"), unit_of("W", "N m"), unit_of("", "s"), unit_of("W", "")
    ('kg m^2/m', 'W/(N m)', '1/s', 'W')
    """
    if not by:
        return derivative_of
    return f"{derivative_of or '1'}/{f'({by})' if ' ' in by or '/' in by else by}"


# -- sensitivities -----------------------------------------------------------------------------------------------------


def sensitivities_text(found: Sensitivities, names: Sequence[str] = ()) -> str:
    """Derivatives of some figures, those that change most first."""
    short = short_names(found.numbers)
    head = [
        *_title(found.scene.title),
        *_wrapped(f"Derivatives by {_numbers(len(found.numbers))}, from {found.designs} designs around this one"),
    ]
    blocks, reasons, worst = [], dict[str, list[str]](), 0.0
    for name in shown(found.derivatives, names):
        rows, none = [], []
        order = sorted(found.numbers, key=lambda path, name=name: -abs(_known(change(found, name, path))))  # type: ignore[misc]
        for path in order:
            derivative, unit = found.derivative(name, path), unit_of(found.figure_units[name], found.units[path])
            share = change(found, name, path)
            if derivative.reason:
                reasons.setdefault(f"{path}: {derivative.reason}", []).append(name)
            elif abs(derivative.value) <= derivative.error:
                none.append(short[path])
                continue
            elif abs(share) > _WEAK:
                worst = max(worst, derivative.error / abs(derivative.value))
            rows.append((short[path], _slope(derivative), unit, "" if isnan(share) else f"{share:+.3g}"))
        value, about = figure(found.values[name], most=_DIGITS), FIGURES[name].about.partition(",")[0]
        title = f"{about}: {value} {found.figure_units[name]}".rstrip()
        lines = columns(rows, ("by", "derivative", "", "% for 1 % or 1 deg"))
        blocks.append([title, *_cut(lines), *_indented(f"none by {', '.join(none)}" if none else "")])
    said = [f"Relative errors of derivatives are at most {worst:.0e}."] if worst else []
    for reason, of in reasons.items():
        said.append(f"No derivative of {', '.join(of)} by {reason}.")
    return page((head, *blocks, [line for sentence in said for line in _wrapped(sentence)]))


def _known(value: float) -> float:
    return float("inf") if isnan(value) else value


def _slope(derivative: Derivative) -> str:
    if not isnan(derivative.value):
        return figure(derivative.value, derivative.error, _DIGITS)
    left, right = (
        "none" if isnan(value) else figure(value, error, 4)
        for value, error in ((derivative.left, derivative.left_error), (derivative.right, derivative.right_error))
    )
    return f"{left} | {right}"


def _told(value: float, unit: str, most: int = _DIGITS) -> str:
    """A number with as many digits; an angle in degrees, see `_unit`."""
    return figure(degrees(value) if unit == "rad" else value, most=most)


def _unit(unit: str) -> str:
    return "deg" if unit == "rad" else unit


# -- tolerances --------------------------------------------------------------------------------------------------------


def tolerance_text(found: Tolerance, names: Sequence[str] = ()) -> str:
    """What numbers vary by, what figures come to, and who causes it."""
    kept, count = shown(found.spreads, names), found.samples.shape[1]
    what = "intervals" if found.intervals else "standard deviations"
    head = [*_title(found.scene.title), *_wrapped(f"Tolerance: {what} of {_numbers(len(found.numbers))}")]
    rows = []
    for path, value in found.numbers.items():
        unit = found.units[path]
        if found.intervals:
            low, high = (_told(end, unit) for end in found.intervals[path])
            rows.append((path, f"{low} to {high}", _unit(unit)))
        else:
            rows.append((path, f"{_told(value, unit)} ± {_told(found.deviations[path], unit, 4)}", _unit(unit)))
    blocks = [[*head, *_cut(columns(rows))]]
    if found.intervals:
        blocks.append(["Least and greatest values within the intervals", *_extremes(found, kept)])
    blocks.append([f"Statistics of {count} samples, to the digits that sampling leaves", *_statistics(found, kept)])
    blocks += [_shares(found, name) for name in kept if found.spreads[name].shares]
    said = [_sentence(message) for message in found.messages]
    if found.refused:
        said.append(f"{found.refused} of {count} samples are refused and left out, such as: {found.reason}")
    return page((*blocks, [line for sentence in said for line in _wrapped(sentence)]))


def _extremes(found: Tolerance, kept: Iterable[str]) -> list[str]:
    rows = []
    for name in kept:
        spread = found.spreads[name]
        if spread.least is None or spread.greatest is None:
            continue
        value = spread.nominal
        ends = [spread.least.value, spread.greatest.value]
        changes = [end / value - 1 if value else 0.0 for end in ends]
        shares = [f"{100 * (change if abs(change) > _ROUNDING else 0.0):+.3g} %" if value else "" for change in changes]
        rows.append(
            (
                name,
                figure(value, most=_DIGITS),
                *(part for end, share in zip(ends, shares, strict=True) for part in (figure(end, most=_DIGITS), share)),
                found.figure_units[name],
            )
        )
    return _cut(columns(rows, ("", "given", "least", "", "greatest", "", "")))


def _statistics(found: Tolerance, kept: Iterable[str]) -> list[str]:
    chosen = [QUANTILES.index(q) for q in (0.01, 0.5, 0.99)]
    rows = []
    for name in kept:
        spread = found.spreads[name]
        rows.append(
            (
                name,
                figure(spread.mean, 0.5 * spread.mean_error, _DIGITS),
                figure(spread.deviation, 0.5 * spread.deviation_error, 4),
                *(_plain(spread.quantiles[k], 0.5 * spread.quantile_errors[k]) for k in chosen),
                found.figure_units[name],
            )
        )
    return _cut(columns(rows, ("", "mean", "deviation", *(f"{100 * QUANTILES[k]:g} %" for k in chosen), "")))


def _plain(value: float, error: float) -> str:
    """A number to the digits that its error leaves, without a power of ten where it would have one above 0."""
    written = figure(value, error, 5)
    return f"{float(written):.0f}" if "e+" in written and abs(value) < _LONG else written


def _shares(found: Tolerance, name: str) -> list[str]:
    shares = sorted(found.spreads[name].shares.items(), key=lambda item: -item[1].total)
    rows = [(path, *_percent(share)) for path, share in shares]
    title = f"Who causes the variance of {name}, in per cent"
    return [title, *_cut(columns(rows, ("", "by itself", "", "with others", "")))]


def _percent(share: Share) -> tuple[str, str, str, str]:
    parts = []
    for value, error in ((share.first, share.first_error), (share.total, share.total_error)):
        small = value < max(_LEAST_SHARE, error)
        parts += ["0" if small else f"{100 * value:.2f}".rstrip("0").rstrip("."), f"± {100 * error:.1g}"]
    return parts[0], parts[1], parts[2], parts[3]


# -- optima ------------------------------------------------------------------------------------------------------------


def optimum_text(found: Optimum) -> str:
    """The best design, what holds it, and what confirms it."""
    which, unit = "greatest" if found.greatest else "least", found.unit and f" {found.unit}"
    value = f"{figure(found.value, found.error, 8)}{unit}"
    before = ""
    if found.value_before is not None:
        share = found.value / found.value_before - 1.0 if found.value_before else float("nan")
        was = f"{figure(found.value_before, most=_DIGITS)}{unit}"
        before = f", with the scene's own numbers {was}" + ("" if isnan(share) else f" ({100 * share:+.3g} %)")
    head = [*_title(found.scene.title), *_wrapped(f"The {which} {found.objective}: {value}{before}")]
    rows = [
        (
            path,
            _told(value, found.units[path], 8),
            _unit(found.units[path]),
            f"{_told(low, found.units[path])} to {_told(high, found.units[path])}",
            f"at the {'lower' if found.at_bounds[path] == 'low' else 'upper'}" if path in found.at_bounds else "",
        )
        for (path, value), (low, high) in zip(found.numbers.items(), found.bounds.values(), strict=True)
    ]
    limits = [(limit.name, *_limit(limit), "binds" if limit.binds else "kept") for limit in found.limits]
    names = shown(found.figures, (*MAIN, "energy_fluctuation"))
    figures = [
        (
            FIGURES[name].about.partition(",")[0],
            figure(found.figures[name], found.errors[name], 8),
            found.figure_units[name],
        )
        for name in names
    ]
    confirmed = f"Confirmed: sized by itself it is the same, and none of {found.around} designs around it is better."
    said = [_sentence(message) for message in found.messages]
    said += [confirmed] if found.confirmed else []
    said.append(f"{found.designs} designs, {len(found.starts)} search{'es' if len(found.starts) > 1 else ''}.")
    return page(
        (
            [*head, *_cut(columns(rows, ("", "best", "", "bounds", "")))],
            ["Limits", *_cut(columns(limits))] if limits else [],
            ["The best design", *_cut(columns(figures))],
            [line for sentence in said for line in _wrapped(sentence)],
        )
    )


def _limit(limit: Limit) -> tuple[str, str, str]:
    """What a limited figure comes to, its unit, and the limits."""
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


def _wrapped(sentence: str) -> Iterator[str]:
    yield from wrap(printable(sentence), WIDTH, subsequent_indent="  ")


def _indented(sentence: str) -> list[str]:
    return wrap(printable(sentence), WIDTH, initial_indent="  ", subsequent_indent="    ")


def _cut(lines: Iterable[str]) -> list[str]:
    """Lines as wide as the terminal at most: what is beyond is for --json."""
    return [line if len(line) <= WIDTH else f"{line[: WIDTH - 1].rstrip()}…" for line in lines]


# -- the choice of a motor ---------------------------------------------------------------------------------------------

_WIDE = 20  # characters of a motor's name


def motors_text(found: SuitableMotors, rows: int = 20) -> str:
    """The motors that do, the cheapest first, in at most so many rows; then the others with their reasons."""
    count = len(found.suitable) + len(found.refused)
    title = f"Motors that do: {len(found.suitable)} of {count}"
    if found.missing:
        title += f"; INTERRUPTED, {found.missing} more were not looked at"
    lines = [title]
    if found.suitable:
        head = ("", "kW", "rpm", "ratio", "flywheel", "crank", "eps", "heat", "torque", *_currency(found))
        units = ("", "", "rated", "", "kg m²", "rpm", "", "%", "rms, %", *("" for _ in _currency(found)))
        table = [units, *(_motor_cells(choice, bool(_currency(found))) for choice in found.suitable[:rows])]
        kept = [k for k in range(len(head)) if k == 0 or any(row[k] for row in table[1:])]
        lines += columns([[row[k] for k in kept] for row in table], [head[k] for k in kept], gap=" ")
        if len(found.suitable) > rows:
            lines.append(f"  and {len(found.suitable) - rows} more (--rows)")
        lines += wrap(f"The flywheel is on {found.on}; {_bound(found)}", WIDTH, initial_indent="  ", subsequent_indent="  ")
    refused = _reasons("Motors that do not", [choice for choice in found.refused if choice.suits is False])
    left = _reasons("Left open: no steady motion was found", [choice for choice in found.refused if choice.suits is None])
    notes = [line for note in found.notes for line in wrap(f"Note: {note}", WIDTH)]
    return page([lines, refused, left, notes])


def _reasons(title: str, choices: Sequence[MotorChoice]) -> list[str]:
    """Motors with the reason why they do not do, under a title."""
    told = [f"{_short(choice.motor.name)}: {printable(choice.reason)}" for choice in choices]
    lines = [line for each in told for line in wrap(each, WIDTH, initial_indent="  ", subsequent_indent="    ")]
    return [title, *lines] if lines else []


def _bound(found: SuitableMotors) -> str:
    bound = {choice.binding for choice in found.suitable if choice.binding not in (None, "irregularity")}
    if not bound:
        return "heat and torque are shares of the rated point."
    names = ", ".join(f"{_short(c.motor.name)} by {c.binding}" for c in found.suitable if c.binding in bound)
    return f"heat and torque are shares of the rated point. Larger than for the irregularity alone: {names}."


def _short(name: str) -> str:
    told = printable(name)
    return told if len(told) <= _WIDE else f"{told[: _WIDE - 1]}…"


def _currency(found: SuitableMotors) -> list[str]:
    """The heading of the prices, if there are any."""
    priced = [choice.motor.currency for choice in found.suitable if choice.motor.price is not None]
    return [priced[0] or "price"] if priced else []


def _motor_cells(choice: MotorChoice, priced: bool) -> list[str]:
    """A motor's row."""
    rated = choice.motor.motor.rated

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
        *(cell(None if share is None else 100 * share, 3) for share in (choice.heat_share, choice.rms_torque_share)),
    ]
    return [*cells, cell(choice.motor.price, 7)] if priced else cells


def motors_csv(found: SuitableMotors) -> str:
    """The same as CSV, SI throughout, a row for each motor."""
    from csv import writer
    from io import StringIO

    rows, units = [choice.as_dict() for choice in (*found.suitable, *found.refused)], _MOTOR_UNITS
    stream = StringIO()
    lines = writer(stream, lineterminator="\n")
    if rows:
        lines.writerow([f"{name} [{units[name]}]" if name in units else name for name in rows[0]])
    for row in rows:
        lines.writerow([("1" if value else "0") if isinstance(value, bool) else value for value in row.values()])
    return stream.getvalue()


_MOTOR_UNITS = {"power": "W", "rated_speed": "rad/s", "inertia": "kg m^2", "flywheel": "kg m^2", "speed": "rad/s"}
