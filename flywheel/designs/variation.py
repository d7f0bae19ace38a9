"""The designs around a scene: some of its numbers vary, and its figures are functions of these.

Finally their sensitivities.

A figure has its name in a sweep (`exact`, `power`), or in the JSON contract of `size` (`flywheel.exact`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import degrees, isfinite, isnan, pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.components.wheel_stresses import ARMS, LIGHTEST, MEAN
from flywheel.components.wheels import choose
from flywheel.designs.figures import (
    ALONE,
    ENGINES,
    FIGURES,
    MISSING,
    OF_WHEEL,
    Batch,
    figures_of,
    one_by_one,
    sized,
    wheel_figures,
)
from flywheel.designs.motions import LIMITED
from flywheel.machine.machine import Machine, circuit_of, scene_of
from flywheel.numerics import notebook
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError, brief, name_faults, refuse, show, suggestion
from flywheel.numerics.optima import FigureSlopes, slopes
from flywheel.numerics.units import DIMENSIONS, QuantityError, parse_quantity
from flywheel.reading.paths import Number, dotted, numbers, with_numbers
from flywheel.reading.schema import WHEEL_KEYS
from flywheel.regime import wittenbauer
from flywheel.scene.scene import Scene, rtol_faults
from flywheel.sizing.limits import requirements_of
from flywheel.sizing.motor import of_motor
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

Array = NDArray[np.float64]

RTOL = 1e-12
"""Relative error asked of figures whose differences are taken."""
_SCALE_SHARE = 1e-2  # of the largest number of a unit: below it, a number's own size says nothing of how it may vary
_IRREGULARITY = "flywheel.irregularity"
_WHEEL = tuple(f"flywheel.{key.name}" for key in WHEEL_KEYS)
_AT_LIMIT = 1e-8  # of a limit: a figure that lies nearer to it may decide
_EXCLUDED = ("accuracy.", "areas.values.")  # no part of a machine; areas close to zero together alone

NAMES = tuple(name for name in FIGURES if name != "needed")
"""The figures that change by degrees."""
BY_NAME = {name: name for name in NAMES} | {key: name for name in NAMES for key in FIGURES[name].keys}
"""The names of figures in a sweep, by these and by those of the JSON contract."""
WITHOUT = dict.fromkeys(OF_WHEEL, "give the flywheel a shape, such as disc") | {
    "irregularity": "an analysis has one: give flywheel.inertia"
}
ANGLES = ("angle_speed_max", "angle_speed_min")
"""Figures that count modulo the cycle; their errors are no shares of them."""
_OF_WHEELS = ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel")
_OF_WORK = ("energy_fluctuation", "accumulated_max", "accumulated_min")


def figure_name(path: str, name: object) -> str:
    """The name of a figure in a sweep, from either of its names.

    >>> figure_name("minimize", "flywheel.mass"), figure_name("minimize", "power")
    ('mass', 'power')
    >>> figure_name("minimize", "flywheel.exakt")
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: minimize: found "flywheel.exakt", expected a figure; did you mean "flywheel.exact"?
    """
    if isinstance(name, str) and name in BY_NAME:
        return BY_NAME[name]
    raise SceneError([Fault(path, brief(name), "a figure", suggestion(str(name), BY_NAME) or f"known: {', '.join(NAMES)}")])


def figure_names(names: str | Iterable[str]) -> list[str]:
    """The names of some figures in a sweep."""
    return [figure_name("figures", name) for name in ([names] if isinstance(names, str) else names)]


class Variation:
    """The figures of a scene as functions of some of its numbers.

    Args:
        scene: one that was read.
        paths: of the numbers that vary; SceneError for one that does not exist, with the nearest.
        rtol: required relative error of every figure.
        engine: as for a sweep.
        fixed: true if there may be no number that varies, and a single design.

    """

    def __init__(
        self, scene: Scene, paths: Iterable[str], rtol: float = RTOL, engine: str | None = None, *, fixed: bool = False
    ) -> None:
        all_numbers, faults = numbers(scene), rtol_faults(rtol)
        self.scene, self.rtol, self.engine = scene, rtol, ENGINES[0] if engine is None else engine
        self.paths = tuple(dict.fromkeys(dotted(str(path)) for path in paths))
        for path in self.paths:
            if path not in all_numbers:
                missing = "no number of the scene"
                faults.append(Fault(path or "paths", missing, "the path of one", suggestion(path, all_numbers)))
        if not self.paths and not fixed:
            faults.append(Fault("paths", "none", f"paths of numbers, such as {next(iter(all_numbers), 'regime.speed')}"))
        faults += name_faults("engine", self.engine, dict.fromkeys(ENGINES))
        refuse(faults)
        self.nominal = np.array([all_numbers[path].value for path in self.paths], dtype=float)
        self.units = tuple(all_numbers[path].unit for path in self.paths)
        self.dimensions = tuple(all_numbers[path].dimension for path in self.paths)
        self.scales = np.array([_scale(all_numbers[path], all_numbers) for path in self.paths], dtype=float)
        self.bare = _without_wheel(scene) if self.engine != ENGINES[-1] else None
        self.near: dict[str, float] = {}  # of figures that count modulo the cycle: the angle (rad) beside which they are put
        self.exchanged = 0.0  # work (J) in a cycle, to which errors of areas are relative
        self.reasons: dict[tuple[float, ...], str] = {}
        self.count = self.alone = 0
        self.why = ""
        self.finished: tuple[NDArray[np.bool_], Array, Array] | None = None  # where interrupted: which, figures, errors

    def unit(self, figure: str) -> str:
        """The unit (SI) of a figure: that of a balance is the torque's, or open if it is a parameter's."""
        if figure == "balance" and self.scene.unknown == "drive":
            return "N m"
        return FIGURES[figure].unit

    def centre(self) -> Sizing:
        """The scene's own design; SceneError if that is refused."""
        sizing = self.at(self.nominal)
        cycle = sizing.constant or sizing.cycle
        self.exchanged = 0.0 if cycle is None else cycle.exchanged
        return sizing

    def there(self, centre: Sizing, names: Iterable[str] | None = None) -> list[str]:
        """The figures of a design, or some by name; SceneError if one of these is missing."""
        own = [name for name, (value, _) in figures_of(centre).items() if name in NAMES and isfinite(value)]
        names_used = own if names is None else list(dict.fromkeys(names))
        refuse(
            [
                Fault(name, "no figure of this scene", f"one of {', '.join(own)}", WITHOUT.get(name, ""))
                for name in names_used
                if name not in own
            ]
        )
        return names_used

    def at(self, column: Array) -> Sizing:
        """One design, sized by itself; SceneError where it is refused."""
        there = dict(zip(self.paths, column.tolist(), strict=True))
        return size(with_numbers(self.scene, there), self.rtol, simulate=False)

    def __call__(self, columns: Array) -> tuple[Array, Array]:
        """The figures of designs (paths, designs) and their absolute errors, both (figures, designs); NaN if refused.

        Raises KeyboardInterrupt if the user ends it; `finished` has the results until then.
        """
        self.finished = None
        if self.bare is None:
            batch = sized(self.scene, self.paths, columns, self.rtol, self.engine, progress=None)
        else:
            batch = self._with_wheels(self.bare, columns)
        done = batch.ways != MISSING
        self.count += int(done.sum())
        alone = batch.ways == ALONE
        self.alone += int(alone.sum())
        for k, reason in batch.reasons.items():
            self.why = self.why or reason * bool(alone[k])
            self.reasons[tuple(columns[:, k].tolist())] = reason
        for name, angle in self.near.items():
            whole = self.scene.cycle
            batch.values[name] = angle + (batch.values[name] - angle + 0.5 * whole) % whole - 0.5 * whole
        values = np.array([batch.values[name] for name in NAMES])
        errors = np.array([self._error(name, batch) for name in NAMES])
        if batch.interrupted:
            self.finished = done, values, errors
            raise KeyboardInterrupt
        return values, errors

    def with_flywheels(self, columns: Array) -> tuple[Array, Array]:
        """Figures with given flywheels in place of the smallest that keep limits, and the limited figures over their limits.

        The last row of `columns` holds the flywheels (kg m², at their own shaft); else as `__call__`.
        """
        batch = one_by_one(self.scene, self.paths, columns[:-1], range(columns.shape[1]), self.rtol, None, columns[-1])
        if batch.interrupted:
            raise KeyboardInterrupt
        self.count += columns.shape[1]
        limited = [f"{LIMITED}{name}" for name in requirements_of(self.scene)]
        values = np.array([batch.values[name] for name in (*NAMES, *limited)])
        errors = [self._error(name, batch) for name in NAMES]
        return values, np.array([*errors, *(batch.errors[name] for name in limited)])

    @property
    def said(self) -> tuple[str, ...]:
        """Remarks on how designs were sized."""
        if not self.alone or self.engine == ENGINES[-1]:
            return ()
        were = "was" if self.alone == 1 else "were"
        return (f"{self.alone} of {self.count} designs {were} sized one by one" + f": {self.why}" * bool(self.why),)

    def _with_wheels(self, bare: Scene, columns: Array) -> Batch:
        """Designs sized many at once without the scene's wheel, and the wheel of each as chosen by `size`."""
        others = [i for i, path in enumerate(self.paths) if path not in _WHEEL]
        paths, own = tuple(self.paths[i] for i in others), columns[others]
        if not others:
            paths, own = (_IRREGULARITY,), np.full((1, columns.shape[1]), bare.irregularity)
        batch = sized(bare, paths, own, self.rtol, self.engine, progress=None)
        same = not any(path in _WHEEL or path == _IRREGULARITY or path.startswith("shafts.") for path in self.paths)
        for k in np.flatnonzero(np.isfinite(batch.values["exact"])):
            inertia, speed = float(batch.values["exact"][k]), float(batch.values["speed"][k])
            try:
                there = dict(zip(self.paths, columns[:, k].tolist(), strict=True))
                scene = self.scene if same else with_numbers(self.scene, there)
                assert scene.wheel is not None
                greatest = speed if scene.wheel.at == MEAN else speed * (1 + (scene.irregularity or 0.0) / 2)
                wheel = choose(inertia, scene.flywheel_ratio * greatest, scene.wheel) if inertia else None
            except SceneError as error:
                batch.reasons[int(k)] = "; ".join(map(str, error.faults))
                for values in batch.values.values():
                    values[k] = np.nan
                continue
            wrong = batch.errors["exact"][k] + 4 * np.nan_to_num(batch.errors["speed"][k])  # stresses grow with its square
            for name, value in wheel_figures(scene.wheel, wheel).items():
                batch.values[name][k], batch.errors[name][k] = np.nan if value is None else value, wrong
        return batch

    @np.errstate(invalid="ignore")  # the safety of a wheel that is not needed is infinite
    def _error(self, name: str, batch: Batch) -> Array:
        """The absolute error of a figure: of a flywheel relative to the total, of an area to the work exchanged."""
        value = np.abs(batch.values[name])
        error = np.nan_to_num(batch.errors[name])
        if name in _OF_WHEELS:
            error = error * np.fmax(value, batch.values["approximate_total"])
        elif name in _OF_WORK:
            error = error * np.fmax(value, self.exchanged)
        elif name not in ANGLES:
            error = error * value
        return np.asarray(error + 4 * ROUNDING * value)


