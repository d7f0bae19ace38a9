"""Flywheel and machine-regime design.

From a mechanism to its reduced inertia and moment, to an exact flywheel, to a time simulation that confirms it.

>>> import flywheel
>>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
...                        "drive": {"torque": "balance"}, "regime": {"speed": "300 rpm"},
...                        "flywheel": {"irregularity": 0.01}})
>>> result = flywheel.size(scene, simulate=False)
>>> round(result.balance.value, 9), round(result.flywheel.exact, 9)
(50.0, 15.915494309)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flywheel import (
        arm,
        energy,
        every_shaft,
        gearing,
        kinetostatics,
        load_models,
        masses,
        motors,
        multibody,
        presses,
        recovery,
        transients,
        two_speeds,
        wheel,
    )
    from flywheel.explaining import Explanation, explain
    from flywheel.faults import Fault, SceneError
    from flywheel.joints import JointForces, joint_forces
    from flywheel.machine import Machine
    from flywheel.pictures.animation import animate
    from flywheel.pictures.mechanisms import draw
    from flywheel.quinn import cycle_shares, shares
    from flywheel.reading.scenes import load
    from flywheel.results import Sizing
    from flywheel.scene import Scene
    from flywheel.simulation import Motion, simulate
    from flywheel.sizing import size
    from flywheel.state import MachineState, reduce
    from flywheel.stroke import along
    from flywheel.tradeoffs.comparison import tradeoff
    from flywheel.tradeoffs.result import Tradeoff
    from flywheel.transients.record import Transient
    from flywheel.transients.regime import time_along
    from flywheel.transients.running import run_down, run_up, transient

_HOMES = {
    "Explanation": "explaining",
    "Fault": "faults",
    "JointForces": "joints",
    "Machine": "machine",
    "MachineState": "state",
    "Motion": "simulation",
    "Scene": "scene",
    "SceneError": "faults",
    "Sizing": "results",
    "Tradeoff": "tradeoffs.result",
    "Transient": "transients.record",
    "along": "stroke",
    "animate": "pictures.animation",
    "cycle_shares": "quinn",
    "draw": "pictures.mechanisms",
    "explain": "explaining",
    "joint_forces": "joints",
    "load": "reading.scenes",
    "reduce": "state",
    "run_down": "transients.running",
    "run_up": "transients.running",
    "shares": "quinn",
    "simulate": "simulation",
    "size": "sizing",
    "time_along": "transients.regime",
    "tradeoff": "tradeoffs.comparison",
    "transient": "transients.running",
}

_MODULES = (
    *("arm", "energy", "every_shaft", "gearing", "kinetostatics", "load_models", "masses", "motors"),
    *("multibody", "presses", "recovery", "transients", "two_speeds", "wheel"),
)
"""Parts of the library whose names are used with theirs: `flywheel.wheel.choose`."""

__all__ = [
    "Explanation",
    "Fault",
    "JointForces",
    "Machine",
    "MachineState",
    "Motion",
    "Scene",
    "SceneError",
    "Sizing",
    "Tradeoff",
    "Transient",
    "along",
    "animate",
    "arm",
    "cycle_shares",
    "draw",
    "energy",
    "every_shaft",
    "explain",
    "gearing",
    "joint_forces",
    "kinetostatics",
    "load",
    "load_models",
    "masses",
    "motors",
    "multibody",
    "presses",
    "recovery",
    "reduce",
    "run_down",
    "run_up",
    "shares",
    "simulate",
    "size",
    "time_along",
    "tradeoff",
    "transient",
    "transients",
    "two_speeds",
    "wheel",
]


def __getattr__(name: str) -> Any:
    """Import a public name, or a part of the library, on first use (PEP 562): `import flywheel` itself costs nothing."""
    if name == "__version__":
        from importlib.metadata import version

        return version("flywheel-design")
    if name in _MODULES:
        return import_module(f"flywheel.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module 'flywheel' has no attribute {name!r}")
    value = getattr(import_module(f"flywheel.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
