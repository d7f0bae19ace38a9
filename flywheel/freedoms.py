"""Linkages of several degrees of freedom: reduced inertia matrix, Lagrange's equations, simulation, driving actions.

A plane linkage, open chain or closed loops, has g degrees of freedom and g drivers, whose coordinates q_1 ... q_g (rad of a
pin, m of a slide) determine the position. The centre of mass of every body has g influence coefficients, vectors
g_i = dr/dq_i, with derivatives g_ij = d²r/dq_i dq_j, and so has its angle: gamma_i, gamma_ij. Then, by virtual powers with
the g velocity fields,

    I*_ij = sum m g_i · g_j + J gamma_i gamma_j                       (kg m², kg m, kg)
    Gamma_ijk = sum m g_i · g_jk + J gamma_i gamma_jk                 (= ½ (dI*_ij/dq_k + dI*_ik/dq_j - dI*_jk/dq_i))
    Q_i = sum F · g_i + M gamma_i                                     (N m, N)
    sum_j I*_ij qddot_j + sum_jk Gamma_ijk qdot_j qdot_k = Q_i + D_i

D_i being the driving action in the i-th driver, from its first body on its second along the coordinate. With one
driver these are I* qddot + ½ dI*/dq qdot² = M*.

Positions: from where guesses and sides hold the linkage is followed along the straight way to the first position, and from
each to the next, by steps that are proven not to leave the assembly. Valid for rigid bodies and joints without play.

Sources: the course's principle of virtual powers and Lagrange's equations; H. Goldstein, Classical Mechanics, section 1.4.

>>> from flywheel.scene.linkage import Driver, Joint, Link, Linkage, Point
>>> o, tip = Point("o"), Point("tip", 1.0)
>>> bars = Link("upper", (o, tip), 3.0, 0.25, (0.5, 0.0)), Link("lower", (o,), 1.2, 0.025, (0.25, 0.0))
>>> pins = Joint("shoulder", "pin", "frame", "upper", o, o), Joint("elbow", "pin", "upper", "lower", tip, o)
>>> arm = Linkage(Link("frame", (o,)), bars, pins, "shoulder", further=(Driver("elbow"),))
>>> mass_matrix(arm, [0.0, 0.0]).round(12).tolist()
[[2.9, 0.4], [0.4, 0.1]]
>>> driving_actions(arm, [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], gravity=(0.0, -10.0))["elbow"].round(12).tolist()
3.0
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.linkages.bodies import UnreachableError, integrate
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.freedoms import (
    Assembly,
    Follower,
    LinkageStation,
    Positions,
    driver_rows,
    end_of_way,
    fields,
    inner_products,
    pair_directions,
    pose_array,
    positions,
    shaped_as,
    stations,
)
from flywheel.mechanisms.linkages.reactions import Effort, Force, Load, Reactions, Torque, reactions_at
from flywheel.mechanisms.linkages.statics import applied, guide, joint_rate
from flywheel.numerics.faults import (
    NOT_NEGATIVE,
    POSITIVE,
    Fault,
    SceneError,
    array,
    brief,
    name_faults,
    number_faults,
    refuse,
    require,
    vector,
)
from flywheel.scene.linkage import FIXED, PIN, Joint, Linkage

__all__ = [
    "LagrangeEquations", "Law", "Positions", "Run", "Spring", "Strut", "accelerations", "driving_actions", "energy",
    "equations", "mass_matrix", "positions", "reactions", "simulate",
]  # fmt: skip

Array = NDArray[np.float64]
Gravity = tuple[float, float] | None

# -- forces -------------------------------------------------------------------------------------------------------------

Law = float | Callable[[float, Array, Array], float]
"""A constant, or a function of time (s), all drivers' coordinates (g,) and their rates (g,)."""


class Spring(NamedTuple):
    """A spring, and a damper beside it, in a joint: effort -stiffness (x - rest) - damping x' along its coordinate x.

    N m/rad, rad and N m s/rad in a pin; N/m, m and N s/m in a slide or a pin in a slot.
    """

    joint: str
    stiffness: float
    rest: float = 0.0
    damping: float = 0.0