def paths_of(scene: Scene) -> tuple[str, ...]:
    """The paths of all numbers of a scene's machine."""
    return tuple(path for path in numbers(scene) if not path.startswith(_EXCLUDED))


def quantity(value: object, dimension: str, path: str) -> float:
    """A number (SI), given as a number or as a text with a unit; SceneError for anything else.

    >>> quantity("250 mm", "length", "mechanism.rod.length"), quantity(3, "number", "parameters.n")
    (0.25, 3.0)
    """
    left_open = dimension == "number" and isinstance(value, str) and path.startswith(("parameters.", "subject_to ", "keep "))
    try:
        return parse_quantity(value, None if left_open else dimension)
    except QuantityError as error:
        raise SceneError([Fault(path, error.defect, error.expected, error.advice)]) from None


def limits_of(pair: Any, unit: str, path: str) -> tuple[float | None, float | None]:
    """Two limits (SI) of a figure, None where one is open, given as numbers or texts with units; SceneError for others.

    >>> limits_of((None, "5 kW"), "W", "keep power")
    (None, 5000.0)
    """
    if not isinstance(pair, (tuple, list, np.ndarray)) or len(pair) != 2 or all(end is None for end in pair):
        raise SceneError([Fault(path, show(pair), "limits (low, high), None where one is open")])
    dimension = next((own for own, dimension_unit in DIMENSIONS.items() if dimension_unit.si == unit), "number")
    low, high = (None if end is None else quantity(end, dimension, path) for end in pair)
    if low is not None and high is not None and low > high:
        raise SceneError([Fault(path, f"from {low:g} to {high:g}", "the lower one first")])
    return low, high


