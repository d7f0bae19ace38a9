"""How one body stands to another at a joint: scalar relations of two bodies' poses, with their derivatives.

A body's pose is that of its centre of mass and its angle: x, y (m), theta (rad). Every relation phi gives its value, its
gradient by both poses, and its bend (phi_x v)_x v, the part of its second time derivative that needs no accelerations:
d²phi/dt² = phi_x a + bend. Only arithmetic is done here, so that any kind of number may stand in the poses.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from flywheel.linkage.description import FIXED, PIN, SLIDE, SLOT, Coupling, Joint, Linkage

Vector = tuple[Any, Any]
Gradient = tuple[Any, Any, Any]


class Place(NamedTuple):
    """A body's pose with the cosine and sine of its angle, and its velocities (m/s, rad/s)."""

    x: Any
    y: Any
    theta: Any
    cos: Any
    sin: Any
    vx: Any = 0.0
    vy: Any = 0.0
    omega: Any = 0.0


def placed(pose: Any, velocity: Any = (0.0, 0.0, 0.0), ns: Any = math) -> Place:
    """A body at a pose x, y, theta with velocities; cosine and sine come from the namespace `ns`."""
    x, y, theta = pose
    return Place(x, y, theta, ns.cos(theta), ns.sin(theta), *velocity)


class Row(NamedTuple):
    """A relation: its value, gradients by the poses of the first and the second body, and its bend."""

    value: Any
    first: Gradient
    second: Gradient
    bend: Any


class Pair(NamedTuple):
    """A joint as its two bodies (numbers in `linkage.names`), its points from their centres of mass, its direction."""

    name: str
    kind: str
    first: int
    second: int
    first_arm: Vector
    second_arm: Vector
    direction: Vector
    angle: float


def pair(linkage: Linkage, joint: Joint) -> Pair:
    """A joint prepared for the relations."""
    numbers = (linkage.names.index(joint.first), linkage.names.index(joint.second))
    ends = (joint.first, joint.first_at), (joint.second, joint.second_at)
    arms = [(at.x - linkage.link(body).com[0], at.y - linkage.link(body).com[1]) for body, at in ends]
    direction = math.cos(joint.direction), math.sin(joint.direction)
    return Pair(joint.name, joint.kind, *numbers, arms[0], arms[1], direction, joint.angle)


class Gap(NamedTuple):
    """From the joint's point on the first body to that on the second: arms and gap (m), the gap's rate and bend."""

    first_arm: Vector
    second_arm: Vector
    gap: Vector
    rate: Vector
    bend: Vector


def turned(place: Place, arm: Vector) -> Vector:
    """An arm of the body's frame as it stands in the fixed frame: R(theta) a."""
    return place.cos * arm[0] - place.sin * arm[1], place.sin * arm[0] + place.cos * arm[1]


def gap(joint: Pair, one: Place, two: Place) -> Gap:
    """D = x2 + r2 - x1 - r1; its rate v2 + omega2 × r2 - v1 - omega1 × r1; its bend omega1² r1 - omega2² r2."""
    ax, ay = turned(one, joint.first_arm)
    bx, by = turned(two, joint.second_arm)
    across = two.x + bx - one.x - ax, two.y + by - one.y - ay
    rate = two.vx - two.omega * by - one.vx + one.omega * ay, two.vy + two.omega * bx - one.vy - one.omega * ax
    w1, w2 = one.omega * one.omega, two.omega * two.omega
    return Gap((ax, ay), (bx, by), across, rate, (w1 * ax - w2 * bx, w1 * ay - w2 * by))


def fixed_component(seen: Gap, e: Vector) -> Row:
    """Component e · d of the gap along a direction of the fixed frame."""
    ex, ey = e
    (ax, ay), (bx, by) = seen.first_arm, seen.second_arm
    first = -ex, -ey, ex * ay - ey * ax
    second = ex, ey, ey * bx - ex * by
    return Row(_dot(e, seen.gap), first, second, _dot(e, seen.bend))


def turning_component(seen: Gap, e: Vector, omega: Any) -> Row:
    """Component e · d of the gap along a direction that turns with the first body at omega.

    Its rate has the further part omega e_perp · d; its bend 2 omega e_perp · d' - omega² e · d.
    """
    row = fixed_component(seen, e)
    perp = -e[1], e[0]
    first = row.first[0], row.first[1], row.first[2] + _dot(perp, seen.gap)
    return row._replace(first=first, bend=row.bend + 2 * omega * _dot(perp, seen.rate) - omega * omega * row.value)


def turn(joint: Pair, one: Place, two: Place) -> Row:
    """Angle of the second body less that of the first."""
    return Row(two.theta - one.theta, (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), 0.0)


def held_turn(joint: Pair, one: Place, two: Place) -> Row:
    """What the turn lacks to the joint's own angle, whole turns left out."""
    row = turn(joint, one, two)
    left = row.value - joint.angle
    return row._replace(value=left - 2 * math.pi * round(left / (2 * math.pi)))


def closures(joint: Pair, one: Place, two: Place) -> list[Row]:
    """The relations that a joint keeps at zero, in the order of its components in `COMPONENTS`."""
    seen = gap(joint, one, two)
    if joint.kind in (PIN, FIXED):
        rows = [fixed_component(seen, (1.0, 0.0)), fixed_component(seen, (0.0, 1.0))]
    else:
        ux, uy = turned(one, joint.direction)
        rows = [turning_component(seen, (-uy, ux), one.omega)]
    if joint.kind in (SLIDE, FIXED):
        rows.append(held_turn(joint, one, two))
    return rows


COMPONENTS = {PIN: ("x", "y"), SLIDE: ("normal", "moment"), SLOT: ("normal",), FIXED: ("x", "y", "moment")}
"""What the first body does to the second through each kind of joint, at the second's point.

x, y: forces along the frame's axes (N); normal: force across the guide, positive to the left of its direction (N);
moment: positive counter-clockwise (N m). The first body feels the opposite at the same place.
"""


def coordinate(joint: Pair, one: Place, two: Place) -> Row:
    """The joint's coordinate: the turn of a pin (rad), the way along the guide of a slide or pin in slot (m)."""
    if joint.kind == PIN:
        return turn(joint, one, two)
    return turning_component(gap(joint, one, two), turned(one, joint.direction), one.omega)


class Drive(NamedTuple):
    """How a coupling drives its second coordinate at a value of its first: q2 = value, with two derivatives by q1."""

    value: Any
    first: Any
    second: Any


def drive(coupling: Coupling, q: Any) -> Drive:
    """A coupling's second coordinate by its first: ratio q + phase, or a cam's lift(q) + phase."""
    if coupling.lift is None:
        return Drive(coupling.ratio * q + coupling.phase, coupling.ratio, 0.0)
    import numpy as np  # a lift law's own namespace; couplings without one need none

    angle = q - math.floor(q / coupling.lift.period) * coupling.lift.period
    jet = coupling.lift.curve.jet(angle, angle, np)
    return Drive(float(jet.value) + coupling.phase, float(jet.first), float(jet.second))


def _dot(a: Vector, b: Vector) -> Any:
    return a[0] * b[0] + a[1] * b[1]