class Strut(NamedTuple):
    """A spring, and a damper beside it, between points of two bodies: pulls with stiffness (d - length) + damping d'.

    first, second: a body and its point's name, or a place in the body's own frame (m); d is their distance.
    stiffness: N/m; length: m, of the strut without load; damping: N s/m.
    """

    first: tuple[str, str | tuple[float, float]]
    second: tuple[str, str | tuple[float, float]]
    stiffness: float
    length: float = 0.0
    damping: float = 0.0


class Actions(NamedTuple):
    """All actions on a linkage: gravity (m/s²), loads, springs and struts, driving actions in the drivers' order."""

    gravity: tuple[float, float]
    loads: tuple[Load, ...]
    springs: tuple[Spring | Strut, ...]
    drives: tuple[Law, ...]

    @property
    def idle(self) -> bool:
        """True if there are neither loads nor springs."""
        return not (self.loads or self.springs)


def _actions(
    linkage: Linkage,
    gravity: Gravity,
    loads: Iterable[Load],
    springs: Iterable[Spring | Strut],
    drives: Mapping[str, Law] | None = None,
) -> Actions:
    """All actions, checked."""
    for name, source, kind, what in (
        ("loads", loads, (Force, Torque, Effort), "a list of Force, Torque and Effort"),
        ("springs", springs, (Spring, Strut), "a list of Spring and Strut"),
    ):
        if isinstance(source, (*kind, str, Mapping)) or not isinstance(source, Iterable):
            raise SceneError([Fault(name, brief(source), what)])
    pushes, elastic = tuple(loads), tuple(springs)
    movable = {joint.name: joint for joint in linkage.joints if joint.kind != FIXED}
    for k, load in enumerate(pushes):
        require(f"loads[{k}]", load, (Force, Torque, Effort), "a Force, Torque or Effort")
    faults: list[Fault] = []
    for k, spring in enumerate(elastic):
        path = f"springs[{k}]"
        require(path, spring, (Spring, Strut), "a Spring or a Strut")
        if isinstance(spring, Spring):
            faults += name_faults(f"{path}.joint", spring.joint, movable)
            faults += number_faults(f"{path}.rest", spring.rest)
        else:
            for end in ("first", "second"):
                faults += _end_faults(linkage, f"{path}.{end}", getattr(spring, end))
            faults += number_faults(f"{path}.length", spring.length, NOT_NEGATIVE, "m")
        for key in ("stiffness", "damping"):
            faults += number_faults(f"{path}.{key}", getattr(spring, key), NOT_NEGATIVE)
    names = dict.fromkeys(driver.joint for driver in linkage.drivers)
    require("drives", drives or {}, Mapping, "a table of driving actions by driver")
    for name, law in (drives or {}).items():
        faults += name_faults(f"drives.{name}", name, names)
        faults += [] if callable(law) else number_faults(f"drives.{name}", law)
    refuse(faults)
    pull = (0.0, 0.0) if gravity is None else vector("gravity", gravity, "m/s²")
    return Actions(pull, pushes, elastic, tuple((drives or {}).get(name, 0.0) for name in names))


def _end_faults(linkage: Linkage, path: str, end: Any) -> list[Fault]:
    """Faults of an end of a strut: a body, and a point of it."""
    if not isinstance(end, tuple) or len(end) != 2:
        return [Fault(path, brief(end), "a body and its point")]
    body, at = end
    if faults := name_faults(f"{path}[0]", body, dict.fromkeys(linkage.names)):
        return faults
    if isinstance(at, str):
        return name_faults(f"{path}[1]", at, {point.name: None for point in linkage.link(body).points})
    if not isinstance(at, tuple) or len(at) != 2:
        return [Fault(f"{path}[1]", brief(at), "a point's name or a place")]
    return [fault for k, part in enumerate(at) for fault in number_faults(f"{path}[1][{k}]", part, unit="m")]


def _number(law: Any, t: float, q: Array, qdot: Array, path: str) -> float:
    """A law's value, which must be a finite number."""
    value = law(t, q, qdot) if callable(law) else law
    number = array(path, value)
    if number.ndim:
        raise SceneError([Fault(path, f"an array of shape {number.shape}", "a finite number")])
    return float(number)


