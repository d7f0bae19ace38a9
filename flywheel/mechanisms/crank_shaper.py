"""Crank-shaper: the crank's pin slides in a slotted rocker, whose end drives a ram along +y."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from math import pi
from operator import attrgetter
from typing import Any

from flywheel.language import text as _
from flywheel.mechanisms import families as f
from flywheel.numerics.faults import Fault
from flywheel.numerics.jets import atan2, log, sqrt
from flywheel.scene.scene import BODY, MASS, OWN_INERTIA, POINT, Mechanism, length


class ShaperPosition(f.Position):
    """Positions of a crank-shaper with crank r, frame d and rocker L (m).

    The pin is at (d + r cos psi, r sin psi) from the rocker's pivot, at the distance s. Sums are computed by the half
    angle, so that they keep their digits when the pin passes close to that pivot (psi = 180 deg, r near d).
    """

    def __init__(self, crank: float, frame: float, rocker: float, psi: Any, ns: Any, anchor: Any = None) -> None:
        super().__init__(psi, ns)
        self.r, self.d, self.length = crank, frame, rocker

    @cached_property
    def _lift(self) -> Any:
        """1 + cos psi."""
        return 2 * self.half_cos**2

    @cached_property
    def _sine(self) -> Any:
        """Sine of psi."""
        return 2 * self.half_sin * self.half_cos

    @cached_property
    def _out(self) -> Any:
        """Pin from the rocker's pivot along the frame, d + r cos psi (m)."""
        return (self.d - self.r) + self.r * self._lift

    @cached_property
    def _over(self) -> Any:
        """Rocker's pivot seen from the pin along the crank, r + d cos psi (m)."""
        return (self.r - self.d) + self.d * self._lift

    @cached_property
    def square(self) -> Any:
        """s² = (d - r)² + 4 r d cos²(psi/2), in m²."""
        return (self.d - self.r) ** 2 + 2 * self.r * self.d * self._lift

    @cached_property
    def distance(self) -> Any:
        """Distance s of the pin from the rocker's pivot (m)."""
        return self.ns.sqrt(self.square)

    @cached_property
    def rocker(self) -> Any:
        """Angle of the rocker from +x (rad), continuous: it swings when r < d and turns with the crank when r > d."""
        if self.r < self.d:
            return self.ns.atan2(self.r * self._sine, self._out)
        return self.psi + self.ns.atan2(-self.d * self._sine, self._over)

    @cached_property
    def rocker_sin(self) -> Any:
        """Sine of the rocker's angle, r sin psi / s."""
        return self.r * self._sine / self.distance

    @cached_property
    def rocker_cos(self) -> Any:
        """Cosine of the rocker's angle, (d + r cos psi)/s."""
        return self._out / self.distance

    @cached_property
    def rocker_rate(self) -> Any:
        """d(rocker)/dpsi = r (r + d cos psi)/s²."""
        return self.r * self._over / self.square

    @cached_property
    def rocker_slope(self) -> Any:
        """d²(rocker)/dpsi² = r d (r² - d²) sin psi / s⁴."""
        factor = self.r * self.d * (self.r - self.d) * (self.r + self.d)
        return factor * self._sine / self.square**2

    @cached_property
    def ram(self) -> Any:
        """Displacement of the ram along +y, y = L sin(rocker), in m."""
        return self.length * self.rocker_sin

    @cached_property
    def ram_rate(self) -> Any:
        """dy/d(rocker) = L cos(rocker), in m: the ratio from the rocker."""
        return self.length * self.rocker_cos

    @cached_property
    def ram_slope(self) -> Any:
        """Slope of that ratio, -L sin(rocker) rocker', in m."""
        return -self.ram * self.rocker_rate


def _lengths(mechanism: Mechanism) -> tuple[float, float, float]:
    geometry = mechanism.geometry
    return geometry["crank.length"], geometry["frame.length"], geometry["rocker.length"]


def family(mechanism: Mechanism, parameters: Mapping[str, float]) -> f.Family:
    """Chain of a crank-shaper: crank -> rocker -> ram; the block is on the crank's pin and turns with the rocker."""
    lengths = crank, frame, arm = _lengths(mechanism)
    block, rocker = f.body(mechanism, "block"), f.line("rocker")
    parts = f.joined(
        f.pivoted(f.CRANK, mechanism, "crank"),
        f.point(f.CRANK, "crank.pin", crank, block.mass, "block"),
        f.Parts((f.driven("rocker", True),), f.carried("rocker", block.inertia, "block")),
        f.pivoted(rocker, mechanism, "rocker"),
        f.point(rocker, "rocker.pin", arm, f.body(mechanism, "rocker_pin").mass, "rocker_pin"),
        f.sliding(mechanism, "ram", pi / 2, "rocker"),
    )
    # dead centres of the ram: cos psi = -r/d, the rocker still, or with r > d cos psi = -d/r, the rocker across the stroke
    less, more = min(crank, frame), max(crank, frame)
    beyond = atan2(sqrt((more - less) * (more + less)), -less)
    ends, rocks = f.within_turn((beyond, -beyond)), bool(crank < frame)
    ports = {
        "rocker": f.Port("rocker", attrgetter("rocker"), rocks, dead_centres=ends if rocks else ()),
        "ram": f.Port("ram", attrgetter("ram"), dead_centres=ends),
    }
    # cells shorten where the pin passes close to the rocker's pivot: s = 0 at psi = pi ± i log(d/r)
    return f.Family(*parts, ports, partial(ShaperPosition, *lengths), f.within_turn(f.graded(pi, abs(log(frame / crank)))))


