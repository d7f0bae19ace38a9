"""Forces in the joints of a machine as text, CSV and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.mechanisms.linkages.statics import DRIVE
from flywheel.motions.joint_forces import (
    DRIVER,
    DRIVING,
    TIME,
    Axis,
    ForceCurve,
    JointForces,
    axis,
    figures_of,
    force_curves,
)
from flywheel.numerics.units import columns, figure
from flywheel.scene.scene import Scene
from flywheel.tables import rows

Array = NDArray[np.float64]

_DIGITS = 1e-9  # relative residual of the equations above which it is told


def text(scene: Scene, forces: JointForces, dense: JointForces | None = None) -> str:
    """Tables for reading: every joint's components over the crank angle in deg, or the slide's position in m.

    dense: the same at more positions, over which the largest forces are then taken.
    """
    sliding = scene.reduction_element == "slide"
    coordinate = ("x", "m") if sliding else ("phi", "deg")

    def by_position(forces: JointForces, found: Reactions) -> Reactions:
        """The same figures against the position that a reader knows: the machine's, not the mechanism's own."""
        at = forces.motion.phi if sliding else np.degrees(forces.motion.phi)
        return found._replace(poses=found.poses._replace(q=at), coordinate=coordinate)

    heading = f"forces in the joints, by the position of the {'slide' if sliding else 'crank'}"
    blocks = [f"{scene.title or 'Machine'}: {heading}"]
    closer = cleared(dense).mechanisms if dense else {}
    for name, found in cleared(forces, dense).mechanisms.items():
        more = by_position(dense, closer[name]) if dense else None
        title = f"{name}: what the first body of each joint does to its second"
        table = by_position(forces, found).table(more).rstrip("\n")
        blocks += [f"{title}\n{'=' * len(title)}", table, *_notes(found)]
    return "\n\n".join([*blocks, *forces.messages]) + "\n"


def curves_text(
    scene: Scene,
    forces: JointForces,
    dense: JointForces | None,
    over: str,
    of: Sequence[str] = (),
    components: Sequence[str] = (),
) -> str:
    """A table of curves for every joint over the driver or the time, and the least and greatest value of every curve.

    dense: the same at more positions, over which the latter are then taken. of, components: as in `force_curves`.
    """
    chosen = force_curves(cleared(forces, dense), of, components)
    closer = cleared(dense or forces)
    axes = [axis(forces, over)[:3]]
    if forces.motion.time is not None:
        axes.append(axis(forces, DRIVER if over == TIME else TIME)[:3])
    blocks = [f"{scene.title or 'Machine'}: forces in the joints, {forces.condition}"]
    for joint, mine in groupby(chosen, lambda curve: curve.name.removesuffix(f".{curve.component}")):
        names, units, values = zip(*axes, *((c.component, c.unit, c.values) for c in mine), strict=True)
        table = [["none" if np.isnan(v) else f"{float(v):.6g}" for v in row] for row in zip(*values, strict=True)]
        heads = [f"{name} ({unit})" for name, unit in zip(names, units, strict=True)]
        blocks.append("\n".join((joint, *columns(table, heads))))
    where = axis(closer, over)
    extents = [row for curve in force_curves(closer, of, components) if (row := _extent(curve, where))]
    title = "least and greatest" if dense else "least and greatest of these positions"
    blocks.append("\n".join((title, *columns(extents))))
    notes = [note for found in forces.mechanisms.values() for note in _notes(found)]
    return "\n\n".join([*blocks, *notes, *forces.messages]) + "\n"


def _extent(curve: ForceCurve, where: Axis) -> list[str]:
    """A curve's least and greatest value, and where."""
    if np.isnan(curve.values).all():
        return []
    name, unit, at, _ = where
    low, high = int(np.nanargmin(curve.values)), int(np.nanargmax(curve.values))
    cells = [
        f"{figure(float(curve.values[k]), most=7)} {curve.unit} at {name} = {float(at[k]):.6g} {unit}" for k in (low, high)
    ]
    return [curve.name, *cells]


def cleared(forces: JointForces, dense: JointForces | None = None) -> JointForces:
    """Forces for reading: with 0 for what is rounding beside the machine's largest force, be it among those of `dense`."""
    scales = [found.scales() for found in (dense or forces).mechanisms.values()]
    largest = max(force for force, _ in scales), max(moment for _, moment in scales)
    return forces._replace(mechanisms={name: found.cleared(largest) for name, found in forces.mechanisms.items()})