def _loads_at(actions: Actions, t: float, q: Array, qdot: Array) -> list[Load]:
    """The loads with numbers in place of functions."""
    all_loads: list[Load] = []
    for k, load in enumerate(actions.loads):
        if isinstance(load, Force):
            x, y = (_number(part, t, q, qdot, f"loads[{k}].{axis}") for axis, part in (("x", load.x), ("y", load.y)))
            all_loads.append(load._replace(x=x, y=y))
        else:
            all_loads.append(load._replace(value=_number(load.value, t, q, qdot, f"loads[{k}].value")))
    return all_loads


def _elastic(spring: Spring | Strut, poses: Poses) -> tuple[list[Load], list[Load], Array]:
    """A spring's loads, its damper's, and its energy (J, (n,)): at poses whose rate is velocity."""
    linkage = poses.linkage
    if isinstance(spring, Spring):
        joint = linkage.joint(spring.joint)
        stretch, speed = _coordinate(poses, joint) - spring.rest, joint_rate(poses, joint)

        def loads(effort: Array) -> list[Load]:
            return [Effort(joint.name, -effort)]
    else:
        links = [(linkage.link(body), at) for body, at in (spring.first, spring.second)]
        ends = [(link.name, link.point(at)[1:] if isinstance(at, str) else at) for link, at in links]
        first, second = (poses.point(*end) for end in ends)
        gap = second.value - first.value
        distance = np.hypot(*gap)
        along = np.divide(gap, distance, out=np.zeros_like(gap), where=distance > 0.0)
        stretch, speed = distance - spring.length, (along * (second.rate - first.rate)).sum(axis=0)

        def loads(effort: Array) -> list[Load]:
            return [Force(*end, *(sign * effort * along)) for sign, end in zip((1.0, -1.0), ends, strict=True)]

    return loads(spring.stiffness * stretch), loads(spring.damping * speed), 0.5 * spring.stiffness * stretch**2


def _coordinate(poses: Poses, joint: Joint) -> Array:
    """A joint's coordinate, (n,): a pin's angle of second less first (rad), a displacement along the guide (m)."""
    if joint.kind == PIN:
        return np.asarray(poses.angle(joint.second).value - poses.angle(joint.first).value)
    gap = poses.point(joint.second, joint.second_at).value - poses.point(joint.first, joint.first_at).value
    return np.asarray((gap * guide(poses, joint)).sum(axis=0))


# -- Lagrange's equations -------------------------------------------------------------------------------------------------

_SINGULAR = 1e13  # greatest element of the inverse of the inertia matrix, scaled to ones on its diagonal


class EquationTerms(NamedTuple):
    """Lagrange's equations at one position and speed: I* (g, g), the terms Gamma_ijk qdot_j qdot_k `rest` (g,), forces (g,).

    stored: generalised forces of weights and springs, with potential energy (J); other: those of loads and dampers.
    """

    mass: Array
    rest: Array
    stored: Array
    other: Array
    potential: float


def instant(start: Assembly, position: LinkageStation, t: float, qdot: Array, actions: Actions) -> EquationTerms:
    """Lagrange's equations where the drivers move at qdot (rad/s, m/s)."""
    linkage, count = start.linkage, start.freedoms
    state = fields(start, position, np.vstack((np.eye(count), qdot)))
    v, spins = state.velocities[:count], state.spins[:count]
    inertia = inner_products(start, v, spins, v, spins)
    rest = inner_products(start, v, spins, state.accelerations[count:], state.turnings[count:])[:, 0]
    weights = start.mass * complex(*actions.gravity)
    stored = (v.conj() * weights).real.sum(axis=1)
    potential = -float(((state.origins + state.arms).conj() * weights).real.sum())
    other = np.zeros(count)
    if not actions.idle:
        moving = state.velocities[-1] - 1j * state.spins[-1] * state.arms
        value, rate = pose_array(state.origins, state.angles), pose_array(moving, state.spins[-1])
        poses = Poses(linkage, np.array([t]), value[..., None], rate[..., None], np.zeros((*value.shape, 1)))

        def powers(loads: list[Load]) -> Array:
            wrench = applied(poses, loads)[..., 0]
            force = wrench[:, 0] + 1j * wrench[:, 1]
            return np.asarray((v.conj() * force).real.sum(axis=1) + spins @ wrench[:, 2])

        q = start.drivers(position.local.z) * start.scales
        other = powers(_loads_at(actions, t, q, qdot))
        for spring in actions.springs:
            elastic, damping, energy = _elastic(spring, poses)
            stored, other, potential = stored + powers(elastic), other + powers(damping), potential + float(energy[0])
    return EquationTerms(inertia, rest, stored, other, potential)


