"""Wheels of metal: size, mass and stresses of a wheel for an inertia and a speed."""

from flywheel.components.wheel_stresses import ARMS, DISC, LIGHTEST, RIM, WHEEL_SHAPES, Arms, Material, WheelAsked
from flywheel.components.wheels import (
    Body,
    Hub,
    Need,
    Part,
    Radius,
    Wheel,
    choose,
    inertia,
    least_mass,
    rounded,
    rounded_down,
    rounded_up,
    stress,
)

__all__ = [
    "ARMS", "DISC", "LIGHTEST", "RIM", "WHEEL_SHAPES", "Arms", "Body", "Hub", "Material", "Need", "Part", "Radius",
    "Wheel", "WheelAsked", "choose", "inertia", "least_mass", "rounded", "rounded_down", "rounded_up", "stress",
]  # fmt: skip
