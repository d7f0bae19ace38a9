"""The reduced machine at given positions: I*, dI*/dphi, M*, every influence coefficient, and the drive along a stroke.

A driver that slides from one position to another, or turns from one angle to another, has no cycle: nothing repeats, so that
there is no steady speed and no flywheel. Available are the reduction, the driving action by virtual power, and the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flywheel.machine.equation import not_finite
from flywheel.machine.machine import Machine
from flywheel.numerics import notebook
from flywheel.numerics.cells import ROUNDING, Array, tails, wide
from flywheel.numerics.faults import Fault, SceneError, coordinate_text
from flywheel.regime import constant_speed
from flywheel.regime.joint_friction import machine_of
from flywheel.scene.linkage import Point
from flywheel.scene.scene import Mechanism, Scene, Stroke

__all__ = [
    "DRIVE", "ROUNDINGS", "MachineState", "Passage", "along", "at_speed", "beside", "conditions",
    "mechanisms_rounded_otherwise", "own_coordinate", "passage_errors", "reduce", "rounded_otherwise", "spread",
    "state_errors",
]  # fmt: skip

_SLACK = 1e-12  # of a stroke, by which rounding may carry a coordinate past its ends
_ASIDE = 16  # roundings of the cycle, by which a coordinate is changed to see what rounding does
_BALANCE_STEP = 1e-3  # of a balance: by which it is changed to see what its error does
ROUNDINGS = 24
"""Roundings of a figure at one position, relative to itself or to the sum of the sizes of its terms."""


class MachineState(NamedTuple):
    """The machine seen from its reduction element, the crank, at angles phi (rad), without the flywheel.

    `inertia` I* and `slope` dI*/dphi in kg m²; `moment` M* in N m, the balance included; `gains` the influence coefficient
    g = velocity/omega of every shaft, port and other velocity (m or 1, by name) and `gain_slopes` dg/dphi;
    `inertia_parts` and `moment_parts` the contributions of each body and each load.

    Where the reduction element slides (a scene with `[stroke]` and a driver that slides), `phi` is the driver's position
    x (m), `inertia` a mass m* (kg), `slope` dm*/dx (kg/m), `moment` a force F* (N); gains are per metre of the driver.
    """

    phi: Array
    inertia: Array
    slope: Array
    moment: Array
    gains: Mapping[str, Array]
    gain_slopes: Mapping[str, Array]
    inertia_parts: Mapping[str, Array]
    moment_parts: Mapping[str, Array]

    def __repr__(self) -> str:
        """The number of angles, instead of every array."""
        inertia = np.atleast_1d(self.inertia)
        ends = f"{inertia.min():.6g} to {inertia.max():.6g}" if inertia.size else "none"
        return f"MachineState({inertia.size} positions, I* {ends}, {len(self.gains)} influence coefficients)"

    def _repr_html_(self) -> str | None:
        """The HTML that a notebook shows."""
        return notebook.html(self)


@np.errstate(all="ignore")  # a value that is not finite is shown as such, or refused, and is no warning
def reduce(
    machine: Machine | Scene, phi: ArrayLike, *, balance: float | None = None, speed: float | None = None
) -> MachineState:
    """Reduces a machine to its crank at any angles: I* = sum I g², dI*/dphi = 2 sum I g g', M* = sum e g.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angles, rad, any shape; taken modulo the cycle. On a stroke: the driver's coordinates, rad, or m where
            it slides, from one end of the stroke to the other; none outside.
        balance: value (SI) of the scene's unknown; solved for if None.
        speed: of the driver (rad/s, or m/s), for torques that depend on it. If None the required one if there is a
            balance, else the constant one at which the net work is zero; on a stroke its own. Losses in meshes, which
            depend on accelerations, are no part of M*.

    At a breakpoint the value of the piece that begins there is given.

    >>> import flywheel
    >>> crank = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}, "slider": {"mass": 2.0}}
    >>> scene = flywheel.load({"mechanism": crank, "regime": {"speed": 10}, "flywheel": {"inertia": 1}})
    >>> state = flywheel.reduce(scene, [1.5707963267948966])
    >>> round(float(state.gains["slider-crank.slider"][0]), 12), round(float(state.inertia[0]), 12)
    (-0.1, 0.02)

    """
    machine = machine_of(machine)
    values = np.asarray(phi, dtype=float)
    angles = own_coordinate(machine.scene, values)
    anchor = machine.anchors(angles)
    once = machine.scene.stroke is not None
    if (balance is None and not once) or (speed is None and machine.depends_on_speed):
        constant, settled = constant_speed.operating_point(machine)
        speed, balance = (constant if speed is None else speed), (settled if balance is None else balance)
    return _at(machine, angles, anchor, balance or 0.0, speed)._replace(phi=values if once else angles)


def _at(machine: Machine, angles: Array, anchor: Array, balance: float, speed: float | None) -> MachineState:
    """The machine at its own coordinates, in the pieces of the anchors; refuses infinite values on a stroke."""
    reduced = machine.reduce(angles, anchor)
    chain = machine.kinematics
    flows = chain.flows(angles, anchor)
    named = {name: chain.variable[name] for name, element in chain.graph.elements.items() if element.kind == "1"}
    moving = (speed or 0.0) if machine.depends_on_speed or machine.depends_on_time else None
    parts = machine.reduction.moments(angles, anchor, balance, speed=moving)
    if machine.scene.stroke is not None:
        by_load = machine.reduction.moments(angles, anchor, by_name=True, speed=moving)
        bad = ~np.isfinite(np.asarray(reduced.inertia + reduced.slope + sum(by_load.values())) + 0.0 * angles)
        if bad.any():
            at = int(np.argmax(bad))
            place = float(angles.flat[at]), float(np.ravel(anchor)[at])
            raise SceneError([not_finite(machine, *place, moving)])
    plain = reduced.moment + balance * reduced.per_unknown
    whole = partial(wide, shape=angles.shape)
    return MachineState(
        phi=angles,
        inertia=whole(reduced.inertia),
        slope=whole(reduced.slope),
        moment=whole(plain if moving is None else sum(parts.values())),
        gains={name: whole(flows.gain[v]) for name, v in named.items()},
        gain_slopes={name: whole(flows.slope[v]) for name, v in named.items()},
        inertia_parts={k: whole(v) for k, v in chain.inertias(flows).items()},
        moment_parts={k: whole(v) for k, v in parts.items()},
    )


@np.errstate(all="ignore")
def state_errors(
    machine: Machine, state: MachineState, *, balance: float = 0.0, speed: float | None = None
) -> dict[str, Any]:
    """Estimated absolute errors of a state by the names of its fields, of the shapes that these have.

    The machine is reduced again at coordinates and with lengths changed by a few roundings: the change is the
    error by rounding, also near a dead centre. Balance and speed are changed by their errors.

    Args:
        machine: the machine.
        state: as computed by `reduce`.
        balance: value (SI) of the scene's unknown in it.
        speed: that of its torques.

    """
    angles = own_coordinate(machine.scene, np.asarray(state.phi, dtype=float))
    anchor = machine.anchors(angles)
    off_speed, off_balance = constant_speed.operating_point_errors(machine, speed)
    faster = None if speed is None else speed * (1.0 + off_speed)
    again = [
        _at(other, beside(angles, anchor, machine.scene.cycle, share), anchor, balance * (1.0 + share * off_balance), pace)
        for other, share, pace in zip(rounded_otherwise(machine), (1.0, 0.4), (faster, speed), strict=True)
    ]
    errors: dict[str, Any] = {
        name: spread(value, [getattr(other, name) for other in again]) for name, value in state._asdict().items()
    }
    del errors["phi"]
    steepness = wide(machine.reduce(angles, anchor).steepness, angles.shape)
    friction = 0.0 if machine.friction is None else float(tails(machine.friction.series).max())
    errors["slope"] = errors["slope"] + ROUNDINGS * ROUNDING * steepness
    errors["moment"] = errors["moment"] + ROUNDINGS * ROUNDING * sum(map(np.abs, state.moment_parts.values())) + friction
    if balance:  # it must not cancel against what the lengths change
        other = _at(machine, angles, anchor, balance * (1.0 + _BALANCE_STEP), speed)
        errors["moment"] = errors["moment"] + off_balance / _BALANCE_STEP * np.abs(other.moment - state.moment)
    return errors


def rounded_otherwise(machine: Machine, *, friction: bool = True) -> list[Machine]:
    """Two machines with all mechanisms' lengths changed by a few roundings, in two ways, equal lengths equally.

    friction: False leaves out the moment of friction in their joints, which takes long to compute.
    """
    machines = []
    for mechanisms in mechanisms_rounded_otherwise(machine.scene.mechanisms):
        try:
            other = Machine(replace(machine.scene, mechanisms=mechanisms))
            machines.append(machine_of(other) if friction else other)
        except SceneError:  # at the very limit of what can be built
            machines.append(machine)
    return machines


def mechanisms_rounded_otherwise(mechanisms: Sequence[Mechanism]) -> list[tuple[Mechanism, ...]]:
    """Mechanisms with lengths changed by a few roundings, in two ways, equal lengths equally."""

    def moved(length: float, phase: float) -> float:
        return length * (1.0 + _ASIDE * ROUNDING * float(np.sin(1e6 * length + phase)))

    return [tuple(_with_lengths(one, partial(moved, phase=phase)) for one in mechanisms) for phase in (0.0, 1.5)]


def _with_lengths(mechanism: Mechanism, moved: Callable[[float], float]) -> Mechanism:
    def at(point: Point) -> Point:
        return point._replace(x=moved(point.x), y=moved(point.y))

    linkage = mechanism.linkage
    if linkage is not None:
        ground, *links = (link._replace(points=tuple(map(at, link.points))) for link in (linkage.ground, *linkage.links))
        joints = tuple(
            joint._replace(first_at=at(joint.first_at), second_at=at(joint.second_at)) for joint in linkage.joints
        )
        linkage = replace(linkage, ground=ground, links=tuple(links), joints=joints, neighbour=linkage)
    geometry = {name: moved(value) for name, value in mechanism.geometry.items()}
    return replace(mechanism, geometry=geometry, linkage=linkage)


def beside(angles: Array, anchor: Array, cycle: float, share: float = 1.0) -> Array:
    """Coordinates changed by a few roundings of the cycle, towards the middles of their pieces."""
    return np.asarray(angles + share * _ASIDE * ROUNDING * cycle * np.where(anchor < angles, -1.0, 1.0))


def spread(figures: Any, others: Sequence[Any]) -> Any:
    """Twice the difference of figures (arrays, or tables of them) from those computed again, and the rounding of a sum."""
    if isinstance(figures, Mapping):
        return {name: spread(value, [other[name] for other in others]) for name, value in figures.items()}
    apart = np.max([np.abs(other - figures) for other in others], axis=0)
    return 2 * apart + ROUNDINGS * ROUNDING * np.abs(figures)


def own_coordinate(scene: Scene, coordinates: Array) -> Array:
    """The machine's coordinate from 0 to the cycle: angles modulo the cycle; on a stroke the travel from its beginning.

    Raises SceneError for coordinates that are not finite, or outside the stroke.
    """
    stroke = scene.stroke
    sliding = stroke is not None and stroke.sliding
    name, what = ("x", "a position") if sliding else ("phi", "an angle")
    if not np.isfinite(coordinates).all():
        expected = "positions of the driver in m" if sliding else "crank angles in rad"
        raise SceneError([Fault(name, f"{what} that is not finite", expected)])
    if stroke is None:
        return coordinates % scene.cycle
    slack = _SLACK * max(abs(stroke.start), abs(stroke.end), stroke.span)
    outside = (coordinates < stroke.start - slack) | (coordinates > stroke.end + slack)
    if outside.any():
        ends = f"{coordinate_text(stroke.start, sliding)} to {coordinate_text(stroke.end, sliding)}"
        raise SceneError(
            [Fault(name, coordinate_text(coordinates[outside].flat[0], sliding), f"{what} within the stroke, {ends}")]
        )
    return np.asarray(np.clip(coordinates - stroke.start, 0.0, stroke.span))


# -- one-way strokes --------------------------------------------------------------------------------------------------

DRIVE = "drive"


class Passage(NamedTuple):
    """The machine at coordinates of its driver, with the driver's speed and acceleration there.

    `state` is the reduced machine. `driving` is the force (N; a torque, N m, where the driver turns) that the driver must
    exert for this motion: the scene's own drive is not counted among the loads. `velocities` (m/s or rad/s) and
    `accelerations` (m/s² or rad/s²) are those of every port and other velocity, by name as in `state.gains`.

    Of a point of a body on a fixed pivot (`NAME.com`) the velocity is its tangential speed. Its acceleration is given as
    `NAME.com.tangential`, `NAME.com.normal` (towards the pivot), and as the total `NAME.com`, never negative.
    """

    state: MachineState
    driving: Array
    velocities: Mapping[str, Array]
    accelerations: Mapping[str, Array]


def along(
    machine: Machine | Scene, q: ArrayLike, *, speed: float | None = None, acceleration: float | None = None
) -> Passage:
    """Driving action and motion along a stroke: F = m* a + ½ dm*/dx v² - F*, v_i = g_i v, a_i = g_i a + g_i' v².

    The driving action follows from the power of all inertia forces and loads (virtual power): it is the force that the
    driver exerts for its speed v and acceleration a. Where the driver turns, I*, phi and M* stand for m*, x and F*.

    Args:
        machine: a `Machine`, or a `Scene`, with a stroke.
        q: coordinates of the driver within the stroke, m (rad where it turns), any shape.
        speed: of the driver, m/s or rad/s; the scene's if None.
        acceleration: of the driver, m/s² or rad/s²; the scene's if None.

    Raises:
        SceneError: for a machine without a stroke, a coordinate outside it, or no speed.

    >>> import flywheel
    >>> bodies = {"frame": {"points": {"O": [0, 0]}}, "ram": {"mass": 2.0}}
    >>> guide = {"name": "O", "type": "slide", "between": ["frame.O", "ram.origin"]}
    >>> linkage = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [guide]}
    >>> load = [{"on": "slide", "force": "-30 N"}]
    >>> scene = {"mechanism": linkage, "load": load, "stroke": {"from": 0, "to": 0.1, "speed": 1, "acceleration": 5}}
    >>> along(flywheel.load(scene), [0.05]).driving
    array([40.])

    """
    machine = machine_of(machine)
    stroke = _stroke_of(machine.scene)
    v = stroke.speed if speed is None else speed
    if v is None:
        raise SceneError([constant_speed.no_speed(machine.scene, "for the driving action and for velocities")])
    a = stroke.acceleration if acceleration is None else acceleration
    if not (np.isfinite(v) and np.isfinite(a)):
        raise SceneError([Fault("stroke", f"speed {v} and acceleration {a}", "finite numbers")])
    state = reduce(machine, q, speed=v)
    loads = state.moment - state.moment_parts.get(DRIVE, 0.0)
    # a_i = g_i a + g_i' v²; of points on a fixed pivot the tangential part, the normal part r (g v)², and both in one.
    accelerations = {name: gain * a + state.gain_slopes[name] * v**2 for name, gain in state.gains.items()}
    for name, (turning, radius) in machine.pivoted.items():
        if name in accelerations:
            tangential, normal = accelerations[name], abs(radius) * (state.gains[turning] * v) ** 2
            accelerations |= {name: np.hypot(tangential, normal), f"{name}.tangential": tangential, f"{name}.normal": normal}
    return Passage(
        state=state,
        driving=state.inertia * a + 0.5 * state.slope * v**2 - loads,
        velocities={name: gain * v for name, gain in state.gains.items()},
        accelerations=accelerations,
    )


def passage_errors(machine: Machine, passage: Passage) -> dict[str, Any]:
    """Estimated absolute errors of a passage at the stroke's own speed, which it must have, and acceleration.

    They are those of its state, propagated to F = m* a + ½ dm*/dx v² - F*, v_i = g_i v and a_i = g_i a + g_i' v².
    """
    stroke = _stroke_of(machine.scene)
    v, a = stroke.speed or 0.0, abs(stroke.acceleration)
    of_state = state_errors(machine, passage.state, speed=v)
    inertia, slope, moment, gains, slopes = (
        of_state[name] for name in ("inertia", "slope", "moment", "gains", "gain_slopes")
    )
    accelerations = {name: gain * a + slopes[name] * v**2 for name, gain in gains.items()}
    for name, (turning, radius) in machine.pivoted.items():
        if name in accelerations:
            normal = 2 * abs(radius) * np.abs(passage.velocities[turning]) * gains[turning] * abs(v)
            normal = normal + ROUNDINGS * ROUNDING * passage.accelerations[f"{name}.normal"]
            tangential = accelerations[name]
            accelerations |= {name: tangential + normal, f"{name}.tangential": tangential, f"{name}.normal": normal}
    return {
        **of_state,
        "driving": inertia * a + 0.5 * slope * v**2 + moment + ROUNDINGS * ROUNDING * np.abs(passage.driving),
        "velocities": {name: gain * abs(v) for name, gain in gains.items()},
        "accelerations": accelerations,
    }


def _stroke_of(scene: Scene) -> Stroke:
    if scene.stroke is None:
        expected, advice = "a table with from and to", "flywheel.reduce takes any machine"
        raise SceneError([Fault("stroke", "nothing", expected, advice)])
    return scene.stroke


def at_speed(scene: Scene, speed: float | None) -> Machine:
    """The machine of a scene that has one, at a constant speed (rad/s or m/s) in place of the scene's, if one is given."""
    if scene.areas is not None:
        advice = "give mechanism, inertia or load instead"
        raise SceneError([Fault("areas", "a diagram of areas", "a machine to reduce", advice)])
    if speed is not None:
        scene = replace(scene, speed=speed, stroke=scene.stroke and scene.stroke._replace(speed=speed))
    return machine_of(scene, speed)


def conditions(machine: Machine, speed: float | None) -> str:
    """Conditions of M*: speed and time at which loads were taken, and the losses left out."""
    scene = machine.scene
    sliding = scene.reduction_element == "slide"
    limits = []
    if machine.depends_on_speed and speed is not None:
        limits.append(f"torques that depend on speed are those at a constant {speed:.9g} {'m/s' if sliding else 'rad/s'}")
    if machine.friction is not None and speed is None and scene.speed is None:
        limits.append("friction in joints is that without inertia forces, as no speed is given")
    if machine.depends_on_time:
        limits.append("loads that depend on time are those at t = 0")
    if any(efficiency < 1.0 for efficiency in machine.scene.efficiencies.values()):
        limits.append("losses in meshes are left out")
    notes = [f"of {'F*' if sliding else 'M*'}: {'; '.join(limits)}"] if limits else []
    if scene.stroke is not None and scene.stroke.speed is None:
        notes.append("no speed is given, and so neither the driving action nor velocities: [stroke] speed, or --speed")
    return "\n".join(notes)