def solution(linkage: Linkage, matrix: Array, right: Array, scales: Array) -> Array:
    """The accelerations of I* qddot = right, (g,); SceneError where the inertia matrix is singular."""
    diagonal = np.diag(matrix)
    if (diagonal > 0.0).all():
        size = 1.0 / np.sqrt(diagonal)
        scaled = size[:, None] * matrix * size
        try:
            inverse = np.linalg.inv(scaled)
            if np.abs(inverse).max() < _SINGULAR:
                return np.asarray(size * (inverse @ (size * right)))
        except np.linalg.LinAlgError:
            pass
        moved = np.linalg.eigh(scaled)[1][:, 0] * size / scales
    else:
        moved = (diagonal <= 0.0).astype(float)
    names = [name for (name, _), part in zip(linkage.drivers, moved, strict=True) if abs(part) > 1e-6 * np.abs(moved).max()]
    defect = f"a singular inertia matrix: a motion of {' and '.join(names)} moves no mass"
    raise SceneError([Fault(f"{linkage.path}.bodies", defect, "an inertia in every motion", "give a body mass or inertia")])


class LagrangeEquations(NamedTuple):
    """sum_j mass_ij qddot_j + rest_i = forces_i + (driving action)_i, at one position or n of them (a last axis then).

    mass: the reduced inertia matrix I*_ij, (g, g): kg m² between two pins, kg m between pin and slide, kg between slides.
    slope: its derivatives dI*_ij/dq_k, (g, g, g). christoffel: Gamma_ijk, (g, g, g). rest: Gamma_ijk qdot_j qdot_k, (g,).
    forces: generalised forces Q_i of weights, loads, springs and dampers, (g,): N m of a pin, N of a slide.
    kinetic, potential: energies (J), the potential one of weights and springs; 0 with the centres at the frame's origin.
    """

    mass: Array
    slope: Array
    christoffel: Array
    rest: Array
    forces: Array
    kinetic: Array
    potential: Array


def equations(
    linkage: Linkage,
    q: ArrayLike,
    qdot: ArrayLike = 0.0,
    *,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    springs: Iterable[Spring | Strut] = (),
    t: float = 0.0,
) -> LagrangeEquations:
    """Lagrange's equations of any plane linkage, in numbers.

    Args:
        linkage: bodies, joints, couplings and drivers.
        q: the drivers' coordinates, rad or m, (g,) or (g, n).
        qdot: their rates, rad/s or m/s, of the same shape.
        gravity: components along x and y, m/s²; none if None.
        loads: forces and torques on bodies, efforts along joints; numbers, or functions of (t, q, qdot).
        springs: springs in joints, and struts between points.
        t: time (s) at which loads that are functions are taken.

    Raises:
        SceneError: as `positions`; for loads that do not fit the linkage.

    >>> from flywheel.scene.linkage import Driver, Point, Link
    >>> o = Point("o")
    >>> bodies = Link("cart", (o,), 2.0), Link("rod", (o,), 1.0, 0.0, (0.5, 0.0), 0.0)
    >>> joints = Joint("rail", "slide", "frame", "cart", o, o), Joint("pin", PIN, "cart", "rod", o, o)
    >>> pendulum = Linkage(Link("frame", (o,)), bodies, joints, "rail", further=(Driver("pin"),))
    >>> terms = equations(pendulum, [0.0, 0.0], [0.0, 2.0], gravity=(0.0, -10.0))
    >>> terms.mass.round(12).tolist(), terms.rest.round(12).tolist(), terms.forces.round(12).tolist()
    ([[3.0, 0.0], [0.0, 0.25]], [-2.0, 0.0], [0.0, -5.0])

    """
    refuse(number_faults("t", t, unit="s"))
    start, coordinates, rows = driver_rows(linkage, q, qdot=qdot)
    actions = _actions(linkage, gravity, loads, springs)
    count = start.freedoms
    directions, polarised = pair_directions(count)
    parts = []
    for position, rates in zip(stations(start, coordinates), rows["qdot"].T, strict=True):
        columns, now = fields(start, position, directions), instant(start, position, t, rates, actions)
        bends, turnings = polarised(columns.accelerations), polarised(columns.turnings)
        v, spins = columns.velocities[:count], columns.spins[:count]
        christoffel = np.stack([inner_products(start, v, spins, a, b) for a, b in zip(bends, turnings, strict=True)], axis=1)
        slope = christoffel + christoffel.transpose(1, 0, 2)
        kinetic = 0.5 * rates @ now.mass @ rates
        parts.append((now.mass, slope, christoffel, now.rest, now.stored + now.other, kinetic, now.potential))
    return LagrangeEquations(*(shaped_as(np.stack(part, axis=-1), q) for part in zip(*parts, strict=True)))


