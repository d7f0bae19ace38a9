"""The best design: numbers of a scene within bounds that make a figure least, or greatest, while others keep their limits.

Quasi-random designs first, then searches from the best of them (`flywheel.numerics.optima`); the best of all is sized by
itself, designs around it must not be better, and slopes around it must show no descent. The wheel keeps its allowable
stress, and the messages of `size` on the design are those of the optimum.

Whole numbers, materials, motors: each combination of the values to choose from has its own searches, so that none is missed.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from math import inf, isfinite, prod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.files import replacement
from flywheel.designs.figures import ENGINES, digest, each_of, figures_of, own_version
from flywheel.designs.variation import BY_NAME, NAMES, WITHOUT, Array, Variation, limits_of, quantity
from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics import notebook
from flywheel.numerics.expressions import Expression, ExpressionError, parse
from flywheel.numerics.faults import Fault, SceneError, brief, refuse, require, show, suggestion
from flywheel.numerics.optima import KEPT, STATIONARY, descent, merit, minimum, unit_points
from flywheel.numerics.units import figure
from flywheel.reading.paths import by_path, dotted, numbers, with_numbers
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

__all__ = ["Alternative", "KeptLimit", "Optimum", "SearchCourse", "optimize"]

_RTOL = 1e-11
_SAMPLES, _STARTS = 64, 4
_DISTANCE = 0.1  # of the bounds: starts that are no closer
_ASIDE = (1e-4, 1e-3, 1e-2, 0.1)  # of the bounds: designs beside the best one
_SCATTERED = 32
_GAIN = 1e-9  # relative: what a design must be better by to count
_RESTARTS = 3  # times that a better design around the best one starts another search
_AT_BOUND = 1e-8  # of the bounds: what counts as there
_VALUE_TIE = 1e-6  # relative: values of optima that are one
_GAIN_ROUNDING = 1e-12
_SLOPE_LIMIT = 5 * STATIONARY  # from which on a design is no optimum
_SLOPE_PER_ERROR = 2e7  # more of it by the figures' errors
_MOST_COMBINATIONS = 10_000
_REASONS = 3  # of refused designs that are given
_DIGITS = re.compile(r"\d[\d.e+-]*")
_NOISE_LIMIT, _STEP_BACK = 1e-2, 1e-5  # slope at most that errors may explain; of the bounds: a step back from one
_UTILISATION, _STRESS = "wheel.utilisation", "wheel.stress"
_NAME = re.compile(r"[A-Za-z_][\w]*(?:\.\w+)*")


class KeptLimit(NamedTuple):
    """A figure kept between `low` and `high` (SI; None: open), its value, and the end that binds.

    `implied`: the wheel's allowable stress, which is always kept.
    """

    name: str
    low: float | None
    high: float | None
    unit: str
    value: float
    binds: str = ""
    implied: bool = False

    @property
    def text(self) -> str:
        """`power <= 5000 W`."""
        unit = self.unit and f" {self.unit}"
        low = "" if self.low is None else f"{figure(self.low, most=6)}{unit} <= "
        return f"{low}{self.name}" + ("" if self.high is None else f" <= {figure(self.high, most=6)}{unit}")


class SearchCourse(NamedTuple):
    """The designs of the searches in order: numbers (paths, designs), figure, mask of kept limits, the search."""

    numbers: Array
    values: Array
    kept: NDArray[np.bool_]
    search: NDArray[np.int64]


class Alternative(NamedTuple):
    """The best design with one combination of choices: their texts by path, figure (None without a design) or reason."""

    choices: dict[str, str]
    value: float | None
    reason: str = ""


@dataclass(frozen=True, repr=False, eq=False)
class Optimum:
    """The best design within bounds (SI).

    `value` is that of `objective` with its absolute `error`; `numbers` are those of the design, `at_bounds` those at an end;
    `figures` all figures of it, `sizing` the design sized by itself, as `flywheel.size` does. `confirmed` is true if this
    agrees, none of the `around` designs beside it is better, and separate slopes show no descent; `descent` is the steepest
    they show (change as a share of the figure per share of the bounds). `starts` are the searches' ends, `refused` counts
    designs within the bounds that are no machines, by reason, `messages` those of the search, then those of the design's
    sizing. If the user `interrupted` the search, it is the best design until then, and not confirmed. `choices` are the
    values chosen, as texts, and `alternatives` all combinations of them, the best first.
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
    limits: tuple[KeptLimit, ...]
    figures: dict[str, float]
    errors: dict[str, float]
    figure_units: dict[str, str]
    sizing: Sizing
    confirmed: bool
    around: int
    descent: float
    starts: tuple[float, ...]
    course: SearchCourse
    refused: dict[str, int]
    messages: tuple[str, ...]
    designs: int
    interrupted: bool = False
    choices: Mapping[str, str] = field(default_factory=dict)
    alternatives: tuple[Alternative, ...] = ()

    def __repr__(self) -> str:
        """Objective, its value, and the numbers."""
        which = "greatest" if self.greatest else "least"
        return f"Optimum({notebook.quoted(self.scene.title)}{which} {self.objective}={self.value!r}, {self.numbers})"

    @property
    def best(self) -> Scene:
        """The scene of the best design."""
        return with_numbers(self.scene, self.numbers)

    def as_dict(self) -> dict[str, Any]:
        """The optimum for JSON, SI throughout."""
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
            "descent": self.descent,
            "refused": self.refused,
            "starts": list(self.starts),
            "designs": self.designs,
            "interrupted": self.interrupted,
            "choices": dict(self.choices),
            "alternatives": [alternative._asdict() for alternative in self.alternatives],
            "messages": list(self.messages),
        }


