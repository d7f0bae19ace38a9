"""Energy in the stores of a machine, and Quinn's shares: each body's share of the kinetic energy.

Shares depend on position alone, not on speed.

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
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from flywheel.machine.machine import FLYWHEEL, Machine
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkage import linkage_of
from flywheel.motions.kinematics import motion
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import (
    NOT_NEGATIVE,
    POSITIVE,
    Fault,
    SceneError,
    array,
    coordinate_text,
    number_faults,
    refuse,
    require,
)
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import ROUNDINGS, beside, own_coordinate, reduce, rounded_otherwise, spread
from flywheel.scene.scene import Scene

Array = NDArray[np.float64]

_STILL = 1e-10  # of the greatest speed: smaller ones are rounding, and I* below its square is zero
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
        SceneError: if nothing moves, so that there is no energy to share: I* = 0, as at the dead centre of a crank
            without mass. The fault names the angle.

    >>> import flywheel
    >>> yoke = {"type": "scotch-yoke", "crank": {"length": 0.5, "inertia": 5.0}, "yoke": {"mass": 20.0}}
    >>> scene = flywheel.load({"mechanism": yoke, "regime": {"speed": 1}, "flywheel": {"inertia": 0}})
    >>> {name: share.round(12).tolist() for name, share in shares(scene, [0.0, np.pi / 2]).items()}
    {'scotch-yoke.crank': [1.0, 0.5], 'scotch-yoke.yoke': [0.0, 0.5]}

    """
    _, total, parts = _moving(_machine(machine), phi, flywheel)
    return {name: part / total for name, part in parts.items()}


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
    refuse(number_faults("rtol", rtol, POSITIVE))
    if not rtol < 1.0:
        raise SceneError([Fault("rtol", f"{rtol}", "a number between 0 and 1")])
    scale = _scale(machine, flywheel)

    def evaluated(edges: Array) -> tuple[tuple[cells.Cells, Array, float], float, cells.Coarse]:
        """Cells, at their nodes I* (over its scale) and then all shares, and the estimated error of the means."""
        mesh = cells.cells(edges)
        _, total, parts = _moving(machine, machine.scene.origin + mesh.phi, flywheel, scale)
        values = np.array([total / scale, *(part / total for part in parts.values())])
        errors = cells.tails(cells.fit(values)).max(axis=0) * mesh.half[:, 0] / edges[-1]
        error = float(errors.sum())
        return (mesh, values, error), error, cells.above(errors)

    mesh, values, error = cells.refined(machine.mesh, evaluated, rtol, _MOST_CELLS)
    series = cells.fit(values)
    slopes = np.zeros_like(series)
    slopes[..., :-1] = chebyshev.chebder(series, axis=-1)
    crossings = cells.crossings(slopes, np.full(slopes.shape[:-1], _LEVEL))
    ends = machine.scene.origin + np.sort(np.concatenate((mesh.edges, crossings.angles(mesh))))
    means = cells.integral(values, mesh.half).sum(axis=-1) / mesh.edges[-1]
    bodies = {}
    for (name, share), mean in zip(shares(machine, ends, flywheel=flywheel).items(), means[1:].tolist(), strict=True):
        low, high = int(share.argmin()), int(share.argmax())
        bodies[name] = BodyShare(mean, float(share[low]), float(ends[low]), float(share[high]), float(ends[high]))
    return CycleShares(bodies, error)


class StoredEnergy(NamedTuple):
    """Energy of every store of a machine at n positions (J), by name: the energy forms E(p) and E(q).

    kinetic: of every body with mass or inertia, and of added inertias; p²/(2 m), as ½ I_j* omega².
    potential: of every spring, ½ k (x - rest)², and of every weight, -m (g · r) with r from the frame's origin, where it is
        zero. A law, whose outputs have no position in the frame, has no weights.
    errors: estimated absolute errors under the same names.
    """

    kinetic: Mapping[str, Array]
    potential: Mapping[str, Array]
    errors: Mapping[str, Array]

    @property
    def total(self) -> Array:
        """The total, J, shape (n,)."""
        return np.asarray(sum((*self.kinetic.values(), *self.potential.values()), np.zeros(1)))