def _without_wheel(scene: Scene) -> Scene | None:
    """The scene without the wheel that is to be chosen; None if there is none, or if its arms need the motion."""
    wheel = scene.wheel
    if wheel is None or scene.irregularity is None or scene.document is None:
        return None
    hub = wheel.bore is not None or wheel.hub_diameter is not None
    if (wheel.shape == ARMS or (wheel.shape == LIGHTEST and hub)) and wheel.torque is None:
        return None
    return scene.with_({path: None for path in _WHEEL if path.partition(".")[2] in scene.document.tables["flywheel"]})


def _scale(number: Number, values: Mapping[str, Number]) -> float:
    """Scale of a number's changes: its size, or a share of that of similar numbers, or 1; a radian for angles."""
    if number.dimension == "angle":
        return 1.0
    like = max(abs(other.value) for other in values.values() if other.unit == number.unit) if number.unit else 0.0
    return max(abs(number.value), _SCALE_SHARE * like) or 1.0


_CORNER_STEP = 1e-6  # of a number's scale: how far on both sides of a corner one looks for what makes it
_SAME_ANGLE = 1e-2  # rad
_WORK, _FAST, _SLOW, _TORQUE, _INERTIA = range(5)  # rows of the extremes of `wittenbauer.figures_of`
_GREATEST, _LEAST = "greatest", "least"
_BINDING: dict[str, tuple[tuple[str, int, str], ...]] = {  # of a figure: which extremes of which function it comes from
    "exact": ((_GREATEST, _FAST, "W - z+ w²I*/2"), (_LEAST, _SLOW, "W - z- w²I*/2")),
    "approximate": ((_GREATEST, _WORK, "W"), (_LEAST, _WORK, "W"), (_LEAST, _INERTIA, "I*")),
    "approximate_total": ((_GREATEST, _WORK, "W"), (_LEAST, _WORK, "W")),
    "inertia_torque": ((_GREATEST, _TORQUE, "W - w²I*/2"), (_LEAST, _TORQUE, "W - w²I*/2")),
    "energy_fluctuation": ((_GREATEST, _WORK, "W"), (_LEAST, _WORK, "W")),
    "accumulated_max": ((_GREATEST, _WORK, "W"),),
    "accumulated_min": ((_LEAST, _WORK, "W"),),
    "reduced_inertia_least": ((_LEAST, _INERTIA, "I*"),),
    "reduced_inertia_greatest": ((_GREATEST, _INERTIA, "I*"),),
}
_BINDING["inertia_torque_flywheel"] = (*_BINDING["inertia_torque"], (_LEAST, _INERTIA, "I*"))
_BINDING |= dict.fromkeys((*OF_WHEEL, "angle_speed_max", "angle_speed_min"), _BINDING["exact"])


