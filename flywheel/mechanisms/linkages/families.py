"""The named mechanisms as linkages: the same bodies, centres of mass and assembly, with every joint spelled out.

A joint bears the name of its point in both bodies; its first body is the one nearer to the driver, or the frame.

| type | bodies | joints, the driver first |
| --- | --- | --- |
| scotch-yoke | crank, block, yoke | pivot, crank_pin, slot (slide), guide (slide) |
| slider-crank | crank, rod, slider | pivot, crank_pin, slider_pin, guide (slide) |
| four-bar | crank, coupler, rocker | pivot, crank_pin, rocker_pin, rocker_pivot |
| crank-shaper | crank, block, rocker, rocker_pin, ram | pivot, crank_pin, rocker_slot (slide), rocker_pivot, end_pin, ram_slot (slide), guide (slide) |
| toggle-clamp | block, coupler, bell_crank, rod, platen | block_guide (slide), block_pin, coupler_pin, pivot, rod_pin, platen_pin, platen_guide (slide) |

A body's own x axis is the line whose angle the mechanism's port gives; that of a body without one is +x of the frame,
and of the shaper's block the rocker's line. The frame's origin is the crank's pivot, or the rocker's in a shaper.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from flywheel.mechanisms import KINDS, families
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import PIN, SLIDE, Joint, Link, Linkage, Point, Side
from flywheel.scene.scene import Mechanism


def linkage_of(mechanism: Mechanism) -> Linkage:
    """A named mechanism as a linkage, driven by the same coordinate: its crank's angle (rad) or its block's slide (m).

    Args:
        mechanism: of any type but `law`; that of a mechanism of type `linkage` is given back as it is.

    Raises:
        SceneError: for a law, which has no bodies to join; for lengths with which the mechanism locks.

    >>> lengths = {"crank.length": 0.1, "rod.length": 0.3}
    >>> linkage = linkage_of(Mechanism("slider-crank", "press", geometry=lengths))
    >>> linkage.names, linkage.driver
    (('frame', 'crank', 'rod', 'slider'), 'pivot')
    >>> [joint.name for joint in linkage.joints]
    ['pivot', 'crank_pin', 'slider_pin', 'guide']

    """
    if mechanism.linkage is not None:
        return mechanism.linkage
    skeleton = KINDS[mechanism.type].skeleton if mechanism.type in KINDS else None
    if skeleton is None:
        advice = "write it as a linkage to have joints"
        jointed = [name for name, kind in KINDS.items() if kind.skeleton is not None]
        found, expected = f"a mechanism of type {mechanism.type}", "one of " + ", ".join(jointed)
        raise SceneError([Fault(f"{mechanism.path}.type", found, expected, advice)])
    start = mechanism.stroke[0] if mechanism.stroke is not None else 0.0
    members, joints, sides = skeleton(mechanism, families.build(mechanism).position(np.float64(start), np))
    ground, *moving = (_link(mechanism, name, member) for name, member in members.items())
    links = {link.name: link for link in (ground, *moving)}
    joined = tuple(_joint(links, joint) for joint in joints)
    ordered = tuple(Side(*side) for side in sides)
    return Linkage(ground, tuple(moving), joined, joined[0].name, sides=ordered, start=float(start), path=mechanism.path)


def _link(mechanism: Mechanism, name: str, member: families.Member) -> Link:
    """Body with a point for each joint."""
    body = families.body(mechanism, name)
    towards = body.com_angle + member.tilt
    com = float(body.com * cos(towards)), float(body.com * sin(towards))
    points = tuple(Point(at, float(x), float(y)) for at, (x, y) in member.joints.items())
    angle = None if member.angle is None else float(member.angle)
    return Link(name, points, float(body.mass), float(body.inertia), com, angle)


def _joint(links: dict[str, Link], joint: families.Pin | families.Slide) -> Joint:
    ends = links[joint.first].point(joint.name), links[joint.second].point(joint.name)
    if isinstance(joint, families.Pin):
        return Joint(joint.name, PIN, joint.first, joint.second, *ends)
    at = None if joint.at is None else float(joint.at)
    return Joint(joint.name, SLIDE, joint.first, joint.second, *ends, float(joint.direction), guess=at)
