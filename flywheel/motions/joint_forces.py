"""Forces in the joints of a scene's mechanisms, as the machine runs: kinetostatics with the scene's own loads.

Every mechanism is taken as a linkage, its shaft's motion is that of the steady regime (or of the stroke), and whatever
acts on its ports acts on its bodies. What its crank asks of the shaft is the driving action.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.machine.machine import Machine
from flywheel.machine.reactions import MachineMotion, port_forces
from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import constant_speed, state, turning_moment
from flywheel.regime.joint_friction import machine_of
from flywheel.scene.linkage import PIN
from flywheel.scene.scene import Scene

if TYPE_CHECKING:
    from flywheel.sizing.results import Sizing

Array = NDArray[np.float64]


class JointForces(NamedTuple):
    """Forces in the joints of every mechanism of a machine, by the mechanism's name, over a motion.

    `motion_errors` are the estimated errors of that motion's speed and acceleration, 0 of a motion that is given.
    """

    motion: MachineMotion
    mechanisms: Mapping[str, Reactions]
    motion_errors: tuple[Array | float, Array | float] = (0.0, 0.0)


def joint_forces(
    machine: Machine | Scene,
    phi: ArrayLike | None = None,
    *,
    speed: float | None = None,
    acceleration: float = 0.0,
    inertia: bool = True,
    friction: bool = True,
) -> JointForces:
    """Driving action and reactions of every joint of a machine, with the loads, weights and added masses of its scene.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angles (rad), shape (n,), taken modulo the cycle; 360 over the cycle if None. On a stroke the driver's own
            coordinates (rad or m), 181 from end to end if None.
        speed: constant crank speed (rad/s, or m/s); if None that of the steady regime with the scene's flywheel, exact
            where one is asked for, with the acceleration that belongs to it; without a flywheel, the scene's speed or the
            machine's own, constant. On a stroke the scene's.
        acceleration: beside a given `speed`, rad/s² or m/s².
        inertia: False leaves inertia forces out: quasi-static; a speed is then needed for loads that depend on it alone.
        friction: False leaves Coulomb friction in the joints out.

    Raises:
        SceneError: for a scene without mechanisms, or with a law, which has no joints; where there is no speed.

    A joint's reaction is what its first body does to its second; see `flywheel.kinetostatics`.

    >>> import flywheel
    >>> press = {"type": "slider-crank", "crank": {"length": 3}, "rod": {"length": 5}, "slider": {}}
    >>> scene = flywheel.load({"mechanism": press, "load": [{"on": "slider", "force": "-100 N"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": 10}, "flywheel": {"inertia": 1}})
    >>> found = joint_forces(scene, [np.pi / 2], speed=10.0).mechanisms["slider-crank"]
    >>> found.action.round(9).tolist(), found.components["guide"]["normal"].round(9).tolist()
    ([-300.0], [75.0])

    """
    machine = machine if isinstance(machine, Machine) else Machine(machine)
    scene = machine.scene
    if scene.areas is not None:
        raise SceneError([Fault("areas", "a diagram of areas", "a machine with joints", "give mechanism and loads instead")])
    if not scene.mechanisms:
        raise SceneError([Fault("mechanism", "no mechanism", "one at least, as joints are asked for")])
    stroke = scene.stroke
    if phi is None:
        positions = spread(scene, 360 if stroke is None else 181)
    else:
        wanted = np.atleast_1d(np.asarray(phi, dtype=float)).ravel()
        if not wanted.size:
            raise SceneError([Fault("phi", "no position", "one at least, or None for a whole cycle or stroke")])
        positions = state.own_coordinate(scene, wanted) + scene.origin
    if speed is None and stroke is not None and stroke.speed is not None:
        speed, acceleration = stroke.speed, stroke.acceleration
    if speed is None and (not scene.has_flywheel or stroke is not None):
        speed = _constant(machine, inertia)
    balance = _balance(machine, speed)[0]
    if speed is None:
        from flywheel.sizing.sizing import size  # a given motion has no regime to find

        machine = machine_of(machine)
        motion, errors = steady_motion(machine, size(machine, simulate=False), positions)
    else:
        rates = np.full(positions.size, float(speed)), np.full(positions.size, float(acceleration))
        motion, errors = MachineMotion(positions, *rates), (0.0, 0.0)
    ask = partial(port_forces, machine, motion, balance, inertia=inertia, friction=friction)
    return JointForces(motion, {mechanism.name: ask(mechanism) for mechanism in scene.mechanisms}, errors)


@np.errstate(all="ignore")
def joint_errors(
    machine: Machine, forces: JointForces, *, inertia: bool = True, friction: bool = True
) -> dict[str, dict[str, Any]]:
    """Estimated absolute errors of forces in joints, by mechanism, in the arrangement of `figures_of`.

    As with `flywheel.regime.state.state_errors` they are found again a few roundings aside, with lengths a few roundings
    off, in a motion as far off as it may be: linkages' positions and the equations of equilibrium then answer by other
    roundings. What equilibrium and the iteration of friction leave is added.

    Args:
        machine: the machine.
        forces: as `joint_forces` found them.
        inertia: as they were asked for.
        friction: as they were asked for.

    """
    motion, origin = forces.motion, machine.scene.origin
    balance, off = _balance(machine, float(motion.omega[0]))
    own = motion.phi - origin
    anchor = machine.anchors(own)
    others, errors = state.rounded_otherwise(machine), {}
    for k, mechanism in enumerate(machine.scene.mechanisms):
        found, again = forces.mechanisms[mechanism.name], []
        for other, share, sense in zip(others, (1.0, 0.4), (1.0, -1.0), strict=True):
            phi = origin + state.beside(own, anchor, machine.scene.cycle, share)
            rates = [rate + sense * np.asarray(error) for rate, error in zip(motion[1:], forces.motion_errors, strict=True)]
            options = {"inertia": inertia, "friction": friction}
            beside = MachineMotion(phi, *rates)
            again.append(port_forces(other, beside, balance + share * off, other.scene.mechanisms[k], **options))
        apart = state.spread(figures_of(found), [figures_of(other) for other in again])
        friction_gap, linkage = found.friction.gap, found.poses.linkage
        left = found.residual + np.where(np.isfinite(friction_gap), friction_gap, 0.0) + state.EVALUATED * ROUNDING
        force, moment = found.scales()  # what equilibrium and the iteration of friction leave over is a share of these
        sizes = {"N": force, "N m": moment}
        drive = {name: moment if linkage.joint(name).kind == PIN else force for name in found.actions}
        iterated = bool(found.friction.iterations) * (force if linkage.sliding else moment)
        errors[mechanism.name] = {
            "driving": {name: error + left * drive[name] for name, error in apart["driving"].items()},
            "joints": {
                joint: {part: error + left * sizes[found.units[joint].get(part, "N")] for part, error in parts.items()}
                for joint, parts in apart["joints"].items()
            },
            "friction": {"moment": apart["friction"]["moment"] + left * iterated},
        }
    return errors


def figures_of(found: Reactions) -> dict[str, Any]:
    """Driving actions, and components and resultant of every joint, by their names."""
    joints = {name: {**parts, "resultant": found.resultant(name)} for name, parts in found.components.items()}
    return {"driving": dict(found.actions), "joints": joints, "friction": {"moment": found.friction.moment}}


def spread(scene: Scene, count: int) -> Array:
    """So many positions evenly over the cycle, from 0 and without its end, or over the stroke from end to end."""
    if scene.stroke is not None:
        return np.linspace(scene.stroke.start, scene.stroke.end, count)
    return scene.cycle * np.arange(count) / count


def _constant(machine: Machine, inertia: bool) -> float:
    """The constant speed (rad/s, or m/s) of a machine without a flywheel: the scene's, or the machine's own.

    Where neither inertia forces nor loads depend on it, any will do.
    """
    scene = machine.scene
    if scene.stroke is None and scene.speed is not None:
        return scene.speed
    if machine.depends_on_speed and scene.stroke is None and scene.unknown is None:
        return constant_speed.operating_point(machine_of(machine))[0] or 0.0
    if inertia or machine.depends_on_speed:
        quasi = "" if machine.depends_on_speed else ", or leave inertia forces out: --quasi-static (inertia=False)"
        fault = constant_speed.no_speed(scene, "for inertia forces, and for what depends on it")
        raise SceneError([fault._replace(advice=fault.advice + quasi)])
    return 1.0


def _balance(machine: Machine, speed: float | None) -> tuple[float, float]:
    """The value (SI) of the scene's unknown and its error: at the scene's speed, or without one at that of the motion."""
    scene = machine.scene
    if scene.unknown is None:
        return 0.0, 0.0
    at, value = constant_speed.operating_point(machine, speed if scene.speed is None else None)
    return value, value * constant_speed.operating_point_errors(machine, at)[1]


def steady_motion(machine: Machine, sizing: Sizing, phi: Array) -> tuple[MachineMotion, tuple[Array | float, Array | float]]:
    """The steady regime of a sizing at crank angles phi (rad), and errors: alpha = (M* - ½ dI*/dphi omega²)/(I* + J)."""
    from flywheel.sizing.results import speed_error_over_cycle

    if sizing.cycle is None or sizing.run is None:
        return MachineMotion(phi, np.full(phi.size, sizing.speed), np.zeros(phi.size)), (0.0, 0.0)
    omega = turning_moment.speed_over_cycle(sizing.cycle, sizing.speed, sizing.run, phi)
    reduced = state.reduce(machine, phi, balance=sizing.cycle.balance or 0.0)
    moment = reduced.moment
    noise = sizing.cycle.noise[:, sizing.cycle.where(phi - machine.scene.origin)[0]]
    if sizing.run.cycle is not None:
        cell, t = sizing.cycle.where(phi)
        moment = cells.value(sizing.cycle.series[0, cell], t)
    total = reduced.inertia + sizing.run.inertia
    alpha = (moment - 0.5 * reduced.slope * omega**2) / total
    off = omega * speed_error_over_cycle(sizing)
    heavy = (sizing.error.exact or 0.0) * sizing.run.inertia / total
    slower = (noise[0] + 0.5 * omega**2 * noise[1] + np.abs(reduced.slope) * omega * off) / total + np.abs(alpha) * heavy
    return MachineMotion(phi, omega, alpha), (off, slower)
