"""What `flywheel reduce` shows: I*, dI*/dphi, M* and every influence coefficient over crank angle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel import regime
from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.scene import Scene

Array = NDArray[np.float64]


class MachineState(NamedTuple):
    """The machine seen from its crank at angles phi (rad), without the flywheel.

    `inertia` I* and `slope` dI*/dphi in kg m²; `moment` M* in N m, the balance included; `gains` the influence coefficient
    g = velocity/omega of every shaft, port and other velocity (m or 1, by name) and `gain_slopes` dg/dphi;
    `inertia_parts` and `moment_parts` what each body and each load adds.
    """

    phi: Array
    inertia: Array
    slope: Array
    moment: Array
    gains: Mapping[str, Array]
    gain_slopes: Mapping[str, Array]
    inertia_parts: Mapping[str, Array]
    moment_parts: Mapping[str, Array]


def reduce(machine: Machine | Scene, phi: ArrayLike, *, balance: float | None = None) -> MachineState:
    """Reduce a machine to its crank at any angles: I* = sum I g², dI*/dphi = 2 sum I g g', M* = sum e g.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angles, rad, any shape; taken modulo the cycle.
        balance: value (SI) of the scene's unknown; solved for if None.

    At a breakpoint the value of the piece that begins there is given.

    >>> import flywheel
    >>> crank = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}, "slider": {"mass": 2.0}}
    >>> scene = flywheel.load({"mechanism": crank, "regime": {"speed": 10}, "flywheel": {"inertia": 1}})
    >>> state = flywheel.reduce(scene, [1.5707963267948966])
    >>> round(float(state.gains["slider-crank.slider"][0]), 12), round(float(state.inertia[0]), 12)
    (-0.1, 0.02)

    """
    if not isinstance(machine, Machine):
        machine = Machine(machine)
    angles = np.asarray(phi, dtype=float) % machine.scene.cycle
    if not np.isfinite(angles).all():
        raise SceneError([Fault("phi", "an angle that is not finite", "crank angles in rad")])
    anchor = machine.anchors(angles)
    if balance is None:
        balance = regime.resolve(machine, machine.mesh).balance
    reduced = machine.reduce(angles, anchor)
    chain = machine.kinematics
    flows = chain.flows(angles, anchor)
    named = {name: chain.variable[name] for name, element in chain.graph.elements.items() if element.kind == "1"}

    def whole(value: object) -> Array:
        return np.broadcast_to(np.asarray(value, dtype=float), angles.shape)

    return MachineState(
        phi=angles,
        inertia=whole(reduced.inertia),
        slope=whole(reduced.slope),
        moment=whole(reduced.moment + (balance or 0.0) * reduced.per_unknown),
        gains={name: whole(flows.gain[v]) for name, v in named.items()},
        gain_slopes={name: whole(flows.slope[v]) for name, v in named.items()},
        inertia_parts={k: whole(v) for k, v in chain.inertias(flows).items()},
        moment_parts={k: whole(v) for k, v in machine.reduction.moments(angles, anchor, balance or 0.0).items()},
    )
