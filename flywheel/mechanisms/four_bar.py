"""Four-bar: crank, coupler and rocker on a ground line from the crank's pivot to the rocker's, along +x."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from math import pi
from operator import attrgetter
from typing import Any, NamedTuple

from flywheel.language import text as _
from flywheel.mechanisms import families as f
from flywheel.numerics.faults import Fault
from flywheel.numerics.jets import atan2, sqrt
from flywheel.scene.scene import BODY, Key, Mechanism, length


class FourBarLengths(NamedTuple):
    """Lengths (m) of a four-bar, and `side`: +1 open (the joint lies left of crank pin -> rocker pivot), -1 crossed."""

    ground: float
    crank: float
    coupler: float
    rocker: float
    side: int


class FourBarPosition(f.Position):
    """Positions of a four-bar with ground d, crank r, coupler c and rocker L (m).

    The diagonal D from the rocker's pivot to the crank's pin gives a triangle of positive area: 4 x its area,
    `area4`, is K. Angles are continuous in psi and lie in (-pi, pi] at psi = 0.
    """

    def __init__(self, bars: FourBarLengths, psi: Any, ns: Any, anchor: Any = None) -> None:
        super().__init__(psi, ns)
        self.d, self.r, self.c, self.L, self.side = bars

    @cached_property
    def _drop(self) -> Any:
        """4 d r sin²(psi/2) = D² - (d - r)²."""
        return 4 * self.d * self.r * self.half_sin**2

    @cached_property
    def square(self) -> Any:
        """D² = (d - r)² + 4 d r sin²(psi/2), in m²."""
        return (self.d - self.r) ** 2 + self._drop

    @cached_property
    def area4(self) -> Any:
        """K = sqrt[((D + L)² - c²)(c² - (D - L)²)], Heron's form, in m².

        Each factor is a gap of the lengths at psi = 0 or 180 deg plus the change of D since, never a
        difference, so that K keeps its digits close to a change point.
        """
        d, r, c, L = self.d, self.r, self.c, self.L
        near, uneven = abs(d - r), c - L
        spare = (max(c, L) - max(d, r)) + (min(c, L) - min(d, r))  # c + L - d - r: so ordered, it hardly rounds
        diagonal = self.ns.sqrt(self.square)
        grown = self._drop / (diagonal + near)
        left = 4 * d * r * self.half_cos**2 / (diagonal + (d + r))
        least = ((near - uneven) + grown) * ((near + uneven) + grown)
        return self.ns.sqrt(least * (spare + left) * (diagonal + (L + c)))

    @cached_property
    def _across(self) -> Any:
        """Diagonal across the crank, d sin psi (m)."""
        return 2 * self.d * self.half_sin * self.half_cos

    @cached_property
    def _along(self) -> Any:
        """Diagonal along the crank, r - d cos psi (m)."""
        return (self.r - self.d) + 2 * self.d * self.half_sin**2

    @cached_property
    def _at_coupler(self) -> Any:
        """D² + c² - L² = 2 D c cos(angle at the crank's pin), in m²."""
        return self.square + (self.c - self.L) * (self.c + self.L)

    @cached_property
    def _at_rocker(self) -> Any:
        """D² + L² - c² = 2 D L cos(angle at the rocker's pivot), in m²."""
        return self.square + (self.L - self.c) * (self.L + self.c)

    @cached_property
    def _at_joint(self) -> Any:
        """L² + c² - D² = 2 L c cos(transmission angle), in m²."""
        return self.L**2 + self.c**2 - self.square

    @cached_property
    def _diagonal_angle(self) -> Any:
        """Continuous angle (rad): of pin -> rocker's pivot if d > r, of rocker's pivot -> pin if r > d."""
        if self.d > self.r:
            across = 2 * self.r * self.half_sin * self.half_cos
            return self.ns.atan2(-across, (self.d - self.r) + 2 * self.r * self.half_sin**2)
        return self.psi + self.ns.atan2(self._across, self._along)

    @cached_property
    def coupler(self) -> Any:
        """Angle of the coupler from +x (rad), from the crank's pin to the joint."""
        if self.d > self.r:
            return self._diagonal_angle + self.side * self.ns.atan2(self.area4, self._at_coupler)
        return self._diagonal_angle - self.side * self.ns.atan2(self.area4, -self._at_coupler)

    @cached_property
    def rocker(self) -> Any:
        """Angle of the rocker from +x (rad), from its pivot to the joint."""
        if self.d > self.r:
            return self._diagonal_angle + self.side * self.ns.atan2(self.area4, -self._at_rocker)
        return self._diagonal_angle - self.side * self.ns.atan2(self.area4, self._at_rocker)

    coupler_sin, coupler_cos = f.sine("coupler"), f.cosine("coupler")
    rocker_sin, rocker_cos = f.sine("rocker"), f.cosine("rocker")

    @cached_property
    def _sway(self) -> Any:
        """± d sin psi / K (1/m)."""
        return self.side * self._across / self.area4

    @cached_property
    def _pull(self) -> Any:
        """r/D² (1/m)."""
        return self.r / self.square

    @cached_property
    def rocker_rate(self) -> Any:
        """d(rocker)/dpsi = r [r - d cos psi ± d sin psi (D² + c² - L²)/K]/D²."""
        return self._pull * (self._along + self._sway * self._at_coupler)

    @cached_property
    def coupler_rate(self) -> Any:
        """d(coupler)/dpsi = r [r - d cos psi ∓ d sin psi (D² + L² - c²)/K]/D²."""
        return self._pull * (self._along - self._sway * self._at_rocker)

    @cached_property
    def rocker_slope(self) -> Any:
        """Second derivative of the rocker's angle, from the loop's acceleration along the coupler.

        theta'' = [± (2 c² chi'² - (L² + c² - D²) theta'² - r (r - d cos psi)(D² + c² - L²)/D²)/K] + r d sin psi/D².
        """
        turning = 2 * self.c**2 * self.coupler_rate**2 - self._at_joint * self.rocker_rate**2
        carried = self._pull * self._along * self._at_coupler
        return self.side * (turning - carried) / self.area4 + self._pull * self._across

    @cached_property
    def coupler_slope(self) -> Any:
        """Second derivative of the coupler's angle, from the loop's acceleration along the rocker.

        chi'' = [± ((L² + c² - D²) chi'² - 2 L² theta'² + r (r - d cos psi)(D² + L² - c²)/D²)/K] + r d sin psi/D².
        """
        turning = self._at_joint * self.coupler_rate**2 - 2 * self.L**2 * self.rocker_rate**2
        carried = self._pull * self._along * self._at_rocker
        return self.side * (turning + carried) / self.area4 + self._pull * self._across


def _bars(mechanism: Mechanism) -> FourBarLengths:
    ground, crank, coupler, rocker = (
        mechanism.geometry[f"{bar}.length"] for bar in ("ground", "crank", "coupler", "rocker")
    )
    return FourBarLengths(ground, crank, coupler, rocker, -1 if mechanism.assembly == "crossed" else 1)


def family(mechanism: Mechanism, parameters: Mapping[str, float]) -> f.Family:
    """Chain of a four-bar: coupler and rocker each directly from the crank, the coupler's mass at its centre."""
    bars = _bars(mechanism)
    parts = f.joined(
        f.pivoted(f.CRANK, mechanism, "crank"),
        f.point(f.CRANK, "crank.pin", bars.crank, 0.0, "crank"),
        f.Parts((f.driven("coupler", True), f.driven("rocker", True))),
        f.floating(f.line("coupler"), mechanism, "coupler", bars.crank),
        f.pivoted(f.line("rocker"), mechanism, "rocker"),
        f.point(f.line("rocker"), "rocker.pin", bars.rocker, 0.0, "rocker"),
    )
    returns = bool(bars.ground > bars.crank)  # otherwise a drag-link: all bars turn with the crank
    ends = _dead_centres(bars) if returns and mechanism.stroke is None else ()
    ports = {
        "coupler": f.Port("coupler", attrgetter("coupler"), returns),
        "rocker": f.Port("rocker", attrgetter("rocker"), returns, dead_centres=ends),
    }
    # cells shorten close to change points: K = 0 at D = |c - L|, above psi = 0, and at D = c + L, above psi = pi
    near = f.above_one(_cosine(bars, bars.coupler - bars.rocker))
    far = f.above_one(-_cosine(bars, bars.coupler + bars.rocker))
    return f.Family(*parts, ports, partial(FourBarPosition, bars), f.within_turn(f.graded(0.0, near) + f.graded(pi, far)))


def _cosine(bars: FourBarLengths, diagonal: float) -> float:
    """Cosine of the crank angle at which the diagonal has this length (m)."""
    return (bars.ground**2 + bars.crank**2 - diagonal**2) / (2 * bars.ground * bars.crank)


def _dead_centres(bars: FourBarLengths) -> tuple[float, ...]:
    """Dead centres of a swinging rocker: crank and coupler in one line from the crank's pivot to the joint, c ± r apart.

    That line stands at beta from the ground: tan²(beta/2) = (L² - (d - m)²)/((d + m)² - L²), m = c ± r.
    """
    d, r, c, L, side = bars

    def angle(m: float) -> float:
        return 2 * side * atan2(sqrt((L - d + m) * (L + d - m)), sqrt((d + m - L) * (d + m + L)))

    return f.within_turn((angle(c + r), pi + angle(c - r)))


def locks(mechanism: Mechanism) -> list[Fault]:
    """The crank turns fully only if |c - L| < |d - r| and d + r < c + L; it locks where D leaves that range.

    The fault names the bar to change, its length, and the lengths with which the crank would turn.
    """
    bars, path = _bars(mechanism), mechanism.path
    ground, crank, coupler, rocker, _ = bars
    slack, shorter = abs(ground - crank), min(ground, crank)
    if f.exceeds(coupler + rocker, ground + crank) and f.exceeds(slack + min(coupler, rocker), max(coupler, rocker)):
        return []
    angles = lock_angles(mechanism)
    if not f.exceeds(ground, crank) and not f.exceeds(crank, ground):
        expected = f"a length other than ground.length = {float(ground):.9g} m"
        return [f.lock_fault(f"{path}.crank.length", crank, expected, angles)]
    if not f.exceeds(rocker, shorter):
        return [f.lock_fault(f"{path}.rocker.length", rocker, f"more than {float(shorter):.9g} m", angles)]
    least = max(ground + crank - rocker, rocker - slack)
    expected = f"between {float(least):.9g} and {float(rocker + slack):.9g} m"
    return [f.lock_fault(f"{path}.coupler.length", coupler, expected, angles)]


def lock_angles(mechanism: Mechanism) -> list[float]:
    """Crank angles (rad) at which coupler and rocker are in line, D = |c - L| or D = c + L."""
    bars = _bars(mechanism)
    cosines = _cosine(bars, bars.coupler - bars.rocker), _cosine(bars, bars.coupler + bars.rocker)
    return [angle for cosine in cosines for angle in f.where_cosine(cosine)]


def skeleton(mechanism: Mechanism, position: FourBarPosition) -> f.Skeleton:
    """Coupler from the crank's pin, rocker from its pivot; the side of their joint is that of the assembly."""
    bars = _bars(mechanism)
    members = {
        "frame": f.Member({"pivot": f.HERE, "rocker_pivot": (bars.ground, 0.0)}),
        "crank": f.Member({"pivot": f.HERE, "crank_pin": (bars.crank, 0.0)}),
        "coupler": f.Member({"crank_pin": f.HERE, "rocker_pin": (bars.coupler, 0.0)}, position.coupler),
        "rocker": f.Member({"rocker_pivot": f.HERE, "rocker_pin": (bars.rocker, 0.0)}, position.rocker),
    }
    joints = (
        f.Pin("pivot", "frame", "crank"),
        f.Pin("crank_pin", "crank", "coupler"),
        f.Pin("rocker_pin", "coupler", "rocker"),
        f.Pin("rocker_pivot", "frame", "rocker"),
    )
    side = ("coupler", "rocker_pin"), ("crank", "crank_pin"), ("frame", "rocker_pivot"), bars.side
    return members, joints, (side,)


def derivation(made: f.Derivation) -> None:
    """Loop: r cos phi + c cos chi = d + L cos theta, r sin phi + c sin chi = L sin theta."""
    p, phi, side = made.position, made.driver, "-" if made.mechanism.assembly != "crossed" else "+"
    made.equations(
        f"r*cos({phi}) + c*cos(chi) = d + L*cos(theta)",
        f"r*sin({phi}) + c*sin(chi) = L*sin(theta)",
    )
    made.part(_("Positions, by the diagonal D from the rocker's pivot to the crank's pin"))
    made.find("D", f"sqrt(d**2 + r**2 - 2*d*r*cos({phi}))", "m", _("Length of the diagonal"))
    made.find("delta", f"atan2(r*sin({phi}), r*cos({phi}) - d)", "°", _("Angle of the diagonal"))
    made.find(
        "rho", "acos((D**2 + L**2 - c**2)/(2*D*L))", "°", _("Angle between diagonal and rocker, by the law of cosines")
    )
    made.angle("theta", f"delta {side} rho", _("Angle of the rocker"), float(p.rocker))
    made.angle(
        "chi",
        f"atan2(L*sin(theta) - r*sin({phi}), d + L*cos(theta) - r*cos({phi}))",
        _("Angle of the coupler"),
        float(p.coupler),
    )
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("theta_prime", f"r*sin({phi} - chi)/(L*sin(theta - chi))", f.ONE, values=p.rocker_rate)
    made.find("chi_prime", f"r*sin({phi} - theta)/(c*sin(theta - chi))", f.ONE, values=p.coupler_rate)
    made.part(_("Their derivatives g′"))
    across = f"(r*cos({phi} - chi) + c*chi_prime**2 - L*cos(theta - chi)*theta_prime**2)/(L*sin(theta - chi))"
    made.find("theta_second", across, f.ONE, values=p.rocker_slope)
    across = f"(r*cos({phi} - theta) + c*cos(theta - chi)*chi_prime**2 - L*theta_prime**2)/(c*sin(theta - chi))"
    made.find("chi_second", across, f.ONE, values=p.coupler_slope)
    made.moves(coupler="chi", rocker="theta")
    made.pivoted("crank", made.driver, "crank")
    made.floating("coupler", "chi", ("r", phi, "1", "0"))
    made.pivoted("rocker", "theta", "rocker")


KIND = f.Kind(
    "four-bar",
    "a crank and a rocker on fixed pivots, joined by a coupler",
    family,
    (
        f.Part("ground", "the frame", (length("crank pivot to rocker pivot, along +x"),), alias="frame"),
        f.CRANK_PART,
        f.Part("coupler", "from the crank pin (its first pin) to the rocker", (length("between its pins"),), BODY),
        f.Part("rocker", "turns about a fixed pivot, its first pin", (length("pivot to coupler pin"),), BODY),
    ),
    (
        Key(
            "assembly",
            "choice",
            "side of the line crank pin - rocker pivot where the coupler-rocker pin lies: open left, crossed right",
            "open",
            choices=("open", "crossed"),
        ),
    ),
    (
        f.Displacement("coupler", True, "angle from +x of the line from the crank pin to the rocker pin"),
        f.Displacement("rocker", True, "angle from +x of the line from the rocker's pivot to its pin"),
    ),
    locks,
    skeleton,
    lock_angles=lock_angles,
    symbols={"ground.length": "d", "crank.length": "r", "coupler.length": "c", "rocker.length": "L"},
    derivation=derivation,
    main=("rocker",),
)
