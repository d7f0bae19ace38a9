"""The machine reduced along a stroke, as CSV or JSON: with names and units of its own where the driver slides."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.machine import Machine
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.results import Balance
from flywheel.regime.state import MachineState, Passage, passage_errors
from flywheel.scene.scene import Scene, Stroke

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


# -- export ------------------------------------------------------------------------------------------------------------

# What programs read: JSON without NaN, and the reduced machine over crank angle as CSV or JSON.


def encoded(data: Mapping[str, Any], indent: int | None = None) -> str:
    """JSON in plain ASCII with floats at full precision; a number that is not finite becomes null.

    >>> encoded({"a": np.float64(0.1), "b": float("inf"), "c": np.array([1.0, 2.0])})
    '{"a": 0.1, "b": null, "c": [1.0, 2.0]}'
    """
    return json.dumps(_plain(data), indent=indent, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def reduced(scene: Scene, angles: Sequence[float] = (), points: int = 360, *, as_json: bool = False) -> tuple[str, str]:
    """The machine reduced to its crank, as CSV or JSON, at given crank angles (rad); and what it holds for, in a sentence.

    That sentence is empty where everything depends on position alone.

    Without angles, so many points are spread evenly over the cycle, from 0 and without its end. On a stroke they are the
    driver's coordinates (rad, or m where it slides), spread from one end of it to the other. Raises SceneError for a scene
    of areas, which has no machine.
    """
    if scene.areas is not None:
        raise SceneError(
            [
                Fault(
                    "areas",
                    "a diagram of areas",
                    "a machine to reduce",
                    "give mechanism, inertia or load instead",
                )
            ]
        )
    machine = machine_of(scene)
    if scene.stroke is not None:
        return _along(machine, scene.stroke, angles, points, as_json), _conditions(machine, scene.stroke.speed)
    even = np.arange(points, dtype=np.float64) * (scene.cycle / points)
    phi = np.array(angles, dtype=np.float64) if angles else even
    state, balance, speed = _reduced(machine, phi)
    text = _reduced_json(machine, phi, state, balance, speed) if as_json else csv(_csv_columns(machine, phi, state))
    return text, _conditions(machine, speed)


def _along(machine: Machine, stroke: Stroke, given: Sequence[float], points: int, as_json: bool) -> str:
    from flywheel.regime.state import along

    passage = along(machine, np.array(given) if given else np.linspace(stroke.start, stroke.end, points))
    if as_json:
        return encoded(as_dict(machine, stroke, passage))
    return csv(columns(machine, stroke, passage))


def _reduced(machine: Machine, phi: Array) -> tuple[MachineState, Balance | None, float | None]:
    """The state at angles, the balance, and the speed that torques were taken at where they depend on it."""
    from flywheel.regime import constant_speed
    from flywheel.regime.state import reduce

    speed, value = constant_speed.settled(machine)
    unknown = machine.scene.unknown
    state = reduce(machine, phi, balance=value, speed=speed)
    balance = None if unknown is None else Balance(unknown, value, 0.0)
    return state, balance, speed if machine.depends_on_speed else None


def _conditions(machine: Machine, speed: float | None) -> str:
    """What M* holds for: the speed and the time at which loads were taken, and the losses that it leaves out."""
    sliding = machine.scene.reduction_element == "slide"
    found = []
    if machine.depends_on_speed and speed is not None:
        found.append(f"what depends on speed is taken at a constant {speed:.9g} {'m/s' if sliding else 'rad/s'}")
    if machine.depends_on_time:
        found.append("what depends on time is taken at t = 0")
    if any(efficiency < 1.0 for efficiency in machine.scene.efficiencies.values()):
        found.append("losses in meshes are left out")
    return f"of {'F*' if sliding else 'M*'}: {'; '.join(found)}" if found else ""


def _reduced_json(machine: Machine, phi: Array, state: MachineState, balance: Balance | None, speed: float | None) -> str:
    scene = machine.scene
    return encoded(
        {
            "title": scene.title,
            "reduction": "crank",
            "cycle": scene.cycle,
            "balance": balance and {"name": balance.name, "value": balance.value},
            "speed": speed,
            **state._asdict(),
            "phi": phi,
            "errors": _errors(machine, state, balance, speed),
        }
    )


def _errors(machine: Machine, state: MachineState, balance: Balance | None, speed: float | None) -> dict[str, Any]:
    from flywheel.regime.constant_speed import doubts
    from flywheel.regime.state import state_errors

    off_speed, off_balance = doubts(machine, speed)
    return {
        "balance": None if balance is None else abs(balance.value) * off_balance,
        "speed": None if speed is None else speed * off_speed,
        **state_errors(machine, state, balance=0.0 if balance is None else balance.value, speed=speed),
    }


def _csv_columns(machine: Machine, phi: Array, state: MachineState) -> Iterator[tuple[str, Array]]:
    """Every column with the name that heads it; units in brackets, g and dg/dphi per radian of the crank."""
    yield "phi [rad]", phi
    yield "phi [deg]", np.degrees(phi)
    yield "I* [kg m^2]", state.inertia
    yield "dI*/dphi [kg m^2]", state.slope
    yield "M* [N m]", state.moment
    for title, gains in (("g", state.gains), ("dg/dphi", state.gain_slopes)):
        for name, values in gains.items():
            unit = "m" if machine.kinematics.graph.elements[name].domain == "translation" else "1"
            yield f"{title} {name} [{unit}]", values


def csv(columns: Iterable[tuple[str, Array]]) -> str:
    """Columns under the names that head them, floats at full precision."""
    names, arrays = zip(*columns, strict=True)
    rows = zip(*((array + 0.0).tolist() for array in arrays), strict=True)  # + 0.0: no "-0.0"
    lines = [",".join(names), *(",".join(map(repr, row)) for row in rows)]
    return "\n".join(lines) + "\n"
