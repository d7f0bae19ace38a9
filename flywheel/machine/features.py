"""Where a machine breaks and where it is steep: dead centres, switch angles, narrow features of expressions.

All of it comes from proven bounds (intervals) of positions, influence coefficients and expressions, walked through the
same bond graph; nothing is sampled. Only scenes with expressions, or loads that act one way, pay for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Here
from bondgraph.reduction import Reduction
from flywheel.machine.loads import Effort
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.intervals import (
    CELL_CAP,
    Enclosures,
    Interval,
    SwitchingError,
    Values,
    breakpoints,
    resolved,
    roots_in_pieces,
)
from flywheel.numerics.intervals import NAMESPACE as INTERVALS
from flywheel.numerics.jets import Jet

if TYPE_CHECKING:
    from flywheel.machine.machine import Machine

Array = NDArray[np.float64]

_MOST_SOLVED = 4_000  # cells; a stroke without a dwell takes 32


def dead_centres(reduction: Reduction, junction: str, edges: Array, *, solved: bool = False) -> Array:
    """Crank angles at which the velocity of a 1-junction changes sign, between edges inside which it is smooth.

    They are the roots of its influence coefficient. `solved`: the positions are those of a linkage, whose bounds take a
    thousand times as long as a formula's.
    """
    variable = reduction.variable[junction]

    def enclose(lo: Array, hi: Array, anchor: Array) -> tuple[Any, Any]:
        flows = reduction.flows(Interval(lo, hi), anchor, INTERVALS)
        return flows.gain[variable], flows.slope[variable]

    def value(phi: Array, anchor: Array) -> Any:
        return reduction.flows(phi, anchor).gain[variable]

    return roots_in_pieces(enclose, value, edges, _MOST_SOLVED if solved else CELL_CAP)[1:-1]


def switch_angles(machine: Machine, effort: Effort, known: Array) -> list[float]:
    """Crank angles at which a branch of a load's expression changes, beside those known already (from 0 to the cycle)."""
    law = effort.load.law
    if not isinstance(law, Expression) or not (law.switches() or law.branch_points()):
        return []
    env, values = _environment(machine, effort)
    try:
        return breakpoints(law, 0.0, float(known[-1]), env, values, known)
    except SwitchingError as error:
        raise _fault(effort, error) from None


def narrowed(machine: Machine, effort: Effort, edges: Array) -> Array:
    """The edges with cells added wherever a load's expression is too steep for the cell that it lies in.

    What depends on speed is taken at the machine's typical one.
    """
    lo, hi = edges[:-1], edges[1:]
    active = np.broadcast_to(effort.active_at(0.5 * (lo + hi)), lo.shape)
    if not isinstance(effort.load.law, Expression) or not active.any():
        return edges
    env, values = _environment(machine, effort)
    middle = 0.5 * (lo + hi)
    for ends in (lo, hi):
        _check_bounded(effort, values, ends[active], middle[active])
    try:
        splits = resolved(effort.load.law, lo[active], hi[active], env, values)
    except SwitchingError as error:
        raise _fault(effort, error) from None
    return np.array(sorted({*edges.tolist(), *splits.tolist()}))


def _check_bounded(effort: Effort, values: Values, phi: Array, anchor: Array) -> None:
    """Refuse an expression that is infinite at the end of a cell; one that is only not defined there is another matter."""
    law = effort.load.law
    if isinstance(law, Expression):
        with np.errstate(all="ignore"):
            found = law.evaluate(values(phi, anchor), np, values(anchor, anchor)) + 0.0 * phi
        if np.isinf(found).any():
            at = int(np.isinf(found).argmax())
            here, middle = phi[at], anchor[at]
            reason = law.undefined(values(here, middle), values(middle, middle))
            where = "phi = {near}" if effort.load.once else f"crank angle {np.degrees(here):.6g} deg"
            raise _fault(effort, SwitchingError(f"a value that is not finite at {where} ({reason})", float(here)))


def undefined(machine: Machine, effort: Effort, phi: float, anchor: float, speed: float | None, time: float) -> str:
    """What leaves an expression without a finite value at a crank angle (rad), speed (rad/s) and time (s), in words."""
    law = effort.load.law
    if not isinstance(law, Expression):
        return ""
    with np.errstate(all="ignore"):
        values = _environment(machine, effort, speed)[1]
        here, middle = np.asarray(phi), np.asarray(anchor)
        return law.undefined({**values(here, middle), "t": time}, {**values(middle, middle), "t": time})


def _fault(effort: Effort, error: SwitchingError) -> SceneError:
    span, origin = ("stroke", effort.place.phase) if effort.load.once else ("cycle", 0.0)
    found = str(SwitchingError(error.text, error.near + origin))
    return SceneError([Fault(effort.path, found, f"an expression that can be followed over the {span}")])


def _environment(machine: Machine, effort: Effort, speed: float | None = None) -> tuple[Enclosures, Values]:
    """What the names of a load's expression stand for: jets of intervals over cells of phi, and plain values.

    Which turn of the load's angle they lie in is the anchor's to say, as at the end of a turn rounding could not. The
    crank's `speed` (rad/s) is the machine's typical one where none is given.
    """
    place, names = effort.place, effort.load.law.names  # type: ignore[union-attr]
    reduction, motion = machine.rigid, machine.motion_of(effort.load.on)
    crank_speed = machine.typical_speed if speed is None else speed
    variable = reduction.variable[place.junction]
    gains = reduction.flows(0.0, 0.0).gain
    rate = float(gains[reduction.variable[motion.of]])
    own_speed = crank_speed * (float(gains[variable]) if place.shaft else rate)

    def origin(anchor: Array) -> Any:
        return place.phase - effort.turns(place.rate * anchor + place.phase)

    def environment(phi: Any, anchor: Array, ns: Any) -> Mapping[str, Any]:
        bounds = ns is INTERVALS
        angle = place.rate * phi + origin(anchor)
        found = {**effort.constants, "omega": own_speed, "t": 0.0, "phi": Jet(angle, place.rate) if bounds else angle}
        if "v" in names and effort.senses is not None:
            found["v"] = effort.senses.at(anchor)
        needs_gain = effort.uses_speed or ("x" in names and bounds)
        gain: Any = reduction.flows(phi, anchor, ns).gain[variable] if needs_gain else 0.0
        if effort.uses_speed:
            found["v"] = crank_speed * gain
        if "x" in names:
            x = place.displacement(Here(rate * phi, motion.position(rate * phi, ns, rate * anchor), ns))
            found["x"] = Jet(x, gain) if bounds else x
        return found

    def cells(lo: Array, hi: Array, anchor: Array) -> Mapping[str, Any]:
        return environment(Interval(lo, hi), anchor, INTERVALS)

    def values(phi: Array, anchor: Array) -> Mapping[str, Any]:
        return environment(phi, anchor, np)

    return cells, values
