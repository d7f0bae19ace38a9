"""The keys of `[flywheel]` that say what the wheel is made of, and which of its dimensions are known."""

from __future__ import annotations

from flywheel.reading.schema import NOT_NEGATIVE, POSITIVE, Key, Range
from flywheel.wheel.arms import FEWEST, MOST
from flywheel.wheel.asked import METHODS, SHAPES, SPEEDS
from flywheel.wheel.materials import MATERIALS


def _size(name: str, about: str) -> Key:
    return Key(name, "length", about, None, POSITIVE)


def _number(name: str, about: str, example: str, values: Range = POSITIVE) -> Key:
    return Key(name, "number", about, None, values, example=example)


_SHARE = Range(0.0, 1.0, low_open=True)
MATERIAL_KEYS = (
    Key("material", "choice", "of the table", choices=tuple(MATERIALS)),
    Key("density", "density", "in place of the table's", None, POSITIVE),
    Key("allowable_stress", "pressure", "in place of the table's", None, POSITIVE),
    Key("strength", "pressure", "tensile or yield strength, in place of the table's", None, POSITIVE),
    _number("safety", "strength over allowable stress, in place of the table's", "4"),
    _number("poisson", "Poisson's ratio, in place of the table's", "0.3", Range(0.0, 0.5)),
)
WHEEL_KEYS = (
    Key("shape", "choice", "of the wheel", choices=SHAPES),
    *MATERIAL_KEYS,
    Key("method", "choice", "of inertia and stress: an annulus, or a rim at its mean radius", choices=METHODS),
    Key("at", "choice", "which speed of the shaft stresses and rim speeds are taken at", choices=SPEEDS),
    _size("outer_radius", "of the wheel"),
    _size("mean_radius", "of the rim"),
    _size("max_radius", "outer radius not to exceed"),
    Key("rim_speed", "velocity", "of the outer radius (of the mean one with method thin)", None, POSITIVE),
    _size("width", "of rim or disc, along the axis"),
    _size("thickness", "of the rim, along the radius"),
    _number("width_to_thickness", "of the rim", "2"),
    _number("rim_share", "of the inertia, where hub and arms have the rest", "0.9", _SHARE),
    _number("arms", "how many", "6", Range(FEWEST, MOST)),
    _number("arm_share", "section of one arm, as a share of the rim's", "0.25"),
    _size("arm_width", "of an arm's elliptical section, in the plane of rotation"),
    _size("arm_thickness", "of an arm's elliptical section, along the axis"),
    Key("bore", "length", "diameter of the hole for the shaft", None, NOT_NEGATIVE),
    _size("hub_diameter", "where the arms stand on it"),
    _size("hub_length", "along the axis"),
    Key("torque", "torque", "the greatest between hub and rim, which bends the arms", None, NOT_NEGATIVE),
    Key("step", "inertia", "to a multiple of which the inertia is rounded up", None, POSITIVE),
    _size("size_step", "to a multiple of which dimensions are rounded"),
)
