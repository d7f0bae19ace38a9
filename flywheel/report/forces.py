"""Forces in the joints of a machine as text, CSV and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.motions.joint_forces import JointForces, figures_of
from flywheel.report import rows
from flywheel.scene.scene import Scene

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
    return "\n\n".join(blocks) + "\n"


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


def csv(scene: Scene, forces: JointForces) -> str:
    """One row for every position: the machine's motion, then every component of every joint; SI."""
    sliding = scene.reduction_element == "slide"
    heads = ("x [m]", "v [m/s]", "a [m/s^2]") if sliding else ("phi [rad]", "omega [rad/s]", "alpha [rad/s^2]")

    def columns() -> Iterator[tuple[str, NDArray[np.float64]]]:
        yield from zip(heads, forces.motion, strict=True)
        for name, found in forces.mechanisms.items():
            for part, unit, values in list(found.columns())[1:]:
                yield f"{name}.{part} [{unit}]", values

    return rows.csv(columns())


def json(scene: Scene, forces: JointForces, errors: Mapping[str, Any]) -> str:
    """All figures as JSON, SI; null where redundant constraints leave one open, or friction locks.

    errors: those of the forces, by mechanism (`joint_errors`).
    """
    motion, shape = forces.motion, forces.motion.phi.shape
    of_motion = {
        name: np.broadcast_to(error, shape) for name, error in zip(("omega", "alpha"), forces.motion_errors, strict=True)
    }
    data: dict[str, Any] = {
        "title": scene.title,
        "reduction": scene.reduction_element,
        "phi": motion.phi,
        "omega": motion.omega,
        "alpha": motion.alpha,
        "mechanisms": {name: _as_dict(found) for name, found in forces.mechanisms.items()},
        "errors": {**of_motion, "mechanisms": errors},
    }
    return rows.encoded(data, indent=2)


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