class Derivative(NamedTuple):
    """The derivative of a figure by a number (SI), with its estimated absolute error.

    `value` is NaN if there is none, with its `reason`; `left` and `right` are then those of one side, if there are any.
    Otherwise all three are equal.
    """

    value: float
    error: float
    left: float
    right: float
    left_error: float
    right_error: float
    reason: str = ""


@dataclass(frozen=True, repr=False)
class Sensitivities:
    """The derivatives of the figures of a design (SI) by its numbers.

    `values` are the figures, `errors` their absolute errors, `numbers` the variables, with `units`;
    `derivatives[figure][path]` the derivatives. `designs` is the number of designs sized for them.
    """

    scene: Scene
    numbers: dict[str, float]
    units: dict[str, str]
    values: dict[str, float]
    figure_units: dict[str, str]
    derivatives: dict[str, dict[str, Derivative]]
    rtol: float
    designs: int

    def __repr__(self) -> str:
        """Numbers of figures and of varied numbers."""
        many = f"{len(self.values)} figures by {len(self.numbers)} numbers"
        return f"Sensitivities({notebook.quoted(self.scene.title)}{many})"

    def derivative(self, figure: str, path: str) -> Derivative:
        """The derivative of a figure by a number; SceneError if there is no such figure or number."""
        own, name = self.derivatives[self._figure_name(figure)], dotted(path)
        if name not in own:
            raise SceneError([Fault(path, "no number of these", f"one of {', '.join(own)}")])
        return own[name]

    def elasticity(self, figure: str, path: str) -> float:
        """The relative change of a figure over that of a number (percent for one percent); NaN for a 0."""
        value = self.values[self._figure_name(figure)]
        return self.derivative(figure, path).value * self.numbers[dotted(path)] / value if value else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """The derivatives for JSON, SI throughout; null if there is none."""
        return {
            "title": self.scene.title,
            "rtol": self.rtol,
            "designs": self.designs,
            "numbers": {path: {"value": value, "unit": self.units[path]} for path, value in self.numbers.items()},
            "figures": {
                name: {
                    "value": value,
                    "unit": self.figure_units[name],
                    "derivatives": {
                        path: {**derivative._asdict(), "elasticity": self.elasticity(name, path)}
                        for path, derivative in self.derivatives[name].items()
                    },
                }
                for name, value in self.values.items()
            },
        }

    def _figure_name(self, figure: str) -> str:
        name = figure_name("figure", figure)
        if name not in self.derivatives:
            expected = f"one of {', '.join(self.derivatives)}"
            raise SceneError([Fault(figure, "no figure of this scene", expected, WITHOUT.get(name, ""))])
        return name


