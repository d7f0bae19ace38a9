"""Where a machine breaks and where it is steep: dead centres, switch angles, narrow features of expressions.

All of it comes from proven bounds (intervals) of positions, influence coefficients and expressions, walked through the
same bond graph; nothing is sampled. Only scenes with expressions, or loads that act one way, pay for it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Here
from flywheel.expressions import Expression
from flywheel.faults import Fault, SceneError
from flywheel.intervals import NAMESPACE as INTERVALS
from flywheel.intervals import Interval
from flywheel.jets import Jet
from flywheel.loads import Effort
from flywheel.resolution import resolved
from flywheel.switching import SwitchingError, breakpoints, roots

if TYPE_CHECKING:
    from flywheel.machine import Machine

Array = NDArray[np.float64]


def dead_centres(machine: Machine, junction: str, edges: Array) -> Array:
    """Crank angles at which the velocity of a 1-junction changes sign, between edges inside which it is smooth."""
    variable = machine.reduction.variable[junction]

    def enclose(lo: Array, hi: Array) -> tuple[Any, Any]:
        flows = machine.reduction.flows(Interval(lo, hi), 0.5 * (lo + hi), INTERVALS)
        return flows.gain[variable], flows.slope[variable]

    def value(phi: Array) -> Any:
        return machine.reduction.flows(phi, machine.middles(edges, phi)).gain[variable]

    found = [root for a, b in itertools.pairwise(edges) for root in roots(enclose, value, a, b)]
    return np.array(sorted({*edges[1:-1].tolist(), *found}))


def switch_angles(machine: Machine, effort: Effort, known: Array) -> list[float]:
    """Crank angles inside the cycle at which a branch of a load's expression changes, beside those known already."""
    law = effort.load.law
    if not isinstance(law, Expression) or not (law.switches() or law.branch_points()):
        return []
    env, values = _environment(machine, effort)
    try:
        return breakpoints(law, 0.0, machine.scene.cycle, env, values, known)
    except SwitchingError as error:
        raise _fault(effort, error) from None


def closed_in(machine: Machine, edges: Array) -> Array:
    """The edges with cells added wherever an expression is too steep for the cell that it lies in."""
    for effort in machine.efforts:
        if isinstance(effort.load.law, Expression):
            env, values = _environment(machine, effort)
            lo, hi = edges[:-1], edges[1:]
            active = np.broadcast_to(machine.active(effort, 0.5 * (lo + hi)), lo.shape)
            if not active.any():
                continue
            try:
                splits = resolved(effort.load.law, lo[active], hi[active], env, values)
            except SwitchingError as error:
                raise _fault(effort, error) from None
            edges = np.array(sorted({*edges.tolist(), *splits.tolist()}))
    return edges


def _fault(effort: Effort, error: SwitchingError) -> SceneError:
    key = "torque" if effort.load.path == "drive" or "." not in effort.load.on else "force or torque"
    fault = Fault(f"{effort.load.path} ({key})", str(error), "an expression that can be followed over the cycle")
    return SceneError([fault])


Environment = Callable[[Array, Array], Mapping[str, Any]]


def _environment(machine: Machine, effort: Effort) -> tuple[Environment, Callable[[Array], Mapping[str, Any]]]:
    """What the names of a load's expression stand for: jets of intervals over cells of phi, and plain values."""
    place, names = effort.place, effort.load.law.names  # type: ignore[union-attr]
    motion = machine.motion_of(effort.load.on)
    variable = machine.reduction.variable.get(place.junction)

    def turns(middle: Array) -> Array:
        return effort.every * np.floor((place.rate * middle + place.phase) / effort.every)

    def cells(lo: Array, hi: Array) -> Mapping[str, Any]:
        middle = 0.5 * (lo + hi)
        cell = Interval(lo, hi)
        found: dict[str, Any] = dict(effort.constants)
        found["phi"] = Jet(place.rate * cell + (place.phase - turns(middle)), place.rate)
        if "x" in names and variable is not None:
            q = _rate(machine, motion.of) * cell
            position = motion.position(q, INTERVALS, _rate(machine, motion.of) * middle)
            gain = machine.reduction.flows(cell, middle, INTERVALS).gain[variable]
            found["x"] = Jet(place.displacement(Here(q, position, INTERVALS)), gain)
        if "v" in names and effort.senses is not None:
            found["v"] = effort.senses.at(middle)
        return found

    def values(phi: Array) -> Mapping[str, Any]:
        found: dict[str, Any] = dict(effort.constants)
        found["phi"] = place.rate * phi + place.phase - turns(phi)
        if "x" in names:
            q = _rate(machine, motion.of) * phi
            found["x"] = place.displacement(Here(q, motion.position(q, np, q), np))
        if "v" in names and effort.senses is not None:
            found["v"] = effort.senses.at(phi)
        return found

    return cells, values


def _rate(machine: Machine, junction: str) -> float:
    return float(machine.reduction.flows(0.0, 0.0).gain[machine.reduction.variable[junction]])
