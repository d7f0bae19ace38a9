"""The records that a scene consists of, and the levels of accuracy; uses `numerics` and `components`."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flywheel.scene.scene import Scene

__all__ = ["Scene"]


def __getattr__(name: str) -> Any:
    """The record of a scene, on first use (PEP 562): it brings numpy."""
    if name != "Scene":
        raise AttributeError(f"module 'flywheel.scene' has no attribute {name!r}")
    from flywheel.scene.scene import Scene

    return Scene
