"""Scotch yoke: a pin on the crank drives a slotted yoke straight along a fixed direction."""

from __future__ import annotations

from functools import cached_property, partial
from math import pi
from operator import attrgetter
from typing import Any

from flywheel.mechanisms.families import CRANK, Family, Port, Position, joined, pivoted, point, sliding, within_turn
from flywheel.numerics.faults import Fault
from flywheel.scene.scene import Body, Mechanism


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


def family(mechanism: Mechanism) -> Family:
    """Chain of a scotch yoke: the block sits at the crank's pin, the yoke moves along `yoke.direction`."""
    crank = mechanism.geometry["crank.length"]
    direction = mechanism.geometry.get("yoke.direction", 0.0)
    bodies = {name: mechanism.bodies.get(name, Body()) for name in ("crank", "block", "yoke")}
    parts = joined(
        pivoted(CRANK, "crank", bodies["crank"]),
        point(CRANK, "crank.pin", crank, bodies["block"].mass, "block"),
        sliding("yoke", bodies["yoke"].mass, direction),
    )
    ports = {"yoke": Port("yoke", attrgetter("yoke"), dead_centres=within_turn((direction, direction + pi)))}
    return Family(*parts, ports, partial(YokePosition, crank, direction))


def faults(mechanism: Mechanism) -> list[Fault]:
    """None: a scotch yoke turns whatever its crank."""
    return []
