"""A rim on arms: what the arms take off the rim's hoop stress, how the rim bends between them, the arms themselves.

The rim is a ring of mean radius R that wants to grow by rho v² R/E. Each of n arms of section A1, which under its own
pull grows by a third of that, holds it back by a force X. With a = pi/n, half the angle between two arms, and phi from the
middle between them,

    N = rho A v² - X cos(phi)/(2 sin a),  M = X R/2 (cos(phi)/sin a - 1/a),

and X makes their elastic energy least: X = (2/3) rho A v²/C, C = f2 A R²/J + f1 + A/A1, J the second moment of the rim's
section. For a rectangle of radial thickness t, A R²/J = 12 R²/t².

Valid for a thin rim of one material with its arms, which are taken as reaching to the axis; hub and joints are not weakened.
Source: S. Timoshenko, Strength of Materials, part II, rotating ring on spokes. Handbooks print f1 and 12 f2 rounded for 4, 6
and 8 arms (0.643 and 0.07296, 0.957 and 0.02028, 1.274 and 0.00912; the last one should be 0.00832), often without the
R² beside t², which then holds for R = 1 m alone: so in Jindal, Machine Design, example 19-1, where R is 1.2 m and the
stress of the arms comes out 7 % too high.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

from flywheel.arguments import fits
from flywheel.faults import Fault, SceneError

FEWEST, MOST = 3, 100
"""How many arms a wheel may have."""

_PRINTED = {4: (0.643, 0.00608), 6: (0.957, 0.00169), 8: (1.274, 0.00076)}


class Arms(NamedTuple):
    """Straight arms of elliptical section: how many, the ellipse's axis in the plane of rotation, its axis across (m)."""

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


class RimOnArms(NamedTuple):
    """Stresses (Pa) of a rim on arms: in an arm by the rim's pull, in the rim at an arm and midway between two."""

    arm: float
    rim_at_arm: float
    rim_between: float

    @property
    def greatest(self) -> float:
        """The greatest of them, Pa."""
        return max(self)


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
        return _f2_series(a) + 1 / (2 * a), _f2_series(a)
    f1 = (sin(2 * a) / 4 + a / 2) / (2 * sin(a) ** 2)
    return f1, f1 - 1 / (2 * a)


def _f2_series(a: float) -> float:
    return sum(c * a ** (2 * k + 3) for k, c in enumerate((1 / 90, 2 / 945, 1 / 3150, 4 / 93555, 691 / 127702575)))


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


def printed_constant(count: int, thickness: float, area_ratio: float, radius: float = 1.0) -> float:
    """C as handbooks print it, with rounded factors: for 6 arms 20280 R²/t² + 0.957 + A/A1, t in mm, R in m.

    Args:
        count: 4, 6 or 8 arms.
        thickness: t, radial thickness of the rim, m.
        area_ratio: A/A1.
        radius: R, m; 1 where a book leaves R² out.

    Raises:
        SceneError: for another number of arms.

    Source: Jindal, Machine Design, example 19-1 (without R²). `ring_constant` is the exact one.

    >>> round(printed_constant(6, 0.15, 4.0), 6)
    5.858333

    """
    if count not in _PRINTED:
        raise SceneError([Fault("count", f"{count}", "4, 6 or 8 arms")])
    f1, f2 = _PRINTED[count]
    return 12 * f2 * (radius / thickness) ** 2 + f1 + area_ratio


def rim_on_arms(
    density: float,
    velocity: float,
    count: int,
    radius: float,
    thickness: float,
    area_ratio: float,
    constant: float | None = None,
) -> RimOnArms:
    """Stresses (Pa) of a rim on arms: in an arm (2/3) rho v² (A/A1)/C, in the rim N/A + |M| t/(2 J).

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

    >>> book = rim_on_arms(7100.0, 20 * pi, 6, 1.2, 0.15, 4.0, printed_constant(6, 0.15, 4.0))  # Jindal, example 19-1
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

    return RimOnArms(2 / 3 * hoop * area_ratio / c, rim(a), rim(0.0))


def lanza_stress(density: float, velocity: float, count: int, radius: float, thickness: float) -> float:
    """Stress (Pa) in a rim on arms by Lanza's rule: rho v² (0.75 + pi² R/(2 n² t)).

    Three quarters of the free rim's hoop stress, and a quarter of the bending stress, 2 pi² rho v² R/(n² t), of a beam that
    is fixed at two arms. A rule, not a theory; `rim_on_arms` is one.

    Args:
        density: rho, kg/m³.
        velocity: v of the rim's mean radius, m/s.
        count: n, number of arms.
        radius: R, mean radius of the rim, m.
        thickness: t, radial thickness of the rim, m.

    Source: Khurmi and Gupta, Machine Design, chapter 22, after G. Lanza.

    >>> round(lanza_stress(7100.0, 20 * pi, 6, 1.2, 0.15) / 1e6, 3)
    51.76

    """
    return density * velocity**2 * (0.75 + pi**2 / 2 * radius / (count**2 * thickness))


def arm_bending(torque: float, count: int, radius: float, hub_radius: float, modulus: float) -> float:
    """Bending stress (Pa) in the arms at the hub, as a torque goes from hub to rim: T (R - r)/(R n Z).

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


def arm_width(moment: float, stress: float, aspect: float = 0.5) -> float:
    """The greater axis (m) of an elliptical arm: w = (32 M/(pi q sigma))^(1/3), M its bending moment.

    Args:
        moment: M at the hub, N m: T (R - r)/(R n).
        stress: sigma that bending may cause, Pa.
        aspect: q, the smaller axis over the greater one.

    Source: Khurmi and Gupta, Machine Design, chapter 22 (q = 1/2).

    >>> round(arm_width(150.0, 3055774.907), 9)
    0.1

    """
    return float((32 * moment / (pi * aspect * stress)) ** (1 / 3))


def shaft_diameter(torque: float, shear: float) -> float:
    """Diameter (m) of a shaft that carries a torque: d = (16 T/(pi tau))^(1/3). A hub usually has twice that.

    Args:
        torque: T, the greatest, N m.
        shear: tau, allowable shear stress, Pa.

    Source: Khurmi and Gupta, Machine Design, chapters 14 and 22.

    >>> round(shaft_diameter(3183.0, 40e6), 5)
    0.074

    """
    return float((16 * torque / (pi * shear)) ** (1 / 3))


def _check_count(count: int) -> None:
    if not fits(count) or count != int(count) or not FEWEST <= count <= MOST:
        raise SceneError([Fault("arms", f"{count}", f"a whole number from {FEWEST} to {MOST}")])
