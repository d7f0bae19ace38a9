"""The designs around a scene: some of its numbers vary, and its figures are functions of these.

A figure is named as a sweep has it (`exact`, `power`), or as the JSON contract of `size` does (`flywheel.exact`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from flywheel.components.wheels import ARMS, LIGHTEST, MEAN, choose
from flywheel.designs.figures import ALONE, ENGINES, FIGURES, Batch, figures_of, sized
from flywheel.numerics.arguments import name_faults, refuse, shown
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError, suggestion
from flywheel.numerics.units import QuantityError, parse_quantity
from flywheel.reading.paths import Number, dotted, numbers, with_numbers
from flywheel.reading.schema import WHEEL_KEYS
from flywheel.scene.accuracy import rtol_faults
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

Array = NDArray[np.float64]

RTOL = 1e-12
"""The relative error asked of figures of which differences are taken."""
_SMALL = 1e-2  # of the largest number of a unit: below it, a number's own size says nothing of how it may vary
_IRREGULARITY = "flywheel.irregularity"
_WHEEL = tuple(f"flywheel.{key.name}" for key in WHEEL_KEYS)
_EXCLUDED = ("accuracy.", "areas.values.")  # no part of a machine; areas close to zero together alone


_CONTRACT = {  # names in the JSON contract of `size`, where they differ from those of a sweep
    "flywheel.exact": "exact",
    "flywheel.approximate": "approximate",
    "flywheel.approximate_total": "approximate_total",
    "flywheel.inertia_torque": "inertia_torque",
    "flywheel.inertia_torque_flywheel": "inertia_torque_flywheel",
    "flywheel.mass": "mass",
    "wheel.mass": "mass",
    "balance.value": "balance",
    "simulation.irregularity": "irregularity",
    "reduced_inertia.min": "reduced_inertia_least",
    "reduced_inertia.max": "reduced_inertia_greatest",
    "reduced_inertia.mean": "reduced_inertia_mean",
}
NAMES = tuple(name for name in FIGURES if name != "needed")
"""The figures that change by degrees."""
BY_NAME = {name: name for name in NAMES} | _CONTRACT
"""The names of figures in a sweep, by these and by those of the JSON contract."""
WITHOUT = {"mass": "give the flywheel a shape, such as disc", "irregularity": "an analysis has one: give flywheel.inertia"}
_ABSOLUTE = ("angle_speed_max", "angle_speed_min")  # figures whose errors are no shares of them
_OF_WHEELS = ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel")
_OF_WORK = ("energy_fluctuation", "accumulated_max", "accumulated_min")


def figure_name(path: str, name: object) -> str:
    """The name that a sweep has for a figure, under whichever name it is wanted.

    >>> figure_name("minimize", "flywheel.mass"), figure_name("minimize", "power")
    ('mass', 'power')
    >>> figure_name("minimize", "flywheel.exakt")
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: minimize: found "flywheel.exakt", expected a figure; did you mean "flywheel.exact"?
    """
    if isinstance(name, str) and name in BY_NAME:
        return BY_NAME[name]
    raise SceneError([Fault(path, shown(name), "a figure", suggestion(str(name), BY_NAME) or f"known: {', '.join(NAMES)}")])


def figure_names(names: str | Iterable[str]) -> list[str]:
    """The names that a sweep has for some figures."""
    return [figure_name("figures", name) for name in ([names] if isinstance(names, str) else names)]


class Variation:
    """The figures of a scene as functions of some of its numbers.

    Args:
        scene: one that was read.
        paths: of the numbers that vary; SceneError for one that there is not, with the nearest.
        rtol: relative error asked of every figure.
        engine: what sizes designs, as of a sweep.

    """

    def __init__(self, scene: Scene, paths: Iterable[str], rtol: float = RTOL, engine: str | None = None) -> None:
        known, faults = numbers(scene), rtol_faults(rtol)
        self.scene, self.rtol, self.engine = scene, rtol, ENGINES[0] if engine is None else engine
        self.paths = tuple(dict.fromkeys(dotted(str(path)) for path in paths))
        for path in self.paths:
            if path not in known:
                faults.append(Fault(path, "no number of the scene", "the path of one", suggestion(path, known)))
        if not self.paths:
            faults.append(Fault("paths", "none", f"paths of numbers, such as {next(iter(known), 'regime.speed')}"))
        faults += name_faults("engine", self.engine, dict.fromkeys(ENGINES))
        refuse(faults)
        self.nominal = np.array([known[path].value for path in self.paths], dtype=float)
        self.units = tuple(known[path].unit for path in self.paths)
        self.dimensions = tuple(known[path].dimension for path in self.paths)
        self.scales = np.array([_scale(known[path], known) for path in self.paths], dtype=float)
        self.bare = _without_wheel(scene) if self.engine != ENGINES[-1] else None
        self.exchanged = 0.0  # work (J) in a cycle, to which errors of areas are relative
        self.reasons: dict[tuple[float, ...], str] = {}
        self.count = self.alone = 0
        self.why = ""

    def unit(self, figure: str) -> str:
        """The unit (SI) of a figure: that of a balance is the torque's, or left open where it is a parameter's."""
        if figure == "balance" and self.scene.unknown == "drive":
            return "N m"
        return FIGURES[figure].unit

    def centre(self) -> Sizing:
        """The scene's own design; SceneError where that is refused."""
        found = self.at(self.nominal)
        cycle = found.constant or found.cycle
        self.exchanged = 0.0 if cycle is None else cycle.exchanged
        return found

    def there(self, centre: Sizing, names: Iterable[str] | None = None) -> list[str]:
        """The figures that a design has, or those of them that are named; SceneError where one of these is not there."""
        own = [name for name, (value, _) in figures_of(centre).items() if name in NAMES and isfinite(value)]
        wanted = own if names is None else list(dict.fromkeys(names))
        refuse(
            [
                Fault(name, "no figure of this scene", f"one of {', '.join(own)}", WITHOUT.get(name, ""))
                for name in wanted
                if name not in own
            ]
        )
        return wanted

    def at(self, column: Array) -> Sizing:
        """One design, sized by itself; SceneError where it is refused."""
        there = dict(zip(self.paths, column.tolist(), strict=True))
        return size(with_numbers(self.scene, there), self.rtol, simulate=False)

    def __call__(self, columns: Array) -> tuple[Array, Array]:
        """The figures of designs (paths, designs) and their absolute errors, both (figures, designs); NaN where refused."""
        if self.bare is None:
            batch = sized(self.scene, self.paths, columns, self.rtol, self.engine, progress=None)
        else:
            batch = self._with_wheels(self.bare, columns)
        if batch.interrupted:
            raise KeyboardInterrupt
        self.count += columns.shape[1]
        alone = batch.ways == ALONE
        self.alone += int(alone.sum())
        for k, reason in batch.reasons.items():
            self.why = self.why or reason * bool(alone[k])
            self.reasons[tuple(columns[:, k].tolist())] = reason
        if self.scene.wheel is not None:  # a wheel that is not needed has no mass
            batch.values["mass"][batch.values["exact"] == 0.0] = 0.0
        values = np.array([batch.values[name] for name in NAMES])
        return values, np.array([self._error(name, batch) for name in NAMES])

    @property
    def said(self) -> tuple[str, ...]:
        """What is to be said of how designs were sized."""
        if not self.alone or self.engine == ENGINES[-1]:
            return ()
        were = "was" if self.alone == 1 else "were"
        return (f"{self.alone} of {self.count} designs {were} sized one by one" + f": {self.why}" * bool(self.why),)

    def _with_wheels(self, bare: Scene, columns: Array) -> Batch:
        """Designs of a scene that is many at once without its wheel, and the wheel of each chosen as `size` does."""
        others = [i for i, path in enumerate(self.paths) if path not in _WHEEL]
        paths, given = tuple(self.paths[i] for i in others), columns[others]
        if not others:
            paths, given = (_IRREGULARITY,), np.full((1, columns.shape[1]), bare.irregularity)
        batch = sized(bare, paths, given, self.rtol, self.engine, progress=None)
        same = not any(path in _WHEEL or path == _IRREGULARITY or path.startswith("shafts.") for path in self.paths)
        for k in np.flatnonzero(np.isfinite(batch.values["exact"])):
            inertia, speed = float(batch.values["exact"][k]), float(batch.values["speed"][k])
            try:
                there = dict(zip(self.paths, columns[:, k].tolist(), strict=True))
                scene = self.scene if same else with_numbers(self.scene, there)
                assert scene.wheel is not None
                greatest = speed if scene.wheel.at == MEAN else speed * (1 + (scene.irregularity or 0.0) / 2)
                mass = choose(inertia, scene.flywheel_ratio * greatest, scene.wheel).mass if inertia else 0.0
            except SceneError as error:
                batch.reasons[int(k)] = "; ".join(map(str, error.faults))
                for values in batch.values.values():
                    values[k] = np.nan
                continue
            batch.values["mass"][k], batch.errors["mass"][k] = mass, batch.errors["exact"][k]
        return batch

    def _error(self, name: str, batch: Batch) -> Array:
        """The absolute error of a figure: of a flywheel relative to the total, of an area to the work exchanged."""
        value = np.abs(batch.values[name])
        error = np.nan_to_num(batch.errors[name])
        if name in _OF_WHEELS:
            error = error * np.fmax(value, batch.values["approximate_total"])
        elif name in _OF_WORK:
            error = error * np.fmax(value, self.exchanged)
        elif name not in _ABSOLUTE:
            error = error * value
        return np.asarray(error + 4 * ROUNDING * value)


