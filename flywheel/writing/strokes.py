"""The machine reduced along a stroke, as CSV or JSON: with names and units of its own where the driver slides."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine import Machine
from flywheel.scene import Stroke
from flywheel.stroke import Passage, passage_errors

Array = NDArray[np.float64]


class Names(NamedTuple):
    """What the reduced quantities are called, for a driver of one kind: keys of JSON, heads of columns."""

    keys: dict[str, str]
    driving: str
    heads: tuple[str, ...]
    slope: str


_KEPT = ("phi", "inertia", "slope", "moment", "gains", "gain_slopes", "inertia_parts", "moment_parts")
TURNING = Names(
    keys={name: name for name in _KEPT},
    driving="driving_torque",
    heads=("phi [rad]", "I* [kg m^2]", "dI*/dphi [kg m^2]", "M* [N m]", "M_drive [N m]"),
    slope="dg/dphi",
)
SLIDING = Names(
    keys={
        "phi": "x",
        "inertia": "reduced_mass",
        "slope": "reduced_mass_slope",
        "moment": "reduced_force",
        "gains": "gains",
        "gain_slopes": "gain_slopes",
        "inertia_parts": "mass_parts",
        "moment_parts": "force_parts",
    },
    driving="driving_force",
    heads=("x [m]", "m* [kg]", "dm*/dx [kg/m]", "F* [N]", "F_drive [N]"),
    slope="dg/dx",
)


def names_of(stroke: Stroke) -> Names:
    """The names that go with a stroke."""
    return SLIDING if stroke.sliding else TURNING


def as_dict(machine: Machine, stroke: Stroke, passage: Passage) -> dict[str, Any]:
    """What `flywheel reduce --json` prints for a scene with a stroke, SI throughout."""
    names = names_of(stroke)
    state, errors = passage.state._asdict(), passage_errors(machine, passage)
    return {
        "title": machine.scene.title,
        "reduction": stroke.element,
        "cycle": None,
        "balance": None,
        "stroke": {
            "from": stroke.start,
            "to": stroke.end,
            "speed": stroke.speed,
            "acceleration": stroke.acceleration,
        },
        **{key: state[name] for name, key in names.keys.items()},
        names.driving: passage.driving,
        "velocities": passage.velocities,
        "accelerations": passage.accelerations,
        "errors": {(names.keys | {"driving": names.driving}).get(name, name): error for name, error in errors.items()},
    }


def columns(machine: Machine, stroke: Stroke, passage: Passage) -> Iterator[tuple[str, Array]]:
    """Every column of the CSV with the name that heads it, its unit in brackets."""
    names, state = names_of(stroke), passage.state
    yield from zip(names.heads, (state.phi, state.inertia, state.slope, state.moment, passage.driving), strict=True)
    if not stroke.sliding:
        yield "phi [deg]", np.degrees(state.phi)
    elements = machine.kinematics.graph.elements
    translating = {name: elements[name].domain == "translation" for name in state.gains}
    families = {
        "g": (state.gains, ("m", "1") if not stroke.sliding else ("1", "1/m")),
        names.slope: (state.gain_slopes, ("m", "1") if not stroke.sliding else ("1/m", "1/m^2")),
        "v": (passage.velocities, ("m/s", "rad/s")),
        "a": (passage.accelerations, ("m/s^2", "rad/s^2")),
    }
    for title, (values, units) in families.items():
        for name, array in values.items():
            yield f"{title} {name} [{units[not translating[name]]}]", array