def mass_matrix(linkage: Linkage, q: ArrayLike) -> Array:
    """The reduced inertia matrix I*_ij = sum m g_i · g_j + J gamma_i gamma_j, (g, g), or (g, g, n).

    Args:
        linkage: bodies, joints, couplings and drivers.
        q: the drivers' coordinates, rad or m, (g,) or (g, n).

    Raises:
        SceneError: as `positions`.

    """
    return equations(linkage, q).mass


def energy(
    linkage: Linkage, q: ArrayLike, qdot: ArrayLike, *, gravity: Gravity = None, springs: Iterable[Spring | Strut] = ()
) -> tuple[Array, Array]:
    """Kinetic energy ½ qdot^T I* qdot and potential energy of weights and springs, J.

    Args:
        linkage: bodies, joints, couplings and drivers.
        q: the drivers' coordinates, rad or m, (g,) or (g, n).
        qdot: their rates, rad/s or m/s.
        gravity: as in `equations`.
        springs: as in `equations`.

    Raises:
        SceneError: as `positions`.

    """
    terms = equations(linkage, q, qdot, gravity=gravity, springs=springs)
    return terms.kinetic, terms.potential


def accelerations(
    linkage: Linkage,
    q: ArrayLike,
    qdot: ArrayLike = 0.0,
    drives: Mapping[str, Law] | None = None,
    *,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    springs: Iterable[Spring | Strut] = (),
    t: float = 0.0,
) -> Array:
    """Direct dynamics: qddot (rad/s² or m/s²), (g,) or (g, n), under loads and driving actions.

    Args:
        linkage: bodies, joints, couplings and drivers; friction in joints is left out.
        q: as in `equations`.
        qdot: as in `equations`.
        drives: driving actions by driver, N m or N: numbers, or functions of (t, q, qdot); 0 if none is given.
        gravity: as in `equations`.
        loads: as in `equations`.
        springs: as in `equations`.
        t: as in `equations`.

    Raises:
        SceneError: as `equations`; for a motion of the drivers that moves no mass.

    """
    start, coordinates, rows = driver_rows(linkage, q, qdot=qdot)
    actions = _actions(linkage, gravity, loads, springs, drives)
    values = [
        acceleration(start, position, t, rates, actions)[0]
        for position, rates in zip(stations(start, coordinates), rows["qdot"].T, strict=True)
    ]
    return shaped_as(np.stack(values, axis=-1), q)


def acceleration(
    start: Assembly, position: LinkageStation, t: float, qdot: Array, actions: Actions
) -> tuple[Array, EquationTerms, Array]:
    """qddot, the equations it solves, and the driving actions (g,), at one position and speed."""
    now = instant(start, position, t, qdot, actions)
    q = start.drivers(position.local.z) * start.scales
    names = [driver.joint for driver in start.linkage.drivers]
    drives = np.array([_number(law, t, q, qdot, f"drives.{n}") for n, law in zip(names, actions.drives, strict=True)])
    return solution(start.linkage, now.mass, now.stored + now.other + drives - now.rest, start.scales), now, drives


