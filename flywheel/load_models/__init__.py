"""Loads of machines of known kinds: what each does as a formula, and compiled to an expression of phi, omega, x and v.

A force or torque is positive along the positive sense of its place; what resists the motion is negative while v > 0.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flywheel.load_models import belts, compressors, gas, presses, resistance

__all__ = ["belts", "compressors", "gas", "presses", "resistance"]


def __getattr__(name: str) -> Any:
    """Import one of its modules on first use (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f"module 'flywheel.load_models' has no attribute {name!r}")
    return import_module(f"flywheel.load_models.{name}")


def __dir__() -> list[str]:
    return sorted(__all__)