def optimize(
    scene: Scene | Machine,
    minimize: str | None = None,
    *,
    maximize: str | None = None,
    over: Mapping[str, Any] | None = None,
    choose: Mapping[str, Any] | None = None,
    subject_to: Mapping[str, Any] | None = None,
    samples: int = _SAMPLES,
    starts: int = _STARTS,
    seed: int = 0,
    rtol: float = _RTOL,
    engine: str | None = None,
    jobs: int = 1,
    progress: bool | None = False,
    resume: str | Path | None = None,
) -> Optimum:
    """The numbers of a scene within bounds that make a figure least (or greatest) while limits are kept.

    Args:
        scene: one that was read.
        minimize: a figure by its name (`flywheel.exact`, `flywheel.mass`, `power`), or an expression of several and of
            numbers of the scene (`mass + 0.009*drive.motor.power`).
        maximize: the same, to be made greatest.
        over: of each path the bounds (low, high); SI, or texts with units.
        choose: of each path the values to choose from, in a list, or by their names in a mapping: whole numbers, texts or
            tables of the scene. Every combination is searched by itself.
        subject_to: of figures or expressions the limits (low, high), None if open. The allowable stress of a wheel in the
            scene is always kept.
        samples: quasi-random designs among which searches begin, a power of two.
        starts: number of searches.
        seed: of the designs.
        rtol: required relative error of the figures.
        engine: as of a sweep.
        jobs: number of worker processes among which the combinations are divided.
        progress: true to show a bar of them on standard error; default: if that is a terminal.
        resume: a file in which finished combinations are kept: the same search continues from them.

    Raises:
        SceneError: for a missing path or figure, invalid bounds, no valid design, a file of another search, and limits that
            no design keeps, with the best design found.

    >>> import flywheel
    >>> rotor = {"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "90 deg"}], "regime": {"speed": 30},
    ...          "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.01}}
    >>> best = flywheel.optimize(flywheel.load(rotor), maximize="energy_fluctuation", over={"load.0.to": (1.0, 5.0)})
    >>> round(best.numbers["load.0.to"], 4), round(best.value, 6), best.confirmed  # half a turn, 100 N m pi/2
    (3.1416, 157.079633, True)

    """
    scene = scene_of(scene)
    if (minimize is None) == (maximize is None):
        request = "nothing to minimize" if minimize is None else "minimize together with maximize"
        raise SceneError([Fault("minimize", request, "one figure, to minimize or to maximize")])
    aim, objective = ("minimize", minimize) if maximize is None else ("maximize", maximize)
    require("over", over or {}, Mapping, "paths of numbers, each with its bounds (low, high)")
    combinations = combinations_of(choose or {})
    search = partial(
        best_design,
        aim=aim,
        objective=objective,
        over=by_path(over or {}),
        limits=subject_to or {},
        samples=samples,
        starts=starts,
        seed=seed,
        rtol=rtol,
        engine=engine,
        fixed=bool(combinations),
    )
    if not combinations:
        return search(scene)
    journal = None if resume is None else _Journal(Path(resume), scene, search.keywords)
    earlier = {} if journal is None else journal.read()
    left = [(names, values) for names, values in combinations if tuple(names.items()) not in earlier]
    add = (lambda alternative: None) if journal is None else journal.add
    alternatives = [*earlier.values()]
    alternatives += each_of(partial(_alternative, scene, search), left, jobs, progress, "combinations", add)
    if not alternatives:
        raise KeyboardInterrupt
    sign = 1.0 if maximize is None else -1.0
    alternatives.sort(key=lambda one: inf if one.value is None else sign * one.value)  # those without a design last
    choices, values = next(each for each in combinations if each[0] == alternatives[0].choices)
    optimum = search(scene.with_(values))  # where no combination has a design, it is refused here
    missing = len(combinations) - len(alternatives)
    said = (f"interrupted: {missing} of {len(combinations)} combinations were not searched",) if missing else ()
    return replace(
        optimum,
        choices=choices,
        alternatives=tuple(alternatives),
        interrupted=optimum.interrupted or bool(missing),
        confirmed=optimum.confirmed and not missing,
        messages=(*said, *optimum.messages),
    )


