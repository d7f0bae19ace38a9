"""Kinetostatics: the driving action and the reaction in every joint of a plane linkage, for a motion that is given.

Two routes: Newton's and Euler's equations of all bodies at once (`reactions`), and virtual power with one constraint
released at a time (`virtual_power`). With the inertia left out the analysis is quasi-static.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.arguments import array, known, require, shown
from flywheel.faults import Fault, SceneError
from flywheel.linkage.chain import Motion, chain_poses
from flywheel.linkage.checks import check
from flywheel.linkage.components import unknowns
from flywheel.linkage.description import Linkage
from flywheel.linkage.poses import Poses
from flywheel.linkage.reactions import Extreme, Friction, Reactions, collected
from flywheel.linkage.released import virtual_power
from flywheel.linkage.statics import solve as balance
from flywheel.linkage.wrenches import Effort, Force, Load, Torque, applied, centres, inertial, values, weights

if TYPE_CHECKING:
    from flywheel.linkage.solution import Solution

__all__ = [
    "Effort",
    "Extreme",
    "Force",
    "Friction",
    "Load",
    "Motion",
    "Reactions",
    "Torque",
    "chain_reactions",
    "driving_actions",
    "reactions",
    "reactions_at",
    "virtual_power",
]

Array = NDArray[np.float64]
Gravity = tuple[float, float] | None


def reactions(
    source: Linkage | Solution,
    q: ArrayLike,
    speed: ArrayLike,
    acceleration: ArrayLike = 0.0,
    *,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """Driving action and all reactions of a linkage where its driver stands at q and moves at a given speed.

    For every body sum F = m a_G and sum M_G = J alpha, with a = g qddot + g' qdot²; all reactions and the driving action are
    the unknowns of one linear system a position. Friction and inclined teeth, which follow the reactions' own sizes, are
    iterated.

    Args:
        source: a linkage, or one that was followed (`flywheel.linkage.solution.solve`).
        q: driver's coordinates, rad (m where it slides), shape (n,).
        speed: its rate, rad/s or m/s: a number or shape (n,). Friction opposes the motion that its sign makes; none at rest.
        acceleration: rad/s² or m/s²: a number or shape (n,).
        gravity: (gx, gy) in m/s²; no weights if None.
        loads: forces and torques on bodies, efforts along joints; numbers or arrays of shape (n,).
        inertia: False leaves the inertia forces out (quasi-static analysis).
        friction: False leaves Coulomb's friction out.

    Raises:
        SceneError: for what a linkage is refused for, for loads that do not fit it, for friction that follows a reaction
            which redundant constraints leave open, for a position where the driver has no hold on the others.

    Valid for rigid bodies and joints without play. A joint's reaction is what its first body does to its second.

    >>> from flywheel.linkage.description import Joint, Link, Linkage, Point
    >>> o, tip, end = Point("o"), Point("tip", 3.0), Point("end", 5.0)
    >>> links = Link("crank", (o, tip)), Link("rod", (o, end), guess=-0.6), Link("slider", (o,))
    >>> joints = (Joint("pivot", "pin", "frame", "crank", o, o), Joint("crank_pin", "pin", "crank", "rod", tip, o),
    ...           Joint("slider_pin", "pin", "rod", "slider", end, o), Joint("guide", "slide", "frame", "slider", o, o))
    >>> machine = Linkage(Link("frame", (o,)), links, joints, "pivot", start=1.5707963267948966)
    >>> found = reactions(machine, [1.5707963267948966], 10.0, loads=[Force("slider", "o", x=-100.0)])
    >>> found.action.round(9).tolist(), found.components["guide"]["normal"].round(9).tolist()
    ([-300.0], [75.0])

    """
    from flywheel.linkage.solution import Solution, solve_over

    require("source", source, (Linkage, Solution), "a Linkage, or a Solution")
    wanted = _row("q", q)
    solution = solve_over(source, wanted) if isinstance(source, Linkage) else source
    poses = solution.poses(wanted)
    return reactions_at(poses, speed, acceleration, gravity=gravity, loads=loads, inertia=inertia, friction=friction)


def reactions_at(
    poses: Poses,
    speed: ArrayLike,
    acceleration: ArrayLike = 0.0,
    *,
    drivers: Iterable[str] = (),
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """As `reactions`, for poses that are known.

    drivers: names of the driven joints, where they are not the linkage's one driver.
    """
    require("poses", poses, Poses, "Poses")
    motion = values(speed, poses.q, "speed"), values(acceleration, poses.q, "acceleration")
    outer = applied(poses, loads)
    if gravity is not None:
        outer = outer + weights(poses, gravity)
    if inertia:
        outer = outer + inertial(poses, *motion)
    driven = tuple(drivers) or (poses.linkage.driver,)
    if isinstance(drivers, str):
        raise SceneError([Fault("drivers", shown(drivers), "a list of joints' names")])
    for k, name in enumerate(driven):
        known(f"drivers[{k}]", name, {joint.name: joint for joint in poses.linkage.joints})
    parts = unknowns(poses, driven, np.sign(motion[0]), friction)
    return collected(poses, motion, parts, balance(poses, parts, outer))


def chain_reactions(
    linkage: Linkage,
    motions: Mapping[str, Motion],
    time: ArrayLike = 0.0,
    *,
    gravity: Gravity = None,
    loads: Iterable[Load] = (),
    inertia: bool = True,
    friction: bool = True,
) -> Reactions:
    """As many driving actions as degrees of freedom: an open chain in which every joint is driven, and moves as prescribed.

    Args:
        linkage: bodies and joints without loops; its own `driver` may be any of the joints.
        motions: by joint, its coordinate with speed and acceleration, numbers or shape (n,).
        time: instants (s), shape (n,).
        gravity: as in `reactions`.
        loads: as in `reactions`.
        inertia: as in `reactions`.
        friction: as in `reactions`.

    The driving actions stand in `actions`, by joint. Positions are by time: `poses.rate` holds velocities.

    >>> from flywheel.linkage.description import Joint, Link, Linkage, Point
    >>> o, tip = Point("o"), Point("tip", 0.5)
    >>> bars = [Link(name, (o, tip), mass=1.0, inertia=0.02, com=(0.25, 0.0)) for name in ("upper", "lower")]
    >>> pins = (Joint("shoulder", "pin", "frame", "upper", o, o), Joint("elbow", "pin", "upper", "lower", tip, o))
    >>> arm = Linkage(Link("frame", (o,)), tuple(bars), pins, "shoulder")
    >>> found = chain_reactions(arm, {"shoulder": Motion(0.0), "elbow": Motion(0.0)}, gravity=(0.0, -10.0))
    >>> {name: round(float(action[0]), 12) for name, action in found.actions.items()}
    {'shoulder': 10.0, 'elbow': 2.5}

    """
    check(linkage)
    require("motions", motions, Mapping, "a table of Motion by joint")
    for name, motion in motions.items():
        require(f"motions.{name}", motion, Motion, "a Motion")
    poses = chain_poses(linkage, motions, _row("time", time))
    drivers = [joint.name for joint in linkage.joints if joint.name in motions]
    options = {"inertia": inertia, "friction": friction}
    found = reactions_at(poses, 1.0, drivers=drivers, gravity=gravity, loads=loads, **options)
    return found._replace(coordinate=("time", "s"))


def _row(path: str, given: ArrayLike) -> Array:
    """A number or a row of them, as an array (n,)."""
    found = np.atleast_1d(array(path, given))
    if found.ndim > 1 or not found.size:
        what = f"an array of shape {found.shape}" if found.size else "no position"
        raise SceneError([Fault(path, what, "a number or an array of shape (n,)")])
    return found


def driving_actions(coefficients: Iterable[Poses], others: Array) -> tuple[Array, ...]:
    """Driving actions of g degrees of freedom by virtual power, from the influence coefficients of each.

    Q_i = -(sum of F · dv_G/dqdot_i + M domega/dqdot_i) over all bodies.

    Args:
        coefficients: for every degree of freedom, poses whose `rate` is what all bodies do at unit speed of its
            coordinate with all others held.
        others: wrenches of all loads, weights, inertia and friction forces, shape (bodies, 3, n), as in `Reactions.others`.

    Returns:
        an action for every coordinate, N m or N, shape (n,) each.

    """
    return tuple(np.asarray(-np.einsum("bin,bin->n", centres(poses).rate, others)) for poses in coefficients)
