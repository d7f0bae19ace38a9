"""Flywheels by a multibody code: Exudyn's rigid bodies and joints, and a root search over its cycles.

    PYTHON tests/benchmarks/by_exudyn.py NAME STEPS

with a Python that has exudyn; NAME is a slider-crank of `by_hand.SCRIPTS`, STEPS its steps in a cycle. Prints the flywheel
(kg m²), the time of the search (s) and the cycles that it ran, as JSON.
"""

from __future__ import annotations

import json
import sys
import time
from importlib import import_module
from math import cos
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.benchmarks.by_hand import PRESS, SCRIPTS, SECTION_C, TURN, Script, Sizes, balance, searched

SIZES = {"press": PRESS, "section-c": SECTION_C}
_TOLERANCE = 1e-6  # of the search
_LONGER = 1.1  # than a cycle at the speed it starts with; what goes past the cycle's end is cut off


class Multibody:
    """A slider-crank as bodies and joints, assembled once; its flywheel and its speed at phi = 0 change from run to run."""

    def __init__(self, script: Script, m: Sizes, steps: int) -> None:
        exu, parts = import_module("exudyn"), import_module("exudyn.utilities")
        self.script, self.sizes, self.steps, self.runs = script, m, steps, 0
        self.exu, self.container = exu, exu.SystemContainer()
        self.system = system = self.container.AddSystem()
        ground = system.AddObject(parts.ObjectGround())
        self.crank, crank = self._body(parts, 1e-9, m.crank, (0.0, 0.0))  # its weight is given as a torque
        self.rod, rod = self._body(parts, m.rod, m.spin, (m.r + m.com, 0.0))
        self.slider = system.AddNode(parts.NodePoint2D(referenceCoordinates=[m.r + m.length, 0.0]))
        slider = system.AddObject(parts.MassPoint2D(mass=m.slider, nodeNumber=self.slider))
        self.body = crank
        for one, at, other, there in (
            (ground, 0.0, crank, 0.0),
            (crank, m.r, rod, -m.com),
            (rod, m.length - m.com, slider, 0.0),
        ):
            markers = [self._marker(parts, body, x) for body, x in ((one, at), (other, there))]
            system.AddObject(parts.RevoluteJoint2D(markerNumbers=markers))
        self._guide(parts)
        self._loads(parts, crank, rod, slider)
        kinds = exu.OutputVariableType
        self.sensors = [
            system.AddSensor(parts.SensorNode(nodeNumber=self.crank, storeInternal=True, outputVariableType=kind))
            for kind in (kinds.Coordinates, kinds.Coordinates_t)
        ]
        system.Assemble()

    def _body(self, parts: Any, mass: float, inertia: float, at: tuple[float, float]) -> tuple[Any, Any]:
        node = self.system.AddNode(parts.NodeRigidBody2D(referenceCoordinates=[*at, 0.0]))
        return node, self.system.AddObject(parts.RigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))

    def _marker(self, parts: Any, body: Any, x: float) -> Any:
        return self.system.AddMarker(parts.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0.0, 0.0]))

    def _guide(self, parts: Any) -> None:
        zero = self.system.AddNode(parts.NodePointGround())
        markers = [
            self.system.AddMarker(parts.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))
            for node, k in ((zero, 0), (self.slider, 1))
        ]
        self.system.AddObject(parts.CoordinateConstraint(markerNumbers=markers))

    def _loads(self, parts: Any, crank: Any, rod: Any, slider: Any) -> None:
        script, m, system, kinds = self.script, self.sizes, self.system, self.exu.OutputVariableType
        rest, fall = script.motor or (balance(script), 0.0)
        low, high = script.window

        def torque(mbs: Any, t: float, load: Any) -> list[float]:
            phi, omega = mbs.GetNodeOutput(self.crank, kinds.Coordinates)[2], 0.0
            if fall:
                omega = mbs.GetNodeOutput(self.crank, kinds.Coordinates_t)[2]
            return [0.0, 0.0, rest - fall * omega - m.g * m.crank_moment * cos(phi)]

        def force(mbs: Any, t: float, load: Any) -> list[float]:
            phi = mbs.GetNodeOutput(self.crank, kinds.Coordinates)[2] % TURN
            return [script.force if low <= phi < high else 0.0, 0.0, 0.0]

        turning = system.AddMarker(parts.MarkerBodyRigid(bodyNumber=crank, localPosition=[0.0, 0.0, 0.0]))
        system.AddLoad(parts.Torque(markerNumber=turning, loadVectorUserFunction=torque))
        hung = self._marker(parts, rod, 0.0)
        system.AddLoad(parts.Force(markerNumber=hung, loadVector=[0.0, -m.rod * m.g, 0.0]))
        if script.force:
            pushed = self._marker(parts, slider, 0.0)
            system.AddLoad(parts.Force(markerNumber=pushed, loadVectorUserFunction=force))

    def _starts(self, omega: float) -> None:
        """Every body's velocity at phi = 0, where the crank and the rod lie in line."""
        m = self.sizes
        turn = -omega * m.r / m.length
        velocities = {
            self.crank: [0.0, 0.0, omega],
            self.rod: [0.0, omega * m.r + turn * m.com, turn],
            self.slider: [0.0, 0.0],
        }
        kind = self.exu.ConfigurationType.Initial
        coordinates = self.system.systemData.GetODE2Coordinates_t(kind)
        for node, own in velocities.items():
            first = self.system.GetNodeODE2Index(node)
            coordinates[first : first + len(own)] = own
        self.system.systemData.SetODE2Coordinates_t(coordinates, kind)

    def cycle(self, inertia: float, start: float) -> tuple[float, float, float]:
        """One cycle: the speed at its end and its extremes."""
        self.runs += 1
        system, exu = self.system, self.exu
        system.SetObjectParameter(self.body, "inertia", self.sizes.crank + inertia)
        self._starts(start)
        settings = exu.SimulationSettings()
        integration = settings.timeIntegration
        integration.endTime = _LONGER * TURN / start
        integration.numberOfSteps = round(_LONGER * self.steps)
        integration.newton.useModifiedNewton = True
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = integration.endTime / integration.numberOfSteps
        integration.verboseMode = 0
        solver = exu.DynamicSolverType.TrapezoidalIndex2
        if not system.SolveDynamic(settings, solverType=solver):
            raise RuntimeError("Exudyn does not get through the cycle")
        phi, omega = (system.GetSensorStoredData(sensor)[:, 3] for sensor in self.sensors)
        return self._looked(phi, omega)

    def _looked(self, phi: Any, omega: Any) -> tuple[float, float, float]:
        within = phi < TURN
        if within.all():
            raise RuntimeError("the cycle is not over in time")
        end = float(np.interp(TURN, phi, omega))
        inside = np.append(omega[within], end)
        return end, float(inside.max()), float(inside.min())


def main(name: str, steps: int) -> None:
    """Print the flywheel of a script's machine, the time and the number of cycles."""
    script = SCRIPTS[name]
    begun = time.perf_counter()
    bodies = Multibody(script, SIZES[name], steps)
    inertia = searched(script, bodies.cycle, _TOLERANCE)
    print(json.dumps({"inertia": inertia, "seconds": time.perf_counter() - begun, "cycles": bodies.runs}))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
