"""Equivalent masses: a body as points that have its mass, centre and inertia."""

from flywheel.components.equivalent_masses import (
    Equivalent,
    Residual,
    compare,
    conjugate,
    correction_couple,
    equivalent_masses,
    four_masses,
    ten_masses,
    three_masses,
    two_masses,
)

__all__ = [
    "Equivalent",
    "Residual",
    "compare",
    "conjugate",
    "correction_couple",
    "equivalent_masses",
    "four_masses",
    "ten_masses",
    "three_masses",
    "two_masses",
]
