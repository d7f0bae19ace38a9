"""Random scenes with numbers in ranges: their proven intervals beside designs in these ranges, sized one by one."""

from __future__ import annotations

import copy
from itertools import product
from random import Random
from typing import Any, NamedTuple

import flywheel
from flywheel.reading.paths import dotted
from tests.estimates.scenes import scene_of
from tests.extras import extra

SHARE = 0.002
"""Half the width of every range, of its middle."""
_UNITS = {"length": "m", "mass": "kg", "force": "N", "torque": "N m", "speed": "rad/s", "inertia": "kg m^2"}
_ALLOWED, _ROUNDING = 1e-9, 1e-14  # of a figure, and of the work exchanged: the error of the designs
_NARROW = 1e-6  # of a figure: a width that does not count
_WORKS = ("accumulated_max", "accumulated_min", "energy_fluctuation")
_BY_WORKS = ("flywheel.approximate", "flywheel.approximate_total")


class Ranged(NamedTuple):
    """A scene of a seed: the widths of its intervals over what designs reach, and figures of designs outside of theirs."""

    widths: tuple[float, ...]
    outside: tuple[str, ...]


def ranged(seed: int, designs: int = 12, *, motions: bool = False) -> Ranged | None:
    """The outcome of a seed; None where no figure is proven, with or without ranges.

    motions: also of machines whose torques depend on speed.
    """
    extra("flywheel.sizing.proof")
    draw, written = Random(seed), scene_of(seed)
    try:
        scene = flywheel.load(written)
    except flywheel.SceneError:
        return None
    if (scene.depends_on_speed and not motions) or scene.document is None or _proof(written) is None:
        return None
    known = {dotted(path): quantity for path, quantity in scene.document.quantities.items()}
    free = [path for path, quantity in known.items() if quantity.dimension in _UNITS and isinstance(quantity.value, float)]
    varied = draw.sample(free, min(3, len(free)))
    wide = copy.deepcopy(written)
    for path in varied:
        _put(wide, path, f"{known[path].value!r} {_UNITS[known[path].dimension]} ± {100 * SHARE} %")
    result = _proof(wide)
    if result is None or not varied:
        return None
    places = [*product((-1, 1), repeat=len(varied)), *([draw.uniform(-1, 1) for _ in varied] for _ in range(designs))]
    reached: dict[str, list[float]] = {}
    exchanged = 0.0
    for place in places:
        numbers = {path: known[path].number * (1 + SHARE * side) for path, side in zip(varied, place, strict=True)}
        sizing = flywheel.size(scene.with_(numbers), accuracy="normal")
        exchanged, sized = max(exchanged, sizing.cycle.exchanged if sizing.cycle else 0.0), sizing.as_dict()
        for key in result.figures:
            if (value := _at(sized, key)) is not None:
                reached.setdefault(key, []).append(value)
    return _compared(result.figures, reached, exchanged)


def _proof(scene: Any) -> Any:
    """The proof of a scene; None where it is refused."""
    proof = flywheel.size(flywheel.load(scene), accuracy="proof").proof
    return None if proof is None or proof.reason else proof


def _compared(figures: dict[str, tuple[float, float]], reached: dict[str, list[float]], exchanged: float) -> Ranged:
    """Intervals beside what designs reach that exchange no more than some work (J): works may be but rounding of it."""
    widths, outside = [], []
    size = max(map(abs, figures.get("energy_fluctuation", (0.0,))))
    total = figures.get("flywheel.approximate_total", (0.0, 0.0))[1]
    noise = dict.fromkeys(_WORKS, _ROUNDING * exchanged)
    noise |= dict.fromkeys(_BY_WORKS, _ROUNDING * exchanged * total / size if size else 0.0)
    for key, values in reached.items():
        low, high = figures[key]
        scale = max(abs(low), abs(high), size if key.startswith("accumulated") else total if key.startswith("fly") else 0.0)
        least, most = min(values), max(values)
        allowed = _ALLOWED * scale + noise.get(key, 0.0)
        if least < low - allowed or most > high + allowed:
            outside.append(f"{key}: {least!r} to {most!r}, proven {low!r} to {high!r}")
        if most - least > _NARROW * scale:
            widths.append((high - low) / (most - least))
    return Ranged(tuple(widths), tuple(outside))


def _put(scene: Any, path: str, value: str) -> None:
    """Writes a value at a path such as `load[0].force`."""
    names = path.replace("[", ".").replace("]", "").split(".")
    *above, last = (int(name) if name.isdigit() else name for name in names)
    for name in above:
        scene = scene[name]
    scene[last] = value


def _at(tables: Any, key: str) -> Any:
    for name in key.split("."):
        tables = tables.get(name) if isinstance(tables, dict) else None
    return tables
