"""What acts on a scene's mechanisms as linkages: the loads on their ports, and the reactions that follow in their joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.elements import Here
from flywheel.machine.loads import spring_effort
from flywheel.machine.machine import Chain, merged
from flywheel.mechanisms.linkage import followed
from flywheel.mechanisms.linkages.families import linkage_of
from flywheel.mechanisms.linkages.poses import Poses
from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.reactions import Reactions, reactions_at
from flywheel.mechanisms.linkages.wrenches import Effort, Force, Load, Torque, pace
from flywheel.numerics import cells
from flywheel.numerics.cells import Cells, wide
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import constant_speed
from flywheel.scene.linkage import PIN
from flywheel.scene.scene import TURN, Mechanism, Scene

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


# -- joint friction ----------------------------------------------------------------------------------------------------

# What friction in a linkage's joints asks of the crank, over the cycle or along the stroke.
#
# Friction follows the reactions, these the loads, weights and inertia forces: kinetostatics gives its share of the reduced
# moment at any position. It is taken at a constant speed, the scene's or where none is given the machine's own, so that it
# depends on position alone and is fitted once by series on cells, which close in on the angles where it is not smooth: where
# a joint turns back, or a force passes zero.


_FINE = 1e-11  # of the largest moment: error of a cell that is left as it is
_ROUNDING = 1e-11  # of the largest force, or rate: what is smaller has no sign, and its friction no shape
_NARROW = 1e-9  # of the cycle: cells that are not cut any more
_MOST_CELLS = 2000  # from which on no cell is cut; what that leaves is told as error
_SCANNED = 97  # positions in every cell at which signs are compared, closer to each other towards its ends
_END = 1e-9  # of a cell: how near to its ends that goes
_PROBES = (-0.93, -0.41, 0.37, 0.88)  # places in a cell, off its nodes, where the fit is checked
_HALVINGS = 52
_BALANCED = 1e-12
_MOST_BALANCES = 60


class FrictionCurve:
    """The moment (N m, or N) of friction in joints on the reduction element, on its coordinate from 0 to the cycle.

    It is not smooth at `breakpoints`. `error` (J) bounds what its fit adds to the work of the cycle: by the series' tails,
    and by what was found off the nodes.
    """

    def __init__(self, mesh: Cells, values: Array, corners: Array) -> None:
        self.mesh, self.series = mesh, cells.fit(values)
        self.breakpoints = tuple(corners.tolist())
        self.error = float((cells.tails(self.series) * 2 * mesh.half[:, 0]).sum())

    def __call__(self, here: Here, anchor: Here) -> Any:
        """The moment at positions `here.q`."""
        cell, t = cells.located(self.mesh, np.asarray(here.q, dtype=float))
        return cells.value(self.series[cell], t)


def friction_curve(scene: Scene) -> FrictionCurve:
    """The friction of all joints of a scene's linkages at its constant speed.

    Where no speed is given, it is the constant one at which the net work is zero without that friction.

    Where the scene's unknown acts on a port, friction and balance depend on each other, and both are found in turn.

    Raises:
        SceneError: where friction locks a mechanism, naming the position; where it cannot be balanced.

    """
    chain = Chain(scene)
    speed, balance = constant_speed.settled(chain)
    pace = scene.speed if speed is None else speed
    for _ in range(_MOST_BALANCES):
        curve = _fitted(chain, pace or 0.0, balance)
        with_it = constant_speed.settled(Chain(scene, curve))[1] if _on_ports(chain) else balance
        if abs(with_it - balance) <= _BALANCED * abs(with_it):
            return curve
        balance = with_it
    raise SceneError([Fault("mechanism", "friction that grows with the balance without end", "less friction in the joints")])


def _on_ports(chain: Chain) -> bool:
    """Whether the scene's unknown acts within a mechanism."""
    return any(effort.depends_on_unknown and effort.load.on not in chain.scene.shafts for effort in chain.efforts)


def _fitted(chain: Chain, speed: float, balance: float) -> FrictionCurve:
    """The curve on cells between its corners, cut until they follow it."""
    width = chain.scene.cycle
    corners = _corners(chain, speed, balance)

    def evaluated(edges: Array) -> tuple[tuple[cells.Cells, Array], float, cells.Coarse]:
        mesh = cells.cells(edges)
        forces = _forces(chain, mesh.phi.ravel(), speed, balance)
        values = _moments(forces).reshape(mesh.phi.shape)
        tails = cells.tails(cells.fit(values))
        enough = max(_FINE * np.abs(values).max(), _ROUNDING * _moment_scale(forces))
        return (
            (mesh, values),
            float(tails.max()) / enough if enough else 0.0,
            lambda share: (tails > enough) & (2 * mesh.half[:, 0] > _NARROW * width),
        )

    mesh, values = cells.refined(merged([*chain.mesh, *corners], width), evaluated, 1.0, _MOST_CELLS)
    curve = FrictionCurve(mesh, values, corners)
    probes = (mesh.middle + mesh.half * np.array(_PROBES)).ravel()
    off = np.abs(curve(Here(probes, None, np), Here(probes, None, np)) - _moments(_forces(chain, probes, speed, balance)))
    curve.error += float((off.reshape(-1, len(_PROBES)).max(axis=1) * 2 * mesh.half[:, 0]).sum())
    return curve