def driving_actions(
    linkage: Linkage,
    q: ArrayLike,
    qdot: ArrayLike = 0.0,
    qddot: ArrayLike = 0.0,
    *,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    springs: Iterable[Spring | Strut] = (),
    t: float = 0.0,
) -> dict[str, Array]:
    """Inverse dynamics by virtual powers: the action of every driver for a given motion, without any reactions.

    D_i = sum_j I*_ij qddot_j + Gamma_ijk qdot_j qdot_k - Q_i: one equation from each of g velocity fields.

    Args:
        linkage: bodies, joints, couplings and drivers; friction in joints is left out (`reactions` includes it).
        q: as in `equations`.
        qdot: as in `equations`.
        qddot: accelerations of the drivers, rad/s² or m/s², of the same shape.
        gravity: as in `equations`.
        loads: as in `equations`.
        springs: as in `equations`.
        t: as in `equations`.

    Returns:
        N m of a pin, N of a slide, by driver, from its first body on its second along the coordinate.

    Raises:
        SceneError: as `equations`.

    """
    terms = equations(linkage, q, qdot, gravity=gravity, loads=loads, springs=springs, t=t)
    _, _, rows = driver_rows(linkage, q, qddot=qddot)
    turning = shaped_as(rows["qddot"], q)
    actions = np.einsum("ij...,j...->i...", terms.mass, turning) + terms.rest - terms.forces
    return {driver.joint: np.asarray(action) for driver, action in zip(linkage.drivers, actions, strict=True)}


