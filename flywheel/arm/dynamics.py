"""The arm's dynamics in closed form: mass matrix, what is left, torques, accelerations, energy, reactions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.arguments import ANY, NOT_NEGATIVE, POSITIVE, array, number_faults, refuse, require, shown
from flywheel.faults import Fault, SceneError

Array = NDArray[np.float64]


class Bar(NamedTuple):
    """A bar: length between its pins (m), mass (kg), inertia about its centre of mass (kg m²), `com` (m).

    `com` is the distance of the centre of mass from the first pin, along the bar.
    """

    length: float
    mass: float
    inertia: float
    com: float


def slender(length: float, mass: float) -> Bar:
    """A thin uniform bar of a length (m) and a mass (kg): centre in the middle, I = m l²/12.

    Raises SceneError unless both are above 0.

    >>> slender(2.0, 3.0)
    Bar(length=2.0, mass=3.0, inertia=1.0, com=1.0)
    """
    refuse([*number_faults("length", length, POSITIVE, "m"), *number_faults("mass", mass, POSITIVE, "kg")])
    return Bar(length, mass, mass * length**2 / 12, length / 2)


class Constants(NamedTuple):
    """What the equations are made of: A, B, C (kg m²), G1, G2 (N m), and `least` = A C - B² (kg² m⁴)."""

    A: float
    B: float
    C: float
    G1: float
    G2: float
    least: float


class Reactions(NamedTuple):
    """Forces (N), x and y, shape (2, ...): of the frame on bar 1 at the shoulder, of bar 1 on bar 2 at the elbow."""

    shoulder: Array
    elbow: Array


@dataclass(frozen=True)
class TwoLinkArm:
    """Two bars, the second hinged to the end of the first, in gravity g (m/s²) along -y.

    Raises SceneError for sizes that are no bar's, or if a bar can turn without inertia.

    >>> TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2)).constants.B
    0.3
    """

    first: Bar
    second: Bar
    gravity: float = 9.80665

    def __post_init__(self) -> None:
        faults = [fault for name in ("first", "second") for fault in _bar_faults(name, getattr(self, name))]
        faults += number_faults("gravity", self.gravity, unit="m/s²")
        if not faults and not self.constants.least > 0.0:
            found = "bars that can turn without moving any mass"
            faults.append(Fault("arm", found, "inertia about the pins", "give a bar an inertia, or its mass a distance"))
        refuse(faults)

    @cached_property
    def constants(self) -> Constants:
        """A, B, C, G1, G2, and A C - B² as a sum of positive terms."""
        (l1, m1, i1, c1), (_, m2, i2, c2) = self.first, self.second
        own, second = i1 + m1 * c1**2, i2 + m2 * c2**2
        least = own * second + m2 * l1**2 * i2
        weights = (m1 * c1 + m2 * l1) * self.gravity, m2 * c2 * self.gravity
        return Constants(own + m2 * l1**2, m2 * l1 * c2, second, *weights, least)


def mass_matrix(arm: TwoLinkArm, q: ArrayLike) -> Array:
    """M(q) = [[A, B cos(q1 - q2)], [B cos(q1 - q2), C]], kg m², shape (2, 2, ...); always positive definite.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).

    >>> mass_matrix(TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2)), [0.0, 0.0]).round(12).tolist()
    [[2.2, 0.3], [0.3, 0.1]]

    """
    (angles,) = _pairs(arm, q=q)
    k = arm.constants
    across = k.B * np.cos(angles[0] - angles[1])
    return np.stack((np.stack((k.A + 0 * across, across)), np.stack((across, k.C + 0 * across))))


def rest(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike) -> Array:
    """What is left of the equations without accelerations, N m, shape (2, ...): centrifugal terms and gravity.

    B sin(q1 - q2) q2'² - G1 sin q1 and -B sin(q1 - q2) q1'² - G2 sin q2. (In the bars' own angles there is no product
    q1' q2'; it comes with the elbow's relative angle as a coordinate.)

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0)
    >>> rest(arm, [np.pi / 2, np.pi / 2], [0.0, 2.0]).round(12).tolist()
    [-27.0, -3.0]

    """
    (q1, q2), (w1, w2) = _pairs(arm, q=q, qdot=qdot)
    k = arm.constants
    bend = k.B * np.sin(q1 - q2)
    return np.stack((bend * w2**2 - k.G1 * np.sin(q1), -bend * w1**2 - k.G2 * np.sin(q2)))


def driving_torques(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike, qddot: ArrayLike) -> Array:
    """Inverse dynamics: T1, T2 (N m), shape (2, ...), that a given motion takes.

    T2 = row 2 of M q'' + rest; T1 = row 1 + T2.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.
        qddot: accelerations, rad/s², same shape.

    Raises:
        SceneError: if an argument is not a pair of finite values.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0)
    >>> driving_torques(arm, [np.pi / 2, np.pi / 2], [0.0, 0.0], [0.0, 0.0]).round(12).tolist()  # held out level
    [-30.0, -3.0]

    """
    angles, turning = _pairs(arm, q=q, qddot=qddot)
    first, second = np.einsum("ij...,j...->i...", mass_matrix(arm, angles), turning) + rest(arm, angles, qdot)
    return np.stack((first + second, second))


def accelerations(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike, torques: ArrayLike = (0.0, 0.0)) -> Array:
    """Direct dynamics: q'' (rad/s²), shape (2, ...), under torques T1, T2.

    M q'' = (T1 - T2, T2) - rest, by Cramer's rule with det M = (A C - B²) + B² sin²(q1 - q2), a sum of positive terms.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.
        torques: T1, T2, N m, same shape or (2,).

    Raises:
        SceneError: if an argument is not a pair of finite values.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=0.0)
    >>> accelerations(arm, [0.0, np.pi], [0.0, 0.0], [1.5, -0.4]).round(9).tolist()
    [0.538461538, -2.384615385]

    """
    (q1, q2), (t1, t2) = _pairs(arm, q=q, torques=torques)
    left = rest(arm, q, qdot)
    k = arm.constants
    across, bend = k.B * np.cos(q1 - q2), k.B * np.sin(q1 - q2)
    one, two = t1 - t2 - left[0], t2 - left[1]
    return np.asarray(np.stack((k.C * one - across * two, k.A * two - across * one)) / (k.least + bend**2))


def energy(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike) -> tuple[Array, Array]:
    """Kinetic and potential energy (J); the potential is 0 with both centres at the shoulder's height.

    T = ½ A q1'² + ½ C q2'² + B q1' q2' cos(q1 - q2), V = G1 cos q1 + G2 cos q2.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.

    >>> kinetic, potential = energy(TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0), [0.0, 0.0], [1.0, 1.0])
    >>> round(float(kinetic), 12), round(float(potential), 12)
    (1.45, 30.0)

    """
    (q1, q2), (w1, w2) = _pairs(arm, q=q, qdot=qdot)
    k = arm.constants
    kinetic = 0.5 * k.A * w1**2 + 0.5 * k.C * w2**2 + k.B * w1 * w2 * np.cos(q1 - q2)
    return np.asarray(kinetic), np.asarray(k.G1 * np.cos(q1) + k.G2 * np.cos(q2))


def reactions(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike, qddot: ArrayLike) -> Reactions:
    """Forces in shoulder and elbow, by Newton's law for each bar.

    F_elbow = m2 (a_G2 - g), F_shoulder = F_elbow + m1 (a_G1 - g), g the acceleration of gravity as a vector.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.
        qddot: accelerations, rad/s², same shape.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0)
    >>> reactions(arm, [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]).shoulder.round(12).tolist()  # at rest: the weights
    [0.0, 42.0]

    """
    angles, speeds, turning = _pairs(arm, q=q, qdot=qdot, qddot=qddot)
    s, c = np.sin(angles), np.cos(angles)
    per_metre = np.stack((speeds**2 * s - turning * c, -(speeds**2) * c - turning * s))  # acceleration: x and y, of each bar
    lift = np.array([0.0, arm.gravity]).reshape(2, *[1] * (per_metre.ndim - 2))
    elbow = arm.second.mass * (arm.first.length * per_metre[:, 0] + arm.second.com * per_metre[:, 1] + lift)
    return Reactions(elbow + arm.first.mass * (arm.first.com * per_metre[:, 0] + lift), elbow)


def _pairs(arm: TwoLinkArm, **given: ArrayLike) -> list[Array]:
    """Arguments by name, each one value for each bar or arrays of one shape; the arm must be one."""
    require("arm", arm, TwoLinkArm, "a TwoLinkArm")
    pairs = {name: pair_of(name, values) for name, values in given.items()}
    shapes = {pair.shape for pair in pairs.values() if pair.ndim > 1}
    if len(shapes) > 1:
        name, pair = list(pairs.items())[-1]
        raise SceneError([Fault(name, f"an array of shape {pair.shape}", "arguments of one shape")])
    return list(pairs.values())


def pair_of(name: str, values: ArrayLike) -> Array:
    """One value for each bar, or arrays of them."""
    pair = array(name, values)
    if pair.ndim == 0 or pair.shape[0] != 2:
        raise SceneError([Fault(name, f"an array of shape {pair.shape}", "two rows, one for each bar")])
    return pair


def _bar_faults(name: str, bar: Bar) -> list[Fault]:
    if not isinstance(bar, Bar):
        return [Fault(name, shown(bar), "a Bar")]
    limits = (POSITIVE, "m"), (POSITIVE, "kg"), (NOT_NEGATIVE, "kg m²"), (ANY, "m")
    parts = zip(bar._asdict().items(), limits, strict=True)
    return [fault for (key, value), limit in parts for fault in number_faults(f"{name}.{key}", value, *limit)]
