"""Friction in a linkage's joints as a moment on the crank, over the cycle or along the stroke.

Friction follows the reactions, these the loads, weights and inertia forces: kinetostatics gives its share of the reduced
moment at any position. It is computed along a known motion, so that it depends on position alone and is fitted once by
series on cells, bounded by the angles where it is not smooth: where a joint reverses, or a force passes zero. That
motion is one at a constant speed, the scene's or if none is given the machine's own (`friction_curve`), or one with its
own speeds and accelerations (`friction_along`), such as the steady regime.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.elements import Here
from bondgraph.numerics import roots_between, threshold
from flywheel.machine.loads import FrictionCurve
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.cells import Array
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import constant_speed
from flywheel.scene.linkage import PIN
from flywheel.scene.scene import Mechanism, Scene

if TYPE_CHECKING:
    from flywheel.machine.reactions import MachineMotion
    from flywheel.mechanisms.linkages.reactions import Reactions

    Course = Callable[[Array], MachineMotion]

_CELL_ERROR = 1e-11  # of the largest moment: error of a cell that is left as it is
_FRICTION_ROUNDING = 1e-11  # of the largest force, or rate: what is smaller has no sign, and its friction no shape
_LEAST_WIDTH = 1e-9  # of the cycle: cells that are not cut any more
_MOST_CELLS = 2000  # above which no cell is cut; the rest is part of the error
_SCAN_POINTS = 97  # positions in every cell at which signs are compared, closer to each other towards its ends
_END_DISTANCE = 1e-9  # of a cell: distance of the outermost positions from its ends
_PROBES = (-0.93, -0.41, 0.37, 0.88)  # places in a cell, off its nodes, where the fit is checked
_BALANCE_ERROR = 1e-12
_MOST_BALANCES = 60


def machine_of(source: Machine | Scene, speed: float | None = None) -> Machine:
    """The machine of a scene, or the one given, with the moment of friction in its joints where they have any.

    speed: the constant one (rad/s, or m/s) for it, if not the machine's own.
    """
    machine = source if isinstance(source, Machine) else Machine(source)
    return _rough(machine, speed) if machine.scene.rubs and machine.friction is None else machine


@lru_cache(maxsize=4)
def _rough(machine: Machine, speed: float | None) -> Machine:
    return Machine(machine.scene, friction_curve(machine, speed))


def friction_curve(machine: Machine, speed: float | None = None) -> FrictionCurve:
    """The friction of all joints of a machine without it, at a constant speed: the one given, or its own.

    Where no speed is given, it is the constant one at which the net work is zero without that friction; where nothing
    depends on speed, the friction is that of loads and weights without inertia forces. Where the scene's unknown acts on a
    port, friction and balance depend on each other and are computed alternately.

    Raises:
        SceneError: if friction locks a mechanism, naming the position; where it cannot be balanced.

    """
    scene = machine.scene
    constant, balance = constant_speed.operating_point(machine, speed)
    required = scene.speed if scene.stroke is None else scene.stroke.speed
    speed = constant if speed is None else speed
    speed = required if speed is None else speed
    on_ports = any(effort.depends_on_unknown and effort.load.on not in scene.shafts for effort in machine.efforts)
    # The motion at a constant speed, along a stroke with its acceleration; None: forwards, without inertia forces.
    from flywheel.machine.reactions import MachineMotion  # only linkages have friction

    acceleration = 0.0 if scene.stroke is None else scene.stroke.acceleration
    rate, creeps = (0.0, True) if speed is None else (speed, False)

    def course(q: Array) -> MachineMotion:
        rates = np.full(q.size, rate), np.full(q.size, acceleration)
        return MachineMotion(q + scene.origin, *rates, creeps=creeps)

    for _ in range(_MOST_BALANCES):
        curve = friction_along(machine, course, balance)
        curve.speed = speed
        with_it = constant_speed.operating_point(Machine(scene, curve), speed)[1] if on_ports else balance
        if abs(with_it - balance) <= _BALANCE_ERROR * abs(with_it):
            return curve
        balance = with_it
    raise SceneError([Fault("mechanism", "friction that grows with the balance without end", "less friction in the joints")])


def friction_along(machine: Machine, course: Course, balance: float, bends: Sequence[float] = ()) -> FrictionCurve:
    """The friction of all joints along a motion, by kinetostatics at its speeds and accelerations.

    On cells between its corners, which are cut until they follow it; its error is checked off the nodes.

    Args:
        machine: whose joints rub.
        course: the motion at coordinates of the machine from 0 to the cycle, (n,).
        balance: value (SI) of the scene's unknown.
        bends: positions between which the motion is smooth: of the edges of its cells.

    Raises:
        SceneError: if friction locks a mechanism, naming the position.

    """
    width = machine.scene.cycle
    corners = _corners(machine, course, balance)

    def moments(forces: list[tuple[float, Reactions]]) -> Array:
        """Friction's share of the reduced moment."""
        return np.asarray(sum(ratio * reactions.friction.moment for ratio, reactions in forces))

    def evaluated(edges: Array) -> tuple[tuple[cells.Cells, Array], float, cells.Coarse]:
        mesh = cells.cells(edges)
        forces = _forces(machine, mesh.phi.ravel(), course, balance)
        values = moments(forces).reshape(mesh.phi.shape)
        # what friction's moment would be if the largest force of a mechanism pressed all of its joints
        most = sum(
            abs(ratio) * reactions.scales()[0] * float(reactions.friction.lever.max(initial=0.0))
            for ratio, reactions in forces
        )
        tails, enough = cells.tails(cells.fit(values)), max(_CELL_ERROR * np.abs(values).max(), _FRICTION_ROUNDING * most)
        return (
            (mesh, values),
            float(tails.max()) / enough if enough else 0.0,
            lambda share: (tails > enough) & (2 * mesh.half[:, 0] > _LEAST_WIDTH * width),
        )

    edges = np.array([*machine.mesh, *corners])
    more = [at for at in bends if np.abs(edges - at).min() > _LEAST_WIDTH * width]
    mesh, values = cells.refined(cells.merged([*edges, *more], width), evaluated, 1.0, _MOST_CELLS)
    curve = FrictionCurve(mesh, values, corners)
    probes = (mesh.middle + mesh.half * np.array(_PROBES)).ravel()
    off = np.abs(curve(Here(probes, None, np), Here(probes, None, np)) - moments(_forces(machine, probes, course, balance)))
    curve.error += float((off.reshape(-1, len(_PROBES)).max(axis=1) * 2 * mesh.half[:, 0]).sum())
    return curve


