"""Quinn's energy shares: what part of the kinetic energy each body holds. They depend on position alone, not on speed.

    e_j = T_j/T = (m_j g_Gj² + J_j g_j²)/I*,   sum e_j = 1

because every velocity is its influence coefficient times the speed of the reduction element. So the energy of one body
gives that of the machine, and the energy of the machine the speed: omega = sqrt(2 E/I*) = sqrt(2 e_1 E/I_1), where I_1
is the crank's inertia about its pivot. (The course writes I_e there, and leaves open that the crank's mass counts, times
l_e².)

Source: the course, 4 a; B. E. Quinn, Energy method for determining dynamic characteristics of mechanisms, Journal of
Applied Mechanics 16 (1949) 283-288.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.machine.machine import FLYWHEEL, Machine
from flywheel.mechanisms.linkages.positions import Poses
from flywheel.numerics import cells
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, array, number_faults, refuse, require
from flywheel.numerics.faults import Fault, SceneError, told
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import MachineState, reduce
from flywheel.scene.scene import Scene

Array = NDArray[np.float64]

_STILL = 1e-10  # speeds that this share of the greatest is left of, rounding decides: I* below its square is zero
_PROBES = 33  # positions over the cycle from which the scale of I* is taken
_MOST_CELLS = 4096
_LEVEL = 1e-11  # a share's slope across a cell within which it counts as constant


class BodyShare(NamedTuple):
    """A body's share over the cycle: mean over the coordinate, extremes, and the coordinates (rad or m) of the extremes."""

    mean: float
    least: float
    least_at: float
    greatest: float
    greatest_at: float


class CycleShares(NamedTuple):
    """Every body's share over the cycle, by name, and the estimated absolute error of the means."""

    bodies: Mapping[str, BodyShare]
    error: float


def shares(machine: Machine | Scene, phi: ArrayLike, *, flywheel: float = 0.0) -> dict[str, Array]:
    """Share of every body in the kinetic energy, e_j = (m g_G² + J g²)/I*, at any angles; they sum to 1.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angles, rad, any shape; on a stroke the driver's coordinates, rad or m.
        flywheel: inertia of a flywheel at its own shaft, kg m², counted as one more body ("the flywheel").

    Raises:
        SceneError: where nothing moves, so that there is no energy to share: I* = 0, as at the dead centre of a crank
            without mass. The fault names the angle.

    >>> import flywheel
    >>> yoke = {"type": "scotch-yoke", "crank": {"length": 0.5, "inertia": 5.0}, "yoke": {"mass": 20.0}}
    >>> scene = flywheel.load({"mechanism": yoke, "regime": {"speed": 1}, "flywheel": {"inertia": 0}})
    >>> {name: share.round(12).tolist() for name, share in shares(scene, [0.0, np.pi / 2]).items()}
    {'scotch-yoke.crank': [1.0, 0.5], 'scotch-yoke.yoke': [0.0, 0.5]}

    """
    machine = _machine(machine)
    state, whole, parts = _at(machine, phi, flywheel)
    _refuse_still(machine.scene, state.phi, whole, _scale(machine, flywheel))
    return {name: part / whole for name, part in parts.items()}


def cycle_shares(machine: Machine | Scene, *, flywheel: float = 0.0, rtol: float = 1e-9) -> CycleShares:
    """Share of every body over the cycle (or the stroke): mean, least, greatest, and where.

    The mean is that over the coordinate, (1/lambda) integral e_j dphi, by Chebyshev cells that are halved until `rtol` is
    reached or there are 4096 of them.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        flywheel: inertia of a flywheel at its own shaft, kg m², counted as one more body.
        rtol: error allowed in a mean.

    Raises:
        SceneError: if I* = 0 somewhere, with the angle.

    >>> import flywheel
    >>> yoke = {"type": "scotch-yoke", "crank": {"length": 0.5, "inertia": 5.0}, "yoke": {"mass": 20.0}}
    >>> scene = flywheel.load({"mechanism": yoke, "regime": {"speed": 1}, "flywheel": {"inertia": 0}})
    >>> of_yoke = cycle_shares(scene).bodies["scotch-yoke.yoke"]
    >>> round(of_yoke.mean, 9), round(of_yoke.least, 9), round(of_yoke.greatest, 9)  # 1 - 1/sqrt 2, 0, 1/2
    (0.292893219, 0.0, 0.5)

    """
    machine = _machine(machine)
    mesh, values, doubt = _resolved(machine, flywheel, rtol)
    slopes = _slopes(cells.fit(values))
    found = cells.crossings(slopes, np.full(slopes.shape[:-1], _LEVEL))
    ends = machine.scene.origin + np.sort(np.concatenate((mesh.edges, found.angles(mesh))))
    at_ends = shares(machine, ends, flywheel=flywheel)
    means = cells.integral(values, mesh.half).sum(axis=-1) / mesh.edges[-1]
    bodies = {
        name: _body(share, ends, mean) for (name, share), mean in zip(at_ends.items(), means[1:].tolist(), strict=True)
    }
    return CycleShares(bodies, doubt)


