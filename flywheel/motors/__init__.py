"""Motors: the torque that each gives at a speed, one file a kind; a kind's file is imported when it is first used."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flywheel.motors.base import Motor, Point
    from flywheel.motors.curve import Curve
    from flywheel.motors.dc import DC, dc_from_plate
    from flywheel.motors.engine import Engine
    from flywheel.motors.induction import Induction
    from flywheel.motors.lines import Constant, Line, line_from_no_load, line_through

_HOMES = {
    "Motor": "base",
    "Point": "base",
    "Curve": "curve",
    "DC": "dc",
    "dc_from_plate": "dc",
    "Engine": "engine",
    "Induction": "induction",
    "Constant": "lines",
    "Line": "lines",
    "line_from_no_load": "lines",
    "line_through": "lines",
}

__all__ = [
    "DC",
    "Constant",
    "Curve",
    "Engine",
    "Induction",
    "Line",
    "Motor",
    "Point",
    "dc_from_plate",
    "line_from_no_load",
    "line_through",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'flywheel.motors' has no attribute {name!r}")
    value = getattr(import_module(f"flywheel.motors.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
