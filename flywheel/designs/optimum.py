"""The best design: numbers of a scene within bounds that make a figure least, or greatest, while others keep their limits.

Quasi-random designs first, then searches from the best of them (`flywheel.numerics.optima`); the best of all is sized by
itself, and designs around it must not be better.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.designs.figures import figures_of
from flywheel.designs.variation import BY_NAME, NAMES, WITHOUT, Array, Variation, figure_name, quantity
from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics import lattices, notebook
from flywheel.numerics.arguments import refuse, require, shown
from flywheel.numerics.expressions import Expression, ExpressionError, parse
from flywheel.numerics.faults import Fault, SceneError, show
from flywheel.numerics.optima import KEPT, merit, minimum
from flywheel.numerics.units import DIMENSIONS, figure
from flywheel.reading.paths import with_numbers
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing

_RTOL = 1e-11
_SAMPLES, _STARTS = 64, 4
_APART = 0.1  # of the bounds: starts that are no closer
_AROUND = (1e-4, 1e-3, 1e-2, 0.1)  # of the bounds: designs beside the best one
_SCATTERED = 32
_BETTER = 1e-9  # relative: what a design must be better by to count
_AGAIN = 3  # times that a better design around the best one starts another search
_AT_BOUND = 1e-9  # of the bounds
_SAME = 1e-6  # relative: values of optima that are one
_FLAT = 1e-12
_NAME = re.compile(r"[A-Za-z_][\w]*(?:\.\w+)*")


class Limit(NamedTuple):
    """A figure that is held between `low` and `high` (SI; None: open), what it comes to, and which end of it binds."""

    name: str
    low: float | None
    high: float | None
    unit: str
    value: float
    binds: str = ""

    @property
    def text(self) -> str:
        """`power <= 5000 W`."""
        unit = self.unit and f" {self.unit}"
        low = "" if self.low is None else f"{figure(self.low, most=6)}{unit} <= "
        return f"{low}{self.name}" + ("" if self.high is None else f" <= {figure(self.high, most=6)}{unit}")


class Course(NamedTuple):
    """The designs of the searches in their order: numbers (paths, designs), figure, whether limits are kept, the search."""

    numbers: Array
    values: Array
    kept: NDArray[np.bool_]
    search: NDArray[np.int64]


@dataclass(frozen=True, repr=False, eq=False)
class Optimum:
    """The best design within bounds (SI).

    `value` is that of `objective` with its absolute `error`; `numbers` are those of the design, `at_bounds` which of them
    are at an end; `figures` all figures of it, `sizing` the design sized by itself. `confirmed` tells that this agrees and
    that none of the `around` designs beside it is better. `starts` are the searches' ends, `messages` what is to be said.
    """

    scene: Scene
    objective: str
    greatest: bool
    value: float
    error: float
    unit: str
    numbers: dict[str, float]
    units: dict[str, str]
    bounds: dict[str, tuple[float, float]]
    before: dict[str, float]
    value_before: float | None
    at_bounds: dict[str, str]
    limits: tuple[Limit, ...]
    figures: dict[str, float]
    errors: dict[str, float]
    figure_units: dict[str, str]
    sizing: Sizing
    confirmed: bool
    around: int
    starts: tuple[float, ...]
    course: Course
    messages: tuple[str, ...]
    designs: int

    def __repr__(self) -> str:
        """What was found."""
        which = "greatest" if self.greatest else "least"
        return f"Optimum({notebook.quoted(self.scene.title)}{which} {self.objective}={self.value!r}, {self.numbers})"

    @property
    def best(self) -> Scene:
        """The scene of the best design."""
        return with_numbers(self.scene, self.numbers)

    def as_dict(self) -> dict[str, Any]:
        """For JSON, SI throughout."""
        return {
            "title": self.scene.title,
            "objective": self.objective,
            "sense": "greatest" if self.greatest else "least",
            "value": self.value,
            "error": self.error,
            "unit": self.unit,
            "value_before": self.value_before,
            "numbers": {
                path: {
                    "value": value,
                    "unit": self.units[path],
                    "bounds": list(self.bounds[path]),
                    "before": self.before[path],
                    "at_bound": self.at_bounds.get(path),
                }
                for path, value in self.numbers.items()
            },
            "limits": [limit._asdict() for limit in self.limits],
            "figures": {
                name: {"value": value, "unit": self.figure_units[name], "error": self.errors[name]}
                for name, value in self.figures.items()
            },
            "confirmed": self.confirmed,
            "around": self.around,
            "starts": list(self.starts),
            "designs": self.designs,
            "messages": list(self.messages),
        }


def optimize(
    scene: Scene | Machine,
    minimize: str | None = None,
    *,
    maximize: str | None = None,
    over: Mapping[str, Any],
    subject_to: Mapping[str, Any] | None = None,
    samples: int = _SAMPLES,
    starts: int = _STARTS,
    seed: int = 0,
    rtol: float = _RTOL,
    engine: str | None = None,
) -> Optimum:
    """The numbers of a scene within bounds that make a figure least (or greatest) while limits are kept.

    Args:
        scene: one that was read.
        minimize: a figure by its name (`flywheel.exact`, `flywheel.mass`, `power`), or an expression of several and of the
            numbers that vary (`reduced_inertia_greatest - reduced_inertia_least`).
        maximize: the same, to be made greatest.
        over: of each path the bounds (low, high); SI, or texts with units.
        subject_to: of figures or expressions the limits (low, high), None where open.
        samples: quasi-random designs among which searches begin, a power of two.
        starts: how many searches.
        seed: of the designs.
        rtol: relative error asked of the figures.
        engine: as of a sweep.

    Raises:
        SceneError: for a path or figure that is not there, bounds that are none, no design that is a machine, and limits
            that no design keeps, with the best that was found.

    >>> import flywheel
    >>> rotor = {"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "90 deg"}], "regime": {"speed": 30},
    ...          "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.01}}
    >>> found = flywheel.optimize(flywheel.load(rotor), maximize="energy_fluctuation", over={"load.0.to": (1.0, 5.0)})
    >>> round(found.numbers["load.0.to"], 4), round(found.value, 6), found.confirmed  # half a turn, 100 N m pi/2
    (3.1416, 157.079633, True)

    """
    scene = scene_of(scene)
    if (minimize is None) == (maximize is None):
        found = "nothing to minimize" if minimize is None else "minimize beside maximize"
        raise SceneError([Fault("minimize", found, "one figure, to minimize or to maximize")])
    require("over", over, Mapping, "paths of numbers, each with its bounds (low, high)")
    family = Variation(scene, over, rtol, engine)
    aim = "minimize" if maximize is None else "maximize"
    problem = _Problem(family, aim, minimize if maximize is None else maximize, _bounds(family, over), subject_to or {})
    surveyed = _survey(problem, samples, seed)
    ends = []
    for start in _starts(problem, surveyed, max(starts, 1)):
        problem.search += 1
        ends.append(problem.minimum(start))
    best = _best(problem, ends)
    best, better = _around(problem, best, seed)
    return _optimum(problem, best, ends, better)


class _Formula:
    """A figure, or an expression of figures and of numbers that vary."""

    def __init__(self, family: Variation, text: object, path: str) -> None:
        self.text, self.names = text if isinstance(text, str) else "", dict[str, str]()
        if self.text in BY_NAME:
            self.title = self.text
            self.figure: str | None = BY_NAME[self.text]
            self.unit = family.unit(BY_NAME[self.text])
            return
        self.figure, self.unit, self.title = None, "", self.text
        known = {**{name: name for name in BY_NAME}, **{number: number for number in family.paths}}
        found = [word for word in _NAME.findall(self.text) if word in known]
        if not found:
            figure_name(path, text)  # refuses it, with the nearest
        self.names = {word: f"n{k}" for k, word in enumerate(dict.fromkeys(found))}
        plain = _NAME.sub(lambda match: self.names.get(match.group(), match.group()), self.text)
        try:
            self.expression: Expression = parse(plain, frozenset(self.names.values()))
        except ExpressionError as error:
            what = "an expression of figures, and of numbers that vary"
            raise SceneError([Fault(path, show(self.text), what, f"{error.found}: expected {error.expected}")]) from None

    def __call__(self, family: Variation, columns: Array, values: Array) -> Array:
        """Its values at designs."""
        if self.figure is not None:
            return np.asarray(values[NAMES.index(self.figure)])
        given = {
            own: columns[family.paths.index(word)] if word in family.paths else values[NAMES.index(BY_NAME[word])]
            for word, own in self.names.items()
        }
        return np.asarray(self.expression.evaluate(given, np) + 0.0 * columns[0], dtype=float)

    def figures(self) -> list[str]:
        """The figures that it needs."""
        return [self.figure] if self.figure is not None else [BY_NAME[word] for word in self.names if word in BY_NAME]


class _Held(NamedTuple):
    """A formula between limits, in SI."""

    formula: _Formula
    low: float | None
    high: float | None

    @property
    def size(self) -> float:
        """What a breach is relative to."""
        return max(abs(self.low or 0.0), abs(self.high or 0.0)) or 1.0


class _Problem:
    """What is least, over what and under which limits; all designs that were tried."""

    def __init__(self, family: Variation, aim: str, objective: str | None, bounds: Array, limits: Mapping[str, Any]) -> None:
        self.family, self.greatest = family, aim == "maximize"
        self.low, self.high = bounds
        self.objective = _Formula(family, objective, aim)
        require("subject_to", limits, Mapping, "figures, each with its limits (low, high)")
        self.held = [_held(family, name, pair) for name, pair in limits.items()]
        self.search = 0
        self.points: list[tuple[Array, Array, int]] = []

    def rows(self, columns: Array) -> Array:
        """The objective, to be least, and breaches of limits relative to them; NaN where a design is refused."""
        values, _ = self.family(columns)
        found = self.objective(self.family, columns, values)
        rows = [-found if self.greatest else found]
        for held in self.held:
            value = held.formula(self.family, columns, values)
            if held.high is not None:
                rows.append((value - held.high) / held.size)
            if held.low is not None:
                rows.append((held.low - value) / held.size)
        result = np.array(rows)
        result[~np.isfinite(result)] = np.nan
        inside = (columns >= self.low[:, None]).all(axis=0) & (columns <= self.high[:, None]).all(axis=0)
        self.points += [(columns[:, k], result[:, k], self.search) for k in np.flatnonzero(inside)]
        return result

    def minimum(self, start: Array, rows: Callable[[Array], Array] | None = None) -> Array:
        """Where a search from a start ends."""
        return minimum(rows or self.rows, start, self.low, self.high, self.family.scales)

    def best(self) -> tuple[Array, Array]:
        """The best design of all that were tried, and its rows."""
        rows = np.array([row for _, row, _ in self.points]).T
        k = int(np.argmin(merit(rows, self.size(rows))))
        return self.points[k][0], rows[:, k]

    def size(self, rows: Array) -> float:
        """The objective's own size."""
        known = rows[0][np.isfinite(rows[0])]
        return float(np.abs(known).min()) or 1.0 if known.size else 1.0


def _bounds(family: Variation, over: Mapping[str, Any]) -> Array:
    """The least and the greatest values of numbers, in SI."""
    rows, faults = [], []
    for path, dimension, pair in zip(family.paths, family.dimensions, over.values(), strict=True):
        if not isinstance(pair, (tuple, list, np.ndarray)) or len(pair) != 2 or any(end is None for end in pair):
            faults.append(Fault(path, show(pair), "two bounds (low, high)"))
            continue
        try:
            low, high = (quantity(end, dimension, path) for end in pair)
        except SceneError as error:
            faults += error.faults
            continue
        if not low < high:
            faults.append(Fault(path, f"bounds from {low:g} to {high:g}", "the lower one first"))
        rows.append((low, high))
    refuse(faults)
    return np.array(rows).T


def _held(family: Variation, name: str, pair: Any) -> _Held:
    """A limit, in SI."""
    path = f"subject_to {show(name)}"
    formula = _Formula(family, name, "subject_to")
    if not isinstance(pair, (tuple, list, np.ndarray)) or len(pair) != 2 or all(end is None for end in pair):
        raise SceneError([Fault(path, show(pair), "limits (low, high), None where one is open")])
    dimension = next((own for own, found in DIMENSIONS.items() if found.si == formula.unit), "number")
    low, high = (None if end is None else quantity(end, dimension, path) for end in pair)
    if low is not None and high is not None and low > high:
        raise SceneError([Fault(path, f"from {low:g} to {high:g}", "the lower one first")])
    return _Held(formula, low, high)


# -- searches ----------------------------------------------------------------------------------------------------------


def _survey(problem: _Problem, samples: int, seed: int) -> Array:
    """Designs all over the bounds, the scene's own among them; SceneError where none is a machine, or has the figure."""
    family, count = problem.family, len(problem.low)
    if samples < 2 or samples & (samples - 1):
        raise SceneError([Fault("samples", shown(samples), "a power of two, 2 or more")])
    unit = lattices.points(samples, count, [seed])
    columns = problem.low[:, None] + unit * (problem.high - problem.low)[:, None]
    own = np.clip(family.nominal, problem.low, problem.high)
    columns = np.concatenate([own[:, None], 0.5 * (problem.low + problem.high)[:, None], columns], axis=1)
    values, _ = family(columns)
    machines = np.isfinite(values).any(axis=0)
    if not machines.any():
        why = next(iter(family.reasons.values()), "")
        raise SceneError([Fault("over", "no design within the bounds that is a machine", "one at least", why)])
    for formula in (problem.objective, *(held.formula for held in problem.held)):
        for name in formula.figures():
            if not np.isfinite(values[NAMES.index(name), machines]).any():
                own_figures = [other for other, row in zip(NAMES, values, strict=True) if np.isfinite(row).any()]
                expected = f"one of {', '.join(own_figures)}"
                raise SceneError([Fault(name, "no figure of this scene", expected, WITHOUT.get(name, ""))])
    rows = problem.rows(columns)
    if not np.isfinite(rows).all(axis=0).any():
        raise SceneError([Fault("over", "no design within the bounds that has all figures", "one at least")])
    return rows


def _starts(problem: _Problem, rows: Array, many: int) -> list[Array]:
    """The best designs of a survey that are apart from one another."""
    width, chosen = problem.high - problem.low, list[Array]()
    order = np.argsort(merit(rows, problem.size(rows)), kind="stable")
    for k in order:
        point = problem.points[k][0]
        if np.isfinite(rows[:, k]).all() and all(np.abs((point - other) / width).max() > _APART for other in chosen):
            chosen.append(point)
        if len(chosen) == many:
            break
    return chosen


def _best(problem: _Problem, ends: list[Array]) -> Array:
    """The best of all designs; SceneError where none keeps the limits, with the one that comes nearest."""
    best, row = problem.best()
    if (row[1:] <= KEPT).all():
        return best

    def breach(columns: Array) -> Array:
        rows = problem.rows(columns)
        return np.where(np.isnan(rows).any(axis=0), np.nan, rows[1:].max(axis=0))[None]

    ends.append(problem.minimum(best, breach))
    best, row = problem.best()
    if (row[1:] <= KEPT).all():
        return problem.minimum(best)
    nearest = min(problem.points, key=lambda point: np.nan_to_num(point[1][1:], nan=np.inf).max())
    column = nearest[0][:, None]
    values, _ = problem.family(column)
    faults, numbers = [], _told(problem.family, nearest[0])
    for held in problem.held:
        value = float(held.formula(problem.family, column, values)[0])
        limit = Limit(held.formula.title, held.low, held.high, held.formula.unit, value)
        over = held.high is not None and value > held.high + KEPT * held.size
        if over or (held.low is not None and value < held.low - KEPT * held.size):
            unit = limit.unit and f" {limit.unit}"
            found = f"{figure(value, most=6)}{unit} at the best, where {numbers}"
            faults.append(Fault(f"subject_to {limit.name}", found, limit.text, "widen bounds, or the limit"))
    raise SceneError(faults)


def _around(problem: _Problem, best: Array, seed: int) -> tuple[Array, int]:
    """The best design once none around it is better, and how many better ones there still are."""
    random = np.random.default_rng([seed, 1])
    width, count, better = problem.high - problem.low, len(best), 0
    for again in range(_AGAIN):
        best, row = problem.best()
        at = [best + sign * share * width * np.eye(count)[i] for i in range(count) for share in _AROUND for sign in (-1, 1)]
        at += [best + _AROUND[2] * width * random.uniform(-1.0, 1.0, count) for _ in range(_SCATTERED)]
        columns = np.clip(np.array(at).T, problem.low[:, None], problem.high[:, None])
        rows = problem.rows(columns)
        size = max(abs(row[0]), _FLAT)
        kept = (rows[1:] <= KEPT).all(axis=0)
        better = int((kept & (rows[0] < row[0] - _BETTER * size)).sum())
        if not better:
            break
        if again + 1 < _AGAIN:
            problem.minimum(problem.best()[0])
    return problem.best()[0] if not better else best, better


# -- what is found -----------------------------------------------------------------------------------------------------


def _optimum(problem: _Problem, best: Array, ends: list[Array], better: int) -> Optimum:
    """The record of the best design."""
    family, sign = problem.family, -1.0 if problem.greatest else 1.0
    best = _at_ends(problem, best)
    sizing = family.at(best)
    values, errors = family(best[:, None])
    value = float(problem.objective(family, best[:, None], values)[0])
    known = {name: k for k, name in enumerate(NAMES) if isfinite(values[k, 0])}
    error = _error(problem.objective, family, best, values, errors)
    apart = {
        name: abs(own - values[known[name], 0])
        for name, (own, _) in figures_of(sizing).items()
        if name in known and name in problem.objective.figures()
    }
    agree = all(gap <= 2 * errors[known[name], 0] + _BETTER * abs(values[known[name], 0]) for name, gap in apart.items())
    rows = np.array([row for _, row, _ in problem.points]).T
    reached = tuple(sign * float(problem.rows(end[:, None])[0, 0]) for end in ends)
    width = problem.high - problem.low
    at_bounds = {
        path: "low" if x <= low else "high"
        for path, x, low, high, w in zip(family.paths, best, problem.low, problem.high, width, strict=True)
        if x <= low + _AT_BOUND * w or x >= high - _AT_BOUND * w
    }
    limits = tuple(_limit(problem, held, best, values) for held in problem.held)
    own: float | None = None
    if len(problem.points) and np.array_equal(problem.points[0][0], family.nominal) and isfinite(problem.points[0][1][0]):
        own = sign * float(problem.points[0][1][0])
    course = Course(
        np.array([point for point, _, _ in problem.points]).T,
        sign * rows[0],
        np.asarray((rows[1:] <= KEPT).all(axis=0) & np.isfinite(rows[0])),
        np.array([search for _, _, search in problem.points]),
    )
    return Optimum(
        scene=family.scene,
        objective=problem.objective.title,
        greatest=problem.greatest,
        value=value,
        error=error,
        unit=problem.objective.unit,
        numbers=dict(zip(family.paths, best.tolist(), strict=True)),
        units=dict(zip(family.paths, family.units, strict=True)),
        bounds={p: (a, b) for p, a, b in zip(family.paths, problem.low.tolist(), problem.high.tolist(), strict=True)},
        before=dict(zip(family.paths, family.nominal.tolist(), strict=True)),
        value_before=own,
        at_bounds=at_bounds,
        limits=limits,
        figures={name: float(values[k, 0]) for name, k in known.items()},
        errors={name: float(errors[k, 0]) for name, k in known.items()},
        figure_units={name: family.unit(name) for name in known},
        sizing=sizing,
        confirmed=agree and not better,
        around=2 * len(_AROUND) * len(best) + _SCATTERED,
        starts=reached,
        course=course,
        messages=(*_messages(problem, best, at_bounds, limits, (reached, agree, better), rows), *family.said),
        designs=family.count,
    )


def _at_ends(problem: _Problem, best: Array) -> Array:
    """The design with numbers that are at a bound but for rounding put there, unless that makes it worse."""
    width = problem.high - problem.low
    moved = np.where(best - problem.low <= 1e-6 * width, problem.low, best)
    moved = np.where(problem.high - moved <= 1e-6 * width, problem.high, moved)
    if np.array_equal(moved, best):
        return best
    rows = problem.rows(np.array([best, moved]).T)
    own, other = merit(rows, max(abs(rows[0, 0]), _FLAT))
    return moved if other <= own + _FLAT * abs(own) else best


def _error(formula: _Formula, family: Variation, best: Array, values: Array, errors: Array) -> float:
    """The error of a formula: of each figure in it as it is, added up."""
    at = best[:, None]
    middle, total = float(formula(family, at, values)[0]), 0.0
    for name in set(formula.figures()):
        k = NAMES.index(name)
        moved = values.copy()
        moved[k] += errors[k]
        total += abs(float(formula(family, at, moved)[0]) - middle)
    return total


def _limit(problem: _Problem, held: _Held, best: Array, values: Array) -> Limit:
    """A limit as the best design keeps it."""
    value = float(held.formula(problem.family, best[:, None], values)[0])
    close = 1e-7 * held.size
    binds = "high" if held.high is not None and value >= held.high - close else ""
    binds = "low" if held.low is not None and value <= held.low + close else binds
    return Limit(held.formula.title, held.low, held.high, held.formula.unit, value, binds)


def _messages(
    problem: _Problem,
    best: Array,
    at_bounds: Mapping[str, str],
    limits: tuple[Limit, ...],
    checks: tuple[tuple[float, ...], bool, int],
    rows: Array,
) -> Iterator[str]:
    """What is to be said of an optimum: bounds and limits that hold it, other optima, and what does not confirm it."""
    family, (reached, agree, better), name = problem.family, checks, problem.objective.title
    known = rows[0][np.isfinite(rows[0])]
    if np.ptp(known) <= _BETTER * max(np.abs(known).max(), 1e-300):
        yield f"no optimum: {name} is the same for all designs, whatever {' and '.join(family.paths)}"
        return
    further = "rises" if problem.greatest else "falls"
    for path, end in at_bounds.items():
        side = "lower" if end == "low" else "upper"
        bound = (problem.low if end == "low" else problem.high)[family.paths.index(path)]
        yield f"at its {side} bound: {path} = {figure(bound, most=6)}{_unit(family, path)}, beyond which {name} {further} on"
    for limit in limits:
        if limit.binds:
            yield f"held by a limit: {limit.text}"
    yield from _edges(problem, best, at_bounds)
    sign = -1.0 if problem.greatest else 1.0
    value = sign * problem.best()[1][0]
    close = sum(abs(end - value) <= _SAME * max(abs(value), 1e-300) for end in reached)
    others = sorted({float(f"{end:.4g}") for end in reached if abs(end - value) > _SAME * max(abs(value), 1e-300)})
    if others:
        ends = ", ".join(figure(end, most=4) for end in others)
        yield f"{close} of {len(reached)} searches came to it; others ended at {ends}"
    if not agree:
        yield "not confirmed: the design sized by itself differs"
    if better:
        yield f"not confirmed: {better} designs around it are still better, within what the searches reach"


def _edges(problem: _Problem, best: Array, at_bounds: Mapping[str, str]) -> Iterator[str]:
    """Whether the best design is at the edge of those that are machines, so that there is no best one."""
    family, width = problem.family, problem.high - problem.low
    for i, path in enumerate(family.paths):
        if path in at_bounds:
            continue
        for sign in (-1.0, 1.0):
            column = best.copy()
            column[i] += sign * 1e-6 * width[i]
            row = problem.rows(column[:, None])[:, 0]
            if np.isnan(row).any() and problem.low[i] <= column[i] <= problem.high[i]:
                why = family.reasons.get(tuple(column.tolist()), "a figure has no value")
                at = f"{figure(best[i], most=6)}{_unit(family, path)}"
                yield f"no optimum within the bounds: the best ends at {path} = {at}, beyond which there is none: {why}"


def _told(family: Variation, column: Array) -> str:
    """Numbers of a design in words."""
    pairs = zip(family.paths, column.tolist(), strict=True)
    return ", ".join(f"{path} = {figure(value, most=6)}{_unit(family, path)}" for path, value in pairs)


def _unit(family: Variation, path: str) -> str:
    unit = family.units[family.paths.index(path)]
    return unit and f" {unit}"
