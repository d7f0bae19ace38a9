"""What programs read: JSON without NaN, and the reduced machine over crank angle as CSV or JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.results import Balance
from flywheel.scene import Scene, Stroke
from flywheel.state import MachineState

Array = NDArray[np.float64]


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
    machine = Machine(scene)
    if scene.stroke is not None:
        return _along(machine, scene.stroke, angles, points, as_json), _conditions(machine, scene.stroke.speed)
    even = np.arange(points, dtype=np.float64) * (scene.cycle / points)
    phi = np.array(angles, dtype=np.float64) if angles else even
    state, balance, speed = _reduced(machine, phi)
    text = _reduced_json(machine, phi, state, balance, speed) if as_json else csv(_csv_columns(machine, phi, state))
    return text, _conditions(machine, speed)


def _along(machine: Machine, stroke: Stroke, given: Sequence[float], points: int, as_json: bool) -> str:
    from flywheel.stroke import along
    from flywheel.writing import strokes as export_stroke

    passage = along(machine, np.array(given) if given else np.linspace(stroke.start, stroke.end, points))
    if as_json:
        return encoded(export_stroke.as_dict(machine, stroke, passage))
    return csv(export_stroke.columns(machine, stroke, passage))


def _reduced(machine: Machine, phi: Array) -> tuple[MachineState, Balance | None, float | None]:
    """The state at angles, the balance, and the speed that torques were taken at where they depend on it."""
    from flywheel import constant_speed
    from flywheel.state import reduce

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
    from flywheel.constant_speed import doubts
    from flywheel.state import state_errors

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
