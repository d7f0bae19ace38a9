"""Drawn scenes with the numbers of a textbook: angles of quarters and eighths of a turn, ratios of whole numbers, laws that
switch where something else happens. What coincides there random numbers never meet.
"""

from __future__ import annotations

import copy
import re
from typing import Any

import numpy as np

from tests.generated.scenes import Drawn, Rng, Scene, drawn

LAWS = (
    *("-{a}*max(sin(phi), 0)", "-{a}*max(sin(2*phi), 0)", "-{a}*(sin(phi) if phi > pi else 0)", "-{a}*abs(sin(phi))"),
    *("-{a}*abs(cos(phi))", "-{a}*(0.2 + max(0, -cos(phi)))", "-{a}*(1 if cos(phi) > 0 else 0.5)", "-{a}*(1 - cos(phi))"),
    *("-{a}*(phi < pi)", "-{a}*(phi > 0)", "-{a}*(pi/2 < phi < 3*pi/2)", "-{a}*min(max(phi - pi/2, 0), pi/2)"),
    *("-{a}*max(0, 1 - abs(phi - pi))", "-{a}*abs(phi - pi)/pi", "-{a}*sign(v)", "-{a}*(v > 0)", "-{a}*v*abs(v)/{b}**2"),
    *("-{a}*max(0, v)/{b}", "-{a}*max(cos(phi), 0)*(v > 0)", "-{a}*sign(sin(phi))*sign(v)*sign(sin(phi))"),
)
"""Laws of a size and a speed."""

RATIOS = (1.0, 1.0, 2.0, 2.0, 3.0, 0.5)
ANGLES = ("phase", "com_angle", "direction", "from", "to")
KEPT = ("every", "cycle", "poles", "title", "rtol", "efficiency", "factor", "table")


def rounded(seed: int) -> Drawn:
    """The drawn scene of a seed, rounded."""
    case, rng = drawn(seed), np.random.default_rng([seed, 77])
    scene = copy.deepcopy(case.scene)
    for part in ("shafts", "mechanism", "inertia", "load", "spring", "damper"):
        if part in scene:
            scene[part] = _value(rng, scene[part], part)
    for row in scene.get("load", []):
        _act(rng, row)
    return case._replace(scene=scene)


def short(number: float) -> float:
    """A number of one digit."""
    return float(f"{number:.1g}")


def _value(rng: Rng, value: Any, key: str) -> Any:
    """A value of a scene's table, rounded as its key asks for."""
    if key in KEPT or isinstance(value, bool):
        return value
    if isinstance(value, dict):
        return {name: _value(rng, each, name) for name, each in value.items()}
    if isinstance(value, list):
        return [_value(rng, each, key) for each in value]
    if isinstance(value, str):
        angle = re.fullmatch(r"(-?[\d.]+) deg", value) if key in ANGLES else None
        step = 90 if rng.random() < 0.6 else 45
        return value if angle is None else f"{round(float(angle[1]) / step) * step} deg"
    if key == "ratio":
        return float(rng.choice(RATIOS))
    if key in ANGLES or (key == "offset" and rng.random() < 0.6):
        return 0.0
    return short(float(value))


def _act(rng: Rng, row: Scene) -> None:
    """Most loads follow one of the laws, in windows that are not empty."""
    for key in ("force", "torque"):
        if key in row and rng.random() < 0.75:
            numbers = [abs(float(each)) for each in re.findall(r"(?<![\w.])\d+\.?\d*(?:e-?\d+)?", str(row[key]))]
            size, speed = (short(each) for each in ([*numbers, 1.0][0], max([*numbers[1:], 1.0][-2:][0], 0.1)))
            row[key] = str(rng.choice(LAWS)).format(a=size or 1.0, b=speed)
    if "from" in row and row["from"] == row["to"]:
        row["to"] = f"{int(row['from'].split()[0]) + 180} deg"