def _notes(found: Reactions) -> Iterator[str]:
    friction = found.friction
    if friction.iterations and found.poses.linkage.rubs:
        worst = float(np.nanmax(friction.gap)) if np.isfinite(friction.gap).any() else np.nan
        share = float(np.nanmean(friction.moment))
        unit = "N" if found.poses.linkage.sliding else "N m"
        yield (
            f"friction: iterations {friction.iterations} at most, last relative change {worst:.1e}; "
            f"its share of the moment is {share:.6g} {unit} on the average"
        )
    residual = float(np.nanmax(found.residual, initial=0.0))
    if residual > _DIGITS:
        yield f"equilibrium is met to {residual:.1e} of the largest load"


def csv(
    scene: Scene, forces: JointForces, over: str | None = None, of: Sequence[str] = (), components: Sequence[str] = ()
) -> str:
    """One row for every position: the machine's motion, then every component of every joint; SI.

    over: "driver" or "time", for a motion with its time. of, components: those alone, as in `force_curves`.
    """
    sliding, motion = scene.reduction_element == "slide", forces.motion
    heads = ("x [m]", "v [m/s]", "a [m/s^2]") if sliding else ("phi [rad]", "omega [rad/s]", "alpha [rad/s^2]")
    moved: list[tuple[str, Array]] = list(zip(heads, (motion.phi, motion.omega, motion.alpha), strict=True))
    if over is not None and motion.time is not None:
        moved.insert(0 if over == TIME else 3, ("t [s]", motion.time))

    def columns() -> Iterator[tuple[str, Array]]:
        yield from moved
        if of or components:
            for curve in force_curves(forces, of, components):
                part = DRIVE if curve.component == DRIVING else curve.component
                yield f"{curve.mechanism}.{curve.joint}.{part} [{curve.unit}]", curve.values
            return
        for name, found in forces.mechanisms.items():
            for part, unit, values in list(found.columns())[1:]:
                yield f"{name}.{part} [{unit}]", values

    return rows.csv(columns())


def json(
    scene: Scene, forces: JointForces, errors: Mapping[str, Any], of: Sequence[str] = (), components: Sequence[str] = ()
) -> str:
    """All figures as JSON, SI; null where redundant constraints leave one open, or friction locks.

    errors: those of the forces, by mechanism (`joint_errors`). of, components: those alone, as in `force_curves`.
    """
    motion, off = forces.motion, forces.errors
    shape = motion.phi.shape
    of_motion: dict[str, Any] = {name: np.broadcast_to(getattr(off, name), shape) for name in ("phi", "omega", "alpha")}
    of_motion["t"] = None if motion.time is None else np.broadcast_to(off.time, shape)
    curves = force_curves(forces, of, components)
    wanted = {(c.mechanism, c.joint, c.component) for c in curves} if of or components else None
    data: dict[str, Any] = {
        "title": scene.title,
        "reduction": scene.reduction_element,
        "condition": forces.condition,
        "t": motion.time,
        "phi": motion.phi,
        "omega": motion.omega,
        "alpha": motion.alpha,
        "mechanisms": {name: _only(name, _as_dict(found), wanted) for name, found in forces.mechanisms.items()},
        "errors": {**of_motion, "mechanisms": {name: _only(name, found, wanted) for name, found in errors.items()}},
        "messages": list(forces.messages),
    }
    return rows.encoded(data, indent=2)


def _only(mechanism: str, figures: dict[str, Any], wanted: set[tuple[str, str, str]] | None) -> dict[str, Any]:
    """Figures of the joints and components that are wanted: mechanism, joint, component; all if None."""
    if wanted is None:
        return figures
    mine = {(joint, part) for name, joint, part in wanted if name == mechanism}
    joints = {}
    for joint, parts in figures["joints"].items():
        kept = {part: value for part, value in parts.items() if (joint, part) in mine}
        if kept:
            joints[joint] = kept | ({"units": parts["units"]} if "units" in parts else {})
    driving = {name: value for name, value in figures["driving"].items() if (name, "driving") in mine}
    return figures | {"driving": driving, "joints": joints}


def _as_dict(found: Reactions) -> dict[str, Any]:
    figures = figures_of(found)
    friction = found.friction
    return {
        "driving": figures["driving"],
        "joints": {name: {**parts, "units": dict(found.units[name])} for name, parts in figures["joints"].items()},
        "largest": {e.joint: {"force": e.force, "at": e.at} for e in found.extremes()},
        "undetermined": found.undetermined,
        "friction": {"moment": friction.moment, "iterations": friction.iterations, "converged": friction.converged},
        "residual": found.residual,
    }
