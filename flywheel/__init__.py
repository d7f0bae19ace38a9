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

import sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flywheel import report
    from flywheel.components import energy, load_models, motors
    from flywheel.components import equivalent_masses as masses
    from flywheel.components import gear_trains as every_shaft
    from flywheel.components import gear_trains as gearing
    from flywheel.components import press_work as presses
    from flywheel.components import press_work as recovery
    from flywheel.components import press_work as two_speeds
    from flywheel.components import robot_arm as arm
    from flywheel.components import wheels as wheel
    from flywheel.designs.catalogue import SuitableMotors, suitable_motors
    from flywheel.designs.optimum import Optimum, optimize
    from flywheel.designs.sensitivities import Sensitivities, sensitivities
    from flywheel.designs.sweep import Sweep, sweep
    from flywheel.designs.tolerance import Tolerance, tolerance
    from flywheel.machine.machine import Machine
    from flywheel.mechanisms.linkages import lagrange as freedoms
    from flywheel.mechanisms.linkages import multibody
    from flywheel.mechanisms.linkages import reactions as kinetostatics
    from flywheel.motions import transients
    from flywheel.motions.joint_forces import JointForces, joint_forces
    from flywheel.motions.kinematics import Kinematics, motion
    from flywheel.motions.kinetic_energy import cycle_shares, shares, stored_energy
    from flywheel.motions.simulation import Motion, simulate
    from flywheel.motions.transients import Transient, run_down, run_up, time_along, transient
    from flywheel.motions.velocities import instant_centres
    from flywheel.numerics.faults import Fault, SceneError
    from flywheel.pictures import notebooks
    from flywheel.pictures.mechanisms import animate, draw
    from flywheel.reading.scenes import load, load_linkage
    from flywheel.regime.state import MachineState, along, reduce
    from flywheel.scene.scene import Scene
    from flywheel.sizing import duty
    from flywheel.sizing.power_flow import PowerFlow, power_flow
    from flywheel.sizing.results import Sizing, Sizings
    from flywheel.sizing.sizing import size
    from flywheel.study.tradeoff import Tradeoff, tradeoff
    from flywheel.tables.explanation import Explanation, explain

_HOMES = {
    "Explanation": "tables.explanation",
    "Fault": "numerics.faults",
    "JointForces": "motions.joint_forces",
    "Kinematics": "motions.kinematics",
    "Machine": "machine.machine",
    "MachineState": "regime.state",
    "Motion": "motions.simulation",
    "Optimum": "designs.optimum",
    "PowerFlow": "sizing.power_flow",
    "Scene": "scene.scene",
    "SceneError": "numerics.faults",
    "Sensitivities": "designs.sensitivities",
    "Sizing": "sizing.results",
    "Sizings": "sizing.results",
    "SuitableMotors": "designs.catalogue",
    "Sweep": "designs.sweep",
    "Tolerance": "designs.tolerance",
    "Tradeoff": "study.tradeoff",
    "Transient": "motions.transients",
    "along": "regime.state",
    "animate": "pictures.mechanisms",
    "cycle_shares": "motions.kinetic_energy",
    "draw": "pictures.mechanisms",
    "explain": "tables.explanation",
    "instant_centres": "motions.velocities",
    "joint_forces": "motions.joint_forces",
    "load": "reading.scenes",
    "load_linkage": "reading.scenes",
    "motion": "motions.kinematics",
    "optimize": "designs.optimum",
    "power_flow": "sizing.power_flow",
    "reduce": "regime.state",
    "run_down": "motions.transients",
    "run_up": "motions.transients",
    "sensitivities": "designs.sensitivities",
    "shares": "motions.kinetic_energy",
    "simulate": "motions.simulation",
    "size": "sizing.sizing",
    "stored_energy": "motions.kinetic_energy",
    "sweep": "designs.sweep",
    "time_along": "motions.transients",
    "suitable_motors": "designs.catalogue",
    "tolerance": "designs.tolerance",
    "tradeoff": "study.tradeoff",
    "transient": "motions.transients",
}

