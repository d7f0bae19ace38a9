"""Which libraries, and which parts of the package, have been imported: not every scene needs every one."""

from __future__ import annotations

import sys
from collections.abc import Container, Mapping

NOW, BEFORE, NOT = "loaded by this run", "loaded before it", "not loaded"
PARTS: Mapping[str, str] = {
    "numpy": "arrays",
    "scipy": "the integrator of time stepping, pchip tables",
    "sympy": "symbolic mathematics",
    "matplotlib": "pictures",
    "flywheel.features": "intervals, for breakpoints of expressions",
    "flywheel.constant_speed": "torques taken at a constant speed",
    "flywheel.by_areas": "bounds of the exact figure",
    "flywheel.collocation": "periodic collocation with Newton's method",
    "flywheel.collocated": "confirmation by collocation",
    "flywheel.stepping": "time stepping",
    "flywheel.implicit": "implicit steps in time",
    "flywheel.one_cycle": "one cycle in time",
    "flywheel.fate": "following a machine that has no steady motion",
    "flywheel.joint_friction": "friction in joints",
    "flywheel.kinetostatics": "driving forces and reactions in joints",
    "flywheel.joints": "reactions along the machine's motion",
    "flywheel.multibody": "equations of motion with multipliers",
    "flywheel.linkage.continuation": "positions of linkages by Newton-Raphson",
    "flywheel.built": "the wheel to be built",
    "bondgraph.symbolic": "symbolic equations of the bond graph",
}
"""Libraries and parts of the package that not every scene needs, with what they are for."""

LIBRARIES = ("numpy", "scipy", "sympy", "matplotlib")


def states(before: Container[str]) -> dict[str, str]:
    """Of every library and part whether it is loaded now; `before` are the modules that were loaded earlier.

    >>> import numpy
    >>> states(()).get("numpy"), states({"numpy"}).get("numpy")
    ('loaded by this run', 'loaded before it')
    """
    return {name: _state(name, before) for name in PARTS}


def _state(name: str, before: Container[str]) -> str:
    if name not in sys.modules:
        return NOT
    return BEFORE if name in before else NOW
