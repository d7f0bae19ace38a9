"""A one-way stroke: what the driver must do, and how fast everything moves, along it.

A driver that slides from one place to another, or turns from one angle to another, has no cycle: nothing repeats, so that
there is no steady speed and no flywheel. What there is: reduction, the driving action by virtual power, and the motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.piecewise import ROUNDING
from flywheel.scene import Scene, Stroke
from flywheel.state import EVALUATED, MachineState, reduce, state_errors

Array = NDArray[np.float64]

DRIVE = "drive"


class Passage(NamedTuple):
    """The machine at coordinates of its driver, with the driver's speed and acceleration there.

    `state` is the reduced machine. `driving` is the force (N; a torque, N m, where the driver turns) that the driver must
    exert for this motion: the scene's own drive is not counted among the loads. `velocities` (m/s or rad/s) and
    `accelerations` (m/s² or rad/s²) are those of every port and other velocity, by name as in `state.gains`.
    """

    state: MachineState
    driving: Array
    velocities: Mapping[str, Array]
    accelerations: Mapping[str, Array]


def along(
    machine: Machine | Scene, q: ArrayLike, *, speed: float | None = None, acceleration: float | None = None
) -> Passage:
    """Driving action and motion along a stroke: F = m* a + ½ dm*/dx v² - F*, v_i = g_i v, a_i = g_i a + g_i' v².

    The driving action follows from the power of all inertia forces and loads (virtual power): it is what the driver
    exerts for its speed v and acceleration a. Where the driver turns, I*, phi and M* stand for m*, x and F*.

    Args:
        machine: a `Machine`, or a `Scene`, with a stroke.
        q: coordinates of the driver within the stroke, m (rad where it turns), any shape.
        speed: of the driver, m/s or rad/s; the scene's if None.
        acceleration: of the driver, m/s² or rad/s²; the scene's if None.

    Raises:
        SceneError: for a machine without a stroke, or a coordinate outside it.

    >>> import flywheel
    >>> bodies = {"frame": {"points": {"O": [0, 0]}}, "ram": {"mass": 2.0}}
    >>> guide = {"name": "O", "type": "slide", "between": ["frame.O", "ram.origin"]}
    >>> linkage = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [guide]}
    >>> load = [{"on": "slide", "force": "-30 N"}]
    >>> scene = {"mechanism": linkage, "load": load, "stroke": {"from": 0, "to": 0.1, "speed": 1, "acceleration": 5}}
    >>> along(flywheel.load(scene), [0.05]).driving
    array([40.])

    """
    machine = machine if isinstance(machine, Machine) else Machine(machine)
    stroke = _stroke_of(machine.scene)
    v = stroke.speed if speed is None else speed
    a = stroke.acceleration if acceleration is None else acceleration
    if not (np.isfinite(v) and np.isfinite(a)):
        raise SceneError([Fault("stroke", f"speed {v} and acceleration {a}", "finite numbers")])
    state = reduce(machine, q, speed=v)
    loads = state.moment - state.moment_parts.get(DRIVE, 0.0)
    return Passage(
        state=state,
        driving=state.inertia * a + 0.5 * state.slope * v**2 - loads,
        velocities={name: gain * v for name, gain in state.gains.items()},
        accelerations={name: gain * a + state.gain_slopes[name] * v**2 for name, gain in state.gains.items()},
    )


def passage_errors(machine: Machine, passage: Passage) -> dict[str, Any]:
    """Estimated absolute errors of a passage at the stroke's own speed and acceleration.

    They are those of its state, and what F = m* a + ½ dm*/dx v² - F*, v_i = g_i v and a_i = g_i a + g_i' v² have of them.
    """
    stroke = _stroke_of(machine.scene)
    v, a = stroke.speed, abs(stroke.acceleration)
    of_state = state_errors(machine, passage.state, speed=v)
    gains, slopes = of_state["gains"], of_state["gain_slopes"]
    rounded = EVALUATED * ROUNDING
    return {
        **of_state,
        "driving": of_state["inertia"] * a
        + 0.5 * of_state["slope"] * v**2
        + of_state["moment"]
        + rounded * np.abs(passage.driving),
        "velocities": {name: gain * abs(v) for name, gain in gains.items()},
        "accelerations": {name: gain * a + slopes[name] * v**2 for name, gain in gains.items()},
    }


def _stroke_of(scene: Scene) -> Stroke:
    if scene.stroke is None:
        raise SceneError(
            [Fault("stroke", "nothing", "a table with from, to and speed", "flywheel.reduce takes any machine")]
        )
    return scene.stroke