class _Journal:
    """The alternatives of a search among combinations in a file: a line of JSON for each, below one for the search."""

    def __init__(self, file: Path, scene: Scene, options: Mapping[str, Any]) -> None:
        head = {"flywheel_optimum": own_version(), "scene": digest(scene), **options}
        self.file, self.head = file, json.dumps(head, sort_keys=True, default=str)

    def read(self) -> dict[tuple[tuple[str, str], ...], Alternative]:
        """The alternatives in the file, by their choices; SceneError if it belongs to another search."""
        text = self.file.read_text(encoding="utf-8", errors="replace") if self.file.exists() else self.head + "\n"
        head, *whole = text[: text.rfind("\n") + 1].splitlines() or [text]  # a line that was not finished has no end
        try:
            alternatives = [Alternative(*json.loads(line)) for line in whole] if head == self.head else None
        except (ValueError, TypeError):
            alternatives = None
        if alternatives is None:
            other, advice = "a file of another search", "give another file, or remove this one"
            raise SceneError([Fault(str(self.file), other, "one of this scene, with these options", advice)])
        with replacement(self.file, "text") as fresh:
            fresh.write_text("\n".join([head, *whole, ""]), encoding="utf-8")
        return {tuple(alternative.choices.items()): alternative for alternative in alternatives}

    def add(self, alternative: Alternative) -> None:
        """Writes an alternative at the end of the file."""
        with self.file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(alternative) + "\n")


Combination = tuple[dict[str, str], dict[str, Any]]
"""Values to choose, by path: their names, and themselves."""


def combinations_of(choose: Mapping[str, Any]) -> list[Combination]:
    """All combinations of values to choose from, the last path varying fastest."""
    require("choose", choose, Mapping, "paths, each with the values to choose from")
    named, faults = dict[str, dict[str, Any]](), list[Fault]()
    for path, values in by_path(choose).items():
        if isinstance(values, str) or not isinstance(values, Collection) or not len(values):
            faults.append(Fault(path, show(values) if values else "nothing", "a list of values to choose from"))
        else:
            named[path] = dict(values) if isinstance(values, Mapping) else {str(value): value for value in values}
    if (count := prod(map(len, named.values()))) > _MOST_COMBINATIONS:
        faults.append(Fault("choose", f"{count} combinations", f"at most {_MOST_COMBINATIONS}"))
    refuse(faults)
    if not named:
        return []
    every = product(*(values.items() for values in named.values()))
    combinations = []
    for items in every:
        names, values = zip(*items, strict=True)
        combinations.append((dict(zip(named, names, strict=True)), dict(zip(named, values, strict=True))))
    return combinations


def _alternative(scene: Scene, search: Callable[[Scene], Optimum], combination: Combination) -> Alternative:
    """The best figure with a combination of choices, or the reason why there is none."""
    names, values = combination
    try:
        optimum = search(scene.with_(values))
    except SceneError as error:
        return Alternative(names, None, "; ".join(map(str, error.faults[:2])))
    if optimum.interrupted:
        raise KeyboardInterrupt
    return Alternative(names, optimum.value)