def _forces(chain: Chain, q: Array, speed: float, balance: float) -> list[tuple[float, Reactions]]:
    """Reactions in every linkage at coordinates q from 0 to the cycle, with the ratio of its shaft."""
    scene = chain.scene
    acceleration = 0.0
    if scene.stroke is not None:
        speed, acceleration = scene.stroke.speed, scene.stroke.acceleration
    motion = MachineMotion(q + scene.origin, np.full(q.size, speed), np.full(q.size, acceleration))
    found = []
    for mechanism in scene.mechanisms:
        if mechanism.linkage is not None:
            forces = port_forces(chain, motion, balance, mechanism)
            if forces.locked.size:
                raise SceneError([_locked(chain, mechanism.path, float(q[~forces.friction.converged][0]))])
            found.append((scene.shafts[mechanism.shaft], forces))
    return found


def _moments(forces: list[tuple[float, Reactions]]) -> Array:
    """Friction's share of the reduced moment."""
    return np.asarray(sum(ratio * found.friction.moment for ratio, found in forces))


def _moment_scale(forces: list[tuple[float, Reactions]]) -> float:
    """What friction's moment would be if the largest force of a mechanism pressed all of its joints."""
    return sum(abs(ratio) * found.scales()[0] * float(found.friction.lever.max(initial=0.0)) for ratio, found in forces)


def _watched(forces: list[tuple[float, Reactions]]) -> Iterator[tuple[Array, float]]:
    """The rate of every rough joint and its normal forces, (n,) each, with the largest of their kind in the mechanism."""
    for _, found in forces:
        poses, force = found.poses, found.scales()[0]
        for joint in poses.linkage.joints:
            if joint.friction:
                rates = poses.rate[:, 2] if joint.kind == PIN else poses.rate[:, :2]
                yield pace(poses, joint), float(np.abs(rates).max())
                yield from ((values, force) for values in _pushing(found, joint.name))
        for coupling in poses.linkage.couplings:
            if coupling.friction:
                yield from ((values, force) for values in _pushing(found, coupling.name))


def _pushing(found: Reactions, name: str) -> list[Array]:
    parts = found.components[name]
    return [parts[part] for part in ("normal", "front", "rear") if part in parts]


def _signs(forces: list[tuple[float, Reactions]], least: Array | None = None) -> tuple[Array, Array]:
    """Which way every rough joint moves and its normal forces point, shape (signs, n), 0 for rounding; what is rounding.

    least: the latter, from other positions.
    """
    values, sizes = zip(*_watched(forces), strict=True)
    rows = np.array(values)
    least = _ROUNDING * np.array(sizes)[:, None] if least is None else least
    return np.where(np.abs(rows) > least, np.sign(rows), 0.0), least


def _corners(chain: Chain, speed: float, balance: float) -> Array:
    """Coordinates where a rough joint turns back or a normal force changes sign.

    They are looked for inside every cell of the machine's first mesh, densely towards its ends, where loads set in; then
    they are halved down, all at once. What changes sign across an edge of that mesh does so at the edge.
    """
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _SCANNED))
    share[[0, -1]] = _END, 1.0 - _END
    edges = chain.mesh
    inside = edges[:-1, None] + np.diff(edges)[:, None] * share
    flat, least = _signs(_forces(chain, inside.ravel(), speed, balance))
    signs = flat.reshape(-1, *inside.shape)
    turned = (signs[:, :-1, -1] * signs[:, 1:, 0] < 0.0).any(axis=0)
    at_edges = edges[1:-1][turned & ~np.isin(edges[1:-1], chain.breakpoints)]  # the latter cut every cycle anyway
    row, cell, place = np.nonzero(signs[:, :, 1:] != signs[:, :, :-1])
    if not row.size:
        return at_edges
    low, high, first = inside[cell, place], inside[cell, place + 1], signs[row, cell, place]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        same = _signs(_forces(chain, middle, speed, balance), least)[0][row, np.arange(row.size)] == first
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    found = merged([*high, *at_edges], chain.scene.cycle)[1:-1]
    return found[np.diff(found, prepend=-1.0) > _NARROW * chain.scene.cycle]


def _locked(chain: Chain, path: str, q: float) -> Fault:
    found = f"friction that locks the mechanism at {chain.where(q)}"
    return Fault(path, found, "joints that let it move", "less friction, smaller pins, or other angles")
