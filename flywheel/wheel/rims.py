"""Thin rims: a ring whose mass all runs at its mean radius, as textbooks take it."""

from __future__ import annotations

from math import pi, sqrt


def hoop_stress(velocity: float, density: float) -> float:
    """Hoop stress (Pa) in a thin ring that runs at a speed: sigma = rho v².

    Args:
        velocity: v of its mean radius, m/s.
        density: rho, kg/m³.

    Valid for a thin ring that nothing holds from inside. Source: Khurmi and Gupta, Theory of Machines, section 16.13.

    >>> hoop_stress(25.0, 7200.0)
    4500000.0

    """
    return density * velocity * velocity


def rim_velocity(stress: float, density: float) -> float:
    """The speed (m/s) at which a thin ring has a hoop stress: v = sqrt(sigma/rho). Its mean diameter is then 2 v/w.

    Args:
        stress: sigma, Pa.
        density: rho, kg/m³.

    Validity and source as `hoop_stress`.

    >>> round(2 * rim_velocity(7.5e6, 8150.0) / (100 * pi / 30), 9)  # Khurmi, example 16.17
    5.793662667

    """
    return sqrt(stress / density)


def rim_mass(inertia: float, radius: float, share: float = 1.0) -> float:
    """Mass (kg) of a thin rim that has a share of a wheel's inertia: m = a I/R².

    Args:
        inertia: I of the whole wheel, kg m².
        radius: R, mean radius of the rim, m.
        share: a, what of the inertia the rim has; hub and arms have the rest.

    Valid for a thin rim: one of thickness t has (t/2R)² more inertia. Source: Khurmi and Gupta, Theory of Machines, ch. 16.

    >>> rim_mass(4000.0, 1.0, 0.95)
    3800.0

    """
    return share * inertia / radius**2


def rim_section(mass: float, radius: float, density: float) -> float:
    """Area (m²) of a rim's section: A = m/(2 pi R rho). Exact, by Pappus, with R the mean radius.

    Args:
        mass: m of the rim, kg.
        radius: R, its mean radius, m.
        density: rho, kg/m³.

    >>> round(rim_section(3806.965371717721, 1.0, 7200.0), 12)  # Khurmi, example 16.15
    0.084152410707

    """
    return mass / (2 * pi * radius * density)


def section_sides(area: float, ratio: float) -> tuple[float, float]:
    """Thickness t and width b (m) of a rectangle: t = sqrt(A/k), b = k t.

    Args:
        area: A, m².
        ratio: k = b/t.

    >>> section_sides(0.01, 4.0)
    (0.05, 0.2)

    """
    thickness = sqrt(area / ratio)
    return thickness, ratio * thickness