def _forces(machine: Machine, q: Array, course: Course, balance: float) -> list[tuple[float, Reactions]]:
    """Reactions in every linkage at coordinates q from 0 to the cycle of a motion, with the ratio of its shaft."""
    from flywheel.machine.reactions import port_forces

    scene, motion = machine.scene, course(q)
    rows = []
    for mechanism in scene.mechanisms:
        if mechanism.linkage is not None:
            forces = port_forces(machine, motion, balance, mechanism, inertia=not motion.creeps)
            if forces.locked.size:
                free, high = forces.friction.converged, float(q[~forces.friction.converged].min())
                low = float(q[free & (q < high)].max(initial=0.0))

                def locks(at: float, mechanism: Mechanism = mechanism) -> bool:
                    there = course(np.array([at]))
                    return bool(port_forces(machine, there, balance, mechanism, inertia=not there.creeps).locked.size)

                high = threshold(locks, low, high)
                what = f"friction that locks the mechanism at {machine.where(high)}"
                advice = "less friction, smaller pins, or other angles"
                raise SceneError([Fault(mechanism.path, what, "joints that let it move", advice)])
            rows.append((scene.shafts[mechanism.shaft], forces))
    return rows


def _rows(forces: list[tuple[float, Reactions]]) -> tuple[Array, Array]:
    """Rates of all rough joints and their normal forces, shape (rows, n), and the sizes below which they are rounding.

    These are shares of the largest of their kind in the mechanism.
    """
    from flywheel.mechanisms.linkages.statics import joint_rate

    rows = list[tuple[Array, float]]()
    for _, reactions in forces:
        poses, force = reactions.poses, reactions.scales()[0]
        rough = [joint for joint in poses.linkage.joints if joint.friction]
        for joint in rough:
            rates = poses.rate[:, 2] if joint.kind == PIN else poses.rate[:, :2]
            rows.append((joint_rate(poses, joint), float(np.abs(rates).max())))
        couplings = [coupling.name for coupling in poses.linkage.couplings if coupling.friction]
        for name in [joint.name for joint in rough] + couplings:
            parts = reactions.components[name]
            rows += [(parts[part], force) for part in ("normal", "front", "rear") if part in parts]
    values, sizes = zip(*rows, strict=True)
    return np.array(values), _FRICTION_ROUNDING * np.array(sizes)[:, None]


def _corners(machine: Machine, course: Course, balance: float) -> Array:
    """Coordinates where a rough joint reverses or a normal force changes sign.

    They are searched for inside every cell of the machine's first mesh, densely towards its ends, where loads set in; then
    they are bracketed closely, all at once. A change of sign across an edge of that mesh is at the edge.
    """
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _SCAN_POINTS))
    share[[0, -1]] = _END_DISTANCE, 1.0 - _END_DISTANCE
    edges, width = machine.mesh, machine.scene.cycle
    inside = edges[:-1, None] + np.diff(edges)[:, None] * share
    flat, least = _rows(_forces(machine, inside.ravel(), course, balance))
    values = np.where(np.abs(flat) > least, flat, 0.0).reshape(-1, *inside.shape)
    signs = np.sign(values)
    turned = (signs[:, :-1, -1] * signs[:, 1:, 0] < 0.0).any(axis=0)
    at_edges = edges[1:-1][turned & ~np.isin(edges[1:-1], machine.breakpoints)]  # the latter cut every cycle anyway
    row, cell, place = np.nonzero(signs[:, :, 1:] != signs[:, :, :-1])
    if not row.size:
        return at_edges
    low, high = inside[cell, place], inside[cell, place + 1]
    first, ends = np.sign(values[row, cell, place]), np.sign(values[row, cell, place + 1])

    def before(at: Array) -> Array:
        """The value on the side before, if its sign changes; if it becomes zero or begins there, only its sign."""
        there = _rows(_forces(machine, at, course, balance))[0][row, np.arange(row.size)]
        sign = np.where(np.abs(there) > least[row, 0], np.sign(there), 0.0)
        return np.where(first * ends < 0.0, there * first, np.where(sign == first, 1.0, -1.0))

    corners = roots_between(before, low, high, 2 * cells.ROUNDING * width)
    places = cells.merged([*corners, *at_edges], width)[1:-1]
    return places[np.diff(places, prepend=-1.0) > _LEAST_WIDTH * width]