def best_design(
    scene: Scene,
    *,
    aim: str,
    objective: str | None,
    over: Mapping[str, Any],
    limits: Mapping[str, Any],
    samples: int,
    starts: int,
    seed: int,
    rtol: float,
    engine: str | None,
    fixed: bool,
) -> Optimum:
    """The best design over numbers within bounds, for one combination of choices."""
    family = Variation(scene, over, rtol, engine if over else ENGINES[-1], fixed=fixed)
    problem = _Optimization(family, aim, objective, _bounds(family, over), limits)
    ends = list[Array]()
    if not over:  # one design
        formulas = problem.objective, *(limit.formula for limit in problem.constraints)
        own = family.centre()
        family.there(own, [name for formula in formulas for name in formula.figures()])
        problem.record(np.empty((0, 1)), np.array([[figures_of(own)[name][0]] for name in NAMES]))
        return _optimum(problem, _best(problem, ends), ends, 0)
    try:
        surveyed = _survey(problem, samples, seed)
        for start in _starts(problem, surveyed, max(starts, 1)):
            problem.search += 1
            ends.append(problem.minimum(start))
        best = _best(problem, ends)
        best, better = _around(problem, best, seed)
        return _optimum(problem, best, ends, better)
    except KeyboardInterrupt:
        if not any(np.isfinite(row).all() for _, row, _ in problem.points):
            raise
        best, row = problem.best()
        kept = "" if (row[1:] <= KEPT).all() else ", which does not keep all limits"
        said = f"interrupted: the best of the designs so far, not confirmed{kept}"
        return _optimum(problem, best, ends, 0, said)


class FigureFormula:
    """A figure, or an expression of figures and of numbers of the scene, some of which vary."""

    def __init__(self, family: Variation, text: object, path: str) -> None:
        self.text, self.names = dotted(text) if isinstance(text, str) else "", dict[str, str]()
        if self.text in BY_NAME:
            self.title = self.text
            self.figure: str | None = BY_NAME[self.text]
            self.unit = family.unit(BY_NAME[self.text])
            return
        self.figure, self.unit, self.title = None, "", self.text
        names = {**{name: name for name in BY_NAME}, **{number: number for number in family.paths}}
        self.fixed = {each: number.value for each, number in numbers(family.scene).items() if each not in names}
        words = [word for word in _NAME.findall(self.text) if word in names or word in self.fixed]
        if not any(word in names for word in words):
            self._refuse(path, text, names)
        self.names = {word: f"n{k}" for k, word in enumerate(dict.fromkeys(words))}
        plain = _NAME.sub(lambda match: self.names.get(match.group(), match.group()), self.text)
        try:
            self.expression: Expression = parse(plain, frozenset(self.names.values()))
        except ExpressionError as error:
            for word in _NAME.findall(self.text):
                if word in error.defect and word not in names:
                    self._refuse(path, word, names)
            what = "an expression of figures, and of numbers of the scene"
            raise SceneError([Fault(path, show(self.text), what, f"{error.defect}: expected {error.expected}")]) from None

    def _refuse(self, path: str, name: object, names: Mapping[str, str]) -> None:
        """SceneError for an unknown name, with the nearest and all valid ones."""
        near = suggestion(str(name), names)
        own = [*NAMES, *(number for number in names if number not in BY_NAME)]
        raise SceneError([Fault(path, brief(name), f"one of {', '.join(own)}", near)])

    def __call__(self, family: Variation, columns: Array, values: Array) -> Array:
        """The values at designs."""
        if self.figure is not None:
            return np.asarray(values[NAMES.index(self.figure)])
        names = self.fixed | dict(zip(family.paths, columns, strict=True))
        arguments = {
            own: names[word] if word in names else values[NAMES.index(BY_NAME[word])] for word, own in self.names.items()
        }
        return np.asarray(self.expression.evaluate(arguments, np) + np.zeros(columns.shape[1]), dtype=float)

    def figures(self) -> list[str]:
        """The figures that it needs."""
        return [self.figure] if self.figure is not None else [BY_NAME[word] for word in self.names if word in BY_NAME]


class _Constraint(NamedTuple):
    """A formula between limits, in SI."""

    formula: FigureFormula
    low: float | None
    high: float | None
    implied: bool = False

    @property
    def size(self) -> float:
        """Scale for a violation of the limit."""
        return max(abs(self.low or 0.0), abs(self.high or 0.0)) or 1.0