def speed_from_energy(machine: Machine | Scene, phi: ArrayLike, energy: ArrayLike, *, flywheel: float = 0.0) -> Array:
    """Speed (rad/s, or m/s where the driver slides) at which the machine holds a kinetic energy: omega = sqrt(2 E/I*).

    The same for every body that moves: sqrt(2 e_j E/I_j*), with its share e_j and its own part I_j* of I*.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angles, rad, any shape; on a stroke the driver's coordinates, rad or m.
        energy: E, J, 0 or above: energy at a known position plus the work done since; same shape or a number.
        flywheel: inertia of a flywheel at its own shaft, kg m².

    Raises:
        SceneError: where I* = 0, or the energy is negative: the machine does not get there.

    >>> import flywheel
    >>> rotor = {"inertia": [{"on": "crank", "value": 4}], "regime": {"speed": 1}, "flywheel": {"inertia": 0}}
    >>> float(speed_from_energy(flywheel.load(rotor), 1.0, 50.0))
    5.0

    """
    machine = _machine(machine)
    state, whole, _ = _at(machine, phi, flywheel)
    _refuse_still(machine.scene, state.phi, whole, _scale(machine, flywheel))
    held = array("energy", energy)
    if held.shape not in ((), whole.shape):
        raise SceneError([Fault("energy", f"an array of shape {held.shape}", f"a number or shape {whole.shape}")])
    held = np.broadcast_to(held, whole.shape)
    short = ~(held >= 0.0)
    if short.any():
        where = told(float(state.phi[short].flat[0]), _sliding(machine.scene))
        found = f"{float(held[short].flat[0]):g} J at {where}"
        raise SceneError([Fault("energy", found, "0 or above", "the machine stops before it gets there")])
    return np.asarray(np.sqrt(2.0 * held / whole))


def linkage_shares(poses: Poses) -> dict[str, Array]:
    """Share of every link of a linkage in its kinetic energy, e_j = (m |g_G|² + J g²)/I*, at the poses given.

    Args:
        poses: of a linkage, at n positions; every share has shape (n,).

    Raises:
        SceneError: at a position where nothing that has mass moves, with the driver's coordinate there.

    """
    require("poses", poses, Poses, "Poses")
    linkage = poses.linkage
    parts = {
        link.name: link.mass * (poses.centre(link.name).rate ** 2).sum(axis=0)
        + link.inertia * poses.angle(link.name).rate ** 2
        for link in linkage.links
    }
    whole = np.sum(list(parts.values()), axis=0)
    size = max((np.hypot(p.x, p.y) for link in (linkage.ground, *linkage.links) for p in link.points), default=0.0) or 1.0
    scale = sum(link.mass * size**2 + link.inertia for link in linkage.links) / (size**2 if linkage.sliding else 1.0)
    _refuse(linkage.path, poses.q, whole, float(scale), linkage.sliding)
    return {name: part / whole for name, part in parts.items()}


def _machine(given: Machine | Scene) -> Machine:
    require("machine", given, (Machine, Scene), "a Machine, or a Scene")
    return machine_of(given)


def _at(machine: Machine, phi: ArrayLike, flywheel: float) -> tuple[MachineState, Array, dict[str, Array]]:
    """The reduced machine, I* with the flywheel, and what every body adds to it."""
    refuse(number_faults("flywheel", flywheel, NOT_NEGATIVE, "kg m²"))
    state = reduce(machine, array("phi", phi), balance=0.0)
    wheel = flywheel * machine.scene.flywheel_ratio**2
    parts = dict(state.inertia_parts)
    if wheel:
        parts[FLYWHEEL] = np.full_like(state.inertia, wheel)
    return state, np.asarray(state.inertia + wheel), parts


def _scale(machine: Machine, flywheel: float) -> float:
    scene = machine.scene
    probes = scene.origin + machine.mesh[-1] * (np.arange(_PROBES) + 0.5) / _PROBES
    return float(_at(machine, probes, flywheel)[1].max())


def _sliding(scene: Scene) -> bool:
    return scene.stroke is not None and scene.stroke.sliding


def _refuse_still(scene: Scene, phi: Array, inertia: Array, scale: float) -> None:
    _refuse(scene.mechanisms[0].path if scene.mechanisms else "inertia", phi, inertia, scale, _sliding(scene))


def _refuse(path: str, phi: Array, inertia: Array, scale: float, sliding: bool) -> None:
    """Refuse positions where nothing that has mass moves."""
    still = ~(inertia > _STILL**2 * scale)
    if still.any():
        where = told(float(phi[still].flat[0]), sliding)
        symbol = "m* = 0" if sliding else "I* = 0"
        found = f"no body with mass that moves at {where} ({symbol})"
        raise SceneError(
            [Fault(path, found, "kinetic energy to share", "give the driver inertia, or leave that position out")]
        )


def _resolved(machine: Machine, flywheel: float, rtol: float) -> tuple[cells.Cells, Array, float]:
    """Cells, at their nodes I* (over its scale) and then all shares, and the estimated error of the means."""
    refuse(number_faults("rtol", rtol, POSITIVE))
    if not rtol < 1.0:
        raise SceneError([Fault("rtol", f"{rtol}", "a number between 0 and 1")])
    scale = _scale(machine, flywheel)

    def evaluated(edges: Array) -> tuple[tuple[cells.Cells, Array, float], float, cells.Coarse]:
        mesh = cells.cells(edges)
        state, whole, parts = _at(machine, machine.scene.origin + mesh.phi, flywheel)
        _refuse_still(machine.scene, state.phi, whole, scale)
        values = np.array([whole / scale, *(part / whole for part in parts.values())])
        errors = cells.tails(cells.fit(values)).max(axis=0) * mesh.half[:, 0] / edges[-1]
        doubt = float(errors.sum())
        return (mesh, values, doubt), doubt, cells.above(errors)

    return cells.refined(machine.mesh, evaluated, rtol, _MOST_CELLS)


def _slopes(series: Array) -> Array:
    """Series of the derivative, padded to the same length."""
    from numpy.polynomial import chebyshev

    slopes = chebyshev.chebder(series, axis=-1)
    return np.concatenate((slopes, np.zeros((*slopes.shape[:-1], 1))), axis=-1)


def _body(share: Array, phi: Array, mean: float) -> BodyShare:
    low, high = int(share.argmin()), int(share.argmax())
    return BodyShare(mean, float(share[low]), float(phi[low]), float(share[high]), float(phi[high]))
