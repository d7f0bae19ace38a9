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
        duty,
        energy,
        every_shaft,
        freedoms,
        gearing,
        kinetostatics,
        load_models,
        masses,
        motors,
        multibody,
        notebooks,
        presses,
        recovery,
        report,
        transients,
        two_speeds,
        wheel,
    )
    from flywheel.designs.catalogue import SuitableMotors, suitable_motors
    from flywheel.designs.optimum import Optimum, optimize
    from flywheel.designs.pareto import pareto
    from flywheel.designs.sweep import sweep
    from flywheel.designs.sweep_results import Sweep
    from flywheel.designs.tolerance import Tolerance, tolerance
    from flywheel.designs.variation import Sensitivities, sensitivities
    from flywheel.machine.machine import Machine
    from flywheel.motions.joint_forces import JointForces, joint_forces
    from flywheel.motions.kinematics import Kinematics, motion
    from flywheel.motions.kinetic_energy import cycle_shares, shares, stored_energy
    from flywheel.motions.motion import Motion, Transient, time_along
    from flywheel.motions.simulation import simulate
    from flywheel.motions.single_stroke import SingleStroke, single_stroke
    from flywheel.motions.transients import run_down, run_up, transient
    from flywheel.motions.velocities import instant_centres
    from flywheel.numerics.faults import Fault, SceneError
    from flywheel.pictures.animation import animate
    from flywheel.pictures.mechanisms import draw
    from flywheel.reading.scenes import load, load_linkage
    from flywheel.regime.state import MachineState, along, reduce
    from flywheel.scene.scene import Scene
    from flywheel.sizing.power_flow import power_flow
    from flywheel.sizing.results import PowerFlow, Sizing, Sizings
    from flywheel.sizing.sizing import size
    from flywheel.study.tradeoff import Tradeoff, tradeoff
    from flywheel.tables.explanation import Explanation, explain

_NAMES = {
    "scene.scene": "Scene",
    "numerics.faults": "Fault SceneError",
    "reading.scenes": "load load_linkage",
    "machine.machine": "Machine",
    "regime.state": "MachineState along reduce",
    "sizing.sizing": "size",
    "sizing.results": "PowerFlow Sizing Sizings",
    "sizing.power_flow": "power_flow",
    "motions.motion": "Motion Transient time_along",
    "motions.simulation": "simulate",
    "motions.transients": "run_down run_up transient",
    "motions.single_stroke": "SingleStroke single_stroke",
    "motions.kinematics": "Kinematics motion",
    "motions.velocities": "instant_centres",
    "motions.kinetic_energy": "cycle_shares shares stored_energy",
    "motions.joint_forces": "JointForces joint_forces",
    "designs.sweep": "sweep",
    "designs.sweep_results": "ParetoFront Sweep",
    "designs.variation": "Sensitivities sensitivities",
    "designs.tolerance": "Tolerance tolerance",
    "designs.optimum": "Optimum optimize",
    "designs.pareto": "pareto",
    "designs.catalogue": "SuitableMotors suitable_motors",
    "study.tradeoff": "Tradeoff tradeoff",
    "tables.explanation": "Explanation explain",
    "pictures.mechanisms": "draw",
    "pictures.animation": "animate",
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}

_PARTS = (
    "arm", "duty", "energy", "every_shaft", "freedoms", "gearing", "kinetostatics", "linkage", "load_models", "masses",
    "motors", "multibody", "notebooks", "presses", "recovery", "report", "stroke", "transients", "two_speeds",
    "wheel",
)  # fmt: skip
"""Parts of the library, modules of these names: `flywheel.wheel.choose`."""

__all__ = [
    "Explanation", "Fault", "JointForces", "Kinematics", "Machine", "MachineState", "Motion", "Optimum", "ParetoFront",
    "PowerFlow", "Scene", "SceneError", "Sensitivities", "SingleStroke", "Sizing", "Sizings", "SuitableMotors", "Sweep",
    "Tolerance", "Tradeoff", "Transient", "along", "animate", "arm", "cycle_shares", "draw", "duty", "energy",
    "every_shaft", "explain", "freedoms", "gearing", "instant_centres", "joint_forces", "kinetostatics", "load",
    "load_linkage", "load_models", "masses", "motion", "motors", "multibody", "notebooks", "optimize", "pareto",
    "power_flow", "presses", "recovery", "reduce", "report", "run_down", "run_up", "sensitivities", "shares",
    "simulate", "single_stroke", "size", "stored_energy", "suitable_motors", "sweep", "time_along", "tolerance",
    "tradeoff", "transient", "transients", "two_speeds", "wheel",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Imports a public name, or a part of the library, on first use (PEP 562): `import flywheel` itself costs nothing."""
    if name == "__version__":
        from importlib.metadata import version

        return version("flywheel-design")
    if name in _PARTS:
        return import_module(f"flywheel.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module 'flywheel' has no attribute {name!r}")
    value = getattr(import_module(f"flywheel.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