class _Optimization:
    """Problem of an optimum: objective, numbers, limits, and all designs that were tried."""

    def __init__(self, family: Variation, aim: str, objective: str | None, bounds: Array, limits: Mapping[str, Any]) -> None:
        self.family, self.greatest = family, aim == "maximize"
        self.low, self.high = bounds
        self.objective = FigureFormula(family, objective, aim)
        require("subject_to", limits, Mapping, "figures, each with its limits (low, high)")
        self.constraints = [_constraint(family, name, pair) for name, pair in limits.items()]
        wheel = family.scene.wheel
        if wheel is not None and wheel.material.allowable is not None:
            self.constraints.append(_Constraint(FigureFormula(family, _UTILISATION, "subject_to"), None, 1.0, implied=True))
        self.search = 0
        self.points: list[tuple[Array, Array, int]] = []

    def rows(self, columns: Array) -> Array:
        """The objective, to be least, and breaches of limits relative to them; NaN if a design is refused."""
        try:
            values, _ = self.family(columns)
        except KeyboardInterrupt:
            if self.family.finished:
                done, values, _ = self.family.finished
                self.record(columns[:, done], values[:, done])
            raise
        return self.record(columns, values)

    def record(self, columns: Array, values: Array) -> Array:
        """The rows of designs whose figures are known, which are kept."""
        objective = self.objective(self.family, columns, values)
        rows = [-objective if self.greatest else objective]
        for limit in self.constraints:
            value = limit.formula(self.family, columns, values)
            if limit.high is not None:
                rows.append((value - limit.high) / limit.size)
            if limit.low is not None:
                rows.append(np.where(value == inf, -1.0, (limit.low - value) / limit.size))  # safe without a wheel
        result = np.array(rows)
        result[~np.isfinite(result)] = np.nan
        inside = (columns >= self.low[:, None]).all(axis=0) & (columns <= self.high[:, None]).all(axis=0)
        self.points += [(columns[:, k], result[:, k], self.search) for k in np.flatnonzero(inside)]
        return result

    def minimum(self, start: Array, rows: Callable[[Array], Array] | None = None) -> Array:
        """End point of a search from a start."""
        return minimum(rows or self.rows, start, self.low, self.high, self.family.scales)

    def best(self) -> tuple[Array, Array]:
        """The best design of all that were tried, and its rows."""
        rows = np.array([row for _, row, _ in self.points]).T
        k = int(np.argmin(merit(rows, self.size(rows))))
        return self.points[k][0], rows[:, k]

    def descent(self, best: Array) -> float:
        """Steepest slope of the objective from a design, within bounds and limits."""
        return descent(self.rows, best, self.low, self.high)

    def gain(self, best: Array, i: int) -> float:
        """Increase of the objective by a step back from a bound of the i-th number; 0 if it changes nothing."""
        moved = best.copy()
        width = self.high[i] - self.low[i]
        moved[i] += _STEP_BACK * width if best[i] - self.low[i] < self.high[i] - best[i] else -_STEP_BACK * width
        own, other = merit(self.rows(np.array([best, moved]).T), 1.0)
        return 0.0 if abs(other - own) <= _GAIN_ROUNDING * max(abs(own), _GAIN_ROUNDING) else float(other - own)

    @property
    def refused(self) -> dict[str, int]:
        """Numbers of designs refused for a reason of each kind, the most frequent first: numbers make no kind."""
        kinds, example = Counter[str](), dict[str, str]()
        for point, row, _ in self.points:
            if np.isnan(row).any():
                reason = self.family.reasons.get(tuple(point.tolist()), "a figure has no value")
                kind = _DIGITS.sub("#", reason)
                kinds[kind] += 1
                example.setdefault(kind, reason)
        return {example[kind]: many for kind, many in kinds.most_common()}

    def size(self, rows: Array) -> float:
        """The objective's own size."""
        finite = rows[0][np.isfinite(rows[0])]
        return float(np.abs(finite).min()) or 1.0 if finite.size else 1.0


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
    return np.array(rows, float).reshape(-1, 2).T


def _constraint(family: Variation, name: str, pair: Any) -> _Constraint:
    """A limit, in SI."""
    path = f"subject_to {show(name)}"
    formula = FigureFormula(family, name, "subject_to")
    return _Constraint(formula, *limits_of(pair, formula.unit, path))


# -- searches ----------------------------------------------------------------------------------------------------------