def paths_of(scene: Scene) -> tuple[str, ...]:
    """The paths of all numbers of a scene's machine."""
    return tuple(path for path in numbers(scene) if not path.startswith(_EXCLUDED))


def quantity(value: object, dimension: str, path: str) -> float:
    """A number (SI), given as one or as a text with a unit; SceneError for anything else.

    >>> quantity("250 mm", "length", "mechanism.rod.length"), quantity(3, "number", "parameters.n")
    (0.25, 3.0)
    """
    left_open = dimension == "number" and isinstance(value, str) and path.startswith(("parameters.", "subject_to "))
    try:
        return parse_quantity(value, None if left_open else dimension)
    except QuantityError as error:
        raise SceneError([Fault(path, error.found, error.expected, error.advice)]) from None


def _without_wheel(scene: Scene) -> Scene | None:
    """The scene without the wheel that is to be chosen; None where there is none, or where its arms ask for the motion."""
    wheel = scene.wheel
    if wheel is None or scene.irregularity is None or scene.document is None:
        return None
    hub = wheel.bore is not None or wheel.hub_diameter is not None
    if (wheel.shape == ARMS or (wheel.shape == LIGHTEST and hub)) and wheel.torque is None:
        return None
    return scene.with_({path: None for path in _WHEEL if path.partition(".")[2] in scene.document.tables["flywheel"]})


def _scale(number: Number, known: Mapping[str, Number]) -> float:
    """How much a number varies to make a change: its size, or a share of that of its like, or 1; a radian of angles."""
    if number.dimension == "angle":
        return 1.0
    like = max(abs(other.value) for other in known.values() if other.unit == number.unit) if number.unit else 0.0
    return max(abs(number.value), _SMALL * like) or 1.0
