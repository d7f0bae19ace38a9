"""Slider-crank: a rod from the crank's pin drives a slider along the line y = offset."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from math import pi
from operator import attrgetter
from typing import Any

from flywheel.language import text as _
from flywheel.mechanisms import families as f
from flywheel.numerics.faults import Fault
from flywheel.numerics.jets import atan2, sqrt
from flywheel.scene.scene import BODY, POINT, Key, Mechanism, length


class SliderPosition(f.Position):
    """Positions of a slider-crank with crank r, rod l and offset e (m).

    `height` is that of the crank's pin above the line of travel, h = r sin psi - e; `reach` is the rod's extent along
    that line, q = sqrt(l² - h²) = l cos(rod). Every ratio is relative to the crank; none goes through the rod, which stands
    still at psi = 90 deg.
    """

    def __init__(self, crank: float, rod: float, offset: float, psi: Any, ns: Any, anchor: Any = None) -> None:
        super().__init__(psi, ns)
        self.r, self.l, self.e = crank, rod, offset

    @cached_property
    def height(self) -> Any:
        """Height of the crank's pin above the line of travel, h = r sin psi - e (m)."""
        return self.r * self.sin - self.e

    @cached_property
    def reach(self) -> Any:
        """Extent of the rod along the line of travel, q = l cos(rod), in m.

        With m = r + |e|: q² = (l - m)(l + m) + r² cos² psi + 2 r |e| (1 + sign(e) sin psi). No term is negative, so it
        keeps its digits close to a lock.
        """
        most = self.r + abs(self.e)
        slack = (self.l - self.r) - abs(self.e)  # so ordered, it is exact close to a lock
        square = slack * (self.l + most) + (self.r * self.cos) ** 2
        if self.e != 0:
            half = self.half_cos + self.half_sin if self.e > 0 else self.half_cos - self.half_sin
            square = square + 2 * self.r * abs(self.e) * half**2
        return self.ns.sqrt(square)

    @cached_property
    def rod(self) -> Any:
        """Angle of the rod from +x (rad), from the crank's pin to the slider."""
        return self.ns.atan2(-self.height, self.reach)

    @cached_property
    def rod_sin(self) -> Any:
        """Sine of the rod's angle."""
        return -self.height / self.l

    @cached_property
    def rod_cos(self) -> Any:
        """Cosine of the rod's angle."""
        return self.reach / self.l

    @cached_property
    def rod_rate(self) -> Any:
        """d(rod)/dpsi = -r cos psi / q."""
        return -self.r * self.cos / self.reach

    @cached_property
    def rod_slope(self) -> Any:
        """d²(rod)/dpsi² = (r sin psi - h rod'²)/q."""
        return (self.r * self.sin - self.height * self.rod_rate**2) / self.reach

    @cached_property
    def slider(self) -> Any:
        """Displacement of the slider from the crank's pivot along +x, x = r cos psi + q (m)."""
        return self.r * self.cos + self.reach

    @cached_property
    def slider_rate(self) -> Any:
        """dx/dpsi = r (e cos psi - x sin psi)/q, in m: it keeps its digits at the dead centres."""
        swept = self.slider * self.sin
        if self.e != 0:
            swept = swept - self.e * self.cos
        return -self.r * swept / self.reach

    @cached_property
    def slider_slope(self) -> Any:
        """d²x/dpsi² = -[r (x cos psi + e sin psi) + x' (x' + 2 r sin psi)]/q, in m."""
        along = self.slider * self.cos
        if self.e != 0:
            along = along + self.e * self.sin
        speed = self.slider_rate
        return -(self.r * along + speed * (speed + 2 * self.r * self.sin)) / self.reach


def _lengths(mechanism: Mechanism) -> tuple[float, float, float]:
    geometry = mechanism.geometry
    return geometry["crank.length"], geometry["rod.length"], geometry.get("slider.offset", 0.0)


def family(mechanism: Mechanism, parameters: Mapping[str, float]) -> f.Family:
    """Chain of a slider-crank: rod and slider each straight from the crank, the rod's mass at its centre."""
    r, rod, e = _lengths(mechanism)
    parts = f.joined(
        f.pivoted(f.CRANK, mechanism, "crank"),
        f.point(f.CRANK, "crank.pin", r, 0.0, "crank"),
        f.Parts((f.driven("rod", True),)),
        f.floating(f.line("rod"), mechanism, "rod", r),
        f.sliding(mechanism, "slider", 0.0),
    )
    ends: tuple[float, ...] = ()
    across = (pi / 2, 3 * pi / 2)
    if mechanism.stroke is None:  # crank and rod in one line: sin psi = e/(l + r) stretched, -e/(l - r) folded, cos psi < 0
        stretched = atan2(e, sqrt((rod + r - e) * (rod + r + e)))
        folded = atan2(e, sqrt((rod - r - e) * (rod - r + e)))
        ends = f.within_turn((stretched, pi + folded))
    ports = {
        "slider": f.Port("slider", attrgetter("slider"), dead_centres=ends),
        "rod": f.Port("rod", attrgetter("rod"), dead_centres=across if mechanism.stroke is None else ()),
    }
    # cells shorten where the rod nearly stands across: q = 0 at sin psi = (e ± l)/r, above ±90 deg
    up, down = f.above_one((rod + e) / r), f.above_one((rod - e) / r)
    breakpoints = f.within_turn(f.graded(pi / 2, up) + f.graded(-pi / 2, down))
    return f.Family(*parts, ports, partial(SliderPosition, r, rod, e), breakpoints)