def _survey(problem: _Optimization, samples: int, seed: int) -> Array:
    """Designs over the whole bounds, the scene's own among them; SceneError if none is valid, or has the figure."""
    family, count = problem.family, len(problem.low)
    if samples < 2 or samples & (samples - 1):
        raise SceneError([Fault("samples", brief(samples), "a power of two, 2 or more")])
    unit = unit_points("sobol", samples, count, [seed])
    columns = problem.low[:, None] + unit * (problem.high - problem.low)[:, None]
    own = np.clip(family.nominal, problem.low, problem.high)
    columns = np.concatenate([own[:, None], 0.5 * (problem.low + problem.high)[:, None], columns], axis=1)
    try:
        values, _ = family(columns)
    except KeyboardInterrupt:
        if family.finished:
            done, values, _ = family.finished
            problem.record(columns[:, done], values[:, done])
        raise
    machines = np.isfinite(values).any(axis=0)
    if not machines.any():
        why = next(iter(family.reasons.values()), "")
        raise SceneError([Fault("over", "no design within the bounds that is a machine", "one at least", why)])
    for formula in (problem.objective, *(limit.formula for limit in problem.constraints)):
        for name in formula.figures():
            if not np.isfinite(values[NAMES.index(name), machines]).any():
                own_figures = [other for other, row in zip(NAMES, values, strict=True) if np.isfinite(row).any()]
                expected = f"one of {', '.join(own_figures)}"
                raise SceneError([Fault(name, "no figure of this scene", expected, WITHOUT.get(name, ""))])
    rows = problem.record(columns, values)
    if not np.isfinite(rows).all(axis=0).any():
        raise SceneError([Fault("over", "no design within the bounds that has all figures", "one at least")])
    return rows


def _starts(problem: _Optimization, rows: Array, many: int) -> list[Array]:
    """The best designs of a survey at some distance from one another."""
    width, chosen = problem.high - problem.low, list[Array]()
    order = np.argsort(merit(rows, problem.size(rows)), kind="stable")
    for k in order:
        point = problem.points[k][0]
        if np.isfinite(rows[:, k]).all() and all(np.abs((point - other) / width).max() > _DISTANCE for other in chosen):
            chosen.append(point)
        if len(chosen) == many:
            break
    return chosen


def _best(problem: _Optimization, ends: list[Array]) -> Array:
    """The best of all designs; SceneError if none keeps the limits, with the closest one."""
    best, row = problem.best()
    if (row[1:] <= KEPT).all():
        return best

    def breach(columns: Array) -> Array:
        rows = problem.rows(columns)
        return np.where(np.isnan(rows).any(axis=0), np.nan, rows[1:].max(axis=0))[None]

    if best.size:
        ends.append(problem.minimum(best, breach))
        best, row = problem.best()
        if (row[1:] <= KEPT).all():
            return problem.minimum(best)
    nearest = min(problem.points, key=lambda point: np.nan_to_num(point[1][1:], nan=np.inf).max())
    column = nearest[0][:, None]
    values, _ = problem.family(column)
    pairs = zip(problem.family.paths, nearest[0].tolist(), strict=True)
    where = ", ".join(f"{path} = {figure(value, most=6)}{_unit(problem.family, path)}" for path, value in pairs)
    faults = []
    for limited in problem.constraints:
        value = float(limited.formula(problem.family, column, values)[0])
        over = limited.high is not None and value > limited.high + KEPT * limited.size
        if over or (limited.low is not None and value < limited.low - KEPT * limited.size):
            limit = _limit(problem, limited, nearest[0], values)
            unit = limit.unit and f" {limit.unit}"
            nearest_value = f"{figure(limit.value, most=6)}{unit} at the best{where and f', where {where}'}"
            advice = "widen bounds, or take another material or shape" if limited.implied else "widen bounds, or the limit"
            faults.append(Fault(f"subject_to {limit.name}", nearest_value, limit.text, advice))
    raise SceneError(faults)


def _around(problem: _Optimization, best: Array, seed: int) -> tuple[Array, int]:
    """The best design once none around it is better, and the number of better ones left."""
    random = np.random.default_rng([seed, 1])
    width, count, better = problem.high - problem.low, len(best), 0
    for again in range(_RESTARTS):
        best, row = problem.best()
        at = [best + sign * share * width * np.eye(count)[i] for i in range(count) for share in _ASIDE for sign in (-1, 1)]
        at += [best + _ASIDE[2] * width * random.uniform(-1.0, 1.0, count) for _ in range(_SCATTERED)]
        columns = np.clip(np.array(at).T, problem.low[:, None], problem.high[:, None])
        rows = problem.rows(columns)
        size = max(abs(row[0]), _GAIN_ROUNDING)
        kept = (rows[1:] <= KEPT).all(axis=0)
        better = int((kept & (rows[0] < row[0] - _GAIN * size)).sum())
        if not better:
            break
        if again + 1 < _RESTARTS:
            problem.minimum(problem.best()[0])
    return problem.best()[0] if not better else best, better