def sensitivities(
    scene: Scene | Machine,
    paths: str | Iterable[str] | None = None,
    *,
    figures: Iterable[str] | None = None,
    rtol: float = RTOL,
    engine: str | None = None,
) -> Sensitivities:
    """The derivatives of every figure of a design by some of its numbers, to 1e-8 if the figures are that accurate.

    They come from designs on both sides, whose differences are extrapolated to a step of zero: see
    `flywheel.numerics.optima`. Each has an estimated error.

    Args:
        scene: one that was read.
        paths: of numbers, such as "mechanism.crank.length" or "load.0.from"; all of them if None.
        figures: by their names, all that there are if None.
        rtol: required relative error of the figures themselves.
        engine: as of a sweep.

    Raises:
        SceneError: if the design itself is refused, or a number or a figure does not exist.

    >>> import flywheel
    >>> rotor = {"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}], "regime": {"speed": 30},
    ...          "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.01}}
    >>> slopes = flywheel.sensitivities(flywheel.load(rotor), ["regime.speed", "flywheel.irregularity"])
    >>> exact = slopes.values["exact"]  # in proportion to 1/(eps w²)
    >>> round(slopes.derivative("flywheel.exact", "regime.speed").value / exact * 30, 8)
    -2.0
    >>> round(slopes.elasticity("exact", "flywheel.irregularity"), 8)
    -1.0

    """
    scene = scene_of(scene)
    chosen_paths = paths_of(scene) if paths is None else (paths,) if isinstance(paths, str) else tuple(paths)
    names = None if figures is None else figure_names(figures)
    family = Variation(scene, chosen_paths, rtol, engine)
    centre = family.centre()
    there = family.there(centre, names)
    with np.errstate(invalid="ignore"):  # a wheel that is not needed has no end of safety
        derivatives_of = at_crossing(family, centre) or slopes(family, family.nominal, family.scales)
    reasons = _Reasons(family, centre)
    derivatives = {
        name: {path: _derivative(derivatives_of, NAMES.index(name), j, reasons, name) for j, path in enumerate(family.paths)}
        for name in there
    }
    return Sensitivities(
        scene=scene,
        numbers=dict(zip(family.paths, family.nominal.tolist(), strict=True)),
        units=dict(zip(family.paths, family.units, strict=True)),
        values={name: float(derivatives_of.values[NAMES.index(name)]) for name in derivatives},
        figure_units={name: family.unit(name) for name in derivatives},
        derivatives=derivatives,
        rtol=rtol,
        designs=family.count,
    )


