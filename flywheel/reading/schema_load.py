"""The keys of a load's `model`, type by type."""

from __future__ import annotations

import math

from flywheel.load_models.gas import ATMOSPHERE
from flywheel.load_models.presses import CONSTANT, SHAPES
from flywheel.reading.schema import NOT_NEGATIVE, POSITIVE, Key, Range, Section

MOST_ROWS = 100
"""How many rows an indicator diagram against the piston's position may have."""

_EXPONENT = Range(0.5, 10.0)
_SPEED = Key("speed", "speed", "of the shaft, at which it takes that much", None, POSITIVE)
_POWER = Key("power", "power", "that it takes at its speed", None, POSITIVE)
_FORCE = Key("force", "force", "against the motion, on a place that translates", None, POSITIVE)
_TORQUE = Key("torque", "torque", "against the motion, on a place that rotates", None, POSITIVE)
_ATMOSPHERE = Key("atmosphere", "pressure", "absolute pressure behind the piston", ATMOSPHERE, NOT_NEGATIVE)
_BORE = Key("bore", "length", "diameter of the cylinder", None, POSITIVE, True)


def _end(name: str, about: str) -> Key:
    return Key(name, "choice", about, "max", choices=("max", "min"))


_FAN = (
    _TORQUE,
    _FORCE,
    _POWER,
    _SPEED,
    Key("velocity", "velocity", "of a place that translates, at which it takes that much", None, POSITIVE),
    Key("constant", "force | torque", "share that does not depend on speed", 0.0, NOT_NEGATIVE),
)
_LOSSES = (
    Key("constant", "force | torque", "share that does not depend on speed", 0.0, NOT_NEGATIVE),
    Key("proportional", "damping | angular damping", "share per speed", 0.0, NOT_NEGATIVE),
    Key("quadratic", "drag | angular drag", "share per square of the speed", 0.0, NOT_NEGATIVE),
)
_BELT = (
    Key("tight", "force", "tension of the tight side", None, POSITIVE),
    Key("slack", "force", "tension of the slack side", None, NOT_NEGATIVE),
    Key("radius", "length", "of the pulley, to the middle of the belt", None, POSITIVE),
    _POWER,
    _SPEED,
    Key(
        "friction",
        "number",
        "coefficient between belt and pulley, to check that it does not slip",
        None,
        POSITIVE,
        example="0.3",
    ),
    Key("wrap", "angle", "over which the belt lies on the pulley", None, POSITIVE),
    Key("groove", "angle", "of a V-belt's groove", math.pi, Range(0.0, math.pi, low_open=True)),
)
_PRESS = (
    Key("energy", "energy", "of a stroke", None, POSITIVE),
    Key("shear_strength", "pressure", "of the sheet", None, POSITIVE),
    Key("energy_per_area", "energy per area", "of what is sheared", None, POSITIVE),
    Key("thickness", "length", "of the sheet", None, POSITIVE),
    Key("diameter", "length", "of a round hole", None, POSITIVE),
    Key("perimeter", "length", "of a hole", None, POSITIVE),
    Key("area", "area", "that is sheared", None, POSITIVE),
    Key("angle", "angle", "of the mechanism's crank before the end, at which the force begins", None, POSITIVE),
    Key("shape", "choice", "of the force: it stays, or it falls to nothing", CONSTANT, choices=SHAPES),
    _end("end", "of the stroke towards which it presses: greatest or least displacement"),
    Key("overtravel", "length", "of the punch beyond the sheet", 0.0, NOT_NEGATIVE),
)
_INDICATOR = (
    _BORE,
    Key("rod", "length", "diameter of a rod that passes through this gas space", 0.0, NOT_NEGATIVE),
    _end("side", "where the cover of this gas space is: at the greatest or at the least displacement"),
    Key("table", "table", "pressure against angle"),
    Key("position", "numbers", "shares of the stroke from the cover, 0 to 1"),
    Key("volume", "numbers", "volumes instead, in any unit; the first and the last are those at the dead centres"),
    Key("out", "numbers", "pressures while the piston moves away from the cover"),
    Key("back", "numbers", "pressures while it returns"),
    Key("pressure_unit", "unit", "of out and back", "Pa"),
    Key("gauge", "flag", "true where pressures are those above the atmosphere"),
    _ATMOSPHERE,
)
_COMPRESSOR = (
    _BORE,
    Key("clearance", "number", "volume left at the cover, as a share of the swept volume", None, NOT_NEGATIVE, True),
    Key("suction", "pressure", "absolute", None, POSITIVE, True),
    Key("discharge", "pressure", "absolute", None, POSITIVE, True),
    Key("exponent", "number", "n of compression", None, _EXPONENT, True, example="1.3"),
    Key(
        "expansion_exponent",
        "number",
        "of the gas left in the clearance (default: exponent)",
        None,
        _EXPONENT,
        example="1.3",
    ),
    Key("double_acting", "flag", "true where both sides of the piston compress"),
    Key("rod", "length", "diameter of the rod, on the side away from the cover", 0.0, NOT_NEGATIVE),
    _end("side", "where the cover is: at the greatest or at the least displacement"),
    _ATMOSPHERE,
)

_ABOUTS = {
    "constant": ("a force or torque against the motion", (_FORCE, _TORQUE)),
    "fan": ("a fan: it grows with the square of the speed", _FAN),
    "pump": ("a centrifugal pump: as a fan", _FAN),
    "losses": ("bearings, rolling, windage: constant, proportional and quadratic shares", _LOSSES),
    "belt": ("the drag of a belt on its pulley", _BELT),
    "press": ("a press: the energy of a stroke, over the last of its way", _PRESS),
    "punch": ("a punch: as a press", _PRESS),
    "indicator": ("gas on a piston, from an indicator diagram", _INDICATOR),
    "compressor": ("gas of a reciprocating compressor", _COMPRESSOR),
}
TYPE = Key("type", "choice", "of the machine", required=True, choices=tuple(_ABOUTS))

LOAD_MODELS = {name: Section("load.model", about, (TYPE, *keys)) for name, (about, keys) in _ABOUTS.items()}
"""What a load's model may be, each with its keys."""