# -- what is found -----------------------------------------------------------------------------------------------------


def _optimum(problem: _Optimization, best: Array, ends: list[Array], better: int, interrupted: str = "") -> Optimum:
    """The record of the best design; `interrupted` describes the progress of searches that the user ended."""
    family, sign = problem.family, -1.0 if problem.greatest else 1.0
    best = best if interrupted else _at_ends(problem, best)
    sizing = size(with_numbers(family.scene, dict(zip(family.paths, best.tolist(), strict=True))))
    values, errors = family(best[:, None])
    alone = figures_of(sizing)
    value = float(problem.objective(family, best[:, None], values)[0])
    finite = {name: k for k, name in enumerate(NAMES) if isfinite(values[k, 0])}
    error = _error(problem.objective, family, best, values, errors)
    agree = all(
        abs(alone[name][0] - values[finite[name], 0]) <= 2 * errors[finite[name], 0] + _GAIN * abs(values[finite[name], 0])
        for name in problem.objective.figures()
    )
    slope, noise = problem.descent(best) if best.size else 0.0, error / max(abs(value), 1e-300)
    stationary = slope <= _SLOPE_LIMIT + min(_SLOPE_PER_ERROR * noise, _NOISE_LIMIT)
    rows = np.array([row for _, row, _ in problem.points]).T
    reached = tuple(sign * float(problem.rows(end[:, None])[0, 0]) for end in ends)
    width = problem.high - problem.low
    at_bounds = {
        path: "low" if x - low < high - x else "high"
        for path, x, low, high, w in zip(family.paths, best, problem.low, problem.high, width, strict=True)
        if min(x - low, high - x) <= _AT_BOUND * w
    }
    limits = tuple(_limit(problem, limit, best, values) for limit in problem.constraints)
    own: float | None = None
    if (
        best.size
        and len(problem.points)
        and np.array_equal(problem.points[0][0], family.nominal)
        and isfinite(problem.points[0][1][0])
    ):
        own = sign * float(problem.points[0][1][0])
    course = SearchCourse(
        np.array([point for point, _, _ in problem.points]).T,
        sign * rows[0],
        np.asarray((rows[1:] <= KEPT).all(axis=0) & np.isfinite(rows[0])),
        np.array([search for _, _, search in problem.points]),
    )
    refused, said = problem.refused, [interrupted] if interrupted else []
    if best.size and not interrupted:
        doubts = _doubts(problem, reached, better, agree=agree, slope=0.0 if stationary else slope)
        said = [*_messages(problem, best, at_bounds, limits, rows), *doubts]
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
        figures={name: float(values[k, 0]) for name, k in finite.items()},
        errors={name: float(errors[k, 0]) for name, k in finite.items()},
        figure_units={name: family.unit(name) for name in finite},
        sizing=sizing,
        confirmed=agree and stationary and not better and not interrupted,
        around=2 * len(_ASIDE) * len(best) + _SCATTERED if best.size else 0,
        descent=slope,
        starts=reached,
        course=course,
        refused=refused,
        messages=(*said, *_refusals(problem), *family.said, *sizing.messages),
        designs=family.count,
        interrupted=bool(interrupted),
    )


def _at_ends(problem: _Optimization, best: Array) -> Array:
    """The design with numbers within rounding of a bound set to the bound, unless that makes it worse."""
    width = problem.high - problem.low
    moved = np.where(best - problem.low <= 1e-6 * width, problem.low, best)
    moved = np.where(problem.high - moved <= 1e-6 * width, problem.high, moved)
    if np.array_equal(moved, best):
        return best
    rows = problem.rows(np.array([best, moved]).T)
    own, other = merit(rows, max(abs(rows[0, 0]), _GAIN_ROUNDING))
    return moved if other <= own + _GAIN * abs(own) else best


