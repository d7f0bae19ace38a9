"""Figures of many designs at once are those of `size` one by one, within the errors of both, by every engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.designs import figures as designs
from tests.extras import extra

PRESS = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.15, "mass": 30, "inertia": 0.4, "com": 0.02, "com_angle": "180 deg"},
        "rod": {"length": 0.6, "mass": 18, "inertia": 0.7, "com": 0.2},
        "slider": {"mass": 60},
    },
    "gravity": {},
    "load": [{"on": "slider", "force": "-80 kN", "from": "300 deg", "to": "355 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "120 rpm"},
    "flywheel": {"irregularity": 0.05},
}
YOKE = {
    "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}},
    "load": [{"on": "yoke", "force": 1000, "from": 0, "to": "180 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "60 rpm"},
    "flywheel": {"irregularity": 0.04},
}
RANGES: dict[str, tuple[dict[str, Any], dict[str, tuple[float, float]]]] = {
    "press": (
        PRESS,
        {
            "mechanism.crank.length": (0.1, 0.2),
            "mechanism.rod.length": (0.45, 0.9),
            "load.0.from": (5.0, 5.4),
            "load.0.to": (5.9, 6.25),
            "flywheel.irregularity": (0.01, 0.2),
            "regime.speed": (6.0, 16.0),
        },
    ),
    "flywheel given": (
        {**PRESS, "flywheel": {"inertia": 500}},
        {"flywheel.inertia": (5.0, 900.0), "mechanism.slider.mass": (20.0, 90.0), "load.0.to": (5.9, 6.25)},
    ),
    "none needed": (
        {**PRESS, "load": [{"on": "slider", "force": "-8 kN", "from": "300 deg", "to": "355 deg"}]},
        {"flywheel.irregularity": (0.5, 1.5), "mechanism.crank.inertia": (0.4, 40.0)},
    ),
    "yoke": (
        YOKE,
        {"mechanism.crank.length": (0.2, 0.8), "load.0.force": (300.0, 3000.0), "mechanism.yoke.mass": (5.0, 30.0)},
    ),
}
ENGINES = ["numpy", pytest.param("numba", marks=pytest.mark.slow)]
ANGLES = ("angle_speed_max", "angle_speed_min")


def scale(name: str, found: dict[str, np.ndarray], exchanged: np.ndarray) -> np.ndarray:
    """What an error of a figure is relative to."""
    if name in ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel"):
        return np.maximum(found[name], found["approximate_total"])
    if name in ("accumulated_max", "accumulated_min", "energy_fluctuation"):
        return exchanged
    if name.startswith("reduced_inertia"):
        return found["reduced_inertia_greatest"]
    return np.ones_like(exchanged) if name in ANGLES else np.abs(found[name])


def compared(scene: flywheel.Scene, paths: tuple[str, ...], columns: np.ndarray, engine: str) -> designs.Batch:
    """The designs by an engine, every figure within the errors of it and of `size`; the batch."""
    found = designs.sized(scene, paths, columns, 1e-10, engine)
    alone = designs.sized(scene, paths, columns, 1e-10, "size")
    exchanged = np.maximum(np.abs(alone.values["accumulated_max"]), np.abs(alone.values["accumulated_min"]))
    for name, value in alone.values.items():
        assert (np.isnan(value) == np.isnan(found.values[name])).all(), name
        known = ~np.isnan(value)
        apart = np.abs(found.values[name] - value)[known]
        allowed = (found.errors[name] + alone.errors[name]) * scale(name, alone.values, exchanged)
        assert (apart <= allowed[known]).all(), (name, apart.max())
    return found


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", RANGES)
def test_designs_at_once_are_those_one_by_one(name: str, engine: str) -> None:
    if engine == "numba":
        extra("numba")
    tables, ranges = RANGES[name]
    low, high = np.array(list(ranges.values())).T[:, :, None]
    columns = low + (high - low) * np.random.default_rng(5).random((len(ranges), 12))
    found = compared(flywheel.load(tables), tuple(ranges), columns, engine)
    assert (found.ways <= designs.REFINED).sum() >= 9
    for key in ("exact", "approximate", "irregularity"):
        assert not (found.errors[key][found.ways <= designs.REFINED] > 1e-10).any()
