"""Discs and annuli of constant width, rotating: mass, inertia, stress, and the radius that a stress allows."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


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


def disc_radius(inertia: float, width: float, density: float) -> float:
    """Radius (m) of a solid disc of given inertia and width: R = (2 I/(pi rho b))^(1/4).

    Args:
        inertia: I, kg m².
        width: b along the axis, m.
        density: rho, kg/m³.

    Source: Jindal, Machine Design, example 19-5.

    >>> round(disc_radius(441.7864669110647 / (0.1 * (250 * pi / 30) ** 2), 0.03, 7800.0), 9)
    0.363902346

    """
    return float((2 * inertia / (pi * density * width)) ** 0.25)


def disc_stresses(
    radius: ArrayLike, outer: float, inner: float, density: float, omega: float, nu: float
) -> tuple[Array, Array]:
    """Radial and hoop stress (Pa) in a rotating disc, with a hole of radius r = inner or without one.

    sigma_r = (3 + nu)/8 rho w² (R² + r² - R² r²/x² - x²),
    sigma_t = rho w²/8 ((3 + nu) (R² + r² + R² r²/x²) - (1 + 3 nu) x²).

    Args:
        radius: x, m, any shape, from r to R.
        outer: R, m.
        inner: r, m; 0 for a solid disc.
        density: rho, kg/m³.
        omega: w, rad/s.
        nu: Poisson's ratio.

    Valid for a disc of constant width that is thin along its axis (plane stress), elastic, and free at its edges.
    Source: S. Timoshenko, Strength of Materials, part II, rotating disc of uniform thickness.

    >>> radial, hoop = disc_stresses([0.0, 0.3], 0.3, 0.0, 7800.0, 100.0, 0.3)
    >>> radial.tolist(), hoop.round(0).tolist()
    ([2895750.0, 0.0], [2895750.0, 1228500.0])

    """
    x = np.asarray(radius, dtype=float)
    hole = (inner * outer / x) ** 2 if inner > 0.0 else np.zeros_like(x)
    both = outer * outer + inner * inner
    pull = density * omega * omega / 8
    radial = pull * (3 + nu) * (both - hole - x * x)
    hoop = pull * ((3 + nu) * (both + hole) - (1 + 3 * nu) * x * x)
    return radial, hoop


def greatest_disc_stress(outer: float, inner: float, density: float, omega: float, nu: float) -> float:
    """The greatest stress (Pa) in a rotating disc: the hoop stress in its centre, or at the edge of its hole.

    Solid: (3 + nu)/8 rho (w R)². With a hole, however small: rho w²/4 ((3 + nu) R² + (1 - nu) r²), twice as much at least.

    Args:
        outer: R, m.
        inner: r, m; 0 for a solid disc.
        density: rho, kg/m³.
        omega: w, rad/s.
        nu: Poisson's ratio.

    Validity and source as `disc_stresses`.

    >>> round(greatest_disc_stress(0.3639023457535473, 0.0, 7800.0, 250 * pi / 30, 0.3), 6)  # Jindal, example 19-5
    292028.689197

    """
    if inner <= 0.0:
        return (3 + nu) / 8 * density * (omega * outer) ** 2
    return density * omega * omega / 4 * ((3 + nu) * outer * outer + (1 - nu) * inner * inner)


def disc_radius_for_stress(stress: float, density: float, omega: float, nu: float) -> float:
    """The greatest radius (m) of a solid disc under a stress: R = sqrt(8 sigma/((3 + nu) rho))/w.

    Args:
        stress: sigma that it may have in its centre, Pa.
        density: rho, kg/m³.
        omega: w, rad/s.
        nu: Poisson's ratio.

    Validity and source as `disc_stresses`.

    >>> round(disc_radius_for_stress(292028.689197, 7800.0, 250 * pi / 30, 0.3), 9)
    0.363902346

    """
    return sqrt(8 * stress / ((3 + nu) * density)) / omega