def reactions(
    linkage: Linkage,
    q: ArrayLike,
    qdot: ArrayLike = 0.0,
    qddot: ArrayLike = 0.0,
    *,
    t: ArrayLike | None = None,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    springs: Iterable[Spring | Strut] = (),
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """Reactions of every joint and the actions of all drivers for a given motion, by Newton's and Euler's equations.

    Args:
        linkage: bodies, joints, couplings and drivers.
        q: as in `equations`.
        qdot: as in `equations`.
        qddot: accelerations of the drivers, rad/s² or m/s², of the same shape.
        t: time (s) of each position, (n,); their number from 0 if None.
        gravity: as in `equations`.
        loads: as in `equations`.
        springs: as in `equations`.
        inertia: False leaves the inertia forces out.
        friction: False leaves Coulomb's friction in the joints out.

    Raises:
        SceneError: as `equations`, and as `flywheel.kinetostatics.reactions`.

    """
    _, coordinates, rows = driver_rows(linkage, q, qdot=qdot)
    actions = _actions(linkage, gravity, loads, springs)
    poses = positions(linkage, q).motion(qdot, qddot, t)
    columns = list(zip(poses.q.tolist(), coordinates.T, rows["qdot"].T, strict=True))
    each = [_loads_at(actions, *column) for column in columns]
    pushes: list[Load] = []
    for same in zip(*each, strict=True):
        if isinstance(same[0], Force):
            pushes.append(same[0]._replace(x=np.array([load.x for load in same]), y=np.array([load.y for load in same])))
        else:
            pushes.append(same[0]._replace(value=np.array([load.value for load in same])))
    for spring in actions.springs:
        elastic, damping, _ = _elastic(spring, poses)
        pushes += [*elastic, *damping]
    drivers = [driver.joint for driver in linkage.drivers]
    forces = reactions_at(poses, 1.0, drivers=drivers, gravity=gravity, loads=pushes, inertia=inertia, friction=friction)
    return forces._replace(coordinate=("position", "") if t is None else ("time", "s"))


# -- simulation -----------------------------------------------------------------------------------------------------------

_FINEST = 1e-13  # tolerance of a step below which the integrator's own rounding wins
_FIRST = 0.05  # of rtol: the tolerance of a step in the first run
_RATIO = 16.0  # of the tolerances of the two runs that are compared
_SHORTER = 0.7  # of the longest step of the first run: where no tolerance made it short, nor would it the second's
_BETTER = 4.0  # the second run is better than the first by this, and surely by more, until rounding wins
_STEP_ROUNDING = 4e-16  # of every step


class Run(NamedTuple):
    """A simulated motion at the integrator's own times t (s): q (rad or m) and qdot, (g, n).

    kinetic, potential (of weights and springs), work (of all else since the start): J, (n,). energy_residual: the greatest
    |energy gained - work| over the greatest kinetic energy or swing of potential energy. error: estimated, of q and qdot
    anywhere in the run, over the greatest travel and speed. closure: greatest residual gap of a loop (m or rad).
    stopped: None for the whole motion. Otherwise the run is partial: it ends at t[-1], before `until`, for the reason in
    this fault, such as a lock; the first of `messages` says so. Close to a lock the influence coefficients grow without
    bound, and energy_residual with them. `at(times)` gives (q, qdot), (g, ...), at any times within, by dense output.
    """

    t: Array
    q: Array
    qdot: Array
    kinetic: Array
    potential: Array
    work: Array
    energy_residual: float
    error: float
    closure: float
    evaluations: int
    messages: tuple[str, ...]
    stopped: Fault | None
    at: Callable[[ArrayLike], tuple[Array, Array]]


def simulate(
    linkage: Linkage,
    q: ArrayLike,
    qdot: ArrayLike,
    until: float,
    drives: Mapping[str, Law] | None = None,
    *,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    springs: Iterable[Spring | Strut] = (),
    rtol: float = 1e-9,
) -> Run:
    """Motion from a given state, by an explicit Runge-Kutta method of order 8 on (q, qdot), loops closed at every instant.

    Where the linkage locks or branches on the way, such as a five-bar with its rods in line, the motion up to there is
    returned: `stopped` holds the reason and the positions of all drivers.

    Args:
        linkage: bodies, joints, couplings and drivers; joints without friction.
        q: the drivers' coordinates at t = 0, rad or m, (g,).
        qdot: their rates, rad/s or m/s, (g,).
        until: time to simulate, s.
        drives: driving actions by driver, N m or N: numbers, or smooth functions of (t, q, qdot); 0 if none is given.
        gravity: as in `equations`.
        loads: as in `equations`; functions should be smooth: end the run where they jump.
        springs: as in `equations`.
        rtol: error allowed of q and qdot, relative like `Run.error`, the difference of two runs; `messages` report a larger
            one.

    Raises:
        SceneError: as `equations`; for friction; where the motion cannot begin.

    >>> from flywheel.scene.linkage import Driver, Link, Point
    >>> o, tip = Point("o"), Point("tip", 0.5)
    >>> bars = [Link(name, (o, tip), mass=1.0, inertia=0.02, com=(0.25, 0.0)) for name in ("upper", "lower")]
    >>> pins = Joint("shoulder", PIN, "frame", "upper", o, o), Joint("elbow", PIN, "upper", "lower", tip, o)
    >>> arm = Linkage(Link("frame", (o,)), tuple(bars), pins, "shoulder", further=(Driver("elbow"),))
    >>> run = simulate(arm, [0.0, 0.5], [0.0, 0.0], 0.5, gravity=(0.0, -9.81))
    >>> run.error < 1e-9, run.energy_residual < 1e-9, run.messages
    (True, True, ())

    """
    start, coordinates, rows = driver_rows(linkage, q, qdot=qdot)
    refuse([*number_faults("until", until, POSITIVE, "s"), *number_faults("rtol", rtol, POSITIVE)])
    actions = _actions(linkage, gravity, loads, springs, drives)
    if coordinates.shape[1] != 1:
        raise SceneError([Fault("q", f"{coordinates.shape[1]} positions", "the one at t = 0")])
    rubbing = {joint.name: joint.friction for joint in linkage.joints if joint.friction}
    rubbing |= {coupling.name: coupling.friction for coupling in linkage.couplings if coupling.friction}
    ideal = "none: this motion is that of ideal joints", "set it to 0"
    refuse([Fault(f"{linkage.path}.{name}.friction", f"{size:.9g}", *ideal) for name, size in rubbing.items()])
    z = end_of_way(start, start.z, coordinates[:, 0] / start.scales)
    state = np.concatenate((coordinates[:, 0], rows["qdot"][:, 0], [0.0]))
    tolerance = max(_FIRST * rtol, _RATIO * _FINEST)
    coarse = _steps(start, z, state, until, tolerance, actions)
    while True:
        tolerance = max(tolerance / _RATIO, _FINEST)
        fine = _steps(start, z, state, until, tolerance, actions, _SHORTER * float(np.diff(coarse.s).max()))
        compared = fine.until(float(coarse.s[-1]))  # before a lock one of them may end before the other
        error = _difference(coarse, compared, start) / (_BETTER if tolerance > _FINEST else 1.0)
        error += _STEP_ROUNDING * len(compared.s)
        if error <= rtol or tolerance <= _FINEST:
            break
        coarse = fine
    messages, stopped = [], fine.fault or coarse.fault
    if stopped is not None:
        ends = f"partial motion: it ends at {compared.s[-1]:.6g} s of {until:.6g} s"
        messages.append(f"{ends}: {stopped.defect}; {stopped.advice}")
    if error > rtol:
        messages.append(f"rtol {rtol:.1g} not reached: the motion is good to {error:.2g} (estimated, relative)")
    return _run(start, z, actions, compared, error, tuple(messages), stopped)


def _steps(
    start: Assembly, z: Array, state: Array, until: float, tolerance: float, actions: Actions, longest: float = np.inf
) -> Any:
    """The run at one tolerance: q, qdot and the work of all but weights and springs as state."""
    follower, count = Follower(start, z), start.freedoms

    def rates(t: float, y: Array) -> Array:
        speeds = y[count : 2 * count]
        try:
            position = follower.at(y[:count] / start.scales)
        except SceneError as error:
            raise UnreachableError(error.faults[0]) from None
        turning, now, drives = acceleration(start, position, t, speeds, actions)
        return np.concatenate((speeds, turning, [(now.other + drives) @ speeds]))

    atol = tolerance * np.concatenate((start.scales, start.scales, [np.inf]))
    try:
        return integrate(rates, state, until, tolerance, atol, dense=True, longest=longest, partial=True)
    except UnreachableError as error:
        raise SceneError([error.fault]) from None


def _difference(coarse: Any, fine: Any, start: Assembly) -> float:
    """Difference of two runs at and between the steps of the second, relative to the greatest travel and speed."""
    times = np.sort(np.concatenate((fine.s, 0.5 * (fine.s[1:] + fine.s[:-1]))))
    one, other = (np.array([steps.at(t) for t in times])[:, :-1] / np.tile(start.scales, 2) for steps in (coarse, fine))
    count = start.freedoms
    difference = 0.0
    for part, origin in ((slice(count), other[0, :count]), (slice(count, None), 0.0)):
        gap, size = np.abs(one[:, part] - other[:, part]).max(), np.abs(other[:, part] - origin).max()
        difference = max(difference, float(gap) / max(float(size), 1e-300))
    return difference


def _run(
    start: Assembly,
    z: Array,
    actions: Actions,
    steps: Any,
    error: float,
    messages: tuple[str, ...],
    stopped: Fault | None,
) -> Run:
    """The record of a run, with its energies."""
    count, follower = start.freedoms, Follower(start, z)
    kinetic, potential, closure = [], [], 0.0
    for t, y in zip(steps.s, steps.states, strict=True):
        position = follower.at(y[:count] / start.scales)
        speeds = y[count : 2 * count]
        now = instant(start, position, float(t), speeds, actions)
        kinetic.append(0.5 * float(speeds @ now.mass @ speeds))
        potential.append(now.potential)
        closure = max(closure, float(np.abs(position.local.gaps).max(initial=0.0)) * start.loops.unit)
    energies, work = np.array([kinetic, potential]), steps.states[:, -1]
    total = energies.sum(axis=0)
    scale = max(float(energies[0].max()), float(np.ptp(energies[1])), 1e-300)
    residual = float(np.abs(total - total[0] - work).max()) / scale

    def at(times: ArrayLike) -> tuple[Array, Array]:
        instants = array("times", times)
        outside = instants[(instants < 0.0) | (instants > steps.s[-1])]
        if outside.size:
            raise SceneError([Fault("times", f"{outside.flat[0]:g} s", f"times from 0 to {steps.s[-1]:g} s")])
        table = np.array([steps.at(float(t)) for t in instants.flat]).T.reshape(-1, *instants.shape)
        return table[:count], table[count : 2 * count]

    states = steps.states.T
    return Run(
        steps.s,
        states[:count],
        states[count : 2 * count],
        energies[0],
        energies[1],
        work,
        energy_residual=residual,
        error=error,
        closure=closure,
        evaluations=steps.evaluations,
        messages=messages,
        stopped=stopped,
        at=at,
    )