@np.errstate(all="ignore")
def stored_energy(
    machine: Machine | Scene, phi: ArrayLike, speed: ArrayLike = 0.0, *, flywheel: float = 0.0
) -> StoredEnergy:
    """Energy in every body, spring and weight at positions and speeds of the driver.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angles (rad), not reduced to a turn where they come from a motion; on a stroke the driver's coordinates.
        speed: of the driver (rad/s or m/s) there, one or as many; 0 leaves the potential energy.
        flywheel: inertia of a flywheel at its own shaft, kg m², counted as one more body.

    Raises:
        SceneError: for positions outside the stroke, or a number of speeds that does not match.

    >>> import flywheel
    >>> press = {"type": "slider-crank", "crank": {"length": 3.0}, "rod": {"length": 5.0}, "slider": {"mass": 2.0}}
    >>> spring = [{"on": "slider", "stiffness": 10.0, "rest": 7.0}]
    >>> scene = flywheel.load({"mechanism": press, "spring": spring, "gravity": {"g": 10, "direction": "180 deg"}})
    >>> energy = stored_energy(scene, [0.0, np.pi / 2], 2.0)
    >>> energy.kinetic["slider-crank.slider"].round(9).tolist()
    [0.0, 36.0]
    >>> {name: values.round(9).tolist() for name, values in energy.potential.items()}
    {'spring[0] on slider-crank.slider': [5.0, 45.0], 'weight of slider-crank.slider': [160.0, 80.0]}

    """
    machine = machine if isinstance(machine, Machine) else Machine(machine)
    scene = machine.scene
    refuse(number_faults("flywheel", flywheel, NOT_NEGATIVE, "kg m²"))
    positions, pace = array("phi", phi).ravel(), array("speed", speed).ravel()
    if pace.size not in (1, positions.size):
        raise SceneError([Fault("speed", f"{pace.size} speeds", f"one, or {positions.size} as there are positions")])
    # ½ I_j* omega² of every body at the machine's own coordinates, and estimated errors: found again by other roundings.
    own = own_coordinate(scene, positions)
    anchor, shape = machine.anchors(own), own.shape

    def stored(machine: Machine, at: Array) -> dict[str, Array]:
        chain = machine.kinematics
        return {
            name: 0.5 * part * pace**2 + np.zeros(shape) for name, part in chain.inertias(chain.flows(at, anchor)).items()
        }

    energies, cycle = stored(machine, own), machine.scene.cycle
    others = zip(rounded_otherwise(machine), (1.0, 0.4), strict=True)
    kinetic, errors = (
        energies,
        spread(energies, [stored(other, beside(own, anchor, cycle, share)) for other, share in others]),
    )
    if flywheel:
        kinetic[FLYWHEEL] = 0.5 * flywheel * scene.flywheel_ratio**2 * pace**2 + np.zeros_like(positions)
        errors[FLYWHEEL] = ROUNDINGS * ROUNDING * kinetic[FLYWHEEL]
    record, potential = motion(scene, at=positions), {}
    for spring in scene.springs:
        driven = spring.on == scene.reduction_element
        place, off = (record.q, 0.0 * record.q) if driven else (record[spring.on].position, record[spring.on].errors[0])
        name, stretch = f"{spring.path} on {spring.on}", place - spring.rest
        potential[name] = 0.5 * spring.stiffness * stretch**2
        errors[name] = spring.stiffness * np.abs(stretch) * off + ROUNDINGS * ROUNDING * potential[name]
    gravity = np.reshape(scene.gravity or (0.0, 0.0), (2, 1))
    for mechanism in scene.mechanisms if gravity.any() else ():
        for link in linkage_of(mechanism).links if has_joints(mechanism) else ():
            if link.mass:
                name, centre = f"weight of {mechanism.name}.{link.name}", record[f"{mechanism.name}.{link.name}.com"]
                along = -link.mass * gravity
                potential[name] = (along * centre.position).sum(axis=0)
                errors[name] = (np.abs(along) * (centre.errors[0] + ROUNDINGS * ROUNDING * np.abs(centre.position))).sum(
                    axis=0
                )
    return StoredEnergy(kinetic, potential, errors)


def _machine(source: Machine | Scene) -> Machine:
    require("machine", source, (Machine, Scene), "a Machine, or a Scene")
    return machine_of(source)


def _moving(
    machine: Machine, phi: ArrayLike, flywheel: float, scale: float | None = None
) -> tuple[Array, Array, dict[str, Array]]:
    """Positions, I* with the flywheel there, and the contribution of every body; a SceneError if nothing with mass moves."""
    phi, total, parts = _inertia(machine, phi, flywheel)
    scene = machine.scene
    path = scene.mechanisms[0].path if scene.mechanisms else "inertia"
    still = ~(total > _STILL**2 * (_scale(machine, flywheel) if scale is None else scale))
    if still.any():
        symbol = "m* = 0" if scene.sliding else "I* = 0"
        defect = f"no body with mass that moves at {coordinate_text(float(phi[still].flat[0]), scene.sliding)} ({symbol})"
        advice = "give the driver inertia, or leave that position out"
        raise SceneError([Fault(path, defect, "kinetic energy to share", advice)])
    return phi, total, parts


def _inertia(machine: Machine, phi: ArrayLike, flywheel: float) -> tuple[Array, Array, dict[str, Array]]:
    refuse(number_faults("flywheel", flywheel, NOT_NEGATIVE, "kg m²"))
    state = reduce(machine, array("phi", phi), balance=0.0)
    wheel = flywheel * machine.scene.flywheel_ratio**2
    parts = dict(state.inertia_parts) | ({FLYWHEEL: np.full_like(state.inertia, wheel)} if wheel else {})
    return state.phi, np.asarray(state.inertia + wheel), parts


def _scale(machine: Machine, flywheel: float) -> float:
    """The greatest I* of positions over the cycle."""
    probes = machine.scene.origin + machine.mesh[-1] * (np.arange(_PROBES) + 0.5) / _PROBES
    return float(_inertia(machine, probes, flywheel)[1].max())
