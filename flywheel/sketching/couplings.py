"""Figures of couplings: pitch circles of gears, wheels that roll, cams with the profile that the motion gives them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flywheel.linkage.description import CAM, FRAME, GEAR, SLIDE, Coupling, Joint, common_body
from flywheel.linkage.poses import Poses
from flywheel.sketching import symbols
from flywheel.sketching.shapes import Place, Shape

Array = NDArray[np.float64]

_LARGEST = 50.0  # times the distance of centres: wheels beyond it would fill the picture with a straight line


def coupling_shapes(cycle: Poses, coupling: Coupling, unit: float) -> Iterator[Shape]:
    """What is drawn of a coupling."""
    first, second = cycle.linkage.joint(coupling.first), cycle.linkage.joint(coupling.second)
    if coupling.kind == GEAR:
        yield from _gears(cycle, coupling, first, second)
    elif coupling.kind == CAM:
        yield _cam(cycle, coupling, first, second, unit)
    else:
        yield from _rolling(cycle, coupling, first, second, unit)


def _wheel_on(joint: Joint, carrier: str) -> tuple[Place, int]:
    """The place of the wheel that a pin bears, and the sense in which the pin's coordinate counts its turning."""
    if joint.first == carrier:
        return (joint.second, (joint.second_at.x, joint.second_at.y)), 1
    return (joint.first, (joint.first_at.x, joint.first_at.y)), -1


# -- wheels ----------------------------------------------------------------------------------------------------------


def radii(ratio: float, centres: float) -> tuple[float, float]:
    """Pitch radii r1, r2 (m) of wheels whose speeds against their carrier are w2 = ratio w1, `centres` (m) apart.

    From outside (ratio < 0): r1 + r2 = a; one inside the other (ratio > 0): |r1 - r2| = a; in both r1 = |ratio| r2.
    Equal speeds (ratio 1) have no pitch circles: both are infinite.

    >>> radii(-2.0, 0.3), radii(2.0, 0.1)
    ((0.2, 0.1), (0.2, 0.1))
    """
    if ratio == 1.0:
        return np.inf, np.inf
    small = centres / abs(ratio - 1.0)
    return round(abs(ratio) * small, 15), round(small, 15)


def _gears(cycle: Poses, coupling: Coupling, first: Joint, second: Joint) -> Iterator[Shape]:
    """The two pitch circles, with a mark that shows how the wheels turn."""
    carrier = common_body(first, second)
    (one, sense1), (two, sense2) = _wheel_on(first, carrier), _wheel_on(second, carrier)
    between = cycle.point(*two).value[:, 0] - cycle.point(*one).value[:, 0]
    distance = float(np.hypot(*between))
    sizes = radii(coupling.ratio * sense1 * sense2, distance)
    if max(sizes) > _LARGEST * distance:
        return
    for place, radius in zip((one, two), sizes, strict=True):
        yield from _wheel(place, radius)


def _wheel(at: Place, radius: float) -> Iterator[Shape]:
    body = at[0]
    yield Shape("wheel", body, symbols.circle(radius), at, body)
    yield Shape("mark", body, np.array([[0.0, radius], [0.0, 0.0]]), at, body)


def _rolling(cycle: Poses, coupling: Coupling, pin: Joint, slide: Joint, unit: float) -> Iterator[Shape]:
    """A wheel of radius |ratio| and the line that it rolls on, on the side where wheel and line have one velocity."""
    carriage = common_body(pin, slide)
    wheel, sense = _wheel_on(pin, carriage)
    carried = slide.second == carriage
    other, at = (slide.first, slide.first_at) if carried else (slide.second, slide.second_at)
    side = coupling.ratio * sense * (1 if carried else -1)
    angle = cycle.angle(slide.first).value + slide.direction
    contact = cycle.point(*wheel).value + side * np.stack((-np.sin(angle), np.cos(angle)))
    turn = cycle.angle(other).value
    x, y = contact - cycle.point(other, at).value
    inside = np.stack((x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)))
    direction = slide.direction - (0.0 if carried else slide.angle)
    run = np.array([np.cos(direction), np.sin(direction)]) @ (inside - inside[:, :1])
    low, high, start = float(run.min()) - 4 * unit, float(run.max()) + 4 * unit, (float(inside[0, 0]), float(inside[1, 0]))
    if other == FRAME:
        low, high, direction = (-high, -low, direction + np.pi) if side > 0 else (low, high, direction)
        line = symbols.turned(symbols.ground(low, high, 1.6 * unit), direction, start)
        yield Shape("ground", FRAME, line, (other, (at.x, at.y)), other)
    else:
        line = symbols.turned(np.array([[low, high], [0.0, 0.0]]), direction, start)
        stem = np.stack((np.full(2, np.nan), np.zeros(2), line[:, int(np.hypot(*line).argmin())]), axis=1)
        yield Shape("track", other, np.concatenate((line, stem), axis=1), (other, (at.x, at.y)), other)
    yield from _wheel(wheel, abs(coupling.ratio))


# -- cams ------------------------------------------------------------------------------------------------------------


def _cam(cycle: Poses, coupling: Coupling, pin: Joint, follower: Joint, unit: float) -> Shape:
    """The profile that the motion gives, about the cam's pin; a plain disc where it cannot be known."""
    at, _ = _wheel_on(pin, common_body(pin, follower))
    contact = _contact(cycle, coupling, at, follower)
    if contact is None:
        return Shape("cam", at[0], symbols.circle(6.0 * unit), at, at[0])
    turn = cycle.angle(at[0]).value
    x, y = contact - cycle.point(*at).value
    profile = np.stack((x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)))
    once = np.abs(turn - turn[0]) <= 2 * np.pi * (1 + 1e-12)
    whole = np.ptp(turn) >= 2 * np.pi * (1 - 1e-9)
    return Shape("cam" if whole else "track", at[0], profile[:, once], at, at[0])


def _contact(cycle: Poses, coupling: Coupling, cam: Place, follower: Joint) -> Array | None:
    """Where cam and follower meet (m, shape (2, n)): at the point named, or on the face across a sliding follower.

    A flat face at height h over the cam's axis touches it at the eccentricity -dh/dtheta, to the left of its travel. None
    where the face cannot be told: of a follower that turns, or whose point lies behind the axis.
    """
    if coupling.contact is not None:
        body, name = coupling.contact
        return cycle.point(body, cycle.linkage.link(body).point(name)).value
    if (follower.kind, follower.first) != (SLIDE, FRAME) or not np.all(cycle.angle(cam[0]).rate):
        return None
    along = np.array([[np.cos(follower.direction)], [np.sin(follower.direction)]])
    face, axis = cycle.point(follower.second, follower.second_at), cycle.point(*cam)
    height = np.sum(along * (face.value - axis.value), axis=0)
    if height.min() <= 0.0:
        return None
    rise = np.sum(along * (face.rate - axis.rate), axis=0) / cycle.angle(cam[0]).rate
    return np.asarray(axis.value + height * along - rise * np.stack((-along[1], along[0])))
