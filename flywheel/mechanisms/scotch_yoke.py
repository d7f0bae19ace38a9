"""Scotch yoke: a pin on the crank drives a slotted yoke straight along a fixed direction."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from math import pi, sin
from operator import attrgetter
from typing import Any

from flywheel.mechanisms.families import (
    CRANK,
    CRANK_PART,
    HERE,
    Displacement,
    Family,
    Kind,
    Member,
    Part,
    Pin,
    Port,
    Position,
    Skeleton,
    Slide,
    body,
    joined,
    pivoted,
    point,
    sliding,
    within_turn,
)
from flywheel.scene.keys import POINT, Key
from flywheel.scene.scene import Mechanism


class YokePosition(Position):
    """Positions of a scotch yoke: x = R cos(psi - direction), with crank R (m) and direction (rad from +x)."""

    def __init__(self, crank: float, direction: float, psi: Any, ns: Any, anchor: Any = None) -> None:
        super().__init__(psi, ns)
        self.crank = crank
        self.turned = psi - direction

    @cached_property
    def yoke(self) -> Any:
        """Displacement of the yoke (m) from the crank's pivot, along its direction."""
        return self.crank * self.ns.cos(self.turned)

    @cached_property
    def yoke_rate(self) -> Any:
        """dx/dpsi = -R sin(psi - direction), in m."""
        return -self.crank * self.ns.sin(self.turned)

    @cached_property
    def yoke_slope(self) -> Any:
        """d²x/dpsi² = -x, in m."""
        return -self.yoke


def family(mechanism: Mechanism, _: Mapping[str, float]) -> Family:
    """Chain of a scotch yoke: the block sits at the crank's pin, the yoke moves along `yoke.direction`."""
    crank = mechanism.geometry["crank.length"]
    direction = mechanism.geometry.get("yoke.direction", 0.0)
    parts = joined(
        pivoted(CRANK, mechanism, "crank"),
        point(CRANK, "crank.pin", crank, body(mechanism, "block").mass, "block"),
        sliding(mechanism, "yoke", direction),
    )
    ports = {"yoke": Port("yoke", attrgetter("yoke"), dead_centres=within_turn((direction, direction + pi)))}
    return Family(*parts, ports, partial(YokePosition, crank, direction))


def skeleton(mechanism: Mechanism, position: YokePosition) -> Skeleton:
    """The yoke's own origin, in its slot, moves along `yoke.direction` through the pivot."""
    radius, direction = mechanism.geometry["crank.length"], mechanism.geometry.get("yoke.direction", 0.0)
    members = {
        "frame": Member({"pivot": HERE, "guide": HERE}),
        "crank": Member({"pivot": HERE, "crank_pin": (radius, 0.0)}),
        "block": Member({"crank_pin": HERE, "slot": HERE}),
        "yoke": Member({"guide": HERE, "slot": HERE}),
    }
    joints = (
        Pin("pivot", "frame", "crank"),
        Pin("crank_pin", "crank", "block"),
        Slide("slot", "yoke", "block", direction + pi / 2, radius * sin(position.psi - direction)),
        Slide("guide", "frame", "yoke", direction, position.yoke),
    )
    return Skeleton(members, joints)


KIND = Kind(
    "scotch-yoke",
    "a crank pin slides in a slot of a yoke that moves along a straight line",
    family,
    (
        CRANK_PART,
        Part("yoke", "moves along a line", (Key("direction", "angle", "of its travel, from +x", 0.0),), POINT),
        Part("block", "mass at the crank pin", (), POINT),
    ),
    ports=(Displacement("yoke", False, "x = R cos(phi - direction), positive along direction"),),
    skeleton=skeleton,
    guides={"yoke": "guide"},
)