_MODULES = {
    "arm": "components.robot_arm",
    "arm.dynamics": "components.robot_arm",
    "arm.equations": "components.robot_arm",
    "arm.motion": "components.robot_arm",
    "duty": "sizing.duty",
    "energy": "components.energy",
    "every_shaft": "components.gear_trains",
    "freedoms": "mechanisms.linkages.lagrange",
    "gearing": "components.gear_trains",
    "kinetostatics": "mechanisms.linkages.reactions",
    "linkage": "mechanisms.linkages",
    "linkage.description": "scene.linkage",
    "linkage.instant_centres": "mechanisms.linkages.instant_centres",
    "linkage.poses": "mechanisms.linkages.positions",
    "linkage.solution": "mechanisms.linkages.positions",
    "load_models": "components.load_models",
    "load_models.belts": "components.load_models",
    "load_models.compressors": "components.gas_forces",
    "load_models.gas": "components.gas_forces",
    "load_models.presses": "components.load_models",
    "load_models.resistance": "components.load_models",
    "masses": "components.equivalent_masses",
    "motors": "components.motors",
    "multibody": "mechanisms.linkages.multibody",
    "notebooks": "pictures.notebooks",
    "presses": "components.press_work",
    "recovery": "components.press_work",
    "results": "sizing.results",
    "simulation": "motions.simulation",
    "stroke": "regime.state",
    "sweeps": "tables.sweeps",
    "transients": "motions.transients",
    "two_speeds": "components.press_work",
    "wheel": "components.wheels",
    "writing": "tables",
    "writing.digits": "numerics.units",
}
"""Parts of the library by the names under which users import them: `flywheel.wheel.choose`."""

__all__ = [
    "Explanation",
    "Fault",
    "JointForces",
    "Kinematics",
    "Machine",
    "MachineState",
    "Motion",
    "Optimum",
    "PowerFlow",
    "Scene",
    "SceneError",
    "Sensitivities",
    "Sizing",
    "Sizings",
    "SuitableMotors",
    "Sweep",
    "Tolerance",
    "Tradeoff",
    "Transient",
    "along",
    "animate",
    "arm",
    "cycle_shares",
    "draw",
    "duty",
    "energy",
    "every_shaft",
    "explain",
    "freedoms",
    "gearing",
    "instant_centres",
    "joint_forces",
    "kinetostatics",
    "load",
    "load_linkage",
    "load_models",
    "masses",
    "motion",
    "motors",
    "multibody",
    "notebooks",
    "optimize",
    "power_flow",
    "presses",
    "recovery",
    "reduce",
    "report",
    "run_down",
    "run_up",
    "sensitivities",
    "shares",
    "simulate",
    "size",
    "stored_energy",
    "suitable_motors",
    "sweep",
    "time_along",
    "tolerance",
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
    if name in _MODULES or name == "report":
        return import_module(f"flywheel.{_MODULES.get(name, name)}")
    if name not in _HOMES:
        raise AttributeError(f"module 'flywheel' has no attribute {name!r}")
    value = getattr(import_module(f"flywheel.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


class _Names:
    """Imports a part of the library by its public name: `from flywheel.wheel import choose`.

    A finder and a loader by what it does: the classes of `importlib.abc` take as long to import as a tenth of numpy.
    """

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Where a public name leads; None for every other module."""
        loader: Any = self
        return ModuleSpec(fullname, loader) if fullname.removeprefix("flywheel.") in _MODULES else None

    def create_module(self, spec: ModuleSpec) -> None:
        """An empty module, whose place its home takes."""

    def exec_module(self, module: ModuleType) -> None:
        """The home of the name in its place, which names of its parts are found under too."""
        home = import_module(f"flywheel.{_MODULES[module.__name__.removeprefix('flywheel.')]}")
        home.__dict__.setdefault("__path__", [])
        sys.modules[module.__name__] = home


sys.meta_path.insert(0, _Names())  # ahead of the folders, which would import a part of `flywheel.linkage` a second time


def __dir__() -> list[str]:
    return sorted(__all__)
