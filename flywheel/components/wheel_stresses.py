"""Stresses of wheels that turn: materials, rims on arms, discs of constant width, thin rims.

A rim on arms is a ring of mean radius R that would expand freely by rho v² R/E. Each of n arms of section A1, which under
its own centrifugal force stretches by a third of that, restrains it by a force X. With a = pi/n, half the angle between two
arms, and phi from the middle between them,

    N = rho A v² - X cos(phi)/(2 sin a),  M = X R/2 (cos(phi)/sin a - 1/a),

and X makes their elastic energy least: X = (2/3) rho A v²/C, C = f2 A R²/J + f1 + A/A1, J the second moment of the rim's
section. For a rectangle of radial thickness t, A R²/J = 12 R²/t².

Valid for a thin rim of one material with its arms, which are assumed to reach to the axis; hub and joints are not
weakened. Source: S. Timoshenko, Strength of Materials, part II, rotating ring on spokes. Handbooks print f1 and 12 f2
rounded for 4, 6 and 8 arms (0.643 and 0.07296, 0.957 and 0.02028, 1.274 and 0.00912; the last one should be 0.00832),
often without the R² beside t², which then holds only for R = 1 m: so in Jindal, Machine Design, example 19-1, where R is 1.2
m and the stress of the arms is 7 % too high.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

from flywheel.numerics.faults import POSITIVE, Fault, SceneError, entry, fits, number_faults, refuse

POISSON = 0.3
"""Poisson's ratio where a material names none: that of steel."""


class Material(NamedTuple):
    """Material of a wheel.

    `density` in kg/m³; `allowable` stress in Pa, None if there is no limit; `strength` in Pa (tensile strength of a
    brittle material, yield strength of a ductile one), to which the safety factor refers if known; `poisson` of
    the lateral strain; `rim_speed` in m/s up to which rims of it usually run, None if unknown.
    """

    name: str
    density: float
    allowable: float | None = None
    strength: float | None = None
    poisson: float = POISSON
    rim_speed: float | None = None
    about: str = ""

    @property
    def reference(self) -> float | None:
        """The stress that a safety factor refers to, Pa: the strength, or the allowable stress if only that is known."""
        return self.strength if self.strength is not None else self.allowable


MATERIALS = {
    name: Material(name, density, strength / factor, strength, poisson, rim_speed, about)
    for name, density, strength, factor, poisson, rim_speed, about in (
        ("grey cast iron", 7200.0, 115e6, 10.0, 0.26, 30.0, "EN-GJL-200, as expected in a wall of 80 mm (EN 1561)"),
        ("ductile iron", 7100.0, 250e6, 4.0, 0.275, None, "EN-GJS-400-15, proof stress (EN 1563)"),
        ("cast steel", 7800.0, 240e6, 4.0, 0.3, 40.0, "GE240, proof stress (EN 10293)"),
        ("carbon steel", 7850.0, 305e6, 4.0, 0.3, 40.0, "C45 normalised, 16 to 100 mm, yield strength (EN 10083-2)"),
        ("alloy steel", 7850.0, 650e6, 4.0, 0.3, None, "42CrMo4 tempered, 40 to 100 mm, yield strength (EN 10083-3)"),
        ("aluminium", 2700.0, 240e6, 4.0, 0.33, None, "EN AW-6082-T6 plate, 12.5 to 100 mm, proof stress (EN 485-2)"),
    )
}
"""Usual metals by name.

Strengths are least values of the standards. The allowable stress is a tenth of the tensile strength of grey iron (the
factor that Machinery's Handbook asks of cast wheels) and a quarter of the yield strength of ductile metals, which is this
table's own choice for a stress that comes and goes at every start. Rim speeds: Machinery's Handbook has 6000 ft/min for
cast iron; 40 m/s for steel is old custom, which stress outdates. Give values of your own where you have better ones.
"""