def locks(mechanism: Mechanism) -> list[Fault]:
    """A rod that is not longer than crank + |offset| locks the crank where |r sin psi - e| = l."""
    r, rod, e = _lengths(mechanism)
    most = r + abs(e)
    if f.exceeds(rod, most):
        return []
    expected = f"a rod longer than crank + |offset| = {float(most):.9g} m"
    return [f.lock_fault(f"{mechanism.path}.rod.length", rod, expected, lock_angles(mechanism))]


def lock_angles(mechanism: Mechanism) -> list[float]:
    """Crank angles (rad) at which the rod is perpendicular to the line of travel, |r sin psi - e| = l."""
    r, rod, e = _lengths(mechanism)
    return f.where_sine((e + rod) / r) + f.where_sine((e - rod) / r)


def skeleton(mechanism: Mechanism, position: SliderPosition) -> f.Skeleton:
    """The slider's own origin, at the rod's pin, moves along the line y = offset."""
    crank, rod, offset = _lengths(mechanism)
    members = {
        "frame": f.Member({"pivot": f.HERE, "guide": (0.0, offset)}),
        "crank": f.Member({"pivot": f.HERE, "crank_pin": (crank, 0.0)}),
        "rod": f.Member({"crank_pin": f.HERE, "slider_pin": (rod, 0.0)}, position.rod),
        "slider": f.Member({"slider_pin": f.HERE, "guide": f.HERE}),
    }
    joints = (
        f.Pin("pivot", "frame", "crank"),
        f.Pin("crank_pin", "crank", "rod"),
        f.Pin("slider_pin", "rod", "slider"),
        f.Slide("guide", "frame", "slider", at=position.slider),
    )
    return members, joints, ()


def derivation(made: f.Derivation) -> None:
    """Loop: r cos phi + l cos beta = x, r sin phi + l sin beta = e."""
    p, phi = made.position, made.driver
    offset = bool(made.mechanism.geometry.get("slider.offset"))
    made.equations(f"r*cos({phi}) + l*cos(beta) = x", f"r*sin({phi}) + l*sin(beta) = {'e' if offset else '0'}")
    made.part(_("Positions"))
    made.find(
        "beta",
        f"asin((e - r*sin({phi}))/l)" if offset else f"-asin(r*sin({phi})/l)",
        "°",
        _("Angle of the rod"),
        values=p.rod,
    )
    made.find("x", f"r*cos({phi}) + l*cos(beta)", "m", _("Place of the slider"), values=p.slider)
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("beta_prime", f"-(r*cos({phi}))/(l*cos(beta))", f.ONE, values=p.rod_rate)
    made.find("x_prime", f"-(r*sin({phi})) - l*sin(beta)*beta_prime", "m", values=p.slider_rate)
    made.part(_("Their derivatives g′"))
    made.find("beta_second", f"(r*sin({phi}) + l*sin(beta)*beta_prime**2)/(l*cos(beta))", f.ONE, values=p.rod_slope)
    made.find(
        "x_second", f"-(r*cos({phi})) - l*cos(beta)*beta_prime**2 - l*sin(beta)*beta_second", "m", values=p.slider_slope
    )
    made.moves(rod="beta", slider="x")
    made.pivoted("crank", made.driver, "crank")
    made.floating("rod", "beta", ("r", phi, "1", "0"))


KIND = f.Kind(
    "slider-crank",
    "a crank drives a slider along a straight line through a rod",
    family,
    (
        f.CRANK_PART,
        f.Part("rod", "from the crank pin (its first pin) to the slider", (length("crank pin to slider pin"),), BODY),
        f.Part(
            "slider",
            "moves along the line y = offset",
            (Key("offset", "length", "y of its line of travel", 0.0),),
            POINT,
        ),
    ),
    ports=(
        f.Displacement("slider", False, "x = r cos phi + sqrt(l^2 - (r sin phi - e)^2), positive along +x"),
        f.Displacement("rod", True, "angle of the rod from +x"),
    ),
    locks=locks,
    skeleton=skeleton,
    guides={"slider": "guide"},
    lock_angles=lock_angles,
    symbols={"crank.length": "r", "rod.length": "l", "slider.offset": "e"},
    heights=("slider.offset",),
    derivation=derivation,
    main=("guide",),
)
