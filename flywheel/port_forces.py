"""What acts on a scene's mechanisms as linkages: the loads on their ports, and the reactions that follow in their joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.elements import Here
from flywheel.chain import Chain
from flywheel.kinetostatics import Effort, Force, Load, Reactions, Torque, reactions_at
from flywheel.linkage.named import linkage_of
from flywheel.linkage.poses import Poses
from flywheel.linkage.solution import solve
from flywheel.loads import spring_effort
from flywheel.mechanisms.linkage import followed
from flywheel.piecewise import wide
from flywheel.scene import TURN, Mechanism

Array = NDArray[np.float64]

_BESIDE = 1e-9  # of the cycle: how near to an edge its two sides are looked at

_ALONG_GUIDE = {
    ("scotch-yoke", "yoke"): "guide",
    ("slider-crank", "slider"): "guide",
    ("crank-shaper", "ram"): "guide",
    ("toggle-clamp", "block"): "block_guide",
    ("toggle-clamp", "platen"): "platen_guide",
}
"""The slide along which a named mechanism's port moves; its other ports are bodies that turn."""


class MachineMotion(NamedTuple):
    """The motion that forces belong to: crank angle (rad; m on a sliding stroke), its rate and its acceleration, (n,)."""

    phi: Array
    omega: Array
    alpha: Array


def port_forces(
    chain: Chain, motion: MachineMotion, balance: float, mechanism: Mechanism, *, inertia: bool = True, friction: bool = True
) -> Reactions:
    """Forces in one mechanism's joints in a motion of the machine, with a value (SI) for the scene's unknown.

    inertia, friction: False leaves them out.
    """
    scene = chain.scene
    ratio = scene.shafts[mechanism.shaft]
    poses = poses_of(mechanism, ratio * (motion.phi - scene.origin) + mechanism.phase)
    return reactions_at(
        poses,
        ratio * motion.omega,
        ratio * motion.alpha,
        gravity=scene.gravity,
        loads=tuple(_PortLoads(chain, motion, balance, inertia).on(mechanism)),
        inertia=inertia,
        friction=friction,
    )


def close_positions(chain: Chain, count: int) -> Array:
    """Coordinates at which hardly a largest force is missed: `count` evenly, and both sides of every edge of a load.

    Angles in rad or positions in m, ascending, from the first to the last of the cycle or the stroke.
    """
    cycle, ends = chain.scene.cycle, chain.scene.stroke is not None
    beside = _BESIDE * cycle
    edges = np.asarray(chain.breakpoints)
    every = np.concatenate((np.linspace(0.0, cycle, count, endpoint=ends), edges, edges - beside, edges + beside))
    inside = (every >= 0.0) & ((every <= cycle) if ends else (every < cycle))
    return np.asarray(chain.scene.origin + np.unique(every[inside]))


def poses_of(mechanism: Mechanism, psi: Array) -> Poses:
    """Poses of any mechanism but a law, as a linkage, at its own coordinates psi (rad, of any turn; m)."""
    if mechanism.linkage is not None:
        cyclic = followed(mechanism)
        solution, period = cyclic.solution, cyclic.period
    else:
        period = TURN if mechanism.stroke is None else None
        solution = solve(linkage_of(mechanism), *sorted(mechanism.stroke or (0.0, TURN)))
    if period is None:
        return solution.poses(np.clip(psi, solution.low, solution.high))
    return solution.poses(psi - period * np.floor(psi / period))


class _PortLoads:
    """What acts on the ports of mechanisms at given positions: loads, springs, and the inertia of what is fixed there."""

    def __init__(self, chain: Chain, motion: MachineMotion, balance: float, inertia: bool) -> None:
        self.chain, self.motion, self.balance, self.inertia = chain, motion, balance, inertia
        self.phi = motion.phi - chain.scene.origin
        self.anchor = chain.anchors(self.phi)

    def on(self, mechanism: Mechanism) -> Iterator[Load]:
        """Loads on one mechanism's ports."""
        for port, value in self._efforts(f"{mechanism.name}."):
            yield port_load(mechanism, port, wide(value, self.phi.shape))

    def _efforts(self, prefix: str) -> Iterator[tuple[str, Array]]:
        scene = self.chain.scene
        for effort in self.chain.efforts:
            if effort.load.on.startswith(prefix):
                here, anchor = self._here(effort.load.on)
                value = effort(here, anchor)
                if effort.depends_on_unknown:
                    value = value + self.balance * effort.per_unknown(here, anchor)
                yield effort.load.on.removeprefix(prefix), value
        for spring in scene.springs:
            if spring.on.startswith(prefix):
                law = spring_effort(spring, self.chain.places[spring.on])
                yield spring.on.removeprefix(prefix), -law(*self._here(spring.on))
        for damper in scene.dampers:
            if damper.on.startswith(prefix):
                yield (
                    damper.on.removeprefix(prefix),
                    -damper.coefficient * self._gain(damper.on, self.phi) * self.motion.omega,
                )
        if self.inertia:
            yield from self._added(prefix)

    def _added(self, prefix: str) -> Iterator[tuple[str, Array]]:
        """Inertia forces of masses that the scene fixes on ports: -m (g alpha + g' omega²)."""
        for item in self.chain.scene.inertias:
            if item.on.startswith(prefix):
                kinematics = self.chain.kinematics
                flows, variable = kinematics.flows(self.phi, self.anchor), kinematics.variable
                k = variable[self.chain.places[item.on].junction]
                gain, slope = flows.gain[k], flows.slope[k]
                value = -item.value * (gain * self.motion.alpha + slope * self.motion.omega**2)
                yield item.on.removeprefix(prefix), value

    def _here(self, place: str) -> tuple[Here, Here]:
        """Positions as a law at a place sees them, and in the middles of their pieces."""
        motion = self.chain.motion_of(place)
        ratio = self.chain.scene.shafts.get(motion.of, 1.0)

        def seen(phi: Array) -> Here:
            here = Here(ratio * phi, motion.position(ratio * phi, np, ratio * self.anchor), np)
            if not self.chain.depends_on_speed:
                return here
            omega = self.motion.omega
            return here._replace(speed=ratio * omega, flow=self._gain(place, phi) * omega, time=0.0)

        return seen(self.phi), seen(self.anchor)

    def _gain(self, place: str, phi: Array) -> Array:
        """The influence coefficient of a place's velocity at coordinates phi, in the pieces of this motion."""
        kinematics = self.chain.kinematics
        k = kinematics.variable[self.chain.places[place].junction]
        return np.asarray(kinematics.flows(phi, self.anchor).gain[k])


def port_load(mechanism: Mechanism, port: str, value: ArrayLike) -> Load:
    """A force (N) or torque (N m) on a mechanism's port, as a load on its bodies; a number or shape (n,)."""
    guide = _ALONG_GUIDE.get((mechanism.type, port))
    if guide is not None:
        return Effort(guide, value)
    point = next((point for point in mechanism.points if point.name == port), None)
    if point is not None:
        along = np.asarray(value, dtype=float)
        return Force(point.body, point.point, np.cos(point.direction) * along, np.sin(point.direction) * along)
    if mechanism.linkage is not None and any(joint.name == port for joint in mechanism.linkage.joints):
        return Effort(port, value)
    return Torque(port, value)
