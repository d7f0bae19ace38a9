"""The worked report of a scene: every step as formula, substitution and result, as one HTML file or PDF.

>>> import flywheel
>>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"},
...                        "flywheel": {"irregularity": 0.02}})
>>> flywheel.report.html(scene, language="es").splitlines()[1]
'<html lang="es">'
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flywheel.report.contents import html, worked, write

__all__ = ["html", "worked", "write"]

_HOMES = {"html": "contents", "worked": "contents", "write": "contents"}


def __getattr__(name: str) -> Any:
    """Imports a public name on first use."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module 'flywheel.report' has no attribute {name!r}")
    return getattr(import_module(f"flywheel.report.{_HOMES[name]}"), name)
