"""The wheel itself: a disc, a rim, or a rim on arms, of a material, for an inertia; its mass, stresses and safety.

>>> from flywheel.wheel import WheelAsked, choose, material
>>> wheel = choose(10.0, 100.0, WheelAsked("disc", material("carbon steel"), outer_radius=0.3))
>>> round(wheel.body.width, 6), round(wheel.mass, 3), wheel.warnings
(0.100121, 222.222, ())
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flywheel.wheel.asked import WheelAsked
    from flywheel.wheel.bodies import Body, Hub, Part, inertia, parts, stress
    from flywheel.wheel.choosing import choose, least_mass
    from flywheel.wheel.materials import MATERIALS, Material, material
    from flywheel.wheel.result import Wheel, wheel_of

_HOMES = {
    "MATERIALS": "materials",
    "Body": "bodies",
    "Hub": "bodies",
    "Material": "materials",
    "Part": "bodies",
    "Wheel": "result",
    "WheelAsked": "asked",
    "choose": "choosing",
    "inertia": "bodies",
    "least_mass": "choosing",
    "material": "materials",
    "parts": "bodies",
    "stress": "bodies",
    "wheel_of": "result",
}

__all__ = [
    "MATERIALS",
    "Body",
    "Hub",
    "Material",
    "Part",
    "Wheel",
    "WheelAsked",
    "choose",
    "inertia",
    "least_mass",
    "material",
    "parts",
    "stress",
    "wheel_of",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'flywheel.wheel' has no attribute {name!r}")
    value = getattr(import_module(f"flywheel.wheel.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