def at_crossing(family: Variation, centre: Sizing) -> FigureSlopes | None:
    """The derivatives of a design whose flywheel is the smallest one that keeps limits, without a search for each design.

    Its flywheel J is where the figure F of one limit reaches that, r = F/L = 1. The others are kept with a margin, so that
    it remains where that figure crosses its limit as the numbers p change:

        dJ/dp = -(∂r/∂p)/(∂r/∂J),   dG/dp = ∂G/∂p + ∂G/∂J dJ/dp

    with the figures r and G of designs with given flywheels.

    Args:
        family: the designs around a scene.
        centre: the scene's own, with its figures at the error that the family requires.

    Returns:
        The derivatives; None where designs are searched for one by one: no flywheel is needed, several limits decide, none
        is crossed because lighter flywheels stop, or figures have a corner where the flywheel varies.

    Source: the implicit function theorem.

    """
    scene, inertia = family.scene, centre.flywheel.exact
    searched = scene.stroke is None and not scene.duty and (of_motor(scene) or circuit_of(scene) is not None)
    if family.engine == ENGINES[-1] or not searched or not requirements_of(scene) or not inertia:
        return None
    point, scales = np.append(family.nominal, inertia), np.append(family.scales, inertia)
    there = figures_of(centre)
    own, (values, _) = np.array([there[name][0] for name in NAMES]), family.with_flywheels(point[:, None])
    given, shares = values[: len(NAMES), 0], values[len(NAMES) :, 0]
    same = np.abs(given - own) <= _AT_LIMIT * np.abs(own)
    crossed = np.abs(shares - 1.0) <= _AT_LIMIT
    if not same[np.isfinite(own)].all() or crossed.sum() != 1 or (shares > 1.0 + _AT_LIMIT).any():
        return None
    of = slopes(family.with_flywheels, point, scales)
    return along_crossing(of, len(NAMES) + int(crossed.argmax()), len(NAMES))


def along_crossing(of: FigureSlopes, share: int, count: int) -> FigureSlopes | None:
    """The derivatives of the first `count` figures where the last variable keeps another one, `share`, constant.

    None if a figure has no derivative by that variable, or if it does not change the share.

    >>> def values(x):  # r = a b, G = a + b, so that db/da = -b/a
    ...     return np.stack([x[0] + x[1], x[0] * x[1]]), np.full((2, x.shape[1]), 1e-15)
    >>> slope = along_crossing(slopes(values, np.array([2.0, 3.0]), np.array([2.0, 3.0])), 1, 1)
    >>> round(float(slope.both[0, 0]), 9)  # 1 - 3/2
    -0.5

    """
    by, error, values = of.both[:, -1:], of.error[:, -1:], of.values[:count]
    if not np.isfinite(by[:count][np.isfinite(values)]).all() or not np.abs(by[share]) > error[share]:
        return None

    def moved(slope: Array, off: Array) -> tuple[Array, Array]:
        change = -slope[share] / by[share]
        loose = (off[share] + np.abs(change) * error[share]) / (np.abs(by[share]) - error[share])
        lost = off[:count, :-1] + np.abs(change[:-1]) * error[:count] + (np.abs(by[:count]) + error[:count]) * loose[:-1]
        return slope[:count, :-1] + by[:count] * change[:-1], lost

    (both, off), (left, of_left), (right, of_right) = (
        moved(*each) for each in ((of.both, of.error), (of.left, of.left_error), (of.right, of.right_error))
    )
    corner, jump = (each[:count, :-1] | each[share, :-1] for each in (of.corner, of.jump))
    return FigureSlopes(values, both, off, left, of_left, right, of_right, corner, jump, of.step[:-1])


