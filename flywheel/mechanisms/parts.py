"""Parts that the chains of several families share: bodies on a fixed pivot, bodies that float, points on them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain
from math import pi
from operator import attrgetter
from typing import Any, NamedTuple

from flywheel.mechanisms.base import Mass, Ratio, Term, Velocity, Weight
from flywheel.scene import Body


class Line(NamedTuple):
    """A line fixed in a turning body: its angle, that angle's sine, cosine and rate d(angle)/dpsi."""

    velocity: str
    angle: Callable[[Any], Any]
    sine: Callable[[Any], Any]
    cosine: Callable[[Any], Any]
    rate: Callable[[Any], Any]


class Parts(NamedTuple):
    """A stretch of a mechanism's chain."""

    velocities: tuple[Velocity, ...] = ()
    masses: tuple[Mass, ...] = ()
    weights: tuple[Weight, ...] = ()


CRANK = Line("crank", attrgetter("psi"), attrgetter("sin"), attrgetter("cos"), lambda _: 1.0)


def line(name: str) -> Line:
    """Line of a body whose position has the attributes NAME, NAME_sin, NAME_cos and NAME_rate."""
    return Line(name, *map(attrgetter, (name, f"{name}_sin", f"{name}_cos", f"{name}_rate")))


def joined(*parts: Parts) -> Parts:
    """One chain from several stretches, in their order."""
    velocities, masses, weights = zip(*parts, strict=True)
    return Parts(*(tuple(chain(*column)) for column in (velocities, masses, weights)))


def driven(name: str, rotating: bool, source: str = "crank") -> Velocity:
    """Velocity by one transformer from `source`, its ratio the position's NAME_rate and the slope NAME_slope."""
    ratio = Ratio(attrgetter(f"{name}_rate"), attrgetter(f"{name}_slope"))
    return Velocity(name, rotating, (Term(source, ratio),))


def carried(velocity: str, value: float, body: str) -> tuple[Mass, ...]:
    """Mass or inertia on a velocity; nothing where it is zero."""
    return () if value == 0 else (Mass(velocity, value, body),)


def sliding(name: str, mass: float, direction: float, source: str = "crank") -> Parts:
    """Body that slides along a fixed direction (rad), and has mass (kg) and weight there."""
    weight = () if mass == 0 else (Weight(name, mass, direction, name),)
    return Parts((driven(name, False, source),), carried(name, mass, name), weight)


def arm(line: Line, length: float, tilt: float = 0.0) -> tuple[Term, Term]:
    """Velocity along x and along y of the end of an arm, relative to its start, from the arm's angular velocity.

    The arm has `length` (m) and lies `tilt` (rad) counter-clockwise from the line: end = length (cos a, sin a) with
    a = angle + tilt, so T_x = -length sin a and T_y = length cos a; slopes follow by da/dpsi = rate.
    """
    sine, cosine = line.sine, line.cosine
    if tilt != 0:
        sine, cosine = _tilted(line, tilt)
    along_x = Ratio(lambda p: -length * sine(p), lambda p: -length * cosine(p) * line.rate(p))
    along_y = Ratio(lambda p: length * cosine(p), lambda p: -length * sine(p) * line.rate(p))
    return Term(line.velocity, along_x), Term(line.velocity, along_y)


def _tilted(line: Line, tilt: float) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    return (lambda p: p.ns.sin(line.angle(p) + tilt)), (lambda p: p.ns.cos(line.angle(p) + tilt))


def point(line: Line, name: str, radius: float, mass: float, body: str, tilt: float = 0.0) -> Parts:
    """Point of a body on a fixed pivot: NAME is its tangential speed; NAME.x and NAME.y are its components."""
    if radius == 0:
        return Parts()
    along_x, along_y = arm(line, radius, tilt)
    velocities = (
        Velocity(name, False, (Term(line.velocity, radius),)),
        Velocity(f"{name}.x", False, (along_x,)),
        Velocity(f"{name}.y", False, (along_y,)),
    )
    return Parts(velocities, carried(name, mass, body), _weights(name, mass, body))


def pivoted(line: Line, name: str, body: Body) -> Parts:
    """Body on a fixed pivot: inertia on its rotation, mass on the tangential speed of its centre of mass."""
    inertia = Parts(masses=carried(line.velocity, body.inertia, name))
    return joined(inertia, point(line, f"{name}.com", body.com, body.mass, name, body.com_angle))


def floating(line: Line, name: str, body: Body, length: float, carrier: Line = CRANK) -> Parts:
    """Body whose first pin is the end of a carrier's arm, `length` (m) from the carrier's fixed pivot.

    Its centre of mass moves as that pin does, plus its own turning about it.
    """
    arms = [arm(carrier, length)]
    if body.com != 0:
        arms.append(arm(line, body.com, body.com_angle))
    at = f"{name}.com"
    along_x, along_y = zip(*arms, strict=True)
    velocities = Velocity(f"{at}.x", False, along_x), Velocity(f"{at}.y", False, along_y)
    masses = tuple(chain(*(carried(v.name, body.mass, name) for v in velocities)))
    return Parts(velocities, carried(line.velocity, body.inertia, name) + masses, _weights(at, body.mass, name))


def _weights(name: str, mass: float, body: str) -> tuple[Weight, ...]:
    if mass == 0:
        return ()
    return Weight(f"{name}.x", mass, 0.0, body), Weight(f"{name}.y", mass, pi / 2, body)
