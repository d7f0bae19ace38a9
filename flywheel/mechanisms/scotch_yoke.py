"""Scotch yoke: a pin on the crank drives a slotted yoke straight along a fixed direction."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from math import pi, sin
from operator import attrgetter
from typing import Any

from flywheel.language import text as _
from flywheel.mechanisms import families as f
from flywheel.scene.scene import POINT, Key, Mechanism


class YokePosition(f.Position):
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


def family(mechanism: Mechanism, parameters: Mapping[str, float]) -> f.Family:
    """Chain of a scotch yoke: the block sits at the crank's pin, the yoke moves along `yoke.direction`."""
    crank = mechanism.geometry["crank.length"]
    direction = mechanism.geometry.get("yoke.direction", 0.0)
    parts = f.joined(
        f.pivoted(f.CRANK, mechanism, "crank"),
        f.point(f.CRANK, "crank.pin", crank, f.body(mechanism, "block").mass, "block"),
        f.sliding(mechanism, "yoke", direction),
    )
    ports = {"yoke": f.Port("yoke", attrgetter("yoke"), dead_centres=f.within_turn((direction, direction + pi)))}
    return f.Family(*parts, ports, partial(YokePosition, crank, direction))


def skeleton(mechanism: Mechanism, position: YokePosition) -> f.Skeleton:
    """The yoke's own origin, in its slot, moves along `yoke.direction` through the pivot."""
    radius, direction = mechanism.geometry["crank.length"], mechanism.geometry.get("yoke.direction", 0.0)
    members = {
        "frame": f.Member({"pivot": f.HERE, "guide": f.HERE}),
        "crank": f.Member({"pivot": f.HERE, "crank_pin": (radius, 0.0)}),
        "block": f.Member({"crank_pin": f.HERE, "slot": f.HERE}),
        "yoke": f.Member({"guide": f.HERE, "slot": f.HERE}),
    }
    joints = (
        f.Pin("pivot", "frame", "crank"),
        f.Pin("crank_pin", "crank", "block"),
        f.Slide("slot", "yoke", "block", direction + pi / 2, radius * sin(position.psi - direction)),
        f.Slide("guide", "frame", "yoke", direction, position.yoke),
    )
    return members, joints, ()


def derivation(made: f.Derivation) -> None:
    """Loop: x = R cos(phi - delta)."""
    p, phi = made.position, made.driver
    at = f"{phi} - delta" if made.mechanism.geometry.get("yoke.direction") else phi
    made.equations(f"R*cos({at}) = x")
    made.part(_("Positions"))
    made.find("x", f"R*cos({at})", "m", _("Place of the yoke"), values=p.yoke)
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("x_prime", f"-(R*sin({at}))", "m", values=p.yoke_rate)
    made.part(_("Their derivatives g′"))
    made.find("x_second", f"-(R*cos({at}))", "m", values=p.yoke_slope)
    made.moves(yoke="x")
    f.block_on_pin(made, "R")
    made.pivoted("crank", made.driver, "crank")


KIND = f.Kind(
    "scotch-yoke",
    "a crank pin slides in a slot of a yoke that moves along a straight line",
    family,
    (
        f.CRANK_PART,
        f.Part("yoke", "moves along a line", (Key("direction", "angle", "of its travel, from +x", 0.0),), POINT),
        f.Part("block", "mass at the crank pin", (), POINT),
    ),
    ports=(f.Displacement("yoke", False, "x = R cos(phi - direction), positive along direction"),),
    skeleton=skeleton,
    guides={"yoke": "guide"},
    symbols={"crank.length": "R", "yoke.direction": "delta"},
    derivation=derivation,
    main=("guide",),
)
