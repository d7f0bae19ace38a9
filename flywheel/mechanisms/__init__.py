"""The families of mechanisms, one file each; a family's file is imported when a mechanism of its type is built."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING

from flywheel.faults import Fault, SceneError

if TYPE_CHECKING:
    from flywheel.mechanisms.base import Family
    from flywheel.scene import Mechanism

__all__ = ["TYPES", "build"]

TYPES = ("scotch-yoke", "slider-crank", "four-bar", "crank-shaper", "toggle-clamp", "law", "linkage")
_NO_PARAMETERS: Mapping[str, float] = MappingProxyType({})


def build(mechanism: Mechanism, parameters: Mapping[str, float] = _NO_PARAMETERS) -> Family:
    """The mechanism as a chain of velocities with positions; `parameters` (SI) are in scope of a law's expressions.

    Raises `SceneError` for a mechanism that cannot turn: each fault names the length's path and the angles of the crank
    where it locks.
    """
    if mechanism.type not in TYPES:
        raise SceneError([Fault(f"{mechanism.path}.type", repr(mechanism.type), "one of " + ", ".join(TYPES))])
    module = import_module(f"flywheel.mechanisms.{mechanism.type.replace('-', '_')}")
    if mechanism.type == "law":
        return module.family(mechanism, parameters)  # type: ignore[no-any-return]
    if mechanism.type != "linkage" and (faults := module.faults(mechanism)):  # a linkage's own come of following it
        raise SceneError(faults)
    return module.family(mechanism)  # type: ignore[no-any-return]
