"""The published data, and the few shapes of scene that most of the problems come down to."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path
from typing import Any

import pytest

import flywheel

CASES: dict[str, dict[str, Any]] = {
    case["id"]: case for case in json.loads((Path(__file__).parent / "cases.json").read_text(encoding="utf-8"))
}
BOOK_GRAVITY = 32.2 / (9.80665 / 0.3048)  # of books that take g = 32.2 ft/s²
LBF_IN = 0.45359237 * 9.80665 * 0.0254  # J
G = 9.81  # m/s², as the metric books take it


def inputs(name: str) -> dict[str, Any]:
    """The data of a case."""
    data: dict[str, Any] = CASES[name]["inputs"]
    return data


def agree(name: str, rtol: float = 1e-9, **figures: float) -> None:
    """Figures are the true ones of a case, and the printed ones as far as its source rounds them."""
    case = CASES[name]
    for key, value in figures.items():
        assert value == pytest.approx(case["computed"][key], rel=rtol), key
        if key in case["printed"] and key not in case.get("not_met", ()):
            assert value == pytest.approx(case["printed"][key], rel=case["printed_rtol"]), f"printed {key}"


def sized(scene: dict[str, Any]) -> dict[str, Any]:
    """The figures of a scene, without time stepping."""
    return flywheel.size(flywheel.load(scene), simulate=False).as_dict()


def of_areas(works: list[float], scale: str | float, speed: str | float, **wheel: Any) -> dict[str, Any]:
    """The figures of areas between crossings."""
    return sized({"areas": {"values": works, "scale": scale}, "regime": {"speed": speed}, "flywheel": wheel})


def of_swing(swing: float, speed: str | float, **wheel: Any) -> dict[str, Any]:
    """The figures of a known swing of energy (J)."""
    return of_areas([swing, -swing], 1, speed, **wheel)


def four_stroke(works: list[float], speed: str, **wheel: Any) -> dict[str, Any]:
    """The figures of an engine with a triangular moment on each of four strokes, against a constant load; works in J."""
    peaks = [2 * work / pi for work in works]
    values = [value for peak in peaks for value in (0.0, peak)] + [0.0]
    table = {"angle": [90 * i for i in range(9)], "angle_unit": "deg", "value": values}
    regime = {"speed": speed, "cycle": "720 deg"}
    load = [{"on": "crank", "table": table}]
    return sized({"load": load, "drive": {"torque": "balance"}, "regime": regime, "flywheel": wheel})


def press(energy: float, busy: float, cycle: float, mean_rpm: float, **wheel: Any) -> dict[str, Any]:
    """The figures of a press that spends `energy` (J) evenly over the share `busy` of each `cycle` (s).

    The crank turns once per operation; the flywheel's shaft is as much faster as its mean speed asks.
    """
    ratio = mean_rpm * cycle / 60
    load = {"on": "crank", "torque": -energy / (2 * pi * busy), "from": 0, "to": f"{360 * busy!r} deg"}
    return sized(
        {
            "shafts": {"wheel": {"ratio": ratio}},
            "load": [load],
            "drive": {"on": "wheel", "torque": "balance"},
            "regime": {"on": "wheel", "speed": f"{mean_rpm!r} rpm"},
            "flywheel": {"on": "wheel", **wheel},
        }
    )


def mean_and_eps(case: dict[str, Any]) -> tuple[float, float]:
    """The mean of two extreme speeds (rpm) of a case, and the irregularity."""
    high, low = max(case["N1_rpm"], case["N2_rpm"]), min(case["N1_rpm"], case["N2_rpm"])
    return (high + low) / 2, 2 * (high - low) / (high + low)