def material(
    name: str = "",
    density: float | None = None,
    allowable: float | None = None,
    strength: float | None = None,
    safety: float | None = None,
    poisson: float | None = None,
) -> Material:
    """A material of the table, of own values, or of the table with some values replaced.

    Args:
        name: of the table; empty for a material of own values, which needs a density.
        density: kg/m³.
        allowable: allowable stress, Pa.
        strength: Pa, to which the safety factor refers.
        safety: required factor: the allowable stress is strength over it.
        poisson: Poisson's ratio, 0 to 0.5.

    Raises:
        SceneError: if the name is unknown, a number is out of range, the density is missing, or the allowable stress is
            given twice (as such, and as a safety factor).

    >>> material("carbon steel").allowable, material("carbon steel", safety=5.0).allowable
    (76250000.0, 61000000.0)
    >>> material(density=7200.0, allowable=7.5e6).poisson
    0.3

    """
    values = {"density": density, "allowable_stress": allowable, "strength": strength, "safety": safety}
    faults = [fault for key, value in values.items() if value is not None for fault in number_faults(key, value, POSITIVE)]
    if poisson is not None and (number_faults("poisson", poisson) or not 0.0 <= poisson <= 0.5):
        faults.append(Fault("poisson", f"{poisson}", "a number from 0 to 0.5"))
    refuse(faults)
    base = entry("material", name, MATERIALS) if name else Material("own material", density or 0.0)
    if density is None and not name:
        faults.append(Fault("material", "neither material nor density", "one of them", f"known: {', '.join(MATERIALS)}"))
    own = strength or base.strength
    if safety is not None and allowable is not None:
        advice = "the allowable stress is strength over safety"
        faults.append(Fault("safety", "safety and allowable_stress", "one of them", advice))
    elif safety is not None and own is None:
        faults.append(Fault("safety", "a safety factor without a strength", "a strength with it"))
    refuse(faults)
    if allowable is None and own is not None:  # by the required factor, or the one that is usual for that material
        usual = None if base.allowable is None or base.strength is None else base.allowable / base.strength
        allowable = own / safety if safety is not None else None if usual is None else own * usual
    return base._replace(
        density=base.density if density is None else density,
        allowable=allowable,
        strength=own,
        poisson=base.poisson if poisson is None else poisson,
    )


FEWEST, MOST = 3, 100
"""Numbers of arms that a wheel may have."""


class Arms(NamedTuple):
    """Straight arms of elliptical section: number, the ellipse's axis in the plane of rotation, its axis across (m)."""

    number: int
    width: float
    thickness: float

    @property
    def area(self) -> float:
        """Area of one arm's section, pi/4 w t, m²."""
        return pi / 4 * self.width * self.thickness

    @property
    def modulus(self) -> float:
        """Section modulus in the plane of rotation, pi/32 w² t, m³."""
        return pi / 32 * self.width**2 * self.thickness


def ring_factors(count: int) -> tuple[float, float]:
    """f1 and f2 of a ring on arms: f1 = (sin(2a)/4 + a/2)/(2 sin² a), f2 = f1 - 1/(2a), a = pi/n.

    Args:
        count: n, number of arms.

    Raises:
        SceneError: if it is no whole number from 3 to 100.

    >>> [round(f, 5) for f in ring_factors(6)]
    [0.95661, 0.00168]

    """
    _check_count(count)
    a = pi / count
    if count > 20:  # f2 by its series: the difference loses its digits
        f2 = sum(c * a ** (2 * k + 3) for k, c in enumerate((1 / 90, 2 / 945, 1 / 3150, 4 / 93555, 691 / 127702575)))
        return f2 + 1 / (2 * a), f2
    f1 = (sin(2 * a) / 4 + a / 2) / (2 * sin(a) ** 2)
    return f1, f1 - 1 / (2 * a)


def ring_constant(count: int, radius: float, thickness: float, area_ratio: float) -> float:
    """C = 12 f2 R²/t² + f1 + A/A1 of a rim of rectangular section on arms.

    Args:
        count: n, number of arms.
        radius: R, mean radius of the rim, m.
        thickness: t, radial thickness of the rim, m.
        area_ratio: A/A1, the rim's section over an arm's.

    >>> round(ring_constant(6, 1.2, 0.15, 4.0), 6)
    6.248248

    """
    f1, f2 = ring_factors(count)
    return 12 * f2 * (radius / thickness) ** 2 + f1 + area_ratio