def locks(mechanism: Mechanism) -> list[Fault]:
    """The fault of a crank as long as the frame: its pin meets the rocker's pivot, where the rocker's direction is open."""
    r, d, _ = _lengths(mechanism)
    if not (angles := lock_angles(mechanism)):
        return []
    expected = f"a length other than crank.length = {float(r):.9g} m"
    return [f.lock_fault(f"{mechanism.path}.frame.length", d, expected, angles)]


def lock_angles(mechanism: Mechanism) -> list[float]:
    """Crank angles (rad) at which the pin is at the rocker's pivot, if the crank is as long as the frame."""
    r, d, _ = _lengths(mechanism)
    return [] if f.exceeds(r, d) or f.exceeds(d, r) else [pi]


def skeleton(mechanism: Mechanism, position: ShaperPosition) -> f.Skeleton:
    """Skeleton: the block slides on the rocker; the pin at the rocker's end slides across the ram in a slot of it."""
    crank, frame, rocker = _lengths(mechanism)
    members = {
        "frame": f.Member({"pivot": (frame, 0.0), "rocker_pivot": f.HERE, "guide": f.HERE}),
        "crank": f.Member({"pivot": f.HERE, "crank_pin": (crank, 0.0)}),
        "block": f.Member({"crank_pin": f.HERE, "rocker_slot": f.HERE}, position.rocker),
        "rocker": f.Member({"rocker_pivot": f.HERE, "rocker_slot": f.HERE, "end_pin": (rocker, 0.0)}, position.rocker),
        "rocker_pin": f.Member({"end_pin": f.HERE, "ram_slot": f.HERE}),
        "ram": f.Member({"ram_slot": f.HERE, "guide": f.HERE}),
    }
    joints = (
        f.Pin("pivot", "frame", "crank"),
        f.Pin("crank_pin", "crank", "block"),
        f.Slide("rocker_slot", "rocker", "block", at=position.distance),
        f.Pin("rocker_pivot", "frame", "rocker"),
        f.Pin("end_pin", "rocker", "rocker_pin"),
        f.Slide("ram_slot", "ram", "rocker_pin", at=rocker * position.rocker_cos),
        f.Slide("guide", "frame", "ram", pi / 2, position.ram),
    )
    return members, joints, ()


def derivation(made: f.Derivation) -> None:
    """Loop: d + r cos phi = s cos theta, r sin phi = s sin theta, y = L sin theta."""
    p, phi = made.position, made.driver
    made.equations(f"d + r*cos({phi}) = s*cos(theta)", f"r*sin({phi}) = s*sin(theta)", "L*sin(theta) = y")
    made.part(_("Positions"))
    made.find(
        "s",
        f"sqrt(d**2 + r**2 + 2*d*r*cos({phi}))",
        "m",
        _("Distance of the block from the rocker's pivot"),
        values=p.distance,
    )
    made.angle("theta", f"atan2(r*sin({phi}), d + r*cos({phi}))", _("Angle of the rocker"), float(p.rocker))
    made.find("y", "L*sin(theta)", "m", _("Place of the ram"), values=p.ram)
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("s_prime", f"-(r*sin({phi} - theta))", "m")
    made.find("theta_prime", f"r*cos({phi} - theta)/s", f.ONE, values=p.rocker_rate)
    made.find("y_prime", "L*cos(theta)*theta_prime", "m", values=p.ram_rate * p.rocker_rate)
    made.part(_("Their derivatives g′"))
    made.find("theta_second", "s_prime*(1 - 2*theta_prime)/s", f.ONE, values=p.rocker_slope)
    slope = p.ram_slope * p.rocker_rate + p.ram_rate * p.rocker_slope
    made.find("y_second", "L*cos(theta)*theta_second - L*sin(theta)*theta_prime**2", "m", values=slope)
    made.moves(rocker="theta", ram="y")
    f.block_on_pin(made, "r")
    made.pinned("rocker_pin", _("Pin at the rocker's end"), ("L", "theta", "theta_prime", "theta_second"), "rocker.pin")
    made.pivoted("crank", made.driver, "crank")
    made.pivoted("rocker", "theta", "rocker")


KIND = f.Kind(
    "crank-shaper",
    "a block on the crank pin slides along a rocker, whose end drives a ram",
    family,
    (
        f.CRANK_PART,
        f.Part("frame", "the frame", (length("rocker's pivot to crank's pivot, along +x"),), alias="ground"),
        f.Part("rocker", "turns about a fixed pivot, its first pin", (length("pivot to ram pin"),), BODY),
        f.Part("block", "sits at the crank pin and turns with the rocker", (), (MASS, OWN_INERTIA)),
        f.Part("rocker_pin", "mass at the rocker's end", (), POINT),
        f.Part("ram", "moves along y", (), POINT),
    ),
    ports=(
        f.Displacement("rocker", True, "theta = atan2(r sin phi, d + r cos phi), continuous"),
        f.Displacement("ram", False, "y = L sin theta, positive along +y"),
    ),
    locks=locks,
    skeleton=skeleton,
    guides={"ram": "guide"},
    lock_angles=lock_angles,
    symbols={"crank.length": "r", "frame.length": "d", "rocker.length": "L"},
    derivation=derivation,
    main=("rocker", "guide"),
)