def _error(formula: FigureFormula, family: Variation, best: Array, values: Array, errors: Array) -> float:
    """The error of a formula: the sum of those of its figures."""
    at = best[:, None]
    middle, total = float(formula(family, at, values)[0]), 0.0
    for name in set(formula.figures()):
        k = NAMES.index(name)
        moved = values.copy()
        moved[k] += errors[k]
        total += abs(float(formula(family, at, moved)[0]) - middle)
    return total


def _limit(problem: _Optimization, limited: _Constraint, best: Array, values: Array) -> KeptLimit:
    """A limit as a design keeps it; the allowable stress of the wheel as a stress."""
    value = float(limited.formula(problem.family, best[:, None], values)[0])
    close = 1e-7 * limited.size
    if limited.implied:
        scene = with_numbers(problem.family.scene, dict(zip(problem.family.paths, best.tolist(), strict=True)))
        assert scene.wheel is not None
        stress = float(values[NAMES.index(_STRESS), 0])
        binds = "high" if value >= 1.0 - close else ""
        return KeptLimit(_STRESS, None, scene.wheel.material.allowable, "Pa", stress, binds, implied=True)
    binds = "high" if limited.high is not None and value >= limited.high - close else ""
    binds = "low" if limited.low is not None and value <= limited.low + close else binds
    return KeptLimit(limited.formula.title, limited.low, limited.high, limited.formula.unit, value, binds)


def _messages(
    problem: _Optimization,
    best: Array,
    at_bounds: Mapping[str, str],
    limits: tuple[KeptLimit, ...],
    rows: Array,
) -> Iterator[str]:
    """Messages on an optimum: the bounds and limits that hold it."""
    family, name = problem.family, problem.objective.title
    finite = rows[0][np.isfinite(rows[0])]
    if np.ptp(finite) <= _GAIN * max(np.abs(finite).max(), 1e-300):
        yield f"no optimum: {name} is the same for all designs, whatever {' and '.join(family.paths)}"
        return
    further = "rises" if problem.greatest else "falls"
    for path, end in at_bounds.items():
        side, i = "lower" if end == "low" else "upper", family.paths.index(path)
        bound = (problem.low if end == "low" else problem.high)[i]
        gains = problem.gain(best, i)
        beyond = (
            f", beyond which {name} still {further}" if gains > 0.0 else ", where it limits nothing" if gains == 0.0 else ""
        )
        yield f"at its {side} bound: {path} = {figure(bound, most=6)}{_unit(family, path)}{beyond}"
    for limit in limits:
        if limit.implied:
            yield f"the wheel's allowable stress is kept although it was not asked for: {limit.text}"
        if limit.binds:
            yield f"at a limit: {limit.text}"
    yield from _edges(problem, best, at_bounds)


def _doubts(problem: _Optimization, reached: tuple[float, ...], better: int, *, agree: bool, slope: float) -> Iterator[str]:
    """Messages on other optima, and on checks that do not confirm this one."""
    sign = -1.0 if problem.greatest else 1.0
    value = sign * problem.best()[1][0]
    close = sum(abs(end - value) <= _VALUE_TIE * max(abs(value), 1e-300) for end in reached)
    others = sorted({float(f"{end:.4g}") for end in reached if abs(end - value) > _VALUE_TIE * max(abs(value), 1e-300)})
    if others:
        ends = ", ".join(figure(end, most=4) for end in others)
        yield f"{close} of {len(reached)} searches reached it; others ended at {ends}"
    if not agree:
        yield "not confirmed: the design sized alone differs"
    if better:
        yield f"not confirmed: {better} designs around it are still better, within what the searches reach"
    if slope:
        yield f"not confirmed: slopes show a possible improvement, of {slope:.1g} of the figure for all of the bounds"


def _refusals(problem: _Optimization) -> Iterator[str]:
    """Message on the number of designs refused within the bounds, and the reasons."""
    count = sum(problem.refused.values())
    if count:
        kinds = [f"{many} x {reason}" for reason, many in list(problem.refused.items())[:_REASONS]]
        more = f"; and {len(problem.refused) - _REASONS} more reasons" if len(problem.refused) > _REASONS else ""
        yield f"{count} of {len(problem.points)} designs within the bounds are refused: {'; '.join(kinds)}{more}"


def _edges(problem: _Optimization, best: Array, at_bounds: Mapping[str, str]) -> Iterator[str]:
    """Message if the best design is at the edge of valid designs, so that there is no best one."""
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


def _unit(family: Variation, path: str) -> str:
    unit = family.units[family.paths.index(path)]
    return unit and f" {unit}"
