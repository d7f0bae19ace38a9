"""Linkages that the pictures need beside those of the solver's tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.positions import solve
from flywheel.numerics.jets import Jet
from flywheel.scene.linkage import CAM, FRAME, GEAR, PIN, ROLLING, SLIDE, Coupling, Joint, Lift, Link, Linkage, Point

O = Point("O")  # noqa: E741
TURN = 2 * np.pi


def cycle(linkage: Linkage, count: int = 121) -> Poses:
    """Poses over a turn of the driver."""
    return solve(linkage, 0.0, TURN).poses(np.linspace(0.0, TURN, count))


def pin(name: str, first: str, second: str, at: Point = O, to: Point = O) -> Joint:
    """A pin between points of two bodies."""
    return Joint(name, PIN, first, second, at, to)


def roller() -> Linkage:
    """A wheel of 60 mm on a cart that a crank pushes; it rolls on the frame."""
    tip, end = Point("A", 0.1), Point("B", 0.4)
    links = (Link("crank", (O, tip)), Link("rod", (O, end), guess=0.0), Link("cart", (O,)), Link("wheel", (O,)))
    joints = (
        pin("O", FRAME, "crank"),
        pin("A", "crank", "rod", tip),
        pin("B", "rod", "cart", end),
        Joint("way", SLIDE, FRAME, "cart", O, O),
        pin("W", "cart", "wheel"),
    )
    return Linkage(Link(FRAME, (O,)), links, joints, "O", (Coupling("roll", ROLLING, "W", "way", -0.06),))


def planetary(ratio: float) -> Linkage:
    """A wheel on the frame's pin and another one 100 mm beside it, geared."""
    axis = Point("P", 0.1)
    links = (Link("sun", (O,)), Link("planet", (O,)))
    joints = (pin("O", FRAME, "sun"), pin("P", FRAME, "planet", axis))
    return Linkage(Link(FRAME, (O, axis)), links, joints, "O", (Coupling("mesh", GEAR, "O", "P", ratio),))


class Eccentric:
    """The lift of a disc of 50 mm about an axis 20 mm off its centre, under a flat face that moves up."""

    breakpoints: tuple[float, ...] = ()

    def jet(self, angle: Any, anchor: Any, ns: Any) -> Jet:
        """Lift with two derivatives."""
        return Jet(0.05 + 0.02 * ns.sin(angle), 0.02 * ns.cos(angle), -0.02 * ns.sin(angle))


def eccentric(contact: bool = False, low: float = 0.0) -> Linkage:
    """A cam under a follower that moves up, which it touches at the follower's point O (or on its flat face there)."""
    links = (Link("cam", (O,)), Link("follower", (O, Point("T", 0.0, 0.1))))
    joints = (
        pin("O", FRAME, "cam"),
        Joint("lift", SLIDE, FRAME, "follower", Point("G", 0.0, low), O, direction=np.pi / 2),
    )
    touch = ("follower", "O") if contact else None
    cam = Coupling("cam", CAM, "O", "lift", lift=Lift(Eccentric(), TURN), contact=touch)
    return Linkage(Link(FRAME, (O,)), links, joints, "O", (cam,))