def rim_on_arms(
    density: float,
    velocity: float,
    count: int,
    radius: float,
    thickness: float,
    area_ratio: float,
    constant: float | None = None,
) -> tuple[float, float, float]:
    """Stresses (Pa) of a rim on arms: in an arm (2/3) rho v² (A/A1)/C, in the rim N/A + |M| t/(2 J).

    That of an arm is by the rim's pull; those of the rim are at an arm, and midway between two.

    sigma(phi) = rho v² (1 - cos(phi)/(3 C sin a) + 2 R/(C t) |1/a - cos(phi)/sin a|).

    Args:
        density: rho, kg/m³.
        velocity: v of the rim's mean radius, m/s.
        count: n, number of arms.
        radius: R, mean radius of the rim, m.
        thickness: t, radial thickness of the rim, m.
        area_ratio: A/A1, the rim's section over an arm's.
        constant: C, `ring_constant` if None.

    Raises:
        SceneError: if the number of arms is out of range.

    Validity and source: see the module.

    >>> printed = 12 * 0.00169 / 0.15**2 + 0.957 + 4.0  # Jindal, example 19-1, without R²
    >>> book = rim_on_arms(7100.0, 20 * pi, 6, 1.2, 0.15, 4.0, printed)
    >>> [round(stress / 1e6, 2) for stress in book]
    [12.76, 38.88, 31.74]
    >>> [round(stress / 1e6, 2) for stress in rim_on_arms(7100.0, 20 * pi, 6, 1.2, 0.15, 4.0)]
    [11.96, 38.2, 31.51]

    """
    c = ring_constant(count, radius, thickness, area_ratio) if constant is None else constant
    _check_count(count)
    a, hoop = pi / count, density * velocity**2

    def rim(phi: float) -> float:
        bending = 2 * radius / (c * thickness) * abs(1 / a - cos(phi) / sin(a))
        return hoop * (1 - cos(phi) / (3 * c * sin(a)) + bending)

    return 2 / 3 * hoop * area_ratio / c, rim(a), rim(0.0)


def arm_bending(torque: float, count: int, radius: float, hub_radius: float, modulus: float) -> float:
    """Bending stress (Pa) in the arms at the hub, under a torque from hub to rim: T (R - r)/(R n Z).

    Args:
        torque: T between hub and rim, N m: the rim's inertia times its angular acceleration.
        count: n, number of arms, which share it evenly.
        radius: R, mean radius of the rim, m.
        hub_radius: r, m.
        modulus: Z of one arm's section in the plane of rotation, m³ (`Arms.modulus`).

    Valid for arms that are fixed at the hub and free to turn at the rim.
    Source: Khurmi and Gupta, Machine Design, chapter 22.

    >>> round(arm_bending(1000.0, 6, 1.0, 0.1, Arms(6, 0.1, 0.05).modulus))
    3055775

    """
    return torque * (radius - hub_radius) / (radius * count * modulus)


def arm_pull(density: float, speed: float, radius: float, hub_radius: float) -> float:
    """Stress (Pa) in an arm at the hub by its own centrifugal force: rho w² (r² - r_h²)/2.

    Args:
        density: rho, kg/m³.
        speed: w, rad/s.
        radius: r, where the arm ends at the rim, m.
        hub_radius: r_h, m.

    Valid for a straight arm of constant section. Source: equilibrium of the arm beyond the hub.

    >>> round(arm_pull(7200.0, 50.0, 0.9, 0.1))
    7200000

    """
    return density * speed**2 * (radius**2 - hub_radius**2) / 2


def _check_count(count: int) -> None:
    if not fits(count) or count != int(count) or not FEWEST <= count <= MOST:
        raise SceneError([Fault("arms", f"{count}", f"a whole number from {FEWEST} to {MOST}")])


def annulus_mass(outer: float, inner: float, width: float, density: float) -> float:
    """Mass (kg) of a disc with a hole: m = pi rho b (R² - r²).

    Args:
        outer: R, m.
        inner: r of the hole, m; 0 for a solid disc.
        width: b along the axis, m.
        density: rho, kg/m³.

    >>> round(annulus_mass(0.2, 0.0, 0.00693612824906, 7800.0), 6)
    6.798633

    """
    return pi * density * width * (outer - inner) * (outer + inner)


def annulus_inertia(outer: float, inner: float, width: float, density: float) -> float:
    """Inertia (kg m²) about its axis: I = pi rho b (R⁴ - r⁴)/2 = m (R² + r²)/2.

    Args:
        outer: R, m.
        inner: r of the hole, m; 0 for a solid disc.
        width: b along the axis, m.
        density: rho, kg/m³.

    >>> round(annulus_inertia(0.2, 0.0, 0.00693612824906, 7800.0), 9)
    0.135972655

    """
    return annulus_mass(outer, inner, width, density) * (outer * outer + inner * inner) / 2


