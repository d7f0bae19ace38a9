"""What acts on a scene's mechanisms as linkages: the loads on their ports, and the reactions that follow in their joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.elements import Here
from flywheel.machine.machine import Anchor, Machine, spring_effort
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.linkage import followed, linkage_of
from flywheel.mechanisms.linkages.positions import Poses, Solution, solve
from flywheel.mechanisms.linkages.reactions import Reactions, reactions_at
from flywheel.mechanisms.linkages.wrenches import Effort, Force, Load, Torque
from flywheel.numerics.cells import wide
from flywheel.scene.scene import TURN, Mechanism

Array = NDArray[np.float64]

_SLOWLY = 1e-150  # rad/s: a speed that has a sense, and nothing else
_BESIDE = 1e-9  # of the cycle: how near to an edge its two sides are looked at


class MachineMotion(NamedTuple):
    """The motion that forces belong to: crank angle (rad; m on a sliding stroke), its rate and its acceleration, (n,).

    `time` (s) is known of a motion in time; `gone` is what of the angle are whole cycles gone by. Branches of laws are
    decided at `anchor`: if None in the middle of the smooth piece of each angle, at the speed and time there. `creeps`: it
    moves forwards so slowly that its speed counts for nothing but the sense of friction.
    """

    phi: Array
    omega: Array
    alpha: Array
    time: Array | None = None
    gone: Array | float = 0.0
    anchor: Anchor | None = None
    creeps: bool = False

    def own(self, machine: Machine) -> Array:
        """The machine's coordinate from 0 to the cycle."""
        return np.clip(self.phi - machine.scene.origin - self.gone, 0.0, machine.scene.cycle)

    @property
    def sense(self) -> Array:
        """Which way it goes, 1 or -1, or is about to go or has come, at an instant of rest; 0 where it rests."""
        if self.creeps:
            return np.ones_like(self.phi)
        coming = 0.0 if self.anchor is None else self.anchor.omega
        return np.sign(np.where(self.omega == 0.0, coming, self.omega))


def port_forces(
    machine: Machine,
    motion: MachineMotion,
    balance: float,
    mechanism: Mechanism,
    *,
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """Forces in one mechanism's joints in a motion of the machine, with a value (SI) for the scene's unknown.

    inertia, friction: False leaves them out.
    """
    scene = machine.scene
    ratio = scene.shafts[mechanism.shaft]
    poses = poses_of(mechanism, ratio * motion.own(machine) + mechanism.phase)
    return reactions_at(
        poses,
        np.where(motion.omega == 0.0, _SLOWLY * motion.sense, ratio * motion.omega),
        ratio * motion.alpha,
        gravity=scene.gravity,
        loads=tuple(_port_loads(machine, motion, balance, mechanism, inertia)),
        inertia=inertia,
        friction=friction,
    )


def close_positions(machine: Machine, count: int) -> Array:
    """Coordinates at which hardly a largest force is missed: `count` evenly, and both sides of every edge of a load.

    Angles in rad or positions in m, ascending, from the first to the last of the cycle or the stroke.
    """
    cycle, ends = machine.scene.cycle, machine.scene.stroke is not None
    beside = _BESIDE * cycle
    edges = np.asarray(machine.breakpoints)
    every = np.concatenate((np.linspace(0.0, cycle, count, endpoint=ends), edges, edges - beside, edges + beside))
    inside = (every >= 0.0) & ((every <= cycle) if ends else (every < cycle))
    return np.asarray(machine.scene.origin + np.unique(every[inside]))


def solution_of(mechanism: Mechanism) -> tuple[Solution, float | None]:
    """Any mechanism but a law followed as a linkage, and its period in its own coordinate (rad; None on a stroke)."""
    if mechanism.linkage is not None:
        cyclic = followed(mechanism)
        return cyclic.solution, cyclic.period
    period = TURN if mechanism.stroke is None else None
    return solve(linkage_of(mechanism), *sorted(mechanism.stroke or (0.0, TURN))), period


def poses_of(mechanism: Mechanism, psi: Array) -> Poses:
    """Poses of any mechanism but a law, as a linkage, at its own coordinates psi (rad, of any turn; m)."""
    solution, period = solution_of(mechanism)
    if period is None:
        return solution.poses(np.clip(psi, solution.low, solution.high))
    return solution.poses(psi - period * np.floor(psi / period))


def _port_loads(
    machine: Machine, motion: MachineMotion, balance: float, mechanism: Mechanism, inertia: bool
) -> Iterator[Load]:
    """What acts on a mechanism's ports at given positions: loads, springs, dampers, and the inertia of what is fixed there.

    The last are forces -m (g alpha + g' omega²) by the influence coefficient g of the port's velocity.
    """
    scene, kinematics, prefix = machine.scene, machine.kinematics, f"{mechanism.name}."
    phi, time = motion.own(machine), 0.0 if motion.time is None else motion.time
    decided = motion.anchor or Anchor(machine.anchors(phi), motion.omega, time)
    anchor = decided.phi
    own = machine.motion_of(prefix)
    ratio = scene.shafts[mechanism.shaft]

    def of_velocity(place: str, at: Array) -> tuple[Any, Any]:
        """The influence coefficient of a place's velocity and its slope, in the pieces of this motion."""
        flows, k = kinematics.flows(at, anchor), kinematics.variable[machine.places[place].junction]
        return flows.gain[k], flows.slope[k]

    def seen(place: str) -> tuple[Here, Here]:
        """Positions as a law at a place sees them, and in the middles of their pieces."""
        found = []
        for at, omega, then in ((phi, motion.omega, time), (anchor, decided.omega, decided.time)):
            here = Here(ratio * at, own.position(ratio * at, np, ratio * anchor), np)
            if machine.depends_on_speed or machine.depends_on_time:
                here = here._replace(speed=ratio * omega, flow=of_velocity(place, at)[0] * omega, time=then)
            found.append(here)
        return found[0], found[1]

    def acting(place: str, value: Any) -> Load:
        return port_load(mechanism, place.removeprefix(prefix), wide(value, phi.shape))

    for effort in machine.efforts:
        if effort.load.on.startswith(prefix):
            here = seen(effort.load.on)
            unknown = balance * effort.per_unknown(*here) if effort.depends_on_unknown else 0.0
            yield acting(effort.load.on, effort(*here) + unknown)
    for spring in scene.springs:
        if spring.on.startswith(prefix):
            yield acting(spring.on, -spring_effort(spring, machine.places[spring.on])(*seen(spring.on)))
    for damper in scene.dampers:
        if damper.on.startswith(prefix):
            yield acting(damper.on, -damper.coefficient * of_velocity(damper.on, phi)[0] * motion.omega)
    for item in scene.inertias if inertia else ():
        if item.on.startswith(prefix):
            gain, slope = of_velocity(item.on, phi)
            yield acting(item.on, -item.value * (gain * motion.alpha + slope * motion.omega**2))


def port_load(mechanism: Mechanism, port: str, value: ArrayLike) -> Load:
    """A force (N) or torque (N m) on a mechanism's port, as a load on its bodies; a number or shape (n,)."""
    guide = KINDS[mechanism.type].guides.get(port)
    if guide is not None:
        return Effort(guide, value)
    point = next((point for point in mechanism.points if point.name == port), None)
    if point is not None:
        along = np.asarray(value, dtype=float)
        return Force(point.body, point.point, np.cos(point.direction) * along, np.sin(point.direction) * along)
    if mechanism.linkage is not None and any(joint.name == port for joint in mechanism.linkage.joints):
        return Effort(port, value)
    return Torque(port, value)
