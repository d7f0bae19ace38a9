"""Models of loads: belts, resistances, presses."""

from flywheel.components.load_models import (
    CONSTANT,
    FORCE_SHAPES,
    FULLNESS,
    TRIANGULAR,
    Press,
    Resistance,
    belt_torque,
    greatest_force,
    press_force,
    quadratic_coefficient,
    resistance,
    sheared_area,
    tension_ratio,
)
from flywheel.load_models import gas as gas

__all__ = [
    "CONSTANT", "FORCE_SHAPES", "FULLNESS", "TRIANGULAR", "Press", "Resistance", "belt_torque", "greatest_force",
    "press_force", "quadratic_coefficient", "resistance", "sheared_area", "tension_ratio",
]  # fmt: skip
