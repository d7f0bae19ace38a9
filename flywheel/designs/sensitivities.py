"""What every figure of a design changes by as its numbers change: derivatives, and why there is none where there is none.

Exact flywheels are greatest values less least ones: where two lobes of the same height compete for one of them, or the
flywheel stops being needed, the slope to the left differs from that to the right, and both are given.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import degrees, isnan
from typing import Any, NamedTuple

import numpy as np

from flywheel.designs.variation import NAMES, RTOL, WITHOUT, Array, Variation, figure_name, figure_names, paths_of
from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics import notebook
from flywheel.numerics.differences import Slopes, slopes
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import wittenbauer
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing

_BESIDE = 1e-6  # of a number's scale: how far on both sides of a corner one looks for what makes it
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
_BINDING["mass"] = _BINDING["angle_speed_max"] = _BINDING["angle_speed_min"] = _BINDING["exact"]


class Derivative(NamedTuple):
    """The derivative of a figure by a number (SI), with its estimated absolute error.

    `value` is NaN where there is none, and `reason` says why; `left` and `right` are then those of one side, as far as there
    are any. Elsewhere all three are the same.
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

    `values` are the figures, `errors` their absolute errors, `numbers` those that they are derived by, with `units`;
    `derivatives[figure][path]` the derivatives. `designs` is how many designs were sized for them.
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
        """What was derived by what."""
        many = f"{len(self.values)} figures by {len(self.numbers)} numbers"
        return f"Sensitivities({notebook.quoted(self.scene.title)}{many})"

    def derivative(self, figure: str, path: str) -> Derivative:
        """The derivative of a figure by a number; SceneError where there is no such figure or number."""
        own = self.derivatives[self._known(figure)]
        if path not in own:
            raise SceneError([Fault(path, "no number of these", f"one of {', '.join(own)}")])
        return own[path]

    def elasticity(self, figure: str, path: str) -> float:
        """By what share a figure changes for the same share of a number (per cent for one per cent); NaN of a 0."""
        value = self.values[self._known(figure)]
        return self.derivative(figure, path).value * self.numbers[path] / value if value else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """For JSON, SI throughout; null where there is no derivative."""
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
                        path: {**found._asdict(), "elasticity": self.elasticity(name, path)}
                        for path, found in self.derivatives[name].items()
                    },
                }
                for name, value in self.values.items()
            },
        }

    def _known(self, figure: str) -> str:
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
    """The derivatives of every figure of a design by some of its numbers, to 1e-8 where the figures have them.

    They come from designs on both sides, whose differences are extrapolated to a step of zero: see
    `flywheel.numerics.differences`. Each has an estimated error.

    Args:
        scene: one that was read.
        paths: of numbers, such as "mechanism.crank.length" or "load.0.from"; all of them if None.
        figures: by their names, all that there are if None.
        rtol: relative error asked of the figures themselves.
        engine: as of a sweep.

    Raises:
        SceneError: where the design itself is refused, or a number or a figure is not there.

    >>> import flywheel
    >>> rotor = {"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}], "regime": {"speed": 30},
    ...          "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.01}}
    >>> found = flywheel.sensitivities(flywheel.load(rotor), ["regime.speed", "flywheel.irregularity"])
    >>> exact = found.values["exact"]  # in proportion to 1/(eps w²)
    >>> round(found.derivative("flywheel.exact", "regime.speed").value / exact * 30, 8)
    -2.0
    >>> round(found.elasticity("exact", "flywheel.irregularity"), 8)
    -1.0

    """
    scene = scene_of(scene)
    wanted = paths_of(scene) if paths is None else (paths,) if isinstance(paths, str) else tuple(paths)
    names = None if figures is None else figure_names(figures)
    family = Variation(scene, wanted, rtol, engine)
    centre = family.centre()
    there = family.there(centre, names)
    found = slopes(family, family.nominal, family.scales)
    reasons = _Reasons(family, centre)
    derivatives = {
        name: {path: _derivative(found, NAMES.index(name), j, reasons, name) for j, path in enumerate(family.paths)}
        for name in there
    }
    return Sensitivities(
        scene=scene,
        numbers=dict(zip(family.paths, family.nominal.tolist(), strict=True)),
        units=dict(zip(family.paths, family.units, strict=True)),
        values={name: float(found.values[NAMES.index(name)]) for name in derivatives},
        figure_units={name: family.unit(name) for name in derivatives},
        derivatives=derivatives,
        rtol=rtol,
        designs=family.count,
    )


def known_figures(found: Sensitivities, names: Iterable[str]) -> None:
    """SceneError where a figure is none of those that were derived."""
    for name in names:
        found._known(name)


def _derivative(found: Slopes, i: int, j: int, reasons: _Reasons, figure: str) -> Derivative:
    """One derivative, with the reason where it has none."""
    value, error = float(found.both[i, j]), float(found.error[i, j])
    if not isnan(value):
        return Derivative(value, error, value, value, error, error)
    left, right = float(found.left[i, j]), float(found.right[i, j])
    reason = reasons(figure, j, corner=bool(found.corner[i, j]), jump=bool(found.jump[i, j]))
    return Derivative(value, error, left, right, float(found.left_error[i, j]), float(found.right_error[i, j]), reason)


class _Reasons:
    """Why figures have no derivative: what binds on one side and on the other of the numbers that a design has."""

    def __init__(self, family: Variation, centre: Sizing) -> None:
        self.family, self.centre = family, centre
        self.sides: dict[int, tuple[Sizing | str, Sizing | str]] = {}

    def __call__(self, figure: str, j: int, *, corner: bool, jump: bool) -> str:
        """The reason for a figure and a number, in a sentence without its beginning."""
        below, above = self._beside(j)
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

    def _beside(self, j: int) -> tuple[Sizing | str, Sizing | str]:
        """The designs right below and above, or why they are refused."""
        if j not in self.sides:
            found: list[Sizing | str] = []
            for sign in (-1.0, 1.0):
                column = self.family.nominal.copy()
                column[j] += sign * _BESIDE * self.family.scales[j]
                try:
                    found.append(self.family.at(column))
                except SceneError as error:
                    found.append(str(error).splitlines()[0])
            self.sides[j] = (found[0], found[1])
        return self.sides[j]


def _angle(sizing: Sizing, which: str, row: int) -> float | None:
    """Where (rad) a function of `wittenbauer.figures_of` is greatest or least."""
    cycle = sizing.constant or sizing.cycle
    if cycle is None:
        return None
    extremes = wittenbauer.figures_of(cycle, sizing.speed, sizing.scene.irregularity).extremes
    angles: Array = extremes.angle_greatest if which == _GREATEST else extremes.angle_least
    return float(np.asarray(angles)[row])
