"""Any plane linkage: positions, mobility, joint reactions and multibody dynamics; uses `scene` and `numerics`.

It is `flywheel.linkage` to users, and the home of what describes a linkage and of its positions.

>>> from flywheel.linkage import Joint, Link, Linkage, Point, solve
>>> o, a = Point("O"), Point("A", 0.1)
>>> crank = Linkage(Link("frame", (o,)), (Link("crank", (o, a)),), (Joint("O", "pin", "frame", "crank", o, o),), "O")
>>> [round(float(x), 9) for x in solve(crank, 0.0, 6.28).poses(1.0).point("crank", a).value[:, 0]]
[0.054030231, 0.084147098]
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flywheel.mechanisms.linkages.positions import Poses, Solution, solve, solve_over
    from flywheel.scene.linkage import Coupling, Joint, Lift, Link, Linkage, Point, Side

_HOMES = {
    **dict.fromkeys(("Coupling", "Joint", "Lift", "Link", "Linkage", "Point", "Side"), "flywheel.scene.linkage"),
    **dict.fromkeys(("Poses", "Solution", "solve", "solve_over"), "flywheel.mechanisms.linkages.positions"),
}

__all__ = [
    "Coupling",
    "Joint",
    "Lift",
    "Link",
    "Linkage",
    "Point",
    "Poses",
    "Side",
    "Solution",
    "solve",
    "solve_over",
]


def __getattr__(name: str) -> Any:
    """A name of the description or of the positions, imported on first use (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
