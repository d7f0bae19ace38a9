"""Spread of a design's figures if its numbers lie within intervals, or scatter: extremes, statistics, shares of variance.

Numbers that scatter are x = m + s z, z normal. Correlated ones have z = L u with L L' the matrix of their correlations, u
independent. A number kept within limits has the part of the normal distribution between these:
z' = F⁻¹(F(a) + (F(b) - F(a)) F(z)), F the distribution of z, a and b the limits.

Shares of the variance: of first order, caused by a number alone; in total, with its interactions.

    S_i = V[E(y | x_i)]/V(y),   T_i = E[V(y | x_~i)]/V(y) = E[(y(A) - y(A_B,i))²]/(2 V)

Source: M. Jansen, Computer Physics Communications 117 (1999), 35; A. Saltelli et al., ibid. 181 (2010), 259; points of
`flywheel.numerics.optima`, whose repeats give the sampling error.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from math import factorial, isnan, sqrt
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.designs.variation import ANGLES, NAMES, Array, Variation, figure_name, figure_names, limits_of, quantity
from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics import notebook
from flywheel.numerics.faults import Fault, SceneError, brief, require
from flywheel.numerics.optima import gradient, minimum, unit_points
from flywheel.reading.paths import by_path, dotted
from flywheel.scene.scene import Scene

QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
SAMPLES = 512
_MOST_SAMPLES = 2**20
_FEWEST = 16  # samples that are worth a table where the user ends the sampling
_REPEATS = 8  # independent scramblings of the points
_MOST_CORNERS = 256
_RTOL = 1e-10
_MODEL_POINTS = 2**13  # points at which quantiles of the model are taken
_TAIL_SHARE = 2.0**-40  # of normal numbers, which would be infinite at the ends of (0, 1)
_DEVIATION_ROUNDING = 1e-10  # of a figure: a deviation that rounding makes
_UNSHARED = (
    "no shares of the variance are given: some designs are refused, and the numbers of the others are not independent"
)
_CORRELATED = "no shares of the variance are given: numbers are correlated"
_LEAST_SHARE = 1e-3  # of normal numbers within their limits
_RESIDUAL_VARIANCE = 1e-4  # of a figure's variance: what a polynomial may leave of it
_SIDES: tuple[Literal["left", "right"], ...] = ("left", "right")


class Sobol(NamedTuple):
    """Share of a figure's variance caused by one number: alone, and with others, each with its sampling error."""

    first: float
    first_error: float
    total: float
    total_error: float


class Bound(NamedTuple):
    """The least or greatest value of a figure within the intervals, its error, and the numbers (SI) there."""

    value: float
    error: float
    at: dict[str, float]


class Kept(NamedTuple):
    """The probability that a figure lies within limits (SI), None where one is open, and its sampling error."""

    low: float | None
    high: float | None
    probability: float
    error: float


class Spread(NamedTuple):
    """Spread of one figure (SI): each statistic with its sampling error, extremes where intervals are given.

    `quantiles` are those of the `Tolerance`; `least` and `greatest` only for intervals, `kept` only for a required limit.
    `shares` is empty for a figure that does not vary, and if several numbers vary and some designs are refused.
    """

    nominal: float
    mean: float
    mean_error: float
    deviation: float
    deviation_error: float
    quantiles: tuple[float, ...]
    quantile_errors: tuple[float, ...]
    shares: dict[str, Sobol]
    least: Bound | None = None
    greatest: Bound | None = None
    kept: Kept | None = None


