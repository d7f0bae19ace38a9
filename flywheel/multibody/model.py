"""A linkage in absolute coordinates: x_G, y_G, theta of every moving body, what ties them and what acts on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault, SceneError
from flywheel.linkage.description import Coupling, Linkage
from flywheel.linkage.poses import Poses
from flywheel.multibody.relations import COMPONENTS, Pair, Place, Row, closures, coordinate, drive, pair, placed, turned

Array = NDArray[np.float64]
Law = float | Callable[[float, float, float], float]
"""A constant, or a function of time (s), the driver's coordinate (rad or m) and its rate."""

_RANK = 1e-9  # of the largest: a singular value below it is nought


class Wrench(NamedTuple):
    """What acts on a body from outside: a force along the frame's x and y (N) at a point of it, a torque (N m).

    `at` names a point of the body, or is a place in its own frame (m); the centre of mass if None.
    """

    body: str
    force: tuple[Law, Law] = (0.0, 0.0)
    torque: Law = 0.0
    at: str | tuple[float, float] | None = None


class Actions(NamedTuple):
    """All that drives and loads a linkage: gravity (m/s²), the driver's torque (N m) or force (N), wrenches on bodies."""

    gravity: tuple[float, float] = (0.0, 0.0)
    drive: Law = 0.0
    wrenches: tuple[Wrench, ...] = ()


class State(NamedTuple):
    """A linkage at coordinates x and velocities v, shape (3 moving bodies,).

    value: what the closure equations Phi(x) lack (m or rad), shape (equations,); jacobian Phi_x; gamma = -(Phi_x v)_x v, so
    that Phi_x a = gamma. `q`, `qdot`, `along` and `bend` are the driver's coordinate, rate, gradient and bend.
    `places` holds every body, the frame first.
    """

    value: Array
    jacobian: Array
    gamma: Array
    q: float
    qdot: float
    along: Array
    bend: float
    places: tuple[Place, ...]


class Spread(NamedTuple):
    """A relation over all bodies' coordinates; plain lists, which are quicker than small arrays."""

    value: float
    gradient: list[float]
    bend: float


