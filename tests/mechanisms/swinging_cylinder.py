"""A family that the toolkit does not have, in one file: a crank whose rod slides through a cylinder on trunnions."""

from collections.abc import Mapping
from functools import partial
from math import pi
from operator import attrgetter
from typing import Any

from flywheel import Fault
from flywheel.mechanisms import families as f
from flywheel.scene.scene import MASS, OWN_INERTIA, Mechanism, length


class CylinderPosition(f.Position):
    """s² = r² + d² - 2 r d cos psi, from the crank's pin to the trunnion; theta is the angle of that line."""

    def __init__(self, r: float, d: float, psi: Any, ns: Any, anchor: Any = None) -> None:
        super().__init__(psi, ns)
        self.r, self.d = r, d
        self.square = (d - r) ** 2 + 4 * r * d * self.half_sin**2
        self.rod = ns.sqrt(self.square)
        self.rod_rate = r * d * self.sin / self.rod
        self.rod_slope = (r * d * self.cos - self.rod_rate**2) / self.rod

    cylinder = property(lambda p: p.ns.atan2(-p.r * p.sin, p.d - p.r * p.cos))
    cylinder_rate = property(lambda p: p.r * (p.r - p.d * p.cos) / p.square)
    cylinder_slope = property(lambda p: p.r * p.d * (p.d**2 - p.r**2) * p.sin / p.square**2)


def family(mechanism: Mechanism, _: Mapping[str, float]) -> f.Family:
    r, d = mechanism.geometry["crank.length"], mechanism.geometry["frame.length"]
    turning = f.carried("cylinder", f.body(mechanism, "cylinder").inertia, "cylinder")
    swinging = f.Parts((f.driven("cylinder", True), f.driven("rod", False)), turning)
    ports = {"rod": f.Port("rod", attrgetter("rod"), dead_centres=(0.0, pi))}
    return f.Family(*f.joined(f.pivoted(f.CRANK, mechanism, "crank"), swinging), ports, partial(CylinderPosition, r, d))


def locks(mechanism: Mechanism) -> list[Fault]:
    r, d = mechanism.geometry["crank.length"], mechanism.geometry["frame.length"]
    return [] if f.exceeds(d, r) else [f.lock_fault(f"{mechanism.path}.frame.length", d, f"more than {r:.9g} m", [0.0])]


def skeleton(mechanism: Mechanism, position: CylinderPosition) -> f.Skeleton:
    members = {
        "frame": f.Member({"pivot": f.HERE, "trunnion": (position.d, 0.0)}),
        "crank": f.Member({"pivot": f.HERE, "pin": (position.r, 0.0)}),
        "rod": f.Member({"pin": f.HERE, "bore": f.HERE}, position.cylinder),
        "cylinder": f.Member({"bore": f.HERE, "trunnion": f.HERE}, position.cylinder),
    }
    pins = f.Pin("pivot", "frame", "crank"), f.Pin("pin", "crank", "rod"), f.Pin("trunnion", "frame", "cylinder")
    return members, (*pins, f.Slide("bore", "cylinder", "rod", pi, position.rod)), ()


FRAME = f.Part("frame", "the frame", (length("crank's pivot to trunnion, along +x"),))
CYLINDER = f.Part("cylinder", "turns about its trunnion, its own centre of mass", (), (MASS, OWN_INERTIA))
PORTS = (f.Displacement("rod", False, "s = sqrt(r^2 + d^2 - 2 r d cos phi), from the crank's pin to the trunnion"),)
KIND = f.Kind("swinging-cylinder", "a rod on the crank's pin slides through a cylinder on trunnions", family,
              (f.CRANK_PART, FRAME, CYLINDER), (), PORTS, locks, skeleton, {"rod": "bore"})  # fmt: skip
