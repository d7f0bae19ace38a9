"""Forces in the joints of a machine as text, CSV and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.motion.joint_forces import JointForces, figures_of
from flywheel.report.export import encoded
from flywheel.scene.scene import Scene

Array = NDArray[np.float64]

_DIGITS = 1e-9  # relative residual of the equations above which it is told


def text(scene: Scene, forces: JointForces, dense: JointForces | None = None) -> str:
    """Tables for reading: every joint's components over the crank angle in deg, or the slide's position in m.

    dense: the same at more positions, over which the largest forces are then taken.
    """
    blocks = [_heading(scene)]
    closer = cleared(dense).mechanisms if dense else {}
    for name, found in cleared(forces, dense).mechanisms.items():
        shown = _shown(scene, forces, found)
        more = _shown(scene, dense, closer[name]) if dense else None
        title = f"{name}: what the first body of each joint does to its second"
        blocks += [f"{title}\n{'=' * len(title)}", shown.table(more).rstrip("\n"), *_notes(found)]
    return "\n\n".join(blocks) + "\n"


def cleared(forces: JointForces, dense: JointForces | None = None) -> JointForces:
    """Forces for reading: with 0 for what is rounding beside the machine's largest force, be it among those of `dense`."""
    scales = [found.scales() for found in (dense or forces).mechanisms.values()]
    largest = max(force for force, _ in scales), max(moment for _, moment in scales)
    return forces._replace(mechanisms={name: found.cleared(largest) for name, found in forces.mechanisms.items()})


def _heading(scene: Scene) -> str:
    element = "slide" if scene.reduction_element == "slide" else "crank"
    return f"{scene.title or 'Machine'}: forces in the joints, by the position of the {element}"


def _shown(scene: Scene, forces: JointForces, found: Reactions) -> Reactions:
    """The same figures against the position that a reader knows: the machine's, not the mechanism's own."""
    sliding = scene.reduction_element == "slide"
    at = forces.motion.phi if sliding else np.degrees(forces.motion.phi)
    coordinate = ("x", "m") if sliding else ("phi", "deg")
    return found._replace(poses=found.poses._replace(q=at), coordinate=coordinate)


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
    if float(np.nanmax(found.residual, initial=0.0)) > _DIGITS:
        yield f"equilibrium is met to {float(np.nanmax(found.residual)):.1e} of the largest load"


def csv(scene: Scene, forces: JointForces) -> str:
    """One row for every position: the machine's motion, then every component of every joint; SI."""
    sliding = scene.reduction_element == "slide"
    heads = ["x [m]", "v [m/s]", "a [m/s^2]"] if sliding else ["phi [rad]", "omega [rad/s]", "alpha [rad/s^2]"]
    columns: list[Array] = list(forces.motion)
    for name, found in forces.mechanisms.items():
        for part, unit, values in list(found.columns())[1:]:
            heads.append(f"{name}.{part} [{unit}]")
            columns.append(values)
    rows = (",".join("" if np.isnan(v) else repr(float(v)) for v in row) for row in zip(*columns, strict=True))
    return "\n".join((",".join(heads), *rows)) + "\n"


def json(scene: Scene, forces: JointForces, errors: Mapping[str, Any]) -> str:
    """All figures as JSON, SI; null where redundant constraints leave one open, or friction locks.

    errors: those of the forces, by mechanism (`flywheel.joints.joint_errors`).
    """
    motion = forces.motion
    data: dict[str, Any] = {
        "title": scene.title,
        "reduction": scene.reduction_element,
        "phi": motion.phi,
        "omega": motion.omega,
        "alpha": motion.alpha,
        "mechanisms": {name: _as_dict(found) for name, found in forces.mechanisms.items()},
        "errors": {
            "omega": np.broadcast_to(forces.motion_errors[0], motion.phi.shape),
            "alpha": np.broadcast_to(forces.motion_errors[1], motion.phi.shape),
            "mechanisms": errors,
        },
    }
    return encoded(data, indent=2)


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