def greatest_disc_stress(outer: float, inner: float, density: float, omega: float, nu: float) -> float:
    """The greatest stress (Pa) in a rotating disc: the hoop stress in its centre, or at the edge of its hole.

    Solid: (3 + nu)/8 rho (w R)². With a hole, however small: rho w²/4 ((3 + nu) R² + (1 - nu) r²), at least twice as much.

    Args:
        outer: R, m.
        inner: r, m; 0 for a solid disc.
        density: rho, kg/m³.
        omega: w, rad/s.
        nu: Poisson's ratio.

    Valid for a disc of constant width that is thin along its axis (plane stress), elastic, and free at its edges.
    Source: S. Timoshenko, Strength of Materials, part II, rotating disc of uniform thickness.

    >>> round(greatest_disc_stress(0.3639023457535473, 0.0, 7800.0, 250 * pi / 30, 0.3), 6)  # Jindal, example 19-5
    292028.689197

    """
    if inner <= 0.0:
        return (3 + nu) / 8 * density * (omega * outer) ** 2
    return density * omega * omega / 4 * ((3 + nu) * outer * outer + (1 - nu) * inner * inner)


def hoop_stress(velocity: float, density: float) -> float:
    """Hoop stress (Pa) in a thin ring at a speed: sigma = rho v².

    Args:
        velocity: v of its mean radius, m/s.
        density: rho, kg/m³.

    Valid for a thin ring without restraint from inside. Source: Khurmi and Gupta, Theory of Machines, section 16.13.

    >>> hoop_stress(25.0, 7200.0)
    4500000.0

    """
    return density * velocity * velocity


DISC, RIM, ARMS, LIGHTEST = "disc", "rim", "arms", "lightest"

WHEEL_SHAPES = (DISC, RIM, ARMS, LIGHTEST)

EXACT, THIN = "exact", "thin"

METHODS = (EXACT, THIN)

GREATEST, MEAN = "greatest", "mean"

SPEEDS = (GREATEST, MEAN)

RATIO, COUNT, ARM_SHARE, ASPECT, HUB_RATIO = 2.0, 6, 0.25, 0.5, 2.0
"""Usual proportions, for what is not given: width to thickness of a rim; number of arms; section of an arm over that of
the rim; axes of an arm's section; diameter of a hub over its bore.

Source: Khurmi and Gupta, Machine Design, chapter 22 (rim twice as wide as thick, hub twice the shaft, arms half as thick as
wide); Jindal, Machine Design, example 19-1 (6 arms of a quarter of the rim's section).
"""


class WheelAsked(NamedTuple):
    """A wheel as far as it is specified, SI. Values of None are computed, or have a usual proportion (see the module).

    `method` is `exact` (an annulus), or `thin` (a rim at its mean radius). `at` is the speed of the shaft for which the
    wheel is sized: the greatest or the mean. `rim_speed` is that of the outer radius, for a thin rim of the mean one.
    `rim_share` is the share of the inertia that the rim has, if hub and arms are not modelled. `torque` is the greatest
    one between hub and rim. `step` and `size_step` are those to which inertia and dimensions are rounded up. `path` is that
    of these values in a scene, for messages.
    """

    shape: str
    material: Material
    method: str = EXACT
    at: str = GREATEST
    outer_radius: float | None = None
    mean_radius: float | None = None
    max_radius: float | None = None
    rim_speed: float | None = None
    width: float | None = None
    thickness: float | None = None
    width_to_thickness: float | None = None
    rim_share: float | None = None
    arms: int | None = None
    arm_share: float | None = None
    arm_width: float | None = None
    arm_thickness: float | None = None
    bore: float | None = None
    hub_diameter: float | None = None
    hub_length: float | None = None
    torque: float | None = None
    step: float | None = None
    size_step: float | None = None
    path: str = ""

    @property
    def thin(self) -> bool:
        """Tests whether the rim counts as running at its mean radius."""
        return self.method == THIN

    @property
    def hub_radius(self) -> float:
        """Radius of the hub, m; of the bore in a disc; 0 without either."""
        bore = self.bore or 0.0
        if self.shape == DISC:
            return bore / 2
        return (HUB_RATIO * bore if self.hub_diameter is None else self.hub_diameter) / 2

    def present(self, names: tuple[str, ...]) -> list[str]:
        """The members of `names` that have a value."""
        return [name for name in names if getattr(self, name) is not None]

    def at_key(self, name: str) -> str:
        """Path of one quantity, for a fault."""
        return f"{self.path}.{name}" if self.path else name