def check_figures(result: Sensitivities, names: Iterable[str]) -> None:
    """Raises SceneError if a figure is none of those that were derived."""
    for name in names:
        result._figure_name(name)


def _derivative(of: FigureSlopes, i: int, j: int, reasons: _Reasons, figure: str) -> Derivative:
    """One derivative, with the reason where it has none."""
    value, error = float(of.both[i, j]), float(of.error[i, j])
    if not isnan(value):
        return Derivative(value, error, value, value, error, error)
    left, right = float(of.left[i, j]), float(of.right[i, j])
    reason = reasons(figure, j, corner=bool(of.corner[i, j]), jump=bool(of.jump[i, j]))
    return Derivative(value, error, left, right, float(of.left_error[i, j]), float(of.right_error[i, j]), reason)


class _Reasons:
    """Reason why figures have no derivative: binding conditions on either side of a design's numbers."""

    def __init__(self, family: Variation, centre: Sizing) -> None:
        self.family, self.centre = family, centre
        self.sides: dict[int, tuple[Sizing | str, Sizing | str]] = {}

    def __call__(self, figure: str, j: int, *, corner: bool, jump: bool) -> str:
        """The reason for a figure and a number, in a sentence without its beginning."""
        # the designs just below and above, or the reasons of their refusal
        if j not in self.sides:
            neighbours: list[Sizing | str] = []
            for sign in (-1.0, 1.0):
                column = self.family.nominal.copy()
                column[j] += sign * _CORNER_STEP * self.family.scales[j]
                try:
                    neighbours.append(self.family.at(column))
                except SceneError as error:
                    neighbours.append(str(error).splitlines()[0])
            self.sides[j] = (neighbours[0], neighbours[1])
        below, above = self.sides[j]
        if isinstance(below, str) or isinstance(above, str):
            sides = [("below", below), ("above", above)]
            return "; ".join(f"refused {side}: {why}" for side, why in sides if isinstance(why, str))
        if below.flywheel.needed != above.flywheel.needed:
            return "the flywheel is needed on one side alone"
        for which, row, function in _BINDING.get(figure, ()):
            one, other = _angle(below, which, row), _angle(above, which, row)
            cycle = self.family.scene.cycle
            if one is not None and other is not None and _SAME_ANGLE < abs(one - other) < cycle - _SAME_ANGLE:
                at = f"{degrees(one):.6g} and {degrees(other):.6g} deg"
                return f"two {which} values of {function} are equal, at {at}"
        if jump:
            return "it jumps"
        return "a structure changes: ends of windows, or places where laws switch, meet" if corner else "no limit was found"


def _angle(sizing: Sizing, which: str, row: int) -> float | None:
    """Angle (rad) at which a function of `wittenbauer.figures_of` is greatest or least."""
    cycle = sizing.constant or sizing.cycle
    if cycle is None:
        return None
    extremes = wittenbauer.figures_of(cycle, sizing.speed, sizing.scene.irregularity).extremes
    angles: Array = extremes.angle_greatest if which == _GREATEST else extremes.angle_least
    return float(np.asarray(angles)[row])


_DEGREE = pi / 180


def change(derivatives: Sensitivities, name: str, path: str) -> float:
    """The change of a figure in percent for one percent of a number, or for a degree of an angle; NaN if unknown."""
    value, derivative = derivatives.values[name], derivatives.derivative(name, path).value
    step = _DEGREE if derivatives.units[path] == "rad" else 0.01 * derivatives.numbers[path]
    return 100.0 * derivative * step / value if value else float("nan")