@dataclass(frozen=True, repr=False, eq=False)
class Tolerance:
    """Spread of the figures of a design as its numbers vary.

    One of `intervals` and `deviations` is given (SI). `samples` are the numbers (paths, designs) at which figures were
    taken, `figures[name]` these; `refused` is the number of invalid ones, with `reason` for one. `messages` describe the
    sizing. If the user `interrupted` it, all results are from the designs until then. `quantiles` are the shares of designs
    below those of the spreads; `kept` is the probability that all limits are kept together, with its sampling error.
    `within` are the limits of numbers that scatter, `correlations` those of pairs of them.
    """

    scene: Scene
    numbers: dict[str, float]
    units: dict[str, str]
    intervals: dict[str, tuple[float, float]]
    deviations: dict[str, float]
    spreads: dict[str, Spread]
    figure_units: dict[str, str]
    samples: Array
    figures: dict[str, Array]
    refused: int
    reason: str
    designs: int
    messages: tuple[str, ...] = ()
    interrupted: bool = False
    quantiles: tuple[float, ...] = QUANTILES
    kept: tuple[float, float] | None = None
    within: Mapping[str, tuple[float | None, float | None]] = field(default_factory=dict)
    correlations: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Numbers of figures and of varied numbers."""
        by = f"{len(self.numbers)} {'intervals' if self.intervals else 'deviations'}"
        return f"Tolerance({notebook.quoted(self.scene.title)}{len(self.spreads)} figures by {by})"

    def __getitem__(self, figure: str) -> Spread:
        """Spread of a figure; SceneError if there is no such figure."""
        name = figure_name("figure", figure)
        if name not in self.spreads:
            raise SceneError([Fault(figure, "no figure of this scene", f"one of {', '.join(self.spreads)}")])
        return self.spreads[name]

    def as_dict(self) -> dict[str, Any]:
        """The result for JSON, SI throughout, without the samples."""
        numbers = {
            path: {
                "nominal": value,
                "unit": self.units[path],
                "interval": list(self.intervals[path]) if path in self.intervals else None,
                "deviation": self.deviations.get(path),
                "within": list(self.within[path]) if path in self.within else None,
            }
            for path, value in self.numbers.items()
        }
        figures = {
            name: {
                "unit": self.figure_units[name],
                **spread._asdict(),
                "quantiles": [
                    {"share": q, "value": value, "error": error}
                    for q, value, error in zip(self.quantiles, spread.quantiles, spread.quantile_errors, strict=True)
                ],
                "shares": {path: share._asdict() for path, share in spread.shares.items()},
                "least": spread.least and spread.least._asdict(),
                "greatest": spread.greatest and spread.greatest._asdict(),
                "kept": spread.kept and spread.kept._asdict(),
            }
            for name, spread in self.spreads.items()
        }
        for figure in figures.values():
            figure.pop("quantile_errors")
        return {
            "title": self.scene.title,
            "numbers": numbers,
            "correlations": [{"of": list(pair), "value": value} for pair, value in self.correlations.items()],
            "figures": figures,
            "samples": self.samples.shape[1],
            "designs": self.designs,
            "refused": self.refused,
            "reason": self.reason or None,
            "kept": self.kept and dict(zip(("probability", "error"), self.kept, strict=True)),
            "interrupted": self.interrupted,
            "messages": list(self.messages),
        }


def tolerance(
    scene: Scene | Machine,
    vary: Mapping[str, Any],
    *,
    figures: Iterable[str] | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
    rtol: float = _RTOL,
    engine: str | None = None,
    quantiles: Iterable[float] = QUANTILES,
    keep: Mapping[str, Any] | None = None,
    within: Mapping[str, Any] | None = None,
    correlations: Mapping[tuple[str, str], float] | None = None,
) -> Tolerance:
    """Finds the spread of a design's figures as some of its numbers lie within intervals, or scatter normally.

    Intervals: the least and the greatest value of every figure by optimisation, from quasi-random points and corners; no
    sample lies outside these. The statistics then assume uniform distributions. Deviations: mean, deviation and quantiles,
    each with the sampling error from independent repeats.

    Args:
        scene: one that was read.
        vary: of each path the interval (low, high), or the standard deviation about the scene's own value; SI, or texts with
            units. All of one kind.
        figures: by their names, all if None.
        samples: points, a power of two, at least 64; the shares need that times the number of paths plus 2.
        seed: of the points.
        rtol: required relative error of the figures.
        engine: as of a sweep.
        quantiles: shares of designs, between 0 and 1.
        keep: limits (low, high) of figures, by their names, None where one is open; SI, or texts with units. The result
            has the probability that each is kept, and all together.
        within: limits (low, high) of numbers that scatter, by their paths, None where one is open: parts beyond them are
            sorted out.
        correlations: of pairs of numbers that scatter, between -1 and 1; of their normal numbers where they have limits.

    Raises:
        SceneError: if the scene itself is refused, a number or figure does not exist, or an interval or a limit is not
        valid.

    >>> import flywheel
    >>> rotor = {"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}], "regime": {"speed": 30},
    ...          "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.01}}
    >>> power = flywheel.tolerance(flywheel.load(rotor), {"regime.speed": (29, 31)}, samples=64)["power"]
    >>> round(power.least.value, 6), round(power.greatest.value, 6), round(power.mean)
    (1450.0, 1550.0, 1500)

    """
    scene = scene_of(scene)
    require("vary", vary, Mapping, "paths, each with (low, high) or a standard deviation")
    vary = by_path(vary)
    family = Variation(scene, vary, rtol, engine)
    intervals, deviations = _ranges(family, vary)
    scatter = _scatter(family, deviations, within or {}, correlations or {})
    if not 64 <= samples <= _MOST_SAMPLES or samples & (samples - 1):
        raise SceneError([Fault("samples", brief(samples), f"a power of two from 64 to {_MOST_SAMPLES}")])
    levels = tuple(quantiles)
    if wrong := [q for q in levels if not 0.0 < q < 1.0]:
        raise SceneError([Fault("quantiles", brief(wrong[0]), "a share above 0 and below 1")])
    centre, kept_names = family.centre(), {f"keep {name}": figure_name(f"keep {name}", name) for name in keep or {}}
    names = None if figures is None else list(dict.fromkeys((*figure_names(figures), *kept_names.values())))
    chosen = [NAMES.index(name) for name in family.there(centre, names)]
    limited = {
        NAMES.index(name): limits_of(pair, family.unit(name), path)
        for (path, name), pair in zip(kept_names.items(), (keep or {}).values(), strict=True)
    }
    if absent := [path for path, name in kept_names.items() if NAMES.index(name) not in chosen]:
        raise SceneError([Fault(absent[0], "no figure of this scene", f"one of {', '.join(NAMES[i] for i in chosen)}")])
    nominal, _ = family(family.nominal[:, None])
    if scene.stroke is None:
        family.near = {NAMES[i]: float(nominal[i, 0]) for i in chosen if NAMES[i] in ANGLES}
    sample = _sampled(family, intervals, scatter, samples, seed)
    interrupted, extremes = not sample.done.all(), dict[int, tuple[Bound, Bound]]()
    said = [f"interrupted: {int(sample.done.sum())} of {sample.done.size} samples were sized"] if interrupted else []
    if intervals:
        designs = _SizedDesigns(np.array(list(intervals.values())).T, sample.points, sample.values, sample.errors)
        try:
            if not interrupted:
                _search_extremes(family, designs, chosen)
        except KeyboardInterrupt:
            interrupted = True
        if interrupted:
            said.append("interrupted: least and greatest values are those of the designs until then")
        extremes = designs.extremes(family.paths, chosen)
    kept = np.flatnonzero(sample.done[: 2 * samples])
    lost = np.isnan(sample.values[chosen][:, kept]).any(axis=0)
    refused = (family.reasons.get(tuple(sample.points[:, k].tolist()), "") for k in kept[lost])
    if lost.all():
        raise SceneError([Fault("vary", "no sample that is a machine", "one at least", next(refused, ""))])
    return Tolerance(
        scene=scene,
        numbers=dict(zip(family.paths, family.nominal.tolist(), strict=True)),
        units=dict(zip(family.paths, family.units, strict=True)),
        intervals=intervals,
        deviations=deviations,
        spreads={
            NAMES[i]: _spread(
                sample,
                i,
                float(nominal[i, 0]),
                () if scatter.correlations else family.paths,
                samples,
                extremes.get(i),
                levels,
                limited.get(i),
            )
            for i in chosen
        },
        figure_units={NAMES[i]: family.unit(NAMES[i]) for i in chosen},
        samples=sample.points[:, kept],
        figures={NAMES[i]: sample.values[i, kept] for i in chosen},
        refused=int(lost.sum()),
        reason=next(refused, ""),
        designs=family.count,
        messages=(*said, *family.said)
        + (_UNSHARED,) * bool(len(family.paths) > 1 and np.isnan(sample.values[chosen][:, sample.done]).any())
        + (_CORRELATED,) * bool(scatter.correlations),
        interrupted=interrupted,
        quantiles=levels,
        kept=_together_kept(sample, samples, limited) if limited else None,
        within=scatter.within,
        correlations=scatter.correlations,
    )


def _ranges(family: Variation, vary: Mapping[str, Any]) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
    """Intervals, or deviations, in SI."""
    intervals, deviations, faults = dict[str, tuple[float, float]](), dict[str, float](), list[Fault]()
    for path, dimension in zip(family.paths, family.dimensions, strict=True):
        value = vary[path]
        pair = isinstance(value, (tuple, list, np.ndarray))
        if pair and len(value) != 2:
            faults.append(Fault(path, f"{len(value)} numbers", "(low, high), or one standard deviation"))
            continue
        try:
            values = [quantity(part, dimension, path) for part in (value if pair else [value])]
        except SceneError as error:
            faults.extend(error.faults)
            continue
        if pair:
            intervals[path] = (values[0], values[1])
            if not values[0] < values[1]:
                faults.append(Fault(path, f"from {values[0]:g} to {values[1]:g}", "a low end below the high one"))
        else:
            deviations[path] = values[0]
            if not values[0] > 0.0:
                faults.append(Fault(path, f"a standard deviation of {values[0]:g}", "one above 0"))
    if not faults and intervals and deviations:
        path = next(iter(deviations))
        advice = "extremes and statistics cannot be asked for together"
        faults.append(Fault(path, "a standard deviation together with intervals", "all of one kind", advice))
    if faults:
        raise SceneError(faults)
    return intervals, deviations


class _Scatter(NamedTuple):
    """Numbers that scatter: deviations and limits (SI) by path, correlations of pairs, and the root of their matrix."""

    deviations: dict[str, float]
    within: dict[str, tuple[float | None, float | None]]
    correlations: dict[tuple[str, str], float]
    root: Array

    def points(self, nominal: Array, standard: Array) -> Array:
        """The numbers (paths, designs) from independent standard normal ones."""
        from scipy.special import ndtr, ndtri

        normal = self.root @ standard
        sigma = np.array(list(self.deviations.values()))
        for i, path in enumerate(self.deviations):
            if path in self.within:
                first, last = self._shares(path, float(nominal[i]))
                normal[i] = ndtri(first + (last - first) * ndtr(normal[i]))
        return np.asarray(nominal[:, None] + sigma[:, None] * normal)

    def _shares(self, path: str, nominal: float) -> tuple[float, float]:
        """Shares of normal numbers below either limit."""
        from scipy.special import ndtr

        low, high = ((end - nominal) / self.deviations[path] if end is not None else None for end in self.within[path])
        return 0.0 if low is None else float(ndtr(low)), 1.0 if high is None else float(ndtr(high))


def _scatter(
    family: Variation, deviations: dict[str, float], within: Mapping[str, Any], correlations: Mapping[tuple[str, str], float]
) -> _Scatter:
    """Numbers that scatter, with their limits and correlations; SceneError for those that contradict each other."""
    scatter, faults = _Scatter(deviations, {}, {}, np.eye(len(family.paths))), list[Fault]()
    for path, pair in by_path(within).items():
        if path not in deviations:
            faults.append(Fault(f"within {path}", "no deviation of it", "one, whose ends are cut off"))
            continue
        i = family.paths.index(path)
        scatter.within[path] = limits_of(pair, family.units[i], f"within {path}")
        first, last = scatter._shares(path, float(family.nominal[i]))
        if last - first < _LEAST_SHARE:
            share = f"limits that contain {100 * (last - first):.2g} % of the numbers"
            faults.append(Fault(f"within {path}", share, f"{100 * _LEAST_SHARE:g} % or more"))
    for pair, value in correlations.items():
        paths = tuple(map(dotted, pair))
        name = f"correlation of {' and '.join(paths)}"
        if len(set(paths)) != 2 or not set(paths) <= set(deviations) or {*paths} in map(set, scatter.correlations):
            faults.append(Fault(name, "no pair of numbers that scatter", "two of them, once"))
        elif not -1.0 < value < 1.0:
            faults.append(Fault(name, f"{value:g}", "a number between -1 and 1"))
        else:
            scatter.correlations[paths[0], paths[1]] = float(value)
    if faults:
        raise SceneError(faults)
    matrix = np.eye(len(family.paths))
    for (one, two), value in scatter.correlations.items():
        i, j = family.paths.index(one), family.paths.index(two)
        matrix[i, j] = matrix[j, i] = value
    try:
        return scatter._replace(root=np.asarray(np.linalg.cholesky(matrix), float))
    except np.linalg.LinAlgError:
        impossible = "values that no numbers can have together"
        raise SceneError([Fault("correlations", impossible, "those of a positive definite matrix")]) from None


# -- samples -----------------------------------------------------------------------------------------------------------


class _Sample(NamedTuple):
    """Points (paths, designs), figures there with their errors, and a polynomial basis there.

    First all of A, then all of B, then for every number A with that of B in its place. `powers` (terms, paths) are the
    degrees of the basis, which is orthonormal for the numbers' distribution and begins with 1; `many` is the same at many
    other points, for quantiles. `done` is a mask of the designs sized before the user ended it.
    """

    points: Array
    values: Array
    errors: Array
    basis: Array
    powers: NDArray[np.int64]
    many: Array
    done: NDArray[np.bool_]


def _sampled(
    family: Variation,
    intervals: Mapping[str, tuple[float, float]],
    scatter: _Scatter,
    samples: int,
    seed: int,
) -> _Sample:
    """Designs at points of a Sobol sequence, scrambled anew for every repeat."""
    count = len(family.paths)
    parts = [unit_points("sobol", samples // _REPEATS, 2 * count, [seed, repeat]) for repeat in range(_REPEATS)]
    unit = np.clip(np.concatenate(parts, axis=1), _TAIL_SHARE, 1.0 - _TAIL_SHARE)
    first, second = unit[:count], unit[count:]
    mixed = []
    for i in range(count if count > 1 and not scatter.correlations else 0):
        own = first.copy()
        own[i] = second[i]
        mixed.append(own)
    unit = np.concatenate([first, second, *mixed], axis=1)
    if intervals:
        low, high = np.array(list(intervals.values())).T[:, :, None]
        points, standard = np.clip(low + (high - low) * unit, low, high), 2.0 * unit - 1.0
    else:
        standard = _standard(unit)
        points = scatter.points(family.nominal, standard)
    # degrees of the terms of a polynomial of the highest degree, up to 4, with a limited number of terms
    rows, degrees = [(0,) * count], [(0,) * count]
    for _ in range(4):
        rows = sorted({(*row[:i], row[i] + 1, *row[i + 1 :]) for row in rows for i in range(count)}, reverse=True)
        if len(degrees) + len(rows) > samples // 4:
            break
        degrees += rows
    powers = np.array(degrees, dtype=np.int64)
    more = np.clip(unit_points("sobol", _MODEL_POINTS, count, [seed, _REPEATS]), _TAIL_SHARE, 1.0 - _TAIL_SHARE)
    further = 2.0 * more - 1.0 if intervals else _standard(more)
    basis, many = (_basis(each, powers, normal=not intervals) for each in (standard, further))
    try:
        done, (values, errors) = np.ones(points.shape[1], dtype=bool), family(points)
    except KeyboardInterrupt:
        if family.finished is None or np.isfinite(family.finished[1]).any(axis=0).sum() < _FEWEST:
            raise
        done, values, errors = family.finished
    return _Sample(points, values, errors, basis, powers, many, done)


def _standard(unit: Array) -> Array:
    """Standard normal numbers from uniform ones."""
    from scipy.special import ndtri

    return np.asarray(ndtri(unit))


def _basis(standard: Array, powers: NDArray[np.int64], *, normal: bool) -> Array:
    """Products of orthonormal polynomials: of Hermite for normal numbers, of Legendre for uniform ones; (terms, designs)."""
    from numpy.polynomial import hermite_e, legendre

    greatest = int(powers.max())
    if normal:
        of_one = hermite_e.hermevander(standard, greatest) / np.sqrt([factorial(k) for k in range(greatest + 1)])
    else:
        of_one = legendre.legvander(standard, greatest) * np.sqrt(2.0 * np.arange(greatest + 1) + 1.0)
    product = np.ones((len(powers), standard.shape[1]))
    for i in range(len(standard)):
        product *= of_one[i, :, powers[:, i]]
    return product


def _spread(
    sample: _Sample,
    i: int,
    nominal: float,
    paths: tuple[str, ...],
    samples: int,
    extremes: tuple[Bound, Bound] | None,
    levels: tuple[float, ...],
    limits: tuple[float | None, float | None] | None,
) -> Spread:
    """The statistics of a figure, each from all samples, with the error from the repeats.

    A polynomial of the numbers, whose statistics are known exactly, serves as a control variate if it fits the figure
    closely: the samples then give only its residual. One that fits worse, for instance at a kink, may deviate without notice
    where samples are rare. If designs are refused the numbers of the others depend on one another, and several of them have
    no shares of the variance.
    """
    values = sample.values[i]
    of_plain = values[: 2 * samples]
    finite = np.isfinite(of_plain)
    weights = _fitted(sample.basis[:, : 2 * samples], of_plain)
    model = weights @ sample.basis
    blocks, models = (row.reshape(-1, _REPEATS, samples // _REPEATS) for row in (values, model))
    each = np.array([_moments(blocks[:2, k], models[:2, k], weights) for k in range(_REPEATS)])
    mean, variance = _moments(blocks[:2], models[:2], weights)
    deviation = sqrt(max(variance, 0.0))
    if finite.any():
        mean = min(max(mean, float(np.nanmin(of_plain))), float(np.nanmax(of_plain)))
    varies = deviation > _DEVIATION_ROUNDING * max(abs(nominal), abs(mean))
    shares = {}
    for j, path in enumerate(paths if varies and (len(paths) == 1 or np.isfinite(values).all()) else ()):
        if len(paths) == 1:
            shares[path] = Sobol(1.0, 0.0, 1.0, 0.0)
            continue
        three, of_model = [0, 1, 2 + j], (weights, sample.powers[:, j] > 0, sample.powers.sum(axis=1) > sample.powers[:, j])
        repeats = np.array([_shares(blocks[three, k], models[three, k], *of_model, variance) for k in range(_REPEATS)])
        first, total = _shares(blocks[three], models[three], *of_model, variance)
        errors = _repeated(repeats)
        shares[path] = Sobol(min(max(first, 0.0), 1.0), float(errors[0]), min(max(total, 0.0), 1.0), float(errors[1]))
    rows: tuple[Array, Array | None, Array] = of_plain[finite], None, of_plain[finite]
    if weights.any():
        rows = of_plain, model[: 2 * samples], weights @ sample.many
    quantiles, doubts = _quantiles(rows, levels)
    wrong = np.hypot(_repeated(each), 0.0 if weights.any() else _grain(of_plain[finite]) * np.array([1.0, 2.0 * deviation]))
    return Spread(
        nominal=nominal,
        mean=mean,
        mean_error=float(wrong[0]),
        deviation=deviation if varies or isnan(deviation) else 0.0,
        deviation_error=float(wrong[1]) / (2 * deviation) if varies else 0.0,
        quantiles=quantiles,
        quantile_errors=doubts,
        shares=shares,
        least=None if extremes is None else extremes[0],
        greatest=None if extremes is None else extremes[1],
        kept=None if limits is None else Kept(*limits, *_probability(rows, limits)),
    )


def _fitted(basis: Array, values: Array) -> Array:
    """The weights of the basis (terms, designs) whose sum fits the values closely; None if it does not, or unknown."""
    nothing = np.zeros(len(basis))
    if not np.isfinite(values).all():
        return nothing
    weights = np.asarray(np.linalg.lstsq(basis.T, values, rcond=None)[0])
    off = float(np.square(values - weights @ basis).sum())
    return weights if off <= _RESIDUAL_VARIANCE * float(np.square(values - values.mean()).sum()) else nothing


def _grain(values: Array) -> float:
    """Change of the mean by one more sample on the other side of the widest gap between values."""
    return float(np.diff(np.sort(values)).max(initial=0.0)) / max(values.size, 1)


def _moments(values: Array, model: Array, weights: Array) -> tuple[float, float]:
    """Mean and variance of the known values."""
    finite = np.isfinite(values)
    y, p, constant = values[finite], model[finite], float(weights[0])
    if not y.size:
        return float("nan"), float("nan")
    mean = float((y - p).mean()) + constant
    variance = float(((y - mean) ** 2 - (p - constant) ** 2).mean()) + float((weights[1:] ** 2).sum())
    return mean, variance


def _shares(
    values: Array,
    model: Array,
    weights: Array,
    own: NDArray[np.bool_],
    others: NDArray[np.bool_],
    variance: float,
) -> tuple[float, float]:
    """Shares of first order and in total of one number, from values at A, at B and at A with that number of B.

    `own` and `others` are masks of the terms of the model that depend on the number, and on others.
    """
    (a, b, c), (model_a, model_b, model_c) = values, model
    square = weights**2
    by_others = 0.5 * float(((b - c) ** 2 - (model_b - model_c) ** 2).mean()) + float(square[others].sum())
    by_own = 0.5 * float(((a - c) ** 2 - (model_a - model_c) ** 2).mean()) + float(square[own].sum())
    return 1.0 - by_others / variance, by_own / variance


def _repeated(rows: Array) -> Array:
    """The standard error of the mean of independent repeats (the first axis)."""
    if (np.isfinite(rows).sum(axis=0) < 2).any():
        return np.full(rows.shape[1:], np.nan)
    return np.asarray(np.nanstd(rows, axis=0, ddof=1) / np.sqrt(len(rows)))


def _within(values: Array, limits: tuple[float | None, float | None]) -> NDArray[np.bool_]:
    """Mask of the values that lie within limits."""
    low, high = limits
    return np.asarray((values >= (-np.inf if low is None else low)) & (values <= (np.inf if high is None else high)))


def _probability(rows: tuple[Array, Array | None, Array], limits: tuple[float | None, float | None]) -> tuple[float, float]:
    """The probability that limits are kept, with its sampling error: the share of designs, as for `_quantiles`."""
    values, model, many = rows
    if values.size < 2:
        return float("nan"), float("nan")
    inside = _within(values, limits)
    share = float(inside.mean())
    differs = share * (1.0 - share) * values.size
    if model is not None:
        of_model = _within(model, limits)
        share, differs = float(_within(many, limits).mean() + share - of_model.mean()), float((inside != of_model).sum())
    return min(max(share, 0.0), 1.0), sqrt(differs + 1.0) / values.size


def _together_kept(
    sample: _Sample, samples: int, limited: Mapping[int, tuple[float | None, float | None]]
) -> tuple[float, float]:
    """The probability that all limits are kept by the same design, with its sampling error."""
    values, basis = sample.values[list(limited), : 2 * samples], sample.basis[:, : 2 * samples]
    fits = [_fitted(basis, row) for row in values]
    finite = values[:, np.isfinite(values).all(axis=0)]
    figures: list[Any] = [finite, None, finite]
    if all(weights.any() for weights in fits):
        figures = [values, [weights @ basis for weights in fits], [weights @ sample.many for weights in fits]]

    def inside(rows: Iterable[Array]) -> Array:
        every = [_within(row, limits) for row, limits in zip(rows, limited.values(), strict=True)]
        return np.asarray(np.all(every, axis=0), float)

    of_samples, of_model, of_many = figures
    return _probability((inside(of_samples), of_model and inside(of_model), inside(of_many)), (0.5, None))


def _quantiles(
    rows: tuple[Array, Array | None, Array], levels: tuple[float, ...]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Quantiles of samples, with half the distance between those of ranks on both sides within chance.

    The share of designs at or below y is that of the model at `many` points, plus the difference between the shares of
    samples and model; without a model quantiles are those of the samples. They are values of samples, also where many are
    equal.
    """
    values, model, many = rows
    count = values.size
    if count < 2:
        return (float("nan"),) * len(levels), (float("nan"),) * len(levels)
    ranks, places = np.linspace(0.0, 1.0, count), np.sort(values)
    if model is not None:
        each = np.unique(values)
        shares = [_share(many, each, side) + _share(values, each, side) - _share(model, each, side) for side in _SIDES]
        ranks, places = np.maximum.accumulate(np.stack(shares, axis=1).ravel()), np.repeat(each, 2)
    quantiles, doubts = [], []
    for q in levels:
        middle, differs = float(np.interp(q, ranks, places)), q * (1.0 - q) * count
        if model is not None:
            differs = float(((values <= middle) != (model <= middle)).sum())
        doubt = sqrt(differs + 1.0) / count
        low, high = np.interp([q - doubt, q + doubt], ranks, places).tolist()
        quantiles.append(middle)
        doubts.append(0.5 * (high - low))
    return tuple(quantiles), tuple(doubts)


def _share(values: Array, at: Array, side: Literal["left", "right"]) -> Array:
    """The share of values below (left), or at and below (right), each of some others."""
    return np.asarray(np.searchsorted(np.sort(values), at, side) / values.size)


# -- extremes ----------------------------------------------------------------------------------------------------------


def _search_extremes(family: Variation, designs: _SizedDesigns, chosen: list[int]) -> None:
    """Searches for the least and the greatest value of figures from the best points known, where gradients point inwards.

    Corners and middles of sides are among these, because extremes of narrow intervals are there. Elsewhere a search
    continues from the best point; its points count for every figure.
    """
    bounds, ends = designs.bounds, _ends(designs.bounds)
    designs.add(ends, *family(ends))
    slopes: dict[int, Array] = {}
    for i in chosen:
        for sign in (-1.0, 1.0):
            k = designs.best(i, sign)
            if k is None:
                continue
            if k not in slopes:
                slopes[k] = gradient(family, designs.points[:, k], family.scales)[1]
            ascent, x = sign * np.nan_to_num(slopes[k][i]), designs.points[:, k]
            inward = np.where(ascent > 0.0, x < bounds[1], x > bounds[0]) & (ascent != 0.0)
            if inward.any():  # not held by the bounds alone
                minimum(partial(designs.rows, family, i, -sign), x, bounds[0], bounds[1], family.scales)


class _SizedDesigns:
    """All designs that were sized within the intervals."""

    def __init__(self, bounds: Array, points: Array, values: Array, errors: Array) -> None:
        self.bounds, self.points, self.values, self.errors = bounds, points, values, errors

    def rows(self, family: Variation, figure: int, sign: float, columns: Array) -> Array:
        """A figure to be minimized, at designs, of which those within the bounds are kept."""
        values, errors = family(columns)
        within = ((columns >= self.bounds[0][:, None]) & (columns <= self.bounds[1][:, None])).all(axis=0)
        self.add(columns[:, within], values[:, within], errors[:, within])
        return np.asarray(sign * values[figure][None])

    def add(self, points: Array, values: Array, errors: Array) -> None:
        """Adds samples."""
        self.points = np.concatenate([self.points, points], axis=1)
        self.values = np.concatenate([self.values, values], axis=1)
        self.errors = np.concatenate([self.errors, errors], axis=1)

    def best(self, figure: int, sign: float) -> int | None:
        """The first design with the greatest (sign +1) or the least figure; None if none is known."""
        row = sign * self.values[figure]
        return None if bool(np.isnan(row).all()) else int(np.nanargmax(row))

    def extremes(self, paths: tuple[str, ...], chosen: list[int]) -> dict[int, tuple[Bound, Bound]]:
        """The least and the greatest value of figures that have any."""
        result = {}
        for i in chosen:
            both = []
            for k in (self.best(i, -1.0), self.best(i, 1.0)):
                if k is not None:
                    at = dict(zip(paths, self.points[:, k].tolist(), strict=True))
                    both.append(Bound(float(self.values[i, k]), float(self.errors[i, k]), at))
            if len(both) == 2:
                result[i] = (both[0], both[1])
        return result


def _ends(bounds: Array) -> Array:
    """Corners, the middle, and the middles of sides of a box, shape (variables, points); corners only where they are few."""
    count = bounds.shape[1]
    middle = 0.5 * (bounds[0] + bounds[1])
    points: list[NDArray[np.float64]] = [middle]
    for i in range(count):
        for side in (0, 1):
            point = middle.copy()
            point[i] = bounds[side, i]
            points.append(point)
    if 2**count <= _MOST_CORNERS:
        points += [bounds[list(corner), np.arange(count)] for corner in product((0, 1), repeat=count)]
    return np.array(points).T