@dataclass(frozen=True, eq=False)
class Model:
    """A linkage prepared for the routes.

    masses: m, m, J of every moving body, shape (3 bodies,); length: its largest one (m), the scale of displacements;
    redundant: some closure equations follow from others, so that not all reactions are determined.
    """

    linkage: Linkage
    actions: Actions
    pairs: tuple[Pair, ...]
    masses: Array
    length: float
    redundant: bool = False

    @cached_property
    def scale(self) -> Array:
        """Size of each coordinate: the length of a displacement, 1 rad of an angle."""
        return np.tile((self.length, self.length, 1.0), self.masses.size // 3)

    @cached_property
    def weights(self) -> Array:
        """Weight of every moving body on its coordinates (N)."""
        return np.asarray(self.masses * np.tile((*self.actions.gravity, 0.0), self.masses.size // 3))

    def pair(self, joint: str) -> Pair:
        """The joint of that name."""
        return next(pair for pair in self.pairs if pair.name == joint)

    def state(self, x: Array, v: Array) -> State:
        """The closure equations and the driver's coordinate at x with velocities v."""
        places = self._places(x, v)
        rows = [(joint, row) for joint in self.pairs for row in closures(joint, *_both(joint, places))]
        spread = [_spread(self.masses.size, row, joint) for joint, row in rows]
        spread += [self._coupled(coupling, places, v) for coupling in self.linkage.couplings]
        driver = self._coordinate(self.linkage.driver, places)
        along = np.array(driver.gradient)
        return State(
            value=np.array([row.value for row in spread]),
            jacobian=np.array([row.gradient for row in spread]).reshape(-1, self.masses.size),
            gamma=np.array([-row.bend for row in spread]),
            q=driver.value,
            qdot=float(along @ v),
            along=along,
            bend=driver.bend,
            places=places,
        )

    def forces(self, t: float, state: State) -> Array:
        """Generalised forces of gravity, drive and wrenches on every coordinate, shape (3 moving bodies,)."""
        motion = t, state.q, state.qdot
        total = self.weights + _law(self.actions.drive, *motion) * state.along
        for wrench in self.actions.wrenches:
            k = self.linkage.names.index(wrench.body)
            fx, fy = (_law(part, *motion) for part in wrench.force)
            rx, ry = self._arm(wrench, state.places[k])
            total[3 * k - 3 : 3 * k] += fx, fy, rx * fy - ry * fx + _law(wrench.torque, *motion)
        return np.asarray(total)

    def _places(self, x: Array, v: Array) -> tuple[Place, ...]:
        rows = zip(x.reshape(-1, 3).tolist(), v.reshape(-1, 3).tolist(), strict=True)
        return (_frame(self.linkage), *(placed(pose, velocity) for pose, velocity in rows))

    def _coordinate(self, joint: str, places: Sequence[Place]) -> Spread:
        found = self.pair(joint)
        return _spread(self.masses.size, coordinate(found, *_both(found, places)), found)

    def _coupled(self, coupling: Coupling, places: Sequence[Place], v: Array) -> Spread:
        """q2 - f(q1): gradient q2_x - f' q1_x, bend that of q2 less f' times that of q1 and f'' (dq1/dt)²."""
        one, two = self._coordinate(coupling.first, places), self._coordinate(coupling.second, places)
        driven = drive(coupling, one.value)
        bend = two.bend - driven.first * one.bend - driven.second * float(np.dot(one.gradient, v)) ** 2
        gradient = [b - driven.first * a for a, b in zip(one.gradient, two.gradient, strict=True)]
        return Spread(two.value - driven.value, gradient, bend)

    def _arm(self, wrench: Wrench, place: Place) -> tuple[float, float]:
        if wrench.at is None:
            return 0.0, 0.0
        link = self.linkage.link(wrench.body)
        x, y = link.point(wrench.at)[-2:] if isinstance(wrench.at, str) else wrench.at
        return turned(place, (x - link.com[0], y - link.com[1]))


def model(linkage: Linkage, actions: Actions) -> Model:
    """A linkage with its actions, prepared.

    Raises:
        SceneError: for friction, which these routes leave out, and for wrenches on bodies that do not move.

    """
    rubbing = [joint.name for joint in linkage.joints if joint.friction > 0.0]
    rubbing += [coupling.name for coupling in linkage.couplings if coupling.friction > 0.0]
    faults = [_friction(linkage, name) for name in rubbing]
    for k, wrench in enumerate(actions.wrenches):
        faults += _misplaced(linkage, f"wrenches[{k}]", wrench)
    if faults:
        raise SceneError(faults)
    masses = np.array([value for link in linkage.links for value in (link.mass, link.mass, link.inertia)], dtype=float)
    pairs = tuple(pair(linkage, joint) for joint in linkage.joints)
    arms = [abs(part) for joint in pairs for part in (*joint.first_arm, *joint.second_arm)]
    return Model(linkage, actions, pairs, masses, max(arms) or 1.0)


def coordinates(poses: Poses) -> Array:
    """Absolute coordinates x_G, y_G, theta of every moving body at the first of the poses, shape (3 bodies,)."""
    names = [link.name for link in poses.linkage.links]
    rows = [(*poses.centre(name).value[:, 0], poses.angle(name).value[0]) for name in names]
    return np.array(rows, dtype=float).ravel()


def components(linkage: Linkage) -> list[tuple[str, str]]:
    """Joint and component of every reaction, in the order of the closure equations; couplings have one `effort` each.

    A coupling's effort is that on its second coordinate: a moment (N m) at a pin, a force (N) along a slide. It stands for
    the contact force by its work alone: the pins' reactions are those of the contact force only with it.
    """
    found = [(joint.name, part) for joint in linkage.joints for part in COMPONENTS[joint.kind]]
    return found + [(coupling.name, "effort") for coupling in linkage.couplings]


def undetermined(jacobian: Array) -> NDArray[np.bool_]:
    """Which reactions a redundant linkage leaves open: those with a part in the null space of Phi_x^T."""
    left, sizes, _ = np.linalg.svd(jacobian)
    rank = int((sizes > _RANK * sizes.max()).sum())
    return np.asarray(np.abs(left[:, rank:]).max(axis=1, initial=0.0) > _RANK)


def _frame(linkage: Linkage) -> Place:
    return placed((*linkage.ground.com, 0.0))


def _both(joint: Pair, places: Sequence[Place]) -> tuple[Place, Place]:
    return places[joint.first], places[joint.second]


def _spread(size: int, row: Row, joint: Pair) -> Spread:
    """A row over all coordinates, the frame's left out."""
    gradient = [0.0] * (size + 3)
    gradient[3 * joint.first : 3 * joint.first + 3] = row.first
    gradient[3 * joint.second : 3 * joint.second + 3] = row.second
    return Spread(row.value, gradient[3:], row.bend)


def _law(law: Law, t: float, q: float, qdot: float) -> float:
    return law(t, q, qdot) if callable(law) else law


def _friction(linkage: Linkage, name: str) -> Fault:
    return Fault(
        f"{linkage.path}.{name}.friction", "friction", "none: these routes are those of ideal joints", "set it to 0"
    )


def _misplaced(linkage: Linkage, path: str, wrench: Wrench) -> list[Fault]:
    """A wrench on a body that does not move, or at a point that it does not have."""
    moving = [link.name for link in linkage.links]
    if wrench.body not in moving:
        return [Fault(f"{path}.body", repr(wrench.body), f"a moving body: {', '.join(moving)}")]
    points = [point.name for point in linkage.link(wrench.body).points]
    if isinstance(wrench.at, str) and wrench.at not in points:
        return [Fault(f"{path}.at", repr(wrench.at), f"a point of {wrench.body}: {', '.join(points)}")]
    return []
