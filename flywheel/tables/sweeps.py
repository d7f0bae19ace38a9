"""A sweep, told on a terminal of 80 columns: what varied, the best design, a table of some, what is to be said of all."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from textwrap import wrap

import numpy as np

from flywheel.designs.figures import ALONE, FIGURES, REFINED, REFUSED, TRACED
from flywheel.designs.sweep import Sweep
from flywheel.numerics.units import aligned, columns, figure
from flywheel.tables.rows import Row, page, printable

WIDTH = 80
_DIGITS = 6
_REASONS = 4
_IN_TABLE = ("exact", "approximate", "irregularity", "power", "balance")
_OF_BEST = ("exact", "approximate", "inertia_torque", "irregularity", "speed", "balance", "power", "energy_fluctuation")
_NEAR = 1e-9  # share by which the approximate flywheel may be below the exact one


def text(found: Sweep, rows: int = 20) -> str:
    """All of it: `rows` of the designs, evenly chosen where there are more."""
    return page((_question(found), _best(found), _table(found, rows), _told("", notes(found))))


def notes(found: Sweep) -> list[str]:
    """What is to be said of a sweep, most of it for the one who relies on it, in sentences."""
    said = list(found.messages)
    kinds = {
        re.sub(r"\d[\d.e+-]*", "#", reason): reason for reason in found.reasons.values()
    }  # numbers make none of their own
    refused = Counter(re.sub(r"\d[\d.e+-]*", "#", reason) for reason in found.reasons.values())
    if refused:
        said.append(f"{sum(refused.values())} of {_designs(len(found))} are refused, with nan in their place:")
        said += [
            f"{count} x{'' if count == 1 else ', such as'} {kinds[kind]}" for kind, count in refused.most_common(_REASONS)
        ]
        if len(refused) > _REASONS:
            said.append(f"and {len(refused) - _REASONS} more reasons, in the last column of --csv")
    said += [f"{path} changes no figure of this scene" for path in _without_effect(found)]
    exact, approximate = found.values["exact"], found.values["approximate"]
    below = np.flatnonzero(exact - approximate > _NEAR * np.abs(exact))
    if below.size:
        share = (exact[below] - approximate[below]) / exact[below]
        k = int(share.argmax())
        said.append(
            f"DANGER: the approximate flywheel is below the exact one in {_designs(below.size)}, "
            f"by up to {figure(100 * float(share[k]), most=3)} % (design {below[k]})"
        )
    check = found.check
    if check is not None and not check.failed:
        were = "was" if len(check.designs) == 1 else "were"
        said.append(
            f"{_designs(len(check.designs))} {were} sized by size as well, at random and where estimates are largest: "
            f"figures differ by {figure(check.ratio, most=2)} of the sum of both estimates at most"
        )
    return said


def _without_effect(found: Sweep) -> list[str]:
    """The numbers that vary, in a grid, while every figure stays as it is."""
    if len(found.shape) != len(found.columns) or not np.isfinite(found.worst).any():
        return []
    idle = []
    for axis, (path, column) in enumerate(found.columns.items()):
        rows = [found.values[name].astype(float).reshape(found.shape) for name in found.names]
        apart = [np.fmax.reduce(row, axis=axis) - np.fmin.reduce(row, axis=axis) for row in rows]
        size = [np.fmax.reduce(np.abs(row), axis=None) for row in rows]
        moved = any((each > _NEAR * most).any() for each, most in zip(apart, size, strict=True))
        if np.ptp(column) > 0.0 and not moved:
            idle.append(path)
    return idle


def _designs(count: int) -> str:
    return f"{count} design{'' if count == 1 else 's'}"


def _question(found: Sweep) -> list[str]:
    grid = f", on a grid of {' x '.join(map(str, found.shape))}" if len(found.shape) > 1 else ""
    lines = wrap(printable(found.scene.title), WIDTH) if found.scene.title else []
    lines.append(f"A sweep of {_designs(len(found))}{grid}, to a relative error of {found.rtol:g}")
    units = found.units
    ranges = []
    for path, column in found.columns.items():
        low, high = float(np.min(column)), float(np.max(column))
        words = figure(low, most=_DIGITS) + (f" to {figure(high, most=_DIGITS)}" if high > low else "")
        ranges.append(Row(path, words, units[path]))
    lines += [line[:WIDTH].rstrip() for line in columns(ranges)]
    counts = {"many at once": (TRACED,), "refined": (REFINED,), "one by one": (ALONE,), "refused": (REFUSED,)}
    ways = {words: int(np.isin(found.ways, ways).sum()) for words, ways in counts.items()}
    told = [f"{count} {words}" for words, count in ways.items() if count]
    if found.missing:
        told.append(f"{found.missing} missing")
    worst = found.worst[np.isfinite(found.worst)]
    error = f"; errors at most {worst.max():.1e}" if worst.size else ""
    return [*lines, *_wrapped(f"sized: {', '.join(told)}{error}", "  ")]


def objective(found: Sweep) -> str:
    """The figure by which designs are compared: the exact flywheel, or in an analysis the irregularity."""
    return "exact" if "exact" in found.names else "irregularity"


def _best(found: Sweep) -> list[str]:
    name = objective(found)
    if not np.isfinite(found.values[name]).any():
        return []
    k, units = found.argmin(name), found.units
    rows = [Row(path, figure(float(column[k]), most=_DIGITS), units[path]) for path, column in found.columns.items()]
    shown = [each for each in _OF_BEST if each in found.names]
    rows += [Row(FIGURES[each].about.partition(",")[0], _figure(found, each, k), units[each]) for each in shown]
    what = "flywheel" if name == "exact" else name
    among = f", of the {_designs(len(found) - found.missing)} that are not missing" if found.missing else ""
    return [f"The least {what}: design {k}{among}", *(line[:WIDTH].rstrip() for line in columns(rows))]


def _figure(found: Sweep, name: str, k: int) -> str:
    value, error = float(found.values[name][k]), float(found.error[name][k])
    if math.isnan(value):
        return ""
    return figure(value, 0.0 if math.isnan(error) else error * abs(value), _DIGITS)


def _table(found: Sweep, rows: int) -> list[str]:
    count = len(found)
    chosen = list(range(count)) if count <= rows else sorted({k * (count - 1) // (rows - 1) for k in range(rows)})
    if not chosen or rows < 2:
        return []
    units, short = found.units, short_names(found.columns)
    names = [name for name in _IN_TABLE if name in found.names]
    cells = {"": [str(k) for k in chosen]}
    heads = {"": ("", "")}
    for path, column in found.columns.items():
        cells[path] = [figure(float(column[k]), most=_DIGITS) for k in chosen]
        heads[path] = short[path], units[path]
    for name in names:
        cells[name] = [_figure(found, name, k) for k in chosen]
        heads[name] = name, units[name]
    if np.isfinite(found.worst[chosen]).any():
        heads["error"] = "error", ""
        cells["error"] = ["" if math.isnan(found.worst[k]) else f"{found.worst[k]:.0e}" for k in chosen]
    blocks: list[list[str]] = []
    width = -2
    order = [*names[:1], *found.columns, *names[1:2], *(["error"] if "error" in cells else []), *names[2:]]
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
    """The columns that a line has room for, those that matter most first, in the order of the table."""
    room, chosen = WIDTH, {""}
    room -= max(len(cell) for cell in cells[""])
    for key in order:
        wide = 2 + max(map(len, [*heads[key], *aligned(cells[key])]))
        if wide <= room:
            room -= wide
            chosen.add(key)
    return [key for key in cells if key in chosen]


def short_names(paths: Iterable[str]) -> dict[str, str]:
    """Paths by their last parts, as many as tell them apart.

    >>> short_names(["mechanism.crank.length", "mechanism.rod.length"])
    {'mechanism.crank.length': 'crank.length', 'mechanism.rod.length': 'rod.length'}
    """
    found = {}
    every = list(paths)
    for path in every:
        parts = path.split(".")
        for count in range(min(2, len(parts)), len(parts) + 1):
            name = ".".join(parts[-count:])
            same = [other for other in every if other == name or other.endswith(f".{name}")]
            if len(same) == 1 and not name[0].isdigit():
                break
        found[path] = name
    return found


def _told(title: str, said: Iterable[str]) -> list[str]:
    return [*([title] if title else []), *(line for sentence in said for line in _wrapped(sentence, ""))]


def _wrapped(sentence: str, indent: str) -> Iterator[str]:
    yield from wrap(printable(sentence), WIDTH, initial_indent=indent, subsequent_indent=f"{indent}  ")
